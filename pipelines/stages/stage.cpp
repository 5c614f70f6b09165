#include <fmt/format.h>

#include <algorithm>

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

std::filesystem::path Input::file(std::string_view name) const {
  const std::filesystem::path path = directory / name;
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw InputError(fmt::format("the stage \"{}\" ({}) has not written the file {}", id, stage, name));
  }
  return path;
}

bool Input::has(std::string_view name) const {
  std::error_code error;
  return std::filesystem::is_regular_file(directory / name, error);
}

Json Input::result() const { return read_json(file(result_name)); }

Table RunContext::table(std::string_view file) const {
  const StatedTable* found = stated().find_table(file);
  if (found == nullptr) throw std::logic_error(fmt::format("results() does not state {}", file));
  return Table(*found);
}

const Input* RunContext::find_input(std::string_view kind) const {
  const auto found = inputs_of(kind);
  return found.empty() ? nullptr : found.front();
}

std::vector<const Input*> RunContext::inputs_of(std::string_view kind) const {
  std::vector<const Input*> found;
  for (const Input& input : inputs()) {
    if (input.stage == kind) found.push_back(&input);
  }
  return found;
}

const Input& RunContext::input_from(const std::string& id) const {
  for (const Input& input : inputs()) {
    if (input.id == id || (id.empty() && inputs().size() == 1)) return input;
  }
  throw InputError(fmt::format("\"{}\" is not in the \"from\" of this stage", id));
}

const Input& RunContext::input(std::string_view kind) const {
  const auto found = inputs_of(kind);
  if (found.empty())
    throw InputError(fmt::format("this stage needs the result of a stage of kind \"{}\": name one in \"from\"", kind));
  if (found.size() > 1)
    throw InputError(
        fmt::format("\"from\" names {} stages of kind \"{}\", but this stage reads only one", found.size(), kind));
  return *found.front();
}

std::vector<StatedStage> Chain::stated() const {
  std::vector<StatedStage> out;
  for (const ChainStage& stage : stages) out.push_back({stage.id, stage.stage, stage.results.get()});
  return out;
}

const ChainStage* Chain::find(std::string_view id) const {
  const auto found = std::find_if(stages.begin(), stages.end(), [&](const ChainStage& s) { return s.id == id; });
  return found == stages.end() ? nullptr : &*found;
}

}  // namespace shakebed::pipelines
