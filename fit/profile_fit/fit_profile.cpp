#include "fit/profile_fit/fit_profile.hpp"

#include <gsl/gsl_cdf.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fit/profile_fit/comparisons.hpp"
#include "fit/profile_fit/fit_warnings.hpp"
#include "fit/profile_fit/parameter_errors.hpp"
#include "fit/theory/expansion.hpp"

namespace shakebed::fit {

namespace {

// A profile is flat where its bins agree to this, or where one number describes them within their errors at this chance
// and is at least this part of the greatest density.
constexpr double equal_densities = 1e-9, flat_chance = 0.01, flat_density = 0.5;

bool is_flat(const Bins& bins, bool errors_known) {
  double weight = 0.0;
  double sum = 0.0;
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    const double w = bins.inverse_error[i] * bins.inverse_error[i];
    weight += w;
    sum += w * bins.density[i];
    least = std::min(least, bins.density[i]);
    most = std::max(most, bins.density[i]);
  }
  if (most - least <= equal_densities * std::abs(most)) return true;
  if (!errors_known || bins.size() < 2) return false;
  const double mean = sum / weight;
  double chi2 = 0.0;
  for (std::size_t i = 0; i < bins.size(); ++i) chi2 += std::pow((bins.density[i] - mean) * bins.inverse_error[i], 2);
  return gsl_cdf_chisq_Q(chi2, static_cast<double>(bins.size() - 1)) > flat_chance && mean > flat_density * most;
}

class ProfileFitter {
 public:
  ProfileFitter(const Profile& profile, const FitOptions& options) : profile_(profile), options_(options) {}

  FitResult run() {
    result_.status = prepare();
    if (result_.status != FitStatus::ok) return result_;
    choose_bins();
    result_.status = check_bins();
    if (result_.status != FitStatus::ok) return result_;

    fitted_ = fit_window(measured_, window_, setup_, bins_, find_starts(bins_, setup_));
    if (!fitted_.solution.has_curve) {
      result_.status = FitStatus::undefined_model;
      result_.message =
          "the model has no curve for this profile: its equation of state is not defined at densities this high. "
          "Choose another model, for example hydrostatic:best-of";
      return result_;
    }
    report_goodness();
    report_parameters();
    report_critical_temperature();
    judge_resolution();
    report_residuals();
    report_curve();
    look_further();
    warn_about_fit(measured_, options_, setup_, result_);
    return result_;
  }

 private:
  FitStatus prepare() {
    result_.model = options_.model;
    result_.kernel = options_.kernel;
    result_.plateau_density = {options_.plateau_density, 0.0, !options_.plateau_density_free};
    FitStatus status = measure_profile(profile_, measured_, result_);
    if (status == FitStatus::ok) status = make_setup(options_, measured_, setup_, result_);
    if (status != FitStatus::ok) return status;
    measured_.robust = options_.robust;
    for (std::size_t i = 0; i < measured_.size(); ++i) {
      result_.residuals.push_back(
          {measured_.height[i], measured_.density[i], measured_.errors_known ? measured_.error[i] : 0.0, 0.0, false});
    }
    if (*std::max_element(measured_.density.begin(), measured_.density.end()) <= 0.0) {
      result_.message = "no bin has a density above 0: check the column of the density";
      return FitStatus::no_signal;
    }
    return FitStatus::ok;
  }

  [[nodiscard]] std::size_t bins_needed() const { return static_cast<std::size_t>(setup_.parameters) + 1; }

  void choose_bins() {
    window_ = choose_window(measured_, options_);
    const std::size_t chosen = count_bins(measured_, window_);
    if (chosen < bins_needed() && !options_.window.low && !options_.window.high) {
      const Window all{std::max(options_.base, measured_.height.front()), measured_.height.back(),
                       "all bins above the base, because the rule leaves too few"};
      if (count_bins(measured_, all) >= bins_needed()) {
        result_.warnings.push_back(
            "the window rule leaves only " + std::to_string(chosen) +
            " bins, too few for the fit: all bins above the base (lower edge of the bed) were used");
        window_ = all;
      }
    }
    result_.window_rule = window_.rule;
    warn_about_units(measured_, options_, result_);
    bins_ = bins_of(measured_, window_, &result_);
    result_.bins = static_cast<int>(bins_.size());
    if (bins_.height.empty()) return;
    result_.window_low = bins_.height.front();
    result_.window_high = bins_.height.back();
  }

  FitStatus check_bins() {
    if (bins_.size() < bins_needed()) {
      result_.message = "the window contains " + std::to_string(bins_.size()) + " bins, but " +
                        std::to_string(setup_.parameters) + " free parameters need at least " +
                        std::to_string(bins_needed()) + ". Widen the window, or measure at more heights";
      return FitStatus::too_few_bins;
    }
    if (is_free(FitModel::temperature) && is_flat(bins_, measured_.errors_known)) {
      result_.message =
          "the density does not fall with height anywhere in the window, so it does not depend on the temperature. "
          "Extend the window to the top of the bed";
      return FitStatus::no_tail;
    }
    return FitStatus::ok;
  }

  void report_goodness() {
    const Solution& solution = fitted_.solution;
    const Goodness& good = fitted_.good;
    result_.status = solution.converged ? FitStatus::ok : FitStatus::not_converged;
    if (!solution.converged) {
      result_.message = "no minimum of chi2 was found in " + std::to_string(solution.iterations) +
                        " iterations. Try another model or window";
    }
    result_.iterations = solution.iterations;
    result_.evaluations = solution.evaluations;
    result_.chi2 = solution.chi2;
    result_.dof = good.dof;
    result_.chi2_per_dof = good.chi2_per_dof;
    result_.p_value = good.p_value;
    result_.aic = good.aic;
    result_.bic = good.bic;
    result_.misfit = good.misfit;
    result_.errors_scaled = good.scaled;
    result_.model_error = fitted_.model_error;
  }

  void report_parameters() {
    const Solution& solution = fitted_.solution;
    const FitModel& model = *setup_.model;
    const double variance_scale = fitted_.error_scale * fitted_.error_scale;
    if (is_free(FitModel::temperature)) result_.parameters.emplace_back("temperature");
    if (is_free(FitModel::place)) result_.parameters.emplace_back(model.place_name());
    if (is_free(FitModel::plateau)) result_.parameters.emplace_back("plateau_density");
    for (Eigen::Index i = 0; i < solution.covariance.rows(); ++i) {
      for (Eigen::Index j = 0; j < solution.covariance.cols(); ++j) {
        result_.covariance.push_back(variance_scale * solution.covariance(i, j));
      }
    }
    result_.temperature = {model.uses_temperature() ? solution.parameters[FitModel::temperature] : 0.0,
                           parameter_error(setup_, fitted_, FitModel::temperature), !is_free(FitModel::temperature)};
    result_.statistical_error = fitted_.measured_share * result_.temperature.std_error;
    result_.shift = derived([&](const FitModel::Parameters&) { return model.shift(); });
    result_.shift.fixed = options_.fixed_shift.has_value();
    result_.solid_height = derived([&](const FitModel::Parameters&) { return model.solid_height(); });
    result_.plateau_density = {solution.parameters[FitModel::plateau],
                               parameter_error(setup_, fitted_, FitModel::plateau), !is_free(FitModel::plateau)};
    if (options_.column_number) {
      result_.column_number = {*options_.column_number, 0.0, true};
    } else {
      result_.column_number = derived([&](const FitModel::Parameters&) { return model.column_number(); });
    }
  }

  void report_critical_temperature() {
    const FitModel& model = *setup_.model;
    const EquationOfState& equation = model.equation();
    const FitModel::Parameters& best = fitted_.solution.parameters;
    const auto column = [&] { return options_.column_number ? *options_.column_number : model.column_number(); };
    const Value critical = critical_temperature(equation, {column(), best[FitModel::plateau]});
    result_.critical_status = critical.status;
    if (!critical.ok()) return;
    const auto critical_of = [&](const FitModel::Parameters& p) {
      return critical_temperature(equation, {column(), std::min(p[FitModel::plateau], model.largest_plateau())}).value;
    };
    result_.critical_temperature = derived(critical_of);
    if (model.uses_temperature()) {
      result_.reduced_temperature =
          derived([&](const FitModel::Parameters& p) { return p[FitModel::temperature] / critical_of(p); });
    }
    const double z = equation.compressibility_factor(best[FitModel::plateau]).value;
    result_.solid_height_by_sum_rule = column() / best[FitModel::plateau] - result_.temperature.value * z;
  }

  void judge_resolution() {
    if (!is_free(FitModel::temperature) || result_.status != FitStatus::ok) return;
    if (temperature_is_resolved(fitted_.solution, result_.temperature.std_error)) return;
    result_.status = FitStatus::unresolved_temperature;
    result_.message =
        "the density falls more steeply than bins and kernel resolve, so only an upper limit of T is known. Measure at "
        "more closely spaced heights, with a narrower kernel";
  }

  void report_residuals() {
    for (Residual& r : result_.residuals) r.model = setup_.model->smoothed(r.height, setup_.least_squares.kernel);
    for (std::size_t i = 0; i < measured_.size(); ++i) {
      result_.residuals[i].used =
          measured_.usable[i] && measured_.height[i] >= window_.low && measured_.height[i] <= window_.high;
    }
  }

  void report_curve() {
    if (options_.curve_points < 2) return;
    const KernelRule& rule = setup_.least_squares.kernel;
    const double low = std::min(measured_.height.front(), options_.base);
    const double high = measured_.height.back();
    for (int i = 0; i < options_.curve_points; ++i) {
      const double height = low + (high - low) * i / (options_.curve_points - 1);
      result_.curve.push_back({height, setup_.model->density(height), setup_.model->smoothed(height, rule)});
    }
  }

  // The interval of T, T against window, and other models.
  void look_further() {
    if (options_.interval) {
      result_.temperature_interval = likelihood_interval(fitted_, setup_, options_.confidence);
      if (is_free(FitModel::temperature))
        result_.next_bed_interval = statistical_interval(fitted_, result_.statistical_error, options_.confidence);
    }
    if (options_.sweep && is_free(FitModel::temperature) && result_.status == FitStatus::ok) {
      result_.window_sweep = sweep_windows(measured_, window_, setup_, fitted_.solution.parameters);
    }
    if (!options_.compare) return;
    result_.model_comparison = compare_models(measured_, window_, bins_, options_);
    result_.model_comparison.insert(result_.model_comparison.begin(), model_row(options_, setup_, fitted_));
  }

  [[nodiscard]] bool is_free(std::size_t parameter) const { return setup_.least_squares.free[parameter]; }
  Estimate derived(const Quantity& quantity) {
    const double value = quantity(fitted_.solution.parameters);
    return {value, propagated_error(setup_, fitted_, quantity), false};
  }

  const Profile& profile_;
  const FitOptions& options_;
  FitResult result_;
  MeasuredProfile measured_;
  FitSetup setup_;
  Window window_;
  Bins bins_;
  FittedWindow fitted_;
};

}  // namespace

std::string_view to_string(FitStatus status) {
  switch (status) {
    case FitStatus::ok:
      return "ok";
    case FitStatus::not_converged:
      return "not converged";
    case FitStatus::bad_input:
      return "bad input";
    case FitStatus::too_few_bins:
      return "too few bins";
    case FitStatus::no_signal:
      return "no signal";
    case FitStatus::no_tail:
      return "no tail";
    case FitStatus::unresolved_temperature:
      return "unresolved temperature";
    case FitStatus::undefined_model:
      return "undefined model";
    case FitStatus::unreadable:
      return "unreadable";
  }
  return "unknown";
}

FitResult fit_profile(const Profile& profile, const FitOptions& options) {
  return ProfileFitter(profile, options).run();
}

ModelCurve evaluate_model(const FitOptions& options, double temperature, double shift, double plateau_density,
                          double column_number, std::span<const double> heights) {
  ModelCurve curve;
  const std::unique_ptr<FitModel> model = make_fit_model(options.model, options.base, options.constrain_column, 0.25);
  if (!model || !kernel_is_valid(options.kernel)) {
    curve.status = FitStatus::bad_input;
    return curve;
  }
  if (!model->set({temperature, model->place_is_column() ? column_number : shift, plateau_density})) {
    curve.status = FitStatus::undefined_model;
    return curve;
  }
  const KernelRule rule(options.kernel);
  for (const double height : heights) curve.densities.push_back(model->smoothed(height, rule));
  return curve;
}

}  // namespace shakebed::fit
