// report.html: one file that shows everything, without a network: warnings first, the figures, the bed, the numbers
// beside the published ones, what was assumed, the stages with their times, and where it all came from.
#pragma once

#include <string>

#include "pipelines/run.hpp"

namespace shakebed::pipelines {

std::string report_html(const Plan& plan, const RunOutcome& outcome);

// The table of our numbers beside the published ones, for the terminal; "" where the recipe names none.
std::string published_text(const Plan& plan, const RunOutcome& outcome);

}  // namespace shakebed::pipelines
