// What is measured of a running bed, from snapshots at equally spaced phases of the shaking. Reduced units.
//
// An observer owns its sums and keeps nothing of the scene. One thread at a time may use one; different ones share
// nothing.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/measure/statistics.hpp"
#include "statistics/kernel.hpp"

namespace shakebed::sim {

struct Profile {
  std::vector<double> height;          // D, above the floor's mean position (or the floor itself)
  std::vector<double> number_density;  // phi = n D^2
  std::vector<double> std_error;       // allows for correlation in time
  std::vector<double> area_fraction;   // covered, by each disk's own area
  std::uint64_t samples = 0;           // snapshots
};

// Height of the centre of mass of count equal disks packed hexagonally on a floor at 0. The rows hold floor(width)
// disks. In a hard box every second row has one disk less where half a diameter is missing.
double ideal_centre_of_mass(std::uint32_t count, double width, bool hard_sides);
double ideal_centre_of_mass(const Scene& scene);

// Why the run has lost its precision, for instance "two disks overlap by 3e-7 D ..."; empty if it has not. Precise
// means: all numbers are finite, no overlap exceeds that of the bed, and the energy balance closes to 1e-6 of the
// energy moved.
std::string precision_lost(const Simulation& simulation);

// Collects snapshots taken at `phases` moments of each period, in order, and averages over whole periods.
class BedObserver {
 public:
  BedObserver(const Scene& scene, const DiskProperties& disks, std::uint32_t phases, const HeightGrid& grid,
              const Kernel& kernel);

  // The snapshot at the given phase, 0 <= phase < phases; phase 0 begins a period.
  void observe(const Snapshot& at, std::uint32_t phase);

  std::uint64_t periods() const { return periods_; }
  Profile density(bool floor_frame) const;
  // Covariance of the lab frame's densities, points first to last-1 of the grid, row by row.
  std::vector<double> density_covariance(std::size_t first, std::size_t last) const {
    return means_.covariance(first, last, density_windows());
  }
  std::size_t covariance_blocks() const { return density_windows().independent; }
  Measured centre_of_mass() const;
  Measured temperature_x() const;        // m <v_x^2>
  Measured temperature_z() const;        // of v_z without the bed's mean velocity at each phase
  Measured temperature_z_local() const;  // without the mean velocity of each layer of 1 D at each phase
  Measured spin_temperature() const;     // I <w^2>; 0 for smooth disks
  // P V/(N T) = 1 + virial rate/(2 N T) of a box that is periodic both ways. T is from the kinetic energy of the N - 1
  // free momenta. `virial_rate`: of the contacts, per unit of time.
  Measured compressibility_factor(const Measured& virial_rate) const;
  // The second half of the periods less the first: what still changes while the bed is measured. The error is not a
  // number with fewer than four periods.
  Measured drift_of_centre() const;
  Measured drift_of_temperature_x() const;
  // Number density in the lowest row: centres between (1/2 -+ sqrt(3)/4) D above the moving floor. 2/sqrt 3 when every
  // site of a packed row is taken (between hard sides up to half a disk less).
  Measured bottom_row_density() const;
  struct Layer {  // by height, layers of 1 D
    double height, temperature_x, temperature_z, mean_velocity_z;
    double share;  // of the disks
    double spin_temperature;
  };
  std::vector<Layer> layers() const;
  std::vector<double> centre_of_mass_by_phase() const;

  template <class Archive>
  void visit(Archive& archive) {
    archive(periods_, period_sum_, area_sums_, means_, centre_series_, temperature_series_, mean_vz_, mean_vz2_,
            mean_mass_, centre_by_phase_, layers_);
  }

 private:
  struct LayerSums {
    double count = 0, mass = 0, vx2 = 0, vz = 0, vz2 = 0;  // velocities weighted with the masses
    double spin = 0;                                       // I w^2
  };
  statistics::Windows density_windows() const { return means_.windows(0, grid_.points); }
  void add_area(const Snapshot& at);
  struct Size {
    double area;
    std::vector<std::size_t> disks;
  };
  const LayerSums& layer(std::uint32_t phase, std::size_t index) const { return layers_[phase * layer_count_ + index]; }

  double width_;
  std::vector<double> masses_;
  std::vector<double> inertias_;  // I of each disk
  std::vector<Size> sizes_;       // disks by their size
  std::uint32_t phases_;
  HeightGrid grid_;
  Kernel kernel_;
  std::size_t layer_count_;
  double layer_bottom_;
  std::uint64_t periods_ = 0;
  std::vector<double> period_sum_;  // lab profile, floor profile, then scalars: see observe()
  std::vector<double> area_sums_;   // of covered fractions, lab and floor profile; none where all disks are of one size
  CorrelatedMeans means_;
  std::vector<double> centre_series_, temperature_series_;  // a value a period
  std::vector<double> mean_vz_, mean_vz2_;                  // a value a phase and period; the second with the mass
  double mean_mass_ = 1;
  std::vector<double> centre_by_phase_;
  std::vector<LayerSums> layers_;
};

}  // namespace shakebed::sim
