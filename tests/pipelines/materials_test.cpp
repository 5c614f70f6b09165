// The contact time of elastic spheres, against the equation of motion solved step by step, and what a named material
// does to a recipe.
#include "pipelines/stages/materials.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::pipelines {
namespace {

// m* x'' = -(4/3) E* sqrt(R*) x^(3/2) from x = 0 with the speed v until x = 0 again, by the velocity Verlet method.
double time_by_steps(double density, double young, double poisson, double diameter, double speed) {
  const double mass = density * std::numbers::pi / 6 * std::pow(diameter, 3) / 2;
  const double stiffness = 4.0 / 3 * young / (2 * (1 - poisson * poisson)) * std::sqrt(diameter / 4);
  const double step = 1e-10;
  double x = 0, v = speed, time = 0;
  const auto acceleration = [&] { return -stiffness * std::pow(std::max(x, 0.0), 1.5) / mass; };
  do {
    v += acceleration() * step / 2;
    x += v * step;
    v += acceleration() * step / 2;
    time += step;
  } while (x > 0);
  return time;
}

TEST(Materials, HaveHertzsContactTime) {
  const auto agree = [](Material material, double density, double young, double poisson, double diameter,
                        double speed) {
    const MaterialConstants& constants = constants_of(material);
    EXPECT_EQ(constants.density, density) << constants.name;
    EXPECT_EQ(constants.young_modulus, young) << constants.name;
    EXPECT_EQ(constants.poisson_ratio, poisson) << constants.name;
    EXPECT_NEAR(hertz_contact_time(constants_of(material), diameter, speed) /
                    time_by_steps(density, young, poisson, diameter, speed),
                1, 1e-3)
        << constants_of(material).name;
  };
  agree(Material::aluminium, 2700, 70.3e9, 0.345, 3e-3, 0.3);
  agree(Material::steel, 7860, 212e9, 0.291, 2e-3, 0.1);
  agree(Material::glass, 2500, 71.3e9, 0.22, 2e-3, 0.3);
  agree(Material::brass, 8500, 100.6e9, 0.35, 5e-3, 1);
  agree(Material::polystyrene, 1050, 3.3e9, 0.34, 1e-3, 0.2);
  agree(Material::acetate, 1300, 2e9, 0.4, 6e-3, 0.2);
}

// An independent remark on beds of 3 mm aluminium beads: some 10 us at 0.3 m/s.
TEST(Materials, OfBeadsTouchForMicroseconds) {
  const double time = hertz_contact_time(constants_of(Material::aluminium), 3e-3, 0.3);
  EXPECT_GT(time, 5e-6);
  EXPECT_LT(time, 15e-6);
}

TEST(Materials, GiveTheDensityAndTheTimeBesideTheContactDuration) {
  using namespace shakebed::tests;
  const ScratchFolder folder;
  const auto run = [&](const std::string& disks, const std::string& out) {
    write_text(folder / (out + ".json"), R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "seed": 1,
      "replicas": 1, "disks": { "count": 30, "diameter": "2 mm", "restitution": 0.9, "inertia": "sphere")" +
                                             disks + R"( },
      "gravity": "9.81 m/s^2", "box": { "width": "20.6 mm", "sides": "periodic" },
      "floor": { "motion": "sinusoidal", "amplitude": "1 mm", "frequency": "30 Hz", "restitution": 0.9 },
      "settle": "0.4 s", "measure": "0.2 s" } ] })");
    const ProgramResult result = run_shakebed({"run", out + ".json", "--out", out}, folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return std::pair{Json::parse(read_text(folder / out / "bed/observables.json")),
                     Json::parse(read_text(folder / out / "bed/bed.json"))};
  };
  const auto [plain, plain_bed] = run("", "plain");
  EXPECT_FALSE(plain.contains("hertz_contact_time"));
  const auto [steel, steel_bed] = run(R"(, "material": "steel")", "steel");
  const double speed = 1e-3 * 2 * std::numbers::pi * 30;  // the floor's
  EXPECT_NEAR(steel["hertz_contact_time"]["value"].get<double>(), time_by_steps(7860, 212e9, 0.291, 2e-3, speed), 1e-8);
  EXPECT_EQ(steel["hertz_contact_time"]["unit"], "s");
  const double mass = 7860 * std::numbers::pi / 6 * 8e-9;
  EXPECT_NEAR(steel_bed["mass"]["value"].get<double>(), mass, 1e-12 * mass);
  const auto [light, light_bed] = run(R"(, "material": "steel", "density": "1000 kg/m^3")", "light");
  EXPECT_NEAR(light_bed["mass"]["value"].get<double>(), mass * 1000 / 7860, 1e-12 * mass);
}

}  // namespace
}  // namespace shakebed::pipelines
