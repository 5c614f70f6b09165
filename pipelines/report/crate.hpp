// ro-crate-metadata.json: what was made from what, as RO-Crate 1.1 (JSON-LD) says it, so that a repository or a journal
// can read it [https://www.researchobject.org/ro-crate/1.1/]. The same run has the same bytes: files that hold times
// (manifest.json, report.html, summary.md) are named without size and hash, and datePublished is the day of the
// program's source, whose results these are.
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
