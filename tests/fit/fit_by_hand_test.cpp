// Parts of a fit on profiles of a few heights, by pencil: what is measured of a profile, windows, weights, warnings,
// objections, sweeps, texts; maps and libraries on which interpolation is exact.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <tuple>
#include <vector>

#include "fit/inference/posterior.hpp"
#include "fit/map/empirical_map.hpp"
#include "fit/profile_fit/fit_warnings.hpp"
#include "fit/profile_fit/measured_profile.hpp"
#include "fit/profile_fit/objections.hpp"
#include "fit/profile_fit/simulated_profiles.hpp"
#include "fit/profile_fit/window.hpp"
#include "tests/fit/synthetic.hpp"

namespace shakebed::fit::by_hand {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

MeasuredProfile measured_of(const Profile& profile, FitResult& result) {
  MeasuredProfile measured;
  EXPECT_EQ(measure_profile(profile, measured, result), FitStatus::ok) << result.message;
  return measured;
}

// ---------------------------------------------------------------------------------------------------------------------
// what is measured of a profile

// Each height owns half the way to its neighbours, the ends their whole gap; two densities at one height share theirs.
TEST(MeasuredByHand, HasItsAreaAndItsMeansOverADiameter) {
  Profile profile;
  profile.height = {0, 0.5, 1, 1, 2, 4};
  profile.number_density = {1, 0.8, 0.6, 0.4, 0.2, 0.1};
  profile.std_error = {0.1, 0.1, 0.1, 0.1, 0.1, 0.1};
  FitResult result;
  const MeasuredProfile measured = measured_of(profile, result);
  EXPECT_NEAR(measured.area, 1 * 0.5 + 0.8 * 0.5 + 0.5 * 0.75 + 0.2 * 1.5 + 0.1 * 2, 1e-15);
  EXPECT_EQ(result.area, measured.area);
  EXPECT_EQ(measured.spacing, 0.75) << "of the gaps 0.5, 0.5, 1 and 2";
  const std::vector<double> means{0.9, 0.7, 0.6, 0.6, 0.2, 0.1};  // heights within half a diameter
  for (std::size_t i = 0; i < means.size(); ++i) EXPECT_NEAR(measured.one_diameter_mean[i], means[i], 1e-15) << i;
  EXPECT_THAT(result.warnings, ElementsAre(HasSubstr("1 bin repeats")));
}

// Of the errors 0.1, 0.3, 0.2 and 0.6 the median is 0.25: it stands in where a density has none. An empty height
// without an error is left out.
TEST(MeasuredByHand, HasTheMedianErrorWhereNoneIsGiven) {
  Profile profile;
  profile.height = {0, 1, 2, 3, 4, 5, 6, 7};
  profile.number_density = {1, 0.8, 0.6, 0.4, 0.2, -0.1, 0, -0.05};
  profile.std_error = {0.1, 0.3, 0, 0.2, 0.6, 1e-14, 0, 0};
  FitResult result;
  const MeasuredProfile measured = measured_of(profile, result);
  EXPECT_TRUE(measured.errors_known);
  EXPECT_THAT(measured.error, ElementsAre(0.1, 0.3, 0.25, 0.2, 0.6, 0.25, 0.25, 0.25));
  EXPECT_THAT(measured.usable, ElementsAre(true, true, true, true, true, true, false, true));
  EXPECT_THAT(result.warnings,
              ElementsAre("3 bins have a density but no standard error; the median error, 0.25, was used there",
                          "2 bins have a negative density; no density was changed"));
}

// The covariance gives the errors, follows the order of the heights, and may be off symmetry by rounding alone.
TEST(MeasuredByHand, SortsItsCovarianceWithItsHeights) {
  Profile profile;
  profile.height = {2, 0, 1};
  profile.number_density = {0.2, 1, 0.6};
  profile.std_error = {9, 9, 9};
  profile.covariance = {0.04, 0.01, 0.02, 0.01, 0.09, 0.03, 0.02, 0.03, 0.16};
  profile.covariance_samples = 31;
  FitResult result;
  const MeasuredProfile measured = measured_of(profile, result);
  EXPECT_THAT(measured.height, ElementsAre(0, 1, 2));
  EXPECT_THAT(measured.density, ElementsAre(1, 0.6, 0.2));
  EXPECT_THAT(measured.error, ElementsAre(0.3, 0.4, 0.2));
  EXPECT_EQ(measured.covariance_samples, 31);
  const double expected[3][3] = {{0.09, 0.03, 0.01}, {0.03, 0.16, 0.02}, {0.01, 0.02, 0.04}};
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j) EXPECT_NEAR(measured.covariance(i, j), expected[i][j], 1e-16);
  const auto message_with = [&](std::size_t place, double entry) {
    Profile other = profile;
    other.covariance[place] = entry;
    MeasuredProfile ignored;
    FitResult said;
    return measure_profile(other, ignored, said) == FitStatus::ok ? std::string() : said.message;
  };
  EXPECT_EQ(message_with(1, 0.01 + 0.9e-6 * 0.06), "");
  EXPECT_EQ(message_with(1, 0.01 + 1.1e-6 * 0.06), "the covariance is not symmetric between bins 0 and 1");
  EXPECT_EQ(message_with(8, 0.09), "");
  EXPECT_EQ(message_with(8, 0.0099), "the covariance has a correlation outside -1 to 1 between bins 0 and 2");
  EXPECT_EQ(message_with(4, -0.01), "the covariance has a negative variance in bin 1");
  EXPECT_EQ(message_with(4, std::nan("")), "the covariance has an entry that is not a finite number");
}

// ---------------------------------------------------------------------------------------------------------------------
// windows and weights

// Densities at every diameter, so that means over a diameter are the densities.
Profile stairs(std::vector<double> density, double error) {
  Profile profile;
  for (std::size_t i = 0; i < density.size(); ++i) profile.height.push_back(static_cast<double>(i));
  profile.std_error.assign(density.size(), error);
  profile.number_density = std::move(density);
  return profile;
}
Window window_of(const Profile& profile, const FitOptions& options) {
  FitResult ignored;
  MeasuredProfile measured = measured_of(profile, ignored);
  return choose_window(measured, options);
}

TEST(WindowByHand, BeginsAtThePlateauAndEndsInTheNoise) {
  const std::vector<double> densities{1.3, 0.5, 0.94, 0.96, 1, 0.7, 0.6, 0.5, 0.1, 0.006, 0.004, 0.003, 0};
  const Profile bed = stairs(densities, 0.001);
  FitOptions options;
  Window window = window_of(bed, options);
  EXPECT_EQ(window.low, 3) << "95 % of the greatest density above 1.5 D";
  EXPECT_EQ(window.high, 9) << "0.5 % of it";
  EXPECT_EQ(window.rule,
            "from 3 D, the lowest height above 1.5 D (without the floor layers and the reach of the kernel) where the "
            "density averaged over one diameter reaches 95 % of its greatest value, up to 9 D, the last before the "
            "density falls below 0.5 % of its greatest value or 4 standard errors");
  EXPECT_EQ(window_of(stairs(densities, 0.026), options).high, 7) << "0.1 is less than four errors";
  EXPECT_EQ(window_of(stairs(densities, 0.024), options).high, 8) << "0.1 is more";
  options.base = 2.6;  // above 4.1 D: the greatest density there is 0.7
  EXPECT_EQ(window_of(bed, options).low, 5);
  options.base = 0;
  options.kernel = {KernelKind::gaussian, 0.4};  // reaches 2.6 D
  EXPECT_EQ(window_of(bed, options).low, 5) << "4.1 D again";
  options.kernel.width = 5;  // 3 D of its reach count
  EXPECT_EQ(window_of(bed, options).low, 5) << "4.5 D";
  options.kernel = {};
  options.window.below_density = 0.65;
  EXPECT_EQ(window_of(bed, options).low, 6);
  EXPECT_THAT(window_of(bed, options).rule,
              HasSubstr("from 6 D, above which the density averaged over one diameter stays below 0.65,"));
  options.window.below_density = 0.55;
  EXPECT_EQ(window_of(bed, options).low, 7);
  options.window.low = 2.5, options.window.high = 7.5;
  EXPECT_EQ(window_of(bed, options).rule, "from the given height 2.5 D, up to the given height 7.5 D");
}

// A bed that ends in a cliff: 0.8 of the greatest density is left 1.5 D below the last height that holds something.
TEST(WindowByHand, LooksOverACliff) {
  Profile bed;
  for (int i = 0; i < 40; ++i) {
    bed.height.push_back(0.25 * i);
    bed.number_density.push_back(i <= 24 ? 1 : 0);  // up to 6 D
    bed.std_error.push_back(i <= 24 ? 0.01 : 0);
  }
  // Means over a diameter fall to 0.4, 0.2 and 0 at 6.25, 6.5 and 6.75 D: the last one that is known is 6.5 D.
  FitResult ignored;
  MeasuredProfile measured = measured_of(bed, ignored);
  const Window window = choose_window(measured, {});
  EXPECT_EQ(window.high, 7.5) << "one diameter beyond 6.5 D";
  for (std::size_t i = 0; i < 40; ++i) EXPECT_EQ(measured.usable[i], bed.height[i] <= 7.5) << i;
  EXPECT_EQ(count_bins(measured, {6, 7.5, ""}), 7U);
  EXPECT_EQ(count_bins(measured, {6, 9, ""}), 7U) << "what is beyond is empty and without an error";
}

MeasuredProfile with_covariance(const std::vector<double>& sigma, double correlation, int samples) {
  MeasuredProfile measured;
  const auto n = static_cast<Eigen::Index>(sigma.size());
  measured.covariance.resize(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    measured.height.push_back(static_cast<double>(i)), measured.density.push_back(1);
    measured.error.push_back(sigma[static_cast<std::size_t>(i)]), measured.usable.push_back(true);
    for (Eigen::Index j = 0; j < n; ++j)
      measured.covariance(i, j) = sigma[static_cast<std::size_t>(i)] * sigma[static_cast<std::size_t>(j)] *
                                  std::pow(correlation, std::abs(static_cast<double>(i - j)));
  }
  measured.covariance_samples = samples;
  return measured;
}

// Four heights: (m - 6)/(m - 1) is a half for 11 samples. From there on the fit weighs by the covariance, shrunk by
// Chen's formula: ((1 - 2/n) t + n^2)/((m + 1 - 2/n) (t - n)), t the sum of all squared correlations.
TEST(WeightsByHand, OfACovarianceAreShrunkByTheirSamples) {
  const std::vector<double> sigma{1, 2, 4, 8};
  for (const int samples : {11, 50}) {
    const MeasuredProfile measured = with_covariance(sigma, 0.5, samples);
    FitResult result;
    const Bins bins = bins_of(measured, {0, 9, ""}, &result);
    EXPECT_TRUE(result.warnings.empty());
    const double t = 4 + 2 * (3 * 0.25 + 2 * 0.0625 + 0.015625);
    const double shrinkage = (0.5 * t + 16) / ((samples + 0.5) * (t - 4));
    ASSERT_EQ(bins.whitening.rows(), 4);
    const Eigen::MatrixXd used = bins.whitening * bins.whitening.transpose();
    const double kept = 1 - std::min(1.0, shrinkage);
    for (Eigen::Index i = 0; i < 4; ++i) {
      for (Eigen::Index j = 0; j < 4; ++j) {
        const double expected = measured.covariance(i, j) * (i == j ? 1 : kept);
        EXPECT_NEAR(used(i, j), expected, 1e-12) << samples << i << j;
      }
    }
    // What is left of the correlations once they are weighed: L R L^T is the covariance again.
    const Eigen::MatrixXd back = bins.whitening * bins.correlation * bins.whitening.transpose();
    EXPECT_LT((back - measured.covariance).norm(), 1e-11);
    // An error of the model of 0.5 in every bin is taken out of it.
    const Bins without = with_measured_errors(bins, 0.5);
    const Eigen::MatrixXd rest = bins.whitening * without.correlation * bins.whitening.transpose();
    EXPECT_LT((rest - measured.covariance + 0.25 * Eigen::MatrixXd::Identity(4, 4)).norm(), 1e-11);
  }
}

// With 10 samples they are too few: errors count, each the geometric mean of itself and its neighbours (a quarter of
// the window, one height, on either side).
TEST(WeightsByHand, OfFewSamplesAreSmoothErrors) {
  const MeasuredProfile measured = with_covariance({1, 2, 4, 64}, 0.5, 10);
  FitResult result;
  const Bins bins = bins_of(measured, {0, 9, ""}, &result);
  EXPECT_THAT(
      result.warnings,
      ElementsAre("Only 10 independent samples for 4 heights: the fit ignores correlations between heights (its "
                  "errors include them)."));
  EXPECT_EQ(bins.whitening.size(), 0);
  const std::vector<double> smooth{std::sqrt(2.0), 2, 8, 16};
  for (Eigen::Index i = 0; i < 4; ++i) {
    EXPECT_NEAR(bins.inverse_error[static_cast<std::size_t>(i)], 1 / smooth[static_cast<std::size_t>(i)], 1e-14);
    for (Eigen::Index j = 0; j < 4; ++j)
      EXPECT_NEAR(bins.correlation(i, j),
                  measured.covariance(i, j) / smooth[static_cast<std::size_t>(i)] / smooth[static_cast<std::size_t>(j)],
                  1e-13);
  }
  const Bins without = with_measured_errors(bins, 0.5);
  EXPECT_NEAR(without.correlation(2, 2), bins.correlation(2, 2) - 0.25 / 64, 1e-14);
  EXPECT_NEAR(without.correlation(1, 2), bins.correlation(1, 2), 1e-14);
  // Twelve heights: three on either side.
  const Bins more = bins_of(with_covariance({1, 1, 1, 1, 128, 1, 1, 1, 1, 1, 1, 1}, 0, 3), {0, 20, ""}, nullptr);
  EXPECT_NEAR(more.inverse_error[0], 1, 1e-14);
  EXPECT_NEAR(more.inverse_error[1], std::pow(128, -0.2), 1e-14) << "of five heights";
  EXPECT_NEAR(more.inverse_error[3], 0.5, 1e-14) << "the seventh root of 128";
  EXPECT_NEAR(more.inverse_error[7], 0.5, 1e-14);
  EXPECT_NEAR(more.inverse_error[8], 1, 1e-14);
}

// Correlations of 0.9, -0.9 and 0.9 between three heights contradict one another: the matrix is positive definite only
// where each is below 5/9 of itself. All are reduced alike, and not by much more than is needed.
TEST(WeightsByHand, OfAnImpossibleCovarianceAreReduced) {
  MeasuredProfile measured = with_covariance({1, 2, 4}, 0, 0);
  const double correlation[3][3] = {{1, 0.9, -0.9}, {0.9, 1, 0.9}, {-0.9, 0.9, 1}};
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j)
      measured.covariance(i, j) =
          correlation[i][j] * measured.error[static_cast<std::size_t>(i)] * measured.error[static_cast<std::size_t>(j)];
  FitResult result;
  const Bins bins = bins_of(measured, {0, 9, ""}, &result);
  const Eigen::MatrixXd used = bins.whitening * bins.whitening.transpose();
  const double kept = used(0, 1) / measured.covariance(0, 1);
  EXPECT_LT(kept, 5.0 / 9);
  EXPECT_GT(kept, 1 - 1.5 * 4.0 / 9) << "within half of what is needed";
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j)
      EXPECT_NEAR(used(i, j), (i == j ? 1 : kept) * measured.covariance(i, j), 1e-12) << i << j;
  EXPECT_THAT(
      result.warnings,
      ElementsAre("the covariance of the densities is not positive definite: its correlations were reduced by " +
                  number(100 * (1 - kept), 2) + " %"));
}

// ---------------------------------------------------------------------------------------------------------------------
// options and profiles that cannot be fitted

TEST(FitMistakes, OfOptionsAreNamed) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  const auto told = [](const auto& change, FitStatus expected = FitStatus::bad_input) {
    FitOptions options;
    change(options);
    FitResult result;
    EXPECT_EQ(check_options(options, result), expected) << result.message;
    const std::vector<std::string> said = options.validate();
    EXPECT_EQ(said, expected == FitStatus::ok ? std::vector<std::string>{} : std::vector{result.message});
    return result.message;
  };
  const auto nothing = [](FitOptions&) {};
  EXPECT_EQ(told(nothing, FitStatus::ok), "");
  for (const double bad : {0.0, -1.0, none, infinite}) {
    EXPECT_THAT(told([&](FitOptions& o) { o.plateau_density = bad; }), HasSubstr("the plateau density phi_0 is "));
    EXPECT_THAT(told([&](FitOptions& o) { o.column_number = bad; }), HasSubstr("the column number N D/W is "));
    EXPECT_THAT(told([&](FitOptions& o) { o.fixed_temperature = bad; }), HasSubstr("the fixed temperature is "));
  }
  for (const double bad : {none, infinite}) {
    EXPECT_THAT(told([&](FitOptions& o) { o.fixed_shift = bad; }), HasSubstr("the fixed shift is not a finite"));
    EXPECT_THAT(told([&](FitOptions& o) { o.base = bad; }), HasSubstr("the base (height"));
    EXPECT_THAT(told([&](FitOptions& o) { o.kernel = {KernelKind::gaussian, bad}; }), HasSubstr("width of the kernel"));
  }
  EXPECT_THAT(told([](FitOptions& o) { o.kernel = {KernelKind::top_hat, -0.1}; }), HasSubstr("width of the kernel"));
  EXPECT_EQ(told([](FitOptions& o) { o.kernel = {KernelKind::top_hat, 0}; }, FitStatus::ok), "");
  for (const double bad : {0.0, 1.0, -0.5, none})
    EXPECT_THAT(told([&](FitOptions& o) { o.confidence = bad; }), HasSubstr("it must lie between 0 and 1"));
  for (const double good : {0.001, 0.999}) told([&](FitOptions& o) { o.confidence = good; }, FitStatus::ok);
  EXPECT_THAT(told([](FitOptions& o) { o.model = "hydrostatic:enskog", o.fixed_shift = 3; }),
              HasSubstr("give the column number instead"));
  EXPECT_EQ(told([](FitOptions& o) { o.fixed_shift = -3; }, FitStatus::ok), "");
  EXPECT_THAT(told([](FitOptions& o) { o.constrain_column = true; }), HasSubstr("needs the column number N D/W"));
  EXPECT_EQ(told([](FitOptions& o) { o.constrain_column = true, o.column_number = 10; }, FitStatus::ok), "");
  EXPECT_EQ(told([](FitOptions& o) { o.model = "gauss"; }), "there is no model named 'gauss'");
  EXPECT_THAT(told([](FitOptions& o) { o.plateau_density = 1.1548; }, FitStatus::undefined_model),
              HasSubstr("is above close packing"));
  told([](FitOptions& o) { o.plateau_density = close_packing_density * (1 + 1e-13); }, FitStatus::ok);
}

// Where the rule leaves too few heights, all above the base are used and it is said; a window that was asked for is
// kept.
TEST(FitMistakes, OfAWindowRuleAreMadeGood) {
  Profile profile;
  profile.height = {-0.5, 0.2, 0.6, 1.0, 1.4, 1.8, 2.2};
  profile.number_density = {0.3, 0.95, 0.6, 0.3, 0.12, 0.05, 0.0};
  profile.std_error.assign(7, 0.02);
  FitOptions options;
  options.interval = options.sweep = options.compare = false;
  const FitResult all = fit_profile(profile, options);
  EXPECT_EQ(all.bins, 6) << all.message;
  EXPECT_EQ(all.window_low, 0.2);
  EXPECT_EQ(all.window_high, 2.2);
  // The rule takes 1.8 and 2.2 D: what lies higher than 1.5 D, up to one diameter beyond a cliff.
  EXPECT_THAT(all.warnings, testing::Contains("the window rule leaves only 2 bins, too few for the fit: all bins above "
                                              "the base (lower edge of the bed) were used"));
  options.window.low = 1.5;
  const FitResult asked = fit_profile(profile, options);
  EXPECT_EQ(asked.status, FitStatus::too_few_bins);
  EXPECT_THAT(asked.message, HasSubstr("2 free parameters need at least 3"));
}

// A profile is flat where one number describes it: densities that go up and down by one error do not fall, those that
// do so by three errors are no constant. Without errors, a billionth is no fall.
TEST(FitMistakes, OfAProfileThatDoesNotFallAreNamed) {
  const auto status = [](double swing, double error, double fall) {
    Profile profile;
    for (int i = 0; i < 20; ++i) {
      profile.height.push_back(i);
      profile.number_density.push_back(0.5 + (i % 2 == 0 ? swing : -swing) - fall * i / 19);
      if (error > 0) profile.std_error.push_back(error);
    }
    FitOptions options;
    options.interval = options.sweep = options.compare = false;
    options.window.low = 0, options.window.high = 20;
    return fit_profile(profile, options).status;
  };
  EXPECT_EQ(status(0.05, 0.05, 0), FitStatus::no_tail);
  EXPECT_NE(status(0.05, 0.0166, 0), FitStatus::no_tail);
  EXPECT_NE(status(0.05, 0.05, 0.4), FitStatus::no_tail) << "it falls by eight errors";
  EXPECT_EQ(status(0, 0, 4e-10), FitStatus::no_tail);
  EXPECT_NE(status(0, 0, 0.01), FitStatus::no_tail);
  EXPECT_NE(status(0.05, 0, 0), FitStatus::no_tail) << "without errors nothing tells";
}

// On both sides of the limits: 20 densities that go up and down by one number have chi2 = 20 (swing/error)^2, and a
// tabled chi2 of 19 degrees of freedom exceeds 36.19 once in a hundred. And a first density of 1 over 19 others of
// which the mean is just below half of it, or just above.
TEST(FitMistakes, OfAFlatProfileHaveTheirLimits) {
  const auto status = [](double first, double others, double swing, double error) {
    Profile profile;
    for (int i = 0; i < 20; ++i) {
      profile.height.push_back(i);
      profile.number_density.push_back((i == 0 ? first : others) + (i % 2 == 0 ? swing : -swing));
      profile.std_error.push_back(error);
    }
    FitOptions options;
    options.interval = options.sweep = options.compare = false;
    options.window.low = 0, options.window.high = 20;
    return fit_profile(profile, options).status;
  };
  EXPECT_EQ(status(0.5, 0.5, 0.05, 0.05 / std::sqrt(36.1 / 20)), FitStatus::no_tail);
  EXPECT_NE(status(0.5, 0.5, 0.05, 0.05 / std::sqrt(36.3 / 20)), FitStatus::no_tail);
  EXPECT_EQ(status(1, 0.475, 0, 1), FitStatus::no_tail);
  EXPECT_NE(status(1, 0.473, 0, 1), FitStatus::no_tail);
}

// What was done to a profile before it is fitted.
TEST(FitMistakes, OfAProfileAreMadeGoodAndSaid) {
  Profile profile;
  profile.height = {3, 1, 2}, profile.number_density = {0.1, 1, 0.5};
  const auto said = [&] {
    FitResult result;
    const MeasuredProfile measured = measured_of(profile, result);
    EXPECT_THAT(measured.height, ElementsAre(1, 2, 3));
    EXPECT_THAT(measured.density, ElementsAre(1, 0.5, 0.1));
    EXPECT_FALSE(measured.errors_known);
    EXPECT_THAT(measured.error, ElementsAre(1, 1, 1));
    return result.warnings;
  };
  const std::string weights = ": every bin has the same weight, and the errors of the fit follow from the residuals";
  EXPECT_THAT(said(), ElementsAre("the heights were not in ascending order; the bins were sorted",
                                  "no standard errors were given" + weights));
  profile.std_error = {0, 0, 0};
  EXPECT_THAT(said(), ElementsAre("the heights were not in ascending order; the bins were sorted",
                                  "all standard errors are zero" + weights));
}

// ---------------------------------------------------------------------------------------------------------------------
// warnings and objections: both sides of each limit

TEST(WarningsByHand, OfUnitsHaveTheirLimits) {
  MeasuredProfile few;
  few.height = {0, 0.2, 0.4, 0.99};
  EXPECT_FALSE(heights_look_like_metres(few)) << "four heights";
  few.height = {0, 0.2, 0.4, 0.6, 0.99};
  EXPECT_TRUE(heights_look_like_metres(few));
  few.height.back() = 1;
  EXPECT_FALSE(heights_look_like_metres(few));
  EXPECT_FALSE(is_denser_than_close_packing(1.0199 * close_packing_density));
  EXPECT_TRUE(is_denser_than_close_packing(1.0201 * close_packing_density));
  for (const double ratio : {1.49, 1 / 1.49}) EXPECT_FALSE(area_is_of_another_unit(7 * ratio, 7)) << ratio;
  for (const double ratio : {1.51, 1 / 1.51}) EXPECT_TRUE(area_is_of_another_unit(7 * ratio, 7)) << ratio;
  const auto said = [](double area, double given) {
    MeasuredProfile measured;
    measured.height = {0, 9}, measured.area = area, measured.greatest_mean = 1;
    FitOptions options;
    options.column_number = given;
    FitResult result;
    warn_about_units(measured, options, result);
    return result.warnings.empty() ? std::string() : result.warnings.front();
  };
  EXPECT_EQ(said(10.99, 10), "");
  EXPECT_EQ(said(9.01, 10), "");
  EXPECT_EQ(said(11.2, 10), "the area under the profile is 11.2, but N D/W is 10 (ratio 1.12)");
  EXPECT_EQ(said(5, 10),
            "the area under the profile is 5, but N D/W is 10 (ratio 0.5). The heights may be in a wrong unit, or part "
            "of the bed is missing. Heights divided by 0.5 would agree with N D/W");
}

class FitWarnings : public testing::Test {
 protected:
  FitWarnings() {
    measured_.height = {0, 9}, measured_.errors_known = true;
    options_.plateau_density_free = true, options_.plateau_density = 1.1;
    FitResult ignored;
    EXPECT_EQ(make_setup(options_, measured_, setup_, ignored), FitStatus::ok);
    result_.status = FitStatus::ok;
    result_.temperature = {1, 0.01, false}, result_.solid_height = {4, 0.01, false};
    result_.plateau_density = {1.1, 0.05, false};
    result_.dof = 10;
  }
  std::vector<std::string> said() const {
    FitResult result = result_;
    warn_about_fit(measured_, options_, setup_, result);
    return result.warnings;
  }
  MeasuredProfile measured_;
  FitOptions options_;
  FitSetup setup_;
  FitResult result_;
};

// An outlier is more than 8 errors off and more than half of chi2 in square.
TEST_F(FitWarnings, NameAnOutlierBeyondEightErrors) {
  const auto off = [&](double errors, double other) {
    result_.residuals = {
        {1, 0, 0.5, 0, true}, {2, 0.5 * errors, 0.5, 0, true}, {3, 0, 0.5, 0.5 * other, true}, {4, 99, 0.5, 0, false}};
    return said();
  };
  EXPECT_TRUE(off(8, 0).empty());
  EXPECT_THAT(off(8.01, 0), ElementsAre("One density, at the height 2 D, lies 8 standard errors from the fit and "
                                        "contributes most of chi2. If it is an outlier, the option \"robust\" limits "
                                        "its influence."));
  EXPECT_EQ(off(-9, 8.9).size(), 1U) << "81 of 160";
  EXPECT_TRUE(off(9, 9).empty()) << "half of it";
  options_.robust = true;
  EXPECT_THAT(off(9, 0),
              ElementsAre("One density, at the height 2 D, lies 9 standard errors from the fit and contributes most of "
                          "chi2."));
  result_.dof = 1;
  EXPECT_TRUE(off(9, 0).empty());
}

// The window: by more than 3 errors of both and a tenth of T. The sum rule: by a tenth and 4 errors.
TEST_F(FitWarnings, NameTheWindowAndTheSumRule) {
  const auto row = [](double t, double error) {
    WindowFit fit;
    fit.status = FitStatus::ok, fit.temperature = {t, error, false};
    return fit;
  };
  result_.window_sweep = {row(1.09, 0), row(0.8, 0.07)};
  EXPECT_TRUE(said().empty()) << "a tenth; 0.2 is 2.8 errors of 0.0707";
  result_.window_sweep = {row(1.09, 0), row(0.8, 0.06)};
  EXPECT_THAT(said(), ElementsAre("the temperature changes with the window, from 0.8 to 1.09 m g D: the profile has no "
                                  "single temperature in this model"));
  result_.window_sweep[1].status = FitStatus::not_converged;
  EXPECT_TRUE(said().empty());
  result_.window_sweep = {row(1.11, 0)};
  EXPECT_EQ(said().size(), 1U);
  result_.temperature.fixed = true;
  EXPECT_TRUE(said().empty());
  options_.column_number = 10;
  result_.critical_status = ValueStatus::ok;
  result_.solid_height_by_sum_rule = 3.61;
  EXPECT_TRUE(said().empty());
  result_.solid_height_by_sum_rule = 3.59;
  EXPECT_THAT(said(), ElementsAre("the fitted solid is 4 D high, but the sum rule with this T gives 3.59 D"));
  result_.solid_height.std_error = 0.11;
  EXPECT_TRUE(said().empty()) << "less than 4 errors";
  result_.solid_height.std_error = 0.01, options_.column_number.reset();
  EXPECT_TRUE(said().empty());
}

TEST_F(FitWarnings, NameAPlateauThatIsNotDetermined) {
  result_.plateau_density = {1.1, 0.1099, false};
  EXPECT_TRUE(said().empty());
  result_.plateau_density = {1.1, 0.1101, false};
  EXPECT_THAT(said(), ElementsAre(HasSubstr("the plateau density is not determined")));
  result_.plateau_density = {1.1, 0, false};
  EXPECT_TRUE(said().empty()) << "a curve that agrees exactly";
  result_.chi2 = 1e-3;
  EXPECT_THAT(said(), ElementsAre(HasSubstr("the plateau density is not determined")));
  result_.chi2 = 0;
  result_.plateau_density = {setup_.model->largest_plateau(), 0.01, false};
  EXPECT_THAT(said(), ElementsAre(HasSubstr("reached close packing")));
  result_.plateau_density = {1.1, 0.01, false}, result_.solid_height = {0, 0, false};
  EXPECT_THAT(said(), ElementsAre(HasSubstr("no solid: ")));
  result_.solid_height = {4, 0.01, false}, result_.misfit = true;
  result_.chi2_per_dof = 4, result_.p_value = 1.23e-5;
  EXPECT_THAT(said(), ElementsAre("The model does not fit: chi2/dof = 4, p = 1.2e-05."));
  result_.errors_scaled = true;
  EXPECT_THAT(said(),
              ElementsAre("The model does not fit: chi2/dof = 4, p = 1.2e-05. The errors were multiplied by 2."));
  result_.model_error = 0.03;
  EXPECT_THAT(said(), ElementsAre("The model does not fit: chi2/dof = 4, p = 1.2e-05. A systematic error of 0.03 was "
                                  "added to every density."));
}

// Above T_c and with T held, another plateau is the same curve with another shift: neither has an error, and the fit
// says so.
TEST(WarningsByHand, NameAPlateauThatOnlyMovesTheShift) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.6, {11.22, 1.10});
  FitOptions options;
  options.plateau_density = 1.10, options.plateau_density_free = true, options.fixed_temperature = 0.6;
  options.interval = options.sweep = options.compare = false;
  const FitResult fit = fit_profile(synthetic::profile_of(truth, {}, 60, synthetic::top_of(truth), 0.005, 3), options);
  ASSERT_TRUE(fit.ok()) << fit.message;
  EXPECT_THAT(fit.warnings, testing::Contains(HasSubstr("the plateau density is not determined")));
}

std::vector<std::string> objections(const Profile& profile, std::optional<double> column = {}, bool velocities = false,
                                    double rows = 0) {
  std::vector<std::string> why;
  for (const Objection& one : objections_to({profile, {}, rows}, column, velocities)) why.push_back(one.why);
  return why;
}

TEST(ObjectionsByHand, CountHeightsAndUnits) {
  EXPECT_TRUE(objections(stairs({1, 1, 0.8, 0.5, 0.2, 0.1, 0}, 0.001)).empty());
  EXPECT_THAT(objections(stairs({1, 1, 0.8, 0.5, 0.2, 0, 0}, 0.001)),
              ElementsAre("Only 5 heights have a density above 0."));
  EXPECT_TRUE(objections(stairs({1.177, 1, 0.8, 0.5, 0.2, 0.1, 0}, 0.001)).empty());
  EXPECT_THAT(objections(stairs({1.179, 1, 0.8, 0.5, 0.2, 0.1, 0}, 0.001)),
              ElementsAre(HasSubstr("averaged over one diameter reaches 1.179 per D^2")));
  EXPECT_TRUE(objections(stairs({2.3, 1, 0.8, 0.5, 0.2, 0.1, 0}, 0.001), {}, false, 0.05).empty())
      << "where rows show, a diameter may hold two of them";
  const Profile bed = stairs({1, 1, 0.8, 0.5, 0.2, 0.1, 0}, 0.001);  // area 1 + 1 + 0.8 + 0.5 + 0.2 + 0.1
  EXPECT_TRUE(objections(bed, 3.6 * 1.49).empty());
  EXPECT_THAT(objections(bed, 3.6 * 1.51), ElementsAre("The area under the profile is 3.6, but N D/W is 5.44."));
}

TEST(ObjectionsByHand, NameDensitiesBelowZero) {
  EXPECT_THAT(objections(stairs({1, 1, 0.8, 0.5, 0.2, 0.1, -3.5}, 0.001)),
              testing::Not(testing::Contains(HasSubstr("negative, on average"))));
  EXPECT_THAT(objections(stairs({1, 1, 0.8, 0.5, 0.2, 0.1, -3.7}, 0.001)),
              ElementsAre("The densities are negative, on average."));
  EXPECT_TRUE(objections(stairs({-1, -1, 0, 0, -1, -1, -1}, 0.001)).empty()) << "no signal, as fits say";
}

// Errors of one height a diameter: half of the density, in the median of what is denser than half of the greatest.
TEST(ObjectionsByHand, WeighErrors) {
  Profile profile = stairs({0.9, 0.9, 1, 0.45, 0.2, 0.1, 0}, 0.001);
  profile.std_error[0] = profile.std_error[1] = 0.49 * 0.9;
  EXPECT_TRUE(objections(profile).empty()) << "the median of 0.49, 0.49 and 0.001";
  profile.std_error[0] = profile.std_error[1] = 0.51 * 0.9;
  EXPECT_THAT(objections(profile), ElementsAre("Where the bed is densest, the relative error of the density is 51 %."));
  profile.std_error[0] = 0.001;
  EXPECT_TRUE(objections(profile).empty()) << "of one in three";
  // From the greatest height the density must have fallen to a half, and by three errors.
  Profile flat = stairs({1, 1, 1, 1, 1, 0.9, 0.5}, 0.001);
  EXPECT_TRUE(objections(flat).empty());
  flat.number_density.back() = 0.51;
  EXPECT_THAT(objections(flat), ElementsAre("The density does not fall with height: it is 1 per D^2 where it is "
                                            "greatest, and 0.51 at the greatest height, 6 D."));
  flat.number_density.back() = 0.4;
  flat.std_error.front() = 0.15, flat.std_error.back() = 0.13;  // 3 errors of 0.1985 are 0.595
  EXPECT_TRUE(objections(flat).empty());
  flat.std_error.back() = 0.14;  // of 0.205: 0.616
  EXPECT_THAT(objections(flat), ElementsAre(HasSubstr("The density does not fall by more than its errors")));
}

// Five heights within a diameter: errors of their own are sqrt(5) times less in the mean, common ones are not.
TEST(ObjectionsByHand, AverageErrorsOverADiameter) {
  const auto bed = [](double error, double common) {
    Profile profile;
    for (int i = 0; i < 40; ++i) {
      profile.height.push_back(0.25 * i);
      profile.number_density.push_back(i < 24 ? 1 : i < 32 ? 0.1 : 0);
      profile.std_error.push_back(error);
    }
    if (common > 0) {
      profile.covariance.assign(1600, common * common);
      for (std::size_t i = 0; i < 40; ++i) profile.covariance[41 * i] += error * error - common * common;
    }
    return profile;
  };
  const std::string said = "Where the bed is densest, the relative error of the density is";
  const auto speaks = [&](const Profile& profile) {
    const std::vector<std::string> all = objections(profile);
    return std::any_of(all.begin(), all.end(), [&](const std::string& one) { return one.starts_with(said); });
  };
  EXPECT_FALSE(speaks(bed(0.499 * std::sqrt(5), 0)));
  EXPECT_TRUE(speaks(bed(0.501 * std::sqrt(5), 0)));
  EXPECT_FALSE(speaks(bed(0.499, 0.4989)));
  EXPECT_TRUE(speaks(bed(0.501, 0.5009)));
  // A half in common, and of their own: 0.25 + (e^2 - 0.25)/5 at the limit 0.25.
  EXPECT_TRUE(speaks(bed(0.52, 0.5)));
}

// What is missing below the densest height may be half of the bed; what lies above a gap a tenth.
TEST(ObjectionsByHand, LookForGaps) {
  // At heights 0 to 8; 2 D below the greatest density are empty. Height 0 does not count.
  const auto rising = [](double last) { return stairs({0, 0, 0, 1, 1, 1, 0.6, last, 0.1}, 0.001); };
  EXPECT_TRUE(objections(rising(0.4)).empty()) << "2 of 4.05";
  EXPECT_THAT(objections(rising(0.25)), ElementsAre("The density rises with height, up to 3 D.")) << "2 of 3.9";
  EXPECT_TRUE(objections(rising(0.25), {}, true).empty()) << "velocities are known";
  const auto gap = [](double in_it, double above) {
    return stairs({1, 1, 1, 0.5, 0.3, in_it, above, above, 0.0001}, 0.00001);
  };
  EXPECT_TRUE(objections(gap(0.0199, 0.2)).empty()) << "0.42 of 4.22";
  EXPECT_THAT(objections(gap(0.0199, 0.22)), ElementsAre("11 % of the disks lie above a gap at 5 D."));
  EXPECT_TRUE(objections(gap(0.0201, 0.22)).empty()) << "no gap";
}

// ---------------------------------------------------------------------------------------------------------------------
// sweeps, comparisons, texts

// Ten equal steps from the low end to where a quarter of the greatest density is left, then the upper ends.
TEST(SweepByHand, HasItsWindows) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.6, {11.22, 1.10});
  const Profile data = synthetic::profile_of(truth, {}, 120, synthetic::top_of(truth), 0.0005, 3);
  FitOptions options;
  options.plateau_density = 1.10;
  options.interval = false;
  const FitResult fit = fit_profile(data, options);
  ASSERT_TRUE(fit.ok());
  FitResult ignored;
  const MeasuredProfile measured = measured_of(data, ignored);
  double greatest = 0;
  for (std::size_t i = 0; i < measured.size(); ++i)
    if (measured.height[i] >= 1.5) greatest = std::max(greatest, measured.one_diameter_mean[i]);
  const auto last_with = [&](double part) {
    double found = 0;
    for (std::size_t i = 0; i < measured.size(); ++i)
      if (measured.height[i] <= fit.window_high && measured.one_diameter_mean[i] >= part * greatest)
        found = measured.height[i];
    return found;
  };
  const auto first_from = [&](double height) {
    return *std::lower_bound(measured.height.begin(), measured.height.end(), height - 1e-12);
  };
  std::vector<double> lows, highs;
  for (int i = 0; i <= 10; ++i)
    lows.push_back(first_from(fit.window_low + (last_with(0.25) - fit.window_low) * i / 10));
  for (const double part : {0.02, 0.05, 0.1, 0.2}) highs.push_back(last_with(part));
  ASSERT_EQ(fit.window_sweep.size(), 15U);
  for (std::size_t i = 0; i < 15; ++i) {
    EXPECT_NEAR(fit.window_sweep[i].low, i < 11 ? lows[i] : fit.window_low, 1e-12) << i;
    EXPECT_NEAR(fit.window_sweep[i].high, i < 11 ? fit.window_high : highs[i - 11], 1e-12) << i;
  }
  std::vector<std::string> models;
  for (const ModelFit& row : fit.model_comparison)
    models.push_back(row.model + (row.plateau_density_free ? " free" : ""));
  EXPECT_THAT(models, ElementsAre("enskog-rectangle", "enskog-rectangle free", "hydrostatic:enskog",
                                  "hydrostatic:best-of", "fermi", "fermi free", "rectangle free"));
  // aic and bic of a chi2: 2 k and k ln n more.
  for (const ModelFit& row : fit.model_comparison) {
    if (row.status != FitStatus::ok) continue;
    EXPECT_NEAR(row.aic - row.chi2, 2 * row.parameters, 1e-8 * row.chi2) << row.model;
    EXPECT_NEAR(row.bic - row.chi2, row.parameters * std::log(fit.bins), 1e-8 * row.chi2) << row.model;
    EXPECT_NEAR(row.chi2_per_dof, row.chi2 / (fit.bins - row.parameters), 1e-9 * row.chi2) << row.model;
  }
  // The next bed: 1.96 statistical errors in ln T.
  options.interval = true;
  const FitResult with = fit_profile(data, options);
  const double reach = std::exp(1.959963985 * with.statistical_error / with.temperature.value);
  EXPECT_NEAR(with.next_bed_interval.high / with.temperature.value, reach, 1e-9);
  EXPECT_NEAR(with.next_bed_interval.low * reach / with.temperature.value, 1, 1e-9);
}

// What is held in the fit is held in the models beside it that have it: T in all with an equation of state, the shift
// in the curve over a rectangle. So many parameters each has free.
TEST(ComparisonByHand, HoldsWhatIsHeld) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.12, {11.22, 1.10});
  const Profile data = synthetic::profile_of(truth, {}, 60, synthetic::top_of(truth), 0.0005, 3);
  FitOptions options;
  options.plateau_density = 1.10;
  options.interval = options.sweep = false;
  const auto rows = [&] {
    std::vector<std::tuple<std::string, int, bool, bool>> out;  // parameters; whether T and the shift are held
    for (const ModelFit& row : fit_profile(data, options).model_comparison) {
      EXPECT_EQ(row.status, FitStatus::ok) << row.model;
      EXPECT_EQ(row.temperature.std_error > 0, !row.temperature.fixed) << row.model;
      const bool known = row.shift.fixed || row.model == "hydrostatic:best-of";  // its tail begins at the base
      EXPECT_EQ(row.shift.std_error > 0, !known) << row.model;
      EXPECT_EQ(row.plateau_density.fixed, !row.plateau_density_free) << row.model;
      EXPECT_EQ(row.plateau_density.std_error > 0, row.plateau_density_free) << row.model;
      if (row.temperature.fixed) {
        EXPECT_EQ(row.temperature.value, row.model == "rectangle" ? 0 : 0.12) << row.model;
      }
      if (row.shift.fixed) {
        EXPECT_EQ(row.shift.value, 4.2) << row.model;
      }
      out.emplace_back(row.model, row.parameters, row.temperature.fixed, row.shift.fixed);
    }
    return out;
  };
  using Rows = std::vector<std::tuple<std::string, int, bool, bool>>;
  options.fixed_temperature = 0.12;
  EXPECT_EQ(rows(), (Rows{{"enskog-rectangle", 1, true, false},
                          {"enskog-rectangle", 2, true, false},
                          {"hydrostatic:enskog", 1, true, false},
                          {"hydrostatic:best-of", 1, true, false},
                          {"fermi", 2, false, false},
                          {"fermi", 3, false, false},
                          {"rectangle", 2, true, false}}));
  options.fixed_temperature.reset();
  options.fixed_shift = 4.2;
  EXPECT_EQ(rows(), (Rows{{"enskog-rectangle", 1, false, true},
                          {"enskog-rectangle", 2, false, true},
                          {"hydrostatic:enskog", 2, false, false},
                          {"hydrostatic:best-of", 2, false, false},
                          {"fermi", 2, false, false},
                          {"fermi", 3, false, false},
                          {"rectangle", 2, true, false}}));
}

// Windows of profiles of few heights: one with fewer than two heights more than parameters is not fitted, and no window
// is named twice.
TEST(SweepByHand, LeavesOutWindowsOfTooFewHeights) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 1.0, {11.22, 1.10});
  FitOptions options;
  options.plateau_density = 1.10;
  options.interval = options.compare = false;
  int just_too_few = 0, just_enough = 0;
  for (const int heights : {12, 13, 14, 15, 16, 17, 18, 20, 24}) {
    const Profile data = synthetic::profile_of(truth, {}, heights, synthetic::top_of(truth), 0.0005, 3);
    options.fixed_shift.reset();
    const FitResult fit = fit_profile(data, options);
    options.fixed_shift = fit.shift.value;
    for (const FitResult& one : {fit, fit_profile(data, options)}) {
      const bool fixed = one.shift.fixed;
      const int needed = fixed ? 3 : 4;
      for (std::size_t i = 0; i < one.window_sweep.size(); ++i) {
        const WindowFit& row = one.window_sweep[i];
        const bool fitted = row.status != FitStatus::too_few_bins;
        EXPECT_EQ(fitted, row.bins >= needed) << heights << ' ' << i;
        EXPECT_EQ(row.temperature.value > 0, fitted) << heights << ' ' << i;
        EXPECT_EQ(row.shift.std_error > 0, fitted && !fixed) << heights << ' ' << i;
        EXPECT_EQ(row.shift.fixed, fixed);
        EXPECT_FALSE(row.temperature.fixed);
        if (i > 0) {
          EXPECT_FALSE(row.low == one.window_sweep[i - 1].low && row.high == one.window_sweep[i - 1].high) << i;
        }
        just_too_few += row.bins == needed - 1, just_enough += row.bins == needed;
      }
    }
  }
  EXPECT_GT(just_too_few, 0);
  EXPECT_GT(just_enough, 0);
}

TEST(FitTextByHand, NamesEveryStatus) {
  using enum FitStatus;
  const std::pair<FitStatus, const char*> fits[] = {{ok, "ok"},
                                                    {not_converged, "not converged"},
                                                    {bad_input, "bad input"},
                                                    {too_few_bins, "too few bins"},
                                                    {no_signal, "no signal"},
                                                    {no_tail, "no tail"},
                                                    {unresolved_temperature, "unresolved temperature"},
                                                    {undefined_model, "undefined model"},
                                                    {unreadable, "unreadable"}};
  for (const auto& [status, name] : fits) EXPECT_EQ(to_string(status), name);
  const std::pair<ValueStatus, const char*> values[] = {{ValueStatus::ok, "ok"},
                                                        {ValueStatus::pole, "undefined (pole)"},
                                                        {ValueStatus::outside_range, "outside range"},
                                                        {ValueStatus::invalid_argument, "invalid argument"},
                                                        {ValueStatus::not_converged, "not converged"}};
  for (const auto& [status, name] : values) {
    EXPECT_EQ(to_string(status), name);
    EXPECT_EQ(no_value(status).value, 0);
    EXPECT_EQ(no_value(status).ok(), status == ValueStatus::ok);
  }
}

TEST(FitTextByHand, SaysWhatAFitFound) {
  FitResult fit;
  fit.status = FitStatus::ok;
  fit.model = "fermi";
  fit.temperature = {0.5, 0.01, false}, fit.shift = {8.25, 0.02, false}, fit.solid_height = {8, 0.02, false};
  fit.plateau_density = {1.1, 0, true}, fit.column_number = {11.25, 0.1, false};
  fit.critical_status = ValueStatus::ok;
  fit.critical_temperature = {2, 0.1, false}, fit.reduced_temperature = {0.25, 0.02, false};
  fit.chi2_per_dof = 1.25, fit.dof = 40, fit.p_value = 0.125, fit.bins = 42;
  fit.window_low = 1.5, fit.window_high = 12.25, fit.window_rule = "a rule";
  fit.kernel = {KernelKind::gaussian, 0.5};
  fit.temperature_interval = {FitStatus::ok, 0.48, 0.52, 0.95, false, false};
  fit.warnings = {"One.", "Two."};
  EXPECT_EQ(fit.brief(),
            "fermi: T = 0.5 +- 0.01 m g D, solid height 8 +- 0.02 D, chi2/dof = 1.25 (42 heights; 2 "
            "warnings)");
  EXPECT_EQ(fit.full(),
            "status                ok\n"
            "model                 fermi\n"
            "temperature           0.5 +- 0.01 m g D\n"
            "temperature interval  0.48 to 0.52 m g D (95 %)\n"
            "shift                 8.25 +- 0.02 D\n"
            "solid height          8 +- 0.02 D\n"
            "plateau density       1.1 (fixed) 1/D^2\n"
            "column number         11.25 +- 0.1\n"
            "critical temperature  2 +- 0.1 m g D\n"
            "T/T_c                 0.25 +- 0.02\n"
            "chi2/dof              1.25 (40 degrees of freedom, p = 0.12)\n"
            "window                1.5 to 12.25 D, 42 heights: a rule\n"
            "kernel                gaussian:0.5\n"
            "warning               One.\n"
            "warning               Two.\n");
  fit.misfit = true, fit.solid_height = {}, fit.warnings.pop_back();
  EXPECT_EQ(fit.brief(),
            "fermi: T = 0.5 +- 0.01 m g D, no solid, chi2/dof = 1.25 (42 heights; the model does not fit; "
            "1 warning)");
  fit.status = FitStatus::no_tail, fit.message = "Flat.";
  EXPECT_EQ(fit.brief(), std::string(to_string(FitStatus::no_tail)) + ": Flat.");
  EXPECT_EQ(fit.full(),
            "status                " + std::string(to_string(FitStatus::no_tail)) + "\nmessage               Flat.\n");
}

// ---------------------------------------------------------------------------------------------------------------------
// libraries and maps on which interpolation is exact

// Beds whose densities are straight lines in ln T at each of six heights.
constexpr double middle[] = {1.0, 0.9, 0.7, 0.5, 0.3, 0.2}, slope[] = {-0.1, -0.05, 0.02, 0.1, 0.12, 0.06};
Profile straight(double temperature, double error, double lifted = 0) {
  Profile profile;
  for (std::size_t i = 0; i < 6; ++i) {
    profile.height.push_back(2 + static_cast<double>(i));
    profile.number_density.push_back(middle[i] + slope[i] * std::log(temperature) + lifted * (i % 2 == 0 ? 1 : -1));
    profile.std_error.push_back(error);
  }
  return profile;
}
const std::vector<double> temperatures{0.5, 0.7, 1, 1.5, 2.2};

// chi2 is a parabola in ln T with the curvature sum of slopes^2/variance; the height of the solid is -ln T + 2.
TEST(LibraryByHand, OfStraightLinesIsExact) {
  std::vector<SimulatedProfile> library;
  for (const double t : temperatures) library.push_back({t, straight(t, 0), 2 - std::log(t)});
  const MatchResult match = match_simulated(straight(1.2, 0.01), library);
  ASSERT_EQ(match.status, FitStatus::ok) << match.message;
  EXPECT_NEAR(match.temperature.value, 1.2, 1e-6);
  EXPECT_NEAR(match.chi2, 0, 1e-6);
  EXPECT_EQ(match.bins, 6);
  EXPECT_EQ(match.dof, 5);
  double squares = 0;
  for (const double s : slope) squares += s * s;
  const double sigma = 0.01 / std::sqrt(squares);
  EXPECT_NEAR(match.temperature.std_error, 1.2 * std::sinh(sigma), 1e-5);
  EXPECT_NEAR(match.interval.low, 1.2 * std::exp(-1.959964 * sigma), 1e-5);
  EXPECT_NEAR(match.interval.high, 1.2 * std::exp(1.959964 * sigma), 1e-5);
  EXPECT_FALSE(match.interval.low_open || match.interval.high_open);
  EXPECT_NEAR(match.solid_height.value, 2 - std::log(1.2), 1e-6);
  EXPECT_NEAR(match.solid_height.std_error, sigma, 1e-5);
  EXPECT_NEAR(match.interpolation_error, 0, 1e-6);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(match.library_error[i], 0, 1e-9);
  // What is off by 0.03 in turn at every height, of an error of 0.01: a poor match, with errors as much larger.
  const MatchResult poor = match_simulated(straight(1.2, 0.01, 0.03), library);
  double along = 0;
  for (std::size_t i = 0; i < 6; ++i) along += slope[i] * (i % 2 == 0 ? 0.03 : -0.03);
  const double chi2 = (6 * 0.0009 - along * along / squares) / 1e-4;
  EXPECT_NEAR(poor.chi2, chi2, 1e-4);
  EXPECT_NEAR(std::log(poor.temperature.value / 1.2), along / squares, 1e-6);
  EXPECT_NEAR(poor.temperature.std_error, poor.temperature.value * std::sinh(std::sqrt(chi2 / 5) * sigma), 1e-4);
  EXPECT_NEAR(std::log(poor.interval.high / poor.temperature.value), 1.959964 * std::sqrt(chi2 / 5) * sigma, 1e-5);
  EXPECT_NEAR(std::log(poor.interval.low / poor.temperature.value), -1.959964 * std::sqrt(chi2 / 5) * sigma, 1e-5);
  EXPECT_THAT(poor.warnings, ElementsAre(HasSubstr("no bed of the library describes the data")));
}

// A height without an error, or with one that is less, has the error 1e-4 of the greatest density: else one that is
// empty in both would decide everything.
TEST(LibraryByHand, HasALeastError) {
  std::vector<SimulatedProfile> library;
  for (const double t : temperatures) library.push_back({t, straight(t, 0), 0});
  Profile measured = straight(1.2, 0, 0.0002);
  const double greatest = *std::max_element(measured.number_density.begin(), measured.number_density.end());
  double squares = 0, along = 0;
  for (std::size_t i = 0; i < 6; ++i) squares += slope[i] * slope[i], along += slope[i] * (i % 2 == 0 ? 2e-4 : -2e-4);
  const double chi2 = (6 * 4e-8 - along * along / squares) / std::pow(1e-4 * greatest, 2);
  for (const double error : {0.0, 0.9e-4 * greatest}) {
    measured.std_error.assign(6, error);
    EXPECT_NEAR(match_simulated(measured, library).chi2, chi2, 1e-3) << error;
  }
  measured.std_error.clear();
  EXPECT_NEAR(match_simulated(measured, library).chi2, chi2, 1e-3);
  measured.std_error.assign(6, 2e-4 * greatest);
  EXPECT_NEAR(match_simulated(measured, library).chi2, chi2 / 4, 1e-3);
}

// Beyond its lowest and highest heights a bed of the library holds nothing, and a measurement that reaches farther is
// compared with that.
TEST(LibraryByHand, HoldsNothingBeyondItsHeights) {
  std::vector<SimulatedProfile> library;
  for (const double t : temperatures) library.push_back({t, straight(t, 0), 0});
  Profile measured = straight(1.2, 0.01);
  measured.height.insert(measured.height.begin(), 1.5), measured.height.push_back(7.5);
  measured.number_density.insert(measured.number_density.begin(), 0.02), measured.number_density.push_back(-0.03);
  measured.std_error.insert(measured.std_error.begin(), 0.01), measured.std_error.push_back(0.01);
  const MatchResult match = match_simulated(measured, library);
  ASSERT_EQ(match.status, FitStatus::ok) << match.message;
  EXPECT_EQ(match.bins, 8);
  EXPECT_NEAR(match.temperature.value, 1.2, 1e-6);
  EXPECT_NEAR(match.density.front(), 0, 1e-12);
  EXPECT_NEAR(match.density.back(), 0, 1e-12);
  EXPECT_NEAR(match.chi2, 4 + 9, 1e-6);
}

// Three heights are enough, two are not; a bed like the coldest or the hottest of the library may lie beyond it.
TEST(LibraryByHand, HasItsLimits) {
  std::vector<SimulatedProfile> library;
  for (const double t : temperatures) library.push_back({t, straight(t, 0), 0});
  const Profile measured = straight(1.2, 0.01);
  EXPECT_EQ(match_simulated(measured, library, {.low = 2, .high = 3}).status, FitStatus::too_few_bins);
  const MatchResult three = match_simulated(measured, library, {.low = 2, .high = 4});
  EXPECT_EQ(three.status, FitStatus::ok);
  EXPECT_EQ(three.dof, 2);
  for (const double end : {0.5, 2.2}) {
    const MatchResult match = match_simulated(straight(end == 0.5 ? 0.48 : 2.3, 0.01), library);
    EXPECT_EQ(match.status, FitStatus::unresolved_temperature);
    EXPECT_THAT(match.message, HasSubstr("at an end of the library"));
    EXPECT_EQ(match.interval.low_open, end == 0.5);
    EXPECT_EQ(match.interval.high_open, end == 2.2);
    EXPECT_NEAR(match.temperature.value, end, 1e-9);
  }
  Profile unsorted = measured;
  std::swap(unsorted.height[1], unsorted.height[2]);
  EXPECT_EQ(match_simulated(unsorted, library).status, FitStatus::bad_input);
  Profile negative = measured;
  negative.std_error[2] = -0.01;
  EXPECT_EQ(match_simulated(negative, library).status, FitStatus::bad_input);
  negative.std_error.pop_back();
  EXPECT_EQ(match_simulated(negative, library).status, FitStatus::bad_input);
  library[1].temperature = -1;
  EXPECT_EQ(match_simulated(measured, library).status, FitStatus::bad_input);
}

// Two runs a temperature, lifted by 0.004 up or down, whose own errors are 0.003: of the variance of one bed about the
// mean, 6 times 2 times 0.004^2, the noise 6 times 0.003^2 is taken off. A bed is off by it, the mean by half of it.
TEST(LibraryByHand, HasTheErrorOfItsRepeats) {
  std::vector<SimulatedProfile> library;
  for (const double t : temperatures)
    for (const double lifted : {0.004, -0.004}) library.push_back({t, straight(t, 0.003, lifted), 0});
  const MatchResult match = match_simulated(straight(1, 0.0005), library);
  ASSERT_EQ(match.status, FitStatus::ok) << match.message;
  EXPECT_NEAR(match.temperature.value, 1, 2e-3) << "but for how the variance changes with T";
  const double preparation = 2 * 0.004 * 0.004 - 0.003 * 0.003, noise = 0.003 * 0.003 / 2;
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(match.library_error[i] / std::sqrt(noise + 1.5 * preparation), 1, 0.01) << i;
  // At its two ends every run has a repeat, so all ten are tested.
  EXPECT_EQ(test_library(library).size(), 10U);
}

TEST(LibraryByHand, ScattersByItsTests) {
  const auto test = [](double t, double factor, FitStatus status = FitStatus::ok) {
    return LibraryTest{t, status, {t * factor, 0, false}};
  };
  std::vector<LibraryTest> tests{test(1, std::exp(0.1)), test(1.49, std::exp(-0.2)), test(1.51, 2), test(0.66, 2),
                                 test(1, 3, FitStatus::no_tail)};
  EXPECT_EQ(library_scatter(tests, 1).status, ValueStatus::outside_range) << "two within a factor of 1.5";
  tests.push_back(test(0.67, std::exp(0.2)));
  EXPECT_NEAR(library_scatter(tests, 1).value, std::sqrt((0.01 + 0.04 + 0.04) / 3), 1e-14);
  EXPECT_EQ(library_scatter(tests, 0).status, ValueStatus::invalid_argument);
}

// One axis, six beds at even distances: weighted least squares about the place, done once more with sums.
TEST(MapByHand, IsALineThroughItsNeighbours) {
  const std::vector<double> t{1, 1.3, 1.5, 2.1, 2.4, 3.5}, error{0.02, 0.03, 0.05, 0.04, 0.06, 0.1};
  std::vector<MapPoint> points;
  for (std::size_t p = 0; p < 6; ++p) points.push_back({{3 + 2 * static_cast<double>(p)}, t[p], error[p]});
  const EmpiricalMap map({{"x", false}}, points);
  const auto line = [&](double unit, std::size_t left_out) {  // ln T and its variance
    std::vector<double> distances;
    for (std::size_t p = 0; p < 6; ++p)
      if (p != left_out) distances.push_back(std::abs(static_cast<double>(p) / 5 - unit));
    std::sort(distances.begin(), distances.end());
    const double width = 0.5 * distances[4];
    double w0 = 0, w1 = 0, w2 = 0, y0 = 0, y1 = 0;
    std::vector<double> weight(6), x(6);
    for (std::size_t p = 0; p < 6; ++p) {
      if (p == left_out) continue;
      x[p] = static_cast<double>(p) / 5 - unit;
      weight[p] = std::exp(-0.5 * std::pow(x[p] / width, 2)) / (1e-4 + std::pow(error[p] / t[p], 2));
      w0 += weight[p], w1 += weight[p] * x[p], w2 += weight[p] * x[p] * x[p];
      y0 += weight[p] * std::log(t[p]), y1 += weight[p] * x[p] * std::log(t[p]);
    }
    w2 += 1e-9 * w0;
    double variance = 0;
    for (std::size_t p = 0; p < 6; ++p)
      variance += std::pow(weight[p] * (w2 - w1 * x[p]) / (w0 * w2 - w1 * w1) * error[p] / t[p], 2);
    return std::pair((w2 * y0 - w1 * y1) / (w0 * w2 - w1 * w1), variance);
  };
  double squares = 0;
  for (std::size_t p = 0; p < 6; ++p)
    squares += std::pow(line(static_cast<double>(p) / 5, p).first - std::log(t[p]), 2) / 6;
  EXPECT_NEAR(map.interpolation_error(), std::sqrt(squares), 1e-9);
  for (const double place : {3.0, 6.1, 9.7, 13.0, 14.0}) {
    const double position[] = {place};
    const auto found = map.at(position);
    const auto [value, variance] = line((place - 3) / 10, 6);
    EXPECT_NEAR(found.temperature.value, std::exp(value), 1e-9) << place;
    EXPECT_NEAR(found.temperature.std_error, std::exp(value) * std::sqrt(variance + squares), 1e-9) << place;
    EXPECT_EQ(found.inside, place <= 13) << place;
  }
}

// Percival and others (2022): power m = parameters + 2 + (n - 1 + B)/(1 + B), B = b (numbers - parameters), b = (n -
// numbers - 2)/((n - numbers - 1) (n - numbers - 4)).
TEST(EstimatedCovarianceByHand, HasTheTailsAsTheyArePrinted) {
  const double n = 30, numbers = 10, parameters = 2, chi2 = 7, log_determinant = -3;
  const double b = (n - numbers - 2) / ((n - numbers - 1) * (n - numbers - 4)) * (numbers - parameters);
  const double power = parameters + 2 + (n - 1 + b) / (1 + b);
  EXPECT_NEAR(log_likelihood({chi2, log_determinant}, {30, 10, 2}),
              -0.5 * (power * std::log(1 + chi2 / (n - 1)) + log_determinant), 1e-12);
}

}  // namespace
}  // namespace shakebed::fit::by_hand
