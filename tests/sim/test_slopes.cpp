// Side walls that slope outwards: when they are met, and what they do.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/scene/scene.hpp"
#include "tests/sim/snapshot_of.hpp"

namespace {

using namespace shakebed::sim;

constexpr double frequency = 0.3, amplitude = 0.5;

struct Throw {
  double slope, x, z, vx, vz;
};
const std::vector<Throw> throws = {{0.2, 5, 3, -2, 1},     {0.2, 5, 3, 2, 1},      {0.7, 4, 6, -3, 2},
                                   {1.1, 8, 2, 4, 3},      {0.01, 5, 9, -6, 0.5},  {0.5, 5, 1, 0.9, 0},
                                   {0.35, 1.2, 2, -1, -1}, {0.9, 9.5, 3, 5, -0.5}, {0.05, 2, 4, -0.4, 5}};

Scene thrown(const Throw& disk, bool shaken, const Surface& side = {}) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{1, 1, 1}};
  scene.box.width = 10;
  scene.box.sides = HardSides{side, disk.slope};
  if (shaken) scene.box.floor = SinusoidalFloor{amplitude, frequency};
  scene.start = PlacedStart{{{disk.x, disk.z, disk.vx, disk.vz, 0, 0}}};
  return scene;
}

struct Touch {
  double time, px, pz;
  bool floor;
};
class Touches : public Watcher {
 public:
  void flies(double /*time*/, std::uint32_t, double, double, double, double) override {}
  void touched(double, double, double, double, double, double, double) override {}
  void pressed(double, double, double, double, double, double, double) override {}
  void touched_wall(double time, std::uint32_t, bool floor, double, double px, double pz) override {
    all.push_back({time, px, pz, floor});
  }
  std::vector<Touch> all;
};

long double floor_at(long double time, bool shaken) {
  return shaken ? amplitude * std::sin(2 * std::numbers::pi_v<long double> * frequency * time) : 0;
}
// The gap between the disk in free flight and a side.
long double gap(const Throw& d, bool left, long double t, bool shaken) {
  const long double s = std::sin(static_cast<long double>(d.slope)), c = std::cos(static_cast<long double>(d.slope));
  const long double x = d.x + d.vx * t, z = d.z + d.vz * t - t * t / 2;
  return c * (left ? x : 10 - x) + s * (z - floor_at(t, shaken)) - 0.5L;
}
// The first root of the exact quadratic, where nothing shakes.
long double quadratic_root(const Throw& d, bool left) {
  const long double s = std::sin(static_cast<long double>(d.slope)), c = std::cos(static_cast<long double>(d.slope));
  const long double v = (left ? c * d.vx : -c * d.vx) + s * d.vz;
  return (v + std::sqrt(v * v + 2 * s * gap(d, left, 0, false))) / s;
}
// The first change of sign on a fine mesh, by halving.
long double scanned_root(const Throw& d, bool left) {
  const long double step = 1e-3L;
  for (long double t = 0;; t += step) {
    if (gap(d, left, t + step, true) > 0) continue;
    long double before = t, after = t + step;
    for (int k = 0; k < 80; ++k) {
      const long double middle = (before + after) / 2;
      (gap(d, left, middle, true) > 0 ? before : after) = middle;
    }
    return before;
  }
}
// The first side that is met, with its time; none if the floor comes before.
std::pair<double, bool> first_side(const Throw& d, bool shaken) {
  const long double l = shaken ? scanned_root(d, true) : quadratic_root(d, true),
                    r = shaken ? scanned_root(d, false) : quadratic_root(d, false);
  return {static_cast<double>(std::min(l, r)), l < r};
}

TEST(SlopedSides, AreMetAtTheRootOfTheExactQuadratic) {
  int met = 0;
  for (const bool shaken : {false, true}) {
    for (const Throw& d : throws) {
      Touches touches;
      const auto disk = simulate(thrown(d, shaken));
      disk->watch(&touches);
      disk->advance_to(20);
      ASSERT_FALSE(touches.all.empty());
      if (touches.all[0].floor) continue;
      ++met;
      EXPECT_NEAR(touches.all[0].time, first_side(d, shaken).first, 1e-12) << d.slope << " " << d.vx;
    }
  }
  EXPECT_GE(met, 10);
}

// Stops a run that has more contacts with walls than expected.
class FewTouches final : public Touches {
 public:
  explicit FewTouches(std::size_t most) : most_(most) {}
  void touched_wall(double, std::uint32_t, bool, double, double, double) override {
    if (++count > most_) throw std::runtime_error("too many contacts");
  }
  std::size_t count = 0;

 private:
  std::size_t most_;
};

// A disk that lies on a plastic or a nearly plastic side makes at most two contacts in a contact duration.
TEST(SlopedSides, ThatAreNearlyPlasticAreTouchedAtMostTwiceInAContactDuration) {
  constexpr double duration = 1e-4, end = 5;
  for (const double restitution : {0.0, 0.01, 0.1}) {
    std::size_t most = 0;
    for (const Throw& d : throws) {
      Scene scene = thrown(d, true, Surface{restitution, 0, 0});
      scene.disks.contact_duration = duration;
      FewTouches touches(static_cast<std::size_t>(2 * end / duration));
      const auto disk = simulate(scene);
      disk->watch(&touches);
      EXPECT_NO_THROW(disk->advance_to(end)) << "slope " << d.slope << ", restitution " << restitution;
      most = std::max(most, touches.count);
    }
    EXPECT_GT(most, 1000U) << "no disk lay on a side: restitution " << restitution;
  }
}

// A plastic contact with a side that falls away ends: rounding alone does not make it last. The ledger counts the
// energy with which they part.
TEST(SlopedSides, LetGoWhenTheyFallAway) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Scene scene = thrown({0.2, 0, 0, 0, 0}, true, Surface{0, 0.1, 0});
    scene.seed = seed;
    scene.disks.species = {{30, 1, 1}};
    scene.disks.contact = {0.9, 0, 0};
    scene.disks.contact_duration = 1e-4;
    scene.box.floor = SinusoidalFloor{0.6, 0.4};
    scene.start = HexagonalStart{};
    FewTouches touches(200'000);
    const auto bed = simulate(scene);
    bed->watch(&touches);
    ASSERT_NO_THROW(bed->advance_to(2.5)) << seed;
    EXPECT_NEAR(bed->energy().imbalance(), 0, 1e-10 * bed->energy().dissipated) << seed;
  }
}

// What a smooth side gives is along its normal: the momentum along the side stays. An elastic one at rest keeps the
// energy, an inelastic one keeps e of the velocity along the normal.
TEST(SlopedSides, KeepTheMomentumAlongThemAndTheEnergy) {
  for (const double restitution : {1.0, 0.6}) {
    for (const bool shaken : {false, true}) {
      for (const Throw& d : throws) {
        Touches touches;
        const auto disk = simulate(thrown(d, shaken, Surface{restitution, 0, 0}));
        disk->watch(&touches);
        disk->advance_to(20);
        if (touches.all.empty() || touches.all[0].floor) continue;
        const Touch& touch = touches.all[0];
        const double s = std::sin(d.slope), c = std::cos(d.slope), inwards = first_side(d, shaken).second ? 1 : -1;
        EXPECT_NEAR(-inwards * s * touch.px + c * touch.pz, 0, 1e-13) << "along the side";
        const double floor_velocity = shaken ? amplitude * 2 * std::numbers::pi * frequency *
                                                   std::cos(2 * std::numbers::pi * frequency * touch.time)
                                             : 0;
        const double before = inwards * c * d.vx + s * (d.vz - touch.time - floor_velocity);
        EXPECT_LT(before, 0);
        EXPECT_NEAR(inwards * c * touch.px + s * touch.pz, -(1 + restitution) * before, 1e-11);
      }
    }
  }
}

TEST(SlopedSides, KeepTheEnergyOfAnElasticDiskForAThousandContacts) {
  Touches touches;
  const auto disk = simulate(thrown({0.3, 4, 3, 1.7, 2}, false));
  disk->watch(&touches);
  disk->advance_to(4000);
  EXPECT_GT(touches.all.size(), 1000U);
  EXPECT_NEAR(disk->energy().imbalance(), 0, 1e-10);
  EXPECT_NEAR(disk->energy().kinetic + disk->energy().potential, disk->energy().initial, 1e-10);
  EXPECT_EQ(disk->energy().dissipated, 0);
  EXPECT_EQ(disk->energy().floor_work, 0);
}

// What fills a gap exactly hands its momentum on without end at one instant. Then plastic impulses end every approach.
constexpr double upwards = 2 * std::numbers::pi * amplitude * frequency;  // the velocity of the floor at time 0

// Goes on, event by event, until a lock has been relieved, or to that time at most.
void advance_to_relief(Simulation& locked, double time) {
  while (locked.counters().locks_relieved == 0 && !locked.advance_towards(time, 1)) continue;
}

// A row of disks that touch one another and both sides.
Scene locked_row(double slope, double height, const std::vector<double>& vx, bool shaken = false) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{static_cast<std::uint32_t>(vx.size()), 1, 1}};
  const double first = std::nextafter((0.5 - height * std::sin(slope)) / std::cos(slope), 10);
  scene.box.width = 2 * first + static_cast<double>(vx.size() - 1);
  scene.box.sides = HardSides{{}, slope};
  if (shaken) scene.box.floor = SinusoidalFloor{amplitude, frequency};
  PlacedStart start;
  for (std::size_t k = 0; k < vx.size(); ++k)
    start.disks.push_back({first + static_cast<double>(k), height, vx[k], 0, 0, 0});
  scene.start = start;
  return scene;
}
const std::vector<double> six_velocities{0.7, -0.2, 0.1, 0.3, -0.6, 0.2};

// Under a lid nothing can go anywhere: all come to rest but for what gravity gives meanwhile, and all their energy is
// lost.
TEST(LockedRow, BetweenSlopesUnderALidComesToRest) {
  double energy = 0;
  for (const double v : six_velocities) energy += v * v / 2;
  for (const double slope : {0.3, 0.7, 1.1}) {
    Scene scene = locked_row(slope, 0.6, six_velocities);
    scene.box.top = Lid{1.1, {}};
    const auto row = simulate(scene);
    advance_to_relief(*row, 1e-9);
    ASSERT_EQ(row->counters().locks_relieved, 1U) << slope;
    const Snapshot after = snapshot_of(*row);
    for (std::size_t k = 0; k < six_velocities.size(); ++k) {
      EXPECT_NEAR(after.vx[k], 0, 1e-12) << slope;
      EXPECT_NEAR(after.vz[k], 0, 1e-12 + row->time()) << slope;
    }
    EXPECT_NEAR(row->energy().dissipated, energy, 1e-9);
  }
}

// Sides that rise and a heavy lid at rest. Nothing else acts along z. So the work of the sides is their velocity times
// the momentum that disks and lid get upwards.
TEST(LockedRow, BetweenSlopesUnderAFreeLidPushesIt) {
  constexpr double mass = 1e6;
  Scene scene = locked_row(0.3, 3, six_velocities, true);
  scene.box.top = Lid{3.5, {}, mass};
  const auto row = simulate(scene);
  advance_to_relief(*row, 1e-9);
  ASSERT_EQ(row->counters().locks_relieved, 1U);
  const Snapshot after = snapshot_of(*row);
  double upward = mass * after.lid_velocity;
  for (std::size_t k = 0; k < 6; ++k) {
    upward += after.vz[k];
    EXPECT_GE(after.lid_velocity - after.vz[k], -1e-12) << k;
  }
  EXPECT_NEAR(row->energy().floor_work, upwards * upward, 1e-12 * mass);
  EXPECT_GT(upward, 0.01 * mass * upwards);
}

// Half a radius and more beyond where vertical sides would be, or a little: disks begin where they are placed.
TEST(SlopedSides, LetDisksBeginWhereTheyArePlaced) {
  for (const double slope : {1e-3, 0.3}) {
    const Scene scene = locked_row(slope, 3, {0, 0, 0, 0});
    const Snapshot at = snapshot_of(*simulate(scene));
    const auto& placed = std::get<PlacedStart>(scene.start).disks;
    EXPECT_LT(placed[0].x, 0.5);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(at.x[k], placed[k].x) << slope;
      EXPECT_EQ(at.z[k], placed[k].z) << slope;
    }
  }
}

Scene bed(double slope, bool rough = false) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{120, 1, 1}};
  scene.disks.contact = scene.box.floor_surface = Surface{0.9, rough ? 0.3 : 0, 0};
  scene.disks.contact_duration = 1e-4;
  scene.box.width = 10.3;
  scene.box.sides = HardSides{Surface{0.8, rough ? 0.2 : 0, 0}, slope};
  scene.box.floor = SinusoidalFloor{3 / std::pow(2 * std::numbers::pi * 0.35, 2), 0.35};
  return scene;
}
// Nothing leaves the box, nothing overlaps, and the ledger closes with the work of the sides in that of the floor.
TEST(SlopedSides, HoldAShakenBed) {
  for (const double slope : {0.05, 0.3, 0.9}) {
    for (const bool rough : {false, true}) {
      const Scene scene = bed(slope, rough);
      const auto shaken = simulate(scene);
      double beyond = 0;
      for (int k = 1; k <= 60; ++k) {
        shaken->advance_to(0.71 * k);
        const Snapshot at = snapshot_of(*shaken);
        for (std::size_t i = 0; i < at.x.size(); ++i) {
          const double up = std::sin(slope) * (at.z[i] - at.floor_position) - 0.5;
          EXPECT_GT(std::cos(slope) * at.x[i] + up, -1e-9);
          EXPECT_GT(std::cos(slope) * (scene.box.width - at.x[i]) + up, -1e-9);
          EXPECT_GT(at.z[i], at.floor_position + 0.5 - 1e-9);
          beyond = std::max({beyond, -at.x[i], at.x[i] - scene.box.width});
        }
        const EnergyLedger energy = shaken->energy();
        EXPECT_NEAR(energy.imbalance(), 0, 1e-9 * (energy.dissipated + energy.initial));
        EXPECT_TRUE(shaken->foresees_contacts());
        EXPECT_LT(shaken->largest_overlap(), hard_overlap);
      }
      EXPECT_GT(beyond, 0) << "disks are where vertical sides would not let them";
      EXPECT_GT(shaken->counters().wall_collisions, 100U);
    }
  }
}

// The image of a start has the image of its run, as long as rounding has not grown.
TEST(SlopedSides, AreOneAnothersImages) {
  for (const Throw& d : throws) {
    Throw image = d;
    image.x = 10 - d.x;
    image.vx = -d.vx;
    const auto one = simulate(thrown(d, true)), other = simulate(thrown(image, true));
    one->advance_to(8);
    other->advance_to(8);
    EXPECT_NEAR(snapshot_of(*one).x[0], 10 - snapshot_of(*other).x[0], 1e-9);
    EXPECT_NEAR(snapshot_of(*one).z[0], snapshot_of(*other).z[0], 1e-9);
  }
}

TEST(SlopedSides, GoOnFromACheckpointToTheSameBytes) {
  Scene with_plates = bed(0.3, true);
  with_plates.box.plates = RubbingPlates{0.2, 0.01};
  for (const Scene& scene : {bed(0.3), bed(0.8, true), with_plates}) {
    const auto a = simulate(scene), b = simulate(scene);
    std::vector<std::uint8_t> saved;
    while (a->time() < 15) {
      a->advance_to(a->next_synchronisation());
      saved = a->checkpoint();
    }
    b->restore(saved);
    a->advance_to(40);
    b->advance_to(40);
    const Snapshot here = snapshot_of(*a), there = snapshot_of(*b);
    EXPECT_EQ(here.x, there.x);
    EXPECT_EQ(here.z, there.z);
    EXPECT_EQ(here.vx, there.vx);
    EXPECT_EQ(here.vz, there.vz);
    EXPECT_EQ(here.spin, there.spin);
    EXPECT_EQ(a->energy().dissipated, b->energy().dissipated);
    EXPECT_EQ(a->counters().events(), b->counters().events());
  }
}

TEST(SlopedSides, NeedGravityAndAnAngleThatSlopes) {
  const auto problems = [](double slope, bool falls) {
    Scene scene = bed(slope);
    if (!falls) {
      scene.gravity = Weightless{};
      scene.box.top = Lid{30, {}};
    }
    std::vector<std::string> where;
    for (const SceneProblem& problem : check(scene)) where.push_back(problem.where);
    return where;
  };
  EXPECT_TRUE(problems(0.2, true).empty());
  EXPECT_TRUE(problems(0, false).empty());
  for (const double slope : {-0.1, 1e-6, 1.4})
    EXPECT_EQ(problems(slope, true), std::vector<std::string>{"/box/sides/slope"}) << slope;
  EXPECT_EQ(problems(0.2, false), std::vector<std::string>{"/box/sides/slope"});
}

}  // namespace
