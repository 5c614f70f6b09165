#include "fit/profile_fit/power_product.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace shakebed::fit {
namespace {

// y = 3 x^1.4 n^-0.6 exactly.
TEST(PowerProduct, FindsExactExponents) {
  const std::vector<std::vector<double>> x{{1, 2, 4, 1, 2, 4}, {5, 5, 5, 20, 20, 20}};
  std::vector<double> y, error;
  for (std::size_t i = 0; i < 6; ++i)
    y.push_back(3 * std::pow(x[0][i], 1.4) * std::pow(x[1][i], -0.6)), error.push_back(0.02 * y.back());
  const PowerProduct fit = fit_power_product(x, y, error);
  ASSERT_TRUE(fit.ok);
  EXPECT_NEAR(fit.exponents[0], 1.4, 1e-12);
  EXPECT_NEAR(fit.exponents[1], -0.6, 1e-12);
  EXPECT_NEAR(fit.log_amplitude, std::log(3), 1e-12);
  EXPECT_NEAR(fit.chi2, 0, 1e-18);
  EXPECT_EQ(fit.dof, 3);
  EXPECT_NEAR(fit.rms_log_ratio, 0, 1e-12);
  // Equal relative errors s on a full grid: var(a) = s^2/sum (ln x - mean)^2, here 2 x 2 ln^2 2.
  EXPECT_NEAR(fit.exponent_errors[0], 0.02 / (2 * std::log(2)), 1e-12);
  EXPECT_NEAR(fit.exponent_errors[1], 0.02 / std::sqrt(6 * std::pow(std::log(4) / 2, 2)), 1e-12);
  EXPECT_NEAR(fit.at(std::vector<double>{2, 5}), y[1], 1e-12);
}

// y = e^k, k = 0, 1, 3 at x = 1, e, e^2 with errors of 10 %: the line through 0, 1, 3 has slope 3/2 and residuals
// 1/6, -1/3, 1/6, so chi2 = (1/6)/0.01 with one degree of freedom, and the error 0.1/sqrt(2) grows by its root.
TEST(PowerProduct, WidensErrorsWhereThePointsScatter) {
  const double e = std::exp(1);
  const std::vector<double> y{1, e, e * e * e};
  const PowerProduct fit = fit_power_product({{1, e, e * e}}, y, std::vector<double>{0.1, 0.1 * e, 0.1 * e * e * e});
  ASSERT_TRUE(fit.ok);
  EXPECT_NEAR(fit.exponents[0], 1.5, 1e-12);
  EXPECT_NEAR(fit.chi2, 100.0 / 6, 1e-9);
  EXPECT_NEAR(fit.exponent_errors[0], 0.1 / std::sqrt(2) * std::sqrt(100.0 / 6), 1e-9);
  EXPECT_NEAR(fit.rms_log_ratio, std::sqrt((1.0 / 36 + 1.0 / 9 + 1.0 / 36) / 3), 1e-12);
}

// ln x = -1, 0, 1: the amplitude is the mean of ln y, of three points with errors of 0.02, and widened as the exponent
// is. Of ln y = 0, 1, 3 the mean is 4/3; chi2 of one degree of freedom is (1/6)/0.02^2.
TEST(PowerProduct, HasTheErrorOfItsAmplitude) {
  const double e = std::exp(1);
  const std::vector<std::vector<double>> x{{1 / e, 1, e}};
  const std::vector<double> exact{2 / e, 2, 2 * e}, error{0.04 / e, 0.04, 0.04 * e};
  const PowerProduct good = fit_power_product(x, exact, error);
  EXPECT_NEAR(good.log_amplitude, std::log(2), 1e-12);
  EXPECT_NEAR(good.log_amplitude_error, 0.02 / std::sqrt(3), 1e-12);
  EXPECT_NEAR(good.p_value, 1, 1e-9);
  ASSERT_EQ(good.group_log_amplitude.size(), 1U);
  const std::vector<double> bent{1, e, e * e * e};
  const PowerProduct poor = fit_power_product(x, bent, std::vector<double>{0.2, 0.2 * e, 0.2 * e * e * e});
  EXPECT_NEAR(poor.log_amplitude, 4.0 / 3, 1e-12);
  const double chi2 = 1 / 6.0 / 0.04;
  EXPECT_NEAR(poor.log_amplitude_error, 0.2 / std::sqrt(3) * std::sqrt(chi2), 1e-9);
  EXPECT_NEAR(poor.p_value, std::erfc(std::sqrt(chi2 / 2)), 1e-9) << "two sides of a normal distribution";
}

TEST(PowerProduct, NeedsPositiveAndIndependentNumbers) {
  const std::vector<double> y{1, 2, 3, 4}, error(4, 0.1);
  EXPECT_FALSE(fit_power_product({{1, 2, 3, 4}, {1, 4, 9, 16}}, y, error).ok) << "x and x^2";
  EXPECT_FALSE(fit_power_product({{2, 2, 2, 2}}, y, error).ok) << "one place";
  EXPECT_FALSE(fit_power_product({{0, 2, 3, 4}}, y, error).ok);
  EXPECT_FALSE(fit_power_product({{1, 2, 3, 4}}, std::vector<double>{1, 2, 3, -4}, error).ok);
  EXPECT_FALSE(fit_power_product({{1, 2, 3, 4}}, y, std::vector<double>{1, 0, 1, 1}).ok);
  EXPECT_FALSE(fit_power_product({{1, 2}}, std::vector<double>{1, 2}, std::vector<double>{1, 1}).ok) << "no dof";
}

// 400 samples of 8 points with 5 % noise: the mean of the pulls is 0 and their variance 1, widening aside. The variance
// may only be smaller: errors are widened where chi2 > dof by chance. Limits at 4 standard errors.
TEST(PowerProduct, StatesItsErrors) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const std::vector<double> x{1, 1.4, 2, 2.8, 4, 5.6, 8, 11};
  double sum = 0, squares = 0;
  constexpr int samples = 400;
  for (int s = 0; s < samples; ++s) {
    std::vector<double> y, error;
    for (const double at : x) {
      const double exact = 2 * std::pow(at, 1.5);
      y.push_back(exact * std::exp(0.05 * normal(random))), error.push_back(0.05 * y.back());
    }
    const PowerProduct fit = fit_power_product({x}, y, error);
    ASSERT_TRUE(fit.ok);
    const double pull = (fit.exponents[0] - 1.5) / fit.exponent_errors[0];
    sum += pull, squares += pull * pull;
  }
  EXPECT_NEAR(sum / samples, 0, 4 / std::sqrt(samples));
  EXPECT_LT(squares / samples, 1 + 4 * std::sqrt(2.0 / samples));
  EXPECT_GT(squares / samples, 0.6);
}

// y = a(g) n^0.3 with a = 5 at n = 1, 2 and a = 700 at n = 4, 16: groups whose amplitudes would pass for a power of n.
// The error of the exponent is that of the scatter within groups, ln 2 and ln 4 wide: s/sqrt(ln^2 2/2 + ln^2 4/2).
TEST(PowerProduct, LeavesTheAmplitudeOfEachGroupFree) {
  const std::vector<std::vector<double>> x{{1, 2, 4, 16}};
  const std::vector<std::size_t> group{0, 0, 1, 1};
  std::vector<double> y, error;
  for (std::size_t i = 0; i < 4; ++i)
    y.push_back((group[i] == 0 ? 5 : 700) * std::pow(x[0][i], 0.3)), error.push_back(0.02 * y.back());
  const PowerProduct fit = fit_power_product(x, y, error, group);
  ASSERT_TRUE(fit.ok);
  EXPECT_EQ(fit.dof, 1);
  EXPECT_NEAR(fit.exponents[0], 0.3, 1e-12);
  EXPECT_NEAR(fit.exponent_errors[0], 0.02 / std::sqrt(2.5) / std::log(2), 1e-12);
  ASSERT_EQ(fit.group_log_amplitude.size(), 2U);
  EXPECT_NEAR(fit.group_log_amplitude[1], std::log(700), 1e-12);
  EXPECT_NEAR(fit.at(std::vector<double>{8}, 1), 700 * std::pow(8, 0.3), 1e-9);
  EXPECT_GT(fit_power_product(x, y, error).exponents[0], 1.5) << "one amplitude";
  EXPECT_FALSE(fit_power_product({{1, 1, 2, 2}}, y, error, group).ok) << "no spread within a group";
}

}  // namespace
}  // namespace shakebed::fit
