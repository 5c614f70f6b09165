#include "pipelines/runner/cache.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "pipelines/formats/files.hpp"
#include "pipelines/runner/stage_code.hpp"

namespace shakebed::pipelines {
namespace {

Json to_json(const std::vector<Fingerprint>& files) {
  Json out = Json::array();
  for (const Fingerprint& file : files) {
    Json entry{{"file", file.file}, {"bytes", file.bytes}, {"hash", file.fast}};
    if (!file.sha256.empty()) entry["sha256"] = file.sha256;
    out.push_back(std::move(entry));
  }
  return out;
}

std::vector<Fingerprint> fingerprints_from(const Json& json) {
  std::vector<Fingerprint> files;
  for (const Json& entry : json) {
    files.push_back({entry.at("file").get<std::string>(), entry.at("bytes").get<std::uint64_t>(),
                     entry.at("hash").get<std::string>(), entry.value("sha256", std::string())});
  }
  return files;
}

void flatten(const Json& json, const std::string& path, std::map<std::string, std::string>& out) {
  if (json.is_object() && !json.empty()) {
    for (const auto& [key, value] : json.items()) flatten(value, path.empty() ? key : path + "/" + key, out);
  } else {
    const std::string text = dump_canonical(json);
    out[path] = text.size() <= 60 ? text : text.substr(0, 57) + "...";
  }
}

}  // namespace

Json StageRecord::to_json() const {
  Json out;
  out["stage"] = stage;
  out["id"] = id;
  out["code"] = code;
  out["seed"] = seed;
  out["reduced"] = reduced;
  out["options"] = options;
  out["inputs"] = pipelines::to_json(inputs);
  out["outputs"] = pipelines::to_json(outputs);
  out["warnings"] = warnings;
  out["failed_checks"] = failed_checks;
  return out;
}

StageRecord StageRecord::from_json(const Json& json, const std::string& file) {
  try {
    StageRecord record;
    record.stage = json.at("stage").get<std::string>();
    record.id = json.at("id").get<std::string>();
    record.code = json.value("code", std::string());
    record.seed = json.at("seed").get<std::uint64_t>();
    record.reduced = json.at("reduced").get<bool>();
    record.options = json.at("options");
    record.inputs = fingerprints_from(json.at("inputs"));
    record.outputs = fingerprints_from(json.at("outputs"));
    record.warnings = json.at("warnings").get<std::vector<std::string>>();
    record.failed_checks = json.at("failed_checks").get<std::vector<std::string>>();
    return record;
  } catch (const nlohmann::json::exception&) {
    throw InputError(file + ": this file is not the record of a stage; remove it, and the stage runs again");
  }
}

std::optional<StageRecord> read_record(const std::filesystem::path& stage_directory) {
  const std::filesystem::path path = stage_directory / record_name;
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  try {
    return StageRecord::from_json(read_json(path), path.string());
  } catch (const InputError&) {
    return std::nullopt;
  }
}

Json StageCost::to_json() const {
  Json out{{"wall_seconds", wall_seconds},
           {"cpu_seconds", cpu_seconds},
           {"threads", threads},
           {"host", host},
           {"finished", finished}};
  out.update(timings);
  return out;
}

std::optional<StageCost> read_cost(const std::filesystem::path& stage_directory) {
  const std::filesystem::path path = stage_directory / cost_name;
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  try {
    Json json = read_json(path);
    StageCost cost{.wall_seconds = json.at("wall_seconds").get<double>(),
                   .cpu_seconds = json.at("cpu_seconds").get<double>(),
                   .threads = json.at("threads").get<int>(),
                   .host = json.at("host").get<std::string>(),
                   .finished = json.at("finished").get<std::string>()};
    for (const char* key : {"wall_seconds", "cpu_seconds", "threads", "host", "finished"}) json.erase(key);
    cost.timings = std::move(json);
    return cost;
  } catch (const InputError&) {
    return std::nullopt;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

StageRecord fresh_record(const PlannedStage& stage, const std::vector<const StageRecord*>& upstream) {
  StageRecord record;
  record.stage = stage.row->name;
  record.id = stage.id;
  record.code = code_of(stage);
  record.seed = stage.row->uses_seed ? stage.seed : 0;
  record.reduced = stage.reduced;
  record.options = stage.options;
  for (const StageRecord* input : upstream) {
    for (const Fingerprint& file : input->outputs) {
      record.inputs.push_back({input->id + "/" + file.file, file.bytes, file.fast, file.sha256});
    }
  }
  for (const auto& [pointer, path] : stage.input_files) {
    std::error_code error;
    record.inputs.push_back({pointer + "=" + std::filesystem::path(path).filename().string(),
                             std::filesystem::file_size(path, error), fast_hash_of_file(path), ""});
  }
  return record;
}

std::string work_key(const StageRecord& record) {
  std::string text = fmt::format("{} {} {} {} ", record.stage, record.code, record.seed, record.reduced);
  text += dump_canonical(record.options);
  for (const Fingerprint& input : record.inputs) text += input.file + " " + input.fast + "\n";
  return fast_hash(text);
}

std::vector<std::string> differences(const Json& before, const Json& after) {
  std::map<std::string, std::string> left, right;
  flatten(before, "", left);
  flatten(after, "", right);
  std::vector<std::string> out;
  for (const auto& [key, value] : right) {
    if (key.ends_with("/$comment")) continue;  // written from the options themselves
    const auto old = left.find(key);
    if (old == left.end())
      out.push_back(fmt::format("{} was added: {}", key, value));
    else if (old->second != value)
      out.push_back(fmt::format("{} changed {} → {}", key, old->second, value));
  }
  for (const auto& [key, value] : left) {
    if (!right.contains(key)) out.push_back(fmt::format("{} was removed (it was {})", key, value));
  }
  return out;
}

std::vector<std::string> reasons_to_run(const StageRecord& fresh, const std::optional<StageRecord>& found,
                                        const std::filesystem::path& stage_directory) {
  if (!found) return {"it has not run yet"};
  std::vector<std::string> reasons;
  if (found->stage != fresh.stage) return {fmt::format("in the last run it was a {} stage", found->stage)};
  if (found->code != fresh.code) {
    const std::optional<StageCost> cost = read_cost(stage_directory);
    reasons.push_back(fmt::format("the code of {} changed{}", fresh.stage,
                                  cost ? " since " + cost->finished.substr(0, 10) : std::string()));
  }
  if (found->seed != fresh.seed) reasons.push_back(fmt::format("seed changed {} → {}", found->seed, fresh.seed));
  if (found->reduced != fresh.reduced) reasons.push_back("units changed");
  if (dump_canonical(found->options) != dump_canonical(fresh.options)) {
    auto changed = differences(found->options, fresh.options);
    if (changed.empty()) changed.push_back("its options changed");
    reasons.insert(reasons.end(), changed.begin(), changed.end());
  }
  std::map<std::string, std::string> before;
  for (const Fingerprint& file : found->inputs) before[file.file] = file.fast;
  std::vector<std::string> changed_inputs;
  std::size_t same_inputs = 0;
  for (const Fingerprint& file : fresh.inputs) {
    const auto old = before.find(file.file);
    if (old == before.end())
      changed_inputs.push_back(fmt::format("input {} was added", file.file));
    else if (old->second != file.fast)
      changed_inputs.push_back(fmt::format("input {} changed", file.file));
    else
      ++same_inputs;
  }
  if (same_inputs + changed_inputs.size() < before.size()) changed_inputs.push_back("some of its inputs were removed");
  if (changed_inputs.size() > 3) {
    const std::size_t more = changed_inputs.size() - 2;
    changed_inputs.resize(2);
    changed_inputs.push_back(fmt::format("and {} more inputs", more));
  }
  reasons.insert(reasons.end(), changed_inputs.begin(), changed_inputs.end());
  if (!reasons.empty()) return reasons;
  for (const Fingerprint& file : found->outputs) {
    const std::filesystem::path path = stage_directory / file.file;
    std::error_code error;
    const auto size = std::filesystem::file_size(path, error);
    if (error) {
      reasons.push_back(fmt::format("its output {} is missing", file.file));
    } else if (size != file.bytes || fast_hash_of_file(path) != file.fast) {
      reasons.push_back(fmt::format("its output {} was changed after the run", file.file));
    }
    if (reasons.size() >= 3) break;
  }
  return reasons;
}

std::vector<Fingerprint> fingerprint_directory(const std::filesystem::path& directory, bool with_sha256) {
  namespace fs = std::filesystem;
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(directory)) {
    if (!entry.is_regular_file()) continue;
    const std::string name = entry.path().lexically_relative(directory).generic_string();
    if (name == record_name || name == cost_name || name == "log.txt") continue;
    names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  std::vector<Fingerprint> files;
  for (const std::string& name : names) {
    const fs::path path = directory / name;
    files.push_back({name, fs::file_size(path), fast_hash_of_file(path), with_sha256 ? sha256_of_file(path) : ""});
  }
  return files;
}

}  // namespace shakebed::pipelines
