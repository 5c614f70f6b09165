#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

#include "fit/theory/quadrature.hpp"
#include "statistics/kernel.hpp"

// A curve seen through a kernel. Internal to fit.
namespace shakebed::fit {

// A kernel prepared for integration: the whole window as a fixed rule, and what panels of it need.
//
// The variable of integration is the offset s of the curve's height from the bin's. For the chord of a disk it is the
// angle with s = (w/2) sin(angle), K ds = (2/pi) cos^2(angle) d(angle).
class KernelRule {
 public:
  explicit KernelRule(const Kernel& kernel)
      : kernel_(kernel),
        reach_(kernel_reach(kernel)),
        inverse_width_(kernel.width > 0.0 ? 1.0 / kernel.width : 0.0),
        factor_(kernel.kind == KernelKind::gaussian
                    ? 0.5 * std::numbers::sqrt2 * std::numbers::inv_sqrtpi * inverse_width_
                    : inverse_width_) {
    // 13 standard deviations in 6 panels, the chord's half turn in 2: 1e-12 for a smooth curve.
    panels_ = kernel.kind == KernelKind::gaussian ? 6 : kernel.kind == KernelKind::disk_chord ? 2 : 1;
    const double end = to_variable(reach_);
    for (int panel = 0; panel < panels_; ++panel) {
      const double a = -end + 2.0 * end * panel / panels_;
      const double b = -end + 2.0 * end * (panel + 1) / panels_;
      each_node(a, b, [&](double offset, double weight) {
        offsets_[count_] = offset;
        weights_[count_++] = weight;
      });
    }
  }

  [[nodiscard]] bool is_point() const { return kernel_.kind == KernelKind::none || !(kernel_.width > 0.0); }
  [[nodiscard]] const Kernel& kernel() const { return kernel_; }
  [[nodiscard]] double reach() const { return reach_; }
  // Length in height of a panel of the fixed rule.
  [[nodiscard]] double panel_length() const { return 2.0 * reach_ / panels_; }
  [[nodiscard]] std::span<const double> offsets() const { return {offsets_.data(), count_}; }
  [[nodiscard]] std::span<const double> weights() const { return {weights_.data(), count_}; }

  // The nodes of one panel between two offsets.
  template <class Node>
  void panel(double from, double to, Node&& node) const {
    each_node(to_variable(from), to_variable(to), node);
  }

 private:
  [[nodiscard]] double to_variable(double offset) const {
    return kernel_.kind == KernelKind::disk_chord ? std::asin(std::clamp(2.0 * offset * inverse_width_, -1.0, 1.0))
                                                  : offset;
  }
  template <class Node>
  void each_node(double a, double b, Node&& node) const {
    const auto& rule = gauss_legendre<8>();
    const double half = 0.5 * (b - a);
    const double middle = 0.5 * (a + b);
    for (std::size_t i = 0; i < 8; ++i) {
      const double x = middle + half * rule.node[i];
      const double weight = half * rule.weight[i];
      if (kernel_.kind == KernelKind::gaussian) {
        const double s = x * inverse_width_;
        node(x, weight * factor_ * std::exp(-0.5 * s * s));
      } else if (kernel_.kind == KernelKind::disk_chord) {
        const double cosine = std::cos(x);
        node(0.5 * kernel_.width * std::sin(x), weight * 2.0 * std::numbers::inv_pi * cosine * cosine);
      } else {
        node(x, weight * factor_);
      }
    }
  }

  Kernel kernel_;
  double reach_, inverse_width_, factor_;
  int panels_ = 1;
  std::size_t count_ = 0;
  std::array<double, 48> offsets_{};
  std::array<double, 48> weights_{};
};

// What a quadrature knows of a curve. The curve begins at `first`, is zero above `last`, and may be discontinuous at
// `breaks`. Between them it is smooth on the scale of `panel_at(height)`: 8 Gauss points integrate a panel of that
// length there to 1e-11.
template <class PanelAt>
struct CurveShape {
  double first, last;
  std::span<const double> breaks;
  PanelAt panel_at;
};

// Adds integral K(height - h) curve(h) dh to `sum`; curve(h) gives `Components` numbers (a density and its derivatives,
// say). Panels begin at the kernel's edge, so the rule changes with a parameter of the curve only where a break lies
// inside.
template <std::size_t Components, class PanelAt, class Curve>
void add_convolution(const KernelRule& rule, double height, const CurveShape<PanelAt>& shape, Curve&& curve,
                     std::array<double, Components>& sum) {
  const double low = height - rule.reach();
  const double high = height + rule.reach();
  const auto add = [&](double offset, double weight) {
    const std::array<double, Components> value = curve(height + offset);
    for (std::size_t c = 0; c < Components; ++c) sum[c] += weight * value[c];
  };
  bool broken = low < shape.first || high > shape.last;
  for (const double at : shape.breaks) broken = broken || (at > low && at < high);
  if (!broken && rule.panel_length() <= shape.panel_at(low) && rule.panel_length() <= shape.panel_at(high) &&
      rule.panel_length() <= shape.panel_at(height)) {
    const std::span<const double> offsets = rule.offsets();
    const std::span<const double> weights = rule.weights();
    for (std::size_t i = 0; i < offsets.size(); ++i) add(offsets[i], weights[i]);
    return;
  }
  double from = std::max(low, shape.first);
  const double end = std::min(high, shape.last);
  while (from < end) {
    double to = from + std::min(rule.panel_length(), shape.panel_at(from));
    if (to > end - 1e-3 * (to - from)) to = end;
    for (const double at : shape.breaks) {
      if (at > from && at < to) to = at;
    }
    rule.panel(from - height, to - height, add);
    from = to;
  }
}

}  // namespace shakebed::fit
