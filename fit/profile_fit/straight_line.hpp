#pragma once

#include <span>

// Straight lines and powers through points with errors.
namespace shakebed::fit {

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

// y = offset + amplitude x^exponent, or without an offset. Where the points scatter more than their errors say
// (chi2 > dof), the error of the exponent is widened by sqrt(chi2/dof) [Particle Data Group, Review, 5.2.2].
struct PowerLaw {
  bool ok = false;
  double exponent = 0, exponent_error = 0;  // error: half the width of the interval where chi2 rises by 1
  double amplitude = 0, offset = 0;
  double chi2 = 0, p_value = 1;
  int dof = 0;
};
// chi2 of the best amplitude (and offset) for a given exponent; x > 0.
[[nodiscard]] PowerLaw fit_given_power(std::span<const double> x, std::span<const double> y,
                                       std::span<const double> error, double exponent, bool with_offset);
// The exponent, too, between 0.1 and 6. Not ok where chi2 has no minimum there or the interval does not close.
[[nodiscard]] PowerLaw fit_power_law(std::span<const double> x, std::span<const double> y,
                                     std::span<const double> error, bool with_offset);

}  // namespace shakebed::fit
