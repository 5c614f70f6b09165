#include "pipelines/stages/simulate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "pipelines/stages/annealing.hpp"
#include "pipelines/stages/bed_judgement.hpp"
#include "pipelines/stages/bed_measurement.hpp"
#include "pipelines/stages/bed_results.hpp"
#include "pipelines/stages/effort.hpp"
#include "pipelines/stages/measure_options.hpp"
#include "pipelines/stages/replica_seed.hpp"
#include "pipelines/stages/replicas.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "pipelines/stages/simulate_run.hpp"
#include "sim/engine/random.hpp"
#include "sim/measure/contact_duration.hpp"
#include "sim/measure/measure.hpp"
#include "statistics/rest.hpp"
#include "statistics/time_left.hpp"

namespace shakebed::pipelines {

namespace {

// A shaken bed that dissipates may keep for long how it was filled. Four beds, two of them filled at random, give
// errors that hold the mean of further beds: the study is in docs/thermometer.md.
constexpr std::uint32_t replicas_of_shaken = 4;

// For --budget. Lengths are in periods of the floor, or as many times of 4 sqrt(D/g) where it stands still. With pilots
// of 16 beds for up to 32 periods 20 beds each, asked for 5, 2 and 1 %, had rms errors of 2.5, 1.5 and 0.9 %,
// where 2.6, 1.5 and 0.8 % was expected. With 8 beds for up to 64 periods one of 20 beds asked for 2 % was off by 9 %.
constexpr double shortest_measure = 16, telling_measure = 32, time_of_still_bed = 4;
// Contact durations [sqrt(D/g)] are shortened by tens down to this one. At 1e-6 the effect on T was at most 0.03 % in
// three beds (e = 0.8 to 0.95, 0 and 0.3 friction, Gamma = 3 and 4), for up to 1.2 times the time of 1e-4. At 1e-7 a
// dense bed took 10 times as long.
constexpr double shortest_contact_duration = 1e-6, refinement_factor = 10;

class Simulate : public Stage, public Scalable {
 public:
  void describe(Fields& fields) override;
  void results(ResultList& list) const override {
    state_bed_results(list, {.reduced = bed_.description().reduced,
                             .weightless = bed_.weightless(),
                             .periodic_upwards = bed_.periodic_upwards(),
                             .judged = bed_.gamma() > 0,
                             .contact_duration = bed_.contact_duration() > 0,
                             .material = bed_.hertz_contact_time().has_value(),
                             .shaken = bed_.period() > 0,
                             .frames = measure_.keeps_frames(),
                             .named_phases = measure_.names_phases(),
                             .annealed = !annealing_.empty(),
                             .tilted = bed_.tilt() && !bed_.description().reduced,
                             .free_lid = bed_.has_free_lid(),
                             .rubs = bed_.rubs(),
                             .two_species = bed_.two_species(),
                             .replicas = replicas(),
                             .observe = ObserveOptions::from(observe_)});
  }
  Json facts() const override { return bed_.facts(); }
  bool keeps_frames() const override { return measure_.keeps_frames(); }
  void run(RunContext& context) const override;
  double trial_seconds() const override {
    RunPlan plan;
    plan.scene = bed_.scene(1);
    plan.schedule = looks().schedule;
    plan.measurement = measurement_plan(plan.scene);
    RunMeasurement measurement(plan);
    return replicas() * pipelines::trial_seconds(plan.scene, plan.schedule, {&measurement});
  }
  std::optional<BedDescription> bed() const override;

  const Scalable* scalable() const override { return this; }
  std::string number() const override { return "T_x"; }
  std::string systematic_cause() const override { return "the contact duration"; }
  std::string systematic_remedy() const override { return "a shorter \"contact_duration\" in \"disks\""; }
  EffortLimits limits() const override;
  Changes changes(const Effort& effort) const override;
  Changes pilot_changes(const Effort& effort) const override;
  EffortReading read(const Effort& effort, const Json& result, const Json& timings) const override;

 private:
  double time_of_bed() const;                        // in the unit of "measure"
  double contact_duration_at(int refinement) const;  // reduced
  Json option(double value, const Dimension& wanted) const {
    return bed_.description().reduced ? Json(value) : Json(quantity_text(value, wanted));
  }
  void check(Fields& fields);
  void check_heights(Fields& fields);
  sim::MeasureOptions measure_options() const;  // reduced; the bed settles after the annealing
  sim::LookPlan looks() const { return sim::plan_looks(bed_.period(), measure_options()); }
  FramePlan frame_plan() const;
  double annealing_time() const;
  std::uint32_t replicas() const { return replicas_.value_or(1); }  // once check() has chosen
  sim::Scene scene(const RunContext& context, std::uint64_t seed) const;
  MeasurementPlan measurement_plan(const sim::Scene& scene) const;
  ReplicaStarts starts_of_replicas(const RunContext& context) const;
  RunPlan run_plan(RunContext& context, std::uint32_t replica) const;
  void warn_of_contact_duration(RunContext& context, const Json& results) const;
  void write_joined(RunContext& context, const std::vector<std::unique_ptr<BedRun>>& runs) const;

  SceneOptions bed_;
  BedMeasureOptions measure_;
  std::vector<AnnealingStep> annealing_;
  std::vector<std::string> observe_;
  std::optional<std::uint32_t> replicas_;
  ReplicaStarts starts_ = ReplicaStarts::alternate;
  double checkpoint_seconds_ = 30;
  bool compress_ = true;
};

void Simulate::describe(Fields& fields) {
  bed_.describe(fields);
  measure_.describe(fields);
  fields.array<AnnealingStep>(
      "schedule", annealing_,
      [](Fields& f, AnnealingStep& step) {
        f.quantity("temperature", step.temperature, dimension::length,
                   {.help = "temperature of the bath, T/(m g)", .required = true, .range = positive});
        f.quantity("ramp", step.ramp, dimension::time,
                   {.help = "time in which T changes linearly to this temperature, from that of the previous step (or "
                            "of the bath)",
                    .range = non_negative});
        f.quantity(
            "hold", step.hold, dimension::time,
            {.help = "time at this temperature; its second half is averaged for schedule.csv", .range = non_negative});
      },
      {.help = "annealing before the bed settles: temperatures of the bath, one after the other. The last temperature "
               "is kept for the measurement"});
  fields.texts("observe", observe_,
               {.help = "additional measurements: order (psi_6, neighbours, vacancies), velocities (a2, histogram), "
                        "displacement, pressure (by height, exact time averages), phases (means by height and phase), "
                        "species (temperatures of two species)"});
  fields.integer(
      "replicas", replicas_,
      {.help = "number of beds, each with its own seed. The results are means over the beds, and the errors include "
               "the differences between beds. Default: 4 for a shaken, dissipative bed without a lid, else 1",
       .range = from_to(1, 10'000)});
  fields.choice(
      "replica_starts", starts_, {{ReplicaStarts::alternate, "alternate"}, {ReplicaStarts::same, "same"}},
      {.help = "start of the replicas. Alternate: on a shaken floor every second bed starts from random positions, so "
               "the scatter between beds shows the effect of the start. Same: all beds start like the first"});
  fields.number(
      "checkpoint_seconds", checkpoint_seconds_,
      {.help =
           "time between checkpoints, in seconds: a killed run continues from its last checkpoint; 0: no checkpoints",
       .range = non_negative});
  fields.boolean("compress", compress_,
                 {.help = "whether the trajectory is compressed (trajectory.extxyz.zst instead of trajectory.extxyz)"});
  if (fields.decoding()) check(fields);
}

void Simulate::check(Fields& fields) {
  for (const std::string& name : observe_) {
    const auto& known = ObserveOptions::names();
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    const std::string nearest = nearest_name(name, known);
    fields.problem("/observe", "\"" + name + "\" is not one of the additional measurements",
                   nearest.empty() ? "Choose from: order, velocities, displacement, pressure, phases, species"
                                   : "Did you mean \"" + nearest + "\"?");
  }
  if (fields.problem_count() > 0) return;
  fields.require(annealing_.empty() || bed_.bath_temperature() > 0, "schedule",
                 "\"schedule\" changes the temperature of a bath, and this bed has no bath with a temperature",
                 "Give a \"bath\": langevin, andersen or thermal_floor");
  for (std::size_t k = 0; k < annealing_.size(); ++k)
    fields.require(annealing_[k].ramp + annealing_[k].hold > 0, "schedule/" + std::to_string(k),
                   "the step has no duration", "Give \"ramp\" or \"hold\"");
  fields.require(!ObserveOptions::from(observe_).species || bed_.two_species(), "observe",
                 "\"species\" needs two different species of disks",
                 "Give \"disks\" a \"second\" species of another diameter or density");
  fields.require(!ObserveOptions::from(observe_).pressure || !bed_.periodic_upwards(), "observe",
                 "\"pressure\" is the pressure as a function of height, but the box is periodic upwards",
                 "Leave it out: compressibility_factor is always measured");
  measure_.check(fields, bed_.period(), bed_.time_unit());
  if (fields.problem_count() == 0) check_heights(fields);
  if (!replicas_)
    replicas_ = bed_.period() > 0 && bed_.contact_duration() > 0 && bed_.may_be_filled_at_random() &&
                        !fields.has_upstream("simulate")
                    ? replicas_of_shaken
                    : 1;
  bed_.warn(fields, measure_.settle());
}

// The covariances of so many heights take some 6 GB where the bed fills them as it does with a spacing of 0.0015 D.
void Simulate::check_heights(Fields& fields) {
  constexpr double most_kept = 4e4;
  const HeightGrid grid = measurement_plan(bed_.scene(1)).grid;
  const auto heights = static_cast<double>(grid.points);
  fields.require(heights <= most_kept, "profile/spacing",
                 fmt::format("the profile would have {:.0f} heights, and a covariance of each pair", heights),
                 fmt::format("Give {:.4g} or more", rounded_up_to_four_digits(grid.spacing * heights / most_kept)));
}

sim::MeasureOptions Simulate::measure_options() const {
  sim::MeasureOptions options = measure_.reduced(bed_.time_unit());
  options.settle = annealing_time() + options.settle;
  return options;
}

FramePlan Simulate::frame_plan() const { return {looks(), compress_ ? "trajectory.extxyz.zst" : "trajectory.extxyz"}; }

double Simulate::annealing_time() const {
  double time = 0;
  for (const AnnealingStep& step : annealing_) time += (step.ramp + step.hold) / bed_.time_unit();
  return time;
}

// A bed that follows another simulation begins where that one ended.
sim::Scene Simulate::scene(const RunContext& context, std::uint64_t seed) const {
  sim::Scene scene = bed_.scene(seed);
  if (const Input* before = context.find_input("simulate"))
    scene.start = read_start(before->file("final.extxyz"), scene.disks);
  return scene;
}

MeasurementPlan Simulate::measurement_plan(const sim::Scene& scene) const {
  const double hottest = annealing_.empty() ? 0 : annealing_.back().temperature / bed_.length_unit();
  const sim::MeasureOptions options = measure_options();
  const sim::LookPlan looks_at = looks();
  const sim::MeasurementSchedule& times = looks_at.schedule;
  MeasurementPlan plan;
  plan.named_phases = looks_at.frame_phases;
  plan.phases = times.phases;
  plan.period = times.period;
  plan.grid = sim::profile_heights(scene, options, hottest);
  plan.kernel = options.kernel;
  plan.observe = ObserveOptions::from(observe_);
  return plan;
}

// ", 8.4 us by Hertz"; "" where no material is named.
std::string contact_time_text(const SceneOptions& bed) {
  const std::optional<double> time = bed.hertz_contact_time();
  return time ? fmt::format(", {:.2g} us by Hertz", 1e6 * *time) : "";
}

double two_digits(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return std::round(value / unit) * unit;
}

// No longer than `value`, and shorter than `now` as it is shown.
double shorter_than(double value, double now) {
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1), shown = std::floor(value / unit) * unit;
  return shown < two_digits(now) - 0.5 * unit ? shown : shown - unit;
}

// Replicas that begin from the same placed disks differ by who has which velocity.
void permute_velocities(sim::Scene& scene) {
  auto* placed = std::get_if<sim::PlacedStart>(&scene.start);
  if (placed == nullptr) return;
  sim::Random random(scene.seed);
  for (std::size_t i = placed->disks.size(); i > 1; --i) {
    sim::Placed &one = placed->disks[i - 1], &other = placed->disks[random.below(static_cast<std::uint32_t>(i))];
    if (one.species != other.species) continue;
    std::swap(one.vx, other.vx);
    std::swap(one.vz, other.vz);
    std::swap(one.spin, other.spin);
  }
}

ReplicaStarts Simulate::starts_of_replicas(const RunContext& context) const {
  const bool can = bed_.period() > 0 && bed_.may_be_filled_at_random() && context.find_input("simulate") == nullptr;
  return can ? starts_ : ReplicaStarts::same;
}

RunPlan Simulate::run_plan(RunContext& context, std::uint32_t replica) const {
  RunPlan plan;
  plan.scene = scene(context, replica_seed(context.seed(), replica));
  if (replica > 0) permute_velocities(plan.scene);
  if (starts_of_replicas(context) == ReplicaStarts::alternate && replica % 2 == 1)
    plan.scene.start = sim::RandomStart{};
  plan.schedule = looks().schedule;
  for (const AnnealingStep& step : annealing_)
    plan.annealing.push_back(
        {step.temperature / bed_.length_unit(), step.ramp / bed_.time_unit(), step.hold / bed_.time_unit()});
  plan.bath_temperature = bed_.bath_temperature();
  plan.measurement = measurement_plan(plan.scene);
  plan.frames = frame_plan();
  plan.checkpoint_seconds = checkpoint_seconds_;
  plan.folder = context.scratch() / (replicas() > 1 ? "replica-" + std::to_string(replica) : std::string("run"));
  plan.lead = replica == 0;
  return plan;
}

std::optional<BedDescription> Simulate::bed() const {
  BedDescription description = bed_.description();
  if (!annealing_.empty()) description.bath_temperature = annealing_.back().temperature / bed_.length_unit();
  return description;
}

void Simulate::run(RunContext& context) const {
  std::vector<std::unique_ptr<BedRun>> runs(replicas());
  TimeLeft time(replicas(), context.jobs());
  sim::each_replica(replicas(), context.jobs(), [&](std::uint32_t replica) {
    time.begin(replica);
    auto run = std::make_unique<BedRun>(run_plan(context, replica), context, [&](double fraction, sim::RunPart part) {
      time.reached(replica, fraction);
      context.progress(time.fraction(), name_of(part));
    });
    (*run)();
    time.end(replica);
    runs[replica] = std::move(run);
    return true;
  });
  runs[0]->write();
  std::vector<Json> results;
  double cpu = 0, measuring_cpu = 0, measuring_events = 0, collisions = 0;
  for (const auto& one : runs) {
    results.push_back(one->results(bed_));
    cpu += one->cpu_seconds();
    measuring_cpu += one->measuring_cpu_seconds();
    measuring_events += static_cast<double>(one->measuring_events());
    collisions += static_cast<double>(one->counters().collisions());
  }
  if (replicas() > 1) {
    write_joined(context, runs);
    replicas_table(results).write(context.output("replicas.csv"));
  }
  Json joined = replicas() > 1 ? joined_results(results) : results[0];
  if (bed_.gamma() > 0) joined["judgement"] = judgement_of(bed_, joined, results.size());
  if (bed_.two_species())
    joined["objections"] = Json::array({Json{
        {"why", "The disks are of two kinds, and the models of a profile are those of equal disks."},
        {"advice", "Quote the kinetic temperatures T_x (horizontal motion) and T_z (vertical motion) separately."}}});
  write_file(context.output("observables.json"), dump(joined));
  for (const std::string& warning : replica_warnings(results, joined, starts_of_replicas(context)))
    context.warning(warning);
  warn_of_contact_duration(context, joined);
  write_file(context.output("bed.json"), dump(bed()->to_json()));
  context.timing("simulation_cpu_seconds", cpu);
  context.timing("measuring_cpu_seconds", measuring_cpu);
  context.timing("measuring_events", measuring_events);
  context.timing("collisions_per_second", collisions / cpu);
  context.progress(1, "measured");
}

void Simulate::warn_of_contact_duration(RunContext& context, const Json& results) const {
  const Json* effect = find_pointer(results, "/contact_duration_effect/value");
  if (effect == nullptr || effect->get<double>() <= allowed_contact_effect) return;
  const bool reduced = bed_.description().reduced;
  const double unit = reduced ? 1 : bed_.time_unit(), now = bed_.contact_duration();
  const double wanted = sim::contact_duration_for(effect->get<double>(), now, allowed_contact_effect);
  const auto text = [&](double time) {
    return reduced ? fmt::format("{:.2g}", time) : "\"" + handy_text(time, dimension::time) + "\"";
  };
  context.warning(fmt::format(
      "the contact duration t_c = {} makes {} of the contacts elastic, so T may be about {} too high{}. This t_c is a "
      "numerical cut-off, not the time that a real contact lasts{}. "
      "\"contact_duration\": {} would reduce this to {} or less, with more contacts",
      text(two_digits(now * unit)), per_cent(results.at("elastic_share").at("value").get<double>()),
      per_cent(effect->get<double>()),
      effect->get<double>() > sim::ContactDurationEffect::known_up_to ? ", or much more" : "", contact_time_text(bed_),
      text(shorter_than(wanted * unit, now * unit)), per_cent(allowed_contact_effect)));
}

// ------------------------------------------------------------------------------------------------ --budget

double Simulate::time_of_bed() const {
  return (bed_.period() > 0 ? bed_.period() : time_of_still_bed) * bed_.time_unit();
}

// The shortest length is also one into which the frames fit.
EffortLimits Simulate::limits() const {
  double shortest = shortest_measure * time_of_bed();
  sim::MeasureOptions options = measure_.reduced(bed_.time_unit());
  const auto fits = [&](double length) {
    options.duration = length / bed_.time_unit();
    return options.problems(bed_.period()).empty();
  };
  constexpr double longer = 1.25;
  while (shortest < measure_.duration() && !fits(shortest)) shortest = std::min(longer * shortest, measure_.duration());
  const bool alternate =
      starts_ == ReplicaStarts::alternate && bed_.period() > 0 && bed_.may_be_filled_at_random() && replicas() > 1;
  int refinements = 0;
  while (contact_duration_at(refinements) > shortest_contact_duration) ++refinements;
  return {.settling = measure_.settle() + annealing_time() * bed_.time_unit(),
          .shortest = shortest,
          .pilot = shortest_measure * time_of_bed(),
          .telling = telling_measure * time_of_bed(),
          .written = measure_.duration(),
          .fewest_beds = replicas(),
          .even_beds = alternate,
          .most_refinement = refinements};
}

double Simulate::contact_duration_at(int refinement) const {
  const double given = bed_.contact_duration();
  if (refinement == 0 || given <= shortest_contact_duration) return given;
  return std::max(shortest_contact_duration, given * std::pow(refinement_factor, -refinement));
}

Scalable::Changes Simulate::changes(const Effort& effort) const {
  Changes changes{{"/measure", option(effort.length, dimension::time)}, {"/replicas", effort.beds}};
  if (effort.refinement > 0)
    changes.emplace_back("/disks/contact_duration",
                         option(contact_duration_at(effort.refinement) * bed_.time_unit(), dimension::time));
  return changes;
}

Scalable::Changes Simulate::pilot_changes(const Effort& effort) const {
  Changes pilot = changes(effort);
  pilot.emplace_back("/settle", option(std::min(measure_.settle(), effort.length), dimension::time));
  pilot.emplace_back("/frames", Json{{"count", 0}, {"phases", measure_.reduced(bed_.time_unit()).phases}});
  return pilot;
}

EffortReading Simulate::read(const Effort& effort, const Json& result, const Json& timings) const {
  const auto number = [&](const Json& json, const char* pointer) {
    const Json* found = find_pointer(json, pointer);
    return found != nullptr && found->is_number() ? found->get<double>() : 0;
  };
  const bool several = effort.beds > 1;
  const double value = number(result, "/temperature_x/value");
  if (!(value > temperature_at_rest))
    throw StageError(
        fmt::format("T_x is below {:g} m g D: the disks hardly move sideways, and a relative error of T_x has no "
                    "meaning. Leave --budget out",
                    temperature_at_rest));
  EffortReading reading;
  reading.effort = effort;
  reading.settling = measure_.settle() + annealing_time() * bed_.time_unit();
  reading.within = number(result, several ? "/temperature_x/within" : "/temperature_x/std_error") / value;
  reading.spread = several ? number(result, "/temperature_x/spread") / value : 0;
  reading.systematic = number(result, "/contact_duration_effect/value");
  reading.measuring_work = {number(timings, "/measuring_cpu_seconds"), number(timings, "/measuring_events")};
  reading.settling_work = {number(timings, "/simulation_cpu_seconds") - reading.measuring_work.cpu_seconds,
                           number(result, "/events") - reading.measuring_work.events};
  return reading;
}

// The densities of all replicas together, in place of the first's.
void Simulate::write_joined(RunContext& context, const std::vector<std::unique_ptr<BedRun>>& runs) const {
  std::vector<const BedMeasurement*> measurements;
  for (const auto& one : runs) measurements.push_back(&one->measurement());
  const sim::Profile lab = joined_density(measurements, false);
  std::size_t blocks = 0;
  const std::vector<double> covariance = joined_covariance(measurements, lab, blocks);
  measurements[0]->write_densities(context, lab, joined_density(measurements, true), covariance, blocks);
}

}  // namespace

StageRow simulate_stage() {
  return {.name = "simulate",
          .summary = "simulates a bed of hard disks, event by event",
          .accepts = {"simulate"},
          .most_inputs = 1,
          .uses_seed = true,
          .result = "observables.json",
          .headline = {"center_of_mass_rise", "temperature_x", "temperature_z"},
          .pages = simulate_pages(),
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Simulate>(); }};
}

}  // namespace shakebed::pipelines
