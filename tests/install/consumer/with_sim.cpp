// Every public header of sim; a disk that falls onto an elastic floor comes back to where it was.
#include <cmath>
#include <cstdio>
#include <shakebed/sim/archive.hpp>
#include <shakebed/sim/flights.hpp>
#include <shakebed/sim/floor.hpp>
#include <shakebed/sim/measure.hpp>
#include <shakebed/sim/measured_bed.hpp>
#include <shakebed/sim/observables.hpp>
#include <shakebed/sim/order.hpp>
#include <shakebed/sim/scene.hpp>
#include <shakebed/sim/simulation.hpp>
#include <shakebed/sim/statistics.hpp>
#include <shakebed/sim/surface.hpp>
#include <shakebed/sim/velocities.hpp>

int main() {
  namespace sim = shakebed::sim;
  sim::Scene scene;
  scene.gravity = sim::UniformGravity{};
  scene.disks.species = {{.count = 1}};
  scene.box.width = 4;
  scene.start = sim::PlacedStart{{{.x = 2, .z = 2.5, .vx = 0, .vz = 0, .spin = 0, .species = 0}}};
  const auto bed = sim::simulate(scene);
  bed->advance_to(4);  // it falls 2 D in 2 units of time, and takes as long to come back
  sim::Snapshot now;
  bed->snapshot(now);
  std::printf("%.9f\n", now.z[0]);
  return std::abs(now.z[0] - 2.5) < 1e-9 && !sim::measure(sim::Scene{}, {}).ok() ? 0 : 1;
}
