#include "fit/calibrate.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/fit/synthetic.hpp"

namespace shakebed::fit {
namespace {

const std::vector<CalibrationAxis> box{{"restitution", 0.3, 0.95, 6}, {"friction", 0.0, 0.8, 5}};

// chi2 of a bed whose truth is e = 0.71, friction 0.23, errors 0.02 and 0.05 with correlation 0.5.
double chi2_at(std::span<const double> x) {
  const double u = (x[0] - 0.71) / 0.02;
  const double v = (x[1] - 0.23) / 0.05;
  return 30.0 + (u * u + v * v - 2.0 * 0.5 * u * v) / (1.0 - 0.25);
}

TEST(Calibrate, FindsTheMinimumItsErrorsAndItsCost) {
  using Method = CalibrationOptions::Method;
  for (const Method method : {Method::simplex, Method::grid_then_simplex}) {
    const CalibrationResult result = calibrate(
        [](std::span<const double> x) {
          return CalibrationRun{{}, chi2_at(x), 0.0, 2.5, false};
        },
        box, {.method = method, .max_runs = 300, .tolerance = 1e-4});
    ASSERT_EQ(result.status, FitStatus::ok) << result.message;
    EXPECT_NEAR(result.best[0], 0.71, 1e-3);
    EXPECT_NEAR(result.best[1], 0.23, 3e-3);
    ASSERT_TRUE(result.has_uncertainty);
    EXPECT_NEAR(result.std_error[0], 0.02, 1e-3);
    EXPECT_NEAR(result.std_error[1], 0.05, 3e-3);
    EXPECT_NEAR(result.covariance[1] / (result.std_error[0] * result.std_error[1]), 0.5, 0.05);
    EXPECT_NEAR(result.cost, 2.5 * static_cast<double>(result.runs.size()), 1e-9);
    EXPECT_FALSE(result.at_edge[0] || result.at_edge[1]);
  }
}

TEST(Calibrate, AGridAloneIsRepeatable) {
  const auto objective = [](std::span<const double> x) { return CalibrationRun{{}, chi2_at(x), 0.0, 1.0, false}; };
  const CalibrationResult a = calibrate(objective, box, {.method = CalibrationOptions::Method::grid});
  const CalibrationResult b = calibrate(objective, box, {.method = CalibrationOptions::Method::grid});
  ASSERT_EQ(a.status, FitStatus::ok);
  EXPECT_EQ(a.runs.size(), 30U);
  EXPECT_EQ(a.best, b.best);
  EXPECT_NEAR(a.runs[a.best_run].point[0], 0.69, 1e-12);
  EXPECT_NEAR(a.runs[a.best_run].point[1], 0.2, 1e-12);
}

TEST(Calibrate, LivesWithNoise) {
  // Noise of one unit of chi2: 100 searches, the truth within 3 stated errors in most.
  int held = 0;
  int sound = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    synthetic::Normal normal(seed);
    const CalibrationResult result = calibrate(
        [&](std::span<const double> x) {
          return CalibrationRun{{}, chi2_at(x) + normal(), 1.0, 1.0, false};
        },
        box, {.max_runs = 150, .tolerance = 1e-2});
    ASSERT_FALSE(result.best.empty());
    if (!result.has_uncertainty) continue;
    ++sound;
    held += std::abs(result.best[0] - 0.71) < 3.0 * result.std_error[0] &&
                    std::abs(result.best[1] - 0.23) < 3.0 * result.std_error[1]
                ? 1
                : 0;
  }
  EXPECT_GE(sound, 80);
  EXPECT_GE(held, sound * 9 / 10);
}

TEST(Calibrate, SaysWhenTheBestIsAtTheEdgeOrTheBudgetEnds) {
  const auto slope = [](std::span<const double> x) { return CalibrationRun{{}, 100.0 * x[0], 0.0, 1.0, false}; };
  const CalibrationResult edge = calibrate(slope, box, {.max_runs = 200});
  EXPECT_TRUE(edge.at_edge[0]);
  EXPECT_FALSE(edge.warnings.empty());
  const CalibrationResult spent = calibrate(slope, box, {.max_runs = 12});
  EXPECT_EQ(spent.status, FitStatus::not_converged);
  EXPECT_EQ(spent.runs.size(), 12U);
}

TEST(Calibrate, SurvivesFailedRuns) {
  const CalibrationResult some = calibrate(
      [](std::span<const double> x) {
        CalibrationRun run{{}, chi2_at(x), 0.0, 1.0, x[1] > 0.5};
        if (x[0] < 0.5) run.value = std::nan("");
        return run;
      },
      box, {.max_runs = 300, .tolerance = 1e-4});
  ASSERT_EQ(some.status, FitStatus::ok);
  EXPECT_NEAR(some.best[0], 0.71, 2e-3);
  for (const CalibrationRun& run : some.runs) EXPECT_TRUE(std::isfinite(run.value));
  const CalibrationResult none = calibrate(
      [](std::span<const double>) {
        return CalibrationRun{{}, 0.0, 0.0, 1.0, true};
      },
      box, {.max_runs = 50});
  EXPECT_EQ(none.status, FitStatus::no_signal);
  EXPECT_EQ(calibrate({}, box, {}).status, FitStatus::bad_input);
  EXPECT_EQ(calibrate([](std::span<const double>) { return CalibrationRun{}; }, {}, {}).status, FitStatus::bad_input);
}

}  // namespace
}  // namespace shakebed::fit
