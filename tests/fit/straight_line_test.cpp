#include "fit/profile_fit/straight_line.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "fit/profile_fit/chances.hpp"

namespace shakebed::fit {
namespace {

// By hand: weights 1, 4, 1 at x = 0, 1, 2; sums S = 6, Sx = 6, Sxx = 8, Sy = 17, Sxy = 20;
// slope = (S Sxy - Sx Sy)/(S Sxx - Sx^2) = 18/12, intercept = (Sxx Sy - Sx Sxy)/12 = 16/12.
TEST(StraightLine, IsTheWeightedOneDoneByHand) {
  const std::vector<double> x{0, 1, 2}, y{1, 3, 4}, error{1, 0.5, 1};
  const StraightLine line = fit_straight_line(x, y, error);
  ASSERT_TRUE(line.ok);
  EXPECT_NEAR(line.slope, 1.5, 1e-14);
  EXPECT_NEAR(line.intercept, 4.0 / 3, 1e-14);
  EXPECT_NEAR(line.slope_error, std::sqrt(6.0 / 12), 1e-14);
  EXPECT_NEAR(line.intercept_error, std::sqrt(8.0 / 12), 1e-14);
  EXPECT_NEAR(line.covariance, -6.0 / 12, 1e-14);
  EXPECT_EQ(line.dof, 1);
  // Residuals -1/3, 1/6, -1/3.
  EXPECT_NEAR(line.chi2, 1.0 / 9 + 4.0 / 36 + 1.0 / 9, 1e-14);
}

TEST(StraightLine, NeedsTwoPlacesAndErrors) {
  EXPECT_FALSE(fit_straight_line(std::vector<double>{1, 1}, std::vector<double>{1, 2}, std::vector<double>{1, 1}).ok);
  EXPECT_FALSE(fit_straight_line(std::vector<double>{1}, std::vector<double>{1}, std::vector<double>{1}).ok);
  EXPECT_FALSE(fit_straight_line(std::vector<double>{1, 2}, std::vector<double>{1, 2}, std::vector<double>{1, 0}).ok);
}

// y = 0.3 + 2 x^1.7 exactly, every point 0.01 uncertain: chi2 is 0 there. The error of the exponent against the linear
// propagation, by hand for two unknowns (no offset): with y = A x^n, d = A x^n ln x, p = x^n,
// var(n) = sum p^2 / (sum d^2 sum p^2 - (sum d p)^2) sigma^2.
TEST(PowerLaw, FindsItsExponentAndError) {
  const std::vector<double> x{0.2, 0.5, 0.8, 1.1, 1.5}, error(5, 0.01);
  std::vector<double> y, without;
  double dd = 0, pp = 0, dp = 0;
  for (const double u : x) {
    const double p = std::pow(u, 1.7), d = 2 * p * std::log(u);
    y.push_back(0.3 + 2 * p), without.push_back(2 * p);
    dd += d * d, pp += p * p, dp += d * p;
  }
  const PowerLaw law = fit_power_law(x, y, error, true);
  ASSERT_TRUE(law.ok);
  EXPECT_NEAR(law.exponent, 1.7, 1e-6);
  EXPECT_NEAR(law.offset, 0.3, 1e-6);
  EXPECT_NEAR(law.amplitude, 2, 1e-6);
  EXPECT_NEAR(law.chi2, 0, 1e-6);
  EXPECT_EQ(law.dof, 2);
  const PowerLaw plain = fit_power_law(x, without, error, false);
  ASSERT_TRUE(plain.ok);
  EXPECT_NEAR(plain.exponent, 1.7, 1e-6);
  EXPECT_EQ(plain.offset, 0);
  EXPECT_NEAR(plain.exponent_error, 0.01 * std::sqrt(pp / (dd * pp - dp * dp)), 1e-5);
}

TEST(PowerLaw, SaysWhenThereIsNone) {
  const std::vector<double> x{1, 2, 3, 4}, error(4, 0.1);
  EXPECT_FALSE(fit_power_law(x, std::vector<double>{1, 1, 1, 1}, error, true).ok);   // any exponent
  EXPECT_FALSE(fit_power_law(x, std::vector<double>{4, 3, 2, 1}, error, false).ok);  // it falls: below 0.1
  EXPECT_FALSE(fit_power_law(std::vector<double>{0, 1, 2, 3}, x, error, true).ok);   // no power of 0
  EXPECT_FALSE(fit_given_power(std::vector<double>{1}, std::vector<double>{1}, std::vector<double>{1}, 2, true).ok);
}

// Twelve points that scatter by 4 % in turn, up and down, with stated errors of 1 % and of 0.5 %: what is stated of
// the exponent is by the scatter, the same for both. With errors of 100 % it is by them, proportional to them.
TEST(PowerLaw, WidensItsErrorWhereThePointsScatter) {
  std::vector<double> x, y;
  for (int i = 0; i < 12; ++i) {
    x.push_back(1 + 0.4 * i);
    y.push_back(2 * std::pow(x.back(), 1.5) * (i % 4 == 0 || i % 4 == 3 ? 1.04 : 0.96));
  }
  const auto at = [&](double relative) {
    std::vector<double> error;
    for (const double one : x) error.push_back(2 * relative * std::pow(one, 1.5));
    return fit_power_law(x, y, error, false);
  };
  const PowerLaw one = at(0.01), half = at(0.005), large = at(0.1), larger = at(0.2);
  ASSERT_TRUE(one.ok && half.ok && large.ok && larger.ok);
  EXPECT_NEAR(half.chi2 / one.chi2, 4, 1e-5);
  EXPECT_EQ(one.dof, 10);
  EXPECT_LT(one.p_value, 1e-10);
  EXPECT_NEAR(one.p_value, chance_of_chi2(one.chi2, 10), 1e-15);
  EXPECT_NEAR(half.exponent_error / one.exponent_error, 1, 2e-3);
  EXPECT_NEAR(larger.exponent_error / large.exponent_error, 2, 4e-2);
  EXPECT_GT(larger.p_value, 0.9);
  EXPECT_NEAR(one.exponent_error / large.exponent_error, std::sqrt(one.chi2 / 10) * 0.1, 2e-2);
}

// Exponents are looked for from 0.1 to 6, and the interval must close between them. With as many points as unknowns
// nothing is left to widen the error by.
TEST(PowerLaw, LooksForExponentsUpToSix) {
  const auto of = [](double exponent) {
    const std::vector<double> x{0.7, 0.8, 0.9, 1, 1.2};
    std::vector<double> y;
    for (const double one : x) y.push_back(std::pow(one, exponent));
    return fit_power_law(x, y, std::vector<double>(5, 0.001), false);
  };
  for (const double exponent : {0.2, 1.0, 3.33, 5.9}) {
    ASSERT_TRUE(of(exponent).ok) << exponent;
    EXPECT_NEAR(of(exponent).exponent, exponent, 1e-5);
  }
  EXPECT_FALSE(of(0.05).ok);
  EXPECT_FALSE(of(6.1).ok);
  const std::vector<double> two{1, 2}, three{1, 2, 3};
  const PowerLaw through = fit_power_law(two, std::vector<double>{1, 4}, std::vector<double>{0.1, 0.1}, false);
  ASSERT_TRUE(through.ok);
  EXPECT_EQ(through.dof, 0);
  EXPECT_EQ(through.p_value, 1);
  EXPECT_NEAR(through.exponent, 2, 1e-6);
  // The amplitude from 1, 0.1 uncertain, the exponent from the ratio: sqrt(0.1^2 + (0.1/4)^2)/ln 2.
  EXPECT_NEAR(through.exponent_error, std::hypot(0.1, 0.025) / std::log(2), 2e-3);
  EXPECT_FALSE(fit_power_law(two, two, std::vector<double>{1, 1}, true).ok) << "three unknowns";
  EXPECT_TRUE(fit_power_law(three, std::vector<double>{1.5, 4.5, 9.5}, std::vector<double>(3, 0.1), true).ok);
}

// A given power by hand: y = A x^2 through (1, 1) and (2, 5), equal errors: A = (1 + 20)/17.
TEST(PowerLaw, OfAGivenPowerIsDoneByHand) {
  const PowerLaw law =
      fit_given_power(std::vector<double>{1, 2}, std::vector<double>{1, 5}, std::vector<double>{0.5, 0.5}, 2, false);
  ASSERT_TRUE(law.ok);
  EXPECT_NEAR(law.amplitude, 21.0 / 17, 1e-14);
  EXPECT_EQ(law.dof, 1);
  EXPECT_NEAR(law.chi2, 4 * (std::pow(4.0 / 17, 2) + std::pow(1.0 / 17, 2)), 1e-13);
}

// chi2 of two degrees of freedom: exp(-chi2/2).
TEST(ChanceOfChi2, IsExponentialForTwoDegrees) {
  EXPECT_NEAR(chance_of_chi2(3, 2), std::exp(-1.5), 1e-14);
  EXPECT_EQ(chance_of_chi2(3, 0), 1);
  EXPECT_EQ(chance_of_chi2(INFINITY, 3), 0);
  EXPECT_NEAR(chi2_exceeded(0.05, 2), -2 * std::log(0.05), 1e-13);
}

// Student's t of one degree of freedom is Cauchy's distribution, of two a power; of many the normal one.
TEST(StudentQuantile, IsThatOfTheKnownCases) {
  EXPECT_NEAR(student_quantile(0.75, 1), 1, 1e-12);
  EXPECT_NEAR(student_quantile(0.975, 1), std::tan(0.475 * std::numbers::pi), 1e-10);
  EXPECT_NEAR(student_quantile(0.975, 2), 0.95 * std::sqrt(2 / (1 - 0.95 * 0.95)), 1e-12);
  EXPECT_NEAR(student_quantile(0.975, 1'000'000), normal_quantile(0.975), 1e-5);
}

}  // namespace
}  // namespace shakebed::fit
