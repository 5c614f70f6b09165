// report.html: one file that shows everything, without a network: warnings first, the figures, the bed, the numbers
// beside the published ones, what was assumed, the stages with their times, and where it all came from.
//
// What depends on the machine stands between <!-- times --> and <!-- /times -->, here and in summary.md: without these
// blocks the pages of two runs with the same seeds are equal byte for byte.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipelines/runner/run.hpp"

namespace shakebed::pipelines {

std::string report_html(const Plan& plan, const RunOutcome& outcome);

// The table of our numbers beside the published ones, for the terminal; "" where the recipe names none.
std::string published_text(const Plan& plan, const RunOutcome& outcome);

// The page of a sweep: its figures and its table (the first row is the header; long tables are cut and say so).
std::string sweep_report_html(const Plan& plan, const std::vector<std::vector<std::string>>& table,
                              const std::vector<std::filesystem::path>& figures,
                              const std::vector<std::string>& problems);

// For other pages of ours. The page up to and with its headline; it ends with "</main>\n</body>\n</html>\n".
std::string page_head(const std::string& title);
// An SVG file as part of a page: without its prolog, its ids made its own by the number.
std::string inline_svg(const std::filesystem::path& path, int number);

// One page in Markdown, for the summary of a CI job: verdict, checks, numbers beside the published ones, warnings,
// stages.
std::string summary_markdown(const Plan& plan, const RunOutcome& outcome);
// The same of a sweep: counts, failed points, the first rows of its table.
std::string sweep_summary_markdown(const Plan& plan, const std::vector<std::vector<std::string>>& table,
                                   const std::vector<std::string>& problems);

}  // namespace shakebed::pipelines
