// Temperatures of two species: of states made by hand, and their errors.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sim/measure/species.hpp"

namespace shakebed::sim {
namespace {

Scene two_species(std::uint32_t first, std::uint32_t second) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{first, 1, 1}, {second, 1, 3}};
  scene.box.width = 10;
  return scene;
}

TEST(Species, AreKnownApartByDiameterOrMass) {
  Scene scene = two_species(1, 1);
  EXPECT_TRUE(has_two_species(scene));
  scene.disks.species[1] = {1, 0.5, 1};
  EXPECT_TRUE(has_two_species(scene));
  scene.disks.species[1] = {1, 1, 1};
  EXPECT_FALSE(has_two_species(scene));
  scene.disks.species.pop_back();
  EXPECT_FALSE(has_two_species(scene));
}

// Light disks (mass 1) with v_x = 1, -1, v_z = 4, 6; heavy ones (mass 3) with v_x = 2, -2, v_z = 0, 2; order mixed.
// Light: <m v_x^2> = 1, variance of v_z about 5 with one free velocity 2: T = 1.5. Heavy: 12 and 3 x 2: T = 9.
TEST(SpeciesTemperatures, AreThoseOfAStateByHand) {
  const Scene scene = two_species(2, 2);
  const DiskProperties disks{{0.5, 0.5, 0.5, 0.5}, {3, 1, 3, 1}};
  SpeciesObserver observer(scene, disks, 1, {0, 1, 4});
  Snapshot at;
  at.x = {1, 2, 3, 4}, at.z = {0.5, 0.5, 2.5, 2.5};
  at.vx = {2, 1, -2, -1}, at.vz = {0, 4, 2, 6};
  observer.observe(at);
  observer.observe(at);
  EXPECT_DOUBLE_EQ(observer.temperature(SpeciesObserver::first).value, 1.5);
  EXPECT_DOUBLE_EQ(observer.temperature(SpeciesObserver::second).value, 9);
  EXPECT_DOUBLE_EQ(observer.temperature_ratio().value, 6);
  // A layer of 1 D of a box of 10 D holds one disk of each species: 0.1 a D^2.
  for (const std::size_t layer : {0, 2}) {
    for (const std::size_t species : {SpeciesObserver::first, SpeciesObserver::second}) {
      EXPECT_DOUBLE_EQ(observer.cell(layer, species).count, 2);
      EXPECT_DOUBLE_EQ(observer.number_density(layer, species), 0.1);
      // Both looks see the same velocity: it is the mean that is taken off.
      EXPECT_NEAR(observer.layer_temperature(layer, species), 0, 1e-12);
    }
  }
  EXPECT_EQ(observer.cell(1, SpeciesObserver::first).count, 0);
  EXPECT_DOUBLE_EQ(observer.height(2), 2.5);
}

// Five layers of 0.4 D from 1.1 D below the floor's mean on; what lies beyond counts for the outermost ones.
TEST(SpeciesTemperatures, AreFiledInTheLayersOfTheirGrid) {
  SpeciesObserver observer(two_species(4, 2), {std::vector<double>(6, 0.5), {1, 3, 1, 1, 3, 1}}, 1, {-1.1, 0.4, 5});
  Snapshot at;
  at.z = {-1.05, -0.71, -0.69, 0.49, 0.51, 7}, at.x = at.vx = at.vz = std::vector<double>(6, 1);
  observer.observe(at);
  at.z[2] = -4;
  observer.observe(at);
  at.z[2] = -0.31;
  observer.observe(at);
  const double light[] = {4, 2, 0, 3, 3}, heavy[] = {3, 0, 0, 0, 3};
  for (std::size_t layer = 0; layer < 5; ++layer) {
    EXPECT_EQ(observer.cell(layer, SpeciesObserver::first).count, light[layer]) << layer;
    EXPECT_EQ(observer.cell(layer, SpeciesObserver::second).count, heavy[layer]) << layer;
    EXPECT_NEAR(observer.height(layer), -0.9 + 0.4 * static_cast<double>(layer), 1e-12);
    EXPECT_NEAR(observer.number_density(layer, SpeciesObserver::second), heavy[layer] / (3 * 10 * 0.4), 1e-12);
  }
}

// In a layer at rest in the mean T is half of <m v_x^2> + <m v_z^2>: 1 (v = +-1) and 3.
TEST(SpeciesTemperatures, OfALayerAreWithoutItsMean) {
  const Scene scene = two_species(1, 1);
  SpeciesObserver observer(scene, {{0.5, 0.5}, {1, 3}}, 1, {0, 1, 1});
  Snapshot at;
  at.x = {1, 2}, at.z = {0.5, 0.5};
  for (const double sign : {1.0, -1.0}) {
    at.vx = {sign, sign}, at.vz = {sign + 7, sign - 7};
    observer.observe(at);
  }
  EXPECT_DOUBLE_EQ(observer.layer_temperature(0, SpeciesObserver::first), 1);
  EXPECT_DOUBLE_EQ(observer.layer_temperature(0, SpeciesObserver::second), 3);
}

// 300 runs of 64 independent Maxwellian states with T = 2 and 5: the deviations over the stated errors have the mean 0
// and the variance 1, which 63 samples make 63/61. Limits at 4 standard errors of 300 runs.
TEST(SpeciesTemperatures, HaveErrorsAsTheyScatter) {
  constexpr int runs = 300, looks = 64, disks_each = 20;
  const Scene scene = two_species(disks_each, disks_each);
  DiskProperties disks;
  for (int i = 0; i < 2 * disks_each; ++i) disks.radius.push_back(0.5), disks.mass.push_back(i < disks_each ? 1 : 3);
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  double sums[3] = {}, squares[3] = {};
  for (int run = 0; run < runs; ++run) {
    SpeciesObserver observer(scene, disks, 1, {0, 1, 1});
    Snapshot at;
    at.x.assign(2 * disks_each, 1), at.z.assign(2 * disks_each, 0.5);
    at.vx.resize(2 * disks_each), at.vz.resize(2 * disks_each);
    for (int look = 0; look < looks; ++look) {
      for (std::size_t i = 0; i < at.vx.size(); ++i) {
        const double speed = std::sqrt((disks.mass[i] == 1 ? 2 : 5) / disks.mass[i]);
        at.vx[i] = speed * normal(random), at.vz[i] = speed * normal(random);
      }
      observer.observe(at);
    }
    const Measured found[] = {observer.temperature(SpeciesObserver::first),
                              observer.temperature(SpeciesObserver::second), observer.temperature_ratio()};
    const double truth[] = {2, 5, 2.5};
    for (int k = 0; k < 3; ++k) {
      const double pull = (found[k].value - truth[k]) / found[k].std_error;
      sums[k] += pull, squares[k] += pull * pull;
    }
  }
  // The largest over block lengths is stated, so errors are a little too large: the variance may fall to 0.6.
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(sums[k] / runs, 0, 4 / std::sqrt(runs)) << k;
    EXPECT_GT(squares[k] / runs, 0.6) << k;
    EXPECT_LT(squares[k] / runs, 63.0 / 61 + 4 * std::sqrt(2.0 / runs)) << k;
  }
}

}  // namespace
}  // namespace shakebed::sim
