#include "statistics/correlated_series.hpp"

#include <algorithm>
#include <cmath>

namespace shakebed::statistics {

std::vector<double> from_mean(std::vector<double> series) {
  double mean = 0;
  for (const double x : series) mean += x / static_cast<double>(series.size());
  for (double& x : series) x -= mean;
  return series;
}

double memory_of(std::span<const double> series) {
  double variance = 0;
  for (const double x : series) variance += x * x;
  double memory = 1;
  for (std::size_t lag = 1; lag < series.size() / 4 && variance > 0; ++lag) {
    double correlation = 0;
    for (std::size_t k = 0; k + lag < series.size(); ++k) correlation += series[k] * series[k + lag];
    memory += 2 * correlation / variance;
    if (static_cast<double>(lag) >= 5 * memory) break;
  }
  return memory;
}

std::size_t half_window(double memory, std::size_t count) {
  constexpr std::size_t least_windows = 6;
  const double asked = std::min(1.5 * memory, static_cast<double>(count));
  return std::min(static_cast<std::size_t>(std::ceil(asked)), count / (2 * least_windows));
}

double window_divisor(std::size_t count, std::size_t window) {
  const auto n = static_cast<double>(count), w = static_cast<double>(window);
  return w * (n - w) * (n - w + 1);
}

double variance_by_windows(std::span<const double> series, std::size_t window) {
  double sum = 0, squares = 0;
  for (std::size_t k = 0; k < series.size(); ++k) {
    sum += series[k];
    if (k + 1 < window) continue;
    squares += sum * sum;
    sum -= series[k + 1 - window];
  }
  return squares / window_divisor(series.size(), window);
}

WindowVariance corrected_variance(std::span<const double> series, std::size_t half) {
  const double whole = variance_by_windows(series, 2 * half), halves = variance_by_windows(series, half);
  return {whole, std::max(1.0, 2 - halves / whole)};
}

}  // namespace shakebed::statistics
