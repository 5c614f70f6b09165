#include "fit/profile_fit/least_squares.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fit/profile_fit/window.hpp"
#include "fit/theory/expansion.hpp"
#include "tests/fit/synthetic.hpp"

// The solver's covariance, by formulas written out here for two parameters with derivatives by differences: nothing of
// the solver but the place of its minimum enters.
namespace shakebed::fit {
namespace {

struct Problem {
  Bins bins;
  LeastSquaresOptions options;
  FitModel::Parameters start{0.12, 8.0, 1.10};
  std::unique_ptr<FitModel> model = make_fit_model("enskog-rectangle", 0.0, false, 0.25);
};

// A fit may end at the largest plateau itself, so these models have a curve there; none has one beyond it, nor of a
// plateau or a temperature of 0, nor of what is no number.
TEST(FitModel, HasACurveUpToItsLargestPlateau) {
  for (const char* name : {"enskog-rectangle", "fermi", "rectangle"}) {
    const auto model = make_fit_model(name, 0.0, false, 0.25);
    ASSERT_NE(model, nullptr) << name;
    const double most = model->largest_plateau(), none = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(model->set({0.2, 8, most})) << name;
    EXPECT_FALSE(model->set({0.2, 8, most * (1 + 1e-12)})) << name;
    EXPECT_FALSE(model->set({0.2, 8, 0})) << name;
    EXPECT_FALSE(model->set({0.2, none, 1})) << name;
    EXPECT_FALSE(model->set({0.2, 8, none})) << name;
    EXPECT_EQ(model->set({0, 8, 1}), !model->uses_temperature()) << name;
  }
}

// Distances 1, 1, 0 and 2: of those that are not zero the median.
TEST(MeasuredProfile, KnowsItsSpacingAndSaysWhichHeightsAreRepeated) {
  Profile profile;
  profile.height = {0, 1, 2, 2, 4};
  profile.number_density = {1, 0.9, 0.8, 0.8, 0.1};
  profile.std_error = {0.01, 0.01, 0.01, 0.01, 0.01};
  MeasuredProfile measured;
  FitResult result;
  ASSERT_EQ(measure_profile(profile, measured, result), FitStatus::ok) << result.message;
  EXPECT_EQ(measured.spacing, 1);
  ASSERT_EQ(result.warnings.size(), 1U);
  EXPECT_EQ(result.warnings[0], "1 bin repeats the height of another bin; each counts as an independent measurement");
}

// Five heights of which one is left out and the last lies beyond the window: those that remain keep their own
// densities, errors and covariance, which is the square of the matrix that whitens.
TEST(Bins, AreTheUsableHeightsOfTheWindow) {
  MeasuredProfile measured;
  measured.height = {0, 1, 2, 3, 4};
  measured.density = {10, 11, 12, 13, 14};
  measured.error = {1, 2, 4, 5, 8};
  measured.usable = {true, false, true, true, true};
  const Window window{0, 3, ""};
  const Bins alone = bins_of(measured, window, nullptr);
  EXPECT_EQ(alone.height, (std::vector<double>{0, 2, 3}));
  EXPECT_EQ(alone.density, (std::vector<double>{10, 12, 13}));
  EXPECT_EQ(alone.inverse_error, (std::vector<double>{1, 0.25, 0.2}));
  measured.covariance = Eigen::MatrixXd::Identity(5, 5);
  for (Eigen::Index i = 0; i < 5; ++i) {
    for (Eigen::Index j = 0; j < 5; ++j) {
      const double correlation = i == j ? 1 : 0.1 * static_cast<double>(i + j) / 7;
      measured.covariance(i, j) =
          correlation * measured.error[static_cast<std::size_t>(i)] * measured.error[static_cast<std::size_t>(j)];
    }
  }
  const Bins together = bins_of(measured, window, nullptr);
  EXPECT_EQ(together.height, alone.height);
  const Eigen::MatrixXd square = together.whitening * together.whitening.transpose();
  const Eigen::Index chosen[] = {0, 2, 3};
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j)
      EXPECT_NEAR(square(i, j), measured.covariance(chosen[i], chosen[j]), 1e-12) << i << j;
  }
}

// 60 bins, T = 0.15, every seventh off by 8 errors, neighbours correlated by `correlation`^distance.
Problem correlated_problem(double correlation) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.15, {11.22, 1.10});
  Problem problem;
  synthetic::Normal normal(21);
  constexpr Eigen::Index n = 60;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double height = 3.0 + 0.15 * static_cast<double>(i), error = 0.01;
    problem.bins.height.push_back(height);
    problem.bins.density.push_back(truth.density(height) + error * (normal() + (i % 7 == 3 ? 8.0 : 0.0)));
    problem.bins.inverse_error.push_back(1.0 / error);
  }
  problem.bins.samples = 20;
  problem.bins.correlation.resize(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j)
      problem.bins.correlation(i, j) = std::pow(correlation, std::abs(static_cast<double>(i - j)));
  }
  return problem;
}

// B J^T W R W J B, B = (J^T W J)^-1: W of Huber's weights at the solution, J of (T, shift), R the bins' correlations.
std::array<double, 4> sandwich(const Problem& problem, const Solution& solution) {
  const std::size_t n = problem.bins.size();
  const auto densities = [&](std::size_t parameter, double step) {
    FitModel::Parameters p = solution.parameters;
    p[parameter] += step;
    FitOptions options;
    return evaluate_model(options, p[0], p[1], p[2], 0.0, problem.bins.height).densities;
  };
  const std::vector<double> best = densities(0, 0.0);
  const double steps[2] = {1e-6, 1e-5};
  std::vector<double> j[2];
  std::vector<double> weight(n);
  for (std::size_t p = 0; p < 2; ++p) {
    const auto up = densities(p, steps[p]), down = densities(p, -steps[p]);
    for (std::size_t i = 0; i < n; ++i)
      j[p].push_back((up[i] - down[i]) / (2.0 * steps[p]) * problem.bins.inverse_error[i]);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double residual = std::abs(best[i] - problem.bins.density[i]) * problem.bins.inverse_error[i];
    const double k = problem.options.robust_threshold;
    weight[i] = problem.options.robust && residual > k ? k / residual : 1.0;
  }
  double a[2][2] = {}, meat[2][2] = {};
  for (std::size_t p = 0; p < 2; ++p) {
    for (std::size_t q = 0; q < 2; ++q) {
      for (std::size_t i = 0; i < n; ++i) {
        a[p][q] += j[p][i] * weight[i] * j[q][i];
        for (std::size_t k = 0; k < n; ++k)
          meat[p][q] += j[p][i] * weight[i] *
                        problem.bins.correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) *
                        weight[k] * j[q][k];
      }
    }
  }
  const double determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
  const double b[2][2] = {{a[1][1] / determinant, -a[0][1] / determinant},
                          {-a[1][0] / determinant, a[0][0] / determinant}};
  std::array<double, 4> covariance{};
  for (std::size_t p = 0; p < 2; ++p) {
    for (std::size_t q = 0; q < 2; ++q) {
      for (std::size_t k = 0; k < 2; ++k) {
        for (std::size_t l = 0; l < 2; ++l) covariance[2 * p + q] += b[p][k] * meat[k][l] * b[l][q];
      }
    }
  }
  return covariance;
}

void expect_sandwich(const Problem& problem) {
  const Solution solution = least_squares(problem.bins, *problem.model, problem.start, problem.options);
  ASSERT_TRUE(solution.converged);
  const std::array<double, 4> expected = sandwich(problem, solution);
  for (Eigen::Index p = 0; p < 2; ++p) {
    for (Eigen::Index q = 0; q < 2; ++q) {
      const double entry = expected[static_cast<std::size_t>(2 * p + q)];
      EXPECT_NEAR(solution.covariance(p, q) / entry, 1.0, 1e-4) << p << q;
    }
  }
}

// The minimum does not depend on where its search began: differences of chi2 would leave a relative 1e-8 of it open.
TEST(LeastSquares, EndsAtOneMinimumFromEveryStart) {
  Problem problem = correlated_problem(0.0);
  std::vector<FitModel::Parameters> found;
  for (const FitModel::Parameters& start :
       {FitModel::Parameters{0.12, 8.0, 1.10}, {0.2, 9.0, 1.10}, {0.08, 7.5, 1.10}, {0.15, 8.4, 1.10}}) {
    const Solution solution = least_squares(problem.bins, *problem.model, start, problem.options);
    ASSERT_TRUE(solution.converged);
    found.push_back(solution.parameters);
  }
  for (const FitModel::Parameters& one : found) {
    EXPECT_NEAR(one[0] / found[0][0], 1, 1e-11);
    EXPECT_NEAR(one[1] / found[0][1], 1, 1e-11);
  }
}

TEST(LeastSquares, ErrorsComeThroughTheCorrelations) { expect_sandwich(correlated_problem(0.6)); }

// Errors that are not known: the scale is 1.4826 of the median size of all residuals, also of the first, and beyond
// robust_threshold of it the loss is linear.
TEST(LeastSquares, UnknownErrorsAreTheMedianOfTheResiduals) {
  Problem problem = correlated_problem(0.0);
  problem.bins.density.front() += 0.05;  // far off
  problem.options.robust = true;
  problem.options.errors_known = false;
  problem.options.max_iterations = 1000;  // of all rounds with a new scale
  const Solution solution = least_squares(problem.bins, *problem.model, problem.start, problem.options);
  ASSERT_TRUE(solution.converged);
  const FitModel::Parameters& p = solution.parameters;
  const std::vector<double> curve = evaluate_model({}, p[0], p[1], p[2], 0.0, problem.bins.height).densities;
  std::vector<double> sizes;
  for (std::size_t i = 0; i < curve.size(); ++i)
    sizes.push_back(std::abs(curve[i] - problem.bins.density[i]) * problem.bins.inverse_error[i]);
  std::sort(sizes.begin(), sizes.end());
  ASSERT_EQ(sizes.size(), 60u);
  const double threshold = problem.options.robust_threshold * 1.482602218505602 * sizes[30];
  double loss = 0;
  for (const double size : sizes) loss += size < threshold ? size * size : threshold * (2 * size - threshold);
  EXPECT_NEAR(solution.objective / loss, 1, 1e-4);
}

// With a threshold of 1.345 errors Huber's estimate of normal data has 95 % of the efficiency of least squares: its
// variance is 1/0.95 of theirs [Huber1964]. Of 900 bins the factor is known to a few per cent, whether the errors are
// given or follow from the residuals. Of data without noise the variance is E psi^2 of a unit normal, 0.7102, times
// theirs.
TEST(LeastSquares, RobustErrorsHaveHubersEfficiency) {
  const auto problem_with = [](double noise) {
    const auto truth = HydrostaticProfile::of_column(enskog(), 0.15, {11.22, 1.10});
    Problem problem;
    synthetic::Normal normal(31);
    for (int i = 0; i < 900; ++i) {
      const double height = 3.0 + 0.01 * i;
      problem.bins.height.push_back(height);
      problem.bins.density.push_back(truth.density(height) + noise * normal());
      problem.bins.inverse_error.push_back(1.0 / 0.01);
    }
    return problem;
  };
  const auto variance = [](Problem& problem, bool robust, bool known) {
    problem.options.robust = robust, problem.options.errors_known = known;
    problem.options.max_iterations = 1000;
    const Solution found = least_squares(problem.bins, *problem.model, problem.start, problem.options);
    EXPECT_TRUE(found.converged);
    return found.covariance(0, 0) * (robust || known ? 1 : found.chi2 / found.expected_chi2);
  };
  Problem noisy = problem_with(0.01), louder = problem_with(0.03), exact = problem_with(0);
  EXPECT_NEAR(variance(noisy, true, true) / variance(noisy, false, true), 1 / 0.95, 0.06);
  EXPECT_NEAR(variance(noisy, true, false) / variance(noisy, false, false), 1 / 0.95, 0.06);
  EXPECT_NEAR(variance(louder, true, false) / variance(noisy, true, false), 9, 0.5) << "the scale is that of the data";
  EXPECT_NEAR(variance(exact, true, true) / variance(exact, false, true), 0.7102, 1e-4);
}

TEST(LeastSquares, RobustErrorsComeThroughTheCorrelationsWithHubersWeights) {
  Problem problem = correlated_problem(0.6);
  problem.options.robust = true;
  expect_sandwich(problem);
}

}  // namespace
}  // namespace shakebed::fit
