// The one place where a scene becomes a specialised engine: 4 spaces x 3 rules x 2 sizes.
// implements: sim/engine/simulation.hpp
#include <sstream>
#include <stdexcept>

#include "sim/engine/engine.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/engine/start.hpp"

namespace shakebed::sim {

namespace {

template <class Space, class Rule>
std::unique_ptr<Simulation> with_sizes(const Scene& scene, const FloorMotion& floor, const std::vector<Placed>& disks) {
  bool equal = true;
  for (const Species& s : scene.disks.species) equal = equal && s.diameter == 1 && s.mass == 1;
  if (equal) return std::make_unique<Engine<Space, Rule, EqualSizes>>(scene, floor, disks);
  return std::make_unique<Engine<Space, Rule, TwoSizes>>(scene, floor, disks);
}

// The cheapest rule that does what every surface of the scene asks for.
struct Needs {
  bool dissipates = false, spins = false;
  void add(const Surface& s) {
    dissipates = dissipates || s.restitution < 1;
    spins = spins || s.friction > 0;
  }
};

Needs needs_of(const Scene& scene) {
  Needs needs;
  needs.add(scene.disks.contact);
  needs.add(scene.box.floor_surface);
  if (const auto* sides = std::get_if<HardSides>(&scene.box.sides)) needs.add(sides->surface);
  if (const auto* lid = std::get_if<Lid>(&scene.box.top)) needs.add(lid->surface);
  return needs;
}

template <class Space>
std::unique_ptr<Simulation> with_rule(const Scene& scene, const FloorMotion& floor, const std::vector<Placed>& disks) {
  const Needs needs = needs_of(scene);
  if (needs.spins) return with_sizes<Space, RoughRule>(scene, floor, disks);
  if (needs.dissipates) return with_sizes<Space, DissipativeRule>(scene, floor, disks);
  return with_sizes<Space, ElasticRule>(scene, floor, disks);
}

}  // namespace

std::unique_ptr<Simulation> simulate(const Scene& scene) {
  const std::vector<SceneProblem> problems = check(scene);
  if (!problems.empty()) {
    std::ostringstream out;
    for (const SceneProblem& p : problems) out << p.where << ": " << p.what << "\n";
    throw std::invalid_argument(out.str());
  }
  const std::vector<Placed> disks = place_disks(scene);
  const FloorMotion floor = std::visit([](const auto& kind) { return FloorMotion(kind); }, scene.box.floor);
  const bool periodic_sides = std::holds_alternative<PeriodicSides>(scene.box.sides);
  if (std::holds_alternative<UniformGravity>(scene.gravity)) {
    return periodic_sides ? with_rule<PeriodicSidesBox>(scene, floor, disks) : with_rule<HardBox>(scene, floor, disks);
  }
  if (std::holds_alternative<PeriodicTop>(scene.box.top)) return with_rule<PeriodicSpace>(scene, floor, disks);
  return with_rule<WeightlessBox>(scene, floor, disks);
}

}  // namespace shakebed::sim
