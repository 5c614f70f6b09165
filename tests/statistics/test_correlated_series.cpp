#include "statistics/correlated_series.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace shakebed::statistics {
namespace {

// x' = r x + noise, of variance 1: its memory is (1 + r)/(1 - r), and the variance of the mean of n values nearly that
// over n. From its mean; that mean in `mean`.
std::vector<double> series_that_remembers(std::mt19937_64& random, double r, std::size_t count, double& mean) {
  std::normal_distribution<double> normal;
  std::vector<double> series(count);
  double x = normal(random);
  mean = 0;
  for (double& value : series) {
    x = r * x + std::sqrt(1 - r * r) * normal(random);
    value = x;
    mean += x / static_cast<double>(count);
  }
  for (double& value : series) value -= mean;
  return series;
}

TEST(CorrelatedSeries, KnowsHowLongASeriesRemembers) {
  std::mt19937_64 random(1);
  for (const double r : {0.0, 0.5, 0.9}) {
    double mean = 0;
    const double memory = memory_of(series_that_remembers(random, r, 200'000, mean));
    const double truth = (1 + r) / (1 - r);
    // One estimate scatters by sqrt(2 (2 x 5 memory + 1)/n), 3 % for the longest: 4 standard deviations.
    EXPECT_NEAR(memory / truth, 1, 4 * std::sqrt(2 * (10 * truth + 1) / 200'000)) << r;
  }
}

TEST(CorrelatedSeries, HasNothingToTellOfFewValuesOrOfEqualOnes) {
  EXPECT_EQ(memory_of({}), 1);
  const std::vector<double> few = {1, -2, 1}, none(100, 0.0);
  EXPECT_EQ(memory_of(few), 1);
  EXPECT_EQ(memory_of(none), 1);
  EXPECT_EQ(corrected_variance(none, 4).variance, 0);
  EXPECT_EQ(corrected_variance(none, 4).correction, 1);
}

TEST(CorrelatedSeries, ChoosesWindowsOfThreeMemoriesOfWhichSixFitIn) {
  EXPECT_EQ(half_window(4, 1'000), 6u);
  EXPECT_EQ(half_window(4.1, 1'000), 7u);
  EXPECT_EQ(half_window(4, 60), 5u);
  EXPECT_EQ(half_window(1e300, 24), 2u);
}

TEST(CorrelatedSeries, KnowsTheVarianceOfAMeanOfIndependentValuesExactly) {
  // Mean over 20,000 series of 30 values of the estimate, in units of the truth, whose scatter is that of the mean of
  // as many: 4 standard deviations, by the series themselves.
  std::mt19937_64 random(2);
  for (const std::size_t window : {1u, 2u, 5u}) {
    double sum = 0, squares = 0;
    constexpr int runs = 20'000;
    for (int run = 0; run < runs; ++run) {
      double mean = 0;
      const double estimate = 30 * variance_by_windows(series_that_remembers(random, 0, 30, mean), window);
      sum += estimate / runs;
      squares += estimate * estimate / runs;
    }
    EXPECT_NEAR(sum, 1, 4 * std::sqrt((squares - sum * sum) / runs)) << window;
  }
}

// What the rooms ask it for: the variance of the mean of a series with a memory of 19 values, of which there are 1,000.
// One estimate scatters by a half, the mean of 4,000 by 0.8 %: the bounds are 5 standard deviations away and more.
TEST(CorrelatedSeries, ErrsByATenthOnTheSafeSideForTheMeanOfValuesThatRemember) {
  std::mt19937_64 random(3);
  constexpr int runs = 4'000;
  constexpr std::size_t count = 1'000;
  constexpr double r = 0.9, n = count;
  const double truth = (1 + r) / (1 - r) / n - 2 * r * (1 - std::pow(r, n)) / (n * n * (1 - r) * (1 - r));
  double told = 0, windows_alone = 0;
  for (int run = 0; run < runs; ++run) {
    double mean = 0;
    const std::vector<double> series = series_that_remembers(random, r, count, mean);
    const WindowVariance found = corrected_variance(series, half_window(memory_of(series), count));
    told += found.variance * found.correction / runs;
    windows_alone += found.variance / runs;
  }
  EXPECT_GT(told / truth, 1.0);
  EXPECT_LT(told / truth, 1.15);
  EXPECT_LT(windows_alone / truth, 0.95);
}

}  // namespace
}  // namespace shakebed::statistics
