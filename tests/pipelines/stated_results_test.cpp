// What each stage states before it runs against what it writes: no number and no column more, none less, the same
// units.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/runner/plan.hpp"
#include "tests/pipelines/infer_recipe.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;
namespace fs = std::filesystem;

// Parts of a quantity that have no statement of their own.
bool is_quantity(const Json& json) { return json.is_object() && json.contains("value"); }

class Comparison {
 public:
  Comparison(const PlannedStage& stage, fs::path folder) : stage_(stage), folder_(std::move(folder)) {}

  void compare() {
    const Json result = read_json(folder_ / stage_.row->result);
    walk(result, "");
    for (const StatedResult& one : stage_.results->all()) {
      const bool needed =
          one.given.possible && one.given.always && one.pointer.find_first_of("#*") == std::string::npos;
      if (needed && !seen_.contains(one.pointer)) fail("states " + one.pointer + ", which is not in its result");
      if (!one.given.possible && seen_.contains(one.pointer))
        fail("gives " + one.pointer + " although its options forbid it: " + one.given.condition);
      if (one.meaning.empty()) fail("says nothing of " + one.pointer);
    }
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_))
      if (entry.path().extension() == ".csv") compare_table(entry.path());
    for (const StatedTable& table : stage_.results->tables()) {
      if (table.given.possible && table.given.always && table.file.find('*') == std::string::npos &&
          !fs::exists(folder_ / table.file))
        fail("states " + table.file + ", which it has not written");
    }
  }

 private:
  void fail(const std::string& what) { ADD_FAILURE() << stage_.row->name << " \"" << stage_.id << "\" " << what; }

  void walk(const Json& json, const std::string& pointer) {
    const StatedResult* stated = pointer.empty() ? nullptr : stage_.results->find(pointer);
    if (json.is_structured() && (stated == nullptr || !is_quantity(json))) {
      std::size_t i = 0;
      for (const auto& [key, value] : json.items())
        walk(value, json.is_array() ? pointer_join(pointer, i++) : pointer_join(pointer, key));
      return;
    }
    if (stated == nullptr) {
      if (json.is_null() && conditional_below(pointer)) return;
      return fail("gives " + pointer + ", which it does not state: " + json.dump());
    }
    seen_.insert(stated->pointer);
    compare_value(*stated, json, pointer);
    if (!is_quantity(json)) return;
    for (const auto& [key, value] : json.items()) {  // what stands beside value, std_error and unit
      const StatedResult* part = stage_.results->find(pointer_join(pointer, key));
      if (part == nullptr)
        fail("gives " + pointer_join(pointer, key) + ", which it does not state");
      else if (part != stated)
        walk(value, pointer_join(pointer, key));
    }
  }

  // An object that is null: what it would hold depends on the data.
  bool conditional_below(const std::string& pointer) const {
    for (const StatedResult& one : stage_.results->all())
      if (one.pointer.starts_with(pointer + "/")) return !one.given.always;
    return false;
  }

  void compare_value(const StatedResult& stated, const Json& json, const std::string& pointer) {
    if (json.is_null()) {
      if (!stated.may_be_null) fail("gives null for " + pointer);
      return;
    }
    if (stated.kind == ResultKind::quantity) {
      if (!is_quantity(json)) return fail("gives no quantity for " + pointer + ": " + json.dump());
      if (json.contains("unit") && json["unit"] != stated.unit)
        fail("gives " + pointer + " in " + json["unit"].dump() + ", it states \"" + stated.unit + "\"");
    } else if (stated.kind == ResultKind::number ? !json.is_number() && !is_quantity(json)
               : stated.kind == ResultKind::text ? !json.is_string()
                                                 : !json.is_boolean()) {
      fail("gives something of another kind for " + pointer + ": " + json.dump());
    }
  }

  void compare_table(const fs::path& path) {
    const StatedTable* table = stage_.results->find_table(path.filename().string());
    if (table == nullptr || !table->given.possible)
      return fail("writes " + path.string() + ", which it does not state");
    std::vector<std::string> header;
    each_csv_line(read_file(path), [&](const std::vector<std::string>& cells, std::size_t) {
      if (header.empty()) header = cells;
    });
    const Json metadata = read_json(metadata_path(path));
    for (std::size_t i = 0; i < header.size(); ++i)
      compare_column(*table, header[i], metadata["tableSchema"]["columns"][i], path.filename().string());
    for (const StatedColumn& column : table->columns) {
      if (std::find(header.begin(), header.end(), column.name) == header.end())
        fail("writes " + path.filename().string() + " without the column " + column.name + ", which it states");
    }
  }

  // The unit beside the table is the one stated, and so is the one at the end of a column's name.
  void compare_column(const StatedTable& table, const std::string& name, const Json& described,
                      const std::string& file) {
    if (misfit_of_column(table, name)) return fail("writes " + file + " with the column " + name + ", unstated");
    for (const StatedColumn& column : table.columns) {
      if (column.name != name) continue;
      const std::string unit = described.value("schema:unitText", "");
      if (unit != column.unit)
        fail("writes " + name + " of " + file + " in \"" + unit + "\", it states \"" + column.unit + "\"");
      if (column.meaning.empty()) fail("says nothing of " + name + " of " + file);
    }
  }

  const PlannedStage& stage_;
  fs::path folder_;
  std::set<std::string> seen_;
};

// Runs a recipe and compares every stage.
void compare(const std::string& text) {
  ScratchFolder folder;
  write_text(folder / "r.json", text);
  const ProgramResult result = run_shakebed({"run", "r.json", "--out", "o", "--quiet"}, folder.path());
  ASSERT_TRUE(result.exit_code == 0 || result.exit_code == 6) << result.err;
  std::vector<Problem> problems;
  const Plan plan = make_plan(*parse_json(text, "r.json", problems), "r.json", folder.path());
  for (const PlannedStage& stage : plan.stages) Comparison(stage, folder / "o" / stage.id).compare();
}

std::string shipped(const std::string& name) { return read_text(fs::path(SHAKEBED_RECIPES) / name); }

// The recipe with its quick preset written into it.
std::string quick(const std::string& text) {
  std::vector<Problem> problems;
  JsonNode document = *parse_json(text, "r.json", problems);
  apply_preset(document, "r.json", "quick");
  return dump(document.to_json());
}

// `shakebed reference`: a page for every stage, with every option of the schema and every number and column stated.
TEST(Reference, HasAPageForEveryStage) {
  ScratchFolder folder;
  const std::string index = run_shakebed({"reference"}, folder.path()).out;
  for (const StageRow& row : stage_table()) {
    EXPECT_NE(index.find("| `" + std::string(row.name) + "` |"), std::string::npos) << row.name;
    const ProgramResult page = run_shakebed({"reference", std::string(row.name)}, folder.path());
    ASSERT_EQ(page.exit_code, 0) << row.name << page.err;
    Json schema;
    Fields fields = Fields::schema(schema);
    row.make()->describe(fields);
    for (const auto& [option, unused] : schema["properties"].items())
      EXPECT_NE(page.out.find("| `" + option + "` |"), std::string::npos) << row.name << " " << option;
    ResultList results;
    row.make()->results(results);
    for (const StatedResult& one : results.all())
      EXPECT_NE(page.out.find("| `" + one.pointer + "` |"), std::string::npos) << row.name << one.pointer;
    for (const StatedTable& table : results.tables())
      for (const StatedColumn& column : table.columns)
        EXPECT_NE(page.out.find("| `" + column.name + "` |", page.out.find("### " + table.file)), std::string::npos)
            << row.name << " " << table.file << " " << column.name;
  }
  const ProgramResult mistyped = run_shakebed({"reference", "simulte"}, folder.path());
  EXPECT_EQ(mistyped.exit_code, 2);
  EXPECT_NE(mistyped.err.find("did you mean \"simulate\"?"), std::string::npos) << mistyped.err;
}

// A smaller bed, and fewer and smaller pictures of it: stated is what is written, not how much of it.
TEST(StatedResults, OfTheStarterRecipe) {
  Json starter = Json::parse(quick(shipped("starter.json")));
  Json &bed = starter["stages"][0], &render = starter["stages"][1];
  bed["disks"]["count"] = 120, bed["box"]["width"] = "30.9 mm";
  bed["frames"] = Json{{"count", 8}, {"phases", 8}};
  render["scale"] = "0.3 mm/px";
  compare(starter.dump());
}

TEST(StatedResults, OfABedWithEverythingObserved) {
  compare(R"({ "name": "r", "stages": [
    { "stage": "simulate", "id": "bed", "disks": { "count": 60, "diameter": "3 mm", "restitution": 0.8 },
      "box": { "width": "18.9 mm", "sides": { "kind": "hard", "restitution": 0.8 } },
      "floor": { "motion": "sinusoidal", "gamma": 3, "frequency": "20 Hz", "restitution": 0.8 },
      "settle": "0.5 s", "measure": "1 s", "replicas": 2, "frames": { "count": 16, "phases": 8 },
      "observe": ["order", "velocities", "displacement", "pressure", "phases"] },
    { "stage": "fit", "from": "bed", "bootstrap": 8 },
    { "stage": "map", "from": ["bed", "fit"] },
    { "stage": "figure", "from": ["bed", "fit"] },
    { "stage": "chart", "from": ["bed"],
      "charts": [ { "name": "layers", "caption": "layers", "x_label": "z/D", "y_label": "T", "points": [
        { "name": "all", "file": "velocities.csv", "x": "height", "y": "temperature_x", "line_fit": true,
          "power_fit": true, "against": "zero", "levels": [0.1] } ],
        "curves": [ { "name": "zero", "polynomial": [0] } ] } ],
      "snapshots": [ { "name": "last", "from": "bed" } ] },
    { "stage": "claims", "from": ["bed"],
      "claims": [ { "claim": "the bed rises", "number": "/bed/center_of_mass_rise", "least": 0 } ] },
    { "stage": "check", "from": ["bed", "claims"],
      "expect": { "/bed/gamma": { "value": 3, "relative": 1e-9, "note": "as written" },
                  "/claims/claims/0/verdict": { "value": "holds" } } } ] })");
}

TEST(StatedResults, OfAFilm) {
  compare(R"({ "name": "r", "stages": [
    { "stage": "simulate", "id": "bed", "disks": { "count": 60, "diameter": "3 mm", "restitution": 0.8 },
      "box": { "width": "18.9 mm", "sides": { "kind": "hard", "restitution": 0.8 } },
      "floor": { "motion": "sinusoidal", "gamma": 3, "frequency": "20 Hz", "restitution": 0.8 },
      "settle": "0.5 s", "measure": "0.1 s", "frames": { "count": 64, "phases": 32 } },
    { "stage": "render", "from": "bed", "scale": "0.3 mm/px" },
    { "stage": "extract", "from": "render", "diameter": "3 mm", "frame_rate": "640 Hz", "frequency": "20 Hz",
      "bead_number": 60, "kernel": { "kind": "top_hat", "width": 1 } },
    { "stage": "figure", "from": ["bed", "extract"], "reference": "clement-rajchenbach-1991" } ] })");
}

TEST(StatedResults, OfReducedUnitsAndOfAFluidWithoutGravity) {
  compare(R"({ "name": "r", "stages": [
    { "stage": "simulate", "id": "bed", "units": "reduced", "disks": { "count": 60, "restitution": 0.99 },
      "box": { "width": 10.3, "sides": "periodic" }, "floor": { "motion": "still" },
      "bath": { "kind": "langevin", "temperature": 2, "rate": 0.1, "interval": 0.1 },
      "schedule": [ { "temperature": 3, "hold": 2 }, { "temperature": 2, "ramp": 2, "hold": 2 } ],
      "settle": 20, "measure": 50, "observe": ["order"] },
    { "stage": "simulate", "id": "fluid", "units": "reduced", "disks": { "count": 50 }, "gravity": 0,
      "box": { "width": 12, "sides": "periodic", "lid": { "kind": "periodic", "height": 12 } },
      "settle": 5, "measure": 20 },
    { "stage": "fit", "from": "bed" } ] })");
}

TEST(StatedResults, OfAStudyAndWhatIsMadeOfIt) {
  compare(R"({ "name": "r", "stages": [
    { "stage": "study", "id": "beds", "replicas": 2,
      "parameter": { "name": "bath_T", "values": [0.5, 2], "set": ["/stages/bed/bath/temperature"] },
      "series": { "a": { "set": { "/stages/bed/disks/restitution": 1 } } },
      "stages": [
        { "stage": "simulate", "id": "bed", "units": "reduced", "disks": { "count": 60, "restitution": 1 },
          "box": { "width": 10.3, "sides": "periodic" }, "floor": { "motion": "still" },
          "bath": { "kind": "langevin", "temperature": 1, "rate": 0.1, "interval": 0.1 },
          "settle": 5, "measure": 20, "observe": ["order", "velocities"] } ],
      "collect": { "T": { "at": "/bed/temperature_x" }, "bottom_density": { "at": "/bed/bottom_density" },
                   "psi6": { "at": "/bed/psi6_local" }, "twice": { "at": "/bed/temperature_z", "times": 2 } },
      "tables": { "velocities": { "at": "/bed/velocities.csv", "key": "height" } } },
    { "stage": "critical", "from": "beds", "unit": "m g D", "densities": [0.5, 1], "orders": [0.8] },
    { "stage": "chart", "from": "beds", "charts": [
      { "name": "T", "x_label": "bath", "y_label": "T", "points": [
        { "name": "a", "x": "bath_T", "y": "T", "where": { "series": "a" } } ] } ] } ] })");
}

TEST(StatedResults, OfASearch) { compare(brief_infer_recipe()); }

}  // namespace
