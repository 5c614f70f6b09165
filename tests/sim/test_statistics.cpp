#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/engine/random.hpp"
#include "sim/measure/observables.hpp"
#include "sim/measure/statistics.hpp"

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
  // 40 runs as good as about 110 samples: each mean is good to 2 %; 4 standard errors.
  EXPECT_NEAR(xx, of_x, 0.08 * of_x);
  EXPECT_NEAR(xy, of_x, 0.12 * of_x);
  EXPECT_NEAR(yy, of_x + of_noise, 0.08 * (of_x + of_noise));
}

// Of a series as short as 15 of its memories, too, and of longer ones: windows as long as a few memories miss a tenth
// to a third of the variance and what their halves miss says so. And as much as the stated number of independent
// samples lets expect, these variances scatter: with Student's factor for so many, 95 % intervals hold the truth.
TEST(BlockedCovariance, KnowsThatOfAShortSeriesWithALongMemory) {
  Random random(45);
  const double r = 9.0 / 11.0;  // a memory of 10 samples
  // Student's factors of 95 %, from 3 degrees of freedom up.
  const double student[] = {3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160};
  for (const int n : {150, 600, 4800}) {
    const int runs = n > 1000 ? 400 : 1600;
    const double truth = (1 + r) / (1 - r) / n;
    double xx = 0, blocks = 0, held = 0;
    for (int run = 0; run < runs; ++run) {
      BlockedCovariance covariance(2);
      double x = random.normal_pair().first, sum = 0;
      for (int i = 0; i < n; ++i) {
        const Random::Pair draw = random.normal_pair();
        x = r * x + std::sqrt(1 - r * r) * draw.first;
        sum += x;
        const double sample[2] = {draw.second, x};
        covariance.add(sample);
      }
      const double variance = covariance.of_means(1, 2)[0];
      const std::size_t independent = covariance.windows().independent;
      xx += variance / runs;
      blocks += static_cast<double>(independent) / runs;
      held += std::abs(sum / n) < (independent < 15 ? student[independent - 4] : 2.0) * std::sqrt(variance);
    }
    std::printf("  %4d samples: variance of the mean %.3f of the true one, as by %.1f independent ones; %.1f %% held\n",
                n, xx / truth, blocks, 100 * held / runs);
    // One run's variance is good to sqrt(2/blocks), 1,600 runs' mean to 2 %.
    EXPECT_NEAR(xx / truth, 1, 0.12) << n;
    EXPECT_GT(held / runs, 0.93) << n;  // 4 standard errors below 95 %, of 1,600
    EXPECT_LT(held / runs, 0.985) << n;
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
