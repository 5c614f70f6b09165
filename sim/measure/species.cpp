#include "sim/measure/species.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace shakebed::sim {

bool has_two_species(const Scene& scene) {
  const std::vector<Species>& species = scene.disks.species;
  return species.size() == 2 && (species[0].diameter != species[1].diameter || species[0].mass != species[1].mass);
}

SpeciesObserver::SpeciesObserver(const Scene& scene, const DiskProperties& disks, std::uint32_t phases,
                                 const LayerGrid& layers)
    : width_(scene.box.width), masses_(disks.mass), grid_(layers), cells_(2 * layers.count), powers_(2, phases) {
  assert(has_two_species(scene));
  const Species& one = scene.disks.species[first];
  for (std::size_t i = 0; i < masses_.size(); ++i)
    species_.push_back(disks.radius[i] != one.diameter / 2 || disks.mass[i] != one.mass);
}

void SpeciesObserver::observe(const Snapshot& at) {
  assert(at.vx.size() == masses_.size());
  std::array<VelocityMoments, 2> all;
  for (std::size_t i = 0; i < masses_.size(); ++i) {
    const double place = std::floor((at.z[i] - grid_.lowest) / grid_.thickness);
    const auto layer = static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(grid_.count - 1)));
    cells_[2 * layer + species_[i]].add(masses_[i], at.vx[i], at.vz[i], 0);
    all[species_[i]].add(masses_[i], at.vx[i], at.vz[i], 0);
  }
  std::array<double, 2> temperatures{};
  for (std::size_t s = 0; s < 2; ++s) {
    const VelocityMoments& m = all[s];
    // Of n velocities about their own mean n - 1 are free.
    const double upwards = m.count > 1 ? (m.vz2 - m.vz * m.vz / m.mass) / (m.count - 1) : 0;
    temperatures[s] = m.count > 0 ? (m.vx2 / m.count + upwards) / 2 : 0;
  }
  powers_.add(temperatures);
  ++snapshots_;
}

Measured SpeciesObserver::temperature_ratio() const {
  const double one = powers_.mean(first), two = powers_.mean(second);
  if (!(one > 0)) return {NAN, NAN};
  const double gradient[] = {-two / (one * one), 1 / one};
  return propagated(two / one, gradient, powers_.covariance(0, 2, powers_.windows(0, 2)));
}

double SpeciesObserver::number_density(std::size_t layer, std::size_t species) const {
  if (snapshots_ == 0) return 0;
  return cell(layer, species).count / (static_cast<double>(snapshots_) * width_ * grid_.thickness);
}

double SpeciesObserver::layer_temperature(std::size_t layer, std::size_t species) const {
  const VelocityMoments& moments = cell(layer, species);
  return (moments.temperature_x() + moments.temperature_z()) / 2;
}

}  // namespace shakebed::sim
