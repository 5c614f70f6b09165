#pragma once
// Spheres lit from one side: the circle on which they end.
//
// On the lit side the level changes steeply at the outline. On the other it fades before the outline is reached. So a
// circle through all edges is too small and lies too near to the light. The mean of
// all spheres shows in which directions the edge is steep. The circle through these edges is that of the sphere.

#include <optional>
#include <vector>

#include "ingest/find/circle_search.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

struct LitRim {
  double radius_px = 0;
  double right_px = 0, down_px = 0;  // of its centre from that of the circles
  double steep = 0;                  // share of the turn in which the edge is steep
  double rms_radii = 0;              // of these edges about the circle, radii
};

// Of `circles` that show parts of such spheres, px of the frame. Nothing where the steep edges are less than a third of
// a turn, or lie on no circle. Edges are those of dark beads, or else of bright ones.
std::optional<LitRim> lit_rim_of(const GrayFrame& frame, const std::vector<Circle>& circles, Polarity polarity);

// Of spheres whose lit side is brighter than the background and whose other side is darker: the circle on which both
// sides end. `circles` show either side. Nothing where one of the sides is not seen, both are the same, or they end on
// no circle.
std::optional<LitRim> rim_of_both_sides(const GrayFrame& frame, std::vector<Circle> circles);

}  // namespace shakebed::ingest
