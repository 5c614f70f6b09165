// The loop that measures a bed. The bed settles, is then sampled at stated phases of its period, and observers receive
// each sample.
//
//   Observing<BedObserver> bed([&](const DiskProperties& disks) { return BedObserver(scene, disks, ...); });
//   measure(scene, schedule, {&bed});
//   bed->temperature_x();
//
// A run may be stopped between any two events. It continues from its latest stored state and ends with the same bytes.
// Replicas are runs of the same bed, each with its own seed. Their results do not depend on the number of threads.
// Reduced units.
//
// Observers belong to the caller, each to one run at a time, and are called from the thread that called measure(). The
// result owns its simulation. Any number of threads may measure, each with observers of its own.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/measure/archive.hpp"

namespace shakebed::sim {

// Before it settles, a bed's reservoir may go through temperatures: each holds until its time.
struct BathStep {
  double until, temperature;
};

struct MeasurementSchedule {
  std::vector<BathStep> bath;  // in the order of time
  double settle = 0;           // the first look; not before the bath's last step, but for rounding
  double period = 1;
  std::uint64_t periods = 1;  // that are measured
  std::uint32_t phases = 1;   // looks a period, equally spaced
  std::uint64_t looks() const { return periods * phases; }
  double moment(std::uint64_t look) const {
    return settle + (static_cast<double>(look / phases) + static_cast<double>(look % phases) / phases) * period;
  }
  double end() const { return moment(looks()); }
};

// What sees the looks of one run. Its state goes into the kept state of the run.
class RunObserver {
 public:
  virtual ~RunObserver() = default;
  virtual void prepare(Simulation& /*simulation*/) {
  }  // first of all, also of a run that goes on: all is as at the start
  virtual void step(Simulation& /*simulation*/, std::uint64_t /*step*/) {}  // at the end of a step of the bath
  virtual void begin(Simulation& /*simulation*/) {}                         // at the first look, before it
  virtual void look(Simulation& simulation, const Snapshot& at, std::uint64_t look, std::uint32_t phase) = 0;
  virtual void end(Simulation& /*simulation*/) {}    // when all periods are over
  virtual void go_on(Simulation& /*simulation*/) {}  // in place of begin(), after load() of a state with looks
  virtual void save(ArchiveWriter& out) = 0;
  virtual void load(ArchiveReader& in) = 0;
};

// Any class with observe(snapshot, phase) and visit(archive) as an observer: BedObserver and its like.
template <class Observed>
class Observing final : public RunObserver {
 public:
  using Make = std::function<Observed(const DiskProperties&)>;
  explicit Observing(Make make) : make_(std::move(make)) {}
  const Observed& operator*() const { return *observed_; }  // once measure() has been called
  const Observed* operator->() const { return &*observed_; }

  void prepare(Simulation& simulation) override { observed_.emplace(make_(simulation.properties())); }
  void look(Simulation&, const Snapshot& at, std::uint64_t, std::uint32_t phase) override {
    observed_->observe(at, phase);
  }
  void save(ArchiveWriter& out) override { out(*observed_); }
  void load(ArchiveReader& in) override { in(*observed_); }

 private:
  Make make_;
  std::optional<Observed> observed_;
};

enum class RunPart { annealing, settling, measuring };

// What the caller has to say while the run goes on. All may be empty.
struct RunControl {
  std::function<bool()> stop;                       // asked every events_between_questions; true ends the run there
  std::function<void(double, RunPart)> progress;    // the fraction of the run's time that is over
  std::function<void(const Simulation&)> gone_on;   // a kept state has been taken up
  std::function<bool(const Simulation&)> keep_due;  // asked at every synchronisation of the engine
  using State = std::function<std::vector<std::uint8_t>()>;   // makes a state from which measure() goes on
  std::function<void(const Simulation&, const State&)> keep;  // where it is due
  std::uint64_t events_between_questions = 200'000;           // 0.03 to 0.1 s of processor time
};

// A kept state cannot be used. The observers are then as after prepare() or partly loaded.
struct StateError : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

struct RunResult {
  bool finished = false;  // false: it was stopped
  std::unique_ptr<Simulation> simulation;
};

// Runs the scene by the schedule; `kept`: a state that an earlier call gave to keep(), or empty. Throws
// std::invalid_argument with check()'s words, StateError where the state is not one of this run.
RunResult measure(const Scene& scene, const MeasurementSchedule& schedule, const std::vector<RunObserver*>& observers,
                  const RunControl& control = {}, const std::vector<std::uint8_t>& kept = {});

// Calls run(k) for every k below `replicas`, each once, on so many threads; the first exception is thrown again when
// all have returned. Later replicas are not begun once one has failed or returned false (it was stopped): false then.
bool each_replica(std::uint32_t replicas, int threads, const std::function<bool(std::uint32_t)>& run);

}  // namespace shakebed::sim
