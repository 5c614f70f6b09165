// Temperatures of the two species of a bed, of the whole and by height, from snapshots: granular gases do not share
// their energy equally [FeitosaMenon2002]. Reduced units.
//
// An observer owns its sums and keeps nothing of the scene. One thread at a time may use one; different ones share
// nothing.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/measure/statistics.hpp"
#include "sim/measure/velocities.hpp"

namespace shakebed::sim {

// Whether the disks are of two species that can be known apart, by diameter or mass.
bool has_two_species(const Scene& scene);

class SpeciesObserver {
 public:
  static constexpr std::size_t first = 0, second = 1;

  // `phases`: snapshots a period.
  SpeciesObserver(const Scene& scene, const DiskProperties& disks, std::uint32_t phases, const LayerGrid& layers);
  void observe(const Snapshot& at);

  // Half the sum of <m v_x^2> and of the variance of v_z times m about the species' mean at the moment.
  Measured temperature(std::size_t species) const { return {powers_.mean(species), powers_.std_error(species)}; }
  // That of the second species over that of the first. NaN where the first has none.
  Measured temperature_ratio() const;

  const LayerGrid& grid() const { return grid_; }
  double height(std::size_t layer) const { return grid_.lowest + (static_cast<double>(layer) + 0.5) * grid_.thickness; }
  const VelocityMoments& cell(std::size_t layer, std::size_t species) const { return cells_[2 * layer + species]; }
  double number_density(std::size_t layer, std::size_t species) const;  // 1/D^2
  // Half the sum of both directions, without the mean velocity of species and layer.
  double layer_temperature(std::size_t layer, std::size_t species) const;

  template <class Archive>
  void visit(Archive& archive) {
    archive(cells_, snapshots_, powers_);
  }

 private:
  double width_;
  std::vector<double> masses_;
  std::vector<std::uint8_t> species_;  // of each disk
  LayerGrid grid_;
  std::vector<VelocityMoments> cells_;  // layer by layer, both species
  std::uint64_t snapshots_ = 0;
  CorrelatedMeans powers_;  // temperature of each species at each moment
};

}  // namespace shakebed::sim
