// What hard side walls take from the density of a bed.
#include "fit/profile_fit/side_walls.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace shakebed::fit {
namespace {

// Of scaled-particle theory, temperature 1 [Helfand1961].
double packing(double density) { return std::numbers::pi * density / 4; }
double pressure(double density) { return density / std::pow(1 - packing(density), 2); }
double line_tension(double density) { return density / (2 * (1 - packing(density))); }

TEST(SideWalls, TakeWhatGibbsAdsorptionSays) {
  // Disks per length of one wall: -d(tension)/d(chemical potential), where d(pressure) = n d(chemical potential).
  for (const double density : {0.01, 0.2, 0.5, 0.8}) {
    const double step = 1e-5;
    const double adsorbed = -density * (line_tension(density + step) - line_tension(density - step)) /
                            (pressure(density + step) - pressure(density - step));
    for (const double width : {8.0, 30.0}) {
      const double averaged = density + 2 * adsorbed / width;
      EXPECT_NEAR(density_far_from_walls(averaged, width), density, 1e-8) << density << " " << width;
    }
  }
}

TEST(SideWalls, KeepAThinGasHalfADiameterAway) {
  for (const double width : {3.0, 20.0})
    EXPECT_NEAR(density_far_from_walls(1e-9 * (width - 1) / width, width), 1e-9, 1e-17);
}

TEST(SideWalls, TakeNothingFromDisksInContact) {
  EXPECT_DOUBLE_EQ(density_far_from_walls(1.5, 10), 1.5);
  EXPECT_DOUBLE_EQ(density_far_from_walls(0, 10), 0);
}

TEST(SideWalls, ChangeErrorsAsDensitiesAndKeepTheNumberOfDisks) {
  const double width = 12, low = 0.3, high = 0.6;
  Profile profile{{0, 1, 2}, {low, high, low}, {0.01, 0.02, 0.03}, {1, 2, 3, 2, 5, 6, 3, 6, 9}, 7};
  std::optional<double> column = 0.9;  // 0.3/2 + 0.6 + 0.3/2
  take_far_from_walls(profile, width, column);
  const double far_low = density_far_from_walls(low, width), far_high = density_far_from_walls(high, width);
  EXPECT_DOUBLE_EQ(profile.number_density[0], far_low);
  EXPECT_DOUBLE_EQ(profile.number_density[1], far_high);
  EXPECT_NEAR(*column, far_low + far_high, 1e-14);
  const auto slope = [&](double averaged) {
    return (density_far_from_walls(averaged + 1e-6, width) - density_far_from_walls(averaged - 1e-6, width)) / 2e-6;
  };
  EXPECT_NEAR(profile.std_error[1], 0.02 * slope(high), 1e-10);
  EXPECT_NEAR(profile.std_error[2], 0.03 * slope(low), 1e-10);
  EXPECT_NEAR(profile.covariance[1], 2 * slope(low) * slope(high), 1e-8);
  EXPECT_NEAR(profile.covariance[4], 5 * slope(high) * slope(high), 1e-8);
  EXPECT_EQ(profile.covariance_samples, 7);
}

// Walls that leave no room for a disk, and profiles that are no profiles, are left as they are: fits say what is wrong.
// Without errors there are none to change.
TEST(SideWalls, LeaveAloneWhatIsNoProfile) {
  const Profile plain{{0, 1, 2}, {0.3, 0.6, 0.3}, {0.01, 0.02}, {}, 0};
  std::optional<double> column = 1.0;
  for (const double width : {0.5, 1.0}) {
    Profile same = plain;
    take_far_from_walls(same, width, column);
    EXPECT_EQ(same.number_density, plain.number_density) << width;
  }
  Profile broken = plain;
  broken.height.pop_back();
  take_far_from_walls(broken, 10, column);
  EXPECT_EQ(broken.number_density, plain.number_density);
  EXPECT_EQ(column, 1.0);
  Profile changed = plain;
  std::optional<double> none;
  take_far_from_walls(changed, 10, none);
  EXPECT_GT(changed.number_density[0], 0.3);
  EXPECT_NE(changed.std_error[1], 0.02);
  EXPECT_EQ(changed.std_error.size(), 2U);
  EXPECT_TRUE(changed.covariance.empty());
  EXPECT_FALSE(none);
  // Nothing under the curve: the number of disks is as given.
  Profile empty{{0, 1, 2}, {0, 0, 0}, {}, {}, 0};
  take_far_from_walls(empty, 10, column);
  EXPECT_EQ(column, 1.0);
  // The area is that of trapezia between heights that are not evenly spaced: 0.3, then 2 (0.3 + 0.6)/2, then 0.45.
  Profile uneven{{0, 1, 3, 4}, {0.3, 0.3, 0.6, 0.3}, {}, {}, 0};
  std::optional<double> uneven_column = 0.3 + 0.9 + 0.45;
  take_far_from_walls(uneven, 10, uneven_column);
  const double low = density_far_from_walls(0.3, 10), high = density_far_from_walls(0.6, 10);
  EXPECT_NEAR(*uneven_column, low + (low + high) + 0.5 * (low + high), 1e-13);
}

}  // namespace
}  // namespace shakebed::fit
