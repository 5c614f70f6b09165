#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "fit/profile_fit/fit_profile.hpp"
#include "fit/theory/equation_of_state.hpp"
#include "fit/theory/expansion.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/measure/observables.hpp"

// Elastic disks on a still floor between periodic sides, each redrawn from the Maxwellian at T at random moments: a bed
// whose temperature is known because it was set. Nothing of the equations of state under test enters.
namespace shakebed::fit::simulated {

// A hexagonal bed of 20 disks a row and mu of nearly 20; the width leaves 1 % for the crystal's thermal expansion.
struct Bed {
  std::uint32_t count = 462;
  double width = 20.2;  // [D]
  [[nodiscard]] Column column() const { return {count / width, close_packing_density}; }
  [[nodiscard]] double mu() const { return count / width / close_packing_density; }
  [[nodiscard]] double critical() const { return critical_temperature(enskog(), column()).value; }
};
// The hexagonal bed's rows begin on the floor at z = 1/2: a row of phi_0 is sqrt(3)/2 D high.
inline constexpr double bed_base = 0.5 - 0.43301270189221932;

struct BedRun {
  Bed bed;
  double temperature = 0;  // [m g D]
  double settle = 100, interval = 1;
  int frames = 100;
  std::uint64_t seed = 1;
  double spacing = 1;  // of the profile's points [D]
  Kernel kernel{KernelKind::top_hat, 1};
  double rate = 0.3;  // of the bath
};

// Profiles of single frames, from the floor to the highest disk of any of them. `look` sees each snapshot.
template <class Look>
ProfileFrames profiles_of(const BedRun& run, Look&& look) {
  sim::Scene scene;
  scene.gravity = sim::UniformGravity{};
  scene.disks.species = {{run.bed.count, 1, 1}};
  scene.box.width = run.bed.width;
  scene.box.sides = sim::PeriodicSides{};
  scene.bath = sim::AndersenBath{run.temperature, run.rate};
  scene.start_temperature = run.temperature;
  scene.seed = run.seed;
  const auto simulation = sim::simulate(scene);
  const auto points = static_cast<std::size_t>((60 + 12 * run.temperature) / run.spacing);
  const HeightGrid grid{0.5 * run.spacing, run.spacing, points};
  ProfileFrames frames;
  for (std::size_t i = 0; i < points; ++i) frames.height.push_back(grid.height(i));
  frames.number_density.assign(points * static_cast<std::size_t>(run.frames), 0.0);
  std::vector<double> density(points);
  sim::Snapshot at;
  for (int frame = 0; frame < run.frames; ++frame) {
    simulation->advance_to(run.settle + run.interval * (frame + 1));
    simulation->snapshot(at);
    std::fill(density.begin(), density.end(), 0.0);
    add_density(grid, run.kernel, run.bed.width, at.z, 0.0, density);
    std::copy(density.begin(), density.end(),
              frames.number_density.begin() + static_cast<std::ptrdiff_t>(points) * frame);
    look(at);
  }
  return frames;
}
inline ProfileFrames profiles_of(const BedRun& run) {
  return profiles_of(run, [](const sim::Snapshot&) {});
}

}  // namespace shakebed::fit::simulated
