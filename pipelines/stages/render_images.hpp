// The body of the render stage. In the images module alone.
#pragma once

#include "pipelines/stages/images_module.hpp"

namespace shakebed::pipelines {

void render_frames(const RenderOptions& options, RunContext& context);

}  // namespace shakebed::pipelines
