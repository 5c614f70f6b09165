// Cells of tables that hold commas or quotes, words of a recipe that are no JSON, warnings of a map, and budgets of
// many beds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/runner/budget.hpp"
#include "tests/pipelines/lone_stage.hpp"

namespace shakebed::pipelines {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(TableCells, QuoteWhatWouldBreakALine) {
  EXPECT_EQ(Cell("two words").text(), "two words");
  EXPECT_EQ(Cell("a,b").text(), "\"a,b\"");
  EXPECT_EQ(Cell("say \"a\"").text(), "\"say \"\"a\"\"\"");
  EXPECT_EQ(Cell("a\nb").text(), "\"a\nb\"");
  EXPECT_EQ(Cell("# no comment").text(), "\"# no comment\"");
  EXPECT_EQ(Cell(std::numeric_limits<double>::quiet_NaN()).text(), "");
  EXPECT_EQ(Cell(0.25).text(), "0.25");
  EXPECT_EQ(Cell(std::int64_t{-3}).text(), "-3");
}

TEST(JsonWords, AreNamedWhole) {
  for (const std::string word : {"yes", "not_a_number", "a_"}) {
    std::vector<Problem> problems;
    parse_json("{\"a\": " + word + "}", "f.json", problems);
    ASSERT_EQ(problems.size(), 1U) << word;
    EXPECT_EQ(problems.front().what, "'" + word + "' is not a JSON value");
  }
}

// A floor that throws nothing gives T = 0 by every formula, and none of them is out of its range.
TEST(MapWarnings, CountTheFormulasThatDoNotApply) {
  tests::LoneStage map(*find_stage("map"));
  const auto said = [&](const std::string& gamma) {
    map.warnings.clear();
    const Json json =
        map.run(R"({ "gamma": )" + gamma +
                R"(, "frequency": "25 Hz", "diameter": "3 mm", "initial_height": 10, "plateau_density": 1.1 })");
    std::size_t out = 0;
    for (const Json& row : json["readings"]) out += row["in_range"].get<bool>() ? 0 : 1;
    return std::pair(map.warnings, out);
  };
  EXPECT_THAT(said("0.9").first, Not(Contains(HasSubstr("do not apply"))));
  EXPECT_EQ(said("0.9").second, 0U);
  const auto [words, out] = said("5");
  EXPECT_GT(out, 0U);
  EXPECT_THAT(words,
              ElementsAre(std::to_string(out) +
                          " of the 28 formulas that predict T from Gamma do not apply at this Gamma (see map.csv, "
                          "column in_range)."));
}

// Nine beds that agree, each known by one block, leave 8 + 9 degrees of freedom. Of 40 beds and more Student's factor
// is smaller than what the reciprocal of such a variance is too large by, 17/15.
TEST(BudgetOfManyBeds, AllowsForThePooledVariance) {
  EffortReading pilot;
  pilot.effort = {100, 9, 0};
  pilot.settling = 50, pilot.within = 0.02, pilot.spread = 0.02;
  pilot.settling_work = {9 * 50 * 0.01, 9 * 50 * 1000.0}, pilot.measuring_work = {9 * 100 * 0.01, 9 * 100 * 1000.0};
  EffortLimits limits;
  limits.settling = 50, limits.shortest = 1, limits.fewest_beds = 40, limits.even_beds = false;
  Budget budget;
  budget.error = 0.001;
  const EffortChoice choice = choose_effort(pilot, limits, budget, 1);
  ASSERT_TRUE(choice.possible);
  EXPECT_EQ(choice.effort.beds, 40U);
  const double length = 0.04 * 17 / 15 / (40 * std::pow(0.9 * 0.001, 2));
  EXPECT_GE(choice.effort.length, length * (1 - 1e-9));
  EXPECT_LE(choice.effort.length, length * 1.01) << "rounded up to three digits";
}

}  // namespace
}  // namespace shakebed::pipelines
