// Covered area of shaded beads: their centres, seen through their own shading, give the same density as their rows.
#include "ingest/profile/coverage.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

constexpr double covering_radius = 10;  // px, of a bead that is 20 px wide
const HeightBins covered_bins{0, 0.125, 24};

// A bead of contrast 1 - f (r/R)^2 with, to its lower side, s r/R sin(theta) more.
struct ShadedCover {
  double falling = 0, lower_side = 0;

  [[nodiscard]] double at(double x, double y) const {
    const double r = std::hypot(x, y) / covering_radius;
    return r < 1 ? 1 - falling * r * r + lower_side * y / covering_radius : 0.0;
  }
  [[nodiscard]] FinderCalibration finder() const {
    FinderCalibration calibration;
    calibration.width = 100, calibration.height = 80, calibration.radius_px = covering_radius;
    BeadProfile& profile = calibration.profile;
    profile.step_px = 0.02;
    for (int k = 0; k * profile.step_px < 11; ++k)
      profile.level.push_back(static_cast<float>(falling == 0 && k * 0.02 < covering_radius ? 1 : at(k * 0.02, 0)));
    profile.level.push_back(0);
    profile.fourth_harmonic.assign(profile.level.size(), 0.0F);
    if (lower_side == 0) return calibration;
    BeadAsymmetry::Harmonics harmonics;
    harmonics.step_px = 0.02;
    for (auto* parts : {&harmonics.cosine, &harmonics.sine})
      for (auto& part : *parts) part.assign(profile.level.size(), 0.0);
    for (int k = 0; k * 0.02 < covering_radius; ++k)
      harmonics.sine[0][static_cast<std::size_t>(k)] = lower_side * k * 0.02 / covering_radius;
    profile.asymmetry = std::make_shared<const BeadAsymmetry>(harmonics);
    return calibration;
  }
  // Its contrast summed along each row of a frame, over what a unit of it stands for: its mean over the disk.
  [[nodiscard]] std::vector<float> rows(double middle_y) const {
    std::vector<float> covered(80, 0.0F);
    constexpr double fine = 0.05;
    double all = 0;
    for (int row = 0; row < 80; ++row) {
      double sum = 0;
      for (double y = row - 0.5 + 0.5 * fine; y < row + 0.5; y += fine)
        for (double x = -11; x < 11; x += fine) sum += at(x, y - middle_y) * fine * fine;
      covered[static_cast<std::size_t>(row)] = static_cast<float>(sum);
      all += sum;
    }
    for (float& one : covered) one *= static_cast<float>(std::numbers::pi * covering_radius * covering_radius / all);
    return covered;
  }
};

BedCalibration bed_that_is_covered() {
  BedCalibration bed;
  bed.floor_px = 70, bed.width = 5;
  return bed;
}

TEST(Coverage, OfAShadedBeadIsThatOfItsCentre) {
  const BedCalibration bed = bed_that_is_covered();
  for (const ShadedCover& bead : {ShadedCover{0, 0}, {0.9, 0}, {0.3, 0.6}, {0.3, -0.6}}) {
    const FinderCalibration finder = bead.finder();
    Coverage coverage(finder, bed, 20, 100, covering_radius);
    coverage.add({bead.rows(44), {1.3}}, covered_bins, 1);
    const DensityProfile profile = coverage.profile(covered_bins);
    double sum = 0, height = 0;
    for (std::size_t bin = 0; bin < covered_bins.count; ++bin) {
      const double part = profile.number_density[bin] * covered_bins.width * bed.width;
      sum += part, height += part * (static_cast<double>(bin) + 0.5) * covered_bins.width;
    }
    EXPECT_NEAR(sum, 1, 2e-3) << "one bead";
    // What lies to its lower side lowers the bead's area: by int s (y/R)^2 over int 1 - f (r/R)^2, that is
    // s/4 over 1 - f/2 radii.
    EXPECT_NEAR(height, 1.3 - 0.5 * (bead.lower_side / 4) / (1 - bead.falling / 2), 3e-3);
    EXPECT_LT(coverage.disagreement(profile), 0.02) << bead.falling << ", " << bead.lower_side;
  }
}

// The light on the other side is seen, as is another shading: their rows are not those of the centres.
TEST(Coverage, DisagreesWhereTheShadingIsAnother) {
  const BedCalibration bed = bed_that_is_covered();
  const FinderCalibration finder = ShadedCover{0.3, 0.6}.finder();
  Coverage turned(finder, bed, 20, 100, covering_radius);
  turned.add({ShadedCover{0.3, -0.6}.rows(44), {1.3}}, covered_bins, 1);
  EXPECT_GT(turned.disagreement(turned.profile(covered_bins)), 0.08);
  const FinderCalibration flat = ShadedCover{0, 0}.finder();
  Coverage falling(flat, bed, 20, 100, covering_radius);
  falling.add({ShadedCover{0.9, 0}.rows(44), {1.3}}, covered_bins, 1);
  EXPECT_GT(falling.disagreement(falling.profile(covered_bins)), 0.04);
}

// Two frames, of which one is empty, are half of one; three beads at three heights are the sum of each.
TEST(Coverage, IsTheMeanOfItsFrames) {
  const BedCalibration bed = bed_that_is_covered();
  const ShadedCover bead{0.9, 0};
  const FinderCalibration finder = bead.finder();
  Coverage one(finder, bed, 20, 100, covering_radius), two(finder, bed, 20, 100, covering_radius);
  std::vector<float> rows(80, 0.0F);
  for (const double height : {0.8, 1.3, 1.85}) {
    const std::vector<float> its = bead.rows(70 - 20 * height);
    for (std::size_t k = 0; k < rows.size(); ++k) rows[k] += its[k];
  }
  one.add({rows, {0.8, 1.3, 1.85}}, covered_bins, 2);
  two.add({rows, {0.8, 1.3, 1.85}}, covered_bins, 2);
  two.add({std::vector<float>(80, 0.0F), {}}, covered_bins, 2);
  const DensityProfile full = one.profile(covered_bins), half = two.profile(covered_bins);
  for (std::size_t bin = 0; bin < covered_bins.count; ++bin)
    EXPECT_NEAR(half.number_density[bin], 0.5 * full.number_density[bin], 1e-9);
  EXPECT_LT(one.disagreement(full), 0.02);
  EXPECT_LT(two.disagreement(half), 0.01);
  EXPECT_EQ(two.profile({0, 0.125, 10}).number_density.size(), 10U);
  // A bed of half the width, and one counted over half the width, are twice as dense.
  BedCalibration narrow = bed;
  narrow.width = 2.5;
  Coverage denser(finder, narrow, 20, 50, covering_radius);
  denser.add({rows, {0.8, 1.3, 1.85}}, covered_bins, 1);
  EXPECT_NEAR(denser.profile(covered_bins).number_density[10], 2 * full.number_density[10], 1e-9);
  EXPECT_LT(denser.disagreement(denser.profile(covered_bins)), 0.04);
}

// Heights from -0.5 D on: a bead that sinks into the floor by a quarter is seen whole.
TEST(Coverage, BeginsAtItsLowestHeight) {
  const BedCalibration bed = bed_that_is_covered();
  const ShadedCover bead{0.9, 0};
  const FinderCalibration finder = bead.finder();
  const HeightBins below{-0.5, 0.125, 24};
  Coverage coverage(finder, bed, 20, 100, covering_radius);
  coverage.add({bead.rows(65), {0.25}}, below, 1);
  const DensityProfile profile = coverage.profile(below);
  double sum = 0;
  for (const double density : profile.number_density) sum += density * 0.125 * 5;
  EXPECT_NEAR(sum, 1, 2e-3);
  for (std::size_t k = 0; k < 6; ++k)  // bins 5 and 6 lie on either side of 0.25 D
    EXPECT_NEAR(profile.number_density[5 - k], profile.number_density[6 + k], 2e-3) << k;
  EXPECT_LT(coverage.disagreement(profile), 0.02);
}

}  // namespace
}  // namespace shakebed::ingest
