// Reference pages in Markdown. They are written from the options (describe) and the stated results of the code itself.
#pragma once

#include <string>

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

// List of all stages.
std::string reference_index();
// A stage: options with type, range, default and example; numbers with pointer and unit; tables with their columns.
std::string reference_page(const StageRow& row);
// The options of a recipe outside its stages: name, report, sweep, presets.
std::string recipe_reference_page();

}  // namespace shakebed::pipelines
