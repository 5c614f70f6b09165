// Which disks of a packed bed are neighbours, four pairs at a time. Disks get places along their rows, from the lowest
// row upwards. The neighbours of four disks side by side then mostly stand side by side themselves: those in the same
// row, and those in the row above. So nearly all pairs are read and written by four at once.
//
// In random packings about one block in five holds fewer than three neighbours. Reduced units.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace shakebed::sim {

// The pairs (first + q, second + q), q = 0 to 3, of places.
struct PairBlock {
  std::uint32_t first, second;
};

class PressedRows {
 public:
  static constexpr std::uint32_t lanes = 4;
  // The first `count` of disks at (x, z), in a box of this width; period 0: no periodic sides, else x from 0 to period.
  // Pairs nearer than `reach` are neighbours.
  void find(const std::vector<double>& x, const std::vector<double>& z, std::uint32_t count, double width,
            double period, double reach);
  // order()[place] = the disk's index when it was found.
  const std::vector<std::uint32_t>& order() const { return order_; }
  // Every neighbouring pair stands in one block, once. Other pairs may be in a block as well, and up to three places
  // from the number of disks on. Blocks of one disk stand far apart. First come those of disks side by side: second is
  // first + 1.
  const std::vector<PairBlock>& blocks() const { return blocks_; }
  std::size_t in_rows() const { return in_rows_; }  // how many these are

 private:
  struct Pair {
    std::uint32_t disk, other;
  };
  void sort_columns(const std::vector<double>& x, const std::vector<double>& z, double width);
  void find_pairs(const std::vector<double>& x, const std::vector<double>& z, double period, double reach);
  void link(std::uint32_t left, std::uint32_t right, double rise);
  void order_rows(const std::vector<double>& x, const std::vector<double>& z);
  void make_blocks();
  void scatter(const std::vector<PairBlock>& found);

  std::uint32_t count_ = 0;
  std::size_t columns_ = 1;
  std::vector<std::uint32_t> column_, in_columns_, column_begin_;
  std::vector<Pair> pairs_;
  std::vector<std::uint32_t> right_, left_;  // the neighbour most level with a disk, on either side; none: the count
  std::vector<double> right_rise_, left_rise_;
  std::vector<std::uint32_t> order_, place_, heads_;
  std::vector<std::uint32_t> beyond_, beyond_begin_, free_from_;
  std::vector<PairBlock> found_, found_in_rows_, blocks_;
  std::size_t in_rows_ = 0;
};

}  // namespace shakebed::sim
