// critical: T_c and T_c' as simulated beds show them: the temperatures at which the bottom row's density, and the bond
// order, fall below thresholds. The bottom of a bed never quite reaches close packing and there is no one threshold:
// the temperatures are told against it.
//
// From a study over temperature; files: critical.json, critical.csv.
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StageRow critical_stage();

}  // namespace shakebed::pipelines
