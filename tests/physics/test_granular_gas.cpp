// Dilute disks without gravity: how often they collide, how they cool, what white noise heats them to, and how far
// their velocities are from Maxwell's. Systems are smaller than the wavelength at which they would cluster:
// 2 pi sqrt(2/pi) l/sqrt(g0), l the mean free path, g0 = (1 - e^2)/4 [vanNoijeErnst1998]; at area fraction 0.05 and
// e = 0.6 that is 260 disks.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "sim/engine/random.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/measure/statistics.hpp"
#include "tests/physics/law.hpp"

namespace shakebed::sim::granular_gas_law {
namespace {

using std::numbers::pi;
using tests::expect_law;

// rows x rows disks in a periodic box, T = 1.
Scene gas(std::uint32_t rows, double area_fraction, double restitution, std::uint64_t seed) {
  Scene scene;
  scene.gravity = Weightless{};
  scene.disks.species = {{rows * rows, 1, 1}};
  scene.disks.contact = {restitution, 0, 0};
  const double side = std::sqrt(pi / 4 / area_fraction * 2 / std::sqrt(3.0));
  scene.box.width = rows * side;
  scene.box.sides = PeriodicSides{};
  scene.box.top = PeriodicTop{rows * side * std::sqrt(3.0) / 2};
  scene.seed = seed;
  return scene;
}

// Enskog's pair function at contact, Ree and Hoover's in two dimensions.
double contact_value(double area_fraction) {
  const double phi = 4 * area_fraction / pi;
  return (1 - 0.3089803499 * phi + 0.01608498777 * phi * phi) / std::pow(1 - 0.7686707533 * phi, 2);
}
// Collisions a disk and unit of time at T = 1. Each disk has N - 1 others in the box, not N.
double collision_frequency(double area_fraction, double count) {
  return 8 * area_fraction * contact_value(area_fraction) / std::sqrt(pi) * (1 - 1 / count);
}

// Of van Noije and Ernst's a2 = 16 (1-e)(1-2e^2)/(9+24d+(8d-41)e+30e^2(1-e)), cooling, and .../(73+56d-(24d+105)e+
// 30e^2(1-e)), heated, in d = 2.
double cooling_a2(double e) { return 16 * (1 - e) * (1 - 2 * e * e) / (57 - 25 * e + 30 * e * e * (1 - e)); }
double heated_a2(double e) { return 16 * (1 - e) * (1 - 2 * e * e) / (185 - 153 * e + 30 * e * e * (1 - e)); }

// Of one moment. N disks whose total momentum is 0 and whose energy is what it is lie on a sphere of 2 (N - 1)
// dimensions: were they Maxwellian, <v^4> would be 2 <v^2>^2 (N - 1)/N. That is taken into account.
double fourth_cumulant_now(const Snapshot& at) {
  double square = 0, fourth = 0;
  const auto n = static_cast<double>(at.vx.size());
  for (std::size_t i = 0; i < at.vx.size(); ++i) {
    const double v2 = at.vx[i] * at.vx[i] + at.vz[i] * at.vz[i];
    square += v2 / n;
    fourth += v2 * v2 / n;
  }
  return fourth / (2 * square * square) * n / (n - 1) - 1;
}

// Within 3 standard errors (two-sided significance 0.27 % each) or 0.1 %.
TEST(ElasticGas, CollidesAsOftenAsEnskogSays) {
  for (const double area_fraction : {0.05, 0.2}) {
    const auto simulation = simulate(gas(32, area_fraction, 1, 51));
    const double count = 1024, per_time = collision_frequency(area_fraction, count), step = 20 / per_time;
    simulation->advance_to(step);
    CorrelatedMeans rate;
    double before = static_cast<double>(simulation->counters().disk_collisions);
    const double temperature = simulation->energy().kinetic / (count - 1);
    for (int k = 0; k < 64; ++k) {
      simulation->advance_to(simulation->time() + step);
      const double now = static_cast<double>(simulation->counters().disk_collisions);
      rate.add(2 * (now - before) / count / step / std::sqrt(temperature));
      before = now;
    }
    char name[80];
    std::snprintf(name, sizeof name, "area fraction %.2f: collisions a disk and unit of time", area_fraction);
    expect_law(name, rate.mean(), rate.std_error(), per_time, std::max(3 * rate.std_error(), 1e-3 * per_time));
    EXPECT_LT(rate.std_error(), 2e-3 * per_time);
  }
}

// a2 of a cooling gas by Boltzmann's equation itself, solved by Monte Carlo [Bird1994] without space: pairs drawn at
// random collide with a probability as their approach. From 6 to 16 collisions of each, as below. 24 gases of 1e5:
// 0.0328(4), -0.0262(4), -0.0299(2) at e = 0.6, 0.8, 0.9, where van Noije and Ernst's expansion, which ends at a2
// itself [BrilliantovPoeschel2006], has 0.0387, -0.0219, -0.0269: the a3 that it leaves out is no smaller, -0.0133(2),
// -0.0118(1), -0.0104(1) by the same Monte Carlo. A gas of 256 has 0.0314(7) at 0.6: its size does nothing.
Measured boltzmann_a2(double e, int gases) {
  constexpr std::uint32_t count = 100'000;
  CorrelatedMeans a2;
  for (int gas = 0; gas < gases; ++gas) {
    Random random(static_cast<std::uint64_t>(gas) + 5);
    std::vector<double> vx(count), vz(count);
    for (std::uint32_t i = 0; i < count; ++i) {
      const Random::Pair v = random.normal_pair();
      vx[i] = v.first, vz[i] = v.second;
    }
    double collided = 0, square = count * 2.0, fastest = 8, sum = 0;
    int samples = 0;
    for (double next = 6; next < 16;) {
      const std::uint32_t i = random.below(count), j = random.below(count);
      if (i == j) continue;
      const double angle = 2 * pi * random.uniform(), nx = std::cos(angle), nz = std::sin(angle);
      const double approach = (vx[i] - vx[j]) * nx + (vz[i] - vz[j]) * nz;
      if (approach < fastest * random.uniform()) continue;
      const double kick = (1 + e) / 2 * approach;
      vx[i] -= kick * nx, vz[i] -= kick * nz, vx[j] += kick * nx, vz[j] += kick * nz;
      square -= (1 - e * e) / 2 * approach * approach;
      collided += 2.0 / count;
      fastest = 8 * std::sqrt(square / 2 / count);  // one pair in 1e7 approaches faster than 8 thermal velocities
      if (collided < next + 1) continue;
      next += 1;
      double v2 = 0, v4 = 0;
      for (std::uint32_t k = 0; k < count; ++k) {
        const double here = vx[k] * vx[k] + vz[k] * vz[k];
        v2 += here / count, v4 += here * here / count;
      }
      sum += v4 / (2 * v2 * v2) - 1;
      ++samples;
    }
    a2.add(sum / samples);
  }
  return {a2.mean(), a2.std_error()};
}

// 1/sqrt(T) grows as (1 - e^2)/4 w (1 + 3 a2/16) t, w the collision frequency at T = 1: from when each disk has
// collided 6 times (and a2 is what it becomes) until 16. 0.5 % of this rate is 1 % of T. The energy lost by N disks is
// lost by N - 1 free momenta, which T is counted by. A disk collides as (1 - a2/16) w, so that T falls by (1 + a2/4)
// (1 - e^2)/2 a collision.
void expect_haff(double e, double area_fraction, std::uint32_t rows, int runs, int boltzmann_gases) {
  const double count = rows * rows, free_momenta = (count - 1) / count;
  const double loss = (1 - e * e) / 4, w = collision_frequency(area_fraction, count);
  CorrelatedMeans rate, a2, per_collision;
  Snapshot at;
  for (int run = 1; run <= runs; ++run) {
    const auto simulation = simulate(gas(rows, area_fraction, e, 1000 + static_cast<std::uint64_t>(run)));
    const auto temperature = [&] { return simulation->energy().kinetic / (count - 1); };
    const auto collided = [&] { return 2 * static_cast<double>(simulation->counters().disk_collisions) / count; };
    // T is 1/(1 + loss w t)^2, so that a disk has collided ln(1 + loss w t)/loss times.
    const auto moment = [&](double collisions) { return std::expm1(loss * collisions) / (loss * w); };
    simulation->advance_to(moment(6));
    const double first = temperature(), first_collided = collided(), first_time = simulation->time();
    double cumulant = 0;
    for (int k = 1; k <= 10; ++k) {
      simulation->advance_to(moment(6 + k));
      simulation->snapshot(at);
      cumulant += fourth_cumulant_now(at) / 10;
    }
    const double last = temperature();
    a2.add(cumulant);
    rate.add((1 / std::sqrt(last) - 1 / std::sqrt(first)) / (simulation->time() - first_time));
    per_collision.add(std::log(last / first) / (collided() - first_collided));
  }
  const double expected = loss * w / free_momenta * (1 + 3 * cooling_a2(e) / 16);
  const double expected_fall = -2 * loss / free_momenta * (1 + cooling_a2(e) / 4);
  std::printf("  e = %.1f, area fraction %.4g, %.0f disks, %d runs\n", e, area_fraction, count, runs);
  expect_law("cooling: growth of 1/sqrt(T)", rate.mean(), rate.std_error(), expected, 5e-3 * expected);
  EXPECT_LT(2 * rate.std_error(), 5e-3 * expected);
  expect_law("cooling: d ln T a collision of each disk", per_collision.mean(), per_collision.std_error(), expected_fall,
             0.01 * std::abs(expected_fall));
  const Measured boltzmann = boltzmann_a2(e, boltzmann_gases);
  expect_law("cooling: a2, by Boltzmann's equation", a2.mean(), std::hypot(a2.std_error(), boltzmann.std_error),
             boltzmann.value, 5e-3);
  // The formula ends its expansion at a2, which at e = 0.6 costs it 0.006, more than is asked: there it is shown.
  if (e > 0.7) {
    expect_law("cooling: a2, by van Noije and Ernst", a2.mean(), a2.std_error(), cooling_a2(e), 5e-3);
  } else {
    std::printf("  %-58s %.6g, off Boltzmann's by %.2g\n", "(a2 by van Noije and Ernst)", cooling_a2(e),
                cooling_a2(e) - boltzmann.value);
  }
  EXPECT_LT(2 * a2.std_error(), 5e-3);
}

// T = [H/((1-e^2) sqrt(pi) n chi (1 + 3 a2/16))]^(2/3), with net momentum removed. Between kicks T sinks: it is taken
// in the middle between two.
void expect_heated(double e, double area_fraction, std::uint32_t rows, int looks) {
  const double count = rows * rows;
  const double w = collision_frequency(area_fraction, count), interval = 0.1 / w;
  // Heating that gives T = 1: what is lost at T = 1, of N - 1 free momenta.
  const double heating = 2 * (1 - e * e) / 4 * w * (1 + 3 * heated_a2(e) / 16);
  Scene scene = gas(rows, area_fraction, e, 77);
  scene.bath = WhiteNoiseBath{heating * count / (count - 1), interval, true};
  const auto simulation = simulate(scene);
  CorrelatedMeans temperature, a2;
  Snapshot at;
  const int settle = 200;
  for (int k = 0; k < settle + looks; ++k) {
    simulation->advance_to((4 * k + 0.5) * interval);
    if (k < settle) continue;
    temperature.add(simulation->energy().kinetic / (count - 1));
    simulation->snapshot(at);
    a2.add(fourth_cumulant_now(at));
  }
  std::printf("  e = %.1f, area fraction %.4g, %.0f disks, %d looks\n", e, area_fraction, count, looks);
  expect_law("white noise: T", temperature.mean(), temperature.std_error(), 1, 0.01);
  EXPECT_LT(2 * temperature.std_error(), 0.01);
  expect_law("white noise: a2", a2.mean(), a2.std_error(), heated_a2(e), 5e-3);
  EXPECT_LT(2 * a2.std_error(), 5e-3);
}

TEST(CoolingGas, CoolsAsHaffSaysWithTheFourthCumulantOfVanNoijeAndErnst) { expect_haff(0.9, 0.02, 12, 1200, 2); }
TEST(HeatedGas, HasTheTemperatureAndTheFourthCumulantOfVanNoijeAndErnst) { expect_heated(0.9, 0.02, 14, 36000); }

// Below the size at which disks cluster, whirls still fade more slowly than the heat and hold energy back, the more so
// the more free paths fit into the box: at e = 0.6 cooling is 1.2 % slow at area fraction 0.02 with 196 disks. So the
// box is a third of that there.
TEST(CoolingGas, CoolsAsHaffSaysAtRestitution06) { expect_haff(0.6, 0.0015, 16, 1000, 5); }
TEST(CoolingGas, CoolsAsHaffSaysAtRestitution08) { expect_haff(0.8, 0.02, 14, 4000, 5); }
TEST(CoolingGas, CoolsAsHaffSaysAtRestitution09) { expect_haff(0.9, 0.02, 14, 2000, 5); }
TEST(HeatedGas, HasItsTemperatureForEveryRestitution) {
  for (const double e : {0.6, 0.8, 0.9}) expect_heated(e, 0.01, 18, 9000);
}

}  // namespace
}  // namespace shakebed::sim::granular_gas_law
