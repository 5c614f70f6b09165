#include "pipelines/runner/budget.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <utility>

#include "fit/profile_fit/chances.hpp"
#include "pipelines/formats/duration.hpp"
#include "pipelines/formats/quantity.hpp"
#include "pipelines/runner/folder_lock.hpp"
#include "pipelines/stages/replica_seed.hpp"
#include "pipelines/stages/replicas.hpp"
#include "statistics/parallel.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

// Errors that can be asked for.
constexpr double smallest_error = 1e-4, largest_error = 0.5;
// The pilot that decides has the second number of beds: where one bed in five is in another state, 8 beds are all in
// one of the two in 17 % of all cases, 16 beds in 3 %.
constexpr std::uint32_t beds_of_pilot = 8, telling_beds = 16, most_beds = 10'000;
constexpr int most_pilots = 6;
// The blocks of one bed of a pilot count as so many independent samples, in the uncertainty of `within`.
constexpr double blocks_of_bed = 1;
// Beds of a pilot differ by more than they state, at this significance.
constexpr double differ_significance = 0.3;
// A choice may be longer than its pilot by this factor; the next pilot is then shorter than the choice by the other.
constexpr double most_extrapolation = 12, next_extrapolation = 6;
// No pilot is repeated to be longer by less than this factor.
constexpr double hardly_longer = 1.5;
// Beds that differ are watched for longer, as long as the pilot costs less than this share of the choice: the
// difference may pass.
constexpr double longer_pilot = 4, share_of_choice = 0.5;
// The estimated systematic part may be this share of the error. In a bed (149 disks, e = 0.91, friction 0.14, Gamma
// = 2.7) the estimate was 0.4 %, and T_x fell by 1.8 +- 0.6 % with a contact duration of 1e-6 in place of 1e-4.
// So above a quarter of the error it is reduced at any cost.
constexpr double systematic_share = 0.1, needed_share = 0.25;
// What is aimed at, of the error asked for. By the scatter of pilots and runs, 20 beds whose expected rms error is 0.8
// of it exceed it in 7 % of all cases; at 0.73, in 2 %.
constexpr double aim = 0.9;
constexpr double miss_significance = 0.01;
constexpr double pilot_share_of_time = 0.25;  // of a budget in time
constexpr double time_to_spare = 0.95;
constexpr std::uint64_t pilot_stream = 0x70696c6f74;  // its seeds are none of the run's

constexpr const char* pilot_folder = ".pilot";

double squared(double value) { return value * value; }

// Upwards, to three digits.
double rounded_up(double value) {
  if (!(value > 0)) return value;
  const double step = std::pow(10, std::floor(std::log10(value)) - 2);
  const double steps = std::ceil(value / step - 1e-9);
  return step < 1 ? steps / std::round(1 / step) : steps * step;
}

// The variance of one bed's mean: frozen + passing/length.
struct BedVariance {
  double frozen = 0, passing = 0;
  double freedom = 0;  // of the estimate, in degrees of freedom

  double at(double length) const { return frozen + passing / length; }
};

BedVariance variance_of(const EffortReading& pilot) {
  const double length = pilot.effort.length, within = squared(pilot.within), spread = squared(pilot.spread);
  const double between = static_cast<double>(pilot.effort.beds) - 1;
  const double of_blocks = blocks_of_bed * static_cast<double>(pilot.effort.beds);
  if (between < 1) return {0, within * length, of_blocks};
  const double chi2 = between * spread / within;
  const bool differ = within > 0 && fit::chance_of_chi2(chi2, static_cast<int>(between)) < differ_significance;
  if (differ) return {spread - within, within * length, between};
  const double pooled = (between * spread + of_blocks * within) / (between + of_blocks);
  return {0, std::max(within, pooled) * length, between + of_blocks};
}

// What the squared error of n beds is multiplied by: with Student's factor, which the result states, and at least by
// what the reciprocal of a variance of so few degrees of freedom is too large on average.
double allowance(std::uint32_t beds, double freedom) {
  const double of_pilot = freedom > 3 ? freedom / (freedom - 2) : 3;
  return std::max(squared(few_beds_factor(beds)), of_pilot);
}

class Chooser {
 public:
  Chooser(const EffortReading& pilot, const EffortLimits& limits, const Budget& budget, int jobs)
      : pilot_(pilot), limits_(limits), budget_(budget), jobs_(jobs), variance_(variance_of(pilot)) {
    const double beds = pilot.effort.beds;
    const double measured = beds * pilot.effort.length, settled = beds * pilot.settling;
    measuring_ = {pilot.measuring_work.cpu_seconds / measured, pilot.measuring_work.events / measured};
    // Later settling has as many events as measuring. Nobody looks, so an event costs what it did in the settling
    // before.
    const double rest = (limits.settling - pilot.settling) * measuring_.events;
    const Work& before = pilot.settling_work.events > 0 ? pilot.settling_work : pilot.measuring_work;
    settling_ = {(settled > 0 ? pilot.settling_work.cpu_seconds / beds : 0) + rest * before.cpu_seconds / before.events,
                 (settled > 0 ? pilot.settling_work.events / beds : 0) + rest};
    // Beds that differ are measured no shorter than those that showed how much.
    shortest_ = std::max(limits.shortest, variance_.frozen > 0 ? pilot.effort.length : 0);
  }

  EffortChoice of_error() const {
    const double error = aim * budget_.error;
    const double rest = squared(error) - squared(pilot_.systematic);
    EffortChoice choice;
    // Beyond the systematic part there is little use in statistics. Where that part alone is too large, the error that
    // the result states is the one asked for.
    const double wanted = pilot_.systematic < budget_.error ? std::max(rest, squared(error) / 4) : squared(error);
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t beds = limits_.fewest_beds; beds <= most_beds; beds += step()) {
      const double cost_so_far = beds * (limits_.settling + shortest_);
      if (cost_so_far > least) break;
      const double left = beds * wanted / allowance(beds, variance_.freedom) - variance_.frozen;
      if (!(left > 0)) continue;
      const double length = std::max(shortest_, variance_.passing / left);
      if (const double cost = beds * (limits_.settling + length); cost < least) {
        least = cost;
        choice.effort = {rounded_up(length), beds, pilot_.effort.refinement};
      }
    }
    choice.possible = std::isfinite(least) && pilot_.systematic < budget_.error;
    if (!std::isfinite(least)) choice.effort = {rounded_up(shortest_), most_beds, pilot_.effort.refinement};
    return expected(choice);
  }

  EffortChoice of_time() const {
    EffortChoice choice;
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t beds = limits_.fewest_beds; beds <= most_beds; beds += step()) {
      const double of_bed = budget_.seconds / rounds(beds);
      const double length = (of_bed - settling_.cpu_seconds) / measuring_.cpu_seconds;
      if (!(length >= shortest_)) break;
      const double squares = allowance(beds, variance_.freedom) * variance_.at(length) / beds;
      if (squares < least) {
        least = squares;
        choice.effort = {rounded_down(length), beds, pilot_.effort.refinement};
      }
    }
    choice.possible = std::isfinite(least);
    if (!choice.possible) choice.effort = {rounded_up(shortest_), limits_.fewest_beds, pilot_.effort.refinement};
    return expected(choice);
  }

 private:
  std::uint32_t step() const { return limits_.even_beds ? 2 : 1; }
  double rounds(std::uint32_t beds) const { return std::ceil(static_cast<double>(beds) / jobs_); }
  double rounded_down(double value) const {
    const double step = std::pow(10, std::floor(std::log10(value)) - 2);
    const double steps = std::floor(value / step);
    return std::max(step < 1 ? steps / std::round(1 / step) : steps * step, shortest_);
  }

  EffortChoice expected(EffortChoice choice) const {
    const Effort& effort = choice.effort;
    const double squares = variance_.at(effort.length) / effort.beds;
    choice.systematic = pilot_.systematic;
    choice.error = std::sqrt(squares + squared(pilot_.systematic));
    choice.stated_error = few_beds_factor(effort.beds) * std::sqrt(squares);
    const double cpu_of_bed = settling_.cpu_seconds + effort.length * measuring_.cpu_seconds;
    choice.work = {effort.beds * cpu_of_bed, effort.beds * (settling_.events + effort.length * measuring_.events)};
    choice.wall_seconds = rounds(effort.beds) * cpu_of_bed;
    return choice;
  }

  const EffortReading& pilot_;
  const EffortLimits& limits_;
  const Budget& budget_;
  int jobs_;
  BedVariance variance_;
  Work settling_, measuring_;  // of one bed: all of its settling, and a unit of its measurement
  double shortest_ = 0;
};

}  // namespace

Budget parse_budget(const std::string& text) {
  const auto refuse = [&](const std::string& what) {
    throw UsageError(fmt::format(
        "--budget: {}. Write an error of the temperature, \"1 %\", or a time, \"30 s\" or \"5 min\"", what));
  };
  Budget budget{.text = text};
  const std::size_t end = text.find_last_not_of(' ');
  if (end != std::string::npos && text[end] == '%') {
    const std::string number = text.substr(0, end);
    char* rest = nullptr;
    const double percent = std::strtod(number.c_str(), &rest);
    if (rest == number.c_str() ||
        number.find_first_not_of(' ', static_cast<std::size_t>(rest - number.c_str())) != std::string::npos)
      refuse(fmt::format("\"{}\" is not a number of per cent", text));
    if (!(percent >= 100 * smallest_error && percent <= 100 * largest_error))
      refuse(fmt::format("the error must be from {:g} to {:g} %, but is {}", 100 * smallest_error, 100 * largest_error,
                         text));
    budget.error = percent / 100;
    return budget;
  }
  Quantity quantity;
  try {
    quantity = parse_quantity(text, &dimension::time);
  } catch (const std::invalid_argument& problem) {
    refuse(problem.what());
  }
  if (!quantity.has_unit) refuse(fmt::format("\"{}\" has no unit", text));
  if (quantity.dimension != dimension::time) refuse(fmt::format("{} is {}", text, name_of(quantity.dimension)));
  if (!(quantity.value > 0)) refuse(fmt::format("the time must be above 0, but is {}", text));
  budget.seconds = quantity.value;
  return budget;
}

EffortChoice choose_effort(const EffortReading& pilot, const EffortLimits& limits, const Budget& budget, int jobs) {
  const Chooser chooser(pilot, limits, budget, jobs);
  return budget.error > 0 ? chooser.of_error() : chooser.of_time();
}

std::optional<Effort> next_pilot(const EffortReading& pilot, const EffortLimits& limits, const EffortChoice& choice,
                                 const Budget& budget) {
  Effort next = pilot.effort;
  const double allowed = systematic_share * (budget.error > 0 ? budget.error : choice.stated_error);
  // First the model, by short pilots: a finer one may take many times as long.
  if (pilot.systematic > allowed && next.refinement < limits.most_refinement) {
    ++next.refinement;
    return next;
  }
  // Where no statistics reach the error, a longer pilot is of no use.
  if (budget.error > 0 && pilot.systematic >= budget.error) return std::nullopt;
  if (budget.error > 0 && choice.effort.length > most_extrapolation * next.length)
    next.length = rounded_up(choice.effort.length / next_extrapolation);
  const auto whole = [](const Effort& effort) { return effort.beds * effort.length; };
  if (budget.error > 0 && whole(choice.effort) > hardly_longer * whole(pilot.effort)) {
    next.beds = std::max(next.beds, telling_beds);
    if (const double telling = std::min(choice.effort.length, limits.telling); telling > hardly_longer * next.length)
      next.length = rounded_up(telling);
  }
  const double longer = longer_pilot * pilot.effort.length;
  if (budget.error > 0 && variance_of(pilot).frozen > 0 &&
      pilot.effort.beds * longer < share_of_choice * choice.effort.beds * (limits.settling + choice.effort.length))
    next.length = std::max(next.length, rounded_up(longer));
  if (next == pilot.effort) return std::nullopt;
  return next;
}

Refinement judged(const EffortReading& coarse, const EffortReading& fine, const Budget& budget) {
  const auto events = [](const EffortReading& pilot) {
    return pilot.measuring_work.events / (pilot.effort.beds * pilot.effort.length);
  };
  if (fine.systematic * events(fine) < coarse.systematic * events(coarse)) return Refinement::cheap;
  const bool needed = coarse.systematic > needed_share * budget.error && fine.systematic < budget.error;
  return needed ? Refinement::dear : Refinement::useless;
}

namespace {

int threads_of(const RunOptions& options) { return options.jobs > 0 ? options.jobs : processors(); }

std::string changes_text(const Scalable::Changes& changes) {
  std::vector<std::string> parts;
  for (const auto& [pointer, value] : changes)
    parts.push_back(fmt::format("\"{}\": {}", pointer.substr(pointer.rfind('/') + 1), value.dump()));
  return fmt::format("{}", fmt::join(parts, ", "));
}

// The choice for one stage, by pilots of its own.
class StageBudget {
 public:
  StageBudget(const Plan& plan, const PlannedStage& stage, Budget budget, const RunOptions& options, Console& console)
      : plan_(plan),
        stage_(stage),
        scalable_(*stage.stage->scalable()),
        limits_(scalable_.limits()),
        budget_(std::move(budget)),
        jobs_(threads_of(options)),
        force_(options.force),
        folder_(options.out / pilot_folder / stage.id),
        console_(console) {}

  Scalable::Changes choose(Json& record) {
    Effort effort{budget_.error > 0 ? limits_.pilot : limits_.telling, beds_of_pilot, 0};
    if (budget_.seconds > 0) shorten_pilot(effort);
    EffortReading reading;
    EffortChoice choice;
    for (int pilot = 0; pilot < most_pilots; ++pilot) {
      const EffortReading found = run_pilot(effort, pilot);
      const bool refined = pilot > 0 && effort.refinement > reading.effort.refinement;
      const Refinement gain = refined ? judged(reading, found, budget_) : Refinement::cheap;
      if (gain != Refinement::useless) reading = found;
      if (gain != Refinement::cheap) limits_.most_refinement = reading.effort.refinement;
      choice = choose_effort(reading, limits_, left(), jobs_);
      const std::optional<Effort> next = next_pilot(reading, limits_, choice, budget_);
      if (!next) break;
      effort = *next;
    }
    if (budget_.seconds > 0 && !choice.possible)
      throw StageError(
          fmt::format("--budget {}: {} needs at least about {} to settle and to be measured, and its pilot run took "
                      "{}. Allow more time, or choose a shorter \"settle\"",
                      budget_.text, stage_.id, duration_text(choice.wall_seconds), duration_text(pilot_wall_)));
    const Scalable::Changes changes = scalable_.changes(choice.effort);
    say(choice, changes);
    record = record_of(choice, changes, reading);
    return changes;
  }

 private:
  // What is left of the time.
  Budget left() const {
    Budget left = budget_;
    if (budget_.seconds > 0) left.seconds = std::max(0.0, time_to_spare * budget_.seconds - pilot_wall_) / slowness_;
    return left;
  }

  // A pilot may take a share of the time only; how long it takes is foreseen by a trial of the stage.
  void shorten_pilot(Effort& effort) const {
    const EffortLimits& limits = limits_;
    const double a_length = stage_.stage->trial_seconds() / (limits.fewest_beds * (limits.settling + limits.written));
    const double foreseen = std::ceil(static_cast<double>(effort.beds) / jobs_) * a_length *
                            (effort.length + std::min(limits.settling, effort.length));
    const double allowed = pilot_share_of_time * budget_.seconds;
    if (!(foreseen > allowed)) return;
    effort.length = rounded_up(std::max(limits.shortest / 2, effort.length * allowed / foreseen));
  }

  EffortReading run_pilot(const Effort& effort, int number) {
    JsonNode document = to_node(Json{{"name", "pilot"}, {"stages", Json::array()}});
    JsonNode stage = *find_pointer(plan_.document, stage_.pointer);
    for (const auto& [pointer, value] : scalable_.pilot_changes(effort)) set_pointer(stage, pointer, to_node(value));
    const std::uint64_t seed = mixed(mixed(stage_.seed ^ pilot_stream) ^ static_cast<std::uint64_t>(number)) >> 11;
    set_pointer(stage, "/seed", to_node(Json(seed)));
    document.find("stages")->items.push_back(std::move(stage));
    const Plan pilot = make_plan(std::move(document), plan_.file, plan_.directory);
    RunOptions options;
    options.out = folder_ / std::to_string(number);
    options.jobs = jobs_;
    options.force = force_;
    fs::create_directories(options.out);
    remove_leftovers(options.out);
    options.on_progress = [&](const std::string&, double fraction) {
      console_.progress(fmt::format("{}: pilot", stage_.id), fraction);
    };
    RunOutcome outcome;
    outcome.out = options.out;
    run_stages(pilot, options, nullptr, outcome);
    console_.end_progress();
    if (outcome.code == exit_interrupted) throw Interrupted();
    if (outcome.code != exit_ok && outcome.code != exit_check_failed)
      throw StageError(fmt::format("the pilot run of --budget failed: {}", outcome.error));
    const StageCost cost = outcome.stages.front().cost.value_or(StageCost{});
    const PlannedStage& ran = pilot.stages.front();
    const EffortReading reading =
        ran.stage->scalable()->read(effort, input_of(ran, options.out).result(), cost.timings);
    const double cpu = reading.settling_work.cpu_seconds + reading.measuring_work.cpu_seconds;
    pilot_wall_ += cost.wall_seconds;
    pilot_cpu_ += cpu;
    // By so much the time of a busy machine is longer than that of its processors.
    const double threads = std::min<double>(jobs_, effort.beds);
    slowness_ = cpu > 0 ? std::max(1.0, cost.wall_seconds * threads / cpu) : 1;
    return reading;
  }

  void say(const EffortChoice& choice, const Scalable::Changes& changes) const {
    console_.message(fmt::format("{}: --budget \"{}\" chooses {}", stage_.id, budget_.text, changes_text(changes)));
    console_.message(fmt::format(
        "{}: expected error of {}: {} (stated error {}). Expected cost: {} of processor time ({:.2g} events), about {} "
        "on {} {}. The pilot run took {}",
        stage_.id, scalable_.number(), per_cent(choice.error), per_cent(choice.stated_error),
        duration_text(choice.work.cpu_seconds), choice.work.events, duration_text(slowness_ * choice.wall_seconds),
        jobs_, jobs_ == 1 ? "thread" : "threads", duration_text(pilot_wall_)));
    if (budget_.error > 0 && choice.systematic >= budget_.error)
      console_.warning(
          fmt::format("{}: {} alone gives {} an error of about {}, more than the wanted {}. A longer measurement does "
                      "not reduce this error; {} does",
                      stage_.id, scalable_.systematic_cause(), scalable_.number(), per_cent(choice.systematic),
                      budget_.text, scalable_.systematic_remedy()));
    else if (!choice.possible)
      console_.warning(
          fmt::format("{}: beds differ so much that even {} beds do not reach the wanted error of {}. The largest "
                      "number of beds is used",
                      stage_.id, most_beds, budget_.text));
  }

  Json record_of(const EffortChoice& choice, const Scalable::Changes& changes, const EffortReading& pilot) const {
    Json picked = Json::object();
    for (const auto& [pointer, value] : changes) picked[pointer] = value;
    const Effort& effort = pilot.effort;
    return Json{{"id", stage_.id},
                {"number", scalable_.number()},
                {"picked", picked},
                {"length", choice.effort.length},
                {"beds", choice.effort.beds},
                {"refinement", choice.effort.refinement},
                {"expected_error", choice.error},
                {"stated_error", choice.stated_error},
                {"systematic_error", choice.systematic},
                {"cpu_seconds", choice.work.cpu_seconds},
                {"wall_seconds", slowness_ * choice.wall_seconds},
                {"events", std::round(choice.work.events)},
                {"possible", choice.possible},
                {"pilot", Json{{"length", effort.length},
                               {"beds", effort.beds},
                               {"within", pilot.within},
                               {"spread", pilot.spread},
                               {"cpu_seconds", pilot_cpu_},
                               {"wall_seconds", pilot_wall_}}}};
  }

  const Plan& plan_;
  const PlannedStage& stage_;
  const Scalable& scalable_;
  EffortLimits limits_;
  Budget budget_;
  int jobs_;
  bool force_;
  fs::path folder_;
  Console& console_;
  double pilot_wall_ = 0, pilot_cpu_ = 0, slowness_ = 1;
};

// Stages that a pilot can run by themselves.
std::vector<const PlannedStage*> scalable_stages(const Plan& plan) {
  std::vector<const PlannedStage*> found;
  for (const PlannedStage& stage : plan.stages)
    if (stage.stage->scalable() != nullptr && stage.from.empty()) found.push_back(&stage);
  if (!found.empty()) return found;
  const JsonNode* stages = plan.document.find("stages");
  throw ConfigError({{plan.file, stages->at, "/stages",
                      "--budget: no stage of this recipe simulates a bed whose measured time can be chosen",
                      "Leave --budget out, and set the times and replicas of the stages in the recipe"}});
}

}  // namespace

BudgetedPlan choose_by_budget(const Plan& plan, const Budget& budget, const RunOptions& options, Console& console) {
  const std::vector<const PlannedStage*> stages = scalable_stages(plan);
  Budget share = budget;
  share.seconds /= static_cast<double>(stages.size());
  fs::create_directories(options.out);
  const FolderLock lock(options.out);
  JsonNode document = plan.document;
  Json record{{"asked", budget.text}, {"stages", Json::array()}};
  for (const PlannedStage* stage : stages) {
    console.message(fmt::format("{}: pilot run for --budget", stage->id));
    Json one;
    for (const auto& [pointer, value] : StageBudget(plan, *stage, share, options, console).choose(one))
      set_pointer(document, stage->pointer + pointer, to_node(value));
    record["stages"].push_back(std::move(one));
  }
  return {make_plan(std::move(document), plan.file, plan.directory), std::move(record)};
}

bool misses(double stated, double asked, std::uint32_t beds) {
  if (beds < 2) return stated > asked;
  const double chi2 = (beds - 1.0) * squared(stated / asked);
  return chi2 > fit::chi2_exceeded(miss_significance, static_cast<int>(beds) - 1);
}

void say_reached(const Plan& plan, const Json& record, const RunOutcome& outcome, Console& console) {
  const Budget asked = parse_budget(record.at("asked").get<std::string>());
  for (const Json& one : record.at("stages")) {
    const std::size_t i = plan.index_of(one.at("id").get<std::string>());
    const StageOutcome& stage = outcome.stages.at(i);
    if (!stage.record || !stage.cost) continue;
    const Scalable& scalable = *plan.stages[i].stage->scalable();
    const Effort effort{one.at("length").get<double>(), one.at("beds").get<std::uint32_t>(), 0};
    const EffortReading reading =
        scalable.read(effort, input_of(plan.stages[i], outcome.out).result(), stage.cost->timings);
    const double squares = std::max(squared(few_beds_factor(effort.beds) * reading.spread), squared(reading.within));
    const double stated = std::sqrt(squares / effort.beds);
    console.message(fmt::format("{}: stated error of {}: {} (expected {}). Processor time: {} (expected {})", stage.id,
                                scalable.number(), per_cent(stated), per_cent(one.at("stated_error").get<double>()),
                                duration_text(reading.settling_work.cpu_seconds + reading.measuring_work.cpu_seconds),
                                duration_text(one.at("cpu_seconds").get<double>())));
    if (!(asked.error > 0 && misses(stated, asked.error, effort.beds))) continue;
    const double times = squared(stated / asked.error);
    console.warning(fmt::format(
        "{}: the stated error of {} is {}, more than the wanted {}: these beds differ by more than those of the pilot. "
        "About {:.2g} times as many beds would reach it: set \"replicas\" to {}",
        stage.id, scalable.number(), per_cent(stated), asked.text, times,
        static_cast<long>(std::ceil(times * effort.beds))));
  }
}

}  // namespace shakebed::pipelines
