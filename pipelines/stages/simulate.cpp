#include "pipelines/stages/simulate.hpp"

#include <time.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>

#include "pipelines/files.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "pipelines/trajectory.hpp"
#include "sim/observables.hpp"
#include "sim/simulation.hpp"

namespace shakebed::pipelines {

namespace {

double thread_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct FrameOptions {
  std::uint32_t count = 0;
  std::uint32_t phases = 32;
};
struct KernelOptions {
  sim::KernelKind kind = sim::KernelKind::gaussian;
  double width = 0.5;  // [D]
};
struct ProfileOptions {
  double spacing = 0.25;  // [D]
  KernelOptions kernel;
};

class Simulate : public Stage {
 public:
  void describe(Fields& fields) override;
  void run(RunContext& context) const override;

 private:
  // When snapshots are taken, in reduced time. A shaken bed is looked at `phases` times a period, and every frame is
  // one of those moments; a bed on a still floor at equal intervals.
  struct Schedule {
    double settle = 0;
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
  Json results(const sim::Simulation& simulation, const sim::BedObserver& observer, const sim::BlockedMean& virial_rate,
               double cpu_seconds) const;

  SceneOptions bed_;
  double settle_ = 0, measure_ = 0;
  FrameOptions frames_;
  ProfileOptions profile_;
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
        f.object<KernelOptions>(
            "kernel", p.kernel,
            [](Fields& g, KernelOptions& k) {
              g.choice("kind", k.kind, {{sim::KernelKind::gaussian, "gaussian"}, {sim::KernelKind::top_hat, "top_hat"}},
                       {.help = "a Gaussian does not alias with the rows of a crystal; a top hat of 1 D does"});
              g.number(
                  "width", k.width,
                  {.help = "standard deviation (gaussian) or full width (top_hat) in D", .range = from_to(1e-3, 100)});
            },
            {.help = "the window through which density is measured"});
      },
      {.help = "the density profile"});
  fields.boolean("compress", compress_, {.help = "trajectory.extxyz.zst instead of .extxyz"});
  if (!fields.decoding() || fields.problem_count() > 0) return;
  const double period = bed_.period() * bed_.time_unit();
  fields.require(period == 0 || measure_ >= period, "measure",
                 "the bed must be measured over at least one period of the floor",
                 "Give " + quantity_text(period, dimension::time) + " or more");
  if (frames_.count > 0) {
    const Schedule plan = schedule();
    fields.require(plan.frame_stride > 0, "frames/count",
                   std::to_string(frames_.count) + " frames do not fit into the " +
                       std::to_string(plan.periods * plan.phases) + " moments at which the bed is looked at",
                   "Measure longer, or ask for fewer frames");
  }
}

Simulate::Schedule Simulate::schedule() const {
  Schedule plan;
  plan.settle = settle_ / bed_.time_unit();
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

// The rows from the lowest to the highest that holds anything.
struct Rows {
  std::size_t first, last;
};
Rows filled_rows(const sim::Profile& profile) {
  Rows rows{0, profile.height.size()};
  while (rows.first < rows.last && profile.number_density[rows.first] < 1e-12) ++rows.first;
  while (rows.last > rows.first && profile.number_density[rows.last - 1] < 1e-12) --rows.last;
  return rows;
}

ProfileTable table_of(const sim::Profile& profile, double width, double spacing,
                      const std::vector<std::string>& comments) {
  ProfileTable table;
  table.comments = comments;
  const Rows rows = filled_rows(profile);
  for (std::size_t i = rows.first; i < rows.last; ++i) {
    const double phi = profile.number_density[i];
    table.height.push_back(profile.height[i]);
    table.number_density.push_back(phi);
    table.std_error.push_back(profile.std_error[i]);
    table.area_fraction.push_back(std::numbers::pi / 4 * phi);
    table.samples.push_back(std::round(phi * width * spacing * static_cast<double>(profile.samples)));
  }
  return table;
}

// Of the lab profile: height_i,height_j,covariance for j >= i, only what is not 0.
std::string covariance_text(const sim::BedObserver& observer) {
  const sim::Profile profile = observer.density(false);
  const Rows rows = filled_rows(profile);
  const std::vector<double> covariance = observer.density_covariance(rows.first, rows.last);
  const std::size_t n = rows.last - rows.first;
  std::string text = fmt::format(
      "# covariance of number_density in profile.csv\n# independent_blocks: {}\nheight_i,height_j,covariance\n",
      observer.covariance_blocks());
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i; j < n; ++j) {
      if (covariance[i * n + j] != 0)
        text += fmt::format("{},{},{}\n", profile.height[rows.first + i], profile.height[rows.first + j],
                            covariance[i * n + j]);
    }
  }
  return text;
}

void Simulate::run(RunContext& context) const {
  const sim::Scene scene = bed_.scene(context.seed());
  std::unique_ptr<sim::Simulation> simulation;
  try {
    simulation = sim::simulate(scene);
  } catch (const std::exception& error) {
    throw StageError(error.what());
  }
  const Schedule plan = schedule();
  const std::uint64_t moments = plan.periods * plan.phases;
  const double end = plan.moment(moments);
  const double cpu_start = thread_cpu_seconds();

  const auto run_to = [&](double time, const char* what) {
    // In steps short enough to be interrupted.
    const double step = std::max(bed_.period(), 1.0);
    while (simulation->time() < time) {
      context.check_interrupted();
      simulation->advance_to(std::min(time, simulation->time() + step));
      context.progress(simulation->time() / end, what);
    }
  };
  run_to(plan.settle, "settling");

  double amplitude = 0;
  if (const auto* sine = std::get_if<sim::SinusoidalFloor>(&scene.box.floor)) amplitude = sine->amplitude;
  if (const auto* table = std::get_if<sim::TabulatedFloor>(&scene.box.floor))
    for (double h : table->heights) amplitude = std::max(amplitude, std::abs(h));
  sim::ProfileGrid grid;
  grid.spacing = profile_.spacing;
  grid.lowest = -std::ceil((amplitude + 6 * profile_.kernel.width + 1) / grid.spacing) * grid.spacing;
  const double loose_height = 6 * scene.count() / scene.box.width + 30 + 25 * bed_.bath_temperature();
  grid.points = static_cast<std::size_t>(std::min((loose_height - grid.lowest) / grid.spacing, 200'000.0));
  const sim::Kernel kernel{profile_.kernel.kind, profile_.kernel.width};
  sim::BedObserver observer(scene, simulation->properties(), plan.phases, grid, kernel);
  sim::BedObserver frame_observer(scene, simulation->properties(), 1, grid, kernel);
  sim::BlockedMean virial_rate;

  std::unique_ptr<TrajectoryWriter> trajectory;
  if (plan.frames > 0)
    trajectory =
        std::make_unique<TrajectoryWriter>(context.output(compress_ ? "trajectory.extxyz.zst" : "trajectory.extxyz"));
  const sim::DiskProperties properties = simulation->properties();
  sim::Snapshot at;
  double virial = simulation->counters().virial;
  std::uint64_t above = 0;
  for (std::uint64_t moment = 0; moment < moments; ++moment) {
    run_to(plan.moment(moment), "measuring");
    simulation->snapshot(at);
    const auto phase = static_cast<std::uint32_t>(moment % plan.phases);
    observer.observe(at, phase);
    for (double z : at.z) above += z > grid.height(grid.points - 1);
    if (phase == 0 && moment > 0) {
      const double now = simulation->counters().virial;
      virial_rate.add((now - virial) / plan.period);
      virial = now;
    }
    if (trajectory && moment % plan.frame_stride == 0 && moment / plan.frame_stride < plan.frames) {
      frame_observer.observe(at, 0);
      TrajectoryFrame frame;
      frame.time = at.time;
      frame.phase = bed_.period() > 0 ? static_cast<double>(phase) / plan.phases : 0;
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
      trajectory->write(frame);
    }
  }
  if (trajectory) trajectory->close();
  const double cpu = thread_cpu_seconds() - cpu_start;

  if (above > 0)
    context.warning(std::to_string(above) +
                    " disk positions lay above the highest bin of the profile and are missing from it");
  const std::string kernel_name = kernel.kind == sim::KernelKind::gaussian ? "gaussian" : "top-hat";
  const auto comments = [&](const char* frame) {
    return std::vector<std::string>{"heights in D above " + std::string(frame), "kernel: " + kernel_name,
                                    "kernel_width: " + dump_canonical(Json(kernel.width)),
                                    "column_number: " + dump_canonical(Json(scene.count() / scene.box.width))};
  };
  write_profile_csv(context.output("profile.csv"), table_of(observer.density(false), scene.box.width, grid.spacing,
                                                            comments("the floor's mean position")));
  write_file(context.output("covariance.csv"), covariance_text(observer));
  write_profile_csv(context.output("profile_floor_frame.csv"),
                    table_of(observer.density(true), scene.box.width, grid.spacing, comments("the moving floor")));
  if (plan.frames > 0)
    write_profile_csv(context.output("profile_frames.csv"),
                      table_of(frame_observer.density(false), scene.box.width, grid.spacing,
                               comments("the floor's mean position, at the moments of the frames only")));
  write_file(context.output("observables.json"), dump(results(*simulation, observer, virial_rate, cpu)));
  write_file(context.output("bed.json"), dump(bed_.description().to_json()));
  std::string layers =
      "# layers of 1 D by the height of their middle above the floor's mean [D]; temperatures in m g D, "
      "velocities in sqrt(g D)\nheight,temperature_x,temperature_z,mean_velocity_z,share\n";
  for (const sim::BedObserver::Layer& layer : observer.layers())
    layers += fmt::format("{},{},{},{},{}\n", layer.height, layer.temperature_x, layer.temperature_z,
                          layer.mean_velocity_z, layer.share);
  write_file(context.output("layers.csv"), layers);
  const sim::Counters counters = simulation->counters();
  context.timing("cpu_seconds", cpu);
  context.timing("collisions_per_second", static_cast<double>(counters.collisions()) / cpu);
  context.progress(1, "measured");
}

Json Simulate::results(const sim::Simulation& simulation, const sim::BedObserver& observer,
                       const sim::BlockedMean& virial_rate, double cpu_seconds) const {
  const sim::Scene scene = bed_.scene(1);
  const bool hard = std::holds_alternative<sim::HardSides>(scene.box.sides);
  const bool periodic_up = std::holds_alternative<sim::PeriodicTop>(scene.box.top);
  const BedDescription bed = bed_.description();
  const double length = bed_.length_unit();
  const std::string length_name = bed.reduced ? "D" : "m";
  const sim::Counters counters = simulation.counters();
  const sim::EnergyLedger energy = simulation.energy();
  const std::string energy_name = bed_.weightless() ? "T0" : "m g D";
  Json out;
  const auto temperature = [&](const char* name, const sim::Measured& t) {
    out[name] = quantity_json(t.value, energy_name, t.std_error);
    if (!bed_.weightless())
      out[std::string(name) + "_over_mg"] = quantity_json(t.value * length, length_name, t.std_error * length);
  };
  if (!bed_.weightless()) {
    const sim::Measured centre = observer.centre_of_mass();
    const double ideal = sim::ideal_centre_of_mass(scene.count(), scene.box.width, hard);
    out["center_of_mass"] = quantity_json(centre.value, "D", centre.std_error);
    out["center_of_mass_rise"] = quantity_json(centre.value - ideal, "D", centre.std_error);
    out["ideal_center_of_mass"] = quantity_json(ideal, "D");
  }
  temperature("temperature_x", observer.temperature_x());
  temperature("temperature_z", observer.temperature_z());
  temperature("temperature_z_local", observer.temperature_z_local());
  temperature("spin_temperature", observer.spin_temperature());
  if (periodic_up && virial_rate.samples() > 0) {
    // P V = N T + virial rate/2 with T from the kinetic energy of the N - 1 free momenta.
    const auto n = static_cast<double>(scene.count());
    const double t = observer.temperature_x().value + observer.temperature_z().value;
    const double kinetic = t * n / (2 * (n - 1));
    out["compressibility_factor"] =
        quantity_json(1 + virial_rate.mean() / (2 * n * kinetic), "1", virial_rate.std_error() / (2 * n * kinetic));
    const auto height = std::get<sim::PeriodicTop>(scene.box.top).height;
    out["number_density"] = quantity_json(n / (scene.box.width * height), "1/D^2");
  }
  out["gamma"] = quantity_json(bed.gamma(), "1");
  out["column_number"] = quantity_json(bed.column_number(), "1");
  if (bed_.period() > 0) {
    Json phases = Json::array();
    for (double height : observer.centre_of_mass_by_phase()) phases.push_back(height);
    out["center_of_mass_by_phase"] = phases;
  }
  out["energy_ledger"] = {
      {"unit", energy_name},           {"initial", energy.initial},       {"kinetic", energy.kinetic},
      {"potential", energy.potential}, {"dissipated", energy.dissipated}, {"floor_work", energy.floor_work},
      {"bath_work", energy.bath_work}, {"imbalance", energy.imbalance()}};
  out["collisions"] = counters.collisions();
  out["disk_collisions"] = counters.disk_collisions;
  out["wall_collisions"] = counters.wall_collisions;
  out["floor_collisions"] = counters.floor_collisions;
  out["elastic_contacts"] = counters.elastic_contacts;
  out["events"] = counters.events();
  out["periods"] = observer.periods();
  out["max_overlap"] = quantity_json(simulation.largest_overlap(), "D");
  out["collisions_per_second"] = static_cast<double>(counters.collisions()) / cpu_seconds;
  out["cpu_seconds"] = cpu_seconds;
  return out;
}

}  // namespace

StageRow simulate_stage() {
  return {.name = "simulate",
          .version = 3,
          .summary = "simulates a bed of hard disks, event by event",
          .uses_seed = true,
          .result = "observables.json",
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Simulate>(); }};
}

}  // namespace shakebed::pipelines
