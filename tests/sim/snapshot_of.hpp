#pragma once
// All that a simulation shows now.

#include "sim/engine/simulation.hpp"

namespace shakebed::sim {

inline Snapshot snapshot_of(const Simulation& simulation) {
  Snapshot at;
  simulation.snapshot(at);
  return at;
}

}  // namespace shakebed::sim
