#include "pipelines/stages/infer.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string_view>
#include <utility>

#include "fit/profile_fit/chances.hpp"
#include "pipelines/formats/embedded.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/stages/replica_seed.hpp"
#include "pipelines/stages/simulate_run.hpp"
#include "statistics/parallel.hpp"
#include "statistics/time_left.hpp"

namespace shakebed::pipelines {

namespace {

// Keys of a stage that describe its scene.
constexpr std::array scene_keys = {"disks", "gravity", "box", "floor", "bath", "start", "start_temperature"};
// Corners of the prior at which the scene is checked before anything runs.
constexpr std::size_t most_corners = 64;
constexpr double most_looks = 4096;  // a period
// Best beds are this far from one another, the range of a parameter being 1.
constexpr double distance_of_best = 0.3;
// Streams of seeds: beds of the design count from 1.
constexpr std::uint64_t best_stream = 1'000'000, calibration_stream = 2'000'000;

// All beds that the stage will run, in their order. What is computed between the rounds is quick beside them.
class BedsAhead {
 public:
  // `times`: what is settled and measured of each.
  BedsAhead(std::vector<double> times, int threads) : time(times.size(), threads), times_(std::move(times)) {}
  // The next beds, each with the seconds that it takes by a trial; 0: it need not run. The others are expected to take
  // as long for their times as all that were tried.
  std::size_t next(const std::vector<double>& trials) {
    const std::size_t first = next_;
    for (const double seconds : trials) {
      time.expect(next_, seconds);
      if (seconds > 0) tried_seconds_ += seconds, tried_times_ += times_[next_];
      ++next_;
    }
    if (tried_times_ > 0)
      for (std::size_t i = next_; i < times_.size(); ++i) time.expect(i, times_[i] * tried_seconds_ / tried_times_);
    return first;
  }
  void leave_out(std::size_t beds) {
    for (std::size_t i = 0; i < beds; ++i) time.drop(next_++);
  }

  TimeLeft time;

 private:
  std::vector<double> times_;
  std::size_t next_ = 0;  // the first that has not been begun
  double tried_seconds_ = 0, tried_times_ = 0;
};
struct BedToRun {
  TimeLeft& time;
  std::size_t number;  // among all
  std::string_view what;
};

class Infer : public Stage {
 public:
  void describe(Fields& fields) override;
  void results(ResultList& list) const override { state_inference(list, options_); }
  Json facts() const override { return options_.written.facts(); }
  void run(RunContext& context) const override;

 private:
  void describe_search(Fields& fields);
  void check(Fields& fields);
  void check_first_round(Fields& fields) const;
  void check_film(Fields& fields) const;
  void check_corners(Fields& fields) const;
  std::string made_from() const;
  std::vector<RunBed> earlier_beds() const;
  std::vector<RunBed> beds_in(const Json& json, const std::string& name) const;
  std::vector<double> numbers_of_run(RunContext& context, const std::string& name, const std::vector<double>& values,
                                     std::uint64_t stream, double measure, const BedToRun& bed) const;
  std::vector<RunBed> run_beds(RunContext& context, std::uint32_t round, std::size_t first_number,
                               const std::vector<std::vector<double>>& values, BedsAhead& ahead) const;
  std::vector<RunBed> design(RunContext& context, const std::vector<ScaledTarget>& targets, BedsAhead& ahead) const;
  std::vector<BestBed> best_beds(RunContext& context, const Inference& found, BedsAhead& ahead) const;
  std::vector<CalibrationRow> calibrate(RunContext& context, const Inference& found, BedsAhead& ahead) const;
  std::vector<double> bed_times() const;
  double trial(RunContext& context, const std::string& name, const std::vector<double>& values, double measure) const;
  SceneOptions scene_at(const std::vector<double>& values) const;

  InferOptions options_;
};

void Infer::describe_search(Fields& fields) {
  fields.integer("moments", options_.moments,
                 {.help = "number of equally spaced moments of the shaking that the photographs may show instead of "
                          "the average; 0: they show the average",
                  .range = from_to(0, 64)});
  fields.number("average", options_.average,
                {.help = "prior probability that the photographs show the average, where \"moments\" is above 0",
                 .range = zero_to_one});
  fields.number("phase", options_.phase,
                {.help = "phase of the shaking that the photographs show, from 0 to 1 (0: the floor passes its mean "
                         "height upwards); left out, they show the average",
                 .range = {.low = 0, .high = 1, .below_high = true}});
  fields.integer(
      "first", options_.first,
      {.help = "number of beds in the first round, spread over the whole prior", .range = from_to(8, 100'000)});
  fields.integer("part", options_.part,
                 {.help = "which part of the first round this run has, from 1 to \"parts\"; a sweep over the parts "
                          "shares the beds among machines, and \"beds\" puts them together",
                  .range = from_to(1, 10'000)});
  fields.integer("parts", options_.parts, {.help = "number of parts of the first round", .range = from_to(1, 10'000)});
  fields.integer(
      "rounds", options_.rounds,
      {.help = "number of further rounds, with beds in the region of the posterior", .range = from_to(0, 20)});
  fields.integer("each", options_.each, {.help = "number of beds in each further round", .range = from_to(1, 10'000)});
  fields.integer("best", options_.best,
                 {.help = "number of the most probable beds that are run again as a test", .range = from_to(0, 20)});
  fields.integer(
      "best_replicas", options_.replicas,
      {.help = "number of runs of each of the most probable beds, each with its own seed", .range = from_to(2, 1000)});
  fields.quantity("best_measure", options_.best_measure, dimension::time,
                  {.help = "measuring time of the runs of the most probable beds; 0: the option \"measure\"",
                   .range = non_negative});
  fields.integer("draws", options_.draws,
                 {.help = "number of draws from the posterior in posterior.csv", .range = from_to(100, 100'000)});
  fields.integer(
      "calibration", options_.calibration,
      {.help = "number of beds with known parameters, drawn from the prior, by which the intervals are tested; 0: none",
       .range = from_to(0, 10'000)});
  fields.object<MapCurve>(
      "map_curve", options_.curve,
      [](Fields& f, MapCurve& curve) {
        f.number("reduced_temperature", curve.reduced_temperature,
                 {.help = "reduced temperature T/T_c of the curve", .required = true, .range = positive});
        f.text("reading", curve.reading,
               {.help = "name of a formula of the stage map (column \"name\" of map.csv)",
                .required = true,
                .example = "\"eq6/relative_max/printed\""});
        f.text("label", curve.label, {.help = "name of the curve in the picture"});
      },
      {.help = "curve of Gamma against frequency at which a formula of the stage map gives this T/T_c"});
  fields.text("stored", options_.stored,
              {.help = "name of a file in reference-data with the beds of an earlier run (its beds.json). These beds "
                       "are used and no new ones are run"});
  fields.input_files("beds", options_.beds,
                     {.help = "beds.json of earlier runs with the same scene, parameters and measurement, for instance "
                              "of all parts of a first round. These beds are used and no new ones are run, so that "
                              "other targets cost little",
                      .example = "\"results/infer/beds.json\""});
}

void Infer::describe(Fields& fields) {
  options_.written.describe(fields);
  fields.quantity("settle", options_.bed.settle, dimension::time,
                  {.help = "time that each bed moves before its measurement begins", .range = non_negative});
  fields.quantity("measure", options_.bed.measure, dimension::time,
                  {.help = "time over which each bed is measured", .required = true, .range = positive});
  fields.integer("phases", options_.bed.phases,
                 {.help = "number of equally spaced moments in each period of the shaking at which the bed is "
                          "measured; its profile is the average over them",
                  .range = from_to(1, 4096)});
  fields.quantity("frame_rate", options_.bed.frame_rate, dimension::frequency,
                  {.help = "frame rate of the film that the targets come from, or a part of it where not every frame "
                           "was measured. Each bed is then measured at the moments "
                           "of its frames, in place of \"phases\", and temperature_x_without_flow_over_mg and "
                           "temperature_z_without_flow_over_mg are those of displacements between frames",
                   .range = positive});
  fields.number("kernel_width", options_.bed.kernel_width,
                {.help = "standard deviation of the Gaussian kernel of the profile, in D", .range = from_to(0.01, 10)});
  fields.number("plateau_density", options_.bed.plateau_density,
                {.help = "density phi_0 of the solid for the fit of the profile, in 1/D^2",
                 .range = {.low = 0, .high = 1.1547005383792517, .above_low = true}});
  fields.map<UnknownParameter>(
      "parameters", options_.parameters, [](Fields& f, UnknownParameter& p) { p.describe(f); },
      {.help = "unknown parameters: name → pointers into the scene, and prior", .required = true});
  describe_targets(fields, options_);
  describe_search(fields);
  if (fields.decoding() && fields.problem_count() == 0) check(fields);
}

// What depends on several options at once.
void Infer::check(Fields& fields) {
  BedOfInference& bed = options_.bed;
  bed.reduced = fields.reduced(), bed.source = fields.source();
  bed.scene.kind = JsonNode::Kind::object;
  for (const char* key : scene_keys) {
    if (const JsonNode* node = fields.written(key)) bed.scene.members.push_back({key, node->at, *node});
  }
  bed.views = views_of(options_.moments, options_.average, options_.phase);
  if (options_.profile) bed.heights = options_.profile->heights();
  fields.require(
      options_.written.period() > 0 && bed.measure >= options_.written.period() * options_.written.time_unit(),
      "measure", "the floor must shake, and \"measure\" must be at least one period of the floor");
  fields.require(
      !options_.parameters.empty() && options_.parameters.size() <= 12, "parameters",
      fmt::format("the stage infers from 1 to 12 parameters, but the recipe names {}", options_.parameters.size()));
  fields.require(options_.moments == 0 || bed.phases % options_.moments == 0, "moments",
                 fmt::format("\"phases\" ({}) must be a multiple of \"moments\" ({})", bed.phases, options_.moments));
  fields.require(
      !options_.phase || std::abs(*options_.phase * bed.phases - std::round(*options_.phase * bed.phases)) < 1e-9,
      "phase",
      fmt::format("this phase is not one of the {} phases at which the bed is measured; give a multiple of 1/{}",
                  bed.phases, bed.phases));
  check_film(fields);
  fields.require(options_.profile || std::any_of(options_.targets.begin(), options_.targets.end(),
                                                 [](const auto& t) { return t.has_value(); }),
                 "targets", "no target has a value: at least one measured number is needed",
                 "Give \"temperature_over_mg\" with its error");
  check_first_round(fields);
  for (const auto& [name, parameter] : options_.parameters) {
    for (const std::string& pointer : parameter.set) {
      const std::string where = "/parameters/" + escape_pointer_token(name) + "/set";
      try {
        const auto tokens = split_pointer(pointer);
        if (tokens.empty() || std::find(scene_keys.begin(), scene_keys.end(), tokens.front()) == scene_keys.end())
          fields.problem(where, "\"" + pointer + "\" is not an option of the scene",
                         "Write for example \"/floor/gamma\"");
      } catch (const UsageError& error) {
        fields.problem(where, error.what());
      }
    }
  }
  if (fields.problem_count() > 0) return;
  check_corners(fields);
  if (fields.problem_count() > 0) return;
  fields.require(options_.stored.empty() || options_.beds.empty(), "beds",
                 "beds are either stored or your own: give one of \"stored\" and \"beds\"");
  if (fields.problem_count() > 0 || !options_.uses_earlier_beds()) return;
  const std::string key = options_.beds.empty() ? "stored" : "beds";
  try {
    earlier_beds();
  } catch (const Error& error) {
    fields.problem("/" + key, error.what(), "Leave \"" + key + "\" out: the beds are then run");
  }
}

void Infer::check_first_round(Fields& fields) const {
  const std::size_t fewest = fit::Surrogate::fewest_runs(options_.dimensions());
  fields.require(
      options_.first >= fewest, "first",
      fmt::format("{} unknown parameters need at least {} beds in the first round", options_.dimensions(), fewest));
  fields.require(options_.part <= options_.parts, "part",
                 fmt::format("part {} of {} does not exist", options_.part, options_.parts));
  fields.require(options_.parts == 1 || options_.rounds == 0, "rounds",
                 "a part of the first round is followed by no further rounds", "Give \"rounds\": 0");
  fields.require(
      options_.parts == 1 || options_.first / options_.parts >= fewest, "parts",
      fmt::format("{} unknown parameters need at least {} beds in each part", options_.dimensions(), fewest));
}

// A film shows every phase, and its temperatures depend on the time between its frames.
void Infer::check_film(Fields& fields) const {
  const BedOfInference& bed = options_.bed;
  if (bed.frame_rate) {
    fields.require(options_.moments == 0 && !options_.phase, "frame_rate",
                   "a film shows every phase of the shaking, so \"frame_rate\" excludes \"phase\" and \"moments\"");
    const double frames = *bed.frame_rate * options_.written.period() * options_.written.time_unit();
    fields.require(frames >= 1 && frames <= most_looks, "frame_rate",
                   fmt::format("a period of the shaking must have 1 to {} frames, but has {:.3g}", most_looks, frames));
  }
  for (const char* axis : {"x", "z"}) {
    const std::string name = fmt::format("temperature_{}_without_flow_over_mg", axis);
    const auto& target = options_.targets[observable_number(name)];
    const bool displacements = target && target->at.ends_with("_of_displacements_over_mg");
    fields.require(!displacements || bed.frame_rate, "targets/" + name + "/at",
                   "a temperature of displacements depends on the time between the frames",
                   "Give \"frame_rate\", that of the film");
    fields.require(
        !bed.frame_rate || !target || target->at.empty() || displacements, "targets/" + name + "/at",
        "with \"frame_rate\" this target must be a temperature of displacements",
        fmt::format("Write for example \"/extract/velocities/temperature_{}_of_displacements_over_mg\"", axis));
  }
}

// Whether there is a bed at every corner of the prior.
void Infer::check_corners(Fields& fields) const {
  const std::size_t d = options_.dimensions();
  for (std::size_t corner = 0; corner < std::min(most_corners, std::size_t{1} << d); ++corner) {
    std::vector<double> values;
    std::string at;
    for (std::size_t k = 0; k < d; ++k) {
      const auto& [name, parameter] = options_.parameters[k];
      values.push_back(parameter.value((corner >> k) & 1 ? 1 : 0));
      at += fmt::format("{}{} = {}", at.empty() ? "" : ", ", name, parameter.written(values.back()).dump());
    }
    std::vector<Problem> problems;
    try {
      options_.bed.at(options_.parameters, values, problems);
    } catch (const Error& error) {
      fields.problem("/parameters", fmt::format("{} (at {})", error.what(), at));
    }
    for (const Problem& problem : problems)
      fields.problem("/parameters", fmt::format("{}: {} (at {})", problem.pointer, problem.what, at),
                     problem.suggestion);
    if (fields.problem_count() > 0) return;
  }
}

// All that the numbers of a bed depend on.
std::string Infer::made_from() const {
  Json out{{"scene", options_.bed.written_out(options_.bed.scene)},
           {"settle", options_.bed.settle},
           {"measure", options_.bed.measure},
           {"phases", options_.bed.phases},
           {"kernel_width", options_.bed.kernel_width},
           {"plateau_density", options_.bed.plateau_density}};
  for (const auto& [name, p] : options_.parameters)
    out["parameters"][name] = Json{{"set", p.set}, {"unit", p.unit}, {"values", p.values}};
  for (const View& view : options_.bed.views) out["views"].push_back(view.name);
  for (const Observable& observable : observables()) out["observables"].push_back(observable.name);
  if (!options_.bed.heights.empty()) out["heights"] = options_.bed.heights;
  if (options_.bed.frame_rate) out["frame_rate"] = *options_.bed.frame_rate;
  return dump_canonical(out);
}

SceneOptions Infer::scene_at(const std::vector<double>& values) const {
  std::vector<Problem> problems;
  SceneOptions bed = options_.bed.at(options_.parameters, values, problems);
  if (!problems.empty()) throw StageError(fmt::format("{}: {}", problems.front().pointer, problems.front().what));
  return bed;
}

// Numbers that were written down; null stands for one that is missing.
std::vector<double> numbers_in(const Json& list) {
  std::vector<double> numbers;
  for (const Json& one : list) numbers.push_back(one.is_null() ? NAN : one.get<double>());
  return numbers;
}

std::vector<RunBed> Infer::earlier_beds() const {
  if (options_.beds.empty()) {
    const EmbeddedFile* file = find_embedded("reference-data/" + options_.stored + ".json");
    if (file == nullptr) throw InputError("there is no file of stored beds named \"" + options_.stored + "\"");
    return beds_in(parse_own_json(file->text), options_.stored);
  }
  std::vector<RunBed> all;
  for (const std::string& path : options_.beds.paths) {
    const std::vector<RunBed> some = beds_in(read_json(path), path);
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

std::vector<RunBed> Infer::beds_in(const Json& json, const std::string& name) const {
  if (!json.contains("made_from") || !json.contains("beds"))
    throw InputError("\"" + name + "\" is not a beds.json of the stage infer");
  // Densities at heights that are not asked for are left out.
  Json from = json.at("made_from");
  if (from.contains("scene")) from["scene"] = options_.bed.written_out(to_node(from["scene"]));
  std::size_t more = 0;
  if (options_.bed.heights.empty() && from.contains("heights")) more = from["heights"].size(), from.erase("heights");
  if (dump_canonical(from) != made_from())
    throw InputError("the beds of \"" + name +
                     "\" were made with a different scene, different parameters or a different measurement");
  std::vector<RunBed> beds;
  for (const Json& one : json.at("beds")) {
    RunBed bed{one.at("round").get<std::uint32_t>(), one.at("values").get<std::vector<double>>(), {}};
    const std::vector<double> numbers = numbers_in(one.at("numbers"));
    for (std::size_t first = 0; first < numbers.size(); first += options_.bed.numbers() + more)
      bed.numbers.insert(bed.numbers.end(), numbers.begin() + static_cast<std::ptrdiff_t>(first),
                         numbers.begin() + static_cast<std::ptrdiff_t>(first + options_.bed.numbers()));
    beds.push_back(std::move(bed));
  }
  return beds;
}

// Of one bed; of one that was run before the stage was interrupted, as it was kept.
std::vector<double> Infer::numbers_of_run(RunContext& context, const std::string& name,
                                          const std::vector<double>& values, std::uint64_t stream, double measure,
                                          const BedToRun& bed) const {
  const std::filesystem::path file = context.scratch() / name;
  if (std::filesystem::exists(file)) {
    bed.time.drop(bed.number);
    return numbers_in(read_json(file));
  }
  bed.time.begin(bed.number);
  const auto progress = [&](double fraction) {
    bed.time.reached(bed.number, fraction);
    context.progress(bed.time.fraction(), bed.what);
  };
  const std::vector<double> numbers =
      options_.bed.run(scene_at(values), replica_seed(context.seed(), stream), measure, context, progress);
  write_file_atomically(file, dump(Json(numbers)));
  bed.time.end(bed.number);
  return numbers;
}

// Seconds that a bed will take; 0 where it was run before the stage was interrupted.
double Infer::trial(RunContext& context, const std::string& name, const std::vector<double>& values,
                    double measure) const {
  if (context.interrupted() || std::filesystem::exists(context.scratch() / name)) return 0;
  const SceneOptions bed = scene_at(values);
  return pipelines::trial_seconds(bed.scene(1), options_.bed.schedule(bed, measure));
}

std::vector<RunBed> Infer::run_beds(RunContext& context, std::uint32_t round, std::size_t first_number,
                                    const std::vector<std::vector<double>>& values, BedsAhead& ahead) const {
  std::vector<RunBed> beds(values.size());
  std::vector<double> trials(values.size(), 0);
  for_each_index(values.size(), context.jobs(), [&](std::size_t i) {
    trials[i] = trial(context, fmt::format("bed-{}.json", first_number + i), values[i], options_.bed.measure);
  });
  const std::size_t first = ahead.next(trials);
  const std::string what = fmt::format("round {}, {} beds", round, values.size());
  for_each_index(values.size(), context.jobs(), [&](std::size_t i) {
    context.check_interrupted();
    const std::size_t number = first_number + i;
    beds[i] = {round, values[i],
               numbers_of_run(context, fmt::format("bed-{}.json", number), values[i], number, options_.bed.measure,
                              {ahead.time, first + i, what})};
  });
  return beds;
}

// The beds of all rounds.
std::vector<RunBed> Infer::design(RunContext& context, const std::vector<ScaledTarget>& targets,
                                  BedsAhead& ahead) const {
  if (options_.uses_earlier_beds()) return earlier_beds();
  const std::size_t d = options_.dimensions();
  const std::vector<double> places = fit::even_points(d, options_.first, context.seed());
  std::vector<std::vector<double>> values;
  const std::size_t begin = options_.begin_of(options_.part), end = options_.begin_of(options_.part + 1);
  for (std::size_t i = begin; i < end; ++i)
    values.push_back(values_at(options_, std::span<const double>(places).subspan(i * d, d)));
  std::vector<RunBed> beds = run_beds(context, 0, 1 + begin, values, ahead);
  for (std::uint32_t round = 1; round <= options_.rounds; ++round) {
    const fit::Posterior posterior = known_parameters(context, options_, beds, targets).posterior;
    const std::vector<std::size_t> draws =
        fit::equal_draws(posterior.weight, 20 * options_.each, context.seed() + round);
    std::vector<double> points;
    for (const std::size_t i : draws) points.insert(points.end(), posterior.point(i).begin(), posterior.point(i).end());
    values.clear();
    for (const std::size_t i : fit::spread_out(d, points, options_.each, 0))
      values.push_back(values_at(options_, std::span<const double>(points).subspan(i * d, d)));
    const std::vector<RunBed> further = run_beds(context, round, 1 + beds.size(), values, ahead);
    beds.insert(beds.end(), further.begin(), further.end());
  }
  return beds;
}

// Those of greatest likelihood, apart from one another, run several times each.
std::vector<BestBed> Infer::best_beds(RunContext& context, const Inference& found, BedsAhead& ahead) const {
  const std::size_t views = options_.bed.views.size(), d = options_.dimensions();
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < found.posterior.size(); ++i) {
    if (found.posterior.weight[i] > 0) order.emplace_back(-found.posterior.log_likelihood[i], i);
  }
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> chosen;
  for (const auto& [ignored, place] : order) {
    const std::size_t i = place;
    if (chosen.size() == options_.best) break;
    const bool apart = std::all_of(chosen.begin(), chosen.end(), [&](std::size_t other) {
      double square = 0;
      for (std::size_t k = 0; k < d; ++k)
        square += std::pow(found.posterior.point(i)[k] - found.posterior.point(other)[k], 2);
      return square > distance_of_best * distance_of_best;
    });
    if (apart) chosen.push_back(i);
  }
  std::vector<BestBed> beds;
  for (const std::size_t i : chosen) {
    const auto row = found.fit.log_likelihood.begin() + static_cast<std::ptrdiff_t>(i * views);
    beds.push_back({values_at(options_, found.posterior.point(i)),
                    static_cast<std::size_t>(std::max_element(row, row + static_cast<std::ptrdiff_t>(views)) - row),
                    {}});
    beds.back().runs.resize(options_.replicas);
  }
  const std::size_t all = beds.size() * options_.replicas;
  const double measure = options_.best_measure > 0 ? options_.best_measure : options_.bed.measure;
  std::vector<double> trials;
  for (std::size_t i = 0; i < all; ++i)
    trials.push_back(i % options_.replicas == 0 || !(trials.back() > 0)
                         ? trial(context, fmt::format("best-{}.json", i), beds[i / options_.replicas].values, measure)
                         : trials.back());
  const std::size_t first = ahead.next(trials);
  ahead.leave_out((options_.best - beds.size()) * options_.replicas);
  const std::string what = fmt::format("{} runs of the most probable beds", all);
  for_each_index(all, context.jobs(), [&](std::size_t i) {
    context.check_interrupted();
    BestBed& bed = beds[i / options_.replicas];
    std::vector<double>& run = bed.runs[i % options_.replicas];
    run = numbers_of_run(context, fmt::format("best-{}.json", i), bed.values, best_stream + i, measure,
                         {ahead.time, first + i, what});
  });
  return beds;
}

// Beds with known parameters, each inferred from the beds of the first round.
// The targets that a bed of known parameters gives, with the errors of the real ones; nothing where it lacks a number.
// The bed's number has its scatter already.
std::optional<std::vector<ScaledTarget>> targets_of_bed(const RunBed& bed, std::size_t first,
                                                        std::vector<ScaledTarget> targets,
                                                        const BedSurrogate& surrogate,
                                                        const std::function<double()>& uniform) {
  bool complete = true;
  for (ScaledTarget& target : targets) {
    const double missing = std::pow(target.least_scatter, 2) - std::pow(surrogate.scatter(target.number), 2);
    const double error = std::sqrt(std::max(0.0, missing) + std::pow(target.further_error, 2));
    target.value =
        to_scale(target.number, bed.numbers[first + target.number]) + error * fit::normal_quantile(uniform());
    complete = complete && std::isfinite(target.value);
  }
  if (!complete) return std::nullopt;
  return targets;
}

// Rank and intervals of parameter k of bed i, whose true value is known.
CalibrationRow calibration_row(const fit::Posterior& posterior, const UnknownParameter& parameter, std::size_t i,
                               std::size_t k, double truth) {
  CalibrationRow row{i, k, truth, 0, 0, 0, 0, 0};
  std::vector<double> values;
  for (std::size_t p = 0; p < posterior.size(); ++p) {
    values.push_back(parameter.value(std::clamp(posterior.point(p)[k], 0.0, 1.0)));
    if (values.back() < truth) row.rank += posterior.weight[p];
  }
  row.low_68 = fit::weighted_quantile(values, posterior.weight, 0.16);
  row.high_68 = fit::weighted_quantile(values, posterior.weight, 0.84);
  row.low_95 = fit::weighted_quantile(values, posterior.weight, 0.025);
  row.high_95 = fit::weighted_quantile(values, posterior.weight, 0.975);
  return row;
}

std::vector<CalibrationRow> Infer::calibrate(RunContext& context, const Inference& found, BedsAhead& ahead) const {
  std::vector<CalibrationRow> rows;
  if (options_.calibration == 0) return rows;
  std::vector<RunBed> first;
  for (const RunBed& bed : found.beds)
    if (bed.round == 0) first.push_back(bed);
  const KnownParameters of_first = known_parameters(context, options_, first, found.targets);
  const BedSurrogate& surrogate = *of_first.all;
  const std::size_t d = options_.dimensions(), count = options_.bed.numbers();
  std::mt19937_64 generator(mixed(context.seed() + calibration_stream));
  const auto uniform = [&] { return fit::even_number(generator); };
  std::vector<std::vector<double>> values;
  for (std::uint32_t i = 0; i < options_.calibration; ++i) {
    std::vector<double> place(d);
    for (double& one : place) one = uniform();
    values.push_back(values_at(options_, place));
  }
  const std::vector<RunBed> beds = run_beds(context, 0, calibration_stream, values, ahead);
  std::size_t incomplete = 0;
  for (std::size_t i = 0; i < beds.size(); ++i) {
    double chance = uniform();
    std::size_t view = 0;
    for (; view + 1 < options_.bed.views.size() && chance > surrogate.view_prior(view); ++view)
      chance -= surrogate.view_prior(view);
    const auto targets = targets_of_bed(beds[i], view * count, found.targets, surrogate, uniform);
    if (!targets) {  // no fit: such a bed gives no targets
      ++incomplete;
      continue;
    }
    const fit::Posterior posterior = known_parameters(context, options_, first, *targets, of_first.all).posterior;
    for (std::size_t k = 0; k < d; ++k)
      rows.push_back(calibration_row(posterior, options_.parameters[k].second, i, k, values[i][k]));
    context.progress(ahead.time.fraction(), "inference of the beds of the calibration");
  }
  if (rows.empty())
    throw StageError(
        "no bed of the calibration gave all target numbers, so the intervals cannot be tested. Measure longer "
        "(\"measure\"), or set \"calibration\" to 0");
  if (incomplete > 0)
    context.warning(fmt::format(
        "{} of the {} beds of the calibration did not give all target numbers and are left out of the calibration",
        incomplete, beds.size()));
  return rows;
}

// What the posterior does without: beds that gave no numbers, moments at which too few gave any.
std::vector<std::string> missing_numbers(const InferOptions& options, const Inference& found,
                                         const BedSurrogate& surrogate) {
  std::vector<std::string> sentences;
  const auto all = found.beds.size();
  const auto given_up =
      static_cast<std::size_t>(std::count_if(found.beds.begin(), found.beds.end(), [](const RunBed& b) {
        return std::none_of(b.numbers.begin(), b.numbers.end(), [](double x) { return std::isfinite(x); });
      }));
  if (given_up > 0)
    sentences.push_back(
        fmt::format("{} of {} beds were stopped because they made too many contacts. The posterior does not cover "
                    "parameters like theirs (see beds.csv). A narrower range of the parameters excludes them",
                    given_up, all));
  for (const ScaledTarget& target : found.targets) {
    if (target.number >= observables().size()) continue;  // a profile needs no fit
    const auto used =
        static_cast<std::size_t>(std::count_if(found.beds.begin(), found.beds.end(), [&](const RunBed& b) {
          return std::isfinite(b.numbers[target.number]);
        }));
    if (used + given_up < all)
      sentences.push_back(fmt::format("{}: the fit of {} of {} beds failed, and they were left out",
                                      observables()[target.number].name, all - given_up - used, all));
  }
  std::vector<std::string> left_out;
  for (std::size_t v = 0; v < options.bed.views.size(); ++v)
    if (options.bed.views[v].prior > 0 && !(surrogate.view_prior(v) > 0)) left_out.push_back(options.bed.views[v].name);
  if (!left_out.empty())
    sentences.push_back(
        fmt::format("too many fits failed at the phases {} of the shaking: these were excluded as possible phases of "
                    "the photographs",
                    fmt::join(left_out, ", ")));
  return sentences;
}

// Of all beds in their order: what is settled and measured.
std::vector<double> Infer::bed_times() const {
  const BedOfInference& bed = options_.bed;
  const double best_measure = options_.best_measure > 0 ? options_.best_measure : bed.measure;
  const std::size_t design = options_.uses_earlier_beds()
                                 ? 0
                                 : options_.begin_of(options_.part + 1) - options_.begin_of(options_.part) +
                                       std::size_t{options_.rounds} * options_.each;
  std::vector<double> times(design, bed.settle + bed.measure);
  times.insert(times.end(), std::size_t{options_.best} * options_.replicas, bed.settle + best_measure);
  times.insert(times.end(), options_.calibration, bed.settle + bed.measure);
  return times;
}

void Infer::run(RunContext& context) const {
  Inference found;
  BedsAhead ahead(bed_times(), context.jobs());
  found.targets = scaled_targets(context, options_);
  found.beds = design(context, found.targets, ahead);
  context.progress(ahead.time.fraction(), "surrogate and posterior");
  const KnownParameters known = known_parameters(context, options_, found.beds, found.targets);
  const BedSurrogate& surrogate = *known.near;
  for (const std::string& sentence : missing_numbers(options_, found, *known.all)) context.warning(sentence);
  found.posterior = known.posterior;
  if (!(found.posterior.effective > 0))
    throw StageError(
        "all simulated beds are too far from the targets to give a posterior. Check the targets, or give wider ranges "
        "of the parameters");
  std::vector<double> inside = found.posterior.points;
  for (double& one : inside) one = std::clamp(one, 0.0, 1.0);
  found.fit = surrogate.fit(inside, found.targets);
  const std::size_t views = options_.bed.views.size();
  found.view_weight.assign(views, 0);
  std::mt19937_64 generator(mixed(context.seed() + 1));
  std::vector<std::vector<double>> share(found.posterior.size(), std::vector<double>(views, 0));
  for (std::size_t i = 0; i < found.posterior.size(); ++i) {
    if (!(found.posterior.weight[i] > 0)) continue;
    for (std::size_t v = 0; v < views; ++v) {
      share[i][v] = surrogate.view_prior(v) *
                    std::exp(found.fit.log_likelihood[i * views + v] - found.posterior.log_likelihood[i]);
      found.view_weight[v] += found.posterior.weight[i] * share[i][v];
    }
  }
  found.draws = fit::equal_draws(found.posterior.weight, options_.draws, context.seed());
  for (const std::size_t i : found.draws) {
    double chance = fit::even_number(generator);
    std::size_t view = 0;
    for (; view + 1 < views && chance > share[i][view]; ++view) chance -= share[i][view];
    found.draw_views.push_back(view);
  }
  found.best = best_beds(context, found, ahead);
  found.calibration = calibrate(context, found, ahead);
  Json stored{{"made_from", parse_own_json(made_from())}, {"beds", Json::array()}};
  for (const RunBed& bed : found.beds)
    stored["beds"].push_back(Json{{"round", bed.round}, {"values", bed.values}, {"numbers", bed.numbers}});
  write_file(context.output("beds.json"), dump(stored));
  write_inference(context, options_, known, found);
  draw_pairs(context, options_, found);
}

}  // namespace

StageRow infer_stage() {
  return {.name = "infer",
          .summary =
              "infers parameters of a scene from measured numbers: a posterior, from simulated beds over the whole "
              "prior and a surrogate of them",
          .accepts = {"fit", "extract", "simulate"},
          .most_inputs = 3,
          .uses_seed = true,
          .result = "infer.json",
          .pages = infer_pages(),
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Infer>(); }};
}

}  // namespace shakebed::pipelines
