// Starting another program, by an argument list and never through a shell.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace shakebed::pipelines {

struct ProcessResult {
  int exit_code = 0;      // 128 + signal when killed by one
  std::string output;     // stdout and stderr together
  double peak_bytes = 0;  // of resident memory, its own
};
// Runs `arguments[0]` (looked up in PATH) in `directory` and waits. Throws StageError when it cannot be started.
ProcessResult run_process(const std::vector<std::string>& arguments, const std::filesystem::path& directory);

}  // namespace shakebed::pipelines
