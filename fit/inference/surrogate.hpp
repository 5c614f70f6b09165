#pragma once

#include <cstddef>
#include <span>
#include <vector>

// A surrogate of a simulation: it predicts from runs at some points of the parameters a run at any other point, with
// its own error. It is a Gaussian process [RasmussenWilliams2006] with a quadratic trend and a length for each
// parameter. Its noise is the scatter between runs. Its few constants maximise the likelihood of the runs.
namespace shakebed::fit {

// Runs and their outputs. Several outputs, such as one number at several phases of the shaking, share the lengths and
// the ratio of signal to scatter. Each has its own scale.
struct TrainingSet {
  std::size_t parameters = 0, outputs = 0;
  std::vector<double> points;  // run by run: the parameters, each scaled to 0 to 1
  std::vector<double> values;  // run by run: the outputs, finite
  std::size_t runs() const { return parameters == 0 ? 0 : points.size() / parameters; }
};

class Surrogate {
 public:
  // At least fewest_runs(parameters); throws std::invalid_argument otherwise.
  static Surrogate train(const TrainingSet& runs);
  static std::size_t fewest_runs(std::size_t parameters) { return 4 * (parameters + 2); }

  // Prediction of a further run at each point: mean and variance, point by point, output by output. The variance holds
  // the surrogate's own error and the scatter between runs; `scatter` is the variance of the latter alone.
  struct Prediction {
    std::vector<double> mean, variance, scatter;
  };
  Prediction predict(std::span<const double> points) const;

  std::size_t parameters() const { return parameters_; }
  std::size_t outputs() const { return outputs_; }
  const std::vector<double>& lengths() const { return lengths_; }
  // Standard deviation between runs at one point, where the value is in the middle of all.
  double scatter(std::size_t output) const { return spread_[output]; }
  // Each run predicted from all others, (value - mean)/standard deviation: run by run, output by output. They are
  // standard normal where the surrogate is right.
  const std::vector<double>& left_out() const { return left_out_; }

 private:
  Surrogate() = default;
  std::size_t parameters_ = 0, outputs_ = 0, runs_ = 0;
  std::vector<double> points_;
  std::vector<double> lengths_;
  double signal_ = 0, trend_ = 0, growth_ = 0;             // variances, in units of the noise
  std::vector<double> factor_;                             // Cholesky factor of the covariance, column by column
  std::vector<double> weights_;                            // covariance^-1 values, a column an output
  std::vector<double> middle_, unit_, spread_, left_out_;  // by output; left_out_ by run, too
};

}  // namespace shakebed::fit
