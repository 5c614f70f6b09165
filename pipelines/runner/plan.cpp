#include "pipelines/runner/plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "pipelines/formats/files.hpp"

namespace shakebed::pipelines {
namespace {

// Names that OUT uses itself, with any ending: manifest.json, summary.md, ...
const std::vector<std::string> reserved_ids = {"pipeline", "status",   "warnings", "points", "report",
                                               "manifest", "resolved", "summary",  "sweep",  "cache",
                                               "shared",   "slurm",    "figures"};

bool good_id(std::string_view id) {
  return !id.empty() && id.size() <= 64 && id.front() != '.' && id.front() != '-' &&
         std::all_of(id.begin(), id.end(),
                     [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-' || c == '.'; });
}

// The keys that every stage has, besides its own.
struct CommonOptions {
  std::string stage, id;
  std::vector<std::string> from;
  std::uint64_t seed = 1;
  bool reduced = false;
};

void describe_common(Fields& fields, CommonOptions& common, const StageRow& row) {
  fields.text("stage", common.stage, {.help = "kind of the stage", .required = true});
  fields.text("id", common.id, {.help = "name of the stage and of its folder in OUT; its kind if left out"});
  fields.texts("from", common.from, {.help = "ids of the stages whose results it reads"});
  if (row.uses_seed) fields.integer("seed", common.seed, {.help = "of its random numbers"});
  const std::vector<Choice<bool>> units{{false, "SI"}, {true, "reduced"}};
  fields.choice("units", common.reduced, units,
                {.help = "SI: quantities are strings with a unit or numbers in SI. reduced: plain numbers, lengths in "
                         "D, masses in m, g or the starting T equal to 1"});
}

void describe_report(Fields& fields, ReportOptions& report) {
  fields.text("title", report.title, {.help = "headline of report.html"});
  fields.texts("text", report.text, {.help = "paragraphs under the headline"});
  fields.array<PublishedNumber>(
      "published", report.published,
      [](Fields& f, PublishedNumber& number) {
        f.text("number", number.pointer, {.help = "where ours is: /<stage id>/<name in its result>", .required = true});
        f.text("label", number.label, {.help = "what it is called", .required = true});
        f.text("value", number.value, {.help = "as published, with its unit", .required = true});
        f.text("place", number.place, {.help = "where it is printed"});
        f.number("relative", number.relative,
                 {.help = "nearer than this part of it counts as agreement", .range = non_negative});
        if (!f.decoding()) return;
        try {
          if (!number.value.empty()) parse_quantity(number.value);
        } catch (const std::invalid_argument& problem) {
          f.problem("/value", problem.what());
        }
        f.require(number.pointer.empty() || number.pointer.front() == '/', "number", "is not a JSON pointer");
      },
      {.help = "published numbers to stand beside ours"});
  fields.array<AssumedInput>("assumed", report.assumed,
                             [](Fields& f, AssumedInput& input) {
                               f.text("input", input.pointer, {.help = "pointer into this recipe", .required = true});
                               f.text("why", input.why, {.help = "why it had to be assumed", .required = true});
                               f.require(input.pointer.empty() || input.pointer.front() == '/', "input",
                                         "is not a JSON pointer");
                             },
                             {.help = "inputs that the source does not give: marked so in the report"});
  fields.boolean(
      "audit", report.audit,
      {.help = "the numbers that Quinn and Hong print beside recomputed ones, as shakebed audit gives them"});
}

void describe_sweep(Fields& fields, SweepOptions& sweep) {
  const std::vector<Choice<SweepKind>> kinds{
      {SweepKind::grid, "grid"}, {SweepKind::zip, "zip"}, {SweepKind::list, "list"}, {SweepKind::random, "random"}};
  fields.choice("kind", sweep.kind, kinds,
                {.help = "grid: every combination; zip: first with first, ...; list: points one by one; random: "
                         "uniform in the ranges"});
  Json over = Json::object(), points = Json::array();
  fields.any("over", over,
             {.help = "JSON pointer into the recipe → array of values, or {\"from\", \"to\", \"count\", \"scale\"}"});
  fields.any("points", points, {.help = "list: objects pointer → value"});
  fields.integer("count", sweep.count, {.help = "number of random points", .range = non_negative});
  fields.integer("seed", sweep.seed, {.help = "of the random points"});
  fields.integer("replicas", sweep.replicas,
                 {.help = "runs of each point, each with seeds of its own", .range = from_to(1, 1e6)});
  fields.texts("collect", sweep.collect, {.help = "numbers to gather into sweep.csv: pointers into the results"});
  if (fields.mode() != Fields::Mode::decode) return;

  const auto bad = [&](const std::string& pointer, const std::string& what, const std::string& suggestion = {}) {
    fields.problem(pointer, what, suggestion);
  };
  const auto quantity = [&](const Json& json, const std::string& pointer, Quantity& out) {
    try {
      if (json.is_number())
        out = {json.get<double>(), dimension::none, false};
      else if (json.is_string())
        out = parse_quantity(json.get<std::string>());
      else
        return bad(pointer, "expected a number or a quantity"), false;
      return true;
    } catch (const std::invalid_argument& problem) {
      return bad(pointer, problem.what()), false;
    }
  };
  if (!over.is_object()) return bad("/over", "expected an object: JSON pointer → values");
  for (const auto& [pointer, values] : over.items()) {
    const std::string where = "/over/" + escape_pointer_token(pointer);
    SweepAxis axis{.pointer = pointer};
    if (pointer.empty() || pointer.front() != '/') {
      bad(where, "is not a JSON pointer", "Write for example \"/stages/bed/floor/amplitude\"");
    }
    if (values.is_array()) {
      for (const Json& value : values) axis.values.push_back(value);
      if (axis.values.empty()) bad(where, "has no values");
    } else if (values.is_object()) {
      Quantity low, high;
      if (!values.contains("from") || !values.contains("to")) {
        bad(where, "a range needs \"from\" and \"to\"");
        continue;
      }
      for (const auto& [key, ignored] : values.items()) {
        if (key != "from" && key != "to" && key != "count" && key != "scale" && key != "$comment") {
          bad(where + "/" + escape_pointer_token(key), fmt::format("unknown key \"{}\"", key),
              "Known here: from, to, count, scale");
        }
      }
      if (!quantity(values["from"], where + "/from", low) || !quantity(values["to"], where + "/to", high)) continue;
      if (low.dimension != high.dimension) bad(where, "\"from\" and \"to\" have different units");
      axis.low = low.value, axis.high = high.value, axis.unit = low.has_unit ? si_unit(low.dimension) : "";
      const std::string scale =
          values.contains("scale") && values["scale"].is_string() ? values["scale"].get<std::string>() : "linear";
      if (scale != "linear" && scale != "logarithmic") bad(where + "/scale", "expected \"linear\" or \"logarithmic\"");
      axis.logarithmic = scale == "logarithmic";
      if (axis.logarithmic && !(axis.low > 0 && axis.high > 0)) {
        bad(where, "a logarithmic range must lie above 0");
        continue;
      }
      if (sweep.kind != SweepKind::random) {
        const bool counted = values.contains("count") && values["count"].is_number_integer() &&
                             values["count"].get<std::int64_t>() >= 1 &&
                             values["count"].get<std::int64_t>() <= 10'000'000;
        if (!counted) {
          bad(where + "/count", "a range needs \"count\", a whole number from 1 to 10,000,000");
          continue;
        }
        const auto count = values["count"].get<std::int64_t>();
        for (std::int64_t i = 0; i < count; ++i) {
          const double u = count == 1 ? 0 : static_cast<double>(i) / static_cast<double>(count - 1);
          const double value = i == 0             ? axis.low
                               : i == count - 1   ? axis.high
                               : axis.logarithmic ? axis.low * std::pow(axis.high / axis.low, u)
                                                  : axis.low + (axis.high - axis.low) * u;
          axis.values.push_back(axis.unit.empty() ? Json(value) : Json(number_text(value) + " " + axis.unit));
        }
      }
    } else {
      bad(where, "expected an array of values or a range {\"from\", \"to\", \"count\"}");
    }
    sweep.axes.push_back(std::move(axis));
  }
  if (sweep.kind == SweepKind::list) {
    if (!sweep.axes.empty()) bad("/over", "a list sweep has \"points\", not \"over\"");
    if (!points.is_array() || points.empty())
      return bad("/points", "a list sweep needs \"points\": [{pointer: value, ...}, ...]");
    // Every point names the same pointers: each is an axis, zipped.
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::string where = "/points/" + std::to_string(i);
      if (!points[i].is_object() || points[i].empty()) {
        bad(where, "expected an object: pointer → value");
        continue;
      }
      for (const auto& item : points[i].items()) {
        const std::string& pointer = item.key();
        const Json& value = item.value();
        auto axis = std::find_if(sweep.axes.begin(), sweep.axes.end(),
                                 [&](const SweepAxis& a) { return a.pointer == pointer; });
        if (axis == sweep.axes.end()) axis = sweep.axes.insert(sweep.axes.end(), SweepAxis{.pointer = pointer});
        axis->values.resize(i);
        axis->values.push_back(value);
      }
    }
    for (SweepAxis& axis : sweep.axes) axis.values.resize(points.size());
  } else {
    if (sweep.axes.empty()) bad("/over", "a sweep needs at least one pointer in \"over\"");
    if (!points.empty()) bad("/points", "only a list sweep has \"points\"", "Write \"kind\": \"list\"");
  }
  if (sweep.kind == SweepKind::zip && !sweep.axes.empty()) {
    for (const SweepAxis& axis : sweep.axes) {
      if (axis.values.size() != sweep.axes.front().values.size()) {
        bad("/over/" + escape_pointer_token(axis.pointer),
            fmt::format("has {} values, {} has {}: zip needs as many of each", axis.values.size(),
                        sweep.axes.front().pointer, sweep.axes.front().values.size()));
      }
    }
  }
  if (sweep.kind == SweepKind::random && sweep.count == 0) bad("/count", "a random sweep needs \"count\"");
}

// The top of a recipe, without its stages.
struct Top {
  std::string schema, preset, name, description;
  int format = recipe_format;
  Json presets;
  ReportOptions report;
  std::optional<SweepOptions> sweep;
  Json raw_sweep;
};

void describe_top(Fields& fields, Top& top) {
  fields.text("$schema", top.schema, {.help = "where editors find the schema"});
  fields.integer("format", top.format, {.help = "of the recipe"});
  fields.text("name", top.name,
              {.help = "of the pipeline; results go to results/<name>", .required = true, .example = "\"my-bed\""});
  fields.text("description", top.description, {.help = "what it is for"});
  fields.object<ReportOptions>("report", top.report, describe_report,
                               {.help = "what report.html says beside the results"});
  fields.object<SweepOptions>("sweep", top.sweep, describe_sweep, {.help = "run the pipeline at many points"});
  fields.any("presets", top.presets,
             {.help = "named sets of changes for --preset NAME: {\"quick\": {\"/stages/bed/measure\": \"2 s\"}}"});
  fields.text("$preset", top.preset, {.help = "in resolved.json: the preset whose values these are"});
}

// Whether the presets are what they should be; whether their values are good is known when they are applied.
void check_presets(const JsonNode& root, const Fields::Source& source) {
  const JsonNode* presets = root.find("presets");
  if (presets == nullptr) return;
  const auto problem = [&](const JsonNode& node, std::string pointer, std::string what, std::string suggestion) {
    source.problems->push_back({node.from_command_line ? "--set" : source.file,
                                node.from_command_line ? Position{} : node.at, std::move(pointer), std::move(what),
                                std::move(suggestion)});
  };
  const char* example = "Write \"presets\": {\"quick\": {\"/stages/bed/measure\": \"2 s\"}}";
  if (!presets->is_object()) {
    problem(*presets, "/presets", fmt::format("expected an object: name → changes; got {}", presets->described()),
            example);
    return;
  }
  for (const JsonMember& preset : presets->members) {
    if (preset.key == "$comment") continue;
    const std::string where = pointer_join("/presets", preset.key);
    if (!preset.value.is_object()) {
      problem(preset.value, where,
              fmt::format("expected an object: JSON pointer → value; got {}", preset.value.described()), example);
      continue;
    }
    for (const JsonMember& change : preset.value.members) {
      if (change.key == "$comment") continue;
      if (change.key.empty() || change.key.front() != '/')
        problem(change.value, pointer_join(where, change.key), fmt::format("\"{}\" is not a JSON pointer", change.key),
                "Write for example \"/stages/bed/measure\"");
      else if (change.key.starts_with("/presets") || change.key.starts_with("/$preset"))
        problem(change.value, pointer_join(where, change.key), "a preset cannot change the presets", "Remove it");
    }
  }
}

// The recipe inside of a stage that runs others.
Chain read_chain(const JsonNode& recipe) {
  const Plan plan = make_plan(recipe, "(chain)", std::filesystem::current_path());
  Chain chain;
  for (const PlannedStage& stage : plan.stages)
    chain.stages.push_back({stage.id, std::string(stage.row->name), !stage.input_files.empty()});
  return chain;
}

struct Draft {  // a stage before its place in the order is known
  const JsonNode* node = nullptr;
  CommonOptions common;
  const StageRow* row = nullptr;
  std::size_t index = 0;
};

}  // namespace

const PlannedStage* Plan::find(std::string_view id) const {
  for (const PlannedStage& stage : stages) {
    if (stage.id == id) return &stage;
  }
  return nullptr;
}

std::size_t Plan::index_of(std::string_view id) const {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    if (stages[i].id == id) return i;
    names.push_back(stages[i].id);
  }
  const std::string nearest = nearest_name(id, names);
  throw UsageError(fmt::format("there is no stage \"{}\"; {}", id,
                               nearest.empty() ? fmt::format("the recipe has {}", fmt::join(names, ", "))
                                               : fmt::format("did you mean \"{}\"?", nearest)));
}

Setting parse_setting(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) {
    throw UsageError(fmt::format("--set {}: expected POINTER=VALUE, as in --set /stages/0/seed=7", text));
  }
  Setting setting{text.substr(0, equals), {}};
  split_pointer(setting.pointer);
  const std::string value = text.substr(equals + 1);
  std::vector<Problem> problems;
  auto node = parse_json(value, "--set", problems);
  if (node && problems.empty()) {
    setting.value = std::move(*node);
  } else {
    setting.value.kind = JsonNode::Kind::string;  // 2.5 mm
    setting.value.text = value;
  }
  return setting;
}

std::vector<std::string> preset_names(const JsonNode& document) {
  std::vector<std::string> names;
  if (const JsonNode* presets = document.find("presets"); presets != nullptr && presets->is_object()) {
    for (const JsonMember& preset : presets->members) {
      if (preset.key != "$comment") names.push_back(preset.key);
    }
  }
  return names;
}

void apply_preset(JsonNode& document, const std::string& file, const std::string& name) {
  const std::vector<std::string> names = preset_names(document);
  if (names.empty()) throw UsageError(fmt::format("--preset {}: {} has no presets", name, file));
  const JsonNode presets = *document.find("presets");
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    const std::string nearest = nearest_name(name, names);
    throw UsageError(fmt::format("--preset {}: {}:{}:{}: /presets: there is none of this name; there {} {}{}", name,
                                 file, presets.at.line, presets.at.column, names.size() == 1 ? "is" : "are",
                                 fmt::join(names, ", "),
                                 nearest.empty() ? "" : fmt::format("; did you mean \"{}\"?", nearest)));
  }
  std::vector<Problem> problems;
  check_presets(document, {.file = file, .directory = {}, .problems = &problems});
  if (!problems.empty()) throw ConfigError(std::move(problems));
  for (const JsonMember& change : presets.find(name)->members) {
    if (change.key == "$comment") continue;
    try {
      set_pointer(document, change.key, change.value, ValueFrom::file);
    } catch (const UsageError& error) {
      problems.push_back({file, change.at, pointer_join(pointer_join("/presets", name), change.key), error.what(),
                          "Name a stage by its id or its number: /stages/bed/measure"});
    }
  }
  if (!problems.empty()) throw ConfigError(std::move(problems));
  JsonNode text;
  text.kind = JsonNode::Kind::string;
  text.text = name;
  set_pointer(document, "/$preset", std::move(text));
}

Plan read_plan_text(const std::string& text, const std::string& file, const std::filesystem::path& directory,
                    const std::vector<Setting>& settings, const std::optional<std::string>& preset) {
  std::vector<Problem> problems;
  auto document = parse_json(text, file, problems);
  if (!problems.empty()) throw ConfigError(std::move(problems));
  if (preset) apply_preset(*document, file, *preset);
  for (const Setting& setting : settings) set_pointer(*document, setting.pointer, setting.value);
  return make_plan(std::move(*document), file, directory);
}

Plan read_plan(const std::filesystem::path& file, const std::vector<Setting>& settings,
               const std::optional<std::string>& preset) {
  return read_plan_text(read_file(file), file.string(), file.parent_path(), settings, preset);
}

// A file that is no recipe at all would otherwise have a problem in every line.
constexpr std::size_t most_problems = 1000;

Plan make_plan(JsonNode document, const std::string& file, const std::filesystem::path& directory) {
  Plan plan;
  plan.file = file;
  plan.directory = directory;
  plan.document = std::move(document);
  std::vector<Problem> problems;
  const auto problem = [&](const JsonNode& node, std::string pointer, std::string what, std::string suggestion = {}) {
    problems.push_back({node.from_command_line ? "--set" : file, node.from_command_line ? Position{} : node.at,
                        std::move(pointer), std::move(what), std::move(suggestion)});
  };
  const JsonNode& root = plan.document;
  if (!root.is_object()) {
    problem(root, "",
            fmt::format("expected a recipe, an object with \"name\" and \"stages\"; got {}", root.described()));
    throw ConfigError(std::move(problems));
  }

  const Fields::Source source{.file = file, .directory = directory, .problems = &problems};
  // A recipe from a newer program: say that, rather than a list of unknown keys.
  if (const JsonNode* format = root.find("format");
      format != nullptr && format->is_number() && format->number > recipe_format) {
    problem(*format, "/format",
            fmt::format("this recipe has format {}, this program reads up to {}", format->text, recipe_format),
            "Use a newer shakebed");
    throw ConfigError(std::move(problems));
  }
  Top top;
  {
    Fields fields = Fields::decode(root, "", source);
    describe_top(fields, top);
    Json ignored;
    fields.any("stages", ignored);
    fields.finish();
    check_presets(root, source);
  }
  plan.name = top.name, plan.description = top.description, plan.report = top.report, plan.sweep = top.sweep;
  plan.preset = top.preset;
  if (!top.name.empty() && !good_id(top.name)) {
    problem(*root.find("name"), "/name", fmt::format("\"{}\" cannot be the name of a folder", top.name),
            "Use letters, digits, '-', '_' and '.'");
  }

  // --- the stages: kinds and ids
  const JsonNode* list = root.find("stages");
  std::vector<Draft> drafts;
  if (list == nullptr) {
    problem(root, "/stages", "\"stages\" is missing: an array of stages is needed",
            "Add \"stages\": [{\"stage\": \"simulate\", ...}]");
  } else if (!list->is_array()) {
    problem(*list, "/stages", fmt::format("expected an array of stages, got {}", list->described()));
  } else if (list->items.empty()) {
    problem(*list, "/stages", "there is no stage in it", "Add {\"stage\": \"simulate\", ...}");
  } else {
    std::vector<std::string> kinds;
    for (const StageRow& row : stage_table()) kinds.emplace_back(row.name);
    for (std::size_t i = 0; i < list->items.size(); ++i) {
      const JsonNode& item = list->items[i];
      const std::string pointer = pointer_join("/stages", i);
      if (problems.size() >= most_problems) {
        problem(item, pointer, fmt::format("more than {} mistakes: the rest is not looked at", most_problems));
        throw ConfigError(std::move(problems));
      }
      if (!item.is_object()) {
        problem(item, pointer, fmt::format("expected a stage, an object; got {}", item.described()));
        continue;
      }
      const JsonNode* kind = item.find("stage");
      if (kind == nullptr || !kind->is_string()) {
        problem(kind != nullptr ? *kind : item, pointer + "/stage", "\"stage\" must name the kind of the stage",
                fmt::format("One of {}", fmt::join(kinds, ", ")));
        continue;
      }
      const StageRow* row = find_stage(kind->text);
      if (row == nullptr) {
        const std::string nearest = nearest_name(kind->text, kinds);
        problem(*kind, pointer + "/stage", fmt::format("there is no stage \"{}\"", kind->text),
                nearest.empty() ? fmt::format("There are {}", fmt::join(kinds, ", "))
                                : fmt::format("Did you mean \"{}\"?", nearest));
        continue;
      }
      Draft draft{.node = &item, .common = {}, .row = row, .index = i};
      // Only the id here: "from" of others needs it.
      draft.common.id = row->name;
      if (const JsonNode* id = item.find("id"); id != nullptr && id->is_string()) {
        draft.common.id = id->text;
        const bool reserved = std::find(reserved_ids.begin(), reserved_ids.end(),
                                        id->text.substr(0, id->text.find('.'))) != reserved_ids.end();
        if (!good_id(id->text) || reserved) {
          problem(*id, pointer + "/id",
                  reserved ? fmt::format("the id \"{}\" is one that OUT uses itself", id->text)
                           : fmt::format("\"{}\" cannot be an id: it names a folder inside OUT", id->text),
                  "Use letters, digits, '-', '_' and '.', not starting with '.' or '-'");
        }
      }
      const auto same =
          std::find_if(drafts.begin(), drafts.end(), [&](const Draft& d) { return d.common.id == draft.common.id; });
      if (same != drafts.end()) {
        const JsonNode* id = item.find("id");
        problem(id != nullptr ? *id : item, id != nullptr ? pointer + "/id" : pointer,
                fmt::format("two stages would write to the folder \"{}\": this one and /stages/{}", draft.common.id,
                            same->index),
                "Give one of them an \"id\" of its own");
        continue;
      }
      drafts.push_back(std::move(draft));
    }
  }

  // --- the arrows
  std::vector<std::string> ids;
  for (const Draft& draft : drafts) ids.push_back(draft.common.id);
  std::vector<std::vector<std::size_t>> arrows(drafts.size());
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    const JsonNode* from = drafts[i].node->find("from");
    const std::string pointer = pointer_join("/stages", drafts[i].index) + "/from";
    const StageRow& row = *drafts[i].row;
    std::vector<std::pair<const JsonNode*, std::string>> names;
    if (from != nullptr && from->is_string()) names.emplace_back(from, pointer);
    if (from != nullptr && from->is_array()) {
      for (std::size_t k = 0; k < from->items.size(); ++k) {
        if (from->items[k].is_string()) names.emplace_back(&from->items[k], pointer_join(pointer, k));
      }
    }
    for (const auto& [node, where] : names) {
      const auto found = std::find(ids.begin(), ids.end(), node->text);
      if (found == ids.end()) {
        const std::string nearest = nearest_name(node->text, ids);
        problem(*node, where, fmt::format("there is no stage with the id \"{}\"", node->text),
                nearest.empty() ? fmt::format("There are {}", fmt::join(ids, ", "))
                                : fmt::format("Did you mean \"{}\"?", nearest));
        continue;
      }
      const auto target = static_cast<std::size_t>(found - ids.begin());
      const std::string_view kind = drafts[target].row->name;
      if (std::find(arrows[i].begin(), arrows[i].end(), target) != arrows[i].end()) {
        problem(*node, where, fmt::format("names \"{}\" twice", node->text));
      } else if (std::find(row.accepts.begin(), row.accepts.end(), kind) == row.accepts.end()) {
        problem(
            *node, where,
            fmt::format("\"{}\" is a stage of kind {}, and {} does not read its results", node->text, kind, row.name),
            row.accepts.empty() ? "" : fmt::format("It reads those of {}", fmt::join(row.accepts, ", ")));
      } else {
        arrows[i].push_back(target);
      }
    }
    const auto count = static_cast<int>(names.size());
    if (count < row.fewest_inputs) {
      problem(
          from != nullptr ? *from : *drafts[i].node, pointer,
          fmt::format("{} needs the results of {} {}", row.name, row.fewest_inputs == row.most_inputs ? "" : "at least",
                      row.fewest_inputs == 1 ? "one stage" : fmt::format("{} stages", row.fewest_inputs)),
          fmt::format("Name a stage of these kinds by its id: {}", fmt::join(row.accepts, ", ")));
    } else if (count > row.most_inputs) {
      problem(*from, pointer,
              row.most_inputs == 0
                  ? fmt::format("{} reads no other stage's results", row.name)
                  : fmt::format("names {} stages, {} reads at most {}", count, row.name, row.most_inputs));
    }
  }

  // --- the order: as written, but each after those it reads from
  std::vector<std::size_t> order;
  std::vector<bool> placed(drafts.size(), false);
  while (order.size() < drafts.size()) {
    const std::size_t before = order.size();
    for (std::size_t i = 0; i < drafts.size(); ++i) {
      const bool ready =
          !placed[i] && std::all_of(arrows[i].begin(), arrows[i].end(), [&](std::size_t k) { return placed[k]; });
      if (ready) placed[i] = true, order.push_back(i);
    }
    if (order.size() == before) {
      std::vector<std::string> circle;
      const JsonNode* first = nullptr;
      std::string where;
      for (std::size_t i = 0; i < drafts.size(); ++i) {
        if (placed[i]) continue;
        circle.push_back(drafts[i].common.id);
        if (first == nullptr)
          first = drafts[i].node->find("from"), where = pointer_join("/stages", drafts[i].index) + "/from";
      }
      problem(*first, where, fmt::format("these stages read from one another in a circle: {}", fmt::join(circle, ", ")),
              "A stage can only read what was finished before it");
      break;
    }
  }

  // --- the options
  std::vector<std::size_t> position(drafts.size(), 0);
  for (const std::size_t i : order) {
    const Draft& draft = drafts[i];
    PlannedStage planned;
    planned.id = draft.common.id;
    planned.row = draft.row;
    planned.pointer = pointer_join("/stages", draft.index);
    planned.stage = draft.row->make();
    Fields::Source stage_source = source;
    stage_source.input_files = &planned.input_files;
    for (const std::size_t k : arrows[i]) {
      planned.from.push_back(position[k]);
      stage_source.upstream.emplace_back(drafts[k].row->name);
      if (!planned.bed) planned.bed = plan.stages[position[k]].bed;
    }
    if (planned.bed) stage_source.bed = &*planned.bed;
    const std::size_t problems_before = problems.size();
    CommonOptions common;
    common.id = draft.common.id;
    Fields fields = Fields::decode(*draft.node, planned.pointer, stage_source);
    describe_common(fields, common, *draft.row);
    fields.set_reduced(common.reduced);
    planned.reduced = common.reduced;
    planned.seed = common.seed;
    planned.stage->describe(fields);
    if (problems.empty()) planned.stage->check_chains(fields, read_chain);
    fields.finish();
    if (problems.size() == problems_before) {
      if (auto bed = planned.stage->bed())
        planned.bed = KnownBed{std::move(*bed), fmt::format("stage \"{}\" ({})", planned.id, planned.pointer)};
    }
    for (auto& [pointer, path] : planned.input_files) pointer.erase(0, planned.pointer.size());
    planned.options = Json::object();
    Fields encoder = Fields::encode(planned.options);
    encoder.set_reduced(common.reduced);
    planned.stage->describe(encoder);
    position[i] = plan.stages.size();
    plan.stages.push_back(std::move(planned));
  }
  if (!problems.empty()) {
    std::stable_sort(problems.begin(), problems.end(), [](const Problem& a, const Problem& b) {
      return std::pair(a.at.line, a.at.column) < std::pair(b.at.line, b.at.column);
    });
    throw ConfigError(std::move(problems));
  }

  // --- resolved.json: the recipe with nothing left out
  plan.resolved["name"] = plan.name;
  plan.resolved["format"] = recipe_format;
  if (!plan.preset.empty()) plan.resolved["$preset"] = plan.preset;
  if (!plan.description.empty()) plan.resolved["description"] = plan.description;
  plan.resolved["stages"] = Json::array();
  for (const PlannedStage& stage : plan.stages) {
    Json out;
    out["stage"] = stage.row->name;
    out["id"] = stage.id;
    if (!stage.from.empty()) {
      out["from"] = Json::array();
      for (const std::size_t k : stage.from) out["from"].push_back(plan.stages[k].id);
    }
    if (stage.row->uses_seed) out["seed"] = stage.seed;
    if (stage.reduced) out["units"] = "reduced";
    for (const auto& [key, value] : stage.options.items()) out[key] = value;
    plan.resolved["stages"].push_back(std::move(out));
  }
  if (const JsonNode* report = root.find("report")) plan.resolved["report"] = report->to_json();
  if (const JsonNode* sweep = root.find("sweep")) plan.resolved["sweep"] = sweep->to_json();
  return plan;
}

Json recipe_schema() {
  Json schema;
  schema["$schema"] = "http://json-schema.org/draft-07/schema#";
  schema["title"] = "shakebed pipeline";
  Top top;
  Fields fields = Fields::schema(schema);
  describe_top(fields, top);
  Json stages;
  stages["type"] = "array";
  stages["minItems"] = 1;
  Json kinds = Json::array();
  Json choices = Json::array();
  for (const StageRow& row : stage_table()) {
    kinds.push_back(row.name);
    // In SI, and in reduced units: there quantities are plain numbers, and some options need not be given.
    for (const bool reduced : {false, true}) {
      Json body;
      Fields stage_fields = Fields::schema(body);
      CommonOptions common;
      describe_common(stage_fields, common, row);
      stage_fields.set_reduced(reduced);
      row.make()->describe(stage_fields);
      stage_fields.finish();
      body["description"] = row.summary;
      body["properties"]["stage"] = Json{{"const", row.name}};
      Json is_reduced{{"properties", {{"units", {{"const", "reduced"}}}}}, {"required", Json::array({"units"})}};
      Json choice;
      choice["if"]["properties"]["stage"]["const"] = row.name;
      choice["if"]["required"] = Json::array({"stage"});
      choice["if"]["allOf"] = Json::array({reduced ? is_reduced : Json{{"not", is_reduced}}});
      choice["then"] = std::move(body);
      choices.push_back(std::move(choice));
    }
  }
  stages["items"]["type"] = "object";
  stages["items"]["properties"]["stage"]["enum"] = std::move(kinds);
  stages["items"]["required"] = Json::array({"stage"});
  stages["items"]["allOf"] = std::move(choices);
  schema["properties"]["stages"] = std::move(stages);
  schema["properties"]["presets"]["type"] = "object";
  schema["properties"]["presets"]["additionalProperties"] = Json{{"type", Json::array({"object", "string"})}};
  schema["required"].push_back("stages");
  fields.finish();
  return schema;
}

std::string graph_dot(const Plan& plan) {
  std::string out = fmt::format("digraph \"{}\" {{\n  rankdir=LR;\n  node [shape=box, style=rounded];\n", plan.name);
  for (const PlannedStage& stage : plan.stages) {
    const std::string kind = stage.id == stage.row->name ? "" : fmt::format("\\n({})", stage.row->name);
    out += fmt::format("  \"{}\" [label=\"{}{}\"];\n", stage.id, stage.id, kind);
  }
  for (const PlannedStage& stage : plan.stages) {
    for (const std::size_t k : stage.from) out += fmt::format("  \"{}\" -> \"{}\";\n", plan.stages[k].id, stage.id);
  }
  return out + "}\n";
}

std::string graph_mermaid(const Plan& plan) {
  std::string out = "flowchart LR\n";
  for (std::size_t i = 0; i < plan.stages.size(); ++i) {
    const PlannedStage& stage = plan.stages[i];
    out += fmt::format("  s{}[\"{}{}\"]\n", i, stage.id,
                       stage.id == stage.row->name ? "" : fmt::format(" ({})", stage.row->name));
  }
  for (std::size_t i = 0; i < plan.stages.size(); ++i) {
    for (const std::size_t k : plan.stages[i].from) out += fmt::format("  s{} --> s{}\n", k, i);
  }
  return out;
}

}  // namespace shakebed::pipelines
