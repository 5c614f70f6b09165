#include "fit/profile_fit/critical_temperature.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/fit/synthetic.hpp"

namespace shakebed::fit {
namespace {

TEST(CriticalTemperature, IsWhereTheBottomDensityCrossesTheThreshold) {
  // The bottom density of true disks in local density, with noise.
  std::vector<TemperaturePoint> points;
  synthetic::Normal normal(4);
  const Column column = column_from_initial_height(20.0, close_packing_density);
  for (double t = 0.02; t < 0.8; t += 0.02) {
    const double bottom = HydrostaticProfile::of_column(best_of(), t, column).bottom_density();
    points.push_back({t, bottom + 1e-4 * normal(), 1e-4});
  }
  double last = 1e9;
  for (const ThresholdCrossing& crossing : threshold_temperatures(points)) {
    if (crossing.threshold > 1.151) continue;  // below the first point of the table
    ASSERT_EQ(crossing.status, ValueStatus::ok) << crossing.threshold;
    // The exact crossing: T = N/(phi Z(phi)).
    const double exact = column.column_number / best_of().pressure(crossing.threshold, 1.0).value;
    EXPECT_NEAR(crossing.temperature.value, exact, 4.0 * crossing.temperature.std_error + 2e-4);
    EXPECT_LT(crossing.temperature.value, last);
    EXPECT_GT(crossing.temperature.std_error, 0.0);
    last = crossing.temperature.value;
  }
}

TEST(CriticalTemperature, ToleratesNoiseThatIsNotMonotone) {
  const std::vector<TemperaturePoint> points{
      {0.3, 1.12, 0.01}, {0.1, 1.15, 0.01}, {0.2, 1.10, 0.01}, {0.4, 1.05, 0.01}};
  const ThresholdCrossing crossing = threshold_temperature(points, 1.08);
  ASSERT_EQ(crossing.status, ValueStatus::ok);
  // Pooled: (0.25, 1.11), then (0.4, 1.05): crossing half way.
  EXPECT_NEAR(crossing.temperature.value, 0.325, 1e-12);
}

// A quarter of the way from a point known to 0.003 to one known to 0.01, 0.2 m g D apart and 0.04 in value: the line's
// value there has the variance (3/4)^2 0.003^2 + (1/4)^2 0.01^2, and T that over the slope of 0.2.
TEST(CriticalTemperature, ItsErrorWeighsTheNeighboursByTheirDistance) {
  const std::vector<TemperaturePoint> points{{0.1, 1.14, 0.003}, {0.3, 1.10, 0.01}};
  const ThresholdCrossing crossing = threshold_temperature(points, 1.13);
  ASSERT_EQ(crossing.status, ValueStatus::ok);
  EXPECT_NEAR(crossing.temperature.value, 0.15, 1e-12);
  EXPECT_NEAR(crossing.temperature.std_error, std::sqrt(0.5625 * 9e-6 + 0.0625 * 1e-4) / 0.2, 1e-12);
}

// Two points in the wrong order, known to 0.01 and 0.02, become one with four fifths of the first's place and value.
TEST(CriticalTemperature, PoolsByTheWeightsOfThePoints) {
  const std::vector<TemperaturePoint> points{{0.1, 1.10, 0.01}, {0.2, 1.13, 0.02}, {0.4, 1.05, 0.01}};
  const ThresholdCrossing crossing = threshold_temperature(points, 1.08);
  ASSERT_EQ(crossing.status, ValueStatus::ok);
  // Between (0.12, 1.106), of variance 1/12,500, and (0.4, 1.05), of variance 1/10,000; slope 0.2.
  const double part = 0.026 / 0.056;
  EXPECT_NEAR(crossing.temperature.value, 0.12 + part * 0.28, 1e-12);
  EXPECT_NEAR(crossing.temperature.std_error, std::sqrt((1 - part) * (1 - part) / 12500 + part * part / 10000) / 0.2,
              1e-12);
}

// 4,000 draws of the two points: T scatters by what is stated, to four standard errors of a standard deviation (4.5 %).
TEST(CriticalTemperature, ItsErrorIsWhatItScattersBy) {
  synthetic::Normal normal(11);
  double sum = 0.0, squares = 0.0, stated = 0.0;
  constexpr int draws = 4000;
  for (int i = 0; i < draws; ++i) {
    const std::vector<TemperaturePoint> points{{0.1, 1.14 + 0.0004 * normal(), 0.0004},
                                               {0.3, 1.10 + 0.0015 * normal(), 0.0015}};
    const ThresholdCrossing crossing = threshold_temperature(points, 1.13);
    ASSERT_EQ(crossing.status, ValueStatus::ok);
    sum += crossing.temperature.value / draws;
    squares += crossing.temperature.value * crossing.temperature.value / draws;
    stated += crossing.temperature.std_error / draws;
  }
  EXPECT_NEAR(std::sqrt(squares - sum * sum) / stated, 1.0, 4.0 / std::sqrt(2.0 * draws));
}

// Points without an error count like the one that is known worst, or all alike, and the crossing then has no error.
TEST(CriticalTemperature, WithoutErrorsPoolsAllAlike) {
  const auto crossing = [](double first, double second) {
    const std::vector<TemperaturePoint> points{{0.1, 1.10, first}, {0.2, 1.13, second}, {0.4, 1.05, 0.0}};
    return threshold_temperature(points, 1.08);
  };
  for (const ThresholdCrossing& one : {crossing(0, 0), crossing(0.02, 0), crossing(0, 0.02)}) {
    ASSERT_EQ(one.status, ValueStatus::ok);
    // From (0.15, 1.115), the mean of two, to (0.4, 1.05).
    EXPECT_NEAR(one.temperature.value, 0.15 + 0.25 * 0.035 / 0.065, 1e-12);
    EXPECT_EQ(one.temperature.std_error, 0);
  }
  // A value at the threshold itself is above it.
  const std::vector<TemperaturePoint> at{{0.1, 1.15, 0.01}, {0.2, 1.10, 0.01}, {0.3, 1.05, 0.01}};
  EXPECT_NEAR(threshold_temperature(at, 1.10).temperature.value, 0.2, 1e-12);
  EXPECT_NEAR(threshold_temperature(at, 1.15).temperature.value, 0.1, 1e-12);
  EXPECT_EQ(threshold_temperature(at, 1.05).status, ValueStatus::outside_range);
  const std::vector<TemperaturePoint> negative{{0.1, 1.15, 0.01}, {0.2, 1.10, -0.01}};
  EXPECT_EQ(threshold_temperature(negative, 1.12).status, ValueStatus::invalid_argument);
}

// Where none are given thresholds lie a hundredth apart from 1.10 on, and one just below close packing, 1.1547.
TEST(CriticalTemperature, HasThresholdsUpToClosePacking) {
  const auto usual = threshold_temperatures({});
  ASSERT_EQ(usual.size(), 7U);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(usual[i].threshold, 1.10 + 0.01 * static_cast<double>(i), 1e-12);
  EXPECT_GT(usual.back().threshold, 0.999 * close_packing_density);
  EXPECT_LT(usual.back().threshold, close_packing_density);
  const std::vector<double> own{0.9, 0.7};
  const auto asked = threshold_temperatures(std::vector<TemperaturePoint>{{1, 1, 0.1}, {2, 0.6, 0.1}}, own);
  ASSERT_EQ(asked.size(), 2U);
  EXPECT_NEAR(asked[0].temperature.value, 1.25, 1e-12);
  EXPECT_NEAR(asked[1].temperature.value, 1.75, 1e-12);
}

TEST(CriticalTemperature, HasAStatusWhereNothingCrosses) {
  const std::vector<TemperaturePoint> points{{0.1, 1.15, 0.0}, {0.2, 1.10, 0.0}};
  EXPECT_EQ(threshold_temperature(points, 1.16).status, ValueStatus::outside_range);
  EXPECT_EQ(threshold_temperature(points, 1.0).status, ValueStatus::outside_range);
  EXPECT_EQ(threshold_temperature({}, 1.0).status, ValueStatus::outside_range);
  const std::vector<TemperaturePoint> broken{{0.1, std::nan(""), 0.0}};
  EXPECT_EQ(threshold_temperature(broken, 1.0).status, ValueStatus::invalid_argument);
}

}  // namespace
}  // namespace shakebed::fit
