#include "pipelines/runner/manifest.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <optional>
#include <set>

#include "pipelines/formats/files.hpp"
#include "pipelines/runner/cache.hpp"
#include "pipelines/version.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

std::string program_version() { return SHAKEBED_VERSION; }
std::string source_revision() { return SHAKEBED_REVISION; }
std::string compiler_text() {
#if defined(__clang__)
  return fmt::format("clang {}.{}.{}", __clang_major__, __clang_minor__, __clang_patchlevel__);
#else
  return fmt::format("g++ {}.{}.{}", __GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__);
#endif
}
std::string utc_now() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))); }

std::string host_name() {
  char host[256] = "?";
  ::gethostname(host, sizeof host - 1);
  return host;
}

namespace {
Json file_entry(const std::string& name, std::uint64_t bytes, const std::string& sha) {
  return Json{{"file", name}, {"bytes", bytes}, {"sha256", sha}};
}

// The files of the stages before it, then those of the user's own.
Json inputs_json(const PlannedStage& planned, const StageRecord& record) {
  Json inputs = Json::array();
  for (const Fingerprint& file : record.inputs) {
    if (!file.sha256.empty()) inputs.push_back(file_entry(file.file, file.bytes, file.sha256));
  }
  for (const auto& [pointer, path] : planned.input_files) {
    std::error_code error;
    if (!fs::is_regular_file(path, error)) continue;
    Json external = file_entry(path, fs::file_size(path, error), sha256_of_file(path));
    external["external"] = true;
    inputs.push_back(std::move(external));
  }
  return inputs;
}

Json stage_json(const PlannedStage& planned, const StageOutcome& stage) {
  Json entry;
  entry["id"] = stage.id;
  entry["stage"] = stage.kind;
  if (stage.record) entry["code"] = stage.record->code;
  if (planned.row->uses_seed) entry["seed"] = planned.seed;
  entry["state"] = to_string(stage.state);
  if (!stage.reasons.empty()) entry["why"] = stage.reasons;
  if (!stage.error.empty()) entry["error"] = stage.error;
  if (!stage.record) return entry;
  if (stage.cost) entry["cost"] = stage.cost->to_json();
  entry["warnings"] = stage.record->warnings;
  entry["inputs"] = inputs_json(planned, *stage.record);
  entry["outputs"] = Json::array();
  for (const Fingerprint& file : stage.record->outputs)
    entry["outputs"].push_back(file_entry(stage.id + "/" + file.file, file.bytes, file.sha256));
  return entry;
}
}  // namespace

Json recipe_json(const Plan& plan, const RunOptions& options) {
  Json recipe;
  recipe["file"] = plan.file;
  std::error_code error;
  if (fs::is_regular_file(plan.file, error)) {
    recipe["sha256"] = sha256_of_file(plan.file);
    recipe["directory"] = fs::absolute(plan.directory, error).string();
  }
  if (!plan.preset.empty()) recipe["preset"] = plan.preset;
  recipe["settings"] = Json::object();
  for (const Setting& setting : options.settings) recipe["settings"][setting.pointer] = setting.value.to_json();
  return recipe;
}

Json manifest_json(const Plan& plan, const RunOptions& options, const RunOutcome& outcome, const std::string& started) {
  Json out;
  out["pipeline"] = plan.name;
  out["shakebed"] = program_version();
  out["git"] = source_revision();
  out["compiler"] = compiler_text();
  out["build_type"] = SHAKEBED_BUILD_TYPE;
  out["host"] = host_name();
  out["command_line"] = options.command_line;
  out["started"] = started;
  out["finished"] = utc_now();
  out["wall_seconds"] = outcome.wall_seconds;
  out["exit_code"] = static_cast<int>(outcome.code);
  if (!outcome.error.empty()) out["error"] = outcome.error;
  out["warnings"] = outcome.warnings;
  out["failed_checks"] = outcome.failed_checks;
  out["recipe"] = recipe_json(plan, options);
  if (!options.budget.is_null()) out["budget"] = options.budget;
  out["document"] = plan.document.to_json();
  out["stages"] = Json::array();
  for (std::size_t i = 0; i < outcome.stages.size(); ++i)
    out["stages"].push_back(stage_json(plan.stages[i], outcome.stages[i]));
  out["outputs"] = Json::array();
  for (const char* name : {"resolved.json", "summary.json", "summary.md", "report.html"}) {
    const fs::path path = outcome.out / name;
    std::error_code error;
    if (fs::is_regular_file(path, error))
      out["outputs"].push_back(file_entry(name, fs::file_size(path), sha256_of_file(path)));
  }
  return out;
}

// Of the points of a sweep: what their stages have recorded; of a stage that points share, once.
void verify_points(const fs::path& out, VerifyResult& result) {
  std::set<fs::path> stages;
  std::error_code error;
  for (const fs::directory_entry& point : fs::directory_iterator(out / "points", error))
    for (const fs::directory_entry& stage : fs::directory_iterator(point.path(), error))
      if (stage.is_directory(error)) stages.insert(fs::canonical(stage.path(), error));
  for (const fs::path& stage : stages) {
    const std::optional<StageRecord> record = read_record(stage);
    if (!record) continue;
    for (const Fingerprint& file : record->outputs) {
      const fs::path path = stage / file.file;
      ++result.files;
      if (!fs::is_regular_file(path, error))
        result.problems.push_back(fs::relative(path, out, error).string() + ": missing");
      else if (!file.sha256.empty() && sha256_of_file(path) != file.sha256)
        result.problems.push_back(fs::relative(path, out, error).string() + ": changed since the run");
    }
  }
}

VerifyResult verify_output(const fs::path& out) {
  const Json manifest = read_json(out / "manifest.json");
  VerifyResult result;
  const auto check = [&](const Json& entry) {
    const std::string name = entry.value("file", std::string());
    const bool external = entry.value("external", false);
    const fs::path path = external ? fs::path(name) : out / name;
    ++result.files;
    std::error_code error;
    if (!fs::is_regular_file(path, error)) {
      result.problems.push_back(name + ": missing");
    } else if (sha256_of_file(path) != entry.value("sha256", std::string())) {
      result.problems.push_back(name + ": changed since the run");
    }
  };
  try {
    for (const Json& stage : manifest.at("stages")) {
      if (stage.contains("outputs")) {
        for (const Json& entry : stage["outputs"]) check(entry);
      }
      if (stage.contains("inputs")) {
        for (const Json& entry : stage["inputs"]) {
          if (entry.value("external", false)) check(entry);
        }
      }
    }
    for (const Json& entry : manifest.at("outputs")) check(entry);
  } catch (const nlohmann::json::exception&) {
    throw InputError((out / "manifest.json").string() + ": is not a manifest written by shakebed");
  }
  verify_points(out, result);
  return result;
}

}  // namespace shakebed::pipelines
