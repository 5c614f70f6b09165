// One disk on a sinusoidal floor: where the mode of period 1 begins and ends, rest and chatter.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "tests/physics/law.hpp"

namespace shakebed::sim::bouncing_ball_law {
namespace {

using tests::expect_law;

constexpr double period = 1.0, pi = std::numbers::pi;
constexpr double amplitude_of_gamma_1 = 1 / (4 * pi * pi);  // g T^2 / (4 pi^2)

Scene ball(double gamma, double restitution, double z, double vz) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{1, 1, 1}};
  scene.box.width = 4;
  scene.box.sides = HardSides{};
  scene.box.floor = SinusoidalFloor{gamma * amplitude_of_gamma_1, 1 / period};
  scene.box.floor_surface = {restitution, 0, 0};
  scene.start = PlacedStart{{{2, z, 0, vz, 0, 0}}};
  return scene;
}

// The orbit that hits once every n periods leaves the floor at phase p, (1-e)/(1+e) n pi = Gamma cos p, with g n T/2.
Scene on_the_orbit(double gamma, double restitution, int n, double off) {
  const double least = n * pi * (1 - restitution) / (1 + restitution);
  const double phase = std::acos(std::min(least / gamma, 1.0));
  const double up = n * period / 2, left = phase / (2 * pi) * period;
  // Flown on to the end of the floor's first period, where the engine's time begins.
  const double dt = period - left, a = gamma * amplitude_of_gamma_1;
  return ball(gamma, restitution, 0.5 + a * std::sin(phase) + (up - dt / 2) * dt + off, up - dt);
}

struct Moment {
  double z, vz;
};
std::vector<Moment> strobed(Simulation& simulation, int from, int count) {
  std::vector<Moment> moments;
  Snapshot at;
  for (int k = 0; k < count; ++k) {
    simulation.advance_to((from + k) * period);
    simulation.snapshot(at);
    moments.push_back({at.z[0], at.vz[0]});
  }
  return moments;
}

// How far the motion is from repeating itself every n periods, after `settling` periods.
double unrest(Simulation& simulation, int n, int settling) {
  const std::vector<Moment> moments = strobed(simulation, settling, 8 * n + 1);
  double worst = 0;
  for (std::size_t k = 0; k + static_cast<std::size_t>(n) < moments.size(); ++k) {
    const Moment &first = moments[k], &later = moments[k + static_cast<std::size_t>(n)];
    worst = std::max({worst, std::abs(first.z - later.z), std::abs(first.vz - later.vz)});
  }
  return worst;
}

// Does the mode hold: as many floor collisions as it has, and the same again every n periods?
bool holds(double gamma, double restitution, int n, int settling) {
  const auto simulation = simulate(on_the_orbit(gamma, restitution, n, 1e-7));
  for (int k = 100; k <= settling; k += 100) {
    simulation->advance_to(k * period);
    if (simulation->counters().floor_collisions > 10 + static_cast<std::uint64_t>(2 * k)) return false;  // it chatters
  }
  const std::uint64_t before = simulation->counters().floor_collisions;
  const double restless = unrest(*simulation, n, settling);
  const std::uint64_t hits = simulation->counters().floor_collisions - before;
  return restless < 1e-5 && hits == 8;
}

// The edge lies within a thousandth of what is expected: just inside the mode holds, just outside it does not.
void expect_edge(double expected, double inwards, double restitution, int n) {
  const double off = std::copysign(1e-3, inwards);
  EXPECT_TRUE(holds(expected + off, restitution, n, 10'000)) << "e = " << restitution << " n = " << n;
  EXPECT_FALSE(holds(expected - off, restitution, n, 10'000)) << "e = " << restitution << " n = " << n;
}

TEST(BouncingBall, HasTheWindowOfThePeriodOneMode) {
  const struct {
    double restitution;
    int n;
  } cases[] = {{0.3, 1}, {0.5, 1}, {0.8, 1}, {0.8, 2}};
  for (const auto& c : cases) {
    const double e = c.restitution, least = c.n * pi * (1 - e) / (1 + e);
    const double most = std::hypot(least, 2 * (1 + e * e) / ((1 + e) * (1 + e)));
    const double inside = 0.5 * (least + most);
    ASSERT_TRUE(holds(inside, e, c.n, 2000)) << "e = " << e << " n = " << c.n;
    expect_edge(least, inside - least, e, c.n);
    expect_edge(most, inside - most, e, c.n);
  }
}

// A plastic ball leaves the floor where this falls as fast as it. Above Gamma = sqrt(1 + pi^2) it lands so late that it
// leaves at once, one period after another at the phase where Gamma cos p = pi, up to sqrt(4 + pi^2); beyond, its
// flights are longer and shorter by turns. Near the edge a disturbance fades by a thousandth a period only.
TEST(BouncingBall, PlasticModeDoublesAtItsEdge) {
  const auto repeats = [](double gamma) {
    Scene scene = ball(gamma, 0, 0.5, 0);
    scene.disks.contact_duration = 1e-6;
    const auto simulation = simulate(scene);
    return unrest(*simulation, 1, 20'000) < 1e-5;
  };
  const double expected = std::sqrt(4 + pi * pi);
  EXPECT_TRUE(repeats(expected - 1e-3));
  EXPECT_FALSE(repeats(expected + 1e-3));
}

TEST(BouncingBall, StaysOnAFloorThatNeverFallsFasterThanIt) {
  for (double e : {0.0, 0.5, 0.9}) {
    Scene scene = ball(0.9, e, 0.8, 0);
    scene.disks.contact_duration = 1e-4;
    const auto simulation = simulate(scene);
    simulation->advance_to(100);
    double highest = 0, lowest = 0;
    Snapshot at;
    for (int k = 1; k <= 1000; ++k) {
      simulation->advance_to(100 + 0.01237 * k);
      simulation->snapshot(at);
      highest = std::max(highest, at.z[0] - 0.5 - at.floor_position);
      lowest = std::min(lowest, at.z[0] - 0.5 - at.floor_position);
    }
    expect_law("Gamma = 0.9: highest above the floor at rest [D]", highest, 0, 0, 1e-7);
    expect_law("Gamma = 0.9: deepest below the floor [D]", -lowest, 0, 0, 1e-12);
  }
}

// Dropped on a still floor with e = 0.5 a disk has hit it infinitely often at (1+e)/(1-e) of the first fall's time.
TEST(BouncingBall, EndsItsChatter) {
  for (double e : {0.2, 0.5, 0.8}) {
    Scene scene = ball(1, e, 1.5, 0);
    scene.box.floor = StillFloor{};
    const auto simulation = simulate(scene);
    const double end = std::sqrt(2.0) * (1 + e) / (1 - e);
    Snapshot at;
    double rest = 0;
    for (double t = 0; t < 2 * end; t += 1e-3) {
      simulation->advance_to(t);
      simulation->snapshot(at);
      if (at.z[0] - 0.5 > 1e-6) rest = t;
    }
    expect_law("chatter on a still floor ends at [sqrt(D/g)]", rest, 1e-3, end, 0.01 * end);
    simulation->advance_to(2 * end);
    const std::uint64_t before = simulation->counters().events();
    simulation->advance_to(2 * end + 10);
    std::printf("  events in 10 sqrt(D/g) at rest: %llu\n",
                static_cast<unsigned long long>(simulation->counters().events() - before));
    // A hop of 1e-4, ever shorter ones until one is 1e-3 of it, 1e-4/(1-e) in all.
    const double most = 10 / 1e-4 * (1 - e) * std::ceil(std::log(1e-3) / std::log(e));
    EXPECT_LE(static_cast<double>(simulation->counters().events() - before), 1.01 * most);
  }
}

}  // namespace
}  // namespace shakebed::sim::bouncing_ball_law
