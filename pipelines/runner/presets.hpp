// Presets: named sets of changes that a recipe carries, "presets": {"quick": {"/stages/bed/measure": "2 s"}}. They are
// made before those of --set. The name is kept in the document as "$preset", so that resolved.json and manifest.json
// state it.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

// "/stages/0/seed=7": the value is JSON, or a string where it is no JSON.
struct Setting {
  std::string pointer;
  JsonNode value;
};
Setting parse_setting(const std::string& text);  // throws UsageError

std::vector<std::string> preset_names(const JsonNode& document);
// Adds to `problems` where the presets are not objects of pointers. Their values are checked when they are applied.
void check_presets(const JsonNode& document, const std::string& file, std::vector<Problem>& problems);

// Where a problem of a changed document is shown. First: the pointer that was changed, with the number of the stage in
// place of its id. Second: the pointer at which the change is written.
using Relocation = std::pair<std::string, std::string>;
// "/stages/bed/seed" → "/stages/0/seed"; as it is where no stage has this id.
std::string numbered_pointer(const JsonNode& document, const std::string& pointer);
// Shows each problem at the place of the change that made it; `circumstances` is added to those that are elsewhere.
void relocate(std::vector<Problem>& problems, const std::vector<Relocation>& changes, const std::string& circumstances);

// Applies a preset and returns what it changed. Throws UsageError naming the presets there are, ConfigError when a
// change cannot be made.
std::vector<Relocation> apply_preset(JsonNode& document, const std::string& file, const std::string& preset);

}  // namespace shakebed::pipelines
