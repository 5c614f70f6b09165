#include "fit/profile_fit/measured_profile.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

namespace shakebed::fit {

namespace {

// Errors below this part of the greatest density are not errors of a measurement, but a stand-in for "none".
constexpr double least_relative_error = 1e-12;

std::string at_bin(std::size_t i) { return " in bin " + std::to_string(i); }

double median_of(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

FitStatus check_covariance(const Profile& profile, FitResult& result) {
  const std::size_t n = profile.height.size();
  for (const double entry : profile.covariance) {
    if (!std::isfinite(entry)) return bad_input(result, "the covariance has an entry that is not a finite number");
  }
  std::vector<double> sigma;
  for (std::size_t i = 0; i < n; ++i) {
    const auto entry = [&](std::size_t a, std::size_t b) { return profile.covariance[a * n + b]; };
    if (entry(i, i) < 0.0) return bad_input(result, "the covariance has a negative variance" + at_bin(i));
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
        return bad_input(result, "the covariance has a correlation outside -1 to 1" + between(j));
      }
    }
  }
  return FitStatus::ok;
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
    return bad_input(result, "the covariance has " + std::to_string(profile.covariance.size()) + " entries, but " +
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
  return profile.covariance.empty() ? FitStatus::ok : check_covariance(profile, result);
}

void clean_errors(const Profile& profile, const std::vector<std::size_t>& order, MeasuredProfile& measured,
                  FitResult& result) {
  const std::size_t n = order.size();
  double greatest = 0.0;
  for (const double density : measured.density) greatest = std::max(greatest, std::abs(density));
  measured.error.assign(n, 0.0);
  measured.usable.assign(n, true);
  std::vector<double> good;
  for (std::size_t i = 0; i < n; ++i) {
    double error = 0.0;
    if (!profile.covariance.empty()) {
      error = std::sqrt(std::max(0.0, profile.covariance[order[i] * n + order[i]]));
    } else if (!profile.std_error.empty()) {
      error = profile.std_error[order[i]];
    }
    if (error > least_relative_error * greatest) {
      measured.error[i] = error;
      good.push_back(error);
    }
  }
  measured.errors_known = !good.empty();
  if (!measured.errors_known) {
    measured.error.assign(n, 1.0);
    if (!profile.std_error.empty() || !profile.covariance.empty()) {
      result.warnings.emplace_back(
          "all standard errors are zero: every bin has the same weight, and the errors of the fit follow from the "
          "residuals");
    } else {
      result.warnings.emplace_back(
          "no standard errors were given: every bin has the same weight, and the errors of the fit follow from the "
          "residuals");
    }
    return;
  }
  // An empty bin without an error says nothing; a filled one gets the median error.
  const double typical = median_of(good);
  std::size_t filled = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (measured.error[i] > 0.0) continue;
    measured.error[i] = typical;
    if (measured.density[i] == 0.0) {
      measured.usable[i] = false;
    } else {
      ++filled;
    }
  }
  if (filled > 0) {
    result.warnings.push_back((filled == 1 ? "1 bin has" : std::to_string(filled) + " bins have") +
                              " a density but no standard error; the median error, " + number(typical) +
                              ", was used there");
  }
}

void clean_covariance(const Profile& profile, const std::vector<std::size_t>& order, MeasuredProfile& measured) {
  if (profile.covariance.empty() || !measured.errors_known) return;
  const std::size_t n = order.size();
  measured.covariance.resize(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const double entry =
          0.5 * (profile.covariance[order[i] * n + order[j]] + profile.covariance[order[j] * n + order[i]]);
      measured.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = entry;
    }
    measured.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)) =
        measured.error[i] * measured.error[i];
  }
}

void measure_spacing(MeasuredProfile& measured, FitResult& result) {
  std::vector<double> gaps;
  std::size_t repeated = 0;
  for (std::size_t i = 1; i < measured.size(); ++i) {
    const double gap = measured.height[i] - measured.height[i - 1];
    if (gap > 0.0) {
      gaps.push_back(gap);
    } else {
      ++repeated;
    }
  }
  if (repeated > 0) {
    result.warnings.push_back((repeated == 1 ? "1 bin repeats" : std::to_string(repeated) + " bins repeat") +
                              " the height of another bin; each counts as an independent measurement");
  }
  measured.spacing = median_of(std::move(gaps));
}

// The area under the profile: each distinct height owns half the way to its neighbours, the ends as much outwards as
// inwards. Bins at the same height share theirs.
void measure_area(MeasuredProfile& measured, FitResult& result) {
  const std::size_t n = measured.size();
  std::size_t negative = 0;
  for (std::size_t i = 0; i < n;) {
    std::size_t j = i;
    double sum = 0.0;
    while (j < n && measured.height[j] == measured.height[i]) {
      sum += measured.density[j];
      if (measured.density[j] < 0.0) ++negative;
      ++j;
    }
    const double below = i > 0 ? measured.height[i] - measured.height[i - 1] : 0.0;
    const double above = j < n ? measured.height[j] - measured.height[i] : 0.0;
    const double width = i == 0 ? above : (j == n ? below : 0.5 * (below + above));
    measured.area += sum / static_cast<double>(j - i) * width;
    i = j;
  }
  if (negative > 0) {
    result.warnings.push_back((negative == 1 ? "1 bin has" : std::to_string(negative) + " bins have") +
                              " a negative density; no density was changed");
  }
  result.area = measured.area;
}

void average_over_one_diameter(MeasuredProfile& measured) {
  const std::size_t n = measured.size();
  measured.one_diameter_mean.resize(n);
  double sum = 0.0;
  std::size_t from = 0;
  std::size_t to = 0;
  for (std::size_t i = 0; i < n; ++i) {
    while (to < n && measured.height[to] <= measured.height[i] + 0.5) sum += measured.density[to++];
    while (measured.height[from] < measured.height[i] - 0.5) sum -= measured.density[from++];
    measured.one_diameter_mean[i] = sum / static_cast<double>(to - from);
  }
}

}  // namespace

std::string number(double value, int digits) {
  char text[48];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

FitStatus bad_input(FitResult& result, std::string message) {
  result.message = std::move(message);
  return FitStatus::bad_input;
}

FitStatus measure_profile(const Profile& profile, MeasuredProfile& measured, FitResult& result) {
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
    measured.height.push_back(profile.height[i]);
    measured.density.push_back(profile.number_density[i]);
  }
  measured.covariance_samples = profile.covariance_samples;
  measure_spacing(measured, result);
  clean_errors(profile, order, measured, result);
  clean_covariance(profile, order, measured);
  measure_area(measured, result);
  average_over_one_diameter(measured);
  return FitStatus::ok;
}

}  // namespace shakebed::fit
