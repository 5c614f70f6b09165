// Beds of rough disks that are pressed on the floor: the tangential springs by themselves, and the engine that decides
// when.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <variant>
#include <vector>

#include "sim/engine/collision.hpp"
#include "sim/engine/pressed_bed.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/measure/flights.hpp"
#include "sim/measure/observables.hpp"
#include "tests/sim/snapshot_of.hpp"

namespace shakebed::sim {
namespace {

constexpr FloorMotion::Motion resting_floor{0, 0, 0};
constexpr double of_a_sphere = 2.5, of_a_disk = 2;  // 1/q

PressedBed rough_disks(const Surface& surface, double inverse_inertia_ratio, double width = 10) {
  PressedBed bed;
  bed.set_up({width, 0, never}, {surface, Surface{surface.restitution, 0, 0}, surface, surface}, inverse_inertia_ratio);
  return bed;
}

double energy_of(const PressedBed& bed, std::uint32_t count, double inverse_inertia_ratio) {
  double sum = bed.compressed();
  for (std::uint32_t i = 0; i < count; ++i) {
    const PressedBed::State at = bed.at(i, 0);
    const double rim = 0.5 * bed.spin_at(i, 0);
    sum += at.z + 0.5 * (at.vx * at.vx + at.vz * at.vz + rim * rim / inverse_inertia_ratio);
  }
  return sum;
}

// Two disks that meet obliquely leave as the rule of hard rough disks says: where the contact sticks and where it
// slides.
TEST(PressedRoughBed, DoesInAContactWhatTheRuleOfRoughDisksDoes) {
  constexpr double contact_time = 0.005, speed = 0.05;
  for (const double b : {0.9, 0.7, 0.3, 0.0}) {
    for (const double side : {0.2, 0.5, 4.0}) {
      SCOPED_TRACE(testing::Message() << b << " " << side);
      const Surface surface{0.9, 0.3, b};
      constexpr int moments = 40;
      double slip = 0;
      for (int moment = 0; moment < moments; ++moment) {
        PressedBed bed = rough_disks(surface, of_a_sphere);
        const double step = contact_time / bed.steps(), gap = 2 * speed * step * (2 + moment / double(moments));
        bed.begin({{4, 20, speed, side * speed}, {5 + gap, 20, -speed, -side * speed}}, resting_floor, contact_time);
        for (int k = 0; k < 20; ++k) bed.step(resting_floor, resting_floor, step);
        const double rims = 0.5 * (bed.spin_at(0, 0) + bed.spin_at(1, 0));
        slip += (bed.at(0, 0).vz - bed.at(1, 0).vz + rims) / (2 * speed) / moments;
      }
      const RoughImpulse hard = walton_impulse(1, 0, 2, 2 * side, 0.5, surface, of_a_sphere);
      const double expected = side + (1 + of_a_sphere) * hard.tangential;
      EXPECT_NEAR(slip, expected, 0.05 * std::max(side, 1.0));
    }
  }
}

TEST(PressedRoughBed, ConservesMomentumAndAngularMomentumInContacts) {
  const Surface surface{0.8, 0.4, 0.3};
  PressedBed bed = rough_disks(surface, of_a_disk, 100);
  std::vector<PressedBed::State> disks;
  std::vector<double> spins;
  for (int i = 0; i < 30; ++i) {
    disks.push_back({20 + i % 6 * 0.999, 50 + i / 6 * 0.999, 0.1 * std::sin(3.0 * i), 0.1 * std::cos(5.0 * i)});
    spins.push_back(std::sin(7.0 * i));
  }
  bed.begin(disks, resting_floor, 0.005, spins);
  const auto momenta = [&bed](double fallen) {
    std::array<double, 3> sum{};
    for (std::uint32_t i = 0; i < 30; ++i) {
      const PressedBed::State at = bed.at(i, 0);
      const double vz = at.vz + fallen, z = at.z + 0.5 * fallen * fallen;
      sum[0] += at.vx;
      sum[1] += vz;
      sum[2] += at.x * vz - z * at.vx + 0.25 / of_a_disk * bed.spin_at(i, 0);
    }
    return sum;
  };
  const auto before = momenta(0);
  constexpr double step = 6e-4;
  for (int k = 0; k < 500; ++k) bed.step(resting_floor, resting_floor, step);
  const auto after = momenta(500 * step);
  EXPECT_GT(bed.damped(), 0.01);
  EXPECT_NEAR(after[0], before[0], 1e-12);
  EXPECT_NEAR(after[1], before[1], 1e-11);
  EXPECT_NEAR(after[2], before[2], 2e-2 * std::abs(before[2]));  // overlaps shorten the levers
}

// Friction slows it down by mu g and spins it up until it rolls: then it keeps 1/(1 + q) of its speed.
TEST(PressedRoughBed, SlidesAndThenRollsOnTheFloor) {
  for (const double inverse : {of_a_sphere, of_a_disk}) {
    constexpr double friction = 0.2, speed = 1, step = 8e-4;
    const Surface surface{0.9, friction, 0};
    PressedBed bed = rough_disks(surface, inverse, 40);
    bed.begin({{5, 0.5, speed, 0}}, resting_floor, 0.007);
    auto go_to = [&, time = 0.0](double until) mutable {
      for (; time < until; time += step) bed.step(resting_floor, resting_floor, step);
      return time;
    };
    const double rolls = speed / (friction * (1 + inverse));
    double time = go_to(0.5 * rolls);
    EXPECT_NEAR(bed.at(0, 0).vx, speed - friction * time, 2e-3);
    EXPECT_NEAR(0.5 * bed.spin_at(0, 0), -inverse * friction * time, 4e-3);
    time = go_to(3 * rolls);
    const double rolling = speed / (1 + 1 / inverse);
    EXPECT_NEAR(bed.at(0, 0).vx, rolling, 2e-3);
    EXPECT_NEAR(0.5 * bed.spin_at(0, 0), -rolling, 2e-3);
    EXPECT_NEAR(bed.at(0, 0).x, 5 + rolls * (speed + rolling) / 2 + rolling * (time - rolls), 4e-3);
    EXPECT_NEAR(bed.damped(), 0.5 * (speed * speed - speed * rolling), 4e-3);
  }
}

// One disk on two that do not touch: it stays where friction is more than tan(15 degrees) = 0.268.
std::vector<PressedBed::State> three_disks() {
  constexpr double apart = 1.0005;
  return {{4.5, 0.5, 0, 0}, {4.5 + apart, 0.5, 0, 0}, {4.5 + apart / 2, 0.5 + std::sqrt(1 - apart * apart / 4), 0, 0}};
}

TEST(PressedRoughBed, StandsOnTwoDisksByFrictionAlone) {
  constexpr double step = 8e-4;
  for (const double b : {0.8, 0.0}) {
    PressedBed bed = rough_disks({0.7, 0.29, b}, of_a_disk);
    bed.begin(three_disks(), resting_floor, 0.007);
    for (int k = 0; k < 20'000; ++k) bed.step(resting_floor, resting_floor, step);
    const PressedBed::State early = bed.at(0, 0);
    EXPECT_NEAR(early.x, 4.5, 1e-3);
    for (int k = 0; k < 200'000; ++k) bed.step(resting_floor, resting_floor, step);
    EXPECT_NEAR(bed.at(0, 0).x, early.x, 1e-9);  // no creep
    EXPECT_NEAR(bed.at(0, 0).z, early.z, 1e-9);
    EXPECT_NEAR(bed.spin_at(0, 0), 0, 1e-9);
    EXPECT_NEAR(bed.floor_force(), 3, 1e-9);
    // The bottom disks are held by friction: it is tan(15 degrees) of the normal force, in both of their contacts.
    bed.each_contact([&](TwoLanes, TwoLanes to, TwoLanes force) {
      const double normal = force[0] * to[0] + force[1] * to[1], side = -force[0] * to[1] + force[1] * to[0];
      EXPECT_NEAR(std::abs(side / normal), 2 - std::numbers::sqrt3, 2e-3);
    });
    bed.each_wall_contact([&](std::uint32_t, bool is_floor, TwoLanes force) {
      EXPECT_TRUE(is_floor);
      EXPECT_NEAR(std::abs(force[0]), 0.5 * (2 - std::numbers::sqrt3), 2e-3);
    });
  }
  PressedBed bed = rough_disks({0.7, 0.25, 0}, of_a_disk);
  bed.begin(three_disks(), resting_floor, 0.007);
  for (int k = 0; k < 20'000; ++k) bed.step(resting_floor, resting_floor, step);
  EXPECT_LT(bed.at(0, 0).x, 4.4);
}

// Not by its springs either: what it has lost is no less than what the dashpots and friction took.
TEST(PressedRoughBed, OnlyLosesEnergyOnAFloorThatStands) {
  const Surface surface{0.9, 0.4, 0.2};
  constexpr std::uint32_t count = 40;
  std::vector<PressedBed::State> disks;
  std::vector<double> spins;
  for (std::uint32_t i = 0; i < count; ++i) {
    disks.push_back({1 + i % 8 * 1.01 + i / 8 % 2 * 0.5, 0.55 + i / 8 * 0.92, 0.1 * std::sin(i), 0});
    spins.push_back(0.3 * std::cos(i));
  }
  for (const double step : {6e-4, 1.5e-4}) {
    PressedBed bed = rough_disks(surface, of_a_sphere);
    bed.begin(disks, resting_floor, 0.005, spins);
    const double first = energy_of(bed, count, of_a_sphere);
    double least = first;
    for (int k = 0; k * step < 2; ++k) {
      bed.step(resting_floor, resting_floor, step);
      const double energy = energy_of(bed, count, of_a_sphere);
      EXPECT_LT(energy, least + 2e-4 * first);
      least = std::min(least, energy);
    }
    EXPECT_GT(bed.damped(), 0.5);
    EXPECT_NEAR(first - energy_of(bed, count, of_a_sphere), bed.damped(), (step > 5e-4 ? 0.1 : 0.05) * bed.damped());
  }
}

// Ten rows of 2 mm disks at 30 Hz. With such a contact duration 2,000 contacts a disk and period are the limit.
Scene rough_scene(double gamma, double width = 12.3, double restitution = 0.9, double contact_duration = 3e-4) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{120, 1, 1}};
  scene.disks.contact = scene.box.floor_surface = {restitution, 0.4, 0};
  scene.disks.inertia_ratio = 0.4;
  scene.disks.contact_duration = contact_duration;
  scene.box.width = width;
  scene.box.sides = HardSides{{restitution, 0, 0}};
  if (gamma > 0) scene.box.floor = SinusoidalFloor{gamma / std::pow(2 * std::numbers::pi * 0.428, 2), 0.428};
  scene.start = RandomStart{};
  scene.start_temperature = 0.01;
  return scene;
}
constexpr double rough_period = 1 / 0.428;

// Twenty-four rows of 3 mm disks at 20 Hz and Gamma = 3.
constexpr double high_bed_period = 2.864;
Scene high_rough_scene(std::uint64_t seed) {
  Scene scene = rough_scene(0, 12.3, 0.6, 5.73e-5);
  scene.disks.species = {{288, 1, 1}};
  scene.disks.contact.friction = scene.box.floor_surface.friction = 0.8;
  scene.box.floor = SinusoidalFloor{3 / std::pow(2 * std::numbers::pi / high_bed_period, 2), 1 / high_bed_period};
  scene.seed = seed;
  return scene;
}

// Hard disks would make contacts there without end: 4 % of such a settling took 25 s.
TEST(PressedRoughBed, ComesToRestOnAFloorThatNeverFallsAway) {
  for (const double gamma : {0.0, 0.3, 0.7}) {
    SCOPED_TRACE(gamma);
    const auto bed = simulate(rough_scene(gamma));
    bed->advance_to(30 * rough_period);
    const std::uint64_t events = bed->counters().events();
    Snapshot first, later;
    bed->snapshot(first);
    bed->advance_to(60 * rough_period);
    bed->snapshot(later);
    EXPECT_EQ(bed->counters().events(), events);
    for (std::size_t i = 0; i < first.z.size(); ++i) {
      ASSERT_NEAR(later.x[i], first.x[i], 1e-4);
      ASSERT_NEAR(later.z[i] - later.floor_position, first.z[i] - first.floor_position, 1e-4);
    }
    EXPECT_NEAR(bed->energy().imbalance(), 0, 1e-10 * bed->energy().dissipated);
  }
}

// Nothing drives it: from the fall to rest its energy only falls.
TEST(PressedRoughBed, OfTheEngineNeverGainsEnergyUnshaken) {
  const auto bed = simulate(rough_scene(0));
  bool pressed = false;
  double least = bed->energy().initial;
  for (int k = 1; k <= 800; ++k) {
    bed->advance_to(0.05 * k);
    const EnergyLedger ledger = bed->energy();
    const double mechanical = ledger.kinetic + ledger.potential + ledger.compressed;
    ASSERT_LT(mechanical, least + 1e-4 * ledger.initial);
    ASSERT_NEAR(ledger.imbalance(), 0, 1e-10 * ledger.initial);
    least = std::min(least, mechanical);
    pressed = pressed || ledger.compressed > 0;
  }
  EXPECT_TRUE(pressed);
}

// The second width is that of twelve disks: rows lock.
TEST(PressedRoughBed, OfTheEngineKeepsTheLedgerAndItsOverlaps) {
  bool was_pressed = false;
  for (const double width : {12.3, 12.0}) {
    for (const double gamma : {0.9, 1.3}) {
      SCOPED_TRACE(testing::Message() << gamma << " " << width);
      const auto bed = simulate(rough_scene(gamma, width, 0.6));
      double deepest = 0;
      for (int k = 1; k <= 260; ++k) {
        bed->advance_to(0.062 * k);
        const EnergyLedger ledger = bed->energy();
        ASSERT_NEAR(ledger.imbalance(), 0, 1e-10 * (ledger.dissipated + ledger.initial));
        deepest = std::max(deepest, bed->largest_overlap());
        was_pressed = was_pressed || ledger.compressed > 0;
        EXPECT_EQ(precision_lost(*bed), "");
      }
      const EnergyLedger ledger = bed->energy();
      EXPECT_LT(deepest, soft_overlap / 2);
      EXPECT_LT(std::abs(ledger.step_error), 0.15 * ledger.dissipated);
    }
  }
  EXPECT_TRUE(was_pressed);
}

// High beds that have softened while they lay there are shaken up again, fly in one piece and land at 1 to 3 sqrt(g D).
// The springs that they lay on would be compressed by 0.01 to 0.02 D.
TEST(PressedRoughBed, LandsHarderThanItLay) {
  bool was_pressed = false;
  for (const std::uint64_t seed : {1, 2}) {
    SCOPED_TRACE(seed);
    Scene scene = high_rough_scene(seed);
    const auto bed = simulate(scene);
    double deepest = 0;
    for (int k = 1; k <= 640; ++k) {
      bed->advance_to(k / 64.0 * high_bed_period);
      deepest = std::max(deepest, bed->largest_overlap());
      was_pressed = was_pressed || bed->energy().compressed > 0;
    }
    const EnergyLedger ledger = bed->energy();
    EXPECT_LT(deepest, 0.7 * soft_overlap);
    EXPECT_LT(std::abs(ledger.step_error), 0.15 * ledger.dissipated);
  }
  EXPECT_TRUE(was_pressed);
}

TEST(PressedRoughBed, GoesOnFromACheckpointToTheSameBytes) {
  int pressed = 0;
  for (const double gamma : {0.8, 1.3}) {
    for (const double saved_at : {10.0, 20.0}) {
      const Scene scene = rough_scene(gamma, 12.3, 0.6);
      const auto a = simulate(scene);
      while (a->time() < saved_at) a->advance_to(a->next_synchronisation());
      const auto b = simulate(scene);
      b->restore(a->checkpoint());
      pressed += a->energy().compressed > 0;
      EXPECT_EQ(a->energy().compressed, b->energy().compressed);
      a->advance_to(saved_at + 10);
      b->advance_to(saved_at + 10);
      expect_same_bytes(*a, *b);
    }
  }
  EXPECT_GE(pressed, 2);
}

TEST(PressedRoughBed, DoesNotCareWhoLooksNorWhen) {
  for (const double gamma : {0.95, 1.3}) {
    const Scene scene = rough_scene(gamma, 12.3, 0.6);
    const auto alone = simulate(scene), looked_at = simulate(scene), watched = simulate(scene);
    FlightObserver observer(scene, watched->properties(), LayerGrid{-1, 0.5, 60});
    watched->watch(&observer);
    observer.begin(0);
    alone->advance_to(9.85);
    watched->advance_to(9.85);
    Snapshot at;
    for (int k = 1; k <= 500; ++k) {
      looked_at->advance_to(k == 500 ? 9.85 : 1.97e-2 * k);
      looked_at->snapshot(at);
    }
    expect_same_bytes(*alone, *looked_at);
    expect_same_bytes(*alone, *watched);
  }
}

TEST(PressedRoughBed, PressesOnTheFloorWithItsWeight) {
  for (const double gamma : {0.8, 1.3}) {
    const Scene scene = rough_scene(gamma, 12.3, 0.6);
    const auto bed = simulate(scene);
    bed->advance_to(10 * rough_period);
    FlightObserver observer(scene, bed->properties(), LayerGrid{-1, 0.5, 60});
    bed->watch(&observer);
    observer.begin(bed->time());
    for (int k = 1; k <= 10; ++k) {
      bed->advance_to((10 + k) * rough_period);
      observer.end_block(bed->time());
    }
    const double weight = 120 / 12.3;
    EXPECT_NEAR(observer.floor_pressure().value, weight, 0.01 * weight) << gamma;
  }
}

// T_x and T_z of a bed of 120, from looks at `phases` moments of each of the periods; read(i) gives {v_x, v_z}.
struct ColdBed {
  static constexpr int phases = 16, periods = 20;
  std::array<double, phases> mean{}, squares{};
  double side_squares = 0;
  template <class Read>
  void look(int phase, Read read) {
    for (std::uint32_t i = 0; i < 120; ++i) {
      const auto [vx, vz] = read(i);
      side_squares += vx * vx;
      mean[static_cast<std::size_t>(phase)] += vz;
      squares[static_cast<std::size_t>(phase)] += vz * vz;
    }
  }
  double temperature_x() const { return side_squares / (120.0 * phases * periods); }
  double temperature_z() const {
    constexpr double looks = 120.0 * periods;
    double sum = 0;
    for (std::size_t k = 0; k < phases; ++k) sum += squares[k] / looks - mean[k] / looks * (mean[k] / looks);
    return sum / phases;
  }
};

// Soft disks all the time, with the contacts with which cold beds land, are what LAMMPS has (tests/physics/reference).
// Hard disks alone, with this contact duration, are far hotter.
TEST(PressedRoughBed, IsAboutAsColdAsSoftDisksThroughout) {
  Scene scene = rough_scene(1.5, 12.3, 0.6, 6e-4);
  scene.disks.contact.friction = scene.box.floor_surface.friction = 0.8;
  const auto temperatures = [&scene](bool presses) {
    scene.presses = presses;
    const auto bed = simulate(scene);
    ColdBed cold;
    Snapshot at;
    for (int k = 0; k < ColdBed::periods * ColdBed::phases; ++k) {
      bed->advance_to((20 + static_cast<double>(k) / ColdBed::phases) * rough_period);
      bed->snapshot(at);
      cold.look(k % ColdBed::phases, [&at](std::uint32_t i) { return std::array{at.vx[i], at.vz[i]}; });
    }
    return cold;
  };
  const ColdBed pressed = temperatures(true), hard = temperatures(false);

  const auto start = simulate(scene);
  Snapshot at;
  start->snapshot(at);
  std::vector<PressedBed::State> disks;
  for (std::uint32_t i = 0; i < 120; ++i) disks.push_back({at.x[i], at.z[i], at.vx[i], at.vz[i]});
  const FloorMotion floor(std::get<SinusoidalFloor>(scene.box.floor));
  constexpr double contact_time = 1e-3;
  constexpr int steps_a_look = 1 + static_cast<int>(rough_period / ColdBed::phases * 8 / contact_time);
  constexpr double step = rough_period / ColdBed::phases / steps_a_look;
  PressedBed bed = rough_disks(scene.disks.contact, of_a_sphere, 12.3);
  bed.begin(disks, floor.motion(0), contact_time);
  ColdBed soft;
  for (int k = 0; k < (20 + ColdBed::periods) * ColdBed::phases; ++k) {
    if (k >= 20 * ColdBed::phases) {
      soft.look(k % ColdBed::phases, [&bed](std::uint32_t i) { return std::array{bed.at(i, 0).vx, bed.at(i, 0).vz}; });
    }
    for (int s = 0; s < steps_a_look; ++s)
      bed.step(floor.motion((k * steps_a_look + s) * step), floor.motion((k * steps_a_look + s + 1) * step), step);
  }
  EXPECT_NEAR(pressed.temperature_x() / soft.temperature_x(), 1, 0.5);
  EXPECT_NEAR(pressed.temperature_z() / soft.temperature_z(), 1, 0.5);
  EXPECT_GT(hard.temperature_x() / soft.temperature_x(), 1.5);
}

// They make no contact as hard disks any more, and never sleep where they fly: the bed hits the floor each time.
TEST(PressedRoughBed, StaysSoftInFlightWhileItIsCold) {
  for (const double gamma : {1.2, 1.5}) {
    const auto bed = simulate(rough_scene(gamma, 12.3, 0.6));
    bed->advance_to(20 * rough_period);
    const std::uint64_t contacts = bed->counters().collisions();
    bool flew = false;
    for (int k = 1; k <= 320; ++k) {
      bed->advance_to((20 + k / 32.0) * rough_period);
      flew = flew || bed->energy().compressed == 0;
      ASSERT_LT(bed->energy().potential, 120 * 8);
    }
    EXPECT_TRUE(flew);
    EXPECT_EQ(bed->counters().collisions(), contacts);
  }
}

// Shaken beds that make fewer contacts a period than the limit are not touched, not even by rounding.
TEST(PressedRoughBed, LeavesShakenBedsAlone) {
  for (const double gamma : {2.0, 3.0, 6.0}) {
    Scene scene = rough_scene(gamma, 12.3, 0.9, 1e-4), hard = scene;
    hard.presses = false;
    const auto a = simulate(scene), b = simulate(hard);
    a->advance_to(30 * rough_period);
    b->advance_to(30 * rough_period);
    expect_same_bytes(*a, *b);
  }
}

}  // namespace
}  // namespace shakebed::sim
