#include "fit/straight_line.hpp"

#include <gsl/gsl_cdf.h>

#include <cmath>

namespace shakebed::fit {

double chance_of_chi2(double chi2, int dof) { return dof > 0 ? gsl_cdf_chisq_Q(chi2, dof) : 1.0; }

StraightLine fit_straight_line(std::span<const double> x, std::span<const double> y, std::span<const double> error) {
  StraightLine line;
  double weight = 0, mean_x = 0, mean_y = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!(error[i] > 0)) return line;
    const double w = 1 / (error[i] * error[i]);
    weight += w, mean_x += w * x[i], mean_y += w * y[i];
  }
  if (x.size() < 2) return line;
  mean_x /= weight, mean_y /= weight;
  double xx = 0, xy = 0;  // about the means
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double w = 1 / (error[i] * error[i]);
    xx += w * (x[i] - mean_x) * (x[i] - mean_x), xy += w * (x[i] - mean_x) * (y[i] - mean_y);
  }
  if (!(xx > 0)) return line;
  line.ok = true;
  line.slope = xy / xx, line.intercept = mean_y - line.slope * mean_x;
  line.slope_error = std::sqrt(1 / xx);
  line.intercept_error = std::sqrt(1 / weight + mean_x * mean_x / xx);
  line.covariance = -mean_x / xx;
  line.dof = static_cast<int>(x.size()) - 2;
  for (std::size_t i = 0; i < x.size(); ++i)
    line.chi2 += std::pow((y[i] - line.intercept - line.slope * x[i]) / error[i], 2);
  line.p_value = chance_of_chi2(line.chi2, line.dof);
  return line;
}

}  // namespace shakebed::fit
