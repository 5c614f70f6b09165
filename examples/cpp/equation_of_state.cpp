// An equation of state of one's own, Z = 1/(1 - eta)^2 of scaled-particle theory [Helfand, Frisch, Lebowitz, J. Chem.
// Phys. 34, 1037 (1961)], and what follows from it: T_c, and the profile of a column of disks.
#include <cmath>
#include <cstdio>
#include <numbers>
#include <shakebed/fit/hydrostatic_profile.hpp>

namespace fit = shakebed::fit;

class ScaledParticle final : public fit::EquationOfState {
 public:
  ScaledParticle()
      : EquationOfState({.name = "scaled-particle",
                         .title = "scaled-particle theory",
                         .source = "HelfandFrischLebowitz1961",
                         .validity = "fluid branch",
                         .accurate_density = 0.5,
                         .largest_density = fit::close_packing_density,
                         .largest_invertible_density = fit::close_packing_density,
                         .has_pole = false,
                         .f_constant = 0}) {}
  Local local(double phi) const override {  // Z, and d(phi Z)/dphi
    const double eta = fit::area_fraction(phi), one = 1 - eta;
    return {1 / (one * one), (1 + eta) / (one * one * one)};
  }
  double excess(double phi) const override { return static_cast<double>(extended_excess(phi)); }

 protected:
  long double extended_excess(long double phi) const override {  // Z - 1 + integral of (Z - 1)/phi
    const long double eta = std::numbers::pi_v<long double> / 4 * phi, one = 1 - eta;
    return 1 / (one * one) - 1 + eta / one - std::log1p(-eta);
  }
};

int main() {
  const ScaledParticle mine;
  const fit::Column column = fit::column_from_initial_height(10.2, 1.10);
  std::printf("T_c: %.4f m g D (Enskog: %.4f)\n", fit::critical_temperature(mine, column).value,
              fit::critical_temperature(fit::enskog(), column).value);

  const auto profile = fit::HydrostaticProfile::of_column(mine, 0.12, column);
  const auto enskog = fit::HydrostaticProfile::of_column(fit::enskog(), 0.12, column);
  std::puts("height [D]  n D^2   by Enskog");
  for (double height = 0; height <= 16; height += 2)
    std::printf("%10.1f  %.4f  %9.4f\n", height, profile.density(height), enskog.density(height));
}
