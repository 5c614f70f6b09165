#include "fit/profile_fit/critical_temperature.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace shakebed::fit {

namespace {

struct Pool {
  double temperature = 0.0, value = 0.0, weight = 0.0;  // weight = 1/variance
};

// Pool adjacent violators: the falling sequence nearest to the points in weighted least squares.
std::vector<Pool> falling(std::vector<TemperaturePoint> points) {
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.temperature < b.temperature; });
  double typical = 0.0;
  for (const TemperaturePoint& p : points) typical = std::max(typical, p.std_error);
  if (!(typical > 0.0)) typical = 1.0;
  std::vector<Pool> pools;
  for (const TemperaturePoint& p : points) {
    const double error = p.std_error > 0.0 ? p.std_error : typical;
    pools.push_back({p.temperature, p.value, 1.0 / (error * error)});
    while (pools.size() > 1 && pools[pools.size() - 2].value < pools.back().value) {
      const Pool b = pools.back();
      pools.pop_back();
      Pool& a = pools.back();
      const double weight = a.weight + b.weight;
      a.temperature = (a.weight * a.temperature + b.weight * b.temperature) / weight;
      a.value = (a.weight * a.value + b.weight * b.value) / weight;
      a.weight = weight;
    }
  }
  return pools;
}

}  // namespace

ThresholdCrossing threshold_temperature(std::span<const TemperaturePoint> points, double threshold) {
  ThresholdCrossing crossing;
  crossing.threshold = threshold;
  bool errors_known = true;
  for (const TemperaturePoint& p : points) {
    if (!std::isfinite(p.temperature) || !std::isfinite(p.value) || !std::isfinite(p.std_error) || p.std_error < 0.0) {
      crossing.status = ValueStatus::invalid_argument;
      return crossing;
    }
    errors_known = errors_known && p.std_error > 0.0;
  }
  const std::vector<Pool> pools = falling({points.begin(), points.end()});
  for (std::size_t i = 1; i < pools.size(); ++i) {
    const Pool& a = pools[i - 1];
    const Pool& b = pools[i];
    if (!(a.value >= threshold && b.value < threshold)) continue;
    const double part = (a.value - threshold) / (a.value - b.value);
    const double slope = (b.value - a.value) / (b.temperature - a.temperature);
    crossing.temperature.value = a.temperature + part * (b.temperature - a.temperature);
    if (errors_known) {
      const double variance = (1.0 - part) * (1.0 - part) / a.weight + part * part / b.weight;
      crossing.temperature.std_error = std::sqrt(variance) / std::abs(slope);
    }
    crossing.status = ValueStatus::ok;
    return crossing;
  }
  return crossing;
}

std::vector<ThresholdCrossing> threshold_temperatures(std::span<const TemperaturePoint> points,
                                                      std::span<const double> thresholds) {
  static constexpr std::array<double, 7> usual{1.10, 1.11, 1.12, 1.13, 1.14, 1.15, 1.154};
  if (thresholds.empty()) thresholds = usual;
  std::vector<ThresholdCrossing> crossings;
  for (const double threshold : thresholds) crossings.push_back(threshold_temperature(points, threshold));
  return crossings;
}

}  // namespace shakebed::fit
