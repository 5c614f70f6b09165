#include "fit/inference/posterior.hpp"

#include <gsl/gsl_qrng.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>
#include <stdexcept>

#include "fit/profile_fit/chances.hpp"
#include "statistics/parallel.hpp"

namespace shakebed::fit {

namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

constexpr std::size_t points_at_once = 512;  // of a call of the likelihood
// Of the mixture: its centres, the share that comes from the prior, and how much wider than the points it is.
constexpr std::size_t mixture_centres = 64;
constexpr double prior_share = 0.1;
constexpr double mixture_width = 0.5;  // of a normal distribution, in standard deviations of the weighted points

std::vector<double> likelihoods(std::size_t dimensions, const std::vector<double>& points,
                                const LogLikelihood& log_likelihood, int threads) {
  const std::size_t count = points.size() / dimensions;
  std::vector<double> out(count);
  for_each_index((count + points_at_once - 1) / points_at_once, threads, [&](std::size_t block) {
    const std::size_t first = block * points_at_once, here = std::min(points_at_once, count - first);
    const std::vector<double> found =
        log_likelihood(std::span<const double>(points).subspan(first * dimensions, here * dimensions));
    std::copy(found.begin(), found.end(), out.begin() + static_cast<std::ptrdiff_t>(first));
  });
  return out;
}

// Weights from logarithms of likelihood and of the density that the points were drawn from.
void weigh(Posterior& posterior, const std::vector<double>& log_density) {
  std::vector<double> log_weight(posterior.log_likelihood.size());
  double greatest = -INFINITY;
  for (std::size_t i = 0; i < log_weight.size(); ++i) {
    log_weight[i] = posterior.log_likelihood[i] - log_density[i];
    if (std::isfinite(log_weight[i])) greatest = std::max(greatest, log_weight[i]);
  }
  posterior.weight.assign(log_weight.size(), 0);
  posterior.effective = 0;
  if (!std::isfinite(greatest)) return;
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < log_weight.size(); ++i) {
    const double weight = std::isfinite(log_weight[i]) ? std::exp(log_weight[i] - greatest) : 0;
    posterior.weight[i] = weight, sum += weight, squares += weight * weight;
  }
  for (double& weight : posterior.weight) weight /= sum;
  const auto n = static_cast<double>(log_weight.size());
  posterior.effective = sum * sum / squares;
  posterior.log_evidence = greatest + std::log(sum / n);
  posterior.log_evidence_error = std::sqrt(std::max(0.0, squares / (sum * sum) - 1 / n));
}

// Normal distributions of one covariance about points of the posterior, and the prior.
class Mixture {
 public:
  Mixture(const Posterior& posterior, std::uint64_t seed) : dimensions_(posterior.dimensions) {
    const auto d = static_cast<Eigen::Index>(dimensions_);
    Vector mean = Vector::Zero(d);
    for (std::size_t i = 0; i < posterior.size(); ++i) mean += posterior.weight[i] * at(posterior, i);
    Matrix spread = Matrix::Zero(d, d);
    for (std::size_t i = 0; i < posterior.size(); ++i)
      spread += posterior.weight[i] * (at(posterior, i) - mean) * (at(posterior, i) - mean).transpose();
    spread *= mixture_width * mixture_width;
    // A parameter that only one point speaks of is searched in steps of a thousandth.
    spread.diagonal().array() += 1e-6;
    const Eigen::LLT<Matrix> factor(spread);
    lower_ = factor.matrixL();
    log_normal_ = -0.5 * static_cast<double>(dimensions_) * std::log(2 * std::numbers::pi) -
                  lower_.diagonal().array().log().sum();
    for (const std::size_t i : equal_draws(posterior.weight, mixture_centres, seed))
      centres_.push_back(at(posterior, i));
  }

  // Points outside of the cube are kept: their likelihood is 0.
  void draw(std::mt19937_64& generator, std::vector<double>& out) const {
    const auto d = static_cast<Eigen::Index>(dimensions_);
    if (even_number(generator) < prior_share) {
      for (Eigen::Index k = 0; k < d; ++k) out.push_back(even_number(generator));
      return;
    }
    const auto centre = static_cast<std::size_t>(even_number(generator) * static_cast<double>(centres_.size()));
    Vector step(d);
    for (double& one : step) one = normal_number(generator);
    const Vector point = centres_[centre] + lower_ * step;
    out.insert(out.end(), point.begin(), point.end());
  }
  double log_density(const double* point) const {
    const Eigen::Map<const Vector> x(point, static_cast<Eigen::Index>(dimensions_));
    double sum = 0;
    for (const Vector& centre : centres_)
      sum += std::exp(-0.5 * lower_.triangularView<Eigen::Lower>().solve(x - centre).squaredNorm());
    return std::log(prior_share +
                    (1 - prior_share) * sum / static_cast<double>(centres_.size()) * std::exp(log_normal_));
  }

 private:
  static Eigen::Map<const Vector> at(const Posterior& posterior, std::size_t i) {
    return {posterior.points.data() + i * posterior.dimensions, static_cast<Eigen::Index>(posterior.dimensions)};
  }
  std::size_t dimensions_;
  Matrix lower_;
  std::vector<Vector> centres_;
  double log_normal_ = 0;
};

bool in_cube(const double* point, std::size_t dimensions) {
  return std::all_of(point, point + dimensions, [](double u) { return u >= 0 && u <= 1; });
}

Posterior further_round(const Posterior& before, const LogLikelihood& log_likelihood, const SamplingOptions& options,
                        std::uint64_t seed) {
  const std::size_t d = before.dimensions;
  const Mixture mixture(before, seed);
  std::mt19937_64 generator(seed);
  Posterior after;
  after.dimensions = d;
  for (std::size_t i = 0; i < options.further; ++i) mixture.draw(generator, after.points);
  std::vector<double> inside, log_density(options.further);
  std::vector<std::size_t> place;
  for (std::size_t i = 0; i < options.further; ++i) {
    const double* point = after.points.data() + i * d;
    if (!in_cube(point, d)) continue;
    log_density[i] = mixture.log_density(point);
    place.push_back(i);
    inside.insert(inside.end(), point, point + d);
  }
  after.log_likelihood.assign(options.further, -INFINITY);
  const std::vector<double> found = likelihoods(d, inside, log_likelihood, options.threads);
  for (std::size_t k = 0; k < place.size(); ++k) after.log_likelihood[place[k]] = found[k];
  weigh(after, log_density);
  return after;
}

}  // namespace

std::vector<double> even_points(std::size_t dimensions, std::size_t count, std::uint64_t seed) {
  // GSL itself gives a sequence of more dimensions, all of whose points are the same.
  if (dimensions < 1 || dimensions > gsl_qrng_sobol->max_dimension)
    throw std::invalid_argument("even_points: " + std::to_string(dimensions) + " dimensions; there must be 1 to " +
                                std::to_string(gsl_qrng_sobol->max_dimension));
  const std::unique_ptr<gsl_qrng, void (*)(gsl_qrng*)> sequence(
      gsl_qrng_alloc(gsl_qrng_sobol, static_cast<unsigned>(dimensions)), gsl_qrng_free);
  std::mt19937_64 generator(seed);
  std::vector<double> shift(dimensions), point(dimensions), out;
  for (double& one : shift) one = even_number(generator);
  for (std::size_t i = 0; i < count; ++i) {
    gsl_qrng_get(sequence.get(), point.data());
    for (std::size_t k = 0; k < dimensions; ++k) out.push_back(std::fmod(point[k] + shift[k], 1.0));
  }
  return out;
}

std::vector<std::size_t> spread_out(std::size_t dimensions, std::span<const double> points, std::size_t wanted,
                                    std::size_t first) {
  const std::size_t count = points.size() / dimensions;
  std::vector<std::size_t> chosen;
  std::vector<double> distance(count, INFINITY);
  for (std::size_t next = first; chosen.size() < std::min(wanted, count);) {
    chosen.push_back(next);
    for (std::size_t i = 0; i < count; ++i) {
      double square = 0;
      for (std::size_t k = 0; k < dimensions; ++k)
        square += std::pow(points[i * dimensions + k] - points[next * dimensions + k], 2);
      distance[i] = std::min(distance[i], square);
    }
    next = static_cast<std::size_t>(std::max_element(distance.begin(), distance.end()) - distance.begin());
  }
  return chosen;
}

Posterior sample_posterior(std::size_t dimensions, const LogLikelihood& log_likelihood,
                           const SamplingOptions& options) {
  Posterior out;
  out.dimensions = dimensions;
  out.points = even_points(dimensions, options.first, options.seed);
  out.log_likelihood = likelihoods(dimensions, out.points, log_likelihood, options.threads);
  weigh(out, std::vector<double>(options.first, 0.0));
  int rounds = 1;
  for (; rounds <= options.most_rounds && out.effective > 0 && out.effective < options.enough; ++rounds)
    out = further_round(out, log_likelihood, options, options.seed + static_cast<std::uint64_t>(rounds));
  out.rounds = rounds;
  return out;
}

std::vector<std::size_t> equal_draws(const std::vector<double>& weights, std::size_t count, std::uint64_t seed) {
  std::mt19937_64 generator(seed ^ 0x5851f42d4c957f2dULL);
  const double offset = even_number(generator);
  std::vector<std::size_t> out;
  double sum = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    sum += weights[i];
    while (out.size() < count && (static_cast<double>(out.size()) + offset) / static_cast<double>(count) < sum)
      out.push_back(i);
  }
  while (out.size() < count && !out.empty()) out.push_back(out.back());  // the sum is below 1 by rounding
  return out;
}

double weighted_quantile(const std::vector<double>& values, const std::vector<double>& weights, double chance) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t l, std::size_t r) { return values[l] < values[r]; });
  double below = 0, last = NAN, last_middle = 0;
  for (const std::size_t i : order) {
    if (!(weights[i] > 0)) continue;
    const double middle = below + weights[i] / 2;
    if (middle >= chance) {
      if (std::isnan(last)) return values[i];
      return last + (values[i] - last) * (chance - last_middle) / (middle - last_middle);
    }
    below += weights[i], last = values[i], last_middle = middle;
  }
  return last;
}

Discrepancy CorrelatedErrors::operator()(std::span<const double> difference, std::span<const double> deviation,
                                         std::span<const double> error) const {
  const auto n = static_cast<Eigen::Index>(count_);
  Matrix covariance(n, n);
  for (std::size_t i = 0; i < count_; ++i) {
    for (std::size_t k = 0; k < count_; ++k)
      covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
          deviation[i] * correlation_[i * count_ + k] * deviation[k] + (i == k ? error[i] * error[i] : 0);
  }
  const Eigen::LLT<Matrix> factor(covariance);
  if (factor.info() != Eigen::Success) return {INFINITY, 0};
  const Eigen::Map<const Vector> off(difference.data(), n);
  return {factor.matrixL().solve(off).squaredNorm(), 2 * factor.matrixLLT().diagonal().array().log().sum()};
}

double log_likelihood(const Discrepancy& found, const EstimatedCovariance& covariance) {
  const double samples = std::max(2.0, static_cast<double>(covariance.samples));
  const double numbers = static_cast<double>(covariance.numbers),
               parameters = static_cast<double>(covariance.parameters);
  const double more = std::max(1.0, samples - numbers - 4);
  const double b = (more + 2) / ((more + 3) * more) * std::max(0.0, numbers - parameters);
  const double power = parameters + 2 + (samples - 1 + b) / (1 + b);
  return -0.5 * (power * std::log1p(found.chi2 / (samples - 1)) + found.log_determinant);
}

std::vector<double> correlation_of(std::size_t count, const std::vector<double>& rows) {
  const std::size_t n = rows.size() / count;
  std::vector<double> product(count * count, 0.0), square(count * count, 0.0);
  std::vector<double> mean(count, 0.0), deviation(count, 0.0);
  for (std::size_t r = 0; r < n; ++r)
    for (std::size_t i = 0; i < count; ++i) mean[i] += rows[r * count + i] / static_cast<double>(n);
  for (std::size_t r = 0; r < n; ++r)
    for (std::size_t i = 0; i < count; ++i)
      deviation[i] += std::pow(rows[r * count + i] - mean[i], 2) / static_cast<double>(n);
  for (double& one : deviation) one = std::sqrt(std::max(one, 1e-300));
  for (std::size_t r = 0; r < n; ++r) {
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < count; ++k) {
        const double both =
            (rows[r * count + i] - mean[i]) / deviation[i] * (rows[r * count + k] - mean[k]) / deviation[k];
        product[i * count + k] += both / static_cast<double>(n);
        square[i * count + k] += both * both / static_cast<double>(n);
      }
    }
  }
  // Shrinkage: the variance of the estimates over what they are.
  double noise = 0, signal = 0;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < count; ++k) {
      if (i == k) continue;
      const double r = product[i * count + k];
      noise += (square[i * count + k] - r * r) / static_cast<double>(n), signal += r * r;
    }
  }
  const double kept = signal > 0 ? 1 - std::clamp(noise / signal, 0.0, 1.0) : 0;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < count; ++k) product[i * count + k] = i == k ? 1 : kept * product[i * count + k];
  return product;
}

double expected_reduction(const std::vector<double>& parameter, const std::vector<double>& prediction,
                          const std::vector<double>& weights, double measurement_variance) {
  double p = 0, q = 0, pp = 0, qq = 0, pq = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) p += weights[i] * parameter[i], q += weights[i] * prediction[i];
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const double a = parameter[i] - p, b = prediction[i] - q;
    pp += weights[i] * a * a, qq += weights[i] * b * b, pq += weights[i] * a * b;
  }
  const double total = pp * (qq + measurement_variance);
  return total > 0 ? pq * pq / total : 0;
}

}  // namespace shakebed::fit
