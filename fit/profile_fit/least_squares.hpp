#pragma once

#include <Eigen/Cholesky>
#include <array>
#include <vector>

#include "fit/profile_fit/fit_model.hpp"
#include "fit/profile_fit/fit_profile.hpp"

// Weighted nonlinear least squares of a FitModel on the bins of a window. Internal to fit (compiles Eigen).
namespace shakebed::fit {

// The bins of a window with their weights.
struct Bins {
  std::vector<double> height, density;
  std::vector<double> inverse_error;  // 1/sigma; used when there is no covariance
  Eigen::MatrixXd whitening;          // lower Cholesky factor of the covariance; empty: diagonal
  // The covariance of the weighted densities where it is not the identity. That is so where the measured covariance is
  // too uncertain to be used for weights. The weights are then diagonal, or of shrunk correlations, and the errors
  // follow from this matrix (the "sandwich" [White1980]). Empty: none.
  Eigen::MatrixXd correlation;
  int samples = 0;  // independent ones behind covariance or correlation, 0 if not known
  [[nodiscard]] std::size_t size() const { return height.size(); }
};

struct LeastSquaresOptions {
  std::array<bool, 3> free{true, true, false};
  KernelRule kernel{Kernel{}};
  bool robust = false;
  double robust_threshold = 1.345;
  bool errors_known = true;  // robust only: the scale of the residuals is 1, else their median absolute deviation
  int max_iterations = 100;
  double lowest_temperature = 0.0;  // a bound below which the tail looks like a step
};

struct Solution {
  bool converged = false;
  bool has_curve = false;  // the model had a curve at all
  bool temperature_at_bound = false;
  bool plateau_at_bound = false;
  bool undetermined = false;  // nothing in the bins depends on one of the free parameters, to rounding
  FitModel::Parameters parameters{};
  Eigen::MatrixXd covariance;  // of the free parameters in natural units, before any scaling by chi2 (robust: final)
  double chi2 = 0.0;           // sum of squared weighted residuals
  double expected_chi2 = 0.0;  // its mean and variance, were the model true; bins - parameters and twice that unless
  double chi2_variance = 0.0;  // the bins are correlated and weighted diagonally
  double inflation = 1.0;      // variance of ln T over what the curvature of the objective says
  double objective = 0.0;      // what was minimised: chi2, or Huber's loss
  int iterations = 0;
  int evaluations = 0;
};

// Levenberg-Marquardt [More1978] in ln T, the place (ln of it when it is N D/W) and phi_0. `model` is left at the
// solution.
Solution least_squares(const Bins& bins, FitModel& model, const FitModel::Parameters& start,
                       const LeastSquaresOptions& options);

// Weighted residuals (model - data) of the curve set in the model.
Eigen::VectorXd weighted_residuals(const Bins& bins, const FitModel& model, const KernelRule& rule);

}  // namespace shakebed::fit
