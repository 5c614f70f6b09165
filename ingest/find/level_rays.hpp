#pragma once
// Grey levels along rays from the centre of a bead.

#include <opencv2/core.hpp>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

struct RayGrid {
  int rays = 64, steps = 0;
  double reach_px = 0;  // of all steps
};

// A row for each ray, from the direction of the columns on towards that of the rows. Empty where the frame or what is
// used of it does not show all of the rays.
cv::Mat levels_along_rays(const GrayFrame& frame, double x_px, double y_px, const RayGrid& grid);

}  // namespace shakebed::ingest
