#include "pipelines/runner/presets.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "pipelines/formats/config.hpp"
#include "pipelines/formats/errors.hpp"

namespace shakebed::pipelines {

Setting parse_setting(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) {
    throw UsageError(fmt::format("--set {}: expected POINTER=VALUE, as in --set /stages/0/seed=7", text));
  }
  Setting setting{text.substr(0, equals), {}};
  split_pointer(setting.pointer);
  const std::string value = text.substr(equals + 1);
  std::vector<Problem> problems;
  auto node = parse_json(value, "--set", problems);
  if (node && problems.empty()) {
    setting.value = std::move(*node);
  } else {
    setting.value.kind = JsonNode::Kind::string;  // 2.5 mm
    setting.value.text = value;
  }
  return setting;
}

std::vector<std::string> preset_names(const JsonNode& document) {
  std::vector<std::string> names;
  if (const JsonNode* presets = document.find("presets"); presets != nullptr && presets->is_object()) {
    for (const JsonMember& preset : presets->members) {
      if (preset.key != "$comment") names.push_back(preset.key);
    }
  }
  return names;
}

void check_presets(const JsonNode& document, const std::string& file, std::vector<Problem>& problems) {
  const JsonNode* presets = document.find("presets");
  if (presets == nullptr || presets->kind == JsonNode::Kind::null) return;
  const auto problem = [&](const JsonNode& node, std::string pointer, std::string what, std::string suggestion) {
    problems.push_back({node.from_command_line ? "--set" : file, node.from_command_line ? Position{} : node.at,
                        std::move(pointer), std::move(what), std::move(suggestion)});
  };
  const char* example = "Write \"presets\": {\"quick\": {\"/stages/bed/measure\": \"2 s\"}}";
  if (!presets->is_object()) {
    problem(*presets, "/presets", fmt::format("expected an object: name → changes; got {}", presets->described()),
            example);
    return;
  }
  for (const JsonMember& preset : presets->members) {
    if (preset.key == "$comment") continue;
    const std::string where = pointer_join("/presets", preset.key);
    if (!preset.value.is_object()) {
      problem(preset.value, where,
              fmt::format("expected an object: JSON pointer → value; got {}", preset.value.described()), example);
      continue;
    }
    for (const JsonMember& change : preset.value.members) {
      if (change.key == "$comment") continue;
      if (change.key.empty() || change.key.front() != '/')
        problem(change.value, pointer_join(where, change.key), fmt::format("\"{}\" is not a JSON pointer", change.key),
                "Write for example \"/stages/bed/measure\"");
      else if (change.key.starts_with("/presets") || change.key.starts_with("/$preset"))
        problem(change.value, pointer_join(where, change.key), "a preset cannot change the presets", "Remove it");
    }
  }
}

std::string numbered_pointer(const JsonNode& document, const std::string& pointer) {
  const std::vector<std::string> tokens = split_pointer(pointer);
  const JsonNode* stages = document.find("stages");
  if (tokens.size() < 2 || tokens[0] != "stages" || stages == nullptr || !stages->is_array()) return pointer;
  for (std::size_t i = 0; i < stages->items.size(); ++i) {
    const JsonNode& stage = stages->items[i];
    const JsonNode* name = stage.find("id") != nullptr ? stage.find("id") : stage.find("stage");
    if (name == nullptr || !name->is_string() || name->text != tokens[1]) continue;
    std::string out = pointer_join("/stages", i);
    for (std::size_t k = 2; k < tokens.size(); ++k) out = pointer_join(out, tokens[k]);
    return out;
  }
  return pointer;
}

void relocate(std::vector<Problem>& problems, const std::vector<Relocation>& changes,
              const std::string& circumstances) {
  for (Problem& problem : problems) {
    const auto change = std::find_if(changes.begin(), changes.end(), [&](const Relocation& one) {
      return problem.pointer == one.first || problem.pointer.starts_with(one.first + "/");
    });
    if (change != changes.end()) {
      problem.what += fmt::format(" (the preset or sweep sets {})", problem.pointer);
      problem.pointer = change->second;
    } else {
      problem.what += circumstances;
    }
  }
}

std::vector<Relocation> apply_preset(JsonNode& document, const std::string& file, const std::string& name) {
  const std::vector<std::string> names = preset_names(document);
  if (names.empty()) throw UsageError(fmt::format("--preset {}: {} has no presets", name, file));
  const JsonNode presets = *document.find("presets");
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    const std::string nearest = nearest_name(name, names);
    throw UsageError(fmt::format("--preset {}: {}:{}:{}: /presets: there is no preset of this name; choose from: {}{}",
                                 name, file, presets.at.line, presets.at.column, fmt::join(names, ", "),
                                 nearest.empty() ? "" : fmt::format("; did you mean \"{}\"?", nearest)));
  }
  std::vector<Problem> problems;
  check_presets(document, file, problems);
  if (!problems.empty()) throw ConfigError(std::move(problems));
  std::vector<Relocation> changes;
  for (const JsonMember& change : presets.find(name)->members) {
    if (change.key == "$comment") continue;
    const std::string where = pointer_join(pointer_join("/presets", name), change.key);
    try {
      set_pointer(document, change.key, change.value,
                  change.value.from_command_line ? ValueFrom::command_line : ValueFrom::file);
      changes.emplace_back(numbered_pointer(document, change.key), where);
    } catch (const UsageError& error) {
      problems.push_back(
          {file, change.at, where, error.what(), "Name a stage by its id or its number: /stages/bed/measure"});
    }
  }
  if (!problems.empty()) throw ConfigError(std::move(problems));
  JsonNode text;
  text.kind = JsonNode::Kind::string;
  text.text = name;
  set_pointer(document, "/$preset", std::move(text));
  return changes;
}

}  // namespace shakebed::pipelines
