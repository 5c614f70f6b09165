// The restitution of a contact by its approach, for the laws of sim/scene/surface.hpp.
#pragma once

#include <cmath>

#include "sim/scene/surface.hpp"

namespace shakebed::sim {

// Viscoelastic spheres: e as a function of s = sqrt(beta) v^(1/10), beta the material's constant; the [1/4] Pade
// approximant of [MuellerPoeschel2011]. Against the integrated equation of motion it is right to 1e-3 for e > 0.7 and
// to 1.3 % for e > 0.39.
inline double viscoelastic_restitution(double s) {
  constexpr double c1 = 0.501086, b1 = 0.501086, b2 = 1.15345, b3 = 0.577977, b4 = 0.532178;
  return (1 + c1 * s) / (1 + s * (b1 + s * (b2 + s * (b3 + s * b4))));
}

// A surface as the engine asks it.
struct Contact : Surface {
  double softness = 0;  // s at the speed v0

  Contact() = default;
  explicit Contact(const Surface& surface) : Surface(surface) {
    if (law != RestitutionLaw::viscoelastic) return;
    double less = 0, more = 1;  // the restitution falls as s grows
    while (viscoelastic_restitution(more) > restitution) more *= 2;
    for (int halving = 0; halving < 60; ++halving) {
      const double middle = 0.5 * (less + more);
      (viscoelastic_restitution(middle) > restitution ? less : more) = middle;
    }
    softness = less;
  }

  Surface with(double other_restitution) const {
    Surface other = *this;
    other.restitution = other_restitution;
    return other;
  }
  bool varies() const { return law != RestitutionLaw::constant; }
  [[gnu::noinline]] double restitution_at(double approach) const {
    const double ratio = approach / law_speed;
    if (law == RestitutionLaw::viscoelastic) return viscoelastic_restitution(softness * std::pow(ratio, 0.1));
    if (law == RestitutionLaw::constant || ratio >= 1) return restitution;
    const double root = std::sqrt(ratio);
    return 1 - (1 - restitution) * root * std::sqrt(root);
  }
};

}  // namespace shakebed::sim
