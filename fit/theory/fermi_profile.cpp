#include "fit/theory/fermi_profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "fit/theory/convolution.hpp"

namespace shakebed::fit {

double FermiProfile::density(double height) const {
  if (height < 0.0) return 0.0;
  if (!(temperature > 0.0)) return height <= edge ? plateau_density : 0.0;
  return plateau_density / (1.0 + std::exp((height - edge) / temperature));
}

double FermiProfile::column_number() const {
  if (!(temperature > 0.0)) return plateau_density * std::max(0.0, edge);
  const double x = edge / temperature;
  // ln(1 + e^x) without overflow
  return plateau_density * temperature * (std::max(x, 0.0) + std::log1p(std::exp(-std::abs(x))));
}

Value FermiProfile::center_of_mass() const {
  const double total = column_number();
  if (!(total > 0.0)) return no_value(ValueStatus::invalid_argument);
  if (!(temperature > 0.0)) return {0.5 * edge};
  // integral z phi dz = -phi_0 theta^2 Li2(-e^x), x = edge/theta; Li2 by its series for e^x <= 1, and by
  // -Li2(-e^x) = x^2/2 + pi^2/6 + Li2(-e^-x) above.
  const double x = edge / temperature;
  const double q = std::exp(-std::abs(x));
  double series = 0.0;  // -Li2(-q) = q - q^2/4 + q^3/9 - ...
  if (q < 0.5) {
    double power = q;
    for (int n = 1; n < 80 && std::abs(power) > 1e-18 * q; ++n, power *= -q)
      series += power / (static_cast<double>(n) * n);
  } else {  // -Li2(-q) = integral_0^q ln(1 + t)/t dt
    series = integrate_panel<16>(0.0, q, [](double t) { return std::log1p(t) / t; });
  }
  const double dilogarithm = x > 0.0 ? 0.5 * x * x + std::numbers::pi * std::numbers::pi / 6.0 - series : series;
  return {plateau_density * temperature * temperature * dilogarithm / total};
}

void FermiProfile::sample(std::span<const double> heights, const Kernel& kernel, std::span<double> densities) const {
  const std::size_t count = std::min(heights.size(), densities.size());
  if (kernel.kind == KernelKind::none || !(kernel.width > 0.0)) {
    for (std::size_t i = 0; i < count; ++i) densities[i] = density(heights[i]);
    return;
  }
  if (!(temperature > 0.0)) {
    for (std::size_t i = 0; i < count; ++i) {
      densities[i] = plateau_density * (kernel_cumulative(kernel, heights[i]) -
                                        kernel_cumulative(kernel, heights[i] - std::max(0.0, edge)));
    }
    return;
  }
  // The function varies on the scale theta about the edge (poles i pi theta off the axis).
  const auto panel_at = [this](double h) { return std::max(2.2 * temperature, 0.5 * std::abs(h - edge)); };
  const CurveShape<decltype(panel_at)> shape{0.0, edge + 40.0 * temperature, {}, panel_at};
  const KernelRule rule(kernel);
  for (std::size_t i = 0; i < count; ++i) {
    std::array<double, 1> sum{};
    add_convolution<1>(
        rule, heights[i], shape, [&](double h) { return std::array<double, 1>{density(h)}; }, sum);
    densities[i] = sum[0];
  }
}

FermiProfile fermi_profile_of_column(double column_number, double plateau_density, double temperature) {
  FermiProfile profile{plateau_density, column_number / plateau_density, temperature};
  if (temperature > 0.0) {
    const double y = profile.edge / temperature;  // ln(1 + e^x) = y
    profile.edge = temperature * (y + std::log(-std::expm1(-y)));
  }
  return profile;
}

double fermi_center_of_mass_rise(double temperature, double initial_height) {
  return std::numbers::pi * std::numbers::pi * temperature * temperature / (6.0 * initial_height);
}

}  // namespace shakebed::fit
