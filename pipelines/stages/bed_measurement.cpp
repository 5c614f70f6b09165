#include "pipelines/stages/bed_measurement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace shakebed::pipelines {

const std::vector<std::string>& ObserveOptions::names() {
  static const std::vector<std::string> all{"order", "velocities", "displacement", "pressure", "phases", "species"};
  return all;
}

ObserveOptions ObserveOptions::from(const std::vector<std::string>& wanted) {
  const auto has = [&](const char* name) { return std::find(wanted.begin(), wanted.end(), name) != wanted.end(); };
  return {has("order"), has("velocities"), has("displacement"), has("pressure"), has("phases"), has("species")};
}

namespace {

ProfileTable table_of(const sim::Profile& profile, double width, double spacing) {
  ProfileTable table;
  const sim::FilledHeights rows = sim::filled_heights(profile);
  for (std::size_t i = rows.first; i < rows.last; ++i) {
    const double phi = profile.number_density[i];
    table.height.push_back(profile.height[i]);
    table.number_density.push_back(phi);
    table.std_error.push_back(profile.std_error[i]);
    table.area_fraction.push_back(profile.area_fraction[i]);
    table.samples.push_back(std::round(phi * width * spacing * static_cast<double>(profile.samples)));
  }
  return table;
}

// Of the lab profile; `covariance` is that of its filled rows.
void write_covariance(RunContext& context, const sim::Profile& profile, const std::vector<double>& covariance,
                      std::size_t independent_blocks) {
  const sim::FilledHeights rows = sim::filled_heights(profile);
  const std::vector<double> heights(profile.height.begin() + static_cast<std::ptrdiff_t>(rows.first),
                                    profile.height.begin() + static_cast<std::ptrdiff_t>(rows.last));
  write_covariance_csv(context.output("covariance.csv"), heights, covariance, independent_blocks);
}

Table layers_table(Table table, const sim::BedObserver& observer) {
  for (const sim::BedObserver::Layer& layer : observer.layers())
    table.add({layer.height, layer.temperature_x, layer.temperature_z, layer.mean_velocity_z, layer.share,
               layer.spin_temperature});
  return table;
}

Table order_table(Table table, const sim::OrderObserver& order) {
  for (const sim::OrderObserver::Layer& layer : order.layers())
    table.add({layer.height, layer.psi6_local, layer.neighbours, layer.share});
  return table;
}

Table rows_table(Table table, const sim::OrderObserver& order) {
  std::int64_t number = 0;
  for (const sim::OrderObserver::Row& row : order.rows()) table.add({++number, row.height, row.disks});
  return table;
}

Table velocities_table(Table table, const sim::VelocityObserver& velocities) {
  for (std::size_t k = 0; k < velocities.grid().count; ++k) {
    const sim::VelocityMoments layer = velocities.layer(k);
    if (layer.count == 0) continue;
    table.add({velocities.height(k), velocities.number_density(layer, false), layer.mean_vx(), layer.mean_vz(),
               layer.temperature_x(), layer.temperature_z(), layer.spin_temperature(),
               sim::fourth_cumulant(layer.square(), layer.fourth()), count_cell(layer.count)});
  }
  return table;
}

Table histogram_table(Table table, const sim::VelocityObserver& velocities) {
  table.note("temperature", velocities.histogram_unit() * velocities.histogram_unit());
  for (int bin = 0; bin < sim::VelocityObserver::histogram_bins; ++bin) {
    const double u = velocities.histogram_place(bin);
    table.add({std::round(u * 10) / 10, velocities.histogram_x(bin), velocities.histogram_z(bin),
               std::exp(-u * u / 2) / std::sqrt(2 * std::numbers::pi)});
  }
  return table;
}

Table phases_table(Table table, const sim::VelocityObserver& velocities) {
  for (std::uint32_t phase = 0; phase < velocities.phases(); ++phase) {
    for (std::size_t k = 0; k < velocities.grid().count; ++k) {
      const sim::VelocityMoments& cell = velocities.cell(phase, k);
      if (cell.count == 0) continue;
      table.add({static_cast<double>(phase) / velocities.phases(), velocities.height(k),
                 velocities.number_density(cell, true), cell.mean_vx(), cell.mean_vz(), cell.temperature_x(),
                 cell.temperature_z(), count_cell(cell.count)});
    }
  }
  return table;
}

Table displacement_table(Table table, const sim::DisplacementObserver& displacement, double look) {
  for (const auto& lag : displacement.lags())
    table.add({static_cast<double>(lag.looks) * look, lag.x.value, lag.x.std_error, lag.z.value, lag.z.std_error,
               count_cell(lag.origins)});
  return table;
}

Table pressure_table(Table table, const sim::FlightObserver& flights) {
  for (const auto& layer : flights.layers()) {
    std::vector<Cell> cells{layer.height};
    for (const sim::Measured& one :
         {layer.number_density, layer.temperature_x, layer.temperature_z, layer.mean_velocity_z, layer.pressure_zz,
          layer.pressure_xx, layer.weight_above, layer.collision_rate}) {
      cells.emplace_back(one.value);
      cells.emplace_back(one.std_error);
    }
    table.add(std::move(cells));
  }
  return table;
}

Table species_table(Table table, const sim::SpeciesObserver& species) {
  constexpr std::size_t first = sim::SpeciesObserver::first, second = sim::SpeciesObserver::second;
  for (std::size_t k = 0; k < species.grid().count; ++k) {
    if (species.cell(k, first).count + species.cell(k, second).count == 0) continue;
    std::vector<Cell> row{species.height(k)};
    for (const std::size_t s : {first, second}) {
      const bool any = species.cell(k, s).count > 0;
      row.emplace_back(species.number_density(k, s));
      row.emplace_back(any ? species.cell(k, s).temperature_x() : no_number);
      row.emplace_back(any ? species.cell(k, s).temperature_z() : no_number);
      row.push_back(count_cell(species.cell(k, s).count));
    }
    const double one = species.layer_temperature(k, first), two = species.layer_temperature(k, second);
    row.emplace_back(one > 0 && two > 0 ? two / one : no_number);
    table.add(std::move(row));
  }
  return table;
}

// Layers of 1 D, and those of the pressure: at most 4,000.
sim::LayerGrid coarse_layers(const HeightGrid& grid) {
  const double height = static_cast<double>(grid.points) * grid.spacing;
  return {std::floor(grid.lowest), 1, static_cast<std::size_t>(std::ceil(height)) + 1};
}
sim::LayerGrid fine_layers(const HeightGrid& grid) {
  const double height = static_cast<double>(grid.points) * grid.spacing;
  const double thickness = std::max(grid.spacing, height / 4000);
  return {grid.lowest, thickness, static_cast<std::size_t>(std::ceil(height / thickness)) + 1};
}

bool has_free_lid(const sim::Scene& scene) {
  const auto* lid = std::get_if<sim::Lid>(&scene.box.top);
  return lid != nullptr && lid->is_free();
}

}  // namespace

BedMeasurement::BedMeasurement(const sim::Scene& scene, const sim::DiskProperties& disks, const MeasurementPlan& plan)
    : width_(scene.box.width),
      disk_count_(static_cast<double>(disks.mass.size())),
      free_lid_(has_free_lid(scene)),
      floor_frame_(!std::holds_alternative<sim::StillFloor>(scene.box.floor)),
      plan_(plan),
      bed_(scene, disks, plan.phases, plan.grid, plan.kernel),
      frames_(scene, disks, 1, plan.grid, plan.kernel),
      flow_free_(disks, plan.phases),
      of_phases_(plan.named_phases.size(), frames_) {
  const sim::LayerGrid layers = coarse_layers(plan.grid);
  if (plan.observe.order) order_.emplace(scene, disks, plan.phases, layers);
  if (plan.observe.velocities || plan.observe.phases) lab_.emplace(scene, disks, plan.phases, layers, false);
  if (plan.observe.phases && floor_frame_) floor_.emplace(scene, disks, plan.phases, layers, true);
  if (plan.observe.displacement) displacement_.emplace(scene, disks.mass.size());
  if (plan.observe.pressure) flights_.emplace(scene, disks, fine_layers(plan.grid));
  if (plan.observe.species) species_.emplace(scene, disks, plan.phases, layers);
}

void BedMeasurement::begin(sim::Simulation& simulation) {
  counters_ = simulation.counters();
  dissipated_ = simulation.energy().dissipated;
  virial_ = counters_.virial;
  collisions_ = counters_.disk_collisions;
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
  if (free_lid_) lid_height_.add(lid_heights_ / plan_.phases);
  lid_heights_ = 0;
  virial_ = counters.virial;
  collisions_ = counters.disk_collisions;
  if (flights_) flights_->end_block(simulation.time());
}

void BedMeasurement::look(const sim::Simulation& simulation, const sim::Snapshot& at, std::uint32_t phase, bool frame) {
  if (phase == 0 && bed_.periods() > 0) end_period(simulation);
  if (free_lid_) lid_heights_ += at.lid_height;
  bed_.observe(at, phase);
  flow_free_.observe(at, phase);
  if (frame) frames_.observe(at, 0);
  for (std::size_t i = 0; i < of_phases_.size(); ++i)
    if (plan_.named_phases[i] == phase) of_phases_[i].observe(at, 0);
  for (const double z : at.z) above_ += z > plan_.grid.height(plan_.grid.points - 1);
  if (order_) order_->observe(at);
  if (lab_) lab_->observe(at, phase);
  if (floor_) floor_->observe(at, phase);
  if (displacement_) displacement_->observe(at);
  if (species_) species_->observe(at);
}

void BedMeasurement::end(const sim::Simulation& simulation) {
  end_period(simulation);
  contact_duration_ =
      sim::contact_duration_effect(counters_, simulation.counters(), simulation.energy().dissipated - dissipated_);
}

void BedMeasurement::results(const SceneOptions& options, const sim::Scene& scene, Json& out) const {
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
    const double ideal = sim::ideal_centre_of_mass(scene);
    plain("center_of_mass", centre, "D");
    plain("center_of_mass_rise", {centre.value - ideal, centre.std_error}, "D");
    out["ideal_center_of_mass"] = quantity_json(ideal, "D");
    plain("bottom_row_density", bed_.bottom_row_density(), "1/D^2");
  }
  if (free_lid_) plain("lid_height", {lid_height_.mean(), lid_height_.std_error()}, "D");
  temperature("temperature_x", bed_.temperature_x());
  temperature("temperature_z", bed_.temperature_z());
  temperature("temperature_z_local", bed_.temperature_z_local());
  temperature("temperature_x_without_flow", flow_free_.x());
  temperature("temperature_z_without_flow", flow_free_.z());
  temperature("spin_temperature", bed_.spin_temperature());
  if (!weightless) plain("drift_center_of_mass", bed_.drift_of_centre(), "D");
  plain("drift_temperature_x", bed_.drift_of_temperature_x(), energy_name.c_str());
  if (scene.disks.contact_duration > 0) {
    out["elastic_share"] = quantity_json(contact_duration_.elastic_share, "1");
    out["withheld_share"] = quantity_json(contact_duration_.withheld_share, "1");
    out["contact_duration_effect"] = quantity_json(contact_duration_.temperature, "1");
  }
  plain("collision_rate", {collision_rate_.mean(), collision_rate_.std_error()},
        weightless ? "sqrt(T0/m)/D" : "sqrt(g/D)");
  if (const auto* top = std::get_if<sim::PeriodicTop>(&scene.box.top)) {
    plain("compressibility_factor", bed_.compressibility_factor({virial_rate_.mean(), virial_rate_.std_error()}), "1");
    out["number_density"] = quantity_json(disk_count_ / (scene.box.width * top->height), "1/D^2");
  }
  observed_results(energy_name, out);
  if (options.period() > 0) out["center_of_mass_by_phase"] = bed_.centre_of_mass_by_phase();
}

// What "observe" names.
void BedMeasurement::observed_results(const std::string& energy_name, Json& out) const {
  const auto plain = [&](const char* name, const sim::Measured& m, const std::string& unit) {
    out[name] = quantity_json(m.value, unit, m.std_error);
  };
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
  if (species_) {
    plain("temperature_first", species_->temperature(sim::SpeciesObserver::first), energy_name);
    plain("temperature_second", species_->temperature(sim::SpeciesObserver::second), energy_name);
    const sim::Measured ratio = species_->temperature_ratio();
    out["temperature_ratio"] = std::isfinite(ratio.value) ? quantity_json(ratio.value, "1", ratio.std_error) : Json();
  }
}

void BedMeasurement::write_profile(RunContext& context, const char* file, const sim::Profile& density,
                                   const std::string& origin, std::optional<double> phase) const {
  ProfileTable table = table_of(density, width_, plan_.grid.spacing);
  table.origin = origin;
  table.kernel = plan_.kernel;
  table.column_number = disk_count_ / width_;
  table.phase = phase;
  write_profile_csv(context.output(file), table);
}

void BedMeasurement::write_densities(RunContext& context, const sim::Profile& lab, const sim::Profile& floor,
                                     const std::vector<double>& covariance, std::size_t independent_blocks) const {
  write_profile(context, "profile.csv", lab, "the floor's mean position");
  write_profile(context, "profile_floor_frame.csv", floor, "the moving floor");
  write_covariance(context, lab, covariance, independent_blocks);
}

void BedMeasurement::write(RunContext& context, bool frames) const {
  const sim::Profile lab = bed_.density(false);
  const sim::FilledHeights rows = sim::filled_heights(lab);
  write_densities(context, lab, bed_.density(true), bed_.density_covariance(rows.first, rows.last),
                  bed_.covariance_blocks());
  if (frames)
    write_profile(context, "profile_frames.csv", frames_.density(false),
                  "the floor's mean position, at the moments of the frames only");
  for (std::size_t i = 0; i < of_phases_.size(); ++i) {
    const double phase = static_cast<double>(plan_.named_phases[i]) / plan_.phases;
    write_profile(context, fmt::format("profile_phase_{:02d}.csv", i).c_str(), of_phases_[i].density(false),
                  "the floor's mean position", phase);
  }
  const auto write = [&](const char* file, const auto& fill, const auto&... from) {
    fill(context.table(file), from...).write(context.output(file));
  };
  write("layers.csv", layers_table, bed_);
  if (order_) {
    write("order.csv", order_table, *order_);
    write("rows.csv", rows_table, *order_);
  }
  if (plan_.observe.velocities) {
    write("velocities.csv", velocities_table, *lab_);
    write("velocity_histogram.csv", histogram_table, *lab_);
  }
  if (plan_.observe.phases) {
    write("phases.csv", phases_table, *lab_);
    if (floor_) write("phases_floor_frame.csv", phases_table, *floor_);
  }
  if (displacement_) write("displacement.csv", displacement_table, *displacement_, plan_.period / plan_.phases);
  if (flights_) write("pressure.csv", pressure_table, *flights_);
  if (species_) write("species.csv", species_table, *species_);
}

}  // namespace shakebed::pipelines
