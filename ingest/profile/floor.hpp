#pragma once
// Where the floor is, from the disks: a straight line through the bottoms of the lowest, and its motion in a film.

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "ingest/profile/frame_findings.hpp"
#include "ingest/profile/shaking_frequency.hpp"

namespace shakebed::ingest {

double quantile(std::vector<double> values, double fraction);

// A straight line y = offset + slope x.
struct Line {
  double offset = 0, slope = 0;
  double slope_std_error = 0;
  std::pair<double, double> middle;  // of the points
  double middle_std_error = 0;       // of its y
};

// Per column of the frame, the lowest bottom seen in nearly all frames: (x, y), px.
using FloorPoints = std::vector<std::pair<double, double>>;
FloorPoints lowest_points(const std::vector<FrameFindings>& frames, double diameter_px, int width);

// The floor: per column of the frame, the lowest bottom seen in nearly all frames.
Line find_floor(const std::vector<FrameFindings>& frames, double diameter_px, int width);

// The lowest bottom in each column of a frame, a tilt taken out; columns without a bead are left out.
struct LowestBottoms {
  std::size_t frame = 0;
  std::vector<double> y;
};
LowestBottoms lowest_bottoms(const FrameFindings& frame, double slope, double diameter_px, int width);

// How far the lowest beads move up and down between frames, px: the bottom of all columns but one, 5 % to 95 % of the
// frames. Where the floor rests and many beads lie near it, hardly at all.
double bottom_range(const std::vector<FrameFindings>& frames, double slope, double diameter_px, int width);

// Bottom of the bed in a frame: the lowest beads follow the floor, or at least its period.
std::optional<PlaceInFrame> bottom_of(const LowestBottoms& bottoms);

// The floor's motion, y = middle - amplitude sin(2 pi (turns + phase)), from what no bead ever passes.
struct FloorMotion {
  bool known = false;
  double middle = 0, amplitude = 0, phase = 0;
  double middle_std_error = 0;  // by the scatter of the touching beads, and the extrapolation
  double amplitude_std_error = 0;
  std::size_t touching = 0;  // beads
};

// A bottom counts in full while it is below the floor or at most a tolerance above it. The tolerance shrinks, so that
// only the touching beads remain, and the floor is extrapolated to no tolerance. Known only if such beads are seen all
// around the period.
FloorMotion find_floor_motion(const std::vector<LowestBottoms>& frames, double diameter_px, double turns_per_frame);

}  // namespace shakebed::ingest
