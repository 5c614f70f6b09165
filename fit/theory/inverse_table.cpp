#include "fit/theory/inverse_table.hpp"

#include <limits>
#include <numbers>

namespace shakebed::fit {

namespace {

// phi with F(phi) = big_f on a piece, by Newton in ln phi kept inside a bracket, to the last digits of extended
// precision.
long double solve(const InverseTable::Piece& piece, long double big_f, long double start) {
  long double low = piece.lowest_density > 0.0L ? piece.lowest_density
                                                : std::exp(static_cast<long double>(InverseTable::lowest_f) - 1.0L);
  long double high = piece.highest_density;
  long double density = std::clamp(start, low, high);
  long double last_step = 0.0L;
  for (int iteration = 0; iteration < 200; ++iteration) {
    const long double residual = piece.f_of_density(density) - big_f;
    (residual > 0.0L ? high : low) = density;
    const long double step = std::clamp(-residual / piece.stiffness(static_cast<double>(density)), -1.0L, 1.0L);
    const long double next = density * (std::abs(step) < 1e-6L ? 1.0L + step + 0.5L * step * step : std::exp(step));
    // The next step would be no longer than this; or rounding is all that is left, also where extended precision is
    // no better than double (some machines, valgrind).
    const long double ahead = step * step / last_step;
    const bool only_rounding = std::abs(step) < 1e-18L || (iteration > 0 && std::abs(step) >= std::abs(last_step));
    if (std::abs(step) < 1e-6L && (std::abs(ahead) < 1e-20L || only_rounding)) {
      return std::clamp(next, low, high);
    }
    last_step = step;
    density = next > low && next < high ? next : 0.5L * (low + high);
  }
  return density;
}

// The Chebyshev nodes of [-1, 1], upwards, and what turns values there into coefficients.
template <std::size_t Terms>
struct Chebyshev {
  using Row = std::array<long double, Terms>;
  Row node{};
  std::array<Row, Terms> of_values{};   // [k][j]: of the coefficient of T_k by the value at node j
  std::array<Row, Terms> polynomial{};  // [k][i]: of x^i in T_k

  Chebyshev() {
    constexpr auto terms = static_cast<long double>(Terms);
    for (std::size_t j = 0; j < Terms; ++j) {
      const long double angle = std::numbers::pi_v<long double> * (terms - static_cast<long double>(j) - 0.5L) / terms;
      node[j] = std::cos(angle);
      for (std::size_t k = 0; k < Terms; ++k) {
        of_values[k][j] = (k == 0 ? 1.0L : 2.0L) / terms * std::cos(static_cast<long double>(k) * angle);
      }
    }
    polynomial[0][0] = 1.0L;
    polynomial[1][1] = 1.0L;
    for (std::size_t k = 2; k < Terms; ++k) {  // T_k = 2 x T_{k-1} - T_{k-2}
      for (std::size_t i = 0; i < Terms; ++i) {
        polynomial[k][i] = (i > 0 ? 2.0L * polynomial[k - 1][i - 1] : 0.0L) - polynomial[k - 2][i];
      }
    }
  }
};

// The polynomial through the values at the nodes, and an estimate of its relative error from how its Chebyshev
// coefficients fall.
template <std::size_t Terms>
struct Expansion {
  std::array<long double, Terms> power{};  // coefficients of x^i
  double error = 0.0;

  Expansion(const Chebyshev<Terms>& basis, const std::array<long double, Terms>& value) {
    std::array<long double, Terms> c{};
    for (std::size_t k = 0; k < Terms; ++k) {
      for (std::size_t j = 0; j < Terms; ++j) c[k] += basis.of_values[k][j] * value[j];
      for (std::size_t i = 0; i <= k; ++i) power[i] += c[k] * basis.polynomial[k][i];
    }
    const long double last = std::abs(c[Terms - 1]), before = std::abs(c[Terms - 2]),
                      third = std::max(std::abs(c[Terms - 3]), 1e-300L);
    const long double ratio = std::min(1.0L, std::max(last / std::max(before, 1e-300L), before / third));
    error = static_cast<double>(std::max(last, ratio * before) * ratio / std::abs(c[0]));
  }
};

}  // namespace

InverseTable::InverseTable(const std::vector<Piece>& pieces, const Fineness& fineness)
    : blocks_per_f_(1.0 / fineness.widest),
      octave_blocks_(static_cast<std::size_t>((octaves_from - lowest_f) / fineness.widest)) {
  for (const Piece& piece : pieces) add_segment(piece, fineness.tolerance);
}

std::size_t InverseTable::size() const {
  std::size_t cells = 0;
  for (const Segment& segment : segments_) cells += segment.cells.size();
  return cells;
}

double InverseTable::block_start(std::size_t number) const {
  if (number <= octave_blocks_) return lowest_f + static_cast<double>(number) / blocks_per_f_;
  const std::uint64_t quarter = (std::bit_cast<std::uint64_t>(octaves_from) >> 50U) + (number - octave_blocks_);
  return std::bit_cast<double>(quarter << 50U);
}

void InverseTable::add_segment(const Piece& piece, double tolerance) {
  static const Chebyshev<degree + 1> basis;
  Segment segment;
  const bool from_zero = !(piece.lowest_density > 0.0L);
  const double first_f = from_zero ? lowest_f : static_cast<double>(piece.f_of_density(piece.lowest_density));
  segment.last_f = static_cast<double>(piece.f_of_density(piece.highest_density));
  segment.first_block = block_number(first_f);
  const std::size_t last_block = block_number(segment.last_f);
  long double start = from_zero ? std::exp(static_cast<long double>(lowest_f)) : piece.lowest_density;
  for (std::size_t number = segment.first_block; number <= last_block; ++number) {
    const long double from = std::max(block_start(number), first_f);
    const long double to = std::min(block_start(number + 1), segment.last_f);
    if (!(to > from)) continue;
    const long double start_of_block = start;
    // Halve the cells until the worst is exact, or halving no longer helps: the rest is rounding.
    constexpr double surely_small = 1e-12;
    double worst_before = std::numeric_limits<double>::infinity();
    for (std::uint32_t cells = 1;; cells *= 2) {
      start = start_of_block;
      const long double half = 0.5L * (to - from) / static_cast<long double>(cells);
      const std::size_t first_cell = segment.cells.size();
      double worst = 0.0;
      for (std::uint32_t i = 0; i < cells; ++i) {
        const auto middle = static_cast<double>(from + half * static_cast<long double>(2 * i + 1));
        std::array<long double, degree + 1> value{};
        for (std::size_t j = 0; j <= degree; ++j) {
          value[j] = start = solve(piece, middle + half * basis.node[j], start);
        }
        const Expansion<degree + 1> expansion(basis, value);
        worst = std::max(worst, expansion.error);
        Cell cell{middle, {}};
        long double scale = 1.0L;
        for (std::size_t k = 0; k <= degree; ++k) {
          cell.coefficient[k] = static_cast<double>(expansion.power[k] / scale);
          scale *= half;
        }
        segment.cells.push_back(cell);
      }
      const bool only_rounding = worst < surely_small && worst > 0.5 * worst_before;
      worst_before = worst;
      if (worst <= tolerance || only_rounding || cells >= 4096) {
        segment.blocks.push_back(
            {static_cast<double>(from), static_cast<double>(static_cast<long double>(cells) / (to - from)),
             static_cast<std::uint32_t>(first_cell), static_cast<std::uint32_t>(segment.cells.size() - 1)});
        break;
      }
      segment.cells.resize(first_cell);
    }
  }
  largest_f_ = segment.last_f;
  segments_.push_back(std::move(segment));
}

}  // namespace shakebed::fit
