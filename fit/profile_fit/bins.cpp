// The weights of a window's bins: by their errors, or by their covariance as far as the samples behind it allow.
// implements: fit/profile_fit/window.hpp
#include <algorithm>
#include <cmath>

#include "fit/profile_fit/window.hpp"

namespace shakebed::fit {

namespace {

// Below this factor of [Hartlap2007] weighing by the inverse of the covariance would add more noise than it takes away.
constexpr double least_inverse_correction = 0.5;
// The smallest diagonal entry of the Cholesky factor of correlations that can be inverted, and the steps in which
// correlations are shrunk until it is reached.
constexpr double least_pivot = 1e-6, first_shrinkage = 0.02, shrinkage_growth = 1.5;

// How far correlations estimated from `samples` normal samples are best shrunk towards none, by their expected squared
// error: the oracle approximating shrinkage of [Chen2010], a form of [LedoitWolf2004] that needs no more than the
// matrix.
double sampling_shrinkage(const Eigen::MatrixXd& correlation, int samples) {
  const auto n = static_cast<double>(correlation.rows());
  const double trace2 = correlation.squaredNorm();
  const double off = trace2 - n;  // tr(R^2) - tr(R)^2/n, as tr(R) = n
  if (!(off > 0.0)) return 1.0;
  return std::min(1.0, ((1.0 - 2.0 / n) * trace2 + n * n) / ((samples + 1.0 - 2.0 / n) * off));
}

// The inverse of a covariance estimated from m samples is too large by (m - 1)/(m - n - 2) [Hartlap2007].
bool too_few_samples(int samples, Eigen::Index bins) {
  const double m = samples;
  return (m - static_cast<double>(bins) - 2.0) / (m - 1.0) < least_inverse_correction;
}

// Weights of the bins' own errors would follow what is to be weighed: a bin that happens to hold few disks also
// happens to have a small error, and a shape that so few samples happen to show little of would count for much and, by
// the same samples, scatter little: with 8 samples the variance of T came out a quarter too small. So the errors are
// averaged over half of the window.
void weigh_by_smooth_errors(const Eigen::MatrixXd& covariance, Bins& bins) {
  const Eigen::Index n = covariance.rows();
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  Eigen::VectorXd weight_error(n);
  const Eigen::Index reach = std::max<Eigen::Index>(1, n / 4);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index first = std::max<Eigen::Index>(0, i - reach), last = std::min(n - 1, i + reach);
    weight_error[i] = std::exp(sigma.segment(first, last - first + 1).array().log().mean());
    bins.inverse_error[static_cast<std::size_t>(i)] = 1.0 / weight_error[i];
  }
  bins.correlation = weight_error.cwiseInverse().asDiagonal() * covariance * weight_error.cwiseInverse().asDiagonal();
}

// The Cholesky factor of the correlations, shrunk as little as makes them positive definite; how far, in `shrink`.
Eigen::LLT<Eigen::MatrixXd> safe_cholesky(const Eigen::MatrixXd& correlation, double& shrink) {
  shrink = 0.0;
  Eigen::LLT<Eigen::MatrixXd> cholesky(correlation);
  const auto safe = [&] {
    if (cholesky.info() != Eigen::Success) return false;
    return cholesky.matrixLLT().diagonal().minCoeff() > least_pivot;
  };
  while (!safe() && shrink < 1.0) {
    shrink = shrink == 0.0 ? first_shrinkage : std::min(1.0, shrinkage_growth * shrink);
    Eigen::MatrixXd shrunk = (1.0 - shrink) * correlation;
    shrunk.diagonal().setOnes();
    cholesky.compute(shrunk);
  }
  return cholesky;
}

// A kernel wider than the bins makes neighbours nearly equal: some eigenvalues are then far below what the samples can
// tell, and weighing by them would make errors of the model's last digits into thousands of standard errors. So the
// correlations are first shrunk by what their samples' own noise asks, then, if need be, until they are positive.
void weigh_by_covariance(const Eigen::MatrixXd& covariance, Bins& bins, FitResult* result) {
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  Eigen::MatrixXd correlation = sigma.cwiseInverse().asDiagonal() * covariance * sigma.cwiseInverse().asDiagonal();
  if (bins.samples > 0) {
    correlation *= 1.0 - sampling_shrinkage(correlation, bins.samples);
    correlation.diagonal().setOnes();
  }
  double shrink = 0.0;
  const auto cholesky = safe_cholesky(correlation, shrink);
  if (shrink > 0.0 && result != nullptr) {
    result->warnings.push_back(
        "the covariance of the densities is not positive definite: its correlations were reduced by " +
        number(100.0 * shrink, 2) + " %");
  }
  bins.whitening = covariance.diagonal().cwiseSqrt().asDiagonal() * Eigen::MatrixXd(cholesky.matrixL());
  if (bins.samples > 0) {  // shrunk correlations weigh; the errors come through those measured
    const auto lower = bins.whitening.triangularView<Eigen::Lower>();
    const Eigen::MatrixXd half = lower.solve(covariance).transpose();
    const Eigen::MatrixXd whitened = lower.solve(half);
    bins.correlation = 0.5 * (whitened + whitened.transpose());
  }
}

}  // namespace

Bins bins_of(const MeasuredProfile& measured, const Window& window, FitResult* result) {
  Bins bins;
  std::vector<Eigen::Index> chosen;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    if (!measured.usable[i] || measured.height[i] < window.low || measured.height[i] > window.high) continue;
    chosen.push_back(static_cast<Eigen::Index>(i));
    bins.height.push_back(measured.height[i]);
    bins.density.push_back(measured.density[i]);
    bins.inverse_error.push_back(1.0 / measured.error[i]);
  }
  if (measured.covariance.size() == 0 || chosen.empty()) return bins;
  const auto n = static_cast<Eigen::Index>(chosen.size());
  Eigen::MatrixXd covariance(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      covariance(i, j) = measured.covariance(chosen[static_cast<std::size_t>(i)], chosen[static_cast<std::size_t>(j)]);
    }
  }
  bins.samples = measured.covariance_samples;
  // Weighed by the inverse of a covariance, an outlier is in the residuals of all its neighbours, and Huber's loss no
  // longer bounds it: of 10 % outliers of 8 errors T then scattered by 2.5 times what was stated.
  if (measured.robust) {
    weigh_by_smooth_errors(covariance, bins);
  } else if (bins.samples > 0 && too_few_samples(bins.samples, n)) {
    if (result != nullptr) {
      result->warnings.push_back("Only " + std::to_string(bins.samples) + " independent sample" +
                                 (bins.samples == 1 ? "" : "s") + " for " + std::to_string(n) +
                                 " heights: the fit ignores correlations between heights (its errors include them).");
    }
    weigh_by_smooth_errors(covariance, bins);
  } else {
    weigh_by_covariance(covariance, bins, result);
  }
  return bins;
}

Bins with_measured_errors(Bins bins, double model_error) {
  const auto n = static_cast<Eigen::Index>(bins.size());
  if (bins.correlation.size() == 0) bins.correlation = Eigen::MatrixXd::Identity(n, n);
  const double square = model_error * model_error;
  if (bins.whitening.size() > 0) {
    const Eigen::MatrixXd inverse =
        bins.whitening.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(n, n));
    bins.correlation -= square * inverse * inverse.transpose();
  } else {
    for (Eigen::Index i = 0; i < n; ++i)
      bins.correlation(i, i) -= square * std::pow(bins.inverse_error[static_cast<std::size_t>(i)], 2);
  }
  return bins;
}

}  // namespace shakebed::fit
