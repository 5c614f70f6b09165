// What observers say of a few disks, against its definition: sums over these disks written once more, and errors of
// fewer than 16 samples, which are those of textbooks.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <vector>

#include "sim/engine/random.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/measure/flights.hpp"
#include "sim/measure/observables.hpp"
#include "sim/measure/order.hpp"
#include "sim/measure/species.hpp"
#include "sim/measure/velocities.hpp"

namespace shakebed::sim::by_hand {
namespace {

double mean_of_values(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}
// s/sqrt(n), s^2 by n - 1.
double textbook_error(const std::vector<double>& values) {
  const double mean = mean_of_values(values);
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  const auto n = static_cast<double>(values.size());
  return std::sqrt(squares / (n - 1) / n);
}

// A function of means: each sample's part in it, by differences of the function, and the textbook error of these.
using Function = std::function<double(const std::vector<double>&)>;
void expect_function_of_means(const Measured& found, const Function& function,
                              const std::vector<std::vector<double>>& samples, const char* what) {
  const std::size_t count = samples.size(), size = samples[0].size();
  std::vector<double> mean(size), parts(count);
  for (const auto& sample : samples)
    for (std::size_t q = 0; q < size; ++q) mean[q] += sample[q] / static_cast<double>(count);
  for (std::size_t q = 0; q < size; ++q) {
    std::vector<double> more = mean, less = mean;
    more[q] += 1e-5, less[q] -= 1e-5;
    const double slope = (function(more) - function(less)) / 2e-5;
    for (std::size_t b = 0; b < count; ++b) parts[b] += slope * samples[b][q];
  }
  EXPECT_NEAR(found.value, function(mean), 1e-12) << what;
  EXPECT_NEAR(found.std_error, textbook_error(parts), 1e-8) << what;
}

Scene wide_box(double width, bool falls) {
  Scene scene;
  if (falls)
    scene.gravity = UniformGravity{};
  else
    scene.gravity = Weightless{};
  scene.box.width = width;
  scene.box.sides = PeriodicSides{};
  return scene;
}

// ---------------------------------------------------------------------------------------------------------------------
// flights

// Without gravity, in a box of 5 D, for a time of 4: a disk of mass 2 flies up for 2, from 0.5 D at 1, and down for 2
// at 0.5; a disk of mass 1 floats at 3.5 D. In the layer from 1 to 2 D the first is for 1 + 1.
TEST(FlightsByHand, AreCountedInTheLayersTheyCross) {
  FlightObserver flights(wide_box(5, false), {{0.5, 0.5}, {2, 1}}, {0, 1, 5});
  flights.flies(0, 0, 0, 0.5, 3, 1);
  flights.flies(0, 1, 0, 3.5, 0.5, 0);
  flights.begin(0);
  flights.flies(2, 0, 0, 2.5, 1, -0.5);
  flights.touched(1, 0, 0.75, 0.6, 0.8, -3, 2);   // 0.25 of 0.8 in the lowest layer, the middle in the second
  flights.touched(1, 0, 2.2, 0.6, -0.8, 1, -1);   // 0.2 of 0.8 in the third, 0.6 in the second
  flights.pressed(1, 0, 3.1, 0.5, 0.5, 2, 4);     // counts for the pressure, not as a contact
  flights.touched_wall(1, 0, true, 0.5, 9, 0.7);  // from the centre down to the floor: all in the lowest layer
  flights.touched_wall(1, 0, false, 0.5, 9, 9);   // a side
  flights.end_block(4);
  const double area_time = 5 * 1 * 4;
  const auto layers = flights.layers();
  ASSERT_EQ(layers.size(), 4U);
  EXPECT_DOUBLE_EQ(layers[1].height, 1.5);
  EXPECT_DOUBLE_EQ(layers[0].number_density.value, 0.5 / area_time);
  EXPECT_DOUBLE_EQ(layers[1].number_density.value, 2 / area_time);
  EXPECT_DOUBLE_EQ(layers[2].number_density.value, 1.5 / area_time);
  EXPECT_DOUBLE_EQ(layers[3].number_density.value, 4 / area_time);
  EXPECT_DOUBLE_EQ(layers[1].temperature_x.value, 2 * (9 + 1) / 2.0);
  EXPECT_DOUBLE_EQ(layers[1].mean_velocity_z.value, (1 - 0.5) / 2);
  EXPECT_DOUBLE_EQ(layers[1].temperature_z.value, 2 * ((1 + 0.25) / 2 - 0.0625));
  const double xx = -3 * 0.6 * 0.55 / 0.8 + 0.6 * 0.6 / 0.8, zz = 2 * 0.55 + 0.6;
  EXPECT_NEAR(layers[1].pressure_xx.value, (2 * (9 + 1) + xx) / area_time, 1e-14);
  EXPECT_NEAR(layers[1].pressure_zz.value, (2 * (1 + 0.25) + zz) / area_time, 1e-14);
  EXPECT_NEAR(layers[0].pressure_xx.value, (2 * 9 * 0.5 - 3 * 0.6 * 0.25 / 0.8) / area_time, 1e-14);
  EXPECT_NEAR(layers[0].pressure_zz.value, (2 * 0.5 + 2 * 0.25 + 0.5 * 0.7) / area_time, 1e-14);
  EXPECT_NEAR(layers[3].pressure_xx.value, (0.25 * 4 + 1) / area_time, 1e-14);
  EXPECT_NEAR(layers[3].pressure_zz.value, 2 / area_time, 1e-14);
  const std::array<double, 4> contacts{0, 2, 0, 0};
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_DOUBLE_EQ(layers[k].collision_rate.value, contacts[k] / area_time) << k;
    EXPECT_EQ(layers[k].weight_above.value, 0) << "there is no weight";
  }
  EXPECT_DOUBLE_EQ(flights.floor_pressure().value, 0.7 / (5 * 4));
}

// A disk of mass 3 bounces from 0 to h. Where it crosses a layer from v1 to v2 the mean of v^2 over time is
// (v1^2 + v1 v2 + v2^2)/3, and it is there for 2 (v1 - v2). Its weight above z is m times its share of time above z.
TEST(FlightsByHand, OfABouncingDiskOfMassThreeHaveItsTemperatureAndWeight) {
  const double h = 2.3, mass = 3, start = std::sqrt(2 * h);
  FlightObserver flights(wide_box(4, true), {{0.5}, {mass}}, {0.5, 0.5, 8});
  const auto speed_at = [&](double low) { return std::sqrt(2 * std::max(0.0, h - low)); };
  flights.flies(0, 0, 0, 0.5, 0.3, start);
  flights.begin(0);
  for (int bounce = 1; bounce <= 3; ++bounce) {
    flights.flies(2 * start * bounce, 0, 0, 0.5, 0.3, start);
    flights.end_block(2 * start * bounce);
  }
  const auto layers = flights.layers();
  ASSERT_EQ(layers.size(), 5U);
  for (std::size_t k = 0; k < 5; ++k) {
    const double v1 = speed_at(0.5 * static_cast<double>(k)), v2 = speed_at(0.5 * static_cast<double>(k) + 0.5);
    EXPECT_NEAR(layers[k].number_density.value, (v1 - v2) / start / (4 * 0.5), 1e-12) << k;
    EXPECT_NEAR(layers[k].temperature_x.value, mass * 0.09, 1e-12) << k;
    EXPECT_NEAR(layers[k].temperature_z.value, mass * (v1 * v1 + v1 * v2 + v2 * v2) / 3, 1e-11) << k;
    // Mean over the layer of sqrt(2 (h - z)): differences of -(2 (h - z))^(3/2)/3.
    const double weight = (std::pow(v1, 3) - std::pow(v2, 3)) / 3 / 0.5 / start;
    EXPECT_NEAR(layers[k].weight_above.value, mass * weight / 4, 1e-12) << k;
    EXPECT_NEAR(layers[k].pressure_xx.value, layers[k].number_density.value * mass * 0.09, 1e-12) << k;
  }
}

// Nine blocks of a time of 1. A disk of mass 2 is in the lower layer for a part of it, one of mass 1 all the time.
TEST(FlightsByHand, HaveTheErrorsOfFunctionsOfTheirMeans) {
  Random random(3);
  FlightObserver flights(wide_box(1, false), {{0.5, 0.5}, {2, 1}}, {0, 1, 2});
  flights.begin(0);
  std::vector<std::vector<double>> samples;  // number, mass, energies, momentum
  for (int block = 0; block < 9; ++block) {
    const double part = 0.3 + 0.6 * random.uniform(), a = random.uniform(), c = 0.4 * random.uniform(),
                 d = random.uniform(), e = 0.4 * random.uniform() - 0.3;
    flights.flies(block, 0, 0, 0.5, a, c);
    flights.flies(block, 1, 0, 0.5, d, e);
    flights.flies(block + part, 0, 0, 1.5, 0, 0);
    flights.end_block(block + 1);
    samples.push_back({part + 1, 2 * part + 1, 2 * a * a * part + d * d, 2 * c * c * part + e * e, 2 * c * part + e});
  }
  const FlightObserver::Layer layer = flights.layers()[0];
  const auto mean = [](std::size_t q) { return [q](const std::vector<double>& m) { return m[q]; }; };
  expect_function_of_means(layer.number_density, mean(0), samples, "density");
  expect_function_of_means(layer.pressure_xx, mean(2), samples, "p_xx");
  expect_function_of_means(layer.pressure_zz, mean(3), samples, "p_zz");
  expect_function_of_means(
      layer.temperature_x, [](const std::vector<double>& m) { return m[2] / m[0]; }, samples, "T_x");
  expect_function_of_means(
      layer.temperature_z, [](const std::vector<double>& m) { return (m[3] - m[4] * m[4] / m[1]) / m[0]; }, samples,
      "T_z");
  expect_function_of_means(
      layer.mean_velocity_z, [](const std::vector<double>& m) { return m[4] / m[1]; }, samples, "v_z");
}

// ---------------------------------------------------------------------------------------------------------------------
// states made at random

struct States {
  DiskProperties disks;
  std::vector<Snapshot> looks;  // period by period
  std::uint32_t phases = 2;
  std::size_t periods() const { return looks.size() / phases; }
};
// Disks of two masses and sizes between 0 and 3 D; what moves in one phase differs from the other.
States states_at_random(std::uint32_t count, std::size_t periods, std::uint64_t seed) {
  Random random(seed);
  States all;
  for (std::uint32_t i = 0; i < count; ++i) {
    all.disks.radius.push_back(i % 3 == 0 ? 0.4 : 0.5);
    all.disks.mass.push_back(i % 3 == 0 ? 0.7 : 1.6);
  }
  for (std::size_t look = 0; look < periods * all.phases; ++look) {
    Snapshot at;
    at.time = static_cast<double>(look);
    at.floor_position = 0.3 * random.uniform(), at.floor_velocity = random.uniform();
    for (std::uint32_t i = 0; i < count; ++i) {
      at.x.push_back(7 * random.uniform()), at.z.push_back(3 * random.uniform());
      at.vx.push_back(random.normal_pair().first);
      at.vz.push_back(random.normal_pair().first + (look % all.phases == 0 ? 0.5 : -0.3));
      at.spin.push_back(random.normal_pair().first);
    }
    all.looks.push_back(at);
  }
  return all;
}

// A value of each period: the mean over its looks.
std::vector<double> by_period(const States& all, const std::function<double(const Snapshot&, std::size_t phase)>& one) {
  std::vector<double> values(all.periods());
  for (std::size_t k = 0; k < all.looks.size(); ++k)
    values[k / all.phases] += one(all.looks[k], k % all.phases) / all.phases;
  return values;
}
void expect_mean(const Measured& found, const std::vector<double>& values, const char* what) {
  EXPECT_NEAR(found.value, mean_of_values(values), 1e-12) << what;
  EXPECT_NEAR(found.std_error, textbook_error(values), 1e-12) << what;
}

// Velocity of the centre of mass at each phase.
std::vector<double> velocity_of_phases(const States& all) {
  std::vector<double> mean(all.phases);
  for (std::size_t k = 0; k < all.looks.size(); ++k) {
    double momentum = 0, mass = 0;
    for (std::size_t i = 0; i < all.disks.mass.size(); ++i)
      momentum += all.disks.mass[i] * all.looks[k].vz[i], mass += all.disks.mass[i];
    mean[k % all.phases] += momentum / mass / static_cast<double>(all.periods());
  }
  return mean;
}

class BedAtRandom : public testing::Test {
 protected:
  BedAtRandom() : all_(states_at_random(11, 7, 5)), scene_(wide_box(7, true)), bed_(make()) {
    for (std::size_t k = 0; k < all_.looks.size(); ++k)
      bed_.observe(all_.looks[k], static_cast<std::uint32_t>(k % all_.phases));
  }
  BedObserver make() {
    scene_.disks.inertia_ratio = 0.4;
    return {scene_, all_.disks, all_.phases, {-2, 0.5, 14}, {KernelKind::gaussian, 0.3}};
  }
  double mass(std::size_t i) const { return all_.disks.mass[i]; }
  // Mean over the disks.
  double mean(const std::function<double(std::size_t)>& one) const {
    double sum = 0;
    for (std::size_t i = 0; i < all_.disks.mass.size(); ++i) sum += one(i);
    return sum / static_cast<double>(all_.disks.mass.size());
  }
  double spin_energy(const Snapshot& at, std::size_t i) const {
    return 0.4 * mass(i) * all_.disks.radius[i] * all_.disks.radius[i] * at.spin[i] * at.spin[i];
  }
  States all_;
  Scene scene_;
  BedObserver bed_;
};

TEST_F(BedAtRandom, HasItsMeansOverPeriods) {
  expect_mean(
      bed_.temperature_x(),
      by_period(all_, [&](const Snapshot& at,
                          std::size_t) { return mean([&](std::size_t i) { return mass(i) * at.vx[i] * at.vx[i]; }); }),
      "T_x");
  const std::vector<double> flow = velocity_of_phases(all_);
  expect_mean(bed_.temperature_z(),
              by_period(all_,
                        [&](const Snapshot& at, std::size_t phase) {
                          return mean([&](std::size_t i) { return mass(i) * std::pow(at.vz[i] - flow[phase], 2); });
                        }),
              "T_z");
  expect_mean(bed_.spin_temperature(),
              by_period(all_, [&](const Snapshot& at,
                                  std::size_t) { return mean([&](std::size_t i) { return spin_energy(at, i); }); }),
              "spin");
  const double all = mean([&](std::size_t i) { return mass(i); });
  const auto centre = [&](const Snapshot& at) { return mean([&](std::size_t i) { return mass(i) * at.z[i]; }) / all; };
  expect_mean(bed_.centre_of_mass(), by_period(all_, [&](const Snapshot& at, std::size_t) { return centre(at); }),
              "centre");
  const double row = std::numbers::sqrt3 / 2;
  expect_mean(bed_.bottom_row_density(),
              by_period(all_,
                        [&](const Snapshot& at, std::size_t) {
                          return 11 * mean([&](std::size_t i) {
                                   const double above = at.z[i] - at.floor_position;
                                   return above > 0.5 - row / 2 && above < 0.5 + row / 2 ? 1.0 : 0.0;
                                 }) /
                                 (7 * row);
                        }),
              "row");
  const std::vector<double> by_phase = bed_.centre_of_mass_by_phase();
  for (std::size_t phase = 0; phase < 2; ++phase) {
    double sum = 0;
    for (std::size_t k = phase; k < all_.looks.size(); k += 2) sum += centre(all_.looks[k]) / 7;
    EXPECT_NEAR(by_phase[phase], sum, 1e-13);
  }
}

// Three periods belong to each half; a step between them is no noise.
TEST_F(BedAtRandom, DriftsWithTheErrorOfTwoMeans) {
  const std::vector<double> hot = by_period(all_, [&](const Snapshot& at, std::size_t) {
    return mean([&](std::size_t i) { return mass(i) * at.vx[i] * at.vx[i]; });
  });
  const std::vector<double> early(hot.begin(), hot.begin() + 3), late(hot.begin() + 4, hot.end());
  const Measured drift = bed_.drift_of_temperature_x();
  EXPECT_NEAR(drift.value, mean_of_values(late) - mean_of_values(early), 1e-12);
  std::vector<double> noise;
  for (const double one : early) noise.push_back(one - mean_of_values(early));
  for (const double one : late) noise.push_back(one - mean_of_values(late));
  EXPECT_NEAR(drift.std_error, 2 * textbook_error(noise), 1e-12);
}

TEST_F(BedAtRandom, HasItsLayersByPhase) {
  struct Sums {
    double count = 0, mass = 0, vx2 = 0, vz = 0, vz2 = 0, spin = 0;
  };
  std::array<std::array<Sums, 3>, 2> sums{};
  for (std::size_t k = 0; k < all_.looks.size(); ++k) {
    const Snapshot& at = all_.looks[k];
    for (std::size_t i = 0; i < at.z.size(); ++i) {
      Sums& one = sums[k % 2][static_cast<std::size_t>(at.z[i])];
      one.count += 1, one.mass += mass(i), one.vx2 += mass(i) * at.vx[i] * at.vx[i], one.vz += mass(i) * at.vz[i];
      one.vz2 += mass(i) * at.vz[i] * at.vz[i], one.spin += spin_energy(at, i);
    }
  }
  double local = 0;
  const auto layers = bed_.layers();
  ASSERT_EQ(layers.size(), 3U);
  for (std::size_t z = 0; z < 3; ++z) {
    const Sums &a = sums[0][z], &b = sums[1][z];
    const double count = a.count + b.count;
    const double of_a = a.vz2 - a.vz * a.vz / a.mass, of_b = b.vz2 - b.vz * b.vz / b.mass;
    EXPECT_DOUBLE_EQ(layers[z].height, static_cast<double>(z) + 0.5);
    EXPECT_NEAR(layers[z].temperature_x, (a.vx2 + b.vx2) / count, 1e-12);
    EXPECT_NEAR(layers[z].temperature_z, (of_a + of_b) / count, 1e-12);
    EXPECT_NEAR(layers[z].mean_velocity_z, (a.vz + b.vz) / (a.mass + b.mass), 1e-12);
    EXPECT_NEAR(layers[z].share, count / (11 * 14), 1e-14);
    EXPECT_NEAR(layers[z].spin_temperature, (a.spin + b.spin) / count, 1e-12);
    local += of_a * a.count / (a.count - 1) + of_b * b.count / (b.count - 1);
  }
  const Measured found = bed_.temperature_z_local(), whole = bed_.temperature_z();
  EXPECT_NEAR(found.value, local / (11 * 14), 1e-12);
  EXPECT_NEAR(found.std_error, found.value * whole.std_error / whole.value, 1e-14);
  // Four times as slow, a sixteenth as hot: colder than m g D, too, it has its error.
  for (Snapshot& at : all_.looks) {
    at.floor_velocity /= 4;
    for (std::size_t i = 0; i < at.vz.size(); ++i) at.vx[i] /= 4, at.vz[i] /= 4;
  }
  BedObserver slow = make();
  for (std::size_t k = 0; k < all_.looks.size(); ++k)
    slow.observe(all_.looks[k], static_cast<std::uint32_t>(k % all_.phases));
  EXPECT_NEAR(slow.temperature_z_local().value, found.value / 16, 1e-12);
  EXPECT_NEAR(slow.temperature_z_local().std_error, found.std_error / 16, 1e-14);
}

// Gaussians about the centres, in the frame of the box and in that of the floor; the covered fraction by each disk's
// own area.
TEST_F(BedAtRandom, HasItsDensitiesInBothFrames) {
  const auto gauss = [](double s) { return std::exp(-s * s / (2 * 0.09)) / (0.3 * std::sqrt(2 * std::numbers::pi)); };
  for (const bool floor_frame : {false, true}) {
    const Profile profile = bed_.density(floor_frame);
    EXPECT_EQ(profile.samples, 14U);
    for (std::size_t k = 4; k < 12; ++k) {
      const auto density = [&](const Snapshot& at, bool area) {
        return 11.0 / 7 * mean([&](std::size_t i) {
                 const double r = all_.disks.radius[i], away = at.z[i] - (floor_frame ? at.floor_position : 0);
                 return (area ? std::numbers::pi * r * r : 1) * gauss(profile.height[k] - away);
               });
      };
      const auto number = by_period(all_, [&](const Snapshot& at, std::size_t) { return density(at, false); });
      const auto area = by_period(all_, [&](const Snapshot& at, std::size_t) { return density(at, true); });
      EXPECT_NEAR(profile.number_density[k], mean_of_values(number), 1e-9) << k;  // the kernel ends at 6.5 widths
      EXPECT_NEAR(profile.std_error[k], textbook_error(number), 1e-9) << k;
      EXPECT_NEAR(profile.area_fraction[k], mean_of_values(area), 1e-9) << k;
    }
  }
}

// ---------------------------------------------------------------------------------------------------------------------
// velocities, displacements, species

// What a cell holds is summed once more about its own mean; the lowest and the highest layer take what is beyond.
TEST(VelocitiesByHand, HaveTheMomentsOfTheirCells) {
  const States all = states_at_random(9, 6, 8);
  Scene scene = wide_box(7, true);
  scene.disks.inertia_ratio = 0.4;
  VelocityObserver velocities(scene, all.disks, 2, {0.7, 0.8, 2}, true);
  std::array<std::array<std::vector<std::array<double, 4>>, 2>, 2> cells;  // mass, v_x, v_z, spin energy
  for (std::size_t k = 0; k < all.looks.size(); ++k) {
    const Snapshot& at = all.looks[k];
    velocities.observe(at, static_cast<std::uint32_t>(k % 2));
    for (std::size_t i = 0; i < 9; ++i) {
      const double m = all.disks.mass[i], r = all.disks.radius[i];
      cells[k % 2][at.z[i] - at.floor_position < 1.5 ? 0 : 1].push_back(
          {m, at.vx[i], at.vz[i] - at.floor_velocity, 0.4 * m * r * r * at.spin[i] * at.spin[i]});
    }
  }
  double fourth = 0, gaussian = 0;
  for (std::uint32_t phase = 0; phase < 2; ++phase) {
    for (std::size_t layer = 0; layer < 2; ++layer) {
      const auto& disks = cells[phase][layer];
      const auto n = static_cast<double>(disks.size());
      double mass = 0, px = 0, pz = 0, spin = 0, root_z = 0, x2 = 0, z2 = 0, square = 0, quartic = 0;
      for (const auto& [m, x, z, s] : disks)
        mass += m, px += m * x, pz += m * z, spin += s / n, root_z += std::sqrt(m) * z / n;
      for (const auto& [m, x, z, s] : disks) {
        x2 += m * std::pow(x - px / mass, 2) / n, z2 += m * std::pow(z - pz / mass, 2) / n;
        const double c2 = m * x * x + std::pow(std::sqrt(m) * z - root_z, 2);
        square += c2 / n, quartic += c2 * c2 / n;
      }
      const VelocityMoments& cell = velocities.cell(phase, layer);
      EXPECT_EQ(cell.count, n);
      EXPECT_NEAR(cell.mean_vx(), px / mass, 1e-12);
      EXPECT_NEAR(cell.mean_vz(), pz / mass, 1e-12);
      EXPECT_NEAR(cell.temperature_x(), x2, 1e-12);
      EXPECT_NEAR(cell.temperature_z(), z2, 1e-12);
      EXPECT_NEAR(cell.spin_temperature(), spin, 1e-12);
      EXPECT_NEAR(cell.square(), square, 1e-12);
      EXPECT_NEAR(cell.fourth(), quartic, 1e-11);
      EXPECT_NEAR(velocities.number_density(cell, true), n / (6 * 7 * 0.8), 1e-12);
      fourth += n * quartic, gaussian += 2 * n * square * square;
    }
  }
  EXPECT_NEAR(velocities.fourth_cumulant_local(), fourth / gaussian - 1, 1e-12);
  const VelocityMoments both = velocities.layer(1);
  EXPECT_EQ(both.count, static_cast<double>(cells[0][1].size() + cells[1][1].size()));
  EXPECT_NEAR(both.xxzz, velocities.cell(0, 1).xxzz + velocities.cell(1, 1).xxzz, 1e-12);
  EXPECT_NEAR(both.temperature_z() * both.count,
              velocities.cell(0, 1).vz2 + velocities.cell(1, 1).vz2 - both.mass * both.mean_vz() * both.mean_vz(),
              1e-11);
  EXPECT_NEAR(velocities.number_density(both, false), both.count / (12 * 7 * 0.8), 1e-12);
  EXPECT_DOUBLE_EQ(velocities.height(1), 0.7 + 1.2);
}

// <c^2> and <c^4> of each period about the mean v_z of each moment; a2 is a function of their means.
TEST(VelocitiesByHand, HaveTheFourthCumulantOfEachMoment) {
  const States all = states_at_random(9, 8, 9);
  VelocityObserver velocities(wide_box(7, true), all.disks, 2, {0, 1, 3}, false);
  std::vector<std::vector<double>> samples(8, std::vector<double>(2));
  for (std::size_t k = 0; k < all.looks.size(); ++k) {
    const Snapshot& at = all.looks[k];
    velocities.observe(at, static_cast<std::uint32_t>(k % 2));
    double mass = 0, momentum = 0;
    for (std::size_t i = 0; i < 9; ++i) mass += all.disks.mass[i], momentum += all.disks.mass[i] * at.vz[i];
    for (std::size_t i = 0; i < 9; ++i) {
      const double c2 = all.disks.mass[i] * (at.vx[i] * at.vx[i] + std::pow(at.vz[i] - momentum / mass, 2));
      samples[k / 2][0] += c2 / 18, samples[k / 2][1] += c2 * c2 / 18;
    }
  }
  expect_function_of_means(
      velocities.fourth_cumulant_of_all(), [](const std::vector<double>& m) { return m[1] / (2 * m[0] * m[0]) - 1; },
      samples, "a2");
}

// The unit is that of the first look, bins are 0.1 wide about multiples of it, and what is beyond lies in the last.
TEST(VelocitiesByHand, AreFiledInBinsOfATenth) {
  VelocityObserver velocities(wide_box(7, true), {{0.5, 0.5}, {1, 1}}, 1, {0, 1, 3}, false);
  EXPECT_EQ(velocities.histogram_x(0), 0) << "before the first look";
  EXPECT_EQ(velocities.histogram_z(0), 0);
  Snapshot at;
  at.x = {1, 2}, at.z = {1, 1}, at.vx = {2, -2}, at.vz = {2, -2};
  velocities.observe(at, 0);
  EXPECT_DOUBLE_EQ(velocities.histogram_unit(), 2);
  at.vx = {0.099, 0.101}, at.vz = {30, -30};  // 0.0495 and 0.0505 of the unit
  velocities.observe(at, 0);
  const auto filled = [&](double place) {
    for (int bin = 0; bin < VelocityObserver::histogram_bins; ++bin)
      if (std::abs(velocities.histogram_place(bin) - place) < 1e-9) return bin;
    return -1;
  };
  for (const double place : {-1.0, 0.0, 0.1, 1.0}) EXPECT_DOUBLE_EQ(velocities.histogram_x(filled(place)), 2.5);
  for (const double place : {-8.0, -1.0, 1.0, 8.0}) EXPECT_DOUBLE_EQ(velocities.histogram_z(filled(place)), 2.5);
}

// Steps at random in a box that is periodic both ways; over 2^k looks, origins as far apart.
TEST(DisplacementByHand, HasTheMeansAndErrorsOfItsLags) {
  Scene scene = wide_box(6, false);
  scene.box.top = PeriodicTop{5};
  Random random(12);
  DisplacementObserver displacement(scene, 2);
  std::vector<std::array<double, 4>> path{{1, 2, 3, 4}};  // x, z of the first; x, z of the second; followed
  const auto folded = [](double value, double period) { return value - period * std::floor(value / period); };
  for (int look = 0; look < 14; ++look) {
    Snapshot at;
    at.x = {folded(path.back()[0], 6), folded(path.back()[2], 6)};
    at.z = {folded(path.back()[1], 5), folded(path.back()[3], 5)};
    displacement.observe(at);
    std::array<double, 4> next = path.back();
    for (double& one : next) one += 3 * random.uniform() - 1;
    path.push_back(next);
  }
  const auto lags = displacement.lags();
  ASSERT_EQ(lags.size(), 4U);
  for (std::size_t level = 0; level < 4; ++level) {
    const std::size_t lag = std::size_t{1} << level;
    std::vector<double> x, z;
    for (std::size_t end = lag; end < 14; end += lag) {
      const auto square = [&](std::size_t q) { return std::pow(path[end][q] - path[end - lag][q], 2); };
      x.push_back((square(0) + square(2)) / 2), z.push_back((square(1) + square(3)) / 2);
    }
    EXPECT_EQ(lags[level].looks, lag);
    EXPECT_EQ(lags[level].origins, x.size());
    EXPECT_NEAR(lags[level].x.value, mean_of_values(x), 1e-12);
    EXPECT_NEAR(lags[level].z.value, mean_of_values(z), 1e-12);
    if (x.size() < 2) continue;
    EXPECT_NEAR(lags[level].x.std_error, textbook_error(x), 1e-12);
    EXPECT_NEAR(lags[level].z.std_error, textbook_error(z), 1e-12);
  }
}

// Half of <m v_x^2> and of m times the variance of v_z, of each species at each moment.
TEST(SpeciesByHand, HaveTheErrorOfTheirRatio) {
  const States all = states_at_random(9, 6, 13);
  Scene scene = wide_box(7, true);
  scene.disks.species = {{6, 1, 1.6}, {3, 0.8, 0.7}};
  SpeciesObserver observer(scene, all.disks, 2, {0, 1, 3});
  std::vector<std::vector<double>> samples(6, std::vector<double>(2));
  for (std::size_t k = 0; k < all.looks.size(); ++k) {
    const Snapshot& at = all.looks[k];
    observer.observe(at);
    for (std::size_t s = 0; s < 2; ++s) {
      double n = 0, vx2 = 0, vz = 0, vz2 = 0;
      const double m = s == 0 ? 1.6 : 0.7;
      for (std::size_t i = 0; i < 9; ++i)
        if ((i % 3 == 0) == (s == 1)) n += 1, vx2 += at.vx[i] * at.vx[i], vz += at.vz[i], vz2 += at.vz[i] * at.vz[i];
      samples[k / 2][s] += m * (vx2 / n + (vz2 - vz * vz / n) / (n - 1)) / 4;
    }
  }
  for (std::size_t s = 0; s < 2; ++s) {
    expect_function_of_means(
        observer.temperature(s), [s](const std::vector<double>& m) { return m[s]; }, samples, "T");
  }
  expect_function_of_means(
      observer.temperature_ratio(), [](const std::vector<double>& m) { return m[1] / m[0]; }, samples, "ratio");
}

// ---------------------------------------------------------------------------------------------------------------------
// order

TEST(OrderByHand, OfNoDisksIsEmpty) {
  const BondOrder order = bond_order({}, {}, 5, 0);
  EXPECT_TRUE(order.neighbours.empty() && order.psi6_re.empty() && order.vacancy_x.empty());
}

// Neighbours and psi_6 of every disk by asking all others and all their images.
TEST(OrderByHand, IsThatOfAllPairs) {
  for (const auto& [width, height] : {std::array{3.9, 0.0}, {8.3, 6.1}, {0.0, 0.0}, {4.4, 11.0}}) {
    Random random(21);
    Snapshot at;
    DiskProperties disks;
    const double wide = width > 0 ? width : 9, high = height > 0 ? height : 7;
    for (int i = 0; i < 45; ++i) {
      at.x.push_back(wide * random.uniform()), at.z.push_back(high * random.uniform());
      disks.radius.push_back(i % 2 == 0 ? 0.5 : 0.3), disks.mass.push_back(1);
    }
    const BondOrder order = bond_order(at, disks, width, height);
    for (std::size_t i = 0; i < 45; ++i) {
      std::complex<double> sum;
      int neighbours = 0;
      for (std::size_t k = 0; k < 45; ++k) {
        double dx = at.x[k] - at.x[i], dz = at.z[k] - at.z[i];
        if (width > 0) dx = std::remainder(dx, width);
        if (height > 0) dz = std::remainder(dz, height);
        const double reach = (1 + std::numbers::sqrt3) / 2 * (disks.radius[i] + disks.radius[k]);
        if (k == i || std::hypot(dx, dz) >= reach) continue;
        ++neighbours;
        sum += std::polar(1.0, 6 * std::atan2(dz, dx));
      }
      EXPECT_EQ(order.neighbours[i], neighbours) << width << " " << i;
      if (neighbours > 0) sum /= neighbours;
      EXPECT_NEAR(order.psi6_re[i], sum.real(), 1e-9) << width << " " << i;
      EXPECT_NEAR(order.psi6_im[i], sum.imag(), 1e-9) << width << " " << i;
    }
  }
}

// What the observer makes of them: means over disks and periods, and layers.
TEST(OrderByHand, IsAveragedOverDisksAndLooks) {
  const States all = states_at_random(14, 5, 22);
  OrderObserver observer(wide_box(7, true), all.disks, 2, {0.6, 0.9, 2});
  std::array<std::array<double, 3>, 2> layers{};  // disks, |psi|, neighbours
  std::array<std::vector<double>, 3> means;
  for (auto& one : means) one.resize(5);
  for (std::size_t k = 0; k < all.looks.size(); ++k) {
    const Snapshot& at = all.looks[k];
    observer.observe(at);
    const BondOrder order = bond_order(at, all.disks, 7, 0);
    std::complex<double> sum;
    for (std::size_t i = 0; i < 14; ++i) {
      const std::complex<double> psi(order.psi6_re[i], order.psi6_im[i]);
      sum += psi;
      means[0][k / 2] += std::abs(psi) / 28, means[2][k / 2] += order.neighbours[i] / 28.0;
      auto& layer = layers[at.z[i] < 1.5 ? 0 : 1];
      layer[0] += 1, layer[1] += std::abs(psi), layer[2] += order.neighbours[i];
    }
    means[1][k / 2] += std::abs(sum) / 28;
  }
  expect_mean(observer.psi6_local(), means[0], "local");
  expect_mean(observer.psi6_global(), means[1], "global");
  expect_mean(observer.neighbours_per_disk(), means[2], "neighbours");
  const auto found = observer.layers();
  ASSERT_EQ(found.size(), 2U);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_NEAR(found[k].height, 0.6 + 0.9 * (static_cast<double>(k) + 0.5), 1e-12);
    EXPECT_NEAR(found[k].psi6_local, layers[k][1] / layers[k][0], 1e-12);
    EXPECT_NEAR(found[k].neighbours, layers[k][2] / layers[k][0], 1e-12);
    EXPECT_NEAR(found[k].share, layers[k][0] / 140, 1e-12);
  }
}

// A crystal with one site empty across the periodic corner has it once, wherever the corner is.
TEST(OrderByHand, HasAnEmptySiteOnceAcrossTheSides) {
  for (const double diameter : {1.0, 0.8, 1.5})
    for (const double shift : {0.0, 0.4, 0.9}) {
      Snapshot at;
      DiskProperties disks;
      const double apart = 1.02 * diameter, row = apart * std::numbers::sqrt3 / 2, width = 8 * apart, height = 8 * row;
      for (int k = 1; k < 64; ++k) {
        const double x = (k % 8 + 0.5 * (k / 8 % 2)) * apart - shift, z = (k / 8) * row - shift;
        at.x.push_back(x - width * std::floor(x / width)), at.z.push_back(z - height * std::floor(z / height));
        disks.radius.push_back(0.5 * diameter), disks.mass.push_back(1);
      }
      const BondOrder order = bond_order(at, disks, width, height);
      ASSERT_EQ(order.vacancy_x.size(), 1U) << diameter << " " << shift;
      EXPECT_NEAR(std::remainder(order.vacancy_x[0] + shift, width), 0, 1e-9);
      EXPECT_NEAR(std::remainder(order.vacancy_z[0] + shift, height), 0, 1e-9);
    }
}

}  // namespace
}  // namespace shakebed::sim::by_hand
