// What a running bed is measured for: which observers look, when, and how their results become files and numbers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/formats/config.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/json.hpp"
#include "pipelines/formats/profile_csv.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "pipelines/stages/stage.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/measure/contact_duration.hpp"
#include "sim/measure/flights.hpp"
#include "sim/measure/flow_free.hpp"
#include "sim/measure/measured_bed.hpp"
#include "sim/measure/observables.hpp"
#include "sim/measure/order.hpp"
#include "sim/measure/species.hpp"
#include "sim/measure/velocities.hpp"

namespace shakebed::pipelines {

// Measured only when asked for: "observe": ["order", "pressure"].
struct ObserveOptions {
  bool order = false, velocities = false, displacement = false, pressure = false, phases = false, species = false;
  static const std::vector<std::string>& names();
  static ObserveOptions from(const std::vector<std::string>& wanted);
};

struct MeasurementPlan {
  std::uint32_t phases = 1;  // looks a period
  double period = 1;         // between looks at phase 0, reduced
  HeightGrid grid;
  Kernel kernel;
  ObserveOptions observe;
  std::vector<std::uint32_t> named_phases{};  // looks of a period with a profile of their own
};

class BedMeasurement {
 public:
  BedMeasurement(const sim::Scene& scene, const sim::DiskProperties& disks, const MeasurementPlan& plan);

  // Before the first look (at the simulation's time now), or after the state has been read from a checkpoint.
  void begin(sim::Simulation& simulation);
  void go_on(sim::Simulation& simulation);
  // The bed as it stands; phase 0 begins a period. `frame`: it is kept in the trajectory, too.
  void look(const sim::Simulation& simulation, const sim::Snapshot& at, std::uint32_t phase, bool frame);
  // After the last period's last look, at the time where the next period would begin.
  void end(const sim::Simulation& simulation);

  const sim::BedObserver& bed() const { return bed_; }
  // Numbers for observables.json, in the order of the file.
  void results(const SceneOptions& options, const sim::Scene& scene, Json& out) const;
  // profile.csv, covariance.csv, layers.csv ... below the stage's output.
  void write(RunContext& context, bool frames) const;
  // profile.csv and profile_floor_frame.csv of other densities on the same heights, in place of this bed's own, and
  // covariance.csv, of the filled rows of `lab`.
  void write_densities(RunContext& context, const sim::Profile& lab, const sim::Profile& floor,
                       const std::vector<double>& covariance, std::size_t independent_blocks) const;
  std::uint64_t above_profile() const { return above_; }
  const sim::Counters& counters_at_begin() const { return counters_; }  // of the measurement

  template <class Archive>
  void visit(Archive& archive) {
    archive(bed_, frames_, flow_free_, virial_rate_, collision_rate_, lid_height_, lid_heights_, virial_, collisions_,
            above_, counters_, dissipated_);
    for (sim::BedObserver& one : of_phases_) archive(one);
    if (order_) archive(*order_);
    if (lab_) archive(*lab_);
    if (floor_) archive(*floor_);
    if (displacement_) archive(*displacement_);
    if (flights_) archive(*flights_);
    if (species_) archive(*species_);
  }

 private:
  void end_period(const sim::Simulation& simulation);
  void observed_results(const std::string& energy_name, Json& out) const;
  void write_profile(RunContext& context, const char* file, const sim::Profile& density, const std::string& origin,
                     std::optional<double> phase = std::nullopt) const;
  double width_, disk_count_;
  bool free_lid_, floor_frame_;
  MeasurementPlan plan_;
  sim::BedObserver bed_, frames_;
  sim::FlowFreeTemperature flow_free_;
  std::vector<sim::BedObserver> of_phases_;  // one a named phase
  sim::CorrelatedMeans virial_rate_, collision_rate_, lid_height_;
  double lid_heights_ = 0;  // sum over the looks of this period
  double virial_ = 0;
  std::uint64_t collisions_ = 0;
  sim::Counters counters_;  // at the first look
  double dissipated_ = 0;   // until then
  sim::ContactDurationEffect contact_duration_;
  std::uint64_t above_ = 0;  // positions above the highest bin
  std::optional<sim::OrderObserver> order_;
  std::optional<sim::VelocityObserver> lab_, floor_;
  std::optional<sim::DisplacementObserver> displacement_;
  std::optional<sim::FlightObserver> flights_;
  std::optional<sim::SpeciesObserver> species_;
};

}  // namespace shakebed::pipelines
