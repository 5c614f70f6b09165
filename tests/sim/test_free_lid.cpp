// A lid of finite mass that falls on the bed and is thrown up by it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/scene/scene.hpp"
#include "tests/sim/snapshot_of.hpp"

namespace {

using namespace shakebed::sim;

Scene one_disk(double height, double mass, double restitution, double z, double vz) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{1, 1, 1}};
  scene.box.width = 10;
  scene.box.sides = HardSides{};
  scene.box.top = Lid{height, Surface{restitution, 0, 0}, mass};
  scene.start = PlacedStart{{{5, z, 0.3, vz, 0, 0}}};
  return scene;
}

// Both fall with g, so that they meet after gap over speed. Then each has the velocity of two bodies in a straight
// line.
TEST(FreeLid, IsMetAndThrownAsABodyOfItsMass) {
  for (const double mass : {0.2, 1.0, 7.0}) {
    for (const double restitution : {1.0, 0.6}) {
      const double height = 4, z = 1, vz = 3, meeting = (height - 0.5 - z) / vz;
      const auto simulation = simulate(one_disk(height, mass, restitution, z, vz));
      simulation->advance_to(meeting * (1 - 1e-12));
      EXPECT_EQ(simulation->counters().wall_collisions, 0U);
      EXPECT_NEAR(snapshot_of(*simulation).lid_height, height - meeting * meeting / 2, 1e-11);
      simulation->advance_to(meeting * (1 + 1e-12));
      EXPECT_EQ(simulation->counters().wall_collisions, 1U);
      const Snapshot at = snapshot_of(*simulation);
      const double given = (1 + restitution) * vz * mass / (1 + mass);
      EXPECT_NEAR(at.vz[0], vz - meeting - given, 1e-11);
      EXPECT_NEAR(at.lid_velocity, -meeting + given / mass, 1e-11);
      EXPECT_EQ(at.vx[0], 0.3) << "it is smooth";
      EXPECT_NEAR(simulation->energy().dissipated, 0.5 * mass / (1 + mass) * (1 - restitution * restitution) * vz * vz,
                  1e-12);
      EXPECT_NEAR(simulation->energy().imbalance(), 0, 1e-12);
    }
  }
}

TEST(FreeLid, KeepsTheEnergyOfAnElasticBed) {
  const auto simulation = simulate(one_disk(4, 3, 1, 1, 2));
  simulation->advance_to(3000);
  EXPECT_GT(simulation->counters().wall_collisions, 500U);
  EXPECT_NEAR(simulation->energy().imbalance(), 0, 1e-9);
}

Scene elastic_bed(double mass) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{40, 1, 1}};
  scene.box.width = 9.3;
  scene.box.sides = PeriodicSides{};
  scene.box.top = Lid{14, {}, mass};
  scene.start_temperature = 4;
  return scene;
}

// Equipartition: the lid has T/2 of kinetic energy, as each direction of each disk has; the floor carries its weight
// too.
TEST(FreeLid, HasTheTemperatureOfItsBed) {
  for (const double mass : {2.0, 15.0}) {
    const auto simulation = simulate(elastic_bed(mass));
    simulation->advance_to(200);
    std::vector<double> lid, disks;  // of blocks
    constexpr int blocks = 40, looks = 2000;
    for (int b = 0; b < blocks; ++b) {
      double l = 0, d = 0;
      for (int k = 0; k < looks; ++k) {
        simulation->advance_to(simulation->time() + 0.37);
        const Snapshot at = snapshot_of(*simulation);
        l += mass * at.lid_velocity * at.lid_velocity / looks;
        for (std::size_t i = 0; i < at.x.size(); ++i)
          d += at.vz[i] * at.vz[i] / (static_cast<double>(at.x.size()) * looks);
      }
      lid.push_back(l);
      disks.push_back(d);
    }
    double mean = 0, squares = 0;
    for (int b = 0; b < blocks; ++b) mean += (lid[b] / disks[b] - 1) / blocks;
    for (int b = 0; b < blocks; ++b) squares += std::pow(lid[b] / disks[b] - 1 - mean, 2);
    const double error = std::sqrt(squares / (blocks * (blocks - 1)));
    std::printf("mass %g: lid over disks %.4f(%.4f)\n", mass, 1 + mean, error);
    EXPECT_LT(std::abs(mean), 4 * error) << "4 standard errors";
    EXPECT_LT(error, 0.03);
    EXPECT_NEAR(simulation->energy().imbalance(), 0, 1e-8 * simulation->energy().initial);
  }
}

Scene shaken_bed(bool sloped) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{100, 1, 1}};
  scene.disks.contact = scene.box.floor_surface = Surface{0.9, 0.2, 0};
  scene.disks.contact_duration = 1e-4;
  scene.box.width = 12.3;
  scene.box.sides = HardSides{Surface{0.9, 0, 0}, sloped ? 0.2 : 0};
  scene.box.floor = SinusoidalFloor{3 / std::pow(2 * std::numbers::pi * 0.35, 2), 0.35};
  scene.box.top = Lid{16, Surface{0.8, 0, 0}, 8};
  return scene;
}

TEST(FreeLid, LiesOnAShakenBedAndClosesItsLedger) {
  for (const bool sloped : {false, true}) {
    const auto simulation = simulate(shaken_bed(sloped));
    for (int k = 1; k <= 60; ++k) {
      simulation->advance_to(0.71 * k);
      const Snapshot at = snapshot_of(*simulation);
      EXPECT_LT(*std::max_element(at.z.begin(), at.z.end()), at.lid_height - 0.5 + 1e-9);
      const EnergyLedger energy = simulation->energy();
      EXPECT_NEAR(energy.imbalance(), 0, 1e-9 * (energy.dissipated + energy.initial));
      EXPECT_TRUE(simulation->foresees_contacts());
      EXPECT_LT(simulation->largest_overlap(), hard_overlap);
    }
    EXPECT_GT(simulation->counters().wall_collisions, 100U);
  }
}

TEST(FreeLid, GoesOnFromACheckpointToTheSameBytes) {
  for (const bool sloped : {false, true}) {
    const auto a = simulate(shaken_bed(sloped)), b = simulate(shaken_bed(sloped)), c = simulate(shaken_bed(sloped));
    std::vector<std::uint8_t> saved;
    while (a->time() < 15) {
      a->advance_to(a->next_synchronisation());
      saved = a->checkpoint();
    }
    b->advance_to(3);
    b->restore(saved);
    a->advance_to(40);
    b->advance_to(40);
    for (int k = 1; k < 4000; ++k) c->advance_to(0.01 * k);
    c->advance_to(40);
    for (const Simulation* other : {b.get(), c.get()}) {
      const Snapshot here = snapshot_of(*a), there = snapshot_of(*other);
      EXPECT_EQ(here.x, there.x);
      EXPECT_EQ(here.z, there.z);
      EXPECT_EQ(here.vz, there.vz);
      EXPECT_EQ(here.lid_height, there.lid_height);
      EXPECT_EQ(here.lid_velocity, there.lid_velocity);
      EXPECT_EQ(a->energy().dissipated, other->energy().dissipated);
      EXPECT_EQ(a->counters().events(), other->counters().events());
    }
  }
}

TEST(FreeLid, NeedsAMassAndGravityAndIsSmooth) {
  const auto problems = [](Lid lid, bool falls) {
    Scene scene = shaken_bed(false);
    scene.box.top = lid;
    if (!falls) scene.gravity = Weightless{};
    std::vector<std::string> where;
    for (const SceneProblem& problem : check(scene)) where.push_back(problem.where);
    return where;
  };
  EXPECT_TRUE(problems({16, {}, 3}, true).empty());
  EXPECT_TRUE(problems({16, {}}, false).empty());
  EXPECT_EQ(problems({16, {}, 0}, true), std::vector<std::string>{"/box/lid/mass"});
  EXPECT_EQ(problems({16, {}, 3}, false), std::vector<std::string>{"/box/lid/mass"});
  EXPECT_EQ(problems({16, Surface{0.9, 0.1, 0}, 3}, true), std::vector<std::string>{"/box/lid/friction"});
}

}  // namespace
