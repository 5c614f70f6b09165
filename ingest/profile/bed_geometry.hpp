#pragma once
// Scale, floor and walls of a bed, from the disks of its frames.

#include <string>
#include <vector>

#include "ingest/profile/frame_findings.hpp"

namespace shakebed::ingest {

// The columns of a frame that belong to the bed.
struct FrameSides {
  double left = 0, right = 0;
};
FrameSides sides_of(const FilmCalibration& film);

// The radius from all frames' rims goes into `refined` and into the disks; scale, floor and walls into `bed`.
// Returns warnings, plain sentences.
std::vector<std::string> find_geometry(const FilmCalibration& film, std::vector<FrameFindings>& frames,
                                       FinderCalibration& refined, BedCalibration& bed);

}  // namespace shakebed::ingest
