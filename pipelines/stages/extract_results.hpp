// The numbers and tables of an extraction (extract.json and the CSV files beside it), stated before it runs.
#pragma once

#include "pipelines/formats/results.hpp"
#include "pipelines/stages/images_module.hpp"

namespace shakebed::pipelines {

void state_extract_results(ResultList& list, const ExtractOptions& options);

}  // namespace shakebed::pipelines
