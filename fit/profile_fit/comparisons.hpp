#pragma once

#include <vector>

#include "fit/profile_fit/window_fit.hpp"

// The same profile fitted on other windows and by other models. Internal to fit.
namespace shakebed::fit {

// T against window: lower ends from the window's own up to where a quarter of the greatest density is left, upper ends
// down to a fifth of it. The first row is the window itself.
std::vector<WindowFit> sweep_windows(const MeasuredProfile& measured, const Window& window, FitSetup& setup,
                                     const FitModel::Parameters& start);

// The fit as a row of the comparison.
ModelFit model_row(const FitOptions& options, FitSetup& setup, const FittedWindow& fitted);

// The other models on the same window: the paper's curve with phi_0 held and free, whole columns, Fermi, a rectangle.
std::vector<ModelFit> compare_models(const MeasuredProfile& measured, const Window& window, const Bins& bins,
                                     const FitOptions& options);

}  // namespace shakebed::fit
