// What the commands that run recipes share: their options, and the run itself.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/cli/program.hpp"
#include "pipelines/runner/console.hpp"
#include "pipelines/runner/plan.hpp"
#include "pipelines/runner/read_recipe.hpp"

namespace shakebed::pipelines {

struct RunArguments {
  std::vector<std::string> settings;
  std::optional<std::string> preset, only, from, until, shard, data, budget;
  bool force = false, dry_run = false, gather = false;
  int jobs = 0;
  Json chosen;  // for the manifest: what a budget of the command's own has chosen; null: none
};
// --preset; and --set, --only, --force ...
void add_preset(CLI::App& command, RunArguments& run);
void add_run_options(CLI::App& command, RunArguments& run);
// --budget, for commands whose recipes hold beds.
void add_budget(CLI::App& command, RunArguments& run);

Console::Level level_of(const Call& call);
// --out, by default results/NAME.
std::filesystem::path out_of(const Call& call, const std::string& name);
// What --preset, --set and --data change in a recipe. Throws UsageError.
RecipeChanges changes_of(const RunArguments& run);
// Mistakes end the program before anything runs; what is odd is said by validate, explain and run alike.
void show_warnings(const Plan& plan);

// Runs a plan, or says what would run. With --json the result goes to stdout, or into `result` when there is one.
int run_plan_command(const Call& call, const RunArguments& run, const Plan& plan, Json* result = nullptr);
// One of several runs of a command, all with this console.
int run_plan_command(const Call& call, const RunArguments& run, const Plan& plan, Console& console, Json* result);

}  // namespace shakebed::pipelines
