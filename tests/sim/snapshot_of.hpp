#pragma once
// All that a simulation shows now, and whether two show the same to the last bit.

#include <gtest/gtest.h>

#include "sim/engine/simulation.hpp"

namespace shakebed::sim {

inline Snapshot snapshot_of(const Simulation& simulation) {
  Snapshot at;
  simulation.snapshot(at);
  return at;
}

inline void expect_same_bytes(const Simulation& a, const Simulation& b) {
  const Snapshot of_a = snapshot_of(a), of_b = snapshot_of(b);
  EXPECT_EQ(of_a.x, of_b.x);
  EXPECT_EQ(of_a.z, of_b.z);
  EXPECT_EQ(of_a.vx, of_b.vx);
  EXPECT_EQ(of_a.vz, of_b.vz);
  EXPECT_EQ(of_a.spin, of_b.spin);
  EXPECT_EQ(a.energy().dissipated, b.energy().dissipated);
  EXPECT_EQ(a.energy().dissipated_on_plates, b.energy().dissipated_on_plates);
  EXPECT_EQ(a.energy().floor_work, b.energy().floor_work);
  EXPECT_EQ(a.counters().events(), b.counters().events());
}

}  // namespace shakebed::sim
