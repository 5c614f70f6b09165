// A sweep on a cluster.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/runner/console.hpp"
#include "pipelines/runner/plan.hpp"

namespace shakebed::pipelines {

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
