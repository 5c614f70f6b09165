// State of one disk for the engine, in one cache line, which is all that the hot loop reads.
#pragma once

#include <cstdint>
#include <limits>

namespace shakebed::sim {

inline constexpr double never = std::numeric_limits<double>::infinity();
inline constexpr double skin_unit = 1.0 / 128;

// What a disk meets next. A partner >= 0 is another disk's number; the rest are these.
enum Partner : std::int32_t {
  nobody = -1,
  shell_exit = -2,
  left_wall = -3,
  right_wall = -4,
  floor_below = -5,
  lid_above = -6,
};

// Bits of Disk::near. They say what the disk could touch while it stays in its shell. They also say if a
// neighbour could be on the other side of a periodic box's edge, so that nearest images must be found.
enum Near : std::uint8_t {
  near_left_wall = 1,
  near_right_wall = 2,
  near_floor = 4,
  near_lid = 8,
  near_edge = 16,
};

// Reduced units: lengths in D, masses in m, accelerations in g (weightless scenes: T = 1 at the start instead).
// The state (x, z, vx, vz) is that at own_time; it is brought forward only when something happens to the disk.
struct alignas(64) Disk {
  double x, z;               // centre; z is the height above the floor's mean position
  double vx, vz;             // velocity
  double own_time;           // when the state above was true
  double event_time;         // when the next event of this disk is due
  std::int32_t partner;      // with whom: a disk's number or one of Partner
  std::uint16_t neighbours;  // how many disks its neighbour list holds
  std::uint8_t near;         // which walls and edges its shell can reach, bits of Near
  std::uint8_t skin;         // radius of its shell, in units of skin_unit
  float shell_x, shell_z;    // centre of its shell
};
static_assert(sizeof(Disk) == 64);

}  // namespace shakebed::sim
