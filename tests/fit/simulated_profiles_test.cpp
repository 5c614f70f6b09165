#include "fit/profile_fit/simulated_profiles.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "fit/theory/expansion.hpp"
#include "tests/fit/synthetic.hpp"

namespace shakebed::fit {
namespace {

// A stand-in for a simulated bed: true disks in local density with the rows of a crystal on top, which no equation of
// state draws; `seed` makes its noise and `preparation` moves its surface.
Profile layered_bed(double temperature, double preparation, double noise, std::uint64_t seed) {
  const auto bed = HydrostaticProfile::of_column(best_of(), temperature, {23.0, 1.10});
  synthetic::Normal normal(seed);
  const double moved = preparation * normal();
  Profile profile;
  for (int i = 0; i < 110; ++i) {
    const double height = 0.125 + 0.25 * i;
    const double smooth = bed.density(height - moved);
    const double rows = 1.0 + 0.3 * std::cos(2.0 * std::numbers::pi * height / 0.866) * std::min(1.0, smooth / 1.1);
    const double density = smooth * rows;
    const double error = synthetic::bin_error(density, noise);
    profile.height.push_back(height);
    profile.number_density.push_back(density + error * normal());
    profile.std_error.push_back(error);
  }
  return profile;
}

std::vector<SimulatedProfile> make_library(double preparation, int repeats) {
  std::vector<SimulatedProfile> library;
  std::uint64_t seed = 100;
  for (double t = 0.05; t < 0.45; t *= 1.15) {
    for (int r = 0; r < repeats; ++r)
      library.push_back({t, layered_bed(t, preparation, 0.005, seed++), 20.0 * (1.0 - t / 0.2)});
  }
  return library;
}

TEST(SimulatedProfiles, MatchFindsTheTemperatureOfALayeredBed) {
  const auto library = make_library(0.0, 1);
  int held = 0;
  int trials = 0;
  for (const double t : {0.08, 0.12, 0.2, 0.3}) {
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
      const MatchResult match = match_simulated(layered_bed(t, 0.0, 0.01, 5000 + seed), library);
      ASSERT_EQ(match.status, FitStatus::ok) << match.message;
      EXPECT_NEAR(match.temperature.value / t, 1.0, 0.05);
      held += match.interval.low <= t && t <= match.interval.high ? 1 : 0;
      ++trials;
    }
  }
  std::printf("[ coverage ] simulation as the model: 95 %% intervals hold the truth in %.1f %% of %d matches\n",
              100.0 * held / trials, trials);
  // The band for 200 simulated profiles: 90 to 98 %. Under exact coverage a false alarm has probability 1 %.
  EXPECT_GE(held, 180);
  EXPECT_LE(held, 196);
}

// What is said of the interpolation is how far the temperature moves with one order less.
TEST(SimulatedProfiles, InterpolationErrorIsTheStepToOneOrderLess) {
  const auto library = make_library(0.0, 1);
  const Profile measured = layered_bed(0.13, 0.0, 0.01, 5000);
  const auto at_order = [&](int order) { return match_simulated(measured, library, {.order = order}); };
  const MatchResult four = at_order(4), three = at_order(3), two = at_order(2);
  const double step = std::abs(four.temperature.value - three.temperature.value);
  ASSERT_GT(step, 1e-6);
  ASSERT_GT(std::abs(four.temperature.value - two.temperature.value), 1.5 * step);
  EXPECT_NEAR(four.interpolation_error / step, 1, 1e-3);
  EXPECT_NEAR(two.interpolation_error, 0, 1e-12) << "there is no order below two";
}

// A measurement at heights between those of the library: densities are interpolated, T stays.
TEST(SimulatedProfiles, AMeasurementAtOtherHeightsHasTheSameTemperature) {
  const auto smooth_bed = [](double temperature, double offset) {
    const auto bed = HydrostaticProfile::of_column(best_of(), temperature, {23.0, 1.10});
    Profile profile;
    for (int i = 0; i < 110; ++i) {
      profile.height.push_back(offset + 0.25 * i);
      profile.number_density.push_back(bed.density(profile.height.back()));
      profile.std_error.push_back(synthetic::bin_error(profile.number_density.back(), 0.01));
    }
    return profile;
  };
  std::vector<SimulatedProfile> library;
  for (double t = 0.05; t < 0.45; t *= 1.1) library.push_back({t, smooth_bed(t, 0.125), 0.0});
  for (const double t : {0.2, 0.35}) {  // the tail is several bins long
    const MatchResult same = match_simulated(smooth_bed(t, 0.125), library);
    const MatchResult between = match_simulated(smooth_bed(t, 0.0), library);
    ASSERT_EQ(same.status, FitStatus::ok) << same.message;
    ASSERT_EQ(between.status, FitStatus::ok) << between.message;
    EXPECT_NEAR(same.temperature.value / t, 1.0, 0.02);
    EXPECT_NEAR(between.temperature.value / t, 1.0, 0.02);
  }
}

TEST(SimulatedProfiles, RepeatsTeachThePreparationSpread) {
  // Beds whose surface lies 0.1 D up or down by preparation: the errors must grow to hold that, and do only with
  // repeats.
  const auto library = make_library(0.1, 6);
  const auto single = make_library(0.1, 1);
  const Value scatter = library_scatter(test_library(library), 0.15);
  ASSERT_TRUE(scatter.ok());
  int held = 0;
  int held_likelihood = 0;
  int held_blind = 0;
  const int trials = 100;
  for (std::uint64_t seed = 0; seed < trials; ++seed) {
    const Profile measured = layered_bed(0.15, 0.1, 0.005, 9000 + seed);
    const MatchResult match = match_simulated(measured, library);
    ASSERT_EQ(match.status, FitStatus::ok);
    const double off = std::abs(match.temperature.value - 0.15);
    held_likelihood += off < 2.0 * match.temperature.std_error ? 1 : 0;
    held += off < 2.0 * std::max(match.temperature.std_error, 0.15 * scatter.value) ? 1 : 0;
    const MatchResult blind = match_simulated(measured, single);
    held_blind += std::abs(blind.temperature.value - 0.15) < 2.0 * blind.temperature.std_error ? 1 : 0;
  }
  std::printf(
      "[ coverage ] preparation spread, 2 standard errors hold the truth: %d of 100 with the library's scatter (%.1f "
      "%%), "
      "%d by likelihood alone, %d without repeats\n",
      held, 100.0 * scatter.value, held_likelihood, held_blind);
  EXPECT_GE(held, 90);  // 95 expected; below 90 has a probability of 1 %
  EXPECT_LE(scatter.value, 0.05);
  EXPECT_LT(held_blind, held_likelihood);
}

TEST(SimulatedProfiles, TheLibraryTestsItself) {
  const auto rows = test_library(make_library(0.0, 1));
  EXPECT_GE(rows.size(), 10U);
  for (const LibraryTest& row : rows) {
    ASSERT_EQ(row.status, FitStatus::ok);
    EXPECT_NEAR(row.matched.value / row.temperature, 1.0, 0.05);
  }
}

TEST(SimulatedProfiles, AMeasurementOutsideTheLibraryIsSaidToBe) {
  const auto library = make_library(0.0, 1);
  const MatchResult hot = match_simulated(layered_bed(0.9, 0.0, 0.01, 1), library);
  EXPECT_EQ(hot.status, FitStatus::unresolved_temperature);
  EXPECT_TRUE(hot.interval.high_open);
  EXPECT_FALSE(hot.warnings.empty());
}

TEST(SimulatedProfiles, GiveAStatusForNonsense) {
  const auto library = make_library(0.0, 1);
  EXPECT_EQ(match_simulated({}, library).status, FitStatus::bad_input);
  EXPECT_EQ(match_simulated(layered_bed(0.1, 0.0, 0.01, 1), {}).status, FitStatus::bad_input);
  EXPECT_EQ(match_simulated(layered_bed(0.1, 0.0, 0.01, 1), {library[0]}).status, FitStatus::bad_input);
  Profile zero = layered_bed(0.1, 0.0, 0.01, 1);
  for (double& d : zero.number_density) d = 0.0;
  EXPECT_EQ(match_simulated(zero, library).status, FitStatus::no_signal);
  Profile broken = layered_bed(0.1, 0.0, 0.01, 1);
  broken.number_density[5] = std::nan("");
  EXPECT_EQ(match_simulated(broken, library).status, FitStatus::bad_input);
  EXPECT_EQ(match_simulated(layered_bed(0.1, 0.0, 0.01, 1), library, {.low = 100.0}).status, FitStatus::too_few_bins);
}

}  // namespace
}  // namespace shakebed::fit
