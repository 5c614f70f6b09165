#include "ingest/find/beside_beads.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

namespace shakebed::ingest {

namespace {

// Radii of the bead found: a rim that is so near to it is no evidence. Share of the rest in which edges must be met,
// and share of the whole rim that the rest must be.
constexpr double near_rim = 0.12, least_own_support = 0.6, least_open = 0.15;

Nearby near_disks(const std::vector<FoundDisk>& disks) {
  double largest = 1;
  for (const FoundDisk& disk : disks) largest = std::max(largest, disk.radius_px);
  return {disks.size(), 4 * largest, [&](std::size_t i) { return std::pair(disks[i].x_px, disks[i].y_px); }};
}

}  // namespace

BesideBeads::BesideBeads(const std::vector<FoundDisk>& disks) : disks_(disks), near_(near_disks(disks)) {}

bool BesideBeads::overlapped(double x, double y, double radius) const {
  return near_.any_near(x, y, [&](std::size_t i) {
    return std::hypot(disks_[i].x_px - x, disks_[i].y_px - y) < nearest_free_centres * (disks_[i].radius_px + radius);
  });
}

bool BesideBeads::beside_rims(double x, double y) const {
  return !near_.any_near(x, y, [&](std::size_t i) {
    return std::hypot(disks_[i].x_px - x, disks_[i].y_px - y) < (1 + near_rim) * disks_[i].radius_px;
  });
}

bool BesideBeads::has_own_rim(const Circle& circle) const {
  int open = 0, met = 0;
  for (int k = 0; k < circle.directions; ++k) {
    const double angle = 2 * std::numbers::pi * k / circle.directions;
    const double x = circle.x + circle.radius * std::cos(angle), y = circle.y + circle.radius * std::sin(angle);
    if (!beside_rims(x, y)) continue;
    ++open;
    met += static_cast<int>(circle.met >> static_cast<unsigned>(k) & 1U);
  }
  return open >= least_open * circle.directions && met >= least_own_support * open;
}

}  // namespace shakebed::ingest
