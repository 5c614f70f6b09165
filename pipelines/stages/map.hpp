// map: Gamma → T/T_c by every named reading, beside the temperature that was measured.
//
// Files: map.json, map.csv.
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StagePages map_pages();  // map_report.cpp

}  // namespace shakebed::pipelines
