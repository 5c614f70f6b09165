// Side walls that slope outwards and move with the floor. Included by engine.hpp only.
//
// The left one is the line x = -(z - F) tan(slope), the right one its image; F is where the floor is. Their normals
// towards the outside are (-cos, -sin) and (cos, -sin) of the slope. Along a normal a disk falls freely too. So a side
// is met as the floor is, by a point that falls with g. Its height is the gap from the side of a floor at 0, over
// sin(slope).
#pragma once

namespace shakebed::sim {

template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::time_to_slope(const Disk& disk, double radius, bool left, double horizon) const {
  const double height = gap_to_slope(disk.x, disk.z, radius, left, 0) / slope_sine_;
  const double away = slope_cosine_ * (left ? disk.vx : -disk.vx) + slope_sine_ * disk.vz;
  return floor_.time_to_contact(height, away / slope_sine_, gravity_, now_, horizon);
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::hit_slope(std::uint32_t i, Motion& motion, bool left) {
  const double mass = sizes_.mass(i), vz = motion.vz();
  const double nx = left ? -slope_cosine_ : slope_cosine_, nz = -slope_sine_;
  const FloorMotion::Motion floor = floor_.motion(now_);
  bounce(i, motion, nx, nz, floor.velocity, side_surface_);
  floor_work_ += mass * (motion.vz() - vz) * floor.velocity;
  // A disk that lies on the side is carried in small hops, as on the floor.
  const double hop = contact_duration_ > 0 ? contact_duration_ : rest_hop;
  const double slowest = 0.5 * (gravity_ + floor.acceleration) * slope_sine_ * hop;
  const double away = -(motion.vx() * nx + (motion.vz() - floor.velocity) * nz);
  if (away < 1e-3 * slowest) {
    const TwoLanes before = motion.velocity;
    motion.velocity -= (slowest - away) * TwoLanes{nx, nz};
    const TwoLanes squares = motion.velocity * motion.velocity - before * before;
    floor_work_ += 0.5 * mass * (squares[0] + squares[1]);
  }
}

}  // namespace shakebed::sim
