// From a recipe to a plan: which stages, with which options, in which order.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pipelines/formats/config.hpp"
#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

// The newest recipe format this program reads ("format" in a recipe).
inline constexpr int recipe_format = 1;

struct PlannedStage {
  std::string id;
  const StageRow* row = nullptr;
  std::unique_ptr<Stage> stage;
  std::string pointer;  // "/stages/2"
  bool reduced = false;
  std::uint64_t seed = 1;
  std::vector<std::size_t> from;  // indices into Plan::stages, all smaller than its own
  std::optional<KnownBed> bed;    // that it makes or measures, else that of the stages it reads from
  Json options;                   // every option, defaults included; the same options give the same JSON
  // Files outside the pipeline that it reads: pointer below the stage, path (a string: a film can be many thousand
  // pictures, and fs::path keeps a list of each one's parts).
  std::vector<std::pair<std::string, std::string>> input_files;
};

// A number that was published, to stand beside ours in the report.
struct PublishedNumber {
  std::string pointer;  // "/fit/temperature_over_mg": where ours is
  std::string label;
  std::string value;      // a quantity; its unit decides in which ours is shown
  std::string place;      // where it is printed
  double relative = 0.1;  // nearer than this part of it counts as agreement
};
struct AssumedInput {
  std::string pointer;  // into the recipe: "/stages/bed/floor/frequency"
  std::string why;
};
// What the recipe says about its report.
struct ReportOptions {
  std::string title;
  std::vector<std::string> text;  // paragraphs
  std::vector<PublishedNumber> published;
  std::vector<AssumedInput> assumed;
  bool audit = false;  // the table of `shakebed audit`, too
};

struct SweepAxis {
  std::string pointer;
  std::vector<Json> values{};
  double low = 0, high = 0;  // of a random axis, in the unit
  std::string unit{};
  bool logarithmic = false;
};
enum class SweepKind { grid, zip, list, random };
struct SweepOptions {
  SweepKind kind = SweepKind::grid;
  std::vector<SweepAxis> axes;
  std::uint64_t count = 0;  // of random points
  std::uint64_t seed = 1;   // of random points
  std::uint64_t replicas = 1;
  std::vector<std::string> collect;  // pointers into the results
};

struct Plan {
  std::string name;
  std::string description;
  std::string file;                  // of the recipe, as the user named it
  std::string preset;                // that it was read with; "" for none
  std::filesystem::path directory;   // its folder
  JsonNode document;                 // after --preset and --set
  std::vector<PlannedStage> stages;  // each after those it reads from
  ReportOptions report;
  std::optional<SweepOptions> sweep;
  Json resolved;  // every option written out; a recipe itself

  const PlannedStage* find(std::string_view id) const;
  std::size_t index_of(std::string_view id) const;  // throws UsageError (did you mean)
};

// "/stages/0/seed=7": the value is JSON, or a string where it is no JSON.
struct Setting {
  std::string pointer;
  JsonNode value;
};
Setting parse_setting(const std::string& text);  // throws UsageError

// Presets: named sets of changes that a recipe carries, "presets": {"quick": {"/stages/bed/measure": "2 s"}}. They are
// made before those of --set. The name is kept in the document as "$preset", so that resolved.json and manifest.json
// tell it. Throws UsageError naming those there are, ConfigError when a change cannot be made.
void apply_preset(JsonNode& document, const std::string& file, const std::string& preset);
std::vector<std::string> preset_names(const JsonNode& document);

// Reads a recipe. Throws ConfigError with every mistake, InputError when the file cannot be read.
Plan read_plan(const std::filesystem::path& file, const std::vector<Setting>& settings = {},
               const std::optional<std::string>& preset = {});
// From text already here (a built-in recipe): `file` names it in messages.
Plan read_plan_text(const std::string& text, const std::string& file, const std::filesystem::path& directory,
                    const std::vector<Setting>& settings = {}, const std::optional<std::string>& preset = {});
// From a document already parsed.
Plan make_plan(JsonNode document, const std::string& file, const std::filesystem::path& directory);

// JSON Schema (draft-07) of a recipe.
Json recipe_schema();
// The pipeline as a Graphviz digraph, or as a Mermaid flowchart.
std::string graph_dot(const Plan& plan);
std::string graph_mermaid(const Plan& plan);

}  // namespace shakebed::pipelines
