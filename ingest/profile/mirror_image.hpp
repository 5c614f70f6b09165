#pragma once
// The mirror image of a bed in its polished floor: its disks look like beads, and are none.

#include <optional>
#include <vector>

#include "ingest/profile/frame_findings.hpp"

namespace shakebed::ingest {

// The row (y) at which the lowest disks found mirror those above them, px; the median of the frames that show it.
// Nothing unless most frames show it. `frames`: of one bed; a few show it as well as many.
std::optional<double> find_mirror_row(const std::vector<FrameFindings>& frames, double diameter_px);

}  // namespace shakebed::ingest
