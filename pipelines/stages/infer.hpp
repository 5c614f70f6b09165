// infer: which restitution and friction give a bed the temperature and density that were measured? A search over a
// stated grid, every point a simulation, with window, kernel and phase average fixed before it begins.
//
// Files: infer.json (target, nearest pair, its distance, every point), infer.csv (a row a point).
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StageRow infer_stage();

}  // namespace shakebed::pipelines
