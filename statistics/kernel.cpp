#include "statistics/kernel.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace shakebed {
namespace {

constexpr double gaussian_reach = 6.5;  // in standard deviations: leaves out 8e-11 of the area
constexpr double edge = 1e-12;          // centres so near to the edge of a top hat lie on it [D]

// A Gaussian about `centre` (in grid points), by grid points from `first` to `last`, added to `density`. Ratios from
// point to point need two exponentials instead of one a point; k points away the result is exact to 1e-16 k.
class GaussianAdder {
 public:
  GaussianAdder(const HeightGrid& grid, const Kernel& kernel, double weight)
      : weight_(weight), step_(grid.spacing / kernel.width) {
    const double most =
        std::min(static_cast<double>(grid.points), std::floor(2 * kernel_reach(kernel) / grid.spacing) + 2);
    falls_.resize(static_cast<std::size_t>(most));
    for (std::size_t k = 0; k < falls_.size(); ++k) {
      const double away = static_cast<double>(k) * step_;
      falls_[k] = std::exp(-0.5 * away * away);
    }
  }
  void operator()(double centre, double first, double last, std::span<double> density) const {
    const double nearest = std::clamp(std::round(centre), first, last);
    const double away = (nearest - centre) * step_;
    const double value = weight_ * std::exp(-0.5 * away * away), ratio = std::exp(-away * step_);
    const auto middle = static_cast<std::size_t>(nearest);
    const auto above = static_cast<std::size_t>(last - nearest), below = static_cast<std::size_t>(nearest - first);
    density[middle] += value;
    double here = value;
    for (std::size_t k = 1; k <= above; ++k) density[middle + k] += falls_[k] * (here *= ratio);
    here = value;
    const double downwards = 1 / ratio;
    for (std::size_t k = 1; k <= below; ++k) density[middle - k] += falls_[k] * (here *= downwards);
  }

 private:
  double weight_, step_;
  std::vector<double> falls_;  // exp(-k^2 step^2/2)
};

double normalisation(const Kernel& kernel) {
  return kernel.kind == KernelKind::gaussian ? 1 / (kernel.width * std::sqrt(2 * std::numbers::pi)) : 1 / kernel.width;
}

}  // namespace

bool kernel_is_valid(const Kernel& kernel) {
  return kernel.kind == KernelKind::none || (std::isfinite(kernel.width) && kernel.width >= 0);
}

double kernel_reach(const Kernel& kernel) {
  switch (kernel.kind) {
    case KernelKind::none:
      return 0;
    case KernelKind::gaussian:
      return gaussian_reach * kernel.width;
    case KernelKind::top_hat:
    case KernelKind::disk_chord:
      return 0.5 * kernel.width;
  }
  return 0;
}

double kernel_density(const Kernel& kernel, double offset) {
  const double s = std::abs(offset) / kernel.width;
  switch (kernel.kind) {
    case KernelKind::none:
      return 0;
    case KernelKind::gaussian:
      return std::exp(-0.5 * s * s) * (0.5 * std::numbers::sqrt2 * std::numbers::inv_sqrtpi) / kernel.width;
    case KernelKind::top_hat:
      return s <= 0.5 ? 1 / kernel.width : 0;
    case KernelKind::disk_chord:  // chord/area = (8/(pi w^2)) sqrt(w^2/4 - s^2)
      return s < 0.5 ? 8 * std::numbers::inv_pi * std::sqrt(0.25 - s * s) / kernel.width : 0;
  }
  return 0;
}

double kernel_cumulative(const Kernel& kernel, double offset) {
  const double step = offset < 0 ? 0 : 1;
  if (kernel.kind == KernelKind::none || !(kernel.width > 0)) return step;
  const double s = offset / kernel.width;
  switch (kernel.kind) {
    case KernelKind::none:
      break;
    case KernelKind::gaussian:
      return 0.5 * std::erfc(-s * (0.5 * std::numbers::sqrt2));
    case KernelKind::top_hat:
      return std::clamp(s + 0.5, 0.0, 1.0);
    case KernelKind::disk_chord: {
      const double u = std::clamp(2 * s, -1.0, 1.0);
      return 0.5 + std::numbers::inv_pi * (u * std::sqrt(1 - u * u) + std::asin(u));
    }
  }
  return step;
}

void add_density(const HeightGrid& grid, const Kernel& kernel, double width, std::span<const double> centres,
                 double shift, std::span<double> density) {
  if (kernel.kind == KernelKind::none || !(kernel.width > 0) || !std::isfinite(kernel.width) || !(grid.spacing > 0) ||
      !(width > 0))
    throw std::invalid_argument("add_density: the kernel's, the grid's and the bed's width must be above 0");
  const double reach = kernel_reach(kernel);
  const double weight = normalisation(kernel) / width;
  std::optional<GaussianAdder> add_gaussian;
  if (kernel.kind == KernelKind::gaussian) add_gaussian.emplace(grid, kernel, weight);
  for (const double centre : centres) {
    const double place = (centre - shift - grid.lowest) / grid.spacing;
    if (std::isnan(place)) {  // nowhere in particular: not to be left out
      std::fill(density.begin(), density.end(), place);
      return;
    }
    const double first = std::max(0.0, std::ceil(place - (reach + edge) / grid.spacing));
    const double last =
        std::min(static_cast<double>(grid.points) - 1, std::floor(place + (reach + edge) / grid.spacing));
    if (!(first <= last)) continue;
    if (add_gaussian) {
      (*add_gaussian)(place, first, last, density);
      continue;
    }
    for (auto i = static_cast<std::size_t>(first); i <= static_cast<std::size_t>(last); ++i) {
      const double distance = (static_cast<double>(i) - place) * grid.spacing;
      if (kernel.kind == KernelKind::disk_chord)
        density[i] += kernel_density(kernel, distance) / width;
      else
        density[i] += std::abs(std::abs(distance) - reach) < edge ? 0.5 * weight : weight;
    }
  }
}

}  // namespace shakebed
