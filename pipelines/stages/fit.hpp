// fit: a density profile → temperature, solid height, plateau density.
//
// Files: fit.json, curve.csv (the model), residuals.csv (every bin), windows.csv (temperature against window), bed.json
// (passed on).
//
// The model "simulation" takes the other simulate stages in "from" for a library: beds at known temperatures, best two
// or more a temperature, whose spread is then the model's error. With "bootstrap", fit.json has the error of T by
// resampling blocks of frames beside that of the fit.
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StagePages fit_pages();  // fit_report.cpp

}  // namespace shakebed::pipelines
