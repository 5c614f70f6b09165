// extract: frames (rendered, photographed, filmed) → disks → density profile.
//
// Files: disks.csv (frame,x_px,y_px,radius_px,x,z,quality), profile.csv, coverage_profile.csv (from covered area),
// covariance.csv (of the profile), frames.csv (what was found in each), extract.json, overlay_<frame>.png,
// film.json (small pictures of the frames, for the page), residual.webp, bed.json (of
// the simulated bed, passed on).
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StagePages extract_pages();  // extract_report.cpp

}  // namespace shakebed::pipelines
