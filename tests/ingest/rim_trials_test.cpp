// What the rim of a profile is fitted to, and the mean of several fits: the sums of rim_trials.hpp done a second time.
#include "ingest/find/rim_trials.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

// Levels that fall evenly, so that each is known between the samples as well.
BeadProfile falling_profile(double reach) {
  BeadProfile profile;
  profile.step_px = 0.1;
  for (int k = 0; k <= static_cast<int>(std::lround(10 * reach)); ++k)
    profile.level.push_back(static_cast<float>(1 - 0.05 * k * 0.1));
  return profile;
}

// From 0.55 radii, or 2.5 edges inside the rim where that is nearer to the centre, to the profile's end; a quarter of
// an edge apart, not less than 0.08 px, and 30 of them at least.
TEST(RimTrials, AreOfTheProfileAroundItsRim) {
  struct Case {
    double radius, edge, from, spacing;
  };
  for (const Case& one : {Case{10, 1.2, 5.5, 0.3}, Case{10, 2.4, 4, (16 - 4.0) / 30}, Case{10, 0.3, 5.5, 0.08},
                          Case{10, 1.36, 5.5, 0.34}, Case{4, 2, 0, 0.5}}) {
    const RimData data = rim_data(falling_profile(16), one.radius, one.edge);
    ASSERT_GE(data.distance.size(), 29U);
    for (std::size_t k = 0; k < data.distance.size(); ++k) {
      const double r = one.from + (static_cast<double>(k) + 0.5) * one.spacing;
      EXPECT_NEAR(data.distance[k], r, 1e-9) << one.edge;
      EXPECT_NEAR(data.level[k], 1 - 0.05 * r, 1e-6) << one.edge;
      EXPECT_NEAR(data.weight[k], r, 1e-9) << "pixels at this distance";
    }
    EXPECT_GE(data.distance.back() + one.spacing, 16 - 1e-9);
    EXPECT_LT(data.distance.back(), 16);
  }
}

// A point stands for the pixels of all beads within a knot of its distance, at least one of them; points nearer to one
// another than the knots share what these know. To this comes what learning is off by, 0.0003 or, at a sharp edge, ten
// times that.
TEST(RimTrials, AreWeightedByTheirPixels) {
  for (const double edge : {0.59, 0.61})
    for (const double knot : {0.2, 0.5})
      for (const double beads : {1e-3, 12.0}) {
        RimData data;
        data.distance = {4, 4.3, 7.5}, data.level = {1, 0.9, 0.1}, data.weight = data.distance;
        RimConditions conditions;
        conditions.edge_px = edge, conditions.knot_px = knot, conditions.noise = 0.07, conditions.beads = beads;
        weigh(data, conditions);
        for (std::size_t k = 0; k < 3; ++k) {
          const double pixels = std::max(1.0, beads * 2 * std::numbers::pi * data.distance[k] * knot);
          const double variance = 0.07 * 0.07 / pixels + (edge < 0.6 ? 9e-6 : 9e-8);
          EXPECT_NEAR(data.weight[k] * variance, knot > 0.3 ? 0.3 / knot : 1, 1e-9) << edge << ' ' << knot;
        }
        EXPECT_NEAR(data.offset_weight, 250'000, 1e-6) << "a level outside of 0.002 is one standard error";
      }
}

// Recorded level = brightest x light^0.45, whichever of bead and background is the brighter.
TEST(RimTrials, AreTakenBackIntoLight) {
  for (const auto& [background, bead] : {std::pair{200.0, 40.0}, {40.0, 200.0}}) {
    RimConditions conditions;
    conditions.background_level = background, conditions.bead_level = bead;
    RimData recorded;
    recorded.distance = {1, 2, 3, 4, 5}, recorded.weight = {5, 4, 3, 2, 1};
    const auto light = [&](double level) { return std::pow(std::max(0.0, level) / 200, 1 / 0.45); };
    for (const double share : {1.0, 0.7, 0.0, -0.1, 1.3})  // 1.3: of the dark bead a level below 0, which is no light
      recorded.level.push_back(share);
    const auto lit = data_in_light(recorded, conditions);
    ASSERT_TRUE(lit);
    for (std::size_t k = 0; k < 5; ++k)
      EXPECT_NEAR(lit->level[k],
                  (light(background + recorded.level[k] * (bead - background)) - light(background)) /
                      (light(bead) - light(background)),
                  1e-9);
    EXPECT_NEAR(lit->level[0], 1, 1e-12);
    EXPECT_NEAR(lit->level[2], 0, 1e-12);
    EXPECT_EQ(lit->distance, recorded.distance);
    EXPECT_EQ(lit->weight, recorded.weight);
  }
  // Levels that differ by less than a twentieth of the brightest light are no curve's.
  RimConditions close;
  close.background_level = 100, close.bead_level = 100 * std::pow(0.949, 0.45);
  EXPECT_TRUE(data_in_light({}, close));
  close.bead_level = 100 * std::pow(0.951, 0.45);
  EXPECT_FALSE(data_in_light({}, close));
}

RimTrial trial_of(double radius, double squares, double terms, bool odd = false, double exponent = 1) {
  RimTrial trial;
  trial.rim.good = true, trial.rim.radius_px = radius, trial.rim.edge_px = radius / 10, trial.rim.squares = squares;
  trial.rim.std_error_px = 0.01 * radius / 10, trial.rim.misfit = 0.001 * radius;
  trial.terms = terms, trial.odd = odd, trial.exponent = exponent;
  return trial;
}
// chi2 with what terms, an odd shape and a tone curve cost.
double cost_of(const RimTrial& trial, double scale) {
  return trial.rim.squares / scale + 6 * trial.terms + (trial.odd ? 12 : 0) + (trial.exponent != 1 ? 12 : 0);
}

// The mean by exp(-cost / 2); in the error, what only the odd shape or the curve costs counts for nothing.
TEST(RimTrials, ShareTheRadiusByTheirCosts) {
  const std::vector<RimTrial> shapes[] = {
      {trial_of(10, 40, 2), trial_of(10.2, 35, 3), trial_of(9.9, 27, 3, true), trial_of(10.4, 29, 2, false, 0.45),
       trial_of(11, 900, 2)},
      {trial_of(10, 60, 2), trial_of(10.2, 36, 2, true), trial_of(9.9, 33, 3, true),
       trial_of(10.4, 55, 2, false, 0.45)},
      {trial_of(10, 60, 2), trial_of(10.4, 36, 2, false, 0.45), trial_of(10.3, 31, 3, true, 0.45)},
  };
  for (const std::vector<RimTrial>& trials : shapes)
    for (const double scale : {1.0, 2.5}) {
      const RimTrial& best = *std::min_element(trials.begin(), trials.end(), [&](const RimTrial& a, const RimTrial& b) {
        return cost_of(a, scale) < cost_of(b, scale);
      });
      double sum = 0, mean = 0, fair = 0, square = 0;
      for (const RimTrial& one : trials) {
        const double weight = std::exp(-0.5 * (cost_of(one, scale) - cost_of(best, scale)));
        sum += weight, mean += weight * one.rim.radius_px;
      }
      mean /= sum;
      for (const RimTrial& one : trials) {
        double surplus = cost_of(one, scale) - cost_of(best, scale);
        if (one.odd && !best.odd) surplus -= 12;
        if (one.exponent != 1 && best.exponent == 1) surplus -= 12;
        const double weight = std::exp(-0.5 * std::max(0.0, surplus));
        fair += weight;
        square += weight * (std::pow(one.rim.radius_px - mean, 2) + scale * std::pow(one.rim.std_error_px, 2));
      }
      const RimChoice choice = choice_among(trials, scale, 30);
      EXPECT_NEAR(choice.rim.radius_px, mean, 1e-9) << scale;
      EXPECT_NEAR(choice.rim.std_error_px, std::sqrt(square / fair), 1e-9) << scale;
      EXPECT_EQ(choice.exponent, best.exponent);
      EXPECT_EQ(choice.rim.edge_px, best.rim.edge_px);
      EXPECT_EQ(choice.rim.misfit, best.rim.misfit);
    }
}

// Of chi2 up to five a point the rim is a disk's. Far worse fits do not count: less than 1e-12 of the best.
TEST(RimTrials, AreGoodUpToFiveAPoint) {
  EXPECT_TRUE(choice_among({trial_of(10, 149.9, 2)}, 1, 30).rim.good);
  EXPECT_FALSE(choice_among({trial_of(10, 150.1, 2)}, 1, 30).rim.good);
  EXPECT_NEAR(choice_among({trial_of(10, 20, 2), trial_of(1e9, 80.01, 2)}, 1, 30).rim.radius_px,
              10 + 1e9 * std::exp(-30.005), 2e-4);
  EXPECT_NEAR(choice_among({trial_of(10, 20, 2), trial_of(1e9, 4000, 2)}, 1, 30).rim.radius_px,
              10 + 1e9 * std::exp(-30), 2e-4);
}

}  // namespace
}  // namespace shakebed::ingest
