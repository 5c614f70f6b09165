#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <typeinfo>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/engine/start.hpp"

namespace shakebed::sim {
namespace {

Scene bed(std::uint32_t count, double width) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{count, 1, 1}};
  scene.disks.contact = {0.9, 0, 0};
  scene.disks.contact_duration = 1e-4;
  scene.box.width = width;
  scene.box.sides = HardSides{};
  scene.box.floor = SinusoidalFloor{0.8, 0.35};
  return scene;
}

std::string first_problem(const Scene& scene) {
  const auto problems = check(scene);
  return problems.empty() ? "" : problems[0].where;
}

TEST(SceneCheck, AcceptsAnOrdinaryBed) { EXPECT_TRUE(check(bed(300, 30)).empty()); }

TEST(SceneCheck, RefusesWhatCannotBe) {
  Scene s = bed(300, 0.5);
  EXPECT_EQ(first_problem(s), "/box/width");
  s = bed(300, 30);
  s.disks.contact.restitution = 1.2;
  EXPECT_EQ(first_problem(s), "/disks/restitution");
  s = bed(300, 30);
  s.box.top = Lid{1.5, {}};
  EXPECT_EQ(first_problem(s), "/box/lid");
  s = bed(300, 30);
  s.gravity = Weightless{};
  EXPECT_EQ(first_problem(s), "/box/lid");
  s = bed(300, 30);
  s.box.sides = PeriodicSides{};
  s.box.top = PeriodicTop{30};
  EXPECT_EQ(first_problem(s), "/box/height");
  s = bed(300, 30);
  s.gravity = Weightless{};
  s.box.sides = PeriodicSides{};
  s.box.top = PeriodicTop{30};
  EXPECT_EQ(first_problem(s), "/floor/motion");
  s = bed(300, 30);
  s.bath = WhiteNoiseBath{1, 0.1, true};
  s.disks.contact.restitution = 1;
  EXPECT_EQ(first_problem(s), "/bath");
  s = bed(300, 30);
  s.bath = LangevinBath{-1, 1, 1};
  EXPECT_EQ(first_problem(s), "/bath/temperature");
  s = bed(300, 30);
  s.box.floor = TabulatedFloor{2, {0, 0, 0, 0}};
  EXPECT_EQ(first_problem(s), "/floor/heights");
}

// A floor from a table rises to the highest of its positions: a disk of 1 D needs as much below the lid, and no more.
TEST(SceneCheck, LeavesRoomAboveTheHighestFloor) {
  Scene s = bed(3, 30);
  s.box.floor = TabulatedFloor{2, {0, 0.3, 0, -0.4}};
  s.box.top = Lid{1.31, {}};
  EXPECT_EQ(first_problem(s), "");
  s.box.top = Lid{1.29, {}};
  EXPECT_EQ(first_problem(s), "/box/lid");
  s.box.top = Lid{1.39, {}};
  s.box.floor = SinusoidalFloor{0.4, 0.35};
  EXPECT_EQ(first_problem(s), "/box/lid");
  s.box.top = Lid{1.41, {}};
  EXPECT_EQ(first_problem(s), "");
}

TEST(SceneCheck, RefusesMoreDisksThanTheBoxHolds) {
  Scene s = bed(300, 10);
  s.box.floor = StillFloor{};
  s.box.top = Lid{10, {}};
  EXPECT_EQ(first_problem(s), "/box");
}

// 80 disks cover 62.8 D^2, which is 0.9069 of 69.3 D^2: a box of 10 D below a lid at 8 D holds them while its floor
// rises by less than 1.07 D. Below a lid that gives way it holds them in any case.
TEST(SceneCheck, RefusesAFloorThatLeavesTooLittleRoomBelowTheLid) {
  Scene s = bed(80, 10);
  s.box.top = Lid{8, {}};
  s.box.floor = SinusoidalFloor{1.06, 0.35};
  EXPECT_EQ(first_problem(s), "");
  s.box.floor = SinusoidalFloor{1.08, 0.35};
  EXPECT_EQ(first_problem(s), "/box");
  s.box.floor = TabulatedFloor{2, {0, 1.08, 0, -1}};
  EXPECT_EQ(first_problem(s), "/box");
  s.box.floor = TabulatedFloor{2, {0, 1, 0, -1.08}};
  EXPECT_EQ(first_problem(s), "");
  s.box.floor = SinusoidalFloor{1.08, 0.35};
  s.box.top = Lid{8, {}, 20};
  EXPECT_EQ(first_problem(s), "");
}

TEST(Start, RefusesOverlappingDisksWithTheNumbers) {
  Scene s = bed(2, 10);
  s.start = PlacedStart{{{2, 3, 0, 0, 0, 0}, {2.5, 3, 0, 0, 0, 0}}};
  try {
    place_disks(s);
    FAIL() << "two overlapping disks were accepted";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("0.5 D"), std::string::npos) << error.what();
  }
}

TEST(Start, NeverOverlapsAndStaysInTheBox) {
  for (std::uint32_t count : {1u, 2u, 30u, 306u, 337u, 1000u}) {
    for (double width : {1.0, 3.7, 30.0, 43.3}) {
      for (int kind = 0; kind < 2; ++kind) {
        Scene s = bed(count, width);
        if (kind == 1) {
          if (width < 2) continue;
          s.start = RandomStart{};
        }
        const auto disks = place_disks(s);  // throws where anything overlaps or sticks out
        EXPECT_EQ(disks.size(), count);
      }
    }
  }
}

// Rows as far apart as the larger disks of 2 D need: at 1.1 of these, floor(21.1/2.2) = 9 a row in a box of 23.1 D.
TEST(Start, SpacingIsThatOfTheLargerDisks) {
  Scene s = bed(20, 23.1);
  s.disks.species = {{14, 1, 1}, {6, 2, 4}};
  s.box.floor = StillFloor{};
  s.start = HexagonalStart{0, 1.1};
  std::vector<double> lowest;
  for (const Placed& disk : place_disks(s))
    if (disk.z < 1.5) lowest.push_back(disk.x);
  std::sort(lowest.begin(), lowest.end());
  ASSERT_EQ(lowest.size(), 9U);
  for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(lowest[k], 1 + 2.2 * static_cast<double>(k), 1e-9);
}

TEST(Start, IsTheSameForTheSameSeedAndAnotherForAnother) {
  Scene s = bed(50, 10);
  s.start = RandomStart{};
  const auto a = place_disks(s), b = place_disks(s);
  s.seed = 2;
  const auto c = place_disks(s);
  EXPECT_EQ(a[7].x, b[7].x);
  EXPECT_EQ(a[7].vz, b[7].vz);
  EXPECT_NE(a[7].x, c[7].x);
}

// Every choice with every other: what cannot be is refused with a sentence, all else runs, keeps its ledger and lets
// nothing overlap. Only what is hot makes an engine of its own: 4 spaces x 3 rules x 2 sizes.
TEST(EveryChoice, RunsWithEveryOtherOnAtMost21Engines) {
  std::set<std::string> engines;
  int ran = 0, refused = 0;
  const std::vector<double> wave{0, 0.3, 0, -0.3, 0.1};
  const std::array<Gravity, 2> gravities{Weightless{}, UniformGravity{}};
  const std::array<Sides, 2> sides{HardSides{{0.95, 0, 0}}, PeriodicSides{}};
  const std::array<Top, 3> tops{OpenTop{}, Lid{12, {}}, PeriodicTop{12}};
  const std::array<Floor, 3> floors{StillFloor{}, SinusoidalFloor{0.4, 0.5}, TabulatedFloor{2, wave}};
  const std::array<Bath, 5> baths{NoBath{}, LangevinBath{1, 0.5, 0.25}, AndersenBath{1, 0.5},
                                  WhiteNoiseBath{0.5, 0.25, true}, ThermalFloor{1}};
  const std::array<Start, 3> starts{HexagonalStart{}, RandomStart{},
                                    PlacedStart{{{2, 2, 1, 0, 0, 0}, {4, 2, -1, 0.5, 0.2, 0}, {6, 5, 0, 1, 0, 0}}}};
  struct Contact {
    Surface surface;
    double inertia_ratio, duration;
  };
  const std::array<Contact, 5> contacts{Contact{{1, 0, 0}, 0.5, 0}, Contact{{0.9, 0, 0}, 0.5, 0},
                                        Contact{{0.9, 0, 0}, 0.5, 1e-3}, Contact{{0.9, 0.2, 0.4}, 0.5, 0},
                                        Contact{{0.9, 0.2, 0.4}, 0.4, 1e-3}};
  for (const Gravity& gravity : gravities)
    for (const Sides& side : sides)
      for (const Top& top : tops)
        for (const Floor& floor : floors)
          for (const Bath& bath : baths)
            for (const Start& start : starts)
              for (const Contact& contact : contacts)
                for (const bool two : {false, true}) {
                  Scene s;
                  s.gravity = gravity;
                  s.disks.species = {{10, 1, 1}};
                  if (two) s.disks.species.push_back({4, 0.6, 0.3});
                  s.disks.contact = contact.surface;
                  s.disks.inertia_ratio = contact.inertia_ratio;
                  s.disks.contact_duration = contact.duration;
                  // As the contact: only where nothing else dissipates is the elastic engine meant.
                  s.box = {8, side, top, floor, contact.surface};
                  if (auto* hard = std::get_if<HardSides>(&s.box.sides)) hard->surface = contact.surface;
                  s.bath = bath;
                  s.start = start;
                  const auto problems = check(s);
                  if (!problems.empty()) {
                    EXPECT_FALSE(problems[0].what.empty());
                    EXPECT_THROW(simulate(s), std::invalid_argument);
                    ++refused;
                    continue;
                  }
                  const auto simulation = simulate(s);
                  simulation->advance_to(0.75);
                  simulation->advance_to(1.5);
                  ++ran;
                  const Simulation& engine = *simulation;
                  engines.insert(typeid(engine).name());
                  const EnergyLedger e = simulation->energy();
                  ASSERT_LE(std::abs(e.imbalance()), 1e-11 * (std::abs(e.initial) + std::abs(e.kinetic) + e.dissipated +
                                                              std::abs(e.floor_work) + std::abs(e.bath_work)))
                      << ran;
                  ASSERT_LE(simulation->largest_overlap(), 1e-12) << ran;
                }
  std::printf("  %d combinations ran on %zu engines, %d were refused\n", ran, engines.size(), refused);
  EXPECT_EQ(engines.size(), 21u);
  EXPECT_GT(ran, 1000);
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace shakebed::sim
