#include "fit/calibrate.hpp"

#include <gsl/gsl_multimin.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace shakebed::fit {

namespace {

class Search {
 public:
  Search(const Objective& objective, const std::vector<CalibrationAxis>& box, const CalibrationOptions& options,
         CalibrationResult& result)
      : objective_(objective), box_(box), options_(options), result_(result) {}

  [[nodiscard]] bool spent() const { return static_cast<int>(result_.runs.size()) >= options_.max_runs; }

  // The value at a point in units of the box; outside, that of the nearest point inside and a wall.
  double at(std::span<const double> unit) {
    std::vector<double> point(box_.size());
    double outside = 0.0;
    for (std::size_t i = 0; i < box_.size(); ++i) {
      const double inside = std::clamp(unit[i], 0.0, 1.0);
      outside += std::abs(unit[i] - inside);
      point[i] = box_[i].low + inside * (box_[i].high - box_[i].low);
    }
    double value = worst_;
    bool known = false;
    for (const CalibrationRun& run : result_.runs) {
      if (run.point == point) {  // a run is never paid for twice
        value = run.failed ? worst_ : run.value;
        known = true;
        break;
      }
    }
    if (!known) {
      if (spent()) return worst_;
      CalibrationRun run = objective_(point);
      run.point = point;
      run.failed = run.failed || !std::isfinite(run.value) || !std::isfinite(run.std_error) || run.std_error < 0.0;
      if (run.failed) run.value = run.std_error = 0.0;
      result_.cost += std::isfinite(run.cost) ? run.cost : 0.0;
      if (!run.failed) {
        value = run.value;
        if (!has_best_ || value < result_.runs[result_.best_run].value) result_.best_run = result_.runs.size();
        has_best_ = true;
        worst_ = worst_ == infinite ? std::abs(value) * 10.0 + 1.0 : std::max(worst_, 2.0 * std::abs(value) + 1.0);
      }
      result_.runs.push_back(std::move(run));
    }
    return value + outside * (1.0 + std::abs(value)) * 10.0;
  }

  void grid() {
    std::vector<int> index(box_.size(), 0);
    std::vector<double> unit(box_.size());
    while (!spent()) {
      for (std::size_t i = 0; i < box_.size(); ++i)
        unit[i] = box_[i].grid > 1 ? static_cast<double>(index[i]) / (box_[i].grid - 1) : 0.5;
      at(unit);
      std::size_t axis = 0;
      while (axis < box_.size() && ++index[axis] >= std::max(1, box_[axis].grid)) index[axis++] = 0;
      if (axis == box_.size()) {
        finished_ = true;
        return;
      }
    }
    finished_ = false;
  }

  void simplex(std::vector<double> start, double size) {
    const std::size_t n = box_.size();
    gsl_multimin_function function;
    function.n = n;
    function.params = this;
    function.f = [](const gsl_vector* x, void* self) {
      std::vector<double> unit(x->size);
      for (std::size_t i = 0; i < x->size; ++i) unit[i] = gsl_vector_get(x, i);
      return static_cast<Search*>(self)->at(unit);
    };
    const std::unique_ptr<gsl_vector, decltype(&gsl_vector_free)> x(gsl_vector_alloc(n), gsl_vector_free);
    const std::unique_ptr<gsl_vector, decltype(&gsl_vector_free)> step(gsl_vector_alloc(n), gsl_vector_free);
    for (std::size_t i = 0; i < n; ++i) {
      gsl_vector_set(x.get(), i, start[i]);
      gsl_vector_set(step.get(), i, start[i] + size <= 1.0 ? size : -size);  // into the box
    }
    const std::unique_ptr<gsl_multimin_fminimizer, decltype(&gsl_multimin_fminimizer_free)> minimizer(
        gsl_multimin_fminimizer_alloc(gsl_multimin_fminimizer_nmsimplex2, n), gsl_multimin_fminimizer_free);
    gsl_multimin_fminimizer_set(minimizer.get(), &function, x.get(), step.get());
    finished_ = false;
    for (int iteration = 0; iteration < 20 * options_.max_runs && !spent(); ++iteration) {
      if (gsl_multimin_fminimizer_iterate(minimizer.get()) != 0) break;
      if (gsl_multimin_fminimizer_size(minimizer.get()) < options_.tolerance) {
        finished_ = true;
        break;
      }
    }
  }

  [[nodiscard]] std::vector<double> best_unit() const {
    std::vector<double> unit;
    for (std::size_t i = 0; i < box_.size(); ++i) {
      unit.push_back((result_.runs[result_.best_run].point[i] - box_[i].low) / (box_[i].high - box_[i].low));
    }
    return unit;
  }
  [[nodiscard]] bool has_best() const { return has_best_; }
  [[nodiscard]] bool finished() const { return finished_; }

 private:
  static constexpr double infinite = 1e30;
  const Objective& objective_;
  const std::vector<CalibrationAxis>& box_;
  const CalibrationOptions& options_;
  CalibrationResult& result_;
  double worst_ = infinite;
  bool has_best_ = false;
  bool finished_ = false;
};

// value = c + g.x + x.H.x/2 about the best run, over the nearest runs, in units of the box.
void quadratic(const std::vector<CalibrationAxis>& box, const std::vector<double>& centre, CalibrationResult& result) {
  const auto n = static_cast<Eigen::Index>(box.size());
  const Eigen::Index terms = 1 + n + n * (n + 1) / 2;
  struct Near {
    double distance;
    std::size_t run;
  };
  std::vector<Near> near;
  const auto unit = [&](std::size_t run, std::size_t i) {
    return (result.runs[run].point[i] - box[i].low) / (box[i].high - box[i].low) - centre[i];
  };
  for (std::size_t r = 0; r < result.runs.size(); ++r) {
    if (result.runs[r].failed) continue;
    double distance = 0.0;
    for (std::size_t i = 0; i < box.size(); ++i) distance += unit(r, i) * unit(r, i);
    near.push_back({std::sqrt(distance), r});
  }
  std::sort(near.begin(), near.end(), [](const Near& a, const Near& b) { return a.distance < b.distance; });
  const auto needed = static_cast<std::size_t>(terms) + 2;
  if (near.size() < needed) {
    result.warnings.emplace_back("too few runs for an uncertainty");
    return;
  }
  // Runs well above the least (in their own noise, and in units of chi2) are beyond the quadratic.
  const double least = result.runs[result.best_run].value;
  std::vector<std::size_t> chosen;
  for (double reach = 12.0; chosen.size() < needed && reach < 1e12; reach *= 2.0) {
    chosen.clear();
    for (const Near& candidate : near) {
      const CalibrationRun& run = result.runs[candidate.run];
      if (run.value - least <= reach + 3.0 * run.std_error) chosen.push_back(candidate.run);
    }
  }
  const auto rows = static_cast<Eigen::Index>(chosen.size());
  Eigen::MatrixXd design(rows, terms);
  Eigen::VectorXd values(rows);
  bool errors_known = true;
  for (Eigen::Index r = 0; r < rows; ++r) {
    const std::size_t run = chosen[static_cast<std::size_t>(r)];
    errors_known = errors_known && result.runs[run].std_error > 0.0;
  }
  for (Eigen::Index r = 0; r < rows; ++r) {
    const std::size_t run = chosen[static_cast<std::size_t>(r)];
    Eigen::Index column = 0;
    design(r, column++) = 1.0;
    for (std::size_t i = 0; i < box.size(); ++i) design(r, column++) = unit(run, i);
    for (std::size_t i = 0; i < box.size(); ++i) {
      for (std::size_t j = i; j < box.size(); ++j)
        design(r, column++) = unit(run, i) * unit(run, j) * (i == j ? 0.5 : 1.0);
    }
    // The error of a run, and what a quadratic cannot say further out.
    const double beyond = 0.1 * (result.runs[run].value - least) + 0.1;
    const double weight = 1.0 / std::hypot(errors_known ? result.runs[run].std_error : 0.0, beyond);
    design.row(r) *= weight;
    values[r] = weight * result.runs[run].value;
  }
  const Eigen::VectorXd c = design.colPivHouseholderQr().solve(values);
  Eigen::VectorXd gradient = c.segment(1, n);
  Eigen::MatrixXd hessian(n, n);
  Eigen::Index column = 1 + n;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = i; j < n; ++j) hessian(i, j) = hessian(j, i) = c[column++];
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(hessian);
  if (!(eigen.eigenvalues().minCoeff() > 1e-9 * std::max(1e-300, eigen.eigenvalues().cwiseAbs().maxCoeff()))) {
    result.warnings.emplace_back("the runs about the best have no minimum in every direction: no uncertainty");
    return;
  }
  const Eigen::VectorXd step = -hessian.ldlt().solve(gradient);
  const Eigen::MatrixXd covariance = 2.0 * hessian.inverse();
  for (Eigen::Index i = 0; i < n; ++i) {
    const double at = centre[static_cast<std::size_t>(i)] + step[i];
    if (at < 0.0 || at > 1.0 || std::abs(step[i]) > 0.5) {
      result.warnings.emplace_back("the quadratic through the runs has its minimum elsewhere: no uncertainty");
      return;
    }
  }
  result.has_uncertainty = true;
  result.value = c[0] + 0.5 * gradient.dot(step);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    const double width = box[axis].high - box[axis].low;
    result.best[axis] = box[axis].low + (centre[axis] + step[i]) * width;
    result.std_error[axis] = std::sqrt(covariance(i, i)) * width;
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto other = static_cast<std::size_t>(j);
      result.covariance[axis * box.size() + other] = covariance(i, j) * width * (box[other].high - box[other].low);
    }
  }
}

}  // namespace

CalibrationResult calibrate(const Objective& objective, const std::vector<CalibrationAxis>& box,
                            const CalibrationOptions& options) {
  CalibrationResult result;
  bool good = !box.empty() && options.max_runs > 0 && options.tolerance > 0.0 && static_cast<bool>(objective);
  for (const CalibrationAxis& axis : box) {
    good = good && std::isfinite(axis.low) && std::isfinite(axis.high) && axis.low < axis.high;
  }
  if (!good) {
    result.status = FitStatus::bad_input;
    result.message = "a search needs an objective, a budget and a box whose every axis has low < high";
    return result;
  }
  using Method = CalibrationOptions::Method;
  Search search(objective, box, options, result);
  if (options.method != Method::simplex) search.grid();
  if (options.method != Method::grid && (options.method == Method::simplex || search.has_best()) && !search.spent()) {
    std::vector<double> start(box.size(), 0.5);
    double size = 0.25;
    if (search.has_best()) {
      start = search.best_unit();
      int finest = 2;
      for (const CalibrationAxis& axis : box) finest = std::max(finest, axis.grid);
      size = 0.5 / (finest - 1);
    }
    search.simplex(start, size);
  }
  if (!search.has_best()) {
    result.status = FitStatus::no_signal;
    result.message = "no run gave a value";
    return result;
  }
  result.best = result.runs[result.best_run].point;
  result.value = result.runs[result.best_run].value;
  result.std_error.assign(box.size(), 0.0);
  result.covariance.assign(box.size() * box.size(), 0.0);
  const std::vector<double> centre = search.best_unit();
  quadratic(box, centre, result);
  for (std::size_t i = 0; i < box.size(); ++i) {
    const double width = box[i].high - box[i].low;
    const bool edge = std::min(result.best[i] - box[i].low, box[i].high - result.best[i]) < 1e-3 * width;
    result.at_edge.push_back(edge);
    if (edge) result.warnings.push_back("the best " + box[i].name + " lies at the edge of its range");
  }
  result.status = search.finished() ? FitStatus::ok : FitStatus::not_converged;
  if (!search.finished())
    result.message = "the budget of " + std::to_string(options.max_runs) + " runs was spent before the search ended";
  return result;
}

}  // namespace shakebed::fit
