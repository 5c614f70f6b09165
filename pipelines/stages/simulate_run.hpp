// One run of a bed by a simulate stage: what is measured of it, its frames, its checkpoints.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/stages/annealing.hpp"
#include "pipelines/stages/bed_measurement.hpp"
#include "pipelines/stages/frame_store.hpp"
#include "pipelines/stages/stage.hpp"
#include "sim/measure/measure.hpp"
#include "sim/measure/measured_bed.hpp"

namespace shakebed::pipelines {

struct FramePlan {
  sim::LookPlan looks;
  std::string file;  // in the stage's output
};

struct RunPlan {
  sim::Scene scene;
  sim::MeasurementSchedule schedule;  // without the bath, which `annealing` gives
  std::vector<AnnealingStep> annealing;
  double bath_temperature = 0;  // before the annealing
  MeasurementPlan measurement;
  FramePlan frames;
  double checkpoint_seconds = 0;
  std::filesystem::path folder;  // for checkpoints and the growing trajectory
  bool lead = true;              // the run whose trajectory is kept
};

// About how many seconds of a processor the run takes, by a fiftieth of it (at least two periods) or 0.1 s.
double trial_seconds(const sim::Scene& scene, const sim::MeasurementSchedule& schedule,
                     std::vector<sim::RunObserver*> observers = {});

// BedMeasurement and the trajectory as observers of a run.
class RunMeasurement final : public sim::RunObserver {
 public:
  explicit RunMeasurement(const RunPlan& plan) : plan_(plan) {}
  bool begun() const { return bed_.has_value(); }  // there is a simulation: the scene could be made
  const BedMeasurement& bed() const { return *bed_; }
  void finish_frames(const std::filesystem::path& destination);
  const sim::DiskProperties& properties() const { return properties_; }

  void prepare(sim::Simulation& simulation) override;
  void begin(sim::Simulation& simulation) override;
  void look(sim::Simulation& simulation, const sim::Snapshot& at, std::uint64_t look, std::uint32_t phase) override;
  void end(sim::Simulation& simulation) override { bed_->end(simulation); }
  void go_on(sim::Simulation& simulation) override { bed_->go_on(simulation); }
  void save(sim::ArchiveWriter& out) override { visit(out); }
  void load(sim::ArchiveReader& in) override;

 private:
  template <class Archive>
  void visit(Archive& archive) {
    archive(*bed_);
    if (frames_) archive(*frames_);
  }
  const RunPlan& plan_;
  sim::DiskProperties properties_;
  std::optional<BedMeasurement> bed_;
  std::optional<FrameStore> frames_;
};

// Processor time of the run's thread [s], of all its parts where it was killed and went on.
class CpuClock final : public sim::RunObserver {
 public:
  double seconds() const;
  double measuring_seconds() const { return seconds() - settled_; }  // since the first look
  void prepare(sim::Simulation&) override;
  void begin(sim::Simulation&) override { settled_ = seconds(); }
  void look(sim::Simulation&, const sim::Snapshot&, std::uint64_t, std::uint32_t) override {}
  void save(sim::ArchiveWriter& out) override;
  void load(sim::ArchiveReader& in) override { in(before_, settled_); }

 private:
  double before_ = 0, start_ = 0, settled_ = 0;
};

class BedRun {
 public:
  using Progress = std::function<void(double, sim::RunPart)>;  // the share of the run that is over
  BedRun(RunPlan plan, RunContext& context, Progress progress = {});

  // Runs the bed to its end, from its checkpoint where there is one. Throws StageError, Interrupted.
  void operator()();

  const BedMeasurement& measurement() const { return measurement_.bed(); }
  double cpu_seconds() const { return cpu_seconds_; }
  double measuring_cpu_seconds() const { return measuring_cpu_seconds_; }
  std::uint64_t measuring_events() const {
    return simulation_->counters().events() - measurement().counters_at_begin().events();
  }
  sim::Counters counters() const { return simulation_->counters(); }
  Json results(const SceneOptions& bed) const;  // of observables.json
  void write();                                 // everything but observables.json and bed.json

 private:
  using Clock = std::chrono::steady_clock;
  sim::RunResult measured(const std::vector<std::uint8_t>& kept);
  sim::RunControl control();
  std::vector<std::uint8_t> read_checkpoint() const;
  double slot_of(const sim::Simulation& simulation) const;
  void check_precision(const sim::Simulation& simulation);
  bool keep_is_due(const sim::Simulation& simulation) const;
  bool save_is_due() const;
  void keep(const sim::Simulation& simulation, const sim::RunControl::State& state);
  void save();
  void warn_of_checkpoint(const char* why);

  RunPlan plan_;
  RunContext& context_;
  Progress progress_;
  std::filesystem::path checkpoint_;
  Annealing annealing_;
  RunMeasurement measurement_;
  CpuClock clock_;
  std::unique_ptr<sim::Simulation> simulation_;
  double cpu_seconds_ = 0, measuring_cpu_seconds_ = 0;

  // The latest sound state, in memory, and when it was made and is to be made anew.
  std::vector<std::uint8_t> sound_;
  double keep_at_ = 0;       // of the run's time
  double checked_slot_ = 0;  // of the run's time, in which precision was asked for last
  Clock::time_point last_saved_, kept_at_, keep_after_;
};

// "annealing", "settling", "measuring".
const char* name_of(sim::RunPart part);

// Writes the state from which a killed run continues, behind its hash.
void write_checkpoint(const std::filesystem::path& path, const std::vector<std::uint8_t>& state);

// Does nothing while the simulation is precise (sim/measure/observables.hpp). Else it writes the last state with
// sufficient precision, if there is one, and throws StageError. The error says what is wrong, when it began, and where
// that state is.
void require_precision(const sim::Simulation& simulation, const std::vector<std::uint8_t>& last_sound,
                       const std::filesystem::path& checkpoint);

}  // namespace shakebed::pipelines
