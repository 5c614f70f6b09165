#pragma once

#include <span>

// Straight lines through points with errors, and how well a given curve describes points.
namespace shakebed::fit {

// Chance of a chi2 at least as large, were the model true and the errors right. 1 for dof <= 0.
[[nodiscard]] double chance_of_chi2(double chi2, int dof);

// y = intercept + slope x by weighted least squares [Press et al., Numerical Recipes, 15.2]; the errors of y are taken
// as they are. At least two points at different x with positive errors, else ok is false.
struct StraightLine {
  bool ok = false;
  double slope = 0, slope_error = 0;
  double intercept = 0, intercept_error = 0;
  double covariance = 0;  // of slope and intercept
  double chi2 = 0, p_value = 1;
  int dof = 0;
};
[[nodiscard]] StraightLine fit_straight_line(std::span<const double> x, std::span<const double> y,
                                             std::span<const double> error);

}  // namespace shakebed::fit
