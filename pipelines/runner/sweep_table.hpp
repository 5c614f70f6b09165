// sweep.csv: a row a point, plain numbers in SI, units in the names of the columns.
#pragma once

#include <string>
#include <vector>

#include "pipelines/formats/table.hpp"
#include "pipelines/runner/plan.hpp"

namespace shakebed::pipelines {

// "/stages/bed/floor/amplitude" in m → "bed_floor_amplitude_m", "/fit/temperature" in m g D → "fit_temperature".
std::string column_name(const std::string& pointer, const std::string& unit);

// From what was gathered: point, replica, status, the values of the axes as they stand in the recipe, then value and
// standard error of every collected number.
Table sweep_table(const Plan& plan, const std::vector<std::string>& collected,
                  const std::vector<std::vector<std::string>>& rows);

}  // namespace shakebed::pipelines
