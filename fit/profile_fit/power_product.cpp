#include "fit/profile_fit/power_product.hpp"

#include <gsl/gsl_multifit.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "fit/profile_fit/chances.hpp"

namespace shakebed::fit {
namespace {

// Columns of the design, scaled to one length, count as dependent where a singular value is below this share of the
// largest: 1e-8 leaves 8 of the 16 digits of a double.
constexpr double independent_share = 1e-8;

using OwnedVector = std::unique_ptr<gsl_vector, decltype(&gsl_vector_free)>;
using OwnedMatrix = std::unique_ptr<gsl_matrix, decltype(&gsl_matrix_free)>;
OwnedVector zero_vector(std::size_t size) { return {gsl_vector_calloc(size), gsl_vector_free}; }
OwnedMatrix zero_matrix(std::size_t rows, std::size_t columns) {
  return {gsl_matrix_calloc(rows, columns), gsl_matrix_free};
}

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
  const std::size_t points = y.size(), unknowns = x.size() + groups;
  fit.dof = static_cast<int>(points) - static_cast<int>(unknowns);
  if (fit.dof < 1 || !all_positive(y) || !all_positive(error)) return fit;
  for (const std::vector<double>& column : x) {
    if (!all_positive(column)) return fit;
  }
  const OwnedVector target = zero_vector(points), weight = zero_vector(points), solution = zero_vector(unknowns);
  const OwnedMatrix design = zero_matrix(points, unknowns), covariance = zero_matrix(unknowns, unknowns);
  for (std::size_t i = 0; i < points; ++i) {
    gsl_vector_set(target.get(), i, std::log(y[i]));
    gsl_vector_set(weight.get(), i, std::pow(y[i] / error[i], 2));
    gsl_matrix_set(design.get(), i, group_of(i), 1);
    for (std::size_t k = 0; k < x.size(); ++k) gsl_matrix_set(design.get(), i, groups + k, std::log(x[k][i]));
  }
  const std::unique_ptr<gsl_multifit_linear_workspace, decltype(&gsl_multifit_linear_free)> work(
      gsl_multifit_linear_alloc(points, unknowns), gsl_multifit_linear_free);
  std::size_t rank = 0;
  double chi2 = 0;
  gsl_multifit_wlinear_tsvd(design.get(), weight.get(), target.get(), independent_share, solution.get(),
                            covariance.get(), &chi2, &rank, work.get());
  if (rank < unknowns) return fit;
  const auto found = [&](std::size_t k) { return gsl_vector_get(solution.get(), k); };
  fit.ok = true;
  fit.chi2 = chi2;
  fit.p_value = chance_of_chi2(fit.chi2, fit.dof);
  const double widened = std::sqrt(std::max(1.0, fit.chi2 / fit.dof));
  const auto error_of = [&](std::size_t k) { return widened * std::sqrt(gsl_matrix_get(covariance.get(), k, k)); };
  for (std::size_t k = 0; k < groups; ++k) fit.group_log_amplitude.push_back(found(k));
  fit.log_amplitude = found(0), fit.log_amplitude_error = error_of(0);
  for (std::size_t k = groups; k < unknowns; ++k) {
    fit.exponents.push_back(found(k));
    fit.exponent_errors.push_back(error_of(k));
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
