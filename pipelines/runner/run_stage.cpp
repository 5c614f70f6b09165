#include "pipelines/runner/run_stage.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <mutex>
#include <numeric>

#include "pipelines/formats/files.hpp"
#include "pipelines/runner/expected_time.hpp"
#include "pipelines/runner/manifest.hpp"
#include "statistics/parallel.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

constexpr std::int64_t progress_interval =
    50'000'000;                                     // [ns] between two lines, whatever the stage does: eyes see no more
constexpr std::int64_t clock_tick = 3'000'000'000;  // [ns] more than the coarsest file system's (FAT: 2 s)

double cpu_seconds_so_far() {
  rusage own{}, children{};
  getrusage(RUSAGE_SELF, &own);
  getrusage(RUSAGE_CHILDREN, &children);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(own.ru_utime) + seconds(own.ru_stime) + seconds(children.ru_utime) + seconds(children.ru_stime);
}

// Puts a finished folder in its place in one step; what stood there before is removed.
void publish(const fs::path& finished, const fs::path& place) {
  std::error_code error;
  if (fs::exists(place, error)) {
    if (::renameat2(AT_FDCWD, finished.c_str(), AT_FDCWD, place.c_str(), RENAME_EXCHANGE) == 0) {
      fs::remove_all(finished, error);
      return;
    }
    // File systems without an exchange: for a moment neither is there, never half of one.
    const fs::path old = finished.string() + "-old";
    fs::rename(place, old);
    fs::rename(finished, place);
    fs::remove_all(old, error);
    return;
  }
  fs::rename(finished, place);
}

std::optional<Stamp> stamp_of(const fs::path& path) {
  const auto nanoseconds = [](const timespec& t) { return t.tv_sec * std::int64_t{1'000'000'000} + t.tv_nsec; };
  timespec now{};
  struct stat found {};
  if (::clock_gettime(CLOCK_REALTIME, &now) != 0 || ::stat(path.c_str(), &found) != 0) return std::nullopt;
  const Stamp stamp{found.st_dev, found.st_ino, found.st_size, nanoseconds(found.st_mtim), nanoseconds(found.st_ctim)};
  if (std::max(stamp.modified, stamp.changed) > nanoseconds(now) - clock_tick) return std::nullopt;
  return stamp;
}

// What a stage read must be there at its end as it was at its beginning: files that vanish or change meanwhile give a
// result that belongs to neither, and its record would say that it counts. Results of other stages are read here for
// the first time (their fingerprints are those of their records), external files only if they were touched.
void check_inputs_stayed(const StageWork& work, const fs::path& out) {
  const PlannedStage& stage = *work.stage;
  const StageRecord& fresh = work.fresh;
  const std::size_t first_external = fresh.inputs.size() - stage.input_files.size();
  for (std::size_t i = 0; i < fresh.inputs.size(); ++i) {
    const Fingerprint& was = fresh.inputs[i];
    const bool external = i >= first_external;
    const fs::path path = external ? fs::path(stage.input_files[i - first_external].second) : out / was.file;
    std::error_code error;
    const auto bytes = fs::file_size(path, error);
    if (error)
      throw StageError(fmt::format("{}: this file was deleted while the stage read it. Run again", path.string()));
    if (external && work.stamps[i - first_external] && stamp_of(path) == work.stamps[i - first_external]) continue;
    if (bytes != was.bytes || fast_hash_of_file(path) != was.fast)
      throw StageError(fmt::format(
          "{}: this file changed while the stage read it, or it differs from its record. Run again", path.string()));
  }
}

class StageRun : public RunContext {
 public:
  StageRun(const PlannedStage& stage, std::vector<Input> inputs, fs::path directory, fs::path scratch,
           const RunOptions& options, Console* console)
      : stage_(stage),
        inputs_(std::move(inputs)),
        directory_(std::move(directory)),
        scratch_(std::move(scratch)),
        jobs_(options.jobs > 0 ? options.jobs : processors()),
        on_progress_(options.on_progress),
        console_(console) {}

  const std::vector<Input>& inputs() const override { return inputs_; }
  std::uint64_t seed() const override { return stage_.seed; }
  const ResultList& stated() const override { return *stage_.results; }
  int jobs() const override { return jobs_; }
  const fs::path& output_directory() const override { return directory_; }
  const fs::path& scratch() override {
    const std::lock_guard lock(mutex_);
    try {
      fs::create_directories(scratch_);
    } catch (const fs::filesystem_error& error) {
      throw StageError(fmt::format("{}: this folder cannot be created: {}", scratch_.string(), error.code().message()));
    }
    return scratch_;
  }
  void progress(double fraction, std::string_view what) override {
    if (console_ == nullptr && !on_progress_) return;
    const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
    auto last = last_progress_.load(std::memory_order_relaxed);
    if (now - last < progress_interval || !last_progress_.compare_exchange_strong(last, now)) return;
    if (on_progress_) on_progress_(stage_.id, fraction);
    if (console_ != nullptr) console_->progress(stage_.id, fraction, what);
  }
  bool interrupted() const override { return interrupt_requested(); }
  void log(std::string_view line) override {
    const std::lock_guard lock(mutex_);
    log_ += line;
    log_ += '\n';
    if (console_ != nullptr) console_->detail(fmt::format("  {}: {}", stage_.id, line));
  }
  void warning(std::string_view sentence) override {
    const std::lock_guard lock(mutex_);
    if (std::find(warnings.begin(), warnings.end(), sentence) != warnings.end()) return;
    warnings.emplace_back(sentence);
    if (console_ != nullptr) console_->warning(fmt::format("{}: {}", stage_.id, sentence));
  }
  void notice(std::string_view sentence) override {
    if (console_ != nullptr) console_->warning(fmt::format("{}: {}", stage_.id, sentence));
  }
  void timing(std::string_view name, double value) override {
    const std::lock_guard lock(mutex_);
    timings[std::string(name)] = value;
  }
  void check_failed(std::string_view sentence) override {
    const std::lock_guard lock(mutex_);
    failed_checks.emplace_back(sentence);
  }
  std::vector<Input> run_chain(const JsonNode& recipe, const fs::path& folder, const Progress& progress) override;
  double trial_of_chain(const JsonNode& recipe) const override;
  const std::string& log_text() const { return log_; }

  std::vector<std::string> warnings, failed_checks;
  Json timings = Json::object();

 private:
  const PlannedStage& stage_;
  std::vector<Input> inputs_;
  fs::path directory_, scratch_;
  int jobs_;
  const std::function<void(const std::string&, double)>& on_progress_;
  Console* console_;
  std::mutex mutex_;
  std::string log_;
  std::atomic<std::int64_t> last_progress_{0};
};

double StageRun::trial_of_chain(const JsonNode& recipe) const {
  const std::vector<double> seconds = trial_seconds(make_plan(recipe, "(chain)", fs::current_path()));
  return std::accumulate(seconds.begin(), seconds.end(), 0.0);
}

std::vector<Input> StageRun::run_chain(const JsonNode& recipe, const fs::path& folder, const Progress& progress) {
  const Plan plan = make_plan(recipe, "(chain)", fs::current_path());
  RunOptions options;
  options.out = folder;
  options.jobs = 1;
  fs::create_directories(folder);
  remove_leftovers(folder);
  if (progress)
    options.on_progress = [&](const std::string& id, double fraction) {
      progress(fraction_of_plan(plan, {}, plan.index_of(id), fraction));
    };
  RunOutcome outcome;
  outcome.out = folder;
  run_stages(plan, options, nullptr, outcome);
  if (outcome.code == exit_interrupted) throw Interrupted();
  if (outcome.code != exit_ok && outcome.code != exit_check_failed) throw StageError(outcome.error);
  std::vector<Input> finished;
  for (const PlannedStage& stage : plan.stages) finished.push_back(input_of(stage, folder));
  return finished;
}

// A temporary folder below OUT, removed with what is in it unless it has been published.
class WorkingFolder {
 public:
  WorkingFolder(const fs::path& out, const std::string& id)
      : path_(out / fmt::format("{}{}-{}", partial_prefix, id, ::getpid())) {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
    try {
      fs::create_directories(path_);
    } catch (const fs::filesystem_error& error) {
      throw StageError(fmt::format("{}: cannot be written: {}", out.string(), error.code().message()));
    }
  }
  ~WorkingFolder() {
    std::error_code error;
    fs::remove_all(path_, error);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

StageWork work_of(const PlannedStage& stage, const std::vector<const StageRecord*>& upstream,
                  std::vector<Input> inputs) {
  StageWork work{.stage = &stage, .inputs = std::move(inputs), .stamps = {}, .fresh = {}};
  for (const auto& [pointer, path] : stage.input_files) work.stamps.push_back(stamp_of(path));
  work.fresh = fresh_record(stage, upstream);
  return work;
}

FinishedWork run_stage(StageWork work, const RunOptions& options, Console* console) {
  const PlannedStage& stage = *work.stage;
  const fs::path scratch = scratch_folder(options.out, work.fresh);
  std::error_code ignored;
  if (options.force) fs::remove_all(scratch, ignored);
  const WorkingFolder working(options.out, stage.id);
  const auto wall_start = std::chrono::steady_clock::now();
  const double cpu_start = cpu_seconds_so_far();
  FinishedWork finished;
  StageCost& cost = finished.cost;
  cost.threads = options.jobs > 0 ? options.jobs : processors();
  cost.host = host_name();
  StageRun context(stage, std::move(work.inputs), working.path(), scratch, options, console);
  stage.stage->run(context);
  context.check_interrupted();
  check_inputs_stayed(work, options.out);
  cost.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count();
  cost.cpu_seconds = cpu_seconds_so_far() - cpu_start;
  cost.finished = utc_now();
  cost.timings = context.timings;
  finished.record = std::move(work.fresh);
  finished.record.outputs = fingerprint_directory(working.path(), true);
  finished.record.warnings = context.warnings;
  finished.record.failed_checks = context.failed_checks;
  if (!context.log_text().empty()) write_file(working.path() / "log.txt", context.log_text());
  write_file(working.path() / cost_name, dump(cost.to_json()));
  write_file(working.path() / record_name, dump(finished.record.to_json()));
  publish(working.path(), options.out / stage.id);
  // Finished: nothing of it, nor of what was begun with other options, is needed any more.
  fs::remove_all(scratch.parent_path(), ignored);
  fs::remove(options.out / scratch_name, ignored);
  return finished;
}

}  // namespace shakebed::pipelines
