// implements: pipelines/cli/commands.hpp
#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/program.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/runner/recipe_schema.hpp"

namespace shakebed::pipelines {

void add_schema(Program& program) {
  const auto file = std::make_shared<std::string>();
  CLI::App& command = program.add({"schema", "JSON Schema of a recipe, for editors and validators",
                                   "  shakebed schema > pipeline.schema.json", false},
                                  [file](const Call&) {
                                    const std::string text = dump(recipe_schema());
                                    if (file->empty())
                                      print(text);
                                    else
                                      write_file_atomically(*file, text);
                                    return exit_ok;
                                  });
  command.add_option("file", *file, "file that is written (default: stdout)")->type_name("FILE.json");
}

}  // namespace shakebed::pipelines
