#include "ingest/density.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "ingest/atomic_file.hpp"
#include "statistics/correlated_series.hpp"

namespace shakebed::ingest {

namespace {

// Height of the kernel at a distance from its middle, 1/D. Area 1.
double kernel_value(const Kernel& kernel, double distance) {
  const double size = std::abs(distance);
  switch (kernel.kind) {
    case KernelKind::top_hat:
      return size < 0.5 * kernel.width ? 1 / kernel.width : 0;
    case KernelKind::gaussian:
      return std::exp(-0.5 * size * size / (kernel.width * kernel.width)) /
             (kernel.width * std::sqrt(2 * std::numbers::pi));
    case KernelKind::disk_chord: {
      const double radius = 0.5 * kernel.width;
      return size < radius ? 2 * std::sqrt(radius * radius - size * size) / (std::numbers::pi * radius * radius) : 0;
    }
  }
  return 0;
}

double kernel_reach(const Kernel& kernel) {
  return kernel.kind == KernelKind::gaussian ? 6 * kernel.width : 0.5 * kernel.width;
}

// Ratio of the variance of the mean from blocks of `length` to the naive one, averaged over the series given.
struct BlockStatistics {
  double ratio = 1;
  std::size_t blocks = 0;
};

BlockStatistics block_statistics(const std::vector<std::vector<double>>& series_by_bin,
                                 const std::vector<double>& naive, std::size_t length) {
  BlockStatistics statistics;
  double sum = 0;
  std::size_t counted = 0;
  for (std::size_t bin = 0; bin < series_by_bin.size(); ++bin) {
    const auto& series = series_by_bin[bin];
    const std::size_t blocks = series.size() / length;
    statistics.blocks = blocks;
    if (blocks < 2 || !(naive[bin] > 0)) continue;
    double mean = 0, square = 0;
    for (std::size_t b = 0; b < blocks; ++b) {
      double block = 0;
      for (std::size_t k = 0; k < length; ++k) block += series[b * length + k];
      block /= static_cast<double>(length);
      mean += block;
      square += block * block;
    }
    const double n = static_cast<double>(blocks);
    mean /= n;
    const double variance = std::max(0.0, (square / n - mean * mean)) * n / (n - 1) / n;
    sum += variance / naive[bin];
    ++counted;
  }
  if (counted) statistics.ratio = sum / static_cast<double>(counted);
  return statistics;
}

// The block length from which on the error no longer grows beyond its own uncertainty, and the inflation there.
struct Plateau {
  std::size_t length = 1;
  double inflation = 1;
};
Plateau find_plateau(const std::vector<std::vector<double>>& series_by_bin, const std::vector<double>& naive) {
  Plateau plateau;
  if (series_by_bin.empty() || series_by_bin.front().size() < 8) return plateau;
  const std::size_t frames = series_by_bin.front().size();
  // Bins are correlated among themselves: count them as the number of heights that differ, about a fifth.
  const double independent_bins = std::max(1.0, static_cast<double>(series_by_bin.size()) / 5);
  double best = 1;
  for (std::size_t length = 2; frames / length >= 4; length *= 2) {
    const BlockStatistics statistics = block_statistics(series_by_bin, naive, length);
    const double uncertainty = std::sqrt(2.0 / (static_cast<double>(statistics.blocks - 1) * independent_bins));
    if (statistics.ratio > best * (1 + uncertainty)) {
      best = statistics.ratio;
      plateau.length = length;
    } else if (statistics.ratio < best) {
      break;
    }
  }
  plateau.inflation = best;
  return plateau;
}

// The variance of the mean of a series that remembers.
double variance_of_mean(std::vector<double> series) {
  const double n = static_cast<double>(series.size());
  series = statistics::from_mean(std::move(series));
  double variance = 0;
  for (const double value : series) variance += value * value;
  const double independent = variance / (n - 1) / n;
  if (series.size() < 24 || !(variance > 0)) return independent;
  const double memory = statistics::memory_of(series);
  if (memory < statistics::least_memory) return independent;
  const auto found = statistics::corrected_variance(series, statistics::half_window(memory, series.size()));
  return found.variance * found.correction;
}

}  // namespace

std::vector<double> density_of_frame(std::span<const double> heights, double bed_width, const HeightBins& bins,
                                     const Kernel& kernel) {
  if (!(bed_width > 0) || !(bins.width > 0) || !(kernel.width > 0))
    throw std::invalid_argument("density_of_frame: bed width, bin width and kernel width must be positive");
  std::vector<double> density(bins.count, 0.0);
  const double reach = kernel_reach(kernel);
  const double last = static_cast<double>(bins.count) - 1;
  for (const double height : heights) {
    if (!std::isfinite(height)) continue;
    const double low = std::ceil((height - reach - bins.lowest) / bins.width - 0.5);
    const double high = std::floor((height + reach - bins.lowest) / bins.width - 0.5);
    if (high < 0 || low > last) continue;
    if (kernel.kind == KernelKind::top_hat && std::abs(kernel.width - bins.width) < 1e-12 * bins.width) {
      const double place = std::floor((height - bins.lowest) / bins.width);  // each centre in one bin exactly
      if (place >= 0 && place <= last) density[static_cast<std::size_t>(place)] += 1 / bins.width;
      continue;
    }
    const auto first = static_cast<std::size_t>(std::max(0.0, low)),
               end = static_cast<std::size_t>(std::min(last, high)) + 1;
    for (std::size_t bin = first; bin < end; ++bin) density[bin] += kernel_value(kernel, bins.middle(bin) - height);
  }
  for (double& value : density) value /= bed_width;
  return density;
}

DensityProfile average_profile(const std::vector<std::vector<double>>& densities, const HeightBins& bins,
                               const Kernel& kernel, double scale_relative_std_error) {
  DensityProfile profile;
  profile.bins = bins;
  profile.kernel = kernel;
  profile.samples = densities.size();
  profile.number_density.assign(bins.count, 0.0);
  profile.std_error.assign(bins.count, 0.0);
  profile.area_fraction.assign(bins.count, 0.0);
  profile.covariance.assign(bins.count * bins.count, 0.0);
  const std::size_t frames = densities.size();
  if (frames == 0 || bins.count == 0) return profile;
  const double n = static_cast<double>(frames);
  for (const auto& frame : densities) {
    if (frame.size() != bins.count) throw std::invalid_argument("average_profile: a frame has another number of bins");
    for (std::size_t bin = 0; bin < bins.count; ++bin) profile.number_density[bin] += frame[bin] / n;
  }
  for (std::size_t bin = 0; bin < bins.count; ++bin)
    profile.area_fraction[bin] = 0.25 * std::numbers::pi * profile.number_density[bin];

  // Correlation between bins from single frames; the errors' size from blocks.
  std::vector<double> single(bins.count * bins.count, 0.0);
  for (const auto& frame : densities)
    for (std::size_t a = 0; a < bins.count; ++a) {
      const double from_mean = frame[a] - profile.number_density[a];
      if (from_mean == 0) continue;
      for (std::size_t b = 0; b <= a; ++b)
        single[a * bins.count + b] += from_mean * (frame[b] - profile.number_density[b]);
    }
  std::vector<double> naive(bins.count, 0.0);
  if (frames > 1)
    for (std::size_t bin = 0; bin < bins.count; ++bin) naive[bin] = single[bin * bins.count + bin] / (n - 1) / n;
  std::vector<std::vector<double>> series(bins.count, std::vector<double>(frames));
  for (std::size_t f = 0; f < frames; ++f)
    for (std::size_t bin = 0; bin < bins.count; ++bin) series[bin][f] = densities[f][bin];
  const Plateau common = find_plateau(series, naive);
  profile.block_frames = common.length;
  profile.correlation_frames = common.inflation;
  profile.independent_blocks = std::max<std::size_t>(1, static_cast<std::size_t>(n / common.inflation));
  for (std::size_t bin = 0; bin < bins.count; ++bin) {
    double inflation = common.inflation;
    if (common.length > 1) {  // a bin's own correlation where it is longer than the common one
      const BlockStatistics own = block_statistics({series[bin]}, {naive[bin]}, common.length);
      inflation = std::max(inflation, own.ratio);
    }
    // A bin in which hardly anything was ever seen still is uncertain by about one bead in all frames.
    const double typical_weight = kernel_value(kernel, 0);
    double variance = naive[bin] * inflation;
    if (frames == 1) variance = std::max(profile.number_density[bin], 0.0) * typical_weight;
    // `densities` carry the bed's width; the smallest step seen in a bin tells one bead's share.
    double step = 0;
    for (std::size_t f = 0; f < frames; ++f)
      if (series[bin][f] > 0 && (step == 0 || series[bin][f] < step)) step = series[bin][f];
    const double floor_error = step > 0 ? step / n : 0;
    if (variance < floor_error * floor_error) variance = floor_error * floor_error;
    profile.std_error[bin] = std::sqrt(variance);
  }
  for (std::size_t a = 0; a < bins.count; ++a)
    for (std::size_t b = 0; b <= a; ++b) {
      const double scale = std::sqrt(single[a * bins.count + a] * single[b * bins.count + b]);
      const double correlation = a == b ? 1.0 : scale > 0 ? single[a * bins.count + b] / scale : 0.0;
      const double covariance = correlation * profile.std_error[a] * profile.std_error[b];
      profile.covariance[a * bins.count + b] = profile.covariance[b * bins.count + a] = covariance;
    }
  // The bed's height, which breathes, remembers longer than most bins do, and a temperature hangs on it: where its mean
  // is known worse than the bins say, what moves together with it is made larger to fit.
  std::vector<double> height(frames, 0.0), with_height(bins.count, 0.0);
  double known = 0;
  for (std::size_t a = 0; a < bins.count; ++a) {
    for (std::size_t f = 0; f < frames; ++f) height[f] += bins.middle(a) * series[a][f];
    for (std::size_t b = 0; b < bins.count; ++b)
      with_height[a] += profile.covariance[a * bins.count + b] * bins.middle(b);
    known += bins.middle(a) * with_height[a];
  }
  const double missing = frames > 1 && known > 0 ? std::max(variance_of_mean(height) / known - 1, 0.0) / known : 0.0;
  for (std::size_t a = 0; a < bins.count; ++a)
    for (std::size_t b = 0; b < bins.count; ++b)
      profile.covariance[a * bins.count + b] +=
          missing * with_height[a] * with_height[b] + 4 * scale_relative_std_error * scale_relative_std_error *
                                                          profile.number_density[a] * profile.number_density[b];
  for (std::size_t bin = 0; bin < bins.count; ++bin)
    profile.std_error[bin] = std::sqrt(profile.covariance[bin * bins.count + bin]);
  return profile;
}

BlockedError blocked_error(std::span<const double> series) {
  BlockedError result;
  if (series.empty()) return result;
  const double n = static_cast<double>(series.size());
  for (const double value : series) result.mean += value / n;
  if (series.size() < 2) return result;
  double square = 0;
  for (const double value : series) square += (value - result.mean) * (value - result.mean);
  const double naive = square / (n - 1) / n;
  const Plateau plateau = find_plateau({std::vector<double>(series.begin(), series.end())}, {naive});
  result.std_error = std::sqrt(naive * plateau.inflation);
  result.block_length = plateau.length;
  return result;
}

void write_profile_csv(const std::filesystem::path& path, const DensityProfile& profile,
                       const std::vector<std::string>& comments) {
  std::string text;
  for (const std::string& comment : comments) text += "# " + comment + "\n";
  text += "height,number_density,std_error,area_fraction,samples\n";
  char line[256];
  for (std::size_t bin = 0; bin < profile.bins.count; ++bin) {
    std::snprintf(line, sizeof line, "%.17g,%.17g,%.17g,%.17g,%zu\n", profile.bins.middle(bin),
                  profile.number_density[bin], profile.std_error[bin], profile.area_fraction[bin], profile.samples);
    text += line;
  }
  write_file_atomically(path, text);
}

}  // namespace shakebed::ingest
