#include "statistics/correlated_series.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <span>
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

// Four up, four down: squares add up to 8, neighbours to 5, and of eight values no farther ones are asked.
TEST(CorrelatedSeries, HasAMemoryDoneByHand) {
  const std::vector<double> series{1, 1, 1, 1, -1, -1, -1, -1, 1000};  // the last one is no part of it
  EXPECT_DOUBLE_EQ(memory_of(std::span(series).first(8)), 1 + 2 * 5.0 / 8);
}

// As many up as down: values d apart agree in count - 3 d more pairs than they differ in. Only distances below a
// quarter of the series are asked.
TEST(CorrelatedSeries, AsksNoFartherThanAQuarterOfTheSeries) {
  for (const std::size_t count : {4U, 6U, 8U, 12U, 14U, 16U, 20U, 28U}) {
    std::vector<double> series(count, 1.0);
    for (std::size_t i = count / 2; i < count; ++i) series[i] = -1;
    double sum = 0;
    for (std::size_t d = 1; d < count / 4; ++d) sum += static_cast<double>(count) - 3.0 * static_cast<double>(d);
    EXPECT_DOUBLE_EQ(memory_of(series), 1 + 2 * sum / static_cast<double>(count)) << count;
  }
}

// Two peaks six values apart: what lies beyond five memories, here five values, is not asked.
TEST(CorrelatedSeries, AsksNoFartherThanFiveMemories) {
  std::vector<double> series(40, 0.0);
  series[3] = series[9] = 1;
  EXPECT_EQ(memory_of(series), 1);
  series[9] = 0, series[8] = 1;  // five apart they are: one product, two squares
  EXPECT_EQ(memory_of(series), 1 + 2 * 0.5);
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

// Fifteen samples are taken for independent, one a window, and nothing is corrected. From sixteen on a window holds
// two, and 3/4 of the windows side by side count: (3 * 16/2 + 2)/4 of them, rounded down.
TEST(CorrelatedSeries, OfFewerThanSixteenSamplesHasAWindowForEach) {
  std::vector<double> series;
  for (int i = 0; i < 15; ++i) series.push_back(i % 3);
  const Windows few = windows_for(0, series);
  EXPECT_EQ(few.length, 1u);
  EXPECT_EQ(few.correction, 1);
  EXPECT_EQ(few.independent, 15u);
  series.push_back(0);
  const Windows enough = windows_for(0, series);
  EXPECT_EQ(enough.length, 2u);
  EXPECT_GE(enough.correction, 1);
  EXPECT_EQ(enough.independent, 6u);
}

// Half a window is 1.5 memories, rounded up: from a memory of 1.2 on.
TEST(CorrelatedSeries, OfAShortMemoryIsTakenForIndependent) {
  std::vector<double> series;
  for (int i = 0; i < 1000; ++i) series.push_back(i % 3);
  EXPECT_EQ(windows_for(1.19, series).length, 2u);
  EXPECT_EQ(windows_for(1.4, series).length, 6u);
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

TEST(CorrelatedSeries, KnowsTheErrorOfAMean) {
  // Of 400 series that remember 9, each for 100 memories: 4 standard errors, of 60 independent samples a series.
  std::mt19937_64 random(5);
  constexpr int runs = 400;
  double stated = 0;
  for (int run = 0; run < runs; ++run) {
    double mean = 0;
    std::vector<double> series = series_that_remembers(random, 0.8, 900, mean);
    for (double& x : series) x += 7;
    const Mean found = mean_of(series);
    EXPECT_NEAR(found.value, 7, 1e-12);
    stated += found.std_error * found.std_error / runs;
  }
  EXPECT_NEAR(stated / (9.0 / 900), 1, 0.05);
  EXPECT_EQ(mean_of(std::vector<double>{3}).value, 3);
  EXPECT_EQ(mean_of(std::vector<double>{3}).std_error, 0);
  EXPECT_EQ(mean_of({}).value, 0);
}

// Three quarters of the windows that lie side by side, to the nearest whole number.
TEST(CorrelatedSeries, CountsThreeQuartersOfTheWindowsSideBySide) {
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  std::vector<double> series;
  for (std::size_t count = 1; count <= 90; ++count) {
    series.push_back(normal(random));
    if (count < 16) continue;
    for (const double memory : {1.0, 2.0, 4.5}) {
      const Windows windows = windows_for(memory, series);
      EXPECT_EQ(windows.length, memory == 1 ? 2 : 2 * half_window(memory, count));
      EXPECT_EQ(windows.independent,
                std::floor(0.75 * static_cast<double>(count) / static_cast<double>(windows.length) + 0.5))
          << count << ' ' << windows.length;
    }
  }
}

// The error of a mean is in the unit of the values, and memory has none: in another unit, by a power of two, not a bit
// of either changes.
TEST(CorrelatedSeries, IsTheSameInAnyUnit) {
  std::mt19937_64 random(7);
  double mean = 0;
  std::vector<double> series = series_that_remembers(random, 0.8, 200, mean);
  const double memory = memory_of(series), error = mean_of(series).std_error;
  EXPECT_GT(memory, 1.5);
  for (const double unit : {0x1p-60, 0x1p-6, 0x1p60}) {
    std::vector<double> other = series;
    for (double& x : other) x *= unit;
    EXPECT_EQ(memory_of(other), memory) << unit;
    EXPECT_EQ(mean_of(other).std_error, unit * error) << unit;
  }
}

// Of few values the error is that of textbooks: s/sqrt(n), s^2 by n - 1.
TEST(CorrelatedSeries, OfFewValuesHasTheErrorOfIndependentOnes) {
  EXPECT_DOUBLE_EQ(mean_of(std::vector<double>{1, 3}).std_error, 1);
  EXPECT_DOUBLE_EQ(mean_of(std::vector<double>{1, 3, 8}).std_error, std::sqrt((9 + 1 + 16) / 2.0 / 3));
}

// Sums over all windows, one by one.
TEST(CorrelatedSeries, HasTheSumsOfAllItsWindows) {
  std::mt19937_64 random(8);
  std::vector<std::vector<double>> samples;
  for (int k = 0; k < 23; ++k)
    samples.push_back({static_cast<double>(random() % 17), static_cast<double>(random() % 5)});
  std::vector<double> mean(2);
  for (const auto& sample : samples)
    for (std::size_t i = 0; i < 2; ++i) mean[i] += sample[i] / 23;
  std::vector<double> first;
  for (const auto& sample : samples) first.push_back(sample[0] - mean[0]);
  for (const std::size_t window : {1u, 2u, 5u, 11u}) {
    double products[2][2] = {};
    for (std::size_t from = 0; from + window <= 23; ++from) {
      double sum[2] = {};
      for (std::size_t k = from; k < from + window; ++k)
        for (std::size_t i = 0; i < 2; ++i) sum[i] += samples[k][i] - mean[i];
      for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j) products[i][j] += sum[i] * sum[j];
    }
    const auto w = static_cast<double>(window);
    const double divisor = w * (23 - w) * (23 - w + 1);  // 23 - w + 1 windows; each sum scatters by w (1 - w/23)
    EXPECT_NEAR(variance_by_windows(first, window), products[0][0] / divisor, 1e-12);
    const auto covariance = covariance_by_windows(samples, 0, 2, {window, 1.5, 1});
    for (std::size_t i = 0; i < 2; ++i)
      for (std::size_t j = 0; j < 2; ++j)
        EXPECT_NEAR(covariance[2 * i + j], 1.5 * products[i][j] / divisor, 1e-12) << window;
  }
}

TEST(CorrelatedSeries, WhatRoundingLeftIsNoScatter) {
  std::vector<double> equal(64, 11.7);
  for (std::size_t k = 0; k < equal.size(); ++k) equal[k] *= 1 + 1e-15 * static_cast<double>(k % 5);
  EXPECT_EQ(from_mean(equal), std::vector<double>(64, 0.0));
  EXPECT_EQ(mean_of(equal).std_error, 0);
}

TEST(CorrelatedSeries, KnowsTheCovarianceOfMeans) {
  // Three quantities, the second 0.6 of the first and noise, the third independent: independent samples, whose
  // covariance windows tell as well as 3/8 of them would. Windows of any length agree with single samples but for that.
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal;
  std::vector<std::vector<double>> samples;
  for (int k = 0; k < 8'000; ++k) {
    const double a = normal(random), b = normal(random);
    samples.push_back({1 + a, 0.6 * a + 0.8 * b, 5 + 2 * normal(random)});
  }
  const auto one = covariance_by_windows(samples, 0, 3, {1, 1, 8'000});
  const auto ten = covariance_by_windows(samples, 0, 3, {10, 1, 600});
  const auto part = covariance_by_windows(samples, 1, 3, {10, 2, 600});
  const double expected[] = {1, 0.6, 0, 0.6, 1, 0, 0, 0, 4};
  const double scale[] = {1, 1, 2, 1, 1, 2, 2, 2, 4};
  for (std::size_t i = 0; i < 9; ++i) {
    // 4.5 standard errors of 8,000 and of 600 independent samples.
    EXPECT_NEAR(one[i] * 8'000, expected[i], 4.5 * scale[i] * std::sqrt(2.0 / 8'000)) << i;
    EXPECT_NEAR(ten[i] * 8'000, expected[i], 4.5 * scale[i] * std::sqrt(2.0 / 600)) << i;
  }
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < i; ++j) EXPECT_EQ(ten[3 * i + j], ten[3 * j + i]) << i << ' ' << j;
  EXPECT_DOUBLE_EQ(part[0], 2 * ten[4]);
  EXPECT_DOUBLE_EQ(part[1], 2 * ten[5]);
  EXPECT_DOUBLE_EQ(part[2], part[1]);
  EXPECT_EQ(covariance_by_windows(std::span(samples).first(1), 0, 3, {1, 1, 1}), std::vector<double>(9, 0.0));
}

}  // namespace
}  // namespace shakebed::statistics
