// One stage: made in a temporary folder, put in its place when it has finished.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "pipelines/runner/cache.hpp"
#include "pipelines/runner/run.hpp"

namespace shakebed::pipelines {

// When a file was last changed. Equal stamps mean equal bytes, so a film of many GB is not read a second time: writing
// sets both times, and the second one (ctime) cannot be set back. A clock's tick (2 s at most, on FAT) could hide a
// change right after another one. So a file changed just before, or in a clock's future, has no stamp.
struct Stamp {
  dev_t device;
  ino_t inode;
  off_t bytes;
  std::int64_t modified, changed;  // [ns]
  bool operator==(const Stamp&) const = default;
};

// What a stage will be made from, as it stands now.
struct StageWork {
  const PlannedStage* stage = nullptr;
  std::vector<Input> inputs;
  std::vector<std::optional<Stamp>> stamps;  // of its external files, taken before they were read for `fresh`
  StageRecord fresh;
};
// `upstream` are the records of the stages that it reads from, `inputs` their folders.
StageWork work_of(const PlannedStage& stage, const std::vector<const StageRecord*>& upstream,
                  std::vector<Input> inputs);

struct FinishedWork {
  StageRecord record;
  StageCost cost;
};
// Runs the stage and publishes its folder. Throws what the stage throws; its place is then as it was.
FinishedWork run_stage(StageWork work, const RunOptions& options, Console* console);

inline constexpr std::string_view partial_prefix = ".partial-";

}  // namespace shakebed::pipelines
