// Warnings of a sweep's points, each kind once.
#include "pipelines/runner/gathered_warnings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "tests/pipelines/program.hpp"

namespace shakebed::pipelines {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(GatheredWarnings, NameEachKindOnceWithItsPoints) {
  GatheredWarnings all;
  EXPECT_THAT(all.lines(), IsEmpty());
  all.add("a", Json{"fit: chi2/dof = 40.7, p = 2.4e-22", "bed: T_x differs by -0.5 D"});
  all.add("b", Json{"fit: chi2/dof = 1.2e+03, p = 0"});
  all.add("c", Json{"fit: chi2/dof = 3, p = 1e-4", "fit: chi2/dof = 4, p = 1"});  // twice in one point: one point
  all.add("d", Json{"another one"});
  all.add("e", Json::array());
  EXPECT_THAT(all.lines(), ElementsAre("fit: chi2/dof = 40.7, p = 2.4e-22 (3 points: a, b, c; the numbers in this "
                                       "message are those of the first point)",
                                       "bed: T_x differs by -0.5 D (point a)", "another one (point d)"));
}

TEST(GatheredWarnings, KeepWordsApartThatDifferInMoreThanNumbers) {
  GatheredWarnings all;
  all.add("a", Json{"bed 1: e = 0.9"});
  all.add("b", Json{"bed 2: f = 0.9"});
  EXPECT_EQ(all.lines().size(), 2u);
}

// The verdict of every point: in its row, counted in the summary and on the page.
TEST(Sweeps, SayTheVerdictOfEveryPoint) {
  using namespace shakebed::tests;
  const ScratchFolder folder;
  // The first bed is a gas in a bath, the second is shaken and has a T_x and another T_z.
  write_text(folder / "r.json", R"({ "name": "t", "stages": [
    { "stage": "simulate", "id": "bed", "seed": 1, "replicas": 1, "units": "reduced",
      "disks": { "count": 60, "restitution": 0.8 }, "box": { "width": 10, "sides": "periodic" },
      "floor": { "motion": "sinusoidal", "amplitude": 0.8, "frequency": 0.4, "restitution": 0.8 },
      "settle": 100, "measure": 400 },
    { "stage": "fit", "from": "bed" } ],
    "sweep": { "over": { "/stages/bed/floor/amplitude": [0.6, 1.2] } } })");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json summary = Json::parse(read_text(folder / "o/summary.json"));
  std::map<std::string, std::size_t> verdicts;
  const std::string table = read_text(folder / "o/sweep.csv");
  for (const std::string point : {"000000", "000001"}) {
    const Json answer = Json::parse(read_text(folder / "o/points" / point / "fit/fit.json"))["answer"];
    const std::size_t row = table.find("\n" + point + ","), end = table.find('\n', row + 1);
    ASSERT_NE(row, std::string::npos);
    const std::string line = table.substr(row + 1, end - row - 1);
    const auto verdict = answer["verdict"].get<std::string>();
    EXPECT_TRUE(line.ends_with("," + verdict)) << line;
    ++verdicts[verdict];
    // A range has its two ends and no standard error.
    const bool range = verdict == "no single temperature";
    EXPECT_EQ(answer["temperature"]["std_error"].is_null(), range);
    EXPECT_THAT(line, testing::HasSubstr("," + answer["temperature"]["value"].dump() + "," +
                                         (range ? "" : answer["temperature"]["std_error"].dump()) + "," +
                                         answer["interval"]["low"]["value"].dump() + ",," +
                                         answer["interval"]["high"]["value"].dump() + ",,"));
    EXPECT_THAT(read_text(folder / "o/report.html"), testing::HasSubstr(verdict));
    EXPECT_THAT(ran.out, testing::HasSubstr(verdict));
  }
  EXPECT_EQ(summary["verdicts"], Json(verdicts));
  // A point that has not run has none.
  ASSERT_EQ(run_shakebed({"run", "r.json", "--out", "half", "--shard", "2/2"}, folder.path()).exit_code, 0);
  run_shakebed({"run", "r.json", "--out", "half", "--gather"}, folder.path());
  const Json half = Json::parse(read_text(folder / "half/summary.json"));
  EXPECT_EQ(half["missing"], 1);
  EXPECT_EQ(half["verdicts"].size(), 1U);
  EXPECT_FALSE(half["verdicts"].contains(""));
}

}  // namespace
}  // namespace shakebed::pipelines
