// implements: pipelines/cli/commands.hpp
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/program.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/runner/folder_lock.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

struct CleanArguments {
  std::string folder = "results", older_than;
  bool dry_run = false;
};

// "30d", "12h", "90min" [s].
double age_argument(std::string text) {
  if (text.empty()) return 0;
  const std::string given = text;
  double unit = 0;
  if (text.ends_with("d"))
    unit = 86400;
  else if (text.ends_with("h"))
    unit = 3600;
  else if (text.ends_with("min"))
    unit = 60, text.resize(text.size() - 2);
  if (unit == 0)
    throw UsageError(fmt::format(
        "--older-than: \"{}\" is not an age; write a number of days, hours or minutes: 30d, 12h, 90min", given));
  text.pop_back();
  return unit * quantity_argument("--older-than", text, dimension::none);
}

bool is_ours(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path / "manifest.json", error);
}

// The folder itself, or the results folders in it.
std::vector<fs::path> results_in(const fs::path& folder) {
  if (is_ours(folder)) return {folder};
  std::vector<fs::path> found;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.is_directory(error) && !entry.is_symlink(error) && is_ours(entry.path())) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

// Seconds since its manifest was written.
double age_of(const fs::path& results) {
  std::error_code error;
  const auto written = fs::last_write_time(results / "manifest.json", error);
  return std::chrono::duration<double>(fs::file_time_type::clock::now() - written).count();
}

int clean(const Call& call, const CleanArguments& given) {
  const fs::path folder = given.folder;
  std::error_code error;
  if (!fs::is_directory(folder, error)) throw InputError(fmt::format("{}: there is no such folder", folder.string()));
  const double age = age_argument(given.older_than);
  Json removed = Json::array();
  for (const fs::path& path : results_in(folder)) {
    if (age_of(path) < age) continue;
    if (!given.dry_run) {
      const FolderLock lock(path);  // no process uses it
      fs::remove_all(path, error);
      if (error) throw StageError(fmt::format("{}: cannot be removed: {}", path.string(), error.message()));
    }
    removed.push_back(path.string());
    if (!call.json) print(fmt::format("{} {}\n", given.dry_run ? "would remove" : "removed", path.string()));
  }
  if (call.json)
    print(dump(Json{{"removed", removed}, {"dry_run", given.dry_run}}));
  else if (removed.empty())
    print("nothing to remove\n");
  return exit_ok;
}

}  // namespace

void add_clean(Program& program) {
  const auto given = std::make_shared<CleanArguments>();
  CLI::App& command =
      program.add({"clean", "remove results",
                   "  shakebed clean results --older-than 30d --dry-run\n  shakebed clean results/bed", false},
                  [given](const Call& call) { return clean(call, *given); });
  command
      .add_option("folder", given->folder,
                  "results folder, or a folder that contains results folders (default: results)")
      ->type_name("DIR");
  command.add_option("--older-than", given->older_than, "remove only results older than this: 30d, 12h, 90min")
      ->type_name("AGE");
  command.add_flag("--dry-run", given->dry_run, "show what would be removed, and remove nothing");
}

}  // namespace shakebed::pipelines
