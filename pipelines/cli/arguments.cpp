#include "pipelines/cli/arguments.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "fit/theory/equation_of_state.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/stages/scene_options.hpp"

namespace shakebed::pipelines {

void print(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw StageError("the result cannot be written to stdout; check that the disk is not full");
}

void require_positive(const char* name, double value) {
  if (!(value > 0)) throw UsageError(fmt::format("{}: must be above 0, got {}", name, number_text(value)));
}

double quantity_argument(const std::string& name, const std::string& text, const Dimension& wanted) {
  try {
    return parse_quantity(text, wanted);
  } catch (const std::invalid_argument& problem) {
    throw UsageError(
        fmt::format("{}: {}: expected {} such as \"{}\"", name, problem.what(), name_of(wanted), example_of(wanted)));
  }
}

double diameter_argument(const std::string& text) {
  const double diameter = quantity_argument("--diameter", text, dimension::length);
  require_positive("--diameter", diameter);
  if (const auto odd = odd_bead(diameter))
    std::fputs(fmt::format("warning: --diameter: {}. {}\n", odd->what, odd->suggestion).c_str(), stderr);
  return diameter;
}

double diameters_argument(const std::string& name, const std::string& text, std::optional<double> diameter) {
  try {
    const Quantity quantity = parse_quantity(text, &dimension::length);
    if (!quantity.has_unit) return quantity.value;
    if (quantity.dimension != dimension::length)
      throw UsageError(fmt::format(
          "{}: \"{}\" is not a length; write for example \"30 mm\", or a plain number of diameters", name, text));
    if (!diameter)
      throw UsageError(fmt::format(
          "{}: a length needs --diameter as well; give --diameter, or write a plain number of diameters", name));
    return quantity.value / *diameter;
  } catch (const std::invalid_argument& problem) {
    throw UsageError(fmt::format("{}: {}", name, problem.what()));
  }
}

double plateau_argument(std::optional<double> given) {
  const double density = given.value_or(fit::close_packing_density);
  if (!(density > 0) || density > fit::close_packing_density * (1 + 1e-12)) {
    throw UsageError(fmt::format("--plateau-density: must be above 0 and at most {} (close packing), got {}",
                                 number_text(fit::close_packing_density), number_text(density)));
  }
  return density;
}

}  // namespace shakebed::pipelines
