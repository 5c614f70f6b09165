#pragma once

#include <string>
#include <vector>

// Speed against error of this room: what `shakebed bench fit` prints.
namespace shakebed::fit {

struct FitBenchmarkRow {
  std::string what;          // "inverse", "constants", "fit"
  std::string setting;       // "enskog, batch", "kernel gaussian", ...
  int size = 0;              // values or bins
  double nanoseconds = 0.0;  // per value (inverse, constants) or per fit; the least of the repeats
  double error = 0.0;        // relative, against the truth the input was made from
};

// `effort` scales the repeats (1: about a second in all).
std::vector<FitBenchmarkRow> benchmark_fit(double effort = 1.0);

}  // namespace shakebed::fit
