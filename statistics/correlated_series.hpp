// The error of the mean of a correlated series, or of many series sampled together. Functions that take a series expect
// it with its mean subtracted, so that the values add up to 0. Exceptions: from_mean() and mean_of() take it as it is.
//
// Any number of threads may call; values own what they hold.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace shakebed::statistics {

// Zeros where the values are equal to 1e-12.
std::vector<double> from_mean(std::vector<double> series);

// 1 + 2 sum of the correlations, summed to five times itself [Sokal1997]: how many values tell as much as one
// independent one. 1 where there is too little to tell.
double memory_of(std::span<const double> series);

// Values whose correlation time is no longer than this are treated as independent.
inline constexpr double least_memory = 1.2;

// Half of the window that variance_by_windows() asks for: windows are three memories long, but six of them fit in.
std::size_t half_window(double memory, std::size_t count);

// The variance of the mean, from sums over all windows of `window` values that follow one another, overlapping
// [MeketonSchmeiser1984]. Exact where the values are independent.
double variance_by_windows(std::span<const double> series, std::size_t window);
// By what the sum of the squares of those sums, of a series of `count` values, is divided to give it.
double window_divisor(std::size_t count, std::size_t window);

// The variance by windows of 2 `half`, and the factor that corrects it. Such windows are still correlated with their
// neighbours. Windows of `half` underestimate the variance by twice as much as they do [VatsFlegal2022].
struct WindowVariance {
  double variance, correction;
};
WindowVariance corrected_variance(std::span<const double> series, std::size_t half);

// The windows by which samples of many quantities are judged.
struct Windows {
  std::size_t length = 1;       // in samples: even, or 1 with fewer than 16 samples
  double correction = 1;        // by which what they say of (co)variances must be multiplied
  std::size_t independent = 0;  // independent samples that would tell a variance as well
};
// Windows for samples whose slowest series is `slowest`. `memory`: its correlation time, approximately, in samples.
Windows windows_for(double memory, std::span<const double> slowest);

// The mean of a series as it is, and its error by windows: 0 with fewer than 2 values.
struct Mean {
  double value = 0, std_error = 0;
};
Mean mean_of(std::span<const double> series);

// The covariance of the means of the quantities first to last-1 of samples that follow one another, row by row: by
// overlapping windows [MeketonSchmeiser1984], corrected. Zeros with fewer than 2 samples.
std::vector<double> covariance_by_windows(std::span<const std::vector<double>> samples, std::size_t first,
                                          std::size_t last, const Windows& windows);

}  // namespace shakebed::statistics
