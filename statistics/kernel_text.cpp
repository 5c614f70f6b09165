// How kernels are written in files, options and messages.
// implements: statistics/kernel.hpp
#include <charconv>

#include "statistics/kernel.hpp"

namespace shakebed {

std::string_view to_string(KernelKind kind) {
  switch (kind) {
    case KernelKind::none:
      return "none";
    case KernelKind::gaussian:
      return "gaussian";
    case KernelKind::top_hat:
      return "top_hat";
    case KernelKind::disk_chord:
      return "disk_chord";
  }
  return "";
}

std::optional<KernelKind> kernel_kind_from(std::string_view name) {
  for (const KernelKind kind : kernel_kinds)
    if (to_string(kind) == name) return kind;
  return std::nullopt;
}

std::optional<Kernel> kernel_from(std::string_view text) {
  const std::size_t colon = text.find(':');
  const auto kind = kernel_kind_from(text.substr(0, colon));
  if (!kind) return std::nullopt;
  Kernel kernel{*kind, *kind == KernelKind::none ? 0.0 : *kind == KernelKind::gaussian ? 0.5 : 1.0};
  if (colon == std::string_view::npos) return kernel;
  const char *begin = text.data() + colon + 1, *end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(begin, end, kernel.width);
  if (error != std::errc() || stop != end || *kind == KernelKind::none || !kernel_is_valid(kernel)) return std::nullopt;
  return kernel;
}

std::string to_string(const Kernel& kernel) {
  std::string text(to_string(kernel.kind));
  if (kernel.kind == KernelKind::none) return text;
  char digits[32];
  const auto [end, error] = std::to_chars(digits, digits + sizeof digits, kernel.width);
  return text + ":" + std::string(digits, end);
}

}  // namespace shakebed
