#include "pipelines/runner/read_recipe.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/profile_csv.hpp"
#include "pipelines/runner/sweep_points.hpp"

namespace shakebed::pipelines {
namespace {

namespace fs = std::filesystem;

// --data: the user's points go into every stage of the recipe that draws them.
void add_data(JsonNode& document, const std::string& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) throw InputError(fmt::format("--data {}: there is no such file", file));
  read_profile_csv(file);  // its mistakes now rather than after the simulation
  bool found = false;
  if (JsonNode* stages = document.find("stages"); stages != nullptr && stages->is_array()) {
    for (JsonNode& stage : stages->items) {
      const JsonNode* kind = stage.find("stage");
      const StageRow* row = kind != nullptr && kind->is_string() ? find_stage(kind->text) : nullptr;
      if (row == nullptr || row->data_option.empty()) continue;
      found = true;
      JsonNode path;
      path.kind = JsonNode::Kind::string;
      path.text = fs::absolute(file).string();
      set_pointer(stage, pointer_join("", row->data_option), std::move(path));
    }
  }
  if (!found)
    throw UsageError(
        "--data: no stage of this recipe draws the points. Leave --data out, or add a figure stage to the recipe");
}

class RecipeReader {
 public:
  RecipeReader(JsonNode document, std::string file, fs::path directory, const RecipeChanges& changes)
      : document_(std::move(document)), file_(std::move(file)), directory_(std::move(directory)), changes_(changes) {}

  Plan read() {
    std::optional<Plan> plan = try_preset(changes_.preset);
    const bool no_stages =
        std::any_of(problems_.begin(), problems_.end(), [](const Problem& one) { return one.meant == "/stages"; });
    for (const std::string& name : preset_names(document_)) {
      if (name != changes_.preset && !no_stages) try_preset(name);
    }
    if (!problems_.empty()) throw ConfigError(std::move(problems_));
    return std::move(*plan);
  }

 private:
  // The plan with a preset (or with none); nothing where something is wrong, which is then in `problems_`.
  std::optional<Plan> try_preset(const std::optional<std::string>& preset) {
    std::vector<Relocation> changed;
    try {
      JsonNode document = document_;
      if (preset) changed = apply_preset(document, file_, *preset);
      for (const Setting& setting : changes_.settings) set_pointer(document, setting.pointer, setting.value);
      if (changes_.data) add_data(document, *changes_.data);
      Plan plan = make_plan(std::move(document), file_, directory_);
      if (plan.sweep) plan.warnings = check_points(plan);
      return plan;
    } catch (const ConfigError& error) {
      add(error.problems(), preset, changed);
      return std::nullopt;
    }
  }

  // A mistake that is there without the preset, too, is shown once.
  void add(std::vector<Problem> fresh, const std::optional<std::string>& preset,
           const std::vector<Relocation>& changed) {
    std::erase_if(fresh, [&](const Problem& one) {
      return std::any_of(seen_.begin(), seen_.end(), [&](const Problem& other) {
        return one.pointer == other.pointer && one.what == other.what && one.at.line == other.at.line &&
               one.at.column == other.at.column;
      });
    });
    seen_.insert(seen_.end(), fresh.begin(), fresh.end());
    if (preset) relocate(fresh, changed, fmt::format(" (after the preset \"{}\" was applied)", *preset));
    problems_.insert(problems_.end(), fresh.begin(), fresh.end());
  }

  JsonNode document_;
  std::string file_;
  fs::path directory_;
  const RecipeChanges& changes_;
  std::vector<Problem> problems_, seen_;
};

}  // namespace

Plan read_recipe_text(const std::string& text, const std::string& file, const fs::path& directory,
                      const RecipeChanges& changes) {
  std::vector<Problem> problems;
  auto document = parse_json(text, file, problems);
  if (!problems.empty()) throw ConfigError(std::move(problems));
  return RecipeReader(std::move(*document), file, directory, changes).read();
}

Plan read_recipe(const fs::path& file, const RecipeChanges& changes) {
  return read_recipe_text(read_file(file), file.string(), file.parent_path(), changes);
}

}  // namespace shakebed::pipelines
