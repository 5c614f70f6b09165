// Fingerprints of runs of four scenes: every machine must print the same.
#include <bit>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <shakebed/sim/simulation.hpp>
#include <vector>

namespace sim = shakebed::sim;

// FNV-1a over the bits of the numbers.
std::uint64_t fingerprint(const sim::Snapshot& at) {
  std::uint64_t hash = 14695981039346656037U;
  for (const auto* values : {&at.x, &at.z, &at.vx, &at.vz, &at.spin})
    for (const double value : *values) {
      auto bits = std::bit_cast<std::uint64_t>(value);
      for (int byte = 0; byte < 8; ++byte, bits >>= 8) hash = (hash ^ (bits & 0xff)) * 1099511628211U;
    }
  return hash;
}

void run(const char* name, const sim::Scene& scene, double time) {
  const auto simulation = sim::simulate(scene);
  simulation->advance_to(time);
  sim::Snapshot at;
  simulation->snapshot(at);
  std::printf("%-12s %016llx  %llu collisions\n", name, static_cast<unsigned long long>(fingerprint(at)),
              static_cast<unsigned long long>(simulation->counters().collisions()));
}

int main() {
  const sim::Surface contact{.restitution = 0.9, .friction = 0.3, .tangential_restitution = 0.2};
  sim::Scene bed;
  bed.gravity = sim::UniformGravity{};
  bed.disks = {.species = {{.count = 60}}, .contact = {.restitution = 0.9}, .contact_duration = 1e-4};
  bed.box.width = 9.3;
  bed.box.sides = sim::HardSides{};
  const double frequency = 0.349, angular = 2 * std::numbers::pi * frequency;
  bed.box.floor = sim::SinusoidalFloor{.amplitude = 4 / (angular * angular), .frequency = frequency};
  run("shaken", bed, 100);

  sim::Scene rough = bed;
  rough.disks.contact = rough.box.floor_surface = contact;
  run("rough", rough, 60);

  sim::Scene mixture = bed;
  mixture.disks.species = {{.count = 40}, {.count = 20, .diameter = 1.4, .mass = 2.7}};
  mixture.box.sides = sim::PeriodicSides{};
  mixture.bath = sim::LangevinBath{.temperature = 1, .rate = 0.1, .interval = 0.05};
  run("mixture", mixture, 60);

  sim::Scene gas;
  gas.gravity = sim::Weightless{};
  gas.disks.species = {{.count = 100}};
  gas.box = {.width = 15, .sides = sim::PeriodicSides{}, .top = sim::PeriodicTop{15}};
  run("gas", gas, 60);
}
