// What several beds say together, on numbers for pencil and paper, and the replicas of a shaken bed as the program runs
// them.
#include "pipelines/stages/replicas.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "pipelines/stages/bed_measurement.hpp"
#include "sim/measure/measured_bed.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::pipelines {
namespace {

using namespace shakebed::tests;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Json bed(double temperature, double error, double drift = 0, double drift_error = 0.1) {
  return {{"temperature_x", {{"value", temperature}, {"std_error", error}, {"unit", "m g D"}}},
          {"drift_temperature_x", {{"value", drift}, {"std_error", drift_error}, {"unit", "m g D"}}},
          {"elastic_share", {{"value", temperature / 100}, {"unit", "1"}}},
          {"collisions", 7u},
          {"max_overlap", {{"value", temperature * 1e-15}, {"unit", "D"}}}};
}

TEST(Replicas, JoinToMeanSpreadAndErrors) {
  const Json joined = joined_results({bed(1, 0.1), bed(2, 0.2), bed(3, 0.2)});
  const Json& t = joined["temperature_x"];
  EXPECT_NEAR(t["value"].get<double>(), 2, 1e-15);
  EXPECT_NEAR(t["spread"].get<double>(), 1, 1e-15);
  EXPECT_NEAR(t["within"].get<double>(), std::sqrt((0.01 + 0.04 + 0.04) / 3), 1e-15);
  // Student's t for two degrees of freedom: 4.302653 [any table], over 1.959964.
  EXPECT_NEAR(t["std_error"].get<double>(), 4.302653 / 1.959964 / std::sqrt(3.0), 1e-6);
  EXPECT_NEAR(joined["elastic_share"]["value"].get<double>(), 0.02, 1e-15);
  EXPECT_EQ(joined["collisions"], 21);
  EXPECT_DOUBLE_EQ(joined["max_overlap"]["value"].get<double>(), 3e-15);
  EXPECT_EQ(joined["replicas"], 3);
  // Beds that agree by chance: the error is what they state.
  const Json close = joined_results({bed(1, 0.3), bed(1, 0.3), bed(1, 0.3), bed(1, 0.3)});
  EXPECT_NEAR(close["temperature_x"]["std_error"].get<double>(), 0.15, 1e-15);
}

std::vector<std::string> warnings_of(const std::vector<Json>& beds, ReplicaStarts starts = ReplicaStarts::alternate) {
  return replica_warnings(beds, beds.size() > 1 ? joined_results(beds) : beds.front(), starts);
}

TEST(Replicas, ThatDifferByMoreThanTheyStateAreNamed) {
  const auto warnings = warnings_of({bed(0.16, 0.003), bed(0.20, 0.003), bed(0.17, 0.003), bed(0.22, 0.003)});
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(
      warnings[0],
      HasSubstr(
          "the 4 beds differ by more than chance: the standard deviation of T_x between beds is 0.028, but the stated "
          "error of "
          "each bed is 0.003 (mean 0.165 of the beds that start as in the recipe, 0.21 of those that start from a "
          "random fill)"));
  EXPECT_THAT(warnings_of({bed(0.160, 0.003), bed(0.165, 0.003), bed(0.163, 0.003), bed(0.158, 0.003)}), IsEmpty());
  // Two beds 2.1 times their error apart in spread: chance does that in 4 % of all cases.
  EXPECT_THAT(warnings_of({bed(1, 0.1), bed(1.3, 0.1)}), IsEmpty());
}

TEST(Replicas, AndSingleBedsThatStillChangeAreNamed) {
  EXPECT_THAT(warnings_of({bed(2, 0.1, -0.5, 0.1)}),
              ElementsAre(HasSubstr(
                  "T_x is lower by 0.5 (25 %) in the second half of the time, which is 5.0 times the error")));
  EXPECT_THAT(warnings_of({bed(2, 0.1, 0.39, 0.1)}), IsEmpty());
  EXPECT_THAT(warnings_of({bed(2, 0.1, 0, 0)}), IsEmpty());
}

// What a bed lacks has no mean; what is the same everywhere and has no error stays; words are the first bed's.
TEST(Replicas, JoinWhatSomeLack) {
  Json one = bed(1, 0.1), two = bed(3, 0.1);
  one["word"] = "first", two["word"] = "second";
  one["constant"] = two["constant"] = Json{{"value", 5}, {"unit", "1"}};
  one["known"] = two["known"] = Json{{"value", 5}, {"std_error", 0.5}};
  two["elastic_share"]["value"] = nullptr;
  two["temperature_x"].erase("std_error");
  const Json joined = joined_results({one, two});
  EXPECT_EQ(joined["word"], "first");
  EXPECT_EQ(joined["constant"], one["constant"]);
  EXPECT_TRUE(joined["elastic_share"].is_null());
  EXPECT_NEAR(joined["known"]["std_error"].get<double>(), 0.5 / std::sqrt(2.0), 1e-15);
  EXPECT_EQ(joined["known"]["spread"], 0);
  EXPECT_EQ(joined["temperature_x"]["within"], 0) << "one of two states no error";
  EXPECT_NEAR(joined["temperature_x"]["std_error"].get<double>(), few_beds_factor(2), 1e-12) << "spread 1.414";
  // Student's t over that of a normal distribution [any table].
  EXPECT_EQ(few_beds_factor(1), 1);
  EXPECT_NEAR(few_beds_factor(2), 12.706205 / 1.959964, 1e-5);
  EXPECT_NEAR(few_beds_factor(4), 3.182446 / 1.959964, 1e-5);
}

TEST(Replicas, HaveATableOfWhatAnyHas) {
  Json one = bed(1, 0.1), two = bed(3, 0.1);
  one.erase("drift_temperature_x"), one.erase("max_overlap"), two.erase("max_overlap");
  two["elastic_share"]["value"] = nullptr;
  two["rise"] = Json{{"value", 2.5}};
  const Table table = replicas_table({one, two});
  EXPECT_EQ(table.csv(), "replica,temperature_x,elastic_share,drift_temperature_x,rise\n0,1,0.01,,\n1,3,,0,2.5\n");
  const Json columns = table.metadata("r.csv")["tableSchema"]["columns"];
  EXPECT_THAT(columns[1].dump(), HasSubstr("m g D"));
  EXPECT_THAT(columns[1].dump(), HasSubstr("temperature_x of the replica"));
}

// Beds at rest differ by nothing that matters; of those that move, the first number that differs or changes is named.
TEST(Replicas, ThatDifferOrChangeHaveTheirNumbers) {
  const auto with = [](Json joined, double tz, double spread, double change) {
    joined["temperature_z"] = Json{{"value", tz}, {"std_error", 0.1}, {"spread", spread}, {"within", 0.1}};
    joined["center_of_mass_rise"] = Json{{"value", -4}, {"std_error", 0.1}, {"spread", 0.5}, {"within", 0.1}};
    joined["drift_center_of_mass"] = Json{{"value", change}, {"std_error", 0.1}};
    return joined;
  };
  const auto spread = notable_spread(with(bed(2, 0.1), 2, 0.4, 0), 4);
  ASSERT_TRUE(spread);
  EXPECT_STREQ(spread->what, "T_z");
  EXPECT_EQ(spread->spread, 0.4);
  EXPECT_EQ(spread->within, 0.1);
  EXPECT_STREQ(notable_spread(with(bed(2, 0.1), 2, 0.19, 0), 4)->what, "the rise of the centre of mass");
  EXPECT_FALSE(notable_spread(with(bed(2, 0.1), 2, 0.4, 0), 1)) << "a single bed";
  EXPECT_FALSE(notable_spread(with(bed(1e-12, 0.1), 1e-12, 0.4, 0), 4)) << "at rest";
  EXPECT_TRUE(notable_spread(with(bed(2, 0.1), 1e-12, 0.4, 0), 4)) << "it moves across";
  const auto drift = notable_drift_of(with(bed(2, 0.1), 2, 0.1, 0.5));
  ASSERT_TRUE(drift);
  EXPECT_STREQ(drift->what, "the rise of the centre of mass");
  EXPECT_EQ(drift->change, 0.5);
  EXPECT_EQ(drift->error, 0.1);
  EXPECT_EQ(drift->part, 0.125);
  EXPECT_FALSE(notable_drift_of(with(bed(2, 0.1), 2, 0.1, 0.39)));
  EXPECT_FALSE(notable_drift_of(with(bed(1e-12, 0.1), 1e-12, 0.1, 0.5)));
}

// Of two beds: their mean, and Student's 12.706 over the normal 1.960 times their spread, or the root mean square of
// what they state, over sqrt(2).
void expect_joined(const BedMeasurement& a, const BedMeasurement& b) {
  const sim::Profile one = a.bed().density(false), two = b.bed().density(false), both = joined_density({&a, &b}, false);
  ASSERT_EQ(both.height, one.height);
  EXPECT_EQ(both.samples, 2 * one.samples);
  int by_own_errors = 0;
  for (std::size_t i = 0; i < both.height.size(); ++i) {
    EXPECT_NEAR(both.number_density[i], (one.number_density[i] + two.number_density[i]) / 2, 1e-14);
    const double spread = std::abs(one.number_density[i] - two.number_density[i]) / std::sqrt(2);
    const double own = std::hypot(one.std_error[i], two.std_error[i]) / std::sqrt(2);
    EXPECT_NEAR(both.std_error[i], std::max(12.706205 / 1.959964 * spread, own) / std::sqrt(2), 1e-6 * own) << i;
    by_own_errors += own > 6.6 * spread && std::abs(one.std_error[i] / two.std_error[i] - 1) > 1e-4;
  }
  EXPECT_GE(by_own_errors, 3);
}

// The same bed twice agrees better than chance: what both show of their densities by themselves is halved, and no less.
// Where the errors of the mean are larger, all of it grows until its trace is the sum of their squares.
TEST(Replicas, ThatAgreeHaveTheCovarianceOfWhatEachShows) {
  sim::Scene scene;
  scene.gravity = sim::UniformGravity{};
  scene.disks = {.species = {{.count = 30}}, .contact = {.restitution = 0.9}};
  scene.box.width = 8.3;
  scene.box.sides = sim::PeriodicSides{};
  scene.box.floor = sim::SinusoidalFloor{.amplitude = 0.55, .frequency = 0.37};
  const auto simulation = sim::simulate(scene);
  const MeasurementPlan plan{
      .phases = 1, .period = 1 / 0.37, .grid = {0.5, 0.5, 12}, .kernel = measuring_kernel, .observe = {}};
  BedMeasurement bed(scene, simulation->properties(), plan), shorter(scene, simulation->properties(), plan);
  simulation->advance_to(20 / 0.37);
  bed.begin(*simulation), shorter.begin(*simulation);
  sim::Snapshot at;
  for (int period = 0; period < 80; ++period) {
    simulation->snapshot(at);
    bed.look(*simulation, at, 0, false);
    if (period < 79) shorter.look(*simulation, at, 0, false);
    simulation->advance_to((21 + period) / 0.37);
  }
  bed.end(*simulation), shorter.end(*simulation);
  expect_joined(bed, shorter);
  sim::Profile joined = bed.bed().density(false);
  const sim::FilledHeights rows = sim::filled_heights(joined);
  const std::size_t n = rows.last - rows.first;
  ASSERT_GE(n, 3U);
  const std::vector<double> own = bed.bed().density_covariance(rows.first, rows.last);
  std::size_t blocks = 0;
  joined.std_error.assign(joined.std_error.size(), 0.0);
  const auto agreeing = joined_covariance({&bed, &bed}, joined, blocks);
  ASSERT_EQ(agreeing.size(), n * n);
  EXPECT_EQ(blocks, 2 * bed.bed().covariance_blocks());
  double trace = 0;
  for (std::size_t i = 0; i < n * n; ++i) EXPECT_DOUBLE_EQ(agreeing[i], own[i] / 2) << i;
  for (std::size_t i = 0; i < n; ++i) trace += agreeing[i * n + i];
  EXPECT_GT(trace, 0);
  joined.std_error.assign(joined.std_error.size(), std::sqrt(3 * trace / static_cast<double>(n)));
  const auto scattered = joined_covariance({&bed, &bed}, joined, blocks);
  for (std::size_t i = 0; i < n * n; ++i) EXPECT_NEAR(scattered[i], 3 * agreeing[i], 1e-12 * trace) << i;
}

// A shaken bed that dissipates: four beds by default, half of them filled at random.
TEST(Replicas, OfAShakenBedAreFourByDefault) {
  const ScratchFolder folder;
  const auto run = [&](const std::string& more, const std::string& out) {
    write_text(folder / (out + ".json"), R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "seed": 1,
      "units": "reduced", "disks": { "count": 60, "restitution": 0.9 }, "box": { "width": 10.3, "sides": "periodic" },
      "settle": 30, "measure": 60, )" + more +
                                             " } ] }");
    const ProgramResult result = run_shakebed({"run", out + ".json", "--out", out}, folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return Json::parse(read_text(folder / out / "bed/observables.json"));
  };
  const std::string shaken =
      R"("floor": { "motion": "sinusoidal", "amplitude": 0.8, "frequency": 0.35, "restitution": 0.9 })";
  const Json plain = run(shaken, "plain"), same = run(shaken + R"(, "replica_starts": "same")", "same"),
             one = run(shaken + R"(, "replicas": 1)", "one");
  EXPECT_EQ(plain["replicas"], 4);
  EXPECT_FALSE(one.contains("replicas"));
  EXPECT_FALSE(one["temperature_x"].contains("spread"));
  const auto rows = [&](const std::string& out) {
    const std::string text = read_text(folder / out / "bed/replicas.csv");
    std::vector<std::string> lines;
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = text.find('\n', at);
      if (text[at] != '#') lines.push_back(text.substr(at, end - at));
      at = end + 1;
    }
    return lines;
  };
  const auto alternate = rows("plain"), alike = rows("same");
  ASSERT_EQ(alternate.size(), 5u);
  EXPECT_EQ(alternate[1], alike[1]);  // the first and the third begin as the recipe says
  EXPECT_NE(alternate[2], alike[2]);
  EXPECT_EQ(alternate[3], alike[3]);
  EXPECT_NE(alternate[4], alike[4]);
  // The first bed is the one that a single run gives.
  EXPECT_THAT(alternate[1], HasSubstr(Json(one["temperature_x"]["value"]).dump()));
  // A bed in a bath does not keep its start.
  const Json bath = run(R"("bath": { "kind": "langevin", "temperature": 1, "rate": 1, "interval": 0.5 })", "bath");
  EXPECT_FALSE(bath.contains("replicas"));
}

}  // namespace
}  // namespace shakebed::pipelines
