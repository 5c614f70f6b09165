#include "pipelines/stages/bed_results.hpp"

#include <fmt/format.h>

namespace shakebed::pipelines {
namespace {

Given observed(bool holds, const char* name) { return given_if(holds, fmt::format("\"observe\" names \"{}\"", name)); }

class BedStatement {
 public:
  BedStatement(ResultList& list, const BedOutput& bed)
      : list_(list),
        bed_(bed),
        heavy_(given_if(!bed.weightless, "the bed has gravity")),
        energy_(bed.weightless ? "T0" : "m g D"),
        velocity_(bed.weightless ? "sqrt(T0/m)" : "sqrt(g D)"),
        time_(bed.weightless ? "D sqrt(m/T0)" : "sqrt(D/g)"),
        rate_(bed.weightless ? "sqrt(T0/m)/D" : "sqrt(g/D)"),
        pressure_(bed.weightless ? "T0/D^2" : "m g/D"),
        length_(bed.reduced ? "D" : "m") {}

  void state() {
    temperatures();
    heights();
    fluid();
    observed_when_named();
    counts();
    profiles();
    tables();
    judgement();
    replicas();
  }

 private:
  void temperature(const std::string& name, const std::string& meaning) {
    list_.quantity("/" + name, energy_, meaning);
    list_.quantity("/" + name + "_over_mg", length_, meaning + ", as T/(m g)", heavy_);
  }

  void temperatures() {
    temperature("temperature_x", "horizontal kinetic temperature T_x, without the mean velocity of the phase");
    temperature("temperature_z", "vertical kinetic temperature T_z, without the mean velocity of the phase");
    temperature("temperature_z_local",
                "vertical kinetic temperature, without the mean velocity of each layer and phase");
    temperature("temperature_x_without_flow",
                "horizontal kinetic temperature, without the mean velocity of each layer of 1 D at each moment, as a "
                "film gives it");
    temperature(
        "temperature_z_without_flow",
        "vertical kinetic temperature, without the mean velocity of each layer of 1 D at each moment, as a film "
        "gives it");
    temperature("spin_temperature", "temperature of the rotation: I <spin^2>, with the moment of inertia I of a disk");
    list_.quantity("/drift_temperature_x", energy_,
                   "drift: T_x in the second half of the measurement minus T_x in the first half");
    list_.quantity("/collision_rate", rate_, "number of contacts of a disk with other disks per unit of time");
  }

  void heights() {
    list_.quantity("/center_of_mass", "D", "height of the centre of mass above the floor's mean position", heavy_);
    list_.quantity("/drift_center_of_mass", "D",
                   "drift: center_of_mass in the second half of the measurement minus that in the first half", heavy_);
    list_.quantity("/center_of_mass_rise", "D", "rise of the centre of mass above ideal hexagonal packing", heavy_);
    list_.quantity("/ideal_center_of_mass", "D", "height of the centre of mass in ideal hexagonal packing", heavy_);
    list_.quantity("/lid_height", "D", "mean height of a free lid above the floor's mean position",
                   given_if(bed_.free_lid, "the lid is free"));
    list_.quantity("/bottom_row_density", "1/D^2", "number density of the lowest row", heavy_);
    list_.number("/center_of_mass_by_phase/#", "D", "height of the centre of mass at each phase of the floor",
                 given_if(bed_.shaken, "the floor shakes"));
    list_.quantity("/gamma", "1", "peak acceleration of the floor over g: Gamma = a (2 pi f)^2/g");
    list_.quantity("/column_number", "1", "column number N D/W: disks per diameter of width");
    list_.quantity("/gravity_in_plane", "m/s^2",
                   "acceleration g = gravity cos(tilt) in the plane of the bed, which is the g of all other numbers",
                   given_if(bed_.tilted, "\"box\" names a \"tilt\", and the bed is not in reduced units"));
  }

  void fluid() {
    const Given closed = given_if(bed_.periodic_upwards, "the box is periodic upwards");
    list_.quantity("/compressibility_factor", "1", "compressibility factor P V/(N T), from the virial of the contacts",
                   closed);
    list_.quantity("/number_density", "1/D^2", "number density of the whole box", closed);
  }

  void observed_when_named() {
    const Given order = observed(bed_.observe.order, "order");
    list_.quantity("/psi6_local", "1", "mean of |psi_6| over the disks", order, true);
    list_.quantity("/psi6_global", "1", "|mean of psi_6| over the disks", order, true);
    list_.quantity("/neighbours_per_disk", "1", "mean number of neighbours of a disk", order, true);
    list_.quantity("/vacancies", "1", "number of empty sites of the crystal", order, true);
    list_.quantity("/bottom_density", "1/D^2", "number density of the rows at the bottom", order, true);
    for (const int percent : {70, 80, 90})
      list_.quantity(fmt::format("/crystal_share_{}", percent), "1",
                     fmt::format("share of the disks in layers whose mean |psi_6| is at least {} %", percent), order,
                     true);
    const Given velocities = observed(bed_.observe.velocities, "velocities");
    list_.quantity("/a2", "1", "fourth cumulant of the velocities; 0 for a Maxwellian", velocities, true);
    list_.quantity("/a2_local", "1", "fourth cumulant of the velocities, mean over layers", velocities, true);
    const Given species = observed(bed_.observe.species, "species");
    list_.quantity(
        "/temperature_first", energy_,
        "kinetic temperature (T_x + T_z)/2 of the first species, without its mean vertical velocity at each moment",
        species, true);
    list_.quantity(
        "/temperature_second", energy_,
        "kinetic temperature (T_x + T_z)/2 of the second species, without its mean vertical velocity at each moment",
        species, true);
    list_.quantity("/temperature_ratio", "1", "ratio of temperature_second to temperature_first", species, true);
    list_.quantity("/floor_pressure", "m g/D", "pressure on the floor", observed(bed_.observe.pressure, "pressure"),
                   true);
  }

  void counts() {
    const std::string ledger = "/energy_ledger/";
    list_.text(ledger + "unit", "unit of the energies");
    const std::pair<const char*, const char*> terms[] = {
        {"initial", "energy at the start"},
        {"kinetic", "kinetic energy at the end"},
        {"potential", "potential energy at the end"},
        {"compressed", "energy of springs in a pressed bed at the end"},
        {"dissipated", "energy lost in contacts and by friction with plates"},
        {"step_error", "energy lost by the time steps of a pressed bed"},
        {"floor_work", "work of the floor, and of plates and sides that move with it"},
        {"bath_work", "work of the bath"},
        {"imbalance", "energy that the balance does not explain; 0 apart from rounding"}};
    for (const auto& [name, meaning] : terms) list_.number(ledger + name, energy_, meaning);
    list_.number(ledger + "dissipated_on_plates", energy_,
                 "part of the dissipated energy that is lost by friction with the plates",
                 given_if(bed_.rubs, "\"box\" names \"plates\""));
    list_.number("/collisions", "1", "number of contacts of all kinds");
    list_.number("/disk_collisions", "1", "number of contacts between two disks");
    list_.number("/wall_collisions", "1", "number of contacts with the side walls and the lid");
    list_.number("/floor_collisions", "1", "number of contacts with the floor");
    list_.number("/elastic_contacts", "1",
                 "number of contacts that the contact duration t_c made elastic, settling included");
    const Given clocked = given_if(bed_.contact_duration, "contacts have a duration t_c");
    list_.quantity("/elastic_share", "1", "share of the contacts that t_c made elastic, during the measurement",
                   clocked);
    list_.quantity("/withheld_share", "1",
                   "energy that the elastic contacts would have dissipated without t_c, over the energy dissipated "
                   "during the measurement. Of each chain of elastic contacts only the first is counted",
                   clocked);
    list_.quantity("/contact_duration_effect", "1",
                   "estimated relative error of T because of t_c: T is too high by this part", clocked);
    list_.quantity("/hertz_contact_time", "s",
                   "duration of a real contact by Hertz' law, at the peak velocity of the floor or the thermal "
                   "velocity of the bath",
                   given_if(bed_.material, "\"disks\" name a \"material\""));
    list_.number("/events", "1", "number of events of all kinds");
    list_.number("/periods", "1", "number of periods of the floor over which the bed was measured");
    list_.quantity("/max_overlap", "D",
                   "largest overlap of two disks at the end, from rounding or from the springs of a pressed bed");
  }

  void judgement() {
    const Given judged = given_if(bed_.judged, "the floor shakes and there is gravity");
    list_.text("/judgement/verdict", "\"holds\", or the most serious doubt about the numbers", judged);
    list_.text("/judgement/why", "all doubts about the numbers, the most serious first", judged);
    list_.text("/judgement/advice", "advice: what to do about this", judged);
    const Given mixed = given_if(bed_.two_species, "the disks are of two kinds");
    list_.text("/objections/#/why", "reason why a fit of the profile gives no reliable temperature", mixed);
    list_.text("/objections/#/advice", "advice: what to do about this", mixed);
  }

  void profiles() {
    list_.table({"profile.csv", "density profile above the floor's mean position", profile_columns()});
    list_.table(
        {"profile_floor_frame.csv", "density profile above the moving floor", profile_columns("the moving floor")});
    list_.table({"profile_frames.csv", "density profile at the moments of the frames only", profile_columns(),
                 given_if(bed_.frames, "\"frames\" has a \"count\" above 0")});
    list_.table({"profile_phase_*.csv",
                 "density profile at one phase of the shaking, of all periods of the bed whose frames are kept",
                 profile_columns(), given_if(bed_.named_phases, "\"frames\" has phases in \"at\"")});
    list_.table({"covariance.csv", "covariance of the densities of profile.csv", covariance_columns()});
  }

  void tables() {
    list_.table({"layers.csv",
                 "layers of 1 D above the floor's mean position, lab frame, all phases together",
                 {layer_height_,
                  {"temperature_x", energy_, "horizontal temperature, m <v_x^2>"},
                  {"temperature_z", energy_,
                   "vertical temperature, m <(v_z - mean of v_z)^2>, with the mean of v_z at each phase"},
                  {"mean_velocity_z", velocity_, "mean vertical velocity"},
                  {"share", "1", "fraction of all disks in the layer"},
                  {"spin_temperature", energy_,
                   "temperature of the rotation, I <spin^2>, with the moment of inertia I of a disk"}}});
    order_tables();
    velocity_tables();
    list_.table({"displacement.csv",
                 "mean square displacements against the time between two samples",
                 {{"lag", time_, "time between the two samples"},
                  {"msd_x", "D^2", "mean square displacement in x"},
                  {"std_error_x", "D^2", "standard error of msd_x"},
                  {"msd_z", "D^2", "mean square displacement in z"},
                  {"std_error_z", "D^2", "standard error of msd_z"},
                  {"origins", "1", "number of pairs of samples"}},
                 observed(bed_.observe.displacement, "displacement")});
    pressure_table();
    species_table();
    list_.table({"schedule.csv",
                 "annealing: means over the second half of each hold",
                 {{"step", "1", "number of the step, from 0"},
                  {"bath_temperature", energy_, "temperature of the reservoir"},
                  {"temperature", energy_, "kinetic temperature of the disks"},
                  {"temperature_error", energy_, "standard error of temperature"},
                  {"center_of_mass", "D", "height of the centre of mass"},
                  {"center_of_mass_error", "D", "standard error of center_of_mass"}},
                 given_if(bed_.annealed, "the stage has a \"schedule\"")});
  }

  void order_tables() {
    const Given order = observed(bed_.observe.order, "order");
    list_.table({"order.csv",
                 "order in layers of 1 D; neighbours are disks closer than (1 + sqrt 3)/2 contact distances",
                 {layer_height_,
                  {"psi6", "1", "mean of |psi_6| of the layer's disks"},
                  {"neighbours", "1", "mean number of neighbours"},
                  {"share", "1", "fraction of all disks in the layer"}},
                 order});
    list_.table({"rows.csv",
                 "rows of disks from the floor up, without the surface",
                 {{"row", "1", "number of the row, from 1"},
                  {"height", "D", "mean height above the floor"},
                  {"disks", "1", "mean number of disks"}},
                 order});
  }

  // Moments of the velocities in cells of height, or of height and phase.
  std::vector<StatedColumn> moments(const std::string& without) const {
    return {{"number_density", "1/D^2", "number density: disks per area"},
            {"mean_velocity_x", velocity_, "mean horizontal velocity"},
            {"mean_velocity_z", velocity_, "mean vertical velocity"},
            {"temperature_x", energy_, "horizontal temperature without the mean velocity of " + without},
            {"temperature_z", energy_, "vertical temperature without the mean velocity of " + without}};
  }

  void velocity_tables() {
    const Given velocities = observed(bed_.observe.velocities, "velocities");
    std::vector<StatedColumn> layers = moments("the layer");
    layers.insert(layers.begin(), layer_height_);
    layers.push_back({"spin_temperature", energy_,
                      "temperature of the rotation, I <spin^2>, with the moment of inertia I of a disk"});
    layers.push_back({"a2", "1", "fourth cumulant of the velocities, 0 for a Maxwellian"});
    layers.push_back({"samples", "1", "disks seen in the layer"});
    list_.table({"velocities.csv", "layers of 1 D above the floor's mean position, lab frame, all phases together",
                 layers, velocities});
    list_.table({"velocity_histogram.csv",
                 "distribution of the velocities in units of sqrt(T/m); the first and the last class also count all "
                 "velocities beyond them",
                 {{"velocity", "sqrt(T/m)", "velocity at the middle of the class"},
                  {"density_x", "1/sqrt(T/m)", "probability density of v_x"},
                  {"density_z", "1/sqrt(T/m)", "probability density of v_z without the bed's mean"},
                  {"maxwellian", "1/sqrt(T/m)", "standard normal density"}},
                 velocities});
    const Given by_phase = observed(bed_.observe.phases, "phases");
    phase_table("phases.csv", "above the floor's mean position; velocities in the lab frame", by_phase);
    phase_table("phases_floor_frame.csv", "above the moving floor; velocities relative to the floor",
                both(by_phase, given_if(bed_.shaken, "the floor moves")));
  }

  void phase_table(const std::string& file, const std::string& frame, const Given& given) {
    std::vector<StatedColumn> columns = moments("the layer at the phase");
    columns.insert(columns.begin(),
                   {{"phase", "1", "phase in periods, 0 where the floor rises through its mean position"},
                    {"height", "D", "height of the middle of the layer " + frame}});
    columns.push_back({"samples", "1", "disks seen in the layer at the phase"});
    list_.table({file, "layers of 1 D by phase of the shaking, " + frame, columns, given});
  }

  void pressure_table() {
    std::vector<StatedColumn> columns{layer_height_};
    for (const StatedColumn& row : std::initializer_list<StatedColumn>{
             {"number_density", "1/D^2", "number density: disks per area"},
             {"temperature_x", energy_, "horizontal temperature, m <v_x^2>"},
             {"temperature_z", energy_, "vertical temperature, m <(v_z - mean of v_z)^2>"},
             {"mean_velocity_z", velocity_, "mean vertical velocity"},
             {"pressure_zz", pressure_, "vertical flux of vertical momentum, kinetic part and contacts"},
             {"pressure_xx", pressure_, "horizontal flux of horizontal momentum, kinetic part and contacts"},
             {"weight_above", pressure_, "weight of the disks above, per width"},
             {"collision_rate", rate_ + "/D^2", "number of contacts between disks per area and time"}}) {
      columns.push_back(row);
      columns.push_back({row.name + "_error", row.unit, "standard error of " + row.name});
    }
    list_.table({"pressure.csv", "exact averages over time along the trajectories, lab frame", columns,
                 observed(bed_.observe.pressure, "pressure")});
  }

  void species_table() {
    std::vector<StatedColumn> columns{layer_height_};
    for (const std::string name : {"first", "second"}) {
      columns.push_back({"number_density_" + name, "1/D^2", "disks of the " + name + " species per area"});
      columns.push_back(
          {"temperature_x_" + name, energy_,
           "horizontal temperature, m <(v_x - mean of v_x)^2>, with the mean of the species in the layer"});
      columns.push_back({"temperature_z_" + name, energy_,
                         "vertical temperature, m <(v_z - mean of v_z)^2>, with the mean of the species in the layer"});
      columns.push_back({"samples_" + name, "1", "disks of the " + name + " species seen in the layer"});
    }
    columns.push_back(
        {"ratio", "1",
         "ratio of the temperature of the second species to that of the first, with both directions together"});
    list_.table(
        {"species.csv",
         "temperatures of the two species in layers of 1 D above the floor's mean position, all phases together",
         columns, observed(bed_.observe.species, "species")});
  }

  void replicas() {
    const Given several = given_if(bed_.replicas > 1, "\"replicas\" is above 1");
    list_.number("/replicas", "1", "number of beds over which the results are averaged", several);
    std::vector<StatedColumn> columns{{"replica", "1", "number of the bed, from 0"}};
    for (const StatedResult& one : list_.all()) {
      if (one.kind == ResultKind::quantity && one.given.possible)
        columns.push_back({one.pointer.substr(1), one.unit, one.meaning});
    }
    list_.table({"replicas.csv", "results of each bed", columns, several});
  }

  ResultList& list_;
  const BedOutput& bed_;
  Given heavy_;
  std::string energy_, velocity_, time_, rate_, pressure_, length_;
  StatedColumn layer_height_{"height", "D", "height of the middle of the layer above the floor's mean position"};
};

}  // namespace

void state_bed_results(ResultList& list, const BedOutput& bed) { BedStatement(list, bed).state(); }

}  // namespace shakebed::pipelines
