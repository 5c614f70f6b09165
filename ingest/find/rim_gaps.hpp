#pragma once
// Beads that are known by where they are: circles beside beads already found, which overlap none of them.
//
// Chance makes up circles everywhere, but beads lie beside beads. Few places remain beside the beads found. There a
// partly visible rim is more likely a bead's than it is elsewhere. How much more follows from copies of the picture,
// searched at the same places, as in the first search (rim_probability.hpp). Radii of half to twice the beads' are
// searched too: several sizes, or a spread of sizes.

#include <vector>

#include "ingest/find/picture_scale.hpp"
#include "ingest/find/rim_finder.hpp"

namespace shakebed::ingest {

constexpr double faintest_rim_support = 0.3;  // share of a rim from which a circle is fitted

struct GapCircle {
  Circle circle;  // px of the map
  double probability = 0;
  bool other_size = false;
};
struct GapCircles {
  std::vector<GapCircle> circles;
  double expected_missed = 0;  // sum of the probabilities of those that are too unlikely to be reported
};

// `beads`: those found at first, px of the map. `scale`: px of the frame a px of the map.
GapCircles circles_in_gaps(const EdgeMap& edges, const std::vector<Circle>& beads, const RimModel& model, double scale);

// The probabilities for such circles, learned from the picture and its copies.
GapModel chances_in_gaps(const ScaledPicture& at, const std::vector<Circle>& beads, const RimModel& model,
                         bool one_size);

}  // namespace shakebed::ingest
