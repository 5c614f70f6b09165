#pragma once

#include <span>

#include "fit/theory/value.hpp"
#include "statistics/kernel.hpp"

// The Fermi profile of Hayakawa and Hong, for comparison. [HayakawaHong1997]
//
// Any number of threads may call; values own what they hold.
namespace shakebed::fit {

struct FermiProfile {
  double plateau_density = 0.0;  // phi_0 [1/D^2]
  double edge = 0.0;             // mu: where the density is phi_0/2, above the floor [D]
  double temperature = 0.0;      // theta [D] (T in m g D); 0 is a rectangle

  // phi_0/(1 + exp((zeta - mu)/theta)) for zeta >= 0, 0 below.
  [[nodiscard]] double density(double height) const;
  // phi_0 theta ln(1 + exp(mu/theta)).
  [[nodiscard]] double column_number() const;
  // Height of the centre of mass [D], exact (not the low-temperature form).
  [[nodiscard]] Value center_of_mass() const;
  // The density through a kernel.
  void sample(std::span<const double> heights, const Kernel& kernel, std::span<double> densities) const;
};

// The profile with a given N D/W: its edge from N = phi_0 theta ln(1 + exp(edge/theta)).
FermiProfile fermi_profile_of_column(double column_number, double plateau_density, double temperature);

// The low-temperature rise of the centre of mass, pi^2 theta^2/(6 mu) [D]; good to exp(-mu/theta).
double fermi_center_of_mass_rise(double temperature, double initial_height);

}  // namespace shakebed::fit
