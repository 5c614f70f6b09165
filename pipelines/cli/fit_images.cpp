// implements: pipelines/cli/commands.hpp
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <numbers>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/run_plan.hpp"
#include "pipelines/formats/quantity.hpp"
#include "pipelines/stages/images_module.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "statistics/kernel.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

constexpr const char* default_gravity = "9.81 m/s^2";
const std::vector<std::string> polarities{"automatic", "dark", "bright"};
const std::vector<std::string> shapes{"round", "any"};
const std::vector<std::string> channels{"automatic",          "red", "green", "blue", "grey", "saturation",
                                        "background_distance"};

struct ImageArguments {
  RunArguments run;
  std::vector<std::string> files;
  std::string diameter;
  std::optional<std::string> model, scale, frequency, amplitude, frame_rate, gravity, initial_height, polarity,
      second_diameter, kernel, channel, shape;
  std::optional<double> plateau_density, floor, left_wall, right_wall, pixel_aspect, lens, radius;
  bool preview = false;
  std::optional<std::uint64_t> bead_number;
  std::vector<double> roi;
};

template <class Enum>
Enum choice_of(const std::optional<std::string>& text, const std::vector<std::string>& names) {
  return text ? static_cast<Enum>(std::find(names.begin(), names.end(), *text) - names.begin()) : Enum{};
}

int preview_images(const Call& call, const ImageArguments& image) {
  PreviewRequest request{.files = image.files, .options = {}, .folder = {}};
  request.options.diameter = quantity_argument("--diameter", image.diameter, dimension::length);
  if (image.scale) request.options.scale = quantity_argument("--scale", *image.scale, dimension::length_per_pixel);
  if (image.second_diameter)
    request.options.second_diameter = quantity_argument("--second-diameter", *image.second_diameter, dimension::length);
  request.options.roi = image.roi;
  request.options.floor = image.floor;
  request.options.left_wall = image.left_wall, request.options.right_wall = image.right_wall;
  request.options.radius = image.radius;
  request.options.polarity = choice_of<BeadPolarity>(image.polarity, polarities);
  request.options.shape = choice_of<BeadShape>(image.shape, shapes);
  request.options.channel = choice_of<BeadChannel>(image.channel, channels);
  const fs::path folder = call.out.value_or("shakebed-preview");
  fs::create_directories(folder);
  request.folder = folder.string();
  const Previewed previewed = images_module().preview(request);
  const std::string page = (folder / "preview.html").string();
  if (!previewed.found) throw StageError(fmt::format("{}. See {}", previewed.sentence, page));
  print(fmt::format("{}\nsee {}\n", previewed.sentence, page));
  return exit_ok;
}

Json kernel_json(const std::string& text) {
  const auto kernel = kernel_from(text);
  if (!kernel || kernel->kind == KernelKind::none)
    throw UsageError(
        fmt::format("--kernel: expected gaussian:WIDTH, top_hat:WIDTH or disk_chord:WIDTH (in D), got \"{}\"", text));
  return Json{{"kind", to_string(kernel->kind)}, {"width", kernel->width}};
}

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
  if (image.kernel) stage["kernel"] = kernel_json(*image.kernel);
  give("frame_rate", image.frame_rate);
  if (image.frame_rate) give("frequency", image.frequency);
  return stage;
}

// The standard error of a number that was rounded to the digits written, relative to it: of "2.5 mm" 0.1/sqrt(12)/2.5.
double rounding_error(const std::string& text) {
  const std::size_t end = text.find_first_not_of("0123456789.+-");
  const std::string number = text.substr(0, end);
  const std::size_t point = number.find('.');
  const int decimals = point == std::string::npos ? 0 : static_cast<int>(number.size() - point - 1);
  return std::pow(10, -decimals) / std::sqrt(12.0) / std::strtod(number.c_str(), nullptr);
}

// Gamma → T of the floor that was named.
Json map_stage(const ImageArguments& image) {
  const double frequency = quantity_argument("--frequency", *image.frequency, dimension::frequency);
  const double amplitude = quantity_argument("--amplitude", *image.amplitude, dimension::length);
  const double gravity =
      quantity_argument("--gravity", image.gravity.value_or(default_gravity), dimension::acceleration);
  require_positive("--frequency", frequency), require_positive("--amplitude", amplitude),
      require_positive("--gravity", gravity);
  const double omega = 2 * std::numbers::pi * frequency;
  const double gamma = amplitude * omega * omega / gravity;
  const double relative = std::hypot(rounding_error(*image.amplitude), 2 * rounding_error(*image.frequency));
  Json stage{
      {"stage", "map"}, {"from", Json::array({"fit", "extract"})}, {"gamma", gamma}, {"frequency", *image.frequency}};
  if (std::isfinite(relative)) stage["gamma_std_error"] = relative * gamma;
  if (image.initial_height) {
    const double diameter = quantity_argument("--diameter", image.diameter, dimension::length);
    const double height = diameters_argument("--initial-height", *image.initial_height, diameter);
    require_positive("--initial-height", height);
    stage["initial_height"] = height;
  }
  return stage;
}

// The recipe that the options stand for.
Json recipe_of(const ImageArguments& image) {
  Json fit{{"stage", "fit"}, {"from", "extract"}, {"plateau_density", plateau_argument(image.plateau_density)}};
  if (image.model) fit["model"] = *image.model;
  Json recipe;
  recipe["name"] = "fit-images";
  recipe["stages"] = Json::array({extract_stage(image), fit});
  recipe["stages"].push_back(Json{{"stage", "figure"}, {"from", Json::array({"extract", "fit"})}});
  if (image.frequency && image.amplitude) recipe["stages"].push_back(map_stage(image));
  recipe["report"] =
      Json{{"title", "A bed in photographs"},
           {"text",
            "The disks were found in the given frames. The scale follows from the diameter of the beads. The profile "
            "is the density of the disks' centres against the height above the floor."}};
  return recipe;
}

// Mistakes that would otherwise be located in a recipe that the user has not written.
void check_arguments(const ImageArguments& image) {
  const auto check = [](const char* name, const std::optional<std::string>& text, const Dimension& dimension) {
    if (!text) return 0.0;
    const double value = quantity_argument(name, *text, dimension);
    require_positive(name, value);
    if (!parse_quantity(*text).has_unit)
      throw UsageError(
          fmt::format("{}: \"{}\" has no unit. Write \"{}\"", name, *text, likely_quantity(*text, value, dimension)));
    return value;
  };
  const double diameter = check("--diameter", image.diameter, dimension::length);
  check("--second-diameter", image.second_diameter, dimension::length);
  check("--scale", image.scale, dimension::length_per_pixel);
  check("--amplitude", image.amplitude, dimension::length);
  check("--frequency", image.frequency, dimension::frequency);
  check("--frame-rate", image.frame_rate, dimension::frequency);
  check("--gravity", image.gravity, dimension::acceleration);
  if (const auto odd = odd_bead(diameter); odd && !impossible_bead(diameter))
    std::fputs(fmt::format("warning: --diameter: {}. {}\n", odd->what, odd->suggestion).c_str(), stderr);
  if (const auto impossible = impossible_bead(diameter))
    throw UsageError(fmt::format("--diameter: {}. {}", impossible->what, impossible->suggestion));
  for (const std::string& file : image.files) {
    if (file.find_first_of("*?[") == std::string::npos && !fs::exists(file))
      throw InputError(fmt::format("there is no file or folder \"{}\"", file));
  }
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

Plan plan_of(const ImageArguments& image) {
  try {
    return read_recipe_text(dump(recipe_of(image)), "(command line)", fs::current_path(), changes_of(image.run));
  } catch (const ConfigError& error) {
    std::vector<Problem> problems;
    for (const Problem& problem : error.problems()) problems.push_back(in_words_of_options(problem));
    throw ConfigError(std::move(problems));
  }
}

int fit_images(const Call& call, const ImageArguments& image) {
  check_arguments(image);
  Plan plan = plan_of(image);  // a preview accepts what a run accepts
  if (image.preview) return preview_images(call, image);
  return run_plan_command(call, image.run, std::move(plan));
}

// What is in the picture.
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
      ->check(CLI::IsMember(polarities));
  command.add_option("--radius", image.radius, "radius of a bead in pixels, within 25 % (default: found)")
      ->check(CLI::PositiveNumber);
  command.add_option("--channel", image.channel, "part of a colour picture that is used (default: automatic)")
      ->check(CLI::IsMember(channels));
  command
      .add_option("--shape", image.shape,
                  "round: only round outlines are beads (default); any: measure other outlines too, with a warning")
      ->check(CLI::IsMember(shapes));
  command.add_flag(
      "--preview", image.preview,
      "draw only the disks found in the first frame, with the command for each alternative; nothing else runs");
  command.add_option("--second-diameter", image.second_diameter,
                     "diameter of a second kind of beads, larger or smaller than the first, with its unit");
  command.add_option("--pixel-aspect", image.pixel_aspect, "width of a pixel over its height (default: found)");
  command.add_option("--lens", image.lens,
                     "distortion of the lens: true outward shift of the frame's corners in units of half the diagonal, "
                     "positive for a barrel (default: found)");
  command.add_option("--bead-number", image.bead_number,
                     "number of beads in view; missed and doubled beads are then reported");
}

// What is known of the bed, and how it is measured.
void add_bed_options(CLI::App& command, ImageArguments& image) {
  command.add_option("--plateau-density", image.plateau_density, plateau_help);
  command.add_option("--model", image.model,
                     "model of the fit: enskog-rectangle (default), hydrostatic:<equation of state>, fermi, rectangle");
  command.add_option("--frequency", image.frequency,
                     "frequency of the shaking: \"20 Hz\" (default: found in a film). With --amplitude, T is also "
                     "predicted from Gamma");
  command.add_option(
      "--amplitude", image.amplitude,
      "amplitude of the shaking: \"2.5 mm\". It gives the mean position of the floor and, with --frequency, Gamma");
  command.add_option(
      "--frame-rate", image.frame_rate,
      "frame rate of a film: \"500 Hz\". Velocities are then measured, and profiles by phase if the bed is shaken");
  command.add_option("--kernel", image.kernel,
                     "kernel that smooths the density, with its width in D: gaussian:0.5 (standard deviation; "
                     "default), top_hat:1 (full width) or disk_chord:1 (diameter of the disk)");
  command.add_option(
      "--initial-height", image.initial_height,
      "height mu of the bed at rest, in D or as a length (default: from the number of beads between the walls)");
  command.add_option("--gravity", image.gravity, "acceleration of gravity (default: \"9.81 m/s^2\")");
}

}  // namespace

void add_fit_images(Program& program) {
  const auto given = std::make_shared<ImageArguments>();
  CLI::App& command =
      program.add({"fit-images", "photographs or a film of your own → profile, temperature, report; no JSON needed",
                   "  shakebed fit-images photos/*.tif --diameter \"6 mm\" --out o\n"
                   "  shakebed fit-images film.mp4 --diameter \"2.99 mm\" --plateau-density 1.10"},
                  [given](const Call& call) { return fit_images(call, *given); });
  add_picture_options(command, *given);
  add_bed_options(command, *given);
  add_run_options(command, given->run);
}

}  // namespace shakebed::pipelines
