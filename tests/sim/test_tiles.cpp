// Large beds go on tile by tile, and take back what they took too early. What comes out must be the history that the
// order of time gives: a watched bed goes on in that order.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "sim/engine/simulation.hpp"

namespace shakebed::sim {
namespace {

class Nobody final : public Watcher {
  void flies(double, std::uint32_t, double, double, double, double) override {}
  void touched(double, double, double, double, double, double, double) override {}
  void pressed(double, double, double, double, double, double, double) override {}
  void touched_wall(double, std::uint32_t, bool, double, double, double) override {}
};

// 409,600 disks, a sixteenth of them smaller and lighter if they are mixed.
Scene large_fluid(double area_fraction, bool mixed = false) {
  constexpr std::uint32_t rows = 640;
  const double spacing = std::sqrt(std::numbers::pi / 4 / area_fraction * 2 / std::numbers::sqrt3);
  Scene scene;
  scene.gravity = Weightless{};
  scene.disks.species = {{rows * rows, 1, 1}};
  if (mixed) scene.disks.species = {{rows * rows / 16 * 15, 1, 1}, {rows * rows / 16, 0.6, 0.36}};
  scene.box.width = rows * spacing;
  scene.box.sides = PeriodicSides{};
  scene.box.top = PeriodicTop{rows * spacing * std::numbers::sqrt3 / 2};
  scene.start = HexagonalStart{rows, 0};
  return scene;
}

// Largest distance between the places of one disk in both, over all disks.
double largest_difference(const Simulation& a, const Simulation& b, double width, double height) {
  Snapshot sa, sb;
  a.snapshot(sa);
  b.snapshot(sb);
  double largest = 0;
  for (std::size_t i = 0; i < sa.x.size(); ++i)
    largest = std::max(largest,
                       std::hypot(std::remainder(sa.x[i] - sb.x[i], width), std::remainder(sa.z[i] - sb.z[i], height)));
  return largest;
}

// Of so many contacts a disk: as long as rounding has not grown to what could be seen. Every contact counts, and the
// tiles must have been used, or not even the rounding would differ.
void expect_the_history_of_the_order_of_time(const Scene& scene, double end, double contacts) {
  const double height = std::get<PeriodicTop>(scene.box.top).height;
  const auto tiled = simulate(scene), in_time = simulate(scene);
  Nobody nobody;
  in_time->watch(&nobody);
  for (double time = end / 5; time < 1.01 * end; time += end / 5) tiled->advance_to(time);
  in_time->advance_to(tiled->time());
  const Counters a = tiled->counters(), b = in_time->counters();
  EXPECT_GT(static_cast<double>(a.disk_collisions), contacts * scene.count());
  EXPECT_EQ(a.disk_collisions, b.disk_collisions);
  EXPECT_NEAR(a.virial, b.virial, 1e-10 * b.virial);
  EXPECT_NEAR(tiled->energy().kinetic, in_time->energy().kinetic, 1e-11 * in_time->energy().kinetic);
  const double difference = largest_difference(*tiled, *in_time, scene.box.width, height);
  EXPECT_GT(difference, 0);
  EXPECT_LT(difference, 1e-7);
  EXPECT_EQ(tiled->largest_overlap(), 0);
}
TEST(Tiles, GiveTheHistoryOfTheOrderOfTime) { expect_the_history_of_the_order_of_time(large_fluid(0.70), 0.25, 1.5); }
TEST(Tiles, GiveItForLonger) { expect_the_history_of_the_order_of_time(large_fluid(0.70), 0.55, 4); }
TEST(Tiles, GiveItForMixturesToo) { expect_the_history_of_the_order_of_time(large_fluid(0.70, true), 0.6, 4); }
TEST(Tiles, GiveItForACrystalToo) { expect_the_history_of_the_order_of_time(large_fluid(0.85), 0.15, 4); }
TEST(Tiles, GiveItForAThinFluidToo) { expect_the_history_of_the_order_of_time(large_fluid(0.50), 1.4, 4); }

// Somebody begins to watch: from then on there are no tiles any more, and nothing is lost.
TEST(Tiles, EndWhenSomebodyWatches) {
  const Scene scene = large_fluid(0.70);
  const auto late = simulate(scene), early = simulate(scene);
  Nobody nobody;
  early->watch(&nobody);
  late->advance_to(0.13);
  late->watch(&nobody);
  for (const auto& one : {late.get(), early.get()}) one->advance_to(0.25);
  EXPECT_EQ(late->counters().disk_collisions, early->counters().disk_collisions);
  const double difference =
      largest_difference(*late, *early, scene.box.width, std::get<PeriodicTop>(scene.box.top).height);
  EXPECT_GT(difference, 0);
  EXPECT_LT(difference, 1e-7);
}

void expect_the_same_bytes(const Simulation& one, const Simulation& other) {
  Snapshot a, b;
  one.snapshot(a);
  other.snapshot(b);
  EXPECT_TRUE(a.x == b.x && a.z == b.z && a.vx == b.vx && a.vz == b.vz);
  EXPECT_EQ(one.counters().virial, other.counters().virial);
}
TEST(Tiles, GiveTheSameBytesAgain) {
  const Scene scene = large_fluid(0.70);
  const auto first = simulate(scene), second = simulate(scene);
  for (const auto& one : {first.get(), second.get()}) one->advance_to(0.2);
  expect_the_same_bytes(*first, *second);
}
// After 150 contacts a disk and a dozen new shells.
TEST(Tiles, GoOnFromACheckpointToTheSameBytes) {
  const Scene scene = large_fluid(0.70);
  const auto whole = simulate(scene), second = simulate(scene);
  whole->advance_to(whole->next_synchronisation());
  EXPECT_GT(static_cast<double>(whole->counters().disk_collisions), 140.0 * scene.count());
  EXPECT_EQ(whole->largest_overlap(), 0);
  EXPECT_NEAR(whole->energy().kinetic, scene.count(), 1e-9 * scene.count());
  second->restore(whole->checkpoint());
  const double until = whole->time() + 0.2;
  for (const auto& one : {whole.get(), second.get()}) one->advance_to(until);
  expect_the_same_bytes(*whole, *second);
}

}  // namespace
}  // namespace shakebed::sim
