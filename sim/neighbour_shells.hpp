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
#include <limits>
#include <span>
#include <vector>

#include "sim/disk.hpp"
#include "sim/lanes.hpp"
#include "sim/large_vector.hpp"

namespace shakebed::sim {

inline constexpr std::uint32_t inline_neighbours = 8;

struct alignas(32) NeighbourBlock {
  std::array<std::uint32_t, inline_neighbours> disk;
};

// One cell of the grid: shells whose centres are in it, all that a search asks of them.
inline constexpr std::uint32_t nobody_here = 0xffffffff;
struct alignas(64) Cell {
  static constexpr unsigned places = 7, all_places = (1u << places) - 1;
  alignas(32) std::array<float, 8> x{}, z{};  // the shells' centres
  std::array<float, 8> reach;                 // radius of shell and disk together; of an empty place -infinity
  std::array<std::uint32_t, 8> disk;          // whose they are; the last word is next()

  Cell() {
    reach.fill(-std::numeric_limits<float>::infinity());
    disk.fill(nobody_here);
    next() = 0;
  }
  // Where the shells are that had no room here, 0 for nowhere.
  std::uint32_t& next() { return disk[places]; }
  std::uint32_t next() const { return disk[places]; }
  // Bit k is set where disk[k] == i.
  unsigned places_of(std::uint32_t i) const { return equal_words(disk.data(), i) & all_places; }
  void put(unsigned place, std::uint32_t i, const Disk& record, float reach_of_i) {
    x[place] = record.shell_x;
    z[place] = record.shell_z;
    reach[place] = reach_of_i;
    disk[place] = i;
  }
  void clear(unsigned place) {
    reach[place] = -std::numeric_limits<float>::infinity();
    disk[place] = nobody_here;
  }
};
static_assert(sizeof(Cell) == 128);

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
  void each_neighbour(std::uint32_t i, Visit visit) {
    const std::uint32_t neighbours = disks_[i].neighbours;
    for (std::uint32_t place = 0; place < neighbours; ++place) visit(*slot(i, place));
  }

  // Files i's shell; reach: the shell's radius and the disk's own.
  void file(std::uint32_t i, float reach) {
    Cell* cell = &cells_[cell_of(disks_[i])];
    unsigned empty = cell->places_of(nobody_here);
    if (empty == 0) [[unlikely]] {
      make_room(*cell);
      empty = cell->places_of(nobody_here);
    }
    cell->put(static_cast<unsigned>(__builtin_ctz(empty)), i, disks_[i], reach);
  }
  // To be called while the record still holds the old centre.
  void unfile(std::uint32_t i) {
    const std::size_t home = cell_of(disks_[i]);
    Cell& cell = *holder(home, i);
    cell.clear(static_cast<unsigned>(__builtin_ctz(cell.places_of(i))));
    if (cell.next() != 0 && cell.places_of(nobody_here) == Cell::all_places) [[unlikely]]
      take_back(cell);
  }
  void set_reach(std::uint32_t i, float reach) {
    Cell& cell = *holder(cell_of(disks_[i]), i);
    cell.reach[static_cast<unsigned>(__builtin_ctz(cell.places_of(i)))] = reach;
  }
  // Calls visit(cell) for the places of the grid where every shell stands whose centre may be within reach of i's, i's
  // own too if filed.
  template <class Visit>
  [[gnu::always_inline]] void each_place_round(std::uint32_t i, Visit visit) const {
    const int column = column_of(disks_[i]), row = row_of(disks_[i]);
    std::array<int, 3> rows = {row == 0 ? rows_ - 1 : row - 1, row, row + 1 == rows_ ? 0 : row + 1};
    std::array<int, 3> columns = {column == 0 ? columns_ - 1 : column - 1, column,
                                  column + 1 == columns_ ? 0 : column + 1};
    std::size_t along = 3, across = 3;
    if (columns_ < 3 || rows_ < 3) [[unlikely]] {  // the same cell must not be met twice
      if (rows_ < 3) rows = {0, 1, 2};
      if (columns_ < 3) columns = {0, 1, 2};
      along = static_cast<std::size_t>(std::min(rows_, 3));
      across = static_cast<std::size_t>(std::min(columns_, 3));
    }
    for (std::size_t r = 0; r < along; ++r) {
      const Cell* first = &cells_[static_cast<std::size_t>(rows[r]) * static_cast<std::size_t>(columns_)];
      for (std::size_t c = 0; c < across; ++c) visit(first[columns[c]]);
    }
  }
  // The same for those that had no room there, too.
  template <class Visit>
  [[gnu::always_inline]] void each_cell_round(std::uint32_t i, Visit visit) const {
    each_place_round(i, [&](const Cell& place) {
      for (const Cell* cell = &place;; cell = &crowded_[cell->next()]) {
        visit(*cell);
        if (cell->next() == 0) [[likely]]
          break;
      }
    });
  }
  // No more cells than that are visited.
  std::size_t most_cells_round() const { return 9 + crowded_.size(); }

  // Makes neighbours of i and those `found` whose number is lower, in both their lists: by rounding the two might not
  // agree whether they reach each other, so the higher one decides for both.
  void list(std::uint32_t i, std::span<const std::uint32_t> found) {
    for (std::uint32_t k : found) {
      if (k > i) continue;
      append(i, k);
      append(k, i);
    }
  }
  // Gives i exactly the neighbours `found`, and mends the lists of those that
  // it lost or won. Behind the last of `found` stand words that may be read.
  void relist(std::uint32_t i, std::span<const std::uint32_t> found) {
    alignas(32) std::array<std::uint32_t, inline_neighbours> first;
    const WordLanes places = {0, 1, 2, 3, 4, 5, 6, 7};
    const WordLanes filled =
        select(places < static_cast<std::int32_t>(found.size()), eight_words(found.data()), all_words(sentinel_));
    std::memcpy(first.data(), &filled, sizeof first);
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
  int column_of(const Disk& disk) const { return wrap(static_cast<int>(std::floor(disk.shell_x * per_x_)), columns_); }
  int row_of(const Disk& disk) const { return wrap(static_cast<int>(std::floor(disk.shell_z * per_z_)), rows_); }
  std::size_t cell_of(const Disk& disk) const {
    return static_cast<std::size_t>(row_of(disk)) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column_of(disk));
  }
  // The cell, among those that share a place in the grid, where i stands.
  Cell* holder(std::size_t home, std::uint32_t i) {
    Cell* cell = &cells_[home];
    while (cell->places_of(i) == 0) cell = &crowded_[cell->next()];
    return cell;
  }
  [[gnu::noinline]] void make_room(Cell& cell) {
    std::uint32_t place = free_cell_;
    if (place != 0) {
      free_cell_ = crowded_[place].next();
    } else {
      place = static_cast<std::uint32_t>(crowded_.size());
      crowded_.emplace_back();
    }
    crowded_[place] = cell;
    cell = Cell{};
    cell.next() = place;
  }
  [[gnu::noinline]] void take_back(Cell& cell) {
    const std::uint32_t place = cell.next();
    cell = crowded_[place];
    crowded_[place].next() = free_cell_;
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
