// A bed of elastic disks that a reservoir holds at T is in equilibrium with it: T_x = T_z = T at every height, and the
// velocities are Maxwell's. White noise, which only balances dissipation, is another thing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/measure/velocities.hpp"
#include "tests/physics/law.hpp"

namespace shakebed::sim::reservoirs_law {
namespace {

using tests::expect_law;

constexpr double temperature = 5;

Scene bed(double restitution) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{300, 1, 1}};
  scene.disks.contact = {restitution, 0, 0};
  scene.disks.contact_duration = restitution < 1 ? 1e-4 : 0;
  scene.box.width = 20;
  scene.box.sides = PeriodicSides{};
  scene.start_temperature = temperature;
  return scene;
}

// Quarters of the disks by height, from the lowest: T of each, both components.
std::vector<double> temperatures_of_quarters(const VelocityObserver& velocities) {
  double total = 0;
  for (std::size_t k = 0; k < velocities.grid().count; ++k) total += velocities.layer(k).count;
  std::vector<double> result;
  VelocityMoments quarter;
  double below = 0;
  for (std::size_t k = 0; k < velocities.grid().count; ++k) {
    const VelocityMoments layer = velocities.layer(k);
    quarter.add(layer);
    below += layer.count;
    if (below >= total * static_cast<double>(result.size() + 1) / 4 * (1 - 1e-12)) {
      result.push_back((quarter.temperature_x() + quarter.temperature_z()) / 2);
      quarter = {};
    }
  }
  return result;
}

// 24,000 looks at 300 disks half a unit of time apart, at which the bath has renewed most of the velocities: 7.2e6
// nearly independent ones. One standard error is 0.07 % of T_x and T_z, 0.1 % of a quarter's T and 0.0005 of a2, so 0.5
// % is 5 or more: one false alarm in 1e5. The quick tests look 3,000 times: their errors are 2.8 times as large, and
// four times as much is allowed.
constexpr int quick_looks = 3'000;
void expect_equilibrium(const char* name, const Bath& bath, std::uint32_t count = 300, int looks = 24'000) {
  const double relative = looks == quick_looks ? 2e-2 : 5e-3;
  Scene scene = bed(1);
  scene.disks.species[0].count = count;
  scene.bath = bath;
  const auto simulation = simulate(scene);
  VelocityObserver velocities(scene, simulation->properties(), 1, {0, 0.5, 400}, false);
  CorrelatedMeans x, z;
  Snapshot at;
  simulation->advance_to(200);
  for (int look = 0; look < looks; ++look) {
    simulation->advance_to(200.125 + 0.5 * look);
    simulation->snapshot(at);
    velocities.observe(at, 0);
    double vx2 = 0, vz2 = 0;
    for (std::size_t i = 0; i < at.x.size(); ++i) vx2 += at.vx[i] * at.vx[i], vz2 += at.vz[i] * at.vz[i];
    x.add(vx2 / count), z.add(vz2 / count);
  }
  std::printf("  %s\n", name);
  const double limit = relative * temperature;
  expect_law("T_x", x.mean(), x.std_error(), temperature, limit);
  expect_law("T_z", z.mean(), z.std_error(), temperature, limit);
  expect_law("T_x/T_z", x.mean() / z.mean(), std::hypot(x.std_error(), z.std_error()) / temperature, 1, relative);
  EXPECT_LT(3 * std::max(x.std_error(), z.std_error()), limit);
  const std::vector<double> quarters = temperatures_of_quarters(velocities);
  ASSERT_EQ(quarters.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k)
    expect_law(("T of quarter " + std::to_string(k + 1) + " by height").c_str(), quarters[k],
               std::hypot(x.std_error(), z.std_error()), temperature, limit);
  const Measured a2 = velocities.fourth_cumulant_of_all();
  expect_law("a2 (0 for a Maxwellian)", a2.value, a2.std_error, 0, relative);
  EXPECT_LT(3 * a2.std_error, relative);
  const EnergyLedger ledger = simulation->energy();
  expect_law("energy ledger, of the energy held", ledger.imbalance() / ledger.initial, 0, 0, 1e-10);
}

TEST(Reservoir, LangevinKicksHoldTheBedNearEquilibrium) {
  expect_equilibrium("Langevin", LangevinBath{temperature, 2, 0.25}, 300, quick_looks);
}
TEST(Reservoir, AndersenRedrawsHoldTheBedNearEquilibrium) {
  expect_equilibrium("Andersen", AndersenBath{temperature, 2}, 300, quick_looks);
}
TEST(Reservoir, LangevinKicksHoldTheBedInEquilibrium) {
  expect_equilibrium("Langevin", LangevinBath{temperature, 2, 0.25});
}
TEST(Reservoir, AndersenRedrawsHoldTheBedInEquilibrium) {
  expect_equilibrium("Andersen", AndersenBath{temperature, 2});
}

// Under white noise dilute regions, where little dissipates, are hotter: shown, and that it is so is asserted.
TEST(Reservoir, WhiteNoiseIsNotIsothermal) {
  Scene scene = bed(0.9);
  scene.disks.species[0].count = 150;
  scene.box.width = 30;
  scene.bath = WhiteNoiseBath{1, 0.1, true};
  const auto simulation = simulate(scene);
  VelocityObserver velocities(scene, simulation->properties(), 1, {0, 2, 100}, false);
  Snapshot at;
  for (int look = 0; look < 1500; ++look) {
    simulation->advance_to(100 + 0.25 * look);
    simulation->snapshot(at);
    velocities.observe(at, 0);
  }
  std::printf("  white noise, e = 0.9\n  %10s %10s %10s %10s\n", "height", "n D^2", "T_x", "T_z");
  double dense = 0, dilute = 0;
  for (std::size_t k = 0; k < velocities.grid().count; ++k) {
    const VelocityMoments layer = velocities.layer(k);
    if (layer.count < 500) continue;
    const double density = velocities.number_density(layer, false);
    const double t = (layer.temperature_x() + layer.temperature_z()) / 2;
    std::printf("  %10.1f %10.4f %10.4f %10.4f\n", velocities.height(k), density, layer.temperature_x(),
                layer.temperature_z());
    if (dense == 0) dense = t;
    if (density < 0.05 && dilute == 0) dilute = t;
  }
  std::printf("  T where n D^2 falls below 0.05 over T at the floor: %.3g\n", dilute / dense);
  EXPECT_GT(dilute, 2 * dense);
}

// Every floor contact redraws from the flux at T: the same equilibrium without anything done in the bulk. Heat has to
// be conducted up from the floor, and the bed's T wanders the more slowly the higher it is: a low one, for a long time.
TEST(Reservoir, ThermalFloorHoldsTheBedInEquilibrium) {
  expect_equilibrium("thermal floor", ThermalFloor{temperature}, 60, 320'000);
}

}  // namespace
}  // namespace shakebed::sim::reservoirs_law
