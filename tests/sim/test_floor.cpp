#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "sim/engine/contact_time.hpp"
#include "sim/engine/floor_motion.hpp"
#include "sim/engine/random.hpp"

namespace shakebed::sim {
namespace {

using Long = long double;

struct Flight {
  double bottom, vz, gravity, now;
};

// The gap between the point and the floor, in extended precision.
Long gap(const SinusoidalFloor& floor, const Flight& f, Long t) {
  const Long pi = std::numbers::pi_v<Long>;
  return f.bottom + f.vz * t - 0.5L * f.gravity * t * t -
         floor.amplitude * std::sin(2 * pi * floor.frequency * (f.now + t));
}

// Whether the floor is above the point: in double precision where this decides it.
bool below_floor(const SinusoidalFloor& floor, const Flight& f, Long at) {
  const auto t = static_cast<double>(at);
  const double rough = f.bottom + f.vz * t - 0.5 * f.gravity * t * t -
                       floor.amplitude * std::sin(2 * std::numbers::pi * floor.frequency * (f.now + t));
  constexpr double surely = 1e-11;  // a thousand times what rounding makes of terms below 1e3
  return std::abs(rough) > surely ? rough < 0 : gap(floor, f, at) < 0;
}

// The first downward crossing found by walking in steps far smaller than anything moves, then bisecting.
Long first_crossing(const SinusoidalFloor& floor, const Flight& f, Long horizon) {
  const Long step = 1e-4L / floor.frequency;
  bool before = below_floor(floor, f, 0);
  for (Long t = 0; t < horizon; t += step) {
    const bool after = below_floor(floor, f, t + step);
    if (!before && after) {
      Long low = t, high = t + step;
      for (int i = 0; i < 80; ++i) {
        const Long middle = (low + high) / 2;
        (gap(floor, f, middle) >= 0 ? low : high) = middle;
      }
      return low;
    }
    before = after;
  }
  return std::numeric_limits<Long>::infinity();
}

TEST(MovingFloor, IsMetWhereExtendedPrecisionFindsTheFirstCrossing) {
  Random random(21);
  const SinusoidalFloor floor{0.836, 0.35};
  const FloorMotion motion(floor);
  for (int trial = 0; trial < 500; ++trial) {
    Flight f{0, 3 * random.normal_pair().first, 1, random.uniform() / floor.frequency};
    f.bottom = motion.position(f.now) + 2 * random.uniform();
    const double t = motion.time_to_contact(f.bottom, f.vz, f.gravity, f.now, never);
    const Long truth = first_crossing(floor, f, 40);
    ASSERT_NEAR(t * floor.frequency, static_cast<double>(truth) * floor.frequency, 2e-14)
        << "bottom " << f.bottom << " vz " << f.vz << " now " << f.now;
  }
}

TEST(MovingFloor, LeavesNoGapAtTheContact) {
  Random random(22);
  const SinusoidalFloor floor{0.836, 0.35};
  const FloorMotion motion(floor);
  for (int trial = 0; trial < 100'000; ++trial) {
    Flight f{0, 3 * random.normal_pair().first, 1, random.uniform() / floor.frequency};
    f.bottom = motion.position(f.now) + 2 * random.uniform();
    const double t = motion.time_to_contact(f.bottom, f.vz, f.gravity, f.now, never);
    const double terms = std::abs(f.bottom) + std::abs(f.vz * t) + 0.5 * t * t + floor.amplitude;
    ASSERT_LE(std::abs(static_cast<double>(gap(floor, f, t))), 1e-15 * terms);
  }
}

TEST(MovingFloor, IsMetAgainOnlyAfterAHopByADiskThatJustLeftIt) {
  const SinusoidalFloor floor{0.5, 0.4};
  const FloorMotion motion(floor);
  for (double now = 0; now < 2.5; now += 0.01) {
    for (double speed : {1e-6, 1e-3, 0.1, 1.0}) {
      const double rounding = 1e-16;
      const double t =
          motion.time_to_contact(motion.position(now) - rounding, motion.velocity(now) + speed, 1, now, never);
      ASSERT_GT(t, 0.0);
      const Flight f{motion.position(now), motion.velocity(now) + speed, 1, now};
      for (int i = 1; i < 20; ++i) ASSERT_GT(static_cast<double>(gap(floor, f, t * i / 20)), -1e-15);
    }
  }
}

// A parabola that grazes the floor's crest from above by 1e-9 must pass, one that is 1e-9 too low must hit.
TEST(MovingFloor, TellsAGrazingHitFromAMiss) {
  const SinusoidalFloor floor{0.05, 1.0};  // the floor curves less than the parabola near its trough
  const FloorMotion motion(floor);
  for (double lift : {1e-6, 1e-9, 1e-12}) {
    // Fly upwards past a floor that rises below: the gap has a local minimum before the disk goes away upwards.
    double low = -1, high = 1;  // bisect the initial height for tangency
    const double vz = 0.1, now = 0.9;
    const auto first = [&](double bottom) { return motion.time_to_contact(bottom, vz, 0.5, now, 0.3); };
    for (int i = 0; i < 100; ++i) {
      const double middle = (low + high) / 2;
      (first(middle) == never ? high : low) = middle;
    }
    EXPECT_EQ(first(high + lift), never);
    EXPECT_LT(first(high - lift), 0.3);
  }
}

// Searches that end early, because the floor cannot rise so far until then, find what the endless one finds.
TEST(MovingFloor, IsMetWithinAnyHorizonThatHoldsTheContact) {
  TabulatedFloor table{1.7, {}};
  Random random(11);
  for (int k = 0; k < 24; ++k) table.heights.push_back(random.uniform());
  for (const FloorMotion& floor : {FloorMotion(SinusoidalFloor{0.84, 0.35}), FloorMotion(table)}) {
    int within = 0, beyond = 0;
    for (int flight = 0; flight < 100'000; ++flight) {
      const double now = 64 * random.uniform(), bottom = floor.position(now) + 0.3 * random.uniform(),
                   vz = floor.velocity(now) + 4 * (random.uniform() - 0.5);
      const double contact = floor.time_to_contact(bottom, vz, 1, now, never);
      ASSERT_LT(contact, never);
      const double horizon = floor.period() * std::exp(-6 * random.uniform());
      if (contact <= horizon) {
        ++within;
        ASSERT_EQ(floor.time_to_contact(bottom, vz, 1, now, horizon), contact) << "horizon " << horizon;
      } else {
        ++beyond;
        ASSERT_EQ(floor.time_to_contact(bottom, vz, 1, now, horizon), never) << "horizon " << horizon;
      }
    }
    EXPECT_GT(within, 10'000);
    EXPECT_GT(beyond, 10'000);
  }
}

TEST(StillFloor, IsMetByAFallingDisk) {
  const FloorMotion still;
  EXPECT_NEAR(still.time_to_contact(2, 0, 1, 0, never), 2, 1e-15);
  EXPECT_EQ(still.time_to_contact(2, 0, 1, 0, 1.9), never);
  EXPECT_EQ(still.time_to_contact(0, -1, 1, 0, never), 0);
}

TEST(TabulatedFloor, FollowsASineThroughItsSamples) {
  TabulatedFloor table{2.0, {}};
  for (int i = 0; i < 64; ++i) table.heights.push_back(0.7 * std::sin(2 * std::numbers::pi * i / 64));
  const FloorMotion spline(table), sine(SinusoidalFloor{0.7, 0.5});
  for (double t = -3; t < 5; t += 0.0137) {
    EXPECT_NEAR(spline.position(t), sine.position(t), 2e-6);
    EXPECT_NEAR(spline.velocity(t), sine.velocity(t), 2e-4);
    EXPECT_NEAR(spline.motion(t).acceleration, sine.motion(t).acceleration, 2e-2);
    EXPECT_LE(spline.position(t), spline.highest());
    EXPECT_GE(spline.position(t), spline.lowest());
    EXPECT_LE(spline.motion(t).acceleration, spline.largest_upward_acceleration() * (1 + 1e-12));
  }
}

// A floor of jerks, under gravity and without: no flight goes below it before the contact, and there the gap is closed.
TEST(TabulatedFloor, IsMetAtTheFirstCrossing) {
  Random random(23);
  int met = 0;
  for (int trial = 0; trial < 3'000; ++trial) {
    TabulatedFloor table{2.0, {}};
    for (int i = 0; i < 11; ++i) table.heights.push_back(random.uniform());
    const FloorMotion floor(table);
    Flight f{0, 2 * random.normal_pair().first, trial % 3 == 0 ? 0.0 : 1.0, 7 * random.uniform()};
    if (trial % 4 < 2) f.vz = floor.velocity(f.now) + 0.1 * f.vz;  // it follows the floor for a while
    f.bottom = floor.position(f.now) + random.uniform() * random.uniform() * random.uniform();
    const double horizon = trial % 2 == 0 ? 0.4 * random.uniform() : 5;
    const double t = floor.time_to_contact(f.bottom, f.vz, f.gravity, f.now, horizon);
    const auto gap_at = [&](double later) {
      return f.bottom + (f.vz - 0.5 * f.gravity * later) * later - floor.position(f.now + later);
    };
    const double end = std::min(t, horizon);
    for (int k = 1; k < 4'000; ++k) ASSERT_GT(gap_at(end * k / 4'000), -1e-13) << "trial " << trial << ", step " << k;
    if (t == never) continue;
    ++met;
    ASSERT_LE(t, horizon);
    ASSERT_NEAR(gap_at(t), 0, 1e-13) << "trial " << trial;
  }
  EXPECT_GT(met, 1'000);
  EXPECT_LT(met, 2'500);
}

// What recedes without gravity is met within a period or never; the search ends.
TEST(MovingFloor, IsNotMetByWhatFloatsAboveIt) {
  const FloorMotion floor(SinusoidalFloor{0.5, 0.3});
  EXPECT_EQ(floor.time_to_contact(0.5 + 1e-9, 0, 0, 1, never), never);
  EXPECT_EQ(floor.time_to_contact(0.5 - 1e-3, 1e-3, 0, 0.75 / 0.3 + 1e-3, never), never);
  EXPECT_NEAR(floor.time_to_contact(0.25, 0, 0, 0, never), 1 / (12 * 0.3), 1e-14);
  EXPECT_NEAR(floor.time_to_contact(0.25, 0, 0, 0.25 / 0.3, never), (1 + 1 / 12.0 - 0.25) / 0.3, 1e-14);
}

}  // namespace
}  // namespace shakebed::sim
