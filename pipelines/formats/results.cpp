#include "pipelines/formats/results.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>

#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/json.hpp"
#include "pipelines/formats/quantity.hpp"

namespace shakebed::pipelines {
namespace {

constexpr std::size_t most_names_listed = 12;

bool is_index(std::string_view token) {
  return !token.empty() && std::all_of(token.begin(), token.end(), [](unsigned char c) { return std::isdigit(c); });
}

bool token_fits(std::string_view stated, std::string_view asked) {
  return stated == asked || stated == "*" || (stated == "#" && is_index(asked));
}

// Parts that quantities have.
bool is_part_of_quantity(std::string_view token) {
  return token == "value" || token == "std_error" || token == "unit" || token == "spread" || token == "within" ||
         token == "fixed" || token == "runs";
}

std::string joined(const std::vector<std::string>& tokens) {
  std::string out;
  for (const std::string& token : tokens) out = pointer_join(out, token);
  return out;
}

// A stated pointer with the names asked for in place of * and #, as far as they go.
std::string filled(const std::string& stated, const std::vector<std::string>& asked) {
  std::vector<std::string> tokens = split_pointer(stated);
  for (std::size_t i = 0; i < tokens.size() && i < asked.size(); ++i) {
    if (tokens[i] == "*" || (tokens[i] == "#" && is_index(asked[i]))) tokens[i] = asked[i];
  }
  return joined(tokens);
}

std::string listed(const std::vector<std::string>& names) {
  const std::vector<std::string> first(
      names.begin(), names.begin() + static_cast<std::ptrdiff_t>(std::min(names.size(), most_names_listed)));
  return fmt::format("{}{}", fmt::join(first, ", "), names.size() > first.size() ? ", ..." : "");
}

// "profile_phase_*.csv" and "profile_phase_03.csv".
bool file_fits(std::string_view stated, std::string_view asked) {
  const std::size_t star = stated.find('*');
  if (star == std::string_view::npos) return stated == asked;
  const std::string_view before = stated.substr(0, star), after = stated.substr(star + 1);
  return asked.size() >= before.size() + after.size() && asked.starts_with(before) && asked.ends_with(after);
}

}  // namespace

void ResultList::add(StatedResult result) {
  result.tokens = split_pointer(result.pointer);
  results_.push_back(std::move(result));
}
void ResultList::quantity(std::string pointer, std::string unit, std::string meaning, Given given, bool may_be_null) {
  add({std::move(pointer), ResultKind::quantity, std::move(unit), std::move(meaning), std::move(given), may_be_null});
}
void ResultList::number(std::string pointer, std::string unit, std::string meaning, Given given, bool may_be_null) {
  add({std::move(pointer), ResultKind::number, std::move(unit), std::move(meaning), std::move(given), may_be_null});
}
void ResultList::text(std::string pointer, std::string meaning, Given given) {
  add({std::move(pointer), ResultKind::text, "", std::move(meaning), std::move(given), false});
}
void ResultList::truth(std::string pointer, std::string meaning, Given given, bool may_be_null) {
  add({std::move(pointer), ResultKind::truth, "", std::move(meaning), std::move(given), may_be_null});
}
void ResultList::table(StatedTable table) { tables_.push_back(std::move(table)); }

const StatedResult* ResultList::find(std::string_view pointer) const {
  const std::vector<std::string> asked = split_pointer(pointer);
  const StatedResult* found = nullptr;
  for (const StatedResult& result : results_) {
    const std::vector<std::string>& stated = result.tokens;
    const bool whole = stated.size() == asked.size();
    const bool part =
        result.kind == ResultKind::quantity && asked.size() == stated.size() + 1 && is_part_of_quantity(asked.back());
    if (!whole && !part) continue;
    if (!std::equal(stated.begin(), stated.end(), asked.begin(), token_fits)) continue;
    if (found == nullptr || (result.given.possible && !found->given.possible)) found = &result;
  }
  return found;
}

const StatedTable* ResultList::find_table(std::string_view file) const {
  const auto found =
      std::find_if(tables_.begin(), tables_.end(), [&](const StatedTable& t) { return file_fits(t.file, file); });
  return found == tables_.end() ? nullptr : &*found;
}

const StatedStage* ResultList::from(std::string_view kind) const {
  const auto found = std::find_if(from_.begin(), from_.end(), [&](const StatedStage& s) { return s.kind == kind; });
  return found == from_.end() ? nullptr : &*found;
}

namespace {

// Where a pointer leads into the midst of a result, what is below it.
std::vector<std::string> below(const ResultList& results, const std::vector<std::string>& asked) {
  std::vector<std::string> out;
  for (const StatedResult& result : results.all()) {
    const std::vector<std::string>& stated = result.tokens;
    if (stated.size() > asked.size() && std::equal(asked.begin(), asked.end(), stated.begin(),
                                                   [](const auto& a, const auto& s) { return token_fits(s, a); }))
      out.push_back(filled(result.pointer, asked));
  }
  return out;
}

}  // namespace

const StatedResult* find_result(const std::vector<StatedStage>& stages, const std::string& pointer) {
  const std::string id = split_pointer(pointer).front();
  for (const StatedStage& stage : stages) {
    if (stage.id == id && stage.results != nullptr)
      return stage.results->find(std::string_view(pointer).substr(1 + escape_pointer_token(id).size()));
  }
  return nullptr;
}

std::optional<Misfit> misfit_of_pointer(const std::vector<StatedStage>& stages, const std::string& pointer,
                                        std::string_view called) {
  std::vector<std::string> tokens;
  try {
    tokens = split_pointer(pointer);
  } catch (const UsageError&) {}
  if (tokens.size() < 2 || tokens[0].empty())
    return Misfit{fmt::format("\"{}\" is not a pointer to a result", pointer),
                  "Write /<stage id>/<name in its result>, for example \"/fit/temperature\""};
  std::vector<std::string> ids;
  for (const StatedStage& stage : stages) ids.push_back(stage.id);
  const auto stage = std::find_if(stages.begin(), stages.end(), [&](const auto& s) { return s.id == tokens[0]; });
  if (stage == stages.end()) {
    const std::string nearest = nearest_name(tokens[0], ids);
    return Misfit{
        fmt::format("\"{}\": {} names no stage \"{}\"", pointer, called, tokens[0]),
        nearest.empty() ? fmt::format("Choose from: {}", listed(ids)) : fmt::format("Did you mean \"{}\"?", nearest)};
  }
  if (stage->results == nullptr) return std::nullopt;
  const std::vector<std::string> inside(tokens.begin() + 1, tokens.end());
  const std::string path = joined(inside);
  const StatedResult* found = stage->results->find(path);
  if (found != nullptr && found->given.possible) return std::nullopt;
  const std::string gives = fmt::format("\"{}\" ({})", stage->id, stage->kind);
  if (found != nullptr)
    return Misfit{fmt::format("{} does not give \"{}\" with these options", gives, path),
                  fmt::format("It is given when {}", found->given.condition)};
  std::vector<std::string> names = below(*stage->results, inside);
  if (!names.empty())
    return Misfit{fmt::format("\"{}\" refers to several results, not to one", pointer),
                  fmt::format("Choose from: {}", listed(names))};
  for (const StatedResult& result : stage->results->all()) {
    if (result.given.possible) names.push_back(filled(result.pointer, inside));
  }
  const std::string nearest = nearest_name(path, names);
  return Misfit{fmt::format("{} gives no result \"{}\"", gives, path),
                nearest.empty() ? fmt::format("Choose from: {}. \"shakebed reference {}\" describes them",
                                              listed(names), stage->kind)
                                : fmt::format("Did you mean \"{}\"?", pointer_join("", stage->id) + nearest)};
}

std::optional<Misfit> misfit_of_table(const StatedStage& stage, const std::string& file) {
  if (stage.results == nullptr) return std::nullopt;
  const StatedTable* found = stage.results->find_table(file);
  if (found != nullptr && found->given.possible) return std::nullopt;
  if (found != nullptr)
    return Misfit{fmt::format("\"{}\" ({}) does not write \"{}\" with these options", stage.id, stage.kind, file),
                  fmt::format("It is written when {}", found->given.condition)};
  std::vector<std::string> names;
  for (const StatedTable& table : stage.results->tables()) {
    if (table.given.possible) names.push_back(table.file);
  }
  const std::string nearest = nearest_name(file, names);
  return Misfit{
      fmt::format("\"{}\" ({}) writes no table \"{}\"", stage.id, stage.kind, file),
      nearest.empty() ? fmt::format("Choose from: {}", listed(names)) : fmt::format("Did you mean \"{}\"?", nearest)};
}

std::optional<Misfit> misfit_of_column(const StatedTable& table, const std::string& column) {
  std::vector<std::string> names;
  for (const StatedColumn& one : table.columns) names.push_back(one.name);
  if (std::find(names.begin(), names.end(), column) != names.end()) return std::nullopt;
  const std::string nearest = nearest_name(column, names);
  return Misfit{
      fmt::format("{} has no column \"{}\"", table.file, column),
      nearest.empty() ? fmt::format("Choose from: {}", listed(names)) : fmt::format("Did you mean \"{}\"?", nearest)};
}

}  // namespace shakebed::pipelines
