#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <span>
#include <vector>

// Sampling of what is known of parameters after a measurement. Every parameter is written so that its prior is uniform
// from 0 to 1: a point is in the unit cube.
namespace shakebed::fit {

// Points that fill the unit cube evenly: Sobol's sequence, shifted by a random vector [Sobol1967,
// CranleyPatterson1976]. The first points of a longer set are the shorter set.
std::vector<double> even_points(std::size_t dimensions, std::size_t count, std::uint64_t seed);

// As many of the points as wanted, far from one another: the first is the one of greatest weight, each further one is
// the farthest from all before. Their numbers.
std::vector<std::size_t> spread_out(std::size_t dimensions, std::span<const double> points, std::size_t wanted,
                                    std::size_t first);

// The logarithm of the probability of what was measured, of each of several points.
using LogLikelihood = std::function<std::vector<double>(std::span<const double> points)>;

struct SamplingOptions {
  std::size_t first = 32768;   // even points of the whole prior
  std::size_t further = 8192;  // points of each round near what the round before found
  int most_rounds = 12;
  double enough = 1000;  // effective points [KongLiuWong1994]
  std::uint64_t seed = 1;
  int threads = 1;  // the result does not depend on it
};

struct Posterior {
  std::size_t dimensions = 0;
  std::vector<double> points;  // point by point
  std::vector<double> weight;  // of each point; their sum is 1
  std::vector<double> log_likelihood;
  double log_evidence = 0;        // logarithm of the mean likelihood over the prior
  double log_evidence_error = 0;  // of the sampling
  double effective = 0;           // 1/sum of weight^2
  int rounds = 0;                 // of importance sampling
  std::size_t size() const { return weight.size(); }
  std::span<const double> point(std::size_t i) const {
    return std::span<const double>(points).subspan(i * dimensions, dimensions);
  }
};

// By importance sampling [CappeEtAl2004]. It begins with evenly spread points of the prior. Where too few of them have
// weight, points follow from a mixture of normal distributions about those that have, a tenth from the prior. It ends
// when enough are effective. Points where the likelihood is nowhere above 0 give effective = 0.
Posterior sample_posterior(std::size_t dimensions, const LogLikelihood& log_likelihood, const SamplingOptions& options);

// Numbers of `count` points, each drawn as often as its weight says (systematic resampling).
std::vector<std::size_t> equal_draws(const std::vector<double>& weights, std::size_t count, std::uint64_t seed);

// Where the weights of the values below sum to `chance`; linear between them.
double weighted_quantile(const std::vector<double>& values, const std::vector<double>& weights, double chance);

// --- what a posterior says

// How far one normally distributed measurement is from what a model predicts. All numbers of one covariance
// diag(deviation) correlation diag(deviation) + diag(error^2).
struct Discrepancy {
  double chi2 = 0, log_determinant = 0;
};
class CorrelatedErrors {
 public:
  // Row by row; of `count` numbers.
  CorrelatedErrors(std::size_t count, std::vector<double> correlation)
      : count_(count), correlation_(std::move(correlation)) {}
  Discrepancy operator()(std::span<const double> difference, std::span<const double> deviation,
                         std::span<const double> error) const;

 private:
  std::size_t count_;
  std::vector<double> correlation_;
};
// Logarithm of the probability of a discrepancy whose covariance was itself estimated. It has the tails of Student's
// distribution, with the power at which intervals of the parameters hold the truth as often as they say
// [PercivalEtAl2022].
struct EstimatedCovariance {
  std::size_t samples = 0, numbers = 0, parameters = 0;  // it is from so many samples of so many numbers
};
double log_likelihood(const Discrepancy& found, const EstimatedCovariance& covariance);

// Of the columns of a table with `count` columns, moved towards no correlation as far as so few rows ask for
// [LedoitWolf2004, towards the identity].
std::vector<double> correlation_of(std::size_t count, const std::vector<double>& rows);

// The share of a parameter's variance that a measurement would take away on average, if the two are jointly normal:
// cov(parameter, prediction)^2/(var(parameter) (var(prediction) + variance of the measurement)).
double expected_reduction(const std::vector<double>& parameter, const std::vector<double>& prediction,
                          const std::vector<double>& weights, double measurement_variance);

}  // namespace shakebed::fit
