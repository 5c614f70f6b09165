// What the law of motion does not see: left and right, the origin of a periodic box, the numbers of equal disks, the
// direction of time. Beds are compared while rounding, which collisions multiply, is still far below what is asked.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "sim/engine/random.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/measure/observables.hpp"
#include "sim/measure/order.hpp"

namespace shakebed::sim {
namespace {

constexpr double tolerance = 1e-7;  // D and sqrt(g D), after some three collisions of each disk

// 30 disks on a square lattice, none touching, with random velocities.
std::vector<Placed> placed(std::uint64_t seed) {
  Random random(seed);
  std::vector<Placed> disks;
  for (int k = 0; k < 30; ++k)
    disks.push_back({0.8 + 1.3 * (k % 6), 0.9 + 1.3 * (k / 6), 2 * random.uniform() - 1, 2 * random.uniform() - 1,
                     random.uniform() - 0.5, 0});
  return disks;
}

Scene scene_with(std::vector<Placed> disks, bool rough) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{static_cast<std::uint32_t>(disks.size()), 1, 1}};
  scene.disks.contact = {rough ? 0.9 : 1.0, rough ? 0.3 : 0.0, rough ? 0.2 : 0.0};
  scene.box.width = 8.1;
  scene.box.sides = HardSides{scene.disks.contact};
  scene.box.floor = SinusoidalFloor{0.5, 0.3};
  scene.box.floor_surface = scene.disks.contact;
  scene.start = PlacedStart{std::move(disks)};
  return scene;
}

struct State {
  Snapshot at;
  Counters counters;
};
State after(const Scene& scene, double time) {
  const auto simulation = simulate(scene);
  simulation->advance_to(time);
  State state;
  simulation->snapshot(state.at);
  state.counters = simulation->counters();
  return state;
}
void expect_same(const std::vector<double>& found, const std::vector<double>& expected, const char* what) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], tolerance) << what << " " << i;
}
std::vector<double> negated(std::vector<double> values) {
  for (double& value : values) value = -value;
  return values;
}

class Symmetry : public testing::TestWithParam<bool> {};

TEST_P(Symmetry, LeftAndRightAreAlike) {
  const std::vector<Placed> disks = placed(1);
  std::vector<Placed> mirrored = disks;
  for (Placed& disk : mirrored) disk.x = 8.1 - disk.x, disk.vx = -disk.vx, disk.spin = -disk.spin;
  const State one = after(scene_with(disks, GetParam()), 2.5), other = after(scene_with(mirrored, GetParam()), 2.5);
  EXPECT_GT(one.counters.disk_collisions, 30U);
  EXPECT_GT(one.counters.wall_collisions, 3U);
  EXPECT_GT(one.counters.floor_collisions, 5U);
  EXPECT_EQ(one.counters.collisions(), other.counters.collisions());
  std::vector<double> x = one.at.x;
  for (double& place : x) place = 8.1 - place;
  expect_same(other.at.x, x, "x");
  expect_same(other.at.z, one.at.z, "z");
  expect_same(other.at.vx, negated(one.at.vx), "vx");
  expect_same(other.at.vz, one.at.vz, "vz");
  if (GetParam()) expect_same(other.at.spin, negated(one.at.spin), "spin");
}

TEST_P(Symmetry, EqualDisksMayBeExchanged) {
  const std::vector<Placed> disks = placed(2);
  std::vector<std::size_t> order(disks.size());
  std::iota(order.begin(), order.end(), 0);
  std::reverse(order.begin(), order.begin() + 17);
  std::swap(order[3], order[25]);
  std::vector<Placed> exchanged;
  for (const std::size_t k : order) exchanged.push_back(disks[k]);
  const State one = after(scene_with(disks, GetParam()), 2.5), other = after(scene_with(exchanged, GetParam()), 2.5);
  EXPECT_EQ(one.counters.collisions(), other.counters.collisions());
  std::vector<double> x, z, vx;
  for (const std::size_t k : order) x.push_back(one.at.x[k]), z.push_back(one.at.z[k]), vx.push_back(one.at.vx[k]);
  expect_same(other.at.x, x, "x");
  expect_same(other.at.z, z, "z");
  expect_same(other.at.vx, vx, "vx");
}

// The period is longer than the lattice by what a shift may carry across it.
TEST_P(Symmetry, APeriodicBoxHasNoOrigin) {
  const std::vector<Placed> disks = placed(3);
  const double shift = 3.3, period = 8.1;
  std::vector<Placed> shifted = disks;
  for (Placed& disk : shifted) disk.x = std::fmod(disk.x + shift, period);
  const auto periodic = [&](std::vector<Placed> all) {
    Scene scene = scene_with(std::move(all), GetParam());
    scene.box.sides = PeriodicSides{};
    return after(scene, 2.5);
  };
  const State one = periodic(disks), other = periodic(shifted);
  EXPECT_EQ(one.counters.wall_collisions, 0U);
  EXPECT_EQ(one.counters.collisions(), other.counters.collisions());
  for (std::size_t i = 0; i < disks.size(); ++i)
    EXPECT_NEAR(std::remainder(other.at.x[i] - one.at.x[i] - shift, period), 0, tolerance) << i;
  expect_same(other.at.z, one.at.z, "z");
  expect_same(other.at.vx, one.at.vx, "vx");
}

INSTANTIATE_TEST_SUITE_P(Disks, Symmetry, testing::Values(false, true),
                         [](const testing::TestParamInfo<bool>& given) { return given.param ? "Rough" : "Smooth"; });

// Elastic disks above a floor that stands still, all velocities turned round, come back to where they began. The floor
// and gravity do not see the direction of time.
TEST(TimeReversal, BringsElasticDisksBack) {
  const std::vector<Placed> disks = placed(4);
  Scene scene = scene_with(disks, false);
  scene.box.floor = StillFloor{};
  const State there = after(scene, 2);
  EXPECT_GT(there.counters.disk_collisions, 20U);
  std::vector<Placed> turned;
  for (std::size_t i = 0; i < disks.size(); ++i)
    turned.push_back({there.at.x[i], there.at.z[i], -there.at.vx[i], -there.at.vz[i], 0, 0});
  Scene back = scene;
  back.start = PlacedStart{turned};
  const State again = after(back, 2);
  EXPECT_EQ(again.counters.collisions(), there.counters.collisions());
  for (std::size_t i = 0; i < disks.size(); ++i) {
    EXPECT_NEAR(again.at.x[i], disks[i].x, tolerance) << i;
    EXPECT_NEAR(again.at.z[i], disks[i].z, tolerance) << i;
    EXPECT_NEAR(again.at.vx[i], -disks[i].vx, tolerance) << i;
    EXPECT_NEAR(again.at.vz[i], -disks[i].vz, tolerance) << i;
  }
}

// Layers of half a D from 1/4 up: their heights are those of their middles, wherever in a layer its disks lie.
// Two that touch, a row of three and one alone, not in the order of their heights: 1, 4/3 and 0 neighbours a disk.
TEST(OrderLayers, CountTheNeighboursOfTheirOwnDisks) {
  Scene scene;
  scene.box.width = 20;
  DiskProperties disks;
  Snapshot at;
  at.x = {9, 2, 3, 15, 4, 10};
  at.z = {5.5, 0.5, 0.5, 9.5, 0.5, 5.5};
  disks.radius.assign(6, 0.5), disks.mass.assign(6, 1);
  at.vx.resize(6), at.vz.resize(6);
  OrderObserver order(scene, disks, 1, {0, 1, 11});
  order.observe(at);
  const auto layers = order.layers();
  ASSERT_EQ(layers.size(), 3U);
  EXPECT_DOUBLE_EQ(layers[0].neighbours, 4.0 / 3);
  EXPECT_DOUBLE_EQ(layers[1].neighbours, 1);
  EXPECT_DOUBLE_EQ(layers[2].neighbours, 0);
}

// Three rows of four, the highest in the last bins of the histogram, whose smoothing ends there.
TEST(OrderRows, ReachToTheEndOfTheirHistogram) {
  Scene scene;
  scene.box.width = 20;
  DiskProperties disks;
  Snapshot at;
  for (const double z : {0.5, 1.25, 1.995}) {
    for (int k = 0; k < 4; ++k) at.x.push_back(1 + 2 * k), at.z.push_back(z);
  }
  disks.radius.assign(12, 0.5), disks.mass.assign(12, 1);
  at.vx.resize(12), at.vz.resize(12);
  OrderObserver order(scene, disks, 1, {0, 0.5, 4});
  for (int look = 0; look < 100; ++look) order.observe(at);
  const auto rows = order.rows();
  ASSERT_EQ(rows.size(), 2U) << "the highest is not closed by one above it";
  EXPECT_NEAR(rows[0].height, 0.5, 1e-12);
  EXPECT_NEAR(rows[1].height, 1.25, 1e-12);
  EXPECT_NEAR(rows[0].disks, 4, 1e-12);
  EXPECT_NEAR(rows[1].disks, 4, 1e-12);
}

TEST(OrderLayers, StandAtTheMiddleOfWhatTheyCover) {
  Scene scene;
  scene.box.width = 10;
  DiskProperties disks;
  Snapshot at;
  for (const double z : {0.3, 0.3, 0.7, 1.2, 1.3, 1.74, 5.0}) {
    at.x.push_back(1.2 * static_cast<double>(at.x.size())), at.z.push_back(z);
    disks.radius.push_back(0.5), disks.mass.push_back(1);
  }
  at.vx.resize(at.x.size()), at.vz.resize(at.x.size());
  OrderObserver order(scene, disks, 1, {0.25, 0.5, 8});
  order.observe(at);
  const auto layers = order.layers();
  const std::pair<double, double> expected[] = {{0.5, 3}, {1.0, 1}, {1.5, 2}, {4.0, 1}};  // the last holds all above
  ASSERT_EQ(layers.size(), 4U);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(layers[k].height, expected[k].first, 1e-12) << k;
    EXPECT_NEAR(layers[k].share, expected[k].second / 7, 1e-12) << k;
  }
}

}  // namespace
}  // namespace shakebed::sim
