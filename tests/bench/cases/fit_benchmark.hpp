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

// A knob turned: error against time.
struct FitTradeOff {
  std::string knob;          // "iterations" of a fit, "table size" of the inverse, "bins" of a profile
  std::string setting;       // "kernel gaussian", "interpolation alone", "with one Newton step", ...
  double value = 0.0;        // of the knob: iterations, nodes, bins
  double nanoseconds = 0.0;  // a fit, or a value of the inverse; the least of the repeats
  // Relative. iterations: T against the converged fit's; table size: worst over the table's range against the exact
  // inverse; bins: the standard error of T, for one and the same measurement (its disks counted into more bins).
  double error = 0.0;
  bool standard = false;  // what the program does by default
};
std::vector<FitTradeOff> benchmark_fit_trade_offs(double effort = 1.0);

}  // namespace shakebed::fit
