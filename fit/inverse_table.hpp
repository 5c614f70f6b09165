#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

// phi against F = ln phi + g(phi), tabulated: quintic Hermite interpolation between nodes at which phi, phi' and phi''
// are exact. Relative error below 1e-11; below F = -40 phi = exp(F) to the last digit. Internal to fit.
namespace shakebed::fit {

class InverseTable {
 public:
  // What the table needs to know of an equation of state on one smooth piece of its range: F and d ln(phi)/dF =
  // 1/kappa.
  struct Piece {
    double lowest_density = 0.0;  // 0: from F = -40
    double highest_density = 0.0;
    double pole = 0.0;            // 0: none; else the density where F diverges, just above highest_density
    double spacing = 1.0 / 16.0;  // of the nodes, in F
    std::function<double(double)> f_of_density;  // F(phi)
    std::function<double(double)> stiffness;     // kappa = phi F'(phi)
  };
  static constexpr double lowest_f = -40.0;

  InverseTable() = default;
  explicit InverseTable(const std::vector<Piece>& pieces);

  [[nodiscard]] double largest_f() const { return largest_f_; }
  struct Point {
    double density;  // phi
    double slope;    // d phi/dF = phi/kappa
  };
  // phi(F) and its slope for F <= largest_f().
  [[nodiscard]] Point point(double big_f) const {
    if (big_f < lowest_f) {
      const double density = std::exp(big_f);
      return {density, density};
    }
    const Segment* segment = segments_.data();
    const Segment* last = segment + segments_.size() - 1;
    while (segment != last && big_f > segment->last_f) ++segment;
    return segment->point(big_f);
  }
  // phi(F) for F <= largest_f().
  [[nodiscard]] double density(double big_f) const {
    if (big_f < lowest_f) return std::exp(big_f);
    const Segment* segment = segments_.data();
    const Segment* last = segment + segments_.size() - 1;
    while (segment != last && big_f > segment->last_f) ++segment;
    return segment->evaluate(big_f);
  }

 private:
  struct Node {
    double value, first, second;  // phi, h phi', h^2 phi''/2
  };
  struct Segment {
    double first_f = 0.0, last_f = 0.0;
    bool logarithmic = false;  // nodes even in ln F instead of F
    double origin = 0.0, per_node = 0.0;
    std::vector<Node> nodes;
    [[nodiscard]] double evaluate(double big_f) const { return point(big_f).density; }
    [[nodiscard]] Point point(double big_f) const {
      double t = ((logarithmic ? std::log(big_f) : big_f) - origin) * per_node;
      t = std::clamp(t, 0.0, static_cast<double>(nodes.size() - 1));
      const auto i = std::min(static_cast<std::size_t>(t), nodes.size() - 2);
      const double s = t - static_cast<double>(i);
      const Node& a = nodes[i];
      const Node& b = nodes[i + 1];
      // Taylor from the left, then the cubic that meets the right end.
      const double d0 = b.value - (a.value + a.first + a.second);
      const double d1 = b.first - (a.first + 2.0 * a.second);
      const double d2 = b.second - a.second;
      const double k3 = 10.0 * d0 - 4.0 * d1 + d2;
      const double k4 = -15.0 * d0 + 7.0 * d1 - 2.0 * d2;
      const double k5 = 6.0 * d0 - 3.0 * d1 + d2;
      const double value = a.value + s * (a.first + s * (a.second + s * (k3 + s * (k4 + s * k5))));
      const double slope = a.first + s * (2.0 * a.second + s * (3.0 * k3 + s * (4.0 * k4 + s * 5.0 * k5)));
      return {value, slope * (logarithmic ? per_node / big_f : per_node)};
    }
  };
  void add_segment(const Piece& piece, double first_f, double last_f, bool logarithmic, double spacing);

  std::vector<Segment> segments_;
  double largest_f_ = 0.0;
};

}  // namespace shakebed::fit
