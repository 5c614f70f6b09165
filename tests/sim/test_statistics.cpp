#include <gtest/gtest.h>

#include <cmath>

#include "sim/observables.hpp"
#include "sim/random.hpp"
#include "sim/statistics.hpp"

namespace shakebed::sim {
namespace {

// An AR(1) process x' = r x + noise has a known error of the mean: sigma sqrt((1+r)/(1-r)/n).
TEST(BlockedMean, KnowsTheErrorOfACorrelatedMean) {
  Random random(41);
  const double r = 0.95;
  const int n = 1 << 16, runs = 50;
  double ratio = 0;
  for (int run = 0; run < runs; ++run) {
    BlockedMean mean;
    double x = 0;
    for (int i = 0; i < n; ++i) {
      x = r * x + std::sqrt(1 - r * r) * random.normal_pair().first;
      mean.add(x);
    }
    ratio += mean.std_error() / std::sqrt((1 + r) / (1 - r) / n) / runs;
  }
  // One run's estimate scatters by up to 18 % (16 blocks) and the largest of several levels is taken: a little high.
  EXPECT_GT(ratio, 0.95);
  EXPECT_LT(ratio, 1.30);
}

TEST(BlockedMean, OfIndependentSamplesIsTheUsualOne) {
  Random random(42);
  BlockedMean mean(2);
  double sum = 0;
  const int n = 10'000;
  for (int i = 0; i < n; ++i) {
    const double sample[2] = {random.uniform(), 3};
    sum += sample[0];
    mean.add(sample);
  }
  EXPECT_NEAR(mean.mean(0), sum / n, 1e-12);
  EXPECT_EQ(mean.mean(1), 3);
  EXPECT_EQ(mean.std_error(1), 0);
  EXPECT_GT(mean.std_error(0), 0.95 * std::sqrt(1.0 / 12 / n));
  EXPECT_LT(mean.std_error(0), 2 * std::sqrt(1.0 / 12 / n));
}

// x and y = x + independent noise, both correlated in time: variances and covariance of the means are known.
TEST(BlockedCovariance, KnowsTheCovarianceOfCorrelatedMeans) {
  Random random(44);
  const double r = 0.9;
  const int n = 20'000, runs = 40;
  double xx = 0, xy = 0, yy = 0;
  for (int run = 0; run < runs; ++run) {
    BlockedCovariance covariance(3);
    double x = 0;
    for (int i = 0; i < n; ++i) {
      const Random::Pair draw = random.normal_pair();
      x = r * x + std::sqrt(1 - r * r) * draw.first;
      const double sample[3] = {7, x, x + 3 * draw.second};
      covariance.add(sample);
    }
    const std::vector<double> c = covariance.of_means(1, 3);
    xx += c[0] / runs;
    xy += c[1] / runs;
    yy += c[3] / runs;
  }
  const double of_x = (1 + r) / (1 - r) / n, of_noise = 9.0 / n;
  // 40 runs of about 128 blocks: each mean is good to 2 %; 4 standard errors.
  EXPECT_NEAR(xx, of_x, 0.08 * of_x);
  EXPECT_NEAR(xy, of_x, 0.12 * of_x);
  EXPECT_NEAR(yy, of_x + of_noise, 0.08 * (of_x + of_noise));
}

// Of a series as short as 15 of its memories, too: blocks that only make 128 of it would miss four fifths of it.
TEST(BlockedCovariance, KnowsThatOfAShortSeriesWithALongMemory) {
  Random random(45);
  const double r = 9.0 / 11.0;  // a memory of 10 samples
  const int n = 150, runs = 400;
  double xx = 0, blocks = 0;
  for (int run = 0; run < runs; ++run) {
    BlockedCovariance covariance(2);
    double x = random.normal_pair().first;
    for (int i = 0; i < n; ++i) {
      const Random::Pair draw = random.normal_pair();
      x = r * x + std::sqrt(1 - r * r) * draw.first;
      const double sample[2] = {draw.second, x};
      covariance.add(sample);
    }
    xx += covariance.of_means(1, 2)[0] / runs;
    blocks += static_cast<double>(covariance.independent_blocks()) / runs;
  }
  const double truth = (1 + r) / (1 - r) / n;
  std::printf("  variance of the mean %.4f of the true one, from %.1f blocks\n", xx / truth, blocks);
  EXPECT_GT(xx, 0.7 * truth);
  EXPECT_LT(xx, 1.1 * truth);
  EXPECT_LT(blocks, 30);
}

// Whatever the kernel, the area under the density is the number of disks over the width.
TEST(Density, HasTheDisksUnderIt) {
  const ProfileGrid grid{-2, 0.05, 400};
  Random random(43);
  std::vector<double> heights;
  for (int i = 0; i < 300; ++i) heights.push_back(3 + 10 * random.uniform());
  for (const Kernel& kernel : {Kernel{KernelKind::gaussian, 0.3}, Kernel{KernelKind::top_hat, 0.7}}) {
    std::vector<double> density(grid.points);
    add_density(grid, kernel, 30, heights, 0, density);
    double area = 0;
    for (double value : density) area += value * grid.spacing;
    EXPECT_NEAR(area, 10, kernel.kind == KernelKind::gaussian ? 1e-7 : 0.05);
  }
}

// 306 disks in a hard box of 30 D: 4.561 D, as in the independent simulation of this bed.
TEST(IdealPacking, HasTheCentreOfMassOfAlternateRows) {
  EXPECT_NEAR(ideal_centre_of_mass(306, 30, true), 4.561, 5e-4);
  EXPECT_NEAR(ideal_centre_of_mass(30, 30, true), 0.5, 1e-12);
  EXPECT_NEAR(ideal_centre_of_mass(60, 30, false), 0.5 + std::sqrt(3.0) / 4, 1e-12);
}

}  // namespace
}  // namespace shakebed::sim
