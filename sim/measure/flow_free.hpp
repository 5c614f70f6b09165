// Kinetic temperatures without the mean motion of each layer at each moment, as a film of a bed gives them. What whole
// layers do together is no temperature here: neither the bounce of a bed, which may differ from period to period, nor
// its sloshing from side to side. Reduced units.
//
// An observer owns its sums and keeps nothing of the scene. One thread at a time may use one; different ones share
// nothing.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/measure/statistics.hpp"

namespace shakebed::sim {

class FlowFreeTemperature {
 public:
  // `phases`: snapshots a period.
  FlowFreeTemperature(const DiskProperties& disks, std::uint32_t phases) : mass_(disks.mass), phases_(phases) {}

  // The snapshot at the given phase, 0 <= phase < phases.
  void observe(const Snapshot& at, std::uint32_t phase);
  // m <(v - u)^2> of one component; u is the mean of the layer of 1 D at that moment. Of n disks in a layer n - 1 are
  // free; layers of fewer than three are left out. The error is by periods.
  Measured x() const { return {mean_.mean(0), mean_.std_error(0)}; }
  Measured z() const { return {mean_.mean(1), mean_.std_error(1)}; }

  template <class Archive>
  void visit(Archive& archive) {
    archive(period_sum_, period_looks_, mean_);
  }

 private:
  struct Layer {
    double disks = 0, mass = 0;
    std::array<double, 2> momentum{}, energy{};  // sums of m v and m v^2
  };
  std::vector<double> mass_;
  std::uint32_t phases_;
  std::array<double, 2> period_sum_{};
  std::uint32_t period_looks_ = 0;
  CorrelatedMeans mean_{2};
  std::vector<Layer> layers_;  // kept to save allocations
};

// The same of the displacements from look to look over the time between them, as of the frames of a film. It is
// smaller, since disks collide meanwhile.
class FlowFreeDisplacement {
 public:
  // `phases`: looks a period, all of which are to be given. A displacement is of the period in which it ends.
  FlowFreeDisplacement(const Scene& scene, const DiskProperties& disks, std::uint32_t phases);

  void observe(const Snapshot& at, std::uint32_t phase);
  Measured x() const { return temperature_.x(); }
  Measured z() const { return temperature_.z(); }

  template <class Archive>
  void visit(Archive& archive) {
    archive(temperature_, before_.time, before_.x, before_.z);
  }

 private:
  FlowFreeTemperature temperature_;
  double period_x_ = 0;  // 0: walls
  Snapshot before_;      // the last look; no disks: there was none
};

}  // namespace shakebed::sim
