#include "pipelines/stages/simulate_run.hpp"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <new>
#include <string_view>
#include <utility>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "sim/measure/observables.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

// A state is kept in memory at least so often in a run, so that a loss of precision costs a sixteenth of it at most ...
constexpr double keeps_a_run = 16;
// ... and as often as costs at most a fiftieth of the time, but not oftener than every two seconds.
constexpr int keeping_share = 50;
constexpr std::chrono::seconds shortest_keeping{2};
// So often a run is asked whether it is still precise, unless synchronisations of the engine are rarer.
constexpr double precision_checks = 256;
constexpr std::size_t hash_size = 32;  // characters before the state in a checkpoint file

double thread_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Of a trial: the share of the run, periods to settle at least, the processor time [s].
constexpr double trial_share = 0.02, shortest_trial = 1, longest_trial = 0.1;
constexpr std::uint64_t events_of_trial = 10'000;  // between two looks at the clock

}  // namespace

const char* name_of(sim::RunPart part) {
  return part == sim::RunPart::annealing ? "annealing" : part == sim::RunPart::settling ? "settling" : "measuring";
}

namespace {

// Looks at the processor's clock while a trial settles and measures.
class TrialClock final : public sim::RunObserver {
 public:
  void prepare(sim::Simulation&) override { prepared = last = thread_cpu_seconds(); }
  void begin(sim::Simulation& simulation) override {
    settled = thread_cpu_seconds();
    settled_at = simulation.time();
  }
  // After the other observers.
  void look(sim::Simulation& simulation, const sim::Snapshot&, std::uint64_t, std::uint32_t) override {
    last = thread_cpu_seconds();
    last_at = simulation.time();
  }
  void save(sim::ArchiveWriter&) override {}
  void load(sim::ArchiveReader&) override {}

  double prepared = 0, settled = 0, last = 0;  // [s]
  double settled_at = 0, last_at = 0;          // reduced
};

}  // namespace

double trial_seconds(const sim::Scene& scene, const sim::MeasurementSchedule& schedule,
                     std::vector<sim::RunObserver*> observers) {
  sim::MeasurementSchedule part;
  part.period = schedule.period, part.phases = schedule.phases;
  part.settle = std::min(schedule.settle, std::max(trial_share * schedule.settle, shortest_trial * schedule.period));
  part.periods =
      std::min(schedule.periods, 1 + static_cast<std::uint64_t>(trial_share * static_cast<double>(schedule.periods)));
  TrialClock clock;
  observers.push_back(&clock);
  const double start = thread_cpu_seconds();
  sim::RunControl control;
  control.events_between_questions = events_of_trial;
  control.stop = [&] { return thread_cpu_seconds() - clock.prepared > longest_trial; };
  const sim::RunResult result = sim::measure(scene, part, observers, control);
  const double now = thread_cpu_seconds(), made = clock.prepared - start;
  if (!(clock.last_at > clock.settled_at))  // it was stopped before it measured
    return made + (now - clock.prepared) * schedule.end() / std::max(result.simulation->time(), 1e-6 * part.end());
  const double measuring =
      (clock.last - clock.settled) / (clock.last_at - clock.settled_at) * (schedule.end() - schedule.settle);
  const double settling = part.settle > 0 ? (clock.settled - clock.prepared) / part.settle * schedule.settle : 0;
  return made + settling + measuring;
}

// ------------------------------------------------------------------------------------------------ observers

void RunMeasurement::prepare(sim::Simulation& simulation) {
  properties_ = simulation.properties();
  bed_.emplace(plan_.scene, properties_, plan_.measurement);
  frames_.reset();
  if (plan_.lead && plan_.frames.looks.frames > 0)
    frames_.emplace(plan_.folder / plan_.frames.file, properties_.mass.size());
}

void RunMeasurement::begin(sim::Simulation& simulation) {
  if (frames_) frames_->start();
  bed_->begin(simulation);
}

void RunMeasurement::look(sim::Simulation& simulation, const sim::Snapshot& at, std::uint64_t look,
                          std::uint32_t phase) {
  const bool frame = plan_.frames.looks.takes_frame(look);
  bed_->look(simulation, at, phase, frame);
  if (!frame || !frames_) return;
  const double part = plan_.frames.looks.shaken ? static_cast<double>(phase) / plan_.schedule.phases : 0;
  frames_->add(frame_of(at, plan_.scene, properties_, part));
}

void RunMeasurement::load(sim::ArchiveReader& in) {
  visit(in);
  if (frames_) frames_->go_on();
}

void RunMeasurement::finish_frames(const fs::path& destination) {
  if (frames_) frames_->finish(destination);
}

void CpuClock::prepare(sim::Simulation&) {
  before_ = settled_ = 0;
  start_ = thread_cpu_seconds();
}
double CpuClock::seconds() const { return before_ + thread_cpu_seconds() - start_; }
void CpuClock::save(sim::ArchiveWriter& out) {
  double so_far = seconds();
  out(so_far, settled_);
}

// ------------------------------------------------------------------------------------------------ the run

BedRun::BedRun(RunPlan plan, RunContext& context, Progress progress)
    : plan_(std::move(plan)),
      context_(context),
      progress_(std::move(progress)),
      checkpoint_(plan_.folder / "checkpoint"),
      annealing_(plan_.annealing, plan_.bath_temperature),
      measurement_(plan_) {
  plan_.schedule.bath = annealing_.bath();
  fs::create_directories(plan_.folder);
}

void BedRun::operator()() {
  last_saved_ = Clock::now();
  sim::RunResult result;
  try {
    result = measured(read_checkpoint());
  } catch (const sim::StateError& error) {
    warn_of_checkpoint(error.what());
    result = measured({});
  }
  simulation_ = std::move(result.simulation);
  if (!result.finished) {
    if (plan_.checkpoint_seconds > 0 && kept_at_ > last_saved_) save();
    throw Interrupted();
  }
  require_precision(*simulation_, sound_, checkpoint_);
  cpu_seconds_ = clock_.seconds();
  measuring_cpu_seconds_ = clock_.measuring_seconds();
}

sim::RunResult BedRun::measured(const std::vector<std::uint8_t>& kept) {
  try {
    return sim::measure(plan_.scene, plan_.schedule, {&annealing_, &measurement_, &clock_}, control(), kept);
  } catch (const std::bad_alloc&) {
    throw;  // the runner says that memory is short
  } catch (const std::exception& error) {
    if (measurement_.begun()) throw;
    throw StageError(error.what());
  }
}

sim::RunControl BedRun::control() {
  sim::RunControl control;
  control.stop = [this] { return context_.interrupted(); };
  control.progress = progress_;
  control.gone_on = [this](const sim::Simulation& simulation) {
    checked_slot_ = slot_of(simulation);
    context_.log(
        fmt::format("continues after {:.0f} % of the simulated time", 100 * simulation.time() / plan_.schedule.end()));
  };
  control.keep_due = [this](const sim::Simulation& simulation) {
    check_precision(simulation);
    return keep_is_due(simulation);
  };
  control.keep = [this](const sim::Simulation& simulation, const sim::RunControl::State& state) {
    keep(simulation, state);
  };
  return control;
}

// Empty where there is none, or none that can be used.
std::vector<std::uint8_t> BedRun::read_checkpoint() const {
  if (!fs::exists(checkpoint_)) return {};
  const std::string text = read_file(checkpoint_);
  if (text.size() < hash_size || fast_hash(std::string_view(text).substr(hash_size)) != text.substr(0, hash_size))
    throw sim::StateError("it is damaged");
  return {text.begin() + hash_size, text.end()};
}

void BedRun::warn_of_checkpoint(const char* why) {
  context_.warning(
      fmt::format("{}: this checkpoint cannot be used ({}). The simulation starts again from the beginning. Its "
                  "results do not change; only computing time is lost.",
                  checkpoint_.string(), why));
}

bool BedRun::save_is_due() const {
  return plan_.checkpoint_seconds > 0 &&
         std::chrono::duration<double>(Clock::now() - last_saved_).count() >= plan_.checkpoint_seconds;
}

bool BedRun::keep_is_due(const sim::Simulation& simulation) const {
  return save_is_due() || simulation.time() >= keep_at_ || Clock::now() >= keep_after_;
}

double BedRun::slot_of(const sim::Simulation& simulation) const {
  return std::floor(simulation.time() / plan_.schedule.end() * precision_checks);
}

// At moments that depend on simulated time alone: whether a run stops must not depend on the speed of the machine.
void BedRun::check_precision(const sim::Simulation& simulation) {
  const double slot = slot_of(simulation);
  if (slot == checked_slot_) return;
  checked_slot_ = slot;
  require_precision(simulation, sound_, checkpoint_);
}

void BedRun::keep(const sim::Simulation& simulation, const sim::RunControl::State& state) {
  if (!sim::precision_lost(simulation).empty()) return;  // no state to go on from
  const auto start = Clock::now();
  sound_ = state();
  kept_at_ = Clock::now();
  keep_after_ = kept_at_ + std::max<Clock::duration>(keeping_share * (kept_at_ - start), shortest_keeping);
  keep_at_ = simulation.time() + plan_.schedule.end() / keeps_a_run;
  if (save_is_due()) save();
}

void BedRun::save() {
  write_checkpoint(checkpoint_, sound_);
  last_saved_ = Clock::now();
}

// ------------------------------------------------------------------------------------------------ results

Json BedRun::results(const SceneOptions& options) const {
  Json out;
  measurement().results(options, plan_.scene, out);
  const BedDescription bed = options.description();
  const sim::EnergyLedger energy = simulation_->energy();
  const sim::Counters counters = simulation_->counters();
  out["gamma"] = quantity_json(options.gamma(), "1");
  out["column_number"] = quantity_json(bed.column_number(), "1");
  if (options.tilt() && !bed.reduced) out["gravity_in_plane"] = quantity_json(*options.gravity(), "m/s^2");
  if (const std::optional<double> time = options.hertz_contact_time())
    out["hertz_contact_time"] = quantity_json(*time, "s");
  out["energy_ledger"] = {{"unit", options.weightless() ? "T0" : "m g D"},
                          {"initial", energy.initial},
                          {"kinetic", energy.kinetic},
                          {"potential", energy.potential},
                          {"compressed", energy.compressed},
                          {"dissipated", energy.dissipated},
                          {"step_error", energy.step_error},
                          {"floor_work", energy.floor_work},
                          {"bath_work", energy.bath_work},
                          {"imbalance", energy.imbalance()}};
  if (options.rubs()) out["energy_ledger"]["dissipated_on_plates"] = energy.dissipated_on_plates;
  out["collisions"] = counters.collisions();
  out["disk_collisions"] = counters.disk_collisions;
  out["wall_collisions"] = counters.wall_collisions;
  out["floor_collisions"] = counters.floor_collisions;
  out["elastic_contacts"] = counters.elastic_contacts;
  out["events"] = counters.events();
  out["periods"] = measurement().bed().periods();
  out["max_overlap"] = quantity_json(simulation_->largest_overlap(), "D");
  return out;
}

void BedRun::write() {
  measurement().write(context_, plan_.frames.looks.frames > 0);
  measurement_.finish_frames(context_.output(plan_.frames.file));
  TrajectoryWriter final(context_.output("final.extxyz"));
  sim::Snapshot at;
  simulation_->snapshot(at);
  final.write(frame_of(at, plan_.scene, measurement_.properties(), 0));
  final.close();
  if (!plan_.annealing.empty()) annealing_.rows(context_.table("schedule.csv")).write(context_.output("schedule.csv"));
  if (measurement().above_profile() > 0)
    context_.warning(std::to_string(measurement().above_profile()) +
                     " positions of disks were above the highest bin of the profile and are missing from it");
}

void write_checkpoint(const fs::path& path, const std::vector<std::uint8_t>& state) {
  const std::string_view bytes(reinterpret_cast<const char*>(state.data()), state.size());
  write_file_atomically(path, fast_hash(bytes) + std::string(bytes));
}

void require_precision(const sim::Simulation& simulation, const std::vector<std::uint8_t>& last_sound,
                       const fs::path& checkpoint) {
  const std::string trouble = sim::precision_lost(simulation);
  if (trouble.empty()) return;
  if (!last_sound.empty()) write_checkpoint(checkpoint, last_sound);
  throw StageError(fmt::format(
      "at time {:.9g} (reduced units), after {} collisions: {}. The run has lost its precision and stops; {}",
      simulation.time(), simulation.counters().collisions(), trouble,
      last_sound.empty() ? std::string("no earlier state was stored")
                         : "the last precise state is stored in " + checkpoint.string()));
}

}  // namespace shakebed::pipelines
