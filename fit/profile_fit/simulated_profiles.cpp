#include "fit/profile_fit/simulated_profiles.hpp"

#include <gsl/gsl_cdf.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace shakebed::fit {

namespace {

constexpr double least_error = 1e-4;  // of a bin, relative to the greatest density
constexpr double poor_chance = 1e-3;  // of so large a chi2: below, the match is poor

// A temperature of the library: the mean of its runs on the measurement's bins.
struct Node {
  double log_temperature = 0.0;
  double solid_height = 0.0;
  std::vector<double> density, variance;  // variance: of the mean, by the runs' own errors
  // What preparation does: the deviations of the runs from their mean, freed of their noise, so that the sum of their
  // outer products is the covariance of one bed about the mean. Empty without repeats.
  std::vector<std::vector<double>> modes;
  double repeats = 1.0;
};

double at_height(const std::vector<double>& x, const std::vector<double>& y, double height) {
  if (x.empty() || height < x.front() || height > x.back()) return 0.0;
  const auto above = static_cast<std::size_t>(std::lower_bound(x.begin(), x.end(), height) - x.begin());
  if (x[above] == height || above == 0) return y[above];
  const double part = (height - x[above - 1]) / (x[above] - x[above - 1]);
  return (1.0 - part) * y[above - 1] + part * y[above];
}

bool is_good(const Profile& profile) {
  if (profile.height.empty() || profile.number_density.size() != profile.height.size()) return false;
  if (!profile.std_error.empty() && profile.std_error.size() != profile.height.size()) return false;
  for (std::size_t i = 0; i < profile.height.size(); ++i) {
    if (!std::isfinite(profile.height[i]) || !std::isfinite(profile.number_density[i])) return false;
    if (i > 0 && !(profile.height[i] > profile.height[i - 1])) return false;
    if (!profile.std_error.empty() && !(std::isfinite(profile.std_error[i]) && profile.std_error[i] >= 0.0))
      return false;
  }
  return true;
}

std::vector<Node> nodes_of(const std::vector<SimulatedProfile>& library, const std::vector<double>& heights) {
  std::vector<const SimulatedProfile*> runs;
  for (const SimulatedProfile& run : library) runs.push_back(&run);
  std::sort(runs.begin(), runs.end(), [](const auto* a, const auto* b) { return a->temperature < b->temperature; });
  std::vector<Node> nodes;
  for (std::size_t first = 0; first < runs.size();) {
    std::size_t last = first;
    while (last < runs.size() && runs[last]->temperature <= runs[first]->temperature * (1.0 + 1e-6)) ++last;
    const auto count = static_cast<double>(last - first);
    Node node;
    node.log_temperature = std::log(runs[first]->temperature);
    for (std::size_t r = first; r < last; ++r) node.solid_height += runs[r]->solid_height / count;
    node.repeats = count;
    double noise = 0.0;   // summed over bins: variances of one run as stated ...
    double spread = 0.0;  // ... and as the repeats show
    if (last - first > 1) node.modes.assign(last - first, {});
    for (const double height : heights) {
      double mean = 0.0;
      double own = 0.0;
      for (std::size_t r = first; r < last; ++r) {
        const Profile& p = runs[r]->profile;
        mean += at_height(p.height, p.number_density, height) / count;
        if (!p.std_error.empty()) own += std::pow(at_height(p.height, p.std_error, height), 2) / count;
      }
      for (std::size_t r = first; r < last && last - first > 1; ++r) {
        const Profile& p = runs[r]->profile;
        const double deviation = (at_height(p.height, p.number_density, height) - mean) / std::sqrt(count - 1.0);
        node.modes[r - first].push_back(deviation);
        spread += deviation * deviation;
      }
      noise += own;
      node.density.push_back(mean);
      node.variance.push_back(own / count);
    }
    const double preparation = spread > 0.0 ? std::sqrt(std::max(0.0, 1.0 - noise / spread)) : 0.0;
    for (std::vector<double>& mode : node.modes) {
      for (double& x : mode) x *= preparation;
    }
    nodes.push_back(std::move(node));
    first = last;
  }
  return nodes;
}

// Lagrange weights of `order` nodes about x.
struct Stencil {
  std::size_t first = 0;
  std::vector<double> weight;
};

Stencil stencil_at(const std::vector<Node>& nodes, double x, int order) {
  const auto points = std::min(nodes.size(), static_cast<std::size_t>(std::max(2, order)));
  std::size_t above = 0;
  while (above < nodes.size() && nodes[above].log_temperature < x) ++above;
  const std::size_t half = points / 2;
  std::size_t first = above > half ? above - half : 0;
  first = std::min(first, nodes.size() - points);
  Stencil stencil;
  stencil.first = first;
  for (std::size_t i = first; i < first + points; ++i) {
    double weight = 1.0;
    for (std::size_t j = first; j < first + points; ++j) {
      if (j == i) continue;
      weight *= (x - nodes[j].log_temperature) / (nodes[i].log_temperature - nodes[j].log_temperature);
    }
    stencil.weight.push_back(weight);
  }
  return stencil;
}

struct Target {
  std::vector<double> height, density, variance;
};

struct Model {
  std::vector<double> density, variance;
  std::vector<std::vector<double>> modes;  // correlated errors, beside the variance
};

Model model_at(const std::vector<Node>& nodes, double x, int order) {
  const Stencil fine = stencil_at(nodes, x, order);
  const Stencil coarse = stencil_at(nodes, x, std::max(2, order - 1));
  const std::size_t bins = nodes.front().density.size();
  Model model;
  model.density.assign(bins, 0.0);
  model.variance.assign(bins, 0.0);
  std::vector<double> other(bins, 0.0);
  double total = 0.0;
  for (const double weight : fine.weight) total += std::abs(weight);
  for (std::size_t i = 0; i < fine.weight.size(); ++i) {
    const Node& node = nodes[fine.first + i];
    for (std::size_t b = 0; b < bins; ++b) {
      model.density[b] += fine.weight[i] * node.density[b];
      model.variance[b] += fine.weight[i] * fine.weight[i] * node.variance[b];
    }
    // Preparation enters twice: in the measured bed itself, and, less, in the mean of the repeats.
    const double share = std::sqrt(std::abs(fine.weight[i]) / total + fine.weight[i] * fine.weight[i] / node.repeats);
    for (const std::vector<double>& mode : node.modes) {
      model.modes.push_back(mode);
      for (double& entry : model.modes.back()) entry *= share;
    }
  }
  for (std::size_t i = 0; i < coarse.weight.size(); ++i) {
    for (std::size_t b = 0; b < bins; ++b) other[b] += coarse.weight[i] * nodes[coarse.first + i].density[b];
  }
  // The last order's contribution bounds the interpolation error; a tenth of it remains, as a rule of cubic against
  // quadratic.
  if (nodes.size() > 2) {
    for (std::size_t b = 0; b < bins; ++b) model.variance[b] += 0.01 * std::pow(model.density[b] - other[b], 2);
  }
  return model;
}

// -2 ln likelihood: the variance depends on the temperature, so its logarithm counts.
double misfit(const Target& target, const std::vector<Node>& nodes, double x, int order, double* chi2 = nullptr) {
  const Model model = model_at(nodes, x, order);
  const auto bins = static_cast<Eigen::Index>(target.height.size());
  const auto count = static_cast<Eigen::Index>(model.modes.size());
  Eigen::VectorXd residual(bins);
  Eigen::MatrixXd modes(bins, count);
  double logs = 0.0;
  for (Eigen::Index b = 0; b < bins; ++b) {
    const auto bin = static_cast<std::size_t>(b);
    const double variance = target.variance[bin] + model.variance[bin];
    const double inverse = 1.0 / std::sqrt(variance);
    residual[b] = (target.density[bin] - model.density[bin]) * inverse;
    for (Eigen::Index m = 0; m < count; ++m) modes(b, m) = model.modes[static_cast<std::size_t>(m)][bin] * inverse;
    logs += std::log(variance);
  }
  double sum = residual.squaredNorm();
  if (count > 0) {  // (D + U U^T)^-1 and its determinant, by Woodbury
    Eigen::MatrixXd inner = modes.transpose() * modes;
    inner.diagonal().array() += 1.0;
    const Eigen::LLT<Eigen::MatrixXd> cholesky(inner);
    const Eigen::VectorXd projected = modes.transpose() * residual;
    sum -= projected.dot(cholesky.solve(projected));
    const Eigen::MatrixXd& factor = cholesky.matrixLLT();
    for (Eigen::Index m = 0; m < count; ++m) logs += 2.0 * std::log(factor(m, m));
  }
  if (chi2 != nullptr) *chi2 = sum;
  return sum + logs;
}

double best_log_temperature(const Target& target, const std::vector<Node>& nodes, int order) {
  const double low = nodes.front().log_temperature;
  const double high = nodes.back().log_temperature;
  constexpr int steps = 400;
  int best = 0;
  double least = misfit(target, nodes, low, order);
  for (int i = 1; i <= steps; ++i) {
    const double value = misfit(target, nodes, low + (high - low) * i / steps, order);
    if (value < least) {
      least = value;
      best = i;
    }
  }
  double a = low + (high - low) * std::max(0, best - 1) / steps;
  double b = low + (high - low) * std::min(steps, best + 1) / steps;
  constexpr double golden = 0.6180339887498949;
  for (int i = 0; i < 80 && b - a > 1e-12; ++i) {
    const double left = b - golden * (b - a);
    const double right = a + golden * (b - a);
    if (misfit(target, nodes, left, order) < misfit(target, nodes, right, order)) {
      b = right;
    } else {
      a = left;
    }
  }
  return 0.5 * (a + b);
}

// Why neither can be used; "": they can.
std::string why_bad(const Profile& measured, const std::vector<SimulatedProfile>& library) {
  if (!is_good(measured)) return "the measured profile is empty, not finite or not in ascending heights";
  for (const SimulatedProfile& run : library) {
    if (!(std::isfinite(run.temperature) && run.temperature > 0.0)) return "a library temperature is not positive";
    if (!is_good(run.profile)) return "a library profile is empty, not finite or not in ascending heights";
  }
  return "";
}

double greatest_density(const Profile& profile) {
  double greatest = 0.0;
  for (const double density : profile.number_density) greatest = std::max(greatest, density);
  return greatest;
}

// The bins in the window. Every variance has a lower bound: a bin that is empty in both profiles has no error, but must
// not get infinite weight.
Target target_of(const Profile& measured, const MatchOptions& options) {
  const double least_variance = std::pow(least_error * greatest_density(measured), 2);
  Target target;
  for (std::size_t i = 0; i < measured.height.size(); ++i) {
    if (measured.height[i] < options.low || measured.height[i] > options.high) continue;
    const double error = measured.std_error.empty() ? 0.0 : measured.std_error[i];
    target.height.push_back(measured.height[i]);
    target.density.push_back(measured.number_density[i]);
    target.variance.push_back(std::max(error * error, least_variance));
  }
  return target;
}

// The best temperature, its errors, and the profile there.
class Matcher {
 public:
  Matcher(const Target& target, const std::vector<Node>& nodes, const MatchOptions& options, MatchResult& result)
      : target_(target), nodes_(nodes), options_(options), result_(result) {}

  void run() {
    best_ = best_log_temperature(target_, nodes_, options_.order);
    least_ = misfit(target_, nodes_, best_, options_.order, &result_.chi2);
    result_.chi2_per_dof = result_.chi2 / result_.dof;
    result_.temperature.value = std::exp(best_);
    find_errors();
    take_profile();
    find_status();
  }

 private:
  [[nodiscard]] double low() const { return nodes_.front().log_temperature; }
  [[nodiscard]] double high() const { return nodes_.back().log_temperature; }
  // A poor match has larger errors than it states.
  [[nodiscard]] bool is_poor() const { return gsl_cdf_chisq_Q(result_.chi2, result_.dof) < poor_chance; }

  // Where the misfit has risen by `rise`, on either side.
  [[nodiscard]] double crossing(int side, double rise, bool& open) const {
    const double end = side < 0 ? low() : high();
    double inside = best_;
    double outside = best_;
    double step = 1e-4 * (high() - low());
    while (true) {
      outside = side < 0 ? std::max(end, outside - step) : std::min(end, outside + step);
      if (misfit(target_, nodes_, outside, options_.order) - least_ >= rise) break;
      inside = outside;
      if (outside == end) {
        open = true;
        return end;
      }
      step *= 1.5;
    }
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (inside + outside);
      (misfit(target_, nodes_, middle, options_.order) - least_ < rise ? inside : outside) = middle;
    }
    return inside;
  }

  [[nodiscard]] double solid_at(double at) const {
    const Stencil stencil = stencil_at(nodes_, at, options_.order);
    double height = 0.0;
    for (std::size_t i = 0; i < stencil.weight.size(); ++i)
      height += stencil.weight[i] * nodes_[stencil.first + i].solid_height;
    return height;
  }

  void find_errors() {
    const double unit = is_poor() ? std::max(1.0, result_.chi2_per_dof) : 1.0;
    bool ignored = false;
    const double down = crossing(-1, unit, ignored);
    const double up = crossing(+1, unit, ignored);
    const double coarser = std::exp(best_log_temperature(target_, nodes_, std::max(2, options_.order - 1)));
    result_.interpolation_error = std::abs(coarser - result_.temperature.value);
    result_.temperature.std_error =
        std::hypot(0.5 * (std::exp(up) - std::exp(down)), nodes_.size() > 2 ? 0.1 * result_.interpolation_error : 0.0);
    const double quantile = unit * gsl_cdf_chisq_Pinv(options_.confidence, 1.0);
    result_.interval.confidence = options_.confidence;
    result_.interval.low = std::exp(crossing(-1, quantile, result_.interval.low_open));
    result_.interval.high = std::exp(crossing(+1, quantile, result_.interval.high_open));
    result_.interval.status = FitStatus::ok;
    result_.solid_height = {solid_at(best_), 0.5 * std::abs(solid_at(up) - solid_at(down)), false};
  }

  void take_profile() {
    const Model model = model_at(nodes_, best_, options_.order);
    result_.height = target_.height;
    result_.density = model.density;
    for (std::size_t b = 0; b < model.variance.size(); ++b) {
      double variance = model.variance[b];
      for (const std::vector<double>& mode : model.modes) variance += mode[b] * mode[b];
      result_.library_error.push_back(std::sqrt(variance));
    }
  }

  void find_status() {
    result_.status = FitStatus::ok;
    const double range = high() - low();
    if (best_ - low() < 1e-9 * range || high() - best_ < 1e-9 * range) {
      result_.status = FitStatus::unresolved_temperature;
      result_.message =
          "the best temperature is at an end of the library: the measured bed may lie outside the library's range";
    }
    if (is_poor()) {
      result_.warnings.emplace_back(
          "no bed of the library describes the data; the errors were enlarged by the square root of "
          "chi2/dof");
    }
    if (result_.interpolation_error > result_.temperature.std_error && nodes_.size() > 2) {
      result_.warnings.emplace_back(
          "the library has too few temperatures: interpolation between them changes T by more than its error");
    }
  }

  const Target& target_;
  const std::vector<Node>& nodes_;
  const MatchOptions& options_;
  MatchResult& result_;
  double best_ = 0.0, least_ = 0.0;  // ln T; the misfit there
};

}  // namespace

MatchResult match_simulated(const Profile& measured, const std::vector<SimulatedProfile>& library,
                            const MatchOptions& options) {
  MatchResult result;
  const auto refused = [&](FitStatus status, std::string why) {
    result.status = status;
    result.message = std::move(why);
    return result;
  };
  if (std::string why = why_bad(measured, library); !why.empty()) return refused(FitStatus::bad_input, std::move(why));
  if (!(greatest_density(measured) > 0.0))
    return refused(FitStatus::no_signal, "no bin has a density above 0: check the column of the density");
  const Target target = target_of(measured, options);
  result.bins = static_cast<int>(target.height.size());
  result.dof = result.bins - 1;
  if (result.bins < 3) return refused(FitStatus::too_few_bins, "fewer than three bins in the window");
  const std::vector<Node> nodes = nodes_of(library, target.height);
  if (nodes.size() < 2) return refused(FitStatus::bad_input, "the library needs at least two temperatures");
  Matcher(target, nodes, options, result).run();
  return result;
}

std::vector<LibraryTest> test_library(const std::vector<SimulatedProfile>& library, const MatchOptions& options) {
  std::vector<LibraryTest> rows;
  double lowest = 1e300;
  double highest = 0.0;
  for (const SimulatedProfile& run : library) {
    lowest = std::min(lowest, run.temperature);
    highest = std::max(highest, run.temperature);
  }
  for (std::size_t i = 0; i < library.size(); ++i) {
    std::vector<SimulatedProfile> others;
    bool repeated = false;
    for (std::size_t j = 0; j < library.size(); ++j) {
      if (j == i) continue;
      others.push_back(library[j]);
      repeated = repeated || std::abs(library[j].temperature / library[i].temperature - 1.0) <= 1e-6;
    }
    const bool at_end =
        library[i].temperature <= lowest * (1.0 + 1e-6) || library[i].temperature >= highest * (1.0 - 1e-6);
    if (at_end && !repeated) continue;
    const MatchResult match = match_simulated(library[i].profile, others, options);
    rows.push_back({library[i].temperature, match.status, match.temperature});
  }
  return rows;
}

Value library_scatter(const std::vector<LibraryTest>& tests, double temperature) {
  if (!(std::isfinite(temperature) && temperature > 0.0)) return no_value(ValueStatus::invalid_argument);
  double sum = 0.0;
  int count = 0;
  for (const LibraryTest& test : tests) {
    if (test.status != FitStatus::ok || std::abs(std::log(test.temperature / temperature)) > std::log(1.5)) continue;
    sum += std::pow(std::log(test.matched.value / test.temperature), 2);
    ++count;
  }
  if (count < 3) return no_value(ValueStatus::outside_range);
  return {std::sqrt(sum / count)};
}

}  // namespace shakebed::fit
