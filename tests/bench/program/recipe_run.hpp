// Runs a recipe made on the spot, silently, in a scratch folder.
#pragma once

#include <filesystem>

#include "pipelines/runner/run.hpp"
#include "tests/bench/program/results.hpp"

namespace shakebed::pipelines::bench {

struct RecipeRun {
  std::filesystem::path out;
  RunOutcome outcome;
  // CPU seconds of a stage, all threads.
  double cpu(std::string_view id) const;
  // The number at a pointer of a stage's result file: number("fit", "fit.json", "/temperature/value"). Throws
  // StageError.
  double number(std::string_view id, std::string_view file, std::string_view pointer) const;
};

// Throws StageError with the stage's words when a stage fails, Interrupted after Ctrl-C. The folder is made anew.
RecipeRun run_recipe(const Json& recipe, const std::filesystem::path& out);

}  // namespace shakebed::pipelines::bench
