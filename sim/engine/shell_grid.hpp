// The places of the disks' shells (see neighbour_lists.hpp). The shells' centres are filed in a grid of cells that
// wraps round in both directions, for open boxes too. A far cell that shares an index by chance only costs a distance
// check. So there is no event for crossing a cell, and the grid has no edge.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <variant>
#include <vector>

#include "sim/engine/disk.hpp"
#include "sim/engine/fetch.hpp"
#include "sim/engine/lanes.hpp"
#include "sim/engine/large_vector.hpp"

namespace shakebed::sim {

inline constexpr std::uint32_t nobody_here = 0xffffffff;
inline constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();

// A cell holds shells whose centres are in it, all that a search asks of them. Where it has no room it lends itself a
// further one. There are two kinds: of seven shells in two cache lines, for beds, mixtures and clusters, and of four in
// one, for where few cells hold more.
struct alignas(64) WideCell {
  static constexpr unsigned places = 7;
  alignas(32) std::array<float, 8> x, z{};  // the shells' centres; x of an empty place is NaN
  std::array<float, 8> reach{};             // radius of shell and disk together
  std::array<std::uint32_t, 8> disk;        // whose they are; the last word is next()

  WideCell() {
    x.fill(nowhere);
    disk.fill(nobody_here);
    next() = 0;
  }
  // Where the shells are that had no room here, 0 for nowhere.
  std::uint32_t& next() { return disk[places]; }
  std::uint32_t next() const { return disk[places]; }
  // Bit k is set where disk[k] == i.
  unsigned places_of(std::uint32_t i) const { return equal_words(disk.data(), i) & ((1u << places) - 1); }
  void set_reach(unsigned place, float value) { reach[place] = value; }
};
static_assert(sizeof(WideCell) == 128);

struct alignas(64) NarrowCell {
  static constexpr unsigned places = 4;
  std::array<float, places> x, z{};
  std::array<std::uint32_t, places> disk;
  std::array<std::uint16_t, places> reach{};  // upper halves of floats, not smaller than what they stand for

  NarrowCell() {
    x.fill(nowhere);
    disk.fill(nobody_here);
  }
  std::uint32_t& next() { return next_; }
  std::uint32_t next() const { return next_; }
  unsigned places_of(std::uint32_t i) const { return equal_among_four(disk.data(), i); }
  void set_reach(unsigned place, float value) { reach[place] = upper_half(value); }

 private:
  std::uint32_t next_ = 0;
};
static_assert(sizeof(NarrowCell) == 64);

template <class Cell>
class ShellGrid {
 public:
  // `disks`: the array of disk structs. The largest distance of centres that can make a pair is `reach`; a cell is that
  // wide. The size `width`, `height` is that of the periodic box, or of the region to grid where the box is not
  // periodic.
  void reset(const Disk* disks, double reach, double width, double height) {
    disks_ = disks;
    columns_ = std::max(1, static_cast<int>(std::min(width / reach, 30'000.0)));
    rows_ = std::max(1, static_cast<int>(std::min(height / reach, 30'000.0)));
    per_x_ = columns_ / width;
    per_z_ = rows_ / height;
    cells_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), Cell{});
    crowded_.assign(1, Cell{});
    free_cell_ = 0;
  }

  // Files i's shell; reach: the shell's radius and the disk's own.
  void file(std::uint32_t i, float reach) {
    Cell& cell = cells_[cell_of(disks_[i])];
    unsigned empty = cell.places_of(nobody_here);
    if (empty == 0) [[unlikely]] {
      make_room(cell);
      empty = cell.places_of(nobody_here);
    }
    const auto place = static_cast<unsigned>(__builtin_ctz(empty));
    cell.x[place] = disks_[i].shell_x;
    cell.z[place] = disks_[i].shell_z;
    cell.disk[place] = i;
    cell.set_reach(place, reach);
  }
  // To be called while the record still holds the old centre.
  void unfile(std::uint32_t i) {
    Cell& cell = *holder(i);
    const auto place = static_cast<unsigned>(__builtin_ctz(cell.places_of(i)));
    cell.disk[place] = nobody_here;
    cell.x[place] = nowhere;
    if (cell.next() != 0 && cell.places_of(nobody_here) == all_places) [[unlikely]]
      take_back(cell);
  }
  void set_reach(std::uint32_t i, float reach) {
    Cell& cell = *holder(i);
    cell.set_reach(static_cast<unsigned>(__builtin_ctz(cell.places_of(i))), reach);
  }

  // Calls visit(x, z, reach, disk) for every shell whose centre may be within reach of i's, also for i's own if it is
  // filed. Each call passes eight shells. Empty places among them have x = NaN.
  template <class Visit>
  [[gnu::always_inline]] void each_eight_round(std::uint32_t i, Visit visit) const {
    if constexpr (Cell::places > 4) {
      each_place_round(disks_[i].shell_x, disks_[i].shell_z, [&](const Cell& place) {
        for (const Cell* cell = &place;; cell = &crowded_[cell->next()]) {
          visit(eight_floats(cell->x.data()), eight_floats(cell->z.data()), eight_floats(cell->reach.data()),
                eight_words(cell->disk.data()));
          if (cell->next() == 0) [[likely]]
            break;
        }
      });
    } else {
      const auto visit_two = [&](const Cell& a, const Cell& b) {
        visit(four_and_four(a.x.data(), b.x.data()), four_and_four(a.z.data(), b.z.data()),
              four_and_four(a.reach.data(), b.reach.data()), four_and_four(a.disk.data(), b.disk.data()));
      };
      const Cell& empty = crowded_[0];
      std::array<const Cell*, 10> cells;
      std::size_t count = 0;
      std::uint32_t further = 0;
      each_place_round(disks_[i].shell_x, disks_[i].shell_z, [&](const Cell& cell) {
        further |= cell.next();
        cells[count++] = &cell;
      });
      cells[count] = &empty;
      for (std::size_t k = 0; k < count; k += 2) visit_two(*cells[k], *cells[k + 1]);
      if (further == 0) [[likely]]
        return;
      for (std::size_t k = 0; k < count; ++k) {
        for (std::uint32_t next = cells[k]->next(); next != 0; next = crowded_[next].next())
          visit_two(crowded_[next], empty);
      }
    }
  }
  // No more than that many eights are visited.
  std::size_t most_eights_round() const { return 9 + crowded_.size(); }

  // Prefetches the cells round a shell with that centre.
  [[gnu::always_inline]] void fetch_round(float x, float z) const {
    each_place_round(x, z, [](const Cell& cell) {
      fetch(&cell);
      if constexpr (sizeof(Cell) > 64) fetch(&cell.reach);
    });
  }

  // Further cells lent at one time since the reset, at most, by all places of the grid.
  double crowding() const { return static_cast<double>(crowded_.size() - 1) / static_cast<double>(cells_.size()); }
  std::size_t bytes() const { return (cells_.capacity() + crowded_.capacity()) * sizeof(Cell); }

 private:
  static constexpr unsigned all_places = (1u << Cell::places) - 1;

  int column_of(float x) const { return wrap(static_cast<int>(std::floor(x * per_x_)), columns_); }
  int row_of(float z) const { return wrap(static_cast<int>(std::floor(z * per_z_)), rows_); }
  std::size_t cell_of(const Disk& disk) const {
    return static_cast<std::size_t>(row_of(disk.shell_z)) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column_of(disk.shell_x));
  }
  static int wrap(int index, int size) {
    if (static_cast<unsigned>(index) < static_cast<unsigned>(size)) return index;
    index %= size;
    return index < 0 ? index + size : index;
  }

  // Calls visit(cell) for the nine places of the grid round a shell's centre, fewer in a small grid.
  template <class Visit>
  [[gnu::always_inline]] void each_place_round(float x, float z, Visit visit) const {
    const int column = column_of(x), row = row_of(z);
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

  // The cell, among those that share a place in the grid, where i stands.
  Cell* holder(std::uint32_t i) {
    Cell* cell = &cells_[cell_of(disks_[i])];
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

  const Disk* disks_ = nullptr;
  int columns_ = 1, rows_ = 1;
  double per_x_ = 1, per_z_ = 1;
  LargeVector<Cell> cells_;
  std::vector<Cell> crowded_;  // what did not fit; the first place is not used, it is an empty cell
  std::uint32_t free_cell_ = 0;
};

// The kinds of grid that a space may need. A bed that falls is denser at times than it may be now: seven to a cell.
template <bool falls>
using ShellGridFor = std::conditional_t<falls, std::variant<ShellGrid<WideCell>>,
                                        std::variant<ShellGrid<NarrowCell>, ShellGrid<WideCell>>>;

}  // namespace shakebed::sim
