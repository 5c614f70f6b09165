// The points of a sweep: which there are, and the plan of each.
#pragma once

#include <string>
#include <vector>

#include "pipelines/runner/plan.hpp"

namespace shakebed::pipelines {

struct SweepPoint {
  std::size_t index = 0;
  std::string name;  // of its folder: "000012"
  std::uint64_t replica = 0;
  std::vector<Json> values;  // one an axis; null: as the recipe has it
};
// All points of a plan with a sweep, in order. Throws ConfigError (a pointer that leads nowhere).
std::vector<SweepPoint> sweep_points(const Plan& plan);
// The plan of one point.
Plan plan_at(const Plan& plan, const SweepPoint& point);

}  // namespace shakebed::pipelines
