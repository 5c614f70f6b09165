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

// Huber's estimate: residuals of up to 1.5 scatters pull with their size, larger ones with 1.5 scatters, those beyond 6
// not at all. The scatter is 1.4826 times the median size. At the line these pulls are in balance. Its errors follow
// from the mean square, to which no residual gives more than 36 squares of the scatter.
TEST(Floor, IsPulledByNoResidualWithMoreThanHubersBound) {
  FrameFindings frame;
  for (int column = 0; column < floor_columns; ++column) {
    const double u = column % 5 - 2, far = column == 32       ? 3.1
                                           : column % 13 == 6 ? 5
                                           : column % 8 == 3  ? 0.9
                                           : column % 17 == 2 ? -0.8
                                                              : 0;
    FoundDisk disk;
    disk.x_px = 30 * (column + 0.5), disk.radius_px = bead_diameter_px / 2;
    disk.y_px = 400 + 0.01 * disk.x_px - disk.radius_px + 0.2 * u + far;
    frame.disks.push_back(disk);
  }
  const Line line = find_floor({frame}, bead_diameter_px, floor_width_px);
  EXPECT_GT(line.slope, 4 * line.slope_std_error);
  std::vector<double> residuals, sizes;
  for (const FoundDisk& disk : frame.disks) {
    residuals.push_back(disk.y_px + disk.radius_px - line.offset - line.slope * disk.x_px);
    sizes.push_back(std::abs(residuals.back()));
  }
  std::sort(sizes.begin(), sizes.end());
  const double scatter = 1.4826 * sizes[20];  // of 40 the nearest to the middle, 19.5 rounded up
  double pull = 0, turn = 0, bounded = 0, out = 0, square = 0, weight = 0, moment = 0, second = 0;
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    const double x = frame.disks[k].x_px, r = residuals[k], size = std::abs(r) / scatter;
    const double pulls = size > 6 ? 0 : std::clamp(r, -1.5 * scatter, 1.5 * scatter), w = pulls / r;
    bounded += size > 1.5 && size<6, out += size> 6;
    pull += pulls, turn += pulls * (x - 600) / 600;
    weight += w, moment += w * x, second += w * x * x;
    square += std::min(r * r, 36 * scatter * scatter);
  }
  EXPECT_GE(bounded, 4);
  EXPECT_GE(out, 3);
  EXPECT_NEAR(pull, 0, 1e-6 * scatter);
  EXPECT_NEAR(turn, 0, 1e-6 * scatter);
  EXPECT_NEAR(line.middle.first, moment / weight, 1e-5);
  EXPECT_NEAR(line.middle.second, line.offset + line.slope * line.middle.first, 1e-9);
  const double variance = square / 38;
  EXPECT_GT(variance, scatter * scatter) << "the larger of the two counts";
  EXPECT_NEAR(line.middle_std_error, std::sqrt(variance / weight), 1e-6);
  EXPECT_NEAR(line.slope_std_error, std::sqrt(variance / (second - moment * moment / weight)), 1e-9);
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
