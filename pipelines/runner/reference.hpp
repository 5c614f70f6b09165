// The manual's page of a stage, from what the stage says of itself: its options (describe), its numbers and tables
// (results).
#pragma once

#include <string>

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

// All stages, a line each. Markdown.
std::string reference_index();
// Options with type, range, default and example; numbers with pointer and unit; tables with their columns. Markdown.
std::string reference_page(const StageRow& row);

}  // namespace shakebed::pipelines
