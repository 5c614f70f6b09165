// implements: pipelines/cli/commands.hpp
#include <fmt/format.h>

#include <filesystem>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/program.hpp"
#include "pipelines/formats/embedded.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/files.hpp"

namespace shakebed::pipelines {

void add_init(Program& program) {
  const auto file = std::make_shared<std::string>("bed.json");
  CLI::App& command = program.add(
      {"init", "write a commented recipe to start from", "  shakebed init\n  shakebed init my-bed.json", false},
      [file](const Call& call) {
        std::error_code error;
        if (std::filesystem::exists(*file, error))
          throw UsageError(fmt::format("{} exists; remove it first, or name another file", *file));
        const EmbeddedFile* starter = find_embedded("recipes/starter.json");
        if (starter == nullptr)
          throw StageError("the starter recipe is missing from this build; build and install shakebed again");
        write_file_atomically(*file, starter->text);
        print(call.json ? dump(Json{{"file", *file}})
                        : fmt::format("wrote {0}\nnext: shakebed validate {0}\n      shakebed run {0}\n", *file));
        return exit_ok;
      });
  command.add_option("file", *file, "file that is written (default: bed.json)")->type_name("FILE.json");
}

}  // namespace shakebed::pipelines
