// What real cells have: sides that slope outwards and move with the floor, and a lid of finite mass. Included by
// engine.hpp only.
//
// The left one is the line x = -(z - F) tan(slope), the right one its image; F is where the floor is. Their normals
// towards the outside are (-cos, -sin) and (cos, -sin) of the slope. Along a normal a disk falls freely too. So a side
// is met as the floor is, by a point that falls with g. Its height is the gap from the side of a floor at 0, over
// sin(slope).
//
// A free lid falls with g, as disks do. So each disk approaches it at a constant speed until one of them hits it. Disks
// push it upwards only. Those whose shells end below a bound are not asked if they meet it. A new bound is drawn when
// the lid has fallen to it. After each contact all that could meet the lid are predicted anew.
#pragma once

namespace shakebed::sim {

inline constexpr double lid_play = 1;  // between a free lid and its bound, when this is drawn [D]

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
  // Beds do not come to rest on sloped sides, so ever smaller hops on nearly plastic ones would have no end.
  const double slowest = hop_velocity(floor.acceleration, slope_sine_);
  const double away = -(motion.vx() * nx + (motion.vz() - floor.velocity) * nz);
  if (away < 0.5 * slowest) {
    const TwoLanes before = motion.velocity;
    motion.velocity -= (slowest - away) * TwoLanes{nx, nz};
    const TwoLanes squares = motion.velocity * motion.velocity - before * before;
    floor_work_ += 0.5 * mass * (squares[0] + squares[1]);
  }
}

// What relieve() does with sloped sides and a free lid.
template <class Space, class Rule, class Sizes>
template <class Stop>
void Engine<Space, Rule, Sizes>::relieve_in_cell(std::uint32_t i, double touching, const Stop& stop) {
  Disk& disk = disks_[i];
  const double radius = sizes_.radius(i), mass = sizes_.mass(i);
  const FloorMotion::Motion floor = floor_.motion(now_);
  for (const bool left : {true, false}) {
    if (!(slope_sine_ > 0) || gap_to_slope(disk.x, disk.z, radius, left, floor.position) >= touching) continue;
    const double nx = left ? -slope_cosine_ : slope_cosine_, nz = -slope_sine_;
    const double approach = stop(disk.vx * nx + (disk.vz - floor.velocity) * nz);
    disk.vx -= approach * nx;
    disk.vz -= approach * nz;
    floor_work_ -= mass * approach * nz * floor.velocity;
  }
  if (!lid_.is_free() || lid_height() - radius - disk.z >= touching) return;
  bring_lid_forward();
  const double approach = stop(disk.vz - lid_.vz);
  disk.vz -= approach * lid_.mass / (mass + lid_.mass);
  lid_.vz += approach * mass / (mass + lid_.mass);
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::bring_lid_forward() {
  const double z = lid_height(), vz = lid_velocity();
  lid_.z = z;
  lid_.vz = vz;
  lid_.own_time = now_;
}

// A bound below the lid, and when the lid may reach it.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::draw_lid_bound() {
  if (!lid_.is_free()) return;
  bring_lid_forward();
  lid_.lowest = lid_.z - lid_play;
  lid_.leaves_at = now_ + time_to_fall(lid_play, lid_.vz, gravity_);
}

// The lid has fallen to its bound, or would have without contacts: who could meet it now?
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::act_lid() {
  draw_lid_bound();
  for (std::uint32_t i = 0; i < count_; ++i) {
    bring_forward(i);
    mark_near_bounds(i);
  }
  predict_all();
  tell_all();
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::predict_below_lid(std::uint32_t but) {
  for (std::uint32_t k = 0; k < count_; ++k) {
    if (k != but && (disks_[k].near & near_lid) != 0) fly_on(k, motion_at(disks_[k], now_));
  }
}

// A contact of two smooth bodies, of which the lid is one.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::hit_free_lid(std::uint32_t i, Motion& motion) {
  bring_lid_forward();
  const double mass = sizes_.mass(i), reduced_mass = mass * lid_.mass / (mass + lid_.mass);
  const double approach = motion.vz() - lid_.vz;
  if (!(approach > 0)) return;  // grazed, by rounding
  double restitution = 1;
  if (too_soon(i, i)) {
    withhold(i, i, reduced_mass, approach, lid_surface_);
  } else {
    restitution = lid_surface_.varies() ? lid_surface_.restitution_at(approach) : lid_surface_.restitution;
  }
  const double given = reduced_mass * (1 + restitution) * approach;
  motion.velocity[1] -= given / mass;
  lid_.vz += given / lid_.mass;
  dissipated_ += 0.5 * reduced_mass * (1 - restitution * restitution) * approach * approach;
}

}  // namespace shakebed::sim
