#pragma once
// Density against height, from disk centres or from covered area, with honest errors.
//
// Any number of threads may call; values own what they hold.

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "ingest/frames/frames.hpp"
#include "statistics/kernel.hpp"

namespace shakebed::ingest {

// Equal bins from `lowest` upwards, heights in D above the floor.
struct HeightBins {
  double lowest = 0;
  double width = 0.25;
  std::size_t count = 0;
  [[nodiscard]] double middle(std::size_t bin) const { return lowest + (static_cast<double>(bin) + 0.5) * width; }
};

// One frame's number density n D^2 at each bin's middle: the kernel centred there, summed over the heights (D) of the
// centres, divided by the width of the bed (D). A kernel cut by the floor is not renormalised. Returns bins.count
// values.
std::vector<double> density_of_frame(std::span<const double> heights, double bed_width, const HeightBins& bins,
                                     const Kernel& kernel);

// A density profile averaged over frames.
struct DensityProfile {
  HeightBins bins;
  Kernel kernel{KernelKind::top_hat, 0.25};
  std::vector<double> number_density;   // n D^2, one a bin
  std::vector<double> std_error;        // of number_density
  std::vector<double> area_fraction;    // pi/4 n D^2 from centres; covered fraction from coverage
  std::vector<double> covariance;       // bins x bins, row by row, of the mean number_density
  std::size_t samples = 0;              // frames
  double memory_frames = 1;             // frames that tell as much of the bed's height as one independent one
  std::size_t window_frames = 1;        // length of the windows behind the covariance
  std::size_t independent_samples = 0;  // behind the covariance, about
};

// Mean, errors and covariance of per-frame densities that follow one another in time (frames x bins). By windows of
// frames, three correlation times of the bed's height long, but short enough for six of them.
// `scale_relative_std_error` is that of D in px. It is added to the covariance as a common factor (density is
// proportional to D^2).
DensityProfile average_profile(const std::vector<std::vector<double>>& densities, const HeightBins& bins,
                               const Kernel& kernel, double scale_relative_std_error = 0);

// CSV: comment lines starting with '#', then height,number_density,std_error,area_fraction,samples. 17 digits. Atomic.
void write_profile_csv(const std::filesystem::path& path, const DensityProfile& profile,
                       const std::vector<std::string>& comments = {});

}  // namespace shakebed::ingest
