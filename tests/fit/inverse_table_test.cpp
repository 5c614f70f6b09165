// Tables of curves whose inverse is known in closed form: logarithms, and straight lines into the octaves.
#include "fit/theory/inverse_table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace shakebed::fit {
namespace {

InverseTable::Piece logarithm(long double lowest, long double highest, long double divisor = 1) {
  return {lowest, highest, [divisor](long double density) { return std::log(density / divisor); },
          [](double) { return 1.0; }};
}

TEST(InverseTable, OfALogarithmIsTheExponential) {
  const InverseTable table({logarithm(0, std::exp(3.0L))});
  EXPECT_NEAR(table.largest_f(), 3, 1e-14);
  for (const double f : {-60.0, -40.0, -39.9, -20.3, -7.0, -0.1, 0.0, 0.24, 0.26, 1.0, 2.99, 3.0}) {
    const InverseTable::Point point = table.point(f);
    EXPECT_NEAR(point.density / std::exp(f), 1, 4e-16) << f;
    EXPECT_NEAR(point.slope / std::exp(f), 1, 1e-12) << f;
    EXPECT_EQ(table.density(f), point.density);
    if (f < -40) continue;
    EXPECT_NEAR(table.density(f, 1e-3) / std::exp(f + 1e-3), 1, f < 2.999 ? 5e-15 : 1e-12) << f;
  }
  // Beyond its end it is that of its end.
  EXPECT_EQ(table.density(3.5), table.density(table.largest_f()));
  EXPECT_EQ(table.point(99).density, table.density(table.largest_f()));
  EXPECT_EQ(table.point(99).slope, table.point(table.largest_f()).slope);
}

// Beyond 256 cells grow with F: quarters of octaves.
TEST(InverseTable, OfAStraightLineReachesIntoTheOctaves) {
  const InverseTable table(
      {{1.0L, 5000.0L, [](long double density) { return density; }, [](double density) { return density; }}});
  EXPECT_EQ(table.largest_f(), 5000);
  for (const double f :
       {1.0, 1.1, 17.3, 255.9, 256.0, 256.1, 319.9, 320.1, 511.0, 512.0, 513.0, 1000.0, 4095.0, 4096.5, 5000.0}) {
    EXPECT_NEAR(table.point(f).density / f, 1, 4e-16) << f;
    EXPECT_NEAR(table.point(f).slope, 1, 1e-10) << f;
  }
  // A quarter of F each up to 256, that is 1020 of them, then 17 quarters of octaves up to 5000.
  EXPECT_GE(table.size(), 1037U);
  EXPECT_LE(table.size(), 1100U);
}

// Where the density jumps, a piece ends and another begins at the same F.
TEST(InverseTable, OfTwoPiecesJumpsBetweenThem) {
  for (const double widest : {0.25, 0.6}) {
    const InverseTable table({logarithm(0, 1), logarithm(2, 8, 2)}, {widest, 1e-17});
    EXPECT_NEAR(table.largest_f(), std::log(4.0), 1e-15);
    for (const double f : {-30.0, -1.0, -0.01, 0.0}) EXPECT_NEAR(table.density(f) / std::exp(f), 1, 1e-15) << f;
    for (const double f : {1e-9, 0.01, 0.3, 0.61, 1.0, 1.38})
      EXPECT_NEAR(table.density(f) / (2 * std::exp(f)), 1, 1e-15) << f;
    EXPECT_NEAR(table.point(0.01).slope, 2 * std::exp(0.01), 1e-11);
  }
}

}  // namespace
}  // namespace shakebed::fit
