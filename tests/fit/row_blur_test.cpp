// The rows of a crystal, blurred away.
#include "fit/profile_fit/row_blur.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "statistics/kernel.hpp"

namespace shakebed::fit {
namespace {

// A density of 0.7 per D^2 with errors of 0.1, at so many heights from `first` on [D].
Profile flat(int count, double first, double spacing) {
  Profile profile;
  for (int i = 0; i < count; ++i) profile.height.push_back(first + spacing * i);
  profile.number_density.assign(profile.height.size(), 0.7);
  profile.std_error.assign(profile.height.size(), 0.1);
  return profile;
}

TEST(RowBlur, GivesTheKernelAndTheErrorsOfWhatItMadeOfTheProfile) {
  // White noise of 0.1 every 0.1 D on a flat density of 0.7, at points. Blurred by 0.5 D its variance is that times
  // 0.1/(2 sqrt(pi) 0.5), and neighbours d apart are correlated by exp(-d^2/(4 0.25)).
  const Profile profile = flat(200, 0.05, 0.1);
  const BlurredProfile blurred = blur_rows(profile, {}, 0.0);
  EXPECT_EQ(blurred.kernel.kind, KernelKind::gaussian);
  EXPECT_EQ(blurred.kernel.width, 0.5);
  EXPECT_NEAR(blurred.rows_seen, std::exp(-2.0 * std::pow(3.14159265358979 * 0.5 / 0.8660254, 2)), 1e-6);
  ASSERT_EQ(blurred.profile.height.size(), 200U);
  EXPECT_NEAR(blurred.profile.number_density[100], 0.7, 1e-4);
  EXPECT_NEAR(blurred.profile.number_density[0], 0.7 * kernel_cumulative({KernelKind::gaussian, 0.5}, 0.05), 1e-2);
  const double variance = 0.01 * 0.1 / (2.0 * std::sqrt(3.14159265358979) * 0.5);
  EXPECT_NEAR(blurred.profile.std_error[100] / std::sqrt(variance), 1.0, 1e-3);
  EXPECT_NEAR(blurred.profile.covariance[100 * 200 + 107] / variance, std::exp(-0.49), 1e-3);
}

// What a kernel lacks of the variance 0.25 D^2 is blurred into the profile, whatever its form; and what it leaves of a
// crystal's rows is its Fourier transform at their distance. Both are integrals over the kernel, summed here.
TEST(RowBlur, GoesByTheMomentsOfTheKernel) {
  const Profile profile = flat(200, 0.05, 0.1);
  Profile bare = profile;  // without errors it is left as it is
  bare.std_error.clear();
  for (const Kernel& kernel : {Kernel{KernelKind::gaussian, 0.2}, Kernel{KernelKind::top_hat, 1.0},
                               Kernel{KernelKind::disk_chord, 1.0}, Kernel{KernelKind::disk_chord, 0.4}}) {
    double variance = 0, wave = 0;
    constexpr int steps = 200'000;
    for (int i = 0; i < steps; ++i) {
      const double x = 1.5 * (2 * (i + 0.5) / steps - 1), weight = kernel_density(kernel, x) * 3 / steps;
      variance += weight * x * x;
      wave += weight * std::cos(2 * std::numbers::pi * x / (std::numbers::sqrt3 / 2));
    }
    EXPECT_NEAR(blur_rows(bare, kernel, 0.0).rows_seen, std::abs(wave), 1e-4) << to_string(kernel.kind);
    const BlurredProfile blurred = blur_rows(profile, kernel, 0.0);
    EXPECT_EQ(blurred.kernel.width, 0.5);
    const double by = std::sqrt(0.25 - variance), of_noise = 0.01 * 0.1 / (2 * std::sqrt(std::numbers::pi) * by);
    EXPECT_NEAR(blurred.profile.std_error[100] / std::sqrt(of_noise), 1, 1e-3) << to_string(kernel.kind);
    EXPECT_NEAR(blurred.profile.covariance[100 * 200 + 105] / of_noise, std::exp(-0.25 / (4 * by * by)), 1e-3);
  }
}

// Heights that are not evenly spaced own half the way to either neighbour: a density that does not change stays, and
// one that rises evenly does, far from both ends.
TEST(RowBlur, KeepsAStraightLineAtUnevenHeights) {
  Profile profile;
  double height = 0;
  for (int i = 0; i < 120; ++i) {
    height += i < 60 ? 0.25 : 0.1;
    profile.height.push_back(height);
    profile.number_density.push_back(0.2 + 0.05 * height);
    profile.std_error.push_back(0.1);
  }
  const BlurredProfile blurred = blur_rows(profile, {}, 0.0);
  EXPECT_EQ(blurred.kernel.width, 0.5);
  for (std::size_t i = 10; i < 98; ++i)
    EXPECT_NEAR(blurred.profile.number_density[i] / profile.number_density[i], 1, 0.01) << i;
}

// The last height owns as much above it as below, and the one before it half of both of its spacings.
TEST(RowBlur, SharesOutTheLastHeights) {
  Profile profile = flat(40, 0.05, 0.1);
  profile.height.back() += 0.1;
  const BlurredProfile blurred = blur_rows(profile, {}, 0.0);
  for (std::size_t i = 35; i < 40; ++i) {
    double expected = 0;
    for (std::size_t j = 0; j < 40; ++j) {
      const double away = (profile.height[i] - profile.height[j]) / 0.5;
      const double owned = j == 39 ? 0.2 : j == 38 ? 0.15 : 0.1;
      expected += 0.7 * owned * std::exp(-away * away / 2) / (0.5 * std::sqrt(2 * std::numbers::pi));
    }
    EXPECT_NEAR(blurred.profile.number_density[i], expected, 3e-5) << i;  // the blur ends at 4 widths
  }
}

// Samples behind a covariance stay; errors of single heights count as of as many samples as there are heights. What is
// common to all heights stays common to them.
TEST(RowBlur, KeepsTheSamplesOfACovariance) {
  Profile profile = flat(60, 0, 0.25);
  EXPECT_EQ(blur_rows(profile, {}, 0.0).profile.covariance_samples, 60);
  profile.covariance.assign(3600, 0.04);
  profile.covariance_samples = 33;
  const BlurredProfile blurred = blur_rows(profile, {}, 0.0);
  EXPECT_EQ(blurred.profile.covariance_samples, 33);
  EXPECT_NEAR(blurred.profile.std_error[30], 0.2, 1e-3) << "of the covariance, not of the errors beside it";
  EXPECT_NEAR(blurred.profile.covariance[30 * 60 + 22], 0.04, 1e-3);
  profile.covariance_samples = 0;
  EXPECT_EQ(blur_rows(profile, {}, 0.0).profile.covariance_samples, 60);
}

// Up to one diameter above the lower edge a profile is taken for whole. From there on what its first heights lack is
// left out, and their covariance with the others, too: four widths of the blur, eight heights of a quarter each.
TEST(RowBlur, LeavesOutTheHeightsBesideACut) {
  Profile profile = flat(50, 1.0, 0.25);
  for (std::size_t i = 0; i < 50; ++i) profile.std_error[i] = 0.1 + 0.002 * static_cast<double>(i);
  const Profile whole = blur_rows(profile, {}, 0.0).profile, cut = blur_rows(profile, {}, -0.01).profile;
  ASSERT_EQ(whole.height.size(), 50U);
  ASSERT_EQ(cut.height.size(), 42U);
  ASSERT_EQ(cut.covariance.size(), 42U * 42U);
  for (std::size_t i = 0; i < 42; ++i) {
    EXPECT_EQ(cut.height[i], whole.height[i + 8]);
    EXPECT_EQ(cut.number_density[i], whole.number_density[i + 8]);
    EXPECT_EQ(cut.std_error[i], whole.std_error[i + 8]);
    for (std::size_t j = 0; j < 42; ++j) EXPECT_EQ(cut.covariance[i * 42 + j], whole.covariance[(i + 8) * 50 + j + 8]);
  }
}

TEST(RowBlur, LeavesAloneWhatItMustNotTouch) {
  const Profile profile = flat(50, 0, 0.25);
  const Kernel wide{KernelKind::gaussian, 0.5};
  EXPECT_EQ(blur_rows(profile, wide, 0.0).profile.number_density, profile.number_density);
  EXPECT_EQ(blur_rows(profile, wide, 0.0).kernel.width, 0.5);
  Profile coarse = profile;  // heights 1 D apart cannot be blurred by 0.5 D
  for (double& height : coarse.height) height *= 4.0;
  EXPECT_EQ(blur_rows(coarse, {}, 0.0).kernel.kind, KernelKind::none);
  EXPECT_EQ(blur_rows(coarse, {}, 0.0).rows_seen, 1.0);
  Profile two = profile;  // no rows to speak of
  for (std::vector<double>* values : {&two.height, &two.number_density, &two.std_error}) values->resize(2);
  EXPECT_EQ(blur_rows(two, {}, 0.0).kernel.kind, KernelKind::none);
  for (std::vector<double>* values : {&two.height, &two.number_density, &two.std_error})
    values->push_back(values == &two.height ? 0.5 : values->back());
  EXPECT_EQ(blur_rows(two, {}, 0.0).kernel.kind, KernelKind::gaussian) << "three";
  Profile bare = profile;
  bare.std_error.clear();
  EXPECT_EQ(blur_rows(bare, {}, 0.0).profile.number_density, bare.number_density);
  Profile broken = profile;  // to be refused with its place, not blurred
  broken.std_error[3] = -0.1;
  EXPECT_EQ(blur_rows(broken, {}, 0.0).profile.std_error, broken.std_error);
  // A profile that begins in the middle of a bed loses the heights that lack what lies below.
  EXPECT_NEAR(blur_rows(profile, {}, -5.0).profile.height.front(), 2.0, 1e-12);
}

}  // namespace
}  // namespace shakebed::fit
