#pragma once
// Beads that are about as bright as what is behind them, and that a line along their rims shows: drops, clear disks,
// circles drawn with a pen.

#include <optional>
#include <vector>

#include "ingest/find/circle_search.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

struct LineAtRim {
  double outer_px = 0, std_error_px = 0;  // radius of the line's outer edge, px of the frame
};

// Of circles of about this radius and of this polarity, by the mean level along rays to where no other of the beads is
// near. Dark circles follow the outer edge of a dark line, bright ones its inner edge, those of either sign the outer.
// Nothing where few such rays are seen, or where they show no line. What is inside a line lies between it and what is
// outside, or is nearly as the latter, and the line is seen in all directions alike. Blur moves the edges of a thin
// line apart. This is corrected by what it is in the mean.
std::optional<LineAtRim> line_at_rim(const GrayFrame& frame, const std::vector<Circle>& circles,
                                     const std::vector<Circle>& beads, double radius_px, Polarity polarity);

}  // namespace shakebed::ingest
