// fit: a density profile → temperature, solid height, plateau density.
//
// Files: fit.json, curve.csv (the model), residuals.csv (every bin), windows.csv (temperature against window), bed.json
// (passed on).
#pragma once

#include "pipelines/stages.hpp"

namespace shakebed::pipelines {

StageRow fit_stage();

}  // namespace shakebed::pipelines
