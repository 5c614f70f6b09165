#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "fit/profile_fit/fit_profile.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/stages/replica_seed.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "pipelines/stages/stage.hpp"
#include "sim/measure/measure.hpp"
#include "sim/measure/observables.hpp"

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

// What one simulated bed gives.
struct Bed {
  fit::FitStatus status = fit::FitStatus::not_converged;
  sim::Measured temperature;  // of the fit [m g D]
  double solid_height = 0;    // of the fit [D]
  sim::Measured density;      // greatest of the profile
  sim::Measured temperature_x, temperature_z, temperature_z_local;
  sim::Measured rise;  // of the centre of mass [D]
  std::uint64_t collisions = 0;
};

// A pair of restitution and friction, and the mean of its beds. The errors are those of that mean: from the spread
// between the beds, or the bed's own where there is only one.
struct Point {
  double restitution = 0, friction = 0, side_friction = 0;
  fit::FitStatus status =
      fit::FitStatus::not_converged;  // of the first bed whose fit did not succeed, else that of all
  bool all_ok = false;
  sim::Measured temperature, solid_height, density, temperature_x, temperature_z, temperature_z_local, rise;
  double distance = INFINITY, distance_error = 0;
  std::uint64_t collisions = 0;
};

// Of one-sided 2.5 %: Student's t for `freedom` degrees of freedom [Abramowitz and Stegun, 26.7.5].
double student_t(int freedom) {
  constexpr double z = 1.959963984540054;
  static constexpr double table[] = {12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228};
  if (freedom <= 10) return table[std::max(freedom, 1) - 1];
  return z + (z * z * z + z) / (4 * freedom) +
         (5 * std::pow(z, 5) + 16 * z * z * z + 3 * z) / (96.0 * freedom * freedom);
}

constexpr double profile_spacing = 0.25;  // of the heights [D]

// Of a bed up to its last look.
class CollisionCount final : public sim::RunObserver {
 public:
  std::uint64_t collisions() const { return collisions_; }
  void look(sim::Simulation& simulation, const sim::Snapshot&, std::uint64_t, std::uint32_t) override {
    collisions_ = simulation.counters().collisions();
  }
  void save(sim::ArchiveWriter& out) override { out(collisions_); }
  void load(sim::ArchiveReader& in) override { in(collisions_); }

 private:
  std::uint64_t collisions_ = 0;
};

class Infer : public Stage {
 public:
  void describe(Fields& fields) override;
  void results(ResultList& list) const override;
  Json facts() const override { return bed_.facts(); }
  void run(RunContext& context) const override;

 private:
  std::vector<Point> points() const;
  Bed simulate(const Point& point, std::uint64_t seed, const RunContext& context) const;
  void average(Point& point, const Bed* beds) const;  // replicas_ of them
  // Those that are no farther from the target than the nearest, as far as the errors allow to tell.
  std::vector<const Point*> as_near(const std::vector<Point>& points, const Point& nearest) const;
  Json results_of(const std::vector<Point>& points) const;
  // infer.csv, row by row into the empty table.
  Table points_table(Table table, const std::vector<Point>& points) const;

  SceneOptions bed_;
  double settle_ = 0, measure_ = 0;
  std::uint32_t phases_ = 16, replicas_ = 3;
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
  fields.integer(
      "replicas", replicas_,
      {.help = "beds at every point, each with a seed of its own; their mean counts, their spread is its error",
       .range = from_to(1, 1000)});
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
  bed_.warn(fields, settle_);
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

Bed Infer::simulate(const Point& point, std::uint64_t seed, const RunContext& context) const {
  Bed out;
  SceneOptions bed = bed_;
  bed.set_material(point.restitution, point.friction, point.side_friction);
  const sim::Scene scene = bed.scene(seed);
  sim::MeasurementSchedule times;
  times.period = bed.period();
  times.settle = std::ceil(settle_ / bed.time_unit() / times.period * (1 - 1e-12)) * times.period;
  times.periods = static_cast<std::uint64_t>(measure_ / bed.time_unit() / times.period * (1 + 1e-12));
  times.phases = phases_;
  const double column = scene.count() / scene.box.width;
  const double lowest = -std::ceil((6 * kernel_width_ + 3) / profile_spacing) * profile_spacing;
  const HeightGrid grid{lowest, profile_spacing, static_cast<std::size_t>((5 * column + 30) / profile_spacing)};
  sim::Observing<sim::BedObserver> observer([&](const sim::DiskProperties& disks) {
    return sim::BedObserver(scene, disks, phases_, grid, {KernelKind::gaussian, kernel_width_});
  });
  CollisionCount count;
  sim::RunControl control;
  control.stop = [&context] { return context.interrupted(); };
  if (!sim::measure(scene, times, {&observer, &count}, control).finished) throw Interrupted();
  const sim::Profile profile = observer->density(false);
  const auto greatest = static_cast<std::size_t>(
      std::max_element(profile.number_density.begin(), profile.number_density.end()) - profile.number_density.begin());
  out.density = {profile.number_density[greatest], profile.std_error[greatest]};
  out.temperature_x = observer->temperature_x();
  out.temperature_z = observer->temperature_z();
  out.temperature_z_local = observer->temperature_z_local();
  out.rise = observer->centre_of_mass();
  out.rise.value -= sim::ideal_centre_of_mass(scene.count(), scene.box.width,
                                              std::holds_alternative<sim::HardSides>(scene.box.sides));
  out.collisions = count.collisions();

  fit::Profile measured{profile.height, profile.number_density, profile.std_error, {}, 0};
  fit::FitOptions options;
  options.plateau_density = plateau_density_;
  options.column_number = column;
  options.kernel = {KernelKind::gaussian, kernel_width_};
  options.interval = options.sweep = options.compare = false;
  options.curve_points = 0;
  const fit::FitResult result = fit::fit_profile(measured, options);
  out.status = result.status;
  out.temperature = {result.temperature.value, result.temperature.std_error};
  out.solid_height = result.solid_height.value;
  return out;
}

void Infer::average(Point& point, const Bed* beds) const {
  const auto n = static_cast<double>(replicas_);
  const auto mean = [&](const auto& value_of) {
    double sum = 0, squares = 0;
    for (std::uint32_t r = 0; r < replicas_; ++r) sum += value_of(beds[r]);
    for (std::uint32_t r = 0; r < replicas_; ++r) squares += std::pow(value_of(beds[r]) - sum / n, 2);
    return sim::Measured{sum / n, replicas_ > 1 ? std::sqrt(squares / (n - 1) / n) : 0};
  };
  const auto mean_of = [&](sim::Measured Bed::*member) {
    sim::Measured out = mean([&](const Bed& bed) { return (bed.*member).value; });
    if (replicas_ == 1) out.std_error = (beds[0].*member).std_error;
    return out;
  };
  point.status = beds[0].status;
  point.all_ok = true;
  for (std::uint32_t r = 0; r < replicas_; ++r) {
    const bool ok = beds[r].status == fit::FitStatus::ok;
    if (!ok && point.all_ok) point.status = beds[r].status;
    point.all_ok = point.all_ok && ok;
    point.collisions += beds[r].collisions;
  }
  point.temperature = mean_of(&Bed::temperature);
  point.solid_height = mean([](const Bed& bed) { return bed.solid_height; });
  point.density = mean_of(&Bed::density);
  point.temperature_x = mean_of(&Bed::temperature_x);
  point.temperature_z = mean_of(&Bed::temperature_z);
  point.temperature_z_local = mean_of(&Bed::temperature_z_local);
  point.rise = mean_of(&Bed::rise);
  if (!point.all_ok) return;
  const double target = target_.temperature_over_mg / bed_.length_unit();
  const double off_t = point.temperature.value / target - 1, off_density = point.density.value / target_.density - 1;
  point.distance = std::hypot(off_t, off_density);
  if (point.distance == 0) return;
  // To first order the distance moves with the replica's offset along the direction to the target.
  const double along_t = off_t / point.distance, along_density = off_density / point.distance;
  point.distance_error = replicas_ > 1 ? mean([&](const Bed& bed) {
                                           return along_t * bed.temperature.value / target +
                                                  along_density * bed.density.value / target_.density;
                                         }).std_error
                                       : std::hypot(along_t * point.temperature.std_error / target,
                                                    along_density * point.density.std_error / target_.density);
}

std::vector<const Point*> Infer::as_near(const std::vector<Point>& points, const Point& nearest) const {
  const double t = student_t(replicas_ > 1 ? static_cast<int>(2 * (replicas_ - 1)) : 1000);
  std::vector<const Point*> found;
  for (const Point& p : points) {
    if (p.distance - nearest.distance <= t * std::hypot(p.distance_error, nearest.distance_error)) found.push_back(&p);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Point* l, const Point* r) { return l->distance < r->distance; });
  return found;
}

// A finished bed, kept in the scratch folder until the whole search has finished.
Json to_json(const Bed& bed) {
  const auto pair = [](const sim::Measured& m) { return Json::array({m.value, m.std_error}); };
  return Json{{"status", static_cast<int>(bed.status)},
              {"temperature", pair(bed.temperature)},
              {"solid_height", bed.solid_height},
              {"density", pair(bed.density)},
              {"temperature_x", pair(bed.temperature_x)},
              {"temperature_z", pair(bed.temperature_z)},
              {"temperature_z_local", pair(bed.temperature_z_local)},
              {"rise", pair(bed.rise)},
              {"collisions", bed.collisions}};
}
Bed bed_from(const Json& json) {
  const auto number = [](const Json& value) { return value.is_null() ? NAN : value.get<double>(); };
  const auto pair = [&](const char* name) { return sim::Measured{number(json.at(name)[0]), number(json.at(name)[1])}; };
  Bed bed;
  bed.status = static_cast<fit::FitStatus>(json.at("status").get<int>());
  bed.temperature = pair("temperature");
  bed.solid_height = number(json.at("solid_height"));
  bed.density = pair("density");
  bed.temperature_x = pair("temperature_x");
  bed.temperature_z = pair("temperature_z");
  bed.temperature_z_local = pair("temperature_z_local");
  bed.rise = pair("rise");
  bed.collisions = json.at("collisions").get<std::uint64_t>();
  return bed;
}

void Infer::run(RunContext& context) const {
  std::vector<Point> all = points();
  std::vector<Bed> beds(all.size() * replicas_);
  const std::filesystem::path& finished = context.scratch();
  std::atomic<std::size_t> done = 0;
  sim::each_replica(static_cast<std::uint32_t>(beds.size()), context.jobs(), [&](std::uint32_t i) {
    const std::filesystem::path kept = finished / fmt::format("bed-{}.json", i);
    if (std::filesystem::exists(kept)) {
      beds[i] = bed_from(read_json(kept));
    } else {
      beds[i] = simulate(all[i / replicas_], replica_seed(context.seed(), i % replicas_), context);
      write_file_atomically(kept, dump(to_json(beds[i])));
    }
    context.progress(static_cast<double>(++done) / static_cast<double>(beds.size()),
                     fmt::format("{} beds", beds.size()));
    return true;
  });
  for (std::size_t i = 0; i < all.size(); ++i) average(all[i], &beds[i * replicas_]);

  points_table(context.table("infer.csv"), all).write(context.output("infer.csv"));
  write_file(context.output("infer.json"), dump(results_of(all)));
}

Table Infer::points_table(Table table, const std::vector<Point>& points) const {
  table.note("beds_per_point", replicas_);
  for (const Point& p : points) {
    const bool near = std::isfinite(p.distance);
    table.add({p.restitution, p.friction, p.side_friction, std::string(fit::to_string(p.status)), p.temperature.value,
               p.temperature.std_error, p.solid_height.value, p.density.value, p.density.std_error,
               p.temperature_x.value, p.temperature_z.value, p.temperature_z_local.value, p.rise.value,
               near ? p.distance : no_number, count_cell(p.collisions), near ? p.distance_error : no_number});
  }
  return table;
}

void Infer::results(ResultList& list) const {
  const std::string length = bed_.length_unit() == 1 ? "D" : "m";
  list.quantity("/target/temperature_over_mg", length, "measured T/(m g)");
  list.quantity("/target/density", "1/D^2", "measured density");
  list.text("/distance_is", "what the distance means");
  list.text("/profile", "how the profiles are measured");
  list.text("/as_near_is", "which points are as near as the nearest");
  list.number("/replicas", "1", "beds at every point");
  const Given found = given_when("a fit succeeds");
  for (const std::string row : {"/nearest/", "/points/#/"}) {
    const Given given = row == "/nearest/" ? found : Given{};
    list.number(row + "restitution", "1", "restitution of disks, floor and sides", given);
    list.number(row + "friction", "1", "friction of disks and floor", given);
    list.number(row + "side_friction", "1", "friction of the sides", given);
    list.text(row + "fit_status", "whether the fits succeeded", given);
    list.quantity(row + "temperature_over_mg", length, "fitted T/(m g)", given, true);
    list.quantity(row + "solid_height", "D", "fitted height of the solid", given, true);
    list.quantity(row + "density", "1/D^2", "greatest density of the profile", given, true);
    list.quantity(row + "temperature_x_over_mg", length, "kinetic T/(m g) across", given, true);
    list.quantity(row + "temperature_z_over_mg", length, "kinetic T/(m g) upwards", given, true);
    list.quantity(row + "temperature_z_local_over_mg", length, "kinetic T/(m g) upwards, layer by layer", given, true);
    list.quantity(row + "center_of_mass_rise", "D", "rise of the centre of mass", given, true);
    list.number(row + "distance", "1", "distance from what was measured", given, true);
    list.number(row + "distance_error", "1", "its standard error", found, true);
    list.number(row + "collisions", "1", "contacts of all its beds", given);
  }
  for (const char* key : {"restitution", "friction", "side_friction", "distance", "distance_error"})
    list.number(std::string("/as_near/#/") + key, "1", "a point that is as near as the nearest", found, true);
  list.table({"infer.csv",
              "grid points: means over the beds of a point, with standard errors from the spread between them",
              {{"restitution", "1", "of the beads"},
               {"friction", "1", "of the beads"},
               {"side_friction", "1", "of the sides"},
               {"status", "", "of the fit"},
               {"temperature", "m g D", "fitted temperature"},
               {"temperature_error", "m g D", "standard error of temperature"},
               {"solid_height", "D", "height of the solid"},
               {"density", "1/D^2", "greatest density of the profile"},
               {"density_error", "1/D^2", "standard error of density"},
               {"temperature_x", "m g D", "kinetic temperature, horizontal"},
               {"temperature_z", "m g D", "kinetic temperature, vertical"},
               {"temperature_z_local", "m g D", "the same without the mean velocity of the layer"},
               {"rise", "D", "rise of the centre of mass"},
               {"distance", "1", "distance from the target"},
               {"collisions", "1", "collisions of all beds of the point"},
               {"distance_error", "1", "standard error of distance"}}});
}

Json Infer::results_of(const std::vector<Point>& points) const {
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
    out["solid_height"] = quantity_json(p.solid_height.value, "D", p.solid_height.std_error);
    out["density"] = quantity_json(p.density.value, "1/D^2", p.density.std_error);
    out["temperature_x_over_mg"] = over_mg(p.temperature_x);
    out["temperature_z_over_mg"] = over_mg(p.temperature_z);
    out["temperature_z_local_over_mg"] = over_mg(p.temperature_z_local);
    out["center_of_mass_rise"] = quantity_json(p.rise.value, "D", p.rise.std_error);
    out["distance"] = std::isfinite(p.distance) ? Json(p.distance) : Json(nullptr);
    if (std::isfinite(p.distance)) out["distance_error"] = p.distance_error;
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
  out["replicas"] = replicas_;
  out["nearest"] = std::isfinite(nearest->distance) ? row(*nearest) : Json(nullptr);
  out["as_near_is"] =
      "points whose distance is not above that of the nearest by more than Student's t (97.5 %) times the error of the "
      "difference, the nearest first: the data do not tell them apart";
  out["as_near"] = Json::array();
  if (std::isfinite(nearest->distance)) {
    for (const Point* p : as_near(points, *nearest)) {
      out["as_near"].push_back(Json{{"restitution", p->restitution},
                                    {"friction", p->friction},
                                    {"side_friction", p->side_friction},
                                    {"distance", p->distance},
                                    {"distance_error", p->distance_error}});
    }
  }
  out["points"] = Json::array();
  for (const Point& p : points) out["points"].push_back(row(p));
  return out;
}

}  // namespace

StageRow infer_stage() {
  return {.name = "infer",
          .summary = "searches the restitution and friction with which a simulated bed comes nearest to a measured one",
          .uses_seed = true,
          .result = "infer.json",
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Infer>(); }};
}

}  // namespace shakebed::pipelines
