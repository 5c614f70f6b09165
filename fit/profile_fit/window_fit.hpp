#pragma once

#include <vector>

#include "fit/profile_fit/fit_setup.hpp"
#include "fit/profile_fit/window.hpp"

// One model fitted to one window, and what the fit says of the data and of its own errors. Internal to fit.
namespace shakebed::fit {

// chi2 takes the bins' errors as known; without them they are the scatter itself.
struct Goodness {
  double chi2_per_dof = 0.0, p_value = 1.0, aic = 0.0, bic = 0.0, error_scale = 1.0;
  int dof = 0;
  bool misfit = false;  // the model does not describe the data
  bool scaled = false;
};

struct FittedWindow {
  Solution solution;
  Bins bins;                 // with the errors it was found with
  Goodness good;             // by the measured errors
  double error_scale = 1.0;  // of the solution's covariance
  double model_error = 0.0;
  // Of the standard error of T: what the measured errors alone make of it, 0 to 1. The rest is the model's misfit.
  double measured_share = 1.0;
};

// Initial parameters without a guess. Temperatures lie on a logarithmic grid. For each, the curve is placed to pass
// through the profile at half its greatest density. The best few by chi2 on a thinned profile without the kernel are
// returned.
std::vector<FitModel::Parameters> find_starts(const Bins& bins, const FitSetup& setup);

// Fits the window; where the model misses the data, finds the error of the model that makes up for it. The model is
// left at the solution.
FittedWindow fit_window(const MeasuredProfile& measured, const Window& window, FitSetup& setup, Bins bins,
                        const std::vector<FitModel::Parameters>& starts);

// Whether T came out as more than an upper bound: its error is below half of it, and it lies above the least T that the
// bins resolve.
bool temperature_is_resolved(const Solution& solution, double std_error);

}  // namespace shakebed::fit
