// What a stage will give, stated before it runs: the numbers of its result file, by JSON pointer, and its tables. Every
// pointer of a recipe into a result ("/fit/temperature") is checked against these statements when the recipe is read.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace shakebed::pipelines {

// When something is given.
struct Given {
  bool possible = true;     // with the options of this stage
  bool always = true;       // whenever the stage succeeds
  std::string condition{};  // else, in words: "\"observe\" names \"order\"", "the fit succeeds"
};
// Known from the options.
inline Given given_if(bool holds, std::string condition) { return {holds, holds, std::move(condition)}; }
// Known only when the stage has run.
inline Given given_when(std::string condition) { return {true, false, std::move(condition)}; }
// Both.
inline Given both(const Given& a, const Given& b) {
  return {a.possible && b.possible, a.always && b.always,
          a.condition.empty()   ? b.condition
          : b.condition.empty() ? a.condition
                                : a.condition + ", and " + b.condition};
}

enum class ResultKind { quantity, number, text, truth };

struct StatedResult {
  std::string pointer;  // "/readings/#/jump": # stands for any index of an array, * for any name
  ResultKind kind = ResultKind::number;
  std::string unit;     // "1" where it has none
  std::string meaning;  // a plain sentence without its full stop
  Given given{};
  bool may_be_null = false;
  std::vector<std::string> tokens{};  // of the pointer; filled by ResultList
};
struct StatedColumn {
  std::string name;     // of letters, digits and '_'; ends in the unit where that is not D, m, g reduced or 1
  std::string unit;     // "D", "1/D^2", "m g D", "px", "1" for a plain number, "" for words
  std::string meaning;  // a noun phrase
  std::vector<std::string> values{};  // where only these texts stand in it
};
struct StatedTable {
  std::string file;  // "profile_phase_*.csv": * stands for any text
  std::string meaning;
  std::vector<StatedColumn> columns;
  Given given{};
};

class ResultList;
// A stage in "from", as those that read it see it.
struct StatedStage {
  std::string id;
  std::string_view kind;
  const ResultList* results = nullptr;  // nullptr where its own options are wrong: nothing is then known of it
};

class ResultList {
 public:
  ResultList() = default;
  explicit ResultList(std::vector<StatedStage> from) : from_(std::move(from)) {}

  // {"value", "std_error", "unit"}.
  void quantity(std::string pointer, std::string unit, std::string meaning, Given given = {}, bool may_be_null = false);
  // A plain number.
  void number(std::string pointer, std::string unit, std::string meaning, Given given = {}, bool may_be_null = false);
  void text(std::string pointer, std::string meaning, Given given = {});
  void truth(std::string pointer, std::string meaning, Given given = {}, bool may_be_null = false);
  void table(StatedTable table);

  const std::vector<StatedResult>& all() const { return results_; }
  const std::vector<StatedTable>& tables() const { return tables_; }
  // nullptr if none is stated. Parts of a quantity ("/temperature/value") lead to it.
  const StatedResult* find(std::string_view pointer) const;
  const StatedTable* find_table(std::string_view file) const;
  // The stages in "from", in its order.
  const std::vector<StatedStage>& from() const { return from_; }
  const StatedStage* from(std::string_view kind) const;  // the first of a kind

 private:
  void add(StatedResult result);

  std::vector<StatedStage> from_;
  std::vector<StatedResult> results_;
  std::vector<StatedTable> tables_;
};

// What a well-formed pointer such as "/fit/temperature" leads to among the results of these stages; nullptr if none
// states it.
const StatedResult* find_result(const std::vector<StatedStage>& stages, const std::string& pointer);

// What is wrong with a name, and what to do.
struct Misfit {
  std::string what, suggestion;
};
// Whether such a pointer leads to something that one of these stages gives; `called` says which stages these are: "the
// recipe", "\"from\"".
std::optional<Misfit> misfit_of_pointer(const std::vector<StatedStage>& stages, const std::string& pointer,
                                        std::string_view called);
// Whether a stage writes a table of this name.
std::optional<Misfit> misfit_of_table(const StatedStage& stage, const std::string& file);
// Whether a table has a column of this name.
std::optional<Misfit> misfit_of_column(const StatedTable& table, const std::string& column);

}  // namespace shakebed::pipelines
