// implements: pipelines/cli/commands.hpp
#include <fmt/format.h>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/run_plan.hpp"

namespace shakebed::pipelines {
namespace {

struct ValidateArguments {
  std::string recipe;
  RunArguments run;
};

Json problem_json(const Problem& problem) {
  return Json{{"file", problem.file},       {"line", problem.at.line}, {"column", problem.at.column},
              {"pointer", problem.pointer}, {"problem", problem.what}, {"suggestion", problem.suggestion}};
}

template <class Each, class Get>
Json problems_json(const std::vector<Each>& all, Get problem_of) {
  Json out = Json::array();
  for (const Each& one : all) out.push_back(problem_json(problem_of(one)));
  return out;
}

int validate(const Call& call, const ValidateArguments& given) {
  try {
    const Plan plan = read_recipe(given.recipe, changes_of(given.run));
    if (call.json) {
      print(dump(Json{{"valid", true},
                      {"name", plan.name},
                      {"stages", plan.stages.size()},
                      {"warnings", problems_json(plan.warnings, [](const Warning& one) { return one.problem; })}}));
      return exit_ok;
    }
    show_warnings(plan);
    if (!call.quiet)
      print(fmt::format("{}: valid: {} {}\n", given.recipe, plan.stages.size(),
                        plan.stages.size() == 1 ? "stage" : "stages"));
    return exit_ok;
  } catch (const ConfigError& error) {
    if (!call.json) throw;
    print(dump(
        Json{{"valid", false}, {"problems", problems_json(error.problems(), [](const Problem& one) { return one; })}}));
    return error.code();
  }
}

}  // namespace

void add_validate(Program& program) {
  const auto given = std::make_shared<ValidateArguments>();
  CLI::App& command = program.add(
      {"validate", "check a recipe and show all its mistakes; if it has none, check the points of its sweep",
       "  shakebed validate bed.json", false},
      [given](const Call& call) { return validate(call, *given); });
  command.add_option("recipe", given->recipe, "recipe that is checked")->required()->type_name("FILE.json");
  add_preset(command, given->run);
  command
      .add_option("--set", given->run.settings, "change of the recipe: POINTER=VALUE, as in --set /stages/bed/seed=7")
      ->type_name("POINTER=VALUE");
}

}  // namespace shakebed::pipelines
