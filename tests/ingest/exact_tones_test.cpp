// Tones without noise: frequency, amplitude and phase are theirs, whatever the film adds to them.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "ingest/profile/shaking_frequency.hpp"

namespace shakebed::ingest {
namespace {

double tone(double turns) { return std::sin(2 * std::numbers::pi * turns); }

template <class PlaceAt>
std::vector<PlaceInFrame> places_at(std::size_t first, std::size_t count, const PlaceAt& place_at) {
  std::vector<PlaceInFrame> places;
  for (std::size_t k = first; k < first + count; ++k) places.push_back({k, place_at(static_cast<double>(k))});
  return places;
}

// The phase is that at the film's frame 0, also of a film whose first frames are missing.
TEST(ExactTones, HaveThePhaseOfTheFirstFrame) {
  for (const std::size_t first : {0U, 3U, 1000U})
    for (const double phase : {0.05, 0.3, 0.55, 0.95}) {
      const auto places = places_at(first, 90, [&](double t) { return 40 + 2 * tone(0.1713 * t + phase); });
      const FoundFrequency found = find_frequency(places);
      ASSERT_TRUE(found.known) << found.why_not;
      EXPECT_NEAR(found.cycles_per_frame, 0.1713, 1e-9);
      EXPECT_NEAR(found.amplitude, 2, 1e-6);
      EXPECT_NEAR(found.phase, phase, 1e-5) << first;
      EXPECT_LT(found.false_alarm, 1e-4);
    }
}

// A drift is no tone, and takes nothing from one; nor do its first two overtones.
TEST(ExactTones, AreToldFromADriftAndFromTheirOvertones) {
  const auto with = [&](double drift, double second, double third) {
    return find_frequency(places_at(0, 120, [&](double t) {
      const double turns = 0.0917 * t + 0.2;
      return 7 + drift * t + tone(turns) + second * tone(2 * turns + 0.1) + third * tone(3 * turns + 0.4);
    }));
  };
  for (const auto& [drift, second, third] :
       {std::array{0.0, 0.0, 0.0}, {0.3, 0.0, 0.0}, {-0.3, 0.4, 0.0}, {0.0, 0.0, 0.4}, {0.1, 0.5, 0.5}}) {
    const FoundFrequency found = with(drift, second, third);
    ASSERT_TRUE(found.known) << found.why_not;
    EXPECT_NEAR(found.cycles_per_frame, 0.0917, 1e-8) << drift << ", " << second << ", " << third;
    EXPECT_NEAR(found.amplitude, 1, 1e-6);
    EXPECT_NEAR(found.phase, 0.2, 1e-6);
  }
}

// Where the first overtone would lie above half a cycle a frame it is not fitted: the tone is found as well.
TEST(ExactTones, AreFoundUpToHalfACycleAFrame) {
  for (const double cycles : {0.02, 0.16, 0.17, 0.24, 0.26, 0.33, 0.48}) {
    const FoundFrequency found = find_frequency(places_at(0, 200, [&](double t) { return tone(cycles * t + 0.4); }));
    ASSERT_TRUE(found.known) << cycles << ": " << found.why_not;
    EXPECT_NEAR(found.cycles_per_frame, cycles, 1e-8);
    EXPECT_NEAR(found.amplitude, 1, 1e-5);
  }
  // Above it a tone is seen at its alias, turned about: sin(2 pi (0.9 k + p)) = sin(2 pi (-0.1 k + p)).
  const FoundFrequency alias = find_frequency(places_at(0, 200, [&](double t) { return tone(0.9 * t + 0.4); }));
  EXPECT_NEAR(alias.cycles_per_frame, 0.1, 1e-8);
  EXPECT_NEAR(alias.phase, 0.1, 1e-6) << "half a turn less 0.4";
  // Three cycles are the fewest.
  EXPECT_FALSE(find_frequency(places_at(0, 200, [&](double t) { return tone(0.0125 * t); })).known);
}

// With each third frame missing, or each tenth, the same.
TEST(ExactTones, AreFoundFromTheFramesThatThereAre) {
  std::vector<PlaceInFrame> some, most;
  for (std::size_t k = 0; k < 300; ++k) {
    const double place = tone(0.0713 * static_cast<double>(k) + 0.25);
    if (k % 3 != 1) some.push_back({k, place});
    if (k % 10 != 4) most.push_back({k, place});
  }
  for (const auto& places : {some, most}) {
    const FoundFrequency found = find_frequency(places);
    ASSERT_TRUE(found.known) << found.why_not;
    EXPECT_NEAR(found.cycles_per_frame, 0.0713, 1e-8);
    EXPECT_NEAR(found.phase, 0.25, 1e-6);
  }
}

// A tone that is followed from its first frames to all of them keeps its cycles; what was not known stays unknown.
TEST(ExactTones, AreFollowedThroughALongFilm) {
  const auto all = places_at(5, 1500, [&](double t) { return tone(0.1234567 * t + 0.6); });
  FoundFrequency rough;
  rough.known = true, rough.cycles_per_frame = 0.1234567 + 0.002, rough.std_error = 0.002, rough.false_alarm = 3e-7;
  const FoundFrequency refined = refine_frequency(all, rough);
  ASSERT_TRUE(refined.known);
  EXPECT_NEAR(refined.cycles_per_frame, 0.1234567, 1e-10);
  EXPECT_NEAR(refined.phase, 0.6, 1e-5);
  EXPECT_EQ(refined.false_alarm, 3e-7) << "that of the first look";
  EXPECT_LT(refined.std_error, 1e-6);
  rough.known = false;
  EXPECT_FALSE(refine_frequency(all, rough).known);
  rough.known = true;
  EXPECT_EQ(refine_frequency({all.begin(), all.begin() + 23}, rough).cycles_per_frame, rough.cycles_per_frame);
  EXPECT_NEAR(refine_frequency({all.begin(), all.begin() + 24}, rough).cycles_per_frame, 0.1234567, 1e-8);
}

}  // namespace
}  // namespace shakebed::ingest
