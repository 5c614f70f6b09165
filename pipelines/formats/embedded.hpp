// Recipes and published numbers that are part of the program itself, so that it finds them wherever it is installed.
#pragma once

#include <string_view>
#include <vector>

namespace shakebed::pipelines {

struct EmbeddedFile {
  std::string_view name;  // "recipes/clement-rajchenbach/figure.json", "reference-data/quinn-hong-2000/..."
  std::string_view text;
};
const std::vector<EmbeddedFile>& embedded_files();
// nullptr if there is none.
const EmbeddedFile* find_embedded(std::string_view name);

}  // namespace shakebed::pipelines
