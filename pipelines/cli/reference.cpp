// implements: pipelines/cli/commands.hpp
#include <fmt/format.h>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/program.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/runner/reference.hpp"

namespace shakebed::pipelines {
namespace {

const StageRow& stage_named(const std::string& name) {
  if (const StageRow* row = find_stage(name)) return *row;
  std::vector<std::string> names;
  for (const StageRow& row : stage_table()) names.emplace_back(row.name);
  const std::string nearest = nearest_name(name, names);
  throw UsageError(
      fmt::format("there is no stage \"{}\"; {}", name,
                  nearest.empty() ? "see shakebed reference" : fmt::format("did you mean \"{}\"?", nearest)));
}

}  // namespace

void add_reference(Program& program) {
  const auto stage = std::make_shared<std::string>();
  CLI::App& command =
      program.add({"reference", "reference page of a stage or of a recipe: options, numbers, tables (Markdown)",
                   "  shakebed reference\n  shakebed reference fit\n  shakebed reference recipe", false},
                  [stage](const Call&) {
                    print(stage->empty()       ? reference_index()
                          : *stage == "recipe" ? recipe_reference_page()
                                               : reference_page(stage_named(*stage)));
                    return exit_ok;
                  });
  command.add_option("stage", *stage, "name of a stage, or recipe; left out: list of the stages");
}

}  // namespace shakebed::pipelines
