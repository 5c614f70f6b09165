#include "pipelines/formats/frame_geometry.hpp"

#include <fmt/format.h>

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
          .height = json.value("height", 0)};
}

}  // namespace shakebed::pipelines
