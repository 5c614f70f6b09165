#include "pipelines/runner/sweep_record.hpp"

#include <fmt/format.h>

#include <map>

#include "pipelines/formats/files.hpp"
#include "pipelines/runner/stage_code.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

std::string value_text(const Json& value) {
  return value.is_null() ? "" : value.is_string() ? value.get<std::string>() : dump_canonical(value);
}

std::vector<std::string> collected(const Plan& plan) {
  if (!plan.sweep->collect.empty()) return plan.sweep->collect;
  std::vector<std::string> pointers;
  for (const PlannedStage& stage : plan.stages) {
    for (const std::string_view key : stage.row->headline) pointers.push_back(fmt::format("/{}/{}", stage.id, key));
    if (stage.row->answer.empty()) continue;
    for (const char* part : {"temperature", "interval/low", "interval/high"})
      pointers.push_back(fmt::format("/{}{}/{}", stage.id, stage.row->answer, part));
  }
  return pointers;
}

std::vector<std::string> gather_cells(const Plan& plan, const fs::path& directory,
                                      const std::vector<std::string>& pointers) {
  std::vector<std::string> cells;
  std::map<std::string, Json> results;
  for (const std::string& pointer : pointers) {
    const std::vector<std::string> tokens = split_pointer(pointer);
    std::string value, error;
    if (const PlannedStage* stage = tokens.empty() ? nullptr : plan.find(tokens.front());
        stage != nullptr && !stage->row->result.empty()) {
      if (!results.contains(stage->id)) {
        std::error_code ignored;
        const fs::path path = directory / stage->id / stage->row->result;
        results[stage->id] = fs::is_regular_file(path, ignored) ? read_json(path) : Json();
      }
      const Json* found = find_pointer(
          results[stage->id], std::string_view(pointer).substr(1 + escape_pointer_token(tokens.front()).size()));
      if (found != nullptr && found->is_object() && found->contains("value")) {
        value = value_text((*found)["value"]);
        if (found->contains("std_error")) error = value_text((*found)["std_error"]);
      } else if (found != nullptr && !found->is_structured()) {
        value = value_text(*found);
      }
    }
    cells.push_back(value), cells.push_back(error);
  }
  return cells;
}

const PlannedStage* answering_stage(const Plan& plan) {
  for (const PlannedStage& stage : plan.stages) {
    if (!stage.row->answer.empty()) return &stage;
  }
  return nullptr;
}

std::string verdict_of(const Plan& plan, const fs::path& directory) {
  const PlannedStage* stage = answering_stage(plan);
  std::error_code ignored;
  if (stage == nullptr || !fs::is_regular_file(directory / stage->id / stage->row->result, ignored)) return "";
  const Json result = read_json(directory / stage->id / stage->row->result);
  const Json* verdict = find_pointer(result, std::string(stage->row->answer) + "/verdict");
  return verdict != nullptr && verdict->is_string() ? verdict->get<std::string>() : "";
}

PointKeys keys_of(const Plan& at) {
  PointKeys keys;
  std::string whole;
  for (const PlannedStage& stage : at.stages) {
    std::string text = fmt::format("{} {} {} {} ", stage.row->name, code_of(stage),
                                   stage.row->uses_seed ? stage.seed : 0, stage.reduced);
    text += dump_canonical(stage.options);
    for (const auto& [pointer, path] : stage.input_files) text += pointer + fast_hash_of_file(path);
    for (const std::size_t k : stage.from) text += at.stages[k].id + keys.stages[k];
    keys.stages.push_back(fast_hash(text));
    whole += stage.id + keys.stages.back();
  }
  keys.point = fast_hash(whole);
  return keys;
}

std::optional<Json> read_point(const fs::path& directory) {
  const fs::path path = directory / point_record;
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return std::nullopt;
  try {
    Json json = read_json(path);
    if (json.is_object() && json.contains("key") && json.contains("code")) return json;
  } catch (const InputError&) {}
  return std::nullopt;
}

std::optional<int> code_of_point(const fs::path& directory, const std::string& key) {
  const auto record = read_point(directory);
  if (!record || (*record)["key"] != key || !(*record)["code"].is_number_integer()) return std::nullopt;
  return (*record)["code"].get<int>();
}

}  // namespace shakebed::pipelines
