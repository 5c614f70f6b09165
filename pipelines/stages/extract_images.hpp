// The body of the extract stage. In the images module alone.
#pragma once

#include <cstdint>

#include "pipelines/stages/images_module.hpp"

namespace shakebed::pipelines {

// Refuses where the mean number of beads found is more than a fifth from the number given; warns where it is more than
// a thousandth from it.
void judge_bead_number(std::uint64_t given, double mean_found, RunContext& context);

void extract_disks(const ExtractOptions& options, RunContext& context);

}  // namespace shakebed::pipelines
