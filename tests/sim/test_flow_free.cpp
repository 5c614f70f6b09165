// Temperatures without the motion of layers: of states made by hand, and their errors.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

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

}  // namespace
}  // namespace shakebed::sim::flow_free
