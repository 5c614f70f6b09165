#include "fit/profile_fit/parameter_errors.hpp"

#include <gsl/gsl_cdf.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace shakebed::fit {

namespace {

// Differences: this part of the parameter's error, and between these parts of the parameter itself.
constexpr double step_in_errors = 1e-3, least_step = 1e-9, greatest_step = 1e-3;
// The interval's ends: to this part of the distance that the quantile asks, within so many fits, no further away than
// this in ln T.
constexpr double end_tolerance = 1e-4, farthest_end = 12.0;
constexpr int end_steps = 40;

// Degrees of freedom behind the errors: those of few samples, or of the scatter, have Student's tails.
constexpr double normal_dof = 1e300;
double dof_of_samples(const Bins& bins) {
  return bins.correlation.size() > 0 && bins.samples > 1 ? bins.samples - 1.0 : normal_dof;
}
double tail_dof(const FittedWindow& fitted) {
  const double by_samples = dof_of_samples(fitted.bins);
  const double by_scatter =
      fitted.good.scaled && fitted.good.dof > 0 ? static_cast<double>(fitted.good.dof) : normal_dof;
  return std::min(by_samples, by_scatter);
}

double quantile_of_chi2(double confidence, double dof) {
  return dof < normal_dof ? std::pow(gsl_cdf_tdist_Pinv(0.5 + 0.5 * confidence, dof), 2)
                          : gsl_cdf_chisq_Pinv(confidence, 1.0);
}

// The end of the interval on one side: sqrt(delta chi2) is nearly linear in ln T, so a secant search on it.
class EndSearch {
 public:
  EndSearch(const FittedWindow& fitted, FitSetup& setup, double confidence)
      : fitted_(fitted), solution_(fitted.solution), setup_(setup), fixed_(setup.least_squares) {
    fixed_.free[FitModel::temperature] = false;
    target_ = std::sqrt(quantile_of_chi2(confidence, tail_dof(fitted)));
    unit_ = fitted.error_scale * fitted.error_scale * solution_.inflation;
  }

  // False when it does not converge. side: -1 or +1; open: the end lies beyond what the data limit.
  bool operator()(int side, double& end, bool& open) {
    const double sigma = std::sqrt(std::max(0.0, solution_.covariance(0, 0))) * fitted_.error_scale /
                         solution_.parameters[FitModel::temperature];
    double inner = 0.0, at_inner = 0.0;  // distance in ln T, and sqrt(delta chi2) there
    double outer = std::numeric_limits<double>::infinity();
    double place = std::min(target_ * std::max(sigma, 1e-9), 2.0);
    for (int iteration = 0; iteration < end_steps; ++iteration) {
      const double temperature = solution_.parameters[FitModel::temperature] * std::exp(side * place);
      if (temperature < setup_.least_squares.lowest_temperature) {
        open = true, end = 0.0;
        return true;
      }
      double distance = 0.0;
      if (place > farthest_end || !misfit_at(temperature, distance)) {
        open = true, end = temperature;
        return true;
      }
      if (std::abs(distance - target_) < end_tolerance * target_) {
        end = temperature;
        return true;
      }
      double next =
          distance > at_inner ? place + (target_ - distance) * (place - inner) / (distance - at_inner) : 2.0 * place;
      if (distance > target_) {
        outer = std::min(outer, place);
      } else {
        inner = place, at_inner = distance;
      }
      next = std::clamp(next, 0.2 * place, 3.0 * place + 1e-12);
      if (next >= outer) next = 0.5 * (inner + outer);
      if (next <= inner) next = std::isfinite(outer) ? 0.5 * (inner + outer) : 2.0 * inner;
      if (std::isfinite(outer) && outer - inner < 1e-10 * (1.0 + outer)) {
        end = solution_.parameters[FitModel::temperature] * std::exp(side * inner);
        return true;
      }
      place = next;
    }
    return false;
  }

 private:
  // sqrt(delta chi2) at a temperature, the other parameters fitted; false where there is no curve.
  bool misfit_at(double temperature, double& distance) {
    FitModel::Parameters start = solution_.parameters;
    start[FitModel::temperature] = temperature;
    if (setup_.least_squares.free[FitModel::place] && !setup_.model->place_is_column()) follow_the_valley(start);
    const Solution there = least_squares(fitted_.bins, *setup_.model, start, fixed_);
    if (!there.has_curve) return false;
    distance = std::sqrt(std::max(0.0, there.objective - solution_.objective) / unit_);
    return true;
  }

  // Keeps the curve where the solution has half its plateau.
  void follow_the_valley(FitModel::Parameters& p) {
    const FitModel::Parameters& best = solution_.parameters;
    setup_.model->set(best);
    const double half = 0.5 * best[FitModel::plateau];
    const double height = best[FitModel::place] +
                          (best[FitModel::place] - setup_.model->place_through(best, best[FitModel::place], half));
    p[FitModel::place] = setup_.model->place_through(p, height, half);
  }

  const FittedWindow& fitted_;
  const Solution& solution_;
  FitSetup& setup_;
  LeastSquaresOptions fixed_;
  double target_ = 0.0, unit_ = 0.0;
};

}  // namespace

double parameter_error(const FitSetup& setup, const FittedWindow& fitted, std::size_t parameter) {
  if (!setup.least_squares.free[parameter]) return 0.0;
  Eigen::Index index = 0;
  for (std::size_t i = 0; i < parameter; ++i) index += setup.least_squares.free[i] ? 1 : 0;
  return fitted.error_scale * std::sqrt(std::max(0.0, fitted.solution.covariance(index, index)));
}

double propagated_error(FitSetup& setup, const FittedWindow& fitted, const Quantity& quantity) {
  const Solution& solution = fitted.solution;
  std::vector<double> gradient;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!setup.least_squares.free[i]) continue;
    const auto index = static_cast<Eigen::Index>(gradient.size());
    const double sigma = std::sqrt(std::max(0.0, solution.covariance(index, index)));
    const double size = std::max(std::abs(solution.parameters[i]), 1e-12);
    const double step = std::clamp(step_in_errors * sigma, least_step * size, greatest_step * size);
    const auto at = [&](double offset) {
      FitModel::Parameters p = solution.parameters;
      p[i] += offset;
      if (i == FitModel::plateau) p[i] = std::min(p[i], setup.model->largest_plateau());
      return setup.model->set(p) ? quantity(p) : quantity(solution.parameters);
    };
    const double above = at(step), below = at(-step);
    gradient.push_back((above - below) / (2.0 * step));
  }
  setup.model->set(solution.parameters);
  double variance = 0.0;
  for (std::size_t i = 0; i < gradient.size(); ++i) {
    for (std::size_t j = 0; j < gradient.size(); ++j) {
      variance +=
          gradient[i] * gradient[j] * solution.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  return fitted.error_scale * std::sqrt(std::max(0.0, variance));
}

Interval likelihood_interval(const FittedWindow& fitted, FitSetup& setup, double confidence) {
  Interval interval;
  interval.confidence = confidence;
  if (!setup.least_squares.free[FitModel::temperature]) return interval;
  EndSearch search(fitted, setup, confidence);
  const bool low = search(-1, interval.low, interval.low_open);
  const bool high = search(+1, interval.high, interval.high_open);
  if (low && high) interval.status = FitStatus::ok;
  setup.model->set(fitted.solution.parameters);
  return interval;
}

Interval statistical_interval(const FittedWindow& fitted, double std_error, double confidence) {
  Interval interval;
  const double temperature = fitted.solution.parameters[FitModel::temperature];
  if (!(temperature > 0.0) || !std::isfinite(std_error)) return interval;
  const double reach = std::sqrt(quantile_of_chi2(confidence, dof_of_samples(fitted.bins))) * std_error / temperature;
  interval.confidence = confidence;
  interval.status = FitStatus::ok;
  interval.low = temperature * std::exp(-reach);
  interval.high = temperature * std::exp(reach);
  return interval;
}

}  // namespace shakebed::fit
