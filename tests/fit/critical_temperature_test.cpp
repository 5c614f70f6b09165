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
