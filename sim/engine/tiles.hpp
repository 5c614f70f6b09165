// Tiles of a large periodic bed, and the log of contacts by which some can be taken back. How the engine goes on tile
// by tile stands in engine_tiles.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "sim/engine/disk.hpp"
#include "sim/engine/fetch.hpp"
#include "sim/engine/lanes.hpp"
#include "sim/engine/large_vector.hpp"
#include "sim/engine/policies.hpp"
#include "sim/engine/space_filling_curve.hpp"

namespace shakebed::sim {

// A square of the box, and the disks that stood there when they were last numbered: those from `begin` to `end`.
struct Tile {
  std::uint32_t begin, end;
  double x, z, half_width, half_height;  // centre and extent [D]

  // Does the disk's shell have its centre in the tile, at least that far from its border?
  bool holds(const Disk& disk, double from_border) const {
    return std::abs(disk.shell_x - x) < half_width - from_border &&
           std::abs(disk.shell_z - z) < half_height - from_border;
  }
};

// Squares of 128 D: their disks, shells and events together just fit a second-level cache of 2 MiB.
inline constexpr int tile_side_bits = 7;
inline constexpr double tile_side = 1 << tile_side_bits;

// The tiles of `count` disks that are numbered along the Hilbert curve, in a box of these periods.
inline std::vector<Tile> tiles_of(const Disk* disks, std::uint32_t count, const Period& period_x,
                                  const Period& period_z) {
  std::vector<Tile> tiles;
  std::uint32_t last = ~std::uint32_t{0};
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t column = hilbert_cell(period_x.wrapped(disks[i].x)),
                        row = hilbert_cell(period_z.wrapped(disks[i].z));
    const std::uint32_t tile = hilbert_place(column, row) >> (2 * tile_side_bits);
    if (tile != last) {
      last = tile;
      const auto low = [](std::uint32_t cell) {
        return std::max(0.0, place_of_hilbert_cell(cell >> tile_side_bits << tile_side_bits));
      };
      const auto high = [](std::uint32_t cell, const Period& period) {
        return std::min(period.length, place_of_hilbert_cell(((cell >> tile_side_bits) + 1) << tile_side_bits));
      };
      const double left = low(column), right = high(column, period_x), below = low(row), above = high(row, period_z);
      tiles.push_back({i, i, (left + right) / 2, (below + above) / 2, (right - left) / 2, (above - below) / 2});
    }
    tiles.back().end = i + 1;
  }
  return tiles;
}

// The contacts of one window of time, each with its disks' contacts before: a disk's flights can be followed back.
class ContactLog {
 public:
  struct Contact {
    double time;
    std::array<std::uint32_t, 2> disk, before;  // before: their last ones before this
    std::array<double, 2> momentum;             // given to the first, taken from the second
  };
  // A disk's flight in the window.
  struct Flight {
    TwoLanes place, velocity;  // when it began
    double began;
    std::uint32_t with;  // the contact with which it began
  };

  void begin(double start, std::size_t disks) {
    start_ = start;
    if (contacts_.empty()) contacts_.resize(1024);
    first_ += used_;
    used_ = 0;
    if (last_.size() != disks || first_ > std::numeric_limits<std::uint32_t>::max() / 2) {
      last_.assign(disks, 0);
      first_ = 1;
    }
  }
  double start() const { return start_; }
  void add(double time, std::uint32_t i, std::uint32_t j, TwoLanes momentum) {
    if (used_ == contacts_.size()) [[unlikely]]
      contacts_.resize(used_ + used_ / 8);
    contacts_[used_] = {time, {i, j}, {last_[i], last_[j]}, {momentum[0], momentum[1]}};
    last_[i] = last_[j] = first_ + used_++;
  }
  // Contacts are named by numbers that grow from window to window, so that those of former ones need not be forgotten.
  bool is_in_window(std::uint32_t number) const { return number >= first_; }
  std::uint32_t last_of(std::uint32_t i) const { return last_[i]; }
  const Contact& operator[](std::uint32_t number) const { return contacts_[number - first_]; }
  void fetch_last_of(std::uint32_t i) const { fetch(&last_[i]); }

  // The flight that the record of disk i tells, which must have begun with its last contact.
  Flight flight_of(std::uint32_t i, const Disk& disk) const {
    return {pair_at(&disk.x), pair_at(&disk.vx), disk.own_time, last_[i]};
  }
  // From a flight that began in the window to the one before, which counts from the window's start at the earliest.
  void step_back(Flight& flight, std::uint32_t i, double mass) const {
    const Contact& contact = (*this)[flight.with];
    const bool second = contact.disk[1] == i;
    flight.velocity += (second ? 1 : -1) / mass * TwoLanes{contact.momentum[0], contact.momentum[1]};
    flight.with = contact.before[second];
    flight.began = is_in_window(flight.with) ? (*this)[flight.with].time : start_;
    flight.place -= flight.velocity * (contact.time - flight.began);
  }
  // The contact of disk i that counts as its last one from now on.
  void set_last(std::uint32_t i, std::uint32_t number) { last_[i] = number; }

  std::size_t bytes() const {
    return contacts_.capacity() * sizeof(Contact) + last_.capacity() * sizeof(std::uint32_t);
  }

 private:
  double start_ = 0;
  std::uint32_t first_ = 1, used_ = 0;  // of this window: the first contact's number, and how many there are
  LargeVector<Contact> contacts_;
  std::vector<std::uint32_t> last_;  // of each disk
};

}  // namespace shakebed::sim
