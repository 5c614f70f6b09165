#include "pipelines/cli/command_pages.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "pipelines/formats/files.hpp"
#include "pipelines/runner/manifest.hpp"

namespace shakebed::pipelines {

namespace {

constexpr const char* exit_status =
    ".SH EXIT STATUS\n.TP\n0\nsuccess\n.TP\n2\nwrong usage of the command line\n.TP\n3\na mistake in the "
    "recipe\n.TP\n4\nan input file that is missing or cannot be read\n.TP\n5\na stage that failed\n.TP\n6\na check "
    "that failed\n.TP\n130\ninterrupted\n";

struct Command {
  std::string name;  // "run", "submit slurm"
  const CLI::App* app;
};

// Commands, and those below them, in the order of --help.
void collect(const CLI::App& app, const std::string& before, std::vector<Command>& out) {
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    const std::string name = before.empty() ? sub->get_name() : before + " " + sub->get_name();
    out.push_back({name, sub});
    collect(*sub, name, out);
  }
}

// Text of a manual page: no line may begin like a request, backslashes and hyphens are escaped.
std::string roff(const std::string& text) {
  std::string out;
  bool at_start = true;
  for (const char c : text) {
    if (at_start && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
    at_start = c == '\n';
  }
  return out;
}

std::string dashed(std::string name) {
  for (char& c : name)
    if (c == ' ') c = '-';
  return name;
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

bool is_positional(const CLI::Option& option) { return names_of(option).empty(); }

// "DIR", "{automatic,dark,bright}"; "" of a flag.
std::string argument_of(const CLI::Option& option) {
  if (option.get_items_expected_max() == 0) return "";
  const std::string type = option.get_type_name();
  const std::size_t colon = type.find(":{");
  return colon == std::string::npos ? type : type.substr(colon + 1);
}

// The words an option takes, where it takes only these.
std::vector<std::string> words_of(const CLI::Option& option) {
  const std::string argument = argument_of(option);
  std::vector<std::string> words;
  if (argument.size() < 2 || argument.front() != '{' || argument.back() != '}') return words;
  std::istringstream inside(argument.substr(1, argument.size() - 2));
  for (std::string word; std::getline(inside, word, ',');) words.push_back(word);
  return words;
}

std::string joined(const std::vector<std::string>& words, const char* between) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : between) + word;
  return out;
}

std::string options_section(const CLI::App& app) {
  std::string out;
  for (const CLI::Option* option : app.get_options()) {
    const std::string argument = argument_of(*option);
    const std::string name = is_positional(*option) ? option->get_name(true) : joined(names_of(*option), ", ");
    out += fmt::format(".TP\n\\fB{}\\fR{}\n{}\n", roff(name), argument.empty() ? "" : " \\fI" + roff(argument) + "\\fR",
                       roff(option->get_description()));
  }
  return out.empty() ? out : ".SH OPTIONS\n" + out;
}

std::string synopsis(const Command& command) {
  std::string out = fmt::format(".SH SYNOPSIS\n.B shakebed {}\n", roff(command.name));
  for (const CLI::Option* option : command.app->get_options()) {
    if (is_positional(*option)) out += fmt::format(".I {}\n", roff(option->get_name(true)));
  }
  return out + "[\\fIoptions\\fR]\n";
}

std::string head(const std::string& page, const std::string& summary) {
  return fmt::format(".TH {0} 1 \"\" \"shakebed {1}\" \"shakebed\"\n.SH NAME\n{2} \\- {3}\n", dashed(page),
                     program_version(), roff(dashed(page)), roff(summary));
}

std::string manual_page(const Command& command) {
  std::string out = head("shakebed " + command.name, command.app->get_description()) + synopsis(command);
  out += options_section(*command.app);
  const std::string footer = command.app->get_footer();
  if (const std::size_t line = footer.find('\n'); line != std::string::npos)
    out += ".SH EXAMPLES\n.nf\n" + roff(footer.substr(line + 1)) + "\n.fi\n";
  return out + exit_status + ".SH SEE ALSO\n.BR shakebed (1)\n";
}

std::string main_page(const CLI::App& app, const std::vector<Command>& commands) {
  std::string out = head("shakebed", "vibrated granular beds: simulate, photograph, measure, fit");
  out += ".SH SYNOPSIS\n.B shakebed\n.I command\n[\\fIoptions\\fR]\n.SH DESCRIPTION\n" + roff(app.get_description()) +
         "\n";
  out += ".SH COMMANDS\n";
  for (const Command& command : commands)
    out += fmt::format(".TP\n.BR shakebed\\-{} (1)\n{}\n", roff(dashed(command.name)),
                       roff(command.app->get_description()));
  return out + options_section(app) + exit_status;
}

// --- completions

std::vector<std::string> option_words(const CLI::App& app) {
  std::vector<std::string> words;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : names_of(*option)) words.push_back(name);
  return words;
}

std::vector<std::string> direct_subcommands(const CLI::App& app) {
  std::vector<std::string> words;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; }))
    words.push_back(sub->get_name());
  return words;
}

std::string bash_completion(const CLI::App& app, const std::vector<Command>& commands) {
  std::string out =
      "# bash completion for shakebed\n_shakebed() {\n"
      "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}\n"
      "  local command=${COMP_WORDS[1]} words= below=\n"
      "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n";
  out += fmt::format("    COMPREPLY=($(compgen -W \"{} {}\" -- \"$word\"))\n    return\n  fi\n",
                     joined(direct_subcommands(app), " "), joined(option_words(app), " "));
  out += "  case \"$command $before\" in\n";
  for (const Command& command : commands)
    for (const CLI::Option* option : command.app->get_options())
      if (const auto words = words_of(*option); !words.empty())
        for (const std::string& name : names_of(*option))
          out += fmt::format("    \"{} {}\") COMPREPLY=($(compgen -W \"{}\" -- \"$word\")); return ;;\n",
                             command.name.substr(0, command.name.find(' ')), name, joined(words, " "));
  out += "  esac\n  case \"$command\" in\n";
  for (const Command& command : commands) {
    if (command.name.find(' ') != std::string::npos) continue;
    std::vector<std::string> words = option_words(*command.app);
    for (const CLI::App* sub : command.app->get_subcommands([](const CLI::App*) { return true; }))
      for (const std::string& word : option_words(*sub)) words.push_back(word);
    const std::string below = joined(direct_subcommands(*command.app), " ");
    out += fmt::format("    {}) words=\"{}\"{} ;;\n", command.name, joined(words, " "),
                       below.empty() ? "" : " below=\"" + below + "\"");
  }
  return out +
         "  esac\n"
         "  case \"$word\" in\n    -*) COMPREPLY=($(compgen -W \"$words\" -- \"$word\")) ;;\n"
         "    *) COMPREPLY=($(compgen -W \"$below\" -- \"$word\") $(compgen -f -- \"$word\")) ;;\n  esac\n}\n"
         "complete -o filenames -F _shakebed shakebed\n";
}

// A word within single quotes and square brackets.
std::string zsh(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'')
      out += "'\\''";
    else if (c == '[' || c == ']' || c == ':' || c == '\\')
      out += std::string("\\") + c;
    else
      out += c;
  }
  return out;
}

std::string zsh_completion(const CLI::App& app, const std::vector<Command>& commands) {
  std::string out = "#compdef shakebed\n_shakebed() {\n  local -a commands\n  commands=(\n";
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; }))
    out += fmt::format("    '{}:{}'\n", sub->get_name(), zsh(sub->get_description()));
  out += "  )\n  if (( CURRENT == 2 )); then\n    _describe command commands\n    return\n  fi\n  case $words[2] in\n";
  for (const Command& command : commands) {
    if (command.name.find(' ') != std::string::npos) continue;
    out += fmt::format("    {})\n      _arguments", command.name);
    for (const CLI::Option* option : command.app->get_options()) {
      const std::string argument = argument_of(*option);
      const auto words = words_of(*option);
      const std::string action = words.empty() ? "_files" : "(" + joined(words, " ") + ")";
      for (const std::string& name : names_of(*option))
        out += fmt::format(" \\\n        '{}[{}]{}'", name, zsh(option->get_description()),
                           argument.empty() ? "" : ":" + zsh(argument) + ":" + action);
    }
    out += " \\\n        '*:file:_files'\n      ;;\n";
  }
  return out + "  esac\n}\n_shakebed \"$@\"\n";
}

}  // namespace

void write_command_pages(const CLI::App& app, const std::filesystem::path& folder) {
  std::vector<Command> commands;
  collect(app, "", commands);
  const auto write = [&](const std::filesystem::path& path, const std::string& text) {
    std::filesystem::create_directories((folder / path).parent_path());
    write_file(folder / path, text);
  };
  write("man/man1/shakebed.1", main_page(app, commands));
  for (const Command& command : commands)
    write("man/man1/shakebed-" + dashed(command.name) + ".1", manual_page(command));
  write("bash-completion/completions/shakebed", bash_completion(app, commands));
  write("zsh/site-functions/_shakebed", zsh_completion(app, commands));
}

}  // namespace shakebed::pipelines
