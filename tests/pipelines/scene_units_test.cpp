// A bed written in SI units against the same bed in units of D, m and g done by hand: D = 4 mm and g = 10 m/s^2, so the
// unit of time is 20 ms and that of speed 0.2 m/s.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "sim/engine/simulation.hpp"
#include "tests/pipelines/decoded_scene.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed;
using namespace shakebed::pipelines;
using tests::decoded_scene;
using tests::ScratchFolder;
using tests::write_text;

std::vector<std::string> problems_of(const std::string& text, bool reduced = false) {
  std::vector<Problem> problems;
  decoded_scene(text, problems, reduced);
  std::vector<std::string> words;
  for (const Problem& problem : problems) words.push_back(problem.pointer + ": " + problem.what);
  return words;
}
SceneOptions options_of(const std::string& text, bool reduced = false) {
  std::vector<Problem> problems;
  const auto node = parse_json(text, "bed.json", problems);
  Fields::Source source{.file = "bed.json"};
  source.problems = &problems;
  SceneOptions options;
  Fields fields = Fields::decode(*node, "", source);
  fields.set_reduced(reduced);
  options.describe(fields);
  fields.finish();
  for (const Problem& problem : problems) ADD_FAILURE() << problem.pointer << ": " << problem.what;
  return options;
}
const std::string disks_in_si =
    R"("disks": { "count": 12, "diameter": "4 mm", "density": "2000 kg/m^3", "restitution": 0.9,
    "restitution_law": "power", "restitution_speed": "0.3 m/s", "friction": 0.2, "contact_duration": "20 us" })";
const std::string box = R"("box": { "width": "48 mm", "sides": "periodic" })";
std::string bed(const std::string& more = "") {
  return R"({ "gravity": "10 m/s^2", )" + disks_in_si + ", " + box + (more.empty() ? "" : ", " + more) + " }";
}
sim::Scene scene_of(const std::string& more = "") { return options_of(bed(more)).scene(7); }

TEST(SceneInSi, HasItsUnitOfTimeAndLength) {
  const SceneOptions options = options_of(bed());
  EXPECT_DOUBLE_EQ(options.length_unit(), 0.004);
  EXPECT_DOUBLE_EQ(options.time_unit(), 0.02);
  EXPECT_EQ(options.period(), 0) << "the floor stands still";
}

TEST(SceneInSi, HasItsDisksInUnitsOfTheFirst) {
  const sim::Scene scene = scene_of();
  EXPECT_EQ(scene.seed, 7U);
  ASSERT_EQ(scene.disks.species.size(), 1U);
  EXPECT_EQ(scene.disks.species[0].count, 12U);
  EXPECT_EQ(scene.disks.species[0].diameter, 1);
  EXPECT_EQ(scene.disks.species[0].mass, 1);
  EXPECT_EQ(scene.disks.contact.restitution, 0.9);
  EXPECT_EQ(scene.disks.contact.friction, 0.2);
  EXPECT_DOUBLE_EQ(scene.disks.contact.law_speed, 1.5);
  EXPECT_DOUBLE_EQ(scene.disks.contact_duration, 1e-3);
  EXPECT_EQ(scene.disks.inertia_ratio, 0.5);
  EXPECT_DOUBLE_EQ(scene.box.width, 12);
  EXPECT_TRUE(std::holds_alternative<sim::UniformGravity>(scene.gravity));
}

// A disk weighs by its area, a sphere by its volume; either by its density.
TEST(SceneInSi, HasASecondSpeciesOfItsMass) {
  const auto second = [](const std::string& inertia, const std::string& density) {
    const std::string with = R"({ "gravity": "10 m/s^2", "disks": { "count": 12, "diameter": "4 mm", "density":
      "2000 kg/m^3", "inertia": ")" +
                             inertia + R"(", "second": { "count": 3, "diameter": "6 mm")" + density + " } }, " + box +
                             " }";
    const sim::Scene scene = options_of(with).scene(1);
    EXPECT_EQ(scene.disks.species.at(1).count, 3U);
    EXPECT_DOUBLE_EQ(scene.disks.species.at(1).diameter, 1.5);
    EXPECT_EQ(scene.disks.inertia_ratio, inertia == "sphere" ? 0.4 : 0.5);
    return scene.disks.species.at(1).mass;
  };
  EXPECT_DOUBLE_EQ(second("disk", ""), 2.25);
  EXPECT_DOUBLE_EQ(second("sphere", ""), 3.375);
  EXPECT_DOUBLE_EQ(second("disk", R"(, "density": "5 g/cm^3")"), 2.25 * 2.5);
  EXPECT_DOUBLE_EQ(second("sphere", R"(, "density": "1000 kg/m^3")"), 3.375 / 2);
}

TEST(SceneInSi, HasItsFloorInUnitsOfTheBed) {
  const std::string sine =
      R"("floor": { "motion": "sinusoidal", "amplitude": "2 mm", "frequency": "20 Hz", "restitution": 0.8,
         "restitution_law": "viscoelastic", "restitution_speed": "0.1 m/s", "friction": 0.3 })";
  const SceneOptions options = options_of(bed(sine));
  const sim::Scene scene = options.scene(1);
  const auto& floor = std::get<sim::SinusoidalFloor>(scene.box.floor);
  EXPECT_DOUBLE_EQ(floor.amplitude, 0.5);
  EXPECT_DOUBLE_EQ(floor.frequency, 0.4);
  EXPECT_DOUBLE_EQ(options.period(), 2.5);
  EXPECT_DOUBLE_EQ(scene.box.floor_surface.law_speed, 0.5);
  EXPECT_EQ(scene.box.floor_surface.restitution, 0.8);
  EXPECT_EQ(scene.box.floor_surface.friction, 0.3);
  const double omega = 2 * std::numbers::pi * 20;
  EXPECT_DOUBLE_EQ(options.gamma(), 0.002 * omega * omega / 10);
  // The same by Gamma.
  const SceneOptions by_gamma = options_of(bed(R"("floor": { "motion": "sinusoidal", "gamma": )" +
                                               std::to_string(0.002 * omega * omega / 10) + R"(, "frequency": 20 })"));
  EXPECT_NEAR(std::get<sim::SinusoidalFloor>(by_gamma.scene(1).box.floor).amplitude, 0.5, 1e-6);
}

TEST(SceneInSi, HasATabulatedFloorInUnitsOfTheBed) {
  const SceneOptions options = options_of(bed(
      R"("floor": { "motion": "table", "period": "50 ms", "heights": ["0 mm", "1 mm", "0 mm", "-2 mm", "0.5 mm"] })"));
  const sim::Scene scene = options.scene(1);
  const auto& floor = std::get<sim::TabulatedFloor>(scene.box.floor);
  EXPECT_DOUBLE_EQ(floor.period, 2.5);
  EXPECT_DOUBLE_EQ(options.period(), 2.5);
  ASSERT_EQ(floor.heights.size(), 5U);
  const double expected[] = {0, 0.25, 0, -0.5, 0.125};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_DOUBLE_EQ(floor.heights[i], expected[i]) << i;
}

// Four moments 10 ms apart are a period of 40 ms, for the first is not repeated.
TEST(FloorTable, LastsAsLongAsItsMomentsAndTheWayBack) {
  const ScratchFolder folder;
  write_text(folder / "floor.csv", "time,height\n0.01,0\n0.02,0.001\n0.03,0\n0.04,-0.001\n");
  const FloorTable read = read_floor_table(folder / "floor.csv");
  ASSERT_TRUE(read.duration);
  EXPECT_NEAR(*read.duration, 0.04, 1e-15);
  EXPECT_EQ(read.heights, (std::vector<double>{0, 0.001, 0, -0.001}));
}

TEST(SceneInSi, HasItsSidesAndLidInUnitsOfTheBed) {
  const std::string text = R"({ "gravity": "10 m/s^2", )" + disks_in_si +
                           R"(, "box": { "width": "48 mm", "sides": { "kind": "hard", "restitution": 0.7,
      "restitution_law": "power", "restitution_speed": "0.5 m/s", "friction": 0.1 },
      "lid": { "kind": "fixed", "height": "80 mm", "restitution": 0.6, "restitution_law": "power",
      "restitution_speed": "0.4 m/s", "friction": 0.05 } } })";
  const sim::Scene scene = options_of(text).scene(1);
  const sim::Surface& side = std::get<sim::HardSides>(scene.box.sides).surface;
  EXPECT_DOUBLE_EQ(side.law_speed, 2.5);
  EXPECT_EQ(side.restitution, 0.7);
  EXPECT_EQ(side.friction, 0.1);
  const auto& lid = std::get<sim::Lid>(scene.box.top);
  EXPECT_DOUBLE_EQ(lid.height, 20);
  EXPECT_DOUBLE_EQ(lid.surface.law_speed, 2);
  EXPECT_EQ(lid.surface.restitution, 0.6);
  EXPECT_EQ(lid.surface.friction, 0.05);
}

TEST(SceneInSi, HasItsReservoirInUnitsOfTheBed) {
  const auto langevin = std::get<sim::LangevinBath>(
      scene_of(R"("bath": { "kind": "langevin", "temperature": "6 mm", "rate": "5 Hz", "interval": "10 ms" })").bath);
  EXPECT_DOUBLE_EQ(langevin.temperature, 1.5);
  EXPECT_DOUBLE_EQ(langevin.rate, 0.1);
  EXPECT_DOUBLE_EQ(langevin.interval, 0.5);
  const auto andersen = std::get<sim::AndersenBath>(
      scene_of(R"("bath": { "kind": "andersen", "temperature": "6 mm", "rate": "10 Hz" })").bath);
  EXPECT_DOUBLE_EQ(andersen.temperature, 1.5);
  EXPECT_DOUBLE_EQ(andersen.rate, 0.2);
  const auto noise = std::get<sim::WhiteNoiseBath>(
      scene_of(R"("bath": { "kind": "white_noise", "heating": "3 m^2/s^3", "interval": "30 ms" })").bath);
  EXPECT_DOUBLE_EQ(noise.heating, 1.5) << "(20 ms)^3/(4 mm)^2 is 1/2 of its unit";
  EXPECT_DOUBLE_EQ(noise.interval, 1.5);
  EXPECT_TRUE(noise.conserve_momentum);
  EXPECT_DOUBLE_EQ(
      std::get<sim::ThermalFloor>(scene_of(R"("bath": { "kind": "thermal_floor", "temperature": "2 mm" })").bath)
          .temperature,
      0.5);
  for (const auto& [kind, rest, t] : {std::tuple{"langevin", R"(, "rate": 1, "interval": 1)", 1.5},
                                      {"andersen", R"(, "rate": 1)", 1.5},
                                      {"thermal_floor", "", 1.5}})
    EXPECT_DOUBLE_EQ(
        options_of(bed(std::string(R"("bath": { "kind": ")") + kind + R"(", "temperature": "6 mm")" + rest + " }"))
            .bath_temperature(),
        t)
        << kind;
  EXPECT_EQ(options_of(bed()).bath_temperature(), 0);
}

TEST(SceneInSi, HasItsStartInUnitsOfTheBed) {
  const sim::Scene scene =
      scene_of(R"("start": { "kind": "random", "height": "40 mm" }, "start_temperature": "0.8 mm")");
  EXPECT_DOUBLE_EQ(std::get<sim::RandomStart>(scene.start).height, 10);
  EXPECT_DOUBLE_EQ(scene.start_temperature, 0.2);
  EXPECT_DOUBLE_EQ(scene_of().start_temperature, 0.01);
  std::vector<Problem> problems;
  const auto reduced = [&](const std::string& more) {
    return decoded_scene(R"({ "disks": { "count": 12 }, "box": { "width": 12, "sides": "periodic")" + more + " }",
                         problems, true)
        .scene(7)
        .start_temperature;
  };
  EXPECT_EQ(reduced(" }"), 0.01);
  EXPECT_EQ(reduced(R"(, "lid": { "kind": "periodic", "height": 12 } }, "gravity": 0)"), 1) << "the unit of energy";
  EXPECT_TRUE(problems.empty());
  const sim::Scene rows = scene_of(R"("start": { "kind": "hexagonal", "disks_a_row": 6, "spacing": 1.5 })");
  EXPECT_EQ(std::get<sim::HexagonalStart>(rows.start).disks_a_row, 6U);
  EXPECT_EQ(std::get<sim::HexagonalStart>(rows.start).spacing, 1.5);
}

TEST(SceneInSi, IsDescribedInSi) {
  const BedDescription bed_seen = options_of(bed(R"("floor": { "motion": "sinusoidal", "amplitude": "2 mm",
      "frequency": "20 Hz" }, "bath": { "kind": "andersen", "temperature": "6 mm", "rate": 1 })"))
                                      .description();
  EXPECT_FALSE(bed_seen.reduced);
  EXPECT_EQ(bed_seen.count, 12);
  EXPECT_EQ(bed_seen.diameter, 0.004);
  EXPECT_DOUBLE_EQ(*bed_seen.mass, 2000 * std::numbers::pi * 16e-9) << "a cylinder as long as wide: pi D^3/4";
  EXPECT_EQ(*bed_seen.gravity, 10);
  EXPECT_EQ(bed_seen.width, 0.048);
  EXPECT_TRUE(bed_seen.periodic);
  EXPECT_EQ(*bed_seen.amplitude, 0.002);
  EXPECT_EQ(*bed_seen.frequency, 20);
  EXPECT_DOUBLE_EQ(bed_seen.bath_temperature, 1.5);
  EXPECT_EQ(*bed_seen.restitution, 0.9);
  EXPECT_EQ(*bed_seen.friction, 0.2);
  EXPECT_DOUBLE_EQ(bed_seen.column_number(), 1);
  const std::string sphere = R"({ "disks": { "count": 12, "diameter": "6 mm", "density": "2500 kg/m^3",
      "inertia": "sphere", "second": { "count": 2, "diameter": "3 mm" } }, "box": { "width": "60 mm" } })";
  const BedDescription spheres = options_of(sphere).description();
  EXPECT_DOUBLE_EQ(*spheres.mass, 2500 * std::numbers::pi * 36e-9);
  EXPECT_EQ(spheres.count, 14);
  EXPECT_EQ(*spheres.second_diameter, 0.003);
  EXPECT_EQ(*spheres.gravity, 9.81);
  EXPECT_FALSE(spheres.periodic);
  EXPECT_EQ(*spheres.amplitude, 0);
}

// All of it again as bed.json: each number under its own name, with its unit.
TEST(BedJson, HoldsEachFactUnderItsNameWithItsUnit) {
  const BedDescription bed_seen{.reduced = false,
                                .count = 30,
                                .diameter = 0.003,
                                .second_diameter = 0.004,
                                .mass = 5e-5,
                                .gravity = 9.5,
                                .width = 0.06,
                                .periodic = true,
                                .amplitude = 0.002,
                                .frequency = 25,
                                .bath_temperature = 0.7,
                                .restitution = 0.8,
                                .friction = 0.3};
  const Json json = bed_seen.to_json();
  for (const auto& [name, value, si] : {std::tuple{"diameter", 0.003, "m"},
                                        {"second_diameter", 0.004, "m"},
                                        {"mass", 5e-5, "kg"},
                                        {"gravity", 9.5, "m/s^2"},
                                        {"width", 0.06, "m"},
                                        {"amplitude", 0.002, "m"},
                                        {"frequency", 25.0, "Hz"},
                                        {"bath_temperature", 0.7, "m g D"}}) {
    EXPECT_EQ(json[name]["value"], value) << name;
    EXPECT_EQ(json[name]["unit"], si) << name;
  }
  EXPECT_EQ(json["count"], 30);
  EXPECT_EQ(json["restitution"], 0.8);
  EXPECT_EQ(json["friction"], 0.3);
  EXPECT_EQ(json["units"], "SI");
  EXPECT_DOUBLE_EQ(json["column_number"].get<double>(), 1.5);
  const double omega = 2 * std::numbers::pi * 25;
  EXPECT_DOUBLE_EQ(json["gamma"].get<double>(), 0.002 * omega * omega / 9.5);
  const BedDescription back = BedDescription::from_json(json, "bed.json");
  EXPECT_EQ(back.to_json(), json);
  EXPECT_EQ(*back.friction, 0.3);
  EXPECT_EQ(*back.restitution, 0.8);
  BedDescription reduced = bed_seen;
  reduced.reduced = true;
  const Json plain = reduced.to_json();
  for (const auto& [name, unit] : {std::pair{"diameter", "D"},
                                   {"mass", "m"},
                                   {"gravity", "g"},
                                   {"width", "D"},
                                   {"amplitude", "D"},
                                   {"frequency", "sqrt(g/D)"},
                                   {"bath_temperature", "m g D"}})
    EXPECT_EQ(plain[name]["unit"], unit) << name;
}

TEST(SceneInReducedUnits, IsTakenAsWritten) {
  const SceneOptions options = options_of(R"({ "disks": { "count": 12, "restitution": 0.9, "contact_duration": 0.002,
      "restitution_law": "power", "restitution_speed": 1.5 }, "box": { "width": 12, "sides": "periodic" },
      "floor": { "motion": "sinusoidal", "amplitude": 0.5, "frequency": 0.4 }, "start_temperature": 0.3,
      "bath": { "kind": "langevin", "temperature": 1.5, "rate": 0.1, "interval": 0.5 } })",
                                          true);
  const sim::Scene scene = options.scene(1);
  EXPECT_EQ(scene.disks.contact.law_speed, 1.5);
  EXPECT_EQ(scene.disks.contact_duration, 0.002);
  EXPECT_EQ(std::get<sim::SinusoidalFloor>(scene.box.floor).frequency, 0.4);
  EXPECT_EQ(std::get<sim::LangevinBath>(scene.bath).interval, 0.5);
  EXPECT_EQ(scene.start_temperature, 0.3);
  EXPECT_DOUBLE_EQ(options.period(), 2.5);
  EXPECT_EQ(options.time_unit(), 1);
}

// What dissipates has a contact duration of its own where none is given: 1e-4 sqrt(D/g).
TEST(SceneInReducedUnits, HasAContactDurationWhereAnythingDissipates) {
  const auto duration = [](const std::string& disk, const std::string& rest) {
    return options_of(R"({ "disks": { "count": 4)" + disk + R"( }, "box": { "width": 9)" + rest + " }", true)
        .scene(1)
        .disks.contact_duration;
  };
  EXPECT_EQ(duration("", R"(, "sides": "periodic" })"), 0);
  EXPECT_EQ(duration(R"(, "restitution": 0.9)", R"(, "sides": "periodic" })"), 1e-4);
  EXPECT_EQ(duration(R"(, "friction": 0.1)", R"(, "sides": "periodic" })"), 1e-4);
  EXPECT_EQ(duration("", R"(, "sides": { "kind": "hard", "restitution": 0.9 } })"), 1e-4);
  EXPECT_EQ(duration("", R"(, "sides": { "kind": "hard", "friction": 0.9 } })"), 1e-4);
  EXPECT_EQ(duration("", R"(, "lid": { "kind": "fixed", "height": 9, "restitution": 0.9 } })"), 1e-4);
  EXPECT_EQ(duration("", R"(, "lid": { "kind": "fixed", "height": 9, "friction": 0.9 } })"), 1e-4);
  EXPECT_EQ(duration("", R"( }, "floor": { "motion": "still", "restitution": 0.9 })"), 1e-4);
  EXPECT_EQ(duration("", R"( }, "floor": { "motion": "still", "friction": 0.9 })"), 1e-4);
}

TEST(Material, GoesToDisksFloorAndSides) {
  SceneOptions options = options_of(R"({ "disks": { "count": 4 }, "box": { "width": 9, "sides": "hard" } })", true);
  options.set_material(0.7, 0.2, 0.1);
  const sim::Scene scene = options.scene(1);
  EXPECT_EQ(scene.disks.contact.restitution, 0.7);
  EXPECT_EQ(scene.disks.contact.friction, 0.2);
  EXPECT_EQ(scene.box.floor_surface.restitution, 0.7);
  EXPECT_EQ(scene.box.floor_surface.friction, 0.2);
  EXPECT_EQ(std::get<sim::HardSides>(scene.box.sides).surface.restitution, 0.7);
  EXPECT_EQ(std::get<sim::HardSides>(scene.box.sides).surface.friction, 0.1);
}

// A tilted bed on smooth plates is an upright one in the gravity of its plane: in every number, and in every byte of
// its run.
TEST(TiltedBed, IsAnUprightOneInTheGravityOfItsPlane) {
  const std::string rest = disks_in_si + R"(, "floor": { "motion": "sinusoidal", "frequency": "20 Hz", "gamma": 3,
    "restitution": 0.8 }, "bath": { "kind": "langevin", "temperature": "8 mm", "rate": "2 Hz", "interval": "10 ms" },
    "start_temperature": "2 mm" })";
  const auto tilted = [&](const std::string& tilt) {
    return options_of(R"({ "gravity": "9.81 m/s^2", "box": { "width": "48 mm", "sides": "periodic", "tilt": )" + tilt +
                      " }, " + rest);
  };
  for (const double degrees : {0.0, 7.0, 30.0, 85.0}) {
    const double in_plane = degrees == 0 ? 9.81 : 9.81 * std::cos(degrees * (std::numbers::pi / 180));
    const SceneOptions one = tilted(fmt::format("\"{} deg\"", degrees));
    const SceneOptions other = options_of(
        fmt::format(R"({{ "gravity": {}, "box": {{ "width": "48 mm", "sides": "periodic" }}, )", in_plane) + rest);
    EXPECT_EQ(one.gravity(), in_plane);
    EXPECT_EQ(one.time_unit(), other.time_unit());
    EXPECT_EQ(one.gamma(), other.gamma());
    EXPECT_EQ(one.bath_temperature(), other.bath_temperature());
    EXPECT_EQ(one.period(), other.period());
    EXPECT_EQ(one.description().gravity, other.description().gravity);
    EXPECT_EQ(one.description().amplitude, other.description().amplitude);
    EXPECT_EQ(one.description().tilt, degrees * (std::numbers::pi / 180));
    EXPECT_FALSE(other.description().tilt);
    const auto a = sim::simulate(one.scene(3)), b = sim::simulate(other.scene(3));
    a->advance_to(20);
    b->advance_to(20);
    sim::Snapshot here, there;
    a->snapshot(here);
    b->snapshot(there);
    EXPECT_EQ(here.x, there.x);
    EXPECT_EQ(here.z, there.z);
    EXPECT_EQ(here.vx, there.vx);
    EXPECT_EQ(here.vz, there.vz);
    EXPECT_EQ(a->energy().dissipated, b->energy().dissipated);
  }
}

// Gamma, T/(m g) and the unit of time are with the acceleration in the plane: half of it at 60 degrees.
TEST(TiltedBed, CountsInTheGravityOfItsPlane) {
  const auto at = [](const std::string& tilt) {
    return options_of(R"({ "gravity": "10 m/s^2", )" + disks_in_si +
                      R"(, "box": { "width": "48 mm", "sides": "periodic")" + tilt +
                      R"( }, "floor": { "motion": "sinusoidal", "frequency": "20 Hz", "amplitude": "1 mm" } })");
  };
  const SceneOptions upright = at(""), tilted = at(R"(, "tilt": "60 deg")");
  EXPECT_NEAR(tilted.gamma(), 2 * upright.gamma(), 1e-12);
  EXPECT_NEAR(tilted.time_unit(), std::sqrt(2.0) * upright.time_unit(), 1e-12);
  EXPECT_NEAR(*tilted.gravity(), 5, 1e-12);
  EXPECT_EQ(BedDescription::from_json(tilted.description().to_json(), "bed.json").tilt, tilted.tilt());
}

// In reduced units the gravity in the plane is the unit already.
TEST(TiltedBed, IsTheSameInReducedUnits) {
  const std::string twelve_disks = R"({ "disks": { "count": 12 }, "box": { "width": 12)";
  EXPECT_EQ(options_of(twelve_disks + R"(, "tilt": 1 } })", true).gravity(), 1);
  EXPECT_EQ(options_of(twelve_disks + R"(, "tilt": 1 } })", true).time_unit(), 1);
}

TEST(TiltedBed, DoesNotLieFlat) {
  const auto problems = [](const std::string& tilt) {
    return problems_of(R"({ "disks": { "count": 12, "diameter": "4 mm" }, "box": { "width": "48 mm", "tilt": )" + tilt +
                       " } }");
  };
  EXPECT_TRUE(problems("\"89 deg\"").empty());
  EXPECT_THAT(problems("\"90 deg\""), testing::ElementsAre(testing::HasSubstr("lies flat")));
  EXPECT_THAT(problems("\"91 deg\""), testing::SizeIs(1));
  EXPECT_THAT(problems("\"-1 deg\""), testing::SizeIs(1));
  EXPECT_THAT(problems("\"3 mm\""), testing::SizeIs(1));
}

// D = 4 mm. At 30 degrees g is 10 cos(30 deg) in the plane and 10 sin(30 deg) = 5 m/s^2 across it.
TEST(PlatesInSi, AreInReducedUnits) {
  const auto plates = [](const std::string& in_box, const std::string& more = "") {
    return std::get<sim::RubbingPlates>(options_of(R"({ "gravity": "10 m/s^2", )" + disks_in_si +
                                                   R"(, "box": { "width": "48 mm", )" + in_box + " }" + more + " }")
                                            .scene(1)
                                            .box.plates);
  };
  const double in_plane = 10 * std::cos(std::numbers::pi / 6), time = std::sqrt(0.004 / in_plane);
  const sim::RubbingPlates tilted = plates(R"("tilt": "30 deg", "plates": { "friction": 0.2 })");
  EXPECT_NEAR(tilted.deceleration, 0.2 * 5 / in_plane, 1e-15);
  EXPECT_EQ(tilted.interval, 0.01);
  EXPECT_TRUE(tilted.follow_floor);
  const sim::RubbingPlates pressed = plates(
      R"("tilt": "30 deg", "plates": { "friction": 0.2, "pressing": "3 m/s^2", "interval": "50 us", "motion": "still" })");
  EXPECT_NEAR(pressed.deceleration, 0.2 * 3 / in_plane, 1e-15);
  EXPECT_NEAR(pressed.interval, 50e-6 / time, 1e-15);
  EXPECT_FALSE(pressed.follow_floor);
  EXPECT_EQ(pressed.contact_radius, 0);
  EXPECT_NEAR(plates(R"("tilt": "30 deg", "plates": { "friction": 0.2, "contact_radius": "100 um" })").contact_radius,
              0.025, 1e-15);
  const sim::RubbingPlates fast = plates(R"("plates": { "friction": 1, "pressing": "3 m/s^2" })",
                                         R"(, "floor": { "motion": "sinusoidal", "frequency": "500 Hz", "gamma": 3 })");
  EXPECT_NEAR(fast.interval, 2e-3 / 0.02 / 50, 1e-12) << "a 50th of the period";
  EXPECT_NEAR(fast.deceleration, 0.3, 1e-15);
  EXPECT_TRUE(std::holds_alternative<sim::SmoothPlates>(scene_of().box.plates));
}

TEST(PlatesInReducedUnits, ArePressedByTheTangentOfTheTilt) {
  const auto deceleration = [](const std::string& text) {
    return std::get<sim::RubbingPlates>(options_of(text, true).scene(1).box.plates).deceleration;
  };
  const std::string twelve_disks = R"({ "disks": { "count": 12 }, )";
  EXPECT_NEAR(deceleration(twelve_disks + R"("box": { "width": 12, "tilt": 1, "plates": { "friction": 0.5 } } })"),
              0.5 * std::tan(1), 1e-15);
  // On a horizontal plate: weightless in its plane.
  EXPECT_EQ(
      deceleration(twelve_disks + R"("gravity": 0, "box": { "width": 12, "sides": "periodic", "lid": { "kind": "fixed",
    "height": 12 }, "plates": { "friction": 0.5, "pressing": 3 } } })"),
      1.5);
}

TEST(PlatesInSi, NeedSomethingThatPresses) {
  const auto problems = [](const std::string& in_box) {
    return problems_of(R"({ "disks": { "count": 12, "diameter": "4 mm" }, "box": { "width": "48 mm", )" + in_box +
                       " } }");
  };
  EXPECT_THAT(problems(R"("plates": { "friction": 0.2 })"),
              testing::ElementsAre(testing::HasSubstr("/box/plates: nothing presses")));
  EXPECT_TRUE(problems(R"("tilt": "10 deg", "plates": { "friction": 0.2 })").empty());
  EXPECT_THAT(problems(R"("tilt": "10 deg", "plates": { "pressing": "3 m/s^2" })"), testing::SizeIs(1));
  EXPECT_THAT(problems(R"("tilt": "10 deg", "plates": { "friction": 0.2, "contact_radius": "2.1 mm" })"),
              testing::ElementsAre(testing::HasSubstr("/box/plates/contact_radius: the radius of the contact")));
  EXPECT_THAT(problems(R"("tilt": "10 deg", "plates": { "friction": 0.2, "contact_radius": "0 mm" })"),
              testing::SizeIs(1));
  const std::string flat = R"({ "gravity": 0, "disks": { "count": 12 }, "box": { "width": 12, "sides": "periodic",
    "lid": { "kind": "fixed", "height": 12 }, )";
  EXPECT_THAT(problems_of(flat + R"("plates": { "friction": 0.2 }, "tilt": 1 } })", true), testing::SizeIs(2));
}

// A disk of 4 mm and 2000 kg/m^3 has the mass 2000 pi 64e-9/4 kg of its description.
TEST(FreeLidInSi, CountsInMassesOfADisk) {
  const auto lid = std::get<sim::Lid>(options_of(R"({ "gravity": "10 m/s^2", )" + disks_in_si +
                                                 R"(, "box": { "width": "48 mm", "lid": { "kind": "free",
      "height": "40 mm", "mass": "2 g", "restitution": 0.7 } } })")
                                          .scene(1)
                                          .box.top);
  EXPECT_DOUBLE_EQ(lid.height, 10);
  EXPECT_NEAR(lid.mass, 2e-3 / (2000 * std::numbers::pi * 64e-9 / 4), 1e-9);
  EXPECT_EQ(lid.surface.restitution, 0.7);
  EXPECT_TRUE(lid.is_free());
}

}  // namespace
