#include "pipelines/stages/scene_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/reduced_scales.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "sim/engine/start.hpp"

namespace shakebed::pipelines {

namespace {

// Largest scene whose start is laid out and checked for overlap while a recipe is only being read.
constexpr std::uint32_t checked_when_read = 50'000;
// A bed nearer to the horizontal lies flat [rad]: 90 deg but for rounding.
constexpr double largest_tilt = std::numbers::pi / 2 - 1e-9;
constexpr Dimension cube_over_time{.length = 2, .time = -3};

void describe_surface(Fields& fields, SurfaceOptions& surface) {
  fields.number("restitution", surface.restitution,
                {.help = "normal coefficient of restitution e", .range = zero_to_one, .example = "0.92"});
  fields.choice("restitution_law", surface.law,
                {{sim::RestitutionLaw::constant, "constant"},
                 {sim::RestitutionLaw::power, "power"},
                 {sim::RestitutionLaw::viscoelastic, "viscoelastic"}},
                {.help = "dependence of the restitution on the normal velocity v. Constant: e at every v. Power: 1 - "
                         "(1 - e) (v/v0)^(3/4) below v0, e above (Bizon 1998). Viscoelastic: that of viscoelastic "
                         "spheres, with e at v0 (Mueller and Poeschel 2011)"});
  fields.quantity("restitution_speed", surface.law_speed, dimension::velocity,
                  {.help = "velocity v0 of the restitution law, at which the restitution is e",
                   .range = positive,
                   .example = "\"0.3 m/s\""});
  if (fields.decoding())
    fields.require((surface.law == sim::RestitutionLaw::constant) == !surface.law_speed, "restitution_speed",
                   "a restitution that depends on velocity needs \"restitution_speed\" (the velocity v0 at which it is "
                   "e), and a constant restitution excludes it",
                   "Give both \"restitution_law\" and \"restitution_speed\", or neither");
  fields.number("friction", surface.friction,
                {.help = "Coulomb friction coefficient", .range = non_negative, .example = "0.2"});
  fields.number("tangential_restitution", surface.tangential_restitution,
                {.help = "tangential restitution b0 of a contact that sticks", .range = from_to(-1, 1)});
}

// The floor's positions from its file, if there is one; what is missing or too much is reported.
void read_table(Fields& fields, TableFloorOptions& table) {
  if (!fields.decoding()) return;
  if (table.file.empty() == table.heights.empty()) {
    fields.problem("/heights",
                   table.file.empty() ? "the floor has neither \"heights\" nor a \"file\""
                                      : "the floor has both \"heights\" and a \"file\"",
                   "Give one of them");
    return;
  }
  if (!table.file.empty()) {
    if (table.file.paths.empty()) return;  // it is missing, which has been reported
    if (table.file.paths.size() > 1) {
      fields.problem("/file",
                     "this names " + std::to_string(table.file.paths.size()) + " files, but the floor needs one table");
      return;
    }
    const FloorTable read = read_floor_table(table.file.paths[0]);
    table.heights = read.heights;
    if (!table.period) table.period = read.duration;
  }
  fields.require(table.period.has_value(), "period", "the period of the floor is not known",
                 "Give \"period\", or a column \"time\" in the file");
  if (!table.period) table.period = 1;
}

// Amplitude and frequency, or Gamma and frequency: Gamma = a (2 pi f)^2/g.
void describe_shaking(Fields& fields, SinusoidalFloorOptions& s, std::optional<double> gravity) {
  std::optional<double> amplitude;
  if (fields.mode() == Fields::Mode::encode && !s.gamma) amplitude = s.amplitude;
  fields.quantity(
      "amplitude", amplitude, dimension::length,
      {.help = "amplitude a of the floor; give either this or gamma", .range = positive, .example = "\"2.5 mm\""});
  fields.number("gamma", s.gamma,
                {.help = "peak acceleration of the floor over g, Gamma = a (2 pi f)^2/g, in place of the amplitude",
                 .range = positive,
                 .example = "4"});
  fields.quantity("frequency", s.frequency, dimension::frequency,
                  {.help = "frequency f of the floor", .required = true, .range = positive, .example = "\"20 Hz\""});
  fields.either("amplitude", "gamma", "Give \"amplitude\": \"2.5 mm\", or \"gamma\": 4");
  const double omega = 2 * std::numbers::pi * s.frequency;
  if (fields.decoding()) {
    fields.require(!s.gamma || gravity, "gamma", "a weightless scene has no Gamma", "Give \"amplitude\"");
    s.amplitude =
        amplitude.value_or(s.gamma && gravity && omega > 0 ? amplitude_of(*s.gamma, *gravity, s.frequency) : 0);
  }
  if (!gravity) return;
  if (s.gamma)
    fields.comment(fmt::format("amplitude {}", fields.reduced() ? fmt::format("{:.6g}", s.amplitude)
                                                                : handy_text(s.amplitude, dimension::length)));
  else
    fields.comment(fmt::format("gamma {:.6g}", s.amplitude * omega * omega / *gravity));
}

void describe_disks(Fields& f, DiskOptions& d) {
  f.integer("count", d.count, {.help = "number of disks N", .required = true, .range = at_least(1), .example = "337"});
  f.quantity("diameter", d.diameter, dimension::length,
             {.help = "diameter D", .required = !f.reduced(), .range = positive, .example = "\"2.99 mm\""});
  if (!f.reduced()) {
    f.choice("material", d.material,
             {{Material::unnamed, "unnamed"},
              {Material::aluminium, "aluminium"},
              {Material::steel, "steel"},
              {Material::glass, "glass"},
              {Material::brass, "brass"},
              {Material::polystyrene, "polystyrene"},
              {Material::acetate, "acetate"}},
             {.help = "material of the disks. It sets the density, if none is given, and the duration of a real "
                      "contact (hertz_contact_time). It does not set restitution and friction"});
    if (f.decoding() && d.material != Material::unnamed) d.density = constants_of(d.material).density;
  }
  f.quantity("density", d.density, dimension::density, {.help = "mass density of the material", .range = positive});
  describe_surface(f, d.surface);
  f.choice("inertia", d.inertia, {{Inertia::disk, "disk"}, {Inertia::sphere, "sphere"}},
           {.help = "moment of inertia: m R^2/2 (disk) or 2 m R^2/5 (sphere)"});
  f.quantity("contact_duration", d.contact_duration, dimension::time,
             {.help = "contact duration t_c of the TC model: a contact is elastic if either partner had another "
                      "contact less than t_c before; 0 for none. Default: 1e-4 sqrt(D/g) where anything dissipates",
              .range = non_negative,
              .example = "\"1 us\""});
  f.boolean(
      "rests", d.rests,
      {.help =
           "whether a dissipative bed under gravity may rest: it then moves with the floor until the floor falls away. "
           "Without rest the contacts become smaller and smaller, and they cost up to a thousand times as much"});
  f.boolean(
      "presses", d.presses,
      {.help =
           "whether the disks of a bed are soft while it is pressed on the floor: linear springs and dashpots, "
           "contacts of 0.007 sqrt(D/g) at most. Hard disks cost up to a thousand times as much there. It applies "
           "to equal disks with constant restitutions of at least 0.3, without a bath. Disks with friction are "
           "soft only where they make more than 0.6 sqrt(D/g) / contact_duration contacts each in a period, or 0.02 "
           "while T_x is below 0.02 m g D"});
  f.object<SecondSpeciesOptions>(
      "second", d.second,
      [](Fields& g, SecondSpeciesOptions& s) {
        g.integer("count", s.count,
                  {.help = "number of disks of the second species", .required = true, .range = at_least(1)});
        g.quantity("diameter", s.diameter, dimension::length,
                   {.help = "diameter of the second species", .required = true, .range = positive});
        g.quantity("density", s.density, dimension::density,
                   {.help = "mass density of the second species; left out, that of the first", .range = positive});
      },
      {.help = "second species of disks"});
  f.require(!f.reduced() || d.diameter == 1, "diameter", "in reduced units the first species has diameter 1",
            "Leave it out, or leave out \"units\": \"reduced\"");
}

void describe_plates(Fields& g, PlatesOptions& p) {
  g.number("friction", p.friction,
           {.help = "Coulomb friction coefficient mu_p of a disk that slides on the plate; for a sphere that rolls, "
                    "the coefficient of rolling friction. Static friction has the same coefficient",
            .required = true,
            .range = positive,
            .example = "0.1"});
  g.quantity(
      "pressing", p.pressing, dimension::acceleration,
      {.help =
           "acceleration that presses a disk on the plates: they decelerate it by friction times this acceleration. "
           "Left out, the component of gravity across a tilted plane, gravity sin(tilt); in reduced units tan(tilt)",
       .range = positive,
       .example = "\"4.9 m/s^2\""});
  g.choice("motion", p.motion, {{PlateMotion::floor, "floor"}, {PlateMotion::still, "still"}},
           {.help = "motion of the plates. Floor: with the floor, as in a cell that is shaken as a whole. Still: "
                    "none, as where only the floor is a piston"});
  g.quantity("interval", p.interval, dimension::time,
             {.help = "interval h at which the friction acts. The velocity of a contact is wrong by up to friction "
                      "times pressing times h/2. Default: 0.01 sqrt(D/g), or a 50th of the floor's period if that "
                      "is shorter",
              .range = positive,
              .example = "\"50 us\""});
  g.quantity("contact_radius", p.contact_radius, dimension::length,
             {.help = "radius c of the contact of a disk with the plate, at most that of a disk: friction there also "
                      "brakes the spin. The contact is pressed evenly. Spin alone decreases by 2/3 friction pressing "
                      "c/(q R^2) per time, with q = I/(m R^2). A disk that slides and spins has less of both frictions "
                      "(Farkas 2003). A coin: its radius; a sphere: 0.88 times the radius of its Hertz contact. Left "
                      "out, plates do not brake the spin",
              .range = positive,
              .example = "\"30 um\""});
}

void describe_tilt_and_plates(Fields& f, BoxOptions& b) {
  f.quantity("tilt", b.tilt, dimension::angle,
             {.help = "angle between the plane of the bed and the vertical: 0 for an upright cell. In the plane acts g "
                      "= gravity cos(tilt), and all numbers (Gamma, m g D, T/(m g), sqrt(D/g)) use this g. In reduced "
                      "units g in the plane is 1 at any tilt",
              .range = {.low = 0, .high = std::numbers::pi / 2},
              .example = "\"30 deg\""});
  f.require(!b.tilt || *b.tilt < largest_tilt, "tilt",
            "a bed that lies flat has no gravity in its plane, so no unit of time and no Gamma",
            "Give a tilt below 90 deg, or write the bed in reduced units with \"gravity\": 0");
  f.object<PlatesOptions>(
      "plates", b.plates, describe_plates,
      {.help = "plate under a tilted bed, or plates before and behind it, on which the disks rub. Left out, they are "
               "smooth. With plates the options disks/rests and disks/presses have no effect"});
  f.require(!b.plates || b.plates->pressing || b.tilt.value_or(0) > 0, "plates",
            "nothing presses the disks on the plates: the bed is upright",
            "Give \"pressing\" (an acceleration) to the plates, or a \"tilt\" to the box");
}

void describe_sides(Fields& f, BoxOptions& b) {
  f.variant("sides", b.sides, {.help = "side walls of the box"},
            alternative<HardSidesOptions>(
                "hard", "walls with their own restitution and friction",
                [](Fields& g, HardSidesOptions& s) {
                  describe_surface(g, s.surface);
                  g.quantity(
                      "slope", s.slope, dimension::angle,
                      {.help = "angle from the vertical by which the sides lean outwards, above 0: the box is W wide "
                               "at the floor and wider above. Left out, the sides are vertical. Sloped sides move with "
                               "the floor; vertical ones stand still. Densities are still numbers per height and per "
                               "width W. With sloped sides the options disks/rests and disks/presses have no effect",
                       .range = {.low = 1e-3, .high = 1.2},
                       .example = "\"10 deg\""});
                }),
            alternative<PeriodicSidesOptions>(
                "periodic", "periodic boundaries: a disk that leaves on the left enters on the right"));
}

void describe_box(Fields& f, BoxOptions& b) {
  f.quantity(
      "width", b.width, dimension::length,
      {.help = "distance W between the side walls", .required = true, .range = positive, .example = "\"89.7 mm\""});
  describe_tilt_and_plates(f, b);
  describe_sides(f, b);
  f.variant("lid", b.lid, {.help = "upper boundary of the box"}, alternative<OpenLidOptions>("open", "no lid"),
            alternative<FixedLidOptions>("fixed", "a lid at rest",
                                         [](Fields& g, FixedLidOptions& l) {
                                           g.quantity("height", l.height, dimension::length,
                                                      {.help = "height of the lid above the mean position of the floor",
                                                       .required = true,
                                                       .range = positive});
                                           describe_surface(g, l.surface);
                                         }),
            alternative<PeriodicLidOptions>(
                "periodic", "no floor and no lid, periodic in the vertical direction (only without gravity)",
                [](Fields& g, PeriodicLidOptions& l) {
                  g.quantity(
                      "height", l.height, dimension::length,
                      {.help = "period of the box in the vertical direction", .required = true, .range = positive});
                }),
            alternative<FreeLidOptions>(
                "free",
                "a smooth lid with mass that slides up and down without friction: it lies on the bed and is thrown up",
                [](Fields& g, FreeLidOptions& l) {
                  g.quantity("height", l.height, dimension::length,
                             {.help = "height of the lid's lower face above the mean position of the floor, from which "
                                      "the lid falls at the start",
                              .required = true,
                              .range = positive});
                  g.quantity("mass", l.mass, dimension::mass,
                             {.help = "mass of the lid", .required = true, .range = positive, .example = "\"2 g\""});
                  g.number("restitution", l.restitution,
                           {.help = "normal coefficient of restitution e", .range = zero_to_one, .example = "0.92"});
                }));
}

void describe_floor(Fields& f, FloorOptions& floor, std::optional<double> gravity) {
  f.tagged(
      "motion", floor.motion, {.help = "motion of the floor"},
      alternative<StillFloorOptions>("still", "the floor does not move"),
      alternative<SinusoidalFloorOptions>(
          "sinusoidal", "a sin(2 pi f t)",
          [gravity](Fields& g, SinusoidalFloorOptions& s) { describe_shaking(g, s, gravity); }),
      alternative<TableFloorOptions>(
          "table", "one period of measured positions at equal time steps, with a periodic cubic spline between them",
          [](Fields& g, TableFloorOptions& t) {
            g.quantity("period", t.period, dimension::time,
                       {.help = "period of the motion; left out, from the times in the file", .range = positive});
            g.quantities(
                "heights", t.heights, dimension::length,
                {.help = "positions of the floor in the order of time", .example = "[\"0 mm\", \"1 mm\", ...]"});
            g.input_files("file", t.file,
                          {.help = "CSV file in place of heights, with the columns time and height in s and m (reduced "
                                   "units: sqrt(D/g) and D), or height alone"});
            read_table(g, t);
          }));
  describe_surface(f, floor.surface);
}

void describe_bath(Fields& fields, BathOptions& bath) {
  fields.variant(
      "bath", bath, {.help = "heat bath, in place of or in addition to shaking"},
      alternative<NoBathOptions>("none", "no bath, the floor alone drives the bed"),
      alternative<LangevinOptions>(
          "langevin",
          "after every interval, v becomes v exp(-rate interval) + sqrt(T (1 - exp(-2 rate interval))/m) xi, with xi a "
          "normal random number",
          [](Fields& f, LangevinOptions& b) {
            f.quantity("temperature", b.temperature, dimension::length,
                       {.help = "temperature of the bath, T/(m g)", .required = true, .range = positive});
            f.quantity(
                "rate", b.rate, dimension::frequency,
                {.help = "friction rate: velocities decay as exp(-rate t)", .required = true, .range = positive});
            f.quantity("interval", b.interval, dimension::time,
                       {.help = "time between two kicks", .required = true, .range = positive});
          }),
      alternative<AndersenOptions>(
          "andersen", "the velocity of a disk is drawn again at random moments",
          [](Fields& f, AndersenOptions& b) {
            f.quantity("temperature", b.temperature, dimension::length,
                       {.help = "temperature of the bath, T/(m g)", .required = true, .range = positive});
            f.quantity("rate", b.rate, dimension::frequency,
                       {.help = "rate at which the velocity of each disk is drawn again",
                        .required = true,
                        .range = positive});
          }),
      alternative<WhiteNoiseOptions>(
          "white_noise", "random kicks without friction",
          [](Fields& f, WhiteNoiseOptions& b) {
            f.quantity("heating", b.heating, cube_over_time,
                       {.help = "heating H/m: increase of the variance of each velocity component per time",
                        .required = true,
                        .range = positive});
            f.quantity("interval", b.interval, dimension::time,
                       {.help = "time between two kicks", .required = true, .range = positive});
            f.boolean("conserve_momentum", b.conserve_momentum,
                      {.help = "whether the mean of all kicks is subtracted, so that momentum is conserved"});
          }),
      alternative<ThermalFloorOptions>(
          "thermal_floor", "a disk that hits the floor leaves it with a velocity drawn from a gas at temperature T",
          [](Fields& f, ThermalFloorOptions& b) {
            f.quantity("temperature", b.temperature, dimension::length,
                       {.help = "temperature of the bath, T/(m g)", .required = true, .range = positive});
          }));
}

void describe_start(Fields& fields, StartOptions& start) {
  fields.variant(
      "start", start, {.help = "initial positions of the disks"},
      alternative<HexagonalStartOptions>(
          "hexagonal", "staggered rows from the floor up, or filling a closed box evenly",
          [](Fields& f, HexagonalStartOptions& s) {
            f.integer("disks_a_row", s.disks_a_row, {.help = "number of disks in a row; 0: as many as fit"});
            f.number("spacing", s.spacing,
                     {.help = "distance between neighbours in a row, in D; 0: chosen from the width",
                      .range = non_negative});
          }),
      alternative<RandomStartOptions>("random", "random sequential insertion",
                                      [](Fields& f, RandomStartOptions& s) {
                                        f.quantity(
                                            "height", s.height, dimension::length,
                                            {.help = "height up to which the box is filled; 0: chosen by the program",
                                             .range = non_negative});
                                      }),
      alternative<FileStartOptions>(
          "file", "the last frame of a trajectory (extended XYZ, lengths in D)", [](Fields& f, FileStartOptions& s) {
            f.input_files("file", s.file, {.help = "file of the trajectory", .required = true});
          }));
}

// speed_unit: sqrt(g D) [m/s].
sim::Surface to_sim(const SurfaceOptions& s, double speed_unit) {
  return {s.restitution, s.friction, s.tangential_restitution, s.law, s.law_speed ? *s.law_speed / speed_unit : 1};
}

}  // namespace

FloorTable read_floor_table(const std::filesystem::path& path) {
  FloorTable table;
  std::vector<double> times;
  std::size_t time_column = std::string::npos, height_column = std::string::npos;
  bool header = false;
  each_csv_line(read_file(path), [&](const std::vector<std::string>& cells, std::size_t line_number) {
    const auto fail = [&](const std::string& what) {
      throw InputError(fmt::format("{}:{}: {}", path.string(), line_number, what));
    };
    if (!header) {
      header = true;
      for (std::size_t k = 0; k < cells.size(); ++k) {
        if (cells[k] == "time") time_column = k;
        if (cells[k] == "height") height_column = k;
      }
      if (height_column == std::string::npos) fail("expected a header with the columns time,height or height");
      return;
    }
    const auto number = [&](std::size_t column) {
      if (column >= cells.size()) fail(fmt::format("expected {} columns, found {}", column + 1, cells.size()));
      char* stop = nullptr;
      const double value = std::strtod(cells[column].c_str(), &stop);
      if (cells[column].empty() || *stop != '\0' || !std::isfinite(value))
        fail(fmt::format("\"{}\" is not a number", cells[column]));
      return value;
    };
    table.heights.push_back(number(height_column));
    if (time_column != std::string::npos) {
      times.push_back(number(time_column));
      const std::size_t n = times.size();
      if (n >= 2 && !(times[n - 1] > times[n - 2])) fail("the times must increase from row to row");
      const double step = times.size() >= 2 ? times[1] - times[0] : 0;
      if (n >= 3 && std::abs((times[n - 1] - times[0]) / static_cast<double>(n - 1) / step - 1) > 1e-3)
        fail("the times are not equally spaced");
    }
  });
  if (table.heights.size() < 4)
    throw InputError(fmt::format("{}: a period of the floor needs at least 4 positions, found {}", path.string(),
                                 table.heights.size()));
  if (!times.empty()) {
    const auto n = static_cast<double>(times.size());
    table.duration = (times.back() - times.front()) / (n - 1) * n;
  }
  return table;
}

sim::PlacedStart read_start(const std::filesystem::path& path, const sim::Disks& disks) {
  sim::PlacedStart start;
  TrajectoryReader reader(path);
  TrajectoryFrame frame, last;
  while (reader.read(frame)) last = frame;
  std::size_t count = 0;
  for (const sim::Species& species : disks.species) count += species.count;
  if (last.size() != count)
    throw InputError(
        fmt::format("{}: the last frame has {} disks, but the bed has {}", path.string(), last.size(), count));
  if (disks.species.size() > 1 && disks.species[1].diameter == disks.species[0].diameter)
    throw InputError(fmt::format(
        "{}: the species of a disk cannot be determined, because both species have the same diameter", path.string()));
  std::vector<std::size_t> found(disks.species.size());
  for (std::size_t i = 0; i < last.size(); ++i) {
    const double diameter = i < last.radius.size() ? 2 * last.radius[i] : 1;
    std::uint32_t species = 0;
    while (species < disks.species.size() && std::abs(disks.species[species].diameter - diameter) > 1e-9) ++species;
    if (species == disks.species.size())
      throw InputError(fmt::format("{}: disk {} has the diameter {} D, but no species has this diameter", path.string(),
                                   i, diameter));
    ++found[species];
    start.disks.push_back(
        {last.x[i], last.z[i], last.vx[i], last.vz[i], i < last.spin.size() ? last.spin[i] : 0.0, species});
  }
  for (std::size_t k = 0; k < found.size(); ++k) {
    if (found[k] != disks.species[k].count)
      throw InputError(fmt::format("{}: the last frame has {} disks of species {}, but the bed has {}", path.string(),
                                   found[k], k + 1, disks.species[k].count));
  }
  return start;
}

void SceneOptions::describe(Fields& fields) {
  reduced_ = fields.reduced();
  if (!reduced_ && fields.mode() != Fields::Mode::encode) disks_.density = 2500;  // glass
  fields.object<DiskOptions>("disks", disks_, describe_disks,
                             {.help = "disks: their number, size, material and rule of contact", .required = true});
  describe_gravity(fields);
  fields.object<BoxOptions>("box", box_, describe_box,
                            {.help = "box: its width, side walls and lid", .required = true});
  fields.object<FloorOptions>(
      "floor", floor_, [gravity = gravity()](Fields& f, FloorOptions& floor) { describe_floor(f, floor, gravity); },
      {.help = "floor: its motion and rule of contact"});
  describe_bath(fields, bath_);
  describe_start(fields, start_);
  if (fields.decoding() || fields.mode() == Fields::Mode::schema)
    start_temperature_ = weightless() ? 1.0 : 0.01 * (reduced_ ? 1.0 : disks_.diameter);
  fields.quantity("start_temperature", start_temperature_, dimension::length,
                  {.help = "temperature T/(m g) of the initial velocities (without gravity: 1, the unit of energy)",
                   .range = non_negative});
  if (fields.decoding() && fields.problem_count() == 0) check_scene(fields);
}

// Of 9.81 m/s^2 where nothing else is said; in reduced units 1, or 0 for none.
void SceneOptions::describe_gravity(Fields& fields) {
  if (fields.decoding() || fields.mode() == Fields::Mode::schema) gravity_ = reduced_ ? 1.0 : usual_gravity;
  if (!reduced_) {
    fields.quantity("gravity", gravity_, dimension::acceleration,
                    {.help = "acceleration of gravity. In the plane of a tilted bed acts g = gravity cos(tilt), see "
                             "box/tilt. A weightless scene needs reduced units",
                     .range = positive,
                     .example = "\"9.81 m/s^2\""});
    return;
  }
  double g = gravity_.value_or(0);
  fields.number("gravity", g, {.help = "1, or 0 for a weightless scene (reduced units)", .range = from_to(0, 1)});
  fields.require(g == 0 || g == 1, "gravity", "in reduced units gravity is 1 or 0");
  gravity_ = g == 0 ? std::nullopt : std::optional<double>(g);
}

// Whether such a bed can be, and whether its disks can be laid out.
void SceneOptions::check_scene(Fields& fields) const {
  const auto* file = std::get_if<FileStartOptions>(&start_);
  if (file != nullptr && file->file.paths.size() != 1) {
    fields.problem("/start/file", "this names " + std::to_string(file->file.paths.size()) +
                                      " files, but the start needs one trajectory");
    return;
  }
  if (!gravity_) {
    fields.require(!box_.tilt, "box/tilt", "a bed without gravity has no tilt",
                   box_.plates ? "Give the plates \"pressing\" instead" : "Leave it out");
    fields.require(!box_.plates || box_.plates->pressing, "box/plates",
                   "without gravity, the plates need \"pressing\": the acceleration that presses the disks on them",
                   "Give \"pressing\"");
    if (fields.problem_count() > 0) return;
  }
  constexpr double longest_contact = 1;  // of the unit of time
  const auto [unit, meanwhile] =
      gravity_ ? std::pair("sqrt(D/g)", "falls by its radius") : std::pair("D sqrt(m/T0)", "moves by its diameter");
  fields.require(
      contact_duration() <= longest_contact, "disks/contact_duration",
      fmt::format("a contact would last {:.3g} {}, and in 1 {} a disk {}", contact_duration(), unit, unit, meanwhile),
      fmt::format("Leave it out, which means {:g} {}, or give a much shorter one", usual_contact_duration, unit));
  const sim::Scene laid_out = scene(1);
  const std::vector<sim::SceneProblem> problems = sim::check(laid_out);
  // Lengths are in D here: a bead that is too large, as by a number without unit, makes the box too small.
  const auto odd = reduced_ || problems.empty() ? std::nullopt : odd_bead(disks_.diameter);
  if (odd) fields.problem("/disks/diameter", odd->what, odd->suggestion);
  for (const sim::SceneProblem& problem : problems)
    if (!odd || !problem.where.starts_with("/box")) fields.problem(problem.where, problem.what);
  if (fields.problem_count() == 0 && laid_out.count() <= checked_when_read) {
    try {
      sim::place_disks(laid_out);
    } catch (const std::runtime_error& error) {
      fields.problem("/start", error.what(), "Change the start, the number of disks or the box");
    }
  }
}

void SceneOptions::set_material(double restitution, double friction, double side_friction) {
  for (SurfaceOptions* surface : {&disks_.surface, &floor_.surface}) {
    surface->restitution = restitution;
    surface->friction = friction;
  }
  if (auto* sides = std::get_if<HardSidesOptions>(&box_.sides)) {
    sides->surface.restitution = restitution;
    sides->surface.friction = side_friction;
  }
}

bool SceneOptions::slopes() const {
  const auto* sides = std::get_if<HardSidesOptions>(&box_.sides);
  return sides != nullptr && sides->slope;
}

std::optional<double> SceneOptions::gravity() const {
  // In reduced units it is the one in the plane that is 1. Upright beds must not see a product with cos(0).
  if (!gravity_ || reduced_ || !box_.tilt || *box_.tilt == 0) return gravity_;
  return *gravity_ * std::cos(*box_.tilt);
}

double SceneOptions::time_unit() const {
  return gravity_ && !reduced_ ? ReducedScales::of(disks_.diameter, *gravity()).time : 1;
}

double SceneOptions::period() const {
  if (const auto* sine = std::get_if<SinusoidalFloorOptions>(&floor_.motion))
    return 1 / (sine->frequency * time_unit());
  if (const auto* table = std::get_if<TableFloorOptions>(&floor_.motion))
    return table->period.value_or(1) / time_unit();
  return 0;
}

bool SceneOptions::dissipates() const {
  const auto loses = [](const auto& surface) { return surface.restitution < 1 || surface.friction > 0; };
  const auto* sides = std::get_if<HardSidesOptions>(&box_.sides);
  const auto* lid = std::get_if<FixedLidOptions>(&box_.lid);
  const auto* free = std::get_if<FreeLidOptions>(&box_.lid);
  return loses(disks_.surface) || loses(floor_.surface) || (sides != nullptr && loses(sides->surface)) ||
         (lid != nullptr && loses(lid->surface)) || (free != nullptr && free->restitution < 1);
}

double SceneOptions::contact_duration() const {
  if (disks_.contact_duration) return *disks_.contact_duration / time_unit();
  return dissipates() ? usual_contact_duration : 0;
}

std::optional<double> SceneOptions::hertz_contact_time() const {
  if (disks_.material == Material::unnamed || !gravity_) return std::nullopt;
  double speed = std::sqrt(*gravity() * disks_.diameter);
  if (const auto* sine = std::get_if<SinusoidalFloorOptions>(&floor_.motion))
    speed = 2 * std::numbers::pi * sine->frequency * sine->amplitude;
  else if (bath_temperature() > 0)
    speed *= std::sqrt(bath_temperature());
  MaterialConstants material = constants_of(disks_.material);
  material.density = disks_.density;
  return shakebed::pipelines::hertz_contact_time(material, disks_.diameter, speed);
}

bool SceneOptions::may_be_filled_at_random() const {
  return gravity_ && std::holds_alternative<OpenLidOptions>(box_.lid) &&
         std::holds_alternative<HexagonalStartOptions>(start_);
}

bool SceneOptions::two_species() const {
  return disks_.second && (disks_.second->diameter != disks_.diameter ||
                           disks_.second->density.value_or(disks_.density) != disks_.density);
}

double SceneOptions::bath_temperature() const {
  double temperature = 0;
  if (const auto* b = std::get_if<LangevinOptions>(&bath_)) temperature = b->temperature;
  if (const auto* b = std::get_if<AndersenOptions>(&bath_)) temperature = b->temperature;
  if (const auto* b = std::get_if<ThermalFloorOptions>(&bath_)) temperature = b->temperature;
  return temperature / length_unit();
}

sim::RubbingPlates SceneOptions::rubbing_plates() const {
  const PlatesOptions& p = *box_.plates;
  const double tilt = box_.tilt.value_or(0), time = time_unit();
  sim::RubbingPlates plates;
  plates.deceleration = p.friction * (p.pressing ? *p.pressing * time * time / length_unit() : std::tan(tilt));
  plates.follow_floor = p.motion == PlateMotion::floor;
  if (period() > 0) plates.interval = std::min(plates.interval, period() / 50);
  if (p.interval) plates.interval = *p.interval / time;
  plates.contact_radius = p.contact_radius.value_or(0) / length_unit();
  return plates;
}

sim::Scene SceneOptions::scene(std::uint64_t seed) const {
  const double length = length_unit(), time = time_unit(), speed = length / time;
  sim::Scene scene;
  scene.rests = disks_.rests;
  scene.presses = disks_.presses;
  scene.seed = seed;
  if (gravity_) scene.gravity = sim::UniformGravity{};

  scene.disks.species = {{disks_.count, 1, 1}};
  if (disks_.second) {
    const double ratio = disks_.second->diameter / disks_.diameter;
    const double mass = disks_.second->density.value_or(disks_.density) / disks_.density *
                        (disks_.inertia == Inertia::sphere ? ratio * ratio * ratio : ratio * ratio);
    scene.disks.species.push_back({disks_.second->count, ratio, mass});
  }
  scene.disks.contact = to_sim(disks_.surface, speed);
  scene.disks.inertia_ratio = disks_.inertia == Inertia::sphere ? 0.4 : 0.5;

  scene.box.width = box_.width / length;
  if (const auto* hard = std::get_if<HardSidesOptions>(&box_.sides)) {
    scene.box.sides = sim::HardSides{to_sim(hard->surface, speed), hard->slope.value_or(0)};
  } else {
    scene.box.sides = sim::PeriodicSides{};
  }
  if (const auto* lid = std::get_if<FixedLidOptions>(&box_.lid))
    scene.box.top = sim::Lid{lid->height / length, to_sim(lid->surface, speed)};
  if (const auto* lid = std::get_if<FreeLidOptions>(&box_.lid))
    scene.box.top = sim::Lid{lid->height / length, {.restitution = lid->restitution}, lid->mass / *description().mass};
  if (const auto* lid = std::get_if<PeriodicLidOptions>(&box_.lid))
    scene.box.top = sim::PeriodicTop{lid->height / length};
  if (box_.plates) scene.box.plates = rubbing_plates();
  scene.disks.contact_duration = contact_duration();

  if (const auto* sine = std::get_if<SinusoidalFloorOptions>(&floor_.motion))
    scene.box.floor = sim::SinusoidalFloor{sine->amplitude / length, sine->frequency * time};
  if (const auto* table = std::get_if<TableFloorOptions>(&floor_.motion)) {
    sim::TabulatedFloor floor{table->period.value_or(1) / time, table->heights};
    for (double& height : floor.heights) height /= length;
    scene.box.floor = floor;
  }
  scene.box.floor_surface = to_sim(floor_.surface, speed);

  if (const auto* b = std::get_if<LangevinOptions>(&bath_))
    scene.bath = sim::LangevinBath{b->temperature / length, b->rate * time, b->interval / time};
  if (const auto* b = std::get_if<AndersenOptions>(&bath_))
    scene.bath = sim::AndersenBath{b->temperature / length, b->rate * time};
  if (const auto* b = std::get_if<WhiteNoiseOptions>(&bath_))
    scene.bath = sim::WhiteNoiseBath{b->heating * time * time * time / (length * length), b->interval / time,
                                     b->conserve_momentum};
  if (const auto* b = std::get_if<ThermalFloorOptions>(&bath_)) scene.bath = sim::ThermalFloor{b->temperature / length};

  if (const auto* s = std::get_if<HexagonalStartOptions>(&start_))
    scene.start = sim::HexagonalStart{s->disks_a_row, s->spacing};
  if (const auto* s = std::get_if<RandomStartOptions>(&start_)) scene.start = sim::RandomStart{s->height / length};
  if (const auto* s = std::get_if<FileStartOptions>(&start_)) {
    scene.start = read_start(s->file.paths.at(0), scene.disks);
  }
  scene.start_temperature = start_temperature_ / (gravity_ ? length : 1);
  return scene;
}

BedDescription SceneOptions::description() const {
  BedDescription bed;
  bed.reduced = reduced_;
  bed.count = disks_.count + (disks_.second ? disks_.second->count : 0);
  bed.diameter = disks_.diameter;
  if (disks_.second) bed.second_diameter = disks_.second->diameter;
  const double cube = disks_.diameter * disks_.diameter * disks_.diameter;
  bed.mass = reduced_ ? 1 : disks_.density * std::numbers::pi * cube / (disks_.inertia == Inertia::sphere ? 6 : 4);
  bed.gravity = gravity().value_or(0);
  bed.tilt = box_.tilt;
  bed.width = box_.width;
  bed.periodic = std::holds_alternative<PeriodicSidesOptions>(box_.sides);
  bed.amplitude = bed.frequency = 0;
  if (const auto* sine = std::get_if<SinusoidalFloorOptions>(&floor_.motion)) {
    bed.amplitude = sine->amplitude;
    bed.frequency = sine->frequency;
  }
  bed.bath_temperature = bath_temperature();
  bed.restitution = disks_.surface.restitution;
  bed.friction = disks_.surface.friction;
  return bed;
}

}  // namespace shakebed::pipelines
