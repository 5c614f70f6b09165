// extract: frames (rendered, photographed, filmed) → disks → density profile.
//
// Files:
//   disks.csv             frame,x_px,y_px,radius_px,x,z,quality
//   profile.csv           density by height, with covariance.csv
//   coverage_profile.csv  the same from the covered area
//   frames.csv            what was found in each frame
//   extract.json          the numbers
//   overlay_<frame>.png   the disks found, drawn over the frame
//   film.json             small pictures of the frames, for the page
//   residual.webp
//   bed.json              of the simulated bed, passed on
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StagePages extract_pages();  // extract_report.cpp

}  // namespace shakebed::pipelines
