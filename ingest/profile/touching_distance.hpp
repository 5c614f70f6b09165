#pragma once
// The distance of touching beads, which is their diameter, from the centres alone.

#include <optional>
#include <vector>

#include "ingest/profile/frame_findings.hpp"

namespace shakebed::ingest {

struct TouchingDistance {
  double px = 0, std_error_px = 0;
  bool sharp = false;  // else the diameter may be larger: beads behind one another come nearer than they touch
};

// Where the distances of nearest neighbours begin, in the film's first rim_frames frames, as the radius of the rims.
// Nearest distances r of hard disks at random are spread so that -ln(1 - share) grows in proportion to r^2 - D^2. The
// line through the shares of 5 % and 20 % ends at D, less what the stated errors of the centres take from the least
// distances. Nothing where there are fewer than 100 distances, or where they do not begin with an edge.
std::optional<TouchingDistance> touching_distance(const std::vector<FrameFindings>& frames, double radius_px);

}  // namespace shakebed::ingest
