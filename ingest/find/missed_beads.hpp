#pragma once
// How many beads are missed that a search for round rims cannot show: places where a bead fits beside the disks found,
// and which edges fill as they fill a bead.
//
// A perfect search leaves voids, where no bead fits, and background, where no edges are. Straight edges of a container
// are too short within a bead's outline to count.

#include <optional>
#include <vector>

#include "ingest/find/rim_finder.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// In the frame, or in this region of it; `found` in px of the frame. A place as small as 0.6 of the model's radius
// counts as one bead.
double expected_missed_beads(const GrayFrame& frame, const RimModel& model, const std::vector<Circle>& found,
                             const std::optional<PixelRectangle>& region);

}  // namespace shakebed::ingest
