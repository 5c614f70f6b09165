// Where things are in rendered frames.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

// geometry.json beside rendered frames: where things are in them.
struct FrameGeometry {
  double scale = 0;                      // [m/px]
  double floor = 0;                      // row of the floor's mean position [px]
  double left_wall = 0, right_wall = 0;  // columns [px]
  double lowest = 0;                     // of any disk's centre [D]
  int width = 0, height = 0;             // of the frames [px]
  bool periodic = false;                 // sides: the frames show no walls
  Json to_json() const;
  static FrameGeometry read(const std::filesystem::path& path);  // throws InputError

  // What a picture of a bed with periodic sides says of them in its own file, under this keyword, and its reading;
  // nothing where the text says no such thing.
  static constexpr std::string_view keyword = "shakebed";
  std::string sides_text() const;
  static std::optional<FrameGeometry> from_sides_text(const std::string& text);
};

}  // namespace shakebed::pipelines
