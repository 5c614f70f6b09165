#pragma once

#include <string>

#include "fit/profile_fit/least_squares.hpp"
#include "fit/profile_fit/measured_profile.hpp"

// Which heights are fitted, and with which weights. Internal to fit.
namespace shakebed::fit {

struct Window {
  double low = 0.0, high = 0.0;  // heights in [low, high] are used [D]
  std::string rule;              // in words
};

// The rule of WindowOptions. Sets measured.greatest_mean, and makes empty bins usable where a profile ends in a cliff:
// the first of them say where.
Window choose_window(MeasuredProfile& measured, const FitOptions& options);

std::size_t count_bins(const MeasuredProfile& measured, const Window& window);

// The bins of the window with their weights; warnings about the covariance go to `result` unless it is nullptr.
Bins bins_of(const MeasuredProfile& measured, const Window& window, FitResult* result);

// The same bins and weights where every error holds one of the model: errors come through the measured part alone.
Bins with_measured_errors(Bins bins, double model_error);

}  // namespace shakebed::fit
