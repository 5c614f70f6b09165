// A study's numbers: what it writes into the chain, what it makes of the numbers and errors of each run, and its means.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/read_table.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::Json;

const std::string chain = R"("stages": [ { "stage": "simulate", "id": "bed", "units": "reduced",
    "disks": { "count": 20, "restitution": 1 }, "box": { "width": 5.3, "sides": "periodic" },
    "bath": { "kind": "langevin", "temperature": 1, "rate": 0.5, "interval": 0.2 },
    "settle": 2, "measure": 20, "observe": ["velocities"] } ])";

class StudyNumbers : public testing::Test {
 protected:
  void run(const std::string& study) {
    write_text(folder_ / "r.json",
               R"({ "name": "t", "stages": [ { "stage": "study", "id": "beds", "seed": 3, )" + study + " } ] }");
    const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o", "--force"}, folder_.path());
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    json_ = Json::parse(read_text(folder_ / "o/beds/study.json"));
  }
  NumberTable table(const std::string& name) { return NumberTable(folder_ / "o/beds" / name); }
  ScratchFolder folder_;
  Json json_;
};

// The factor acts on the value and, without its sign, on the error; what is added does not touch the error.
TEST_F(StudyNumbers, AreScaledWithTheirErrors) {
  run(R"("parameter": { "name": "T", "values": [1, 2], "set": ["/stages/bed/bath/temperature"] }, )" + chain + R"(,
      "collect": { "plain": { "at": "/bed/temperature_x" },
                   "scaled": { "at": "/bed/temperature_x", "times": -3, "plus": 10 } })");
  const NumberTable found = table("table.csv");
  ASSERT_EQ(found.rows(), 2U);
  for (std::size_t r = 0; r < 2; ++r) {
    const double plain = found("plain", r), error = found("plain_error", r);
    EXPECT_GT(error, 0);
    EXPECT_NEAR(found("scaled", r), 10 - 3 * plain, 1e-12);
    EXPECT_NEAR(found("scaled_error", r), 3 * error, 1e-12);
    const Json& row = json_["series"]["all"][r];
    EXPECT_DOUBLE_EQ(row["plain"]["value"].get<double>(), plain);
    EXPECT_DOUBLE_EQ(row["plain"]["std_error"].get<double>(), error);
    EXPECT_DOUBLE_EQ(row["scaled"]["std_error"].get<double>(), found("scaled_error", r));
    EXPECT_EQ(row["plain"]["runs"], 1);
    EXPECT_EQ(row["T"], found("T", r));
  }
  EXPECT_EQ(json_["runs"], 2);
  EXPECT_EQ(json_["replicas"], 1);
}

// Of three runs of a point: their mean, and their standard deviation over the root of three.
TEST_F(StudyNumbers, AreMeansOverReplicasWithTheirSpread) {
  run(R"("replicas": 3, "parameter": { "name": "T", "values": [1, 2], "set": ["/stages/bed/bath/temperature"] }, )" +
      chain + R"(, "collect": { "t": { "at": "/bed/temperature_z", "times": 2 } },
      "tables": { "v": { "at": "/bed/velocities.csv", "key": "height" } })");
  const NumberTable means = table("table.csv"), runs = table("replicas.csv");
  ASSERT_EQ(runs.rows(), 6U);
  for (std::size_t r = 0; r < 2; ++r) {
    std::vector<double> values;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(runs("T", 3 * r + k), means("T", r));
      EXPECT_EQ(runs("replica", 3 * r + k), static_cast<double>(k));
      values.push_back(runs("t", 3 * r + k));
    }
    const double mean = (values[0] + values[1] + values[2]) / 3;
    double squares = 0;
    for (const double value : values) squares += (value - mean) * (value - mean);
    EXPECT_NEAR(means("t", r), mean, 1e-12);
    EXPECT_NEAR(means("t_error", r), std::sqrt(squares / 6), 1e-12);
    EXPECT_GT(squares, 0) << "the runs are different ones";
    EXPECT_EQ(json_["series"]["all"][r]["t"]["runs"], 3);
  }
  EXPECT_EQ(json_["runs"], 6);
  EXPECT_EQ(json_["replicas"], 3);
}

// A chain's table, row by row at the same key. A second study with one run a point, whose seeds are those of the first
// replica, gives one of the three; so do the two columns of a table of one run agree with its mean of one.
TEST_F(StudyNumbers, OfTablesAreMeansRowByRow) {
  const std::string point =
      R"("parameter": { "name": "T", "values": [1], "set": ["/stages/bed/bath/temperature"] }, )" + chain +
      R"(, "collect": { "t": { "at": "/bed/temperature_z" } },
      "tables": { "v": { "at": "/bed/velocities.csv", "key": "height" } }, )";
  run(point + R"("replicas": 1)");
  const NumberTable single = table("v.csv");
  for (std::size_t r = 0; r < single.rows(); ++r) {
    EXPECT_EQ(single("runs", r), 1);
    EXPECT_TRUE(std::isnan(single("temperature_x_error", r))) << "one run has no spread";
  }
  run(point + R"("replicas": 2)");
  const NumberTable both = table("v.csv");
  // With two runs the other one is 2 mean - first, and the error is half of their distance.
  std::size_t compared = 0;
  for (std::size_t r = 0; r < both.rows(); ++r) {
    if (both("runs", r) != 2) continue;
    for (std::size_t s = 0; s < single.rows(); ++s) {
      if (single("height", s) != both("height", r)) continue;
      for (const char* column : {"number_density", "temperature_x", "temperature_z", "mean_velocity_z", "samples"}) {
        const double mean = both(column, r), first = single(column, s);
        EXPECT_NEAR(both(std::string(column) + "_error", r), std::abs(mean - first), 1e-9 * (1 + std::abs(mean)))
            << column;
      }
      ++compared;
    }
  }
  EXPECT_GT(compared, 3U);
}

// The bed's Gamma says what was written into the chain: value, factor, the series' own factor, unit.
TEST_F(StudyNumbers, ComeFromTheParameterAsItIsWrittenIntoTheChain) {
  const std::string shaken = R"("stages": [ { "stage": "simulate", "id": "bed",
      "disks": { "count": 20, "diameter": "4 mm", "restitution": 0.9 }, "box": { "width": "21.2 mm" },
      "floor": { "motion": "sinusoidal", "amplitude": "1 mm", "frequency": "20 Hz" }, "gravity": "10 m/s^2",
      "settle": "0.1 s", "measure": "0.2 s" } ])";
  run(R"("parameter": { "name": "a", "values": [1, 2], "times": 0.5, "unit": "mm",
          "set": ["/stages/bed/floor/amplitude"] },
      "series": { "own": { "times": 0.25, "set": { "/stages/bed/floor/frequency": "40 Hz" } }, "common": {} }, )" +
      shaken + R"(, "collect": { "gamma": { "at": "/bed/gamma" } })");
  const double g20 = 1e-3 * std::pow(2 * M_PI * 20, 2) / 10;  // of 1 mm at 20 Hz
  const NumberTable found = table("table.csv");
  ASSERT_EQ(found.rows(), 4U);
  const std::map<std::pair<std::string, double>, double> expected{
      {{"own", 1}, 0.25 * 4 * g20}, {{"own", 2}, 0.5 * 4 * g20}, {{"common", 1}, 0.5 * g20}, {{"common", 2}, g20}};
  for (std::size_t r = 0; r < 4; ++r)
    EXPECT_NEAR(found("gamma", r), expected.at({found.text("series", r), found("a", r)}), 1e-9) << r;
  EXPECT_NEAR(json_["series"]["own"][1]["gamma"]["value"].get<double>(), 2 * g20, 1e-9);
  EXPECT_NEAR(json_["series"]["common"][0]["gamma"]["value"].get<double>(), g20 / 2, 1e-9);
}

}  // namespace
