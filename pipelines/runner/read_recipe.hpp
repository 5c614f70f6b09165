// Reads a recipe and checks all of it: every preset, every point of its sweep.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/runner/plan.hpp"

namespace shakebed::pipelines {

// What is applied to a recipe before it is read, in this order.
struct RecipeChanges {
  std::optional<std::string> preset;
  std::vector<Setting> settings;      // of --set
  std::optional<std::string> data{};  // of --data: a CSV for every figure stage
};

// Throws ConfigError with every mistake, also with those in another preset or in one point of the sweep only. Throws
// InputError when the file cannot be read, UsageError when a change cannot be applied.
Plan read_recipe(const std::filesystem::path& file, const RecipeChanges& changes = {});
// From text already here (a built-in recipe): `file` names it in messages.
Plan read_recipe_text(const std::string& text, const std::string& file, const std::filesystem::path& directory,
                      const RecipeChanges& changes = {});

}  // namespace shakebed::pipelines
