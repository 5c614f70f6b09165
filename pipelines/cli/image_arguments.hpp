// Options of commands that measure photographs or films, and the stage "extract" that they stand for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/cli/run_plan.hpp"
#include "pipelines/formats/quantity.hpp"

namespace shakebed::pipelines {

struct ImageArguments {
  RunArguments run;
  std::vector<std::string> files;
  std::string diameter;
  std::optional<std::string> scale, frequency, amplitude, frame_rate, gravity, polarity, second_diameter, kernel,
      channel, shape;
  std::optional<double> plateau_density, floor, left_wall, right_wall, pixel_aspect, lens, radius;
  std::optional<std::uint64_t> bead_number, skip, stride, reduction;
  std::vector<double> roi;
};

inline constexpr const char* default_gravity = "9.81 m/s^2";
// Choices, in the order of their enumerations.
const std::vector<std::string>& polarity_names();
const std::vector<std::string>& shape_names();
const std::vector<std::string>& channel_names();

// What is in the picture; then frame rate, kernel, plateau density and gravity.
void add_picture_options(CLI::App& command, ImageArguments& image);
void add_film_options(CLI::App& command, ImageArguments& image);
// Mistakes that would otherwise be located in a recipe that the user has not written. Throws UsageError, or InputError
// for a file that is not there.
void check_arguments(const ImageArguments& image);
// A quantity with its unit, above 0, in SI units; 0 where it was not given. Throws UsageError.
double positive_argument(const char* name, const std::optional<std::string>& text, const Dimension& dimension);

Json extract_stage(const ImageArguments& image);
// The plan of a recipe whose first stage is extract_stage(). Throws ConfigError in the words of the options.
Plan plan_of(const Json& recipe, const ImageArguments& image);

}  // namespace shakebed::pipelines
