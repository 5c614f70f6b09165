#include "fit/theory/hydrostatic_profile.hpp"

#include <algorithm>
#include <cmath>

#include "fit/theory/tail.hpp"

namespace shakebed::fit {

HydrostaticProfile HydrostaticProfile::tail_over_rectangle(const EquationOfState& equation, double temperature,
                                                           double shift, double plateau_density, double base) {
  if (std::abs(plateau_density - close_packing_density) <= 4e-16 * close_packing_density) {
    plateau_density = close_packing_density;  // 2/sqrt 3, rounded another way
  }
  HydrostaticProfile profile;
  profile.equation_ = &equation;
  profile.base_ = base;
  profile.temperature_ = temperature;
  if (!std::isfinite(temperature) || temperature < 0.0 || !std::isfinite(shift) || !std::isfinite(base) ||
      !(plateau_density > 0.0)) {
    profile.status_ = ValueStatus::invalid_argument;
    return profile;
  }
  const Value z = equation.compressibility_factor(plateau_density);
  profile.status_ = z.status;
  if (z.ok() && plateau_density > equation.largest_invertible_density()) profile.status_ = ValueStatus::outside_range;
  if (!profile.ok()) return profile;
  const double big_f = std::log(plateau_density) + equation.excess(plateau_density);
  if (shift >= base || temperature == 0.0) {
    profile.top_ = std::max(shift, base);
    profile.f_top_ = big_f;
    profile.bottom_density_ = shift >= base ? plateau_density : 0.0;
  } else {  // the curve meets the base above its plateau
    profile.top_ = base;
    profile.f_top_ = big_f - (base - shift) / temperature;
    profile.bottom_density_ = equation.inverse_table().density(profile.f_top_);
  }
  return profile;
}

HydrostaticProfile HydrostaticProfile::of_column(const EquationOfState& equation, double temperature,
                                                 const Column& column, double base) {
  HydrostaticProfile profile;
  profile.equation_ = &equation;
  profile.base_ = base;
  profile.temperature_ = temperature;
  profile.top_ = base;
  if (!std::isfinite(temperature) || temperature < 0.0 || !std::isfinite(base) || !(column.column_number > 0.0) ||
      !(column.plateau_density > 0.0) || !std::isfinite(column.column_number)) {
    profile.status_ = ValueStatus::invalid_argument;
    return profile;
  }
  const Value critical = critical_temperature(equation, column);
  const bool reaches_plateau = critical.ok() && !equation.has_pole() &&
                               column.plateau_density <= equation.largest_invertible_density() * (1.0 + 4e-16);
  if (reaches_plateau && temperature <= critical.value) {
    const double solid = fit::solid_height(equation, column, temperature).value;
    return tail_over_rectangle(equation, temperature, base + solid, column.plateau_density, base);
  }
  if (temperature == 0.0) {  // a pole: the limit is close packing itself
    if (!equation.has_pole()) {
      profile.status_ = ValueStatus::outside_range;
      return profile;
    }
    profile.bottom_density_ = equation.largest_density();
    profile.top_ = base + column.column_number / profile.bottom_density_;
    return profile;
  }
  const Value bottom = equation.density_from_scaled_pressure(column.column_number / temperature);
  profile.status_ = bottom.status;
  if (!bottom.ok()) return profile;
  profile.bottom_density_ = bottom.value;
  profile.f_top_ = std::log(bottom.value) + equation.excess(bottom.value);
  return profile;
}

namespace {

Tail tail_of(const EquationOfState& equation, double temperature, double base, double top, double f_top,
             double bottom_density) {
  Tail tail;
  tail.table = &equation.inverse_table();
  tail.temperature = temperature;
  tail.base = base;
  tail.reference = top;
  tail.f_reference = f_top;
  tail.rectangle_density = bottom_density;
  tail.prepare(equation);
  return tail;
}

}  // namespace

double HydrostaticProfile::density(double height) const {
  if (!ok() || !(height >= base_)) return 0.0;
  if (height <= top_) return bottom_density_;
  if (!(temperature_ > 0.0)) return 0.0;
  const double f = f_top_ - (height - top_) / temperature_ + equation_->f_constant();
  return std::min(equation_->density_from_f(f).value, bottom_density_);
}

double HydrostaticProfile::column_above(double height) const {
  if (!ok()) return 0.0;
  double above = 0.0;
  if (height < top_) above = bottom_density_ * (top_ - std::max(height, base_));
  if (temperature_ > 0.0) {
    const double at = density(std::max(height, top_));
    if (at > 0.0) above += temperature_ * at * equation_->local(at).compressibility_factor;
  }
  return above;
}

double HydrostaticProfile::center_of_mass() const {
  const double total = column_number();
  if (!(total > 0.0)) return base_;
  // First moments above the base: of the rectangle, and T^2 Lambda_1 + top (tail) of the tail.
  const double solid = top_ - base_;
  double moment = 0.5 * bottom_density_ * solid * solid;
  if (temperature_ > 0.0 && bottom_density_ > 0.0) {
    const ExpansionConstants constants = expansion_constants(*equation_, bottom_density_);
    moment += temperature_ * temperature_ * constants.lambda_1 + solid * temperature_ * constants.mu_0;
  }
  return base_ + moment / total;
}

double HydrostaticProfile::crystal_height() const {
  if (!ok()) return 0.0;
  const double freezing = fit::number_density(freezing_area_fraction);
  if (!(bottom_density_ > freezing)) return 0.0;
  if (!(temperature_ > 0.0)) return top_ - base_;
  const double f = std::log(freezing) + equation_->excess(freezing);
  return top_ + temperature_ * (f_top_ - f) - base_;
}

void HydrostaticProfile::sample(std::span<const double> heights, const Kernel& kernel,
                                std::span<double> densities) const {
  const std::size_t count = std::min(heights.size(), densities.size());
  if (!ok()) {
    std::fill_n(densities.begin(), count, 0.0);
    return;
  }
  if (kernel.kind == KernelKind::none || !(kernel.width > 0.0)) {
    for (std::size_t i = 0; i < count; ++i) densities[i] = density(heights[i]);
    return;
  }
  const Tail tail = tail_of(*equation_, temperature_, base_, top_, f_top_, bottom_density_);
  const KernelRule rule(kernel);
  for (std::size_t i = 0; i < count; ++i) densities[i] = tail.smoothed(heights[i], rule);
}

HydrostaticProfile published_profile(const PublishedFit& published) {
  return HydrostaticProfile::tail_over_rectangle(enskog(), published.temperature(), published.shift(),
                                                 published.plateau_density);
}

}  // namespace shakebed::fit
