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
        length_(bed.reduced ? "D" : "m") {}

  void state() {
    temperatures();
    heights();
    fluid();
    observed_when_named();
    counts();
    profiles();
    tables();
    replicas();
  }

 private:
  void temperature(const std::string& name, const std::string& meaning) {
    list_.quantity("/" + name, energy_, meaning);
    list_.quantity("/" + name + "_over_mg", length_, meaning + ", as T/(m g)", heavy_);
  }

  void temperatures() {
    temperature("temperature_x", "kinetic temperature across, without the mean velocity of the phase");
    temperature("temperature_z", "kinetic temperature upwards, without the mean velocity of the phase");
    temperature("temperature_z_local", "kinetic temperature upwards, without the mean velocity of layer and phase");
    temperature("spin_temperature", "temperature of the rotation");
    list_.quantity("/collision_rate", bed_.weightless ? "sqrt(T0/m)/D" : "sqrt(g/D)",
                   "contacts of a disk with others in a unit of time");
  }

  void heights() {
    list_.quantity("/center_of_mass", "D", "height of the centre of mass above the floor's mean position", heavy_);
    list_.quantity("/center_of_mass_rise", "D", "rise of the centre of mass above ideal hexagonal packing", heavy_);
    list_.quantity("/ideal_center_of_mass", "D", "height of the centre of mass in ideal hexagonal packing", heavy_);
    list_.quantity("/bottom_row_density", "1/D^2", "number density of the lowest row", heavy_);
    list_.number("/center_of_mass_by_phase/#", "D", "height of the centre of mass at each phase of the floor",
                 given_if(bed_.shaken, "the floor shakes"));
    list_.quantity("/gamma", "1", "peak acceleration of the floor over g: Gamma = a (2 pi f)^2/g");
    list_.quantity("/column_number", "1", "disks a diameter of width: N D/W");
  }

  void fluid() {
    const Given closed = given_if(bed_.periodic_upwards, "the box is periodic upwards");
    list_.quantity("/compressibility_factor", "1", "p V/(N T) by the virial of the contacts", closed);
    list_.quantity("/number_density", "1/D^2", "number density of the whole box", closed);
  }

  void observed_when_named() {
    const Given order = observed(bed_.observe.order, "order");
    list_.quantity("/psi6_local", "1", "mean of |psi_6| of the disks", order, true);
    list_.quantity("/psi6_global", "1", "|mean of psi_6| of the disks", order, true);
    list_.quantity("/neighbours_per_disk", "1", "neighbours of a disk", order, true);
    list_.quantity("/vacancies", "1", "empty sites of the crystal", order, true);
    list_.quantity("/bottom_density", "1/D^2", "number density of the rows at the bottom", order, true);
    for (const int percent : {70, 80, 90})
      list_.quantity(fmt::format("/crystal_share_{}", percent), "1",
                     fmt::format("share of the disks in layers whose mean |psi_6| is at least {} %", percent), order,
                     true);
    const Given velocities = observed(bed_.observe.velocities, "velocities");
    list_.quantity("/a2", "1", "fourth cumulant of the velocities; 0 for a Maxwellian", velocities, true);
    list_.quantity("/a2_local", "1", "fourth cumulant of the velocities, layer by layer", velocities, true);
    list_.quantity("/floor_pressure", "m g/D", "pressure on the floor", observed(bed_.observe.pressure, "pressure"),
                   true);
  }

  void counts() {
    const std::string ledger = "/energy_ledger/";
    list_.text(ledger + "unit", "unit of the energies");
    const std::pair<const char*, const char*> terms[] = {{"initial", "energy at the start"},
                                                         {"kinetic", "kinetic energy at the end"},
                                                         {"potential", "potential energy at the end"},
                                                         {"dissipated", "energy lost in contacts"},
                                                         {"floor_work", "work of the floor"},
                                                         {"bath_work", "work of the bath"},
                                                         {"imbalance", "what the ledger does not account for"}};
    for (const auto& [name, meaning] : terms) list_.number(ledger + name, energy_, meaning);
    list_.number("/collisions", "1", "contacts of all kinds");
    list_.number("/disk_collisions", "1", "contacts between two disks");
    list_.number("/wall_collisions", "1", "contacts with sides and lid");
    list_.number("/floor_collisions", "1", "contacts with the floor");
    list_.number("/elastic_contacts", "1", "contacts made elastic by the contact duration t_c");
    list_.number("/events", "1", "events of all kinds");
    list_.number("/periods", "1", "periods over which the bed was measured");
    list_.quantity("/max_overlap", "D", "largest overlap of two disks, by rounding");
  }

  void profiles() {
    list_.table({"profile.csv", "density profile above the floor's mean position", profile_columns()});
    list_.table({"profile_floor_frame.csv", "density profile above the moving floor", profile_columns()});
    list_.table({"profile_frames.csv", "density profile at the moments of the frames only", profile_columns(),
                 given_if(bed_.frames, "\"frames\" asks for some")});
    list_.table({"covariance.csv", "covariance of the densities of profile.csv", covariance_columns()});
  }

  void tables() {
    const StatedColumn height{"height", "D", "middle of the layer"};
    list_.table({"layers.csv",
                 "temperatures by layers of 1 D",
                 {height,
                  {"temperature_x", energy_, "kinetic temperature across"},
                  {"temperature_z", energy_, "kinetic temperature upwards"},
                  {"mean_velocity_z", "sqrt(g D)", "mean velocity upwards"},
                  {"share", "1", "share of the disks"},
                  {"spin_temperature", energy_, "temperature of the rotation"}}});
    order_tables(height);
    velocity_tables(height);
    list_.table({"displacement.csv",
                 "mean square displacements",
                 {{"lag", "sqrt(D/g)", "time between two looks"},
                  {"msd_x", "D^2", "mean square displacement across"},
                  {"std_error_x", "D^2", "its standard error"},
                  {"msd_z", "D^2", "mean square displacement upwards"},
                  {"std_error_z", "D^2", "its standard error"},
                  {"origins", "1", "pairs of looks"}},
                 observed(bed_.observe.displacement, "displacement")});
    pressure_table(height);
    list_.table({"schedule.csv",
                 "means over the second half of each hold of the annealing",
                 {{"step", "1", "number of the step"},
                  {"bath_temperature", "m g D", "temperature of the bath"},
                  {"temperature", "m g D", "kinetic temperature"},
                  {"temperature_error", "m g D", "its standard error"},
                  {"center_of_mass", "D", "height of the centre of mass"},
                  {"center_of_mass_error", "D", "its standard error"}},
                 given_if(bed_.annealed, "there is a \"schedule\"")});
  }

  void order_tables(const StatedColumn& height) {
    const Given order = observed(bed_.observe.order, "order");
    list_.table({"order.csv",
                 "bond order by layers of 1 D",
                 {height,
                  {"psi6", "1", "mean of |psi_6|"},
                  {"neighbours", "1", "neighbours of a disk"},
                  {"share", "1", "share of the disks"}},
                 order});
    list_.table({"rows.csv",
                 "rows of disks from the floor up",
                 {{"row", "1", "number of the row"}, {"height", "D", "its height"}, {"disks", "1", "its disks"}},
                 order});
  }

  void velocity_tables(const StatedColumn& height) {
    const Given velocities = observed(bed_.observe.velocities, "velocities");
    const std::vector<StatedColumn> common{{"number_density", "1/D^2", "number density"},
                                           {"mean_velocity_x", "sqrt(g D)", "mean velocity across"},
                                           {"mean_velocity_z", "sqrt(g D)", "mean velocity upwards"},
                                           {"temperature_x", energy_, "kinetic temperature across"},
                                           {"temperature_z", energy_, "kinetic temperature upwards"}};
    std::vector<StatedColumn> layers{height};
    layers.insert(layers.end(), common.begin(), common.end());
    std::vector<StatedColumn> phases = layers;
    phases.insert(phases.begin(), {"phase", "1", "phase of the floor, 0 to 1"});
    phases.push_back({"samples", "1", "disks seen"});
    layers.push_back({"spin_temperature", energy_, "temperature of the rotation"});
    layers.push_back({"a2", "1", "fourth cumulant of the velocities"});
    layers.push_back({"samples", "1", "disks seen"});
    list_.table({"velocities.csv", "velocities by layers of 1 D", layers, velocities});
    list_.table({"velocity_histogram.csv",
                 "histogram of the velocities",
                 {{"velocity", "sqrt(T/m)", "middle of the bin"},
                  {"density_x", "1/sqrt(T/m)", "probability density across"},
                  {"density_z", "1/sqrt(T/m)", "probability density upwards"},
                  {"maxwellian", "1/sqrt(T/m)", "that of a Maxwellian"}},
                 velocities});
    const Given by_phase = observed(bed_.observe.phases, "phases");
    list_.table({"phases.csv", "velocities by phase and layer", phases, by_phase});
    list_.table({"phases_floor_frame.csv", "velocities by phase and layer above the moving floor", phases,
                 both(by_phase, given_if(bed_.shaken, "the floor moves"))});
  }

  void pressure_table(const StatedColumn& height) {
    std::vector<StatedColumn> columns{height};
    const StatedColumn rows[] = {{"number_density", "1/D^2", "number density"},
                                 {"temperature_x", energy_, "kinetic temperature across"},
                                 {"temperature_z", energy_, "kinetic temperature upwards"},
                                 {"mean_velocity_z", "sqrt(g D)", "mean velocity upwards"},
                                 {"pressure_zz", "m g/D", "pressure upwards"},
                                 {"pressure_xx", "m g/D", "pressure across"},
                                 {"weight_above", "m g/D", "weight of what lies above"},
                                 {"collision_rate", "sqrt(g/D)/D^2", "contacts in an area and unit of time"}};
    for (const StatedColumn& row : rows) {
      columns.push_back(row);
      columns.push_back({row.name + "_error", row.unit, "its standard error"});
    }
    list_.table({"pressure.csv", "pressure by height, exact averages over time", columns,
                 observed(bed_.observe.pressure, "pressure")});
  }

  void replicas() {
    const Given several = given_if(bed_.replicas > 1, "\"replicas\" is above 1");
    list_.number("/replicas", "1", "beds over which the numbers are means", several);
    std::vector<StatedColumn> columns{{"replica", "1", "number of the bed"}};
    for (const StatedResult& one : list_.all()) {
      if (one.kind == ResultKind::quantity && one.given.possible)
        columns.push_back({one.pointer.substr(1), one.unit, one.meaning});
    }
    list_.table({"replicas.csv", "the numbers of each bed", columns, several});
  }

  ResultList& list_;
  const BedOutput& bed_;
  Given heavy_;
  std::string energy_, length_;
};

}  // namespace

std::vector<StatedColumn> profile_columns() {
  return {{"height", "D", "height"},
          {"number_density", "1/D^2", "number density n D^2"},
          {"std_error", "1/D^2", "its standard error"},
          {"area_fraction", "1", "covered share of the area"},
          {"samples", "1", "disks counted"}};
}

std::vector<StatedColumn> covariance_columns() {
  return {{"height_i", "D", "one height"}, {"height_j", "D", "another"}, {"covariance", "1/D^4", "of their densities"}};
}

void state_bed_results(ResultList& list, const BedOutput& bed) { BedStatement(list, bed).state(); }

}  // namespace shakebed::pipelines
