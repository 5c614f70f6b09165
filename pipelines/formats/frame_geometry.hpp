// Where things are in rendered frames.
#pragma once

#include <filesystem>

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

// geometry.json beside rendered frames: where things are in them.
struct FrameGeometry {
  double scale = 0;                      // [m/px]
  double floor = 0;                      // row of the floor's mean position [px]
  double left_wall = 0, right_wall = 0;  // columns [px]
  double lowest = 0;                     // of any disk's centre [D]
  int width = 0, height = 0;             // of the frames [px]
  Json to_json() const;
  static FrameGeometry read(const std::filesystem::path& path);  // throws InputError
};

}  // namespace shakebed::pipelines
