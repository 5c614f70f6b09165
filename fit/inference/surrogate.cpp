#include "fit/inference/surrogate.hpp"

#include <gsl/gsl_multimin.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

namespace shakebed::fit {

namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// Weak beliefs about the constants, so that few runs give no absurd ones: natural logarithms, mean and deviation.
constexpr double length_mean = 0.0, length_spread = 1.0;  // of a length, the parameter's whole range being 1
constexpr double signal_mean = 2.3, signal_spread = 2.3;  // variance of the signal over that of the scatter
constexpr double trend_mean = 4.6, trend_spread = 2.3;    // the same of the trend's coefficients
// Of the search by simplex.
constexpr double first_step = 0.7, last_size = 0.02;
constexpr int most_steps = 400;

constexpr double growth_mean = 0.0, growth_spread = 0.7;  // of the scatter with the value, see Constants
constexpr std::size_t further_constants = 3;
// Levels beyond this count as this: the scatter is not to be extrapolated.
constexpr double greatest_level = 3.0;

struct Constants {
  Vector lengths;
  double signal = 0, trend = 0;
  // The scatter goes as exp(growth value), the value in its standard deviations: hot beds scatter more than cold ones.
  double growth = 0;
};
Constants constants_of(const gsl_vector* logarithms) {
  const std::size_t d = logarithms->size - further_constants;
  Constants out;
  out.lengths.resize(static_cast<Eigen::Index>(d));
  for (std::size_t k = 0; k < d; ++k)
    out.lengths[static_cast<Eigen::Index>(k)] = std::exp(gsl_vector_get(logarithms, k));
  out.signal = std::exp(gsl_vector_get(logarithms, d));
  out.trend = std::exp(gsl_vector_get(logarithms, d + 1));
  out.growth = gsl_vector_get(logarithms, d + 2);
  return out;
}

// Covariance of the noiseless outputs at the columns of two sets of points: signal exp(-r^2/2) + trend (1 + x.y)^2, the
// points taken from the middle of their range.
Matrix covariance(const Matrix& a, const Matrix& b, const Constants& constants) {
  const Matrix at = (a.array() - 0.5).matrix(), bt = (b.array() - 0.5).matrix();
  const Vector inverse = constants.lengths.cwiseInverse();
  const Matrix as = inverse.asDiagonal() * at, bs = inverse.asDiagonal() * bt;
  Matrix r2 = -2 * as.transpose() * bs;
  r2.colwise() += as.colwise().squaredNorm().transpose();
  r2.rowwise() += bs.colwise().squaredNorm();
  const Matrix product = at.transpose() * bt;
  return (constants.signal * (-0.5 * r2.array().max(0.0)).exp() + constants.trend * (1 + product.array()).square())
      .matrix();
}

// What the search needs: points in columns, values of the outputs in columns, each with mean 0 and variance 1.
struct Runs {
  Matrix points, values;
  Vector level;  // of each run: its smoothed value, the mean of the outputs
};

// Covariance of the values of the runs, scatter and all.
Matrix with_scatter(const Runs& runs, const Constants& constants) {
  Matrix k = covariance(runs.points, runs.points, constants);
  k.diagonal().array() += (2 * constants.growth * runs.level.array()).exp();
  return k;
}

// -2 log of the probability of the values, the scale of each output at its best, and of the constants.
double misfit(const Runs& runs, const Constants& constants, const gsl_vector* logarithms) {
  const Matrix k = with_scatter(runs, constants);
  const Eigen::LLT<Matrix> factor(k);
  if (factor.info() != Eigen::Success) return 1e300;
  const auto n = static_cast<double>(k.rows());
  const double log_determinant = 2 * factor.matrixLLT().diagonal().array().log().sum();
  const Matrix half = factor.matrixL().solve(runs.values);
  double out = 0;
  for (Eigen::Index m = 0; m < half.cols(); ++m) out += n * std::log(half.col(m).squaredNorm() / n) + log_determinant;
  // Outputs that share their constants are far from independent (phases of one bed): they count once.
  out /= static_cast<double>(half.cols());
  const std::size_t d = logarithms->size - further_constants;
  for (std::size_t i = 0; i < d; ++i) out += std::pow((gsl_vector_get(logarithms, i) - length_mean) / length_spread, 2);
  out += std::pow((gsl_vector_get(logarithms, d) - signal_mean) / signal_spread, 2);
  out += std::pow((gsl_vector_get(logarithms, d + 1) - trend_mean) / trend_spread, 2);
  out += std::pow((gsl_vector_get(logarithms, d + 2) - growth_mean) / growth_spread, 2);
  return std::isfinite(out) ? out : 1e300;
}

Constants most_probable(const Runs& runs) {
  const auto d = static_cast<std::size_t>(runs.points.rows());
  const std::unique_ptr<gsl_vector, void (*)(gsl_vector*)> start(gsl_vector_alloc(d + further_constants),
                                                                 gsl_vector_free);
  const std::unique_ptr<gsl_vector, void (*)(gsl_vector*)> step(gsl_vector_alloc(d + further_constants),
                                                                gsl_vector_free);
  for (std::size_t i = 0; i < d; ++i) gsl_vector_set(start.get(), i, length_mean);
  gsl_vector_set(start.get(), d, signal_mean);
  gsl_vector_set(start.get(), d + 1, trend_mean);
  gsl_vector_set(start.get(), d + 2, growth_mean);
  gsl_vector_set_all(step.get(), first_step);
  gsl_multimin_function function;
  function.n = d + further_constants;
  function.f = [](const gsl_vector* at, void* data) {
    return misfit(*static_cast<const Runs*>(data), constants_of(at), at);
  };
  function.params = const_cast<Runs*>(&runs);
  const std::unique_ptr<gsl_multimin_fminimizer, void (*)(gsl_multimin_fminimizer*)> search(
      gsl_multimin_fminimizer_alloc(gsl_multimin_fminimizer_nmsimplex2, d + further_constants),
      gsl_multimin_fminimizer_free);
  gsl_multimin_fminimizer_set(search.get(), &function, start.get(), step.get());
  for (int i = 0; i < most_steps; ++i) {
    if (gsl_multimin_fminimizer_iterate(search.get()) != 0) break;
    if (gsl_multimin_fminimizer_size(search.get()) < last_size) break;
  }
  return constants_of(gsl_multimin_fminimizer_x(search.get()));
}

Matrix in_columns(std::span<const double> points, std::size_t parameters) {
  return Eigen::Map<const Matrix>(points.data(), static_cast<Eigen::Index>(parameters),
                                  static_cast<Eigen::Index>(points.size() / parameters));
}

}  // namespace

Surrogate Surrogate::train(const TrainingSet& set) {
  const std::size_t n = set.runs(), m = set.outputs;
  if (n < fewest_runs(set.parameters) || m == 0 || set.values.size() != n * m)
    throw std::invalid_argument("a surrogate of " + std::to_string(set.parameters) + " parameters needs at least " +
                                std::to_string(fewest_runs(set.parameters)) + " runs, but " + std::to_string(n) +
                                " were given");
  Surrogate out;
  out.parameters_ = set.parameters, out.outputs_ = m, out.runs_ = n;
  out.points_ = set.points;
  const auto rows = static_cast<Eigen::Index>(n), columns = static_cast<Eigen::Index>(m);
  Runs runs{in_columns(set.points, set.parameters),
            Eigen::Map<const Matrix>(set.values.data(), columns, rows).transpose(),
            {}};
  for (Eigen::Index k = 0; k < columns; ++k) {
    const double middle = runs.values.col(k).mean();
    runs.values.col(k).array() -= middle;
    const double unit = std::sqrt(runs.values.col(k).squaredNorm() / static_cast<double>(n));
    out.middle_.push_back(middle);
    out.unit_.push_back(unit > 0 ? unit : 1);
    runs.values.col(k) /= out.unit_.back();
  }
  // First with the same scatter everywhere, which smooths the values; then with what that says of each run's level.
  runs.level = Vector::Zero(rows);
  Constants constants = most_probable(runs);
  for (int pass = 0; pass < 2; ++pass) {
    const Matrix smooth = covariance(runs.points, runs.points, constants) *
                          Eigen::LLT<Matrix>(with_scatter(runs, constants)).solve(runs.values);
    runs.level = smooth.rowwise().mean().cwiseMax(-greatest_level).cwiseMin(greatest_level);
    constants = most_probable(runs);
  }
  out.lengths_.assign(constants.lengths.begin(), constants.lengths.end());
  out.signal_ = constants.signal, out.trend_ = constants.trend;
  out.growth_ = constants.growth;
  const Eigen::LLT<Matrix> factor(with_scatter(runs, constants));
  const Matrix lower = factor.matrixL();
  const Matrix weights = factor.solve(runs.values);
  const Vector inverse_diagonal = factor.solve(Matrix::Identity(rows, rows)).diagonal();
  out.factor_.assign(lower.data(), lower.data() + lower.size());
  out.weights_.assign(weights.data(), weights.data() + weights.size());
  out.left_out_.resize(n * m);
  for (Eigen::Index j = 0; j < columns; ++j) {
    const double noise = std::sqrt(std::max(1e-300, runs.values.col(j).dot(weights.col(j)) / static_cast<double>(n)));
    out.spread_.push_back(noise * out.unit_[static_cast<std::size_t>(j)]);
    for (Eigen::Index i = 0; i < rows; ++i)
      out.left_out_[static_cast<std::size_t>(i * columns + j)] = weights(i, j) / std::sqrt(inverse_diagonal[i]) / noise;
  }
  return out;
}

Surrogate::Prediction Surrogate::predict(std::span<const double> points) const {
  constexpr std::size_t block = 64;  // points at once: matrix products in place of vectors
  const std::size_t count = points.size() / parameters_;
  Prediction out;
  out.mean.resize(count * outputs_);
  out.variance.resize(count * outputs_);
  out.scatter.resize(count * outputs_);
  const Matrix runs = in_columns(points_, parameters_);
  const auto n = static_cast<Eigen::Index>(runs_);
  const Eigen::Map<const Matrix> factor(factor_.data(), n, n);
  const Eigen::Map<const Matrix> weights(weights_.data(), n, static_cast<Eigen::Index>(outputs_));
  const Constants constants{Eigen::Map<const Vector>(lengths_.data(), static_cast<Eigen::Index>(lengths_.size())),
                            signal_, trend_, growth_};
  for (std::size_t first = 0; first < count; first += block) {
    const std::size_t here = std::min(block, count - first);
    const Matrix at = in_columns(points.subspan(first * parameters_, here * parameters_), parameters_);
    Matrix k = covariance(runs, at, constants);
    const Matrix mean = k.transpose() * weights;
    factor.triangularView<Eigen::Lower>().solveInPlace(k);
    for (std::size_t i = 0; i < here; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double square = (at.col(row).array() - 0.5).square().sum();
      const double prior = signal_ + trend_ * (1 + square) * (1 + square);
      const double own = std::max(0.0, prior - k.col(row).squaredNorm());
      const double level = std::clamp(mean.row(row).mean(), -greatest_level, greatest_level);
      const double noise = std::exp(2 * growth_ * level);
      for (std::size_t m = 0; m < outputs_; ++m) {
        out.mean[(first + i) * outputs_ + m] = middle_[m] + unit_[m] * mean(row, static_cast<Eigen::Index>(m));
        out.variance[(first + i) * outputs_ + m] = spread_[m] * spread_[m] * (noise + own);
        out.scatter[(first + i) * outputs_ + m] = spread_[m] * spread_[m] * noise;
      }
    }
  }
  return out;
}

}  // namespace shakebed::fit
