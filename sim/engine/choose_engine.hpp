// Where a scene becomes one of the specialised engines. Offered: which of them a program holds, since each is compiled;
// a scene that needs another is refused. run_scene.cpp holds all.
#pragma once

#include <algorithm>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <variant>
#include <vector>

#include "sim/engine/engine.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/engine/start.hpp"

namespace shakebed::sim {

// All of them: 4 spaces x 3 rules x 2 sizes but for three, and one for cells with sloped sides or a free lid, with the
// most general rule.
struct EveryEngine {
  static constexpr bool weightless = true, two_sizes = true, cells = true;
};

// The cheapest rule that does what every surface of the scene asks for.
struct Needs {
  bool dissipates = false, spins = false;
  void add(const Surface& s) {
    dissipates = dissipates || s.restitution < 1;
    spins = spins || s.friction > 0;
  }
};

inline Needs needs_of(const Scene& scene) {
  Needs needs;
  needs.add(scene.disks.contact);
  needs.add(scene.box.floor_surface);
  if (const auto* sides = std::get_if<HardSides>(&scene.box.sides)) needs.add(sides->surface);
  if (const auto* lid = std::get_if<Lid>(&scene.box.top)) needs.add(lid->surface);
  return needs;
}

template <class Offered>
class ChooseEngine {
 public:
  explicit ChooseEngine(const Scene& scene)
      : scene_(scene),
        disks_(place_disks(scene)),
        floor_(std::visit([](const auto& kind) { return FloorMotion(kind); }, scene.box.floor)) {}

  std::unique_ptr<Simulation> operator()() const {
    if (is_cell()) {
      if constexpr (Offered::cells)
        return std::make_unique<Engine<CellBox, RoughRule, TwoSizes>>(scene_, floor_, disks_);
      throw std::invalid_argument("/box: this program was built without the engine for sloped sides and free lids");
    }
    const bool periodic_sides = std::holds_alternative<PeriodicSides>(scene_.box.sides);
    if (std::holds_alternative<UniformGravity>(scene_.gravity))
      return periodic_sides ? with_rule<PeriodicSidesBox>() : with_rule<HardBox>();
    if constexpr (Offered::weightless) {
      if (std::holds_alternative<PeriodicTop>(scene_.box.top)) return with_rule<PeriodicSpace>();
      return with_rule<WeightlessBox>();
    }
    throw std::invalid_argument("/gravity: this program was built without the engine for scenes without gravity");
  }

 private:
  bool is_cell() const {
    const auto* sides = std::get_if<HardSides>(&scene_.box.sides);
    const auto* lid = std::get_if<Lid>(&scene_.box.top);
    return (sides != nullptr && sides->slope > 0) || (lid != nullptr && lid->is_free());
  }

  template <class Space>
  std::unique_ptr<Simulation> with_rule() const {
    const Needs needs = needs_of(scene_);
    if (needs.spins) return with_sizes<Space, RoughRule>();
    if (needs.dissipates) return with_sizes<Space, DissipativeRule>();
    // Elastic disks of two sizes between walls are rare. They take the rule of dissipation: the same bytes, with 1.9 %
    // more instructions a collision.
    if constexpr (Space::has_walls) {
      if (!equal_sizes()) return with_sizes<Space, DissipativeRule>();
      return std::make_unique<Engine<Space, ElasticRule, EqualSizes>>(scene_, floor_, disks_);
    } else {
      return with_sizes<Space, ElasticRule>();
    }
  }

  bool equal_sizes() const {
    return std::all_of(scene_.disks.species.begin(), scene_.disks.species.end(),
                       [](const Species& s) { return s.diameter == 1 && s.mass == 1; });
  }

  template <class Space, class Rule>
  std::unique_ptr<Simulation> with_sizes() const {
    if (equal_sizes()) return std::make_unique<Engine<Space, Rule, EqualSizes>>(scene_, floor_, disks_);
    if constexpr (Offered::two_sizes) return std::make_unique<Engine<Space, Rule, TwoSizes>>(scene_, floor_, disks_);
    throw std::invalid_argument("/disks: this program was built without the engine for two sizes of disks");
  }

  const Scene& scene_;
  std::vector<Placed> disks_;
  FloorMotion floor_;
};

// simulate() of a program that holds these engines.
template <class Offered>
std::unique_ptr<Simulation> simulate_with(const Scene& scene) {
  const std::vector<SceneProblem> problems = check(scene);
  if (!problems.empty()) {
    std::ostringstream out;
    for (const SceneProblem& p : problems) out << p.where << ": " << p.what << "\n";
    throw std::invalid_argument(out.str());
  }
  return ChooseEngine<Offered>(scene)();
}

}  // namespace shakebed::sim
