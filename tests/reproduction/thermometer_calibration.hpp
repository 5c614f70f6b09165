#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "fit/profile_fit/answer.hpp"
#include "fit/profile_fit/thermometers.hpp"

// The table of thermometers.cpp from beds whose temperature is known.
namespace shakebed::fit::simulated {

// What one thermometer read on one bed.
struct Known {
  std::size_t thermometer;
  double truth;      // [m g D]
  double off;        // ln(fitted/true)
  double std_error;  // stated, of ln T; what it scatters by, as Student's t does
  double model_error;
};

// `samples`: independent ones behind the stated errors. With nu = samples - 1 degrees of freedom T scatters by
// nu/(nu - 2) more than stated, in variance; the answer's interval allows for that.
inline void add_readings(const Answer& answer, double truth, int samples, std::vector<Known>& known) {
  const double freedom = std::max(3.0, samples - 1.0), student = std::sqrt(freedom / (freedom - 2));
  for (const ThermometerReading& reading : answer.readings) {
    if (reading.status != FitStatus::ok) continue;
    const auto all = thermometers();
    const auto at =
        std::find_if(all.begin(), all.end(), [&](const Thermometer& t) { return t.name == reading.thermometer; });
    known.push_back({static_cast<std::size_t>(at - all.begin()), truth, std::log(reading.fitted.value / truth),
                     student * reading.fitted.std_error / reading.fitted.value, reading.model_error});
  }
}

inline constexpr double calibration_temperatures[] = {0.03, 0.045, 0.065, 0.09, 0.13, 0.2, 0.3,
                                                      0.45, 0.7,   1.0,   1.5,  2.5,  4.5, 9.0};

// The mean of `off`, and the scatter s from bed to bed beyond the stated errors: chi2 with s in quadrature is what so
// many beds have left. The uncertainty of the mean is part of s. Of fewer readings than `fewest_beds` nothing follows
// for other beds. Where less than `nearly_all` of the beds have a reading, which ones is a part of the bias, and s is
// no less than the mean.
inline constexpr int fewest_beds = 5;
inline constexpr double scatter_of_unknown = 2, nearly_all = 2.0 / 3;
struct Calibration {
  int beds = 0;
  KnownBias bias;
  double mean_error = 0;
};
inline Calibration calibrate(const std::vector<Known>& beds, std::size_t all) {
  Calibration calibration;
  calibration.beds = static_cast<int>(beds.size());
  calibration.bias.scatter = scatter_of_unknown;
  if (calibration.beds < fewest_beds) return calibration;
  const auto n = static_cast<double>(beds.size());
  double mean = 0, variance = 0;
  for (const Known& k : beds) mean += k.off / n;
  for (const Known& k : beds) variance += (k.off - mean) * (k.off - mean) / (n - 1);
  double low = 0, high = std::sqrt(variance);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    double chi2 = 0;
    for (const Known& k : beds) chi2 += (k.off - mean) * (k.off - mean) / (k.std_error * k.std_error + middle * middle);
    (chi2 > n - 1 ? low : high) = middle;
  }
  calibration.mean_error = std::sqrt(variance / n);
  constexpr double least_scatter = 0.004;  // thermometers.cpp says why
  const double least = n < nearly_all * static_cast<double>(all) ? std::abs(mean) : least_scatter;
  calibration.bias = {mean, std::max(least, std::hypot(high, calibration.mean_error))};
  return calibration;
}

// The beds of one row: nearest in ln T to this temperature.
inline std::vector<Known> beds_near(const std::vector<Known>& known, std::size_t thermometer, std::size_t row) {
  const auto& nodes = calibration_temperatures;
  const double low = row == 0 ? 0 : std::sqrt(nodes[row - 1] * nodes[row]);
  const double high = row + 1 == std::size(nodes) ? 1e300 : std::sqrt(nodes[row] * nodes[row + 1]);
  std::vector<Known> beds;
  for (const Known& k : known) {
    if (k.thermometer == thermometer && k.truth >= low && k.truth < high) beds.push_back(k);
  }
  return beds;
}

}  // namespace shakebed::fit::simulated
