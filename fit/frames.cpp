#include <gsl/gsl_cdf.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "fit/fit_profile.hpp"
#include "statistics/correlated_series.hpp"

namespace shakebed::fit {

namespace {

bool shape_is_good(const ProfileFrames& frames, std::string& message) {
  const std::size_t bins = frames.height.size();
  if (bins == 0 || frames.number_density.empty()) {
    message = "there are no frames";
    return false;
  }
  if (frames.number_density.size() % bins != 0) {
    message = "the densities are not a whole number of frames of " + std::to_string(bins) + " bins";
    return false;
  }
  for (const double value : frames.number_density) {
    if (!std::isfinite(value)) {
      message = "a density is not a finite number";
      return false;
    }
  }
  for (const double value : frames.height) {
    if (!std::isfinite(value)) {
      message = "a height is not a finite number";
      return false;
    }
  }
  return true;
}

// Rows: means of `block` consecutive frames (a last, shorter block is left out).
Eigen::MatrixXd block_means(const ProfileFrames& frames, int block) {
  const auto bins = static_cast<Eigen::Index>(frames.height.size());
  const auto blocks = static_cast<Eigen::Index>(frames.frames()) / block;
  Eigen::MatrixXd means = Eigen::MatrixXd::Zero(blocks, bins);
  for (Eigen::Index b = 0; b < blocks; ++b) {
    for (int f = 0; f < block; ++f) {
      const std::size_t frame =
          static_cast<std::size_t>(b) * static_cast<std::size_t>(block) + static_cast<std::size_t>(f);
      means.row(b) +=
          Eigen::Map<const Eigen::RowVectorXd>(frames.number_density.data() + frame * frames.height.size(), bins);
    }
  }
  means /= block;
  return means;
}

// The area-weighted height of each frame, from its mean.
std::vector<double> heights_of(const ProfileFrames& frames) {
  const std::size_t bins = frames.height.size(), count = frames.frames();
  std::vector<double> series(count, 0.0);
  for (std::size_t f = 0; f < count; ++f) {
    for (std::size_t i = 0; i < bins; ++i) series[f] += frames.height[i] * frames.number_density[f * bins + i];
  }
  return statistics::from_mean(std::move(series));
}

// How much further from the whole sample's mean than means of resampled blocks are, the means of other films would be.
// Blocks with memory share some of it and are few; overlapping windows miss less.
// degrees: of freedom of that, about.
struct Widening {
  double factor = 1.0, degrees = 1e6;
};
// series: the height of each frame, from its mean; of_blocks: its means over blocks of `block` frames.
Widening widening_of(const std::vector<double>& series, const Eigen::VectorXd& of_blocks, int block) {
  const auto m = static_cast<double>(of_blocks.size()), n = static_cast<double>(series.size());
  // The variance of a mean of as many blocks drawn with replacement.
  const double resampled = (of_blocks.array() - of_blocks.mean()).square().sum() / (m * m);
  if (!(resampled > 0.0)) return {};
  Widening widening;
  widening.degrees = m - 1.0;
  double variance = resampled * m / (m - 1.0);
  const double memory = statistics::memory_of(series);
  if (block > 1 && memory >= statistics::least_memory && series.size() >= 24) {
    const std::size_t half = statistics::half_window(memory, series.size());
    const statistics::WindowVariance found = statistics::corrected_variance(series, half);
    variance = found.variance * found.correction;
    // Overlapping windows tell half as much again as those side by side; the correction doubles the variance of that.
    widening.degrees = 1.5 * (n / static_cast<double>(2 * half) - 1.0) / 2.0;
  }
  widening.factor = std::sqrt(std::max(variance / resampled, 1.0));
  return widening;
}

// An even number below `count` from a 64-bit generator, the same on every platform.
std::size_t below(std::mt19937_64& generator, std::size_t count) {
  const std::uint64_t limit = (~std::uint64_t{0}) - (~std::uint64_t{0}) % count;
  std::uint64_t value = generator();
  while (value >= limit) value = generator();
  return static_cast<std::size_t>(value % count);
}

}  // namespace

FrameAverage average_frames(const ProfileFrames& frames, int block) {
  FrameAverage average;
  average.block = block;
  if (!shape_is_good(frames, average.message) || block < 1) {
    if (block < 1) average.message = "the block length must be at least 1";
    average.status = FitStatus::bad_input;
    return average;
  }
  const Eigen::MatrixXd means = block_means(frames, block);
  average.blocks = static_cast<int>(means.rows());
  if (means.rows() < 2) {
    average.status = FitStatus::bad_input;
    average.message = "fewer than two blocks of " + std::to_string(block) + " frames";
    return average;
  }
  const Eigen::RowVectorXd mean = means.colwise().mean();
  const Eigen::MatrixXd centred = means.rowwise() - mean;
  const auto m = static_cast<double>(means.rows());
  const Eigen::MatrixXd covariance = centred.transpose() * centred / (m * (m - 1.0));
  Profile& profile = average.profile;
  profile.height = frames.height;
  profile.covariance_samples = average.blocks;
  for (Eigen::Index i = 0; i < mean.size(); ++i) {
    profile.number_density.push_back(mean[i]);
    profile.std_error.push_back(std::sqrt(covariance(i, i)));
  }
  profile.covariance.assign(covariance.data(), covariance.data() + covariance.size());
  return average;
}

int independent_block(const ProfileFrames& frames) {
  std::string message;
  if (!shape_is_good(frames, message)) return 1;
  const double inefficiency = statistics::memory_of(heights_of(frames));
  if (inefficiency < statistics::least_memory) return 1;
  // A block of b frames with memory misses about 2 x memory/b of the variance of the mean.
  const int block = static_cast<int>(std::ceil(4.0 * inefficiency));
  return std::clamp(block, 1, static_cast<int>(frames.frames() / 4));
}

BootstrapResult bootstrap_fit(const ProfileFrames& frames, const FitOptions& options,
                              const BootstrapOptions& bootstrap) {
  BootstrapResult result;
  const int block = bootstrap.block > 0 ? bootstrap.block : independent_block(frames);
  result.block = block;
  const FrameAverage average = average_frames(frames, block);
  if (average.status != FitStatus::ok || bootstrap.resamples < 10 ||
      !(bootstrap.confidence > 0.0 && bootstrap.confidence < 1.0)) {
    result.status = FitStatus::bad_input;
    result.message = average.status != FitStatus::ok
                         ? average.message
                         : "at least 10 resamples and a confidence between 0 and 1 are needed";
    return result;
  }
  const Eigen::MatrixXd means = block_means(frames, block);
  FitOptions plain = options;
  plain.interval = plain.sweep = plain.compare = false;
  plain.curve_points = 0;
  Profile profile = average.profile;
  profile.covariance.clear();
  const FitResult whole = fit_profile(profile, plain);
  if (!whole.ok()) {
    result.status = whole.status;
    result.message = whole.message;
    return result;
  }
  const Eigen::Map<const Eigen::RowVectorXd> average_mean(average.profile.number_density.data(), means.cols());
  // Every resample is fitted on the window of the whole sample.
  plain.window.low = whole.window_low;
  plain.window.high = whole.window_high;
  std::mt19937_64 generator(bootstrap.seed);
  std::vector<double> temperatures;
  std::vector<double> shifts;
  const auto blocks = static_cast<std::size_t>(means.rows());
  const Eigen::Map<const Eigen::VectorXd> height(frames.height.data(), means.cols());
  const Widening widening = widening_of(heights_of(frames), means * height, block);
  for (int resample = 0; resample < bootstrap.resamples; ++resample) {
    Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(means.cols());
    for (std::size_t b = 0; b < blocks; ++b) mean += means.row(static_cast<Eigen::Index>(below(generator, blocks)));
    mean = average_mean + widening.factor * (mean / static_cast<double>(blocks) - average_mean);
    profile.number_density.assign(mean.data(), mean.data() + mean.size());
    const FitResult fit = fit_profile(profile, plain);
    if (!fit.ok()) continue;
    temperatures.push_back(fit.temperature.value);
    shifts.push_back(fit.shift.value);
  }
  result.succeeded = static_cast<int>(temperatures.size());
  if (result.succeeded < bootstrap.resamples / 2) {
    result.status = FitStatus::not_converged;
    result.message = "only " + std::to_string(result.succeeded) + " of the resamples could be fitted";
    return result;
  }
  const auto summarise = [&](std::vector<double>& values, double centre, Estimate& estimate, Interval& interval) {
    std::sort(values.begin(), values.end());
    double sum = 0.0;
    for (const double value : values) sum += value;
    const double mean = sum / static_cast<double>(values.size());
    double variance = 0.0;
    for (const double value : values) variance += (value - mean) * (value - mean);
    estimate = {centre, std::sqrt(variance / static_cast<double>(values.size() - 1)), false};
    const auto quantile = [&](double fraction) {
      const double position = fraction * static_cast<double>(values.size() - 1);
      const auto i = static_cast<std::size_t>(position);
      const double part = position - static_cast<double>(i);
      return i + 1 < values.size() ? (1.0 - part) * values[i] + part * values[i + 1] : values.back();
    };
    interval.status = FitStatus::ok;
    interval.confidence = bootstrap.confidence;
    // Percentiles, moved apart as Student's are from the normal ones: the blocks are few.
    const double upper = 0.5 * (1.0 + bootstrap.confidence);
    const double apart = gsl_cdf_tdist_Pinv(upper, widening.degrees) / gsl_cdf_ugaussian_Pinv(upper);
    interval.low = centre + apart * (quantile(1.0 - upper) - centre);
    interval.high = centre + apart * (quantile(upper) - centre);
  };
  summarise(temperatures, whole.temperature.value, result.temperature, result.temperature_interval);
  summarise(shifts, whole.shift.value, result.shift, result.shift_interval);
  result.temperatures = std::move(temperatures);
  return result;
}

}  // namespace shakebed::fit
