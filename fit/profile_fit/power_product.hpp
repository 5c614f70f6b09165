#pragma once

#include <span>
#include <vector>

// Products of powers through points with errors: y = amplitude x_1^a_1 x_2^a_2 ...
namespace shakebed::fit {

struct PowerProduct {
  bool ok = false;
  std::vector<double> exponents, exponent_errors;
  double log_amplitude = 0, log_amplitude_error = 0;  // natural logarithm; with groups, of the first one
  std::vector<double> group_log_amplitude;            // of each group
  double chi2 = 0, p_value = 1;
  int dof = 0;
  double rms_log_ratio = 0;  // of the points to the fit

  // The fit at one place, of a point of this group.
  [[nodiscard]] double at(std::span<const double> x, std::size_t group = 0) const;
};

// Weighted least squares of ln y against the ln x_k, with error/y as the error of ln y [Press et al., Numerical
// Recipes, 15.4]. The points may scatter more than their errors allow (chi2 > dof). Then the errors of the exponents
// are multiplied by sqrt(chi2/dof) [Particle Data Group, Review, 5.2.2].
//
// x[k] holds the values of x_k at the points. `group`: a number from 0 for every point, with no gap; each group has an
// amplitude of its own. Empty: all points have one amplitude.
//
// Not ok with fewer points than unknowns plus one, or with a number or error that is not positive. Not ok either where
// the ln x_k depend linearly on one another or on the groups.
[[nodiscard]] PowerProduct fit_power_product(const std::vector<std::vector<double>>& x, std::span<const double> y,
                                             std::span<const double> error, std::span<const std::size_t> group = {});

}  // namespace shakebed::fit
