#include "fit/profile_fit/power_product.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "fit/profile_fit/straight_line.hpp"

namespace shakebed::fit {
namespace {

// Columns of the design count as dependent where their part that no other column explains is below this share of
// their length: 1e-8 leaves 8 of the 16 digits of a double.
constexpr double independent_share = 1e-8;

bool all_positive(std::span<const double> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double number) { return number > 0 && std::isfinite(number); });
}

}  // namespace

double PowerProduct::at(std::span<const double> x, std::size_t group) const {
  double sum = group_log_amplitude[group];
  for (std::size_t k = 0; k < exponents.size(); ++k) sum += exponents[k] * std::log(x[k]);
  return std::exp(sum);
}

PowerProduct fit_power_product(const std::vector<std::vector<double>>& x, std::span<const double> y,
                               std::span<const double> error, std::span<const std::size_t> group) {
  PowerProduct fit;
  const std::size_t groups = group.empty() ? 1 : 1 + *std::max_element(group.begin(), group.end());
  const auto group_of = [&](std::size_t point) { return group.empty() ? 0 : group[point]; };
  const auto points = static_cast<Eigen::Index>(y.size()), first = static_cast<Eigen::Index>(groups),
             unknowns = static_cast<Eigen::Index>(x.size()) + first;
  fit.dof = static_cast<int>(points - unknowns);
  if (fit.dof < 1 || !all_positive(y) || !all_positive(error)) return fit;
  for (const std::vector<double>& column : x) {
    if (!all_positive(column)) return fit;
  }
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(points, unknowns);  // each row divided by the error of ln y
  Eigen::VectorXd target(points);
  for (Eigen::Index i = 0; i < points; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double weight = y[at] / error[at];
    target(i) = weight * std::log(y[at]);
    design(i, static_cast<Eigen::Index>(group_of(at))) = weight;
    for (std::size_t k = 0; k < x.size(); ++k)
      design(i, first + static_cast<Eigen::Index>(k)) = weight * std::log(x[k][at]);
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(design);
  solver.setThreshold(independent_share);
  if (solver.rank() < unknowns) return fit;
  const Eigen::VectorXd solution = solver.solve(target);
  const Eigen::MatrixXd covariance = (design.transpose() * design).inverse();
  fit.ok = true;
  fit.chi2 = (design * solution - target).squaredNorm();
  fit.p_value = chance_of_chi2(fit.chi2, fit.dof);
  const double widened = std::sqrt(std::max(1.0, fit.chi2 / fit.dof));
  fit.group_log_amplitude.assign(solution.begin(), solution.begin() + first);
  fit.log_amplitude = solution(0), fit.log_amplitude_error = widened * std::sqrt(covariance(0, 0));
  for (Eigen::Index k = first; k < unknowns; ++k) {
    fit.exponents.push_back(solution(k));
    fit.exponent_errors.push_back(widened * std::sqrt(covariance(k, k)));
  }
  double squares = 0;
  std::vector<double> place(x.size());
  for (std::size_t i = 0; i < y.size(); ++i) {
    for (std::size_t k = 0; k < x.size(); ++k) place[k] = x[k][i];
    squares += std::pow(std::log(y[i] / fit.at(place, group_of(i))), 2);
  }
  fit.rms_log_ratio = std::sqrt(squares / static_cast<double>(y.size()));
  return fit;
}

}  // namespace shakebed::fit
