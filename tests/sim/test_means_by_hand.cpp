// Means of correlated samples block by block, ideal packings, and the library's measured bed: its numbers and its
// words.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <vector>

#include "sim/engine/random.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/measure/measured_bed.hpp"
#include "sim/measure/observables.hpp"
#include "sim/measure/statistics.hpp"

namespace shakebed::sim::means_by_hand {
namespace {

// 600 samples: 512 make 256 blocks of two, and 88 more make 44.
TEST(CorrelatedMeansByHand, JoinTheirBlocksByTwos) {
  Random random(31);
  CorrelatedMeans means;
  std::vector<double> pairs;
  double sum = 0;
  for (int i = 0; i < 600; ++i) {
    const double value = random.normal_pair().first;
    means.add(value);
    sum += value / 600;
    if (i % 2 == 0)
      pairs.push_back(value / 2);
    else
      pairs.back() += value / 2;
  }
  EXPECT_EQ(means.blocks(), 300U);
  EXPECT_NEAR(means.mean(), sum, 1e-14);
  EXPECT_NEAR(means.std_error(), statistics::mean_of(pairs).std_error, 1e-14);
}

// The windows are those of the sum of all quantities or of their first moment, whichever is correlated for longer.
TEST(CorrelatedMeansByHand, ChooseWindowsByTheSlowerOfTwoSeries) {
  Random random(32);
  for (const bool slow_sum : {true, false}) {
    CorrelatedMeans means(3);
    std::vector<double> sum, moment;
    double slow = 0;
    for (int i = 0; i < 200; ++i) {
      slow = 0.9 * slow + random.normal_pair().first;
      const double fast = random.normal_pair().first;
      // Sum and first moment of {7, a, b} without the 7: a + b and b.
      const double b = slow_sum ? fast : slow, a = (slow_sum ? slow : fast) - b;
      const std::array<double, 3> sample{7, a, b};
      means.add(sample);
      sum.push_back(a + b), moment.push_back(b);
    }
    sum = statistics::from_mean(sum), moment = statistics::from_mean(moment);
    const double longest = statistics::memory_of(slow_sum ? sum : moment);
    ASSERT_GT(longest, 2 * statistics::memory_of(slow_sum ? moment : sum));
    const statistics::Windows expected = statistics::windows_for(longest, moment), found = means.windows(1, 3);
    EXPECT_EQ(found.length, expected.length);
    EXPECT_EQ(found.independent, expected.independent);
    EXPECT_NEAR(found.correction, expected.correction, 1e-12);
    const statistics::Windows alone = means.windows(2, 3),
                              of_b = statistics::windows_for(statistics::memory_of(moment), moment);
    EXPECT_EQ(alone.length, of_b.length);
    EXPECT_NEAR(alone.correction, of_b.correction, 1e-12);
  }
}

// Rows of two in a box of 2.4 D have no room for half a disk more between hard sides, but have between periodic ones.
TEST(IdealPackingByHand, HasFewerDisksInRowsThatHaveNoRoom) {
  const double row = std::numbers::sqrt3 / 2;
  EXPECT_NEAR(ideal_centre_of_mass(5, 2.4, true), 0.5 + row * (0 * 2 + 1 * 1 + 2 * 2) / 5, 1e-14);
  EXPECT_NEAR(ideal_centre_of_mass(5, 2.4, false), 0.5 + row * (0 * 2 + 1 * 2 + 2 * 1) / 5, 1e-14);
  EXPECT_NEAR(ideal_centre_of_mass(5, 2.5, true), 0.5 + row * (0 * 2 + 1 * 2 + 2 * 1) / 5, 1e-14);
  EXPECT_NEAR(ideal_centre_of_mass(3, 1.2, true), 0.5 + row, 1e-14) << "one a row";
  EXPECT_NEAR(ideal_centre_of_mass(3, 3 - 1e-13, true), 0.5, 1e-14) << "a width of 3 D but for rounding";
  EXPECT_EQ(ideal_centre_of_mass(0, 3, true), 0);
}

TEST(MeasuredBedByHand, SaysWhatItHas) {
  MeasuredBed bed;
  bed.status = MeasureStatus::ok;
  bed.disks.mass.assign(12, 1);
  bed.periods = 34;
  bed.temperature_x = {1.25, 0.03};
  bed.temperature_z = {2.5, 0.06};
  bed.spin_temperature = {0.5, 0.01};
  bed.centre_of_mass = {7.5, 0.02};
  bed.centre_of_mass_rise = {3.25, 0.02};
  bed.counters.disk_collisions = 100, bed.counters.wall_collisions = 20, bed.counters.floor_collisions = 3;
  bed.largest_overlap = 3e-16;
  bed.energy.kinetic = 4, bed.energy.initial = 3.5;
  bed.frames.resize(2);
  EXPECT_EQ(bed.brief(),
            "12 disks, 34 periods: T_x = 1.25 +- 0.03 m g D, T_z = 2.5 +- 0.06 m g D, centre of mass 7.5 +- 0.02 D");
  EXPECT_EQ(bed.full(),
            "status                  ok\n"
            "disks                   12\n"
            "periods                 34\n"
            "temperature_x           1.25 +- 0.03 m g D\n"
            "temperature_z           2.5 +- 0.06 m g D\n"
            "spin_temperature        0.5 +- 0.01 m g D\n"
            "centre_of_mass          7.5 +- 0.02 D\n"
            "centre_of_mass_rise     3.25 +- 0.02 D\n"
            "collisions              123\n"
            "energy imbalance        0.5\n"
            "largest overlap         3e-16 D\n"
            "frames                  2\n");
  bed.centre_of_mass = {}, bed.compressibility_factor = {1.5, 0.1};
  EXPECT_NE(bed.full().find("temperature_x           1.25 +- 0.03 T0\n"), std::string::npos);
  EXPECT_NE(bed.full().find("compressibility_factor  1.5 +- 0.1"), std::string::npos);
  EXPECT_EQ(bed.full().find("centre_of_mass"), std::string::npos);
  MeasuredBed refused;
  refused.message = "no";
  EXPECT_EQ(refused.brief(), "bad input: no");
  EXPECT_EQ(refused.full(), "status                  bad input\nmessage                 no\n");
}

// Six disks without gravity in a box that is periodic both ways, and the same loop written by hand.
TEST(MeasuredBedByHand, IsWhatALoopOfLooksSees) {
  Scene scene;
  scene.gravity = Weightless{};
  scene.box.width = 7;
  scene.box.sides = PeriodicSides{};
  scene.disks.species = {{6, 1, 1}};
  scene.box.top = PeriodicTop{7};
  MeasureOptions options{.settle = 3, .duration = 25, .frames = 5};
  const MeasuredBed bed = measure(scene, options);
  ASSERT_TRUE(bed.ok()) << bed.message;
  const auto run = simulate(scene);
  Snapshot at;
  std::vector<double> hot, virial;
  double before = 0;
  for (int look = 0; look <= 100; ++look) {
    run->advance_to(3 + 0.25 * look);
    if (look == 0) before = run->counters().virial;
    if (look > 0) virial.push_back(run->counters().virial / 0.25);
    if (look == 100) break;
    run->snapshot(at);
    double sum = 0;
    for (const double v : at.vx) sum += v * v / 6;
    hot.push_back(sum);
    if (look % 20 == 0) {
      EXPECT_EQ(bed.frames[static_cast<std::size_t>(look / 20)].x, at.x) << look;
    }
  }
  for (std::size_t k = virial.size(); k-- > 1;) virial[k] -= virial[k - 1];
  virial[0] -= before / 0.25;
  EXPECT_EQ(bed.periods, 100U);
  EXPECT_EQ(bed.frames.size(), 5U);
  EXPECT_EQ(bed.frame_phases, std::vector<double>(5, 0.0));
  EXPECT_NEAR(bed.temperature_x.value, statistics::mean_of(hot).value, 1e-12);
  EXPECT_NEAR(bed.temperature_x.std_error, statistics::mean_of(hot).std_error, 1e-12);
  const double t = (bed.temperature_x.value + bed.temperature_z.value) * 6 / (2 * 5.0);
  EXPECT_NEAR(bed.compressibility_factor.value, 1 + statistics::mean_of(virial).value / (2 * 6 * t), 1e-9);
  EXPECT_NEAR(bed.compressibility_factor.std_error, statistics::mean_of(virial).std_error / (2 * 6 * t), 1e-9);
  EXPECT_EQ(bed.centre_of_mass.value, 0) << "nothing weighs";
  options.stop = [] { return true; };
  EXPECT_EQ(measure(scene, options).status, MeasureStatus::stopped);
  scene.box.width = -1;
  EXPECT_EQ(measure(scene, options).message.substr(0, 11), "/box/width:");
}

}  // namespace
}  // namespace shakebed::sim::means_by_hand
