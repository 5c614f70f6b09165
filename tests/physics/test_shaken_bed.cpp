// The shaken bed that an independent soft-sphere simulation (LAMMPS) also did, with and without friction.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/engine/simulation.hpp"
#include "sim/measure/observables.hpp"
#include "tests/physics/law.hpp"

namespace shakebed::sim {
namespace {

using tests::expect_law;

constexpr double diameter = 2.99e-3, gravity = 9.81, frequency = 20, amplitude = 2.5e-3;

struct BedResult {
  Measured rise, temperature_x_mm;
  EnergyLedger ledger;
  double overlap;
};

BedResult run_bed(double restitution, double friction, int periods) {
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
  const auto simulation = simulate(scene);
  const double period = 1 / (frequency * time_unit);
  BedObserver observer(scene, simulation->properties(), 32, {-3, 0.25, 160}, {KernelKind::gaussian, 0.5});
  Snapshot at;
  for (int p = 0; p < periods; ++p) {
    for (std::uint32_t phase = 0; phase < 32; ++phase) {
      simulation->advance_to((200 + p + phase / 32.0) * period);
      simulation->snapshot(at);
      observer.observe(at, phase);
    }
  }
  const double ideal = ideal_centre_of_mass(306, 30, true);
  const Measured centre = observer.centre_of_mass(), tx = observer.temperature_x();
  return {{centre.value - ideal, centre.std_error},
          {tx.value * diameter * 1e3, tx.std_error * diameter * 1e3},
          simulation->energy(),
          simulation->largest_overlap()};
}

// 2.867 D and 3.076 mm by soft spheres, 2.865 D and 3.05 mm by a second event-driven check.
TEST(ShakenBed, RisesAndIsAsHotAsTheIndependentSimulationSays) {
  const BedResult bed = run_bed(0.92, 0, 400);
  expect_law("rise of the centre of mass [D]", bed.rise.value, bed.rise.std_error, 2.86, 0.08);
  expect_law("T_x/mg [mm]", bed.temperature_x_mm.value, bed.temperature_x_mm.std_error, 3.05, 0.13);
  expect_law("energy ledger, relative", bed.ledger.imbalance() / bed.ledger.dissipated, 0, 0, 1e-10);
  expect_law("largest overlap [D]", bed.overlap, 0, 0, 1e-12);
  EXPECT_LT(bed.rise.std_error, 0.02);
  EXPECT_LT(bed.temperature_x_mm.std_error, 0.06);
}

// 1.520 D and 0.866 mm with friction 0.2, by another friction law (a spring with memory): likeness, not identity.
TEST(ShakenBed, IsCalmedByFriction) {
  const BedResult bed = run_bed(0.92, 0.2, 400);
  expect_law("rise of the centre of mass [D]", bed.rise.value, bed.rise.std_error, 1.520, 0.152);
  expect_law("T_x/mg [mm]", bed.temperature_x_mm.value, bed.temperature_x_mm.std_error, 0.866, 0.173);
  expect_law("energy ledger, relative", bed.ledger.imbalance() / bed.ledger.dissipated, 0, 0, 1e-10);
}

}  // namespace
}  // namespace shakebed::sim
