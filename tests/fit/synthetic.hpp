#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "fit/profile_fit/fit_profile.hpp"
#include "fit/theory/hydrostatic_profile.hpp"

// Profiles whose truth is known: a model curve through a kernel, with normal noise of a stated size.
namespace shakebed::fit::synthetic {

// The noise of a bin: like the square root of the number of disks in it.
inline double bin_error(double density, double noise) { return noise * std::sqrt(std::abs(density) + 1e-4); }

// Normal numbers that are the same on every platform (Box-Muller on a 64-bit generator).
class Normal {
 public:
  explicit Normal(std::uint64_t seed) : generator_(seed) {}
  double operator()() {
    const double u = (static_cast<double>(generator_() >> 11) + 0.5) * 0x1p-53;
    const double v = (static_cast<double>(generator_() >> 11) + 0.5) * 0x1p-53;
    return std::sqrt(-2.0 * std::log(u)) * std::cos(6.283185307179586477 * v);
  }

 private:
  std::mt19937_64 generator_;
};

inline Profile profile_of(const HydrostaticProfile& truth, const Kernel& kernel, int bins, double top, double noise,
                          std::uint64_t seed) {
  Profile profile;
  for (int i = 0; i < bins; ++i) profile.height.push_back(top * (i + 0.5) / bins);
  profile.number_density.resize(profile.height.size());
  truth.sample(profile.height, kernel, profile.number_density);
  Normal normal(seed);
  for (double& density : profile.number_density) {
    const double error = bin_error(density, noise);
    profile.std_error.push_back(error);
    density += error * normal();
  }
  return profile;
}

// A covariance of its errors alone, as if `samples` had given it.
inline void take_errors_for_covariance(Profile& profile, int samples) {
  const std::size_t n = profile.height.size();
  profile.covariance.assign(n * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) profile.covariance[i * n + i] = profile.std_error[i] * profile.std_error[i];
  profile.covariance_samples = samples;
}

// The height above which next to nothing is left.
inline double top_of(const HydrostaticProfile& truth) {
  double height = truth.top_of_solid();
  while (truth.density(height) > 1e-4) height += 0.25 + 0.1 * truth.temperature();
  return height + 1.0;
}

}  // namespace shakebed::fit::synthetic
