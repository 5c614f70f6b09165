// What each choice of a scene costs: runs one of a row of scenes, each with one choice more than the one before it, for
// a given number of collisions. Under callgrind only measured() is counted; instructions.sh divides and compares.
//   count_instructions SCENE COLLISIONS     prints the collisions that measured() made
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/measure/flights.hpp"

namespace {

using namespace shakebed::sim;

constexpr std::uint32_t rows = 32;
const char* const choices[] = {"minimal",          "gravity",  "floor", "inelastic",
                               "contact-duration", "friction", "bath",  "observables"};

Scene scene_with(int choice) {
  Scene scene;
  scene.disks.species = {{rows * rows, 1, 1}};
  if (choice == 0) {  // weightless, elastic, smooth, periodic, at area fraction 0.70
    const double spacing = std::sqrt(std::numbers::pi / 4 / 0.70 * 2 / std::numbers::sqrt3);
    scene.gravity = Weightless{};
    scene.box.width = rows * spacing;
    scene.box.top = PeriodicTop{rows * spacing * std::numbers::sqrt3 / 2};
    scene.start = HexagonalStart{rows, 0};
  } else {
    scene.gravity = UniformGravity{};
    scene.box.width = rows * 1.05;
    scene.start = HexagonalStart{rows, 1.04};
    scene.start_temperature = 6;
  }
  scene.box.sides = PeriodicSides{};
  if (choice >= 2) scene.box.floor = SinusoidalFloor{0.5, 0.3};
  if (choice >= 3) scene.disks.contact.restitution = scene.box.floor_surface.restitution = 0.99;
  if (choice >= 4) scene.disks.contact_duration = 1e-4;
  if (choice >= 5) scene.disks.contact.friction = scene.box.floor_surface.friction = 0.2;
  if (choice >= 6) scene.bath = LangevinBath{6, 0.1, 0.5};
  return scene;
}

}  // namespace

extern "C" [[gnu::noinline]] void measured(Simulation& simulation, std::uint64_t collisions, FlightObserver* observer) {
  const std::uint64_t until = simulation.counters().collisions() + collisions;
  while (simulation.counters().collisions() < until) {
    simulation.advance_to(simulation.time() + 0.5);
    if (observer != nullptr) observer->end_block(simulation.time());
  }
}

int main(int count, char** arguments) {
  int choice = 0;
  while (choice < 8 && (count != 3 || arguments[1] != std::string(choices[choice]))) ++choice;
  if (choice == 8) {
    std::fprintf(stderr, "usage: count_instructions SCENE COLLISIONS\nscenes:");
    for (const char* name : choices) std::fprintf(stderr, " %s", name);
    std::fprintf(stderr, "\n");
    return 2;
  }
  const Scene scene = scene_with(choice);
  const std::unique_ptr<Simulation> simulation = simulate(scene);
  simulation->advance_to(3);
  std::optional<FlightObserver> observer;
  if (choice == 7) {
    observer.emplace(scene, simulation->properties(), LayerGrid{-1, 0.5, 200});
    simulation->watch(&*observer);
    observer->begin(simulation->time());
  }
  const std::uint64_t before = simulation->counters().collisions();
  measured(*simulation, std::strtoull(arguments[2], nullptr, 10), observer ? &*observer : nullptr);
  std::printf("%llu\n", static_cast<unsigned long long>(simulation->counters().collisions() - before));
}
