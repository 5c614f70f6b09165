// How a program of ours ends: what went wrong on stderr, a line a problem, and the exit code that says which kind it
// was.
#pragma once

#include <functional>

namespace shakebed::pipelines {

// Runs `program` and returns its exit code, or that of the Error it threw.
int exit_code_of(const std::function<int()>& program);

}  // namespace shakebed::pipelines
