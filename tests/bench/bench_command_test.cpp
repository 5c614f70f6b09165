// `shakebed bench` as a program, and the arithmetic of its pages. No time is judged here.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "pipelines/bench/document.hpp"
#include "pipelines/errors.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
using namespace shakebed::pipelines;

TEST(BenchCommand, WritesOnePageThatNeedsNothingElseAndComparesWithItself) {
  ScratchFolder folder;
  const ProgramResult first =
      run_shakebed({"bench", "fit", "--quick", "--json", "--quiet", "--out", "o"}, folder.path());
  const Json json = Json::parse(first.out);
  bool all_pass = true;
  for (const Json& one : json["stages"][0]["hard_cases"]) all_pass = all_pass && one["pass"].get<bool>();
  EXPECT_EQ(first.exit_code, all_pass ? 0 : 6) << first.err;
  EXPECT_EQ(json["stages"].size(), 1u);
  EXPECT_GT(json["stages"][0]["hard_cases"].size(), 10u);
  EXPECT_GT(json["stages"][0]["metrics"].size(), 5u);
  EXPECT_FALSE(json["machine"]["processor"].get<std::string>().empty());
  const std::string page = read_text(folder / "o/bench.html");
  EXPECT_NE(page.find("<svg"), std::string::npos);
  for (const char* outside : {"<script", "<link rel=\"stylesheet", "src=\"http", "href=\"http", "@import"})
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  EXPECT_FALSE(std::filesystem::exists(folder / "o/scratch")) << "what it worked with is gone";

  write_text(folder / "earlier.json", first.out);
  const ProgramResult second = run_shakebed(
      {"bench", "fit", "--quick", "--json", "--quiet", "--out", "o", "--against", "earlier.json"}, folder.path());
  const Json again = Json::parse(second.out);
  EXPECT_EQ(again["against"]["rows"].size(), json["stages"][0]["metrics"].size());
}

TEST(BenchCommand, RefusesWhatItCannotCompareWithBeforeItBegins) {
  ScratchFolder folder;
  write_text(folder / "other.json", "{\"kind\": \"something else\"}");
  write_text(folder / "broken.json", "{");
  EXPECT_EQ(run_shakebed({"bench", "fit", "--against", "other.json"}, folder.path()).exit_code, 4);
  EXPECT_EQ(run_shakebed({"bench", "fit", "--against", "broken.json"}, folder.path()).exit_code, 4);
  EXPECT_EQ(run_shakebed({"bench", "fit", "--against", "nowhere.json"}, folder.path()).exit_code, 4);
  EXPECT_EQ(run_shakebed({"bench", "cooking"}, folder.path()).exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder / "results"));
}

TEST(BenchFigures, FrontHoldsWhatNothingElseBeats) {
  bench::Figure figure;
  figure.curves = {{"a", {1, 2, 3}, {0.5, 0.4, 0.6}}, {"b", {2, 0.5, 4}, {0.3, 0.9, 0.3}}};
  bench::Curve limit{"limit", {0.1}, {0.01}};
  limit.limit = true;
  figure.curves.push_back(limit);
  figure.curves.push_back({"none", {0, 1}, {0.1, -1}});  // not drawable
  std::vector<std::pair<double, double>> front;
  for (const bench::FrontPoint& point : bench::pareto_front(figure)) front.emplace_back(point.cost, point.error);
  EXPECT_THAT(front, testing::ElementsAre(testing::Pair(0.5, 0.9), testing::Pair(1, 0.5), testing::Pair(2, 0.3)));
}

TEST(BenchFigures, ExponentsAreThoseOfPowerLaws) {
  EXPECT_NEAR(*bench::exponent({1, 10, 100}, {3, 3 * std::pow(10, 1.5), 3000}), 1.5, 1e-12);
  EXPECT_FALSE(bench::exponent({1}, {1}));
  EXPECT_FALSE(bench::exponent({2, 2}, {1, 3}));
  EXPECT_NEAR(*bench::exponent({1, 10, 0, 5}, {1, 10, 7, -2}), 1, 1e-12) << "what has no logarithm does not count";
}

TEST(BenchFigures, ComparisonsSayWhatIsBetter) {
  bench::StageResult stage;
  stage.name = "x";
  stage.metrics = {{"time", "s", 1, false}, {"rate", "1/s", 1, true}, {"new", "s", 1, false}};
  const Json earlier{
      {"kind", "shakebed-bench"},
      {"stages",
       Json::array({Json{{"stage", "x"}, {"metrics", {{"time", {{"value", 2.0}}}, {"rate", {{"value", 2.0}}}}}}})}};
  const bench::Table table = bench::comparison({stage}, earlier, "then.json");
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(table.rows[0].back(), "better");
  EXPECT_EQ(table.rows[1].back(), "worse");
  EXPECT_DOUBLE_EQ(table.rows[0][4].get<double>(), 0.5);
  EXPECT_THROW(bench::comparison({stage}, Json::array(), "then.json"), InputError);
}

TEST(BenchHardCases, FailByErrorByTimeOrByAnException) {
  const auto verdict = [](double error, double time_limit, bool throws) {
    return bench::run_hard_case("c", "u", 1, time_limit, [&](bench::HardCase& one) {
      if (throws) throw StageError("no");
      one.error = error;
      const double start = bench::cpu_seconds();
      while (bench::cpu_seconds() - start < 0.002) {}
    });
  };
  EXPECT_TRUE(verdict(0.5, 10, false).pass);
  EXPECT_FALSE(verdict(2, 10, false).pass);
  EXPECT_FALSE(verdict(std::nan(""), 10, false).pass) << "a NaN is within no limit";
  EXPECT_FALSE(verdict(0.5, 0.001, false).pass);
  EXPECT_FALSE(verdict(0.5, 10, true).pass);
  EXPECT_EQ(verdict(0.5, 10, true).note, "no");
}

}  // namespace
