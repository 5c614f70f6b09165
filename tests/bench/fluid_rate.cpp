// Collisions per CPU second of one fluid, for tests/bench/scoreboard:
//
//   fluid_rate ROWS PACKING RESTITUTION SECONDS
//
// ROWS x ROWS disks (even) without gravity in a periodic box begin on a hexagonal lattice at T = 1. After 20 collisions
// a disk without loss the clock runs for so many CPU seconds. Where disks lose energy, one run goes on for 20
// collisions a disk more and the next begins anew, so that no bed cools to rest. Prints collisions, CPU seconds and
// collisions per unit of time.
#include <time.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <numbers>

#include "sim/engine/simulation.hpp"

namespace {

using namespace shakebed::sim;

constexpr double warm = 20, measured = 20;  // collisions a disk

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Scene fluid(std::uint32_t rows, double packing, double restitution, std::uint64_t seed) {
  const double spacing = std::sqrt(std::numbers::pi / 4 / packing * 2 / std::numbers::sqrt3);
  Scene scene;
  scene.gravity = Weightless{};
  scene.disks.species = {{rows * rows, 1, 1}};
  scene.disks.contact.restitution = restitution;
  if (restitution < 1) scene.disks.contact_duration = 1e-6;  // without it the cooling gas collapses
  scene.box.width = rows * spacing;
  scene.box.sides = PeriodicSides{};
  scene.box.top = PeriodicTop{rows * spacing * std::numbers::sqrt3 / 2};
  scene.start = HexagonalStart{rows, 0};
  scene.seed = seed;
  return scene;
}

struct Rate {
  double collisions = 0, seconds = 0, time = 0;
};

// Until `more` disk collisions happened or the seconds are over.
void run(Simulation& simulation, double more, double seconds, Rate& rate) {
  const double from = static_cast<double>(simulation.counters().disk_collisions), since = simulation.time();
  const double start = cpu_seconds();
  const auto done = [&] { return static_cast<double>(simulation.counters().disk_collisions) - from; };
  while (done() < more && cpu_seconds() - start < seconds)
    simulation.advance_towards(std::numeric_limits<double>::max(), 5'000);
  rate.collisions += done();
  rate.seconds += cpu_seconds() - start;
  rate.time += simulation.time() - since;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 5) {
    std::fputs("use: fluid_rate ROWS PACKING RESTITUTION SECONDS\n", stderr);
    return 2;
  }
  const auto rows = static_cast<std::uint32_t>(std::atoi(arguments[1]));
  const double packing = std::atof(arguments[2]), restitution = std::atof(arguments[3]);
  const double seconds = std::atof(arguments[4]), half = rows * rows / 2.0;
  Rate rate;
  for (std::uint64_t seed = 1; rate.seconds < seconds; ++seed) {
    const std::unique_ptr<Simulation> simulation = simulate(fluid(rows, packing, restitution, seed));
    Rate ignored;
    run(*simulation, warm * half, 1e9, ignored);
    run(*simulation, restitution < 1 ? measured * half : 1e18, seconds - rate.seconds, rate);
  }
  std::printf("%.0f %.6g %.6g\n", rate.collisions, rate.seconds, rate.collisions / rate.time);
}
