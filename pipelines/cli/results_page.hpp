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
// docs/results.md.
std::string results_page(const std::vector<ShippedRecipe>& recipes);

}  // namespace shakebed::pipelines
