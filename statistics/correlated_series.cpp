#include "statistics/correlated_series.hpp"

#include <algorithm>
#include <cmath>

namespace shakebed::statistics {

namespace {
// Values that are equal to this, relative, differ by what rounding left of them.
constexpr double rounding = 1e-12;
}  // namespace

std::vector<double> from_mean(std::vector<double> series) {
  double mean = 0;
  for (const double x : series) mean += x / static_cast<double>(series.size());
  double largest = 0;
  for (double& x : series) largest = std::max(largest, std::abs(x -= mean));
  if (largest <= rounding * std::abs(mean)) std::fill(series.begin(), series.end(), 0.0);
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

Windows windows_for(double memory, std::span<const double> slowest) {
  const std::size_t count = slowest.size();
  if (count < 16) return {1, 1, count};
  Windows windows;
  windows.length = memory < least_memory ? 2 : 2 * half_window(memory, count);
  windows.correction = corrected_variance(slowest, windows.length / 2).correction;
  // 3/4 of the windows side by side: the window function behind them, flat to the half of their length and then
  // falling, has 4/3 of it under its square [PolitisRomano1995].
  windows.independent = (3 * count + 2 * windows.length) / (4 * windows.length);
  return windows;
}

Mean mean_of(std::span<const double> series) {
  Mean mean;
  for (const double x : series) mean.value += x / static_cast<double>(series.size());
  if (series.size() < 2) return mean;
  const std::vector<double> centred = from_mean({series.begin(), series.end()});
  const Windows windows = windows_for(memory_of(centred), centred);
  mean.std_error = std::sqrt(variance_by_windows(centred, windows.length) * windows.correction);
  return mean;
}

std::vector<double> covariance_by_windows(std::span<const std::vector<double>> samples, std::size_t first,
                                          std::size_t last, const Windows& windows) {
  const std::size_t count = samples.size(), n = last - first;
  std::vector<double> covariance(n * n, 0.0), mean(n, 0.0), sum(n, 0.0);
  if (count < 2) return covariance;
  for (const std::vector<double>& sample : samples) {
    for (std::size_t i = 0; i < n; ++i) mean[i] += sample[first + i] / static_cast<double>(count);
  }
  const double weight = 1 / window_divisor(count, windows.length) * windows.correction;
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t i = 0; i < n; ++i) sum[i] += samples[k][first + i] - mean[i];
    if (k + 1 < windows.length) continue;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i; j < n; ++j) covariance[i * n + j] += weight * sum[i] * sum[j];
    }
    for (std::size_t i = 0; i < n; ++i) sum[i] -= samples[k + 1 - windows.length][first + i] - mean[i];
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < i; ++j) covariance[i * n + j] = covariance[j * n + i];
  }
  return covariance;
}

}  // namespace shakebed::statistics
