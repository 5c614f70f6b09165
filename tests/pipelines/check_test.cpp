// The check stage, expectation by expectation, on a result made by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/pipelines/lone_stage.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::find_stage;
using shakebed::pipelines::Json;
using testing::HasSubstr;

// T/(m g) is 0.36 mm with an error of 0.02 mm.
const std::string result = R"({"t": {"value": 0.00036, "std_error": 0.00002, "unit": "m"},
  "plain": 2.5, "reduced": {"value": 0.12, "std_error": 0.01, "unit": "m g D"}, "exact": {"value": 4, "unit": "1"},
  "tilt": {"value": 1.5, "unit": "deg"}, "word": "ok", "yes": true, "none": null})";

class CheckStage : public testing::Test {
 protected:
  CheckStage() {
    check_.add_input("fit", *find_stage("fit"));
    write_text(check_.file("fit.json"), result);
  }
  Json one(const std::string& name, const std::string& expectation) {
    return check_.run(R"({"expect": {"/fit/)" + name + R"(": {)" + expectation + "}}}")["checks"][0];
  }
  bool passes(const std::string& name, const std::string& expectation) {
    return one(name, expectation)["passed"].get<bool>();
  }
  LoneStage check_{*find_stage("check")};
};

// The expectation may be in any unit of a length: it is judged in that of the result.
TEST_F(CheckStage, ConvertsTheUnitOfTheValue) {
  for (const std::string value : {"0.36 mm", "360 um", "0.00036 m", "3.6e-2 cm"})
    EXPECT_TRUE(passes("t", R"("relative": 0.001, "value": ")" + value + "\"")) << value;
  EXPECT_FALSE(passes("t", R"("value": "0.36 cm", "relative": 0.001)"));
  EXPECT_FALSE(passes("t", R"("value": "0.36 um", "relative": 0.001)"));
  EXPECT_FALSE(passes("t", R"("value": "360 m", "relative": 0.9)"));
  EXPECT_TRUE(passes("tilt", R"("value": "1.5 deg", "relative": 1e-12)"));
  EXPECT_TRUE(passes("tilt", R"("value": "0.026179938779914945 rad", "relative": 1e-12)")) << "1.5 pi/180";
}

TEST_F(CheckStage, ConvertsTheUnitOfATolerance) {
  EXPECT_TRUE(passes("t", R"("value": "0.4 mm", "absolute": "0.041 mm")"));
  EXPECT_TRUE(passes("t", R"("value": "0.4 mm", "absolute": "41 um")"));
  EXPECT_FALSE(passes("t", R"("value": "0.4 mm", "absolute": "39 um")"));
  EXPECT_FALSE(passes("t", R"("value": "0.32 mm", "absolute": "39 um")"));
  EXPECT_TRUE(passes("t", R"("value": 0.0004, "absolute": 4.1e-5)")) << "both in the result's unit";
  EXPECT_THROW(passes("t", R"("value": "0.4 mm", "absolute": 0.1)"), std::runtime_error) << "0.1 of what?";
}

TEST_F(CheckStage, ConvertsTheUnitOfBounds) {
  EXPECT_TRUE(passes("t", R"("least": "359 um", "most": "0.361 mm")"));
  EXPECT_FALSE(passes("t", R"("least": "361 um")"));
  EXPECT_FALSE(passes("t", R"("most": "359 um")"));
  EXPECT_EQ(one("t", R"("least": "361 um")")["why"], "the result is below the lower bound");
  EXPECT_EQ(one("t", R"("most": "359 um")")["why"], "the result is above the upper bound");
  EXPECT_TRUE(passes("plain", R"("least": 2.5, "most": 2.5)")) << "bounds are included";
}

TEST_F(CheckStage, TakesTheLargestOfItsTolerances) {
  EXPECT_TRUE(passes("t", R"("value": "0.40 mm", "std_errors": 2.1)"));
  EXPECT_FALSE(passes("t", R"("value": "0.40 mm", "std_errors": 1.9)"));
  EXPECT_TRUE(passes("t", R"("value": "0.40 mm", "relative": 0.101)")) << "10.1 % of the expected value";
  EXPECT_FALSE(passes("t", R"("value": "0.40 mm", "relative": 0.099)"));
  EXPECT_TRUE(passes("t", R"("value": "0.40 mm", "relative": 0.01, "std_errors": 1, "absolute": "0.05 mm")"));
  EXPECT_TRUE(passes("t", R"("value": "0.40 mm", "relative": 0.2, "std_errors": 1, "absolute": "0.01 mm")"));
  EXPECT_TRUE(passes("reduced", R"("value": 0.1, "std_errors": 2.1)"));
  EXPECT_FALSE(passes("reduced", R"("value": 0.1, "std_errors": 1.9)"));
  EXPECT_TRUE(passes("exact", R"("value": 4, "relative": 0)"));
  EXPECT_EQ(one("exact", R"("value": 4, "std_errors": 9)")["why"], "the result has no standard error");
}

TEST_F(CheckStage, SaysHowFarItIsOffInTheUnitOfTheResult) {
  const Json row = one("t", R"("value": "0.40 mm", "relative": 0.05, "note": "from the paper")");
  EXPECT_EQ(row["pointer"], "/fit/t");
  EXPECT_EQ(row["expected"], "0.40 mm +- 5 %");
  EXPECT_EQ(row["found"], "0.00036 +- 2e-05 m");
  EXPECT_EQ(row["why"],
            "the difference of 4e-05 is above the tolerance of 2e-05. The difference is 10 % of the expected value");
  EXPECT_EQ(row["note"], "from the paper");
  EXPECT_EQ(one("plain", R"("value": 2, "absolute": 1, "std_errors": 0)")["expected"], "2 +- 1 +- 0 standard errors");
  EXPECT_EQ(one("plain", R"("least": 1, "most": 3)")["expected"], "at least 1, at most 3");
}

TEST_F(CheckStage, ComparesWordsAndTruths) {
  EXPECT_TRUE(passes("word", R"("value": "ok")"));
  EXPECT_FALSE(passes("word", R"("value": "no")"));
  EXPECT_TRUE(passes("yes", R"("value": true)"));
  EXPECT_FALSE(passes("yes", R"("value": false)"));
  EXPECT_FALSE(passes("word", R"("least": 1)"));
  EXPECT_FALSE(passes("none", R"("value": 1, "relative": 1)"));
  EXPECT_EQ(one("none", R"("value": 1, "relative": 1)")["why"], "there is no such result");
  EXPECT_FALSE(passes("plain", R"("value": true)"));
}

TEST_F(CheckStage, RefusesAUnitThatTheResultCannotHave) {
  EXPECT_THAT(one("t", R"("value": "0.36 s", "relative": 1)")["why"].get<std::string>(),
              HasSubstr("the result is in \"m\", but the expected value is a time"));
  EXPECT_THAT(one("reduced", R"("value": "0.36 mm", "relative": 1)")["why"].get<std::string>(),
              HasSubstr("must be a plain number"));
}

// The same verdicts in check.json, junit.xml and summary.md.
TEST_F(CheckStage, CountsItsFailuresInEveryFile) {
  const Json all = check_.run(R"({"expect": {"/fit/plain": {"value": 2.5, "relative": 0.1},
      "/fit/exact": {"most": 3}, "/fit/word": {"value": "a<b"}}})");
  EXPECT_EQ(all["passed"], false);
  EXPECT_EQ(all["failures"], 2);
  EXPECT_EQ(check_.warnings.size(), 2u);
  const std::string xml = read_text(check_.output("junit.xml")), text = read_text(check_.output("summary.md"));
  EXPECT_THAT(xml, HasSubstr(R"(<testsuites tests="3" failures="2">)"));
  EXPECT_THAT(xml, HasSubstr("expected a&lt;b, found ok"));
  EXPECT_THAT(text, HasSubstr("# 1 of 3 checks passed"));
  EXPECT_THAT(text, HasSubstr("| passed | /fit/plain | 2.5 +- 10 % | 2.5 |"));
  EXPECT_THAT(text, HasSubstr("| **failed** | /fit/exact | at most 3 | 4 |"));
  EXPECT_EQ(check_.run(R"({"expect": {"/fit/exact": {"least": 3}}})")["passed"], true);
}

}  // namespace
