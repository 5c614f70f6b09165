#include <gtest/gtest.h>

#include <cmath>

#include "sim/engine/contact_time.hpp"
#include "sim/engine/random.hpp"

namespace shakebed::sim {
namespace {

// Place two disks at contact and approaching, run them back, and recover the time.
TEST(TwoDisks, MeetWhenTheyWereRunBackFromContact) {
  Random random(11);
  for (int trial = 0; trial < 100'000; ++trial) {
    const double angle = 6.283185307179586 * random.uniform();
    const double dx = std::cos(angle), dz = std::sin(angle);
    const Random::Pair v = random.normal_pair();
    if (dx * v.first + dz * v.second > -1e-3) continue;  // grazing: its time is ill conditioned
    const double back = 10 * random.uniform();
    const double t = time_to_disk(dx - v.first * back, dz - v.second * back, v.first, v.second, 1);
    const double approach = -(dx * v.first + dz * v.second);
    EXPECT_NEAR(t, back, 1e-13 * (1 + back) * (1 + v.first * v.first + v.second * v.second) / approach * 10);
  }
}

TEST(TwoDisks, ThatTouchAndApproachCollideNow) { EXPECT_EQ(time_to_disk(1, 0, -1, 0, 1), 0); }
TEST(TwoDisks, ThatOverlapByRoundingAndApproachCollideNow) { EXPECT_EQ(time_to_disk(1 - 1e-15, 0, -1, 0, 1), 0); }
TEST(TwoDisks, ThatTouchAndSeparateNeverMeet) { EXPECT_EQ(time_to_disk(1, 0, 1, 0, 1), never); }
TEST(TwoDisks, ThatPassNeverMeet) { EXPECT_EQ(time_to_disk(5, 1.0001, -1, 0, 1), never); }
TEST(TwoDisks, AtRestNeverMeet) { EXPECT_EQ(time_to_disk(1.5, 0, 0, 0, 1), never); }

TEST(Lid, IsMissedByADiskThatTurnsBelowIt) { EXPECT_EQ(time_to_lid(0.51, 1, 1), never); }
TEST(Lid, IsReachedOnTheWayUp) { EXPECT_NEAR(time_to_lid(0.375, 1, 1), 0.5, 1e-15); }

TEST(Fall, TakesTheTimeOfAParabola) {
  EXPECT_NEAR(time_to_fall(2, 0, 1), 2, 1e-15);
  EXPECT_NEAR(time_to_fall(0, 1, 1), 2, 1e-15);
  EXPECT_NEAR(time_to_fall(1.5, -1, 1), 1, 1e-15);
  EXPECT_EQ(time_to_fall(1, 0, 0), never);
}

// Slower than a hundred-trillionth nothing approaches; a gap that rounding has closed is none.
TEST(ContactTimes, EndWhereNothingApproaches) {
  EXPECT_EQ(time_to_disk(1.5, 0, -1e-15, 0, 1), never);
  EXPECT_NEAR(time_to_disk(1.5, 0, -1e-12, 0, 1) * 1e-12, 0.5, 1e-12);
  EXPECT_EQ(time_to_wall(0.5, 0), never);
  EXPECT_EQ(time_to_wall(0.5, -1), never);
  EXPECT_EQ(time_to_wall(0.5, 1e-15), never);
  EXPECT_NEAR(time_to_wall(0.5, 1e-12) * 1e-12, 0.5, 1e-12);
  EXPECT_EQ(time_to_wall(3, 4), 0.75);
  EXPECT_EQ(time_to_wall(-1e-15, 4), 0);
  EXPECT_EQ(time_to_lid(-1e-15, 1, 1), 0);
  EXPECT_EQ(time_to_lid(0, 0, 1), never);
  EXPECT_EQ(time_to_lid(0.5, -1, 1), never);
  EXPECT_EQ(time_to_lid(3, 2, 0), 1.5) << "without gravity";
  EXPECT_NEAR(time_to_lid(0.5, 1, 1), 1, 1e-7) << "just reached";
  EXPECT_EQ(time_to_fall(0, 0, 1), 0) << "at rest on the floor";
  EXPECT_EQ(time_to_fall(3, -2, 0), 1.5);
  EXPECT_EQ(time_to_fall(3, 2, 0), never);
  EXPECT_NEAR(time_to_fall(3, 1, 2), (1 + std::sqrt(13.0)) / 2, 1e-15);
  EXPECT_NEAR(time_to_fall(3, -1, 2), (-1 + std::sqrt(13.0)) / 2, 1e-15);
}

// The path must stay inside its shell until the time given, and the time must not be needlessly short.
TEST(ShellExit, IsNeverLaterThanTheTrueExit) {
  Random random(12);
  double worst_share = 1;  // of the time to the true exit, for disks at thermal speeds that start in the middle
  for (int trial = 0; trial < 200'000; ++trial) {
    const double radius = 0.36, r = radius * random.uniform(), angle = 6.283185307179586 * random.uniform();
    const double speed = std::exp(-6 + 9 * random.uniform()), direction = 6.283185307179586 * random.uniform();
    const double ox = r * std::cos(angle), oz = r * std::sin(angle);
    const double vx = speed * std::cos(direction), vz = speed * std::sin(direction);
    const double gravity = trial % 2;
    const double t = time_to_leave_shell(ox, oz, vx, vz, radius, gravity);
    ASSERT_GE(t, 0);
    const TwoLanes side_by_side = time_to_leave_shell(TwoLanes{oz, ox}, TwoLanes{ox, oz}, TwoLanes{vz, vx},
                                                      TwoLanes{vx, vz}, both(radius), gravity);
    ASSERT_EQ(side_by_side[1], t);
    const auto distance = [&](double s) { return std::hypot(ox + vx * s, oz + vz * s - 0.5 * gravity * s * s); };
    for (int step = 0; step <= 20; ++step) ASSERT_LE(distance(t * step / 20), radius * (1 + 1e-12));
    if (gravity == 0) {
      ASSERT_NEAR(distance(t), radius, 1e-9);
    }
    if (r < 0.01 && speed > 1) {
      double truth = t;
      while (distance(truth) <= radius) truth += 1e-3 / speed;
      worst_share = std::min(worst_share, t / truth);
    }
  }
  // At thermal speed 1, straight up: 0.311 by the bound (0.36 = t + t^2/2) of 0.471 (0.36 = t - t^2/2), a share of
  // 0.66.
  EXPECT_GT(worst_share, 0.65);
}

TEST(ShellExit, OfADiskAtRestWithoutGravityIsBeforeNothing) {
  EXPECT_FALSE(time_to_leave_shell(0.1, 0.2, 0.0, 0.0, 0.36, 0) < never);
}

}  // namespace
}  // namespace shakebed::sim
