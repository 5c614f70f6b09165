#pragma once
// Disks of two radii laid where a flattened frame looks like them.

#include <vector>

#include "ingest/find/find_disks.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

struct KnownPlace {
  double x = 0, y = 0, radius = 0;  // px
};
using KnownPlaces = std::vector<KnownPlace>;

// The frame of which nothing is seen within `margin_px` of these disks.
GrayFrame without_beads(GrayFrame frame, const KnownPlaces& places, double margin_px);

struct LaidDisks {
  KnownPlaces large, small;
};
// Ideal disks of both radii where the flattened frame looks like them: the most alike first, none nearer to one laid
// before than disks that hardly overlap are.
LaidDisks lay_disks(const GrayFrame& flat, double large_px, double small_px);

// Mean square of what disks of level 1 on 0 leave of a flattened frame, whose levels count from -0.6 to 1.6.
double squares_left(const GrayFrame& flat, const LaidDisks& laid);

// One camera recorded both kinds: what tone curve and blur add to the radius of the rims is the same, and the kind that
// shows it better decides.
void share_camera(FinderCalibration& large, FinderCalibration& small);

}  // namespace shakebed::ingest
