// The floor below beads whose bottoms are made by hand.
#include "ingest/profile/floor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace shakebed::ingest {
namespace {

constexpr double bead_diameter_px = 20;
constexpr int floor_columns = 40, floor_width_px = 1200;  // columns of 1.5 diameters

// One bead in each column of a frame, its bottom at y = 400 + slope (x - 600), off by `noise` at random.
std::vector<FrameFindings> beads_on_a_floor(double slope, double noise, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  FrameFindings frame;
  for (int column = 0; column < floor_columns; ++column) {
    FoundDisk disk;
    disk.x_px = 30 * (column + 0.5), disk.radius_px = bead_diameter_px / 2;
    disk.y_px = 400 + slope * (disk.x_px - 600) - disk.radius_px + noise * normal(random);
    frame.disks.push_back(disk);
  }
  return {frame};
}

TEST(Floor, WithoutNoiseIsItsLine) {
  std::mt19937_64 random(1);
  const Line line = find_floor(beads_on_a_floor(0.015, 0, random), bead_diameter_px, floor_width_px);
  EXPECT_NEAR(line.slope, 0.015, 1e-12);
  EXPECT_NEAR(line.offset, 400 - 0.015 * 600, 1e-9);
  EXPECT_NEAR(line.middle.first, 600, 1e-9);
  EXPECT_NEAR(line.middle.second, 400, 1e-9);
}

// Of 400 floors the errors in units of the stated ones have an rms of 1 +- 0.035. Huber's weights take in what they
// leave out, and the larger of two measures of the scatter is stated, so it is somewhat below 1.
TEST(Floor, AndItsTiltAreWithinTheirErrors) {
  std::mt19937_64 random(3);
  double slopes = 0, middles = 0;
  constexpr int floors = 400;
  for (int i = 0; i < floors; ++i) {
    const Line line = find_floor(beads_on_a_floor(0.015, 0.5, random), bead_diameter_px, floor_width_px);
    slopes += std::pow((line.slope - 0.015) / line.slope_std_error, 2) / floors;
    middles +=
        std::pow((line.middle.second - 400 - 0.015 * (line.middle.first - 600)) / line.middle_std_error, 2) / floors;
  }
  EXPECT_GT(std::sqrt(slopes), 0.8);
  EXPECT_LT(std::sqrt(slopes), 1.1);
  EXPECT_GT(std::sqrt(middles), 0.8);
  EXPECT_LT(std::sqrt(middles), 1.1);
}

// A tilt within four of its errors is not believed.
TEST(Floor, IsLevelWhereItsTiltIsWithinItsErrors) {
  std::mt19937_64 random(5);
  int tilted = 0;
  for (int i = 0; i < 100; ++i)
    tilted += find_floor(beads_on_a_floor(0, 0.5, random), bead_diameter_px, floor_width_px).slope != 0;
  EXPECT_EQ(tilted, 0);
}

}  // namespace
}  // namespace shakebed::ingest
