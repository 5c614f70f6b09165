// Arguments of commands that are quantities, and what commands print.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "pipelines/formats/json.hpp"
#include "pipelines/formats/quantity.hpp"

namespace shakebed::pipelines {

// To stdout, at once. Throws StageError.
void print(std::string_view text);

// These throw UsageError with the option's name.
void require_positive(const char* name, double value);
double quantity_argument(const std::string& name, const std::string& text, const Dimension& wanted);
// --diameter: above 0, and a warning for a bead of metres [m].
double diameter_argument(const std::string& text);
// A length with its unit, or a plain number of diameters [D].
double diameters_argument(const std::string& name, const std::string& text, std::optional<double> diameter);
// --plateau-density, by default that of close packing [1/D^2].
double plateau_argument(std::optional<double> given);

// What the option --plateau-density says of itself.
inline constexpr const char* plateau_help = "density phi_0 of the solid in 1/D^2 (default 2/sqrt 3)";
inline constexpr const char* initial_height_help = "height mu of the bed at rest: in D, or a length with its unit";

}  // namespace shakebed::pipelines
