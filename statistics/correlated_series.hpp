// How well the mean of a series is known whose values remember those before them. All functions but the first take the
// series from its mean: its values add up to 0.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace shakebed::statistics {

std::vector<double> from_mean(std::vector<double> series);

// 1 + 2 sum of the correlations, summed to five times itself [Sokal1997]: how many values tell as much as one
// independent one. 1 where there is too little to tell.
double memory_of(std::span<const double> series);

// Values that remember no longer than this are taken for independent.
inline constexpr double least_memory = 1.2;

// Half of the window that variance_by_windows() asks for: windows are three memories long, but six of them fit in.
std::size_t half_window(double memory, std::size_t count);

// The variance of the mean, from sums over all windows of `window` values that follow one another, overlapping
// [MeketonSchmeiser1984]. Exact where the values are independent.
double variance_by_windows(std::span<const double> series, std::size_t window);
// By what the sum of the squares of those sums, of a series of `count` values, is divided to give it.
double window_divisor(std::size_t count, std::size_t window);

// The variance by windows of 2 `half`, and by what it must be multiplied: such windows still share some memory with
// their neighbours, and their halves miss twice as much as they [VatsFlegal2022].
struct WindowVariance {
  double variance, correction;
};
WindowVariance corrected_variance(std::span<const double> series, std::size_t half);

}  // namespace shakebed::statistics
