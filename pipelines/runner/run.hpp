// Running a plan: what is up to date is kept, the rest is made, all or nothing for each stage.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/runner/cache.hpp"
#include "pipelines/runner/console.hpp"
#include "pipelines/runner/folder_lock.hpp"
#include "pipelines/runner/plan.hpp"

namespace shakebed::pipelines {

struct RunOptions {
  std::filesystem::path out;
  std::optional<std::string> only, from, until;  // ids
  bool force = false;                            // run what is selected even when it is up to date
  int jobs = 0;                                  // threads; 0: as many as there are processors
  std::vector<std::string> command_line;         // for the manifest
  std::vector<Setting> settings;                 // for the manifest: what --set changed
  Json budget;                                   // for the manifest: what --budget chose and expects; null: none
  // Called from any thread with a stage's id and the share of its time that has passed.
  std::function<void(const std::string& id, double fraction)> on_progress{};
};

enum class StageState { ran, kept, not_selected, failed, interrupted, waiting };
std::string_view to_string(StageState state);

struct StageOutcome {
  std::string id, kind;
  StageState state = StageState::waiting;
  std::vector<std::string> reasons{};   // why it ran (or would)
  std::optional<StageRecord> record{};  // what is there now
  std::optional<StageCost> cost{};      // what it took to make that
  std::string error{};
};

struct RunOutcome {
  ExitCode code = exit_ok;
  std::vector<StageOutcome> stages;
  std::vector<std::string> failed_checks, warnings;
  std::string error;  // what stopped it
  double wall_seconds = 0;
  std::filesystem::path out;
};

// Runs the stages of a plan below out. Stops at the first that fails; everything finished before is kept. Does not
// throw for what goes wrong in a stage. No console: silent.
void run_stages(const Plan& plan, const RunOptions& options, Console* console, RunOutcome& outcome);

class Pages;  // pages.hpp

// The whole: takes the lock on OUT, runs the stages, writes resolved.json, summary.json, the pages and manifest.json.
RunOutcome run_pipeline(const Plan& plan, const RunOptions& options, const Pages& pages, Console& console);

// A stage of a plan that has finished, as those see it that read its files.
Input input_of(const PlannedStage& stage, const std::filesystem::path& out);

// What a run would do, without doing it: stages with state `kept` or `waiting` and the reasons.
std::vector<StageOutcome> explain(const Plan& plan, const RunOptions& options);
// As lines for people: "bed: runs: floor/amplitude changed ...".
std::string explanation_text(const std::vector<StageOutcome>& stages);

// Ctrl-C and SIGTERM ask running stages to stop; a second one ends the program at once.
void install_interrupt_handler();
bool interrupt_requested();

// summary.json: the numbers of every stage under its id.
Json summary_json(const Plan& plan, const RunOutcome& outcome);
// Removes what a killed run left half-written in OUT. What unfinished stages keep in their scratch folders stays.
void remove_leftovers(const std::filesystem::path& out);
inline constexpr std::string_view scratch_name = ".scratch";
// Where a stage keeps what must outlive a kill: OUT/.scratch/<id>/<key of its work>. Removed when the stage finished.
std::filesystem::path scratch_folder(const std::filesystem::path& out, const StageRecord& fresh);

}  // namespace shakebed::pipelines
