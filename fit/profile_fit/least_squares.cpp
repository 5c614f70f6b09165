#include "fit/profile_fit/least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace shakebed::fit {

namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

constexpr double first_damping = 1e-3;  // of Fletcher's scaling, at which a fit begins
constexpr double ridge = 1e-14;         // added to a diagonal of ones: 50 times the rounding of a double

// Between the solver's coordinates and the model's parameters.
struct Coordinates {
  bool place_is_column;
  [[nodiscard]] double derivative(std::size_t i, const FitModel::Parameters& p) const {  // d parameter/d coordinate
    return i == FitModel::temperature || (i == FitModel::place && place_is_column) ? p[i] : 1.0;
  }
  // p moved by `step` in coordinates.
  [[nodiscard]] double moved(std::size_t i, double value, double step) const {
    if (i == FitModel::temperature || (i == FitModel::place && place_is_column)) {
      return value * std::exp(std::clamp(step, -2.0, 2.0));
    }
    return value + step;
  }
};

void whiten(const Bins& bins, Eigen::Ref<Matrix> columns) {
  if (bins.whitening.size() > 0) {
    bins.whitening.triangularView<Eigen::Lower>().solveInPlace(columns);
    return;
  }
  for (Eigen::Index i = 0; i < columns.rows(); ++i) columns.row(i) *= bins.inverse_error[static_cast<std::size_t>(i)];
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double residual_scale(const Vector& residual) {
  std::vector<double> sizes(static_cast<std::size_t>(residual.size()));
  for (std::size_t i = 0; i < sizes.size(); ++i) sizes[i] = std::abs(residual[static_cast<Eigen::Index>(i)]);
  return 1.482602218505602 * median(std::move(sizes));  // of a normal distribution
}

// Twice Huber's loss, equal to r^2 inside the threshold.
double loss(double residual, double threshold) {
  const double size = std::abs(residual);
  return size <= threshold ? residual * residual : threshold * (2.0 * size - threshold);
}

class Solver {
 public:
  Solver(const Bins& bins, FitModel& model, const LeastSquaresOptions& options)
      : bins_(bins), model_(model), options_(options), coordinates_{model.place_is_column()} {
    for (std::size_t i = 0; i < 3; ++i) {
      if (options.free[i]) free_.push_back(i);
    }
  }

  Solution run(const FitModel::Parameters& start) {
    Solution solution;
    solution.parameters = start;
    clamp(solution.parameters);
    if (!evaluate(solution.parameters, residual_, jacobian_)) return solution;
    solution.has_curve = true;
    double scale = !options_.robust || options_.errors_known ? 1.0 : residual_scale(residual_);
    const int rounds = options_.robust && !options_.errors_known ? 20 : 1;
    for (int round = 0; round < rounds; ++round) {
      threshold_ = options_.robust ? options_.robust_threshold * std::max(scale, 1e-300) : 0.0;
      solution.converged = descend(solution);
      if (solution.converged) polish(solution);
      const double next = residual_scale(residual_);
      if (std::abs(next - scale) <= 1e-6 * scale) break;
      scale = next;
    }
    finish(solution);
    return solution;
  }

 private:
  void clamp(FitModel::Parameters& p) const {
    if (options_.free[FitModel::temperature]) {
      p[FitModel::temperature] = std::max(p[FitModel::temperature], options_.lowest_temperature);
    }
    if (options_.free[FitModel::plateau]) {
      p[FitModel::plateau] =
          std::clamp(p[FitModel::plateau], 1e-3 * model_.largest_plateau(), model_.largest_plateau());
    }
  }

  bool evaluate(const FitModel::Parameters& p, Vector& residual, Matrix& jacobian) {
    if (!model_.set(p)) return false;
    ++evaluations_;
    const auto n = static_cast<Eigen::Index>(bins_.size());
    const auto columns = static_cast<Eigen::Index>(free_.size());
    Matrix& both = scratch_;
    both.resize(n, columns + 1);
    values_.resize(bins_.size());
    model_.smoothed_with_gradient(bins_.height, options_.kernel, values_);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto bin = static_cast<std::size_t>(i);
      const std::array<double, 4>& value = values_[bin];
      both(i, columns) = value[0] - bins_.density[bin];
      for (Eigen::Index c = 0; c < columns; ++c) {
        const std::size_t parameter = free_[static_cast<std::size_t>(c)];
        both(i, c) = value[1 + parameter] * coordinates_.derivative(parameter, p);
      }
    }
    whiten(bins_, both);
    if (!both.allFinite()) return false;
    jacobian = both.leftCols(columns);
    residual = both.col(columns);
    return true;
  }

  [[nodiscard]] double objective(const Vector& residual) const {
    if (!(threshold_ > 0.0)) return residual.squaredNorm();
    double sum = 0.0;
    for (Eigen::Index i = 0; i < residual.size(); ++i) sum += loss(residual[i], threshold_);
    return sum;
  }

  // J^T W J and J^T W r with Huber's weights (1 without).
  void normal_equations(Matrix& a, Vector& g) const {
    if (!(threshold_ > 0.0)) {
      a.noalias() = jacobian_.transpose() * jacobian_;
      g.noalias() = jacobian_.transpose() * residual_;
      return;
    }
    Vector weight(residual_.size());
    for (Eigen::Index i = 0; i < residual_.size(); ++i) {
      weight[i] = std::min(1.0, threshold_ / std::max(std::abs(residual_[i]), 1e-300));
    }
    a.noalias() = jacobian_.transpose() * weight.asDiagonal() * jacobian_;
    g.noalias() = jacobian_.transpose() * weight.cwiseProduct(residual_);
  }

  // A step of Levenberg and Marquardt and what it promises to lower the objective by.
  struct Step {
    Vector change, diagonal;  // in coordinates; the scaling of the damping
    FitModel::Parameters trial;
    double promise = 0.0;
  };
  // Normal equations, damping, and where rounding error begins.
  struct Descent {
    Matrix a;
    Vector g;
    double damping = first_damping, growth = 2.0;
    double dof = 1.0, signal = 0.0;
  };

  // The sum of the squared weighted data: its rounding error bounds what a step can still gain.
  [[nodiscard]] double weighted_signal() const {
    double signal = 0.0;
    for (std::size_t i = 0; i < bins_.size(); ++i) {
      const double weighted =
          bins_.whitening.size() > 0
              ? bins_.density[i] / bins_.whitening(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i))
              : bins_.density[i] * bins_.inverse_error[i];
      signal += weighted * weighted;
    }
    return signal;
  }

  [[nodiscard]] FitModel::Parameters moved(const FitModel::Parameters& from, const Vector& step) const {
    FitModel::Parameters to = from;
    for (std::size_t i = 0; i < free_.size(); ++i)
      to[free_[i]] = coordinates_.moved(free_[i], to[free_[i]], step[static_cast<Eigen::Index>(i)]);
    return to;
  }

  // Fletcher's scaling; a parameter without any effect keeps a unit.
  [[nodiscard]] Step damped_step(const Descent& descent, const FitModel::Parameters& from) const {
    Step step;
    step.diagonal = descent.a.diagonal();
    const double largest = std::max(step.diagonal.maxCoeff(), 1e-300);
    for (Eigen::Index i = 0; i < step.diagonal.size(); ++i)
      step.diagonal[i] = std::max(step.diagonal[i], 1e-14 * largest);
    Matrix damped = descent.a;
    damped.diagonal() += descent.damping * step.diagonal;
    step.change = damped.ldlt().solve(-descent.g);
    step.trial = moved(from, step.change);
    clamp(step.trial);
    step.promise = -descent.g.dot(step.change);
    return step;
  }

  void accept(const Step& step, double value, Descent& descent, Solution& solution) {
    const double gain =
        (solution.objective - value) /
        std::max(step.promise + descent.damping * step.change.dot(step.diagonal.cwiseProduct(step.change)), 1e-300);
    const double turn = 2.0 * std::clamp(gain, 0.0, 1.0) - 1.0;
    descent.damping = std::max(1e-12, descent.damping * std::max(0.1, 1.0 - turn * turn * turn));
    descent.growth = 2.0;
    solution.parameters = step.trial;
    solution.objective = value;
    normal_equations(descent.a, descent.g);
  }

  // After a step that gained nothing: whether there is nothing to gain; without a value the search goes on, damped.
  [[nodiscard]] static std::optional<bool> reject(const Step& step, bool has_curve, double objective,
                                                  Descent& descent) {
    // A step of less than 1e-4 standard errors that gains nothing: rounding error is all that is left.
    if (has_curve && step.promise <= 1e-8 * objective / descent.dof + 1e-24 * descent.signal) return true;
    descent.damping *= descent.growth;
    descent.growth *= 2.0;
    // No step, however short, lowers the sum: a minimum to rounding error.
    if (descent.damping > 1e12)
      return step.promise <= 1e-6 * objective / descent.dof + 1e-20 * descent.signal || descent.damping > 1e16;
    return std::nullopt;
  }

  bool descend(Solution& solution) {
    solution.objective = objective(residual_);
    if (free_.empty()) return true;
    Descent descent;
    descent.dof = std::max(1.0, static_cast<double>(residual_.size()) - static_cast<double>(free_.size()));
    descent.signal = weighted_signal();
    normal_equations(descent.a, descent.g);
    for (; solution.iterations < options_.max_iterations; ++solution.iterations) {
      const Step step = damped_step(descent, solution.parameters);
      const bool moves = step.trial != solution.parameters;
      const bool worth = step.promise > (1e-16 / descent.dof + 1e-18) * solution.objective + 1e-30 * descent.signal;
      if (!moves || !worth || !step.change.allFinite()) {
        if (descent.damping <= first_damping || !moves) return true;
        descent.damping = 1e-6;  // only the damping made the step small
        descent.growth = 2.0;
        if (++shrinks_ > 20) return true;
        continue;
      }
      const Vector old_residual = residual_;
      const Matrix old_jacobian = jacobian_;
      const bool has_curve = evaluate(step.trial, residual_, jacobian_);
      const double value = has_curve ? objective(residual_) : 0.0;
      if (has_curve && value <= solution.objective) {
        accept(step, value, descent, solution);
        continue;
      }
      residual_ = old_residual;
      jacobian_ = old_jacobian;
      if (const auto ended = reject(step, has_curve, solution.objective, descent)) return *ended;
    }
    return false;
  }

  // Near the minimum, rounding hides differences of chi2, but not of its gradient. So Gauss-Newton steps follow, each
  // of which must halve the gain that the next one predicts.
  void polish(Solution& solution) {
    if (free_.empty()) return;
    Matrix a;
    Vector g;
    normal_equations(a, g);
    Vector step = a.ldlt().solve(-g);
    double promise = -g.dot(step);
    for (int i = 0; i < 3; ++i) {
      if (!step.allFinite() || !(promise > 0.0 && promise < 1e-6 * solution.objective)) return;
      FitModel::Parameters trial = moved(solution.parameters, step);
      const FitModel::Parameters unbounded = trial;
      clamp(trial);
      if (trial != unbounded || trial == solution.parameters) return;
      const Vector old_residual = residual_;
      const Matrix old_jacobian = jacobian_;
      double next = promise;
      if (evaluate(trial, residual_, jacobian_)) {
        normal_equations(a, g);
        step = a.ldlt().solve(-g);
        next = -g.dot(step);
      }
      if (!(next < 0.25 * promise)) {
        residual_ = old_residual;
        jacobian_ = old_jacobian;
        return;
      }
      promise = next;
      solution.parameters = trial;
      solution.objective = objective(residual_);
    }
  }

  void finish(Solution& solution) {
    model_.set(solution.parameters);
    solution.evaluations = evaluations_;
    solution.chi2 = residual_.squaredNorm();
    const auto columns = static_cast<Eigen::Index>(free_.size());
    const FitModel::Parameters& p = solution.parameters;
    solution.temperature_at_bound = options_.free[0] && p[0] <= options_.lowest_temperature * (1.0 + 1e-9);
    solution.plateau_at_bound = options_.free[2] && p[2] >= model_.largest_plateau();
    Matrix a;
    Vector g;
    normal_equations(a, g);
    Vector unit(columns);
    for (Eigen::Index i = 0; i < columns; ++i) unit[i] = 1.0 / std::sqrt(std::max(a(i, i), 1e-300));
    const Matrix scaled = unit.asDiagonal() * a * unit.asDiagonal();
    Matrix inverse = scaled.ldlt().solve(Matrix::Identity(columns, columns));
    for (Eigen::Index i = 0; i < columns; ++i) {
      solution.undetermined = solution.undetermined || !(inverse(i, i) > 0.0) || !(a(i, i) > 1e-280);
    }
    solution.expected_chi2 = static_cast<double>(residual_.size() - columns);
    solution.chi2_variance = 2.0 * solution.expected_chi2;
    if (bins_.correlation.size() > 0 && columns > 0) {
      through_correlations(unit, inverse, solution);
    } else if (threshold_ > 0.0) {
      inverse *= huber_inflation();
    }
    solution.covariance = Matrix::Zero(columns, columns);
    for (Eigen::Index i = 0; i < columns; ++i) {
      for (Eigen::Index j = 0; j < columns; ++j) {
        const double entry = inverse(i, j) * unit[i] * unit[j] *
                             coordinates_.derivative(free_[static_cast<std::size_t>(i)], p) *
                             coordinates_.derivative(free_[static_cast<std::size_t>(j)], p);
        solution.covariance(i, j) = std::isfinite(entry) ? entry : 0.0;
      }
    }
  }

  // Weights that are not the inverse of the bins' covariance. The covariance of the estimate is B J^T R J B, with B the
  // inverse of J^T J and R the bins' correlations. chi2 is then no chi-squared number, but its mean and variance are
  // known: tr(P R) and 2 tr(P R P R), where P projects off the tangent plane. The contribution of the few samples
  // behind R to the latter is subtracted [Srivastava2005]. Where the samples are too few to be used for weights, twice
  // their number is assumed: a covariance from overlapping windows (sim/measure/statistics.hpp) is that much better
  // known. The remaining noise only makes chi2 look less certain.
  void through_correlations(const Vector& unit, Matrix& inverse, Solution& solution) const {
    const double naive = inverse(0, 0);
    Matrix weighted = jacobian_ * unit.asDiagonal();
    if (threshold_ > 0.0) {
      for (Eigen::Index i = 0; i < weighted.rows(); ++i)
        weighted.row(i) *= std::min(1.0, threshold_ / std::max(std::abs(residual_[i]), 1e-300));
    }
    const Matrix& r = bins_.correlation;
    const Matrix correlated = r * weighted, middle = weighted.transpose() * correlated, half = inverse * middle;
    inverse = half * inverse;
    if (naive > 0.0) solution.inflation = inverse(0, 0) / naive;
    const Matrix along = tangent_plane(), across = along.transpose();
    Matrix seen = across * r, projected = r;
    projected.noalias() -= along * seen;
    seen = projected * along;
    projected.noalias() -= seen * across;
    const double trace = projected.trace();
    double trace2 = projected.squaredNorm();
    const double v = (bins_.whitening.size() > 0 ? 1.0 : 2.0) * static_cast<double>(bins_.samples) - 1.0;
    if (v > 1.0) trace2 = v * v / ((v + 2.0) * (v - 1.0)) * (trace2 - trace * trace / v);
    // At least that of as many equal and independent parts as there are bins.
    trace2 = std::max(trace2, trace * trace / static_cast<double>(residual_.size()));
    solution.expected_chi2 = trace;
    solution.chi2_variance = 2.0 * trace2;
  }

  // Orthonormal columns that span those of J, by the Cholesky factor of J^T J, whose diagonal is scaled to 1. The
  // ridge keeps the factor of dependent columns finite.
  [[nodiscard]] Matrix tangent_plane() const {
    Matrix columns = jacobian_;
    for (Eigen::Index i = 0; i < columns.cols(); ++i) columns.col(i).normalize();
    Matrix gram = columns.transpose() * columns;
    gram.diagonal().array() += ridge;
    const Eigen::LLT<Matrix> factor(gram);
    return factor.matrixL().solve(columns.transpose()).transpose();
  }

  // A Huber estimate of normal data is less certain than least squares by E psi^2/(E psi')^2; J^T W J already has E
  // psi/r.
  [[nodiscard]] double huber_inflation() const {
    double inside = 0.0;
    double psi2 = 0.0;
    double weights = 0.0;
    for (Eigen::Index i = 0; i < residual_.size(); ++i) {
      const double size = std::abs(residual_[i]);
      inside += size <= threshold_ ? 1.0 : 0.0;
      weights += std::min(1.0, threshold_ / std::max(size, 1e-300));
      psi2 += std::pow(std::min(size, threshold_), 2);
    }
    if (!(inside > 0.0)) return 1.0;
    const auto n = static_cast<double>(residual_.size());
    // With known errors E psi^2 is that of a unit normal (0.7102 at the threshold 1.345, where the factor is 1.0526);
    // without, that of the residuals, which also brings in their scale.
    const double mean_psi2 = options_.errors_known ? expected_psi2() : psi2 / n;
    return mean_psi2 / std::pow(inside / n, 2) * (weights / n);
  }
  [[nodiscard]] double expected_psi2() const {
    const double k = threshold_;
    const double tail = std::erfc(k / std::sqrt(2.0));
    const double density = std::exp(-0.5 * k * k) / std::sqrt(2.0 * 3.14159265358979323846);
    return (1.0 - tail) - 2.0 * k * density + k * k * tail;
  }

  const Bins& bins_;
  FitModel& model_;
  const LeastSquaresOptions& options_;
  Coordinates coordinates_;
  std::vector<std::size_t> free_;
  double threshold_ = 0.0;
  int evaluations_ = 0;
  int shrinks_ = 0;
  Vector residual_;
  Matrix jacobian_, scratch_;
  std::vector<std::array<double, 4>> values_;
};

}  // namespace

Solution least_squares(const Bins& bins, FitModel& model, const FitModel::Parameters& start,
                       const LeastSquaresOptions& options) {
  return Solver(bins, model, options).run(start);
}

Eigen::VectorXd weighted_residuals(const Bins& bins, const FitModel& model, const KernelRule& rule) {
  Matrix residual(static_cast<Eigen::Index>(bins.size()), 1);
  for (std::size_t i = 0; i < bins.size(); ++i) {
    residual(static_cast<Eigen::Index>(i), 0) = model.smoothed(bins.height[i], rule) - bins.density[i];
  }
  whiten(bins, residual);
  return residual.col(0);
}

}  // namespace shakebed::fit
