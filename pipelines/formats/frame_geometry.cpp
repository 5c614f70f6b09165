#include "pipelines/formats/frame_geometry.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "pipelines/formats/errors.hpp"

namespace shakebed::pipelines {

Json FrameGeometry::to_json() const {
  Json out;
  out["scale"] = quantity_json(scale, "m/px");
  out["floor"] = quantity_json(floor, "px");
  out["left_wall"] = quantity_json(left_wall, "px");
  out["right_wall"] = quantity_json(right_wall, "px");
  out["lowest"] = quantity_json(lowest, "D");
  out["width"] = width;
  out["height"] = height;
  out["periodic"] = periodic;
  return out;
}

FrameGeometry FrameGeometry::read(const std::filesystem::path& path) {
  const Json json = read_json(path);
  const auto value = [&](const std::string& key) {
    const Json* found = find_pointer(json, "/" + key + "/value");
    if (found == nullptr || !found->is_number())
      throw InputError(fmt::format("{}: /{}: a quantity is missing here", path.string(), key));
    return found->get<double>();
  };
  return {.scale = value("scale"),
          .floor = value("floor"),
          .left_wall = value("left_wall"),
          .right_wall = value("right_wall"),
          .lowest = value("lowest"),
          .width = json.value("width", 0),
          .height = json.value("height", 0),
          .periodic = json.value("periodic", false)};
}

std::string FrameGeometry::sides_text() const {
  return fmt::format("periodic sides at columns {} and {} of {} x {} px", left_wall, right_wall, width, height);
}

std::optional<FrameGeometry> FrameGeometry::from_sides_text(const std::string& text) {
  FrameGeometry geometry;
  geometry.periodic = true;
  if (std::sscanf(text.c_str(), "periodic sides at columns %lf and %lf of %d x %d px", &geometry.left_wall,
                  &geometry.right_wall, &geometry.width, &geometry.height) != 4)
    return std::nullopt;
  if (!(geometry.left_wall < geometry.right_wall) || geometry.width <= 0 || geometry.height <= 0) return std::nullopt;
  return geometry;
}

}  // namespace shakebed::pipelines
