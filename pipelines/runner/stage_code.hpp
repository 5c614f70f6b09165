// Which code makes the results of a stage.
#pragma once

#include <string>
#include <string_view>

#include "pipelines/runner/plan.hpp"

namespace shakebed::pipelines {

// A fingerprint of the files that a kind of stage is made of, taken by the build (pipelines/stage_code.cmake); "" for a
// kind that the build did not see.
std::string_view stage_code(std::string_view kind);

// The same of a stage of a recipe, with the kinds of stages that it runs itself.
std::string code_of(const PlannedStage& stage);

}  // namespace shakebed::pipelines
