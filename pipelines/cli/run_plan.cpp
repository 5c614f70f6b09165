#include "pipelines/cli/run_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/report/report.hpp"
#include "pipelines/runner/budget.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/runner/run.hpp"
#include "pipelines/runner/sweep.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

std::vector<Setting> settings_of(const RunArguments& run) {
  std::vector<Setting> settings;
  for (const std::string& text : run.settings) settings.push_back(parse_setting(text));
  return settings;
}

RunOptions run_options(const Call& call, const RunArguments& run, const Plan& plan) {
  RunOptions options;
  options.out = out_of(call, plan.name);
  options.only = run.only, options.from = run.from, options.until = run.until;
  options.force = run.force;
  options.jobs = run.jobs;
  options.command_line = call.command_line;
  options.settings = settings_of(run);
  options.budget = run.chosen;
  return options;
}

Json outcome_json(const Plan& plan, const RunOutcome& outcome) {
  Json out;
  out["pipeline"] = plan.name;
  out["out"] = outcome.out.string();
  out["exit_code"] = static_cast<int>(outcome.code);
  if (!outcome.error.empty()) out["error"] = outcome.error;
  out["stages"] = Json::array();
  for (const StageOutcome& stage : outcome.stages) {
    Json row{{"id", stage.id}, {"stage", stage.kind}, {"state", to_string(stage.state)}};
    if (!stage.reasons.empty()) row["why"] = stage.reasons;
    if (!stage.error.empty()) row["error"] = stage.error;
    out["stages"].push_back(std::move(row));
  }
  out["failed_checks"] = outcome.failed_checks;
  out["summary"] = summary_json(plan, outcome);
  return out;
}

Json explanation_json(const Plan& plan, const std::vector<StageOutcome>& stages) {
  Json out = Json::array();
  for (const StageOutcome& stage : stages) {
    Json row{{"id", stage.id},
             {"stage", stage.kind},
             {"runs", stage.state == StageState::waiting},
             {"state", to_string(stage.state)},
             {"why", stage.reasons}};
    if (Json facts = plan.find(stage.id)->stage->facts(); !facts.empty()) row["facts"] = std::move(facts);
    out.push_back(std::move(row));
  }
  return out;
}

// "bed: gamma 4.02, column number 15, width 16 D".
std::string facts_text(const Plan& plan) {
  std::string text;
  for (const PlannedStage& stage : plan.stages) {
    std::string line;
    const Json facts = stage.stage->facts();
    for (const auto& [name, quantity] : facts.items()) {
      std::string words = name;
      std::replace(words.begin(), words.end(), '_', ' ');
      const std::string unit = quantity.value("unit", "1");
      line += fmt::format("{}{} {:.4g}{}", line.empty() ? "" : ", ", words, quantity["value"].get<double>(),
                          unit == "1" ? "" : " " + unit);
    }
    if (!line.empty()) text += fmt::format("{}: {}\n", stage.id, line);
  }
  return text;
}

// What was run, or would be: as text, or with --json for stdout.
struct Answer {
  int code = exit_ok;
  std::string text;
  Json json;
};

Answer dry_run(const Plan& plan, const RunOptions& options) {
  const auto stages = explain(plan, options);
  show_warnings(plan);
  return {exit_ok, explanation_text(stages) + facts_text(plan), explanation_json(plan, stages)};
}

Answer real_run(const Plan& plan, const RunOptions& options, bool json, Console& console) {
  install_interrupt_handler();
  const RunOutcome outcome = run_pipeline(plan, options, report_pages(), console);
  const bool ended = outcome.code == exit_ok || outcome.code == exit_check_failed;
  if (ended && !options.budget.is_null()) say_reached(plan, options.budget, outcome, console);
  if (!outcome.error.empty()) console.error(outcome.error);
  for (const std::string& check : outcome.failed_checks) console.error("check failed: " + check);
  return {outcome.code,
          terminal_text(plan, outcome) + fmt::format("{} {}\nreport:  {}\n", ended ? "results:" : "results so far:",
                                                     outcome.out.string(), (outcome.out / "report.html").string()),
          json ? outcome_json(plan, outcome) : Json()};
}

Answer sweep(const Call& call, const RunArguments& run, const Plan& plan, const RunOptions& options, Console& console) {
  if (run.dry_run) show_warnings(plan);
  SweepArguments sweep{run.shard, run.gather, run.dry_run, call.json, {}};
  const int code = run_sweep_command(plan, options, sweep, report_pages(), console);
  return {code, "", std::move(sweep.result)};
}

}  // namespace

void add_budget(CLI::App& command, RunArguments& run) {
  command
      .add_option(
          "--budget", run.budget,
          "wanted error of T_x (\"1 %\") or wanted wall time (\"30 s\"). A short pilot run then chooses the measured "
          "time, the number and the contact duration of the simulated beds. With --dry-run only the pilot runs")
      ->type_name("ERROR|TIME");
}

void add_preset(CLI::App& command, RunArguments& run) {
  command.add_option("--preset", run.preset, "preset of the recipe, such as \"quick\"; applied before --set")
      ->type_name("NAME");
}

void add_run_options(CLI::App& command, RunArguments& run) {
  command.add_option("--set", run.settings, "change of the recipe: POINTER=VALUE, as in --set /stages/bed/seed=7")
      ->type_name("POINTER=VALUE");
  command.add_option("--only", run.only, "run only this stage")->type_name("STAGE");
  command.add_option("--from", run.from, "run this stage and those that depend on it")->type_name("STAGE");
  command.add_option("--until", run.until, "run this stage and those it needs")->type_name("STAGE");
  command.add_flag("--force", run.force, "run also the stages that are up to date");
  command.add_flag("--dry-run", run.dry_run, "show what would run, and why; run nothing");
  command.add_option("--jobs,-j", run.jobs, "number of threads (default: all processors)")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  command.add_option("--shard", run.shard, "run only the points K, K + N, K + 2N, ... of a sweep (K from 1 to N)")
      ->type_name("K/N");
  command.add_flag("--gather", run.gather, "collect the results of the shards of a sweep, and run nothing");
  command
      .add_option("--data", run.data,
                  "your own points: CSV file with the columns height [D] and number_density [1/D^2]. They are drawn "
                  "into the figures and compared with the curves")
      ->type_name("FILE.csv");
}

Console::Level level_of(const Call& call) {
  return call.quiet ? Console::Level::quiet : call.verbose ? Console::Level::verbose : Console::Level::normal;
}

fs::path out_of(const Call& call, const std::string& name) {
  return call.out ? fs::path(*call.out) : fs::path("results") / name;
}

RecipeChanges changes_of(const RunArguments& run) { return {run.preset, settings_of(run), run.data}; }

void show_warnings(const Plan& plan) {
  for (const Warning& warning : plan.warnings)
    std::fputs(fmt::format("warning: {}\n", to_string(warning.problem)).c_str(), stderr);
}

int run_plan_command(const Call& call, const RunArguments& run, const Plan& given, Json* result) {
  Console console(level_of(call));
  return run_plan_command(call, run, given, console, result);
}

int run_plan_command(const Call& call, const RunArguments& run, const Plan& given, Console& console, Json* result) {
  RunOptions options = run_options(call, run, given);
  if (!given.sweep && run.gather)
    throw UsageError("--gather: this recipe has no \"sweep\", so there is nothing to gather");
  if (!given.sweep && run.shard) throw UsageError("--shard: this recipe has no \"sweep\", so it has one point only");
  std::optional<BudgetedPlan> budgeted;
  if (run.budget) {
    const Budget budget = parse_budget(*run.budget);
    if (given.sweep)
      throw UsageError(
          "--budget: this recipe has a \"sweep\", and its points need different times. Remove the sweep and run one "
          "point with --budget. Then write the chosen times into the recipe");
    install_interrupt_handler();
    budgeted = choose_by_budget(given, budget, options, console);
    options.budget = budgeted->record;
  }
  const Plan& plan = budgeted ? budgeted->plan : given;
  Answer answer = plan.sweep    ? sweep(call, run, plan, options, console)
                  : run.dry_run ? dry_run(plan, options)
                                : real_run(plan, options, call.json, console);
  if (!call.json)
    print(answer.text);
  else if (result != nullptr)
    *result = std::move(answer.json);
  else
    print(dump(answer.json));
  return answer.code;
}

}  // namespace shakebed::pipelines
