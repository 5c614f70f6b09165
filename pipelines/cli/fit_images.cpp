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
#include "pipelines/cli/frame_budget.hpp"
#include "pipelines/cli/image_arguments.hpp"
#include "pipelines/cli/run_plan.hpp"
#include "pipelines/formats/quantity.hpp"
#include "pipelines/runner/budget.hpp"
#include "pipelines/stages/images_module.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "statistics/kernel.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

struct FitImagesArguments : ImageArguments {
  std::optional<std::string> model, initial_height, budget;
  bool preview = false;
};

template <class Enum>
Enum choice_of(const std::optional<std::string>& text, const std::vector<std::string>& names) {
  return text ? static_cast<Enum>(std::find(names.begin(), names.end(), *text) - names.begin()) : Enum{};
}

int preview_images(const Call& call, const FitImagesArguments& image) {
  PreviewRequest request{.files = image.files, .options = {}, .folder = {}};
  request.options.diameter = quantity_argument("--diameter", image.diameter, dimension::length);
  if (image.scale) request.options.scale = quantity_argument("--scale", *image.scale, dimension::length_per_pixel);
  if (image.second_diameter)
    request.options.second_diameter = quantity_argument("--second-diameter", *image.second_diameter, dimension::length);
  request.options.roi = image.roi;
  request.options.floor = image.floor;
  request.options.left_wall = image.left_wall, request.options.right_wall = image.right_wall;
  request.options.radius = image.radius;
  request.options.pixel_aspect = image.pixel_aspect, request.options.lens_radial = image.lens;
  request.options.bead_number = image.bead_number;
  request.options.skip = image.skip.value_or(0), request.options.stride = image.stride.value_or(1);
  request.options.polarity = choice_of<BeadPolarity>(image.polarity, polarity_names());
  request.options.shape = choice_of<BeadShape>(image.shape, shape_names());
  request.options.channel = choice_of<BeadChannel>(image.channel, channel_names());
  const fs::path folder = call.out.value_or("shakebed-preview");
  fs::create_directories(folder);
  request.folder = folder.string();
  const Previewed previewed = images_module().preview(request);
  const std::string page = (folder / "preview.html").string();
  if (!previewed.found) throw StageError(fmt::format("{}. See {}", previewed.sentence, page));
  print(fmt::format("{}\nsee {}\n", previewed.sentence, page));
  return exit_ok;
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
Json map_stage(const FitImagesArguments& image) {
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
Json recipe_of(const FitImagesArguments& image) {
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

// Of a preview, too, which does not use it: the same options are for the run after it.
std::optional<Budget> budget_of(const FitImagesArguments& image) {
  if (!image.budget) return std::nullopt;
  if (image.frame_rate)
    throw UsageError("--budget: velocities need successive frames, so it cannot be combined with --frame-rate");
  return parse_budget(*image.budget);
}

// --budget: a part of the frames.
int fit_some_images(const Call& call, const FitImagesArguments& image, const Budget& budget) {
  Console console(level_of(call));
  FitImagesArguments some = image;
  const auto plan = [&some](std::uint64_t stride, std::optional<std::uint64_t> reduction) {
    some.stride = stride, some.reduction = reduction;
    return plan_of(recipe_of(some), some);
  };
  install_interrupt_handler();
  const fs::path out = out_of(call, plan(1, {}).name);
  const BudgetedFrames chosen = frames_by_budget(
      {budget, image.files, image.skip.value_or(0), out, image.run.jobs, image.run.force, plan}, console);
  some.run.chosen = chosen.record;
  Json answer;
  const int code =
      run_plan_command(call, some.run, plan(chosen.stride, chosen.reduction), console, call.json ? &answer : nullptr);
  if (code == exit_ok && !image.run.dry_run) say_reached_by_frames(out, chosen.record, console);
  if (call.json) print(dump(answer));
  return code;
}

int fit_images(const Call& call, const FitImagesArguments& image) {
  check_arguments(image);
  const std::optional<Budget> budget = budget_of(image);
  Plan plan = plan_of(recipe_of(image), image);  // a preview accepts what a run accepts
  if (image.preview) return preview_images(call, image);
  if (budget) return fit_some_images(call, image, *budget);
  return run_plan_command(call, image.run, std::move(plan));
}

// What is known of the bed.
void add_bed_options(CLI::App& command, FitImagesArguments& image) {
  command.add_option("--model", image.model,
                     "model of the fit: enskog-rectangle (default), hydrostatic:<equation of state>, fermi, rectangle");
  command.add_option("--frequency", image.frequency,
                     "frequency of the shaking: \"20 Hz\" (default: found in a film). With --amplitude, T is also "
                     "predicted from Gamma");
  command.add_option(
      "--amplitude", image.amplitude,
      "amplitude of the shaking: \"2.5 mm\". It gives the mean position of the floor and, with --frequency, Gamma");
  command.add_option(
      "--initial-height", image.initial_height,
      "height mu of the bed at rest, in D or as a length (default: from the number of beads between the walls)");
}

}  // namespace

void add_fit_images(Program& program) {
  const auto given = std::make_shared<FitImagesArguments>();
  CLI::App& command =
      program.add({"fit-images", "photographs or a film of your own → profile, temperature, report; no JSON needed",
                   "  shakebed fit-images photos/*.tif --diameter \"6 mm\" --out o\n"
                   "  shakebed fit-images film.mp4 --diameter \"2.99 mm\" --plateau-density 1.10"},
                  [given](const Call& call) { return fit_images(call, *given); });
  add_picture_options(command, *given);
  command.add_flag(
      "--preview", given->preview,
      "draw only the disks found in the first frame, with the command for each alternative; nothing else runs");
  command
      .add_option("--budget", given->budget,
                  "wanted statistical error of T (\"1 %\") or wanted wall time (\"30 s\"). A short pilot run then "
                  "chooses how many of the frames are measured, and whether pixels are averaged. With --dry-run only "
                  "the pilot runs")
      ->type_name("ERROR|TIME");
  add_bed_options(command, *given);
  add_film_options(command, *given);
  add_run_options(command, given->run);
}

}  // namespace shakebed::pipelines
