#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "sim/simulation.hpp"

namespace shakebed::sim {
namespace {

Scene shaken_bed() {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{120, 1, 1}};
  scene.disks.contact = {0.9, 0.2, 0};
  scene.disks.inertia_ratio = 0.4;
  scene.disks.contact_duration = 1e-4;
  scene.box.width = 12;
  scene.box.sides = HardSides{{0.9, 0.1, 0}};
  scene.box.floor = SinusoidalFloor{0.8, 0.35};
  scene.box.floor_surface = {0.9, 0.2, 0};
  scene.start_temperature = 0.01;
  return scene;
}

bool same_bytes(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}
void expect_same(const Simulation& a, const Simulation& b) {
  Snapshot sa, sb;
  a.snapshot(sa);
  b.snapshot(sb);
  EXPECT_TRUE(same_bytes(sa.x, sb.x) && same_bytes(sa.z, sb.z) && same_bytes(sa.vx, sb.vx) &&
              same_bytes(sa.vz, sb.vz) && same_bytes(sa.spin, sb.spin));
  EXPECT_EQ(a.counters().collisions(), b.counters().collisions());
}

TEST(Engine, GivesTheSameBytesForTheSameSeed) {
  const Scene scene = shaken_bed();
  const auto a = simulate(scene), b = simulate(scene);
  a->advance_to(200);
  b->advance_to(200);
  expect_same(*a, *b);
}

TEST(Engine, DoesNotCareWhenOneLooks) {
  const Scene scene = shaken_bed();
  const auto a = simulate(scene), b = simulate(scene);
  a->advance_to(100);
  Snapshot at;
  for (int i = 1; i <= 1000; ++i) {
    b->advance_to(0.1 * i);
    b->snapshot(at);
  }
  expect_same(*a, *b);
}

TEST(Engine, GoesOnFromACheckpointToTheSameBytes) {
  std::vector<Scene> scenes(5, shaken_bed());
  scenes[1].bath = LangevinBath{2, 1, 0.37};
  scenes[2].bath = AndersenBath{2, 0.5};
  scenes[3].disks.species = {{60, 1, 1}, {40, 1.4, 2.744}};
  scenes[4].disks.contact = Surface{};
  scenes[4].box.sides = PeriodicSides{};
  for (const Scene& scene : scenes) {
    const auto a = simulate(scene);
    std::vector<std::uint8_t> saved;
    while (a->time() < 60) {
      a->advance_to(a->next_synchronisation());
      saved = a->checkpoint();
    }
    const auto b = simulate(scene);
    b->restore(saved);
    EXPECT_EQ(a->time(), b->time());
    a->advance_to(150);
    b->advance_to(150);
    expect_same(*a, *b);
  }
}

TEST(Engine, RefusesACheckpointOfAnotherScene) {
  const Scene scene = shaken_bed();
  Scene other = scene;
  other.disks.species[0].count = 121;
  const auto a = simulate(scene), b = simulate(other);
  a->advance_to(a->next_synchronisation());
  auto saved = a->checkpoint();
  EXPECT_THROW(b->restore(saved), std::invalid_argument);
  saved.resize(saved.size() / 2);
  EXPECT_THROW(a->restore(saved), std::invalid_argument);
  saved.clear();
  EXPECT_THROW(a->restore(saved), std::invalid_argument);
}

TEST(Engine, ClosesItsEnergyLedger) {
  const auto sim = simulate(shaken_bed());
  sim->advance_to(500);
  const EnergyLedger ledger = sim->energy();
  EXPECT_GT(ledger.dissipated, 100);
  EXPECT_LE(std::abs(ledger.imbalance()), 1e-10 * ledger.dissipated);
}

TEST(Engine, LetsNothingOverlapAndNothingOut) {
  const auto sim = simulate(shaken_bed());
  Snapshot at;
  for (int i = 1; i <= 300; ++i) {
    sim->advance_to(0.7 * i);
    sim->snapshot(at);
    EXPECT_LE(sim->largest_overlap(), 1e-12);
    for (std::size_t k = 0; k < at.x.size(); ++k) {
      EXPECT_GE(at.x[k], 0.5 - 1e-12);
      EXPECT_LE(at.x[k], 11.5 + 1e-12);
      EXPECT_GE(at.z[k] - 0.5, at.floor_position - 1e-12);
    }
  }
}

}  // namespace
}  // namespace shakebed::sim
