#include "pipelines/formats/errors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>

namespace shakebed::pipelines {

std::string to_string(const Problem& problem) {
  std::string text = problem.file;
  if (problem.at.line > 0) text += fmt::format(":{}:{}", problem.at.line, problem.at.column);
  if (!text.empty()) text += ": ";
  if (!problem.pointer.empty()) text += problem.pointer + ": ";
  text += problem.what;
  if (!problem.suggestion.empty()) text += ". " + problem.suggestion;
  return text;
}

namespace {
ExitCode code_of(const std::vector<Problem>& problems) {
  const bool only_inputs =
      !problems.empty() && std::all_of(problems.begin(), problems.end(), [](const Problem& p) { return p.is_input; });
  return only_inputs ? exit_input : exit_configuration;
}
std::string join(const std::vector<Problem>& problems) {
  std::string text;
  for (const Problem& problem : problems) {
    if (!text.empty()) text += '\n';
    text += to_string(problem);
  }
  return text;
}
}  // namespace

ConfigError::ConfigError(std::vector<Problem> problems)
    : Error(code_of(problems), join(problems)), problems_(std::move(problems)) {}

void fail_to_read(const std::string& path) {
  if (errno == ENOMEM) throw std::bad_alloc();
  throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
}

}  // namespace shakebed::pipelines
