// What a fit must not see: the unit of length, the size of the errors, the width of bins, a copy of the data.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "fit/profile_fit/fit_profile.hpp"
#include "tests/fit/synthetic.hpp"

namespace shakebed::fit {
namespace {

constexpr double known_temperature = 0.8, known_column = 12;

Profile measured(int bins, std::uint64_t seed) {
  const auto truth = HydrostaticProfile::of_column(enskog(), known_temperature, {known_column, 1.10});
  return synthetic::profile_of(truth, {KernelKind::gaussian, 0.4}, bins, 18, 0.01, seed);
}
FitOptions options_of(const char* model) {
  FitOptions options;
  options.model = model;
  options.plateau_density = 1.10;
  options.kernel = {KernelKind::gaussian, 0.4};
  options.sweep = options.compare = false;
  options.curve_points = 0;
  options.window.low = 2, options.window.high = 17;
  return options;
}

class EveryModel : public testing::TestWithParam<const char*> {};

// In another unit of length, s times as small, all lengths are s times as large, T/(m g) among them. Densities stay:
// they are counted in units of the disks.
TEST_P(EveryModel, DoesNotSeeTheUnitOfLength) {
  const Profile plain = measured(90, 1);
  const FitResult one = fit_profile(plain, options_of(GetParam()));
  ASSERT_TRUE(one.ok()) << one.message;
  for (const double s : {0.5, 3.0}) {
    Profile scaled = plain;
    for (double& height : scaled.height) height *= s;
    FitOptions options = options_of(GetParam());
    options.kernel.width *= s;
    options.window.low = 2 * s, options.window.high = 17 * s;
    options.base *= s;
    const FitResult other = fit_profile(scaled, options);
    ASSERT_TRUE(other.ok()) << other.message;
    EXPECT_NEAR(other.temperature.value, s * one.temperature.value, 1e-5 * s);
    EXPECT_NEAR(other.temperature.std_error / (s * one.temperature.std_error), 1, 1e-3);
    EXPECT_NEAR(other.shift.value, s * one.shift.value, 1e-5 * s);
    EXPECT_NEAR(other.shift.std_error / (s * one.shift.std_error), 1, 1e-3);
    EXPECT_NEAR(other.solid_height.value, s * one.solid_height.value, 1e-5 * s);
    EXPECT_NEAR(other.chi2 / one.chi2, 1, 1e-5);
    EXPECT_NEAR(other.temperature_interval.low, s * one.temperature_interval.low, 1e-3 * s);
    EXPECT_NEAR(other.temperature_interval.high, s * one.temperature_interval.high, 1e-3 * s);
  }
}

// All errors k times as large: the same T, its error k times as large, chi2 smaller by k^2.
TEST_P(EveryModel, HasErrorsInProportionToThoseOfTheData) {
  const Profile plain = measured(90, 2);
  const FitResult one = fit_profile(plain, options_of(GetParam()));
  ASSERT_TRUE(one.ok() && !one.errors_scaled) << one.message;
  for (const double k : {1.5, 4.0}) {
    Profile looser = plain;
    for (double& error : looser.std_error) error *= k;
    const FitResult other = fit_profile(looser, options_of(GetParam()));
    ASSERT_TRUE(other.ok()) << other.message;
    EXPECT_NEAR(other.temperature.value, one.temperature.value, 1e-5);
    EXPECT_NEAR(other.temperature.std_error / one.temperature.std_error, k, 1e-3 * k);
    EXPECT_NEAR(other.shift.std_error / one.shift.std_error, k, 1e-3 * k);
    EXPECT_NEAR(one.chi2 / other.chi2, k * k, 1e-4 * k * k);
    EXPECT_NEAR(other.covariance[1] / one.covariance[1], k * k, 1e-2 * k * k);
  }
}

// Without errors in the file they follow from the scatter about the curve: those of the parameters and of what follows
// from them are what equal errors of that size give.
TEST_P(EveryModel, HasTheErrorsOfItsScatterWhereNoneAreGiven) {
  Profile silent = measured(90, 6);
  silent.std_error.clear();
  const FitResult one = fit_profile(silent, options_of(GetParam()));
  ASSERT_TRUE(one.ok() && one.errors_scaled) << one.message;
  Profile stated = silent;
  double squares = 0.0;
  for (const Residual& r : one.residuals)
    if (r.used) squares += std::pow(r.density - r.model, 2);
  stated.std_error.assign(silent.height.size(), std::sqrt(squares / one.dof));
  const FitResult other = fit_profile(stated, options_of(GetParam()));
  ASSERT_TRUE(other.ok() && !other.errors_scaled) << other.message;
  EXPECT_NEAR(other.chi2_per_dof, 1.0, 1e-6);
  std::size_t compared = 0;
  for (const auto member :
       {&FitResult::temperature, &FitResult::shift, &FitResult::solid_height, &FitResult::column_number,
        &FitResult::critical_temperature, &FitResult::reduced_temperature}) {
    const Estimate &a = one.*member, &b = other.*member;
    EXPECT_NEAR(a.value, b.value, 1e-6);
    if (!(b.std_error > 0.0)) continue;
    EXPECT_NEAR(a.std_error / b.std_error, 1.0, 1e-3);
    ++compared;
  }
  EXPECT_GE(compared, 4U);
}

// Each row twice with errors larger by the root of two says the same.
TEST_P(EveryModel, DoesNotSeeThatARowIsTheMeanOfTwo) {
  const Profile plain = measured(90, 3);
  const FitResult one = fit_profile(plain, options_of(GetParam()));
  Profile twice;
  for (std::size_t i = 0; i < plain.height.size(); ++i) {
    for (int copy = 0; copy < 2; ++copy) {
      twice.height.push_back(plain.height[i]), twice.number_density.push_back(plain.number_density[i]);
      twice.std_error.push_back(plain.std_error[i] * std::sqrt(2.0));
    }
  }
  const FitResult other = fit_profile(twice, options_of(GetParam()));
  ASSERT_TRUE(one.ok() && other.ok());
  EXPECT_NEAR(other.temperature.value, one.temperature.value, 1e-5);
  EXPECT_NEAR(other.temperature.std_error / one.temperature.std_error, 1, 0.02);
  EXPECT_NEAR(other.chi2 / one.chi2, 1, 1e-3);
}

// Bins twice as wide, each the mean of two: T stays within a small part of its error, and so does the error.
TEST_P(EveryModel, HardlySeesTheWidthOfBins) {
  const Profile fine = measured(180, 4);
  const FitResult one = fit_profile(fine, options_of(GetParam()));
  Profile coarse;
  for (std::size_t i = 0; i + 1 < fine.height.size(); i += 2) {
    coarse.height.push_back(0.5 * (fine.height[i] + fine.height[i + 1]));
    const double a = std::pow(fine.std_error[i], -2), b = std::pow(fine.std_error[i + 1], -2);
    coarse.number_density.push_back((a * fine.number_density[i] + b * fine.number_density[i + 1]) / (a + b));
    coarse.std_error.push_back(1 / std::sqrt(a + b));
  }
  const FitResult other = fit_profile(coarse, options_of(GetParam()));
  ASSERT_TRUE(one.ok() && other.ok());
  EXPECT_NEAR(other.temperature.value, one.temperature.value, 0.5 * one.temperature.std_error);
  EXPECT_NEAR(other.shift.value, one.shift.value, 0.5 * one.shift.std_error);
  EXPECT_NEAR(other.temperature.std_error / one.temperature.std_error, 1, 0.1);
}

// A profile lifted by h, with a base lifted as much, has its shift lifted and nothing else.
TEST(EnskogRectangle, DoesNotSeeTheOriginOfHeights) {
  const Profile plain = measured(90, 5);
  const FitResult one = fit_profile(plain, options_of("enskog-rectangle"));
  Profile lifted = plain;
  for (double& height : lifted.height) height += 2.5;
  FitOptions options = options_of("enskog-rectangle");
  options.window.low = 4.5, options.window.high = 19.5, options.base += 2.5;
  const FitResult other = fit_profile(lifted, options);
  ASSERT_TRUE(one.ok() && other.ok());
  EXPECT_NEAR(other.temperature.value, one.temperature.value, 1e-5);
  EXPECT_NEAR(other.shift.value, one.shift.value + 2.5, 1e-5);
  EXPECT_NEAR(other.solid_height.value, one.solid_height.value, 1e-5);
}

INSTANTIATE_TEST_SUITE_P(Models, EveryModel, testing::Values("enskog-rectangle", "hydrostatic:enskog"),
                         [](const testing::TestParamInfo<const char*>& given) {
                           std::string name = given.param;
                           std::erase_if(name, [](char c) { return c == '-' || c == ':'; });
                           return name;
                         });

}  // namespace
}  // namespace shakebed::fit
