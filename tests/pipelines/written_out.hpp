// A recipe with every option written out, as in resolved.json; its sweep and presets are not looked at.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/json.hpp"
#include "pipelines/runner/plan.hpp"

namespace shakebed::tests {

// Throws ConfigError where the recipe is wrong.
inline std::string written_out(const std::string& recipe, const std::filesystem::path& folder) {
  std::vector<pipelines::Problem> problems;
  auto document = pipelines::parse_json(recipe, "r.json", problems);
  if (!document) throw std::runtime_error("not a JSON document");
  return pipelines::dump(pipelines::make_plan(std::move(*document), "r.json", folder).resolved);
}

}  // namespace shakebed::tests
