// What a scene is allowed to be, on both sides of every limit; where disks begin, by pencil; reservoirs of disks that
// are not of mass 1; rows and columns that lock.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "sim/engine/overlap.hpp"
#include "sim/engine/random.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/engine/start.hpp"
#include "tests/sim/snapshot_of.hpp"

namespace shakebed::sim::starts_by_hand {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

// Ten disks between hard sides under gravity on a floor at rest.
Scene plain() {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{10, 1, 1}};
  scene.disks.contact = {0.9, 0, 0};
  scene.box.width = 8;
  scene.box.sides = HardSides{};
  return scene;
}
// Without gravity, periodic both ways.
Scene weightless(double width, double height) {
  Scene scene = plain();
  scene.gravity = Weightless{};
  scene.box.width = width;
  scene.box.sides = PeriodicSides{};
  scene.box.top = PeriodicTop{height};
  return scene;
}
std::vector<std::string> places(const Scene& scene) {
  std::vector<std::string> where;
  for (const SceneProblem& problem : check(scene)) where.push_back(problem.where);
  return where;
}

// A number of a scene: allowed at `good`, refused at `bad`, and where first.
struct Limit {
  std::string where;
  std::vector<double> good, bad;
  std::function<void(Scene&, double)> set;
};
void expect_limits(const std::vector<Limit>& limits, const Scene& base) {
  for (const Limit& limit : limits) {
    for (const double value : limit.good) {
      Scene scene = base;
      limit.set(scene, value);
      EXPECT_EQ(places(scene), std::vector<std::string>{}) << limit.where << " " << value;
    }
    for (const double value : limit.bad) {
      Scene scene = base;
      limit.set(scene, value);
      const std::vector<std::string> found = places(scene);
      ASSERT_FALSE(found.empty()) << limit.where << " " << value;
      EXPECT_EQ(found.front(), limit.where) << value;
    }
  }
}

TEST(SceneLimits, OfDisksAndTheirContacts) {
  expect_limits(
      {{"/disks/diameter",
        {1e-3},
        {0, -1, infinite},
        [](Scene& s, double v) {
          s.disks.species.push_back({1, v, 1});
        }},
       {"/disks/mass",
        {1e-3, 1e6},
        {0, -1, infinite},
        [](Scene& s, double v) {
          s.disks.species.push_back({1, 1, v});
        }},
       {"/disks/restitution", {0, 1}, {-1e-9, 1 + 1e-9}, [](Scene& s, double v) { s.disks.contact.restitution = v; }},
       {"/disks/restitution",
        {1e-9, 1},
        {0},
        [](Scene& s, double v) {
          s.disks.contact = {v, 0, 0, RestitutionLaw::viscoelastic};
        }},
       {"/disks/restitution_speed",
        {1e-9, 9},
        {0, -1, infinite},
        [](Scene& s, double v) { s.disks.contact.law_speed = v; }},
       {"/disks/friction", {0, 50}, {-1e-9, infinite}, [](Scene& s, double v) { s.disks.contact.friction = v; }},
       {"/disks/tangential_restitution",
        {-1, 1},
        {-1 - 1e-9, 1 + 1e-9},
        [](Scene& s, double v) { s.disks.contact.tangential_restitution = v; }},
       {"/disks/inertia", {1e-9, 1}, {0, 1 + 1e-9}, [](Scene& s, double v) { s.disks.inertia_ratio = v; }},
       {"/disks/contact_duration", {0, 3}, {-1e-9, infinite}, [](Scene& s, double v) { s.disks.contact_duration = v; }},
       {"/disks/count",
        {268435455},
        {268435456},
        [](Scene& s, double v) { s.disks.species[0].count = static_cast<std::uint32_t>(v); }},
       {"/floor/friction", {0}, {-1e-9}, [](Scene& s, double v) { s.box.floor_surface.friction = v; }},
       {"/box/sides/restitution",
        {0, 1},
        {1.1},
        [](Scene& s, double v) {
          s.box.sides = HardSides{{v, 0, 0}};
        }},
       {"/box/lid/restitution",
        {0, 1},
        {1.1},
        [](Scene& s, double v) {
          s.box.top = Lid{9, {v, 0, 0}};
        }}},
      plain());
  Scene none = plain();
  none.disks.species.clear();
  EXPECT_EQ(places(none), std::vector<std::string>{"/disks"});
  none.disks.species.assign(3, {1, 1, 1});
  EXPECT_EQ(places(none), std::vector<std::string>{"/disks"});
}

TEST(SceneLimits, OfTheBoxAndItsFloor) {
  const auto wide = [](Scene& s, double v) { s.box.width = v; };
  expect_limits(
      {{"/box/width", {1, 1e8}, {1 - 1e-9, infinite}, wide},
       {"/box", {}, {1.1e9}, wide},
       {"/box/width",
        {2 + 1e-9},
        {2 - 1e-9},
        [](Scene& s, double v) {
          s.disks.species.push_back({1, 2, 1}), s.box.width = v;
        }},
       {"/box/width", {5}, {4.999}, [](Scene& s, double v) { s.box.sides = PeriodicSides{}, s.box.width = v; }},
       {"/box/sides/slope",
        {0, 1e-3, 1.2},
        {0.9e-3, 1.21, -0.1},
        [](Scene& s, double v) {
          s.box.sides = HardSides{{}, v};
        }},
       {"/floor/amplitude",
        {1e-9, 5},
        {0, -1},
        [](Scene& s, double v) {
          s.box.floor = SinusoidalFloor{v, 0.3};
        }},
       {"/floor/frequency",
        {1e-3},
        {0, -1, infinite},
        [](Scene& s, double v) {
          s.box.floor = SinusoidalFloor{1, v};
        }},
       {"/floor",
        {1e9},
        {1.1e9},
        [](Scene& s, double v) {
          s.box.floor = SinusoidalFloor{v, 0.3};
        }},
       {"/floor/period",
        {1e-3},
        {0, -1, infinite},
        [](Scene& s, double v) {
          s.box.floor = TabulatedFloor{v, {0, 1, 0, -1}};
        }},
       {"/floor/heights",
        {4, 5},
        {3},
        [](Scene& s, double v) {
          TabulatedFloor table{2, {0, 1, 0, -1, 0.5}};
          table.heights.resize(static_cast<std::size_t>(v));
          s.box.floor = table;
        }},
       {"/floor/heights",
        {0.1},
        {infinite},
        [](Scene& s, double v) {
          s.box.floor = TabulatedFloor{2, {0, 1, v, -1}};
        }}},
      plain());
  // Periodic upwards: twice the largest disk and 3 D, and nothing that needs a floor.
  expect_limits({{"/box/height", {5}, {4.999}, [](Scene& s, double v) { s.box.top = PeriodicTop{v}; }},
                 {"/box", {1e9}, {1.1e9}, [](Scene& s, double v) { s.box.top = PeriodicTop{v}; }}},
                weightless(8, 8));
  Scene scene = weightless(8, 8);
  scene.box.sides = HardSides{};
  EXPECT_EQ(places(scene), std::vector<std::string>{"/box/sides"});
  scene = weightless(8, 8);
  scene.bath = ThermalFloor{1};
  EXPECT_EQ(places(scene), std::vector<std::string>{"/bath"});
}

TEST(SceneLimits, OfReservoirsAndOfRoom) {
  expect_limits({{"/bath/temperature",
                  {1e-9},
                  {0, infinite},
                  [](Scene& s, double v) {
                    s.bath = LangevinBath{v, 1, 1};
                  }},
                 {"/bath/rate",
                  {1e-9},
                  {0, infinite},
                  [](Scene& s, double v) {
                    s.bath = LangevinBath{1, v, 1};
                  }},
                 {"/bath/interval",
                  {1e-9},
                  {0, infinite},
                  [](Scene& s, double v) {
                    s.bath = LangevinBath{1, 1, v};
                  }},
                 {"/bath/temperature",
                  {1e-9},
                  {0, infinite},
                  [](Scene& s, double v) {
                    s.bath = AndersenBath{v, 1};
                  }},
                 {"/bath/rate",
                  {1e-9},
                  {0, infinite},
                  [](Scene& s, double v) {
                    s.bath = AndersenBath{1, v};
                  }},
                 {"/bath/heating",
                  {1e-9},
                  {0, infinite},
                  [](Scene& s, double v) {
                    s.bath = WhiteNoiseBath{v, 1, true};
                  }},
                 {"/bath/interval",
                  {1e-9},
                  {0, infinite},
                  [](Scene& s, double v) {
                    s.bath = WhiteNoiseBath{1, v, true};
                  }},
                 {"/bath/temperature", {1e-9}, {0, infinite}, [](Scene& s, double v) { s.bath = ThermalFloor{v}; }},
                 // 10 disks of 1 D and 10 of 0.5 D cover 12.5 pi/4: pi/(2 sqrt 3) of a box of 8 x 12.5 sqrt(3)/16 D.
                 // = 1.0825 D high.
                 {"/box",
                  {1.3532},
                  {1.3531},
                  [](Scene& s, double v) {
                    s.disks.species.push_back({10, 0.5, 0.125}), s.box.top = Lid{v, {}};
                  }},
                 {"/box/plates/contact_radius",
                  {0, 0.25},
                  {-1e-9, 0.251},
                  [](Scene& s, double v) {
                    s.disks.species.push_back({10, 0.5, 0.125});
                    s.box.plates = RubbingPlates{0.3, 0.01, true, v};
                  }}},
                plain());
}

// ---------------------------------------------------------------------------------------------------------------------
// starts

// a: from centre to centre in a row; up: from row to row; disks a row; first centre.
void expect_rows(const std::vector<Placed>& disks, std::size_t a_row, double a, double up, double x0, double z0) {
  for (std::size_t k = 0; k < disks.size(); ++k) {
    const std::size_t row = k / a_row;
    EXPECT_NEAR(disks[k].x, x0 + (static_cast<double>(k % a_row) + (row % 2 == 1 ? 0.5 : 0)) * a, 1e-8) << k;
    EXPECT_NEAR(disks[k].z, z0 + static_cast<double>(row) * up, 1e-6 * (1 + static_cast<double>(row))) << k;
  }
}

TEST(StartByHand, IsRowsFromWallToWall) {
  Scene scene = plain();
  scene.box.width = 5.3;  // four disks and half a one more: 4.3 D for 3.5 spacings
  const double a = 4.3 / 3.5;
  expect_rows(place_disks(scene), 4, a, std::sqrt(1 + 1e-6 - a * a / 4), 0.5, 0.5);
  scene.box.floor = TabulatedFloor{2, {0.3, 0, -0.3, 0}};
  expect_rows(place_disks(scene), 4, a, std::sqrt(1 + 1e-6 - a * a / 4), 0.5, 0.8);
  scene.box.floor = StillFloor{};
  scene.box.sides = PeriodicSides{};  // five of 1.06 D
  expect_rows(place_disks(scene), 5, 1.06, std::sqrt(1 + 1e-6 - 0.53 * 0.53), 0.265, 0.5);
  scene.start = HexagonalStart{3, 0};
  scene.disks.species[0].count = 3;
  expect_rows(place_disks(scene), 3, 5.3 / 3, 0, 5.3 / 12, 0.5);
  scene.disks.species[0].count = 10;
  scene.start = HexagonalStart{3, 1.2};
  expect_rows(place_disks(scene), 3, 1.2, std::sqrt(1 + 1e-6 - 0.36), 0.3, 0.5);
}

// Few disks a row: the row after the next stands above the same places, and so no lower than a diameter.
TEST(StartByHand, KeepsRowsApartThatStandAboveOneAnother) {
  Scene scene = plain();
  scene.box.width = 5.3;
  scene.box.sides = PeriodicSides{};
  for (const std::uint32_t a_row : {1U, 2U, 3U}) {
    scene.start = HexagonalStart{a_row, 0};
    expect_rows(place_disks(scene), a_row, 5.3 / a_row, 0.5, 5.3 / (4 * a_row), 0.5);
  }
  scene.start = HexagonalStart{2, 1.9};
  expect_rows(place_disks(scene), 2, 1.9, 0.5, 1.9 / 4, 0.5);
}

TEST(StartByHand, FillsAClosedBoxEvenly) {
  Scene scene = plain();
  scene.box.width = 5.3;
  scene.box.top = Lid{4, {}};  // 4.3 x 3 D for centres: four a row, three rows
  expect_rows(place_disks(scene), 4, 4.3 / 3.5, 1.5, 0.5, 0.5);
  scene.box.floor = TabulatedFloor{2, {0.4, 0, -0.4, 0}};
  expect_rows(place_disks(scene), 4, 4.3 / 3.5, 1.3, 0.5, 0.9);
  Scene fluid = weightless(8, 7);
  fluid.disks.species[0].count = 13;  // hexagons of side 2.23 D: four a row, four rows
  expect_rows(place_disks(fluid), 4, 2, 7.0 / 4, 0.5, 7.0 / 8);
  fluid.disks.species[0].count = 9;  // three a row; a fourth row, since across the border rows must alternate
  expect_rows(place_disks(fluid), 3, 8.0 / 3, 7.0 / 4, 2.0 / 3, 7.0 / 8);
}

TEST(StartByHand, RefusesRowsThatDoNotFit) {
  const auto said = [](const Scene& scene) {
    try {
      place_disks(scene);
      return std::string();
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
  };
  Scene scene = plain();
  scene.start = HexagonalStart{9, 0};  // 7 D for 8.5 spacings
  EXPECT_EQ(
      said(scene),
      "9 disks a row are 0.823529 D apart, but their diameter is up to 1 D. Give fewer disks a row and a spacing of "
      "at least 1, or 0 for both: as many as fit");
  scene.start = HexagonalStart{0, 0.5};  // as many as fit at half a diameter
  EXPECT_EQ(said(scene),
            "14 disks a row are 0.5 D apart, but their diameter is up to 1 D. Give fewer disks a row and a spacing of "
            "at least 1, or 0 for both: as many as fit");
  scene.start = HexagonalStart{7, 0};
  EXPECT_EQ(said(scene), "");
  Scene fluid = weightless(6, 6);
  fluid.disks.species[0].count = 36;  // six a row, six rows of 1 D: there is room
  fluid.start = HexagonalStart{6, 0};
  EXPECT_EQ(said(fluid), "");
  fluid.disks.species[0].count = 48;  // eight rows of 0.75 D
  EXPECT_EQ(said(fluid).substr(0, 37), "48 disks of up to 1 D do not fit into");
  fluid.disks.species[0].count = 42;
  fluid.start = HexagonalStart{3, 0};  // fourteen rows of 0.43 D
  EXPECT_EQ(said(fluid).substr(0, 37), "42 disks of up to 1 D do not fit into");
}

// Under gravity each velocity is drawn alone; without it momentum is 0 and T exact.
TEST(StartByHand, GivesVelocitiesOfItsTemperature) {
  Scene scene = plain();
  scene.disks.species = {{10, 1, 4}};
  scene.start_temperature = 2.5;
  scene.seed = 77;
  Random random(77);
  for (const Placed& disk : place_disks(scene)) {
    const auto [x, z] = random.normal_pair();
    EXPECT_NEAR(disk.vx, std::sqrt(2.5 / 4) * x, 1e-14);
    EXPECT_NEAR(disk.vz, std::sqrt(2.5 / 4) * z, 1e-14);
  }
  Scene fluid = weightless(9, 9);
  fluid.disks.species = {{7, 1, 1}, {5, 0.5, 0.25}};
  fluid.start_temperature = 1.5;
  double px = 0, pz = 0, energy = 0;
  int light = 0;
  for (const Placed& disk : place_disks(fluid)) {
    const double m = disk.species == 1 ? 0.25 : 1;
    light += disk.species == 1;
    px += m * disk.vx, pz += m * disk.vz, energy += m * (disk.vx * disk.vx + disk.vz * disk.vz) / 2;
  }
  EXPECT_EQ(light, 5);
  EXPECT_NEAR(px, 0, 1e-13);
  EXPECT_NEAR(pz, 0, 1e-13);
  EXPECT_NEAR(energy, 12 * 1.5, 1e-12);
}

// 400 disks of 1 D at random: their centres fill what they may, to less than a diameter.
TEST(StartByHand, FillsItsHeightAtRandom) {
  Scene scene = plain();
  scene.disks.species[0].count = 400;
  scene.box.width = 40;
  const auto reach = [&](double height) {
    scene.start = RandomStart{height};
    std::array<double, 4> ends{infinite, -infinite, infinite, -infinite};
    for (const Placed& disk : place_disks(scene)) {
      ends = {std::min(ends[0], disk.x), std::max(ends[1], disk.x), std::min(ends[2], disk.z),
              std::max(ends[3], disk.z)};
    }
    return ends;
  };
  const auto expect = [&](double height, double left, double right, double low, double high) {
    const auto ends = reach(height);
    EXPECT_GE(ends[0], left);
    EXPECT_LT(ends[0], left + 1);
    EXPECT_LE(ends[1], right);
    EXPECT_GT(ends[1], right - 1);
    EXPECT_GE(ends[2], low);
    EXPECT_LT(ends[2], low + 1);
    EXPECT_LE(ends[3], high);
    EXPECT_GT(ends[3], high - 1);
  };
  const double third = 400 * std::numbers::pi / 4 / (0.3 * 40) + 1;  // three tenths covered, and one disk more
  expect(0, 0.5, 39.5, 0.5, third - 0.5);
  expect(60, 0.5, 39.5, 0.5, 59.5);
  scene.box.top = Lid{30, {}};
  expect(0, 0.5, 39.5, 0.5, 29.5);
  expect(25, 0.5, 39.5, 0.5, 24.5);
  expect(60, 0.5, 39.5, 0.5, 29.5);
  scene = weightless(40, 30);
  scene.disks.species[0].count = 400;
  expect(0, 0, 40, 0, 30);
}

// Disks placed at random one after the other jam at a covered fraction of 0.547: 0.65 cannot be filled so.
TEST(StartByHand, FillsNoMoreThanOneAfterTheOtherCan) {
  Scene scene = weightless(20, 20);
  scene.start = RandomStart{};
  scene.disks.species[0].count = 230;
  EXPECT_EQ(place_disks(scene).size(), 230U) << "0.45 of the area";
  scene.disks.species[0].count = 331;
  EXPECT_THAT([&] { place_disks(scene); }, testing::ThrowsMessage<std::runtime_error>(
                                               testing::HasSubstr("no place for a disk after 20,000 attempts")));
}

// Every limit of a place, one disk of 2 D: 1e-12 of the width and 1e-12 D are rounding.
TEST(StartByHand, AcceptsWhatIsInTheBox) {
  Scene scene = plain();
  scene.disks.species = {{1, 2, 1}};
  scene.box.top = Lid{6, {}};
  const auto accepted = [&](double x, double z, std::uint32_t species = 0) {
    scene.start = PlacedStart{{{x, z, 0, 0, 0, species}}};
    try {
      place_disks(scene);
      return true;
    } catch (const std::runtime_error&) {
      return false;
    }
  };
  for (const double x : {1.0, 7.0, 1 - 4e-12, 7 + 4e-12}) EXPECT_TRUE(accepted(x, 3)) << x;
  for (const double x : {1 - 1e-10, 7 + 1e-10, std::nan(""), infinite}) EXPECT_FALSE(accepted(x, 3)) << x;
  for (const double z : {1.0, 5.0}) EXPECT_TRUE(accepted(4, z)) << z;
  for (const double z : {1 - 1e-11, 5 + 1e-11, std::nan("")}) EXPECT_FALSE(accepted(4, z)) << z;
  EXPECT_FALSE(accepted(4, 3, 1)) << "there is one species";
  scene.box.top = OpenTop{};
  scene.box.sides = HardSides{{}, 0.5};  // a side is met at a horizontal distance of r/cos - z tan
  const double from = 1 / std::cos(0.5) - 3 * std::tan(0.5);
  EXPECT_TRUE(accepted(from + 1e-9, 3));
  EXPECT_FALSE(accepted(from - 1e-9, 3));
  EXPECT_TRUE(accepted(8 - from - 1e-9, 3));
  EXPECT_FALSE(accepted(8 - from + 1e-9, 3));
}

// The deepest overlap of all pairs and images.
TEST(OverlapByHand, IsThatOfAllPairs) {
  for (const auto& [width, height] : {std::array{5.2, 0.0}, {0.0, 0.0}, {7.9, 6.3}, {0.0, 5.5}}) {
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      Random random(seed);
      Snapshot at;
      std::vector<double> radii;
      for (int i = 0; i < 9; ++i) {
        at.x.push_back((width > 0 ? width : 8) * random.uniform() - (width > 0 ? 0 : 3));
        at.z.push_back((height > 0 ? height : 8) * random.uniform() - (height > 0 ? 0 : 3));
        radii.push_back(i % 2 == 0 ? 0.5 : 0.3);
      }
      double deepest = 0;
      for (std::size_t i = 0; i < 9; ++i) {
        for (std::size_t k = 0; k < i; ++k) {
          double dx = at.x[k] - at.x[i], dz = at.z[k] - at.z[i];
          if (width > 0) dx = std::remainder(dx, width);
          if (height > 0) dz = std::remainder(dz, height);
          deepest = std::max(deepest, radii[i] + radii[k] - std::hypot(dx, dz));
        }
      }
      EXPECT_NEAR(largest_overlap(at, radii, width, height), deepest, 1e-12) << width << " " << seed;
    }
  }
  EXPECT_EQ(largest_overlap({}, {}, 0, 0), 0);
}

// ---------------------------------------------------------------------------------------------------------------------
// reservoirs of masses other than 1

constexpr std::uint64_t stream = 0x6261746800000000;  // of a scene's seed, for its reservoir

// A disk of mass 1 and one of 1/4, which meet nothing.
Scene two_masses(const Bath& bath) {
  Scene scene = weightless(20, 20);
  scene.disks.species = {{1, 1, 1}, {1, 0.5, 0.25}};
  scene.bath = bath;
  scene.seed = 9;
  scene.start = PlacedStart{{{3, 4, 0.5, -0.25, 0, 0}, {12, 14, 0.125, 0.25, 0, 1}}};
  return scene;
}
void expect_ledger(const Simulation& run) {
  const Snapshot at = snapshot_of(run);
  double energy = 0;
  for (std::size_t i = 0; i < 2; ++i) energy += (i == 0 ? 0.5 : 0.125) * (at.vx[i] * at.vx[i] + at.vz[i] * at.vz[i]);
  const double before = 0.5 * 0.3125 + 0.125 * (0.015625 + 0.0625);
  EXPECT_NEAR(run.energy().kinetic, energy, 1e-14);
  EXPECT_NEAR(run.energy().initial, before, 1e-15);
  EXPECT_NEAR(run.energy().bath_work, energy - before, 1e-13);
}

// Kicks go as 1/sqrt(m), and their temperature may be changed.
TEST(BathsByHand, OfLangevinKickByTheMass) {
  const auto run = simulate(two_masses(LangevinBath{1.5, 2, 0.1}));
  run->advance_to(0.05);
  run->set_bath_temperature(6);
  run->advance_to(0.15);
  Random random(9 ^ stream);
  const Random::Pair one = random.normal_pair(), two = random.normal_pair();
  const Snapshot at = snapshot_of(*run);
  const double keep = std::exp(-0.2), give = std::sqrt(6 * (1 - std::exp(-0.4)));
  const auto kicked = [&](const Random::Pair& heavy, const Random::Pair& light) {  // in the engine's own order
    return std::abs(at.vx[0] - (keep * 0.5 + give * heavy.first)) < 1e-13 &&
           std::abs(at.vz[0] - (keep * -0.25 + give * heavy.second)) < 1e-13 &&
           std::abs(at.vx[1] - (keep * 0.125 + 2 * give * light.first)) < 1e-13 &&
           std::abs(at.vz[1] - (keep * 0.25 + 2 * give * light.second)) < 1e-13;
  };
  EXPECT_TRUE(kicked(one, two) || kicked(two, one));
  expect_ledger(*run);
}

// Each of N disks is redrawn at the rate of one, N times as often together, with sqrt(T/m).
TEST(BathsByHand, OfAndersenRedrawByTheMass) {
  const auto run = simulate(two_masses(AndersenBath{2, 0.5}));
  Random random(9 ^ stream);
  double time = 0;
  std::array<int, 2> drawn{};
  for (int k = 0; k < 6; ++k) {
    time -= std::log(random.uniform_positive()) / (0.5 * 2);
    run->advance_to(time - 1e-9);
    const Snapshot before = snapshot_of(*run);
    run->advance_to(time + 1e-9);
    const Snapshot after = snapshot_of(*run);
    random.below(2);
    const auto [x, z] = random.normal_pair();
    const std::size_t which = before.vx[0] != after.vx[0] ? 0 : 1;
    ++drawn[which];
    EXPECT_NEAR(after.vx[which], std::sqrt(2) * (which == 0 ? 1 : 2) * x, 1e-13) << k;
    EXPECT_NEAR(after.vz[which], std::sqrt(2) * (which == 0 ? 1 : 2) * z, 1e-13) << k;
    expect_ledger(*run);
  }
  EXPECT_GT(drawn[0], 0);
  EXPECT_GT(drawn[1], 0);
}

// Motion, weight and spin of two masses, and a free lid that falls with them.
TEST(LedgerByHand, HoldsMotionWeightSpinAndLid) {
  Scene scene = plain();
  scene.disks.species = {{1, 1, 1}, {1, 0.5, 0.25}};
  scene.disks.contact = {0.9, 0.3, 0};
  scene.disks.inertia_ratio = 0.4;
  scene.box.top = Lid{6, {}, 3};
  scene.start = PlacedStart{{{2, 3, 0.5, 0.25, 2, 0}, {5, 2, -1, 0.5, -6, 1}}};
  const auto run = simulate(scene);
  const double spin = 0.5 * 0.4 * (1 * 0.25 * 4 + 0.25 * 0.0625 * 36);
  const double motion = 0.5 * 0.3125 + 0.125 * 1.25;
  EXPECT_NEAR(run->energy().kinetic, motion + spin, 1e-15);
  EXPECT_NEAR(run->energy().potential, 3 + 0.25 * 2 + 3 * 6, 1e-14);
  EXPECT_NEAR(run->energy().initial, motion + spin + 21.5, 1e-14);
  const double t = 0.25;
  run->advance_to(t);
  EXPECT_NEAR(run->energy().kinetic, motion + spin - t * (0.25 + 0.25 * 0.5) + (1 + 0.25) * t * t / 2 + 3 * t * t / 2,
              1e-14);
  EXPECT_NEAR(run->energy().potential,
              3 + 0.25 * t - t * t / 2 + 0.25 * (2 + 0.5 * t - t * t / 2) + 3 * (6 - t * t / 2), 1e-14);
  EXPECT_EQ(run->counters().collisions(), 0U);
}

// What a wall gave, and when.
class WallDiary final : public Watcher {
 public:
  void flies(double, std::uint32_t, double, double, double, double) override {}
  void touched(double, double, double, double, double, double, double) override {}
  void pressed(double, double, double, double, double, double, double) override {}
  void touched_wall(double at, std::uint32_t, bool on_floor, double, double x, double z) override {
    if (time == 0) time = at, floor = on_floor, px = x, pz = z;
  }
  double time = 0, px = 0, pz = 0;
  bool floor = false;
};

// A thermal floor that moves throws a disk of mass 1/4 relative to itself.
TEST(BathsByHand, OnAThermalFloorThatMovesThrowByTheMass) {
  Scene scene = plain();
  scene.disks.species = {{0, 1, 1}, {1, 0.5, 0.25}};
  scene.box.floor = SinusoidalFloor{0.2, 0.3};
  scene.bath = ThermalFloor{2};
  scene.seed = 5;
  scene.start = PlacedStart{{{4, 1.2, 0.5, 0.1, 0, 1}}};
  const auto run = simulate(scene);
  WallDiary diary;
  run->watch(&diary);
  run->advance_to(2);
  ASSERT_TRUE(diary.floor);
  Random random(5 ^ stream);
  const double speed = std::sqrt(2 / 0.25), x = speed * random.normal_pair().first,
               z = speed * std::sqrt(-2 * std::log(random.uniform_positive()));
  const double floor = 0.2 * 2 * std::numbers::pi * 0.3 * std::cos(2 * std::numbers::pi * 0.3 * diary.time);
  EXPECT_NEAR(diary.px, 0.25 * (x - 0.5), 1e-12);
  EXPECT_NEAR(diary.pz, 0.25 * (z + floor - (0.1 - diary.time)), 1e-12);
  EXPECT_NEAR(run->energy().floor_work,
              0.125 * (x * x + (z + floor) * (z + floor) - 0.25 - std::pow(0.1 - diary.time, 2)), 1e-12);
}

// ---------------------------------------------------------------------------------------------------------------------
// what fills a gap exactly

struct Chain {
  std::vector<double> mass, speed;
  double momentum() const {
    double sum = 0;
    for (std::size_t k = 0; k < mass.size(); ++k) sum += mass[k] * speed[k];
    return sum;
  }
  double energy() const {
    double sum = 0;
    for (std::size_t k = 0; k < mass.size(); ++k) sum += mass[k] * speed[k] * speed[k] / 2;
    return sum;
  }
};
const Chain chain{{1, 3, 3, 1, 3, 1}, {0.7, -0.2, 0.1, 0.3, -0.6, 0.2}};

// Six disks of two masses that touch one another along x, or along z.
Scene touching(const Chain& row, bool upright, double from) {
  Scene scene = weightless(6, 9);
  scene.disks.species = {{3, 1, 1}, {3, 1, 3}};
  scene.disks.contact = {1, 0, 0};
  PlacedStart start;
  for (std::size_t k = 0; k < 6; ++k) {
    const double at = from + static_cast<double>(k);
    const std::uint32_t species = row.mass[k] == 1 ? 0 : 1;
    if (upright)
      start.disks.push_back({4, at, 0, row.speed[k], 0, species});
    else
      start.disks.push_back({at, 4, row.speed[k], 0, 0, species});
  }
  scene.start = start;
  return scene;
}
std::unique_ptr<Simulation> relieved(const Scene& scene) {
  auto run = simulate(scene);
  while (run->counters().locks_relieved == 0 && !run->advance_towards(1e-9, 1)) continue;
  EXPECT_EQ(run->counters().locks_relieved, 1U);
  return run;
}

TEST(LockedByHand, RowBetweenWallsComesToRest) {
  Scene scene = touching(chain, false, 0.5);
  scene.box.sides = HardSides{};
  scene.box.top = Lid{9, {}};
  const auto run = relieved(scene);
  for (const double v : snapshot_of(*run).vx) EXPECT_NEAR(v, 0, 1e-11);
  EXPECT_NEAR(run->energy().dissipated, chain.energy(), 1e-10);
  EXPECT_EQ(run->energy().floor_work, 0);
}

// What follows is that of disks at rest: one of mass 1 falls from z = 7 at speed 1 on the third, of mass 3, which it
// meets at time 2. Then it has (1 - 3)/(1 + 3) of its velocity, and the third 2/(1 + 3).
TEST(LockedByHand, RowAtRestIsMetWhereItLies) {
  Scene scene = touching(chain, false, 0.5);
  scene.box.sides = HardSides{};
  scene.box.top = Lid{9, {}};
  scene.disks.species[0].count = 4;
  std::get<PlacedStart>(scene.start).disks.push_back({2.5, 7, 0, -1, 0, 0});
  const auto run = relieved(scene);
  run->advance_to(3);
  const Snapshot at = snapshot_of(*run);
  for (std::size_t k = 0; k < 7; ++k) {
    const bool falls = k == 6, hit = k == 2;
    EXPECT_NEAR(at.x[k], falls ? 2.5 : 0.5 + static_cast<double>(k), 1e-9) << k;
    EXPECT_NEAR(at.z[k], falls ? 5.5 : hit ? 3.5 : 4, 1e-9) << k;
    EXPECT_NEAR(at.vz[k], falls ? 0.5 : hit ? -0.5 : 0, 1e-9) << k;
  }
}

TEST(LockedByHand, ColumnBetweenFloorAndLidComesToRest) {
  Scene scene = touching(chain, true, 0.5);
  scene.box.width = 8;
  scene.box.top = Lid{6, {}};
  const auto run = relieved(scene);
  for (const double v : snapshot_of(*run).vz) EXPECT_NEAR(v, 0, 1e-11);
  EXPECT_NEAR(run->energy().dissipated, chain.energy(), 1e-10);
}

// Round a periodic box all go on with the velocity of their centre of mass.
TEST(LockedByHand, RingsKeepTheirMomentum) {
  for (const bool upright : {false, true}) {
    Scene scene = touching(chain, upright, 0.5);
    scene.box.width = upright ? 8 : 6;
    scene.box.top = PeriodicTop{upright ? 6.0 : 8.0};
    const auto run = relieved(scene);
    const Snapshot at = snapshot_of(*run);
    const double mean = chain.momentum() / 12;
    for (const double v : upright ? at.vz : at.vx) EXPECT_NEAR(v, mean, 1e-11) << upright;
    for (const double v : upright ? at.vx : at.vz) EXPECT_NEAR(v, 0, 1e-11) << upright;
    EXPECT_NEAR(run->energy().dissipated, chain.energy() - 6 * mean * mean, 1e-10);
  }
}

}  // namespace
}  // namespace shakebed::sim::starts_by_hand
