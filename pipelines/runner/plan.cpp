#include "pipelines/runner/plan.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

namespace shakebed::pipelines {
namespace {

// Names that OUT uses itself, with any ending: manifest.json, summary.md, ...
const std::vector<std::string> reserved_ids = {"pipeline", "status",   "warnings", "points", "report",
                                               "manifest", "resolved", "summary",  "sweep",  "cache",
                                               "shared",   "slurm",    "figures",  "cost"};

// A file that is no recipe at all would otherwise have a problem in every line.
constexpr std::size_t most_problems = 1000;
constexpr std::size_t longest_id = 64;  // characters

bool good_id(std::string_view id) {
  return !id.empty() && id.size() <= longest_id && id.front() != '.' && id.front() != '-' &&
         std::all_of(id.begin(), id.end(),
                     [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-' || c == '.'; });
}

std::vector<std::string> kinds_of_stages() {
  std::vector<std::string> kinds;
  for (const StageRow& row : stage_table()) kinds.emplace_back(row.name);
  return kinds;
}

// The recipe inside of a stage that runs others.
Chain read_chain(const JsonNode& recipe) {
  Plan plan = make_plan(recipe, "(chain)", std::filesystem::current_path());
  Chain chain;
  for (PlannedStage& stage : plan.stages)
    chain.stages.push_back(
        {stage.id, std::string(stage.row->name), !stage.input_files.empty(), std::move(stage.results)});
  chain.warnings = std::move(plan.warnings);
  return chain;
}

struct Draft {  // a stage before its place in the order is known
  const JsonNode* node = nullptr;
  std::string id;
  const StageRow* row = nullptr;
  std::size_t index = 0;            // in the recipe
  std::vector<std::size_t> arrows;  // the drafts it reads from
  bool reads_unread = false;        // one of those it reads from is of no known kind
};

class PlanBuilder {
 public:
  PlanBuilder(JsonNode document, const std::string& file, const std::filesystem::path& directory) {
    plan_.file = file;
    plan_.directory = directory;
    plan_.document = std::move(document);
    source_ = {.file = file, .directory = directory, .problems = &problems_, .warnings = &plan_.warnings};
  }

  Plan build() {
    check_document();
    read_top();
    read_stages();
    for (Draft& draft : drafts_) read_arrows(draft);
    order_stages();
    for (const std::size_t i : order_) read_options(i);
    check_pointers();
    drop_consequences();
    throw_problems();
    write_resolved();
    return std::move(plan_);
  }

 private:
  void problem(const JsonNode& node, std::string pointer, std::string what, std::string suggestion = {}) {
    problems_.push_back({node.from_command_line ? "--set" : plan_.file, node.from_command_line ? Position{} : node.at,
                         std::move(pointer), std::move(what), std::move(suggestion)});
  }

  void throw_problems() {
    if (problems_.empty()) return;
    std::stable_sort(problems_.begin(), problems_.end(), [](const Problem& a, const Problem& b) {
      return std::pair(a.at.line, a.at.column) < std::pair(b.at.line, b.at.column);
    });
    throw ConfigError(std::move(problems_));
  }

  // One mistake gives one error. Removed are: of a misspelt key, that the key meant is missing; rules between keys,
  // where a key of the stage is misspelt or a stage it reads from has a mistake (they saw defaults, or nothing).
  void drop_consequences() {
    const auto any = [&](const Draft& draft, const auto& holds) {
      const std::string pointer = pointer_join("/stages", draft.index);
      return std::any_of(problems_.begin(), problems_.end(), [&](const Problem& one) {
        return (one.pointer + '/').starts_with(pointer + '/') && holds(one);
      });
    };
    std::vector<std::string> clouded;  // stages whose rules cannot be judged
    std::vector<bool> wrong(drafts_.size(), false);
    for (const std::size_t i : order_) {
      const Draft& draft = drafts_[i];
      const bool reads_wrong = draft.reads_unread || std::any_of(draft.arrows.begin(), draft.arrows.end(),
                                                                 [&](std::size_t k) { return wrong[k]; });
      wrong[i] = reads_wrong || any(draft, [](const Problem&) { return true; });
      if (reads_wrong || any(draft, [](const Problem& one) { return !one.meant.empty(); }))
        clouded.push_back(pointer_join("/stages", draft.index) + '/');
    }
    std::vector<std::string> meant;
    for (const Problem& one : problems_)
      if (!one.meant.empty()) meant.push_back(one.meant);
    std::erase_if(problems_, [&](const Problem& one) {
      const bool unjudged = std::any_of(clouded.begin(), clouded.end(), [&](const std::string& pointer) {
        return (one.pointer + '/').starts_with(pointer);
      });
      return (one.is_rule && unjudged) || std::find(meant.begin(), meant.end(), one.pointer) != meant.end();
    });
  }

  void check_document() {
    const JsonNode& root = plan_.document;
    if (!root.is_object()) {
      problem(root, "",
              fmt::format("expected a recipe, an object with \"name\" and \"stages\"; got {}", root.described()));
      throw_problems();
    }
    // A recipe from a newer program: say that, rather than a list of unknown keys.
    const JsonNode* format = root.find("format");
    if (format != nullptr && format->is_number() && format->number > recipe_format) {
      problem(*format, "/format",
              fmt::format("this recipe has format {}, this program reads up to {}", format->text, recipe_format),
              "Use a newer shakebed");
      throw_problems();
    }
  }

  void read_top() {
    const JsonNode& root = plan_.document;
    RecipeTop top;
    Fields fields = Fields::decode(root, "", source_);
    describe_top(fields, top);
    Json ignored;
    fields.any("stages", ignored);
    fields.finish();
    check_presets(root, plan_.file, problems_);
    plan_.name = top.name, plan_.description = top.description, plan_.report = top.report, plan_.sweep = top.sweep;
    plan_.preset = top.preset;
    if (!top.name.empty() && !good_id(top.name))
      problem(*root.find("name"), "/name", fmt::format("\"{}\" cannot be the name of a folder", top.name),
              "Use letters, digits, '-', '_' and '.'");
  }

  // Kinds and ids: "from" of others needs them before any option is read.
  void read_stages() {
    const JsonNode& root = plan_.document;
    const JsonNode* list = root.find("stages");
    if (list == nullptr)
      return problem(root, "/stages", "\"stages\" is missing: a recipe needs an array of stages",
                     "Add \"stages\": [{\"stage\": \"simulate\", ...}]");
    if (!list->is_array())
      return problem(*list, "/stages", fmt::format("expected an array of stages, got {}", list->described()));
    if (list->items.empty())
      return problem(*list, "/stages", "there is no stage in it", "Add {\"stage\": \"simulate\", ...}");
    for (std::size_t i = 0; i < list->items.size(); ++i) read_stage(list->items[i], i);
  }

  void read_stage(const JsonNode& item, std::size_t index) {
    const std::string pointer = pointer_join("/stages", index);
    if (problems_.size() >= most_problems) {
      problem(item, pointer,
              fmt::format("the recipe has more than {} mistakes; the rest of it was not checked", most_problems));
      throw_problems();
    }
    if (!item.is_object())
      return problem(item, pointer, fmt::format("expected a stage, an object; got {}", item.described()));
    const JsonNode* id = item.find("id");
    const StageRow* row = read_kind(item, pointer);
    if (row == nullptr) {
      if (id != nullptr && id->is_string()) unread_.insert(id->text);
      return;
    }
    Draft draft{.node = &item, .id = std::string(row->name), .row = row, .index = index, .arrows = {}};
    if (id != nullptr && id->is_string()) {
      draft.id = id->text;
      check_id(*id, pointer);
    }
    const auto same = std::find_if(drafts_.begin(), drafts_.end(), [&](const Draft& d) { return d.id == draft.id; });
    if (same != drafts_.end())
      return problem(
          id != nullptr ? *id : item, id != nullptr ? pointer + "/id" : pointer,
          fmt::format("two stages would write to the folder \"{}\": this one and /stages/{}", draft.id, same->index),
          "Give one of them a different \"id\"");
    drafts_.push_back(std::move(draft));
  }

  const StageRow* read_kind(const JsonNode& item, const std::string& pointer) {
    const JsonNode* kind = item.find("stage");
    const std::vector<std::string> kinds = kinds_of_stages();
    if (kind == nullptr || !kind->is_string()) {
      problem(kind != nullptr ? *kind : item, pointer + "/stage", "\"stage\" must be the kind of the stage",
              fmt::format("Choose from: {}", fmt::join(kinds, ", ")));
      return nullptr;
    }
    const StageRow* row = find_stage(kind->text);
    if (row == nullptr) {
      const std::string nearest = nearest_name(kind->text, kinds);
      unread_.insert({kind->text, nearest});
      problem(*kind, pointer + "/stage", fmt::format("there is no stage \"{}\"", kind->text),
              nearest.empty() ? fmt::format("Choose from: {}", fmt::join(kinds, ", "))
                              : fmt::format("Did you mean \"{}\"?", nearest));
    }
    return row;
  }

  void check_id(const JsonNode& id, const std::string& pointer) {
    const bool reserved =
        std::find(reserved_ids.begin(), reserved_ids.end(), id.text.substr(0, id.text.find('.'))) != reserved_ids.end();
    if (good_id(id.text) && !reserved) return;
    problem(
        id, pointer + "/id",
        reserved
            ? fmt::format("the id \"{}\" is reserved: the program uses this name in the results folder OUT", id.text)
            : fmt::format("\"{}\" cannot be an id, because the id is the name of a folder in the results folder OUT",
                          id.text),
        "Use letters, digits, '-', '_' and '.', not starting with '.' or '-'");
  }

  void read_arrows(Draft& draft) {
    const JsonNode* from = draft.node->find("from");
    const std::string pointer = pointer_join("/stages", draft.index) + "/from";
    const StageRow& row = *draft.row;
    std::vector<std::pair<const JsonNode*, std::string>> names;
    if (from != nullptr && from->is_string()) names.emplace_back(from, pointer);
    if (from != nullptr && from->is_array()) {
      for (std::size_t k = 0; k < from->items.size(); ++k) {
        if (from->items[k].is_string()) names.emplace_back(&from->items[k], pointer_join(pointer, k));
      }
    }
    for (const auto& [node, where] : names) read_arrow(draft, *node, where);
    const auto count = static_cast<int>(names.size());
    if (count < row.fewest_inputs) {
      problem(
          from != nullptr ? *from : *draft.node, pointer,
          fmt::format("{} needs the results of {}{}", row.name, row.fewest_inputs == row.most_inputs ? "" : "at least ",
                      row.fewest_inputs == 1 ? "one stage" : fmt::format("{} stages", row.fewest_inputs)),
          fmt::format("Name a stage of these kinds by its id: {}", fmt::join(row.accepts, ", ")));
    } else if (count > row.most_inputs) {
      problem(*from, pointer,
              row.most_inputs == 0
                  ? fmt::format("{} does not read the results of other stages", row.name)
                  : fmt::format("\"from\" names {} stages, but {} reads at most {}", count, row.name, row.most_inputs));
    }
  }

  void read_arrow(Draft& draft, const JsonNode& node, const std::string& where) {
    const StageRow& row = *draft.row;
    std::vector<std::string> ids;
    for (const Draft& one : drafts_) ids.push_back(one.id);
    const auto found = std::find(ids.begin(), ids.end(), node.text);
    if (found == ids.end()) {
      if (unread_.contains(node.text)) {
        draft.reads_unread = true;
        return;
      }
      const std::string nearest = nearest_name(node.text, ids);
      return problem(node, where, fmt::format("there is no stage with the id \"{}\"", node.text),
                     nearest.empty() ? fmt::format("Choose from: {}", fmt::join(ids, ", "))
                                     : fmt::format("Did you mean \"{}\"?", nearest));
    }
    const auto target = static_cast<std::size_t>(found - ids.begin());
    const std::string_view kind = drafts_[target].row->name;
    if (std::find(draft.arrows.begin(), draft.arrows.end(), target) != draft.arrows.end())
      return problem(node, where, fmt::format("\"from\" names \"{}\" twice", node.text));
    if (std::find(row.accepts.begin(), row.accepts.end(), kind) == row.accepts.end())
      return problem(
          node, where,
          fmt::format("\"{}\" is a stage of kind {}, and {} does not read its results", node.text, kind, row.name),
          row.accepts.empty()
              ? ""
              : fmt::format("It reads the results of these kinds of stages: {}", fmt::join(row.accepts, ", ")));
    draft.arrows.push_back(target);
  }

  // As written, but each after those it reads from.
  void order_stages() {
    std::vector<bool> placed(drafts_.size(), false);
    while (order_.size() < drafts_.size()) {
      const std::size_t before = order_.size();
      for (std::size_t i = 0; i < drafts_.size(); ++i) {
        const std::vector<std::size_t>& needs = drafts_[i].arrows;
        const bool ready =
            !placed[i] && std::all_of(needs.begin(), needs.end(), [&](std::size_t k) { return placed[k]; });
        if (ready) placed[i] = true, order_.push_back(i);
      }
      if (order_.size() == before) return report_circle(placed);
    }
  }

  void report_circle(const std::vector<bool>& placed) {
    std::vector<std::string> circle;
    const Draft* first = nullptr;
    for (std::size_t i = 0; i < drafts_.size(); ++i) {
      if (placed[i]) continue;
      circle.push_back(drafts_[i].id);
      if (first == nullptr) first = &drafts_[i];
    }
    problem(*first->node->find("from"), pointer_join("/stages", first->index) + "/from",
            fmt::format("these stages need one another in a circle, so none of them can run first: {}",
                        fmt::join(circle, ", ")),
            "Remove one of their \"from\"");
  }

  void read_options(std::size_t i) {
    const Draft& draft = drafts_[i];
    PlannedStage planned;
    planned.id = draft.id;
    planned.row = draft.row;
    planned.pointer = pointer_join("/stages", draft.index);
    planned.stage = draft.row->make();
    Fields::Source source = source_;
    source.input_files = &planned.input_files;
    const std::size_t problems_before = problems_.size();
    source.problems_before = problems_before;
    for (const std::size_t k : draft.arrows) {
      planned.from.push_back(position_[k]);
      const PlannedStage& before = plan_.stages[position_[k]];
      source.upstream.emplace_back(before.row->name);
      source.from.push_back({before.id, before.row->name, before.results.get()});
      if (!planned.bed) planned.bed = before.bed;
    }
    if (planned.bed) source.bed = &*planned.bed;
    CommonOptions common;
    common.id = draft.id;
    Fields fields = Fields::decode(*draft.node, planned.pointer, source);
    describe_common(fields, common, *draft.row);
    fields.set_reduced(common.reduced);
    planned.reduced = common.reduced;
    planned.seed = common.seed;
    planned.stage->describe(fields);
    if (problems_.size() == problems_before) planned.stage->check_chains(fields, read_chain);
    fields.finish();
    if (problems_.size() == problems_before) {
      if (auto bed = planned.stage->bed())
        planned.bed = KnownBed{std::move(*bed), fmt::format("stage \"{}\" ({})", planned.id, planned.pointer),
                               planned.stage->keeps_frames()};
    }
    for (auto& [pointer, path] : planned.input_files) pointer.erase(0, planned.pointer.size());
    planned.options = Json::object();
    Fields encoder = Fields::encode(planned.options);
    encoder.set_reduced(common.reduced);
    planned.stage->describe(encoder);
    if (problems_.size() == problems_before) {
      planned.results = std::make_unique<ResultList>(std::move(source.from));
      planned.stage->results(*planned.results);
    }
    position_[i] = plan_.stages.size();
    plan_.stages.push_back(std::move(planned));
  }

  // Pointers of the recipe itself into the results, and into the recipe.
  void check_pointers() {
    if (order_.size() < drafts_.size() || drafts_.empty()) return;  // the stages are not known
    const std::vector<StatedStage> stated = plan_.stated();
    // Where it leads; nullptr if it leads to nothing, which is then said.
    const auto check = [&](const std::string& where, const std::string& pointer) -> const StatedResult* {
      const auto misfit = misfit_of_pointer(stated, pointer, "the recipe");
      if (!misfit) return find_result(stated, pointer);
      problem(*find_pointer(plan_.document, where), where, misfit->what, misfit->suggestion);
      return nullptr;
    };
    if (plan_.sweep) {
      // One string stands for an array of one.
      const JsonNode* list = find_pointer(plan_.document, "/sweep/collect");
      for (std::size_t i = 0; i < plan_.sweep->collect.size(); ++i)
        check(list->is_array() ? pointer_join("/sweep/collect", i) : "/sweep/collect", plan_.sweep->collect[i]);
    }
    const std::vector<PublishedNumber>& published = plan_.report.published;
    for (std::size_t i = 0; i < published.size(); ++i) {
      if (published[i].pointer.empty()) continue;
      const std::string where = pointer_join("/report/published", i);
      if (const StatedResult* ours = check(where + "/number", published[i].pointer))
        check_published_unit(where + "/value", published[i].value, *ours);
    }
    for (std::size_t i = 0; i < plan_.report.assumed.size(); ++i) check_assumed(i);
  }

  // Ours is shown in the unit of the published value, so it must have one of the same kind.
  void check_published_unit(const std::string& where, const std::string& value, const StatedResult& ours) {
    if (ours.kind != ResultKind::quantity && ours.kind != ResultKind::number) return;
    Quantity published;
    try {
      published = parse_quantity(value);
    } catch (const std::invalid_argument&) {
      return;  // this has been said
    }
    try {
      in_unit_of_result(published, ours.unit, "the published value");
    } catch (const std::invalid_argument& misfit) {
      problem(*find_pointer(plan_.document, where), where, misfit.what());
    }
  }

  // An input that had to be assumed is one that the recipe states, or leaves at its default.
  void check_assumed(std::size_t i) {
    const std::string& pointer = plan_.report.assumed[i].pointer;
    if (pointer.empty()) return;
    const std::string where = pointer_join("/report/assumed", i) + "/input";
    const JsonNode& node = *find_pointer(plan_.document, where);
    std::vector<std::string> tokens;
    try {
      tokens = split_pointer(numbered_pointer(plan_.document, pointer));
    } catch (const UsageError&) {}
    const auto stage = std::find_if(plan_.stages.begin(), plan_.stages.end(), [&](const PlannedStage& one) {
      return tokens.size() > 2 && one.pointer == pointer_join("/stages", tokens[1]);
    });
    if (tokens.size() < 3 || tokens[0] != "stages" || stage == plan_.stages.end())
      return problem(node, where, fmt::format("\"{}\" does not lead to a stage of this recipe", pointer),
                     "Write /stages/<id or number>/<key>");
    const Json* at = &stage->options;
    for (std::size_t k = 2; k < tokens.size(); ++k) {
      if (k == 2 && (tokens[k] == "seed" || tokens[k] == "units")) return;
      std::vector<std::string> names;
      if (at->is_object()) {
        for (const auto& [key, ignored] : at->items()) names.push_back(key);
      }
      const Json* next = find_pointer(*at, pointer_join("", tokens[k]));
      if (next == nullptr) {
        const std::string nearest = nearest_name(tokens[k], names);
        return problem(node, where, fmt::format("\"{}\": {} has no option \"{}\"", pointer, stage->id, tokens[k]),
                       nearest.empty() ? fmt::format("Choose from: {}", fmt::join(names, ", "))
                                       : fmt::format("Did you mean \"{}\"?", nearest));
      }
      at = next;
    }
  }

  // resolved.json: the recipe with nothing left out.
  void write_resolved() {
    Json& out = plan_.resolved;
    out["name"] = plan_.name;
    out["format"] = recipe_format;
    if (!plan_.preset.empty()) out["$preset"] = plan_.preset;
    if (!plan_.description.empty()) out["description"] = plan_.description;
    out["stages"] = Json::array();
    for (const PlannedStage& stage : plan_.stages) out["stages"].push_back(resolved_stage(stage));
    if (const JsonNode* report = plan_.document.find("report")) out["report"] = report->to_json();
    if (const JsonNode* sweep = plan_.document.find("sweep")) out["sweep"] = sweep->to_json();
  }

  Json resolved_stage(const PlannedStage& stage) const {
    Json out;
    out["stage"] = stage.row->name;
    out["id"] = stage.id;
    if (!stage.from.empty()) {
      out["from"] = Json::array();
      for (const std::size_t k : stage.from) out["from"].push_back(plan_.stages[k].id);
    }
    if (stage.row->uses_seed) out["seed"] = stage.seed;
    if (stage.reduced) out["units"] = "reduced";
    for (const auto& [key, value] : stage.options.items()) out[key] = value;
    return out;
  }

  Plan plan_;
  std::vector<Problem> problems_;
  Fields::Source source_;
  std::vector<Draft> drafts_;
  std::set<std::string> unread_;                 // ids of stages of no known kind
  std::vector<std::size_t> order_;               // of drafts
  std::map<std::size_t, std::size_t> position_;  // of a draft in Plan::stages
};

}  // namespace

const PlannedStage* Plan::find(std::string_view id) const {
  for (const PlannedStage& stage : stages) {
    if (stage.id == id) return &stage;
  }
  return nullptr;
}

std::vector<StatedStage> Plan::stated() const {
  std::vector<StatedStage> out;
  for (const PlannedStage& stage : stages) out.push_back({stage.id, stage.row->name, stage.results.get()});
  return out;
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

Plan make_plan(JsonNode document, const std::string& file, const std::filesystem::path& directory) {
  return PlanBuilder(std::move(document), file, directory).build();
}

}  // namespace shakebed::pipelines
