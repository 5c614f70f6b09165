// The numbers of the infer stage: distances and errors done again from the temperatures and densities beside them.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/stages/replica_seed.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/read_table.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::Json;
using shakebed::pipelines::replica_seed;

constexpr double target_t = 0.8e-3, target_density = 1.05;  // T/(m g) [m]; D = 4 mm

class InferNumbers : public testing::Test {
 protected:
  InferNumbers() {
    write_text(folder_ / "r.json", R"({ "name": "t", "stages": [ { "stage": "infer", "id": "search",
        "disks": { "count": 40, "diameter": "4 mm" }, "gravity": "10 m/s^2", "box": { "width": "32 mm", "sides": "hard" },
        "floor": { "motion": "sinusoidal", "amplitude": "3.2 mm", "frequency": "17.5 Hz" },
        "settle": "0.2 s", "measure": "0.6 s", "phases": 8,
        "target": { "temperature_over_mg": "0.8 mm", "density": 1.05 },
        "grid": { "restitution": [0.5, 0.6, 0.9], "friction": [0.3], "side_friction": ["none", "as disks"] } } ] })");
  }
  Json run(const std::string& out, int replicas, std::uint64_t seed) {
    const ProgramResult ran = run_shakebed(
        {"run", "r.json", "--out", out, "--quiet", "--set", "/stages/search/replicas=" + std::to_string(replicas),
         "--set", "/stages/search/seed=" + std::to_string(seed)},
        folder_.path());
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return Json::parse(read_text(folder_ / (out + "/search/infer.json")));
  }
  ScratchFolder folder_;
};

struct Off {
  double t, density, distance;
};
Off off_of(const Json& point) {
  const double t = value(point["temperature_over_mg"]) / target_t - 1,
               density = value(point["density"]) / target_density - 1;
  return {t, density, std::hypot(t, density)};
}

// One bed a point: its own errors, along the direction to the target.
TEST_F(InferNumbers, OfOneBedAreItsOwn) {
  const Json found = run("o", 1, 1);
  EXPECT_DOUBLE_EQ(value(found["target"]["temperature_over_mg"]), target_t);
  EXPECT_EQ(found["target"]["temperature_over_mg"]["unit"], "m");
  EXPECT_EQ(value(found["target"]["density"]), target_density);
  EXPECT_EQ(found["replicas"], 1);
  ASSERT_EQ(found["points"].size(), 6U);
  const NumberTable table(folder_ / "o/search/infer.csv");
  ASSERT_EQ(table.rows(), 6U);
  double nearest = INFINITY;
  for (std::size_t r = 0; r < 6; ++r) {
    const Json& point = found["points"][r];
    ASSERT_EQ(point["fit_status"], "ok");
    const Off off = off_of(point);
    EXPECT_NEAR(point["distance"].get<double>(), off.distance, 1e-12);
    EXPECT_NEAR(point["distance_error"].get<double>(),
                std::hypot(off.t / off.distance * error(point["temperature_over_mg"]) / target_t,
                           off.density / off.distance * error(point["density"]) / target_density),
                1e-12);
    EXPECT_GT(error(point["temperature_over_mg"]), 0);
    EXPECT_GT(error(point["density"]), 0);
    EXPECT_GT(error(point["temperature_x_over_mg"]), 0);
    EXPECT_GT(error(point["temperature_z_over_mg"]), 0);
    EXPECT_GT(error(point["temperature_z_local_over_mg"]), 0);
    EXPECT_GT(error(point["center_of_mass_rise"]), 0);
    nearest = std::min(nearest, off.distance);
    for (const char* key : {"restitution", "friction", "side_friction", "distance", "distance_error"})
      EXPECT_DOUBLE_EQ(table(key, r), point[key].get<double>()) << key;
    EXPECT_EQ(table("collisions", r), point["collisions"].get<double>());
    EXPECT_EQ(table.text("status", r), "ok");
    // In the table temperatures are in m g D.
    EXPECT_DOUBLE_EQ(table("temperature", r), value(point["temperature_over_mg"]) / 0.004);
    EXPECT_DOUBLE_EQ(table("temperature_error", r), error(point["temperature_over_mg"]) / 0.004);
    EXPECT_DOUBLE_EQ(table("temperature_x", r), value(point["temperature_x_over_mg"]) / 0.004);
    EXPECT_DOUBLE_EQ(table("temperature_z", r), value(point["temperature_z_over_mg"]) / 0.004);
    EXPECT_DOUBLE_EQ(table("temperature_z_local", r), value(point["temperature_z_local_over_mg"]) / 0.004);
    EXPECT_DOUBLE_EQ(table("solid_height", r), value(point["solid_height"]));
    EXPECT_DOUBLE_EQ(table("density", r), value(point["density"]));
    EXPECT_DOUBLE_EQ(table("density_error", r), error(point["density"]));
    EXPECT_DOUBLE_EQ(table("rise", r), value(point["center_of_mass_rise"]));
  }
  EXPECT_DOUBLE_EQ(found["nearest"]["distance"].get<double>(), nearest);
  EXPECT_EQ(found["as_near"][0]["distance"], found["nearest"]["distance"]);
  for (const Json& one : found["as_near"]) {
    // Of one bed the errors are those of many samples: 1.96, not Student's factor of few.
    const double reach =
        1.9623 * std::hypot(one["distance_error"].get<double>(), found["nearest"]["distance_error"].get<double>());
    EXPECT_LE(one["distance"].get<double>() - nearest, reach * 1.001);
  }
}

// Three beds a point: the mean of the three, and Student's t of four degrees of freedom between two points.
TEST_F(InferNumbers, OfThreeBedsAreTheirMeanAndSpread) {
  const Json together = run("all", 3, 1);
  std::vector<Json> single;
  for (std::uint64_t r = 0; r < 3; ++r) single.push_back(run("one" + std::to_string(r), 1, replica_seed(1, r)));
  EXPECT_EQ(together["replicas"], 3);
  for (std::size_t p = 0; p < 6; ++p) {
    const Json& point = together["points"][p];
    const Off off = off_of(point);
    EXPECT_NEAR(point["distance"].get<double>(), off.distance, 1e-9);
    double sum = 0, squares = 0, collisions = 0;
    std::vector<double> along;
    for (const Json& one : single) {
      const Json& own = one["points"][p];
      along.push_back(off.t / off.distance * value(own["temperature_over_mg"]) / target_t +
                      off.density / off.distance * value(own["density"]) / target_density);
      sum += along.back(), collisions += own["collisions"].get<double>();
    }
    for (const double one : along) squares += std::pow(one - sum / 3, 2);
    EXPECT_NEAR(point["distance_error"].get<double>(), std::sqrt(squares / 6), 1e-9);
    EXPECT_EQ(point["collisions"].get<double>(), collisions);
    for (const char* key : {"temperature_x_over_mg", "temperature_z_over_mg", "temperature_z_local_over_mg",
                            "center_of_mass_rise", "solid_height", "density", "temperature_over_mg"}) {
      double total = 0, spread = 0;
      for (const Json& one : single) total += value(one["points"][p][key]);
      for (const Json& one : single) spread += std::pow(value(one["points"][p][key]) - total / 3, 2);
      EXPECT_NEAR(value(point[key]), total / 3, 1e-9 * (1 + std::abs(total))) << key;
      EXPECT_NEAR(error(point[key]), std::sqrt(spread / 6), 1e-9 * (1 + std::abs(total))) << key;
    }
  }
  const Json& nearest = together["nearest"];
  std::size_t within = 0;
  for (const Json& point : together["points"])
    within += point["distance"].get<double>() - nearest["distance"].get<double>() <=
              2.776 * std::hypot(point["distance_error"].get<double>(), nearest["distance_error"].get<double>());
  EXPECT_EQ(together["as_near"].size(), within) << "t of 2 (3 - 1) degrees of freedom [Abramowitz and Stegun, 26.7]";
}

}  // namespace
