#include "fit/profile_fit/row_blur.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fit/profile_fit/measured_profile.hpp"

namespace shakebed::fit {

namespace {

// The window through which rows are gone [D]; a kernel this near to it needs no blur.
constexpr double wide_enough = 0.5, nearly = 1e-3;
// Distance of the rows of a hexagonal crystal [D].
constexpr double row_distance = 0.86602540378443865;
// Heights may be this part of the blur apart: the sum over them then misses 2e-4 of the integral, exp(-2 pi^2/1.5^2).
constexpr double widest_spacing = 1.5;
// The blur reaches so many of its standard deviations.
constexpr double reach = 4.0;

double variance_of(const Kernel& kernel) {
  const double square = kernel.width * kernel.width;
  switch (kernel.kind) {
    case KernelKind::none:
      return 0.0;
    case KernelKind::top_hat:
      return square / 12.0;
    case KernelKind::gaussian:
      return square;
    case KernelKind::disk_chord:
      return square / 16.0;
  }
  return 0.0;
}

// The kernel's Fourier transform at the rows' distance.
double rows_through(const Kernel& kernel) {
  const double x = std::numbers::pi * kernel.width / row_distance;
  if (kernel.kind == KernelKind::none || !(x > 0.0)) return 1.0;
  switch (kernel.kind) {
    case KernelKind::none:
      return 1.0;
    case KernelKind::top_hat:
      return std::abs(std::sin(x) / x);
    case KernelKind::gaussian:
      return std::exp(-2.0 * x * x);
    case KernelKind::disk_chord:
      return std::abs(2.0 * std::cyl_bessel_j(1.0, x) / x);
  }
  return 1.0;
}

bool has_errors(const Profile& profile) {
  const auto positive = [](double x) { return x > 0.0; };
  return std::any_of(profile.covariance.begin(), profile.covariance.end(), positive) ||
         std::any_of(profile.std_error.begin(), profile.std_error.end(), positive);
}

// What fit_profile() would refuse must reach it as it is.
bool is_sound(const Profile& profile) {
  MeasuredProfile measured;
  FitResult result;
  return measure_profile(profile, measured, result) == FitStatus::ok;
}

// Ascending, and nowhere farther apart than `limit`.
bool is_dense(const std::vector<double>& heights, double limit) {
  for (std::size_t i = 1; i < heights.size(); ++i) {
    if (!(heights[i] > heights[i - 1] && heights[i] - heights[i - 1] <= limit)) return false;
  }
  return heights.size() > 2;
}

// The blur as a matrix in bands: row i holds the weights of bins first[i], first[i] + 1, ... of the density at height
// i.
struct Weights {
  std::vector<std::size_t> first;
  std::vector<std::vector<double>> row;
};

Weights weights_of(const std::vector<double>& heights, double blur) {
  const std::size_t n = heights.size();
  Weights weights;
  for (std::size_t i = 0; i < n; ++i) {
    std::size_t from = i, to = i;
    while (from > 0 && heights[i] - heights[from - 1] <= reach * blur) --from;
    while (to + 1 < n && heights[to + 1] - heights[i] <= reach * blur) ++to;
    weights.first.push_back(from);
    weights.row.emplace_back();
    for (std::size_t j = from; j <= to; ++j) {
      const double below = j > 0 ? heights[j] - heights[j - 1] : heights[1] - heights[0];
      const double above = j + 1 < n ? heights[j + 1] - heights[j] : below;
      weights.row.back().push_back(0.5 * (below + above) *
                                   kernel_density({KernelKind::gaussian, blur}, heights[i] - heights[j]));
    }
  }
  return weights;
}

std::vector<double> times(const Weights& weights, const std::vector<double>& values) {
  std::vector<double> out(values.size(), 0.0);
  for (std::size_t i = 0; i < out.size(); ++i) {
    for (std::size_t k = 0; k < weights.row[i].size(); ++k) out[i] += weights.row[i][k] * values[weights.first[i] + k];
  }
  return out;
}

// W C W^T, row by row and then column by column.
std::vector<double> covariance_of(const Weights& weights, std::vector<double> covariance) {
  const std::size_t n = weights.row.size();
  for (int side = 0; side < 2; ++side) {
    std::vector<double> next(n * n);
    for (std::size_t r = 0; r < n; ++r) {
      const auto begin = covariance.begin() + static_cast<std::ptrdiff_t>(r * n);
      const std::vector<double> blurred = times(weights, {begin, begin + static_cast<std::ptrdiff_t>(n)});
      for (std::size_t c = 0; c < n; ++c) next[c * n + r] = blurred[c];
    }
    covariance = std::move(next);
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < i; ++j)
      covariance[i * n + j] = covariance[j * n + i] = 0.5 * (covariance[i * n + j] + covariance[j * n + i]);
  }
  return covariance;
}

std::vector<double> diagonal(const std::vector<double>& std_error) {
  const std::size_t n = std_error.size();
  std::vector<double> covariance(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) covariance[i * n + i] = std_error[i] * std_error[i];
  return covariance;
}

// A profile that does not begin at the bed's lower edge lacks what would be blurred into its first heights.
void drop_the_cut(double lowest, Profile& profile) {
  const auto cut = static_cast<std::size_t>(std::lower_bound(profile.height.begin(), profile.height.end(), lowest) -
                                            profile.height.begin());
  const std::size_t n = profile.height.size();
  std::vector<double> covariance;
  for (std::size_t i = cut; i < n; ++i) {
    for (std::size_t j = cut; j < n; ++j) covariance.push_back(profile.covariance[i * n + j]);
  }
  profile.covariance = std::move(covariance);
  for (std::vector<double>* column : {&profile.height, &profile.number_density, &profile.std_error})
    column->erase(column->begin(), column->begin() + static_cast<std::ptrdiff_t>(cut));
}

}  // namespace

BlurredProfile blur_rows(const Profile& profile, const Kernel& kernel, double base) {
  BlurredProfile out{profile, kernel, rows_through(kernel)};
  const double missing = wide_enough * wide_enough - variance_of(kernel);
  const std::size_t n = profile.height.size();
  if (!(missing > nearly) || !kernel_is_valid(kernel) || !has_errors(profile) || !is_sound(profile)) return out;
  const double blur = std::sqrt(missing);
  if (!is_dense(profile.height, widest_spacing * blur)) return out;

  const Weights weights = weights_of(profile.height, blur);
  Profile& blurred = out.profile;
  blurred.number_density = times(weights, profile.number_density);
  blurred.covariance =
      covariance_of(weights, profile.covariance.empty() ? diagonal(profile.std_error) : profile.covariance);
  // Errors known bin by bin: the number of samples is set high enough to count as normal. It is too low for weights
  // from the correlations of neighbours, which would undo the blur.
  if (profile.covariance.empty() || profile.covariance_samples == 0) blurred.covariance_samples = static_cast<int>(n);
  blurred.std_error.resize(n);
  for (std::size_t i = 0; i < n; ++i) blurred.std_error[i] = std::sqrt(std::max(0.0, blurred.covariance[i * n + i]));
  if (profile.height.front() > base + 1.0) drop_the_cut(profile.height.front() + reach * blur, blurred);
  out.kernel = {KernelKind::gaussian, wide_enough};
  out.rows_seen = rows_through(out.kernel);
  return out;
}

}  // namespace shakebed::fit
