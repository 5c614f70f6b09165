#include "fit/profile_fit/side_walls.hpp"

#include <algorithm>
#include <cmath>

#include "fit/theory/equation_of_state.hpp"

namespace shakebed::fit {

namespace {

// A wall has no depletion where no room is left.
double packing(double density) { return std::clamp(area_fraction(density), 0.0, 1.0); }

// What both walls take, as a part of the average: (1 - eta)/(1 + eta) D/W; and its product with the density,
// differentiated by the density.
double depletion(double density, double width) {
  const double eta = packing(density);
  return (1.0 - eta) / ((1.0 + eta) * width);
}
double depletion_slope(double density, double width) {
  const double eta = packing(density);
  return ((1.0 - eta) / (1.0 + eta) - 2.0 * eta / ((1.0 + eta) * (1.0 + eta))) / width;
}

double area(const std::vector<double>& height, const std::vector<double>& density) {
  double sum = 0.0;
  for (std::size_t i = 1; i < height.size(); ++i)
    sum += 0.5 * (density[i] + density[i - 1]) * (height[i] - height[i - 1]);
  return sum;
}

}  // namespace

double density_far_from_walls(double averaged, double width) {
  // The average grows with the density, by at least 1 - 1/width: Newton's steps from the average converge for boxes
  // that hold a disk.
  double density = averaged;
  for (int step = 0; step < 20; ++step) {
    const double miss = density * (1.0 - depletion(density, width)) - averaged;
    const double change = miss / (1.0 - depletion_slope(density, width));
    density -= change;
    if (std::abs(change) <= 1e-15 * std::abs(density)) break;
  }
  return density;
}

void take_far_from_walls(Profile& profile, double width, std::optional<double>& column_number) {
  const std::size_t n = profile.number_density.size();
  if (!(width > 1.0) || profile.height.size() != n) return;  // fit_profile() says what is wrong
  std::vector<double> density(n), slope(n);
  for (std::size_t i = 0; i < n; ++i) {
    density[i] = density_far_from_walls(profile.number_density[i], width);
    slope[i] = 1.0 / (1.0 - depletion_slope(density[i], width));
  }
  if (const double before = area(profile.height, profile.number_density); column_number && before > 0.0)
    *column_number *= area(profile.height, density) / before;
  profile.number_density = std::move(density);
  for (std::size_t i = 0; i < std::min(n, profile.std_error.size()); ++i) profile.std_error[i] *= slope[i];
  if (profile.covariance.size() != n * n) return;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) profile.covariance[i * n + j] *= slope[i] * slope[j];
}

}  // namespace shakebed::fit
