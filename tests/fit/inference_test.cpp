// Surrogates and posteriors against what can be worked out, and their calibration on a stand-in for the simulation.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "fit/inference/posterior.hpp"
#include "fit/inference/surrogate.hpp"
#include "fit/profile_fit/chances.hpp"

namespace shakebed::fit {
namespace {

// A stand-in for a bed: two numbers of three parameters, with scatter.
constexpr double scatter_of[] = {0.05, 0.1};
std::vector<double> stand_in(std::span<const double> p) {
  return {std::sin(2 * p[0]) + p[1] * p[1] + 0.3 * p[2], std::exp(p[0] * p[1]) - 0.8 * p[0] + p[2] * p[0]};
}
TrainingSet stand_in_runs(std::size_t runs, std::size_t output, std::uint64_t seed) {
  TrainingSet set;
  set.parameters = 3, set.outputs = 1;
  set.points = even_points(3, runs, 7);
  std::mt19937_64 generator(seed + output);
  for (std::size_t i = 0; i < runs; ++i)
    set.values.push_back(stand_in(std::span<const double>(set.points).subspan(3 * i, 3))[output] +
                         scatter_of[output] * normal_quantile(even_number(generator)));
  return set;
}

TEST(Surrogate, PredictsFurtherRunsWithItsStatedError) {
  const Surrogate surrogate = Surrogate::train(stand_in_runs(100, 0, 1));
  EXPECT_NEAR(surrogate.scatter(0) / scatter_of[0], 1, 0.25) << "of 100 runs, 3.5 standard errors";
  std::mt19937_64 generator(5);
  double squares = 0;
  constexpr int further = 400;
  for (int i = 0; i < further; ++i) {
    const std::vector<double> point{even_number(generator), even_number(generator), even_number(generator)};
    const auto found = surrogate.predict(point);
    const double value = stand_in(point)[0] + scatter_of[0] * normal_quantile(even_number(generator));
    squares += std::pow(value - found.mean[0], 2) / found.variance[0];
    EXPECT_LT(std::sqrt(found.variance[0]), 2 * scatter_of[0]);
  }
  EXPECT_NEAR(squares / further, 1, 0.35);
  double left_out = 0;
  for (const double one : surrogate.left_out()) left_out += one * one;
  EXPECT_NEAR(left_out / 100, 1, 0.3);
}

// Which parameter is called the first does not matter, nor which end of a range is called 0, nor the unit of a value.
// The search for the constants stops within some per cent, which depends on their order.
TEST(Surrogate, DoesNotDependOnNamesAndUnits) {
  const TrainingSet runs = stand_in_runs(60, 0, 1);
  const Surrogate usual = Surrogate::train(runs);
  for (std::size_t first = 0; first < 3; ++first) {
    TrainingSet other = runs;
    for (std::size_t r = 0; r < runs.runs(); ++r) {
      for (std::size_t k = 0; k < 3; ++k) other.points[3 * r + k] = 1 - runs.points[3 * r + (k + first) % 3];
      other.values[r] = 1e6 - 1e3 * runs.values[r];
    }
    const Surrogate turned = Surrogate::train(other);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(std::log(turned.lengths()[k] / usual.lengths()[(k + first) % 3]), 0, 0.2) << first << ' ' << k;
    EXPECT_NEAR(turned.scatter(0) / usual.scatter(0) / 1e3, 1, 0.02);
    std::mt19937_64 generator(6);
    for (int i = 0; i < 20; ++i) {
      const std::vector<double> point{even_number(generator), even_number(generator), even_number(generator)};
      std::vector<double> there;
      for (std::size_t k = 0; k < 3; ++k) there.push_back(1 - point[(k + first) % 3]);
      EXPECT_NEAR((1e6 - turned.predict(there).mean[0]) / 1e3, usual.predict(point).mean[0], 0.15 * usual.scatter(0));
    }
  }
}

// Points are predicted in blocks; two outputs share their constants and nothing else.
TEST(Surrogate, PredictsManyPointsAsOneByOne) {
  const TrainingSet one = stand_in_runs(40, 0, 1), two = stand_in_runs(40, 1, 1);
  ASSERT_EQ(one.points, two.points);
  TrainingSet both = one;
  both.outputs = 2;
  both.values.clear();
  for (std::size_t r = 0; r < 40; ++r) both.values.insert(both.values.end(), {one.values[r], two.values[r]});
  const Surrogate surrogate = Surrogate::train(both);
  std::mt19937_64 generator(8);
  std::vector<double> points;
  for (int i = 0; i < 3 * 150; ++i) points.push_back(even_number(generator));
  const Surrogate::Prediction all = surrogate.predict(points);
  ASSERT_EQ(all.mean.size(), 300U);
  ASSERT_EQ(all.variance.size(), 300U);
  ASSERT_EQ(all.scatter.size(), 300U);
  for (std::size_t i = 0; i < 150; ++i) {
    const auto alone = surrogate.predict(std::span<const double>(points).subspan(3 * i, 3));
    for (std::size_t m = 0; m < 2; ++m) {
      EXPECT_NEAR(all.mean[2 * i + m], alone.mean[m], 1e-9) << i;
      EXPECT_NEAR(all.variance[2 * i + m] / alone.variance[m], 1, 1e-9) << i;
      EXPECT_NEAR(all.scatter[2 * i + m] / alone.scatter[m], 1, 1e-9) << i;
    }
  }
}

// The lengths are those of the values: short for the parameter along which they go up and down, and longer than its
// whole range for the one that does not matter. A search that ends at its first step finds lengths about 1.
TEST(Surrogate, FindsTheLengthOfEachParameter) {
  TrainingSet runs;
  runs.parameters = 2, runs.outputs = 1;
  std::mt19937_64 generator(12);
  for (int r = 0; r < 50; ++r) {
    const double x = even_number(generator), y = even_number(generator);
    runs.points.insert(runs.points.end(), {x, y});
    runs.values.push_back(std::sin(12 * x) + 0.05 * normal_quantile(even_number(generator)));
  }
  const Surrogate surrogate = Surrogate::train(runs);
  EXPECT_LT(surrogate.lengths()[0], 0.3);
  EXPECT_GT(surrogate.lengths()[1], 1.5);
  EXPECT_NEAR(surrogate.scatter(0) / 0.05, 1, 0.4) << "of 50 runs, 4 standard errors";
}

// The scatter grows with the value, up to three standard deviations of the values. Beyond these it is not extrapolated.
TEST(Surrogate, DoesNotExtrapolateItsScatter) {
  TrainingSet runs;
  runs.parameters = 1, runs.outputs = 1;
  std::mt19937_64 generator(4);
  constexpr int number = 80;
  double sum = 0, squares = 0;
  for (int r = 0; r < number; ++r) {
    const double x = (r + 0.5) / number, value = std::pow(x, 10);
    runs.points.push_back(x);
    runs.values.push_back(value + 0.004 * std::exp(3 * value) * normal_quantile(even_number(generator)));
    sum += value / number, squares += value * value / number;
  }
  const Surrogate surrogate = Surrogate::train(runs);
  std::vector<double> below, beyond;
  double farthest = 0;
  for (double x = 0.9; x < 1; x += 0.002) {
    const auto found = surrogate.predict(std::vector<double>{x});
    const double level = (found.mean[0] - sum) / std::sqrt(squares - sum * sum);
    (level < 3 ? below : beyond).push_back(found.scatter[0]);
    farthest = std::max(farthest, level);
  }
  EXPECT_GT(farthest, 3.1);
  EXPECT_GT(below.back() / below.front(), 2);
  for (const double scatter : beyond) EXPECT_NEAR(scatter / beyond.front(), 1, 1e-9);
}

TEST(Surrogate, NeedsRunsEnough) {
  EXPECT_THROW(Surrogate::train(stand_in_runs(19, 0, 1)), std::invalid_argument);
  TrainingSet runs = stand_in_runs(20, 0, 1);
  const Surrogate surrogate = Surrogate::train(runs);
  EXPECT_EQ(surrogate.parameters(), 3U);
  EXPECT_EQ(surrogate.outputs(), 1U);
  EXPECT_EQ(surrogate.left_out().size(), 20U);
  runs.values.pop_back();
  EXPECT_THROW(Surrogate::train(runs), std::invalid_argument) << "a value is missing";
  runs.outputs = 0, runs.values.clear();
  EXPECT_THROW(Surrogate::train(runs), std::invalid_argument) << "nothing to predict";
}

// A normal likelihood within the cube: mean, deviation and evidence are known.
TEST(Posterior, OfANormalLikelihoodIsExact) {
  constexpr double deviation[] = {0.03, 0.01};
  for (const double narrow : {1.0, 0.02}) {
    const auto likelihood = [&](std::span<const double> points) {
      std::vector<double> out;
      for (std::size_t i = 0; i < points.size(); i += 2) {
        out.push_back(0);
        for (std::size_t k = 0; k < 2; ++k)
          out.back() -= 0.5 * std::pow((points[i + k] - 0.4) / deviation[k] / narrow, 2);
      }
      return out;
    };
    SamplingOptions options;
    const Posterior one = sample_posterior(2, likelihood, options);
    EXPECT_GT(one.effective, narrow == 1 ? 30 : 900);
    EXPECT_EQ(one.rounds > 1, one.size() == options.further);
    for (std::size_t k = 0; k < 2; ++k) {
      std::vector<double> values;
      for (std::size_t i = 0; i < one.size(); ++i) values.push_back(one.point(i)[k]);
      const double width = deviation[k] * narrow;
      EXPECT_NEAR(weighted_quantile(values, one.weight, 0.5), 0.4, 0.15 * width);
      EXPECT_NEAR(weighted_quantile(values, one.weight, normal_chance(1)) - 0.4, width, 0.15 * width);
    }
    const double exact = std::log(2 * M_PI * deviation[0] * deviation[1] * narrow * narrow);
    EXPECT_NEAR(one.log_evidence, exact, 4 * one.log_evidence_error + 0.02);
    options.threads = 3;
    const Posterior again = sample_posterior(2, likelihood, options);
    EXPECT_EQ(one.points, again.points);
    EXPECT_EQ(one.weight, again.weight);
  }
}

TEST(Posterior, SmallToolsDoWhatTheySay) {
  const std::vector<double> longer = even_points(2, 64, 3), shorter = even_points(2, 16, 3);
  EXPECT_TRUE(std::equal(shorter.begin(), shorter.end(), longer.begin()));
  EXPECT_EQ(weighted_quantile({3, 1, 2}, {0.25, 0.25, 0.5}, 0.5), 2);
  const std::vector<std::size_t> draws = equal_draws({0.5, 0, 0.25, 0.25}, 8, 1);
  EXPECT_EQ(std::count(draws.begin(), draws.end(), 0U), 4);
  EXPECT_EQ(std::count(draws.begin(), draws.end(), 1U), 0);
  EXPECT_EQ(spread_out(1, std::vector<double>{0.5, 0.4, 0.0, 0.9}, 3, 0), (std::vector<std::size_t>{0, 2, 3}));
  // Two numbers with correlation r: chi2 by hand.
  const CorrelatedErrors errors(2, {1, 0.5, 0.5, 1});
  const std::vector<double> off{1, 2}, deviation{1, 2}, none{0, 0};
  const double expected = (1 * 1 - 2 * 0.5 * 1 * 1 + 1 * 1) / (1 - 0.25);
  EXPECT_NEAR(errors(off, deviation, none).chi2, expected, 1e-12);
  EXPECT_NEAR(errors(off, deviation, none).log_determinant, std::log(4 * 0.75), 1e-12);
  EXPECT_NEAR(expected_reduction({0, 1}, {0, 2}, {0.5, 0.5}, 1), 0.5, 1e-12) << "variance 1 of 1 + 1 is the signal's";
  EXPECT_NEAR(chance_of_chi2(9, 1), 0.0026998, 1e-6);
  EXPECT_NEAR(as_deviations(0.0026998), 3, 1e-4);
  std::mt19937_64 generator(2);
  std::vector<double> rows;
  for (int i = 0; i < 4000; ++i) {
    const double a = normal_quantile(even_number(generator)), b = normal_quantile(even_number(generator));
    rows.push_back(a), rows.push_back(5 * (0.6 * a + 0.8 * b));
  }
  EXPECT_NEAR(correlation_of(2, rows)[1], 0.6, 0.04);
}

// The quantile of a value is at the middle of its weight: 0.125, 0.5 and 0.875 here. Between them it is linear, beyond
// them the outermost value. What has no weight does not count.
TEST(WeightedQuantile, IsLinearBetweenTheMiddlesOfWeights) {
  const std::vector<double> values{30, 10, -5, 20, 99}, weights{0.25, 0.25, 0, 0.5, 0};
  for (const auto& [chance, expected] : {std::pair{0.0, 10.0},
                                         {0.1, 10.0},
                                         {0.125, 10.0},
                                         {0.3125, 15.0},
                                         {0.5, 20.0},
                                         {0.575, 22.0},
                                         {0.6875, 25.0},
                                         {0.875, 30.0},
                                         {0.99, 30.0}})
    EXPECT_NEAR(weighted_quantile(values, weights, chance), expected, 1e-12) << chance;
  EXPECT_TRUE(std::isnan(weighted_quantile({1, 2}, {0, 0}, 0.5)));
}

// Deviations 1 and 2 with the correlation 1/2, and errors 3 and 4 of their own: the covariance is 10, 1; 1, 20.
TEST(CorrelatedErrors, AddTheErrorsThatAreNotCorrelated) {
  const CorrelatedErrors errors(2, {1, 0.5, 0.5, 1});
  const std::vector<double> off{1, 2}, deviation{1, 2}, own{3, 4};
  EXPECT_NEAR(errors(off, deviation, own).chi2, (20 * 1 - 2 * 1 * 1 * 2 + 10 * 4) / 199.0, 1e-13);
  EXPECT_NEAR(errors(off, deviation, own).log_determinant, std::log(199), 1e-13);
  const std::vector<double> none{0, 0};
  EXPECT_EQ(CorrelatedErrors(2, {1, 1.5, 1.5, 1})(off, deviation, none).chi2, INFINITY) << "no correlation";
}

// Of very many samples it is the normal distribution. Fewer samples have heavier tails, and none has another power
// where the numbers are no more than the parameters: samples + parameters + 1.
TEST(EstimatedCovariance, HasTheTailsOfItsSamples) {
  EXPECT_NEAR(log_likelihood({7, -3}, {100'000'000, 10, 2}), -0.5 * (7 - 3), 1e-5);
  EXPECT_NEAR(log_likelihood({7, -3}, {30, 2, 2}), -0.5 * (33 * std::log(1 + 7.0 / 29) - 3), 1e-12);
  EXPECT_NEAR(log_likelihood({7, -3}, {30, 1, 2}), -0.5 * (33 * std::log(1 + 7.0 / 29) - 3), 1e-12);
  const double two = log_likelihood({7, -3}, {2, 10, 2});
  EXPECT_EQ(log_likelihood({7, -3}, {0, 10, 2}), two);
  EXPECT_EQ(log_likelihood({7, -3}, {1, 10, 2}), two);
  // Between parameters + 3, where the weights' noise is without bound, and samples + parameters + 1, where there is
  // none.
  for (const std::size_t samples : {3U, 8U, 14U, 15U, 20U}) {
    const double lost = log_likelihood({1e6, 0}, {samples, 10, 2}) - log_likelihood({1e3, 0}, {samples, 10, 2});
    const auto n = static_cast<double>(samples);
    const double power = -2 * lost / std::log((n - 1 + 1e6) / (n - 1 + 1e3));
    EXPECT_GT(power, 5) << samples;
    EXPECT_LT(power, n + 3) << samples;
  }
}

// Weights 1/4 and 3/4: variances 3 and 3/4, covariance 3/2, and 1/4 of the measurement's own.
TEST(ExpectedReduction, IsTheSquareOfACorrelation) {
  EXPECT_NEAR(expected_reduction({0, 4}, {1, 3}, {0.25, 0.75}, 0.25), 1.5 * 1.5 / (3 * (0.75 + 0.25)), 1e-14);
  EXPECT_NEAR(expected_reduction({0, 4}, {1, 3}, {0.25, 0.75}, 0), 1, 1e-14);
  EXPECT_EQ(expected_reduction({4, 4}, {1, 3}, {0.25, 0.75}, 0.25), 0);
  EXPECT_EQ(expected_reduction({0, 4}, {1, 1}, {0.25, 0.75}, 0), 0);
}

// A likelihood of e^5 in half of the cube and 0 in the other: half of the even points count, all alike, so the evidence
// is e^5/2, known to sqrt(1/(n/2) - 1/n).
TEST(Posterior, OfHalfACubeIsHalfOfItsPoints) {
  const auto half = [](std::span<const double> points) {
    std::vector<double> out;
    for (std::size_t i = 0; i < points.size(); i += 2) out.push_back(points[i] < 0.5 ? 5 : -INFINITY);
    return out;
  };
  SamplingOptions options;
  options.first = 1024, options.enough = 500;
  const Posterior found = sample_posterior(2, half, options);
  EXPECT_EQ(found.rounds, 1);
  EXPECT_EQ(found.size(), 1024U);
  EXPECT_NEAR(found.effective, 512, 1.5);
  EXPECT_NEAR(found.log_evidence, 5 + std::log(0.5), 3e-3);
  EXPECT_NEAR(found.log_evidence_error, 1.0 / 32, 1e-4);
  for (std::size_t i = 0; i < found.size(); ++i)
    EXPECT_NEAR(found.weight[i], found.point(i)[0] < 0.5 ? 1.0 / 512 : 0, 5e-6);
  // Nowhere above 0: no round helps.
  const Posterior none = sample_posterior(
      2, [](std::span<const double> points) { return std::vector<double>(points.size() / 2, -INFINITY); }, options);
  EXPECT_EQ(none.effective, 0);
  EXPECT_EQ(none.rounds, 1);
  EXPECT_EQ(none.weight, std::vector<double>(1024, 0.0));
  // As many further rounds as are allowed, and no more.
  options.enough = 1e9, options.most_rounds = 3, options.further = 200;
  const Posterior more = sample_posterior(2, half, options);
  EXPECT_EQ(more.rounds, 4);
  EXPECT_EQ(more.size(), 200U);
}

TEST(EvenPoints, FillTheCubeOfOneToFortyDimensions) {
  for (const std::size_t dimensions : {1U, 3U, 40U}) {
    const std::vector<double> points = even_points(dimensions, 256, 5);
    ASSERT_EQ(points.size(), 256 * dimensions);
    for (std::size_t k = 0; k < dimensions; ++k) {
      std::array<int, 4> quarter{};
      for (std::size_t i = 0; i < 256; ++i) {
        const double at = points[i * dimensions + k];
        ASSERT_TRUE(at >= 0 && at < 1);
        ++quarter[static_cast<std::size_t>(4 * at)];
      }
      for (const int count : quarter) EXPECT_NEAR(count, 64, 2) << k;
    }
    EXPECT_NE(even_points(dimensions, 1, 6), even_points(dimensions, 1, 5));
  }
  EXPECT_THROW(even_points(0, 4, 1), std::invalid_argument);
  EXPECT_THROW(even_points(41, 4, 1), std::invalid_argument);
}

// Each is drawn within one of its share, whatever the offset; a sum that rounding left below 1 lacks none.
TEST(EqualDraws, AreAsManyAsAskedFor) {
  const std::vector<double> weights{0.13, 0.4, 0, 0.27, 0.2};
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const std::vector<std::size_t> draws = equal_draws(weights, 10, seed);
    ASSERT_EQ(draws.size(), 10U);
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const auto drawn = static_cast<double>(std::count(draws.begin(), draws.end(), i));
      EXPECT_LT(std::abs(drawn - 10 * weights[i]), 1 - 1e-9) << i;
    }
    EXPECT_EQ(equal_draws({0.5, 0.2}, 10, seed).size(), 10U);
    EXPECT_EQ(equal_draws({0.5, 0.2}, 10, seed).back(), 1U);
  }
  EXPECT_TRUE(equal_draws({0, 0}, 4, 1).empty());
}

// Three numbers of twelve runs, each in units of its own scatter about its own mean; all correlations are less by what
// their estimates scatter by over what they are, a share of the sums of squares.
TEST(Correlation, IsShrunkByItsOwnUncertainty) {
  constexpr std::size_t runs = 12, count = 3;
  std::vector<double> rows;
  for (std::size_t r = 0; r < runs; ++r) {
    const double a = std::sin(1.7 * static_cast<double>(r)), b = std::cos(2.9 * static_cast<double>(r * r));
    rows.insert(rows.end(), {5 + a, 0.01 * (0.5 * a + b) - 3, 40 * (b - 0.4 * a) + 900});
  }
  std::vector<std::vector<double>> units(count);
  for (std::size_t i = 0; i < count; ++i) {
    double mean = 0, square = 0;
    for (std::size_t r = 0; r < runs; ++r) mean += rows[r * count + i] / runs;
    for (std::size_t r = 0; r < runs; ++r) square += std::pow(rows[r * count + i] - mean, 2) / runs;
    for (std::size_t r = 0; r < runs; ++r) units[i].push_back((rows[r * count + i] - mean) / std::sqrt(square));
  }
  double noise = 0, signal = 0;
  std::array<std::array<double, count>, count> plain{};
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < count; ++k) {
      double square = 0;
      for (std::size_t r = 0; r < runs; ++r) {
        plain[i][k] += units[i][r] * units[k][r] / runs;
        square += std::pow(units[i][r] * units[k][r], 2) / runs;
      }
      if (i != k) noise += (square - plain[i][k] * plain[i][k]) / runs, signal += plain[i][k] * plain[i][k];
    }
  const double kept = 1 - noise / signal;
  EXPECT_GT(kept, 0.2);
  EXPECT_LT(kept, 0.95);
  const std::vector<double> found = correlation_of(count, rows);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < count; ++k)
      EXPECT_NEAR(found[i * count + k], i == k ? 1 : kept * plain[i][k], 1e-9) << i << ' ' << k;
}

// 100 sets of parameters from the prior, each "measured" once and inferred from one set of 80 runs.
// Numbers whose neighbours have the correlation 0.6.
std::vector<double> correlated(std::size_t count, std::mt19937_64& generator) {
  std::normal_distribution<double> normal;
  std::vector<double> out{normal(generator)};
  while (out.size() < count) out.push_back(0.6 * out.back() + 0.8 * normal(generator));
  return out;
}

// chi2 of the mean 0, 1 and -1 of the numbers, by a covariance from samples.
std::array<double, 3> discrepancies(const std::vector<double>& measured,
                                    const std::vector<std::vector<double>>& samples) {
  const std::size_t count = measured.size();
  const auto n = static_cast<double>(samples.size());
  std::vector<double> mean(count, 0), covariance(count * count, 0), deviation(count), difference(count);
  for (const auto& sample : samples)
    for (std::size_t i = 0; i < count; ++i) mean[i] += sample[i] / n;
  for (const auto& sample : samples)
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < count; ++k)
        covariance[i * count + k] += (sample[i] - mean[i]) * (sample[k] - mean[k]) / (n - 1);
  for (std::size_t i = 0; i < count; ++i) deviation[i] = std::sqrt(covariance[i * count + i]);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < count; ++k) covariance[i * count + k] /= deviation[i] * deviation[k];
  const CorrelatedErrors errors(count, covariance);
  std::array<double, 3> chi2{};
  for (std::size_t which = 0; which < 3; ++which) {
    for (std::size_t i = 0; i < count; ++i) difference[i] = measured[i] - std::array{0, 1, -1}[which];
    chi2[which] = errors(difference, deviation, std::vector<double>(count, 0)).chi2;
  }
  return chi2;
}

// One parameter, the common mean of ten correlated numbers, measured once. Their covariance is known from 25 samples.
// 68 % intervals hold the truth in 68 % of 4000 cases (standard deviation 0.7 %). By a normal distribution with the
// same covariance they hold it in fewer than 60 %.
TEST(Posterior, IntervalsHoldWhereTheCovarianceIsFromFewSamples) {
  constexpr std::size_t numbers = 10, samples = 25, cases = 4000;
  std::mt19937_64 generator(31);
  double by_tails = 0, by_normal = 0;
  for (std::size_t one = 0; one < cases; ++one) {
    std::vector<std::vector<double>> table;
    while (table.size() < samples) table.push_back(correlated(numbers, generator));
    const auto [at_0, at_1, at_less] = discrepancies(correlated(numbers, generator), table);
    const double slope = (at_1 - at_less) / 2, curvature = (at_1 + at_less) / 2 - at_0;
    double below = 0, all = 0;
    for (double mean = -6.01; mean < 6; mean += 0.02) {
      const double chi2 = at_0 + slope * mean + curvature * mean * mean;
      const double weight = std::exp(log_likelihood({chi2, 0}, {samples, numbers, 1}));
      all += weight, below += mean < 0 ? weight : 0;
    }
    by_tails += std::abs(below / all - 0.5) < 0.34;
    by_normal += std::abs(normal_chance(slope / (2 * std::sqrt(curvature))) - 0.5) < 0.34;
  }
  EXPECT_NEAR(by_tails / cases, 0.68, 0.03);
  EXPECT_LT(by_normal / cases, 0.6);
}

TEST(Calibration, OfAStandInHoldsItsIntervals) {
  const Surrogate surrogates[] = {Surrogate::train(stand_in_runs(80, 0, 1)), Surrogate::train(stand_in_runs(80, 1, 1))};
  std::mt19937_64 generator(11);
  int within_68 = 0, within_95 = 0;
  std::vector<double> histogram(10, 0);
  constexpr int truths = 100;
  for (int i = 0; i < truths; ++i) {
    const std::vector<double> truth{even_number(generator), even_number(generator), even_number(generator)};
    std::vector<double> measured = stand_in(truth);
    for (std::size_t k = 0; k < 2; ++k) measured[k] += scatter_of[k] * normal_quantile(even_number(generator));
    SamplingOptions options;
    options.first = 2048, options.further = 2048, options.enough = 200;
    const Posterior found = sample_posterior(
        3,
        [&](std::span<const double> points) {
          std::vector<double> out(points.size() / 3, 0);
          for (std::size_t k = 0; k < 2; ++k) {
            const auto at = surrogates[k].predict(points);
            for (std::size_t p = 0; p < out.size(); ++p)
              out[p] -= 0.5 * (std::pow(measured[k] - at.mean[p], 2) / at.variance[p] + std::log(at.variance[p]));
          }
          return out;
        },
        options);
    for (std::size_t k = 0; k < 3; ++k) {
      double rank = 0;
      for (std::size_t p = 0; p < found.size(); ++p) rank += found.point(p)[k] < truth[k] ? found.weight[p] : 0;
      within_68 += rank > 0.16 && rank < 0.84;
      within_95 += rank > 0.025 && rank < 0.975;
      histogram[static_cast<std::size_t>(std::min(9, static_cast<int>(10 * rank)))] += 1;
    }
  }
  EXPECT_NEAR(within_68 / 300.0, 0.68, 0.09);
  EXPECT_NEAR(within_95 / 300.0, 0.95, 0.04);
  double chi2 = 0;
  for (const double count : histogram) chi2 += std::pow(count - 30, 2) / 30;
  EXPECT_GT(chance_of_chi2(chi2, 9), 0.01) << "one run in a hundred may fail";
}

}  // namespace
}  // namespace shakebed::fit
