#include "fit/theory/expansion.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "fit/theory/quadrature.hpp"

namespace shakebed::fit {

namespace {

// (1/phi_0) integral_0^phi_0 (Z/Z_0)^2 dphi: a mean of positive numbers. Even panels, broken at kinks of Z, and, where
// Z has a pole, shrinking towards phi_0 with the distance to it.
double mean_square_ratio(const EquationOfState& equation, double plateau_density, double z_plateau) {
  std::vector<double> edges;
  constexpr int even_panels = 64;
  for (int i = 0; i <= even_panels; ++i) edges.push_back(plateau_density * i / even_panels);
  if (equation.has_pole()) {
    double gap = equation.largest_density() - edges[even_panels - 1];
    const double last_gap = equation.largest_density() - plateau_density;
    while ((gap *= 0.7) > last_gap) edges.push_back(equation.largest_density() - gap);
  }
  for (const double density : equation.breaks()) {
    if (density < plateau_density) edges.push_back(density);
  }
  std::sort(edges.begin(), edges.end());
  double sum = 0.0;
  for (std::size_t i = 1; i < edges.size(); ++i) {
    if (!(edges[i] > edges[i - 1])) continue;
    sum += integrate_panel<16>(edges[i - 1] / plateau_density, edges[i] / plateau_density, [&](double fraction) {
      const double ratio = equation.local(fraction * plateau_density).compressibility_factor / z_plateau;
      return ratio * ratio;
    });
  }
  return sum;
}

bool is_valid(const Column& column) {
  return std::isfinite(column.column_number) && column.column_number > 0.0 && std::isfinite(column.plateau_density) &&
         column.plateau_density > 0.0;
}

}  // namespace

ExpansionConstants expansion_constants(const EquationOfState& equation, double plateau_density) {
  ExpansionConstants result;
  result.plateau_density = plateau_density;
  if (!(plateau_density > 0.0)) {
    result.status = ValueStatus::invalid_argument;
    return result;
  }
  const Value z = equation.compressibility_factor(plateau_density);
  if (!z.ok()) {
    result.status = z.status;
    return result;
  }
  result.compressibility_factor = z.value;
  result.mu_0 = plateau_density * z.value;
  result.k = mean_square_ratio(equation, plateau_density, z.value);
  result.lambda_1 = 0.5 * result.mu_0 * z.value * (1.0 + result.k);
  result.f_plateau = equation.f(plateau_density).value;
  result.contact_value = equation.contact_value(plateau_density).value;
  return result;
}

double expansion_coefficient(double lambda_1, double mu_0, double plateau_density) {
  return 2.0 * lambda_1 * plateau_density / (mu_0 * mu_0) - 1.0;
}

Column column_from_initial_height(double initial_height, double plateau_density) {
  return {initial_height * plateau_density, plateau_density};
}

Value critical_temperature(const EquationOfState& equation, const Column& column) {
  if (!is_valid(column)) return no_value(ValueStatus::invalid_argument);
  const Value z = equation.compressibility_factor(column.plateau_density);
  if (!z.ok()) return z;
  return {column.initial_height() / z.value};
}

Value solid_height(const EquationOfState& equation, const Column& column, double temperature) {
  if (!std::isfinite(temperature) || temperature < 0.0) return no_value(ValueStatus::invalid_argument);
  if (!is_valid(column)) return no_value(ValueStatus::invalid_argument);
  const Value z = equation.compressibility_factor(column.plateau_density);
  if (!z.ok()) return z;
  return {std::max(0.0, column.initial_height() - temperature * z.value)};
}

Value center_of_mass_rise(const EquationOfState& equation, const Column& column, double temperature) {
  const Value critical = critical_temperature(equation, column);
  if (!critical.ok()) return critical;
  if (!std::isfinite(temperature) || temperature < 0.0) return no_value(ValueStatus::invalid_argument);
  if (temperature > critical.value) return no_value(ValueStatus::outside_range);
  const ExpansionConstants constants = expansion_constants(equation, column.plateau_density);
  const double reduced = temperature / critical.value;
  return {0.5 * column.initial_height() * constants.k * reduced * reduced};
}

Value hydrostatic_center_of_mass_rise(const EquationOfState& equation, const Column& column, double temperature) {
  if (!is_valid(column) || !std::isfinite(temperature) || temperature < 0.0) {
    return no_value(ValueStatus::invalid_argument);
  }
  if (temperature == 0.0) return {0.0};
  const Value critical = critical_temperature(equation, column);
  if (!equation.has_pole()) {
    if (!critical.ok()) return critical;
    if (temperature <= critical.value) return center_of_mass_rise(equation, column, temperature);
  }
  const Value bottom = equation.density_from_scaled_pressure(column.column_number / temperature);
  if (!bottom.ok()) return bottom;
  const ExpansionConstants constants = expansion_constants(equation, bottom.value);
  if (!constants.ok()) return no_value(constants.status);
  // The first moment of the column is T^2 Lambda_1(bottom).
  const double center = temperature * temperature * constants.lambda_1 / column.column_number;
  return {center - 0.5 * column.initial_height()};
}

}  // namespace shakebed::fit
