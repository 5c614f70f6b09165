// `shakebed bench` as a program, and the arithmetic of its pages. No time is judged here.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "pipelines/formats/errors.hpp"
#include "tests/bench/program/choice.hpp"
#include "tests/bench/program/document.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
using namespace shakebed::pipelines;

TEST(BenchCommand, WritesOnePageThatNeedsNothingElseAndComparesWithItself) {
  ScratchFolder folder;
  const ProgramResult first =
      run_shakebed({"bench", "fit", "--quick", "--json", "--quiet", "--out", "o"}, folder.path());
  const Json json = Json::parse(first.out);
  EXPECT_EQ(first.exit_code, 0) << first.err;
  for (const Json& one : json["stages"][0]["hard_cases"]) EXPECT_TRUE(one["pass"].get<bool>()) << one;
  EXPECT_EQ(json["stages"].size(), 1u);
  EXPECT_GT(json["stages"][0]["hard_cases"].size(), 10u);
  EXPECT_GT(json["stages"][0]["metrics"].size(), 5u);
  EXPECT_FALSE(json["machine"]["processor"].get<std::string>().empty());
  const std::string page = read_text(folder / "o/bench.html");
  EXPECT_NE(page.find("<svg"), std::string::npos);
  for (const char* outside : {"<script src", "<link rel=\"stylesheet", "src=\"http", "href=\"http", "@import"})
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  EXPECT_FALSE(std::filesystem::exists(folder / "o/scratch")) << "what it worked with is gone";

  write_text(folder / "earlier.json", first.out);
  const ProgramResult second = run_shakebed(
      {"bench", "fit", "--quick", "--json", "--quiet", "--out", "o", "--against", "earlier.json"}, folder.path());
  EXPECT_EQ(second.exit_code, 0) << second.err;
  const Json again = Json::parse(second.out);
  EXPECT_EQ(again["against"]["rows"].size(), json["stages"][0]["metrics"].size());
}

// All of its hard cases, and every kind of bed it times.
TEST(BenchCommandLong, SimulateRunsToItsEndAndItsHardCasesHold) {
  ScratchFolder folder;
  const ProgramResult done =
      run_shakebed({"bench", "simulate", "--quick", "--json", "--quiet", "--out", "o"}, folder.path());
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const Json json = Json::parse(done.out);
  EXPECT_GT(json["stages"][0]["hard_cases"].size(), 15U);
  for (const Json& one : json["stages"][0]["hard_cases"]) EXPECT_TRUE(one["pass"].get<bool>()) << one;
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
    });
  };
  EXPECT_TRUE(verdict(0.5, 10, false).pass);
  EXPECT_FALSE(verdict(2, 10, false).pass);
  EXPECT_FALSE(verdict(std::nan(""), 10, false).pass) << "a NaN is within no limit";
  EXPECT_FALSE(verdict(0.5, -1, false).pass) << "a limit that any time exceeds";
  EXPECT_FALSE(verdict(0.5, 10, true).pass);
  EXPECT_EQ(verdict(0.5, 10, true).note, "no");
}

TEST(BenchHardCases, AreNamedWhenTheyFail) {
  bench::Document document;
  document.stages.resize(1);
  document.stages[0].name = "fit";
  document.stages[0].hard_cases.resize(2);
  document.stages[0].hard_cases[0].name = "four bins", document.stages[0].hard_cases[0].pass = true;
  EXPECT_TRUE(bench::failed_cases({}).empty());
  document.stages[0].hard_cases[1].name = "no bins", document.stages[0].hard_cases[1].note = "a NaN";
  EXPECT_THAT(bench::failed_cases(document), testing::ElementsAre("hard case failed: fit: no bins: a NaN"));
}

// A laboratory whose truth is known: settings with a bias and a scatter of their own, measured with beds as often as
// asked.
struct Truth {
  double cost, bias, scatter;
  double rms() const { return std::hypot(bias, scatter); }
};
bench::Measured measure(const Truth& truth, int beds, std::mt19937_64& random) {
  bench::Measured measured{truth.cost, 0, beds, 0};
  std::normal_distribution<double> error(truth.bias, truth.scatter);
  for (int bed = 0; bed < beds; ++bed) {
    const double one = error(random);
    measured.squares += one * one;
  }
  return measured;
}

struct Outcomes {
  int wrong = 0, none = 0, lucky = 0;  // named though it does not keep 1 %; nothing named; the naive choice wrong
};
Outcomes choose_often(const std::vector<Truth>& truths, int times, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Outcomes outcomes;
  for (int i = 0; i < times; ++i) {
    std::vector<bench::Measured> known;
    for (const Truth& truth : truths) known.push_back(measure(truth, 8, random));
    const bench::Choice choice =
        bench::choose_setting(known, 0.01, [&](std::size_t setting) { return measure(truths[setting], 20, random); });
    outcomes.none += !choice.setting;
    outcomes.wrong += choice.setting && truths[*choice.setting].rms() > 0.01;
    // What choosing by the first measurement alone would name.
    const auto naive =
        std::find_if(known.begin(), known.end(), [](const auto& one) { return one.squares <= 8 * 0.01 * 0.01; });
    outcomes.lucky += naive != known.end() && truths[static_cast<std::size_t>(naive - known.begin())].rms() > 0.01;
  }
  return outcomes;
}

TEST(BenchChoice, LuckNamesNoSetting) {
  // A hundred cheap settings of 1.7 % (a bias of 1 % and noise), then dear ones that keep 1 %.
  std::vector<Truth> truths;
  for (int i = 0; i < 100; ++i) truths.push_back({1.0 + 0.01 * i, i % 2 == 0 ? 0.01 : 0, i % 2 == 0 ? 0.0137 : 0.017});
  for (int i = 0; i < 4; ++i) truths.push_back({20.0 + i, 0.003, 0.004});
  const Outcomes outcomes = choose_often(truths, 500, 1);
  EXPECT_GT(outcomes.lucky, 450) << "the first measurement alone would name a lucky one nearly always";
  EXPECT_LT(outcomes.wrong, 5) << "1.7 % is far from the goal: such a setting passes no second measurement";
}

TEST(BenchChoice, ASettingJustAboveTheGoalIsNamedAtMostAsOftenAsStated) {
  // 2,000 choices; 5 % of them are 100 +- 10: at most 130 is three standard deviations (significance 1e-3).
  for (const double bias : {0.0, 0.009}) {
    const std::vector<Truth> truths(30, {1, bias, std::sqrt(0.01001 * 0.01001 - bias * bias)});
    const Outcomes outcomes = choose_often(truths, 2000, 2);
    EXPECT_LT(outcomes.wrong, 130) << "bias " << bias;
  }
}

TEST(BenchChoice, FindsTheCheapestSettingThatKeepsTheGoal) {
  const std::vector<Truth> truths = {{1, 0, 0.03}, {2, 0.01, 0.01}, {9, 0.003, 0.004}, {30, 0, 0.004}};
  std::mt19937_64 random(3);
  int cheapest = 0, any = 0;
  for (int i = 0; i < 500; ++i) {
    std::vector<bench::Measured> known;
    for (const Truth& truth : truths) known.push_back(measure(truth, 8, random));
    const bench::Choice choice =
        bench::choose_setting(known, 0.01, [&](std::size_t setting) { return measure(truths[setting], 20, random); });
    cheapest += choice.setting == 2u, any += choice.setting.has_value();
  }
  EXPECT_GT(cheapest, 440);
  EXPECT_GT(any, 490);
}

TEST(BenchChoice, BoundsHoldAsOftenAsTheySay) {
  // Chi-square of 10 degrees of freedom is below 3.9403 with probability 5 %.
  EXPECT_NEAR(bench::upper_bound_of_rms(10, 10, 0.05), std::sqrt(10 / 3.940299), 1e-6);
  EXPECT_NEAR(bench::upper_bound_of_rms(4, 1, 0.05), 2 / 0.0627068, 1e-4);
  EXPECT_TRUE(std::isnan(bench::upper_bound_of_rms(1, 0, 0.05)));
  EXPECT_EQ(bench::upper_bound_of_rms(0, 5, 0.05), 0);
}

TEST(BenchChoice, ABedThatGivesNoNumberForbidsItsSetting) {
  int asked = 0;
  const auto again = [&](std::size_t setting) {
    ++asked;
    return bench::Measured{1, 1e-6, 20, setting == 1 ? 1 : 0};
  };
  EXPECT_FALSE(bench::choose_setting({{1, 1e-6, 7, 1}}, 0.01, again).setting);
  EXPECT_EQ(asked, 0) << "at first";
  const bench::Choice choice = bench::choose_setting({{2, 1e-6, 8, 0}, {1, 1e-6, 8, 0}}, 0.01, again);
  EXPECT_EQ(choice.setting, 0u) << "measured again: the cheaper one fails";
  ASSERT_EQ(choice.tried.size(), 2u);
  EXPECT_EQ(choice.tried[0].setting, 1u);
  EXPECT_NEAR(choice.tried[0].level, 0.05 / 2, 1e-15);
  EXPECT_NEAR(choice.tried[1].level, 0.05 / 6, 1e-15);
  EXPECT_FALSE(bench::choose_setting({}, 0.01, again).setting);
}

TEST(BenchChoice, StopsWhenItsBudgetIsSpentAndSaysSo) {
  const std::vector<bench::Measured> known(5, {1, 1e-6, 8, 0});
  const auto never = [](std::size_t) { return bench::Measured{1, 1, 20, 0}; };
  const bench::Choice choice = bench::choose_setting(known, 0.01, never, {.budget = 30});
  EXPECT_EQ(choice.tried.size(), 2u) << "20 s a try: the second begins before 30 s are spent";
  EXPECT_TRUE(choice.out_of_budget);
  EXPECT_FALSE(bench::choose_setting(known, 0.01, never).out_of_budget) << "all five were tried";
  EXPECT_EQ(bench::choose_setting(known, 0.01, never, {.most_tries = 3}).tried.size(), 3u);
}

}  // namespace
