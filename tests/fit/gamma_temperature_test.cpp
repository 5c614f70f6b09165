#include "fit/map/gamma_temperature.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "fit/theory/fermi_profile.hpp"

namespace shakebed::fit {
namespace {

ShakenBed experiment() {
  ShakenBed bed;
  bed.gamma = 4.0;
  bed.acceleration_length = acceleration_length(9.81, 20.0, 2.99e-3);
  bed.column = column_from_initial_height(10.2, 1.10);
  return bed;
}

Reading reading(const std::vector<Reading>& readings, const std::string& name) {
  for (const Reading& r : readings) {
    if (r.name == name) return r;
  }
  ADD_FAILURE() << "no reading " << name;
  return {};
}

TEST(GammaMap, GivesThePaperCandidates) {
  const auto readings = temperatures_from_gamma(experiment());
  EXPECT_EQ(readings.size(), 28U);
  std::set<std::string> names;
  for (const Reading& r : readings) names.insert(r.name);
  EXPECT_EQ(names.size(), readings.size());
  // physics.md: 0.6659 with (Gamma-1)^2/2, k at 2/sqrt 3, mu^2; 0.9056 with the printed constants.
  EXPECT_NEAR(reading(readings, "eq6/above_highest_floor/close_packed").reduced_temperature, 0.6659, 5e-5);
  EXPECT_NEAR(reading(readings, "eq6/above_highest_floor/printed").reduced_temperature, 0.9056, 5e-5);
}

TEST(GammaMap, SaysWhenEquationFiveIsOutOfRange) {
  // physics.md: H_0 g/w^2 at Gamma = 4 is 0.94 to 2.57 D, so every reading with mu gives T/T_c = 1.8 to 3.5.
  double least = 1e9;
  double most = 0.0;
  double least_jump = 1e9;
  double most_jump = 0.0;
  for (const Reading& r : temperatures_from_gamma(experiment())) {
    ASSERT_EQ(r.status, ValueStatus::ok);
    if (r.expansion == ExpansionReading::mu && r.constants == ExpansionConstantsSource::computed) {
      least = std::min(least, r.reduced_temperature);
      most = std::max(most, r.reduced_temperature);
      least_jump = std::min(least_jump, r.jump);
      most_jump = std::max(most_jump, r.jump);
      EXPECT_FALSE(r.in_range) << r.name;
    }
    EXPECT_EQ(r.in_range, r.expansion == ExpansionReading::fermi ? r.temperature <= 10.2 / std::log(100.0)
                                                                 : r.reduced_temperature <= 1.0);
  }
  EXPECT_NEAR(least, 1.8, 0.05);
  EXPECT_NEAR(most, 2.96, 0.05);  // with k at phi_0 = 1.10; 3.5 is that of k at 2/sqrt 3
  const auto all = temperatures_from_gamma(experiment());
  EXPECT_NEAR(reading(all, "eq5/relative_max/close_packed").reduced_temperature, 3.5, 0.05);
  EXPECT_NEAR(least_jump, 0.94, 0.006);
  EXPECT_NEAR(most_jump, 2.57, 0.006);
}

TEST(GammaMap, FermiReadingEquatesTheRise) {
  const ShakenBed bed = experiment();
  for (const Reading& r : temperatures_from_gamma(bed)) {
    if (r.expansion != ExpansionReading::fermi) continue;
    EXPECT_NEAR(fermi_center_of_mass_rise(r.temperature, 10.2), r.jump, 1e-12);
  }
}

TEST(GammaMap, RunsBackwards) {
  ShakenBed bed = experiment();
  for (const double gamma : {1.3, 2.0, 4.0}) {
    bed.gamma = gamma;
    for (const Reading& r : temperatures_from_gamma(bed)) {
      const auto back = gammas_from_temperature(r.temperature, bed);
      for (const GammaReading& g : back) {
        if (g.name != r.name) continue;
        ASSERT_EQ(g.status, ValueStatus::ok) << r.name;
        EXPECT_NEAR(g.gamma, gamma, 1e-7) << r.name;
        EXPECT_EQ(g.in_range, r.in_range) << r.name;
      }
    }
  }
}

// The way back leads to a Gamma between two of a table in steps of 2 %, whose balls bounce to heights about the wanted
// one.
TEST(GammaMap, RestitutionRaisesTheJumpAndRunsBackwardsToo) {
  ShakenBed bed = experiment();
  bed.gamma = 1.3;
  bed.restitution = 0.5;
  const auto readings = temperatures_from_gamma(bed);
  const Reading r = reading(readings, "eq6/relative_max");
  ASSERT_EQ(r.status, ValueStatus::ok);
  const double wanted = fermi_center_of_mass_rise(r.temperature, 10.2) / bed.acceleration_length;
  int asked = 0;
  for (const GammaReading& g : gammas_from_temperature(r.temperature, bed)) {
    if (g.name == r.name) {
      ASSERT_EQ(g.status, ValueStatus::ok);
      EXPECT_LE(g.gamma, 1.35);
    }
    if (!g.name.starts_with("fermi/") || g.status != ValueStatus::ok) continue;
    const auto kind = std::find_if(jump_heights.begin(), jump_heights.end(),
                                   [&](JumpHeight one) { return g.name.ends_with(to_string(one)); });
    double low = INFINITY, high = -INFINITY;
    for (const double gamma : {g.gamma / 1.02, g.gamma, g.gamma * 1.02}) {
      const double mean = bounce(std::max(1.0, gamma), {.restitution = 0.5, .transient = 200, .flights = 400})
                              .mean_height[static_cast<std::size_t>(kind - jump_heights.begin())];
      low = std::min(low, mean), high = std::max(high, mean);
    }
    EXPECT_LE(low, wanted) << g.name;
    EXPECT_GE(high, wanted) << g.name;
    ++asked;
  }
  EXPECT_GT(asked, 1);
}

// A ball may bounce below the highest point of the floor, on average: then no bed rises by that.
TEST(GammaMap, HasNoTemperatureOfANegativeRise) {
  int negative = 0;
  for (const double gamma : {1.05, 1.5}) {
    ShakenBed bed = experiment();
    bed.gamma = gamma, bed.restitution = 0.7;
    const double height = bounce(gamma, {.restitution = 0.7}).mean_height[3];
    for (const Reading& r : temperatures_from_gamma(bed)) {
      if (r.jump_height != JumpHeight::above_highest_floor) continue;
      EXPECT_EQ(r.status, height < 0 ? ValueStatus::outside_range : ValueStatus::ok) << r.name << " " << gamma;
      EXPECT_EQ(r.temperature > 0, height > 0) << r.name << " " << gamma;
    }
    negative += height < 0;
  }
  EXPECT_GT(negative, 0) << "else this tests nothing";
  EXPECT_LT(negative, 2);
}

TEST(GammaMap, RefusesWhatIsNoTemperatureAndNoLength) {
  ShakenBed bed = experiment();
  for (const double temperature : {-0.1, std::nan(""), HUGE_VAL})
    for (const GammaReading& g : gammas_from_temperature(temperature, bed))
      EXPECT_EQ(g.status, ValueStatus::invalid_argument) << g.name;
  for (const double length : {0.0, -1.0, HUGE_VAL}) {
    bed.acceleration_length = length;
    for (const Reading& r : temperatures_from_gamma(bed)) EXPECT_EQ(r.status, ValueStatus::invalid_argument);
    for (const GammaReading& g : gammas_from_temperature(0.1, bed))
      EXPECT_EQ(g.status, ValueStatus::invalid_argument) << g.name;
  }
  EXPECT_NEAR(acceleration_length(9.81, 20, 3e-3), 9.81 / (1600 * M_PI * M_PI) / 3e-3, 1e-12);
}

TEST(GammaMap, HasAStatusWithoutATc) {
  ShakenBed bed = experiment();
  bed.column = column_from_initial_height(10.2, close_packing_density);
  for (const Reading& r : temperatures_from_gamma(bed, best_of())) {
    EXPECT_EQ(r.status, ValueStatus::pole) << r.name;
    EXPECT_FALSE(r.in_range);
    EXPECT_EQ(r.temperature, 0.0);
  }
  bed.gamma = -1.0;
  for (const Reading& r : temperatures_from_gamma(bed)) EXPECT_EQ(r.status, ValueStatus::invalid_argument);
}

TEST(GammaMap, QuietFloorMeansNoTemperature) {
  ShakenBed bed = experiment();
  bed.gamma = 0.9;
  for (const Reading& r : temperatures_from_gamma(bed)) {
    EXPECT_EQ(r.status, ValueStatus::ok);
    EXPECT_EQ(r.temperature, 0.0);
    EXPECT_TRUE(r.in_range);
  }
}

}  // namespace
}  // namespace shakebed::fit
