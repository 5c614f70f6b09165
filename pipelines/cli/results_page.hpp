// The results of record: what the full preset of each shipped recipe found, from docs/results/<recipe>.json, which are
// part of the program (docs/collect_results.py writes them).
#pragma once

#include <string>
#include <vector>

namespace shakebed::pipelines {

struct EmbeddedFile;
struct ShippedRecipe {
  std::string name;
  const EmbeddedFile* file;
};

// A line a recipe: name, title, verdicts of its main claims.
std::string results_list(const std::vector<ShippedRecipe>& recipes);
// docs/results.md: the main claims of all.
std::string results_page(const std::vector<ShippedRecipe>& recipes);
// docs/results/<recipe>.md: what was claimed, the figure, scene and findings, all claims.
std::string recipe_page(const ShippedRecipe& recipe);

}  // namespace shakebed::pipelines
