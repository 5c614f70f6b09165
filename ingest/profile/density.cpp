#include "ingest/profile/density.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "ingest/frames/atomic_file.hpp"
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

  // The bed's height, which breathes, remembers longest, and a temperature hangs on it.
  std::vector<double> height(frames, 0.0);
  for (std::size_t f = 0; f < frames; ++f)
    for (std::size_t bin = 0; bin < bins.count; ++bin) height[f] += bins.middle(bin) * densities[f][bin];
  height = statistics::from_mean(std::move(height));
  const double memory = statistics::memory_of(height);
  profile.memory_frames = std::max(1.0, memory);
  const statistics::Windows windows = statistics::windows_for(memory, height);
  profile.window_frames = windows.length;
  profile.independent_samples = windows.independent;
  profile.covariance = statistics::covariance_by_windows(densities, 0, bins.count, windows);
  for (std::size_t bin = 0; bin < bins.count; ++bin) {
    double& variance = profile.covariance[bin * bins.count + bin];
    if (frames == 1) variance = std::max(profile.number_density[bin], 0.0) * kernel_value(kernel, 0);
    // A bin in which hardly anything was ever seen still is uncertain by about one bead in all frames: `densities`
    // carry the bed's width, the smallest step seen in a bin tells one bead's share.
    double step = 0;
    for (const auto& frame : densities)
      if (frame[bin] > 0 && (step == 0 || frame[bin] < step)) step = frame[bin];
    variance = std::max(variance, (step / n) * (step / n));
  }
  for (std::size_t a = 0; a < bins.count; ++a)
    for (std::size_t b = 0; b < bins.count; ++b)
      profile.covariance[a * bins.count + b] += 4 * scale_relative_std_error * scale_relative_std_error *
                                                profile.number_density[a] * profile.number_density[b];
  for (std::size_t bin = 0; bin < bins.count; ++bin)
    profile.std_error[bin] = std::sqrt(profile.covariance[bin * bins.count + bin]);
  return profile;
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
