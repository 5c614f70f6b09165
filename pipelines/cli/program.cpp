#include "pipelines/cli/program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "pipelines/cli/command_pages.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/runner/manifest.hpp"

namespace shakebed::pipelines {
namespace {

constexpr const char* exit_codes =
    "Exit codes: 0 ok, 2 usage, 3 configuration, 4 input, 5 stage failed, 6 check failed, 130 interrupted.";
constexpr int width_of_names = 34;  // of the left column of --help [characters]

}  // namespace

Program::Program(int argc, char** argv)
    : argc_(argc),
      argv_(argv),
      app_(
          "shakebed: from a shaken bed (simulated, photographed or rendered) to its density profile, its temperature "
          "and its solid height.") {
  app_.require_subcommand(1);
  app_.set_version_flag("--version",
                        fmt::format("shakebed {} ({}, {})", program_version(), source_revision(), compiler_text()));
  app_.footer(std::string("Begin with `shakebed reproduce`, or `shakebed init` for a recipe of your own.\n") +
              exit_codes);
  app_.get_formatter()->column_width(width_of_names);
  call_.command_line.assign(argv, argv + argc);
  if (!call_.command_line.empty()) call_.command_line[0] = "shakebed";
}

CLI::App& Program::add(const CommandText& text, std::function<int(const Call&)> work, CLI::App* parent) {
  CLI::App& command = *(parent == nullptr ? &app_ : parent)->add_subcommand(text.name, text.help);
  command.footer(fmt::format("Examples:\n{}", text.examples));
  CLI::Option* out = command.add_option("--out", call_.out, "folder for the results")->type_name("DIR");
  if (!text.writes_folder) out->group("");
  command.add_flag("--json", call_.json, "JSON result on stdout, messages on stderr");
  command.add_flag("--quiet,-q", call_.quiet, "show the result, warnings and errors only");
  command.add_flag("--verbose,-v", call_.verbose, "show all messages of the stages");
  command.callback([this, work = std::move(work)] { chosen_ = work; });
  return command;
}

CLI::App& Program::add_prefix(const CommandText& text, std::function<int(const Call&)> work) {
  CLI::App& command = *app_.add_subcommand(text.name, text.help);
  command.prefix_command()->set_help_flag();
  command.callback([this, work = std::move(work)] { chosen_ = work; });
  return command;
}

CLI::App& Program::add_group(const char* name, const char* help) {
  CLI::App& group = *app_.add_subcommand(name, help);
  group.require_subcommand(1);
  return group;
}

void Program::refuse_unknown_command() const {
  if (argc_ < 2 || argv_[1][0] == '-') return;
  std::vector<std::string> names;
  for (const CLI::App* command : app_.get_subcommands({})) names.push_back(command->get_name());
  if (std::find(names.begin(), names.end(), argv_[1]) != names.end()) return;
  const std::string nearest = nearest_name(argv_[1], names);
  throw UsageError(fmt::format("there is no command \"{}\"; {}", argv_[1],
                               nearest.empty() ? "see shakebed --help" : fmt::format("did you mean \"{}\"?", nearest)));
}

// An option that is not known is named before one that is missing: the latter may be the former, misspelt.
void Program::refuse_unknown_option() const {
  for (const CLI::App* command : app_.get_subcommands()) {
    std::vector<std::string> names;
    for (const CLI::Option* option : command->get_options())
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& word : command->remaining()) {
      if (!word.starts_with("--") || word.size() < 3) continue;
      const std::string given = word.substr(0, word.find('='));
      const std::string nearest = nearest_name(given, names);
      throw UsageError(fmt::format("{} has no option {}; {}", command->get_name(), given,
                                   nearest.empty() ? "see --help" : fmt::format("did you mean {}?", nearest)));
    }
  }
}

namespace {
// CLI11 2.1 reads -1 as the largest unsigned number.
void refuse_negative_counts(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    if (option->get_type_name() != "UINT") continue;
    option->check([](const std::string& given) {
      return given.starts_with('-') ? fmt::format("must not be negative, got {}", given) : std::string();
    });
  }
  for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; })) refuse_negative_counts(*command);
}
}  // namespace

int Program::run() {
  // For the install rules: manual pages and completions.
  if (argc_ == 3 && std::string_view(argv_[1]) == "--write-command-pages") {
    write_command_pages(app_, argv_[2]);
    return exit_ok;
  }
  refuse_unknown_command();
  refuse_negative_counts(app_);
  try {
    app_.parse(argc_, argv_);
  } catch (const CLI::ParseError& error) {
    // --help and --version come as "errors" with code 0.
    if (error.get_exit_code() == 0) return app_.exit(error) == 0 ? exit_ok : exit_usage;
    refuse_unknown_option();
    throw UsageError(std::string(error.what()) + "; see --help");
  }
  return chosen_(call_);
}

}  // namespace shakebed::pipelines
