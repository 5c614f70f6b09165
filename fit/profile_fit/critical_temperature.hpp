#pragma once

#include <span>
#include <vector>

#include "fit/profile_fit/fit_profile.hpp"

// T_c and T_c' as a simulation measures them: the temperature at which a quantity of the bed crosses a threshold. The
// bottom row's density falls with T and never quite reaches close packing. So T_c depends on the threshold and is
// reported with it. The loose crystal's T_c' is the same with the bond order psi_6.
namespace shakebed::fit {

struct TemperaturePoint {
  double temperature = 0.0;  // [m g D]
  double value = 0.0;        // the bottom density, or psi_6
  double std_error = 0.0;
};

struct ThresholdCrossing {
  double threshold = 0.0;
  ValueStatus status = ValueStatus::outside_range;  // outside_range: the points lie all on one side
  Estimate temperature;
};

// The highest temperature at which the value is still above the threshold. Points may be noisy and in any order. They
// are first made monotone (falling) by pooling neighbours with their weights. Between them the crossing is linear. Its
// error is that of the two neighbours over the slope.
ThresholdCrossing threshold_temperature(std::span<const TemperaturePoint> points, double threshold);

// The same for several thresholds; by default 1.10 to 1.154 of the bottom density.
std::vector<ThresholdCrossing> threshold_temperatures(std::span<const TemperaturePoint> points,
                                                      std::span<const double> thresholds = {});

}  // namespace shakebed::fit
