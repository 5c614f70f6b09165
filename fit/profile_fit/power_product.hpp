#pragma once

#include <span>
#include <vector>

// Products of powers through points with errors: y = amplitude x_1^a_1 x_2^a_2 ...
namespace shakebed::fit {

struct PowerProduct {
  bool ok = false;
  std::vector<double> exponents, exponent_errors;
  double log_amplitude = 0, log_amplitude_error = 0;  // natural logarithm
  double chi2 = 0, p_value = 1;
  int dof = 0;
  double rms_log_ratio = 0;  // of the points to the fit

  // The fit at one place.
  [[nodiscard]] double at(std::span<const double> x) const;
};

// Weighted least squares of ln y against the ln x_k, the error of ln y being error/y [Press et al., Numerical Recipes,
// 15.4]. Where the points scatter more than their errors say (chi2 > dof), the errors of the exponents are widened by
// sqrt(chi2/dof) [Particle Data Group, Review, 5.2.2]. x[k] holds the values of x_k at the points. Not ok with fewer
// points than unknowns plus one, with a number or error that is not positive, or where the ln x_k are not independent.
[[nodiscard]] PowerProduct fit_power_product(const std::vector<std::vector<double>>& x, std::span<const double> y,
                                             std::span<const double> error);

}  // namespace shakebed::fit
