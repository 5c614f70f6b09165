#include "pipelines/runner/reference.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "pipelines/runner/recipe_options.hpp"

namespace shakebed::pipelines {
namespace {

// In a cell of a Markdown table.
std::string cell(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, 1, '\\');
  return text;
}
std::string code(const std::string& text) { return text.empty() ? "" : "`" + cell(text) + "`"; }

// --- options, from the JSON Schema of the stage

bool is_quantity(const Json& schema) { return schema.contains("anyOf") && schema["anyOf"][0].contains("pattern"); }
bool is_list_of_texts(const Json& schema) {
  return schema.contains("anyOf") && schema["anyOf"].back().value("type", "") == "array";
}

std::string type_text(const Json& schema) {
  if (schema.contains("enum"))
    return "one of " + cell(fmt::format("{}", fmt::join(
                                                  [&] {
                                                    std::vector<std::string> names;
                                                    for (const Json& one : schema["enum"]) names.push_back(one.dump());
                                                    return names;
                                                  }(),
                                                  ", ")));
  if (is_quantity(schema)) return "quantity";
  if (is_list_of_texts(schema)) return "text or list of texts";
  if (schema.contains("anyOf")) return type_text(schema["anyOf"][0]);
  const std::string type = schema.value("type", std::string("any"));
  if (type == "array") return schema.contains("items") ? "list: " + type_text(schema["items"]) : "list";
  return type == "string" ? "text" : type;
}

std::string range_text(const Json& schema) {
  if (is_quantity(schema)) return range_text(schema["anyOf"].back());
  if (schema.contains("anyOf")) {  // of alternatives, where all have the same
    const std::string first = range_text(schema["anyOf"][0]);
    for (const Json& one : schema["anyOf"])
      if (range_text(one) != first) return "";
    return first;
  }
  std::vector<std::string> parts;
  const std::pair<const char*, const char*> words[] = {
      {"minimum", "at least"}, {"exclusiveMinimum", "above"}, {"maximum", "at most"}, {"exclusiveMaximum", "below"}};
  for (const auto& [key, word] : words)
    if (schema.contains(key)) parts.push_back(fmt::format("{} {:g}", word, schema[key].get<double>()));
  return fmt::format("{}", fmt::join(parts, ", "));
}

class OptionTable {
 public:
  std::string text = "| option | meaning | type | range | default | example |\n|---|---|---|---|---|---|\n";

  void add_all(const Json& object, const std::string& prefix) {
    if (!object.contains("properties")) return;
    std::vector<std::string> required;
    if (object.contains("required")) required = object["required"].get<std::vector<std::string>>();
    for (const auto& [name, schema] : object["properties"].items()) {
      if (name == "$comment" || schema.contains("const")) continue;
      const bool needed = std::find(required.begin(), required.end(), name) != required.end();
      add(prefix + name, schema, needed);
    }
  }

 private:
  void add(const std::string& name, const Json& schema, bool required) {
    const std::string preset = schema.contains("default") ? schema["default"].dump() : "";
    const bool shown = schema.contains("examples") && !schema["examples"].empty();
    const std::string example = shown ? schema["examples"][0].dump() : "";
    text += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", name, cell(schema.value("description", std::string())),
                        type_text(schema), range_text(schema), required ? "required" : code(preset), code(example));
    add_all(schema, name + "/");
    if (schema.contains("items")) add_all(schema["items"], name + "/#/");
    if (schema.contains("additionalProperties") && schema["additionalProperties"].is_object())
      add_all(schema["additionalProperties"], name + "/*/");
    if (!schema.contains("anyOf") || is_quantity(schema)) return;
    for (const Json& one : schema["anyOf"]) {
      add_all(one, name + "/");
      if (one.contains("items")) add_all(one["items"], name + "/#/");
    }
  }
};

constexpr const char* options_note =
    "`#` stands for an index, `*` for a name of your choice. An option without a default may be left out.\n\n";

std::string options_text(const StageRow& row) {
  Json schema;
  Fields fields = Fields::schema(schema);
  CommonOptions common;
  describe_common(fields, common, row);
  row.make()->describe(fields);
  fields.finish();
  OptionTable table;
  table.add_all(schema, "");
  return table.text;
}

// --- results

std::string kind_text(ResultKind kind) {
  switch (kind) {
    case ResultKind::quantity:
      return "quantity";
    case ResultKind::number:
      return "number";
    case ResultKind::text:
      return "text";
    case ResultKind::truth:
      break;
  }
  return "true or false";
}

std::string when_text(const Given& given) { return given.possible && given.always ? "always" : cell(given.condition); }

// The simulations of one page have two units of energy.
std::string energy_unit_note(const ResultList& results) {
  const auto& all = results.all();
  const bool needed = std::any_of(all.begin(), all.end(),
                                  [](const StatedResult& one) { return one.unit.find("T0") != std::string::npos; });
  return needed ? "T0 is the unit of energy: m g D with gravity, the initial temperature of the disks without it.\n\n"
                : "";
}

std::string results_text(const StageRow& row) {
  ResultList results;
  row.make()->results(results);
  std::string text = fmt::format(
      "## Numbers in {}\nPointers begin behind the stage's id: `/ID/...`; `#` stands for an index, `*` for a name.\n\n"
      "{}| pointer | meaning | unit | kind | given |\n|---|---|---|---|---|\n",
      row.result, energy_unit_note(results));
  for (const StatedResult& one : results.all())
    text += fmt::format("| `{}` | {} | {} | {}{} | {} |\n", one.pointer, cell(one.meaning), one.unit,
                        kind_text(one.kind), one.may_be_null ? " or null" : "", when_text(one.given));
  if (!results.tables().empty()) text += "\n## Tables\n";
  for (const StatedTable& table : results.tables()) {
    text += fmt::format("\n### {}\n{} ({}).\n\n| column | unit | meaning |\n|---|---|---|\n", table.file, table.meaning,
                        when_text(table.given));
    for (const StatedColumn& column : table.columns)
      text += fmt::format("| `{}` | {} | {} |\n", column.name, column.unit.empty() ? "text" : column.unit,
                          cell(column.meaning));
  }
  return text;
}

std::string inputs_text(const StageRow& row) {
  if (row.most_inputs == 0) return "It reads no other stage.";
  const std::string kinds = fmt::format("{}", fmt::join(row.accepts, ", "));
  if (row.fewest_inputs == 0) return fmt::format("It may read stages of these kinds: {}.", kinds);
  if (row.fewest_inputs == row.most_inputs)
    return fmt::format("It reads {} {} of these kinds: {}.", row.fewest_inputs,
                       row.fewest_inputs == 1 ? "stage" : "stages", kinds);
  return fmt::format("It reads {} or more stages of these kinds: {}.", row.fewest_inputs, kinds);
}

}  // namespace

std::string reference_index() {
  std::string text = "# Stages\n\n| stage | what it does |\n|---|---|\n";
  for (const StageRow& row : stage_table()) text += fmt::format("| `{}` | {} |\n", row.name, row.summary);
  return text + "\n`shakebed reference STAGE` describes the options, the numbers and the tables of one stage.\n";
}

std::string reference_page(const StageRow& row) {
  return fmt::format("# {}\nThe stage {} {}. {} Its result file is `{}`.\n\n## Options\n{}{}\n{}", row.name, row.name,
                     row.summary, inputs_text(row), row.result, options_note, options_text(row), results_text(row));
}

std::string recipe_reference_page() {
  Json schema;
  Fields fields = Fields::schema(schema);
  RecipeTop top;
  describe_top(fields, top);
  fields.finish();
  OptionTable table;
  table.add_all(schema, "");
  return fmt::format(
      "# recipe\nA recipe is a JSON file. It contains the list \"stages\" and the options below. The options of a "
      "stage are on its own page.\n\n## Options\n{}{}",
      options_note, table.text);
}

}  // namespace shakebed::pipelines
