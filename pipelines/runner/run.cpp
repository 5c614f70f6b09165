#include "pipelines/runner/run.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <mutex>
#include <optional>
#include <thread>

#include "pipelines/formats/files.hpp"
#include "pipelines/report/report.hpp"
#include "pipelines/runner/manifest.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

std::string_view to_string(StageState state) {
  switch (state) {
    case StageState::ran:
      return "ran";
    case StageState::kept:
      return "up to date";
    case StageState::not_selected:
      return "not selected";
    case StageState::failed:
      return "failed";
    case StageState::interrupted:
      return "interrupted";
    case StageState::waiting:
      return "not run";
  }
  return "";
}

// --- interrupts

namespace {
std::atomic<bool> interrupt_flag{false};
static_assert(std::atomic<bool>::is_always_lock_free);
extern "C" void on_interrupt(int) {
  if (interrupt_flag.exchange(true)) _exit(exit_interrupted);
}
}  // namespace

void install_interrupt_handler() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);
}
bool interrupt_requested() { return interrupt_flag.load(std::memory_order_relaxed); }

// --- the lock

FolderLock::FolderLock(const fs::path& folder) : path_(folder / ".lock") {
  while (true) {
    descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor_ < 0)
      throw StageError(fmt::format("{}: cannot be written: {}", folder.string(), std::strerror(errno)));
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
      char owner[256] = {};
      const ssize_t size = ::read(descriptor_, owner, sizeof owner - 1);
      ::close(descriptor_);
      throw StageError(fmt::format("{}: another shakebed works there{}{}; wait for it, or choose another --out",
                                   folder.string(), size > 0 ? ": " : "", size > 0 ? owner : ""));
    }
    // The file may have been removed between opening and locking: then this lock is on nothing.
    struct stat held {
    }, named{};
    if (::fstat(descriptor_, &held) == 0 && ::stat(path_.c_str(), &named) == 0 && held.st_ino == named.st_ino) break;
    ::close(descriptor_);
  }
  char host[128] = "?";
  ::gethostname(host, sizeof host - 1);
  const std::string owner = fmt::format("process {} on {}", ::getpid(), host);
  if (::ftruncate(descriptor_, 0) != 0 || ::pwrite(descriptor_, owner.data(), owner.size(), 0) < 0) {
    // Only a courtesy to whoever finds the folder locked; the lock itself holds.
  }
}

FolderLock::~FolderLock() {
  if (descriptor_ < 0) return;
  ::unlink(path_.c_str());
  ::close(descriptor_);
}

// --- running

namespace {

constexpr std::string_view partial_prefix = ".partial-";

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

class StageRun : public RunContext {
 public:
  StageRun(const PlannedStage& stage, std::vector<Input> inputs, fs::path directory, fs::path scratch, int jobs,
           Console* console)
      : stage_(stage),
        inputs_(std::move(inputs)),
        directory_(std::move(directory)),
        scratch_(std::move(scratch)),
        jobs_(jobs),
        console_(console) {}

  const std::vector<Input>& inputs() const override { return inputs_; }
  std::uint64_t seed() const override { return stage_.seed; }
  int jobs() const override { return jobs_; }
  const fs::path& output_directory() const override { return directory_; }
  const fs::path& scratch() override {
    const std::lock_guard lock(mutex_);
    try {
      fs::create_directories(scratch_);
    } catch (const fs::filesystem_error& error) {
      throw StageError(fmt::format("{}: cannot be made: {}", scratch_.string(), error.code().message()));
    }
    return scratch_;
  }
  void progress(double fraction, std::string_view what) override {
    if (console_ == nullptr) return;
    // At most every 50 ms, whatever the stage does.
    const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
    auto last = last_progress_.load(std::memory_order_relaxed);
    if (now - last < 50'000'000 || !last_progress_.compare_exchange_strong(last, now)) return;
    console_->progress(stage_.id, fraction, what);
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
  void timing(std::string_view name, double value) override {
    const std::lock_guard lock(mutex_);
    timings[std::string(name)] = value;
  }
  void check_failed(std::string_view sentence) override {
    const std::lock_guard lock(mutex_);
    failed_checks.emplace_back(sentence);
  }
  const std::string& log_text() const { return log_; }

  std::vector<std::string> warnings, failed_checks;
  Json timings = Json::object();

 private:
  const PlannedStage& stage_;
  std::vector<Input> inputs_;
  fs::path directory_, scratch_;
  int jobs_;
  Console* console_;
  std::mutex mutex_;
  std::string log_;
  std::atomic<std::int64_t> last_progress_{0};
};

// Which stages take part.
std::vector<bool> selection(const Plan& plan, const RunOptions& options) {
  const std::size_t n = plan.stages.size();
  std::vector<bool> selected(n, true);
  if (options.only) {
    selected.assign(n, false);
    selected[plan.index_of(*options.only)] = true;
  }
  if (options.from) {
    std::vector<bool> below(n, false);
    below[plan.index_of(*options.from)] = true;
    for (std::size_t i = 0; i < n; ++i) {
      for (const std::size_t k : plan.stages[i].from) {
        if (below[k]) below[i] = true;
      }
    }
    for (std::size_t i = 0; i < n; ++i) selected[i] = selected[i] && below[i];
  }
  if (options.until) {
    std::vector<bool> above(n, false);
    above[plan.index_of(*options.until)] = true;
    for (std::size_t i = n; i-- > 0;) {
      if (!above[i]) continue;
      for (const std::size_t k : plan.stages[i].from) above[k] = true;
    }
    for (std::size_t i = 0; i < n; ++i) selected[i] = selected[i] && above[i];
  }
  return selected;
}

int processors() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

// When a file was last touched. Equal stamps mean equal bytes, without reading a film of many GB a second time: writing
// sets both times, and the second one (ctime) cannot be set back. A clock's tick (2 s at most, on FAT) could hide a
// change right after another one, so a file touched just before, or in a clock's future, has no stamp.
struct Stamp {
  dev_t device;
  ino_t inode;
  off_t bytes;
  std::int64_t modified, changed;  // [ns]
  bool operator==(const Stamp&) const = default;
};
std::optional<Stamp> stamp_of(const fs::path& path) {
  const auto nanoseconds = [](const timespec& t) { return t.tv_sec * std::int64_t{1'000'000'000} + t.tv_nsec; };
  timespec now{};
  struct stat found {};
  if (::clock_gettime(CLOCK_REALTIME, &now) != 0 || ::stat(path.c_str(), &found) != 0) return std::nullopt;
  const Stamp stamp{found.st_dev, found.st_ino, found.st_size, nanoseconds(found.st_mtim), nanoseconds(found.st_ctim)};
  if (std::max(stamp.modified, stamp.changed) > nanoseconds(now) - 3'000'000'000) return std::nullopt;
  return stamp;
}

// Stamps of a stage's external files, taken before they are read for their fingerprints.
using Stamps = std::vector<std::optional<Stamp>>;
Stamps stamps_of(const PlannedStage& stage) {
  Stamps stamps;
  for (const auto& [pointer, path] : stage.input_files) stamps.push_back(stamp_of(path));
  return stamps;
}

// What a stage read must be there at its end as it was at its beginning: files that vanish or change meanwhile give a
// result that belongs to neither, and its record would say that it counts. Results of other stages are read here for
// the first time (their fingerprints are those of their records), external files only if they were touched.
void check_inputs_stayed(const PlannedStage& stage, const StageRecord& fresh, const Stamps& stamps,
                         const fs::path& out) {
  const std::size_t first_external = fresh.inputs.size() - stage.input_files.size();
  for (std::size_t i = 0; i < fresh.inputs.size(); ++i) {
    const Fingerprint& was = fresh.inputs[i];
    const bool external = i >= first_external;
    const fs::path path = external ? fs::path(stage.input_files[i - first_external].second) : out / was.file;
    std::error_code error;
    const auto bytes = fs::file_size(path, error);
    if (error) throw StageError(fmt::format("{}: vanished while it was read; run again", path.string()));
    if (external && stamps[i - first_external] && stamp_of(path) == stamps[i - first_external]) continue;
    if (bytes != was.bytes || fast_hash_of_file(path) != was.fast)
      throw StageError(
          fmt::format("{}: changed while it was read, or is not what its record says; run again", path.string()));
  }
}

StageRecord run_stage(const PlannedStage& stage, StageRecord fresh, const Stamps& stamps, std::vector<Input> inputs,
                      const RunOptions& options, Console* console) {
  const fs::path place = options.out / stage.id;
  const fs::path working = options.out / fmt::format("{}{}-{}", partial_prefix, stage.id, ::getpid());
  const fs::path scratch = scratch_folder(options.out, fresh);
  std::error_code ignored;
  fs::remove_all(working, ignored);
  if (options.force) fs::remove_all(scratch, ignored);
  struct Remover {
    const fs::path& path;
    ~Remover() {
      std::error_code error;
      fs::remove_all(path, error);
    }
  } remover{working};
  try {
    fs::create_directories(working);
  } catch (const fs::filesystem_error& error) {
    throw StageError(fmt::format("{}: cannot be written: {}", options.out.string(), error.code().message()));
  }
  const auto wall_start = std::chrono::steady_clock::now();
  const double cpu_start = cpu_seconds_so_far();
  StageRun context(stage, std::move(inputs), working, scratch, options.jobs > 0 ? options.jobs : processors(), console);
  stage.stage->run(context);
  context.check_interrupted();
  check_inputs_stayed(stage, fresh, stamps, options.out);
  fresh.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count();
  fresh.cpu_seconds = cpu_seconds_so_far() - cpu_start;
  fresh.outputs = fingerprint_directory(working, true);
  fresh.warnings = context.warnings;
  fresh.failed_checks = context.failed_checks;
  fresh.timings = context.timings;
  if (!context.log_text().empty()) write_file(working / "log.txt", context.log_text());
  write_file(working / record_name, dump(fresh.to_json()));
  publish(working, place);
  // Finished: nothing of it, nor of what was begun with other options, is needed any more.
  fs::remove_all(scratch.parent_path(), ignored);
  fs::remove(options.out / scratch_name, ignored);
  return fresh;
}

}  // namespace

fs::path scratch_folder(const fs::path& out, const StageRecord& fresh) {
  return out / scratch_name / fresh.id / fast_hash(work_key(fresh) + source_revision());
}

void remove_leftovers(const fs::path& out) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(out, error)) {
    const std::string name = entry.path().filename().string();
    const bool part = name.starts_with('.') && name.ends_with(".part");
    if (!name.starts_with(partial_prefix) && !part) continue;
    // A program that a killed run had started may still write there for a moment: gnuplot, say.
    for (int attempt = 0; attempt < 20; ++attempt) {
      fs::remove_all(entry.path(), error);
      if (!error) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
}

std::vector<StageOutcome> explain(const Plan& plan, const RunOptions& options) {
  const std::vector<bool> selected = selection(plan, options);
  std::vector<StageOutcome> stages;
  for (std::size_t i = 0; i < plan.stages.size(); ++i) {
    const PlannedStage& stage = plan.stages[i];
    StageOutcome outcome{.id = stage.id, .kind = std::string(stage.row->name)};
    outcome.record = read_record(options.out / stage.id);
    if (!selected[i]) {
      outcome.state = StageState::not_selected;
      stages.push_back(std::move(outcome));
      continue;
    }
    std::vector<const StageRecord*> upstream;
    std::vector<std::string> waiting_for;
    for (const std::size_t k : stage.from) {
      if (stages[k].state == StageState::waiting || !stages[k].record) waiting_for.push_back(stages[k].id);
      if (stages[k].record) upstream.push_back(&*stages[k].record);
    }
    const StageRecord fresh = fresh_record(stage, upstream);
    outcome.reasons = reasons_to_run(fresh, outcome.record, options.out / stage.id);
    if (outcome.record && !waiting_for.empty()) {
      outcome.reasons.push_back(fmt::format("{} runs before it", fmt::join(waiting_for, ", ")));
    }
    if (outcome.reasons.empty() && options.force) outcome.reasons.push_back("--force asks for it");
    outcome.state = outcome.reasons.empty() ? StageState::kept : StageState::waiting;
    stages.push_back(std::move(outcome));
  }
  return stages;
}

std::string explanation_text(const std::vector<StageOutcome>& stages) {
  std::string out;
  for (const StageOutcome& stage : stages) {
    if (stage.state == StageState::kept) {
      out += fmt::format("{}: up to date\n", stage.id);
    } else if (stage.state == StageState::not_selected) {
      out += fmt::format("{}: not selected{}\n", stage.id, stage.record ? ", used as it is" : "");
    } else {
      out += fmt::format("{}: runs: {}\n", stage.id, fmt::join(stage.reasons, "; "));
    }
  }
  return out;
}

void run_stages(const Plan& plan, const RunOptions& options, Console* console, RunOutcome& outcome) {
  const std::vector<bool> selected = selection(plan, options);
  const auto stop = [&](StageOutcome& stage, StageState state, ExitCode code, const std::string& what) {
    stage.state = state;
    stage.error = what;
    outcome.code = code;
    outcome.error = fmt::format("{} ({}): {}", stage.id, stage.kind, what);
    if (console != nullptr) console->end_progress();
  };
  for (const PlannedStage& stage : plan.stages) {
    outcome.stages.push_back({.id = stage.id, .kind = std::string(stage.row->name)});
  }
  std::error_code no_scratch;
  const bool has_scratch = fs::exists(options.out / scratch_name, no_scratch);
  for (std::size_t i = 0; i < plan.stages.size(); ++i) {
    const PlannedStage& stage = plan.stages[i];
    StageOutcome& result = outcome.stages[i];
    const fs::path place = options.out / stage.id;
    if (interrupt_requested()) return stop(result, StageState::interrupted, exit_interrupted, "interrupted");
    std::optional<StageRecord> found = read_record(place);
    if (!selected[i]) {
      result.state = StageState::not_selected;
      result.record = std::move(found);
      if (result.record) {  // used as it is, with what it had to say
        for (const std::string& warning : result.record->warnings) {
          outcome.warnings.push_back(fmt::format("{}: {}", stage.id, warning));
        }
      }
      continue;
    }
    std::vector<const StageRecord*> upstream;
    std::vector<Input> inputs;
    for (const std::size_t k : stage.from) {
      if (!outcome.stages[k].record) {
        return stop(result, StageState::failed, exit_input,
                    fmt::format("it reads from \"{}\", which has not run here; run without --only and --from first",
                                plan.stages[k].id));
      }
      upstream.push_back(&*outcome.stages[k].record);
      inputs.push_back({plan.stages[k].id, std::string(plan.stages[k].row->name), options.out / plan.stages[k].id,
                        std::string(plan.stages[k].row->result)});
    }
    try {
      const Stamps stamps = stamps_of(stage);
      StageRecord fresh = fresh_record(stage, upstream);
      result.reasons = reasons_to_run(fresh, found, place);
      if (result.reasons.empty() && options.force) result.reasons.push_back("--force asks for it");
      if (result.reasons.empty()) {
        if (has_scratch) {  // killed between publishing and tidying up
          std::error_code ignored;
          fs::remove_all(scratch_folder(options.out, fresh), ignored);
        }
        result.state = StageState::kept;
        result.record = std::move(found);
        if (console != nullptr) console->message(fmt::format("{}: up to date", stage.id));
        if (console != nullptr) {
          for (const std::string& warning : result.record->warnings)
            console->warning(fmt::format("{}: {}", stage.id, warning));
        }
      } else {
        if (console != nullptr) {
          console->message(found ? fmt::format("{}: runs: {}", stage.id, fmt::join(result.reasons, "; "))
                                 : fmt::format("{}: runs", stage.id));
          console->progress(stage.id, 0);
        }
        result.record = run_stage(stage, std::move(fresh), stamps, std::move(inputs), options, console);
        result.state = StageState::ran;
        if (console != nullptr) {
          console->end_progress();
          console->message(fmt::format("{}: done in {}", stage.id, duration_text(result.record->wall_seconds)));
        }
      }
    } catch (const Interrupted&) {
      return stop(result, StageState::interrupted, exit_interrupted, "interrupted");
    } catch (const Error& error) {
      return stop(result, StageState::failed, error.code(), error.what());
    } catch (const fs::filesystem_error& error) {
      return stop(result, StageState::failed, exit_stage_failed,
                  fmt::format("{}: {}", error.path1().string(), error.code().message()));
    } catch (const std::bad_alloc&) {
      return stop(result, StageState::failed, exit_stage_failed, "out of memory");
    } catch (const std::exception& error) {
      return stop(result, StageState::failed, exit_stage_failed, error.what());
    }
    for (const std::string& warning : result.record->warnings)
      outcome.warnings.push_back(fmt::format("{}: {}", stage.id, warning));
    for (const std::string& check : result.record->failed_checks) outcome.failed_checks.push_back(check);
  }
  if (!outcome.failed_checks.empty()) outcome.code = exit_check_failed;
}

Json summary_json(const Plan& plan, const RunOutcome& outcome) {
  Json summary;
  summary["pipeline"] = plan.name;
  summary["status"] = outcome.code == exit_ok             ? "ok"
                      : outcome.code == exit_check_failed ? "check failed"
                      : outcome.code == exit_interrupted  ? "interrupted"
                                                          : "failed";
  summary["warnings"] = outcome.warnings;
  for (std::size_t i = 0; i < plan.stages.size() && i < outcome.stages.size(); ++i) {
    const StageRow& row = *plan.stages[i].row;
    if (!outcome.stages[i].record || row.result.empty()) continue;
    const fs::path path = outcome.out / plan.stages[i].id / row.result;
    std::error_code error;
    if (!fs::is_regular_file(path, error)) continue;
    // Numbers only: long tables stay in the stage's own file. Times and speeds are the manifest's.
    const Json result = read_json(path);
    Json kept = Json::object();
    for (const auto& [key, value] : result.items()) {
      if (key == "cpu_seconds" || key == "collisions_per_second") continue;
      if (value.is_array() && value.size() > 64) continue;
      kept[key] = value;
    }
    summary[plan.stages[i].id] = std::move(kept);
  }
  return summary;
}

RunOutcome run_pipeline(const Plan& plan, const RunOptions& options, Console& console) {
  const auto start = std::chrono::steady_clock::now();
  const std::string started = utc_now();
  RunOutcome outcome;
  outcome.out = options.out;
  selection(plan, options);  // a mistyped id, before anything is made
  try {
    fs::create_directories(options.out);
  } catch (const fs::filesystem_error& error) {
    throw StageError(fmt::format("{}: cannot be made: {}", options.out.string(), error.code().message()));
  }
  const FolderLock lock(options.out);
  remove_leftovers(options.out);
  for (const Warning& warning : plan.warnings) {
    outcome.warnings.push_back(
        to_string(Problem{{}, {}, warning.problem.pointer, warning.problem.what, warning.problem.suggestion}));
    console.warning(to_string(warning.problem));
  }
  run_stages(plan, options, &console, outcome);
  outcome.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  console.end_progress();

  // OUT/<kind>/... also where a stage has another id, as long as it is the only one of its kind.
  for (const PlannedStage& stage : plan.stages) {
    const std::string kind(stage.row->name);
    if (stage.id == kind || plan.find(kind) != nullptr) continue;
    const auto same = std::count_if(plan.stages.begin(), plan.stages.end(),
                                    [&](const PlannedStage& s) { return s.row == stage.row; });
    std::error_code error;
    const fs::path link = options.out / kind;
    if (fs::is_symlink(link, error)) fs::remove(link, error);
    if (same == 1 && !fs::exists(link, error)) fs::create_directory_symlink(stage.id, link, error);
  }
  try {
    write_file_atomically(options.out / "resolved.json", dump(plan.resolved));
    write_file_atomically(options.out / "summary.json", dump(summary_json(plan, outcome)));
    write_file_atomically(options.out / "report.html", report_html(plan, outcome));
    write_file_atomically(options.out / "summary.md", summary_markdown(plan, outcome));
    write_file_atomically(options.out / "manifest.json", dump(manifest_json(plan, options, outcome, started)));
  } catch (const Error& error) {
    if (outcome.error.empty()) throw;
    outcome.error += fmt::format("; besides, {}", error.what());  // the stage that failed comes first
  }
  return outcome;
}

}  // namespace shakebed::pipelines
