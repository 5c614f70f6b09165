// The scene of a recipe's text, as the stage `simulate` reads it.
#pragma once

#include <string>
#include <vector>

#include "pipelines/formats/config.hpp"
#include "pipelines/formats/json.hpp"
#include "pipelines/stages/scene_options.hpp"

namespace shakebed::tests {

// Adds what is wrong with it to `problems`. With `reduced` numbers without a unit are allowed.
inline pipelines::SceneOptions decoded_scene(const std::string& text, std::vector<pipelines::Problem>& problems,
                                             bool reduced) {
  const auto node = pipelines::parse_json(text, "bed.json", problems);
  pipelines::Fields::Source source{.file = "bed.json"};
  source.problems = &problems;
  pipelines::SceneOptions options;
  pipelines::Fields fields = pipelines::Fields::decode(*node, "", source);
  fields.set_reduced(reduced);
  options.describe(fields);
  fields.finish();
  return options;
}

}  // namespace shakebed::tests
