// What is measured, on motions and arrangements whose averages are known.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include "sim/engine/random.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/measure/archive.hpp"
#include "sim/measure/flights.hpp"
#include "sim/measure/observables.hpp"
#include "sim/measure/order.hpp"
#include "sim/measure/velocities.hpp"
#include "statistics/correlated_series.hpp"
#include "tests/sim/spoilt_simulation.hpp"

namespace shakebed::sim {
namespace {

constexpr double root3 = std::numbers::sqrt3;

// One elastic disk dropped from h D above a still floor of 4 D.
Scene dropped(double h) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{1, 1, 1}};
  scene.box.width = 4;
  scene.start = PlacedStart{{{2, 0.5 + h, 0.3, 0, 0, 0}}};
  return scene;
}

// In a whole number of bounces it spends (t(z1) - t(z2))/t(0) of its time between z1 and z2, t(z) = sqrt(2 (h - z)),
// and the floor carries its weight.
TEST(Flights, OfABouncingDiskHaveItsExactAverages) {
  const double h = 2.8, fall = std::sqrt(2 * h);
  const Scene scene = dropped(h);
  const auto simulation = simulate(scene);
  FlightObserver flights(scene, simulation->properties(), {0, 0.5, 12});
  simulation->watch(&flights);
  flights.begin(0);
  for (int bounce = 1; bounce <= 20; ++bounce) {
    simulation->advance_to(2 * fall * bounce);
    flights.end_block(2 * fall * bounce);
  }
  const auto layers = flights.layers();
  ASSERT_EQ(layers.size(), 6u);  // from 0.5 D up, the layer of its radius is empty
  for (const FlightObserver::Layer& layer : layers) {
    const double low = layer.height - 0.25 - 0.5, high = std::min(low + 0.5, h);  // of its lowest point
    const double share = (std::sqrt(2 * (h - low)) - std::sqrt(2 * (h - high))) / fall;
    EXPECT_NEAR(layer.number_density.value, share / (4 * 0.5), 1e-12);
    EXPECT_NEAR(layer.temperature_x.value, 0.09, 1e-12);
    EXPECT_NEAR(layer.mean_velocity_z.value, 0, 1e-9);
    EXPECT_NEAR(layer.pressure_zz.value, layer.weight_above.value, 1e-12) << layer.height;
  }
  EXPECT_NEAR(flights.floor_pressure().value, 1.0 / 4, 1e-12);
}

// In a layer that holds the disk all the time the mean velocity of a block is its way over its time: the error is that
// of the mean of these.
TEST(Flights, HaveTheErrorOfTheMeanVelocity) {
  const double h = 2.8, fall = std::sqrt(2 * h), block = 0.37 * fall;
  const Scene scene = dropped(h);
  const auto simulation = simulate(scene);
  FlightObserver flights(scene, simulation->properties(), {0, 6, 1});
  simulation->watch(&flights);
  flights.begin(0);
  const auto height = [&](double time) { return h - 0.5 * std::pow(std::remainder(time, 2 * fall), 2); };
  std::vector<double> velocities;
  for (int k = 1; k <= 300; ++k) {
    simulation->advance_to(block * k);
    flights.end_block(block * k);
    velocities.push_back((height(block * k) - height(block * (k - 1))) / block);
  }
  const auto layers = flights.layers();
  ASSERT_EQ(layers.size(), 1U);
  const statistics::Mean mean = statistics::mean_of(velocities);
  EXPECT_NEAR(layers[0].mean_velocity_z.value, mean.value, 1e-6);
  EXPECT_GT(mean.std_error, 1e-4);
  EXPECT_NEAR(layers[0].mean_velocity_z.std_error / mean.std_error, 1, 0.5) << "windows of another length";
}

// Whoever watches changes nothing.
TEST(Flights, AreWatchedWithoutATrace) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{60, 1, 1}};
  scene.disks.contact = {0.9, 0.2, 0};
  scene.disks.contact_duration = 1e-4;
  scene.box.width = 10;
  scene.box.floor = SinusoidalFloor{0.8, 0.35};
  scene.bath = LangevinBath{1, 0.3, 0.5};
  const auto alone = simulate(scene), watched = simulate(scene);
  FlightObserver flights(scene, watched->properties(), {-1, 0.25, 200});
  watched->watch(&flights);
  alone->advance_to(100);
  watched->advance_to(100);
  Snapshot a, b;
  alone->snapshot(a);
  watched->snapshot(b);
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.vz, b.vz);
  EXPECT_EQ(a.spin, b.spin);
}

struct Lattice {
  Scene scene;
  Snapshot at;
  DiskProperties disks;
};
// rows (even) of n disks, periodic both ways; those named are left out.
Lattice lattice(int n, int rows, const std::vector<int>& left_out = {}) {
  Lattice result;
  const double a = 1.02;
  result.scene.gravity = Weightless{};
  result.scene.box.width = n * a;
  result.scene.box.sides = PeriodicSides{};
  result.scene.box.top = PeriodicTop{rows * a * root3 / 2};
  for (int k = 0; k < n * rows; ++k) {
    if (std::find(left_out.begin(), left_out.end(), k) != left_out.end()) continue;
    result.at.x.push_back((k % n + 0.5 * (k / n % 2)) * a);
    result.at.z.push_back((k / n) * a * root3 / 2);
  }
  result.at.vx.resize(result.at.x.size());
  result.at.vz.resize(result.at.x.size());
  result.disks.radius.assign(result.at.x.size(), 0.5);
  result.disks.mass.assign(result.at.x.size(), 1);
  return result;
}

TEST(BondOrder, OfAPerfectCrystalIsOne) {
  const Lattice crystal = lattice(12, 10);
  OrderObserver order(crystal.scene, crystal.disks, 1, {0, 1, 20});
  order.observe(crystal.at);
  EXPECT_NEAR(order.psi6_local().value, 1, 1e-12);
  EXPECT_NEAR(order.psi6_global().value, 1, 1e-12);
  EXPECT_EQ(order.neighbours_per_disk().value, 6);
  EXPECT_EQ(order.vacancies().value, 0);
}

TEST(Rows, OfACrystalHaveItsDisksAndDensity) {
  // 9 rows of 12, each row but the last has a valley above it.
  Lattice crystal = lattice(12, 10);
  for (double& z : crystal.at.z) z += 0.5;
  OrderObserver order(crystal.scene, crystal.disks, 1, {0, 1, 20});
  for (int look = 0; look < 3; ++look) {
    crystal.at.floor_position = 0.1 * look;  // heights count from the moving floor
    for (double& z : crystal.at.z) z += look > 0 ? 0.1 : 0;
    order.observe(crystal.at);
  }
  const auto rows = order.rows();
  ASSERT_EQ(rows.size(), 9u);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    EXPECT_NEAR(rows[k].disks, 12, 1e-12) << k;
    EXPECT_NEAR(rows[k].height, 0.5 + static_cast<double>(k) * 1.02 * root3 / 2, 1e-12) << k;
  }
  EXPECT_NEAR(order.bottom_density(), 2 / (root3 * 1.02 * 1.02), 1e-12);
}

// Of the outer two of three rows half of the disks count: 12/2 + 9 + 4/2 in the height of two rows.
TEST(Rows, OfUnequalNumbersHaveTheirMeanDensity) {
  std::vector<int> left_out;
  for (int k = 0; k < 3; ++k) left_out.push_back(12 + 4 * k);
  for (int k = 0; k < 8; ++k) left_out.push_back(24 + k);
  const Lattice crystal = lattice(12, 10, left_out);
  OrderObserver order(crystal.scene, crystal.disks, 1, {0, 1, 20});
  order.observe(crystal.at);
  EXPECT_NEAR(order.bottom_density(), 17 / (12 * 1.02 * 2 * 1.02 * root3 / 2), 1e-12);
}

// Two equal rows d apart, smoothed by 0.06 D, have between them 2 t/(1 + t^4) of their peaks, t = exp(-d^2/(8 0.06^2)):
// less than 0.8, and so two rows, from d = 0.16 D on.
TEST(Rows, AreToldApartFromASixthOfADiameterOn) {
  for (const double apart : {0.14, 0.18}) {
    Lattice two = lattice(12, 10);
    for (std::size_t i = 0; i < two.at.z.size(); ++i) two.at.z[i] = i < 40 ? 0.51 : i < 80 ? 0.51 + apart : 2.01;
    OrderObserver order(two.scene, two.disks, 1, {0, 1, 20});
    order.observe(two.at);
    const auto rows = order.rows();  // all but the last, of which nothing shows the end
    ASSERT_EQ(rows.size(), apart < 0.16 ? 1u : 2u) << apart;
    EXPECT_NEAR(rows[0].disks, apart < 0.16 ? 80 : 40, 1e-12);
    EXPECT_NEAR(rows[0].height, apart < 0.16 ? 0.51 + apart / 2 : 0.51, 1e-12);
  }
}

TEST(Rows, OfAGasThereAreNone) {
  Lattice gas = lattice(40, 40);
  for (std::size_t i = 0; i < gas.at.z.size(); ++i) gas.at.z[i] = 0.025 * static_cast<double>(i);  // evenly up to 40 D
  OrderObserver order(gas.scene, gas.disks, 1, {0, 1, 60});
  order.observe(gas.at);
  EXPECT_TRUE(order.rows().empty());
  EXPECT_TRUE(std::isnan(order.bottom_density()));
}

TEST(BondOrder, CountsEmptySitesOnce) {
  const Lattice crystal = lattice(12, 10, {30, 66, 95});  // apart from each other
  const BondOrder order = bond_order(crystal.at, crystal.disks, crystal.scene.box.width,
                                     std::get<PeriodicTop>(crystal.scene.box.top).height);
  ASSERT_EQ(order.vacancy_x.size(), 3u);
  const double a = 1.02;
  EXPECT_NEAR(order.vacancy_x[0], 6 * a, 0.05);
  EXPECT_NEAR(order.vacancy_z[0], 2 * a * root3 / 2, 0.05);
}

// A crystal on a floor, its surface complete or with a disk missing or added: no empty site inside.
TEST(BondOrder, DoesNotTakeTheSurfaceForEmptySites) {
  Lattice bed = lattice(12, 6);
  const auto vacancies = [&] { return bond_order(bed.at, bed.disks, bed.scene.box.width, 0).vacancy_x.size(); };
  EXPECT_EQ(vacancies(), 0u);
  for (auto* values : {&bed.at.x, &bed.at.z}) values->erase(values->end() - 4);
  EXPECT_EQ(vacancies(), 0u);
}

// psi_6 of one bond at angle a is exp(6 i a); of disks without neighbours 0.
TEST(BondOrder, TurnsSixTimesWithTheBond) {
  Snapshot at;
  at.x = {0, std::cos(0.3), 10};
  at.z = {0, std::sin(0.3), 10};
  const BondOrder order = bond_order(at, {{0.5, 0.5, 0.5}, {1, 1, 1}}, 0, 0);
  EXPECT_NEAR(order.psi6_re[0], std::cos(1.8), 1e-12);
  EXPECT_NEAR(order.psi6_im[0], std::sin(1.8), 1e-12);
  EXPECT_NEAR(order.psi6_re[1], std::cos(1.8), 1e-12);
  EXPECT_EQ(order.neighbours[2], 0);
  EXPECT_EQ(order.psi6_re[2], 0);
}

Scene box_of(std::uint32_t count) {
  Scene scene;
  scene.gravity = Weightless{};
  scene.disks.species = {{count, 1, 1}};
  scene.box.width = 100;
  scene.box.sides = PeriodicSides{};
  scene.box.top = PeriodicTop{100};
  return scene;
}

TEST(Velocities, OfAMaxwellianHaveNoFourthCumulantAndThoseOnACircleMinusOneHalf) {
  const std::uint32_t n = 1000;
  const Scene scene = box_of(n);
  const DiskProperties disks{std::vector<double>(n, 0.5), std::vector<double>(n, 1)};
  Random random(5);
  VelocityObserver maxwellian(scene, disks, 1, {0, 10, 10}, false), circle(scene, disks, 1, {0, 10, 10}, false);
  Snapshot at;
  at.x.resize(n), at.z.resize(n), at.vx.resize(n), at.vz.resize(n);
  for (int look = 0; look < 400; ++look) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const Random::Pair v = random.normal_pair();
      const double speed = std::hypot(v.first, v.second);
      at.z[i] = 100 * random.uniform();
      // Hotter above: T = 1 to 4. The layers have one T each, so only the local cumulant sees through it.
      const double heat = 1 + 3 * std::floor(at.z[i] / 10) / 9;
      at.vx[i] = std::sqrt(heat) * v.first, at.vz[i] = std::sqrt(heat) * v.second;
      if (look % 2 == 1) at.vx[i] = v.first / speed, at.vz[i] = v.second / speed;
    }
    (look % 2 == 1 ? circle : maxwellian).observe(at, 0);
  }
  // 2e5 velocities: the error of a2 is sqrt(5/2e5) = 0.005 at most; 4 of them.
  EXPECT_NEAR(maxwellian.fourth_cumulant_local(), 0, 0.02);
  // <T^2>/<T>^2 - 1 with T = 1, 4/3, ... 4.
  EXPECT_NEAR(maxwellian.fourth_cumulant_of_all().value, 0.147, 0.02);
  EXPECT_NEAR(circle.fourth_cumulant_of_all().value, -0.5, 0.003);
  EXPECT_NEAR(maxwellian.layer(0).temperature_x(), 1, 0.05);
  EXPECT_NEAR(maxwellian.layer(9).temperature_z(), 4, 0.2);
  EXPECT_NEAR(maxwellian.number_density(maxwellian.layer(3), false), n / 1e4, 0.003);
}

// With u = v^2/(2 T) of a Maxwellian, a2 = <u^2>/(2 <u>^2) - 1 changes by u^2/2 - 1 - 2 (u - 1), of which the variance
// is 1: the error of a2 from N independent velocities is 1/sqrt(N), whatever T is.
TEST(Velocities, KnowTheErrorOfTheFourthCumulant) {
  constexpr std::uint32_t n = 100, looks = 1024;
  const Scene scene = box_of(n);
  const DiskProperties disks{std::vector<double>(n, 0.5), std::vector<double>(n, 1)};
  Random random(7);
  VelocityObserver velocities(scene, disks, 1, {0, 10, 10}, false);
  Snapshot at;
  at.x.resize(n), at.z.resize(n, 5), at.vx.resize(n), at.vz.resize(n);
  for (std::uint32_t look = 0; look < looks; ++look) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const Random::Pair v = random.normal_pair();
      at.vx[i] = 2 * v.first, at.vz[i] = 2 * v.second;  // T = 4
    }
    velocities.observe(at, 0);
  }
  // Its own scatter, from some hundred independent parts: a tenth.
  const double expected = 1 / std::sqrt(double{n} * looks);
  const Measured cumulant = velocities.fourth_cumulant_of_all();
  EXPECT_NEAR(cumulant.value, 0, 4 * expected);
  EXPECT_NEAR(cumulant.std_error / expected, 1, 0.3);
}

// Two light disks and two of mass 4, which rise together at 3. About that each component of sqrt(m) v is 1 or -1, so
// T = 1, and half of the disks are in each of two bins 0.1 wide.
TEST(Velocities, HaveAHistogramInUnitsOfTheirTemperature) {
  const DiskProperties disks{{0.5, 0.5, 0.5, 0.5}, {1, 1, 4, 4}};
  VelocityObserver velocities(box_of(4), disks, 1, {0, 10, 10}, false);
  Snapshot at;
  at.x = {1, 2, 3, 4}, at.z = {5, 5, 5, 5}, at.vx = {1, -1, 0.5, -0.5}, at.vz = {4, 2, 3.5, 2.5};
  velocities.observe(at, 0);
  EXPECT_DOUBLE_EQ(velocities.histogram_unit(), 1);
  for (int bin = 0; bin < VelocityObserver::histogram_bins; ++bin) {
    const double expected = std::abs(std::abs(velocities.histogram_place(bin)) - 1) < 0.01 ? 0.5 / 0.1 : 0;
    EXPECT_DOUBLE_EQ(velocities.histogram_x(bin), expected) << bin;
    EXPECT_DOUBLE_EQ(velocities.histogram_z(bin), expected) << bin;
  }
}

// In the frame of a floor that rises at 2, disks at rest in the lab fall at -2.
TEST(Velocities, AreRelativeToTheFloorInItsFrame) {
  const Scene scene = box_of(1);
  VelocityObserver lab(scene, {{0.5}, {1}}, 1, {0, 1, 20}, false), frame(scene, {{0.5}, {1}}, 1, {0, 1, 20}, true);
  Snapshot at;
  at.x = {1}, at.z = {5.5}, at.vx = {0}, at.vz = {0};
  at.floor_position = 3, at.floor_velocity = 2;
  lab.observe(at, 0);
  frame.observe(at, 0);
  EXPECT_EQ(lab.layer(5).count, 1);
  EXPECT_EQ(lab.layer(5).mean_vz(), 0);
  EXPECT_EQ(frame.layer(2).count, 1);
  EXPECT_EQ(frame.layer(2).mean_vz(), -2);
}

TEST(Displacement, OfFreeFlightGrowsAsTheSquareOfTimeAcrossTheSides) {
  Scene scene = box_of(1);
  scene.start = PlacedStart{{{50, 50, 0.3, -0.4, 0, 0}}};
  const auto simulation = simulate(scene);
  DisplacementObserver displacement(scene, 1);
  Snapshot at;
  for (int look = 0; look < 1025; ++look) {
    simulation->advance_to(10.0 * look);
    simulation->snapshot(at);
    displacement.observe(at);
  }
  const auto lags = displacement.lags();
  ASSERT_EQ(lags.size(), 11u);
  for (const auto& lag : lags) {
    const double t = 10 * static_cast<double>(lag.looks);
    EXPECT_NEAR(lag.x.value / (0.09 * t * t), 1, 1e-9);
    EXPECT_NEAR(lag.z.value / (0.16 * t * t), 1, 1e-9);
    EXPECT_EQ(lag.origins, 1024 / lag.looks);
  }
}

// The mean of the later half less that of the earlier, with the error of independent values.
TEST(Drift, IsTheLaterHalfLessTheEarlier) {
  Scene scene = dropped(1);
  const auto simulation = simulate(scene);
  Snapshot at;
  simulation->snapshot(at);
  const auto measured = [&](int periods, const auto& speed, const auto& height) {
    BedObserver bed(scene, simulation->properties(), 2, {-2, 0.5, 40}, {KernelKind::gaussian, 0.5});
    for (int p = 0; p < periods; ++p) {
      at.vx[0] = speed(p);
      at.z[0] = height(p);
      bed.observe(at, 0);
      bed.observe(at, 1);
    }
    return std::pair{bed.drift_of_temperature_x(), bed.drift_of_centre()};
  };
  // Nine periods: the fifth belongs to neither half.
  const auto [hotter, lower] = measured(
      9, [](int p) { return p < 4    ? 1.0
                            : p == 4 ? 50.0
                                     : 2.0; }, [](int p) { return p < 5 ? 3.0 : 2.5; });
  EXPECT_NEAR(hotter.value, 3, 1e-14);
  EXPECT_NEAR(lower.value, -0.5, 1e-14);
  EXPECT_NEAR(hotter.std_error, 0, 1e-14);
  const auto [none, nothing] = measured(
      3, [](int) { return 1.0; }, [](int) { return 1.0; });
  EXPECT_TRUE(std::isnan(none.std_error) && std::isnan(nothing.std_error));
  // Heights of independent normal deviates: 400 differences in units of their stated error scatter by 1 +- 0.07
  // (two standard errors, and half as much again since the errors themselves are estimated).
  Random random(11);
  double sum = 0, squares = 0;
  constexpr int trials = 400;
  for (int trial = 0; trial < trials; ++trial) {
    const auto drift = measured(
                           64, [](int) { return 1.0; }, [&](int) { return 5 + random.normal_pair().first; })
                           .second;
    const double pull = drift.value / drift.std_error;
    sum += pull / trials;
    squares += pull * pull / trials;
  }
  EXPECT_NEAR(sum, 0, 3.3 / std::sqrt(trials));
  EXPECT_GT(std::sqrt(squares), 0.8);
  EXPECT_LT(std::sqrt(squares), 1.15);
}

// Two disks with velocities of +-1 each way: m <v^2> = 1 in either direction. Their one free momentum has T = 2, and
// Z = 1 + virial/(2 N T).
TEST(Compressibility, AndItsErrorAreThoseOfTheVirialRateByHand) {
  Scene scene = dropped(1);
  scene.disks.species = {{2, 1, 1}};
  scene.start = PlacedStart{{{1, 2, 1, 1, 0, 0}, {3, 2, -1, -1, 0, 0}}};
  const auto simulation = simulate(scene);
  Snapshot at;
  simulation->snapshot(at);
  BedObserver bed(scene, simulation->properties(), 1, {-2, 0.5, 40}, {KernelKind::gaussian, 0.5});
  bed.observe(at, 0);
  ASSERT_NEAR(bed.temperature_x().value, 1, 1e-14);
  ASSERT_NEAR(bed.temperature_z().value, 1, 1e-14);
  const Measured z = bed.compressibility_factor({4, 0.6});
  EXPECT_NEAR(z.value, 1 + 4 / (2 * 2 * 2.0), 1e-14);
  EXPECT_NEAR(z.std_error, 0.6 / (2 * 2 * 2.0), 1e-14);
  // Equal disks cover pi/4 of their number density.
  const Profile profile = bed.density(false);
  for (std::size_t i = 0; i < profile.height.size(); ++i)
    EXPECT_NEAR(profile.area_fraction[i], std::numbers::pi / 4 * profile.number_density[i], 1e-14) << profile.height[i];
}

// Saved in the middle and read into new ones, observers end as if nothing had happened.
TEST(Observers, GoOnFromTheirBytes) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{40, 1, 1}};
  scene.box.width = 8;
  scene.start_temperature = 2;
  const auto simulation = simulate(scene);
  const DiskProperties disks = simulation->properties();
  const LayerGrid layers{-1, 0.5, 100};
  struct All {
    BedObserver bed;
    OrderObserver order;
    VelocityObserver velocities;
    DisplacementObserver displacement;
    FlightObserver flights;
    void observe(const Snapshot& at, std::uint32_t phase) {
      bed.observe(at, phase), order.observe(at), velocities.observe(at, phase), displacement.observe(at);
    }
    std::vector<std::uint8_t> bytes() {
      ArchiveWriter out;
      out(bed, order, velocities, displacement, flights);
      return out.take();
    }
  };
  const auto make = [&] {
    return All{{scene, disks, 4, {-1, 0.25, 100}, {KernelKind::gaussian, 0.5}},
               {scene, disks, 4, layers},
               {scene, disks, 4, layers, false},
               {scene, disks.mass.size()},
               {scene, disks, layers}};
  };
  All whole = make(), first = make(), second = make();
  simulation->watch(&whole.flights);
  Snapshot at;
  for (int look = 0; look < 30; ++look) {
    simulation->advance_to(0.37 * look);
    simulation->snapshot(at);
    if (look % 4 == 0) whole.flights.end_block(at.time + 1e-3);
    whole.observe(at, static_cast<std::uint32_t>(look) % 4);
    (look < 15 ? first : second).observe(at, static_cast<std::uint32_t>(look) % 4);
    if (look == 14) {
      const auto saved = first.bytes();
      ArchiveReader in(saved);
      in(second.bed, second.order, second.velocities, second.displacement, second.flights);
      EXPECT_TRUE(in.at_end());
      auto cut = saved;
      cut.pop_back();
      ArchiveReader short_in(cut);
      All third = make();
      EXPECT_THROW(short_in(third.bed, third.order, third.velocities, third.displacement, third.flights),
                   std::invalid_argument);
    }
  }
  const auto copy = whole.bytes();
  ArchiveReader in(copy);
  in(first.bed, first.order, first.velocities, first.displacement, first.flights);
  EXPECT_EQ(first.bytes(), copy);
  second.flights = first.flights;  // who watched only the whole run
  EXPECT_EQ(second.bytes(), copy);
}

TEST(PrecisionLost, NamesWhatIsWrongAndNothingElse) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{50, 1, 1}};
  scene.disks.contact = {0.9, 0, 0};
  scene.box.width = 10;
  scene.box.sides = HardSides{{0.9, 0, 0}};
  scene.box.floor = SinusoidalFloor{0.5, 0.5};
  const auto make = [&] {
    auto simulation = simulate(scene);
    simulation->advance_to(20);
    return simulation;
  };
  EXPECT_EQ(precision_lost(*make()), "");
  Spoilt run(make());
  EXPECT_EQ(precision_lost(run), "");
  run.overlap = 0.9e-9;
  EXPECT_EQ(precision_lost(run), "");
  run.overlap = 2.3456e-9;  // three digits are said
  EXPECT_EQ(precision_lost(run), "two disks overlap by 2.35e-09 D (1e-09 D is allowed)");
  run.overlap = 0;
  const EnergyLedger sound = run.ledger;
  run.ledger.kinetic += 1e-4 * (sound.dissipated + sound.initial);
  EXPECT_NE(precision_lost(run).find("energy balance"), std::string::npos);
  run.ledger = sound;
  run.ledger.potential = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(precision_lost(run).find("no longer a finite number"), std::string::npos);
  run.ledger = sound;
  run.ledger.kinetic = std::numeric_limits<double>::infinity();
  EXPECT_NE(precision_lost(run).find("no longer a finite number"), std::string::npos);
}

}  // namespace
}  // namespace shakebed::sim
