// Numbers on the pages for people: ours beside the published ones, and the tables of sweeps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/read_table.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::Json;
using testing::HasSubstr;
using testing::Not;

// A fit of a profile of the user's own, beside numbers in several units.
class PublishedNumbers : public testing::Test {
 protected:
  PublishedNumbers() {
    std::string profile = "# kernel: gaussian:0.5\n# column_number: 10\nheight,number_density,std_error\n";
    for (int i = 0; i < 40; ++i) {
      const double z = 0.5 + 0.4 * i;
      profile += std::to_string(z) + "," + std::to_string(1.1 / (1 + std::exp((z - 9) / 1.2))) + ",0.01\n";
    }
    write_text(folder_ / "p.csv", profile);
  }
  void run(const std::string& published) {
    write_text(folder_ / "r.json", R"({ "name": "t", "report": { "published": [ )" + published + R"( ] },
      "stages": [ { "stage": "fit", "profile": "p.csv", "diameter": "3 mm", "answer": false, "sweep": false } ] })");
    const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder_.path());
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    page_ = read_text(folder_ / "o/report.html");
    fit_ = Json::parse(read_text(folder_ / "o/fit/fit.json"));
  }
  double value(const char* key) const { return fit_[key]["value"].get<double>(); }
  double error(const char* key) const { return fit_[key]["std_error"].get<double>(); }
  ScratchFolder folder_;
  std::string page_;
  Json fit_;
};

std::string cell(const char* format, double a, double b) {
  char text[100];
  std::snprintf(text, sizeof text, format, a, b);
  return text;
}

TEST_F(PublishedNumbers, StandBesideTheAnswerWhereTheRecipeSaysSoAndTheFirstAlways) {
  run(R"({ "number": "/fit/temperature", "label": "first", "value": "1.25" },
         { "number": "/fit/temperature", "label": "second", "value": "1.26" },
         { "number": "/fit/temperature_over_mg", "label": "third", "value": "3 mm", "beside_answer": true })");
  const std::size_t begin = page_.find("aria-label=\"numbers beside the answer\"");
  ASSERT_NE(begin, std::string::npos);
  const std::string beside = page_.substr(begin, page_.find("</section>", begin) - begin);
  EXPECT_THAT(beside, HasSubstr("<dt>first</dt>"));
  EXPECT_THAT(beside, Not(HasSubstr("<dt>second</dt>")));
  const double mm = 1e3 * value("temperature_over_mg"), mm_error = 1e3 * error("temperature_over_mg");
  EXPECT_THAT(beside, HasSubstr("<dt>third</dt><dd>" + cell("%.4g ± %.2g mm", mm, mm_error)));
}

TEST_F(PublishedNumbers, StandBesideOursInTheUnitOfThePrint) {
  run(R"({ "number": "/fit/temperature_over_mg", "label": "mm", "value": "3.0 mm", "relative": 0.5 },
         { "number": "/fit/temperature_over_mg", "label": "um", "value": "2000 um", "relative": 0.01 },
         { "number": "/fit/temperature", "label": "plain", "value": "1.25", "relative": 0.5 },
         { "number": "/fit/solid_height", "label": "D", "value": "9", "relative": 0.9 })");
  ASSERT_GT(error("temperature_over_mg"), 0);
  EXPECT_DOUBLE_EQ(error("temperature_over_mg"), 3e-3 * error("temperature"));
  const double mm = 1e3 * value("temperature_over_mg"), mm_error = 1e3 * error("temperature_over_mg");
  EXPECT_THAT(page_, HasSubstr(">" + cell("%.4g ± %.2g mm", mm, mm_error) + "<"));
  EXPECT_THAT(page_, HasSubstr(">" + cell("%.4g ± %.2g um", 1e3 * mm, 1e3 * mm_error) + "<"));
  EXPECT_THAT(page_, HasSubstr(">" + cell("%.4g ± %.2g m g D", value("temperature"), error("temperature")) + "<"));
  const double off = mm / 3 - 1, off_um = mm / 2 - 1, off_plain = value("temperature") / 1.25 - 1;
  EXPECT_THAT(page_, HasSubstr(cell(std::abs(off) <= 0.5 ? "agrees (%+.1f %%)" : "differs (%+.1f %%)", 100 * off, 0)));
  EXPECT_THAT(page_, HasSubstr(cell("differs (%+.1f %%)", 100 * off_um, 0)));
  EXPECT_THAT(page_, HasSubstr(cell(std::abs(off_plain) <= 0.5 ? "agrees (%+.1f %%)" : "differs (%+.1f %%)",
                                    100 * off_plain, 0)));
}

// A sweep over quantities in different units: its table holds SI numbers, the unit in the name of the column.
TEST(SweepTable, HoldsItsAxesInSi) {
  const ScratchFolder folder;
  write_text(folder / "r.json", R"({ "name": "t",
    "sweep": { "kind": "zip", "over": { "/stages/map/diameter": ["3 mm", "0.4 cm"], "/stages/map/frequency": ["20 Hz", "0.03 kHz"] },
               "collect": ["/map/diameter", "/map/critical_temperature"] },
    "stages": [ { "stage": "map", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 } ] })");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const NumberTable table(folder / "o/sweep.csv");
  ASSERT_EQ(table.rows(), 2U);
  std::size_t seen = 0;
  for (const std::string& name : table.header()) {
    if (name.starts_with("map_diameter") && name.find("std_error") == std::string::npos) {
      EXPECT_DOUBLE_EQ(table(name, 0), 0.003) << name;
      EXPECT_DOUBLE_EQ(table(name, 1), 0.004) << name;
      EXPECT_TRUE(name.ends_with("_m")) << name;
      ++seen;
    }
    if (name.starts_with("map_frequency")) {
      EXPECT_DOUBLE_EQ(table(name, 1), 30) << name;
      ++seen;
    }
  }
  EXPECT_GE(seen, 2U);
  for (std::size_t r = 0; r < 2; ++r) EXPECT_EQ(table.text("status", r), "ok");
}

// A number over two parameters: a map of up to forty columns. The number is a parameter itself, so each row is known.
TEST(SweepTable, OfTwoParametersIsAMapOfAtMostFortyColumns) {
  const ScratchFolder folder;
  const auto page = [&](int columns) {
    std::string gammas = "2";
    for (int i = 1; i < columns; ++i) gammas += ", " + std::to_string(2 + 0.0625 * i);
    write_text(folder / "r.json", R"({ "name": "t", "sweep": { "over": { "/stages/map/gamma": [)" + gammas +
                                      R"(], "/stages/map/diameter": ["3 mm", "4 mm"] }, "collect": ["/map/diameter"] },
      "stages": [ { "stage": "map", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 } ] })");
    const std::string out = std::to_string(columns);
    EXPECT_EQ(run_shakebed({"run", "r.json", "--out", out}, folder.path()).exit_code, 0);
    return read_text(folder / (out + "/report.html"));
  };
  const std::string widest = page(40);
  const auto from = widest.find("<table class=\"map\">");
  ASSERT_NE(from, std::string::npos);
  const std::string map = widest.substr(from, widest.find("</table>", from) - from);
  const auto count = [&](const std::string& words) {
    std::size_t found = 0;
    for (std::size_t at = map.find(words); at != std::string::npos; at = map.find(words, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("<th scope=\"col\">"), 40U);
  EXPECT_EQ(count("<th scope=\"col\">2.125</th>"), 1U);
  const auto rows = map.find("<th scope=\"row\">4</th>");
  ASSERT_NE(rows, std::string::npos);
  EXPECT_LT(map.find("<th scope=\"row\">3</th>"), rows);
  EXPECT_EQ(count("\">3</td>"), 40U);
  EXPECT_EQ(count("\">4</td>"), 40U);
  EXPECT_GT(map.find("\">4</td>"), rows);
  EXPECT_EQ(page(41).find("<table class=\"map\">"), std::string::npos);
}

// A point's numbers depend on its values alone: not on its place in the sweep, nor on the shard that ran it.
TEST(SweepTable, DoesNotSeeTheOrderOfItsPointsNorTheirShards) {
  const ScratchFolder folder;
  const auto run = [&](const std::string& out, const std::string& values, const std::vector<std::string>& shards) {
    write_text(folder / "r.json", R"({ "name": "t", "sweep": { "over": { "/stages/bed/floor/amplitude": )" + values +
                                      R"( }, "collect": ["/bed/temperature_x", "/bed/center_of_mass"] },
      "stages": [ { "stage": "simulate", "id": "bed", "seed": 3, "units": "reduced",
        "disks": { "count": 20, "restitution": 0.9 }, "box": { "width": 5.3, "sides": "periodic" },
        "floor": { "motion": "sinusoidal", "amplitude": 1, "frequency": 0.35, "restitution": 0.9 },
        "settle": 2, "measure": 6 } ] })");
    for (const std::string& shard : shards) {
      std::vector<std::string> arguments{"run", "r.json", "--out", out};
      if (!shard.empty()) arguments.insert(arguments.end(), {"--shard", shard});
      EXPECT_EQ(run_shakebed(arguments, folder.path()).exit_code, 0) << shard;
    }
    const NumberTable table(folder / (out + "/sweep.csv"));
    std::map<double, std::vector<double>> found;
    for (std::size_t r = 0; r < table.rows(); ++r)
      for (const char* column : {"bed_temperature_x", "bed_temperature_x_std_error", "bed_center_of_mass"})
        found[table("bed_floor_amplitude", r)].push_back(table(column, r));
    return found;
  };
  const auto plain = run("plain", "[0.7, 0.9, 1.2]", {""});
  ASSERT_EQ(plain.size(), 3U);
  EXPECT_EQ(run("turned", "[1.2, 0.7, 0.9]", {""}), plain);
  EXPECT_EQ(run("shards", "[0.7, 0.9, 1.2]", {"2/2", "1/2"}), plain);
}

// Other numbers are read from the points that are there; a result with the name of an axis has a column of its own.
TEST(SweepTable, HoldsOtherNumbersWhenTheRecipeAsksForThem) {
  const ScratchFolder folder;
  const auto run = [&](const std::string& collect) {
    write_text(folder / "r.json",
               R"({ "name": "t", "sweep": { "over": { "/stages/map/gamma": [3, 5] }, "collect": )" + collect + R"( },
      "stages": [ { "stage": "map", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 } ] })");
    const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o", "--quiet"}, folder.path());
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    EXPECT_THAT(ran.out, HasSubstr("2 of 2 points done"));
    return NumberTable(folder / "o/sweep.csv");
  };
  run(R"(["/map/critical_temperature"])");
  const NumberTable table = run(R"(["/map/gamma"])");
  EXPECT_THAT(table.header(), testing::ElementsAre("point", "replica", "status", "map_gamma", "map_gamma_result",
                                                   "map_gamma_result_std_error"));
  EXPECT_EQ(table("map_gamma", 1), 5);
  EXPECT_EQ(table("map_gamma_result", 1), 5);
}

// Points are known by their values: one more or one fewer in the list renames folders and runs only what is new.
TEST(SweepTable, KeepsWhatIsComputedWhenTheListOfValuesChanges) {
  const ScratchFolder folder;
  const auto run = [&](const std::string& values, const std::string& out, const std::string& more) {
    write_text(folder / "r.json", R"({ "name": "t", "sweep": { "over": { "/stages/map/gamma": )" + values +
                                      R"( }, "collect": ["/map/gamma", "/map/critical_temperature"] },
      "stages": [ { "stage": "map", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 } ] })");
    const ProgramResult ran = run_shakebed({"run", "r.json", "--out", out, more}, folder.path());
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return ran.out + ran.err;
  };
  const auto point = [&](const std::string& name) { return folder / ("o/points/" + name); };
  run("[3, 5, 6]", "o", "--quiet");
  for (const std::string name : {"000000", "000001", "000002"}) write_text(point(name) / "of", name);
  const std::string next = "[2, 3, 4, 6]";  // 3 and 6 move, 5 is left out
  EXPECT_THAT(run(next, "o", "--dry-run"), HasSubstr("2 of 4 points to run"));
  EXPECT_EQ(read_text(point("000000") / "of"), "000000") << "a dry run moves nothing";
  EXPECT_THAT(run(next, "o", "--jobs=1"), HasSubstr("4 points, 2 up to date, 2 to run"));
  EXPECT_EQ(read_text(point("000001") / "of"), "000000");
  EXPECT_EQ(read_text(point("000003") / "of"), "000002");
  run(next, "fresh", "--quiet");
  EXPECT_EQ(read_text(folder / "o/sweep.csv"), read_text(folder / "fresh/sweep.csv"));
  // 3 alone: it moves to the front, the others are kept and are none of the sweep's.
  run("[3]", "o", "--quiet");
  EXPECT_EQ(read_text(point("000000") / "of"), "000000");
  EXPECT_THAT(run_shakebed({"status", "o"}, folder.path()).out,
              testing::AllOf(HasSubstr("1 of 1 points done, 0 failed"), HasSubstr("3 folders of points")));
  // Turned round: two pairs of folders change places.
  EXPECT_THAT(run("[6, 4, 3, 2]", "o", "--jobs=1"), HasSubstr("4 points, 4 up to date, 0 to run"));
  EXPECT_EQ(read_text(point("000000") / "of"), "000002");
  EXPECT_EQ(read_text(point("000002") / "of"), "000000");
}

}  // namespace
