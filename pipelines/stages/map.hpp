// map: Gamma → T/T_c by every formula that the paper allows, beside the measured temperature.
//
// Files: map.json, map.csv.
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StagePages map_pages();  // map_report.cpp

}  // namespace shakebed::pipelines
