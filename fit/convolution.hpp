#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

#include "fit/kernel.hpp"
#include "fit/quadrature.hpp"

// A curve seen through a kernel. Internal to fit.
namespace shakebed::fit {

// Adds integral K(height - h) curve(h) dh over h in [start, edges.back()] to `sum`. curve(h) gives `Components` numbers
// (a density and its derivatives, say), and is smooth between neighbouring edges, which ascend from start. 8 Gauss
// points a panel: 1e-10 where no panel is longer than the curve's own scale and 2.6 standard deviations of a Gaussian.
template <std::size_t Components, class Curve>
void add_convolution(const Kernel& kernel, double height, std::span<const double> edges, Curve&& curve,
                     std::array<double, Components>& sum) {
  const double reach = kernel_reach(kernel);
  const double first = std::max(edges.front(), height - reach);
  const double last = std::min(edges.back(), height + reach);
  if (!(last > first)) return;
  const auto& rule = gauss_legendre<8>();
  // The variable of integration: the offset h - height for a top hat and a Gaussian; the angle for the chord of a disk,
  // where h - height = (w/2) sin(angle), K dh = (2/pi) cos^2(angle) d(angle).
  const bool chord = kernel.kind == KernelKind::disk_chord;
  const double half_width = 0.5 * kernel.width;
  const auto to_variable = [&](double h) {
    return chord ? std::asin(std::clamp((h - height) / half_width, -1.0, 1.0)) : h - height;
  };
  const double longest = kernel.kind == KernelKind::gaussian ? 2.6 * kernel.width : (chord ? 1.6 : kernel.width);
  const double gaussian_factor =
      kernel.kind == KernelKind::gaussian ? 0.5 * std::numbers::sqrt2 * std::numbers::inv_sqrtpi / kernel.width : 0.0;
  const auto panel = [&](double a, double b) {
    const double half = 0.5 * (b - a);
    const double middle = 0.5 * (a + b);
    for (std::size_t i = 0; i < 8; ++i) {
      const double x = middle + half * rule.node[i];
      double weight = half * rule.weight[i];
      double offset = x;
      if (kernel.kind == KernelKind::gaussian) {
        const double s = x / kernel.width;
        weight *= gaussian_factor * std::exp(-0.5 * s * s);
      } else if (chord) {
        const double cosine = std::cos(x);
        offset = half_width * std::sin(x);
        weight *= 2.0 * std::numbers::inv_pi * cosine * cosine;
      } else {
        weight /= kernel.width;
      }
      const std::array<double, Components> value = curve(height + offset);
      for (std::size_t c = 0; c < Components; ++c) sum[c] += weight * value[c];
    }
  };
  const auto interval = [&](double a, double b) {
    const auto pieces = static_cast<int>(std::ceil((b - a) / longest * (1.0 - 1e-9)));
    const double step = (b - a) / std::max(1, pieces);
    for (int piece = 0; piece < std::max(1, pieces); ++piece) panel(a + step * piece, a + step * (piece + 1));
  };
  double from = to_variable(first);
  const double to = to_variable(last);
  auto edge = std::upper_bound(edges.begin(), edges.end(), first);
  for (; edge != edges.end() && *edge < last; ++edge) {
    const double next = to_variable(*edge);
    if (next > from) {
      interval(from, next);
      from = next;
    }
  }
  if (to > from) interval(from, to);
}

}  // namespace shakebed::fit
