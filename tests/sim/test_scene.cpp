#include <gtest/gtest.h>

#include <cmath>

#include "sim/overlap.hpp"
#include "sim/simulation.hpp"

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

TEST(SceneCheck, RefusesMoreDisksThanTheBoxHolds) {
  Scene s = bed(300, 10);
  s.box.floor = StillFloor{};
  s.box.top = Lid{10, {}};
  EXPECT_EQ(first_problem(s), "/box");
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

}  // namespace
}  // namespace shakebed::sim
