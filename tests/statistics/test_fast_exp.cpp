#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "statistics/fast_exp.hpp"

namespace shakebed {
namespace {

TEST(FastExp, IsTheExponentialToTwoUnitsInTheLastPlace) {
  EXPECT_EQ(fast_exp(0), 1);
  for (int k = 0; k < 100'000; ++k) {
    const double x = -699.0 * k * k / 1e10 - 1e-6 * k;
    EXPECT_NEAR(fast_exp(x) / std::exp(x), 1, 2 * std::numeric_limits<double>::epsilon()) << x;
  }
}

}  // namespace
}  // namespace shakebed
