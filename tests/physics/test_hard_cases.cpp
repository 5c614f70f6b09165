// Scenes on which event-driven simulations stall, overlap or lose energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "sim/engine/checkpoint_bytes.hpp"
#include "sim/engine/simulation.hpp"
#include "tests/physics/law.hpp"

namespace shakebed::sim::hard_cases_law {
namespace {

using tests::expect_law;

Scene bed(std::uint32_t count, double width, double restitution) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{count, 1, 1}};
  scene.disks.contact = {restitution, 0, 0};
  scene.box.width = width;
  scene.box.sides = HardSides{{restitution, 0, 0}};
  scene.box.floor_surface = {restitution, 0, 0};
  return scene;
}

// Springs of a pressed bed give way by no more than this in the beds of tests/bench/README.md [D].
constexpr double pressed_overlap = 2.5e-3;

// Runs to `until`, looking `looks` times: no overlap, nothing below the floor, the ledger closed, events bounded.
// most_events: a disk and unit of time, over the last half of the run.
// Returns the simulation as it stands then.
std::unique_ptr<Simulation> survive(const char* name, const Scene& scene, double until, int looks, double most_events,
                                    double most_overlap = 1e-12) {
  auto simulation = simulate(scene);
  const DiskProperties disks = simulation->properties();
  const double count = static_cast<double>(std::max<std::size_t>(disks.radius.size(), 1));
  const bool floor = !std::holds_alternative<PeriodicTop>(scene.box.top);
  double overlap = 0, depth = 0;
  std::uint64_t events_at_half = 0;
  Snapshot at;
  for (int k = 1; k <= looks; ++k) {
    simulation->advance_to(until * k / looks);
    simulation->snapshot(at);
    overlap = std::max(overlap, simulation->largest_overlap());
    for (std::size_t i = 0; floor && i < at.z.size(); ++i)
      depth = std::max(depth, at.floor_position + disks.radius[i] - at.z[i]);
    if (k == looks / 2) events_at_half = simulation->counters().events();
  }
  const EnergyLedger ledger = simulation->energy();
  const Counters counters = simulation->counters();
  double turned_over = std::abs(ledger.initial) + ledger.dissipated + std::abs(ledger.floor_work);
  if (turned_over == 0) turned_over = 1;
  const double rate = static_cast<double>(counters.events() - events_at_half) / (until / 2) / count;
  std::printf("  %s: %llu collisions, %llu locks relieved\n", name,
              static_cast<unsigned long long>(counters.collisions()),
              static_cast<unsigned long long>(counters.locks_relieved));
  expect_law("largest overlap [D]", overlap, 0, 0, most_overlap);
  expect_law("deepest below the floor [D]", depth, 0, 0, most_overlap);
  expect_law("energy ledger, of the energy turned over", ledger.imbalance() / turned_over, 0, 0, 1e-10);
  std::printf("  %-58s %.6g, at most %.6g\n", "events a disk and unit of time, last half", rate, most_events);
  EXPECT_LE(rate, most_events) << name;
  return simulation;
}

// The same as hard disks alone, then as a bed that may be pressed. Returns the latter.
std::unique_ptr<Simulation> survive_both(const char* name, Scene scene, double until, int looks, double most_events) {
  scene.presses = false;
  survive(name, scene, until, looks, most_events);
  scene.presses = true;
  return survive(name, scene, until, looks, most_events, pressed_overlap);
}

TEST(HardCases, ClosePackedStart) {
  Scene scene;
  scene.gravity = Weightless{};
  scene.disks.species = {{30 * 30, 1, 1}};
  const double a = std::sqrt(1 / (1 - 1e-10));  // phi = (1 - 1e-10) 2/sqrt 3
  scene.box.width = 30 * a;
  scene.box.sides = PeriodicSides{};
  scene.box.top = PeriodicTop{30 * a * std::numbers::sqrt3 / 2};
  scene.start = HexagonalStart{30, 0};
  survive("phi = (1 - 1e-10) 2/sqrt 3", scene, 1e-8, 10, 1e12);
}

// The middle disk of a triangle is hit by two at the same instant, again and again by symmetry.
TEST(HardCases, TripleContacts) {
  for (double e : {0.5, 1.0}) {
    Scene scene = bed(3, 12, e);
    const double c = std::numbers::sqrt3 / 2;
    scene.start =
        PlacedStart{{{6, 5, 0, 0, 0, 0}, {6 - 2, 5 + 4 * c, 1, -2 * c, 0, 0}, {6 + 2, 5 + 4 * c, -1, -2 * c, 0, 0}}};
    survive("two disks hit a third at once", scene, 50, 50, 2e5);
  }
}

TEST(HardCases, TouchingRowFillsTheWidth) {
  for (double duration : {0.0, 1e-4}) {
    for (double e : {0.0, 0.9, 1.0}) {
      Scene scene = bed(12, 12, e);
      scene.disks.contact_duration = duration;
      scene.start = PlacedStart{};
      for (int k = 0; k < 12; ++k)
        std::get<PlacedStart>(scene.start).disks.push_back({0.5 + k, 0.5, k == 3 ? 1.0 : 0.0, 1, 0, 0});
      survive(duration > 0 ? "full row with contact clock" : "full row", scene, 20, 20, 1e6);
    }
  }
}

TEST(HardCases, MassesOneToAMillion) {
  Scene scene = bed(0, 10, 1);
  scene.disks.species = {{30, 1, 1}, {30, 1, 1e6}};
  survive("masses 1:1e6", scene, 3, 20, 1e6);
}
TEST(HardCases, RadiiOneToFive) {
  Scene scene = bed(0, 30, 0.9);
  scene.disks.species = {{200, 1, 1}, {10, 5, 25}};
  scene.disks.contact_duration = 1e-3;
  scene.start = RandomStart{};
  survive("radii 1:5", scene, 50, 20, 1e5);
}
TEST(HardCases, TemperatureOfATrillionth) {
  Scene scene = bed(100, 12, 1);
  scene.start_temperature = 1e-12;
  survive("T = 1e-12, elastic", scene, 1e-3, 10, 1e9);
}
TEST(HardCases, GammaOfAThousand) {
  Scene scene = bed(100, 12, 0.9);
  scene.box.floor = SinusoidalFloor{1000 / std::pow(2 * std::numbers::pi, 2), 1};
  survive("Gamma = 1000", scene, 200, 50, 1e4);
}
// At e = 0.5 a hop of 1e-4 is followed by 9 ever shorter ones, 2e-4 in all: 5e4 events a unit of time.
TEST(HardCases, DiskAtRest) {
  for (double e : {0.0, 0.5, 1.0}) {
    Scene scene = bed(1, 4, e);
    scene.start = PlacedStart{{{2, 0.5, 0, 0, 0, 0}}};
    survive("a disk at rest on a still floor", scene, 10, 20, 5.1e4);
    scene.box.floor = SinusoidalFloor{0.01, 1};
    survive("a disk at rest, Gamma = 0.39", scene, 10, 20, 5.1e4);
  }
}
TEST(HardCases, NoDiskAndOneDisk) {
  Scene scene = bed(0, 4, 0.9);
  const auto empty = simulate(scene);
  empty->advance_to(100);
  EXPECT_EQ(empty->counters().collisions(), 0U);
  EXPECT_EQ(empty->time(), 100);
  survive("one disk, elastic", bed(1, 4, 1), 1000, 20, 1e3);
}
TEST(HardCases, ColumnOfTwentyComesToRest) {
  Scene scene = bed(20, 1.5, 0.1);
  scene.disks.contact_duration = 1e-3;
  scene.start = PlacedStart{};
  for (int k = 0; k < 20; ++k) std::get<PlacedStart>(scene.start).disks.push_back({0.75, 0.5 + 1.2 * k, 0, 0, 0, 0});
  survive("column of 20, e = 0.1", scene, 40, 40, 1e5);
}
TEST(HardCases, BedAtRestOnAGentleFloor) {
  Scene scene = bed(200, 20.4, 0.7);
  scene.disks.contact_duration = 1e-3;
  scene.start_temperature = 0.01;
  scene.box.floor = SinusoidalFloor{0.8 / std::pow(2 * std::numbers::pi, 2), 1};
  survive_both("Gamma = 0.8, bed of 200", scene, 8, 16, 1e5);
}

// 5,000 disks rain down from up to 130 D, 30 m g D each, and come to rest: at the end a disk has less than lifts it by
// a hundredth of its diameter.
TEST(HardCases, HeapOfFiveThousandComesToRest) {
  Scene scene = bed(5000, 100, 0.3);
  scene.disks.contact_duration = 1e-2;
  scene.start = RandomStart{};
  scene.start_temperature = 1;
  const auto heap = survive_both("heap of 5,000, e = 0.3", scene, 40, 8, 2e3);
  expect_law("kinetic energy a disk [m g D]", heap->energy().kinetic / 5000, 0, 0, 1e-2);
}

// Every disk of a triangular lattice is hit from below at once by the row that a floor throws up: contacts of equal
// times everywhere.
TEST(HardCases, LatticeHitAtOneInstant) {
  for (const double e : {0.6, 1.0}) {
    Scene scene = bed(80, 10, e);
    scene.box.sides = PeriodicSides{};
    scene.disks.contact_duration = e < 1 ? 1e-3 : 0;
    scene.start = PlacedStart{};
    for (int k = 0; k < 80; ++k) {
      const int row = k / 10;
      std::get<PlacedStart>(scene.start)
          .disks.push_back({k % 10 + 0.25 + 0.5 * (row % 2), 0.5 + row * (std::numbers::sqrt3 / 2 + 0.01) + 0.01, 0,
                            row == 0 ? 2.0 : 0.0, 0, 0});
    }
    // A disk's width of free room a row, so that rows are not locked.
    scene.box.width = 10.5;
    survive_both("lattice hit by its lowest row", scene, 20, 40, 1e5);
  }
}

// The clock is counted from the last synchronisation, so its resolution is the same after 1e10 collisions as after 1e4:
// the same state put 2^33 synchronisation intervals later goes on to the same bytes.
TEST(HardCases, ClockIsAsFineAfterTenBillionCollisions) {
  Scene scene = bed(200, 20, 0.9);
  scene.disks.contact_duration = 1e-4;
  scene.box.floor = SinusoidalFloor{0.8, 0.35};
  scene.start_temperature = 0.01;
  const auto early = simulate(scene);
  for (int k = 0; k < 5; ++k) early->advance_to(early->next_synchronisation());
  const auto late = simulate(scene);
  constexpr std::uint64_t intervals = std::uint64_t{1} << 33;
  late->restore(checkpoint_bytes::put_later(early->checkpoint(), intervals));
  ASSERT_NEAR(late->time(), early->time() + static_cast<double>(intervals) / 0.35, 1e-9 * late->time());
  const std::uint64_t before = early->counters().collisions();
  for (int k = 0; k < 20; ++k) {
    early->advance_to(early->next_synchronisation());
    late->advance_to(late->next_synchronisation());
  }
  Snapshot a, b;
  early->snapshot(a);
  late->snapshot(b);
  const double rate = static_cast<double>(early->counters().collisions()) / early->time();
  std::printf("  %.3g collisions at time %.6g; the late run at time %.6g, where there would have been %.3g\n",
              static_cast<double>(early->counters().collisions() - before), a.time, b.time, rate * b.time);
  EXPECT_GT(rate * b.time, 1e10);
  EXPECT_EQ(early->counters().collisions(), late->counters().collisions());
  EXPECT_TRUE(a.x == b.x && a.z == b.z && a.vx == b.vx && a.vz == b.vz);
}

}  // namespace
}  // namespace shakebed::sim::hard_cases_law
