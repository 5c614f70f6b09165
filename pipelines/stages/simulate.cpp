#include "pipelines/stages/simulate.hpp"

#include <time.h>

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <numeric>
#include <thread>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "pipelines/stages/bed_measurement.hpp"
#include "pipelines/stages/bed_results.hpp"
#include "pipelines/stages/kernel_options.hpp"
#include "pipelines/stages/replica_seed.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "sim/engine/random.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/measure/archive.hpp"
#include "sim/measure/observables.hpp"

namespace shakebed::pipelines {

namespace {

namespace fs = std::filesystem;

double thread_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct FrameOptions {
  std::uint32_t count = 0;
  std::uint32_t phases = 32;
};
struct ProfileOptions {
  double spacing = 0.25;  // [D]
  Kernel kernel{KernelKind::gaussian, 0.5};
};
// Of the reservoir's temperature, before the bed settles.
struct AnnealingStep {
  double temperature = 0;  // T/(m g), a length
  double ramp = 0;         // time in which T changes linearly to it
  double hold = 0;         // time for which it stays
};

// ------------------------------------------------------------------------------------------------ frames

// The trajectory while it grows: frames are joined into groups of a fixed number, each of which is written (and
// compressed) by itself, so that a run that goes on from a checkpoint ends with the same bytes.
class FrameStore {
 public:
  FrameStore(fs::path path, std::size_t disks)
      : path_(std::move(path)), frames_a_group_(std::max<std::size_t>(1, 200'000 / std::max<std::size_t>(disks, 1))) {}

  void start() {  // an empty file
    std::ofstream(path_, std::ios::binary | std::ios::trunc).flush();
    bytes_ = 0;
  }
  // After the state has been read from a checkpoint: what was written later is cut off.
  void go_on() {
    std::error_code error;
    if (fs::file_size(path_, error) < bytes_ || error)
      throw StageError(fmt::format("{}: the trajectory so far is not there", path_.string()));
    fs::resize_file(path_, bytes_);
  }
  void add(TrajectoryFrame frame) {
    waiting_.push_back(std::move(frame));
    if (waiting_.size() == frames_a_group_) write_group();
  }
  void finish(const fs::path& destination) {
    if (!waiting_.empty()) write_group();
    fs::rename(path_, destination);
  }

  template <class Archive>
  void visit(Archive& archive) {
    std::uint64_t count = waiting_.size();
    archive(bytes_, count);
    waiting_.resize(count);
    for (TrajectoryFrame& f : waiting_)
      archive(f.time, f.phase, f.floor_position, f.floor_velocity, f.width, f.height, f.periodic, f.x, f.z, f.vx, f.vz,
              f.spin, f.radius);
  }

 private:
  void write_group() {
    const fs::path group = path_.parent_path() / ("group-" + path_.filename().string());
    TrajectoryWriter writer(group);
    for (const TrajectoryFrame& frame : waiting_) writer.write(frame);
    writer.close();
    const std::string text = read_file(group);
    fs::remove(group);
    std::ofstream out(path_, std::ios::binary | std::ios::app);
    out.write(text.data(), static_cast<std::streamsize>(text.size()));
    if (!out.flush()) throw StageError(fmt::format("{}: cannot be written", path_.string()));
    bytes_ += text.size();
    waiting_.clear();
  }
  fs::path path_;
  std::size_t frames_a_group_;
  std::uint64_t bytes_ = 0;
  std::vector<TrajectoryFrame> waiting_;
};

TrajectoryFrame frame_of(const sim::Snapshot& at, const sim::Scene& scene, const sim::DiskProperties& properties,
                         double phase) {
  TrajectoryFrame frame;
  frame.time = at.time;
  frame.phase = phase;
  frame.floor_position = at.floor_position;
  frame.floor_velocity = at.floor_velocity;
  frame.width = scene.box.width;
  frame.periodic = std::holds_alternative<sim::PeriodicSides>(scene.box.sides);
  frame.x = at.x;
  frame.z = at.z;
  frame.vx = at.vx;
  frame.vz = at.vz;
  frame.spin = at.spin;
  frame.radius = properties.radius;
  return frame;
}

// ------------------------------------------------------------------------------------------------ the stage

class Simulate : public Stage {
 public:
  void describe(Fields& fields) override;
  void results(ResultList& list) const override {
    state_bed_results(list, {.reduced = bed_.description().reduced,
                             .weightless = bed_.weightless(),
                             .periodic_upwards = bed_.periodic_upwards(),
                             .shaken = bed_.period() > 0,
                             .frames = frames_.count > 0,
                             .annealed = !annealing_.empty(),
                             .replicas = replicas_,
                             .observe = ObserveOptions::from(observe_)});
  }
  Json facts() const override { return bed_.facts(); }
  void run(RunContext& context) const override;
  std::optional<BedDescription> bed() const override;

 private:
  // When snapshots are taken, in reduced time. A shaken bed is looked at `phases` times a period, and every frame is
  // one of those moments; a bed on a still floor at equal intervals.
  struct Schedule {
    double settle = 0;          // the first look, after the annealing
    std::uint64_t periods = 0;  // measured
    std::uint32_t phases = 1;   // snapshots a period
    double period = 1;
    std::uint64_t frame_stride = 0;  // in snapshots, with no factor in common with phases; 0: no frames
    std::uint64_t frames = 0;
    double moment(std::uint64_t snapshot) const {
      return settle +
             (static_cast<double>(snapshot / phases) + static_cast<double>(snapshot % phases) / phases) * period;
    }
  };
  Schedule schedule() const;
  double annealing_time() const;
  sim::Scene scene(const RunContext& context, std::uint64_t seed) const;
  MeasurementPlan measurement_plan(const sim::Scene& scene) const;

  class Run;
  SceneOptions bed_;
  double settle_ = 0, measure_ = 0;
  FrameOptions frames_;
  ProfileOptions profile_;
  std::vector<AnnealingStep> annealing_;
  std::vector<std::string> observe_;
  std::uint32_t replicas_ = 1;
  double checkpoint_seconds_ = 30;
  bool compress_ = true;
};

void Simulate::describe(Fields& fields) {
  bed_.describe(fields);
  fields.quantity("settle", settle_, dimension::time,
                  {.help = "time before anything is measured", .range = non_negative, .example = "\"10 s\""});
  fields.quantity(
      "measure", measure_, dimension::time,
      {.help = "time over which the bed is measured", .required = true, .range = positive, .example = "\"20 s\""});
  fields.object<FrameOptions>(
      "frames", frames_,
      [](Fields& f, FrameOptions& frames) {
        f.integer("count", frames.count, {.help = "frames of the trajectory to keep; 0 for none"});
        f.integer("phases", frames.phases,
                  {.help = "moments of each period at which the bed is looked at; the frames visit all of them in turn",
                   .range = from_to(1, 4096)});
      },
      {.help = "the trajectory"});
  fields.object<ProfileOptions>(
      "profile", profile_,
      [](Fields& f, ProfileOptions& p) {
        f.number("spacing", p.spacing, {.help = "distance of the profile's heights in D", .range = from_to(1e-3, 10)});
        f.object<Kernel>("kernel", p.kernel, describe_measuring_kernel,
                         {.help = "the window through which density is measured"});
      },
      {.help = "the density profile"});
  fields.array<AnnealingStep>(
      "schedule", annealing_,
      [](Fields& f, AnnealingStep& step) {
        f.quantity("temperature", step.temperature, dimension::length,
                   {.help = "T/(m g) of the reservoir", .required = true, .range = positive});
        f.quantity("ramp", step.ramp, dimension::time,
                   {.help = "time in which T changes linearly to it, from that of the step before (or of the bath)",
                    .range = non_negative});
        f.quantity(
            "hold", step.hold, dimension::time,
            {.help = "time for which it stays; its second half is averaged for schedule.csv", .range = non_negative});
      },
      {.help =
           "annealing: temperatures of the bath, one after the other, before the bed settles; it stays at the last"});
  fields.texts("observe", observe_,
               {.help = "measured only when named: order (psi_6, neighbours, vacancies), velocities (a2, histogram), "
                        "displacement, pressure (by height, with exact averages over time), phases (means by height "
                        "and phase)"});
  fields.integer(
      "replicas", replicas_,
      {.help = "runs of the same bed with seeds of their own; results are means with the spread between them",
       .range = from_to(1, 10'000)});
  fields.number(
      "checkpoint_seconds", checkpoint_seconds_,
      {.help = "a killed run goes on from a state at most about this old; 0: from none", .range = non_negative});
  fields.boolean("compress", compress_, {.help = "trajectory.extxyz.zst instead of .extxyz"});
  if (!fields.decoding()) return;
  for (const std::string& name : observe_) {
    const auto& known = ObserveOptions::names();
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    const std::string nearest = nearest_name(name, known);
    fields.problem("/observe", "\"" + name + "\" is nothing that can be observed",
                   nearest.empty() ? "One of: order, velocities, displacement, pressure, phases"
                                   : "Did you mean \"" + nearest + "\"?");
  }
  if (fields.problem_count() > 0) return;
  fields.require(annealing_.empty() || bed_.bath_temperature() > 0, "schedule",
                 "there is no bath whose temperature could change",
                 "Name a \"bath\": langevin, andersen or thermal_floor");
  for (std::size_t k = 0; k < annealing_.size(); ++k)
    fields.require(annealing_[k].ramp + annealing_[k].hold > 0, "schedule/" + std::to_string(k),
                   "the step lasts no time", "Give \"ramp\" or \"hold\"");
  fields.require(!ObserveOptions::from(observe_).pressure || !bed_.periodic_upwards(), "observe",
                 "the pressure by height needs a height, but the box is periodic upwards",
                 "compressibility_factor is measured anyway");
  const double period = bed_.period() * bed_.time_unit();
  fields.require(period == 0 || measure_ >= period, "measure",
                 "the bed must be measured over at least one period of the floor",
                 "Give " + quantity_text(period, dimension::time) + " or more");
  const bool countable = period == 0 || measure_ / period <= 1e12;
  fields.require(countable, "measure", "the floor would shake more than 1e12 times, which no run lives to see",
                 "Measure shorter, or shake more slowly");
  if (frames_.count > 0 && countable) {
    const Schedule plan = schedule();
    fields.require(plan.frame_stride > 0, "frames/count",
                   std::to_string(frames_.count) + " frames do not fit into the " +
                       std::to_string(plan.periods * plan.phases) + " moments at which the bed is looked at",
                   "Measure longer, or ask for fewer frames");
  }
  bed_.warn(fields, settle_);
}

Simulate::Schedule Simulate::schedule() const {
  Schedule plan;
  plan.settle = annealing_time() + settle_ / bed_.time_unit();
  const double measure = measure_ / bed_.time_unit();
  plan.period = bed_.period();
  plan.phases = frames_.phases;
  if (plan.period > 0) {
    plan.periods = static_cast<std::uint64_t>(measure / plan.period * (1 + 1e-12));
    // Begin at phase 0.
    plan.settle = std::ceil(plan.settle / plan.period * (1 - 1e-12)) * plan.period;
  } else {
    const double wanted = std::clamp(measure * 4, 100.0, 20'000.0);
    plan.phases = 1;
    plan.periods = std::max<std::uint64_t>(static_cast<std::uint64_t>(wanted), frames_.count);
    plan.period = measure / static_cast<double>(plan.periods);
  }
  if (frames_.count > 0) {
    plan.frames = frames_.count;
    plan.frame_stride = plan.periods * plan.phases / frames_.count;
    while (plan.frame_stride > 1 && std::gcd(plan.frame_stride, std::uint64_t{plan.phases}) > 1) --plan.frame_stride;
  }
  return plan;
}

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
  double amplitude = 0;
  if (const auto* sine = std::get_if<sim::SinusoidalFloor>(&scene.box.floor)) amplitude = sine->amplitude;
  if (const auto* table = std::get_if<sim::TabulatedFloor>(&scene.box.floor))
    for (double h : table->heights) amplitude = std::max(amplitude, std::abs(h));
  double temperature = bed_.bath_temperature();
  if (!annealing_.empty()) temperature = std::max(temperature, annealing_.back().temperature / bed_.length_unit());
  const Schedule times = schedule();
  MeasurementPlan plan;
  plan.phases = times.phases;
  plan.period = times.period;
  plan.grid.spacing = profile_.spacing;
  plan.grid.lowest = -std::ceil((amplitude + 6 * profile_.kernel.width + 1) / plan.grid.spacing) * plan.grid.spacing;
  const double loose_height = 6 * scene.count() / scene.box.width + 30 + 25 * temperature;
  plan.grid.points =
      static_cast<std::size_t>(std::min((loose_height - plan.grid.lowest) / plan.grid.spacing, 200'000.0));
  plan.kernel = profile_.kernel;
  plan.observe = ObserveOptions::from(observe_);
  return plan;
}

// ------------------------------------------------------------------------------------------------ one run

// The bed run once: its simulation, what is measured of it, and how far it has come. All of this is in a checkpoint.
class Simulate::Run {
 public:
  Run(const Simulate& stage, RunContext& context, std::uint32_t replica, std::uint32_t replicas)
      : stage_(stage),
        context_(context),
        folder_(context.scratch() / (replicas > 1 ? "replica-" + std::to_string(replica) : std::string("run"))),
        times_(stage.schedule()),
        lead_(replica == 0) {
    scene_ = stage.scene(context, replica_seed(context.seed(), replica));
    if (replica > 0) tell_apart();
    fs::create_directories(folder_);
    plan_annealing();
    start();
    if (!fs::exists(folder_ / "checkpoint") || !resume()) begin_frames();
  }

  void operator()() {
    const double cpu_start = thread_cpu_seconds();
    cpu_start_ = cpu_start;
    last_saved_ = std::chrono::steady_clock::now();
    anneal();
    run_to(times_.settle, "settling");
    const std::uint64_t moments = times_.periods * times_.phases;
    sim::Snapshot at;
    for (; moment_ < moments; ++moment_) {
      run_to(times_.moment(moment_), "measuring");
      if (moment_ == 0) measurement_->begin(*simulation_);
      simulation_->snapshot(at);
      const auto phase = static_cast<std::uint32_t>(moment_ % times_.phases);
      const bool frame =
          times_.frames > 0 && moment_ % times_.frame_stride == 0 && moment_ / times_.frame_stride < times_.frames;
      measurement_->look(*simulation_, at, phase, frame);
      if (frame && frames_)
        frames_->add(frame_of(at, scene_, properties_,
                              stage_.bed_.period() > 0 ? static_cast<double>(phase) / times_.phases : 0));
    }
    run_to(times_.moment(moments), "measuring");
    measurement_->end(*simulation_);
    require_precision(*simulation_, sound_, folder_ / "checkpoint");
    cpu_ += thread_cpu_seconds() - cpu_start;
  }

  const BedMeasurement& measurement() const { return *measurement_; }
  double cpu_seconds() const { return cpu_; }
  sim::Counters counters() const { return simulation_->counters(); }

  Json results() const {
    Json out;
    measurement_->results(stage_.bed_, scene_, out);
    const BedDescription bed = stage_.bed_.description();
    const sim::EnergyLedger energy = simulation_->energy();
    const sim::Counters counters = simulation_->counters();
    out["gamma"] = quantity_json(stage_.bed_.gamma(), "1");
    out["column_number"] = quantity_json(bed.column_number(), "1");
    out["energy_ledger"] = {{"unit", stage_.bed_.weightless() ? "T0" : "m g D"},
                            {"initial", energy.initial},
                            {"kinetic", energy.kinetic},
                            {"potential", energy.potential},
                            {"dissipated", energy.dissipated},
                            {"floor_work", energy.floor_work},
                            {"bath_work", energy.bath_work},
                            {"imbalance", energy.imbalance()}};
    out["collisions"] = counters.collisions();
    out["disk_collisions"] = counters.disk_collisions;
    out["wall_collisions"] = counters.wall_collisions;
    out["floor_collisions"] = counters.floor_collisions;
    out["elastic_contacts"] = counters.elastic_contacts;
    out["events"] = counters.events();
    out["periods"] = measurement_->bed().periods();
    out["max_overlap"] = quantity_json(simulation_->largest_overlap(), "D");
    return out;
  }

  // Everything but observables.json and bed.json.
  void write() {
    measurement_->write(context_, times_.frames > 0);
    if (frames_) frames_->finish(context_.output(trajectory_name()));
    TrajectoryWriter final(context_.output("final.extxyz"));
    sim::Snapshot at;
    simulation_->snapshot(at);
    final.write(frame_of(at, scene_, properties_, 0));
    final.close();
    if (!stage_.annealing_.empty()) schedule_table().write(context_.output("schedule.csv"));
    if (measurement_->above_profile() > 0)
      context_.warning(std::to_string(measurement_->above_profile()) +
                       " disk positions lay above the highest bin of the profile and are missing from it");
  }

 private:
  // The temperature of the bath up to a time; in the holds, looks whose means are told in schedule.csv.
  struct Stop {
    double time, temperature;
    std::uint32_t step;
    bool look;
  };

  // Replicas that begin from the same placed disks differ by who has which velocity.
  void tell_apart() {
    auto* placed = std::get_if<sim::PlacedStart>(&scene_.start);
    if (placed == nullptr) return;
    sim::Random random(scene_.seed);
    for (std::size_t i = placed->disks.size(); i > 1; --i) {
      sim::Placed &one = placed->disks[i - 1], &other = placed->disks[random.below(static_cast<std::uint32_t>(i))];
      if (one.species != other.species) continue;
      std::swap(one.vx, other.vx);
      std::swap(one.vz, other.vz);
      std::swap(one.spin, other.spin);
    }
  }

  void plan_annealing() {
    double time = 0, before = stage_.bed_.bath_temperature();
    for (std::uint32_t k = 0; k < stage_.annealing_.size(); ++k) {
      const AnnealingStep& step = stage_.annealing_[k];
      const double to = step.temperature / stage_.bed_.length_unit();
      const double ramp = step.ramp / stage_.bed_.time_unit(), hold = step.hold / stage_.bed_.time_unit();
      // A ramp in pieces of a time unit, each at the temperature of its middle; a hold in 64.
      const int pieces = ramp > 0 ? static_cast<int>(std::clamp(std::ceil(ramp), 16.0, 10'000.0)) : 0;
      for (int i = 0; i < pieces; ++i)
        stops_.push_back({time + ramp * (i + 1) / pieces, before + (to - before) * (i + 0.5) / pieces, k, false});
      time += ramp;
      for (int i = 0; i < 64 && hold > 0; ++i) stops_.push_back({time + hold * (i + 1) / 64, to, k, i >= 32});
      time += hold;
      before = to;
    }
    step_means_.assign(stage_.annealing_.size(), sim::BlockedMean(2));
  }

  void start() {
    try {
      simulation_ = sim::simulate(scene_);
    } catch (const std::bad_alloc&) {
      throw;  // the runner says that memory is short
    } catch (const std::exception& error) {
      throw StageError(error.what());
    }
    properties_ = simulation_->properties();
    measurement_.emplace(scene_, properties_, stage_.measurement_plan(scene_));
    stop_ = moment_ = 0;
    cpu_ = 0;
    step_means_.assign(stage_.annealing_.size(), sim::BlockedMean(2));
    if (lead_ && times_.frames > 0) frames_.emplace(folder_ / trajectory_name(), properties_.mass.size());
  }
  void begin_frames() {
    if (frames_) frames_->start();
  }

  std::string trajectory_name() const { return stage_.compress_ ? "trajectory.extxyz.zst" : "trajectory.extxyz"; }

  template <class Archive>
  void visit(Archive& archive, std::vector<std::uint8_t>& engine) {
    std::uint64_t form = 0x31306e7572626b73;  // "skbrun01"
    archive(form);
    if (form != 0x31306e7572626b73) throw std::invalid_argument("it is of another version");
    archive(engine, stop_, moment_, cpu_, step_means_, *measurement_);
    if (frames_) archive(*frames_);
  }

  std::vector<std::uint8_t> state() {
    std::vector<std::uint8_t> engine = simulation_->checkpoint();
    const double cpu = cpu_;
    cpu_ += thread_cpu_seconds() - cpu_start_;
    sim::ArchiveWriter out;
    visit(out, engine);
    cpu_ = cpu;
    return out.take();
  }

  // False where the checkpoint cannot be used: all is then as at the start.
  bool resume() {
    try {
      const std::string text = read_file(folder_ / "checkpoint");
      constexpr std::size_t hash_size = 32;
      if (text.size() < hash_size || fast_hash(std::string_view(text).substr(hash_size)) != text.substr(0, hash_size))
        throw std::invalid_argument("it is damaged");
      const std::vector<std::uint8_t> bytes(text.begin() + hash_size, text.end());
      std::vector<std::uint8_t> engine;
      sim::ArchiveReader in(bytes);
      visit(in, engine);
      if (!in.at_end()) throw std::invalid_argument("it holds more than this run needs");
      simulation_->restore(engine);
      if (frames_) frames_->go_on();
      if (stop_ == stops_.size() && !stops_.empty()) simulation_->set_bath_temperature(stops_.back().temperature);
      if (moment_ > 0) measurement_->go_on(*simulation_);
      context_.log(fmt::format("goes on at {:.6g} of {:.6g} time units", simulation_->time(),
                               times_.moment(times_.periods * times_.phases)));
      return true;
    } catch (const std::exception& error) {
      context_.warning(
          fmt::format("{}: cannot be used ({}); the run begins anew", (folder_ / "checkpoint").string(), error.what()));
      start();
      return false;
    }
  }

  // In steps short enough to be interrupted, the same ones in a run that goes on from a checkpoint. Where a
  // synchronisation of the engine lies on the way and it is time, the state is kept: in memory now and then, on disk
  // every `checkpoint_seconds`.
  void run_to(double time, const char* what) {
    const double step = std::max(stage_.bed_.period(), 1.0);
    const double end = times_.moment(times_.periods * times_.phases);
    while (simulation_->time() < time) {
      stop_if_interrupted();
      const double steps_done = std::floor(simulation_->time() / step + 1e-9);
      const double goal = std::min(time, (steps_done + 1) * step);
      const double synchronisation = simulation_->next_synchronisation();
      const bool save_due = stage_.checkpoint_seconds_ > 0 &&
                            std::chrono::duration<double>(std::chrono::steady_clock::now() - last_saved_).count() >=
                                stage_.checkpoint_seconds_;
      const bool keep_due = simulation_->time() >= keep_at_ || std::chrono::steady_clock::now() >= keep_after_;
      if ((save_due || keep_due) && synchronisation <= goal) {
        advance_to(synchronisation);
        require_precision(*simulation_, sound_, folder_ / "checkpoint");
        keep();
        keep_at_ = simulation_->time() + end / 16;
        if (save_due) save();
      } else {
        advance_to(goal);
      }
      if (lead_) context_.progress(simulation_->time() / end, what);
    }
  }

  // However many events that takes, an interruption is answered within some of them, and then the latest state is
  // saved.
  void advance_to(double time) {
    constexpr std::uint64_t events_between_looks = 200'000;  // 0.03 to 0.1 s
    while (!simulation_->advance_towards(time, events_between_looks)) stop_if_interrupted();
  }
  void stop_if_interrupted() {
    if (context_.interrupted() && stage_.checkpoint_seconds_ > 0 && kept_at_ > last_saved_) save();
    context_.check_interrupted();
  }

  // The state, in memory: often enough that an interruption loses little, seldom enough to cost at most a fiftieth.
  void keep() {
    const auto start = std::chrono::steady_clock::now();
    sound_ = state();
    kept_at_ = std::chrono::steady_clock::now();
    keep_after_ =
        kept_at_ + std::max<std::chrono::steady_clock::duration>(50 * (kept_at_ - start), std::chrono::seconds(2));
  }

  void save() {
    write_checkpoint(folder_ / "checkpoint", sound_);
    last_saved_ = std::chrono::steady_clock::now();
  }

  void anneal() {
    sim::Snapshot at;
    for (; stop_ < stops_.size(); ++stop_) {
      const Stop& stop = stops_[stop_];
      simulation_->set_bath_temperature(stop.temperature);
      run_to(stop.time, "annealing");
      if (!stop.look) continue;
      simulation_->snapshot(at);
      double mass = 0, height = 0, kinetic = 0;
      for (std::size_t i = 0; i < at.z.size(); ++i) {
        const double m = properties_.mass[i];
        mass += m;
        height += m * at.z[i];
        kinetic += m * (at.vx[i] * at.vx[i] + at.vz[i] * at.vz[i]) / 2;
      }
      const double sample[] = {kinetic / static_cast<double>(at.z.size()), height / mass};
      step_means_[stop.step].add(sample);
    }
  }

  Table schedule_table() const {
    Table table = context_.table("schedule.csv");
    for (std::size_t k = 0; k < step_means_.size(); ++k) {
      const sim::BlockedMean& means = step_means_[k];
      const bool seen = means.samples() > 0;
      const double bath = stage_.annealing_[k].temperature / stage_.bed_.length_unit();
      table.add({count_cell(k), bath, seen ? means.mean(0) : no_number, seen ? means.std_error(0) : no_number,
                 seen ? means.mean(1) : no_number, seen ? means.std_error(1) : no_number});
    }
    return table;
  }

  const Simulate& stage_;
  RunContext& context_;
  fs::path folder_;
  Schedule times_;
  bool lead_;  // the one whose trajectory is kept and whose progress is shown
  sim::Scene scene_;
  sim::DiskProperties properties_;
  std::unique_ptr<sim::Simulation> simulation_;
  std::vector<Stop> stops_;

  // What a checkpoint holds.
  std::uint64_t stop_ = 0, moment_ = 0;
  double cpu_ = 0;
  std::vector<sim::BlockedMean> step_means_;
  std::optional<BedMeasurement> measurement_;
  std::optional<FrameStore> frames_;

  double cpu_start_ = 0;
  double keep_at_ = 0;
  std::vector<std::uint8_t> sound_;
  std::chrono::steady_clock::time_point last_saved_, kept_at_, keep_after_;
};

// ------------------------------------------------------------------------------------------------ replicas

// Mean and spread of a number over the replicas.
struct Spread {
  double mean = 0, deviation = 0;
  explicit Spread(const std::vector<double>& values) {
    const auto n = static_cast<double>(values.size());
    for (const double v : values) mean += v / n;
    for (const double v : values) deviation += (v - mean) * (v - mean) / (n - 1);
    deviation = std::sqrt(deviation);
  }
};

// Quantities become means with their error and spread, counts become sums; what is neither is the first's.
Json joined(const std::vector<Json>& results) {
  Json out = results.front();
  for (auto& [key, value] : out.items()) {
    std::vector<double> values;
    for (const Json& r : results) {
      const Json& v = r.at(key);
      const Json& number = v.is_object() && v.contains("value") ? v.at("value") : v;
      if (number.is_number()) values.push_back(number.get<double>());
    }
    if (values.size() != results.size()) continue;
    if (value.is_number_unsigned()) {
      std::uint64_t sum = 0;
      for (const Json& r : results) sum += r.at(key).get<std::uint64_t>();
      value = sum;
    } else if (key == "max_overlap") {
      value["value"] = *std::max_element(values.begin(), values.end());
    } else if (value.is_object() && value.contains("std_error")) {
      const Spread spread(values);
      value["value"] = spread.mean;
      value["std_error"] = spread.deviation / std::sqrt(static_cast<double>(values.size()));
      value["spread"] = spread.deviation;
    }
  }
  out["replicas"] = results.size();
  return out;
}

Table replicas_table(const std::vector<Json>& results) {
  std::vector<StatedColumn> columns{{"replica", "1", "number of the replica, from 0"}};
  for (const auto& [key, value] : results.front().items())
    if (value.is_object() && value.contains("std_error"))
      columns.push_back({key, value.value("unit", std::string("1")), key + " of the replica"});
  Table table("each replica by itself", columns);
  for (std::size_t k = 0; k < results.size(); ++k) {
    std::vector<Cell> cells{count_cell(k)};
    for (const auto& [key, value] : results[k].items())
      if (value.is_object() && value.contains("std_error"))
        cells.emplace_back(value["value"].is_number() ? value["value"].get<double>() : no_number);
    table.add(std::move(cells));
  }
  return table;
}

// The same file of every replica's measurement: mean densities, errors from their spread.
sim::Profile joined_density(const std::vector<const BedMeasurement*>& measurements, bool floor_frame) {
  std::vector<sim::Profile> profiles;
  for (const BedMeasurement* m : measurements) profiles.push_back(m->bed().density(floor_frame));
  sim::Profile out = profiles.front();
  for (std::size_t i = 0; i < out.height.size(); ++i) {
    std::vector<double> values;
    for (const sim::Profile& p : profiles) values.push_back(p.number_density[i]);
    const Spread spread(values);
    out.number_density[i] = spread.mean;
    out.std_error[i] = spread.deviation / std::sqrt(static_cast<double>(values.size()));
  }
  out.samples *= profiles.size();
  return out;
}

// Of the filled rows of the mean of the replicas' densities: what each shows of it by itself, together, and where the
// replicas differ by more than that (beds are not all built alike), so much more of it.
std::vector<double> joined_covariance(const std::vector<const BedMeasurement*>& measurements,
                                      const sim::Profile& joined, std::size_t& independent_blocks) {
  const Rows rows = filled_rows(joined);
  const std::size_t n = rows.last - rows.first;
  const auto replicas = static_cast<double>(measurements.size());
  std::vector<double> covariance(n * n, 0.0);
  independent_blocks = 0;
  for (const BedMeasurement* m : measurements) {
    const std::vector<double> own = m->bed().density_covariance(rows.first, rows.last);
    for (std::size_t i = 0; i < n * n; ++i) covariance[i] += own[i] / (replicas * replicas);
    independent_blocks += m->bed().covariance_blocks();
  }
  double seen = 0, own = 0;
  for (std::size_t i = 0; i < n; ++i) {
    seen += joined.std_error[rows.first + i] * joined.std_error[rows.first + i];
    own += covariance[i * n + i];
  }
  if (seen > own && own > 0)
    for (double& value : covariance) value *= seen / own;
  return covariance;
}

std::optional<BedDescription> Simulate::bed() const {
  BedDescription description = bed_.description();
  if (!annealing_.empty()) description.bath_temperature = annealing_.back().temperature / bed_.length_unit();
  return description;
}

void Simulate::run(RunContext& context) const {
  std::vector<std::unique_ptr<Run>> runs(replicas_);
  if (replicas_ == 1) {
    runs[0] = std::make_unique<Run>(*this, context, 0, 1);
    (*runs[0])();
  } else {
    // Each replica on one thread; which does not matter.
    std::atomic<std::uint32_t> next{0};
    std::mutex mutex;
    std::exception_ptr failure;
    const auto work = [&] {
      for (std::uint32_t k = next++; k < replicas_; k = next++) {
        try {
          {
            const std::lock_guard lock(mutex);
            if (failure) return;
          }
          auto one = std::make_unique<Run>(*this, context, k, replicas_);
          (*one)();
          const std::lock_guard lock(mutex);
          runs[k] = std::move(one);
        } catch (...) {
          const std::lock_guard lock(mutex);
          if (!failure) failure = std::current_exception();
        }
      }
    };
    std::vector<std::thread> threads;
    for (int t = 1; t < context.jobs(); ++t) threads.emplace_back(work);
    work();
    for (std::thread& thread : threads) thread.join();
    if (failure) std::rethrow_exception(failure);
  }

  runs[0]->write();
  std::vector<Json> results;
  std::vector<const BedMeasurement*> measurements;
  double cpu = 0, collisions = 0;
  for (const auto& one : runs) {
    results.push_back(one->results());
    measurements.push_back(&one->measurement());
    cpu += one->cpu_seconds();
    collisions += static_cast<double>(one->counters().collisions());
  }
  if (replicas_ > 1) {
    const sim::Profile lab = joined_density(measurements, false);
    std::size_t blocks = 0;
    const std::vector<double> covariance = joined_covariance(measurements, lab, blocks);
    measurements[0]->write_densities(context, lab, joined_density(measurements, true), covariance, blocks);
    replicas_table(results).write(context.output("replicas.csv"));
  }
  write_file(context.output("observables.json"), dump(replicas_ > 1 ? joined(results) : results[0]));
  write_file(context.output("bed.json"), dump(bed()->to_json()));
  context.timing("simulation_cpu_seconds", cpu);
  context.timing("collisions_per_second", collisions / cpu);
  context.progress(1, "measured");
}

}  // namespace

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
      last_sound.empty() ? std::string("there is no earlier sound state")
                         : "its last sound state is kept in " + checkpoint.string()));
}

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
