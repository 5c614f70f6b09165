// The program: its commands, and the options that they share. Each command is in its own file, which adds it with
// options, examples and function. shakebed.cpp lists the commands.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace shakebed::pipelines {

// How a command was called.
struct Call {
  std::vector<std::string> command_line;  // all of it, "shakebed" first
  std::optional<std::string> out;         // --out
  bool json = false, quiet = false, verbose = false;
};

struct CommandText {
  const char *name, *help, *examples;
  bool writes_folder = true;  // if not, --out is accepted, but not offered
};

class Program {
 public:
  Program(int argc, char** argv);
  // A command below the program or below `parent`. `work` is called when it is chosen; it gives the exit code.
  CLI::App& add(const CommandText& text, std::function<int(const Call&)> work, CLI::App* parent = nullptr);
  // The same for a command that reads the rest of the command line itself.
  CLI::App& add_prefix(const CommandText& text, std::function<int(const Call&)> work);
  CLI::App& add_group(const char* name, const char* help);
  // Reads the command line and runs the command. Throws Error.
  int run();
  CLI::App& app() { return app_; }

 private:
  void refuse_unknown_command() const;
  void refuse_unknown_option() const;
  int argc_;
  char** argv_;
  CLI::App app_;
  Call call_;
  std::function<int(const Call&)> chosen_;
};

}  // namespace shakebed::pipelines
