#include "fit/profile_fit/fit_profile.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fit/theory/expansion.hpp"
#include "fit/theory/fermi_profile.hpp"
#include "tests/fit/synthetic.hpp"

namespace shakebed::fit {
namespace {

using synthetic::profile_of;
using synthetic::top_of;

FitOptions core_options(double plateau_density) {
  FitOptions options;
  options.plateau_density = plateau_density;
  options.interval = options.sweep = options.compare = false;
  options.curve_points = 0;
  return options;
}

bool any_number_is_not_finite(const FitResult& r) {
  std::vector<double> numbers{r.chi2,
                              r.chi2_per_dof,
                              r.p_value,
                              r.aic,
                              r.bic,
                              r.window_low,
                              r.window_high,
                              r.area,
                              r.solid_height_by_sum_rule,
                              r.temperature_interval.low,
                              r.temperature_interval.high};
  for (const Estimate& e : {r.temperature, r.shift, r.solid_height, r.plateau_density, r.column_number,
                            r.critical_temperature, r.reduced_temperature}) {
    numbers.push_back(e.value);
    numbers.push_back(e.std_error);
  }
  numbers.insert(numbers.end(), r.covariance.begin(), r.covariance.end());
  for (const CurvePoint& c : r.curve) numbers.insert(numbers.end(), {c.height, c.density, c.smoothed_density});
  for (const WindowFit& w : r.window_sweep) {
    numbers.insert(numbers.end(),
                   {w.low, w.high, w.temperature.value, w.temperature.std_error, w.shift.value, w.chi2_per_dof});
  }
  for (const ModelFit& m : r.model_comparison) {
    numbers.insert(numbers.end(), {m.temperature.value, m.temperature.std_error, m.shift.value, m.chi2, m.aic, m.bic});
  }
  for (const double number : numbers) {
    if (!std::isfinite(number)) return true;
  }
  return false;
}

const Kernel all_kernels[] = {
    {}, {KernelKind::top_hat, 0.25}, {KernelKind::gaussian, 0.3}, {KernelKind::disk_chord, 1.0}};

TEST(FitProfile, ReturnsTheTruthOfNoiselessProfiles) {
  for (const double reduced : {0.1, 0.5, 0.9, 0.999, 1.0, 1.001, 1.5, 10.0, 100.0}) {
    for (const Kernel& kernel : all_kernels) {
      const Column column{11.22, 1.10};
      const double t = reduced * critical_temperature(enskog(), column).value;
      const auto truth = HydrostaticProfile::of_column(enskog(), t, column);
      Profile data = profile_of(truth, kernel, 100, top_of(truth), 0.0, 1);
      for (double& error : data.std_error) error = 1e-3;
      FitOptions options = core_options(1.10);
      options.kernel = kernel;
      const FitResult fit = fit_profile(data, options);
      ASSERT_EQ(fit.status, FitStatus::ok) << reduced << " " << to_string(kernel.kind) << ": " << fit.message;
      EXPECT_NEAR(fit.temperature.value / t, 1.0, 1e-7) << reduced << " " << to_string(kernel.kind);
      const double shift =
          truth.top_of_solid() -
          (reduced > 1.0 ? t * (enskog().f(1.10).value - enskog().f(truth.bottom_density()).value) : 0.0);
      EXPECT_NEAR(fit.shift.value, shift, 1e-6 * (1.0 + std::abs(shift)));
      EXPECT_NEAR(fit.solid_height.value, truth.solid_height(), 1e-6 * (1.0 + 100.0 * t));
      EXPECT_NEAR(fit.column_number.value, 11.22, 1e-5);
      EXPECT_NEAR(fit.reduced_temperature.value / reduced, 1.0, 2e-6);
    }
  }
}

TEST(FitProfile, FreesThePlateauOrTiesTheColumnWhenAsked) {
  const Column column{11.22, 1.10};
  const double t = 0.12;
  const auto truth = HydrostaticProfile::of_column(enskog(), t, column);
  const Profile data = profile_of(truth, {}, 100, top_of(truth), 1e-4, 7);
  FitOptions options = core_options(close_packing_density);
  options.plateau_density_free = true;
  FitResult fit = fit_profile(data, options);
  ASSERT_EQ(fit.status, FitStatus::ok);
  EXPECT_NEAR(fit.plateau_density.value, 1.10, 4.0 * fit.plateau_density.std_error);
  EXPECT_NEAR(fit.temperature.value, t, 4.0 * fit.temperature.std_error);
  EXPECT_EQ(fit.parameters, (std::vector<std::string>{"temperature", "shift", "plateau_density"}));

  options = core_options(1.10);
  options.column_number = 11.22;
  options.constrain_column = true;
  fit = fit_profile(data, options);
  ASSERT_EQ(fit.status, FitStatus::ok);
  EXPECT_EQ(fit.parameters, (std::vector<std::string>{"temperature"}));
  EXPECT_NEAR(fit.temperature.value, t, 4.0 * fit.temperature.std_error);
  EXPECT_NEAR(fit.shift.value, fit.solid_height_by_sum_rule, 1e-9);

  options = core_options(1.10);
  options.fixed_temperature = t;
  fit = fit_profile(data, options);
  ASSERT_EQ(fit.status, FitStatus::ok);
  EXPECT_EQ(fit.temperature.value, t);
  EXPECT_TRUE(fit.temperature.fixed);
  EXPECT_NEAR(fit.shift.value, truth.top_of_solid(), 4.0 * fit.shift.std_error);

  options = core_options(1.10);
  options.fixed_shift = truth.top_of_solid();
  fit = fit_profile(data, options);
  ASSERT_EQ(fit.status, FitStatus::ok);
  EXPECT_NEAR(fit.temperature.value, t, 4.0 * fit.temperature.std_error);
}

TEST(FitProfile, FitsWholeColumnsOfEveryEquationOfState) {
  for (const EquationOfState* equation : equations_of_state()) {
    for (const double t : {0.12, 0.5, 3.0}) {
      const auto truth = HydrostaticProfile::of_column(*equation, t, {11.22, 1.10});
      if (!truth.ok()) continue;  // Kolafa-Rottner alone ends at freezing
      const Kernel kernel{KernelKind::gaussian, 0.3};
      const Profile data = profile_of(truth, kernel, 100, top_of(truth), 1e-3, 3);
      FitOptions options = core_options(1.10);
      options.model = "hydrostatic:" + std::string(equation->name());
      options.kernel = kernel;
      for (const bool known : {true, false}) {
        options.column_number.reset();
        if (known) options.column_number = 11.22;
        const FitResult fit = fit_profile(data, options);
        ASSERT_EQ(fit.status, FitStatus::ok) << options.model << " " << t << " " << fit.message;
        EXPECT_NEAR(fit.temperature.value, t, 4.5 * fit.temperature.std_error) << options.model;
        EXPECT_LT(fit.temperature.std_error, 0.02 * t);
        EXPECT_NEAR(fit.column_number.value, 11.22, known ? 0.0 : 4.5 * fit.column_number.std_error);
      }
    }
  }
}

TEST(FitProfile, FitsTheFermiProfile) {
  const FermiProfile truth{1.1, 9.0, 0.7};
  Profile data;
  for (double z = 0.1; z < 18.0; z += 0.2) data.height.push_back(z);
  data.number_density.resize(data.height.size());
  truth.sample(data.height, {}, data.number_density);
  data.std_error.assign(data.height.size(), 1e-4);
  FitOptions options = core_options(1.0);
  options.model = "fermi";
  options.plateau_density_free = true;
  const FitResult fit = fit_profile(data, options);
  ASSERT_EQ(fit.status, FitStatus::ok);
  EXPECT_NEAR(fit.temperature.value, 0.7, 1e-7);
  EXPECT_NEAR(fit.shift.value, 9.0, 1e-7);
  EXPECT_NEAR(fit.plateau_density.value, 1.1, 1e-7);
}

TEST(FitProfile, DerivativesMatchDifferences) {
  // Through the covariance: for known errors it is (J^T J)^-1, here rebuilt with central differences of evaluate_model.
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.10, {11.22, 1.10});
  for (const Kernel& kernel : all_kernels) {
    Profile data = profile_of(truth, kernel, 80, top_of(truth), 0.0, 1);
    for (double& error : data.std_error) error = 1e-3;
    FitOptions options = core_options(1.10);
    options.kernel = kernel;
    options.plateau_density_free = true;
    const FitResult fit = fit_profile(data, options);
    ASSERT_EQ(fit.status, FitStatus::ok);
    std::vector<double> heights;
    for (const Residual& r : fit.residuals) {
      if (r.used) heights.push_back(r.height);
    }
    const auto model = [&](double dt, double ds, double dp) {
      return evaluate_model(options, fit.temperature.value + dt, fit.shift.value + ds, fit.plateau_density.value + dp,
                            0.0, heights)
          .densities;
    };
    const double h[3] = {1e-5, 1e-4, 1e-5};
    std::vector<std::vector<double>> gradient;
    for (int p = 0; p < 3; ++p) {
      const double step[3] = {p == 0 ? h[0] : 0.0, p == 1 ? h[1] : 0.0, p == 2 ? h[2] : 0.0};
      const auto up = model(step[0], step[1], step[2]);
      const auto down = model(-step[0], -step[1], -step[2]);
      gradient.emplace_back();
      for (std::size_t i = 0; i < up.size(); ++i) gradient.back().push_back((up[i] - down[i]) / (2.0 * h[p] * 1e-3));
    }
    // C times J^T J must be the identity.
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        double sum = 0.0;
        double scale = 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
          double normal = 0.0;
          for (std::size_t b = 0; b < heights.size(); ++b) normal += gradient[k][b] * gradient[j][b];
          sum += fit.covariance[3 * i + k] * normal;
          scale += std::abs(fit.covariance[3 * i + k] * normal);
        }
        EXPECT_NEAR(sum, i == j ? 1.0 : 0.0, 1e-5 * scale) << to_string(kernel.kind) << " " << i << j;
      }
    }
  }
}

TEST(FitProfile, UsesTheFullCovariance) {
  // Noise smoothed over neighbouring bins: with the covariance the error is right, without it too small.
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.15, {11.22, 1.10});
  double pull_with = 0.0;
  double pull_without = 0.0;
  const int trials = 300;
  for (int trial = 0; trial < trials; ++trial) {
    Profile data = profile_of(truth, {}, 80, top_of(truth), 0.0, 1);
    const std::size_t n = data.height.size();
    synthetic::Normal normal(1000 + static_cast<std::uint64_t>(trial));
    std::vector<double> white(n + 4);
    for (double& x : white) x = normal();
    std::vector<double> sigma(n);
    for (std::size_t i = 0; i < n; ++i) {
      sigma[i] = synthetic::bin_error(data.number_density[i], 0.005);
      double sum = 0.0;
      for (std::size_t k = 0; k < 5; ++k) sum += white[i + k];
      data.number_density[i] += sigma[i] * sum / std::sqrt(5.0);
    }
    data.std_error = sigma;
    data.covariance.assign(n * n, 0.0);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        const auto apart = static_cast<double>(i > j ? i - j : j - i);
        data.covariance[i * n + j] = sigma[i] * sigma[j] * std::max(0.0, 1.0 - apart / 5.0);
      }
    }
    FitOptions options = core_options(1.10);
    options.window.low = 3.0;
    options.window.high = 12.0;
    const FitResult with = fit_profile(data, options);
    data.covariance.clear();
    const FitResult without = fit_profile(data, options);
    ASSERT_EQ(with.status, FitStatus::ok);
    ASSERT_EQ(without.status, FitStatus::ok);
    pull_with += std::pow((with.temperature.value - 0.15) / with.temperature.std_error, 2);
    pull_without += std::pow((without.temperature.value - 0.15) / without.temperature.std_error, 2);
  }
  // chi2 with 300 degrees of freedom: 1 +- 0.082; 4 sigma.
  EXPECT_NEAR(pull_with / trials, 1.0, 4.0 * std::sqrt(2.0 / trials));
  EXPECT_GT(pull_without / trials, 2.0);
}

// Weights by a covariance of few samples are uncertain themselves: T scatters more, by the formula of Percival and
// others (2014), here as they print it. The covariance is that of independent heights, so that nothing else changes. Of
// so many heights and samples the number of independent heights is n = p + (n' - p)^2/t, n' those of the window and
// t the trace of the squared covariance, estimated without bias from v = samples - 1 (Srivastava 2005).
TEST(FitProfile, StatesWhatUncertainWeightsAddToErrors) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.15, {11.22, 1.10});
  Profile data = profile_of(truth, {}, 40, top_of(truth), 0.005, 11);
  FitOptions options = core_options(1.10);
  options.window.low = 3.0;
  const FitResult plain = fit_profile(data, options);
  ASSERT_EQ(plain.status, FitStatus::ok);
  ASSERT_FALSE(plain.misfit);
  double bins = 0;
  for (const Residual& residual : plain.residuals) bins += residual.used;
  const double dof = plain.dof, parameters = bins - dof;
  for (const int samples : {60, 100, 1000}) {
    synthetic::take_errors_for_covariance(data, samples);
    const FitResult weighed = fit_profile(data, options);
    ASSERT_EQ(weighed.status, FitStatus::ok);
    const double ns = samples, v = ns - 1;
    const double trace = std::max(v * v / ((v + 2) * (v - 1)) * (dof - dof * dof / v), dof * dof / bins);
    const double heights = parameters + dof * dof / trace, divisor = (ns - heights - 1) * (ns - heights - 4);
    const double a = 2 / divisor, b = (ns - heights - 2) / divisor;
    const double factor = std::sqrt((1 + b * (heights - parameters)) / (1 + a + b * (parameters + 1)));
    EXPECT_NEAR(weighed.temperature.std_error / plain.temperature.std_error, factor, 1e-6) << samples;
    EXPECT_NEAR(weighed.temperature.value, plain.temperature.value, 1e-8);
  }
}

// What a model misses is the same in every measurement: T scatters by the statistical error, 4 standard errors of a
// scatter of 200, the whole error is larger, and the interval of the next bed holds the mean of many in 95 %, 4
// standard errors of a share. With errors alone and with a covariance.
TEST(FitProfile, TellsTheNoiseInTFromWhatTheModelMisses) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.6, {11.22, 1.10});
  constexpr int trials = 200;
  for (const bool covariance : {false, true}) {
    std::vector<FitResult> fits;
    double mean = 0.0;
    for (int trial = 0; trial < trials; ++trial) {
      Profile data = profile_of(truth, {}, 60, top_of(truth), 0.005, 3000 + static_cast<std::uint64_t>(trial));
      for (std::size_t i = 0; i < data.height.size(); ++i)
        data.number_density[i] += 0.02 * std::sin(2.0 * data.height[i]) * std::min(1.0, 5.0 * data.number_density[i]);
      if (covariance) synthetic::take_errors_for_covariance(data, 5000);
      FitOptions options = core_options(1.10);
      options.interval = true;
      options.window.low = 1.0;
      fits.push_back(fit_profile(data, options));
      ASSERT_EQ(fits.back().status, FitStatus::ok);
      ASSERT_GT(fits.back().model_error, 0.0);
      mean += fits.back().temperature.value / trials;
    }
    double scatter = 0.0, stated = 0.0;
    int held = 0;
    for (const FitResult& fit : fits) {
      scatter += std::pow(fit.temperature.value - mean, 2) / (trials - 1);
      stated += fit.statistical_error * fit.statistical_error / trials;
      held += fit.next_bed_interval.low < mean && mean < fit.next_bed_interval.high;
      EXPECT_GT(fit.temperature.std_error, 1.5 * fit.statistical_error);
      EXPECT_LT(fit.temperature_interval.low, fit.next_bed_interval.low);
      EXPECT_GT(fit.temperature_interval.high, fit.next_bed_interval.high);
    }
    EXPECT_NEAR(std::sqrt(stated / scatter), 1.0, 4.0 / std::sqrt(2.0 * trials)) << covariance;
    EXPECT_NEAR(held, 0.95 * trials, 4.0 * std::sqrt(0.95 * 0.05 * trials)) << covariance;
  }
}

// An error of the model that is known beforehand enters where the data do not show it, and changes nothing where they
// show more.
TEST(FitProfile, TakesAnErrorOfTheModelThatIsKnownBeforehand) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.6, {11.22, 1.10});
  FitOptions options = core_options(1.10);
  const Profile good = profile_of(truth, {}, 60, top_of(truth), 0.005, 7);
  const FitResult plain = fit_profile(good, options);
  ASSERT_EQ(plain.model_error, 0.0);
  options.least_model_error = 0.01;
  const FitResult with = fit_profile(good, options);
  EXPECT_DOUBLE_EQ(with.model_error, 0.01);
  EXPECT_GT(with.temperature.std_error, plain.temperature.std_error);
  EXPECT_DOUBLE_EQ(with.chi2, plain.chi2) << "by the measured errors alone";
  // Errors that are not known follow from the residuals, which have it in them.
  Profile bare = good;
  bare.std_error.clear();
  const FitResult residuals = fit_profile(bare, options);
  EXPECT_EQ(residuals.model_error, 0.0);
  EXPECT_EQ(residuals.temperature.std_error, fit_profile(bare, core_options(1.10)).temperature.std_error);
  Profile bad = good;
  for (std::size_t i = 0; i < bad.height.size(); ++i)
    bad.number_density[i] += 0.1 * std::sin(2.0 * bad.height[i]) * std::min(1.0, 5.0 * bad.number_density[i]);
  const FitResult more = fit_profile(bad, options);
  ASSERT_GT(more.model_error, 0.02);
  options.least_model_error = 0.0;
  EXPECT_DOUBLE_EQ(fit_profile(bad, options).temperature.value, more.temperature.value);
}

// The same noise with every tenth bin off by 8 errors: the robust fit states what T scatters by, to four standard
// errors of a variance from 200 profiles, and scatters by less than half of what the plain one does.
TEST(FitProfile, IsRobustWithAFullCovariance) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.15, {11.22, 1.10});
  constexpr int trials = 200;
  double pulls = 0.0, robust_square = 0.0, plain_square = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    Profile data = profile_of(truth, {}, 80, top_of(truth), 0.0, 1);
    const std::size_t n = data.height.size();
    synthetic::Normal normal(5000 + static_cast<std::uint64_t>(trial));
    std::vector<double> white(n + 4);
    for (double& x : white) x = normal();
    data.std_error.clear();
    for (std::size_t i = 0; i < n; ++i) {
      data.std_error.push_back(synthetic::bin_error(data.number_density[i], 0.005));
      double sum = 0.0;
      for (std::size_t k = 0; k < 5; ++k) sum += white[i + k] / std::sqrt(5.0);
      if (std::abs(normal()) < 0.12566) sum += normal() > 0.0 ? 8.0 : -8.0;  // of normal numbers 10 % are that small
      data.number_density[i] += data.std_error[i] * sum;
    }
    data.covariance.assign(n * n, 0.0);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        const auto apart = static_cast<double>(i > j ? i - j : j - i);
        data.covariance[i * n + j] = data.std_error[i] * data.std_error[j] * std::max(0.0, 1.0 - apart / 5.0);
      }
    }
    FitOptions options = core_options(1.10);
    options.window.low = 3.0;
    options.window.high = 12.0;
    const FitResult plain = fit_profile(data, options);
    options.robust = true;
    const FitResult robust = fit_profile(data, options);
    ASSERT_TRUE(robust.ok()) << robust.message;
    ASSERT_TRUE(plain.ok()) << plain.message;
    pulls += std::pow((robust.temperature.value - 0.15) / robust.temperature.std_error, 2) / trials;
    robust_square += std::pow(robust.temperature.value - 0.15, 2);
    plain_square += std::pow(plain.temperature.value - 0.15, 2);
  }
  EXPECT_NEAR(pulls, 1.0, 4.0 * std::sqrt(2.0 / trials));
  EXPECT_LT(robust_square, 0.5 * plain_square);
}

TEST(FitProfile, ReportsWindowSweepComparisonCurveAndInterval) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.12, {11.22, 1.10});
  const Kernel kernel{KernelKind::top_hat, 0.15};
  const Profile data = profile_of(truth, kernel, 100, top_of(truth), 0.01, 11);
  FitOptions options;
  options.plateau_density = 1.10;
  options.kernel = kernel;
  options.column_number = 11.22;
  const FitResult fit = fit_profile(data, options);
  ASSERT_EQ(fit.status, FitStatus::ok);
  EXPECT_FALSE(any_number_is_not_finite(fit));
  EXPECT_FALSE(fit.window_rule.empty());
  EXPECT_GE(fit.window_low, 1.5);
  EXPECT_GE(fit.window_sweep.size(), 10U);
  for (const WindowFit& row : fit.window_sweep) {
    ASSERT_EQ(row.status, FitStatus::ok) << row.low << " " << row.high;
    EXPECT_NEAR(row.temperature.value, 0.12, 5.0 * row.temperature.std_error) << row.low;
  }
  EXPECT_EQ(fit.curve.size(), 200U);
  EXPECT_EQ(fit.residuals.size(), 100U);
  ASSERT_GE(fit.model_comparison.size(), 6U);
  EXPECT_EQ(fit.model_comparison[0].model, "enskog-rectangle");
  EXPECT_EQ(fit.model_comparison[0].temperature.value, fit.temperature.value);
  EXPECT_TRUE(fit.model_comparison[1].plateau_density_free);
  for (const ModelFit& row : fit.model_comparison) {
    if (row.model == "fermi" || row.model == "rectangle" || row.model == "hydrostatic:best-of") {
      EXPECT_GT(row.aic, fit.aic + 10.0) << row.model;
    }
  }
  // The likelihood interval is close to value -+ 1.96 std_error.
  ASSERT_EQ(fit.temperature_interval.status, FitStatus::ok);
  EXPECT_NEAR(fit.temperature_interval.high - fit.temperature_interval.low, 2.0 * 1.96 * fit.temperature.std_error,
              0.1 * fit.temperature.std_error);
  EXPECT_GT(fit.temperature_interval.high, fit.temperature.value);
  EXPECT_LT(fit.temperature_interval.low, fit.temperature.value);
}

// --- hard cases
// --------------------------------------------------------------------------------------------------------

// A good profile to spoil.
Profile good_profile() {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.12, {11.22, 1.10});
  return profile_of(truth, {}, 100, 13.0, 0.01, 5);
}

FitOptions full_options() {
  FitOptions options;
  options.plateau_density = 1.10;
  options.column_number = 11.22;
  return options;
}

TEST(FitHardCases, PureRectangleGivesABoundNotANumber) {
  Profile data;
  for (double z = 0.05; z < 14.0; z += 0.1) {
    data.height.push_back(z);
    data.number_density.push_back(z < 10.2 ? 1.10 : 0.0);
    data.std_error.push_back(0.01);
  }
  const FitResult fit = fit_profile(data, full_options());
  EXPECT_EQ(fit.status, FitStatus::unresolved_temperature) << fit.message;
  EXPECT_FALSE(any_number_is_not_finite(fit));
  EXPECT_TRUE(fit.temperature_interval.low_open);
  EXPECT_GT(fit.temperature_interval.high, 0.0);
  EXPECT_LT(fit.temperature_interval.high, 0.01);
  EXPECT_NEAR(fit.solid_height.value, 10.2, 0.1);
}

TEST(FitHardCases, ThreeBinsAreEnoughAndTwoAreNot) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.5, {11.22, 1.10});
  Profile data;
  for (const double z : {4.0, 9.0, 13.0}) {
    data.height.push_back(z);
    data.number_density.push_back(truth.density(z));
    data.std_error.push_back(0.01);
  }
  FitResult fit = fit_profile(data, full_options());
  ASSERT_EQ(fit.status, FitStatus::ok) << fit.message;
  EXPECT_NEAR(fit.temperature.value, 0.5, 1e-6);
  EXPECT_FALSE(any_number_is_not_finite(fit));
  // So they are for other models of two parameters; one with a free plateau has three.
  FitOptions without_column;
  without_column.plateau_density = 1.10;
  for (const ModelFit& row : fit_profile(data, without_column).model_comparison) {
    const bool three = row.plateau_density_free && row.model != "rectangle";
    EXPECT_EQ(row.status == FitStatus::too_few_bins, three) << row.model;
  }
  data.height.pop_back();
  data.number_density.pop_back();
  data.std_error.pop_back();
  fit = fit_profile(data, full_options());
  EXPECT_EQ(fit.status, FitStatus::too_few_bins);
  EXPECT_FALSE(fit.message.empty());
}

TEST(FitHardCases, AHundredThousandBins) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.12, {11.22, 1.10});
  const Kernel kernel{KernelKind::gaussian, 0.3};
  const Profile data = profile_of(truth, kernel, 100000, 13.0, 0.1, 5);
  FitOptions options = full_options();
  options.kernel = kernel;
  options.sweep = options.compare = options.interval = false;
  const FitResult fit = fit_profile(data, options);
  ASSERT_EQ(fit.status, FitStatus::ok) << fit.message;
  EXPECT_NEAR(fit.temperature.value, 0.12, 4.0 * fit.temperature.std_error);
  EXPECT_LT(fit.temperature.std_error, 1e-3);
}

TEST(FitHardCases, AnOutlierIsNamedAndTheRobustOptionBoundsIt) {
  const Profile clean = good_profile();
  Profile data = clean;
  data.number_density[60] += 50.0 * data.std_error[60];
  FitOptions options = full_options();
  const FitResult plain = fit_profile(data, options);
  EXPECT_FALSE(any_number_is_not_finite(plain));
  EXPECT_THAT(plain.warnings, testing::Contains(testing::HasSubstr("an outlier")));
  options.robust = true;
  const FitResult robust = fit_profile(data, options);
  ASSERT_EQ(robust.status, FitStatus::ok);
  const FitResult reference = fit_profile(clean, full_options());
  EXPECT_NEAR(robust.temperature.value, reference.temperature.value, reference.temperature.std_error);
  EXPECT_GT(std::abs(plain.temperature.value - reference.temperature.value),
            2.0 * std::abs(robust.temperature.value - reference.temperature.value));
}

// A profile of which every height is off is one that the model does not fit, not one with an outlier.
TEST(FitHardCases, ManyDensitiesThatAreOffAreNoOutlier) {
  Profile data = good_profile();
  for (std::size_t i = 0; i < data.number_density.size(); ++i)
    data.number_density[i] += (i % 2 == 0 ? 15.0 : -15.0) * data.std_error[i];
  const FitResult fit = fit_profile(data, full_options());
  EXPECT_THAT(fit.warnings, testing::Contains(testing::HasSubstr("The model does not fit")));
  EXPECT_THAT(fit.warnings, testing::Not(testing::Contains(testing::HasSubstr("an outlier"))));
}

TEST(FitHardCases, RobustCostsFivePerCentOnCleanData) {
  const FitResult plain = fit_profile(good_profile(), core_options(1.10));
  FitOptions options = core_options(1.10);
  options.robust = true;
  const FitResult robust = fit_profile(good_profile(), options);
  ASSERT_EQ(robust.status, FitStatus::ok);
  EXPECT_NEAR(robust.temperature.value, plain.temperature.value, plain.temperature.std_error);
  // Huber's loss at 1.345: 95 % efficient, errors 2.6 % larger, give or take how many of ~60 residuals lie beyond.
  EXPECT_NEAR(robust.temperature.std_error / plain.temperature.std_error, 1.026, 0.15);
}

TEST(FitHardCases, AllZeroAndConstantProfilesHaveAStatus) {
  Profile zero = good_profile();
  for (double& d : zero.number_density) d = 0.0;
  EXPECT_EQ(fit_profile(zero, full_options()).status, FitStatus::no_signal);
  Profile negative = good_profile();
  for (double& d : negative.number_density) d = -0.1;
  EXPECT_EQ(fit_profile(negative, full_options()).status, FitStatus::no_signal);
  Profile constant = good_profile();
  for (double& d : constant.number_density) d = 0.8;
  EXPECT_EQ(fit_profile(constant, full_options()).status, FitStatus::no_tail);
  for (std::size_t i = 0; i < constant.height.size(); ++i)
    constant.number_density[i] += (i % 2 == 0 ? 0.5 : -0.5) * constant.std_error[i];
  EXPECT_EQ(fit_profile(constant, full_options()).status, FitStatus::no_tail);
  constant.std_error.clear();
  for (double& d : constant.number_density) d = 0.8;
  EXPECT_EQ(fit_profile(constant, full_options()).status, FitStatus::no_tail);
  EXPECT_FALSE(any_number_is_not_finite(fit_profile(constant, full_options())));
}

TEST(FitHardCases, BrokenInputIsNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const auto expect_bad = [](const Profile& profile, const FitOptions& options, const char* word) {
    const FitResult fit = fit_profile(profile, options);
    EXPECT_EQ(fit.status, FitStatus::bad_input) << word;
    EXPECT_THAT(fit.message, testing::HasSubstr(word));
    EXPECT_FALSE(any_number_is_not_finite(fit));
  };
  expect_bad({}, full_options(), "empty");
  for (const double bad : {nan, inf, -inf}) {
    Profile data = good_profile();
    data.number_density[3] = bad;
    expect_bad(data, full_options(), "density is not a finite number in bin 3");
    data = good_profile();
    data.height[3] = bad;
    expect_bad(data, full_options(), "height is not a finite number");
    data = good_profile();
    data.std_error[3] = bad;
    expect_bad(data, full_options(), "standard error is not a finite number");
  }
  Profile data = good_profile();
  data.std_error[3] = -1.0;
  expect_bad(data, full_options(), "negative");
  data = good_profile();
  data.number_density.pop_back();
  expect_bad(data, full_options(), "densities");
  data = good_profile();
  data.std_error.pop_back();
  expect_bad(data, full_options(), "standard errors");
  data = good_profile();
  data.covariance.assign(5, 1.0);
  expect_bad(data, full_options(), "covariance");
  FitOptions options = full_options();
  options.model = "enskog-triangle";
  expect_bad(good_profile(), options, "enskog-triangle");
  options = full_options();
  options.kernel = {KernelKind::gaussian, -1.0};
  expect_bad(good_profile(), options, "kernel");
  options = full_options();
  options.column_number = -3.0;
  expect_bad(good_profile(), options, "N D/W");
  options = full_options();
  options.constrain_column = true;
  options.column_number.reset();
  expect_bad(good_profile(), options, "constrain_column");
}

TEST(FitHardCases, UnsortedAndDuplicateHeightsGiveTheSameFit) {
  const FitResult reference = fit_profile(good_profile(), full_options());
  Profile shuffled;
  const Profile data = good_profile();
  for (std::size_t i = 0; i < data.height.size(); ++i) {
    const std::size_t j = (i * 37) % data.height.size();
    shuffled.height.push_back(data.height[j]);
    shuffled.number_density.push_back(data.number_density[j]);
    shuffled.std_error.push_back(data.std_error[j]);
  }
  const FitResult fit = fit_profile(shuffled, full_options());
  ASSERT_EQ(fit.status, FitStatus::ok);
  EXPECT_NEAR(fit.temperature.value / reference.temperature.value, 1.0, 1e-12);
  EXPECT_THAT(fit.warnings, testing::Contains(testing::HasSubstr("sorted")));
  // Every bin twice with errors sqrt 2 larger: the same information.
  Profile twice;
  for (std::size_t i = 0; i < data.height.size(); ++i) {
    for (int k = 0; k < 2; ++k) {
      twice.height.push_back(data.height[i]);
      twice.number_density.push_back(data.number_density[i]);
      twice.std_error.push_back(std::sqrt(2.0) * data.std_error[i]);
    }
  }
  FitOptions options = full_options();
  options.window.low = reference.window_low;
  options.window.high = reference.window_high;
  const FitResult doubled = fit_profile(twice, options);
  ASSERT_EQ(doubled.status, FitStatus::ok);
  EXPECT_NEAR(doubled.temperature.value / reference.temperature.value, 1.0, 1e-8);
  EXPECT_NEAR(doubled.temperature.std_error / reference.temperature.std_error, 1.0, 1e-6);
  EXPECT_NEAR(doubled.area, reference.area, 1e-9);
  EXPECT_THAT(doubled.warnings, testing::Contains(testing::HasSubstr("the height of another bin")));
}

TEST(FitHardCases, MissingZeroAndTinyErrorsMeanNoErrors) {
  Profile data = good_profile();
  data.std_error.clear();
  const FitResult missing = fit_profile(data, full_options());
  ASSERT_EQ(missing.status, FitStatus::ok);
  EXPECT_TRUE(missing.errors_scaled);
  EXPECT_NEAR(missing.temperature.value, 0.12, 5.0 * missing.temperature.std_error);
  EXPECT_GT(missing.temperature.std_error, 1e-4);
  for (const double tiny : {0.0, 1e-300}) {
    data = good_profile();
    for (double& error : data.std_error) error = tiny;
    const FitResult fit = fit_profile(data, full_options());
    ASSERT_EQ(fit.status, FitStatus::ok);
    EXPECT_EQ(fit.temperature.value, missing.temperature.value);
    EXPECT_FALSE(any_number_is_not_finite(fit));
  }
  data = good_profile();
  data.std_error[50] = 0.0;
  data.std_error[55] = 1e-300;
  const FitResult some = fit_profile(data, full_options());
  ASSERT_EQ(some.status, FitStatus::ok);
  EXPECT_NEAR(some.temperature.value, 0.12, 5.0 * some.temperature.std_error);
  EXPECT_THAT(some.warnings, testing::Contains(testing::HasSubstr("median error")));
  EXPECT_FALSE(any_number_is_not_finite(some));
}

TEST(FitHardCases, NegativeDensitiesAreUsedWithAWord) {
  Profile data = good_profile();
  data.number_density[95] = -0.02;
  const FitResult fit = fit_profile(data, full_options());
  EXPECT_EQ(fit.status, FitStatus::ok);
  EXPECT_THAT(fit.warnings, testing::Contains(testing::HasSubstr("negative density")));
}

TEST(FitHardCases, PlateauAtTheSingularityHasAStatus) {
  FitOptions options = full_options();
  for (const double phi : {1.3, 1.0 / enskog_constants().a, 5.0}) {
    options.plateau_density = phi;
    const FitResult fit = fit_profile(good_profile(), options);
    EXPECT_EQ(fit.status, FitStatus::undefined_model) << phi;
    EXPECT_FALSE(any_number_is_not_finite(fit));
  }
  options.plateau_density = 2.0 / std::sqrt(3.0);  // however it was rounded
  EXPECT_EQ(fit_profile(good_profile(), options).status, FitStatus::ok);
  options.plateau_density = -1.0;
  EXPECT_EQ(fit_profile(good_profile(), options).status, FitStatus::bad_input);
  options = full_options();
  options.model = "hydrostatic:best-of";  // no T_c at its pole, but a fit
  options.plateau_density = close_packing_density;
  const FitResult fit = fit_profile(good_profile(), options);
  EXPECT_EQ(fit.critical_status, ValueStatus::pole);
  EXPECT_EQ(fit.critical_temperature.value, 0.0);
}

TEST(FitHardCases, ACurveThatIsNotDefinedHasAStatus) {
  const std::vector<double> heights{1, 2, 3};
  const auto curve = [&](const FitOptions& options, double temperature, double plateau) {
    return evaluate_model(options, temperature, 2, plateau, 0, heights);
  };
  FitOptions options;
  EXPECT_EQ(curve(options, 0.2, 1.0).status, FitStatus::ok);
  EXPECT_EQ(curve(options, 0.2, 1.0).densities.size(), 3U);
  EXPECT_EQ(curve(options, -0.2, 1.0).status, FitStatus::undefined_model);
  EXPECT_EQ(curve(options, 0.2, 1.3).status, FitStatus::undefined_model) << "beyond the pole of Enskog's equation";
  EXPECT_TRUE(curve(options, 0.2, 1.3).densities.empty());
  options.kernel = {KernelKind::gaussian, -1};
  EXPECT_EQ(curve(options, 0.2, 1.0).status, FitStatus::bad_input);
  options = {};
  options.model = "gauss";
  EXPECT_EQ(curve(options, 0.2, 1.0).status, FitStatus::bad_input);
}

TEST(FitHardCases, HeightsInTheWrongUnitAreNoticed) {
  for (const double unit : {2.99, 2.99e-3, 16.0}) {  // mm, m, px for a disk of 2.99 mm
    Profile data = good_profile();
    for (double& height : data.height) height *= unit;
    const FitResult fit = fit_profile(data, full_options());
    EXPECT_THAT(fit.warnings, testing::Contains(testing::HasSubstr("wrong unit"))) << unit;
    EXPECT_FALSE(any_number_is_not_finite(fit)) << unit;
  }
  EXPECT_THAT(fit_profile(good_profile(), full_options()).warnings,
              testing::Not(testing::Contains(testing::HasSubstr("unit"))));
  Profile metres = good_profile();
  for (double& height : metres.height) height *= 2.99e-3;
  FitOptions options = full_options();
  options.column_number.reset();
  EXPECT_THAT(fit_profile(metres, options).warnings, testing::Contains(testing::HasSubstr("metres")));
}

TEST(FitHardCases, ABedWithoutASolidSaysSo) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.6, {11.22, 1.10});
  const FitResult fit = fit_profile(profile_of(truth, {}, 100, top_of(truth), 0.01, 5), full_options());
  ASSERT_EQ(fit.status, FitStatus::ok);
  EXPECT_EQ(fit.solid_height.value, 0.0);
  EXPECT_GT(fit.reduced_temperature.value, 1.0);
  EXPECT_THAT(fit.warnings, testing::Contains(testing::HasSubstr("no solid")));
}

TEST(FitHardCases, AProfileOfAnotherModelIsDenounced) {
  const FermiProfile fermi{1.1, 9.0, 1.5};
  Profile data;
  for (double z = 0.1; z < 20.0; z += 0.2) data.height.push_back(z);
  data.number_density.resize(data.height.size());
  fermi.sample(data.height, {}, data.number_density);
  for (const double d : data.number_density) data.std_error.push_back(synthetic::bin_error(d, 0.005));
  const FitResult fit = fit_profile(data, full_options());
  EXPECT_THAT(fit.warnings, testing::Contains(testing::HasSubstr("The model does not fit")));
  EXPECT_TRUE(fit.misfit);
  EXPECT_THAT(fit.brief(), testing::HasSubstr("the model does not fit"));
  EXPECT_THAT(fit.warnings, testing::Contains(testing::HasSubstr("changes with the window")));
  EXPECT_TRUE(fit.errors_scaled);
}

TEST(FitHardCases, ASingularCovarianceIsShrunkAndSaid) {
  Profile data = good_profile();
  const std::size_t n = data.height.size();
  data.covariance.assign(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) data.covariance[i * n + j] = data.std_error[i] * data.std_error[j];  // rank 1
  }
  const FitResult fit = fit_profile(data, full_options());
  EXPECT_THAT(fit.warnings, testing::Contains(testing::HasSubstr("its correlations were reduced")));
  EXPECT_FALSE(any_number_is_not_finite(fit));
}

TEST(FitHardCases, AnyProfileEndsInFiniteTimeWithFiniteNumbers) {
  // Random profiles, most of them nonsense, through every model: a status and finite numbers, whatever happens.
  const char* models[] = {"enskog-rectangle",    "hydrostatic:enskog",
                          "hydrostatic:best-of", "hydrostatic:kolafa-rottner",
                          "hydrostatic:luding",  "fermi",
                          "rectangle",           "hydrostatic:henderson"};
  int succeeded = 0;
  for (std::uint64_t seed = 0; seed < 160; ++seed) {
    synthetic::Normal normal(31 * seed + 7);
    const auto uniform = [&] { return 0.5 * std::erfc(-normal() / std::sqrt(2.0)); };
    Profile data;
    const int bins = 1 + static_cast<int>(uniform() * uniform() * 120.0);
    const double range = std::exp(4.0 * normal() + 1.0);
    const double size = std::exp(normal());
    const int shape = static_cast<int>(5.0 * uniform());
    for (int i = 0; i < bins; ++i) {
      const double x = (i + 0.5) / bins;
      data.height.push_back((shape == 4 ? uniform() : x) * range - (shape == 3 ? 0.5 * range : 0.0));
      const double clean = shape == 0 ? 1.0 - x : shape == 1 ? std::exp(-5.0 * x) : shape == 2 ? x : std::abs(normal());
      data.number_density.push_back(size * clean + 0.05 * normal());
      data.std_error.push_back(uniform() < 0.1 ? 0.0 : 0.05 * std::exp(5.0 * normal()));
    }
    if (uniform() < 0.2) data.std_error.clear();
    FitOptions options;
    options.model = models[seed % 8];
    options.plateau_density = 0.2 + 0.95 * uniform();
    options.plateau_density_free = uniform() < 0.3;
    options.kernel = all_kernels[static_cast<std::size_t>(4.0 * uniform()) % 4];
    options.robust = uniform() < 0.3;
    if (uniform() < 0.4) options.column_number = 20.0 * uniform() + 0.01;
    options.constrain_column = options.column_number.has_value() && uniform() < 0.3;
    if (uniform() < 0.2) options.fixed_temperature = std::exp(3.0 * normal());
    if (uniform() < 0.2) options.window.low = range * uniform();
    options.base = normal();
    options.sweep = options.compare = seed % 40 < 8;  // every model in turn; they cost thirty fits
    const FitResult fit = fit_profile(data, options);
    EXPECT_FALSE(any_number_is_not_finite(fit)) << seed << " " << to_string(fit.status);
    EXPECT_TRUE(fit.ok() || !fit.message.empty()) << seed << " " << to_string(fit.status);
    succeeded += fit.ok() ? 1 : 0;
  }
  std::printf("[ measured ] %d of 160 random profiles could be fitted\n", succeeded);
  EXPECT_GT(succeeded, 16);
}

}  // namespace
}  // namespace shakebed::fit
