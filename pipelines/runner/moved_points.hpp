// Points of a sweep that were computed under another number: a value added to an axis shifts the numbers behind it.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace shakebed::pipelines {

// Name of a point's folder, and the key of its results (PointKeys::point).
using NamedKeys = std::vector<std::pair<std::string, std::string>>;

// Folders below `points_dir` that hold the finished results of a point with another name: from the name of the point to
// the folder.
std::map<std::string, std::string> earlier_places(const NamedKeys& points, const std::filesystem::path& points_dir);

// Exchanges folders until each of these points lies under its own name; nothing is removed. Does nothing while another
// process runs a point there. Returns whether they were exchanged. Throws StageError.
bool move_to_own_places(const std::map<std::string, std::string>& places, const std::filesystem::path& points_dir);

}  // namespace shakebed::pipelines
