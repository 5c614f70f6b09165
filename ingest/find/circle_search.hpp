#pragma once
// Circles in a map of edges. Every edge votes for centres one radius along its gradient. Places with many votes are
// examined along rays, and centre and radius are fitted to the edges met there.

#include <cstdint>
#include <functional>
#include <vector>

#include "ingest/calibrate/calibration.hpp"
#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/find/edge_map.hpp"
#include "ingest/find/picture_scale.hpp"

namespace shakebed::ingest {

struct Circle {
  double x = 0, y = 0, radius = 0;  // px of the map
  double support = 0;               // share of the rim, as far as it is in view, where an edge is met, 0 .. 1
  double scatter = 0;               // rms distance of these edges from the circle, radii
  double contrast = 0;              // median step across the rim, grey levels
  int rays = 0;                     // directions looked along, within view
  int directions = 0;               // directions in all, and in which an edge was met, a bit each:
  std::uint64_t met = 0;
};
// px of the picture; px of the frame that it shows.
Circle on_the_map(Circle circle, const ScaledPicture& at);
Circle in_the_frame(Circle circle, const ScaledPicture& at);
// Px of a frame that is reduced by averaging (frames/smooth_field.hpp); and the centres there.
Circle in_reduced_frame(Circle circle, int reduction);
Places places_of(const std::vector<Circle>& circles, int reduction = 1);

// Ratio of the axes of the stretched copies that tell what chance makes up: no bead's rim is round any more, textures
// look much as before. At 1.4 a quarter of the white beads of a photograph (radius 7 px) still passed, at 1.8 a tenth.
inline constexpr double decoy_stretch = 1.8;

struct RimRays {
  int count = 32;
  double reach = 0.2;       // radii, how far from the rim an edge is first looked for
  double tolerance = 0.07;  // radii, how far from it an edge may lie in the end (at least 0.6 px)
  // An edge counts for centre and radius if its slope is at least this share of the median slope. Where beads touch,
  // their rims merge: they are faint and seem to lie farther in. 0: all edges count alike.
  double faint = 0;
};

// The circle nearest to `start` through edges of this polarity, or of both where it is `automatic`; its support is 0
// when there is none.
Circle fit_circle(const EdgeMap& edges, const Circle& start, Polarity polarity, const RimRays& rays = {});

// Median distance of the edges from the centre of a fitted circle in those of its directions that are `open` (a bit
// each); 0 when fewer than `fewest` are met.
double radius_towards(const EdgeMap& edges, const Circle& circle, Polarity polarity, std::uint64_t open, int fewest);

// How places of circles are voted for.
struct CircleVotes {
  double radius_ratio = 1.09;  // of one radius voted for to the next: what a peak is wide
  double least = 0.3;          // share of the rim that must vote for a place
};

// Circles that are looked for.
struct CirclesAsked {
  double from_px = 0, to_px = 0;  // radii, of the map
  Polarity polarity = Polarity::automatic;
  double least_support = 0;
  CircleVotes votes{};
  std::function<bool(const Circle&)> leave_out{};  // places, with the radius voted for, that need not be looked at
};
// Each radius by itself: one circle can be found from several radii (see without_doubles).
std::vector<Circle> find_circles(const EdgeMap& edges, const CirclesAsked& asked);

// Of circles nearer to one another than `share` of their radii's sum, the better supported one.
std::vector<Circle> without_doubles(std::vector<Circle> circles, double share);

}  // namespace shakebed::ingest
