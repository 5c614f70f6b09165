// Neighbour lists: which disks can touch soon. Every disk lives in a shell, a circle round the place where the disk was
// when the shell was last drawn. While all disks stay in their shells, only near pairs can touch. A pair is near when
// the distance of its shells' centres is below the contact distance plus the two shells' radii. Near pairs stand in
// each other's lists. A disk that leaves its shell draws a new one. The new shell is as large as it can be with at most
// eight neighbours: large in a gas, small in a crystal. This file holds the lists; shell_grid.hpp holds the places of
// the shells.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "sim/engine/disk.hpp"
#include "sim/engine/fetch.hpp"
#include "sim/engine/lanes.hpp"
#include "sim/engine/large_vector.hpp"

namespace shakebed::sim {

inline constexpr std::uint32_t inline_neighbours = 8;

struct alignas(32) NeighbourBlock {
  std::array<std::uint32_t, inline_neighbours> disk;
};

class NeighbourLists {
 public:
  // disks: the records, one more than count (the last is the sentinel that fills empty places of lists).
  void reset(Disk* disks, std::uint32_t count) {
    disks_ = disks;
    sentinel_ = count;
    lists_.resize(count + 1);
    for (NeighbourBlock& block : lists_) block.disk.fill(sentinel_);
    overflow_.assign(count, 0);
    blocks_.assign(1, {});
    links_.assign(1, 0);
    free_block_ = 0;
    lost_ = won_ = 0;
    for (std::uint32_t i = 0; i < count; ++i) disks_[i].neighbours = 0;
  }

  const NeighbourBlock& first_block(std::uint32_t i) const { return lists_[i]; }
  // The one behind it, of a disk with more than eight.
  const NeighbourBlock& second_block(std::uint32_t i) const { return blocks_[overflow_[i]]; }
  // Calls visit(block) for the blocks that hold the neighbours beyond the first
  // eight.
  template <class Visit>
  void further_blocks(std::uint32_t i, Visit visit) const {
    for (std::uint32_t block = overflow_[i]; block != 0; block = links_[block]) visit(blocks_[block]);
  }

  // Calls visit(k) for every neighbour.
  template <class Visit>
  void each_neighbour(std::uint32_t i, Visit visit) const {
    const std::uint32_t neighbours = disks_[i].neighbours;
    for (std::uint32_t place = 0; place < std::min(neighbours, inline_neighbours); ++place)
      visit(lists_[i].disk[place]);
    std::uint32_t left = neighbours - std::min(neighbours, inline_neighbours);
    further_blocks(i, [&](const NeighbourBlock& block) {
      for (std::uint32_t place = 0; place < inline_neighbours && left > 0; ++place, --left) visit(block.disk[place]);
    });
  }

  // Makes disk i and those of `found` with lower numbers neighbours, in the lists of both. By rounding the two might
  // disagree whether they reach each other, so the higher number decides for both.
  void list(std::uint32_t i, std::span<const std::uint32_t> found) {
    for (std::uint32_t k : found) {
      if (k > i) continue;
      append(i, k);
      append(k, i);
    }
  }
  // Gives i exactly the neighbours `found`. The lists of those that it lost or won are sent for; mend() is to be called
  // before anything is asked of them. Behind the last of `found` stand words that may be read.
  void relist(std::uint32_t i, std::span<const std::uint32_t> found) {
    alignas(32) std::array<std::uint32_t, inline_neighbours> first;
    const WordLanes places = {0, 1, 2, 3, 4, 5, 6, 7};
    const WordLanes filled =
        select(places < static_cast<std::int32_t>(found.size()), eight_words(found.data()), all_words(sentinel_));
    std::memcpy(first.data(), &filled, sizeof first);
    const std::uint32_t old_count = disks_[i].neighbours;
    if (std::max<std::size_t>(old_count, found.size()) <= inline_neighbours) [[likely]] {
      former_ = lists_[i];
      changed_ = i;
      lost_ = ~words_among(former_.disk.data(), first.data()) & ((1u << old_count) - 1);
      won_ = ~words_among(first.data(), former_.disk.data()) & ((1u << found.size()) - 1);
      lists_[i].disk = first;
      disks_[i].neighbours = static_cast<std::uint16_t>(found.size());
      fetch(&lists_[former_.disk[first_of(lost_)]]);
      fetch(&lists_[first[first_of(won_)]]);
      return;
    }
    for (std::uint32_t place = 0; place < old_count; ++place) {
      const std::uint32_t k = *slot(i, place);
      if (equal_words(first.data(), k) != 0) continue;
      if (found.size() > inline_neighbours &&
          std::find(found.begin() + inline_neighbours, found.end(), k) != found.end())
        continue;
      remove(k, i);
    }
    for (std::uint32_t k : found) {
      if (!holds(i, k)) append(k, i);
    }
    while (disks_[i].neighbours > found.size()) drop_last(i);
    lists_[i].disk = first;
    disks_[i].neighbours = static_cast<std::uint16_t>(
        std::max<std::size_t>(disks_[i].neighbours, std::min<std::size_t>(found.size(), inline_neighbours)));
    const std::uint32_t kept = disks_[i].neighbours;
    for (std::uint32_t place = inline_neighbours; place < kept; ++place) *slot(i, place) = found[place];
    for (std::size_t place = kept; place < found.size(); ++place) append(i, found[place]);
  }

  // Takes i out of the lists of those that it lost and puts it into those that it won, where relist() has left that.
  void mend() {
    for (; lost_ != 0; lost_ &= lost_ - 1) remove(former_.disk[first_of(lost_)], changed_);
    for (; won_ != 0; won_ &= won_ - 1) append(lists_[changed_].disk[first_of(won_)], changed_);
  }

  std::size_t bytes() const {
    return (overflow_.capacity() + links_.capacity()) * sizeof(std::uint32_t) +
           (lists_.capacity() + blocks_.capacity()) * sizeof(NeighbourBlock);
  }

 private:
  // The place of the lowest bit that is set, the last one if none is.
  static unsigned first_of(unsigned places) {
    return static_cast<unsigned>(__builtin_ctz(places | 1u << (inline_neighbours - 1)));
  }

  std::uint32_t* slot(std::uint32_t i, std::uint32_t place) {
    if (place < inline_neighbours) return &lists_[i].disk[place];
    std::uint32_t block = overflow_[i];
    for (place -= inline_neighbours; place >= inline_neighbours; place -= inline_neighbours) block = links_[block];
    return &blocks_[block].disk[place];
  }
  bool holds(std::uint32_t i, std::uint32_t k) {
    if (equal_words(lists_[i].disk.data(), k) != 0) return true;
    for (std::uint32_t place = inline_neighbours; place < disks_[i].neighbours; ++place) {
      if (*slot(i, place) == k) return true;
    }
    return false;
  }
  void append(std::uint32_t i, std::uint32_t k) {
    assert(i < sentinel_ && k < sentinel_ && i != k && !holds(i, k));
    const std::uint32_t place = disks_[i].neighbours++;
    if (place >= inline_neighbours && place % inline_neighbours == 0) {
      std::uint32_t* link = &overflow_[i];
      while (*link != 0) link = &links_[*link];
      std::uint32_t fresh = free_block_;
      if (fresh != 0) {
        free_block_ = links_[fresh];
        *link = fresh;
      } else {
        fresh = static_cast<std::uint32_t>(blocks_.size());
        *link = fresh;  // before the vector that may hold the link grows
        blocks_.emplace_back();
        links_.push_back(0);
      }
      links_[fresh] = 0;
      blocks_[fresh].disk.fill(sentinel_);
    }
    *slot(i, place) = k;
  }
  void drop_last(std::uint32_t i) {
    const std::uint32_t place = --disks_[i].neighbours;
    *slot(i, place) = sentinel_;
    if (place >= inline_neighbours && place % inline_neighbours == 0) {
      std::uint32_t* link = &overflow_[i];
      while (links_[*link] != 0) link = &links_[*link];
      const std::uint32_t block = *link;
      *link = 0;
      links_[block] = free_block_;
      free_block_ = block;
    }
  }
  void remove(std::uint32_t i, std::uint32_t k) {
    assert(holds(i, k));
    const std::uint32_t last = disks_[i].neighbours - 1u;
    std::uint32_t* here = nullptr;
    if (const unsigned equal = equal_words(lists_[i].disk.data(), k)) {
      here = &lists_[i].disk[static_cast<unsigned>(__builtin_ctz(equal))];
    } else {
      std::uint32_t place = inline_neighbours;
      while (*slot(i, place) != k) ++place;
      here = slot(i, place);
    }
    *here = *slot(i, last);
    drop_last(i);
  }

  Disk* disks_ = nullptr;
  std::uint32_t sentinel_ = 0;
  LargeVector<NeighbourBlock> lists_;    // the first eight neighbours of each disk
  std::vector<std::uint32_t> overflow_;  // first of the blocks that hold the rest, 0 for none
  std::vector<NeighbourBlock> blocks_;
  std::vector<std::uint32_t> links_;
  std::uint32_t free_block_ = 0;
  // For mend(): whose list has changed, what it was, and which places of it and of the new one are lost and won.
  std::uint32_t changed_ = 0;
  NeighbourBlock former_;
  unsigned lost_ = 0, won_ = 0;
};

}  // namespace shakebed::sim
