// A bed of 100 dissipative disks on a shaking floor: simulated step by step, then measured.
#include <algorithm>
#include <cstdio>
#include <numbers>
#include <shakebed/sim/measured_bed.hpp>
#include <shakebed/sim/simulation.hpp>

int main() {
  namespace sim = shakebed::sim;

  // Reduced units: lengths in D, times in sqrt(D/g). 20 Hz and 2.99 mm are 0.349 periods a unit of time.
  const double frequency = 0.349, gamma = 4;
  const double angular = 2 * std::numbers::pi * frequency;
  const sim::Surface contact{.restitution = 0.92};
  sim::Scene scene;
  scene.gravity = sim::UniformGravity{};
  scene.disks = {.species = {{.count = 100}}, .contact = contact, .contact_duration = 1e-4};
  scene.box.width = 10;
  scene.box.sides = sim::HardSides{contact};
  scene.box.floor = sim::SinusoidalFloor{.amplitude = gamma / (angular * angular), .frequency = frequency};
  scene.box.floor_surface = contact;
  for (const auto& problem : sim::check(scene)) std::printf("%s: %s\n", problem.where.c_str(), problem.what.c_str());

  std::puts("time  highest disk  collisions");
  const auto bed = sim::simulate(scene);
  sim::Snapshot now;
  for (const double time : {0.0, 10.0, 20.0, 30.0}) {
    bed->advance_to(time);
    bed->snapshot(now);
    double highest = 0;
    for (const double z : now.z) highest = std::max(highest, z);
    std::printf("%4.0f  %12.4f  %10llu\n", now.time, highest,
                static_cast<unsigned long long>(bed->counters().collisions()));
  }

  const sim::MeasuredBed measured = sim::measure(scene, {.settle = 60, .duration = 300, .frames = 16});
  std::printf("\n%s\n%zu frames kept\n", measured.brief().c_str(), measured.frames.size());
  return measured.ok() ? 0 : 1;
}
