// sweep.csv: a row a point, plain numbers in SI, units in the names of the columns.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "pipelines/formats/table.hpp"
#include "pipelines/runner/plan.hpp"

namespace shakebed::pipelines {

// "/stages/bed/floor/amplitude" in m → "bed_floor_amplitude_m", "/fit/temperature" in m g D → "fit_temperature".
std::string column_name(const std::string& pointer, const std::string& unit);

// Of a number that is collected, as its stage states it; "1" where it has none.
std::string unit_of_result(const Plan& plan, const std::string& pointer);

// The last column where a stage of the recipe gives an answer.
inline constexpr std::string_view verdict_column = "verdict";

// "Verdicts: 3 one temperature, 2 no single temperature" of points by verdict; "" where there are none.
std::string verdicts_text(const std::map<std::string, std::size_t>& verdicts);

// The table of a sweep. Its columns are point, replica, status and the values of the axes as they stand in the recipe.
// Then come value and standard error of every collected number, and the verdict of the point's answer.
Table sweep_table(const Plan& plan, const std::vector<std::string>& collected,
                  const std::vector<std::vector<std::string>>& rows);

}  // namespace shakebed::pipelines
