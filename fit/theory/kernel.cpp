#include "fit/theory/kernel.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace shakebed::fit {

std::string_view to_string(KernelKind kind) {
  switch (kind) {
    case KernelKind::none:
      return "none";
    case KernelKind::top_hat:
      return "top-hat";
    case KernelKind::gaussian:
      return "gaussian";
    case KernelKind::disk_chord:
      return "disk-chord";
  }
  return "unknown";
}

bool kernel_kind_from_string(std::string_view name, KernelKind& kind) {
  for (const KernelKind candidate :
       {KernelKind::none, KernelKind::top_hat, KernelKind::gaussian, KernelKind::disk_chord}) {
    if (to_string(candidate) == name) {
      kind = candidate;
      return true;
    }
  }
  return false;
}

double kernel_density(const Kernel& kernel, double offset) {
  const double s = std::abs(offset) / kernel.width;
  switch (kernel.kind) {
    case KernelKind::none:
      return 0.0;
    case KernelKind::top_hat:
      return s <= 0.5 ? 1.0 / kernel.width : 0.0;
    case KernelKind::gaussian:
      return std::exp(-0.5 * s * s) * (0.5 * std::numbers::sqrt2 * std::numbers::inv_sqrtpi) / kernel.width;
    case KernelKind::disk_chord:  // chord/area = (8/(pi w^2)) sqrt(w^2/4 - s^2)
      return s < 0.5 ? 8.0 * std::numbers::inv_pi * std::sqrt(0.25 - s * s) / kernel.width : 0.0;
  }
  return 0.0;
}

double kernel_cumulative(const Kernel& kernel, double offset) {
  if (kernel.kind == KernelKind::none || !(kernel.width > 0.0)) return offset < 0.0 ? 0.0 : 1.0;
  const double s = offset / kernel.width;
  switch (kernel.kind) {
    case KernelKind::none:
      break;
    case KernelKind::top_hat:
      return std::clamp(s + 0.5, 0.0, 1.0);
    case KernelKind::gaussian:
      return 0.5 * std::erfc(-s * (0.5 * std::numbers::sqrt2));
    case KernelKind::disk_chord: {
      const double u = std::clamp(2.0 * s, -1.0, 1.0);
      return 0.5 + std::numbers::inv_pi * (u * std::sqrt(1.0 - u * u) + std::asin(u));
    }
  }
  return offset < 0.0 ? 0.0 : 1.0;
}

double kernel_reach(const Kernel& kernel) {
  switch (kernel.kind) {
    case KernelKind::none:
      return 0.0;
    case KernelKind::top_hat:
      return 0.5 * kernel.width;
    case KernelKind::gaussian:
      return 6.5 * kernel.width;
    case KernelKind::disk_chord:
      return 0.5 * kernel.width;
  }
  return 0.0;
}

bool kernel_is_valid(const Kernel& kernel) {
  return kernel.kind == KernelKind::none || (std::isfinite(kernel.width) && kernel.width >= 0.0);
}

}  // namespace shakebed::fit
