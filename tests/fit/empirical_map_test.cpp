#include "fit/map/empirical_map.hpp"

#include <gtest/gtest.h>

#include <cmath>

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
