// A bed in equilibrium under gravity: the pressure carries the weight above, and where the bed is fluid its profile is
// the one that Enskog's equation of state gives at its T.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/measure/flights.hpp"
#include "tests/physics/law.hpp"

namespace shakebed::sim::hydrostatics_law {
namespace {

using tests::expect_law;

// T_c = mu phi_0/mu_0 in m g D, at phi_0 = 2/sqrt 3: N D/W over 111.311.
constexpr double mu_0 = 111.311296763;

Scene bed(std::uint32_t count, double width, double temperature) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{count, 1, 1}};
  scene.box.width = width;
  scene.box.sides = PeriodicSides{};
  scene.start_temperature = temperature;
  return scene;
}

// Rows of sqrt(3)/2 D from the floor up, dilute gas to crystal, up to where a row holds 1 % of a packed one. The beds
// are left to themselves: what P_zz is more than the weight above changes the momentum above, so its mean falls as
// 1/time and is below 0.1 % here.
void expect_weight_carried(std::initializer_list<double> temperatures) {
  const std::uint32_t count = 300;
  const double width = 20, critical = count / width / mu_0, row = std::sqrt(0.75);
  for (const double start : temperatures) {
    const Scene scene = bed(count, width, start);
    const auto simulation = simulate(scene);
    const double settle = 100, length = 5;
    const int blocks = 160;
    simulation->advance_to(settle);
    FlightObserver flights(scene, simulation->properties(), {0, row, 400});
    simulation->watch(&flights);
    flights.begin(settle);
    CorrelatedMeans temperature;
    for (int k = 1; k <= blocks; ++k) {
      simulation->advance_to(settle + length * k);
      flights.end_block(settle + length * k);
      temperature.add(simulation->energy().kinetic / count);
    }
    double worst = 0, squares = 0, worst_height = 0, least = 10, most = 0;
    int rows = 0;
    for (const FlightObserver::Layer& layer : flights.layers()) {
      if (layer.number_density.value < 0.01 * 1.1547) continue;
      ++rows;
      least = std::min(least, layer.number_density.value);
      most = std::max(most, layer.number_density.value);
      const double ratio = layer.pressure_zz.value / layer.weight_above.value - 1;
      squares += ratio * ratio;
      if (std::abs(ratio) > std::abs(worst)) {
        worst = ratio;
        worst_height = layer.height;
      }
    }
    std::printf("  T = %.2f T_c, %d rows of n D^2 from %.3f to %.3f: worst at %.2f D\n", temperature.mean() / critical,
                rows, least, most, worst_height);
    expect_law("P_zz over weight above, worst row (+- rms of all)", 1 + worst, std::sqrt(squares / rows), 1, 0.01);
    const Measured floor = flights.floor_pressure();
    expect_law("force on the floor over the bed's weight", floor.value * width / count, floor.std_error * width / count,
               1, 0.01);
    EXPECT_GT(rows, 10);
  }
}
TEST(Hydrostatics, PressureCarriesTheWeightAboveInEveryRow) { expect_weight_carried({4.0}); }
TEST(Hydrostatics, PressureCarriesTheWeightAboveInEveryRowColdOrHot) { expect_weight_carried({0.05, 0.4, 15.0}); }

// f(phi), df = d(phi Z)/phi with Ree and Hoover's pair function: -z/T but for a constant, by hydrostatics.
double enskog_f(double phi) {
  constexpr double a = 0.7686707533, c1 = 0.0855243719, c2 = -0.7101662999, c4 = 1.2777253094;
  const double free = 1 - a * phi;
  return std::log(phi) + c1 * phi + c2 * std::log(free) - c2 / free + c4 / (free * free);
}
double enskog_slope(double phi) { return (enskog_f(phi + 1e-6) - enskog_f(phi - 1e-6)) / 2e-6; }
double density_at(double f) {
  double low = 1e-6, high = 1.15;
  for (int k = 0; k < 60; ++k) (enskog_f((low + high) / 2) < f ? low : high) = (low + high) / 2;
  return (low + high) / 2;
}

// mu = 20: N D/W = 20 x 2/sqrt 3. Layers of 2 D, twice the distance of the rows that the floor brings about, so that
// their oscillation averages out; from `from` up to where phi falls below 0.02. Enskog's profile is averaged over the
// layers in the same way. The line is the plain one of least squares through f(phi(z)); its error is the spread of 8
// runs. A line that weighs each layer by 1/f'(phi), the inverse of f's variance in equilibrium, is shown beside it.
void expect_enskog_profile(double reduced, double from, double length) {
  const std::uint32_t count = 924;
  const double width = count / (20 * 2 / std::sqrt(3.0)), t = reduced * count / width / mu_0;
  constexpr int runs = 8;
  constexpr std::size_t layers = 200;
  constexpr double depth = 2;
  const double lowest = std::fmod(from, depth);
  const auto middle = [&](std::size_t k) { return lowest + (static_cast<double>(k) + 0.5) * depth; };
  std::vector<CorrelatedMeans> density(layers);
  CorrelatedMeans ratio, weighted_ratio, true_t;
  // Mean over the layer of exp-like profiles, over their value in the middle.
  const auto layer_mean = [&](double constant, double height) {
    const auto at = [&](double z) { return density_at(constant - z / t); };
    return (at(height - depth / 2) + 4 * at(height) + at(height + depth / 2)) / 6;
  };
  const auto fluid = [&](double height, double phi) { return height - depth / 2 >= from && phi >= 0.02; };
  const auto constant_of = [&](const auto& phi_of) {
    double sum = 0, f1 = 0;
    for (std::size_t k = 0; k < layers; ++k) {
      const double height = middle(k), phi = phi_of(k);
      if (fluid(height, phi)) sum += phi, f1 += phi * (enskog_f(phi) + height / t);
    }
    return f1 / sum;
  };
  for (int run = 0; run < runs; ++run) {
    Scene scene = bed(count, width, t);
    scene.bath = LangevinBath{t, 0.5, 0.5};
    scene.seed = static_cast<std::uint64_t>(run) + 60;
    const auto simulation = simulate(scene);
    const double settle = 200;
    simulation->advance_to(settle);
    FlightObserver flights(scene, simulation->properties(), {lowest, depth, layers});
    simulation->watch(&flights);
    flights.begin(settle);
    constexpr int looks = 400;
    double kinetic = 0;
    for (int look = 1; look <= looks; ++look) {
      simulation->advance_to(settle + length * look / looks);
      kinetic += simulation->energy().kinetic / looks;
    }
    flights.end_block(settle + length);
    true_t.add(kinetic / count);
    std::vector<double> phi(layers, 0.0);
    for (const auto& layer : flights.layers())
      phi[static_cast<std::size_t>((layer.height - lowest) / depth)] = layer.number_density.value;
    for (std::size_t k = 0; k < layers; ++k) density[k].add(phi[k]);
    const double constant = constant_of([&](std::size_t k) { return phi[k]; });
    const auto temperature_by = [&](auto&& weight) {
      double sum = 0, z1 = 0, f1 = 0, zz = 0, zf = 0;
      for (std::size_t k = 0; k < layers; ++k) {
        const double z = middle(k);
        if (!fluid(z, phi[k])) continue;
        const double w = weight(phi[k]);
        const double f = enskog_f(phi[k] * density_at(constant - z / t) / layer_mean(constant, z));
        sum += w, z1 += w * z, f1 += w * f, zz += w * z * z, zf += w * z * f;
      }
      return -(zz - z1 * z1 / sum) / (zf - z1 * f1 / sum);
    };
    ratio.add(temperature_by([](double) { return 1.0; }) / t);
    weighted_ratio.add(temperature_by([](double phi_k) { return 1 / enskog_slope(phi_k); }) / t);
  }
  char name[120];
  std::snprintf(name, sizeof name, "T = %.0f T_c: kinetic T over the bath's", reduced);
  expect_law(name, true_t.mean() / t, true_t.std_error() / t, 1, 3e-3);
  std::snprintf(name, sizeof name, "T = %.0f T_c: T from the slope of f(phi) over true T", reduced);
  expect_law(name, ratio.mean(), ratio.std_error(), 1, 3e-3);
  EXPECT_LT(2 * ratio.std_error(), 3e-3);
  std::printf("  the same, layers weighted by 1/f'(phi): %.6g +- %.2g\n", weighted_ratio.mean(),
              weighted_ratio.std_error());
  // Enskog's profile at the true T, its one constant fitted.
  const double constant = constant_of([&](std::size_t k) { return density[k].mean(); });
  double worst = 0, worst_error = 0;
  std::printf("  %8s %8s %8s %16s\n", "height", "phi", "error", "over Enskog's");
  for (std::size_t k = 0; k < layers; ++k) {
    const double height = middle(k), phi = density[k].mean();
    if (phi < 0.02) continue;
    const double over = phi / layer_mean(constant, height), error = density[k].std_error() / phi;
    std::printf("  %8.1f %8.4f %8.4f %16.4f%s\n", height, phi, density[k].std_error(), over,
                fluid(height, phi) ? "" : "  (shown)");
    if (!fluid(height, phi)) continue;
    EXPECT_LT(1.5 * error, 0.01);
    if (std::abs(over - 1) > std::abs(worst)) worst = over - 1, worst_error = error;
  }
  expect_law("phi over Enskog's, worst layer", 1 + worst, worst_error, 1, 0.01);
}

TEST(Hydrostatics, FluidBedHasEnskogsProfileAt15CriticalTemperatures) { expect_enskog_profile(15, 8, 16000); }
TEST(Hydrostatics, FluidBedHasEnskogsProfileAt40CriticalTemperatures) { expect_enskog_profile(40, 5, 16000); }

}  // namespace
}  // namespace shakebed::sim::hydrostatics_law
