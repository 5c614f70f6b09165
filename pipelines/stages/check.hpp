// check: results against expected values with tolerances → a verdict, JUnit XML for CI, and exit code 6 when one fails.
//
// Files: check.json, junit.xml, summary.md.
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StagePages check_pages();  // check_report.cpp

}  // namespace shakebed::pipelines
