// Crystalline order of a bed, from snapshots: bond-orientational order, neighbours, empty sites.
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

// Neighbours are disks whose centres are closer than this many contact distances: half way between the first and the
// second neighbours of the hexagonal crystal, (1 + sqrt 3)/2.
inline constexpr double neighbour_reach = 1.3660254037844386;

// Of one snapshot; index = disk.
struct BondOrder {
  std::vector<std::uint8_t> neighbours;
  std::vector<double> psi6_re,
      psi6_im;  // psi_6 = mean over neighbours of exp(6 i angle) [HalperinNelson1978]; 0 without any
  // Vacancies: sites where a disk of the largest size is missing. A site is a contact distance away from a disk. No
  // centre is closer to it than 0.8 of that distance, and at least five centres are within reach. The surface has none:
  // a site there has at most four.
  std::vector<double> vacancy_x, vacancy_z;
};
// period_x, period_z: 0 where the box is not periodic.
BondOrder bond_order(const Snapshot& at, const DiskProperties& disks, double period_x, double period_z);

// Averages over snapshots.
class OrderObserver {
 public:
  // `phases`: snapshots a period.
  OrderObserver(const Scene& scene, const DiskProperties& disks, std::uint32_t phases, const LayerGrid& layers);
  void observe(const Snapshot& at);

  Measured psi6_local() const { return {means_.mean(0), means_.std_error(0)}; }   // mean over disks of |psi_6|
  Measured psi6_global() const { return {means_.mean(1), means_.std_error(1)}; }  // |mean over disks of psi_6|
  Measured neighbours_per_disk() const { return {means_.mean(2), means_.std_error(2)}; }
  Measured vacancies() const { return {means_.mean(3), means_.std_error(3)}; }
  struct Layer {
    double height, psi6_local, neighbours, share;  // share of the disks
  };
  std::vector<Layer> layers() const;  // those that held a disk

  // Rows of disks above the (moving) floor, from the lowest up, as far as the valleys of the density between them stay
  // below 0.8 of its peaks. Not the surface, which has no valley above it; rows above row_reach are not looked for.
  struct Row {
    double height, disks;  // mean height of its centres in D; disks in it
  };
  static constexpr double row_reach = 256;  // D
  std::vector<Row> rows() const;
  // Number density of the bottom of the bed, from its three lowest rows: disks a row over width and distance of rows.
  // 2/sqrt 3 in close packing. NaN with fewer than three rows.
  double bottom_density() const;

  template <class Archive>
  void visit(Archive& archive) {
    archive(means_, layers_, looks_, bins_);
  }

 private:
  struct LayerSums {
    double count = 0, psi6 = 0, neighbours = 0;
  };
  DiskProperties disks_;
  double period_x_ = 0, period_z_ = 0;
  LayerGrid grid_;
  CorrelatedMeans means_;
  std::vector<LayerSums> layers_;
  double width_ = 0;
  std::uint64_t looks_ = 0;
  struct Bin {
    double disks = 0, heights = 0;  // sum of their heights: a cold row is far narrower than a bin
  };
  std::vector<Bin> bins_;  // of the centres' heights above the floor, row_bin each from 0
};

}  // namespace shakebed::sim
