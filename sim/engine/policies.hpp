// The choices for which the engine is specialised because they are hot: space
// (gravity and boundaries), rule (what a contact does) and sizes. Everything
// else is chosen at run time where the branch is free.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "sim/engine/lanes.hpp"

namespace shakebed::sim {

// `is_cell`: what real cells have; see engine_cell.hpp.
// Weightless and periodic in both directions: no walls at all.
struct PeriodicSpace {
  static constexpr bool falls = false, has_walls = false, wraps_x = true, wraps_z = true, is_cell = false;
};
// Weightless with a floor and a lid; the sides are hard or periodic.
struct WeightlessBox {
  static constexpr bool falls = false, has_walls = true, wraps_x = true, wraps_z = false, is_cell = false;
};
// Gravity, a floor, open above or with a lid, hard sides.
struct HardBox {
  static constexpr bool falls = true, has_walls = true, wraps_x = false, wraps_z = false, is_cell = false;
};
// The same with periodic sides.
struct PeriodicSidesBox {
  static constexpr bool falls = true, has_walls = true, wraps_x = true, wraps_z = false, is_cell = false;
};

// Gravity, a floor, sides that are periodic, hard or sloped, open above or with a lid that stands still or is free.
struct CellBox {
  static constexpr bool falls = true, has_walls = true, wraps_x = true, wraps_z = false, is_cell = true;
};

// Periods of a space; where a direction does not wrap, the period counts as 0
// and nearest() changes nothing.
struct Period {
  double length = 0, minus_length = 0, inverse = 0;
  explicit Period(double period = 0) : length(period), minus_length(-period), inverse(period > 0 ? 1 / period : 0) {}
  // Correction of a difference to that of the nearest images: a whole number of periods. The number is rounded by
  // adding and taking away a large one, which is quicker than the instruction made for it.
  double to_nearest(double difference) const {
    constexpr double large = 0x1.8p52;
    return minus_length * (fused(difference, inverse, large) - large);
  }
  static TwoLanes to_nearest(const Period& x, const Period& z, TwoLanes difference) {
    const TwoLanes large = both(0x1.8p52);
    return TwoLanes{x.minus_length, z.minus_length} *
           (fused(difference, TwoLanes{x.inverse, z.inverse}, large) - large);
  }
  double nearest(double difference) const { return difference + to_nearest(difference); }
  Lanes nearest(Lanes difference) const {
    const Lanes large = all_lanes(0x1.8p52);
    return fused(all_lanes(minus_length), fused(difference, all_lanes(inverse), large) - large, difference);
  }
  FloatLanes nearest(FloatLanes difference) const {
    const FloatLanes large = all_floats(0x1.8p23f);
    return fused(all_floats(static_cast<float>(minus_length)),
                 fused(difference, all_floats(static_cast<float>(inverse)), large) - large, difference);
  }
  // Distance of a position beyond the box, as a whole number of periods.
  double beyond(double position) const { return length * std::floor(position * inverse); }
  double wrapped(double position) const { return position - beyond(position); }
};

// Rules. `clocked`: dissipative rules know when each disk was last hit, for the
// TC model.
struct ElasticRule {
  static constexpr bool dissipates = false, spins = false;
};
struct DissipativeRule {
  static constexpr bool dissipates = true, spins = false;
};
struct RoughRule {
  static constexpr bool dissipates = true, spins = true;
};

// Sizes: all alike (diameter 1, mass 1), or two species.
struct EqualSizes {
  static constexpr bool equal = true;
  double radius(std::uint32_t) const { return 0.5; }
  double mass(std::uint32_t) const { return 1; }
  const double* mass_table() const { return nullptr; }
  double contact_distance(std::uint32_t, std::uint32_t) const { return 1; }
};
struct TwoSizes {
  static constexpr bool equal = false;
  std::vector<double> radii, masses;  // radii also of the sentinel
  double radius(std::uint32_t i) const { return radii[i]; }
  double mass(std::uint32_t i) const { return masses[i]; }
  const double* mass_table() const { return masses.data(); }
  double contact_distance(std::uint32_t i, std::uint32_t k) const { return radii[i] + radii[k]; }
};

}  // namespace shakebed::sim
