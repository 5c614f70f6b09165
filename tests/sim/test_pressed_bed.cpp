// Beds that are pressed on the floor and go on as soft disks: the springs by themselves, and the engine that decides
// when.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "sim/engine/pressed_bed.hpp"
#include "sim/engine/random.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/measure/flights.hpp"
#include "sim/measure/observables.hpp"
#include "tests/sim/snapshot_of.hpp"

namespace shakebed::sim {
namespace {

constexpr FloorMotion::Motion still{0, 0, 0};

PressedBed soft_disks(double restitution, double width = 10, double period = 0) {
  const Surface surface{restitution, 0, 0};
  PressedBed bed;
  bed.set_up({width, period, never}, {surface, surface, surface, surface});
  return bed;
}

// Ten rows of 2 mm disks at 30 Hz.
Scene pressed_scene(double gamma, double width = 12.3) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{120, 1, 1}};
  scene.disks.contact = scene.box.floor_surface = {0.9, 0, 0};
  scene.disks.contact_duration = 1e-4;
  scene.box.width = width;
  scene.box.sides = HardSides{{0.9, 0, 0}};
  scene.box.floor = SinusoidalFloor{gamma / std::pow(2 * std::numbers::pi * 0.428, 2), 0.428};
  scene.start_temperature = 0.01;
  return scene;
}
constexpr double period = 1 / 0.428;

// The squared ratio of the speeds after and before a contact of two disks, mean over the moments of a step at which it
// may begin.
double kept_in_a_contact(double e, double contact_time) {
  constexpr int moments = 101;
  constexpr double speed = 0.01;
  const double step = contact_time / PressedBed::steps_a_contact;
  double squares = 0;
  for (int moment = 0; moment < moments; ++moment) {
    PressedBed bed = soft_disks(e);
    const double gap = 2 * speed * step * (2 + moment / double(moments));
    bed.begin({{4, 20, speed, 0}, {5 + gap, 20, -speed, 0}}, still, contact_time);
    for (int k = 0; k < 20; ++k) bed.step(still, still, step);
    squares += std::pow((bed.at(1, 0).vx - bed.at(0, 0).vx) / (2 * speed), 2) / moments;
  }
  return squares;
}

TEST(PressedBed, LosesInAContactWhatTheRestitutionSays) {
  for (const double e : {0.3, 0.5, 0.9, 0.95, 1.0})
    EXPECT_NEAR(kept_in_a_contact(e, PressedBed::dashpot_time), e * e, 2e-3) << e;
}

// The dashpot is that of the shorter contact and acts four times as long: the speed falls by exp(-4 b pi / w), where
// w^2 = pi^2 + b^2 - (4 b)^2 and e = exp(-b).
TEST(PressedBed, KeepsItsDashpotsWhereContactsLastLonger) {
  for (const double e : {0.92, 0.95}) {
    const double b = -std::log(e), w = std::sqrt(std::pow(std::numbers::pi, 2) - 15 * b * b);
    const double kept = std::exp(-8 * b * std::numbers::pi / w);
    EXPECT_NEAR(kept_in_a_contact(e, 4 * PressedBed::dashpot_time), kept, 0.02) << e;
  }
  // As strong as steps can follow already.
  EXPECT_NEAR(kept_in_a_contact(0.5, 4 * PressedBed::dashpot_time), 0.25, 2e-3);
}

// A contact across a periodic side is that of the same disks in the middle.
TEST(PressedBed, HasContactsAcrossPeriodicSides) {
  constexpr double contact_time = 0.005, step = contact_time / PressedBed::steps_a_contact;
  const auto velocities = [](double left, double right) {
    PressedBed bed = soft_disks(0.8, 10, 10);
    bed.begin({{left, 20, 0.05, 0}, {right, 20.6, -0.05, 0.01}}, still, contact_time);
    for (int k = 0; k < 20; ++k) bed.step(still, still, step);
    return std::vector{bed.at(0, 0).vx, bed.at(0, 0).vz, bed.at(1, 0).vx, bed.at(1, 0).vz};
  };
  const std::vector<double> middle = velocities(4, 4.8002), across = velocities(9.5, 0.3002);
  EXPECT_LT(middle[0], 0.04) << "they have touched";
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(across[i], middle[i], 1e-9) << i;
}

TEST(PressedBed, ConservesMomentumBetweenDisks) {
  Random random(3);
  std::vector<PressedBed::State> disks;
  for (int i = 0; i < 40; ++i)
    disks.push_back({2 + i % 8 * 0.999, 20 + i / 8 * 0.999, 0.1 * random.normal_pair().first, 0.1});
  PressedBed bed = soft_disks(0.8, 100);
  double before = 0, after = 0;
  for (const auto& disk : disks) before += disk.vx;
  bed.begin(disks, still, 0.005);
  for (int k = 0; k < 500; ++k) bed.step(still, still, 1e-3);
  double fall = 0;
  for (std::uint32_t i = 0; i < 40; ++i) {
    after += bed.at(i, 0).vx;
    fall += (0.1 - bed.at(i, 0).vz) / 40;
  }
  EXPECT_NEAR(after, before, 1e-12);
  EXPECT_NEAR(fall, 0.5, 1e-12);
}

// But for rounding, which grows by the order in which forces are summed.
TEST(PressedBed, OfAMirroredBedIsTheMirroredOne) {
  Random random(5);
  std::vector<PressedBed::State> disks, mirrored;
  for (int i = 0; i < 45; ++i) {
    const double x = 0.6 + i % 9 * 1.04 + i / 9 % 2 * 0.4;
    disks.push_back({x, 0.5 + i / 9 * 0.9, 0.05 * random.normal_pair().first, 0.05 * random.normal_pair().first});
    mirrored.push_back({10 - x, disks.back().z, -disks.back().vx, disks.back().vz});
  }
  PressedBed a = soft_disks(0.9), b = soft_disks(0.9);
  a.begin(disks, still, 0.005);
  b.begin(mirrored, still, 0.005);
  for (int k = 0; k < 300; ++k) {
    a.step(still, still, 8e-4);
    b.step(still, still, 8e-4);
  }
  EXPECT_GT(a.damped(), 0.1);
  for (std::uint32_t i = 0; i < 45; ++i) {
    EXPECT_NEAR(a.at(i, 0).x, 10 - b.at(i, 0).x, 1e-8);
    EXPECT_NEAR(a.at(i, 0).z, b.at(i, 0).z, 1e-8);
  }
}

TEST(PressedBed, CarriesAColumnAtRestContactByContact) {
  constexpr std::uint32_t count = 8;
  std::vector<PressedBed::State> disks;
  for (std::uint32_t i = 0; i < count; ++i) disks.push_back({5, 0.5 + i, 0, 0});
  PressedBed bed = soft_disks(0.5);
  bed.begin(disks, still, 0.005);
  for (int k = 0; k < 60'000; ++k) bed.step(still, still, 8e-4);
  EXPECT_NEAR(bed.floor_force(), count, 1e-9);
  std::vector<double> forces;
  bed.each_contact([&](TwoLanes, TwoLanes, TwoLanes force) { forces.push_back(force[1]); });
  std::sort(forces.begin(), forces.end());
  ASSERT_EQ(forces.size(), count - 1);
  for (std::uint32_t i = 0; i + 1 < count; ++i) EXPECT_NEAR(forces[i], i + 1, 1e-9);
}

// Two disks that meet with dashpots: energy that is neither motion nor compression is damped, at every step of a
// contact and not only at its end.
TEST(PressedBed, HasDampedAtEveryStepWhatIsLost) {
  PressedBed bed = soft_disks(0.6);
  constexpr double lasts = 1e-3, speed = 0.4, step = lasts / 40;
  bed.begin({{3, 10, speed, 0}, {4.00005, 10, -speed, 0}}, still, lasts);
  const auto energy = [&] {
    double sum = bed.compressed() + bed.damped();
    for (std::uint32_t i = 0; i < 2; ++i) {
      const PressedBed::State at = bed.at(i, 0);
      sum += at.z + 0.5 * (at.vx * at.vx + at.vz * at.vz);
    }
    return sum;
  };
  const double before = energy();
  for (int k = 0; k < 60; ++k) {
    bed.step(still, still, step);
    EXPECT_NEAR(energy(), before, 0.003 * speed * speed) << k;
  }
  EXPECT_GT(bed.damped(), 0.5 * (1 - 0.36) * speed * speed);
}

// What disks fall by is in the springs, in the dashpots or still motion: to the order of the steps.
TEST(PressedBed, ClosesItsEnergyByItsStepsAlone) {
  double last = 0;
  for (const double step : {8e-4, 2e-4}) {
    std::vector<PressedBed::State> disks;
    for (int i = 0; i < 40; ++i) disks.push_back({1 + i % 8 * 1.01 + i / 8 % 2 * 0.5, 0.55 + i / 8 * 0.92, 0, 0});
    PressedBed bed = soft_disks(0.9);
    bed.begin(disks, still, 0.005);
    const auto mechanical = [&bed] {
      double sum = bed.compressed();
      for (std::uint32_t i = 0; i < 40; ++i) {
        const PressedBed::State at = bed.at(i, 0);
        sum += at.z + 0.5 * (at.vx * at.vx + at.vz * at.vz);
      }
      return sum;
    };
    const double before = mechanical();
    for (int k = 0; k * step < 1; ++k) bed.step(still, still, step);
    EXPECT_GT(bed.damped(), 0.5);
    const double missing = std::abs(before - mechanical() - bed.damped()) / bed.damped();
    EXPECT_LT(missing, 0.1);
    if (last > 0) {
      EXPECT_LT(missing, 0.5 * last);
    }
    last = missing;
  }
}

TEST(PressedBed, MovesApartWhatOverlaps) {
  std::vector<PressedBed::State> disks;
  for (int i = 0; i < 40; ++i) disks.push_back({0.4995 + i % 8 * 0.9993, 0.4998 + i / 8 * 0.9995, 0, 0});
  PressedBed bed = soft_disks(0.9);
  bed.begin(disks, still, 0.005);
  ASSERT_GT(bed.compressed(), 1e-3);
  bed.separate(0, 1e-13, 500);
  EXPECT_LT(bed.compressed(), 1e-20);
}

// The second width is that of twelve disks: rows lock.
TEST(PressedBed, OfTheEngineKeepsTheLedgerAndItsOverlaps) {
  for (const double width : {12.3, 12.0}) {
    for (const double gamma : {1.2, 1.6}) {
      SCOPED_TRACE(gamma);
      const auto bed = simulate(pressed_scene(gamma, width));
      double deepest = 0;
      for (int k = 1; k <= 1000; ++k) {
        bed->advance_to(0.031 * k);
        const EnergyLedger ledger = bed->energy();
        ASSERT_NEAR(ledger.imbalance(), 0, 1e-10 * (ledger.dissipated + ledger.initial));
        deepest = std::max(deepest, bed->largest_overlap());
        EXPECT_EQ(precision_lost(*bed), "");
      }
      const EnergyLedger ledger = bed->energy();
      EXPECT_GT(deepest, 1e-6);  // it was pressed
      EXPECT_LT(deepest, soft_overlap / 2);
      EXPECT_LT(std::abs(ledger.step_error), 0.15 * ledger.dissipated);
    }
  }
}

// Forty rows that have softened while they lay. Their springs would be compressed by more than 0.01 D, which stops a
// run.
TEST(PressedBed, LandsHarderThanItLay) {
  Scene scene = pressed_scene(2, 15);
  scene.disks.species = {{600, 1, 1}};
  scene.disks.contact = scene.box.floor_surface = {0.6, 0, 0};
  scene.box.sides = HardSides{{0.6, 0, 0}};
  const auto bed = simulate(scene);
  double deepest = 0;
  for (int k = 1; k <= 640; ++k) {
    bed->advance_to(k / 64.0 * period);
    deepest = std::max(deepest, bed->largest_overlap());
  }
  EXPECT_GT(deepest, 1e-4);  // it was pressed
  EXPECT_LT(deepest, 0.6 * soft_overlap);
}

TEST(PressedBed, DoesNotCareWhoLooksNorWhen) {
  for (const double gamma : {0.8, 1.2, 1.6}) {
    const Scene scene = pressed_scene(gamma);
    const auto alone = simulate(scene), looked_at = simulate(scene), watched = simulate(scene);
    FlightObserver observer(scene, watched->properties(), LayerGrid{-1, 0.5, 60});
    watched->watch(&observer);
    observer.begin(0);
    alone->advance_to(9.7);
    watched->advance_to(9.7);
    Snapshot at;
    for (int k = 1; k <= 10'000; ++k) {
      looked_at->advance_to(k == 10'000 ? 9.7 : 9.7e-4 * k);
      looked_at->snapshot(at);
    }
    expect_same_bytes(*alone, *looked_at);
    expect_same_bytes(*alone, *watched);
  }
}

// Between two steps disks are where they fly: no look sees a jump.
TEST(PressedBed, MovesWithoutJumps) {
  const auto bed = simulate(pressed_scene(1.6));
  bed->advance_to(6 * period);
  Snapshot before, after;
  bed->snapshot(before);
  double farthest = 0;
  for (int k = 1; k <= 4000; ++k) {
    bed->advance_to(6 * period + 1e-4 * k);
    bed->snapshot(after);
    for (std::size_t i = 0; i < after.z.size(); ++i)
      farthest = std::max(farthest, std::abs(after.z[i] - before.z[i] - 0.5e-4 * (after.vz[i] + before.vz[i])));
    std::swap(before, after);
  }
  EXPECT_LT(farthest, 5e-4);
}

TEST(PressedBed, GoesOnFromACheckpointToTheSameBytes) {
  int pressed = 0;
  for (const double gamma : {0.8, 1.2, 1.6}) {
    for (const double saved_at : {10.0, 25.0}) {
      const Scene scene = pressed_scene(gamma);
      const auto a = simulate(scene);
      while (a->time() < saved_at) a->advance_to(a->next_synchronisation());
      const auto b = simulate(scene);
      b->restore(a->checkpoint());
      pressed += a->energy().compressed > 0;
      a->advance_to(saved_at + 20);
      b->advance_to(saved_at + 20);
      expect_same_bytes(*a, *b);
    }
  }
  EXPECT_GE(pressed, 3);
}

TEST(PressedBed, ReturnsWhenItIsAskedTo) {
  const auto a = simulate(pressed_scene(1.6)), b = simulate(pressed_scene(1.6));
  a->advance_to(8);
  double longest = 0;
  for (bool arrived = false; !arrived;) {
    const double before = b->time();
    arrived = b->advance_towards(8, 500);
    if (b->energy().compressed > 0) longest = std::max(longest, b->time() - before);
  }
  EXPECT_LT(longest, 0.1);
  expect_same_bytes(*a, *b);
}

// Locked rows, too: hard disks would make 2 million contacts a period.
TEST(PressedBed, SleepsOnAFloorThatNeverFallsAway) {
  for (const double width : {12.3, 12.0}) {
    const auto bed = simulate(pressed_scene(0.7, width));
    bed->advance_to(10 * period);
    const Counters before = bed->counters();
    Snapshot first, later;
    bed->snapshot(first);
    for (int k = 1; k <= 50; ++k) {
      bed->advance_to(10 * period + 0.1 * k);
      bed->snapshot(later);
      for (std::size_t i = 0; i < first.z.size(); ++i) {
        ASSERT_NEAR(later.x[i], first.x[i], 1e-12);
        ASSERT_NEAR(later.z[i] - later.floor_position, first.z[i] - first.floor_position, 1e-6);
      }
    }
    EXPECT_EQ(bed->counters().events(), before.events());
    EXPECT_NEAR(bed->energy().imbalance(), 0, 1e-10 * bed->energy().dissipated);
  }
}

TEST(PressedBed, PressesOnTheFloorWithItsWeight) {
  for (const double gamma : {0.8, 1.2, 1.6}) {
    const Scene scene = pressed_scene(gamma);
    const auto bed = simulate(scene);
    bed->advance_to(10 * period);
    FlightObserver observer(scene, bed->properties(), LayerGrid{-1, 0.5, 60});
    bed->watch(&observer);
    observer.begin(bed->time());
    for (int k = 1; k <= 20; ++k) {
      bed->advance_to((10 + k) * period);
      observer.end_block(bed->time());
    }
    const double weight = 120 / 12.3;
    EXPECT_NEAR(observer.floor_pressure().value, weight, 0.01 * weight) << gamma;
  }
}

// Whether and when a few rows go on as soft disks: laid on the floor or, if they are rough, shaken gently below a lid.
std::optional<double> pressed_first_at(const Scene& scene, double until) {
  const auto bed = simulate(scene);
  for (double time = 0.02; time <= until; time += 0.02) {
    bed->advance_to(time);
    if (bed->energy().compressed > 0) return time;
  }
  return {};
}
Scene few_rows(double friction, bool lid) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{16, 1, 1}};
  scene.disks.contact = scene.box.floor_surface = {0.6, friction, 0};
  scene.disks.contact_duration = 1e-4;
  scene.box.width = 4.6;
  scene.box.sides = HardSides{{0.6, friction, 0}};
  if (lid) scene.box.top = Lid{6, {0.6, friction, 0}};
  if (friction > 0) scene.box.floor = SinusoidalFloor{1.2 / std::pow(2 * std::numbers::pi * 0.428, 2), 0.428};
  scene.start_temperature = 0.01;
  return scene;
}

// Springs whose dashpots would need shorter steps, or that no tangential spring can follow, leave a bed to its events.
// So do boxes in which a disk has two images, contacts without a duration or with a restitution that varies, and baths.
TEST(PressedBed, IsTakenForOneWithinItsLimits) {
  const auto laid = [](const auto& change) {
    Scene scene = few_rows(0, false);
    change(scene);
    return pressed_first_at(scene, 0.1).has_value();
  };
  EXPECT_TRUE(laid([](Scene&) {}));
  EXPECT_FALSE(laid([](Scene& s) { s.presses = false; }));
  EXPECT_FALSE(laid([](Scene& s) { s.disks.contact_duration = 0; }));
  EXPECT_FALSE(laid([](Scene& s) { s.disks.contact.law = RestitutionLaw::power; }));
  EXPECT_FALSE(laid([](Scene& s) { s.bath = LangevinBath{0.01, 1e-3, 0.1}; }));
  for (const double width : {4.0, 3.99}) EXPECT_EQ(laid([width](Scene& s) { s.box.width = width; }), width >= 4);
  struct Kind {
    const char* name;
    Surface& (*of)(Scene&);
  };
  const Kind kinds[] = {{"disks", [](Scene& s) -> Surface& { return s.disks.contact; }},
                        {"sides", [](Scene& s) -> Surface& { return std::get<HardSides>(s.box.sides).surface; }},
                        {"floor", [](Scene& s) -> Surface& { return s.box.floor_surface; }},
                        {"lid", [](Scene& s) -> Surface& { return std::get<Lid>(s.box.top).surface; }}};
  for (const Kind& kind : kinds) {
    SCOPED_TRACE(kind.name);
    Scene smooth = few_rows(0, kind.name == std::string("lid")), rough = few_rows(0.5, true);
    kind.of(smooth).restitution = 0.3;
    const std::optional<double> smooth_since = pressed_first_at(smooth, 3);
    ASSERT_TRUE(smooth_since);
    kind.of(smooth).restitution = 0.29;
    EXPECT_FALSE(pressed_first_at(smooth, *smooth_since + 0.1));
    kind.of(rough).tangential_restitution = -0.3;
    const std::optional<double> rough_since = pressed_first_at(rough, 5);
    ASSERT_TRUE(rough_since);
    kind.of(rough).tangential_restitution = -0.31;
    EXPECT_FALSE(pressed_first_at(rough, *rough_since + 0.1));
  }
  // Without friction nothing slips back.
  Scene slippery = few_rows(0.5, true);
  std::get<Lid>(slippery.box.top).surface = {0.6, 0, -0.5};
  EXPECT_TRUE(pressed_first_at(slippery, 5));
}

// Well shaken beds are not touched, not even by rounding.
TEST(PressedBed, LeavesWellShakenBedsAlone) {
  for (const double gamma : {4.0, 6.0}) {
    Scene scene = pressed_scene(gamma), hard = scene;
    hard.presses = false;
    const auto a = simulate(scene), b = simulate(hard);
    a->advance_to(20 * period);
    b->advance_to(20 * period);
    expect_same_bytes(*a, *b);
  }
}

// The last frame of a bed may be the start of another one.
// Out of floor and lid by what they overlap, and no farther; not where they overlap by more than is allowed.
TEST(PressedBed, StartsOutOfFloorAndLid) {
  Scene scene = pressed_scene(1.6);
  scene.box.floor = StillFloor{};
  scene.disks.species[0].count = 2;
  scene.box.top = Lid{8, {}};
  const auto placed = [&](double deep) {
    scene.start = PlacedStart{{{3, 0.5 - deep, 0, 0, 0, 0}, {6, 7.5 + deep, 0, 0, 0, 0}}};
    Snapshot moved;
    simulate(scene)->snapshot(moved);
    return moved.z;
  };
  const std::vector<double> apart = placed(0.6 * soft_overlap);
  EXPECT_NEAR(apart[0], 0.5, 1e-12);
  EXPECT_NEAR(apart[1], 7.5, 1e-12);
  EXPECT_THROW(placed(1.1 * soft_overlap), std::runtime_error);
}

TEST(PressedBed, MayBeTheStartOfAnotherBed) {
  Scene scene = pressed_scene(1.6);
  const auto bed = simulate(scene);
  Snapshot at;
  double overlap = 0;
  for (double time = 10 * period; overlap < 1e-6; time += 0.05) {
    bed->advance_to(time);
    bed->snapshot(at);
    overlap = bed->largest_overlap();
  }
  PlacedStart start;
  for (std::size_t i = 0; i < at.x.size(); ++i)
    start.disks.push_back({at.x[i], at.z[i] - at.floor_position, at.vx[i], at.vz[i], 0, 0});
  scene.start = start;
  const auto next = simulate(scene);
  EXPECT_LT(next->largest_overlap(), 1e-12);
  start.disks[0].x = start.disks[1].x;
  start.disks[0].z = start.disks[1].z + 0.9;
  scene.start = start;
  EXPECT_THROW(simulate(scene), std::runtime_error);
}

}  // namespace
}  // namespace shakebed::sim
