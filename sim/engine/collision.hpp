// What a contact does: the collision rules. Reduced units, velocities in the lab frame.
//
// A rule is a small struct: it computes how two disks, or a disk and a wall, exchange momentum. `smooth elastic`,
// `smooth dissipative` and `rough` are separate types because the engine is specialised for them. The restitution of a
// contact is chosen at run time: constant, or elastic where the contact duration requires it.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>

#include "sim/engine/lanes.hpp"
#include "sim/scene/surface.hpp"

namespace shakebed::sim {

// Two smooth disks. d, dv: position and velocity {x, z} of the second from the first, which approach (d.dv < 0);
// contact_squared: (R1 + R2)^2, which their distance is but for rounding. The change of their relative velocity is
// -(1+e) (g.n) n. Of it the first disk takes -m2/(m1+m2), the second m1/(m1+m2).
struct NormalImpulse {
  TwoLanes normal;    // n / |d|; at hand before the approach is
  double approach;    // |d| (g.n) = d.dv
  double dissipated;  // energy lost, for reduced mass 1
};
inline NormalImpulse smooth_impulse(TwoLanes d, TwoLanes dv, double contact_squared, double restitution) {
  const double approach = fused(d[0], dv[0], d[1] * dv[1]);
  // 1 / d^2 by its first step from 1 / (R1 + R2)^2: wrong by beyond^2 only, and need not wait for a division.
  const double inverse_contact = 1 / contact_squared;
  const double beyond = fused(d[0], d[0], fused(d[1], d[1], -contact_squared)) * inverse_contact;
  double inverse_distance = (1 - beyond) * inverse_contact;
  if (!(std::abs(beyond) < 1e-9)) [[unlikely]]
    inverse_distance = inverse_contact / (1 + beyond);
  return {inverse_distance * d, approach,
          0.5 * (1 - restitution * restitution) * approach * approach * inverse_distance};
}

// The Walton rule for rough disks [Walton1993, Luding1998]. Signs and symbols:
//   (nx, nz) points from the first disk to the second (or to the wall); the tangent is (-nz, nx);
//   spins count positive from x to z;
//   gn = (v1 - v2).n > 0 for an approach;
//   gt = (v1 - v2).t + R1 w1 + R2 w2;
//   inverse_inertia_ratio: 1/q, q = I/(m R^2).
// The momentum exchanged is
//   p = -m12 (1+e) gn n - m12 (1+b)/(1+1/q) gt t,
//   b = min(b0, -1 + mu_f (1+e)(1+1/q) |gn|/|gt|).
// Each spin then changes by R p_t / I.
struct RoughImpulse {
  double px, pz;      // momentum given to the first, taken from the second (or the wall)
  double tangential;  // p_t
  double dissipated;  // energy lost, spin included
};
inline RoughImpulse walton_impulse(double nx, double nz, double gn, double gt, double reduced_mass,
                                   const Surface& surface, double inverse_inertia_ratio) {
  assert(gn > -1e-9 && reduced_mass > 0 && surface.restitution >= 0 && surface.restitution <= 1);
  const double e = surface.restitution;
  const double normal = -reduced_mass * (1 + e) * gn;
  double dissipated = 0.5 * reduced_mass * (1 - e * e) * gn * gn;
  double tangential = 0;
  if (gt != 0 && surface.friction > 0) {
    const double lever = 1 + inverse_inertia_ratio;  // 1 + 1/q
    const double coulomb = -1 + surface.friction * (1 + e) * lever * std::abs(gn) / std::abs(gt);
    const double b = std::min(surface.tangential_restitution, coulomb);
    tangential = -reduced_mass * (1 + b) / lever * gt;
    dissipated += 0.5 * reduced_mass / lever * (1 - b * b) * gt * gt;
  }
  return {normal * nx - tangential * nz, normal * nz + tangential * nx, tangential, dissipated};
}

}  // namespace shakebed::sim
