// From a recipe to a plan: which stages, with which options, in which order.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pipelines/formats/config.hpp"
#include "pipelines/runner/presets.hpp"
#include "pipelines/runner/recipe_options.hpp"
#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

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
  // What it will give; nullptr while a plan is being made and its options are wrong. On the heap: others point to it.
  std::unique_ptr<ResultList> results;
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
  // What is odd but not wrong. Of a recipe with a sweep: of its points, each kind once.
  std::vector<Warning> warnings;

  const PlannedStage* find(std::string_view id) const;
  std::size_t index_of(std::string_view id) const;  // throws UsageError (did you mean)
  std::vector<StatedStage> stated() const;          // all stages and what they will give
};

// The plan of a document as it is: its presets and the points of its sweep are not looked at (see read_recipe.hpp).
// Throws ConfigError with every mistake.
Plan make_plan(JsonNode document, const std::string& file, const std::filesystem::path& directory);

}  // namespace shakebed::pipelines
