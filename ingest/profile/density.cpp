#include "ingest/profile/density.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "ingest/frames/atomic_file.hpp"
#include "statistics/correlated_series.hpp"

namespace shakebed::ingest {

std::vector<double> density_of_frame(std::span<const double> heights, double bed_width, const HeightBins& bins,
                                     const Kernel& kernel) {
  if (!(bed_width > 0) || !(bins.width > 0) || !(kernel.width > 0))
    throw std::invalid_argument("density_of_frame: bed width, bin width and kernel width must be positive");
  std::vector<double> density(bins.count, 0.0);
  std::vector<double> known;
  std::copy_if(heights.begin(), heights.end(), std::back_inserter(known), [](double z) { return std::isfinite(z); });
  add_density({bins.middle(0), bins.width, bins.count}, kernel, bed_width, known, 0, density);
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
    if (frame.size() != bins.count)
      throw std::invalid_argument("average_profile: the frames have different numbers of bins");
    for (std::size_t bin = 0; bin < bins.count; ++bin) profile.number_density[bin] += frame[bin] / n;
  }
  for (std::size_t bin = 0; bin < bins.count; ++bin)
    profile.area_fraction[bin] = 0.25 * std::numbers::pi * profile.number_density[bin];

  // The bed's height oscillates and has the longest correlation time. A fitted temperature depends on it.
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
    if (frames == 1) variance = std::max(profile.number_density[bin], 0.0) * kernel_density(kernel, 0);
    // A bin in which hardly any bead was seen is still uncertain by about one bead in all frames. The bed's width is
    // contained in `densities`, so the smallest step seen in a bin is the share of one bead.
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
