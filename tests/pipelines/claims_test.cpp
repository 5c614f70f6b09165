// Verdicts on claims, by numbers made by hand: 1.0 with an error of 0.1 has the 95 % interval 0.804 to 1.196.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/errors.hpp"
#include "tests/pipelines/lone_stage.hpp"
#include "tests/pipelines/read_table.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::find_stage;
using shakebed::pipelines::Json;
using testing::HasSubstr;

const std::string numbers = R"({"t": {"value": 1.0, "std_error": 0.1, "unit": "m g D"}, "none": {"value": null},
    "range": {"value": 1.0, "std_error": null},
    "plain": 0.25, "yes": true, "no": false, "fit": {"p_value": 1e-12}})";

class ClaimsVerdicts : public testing::Test {
 protected:
  ClaimsVerdicts() {
    claims_.add_input("bed", *find_stage("fit"));
    write_text(claims_.file("fit.json"), numbers);
  }
  Json one(const std::string& number, const std::string& claimed) {
    return claims_.run(R"({"claims": [{"claim": "so it is", "number": ")" + number + "\", " + claimed +
                       "}]}")["claims"][0];
  }
  std::string verdict(const std::string& number, const std::string& claimed) {
    return one(number, claimed)["verdict"].get<std::string>();
  }
  LoneStage claims_{*find_stage("claims")};
};

TEST_F(ClaimsVerdicts, AValueAndItsTolerance) {
  EXPECT_EQ(verdict("/bed/t", R"("value": 1, "tolerance": 0.2)"), "holds");
  EXPECT_EQ(verdict("/bed/t", R"("value": 1, "tolerance": 0.19)"), "open");
  EXPECT_EQ(verdict("/bed/t", R"("value": 1)"), "open") << "an interval is never inside a point";
  EXPECT_EQ(verdict("/bed/t", R"("value": 1.5, "tolerance": 0.31)"), "open");
  EXPECT_EQ(verdict("/bed/t", R"("value": 1.5, "tolerance": 0.3)"), "does not hold");
  EXPECT_EQ(verdict("/bed/t", R"("value": 0.5, "tolerance": 0.3)"), "does not hold");
}

// The middle of a range has no standard error: it decides nothing.
TEST_F(ClaimsVerdicts, OfANumberWhoseErrorIsNotKnownAreOpen) {
  EXPECT_EQ(verdict("/bed/range", R"("value": 1, "tolerance": 0.5)"), "open");
  EXPECT_EQ(verdict("/bed/range", R"("value": 5, "tolerance": 0.5)"), "open");
}

// 1.0 +- 0.1 over 0.25 without an error: 4 +- 0.4; over itself: 1 +- 0.1 sqrt(2), its errors taken as independent. 0.25
// over 1.0 +- 0.1 is 0.25 +- 0.025.
TEST_F(ClaimsVerdicts, OfOneNumberOverAnother) {
  const Json quarter = one("/bed/t", R"("over": "/bed/plain", "value": 4, "tolerance": 0.8)");
  EXPECT_NEAR(quarter["value"].get<double>(), 4, 1e-14);
  EXPECT_NEAR(quarter["std_error"].get<double>(), 0.4, 1e-14);
  EXPECT_EQ(quarter["verdict"], "holds");
  EXPECT_EQ(quarter["over"], "/bed/plain");
  EXPECT_NEAR(one("/bed/t", R"("over": "/bed/t", "value": 1)")["std_error"].get<double>(), 0.1 * std::sqrt(2), 1e-14);
  const Json inverse = one("/bed/plain", R"("over": "/bed/t", "value": 1)");
  EXPECT_NEAR(inverse["value"].get<double>(), 0.25, 1e-14);
  EXPECT_NEAR(inverse["std_error"].get<double>(), 0.025, 1e-14);
  EXPECT_EQ(verdict("/bed/t", R"("over": "/bed/no", "value": 1)"), "not measured") << "over zero";
}

TEST_F(ClaimsVerdicts, Bounds) {
  EXPECT_EQ(verdict("/bed/t", R"("least": 0.8)"), "holds");
  EXPECT_EQ(verdict("/bed/t", R"("least": 0.81)"), "open");
  EXPECT_EQ(verdict("/bed/t", R"("least": 1.2)"), "does not hold");
  EXPECT_EQ(verdict("/bed/t", R"("most": 1.2)"), "holds");
  EXPECT_EQ(verdict("/bed/t", R"("most": 1.19)"), "open");
  EXPECT_EQ(verdict("/bed/t", R"("most": 0.8)"), "does not hold");
  EXPECT_EQ(verdict("/bed/t", R"("least": 0.8, "most": 1.2)"), "holds");
  EXPECT_EQ(verdict("/bed/t", R"("least": 0.9, "most": 1.1)"), "open");
  EXPECT_EQ(verdict("/bed/t", R"("least": 2, "most": 3)"), "does not hold");
}

TEST_F(ClaimsVerdicts, NumbersWithoutErrorsAndTruths) {
  EXPECT_EQ(verdict("/bed/plain", R"("value": 0.25)"), "holds");
  EXPECT_EQ(verdict("/bed/plain", R"("most": 0.2)"), "does not hold");
  EXPECT_EQ(verdict("/bed/yes", R"("value": 1)"), "holds");
  EXPECT_EQ(verdict("/bed/no", R"("value": 1)"), "does not hold");
}

TEST_F(ClaimsVerdicts, WhatWasNotMeasured) {
  const Json row = one("/bed/none", R"("most": 5)");
  EXPECT_EQ(row["verdict"], "not measured");
  EXPECT_TRUE(row["value"].is_null());
  EXPECT_FALSE(row.contains("std_error"));
  EXPECT_EQ(row["measured"], "–");
}

TEST_F(ClaimsVerdicts, ArePutInWords) {
  const Json row = one("/bed/t", R"("value": 1, "tolerance": 0.2)");
  EXPECT_FALSE(row.contains("place") || row.contains("note") || row.contains("measured_as"));
  const Json placed = one("/bed/t", R"("value": 1, "place": "Fig. 1", "note": "why")");
  EXPECT_EQ(placed["place"], "Fig. 1");
  EXPECT_EQ(placed["note"], "why");
  EXPECT_EQ(row["claimed"], "1 ± 0.2");
  EXPECT_EQ(row["measured"], "1.00 ± 0.10 m g D");
  EXPECT_EQ(row["value"], 1.0);
  EXPECT_EQ(row["std_error"], 0.1);
  EXPECT_EQ(one("/bed/t", R"("least": 0.8, "most": 1.2)")["claimed"], "at least 0.8, at most 1.2");
  EXPECT_EQ(one("/bed/plain", R"("most": 1)")["measured"], "0.25 (no error bar)");
  EXPECT_EQ(one("/bed/fit/p_value", R"("most": 0.05)")["measured"], "below 1e-10");
}

// The same verdicts in all three files.
TEST_F(ClaimsVerdicts, StandInTheTableAndTheText) {
  claims_.run(R"({"claims": [{"claim": "a|b", "place": "Fig. 1", "number": "/bed/t", "value": 3},
                             {"claim": "c", "number": "/bed/none", "value": 3, "note": "why"}]})");
  std::map<std::string, std::string> verdicts;
  std::vector<std::string> header;
  shakebed::pipelines::each_csv_line(
      read_text(claims_.output("claims.csv")), [&](const std::vector<std::string>& cells, std::size_t) {
        if (header.empty())
          header = cells;
        else
          verdicts[cells[0]] = cells[shakebed::pipelines::csv_column(header, "verdict", "claims.csv")];
      });
  const NumberTable table(claims_.output("claims.csv"));
  EXPECT_EQ(table("measured", 0), 1.0);
  EXPECT_EQ(table("std_error", 0), 0.1);
  EXPECT_TRUE(std::isnan(table("measured", 1)) && std::isnan(table("std_error", 1)));
  EXPECT_EQ(verdicts, (std::map<std::string, std::string>{{"a|b", "does not hold"}, {"c", "not measured"}}));
  const std::string text = read_text(claims_.output("claims.md"));
  EXPECT_THAT(text, HasSubstr("| a\\|b | 3 | 1.00 ± 0.10 m g D | does not hold | Fig. 1 |\n"));
  EXPECT_THAT(text, HasSubstr("| c | 3 | – | not measured: why |  |\n"));
}

TEST_F(ClaimsVerdicts, ANumberThatIsNotThereIsAnError) {
  EXPECT_THROW(one("/bed/typo", R"("value": 1)"), shakebed::pipelines::InputError);
}

}  // namespace
