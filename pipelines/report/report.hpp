// report.html: one file that shows everything, without a network. The order is: the answer; the figure that shows it;
// the warnings; the bed and its film. Then: the figures; the numbers beside the published ones; the assumptions; the
// stages with their times; the sources. The pages of a stage are the stage's own (StagePages).
//
// What depends on the machine stands between <!-- times --> and <!-- /times -->, here and in summary.md. Without these
// blocks the pages of two runs with the same seeds are equal byte for byte.
#pragma once

#include <string>

#include "pipelines/runner/pages.hpp"

namespace shakebed::pipelines {

// Writes report.html and summary.md of runs and of sweeps.
const Pages& report_pages();

// For the terminal: the table of our numbers beside the published ones, or, where the recipe names none, what the
// stages say.
std::string terminal_text(const Plan& plan, const RunOutcome& outcome);

}  // namespace shakebed::pipelines
