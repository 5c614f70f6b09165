// A law's verdict, printed whether it holds or not: figure, error, what is asked.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

namespace shakebed::tests {

// |figure - expected| <= limit.
inline void expect_law(const char* name, double figure, double std_error, double expected, double limit) {
  std::printf("  %-58s %.6g +- %.2g, expected %.6g +- %.2g\n", name, figure, std_error, expected, limit);
  std::fflush(stdout);
  EXPECT_LE(std::abs(figure - expected), limit) << name;
}

}  // namespace shakebed::tests
