#include "ingest/find/candidates.hpp"

#include <algorithm>
#include <cmath>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/frames/smooth_field.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

// The frame from which the map is made: reduced, and smoothed where it is noisy and the disks are wide enough.
GrayFrame map_frame(const GrayFrame& flat, double radius, double noise) {
  const int factor = map_reduction(radius);
  constexpr double noisy = 0.04;  // contrast units, after reduction
  if (noise / factor < noisy || radius / factor < 3.5) return reduced(flat, factor);
  return smoothed(reduced(flat, factor));
}

// A bead that hardly differs from the background over much of its area, of glass say, is nothing like an ideal disk.
bool hollow(const BeadProfile& profile, double radius) {
  constexpr double well_filled = 0.5;
  double sum = 0, area = 0, most = 0;
  for (std::size_t k = 0; k < profile.level.size(); ++k) {
    const double r = static_cast<double>(k) * profile.step_px;
    if (r > radius) break;
    sum += r * static_cast<double>(profile.level[k]);
    area += r;
    most = std::max(most, static_cast<double>(profile.level[k]));
  }
  return sum < well_filled * most * area;
}

// Sizes of the residual at some 20,000 pixels.
std::vector<float> residual_sizes(const JointFit& fit) {
  std::vector<float> sizes;
  const std::size_t total = static_cast<std::size_t>(fit.width()) * static_cast<std::size_t>(fit.height());
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(total) / 20000)));
  for (int row = 0; row < fit.height(); row += step)
    for (int column = (row / step) % 2; column < fit.width(); column += step)
      if (!unseen(fit.residual(column, row))) sizes.push_back(std::abs(fit.residual(column, row)));
  return sizes;
}

}  // namespace

std::vector<DiskCandidate> seen_ones(const GrayFrame& flat, std::vector<DiskCandidate> candidates) {
  std::erase_if(candidates, [&](const DiskCandidate& candidate) {
    const int column = static_cast<int>(std::lround(candidate.x)), row = static_cast<int>(std::lround(candidate.y));
    return column >= 0 && row >= 0 && column < flat.width && row < flat.height && unseen(flat.at(column, row));
  });
  return candidates;
}

double noise_of(const GrayFrame& flat) {
  std::vector<float> sizes;
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(flat.pixels.size()) / 20000)));
  for (int row = 0; row < flat.height; row += step)
    for (int column = 1; column + 1 < flat.width; column += step)
      if (!unseen(flat.at(column - 1, row) + flat.at(column, row) + flat.at(column + 1, row)))
        sizes.push_back(std::abs(flat.at(column - 1, row) - 2 * flat.at(column, row) + flat.at(column + 1, row)));
  return 1.4826 * static_cast<double>(median_of(std::move(sizes))) / std::sqrt(6.0);
}

double residual_spread(const JointFit& fit) { return 1.4826 * static_cast<double>(median_of(residual_sizes(fit))); }

double residual_noise(const JointFit& fit) {
  std::vector<float> sizes = residual_sizes(fit);
  if (sizes.size() < 2) return 0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  double sum = 0;
  for (auto at = sizes.begin(); at != middle; ++at) sum += static_cast<double>(*at);
  constexpr double of_normal_law = 0.32465;  // mean size of the smaller half, 4 (phi(0) - phi(0.6745)), for one of 1
  return sum / static_cast<double>(sizes.size() / 2) / of_normal_law;
}

std::vector<DiskCandidate> candidates_in(const GrayFrame& flat, double radius, double noise, double score) {
  return seen_ones(flat, find_candidates({map_frame(flat, radius, noise), map_reduction(radius)}, radius,
                                         {score, 2 * radius * least_separation}));
}

std::vector<DiskCandidate> candidates_by(const KnownBead& bead, const GrayFrame& flat, double noise, double score) {
  const double radius = bead.radius_px;
  if (bead.edge_px < strong_blur * radius && !hollow(bead.profile, radius))
    return candidates_in(flat, radius, noise, score);
  const int factor = map_reduction(radius);
  return seen_ones(flat, find_matched_candidates({reduced(flat, factor), factor}, bead.profile, radius, noise,
                                                 {score, 2 * radius * least_separation}));
}

}  // namespace shakebed::ingest
