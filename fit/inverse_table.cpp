#include "fit/inverse_table.hpp"

namespace shakebed::fit {

namespace {

// phi with F(phi) = big_f on a piece, by Newton in ln phi kept inside a bracket.
double solve(const InverseTable::Piece& piece, double big_f, double start) {
  double low = piece.lowest_density > 0.0 ? piece.lowest_density : std::exp(InverseTable::lowest_f - 1.0);
  double high = piece.highest_density;
  double density = std::clamp(start, low, high);
  for (int iteration = 0; iteration < 200; ++iteration) {
    const double residual = piece.f_of_density(density) - big_f;
    if (residual > 0.0) {
      high = density;
    } else {
      low = density;
    }
    const double step = -residual / piece.stiffness(density);
    double next = density * std::exp(std::clamp(step, -1.0, 1.0));
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    const double change = std::abs(next - density);
    density = next;
    if (change <= 4e-16 * density) break;
  }
  return density;
}

}  // namespace

InverseTable::InverseTable(const std::vector<Piece>& pieces) {
  // The density follows F smoothly on the scale 1 up to about here; beyond, on the scale F itself.
  constexpr double logarithmic_from = 120.0;
  for (const Piece& piece : pieces) {
    const double first = piece.lowest_density > 0.0 ? piece.f_of_density(piece.lowest_density) : lowest_f;
    const double last = piece.f_of_density(piece.highest_density);
    if (first < logarithmic_from) {
      add_segment(piece, first, std::min(last, logarithmic_from), false, piece.spacing);
    }
    if (last > logarithmic_from) add_segment(piece, std::max(first, logarithmic_from), last, true, 1.0 / 16.0);
    largest_f_ = last;
  }
}

void InverseTable::add_segment(const Piece& piece, double first_f, double last_f, bool logarithmic, double spacing) {
  Segment segment;
  segment.first_f = first_f;
  segment.last_f = last_f;
  segment.logarithmic = logarithmic;
  segment.origin = logarithmic ? std::log(first_f) : first_f;
  const double length = (logarithmic ? std::log(last_f) : last_f) - segment.origin;
  const auto cells = static_cast<std::size_t>(std::max(2.0, std::ceil(length / spacing)));
  const double h = length / static_cast<double>(cells);
  segment.per_node = 1.0 / h;
  segment.nodes.resize(cells + 1);
  double density = piece.lowest_density > 0.0 ? piece.lowest_density : std::exp(first_f);
  for (std::size_t i = 0; i <= cells; ++i) {
    const double x = segment.origin + h * static_cast<double>(i);
    const double big_f = i == cells ? last_f : (logarithmic ? std::exp(x) : x);
    if (i == cells && last_f == piece.f_of_density(piece.highest_density)) {
      density = piece.highest_density;
    } else if (i > 0 || piece.lowest_density == 0.0 || first_f > piece.f_of_density(piece.lowest_density)) {
      density = solve(piece, big_f, density);
    }
    const double kappa = piece.stiffness(density);
    // kappa'(phi) by a difference: its small error is multiplied by h^2 in the interpolation.
    const double lowest = piece.lowest_density > 0.0 ? piece.lowest_density : 0.0;
    const double step = 1e-4 * (piece.pole > 0.0 ? std::min(density, piece.pole - density) : 0.1 * density);
    double below = density - step;
    double above = density + step;
    if (below < lowest) below = density;
    if (above > piece.highest_density) above = density;
    const double slope = above > below ? (piece.stiffness(above) - piece.stiffness(below)) / (above - below) : 0.0;
    const double first = density / kappa;                                   // d phi/dF
    const double second = first / kappa * (1.0 - density * slope / kappa);  // d2 phi/dF2
    Node& node = segment.nodes[i];
    node.value = density;
    if (logarithmic) {  // d/dx with F = e^x
      node.first = h * first * big_f;
      node.second = 0.5 * h * h * (second * big_f * big_f + first * big_f);
    } else {
      node.first = h * first;
      node.second = 0.5 * h * h * second;
    }
  }
  segments_.push_back(std::move(segment));
}

}  // namespace shakebed::fit
