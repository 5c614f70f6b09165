// When two things next touch. Pure functions of the present state, one for each pair of things. Each returns a time
// from now, in reduced units: 0 for "touching and approaching", `never` for no contact.
//
// Every root is computed in a form without cancellation. For c + 2 b t + a t^2 = 0 with b < 0 the first root is
//   c / (sqrt(b^2 - a c) - b).
#pragma once

#include <algorithm>
#include <cmath>

#include "sim/engine/disk.hpp"
#include "sim/engine/lanes.hpp"

namespace shakebed::sim {

// Slower approaches than this (times the distance, in D sqrt(g D)) are rounding, not motion: two disks that stay in
// touch for ever are not made to collide for ever. What it lets pass is an overlap of 1e-14 D in a unit of time.
inline constexpr double slowest_approach = 1e-14;

// Two disks in free flight under the same gravity: their relative motion is a straight line.
// (dx, dz), (dvx, dvz): position and velocity of the second from the first; contact_distance_squared: (R1 + R2)^2.
inline double time_to_disk(double dx, double dz, double dvx, double dvz, double contact_distance_squared) {
  const double b = dx * dvx + dz * dvz;
  if (!(b < -slowest_approach)) return never;
  const double speed_squared = dvx * dvx + dvz * dvz;
  const double c = std::max(dx * dx + dz * dz - contact_distance_squared, 0.0);
  const double discriminant = b * b - speed_squared * c;
  if (discriminant < 0) return never;
  return c / (std::sqrt(discriminant) - b);
}

// Disks that another one may meet, one in each lane. Number: Lanes or TwoLanes.
template <class Number>
struct SeenDisks {
  Number x, z, vx, vz, own_time, event_time, contact_squared;
};
// Two of the four: half is first_half or second_half.
template <class Half>
SeenDisks<TwoLanes> half_of(const SeenDisks<Lanes>& all, const Half& half) {
  return {half(all.x),
          half(all.z),
          half(all.vx),
          half(all.vz),
          half(all.own_time),
          half(all.event_time),
          half(all.contact_squared)};
}

// A wall across a direction in which nothing accelerates. gap: free distance to it (slightly negative counts as
// touching); approach_speed: how fast the gap closes.
inline double time_to_wall(double gap, double approach_speed) {
  if (!(approach_speed > slowest_approach)) return never;
  return std::max(gap, 0.0) / approach_speed;
}

// A horizontal wall above, reached against gravity. gap: free distance; vz: upward velocity.
inline double time_to_lid(double gap, double vz, double gravity) {
  if (!(vz > 0)) return never;
  const double c = std::max(gap, 0.0);
  const double discriminant = vz * vz - 2 * gravity * c;
  if (discriminant < 0) return never;
  return 2 * c / (vz + std::sqrt(discriminant));
}

// The first time at which a disk falling freely passes downwards through a height that lies `gap` below it, where gap
// >= 0 and vz is the upward velocity. A lower bound for its contact with a floor that never rises above that height.
inline double time_to_fall(double gap, double vz, double gravity) {
  if (gravity > 0) {
    const double root = std::sqrt(vz * vz + 2 * gravity * gap);
    if (root == 0) return 0;  // at rest on the floor
    return vz > 0 ? (vz + root) / gravity : 2 * gap / (root - vz);
  }
  return vz < 0 ? gap / -vz : never;
}

// When a disk may leave its shell: a time that is never later than the true exit, but for rounding. (ox, oz): offset
// from the shell's centre, inside the shell. (vx, vz): velocity in the shell's frame. Gravity bends the path by at most
// g t^2 / 2. So the disk is inside while |o + v t| <= radius - g t^2 / 2, squared:
//   c + 2 b t + a t^2 - g^2 t^4 / 4 <= 0.
// Without its last term this gives an earlier time, and needs one square root. The result is NaN, which compares false
// with every time, for a disk at rest without gravity. Number: double, or TwoLanes for two disks side by side.
template <class Number>
Number time_to_leave_shell(Number ox, Number oz, Number vx, Number vz, Number radius, double gravity) {
  const Number a = fused(vx, vx, gravity > 0 ? fused(vz, vz, gravity * radius) : vz * vz);
  const Number b = fused(ox, vx, oz * vz);
  const Number c = not_above_zero(fused(ox, ox, fused(oz, oz, -(radius * radius))));
  const Number root = sqrt_lanes(fused(b, b, -(a * c)));
  // Close to the edge this form loses digits, but the length is then below 1e-15 of the shell's. It has no branch, and
  // its division does not depend on the square root.
  return (root - b) * (1 / a);
}

}  // namespace shakebed::sim
