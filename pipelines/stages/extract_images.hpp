// The body of the extract stage. In the images module alone.
#pragma once

#include "pipelines/stages/images_module.hpp"

namespace shakebed::pipelines {

void extract_disks(const ExtractOptions& options, RunContext& context);

}  // namespace shakebed::pipelines
