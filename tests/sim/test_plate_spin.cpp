// Friction of a plate on a disk that slides and spins: the mean over the patch, its exact and published limits, and
// what an engine makes of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "sim/engine/plate_spin.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/scene/scene.hpp"
#include "tests/sim/snapshot_of.hpp"

namespace {

using namespace shakebed::sim;

// The mean over a circle of radius 1 of the direction in which its points move, and of its moment, by midpoints.
PatchFriction by_sums(double speed, double rim) {
  constexpr int rings = 800, parts = 800;
  double force = 0, torque = 0;
  for (int i = 0; i < rings; ++i) {
    const double r = std::sqrt((i + 0.5) / rings);  // of equal areas
    for (int k = 0; k < parts; ++k) {
      const double angle = 2 * std::numbers::pi * (k + 0.5) / parts;
      const double vx = speed - rim * r * std::sin(angle), vz = rim * r * std::cos(angle), v = std::hypot(vx, vz);
      force += vx / v;
      torque += r * (vz * std::cos(angle) - vx * std::sin(angle)) / v;
    }
  }
  return {force / (rings * parts), torque / (rings * parts)};
}

TEST(PatchFriction, IsTheMeanOverThePatch) {
  for (const double ratio : {0.1, 0.4, 0.8, 1.0, 1.3, 3.0, 30.0}) {
    const PatchFriction closed = patch_friction(ratio, 1), sums = by_sums(ratio, 1);
    EXPECT_NEAR(closed.force, sums.force, 1e-5) << ratio;
    EXPECT_NEAR(closed.torque, sums.torque, 1e-5) << ratio;
  }
}

TEST(PatchFriction, HasItsExactLimits) {
  const PatchFriction spin = patch_friction(0, 3), slow = patch_friction(1e-7, 1), fast = patch_friction(1e7, 1);
  EXPECT_EQ(spin.force, 0);
  EXPECT_NEAR(spin.torque, 2.0 / 3, 1e-15);
  EXPECT_NEAR(slow.force, 1e-7, 1e-19);
  EXPECT_NEAR(fast.force, 1, 1e-14);
  EXPECT_NEAR(fast.torque, 0.25e-7, 1e-21);
  EXPECT_EQ(patch_friction(2, 0).force, 1);
  EXPECT_EQ(patch_friction(2, 0).torque, 0);
  EXPECT_NEAR(patch_friction(1, 1).force, 8 / (3 * std::numbers::pi), 1e-14);
  // It follows from one power, homogeneous in both speeds: force = dP/dv, torque = dP/d(rim), so they have one slope.
  for (const double ratio : {0.3, 0.9, 1.2, 5.0}) {
    const double d = 1e-5;
    EXPECT_NEAR((patch_friction(ratio, 1 + d).force - patch_friction(ratio, 1 - d).force) / (2 * d),
                (patch_friction(ratio + d, 1).torque - patch_friction(ratio - d, 1).torque) / (2 * d), 1e-7);
  }
}

// Whatever its start, a coin stops to slide and to spin at once, in the end with v = 0.653 R |w| [FarkasEtAl2003].
TEST(SlideSpinning, EndsInThePublishedRatioOfSlidingToSpinning) {
  for (const auto& [speed, rim] : {std::pair{1.0, 0.1}, {1.0, 1.0}, {0.02, 1.0}}) {
    SpinningSlide at{{0, 0, speed, 0}, rim};
    for (int i = 0; i < 60; ++i)
      at = slide_spinning(at.way.vx, 0, at.rim, 2, 0, 0.3, 0.5 * std::max(at.way.vx, at.rim) / 0.3);
    EXPECT_GT(at.rim, 0);
    EXPECT_NEAR(at.way.vx / at.rim, 0.653, 0.0005) << speed << " " << rim;
    EXPECT_LT(at.rim, 1e-12);
  }
}

// Small equal steps with Euler's midpoint, in place of steps that follow the speed.
SpinningSlide by_small_steps(double vx, double vz, double rim, double lever, double pull, double a, double time) {
  const int steps = 20'000;
  const double dt = time / steps;
  double x = 0, z = 0;
  const auto rates = [&](double ux, double uz, double w, double out[3]) {
    const double v = std::hypot(ux, uz);
    const PatchFriction f = patch_friction(v, w);
    out[0] = -a * f.force * ux / v, out[1] = pull - a * f.force * uz / v, out[2] = -lever * a * f.torque;
  };
  for (int i = 0; i < steps; ++i) {
    double one[3], two[3];
    rates(vx, vz, rim, one);
    const double mx = vx + 0.5 * dt * one[0], mz = vz + 0.5 * dt * one[1], mw = rim + 0.5 * dt * one[2];
    rates(mx, mz, mw, two);
    x += dt * mx, z += dt * mz;
    vx += dt * two[0], vz += dt * two[1], rim += dt * two[2];
  }
  return {{x, z, vx, vz}, rim};
}

TEST(SlideSpinning, FollowsItsEquationOfMotion) {
  double worst = 0;
  for (const double lever : {0.001, 0.1, 0.5, 2.5}) {
    for (const double pull : {0.0, 0.2, 1.0}) {
      for (const auto& [speed, rim] : {std::pair{1.0, 0.3}, {0.3, 1.0}, {0.5, 0.5}, {1.0, 0.01}}) {
        const double time = 0.8, a = 0.4;
        const SpinningSlide steps = by_small_steps(0.6 * speed, 0.8 * speed, rim, lever, pull, a, time);
        if (!(steps.rim > 0.002 && std::hypot(steps.way.vx, steps.way.vz) > 0.02)) continue;
        const SpinningSlide end = slide_spinning(0.6 * speed, 0.8 * speed, rim, lever, pull, a, time);
        const double fast = time * (a + pull), far = time * fast;
        for (const double error :
             {(end.way.x - steps.way.x) / far, (end.way.z - steps.way.z) / far, (end.way.vx - steps.way.vx) / fast,
              (end.way.vz - steps.way.vz) / fast, (end.rim - steps.rim) / fast})
          worst = std::max(worst, std::abs(error));
      }
    }
  }
  std::printf("largest error over that of the accelerations: %.2g\n", worst);
  EXPECT_LT(worst, 1e-5);
}

// A pull that friction would hold moves a disk that spins, until the spin is over.
TEST(SlideSpinning, LetsADiskCreepWhileItSpins) {
  const double a = 0.5, pull = -0.2, lever = 0.01, rim = 0.004, time = 4;
  double ratio = 0.4;
  for (int i = 0; i < 200; ++i) ratio *= 0.4 / patch_friction(ratio, 1).force;
  const double stop = rim / (lever * a * patch_friction(ratio, 1).torque);
  ASSERT_LT(stop, time);
  const SpinningSlide half = slide_spinning(0, 0, rim, lever, pull, a, stop / 2),
                      end = slide_spinning(0, 0, rim, lever, pull, a, time);
  EXPECT_NEAR(half.rim, rim / 2, 0.02 * rim);
  EXPECT_NEAR(half.way.vz, -ratio * rim / 2, 0.02 * ratio * rim);
  EXPECT_NEAR(end.way.z, -ratio * rim * stop / 2, 0.02 * ratio * rim * stop);
  EXPECT_EQ(end.rim, 0);
  EXPECT_EQ(end.way.vz, 0);
}

// What such a disk has of another velocity at first carries it on by that velocity times rim over the deceleration, or
// nearly so.
TEST(SlideSpinning, StopsAcrossThePullWithinTheTimeOfItsSpin) {
  const double a = 0.5, pull = -0.2, lever = 0.01, rim = 0.004, time = 1, across = 0.5 * rim;
  const SpinningSlide end = slide_spinning(across, 0, rim, lever, pull, a, time),
                      steps = by_small_steps(across, -1e-6, rim, lever, pull, a, time);
  EXPECT_NEAR(end.way.x / (across * rim / a), 1, 1e-12);
  EXPECT_NEAR(steps.way.x / end.way.x, 1, 0.05);
}

TEST(SlideSpinning, IsSlidingWhereNothingSpins) {
  const SpinningSlide both = slide_spinning(0.3, -0.2, 0, 1, -1, 0.7, 2);
  const Slide alone = slide(0.3, -0.2, -1, 0.7, 2);
  EXPECT_EQ(both.way.x, alone.x);
  EXPECT_EQ(both.way.vz, alone.vz);
  EXPECT_EQ(both.rim, 0);
}

Scene spinning_disk(double vx, double spin, double inertia_ratio, const RubbingPlates& plates) {
  Scene scene;
  scene.gravity = Weightless{};
  scene.disks.species = {{1, 1, 1}};
  scene.disks.inertia_ratio = inertia_ratio;
  scene.disks.contact = Surface{1, 0.3, 0};  // contacts turn disks: the engine has spins
  scene.box.width = 40;
  scene.box.sides = HardSides{};
  scene.box.top = Lid{40, {}};
  scene.box.plates = plates;
  scene.start = PlacedStart{{{10, 20, vx, 0, spin, 0}}};
  return scene;
}

// The torque on a disk that only spins is 2/3 mu N c: it stops after 3 |w| q R^2/(2 mu g c), whatever the interval.
TEST(Plates, BrakeASpinningDiskAsItsTorqueSays) {
  for (const double interval : {0.003, 0.01, 0.7}) {
    for (const auto& [spin, q] : {std::pair{3.0, 0.5}, {-0.8, 0.4}}) {
      const double a = 0.31, c = 0.07, radius = 0.5;
      const double stop = 3 * std::abs(spin) * q * radius * radius / (2 * a * c);
      const auto disk = simulate(spinning_disk(0, spin, q, {a, interval, true, c}));
      for (const double share : {0.25, 0.5, 0.9}) {
        if ((1 - share) * stop < interval) continue;  // where it stops, the spin is seen as linear over the interval
        disk->advance_to(share * stop);
        EXPECT_NEAR(snapshot_of(*disk).spin[0], (1 - share) * spin, 1e-12 * std::abs(spin));
      }
      disk->advance_to(stop + 2 * interval);
      EXPECT_EQ(snapshot_of(*disk).spin[0], 0);
      const EnergyLedger energy = disk->energy();
      const double rotation = 0.5 * q * radius * radius * spin * spin;
      EXPECT_NEAR(energy.initial, rotation, 1e-15);
      EXPECT_NEAR(energy.dissipated_on_plates, rotation, 1e-12 * rotation);
      EXPECT_EQ(energy.kinetic, 0);
    }
  }
}

// At the ends of intervals sliding and spinning are those of one long slide.
TEST(Plates, SlowDownSlidingAndSpinningTogether) {
  const double a = 0.31, c = 0.3, q = 0.4, time = 1.7;
  const SpinningSlide exact = slide_spinning(1, 0, c * 2.5, c * c / (q * 0.25), 0, a, time);
  for (const double parts : {4.0, 100.0}) {
    const auto disk = simulate(spinning_disk(1, 2.5, q, {a, time / parts, true, c}));
    disk->advance_to(time * (1 + 1e-12));
    const Snapshot at = snapshot_of(*disk);
    EXPECT_NEAR(at.x[0], 10 + exact.way.x, 1e-5);
    EXPECT_NEAR(at.vx[0], exact.way.vx, 1e-5);
    EXPECT_NEAR(c * at.spin[0], exact.rim, 1e-5);
    EXPECT_NEAR(disk->energy().imbalance(), 0, 1e-12);
  }
  EXPECT_GT(exact.way.vx, 1 - a * time) << "a disk that spins slides farther";
}

// Disks that do not meet slide and spin as each does alone, between the ends of intervals, too.
TEST(Plates, BrakeEachDiskAsIfItWereAlone) {
  const RubbingPlates plates{0.31, 0.2, true, 0.3};
  const std::vector<Placed> disks = {
      {5, 10, 0.4, 0.1, 2.5, 0}, {20, 20, -0.9, 0.5, -1.2, 0}, {35, 30, 0.1, -0.7, 0.6, 0}};
  Scene scene = spinning_disk(0, 0, 0.4, plates);
  scene.disks.species = {{3, 1, 1}};
  scene.start = PlacedStart{disks};
  const auto all = simulate(scene);
  std::vector<std::unique_ptr<Simulation>> alone;
  for (const Placed& disk : disks) {
    Scene one = spinning_disk(0, 0, 0.4, plates);
    one.start = PlacedStart{{disk}};
    alone.push_back(simulate(one));
  }
  for (const double time : {0.07, 0.33, 0.5}) {
    all->advance_to(time);
    const Snapshot together = snapshot_of(*all);
    for (std::size_t i = 0; i < disks.size(); ++i) {
      alone[i]->advance_to(time);
      const Snapshot its = snapshot_of(*alone[i]);
      EXPECT_NEAR(together.x[i], its.x[0], 1e-12);
      EXPECT_NEAR(together.z[i], its.z[0], 1e-12);
      EXPECT_NEAR(together.vx[i], its.vx[0], 1e-12);
      EXPECT_NEAR(together.vz[i], its.vz[0], 1e-12);
      EXPECT_NEAR(together.spin[i], its.spin[0], 1e-12);
    }
  }
}

TEST(Plates, LeaveTheSpinAloneWithoutAContactRadius) {
  const auto disk = simulate(spinning_disk(1, 2.5, 0.4, {0.3, 0.01}));
  disk->advance_to(20);
  EXPECT_EQ(snapshot_of(*disk).spin[0], 2.5);
}

TEST(Plates, CloseTheLedgerOfARoughBedWhoseSpinTheyBrake) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{60, 1, 1}, {30, 1.4, 2.744}};
  scene.disks.contact = scene.box.floor_surface = Surface{0.9, 0.3, 0};
  scene.disks.contact_duration = 1e-4;
  scene.box.width = 12.3;
  scene.box.sides = HardSides{Surface{0.9, 0.3, 0}};
  scene.box.floor = SinusoidalFloor{2.5 / std::pow(2 * std::numbers::pi * 0.35, 2), 0.35};
  const auto mean_rotation = [&](double contact_radius) {
    scene.box.plates = RubbingPlates{0.25, 0.01, true, contact_radius};
    const auto bed = simulate(scene);
    double sum = 0;
    for (int k = 1; k <= 30; ++k) {
      bed->advance_to(1.37 * k);
      const EnergyLedger energy = bed->energy();
      EXPECT_NEAR(energy.imbalance(), 0, 1e-9 * (energy.dissipated + energy.initial));
      const Snapshot at = snapshot_of(*bed);
      for (const double spin : at.spin) sum += spin * spin;
    }
    EXPECT_LT(bed->largest_overlap(), hard_overlap);
    return sum;
  };
  const double free = mean_rotation(0), small = mean_rotation(0.02), coins = mean_rotation(0.5);
  std::printf("sum of spin^2: %.3g without a contact radius, %.3g at 0.02 D, %.3g at 0.5 D\n", free, small, coins);
  EXPECT_LT(coins, 0.8 * free);
}

}  // namespace
