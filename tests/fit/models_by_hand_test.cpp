// Curves of all models above a base that is not 0: derivatives by differences, areas by sums, starts; and the numbers
// that a fit derives from its parameters.
#include <gsl/gsl_cdf.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "fit/inference/posterior.hpp"
#include "fit/profile_fit/chances.hpp"
#include "fit/profile_fit/fit_model.hpp"
#include "fit/theory/expansion.hpp"
#include "tests/fit/synthetic.hpp"

namespace shakebed::fit::models_by_hand {
namespace {

constexpr double base = 0.7;

struct Case {
  std::string name;
  FitModel::Parameters at;
};
// Cold and hot curves of every kind; the place is a height, or N D/W.
std::vector<Case> cases() {
  std::vector<Case> all{{"enskog-rectangle", {0.3, 6, 1.05}},
                        {"enskog-rectangle", {2, -1, 1.05}},
                        {"fermi", {0.4, 6, 1.05}},
                        {"fermi", {3, 2, 1.05}},
                        {"rectangle", {1, 6.03, 1.05}},
                        {"hydrostatic:enskog", {0.12, 7, 1.05}}};  // on a solid of the plateau density
  for (const EquationOfState* equation : equations_of_state()) {
    for (const double t : {0.25, 3.0}) {
      if (t < 1 && equation->name() == "kolafa-rottner") continue;  // it ends at freezing
      all.push_back({"hydrostatic:" + std::string(equation->name()), {t, 7, 1.05}});
    }
  }
  return all;
}
std::unique_ptr<FitModel> model_of(const Case& one) { return make_fit_model(one.name, base, false, 0.25); }
const std::vector<Kernel> kernels{
    {}, {KernelKind::top_hat, 0.8}, {KernelKind::gaussian, 0.4}, {KernelKind::disk_chord, 1.0}};

TEST(FitModelsByHand, HaveTheDerivativesOfTheirCurves) {
  for (const Case& one : cases()) {
    const auto model = model_of(one);
    for (const Kernel& kernel : kernels) {
      const KernelRule rule(kernel);
      const std::vector<double> heights{0.35, 0.83, 2.21, 4.4, 5.83, 6.31, 7.4, 9.7};
      std::vector<std::array<double, 4>> together(heights.size());
      ASSERT_TRUE(model->set(one.at)) << one.name;
      model->smoothed_with_gradient(heights, rule, together);
      for (std::size_t i = 0; i < heights.size(); ++i) {
        ASSERT_TRUE(model->set(one.at));
        const auto here = model->smoothed_with_gradient(heights[i], rule);
        EXPECT_NEAR(here[0], model->smoothed(heights[i], rule), 1e-9) << one.name << to_string(kernel);
        for (std::size_t k = 0; k < 4; ++k)
          EXPECT_NEAR(together[i][k], here[k], 1e-8 * (1 + std::abs(here[k]))) << one.name << to_string(kernel) << k;
        for (std::size_t p = 0; p < 3; ++p) {
          const auto moved = [&](double step) {
            FitModel::Parameters other = one.at;
            other[p] += step;
            EXPECT_TRUE(model->set(other));
            return model->smoothed(heights[i], rule);
          };
          const double slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
          EXPECT_NEAR(here[1 + p], slope, 2e-5 * (1 + std::abs(slope)))
              << one.name << " " << one.at[0] << " " << to_string(kernel) << " " << heights[i] << " " << p;
        }
      }
    }
  }
}

// The area under the curve is N D/W; the shift is where the tail would reach the plateau, and what is below it solid.
TEST(FitModelsByHand, HaveTheAreaUnderTheirCurves) {
  for (const Case& one : cases()) {
    const auto model = model_of(one);
    ASSERT_TRUE(model->set(one.at));
    double area = 0;
    constexpr double step = 2e-3;
    for (double height = base + step / 2; height < 150; height += step) area += step * model->density(height);
    EXPECT_NEAR(model->column_number(), area, 3e-3) << one.name << " " << one.at[0];
    EXPECT_EQ(model->density(base - 1e-9), 0) << one.name;
    if (model->place_is_column()) {
      EXPECT_EQ(model->column_number(), 7) << one.name;
    }
    if (one.name == "rectangle") continue;
    const double solid = model->solid_height();
    const bool crystal = model->place_is_column() && model->equation().has_pole();
    if (!crystal) {
      EXPECT_NEAR(solid, std::max(0.0, model->shift() - base), 1e-12) << one.name;
    }
    if (solid > 0 && one.name != "fermi") {
      const double edge = crystal ? number_density(freezing_area_fraction) : 1.05;
      EXPECT_GE(model->density(base + solid - 1e-6), edge * (1 - 1e-5)) << one.name;
      EXPECT_LT(model->density(base + solid + 1e-3), edge) << one.name;
      EXPECT_GT(model->density(base + solid + 1e-2), 0.5 * edge) << one.name;
    }
  }
}

// A start passes through the density that it is given; what is nearly the plateau counts as 0.97 of it.
TEST(FitModelsByHand, PassThroughTheirStarts) {
  for (const Case& one : cases()) {
    if (one.name == "rectangle") continue;
    const auto model = model_of(one);
    for (const double density : {0.05, 0.4, 0.7, 1.2}) {
      for (const double height : {1.9, 5.2}) {
        FitModel::Parameters start = one.at;
        start[FitModel::place] = model->place_through(one.at, height, density);
        if (!model->set(start)) continue;  // Kolafa and Rottner's fluid ends
        const double most = model->place_is_column() ? model->largest_plateau() : 1.05;
        const double expected = std::min(density, 0.97 * most);
        if (model->place_is_column() && expected > 1.05) continue;
        if (one.name == "hydrostatic:kolafa-rottner" && density > 0.8) continue;  // its loop
        EXPECT_NEAR(model->density(height), expected, 1e-8) << one.name << " " << one.at[0] << " " << height;
      }
    }
  }
}

// A bed higher up is the same bed.
TEST(HydrostaticProfileByHand, MovesWithItsBase) {
  for (const EquationOfState* equation : {&enskog(), &best_of()}) {
    for (const double t : {0.0, 0.2, 3.0}) {
      const auto low = HydrostaticProfile::of_column(*equation, t, {9, 1.1}, 0),
                 high = HydrostaticProfile::of_column(*equation, t, {9, 1.1}, 2.5);
      ASSERT_TRUE(low.ok() && high.ok());
      EXPECT_NEAR(high.top_of_solid(), low.top_of_solid() + 2.5, 1e-12);
      EXPECT_NEAR(high.solid_height(), low.solid_height(), 1e-12);
      EXPECT_NEAR(high.column_number(), 9, 1e-10);
      EXPECT_NEAR(high.center_of_mass(), low.center_of_mass() + 2.5, 1e-10);
      EXPECT_NEAR(high.crystal_height(), low.crystal_height(), 1e-12);
      for (const double height : {-0.5, 0.1, 3.0, 8.1, 8.3, 12.0}) {
        EXPECT_NEAR(high.density(height + 2.5), low.density(height), 1e-10) << height;
        EXPECT_NEAR(high.column_above(height + 2.5), low.column_above(height), 1e-9) << height;
        for (const Kernel& kernel : kernels) {
          double here = 0, there = 0;
          const double above = height + 2.5;
          low.sample({&height, 1}, kernel, {&here, 1});
          high.sample({&above, 1}, kernel, {&there, 1});
          EXPECT_NEAR(there, here, 1e-9) << height << to_string(kernel);
        }
      }
    }
  }
  // A tail whose plateau would lie below the base begins there.
  const auto cut = HydrostaticProfile::tail_over_rectangle(enskog(), 0.5, 1.8, 1.1, 2.5),
             whole = HydrostaticProfile::tail_over_rectangle(enskog(), 0.5, 1.8, 1.1, 0);
  EXPECT_NEAR(cut.bottom_density(), whole.density(2.5), 1e-10);
  EXPECT_NEAR(cut.density(3.1), whole.density(3.1), 1e-10);
  EXPECT_NEAR(cut.column_number(), whole.column_above(2.5), 1e-9);
  EXPECT_EQ(cut.solid_height(), 0);
}

// N D/W = phi_0 (shift - base + T Z) of the curve, T_c = N D/W/(phi_0 Z), T/T_c: through the covariance of T and shift.
TEST(FitNumbersByHand, AreDerivedFromTemperatureAndShift) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.12, {11.22, 1.10}, base);
  const Profile data = synthetic::profile_of(truth, {}, 90, 16, 0.002, 4);
  FitOptions options;
  options.plateau_density = 1.10, options.base = base;
  options.sweep = options.compare = false, options.curve_points = 5;
  const FitResult fit = fit_profile(data, options);
  ASSERT_TRUE(fit.ok()) << fit.message;
  ASSERT_EQ(fit.covariance.size(), 4U);
  const double z = enskog().compressibility_factor(1.10).value, t = fit.temperature.value, s = fit.shift.value;
  const double tt = fit.covariance[0], ts = fit.covariance[1], ss = fit.covariance[3];
  const auto expect = [&](const Estimate& found, double value, double by_t, double by_s, const char* what) {
    EXPECT_NEAR(found.value, value, 1e-9 * std::abs(value)) << what;
    const double variance = by_t * by_t * tt + 2 * by_t * by_s * ts + by_s * by_s * ss;
    EXPECT_NEAR(found.std_error, std::sqrt(variance), 1e-4 * std::sqrt(variance)) << what;
  };
  const double column = 1.10 * (s - base + t * z), critical = column / (1.10 * z);
  expect(fit.temperature, t, 1, 0, "T");
  expect(fit.shift, s, 0, 1, "shift");
  expect(fit.solid_height, s - base, 0, 1, "solid");
  expect(fit.column_number, column, 1.10 * z, 1.10, "N D/W");
  expect(fit.critical_temperature, critical, 1, 1 / z, "T_c");
  expect(fit.reduced_temperature, t / critical, 1 / critical - t / (critical * critical),
         -t / (critical * critical * z), "T/T_c");
  EXPECT_NEAR(fit.solid_height_by_sum_rule, s - base, 1e-9) << "its own N D/W";
  // chi2 by the residuals, its chance, and the curve at even heights.
  double chi2 = 0;
  for (const Residual& r : fit.residuals)
    if (r.used) chi2 += std::pow((r.density - r.model) / r.std_error, 2);
  EXPECT_NEAR(fit.chi2, chi2, 1e-8 * chi2);
  EXPECT_EQ(fit.dof, fit.bins - 2);
  EXPECT_NEAR(fit.p_value, chance_of_chi2(chi2, fit.dof), 1e-8);
  ASSERT_EQ(fit.curve.size(), 5U);
  const double low = std::min(base, data.height.front()), high = data.height.back();
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(fit.curve[i].height, low + (high - low) * static_cast<double>(i) / 4, 1e-12) << i;
  // With N D/W given, T_c is known, and the sum rule says what is solid.
  options.column_number = 12;
  const FitResult given = fit_profile(data, options);
  EXPECT_NEAR(given.critical_temperature.value, 12 / (1.10 * z), 1e-12);
  EXPECT_EQ(given.critical_temperature.std_error, 0);
  EXPECT_NEAR(given.reduced_temperature.std_error * 12 / (1.10 * z), given.temperature.std_error, 1e-6);
  EXPECT_NEAR(given.solid_height_by_sum_rule, 12 / 1.10 - given.temperature.value * z, 1e-9);
  EXPECT_TRUE(given.column_number.fixed);
}

// At the ends of the interval chi2, all else fitted anew, is 1.96^2 above the least.
TEST(FitNumbersByHand, HaveTheIntervalOfTheirLikelihood) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.3, {11.22, 1.10});
  const Profile data = synthetic::profile_of(truth, {}, 30, 16, 0.02, 4);
  FitOptions options;
  options.plateau_density = 1.10, options.sweep = options.compare = false;
  options.model_error = false;
  for (const double confidence : {0.95, 0.6827}) {
    options.confidence = confidence;
    options.fixed_temperature.reset();
    const FitResult fit = fit_profile(data, options);
    ASSERT_TRUE(fit.ok());
    ASSERT_FALSE(fit.misfit);
    const double rise = confidence == 0.95 ? 3.841459 : 1;
    for (const double end : {fit.temperature_interval.low, fit.temperature_interval.high}) {
      options.fixed_temperature = end;
      EXPECT_NEAR(fit_profile(data, options).chi2 - fit.chi2, rise, 2e-3) << confidence;
    }
    EXPECT_LT(fit.temperature_interval.low, fit.temperature.value);
    EXPECT_GT(fit.temperature_interval.high, fit.temperature.value);
  }
}

// A covariance of few samples: chi2 over dof is a ratio of two variances, the second known from dof (samples - 1) of
// them, and its chance is Snedecor's F.
TEST(FitNumbersByHand, HaveTheChanceOfSnedecorsF) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.3, {11.22, 1.10});
  Profile data = synthetic::profile_of(truth, {}, 30, 16, 0.02, 4);
  FitOptions options;
  options.plateau_density = 1.10, options.sweep = options.compare = options.interval = false;
  for (const int samples : {60, 200}) {
    synthetic::take_errors_for_covariance(data, samples);
    const FitResult fit = fit_profile(data, options);
    ASSERT_TRUE(fit.ok());
    // aic is this chi2 and twice the two parameters: so many degrees of freedom it counts as.
    const double dof = (fit.aic - 4) / fit.chi2_per_dof;
    EXPECT_NEAR(fit.p_value, gsl_cdf_fdist_Q(fit.chi2_per_dof, dof, dof * (samples - 1.0)), 1e-9) << samples;
  }
}

// Errors of 12 samples: 2.201 of them are 95 %, by Student's t of 11 degrees [any table], in both intervals.
TEST(FitNumbersByHand, HaveStudentsIntervalsOfFewSamples) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.3, {11.22, 1.10});
  Profile data = synthetic::profile_of(truth, {}, 60, 16, 0.02, 4);
  synthetic::take_errors_for_covariance(data, 12);
  FitOptions options;
  options.plateau_density = 1.10, options.sweep = options.compare = false;
  options.model_error = false;
  const FitResult fit = fit_profile(data, options);
  ASSERT_TRUE(fit.ok());
  ASSERT_FALSE(fit.misfit);
  const double reach = std::exp(2.200985 * fit.statistical_error / fit.temperature.value);
  EXPECT_NEAR(fit.next_bed_interval.high / fit.temperature.value, reach, 1e-6);
  EXPECT_NEAR(fit.temperature.value / fit.next_bed_interval.low, reach, 1e-6);
  // chi2 rises by as many of its units as t^2 says, whatever the weights.
  const auto rise_at = [&](double confidence) {
    options.confidence = confidence;
    options.fixed_temperature.reset();
    const Interval ends = fit_profile(data, options).temperature_interval;
    options.fixed_temperature = ends.high;
    return fit_profile(data, options).chi2 - fit.chi2;
  };
  // t at 97.5 % and at 90 % [any table]
  EXPECT_NEAR(rise_at(0.95) / rise_at(0.8), std::pow(2.200985 / 1.363430, 2), 2e-3);
}

// Without errors the variance is one more parameter: -2 ln L is n ln(chi2/n) but for a constant, chi2 the sum of
// squared residuals, and errors are those of their scatter.
TEST(FitNumbersByHand, HaveTheCriteriaOfUnknownErrors) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.3, {11.22, 1.10});
  Profile data = synthetic::profile_of(truth, {}, 30, 16, 0.02, 4);
  data.std_error.clear();
  FitOptions options;
  options.plateau_density = 1.10, options.sweep = options.interval = false;
  options.window.low = 2, options.window.high = 14;
  const FitResult fit = fit_profile(data, options);
  ASSERT_TRUE(fit.ok());
  double squares = 0, n = 0;
  for (const Residual& one : fit.residuals) {
    if (!one.used) continue;
    squares += std::pow(one.density - one.model, 2), n += 1;
    EXPECT_EQ(one.std_error, 0);
  }
  EXPECT_EQ(n, fit.bins);
  EXPECT_NEAR(fit.chi2, squares, 1e-12);
  EXPECT_NEAR(fit.chi2_per_dof, squares / (n - 2), 1e-12);
  EXPECT_NEAR(fit.aic, n * std::log(squares / n) + 2 * 3, 1e-8);
  EXPECT_NEAR(fit.bic, n * std::log(squares / n) + 3 * std::log(n), 1e-8);
  EXPECT_TRUE(fit.errors_scaled);
  EXPECT_FALSE(fit.misfit);
  EXPECT_EQ(fit.model_error, 0);
  // As of that scatter for every height.
  data.std_error.assign(data.height.size(), std::sqrt(squares / (n - 2)));
  const FitResult known = fit_profile(data, options);
  EXPECT_NEAR(known.temperature.value, fit.temperature.value, 1e-8);
  EXPECT_NEAR(known.temperature.std_error / fit.temperature.std_error, 1, 1e-6);
  EXPECT_NEAR(known.chi2, n - 2, 1e-6);
  EXPECT_NEAR(known.aic, n - 2 + 2 * 2, 1e-6);
  EXPECT_NEAR(known.bic, n - 2 + 2 * std::log(n), 1e-6);
}

// Where T and shift are given nothing is sought: the curve of these, compared with all heights.
TEST(FitNumbersByHand, WithNothingFreeAreThoseOfTheCurve) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.3, {11.22, 1.10});
  const Profile data = synthetic::profile_of(truth, {}, 30, 16, 0.02, 4);
  FitOptions options;
  options.plateau_density = 1.10, options.sweep = options.compare = false;
  options.fixed_temperature = 0.31, options.fixed_shift = truth.top_of_solid();
  const FitResult fit = fit_profile(data, options);
  ASSERT_EQ(fit.status, FitStatus::ok) << fit.message;
  EXPECT_EQ(fit.dof, fit.bins);
  EXPECT_TRUE(fit.parameters.empty());
  EXPECT_TRUE(fit.covariance.empty());
  EXPECT_EQ(fit.iterations, 0);
  const auto curve = HydrostaticProfile::tail_over_rectangle(enskog(), 0.31, truth.top_of_solid(), 1.10);
  double chi2 = 0;
  for (const Residual& r : fit.residuals) {
    EXPECT_NEAR(r.model, curve.density(r.height), 1e-12) << r.height;
    if (r.used) chi2 += std::pow((r.density - r.model) / r.std_error, 2);
  }
  EXPECT_NEAR(fit.chi2, chi2, 1e-9 * chi2);
  EXPECT_NEAR(fit.aic, chi2, 1e-9 * chi2);
  for (const Estimate& one : {fit.temperature, fit.shift}) {
    EXPECT_TRUE(one.fixed);
    EXPECT_EQ(one.std_error, 0);
  }
  EXPECT_EQ(fit.temperature.value, 0.31);
  EXPECT_EQ(fit.shift.value, truth.top_of_solid());
}

// From a start at the truth one iteration does not reach a minimum to rounding error.
TEST(FitNumbersByHand, OfTooFewIterationsAreNoMinimum) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.3, {11.22, 1.10});
  const Profile data = synthetic::profile_of(truth, {}, 30, 16, 0.02, 4);
  FitOptions options;
  options.plateau_density = 1.10, options.sweep = options.interval = false;
  options.max_iterations = 1;
  const FitResult fit = fit_profile(data, options);
  EXPECT_EQ(fit.status, FitStatus::not_converged);
  EXPECT_EQ(fit.message, "no minimum of chi2 was found in 1 iterations. Try another model or window");
  ASSERT_FALSE(fit.model_comparison.empty());
  EXPECT_EQ(fit.model_comparison.front().status, FitStatus::not_converged);
  options.max_iterations = 100;
  EXPECT_EQ(fit_profile(data, options).status, FitStatus::ok);
}

// Where all heights have one error, another in every one of them changes no minimum: what makes chi2/dof 1 is then
// sigma sqrt(chi2/dof - 1), found to 1e-4 in ln(chi2/dof). It is above the root mean square of the residuals with few
// heights, and far below it where chi2 is hardly too large.
TEST(FitNumbersByHand, HaveTheErrorOfTheModelThatExplainsTheirResiduals) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.6, {11.22, 1.10});
  int above = 0, below = 0;
  for (const auto& [heights, sigma] : {std::pair{9, 0.001}, {60, 0.004}, {60, 0.012}}) {
    Profile data = synthetic::profile_of(truth, {}, heights, synthetic::top_of(truth), 0, 1);
    data.std_error.assign(data.height.size(), sigma);
    for (std::size_t i = 0; i < data.height.size(); ++i)
      data.number_density[i] += 0.03 * std::sin(2.3 * data.height[i]);
    FitOptions options;
    options.plateau_density = 1.10, options.sweep = options.compare = false;
    options.window.low = 0, options.window.high = 12;
    options.model_error = false;
    const FitResult scaled = fit_profile(data, options);
    options.model_error = true;
    const FitResult fit = fit_profile(data, options);
    ASSERT_TRUE(scaled.ok() && fit.ok()) << scaled.message << fit.message;
    ASSERT_TRUE(fit.misfit);
    const double ratio = scaled.chi2_per_dof, rms = sigma * std::sqrt(scaled.chi2 / scaled.bins);
    EXPECT_EQ(scaled.model_error, 0);
    EXPECT_NEAR((std::pow(fit.model_error / sigma, 2) + 1) / ratio, 1, 1.1e-4) << heights << ' ' << sigma;
    EXPECT_NEAR(fit.chi2_per_dof, ratio, 1e-6 * ratio) << "by the measured errors alone";
    EXPECT_NEAR(fit.temperature.value, scaled.temperature.value, 1e-6);
    EXPECT_NEAR(fit.temperature.std_error / scaled.temperature.std_error, 1, 1e-4);
    EXPECT_NEAR(scaled.statistical_error * std::sqrt(ratio) / scaled.temperature.std_error, 1, 1e-9);
    EXPECT_NEAR(fit.statistical_error / scaled.statistical_error, 1, 1e-4);
    above += fit.model_error > rms, below += fit.model_error < 0.9 * rms;
  }
  EXPECT_GT(above, 0);
  EXPECT_EQ(below, 1);
}

// From (1, 0): the farthest point first, then always the one that is farthest from all chosen.
TEST(SpreadOutByHand, TakesTheFarthestPointInThePlane) {
  const std::vector<double> points{0, 0, 1, 0, 0, 2, 0.4, 0.1};
  EXPECT_EQ(spread_out(2, points, 4, 1), (std::vector<std::size_t>{1, 2, 0, 3}));
  EXPECT_EQ(spread_out(2, points, 2, 3), (std::vector<std::size_t>{3, 2}));
}

}  // namespace
}  // namespace shakebed::fit::models_by_hand
