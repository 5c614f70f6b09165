#include "fit/profile_fit/window_fit.hpp"

#include <gsl/gsl_cdf.h>

#include <algorithm>
#include <cmath>

namespace shakebed::fit {

namespace {

// Starts: T on so many steps, from the least that bins resolve to thirty windows; two starts count as
// different when their ln T differ by more than a grid step of the widest range; so many are tried.
constexpr int start_temperatures = 36;
constexpr double start_highest_in_windows = 30.0, start_distinct = 1.0;
constexpr std::size_t starts_tried = 3, start_bins = 40;
// A fit whose chi2/dof is below this needs no second start: a poorer one may be a side valley.
constexpr double good_chi2_per_dof = 3.0;
// The model is taken to miss the data where a chi2 as large has less than this chance.
constexpr double misfit_chance = 1e-3;
// ln(chi2/dof) at which the search for the model's error stops, and its greatest number of steps.
constexpr double misfit_tolerance = 1e-4;
constexpr int bracket_steps = 40, search_steps = 60;
// T with an error above this part of it is only bounded.
constexpr double unresolved_error = 0.5;

double chi2_of(const Bins& bins, const FitModel& model, const KernelRule& rule) {
  return weighted_residuals(bins, model, rule).squaredNorm();
}

// Every n-th bin, with diagonal weights.
Bins thinned(const Bins& bins) {
  Bins thin;
  const std::size_t stride = std::max<std::size_t>(1, bins.size() / start_bins);
  for (std::size_t i = 0; i < bins.size(); i += stride) {
    thin.height.push_back(bins.height[i]);
    thin.density.push_back(bins.density[i]);
    thin.inverse_error.push_back(bins.inverse_error[i]);
  }
  return thin;
}

// Where the window's profile crosses a half and a fifth of its greatest density (its end, if it never does).
std::vector<std::pair<double, double>> points_to_pass(const Bins& bins) {
  double greatest = 0.0;
  for (const double density : bins.density) greatest = std::max(greatest, density);
  std::vector<std::pair<double, double>> through;
  for (const double fraction : {0.5, 0.2}) {
    std::size_t i = bins.size() - 1;
    while (i > 0 && bins.density[i] < fraction * greatest) --i;
    through.emplace_back(bins.height[i], std::max(bins.density[i], 1e-6 * greatest));
  }
  return through;
}

Solution fit_from(const Bins& bins, FitSetup& setup, const std::vector<FitModel::Parameters>& starts) {
  Solution best;
  int evaluations = 0;
  for (const FitModel::Parameters& start : starts) {
    Solution solution = least_squares(bins, *setup.model, start, setup.least_squares);
    evaluations += solution.evaluations;
    const bool better =
        solution.has_curve && (!best.has_curve || (solution.converged && !best.converged) ||
                               (solution.converged == best.converged && solution.objective < best.objective));
    if (better) best = std::move(solution);
    const double dof = std::max(1.0, static_cast<double>(bins.size()) - setup.parameters);
    const bool good = setup.least_squares.errors_known && best.objective < good_chi2_per_dof * dof;
    if (best.converged && !best.temperature_at_bound && good) break;
  }
  if (best.has_curve) setup.model->set(best.parameters);
  best.evaluations = evaluations;
  return best;
}

// The effect of uncertain weights: the estimate scatters more than its covariance says [Percival2014].
double weight_noise(double samples, double bins, double parameters) {
  const double a = 2.0 / ((samples - bins - 1.0) * (samples - bins - 4.0));
  const double b = (samples - bins - 2.0) / ((samples - bins - 1.0) * (samples - bins - 4.0));
  if (!(samples > bins + 4.0)) return 1.0;
  return std::sqrt((1.0 + b * (bins - parameters)) / (1.0 + a + b * (parameters + 1.0)));
}

Goodness goodness(const Solution& solution, const Bins& bins, int parameters, const LeastSquaresOptions& options) {
  Goodness g;
  g.dof = static_cast<int>(bins.size()) - parameters;
  auto n = static_cast<double>(bins.size());
  double chi2 = solution.chi2;
  double dof = g.dof;
  if (bins.correlation.size() > 0 && g.dof > 0) {
    // As a chi-squared number of as many degrees of freedom as its mean and variance tell.
    dof = 2.0 * solution.expected_chi2 * solution.expected_chi2 / solution.chi2_variance;
    chi2 *= dof / solution.expected_chi2;
    n = dof + parameters;
  }
  g.chi2_per_dof = g.dof > 0 ? chi2 / dof : 0.0;
  const double k = parameters;
  if (options.errors_known) {
    // With errors that come from few samples chi2/dof is a variance over another, itself a mean over dof of them:
    // Snedecor's F.
    const bool few = bins.correlation.size() > 0 && bins.samples > 1;
    g.p_value = g.dof <= 0 ? 1.0
                : few      ? gsl_cdf_fdist_Q(chi2 / dof, dof, dof * (bins.samples - 1.0))
                           : gsl_cdf_chisq_Q(chi2, dof);
    g.aic = chi2 + 2.0 * k;
    g.bic = chi2 + k * std::log(n);
  } else {  // the variance is one more parameter
    const double log_variance = n * std::log(std::max(chi2 / n, 1e-300));
    g.aic = log_variance + 2.0 * (k + 1.0);
    g.bic = log_variance + (k + 1.0) * std::log(n);
  }
  g.misfit = options.errors_known && g.dof > 0 && g.p_value < misfit_chance;
  g.scaled = !options.robust && g.dof > 0 && (!options.errors_known || g.misfit);
  if (g.scaled) g.error_scale = std::sqrt(g.chi2_per_dof);
  if (bins.whitening.size() > 0 && bins.samples > 0) g.error_scale *= weight_noise(bins.samples, n, k);
  if (options.robust && !options.errors_known) g.scaled = true;
  return g;
}

// The error of the model that, added to every bin's own, makes chi2/dof = 1.
class ModelErrorSearch {
 public:
  ModelErrorSearch(const MeasuredProfile& measured, const Window& window, FitSetup& setup, const FittedWindow& plain,
                   const std::vector<FitModel::Parameters>& starts)
      : measured_(measured), window_(window), setup_(setup), plain_(plain), starts_{plain.solution.parameters} {
    starts_.insert(starts_.end(), starts.begin(), starts.end());
  }

  // False where there is no curve.
  bool fit_with(double error) {
    misfit(std::log(error));
    return trial_.solution.has_curve && trial_.solution.converged;
  }
  // False where no error does it.
  bool run() { return find_bracket() && narrow() && trial_.solution.has_curve && trial_.solution.converged; }
  // The fit with that error; its goodness is by the errors with it.
  FittedWindow& found() { return trial_; }

 private:
  [[nodiscard]] double mean_square_residual() const {
    double square = 0.0;
    for (std::size_t i = 0; i < plain_.bins.size(); ++i) {
      setup_.model->set(plain_.solution.parameters);
      square +=
          std::pow(setup_.model->smoothed(plain_.bins.height[i], setup_.least_squares.kernel) - plain_.bins.density[i],
                   2) /
          static_cast<double>(plain_.bins.size());
    }
    return square;
  }

  // ln(chi2/dof) with the error exp(log_error); it falls as the error grows.
  double misfit(double log_error) {
    const double error = std::exp(log_error);
    MeasuredProfile wider = measured_;
    for (double& sigma : wider.error) sigma = std::hypot(sigma, error);
    if (wider.covariance.size() > 0) wider.covariance.diagonal().array() += error * error;
    trial_ = {};
    trial_.bins = bins_of(wider, window_, nullptr);
    trial_.solution = fit_from(trial_.bins, setup_, starts_);
    LeastSquaresOptions known = setup_.least_squares;
    known.errors_known = true, known.robust = false;
    trial_.good = goodness(trial_.solution, trial_.bins, setup_.parameters, known);
    trial_.model_error = error;
    return trial_.solution.has_curve ? std::log(std::max(trial_.good.chi2_per_dof, 1e-300)) : -1e3;
  }

  bool find_bracket() {
    const double square = mean_square_residual();
    if (!(square > 0.0)) return false;
    high_ = 0.5 * std::log(square);
    low_ = high_;
    at_high_ = misfit(high_);
    at_low_ = at_high_;
    for (int i = 0; i < bracket_steps && at_high_ > 0.0; ++i) {
      low_ = high_, at_low_ = at_high_;
      at_high_ = misfit(high_ += 1.0);
    }
    for (int i = 0; i < bracket_steps && at_low_ < 0.0; ++i) {
      high_ = low_, at_high_ = at_low_;
      at_low_ = misfit(low_ -= 1.0);
    }
    return at_high_ <= 0.0 && at_low_ >= 0.0;
  }

  // The false position with halved ends.
  bool narrow() {
    for (int i = 0; i < search_steps && high_ - low_ > 1e-9; ++i) {
      const double middle =
          at_low_ > at_high_ ? low_ + (high_ - low_) * at_low_ / (at_low_ - at_high_) : 0.5 * (low_ + high_);
      const double value = misfit(i % 4 == 3 ? 0.5 * (low_ + high_) : middle);
      const double place = std::log(trial_.model_error);
      if (value > 0.0) {
        low_ = place, at_low_ = value, at_high_ *= 0.5;
      } else {
        high_ = place, at_high_ = value, at_low_ *= 0.5;
      }
      if (std::abs(value) < misfit_tolerance) break;
    }
    return true;
  }

  const MeasuredProfile& measured_;
  const Window& window_;
  FitSetup& setup_;
  const FittedWindow& plain_;
  std::vector<FitModel::Parameters> starts_;
  FittedWindow trial_;
  double low_ = 0.0, high_ = 0.0, at_low_ = 0.0, at_high_ = 0.0;  // ln(error) and the misfit there
};

// The part of the measured errors in the error of T, by the weights of a fit whose bins include an error of the model.
double measured_share_of(const FittedWindow& fitted, FitSetup& setup) {
  if (!setup.least_squares.free[FitModel::temperature]) return 1.0;
  const Solution by_samples = least_squares(with_measured_errors(fitted.bins, fitted.model_error), *setup.model,
                                            fitted.solution.parameters, setup.least_squares);
  const double all = fitted.solution.covariance(0, 0), measured = by_samples.covariance(0, 0);
  return by_samples.has_curve && all > 0.0 ? std::sqrt(std::clamp(measured / all, 0.0, 1.0)) : 1.0;
}

}  // namespace

std::vector<FitModel::Parameters> find_starts(const Bins& bins, const FitSetup& setup) {
  FitModel& model = *setup.model;
  const bool free_t = setup.least_squares.free[FitModel::temperature];
  const bool free_place = setup.least_squares.free[FitModel::place];
  const auto through = points_to_pass(bins);
  const Bins thin = thinned(bins);
  const double range = std::max(bins.height.back() - bins.height.front(), 1e-6);
  const double lowest = setup.least_squares.lowest_temperature;
  const double highest = std::max(start_highest_in_windows * range, 10.0 * lowest);
  const int temperatures = free_t ? start_temperatures : 1;
  const KernelRule points{Kernel{}};
  std::vector<std::pair<double, FitModel::Parameters>> candidates;
  for (int i = 0; i < temperatures; ++i) {
    FitModel::Parameters p = setup.start;
    if (free_t) p[0] = lowest * std::pow(highest / lowest, static_cast<double>(i) / (temperatures - 1));
    const std::size_t places = free_place ? through.size() : 1;
    for (std::size_t place = 0; place < places; ++place) {
      if (free_place) p[1] = model.place_through(p, through[place].first, through[place].second);
      if (!model.set(p)) continue;
      const double chi2 = chi2_of(thin, model, points);
      if (std::isfinite(chi2)) candidates.emplace_back(chi2, p);
    }
  }
  std::sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<FitModel::Parameters> starts;
  for (const auto& candidate : candidates) {
    const FitModel::Parameters& p = candidate.second;
    const bool known = std::any_of(starts.begin(), starts.end(), [&](const FitModel::Parameters& q) {
      return std::abs(std::log(q[0] / p[0])) < start_distinct || !free_t;
    });
    if (!known) starts.push_back(p);
    if (starts.size() == starts_tried) break;
  }
  return starts;
}

FittedWindow fit_window(const MeasuredProfile& measured, const Window& window, FitSetup& setup, Bins bins,
                        const std::vector<FitModel::Parameters>& starts) {
  FittedWindow fitted;
  fitted.solution = fit_from(bins, setup, starts);
  fitted.good = goodness(fitted.solution, bins, setup.parameters, setup.least_squares);
  fitted.error_scale = fitted.good.error_scale;
  fitted.bins = std::move(bins);
  const bool misses = fitted.good.scaled && measured.errors_known && fitted.solution.has_curve;
  if (misses && !setup.least_squares.robust) fitted.measured_share = 1.0 / std::sqrt(fitted.good.chi2_per_dof);
  const double least = measured.errors_known && fitted.solution.has_curve ? setup.least_model_error : 0.0;
  if (!setup.model_error || setup.least_squares.robust || setup.parameters == 0) return fitted;
  if (!misses && !(least > 0.0)) return fitted;

  ModelErrorSearch search(measured, window, setup, fitted, starts);
  const bool enough = misses && search.run() && search.found().model_error >= least;
  if (!enough && (!(least > 0.0) || !search.fit_with(least))) {
    setup.model->set(fitted.solution.parameters);
    return fitted;
  }
  FittedWindow& found = search.found();
  found.solution.chi2 = fitted.solution.chi2;
  found.error_scale = found.good.error_scale;
  found.good = fitted.good;
  found.measured_share = measured_share_of(found, setup);
  setup.model->set(found.solution.parameters);
  return std::move(found);
}

bool temperature_is_resolved(const Solution& solution, double std_error) {
  return !solution.temperature_at_bound && !solution.undetermined &&
         !(std_error > unresolved_error * solution.parameters[FitModel::temperature]);
}

}  // namespace shakebed::fit
