#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "sim/engine/neighbour_lists.hpp"
#include "sim/engine/random.hpp"
#include "sim/engine/shell_grid.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/measure/flights.hpp"

namespace shakebed::sim {
namespace {

Scene shaken_bed() {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{120, 1, 1}};
  scene.disks.contact = {0.9, 0.2, 0};
  scene.disks.inertia_ratio = 0.4;
  scene.disks.contact_duration = 1e-4;
  scene.box.width = 12;
  scene.box.sides = HardSides{{0.9, 0.1, 0}};
  scene.box.floor = SinusoidalFloor{0.8, 0.35};
  scene.box.floor_surface = {0.9, 0.2, 0};
  scene.start_temperature = 0.01;
  return scene;
}

bool same_bytes(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0);
}
void expect_same(const Simulation& a, const Simulation& b) {
  Snapshot sa, sb;
  a.snapshot(sa);
  b.snapshot(sb);
  EXPECT_TRUE(same_bytes(sa.x, sb.x) && same_bytes(sa.z, sb.z) && same_bytes(sa.vx, sb.vx) &&
              same_bytes(sa.vz, sb.vz) && same_bytes(sa.spin, sb.spin));
  EXPECT_EQ(a.counters().collisions(), b.counters().collisions());
}

TEST(Engine, GivesTheSameBytesForTheSameSeed) {
  const Scene scene = shaken_bed();
  const auto a = simulate(scene), b = simulate(scene);
  a->advance_to(200);
  b->advance_to(200);
  expect_same(*a, *b);
}

Scene fluid() {
  Scene scene;
  scene.gravity = Weightless{};
  scene.disks.species = {{144, 1, 1}};
  scene.box.width = 13.66;  // area fraction 0.70
  scene.box.sides = PeriodicSides{};
  scene.box.top = PeriodicTop{13.66 * std::numbers::sqrt3 / 2};
  scene.start = HexagonalStart{12, 0};
  return scene;
}

// Shaken with Gamma = 1.3 in a box in which rows do not lock: it lands, comes to rest and takes off again.
Scene gentle_bed(double gamma = 1.3) {
  Scene scene = shaken_bed();
  scene.box.width = 12.3;
  scene.box.floor = SinusoidalFloor{gamma / std::pow(2 * std::numbers::pi * 0.35, 2), 0.35};
  return scene;
}

// The same by contacts of hard disks alone: it rests by engine_rest.hpp.
Scene resting_bed(double gamma = 1.3) {
  Scene scene = gentle_bed(gamma);
  scene.presses = false;
  return scene;
}

// 5 to 30 disks in rows of random length, close above one another, in a box 1.2 to 4 D wide; every second floor shakes
// with Gamma from 0.2 to 1.5, every third stack is rough.
Scene random_stack(std::uint64_t seed) {
  Random random(seed);
  const auto between = [&](double low, double high) { return low + (high - low) * random.uniform_positive(); };
  Scene scene;
  scene.gravity = UniformGravity{};
  const auto count = static_cast<std::uint32_t>(between(5, 30));
  scene.disks.species = {{count, 1, 1}};
  const Surface surface{between(0, 0.6), seed % 3 == 1 ? between(0, 0.5) : 0, 0};
  scene.disks.contact = scene.box.floor_surface = surface;
  scene.disks.contact_duration = 1e-3;
  scene.box.width = between(1.2, 4);
  scene.box.sides = HardSides{surface};
  double z = 0.51;
  if (seed % 2 == 1) {
    const double frequency = between(0.1, 0.5);
    const double amplitude = between(0.2, 1.5) / std::pow(2 * std::numbers::pi * frequency, 2);
    scene.box.floor = SinusoidalFloor{amplitude, frequency};
    z += amplitude;
  }
  PlacedStart start;
  while (start.disks.size() < count) {
    const double fit = std::floor(scene.box.width / 1.01);
    const auto row = static_cast<int>(std::min(std::ceil(between(0, fit)), double(count - start.disks.size())));
    const double gap = scene.box.width / row, play = (gap - 1.005) / 2;
    for (int k = 0; k < row; ++k) start.disks.push_back({gap * (k + 0.5) + between(-play, play), z, 0, 0, 0, 0});
    z += between(1.0001, 1.3);
  }
  scene.start = start;
  return scene;
}

// However often: what an event's disks will do next is left unwritten until the next event has begun, but not over a
// stop. 40,000 stops, nearly one an event of the fluid.
TEST(Engine, DoesNotCareWhenOneLooks) {
  for (const auto& [scene, end] :
       {std::pair{shaken_bed(), 100.0}, {shaken_bed(), 20.0}, {fluid(), 40.0}, {gentle_bed(), 40.0}}) {
    const auto a = simulate(scene), b = simulate(scene);
    a->advance_to(end);
    Snapshot at;
    const int looks = end == 100 ? 1000 : 20'000;
    for (int i = 1; i <= looks; ++i) {
      b->advance_to(i == looks ? end : end / looks * i);
      if (i % 10 == 0) b->snapshot(at);
    }
    expect_same(*a, *b);
  }
}

// Also of a bed that is shaken so gently that its disks chatter on one another.
TEST(Engine, ReturnsAfterSoManyEventsAndMakesTheSameBytes) {
  Scene restless = gentle_bed(0.5);
  restless.rests = restless.presses = false;
  for (const Scene& scene : {shaken_bed(), resting_bed(), restless, fluid()}) {
    const auto a = simulate(scene), b = simulate(scene);
    a->advance_to(8);
    std::uint64_t most = 1;
    int calls = 0;
    for (bool arrived = false; !arrived; ++calls) {
      const std::uint64_t before = b->counters().events();
      arrived = b->advance_towards(8, most);
      EXPECT_LE(b->counters().events(), before + most);
      most = most % 1000 + 7;
    }
    EXPECT_GT(calls, 20);
    expect_same(*a, *b);
  }
}

void expect_resumes(const Scene& scene, double saved_at, double end) {
  const auto a = simulate(scene);
  for (int k = 0; a->time() < saved_at; ++k) {
    a->advance_to(a->next_synchronisation());
    if (k % 64 == 0) static_cast<void>(a->checkpoint());  // changes nothing
  }
  const std::vector<std::uint8_t> saved = a->checkpoint();
  const auto b = simulate(scene);
  b->restore(saved);
  EXPECT_EQ(a->time(), b->time());
  a->advance_to(end);
  b->advance_to(end);
  expect_same(*a, *b);
}

TEST(Engine, GoesOnFromACheckpointToTheSameBytes) {
  std::vector<Scene> scenes(8, shaken_bed());
  scenes[1].bath = LangevinBath{2, 1, 0.37};
  scenes[2].bath = AndersenBath{2, 0.5};
  scenes[3].disks.species = {{60, 1, 1}, {40, 1.4, 2.744}};
  scenes[4].disks.contact = Surface{};
  scenes[4].box.sides = PeriodicSides{};
  scenes[5] = fluid();  // five shells a cell
  scenes[5].disks.species = {{40, 1, 1}, {250, 0.3, 0.09}};
  scenes[5].start = RandomStart{};
  scenes[6] = gentle_bed();
  scenes[7] = resting_bed(0.5);
  for (std::size_t k = 0; k < scenes.size(); ++k)
    k < 6 ? expect_resumes(scenes[k], 10, 18) : expect_resumes(scenes[k], 30, 55);
  for (const std::uint64_t seed : {0, 2, 3}) expect_resumes(random_stack(seed), 6, 18);  // some of the disks at rest
  expect_resumes(random_stack(1), 6, 12);                                                // chatters
}

// Below Gamma = 1 nothing moves against anything once it has come to rest, and nothing is done for it.
TEST(Engine, LetsABedLieThatHasComeToRest) {
  for (const double friction : {0.0, 0.3}) {
    Scene scene = resting_bed(0.8);
    scene.disks.contact.friction = scene.box.floor_surface.friction = friction;
    const auto bed = simulate(scene);
    bed->advance_to(30);
    const Counters before = bed->counters();
    const EnergyLedger ledger_before = bed->energy();
    Snapshot first, later;
    bed->snapshot(first);
    for (int k = 1; k <= 400; ++k) {
      bed->advance_to(30 + 0.1 * k);
      bed->snapshot(later);
      for (std::size_t i = 0; i < first.z.size(); ++i) {
        ASSERT_EQ(later.x[i], first.x[i]);
        ASSERT_NEAR(later.z[i] - later.floor_position, first.z[i] - first.floor_position, 1e-14);
        ASSERT_EQ(later.vz[i], later.floor_velocity);
      }
    }
    EXPECT_EQ(bed->counters().events(), before.events());
    EXPECT_EQ(bed->largest_overlap(), 0);
    const EnergyLedger ledger = bed->energy();
    EXPECT_EQ(ledger.dissipated, ledger_before.dissipated);
    EXPECT_NEAR(ledger.imbalance(), 0, 1e-10 * ledger.dissipated);
  }
}

// Two rows and a half on a floor that stands still, as hard disks: they lie after 0.66 sqrt(D/g), if they may and
// nothing kicks them.
TEST(Engine, LetsNoBedLieThatIsKickedOrMayNot) {
  const auto lies = [](const auto& change) {
    Scene scene;
    scene.gravity = UniformGravity{};
    scene.disks.species = {{16, 1, 1}};
    scene.disks.contact = scene.box.floor_surface = {0.6, 0.5, 0};
    scene.disks.contact_duration = 1e-4;
    scene.box.width = 5.3;
    scene.box.sides = HardSides{{0.6, 0.5, 0}};
    scene.presses = false;
    scene.start_temperature = 0.01;
    change(scene);
    const auto bed = simulate(scene);
    bed->advance_to(0.7);
    Snapshot at;
    bed->snapshot(at);
    int still = 0;
    for (std::size_t i = 0; i < at.z.size(); ++i) still += at.vx[i] == 0 && at.vz[i] == 0;
    EXPECT_TRUE(still == 0 || still >= 15) << still;
    return still > 0;
  };
  EXPECT_TRUE(lies([](Scene&) {}));
  EXPECT_FALSE(lies([](Scene& s) { s.rests = false; }));
  EXPECT_FALSE(lies([](Scene& s) { s.bath = LangevinBath{1e-9, 1e-3, 10}; }));
  EXPECT_FALSE(lies([](Scene& s) { s.bath = AndersenBath{1e-9, 1e-9}; }));
}

// It lands, rests but for a few disks on top, and takes off when the floor falls faster than it, again and again.
TEST(Engine, LetsARestingBedTakeOff) {
  constexpr double gamma = 1.15, period = 1 / 0.35, frequency = 2 * std::numbers::pi * 0.35, since = 0.3;
  const auto bed = simulate(resting_bed(gamma));
  const double take_off = std::asin(1 / gamma) / frequency;  // a w^2 sin(wt) = g
  const double height = 1 / (frequency * frequency), speed = gamma / frequency * std::cos(frequency * take_off);
  Snapshot at;
  int rests = 0;
  for (int p = 20; p < 32; ++p) {
    bed->advance_to(p * period + take_off - 0.01);
    bed->snapshot(at);
    std::vector<std::size_t> still;
    double height_before = 0, height_after = 0;  // of those, above where the floor let them go
    const double floor_before = at.floor_position;
    for (std::size_t i = 0; i < at.vz.size(); ++i) {
      if (at.vx[i] != 0 || at.vz[i] != at.floor_velocity) continue;
      still.push_back(i);
      height_before += at.z[i] - floor_before;
    }
    if (still.size() < at.vz.size() * 9 / 10) continue;
    ++rests;
    bed->advance_to(p * period + take_off + since);
    bed->snapshot(at);
    for (const std::size_t i : still) height_after += at.z[i];
    const double flight = (height_after - height_before) / static_cast<double>(still.size());
    EXPECT_NEAR(flight, height + speed * since - since * since / 2, 2e-4);
    const double lowest = *std::min_element(at.z.begin(), at.z.end()) - 0.5;
    EXPECT_GT(lowest, at.floor_position + 1e-3);
  }
  EXPECT_GE(rests, 6);
  EXPECT_NEAR(bed->energy().imbalance(), 0, 1e-10 * bed->energy().dissipated);
  EXPECT_LT(bed->largest_overlap(), 1e-12);
}

// Stacks of 5 to 30 disks in narrow boxes, on still and on shaken floors: disks lie down, are woken one by one and lie
// down again. Every contact has its event, after each of 2,000 events and after every 1/32 of the time unit.
TEST(Engine, ForeseesEveryContactOfStacksThatRestAndWake) {
  int rested = 0;
  for (std::uint64_t seed = 0; seed < 16; ++seed) {
    SCOPED_TRACE(seed);
    const auto stack = simulate(random_stack(seed));
    Snapshot at;
    double deepest = 0;
    bool foreseen = true, lay = false;
    for (int k = 1; k <= 32 * 12; ++k) {
      if (k % 32 == 0) {
        for (int event = 0; event < 160; ++event)
          if (!stack->advance_towards(k / 32.0, 1)) foreseen = foreseen && stack->foresees_contacts();
      }
      stack->advance_to(k / 32.0);
      stack->snapshot(at);
      foreseen = foreseen && stack->foresees_contacts();
      deepest = std::max(deepest, stack->largest_overlap());
      int still = 0;
      for (std::size_t i = 0; i < at.z.size(); ++i) {
        deepest = std::max(deepest, at.floor_position + 0.5 - at.z[i]);
        still += at.vx[i] == 0 && at.vz[i] == at.floor_velocity;
      }
      lay = lay || still > 0;
    }
    rested += lay;
    EXPECT_TRUE(foreseen);
    EXPECT_LE(deepest, 1e-12);
    const EnergyLedger energy = stack->energy();
    EXPECT_NEAR(energy.imbalance(), 0, 1e-10 * (energy.initial + energy.dissipated + std::abs(energy.floor_work)));
  }
  EXPECT_GE(rested, 4);
}

// What lies on the floor presses on it with its weight, whether its contacts are made or not.
TEST(Engine, TellsWatchersWhatARestingBedWeighs) {
  const Scene scene = resting_bed(0.8);
  const auto bed = simulate(scene), unwatched = simulate(scene);
  bed->advance_to(30);
  FlightObserver observer(scene, bed->properties(), LayerGrid{-1, 0.5, 60});
  bed->watch(&observer);
  observer.begin(bed->time());
  for (int k = 1; k <= 14; ++k) {
    bed->advance_to(30 + k / 0.35);
    observer.end_block(bed->time());
  }
  const double weight = 120 / 12.3;
  EXPECT_NEAR(observer.floor_pressure().value, weight, 1e-3 * weight);
  for (const FlightObserver::Layer& layer : observer.layers()) {
    if (layer.height < 2 || layer.weight_above.value < 1) continue;
    EXPECT_NEAR(layer.pressure_zz.value, layer.weight_above.value, 0.05 * layer.weight_above.value + 0.5)
        << layer.height;
  }
  unwatched->advance_to(bed->time());
  expect_same(*bed, *unwatched);
}

// What lies on the floor follows it in short flights. Each ends where the next begins, on the floor as high as at
// first, and leaves the floor's motion by no more than a fall of that duration does: (1 + Gamma) g (length/2)^2/2.
class FlightsOnAFloor final : public Watcher {
 public:
  void flies(double time, std::uint32_t disk, double x, double z, double vx, double vz) override {
    if (disk >= last_.size()) last_.resize(disk + 1, Flight{-1, 0, 0, 0, 0});
    const Flight& last = last_[disk];
    if (last.time >= 0 && time > last.time && x == last.x && vx == 0 && last.vx == 0) {
      const double t = time - last.time;
      largest_jump = std::max(largest_jump, std::abs(last.z + last.vz * t - t * t / 2 - z));
      longest = std::max(longest, t);
      ++flights;
    }
    last_[disk] = {time, x, z, vx, vz};
  }
  void touched(double, double, double, double, double, double, double) override {}
  void pressed(double, double, double, double, double, double, double) override {}
  void touched_wall(double, std::uint32_t, bool, double, double, double) override {}
  double height(std::uint32_t disk, double time) const {
    const double t = time - last_[disk].time;
    return last_[disk].z + last_[disk].vz * t - t * t / 2;
  }
  double largest_jump = 0, longest = 0;
  int flights = 0;

 private:
  struct Flight {
    double time, x, z, vx, vz;
  };
  std::vector<Flight> last_;
};

TEST(Engine, FollowsTheFloorInFlightsThatJoin) {
  const double gamma = 0.8, end = 30 + 2 / 0.35;
  const auto bed = simulate(resting_bed(gamma));
  bed->advance_to(30);
  FlightsOnAFloor flights;
  bed->watch(&flights);
  Snapshot at;
  double furthest = 0;
  for (double time = 30 + 0.1 / 0.35; time < end; time += 0.00317 / 0.35) {
    bed->advance_to(time);
    bed->snapshot(at);
    for (std::uint32_t i = 0; i < at.z.size(); ++i)
      furthest = std::max(furthest, std::abs(flights.height(i, time) - at.z[i]));
  }
  EXPECT_GT(flights.flights, 120 * 100);
  EXPECT_LT(flights.largest_jump, 1e-12);
  const double deepest = (1 + gamma) * flights.longest * flights.longest / 8;
  EXPECT_LT(furthest, 1.01 * deepest);
  EXPECT_GT(furthest, 0.9 * deepest) << "snapshots show the disks where they lie, not on their flights";
}

TEST(Engine, RefusesACheckpointOfAnotherScene) {
  const Scene scene = shaken_bed();
  Scene other = scene;
  other.disks.species[0].count = 121;
  const auto a = simulate(scene), b = simulate(other);
  a->advance_to(a->next_synchronisation());
  auto saved = a->checkpoint();
  EXPECT_THROW(b->restore(saved), std::invalid_argument);
  saved.resize(saved.size() / 2);
  EXPECT_THROW(a->restore(saved), std::invalid_argument);
  saved.clear();
  EXPECT_THROW(a->restore(saved), std::invalid_argument);
}

TEST(Engine, ClosesItsEnergyLedger) {
  const auto sim = simulate(shaken_bed());
  sim->advance_to(500);
  const EnergyLedger ledger = sim->energy();
  EXPECT_GT(ledger.dissipated, 100);
  EXPECT_LE(std::abs(ledger.imbalance()), 1e-10 * ledger.dissipated);
}

TEST(Engine, LetsNothingOverlapAndNothingOut) {
  const auto sim = simulate(shaken_bed());
  Snapshot at;
  for (int i = 1; i <= 300; ++i) {
    sim->advance_to(0.7 * i);
    sim->snapshot(at);
    EXPECT_LE(sim->largest_overlap(), 1e-12);
    for (std::size_t k = 0; k < at.x.size(); ++k) {
      EXPECT_GE(at.x[k], 0.5 - 1e-12);
      EXPECT_LE(at.x[k], 11.5 + 1e-12);
      EXPECT_GE(at.z[k] - 0.5, at.floor_position - 1e-12);
    }
  }
}

// A small periodic box of few disks: shells that fitted the density would reach two images of one neighbour, only the
// nearest of which is looked at.
TEST(Engine, KeepsTheImagesOfANeighbourApart) {
  for (const double width : {5.0, 6.3, 9.0, 14.0}) {
    for (const std::uint32_t disks : {2u, 4u, 9u}) {
      Scene scene;
      scene.gravity = Weightless{};
      scene.disks.species = {{disks, 1, 1}};
      scene.box.width = width;
      scene.box.sides = PeriodicSides{};
      scene.box.top = PeriodicTop{width};
      scene.start = RandomStart{};
      scene.start_temperature = 1;
      scene.seed = disks;
      ASSERT_TRUE(check(scene).empty());
      const auto sim = simulate(scene);
      for (int i = 1; i <= 1000; ++i) {
        sim->advance_to(0.37 * i);
        ASSERT_LE(sim->largest_overlap(), 1e-12) << disks << " disks, " << width << " D wide, look " << i;
      }
      EXPECT_GT(sim->counters().disk_collisions, 10u);
    }
  }
}

// Rows whose disks touch exactly: contacts of equal times, many of them at one instant, each of which must have its
// turn.
TEST(Engine, KeepsALatticeOfTouchingDisksApart) {
  for (const auto& [disks_a_row, rows] : {std::pair{6, 4}, std::pair{10, 4}, std::pair{19, 10}}) {
    Scene scene;
    scene.gravity = UniformGravity{};
    scene.disks.species = {{static_cast<std::uint32_t>(disks_a_row * rows), 1, 1}};
    scene.box.width = disks_a_row + 1;
    scene.box.sides = HardSides{};
    PlacedStart start;
    for (int row = 0; row < rows; ++row) {
      for (int k = 0; k < disks_a_row; ++k)
        start.disks.push_back({k + 0.5 + 0.5 * (row % 2), 0.5 + row * std::sqrt(0.75) * (1 + 1e-12), 0, 0, 0, 0});
    }
    start.disks[static_cast<std::size_t>((rows / 2 - 1) * disks_a_row + disks_a_row / 2)].vz = 1;
    scene.start = start;
    const auto bed = simulate(scene);
    for (double time = 0.01; time < 5; time *= 1.3) {
      bed->advance_to(time);
      ASSERT_LT(bed->largest_overlap(), 1e-12) << rows << " rows, time " << time;
    }
  }
}

// A plastic ball that touches a floor which begins to fall faster than the ball: no contact, and no endless loop.
TEST(Engine, LetsTheFloorFallAwayFromAPlasticBall) {
  const double gamma = 3.6, amplitude = gamma / std::pow(2 * std::numbers::pi, 2);
  const double phase = std::acos(std::numbers::pi / gamma), flight = 1 - phase / (2 * std::numbers::pi);
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{1, 1, 1}};
  scene.box.width = 4;
  scene.box.sides = HardSides{};
  scene.box.floor = SinusoidalFloor{amplitude, 1};
  scene.box.floor_surface = {0, 0, 0};
  scene.start =
      PlacedStart{{{2, 0.5 + amplitude * std::sin(phase) + (0.5 - flight / 2) * flight + 1e-7, 0, 0.5 - flight, 0, 0}}};
  const auto ball = simulate(scene);
  ball->advance_to(200);
  EXPECT_GE(ball->counters().floor_collisions, 190u);
  EXPECT_LE(ball->counters().floor_collisions, 400u);  // rounding makes some of them double
  EXPECT_LT(std::abs(ball->energy().imbalance()), 1e-12);
}

// Dissipative disks at rest on one another without a contact clock: infinitely many contacts in a finite time.
TEST(Engine, SaysWhereDisksCollapse) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{80, 1, 1}};
  scene.disks.contact = {0.5, 0, 0};
  scene.box.width = 6;
  scene.box.sides = HardSides{{0.5, 0, 0}};
  scene.box.floor_surface = {0.5, 0, 0};
  const auto pile = simulate(scene);
  try {
    pile->advance_to(10);
    FAIL() << "ran through an inelastic collapse";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("inelastic collapse at time 0.000"));
  }
  scene.disks.contact_duration = 1e-4;
  const auto soft = simulate(scene);
  soft->advance_to(12);
  EXPECT_LT(soft->energy().kinetic, 0.1);    // hops of a contact's duration are all that is left
  EXPECT_LE(soft->largest_overlap(), 1e-3);  // as springs are: it is pressed on the floor
  scene.presses = false;
  const auto hard = simulate(scene);
  hard->advance_to(12);
  EXPECT_LE(hard->largest_overlap(), 1e-12);
}

// Two disks at the very edge of each other's reach, of which by rounding one sees the other and is not seen by it.
TEST(NeighbourLists, AreAlwaysMutual) {
  std::vector<Disk> disks(4);
  NeighbourLists lists;
  lists.reset(disks.data(), 3);
  const auto neighbours = [&](std::uint32_t i) {
    std::vector<std::uint32_t> found;
    lists.each_neighbour(i, [&](std::uint32_t k) { found.push_back(k); });
    return found;
  };
  const std::array<std::uint32_t, inline_neighbours> two = {2}, zero = {0};
  lists.list(0, {two.data(), 1});
  lists.list(1, {zero.data(), 1});
  lists.list(2, {});
  EXPECT_THAT(neighbours(0), testing::ElementsAre(1));
  EXPECT_THAT(neighbours(1), testing::ElementsAre(0));
  EXPECT_THAT(neighbours(2), testing::IsEmpty());
  lists.relist(0, {zero.data(), 0});
  lists.mend();
  EXPECT_THAT(neighbours(1), testing::IsEmpty());
}

// Lists drawn anew at random, of up to twenty neighbours, beside a table of who is whose neighbour.
TEST(NeighbourLists, StayMutualWhateverIsDrawn) {
  constexpr std::uint32_t count = 60;
  std::vector<Disk> disks(count + 1);
  NeighbourLists lists;
  lists.reset(disks.data(), count);
  std::array<std::array<bool, count>, count> together{};
  Random random(3);
  for (int round = 0; round < 20'000; ++round) {
    const std::uint32_t i = random.below(count), most = random.below(8) == 0 ? 20 : 8;
    std::vector<std::uint32_t> found;
    for (std::uint32_t k = 0; k < count; ++k) {
      const bool kept = together[i][k] && random.below(8) != 0;
      if (k != i && found.size() < most && (kept || random.below(20) == 0)) found.push_back(k);
    }
    const std::size_t size = found.size();
    for (std::uint32_t k = 0; k < count; ++k) together[i][k] = together[k][i] = false;
    for (const std::uint32_t k : found) together[i][k] = together[k][i] = true;
    found.resize(size + inline_neighbours);
    lists.relist(i, {found.data(), size});
    lists.mend();
    for (std::uint32_t k = 0; k < count; ++k) {
      std::array<bool, count> listed{};
      std::uint32_t neighbours = 0;
      lists.each_neighbour(k, [&](std::uint32_t other) {
        ASSERT_LT(other, count);
        listed[other] = true;
        ++neighbours;
      });
      ASSERT_EQ(listed, together[k]) << "round " << round << ", disk " << k;
      ASSERT_EQ(neighbours, std::count(listed.begin(), listed.end(), true));
      for (std::uint32_t place = neighbours; place < inline_neighbours; ++place)  // all eight are read
        ASSERT_EQ(lists.first_block(k).disk[place], count);
    }
  }
}

// A hundred shells with one centre: their cell has no room for all, and lends and takes back further ones.
template <class Cell>
void finds_what_a_cell_has_no_room_for() {
  constexpr std::uint32_t count = 100;
  std::vector<Disk> disks(count + 1);
  ShellGrid<Cell> shells;
  shells.reset(disks.data(), 1.5, 30, 30);
  const auto found = [&] {
    std::vector<std::uint32_t> ids;
    shells.each_eight_round(0, [&](FloatLanes x, FloatLanes, FloatLanes reach, WordLanes disk) {
      for (unsigned lane = 0; lane < 8; ++lane) {
        if (std::isnan(x[lane])) continue;
        EXPECT_EQ(reach[lane], 0.75f);
        ids.push_back(static_cast<std::uint32_t>(disk[lane]));
      }
    });
    std::sort(ids.begin(), ids.end());
    return ids;
  };
  std::vector<std::uint32_t> filed;
  const auto file = [&](std::uint32_t i) {
    shells.file(i, 0.75f);
    filed.insert(std::lower_bound(filed.begin(), filed.end(), i), i);
  };
  const auto unfile = [&](std::uint32_t i) {
    shells.unfile(i);
    filed.erase(std::lower_bound(filed.begin(), filed.end(), i));
  };
  for (std::uint32_t i = 0; i < count; ++i) file(i);
  EXPECT_EQ(found(), filed);
  EXPECT_EQ(shells.crowding(), (count - 1) / Cell::places / 400.0);  // of 20 x 20 cells
  Random random(5);
  for (int round = 0; round < 2000; ++round) {
    const std::uint32_t i = random.below(count);
    std::binary_search(filed.begin(), filed.end(), i) ? unfile(i) : file(i);
    ASSERT_EQ(found(), filed) << round;
  }
  while (!filed.empty()) unfile(filed.front());
  EXPECT_THAT(found(), testing::IsEmpty());
}
TEST(ShellGrid, FindsWhatAWideCellHasNoRoomFor) { finds_what_a_cell_has_no_room_for<WideCell>(); }
TEST(ShellGrid, FindsWhatANarrowCellHasNoRoomFor) { finds_what_a_cell_has_no_room_for<NarrowCell>(); }

// A reach filed in half a float's bits must not be too small, or a neighbour would be missed.
TEST(NarrowCell, FilesAReachThatIsNoSmaller) {
  NarrowCell cell;
  for (float reach = 1e-3f; reach < 1e4f; reach *= 1.0001f) {
    cell.set_reach(2, reach);
    const float filed = std::bit_cast<float>(std::uint32_t{cell.reach[2]} << 16);
    ASSERT_GE(filed, reach);
    ASSERT_LE(filed, reach * (1 + 0x1p-7f));
  }
  for (int k = 64; k <= 128; ++k) {  // equal disks' reaches, in units of the skins
    const float reach = static_cast<float>(k) / 128;
    cell.set_reach(2, reach);
    ASSERT_EQ(std::bit_cast<float>(std::uint32_t{cell.reach[2]} << 16), reach);
  }
}

// The queue's buckets follow a rate of events that changes a million times over.
TEST(Engine, KeepsItsOrderThroughBursts) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{400, 1, 1}};
  scene.disks.contact = {0.7, 0, 0};
  scene.disks.contact_duration = 1e-3;
  scene.box.width = 10;
  scene.box.sides = HardSides{};
  scene.box.floor = SinusoidalFloor{200, 0.02};  // flies for tens of time units, then lands all at once
  scene.box.floor_surface = {0.7, 0, 0};
  const auto bed = simulate(scene);
  for (double time = 3; time < 120; time += 3) {
    bed->advance_to(time);
    ASSERT_LE(bed->largest_overlap(), 1e-12) << "time " << time;
  }
  EXPECT_LE(std::abs(bed->energy().imbalance()), 1e-10 * bed->energy().dissipated);
}

}  // namespace
}  // namespace shakebed::sim
