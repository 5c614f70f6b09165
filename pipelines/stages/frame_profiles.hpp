// The density of single frames beside their mean, for the viewers of the page.
#pragma once

#include <vector>

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

// {"low", "step", "n" (of the heights, in D), "largest", "mean": [n], "now": base64 of a byte a height and frame, 255
// being the largest}, seen through a Gaussian of 0.5 D. `heights`: of the disks' centres, frame by frame [D]; `width`
// of the bed [D]; the profile reaches from `low` to `high` [D]. null where there is no frame, or no height.
Json frame_profiles(const std::vector<std::vector<double>>& heights, double width, double low, double high);

}  // namespace shakebed::pipelines
