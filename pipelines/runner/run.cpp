#include "pipelines/runner/run.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <thread>

#include "pipelines/formats/files.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/runner/pages.hpp"
#include "pipelines/runner/run_stage.hpp"

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

// --- running

namespace {

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

}  // namespace

Input input_of(const PlannedStage& stage, const fs::path& out) {
  return {stage.id, std::string(stage.row->name), out / stage.id, std::string(stage.row->result)};
}

fs::path scratch_folder(const fs::path& out, const StageRecord& fresh) {
  return out / scratch_name / fresh.id / work_key(fresh);
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
    if (outcome.reasons.empty() && options.force) outcome.reasons.push_back("--force was given");
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
      out += fmt::format("{}: not selected{}\n", stage.id, stage.record ? ", its existing results are used" : "");
    } else {
      out += fmt::format("{}: runs: {}\n", stage.id, fmt::join(stage.reasons, "; "));
    }
  }
  return out;
}

namespace {

constexpr const char* interrupted_words =
    "interrupted. Finished results are kept. Start the same command again to continue";

// The stages of a plan, one after another.
class StagesRun {
 public:
  StagesRun(const Plan& plan, const RunOptions& options, Console* console, RunOutcome& outcome)
      : plan_(plan), options_(options), console_(console), outcome_(outcome), selected_(selection(plan, options)) {
    for (const PlannedStage& stage : plan.stages)
      outcome.stages.push_back({.id = stage.id, .kind = std::string(stage.row->name)});
    std::error_code error;
    has_scratch_ = fs::exists(options.out / scratch_name, error);
  }

  void operator()() {
    for (std::size_t i = 0; i < plan_.stages.size(); ++i) {
      if (!finish(i)) return;
      keep_warnings(i);
    }
    if (!outcome_.failed_checks.empty()) outcome_.code = exit_check_failed;
  }

 private:
  // False: it did not finish, and what follows does not run.
  bool finish(std::size_t i) {
    if (interrupt_requested()) return stop(i, StageState::interrupted, exit_interrupted, interrupted_words);
    StageOutcome& result = outcome_.stages[i];
    std::optional<StageRecord> found = read_record(options_.out / result.id);
    if (!selected_[i]) {
      keep(i, StageState::not_selected, std::move(found));
      return true;
    }
    for (const std::size_t k : plan_.stages[i].from) {
      if (!outcome_.stages[k].record)
        return stop(i, StageState::failed, exit_input,
                    fmt::format("this stage needs the results of \"{}\", which are not in {}. First run the recipe "
                                "once without --only and --from",
                                plan_.stages[k].id, options_.out.string()));
    }
    try {
      make(i, std::move(found));
      return true;
    } catch (const Interrupted&) {
      return stop(i, StageState::interrupted, exit_interrupted, interrupted_words);
    } catch (const Error& error) {
      return stop(i, StageState::failed, error.code(), error.what());
    } catch (const fs::filesystem_error& error) {
      return stop(i, StageState::failed, exit_stage_failed,
                  fmt::format("{}: {}", error.path1().string(), error.code().message()));
    } catch (const std::bad_alloc&) {
      return stop(i, StageState::failed, exit_stage_failed, "out of memory");
    } catch (const std::exception& error) {
      return stop(i, StageState::failed, exit_stage_failed, error.what());
    }
  }

  bool stop(std::size_t i, StageState state, ExitCode code, const std::string& what) {
    StageOutcome& stage = outcome_.stages[i];
    stage.state = state;
    stage.error = what;
    outcome_.code = code;
    outcome_.error = fmt::format("{} ({}): {}", stage.id, stage.kind, what);
    if (console_ != nullptr) console_->end_progress();
    return false;
  }

  void keep(std::size_t i, StageState state, std::optional<StageRecord> found) {
    StageOutcome& result = outcome_.stages[i];
    result.state = state;
    result.record = std::move(found);
    result.cost = read_cost(options_.out / result.id);
  }

  StageWork work(std::size_t i) const {
    std::vector<const StageRecord*> upstream;
    std::vector<Input> inputs;
    for (const std::size_t k : plan_.stages[i].from) {
      upstream.push_back(&*outcome_.stages[k].record);
      inputs.push_back(input_of(plan_.stages[k], options_.out));
    }
    return work_of(plan_.stages[i], upstream, std::move(inputs));
  }

  // Runs the stage, unless what is there is up to date.
  void make(std::size_t i, std::optional<StageRecord> found) {
    StageOutcome& result = outcome_.stages[i];
    StageWork to_do = work(i);
    result.reasons = reasons_to_run(to_do.fresh, found, options_.out / result.id);
    if (result.reasons.empty() && options_.force) result.reasons.push_back("--force was given");
    if (result.reasons.empty()) {
      std::error_code ignored;  // what a kill between publishing and tidying up has left
      if (has_scratch_) fs::remove_all(scratch_folder(options_.out, to_do.fresh), ignored);
      keep(i, StageState::kept, std::move(found));
      say_kept(result);
      return;
    }
    if (console_ != nullptr) {
      console_->message(found ? fmt::format("{}: runs: {}", result.id, fmt::join(result.reasons, "; "))
                              : fmt::format("{}: runs", result.id));
      console_->progress(result.id, 0);
    }
    FinishedWork done = run_stage(std::move(to_do), options_, console_);
    result.record = std::move(done.record);
    result.cost = std::move(done.cost);
    result.state = StageState::ran;
    if (console_ != nullptr) {
      console_->end_progress();
      console_->message(fmt::format("{}: done in {}", result.id, duration_text(result.cost->wall_seconds)));
    }
  }

  void say_kept(const StageOutcome& result) const {
    if (console_ == nullptr) return;
    console_->message(fmt::format("{}: up to date", result.id));
    for (const std::string& warning : result.record->warnings)
      console_->warning(fmt::format("{}: {}", result.id, warning));
  }

  // Also those of a stage that was not selected and is used as it is; its checks were those of another run.
  void keep_warnings(std::size_t i) {
    const StageOutcome& result = outcome_.stages[i];
    if (!result.record) return;
    for (const std::string& warning : result.record->warnings)
      outcome_.warnings.push_back(fmt::format("{}: {}", result.id, warning));
    if (result.state == StageState::not_selected) return;
    for (const std::string& check : result.record->failed_checks) outcome_.failed_checks.push_back(check);
  }

  const Plan& plan_;
  const RunOptions& options_;
  Console* console_;
  RunOutcome& outcome_;
  std::vector<bool> selected_;
  bool has_scratch_ = false;
};

}  // namespace

void run_stages(const Plan& plan, const RunOptions& options, Console* console, RunOutcome& outcome) {
  StagesRun(plan, options, console, outcome)();
}

namespace {

// The answer of the first stage that has one, with the stage's id; null where there is none.
Json answer_of(const Plan& plan, const RunOutcome& outcome) {
  for (std::size_t i = 0; i < plan.stages.size() && i < outcome.stages.size(); ++i) {
    const StageRow& row = *plan.stages[i].row;
    std::error_code error;
    const fs::path path = outcome.out / plan.stages[i].id / row.result;
    if (row.answer.empty() || !outcome.stages[i].record || !fs::is_regular_file(path, error)) continue;
    const Json result = read_json(path);
    const Json* answer = find_pointer(result, row.answer);
    if (answer == nullptr) continue;
    Json out = *answer;
    out["stage"] = plan.stages[i].id;
    return out;
  }
  return {};
}

}  // namespace

Json summary_json(const Plan& plan, const RunOutcome& outcome) {
  Json summary;
  if (Json answer = answer_of(plan, outcome); !answer.is_null()) summary["answer"] = std::move(answer);
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
    // Numbers only: long tables stay in the stage's own file.
    const Json result = read_json(path);
    Json kept = Json::object();
    for (const auto& [key, value] : result.items()) {
      if (value.is_array() && value.size() > 64) continue;
      kept[key] = value;
    }
    summary[plan.stages[i].id] = std::move(kept);
  }
  return summary;
}

namespace {

// OUT/<kind>/... also where a stage has another id, as long as it is the only one of its kind.
void link_kinds(const Plan& plan, const fs::path& out) {
  for (const PlannedStage& stage : plan.stages) {
    const std::string kind(stage.row->name);
    if (stage.id == kind || plan.find(kind) != nullptr) continue;
    const auto same = std::count_if(plan.stages.begin(), plan.stages.end(),
                                    [&](const PlannedStage& s) { return s.row == stage.row; });
    std::error_code error;
    const fs::path link = out / kind;
    if (fs::is_symlink(link, error)) fs::remove(link, error);
    if (same == 1 && !fs::exists(link, error)) fs::create_directory_symlink(stage.id, link, error);
  }
}

}  // namespace

RunOutcome run_pipeline(const Plan& plan, const RunOptions& options, const Pages& pages, Console& console) {
  const auto start = std::chrono::steady_clock::now();
  const std::string started = utc_now();
  RunOutcome outcome;
  outcome.out = options.out;
  selection(plan, options);  // a mistyped id, before anything is made
  try {
    fs::create_directories(options.out);
  } catch (const fs::filesystem_error& error) {
    throw StageError(
        fmt::format("{}: this folder cannot be created: {}", options.out.string(), error.code().message()));
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
  link_kinds(plan, options.out);
  try {
    write_file_atomically(options.out / "resolved.json", dump(plan.resolved));
    write_file_atomically(options.out / "summary.json", dump(summary_json(plan, outcome)));
    pages.write(plan, outcome);
    write_file_atomically(options.out / "manifest.json", dump(manifest_json(plan, options, outcome, started)));
  } catch (const Error& error) {
    if (outcome.error.empty()) throw;
    outcome.error += fmt::format("; besides, {}", error.what());  // the stage that failed comes first
  }
  return outcome;
}

}  // namespace shakebed::pipelines
