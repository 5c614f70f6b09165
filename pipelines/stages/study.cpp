#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/duration.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/stages/replica_seed.hpp"
#include "pipelines/stages/stage.hpp"
#include "pipelines/stages/study.hpp"
#include "pipelines/stages/study_numbers.hpp"
#include "statistics/parallel.hpp"
#include "statistics/time_left.hpp"

namespace shakebed::pipelines {
namespace {

namespace fs = std::filesystem;

struct Parameter {
  std::string name = "x";
  std::vector<double> values;
  double times = 1;
  std::vector<std::string> set;  // pointers into the chain that become value * times
  std::string unit;
};
struct Change {  // of a series: pointer → value
  std::vector<std::pair<std::string, Json>> set;
  std::optional<double> times;  // instead of the parameter's
};
// Of a bed: its series, and the value of the second parameter.
struct Kind {
  std::string name;
  Change change;
  std::optional<double> second;
};
// What is taken of a column of a table.
enum class Take { largest, smallest, place_of_largest, place_of_smallest, mean };
struct Collected {
  std::string at;  // "/fit/temperature", or a table "/bed/profile.csv" with the options below
  std::string column, by = "height";
  Take take = Take::largest;
  std::optional<double> least, most;  // of `by`
  double times = 1, plus = 0;
};
// A CSV of the chain, averaged over the replicas row by row.
struct Tabulated {
  std::string at;   // "/bed/velocities.csv"
  std::string key;  // the column that says which rows are the same
};

class Study : public Stage {
 public:
  void describe(Fields& fields) override;
  void check_chains(Fields& fields, const ChainReader& read) override;
  std::vector<std::string> chain_kinds() const override;
  void results(ResultList& list) const override;
  void run(RunContext& context) const override;

 private:
  struct Point {
    std::size_t series, value;
    std::uint32_t replica;
  };
  std::vector<Point> points() const;
  JsonNode recipe_at(const Point& point, std::uint64_t seed) const;
  void check_chain(Fields& fields, const Chain& chain) const;
  std::vector<RunNumber> numbers(const std::vector<Input>& chain) const;
  Json run_once(RunContext& context, const Point& point, const fs::path& folder,
                const RunContext::Progress& progress) const;
  std::vector<double> trials(RunContext& context, const std::vector<Point>& all, const std::vector<bool>& done) const;
  void write_described(RunContext& context, const std::string& file, const std::string& csv) const;
  void write_tables(RunContext& context, const std::vector<Point>& all, const std::vector<Json>& kept) const;
  std::vector<Json> run_all(RunContext& context, const std::vector<Point>& all) const;
  std::string replicas_csv(const std::vector<Point>& all, const std::vector<std::vector<RunNumber>>& found) const;
  struct Averages {
    std::string csv;
    Json series = Json::object();
    std::size_t missing = 0;
  };
  Averages average(const std::vector<Point>& all, const std::vector<std::vector<RunNumber>>& found) const;
  std::vector<Kind> kinds() const;
  std::vector<StatedColumn> place_columns() const;
  std::string place_header() const;
  std::string place_cells(const Point& point) const;

  Json chain_;
  Parameter parameter_;
  std::optional<Parameter> second_;
  std::vector<std::pair<std::string, Change>> series_;
  std::vector<std::pair<std::string, Collected>> collect_;
  std::vector<std::pair<std::string, Tabulated>> tables_;
  std::uint32_t replicas_ = 1;
  std::vector<Kind> kinds_{{"all", {}, {}}};  // every series with every value of the second parameter
  std::shared_ptr<const Chain> first_;        // the chain of the first point, once it has been read
};

const std::vector<Choice<Take>> takes{{Take::largest, "largest"},
                                      {Take::smallest, "smallest"},
                                      {Take::place_of_largest, "place_of_largest"},
                                      {Take::place_of_smallest, "place_of_smallest"},
                                      {Take::mean, "mean"}};
bool takes_place(Take take) { return take == Take::place_of_largest || take == Take::place_of_smallest; }

// The table of the chain that a pointer "/bed/profile.csv" leads to; nullptr where it leads to none.
const StatedTable* table_at(const Chain& chain, const std::string& at) {
  const std::vector<std::string> tokens = split_pointer(at);
  const ChainStage* stage = tokens.size() == 2 ? chain.find(tokens[0]) : nullptr;
  return stage == nullptr ? nullptr : stage->results->find_table(tokens[1]);
}

// Of one run: no number where no row of the table lies within the places asked for.
RunNumber taken(const Collected& c, const fs::path& path) {
  const RunRows rows = read_run_rows(path);
  const std::size_t y = csv_column(rows.header, c.column, path.string()),
                    x = csv_column(rows.header, c.by, path.string());
  const bool largest = c.take == Take::largest || c.take == Take::place_of_largest;
  double best = NAN, place = NAN, sum = 0, used = 0;
  for (const std::vector<std::string>& cells : rows.rows) {
    const auto value = number_in(cells[y]), at = number_in(cells[x]);
    if (!value || !at || *at < c.least.value_or(-INFINITY) || *at > c.most.value_or(INFINITY)) continue;
    sum += *value, used += 1;
    if (std::isnan(best) || (largest ? *value > best : *value < best)) best = *value, place = *at;
  }
  RunNumber number;
  const double one = takes_place(c.take) ? place : c.take == Take::mean && used > 0 ? sum / used : best;
  number.value = c.plus + c.times * one;
  return number;
}

void describe_parameter(Fields& f, Parameter& p) {
  f.text("name", p.name, {.help = "name of the parameter's column in table.csv"});
  f.numbers("values", p.values, {.help = "values of the parameter", .required = true});
  f.number("times", p.times, {.help = "factor: the value times this number is set in the chain"});
  f.text("unit", p.unit, {.help = "unit of the value that is set in the chain; empty: a plain number"});
  f.texts("set", p.set,
          {.help = "JSON pointers of the options of the chain that are set: /stages/bed/bath/temperature"});
}

// A whole number is written as one: a count takes nothing else.
Json written_value(const Parameter& parameter, double value) {
  if (!parameter.unit.empty()) return Json(number_text(value) + " " + parameter.unit);
  return std::abs(value) < 1e15 && value == std::round(value) ? Json(static_cast<std::int64_t>(value)) : Json(value);
}

void Study::describe(Fields& fields) {
  fields.any(
      "stages", chain_,
      {.help = "stages that are run at every point, as in a recipe; they cannot read other files", .required = true});
  fields.object<Parameter>("parameter", parameter_, describe_parameter,
                           {.help = "parameter that is varied", .required = true});
  fields.object<Parameter>(
      "second", second_, describe_parameter,
      {.help = "second parameter that is varied: every value of the first is combined with every value of this one"});
  fields.map<Change>("series", series_,
                     [](Fields& f, Change& change) {
                       Json set = Json::object();
                       for (const auto& [pointer, value] : change.set) set[pointer] = value;
                       f.any("set", set, {.help = "changes of the chain: JSON pointer → value"});
                       f.number("times", change.times,
                                {.help = "factor of the parameter in this series, in place of \"times\""});
                       if (!f.decoding()) return;
                       f.require(set.is_object(), "set", "expected an object: pointer → value");
                       change.set.clear();
                       if (set.is_object())
                         for (const auto& [pointer, value] : set.items()) change.set.emplace_back(pointer, value);
                     },
                     {.help = "kinds of beds: name → changes of the chain; left out, one series named \"all\""});
  fields.map<Collected>(
      "collect", collect_,
      [](Fields& f, Collected& c) {
        f.text("at", c.at,
               {.help = "pointer to the number: /<stage id>/<name in its result>, or /<stage id>/<file>.csv together "
                        "with \"column\"",
                .required = true});
        f.text("column", c.column, {.help = "column of the CSV file from which one number is taken"});
        f.choice("take", c.take, takes,
                 {.help = "number that is taken from the column: the largest or the smallest, the place of either, or "
                          "the mean of the rows. Noise makes the largest too large and the smallest too small"});
        f.text("by", c.by, {.help = "column that gives the place, for \"take\", \"least\" and \"most\""});
        f.number("least", c.least, {.help = "smallest place that is used, in the unit of that column"});
        f.number("most", c.most, {.help = "largest place that is used, in the unit of that column"});
        f.number("times", c.times, {.help = "factor of the collected number"});
        f.number("plus", c.plus, {.help = "constant that is added after the factor"});
      },
      {.help = "collected numbers: name of a column of table.csv → pointer to the number", .required = true});
  fields.map<Tabulated>(
      "tables", tables_,
      [](Fields& f, Tabulated& t) {
        f.text("at", t.at, {.help = "file of a stage of the chain: /<stage id>/<file>.csv", .required = true});
        f.text("key", t.key, {.help = "column by which the rows of the replicas are matched", .required = true});
      },
      {.help = "averaged tables: name of a CSV file of this stage → file of the chain whose rows are averaged over the "
               "replicas"});
  fields.integer("replicas", replicas_,
                 {.help = "number of runs at every point, each with its own seed", .range = from_to(1, 1000)});
  if (!fields.decoding() || fields.problem_count() > 0) return;
  fields.require(!parameter_.values.empty(), "parameter/values", "the list of values is empty");
  fields.require(!collect_.empty(), "collect", "\"collect\" is empty: give at least one number");
  if (second_) {
    fields.require(second_->name != parameter_.name, "second/name", "both parameters have the same name");
    fields.require(!second_->values.empty(), "second/values", "the list of values is empty");
  }
  kinds_ = kinds();
}

std::vector<Kind> Study::kinds() const {
  std::vector<Kind> kinds;
  for (const auto& [name, change] : series_) kinds.push_back({name, change, {}});
  if (kinds.empty()) kinds.push_back({"all", {}, {}});
  if (!second_) return kinds;
  std::vector<Kind> out;
  for (const Kind& kind : kinds) {
    for (const double value : second_->values) {
      const std::string own = fmt::format("{} = {}", second_->name, value);
      out.push_back({series_.empty() ? own : kind.name + ", " + own, kind.change, value});
    }
  }
  return out;
}

// The columns that say which bed a row is of.
std::vector<StatedColumn> Study::place_columns() const {
  const auto unit_of = [](const Parameter& parameter, bool scaled) {
    return scaled || parameter.unit.empty() ? std::string("1") : parameter.unit;  // scaled: in a unit of the user's own
  };
  bool scaled = parameter_.times != 1;
  std::vector<std::string> names;
  for (const Kind& kind : kinds_) scaled |= kind.change.times.value_or(1) != 1, names.push_back(kind.name);
  std::vector<StatedColumn> columns{{"series", "", "kind of bed", names},
                                    {parameter_.name, unit_of(parameter_, scaled), "parameter that is varied"}};
  if (second_)
    columns.push_back({second_->name, unit_of(*second_, second_->times != 1), "second parameter that is varied"});
  return columns;
}

std::vector<std::string> Study::chain_kinds() const {
  std::vector<std::string> kinds;
  if (!chain_.is_array()) return kinds;
  for (const Json& stage : chain_) {
    if (stage.is_object() && stage.contains("stage") && stage["stage"].is_string())
      kinds.push_back(stage["stage"].get<std::string>());
  }
  return kinds;
}

// Every series is read before any runs, so that a mistake in the last one is found now.
void Study::check_chains(Fields& fields, const ChainReader& read) {
  std::map<std::pair<std::string, std::string>, std::pair<Warning, std::size_t>> warnings;  // by kind and pointer
  std::size_t points_read = 0;
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    const std::size_t of_series = k / (second_ ? second_->values.size() : 1);
    const std::string where = series_.empty() ? "" : "/series/" + escape_pointer_token(series_[of_series].first);
    for (std::size_t v = 0; v < parameter_.values.size(); ++v) {
      try {
        const auto chain = std::make_shared<const Chain>(read(recipe_at({k, v, 0}, 1)));
        check_chain(fields, *chain);
        ++points_read;
        if (!first_) first_ = chain;
        for (const Warning& warning : chain->warnings)
          ++warnings.try_emplace({warning.kind, warning.problem.pointer}, warning, 0).first->second.second;
      } catch (const ConfigError& error) {
        for (const Problem& problem : error.problems())
          fields.problem(
              where,
              fmt::format("{} (at {} = {}): {}", problem.pointer, parameter_.name, parameter_.values[v], problem.what),
              problem.suggestion);
      } catch (const Error& error) {
        fields.problem(where, error.what());
      }
      if (fields.problem_count() > 0) return;
    }
  }
  for (const auto& [key, counted] : warnings)
    fields.warn(key.first, key.second,
                fmt::format("{} ({} of {} points)", counted.first.problem.what, counted.second, points_read),
                counted.first.problem.suggestion);
}

// What the chain may hold, and that it gives what is collected.
void Study::check_chain(Fields& fields, const Chain& chain) const {
  for (const ChainStage& stage : chain.stages) {
    // Pictures and verdicts are for people: no number of theirs is collected.
    for (const char* kind : {"chart", "claims", "study"}) {
      if (stage.stage == kind)
        fields.problem("/stages", fmt::format("the chain of a study cannot contain a {} stage", kind),
                       "Put it after the study");
    }
    if (stage.reads_files)
      fields.problem("/stages", "the stage \"" + stage.id + "\" reads a file, which a chain of a study cannot do",
                     "Put it after the study");
  }
  const std::vector<StatedStage> stated = chain.stated();
  for (const auto& [name, collected] : collect_) {
    if (!collected.column.empty()) {
      const std::string where = "/collect/" + escape_pointer_token(name);
      const StatedTable* table = table_at(chain, collected.at);
      if (table == nullptr) {
        fields.problem(where + "/at", "\"" + collected.at + "\" is not a table of the study's stages",
                       "Write /<stage id>/<file>.csv");
        continue;
      }
      for (const auto& [key, column] : {std::pair("/column", collected.column), std::pair("/by", collected.by)}) {
        if (const auto misfit = misfit_of_column(*table, column))
          fields.problem(where + key, misfit->what, misfit->suggestion);
      }
      continue;
    }
    const auto misfit = misfit_of_pointer(stated, collected.at, "the chain");
    if (misfit) fields.problem("/collect/" + escape_pointer_token(name) + "/at", misfit->what, misfit->suggestion);
  }
  for (const auto& [name, table] : tables_) {
    const std::string where = "/tables/" + escape_pointer_token(name);
    if (name.empty() || name.find_first_of("/\\ .") != std::string::npos || name == "table" || name == "replicas")
      fields.problem(
          where,
          "\"" + name +
              "\" cannot be the name of a table: use letters, digits, '-' and '_', but not \"table\" or \"replicas\"");
    std::vector<std::string> tokens;
    try {
      tokens = split_pointer(table.at);
    } catch (const UsageError&) {}
    const auto stage = std::find_if(stated.begin(), stated.end(),
                                    [&](const StatedStage& s) { return !tokens.empty() && s.id == tokens.front(); });
    if (tokens.size() != 2 || stage == stated.end()) {
      fields.problem(where + "/at", "\"" + table.at + "\" is not a file of the study's stages",
                     "Write /<stage id>/<file>.csv");
      continue;
    }
    auto misfit = misfit_of_table(*stage, tokens[1]);
    if (misfit) {
      fields.problem(where + "/at", misfit->what, misfit->suggestion);
      continue;
    }
    misfit = misfit_of_column(*stage->results->find_table(tokens[1]), table.key);
    if (misfit) fields.problem(where + "/key", misfit->what, misfit->suggestion);
  }
}

void Study::results(ResultList& list) const {
  std::vector<StatedColumn> columns = place_columns();
  const std::vector<StatedColumn> places = columns;
  const std::vector<std::string> names = columns.front().values;
  std::vector<StatedColumn> runs = columns;
  runs.push_back({"replica", "1", "number of the run"});
  list.number("/replicas", "1", "number of runs at every point");
  list.number("/runs", "1", "total number of runs");
  for (const auto& [name, collected] : collect_) {
    const auto tokens = split_pointer(collected.at);
    const ChainStage* stage = first_->find(tokens.front());
    const StatedResult* number =
        stage == nullptr ? nullptr
                         : stage->results->find(collected.at.substr(1 + escape_pointer_token(tokens.front()).size()));
    const bool scaled = collected.times != 1 || collected.plus != 0;
    std::string unit = number == nullptr ? "1" : number->unit, meaning = number == nullptr ? "" : number->meaning;
    if (const StatedTable* table = collected.column.empty() ? nullptr : table_at(*first_, collected.at)) {
      const std::string& of = takes_place(collected.take) ? collected.by : collected.column;
      for (const StatedColumn& column : table->columns) {
        if (column.name == of) unit = column.unit, meaning = column.meaning;
      }
    }
    if (scaled) unit = "1";  // in a unit of its own
    columns.push_back({name, unit, meaning});
    columns.push_back({name + "_error", unit, "standard error of the mean"});
    runs.push_back({name, unit, meaning});
    for (const std::string& one : names)
      list.quantity(pointer_join(pointer_join("/series", one) + "/#", name), unit, meaning, {}, true);
  }
  for (const std::string& one : names)
    for (std::size_t c = 1; c < places.size(); ++c)
      list.number(pointer_join(pointer_join("/series", one) + "/#", places[c].name), places[c].unit, places[c].meaning);
  list.table({"table.csv", "means over the runs of each point", columns});
  list.table({"replicas.csv", "the numbers of each run", runs});
  for (const auto& [name, table] : tables_) {
    const auto tokens = split_pointer(table.at);
    const StatedTable* source = first_->find(tokens[0])->results->find_table(tokens[1]);
    StatedTable out{name + ".csv", source->meaning + ", averaged over the runs", places};
    for (const StatedColumn& column : source->columns) {
      if (column.name == table.key) out.columns.push_back(column);
    }
    for (const StatedColumn& column : source->columns) {
      if (column.name == table.key) continue;
      out.columns.push_back(column);
      out.columns.push_back({column.name + "_error", column.unit, "standard error of the mean"});
    }
    out.columns.push_back({"runs", "1", "number of runs that have this row"});
    list.table(std::move(out));
  }
}

std::vector<Study::Point> Study::points() const {
  std::vector<Point> points;
  for (std::size_t k = 0; k < kinds_.size(); ++k)
    for (std::size_t v = 0; v < parameter_.values.size(); ++v)
      for (std::uint32_t r = 0; r < replicas_; ++r) points.push_back({k, v, r});
  return points;
}

// Seeds differ between all runs, also between values and series: their errors are independent.
JsonNode Study::recipe_at(const Point& point, std::uint64_t seed) const {
  JsonNode document = to_node(Json{{"name", "study"}, {"stages", chain_}});
  const Kind& bed = kinds_[point.series];
  for (const auto& [pointer, value] : bed.change.set) set_pointer(document, pointer, to_node(value));
  const double value = parameter_.values[point.value] * bed.change.times.value_or(parameter_.times);
  for (const std::string& pointer : parameter_.set)
    set_pointer(document, pointer, to_node(written_value(parameter_, value)));
  if (bed.second) {
    for (const std::string& pointer : second_->set)
      set_pointer(document, pointer, to_node(written_value(*second_, *bed.second * second_->times)));
  }
  const std::uint64_t own =
      replica_seed(seed, 1 + point.replica + 1000 * (point.value + 10'000 * static_cast<std::uint64_t>(point.series)));
  if (JsonNode* stages = document.find("stages"); stages != nullptr && stages->is_array()) {
    for (JsonNode& stage : stages->items) {
      const JsonNode* kind = stage.find("stage");
      const StageRow* row = kind != nullptr && kind->is_string() ? find_stage(kind->text) : nullptr;
      if (row != nullptr && row->uses_seed) set_pointer(stage, "/seed", to_node(Json(own)));
    }
  }
  return document;
}

std::vector<RunNumber> Study::numbers(const std::vector<Input>& chain) const {
  std::map<std::string, Json> results;
  std::vector<RunNumber> out;
  for (const auto& [name, collected] : collect_) {
    const std::vector<std::string> tokens = split_pointer(collected.at);
    const std::string& id = tokens.front();
    if (!collected.column.empty()) {
      const auto stage = std::find_if(chain.begin(), chain.end(), [&](const Input& i) { return i.id == id; });
      out.push_back(taken(collected, stage->file(tokens[1])));
      continue;
    }
    if (!results.contains(id))
      results[id] = std::find_if(chain.begin(), chain.end(), [&](const Input& i) { return i.id == id; })->result();
    const Json& result = results[id];
    RunNumber number;
    // What says of itself that it did not succeed has no numbers.
    const bool good = !result.contains("status") || result["status"] == "ok";
    const Json* found =
        good ? find_pointer(result, std::string_view(collected.at).substr(1 + escape_pointer_token(id).size()))
             : nullptr;
    if (found != nullptr && found->is_object() && found->contains("value")) {
      if (found->contains("std_error") && (*found)["std_error"].is_number())
        number.std_error = std::abs(collected.times) * (*found)["std_error"].get<double>();
      found = &(*found)["value"];
    }
    if (found != nullptr && found->is_number())
      number.value = collected.plus + collected.times * found->get<double>();
    else if (found != nullptr && found->is_boolean())
      number.value = found->get<bool>() ? 1 : 0;
    out.push_back(number);
  }
  return out;
}

namespace {
std::string quoted(const std::string& name) {
  if (name.find_first_of(",\"\n") == std::string::npos) return name;
  std::string out = "\"";
  for (const char c : name) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}
// The numbers of a run, as run_once() wrote them.
std::vector<RunNumber> kept_numbers(const Json& run) {
  const auto number = [](const Json& j) { return j.is_number() ? j.get<double>() : NAN; };
  std::vector<RunNumber> out;
  for (const Json& pair : run["numbers"]) out.push_back({number(pair[0]), number(pair[1])});
  return out;
}
std::string cell(double value) { return std::isfinite(value) ? number_text(value) : std::string(); }
}  // namespace

std::string Study::place_header() const { return "series," + parameter_.name + (second_ ? "," + second_->name : ""); }
std::string Study::place_cells(const Point& point) const {
  const Kind& kind = kinds_[point.series];
  std::string cells = quoted(kind.name) + fmt::format(",{}", parameter_.values[point.value]);
  if (kind.second) cells += fmt::format(",{}", *kind.second);
  return cells;
}

// Runs the chain at one point: {"numbers": [[value, error], ...], "tables": [{"header", "rows"}, ...]}.
Json Study::run_once(RunContext& context, const Point& point, const fs::path& folder,
                     const RunContext::Progress& progress) const {
  std::vector<Input> chain;
  try {
    chain = context.run_chain(recipe_at(point, context.seed()), folder, progress);
  } catch (const StageError& error) {
    throw StageError(fmt::format("{}, {} = {}, replica {}: {}", kinds_[point.series].name, parameter_.name,
                                 parameter_.values[point.value], point.replica, error.what()));
  }
  Json found{{"numbers", Json::array()}, {"tables", Json::array()}};
  for (const RunNumber& n : numbers(chain)) found["numbers"].push_back(Json::array({n.value, n.std_error}));
  for (const auto& [name, table] : tables_) {
    const auto tokens = split_pointer(table.at);
    const RunRows rows = read_run_rows(folder / tokens[0] / tokens[1]);
    if (std::find(rows.header.begin(), rows.header.end(), table.key) == rows.header.end())
      throw InputError(fmt::format("tables/{}: {} has no column \"{}\"", name, table.at, table.key));
    found["tables"].push_back(Json{{"header", rows.header}, {"rows", rows.rows}});
  }
  return found;
}

// A table with the meaning and unit of its columns beside it, as results() states them.
void Study::write_described(RunContext& context, const std::string& file, const std::string& csv) const {
  Table described = context.table(file);
  described.note("runs_per_point", replicas_);
  write_file(context.output(file), csv);
  write_file(metadata_path(context.output(file)), dump(described.metadata(file)));
}

// NAME.csv: series, parameter, key, then mean and error of every other column, and how many runs had the row.
void Study::write_tables(RunContext& context, const std::vector<Point>& all, const std::vector<Json>& kept) const {
  for (std::size_t k = 0; k < tables_.size(); ++k) {
    const auto& [name, table] = tables_[k];
    std::string text;
    std::vector<std::string> header;
    for (std::size_t i = 0; i < all.size(); i += replicas_) {
      std::map<double, std::vector<std::vector<RunNumber>>> columns;  // key → column → runs
      for (std::size_t r = i; r < i + replicas_; ++r) {
        const Json& one = kept[r]["tables"][k];
        if (header.empty()) {
          header = one["header"].get<std::vector<std::string>>();
          text += place_header() + "," + table.key;
          for (const std::string& column : header) {
            if (column != table.key) text += fmt::format(",{0},{0}_error", column);
          }
          text += ",runs\n";
        }
        const auto place =
            static_cast<std::size_t>(std::find(header.begin(), header.end(), table.key) - header.begin());
        for (const Json& row : one["rows"]) {
          const auto cells = row.get<std::vector<std::string>>();
          const double key = place < cells.size() ? number_in(cells[place]).value_or(NAN) : NAN;
          if (!std::isfinite(key)) continue;
          auto& of_key = columns[key];
          of_key.resize(header.size());
          for (std::size_t c = 0; c < cells.size() && c < header.size(); ++c)
            of_key[c].push_back({number_in(cells[c]).value_or(NAN), NAN});
        }
      }
      for (const auto& [key, values] : columns) {
        text += place_cells(all[i]) + "," + cell(key);
        for (std::size_t c = 0; c < header.size(); ++c) {
          if (header[c] == table.key) continue;
          const MeanOfRuns mean(values[c]);
          text += "," + cell(mean.mean) + "," + cell(mean.error);
        }
        text += fmt::format(",{}\n", values.front().size());
      }
    }
    write_described(context, name + ".csv", text);
  }
}

// The seconds that the run of every point will take, by a trial of its first replica that is not done.
std::vector<double> Study::trials(RunContext& context, const std::vector<Point>& all,
                                  const std::vector<bool>& done) const {
  std::vector<double> seconds(all.size(), 0);
  const std::size_t places = all.size() / replicas_;
  const auto one = [&](std::size_t place) {
    for (std::size_t i = place * replicas_; i < (place + 1) * replicas_; ++i) {
      if (done[i] || context.interrupted()) continue;
      const double trial = context.trial_of_chain(recipe_at(all[i], context.seed()));
      for (std::size_t k = i; k < (place + 1) * replicas_; ++k) seconds[k] = done[k] ? 0 : trial;
      return;
    }
  };
  one(0);
  if (done[0] || seconds[0] > 0)  // of a chain that has no trial one point is asked, not all
    for_each_index(places - 1, context.jobs(), [&](std::size_t i) { one(i + 1); });
  return seconds;
}

// Every point once, on as many threads as allowed. A run that is kept from an earlier attempt is not run again.
std::vector<Json> Study::run_all(RunContext& context, const std::vector<Point>& all) const {
  std::vector<Json> kept(all.size());
  const fs::path scratch = context.scratch();
  const auto file_of = [&](std::size_t i) { return scratch / fmt::format("run-{}.json", i); };
  TimeLeft time(all.size(), context.jobs());
  std::vector<bool> there(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    there[i] = fs::exists(file_of(i));
    if (there[i]) time.drop(i);
  }
  const std::vector<double> seconds = trials(context, all, there);
  for (std::size_t i = 0; i < all.size(); ++i) time.expect(i, seconds[i]);
  std::size_t said = all.size();  // the place that the last notice named: its replicas take the same time
  for (const LongPart& part : long_parts(seconds)) {
    if (part.part / replicas_ == said) continue;
    said = part.part / replicas_;
    context.notice(
        fmt::format("the run of {}, {} = {} {}. To save this time, stop with Ctrl-C. Then remove this value, or "
                    "measure for a shorter time",
                    kinds_[all[part.part].series].name, parameter_.name, parameter_.values[all[part.part].value],
                    long_part_text(part)));
  }
  const std::string runs = fmt::format("{} runs", all.size());
  for_each_index(all.size(), context.jobs(), [&](std::size_t i) {
    context.check_interrupted();
    const fs::path file = file_of(i), folder = scratch / fmt::format("run-{}", i);
    if (!there[i]) {
      time.begin(i);
      const auto progress = [&](double fraction) {
        time.reached(i, fraction);
        context.progress(time.fraction(), runs);
      };
      write_file_atomically(file, dump(run_once(context, all[i], folder, progress)));
      fs::remove_all(folder);
      time.end(i);
    }
    kept[i] = read_json(file);
    context.progress(time.fraction(), runs);
  });
  return kept;
}

// replicas.csv: every run with its numbers.
std::string Study::replicas_csv(const std::vector<Point>& all, const std::vector<std::vector<RunNumber>>& found) const {
  std::string text = place_header() + ",replica";
  for (const auto& [name, ignored] : collect_) text += "," + name;
  text += "\n";
  for (std::size_t i = 0; i < all.size(); ++i) {
    text += place_cells(all[i]) + fmt::format(",{}", all[i].replica);
    for (const RunNumber& number : found[i]) text += "," + cell(number.value);
    text += "\n";
  }
  return text;
}

// table.csv and the rows of study.json: means over the replicas of a point, with their errors.
Study::Averages Study::average(const std::vector<Point>& all, const std::vector<std::vector<RunNumber>>& found) const {
  Averages out;
  out.csv = place_header();
  for (const auto& [name, ignored] : collect_) out.csv += fmt::format(",{0},{0}_error", name);
  out.csv += "\n";
  for (std::size_t i = 0; i < all.size(); i += replicas_) {
    out.csv += place_cells(all[i]);
    Json row;
    row[parameter_.name] = parameter_.values[all[i].value];
    if (kinds_[all[i].series].second) row[second_->name] = *kinds_[all[i].series].second;
    for (std::size_t c = 0; c < collect_.size(); ++c) {
      std::vector<RunNumber> values;
      for (std::size_t r = i; r < i + replicas_; ++r) values.push_back(found[r][c]);
      const auto [n, mean, error] = MeanOfRuns(values);
      out.missing += replicas_ - static_cast<std::size_t>(n);
      out.csv += "," + cell(mean) + "," + cell(error);
      Json quantity{{"value", std::isfinite(mean) ? Json(mean) : Json()}};
      if (std::isfinite(error)) quantity["std_error"] = error;
      quantity["runs"] = static_cast<int>(n);
      row[collect_[c].first] = std::move(quantity);
    }
    out.csv += "\n";
    out.series[kinds_[all[i].series].name].push_back(std::move(row));
  }
  return out;
}

void Study::run(RunContext& context) const {
  const std::vector<Point> all = points();
  const std::vector<Json> kept = run_all(context, all);
  std::vector<std::vector<RunNumber>> found;
  for (const Json& one : kept) found.push_back(kept_numbers(one));
  const Averages averages = average(all, found);
  if (averages.missing > 0)
    context.warning(
        fmt::format("{} of {} numbers are missing, because the stages of the study did not produce them. Their cells "
                    "in replicas.csv are empty",
                    averages.missing, all.size() * collect_.size()));
  write_described(context, "table.csv", averages.csv);
  write_described(context, "replicas.csv", replicas_csv(all, found));
  write_tables(context, all, kept);
  write_file(context.output("study.json"),
             dump(Json{{"replicas", replicas_}, {"runs", all.size()}, {"series", averages.series}}));
}

}  // namespace

StageRow study_stage() {
  return {.name = "study",
          .summary = "runs a chain of stages over a parameter, for several kinds of beds, with replicas",
          .uses_seed = true,
          .result = "study.json",
          .pages = study_pages(),
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Study>(); }};
}

}  // namespace shakebed::pipelines
