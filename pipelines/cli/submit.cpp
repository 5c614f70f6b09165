// implements: pipelines/cli/commands.hpp
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/run_plan.hpp"
#include "pipelines/runner/slurm.hpp"

namespace shakebed::pipelines {
namespace {

struct SubmitArguments {
  std::string recipe;
  RunArguments run;
  int shards = 1;
  std::vector<std::string> options;
};

int submit(const Call& call, const SubmitArguments& given) {
  const Plan plan = read_recipe(given.recipe, changes_of(given.run));
  Console console(level_of(call));
  SlurmOptions options;
  options.shards = given.shards;
  options.sbatch = given.options;
  options.preset = given.run.preset;
  options.settings = given.run.settings;
  options.dry_run = given.run.dry_run;
  options.json = call.json;
  options.out = out_of(call, plan.name);
  return submit_slurm(plan, options, console);
}

}  // namespace

void add_submit(Program& program) {
  CLI::App& group = program.add_group("submit", "submit a sweep to a cluster");
  const auto given = std::make_shared<SubmitArguments>();
  CLI::App& slurm = program.add(
      {"slurm", "submit a Slurm job array over the points of a sweep, and a job that gathers the results",
       "  shakebed submit slurm sweep.json --shards 100 --out o\n  shakebed submit slurm sweep.json "
       "--shards 100 --sbatch=--partition=short --dry-run"},
      [given](const Call& call) { return submit(call, *given); }, &group);
  slurm.add_option("recipe", given->recipe, "recipe with a sweep")->required()->type_name("FILE.json");
  slurm.add_option("--shards", given->shards, "number of tasks of the job array")->check(CLI::PositiveNumber);
  slurm.add_option("--sbatch", given->options, "further option for sbatch, may be repeated: --sbatch=--time=1:00:00")
      ->type_name("OPTION");
  add_preset(slurm, given->run);
  slurm.add_option("--set", given->run.settings, "change of the recipe: POINTER=VALUE, as in --set /stages/bed/seed=7")
      ->type_name("POINTER=VALUE");
  slurm.add_flag("--dry-run", given->run.dry_run, "write the scripts and submit nothing");
}

}  // namespace shakebed::pipelines
