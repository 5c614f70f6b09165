// The results of record: what the full preset of each shipped recipe found, from docs/results/<recipe>.json, which are
// part of the program (docs/collect_results.py writes them).
#pragma once

#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

struct EmbeddedFile;
struct ShippedRecipe {
  std::string name;
  const EmbeddedFile* file;
};

// A line a recipe: name, title, verdicts of its main claims.
std::string results_list(const std::vector<ShippedRecipe>& recipes);
// The same for programs, with the claims as recorded: [{"name", "title", "claims"}].
Json results_json(const std::vector<ShippedRecipe>& recipes, bool main_only);
// docs/results.md: the main claims of all.
std::string results_page(const std::vector<ShippedRecipe>& recipes);
// docs/results/<recipe>.md: what was claimed, the figure, scene and findings, all claims.
std::string recipe_page(const ShippedRecipe& recipe);

}  // namespace shakebed::pipelines
