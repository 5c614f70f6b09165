#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "sim/measure/measure.hpp"
#include "sim/measure/observables.hpp"

namespace shakebed::sim {
namespace {

constexpr double bed_frequency = 0.35;

Scene measured_bed_scene(std::uint64_t seed = 1) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{60, 1, 1}};
  scene.disks.contact = {0.9, 0, 0};
  scene.disks.contact_duration = 1e-4;
  scene.box.width = 10.3;
  scene.box.sides = HardSides{{0.9, 0, 0}};
  scene.box.floor = SinusoidalFloor{0.8, bed_frequency};
  scene.box.floor_surface = {0.9, 0, 0};
  scene.start_temperature = 0.01;
  scene.seed = seed;
  return scene;
}

MeasurementSchedule usual_schedule() {
  return {.bath = {}, .settle = 5 / bed_frequency, .period = 1 / bed_frequency, .periods = 12, .phases = 8};
}

// Every position and velocity that was seen, in order.
class Diary final : public RunObserver {
 public:
  std::vector<double> seen;
  int begun = 0, ended = 0, gone_on = 0;
  void begin(Simulation&) override { ++begun; }
  void look(Simulation&, const Snapshot& at, std::uint64_t look, std::uint32_t phase) override {
    EXPECT_EQ(phase, look % 8);
    EXPECT_NEAR(at.time, (5 + static_cast<double>(look) / 8) / bed_frequency, 1e-12);
    seen.insert(seen.end(), at.x.begin(), at.x.end());
    seen.insert(seen.end(), at.vz.begin(), at.vz.end());
  }
  void end(Simulation&) override { ++ended; }
  void go_on(Simulation&) override { ++gone_on; }
  void save(ArchiveWriter& out) override { out(seen); }
  void load(ArchiveReader& in) override { in(seen); }
};

bool equal_bytes(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

TEST(Measure, LooksAtEveryPhaseOfEveryPeriodOnce) {
  Diary diary;
  const RunResult result = measure(measured_bed_scene(), usual_schedule(), {&diary});
  EXPECT_TRUE(result.finished);
  EXPECT_NEAR(result.simulation->time(), 17 / bed_frequency, 1e-12);
  EXPECT_EQ(diary.seen.size(), 12U * 8 * 2 * 60);
  EXPECT_EQ(diary.begun, 1);
  EXPECT_EQ(diary.ended, 1);
}

TEST(Measure, HasItsMomentsInEqualPartsOfPeriods) {
  MeasurementSchedule schedule;
  schedule.settle = 2, schedule.period = 0.5, schedule.periods = 3, schedule.phases = 4;
  EXPECT_EQ(schedule.looks(), 12U);
  EXPECT_EQ(schedule.moment(0), 2);
  EXPECT_EQ(schedule.moment(3), 2.375);
  EXPECT_EQ(schedule.moment(5), 2.625);
  EXPECT_EQ(schedule.end(), 3.5);
}

// A moment between two synchronisations that the sum of the first and of the time since then does not reach.
double moment_lost_to_rounding(double first, double second) {
  double moment = 0.25 * first + 0.75 * second;
  for (int attempt = 0; attempt < 16; ++attempt, moment = std::nextafter(moment, second)) {
    const double since = moment - first;
    if (first + since < moment) return moment;
  }
  return 0;
}

// The time of a run is such a sum. Every look is made, wherever it is by rounding.
TEST(Measure, EndsWhateverTheMomentsOfItsLooks) {
  Scene scene = measured_bed_scene();
  std::mt19937_64 random(1);
  int tried = 0;
  for (int k = 0; k < 40; ++k) {
    scene.box.floor = SinusoidalFloor{0.8, 0.3 + 0.3 * std::ldexp(static_cast<double>(random() >> 11), -53)};
    const auto bed = simulate(scene);
    for (int synchronisation = 0; synchronisation < 4; ++synchronisation) {
      const double first = bed->next_synchronisation();
      bed->advance_to(first);
      const double moment = moment_lost_to_rounding(first, bed->next_synchronisation());
      if (moment == 0) continue;
      ++tried;
      int questions = 0;
      RunControl control;
      control.stop = [&] { return ++questions > 100'000; };
      EXPECT_TRUE(measure(scene, {.bath = {}, .settle = moment, .period = 1}, {}, control).finished) << moment;
    }
  }
  EXPECT_GE(tried, 1);
}

TEST(Measure, SeesWhatAHandWrittenLoopSees) {
  const Scene scene = measured_bed_scene();
  const MeasurementSchedule schedule = usual_schedule();
  const auto by_hand = simulate(scene);
  BedObserver expected(scene, by_hand->properties(), 8, {-3, 0.25, 160}, {KernelKind::gaussian, 0.5});
  Snapshot at;
  for (std::uint32_t look = 0; look < 12 * 8; ++look) {
    by_hand->advance_to(schedule.moment(look));
    by_hand->snapshot(at);
    expected.observe(at, look % 8);
  }
  Observing<BedObserver> found([&](const DiskProperties& disks) {
    return BedObserver(scene, disks, 8, {-3, 0.25, 160}, {KernelKind::gaussian, 0.5});
  });
  measure(scene, schedule, {&found});
  EXPECT_EQ(found->periods(), 12U);
  EXPECT_EQ(found->temperature_x().value, expected.temperature_x().value);
  EXPECT_EQ(found->temperature_x().std_error, expected.temperature_x().std_error);
  EXPECT_EQ(found->centre_of_mass().value, expected.centre_of_mass().value);
}

// The area under the covered fraction is that of the disks over the width; the number of disks says nothing about it.
TEST(Measure, CoveredFractionCountsTheAreaOfEachDisk) {
  Scene scene = measured_bed_scene();
  scene.disks.species = {{30, 1, 1}, {40, 0.5, 0.25}};
  const auto bed = simulate(scene);
  BedObserver observer(scene, bed->properties(), 8, {-6, 0.25, 240}, {KernelKind::gaussian, 0.5});
  Snapshot at;
  for (std::uint32_t phase = 0; phase < 8; ++phase) {
    bed->advance_to((5 + phase / 8.0) / bed_frequency);
    bed->snapshot(at);
    observer.observe(at, phase);
  }
  for (const bool floor_frame : {false, true}) {
    double area = 0, number = 0;
    const Profile profile = observer.density(floor_frame);
    for (std::size_t i = 0; i < profile.height.size(); ++i) {
      area += 0.25 * profile.area_fraction[i];
      number += 0.25 * profile.number_density[i];
    }
    EXPECT_NEAR(area * scene.box.width, std::numbers::pi / 4 * (30 + 40 * 0.25), 1e-6);
    EXPECT_NEAR(number * scene.box.width, 70, 1e-6);
  }
}

// Stopped at its 1st, 2nd, ... question, it goes on from what it kept last (or begins anew) and sees the same.
TEST(Measure, GoesOnFromWhatItKeptToTheSameBytes) {
  Diary whole;
  measure(measured_bed_scene(), usual_schedule(), {&whole});
  for (int questions = 1; questions <= 200; questions *= 3) {
    std::vector<std::uint8_t> kept;
    int asked = 0, stops = 0;
    RunControl control;
    control.events_between_questions = 500;
    control.keep = [&](const Simulation&, const RunControl::State& state) { kept = state(); };
    control.stop = [&] { return stops == 0 && ++asked == questions; };
    Diary before;
    const RunResult first = measure(measured_bed_scene(), usual_schedule(), {&before}, control);
    EXPECT_FALSE(first.finished) << questions;
    stops = 1;
    Diary after;
    const RunResult second = measure(measured_bed_scene(), usual_schedule(), {&after}, control, kept);
    EXPECT_TRUE(second.finished);
    EXPECT_TRUE(equal_bytes(after.seen, whole.seen)) << questions;
    EXPECT_EQ(after.begun + after.gone_on, 1);
  }
}

TEST(Measure, RefusesAStateThatIsNotOfThisRun) {
  std::vector<std::uint8_t> kept;
  RunControl control;
  control.keep = [&](const Simulation&, const RunControl::State& state) { kept = state(); };
  Diary diary;
  measure(measured_bed_scene(), usual_schedule(), {&diary}, control);
  ASSERT_FALSE(kept.empty());
  Scene other = measured_bed_scene();
  other.disks.species[0].count = 61;
  EXPECT_THROW(measure(other, usual_schedule(), {&diary}, {}, kept), StateError);
  MeasurementSchedule shorter = usual_schedule();
  shorter.periods = 2;
  EXPECT_THROW(measure(measured_bed_scene(), shorter, {&diary}, {}, kept), StateError);
  kept.resize(kept.size() / 2);
  EXPECT_THROW(measure(measured_bed_scene(), usual_schedule(), {&diary}, {}, kept), StateError);
  EXPECT_THROW(measure(measured_bed_scene(), {.bath = {}, .settle = 0, .period = 0, .periods = 1, .phases = 1}, {}),
               std::invalid_argument);
}

TEST(Measure, TellsHowFarItHasCome) {
  std::vector<double> told;
  RunControl control;
  control.progress = [&](double fraction, RunPart) { told.push_back(fraction); };
  measure(measured_bed_scene(), usual_schedule(), {}, control);
  ASSERT_GT(told.size(), 12U * 8);
  for (std::size_t k = 1; k < told.size(); ++k) EXPECT_GE(told[k], told[k - 1]);
  EXPECT_GT(told.back(), 0.99);
}

// The reservoir's last temperature is that of a run that goes on, too.
TEST(Measure, TakesTheReservoirThroughItsSteps) {
  Scene scene = measured_bed_scene();
  scene.bath = LangevinBath{1, 1, 0.1};
  MeasurementSchedule schedule = usual_schedule();
  schedule.bath = {{4, 3}, {8, 0.5}};
  Diary whole;
  measure(scene, schedule, {&whole});
  std::vector<std::uint8_t> kept;
  RunControl control;
  control.keep = [&](const Simulation&, const RunControl::State& state) { kept = state(); };
  control.stop = [&, asked = 0]() mutable { return ++asked == 40; };
  Diary first, second;
  EXPECT_FALSE(measure(scene, schedule, {&first}, control).finished);
  EXPECT_TRUE(measure(scene, schedule, {&second}, {}, kept).finished);
  EXPECT_TRUE(equal_bytes(second.seen, whole.seen));
  for (const std::vector<BathStep>& wrong : std::vector<std::vector<BathStep>>{{{8, 3}, {4, 0.5}}, {{8, 3}, {40, 1}}}) {
    schedule.bath = wrong;
    EXPECT_THROW(measure(scene, schedule, {}), std::invalid_argument);
  }
  schedule.bath = {};
  Diary without;
  measure(scene, schedule, {&without});
  EXPECT_FALSE(equal_bytes(without.seen, whole.seen));
}

TEST(EachReplica, RunsEveryOneOnceWhateverTheThreads) {
  for (const int threads : {1, 2, 5}) {
    std::vector<Diary> diaries(6);
    EXPECT_TRUE(each_replica(6, threads, [&](std::uint32_t k) {
      return measure(measured_bed_scene(k + 1), usual_schedule(), {&diaries[k]}).finished;
    }));
    Diary fourth;
    measure(measured_bed_scene(4), usual_schedule(), {&fourth});
    EXPECT_TRUE(equal_bytes(diaries[3].seen, fourth.seen));
    EXPECT_FALSE(equal_bytes(diaries[2].seen, fourth.seen));
  }
}

TEST(EachReplica, EndsWhereOneFailsOrIsStopped) {
  EXPECT_THROW(each_replica(4, 2,
                            [](std::uint32_t k) -> bool {
                              if (k == 1) throw std::runtime_error("no");
                              return true;
                            }),
               std::runtime_error);
  int runs = 0;
  EXPECT_FALSE(each_replica(4, 1, [&](std::uint32_t k) { return ++runs, k != 1; }));
  EXPECT_EQ(runs, 2);
}

}  // namespace
}  // namespace shakebed::sim
