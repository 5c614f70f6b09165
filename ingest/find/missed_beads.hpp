#pragma once
// How many beads are missed. A search for round rims cannot tell this itself.
//
// Counted are places beside the disks found in which a bead fits, and which edges fill as they fill a bead. A perfect
// search leaves voids, where no bead fits, and background, where no edges are. Straight edges of a container fill too
// few of a place's directions. Other things fill places by chance, too. Their edges are fainter than rims, or do not
// lie along one. So a place counts as far as it shows a rim as the beads found do.

#include <cstddef>
#include <optional>
#include <vector>

#include "ingest/find/rim_finder.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// like_beads: as said above. fully: all alike, which says how much a search left that could be beads.
enum class PlacesCount { like_beads, fully };

// In the frame, or in this region of it; `found` in px of the frame. Places of 0.6, 0.8 and 1 of the model's radius are
// looked for, and count by their areas as well.
double expected_missed_beads(const GrayFrame& frame, const RimModel& model, const std::vector<Circle>& found,
                             const std::optional<PixelRectangle>& region);
// The same with maps of quick_search.
double expected_missed_beads(PictureMaps& maps, const RimModel& model, const std::vector<Circle>& found,
                             const std::optional<PixelRectangle>& region, PlacesCount count = PlacesCount::like_beads);

// Of all beads, the share of those missed.
double share_of_missed(double missed, std::size_t found);

}  // namespace shakebed::ingest
