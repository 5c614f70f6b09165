// The record of a point of a sweep, and whether its results are up to date.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/runner/plan.hpp"

namespace shakebed::pipelines {

// File with the record: a point is done if it names the same recipe and the same values.
inline constexpr std::string_view point_record = ".point";

// What decides the results of a point, and of each of its stages: kind, code, options, seed, external files and what it
// reads from.
struct PointKeys {
  std::string point;
  std::vector<std::string> stages;
};
PointKeys keys_of(const Plan& at);

// {"key", "code", "error", "warnings", "failed_checks", "cells", "pointers", "verdict"}; nothing when there is none.
std::optional<Json> read_point(const std::filesystem::path& directory);
// How a point ended when it was last run with this key; nothing when it was not.
std::optional<int> code_of_point(const std::filesystem::path& directory, const std::string& key);
// Whether a point that ended so need not run again.
inline bool is_done(std::optional<int> code) { return code && (*code == exit_ok || *code == exit_check_failed); }

// Pointers to the numbers to gather; the headline numbers of every stage and its answer's T where the recipe names
// none.
std::vector<std::string> collected(const Plan& plan);
// These numbers of a point: value and standard error each, "" for what is not there.
std::vector<std::string> gather_cells(const Plan& plan, const std::filesystem::path& directory,
                                      const std::vector<std::string>& pointers);
// The stage whose answer a point is judged by: the first that gives one; null where none does.
const PlannedStage* answering_stage(const Plan& plan);
// Its verdict, "one temperature" ...; "" where there is none.
std::string verdict_of(const Plan& plan, const std::filesystem::path& directory);
// A value of the recipe or of a result in a cell.
std::string value_text(const Json& value);

}  // namespace shakebed::pipelines
