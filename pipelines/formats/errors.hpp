// What can go wrong, and the exit code each ends with. Every message says the problem, why, and what to do.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace shakebed::pipelines {

enum ExitCode {
  exit_ok = 0,
  exit_usage = 2,
  exit_configuration = 3,
  exit_input = 4,
  exit_stage_failed = 5,
  exit_check_failed = 6,
  exit_interrupted = 130,
};

// A place in a text, 1-based; line 0: not from a file (a --set on the command line, a built-in recipe).
struct Position {
  int line = 0;
  int column = 0;
};

// One thing wrong with what the user wrote.
struct Problem {
  std::string file;        // as the user named it; "--set" for the command line
  Position at;             // where in it
  std::string pointer;     // JSON pointer, "" for the whole document
  std::string what;        // the problem and what was expected
  std::string suggestion;  // what to do; may be empty
  bool is_input = false;   // a missing or unreadable input file rather than a mistake in the recipe
  std::string meant = {};  // of a misspelt key: pointer of the key that was probably meant
  bool is_rule = false;    // values that do not go together, each of which could be read
};

// What is odd but not wrong. Warnings of one kind at one pointer are counted together where many recipes are read.
struct Warning {
  std::string kind;  // "gamma", "box"
  Problem problem;
};

// "recipe.json:12:7: /stages/0/disks/diameter: ... Suggestion."
std::string to_string(const Problem& problem);

class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

class UsageError : public Error {
 public:
  explicit UsageError(const std::string& message) : Error(exit_usage, message) {}
};
class InputError : public Error {  // a file that is missing, unreadable or not what it should be
 public:
  explicit InputError(const std::string& message) : Error(exit_input, message) {}
};
class StageError : public Error {  // a stage could not do its work
 public:
  explicit StageError(const std::string& message) : Error(exit_stage_failed, message) {}
};
class Interrupted : public Error {
 public:
  Interrupted() : Error(exit_interrupted, "interrupted") {}
};
// All mistakes of a recipe at once. Its code is exit_input when every problem is a missing or unreadable file.
class ConfigError : public Error {
 public:
  explicit ConfigError(std::vector<Problem> problems);
  const std::vector<Problem>& problems() const { return problems_; }

 private:
  std::vector<Problem> problems_;
};

// Of a file that could not be opened or read, by errno; where memory was short it is not the file's fault.
[[noreturn]] void fail_to_read(const std::string& path);

}  // namespace shakebed::pipelines
