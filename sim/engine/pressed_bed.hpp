// prototype
#pragma once
#include <cstdint>
#include <vector>
#include "sim/engine/floor_motion.hpp"
#include "sim/engine/lanes.hpp"
#include "sim/scene/surface.hpp"

namespace shakebed::sim {

struct alignas(32) PressedDisk {
  double x, z, vx, vz;
};

class PressedBed {
 public:
  struct Box {
    double width = 0, period = 0;  // period 0: hard sides
    double lid = 0;
  };
  struct Spring {
    double stiffness = 0, damping = 0;  // of reduced mass 1
  };
  void set_up(const Box& box, const Surface& disks, const Surface& sides, const Surface& floor, const Surface& lid,
              double contact_time, double step);
  void begin(std::vector<PressedDisk> disks, const FloorMotion& floor, double now);
  void step(const FloorMotion& floor, double now, double dt);  // from now to now + dt
  const std::vector<PressedDisk>& disks() const { return disks_; }
  PressedDisk at(std::uint32_t i, double later) const {
    const PressedDisk& d = disks_[i];
    const double ax = force_[2 * i], az = force_[2 * i + 1] - 1;
    return {d.x + (d.vx + 0.5 * ax * later) * later, d.z + (d.vz + 0.5 * az * later) * later, d.vx + ax * later,
            d.vz + az * later};
  }
  double stored() const;  // in springs
  double largest_overlap() const;
  std::uint32_t touching() const;
  void separate(double floor);

  void soften(double contact_time);
  double contact_time() const { return contact_time_; }
  double approach() const;  // rms of touching
  double floor_work = 0, damped = 0;
  double floor_force = 0;
  std::uint64_t active_total = 0, rebuilds = 0, steps = 0;

 private:
  void list_pairs(double floor);
  template <bool periodic>
  void pair_forces();
  void forces(double floor, double floor_velocity);
  void wall(std::vector<std::uint32_t>& near, double nx, double nz, double at, double wall_v, const Spring& s,
            bool is_floor);

  Box box_;
  Spring pair_, side_, floor_, lid_;
  double skin_ = 0.08;
  std::uint32_t count_ = 0;
  std::vector<PressedDisk> disks_;  // and two sentinels
  std::vector<double> force_, next_;
  std::vector<double> listed_x_, listed_z_;  // where they were when listed; z above the floor
  std::vector<std::uint32_t> first_, second_, active_first_, active_second_;
  void choose_active(double dt, double fastest);
  std::vector<std::uint32_t> near_left_, near_right_, near_floor_, near_lid_;
  double step_ = 0, contact_time_ = 1;
  Surface surfaces_[4];
  Lanes touching_{};
  double lost_rate_ = 0;
  Lanes damped_lanes_{};
  std::uint32_t until_check_ = 0;
};

}  // namespace shakebed::sim
