#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "fit/theory/convolution.hpp"
#include "fit/theory/equation_of_state.hpp"
#include "fit/theory/inverse_table.hpp"
#include "statistics/kernel.hpp"

// A hydrostatic tail over a rectangle, with the derivatives a fit needs. Internal to fit.
//
// The tail is phi(h) = phi(F), F = f_reference - (h - reference)/T, for h >= start; the rectangle of
// `rectangle_density` fills base..start.
namespace shakebed::fit {

struct Tail {
  static constexpr std::size_t max_parameters = 3;

  const InverseTable* table = nullptr;
  double temperature = 0.0;  // T; 0: no tail
  double base = 0.0;
  double reference = 0.0;    // a height ...
  double f_reference = 0.0;  // ... and F = ln phi + g there
  double start = 0.0;        // max(reference, base)
  double rectangle_density = 0.0;

  // Derivatives of the above by each parameter.
  std::array<double, max_parameters> d_temperature{}, d_reference{}, d_f_reference{}, d_rectangle{};

  // A jump of the density (a coexistence), from `upper` below to `lower` above the height `at`; none when upper is 0.
  struct Jump {
    double f = 0.0, lower = 0.0, upper = 0.0, at = 0.0;
  };
  Jump jump;
  // The height where the density falls most steeply, and the length of a panel there; length 0: none. With a jump:
  // none.
  double steep_at = 0.0, steep_length = 0.0;
  double end = 0.0;  // above, the density is below 1e-17

  // To be called when the rest is set.
  void prepare(const EquationOfState& equation);

  [[nodiscard]] double f_at(double height) const { return f_reference - (height - reference) * inverse_temperature_; }
  [[nodiscard]] double height_of_f(double big_f) const { return reference + temperature * (f_reference - big_f); }
  [[nodiscard]] double density(double height) const;

  // The density through a kernel.
  [[nodiscard]] double smoothed(double height, const KernelRule& rule) const;
  // The same and its derivatives by the parameters.
  [[nodiscard]] std::array<double, 1 + max_parameters> smoothed_with_gradient(double height,
                                                                              const KernelRule& rule) const;
  // The same of many heights, ascending. Through a Gaussian all share one set of nodes: the curve is computed once at
  // each, not once for every bin that sees it.
  void smoothed_with_gradient(std::span<const double> heights, const KernelRule& rule,
                              std::span<std::array<double, 1 + max_parameters>> out) const;

 private:
  // Of what the kernel leaves of (phi, slope, slope (h - reference)) of the tail at a height: everything but the
  // rectangle's share.
  [[nodiscard]] std::array<double, 1 + max_parameters> gathered(double height, const KernelRule& rule,
                                                                const std::array<double, 3>& sum) const;
  // A length of tail about `height` that 8 Gauss points integrate.
  [[nodiscard]] double panel_at(double height) const;
  // Panels of the tail from its start upwards, those that reach above `lowest`, and their nodes: the curve there, times
  // the weights of a Gaussian kernel.
  struct Nodes {
    std::vector<double> edge;  // of the panels: the lower end of the first, then the upper ends
    std::vector<double> height, phi, slope, moment;
  };
  [[nodiscard]] Nodes nodes_between(double lowest, double highest, const KernelRule& rule) const;
  [[nodiscard]] double end_of_panel(double from, double longest) const;
  [[nodiscard]] double rectangle_cover(double height, const Kernel& kernel) const;
  template <std::size_t Components, class Curve>
  void add_tail(double height, const KernelRule& rule, Curve&& curve, std::array<double, Components>& sum) const;

  double inverse_temperature_ = 0.0;
};

}  // namespace shakebed::fit
