#include "fit/straight_line.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

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

// chi2 of two degrees of freedom: exp(-chi2/2).
TEST(ChanceOfChi2, IsExponentialForTwoDegrees) {
  EXPECT_NEAR(chance_of_chi2(3, 2), std::exp(-1.5), 1e-14);
  EXPECT_EQ(chance_of_chi2(3, 0), 1);
}

}  // namespace
}  // namespace shakebed::fit
