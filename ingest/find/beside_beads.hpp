#pragma once
// Where a frame is free of the beads found.

#include <vector>

#include "ingest/find/circle_search.hpp"
#include "ingest/find/find_disks.hpp"
#include "ingest/find/nearby.hpp"

namespace shakebed::ingest {

// Sums of radii: a bead nearer than that to another overlaps it.
inline constexpr double nearest_free_centres = 0.8;

class BesideBeads {
 public:
  // Refers to the disks.
  explicit BesideBeads(const std::vector<FoundDisk>& disks);
  // Whether a circle is too near to a disk for both to be beads.
  [[nodiscard]] bool overlapped(double x, double y, double radius) const;
  // Whether a place is none of a bead found, nor of its rim.
  [[nodiscard]] bool beside_rims(double x, double y) const;
  // Whether edges that are none of the beads found make up the circle's rim.
  [[nodiscard]] bool has_own_rim(const Circle& circle) const;

 private:
  const std::vector<FoundDisk>& disks_;
  Nearby near_;
};

}  // namespace shakebed::ingest
