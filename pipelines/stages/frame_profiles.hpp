// The density of single frames beside their mean, for the viewers of the page.
#pragma once

#include <vector>

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

// {"low", "step", "n", "largest", "mean": [n], "now"}: the density profiles of single frames, seen through a Gaussian
// of 0.5 D. `low`, `step` and `n` describe the heights, in D. `now` is base64 of one byte per height and frame; 255
// means `largest`. `heights`: of the disks' centres, frame by frame [D]. The bed is `width` wide [D]. The profile
// reaches from `low` to `high` [D]. Result: null where there is no frame, or no height.
Json frame_profiles(const std::vector<std::vector<double>>& heights, double width, double low, double high);

}  // namespace shakebed::pipelines
