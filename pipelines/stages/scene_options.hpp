// The part of a recipe that describes a bed: from JSON in SI (or reduced units) to sim::Scene.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/config.hpp"
#include "pipelines/stages/materials.hpp"
#include "sim/scene/scene.hpp"

namespace shakebed::pipelines {

// Lengths [m], times [s], masses [kg] as written; with "units": "reduced" lengths in D, masses in m, times in
// sqrt(D/g) (weightless: sqrt(m D^2/T)).
struct SurfaceOptions {
  double restitution = 1, friction = 0, tangential_restitution = 0;
  sim::RestitutionLaw law = sim::RestitutionLaw::constant;
  std::optional<double> law_speed;
};
enum class Inertia { disk, sphere };

struct SecondSpeciesOptions {
  std::uint32_t count = 1;
  double diameter = 1;
  std::optional<double> density;
};
struct DiskOptions {
  std::uint32_t count = 0;
  double diameter = 1;
  Material material = Material::unnamed;
  double density = 1;
  SurfaceOptions surface;
  Inertia inertia = Inertia::disk;
  std::optional<double> contact_duration;
  bool rests = true, presses = true;
  std::optional<SecondSpeciesOptions> second;
};

struct HardSidesOptions {
  SurfaceOptions surface;
  std::optional<double> slope;  // outwards, from the vertical [rad]
};
struct PeriodicSidesOptions {};
struct OpenLidOptions {};
struct FixedLidOptions {
  double height = 0;
  SurfaceOptions surface;
};
struct FreeLidOptions {
  double height = 0, mass = 0;
  double restitution = 1;
};
struct PeriodicLidOptions {
  double height = 0;
};
enum class PlateMotion { floor, still };
struct PlatesOptions {
  double friction = 0;
  std::optional<double> pressing, interval, contact_radius;
  PlateMotion motion = PlateMotion::floor;
};
struct BoxOptions {
  double width = 0;
  std::optional<double> tilt;  // of the bed's plane, from the vertical [rad]
  std::variant<HardSidesOptions, PeriodicSidesOptions> sides;
  std::variant<OpenLidOptions, FixedLidOptions, PeriodicLidOptions, FreeLidOptions> lid;
  std::optional<PlatesOptions> plates;
};

struct StillFloorOptions {};
struct SinusoidalFloorOptions {
  double amplitude = 0, frequency = 0;
  std::optional<double> gamma;  // given in place of the amplitude, which follows from it
};
struct TableFloorOptions {
  std::optional<double> period;
  std::vector<double> heights;
  InputFiles file;  // instead of heights
};
struct FloorOptions {
  std::variant<StillFloorOptions, SinusoidalFloorOptions, TableFloorOptions> motion;
  SurfaceOptions surface;
};

struct NoBathOptions {};
struct LangevinOptions {
  double temperature = 0, rate = 0, interval = 0;  // temperature as T/(m g), a length
};
struct AndersenOptions {
  double temperature = 0, rate = 0;
};
struct WhiteNoiseOptions {
  double heating = 0, interval = 0;
  bool conserve_momentum = true;
};
struct ThermalFloorOptions {
  double temperature = 0;
};

using BathOptions =
    std::variant<NoBathOptions, LangevinOptions, AndersenOptions, WhiteNoiseOptions, ThermalFloorOptions>;

struct HexagonalStartOptions {
  std::uint32_t disks_a_row = 0;
  double spacing = 0;
};
struct RandomStartOptions {
  double height = 0;
};
struct FileStartOptions {
  InputFiles file;
};
using StartOptions = std::variant<HexagonalStartOptions, RandomStartOptions, FileStartOptions>;

// The disks of the last frame of a trajectory (lengths in D). Throws InputError where it is none, holds another number
// of disks than the scene, or a disk that is of neither species.
sim::PlacedStart read_start(const std::filesystem::path& path, const sim::Disks& disks);

// One period of a floor from a CSV with the columns time,height (or height alone, then without a duration): equally
// spaced, the first moment not repeated at the end. Throws InputError naming the line.
struct FloorTable {
  std::vector<double> heights;
  std::optional<double> duration;  // number of rows times their distance in time
};
FloorTable read_floor_table(const std::filesystem::path& path);

// Says where a bead [m] is larger or smaller than those of experiments (decoding only).
void warn_of_bead(Fields& fields, std::string_view pointer_below, double diameter);
// The words for it, and what to do; nothing about an ordinary bead.
std::optional<Misfit> odd_bead(double diameter);
// Of a Gamma outside 1 to 50, at which no bed is thrown or none is studied: what and why.
std::optional<std::string> odd_gamma(double gamma);
// The same for a bead [m] that no photograph shows: a metre wide or more. With it the scale would be wrong by as much.
std::optional<Misfit> impossible_bead(double diameter);

class SceneOptions {
 public:
  // Names every option of the bed; when decoding, also checks that such a bed can be and reports what cannot.
  void describe(Fields& fields);

  // In reduced units. The start's velocities, and all else that is random, follow from the seed.
  sim::Scene scene(std::uint64_t seed) const;
  BedDescription description() const;

  // The same bed of another material: disks, floor and sides take the restitution, disks and floor the friction, the
  // sides theirs.
  void set_material(double restitution, double friction, double side_friction);

  double length_unit() const { return disks_.diameter; }  // D
  double time_unit() const;                               // sqrt(D/g)
  bool weightless() const { return !gravity_; }
  // Acceleration in the plane of the bed [m/s^2]: g cos(tilt), which all else calls g. In reduced units 1. Nothing
  // without gravity.
  std::optional<double> gravity() const;
  // Angle of the bed's plane from the vertical [rad]; nothing where none is named.
  std::optional<double> tilt() const { return box_.tilt; }
  bool has_free_lid() const { return std::holds_alternative<FreeLidOptions>(box_.lid); }
  // Whether the sides slope outwards.
  bool slopes() const;
  // Whether disks rub on plates.
  bool rubs() const { return box_.plates.has_value(); }
  bool two_species() const;  // that can be known apart, by diameter or mass
  bool periodic_upwards() const { return std::holds_alternative<PeriodicLidOptions>(box_.lid); }
  // The floor's period in reduced units; 0 when it stands still.
  double period() const;
  // t_c of the TC model in reduced units; 0: contacts have no duration.
  double contact_duration() const;
  // How long a real contact lasts [s], at the floor's greatest speed; in a bath at the thermal speed, else at that of a
  // fall from D. Nothing without a named material.
  std::optional<double> hertz_contact_time() const;
  // Nothing above the bed, and no places given: as many disks can as well be dropped at random.
  bool may_be_filled_at_random() const;
  // T/(m g D) of the reservoir; 0 without one.
  double bath_temperature() const;

  // Peak acceleration of a sinusoidal floor over g; 0 for other floors.
  double gamma() const;
  // Says what is odd about the bed, though it can be simulated (decoding only). `settle` as written.
  void warn(Fields& fields, double settle) const;
  // Why rows of disks lock in a box of this width, and what to do; nothing where they do not.
  std::optional<Misfit> locking() const;
  // Whether contacts lose energy.
  bool dissipates() const;
  double restitution() const { return disks_.surface.restitution; }
  double friction() const { return disks_.surface.friction; }
  double tangential_restitution() const { return disks_.surface.tangential_restitution; }
  // For Stage::facts.
  Json facts() const;

 private:
  void describe_gravity(Fields& fields);
  void check_scene(Fields& fields) const;
  sim::RubbingPlates rubbing_plates() const;
  void warn_of_shaking(Fields& fields) const;
  void warn_of_size(Fields& fields) const;
  void warn_of_locking(Fields& fields) const;
  void warn_of_slope(Fields& fields) const;
  double height_at_rest() const;  // [D]
  std::string length_text(double length) const;

  DiskOptions disks_;
  std::optional<double> gravity_;  // as written
  BoxOptions box_;
  FloorOptions floor_;
  BathOptions bath_;
  StartOptions start_;
  double start_temperature_ = -1;  // as T/(m g), a length; below 0: 0.01 D, weightless 1
  bool reduced_ = false;
};

}  // namespace shakebed::pipelines
