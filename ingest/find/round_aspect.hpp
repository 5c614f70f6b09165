#pragma once
// Pixels that are not square, by the directions of edges. The outlines of disks run in all directions alike. A film
// that is stored with pixels wider than high shows ovals, and their edges run along the columns more than along rows.
// Internal to ingest.

#include <optional>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// The width of a pixel over its height with which the edges of a picture would run in all directions alike, as those of
// disks do. Nothing where there are no edges, or where they do not do so for any aspect of 0.4 to 2.5: text, plots,
// walls alone, slanted stripes. Right within 7 % for disks of 24 px that lie apart, at any aspect of 0.55 to 1.8. Light
// from one side makes it wrong by up to a fifth. Blur makes it too near to 1: where beads 16 px wide touch, by up to
// half of its logarithm.
std::optional<double> aspect_for_round_outlines(const GrayFrame& frame);

}  // namespace shakebed::ingest
