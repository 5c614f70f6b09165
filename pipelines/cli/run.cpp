// implements: pipelines/cli/commands.hpp
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/run_plan.hpp"

namespace shakebed::pipelines {
namespace {

struct RecipeArguments {
  std::string recipe;
  RunArguments run;
};

void add(Program& program, const CommandText& text, bool dry) {
  const auto given = std::make_shared<RecipeArguments>();
  CLI::App& command = program.add(text, [given, dry](const Call& call) {
    given->run.dry_run = given->run.dry_run || dry;
    return run_plan_command(call, given->run, read_recipe(given->recipe, changes_of(given->run)));
  });
  command.add_option("recipe", given->recipe, "recipe that is run")->required()->type_name("FILE.json");
  add_preset(command, given->run);
  if (!dry) add_budget(command, given->run);
  add_run_options(command, given->run);
}

}  // namespace

void add_run(Program& program) {
  add(program,
      {"run", "run a recipe",
       "  shakebed run bed.json\n  shakebed run bed.json --set /stages/bed/floor/amplitude=\"3 mm\" --out o\n"
       "  shakebed run bed.json --budget \"1 %\"\n  shakebed run bed.json --dry-run\n  shakebed run sweep.json --jobs "
       "8 --shard 2/4"},
      false);
}

void add_explain(Program& program) {
  add(program, {"explain", "show what a run would do, one sentence per stage", "  shakebed explain bed.json --out o"},
      true);
}

}  // namespace shakebed::pipelines
