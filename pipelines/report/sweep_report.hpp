// The pages of a sweep: report.html with its figures and its table, once every point is there; summary.md always.
#pragma once

#include "pipelines/runner/pages.hpp"

namespace shakebed::pipelines {

void write_sweep_pages(const Plan& plan, const SweepOutcome& sweep);

}  // namespace shakebed::pipelines
