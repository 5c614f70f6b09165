// Who can touch whom soon. Every disk lives in a shell, a circle round the
// place where the disk was when the shell was last drawn; while all disks stay
// in their shells, only pairs whose shells' centres are closer than the disks'
// contact distance plus the two shells' radii can touch, and those stand in
// each other's lists. A disk that leaves its shell draws a new one, as large as
// it can be without more than eight neighbours: large in a gas, small in a
// crystal.
//
// Centres are filed in a grid of cells that wraps round in both directions (for
// open boxes too: a far cell shared by chance only costs a distance check), so
// there is no event for crossing a cell and no edge to the world.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "sim/disk.hpp"
#include "sim/lanes.hpp"
#include "sim/large_vector.hpp"

namespace shakebed::sim {

inline constexpr std::uint32_t inline_neighbours = 8;

struct alignas(32) NeighbourBlock {
  std::array<std::uint32_t, inline_neighbours> disk;
};

class NeighbourShells {
 public:
  // disks: the records, one more than count (the last is the sentinel that
  // fills empty places of lists). reach: the largest distance of centres that
  // can make a pair; cells are that wide. width, height: of the periodic box,
  // or of the region to grid when it is not.
  void reset(Disk* disks, std::uint32_t count, double reach, double width, double height) {
    disks_ = disks;
    sentinel_ = count;
    columns_ = std::max(1, static_cast<int>(std::min(width / reach, 30'000.0)));
    rows_ = std::max(1, static_cast<int>(std::min(height / reach, 30'000.0)));
    per_x_ = columns_ / width;
    per_z_ = rows_ / height;
    cells_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), Cell{});
    crowded_.assign(1, Cell{});
    free_cell_ = 0;
    lists_.resize(count + 1);
    for (NeighbourBlock& block : lists_) block.disk.fill(sentinel_);
    overflow_.assign(count, 0);
    blocks_.assign(1, {});
    links_.assign(1, 0);
    free_block_ = 0;
    for (std::uint32_t i = 0; i < count; ++i) disks_[i].neighbours = 0;
  }

  const NeighbourBlock& first_block(std::uint32_t i) const { return lists_[i]; }
  // Calls visit(block) for the blocks that hold the neighbours beyond the first
  // eight.
  template <class Visit>
  void further_blocks(std::uint32_t i, Visit visit) const {
    for (std::uint32_t block = overflow_[i]; block != 0; block = links_[block]) visit(blocks_[block]);
  }

  // Calls visit(k) for every neighbour.
  template <class Visit>
  void each_neighbour(std::uint32_t i, Visit visit) {
    const std::uint32_t neighbours = disks_[i].neighbours;
    for (std::uint32_t place = 0; place < neighbours; ++place) visit(*slot(i, place));
  }

  void file(std::uint32_t i) {
    Cell& cell = cells_[cell_of(disks_[i])];
    if (cell.held == disks_a_cell) [[unlikely]]
      make_room(cell);
    cell.disk[cell.held++] = i;
  }
  // To be called while the record still holds the old centre.
  void unfile(std::uint32_t i) {
    Cell& cell = cells_[cell_of(disks_[i])];
    std::uint32_t* here = find(cell, i);
    for (std::uint32_t next = cell.next; here == nullptr; next = crowded_[next].next) here = find(crowded_[next], i);
    *here = cell.disk[--cell.held];
    if (cell.held == 0 && cell.next != 0) [[unlikely]]
      take_back(cell);
  }
  std::size_t cell_of(const Disk& disk) const {
    const int column = wrap(static_cast<int>(std::floor(disk.shell_x * per_x_)), columns_);
    const int row = wrap(static_cast<int>(std::floor(disk.shell_z * per_z_)), rows_);
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
  }

  // Writes down every disk, itself too, whose shell's centre may be within
  // reach of i's, and how many they are. found grows as needed; behind the last
  // stand seven more words or so of no meaning.
  std::size_t search(std::uint32_t i, LargeVector<std::uint32_t>& found) const {
    const Disk& disk = disks_[i];
    const int column = wrap(static_cast<int>(std::floor(disk.shell_x * per_x_)), columns_);
    const int row = wrap(static_cast<int>(std::floor(disk.shell_z * per_z_)), rows_);
    if (found.size() < 16 * disks_a_cell) found.resize(16 * disks_a_cell);
    std::size_t count = 0;
    const auto take = [&](int r, int c) {
      const Cell& cell =
          cells_[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(c)];
      std::memcpy(&found[count], cell.disk.data(), sizeof cell.disk);
      count += cell.held;
      for (std::uint32_t next = cell.next; next != 0; next = crowded_[next].next) {
        if (found.size() < count + 12 * disks_a_cell) found.resize(2 * found.size());
        std::memcpy(&found[count], crowded_[next].disk.data(), sizeof cell.disk);
        count += crowded_[next].held;
      }
    };
    if (columns_ >= 3 && rows_ >= 3) [[likely]] {
      const std::array<int, 3> rows = {row == 0 ? rows_ - 1 : row - 1, row, row + 1 == rows_ ? 0 : row + 1};
      const std::array<int, 3> columns = {column == 0 ? columns_ - 1 : column - 1, column,
                                          column + 1 == columns_ ? 0 : column + 1};
#pragma GCC unroll 3
      for (int r = 0; r < 3; ++r) {
#pragma GCC unroll 3
        for (int c = 0; c < 3; ++c) take(rows[static_cast<std::size_t>(r)], columns[static_cast<std::size_t>(c)]);
      }
    } else {  // the same cell must not be met twice
      const int across = std::min(columns_, 3), along = std::min(rows_, 3);
      for (int r = 0; r < along; ++r) {
        for (int c = 0; c < across; ++c)
          take(rows_ >= 3 ? wrap(row + r - 1, rows_) : r, columns_ >= 3 ? wrap(column + c - 1, columns_) : c);
      }
    }
    return count;
  }

  // Makes neighbours of i and those `found` whose number is lower, in both their lists: by rounding the two might not
  // agree whether they reach each other, so the higher one decides for both.
  void list(std::uint32_t i, const std::vector<std::uint32_t>& found) {
    for (std::uint32_t k : found) {
      if (k > i) continue;
      append(i, k);
      append(k, i);
    }
  }
  // Gives i exactly the neighbours `found`, and mends the lists of those that
  // it lost or won.
  void relist(std::uint32_t i, const std::vector<std::uint32_t>& found) {
    alignas(32) std::array<std::uint32_t, inline_neighbours> first;
    first.fill(sentinel_);
    std::copy_n(found.begin(), std::min<std::size_t>(found.size(), inline_neighbours), first.begin());
    const std::uint32_t old_count = disks_[i].neighbours;
    if (std::max<std::size_t>(old_count, found.size()) <= inline_neighbours) [[likely]] {
      const NeighbourBlock old = lists_[i];
      unsigned lost = ~words_among(old.disk.data(), first.data()) & ((1u << old_count) - 1);
      unsigned won = ~words_among(first.data(), old.disk.data()) & ((1u << found.size()) - 1);
      for (; lost != 0; lost &= lost - 1) remove(old.disk[static_cast<unsigned>(__builtin_ctz(lost))], i);
      for (; won != 0; won &= won - 1) append(first[static_cast<unsigned>(__builtin_ctz(won))], i);
      lists_[i].disk = first;
      disks_[i].neighbours = static_cast<std::uint16_t>(found.size());
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

  std::size_t bytes() const {
    return (overflow_.capacity() + links_.capacity()) * sizeof(std::uint32_t) +
           (cells_.capacity() + crowded_.capacity()) * sizeof(Cell) +
           (lists_.capacity() + blocks_.capacity()) * sizeof(NeighbourBlock);
  }

 private:
  static constexpr std::uint32_t disks_a_cell = 6;
  struct alignas(32) Cell {
    std::array<std::uint32_t, disks_a_cell> disk{};
    std::uint32_t held = 0,
                  next = 0;  // disks here; where in crowded_ the others are, 0 for nowhere
  };

  static std::uint32_t* find(Cell& cell, std::uint32_t i) {
    for (std::uint32_t k = 0; k < cell.held; ++k) {
      if (cell.disk[k] == i) return &cell.disk[k];
    }
    return nullptr;
  }
  [[gnu::noinline]] void make_room(Cell& cell) {
    std::uint32_t place = free_cell_;
    if (place != 0) {
      free_cell_ = crowded_[place].next;
    } else {
      place = static_cast<std::uint32_t>(crowded_.size());
      crowded_.emplace_back();
    }
    crowded_[place] = cell;
    cell.held = 0;
    cell.next = place;
  }
  [[gnu::noinline]] void take_back(Cell& cell) {
    const std::uint32_t place = cell.next;
    cell = crowded_[place];
    crowded_[place].next = free_cell_;
    free_cell_ = place;
  }

  static int wrap(int index, int size) {
    if (static_cast<unsigned>(index) < static_cast<unsigned>(size)) return index;
    index %= size;
    return index < 0 ? index + size : index;
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
  int columns_ = 1, rows_ = 1;
  double per_x_ = 1, per_z_ = 1;
  LargeVector<Cell> cells_;    // the grid
  std::vector<Cell> crowded_;  // what did not fit; the first place is not used
  std::uint32_t free_cell_ = 0;
  LargeVector<NeighbourBlock> lists_;    // the first eight neighbours of each disk
  std::vector<std::uint32_t> overflow_;  // first of the blocks that hold the rest, 0 for none
  std::vector<NeighbourBlock> blocks_;
  std::vector<std::uint32_t> links_;
  std::uint32_t free_block_ = 0;
};

}  // namespace shakebed::sim
