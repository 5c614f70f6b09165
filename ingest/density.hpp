#pragma once
// Density against height, from disk centres or from covered area, with honest errors.

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "ingest/frames.hpp"

namespace shakebed::ingest {

// The window through which heights are seen. Every kernel has area 1.
enum class KernelKind {
  top_hat,     // width = full width
  gaussian,    // width = sigma
  disk_chord,  // the chord of a disk of diameter `width` (1 D: what covered area sees)
};
struct Kernel {
  KernelKind kind = KernelKind::top_hat;
  double width = 0.25;  // D
};

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
  Kernel kernel;
  std::vector<double> number_density;  // n D^2, one a bin
  std::vector<double> std_error;       // of number_density
  std::vector<double> area_fraction;   // pi/4 n D^2 from centres; covered fraction from coverage
  std::vector<double> covariance;      // bins x bins, row by row, of the mean number_density
  std::size_t samples = 0;             // frames
  std::size_t block_frames = 1;        // frames in a block when the errors stopped growing
  double correlation_frames = 1;       // frames that count as one: variance of the mean over naive variance
  std::size_t independent_blocks = 0;  // degrees of freedom of the covariance, about
};

// Mean, errors and covariance of per-frame densities that follow one another in time (frames x bins). Errors are found
// by doubling blocks until they stop growing [FlyvbjergPetersen1989]; where the mean height of the disks remembers
// longer than that, the covariance is made larger along what moves with it. `scale_std_error` is the relative error of
// D in px, added to the covariance as a common factor (density goes as D^2).
DensityProfile average_profile(const std::vector<std::vector<double>>& densities, const HeightBins& bins,
                               const Kernel& kernel, double scale_relative_std_error = 0);

// Standard error of the mean of a correlated series, by blocking; also the block length at the plateau.
struct BlockedError {
  double mean = 0, std_error = 0;
  std::size_t block_length = 1;
};
BlockedError blocked_error(std::span<const double> series);

// CSV: comment lines starting with '#', then height,number_density,std_error,area_fraction,samples. 17 digits. Atomic.
void write_profile_csv(const std::filesystem::path& path, const DensityProfile& profile,
                       const std::vector<std::string>& comments = {});

}  // namespace shakebed::ingest
