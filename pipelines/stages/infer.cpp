#include "pipelines/stages/infer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <thread>

#include "fit/fit_profile.hpp"
#include "pipelines/files.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "sim/observables.hpp"
#include "sim/simulation.hpp"

namespace shakebed::pipelines {

namespace {

struct Target {
  double temperature_over_mg = 0;  // [m], reduced: [D]
  double density = 0;              // of the dense region [1/D^2]
};
struct Grid {
  std::vector<double> restitution, friction;
  std::vector<std::string> side_friction{"none", "as disks"};
};

struct Point {
  double restitution = 0, friction = 0, side_friction = 0;
  // What its bed gives.
  fit::FitStatus status = fit::FitStatus::not_converged;
  sim::Measured temperature;  // of the fit [m g D]
  double solid_height = 0;    // of the fit [D]
  sim::Measured density;      // greatest of the profile
  sim::Measured temperature_x, temperature_z, temperature_z_local;
  double rise = 0;
  double distance = INFINITY;
  std::uint64_t collisions = 0;
};

class Infer : public Stage {
 public:
  void describe(Fields& fields) override;
  void run(RunContext& context) const override;

 private:
  std::vector<Point> points() const;
  void simulate(Point& point, std::uint64_t seed, const RunContext& context) const;
  Json results(const std::vector<Point>& points) const;

  SceneOptions bed_;
  double settle_ = 0, measure_ = 0;
  std::uint32_t phases_ = 16;
  double kernel_width_ = 0.5;  // Gaussian [D]
  double plateau_density_ = 1.10;
  Target target_;
  Grid grid_;
};

void Infer::describe(Fields& fields) {
  bed_.describe(fields);
  fields.quantity("settle", settle_, dimension::time,
                  {.help = "time before anything is measured", .range = non_negative});
  fields.quantity("measure", measure_, dimension::time,
                  {.help = "time over which each bed is measured", .required = true, .range = positive});
  fields.integer("phases", phases_,
                 {.help = "moments of each period that the profile averages over", .range = from_to(1, 4096)});
  fields.number("kernel_width", kernel_width_,
                {.help = "standard deviation of the Gaussian window of the profile in D", .range = from_to(0.01, 10)});
  fields.number(
      "plateau_density", plateau_density_,
      {.help = "phi_0 of the fitted profile", .range = {.low = 0, .high = 1.1547005383792517, .above_low = true}});
  fields.object<Target>(
      "target", target_,
      [](Fields& f, Target& t) {
        f.quantity("temperature_over_mg", t.temperature_over_mg, dimension::length,
                   {.help = "fitted T/(m g)", .required = true, .range = positive});
        f.number("density", t.density,
                 {.help = "number density of the dense region in 1/D^2", .required = true, .range = positive});
      },
      {.help = "what was measured", .required = true});
  fields.object<Grid>(
      "grid", grid_,
      [](Fields& f, Grid& g) {
        f.numbers("restitution", g.restitution,
                  {.help = "values of e, of disks, floor and sides alike", .required = true, .range = zero_to_one});
        f.numbers("friction", g.friction,
                  {.help = "values of the friction of disks and floor", .required = true, .range = non_negative});
        f.texts("side_friction", g.side_friction, {.help = "\"none\", \"as disks\", or both"});
        for (const std::string& side : g.side_friction)
          f.require(side == "none" || side == "as disks", "side_friction",
                    "side friction is \"none\" or \"as disks\", not \"" + side + "\"");
      },
      {.help = "the search", .required = true});
  if (!fields.decoding() || fields.problem_count() > 0) return;
  fields.require(bed_.period() > 0 && measure_ >= bed_.period() * bed_.time_unit(), "measure",
                 "the bed must be shaken, and measured over at least one period of the floor");
}

std::vector<Point> Infer::points() const {
  std::vector<Point> points;
  for (const std::string& side : grid_.side_friction) {
    for (double e : grid_.restitution) {
      for (double friction : grid_.friction) {
        const double side_friction = side == "none" ? 0 : friction;
        // Without friction the two kinds of sides are the same bed.
        const bool again = std::any_of(points.begin(), points.end(), [&](const Point& p) {
          return p.restitution == e && p.friction == friction && p.side_friction == side_friction;
        });
        if (again) continue;
        Point point;
        point.restitution = e;
        point.friction = friction;
        point.side_friction = side_friction;
        points.push_back(point);
      }
    }
  }
  return points;
}

void Infer::simulate(Point& point, std::uint64_t seed, const RunContext& context) const {
  SceneOptions bed = bed_;
  bed.set_material(point.restitution, point.friction, point.side_friction);
  const sim::Scene scene = bed.scene(seed);
  const auto simulation = sim::simulate(scene);
  const double period = bed.period(), column = scene.count() / scene.box.width;
  const double first = std::ceil(settle_ / bed.time_unit() / period * (1 - 1e-12)) * period;
  const auto periods = static_cast<std::uint64_t>(measure_ / bed.time_unit() / period * (1 + 1e-12));
  const double spacing = 0.25;
  const sim::ProfileGrid grid{-std::ceil((6 * kernel_width_ + 3) / spacing) * spacing, spacing,
                              static_cast<std::size_t>((5 * column + 30) / spacing)};
  sim::BedObserver observer(scene, simulation->properties(), phases_, grid, {sim::KernelKind::gaussian, kernel_width_});
  sim::Snapshot at;
  const auto run_to = [&](double time) {  // a period at a time, to be interrupted
    while (simulation->time() < time) {
      context.check_interrupted();
      simulation->advance_to(std::min(time, simulation->time() + period));
    }
  };
  for (std::uint64_t p = 0; p < periods; ++p) {
    for (std::uint32_t phase = 0; phase < phases_; ++phase) {
      run_to(first + (static_cast<double>(p) + static_cast<double>(phase) / phases_) * period);
      simulation->snapshot(at);
      observer.observe(at, phase);
    }
  }
  const sim::Profile profile = observer.density(false);
  const auto greatest = static_cast<std::size_t>(
      std::max_element(profile.number_density.begin(), profile.number_density.end()) - profile.number_density.begin());
  point.density = {profile.number_density[greatest], profile.std_error[greatest]};
  point.temperature_x = observer.temperature_x();
  point.temperature_z = observer.temperature_z();
  point.temperature_z_local = observer.temperature_z_local();
  point.rise = observer.centre_of_mass().value -
               sim::ideal_centre_of_mass(scene.count(), scene.box.width,
                                         std::holds_alternative<sim::HardSides>(scene.box.sides));
  point.collisions = simulation->counters().collisions();

  fit::Profile measured{profile.height, profile.number_density, profile.std_error, {}, 0};
  fit::FitOptions options;
  options.plateau_density = plateau_density_;
  options.column_number = column;
  options.kernel = {fit::KernelKind::gaussian, kernel_width_};
  options.interval = options.sweep = options.compare = false;
  options.curve_points = 0;
  const fit::FitResult result = fit::fit_profile(measured, options);
  point.status = result.status;
  point.temperature = {result.temperature.value, result.temperature.std_error};
  point.solid_height = result.solid_height.value;
  if (!result.ok()) return;
  const double target = target_.temperature_over_mg / bed_.length_unit();
  point.distance = std::hypot(point.temperature.value / target - 1, point.density.value / target_.density - 1);
}

void Infer::run(RunContext& context) const {
  std::vector<Point> all = points();
  std::atomic<std::size_t> next = 0, done = 0;
  std::mutex failure_guard;
  std::exception_ptr failure;
  const auto work = [&] {
    for (std::size_t i = next++; i < all.size(); i = next++) {
      try {
        simulate(all[i], context.seed(), context);
      } catch (...) {
        const std::lock_guard lock(failure_guard);
        if (!failure) failure = std::current_exception();
        next = all.size();
      }
      context.progress(static_cast<double>(++done) / static_cast<double>(all.size()),
                       fmt::format("{} beds", all.size()));
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (int k = 1; k < context.jobs(); ++k) helpers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);

  std::string table =
      "# T in m g D; density: greatest of the profile [1/D^2]; heights in D\n"
      "restitution,friction,side_friction,status,temperature,temperature_error,solid_height,density,density_error,"
      "temperature_x,"
      "temperature_z,temperature_z_local,rise,distance,collisions\n";
  for (const Point& p : all) {
    table += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", p.restitution, p.friction, p.side_friction,
                         fit::to_string(p.status), p.temperature.value, p.temperature.std_error, p.solid_height,
                         p.density.value, p.density.std_error, p.temperature_x.value, p.temperature_z.value,
                         p.temperature_z_local.value, p.rise,
                         std::isfinite(p.distance) ? fmt::format("{}", p.distance) : "", p.collisions);
  }
  write_file(context.output("infer.csv"), table);
  write_file(context.output("infer.json"), dump(results(all)));
}

Json Infer::results(const std::vector<Point>& points) const {
  const double length = bed_.length_unit();
  const std::string length_name = length == 1 ? "D" : "m";
  const auto row = [&](const Point& p) {
    Json out;
    out["restitution"] = p.restitution;
    out["friction"] = p.friction;
    out["side_friction"] = p.side_friction;
    out["fit_status"] = std::string(fit::to_string(p.status));
    const auto over_mg = [&](const sim::Measured& t) {
      return quantity_json(t.value * length, length_name, t.std_error * length);
    };
    out["temperature_over_mg"] = over_mg(p.temperature);
    out["solid_height"] = quantity_json(p.solid_height, "D");
    out["density"] = quantity_json(p.density.value, "1/D^2", p.density.std_error);
    out["temperature_x_over_mg"] = over_mg(p.temperature_x);
    out["temperature_z_over_mg"] = over_mg(p.temperature_z);
    out["temperature_z_local_over_mg"] = over_mg(p.temperature_z_local);
    out["center_of_mass_rise"] = quantity_json(p.rise, "D");
    out["distance"] = std::isfinite(p.distance) ? Json(p.distance) : Json(nullptr);
    out["collisions"] = p.collisions;
    return out;
  };
  const auto nearest = std::min_element(points.begin(), points.end(),
                                        [](const Point& l, const Point& r) { return l.distance < r.distance; });
  Json out;
  out["target"] = {{"temperature_over_mg", quantity_json(target_.temperature_over_mg, length_name)},
                   {"density", quantity_json(target_.density, "1/D^2")}};
  out["distance_is"] =
      "sqrt((T/T_target - 1)^2 + (phi/phi_target - 1)^2), T of the fit with phi_0 fixed, phi the greatest density of "
      "the profile";
  out["profile"] = fmt::format("lab frame, average over {} phases, Gaussian window of {} D", phases_, kernel_width_);
  out["nearest"] = std::isfinite(nearest->distance) ? row(*nearest) : Json(nullptr);
  out["points"] = Json::array();
  for (const Point& p : points) out["points"].push_back(row(p));
  return out;
}

}  // namespace

StageRow infer_stage() {
  return {.name = "infer",
          .version = 3,
          .summary = "searches the restitution and friction with which a simulated bed comes nearest to a measured one",
          .uses_seed = true,
          .result = "infer.json",
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Infer>(); }};
}

}  // namespace shakebed::pipelines
