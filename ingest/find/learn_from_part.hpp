#pragma once
// Faces of beads in a large frame, learned from the radius that a part of it shows. Rims of spheres lit from one side
// suggest a radius that is far too small. Learning that begins there may have to begin again. In a part this takes
// little time.

#include <vector>

#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/find/find_disks.hpp"

namespace shakebed::ingest {

// As learn_finder(). `beads`: centres of beads that are seen in the last frame, its px. A part is looked at first if
// there is one frame, of a million pixels or more, and options.radius_px is given. Its radius is taken if it is clearly
// another one, of many beads, and the part is explained down to its noise.
CalibrationResult learn_finder_from_part(const std::vector<const GrayFrame*>& frames, const FindOptions& options,
                                         const Places& beads);

}  // namespace shakebed::ingest
