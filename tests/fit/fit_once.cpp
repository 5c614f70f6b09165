// Reads "phi_0 low high" and then lines "height density error" from stdin, fits Enskog's curve over the rectangle (T
// and shift free) 200 times, prints T, its error, shift, its error and the median time of a fit in seconds, 17 digits
// each. The other side of compare_with_peers.py.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "fit/profile_fit/fit_profile.hpp"

int main() {
  using namespace shakebed::fit;
  Profile profile;
  FitOptions options;
  double low = 0, high = 0, height = 0, density = 0, error = 0;
  if (std::scanf("%lf %lf %lf", &options.plateau_density, &low, &high) != 3) return 2;
  while (std::scanf("%lf %lf %lf", &height, &density, &error) == 3) {
    profile.height.push_back(height);
    profile.number_density.push_back(density);
    profile.std_error.push_back(error);
  }
  options.window.low = low, options.window.high = high;
  options.interval = options.sweep = options.compare = false;
  options.curve_points = 0;
  std::vector<double> seconds;
  FitResult fit;
  for (int i = 0; i < 200; ++i) {
    const auto start = std::chrono::steady_clock::now();
    fit = fit_profile(profile, options);
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(seconds.begin(), seconds.end());
  std::printf("%.17g %.17g %.17g %.17g %.6g\n", fit.temperature.value, fit.temperature.std_error, fit.shift.value,
              fit.shift.std_error, seconds[seconds.size() / 2]);
  if (!fit.ok()) std::fprintf(stderr, "%s\n", fit.message.c_str());
  return fit.ok() ? 0 : 1;
}
