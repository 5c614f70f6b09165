#pragma once
// Beads that are known by where they are: circles beside beads already found, which overlap none of them.
//
// Chance makes up circles everywhere, but beads lie beside beads. Few places remain beside the beads found. There a
// partly visible rim is more likely a bead's than it is elsewhere. How much more follows from copies of the picture,
// searched at the same places, as in the first search (rim_probability.hpp). Other sizes are searched too. A size that
// many beads share is searched by itself, where chance makes up less; then what is left, a spread of sizes.

#include <vector>

#include "ingest/find/picture_maps.hpp"
#include "ingest/find/rim_finder.hpp"

namespace shakebed::ingest {

constexpr double faintest_rim_support = 0.3;  // share of a rim from which a circle is fitted

struct GapCircle {
  Circle circle;  // px of the frame
  double probability = 0;
  const SizeBand* size = nullptr;  // unless that of the others
};
struct GapCircles {
  std::vector<GapCircle> circles;
  double expected_missed = 0;          // sum of the probabilities of those that are too unlikely to be reported
  std::vector<std::size_t> displaced;  // beads in whose place one of another size is far better seen
};

// `beads`: those found at first, px of the frame.
GapCircles circles_in_gaps(PictureMaps& maps, const std::vector<Circle>& beads, const RimModel& model);

// The probabilities for such circles, learned from the picture and its copies.
GapModel chances_in_gaps(PictureMaps& maps, const std::vector<Circle>& beads, const RimModel& model, bool one_size);

}  // namespace shakebed::ingest
