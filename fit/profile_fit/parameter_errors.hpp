#pragma once

#include <functional>

#include "fit/profile_fit/window_fit.hpp"

// Standard errors and intervals of what a fit found. Internal to fit.
namespace shakebed::fit {

// Of a free parameter, 0 for a fixed one.
double parameter_error(const FitSetup& setup, const FittedWindow& fitted, std::size_t parameter);

// Of a quantity computed from the curve, by differences along each free parameter. Leaves the model at the solution.
using Quantity = std::function<double(const FitModel::Parameters&)>;
double propagated_error(FitSetup& setup, const FittedWindow& fitted, const Quantity& quantity);

// The temperatures whose best chi2 exceeds the least by no more than the quantile of the confidence asks.
Interval likelihood_interval(const FittedWindow& fitted, FitSetup& setup, double confidence);

// Of T by a statistical error of it alone, in ln T; Student's where few samples are behind the errors.
Interval statistical_interval(const FittedWindow& fitted, double std_error, double confidence);

}  // namespace shakebed::fit
