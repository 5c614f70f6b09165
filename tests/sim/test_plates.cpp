// Friction with the plates of a flat cell: sliding against its exact solution, and what an engine makes of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "sim/engine/plate_slide.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/scene/scene.hpp"
#include "tests/sim/snapshot_of.hpp"

namespace {

using namespace shakebed::sim;

// The exact path under a pull G and Coulomb friction a = r G. Let p be the angle between velocity and pull and w =
// tan(p/2). From du/dt = G cos p - a and u dp/dt = -G sin p follows u = (C/2) w^(r-1) (1 + w^2), and integrals over w
// of the time and of the way along the pull and across it. r is neither 1/2 nor 1.
struct Hodograph {
  long double pull, ratio, c;
  struct Point {
    long double time, along, across, v_along, v_across;
  };
  // Integrals from w to infinity or 0 but for a constant: differences of two points count.
  Point at(long double w) const {
    const long double r = ratio;
    const auto power = [&](long double n) { return std::pow(w, n) / n; };
    const long double u = c / 2 * std::pow(w, r - 1) * (1 + w * w);
    return {-c / (2 * pull) * (power(r - 1) + power(r + 1)),
            -c * c / (4 * pull) * (power(2 * r - 2) - power(2 * r + 2)),
            -c * c / (2 * pull) * (power(2 * r - 1) + power(2 * r + 1)), u * (1 - w * w) / (1 + w * w),
            u * 2 * w / (1 + w * w)};
  }
};

TEST(Slide, FollowsItsExactPath) {
  double worst = 0;
  for (const double ratio : {0.1, 0.3, 0.8, 1.3, 3.0}) {
    for (const auto& [from, to] : {std::pair{3.0, 2.9}, {3.0, 1.0}, {40.0, 0.5}, {1.5, 0.2}, {0.5, 0.05}}) {
      const Hodograph path{1.7L, ratio, 1};
      const Hodograph::Point a = path.at(from), b = path.at(to);
      const auto time = static_cast<double>(b.time - a.time);
      const Slide end = slide(static_cast<double>(a.v_across), static_cast<double>(a.v_along), 1.7, 1.7 * ratio, time);
      const double far = time * time * 1.7 * (1 + ratio), fast = time * 1.7 * (1 + ratio);
      for (const double error :
           {(end.x - static_cast<double>(b.across - a.across)) / far,
            (end.z - static_cast<double>(b.along - a.along)) / far, (end.vx - static_cast<double>(b.v_across)) / fast,
            (end.vz - static_cast<double>(b.v_along)) / fast})
        worst = std::max(worst, std::abs(error));
    }
  }
  EXPECT_LT(worst, 1e-6);
}

TEST(Slide, StopsOnAStraightPathWhereItsEnergyIsGone) {
  for (const double speed : {1e-3, 0.7, 12.0}) {
    const double stop = speed / 0.4;
    const Slide before = slide(0.6 * speed, -0.8 * speed, 0, 0.4, 0.5 * stop);
    EXPECT_NEAR(before.x, 0.6 * 0.375 * speed * stop, 1e-14 * speed * stop);
    EXPECT_NEAR(before.vz, -0.4 * speed, 1e-15 * speed);
    const Slide end = slide(0.6 * speed, -0.8 * speed, 0, 0.4, 3 * stop);
    EXPECT_NEAR(end.x, 0.6 * speed * speed / 0.8, 1e-14 * speed * stop);
    EXPECT_NEAR(end.z, -0.8 * speed * speed / 0.8, 1e-14 * speed * stop);
    EXPECT_EQ(end.vx, 0);
    EXPECT_EQ(end.vz, 0);
  }
}

TEST(Slide, RestsWhereFrictionHoldsItAndSetsOffWhereNot) {
  const Slide held = slide(0, 0, -1, 1, 5), released = slide(0, 0, -1, 0.75, 2);
  EXPECT_EQ(held.z, 0);
  EXPECT_EQ(held.vz, 0);
  EXPECT_NEAR(released.z, -0.5, 1e-15);
  EXPECT_NEAR(released.vz, -0.5, 1e-15);
  // Up against both, down against one: v = 1, accelerations 1.5 and 0.5.
  const Slide back = slide(0, 1, -1, 0.5, 2);
  EXPECT_NEAR(back.vz, -0.5 * (2 - 1 / 1.5), 1e-15);
  EXPECT_NEAR(back.z, 0.5 / 1.5 - 0.25 * std::pow(2 - 1 / 1.5, 2), 1e-15);
  // Curved, it comes to rest in a finite time and stays there.
  const Slide curved = slide(0.5, 0.2, -1, 1.5, 10);
  EXPECT_EQ(curved.vx, 0);
  EXPECT_EQ(curved.vz, 0);
}

Scene one_disk(double vx, double vz, const RubbingPlates& plates, bool falls = true) {
  Scene scene;
  if (falls) {
    scene.gravity = UniformGravity{};
  } else {
    scene.gravity = Weightless{};
    scene.box.top = Lid{400, {}};
  }
  scene.disks.species = {{1, 1, 1}};
  scene.box.width = 400;
  scene.box.sides = HardSides{};
  scene.box.plates = plates;
  scene.start = PlacedStart{{{200, 200, vx, vz, 0, 0}}};
  return scene;
}
// On a horizontal plate: after v^2/(2 mu g), at the time v/(mu g), whatever the interval.
TEST(Plates, LetASlidingDiskStopWhereItsEnergyIsGone) {
  for (const double interval : {0.003, 0.01, 0.7}) {
    for (const auto& [vx, vz] : {std::pair{3.0, 4.0}, {0.0, -7.0}, {-0.02, 0.01}, {9.0, 0.0}}) {
      const double deceleration = 0.31, speed = std::hypot(vx, vz);
      const auto disk = simulate(one_disk(vx, vz, {deceleration, interval}, false));
      const double half = 0.5 * speed / deceleration;
      disk->advance_to(half);
      EXPECT_NEAR(std::hypot(snapshot_of(*disk).vx[0], snapshot_of(*disk).vz[0]), std::max(0.5 * speed, 0.0),
                  half > interval ? 1e-11 : speed);
      disk->advance_to(2 * half + 2 * interval);
      const Snapshot at = snapshot_of(*disk);
      const double distance = speed * speed / (2 * deceleration);
      EXPECT_NEAR(at.x[0], 200 + distance * vx / speed, 1e-12 * 200);
      EXPECT_NEAR(at.z[0], 200 + distance * vz / speed, 1e-12 * 200);
      EXPECT_EQ(at.vx[0], 0);
      EXPECT_EQ(at.vz[0], 0);
      const EnergyLedger energy = disk->energy();
      EXPECT_NEAR(energy.dissipated_on_plates, 0.5 * speed * speed, 1e-12 * speed * speed);
      EXPECT_EQ(energy.dissipated, energy.dissipated_on_plates);
      EXPECT_EQ(energy.kinetic, 0);
    }
  }
}

// Gravity in the plane and friction together: at the ends of intervals it is on its exact path.
TEST(Plates, LeadADiskUnderGravityAlongItsExactPath) {
  for (const double ratio : {0.3, 0.8, 1.3}) {
    const Hodograph path{1, ratio, 0.2L};
    const Hodograph::Point a = path.at(6), b = path.at(0.7);
    const auto time = static_cast<double>(b.time - a.time);
    for (const double parts : {4.0, 37.0, 500.0}) {
      // Heights count upwards, the pull acts downwards.
      const auto disk =
          simulate(one_disk(static_cast<double>(a.v_across), -static_cast<double>(a.v_along), {ratio, time / parts}));
      disk->advance_to(time * (1 + 1e-12));
      const Snapshot at = snapshot_of(*disk);
      EXPECT_NEAR(at.x[0], 200 + static_cast<double>(b.across - a.across), 1e-5);
      EXPECT_NEAR(at.z[0], 200 - static_cast<double>(b.along - a.along), 1e-5);
      EXPECT_NEAR(at.vx[0], static_cast<double>(b.v_across), 1e-5);
      EXPECT_NEAR(at.vz[0], -static_cast<double>(b.v_along), 1e-5);
      EXPECT_NEAR(disk->energy().imbalance(), 0, 1e-10);
    }
  }
}

// Friction as large as gravity holds a disk that rests; it moves with plates that move.
TEST(Plates, HoldADiskThatRests) {
  Scene scene = one_disk(0, 0, {1.4, 0.02});
  const auto still = simulate(scene);
  still->advance_to(7.1234);
  EXPECT_NEAR(snapshot_of(*still).z[0], 200, 1e-4 / 2) << "it hops by g h^2/8";
  EXPECT_NEAR(snapshot_of(*still).vz[0], 0, 1e-13);
  EXPECT_NEAR(still->energy().dissipated, 0, 1e-4);
  scene.box.floor = SinusoidalFloor{0.8, 0.1};  // 0.32 g
  scene.start = PlacedStart{{{200, 200, 0, 2 * 3.14159265358979 * 0.08, 0, 0}}};
  const auto moved = simulate(scene);
  for (int k = 1; k <= 20; ++k) {
    moved->advance_to(0.61 * k);
    const Snapshot at = snapshot_of(*moved);
    EXPECT_NEAR(at.z[0], 200 + at.floor_position, 1e-4);
    EXPECT_NEAR(at.vz[0], at.floor_velocity, 1e-3);
    EXPECT_NEAR(moved->energy().imbalance(), 0, 1e-10);
  }
}

// The exact heights of a disk that bounces straight up and down between rubbing plates on a floor at rest.
double exact_height(double speed, double a, double restitution, double time) {
  double up = speed;
  for (;;) {
    const double rising = up / (1 + a), top = 0.5 * up * rising, falling = std::sqrt(2 * top / (1 - a));
    if (time < rising) return 0.5 + (up - 0.5 * (1 + a) * time) * time;
    if (time < rising + falling) return 0.5 + top - 0.5 * (1 - a) * (time - rising) * (time - rising);
    time -= rising + falling;
    up = restitution * (1 - a) * falling;
  }
}

double bounce_error(double interval, double a, double restitution) {
  Scene scene = one_disk(0, 0, {a, interval});
  scene.box.floor_surface = Surface{restitution, 0, 0};
  double squares = 0;
  int looks = 0;
  for (const double speed : {1.9, 2.0, 2.03, 2.11, 2.17, 2.23, 2.31, 2.4}) {
    scene.start = PlacedStart{{{200, 0.5 + 1e-13, 0, speed, 0, 0}}};
    const auto disk = simulate(scene);
    for (const double time : {4.51, 4.77, 5.03, 5.21}) {  // after the first bounce, before they are endless
      disk->advance_to(time);
      const double error = snapshot_of(*disk).z[0] - exact_height(speed, a, restitution, time);
      squares += error * error;
      ++looks;
    }
  }
  return std::sqrt(squares / looks);
}

// A contact has the velocity of its flight, which is wrong by up to half of deceleration times interval: first order.
TEST(Plates, HaveAnErrorOfTheFirstOrderInTheIntervalAtContacts) {
  const double a = 0.3, e = 0.7;
  const double coarse = bounce_error(0.08, a, e), middle = bounce_error(0.02, a, e), fine = bounce_error(0.005, a, e);
  const double order = std::log(coarse / fine) / std::log(16.0);
  RecordProperty("order", std::to_string(order));
  std::printf("error of the height %.3g %.3g %.3g D at intervals 0.08, 0.02, 0.005: order %.2f\n", coarse, middle, fine,
              order);
  EXPECT_GT(order, 0.8);
  EXPECT_LT(fine, a * 0.005) << "deceleration times interval";
}

// Between contacts the plates' own motion counts with its mean acceleration of an interval: second order.
TEST(Plates, HaveAnErrorOfTheSecondOrderWhereTheyShake) {
  const auto end = [](double interval) {
    Scene scene = one_disk(0.9, 1.3, {0.2, interval});
    scene.box.floor = SinusoidalFloor{0.6, 0.2};
    scene.start = PlacedStart{{{200, 200, 0.9, 1.3, 0, 0}}};
    const auto disk = simulate(scene);
    disk->advance_to(8 * (1 + 1e-12));
    return snapshot_of(*disk);
  };
  const Snapshot exact = end(0.0005);
  const auto error = [&](double interval) {
    const Snapshot at = end(interval);
    return std::hypot(at.x[0] - exact.x[0], at.z[0] - exact.z[0]);
  };
  const double coarse = error(0.16), fine = error(0.02), order = std::log(coarse / fine) / std::log(8.0);
  std::printf("error of the place %.3g, %.3g D at intervals 0.16, 0.02: order %.2f\n", coarse, fine, order);
  EXPECT_GT(order, 1.7);
}

Scene shaken_between_plates(bool follow) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{100, 1, 1}};
  scene.disks.contact = scene.box.floor_surface = Surface{0.9, 0, 0};
  scene.disks.contact_duration = 1e-4;
  scene.box.width = 12.3;
  scene.box.sides = HardSides{Surface{0.9, 0, 0}};
  scene.box.floor = SinusoidalFloor{2.5 / std::pow(2 * 3.14159265358979 * 0.35, 2), 0.35};
  scene.box.plates = RubbingPlates{0.25, 0.01, follow};
  return scene;
}

TEST(Plates, CloseTheLedgerOfAShakenBed) {
  for (const bool follow : {false, true}) {
    const auto bed = simulate(shaken_between_plates(follow));
    for (int k = 1; k <= 30; ++k) {
      bed->advance_to(1.37 * k);
      const EnergyLedger energy = bed->energy();
      EXPECT_NEAR(energy.imbalance(), 0, 1e-9 * (energy.dissipated + energy.initial));
    }
    const EnergyLedger energy = bed->energy();
    EXPECT_GT(energy.dissipated_on_plates, 0);
    EXPECT_LT(energy.dissipated_on_plates, energy.dissipated);
    EXPECT_LT(bed->largest_overlap(), hard_overlap);
  }
}

std::vector<Scene> scenes_between_plates() {
  std::vector<Scene> scenes(5, shaken_between_plates(true));
  scenes[1].box.plates = RubbingPlates{1.4, 0.013, false};
  scenes[1].bath = LangevinBath{2, 1, 0.37};
  scenes[2].disks.contact.friction = 0.3;
  scenes[2].disks.species = {{60, 1, 1}, {40, 1.4, 2.744}};
  scenes[2].box.sides = PeriodicSides{};
  scenes[3].gravity = Weightless{};
  scenes[3].disks.contact = Surface{0.95, 0, 0};
  scenes[3].box.top = Lid{14, {}};
  scenes[4] = scenes[2];
  scenes[4].box.plates = RubbingPlates{0.25, 0.01, true, 0.2};
  return scenes;
}

TEST(Plates, GoOnFromACheckpointToTheSameBytes) {
  for (const Scene& scene : scenes_between_plates()) {
    const auto a = simulate(scene), b = simulate(scene);
    std::vector<std::uint8_t> saved;
    while (a->time() < 10) {
      a->advance_to(a->next_synchronisation());
      saved = a->checkpoint();
    }
    b->restore(saved);
    expect_same_bytes(*a, *b);
    a->advance_to(17);
    b->advance_to(17);
    expect_same_bytes(*a, *b);
  }
}

TEST(Plates, DoNotCareWhenOneLooks) {
  for (const Scene& scene : scenes_between_plates()) {
    const auto a = simulate(scene), b = simulate(scene);
    a->advance_to(10);
    for (int i = 1; i <= 250; ++i) {
      b->advance_to(0.04 * i);
      snapshot_of(*b);
    }
    b->advance_to(10);
    expect_same_bytes(*a, *b);
  }
}

// A bed that dissipates only on its plates is slower than one on smooth plates, by what the ledger says.
TEST(Plates, CoolABedThatIsElasticOtherwise) {
  Scene scene;
  scene.gravity = Weightless{};
  scene.disks.species = {{64, 1, 1}};
  scene.box.width = 16;
  scene.box.sides = PeriodicSides{};
  scene.box.top = PeriodicTop{16};
  scene.box.plates = RubbingPlates{0.05, 0.01};
  const auto gas = simulate(scene);
  gas->advance_to(10);
  const EnergyLedger energy = gas->energy();
  EXPECT_NEAR(energy.kinetic, energy.initial - energy.dissipated_on_plates, 1e-10 * energy.initial);
  // d<v^2/2>/dt = -a <v>, and <v> >= 0.79 sqrt(T) for any distribution between a Maxwellian and equal speeds.
  EXPECT_LT(energy.kinetic, 0.5 * energy.initial);
  gas->advance_to(120);
  EXPECT_EQ(gas->energy().kinetic, 0) << "all have come to rest";
}

TEST(Plates, NeedADecelerationAndAnIntervalThatResolvesTheFloor) {
  const auto problems = [](const RubbingPlates& plates) {
    Scene scene = shaken_between_plates(true);
    scene.box.plates = plates;
    std::vector<std::string> where;
    for (const SceneProblem& problem : check(scene)) where.push_back(problem.where);
    return where;
  };
  EXPECT_TRUE(problems({0.1, 0.1}).empty());
  EXPECT_EQ(problems({0, 0.1}), std::vector<std::string>{"/box/plates"});
  EXPECT_EQ(problems({0.1, 0}), std::vector<std::string>{"/box/plates/interval"});
  EXPECT_EQ(problems({0.1, 0.2}), std::vector<std::string>{"/box/plates/interval"}) << "the period is 2.86";
  EXPECT_TRUE(problems({0.1, 0.1, true, 0.5}).empty());
  EXPECT_EQ(problems({0.1, 0.1, true, 0.51}), std::vector<std::string>{"/box/plates/contact_radius"});
}

}  // namespace
