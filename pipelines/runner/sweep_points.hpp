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
  std::vector<Json> values;         // one an axis; null: as the recipe has it
  std::vector<std::size_t> places;  // of the values, in SweepAxis::places
};
// All points of a plan with a sweep, in order. Throws ConfigError when there are too many.
std::vector<SweepPoint> sweep_points(const Plan& plan);
// The plan of one point. Throws ConfigError, shown at the place of the value that is wrong.
Plan plan_at(const Plan& plan, const SweepPoint& point);

// Reads the recipe of every point. Throws ConfigError; else returns the warnings of the points, each kind once and with
// the number of points that have it.
std::vector<Warning> check_points(const Plan& plan);

}  // namespace shakebed::pipelines
