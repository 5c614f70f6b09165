// Sweeps: one recipe at many points, on one machine or in shards on many.
//
// A point is the recipe with some values changed. Its results stand in OUT/points/<name>/, so that points are finished,
// failed and retried one by one; what is up to date is kept. All of them are gathered into OUT/sweep.csv, one row a
// point.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipelines/runner/console.hpp"
#include "pipelines/runner/plan.hpp"
#include "pipelines/runner/run.hpp"
#include "pipelines/runner/sweep_points.hpp"

namespace shakebed::pipelines {

struct SweepArguments {
  std::optional<std::string> shard;  // "2/8"
  bool gather = false;               // run nothing, gather what is there
  bool dry_run = false;
  bool json = false;  // no text on stdout
  Json result{};      // set: what --json prints
};
// Runs what is missing of a sweep, gathers what is there, has the pages written. Returns the exit code.
int run_sweep_command(const Plan& plan, const RunOptions& options, SweepArguments& arguments, const Pages& pages,
                      Console& console);

// {"points", "done", "failed", "left_over"} of a folder with a sweep, null of any other.
Json sweep_status(const std::filesystem::path& out);

}  // namespace shakebed::pipelines
