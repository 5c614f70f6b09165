// A shaker's frequency from places in frames: told within its error, and not told where there is none.
#include "ingest/profile/shaking_frequency.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace shakebed::ingest {
namespace {

std::vector<PlaceInFrame> moving(std::size_t count, double cycles_per_frame, double amplitude, double noise,
                                 std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<PlaceInFrame> places;
  for (std::size_t k = 0; k < count; ++k)
    places.push_back(
        {k, 100 + amplitude * std::sin(2 * std::numbers::pi * (cycles_per_frame * static_cast<double>(k) + 0.3)) +
                noise * normal(random)});
  return places;
}

// Places that wander: each is a share of the one before.
std::vector<PlaceInFrame> wandering(std::size_t count, double share, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<PlaceInFrame> places;
  double at = 0;
  for (std::size_t k = 0; k < count; ++k) {
    at = share * at + std::sqrt(1 - share * share) * normal(random);
    places.push_back({k, at});
  }
  return places;
}

TEST(ShakingFrequency, IsFoundWithinItsError) {
  // Over 400 films the error in standard errors is a normal deviate: its mean square is 1 +- 0.07, of which 5 sigma
  // are allowed; the neighbourhood it is told from adds a tenth.
  std::size_t films = 0;
  double square = 0, worst = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    const double frequency = 0.04 + 0.4 * static_cast<double>(seed) / 400;  // next to 1/2 it takes a clearer line
    const FoundFrequency found = find_frequency(moving(200, frequency, 1, 0.5, seed));
    ASSERT_TRUE(found.known) << frequency << ": " << found.why_not;
    const double error = (found.cycles_per_frame - frequency) / found.std_error;
    square += error * error;
    worst = std::max(worst, std::abs(error));
    EXPECT_NEAR(found.amplitude, 1, 0.25);
    ++films;
  }
  square /= static_cast<double>(films);
  EXPECT_GT(square, 0.65);
  EXPECT_LT(square, 1.5);
  EXPECT_LT(worst, 6);
}

TEST(ShakingFrequency, IsFoundWhereFramesAreMissing) {
  std::vector<PlaceInFrame> places = moving(300, 0.2113, 1, 0.3, 7);
  std::erase_if(places,
                [](const PlaceInFrame& one) { return one.frame % 7 == 3 || (one.frame > 100 && one.frame < 130); });
  const FoundFrequency found = find_frequency(places);
  ASSERT_TRUE(found.known) << found.why_not;
  EXPECT_NEAR(found.cycles_per_frame, 0.2113, 5 * found.std_error);
  EXPECT_LT(found.std_error, 1e-4);
}

TEST(ShakingFrequency, IsRefinedByALongFilm) {
  const std::vector<PlaceInFrame> places = moving(20000, 0.0712345, 1, 0.5, 3);
  const FoundFrequency first = find_frequency({places.begin(), places.begin() + 100});
  ASSERT_TRUE(first.known);
  const FoundFrequency all = refine_frequency(places, first);
  EXPECT_LT(all.std_error, 1e-3 * first.std_error);
  EXPECT_NEAR(all.cycles_per_frame, 0.0712345, 5 * all.std_error);
  EXPECT_NEAR(all.phase, 0.3, 0.01);
}

TEST(ShakingFrequency, TheFirstToneIsToldFromItsOvertones) {
  std::vector<PlaceInFrame> places;
  for (std::size_t k = 0; k < 150; ++k) {  // a parabola every 12.7 frames: what is thrown up
    const double phase = std::fmod(static_cast<double>(k) / 12.7, 1.0);
    places.push_back({k, 4 * phase * (1 - phase)});
  }
  const FoundFrequency found = find_frequency(places);
  ASSERT_TRUE(found.known) << found.why_not;
  EXPECT_NEAR(found.cycles_per_frame, 1 / 12.7, 2e-4);
}

// A slow drift has a slope near a line of the spectrum. It is not taken for a line all the same.
void expect_no_frequency(std::uint64_t series, std::size_t alarms_allowed) {
  for (const double share : {0.0, 0.6, 0.95, 0.995}) {
    std::size_t alarms = 0;
    for (std::uint64_t seed = 1; seed <= series; ++seed) alarms += find_frequency(wandering(100, share, seed)).known;
    EXPECT_LE(alarms, alarms_allowed) << "share " << share;
  }
}
// A false alarm of 1e-4 allows 0.05 of 500 series and 0.3 of 3000; more than 2 and 4 come by chance with a probability
// below 1e-4.
TEST(ShakingFrequency, NoiseHasNone) { expect_no_frequency(500, 2); }
TEST(ShakingFrequency, NoiseOfThreeThousandSeriesHasNone) { expect_no_frequency(3000, 4); }

TEST(ShakingFrequency, RestHasNone) {
  std::vector<PlaceInFrame> places;
  for (std::size_t k = 0; k < 100; ++k) places.push_back({k, 233.0});
  EXPECT_FALSE(find_frequency(places).known);
  EXPECT_EQ(find_frequency(places).why_not, "the height of the lowest beads has no period");
  EXPECT_FALSE(find_frequency({}).known);
  EXPECT_FALSE(find_frequency(moving(10, 0.2, 1, 0, 1)).known);
}

}  // namespace
}  // namespace shakebed::ingest
