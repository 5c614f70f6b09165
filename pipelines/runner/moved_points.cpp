#include "pipelines/runner/moved_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>

#include "pipelines/formats/errors.hpp"
#include "pipelines/runner/folder_lock.hpp"
#include "pipelines/runner/sweep_record.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

std::string recorded_key(const fs::path& folder) {
  const auto record = read_point(folder);
  return record && (*record)["key"].is_string() ? (*record)["key"].get<std::string>() : "";
}

// Folders with finished results by their key, without those in `taken`.
std::multimap<std::string, std::string> finished_folders(const fs::path& points_dir,
                                                         const std::set<std::string>& taken) {
  std::multimap<std::string, std::string> found;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(points_dir, error)) {
    const std::string name = entry.path().filename().string();
    if (taken.contains(name)) continue;
    const std::string key = recorded_key(entry.path());
    if (!key.empty() && is_done(code_of_point(entry.path(), key))) found.emplace(key, name);
  }
  return found;
}

bool is_in_use(const fs::path& folder) {
  try {
    const FolderLock lock(folder);
    return false;
  } catch (const StageError&) {
    return true;
  }
}

void exchange(const fs::path& a, const fs::path& b) {
  std::error_code error;
  if (!fs::exists(a, error)) return fs::rename(b, a);
  // A folder left here by a process that died is found again by its record.
  const fs::path between = a.parent_path() / ("moved-" + a.filename().string());
  fs::rename(a, between), fs::rename(b, a), fs::rename(between, b);
}

}  // namespace

std::map<std::string, std::string> earlier_places(const NamedKeys& points, const fs::path& points_dir) {
  std::set<std::string> at_home;
  bool displaced = false;  // some folder holds another point than its name says
  for (const auto& [name, key] : points) {
    const std::string recorded = recorded_key(points_dir / name);
    if (recorded == key) at_home.insert(name);
    displaced = displaced || (!recorded.empty() && recorded != key);
  }
  std::map<std::string, std::string> places;
  if (!displaced) return places;
  std::multimap<std::string, std::string> folders = finished_folders(points_dir, at_home);
  for (const auto& [name, key] : points) {
    const auto found = folders.find(key);
    if (at_home.contains(name) || found == folders.end()) continue;
    places.emplace(name, found->second);
    folders.erase(found);
  }
  return places;
}

bool move_to_own_places(const std::map<std::string, std::string>& places, const fs::path& points_dir) {
  if (places.empty()) return false;
  try {
    const FolderLock lock(points_dir);
    for (const fs::directory_entry& entry : fs::directory_iterator(points_dir))
      if (entry.is_directory() && is_in_use(entry.path())) return false;
    std::map<std::string, std::string> now_at;  // of a folder that was exchanged
    for (const auto& [name, before] : places) {
      const std::string& own = name;
      const std::string from = now_at.contains(before) ? now_at[before] : before;
      if (from == own) continue;
      exchange(points_dir / own, points_dir / from);
      // What lay under the point's own name, wherever it came from, lies where the point was.
      const auto there = std::find_if(now_at.begin(), now_at.end(), [&](const auto& one) { return one.second == own; });
      now_at[there == now_at.end() ? own : there->first] = from;
      now_at[before] = own;
    }
    return true;
  } catch (const fs::filesystem_error& error) {
    throw StageError(fmt::format("{}: the points cannot be renamed: {}", points_dir.string(), error.code().message()));
  }
}

}  // namespace shakebed::pipelines
