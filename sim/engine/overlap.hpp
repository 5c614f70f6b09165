// The largest overlap of any two disks, checked from positions alone: it shares nothing with the engine's bookkeeping.
#pragma once

#include <span>

#include "sim/engine/simulation.hpp"

namespace shakebed::sim {

// radii: one a disk [D]; period_x, period_z: 0 where the box is not periodic [D].
// Returns 0 when nothing overlaps.
double largest_overlap(const Snapshot& at, std::span<const double> radii, double period_x, double period_z);

}  // namespace shakebed::sim
