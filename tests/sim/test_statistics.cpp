#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/engine/random.hpp"
#include "sim/measure/observables.hpp"
#include "sim/measure/statistics.hpp"

namespace shakebed::sim {
namespace {

// An AR(1) process x' = r x + noise, r = exp(-1/time), has a known variance of the mean of n samples: (1 + r)/(1 -
// r)/n, less 2 r (1 - r^n)/(1 - r)^2/n^2. The stated errors must be those, and 68 % intervals hold, already where the
// series is 30 of its memories long (2 times its correlation time), and where blocks have been joined.
TEST(CorrelatedMeans, KnowTheirErrorsInShortAndLongSeries) {
  struct Case {
    int samples, runs;
    double time;
  };
  // A run's variance scatters by up to 0.6 of itself, the mean of 3,000 runs by 0.011.
  for (const Case& one : {Case{64, 3000, 0}, Case{64, 3000, 1}, Case{106, 3000, 3}, Case{264, 3000, 3},
                          Case{1000, 1000, 10}, Case{5000, 400, 3}}) {
    Random random(41);
    const double r = one.time > 0 ? std::exp(-1 / one.time) : 0, n = one.samples;
    const double truth = ((1 + r) / (1 - r) - 2 * r * (1 - std::pow(r, n)) / ((1 - r) * (1 - r)) / n) / n;
    double ratio = 0, held = 0;
    for (int run = 0; run < one.runs; ++run) {
      CorrelatedMeans means;
      double x = random.normal_pair().first;
      for (int i = 0; i < one.samples; ++i) {
        means.add(x);
        x = r * x + std::sqrt(1 - r * r) * random.normal_pair().first;
      }
      const double error = means.std_error();
      ratio += error * error / truth / one.runs;
      held += (std::abs(means.mean()) < error) / static_cast<double>(one.runs);
    }
    std::printf("  %4d samples, correlation time %2.0f: variance %.3f of the true one; %.1f %% held\n", one.samples,
                one.time, ratio, 100 * held);
    EXPECT_GT(ratio, 0.9) << one.samples << " " << one.time;
    EXPECT_LT(ratio, 1.2) << one.samples << " " << one.time;
    EXPECT_NEAR(held, 0.683, 0.06) << one.samples << " " << one.time;
  }
}

TEST(CorrelatedMeans, OfIndependentSamplesHaveTheUsualErrors) {
  Random random(42);
  CorrelatedMeans means(2);
  EXPECT_TRUE(std::isnan(means.mean()));
  double sum = 0;
  const int n = 10'003;  // the last three are in no whole block
  for (int i = 0; i < n; ++i) {
    const double sample[2] = {random.uniform(), 3};
    sum += sample[0];
    means.add(sample);
    if (i == 0) {
      EXPECT_TRUE(std::isnan(means.std_error()));
    }
  }
  EXPECT_EQ(means.samples(), 10'003u);
  EXPECT_NEAR(means.mean(0), sum / n, 1e-12);
  EXPECT_EQ(means.mean(1), 3);
  EXPECT_EQ(means.std_error(1), 0);
  // The variance by windows of two of 312 blocks is good to 9 %, the error to 5 %.
  EXPECT_NEAR(means.std_error(0), std::sqrt(1.0 / 12 / n), 0.2 * std::sqrt(1.0 / 12 / n));
}

// Three values by hand: 1, 2, 6 have the mean 3 and the variance 7, so the mean has the error sqrt(7/3).
TEST(CorrelatedMeans, OfThreeSamplesAreThoseByHand) {
  CorrelatedMeans means;
  for (const double x : {1.0, 2.0, 6.0}) means.add(x);
  EXPECT_DOUBLE_EQ(means.mean(), 3);
  EXPECT_DOUBLE_EQ(means.std_error(), std::sqrt(7.0 / 3));
}

// What repeats every period has no error if blocks are whole periods.
TEST(CorrelatedMeans, LeaveOutWhatRepeats) {
  Random random(46);
  CorrelatedMeans bare, of_periods(1, 8);
  const int periods = 400;
  for (int k = 0; k < 8 * periods; ++k) {
    const double noise = random.normal_pair().first;
    bare.add(noise);
    of_periods.add(noise + 100 * std::sin(k * std::numbers::pi / 4));
  }
  EXPECT_EQ(of_periods.blocks(), 400u);
  EXPECT_NEAR(of_periods.mean(), bare.mean(), 1e-10);
  const double usual = 1 / std::sqrt(8.0 * periods);
  EXPECT_NEAR(of_periods.std_error(), usual, 0.2 * usual);  // windows of two of 400 are good to 8 % of the variance
}

// x and y = x + independent noise, both correlated in time: variances and covariance of the means are known.
TEST(CorrelatedMeans, KnowTheirCovariance) {
  Random random(44);
  const double r = 0.9;
  const int n = 20'000, runs = 40;
  double xx = 0, xy = 0, yy = 0;
  for (int run = 0; run < runs; ++run) {
    CorrelatedMeans means(3);
    double x = 0;
    for (int i = 0; i < n; ++i) {
      const Random::Pair draw = random.normal_pair();
      x = r * x + std::sqrt(1 - r * r) * draw.first;
      const double sample[3] = {7, x, x + 3 * draw.second};
      means.add(sample);
    }
    const std::vector<double> c = means.covariance(1, 3, means.windows(0, 3));
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
TEST(CorrelatedMeans, KnowTheirCovarianceInAShortSeriesWithALongMemory) {
  Random random(45);
  const double r = 9.0 / 11.0;  // a memory of 10 samples
  // Student's factors of 95 %, from 3 degrees of freedom up.
  const double student[] = {3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160};
  for (const int n : {150, 600, 4800}) {
    const int runs = n > 1000 ? 400 : 1600;
    const double truth = (1 + r) / (1 - r) / n;
    double xx = 0, blocks = 0, held = 0;
    for (int run = 0; run < runs; ++run) {
      CorrelatedMeans means(2);
      double x = random.normal_pair().first, sum = 0;
      for (int i = 0; i < n; ++i) {
        const Random::Pair draw = random.normal_pair();
        x = r * x + std::sqrt(1 - r * r) * draw.first;
        sum += x;
        const double sample[2] = {draw.second, x};
        means.add(sample);
      }
      const double variance = means.covariance(1, 2, means.windows(0, 2))[0];
      const std::size_t independent = means.windows(0, 2).independent;
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
