#include "pipelines/runner/shared_stages.hpp"

#include <chrono>
#include <optional>
#include <thread>

#include "pipelines/formats/errors.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

constexpr std::chrono::milliseconds lock_interval{50};  // between two looks at a folder where another shard works

void link(const fs::path& target, const fs::path& place) {
  std::error_code error;
  if (fs::is_symlink(place, error) && fs::read_symlink(place, error) == target) return;
  fs::remove_all(place, error);
  fs::create_directory_symlink(target, place);
}

}  // namespace

void SharedStages::count(const PointKeys& keys) {
  for (const std::string& key : keys.stages) ++uses_[key];
}

bool SharedStages::is_shared(const std::string& key) const {
  const auto found = uses_.find(key);
  return found != uses_.end() && found->second > 1;
}

void SharedStages::prepare(const Plan& at, const PointKeys& keys, const fs::path& directory) {
  for (std::size_t i = 0; i < at.stages.size(); ++i) {
    if (!is_shared(keys.stages[i]) || !make(at, keys, i)) continue;
    link("../../shared/" + keys.stages[i] + "/" + at.stages[i].id, directory / at.stages[i].id);
  }
}

std::shared_ptr<SharedStages::Entry> SharedStages::entry_of(const std::string& key) {
  const std::lock_guard lock(mutex_);
  std::shared_ptr<Entry>& found = entries_[key];
  if (!found) found = std::make_shared<Entry>();
  return found;
}

bool SharedStages::make(const Plan& at, const PointKeys& keys, std::size_t i) {
  const std::shared_ptr<Entry> entry = entry_of(keys.stages[i]);
  const std::lock_guard lock(entry->mutex);  // one thread makes it, the others wait
  if (entry->tried) return entry->good;
  fs::create_directories(root_ / keys.stages[i]);
  std::optional<FolderLock> folder_lock;
  while (!folder_lock) {  // so do other shards
    try {
      folder_lock.emplace(root_ / keys.stages[i]);
    } catch (const StageError&) {
      if (interrupt_requested()) return false;
      std::this_thread::sleep_for(lock_interval);
    }
  }
  return run(at, keys, i, *entry);
}

bool SharedStages::run(const Plan& at, const PointKeys& keys, std::size_t i, Entry& entry) {
  const fs::path directory = root_ / keys.stages[i];
  if (force_) {
    std::error_code error;
    fs::remove_all(directory / at.stages[i].id, error);
    fs::remove_all(directory / scratch_name, error);
  }
  remove_leftovers(directory);
  for (const std::size_t k : at.stages[i].from)
    link("../" + keys.stages[k] + "/" + at.stages[k].id, directory / at.stages[k].id);
  RunOptions one;
  one.out = directory;
  one.only = at.stages[i].id;
  one.jobs = 1;
  RunOutcome outcome;
  outcome.out = directory;
  run_stages(at, one, nullptr, outcome);
  entry.tried = outcome.code != exit_interrupted;
  entry.good = outcome.stages[i].state == StageState::ran || outcome.stages[i].state == StageState::kept;
  return entry.good;
}

}  // namespace shakebed::pipelines
