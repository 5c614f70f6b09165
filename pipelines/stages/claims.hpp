// claims: sentences of a paper, each with the number it speaks of as measured, and whether it holds.
//
// Files: claims.json, claims.csv, claims.md. A claim that does not hold is a result, not a failure: for expectations
// that must hold there is check.
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StagePages claims_pages();  // claims_report.cpp

}  // namespace shakebed::pipelines
