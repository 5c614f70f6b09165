#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

// phi against F = ln phi + g(phi), to the last digits. It consists of polynomials of degree 9 between Chebyshev nodes,
// on cells halved until they are exact. At the nodes phi is solved for in extended precision. Below F = -40 phi =
// exp(F). Internal to fit.
namespace shakebed::fit {

class InverseTable {
 public:
  // What the table needs to know of an equation of state on one smooth piece of its range.
  struct Piece {
    long double lowest_density = 0.0L;  // 0: from F = -40
    long double highest_density = 0.0L;
    std::function<long double(long double)> f_of_density;  // F(phi), strictly increasing
    std::function<double(double)> stiffness;               // kappa = phi F'(phi); steers Newton's steps, no more
  };
  // How finely: cells are at most `widest` long in F (a power of two), and halved until their error is below
  // `tolerance`, relative.
  struct Fineness {
    double widest = 0.25;
    double tolerance = 1e-17;
  };
  static constexpr double lowest_f = -40.0;

  InverseTable() = default;
  explicit InverseTable(const std::vector<Piece>& pieces) : InverseTable(pieces, Fineness{}) {}
  InverseTable(const std::vector<Piece>& pieces, const Fineness& fineness);

  [[nodiscard]] double largest_f() const { return largest_f_; }
  // Cells in all, 10 coefficients each.
  [[nodiscard]] std::size_t size() const;

  struct Point {
    double density;  // phi
    double slope;    // d phi/dF = phi/kappa
  };
  // phi(F) and its slope; those of largest_f() above it.
  [[nodiscard]] Point point(double big_f) const {
    if (big_f < lowest_f) {
      const double density = std::exp(big_f);
      return {density, density};
    }
    const double within = std::min(big_f, largest_f_);
    const Cell& cell = cell_of(within);
    const double u = within - cell.middle;
    return {cell.value(u), cell.slope(u)};
  }
  [[nodiscard]] double density(double big_f) const {
    if (big_f < lowest_f) return std::exp(big_f);
    const double within = std::min(big_f, largest_f_);
    const Cell& cell = cell_of(within);
    return cell.value(within - cell.middle);
  }
  // phi(F + low) for lowest_f <= F <= largest_f(): F in two doubles, for the last digit.
  [[nodiscard]] double density(double big_f, double low) const {
    const Cell& cell = cell_of(big_f);
    return cell.value((big_f - cell.middle) + low);
  }

 private:
  static constexpr std::size_t degree = 9;
  // Above this F, blocks are quarters of an octave: a pole's density follows F on the scale F itself.
  static constexpr double octaves_from = 256.0;

  struct Cell {
    double middle;                               // in F
    std::array<double, degree + 1> coefficient;  // of powers of F - middle
    // The first coefficient is the density itself; the rest is at most a seventh of it, so its roundings hardly count.
    [[nodiscard]] double value(double u) const {
      const std::array<double, degree + 1>& a = coefficient;
      const double u2 = u * u;
      const double u4 = u2 * u2;
      const double rest = ((a[1] + a[2] * u) + u2 * (a[3] + a[4] * u)) +
                          u4 * (((a[5] + a[6] * u) + u2 * (a[7] + a[8] * u)) + u4 * a[9]);
      return a[0] + u * rest;
    }
    [[nodiscard]] double slope(double u) const {
      const std::array<double, degree + 1>& a = coefficient;
      const double u2 = u * u;
      const double u4 = u2 * u2;
      return ((a[1] + 2.0 * a[2] * u) + u2 * (3.0 * a[3] + 4.0 * a[4] * u)) +
             u4 * (((5.0 * a[5] + 6.0 * a[6] * u) + u2 * (7.0 * a[7] + 8.0 * a[8] * u)) + u4 * (9.0 * a[9]));
    }
  };
  // Cells of equal width, as many as this stretch of F needs.
  struct Block {
    double first_f = 0.0, cells_per_f = 0.0;
    std::uint32_t first_cell = 0, last_cell = 0;
  };
  struct Segment {
    double last_f = 0.0;
    std::size_t first_block = 0;  // number of the block at the segment's start, as block_number() counts
    std::vector<Block> blocks;
    std::vector<Cell> cells;
  };

  [[nodiscard]] std::size_t block_number(double big_f) const {
    if (big_f < octaves_from) return static_cast<std::size_t>((big_f - lowest_f) * blocks_per_f_);
    return octave_blocks_ + static_cast<std::size_t>((std::bit_cast<std::uint64_t>(big_f) >> 50U) -
                                                     (std::bit_cast<std::uint64_t>(octaves_from) >> 50U));
  }
  [[nodiscard]] double block_start(std::size_t number) const;
  [[nodiscard]] const Cell& cell_of(double big_f) const {
    const Segment* segment = segments_.data();
    const Segment* last = segment + segments_.size() - 1;
    while (segment != last && big_f > segment->last_f) ++segment;
    const std::size_t number = std::max(block_number(big_f), segment->first_block) - segment->first_block;
    const Block& block = segment->blocks[std::min(number, segment->blocks.size() - 1)];
    const auto step = static_cast<std::int32_t>((big_f - block.first_f) * block.cells_per_f);
    return segment->cells[std::min(block.first_cell + static_cast<std::uint32_t>(std::max(step, 0)), block.last_cell)];
  }
  void add_segment(const Piece& piece, double tolerance);

  std::vector<Segment> segments_;
  double largest_f_ = 0.0;
  double blocks_per_f_ = 4.0;
  std::size_t octave_blocks_ = 0;
};

}  // namespace shakebed::fit
