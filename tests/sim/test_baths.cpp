// Reservoirs disk by disk: what each draw of the scene's own random numbers does to a velocity, and to the ledger.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "sim/engine/random.hpp"
#include "sim/engine/simulation.hpp"

namespace shakebed::sim {
namespace {

constexpr std::uint64_t bath_stream = 0x6261746800000000;  // of a scene's seed

// One disk that meets nothing.
Scene lone_disk(const Bath& bath, std::uint64_t seed) {
  Scene scene;
  scene.gravity = Weightless{};
  scene.disks.species = {{1, 1, 1}};
  scene.disks.contact.restitution = 0.9;
  scene.box.width = 20;
  scene.box.sides = PeriodicSides{};
  scene.box.top = PeriodicTop{20};
  scene.bath = bath;
  scene.seed = seed;
  scene.start = PlacedStart{{{3, 4, 0.5, -0.25, 0, 0}}};
  return scene;
}
// One of mass 1 from rest along the vertical, half a diameter above a thermal floor of T = 2.
Scene fallen_on_a_thermal_floor() {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{1, 1, 1}};
  scene.box.width = 20;
  scene.bath = ThermalFloor{2};
  scene.seed = 5;
  scene.start = PlacedStart{{{10, 1, 0.5, 0, 0, 0}}};
  return scene;
}
struct Velocity {
  double x, z;
};
Velocity velocity_at(Simulation& simulation, double time) {
  simulation.advance_to(time);
  Snapshot at;
  simulation.snapshot(at);
  return {at.vx[0], at.vz[0]};
}
void expect_work(const Simulation& simulation, const Velocity& now) {
  const EnergyLedger energy = simulation.energy();
  EXPECT_NEAR(energy.bath_work, (now.x * now.x + now.z * now.z - 0.3125) / 2, 1e-14);
  EXPECT_NEAR(energy.imbalance(), 0, 1e-14);
}

// v exp(-rate interval) + sqrt(T (1 - exp(-2 rate interval))) xi, every interval.
TEST(Baths, OfLangevinKeepAndGive) {
  for (const std::uint64_t seed : {1UL, 2UL}) {
    const auto simulation = simulate(lone_disk(LangevinBath{1.5, 2, 0.1}, seed));
    Random random(seed ^ bath_stream);
    Velocity expected{0.5, -0.25};
    for (int k = 1; k <= 5; ++k) {
      const Velocity before = velocity_at(*simulation, 0.1 * k - 0.01);
      EXPECT_NEAR(before.x, expected.x, 1e-14);
      EXPECT_NEAR(before.z, expected.z, 1e-14);
      const auto [x, z] = random.normal_pair();
      const double keep = std::exp(-0.2), give = std::sqrt(1.5 * (1 - std::exp(-0.4)));
      expected = {keep * expected.x + give * x, keep * expected.z + give * z};
    }
    expect_work(*simulation, velocity_at(*simulation, 0.55));
  }
}

// v + sqrt(H interval) xi; where momentum is kept, a lone disk keeps its own.
TEST(Baths, OfWhiteNoiseKick) {
  const auto simulation = simulate(lone_disk(WhiteNoiseBath{0.3, 0.1, false}, 3));
  Random random(3 ^ bath_stream);
  Velocity expected{0.5, -0.25};
  for (int k = 0; k < 4; ++k) {
    const auto [x, z] = random.normal_pair();
    expected.x += std::sqrt(0.03) * x, expected.z += std::sqrt(0.03) * z;
  }
  const Velocity found = velocity_at(*simulation, 0.45);
  EXPECT_NEAR(found.x, expected.x, 1e-14);
  EXPECT_NEAR(found.z, expected.z, 1e-14);
  expect_work(*simulation, found);
  const auto kept = simulate(lone_disk(WhiteNoiseBath{0.3, 0.1, true}, 3));
  EXPECT_NEAR(velocity_at(*kept, 0.45).x, 0.5, 1e-14);
}

// After a time of the exponential distribution the velocity is drawn anew.
TEST(Baths, OfAndersenDrawAnew) {
  const auto simulation = simulate(lone_disk(AndersenBath{2, 0.5}, 4));
  Random random(4 ^ bath_stream);
  double time = 0;
  for (int k = 0; k < 4; ++k) {
    const double next = time - std::log(random.uniform_positive()) / 0.5;
    const Velocity before = velocity_at(*simulation, next - 1e-9);
    random.below(1);
    const auto [x, z] = random.normal_pair();
    const Velocity after = velocity_at(*simulation, next + 1e-9);
    EXPECT_NE(before.x, after.x);
    EXPECT_NEAR(after.x, std::sqrt(2) * x, 1e-14);
    EXPECT_NEAR(after.z, std::sqrt(2) * z, 1e-14);
    expect_work(*simulation, after);
    time = next;
  }
  simulation->set_bath_temperature(8);
}

// A disk of mass 1 that falls on the floor leaves it with the velocity of the flux of a gas at T.
TEST(Baths, OnAThermalFloorThrow) {
  const auto simulation = simulate(fallen_on_a_thermal_floor());
  Random random(5 ^ bath_stream);
  const double x = std::sqrt(2) * random.normal_pair().first,
               z = std::sqrt(2) * std::sqrt(-2 * std::log(random.uniform_positive()));
  simulation->advance_to(1 + 1e-3);  // from rest 0.5 above the floor
  Snapshot at;
  simulation->snapshot(at);
  EXPECT_NEAR(at.vx[0], x, 1e-14);
  EXPECT_NEAR(at.vz[0], z - 1e-3, 1e-14);
  EXPECT_NEAR(simulation->energy().floor_work, (x * x + z * z - 1.25) / 2, 1e-14);
  EXPECT_NEAR(simulation->energy().imbalance(), 0, 1e-14);
}

// The temperature from now on, whichever the reservoir; a scene without one has none to set.
TEST(Baths, TakeAnotherTemperature) {
  const auto thermal = simulate(fallen_on_a_thermal_floor());
  thermal->set_bath_temperature(8);
  Random random(5 ^ bath_stream);
  const double x = std::sqrt(8) * random.normal_pair().first;
  EXPECT_NEAR(velocity_at(*thermal, 1 + 1e-3).x, x, 1e-14);
  for (const double wrong : {0.0, -1.0, std::numeric_limits<double>::infinity(), std::nan("")})
    EXPECT_THROW(thermal->set_bath_temperature(wrong), std::invalid_argument) << wrong;
  const auto langevin = simulate(lone_disk(LangevinBath{1.5, 2, 0.1}, 1));
  langevin->set_bath_temperature(6);
  Random other(1 ^ bath_stream);
  EXPECT_NEAR(velocity_at(*langevin, 0.15).x,
              0.5 * std::exp(-0.2) + std::sqrt(6 * (1 - std::exp(-0.4))) * other.normal_pair().first, 1e-14);
  EXPECT_THROW(simulate(lone_disk(WhiteNoiseBath{0.3, 0.1, false}, 3))->set_bath_temperature(2), std::invalid_argument)
      << "it has a heating rate";
  EXPECT_THROW(simulate(lone_disk({}, 3))->set_bath_temperature(2), std::invalid_argument);
}

// Disks of two masses: kicks go as 1/sqrt(m), and together they keep the momentum that they are to keep.
TEST(Baths, OfTwoMassesKeepTheirMomentum) {
  for (const bool keep : {true, false}) {
    Scene scene = lone_disk(WhiteNoiseBath{0.3, 0.1, keep}, 6);
    scene.disks.species = {{1, 1, 1}, {1, 0.5, 0.25}};
    scene.start = PlacedStart{{{3, 4, 0.5, -0.25, 0, 0}, {12, 4, 0, 1, 0, 1}}};
    const auto simulation = simulate(scene);
    simulation->advance_to(0.15);
    Snapshot at;
    simulation->snapshot(at);
    Random random(6 ^ bath_stream);
    const auto one = random.normal_pair(), two = random.normal_pair();
    const double kick = std::sqrt(0.03);
    // By the engine's own order of its disks.
    const auto kicked = [&](const Random::Pair& heavy, const Random::Pair& light) {
      const double mean = keep ? kick * (heavy.first + 0.25 * 2 * light.first) / 1.25 : 0;
      return std::abs(at.vx[0] - (0.5 + kick * heavy.first - mean)) < 1e-13 &&
             std::abs(at.vx[1] - (2 * kick * light.first - mean)) < 1e-13;
    };
    EXPECT_TRUE(kicked(one, two) || kicked(two, one)) << at.vx[0] << " " << at.vx[1];
    if (keep) {
      EXPECT_NEAR(at.vx[0] + 0.25 * at.vx[1], 0.5, 1e-14);
      EXPECT_NEAR(at.vz[0] + 0.25 * at.vz[1], 0, 1e-14);
    }
    EXPECT_NEAR(simulation->energy().imbalance(), 0, 1e-14);
  }
}

}  // namespace
}  // namespace shakebed::sim
