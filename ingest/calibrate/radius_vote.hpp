#pragma once
// Radii of circles in a picture, by votes of its edges. Every edge pixel votes for a centre one radius along its
// gradient. The radii with the sharpest concentrations of votes are then examined in full.

#include <cstddef>
#include <vector>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

struct CircleSpacing {
  double median = 0, scatter = 0;  // px of the frame
};
struct RadiusCandidate {
  double radius = 0;        // px of the frame
  double sign = 1;          // +1: brighter outwards (dark beads), -1: brighter inwards
  double explained = 0;     // share of all edges that voted for its circles
  double support = 0;       // share of their rims that is seen
  std::size_t count = 0;    // of its circles
  CircleSpacing spacing{};  // of their centres
};

// Circles of both polarities with radii from `from` to `to` px of `frame`, a copy of the picture reduced by `scale`.
struct RadiusRange {
  double from = 0, to = 0;
};
std::vector<RadiusCandidate> vote_for_radii(const GrayFrame& frame, double scale, const RadiusRange& radii);

}  // namespace shakebed::ingest
