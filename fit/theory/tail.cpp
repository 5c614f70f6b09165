#include "fit/theory/tail.hpp"

#include <algorithm>
#include <numbers>
#include <vector>

#include "statistics/fast_exp.hpp"

namespace shakebed::fit {

void Tail::prepare(const EquationOfState& equation) {
  start = std::max(reference, base);
  jump = {};
  steep_length = 0.0;
  inverse_temperature_ = 0.0;
  if (!(temperature > 0.0)) return;
  inverse_temperature_ = 1.0 / temperature;
  end = std::max(start, height_of_f(InverseTable::lowest_f));
  const std::span<const double> breaks = equation.breaks();
  if (breaks.size() == 2) {
    const double at = std::log(breaks[0]) + equation.excess(breaks[0]);
    if (at < f_at(start)) jump = {at, breaks[0], breaks[1], height_of_f(at)};
  }
  const EquationOfState::Steep steep = equation.steep();
  if (steep.length > 0.0 && steep.f < f_at(start))
    steep_at = height_of_f(steep.f), steep_length = steep.length * temperature;
}

// phi(F) is smooth on the scale F/2 at high density, on the scale 3 about F = 0 (its nearest complex singularity lies
// about pi away there), and an exponential below.
double Tail::panel_at(double height) const {
  const double panel = temperature * std::max(2.2, 0.22 * f_at(height));
  // Just below freezing the fluid's stiffness almost vanishes: phi(F) has a branch point 0.01 beyond the jump.
  if (steep_length > 0.0) return std::min(panel, steep_length + 0.6 * std::abs(height - steep_at));
  if (jump.upper > 0.0 && height >= jump.at) return std::min(panel, 0.01 * temperature + 0.8 * (height - jump.at));
  return panel;
}

template <std::size_t Components, class Curve>
void Tail::add_tail(double height, const KernelRule& rule, Curve&& curve, std::array<double, Components>& sum) const {
  const auto panel = [this](double h) { return panel_at(h); };
  const std::span<const double> breaks(jump.upper > 0.0 ? &jump.at : &steep_at,
                                       jump.upper > 0.0 || steep_length > 0.0 ? 1 : 0);
  const CurveShape<decltype(panel)> shape{start, end, breaks, panel};
  add_convolution<Components>(rule, height, shape, curve, sum);
}

double Tail::density(double height) const {
  if (height < base) return 0.0;
  if (height <= start && start > base) return rectangle_density;
  if (!(temperature > 0.0)) return height <= start ? rectangle_density : 0.0;
  return table->density(f_at(height));
}

double Tail::rectangle_cover(double height, const Kernel& kernel) const {
  if (!(start > base)) return 0.0;
  return kernel_cumulative(kernel, height - base) - kernel_cumulative(kernel, height - start);
}

double Tail::smoothed(double height, const KernelRule& rule) const {
  if (rule.is_point()) return density(height);
  std::array<double, 1> sum{rectangle_density * rectangle_cover(height, rule.kernel())};
  if (temperature > 0.0) {
    add_tail<1>(
        height, rule, [&](double h) { return std::array<double, 1>{table->density(f_at(h))}; }, sum);
  }
  return sum[0];
}

std::array<double, 1 + Tail::max_parameters> Tail::smoothed_with_gradient(double height, const KernelRule& rule) const {
  // The tail's derivatives are slope (A_p + B_p (h - reference)) with A_p = dF_ref + d_ref/T, B_p = dT/T^2: so three
  // integrals (phi, slope, slope (h - reference)) give them all.
  std::array<double, 3> sum{};
  if (rule.is_point()) {
    std::array<double, 1 + max_parameters> out{};
    if (height < base) return out;
    if (height <= start && start > base) {
      out[0] = rectangle_density;
      for (std::size_t p = 0; p < max_parameters; ++p) out[1 + p] = d_rectangle[p];
      return out;
    }
    if (!(temperature > 0.0)) return out;
    const InverseTable::Point point = table->point(f_at(height));
    sum = {point.density, point.slope, point.slope * (height - reference)};
  } else if (temperature > 0.0) {
    add_tail<3>(
        height, rule,
        [&](double h) {
          const InverseTable::Point point = table->point(f_at(h));
          return std::array<double, 3>{point.density, point.slope, point.slope * (h - reference)};
        },
        sum);
  }
  return gathered(height, rule, sum);
}

std::array<double, 1 + Tail::max_parameters> Tail::gathered(double height, const KernelRule& rule,
                                                            const std::array<double, 3>& sum) const {
  const double cover = rule.is_point() ? 0.0 : rectangle_cover(height, rule.kernel());
  std::array<double, 1 + max_parameters> out{};
  out[0] = sum[0] + rectangle_density * cover;
  double at_jump = 0.0;  // the height of a jump moves with the parameters
  if (!rule.is_point() && jump.upper > 0.0) {
    at_jump = (jump.upper - jump.lower) * kernel_density(rule.kernel(), height - jump.at);
  }
  for (std::size_t p = 0; p < max_parameters; ++p) {
    double derivative = cover * d_rectangle[p];
    if (temperature > 0.0) {
      derivative += sum[1] * (d_f_reference[p] + d_reference[p] * inverse_temperature_) +
                    sum[2] * d_temperature[p] * inverse_temperature_ * inverse_temperature_;
      derivative +=
          at_jump * (d_reference[p] + d_temperature[p] * (f_reference - jump.f) + temperature * d_f_reference[p]);
    }
    out[1 + p] = derivative;
  }
  return out;
}

namespace {

constexpr std::size_t panel_points = 8;

}  // namespace

double Tail::end_of_panel(double from, double longest) const {
  double to = std::min(end, from + std::min(longest, panel_at(from)));
  if (jump.upper > 0.0 && jump.at > from && jump.at < to) to = jump.at;
  if (steep_length > 0.0 && steep_at > from && steep_at < to) to = steep_at;
  return to;
}

Tail::Nodes Tail::nodes_between(double lowest, double highest, const KernelRule& rule) const {
  const auto& gauss = gauss_legendre<panel_points>();
  const double factor = 0.5 * std::numbers::sqrt2 * std::numbers::inv_sqrtpi / rule.kernel().width;
  Nodes nodes;
  for (double from = start; from < std::min(end, highest);) {
    const double to = end_of_panel(from, rule.panel_length());
    if (!(to > from)) break;
    if (to > lowest) {
      const double half = 0.5 * (to - from);
      const double middle = 0.5 * (to + from);
      for (std::size_t i = 0; i < panel_points; ++i) {
        const double h = middle + half * gauss.node[i];
        const InverseTable::Point point = table->point(f_at(h));
        const double weight = half * gauss.weight[i] * factor;
        nodes.height.push_back(h);
        nodes.phi.push_back(weight * point.density);
        nodes.slope.push_back(weight * point.slope);
        nodes.moment.push_back(weight * point.slope * (h - reference));
      }
      if (nodes.edge.empty()) nodes.edge.push_back(from);
      nodes.edge.push_back(to);
    }
    from = to;
  }
  return nodes;
}

void Tail::smoothed_with_gradient(std::span<const double> heights, const KernelRule& rule,
                                  std::span<std::array<double, 1 + max_parameters>> out) const {
  const bool shares = rule.kernel().kind == KernelKind::gaussian && !rule.is_point() && temperature > 0.0;
  if (!shares || heights.size() < 2) {
    for (std::size_t i = 0; i < heights.size(); ++i) out[i] = smoothed_with_gradient(heights[i], rule);
    return;
  }
  const Nodes nodes = nodes_between(heights.front() - rule.reach(), heights.back() + rule.reach(), rule);
  std::vector<double> kernel(nodes.height.size());
  const std::size_t panels = kernel.size() / panel_points;
  std::size_t first = 0;
  std::size_t last = 0;
  const double inverse_width = 1.0 / rule.kernel().width;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    // All panels that the kernel touches, whole: beyond its reach it is below 1e-9 of itself, and smooth.
    while (first < panels && nodes.edge[first + 1] <= heights[i] - rule.reach()) ++first;
    last = std::max(last, first);
    while (last < panels && nodes.edge[last] < heights[i] + rule.reach()) ++last;
    const std::size_t from = first * panel_points;
    const std::size_t to = last * panel_points;
    for (std::size_t j = from; j < to; ++j) {
      const double s = (nodes.height[j] - heights[i]) * inverse_width;
      kernel[j] = fast_exp(-0.5 * s * s);
    }
    std::array<std::array<double, 4>, 3> sum{};
    for (std::size_t j = from; j < to; j += 4) {
      for (std::size_t lane = 0; lane < 4; ++lane) {
        sum[0][lane] += kernel[j + lane] * nodes.phi[j + lane];
        sum[1][lane] += kernel[j + lane] * nodes.slope[j + lane];
        sum[2][lane] += kernel[j + lane] * nodes.moment[j + lane];
      }
    }
    const auto total = [](const std::array<double, 4>& lanes) { return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]); };
    out[i] = gathered(heights[i], rule, {total(sum[0]), total(sum[1]), total(sum[2])});
  }
}

}  // namespace shakebed::fit
