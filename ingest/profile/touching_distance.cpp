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
// Of the distance: four drawn beds were off by 0.0 to 0.5 %.
constexpr double least_error = 0.004;

void add_nearest(const FrameFindings& frame, double farthest, std::vector<double>& nearest) {
  std::vector<std::pair<double, double>> places;
  for (const FoundDisk& disk : frame.disks)
    if (!disk.other_size) places.emplace_back(disk.x_px, disk.y_px);
  std::vector<double> least(places.size(), farthest);
  Nearby(places.size(), farthest, [&](std::size_t i) { return places[i]; }).pairs([&](std::size_t i, std::size_t j) {
    const double away = std::hypot(places[i].first - places[j].first, places[i].second - places[j].second);
    least[i] = std::min(least[i], away), least[j] = std::min(least[j], away);
    return false;
  });
  for (const double away : least)
    if (away < farthest) nearest.push_back(away);
}

}  // namespace

std::optional<TouchingDistance> touching_distance(const std::vector<FrameFindings>& frames, double radius_px) {
  std::vector<double> nearest;
  for (const FrameFindings& frame : frames) add_nearest(frame, farthest_radii * radius_px, nearest);
  if (nearest.size() < fewest_distances) return {};
  const auto count = static_cast<double>(nearest.size());
  const double first = quantile(nearest, few), second = quantile(nearest, more);
  if (second > (1 + widest_edge) * first) return {};
  const double at_first = -std::log1p(-few), at_second = -std::log1p(-more);
  const double slope = (second * second - first * first) / (at_second - at_first);
  const double squared = first * first - slope * at_first;
  if (!(squared > 0)) return {};
  const double distance = std::sqrt(squared);
  const double by_chance = 0.5 * slope / distance * std::sqrt(few / count);
  return TouchingDistance{distance, std::hypot(least_error * distance, by_chance)};
}

}  // namespace shakebed::ingest
