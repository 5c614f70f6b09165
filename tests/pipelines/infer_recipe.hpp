// A small bed with two unknown parameters.
#pragma once

#include <string>

namespace shakebed::tests {

inline constexpr const char* infer_recipe =
    R"({ "name": "t", "stages": [ { "stage": "infer", "id": "search", "units": "reduced",
  "disks": { "count": 40, "inertia": "sphere", "restitution": 0.7, "friction": 0.3 },
  "box": { "width": 8.3, "sides": { "kind": "hard", "restitution": 0.7 }, "lid": "open" },
  "floor": { "motion": "sinusoidal", "gamma": 4, "frequency": 0.35, "restitution": 0.7, "friction": 0.3 },
  "settle": 20, "measure": 60, "phases": 8, "plateau_density": 1.10,
  "parameters": {
    "gamma": { "set": ["/floor/gamma"], "low": 3, "high": 6, "why": "a shaker's range" },
    "restitution": { "set": ["/disks/restitution", "/floor/restitution", "/box/sides/restitution"], "low": 0.5, "high": 0.9 } },
  "targets": { "temperature_over_mg": { "value": 0.35, "std_error": 0.01 }, "center_of_mass_rise": { "value": 1.5, "std_error": 0.05 } },
  "moments": 2, "average": 0.8, "first": 24, "rounds": 1, "each": 6, "best": 1, "best_replicas": 3, "draws": 400, "calibration": 3 } ] })";

// The same with beds measured for a third of the time, where their numbers do not matter.
inline std::string brief_infer_recipe() {
  const std::string usual = R"("settle": 20, "measure": 60)", brief = R"("settle": 5, "measure": 20)";
  std::string recipe = infer_recipe;
  return recipe.replace(recipe.find(usual), usual.size(), brief);
}

}  // namespace shakebed::tests
