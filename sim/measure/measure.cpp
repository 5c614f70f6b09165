#include "sim/measure/measure.hpp"
#include "statistics/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>

namespace shakebed::sim {

namespace {

constexpr std::uint64_t state_form = 0x313073656d626b73;  // "skbmes01", little-endian

class Run {
 public:
  Run(const Scene& scene, const MeasurementSchedule& schedule, const std::vector<RunObserver*>& observers,
      const RunControl& control)
      : schedule_(schedule), observers_(observers), control_(control), simulation_(simulate(scene)) {
    for (RunObserver* one : observers_) one->prepare(*simulation_);
  }

  void go_on_from(const std::vector<std::uint8_t>& kept) {
    try {
      take_up(kept);
    } catch (const std::exception& error) {
      throw StateError(error.what());
    }
    if (control_.gone_on) control_.gone_on(*simulation_);
  }

  // False where it was stopped.
  bool operator()() {
    for (; step_ < schedule_.bath.size(); ++step_) {
      simulation_->set_bath_temperature(schedule_.bath[step_].temperature);
      if (!advance_to(schedule_.bath[step_].until, RunPart::annealing)) return false;
      for (RunObserver* one : observers_) one->step(*simulation_, step_);
    }
    Snapshot at;
    for (; look_ < schedule_.looks(); ++look_) {
      if (!advance_to(schedule_.moment(look_), look_ == 0 ? RunPart::settling : RunPart::measuring)) return false;
      if (look_ == 0)
        for (RunObserver* one : observers_) one->begin(*simulation_);
      simulation_->snapshot(at);
      const auto phase = static_cast<std::uint32_t>(look_ % schedule_.phases);
      for (RunObserver* one : observers_) one->look(*simulation_, at, look_, phase);
    }
    if (!advance_to(schedule_.end(), RunPart::measuring)) return false;
    for (RunObserver* one : observers_) one->end(*simulation_);
    return true;
  }

  std::unique_ptr<Simulation> simulation() { return std::move(simulation_); }

 private:
  void take_up(const std::vector<std::uint8_t>& kept) {
    ArchiveReader in(kept);
    std::vector<std::uint8_t> engine;
    visit(in, engine);
    for (RunObserver* one : observers_) one->load(in);
    if (!in.at_end()) throw std::invalid_argument("the state contains more data than this run needs");
    simulation_->restore(engine);
    if (step_ > schedule_.bath.size() || look_ > schedule_.looks())
      throw std::invalid_argument("the state belongs to another schedule");
    // The reservoir's temperature is no part of a checkpoint.
    if (step_ > 0) simulation_->set_bath_temperature(schedule_.bath[step_ - 1].temperature);
    if (look_ > 0)
      for (RunObserver* one : observers_) one->go_on(*simulation_);
  }

  template <class Archive>
  void visit(Archive& archive, std::vector<std::uint8_t>& engine) {
    std::uint64_t form = state_form;
    archive(form);
    if (form != state_form) throw std::invalid_argument("these bytes are not the state of a run");
    archive(engine, step_, look_);
  }

  // By way of the engine's synchronisations, where the state may be kept.
  bool advance_to(double time, RunPart part) {
    while (simulation_->time() < time) {
      const double synchronisation = simulation_->next_synchronisation();
      const bool synchronises = synchronisation <= time;
      if (stops(part)) return false;
      while (!simulation_->advance_towards(synchronises ? synchronisation : time, control_.events_between_questions))
        if (stops(part)) return false;
      if (!synchronises) return true;  // its time may be below this one by rounding, and go no further
      if (control_.keep && (!control_.keep_due || control_.keep_due(*simulation_)))
        control_.keep(*simulation_, [this] { return state(); });
    }
    return true;
  }

  bool stops(RunPart part) const {
    if (control_.progress) control_.progress(std::min(simulation_->time() / schedule_.end(), 1.0), part);
    return control_.stop && control_.stop();
  }

  std::vector<std::uint8_t> state() {
    std::vector<std::uint8_t> engine = simulation_->checkpoint();
    ArchiveWriter out;
    visit(out, engine);
    for (RunObserver* one : observers_) one->save(out);
    return out.take();
  }

  const MeasurementSchedule& schedule_;
  const std::vector<RunObserver*>& observers_;
  const RunControl& control_;
  std::unique_ptr<Simulation> simulation_;
  std::uint64_t step_ = 0, look_ = 0;  // to be done next
};

void check(const MeasurementSchedule& schedule) {
  const bool counts = schedule.periods > 0 && schedule.phases > 0 && schedule.period > 0 &&
                      std::isfinite(schedule.period) && schedule.settle >= 0 && std::isfinite(schedule.end());
  if (!counts)
    throw std::invalid_argument(
        "a schedule needs a period above 0, at least one period, and at least one sample in each period");
  double before = 0;
  for (const BathStep& step : schedule.bath) {
    if (step.until < before || step.until > schedule.settle * (1 + 1e-12))
      throw std::invalid_argument("the steps of the bath must be in the order of time and lie before the first sample");
    before = step.until;
  }
}

}  // namespace

RunResult measure(const Scene& scene, const MeasurementSchedule& schedule, const std::vector<RunObserver*>& observers,
                  const RunControl& control, const std::vector<std::uint8_t>& kept) {
  check(schedule);
  Run run(scene, schedule, observers, control);
  if (!kept.empty()) run.go_on_from(kept);
  const bool finished = run();
  return {finished, run.simulation()};
}

bool each_replica(std::uint32_t replicas, int threads, const std::function<bool(std::uint32_t)>& run) {
  std::atomic<bool> ends{false};
  for_each_index(replicas, threads, [&](std::size_t k) {
    if (!ends && !run(static_cast<std::uint32_t>(k))) ends = true;
  });
  return !ends;
}

}  // namespace shakebed::sim
