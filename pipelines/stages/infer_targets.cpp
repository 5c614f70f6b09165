// implements: pipelines/stages/infer.hpp
// What was measured: single numbers, and a density profile at several heights.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/profile_csv.hpp"
#include "pipelines/stages/infer.hpp"

namespace shakebed::pipelines {

namespace {

constexpr double most_target_heights = 60;  // of a profile: time grows with their third power
constexpr double nothing = 0.01;            // a profile that ends with less holds nothing above [1/D^2]
constexpr double of_a_step = 1e-9;          // by which heights may miss the end of their range

const char* includes_scatter_help =
    "whether the standard error includes the scatter between beds with the same parameters, as that of a film or of a "
    "simulated bed does. The scatter then is not counted twice";

void describe_number(Fields& f, InferTarget& target, const Observable& observable) {
  for (const auto& [key, number, help] :
       {std::tuple{"value", &target.value, "measured value"},
        std::tuple{"std_error", &target.std_error, "standard error of the measured value"}}) {
    if (!f.describes(target.at.empty())) continue;
    if (observable.is_length)
      f.quantity(key, *number, dimension::length, {.help = help, .range = non_negative});
    else
      f.number(key, *number, {.help = help});
  }
  if (f.describes(!target.at.empty()))
    f.text("at", target.at,
           {.help = "pointer to a number of a stage in \"from\", in place of a value: /fit/temperature_over_mg"});
  f.boolean("includes_scatter", target.includes_scatter, {.help = includes_scatter_help});
  if (!f.decoding()) return;
  f.require(f.has("value") != f.has("at"), "value", "a target has either \"value\" or \"at\"");
  f.require(!observable.logarithmic || f.has("at") || target.value > 0, "value", "the measured value must be above 0");
  f.require(target.std_error >= 0, "std_error", "a standard error cannot be negative");
  if (!target.at.empty()) f.check_result("/at", target.at);
}

void describe_profile_target(Fields& f, ProfileTarget& profile) {
  if (f.describes(!profile.from.empty()))
    f.text("from", profile.from, {.help = "stage in \"from\" whose profile this is", .example = "\"extract\""});
  f.text("table", profile.table,
         {.help = "table of that stage: profile.csv, or profile_phase_03.csv for one phase of a film"});
  if (f.describes(!profile.file.empty()))
    f.input_files(
        "file", profile.file,
        {.help = "CSV file of your own profile, in place of \"from\", with columns height [D], number_density "
                 "[1/D^2] and std_error",
         .example = "\"profile.csv\""});
  f.number("low", profile.low, {.help = "lowest height at which densities are compared, in D", .required = true});
  f.number("high", profile.high, {.help = "greatest height at which densities are compared, in D", .required = true});
  f.number("spacing", profile.spacing,
           {.help = "distance between these heights, in D; less than the width of the kernel adds nothing",
            .range = from_to(0.1, 10)});
  f.boolean("includes_scatter", profile.includes_scatter, {.help = includes_scatter_help});
  if (!f.decoding()) return;
  f.require(f.has("from") != f.has("file"), "from", "a profile has either \"from\" or \"file\"");
  f.require(profile.file.paths.size() <= 1, "file", "one profile is compared, but several files are named");
  f.require(profile.low < profile.high, "low", "\"low\" must be below \"high\"");
  if (!(profile.low < profile.high)) return;
  // As many as heights() has: with a wrong unit their list would not fit into memory.
  const double heights = std::floor((profile.high - profile.low) / profile.spacing + of_a_step) + 1;
  f.require(
      heights <= most_target_heights, "spacing",
      fmt::format("the profile is compared at {} heights at most, but these are {}", most_target_heights, heights),
      "Give a larger \"spacing\", or a smaller range of heights");
  const auto& from = f.from();
  f.require(profile.from.empty() ||
                std::any_of(from.begin(), from.end(), [&](const StatedStage& one) { return one.id == profile.from; }),
            "from", "there is no stage \"" + profile.from + "\" in the stage's \"from\"");
}

// Slope of the profile at a height, from the rows about it.
double slope_at(const ProfileTable& profile, double height) {
  const double step = 0.1;
  return (value_at(profile.height, profile.number_density, height + step) -
          value_at(profile.height, profile.number_density, height - step)) /
         (2 * step);
}

// What the scale of the pictures and the place of the floor add to the errors of the densities. With a length of a
// pixel that is too large by a small part e, heights are too large by e z, and densities too small by 2 e n.
struct PlaceErrors {
  double scale = 0, floor = 0;  // relative; [D]
  double operator()(const ProfileTable& profile, double height) const {
    const double density = value_at(profile.height, profile.number_density, height), slope = slope_at(profile, height);
    return std::hypot(scale * (2 * density + height * slope), floor * slope);
  }
};
PlaceErrors place_errors(const Input& input) {
  if (input.stage != "extract") return {};
  const Json result = input.result();
  const auto number = [&](const char* pointer) {
    const Json* found = find_pointer(result, pointer);
    return found != nullptr && found->is_number() ? found->get<double>() : 0.0;
  };
  const double scale = number("/scale/value");
  return {number("/scale/std_error") / scale, number("/floor/std_error") * scale / number("/diameter/value")};
}

}  // namespace

std::vector<double> ProfileTarget::heights() const {
  std::vector<double> out;
  for (std::size_t i = 0; low + spacing * static_cast<double>(i) <= high + spacing * of_a_step; ++i)
    out.push_back(low + spacing * static_cast<double>(i));
  return out;
}

void describe_targets(Fields& fields, InferOptions& options) {
  struct Targets {};
  Targets none;
  options.targets.resize(observables().size());
  fields.object<Targets>("targets", none,
                         [&options](Fields& f, Targets&) {
                           for (std::size_t k = 0; k < observables().size(); ++k) {
                             const Observable& observable = observables()[k];
                             f.object<InferTarget>(observable.name, options.targets[k],
                                                   [&observable](Fields& g, InferTarget& target) {
                                                     describe_number(g, target, observable);
                                                   },
                                                   {.help = observable.meaning});
                           }
                           f.object<ProfileTarget>("profile", options.profile, describe_profile_target,
                                                   {.help = "measured density profile, compared at several heights"});
                         },
                         {.help = "measured numbers with their errors", .required = true});
}

namespace {

// An error that includes the scatter of a bed is not to count it twice: the larger of the two counts. The error alone
// would not do, since a short film does not tell how far a bed wanders that keeps its motion for long: T_x of 24
// simulated beds over twelve periods was off by 32 % (root mean square; from longer runs), where 11 % were stated.
ScaledTarget scaled(std::size_t number, double value, double error, bool includes_scatter) {
  ScaledTarget out{number, to_scale(number, value), error * slope_of_scale(number, value)};
  (includes_scatter ? out.least_scatter : out.further_error) = out.error;
  return out;
}

// Displacements depend on the time between frames: the beds are to be looked at as often as the film was.
void require_same_frame_rate(const InferTarget& target, const Json& result, const InferOptions& options) {
  const Json* found = find_pointer(result, "/velocities/frame_rate/value");
  if (!target.at.ends_with("_of_displacements_over_mg") || found == nullptr || !options.bed.frame_rate) return;
  constexpr double rounding = 1e-6;
  const double film = found->get<double>(), beds = *options.bed.frame_rate;
  if (std::abs(film / beds - 1) > rounding)
    throw InputError(fmt::format(
        "{}: these displacements are between frames at {} Hz, but the beds of the inference are seen at {} Hz. "
        "Give \"frame_rate\": \"{} Hz\"",
        target.at, number_text(film), number_text(beds), number_text(film)));
}

// A temperature as a length is one in m or in D, and one in m g D is none.
void require_same_unit(const InferTarget& target, const Json& found, const InferOptions& options,
                       const Observable& observable) {
  const std::string wanted = unit_of(options, observable);
  if (found.contains("unit") && found["unit"] != wanted)
    throw InputError(fmt::format("{}: this number is in {}, but {} of the inference is in {}. Point to a number in {}",
                                 target.at, found["unit"].get<std::string>(), observable.name, wanted, wanted));
}

ScaledTarget number_target(const RunContext& context, const InferOptions& options, std::size_t k) {
  InferTarget target = *options.targets[k];
  if (!target.at.empty()) {
    const std::string id = split_pointer(target.at).front();
    const Json result = context.input_from(id).result();
    const Json* found = find_pointer(result, target.at.substr(1 + escape_pointer_token(id).size()));
    if (found == nullptr || !found->contains("value") || !(*found)["value"].is_number())
      throw InputError(
          fmt::format("{}: the result at this pointer is not a number, so it cannot be a target", target.at));
    require_same_frame_rate(target, result, options);
    require_same_unit(target, *found, options, observables()[k]);
    target.value = (*found)["value"].get<double>();
    if (found->contains("std_error")) {
      const Json& error = (*found)["std_error"];
      if (!error.is_number())
        throw InputError(fmt::format("{}: this number has no standard error, so it cannot be a target", target.at));
      target.std_error = std::hypot(target.std_error, error.get<double>());
    }
  }
  if (observables()[k].logarithmic && !(target.value > 0))
    throw InputError(
        fmt::format("{}: the target must be above 0, but is {}", observables()[k].name, number_text(target.value)));
  return scaled(k, target.value, target.std_error, target.includes_scatter);
}

std::vector<ScaledTarget> profile_targets(const RunContext& context, const InferOptions& options) {
  const ProfileTarget& target = *options.profile;
  const bool from_stage = !target.from.empty();
  const std::filesystem::path path =
      from_stage ? context.input_from(target.from).file(target.table) : std::filesystem::path(target.file.paths[0]);
  const ProfileTable profile = read_profile_csv(path);
  // Beds are measured as long as a film, so that their scatter is that of its profile. What a film of few periods
  // states may be more, since the density near the floor goes up and down with it: 0.044 where beds scatter by 0.016.
  const bool filmed = from_stage && target.includes_scatter && options.bed.frame_rate;
  const PlaceErrors more = from_stage ? place_errors(context.input_from(target.from)) : PlaceErrors{};
  const Kernel wanted{KernelKind::gaussian, options.bed.kernel_width};
  if (profile.std_error.empty())
    throw InputError(path.string() + ": the profile has no standard errors, so it cannot be a target");
  if (profile.kernel && !(*profile.kernel == wanted))
    throw InputError(fmt::format(
        "{}: the profile was measured through the kernel {}, but the beds of the inference are measured through {}. "
        "Give \"kernel_width\" the width of the profile's kernel",
        path.string(), to_string(*profile.kernel), to_string(wanted)));
  std::vector<ScaledTarget> out;
  for (std::size_t i = 0; i < options.bed.heights.size(); ++i) {
    const double height = options.bed.heights[i];
    // Tables end where no disk was seen any more. The error is then that of the last row.
    const bool above = height > profile.height.back() && profile.number_density.back() < nothing;
    if (height < profile.height.front() || (height > profile.height.back() && !above))
      throw InputError(
          fmt::format("{}: the profile has heights from {:g} to {:g} D, but a density at {:g} D is to be "
                      "compared. Change \"low\" or \"high\"",
                      path.string(), profile.height.front(), profile.height.back(), height));
    const std::size_t number = observables().size() + i;
    const double density = above ? 0 : value_at(profile.height, profile.number_density, height);
    const double place = more(profile, height), slope = slope_of_scale(number, density);
    const double error = std::hypot(value_at(profile.height, profile.std_error, height), place);
    out.push_back(scaled(number, density, error, target.includes_scatter));
    if (filmed) out.back().least_scatter = 0, out.back().further_error = place * slope;
  }
  return out;
}

}  // namespace

std::string unit_of(const InferOptions& options, const Observable& observable) {
  if (!observable.is_length) return std::string(observable.unit);
  return options.bed.reduced ? "D" : "m";
}

std::vector<ScaledTarget> scaled_targets(const RunContext& context, const InferOptions& options) {
  std::vector<ScaledTarget> out;
  for (std::size_t k = 0; k < options.targets.size(); ++k)
    if (options.targets[k]) out.push_back(number_target(context, options, k));
  if (options.profile) {
    const std::vector<ScaledTarget> more = profile_targets(context, options);
    out.insert(out.end(), more.begin(), more.end());
  }
  return out;
}

}  // namespace shakebed::pipelines
