// Where the disks are at time 0.
#pragma once

#include <vector>

#include "sim/scene/scene.hpp"

namespace shakebed::sim {

// The disks at time 0. Throws std::runtime_error where the start cannot be built (they do not fit).
std::vector<Placed> place_disks(const Scene& scene);

}  // namespace shakebed::sim
