#include "tests/bench/program/recipe_run.hpp"

#include <fmt/format.h>

#include "pipelines/formats/errors.hpp"
#include "pipelines/runner/plan.hpp"

namespace shakebed::pipelines::bench {

double RecipeRun::cpu(std::string_view id) const {
  for (const StageOutcome& stage : outcome.stages) {
    if (stage.id == id && stage.cost) return stage.cost->cpu_seconds;
  }
  throw StageError(fmt::format("bench: stage \"{}\" has not run", id));
}

double RecipeRun::number(std::string_view id, std::string_view file, std::string_view pointer) const {
  const std::filesystem::path path = out / id / file;
  const Json json = read_json(path);
  const Json* found = find_pointer(json, pointer);
  if (found == nullptr || !found->is_number())
    throw StageError(fmt::format("{}: has no number at {}", path.string(), pointer));
  return found->get<double>();
}

RecipeRun run_recipe(const Json& recipe, const std::filesystem::path& out) {
  std::filesystem::remove_all(out);
  const Plan plan = make_plan(to_node(recipe), "(benchmark)", std::filesystem::current_path());
  RunOptions options;
  options.out = out;
  RecipeRun run{out, {}};
  run_stages(plan, options, nullptr, run.outcome);
  if (run.outcome.code == exit_interrupted) throw Interrupted();
  for (const StageOutcome& stage : run.outcome.stages) {
    if (stage.state == StageState::failed) throw StageError(fmt::format("{}: {}", stage.id, stage.error));
  }
  if (run.outcome.code != exit_ok) throw StageError(run.outcome.error);
  return run;
}

}  // namespace shakebed::pipelines::bench
