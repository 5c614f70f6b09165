#include "pipelines/cli/image_arguments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/runner/read_recipe.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "statistics/kernel.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

const std::vector<std::string>& polarity_names() {
  static const std::vector<std::string> names{"automatic", "dark", "bright"};
  return names;
}
const std::vector<std::string>& shape_names() {
  static const std::vector<std::string> names{"round", "any"};
  return names;
}
const std::vector<std::string>& channel_names() {
  static const std::vector<std::string> names{
      "automatic", "red", "green", "blue", "grey", "saturation", "background_distance", "grey_distance"};
  return names;
}

namespace {

Json kernel_json(const std::string& text) {
  const auto kernel = kernel_from(text);
  if (!kernel || kernel->kind == KernelKind::none)
    throw UsageError(
        fmt::format("--kernel: expected gaussian:WIDTH, top_hat:WIDTH or disk_chord:WIDTH (in D), got \"{}\"", text));
  return Json{{"kind", to_string(kernel->kind)}, {"width", kernel->width}};
}

// "/stages/0/bead_number" → "--bead-number": the user has written options, not a recipe.
Problem in_words_of_options(Problem problem) {
  constexpr std::string_view extract = "/stages/0/", images = "images";
  problem.file.clear();
  problem.at = {};
  if (!problem.pointer.starts_with(extract)) return problem;
  std::string key = problem.pointer.substr(extract.size());
  key.resize(std::min(key.size(), key.find('/')));
  std::replace(key.begin(), key.end(), '_', '-');
  problem.pointer = key == images ? "" : "--" + key;
  return problem;
}

}  // namespace

Json extract_stage(const ImageArguments& image) {
  Json stage{{"stage", "extract"},
             {"id", "extract"},
             {"images", Json::array()},
             {"diameter", image.diameter},
             {"overlays", 2}};
  for (const std::string& file : image.files) stage["images"].push_back(fs::absolute(file).string());
  const auto give = [&](const char* key, const auto& value) {
    if (value) stage[key] = *value;
  };
  give("scale", image.scale), give("floor", image.floor);
  give("floor_amplitude", image.amplitude);
  give("left_wall", image.left_wall), give("right_wall", image.right_wall);
  if (!image.roi.empty()) stage["roi"] = image.roi;
  give("polarity", image.polarity), give("channel", image.channel), give("radius", image.radius);
  give("shape", image.shape);
  give("second_diameter", image.second_diameter), give("gravity", image.gravity);
  give("pixel_aspect", image.pixel_aspect), give("lens", image.lens), give("bead_number", image.bead_number);
  give("skip", image.skip), give("stride", image.stride), give("reduction", image.reduction);
  if (image.kernel) stage["kernel"] = kernel_json(*image.kernel);
  give("frame_rate", image.frame_rate);
  if (image.frame_rate) give("frequency", image.frequency);
  return stage;
}

double positive_argument(const char* name, const std::optional<std::string>& text, const Dimension& dimension) {
  if (!text) return 0.0;
  const double value = quantity_argument(name, *text, dimension);
  require_positive(name, value);
  if (!parse_quantity(*text).has_unit)
    throw UsageError(
        fmt::format("{}: \"{}\" has no unit. Write \"{}\"", name, *text, likely_quantity(*text, value, dimension)));
  return value;
}

void check_arguments(const ImageArguments& image) {
  const double diameter = positive_argument("--diameter", image.diameter, dimension::length);
  positive_argument("--second-diameter", image.second_diameter, dimension::length);
  positive_argument("--scale", image.scale, dimension::length_per_pixel);
  positive_argument("--amplitude", image.amplitude, dimension::length);
  positive_argument("--frequency", image.frequency, dimension::frequency);
  positive_argument("--frame-rate", image.frame_rate, dimension::frequency);
  positive_argument("--gravity", image.gravity, dimension::acceleration);
  if (const auto odd = odd_bead(diameter); odd && !impossible_bead(diameter))
    std::fputs(fmt::format("warning: --diameter: {}. {}\n", odd->what, odd->suggestion).c_str(), stderr);
  if (const auto impossible = impossible_bead(diameter))
    throw UsageError(fmt::format("--diameter: {}. {}", impossible->what, impossible->suggestion));
  for (const std::string& file : image.files) {
    if (file.find_first_of("*?[") == std::string::npos && !fs::exists(file))
      throw InputError(fmt::format("there is no file or folder \"{}\"", file));
  }
}

Plan plan_of(const Json& recipe, const ImageArguments& image) {
  try {
    Plan plan = read_recipe_text(dump(recipe), "(command line)", fs::current_path(), changes_of(image.run));
    std::erase_if(plan.warnings, [](const Warning& one) { return one.kind == "bead"; });  // see check_arguments()
    for (Warning& one : plan.warnings) one.problem = in_words_of_options(std::move(one.problem));
    return plan;
  } catch (const ConfigError& error) {
    std::vector<Problem> problems;
    for (const Problem& problem : error.problems()) problems.push_back(in_words_of_options(problem));
    throw ConfigError(std::move(problems));
  }
}

void add_picture_options(CLI::App& command, ImageArguments& image) {
  command.add_option("files", image.files, "photographs, films, or folders of them")->required()->type_name("FILES");
  command.add_option("--diameter", image.diameter, "diameter of a bead, with its unit: \"2.99 mm\"")->required();
  command.add_option("--scale", image.scale, "length of a pixel: \"0.2 mm/px\" (default: found from the diameter)");
  command.add_option("--floor", image.floor, "row of the floor in pixels from the top (default: found)");
  command.add_option("--left-wall", image.left_wall, "column of the left wall in pixels (default: found)");
  command.add_option("--right-wall", image.right_wall, "column of the right wall in pixels (default: found)");
  command
      .add_option("--roi", image.roi,
                  "region of interest in pixels: LEFT,TOP,WIDTH,HEIGHT (default: the whole picture)")
      ->delimiter(',')
      ->expected(4);
  command.add_option("--polarity", image.polarity, "whether beads are dark or bright (default: automatic)")
      ->check(CLI::IsMember(polarity_names()));
  command.add_option("--radius", image.radius, "radius of a bead in pixels, within 25 % (default: found)")
      ->check(CLI::PositiveNumber);
  command.add_option("--channel", image.channel, "part of a picture that is used (default: automatic)")
      ->check(CLI::IsMember(channel_names()));
  command
      .add_option("--shape", image.shape,
                  "round: only round outlines are beads (default); any: measure other outlines too, with a warning")
      ->check(CLI::IsMember(shape_names()));
  command.add_option("--second-diameter", image.second_diameter,
                     "diameter of a second kind of beads, larger or smaller than the first, with its unit");
  command.add_option("--pixel-aspect", image.pixel_aspect, "width of a pixel over its height (default: found)");
  command.add_option("--lens", image.lens,
                     "distortion of the lens: true outward shift of the frame's corners in units of half the diagonal, "
                     "positive for a barrel (default: found)");
  command.add_option("--bead-number", image.bead_number,
                     "number of beads in view; missed and doubled beads are then reported");
  command.add_option("--skip", image.skip, "number of frames that are left out at the beginning (default: 0)");
}

void add_film_options(CLI::App& command, ImageArguments& image) {
  command.add_option("--plateau-density", image.plateau_density, plateau_help);
  command.add_option(
      "--frame-rate", image.frame_rate,
      "frame rate of a film: \"500 Hz\". Velocities are then measured, and profiles by phase if the bed is shaken");
  command.add_option("--kernel", image.kernel,
                     "kernel that smooths the density, with its width in D: gaussian:0.5 (standard deviation; "
                     "default), top_hat:1 (full width) or disk_chord:1 (diameter of the disk)");
  command.add_option("--gravity", image.gravity, "acceleration of gravity (default: \"9.81 m/s^2\")");
}

}  // namespace shakebed::pipelines
