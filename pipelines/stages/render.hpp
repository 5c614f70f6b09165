// render: a trajectory → frames as a camera would see them, with the true centres beside them.
//
// Files: frames/000000.png ..., truth.csv (frame,disk,x_px,y_px,radius_px), geometry.json (FrameGeometry), render.json,
// bed.json (the bed's, passed on).
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {}  // namespace shakebed::pipelines
