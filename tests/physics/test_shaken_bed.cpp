// The shaken bed that an independent soft-sphere simulation (LAMMPS) also did, with and without friction.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "sim/measure/measure.hpp"
#include "sim/measure/observables.hpp"
#include "tests/physics/law.hpp"

namespace shakebed::sim::shaken_bed_law {
namespace {

using tests::expect_law;

constexpr double diameter = 2.99e-3, gravity = 9.81, frequency = 20, amplitude = 2.5e-3;

// Settles and measures so many periods at 32 phases each.
struct Measurement {
  Measured centre, temperature_x;
  EnergyLedger ledger;
  double overlap;
};
Measurement measured(const Scene& scene, double settling_periods, int periods) {
  const double period = 1 / std::get<SinusoidalFloor>(scene.box.floor).frequency;
  Observing<BedObserver> bed([&](const DiskProperties& disks) {
    return BedObserver(scene, disks, 32, {-3, 0.25, 160}, {KernelKind::gaussian, 0.5});
  });
  const MeasurementSchedule schedule{.bath = {},
                                     .settle = settling_periods * period,
                                     .period = period,
                                     .periods = static_cast<std::uint64_t>(periods),
                                     .phases = 32};
  const RunResult run = measure(scene, schedule, {&bed});
  return {bed->centre_of_mass(), bed->temperature_x(), run.simulation->energy(), run.simulation->largest_overlap()};
}

// The rise of the centre of mass [D] and T_x/(m g) [mm].
Measurement run_bed(double restitution, double friction, int periods) {
  const double time_unit = std::sqrt(diameter / gravity);
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{306, 1, 1}};
  scene.disks.contact = {restitution, friction, 0};
  scene.disks.inertia_ratio = 0.4;
  scene.disks.contact_duration = 1e-6 / time_unit;
  scene.box.width = 30;
  scene.box.sides = HardSides{{restitution, 0, 0}};
  scene.box.floor = SinusoidalFloor{amplitude / diameter, frequency * time_unit};
  scene.box.floor_surface = {restitution, friction, 0};
  scene.start_temperature = 0.01;
  Measurement bed = measured(scene, 200, periods);
  bed.centre.value -= ideal_centre_of_mass(306, 30, true);
  bed.temperature_x.value *= diameter * 1e3;
  bed.temperature_x.std_error *= diameter * 1e3;
  return bed;
}

// 2.867 D and 3.076 mm by soft spheres, 2.865 D and 3.05 mm by a second event-driven check.
TEST(ShakenBed, RisesAndIsAsHotAsTheIndependentSimulationSays) {
  const Measurement bed = run_bed(0.92, 0, 400);
  expect_law("rise of the centre of mass [D]", bed.centre.value, bed.centre.std_error, 2.86, 0.08);
  expect_law("T_x/mg [mm]", bed.temperature_x.value, bed.temperature_x.std_error, 3.05, 0.13);
  expect_law("energy ledger, relative", bed.ledger.imbalance() / bed.ledger.dissipated, 0, 0, 1e-10);
  expect_law("largest overlap [D]", bed.overlap, 0, 0, 1e-12);
  EXPECT_LT(bed.centre.std_error, 0.02);
  EXPECT_LT(bed.temperature_x.std_error, 0.06);
}

// 1.520 D and 0.866 mm with friction 0.2, by another friction law (a spring with memory): likeness, not identity.
TEST(ShakenBed, IsCalmedByFriction) {
  const Measurement bed = run_bed(0.92, 0.2, 100);
  expect_law("rise of the centre of mass [D]", bed.centre.value, bed.centre.std_error, 1.520, 0.152);
  expect_law("T_x/mg [mm]", bed.temperature_x.value, bed.temperature_x.std_error, 0.866, 0.173);
  expect_law("energy ledger, relative", bed.ledger.imbalance() / bed.ledger.dissipated, 0, 0, 1e-10);
}

// Hot beds of few disks change slowly, over many periods. The errors that each of 192 beds states are the scatter
// between them, which is known to 5 %: four of its errors are 20 %. By blocking alone those of beds measured for 264
// periods were 0.6 to 0.8 of it.
TEST(ShakenBed, StatesErrorsThatAreItsScatter) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{30, 1, 1}};
  scene.disks.contact = {0.959, 0, 0};
  scene.disks.inertia_ratio = 0.4;
  scene.disks.contact_duration = 1e-4;
  scene.box.width = 12.35;
  scene.box.sides = PeriodicSides{};
  constexpr double f = 0.483, gamma = 4.2;
  scene.box.floor = SinusoidalFloor{gamma / std::pow(2 * std::numbers::pi * f, 2), f};
  scene.box.floor_surface = {0.959, 0, 0};
  scene.start_temperature = 0.01;
  constexpr int beds = 192;
  struct Sums {
    double value = 0, squares = 0, stated = 0;
    void add(const Measured& m) { value += m.value, squares += m.value * m.value, stated += m.std_error * m.std_error; }
  };
  Sums centre, temperature;
  for (int bed = 0; bed < beds; ++bed) {
    scene.seed = 300 + static_cast<std::uint64_t>(bed);
    const Measurement found = measured(scene, 60, 400);
    centre.add(found.centre);
    temperature.add(found.temperature_x);
  }
  const auto ratio = [](const Sums& sums) {
    const double mean = sums.value / beds, scatter = (sums.squares - beds * mean * mean) / (beds - 1);
    return std::sqrt(sums.stated / beds / scatter);
  };
  expect_law("stated error over scatter, centre of mass", ratio(centre), 0.05, 1, 0.2);
  expect_law("stated error over scatter, T_x", ratio(temperature), 0.05, 1, 0.2);
}

// 500 disks of 2 mm, 61.2 mm wide, e = 0.9, 30 Hz: gently shaken beds lie on the floor for a part of the period, where
// the engine goes on with soft disks (engine_press.hpp). Soft spheres (LAMMPS, linear dashpots, contact time 10 us,
// 30 steps a contact) from two starts each, 25 and 40 periods: T_x 0.0009 and 0.0007, 0.0074 and 0.0078, 0.0471 and
// 0.0485.
struct GentleBed {
  double gamma;
  double temperature_x, temperature_x_error, centre;  // [m g D], [D] of the soft spheres
  double allowed, centre_allowed;                     // besides errors [m g D]; [D]
};

Measurement run_gentle_bed(double gamma, int periods, double width = 30.6, const Surface& surface = {0.9, 0, 0}) {
  constexpr double d = 2e-3, f = 30;
  const double time_unit = std::sqrt(d / gravity);
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{500, 1, 1}};
  scene.disks.contact = scene.box.floor_surface = surface;
  scene.disks.inertia_ratio = 0.4;  // of spheres
  scene.disks.contact_duration = 1e-4;
  scene.box.width = width;
  scene.box.sides = HardSides{surface};
  scene.box.floor = SinusoidalFloor{gamma * gravity / std::pow(2 * std::numbers::pi * f, 2) / d, f * time_unit};
  scene.start_temperature = 0.01;
  return measured(scene, 10, periods);
}

TEST(ShakenBed, IsThatOfSoftSpheresWhereItIsGentlyShaken) {
  for (const GentleBed& soft : {GentleBed{1.2, 0.0008, 0.0001, 7.2862, 0.0005, 0.002},
                                {1.5, 0.0076, 0.0002, 7.3193, 0.0004, 0.003},
                                {2, 0.0478, 0.0009, 7.4918, 0.0024, 0.01}}) {
    const Measurement bed = run_gentle_bed(soft.gamma, 30);
    const double error = std::hypot(soft.temperature_x_error, bed.temperature_x.std_error);
    std::printf("  Gamma %.1f:\n", soft.gamma);
    expect_law("T_x [m g D]", bed.temperature_x.value, error, soft.temperature_x, soft.allowed + 2 * error);
    expect_law("centre of mass [D]", bed.centre.value, bed.centre.std_error, soft.centre, soft.centre_allowed);
    expect_law("energy ledger, relative", bed.ledger.imbalance() / bed.ledger.dissipated, 0, 0, 1e-10);
    expect_law("largest overlap [D]", bed.overlap, 0, 0, 2e-3);
  }
}

// Walls with friction stir a bed that would else hardly move. Soft spheres: "rough sides" of reference/
// weak_rough_beds.csv, one bed, 15 and 30 periods. Contacts alone have 0.0004, since t_c lets them slide on the walls.
TEST(ShakenBed, IsThatOfSoftSpheresBetweenWallsWithFriction) {
  const Measurement bed = run_gentle_bed(1.2, 30, 30.6, {0.6, 0.5, 0});
  const double error = std::hypot(0.00035, bed.temperature_x.std_error);
  expect_law("T_x [m g D]", bed.temperature_x.value, error, 0.00225, 2 * error);
  expect_law("centre of mass [D]", bed.centre.value, std::hypot(bed.centre.std_error, 0.0044), 7.3194, 0.05);
  expect_law("energy ledger, relative", bed.ledger.imbalance() / bed.ledger.dissipated, 0, 0, 1e-10);
}

// Below Gamma = 1 the floor never falls away: the bed comes to rest on it, and a run costs no more than its landing.
TEST(ShakenBed, LiesStillBelowGammaOne) {
  const Measurement bed = run_gentle_bed(0.7, 80);
  expect_law("T_x [m g D]", bed.temperature_x.value, bed.temperature_x.std_error, 0, 1e-6);
  expect_law("energy ledger, relative", bed.ledger.imbalance() / bed.ledger.dissipated, 0, 0, 1e-10);
  expect_law("largest overlap [D]", bed.overlap, 0, 0, 2e-3);
}

// Where thirty disks fill the box exactly rows lock. By contacts of hard disks such beds had no end.
TEST(ShakenBed, EndsWhereRowsLock) {
  for (const double gamma : {0.7, 1.5, 2.0}) {
    const Measurement bed = run_gentle_bed(gamma, 20, 30);
    std::printf("  Gamma %.1f:\n", gamma);
    expect_law("energy ledger, relative", bed.ledger.imbalance() / bed.ledger.dissipated, 0, 0, 1e-10);
    expect_law("largest overlap [D]", bed.overlap, 0, 0, 5e-3);
    EXPECT_LT(bed.temperature_x.value, 0.1);
  }
}

}  // namespace
}  // namespace shakebed::sim::shaken_bed_law
