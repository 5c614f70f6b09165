// Collisions a CPU second of the simulator, at several sizes: the fluid at area fraction 0.70, the shaken bed, and
// beside it a fluid as dense as the bed is round a disk. Speed stands beside what it must not be bought with: energy
// drift and overlap.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>

#include "sim/engine/simulation.hpp"

namespace {

using namespace shakebed::sim;

void report(benchmark::State& state, const Simulation& simulation, std::uint64_t collisions, double energy_error) {
  state.counters["collisions/s"] = benchmark::Counter(static_cast<double>(collisions), benchmark::Counter::kIsRate);
  state.counters["bytes/disk"] =
      static_cast<double>(simulation.bytes()) / static_cast<double>(simulation.properties().radius.size());
  state.counters["energy_error"] = energy_error;
  state.counters["overlap"] = simulation.largest_overlap();
}

// Weightless, elastic, periodic; equilibrated for 150 collisions a disk before the clock starts.
void fluid(benchmark::State& state) {
  const auto rows = static_cast<std::uint32_t>(state.range(0));
  const double area_fraction = static_cast<double>(state.range(1)) / 100;
  const double side = std::sqrt(std::numbers::pi / 4 / area_fraction * 2 / std::numbers::sqrt3);
  Scene scene;
  scene.gravity = Weightless{};
  scene.disks.species = {{rows * rows, 1, 1}};
  scene.box.width = rows * side;
  scene.box.sides = PeriodicSides{};
  scene.box.top = PeriodicTop{rows * side * std::numbers::sqrt3 / 2};
  scene.start = HexagonalStart{rows, 0};
  const auto simulation = simulate(scene);
  while (2 * simulation->counters().disk_collisions < 150ULL * rows * rows)
    simulation->advance_to(simulation->time() + 1);
  const double energy = simulation->energy().kinetic;
  const std::uint64_t before = simulation->counters().collisions();
  // A step long enough to hold about 2e6 collisions.
  const double step = std::max(0.25, 2e6 / (8.0 * rows * rows));
  for ([[maybe_unused]] auto _ : state) simulation->advance_to(simulation->time() + step);
  report(state, *simulation, simulation->counters().collisions() - before, simulation->energy().kinetic / energy - 1);
}
BENCHMARK(fluid)
    ->ArgNames({"rows", "per_cent"})
    ->ArgsProduct({{32, 100, 316, 1000}, {70}})
    ->ArgsProduct({{17, 55, 175}, {52}})
    ->Unit(benchmark::kMillisecond);
// Equilibrated once: a number of iterations that is looked for would do so several times.
BENCHMARK(fluid)->ArgNames({"rows", "per_cent"})->Args({3162, 70})->Iterations(10)->Unit(benchmark::kMillisecond);

// The bed that an independent soft-sphere simulation also did, tiled sideways: a period of the floor an iteration.
void shaken_bed(benchmark::State& state) {
  const auto tiles = static_cast<std::uint32_t>(state.range(0));
  const double restitution = static_cast<double>(state.range(1)) / 100;
  const double time_unit = std::sqrt(2.99e-3 / 9.81), frequency = 20 * time_unit;
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{306 * tiles, 1, 1}};
  scene.disks.contact = {restitution, 0, 0};
  scene.disks.contact_duration = 1e-6 / time_unit;
  scene.box.width = 30.0 * tiles;
  scene.box.sides = HardSides{{restitution, 0, 0}};
  scene.box.floor = SinusoidalFloor{2.5 / 2.99, frequency};
  scene.box.floor_surface = {restitution, 0, 0};
  scene.start_temperature = 0.01;
  const auto simulation = simulate(scene);
  simulation->advance_to(50 / frequency);
  const std::uint64_t before = simulation->counters().collisions();
  std::uint64_t periods = 50;
  for ([[maybe_unused]] auto _ : state) simulation->advance_to(static_cast<double>(++periods) / frequency);
  const EnergyLedger ledger = simulation->energy();
  report(state, *simulation, simulation->counters().collisions() - before, ledger.imbalance() / ledger.dissipated);
}
BENCHMARK(shaken_bed)->Args({1, 92})->Args({10, 92})->Args({100, 92})->Args({1, 60})->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
