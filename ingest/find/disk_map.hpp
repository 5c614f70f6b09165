#pragma once
// A map of where disks may be: chi-squared of an ideal disk and rim contrast, at the scale where a disk is a few pixels
// wide.

#include <vector>

#include "ingest/calibrate/calibration.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// A place where an ideal disk fits.
struct DiskCandidate {
  double x = 0, y = 0;  // px of the full frame
  double score = 0;     // 2 for a perfect lone disk, about 1 for one among touching ones, 0 on empty background
};

// Factor by which a frame is reduced for the map of disks of this radius (their radius becomes 4.5 to 9 px, or stays).
int map_reduction(double radius_px);

// A flattened frame reduced by `factor`.
struct ReducedFrame {
  const GrayFrame& frame;
  int factor;
};

// Only candidates with at least this score. Of two nearer to one another than the distance [px of the full frame] only
// the better stays.
struct CandidateLimits {
  double least_score, least_distance_px;
};

// Local maxima of the map of `small` for disks of `radius_px` full pixels, the best first. The map reaches 0.8 radii
// beyond the frame, where cut disks have their centres.
std::vector<DiskCandidate> find_candidates(const ReducedFrame& small, double radius_px, const CandidateLimits& limits);

// The same from the bead's learned profile, by Wiener's filter. The frame is a sum of beads. The filter turns each bead
// into a peak of height 1, as narrow as the noise allows (sigma, contrast units of the full frame). It separates the
// beads of a strongly blurred crystal from the voids, which the ideal disk does not. `small` must not have been
// smoothed.
std::vector<DiskCandidate> find_matched_candidates(const ReducedFrame& small, const BeadProfile& profile,
                                                   double radius_px, double noise, const CandidateLimits& limits);

}  // namespace shakebed::ingest
