// study: a chain of stages over a parameter, for several kinds of beds, with replicas (study.cpp).
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StagePages study_pages();  // study_report.cpp

}  // namespace shakebed::pipelines
