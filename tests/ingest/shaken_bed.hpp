#pragma once
// A bed on a shaking floor, of which tests make films whose truth is known.

#include <cstdint>
#include <numbers>

#include "sim/scene/scene.hpp"

namespace shakebed::ingest {

// Reduced units; hard sides.
struct ShakenBed {
  double gamma = 3, restitution = 0.9, friction = 0, frequency = 0.37, width = 17.3;
  std::uint32_t count = 240;
  std::uint64_t seed = 92;

  [[nodiscard]] double amplitude() const {
    const double angular = 2 * std::numbers::pi * frequency;
    return gamma / (angular * angular);
  }
};

inline sim::Scene shaken_bed(const ShakenBed& bed) {
  const sim::Surface contact{.restitution = bed.restitution, .friction = bed.friction};
  sim::Scene scene;
  scene.gravity = sim::UniformGravity{};
  scene.disks = {.species = {{.count = bed.count}}, .contact = contact, .contact_duration = 1e-4};
  scene.box.width = bed.width;
  scene.box.sides = sim::HardSides{contact};
  scene.box.floor = sim::SinusoidalFloor{.amplitude = bed.amplitude(), .frequency = bed.frequency};
  scene.box.floor_surface = contact;
  scene.seed = bed.seed;
  return scene;
}

}  // namespace shakebed::ingest
