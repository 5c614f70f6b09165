// A small bed with two unknown parameters.
#pragma once

#include <string>

namespace shakebed::tests {

inline constexpr const char* infer_recipe =
    R"({ "name": "t", "stages": [ { "stage": "infer", "id": "search", "units": "reduced",
  "disks": { "count": 40, "inertia": "sphere", "restitution": 0.7, "friction": 0.3 },
  "box": { "width": 8.3, "sides": { "kind": "hard", "restitution": 0.7 }, "lid": "open" },
  "floor": { "motion": "sinusoidal", "gamma": 4, "frequency": 0.35, "restitution": 0.7, "friction": 0.3 },
  "settle": 10, "measure": 30, "phases": 8, "plateau_density": 1.10,
  "parameters": {
    "gamma": { "set": ["/floor/gamma"], "low": 3, "high": 6, "why": "a shaker's range" },
    "restitution": { "set": ["/disks/restitution", "/floor/restitution", "/box/sides/restitution"], "low": 0.5, "high": 0.9 } },
  "targets": { "temperature_over_mg": { "value": 0.35, "std_error": 0.01 }, "center_of_mass_rise": { "value": 1.5, "std_error": 0.05 } },
  "moments": 2, "average": 0.8, "first": 24, "rounds": 1, "each": 6, "best": 1, "best_replicas": 3, "draws": 400, "calibration": 3 } ] })";

// The same with fewer beds, measured for half of the time, where their numbers do not matter.
inline std::string brief_infer_recipe() {
  std::string recipe = infer_recipe;
  const auto replace = [&](const std::string& usual, const std::string& brief) {
    recipe.replace(recipe.find(usual), usual.size(), brief);
  };
  replace(R"("settle": 10, "measure": 30)", R"("settle": 5, "measure": 15)");
  replace(R"("first": 24, "rounds": 1, "each": 6)", R"("first": 20, "rounds": 1, "each": 3)");
  replace(R"("draws": 400, "calibration": 3)", R"("draws": 200, "calibration": 1)");
  return recipe;
}

}  // namespace shakebed::tests
