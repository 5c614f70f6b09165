// Exact averages over time along the disks' trajectories, and the pressure by height: what snapshots cannot give. Costs
// about as much as the run itself; a run without this watcher pays nothing. Reduced units, lab frame, gravity.
//
// The watcher owns its sums and belongs to the thread that runs the simulation; it must outlive the run.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/measure/statistics.hpp"

namespace shakebed::sim {

struct LayerGrid {
  double lowest = 0, thickness = 0.25;  // layer i: from lowest + i thickness, in D
  std::size_t count = 0;
};

// Between two events every disk flies on a parabola. So the time it spends in a layer and the integrals of its momentum
// and kinetic energy there are known in closed form. Density, temperatures and kinetic pressure are integrals over all
// time, not sums over samples. The contacts' part of the pressure is that of [IrvingKirkwood1950]. Each transferred
// momentum counts in the layers that the line from centre to centre (or to the floor) crosses, in proportion. The
// momentum balance P_zz(z) = weight above z then holds exactly in the mean over a long time.
class FlightObserver final : public Watcher {
 public:
  FlightObserver(const Scene& scene, const DiskProperties& disks, const LayerGrid& layers);

  void flies(double time, std::uint32_t disk, double x, double z, double vx, double vz) override;
  void touched(double time, double x, double z, double dx, double dz, double px, double pz) override;
  void pressed(double time, double x, double z, double dx, double dz, double px, double pz) override;
  void touched_wall(double time, std::uint32_t disk, bool floor, double z, double px, double pz) override;

  // Counts from this time on; call after Simulation::watch(), at the time when the simulation stands.
  void begin(double time);
  // Ends a block of the means, say a period of the floor, and begins the next. Errors come from the blocks.
  void end_block(double time);

  struct Layer {
    double height;                          // of its middle [D]
    Measured number_density;                // [1/D^2]
    Measured temperature_x, temperature_z;  // m <v^2>, the second without the layer's mean velocity [m g D]
    Measured mean_velocity_z;
    Measured pressure_zz, pressure_xx;  // [m g/D]
    Measured weight_above;              // mean over the layer of what lies above, a unit of width [m g/D]
    Measured collision_rate;            // contacts of two disks a unit of area and time
  };
  std::vector<Layer> layers() const;  // from the lowest to the highest in which a disk has been
  Measured floor_pressure() const;    // mean force on the floor a unit of width
  std::uint64_t blocks() const { return means_.samples(); }

  template <class Archive>
  void visit(Archive& archive) {
    archive(flights_, sums_, floor_momentum_, block_start_, means_);
  }

 private:
  struct Flight {
    double time = 0, z = 0, vx = 0, vz = 0;
  };
  struct Sums {                   // over a block and a layer; masses are weights
    double time = 0, height = 0;  // integrals of m and of m (z - bottom) over time
    double count = 0;             // integral of 1
    double kinetic_x = 0, kinetic_z = 0, momentum_z = 0;
    double contacts_xx = 0, contacts_zz = 0, contacts = 0;
  };
  // Means over a block, layer by layer.
  enum Quantity : std::size_t {
    density,
    mass_density,
    energy_x,
    energy_z,
    momentum,
    p_xx,
    p_zz,
    weight,
    rate,
    quantities
  };

  void fly(std::uint32_t disk, double until);
  void fly_one_way(double mass, double z, double vx, double v_from, double v_to, double duration);
  void count_layer(std::size_t layer, double mass, double z, double vx, double v_from, double v_to, double duration);
  void hand_on(double z, double dz, double xx, double zz);
  std::size_t layer_of(double z) const;
  double bottom(std::size_t layer) const { return grid_.lowest + static_cast<double>(layer) * grid_.thickness; }

  double width_, gravity_;
  std::vector<double> masses_, radii_;
  LayerGrid grid_;
  std::vector<Flight> flights_;
  std::vector<Sums> sums_;
  double floor_momentum_ = 0;
  double block_start_ = 0;
  CorrelatedMeans means_;
};

}  // namespace shakebed::sim
