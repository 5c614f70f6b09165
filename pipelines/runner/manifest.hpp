// manifest.json: what was run, with what, by what, when, and the fingerprints of everything read and written.
#pragma once

#include <string>
#include <vector>

#include "pipelines/runner/run.hpp"

namespace shakebed::pipelines {

std::string program_version();  // that of CMakeLists.txt: "major.minor.patch"
std::string source_revision();  // git commit of the build, "-dirty" if changed; "" outside git
std::string compiler_text();
std::string utc_now();  // 2026-11-21T02:27:48Z
std::string host_name();

// The recipe of a run: file, fingerprint, directory, preset, changes.
Json recipe_json(const Plan& plan, const RunOptions& options);
Json manifest_json(const Plan& plan, const RunOptions& options, const RunOutcome& outcome, const std::string& started);

// Recomputes the SHA-256 of everything a manifest lists.
struct VerifyResult {
  std::size_t files = 0;
  std::vector<std::string> problems;  // "fit/fit.json: changed since", "...: missing"
};
// Throws InputError when there is no manifest.
VerifyResult verify_output(const std::filesystem::path& out);

}  // namespace shakebed::pipelines
