// Exponents of studies, published numbers in claims, and studies in two parameters.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "pipelines/stages/published.hpp"
#include "tests/pipelines/lone_stage.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/read_table.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::find_published;
using shakebed::pipelines::find_stage;
using shakebed::pipelines::Json;
using testing::HasSubstr;

// T = 3 V^2 N^-1 with errors of 1 % on the grid V = 1, 2, 4 and N = 10, 40; the last row is of another series.
std::string grid() {
  std::string text = "series,V,N,T,T_error\n";
  for (const double n : {10.0, 40.0})
    for (const double v : {1.0, 2.0, 4.0}) {
      const double t = 3 * v * v / n;
      text += "all," + std::to_string(v) + "," + std::to_string(n) + "," + std::to_string(t) + "," +
              std::to_string(0.01 * t) + "\n";
    }
  return text + "other,3,20,1000,1\n";
}

class ScalingOfAGrid : public testing::Test {
 protected:
  ScalingOfAGrid() {
    scaling_.add_input("beds", *find_stage("study"));
    write_text(scaling_.file("table.csv"), grid());
  }
  LoneStage scaling_{*find_stage("scaling")};
};

// On the grid ln V has the spread 2 ln^2 2 in each of two rows, ln N (ln 4/2)^2 in each of six points; the amplitude
// is that of the powers, e^(mean ln T - ...), with its error by propagation from the centre of the grid.
TEST_F(ScalingOfAGrid, HasTheExponentsOfItsLaw) {
  const Json found =
      scaling_.run(R"({"fits": [{"name": "law", "y": "T", "powers": ["V", "N"], "series": ["all"]}]})")["law"];
  EXPECT_EQ(found["status"], "ok");
  EXPECT_EQ(found["points"], 6);
  EXPECT_EQ(found["dof"], 3);
  EXPECT_NEAR(found["exponents"]["V"]["value"].get<double>(), 2, 1e-5);
  EXPECT_NEAR(found["exponents"]["N"]["value"].get<double>(), -1, 1e-5);
  const double of_v = 0.01 / (2 * std::log(2)), of_n = 0.01 / (std::sqrt(6) * std::log(2));
  EXPECT_NEAR(found["exponents"]["V"]["std_error"].get<double>(), of_v, 1e-6);
  EXPECT_NEAR(found["exponents"]["N"]["std_error"].get<double>(), of_n, 1e-6);
  EXPECT_NEAR(found["amplitude"]["value"].get<double>(), 3, 1e-4);
  const double of_log = std::sqrt(0.01 * 0.01 / 6 + std::pow(std::log(2) * of_v, 2) + std::pow(std::log(20) * of_n, 2));
  EXPECT_NEAR(found["amplitude"]["std_error"].get<double>(), 3 * of_log, 1e-4);
  EXPECT_NEAR(found["chi2"].get<double>(), 0, 1e-4);
  EXPECT_NEAR(found["p_value"].get<double>(), 1, 1e-4);
  EXPECT_NEAR(found["rms_log_ratio"].get<double>(), 0, 1e-5);
  const NumberTable points(scaling_.output("law.csv"));
  ASSERT_EQ(points.rows(), 6U);
  for (std::size_t r = 0; r < 6; ++r) {
    EXPECT_NEAR(points("fitted", r), 3 * points("V", r) * points("V", r) / points("N", r), 1e-4);
    EXPECT_NEAR(points("ratio", r), 1, 1e-4);
    EXPECT_NEAR(points("ratio_error", r), 0.01, 1e-5);
    EXPECT_NEAR(points("y_error", r), 0.01 * points("y", r), 1e-5);
  }
}

// With the amplitude free at each N only the power of V is left, with the same error as on the whole grid.
TEST_F(ScalingOfAGrid, LeavesTheAmplitudeFreeAtEachValue) {
  const Json found = scaling_.run(
      R"({"fits": [{"name": "law", "y": "T", "powers": ["V"], "each": ["N"], "series": ["all"]}]})")["law"];
  EXPECT_EQ(found["dof"], 3);
  EXPECT_NEAR(found["exponents"]["V"]["value"].get<double>(), 2, 1e-5);
  EXPECT_NEAR(found["exponents"]["V"]["std_error"].get<double>(), 0.01 / (2 * std::log(2)), 1e-6);
  EXPECT_FALSE(found.contains("amplitude"));
  const NumberTable points(scaling_.output("law.csv"));
  ASSERT_EQ(points.rows(), 6U);
  for (std::size_t r = 0; r < 6; ++r)
    EXPECT_NEAR(points("fitted", r), 3 * points("V", r) * points("V", r) / points("N", r), 1e-4);
}

TEST_F(ScalingOfAGrid, UsesThePointsAskedFor) {
  const Json found = scaling_.run(R"({"fits": [{"name": "law", "y": "T", "powers": ["V"], "series": ["all"],
                                                "within": {"N": {"most": 20}}, "common_error": true}]})")["law"];
  EXPECT_EQ(found["points"], 3);
  EXPECT_NEAR(found["exponents"]["V"]["value"].get<double>(), 2, 1e-5);
  EXPECT_TRUE(scaling_.warnings.empty());
}

// T = 5 V with errors of 1, 2 and 6 %: each becomes their root mean square, sqrt(41/3) %. ln V has the spread 2 ln^2 2
// about ln 2.
TEST_F(ScalingOfAGrid, GivesEveryPointTheSamePart) {
  write_text(scaling_.file("table.csv"), "series,V,T,T_error\nall,1,5,0.05\nall,2,10,0.2\nall,4,20,1.2\n");
  const std::string ask = R"({"fits": [{"name": "law", "y": "T", "powers": ["V"], "common_error": )", part = "true}]}",
                    own = "false}]}";
  const double error = std::sqrt(41.0 / 3) / 100;
  const Json found = scaling_.run(ask + part)["law"];
  EXPECT_NEAR(found["exponents"]["V"]["std_error"].get<double>(), error / (std::sqrt(2) * std::log(2)), 1e-9);
  EXPECT_NEAR(found["amplitude"]["std_error"].get<double>(), 5 * error * std::sqrt(1.0 / 3 + 1.0 / 2), 1e-9);
  const NumberTable points(scaling_.output("law.csv"));
  for (std::size_t r = 0; r < 3; ++r) EXPECT_NEAR(points("y_error", r), error * points("y", r), 1e-9) << r;
  scaling_.run(ask + own);
  const NumberTable own_errors(scaling_.output("law.csv"));
  EXPECT_NEAR(own_errors("y_error", 2), 1.2, 1e-12);
  EXPECT_NEAR(own_errors("ratio_error", 2), 1.2 / 20, 1e-6);
  // From a line through ln T + (ln 2, 0, 0) each point is off by ln 2 (1, -2, 1)/6.
  write_text(scaling_.file("table.csv"), "series,V,T,T_error\nall,1,10,0.1\nall,2,10,0.2\nall,4,20,1.2\n");
  const Json off = scaling_.run(ask + part)["law"];
  EXPECT_EQ(off["dof"], 1);
  EXPECT_NEAR(off["chi2"].get<double>(), std::pow(std::log(2) / error, 2) / 6, 1e-6);
  EXPECT_NEAR(off["rms_log_ratio"].get<double>(), std::log(2) / std::sqrt(18), 1e-9);
}

TEST_F(ScalingOfAGrid, SaysWhyThereIsNoFit) {
  const Json found = scaling_.run(R"({"fits": [{"name": "law", "y": "T", "powers": ["V", "N"],
                                                "within": {"N": {"most": 20}, "V": {"most": 2.5}}}]})")["law"];
  EXPECT_NE(found["status"], "ok");
  EXPECT_TRUE(found["exponents"]["V"].is_null());
  EXPECT_FALSE(found.contains("amplitude"));
  ASSERT_EQ(scaling_.warnings.size(), 1U);
  EXPECT_THAT(scaling_.warnings.front(), HasSubstr("more points than unknowns"));
}

TEST(PublishedNumbers, AreFoundByPaperAndName) {
  const auto found = find_published("yang-candela-2000/exponent_in_two_dimensions");
  ASSERT_TRUE(found.number);
  EXPECT_EQ(found.number->least, 1.3);
  EXPECT_EQ(found.number->most, 1.5);
  EXPECT_FALSE(found.number->from_memory);
  EXPECT_THAT(found.number->place, HasSubstr("cond-mat/0001115"));
  EXPECT_TRUE(find_published("warr-1995/height_exponent_of_velocity").number->from_memory);
  EXPECT_THAT(find_published("warr-1996/x").suggestion, HasSubstr("warr-1995"));
  EXPECT_FALSE(find_published("warr-1995/nothing").number);
  EXPECT_FALSE(find_published("").number);
}

TEST(PublishedNumbers, DecideAClaimUnlessTheyAreFromMemory) {
  LoneStage claims(*find_stage("claims"));
  claims.add_input("bed", *find_stage("fit"));
  write_text(claims.file("fit.json"), R"({"a": {"value": 1.4, "std_error": 0.02, "unit": "1"}})");
  const auto verdict = [&](const std::string& published, const std::string& more = "") {
    return claims
        .run(R"({)" + more + R"("claims": [{"claim": "so", "number": "/bed/a", "published": ")" + published +
             "\"}]}")["claims"][0]["verdict"]
        .get<std::string>();
  };
  EXPECT_EQ(verdict("yang-candela-2000/exponent_in_two_dimensions"), "holds");
  EXPECT_EQ(verdict("yang-candela-2000/exponent_in_two_dimensions", R"("standard_errors": 6, )"), "open");
  EXPECT_EQ(verdict("yang-candela-2000/exponent_in_one_dimension"), "does not hold");
  EXPECT_EQ(verdict("warr-1995/height_exponent_of_velocity"), "no verdict");
  EXPECT_THROW(verdict("warr-1995/nothing"), std::runtime_error);
}

// Elastic disks in a bath at T: every count of disks at every T, and the largest density of each profile.
TEST(StudyOfTwoParameters, RunsEveryPairAndReadsTables) {
  ScratchFolder folder;
  write_text(folder / "r.json", R"({ "name": "t", "stages": [ { "stage": "study", "id": "beds", "seed": 3,
    "parameter": { "name": "T", "values": [1, 4], "set": ["/stages/bed/bath/temperature"] },
    "second": { "name": "N", "values": [10, 20], "set": ["/stages/bed/disks/count"] },
    "stages": [ { "stage": "simulate", "id": "bed", "units": "reduced", "disks": { "count": 5, "restitution": 1 },
      "box": { "width": 5.3, "sides": "periodic" }, "bath": { "kind": "langevin", "temperature": 1, "rate": 0.5,
      "interval": 0.2 }, "settle": 2, "measure": 20 } ],
    "collect": { "layers": { "at": "/bed/column_number" },
      "densest": { "at": "/bed/profile.csv", "column": "number_density", "take": "largest" },
      "where": { "at": "/bed/profile.csv", "column": "number_density", "take": "place_of_largest", "most": 6 } },
    "tables": { "profile": { "at": "/bed/profile.csv", "key": "height" } } } ] })");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const NumberTable table(folder / "o/beds/table.csv"), profile(folder / "o/beds/profile.csv");
  ASSERT_EQ(table.rows(), 4U);
  for (std::size_t r = 0; r < 4; ++r) {
    EXPECT_NEAR(table("layers", r), table("N", r) / 5.3, 1e-9);
    double densest = 0, place = 0;
    for (std::size_t p = 0; p < profile.rows(); ++p) {
      if (profile("N", p) != table("N", r) || profile("T", p) != table("T", r)) continue;
      if (profile("number_density", p) > densest) densest = profile("number_density", p), place = profile("height", p);
    }
    EXPECT_DOUBLE_EQ(table("densest", r), densest);
    ASSERT_LE(place, 6) << "the densest place lies below the limit that is asked for";
    EXPECT_DOUBLE_EQ(table("where", r), place);
  }
  const ProgramResult wrong = run_shakebed(
      {"run", "r.json", "--out", "p", "--set", "/stages/beds/collect/densest/column=density"}, folder.path());
  EXPECT_EQ(wrong.exit_code, 3);
  EXPECT_THAT(wrong.err, HasSubstr("density"));
}

}  // namespace
