#include "ingest/find/laid_disks.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/candidates.hpp"
#include "ingest/find/disk_pixels.hpp"
#include "ingest/find/nearby.hpp"

namespace shakebed::ingest {

namespace {

// Shares of the sum of two radii, and score in the map: ideal disks are laid no nearer to one another, the best first.
// Places in the map are good to a tenth of a radius.
constexpr double least_laid_distance = 0.85, least_laid_score = 0.5;

}  // namespace

GrayFrame without_beads(GrayFrame frame, const KnownPlaces& places, double margin_px) {
  for (const KnownPlace& place : places)
    for_pixels_within(frame, place.x, place.y, place.radius + margin_px,
                      [&](std::size_t pixel, double, double) { frame.pixels[pixel] = unseen_level; });
  return frame;
}

LaidDisks lay_disks(const GrayFrame& flat, double large_px, double small_px) {
  struct Candidate {
    KnownPlace place;
    double score = 0;
  };
  std::vector<Candidate> candidates;
  const double noise = noise_of(flat);
  for (const double radius : {large_px, small_px})
    for (const DiskCandidate& one : candidates_in(flat, radius, noise, least_laid_score))
      candidates.push_back({{one.x, one.y, radius}, one.score});
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& one, const Candidate& other) { return one.score > other.score; });
  const Nearby near(candidates.size(), 2 * large_px * least_laid_distance,
                    [&](std::size_t i) { return std::pair(candidates[i].place.x, candidates[i].place.y); });
  std::vector<char> dropped(candidates.size(), 0);
  LaidDisks laid;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (dropped[i]) continue;
    const KnownPlace& one = candidates[i].place;
    (one.radius == large_px ? laid.large : laid.small).push_back(one);
    near.any_near(one.x, one.y, [&](std::size_t k) {
      const KnownPlace& other = candidates[k].place;
      if (k > i && std::hypot(other.x - one.x, other.y - one.y) < least_laid_distance * (one.radius + other.radius))
        dropped[k] = 1;
      return false;
    });
  }
  return laid;
}

double squares_left(const GrayFrame& flat, const LaidDisks& laid) {
  std::vector<float> model(flat.pixels.size(), 0.0F);
  for (const KnownPlaces* places : {&laid.large, &laid.small})
    for (const KnownPlace& place : *places)
      for_pixels_within(flat, place.x, place.y, place.radius,
                        [&](std::size_t pixel, double, double) { model[pixel] = 1; });
  double squares = 0, count = 0;
  for (std::size_t k = 0; k < model.size(); ++k) {
    if (unseen(flat.pixels[k])) continue;
    const double gap = static_cast<double>(std::clamp(flat.pixels[k], -0.6F, 1.6F) - model[k]);
    squares += gap * gap;
    ++count;
  }
  return squares / std::max(1.0, count);
}

void share_camera(FinderCalibration& large, FinderCalibration& small) {
  const bool by_large = large.radius_std_error_px < small.radius_std_error_px;
  const FinderCalibration& sure = by_large ? large : small;
  FinderCalibration& other = by_large ? small : large;
  other.radius_px = other.rim_radius_px + sure.radius_px - sure.rim_radius_px;
  other.radius_std_error_px = sure.radius_std_error_px;
  other.tone_exponent = sure.tone_exponent;
  other.radius_of_all_rims = false;
}

}  // namespace shakebed::ingest
