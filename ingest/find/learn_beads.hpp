#pragma once
// Beads by their faces or by their rims, whichever explains the frame.
//
// A survey may have determined what the beads are (FindOptions::seen). The finder by faces then starts from there. It
// is used when it finds what the rims show and little else; then it is the more accurate one. Otherwise beads are found
// by their rims alone. Without a survey this is learn_finder() and find_disks().

#include "ingest/find/find_disks.hpp"
#include "ingest/find/rim_finder.hpp"

namespace shakebed::ingest {

// px: the radius that beads have, at least, in a frame that is reduced for a trial. Their faces are then learned.
inline constexpr double trial_radius_px = 9;

CalibrationResult learn_beads(const std::vector<const GrayFrame*>& frames, const FindOptions& options);

// By rims alone, from one frame.
CalibrationResult learn_by_rims(const GrayFrame& frame, const BeadsSeen& seen);

FindResult find_beads(const GrayFrame& frame, const FinderCalibration& calibration, const FindOptions& options);

}  // namespace shakebed::ingest
