// How long the stages of a recipe will take, before they run: for the time left, never for a result.
#pragma once

#include <cstddef>
#include <vector>

#include "pipelines/runner/plan.hpp"

namespace shakebed::pipelines {

// Seconds of a processor by the trial of each stage (Stage::trial_seconds); 0: little or unknown, or the trial failed.
std::vector<double> trial_seconds(const Plan& plan);

// The share of a plan's time that is over where a stage has done this fraction. `seconds` of each stage; where there
// are none, stages with random numbers count the same and the others nothing: they are quick beside a simulation.
double fraction_of_plan(const Plan& plan, const std::vector<double>& seconds, std::size_t stage, double fraction);

}  // namespace shakebed::pipelines
