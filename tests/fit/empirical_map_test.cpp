#include "fit/map/empirical_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/bench/cases/fit_benchmark.hpp"
#include "tests/fit/synthetic.hpp"

namespace shakebed::fit {
namespace {

double law(double gamma, double restitution) { return 0.05 * gamma * gamma * std::exp(3.0 * (restitution - 0.9)); }

EmpiricalMap make_map(double noise) {
  std::vector<MapPoint> points;
  synthetic::Normal normal(8);
  for (double gamma = 1.5; gamma < 8.1; gamma *= 1.2) {
    for (double e = 0.5; e < 0.96; e += 0.1) {
      const double t = law(gamma, e);
      points.push_back({{gamma, e}, t * (1.0 + noise * normal()), noise * t});
    }
  }
  return EmpiricalMap({{"gamma", true}, {"restitution", false}}, std::move(points));
}

TEST(EmpiricalMap, SaysWhyItIsNone) {
  const auto expect = [](const EmpiricalMap& map, FitStatus status, const std::string& message) {
    EXPECT_EQ(map.status(), status) << message;
    EXPECT_EQ(map.message(), message);
  };
  expect({{}, {}}, FitStatus::bad_input, "a map needs at least one axis");
  expect({{{"gamma", true}}, {{{2}, 0.1, 0.01}, {{0}, 0.1, 0.01}, {{3}, 0.1, 0.01}}}, FitStatus::bad_input,
         "a point of the map is not finite, not positive or has the wrong number of coordinates");
  expect({{{"gamma", true}}, {{{2}, 0.1, 0.01}, {{3}, 0.1, 0.01}}}, FitStatus::too_few_bins,
         "the map has 2 points; a fit of 1 axes needs at least 3");
}

TEST(EmpiricalMap, InterpolatesWithinItsStatedError) {
  for (const double noise : {0.0, 0.03}) {
    const EmpiricalMap map = make_map(noise);
    ASSERT_EQ(map.status(), FitStatus::ok) << map.message();
    int held = 0;
    int count = 0;
    for (double gamma = 1.7; gamma < 6.0; gamma += 0.37) {
      for (double e = 0.55; e < 0.85; e += 0.06) {
        const double position[] = {gamma, e};
        const auto prediction = map.at(position);
        ASSERT_EQ(prediction.status, FitStatus::ok);
        EXPECT_TRUE(prediction.inside);
        EXPECT_NEAR(prediction.temperature.value / law(gamma, e), 1.0, noise == 0.0 ? 1e-6 : 0.1);
        held += std::abs(prediction.temperature.value - law(gamma, e)) < 2.0 * prediction.temperature.std_error ? 1 : 0;
        ++count;
      }
    }
    // ln T is linear in ln Gamma and e here, so only the noise is left, and the error must hold it.
    if (noise > 0.0) {
      EXPECT_GE(held, count * 9 / 10);
    }
    EXPECT_NEAR(map.interpolation_error(), noise == 0.0 ? 0.0 : 0.035, noise == 0.0 ? 1e-6 : 0.02);
  }
}

// One axis, and no more beds than set the width of the weights: a power law is a line in the logarithms.
TEST(EmpiricalMap, OfOneAxisIsExactForAPowerLaw) {
  for (const int beds : {5, 9}) {
    std::vector<MapPoint> points;
    for (int k = 0; k < beds; ++k) {
      const double gamma = 2.0 + 0.5 * k;
      points.push_back({{gamma}, 0.1 * gamma * gamma, 0.0});
    }
    const EmpiricalMap map({{"gamma", true}}, std::move(points));
    ASSERT_EQ(map.status(), FitStatus::ok) << map.message();
    for (const double gamma : {2.2, 3.1, 3.9}) {
      const double position[] = {gamma};
      const auto found = map.at(position);
      ASSERT_EQ(found.status, FitStatus::ok) << gamma;
      EXPECT_NEAR(found.temperature.value, 0.1 * gamma * gamma, 1e-6) << gamma;
    }
    EXPECT_NEAR(map.interpolation_error(), 0.0, 1e-6);
  }
}

// Five points on one axis, of a curve that bends: each from the four others by a line through ln T, which weighs them
// by a Gaussian of half the distance of the farthest. The rms of what is left is the error.
TEST(EmpiricalMap, HasTheErrorOfPointsThatAreLeftOut) {
  const std::vector<double> place = {1, 1.4, 2.3, 3.1, 4}, log_t = {-1, -0.6, -0.1, 0.6, 0.7};
  std::vector<MapPoint> points;
  for (std::size_t k = 0; k < 5; ++k) points.push_back({{place[k]}, std::exp(log_t[k]), 0});
  double squares = 0;
  for (std::size_t left_out = 0; left_out < 5; ++left_out) {
    double width = 0, w = 0, wx = 0, wxx = 0, wy = 0, wxy = 0;
    for (const double one : place) width = std::max(width, 0.5 * std::abs(one - place[left_out]));
    for (std::size_t k = 0; k < 5; ++k) {
      if (k == left_out) continue;
      const double x = place[k] - place[left_out], weight = std::exp(-0.5 * std::pow(x / width, 2));
      w += weight, wx += weight * x, wxx += weight * x * x, wy += weight * log_t[k], wxy += weight * x * log_t[k];
    }
    squares += std::pow((wxx * wy - wx * wxy) / (w * wxx - wx * wx) - log_t[left_out], 2) / 5;
  }
  EXPECT_NEAR(EmpiricalMap({{"gamma", false}}, points).interpolation_error(), std::sqrt(squares), 1e-6);
}

// An axis along which all beds are alike has no slope and no range: the map is that of the other axis, at this place.
TEST(EmpiricalMap, IgnoresAnAxisAlongWhichNothingVaries) {
  std::vector<MapPoint> points, of_one;
  for (int k = 0; k < 9; ++k) {
    const double gamma = 2.0 + 0.5 * k, t = 0.1 * gamma * gamma * gamma;
    points.push_back({{gamma, 0.9}, t, 0.0});
    of_one.push_back({{gamma}, t, 0.0});
  }
  const EmpiricalMap map({{"gamma", true}, {"restitution", false}}, points), one({{"gamma", true}}, of_one);
  ASSERT_EQ(map.status(), FitStatus::ok) << map.message();
  for (const double gamma : {2.0, 3.3, 6.0}) {
    const double here[] = {gamma, 0.9}, above[] = {gamma, 0.91}, below[] = {gamma, 0.89};
    EXPECT_NEAR(map.at(here).temperature.value, 0.1 * std::pow(gamma, 3), 1e-6) << gamma;
    EXPECT_NEAR(one.at({here, 1}).temperature.value, map.at(here).temperature.value, 1e-6) << gamma;
    EXPECT_TRUE(map.at(here).inside) << gamma;
    EXPECT_FALSE(map.at(above).inside) << gamma;
    EXPECT_FALSE(map.at(below).inside) << gamma;
  }
  const double colder[] = {1.99, 0.9}, hotter[] = {6.01, 0.9};
  EXPECT_FALSE(map.at(colder).inside);
  EXPECT_FALSE(map.at(hotter).inside);
}

TEST(EmpiricalMap, SaysWhereItExtrapolatesOrCannot) {
  const EmpiricalMap map = make_map(0.0);
  const double outside[] = {20.0, 0.7};
  EXPECT_FALSE(map.at(outside).inside);
  const double wrong[] = {2.0};
  EXPECT_EQ(map.at(wrong).status, FitStatus::bad_input);
  const double negative[] = {-2.0, 0.7};
  EXPECT_EQ(map.at(negative).status, FitStatus::bad_input);
  EXPECT_EQ(EmpiricalMap({{"gamma", true}}, {{{2.0}, 1.0, 0.0}}).status(), FitStatus::too_few_bins);
  EXPECT_EQ(EmpiricalMap({{"gamma", true}}, {{{2.0}, -1.0, 0.0}}).status(), FitStatus::bad_input);
  EXPECT_EQ(EmpiricalMap({}, {}).status(), FitStatus::bad_input);
}

TEST(FitBenchmark, RowsAreTimedAndRight) {
  for (const FitBenchmarkRow& row : benchmark_fit(0.1)) {
    std::printf("[ measured ] %-10s %-36s %6d  %12.1f ns  error %.1e\n", row.what.c_str(), row.setting.c_str(),
                row.size, row.nanoseconds, row.error);
    EXPECT_GT(row.nanoseconds, 0.0);
    EXPECT_LE(row.error, row.what == "fit" ? 1e-6 : row.what == "inverse" ? 1e-13 : 1e-12) << row.setting;
  }
}

}  // namespace
}  // namespace shakebed::fit
