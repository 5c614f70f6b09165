// implements: pipelines/cli/commands.hpp
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/program.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/runner/cache.hpp"
#include "pipelines/runner/console.hpp"
#include "pipelines/runner/folder_lock.hpp"
#include "pipelines/runner/sweep.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

bool is_running(const fs::path& out) {
  std::error_code error;
  if (!fs::exists(out / ".lock", error)) return false;
  try {
    const FolderLock lock(out);
    return false;
  } catch (const StageError&) {
    return true;
  }
}

// Folder and what is known of the stage in it, by name.
std::vector<std::pair<std::string, StageRecord>> records_in(const fs::path& out) {
  std::vector<std::pair<std::string, StageRecord>> records;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(out, error)) {
    if (!entry.is_directory(error) || entry.is_symlink(error)) continue;
    if (auto record = read_record(entry.path()))
      records.emplace_back(entry.path().filename().string(), std::move(*record));
  }
  std::sort(records.begin(), records.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return records;
}

// Of one stage: for --json and for people.
std::pair<Json, std::string> stage_status(const fs::path& out, const std::string& id, const StageRecord& record) {
  std::uint64_t bytes = 0;
  std::vector<std::string> damaged;
  std::error_code error;
  for (const Fingerprint& file : record.outputs) {
    bytes += file.bytes;
    if (fs::file_size(out / id / file.file, error) != file.bytes || error) damaged.push_back(file.file);
  }
  const std::optional<StageCost> cost = read_cost(out / id);
  Json json{{"id", id},
            {"stage", record.stage},
            {"code", record.code},
            {"wall_seconds", cost ? Json(cost->wall_seconds) : Json()},
            {"files", record.outputs.size()},
            {"bytes", bytes},
            {"damaged", damaged}};
  return {std::move(json), fmt::format("  {:<16} {:<10} {:>5} files {:>12} bytes  {:>10}{}\n", id, record.stage,
                                       record.outputs.size(), bytes, cost ? duration_text(cost->wall_seconds) : "",
                                       damaged.empty() ? "" : fmt::format("  damaged: {}", fmt::join(damaged, ", ")))};
}

// The stages that have begun and not ended: their state is kept in .scratch.
std::vector<std::string> begun_in(const fs::path& out) {
  std::vector<std::string> begun;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(out / ".scratch", error)) {
    const std::string id = entry.path().filename().string();
    if (!entry.is_directory(error) || read_record(out / id)) continue;
    for (const fs::directory_entry& file : fs::recursive_directory_iterator(entry.path(), error)) {
      if (!file.is_regular_file(error)) continue;
      begun.push_back(id);
      break;
    }
  }
  std::sort(begun.begin(), begun.end());
  return begun;
}

// How the last run ended, from what is to be printed with --json.
std::string last_run(const Json& json) {
  if (json["running"].get<bool>()) return "running now";
  if (!json.contains("exit_code")) return "no finished run";
  const std::string when = json.value("finished", "");
  switch (const int code = json.value("exit_code", 0); code) {
    case exit_ok:
      return fmt::format("finished {}", when);
    case exit_check_failed:
      return fmt::format("finished {}; a check failed", when);
    case exit_interrupted:
      return fmt::format("interrupted {}. Start the same command again to continue", when);
    default:
      return fmt::format("failed {} with exit code {}", when, code);
  }
}

int status(const Call& call, const fs::path& out) {
  std::error_code error;
  if (!fs::is_directory(out, error)) throw InputError(fmt::format("{}: there is no such folder", out.string()));
  Json json;
  json["folder"] = out.string();
  json["running"] = is_running(out);
  if (fs::is_regular_file(out / "manifest.json", error)) {
    const Json manifest = read_json(out / "manifest.json");
    for (const char* key : {"pipeline", "finished", "exit_code", "error", "wall_seconds"})
      if (manifest.contains(key)) json[key] = manifest[key];
  }
  std::string text = fmt::format("{}: {}\n", out.string(), last_run(json));
  json["stages"] = Json::array();
  for (const auto& [id, record] : records_in(out)) {
    auto [row, line] = stage_status(out, id, record);
    json["stages"].push_back(std::move(row));
    text += line;
  }
  json["begun"] = begun_in(out);
  for (const Json& id : json["begun"])
    text += fmt::format("  {:<16} started, not finished: its state is kept\n", id.get<std::string>());
  const Json sweep = sweep_status(out);
  const bool nothing = json["stages"].empty() && json["begun"].empty() && sweep.is_null();
  if (nothing && !json.contains("exit_code") && !json["running"].get<bool>() && !fs::exists(out / "slurm", error))
    throw InputError(
        fmt::format("{}: this folder contains no results, and no stage was started in it. Give the folder that --out "
                    "named, for example {}",
                    out.string(), "results/bed"));
  if (nothing) text += "  no finished stage\n";
  if (!sweep.is_null()) {
    json["sweep"] = sweep;
    text += fmt::format("  sweep: {} of {} points done, {} failed\n", sweep["done"].get<std::uint64_t>(),
                        sweep["points"].get<std::uint64_t>(), sweep["failed"].get<std::uint64_t>());
    if (const auto left = sweep["left_over"].get<std::uint64_t>(); left > 0)
      text += fmt::format(
          "  {} folders of points that are no longer in the sweep: they are kept and used again if the sweep gets "
          "these points back\n",
          left);
  }
  if (const fs::path submitted = out / "slurm" / "submitted.json"; fs::is_regular_file(submitted, error)) {
    json["submitted"] = read_json(submitted);
    const std::string job = json["submitted"].value("job", ""), gather = json["submitted"].value("gather_job", "");
    text += fmt::format(
        "  last submitted to Slurm: {}{}job {}, which gathers the results (squeue --jobs {} shows whether they have "
        "ended)\n",
        job.empty() ? "" : "array job " + job, job.empty() ? "" : ", ", gather,
        job.empty() ? gather : job + "," + gather);
  }
  print(call.json ? dump(json) : text);
  return exit_ok;
}

}  // namespace

void add_status(Program& program) {
  const auto folder = std::make_shared<std::string>();
  CLI::App& command =
      program.add({"status", "show what a results folder contains", "  shakebed status results/bed", false},
                  [folder](const Call& call) { return status(call, *folder); });
  command.add_option("folder", *folder, "results folder of a run or sweep")->required()->type_name("DIR");
}

}  // namespace shakebed::pipelines
