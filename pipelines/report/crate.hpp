// ro-crate-metadata.json: the inputs and outputs of a run as RO-Crate 1.1 (JSON-LD), for a repository or a journal
// [https://www.researchobject.org/ro-crate/1.1/]. The same run has the same bytes. Files that hold times
// (manifest.json, report.html, summary.md) are therefore named without size and hash. For the same reason datePublished
// is the day of the program's source that made the results.
#pragma once

#include <string_view>

#include "pipelines/runner/pages.hpp"

namespace shakebed::pipelines {

inline constexpr std::string_view crate_name = "ro-crate-metadata.json";

Json crate_json(const Plan& plan, const RunOutcome& outcome);
// Of a sweep: its table, its figures, and the folders of its points, which have metadata of their own where they have a
// page.
Json crate_json(const Plan& plan, const SweepOutcome& sweep);

}  // namespace shakebed::pipelines
