// Temperatures without the motion of layers: of states made by hand, and their errors.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "sim/measure/archive.hpp"
#include "sim/measure/flow_free.hpp"

namespace shakebed::sim::flow_free {
namespace {

Snapshot state(std::vector<double> z, std::vector<double> vx, std::vector<double> vz) {
  Snapshot at;
  at.x.assign(z.size(), 1);
  at.z = std::move(z), at.vx = std::move(vx), at.vz = std::move(vz);
  return at;
}

// Three disks of the lowest layer with v_x = 11, 12, 13 and v_z = -7, -4, -4: squares about the mean 2 and 6, of which
// two velocities are free: 1 and 3. Four in the layer that begins at 2 D: v_x = 0, 0, 2, 2, v_z = 5: 4/3 and 0. The
// mean over the seven disks. Two disks alone in a layer do not count.
TEST(FlowFree, IsThatOfEachLayerAtEachMoment) {
  const DiskProperties disks{std::vector<double>(9, 0.5), std::vector<double>(9, 1.0)};
  const Snapshot at = state({0.5, 2.1, 0.9, 2.9, 0.1, 2.5, 2.999, -0.5, -0.1}, {11, 0, 12, 0, 13, 2, 2, 50, -50},
                            {-7, 5, -4, 5, -4, 5, 5, 9, -9});
  FlowFreeTemperature observer(disks, 1);
  observer.observe(at, 0);
  EXPECT_NEAR(observer.x().value, (3 * 1 + 4 * 4.0 / 3) / 7, 1e-12);
  EXPECT_NEAR(observer.z().value, (3 * 3 + 4 * 0) / 7.0, 1e-12);
}

// A layer that moves as a whole, now up and now down, has no temperature. With the mean of all moments it would.
TEST(FlowFree, OfALayerThatMovesAsAWholeIsZero) {
  const DiskProperties disks{std::vector<double>(4, 0.5), {1, 2, 3, 4}};
  FlowFreeTemperature observer(disks, 2);
  for (int period = 0; period < 3; ++period)
    for (std::uint32_t phase = 0; phase < 2; ++phase) {
      const double v = period + 10.0 * phase;
      observer.observe(state({0.2, 0.4, 0.6, 0.8}, {v, v, v, v}, {-v, -v, -v, -v}), phase);
    }
  EXPECT_NEAR(observer.x().value, 0, 1e-12);
  EXPECT_NEAR(observer.z().value, 0, 1e-12);
}

// Masses 1 and 3 with m v^2 of the same mean have one temperature: the layer's mean is that of the mass.
TEST(FlowFree, WeighsDisksWithTheirMasses) {
  const DiskProperties disks{std::vector<double>(4, 0.5), {1, 1, 3, 3}};
  FlowFreeTemperature observer(disks, 1);
  observer.observe(state({0.2, 0.4, 0.6, 0.8}, {3, -3, 1, -1}, {1, 1, 1, 1}), 0);
  EXPECT_NEAR(observer.x().value, 4.0 / 3 * (9 + 9 + 3 + 3) / 4, 1e-12);
}

// Periods of independent states: the error is the scatter of their means over the root of their number.
TEST(FlowFree, HasTheErrorOfItsPeriods) {
  const std::size_t count = 50, periods = 400;
  const DiskProperties disks{std::vector<double>(count, 0.5), std::vector<double>(count, 1.0)};
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  FlowFreeTemperature observer(disks, 1);
  for (std::size_t p = 0; p < periods; ++p) {
    std::vector<double> vx(count), vz(count);
    for (std::size_t i = 0; i < count; ++i) vx[i] = normal(generator), vz[i] = 2 * normal(generator);
    observer.observe(state(std::vector<double>(count, 0.5), vx, vz), 0);
  }
  // The variance of 49 free velocities: 2/49 of T^2.
  const double relative = std::sqrt(2.0 / 49 / periods);
  EXPECT_NEAR(observer.x().value, 1, 4 * relative);
  EXPECT_NEAR(observer.z().value, 4, 4 * 4 * relative);
  EXPECT_NEAR(observer.x().std_error / relative, 1, 0.3);
  EXPECT_NEAR(observer.z().std_error / (4 * relative), 1, 0.3);
}

// Places of four disks of one layer at two moments, 0.5 apart.
Snapshot placed(double time, std::vector<double> x, std::vector<double> z) {
  Snapshot at;
  at.time = time;
  at.vx.assign(x.size(), 1e3), at.vz.assign(x.size(), -1e3);  // not looked at
  at.x = std::move(x), at.z = std::move(z);
  return at;
}
Scene wide(Sides sides) {
  Scene scene;
  scene.disks.species = {{.count = 4}};
  scene.box.width = 10;
  scene.box.sides = std::move(sides);
  return scene;
}

// Displacements along x 0.1, 0.2, 0.3, 0.4 over 0.5: squares about their mean 0.05/0.25, three velocities are free.
// Along z all move by 0.2 but one, by -0.2: mean 0.1, squares 3 0.1^2 + 0.3^2 = 0.12.
TEST(FlowFree, OfDisplacementsIsThatOfMeanVelocitiesBetweenLooks) {
  const DiskProperties disks{std::vector<double>(4, 0.5), std::vector<double>(4, 1.0)};
  FlowFreeDisplacement observer(wide(HardSides{}), disks, 1);
  observer.observe(placed(3, {1, 2, 3, 4}, {0.5, 0.5, 0.6, 0.7}), 0);
  observer.observe(placed(3.5, {1.1, 2.2, 3.3, 4.4}, {0.7, 0.7, 0.8, 0.5}), 0);
  EXPECT_NEAR(observer.x().value, 0.05 / 0.25 / 3, 1e-12);
  EXPECT_NEAR(observer.z().value, 0.12 / 0.25 / 3, 1e-12);
}

// The same displacements across the periodic border.
TEST(FlowFree, OfDisplacementsGoesAcrossPeriodicSides) {
  const DiskProperties disks{std::vector<double>(4, 0.5), std::vector<double>(4, 1.0)};
  FlowFreeDisplacement observer(wide(PeriodicSides{}), disks, 1);
  observer.observe(placed(0, {9.9, 2, 3, 9.8}, {0.5, 0.5, 0.6, 0.7}), 0);
  observer.observe(placed(0.5, {0, 2.2, 3.3, 0.2}, {0.7, 0.7, 0.8, 0.5}), 0);
  EXPECT_NEAR(observer.x().value, 0.05 / 0.25 / 3, 1e-12);
}

// A displacement is of the period in which it ends, so that the first period has one less than the others.
TEST(FlowFree, OfDisplacementsIsTheMeanOfPeriods) {
  const DiskProperties disks{std::vector<double>(4, 0.5), std::vector<double>(4, 1.0)};
  FlowFreeDisplacement observer(wide(HardSides{}), disks, 2);
  const std::vector<double> z(4, 0.5);
  observer.observe(placed(0, {1, 2, 3, 4}, z), 0);
  observer.observe(placed(1, {1, 2, 3, 5}, z), 1);  // squares 0.75 about the mean: 0.25
  EXPECT_NEAR(observer.x().value, 0.25, 1e-12);
  observer.observe(placed(2, {1, 2, 3, 7}, z), 0);   // four times as much
  observer.observe(placed(3, {1, 2, 3, 10}, z), 1);  // nine times as much
  EXPECT_NEAR(observer.x().value, (0.25 + 0.25 * (4 + 9) / 2) / 2, 1e-12);
}

// Kept in the middle of a period, and taken up by another: the look before it counts.
TEST(FlowFree, OfDisplacementsGoesOnFromWhatWasKept) {
  const DiskProperties disks{std::vector<double>(4, 0.5), std::vector<double>(4, 1.0)};
  const std::vector<double> z(4, 0.5), raised{0.5, 0.5, 0.5, 0.9};
  FlowFreeDisplacement first(wide(HardSides{}), disks, 2), second(wide(HardSides{}), disks, 2);
  first.observe(placed(0, {1, 2, 3, 4}, z), 0);
  first.observe(placed(1, {1, 2, 3, 5}, z), 1);
  first.observe(placed(3, {1, 2, 3, 9}, z), 0);
  ArchiveWriter out;
  out(first);
  const std::vector<std::uint8_t> kept = out.take();
  ArchiveReader in(kept);
  in(second);
  EXPECT_TRUE(in.at_end());
  second.observe(placed(7, {1, 2, 3, 9.8}, raised), 1);
  // Per unit of time the fourth disk moved by 1 in the first period, by 2 and 0.2 in the second, and by 0.1 upwards.
  EXPECT_NEAR(second.x().value, (0.25 + 0.25 * (4 + 0.04) / 2) / 2, 1e-12);
  EXPECT_NEAR(second.z().value, (0 + 0.25 * (0 + 0.01) / 2) / 2, 1e-12);
}

}  // namespace
}  // namespace shakebed::sim::flow_free
