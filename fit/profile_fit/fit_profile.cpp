#include "fit/profile_fit/fit_profile.hpp"

#include <gsl/gsl_cdf.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>

#include "fit/profile_fit/least_squares.hpp"
#include "fit/theory/expansion.hpp"

namespace shakebed::fit {

namespace {

// --- words -----------------------------------------------------------------------------------------------------------

std::string number(double value, int digits = 3) {
  char text[48];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

// --- the profile, checked and sorted ---------------------------------------------------------------------------------

struct Cleaned {
  std::vector<double> height, density, error;  // ascending heights; error > 0 where errors_known
  std::vector<bool> usable;                    // false: left out (an empty bin without an error)
  Eigen::MatrixXd covariance;                  // empty: diagonal
  bool errors_known = false;
  double spacing = 0.0;  // median distance of neighbouring heights
  double area = 0.0;
  std::vector<double> one_diameter_mean;  // density averaged over one diameter about each height
  double greatest_mean = 0.0;
  [[nodiscard]] std::size_t size() const { return height.size(); }
};

FitStatus bad_input(FitResult& result, std::string message) {
  result.message = std::move(message);
  return FitStatus::bad_input;
}

std::string at_bin(std::size_t i) { return " in bin " + std::to_string(i); }

double median_of(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

FitStatus check_numbers(const Profile& profile, FitResult& result) {
  const std::size_t n = profile.height.size();
  if (n == 0) return bad_input(result, "the profile is empty");
  if (profile.number_density.size() != n) {
    return bad_input(result, "the profile has " + std::to_string(n) + " heights but " +
                                 std::to_string(profile.number_density.size()) + " densities");
  }
  if (!profile.std_error.empty() && profile.std_error.size() != n) {
    return bad_input(result, "the profile has " + std::to_string(n) + " heights but " +
                                 std::to_string(profile.std_error.size()) + " standard errors");
  }
  if (!profile.covariance.empty() && profile.covariance.size() != n * n) {
    return bad_input(result, "the covariance has " + std::to_string(profile.covariance.size()) + " entries, " +
                                 std::to_string(n) + " bins need " + std::to_string(n * n));
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (!std::isfinite(profile.height[i])) return bad_input(result, "a height is not a finite number" + at_bin(i));
    if (!std::isfinite(profile.number_density[i])) {
      return bad_input(result, "a density is not a finite number" + at_bin(i));
    }
    if (!profile.std_error.empty()) {
      if (!std::isfinite(profile.std_error[i])) {
        return bad_input(result, "a standard error is not a finite number" + at_bin(i));
      }
      if (profile.std_error[i] < 0.0) return bad_input(result, "a standard error is negative" + at_bin(i));
    }
  }
  for (const double entry : profile.covariance) {
    if (!std::isfinite(entry)) return bad_input(result, "the covariance has an entry that is not a finite number");
  }
  std::vector<double> sigma;
  for (std::size_t i = 0; i < n && !profile.covariance.empty(); ++i) {
    const auto entry = [&](std::size_t a, std::size_t b) { return profile.covariance[a * n + b]; };
    if (entry(i, i) < 0.0) return bad_input(result, "the covariance says that a variance is negative" + at_bin(i));
    sigma.push_back(std::sqrt(entry(i, i)));
    const auto between = [i](std::size_t j) {
      return " between bins " + std::to_string(j) + " and " + std::to_string(i);
    };
    for (std::size_t j = 0; j < i; ++j) {
      const double limit = sigma[i] * sigma[j];
      if (std::abs(entry(i, j) - entry(j, i)) > 1e-6 * limit) {
        return bad_input(result, "the covariance is not symmetric" + between(j));
      }
      if (std::abs(entry(i, j)) > limit * (1.0 + 1e-6)) {
        return bad_input(result, "the covariance has a correlation beyond 1" + between(j));
      }
    }
  }
  return FitStatus::ok;
}

// Errors below this part of the greatest density are not errors of a measurement, but a stand-in for "none".
constexpr double least_relative_error = 1e-12;

void clean_errors(const Profile& profile, const std::vector<std::size_t>& order, Cleaned& cleaned, FitResult& result) {
  const std::size_t n = order.size();
  double greatest = 0.0;
  for (const double density : cleaned.density) greatest = std::max(greatest, std::abs(density));
  cleaned.error.assign(n, 0.0);
  cleaned.usable.assign(n, true);
  std::vector<double> good;
  for (std::size_t i = 0; i < n; ++i) {
    double error = 0.0;
    if (!profile.covariance.empty()) {
      error = std::sqrt(std::max(0.0, profile.covariance[order[i] * n + order[i]]));
    } else if (!profile.std_error.empty()) {
      error = profile.std_error[order[i]];
    }
    if (error > least_relative_error * greatest) {
      cleaned.error[i] = error;
      good.push_back(error);
    }
  }
  cleaned.errors_known = !good.empty();
  if (!cleaned.errors_known) {
    cleaned.error.assign(n, 1.0);
    if (!profile.std_error.empty() || !profile.covariance.empty()) {
      result.warnings.emplace_back(
          "all standard errors are zero, so every bin has the same weight and the errors come from the scatter");
    } else {
      result.warnings.emplace_back(
          "no standard errors were given, so every bin has the same weight and the errors come from the scatter");
    }
    return;
  }
  // An empty bin without an error says nothing; a filled one gets the median error.
  const double typical = median_of(good);
  std::size_t filled = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (cleaned.error[i] > 0.0) continue;
    cleaned.error[i] = typical;
    if (cleaned.density[i] == 0.0) {
      cleaned.usable[i] = false;
    } else {
      ++filled;
    }
  }
  if (filled > 0) {
    result.warnings.push_back(std::to_string(filled) +
                              " bins have a density but no standard error; they were given the "
                              "median error, " +
                              number(typical));
  }
}

void clean_covariance(const Profile& profile, const std::vector<std::size_t>& order, Cleaned& cleaned) {
  if (profile.covariance.empty() || !cleaned.errors_known) return;
  const std::size_t n = order.size();
  cleaned.covariance.resize(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const double entry =
          0.5 * (profile.covariance[order[i] * n + order[j]] + profile.covariance[order[j] * n + order[i]]);
      cleaned.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = entry;
    }
    cleaned.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)) =
        cleaned.error[i] * cleaned.error[i];
  }
}

FitStatus clean(const Profile& profile, Cleaned& cleaned, FitResult& result) {
  if (const FitStatus status = check_numbers(profile, result); status != FitStatus::ok) return status;
  const std::size_t n = profile.height.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (!std::is_sorted(profile.height.begin(), profile.height.end())) {
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return profile.height[a] < profile.height[b]; });
    result.warnings.emplace_back("the heights were not in ascending order; the bins were sorted");
  }
  for (const std::size_t i : order) {
    cleaned.height.push_back(profile.height[i]);
    cleaned.density.push_back(profile.number_density[i]);
  }
  std::vector<double> gaps;
  std::size_t repeated = 0;
  for (std::size_t i = 1; i < n; ++i) {
    const double gap = cleaned.height[i] - cleaned.height[i - 1];
    if (gap > 0.0) {
      gaps.push_back(gap);
    } else {
      ++repeated;
    }
  }
  if (repeated > 0) {
    result.warnings.push_back(std::to_string(repeated) +
                              " bins repeat the height of another; each counts as a measurement of its own");
  }
  cleaned.spacing = median_of(std::move(gaps));
  clean_errors(profile, order, cleaned, result);
  clean_covariance(profile, order, cleaned);

  // The area: each distinct height owns half the way to its neighbours, the ends as much outwards as inwards. Bins at
  // the same height share theirs.
  std::size_t negative = 0;
  for (std::size_t i = 0; i < n;) {
    std::size_t j = i;
    double sum = 0.0;
    while (j < n && cleaned.height[j] == cleaned.height[i]) {
      sum += cleaned.density[j];
      if (cleaned.density[j] < 0.0) ++negative;
      ++j;
    }
    const double below = i > 0 ? cleaned.height[i] - cleaned.height[i - 1] : 0.0;
    const double above = j < n ? cleaned.height[j] - cleaned.height[i] : 0.0;
    const double width = i == 0 ? above : (j == n ? below : 0.5 * (below + above));
    cleaned.area += sum / static_cast<double>(j - i) * width;
    i = j;
  }
  if (negative > 0) {
    result.warnings.push_back(std::to_string(negative) + " bins have a negative density; they were used as they are");
  }
  result.area = cleaned.area;

  cleaned.one_diameter_mean.resize(n);
  double sum = 0.0;
  std::size_t from = 0;
  std::size_t to = 0;
  for (std::size_t i = 0; i < n; ++i) {
    while (to < n && cleaned.height[to] <= cleaned.height[i] + 0.5) sum += cleaned.density[to++];
    while (cleaned.height[from] < cleaned.height[i] - 0.5) sum -= cleaned.density[from++];
    cleaned.one_diameter_mean[i] = sum / static_cast<double>(to - from);
  }
  return FitStatus::ok;
}

// --- the window ------------------------------------------------------------------------------------------------------

struct Window {
  double low = 0.0, high = 0.0;
  std::string rule;
};

std::size_t count_bins(const Cleaned& cleaned, const Window& window) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < cleaned.size(); ++i) {
    if (cleaned.usable[i] && cleaned.height[i] >= window.low && cleaned.height[i] <= window.high) ++count;
  }
  return count;
}

Window choose_window(Cleaned& cleaned, const FitOptions& options) {
  const WindowOptions& w = options.window;
  const std::size_t n = cleaned.size();
  Window window;
  const double excluded = options.base + w.floor_exclusion + std::min(kernel_reach(options.kernel), 3.0);
  // The greatest density above the floor's layers, or anywhere if nothing lies above them.
  std::size_t first = 0;
  while (first < n && cleaned.height[first] < excluded) ++first;
  if (first == n) first = 0;
  std::size_t peak = first;
  for (std::size_t i = first; i < n; ++i) {
    if (cleaned.one_diameter_mean[i] > cleaned.one_diameter_mean[peak]) peak = i;
  }
  cleaned.greatest_mean = cleaned.one_diameter_mean[peak];
  if (w.low) {
    window.low = *w.low;
    window.rule = "from the given height " + number(window.low, 4) + " D";
  } else if (w.below_density) {
    std::size_t start = n - 1;
    while (start > peak && cleaned.one_diameter_mean[start - 1] < *w.below_density) --start;
    window.low = cleaned.height[start];
    window.rule = "from " + number(window.low, 4) +
                  " D, above which the density averaged over one diameter stays below " + number(*w.below_density);
  } else {
    std::size_t start = first;
    while (start < peak && cleaned.one_diameter_mean[start] < w.plateau_fraction * cleaned.greatest_mean) ++start;
    window.low = cleaned.height[start];
    window.rule = "from " + number(window.low, 4) + " D, the lowest height above " + number(excluded, 4) +
                  " D (floor layers and kernel left out) where the density averaged over one diameter reaches " +
                  number(100.0 * w.plateau_fraction) + " % of its greatest value";
  }
  if (w.high) {
    window.high = *w.high;
    window.rule += ", up to the given height " + number(window.high, 4) + " D";
  } else {
    std::size_t last = peak;
    while (last + 1 < n) {
      const double mean = cleaned.one_diameter_mean[last + 1];
      const bool significant = !cleaned.errors_known || mean >= w.lowest_significance * cleaned.error[last + 1];
      if (mean < w.lowest_fraction * cleaned.greatest_mean || !significant) break;
      ++last;
    }
    window.high = cleaned.height[last];
    // A profile that ends in a cliff: the first empty bins say where.
    std::size_t beyond = last;
    while (beyond > 0 && cleaned.height[last] - cleaned.height[beyond] < 1.5) --beyond;
    if (last + 1 < n && cleaned.density[beyond] > 0.75 * cleaned.greatest_mean) {
      while (last + 1 < n && cleaned.height[last + 1] <= window.high + 1.0) cleaned.usable[++last] = true;
      if (last + 1 < n && cleaned.height[last] == window.high) cleaned.usable[++last] = true;
      window.high = cleaned.height[last];
    }
    window.rule += ", up to " + number(window.high, 4) + " D, the last before the density falls below " +
                   number(100.0 * w.lowest_fraction) + " % of its greatest value" +
                   (cleaned.errors_known ? " or " + number(w.lowest_significance) + " standard errors" : "");
  }
  return window;
}

// --- one fit on one window -------------------------------------------------------------------------------------------

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

Bins bins_of(const Cleaned& cleaned, const Window& window, int covariance_samples, FitResult* result) {
  Bins bins;
  std::vector<Eigen::Index> chosen;
  for (std::size_t i = 0; i < cleaned.size(); ++i) {
    if (!cleaned.usable[i] || cleaned.height[i] < window.low || cleaned.height[i] > window.high) continue;
    chosen.push_back(static_cast<Eigen::Index>(i));
    bins.height.push_back(cleaned.height[i]);
    bins.density.push_back(cleaned.density[i]);
    bins.inverse_error.push_back(1.0 / cleaned.error[i]);
  }
  if (cleaned.covariance.size() == 0 || chosen.empty()) return bins;
  const auto n = static_cast<Eigen::Index>(chosen.size());
  Eigen::MatrixXd covariance(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      covariance(i, j) = cleaned.covariance(chosen[static_cast<std::size_t>(i)], chosen[static_cast<std::size_t>(j)]);
    }
  }
  bins.samples = covariance_samples;
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  Eigen::MatrixXd correlation = sigma.cwiseInverse().asDiagonal() * covariance * sigma.cwiseInverse().asDiagonal();
  // The inverse of a covariance estimated from m samples is too large by (m - 1)/(m - n - 2) [Hartlap2007]. Where that
  // is 2 or more, weighing by it would add more noise than it takes away.
  if (covariance_samples > 0) {
    const double m = covariance_samples;
    const double correction = (m - static_cast<double>(n) - 2.0) / (m - 1.0);
    if (correction < 0.5) {
      if (result != nullptr) {
        result->warnings.push_back("the covariance comes from " + std::to_string(covariance_samples) +
                                   " independent samples, too few to weigh " + std::to_string(n) +
                                   " bins by it: the weights are diagonal, the errors come through the covariance");
      }
      // Weights of the bins' own errors would follow what is to be weighed: a bin that happens to hold few disks also
      // happens to have a small error, and a shape that so few samples happen to show little of would count for much
      // and, by the same samples, scatter little: with 8 samples the variance of T came out a quarter too small. So the
      // errors are averaged over half of the window.
      Eigen::VectorXd weight_error(n);
      const Eigen::Index reach = std::max<Eigen::Index>(1, n / 4);
      for (Eigen::Index i = 0; i < n; ++i) {
        const Eigen::Index first = std::max<Eigen::Index>(0, i - reach), last = std::min(n - 1, i + reach);
        weight_error[i] = std::exp(sigma.segment(first, last - first + 1).array().log().mean());
        bins.inverse_error[static_cast<std::size_t>(i)] = 1.0 / weight_error[i];
      }
      bins.correlation =
          weight_error.cwiseInverse().asDiagonal() * covariance * weight_error.cwiseInverse().asDiagonal();
      return bins;
    }
  }
  // A kernel wider than the bins makes neighbours nearly equal: some eigenvalues are then far below what the samples
  // can tell, and weighing by them would make errors of the model's last digits into thousands of standard errors. So
  // the correlations are first shrunk by what their samples' own noise asks, then, if need be, until they are positive.
  if (covariance_samples > 0) {
    correlation *= 1.0 - sampling_shrinkage(correlation, covariance_samples);
    correlation.diagonal().setOnes();
  }
  double shrink = 0.0;
  Eigen::LLT<Eigen::MatrixXd> cholesky(correlation);
  const auto safe = [&] {
    if (cholesky.info() != Eigen::Success) return false;
    const double smallest = cholesky.matrixLLT().diagonal().minCoeff();
    return smallest > 1e-6;
  };
  while (!safe() && shrink < 1.0) {
    shrink = shrink == 0.0 ? 0.02 : std::min(1.0, 1.5 * shrink);
    Eigen::MatrixXd shrunk = (1.0 - shrink) * correlation;
    shrunk.diagonal().setOnes();
    cholesky.compute(shrunk);
  }
  if (shrink > 0.0 && result != nullptr) {
    result->warnings.push_back("the covariance is not positive definite; its correlations were shrunk by " +
                               number(100.0 * shrink, 2) + " %");
  }
  bins.whitening = covariance.diagonal().cwiseSqrt().asDiagonal() * Eigen::MatrixXd(cholesky.matrixL());
  if (covariance_samples > 0) {  // shrunk correlations weigh; the errors come through those measured
    const auto lower = bins.whitening.triangularView<Eigen::Lower>();
    const Eigen::MatrixXd half = lower.solve(covariance).transpose();
    const Eigen::MatrixXd whitened = lower.solve(half);
    bins.correlation = 0.5 * (whitened + whitened.transpose());
  }
  return bins;
}

// What a fit needs beside its bins.
struct Setup {
  std::unique_ptr<FitModel> model;
  FitModel::Parameters start{};  // fixed values and first guesses
  LeastSquaresOptions least_squares;
  int parameters = 0;
};

double chi2_of(const Bins& bins, const FitModel& model, const KernelRule& rule) {
  return weighted_residuals(bins, model, rule).squaredNorm();
}

// Starts that need no guess: temperatures on a logarithmic grid, each with the place that puts the curve through the
// profile at half its greatest density; the best few by chi2 on a thinned profile without the kernel.
std::vector<FitModel::Parameters> find_starts(const Cleaned& cleaned, const Bins& bins, const Setup& setup) {
  FitModel& model = *setup.model;
  const bool free_t = setup.least_squares.free[FitModel::temperature];
  const bool free_place = setup.least_squares.free[FitModel::place];
  // Where the window's profile crosses half its greatest density (its end, if it never does).
  double greatest = 0.0;
  for (const double density : bins.density) greatest = std::max(greatest, density);
  std::vector<std::pair<double, double>> through;
  for (const double fraction : {0.5, 0.2}) {
    std::size_t i = bins.size() - 1;
    while (i > 0 && bins.density[i] < fraction * greatest) --i;
    through.emplace_back(bins.height[i], std::max(bins.density[i], 1e-6 * greatest));
  }
  // Thinned, diagonal weights.
  Bins thin;
  const std::size_t stride = std::max<std::size_t>(1, bins.size() / 40);
  for (std::size_t i = 0; i < bins.size(); i += stride) {
    thin.height.push_back(bins.height[i]);
    thin.density.push_back(bins.density[i]);
    thin.inverse_error.push_back(bins.inverse_error[i]);
  }
  const double range = std::max(bins.height.back() - bins.height.front(), 1e-6);
  const double lowest = std::max(setup.least_squares.lowest_temperature, 1e-3 * cleaned.spacing / 100.0);
  const double highest = std::max(30.0 * range, 10.0 * lowest);
  const int temperatures = free_t ? 36 : 1;
  const KernelRule points{Kernel{}};
  std::vector<std::pair<double, FitModel::Parameters>> candidates;
  for (int i = 0; i < temperatures; ++i) {
    FitModel::Parameters p = setup.start;
    if (free_t) p[0] = lowest * std::pow(highest / lowest, static_cast<double>(i) / (temperatures - 1));
    const std::size_t places = free_place ? through.size() : 1;
    for (std::size_t place = 0; place < places; ++place) {
      if (free_place) p[1] = model.place_through(p, through[place].first, through[place].second);
      if (!model.set(p)) continue;
      const double chi2 = chi2_of(thin, model, points);
      if (std::isfinite(chi2)) candidates.emplace_back(chi2, p);
    }
  }
  std::sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<FitModel::Parameters> starts;
  for (const auto& candidate : candidates) {
    const FitModel::Parameters& p = candidate.second;
    // Distinct in temperature by more than a grid step.
    const bool known = std::any_of(starts.begin(), starts.end(), [&](const FitModel::Parameters& q) {
      return std::abs(std::log(q[0] / p[0])) < 1.0 || !free_t;
    });
    if (!known) starts.push_back(p);
    if (starts.size() == 3) break;
  }
  return starts;
}

Solution fit_from(const Bins& bins, Setup& setup, const std::vector<FitModel::Parameters>& starts) {
  Solution best;
  int evaluations = 0;
  for (const FitModel::Parameters& start : starts) {
    Solution solution = least_squares(bins, *setup.model, start, setup.least_squares);
    evaluations += solution.evaluations;
    const bool better =
        solution.has_curve && (!best.has_curve || (solution.converged && !best.converged) ||
                               (solution.converged == best.converged && solution.objective < best.objective));
    if (better) best = std::move(solution);
    // A good fit needs no second opinion; a poor one may be a side valley.
    const double dof = std::max(1.0, static_cast<double>(bins.size()) - setup.parameters);
    const bool good = setup.least_squares.errors_known && best.objective < 3.0 * dof;
    if (best.converged && !best.temperature_at_bound && good) break;
  }
  if (best.has_curve) setup.model->set(best.parameters);
  best.evaluations = evaluations;
  return best;
}

FitStatus make_setup(const FitOptions& options, const Cleaned& cleaned, Setup& setup, FitResult& result) {
  const bool constrained = options.constrain_column && options.column_number.has_value();
  if (options.constrain_column && !options.column_number) {
    return bad_input(result, "constrain_column needs the column number N D/W");
  }
  const double resolution = cleaned.spacing > 0.0 ? cleaned.spacing : 1.0;
  setup.model = make_fit_model(options.model, options.base, constrained, resolution);
  if (!setup.model) return bad_input(result, "there is no model named '" + options.model + "'");
  FitModel& model = *setup.model;
  const auto positive = [](double value) { return std::isfinite(value) && value > 0.0; };
  if (!positive(options.plateau_density)) return bad_input(result, "the plateau density must be positive");
  if (options.column_number && !positive(*options.column_number)) {
    return bad_input(result, "the column number N D/W must be positive");
  }
  if (options.fixed_temperature && !positive(*options.fixed_temperature)) {
    return bad_input(result, "the fixed temperature must be positive");
  }
  if (options.fixed_shift && !std::isfinite(*options.fixed_shift)) {
    return bad_input(result, "the fixed shift is not a finite number");
  }
  if (options.fixed_shift && model.place_is_column()) {
    return bad_input(result, "a whole column has no shift of its own to fix: fix N D/W instead");
  }
  if (!kernel_is_valid(options.kernel)) return bad_input(result, "the kernel's width must be finite and not negative");
  if (!std::isfinite(options.base)) return bad_input(result, "the base is not a finite number");
  if (!(options.confidence > 0.0 && options.confidence < 1.0)) {
    return bad_input(result, "the confidence must lie between 0 and 1");
  }
  const bool whole_hydrostatic = options.model.starts_with("hydrostatic:");
  if (options.plateau_density > close_packing_density * (1.0 + 1e-12)) {
    result.message = "the plateau density " + number(options.plateau_density, 5) +
                     " is above close packing, 2/sqrt 3 = 1.1547: there are no such disks";
    return FitStatus::undefined_model;
  }
  if (!whole_hydrostatic && options.plateau_density > model.largest_plateau() * (1.0 + 1e-12)) {
    result.message = "the equation of state has no value at the plateau density " + number(options.plateau_density, 5);
    return FitStatus::undefined_model;
  }
  LeastSquaresOptions& ls = setup.least_squares;
  ls.free = {model.uses_temperature() && !options.fixed_temperature, true, options.plateau_density_free};
  if (model.place_is_column()) {
    ls.free[FitModel::place] = !options.column_number.has_value();
    // Only a column with a rectangle knows its density.
    if (whole_hydrostatic && model.equation().has_pole()) ls.free[FitModel::plateau] = false;
  } else if (options.fixed_shift) {
    ls.free[FitModel::place] = false;
  }
  ls.kernel = KernelRule(options.kernel);
  ls.robust = options.robust;
  ls.robust_threshold = options.robust_threshold;
  ls.errors_known = cleaned.errors_known;
  ls.max_iterations = options.max_iterations;
  // A tail of 100 T much shorter than a bin is a step.
  ls.lowest_temperature = 1e-5 * resolution;
  setup.start = {options.fixed_temperature.value_or(1.0), 0.0,
                 std::min(options.plateau_density, close_packing_density)};
  if (model.place_is_column() && options.column_number) setup.start[1] = *options.column_number;
  if (options.fixed_shift) setup.start[1] = *options.fixed_shift;
  if (options.model == "rectangle") setup.start[0] = 1.0;
  setup.parameters = static_cast<int>(std::count(ls.free.begin(), ls.free.end(), true));
  return FitStatus::ok;
}

// The error of a quantity computed from the curve, by differences along each free parameter.
template <class Quantity>
double propagated_error(Setup& setup, const Solution& solution, double scale, Quantity&& quantity) {
  std::vector<double> gradient;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!setup.least_squares.free[i]) continue;
    const auto index = static_cast<Eigen::Index>(gradient.size());
    const double sigma = std::sqrt(std::max(0.0, solution.covariance(index, index)));
    double step = 1e-3 * sigma;
    const double size = std::max(std::abs(solution.parameters[i]), 1e-12);
    step = std::clamp(step, 1e-9 * size, 1e-3 * size);
    const auto at = [&](double offset) {
      FitModel::Parameters p = solution.parameters;
      p[i] += offset;
      if (i == 2) p[i] = std::min(p[i], setup.model->largest_plateau());
      return setup.model->set(p) ? quantity(p) : quantity(solution.parameters);
    };
    gradient.push_back((at(step) - at(-step)) / (2.0 * step));
  }
  setup.model->set(solution.parameters);
  double variance = 0.0;
  for (std::size_t i = 0; i < gradient.size(); ++i) {
    for (std::size_t j = 0; j < gradient.size(); ++j) {
      variance +=
          gradient[i] * gradient[j] * solution.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  return scale * std::sqrt(std::max(0.0, variance));
}

double parameter_error(const Setup& setup, const Solution& solution, std::size_t parameter, double scale) {
  if (!setup.least_squares.free[parameter]) return 0.0;
  Eigen::Index index = 0;
  for (std::size_t i = 0; i < parameter; ++i) index += setup.least_squares.free[i] ? 1 : 0;
  return scale * std::sqrt(std::max(0.0, solution.covariance(index, index)));
}

// chi2 counts the bins' errors as known; without them they are the scatter itself.
struct Goodness {
  double chi2_per_dof = 0.0, p_value = 1.0, aic = 0.0, bic = 0.0, error_scale = 1.0;
  int dof = 0;
  bool scaled = false;
};

Goodness goodness(const Solution& solution, const Bins& bins, int parameters, bool errors_known, bool robust) {
  Goodness g;
  g.dof = static_cast<int>(bins.size()) - parameters;
  auto n = static_cast<double>(bins.size());
  double chi2 = solution.chi2;
  double dof = g.dof;
  if (bins.correlation.size() > 0 && g.dof > 0) {
    // As a chi-squared number of as many degrees of freedom as its mean and variance tell.
    dof = 2.0 * solution.expected_chi2 * solution.expected_chi2 / solution.chi2_variance;
    chi2 *= dof / solution.expected_chi2;
    n = dof + parameters;
  }
  g.chi2_per_dof = g.dof > 0 ? chi2 / dof : 0.0;
  const double k = parameters;
  if (errors_known) {
    // With errors that come from few samples chi2/dof is a variance over another, itself a mean over dof of them:
    // Snedecor's F.
    const bool few = bins.correlation.size() > 0 && bins.samples > 1;
    g.p_value = g.dof <= 0 ? 1.0
                : few      ? gsl_cdf_fdist_Q(chi2 / dof, dof, dof * (bins.samples - 1.0))
                           : gsl_cdf_chisq_Q(chi2, dof);
    g.aic = chi2 + 2.0 * k;
    g.bic = chi2 + k * std::log(n);
  } else {  // the variance is one more parameter
    const double log_variance = n * std::log(std::max(chi2 / n, 1e-300));
    g.aic = log_variance + 2.0 * (k + 1.0);
    g.bic = log_variance + (k + 1.0) * std::log(n);
  }
  g.scaled = !robust && g.dof > 0 && (!errors_known || g.p_value < 1e-3);
  if (g.scaled) g.error_scale = std::sqrt(g.chi2_per_dof);
  if (bins.whitening.size() > 0 && bins.samples > 0) {
    // Weights that are themselves uncertain: the estimate scatters more than its covariance says [Percival2014].
    const double m = bins.samples;
    const double a = 2.0 / ((m - n - 1.0) * (m - n - 4.0));
    const double b = (m - n - 2.0) / ((m - n - 1.0) * (m - n - 4.0));
    if (m > n + 4.0) g.error_scale *= std::sqrt((1.0 + b * (n - k)) / (1.0 + a + b * (k + 1.0)));
  }
  if (robust && !errors_known) g.scaled = true;
  return g;
}

// A solution with what it says of the data and of its own errors.
struct Fitted {
  Solution solution;
  Bins bins;                 // with the errors it was found with
  Goodness good;             // by the measured errors
  double error_scale = 1.0;  // of the solution's covariance
  double model_error = 0.0;
};

// Fits the window; where the model misses the data, finds the error of the model that makes up for it.
Fitted fit_window(const Cleaned& cleaned, const Window& window, int covariance_samples, const FitOptions& options,
                  Setup& setup, Bins bins, const std::vector<FitModel::Parameters>& starts) {
  Fitted fitted;
  fitted.solution = fit_from(bins, setup, starts);
  fitted.good = goodness(fitted.solution, bins, setup.parameters, cleaned.errors_known, options.robust);
  fitted.error_scale = fitted.good.error_scale;
  fitted.bins = std::move(bins);
  const bool misses = fitted.good.scaled && cleaned.errors_known && fitted.solution.has_curve;
  if (!options.model_error || options.robust || !misses || setup.parameters == 0) return fitted;

  const auto with_error = [&](double error) {
    Cleaned wider = cleaned;
    for (double& sigma : wider.error) sigma = std::hypot(sigma, error);
    if (wider.covariance.size() > 0) wider.covariance.diagonal().array() += error * error;
    Fitted trial;
    trial.bins = bins_of(wider, window, covariance_samples, nullptr);
    std::vector<FitModel::Parameters> from{fitted.solution.parameters};
    from.insert(from.end(), starts.begin(), starts.end());
    trial.solution = fit_from(trial.bins, setup, from);
    trial.good = goodness(trial.solution, trial.bins, setup.parameters, true, false);
    trial.model_error = error;
    return trial;
  };
  // chi2/dof falls as the error grows: a bracket in ln(error), then the false position with halved ends.
  double square = 0.0;
  for (std::size_t i = 0; i < fitted.bins.size(); ++i) {
    setup.model->set(fitted.solution.parameters);
    square +=
        std::pow(setup.model->smoothed(fitted.bins.height[i], setup.least_squares.kernel) - fitted.bins.density[i], 2) /
        static_cast<double>(fitted.bins.size());
  }
  if (!(square > 0.0)) return fitted;
  double high = 0.5 * std::log(square);
  double low = high;
  const auto misfit = [&](double log_error, Fitted& trial) {
    trial = with_error(std::exp(log_error));
    return trial.solution.has_curve ? std::log(std::max(trial.good.chi2_per_dof, 1e-300)) : -1e3;
  };
  Fitted trial;
  double at_high = misfit(high, trial);
  double at_low = at_high;
  for (int i = 0; i < 40 && at_high > 0.0; ++i) low = high, at_low = at_high, at_high = misfit(high += 1.0, trial);
  for (int i = 0; i < 40 && at_low < 0.0; ++i) high = low, at_high = at_low, at_low = misfit(low -= 1.0, trial);
  if (at_high > 0.0 || at_low < 0.0) return fitted;
  for (int i = 0; i < 60 && high - low > 1e-9; ++i) {
    const double middle = at_low > at_high ? low + (high - low) * at_low / (at_low - at_high) : 0.5 * (low + high);
    const double value = misfit(i % 4 == 3 ? 0.5 * (low + high) : middle, trial);
    const double place = std::log(trial.model_error);
    if (value > 0.0) {
      low = place, at_low = value, at_high *= 0.5;
    } else {
      high = place, at_high = value, at_low *= 0.5;
    }
    if (std::abs(value) < 1e-4) break;
  }
  if (!trial.solution.has_curve || !trial.solution.converged) {
    setup.model->set(fitted.solution.parameters);
    return fitted;
  }
  trial.solution.chi2 = fitted.solution.chi2;
  trial.error_scale = trial.good.error_scale;
  trial.good = fitted.good;
  setup.model->set(trial.solution.parameters);
  return trial;
}

// --- beyond the fit
// ----------------------------------------------------------------------------------------------------

// Ends of the temperatures whose best chi2 exceeds the least by the quantile of chi2 with one degree of freedom.
Interval likelihood_interval(const Fitted& fitted, Setup& setup, double confidence) {
  const Bins& bins = fitted.bins;
  const Solution& solution = fitted.solution;
  const Goodness& good = fitted.good;
  Interval interval;
  interval.confidence = confidence;
  if (!setup.least_squares.free[0]) return interval;
  // Errors that come from few samples, or from the scatter, have Student's tails.
  const double samples_dof = bins.correlation.size() > 0 && bins.samples > 1 ? bins.samples - 1.0 : 1e300;
  const double scatter_dof = good.scaled && good.dof > 0 ? static_cast<double>(good.dof) : 1e300;
  const double tail_dof = std::min(samples_dof, scatter_dof);
  const double quantile = tail_dof < 1e300 ? std::pow(gsl_cdf_tdist_Pinv(0.5 + 0.5 * confidence, tail_dof), 2)
                                           : gsl_cdf_chisq_Pinv(confidence, 1.0);
  const double unit = fitted.error_scale * fitted.error_scale * solution.inflation;
  LeastSquaresOptions fixed = setup.least_squares;
  fixed.free[0] = false;
  const double sigma =
      std::sqrt(std::max(0.0, solution.covariance(0, 0))) * fitted.error_scale / solution.parameters[0];
  const double limit_low = setup.least_squares.lowest_temperature;
  // sqrt(delta chi2) is nearly linear in ln T: a secant search on it.
  const auto search = [&](int side, double& end, bool& open) {
    FitModel::Parameters p = solution.parameters;
    const double target = std::sqrt(quantile);
    double x0 = 0.0;
    double y0 = 0.0;
    double x1 = std::min(target * std::max(sigma, 1e-9), 2.0);
    double outer = std::numeric_limits<double>::infinity();
    for (int iteration = 0; iteration < 40; ++iteration) {
      p = solution.parameters;
      p[0] = solution.parameters[0] * std::exp(side * x1);
      if (p[0] < limit_low) {
        open = true;
        end = 0.0;
        return true;
      }
      if (x1 > 12.0) {
        open = true;
        end = p[0];
        return true;
      }
      if (setup.least_squares.free[1] && !setup.model->place_is_column()) {
        // follow the valley: keep the curve where the solution has half its plateau
        setup.model->set(solution.parameters);
        const double half = 0.5 * solution.parameters[2];
        const double height =
            solution.parameters[1] +
            (solution.parameters[1] - setup.model->place_through(solution.parameters, solution.parameters[1], half));
        p[1] = setup.model->place_through(p, height, half);
      }
      const Solution profile = least_squares(bins, *setup.model, p, fixed);
      if (!profile.has_curve) {
        open = true;
        end = p[0];
        return true;
      }
      const double y1 = std::sqrt(std::max(0.0, profile.objective - solution.objective) / unit);
      if (std::abs(y1 - target) < 1e-4 * target) {
        end = p[0];
        return true;
      }
      double next = y1 > y0 ? x1 + (target - y1) * (x1 - x0) / (y1 - y0) : 2.0 * x1;
      if (y1 > target) {
        outer = std::min(outer, x1);
      } else {
        x0 = x1;
        y0 = y1;
      }
      next = std::clamp(next, 0.2 * x1, 3.0 * x1 + 1e-12);
      if (next >= outer) next = 0.5 * (x0 + outer);
      if (next <= x0) next = std::isfinite(outer) ? 0.5 * (x0 + outer) : 2.0 * x0;
      if (std::isfinite(outer) && outer - x0 < 1e-10 * (1.0 + outer)) {
        end = solution.parameters[0] * std::exp(side * x0);
        return true;
      }
      x1 = next;
    }
    return false;
  };
  const bool low = search(-1, interval.low, interval.low_open);
  const bool high = search(+1, interval.high, interval.high_open);
  if (low && high) interval.status = FitStatus::ok;
  setup.model->set(solution.parameters);
  return interval;
}

void sweep_windows(const Cleaned& cleaned, const Window& window, const Profile& profile, const FitOptions& options,
                   Setup& setup, const Solution& solution, FitResult& result) {
  std::vector<Window> windows;
  // Lower ends from the window's own up to where a quarter of the greatest density is left; upper ends down to a fifth.
  double surface = window.high;
  for (std::size_t i = 0; i < cleaned.size(); ++i) {
    if (cleaned.height[i] >= window.low && cleaned.height[i] <= window.high &&
        cleaned.one_diameter_mean[i] >= 0.25 * cleaned.greatest_mean) {
      surface = cleaned.height[i];
    }
  }
  constexpr int steps = 10;
  for (int i = 0; i <= steps; ++i)
    windows.push_back({window.low + (surface - window.low) * i / steps, window.high, {}});
  for (const double fraction : {0.02, 0.05, 0.1, 0.2}) {
    double high = window.low;
    for (std::size_t i = 0; i < cleaned.size(); ++i) {
      if (cleaned.height[i] >= window.low && cleaned.height[i] <= window.high &&
          cleaned.one_diameter_mean[i] >= fraction * cleaned.greatest_mean) {
        high = cleaned.height[i];
      }
    }
    if (high < window.high) windows.push_back({window.low, high, {}});
  }
  for (const Window& other : windows) {
    const Bins bins = bins_of(cleaned, other, profile.covariance_samples, nullptr);
    WindowFit row;
    row.bins = static_cast<int>(bins.size());
    row.low = other.low;
    row.high = other.high;
    if (!bins.height.empty()) {
      row.low = bins.height.front();
      row.high = bins.height.back();
    }
    if (!result.window_sweep.empty() && row.low == result.window_sweep.back().low &&
        row.high == result.window_sweep.back().high) {
      continue;
    }
    row.temperature.fixed = !setup.least_squares.free[0];
    row.shift.fixed = !setup.least_squares.free[1];
    if (row.bins < setup.parameters + 2) {
      row.status = FitStatus::too_few_bins;
      result.window_sweep.push_back(row);
      continue;
    }
    std::vector<FitModel::Parameters> starts{solution.parameters};
    const Fitted fitted = fit_window(cleaned, other, profile.covariance_samples, options, setup, bins, starts);
    const Solution& fit = fitted.solution;
    if (fit.has_curve) {
      row.status = fit.converged ? FitStatus::ok : FitStatus::not_converged;
      row.temperature.value = fit.parameters[0];
      row.temperature.std_error = parameter_error(setup, fit, 0, fitted.error_scale);
      if (row.temperature.std_error > 0.5 * fit.parameters[0] || fit.temperature_at_bound || fit.undetermined) {
        row.status = FitStatus::unresolved_temperature;
      }
      row.shift.value = setup.model->shift();
      row.shift.std_error = propagated_error(setup, fit, fitted.error_scale,
                                             [&](const FitModel::Parameters&) { return setup.model->shift(); });
      row.chi2_per_dof = fitted.good.chi2_per_dof;
    }
    result.window_sweep.push_back(row);
  }
  setup.model->set(solution.parameters);
}

ModelFit model_row(const FitOptions& options, Setup& setup, const Fitted& fitted) {
  const Solution& solution = fitted.solution;
  ModelFit row;
  row.model = options.model;
  row.plateau_density_free = setup.least_squares.free[2];
  row.parameters = setup.parameters;
  if (!solution.has_curve) {
    row.status = FitStatus::undefined_model;
    return row;
  }
  row.status = solution.converged ? FitStatus::ok : FitStatus::not_converged;
  row.temperature = {setup.model->uses_temperature() ? solution.parameters[0] : 0.0,
                     parameter_error(setup, solution, 0, fitted.error_scale), !setup.least_squares.free[0]};
  if (setup.least_squares.free[0] && (solution.temperature_at_bound || solution.undetermined ||
                                      row.temperature.std_error > 0.5 * row.temperature.value)) {
    row.status = FitStatus::unresolved_temperature;
  }
  row.shift = {setup.model->shift(),
               propagated_error(setup, solution, fitted.error_scale,
                                [&](const FitModel::Parameters&) { return setup.model->shift(); }),
               !setup.least_squares.free[1]};
  row.plateau_density = {solution.parameters[2], parameter_error(setup, solution, 2, fitted.error_scale),
                         !setup.least_squares.free[2]};
  row.chi2 = solution.chi2;
  row.chi2_per_dof = fitted.good.chi2_per_dof;
  row.aic = fitted.good.aic;
  row.bic = fitted.good.bic;
  return row;
}

void compare_models(const Cleaned& cleaned, const Window& window, const Profile& profile, const Bins& bins,
                    const FitOptions& options, FitResult& result) {
  std::vector<FitOptions> others;
  const auto add = [&](const char* model, bool plateau_free, bool constrained) {
    FitOptions other = options;
    other.model = model;
    other.plateau_density_free = plateau_free;
    other.constrain_column = constrained;
    if (std::string_view(model) != "enskog-rectangle") other.fixed_shift.reset();
    if (std::string_view(model) == "fermi" || std::string_view(model) == "rectangle") other.fixed_temperature.reset();
    const bool same = other.model == options.model && other.plateau_density_free == options.plateau_density_free &&
                      other.constrain_column == options.constrain_column;
    if (!same) others.push_back(std::move(other));
  };
  add("enskog-rectangle", false, false);
  add("enskog-rectangle", true, false);
  add("hydrostatic:enskog", false, false);
  add("hydrostatic:best-of", false, false);
  add("fermi", false, false);
  add("fermi", true, false);
  add("rectangle", true, false);
  for (const FitOptions& other : others) {
    FitResult scratch;
    Setup setup;
    ModelFit row;
    row.model = other.model;
    row.plateau_density_free = other.plateau_density_free;
    row.status = make_setup(other, cleaned, setup, scratch);
    if (row.status == FitStatus::ok) {
      if (static_cast<int>(bins.size()) < setup.parameters + 1) {
        row.status = FitStatus::too_few_bins;
      } else {
        row = model_row(other, setup,
                        fit_window(cleaned, window, profile.covariance_samples, other, setup, bins,
                                   find_starts(cleaned, bins, setup)));
      }
    }
    result.model_comparison.push_back(std::move(row));
  }
}

// Whether one number describes every bin of the window within its errors.
bool is_flat(const Bins& bins, bool errors_known) {
  double weight = 0.0;
  double sum = 0.0;
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    const double w = bins.inverse_error[i] * bins.inverse_error[i];
    weight += w;
    sum += w * bins.density[i];
    least = std::min(least, bins.density[i]);
    most = std::max(most, bins.density[i]);
  }
  if (most - least <= 1e-9 * std::abs(most)) return true;
  if (!errors_known || bins.size() < 2) return false;
  const double mean = sum / weight;
  double chi2 = 0.0;
  for (std::size_t i = 0; i < bins.size(); ++i) chi2 += std::pow((bins.density[i] - mean) * bins.inverse_error[i], 2);
  return gsl_cdf_chisq_Q(chi2, static_cast<double>(bins.size() - 1)) > 0.01 && mean > 0.5 * most;
}

void warn_about_units(const Cleaned& cleaned, const FitOptions& options, FitResult& result) {
  const double range = cleaned.height.back() - cleaned.height.front();
  if (range > 0.0 && range < 1.0 && cleaned.size() >= 5) {
    result.warnings.push_back("the heights span only " + number(range) +
                              " D: are they in metres? They should be in disk diameters");
  }
  if (cleaned.greatest_mean > 1.02 * close_packing_density) {
    result.warnings.push_back("the density averaged over one diameter reaches " + number(cleaned.greatest_mean, 4) +
                              ", above close packing (1.155): is it n D^2, with the right D?");
  }
  if (!options.column_number) return;
  const double given = *options.column_number;
  const double ratio = cleaned.area / given;
  if (std::abs(ratio - 1.0) > 0.1) {
    std::string text = "the area under the profile is " + number(cleaned.area, 4) + ", but N D/W is " +
                       number(given, 4) + " (ratio " + number(ratio) + ")";
    if (ratio > 1.5 || (ratio > 0.0 && ratio < 1.0 / 1.5)) {
      text += ": the heights look to be in the wrong unit, or part of the bed is missing; heights divided by " +
              number(ratio, 4) + " would agree";
    }
    result.warnings.push_back(std::move(text));
  }
}

void warn_about_fit(const Cleaned& cleaned, const FitOptions& options, const Setup& setup, FitResult& result) {
  if (setup.model->uses_temperature() && result.status == FitStatus::ok && result.solid_height.value <= 0.0) {
    result.warnings.emplace_back(
        "no solid: the fitted curve does not reach the plateau density above the floor (T > T_c)");
  }
  if (cleaned.errors_known && result.dof > 0 && result.p_value < 1e-3) {
    result.warnings.push_back(
        "the model does not describe the data: chi2/dof = " + number(result.chi2_per_dof) + " (chance " +
        number(result.p_value, 2) + ")" +
        (result.model_error > 0.0
             ? "; what it misses counts as an error of " + number(result.model_error) + " of every density"
         : result.errors_scaled ? "; the errors were multiplied by " + number(std::sqrt(result.chi2_per_dof))
                                : ""));
  }
  // A single bin far off.
  double worst = 0.0;
  double worst_height = 0.0;
  double rest = 0.0;
  for (const Residual& r : result.residuals) {
    if (!r.used || !(r.std_error > 0.0)) continue;
    const double size = std::abs(r.density - r.model) / r.std_error;
    rest += size * size;
    if (size > worst) {
      worst = size;
      worst_height = r.height;
    }
  }
  if (cleaned.errors_known && result.dof > 1 && worst > 8.0 && worst * worst > 0.5 * rest) {
    result.warnings.push_back("one bin, at " + number(worst_height, 4) + " D, is " + number(worst, 2) +
                              " standard errors off and makes most of chi2" +
                              (options.robust ? "" : ": an outlier? The robust option bounds its influence"));
  }
  if (result.temperature.value > 0.0 && !result.temperature.fixed) {
    double low = result.temperature.value;
    double high = low;
    double furthest = 0.0;
    for (const WindowFit& row : result.window_sweep) {
      if (row.status != FitStatus::ok) continue;
      const double off = std::abs(row.temperature.value - result.temperature.value);
      const double sigma = std::hypot(row.temperature.std_error, result.temperature.std_error);
      if (off > 3.0 * sigma && off > 0.1 * result.temperature.value) furthest = std::max(furthest, off);
      low = std::min(low, row.temperature.value);
      high = std::max(high, row.temperature.value);
    }
    if (furthest > 0.0) {
      result.warnings.push_back("the temperature changes with the window, from " + number(low) + " to " + number(high) +
                                " m g D: the profile has no single temperature in this model");
    }
  }
  if (options.column_number && result.critical_status == ValueStatus::ok && result.status == FitStatus::ok) {
    const double off = std::abs(result.solid_height_by_sum_rule - result.solid_height.value);
    if (result.solid_height.value > 0.0 &&
        off > std::max(0.1 * result.solid_height.value, 4.0 * result.solid_height.std_error)) {
      result.warnings.push_back("the fitted solid is " + number(result.solid_height.value) +
                                " D high, the sum rule with this T asks " +
                                number(std::max(0.0, result.solid_height_by_sum_rule)) + " D");
    }
  }
  if (setup.least_squares.free[2] && result.plateau_density.std_error > 0.1 * result.plateau_density.value) {
    result.warnings.emplace_back("the plateau density is not determined: no part of the window lies on the plateau");
  }
  if (setup.least_squares.free[2] && result.plateau_density.value >= setup.model->largest_plateau()) {
    result.warnings.emplace_back("the plateau density ran to close packing, the end of its range");
  }
}

void fill_curve(const Cleaned& cleaned, const FitOptions& options, const FitModel& model, FitResult& result) {
  if (options.curve_points < 2) return;
  const KernelRule rule(options.kernel);
  const double low = std::min(cleaned.height.front(), options.base);
  const double high = cleaned.height.back();
  for (int i = 0; i < options.curve_points; ++i) {
    const double height = low + (high - low) * i / (options.curve_points - 1);
    result.curve.push_back({height, model.density(height), model.smoothed(height, rule)});
  }
}

}  // namespace

std::string_view to_string(FitStatus status) {
  switch (status) {
    case FitStatus::ok:
      return "ok";
    case FitStatus::not_converged:
      return "not converged";
    case FitStatus::bad_input:
      return "bad input";
    case FitStatus::too_few_bins:
      return "too few bins";
    case FitStatus::no_signal:
      return "no signal";
    case FitStatus::no_tail:
      return "no tail";
    case FitStatus::unresolved_temperature:
      return "unresolved temperature";
    case FitStatus::undefined_model:
      return "undefined model";
  }
  return "unknown";
}

FitResult fit_profile(const Profile& profile, const FitOptions& options) {
  FitResult result;
  result.model = options.model;
  result.kernel = options.kernel;
  result.plateau_density = {options.plateau_density, 0.0, !options.plateau_density_free};

  Cleaned cleaned;
  result.status = clean(profile, cleaned, result);
  if (result.status != FitStatus::ok) return result;
  Setup setup;
  result.status = make_setup(options, cleaned, setup, result);
  if (result.status != FitStatus::ok) return result;
  for (std::size_t i = 0; i < cleaned.size(); ++i) {
    result.residuals.push_back(
        {cleaned.height[i], cleaned.density[i], cleaned.errors_known ? cleaned.error[i] : 0.0, 0.0, false});
  }
  if (*std::max_element(cleaned.density.begin(), cleaned.density.end()) <= 0.0) {
    result.status = FitStatus::no_signal;
    result.message = "no bin has a positive density";
    return result;
  }

  Window window = choose_window(cleaned, options);
  const auto needed = static_cast<std::size_t>(setup.parameters) + 1;
  if (count_bins(cleaned, window) < needed && !options.window.low && !options.window.high) {
    const Window all{std::max(options.base, cleaned.height.front()), cleaned.height.back(), {}};
    if (count_bins(cleaned, all) >= needed) {
      result.warnings.push_back("the window rule leaves only " + std::to_string(count_bins(cleaned, window)) +
                                " bins; all bins above the base were used");
      window = all;
      window.rule = "all bins above the base: the rule leaves too few";
    }
  }
  result.window_rule = window.rule;
  warn_about_units(cleaned, options, result);
  const Bins bins = bins_of(cleaned, window, profile.covariance_samples, &result);
  result.bins = static_cast<int>(bins.size());
  if (!bins.height.empty()) {
    result.window_low = bins.height.front();
    result.window_high = bins.height.back();
  }
  if (bins.size() < needed) {
    result.status = FitStatus::too_few_bins;
    result.message = "the window holds " + std::to_string(bins.size()) + " bins; " + std::to_string(setup.parameters) +
                     " free parameters need at least " + std::to_string(needed);
    return result;
  }
  if (setup.least_squares.free[0] && is_flat(bins, cleaned.errors_known)) {
    result.status = FitStatus::no_tail;
    result.message = "the profile does not fall anywhere in the window: nothing in it depends on the temperature";
    return result;
  }

  const Fitted fitted =
      fit_window(cleaned, window, profile.covariance_samples, options, setup, bins, find_starts(cleaned, bins, setup));
  const Solution& solution = fitted.solution;
  if (!solution.has_curve) {
    result.status = FitStatus::undefined_model;
    result.message = "the model has no curve for this profile: the equation of state ends below the densities it needs";
    return result;
  }
  const Goodness& good = fitted.good;
  FitModel& model = *setup.model;
  const auto free = setup.least_squares.free;

  result.status = solution.converged ? FitStatus::ok : FitStatus::not_converged;
  if (!solution.converged) {
    result.message = "no minimum after " + std::to_string(solution.iterations) + " iterations";
  }
  result.iterations = solution.iterations;
  result.evaluations = solution.evaluations;
  result.chi2 = solution.chi2;
  result.dof = good.dof;
  result.chi2_per_dof = good.chi2_per_dof;
  result.p_value = good.p_value;
  result.aic = good.aic;
  result.bic = good.bic;
  result.errors_scaled = good.scaled;
  result.model_error = fitted.model_error;

  const double scale = fitted.error_scale;
  const double variance_scale = scale * scale;
  for (std::size_t i = 0; i < 3; ++i) {
    if (free[i]) {
      result.parameters.emplace_back(i == 0 ? "temperature" : i == 1 ? model.place_name() : "plateau_density");
    }
  }
  for (Eigen::Index i = 0; i < solution.covariance.rows(); ++i) {
    for (Eigen::Index j = 0; j < solution.covariance.cols(); ++j) {
      result.covariance.push_back(variance_scale * solution.covariance(i, j));
    }
  }
  using Parameters = FitModel::Parameters;
  const auto derived = [&](auto&& quantity) {
    return Estimate{quantity(solution.parameters), propagated_error(setup, solution, scale, quantity), false};
  };
  result.temperature = {model.uses_temperature() ? solution.parameters[0] : 0.0,
                        parameter_error(setup, solution, 0, scale), !free[0]};
  result.shift = derived([&](const Parameters&) { return model.shift(); });
  result.shift.fixed = options.fixed_shift.has_value();
  result.solid_height = derived([&](const Parameters&) { return model.solid_height(); });
  result.plateau_density = {solution.parameters[2], parameter_error(setup, solution, 2, scale), !free[2]};
  const EquationOfState& equation = model.equation();
  const auto column = [&] { return options.column_number ? *options.column_number : model.column_number(); };
  if (options.column_number) {
    result.column_number = {*options.column_number, 0.0, true};
  } else {
    result.column_number = derived([&](const Parameters&) { return model.column_number(); });
  }
  const Value critical = critical_temperature(equation, {column(), solution.parameters[2]});
  result.critical_status = critical.status;
  if (critical.ok()) {
    const auto critical_of = [&](const Parameters& p) {
      return critical_temperature(equation, {column(), std::min(p[2], model.largest_plateau())}).value;
    };
    result.critical_temperature = derived(critical_of);
    if (model.uses_temperature()) {
      result.reduced_temperature = derived([&](const Parameters& p) { return p[0] / critical_of(p); });
    }
    const double z = equation.compressibility_factor(solution.parameters[2]).value;
    result.solid_height_by_sum_rule = column() / solution.parameters[2] - result.temperature.value * z;
  }
  if (free[0] && result.status == FitStatus::ok &&
      (solution.temperature_at_bound || solution.undetermined ||
       result.temperature.std_error > 0.5 * result.temperature.value)) {
    result.status = FitStatus::unresolved_temperature;
    result.message =
        "the profile falls more sharply than its bins and kernel can tell: the temperature is only bounded above";
  }

  for (Residual& r : result.residuals) r.model = model.smoothed(r.height, setup.least_squares.kernel);
  {
    std::size_t next = 0;
    for (std::size_t i = 0; i < cleaned.size(); ++i) {
      result.residuals[i].used = cleaned.usable[i] && cleaned.height[i] >= window.low &&
                                 cleaned.height[i] <= window.high && next++ < bins.size();
    }
  }
  fill_curve(cleaned, options, model, result);
  if (options.interval) {
    result.temperature_interval = likelihood_interval(fitted, setup, options.confidence);
  }
  if (options.sweep && free[0] && result.status == FitStatus::ok) {
    sweep_windows(cleaned, window, profile, options, setup, solution, result);
  }
  if (options.compare) {
    result.model_comparison.push_back(model_row(options, setup, fitted));
    compare_models(cleaned, window, profile, bins, options, result);
    model.set(solution.parameters);
  }
  warn_about_fit(cleaned, options, setup, result);
  return result;
}

ModelCurve evaluate_model(const FitOptions& options, double temperature, double shift, double plateau_density,
                          double column_number, std::span<const double> heights) {
  ModelCurve curve;
  const std::unique_ptr<FitModel> model = make_fit_model(options.model, options.base, options.constrain_column, 0.25);
  if (!model || !kernel_is_valid(options.kernel)) {
    curve.status = FitStatus::bad_input;
    return curve;
  }
  if (!model->set({temperature, model->place_is_column() ? column_number : shift, plateau_density})) {
    curve.status = FitStatus::undefined_model;
    return curve;
  }
  const KernelRule rule(options.kernel);
  for (const double height : heights) curve.densities.push_back(model->smoothed(height, rule));
  return curve;
}

}  // namespace shakebed::fit
