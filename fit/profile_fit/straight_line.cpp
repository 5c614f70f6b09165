#include "fit/profile_fit/straight_line.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "fit/profile_fit/chances.hpp"

namespace shakebed::fit {

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

PowerLaw fit_given_power(std::span<const double> x, std::span<const double> y, std::span<const double> error,
                         double exponent, bool with_offset) {
  PowerLaw law;
  law.exponent = exponent;
  law.dof = static_cast<int>(x.size()) - (with_offset ? 2 : 1);
  if (law.dof < 0) return law;
  std::vector<double> power;
  double xx = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!(x[i] > 0) || !(error[i] > 0)) return law;
    power.push_back(std::pow(x[i], exponent));
    xx += std::pow(power[i] / error[i], 2), xy += power[i] * y[i] / (error[i] * error[i]);
  }
  if (with_offset) {
    const StraightLine line = fit_straight_line(power, y, error);
    if (!line.ok) return law;
    law.offset = line.intercept, law.amplitude = line.slope, law.chi2 = line.chi2;
  } else {
    law.amplitude = xy / xx;
    for (std::size_t i = 0; i < x.size(); ++i) law.chi2 += std::pow((y[i] - law.amplitude * power[i]) / error[i], 2);
  }
  law.ok = true;
  law.p_value = chance_of_chi2(law.chi2, law.dof);
  return law;
}

PowerLaw fit_power_law(std::span<const double> x, std::span<const double> y, std::span<const double> error,
                       bool with_offset) {
  constexpr double least = 0.1, most = 6, step = 0.02;
  const auto chi2 = [&](double exponent) { return fit_given_power(x, y, error, exponent, with_offset).chi2; };
  PowerLaw best = fit_given_power(x, y, error, least, with_offset);
  best.dof -= 1;
  if (!best.ok || best.dof < 0) {
    best.ok = false;
    return best;
  }
  // The lowest of a comb, then halving about it.
  double exponent = least;
  for (double trial = least; trial <= most; trial += step) {
    if (chi2(trial) < chi2(exponent)) exponent = trial;
  }
  for (double width = step; width > 1e-9; width /= 2) {
    for (const double trial : {exponent - width, exponent + width}) {
      if (trial >= least && trial <= most && chi2(trial) < chi2(exponent)) exponent = trial;
    }
  }
  const int dof = best.dof;
  best = fit_given_power(x, y, error, exponent, with_offset);
  best.dof = dof, best.p_value = chance_of_chi2(best.chi2, dof);
  // Where chi2 has risen by 1 on either side.
  const auto crossing = [&](double end) {
    double inside = exponent, outside = end;
    if (chi2(outside) < best.chi2 + 1) return std::numeric_limits<double>::quiet_NaN();
    for (int i = 0; i < 60; ++i) {
      const double middle = (inside + outside) / 2;
      (chi2(middle) < best.chi2 + 1 ? inside : outside) = middle;
    }
    return inside;
  };
  const double low = crossing(least), high = crossing(most);
  best.ok = std::isfinite(low) && std::isfinite(high);
  best.exponent_error = (high - low) / 2 * (dof > 0 ? std::sqrt(std::max(1.0, best.chi2 / dof)) : 1.0);
  return best;
}

}  // namespace shakebed::fit
