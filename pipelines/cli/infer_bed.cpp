// implements: pipelines/cli/commands.hpp
// Two runs in one folder: first the frames are measured, then a recipe is written whose beds have their width and
// number of disks, and whose targets are what was measured.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/image_arguments.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/profile_csv.hpp"
#include "statistics/kernel.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

// Periods of the shaking that a bed settles, and that it is measured at most.
constexpr double settling_periods = 50, most_periods = 100;
// Densities are compared from this height on, one diameter apart, as far up as they exceed this and twice their error.
constexpr double lowest_height = 0.5, least_seen_density = 0.02;  // [D], [1/D^2]
constexpr double fewest_heights = 4;
// Where neither an option nor a film tells Gamma. Below 2 a bed hardly moves.
const std::vector<double> default_gamma{2, 8};
// The range of a Gamma that the film tells, in its standard errors.
constexpr double range_of_measured = 5;

struct InferBedArguments : ImageArguments {
  std::vector<double> gamma, restitution{0.3, 0.98}, friction{0, 0.8};
  std::optional<double> phase;
  int beds = 160;
};

// What of the frames' results the inference needs.
struct MeasuredBed {
  double diameter = 0, width = 0, frequency = 0;  // [m], [D], [Hz]
  double frequency_error = 0;                     // relative
  std::int64_t count = 0;                         // of disks between the walls
  double highest = 0;                             // at which the density is compared [D]
  bool velocities = false;
  double time = 0, frame_rate = 0;            // of the film [s], [Hz]; 0: photographs
  double amplitude = 0, amplitude_error = 0;  // of the floor in a film [m]; 0: not seen
};

Json measuring_stages(const InferBedArguments& given) {
  return Json::array(
      {extract_stage(given),
       Json{{"stage", "fit"}, {"from", "extract"}, {"plateau_density", plateau_argument(given.plateau_density)}},
       Json{{"stage", "figure"}, {"from", Json::array({"extract", "fit"})}}});
}

double highest_of(const ProfileTable& profile) {
  double highest = lowest_height;
  for (std::size_t i = 0; i < profile.size(); ++i) {
    const double error = profile.std_error.empty() ? 0 : profile.std_error[i];
    if (profile.number_density[i] > std::max(least_seen_density, 2 * error))
      highest = std::max(highest, profile.height[i]);
  }
  return lowest_height + std::floor(highest - lowest_height);
}

MeasuredBed measured_bed(const fs::path& out, const InferBedArguments& given) {
  const fs::path folder = out / "extract";
  const Json result = read_json(folder / "extract.json");
  const auto number = [&](const char* pointer) -> std::optional<double> {
    const Json* found = find_pointer(result, pointer);
    return found != nullptr && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
  };
  MeasuredBed bed;
  bed.diameter = positive_argument("--diameter", given.diameter, dimension::length);
  bed.width = number("/width/value").value_or(0);
  if (given.frequency)
    bed.frequency = positive_argument("--frequency", given.frequency, dimension::frequency);
  else if (const auto found = number("/frequency/value"))
    bed.frequency = *found, bed.frequency_error = number("/frequency/std_error").value_or(0) / *found;
  else
    throw StageError(
        "the frequency of the shaking is not known. Give --frequency, or for a film of a moving floor --frame-rate");
  if (given.bead_number)
    bed.count = static_cast<std::int64_t>(*given.bead_number);
  else if (const auto column = number("/column_number/value"))
    bed.count = std::llround(*column * bed.width);
  else
    throw StageError(
        "the number of beads is not known, because the upper border of the frames cuts beads. Give it with "
        "--bead-number, or take frames that show the whole bed");
  bed.highest = highest_of(read_profile_csv(folder / "profile.csv"));
  if (bed.highest < lowest_height + fewest_heights - 1)
    throw StageError(fmt::format(
        "the density exceeds twice its error only up to {:g} D, and an inference needs {:g} D. Give more "
        "photographs of the bed (here {:g}) or a longer film, which reduces the error, or take a higher bed",
        bed.highest, lowest_height + fewest_heights - 1, number("/frames").value_or(0)));
  const Json* usable = find_pointer(result, "/velocities/usable");
  bed.amplitude = number("/floor_amplitude/value").value_or(0);
  bed.amplitude_error = number("/floor_amplitude/std_error").value_or(0);
  if (given.frame_rate) {
    bed.frame_rate = positive_argument("--frame-rate", given.frame_rate, dimension::frequency);
    bed.time = number("/frames").value_or(0) / bed.frame_rate;
  }
  bed.velocities = usable != nullptr && usable->is_boolean() && usable->get<bool>();
  return bed;
}

Json parameter(const std::vector<std::string>& set, const std::vector<double>& range, const char* why) {
  return Json{{"set", set}, {"low", range[0]}, {"high", range[1]}, {"why", why}};
}

Json targets_of(const MeasuredBed& bed) {
  Json targets;
  targets["profile"] = Json{{"from", "extract"}, {"low", lowest_height}, {"high", bed.highest}};
  if (!bed.velocities) return targets;
  // The film's temperatures are those without the mean motion at each height. Displacements of disks between frames are
  // compared with those in the simulated beds, so that none needs a correction for collisions meanwhile.
  for (const char* axis : {"x", "z"})
    targets[fmt::format("temperature_{}_without_flow_over_mg", axis)] =
        Json{{"at", fmt::format("/extract/velocities/temperature_{}_of_displacements_over_mg", axis)},
             {"includes_scatter", true}};
  return targets;
}

// Beds are measured as long as the film, so that they scatter as it does. Where a film is longer, it scatters less.
double measured_periods(const MeasuredBed& bed) {
  if (!(bed.time > 0)) return most_periods;
  return std::clamp(std::round(bed.time * bed.frequency), 1.0, most_periods);
}

double middle(const std::vector<double>& range) { return (range[0] + range[1]) / 2; }

// Gamma of the scene as written. It is a parameter unless the amplitude is given: with the amplitude of the floor in a
// film as its prior, or over a range.
double gamma_of(const InferBedArguments& given, const MeasuredBed& bed, double gravity, Json& parameters) {
  const double omega = 2 * std::numbers::pi * bed.frequency, per_amplitude = omega * omega / gravity;
  if (given.amplitude) return per_amplitude * positive_argument("--amplitude", given.amplitude, dimension::length);
  if (!given.gamma.empty() || !(bed.amplitude > 0 && bed.amplitude_error > 0)) {
    const std::vector<double>& range = given.gamma.empty() ? default_gamma : given.gamma;
    parameters["gamma"] = parameter({"/floor/gamma"}, range, "the range of --gamma");
    return middle(range);
  }
  const double gamma = per_amplitude * bed.amplitude,
               error = gamma * std::hypot(bed.amplitude_error / bed.amplitude, 2 * bed.frequency_error);
  parameters["gamma"] = parameter(
      {"/floor/gamma"}, {std::max(0.5 * gamma, gamma - range_of_measured * error), gamma + range_of_measured * error},
      "the amplitude of the floor in the film");
  parameters["gamma"]["mean"] = gamma, parameters["gamma"]["std_error"] = error;
  return gamma;
}

// The stage that infers. Floor and sides are of the beads' material.
Json inference_stage(const InferBedArguments& given, const MeasuredBed& bed) {
  const std::string gravity = given.gravity.value_or(default_gravity);
  const double restitution = middle(given.restitution), friction = middle(given.friction);
  Json parameters;
  const double gamma =
      gamma_of(given, bed, quantity_argument("--gravity", gravity, dimension::acceleration), parameters);
  parameters["restitution"] = parameter({"/disks/restitution", "/floor/restitution", "/box/sides/restitution"},
                                        given.restitution, "the range of --restitution");
  parameters["friction"] = parameter({"/disks/friction", "/floor/friction", "/box/sides/friction"}, given.friction,
                                     "the range of --friction");
  const auto seconds = [&](double periods) { return number_text(periods / bed.frequency) + " s"; };
  const Json material{{"restitution", restitution}, {"friction", friction}};
  Json disks = material, floor = material, sides = material;
  disks.update(Json{{"count", bed.count}, {"diameter", given.diameter}, {"inertia", "sphere"}});
  floor.update(Json{{"motion", "sinusoidal"}, {"gamma", gamma}, {"frequency", number_text(bed.frequency) + " Hz"}});
  sides.update(Json{{"kind", "hard"}});
  Json stage{
      {"stage", "infer"},
      {"id", "infer"},
      {"from", "extract"},
      {"disks", std::move(disks)},
      {"gravity", gravity},
      {"box", {{"width", number_text(bed.width * bed.diameter) + " m"}, {"sides", std::move(sides)}, {"lid", "open"}}},
      {"floor", std::move(floor)},
      {"settle", seconds(settling_periods)},
      {"measure", seconds(measured_periods(bed))},
      {"plateau_density", plateau_argument(given.plateau_density)},
      {"parameters", std::move(parameters)},
      {"targets", targets_of(bed)},
      {"first", given.beds},
      {"rounds", 2},
      {"each", std::max(1, given.beds / 3)}};
  if (bed.velocities) stage["frame_rate"] = number_text(bed.frame_rate) + " Hz";
  if (given.kernel) stage["kernel_width"] = kernel_from(*given.kernel)->width;
  if (given.phase) stage["phase"] = *given.phase;
  return stage;
}

void check_inference(const InferBedArguments& given) {
  check_arguments(given);
  const auto check = [](const char* name, const std::vector<double>& range, double least, double most) {
    if (!(range[0] < range[1]) || range[0] < least || range[1] > most)
      throw UsageError(fmt::format("{}: expected LOW,HIGH with LOW below HIGH, both from {:g} to {:g}; got {:g},{:g}",
                                   name, least, most, range[0], range[1]));
  };
  if (!given.gamma.empty()) check("--gamma", given.gamma, 0.1, 1000);
  check("--restitution", given.restitution, 0, 1);
  check("--friction", given.friction, 0, 10);
  if (given.phase && given.frame_rate)
    throw UsageError("--phase: a film (--frame-rate) shows all phases of the shaking. Leave out one of the two");
  if (!given.kernel) return;
  const auto kernel = kernel_from(*given.kernel);
  if (!kernel || kernel->kind != KernelKind::gaussian)
    throw UsageError("--kernel: the beds of an inference are measured through a Gaussian. Write gaussian:WIDTH (in D)");
}

// Of the options of a run, those for the stages that measure the frames.
RunArguments measuring_part(RunArguments run) {
  std::erase_if(run.settings, [](const std::string& setting) { return setting.starts_with("/stages/infer"); });
  run.only = run.from = run.until = std::nullopt;
  run.dry_run = false;
  return run;
}

int infer_bed(const Call& call, const InferBedArguments& given) {
  check_inference(given);
  Json recipe{{"name", "infer-bed"}, {"stages", measuring_stages(given)}};
  recipe["report"] =
      Json{{"title", "What the frames say about the bed"},
           {"text",
            "The disks were found in the given frames. Simulated beds of as many disks, with parameters "
            "over the whole ranges, were then compared with the measured profile and, for a film, "
            "with temperatures from displacements between frames. These are below T_x and T_z, since "
            "beads collide between frames. Floor and side walls are taken to be of the beads' material, and the beads "
            "to be spheres that touch no plate in front or behind."}};
  Call measuring = call;
  measuring.json = true;  // its results are shown with those of the inference
  Json ignored;
  Console console(level_of(call));  // for both runs: what the first has warned of is not said again
  InferBedArguments frames = given, all = given;
  frames.run = measuring_part(given.run);
  if (const int code = run_plan_command(measuring, frames.run, plan_of(recipe, frames), console, &ignored);
      code != exit_ok)
    return code;
  if (given.run.force) all.run.force = false, all.run.from = "infer";  // the frames have just been measured
  recipe["stages"].push_back(inference_stage(given, measured_bed(out_of(call, "infer-bed"), given)));
  return run_plan_command(call, all.run, plan_of(recipe, all), console, nullptr);
}

void add_prior_options(CLI::App& command, InferBedArguments& given) {
  const auto range = [&command](const char* name, std::vector<double>& ends, const char* help) {
    command.add_option(name, ends, help)->delimiter(',')->expected(2)->type_name("LOW,HIGH");
  };
  command.add_option("--frequency", given.frequency, "frequency of the shaking: \"20 Hz\" (default: found in a film)");
  command.add_option("--amplitude", given.amplitude,
                     "amplitude of the shaking: \"2.5 mm\". Gamma is then known and is not inferred");
  range("--gamma", given.gamma,
        "possible values of Gamma (default: from the amplitude of the floor in a film, else 2,8)");
  range("--restitution", given.restitution, "possible values of the restitution (default: 0.3,0.98)");
  range("--friction", given.friction, "possible values of the friction coefficient (default: 0,0.8)");
  command.add_option("--phase", given.phase,
                     "phase of the shaking that all frames show, from 0 to 1 (0: the floor rises through its mean "
                     "height); default: they show all phases alike");
  command.add_option("--beds", given.beds, "number of simulated beds in the first of three rounds")
      ->check(CLI::Range(20, 100000))
      ->capture_default_str();
}

}  // namespace

void add_infer_bed(Program& program) {
  const auto given = std::make_shared<InferBedArguments>();
  CLI::App& command = program.add(
      {"infer-bed", "photographs or a film of your own → restitution, friction and Gamma with intervals",
       "  shakebed infer-bed film.mp4 --diameter \"2.99 mm\" --frequency \"20 Hz\" --frame-rate \"500 Hz\" --out o\n"
       "  shakebed infer-bed photos/*.tif --diameter \"6 mm\" --frequency \"15 Hz\" --amplitude \"5 mm\""},
      [given](const Call& call) { return infer_bed(call, *given); });
  add_picture_options(command, *given);
  add_prior_options(command, *given);
  add_film_options(command, *given);
  add_run_options(command, given->run);
}

}  // namespace shakebed::pipelines
