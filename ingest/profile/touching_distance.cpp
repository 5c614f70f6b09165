#include "ingest/profile/touching_distance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "ingest/find/nearby.hpp"
#include "ingest/profile/floor.hpp"

namespace shakebed::ingest {

namespace {

constexpr std::size_t fewest_distances = 100;
constexpr double few = 0.05, more = 0.2;  // shares of the distances
constexpr double farthest_radii = 5;
// Of the distance: what lies between the two shares, at most. Of beds simulated at n D^2 of 0.1 and more it is 0.06.
constexpr double widest_edge = 0.1;
// Of the distance: 40 simulated beds located to 0.002 D were off by 0.3 % (root mean square).
constexpr double least_error = 0.004;
// Where beads lie behind one another, or centres are poor, the edge is blurred: the least half per cent of the
// distances lies farther below it than this. Of drawn beds it lies 0.1 to 0.4 % below; of 8 photographs of a channel
// wider than the beads 1.9 %, and the edge is then 5 % below the diameter.
constexpr double least_share = 0.005, sharp_edge = 0.006;
// Centres that are not exact make the least distances smaller, by noise_share times their error s where this is large
// beside noise_small [D]. Forty simulated beds located to 0.002, 0.01 and 0.02 D were 0.17, 1.7 and 4.2 % too small.
constexpr double noise_share = 1.5, noise_small = 0.0035, noise_error = 0.4;

struct NearestDistances {
  std::vector<double> px;
  double variance_px2 = 0, disks = 0;  // of the centres, summed over the disks
};

void add_nearest(const FrameFindings& frame, double farthest, NearestDistances& nearest) {
  std::vector<std::pair<double, double>> places;
  for (const FoundDisk& disk : frame.disks) {
    if (disk.other_size) continue;
    places.emplace_back(disk.x_px, disk.y_px);
    nearest.variance_px2 += 0.5 * (disk.variance_x + disk.variance_y);
    ++nearest.disks;
  }
  std::vector<double> least(places.size(), farthest);
  Nearby(places.size(), farthest, [&](std::size_t i) { return places[i]; }).pairs([&](std::size_t i, std::size_t j) {
    const double away = std::hypot(places[i].first - places[j].first, places[i].second - places[j].second);
    least[i] = std::min(least[i], away), least[j] = std::min(least[j], away);
    return false;
  });
  for (const double away : least)
    if (away < farthest) nearest.px.push_back(away);
}

}  // namespace

std::optional<TouchingDistance> touching_distance(const std::vector<FrameFindings>& frames, double radius_px) {
  NearestDistances nearest;
  for (const FrameFindings& frame : frames)
    if (frame.report.index < rim_frames) add_nearest(frame, farthest_radii * radius_px, nearest);
  if (nearest.px.size() < fewest_distances) return {};
  const auto count = static_cast<double>(nearest.px.size());
  const double first = quantile(nearest.px, few), second = quantile(nearest.px, more);
  if (second > (1 + widest_edge) * first) return {};
  const double at_first = -std::log1p(-few), at_second = -std::log1p(-more);
  const double slope = (second * second - first * first) / (at_second - at_first);
  const double squared = first * first - slope * at_first;
  if (!(squared > 0)) return {};
  const double seen = std::sqrt(squared), by_chance = 0.5 * slope / seen * std::sqrt(few / count);
  const double blur = std::sqrt(2 * nearest.variance_px2 / nearest.disks) / seen;  // of a distance [D]
  const double lost = noise_share * blur * blur / (blur + noise_small);
  const double below = std::max(0.0, 1 - quantile(nearest.px, least_share) / seen);
  const bool sharp = below < sharp_edge;
  return TouchingDistance{
      seen * (1 + lost),
      std::hypot(std::hypot(least_error, sharp ? 0 : 0.5 * below) * seen, by_chance, noise_error * lost * seen), sharp};
}

}  // namespace shakebed::ingest
