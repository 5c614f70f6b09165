#include "fit/tail.hpp"

#include <algorithm>

namespace shakebed::fit {

void Tail::prepare(const EquationOfState& equation) {
  start = std::max(reference, base);
  jump = {};
  inverse_temperature_ = 0.0;
  if (!(temperature > 0.0)) return;
  inverse_temperature_ = 1.0 / temperature;
  end = std::max(start, height_of_f(InverseTable::lowest_f));
  const std::span<const double> breaks = equation.breaks();
  if (breaks.size() == 2) {
    const double at = std::log(breaks[0]) + equation.excess(breaks[0]);
    if (at < f_at(start)) jump = {at, breaks[0], breaks[1], height_of_f(at)};
  }
}

// phi(F) is smooth on the scale F/2 at high density, on the scale 3 about F = 0 (its nearest complex singularity lies
// about pi away there), and an exponential below.
template <std::size_t Components, class Curve>
void Tail::add_tail(double height, const KernelRule& rule, Curve&& curve, std::array<double, Components>& sum) const {
  const auto panel_at = [this](double h) {
    const double panel = temperature * std::max(2.2, 0.22 * f_at(h));
    // Just below freezing the fluid's stiffness almost vanishes: phi(F) has a branch point 0.01 beyond the jump.
    if (jump.upper > 0.0 && h >= jump.at) return std::min(panel, 0.01 * temperature + 0.8 * (h - jump.at));
    return panel;
  };
  const CurveShape<decltype(panel_at)> shape{start, end, std::span<const double>(&jump.at, jump.upper > 0.0 ? 1 : 0),
                                             panel_at};
  add_convolution<Components>(rule, height, shape, curve, sum);
}

double Tail::density(double height) const {
  if (height < base) return 0.0;
  if (height <= start && start > base) return rectangle_density;
  if (!(temperature > 0.0)) return height <= start ? rectangle_density : 0.0;
  return table->density(f_at(height));
}

double Tail::rectangle_cover(double height, const Kernel& kernel) const {
  if (!(start > base)) return 0.0;
  return kernel_cumulative(kernel, height - base) - kernel_cumulative(kernel, height - start);
}

double Tail::smoothed(double height, const KernelRule& rule) const {
  if (rule.is_point()) return density(height);
  std::array<double, 1> sum{rectangle_density * rectangle_cover(height, rule.kernel())};
  if (temperature > 0.0) {
    add_tail<1>(
        height, rule, [&](double h) { return std::array<double, 1>{table->density(f_at(h))}; }, sum);
  }
  return sum[0];
}

std::array<double, 1 + Tail::max_parameters> Tail::smoothed_with_gradient(double height, const KernelRule& rule) const {
  // The tail's derivatives are slope (A_p + B_p (h - reference)) with A_p = dF_ref + d_ref/T, B_p = dT/T^2: so three
  // integrals (phi, slope, slope (h - reference)) give them all.
  std::array<double, 3> sum{};
  std::array<double, 1 + max_parameters> out{};
  double cover = 0.0;
  if (rule.is_point()) {
    if (height < base) return out;
    if (height <= start && start > base) {
      out[0] = rectangle_density;
      for (std::size_t p = 0; p < max_parameters; ++p) out[1 + p] = d_rectangle[p];
      return out;
    }
    if (!(temperature > 0.0)) return out;
    const InverseTable::Point point = table->point(f_at(height));
    sum = {point.density, point.slope, point.slope * (height - reference)};
  } else {
    cover = rectangle_cover(height, rule.kernel());
    if (temperature > 0.0) {
      add_tail<3>(
          height, rule,
          [&](double h) {
            const InverseTable::Point point = table->point(f_at(h));
            return std::array<double, 3>{point.density, point.slope, point.slope * (h - reference)};
          },
          sum);
    }
  }
  out[0] = sum[0] + rectangle_density * cover;
  double at_jump = 0.0;  // the height of a jump moves with the parameters
  if (!rule.is_point() && jump.upper > 0.0) {
    at_jump = (jump.upper - jump.lower) * kernel_density(rule.kernel(), height - jump.at);
  }
  for (std::size_t p = 0; p < max_parameters; ++p) {
    double derivative = cover * d_rectangle[p];
    if (temperature > 0.0) {
      derivative += sum[1] * (d_f_reference[p] + d_reference[p] * inverse_temperature_) +
                    sum[2] * d_temperature[p] * inverse_temperature_ * inverse_temperature_;
      derivative +=
          at_jump * (d_reference[p] + d_temperature[p] * (f_reference - jump.f) + temperature * d_f_reference[p]);
    }
    out[1 + p] = derivative;
  }
  return out;
}

}  // namespace shakebed::fit
