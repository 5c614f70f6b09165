// Distribution of the velocities, from snapshots: means and temperatures by height and phase, fourth cumulants, and a
// histogram. Reduced units.
//
// An observer owns its sums and keeps nothing of the scene. One thread at a time may use one; different ones share
// nothing.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/measure/flights.hpp"
#include "sim/measure/statistics.hpp"

namespace shakebed::sim {

// Sums of powers of velocities, masses as weights, from which means, temperatures and cumulants follow.
struct VelocityMoments {
  double count = 0, mass = 0;
  double vx = 0, vz = 0;    // m v
  double vx2 = 0, vz2 = 0;  // m v^2
  double spin = 0;          // I w^2
  double xx = 0, xxxx = 0;  // v_x^2, v_x^4 without masses, for cumulants: u = sqrt(m) v
  double z1 = 0, z2 = 0, z3 = 0, z4 = 0, xxz = 0, xxzz = 0;
  void add(double mass_of_disk, double velocity_x, double velocity_z, double spin_energy);
  void add(const VelocityMoments& other);
  double mean_vx() const { return mass > 0 ? vx / mass : 0; }
  double mean_vz() const { return mass > 0 ? vz / mass : 0; }
  double temperature_x() const { return count > 0 ? (vx2 - (mass > 0 ? vx * vx / mass : 0)) / count : 0; }
  double temperature_z() const { return count > 0 ? (vz2 - (mass > 0 ? vz * vz / mass : 0)) / count : 0; }
  double spin_temperature() const { return count > 0 ? spin / count : 0; }
  // Means of c^2 and c^4, c = sqrt(m) v without the mean of sqrt(m) v_z (its x mean is 0 by symmetry).
  double square() const;
  double fourth() const;
};

// a2 = <c^4>/(2 <c^2>^2) - 1 in two dimensions [vanNoijeErnst1998]: 0 for a Maxwellian.
inline double fourth_cumulant(double mean_square, double mean_fourth) {
  return mean_square > 0 ? mean_fourth / (2 * mean_square * mean_square) - 1 : 0;
}

class VelocityObserver {
 public:
  // floor_frame: heights above the moving floor and velocities relative to it.
  VelocityObserver(const Scene& scene, const DiskProperties& disks, std::uint32_t phases, const LayerGrid& layers,
                   bool floor_frame);
  void observe(const Snapshot& at, std::uint32_t phase);

  // Of all disks; of the whole bed's velocities, its mean v_z at each moment taken away.
  Measured fourth_cumulant_of_all() const;
  // The same from <c^4> and <c^2>^2 layer by layer and phase by phase, weighted by the number of disks. So a bed whose
  // T varies is not mistaken for a bed with velocities that are not Gaussian.
  double fourth_cumulant_local() const;

  const LayerGrid& grid() const { return grid_; }
  std::uint32_t phases() const { return phases_; }
  std::uint64_t snapshots() const { return snapshots_; }
  const VelocityMoments& cell(std::uint32_t phase, std::size_t layer) const {
    return cells_[phase * grid_.count + layer];
  }
  VelocityMoments layer(std::size_t layer) const;  // all phases
  double height(std::size_t layer) const { return grid_.lowest + (static_cast<double>(layer) + 0.5) * grid_.thickness; }
  // Of the disks in a layer, 1/D^2, at one phase or over all.
  double number_density(const VelocityMoments& moments, bool one_phase) const;

  // Histograms of sqrt(m) v / sqrt(T), T that of the first snapshot: density of v_x and of v_z (without the bed's
  // mean).
  static constexpr int histogram_bins = 161;  // 0.1 wide, from -8.05 to 8.05; what lies beyond counts in the last ones
  double histogram_unit() const { return histogram_unit_; }  // sqrt(T)
  double histogram_place(int bin) const { return (bin - histogram_bins / 2) * 0.1; }
  double histogram_x(int bin) const;
  double histogram_z(int bin) const;

  template <class Archive>
  void visit(Archive& archive) {
    archive(cells_, snapshots_, powers_, histogram_unit_, histogram_x_, histogram_z_);
  }

 private:
  double width_;
  std::vector<double> masses_, inertias_;
  std::uint32_t phases_;
  LayerGrid grid_;
  bool floor_frame_;
  std::vector<VelocityMoments> cells_;
  std::uint64_t snapshots_ = 0;
  CorrelatedMeans powers_;  // <c^2>, <c^4> of each snapshot
  double histogram_unit_ = 0;
  std::vector<double> histogram_x_, histogram_z_;
};

// Mean square displacements over lags of 1, 2, 4, ... samples. The origins are one lag apart: independent enough for
// their spread to be an error. Memory: N numbers per lag. Displacements are followed across periodic sides. So the time
// between samples must be shorter than the time in which a disk crosses half the box.
class DisplacementObserver {
 public:
  DisplacementObserver(const Scene& scene, std::size_t disks);
  void observe(const Snapshot& at);  // at equal times

  struct Lag {
    std::uint64_t looks;
    Measured x, z;  // <dx^2>, <dz^2> [D^2]
    std::uint64_t origins;
  };
  std::vector<Lag> lags() const;

  template <class Archive>
  void visit(Archive& archive) {
    archive(looks_, x_, z_, last_x_, last_z_, levels_);
  }

 private:
  struct Level {
    std::vector<double> x, z;  // where the disks were at the last origin
    CorrelatedMeans squares{2};
    template <class Archive>
    void visit(Archive& archive) {
      archive(x, z, squares);
    }
  };
  double period_x_ = 0, period_z_ = 0;
  std::uint64_t looks_ = 0;
  std::vector<double> x_, z_;  // followed across the sides
  std::vector<double> last_x_, last_z_;
  std::vector<Level> levels_;
};

}  // namespace shakebed::sim
