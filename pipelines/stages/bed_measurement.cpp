#include "pipelines/stages/bed_measurement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace shakebed::pipelines {

const std::vector<std::string>& ObserveOptions::names() {
  static const std::vector<std::string> all{"order", "velocities", "displacement", "pressure", "phases"};
  return all;
}

ObserveOptions ObserveOptions::from(const std::vector<std::string>& wanted) {
  const auto has = [&](const char* name) { return std::find(wanted.begin(), wanted.end(), name) != wanted.end(); };
  return {has("order"), has("velocities"), has("displacement"), has("pressure"), has("phases")};
}

Rows filled_rows(const sim::Profile& profile) {
  Rows rows{0, profile.height.size()};
  while (rows.first < rows.last && profile.number_density[rows.first] < 1e-12) ++rows.first;
  while (rows.last > rows.first && profile.number_density[rows.last - 1] < 1e-12) --rows.last;
  return rows;
}

namespace {

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

// Of the lab profile: height_i,height_j,covariance for j >= i, only what is not 0. `covariance` is that of its filled
// rows.
std::string covariance_text(const sim::Profile& profile, const std::vector<double>& covariance,
                            std::size_t independent_blocks) {
  const Rows rows = filled_rows(profile);
  const std::size_t n = rows.last - rows.first;
  std::string text = fmt::format(
      "# covariance of number_density in profile.csv\n# independent_blocks: {}\nheight_i,height_j,covariance\n",
      independent_blocks);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i; j < n; ++j) {
      if (covariance[i * n + j] != 0)
        text += fmt::format("{},{},{}\n", profile.height[rows.first + i], profile.height[rows.first + j],
                            covariance[i * n + j]);
    }
  }
  return text;
}

// A field of a CSV; empty where the value is not known.
std::string field(double value) { return std::isfinite(value) ? fmt::format("{}", value) : std::string(); }
std::string fields_of(const sim::Measured& m) { return field(m.value) + "," + field(m.std_error); }

std::string layers_text(const sim::BedObserver& observer) {
  std::string text =
      "# layers of 1 D by the height of their middle above the floor's mean [D]; temperatures in m g D, "
      "velocities in sqrt(g D)\nheight,temperature_x,temperature_z,mean_velocity_z,share,spin_temperature\n";
  for (const sim::BedObserver::Layer& layer : observer.layers())
    text += fmt::format("{},{},{},{},{},{}\n", layer.height, layer.temperature_x, layer.temperature_z,
                        layer.mean_velocity_z, layer.share, layer.spin_temperature);
  return text;
}

std::string order_text(const sim::OrderObserver& order) {
  std::string text =
      "# layers of 1 D; psi6: mean of |psi_6| of their disks; neighbours closer than (1 + sqrt 3)/2 contact distances\n"
      "height,psi6,neighbours,share\n";
  for (const sim::OrderObserver::Layer& layer : order.layers())
    text += fmt::format("{},{},{},{}\n", layer.height, layer.psi6_local, layer.neighbours, layer.share);
  return text;
}

std::string rows_text(const sim::OrderObserver& order) {
  std::string text =
      "# rows of disks from the floor up, without the surface; heights above the floor in D\nrow,height,disks\n";
  int number = 0;
  for (const sim::OrderObserver::Row& row : order.rows())
    text += fmt::format("{},{},{}\n", ++number, row.height, row.disks);
  return text;
}

std::string velocities_text(const sim::VelocityObserver& velocities) {
  std::string text =
      "# layers of 1 D above the floor's mean, all phases together; temperatures in m g D without the layer's mean "
      "velocity; a2: fourth cumulant, 0 for a Maxwellian\n"
      "height,number_density,mean_velocity_x,mean_velocity_z,temperature_x,temperature_z,spin_temperature,a2,samples\n";
  for (std::size_t k = 0; k < velocities.grid().count; ++k) {
    const sim::VelocityMoments layer = velocities.layer(k);
    if (layer.count == 0) continue;
    text += fmt::format("{},{},{},{},{},{},{},{},{}\n", velocities.height(k), velocities.number_density(layer, false),
                        layer.mean_vx(), layer.mean_vz(), layer.temperature_x(), layer.temperature_z(),
                        layer.spin_temperature(), sim::fourth_cumulant(layer.square(), layer.fourth()), layer.count);
  }
  return text;
}

std::string histogram_text(const sim::VelocityObserver& velocities) {
  std::string text = fmt::format(
      "# velocities in units of sqrt(T/m), T = {}; z without the bed's mean; the outermost bins hold what lies beyond\n"
      "velocity,density_x,density_z,maxwellian\n",
      velocities.histogram_unit() * velocities.histogram_unit());
  for (int bin = 0; bin < sim::VelocityObserver::histogram_bins; ++bin) {
    const double u = velocities.histogram_place(bin);
    text += fmt::format("{:.1f},{},{},{}\n", u, velocities.histogram_x(bin), velocities.histogram_z(bin),
                        std::exp(-u * u / 2) / std::sqrt(2 * std::numbers::pi));
  }
  return text;
}

std::string phases_text(const sim::VelocityObserver& velocities, bool floor_frame) {
  std::string text = fmt::format(
      "# layers of 1 D {}; temperatures without the mean velocity of the layer at the phase\n"
      "phase,height,number_density,mean_velocity_x,mean_velocity_z,temperature_x,temperature_z,samples\n",
      floor_frame ? "above the moving floor, velocities relative to it" : "above the floor's mean, lab frame");
  for (std::uint32_t phase = 0; phase < velocities.phases(); ++phase) {
    for (std::size_t k = 0; k < velocities.grid().count; ++k) {
      const sim::VelocityMoments& cell = velocities.cell(phase, k);
      if (cell.count == 0) continue;
      text += fmt::format("{},{},{},{},{},{},{},{}\n", static_cast<double>(phase) / velocities.phases(),
                          velocities.height(k), velocities.number_density(cell, true), cell.mean_vx(), cell.mean_vz(),
                          cell.temperature_x(), cell.temperature_z(), cell.count);
    }
  }
  return text;
}

std::string displacement_text(const sim::DisplacementObserver& displacement, double look) {
  std::string text =
      "# mean square displacements [D^2] against the time between two looks\n"
      "lag,msd_x,std_error_x,msd_z,std_error_z,origins\n";
  for (const auto& lag : displacement.lags())
    text += fmt::format("{},{},{},{}\n", static_cast<double>(lag.looks) * look, fields_of(lag.x), fields_of(lag.z),
                        lag.origins);
  return text;
}

std::string pressure_text(const sim::FlightObserver& flights) {
  std::string text =
      "# exact averages over time along the trajectories, lab frame; pressure in m g/D, T in m g D, rates in contacts "
      "a "
      "D^2 and time unit\n"
      "height,number_density,number_density_error,temperature_x,temperature_x_error,temperature_z,temperature_z_error,"
      "mean_velocity_z,mean_velocity_z_error,pressure_zz,pressure_zz_error,pressure_xx,pressure_xx_error,weight_above,"
      "weight_above_error,collision_rate,collision_rate_error\n";
  for (const auto& layer : flights.layers())
    text += fmt::format("{},{},{},{},{},{},{},{},{}\n", layer.height, fields_of(layer.number_density),
                        fields_of(layer.temperature_x), fields_of(layer.temperature_z),
                        fields_of(layer.mean_velocity_z), fields_of(layer.pressure_zz), fields_of(layer.pressure_xx),
                        fields_of(layer.weight_above), fields_of(layer.collision_rate));
  return text;
}

// Layers of 1 D, and those of the pressure: at most 4,000.
sim::LayerGrid coarse_layers(const sim::ProfileGrid& grid) {
  const double height = static_cast<double>(grid.points) * grid.spacing;
  return {std::floor(grid.lowest), 1, static_cast<std::size_t>(std::ceil(height)) + 1};
}
sim::LayerGrid fine_layers(const sim::ProfileGrid& grid) {
  const double height = static_cast<double>(grid.points) * grid.spacing;
  const double thickness = std::max(grid.spacing, height / 4000);
  return {grid.lowest, thickness, static_cast<std::size_t>(std::ceil(height / thickness)) + 1};
}

}  // namespace

BedMeasurement::BedMeasurement(const sim::Scene& scene, const sim::DiskProperties& disks, const MeasurementPlan& plan)
    : width_(scene.box.width),
      disk_count_(static_cast<double>(disks.mass.size())),
      floor_frame_(!std::holds_alternative<sim::StillFloor>(scene.box.floor)),
      plan_(plan),
      bed_(scene, disks, plan.phases, plan.grid, plan.kernel),
      frames_(scene, disks, 1, plan.grid, plan.kernel) {
  const sim::LayerGrid layers = coarse_layers(plan.grid);
  if (plan.observe.order) order_.emplace(scene, disks, layers);
  if (plan.observe.velocities || plan.observe.phases) lab_.emplace(scene, disks, plan.phases, layers, false);
  if (plan.observe.phases && floor_frame_) floor_.emplace(scene, disks, plan.phases, layers, true);
  if (plan.observe.displacement) displacement_.emplace(scene, disks.mass.size());
  if (plan.observe.pressure) flights_.emplace(scene, disks, fine_layers(plan.grid));
}

void BedMeasurement::begin(sim::Simulation& simulation) {
  virial_ = simulation.counters().virial;
  collisions_ = simulation.counters().disk_collisions;
  go_on(simulation);
  if (flights_) flights_->begin(simulation.time());
}

void BedMeasurement::go_on(sim::Simulation& simulation) {
  if (flights_) simulation.watch(&*flights_);
}

void BedMeasurement::end_period(const sim::Simulation& simulation) {
  const sim::Counters counters = simulation.counters();
  virial_rate_.add((counters.virial - virial_) / plan_.period);
  const double rate = static_cast<double>(counters.disk_collisions - collisions_) / plan_.period;
  collision_rate_.add(disk_count_ > 0 ? 2 * rate / disk_count_ : 0);
  virial_ = counters.virial;
  collisions_ = counters.disk_collisions;
  if (flights_) flights_->end_block(simulation.time());
}

void BedMeasurement::look(const sim::Simulation& simulation, const sim::Snapshot& at, std::uint32_t phase, bool frame) {
  if (phase == 0 && bed_.periods() > 0) end_period(simulation);
  bed_.observe(at, phase);
  if (frame) frames_.observe(at, 0);
  for (const double z : at.z) above_ += z > plan_.grid.height(plan_.grid.points - 1);
  if (order_) order_->observe(at);
  if (lab_) lab_->observe(at, phase);
  if (floor_) floor_->observe(at, phase);
  if (displacement_) displacement_->observe(at);
}

void BedMeasurement::end(const sim::Simulation& simulation) { end_period(simulation); }

void BedMeasurement::results(const SceneOptions& options, const sim::Scene& scene, Json& out) const {
  const bool hard = std::holds_alternative<sim::HardSides>(scene.box.sides);
  const bool weightless = options.weightless();
  const double length = options.length_unit();
  const BedDescription description = options.description();
  const std::string length_name = description.reduced ? "D" : "m", energy_name = weightless ? "T0" : "m g D";
  const auto temperature = [&](const char* name, const sim::Measured& t) {
    out[name] = quantity_json(t.value, energy_name, t.std_error);
    if (!weightless)
      out[std::string(name) + "_over_mg"] = quantity_json(t.value * length, length_name, t.std_error * length);
  };
  const auto plain = [&](const char* name, const sim::Measured& m, const char* unit) {
    out[name] = quantity_json(m.value, unit, m.std_error);
  };
  if (!weightless) {
    const sim::Measured centre = bed_.centre_of_mass();
    const double ideal = sim::ideal_centre_of_mass(scene.count(), scene.box.width, hard);
    plain("center_of_mass", centre, "D");
    plain("center_of_mass_rise", {centre.value - ideal, centre.std_error}, "D");
    out["ideal_center_of_mass"] = quantity_json(ideal, "D");
    plain("bottom_row_density", bed_.bottom_row_density(), "1/D^2");
  }
  temperature("temperature_x", bed_.temperature_x());
  temperature("temperature_z", bed_.temperature_z());
  temperature("temperature_z_local", bed_.temperature_z_local());
  temperature("spin_temperature", bed_.spin_temperature());
  plain("collision_rate", {collision_rate_.mean(), collision_rate_.std_error()},
        weightless ? "sqrt(T0/m)/D" : "sqrt(g/D)");
  if (const auto* top = std::get_if<sim::PeriodicTop>(&scene.box.top)) {
    // P V = N T + virial rate/2 with T from the kinetic energy of the N - 1 free momenta.
    const double n = disk_count_, t = bed_.temperature_x().value + bed_.temperature_z().value;
    const double kinetic = t * n / (2 * (n - 1));
    plain("compressibility_factor",
          {1 + virial_rate_.mean() / (2 * n * kinetic), virial_rate_.std_error() / (2 * n * kinetic)}, "1");
    out["number_density"] = quantity_json(n / (scene.box.width * top->height), "1/D^2");
  }
  if (order_) {
    plain("psi6_local", order_->psi6_local(), "1");
    plain("psi6_global", order_->psi6_global(), "1");
    plain("neighbours_per_disk", order_->neighbours_per_disk(), "1");
    plain("vacancies", order_->vacancies(), "1");
    const double bottom = order_->bottom_density();
    out["bottom_density"] = std::isfinite(bottom) ? quantity_json(bottom, "1/D^2") : Json();
    // Part of the disks that lie in layers whose mean |psi_6| is at least so large: a solid by order, not by density.
    for (const int percent : {70, 80, 90}) {
      double share = 0;
      for (const sim::OrderObserver::Layer& layer : order_->layers())
        share += layer.psi6_local >= percent / 100.0 ? layer.share : 0;
      out[fmt::format("crystal_share_{}", percent)] = quantity_json(share, "1");
    }
  }
  if (plan_.observe.velocities) {
    plain("a2", lab_->fourth_cumulant_of_all(), "1");
    out["a2_local"] = quantity_json(lab_->fourth_cumulant_local(), "1");
  }
  if (flights_) plain("floor_pressure", flights_->floor_pressure(), "m g/D");
  if (options.period() > 0) out["center_of_mass_by_phase"] = bed_.centre_of_mass_by_phase();
}

void BedMeasurement::write_profile(RunContext& context, const char* file, const sim::Profile& density,
                                   const std::string& frame) const {
  const std::string kernel = plan_.kernel.kind == sim::KernelKind::gaussian ? "gaussian" : "top-hat";
  const std::vector<std::string> comments{"heights in D above " + frame, "kernel: " + kernel,
                                          "kernel_width: " + number_text(plan_.kernel.width),
                                          "column_number: " + number_text(disk_count_ / width_)};
  write_profile_csv(context.output(file), table_of(density, width_, plan_.grid.spacing, comments));
}

void BedMeasurement::write_densities(RunContext& context, const sim::Profile& lab, const sim::Profile& floor,
                                     const std::vector<double>& covariance, std::size_t independent_blocks) const {
  write_profile(context, "profile.csv", lab, "the floor's mean position");
  write_profile(context, "profile_floor_frame.csv", floor, "the moving floor");
  write_file(context.output("covariance.csv"), covariance_text(lab, covariance, independent_blocks));
}

void BedMeasurement::write(RunContext& context, bool frames) const {
  write_profile(context, "profile.csv", bed_.density(false), "the floor's mean position");
  const sim::Profile lab = bed_.density(false);
  const Rows rows = filled_rows(lab);
  write_file(context.output("covariance.csv"),
             covariance_text(lab, bed_.density_covariance(rows.first, rows.last), bed_.covariance_blocks()));
  write_profile(context, "profile_floor_frame.csv", bed_.density(true), "the moving floor");
  if (frames)
    write_profile(context, "profile_frames.csv", frames_.density(false),
                  "the floor's mean position, at the moments of the frames only");
  write_file(context.output("layers.csv"), layers_text(bed_));
  if (order_) {
    write_file(context.output("order.csv"), order_text(*order_));
    write_file(context.output("rows.csv"), rows_text(*order_));
  }
  if (plan_.observe.velocities) {
    write_file(context.output("velocities.csv"), velocities_text(*lab_));
    write_file(context.output("velocity_histogram.csv"), histogram_text(*lab_));
  }
  if (plan_.observe.phases) {
    write_file(context.output("phases.csv"), phases_text(*lab_, false));
    if (floor_) write_file(context.output("phases_floor_frame.csv"), phases_text(*floor_, true));
  }
  if (displacement_)
    write_file(context.output("displacement.csv"), displacement_text(*displacement_, plan_.period / plan_.phases));
  if (flights_) write_file(context.output("pressure.csv"), pressure_text(*flights_));
}

}  // namespace shakebed::pipelines
