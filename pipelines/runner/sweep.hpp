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
int run_sweep_command(const Plan& plan, const RunOptions& options, SweepArguments& arguments, Console& console);

// {"points", "done", "failed"} of a folder with a sweep, null of any other.
Json sweep_status(const std::filesystem::path& out);

struct SlurmOptions {
  int shards = 1;
  std::vector<std::string> sbatch;    // more options
  std::optional<std::string> preset;  // --preset and --set of the submission
  std::vector<std::string> settings;
  bool dry_run = false, json = false;
  std::filesystem::path out;
};
// Submits a job array, one task a shard that has something left to do, and a job that gathers when all have ended.
// Throws StageError when jobs of this sweep are still in the queue, or sbatch refuses.
int submit_slurm(const Plan& plan, const SlurmOptions& options, Console& console);

}  // namespace shakebed::pipelines
