// Mistakes in recipes: their places and messages; sweeps as they are read; options of every kind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "pipelines/formats/config.hpp"
#include "pipelines/runner/plan.hpp"
#include "pipelines/runner/plan_graph.hpp"
#include "pipelines/runner/sweep_points.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::ElementsAre;
using testing::HasSubstr;

std::vector<Problem> mistakes_of(const std::string& recipe) {
  std::vector<Problem> problems;
  const ScratchFolder folder;
  try {
    make_plan(*parse_json(recipe, "r.json", problems), "r.json", folder.path());
  } catch (const ConfigError& error) {
    problems = error.problems();
  }
  return problems;
}
// "pointer: what. suggestion", one after another.
std::string told(const std::string& recipe) {
  std::string all;
  for (const Problem& one : mistakes_of(recipe))
    all += (all.empty() ? "" : " | ") + one.pointer + ": " + one.what +
           (one.suggestion.empty() ? "" : ". " + one.suggestion);
  return all;
}

const std::string map_keys = R"("gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10)";
std::string map_stage(const std::string& more = "") { return R"({ "stage": "map", )" + map_keys + more + " }"; }
std::string with(const std::string& stages, const std::string& top = "") {
  return R"({ "name": "t", )" + top + R"("stages": [)" + stages + "] }";
}

TEST(RecipeMistakes, OfTheWholeAreNamed) {
  EXPECT_EQ(told("[1]"), ": expected a recipe, an object with \"name\" and \"stages\"; got an array");
  EXPECT_EQ(told(with(map_stage(), "\"format\": 2, \"no\": 1, ")),
            "/format: this recipe has format 2, this program reads up to 1. Use a newer shakebed");
  EXPECT_EQ(told(with(map_stage(), "\"format\": 1, ")), "");
  EXPECT_EQ(told(R"({ "name": "t" })"),
            "/stages: \"stages\" is missing: a recipe needs an array of stages. Add \"stages\": [{\"stage\": "
            "\"simulate\", ...}]");
  EXPECT_THAT(told(R"({ "name": "t", "stages": 3 })"),
              HasSubstr("/stages: expected an array of stages, got the number 3"));
  EXPECT_EQ(told(with("")), "/stages: there is no stage in it. Add {\"stage\": \"simulate\", ...}");
  EXPECT_THAT(told(with("7")), HasSubstr("/stages/0: expected a stage, an object; got the number 7"));
  EXPECT_EQ(told(R"({ "name": "a b", "stages": [)" + map_stage() + "] }"),
            "/name: \"a b\" cannot be the name of a folder. Use letters, digits, '-', '_' and '.'");
}

TEST(RecipeMistakes, InAListAreInTheLineOfTheirElement) {
  const std::vector<Problem> problems =
      mistakes_of(with("{ \"stage\": \"extract\", \"images\": \"a.png\",\n"
                       "\"diameter\": \"3 mm\",\n\"roi\": [0,\n0,\n\"x\",\n40] }"));
  ASSERT_FALSE(problems.empty());
  EXPECT_EQ(problems.back().pointer, "/stages/0/roi/2");
  EXPECT_EQ(problems.back().at.line, 5);
  const std::vector<Problem> in_sweep = mistakes_of(with(map_stage(),
                                                         "\"sweep\": { \"kind\": \"list\", \"points\": [\n"
                                                         "{ \"/stages/map/gamma\": 1 },\n{ \"gamma\": 2 } ] }, "));
  ASSERT_FALSE(in_sweep.empty());
  EXPECT_EQ(in_sweep[0].pointer, "/sweep/points/1/gamma");
  EXPECT_EQ(in_sweep[0].at.line, 3);
}

// A file that is no recipe has a problem in every line: after 1000 the rest is left alone.
TEST(RecipeMistakes, AreThousandAtMost) {
  const auto count = [](std::size_t stages) {
    std::string all = "7";
    for (std::size_t i = 1; i < stages; ++i) all += ",7";
    return mistakes_of(with(all));
  };
  EXPECT_EQ(count(1000).size(), 1000U);
  const std::vector<Problem> more = count(1002);
  ASSERT_EQ(more.size(), 1001U);
  EXPECT_EQ(more.back().pointer, "/stages/1000");
  EXPECT_EQ(more.back().what, "the recipe has more than 1000 mistakes; the rest of it was not checked");
}

TEST(RecipeMistakes, OfIdsAreNamed) {
  const auto with_id = [](const std::string& id) { return told(with(map_stage(", \"id\": \"" + id + "\""))); };
  const std::string no_id =
      " cannot be an id, because the id is the name of a folder in the results folder OUT. Use letters, "
      "digits, '-', '_' and '.', not starting with '.' or '-'";
  EXPECT_EQ(with_id("a.B-c_9"), "");
  EXPECT_EQ(with_id(std::string(64, 'a')), "");
  EXPECT_EQ(with_id(std::string(65, 'a')), "/stages/0/id: \"" + std::string(65, 'a') + "\"" + no_id);
  for (const std::string id : {"", ".a", "-a", "a b", "a/b", "ä"})
    EXPECT_EQ(with_id(id), "/stages/0/id: \"" + id + "\"" + no_id);
  for (const std::string id : {"manifest", "summary.2", "points", "sweep", "cost"})
    EXPECT_THAT(with_id(id),
                HasSubstr("/stages/0/id: the id \"" + id + "\" is reserved: the program uses this name in the"));
  EXPECT_EQ(with_id("my.summary"), "");
  EXPECT_EQ(told(with(map_stage(", \"id\": \"a\"") + "," + map_stage() + "," + map_stage(", \"id\": \"a\""))),
            "/stages/2/id: two stages would write to the folder \"a\": this one and /stages/0. Give one of them a "
            "different \"id\"");
  EXPECT_EQ(told(with(map_stage() + "," + map_stage())),
            "/stages/1: two stages would write to the folder \"map\": this one and /stages/0. Give one of them a "
            "different \"id\"");
}

TEST(RecipeMistakes, OfKindsAndArrowsAreNamed) {
  EXPECT_THAT(told(with(R"({ "id": "x" })")),
              HasSubstr("/stages/0/stage: \"stage\" must be the kind of the stage. Choose from: "));
  EXPECT_EQ(told(with(R"({ "stage": "mapp" })")), "/stages/0/stage: there is no stage \"mapp\". Did you mean \"map\"?");
  EXPECT_THAT(told(with(R"({ "stage": "qqqqqqq" })")),
              HasSubstr("/stages/0/stage: there is no stage \"qqqqqqq\". Choose from: simulate, "));
  const auto of_critical = [&](const std::string& from) {
    return told(with(map_stage(", \"id\": \"m\"") + R"(, { "stage": "critical", "id": "c", "temperature": "T")" +
                     (from.empty() ? "" : ", \"from\": " + from) + " }"));
  };
  EXPECT_EQ(of_critical("\"nobody\""), "/stages/1/from: there is no stage with the id \"nobody\". Choose from: m, c");
  EXPECT_EQ(of_critical("[\"mm\"]"), "/stages/1/from/0: there is no stage with the id \"mm\". Did you mean \"m\"?");
  EXPECT_THAT(of_critical("\"m\""),
              HasSubstr("/stages/1/from: \"m\" is a stage of kind map, and critical does not read its results. "
                        "It reads the results of these kinds of stages: study"));
  EXPECT_THAT(
      of_critical(""),
      HasSubstr(
          "/stages/1/from: critical needs the results of one stage. Name a stage of these kinds by its id: study"));
  EXPECT_EQ(told(with(map_stage(", \"id\": \"m\"") +
                      R"(, { "stage": "check", "from": ["m", "m"], "expect": { "/m/gamma": { "least": 1 } } })")),
            "/stages/1/from/1: \"from\" names \"m\" twice");
  EXPECT_THAT(told(with(map_stage(", \"id\": \"m\"") + R"(, { "stage": "study", "from": "m" })")),
              HasSubstr("/stages/1/from: study does not read the results of other stages"));
  EXPECT_THAT(told(with(R"({ "stage": "figure", "id": "g" })")),
              HasSubstr("/stages/0/from: figure needs the results of at least one stage"));
  // A stage of a misspelt kind is not missed by those that read it.
  EXPECT_EQ(told(with(R"({ "stage": "fitt", "id": "f" }, { "stage": "figure", "from": "f" })")),
            "/stages/0/stage: there is no stage \"fitt\". Did you mean \"fit\"?");
  // Simulations that go on from one another.
  const std::string simulation =
      R"({ "stage": "simulate", "disks": { "count": 9, "diameter": "3 mm" }, "settle": "1 s", "measure": "1 s")";
  const std::string in_a_circle = told(with(map_stage() + "," + simulation + R"(, "id": "a", "from": "b" }, )" +
                                            simulation + R"(, "id": "b", "from": "a" })"));
  EXPECT_THAT(in_a_circle,
              HasSubstr("/stages/1/from: these stages need one another in a circle, so none of them can run first: a, "
                        "b. Remove one of their \"from\""));
}

// A misspelt key gives one error, not also that the key meant is missing.
TEST(RecipeMistakes, OneGivesOneError) {
  EXPECT_EQ(
      told(with(R"({ "stage": "map", "gama": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 })")),
      "/stages/0/gama: unknown key \"gama\". Did you mean \"gamma\"?");
  // What other stages give is known none the less.
  const std::string study =
      R"({ "stage": "study", "parameter": { "name": "g", "values": [4], "set": ["/stages/map/gamma"] },
           "series": { "slow": { "set": { "/stages/map/frequency": "10 Hz" } }, "fast": {} },
           "stages": [)" +
      map_stage() + R"(], "collect": { "T": { "at": "/map/critical_temperature" } } },
         { "stage": "claims", "from": "study",
           "claims": [{ "claim": "c", "value": 1, "number": "/study/series/slow/0/T" }] })";
  EXPECT_EQ(told(with(study)), "");
  EXPECT_EQ(told(with(map_stage(R"(, "id": "other", "gama": 4)") + "," + study)),
            "/stages/0/gama: unknown key \"gama\". Did you mean \"gamma\"?");
  const std::string two =
      told(with(R"({ "stage": "map", "gamma": -4, "frequency": "20 mm", "diameter": "3 mm", "initial_height": 10 })"));
  EXPECT_THAT(two, HasSubstr("/stages/0/gamma: must be "));
  EXPECT_THAT(
      two,
      HasSubstr(" | /stages/0/frequency: \"20 mm\" is a length: expected a frequency, a string with a unit such as "
                "\"20 Hz\" or a number in Hz"));
}

// --- pointers of the recipe into itself

TEST(RecipeMistakes, OfPointersAreNamed) {
  const auto assumed = [&](const std::string& pointer) {
    return told(with(map_stage(), R"("report": { "assumed": [ { "input": ")" + pointer + R"(", "why": "w" } ] }, )"));
  };
  EXPECT_EQ(assumed("/stages/map/gamma"), "");
  EXPECT_EQ(assumed("/stages/0/restitution"), "");
  EXPECT_EQ(assumed("/stages/map/seed"), "");
  EXPECT_EQ(assumed("/stages/map/gama"),
            "/report/assumed/0/input: \"/stages/map/gama\": map has no option \"gama\". Did you mean \"gamma\"?");
  for (const char* none : {"/map/gamma", "/stages/map", "/stages/fit/gamma", "stages/map/gamma"})
    EXPECT_EQ(assumed(none), std::string("/report/assumed/0/input: \"") + none +
                                 "\" does not lead to a stage of this recipe. Write /stages/<id or number>/<key>");
  const auto published = [&](const std::string& pointer, const std::string& value = "1") {
    return told(with(map_stage(), R"("report": { "published": [ { "number": ")" + pointer +
                                      R"(", "label": "l", "value": ")" + value + R"(" } ] }, )"));
  };
  EXPECT_EQ(published("/map/gamma"), "");
  EXPECT_THAT(published("/mapp/gamma"), HasSubstr("/report/published/0/number: "));
  EXPECT_THAT(published("/map/gamma", "x"), HasSubstr("/report/published/0/value: \"x\" does not begin with a number"));
  EXPECT_EQ(published("/map/critical_temperature", "0.36 mm"),
            "/report/published/0/value: the result is in \"m g D\", so the published value must be a plain number");
  EXPECT_EQ(published("/map/critical_temperature", "0.1"), "");
  EXPECT_EQ(published("/map/diameter", "3 Hz"),
            "/report/published/0/value: the result is in \"m\", but the published value is a frequency");
  EXPECT_EQ(published("/map/diameter", "0.3 cm"), "");
  EXPECT_EQ(published("/map/gamma", "4 mm"),
            "/report/published/0/value: the result is in \"1\", but the published value is a length");
  const auto collect = [&](const std::string& list) {
    return told(with(map_stage(), R"("sweep": { "over": { "/stages/map/gamma": [1] }, "collect": )" + list + " }, "));
  };
  EXPECT_EQ(collect("[\"/map/gamma\"]"), "");
  EXPECT_THAT(collect("[\"/map/gamma\", \"/map/gama\"]"), HasSubstr("/sweep/collect/1: "));
  EXPECT_THAT(collect("\"/map/gama\""), HasSubstr("/sweep/collect: "));
}

// --- sweeps

SweepOptions sweep_of(const std::string& sweep) {
  std::vector<Problem> problems;
  const ScratchFolder folder;
  return *make_plan(*parse_json(with(map_stage(), "\"sweep\": " + sweep + ", "), "r.json", problems), "r.json",
                    folder.path())
              .sweep;
}
std::string told_of_sweep(const std::string& sweep) { return told(with(map_stage(), "\"sweep\": " + sweep + ", ")); }

TEST(SweepValues, AreThoseOfTheirRange) {
  const SweepOptions sweep = sweep_of(R"({ "kind": "grid", "over": { "$comment": "c",
      "/stages/map/gamma": { "from": 1, "to": 2.2, "count": 4 },
      "/stages/map/diameter": { "from": "1 mm", "to": "8 mm", "count": 4, "scale": "logarithmic", "$comment": "c" },
      "/stages/map/frequency": { "from": "20 Hz", "to": "9 Hz", "count": 1 },
      "/stages/map/initial_height": [10, "x", true] } })");
  ASSERT_EQ(sweep.axes.size(), 4U);
  EXPECT_EQ(sweep.axes[0].pointer, "/stages/map/gamma");
  EXPECT_EQ(Json(sweep.axes[0].values), Json::parse("[1.0, 1.4, 1.8, 2.2]"));
  EXPECT_EQ(Json(sweep.axes[1].values), Json::parse(R"(["0.001 m", "0.002 m", "0.004 m", "0.008 m"])"));
  EXPECT_EQ(Json(sweep.axes[2].values), Json::parse(R"(["20 Hz"])"));
  EXPECT_EQ(Json(sweep.axes[3].values), Json::parse(R"([10, "x", true])"));
  EXPECT_EQ(sweep.axes[0].places.size(), 4U);
  EXPECT_EQ(sweep.axes[0].places[3].pointer, "/sweep/over/~1stages~1map~1gamma");
  EXPECT_EQ(sweep.axes[3].places[2].pointer, "/sweep/over/~1stages~1map~1initial_height/2");
  EXPECT_EQ(sweep.axes[3].places[0].at.line, 5);
}

TEST(SweepValues, OfAListAreReadSideBySide) {
  const SweepOptions sweep = sweep_of(R"({ "kind": "list", "points": [ { "/stages/map/gamma": 1 },
      { "$comment": "c", "/stages/map/diameter": "1 mm", "/stages/map/gamma": 2 }, { "/stages/map/diameter": "2 mm" } ] })");
  ASSERT_EQ(sweep.axes.size(), 2U);
  EXPECT_EQ(Json(sweep.axes[0].values), Json::parse("[1, 2, null]"));
  EXPECT_EQ(Json(sweep.axes[1].values), Json::parse(R"([null, "1 mm", "2 mm"])"));
  EXPECT_EQ(sweep.axes[1].places[1].pointer, "/sweep/points/1/~1stages~1map~1diameter");
}

TEST(SweepMistakes, AreNamedAtTheirPlaces) {
  const std::string at = "/sweep/over/~1stages~1map~1gamma";
  const auto range = [](const std::string& keys) {
    return told_of_sweep(R"({ "over": { "/stages/map/gamma": )" + keys + " } }");
  };
  EXPECT_EQ(range("[]"), at + ": the list of values is empty");
  EXPECT_EQ(range("3"), at + ": expected an array of values or a range {\"from\", \"to\", \"count\"}");
  EXPECT_EQ(range(R"({ "from": 1, "count": 2 })"), at + ": a range needs \"from\" and \"to\"");
  EXPECT_EQ(range(R"({ "from": true, "to": 2, "count": 2 })"), at + "/from: expected a number or a quantity");
  EXPECT_EQ(range(R"({ "from": 1, "to": "two", "count": 2 })"), at + "/to: \"two\" does not begin with a number");
  EXPECT_EQ(range(R"({ "from": 1, "to": "2 mm", "count": 2 })"), at + ": \"from\" and \"to\" have different units");
  EXPECT_EQ(range(R"({ "from": "1 s", "to": "2 mm", "count": 2 })"), at + ": \"from\" and \"to\" have different units");
  for (const char* count : {"0", "1.5", "10000001", "\"2\""})
    EXPECT_EQ(range(R"({ "from": 1, "to": 2, "count": )" + std::string(count) + " }"),
              at + "/count: a range needs \"count\", a whole number from 1 to 10,000,000");
  EXPECT_EQ(range(R"({ "from": 1, "to": 2, "count": 2, "scale": "log" })"),
            at + "/scale: expected \"linear\" or \"logarithmic\"");
  EXPECT_EQ(range(R"({ "from": 1, "to": 2, "count": 2, "scale": "linear" })"), "");
  EXPECT_EQ(range(R"({ "from": 0, "to": 2, "count": 2, "scale": "logarithmic" })"),
            at + ": both ends of a logarithmic range must be above 0, got 0 and 2");
  EXPECT_EQ(range(R"({ "from": 1, "to": 2, "count": 2, "step": 1 })"),
            at + "/step: unknown key \"step\". Choose from: from, to, count, scale");
  const std::string no_pointer =
      " is not a pointer to an option of a stage. Write /stages/<id or number>/<key>, for example "
      "\"/stages/bed/floor/gamma\"";
  EXPECT_EQ(told_of_sweep(R"({ "over": { "/stages/map": [1] } })"),
            "/sweep/over/~1stages~1map: \"/stages/map\"" + no_pointer);
  EXPECT_EQ(told_of_sweep(R"({ "over": { "gamma": [1] } })"), "/sweep/over/gamma: \"gamma\"" + no_pointer);
  EXPECT_EQ(told_of_sweep(R"({ "over": { "/report/map/x": [1] } })"),
            "/sweep/over/~1report~1map~1x: \"/report/map/x\"" + no_pointer);
  EXPECT_EQ(told_of_sweep("{}"), "/sweep/over: a sweep needs at least one pointer in \"over\"");
  EXPECT_EQ(told_of_sweep(R"({ "over": {} })"), "/sweep/over: a sweep needs at least one pointer in \"over\"");
  EXPECT_THAT(told_of_sweep(R"({ "over": 3 })"), HasSubstr("/sweep/over: expected an object: JSON pointer → values"));
  EXPECT_EQ(told_of_sweep(R"({ "over": { "/stages/map/gamma": [1] }, "points": [] })"),
            "/sweep/points: only a list sweep accepts \"points\". Write \"kind\": \"list\"");
  EXPECT_EQ(
      told_of_sweep(R"({ "kind": "zip", "over": { "/stages/map/gamma": [1, 2], "/stages/map/diameter": ["1 mm"] } })"),
      "/sweep/over/~1stages~1map~1diameter: this list has 1 values, but /stages/map/gamma has 2: in a zip sweep all "
      "lists "
      "must be of the same length");
  EXPECT_EQ(told_of_sweep(R"({ "kind": "random", "over": { "/stages/map/gamma": { "from": 1, "to": 2 } } })"),
            "/sweep/count: a random sweep needs \"count\", the number of points");
  for (const char* points : {"", R"(, "points": [])", R"(, "points": 3)"})
    EXPECT_EQ(told_of_sweep(R"({ "kind": "list" )" + std::string(points) + " }"),
              "/sweep/points: a list sweep needs \"points\": [{pointer: value, ...}, ...]");
  EXPECT_EQ(
      told_of_sweep(R"({ "kind": "list", "points": [3, {}] })"),
      "/sweep/points/0: expected an object: pointer → value | /sweep/points/1: expected an object: pointer → value");
  EXPECT_EQ(
      told_of_sweep(
          R"({ "kind": "list", "over": { "/stages/map/gamma": [1] }, "points": [ { "/stages/map/gamma": 1 } ] })"),
      "/sweep/over: a list sweep uses \"points\" and does not accept \"over\"");
}

Plan plan_of(const std::string& recipe) {
  std::vector<Problem> problems;
  const ScratchFolder folder;
  return make_plan(*parse_json(recipe, "r.json", problems), "r.json", folder.path());
}

// The last axis runs fastest; replicas stand side by side.
TEST(SweepPoints, AreInOrder) {
  const Plan grid = plan_of(
      with(map_stage(), R"("sweep": { "over": { "/stages/map/gamma": [1, 2], "/stages/map/initial_height": [7, 8, 9] },
      "replicas": 2 }, )"));
  const std::vector<SweepPoint> points = sweep_points(grid);
  ASSERT_EQ(points.size(), 12U);
  EXPECT_EQ(points[7].name, "000007");
  EXPECT_EQ(points[7].index, 7U);
  EXPECT_EQ(points[7].replica, 1U);
  EXPECT_EQ(Json(points[7].values), Json::parse("[2, 7]"));
  EXPECT_THAT(points[7].places, ElementsAre(1, 0));
  EXPECT_EQ(Json(points[4].values), Json::parse("[1, 9]"));
  EXPECT_THAT(points[4].places, ElementsAre(0, 2));
  const Plan zip = plan_of(with(
      map_stage(),
      R"("sweep": { "kind": "zip", "over": { "/stages/map/gamma": [1, 2], "/stages/map/initial_height": [7, 8] } }, )"));
  ASSERT_EQ(sweep_points(zip).size(), 2U);
  EXPECT_EQ(Json(sweep_points(zip)[1].values), Json::parse("[2, 8]"));
  // The plan of a point: its values in the recipe, without sweep and report.
  const Plan at = plan_at(grid, points[7]);
  EXPECT_EQ(at.stages[0].options["gamma"], 2);
  EXPECT_EQ(at.stages[0].options["initial_height"], 7);
  EXPECT_FALSE(at.sweep);
}

TEST(SweepPoints, AreTenMillionAtMost) {
  const auto of = [](const std::string& replicas) {
    return plan_of(
        with(map_stage(),
             R"("sweep": { "kind": "random", "over": { "/stages/map/gamma": [1] }, "count": 100001, "replicas": )" +
                 replicas + "}, "));
  };
  try {
    sweep_points(of("100"));
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.problems().front().what,
              "the sweep has 1e+07 points, but at most 10,000,000 are possible; give fewer values or replicas");
    EXPECT_EQ(error.problems().front().pointer, "/sweep");
  }
  EXPECT_EQ(sweep_points(of("2")).size(), 200'002U);
}

// Uniform in the range or its logarithm, the axes independent of one another: means within five standard errors.
TEST(SweepPoints, OfARandomSweepAreUniform) {
  const Plan plan = plan_of(with(map_stage(), R"("sweep": { "kind": "random", "count": 4000, "seed": 5, "over": {
      "/stages/map/gamma": { "from": 2, "to": 6 }, "/stages/map/diameter": { "from": "1 mm", "to": "100 mm", "scale": "logarithmic" },
      "/stages/map/initial_height": [1, 2, 4] } }, )"));
  const std::vector<SweepPoint> points = sweep_points(plan);
  ASSERT_EQ(points.size(), 4000U);
  double gamma = 0, square = 0, decades = 0, product = 0;
  std::map<double, int> heights;
  std::set<double> different;
  for (const SweepPoint& point : points) {
    const double a = point.values[0].get<double>(),
                 length = parse_quantity(point.values[1].get<std::string>(), dimension::length);
    EXPECT_TRUE(a >= 2 && a < 6 && length >= 0.001 && length < 0.1);
    const double u = (a - 2) / 4, v = std::log10(length / 0.001) / 2;
    gamma += u / 4000, square += u * u / 4000, decades += v / 4000, product += (u - 0.5) * (v - 0.5) / 4000;
    ++heights[point.values[2].get<double>()];
    different.insert(a);
  }
  EXPECT_EQ(different.size(), 4000U);
  EXPECT_NEAR(gamma, 0.5, 5 * std::sqrt(1.0 / 12 / 4000));
  EXPECT_NEAR(square, 1.0 / 3, 5 * std::sqrt(4.0 / 45 / 4000));
  EXPECT_NEAR(decades, 0.5, 5 * std::sqrt(1.0 / 12 / 4000));
  EXPECT_NEAR(product, 0, 5 * std::sqrt(1.0 / 144 / 4000));
  EXPECT_EQ(heights.size(), 3U);
  for (const auto& [height, count] : heights) EXPECT_NEAR(count, 4000 / 3.0, 5 * std::sqrt(4000 * 2.0 / 9)) << height;
  EXPECT_EQ(Json(sweep_points(plan)[17].values), Json(points[17].values)) << "the same everywhere";
}

// A mistake in the value of a point is shown at the place of the value, once, with the point that has it first.
TEST(SweepPoints, HaveTheirMistakesAtTheirValues) {
  try {
    check_points(plan_of(
        with(map_stage(),
             R"("sweep": { "over": { "/stages/map/gamma": [1, -2, -2], "/stages/map/initial_height": [7, 8] } }, )")));
    FAIL();
  } catch (const ConfigError& error) {
    ASSERT_EQ(error.problems().size(), 2U);
    EXPECT_EQ(error.problems()[0].pointer, "/sweep/over/~1stages~1map~1gamma/1");
    EXPECT_EQ(error.problems()[0].what, "must be above 0, got -2 (the preset or sweep sets /stages/0/gamma)");
    EXPECT_EQ(error.problems()[1].pointer, "/sweep/over/~1stages~1map~1gamma/2");
  }
  try {
    check_points(plan_of(with(map_stage(), R"("sweep": { "over": { "/stages/nobody/gamma": [1] } }, )")));
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.problems()[0].pointer, "/sweep/over/~1stages~1nobody~1gamma/0");
  }
}

// A warning is said once, with the first point that has it and how many have: replicas are one. Of mistakes 20 are
// shown.
TEST(SweepPoints, CountTheirWarningsAndMistakes) {
  const std::vector<Warning> warnings = check_points(plan_of(with(
      R"({ "stage": "simulate", "id": "bed", "units": "reduced", "disks": { "count": 40 }, "box": { "width": 10.3 },
           "settle": 40, "measure": 40, "floor": { "motion": "sinusoidal", "gamma": 4, "frequency": 0.5 } })",
      R"("sweep": { "over": { "/stages/bed/floor/gamma": [4, 0.5, 0.6, 60], "/stages/bed/seed": [1, 2] }, "replicas": 2 }, )")));
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_THAT(
      warnings[0].problem.what,
      testing::EndsWith(" (point 000004 of the sweep: /stages/bed/floor/gamma = 0.5, /stages/bed/seed = 1; 4 of 8 "
                        "points)"));
  EXPECT_THAT(warnings[1].problem.what, testing::EndsWith("/stages/bed/seed = 1; 2 of 8 points)"));
  const auto mistakes = [](int count) {
    std::string values = "-1";
    for (int k = 2; k <= count; ++k) values += ", -" + std::to_string(k);
    try {
      check_points(plan_of(with(map_stage(), R"("sweep": { "over": { "/stages/map/gamma": [)" + values + "] } }, ")));
    } catch (const ConfigError& error) {
      return error.problems().size();
    }
    return std::size_t{0};
  };
  EXPECT_EQ(mistakes(19), 19U);
  EXPECT_EQ(mistakes(25), 20U);
}

// --- presets and --set

TEST(PresetChanges, AreMadeAndNamed) {
  std::vector<Problem> problems;
  JsonNode document = *parse_json(R"({ "presets": { "$comment": "c", "quick": { "$comment": "c", "/stages/m/gamma": 2,
      "/stages/1/seed": 3 }, "bad": { "gamma": 1, "/presets/x": 1, "/$preset": "y" }, "wrong": 5 },
      "stages": [ { "stage": "simulate", "id": "m" }, { "stage": "map" }, 7 ] })",
                                  "r.json", problems);
  EXPECT_THAT(preset_names(document), ElementsAre("quick", "bad", "wrong"));
  EXPECT_EQ(numbered_pointer(document, "/stages/map/a/b"), "/stages/1/a/b");
  EXPECT_EQ(numbered_pointer(document, "/stages/simulate/a"), "/stages/simulate/a") << "it has another id";
  EXPECT_EQ(numbered_pointer(document, "/stages"), "/stages");
  EXPECT_EQ(numbered_pointer(document, "/report/map/x"), "/report/map/x");
  check_presets(document, "r.json", problems);
  std::vector<std::string> places;
  for (const Problem& one : problems) places.push_back(one.pointer + ": " + one.what);
  EXPECT_THAT(places, ElementsAre("/presets/bad/gamma: \"gamma\" is not a JSON pointer",
                                  "/presets/bad/~1presets~1x: a preset cannot change the presets",
                                  "/presets/bad/~1$preset: a preset cannot change the presets",
                                  "/presets/wrong: expected an object: JSON pointer → value; got the number 5"));
  const auto message = [&](const std::string& name) -> std::string {
    JsonNode copy = document;
    try {
      apply_preset(copy, "r.json", name);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(
      message("quik"),
      "--preset quik: r.json:1:14: /presets: there is no preset of this name; choose from: quick, bad, wrong; did you "
      "mean \"quick\"?");
  EXPECT_THAT(message("quick"), HasSubstr("/presets/bad/gamma")) << "all presets are checked";
  document = *parse_json(
      R"({ "presets": { "quick": { "$comment": "c", "/stages/m/gamma": 2, "/stages/1/seed": 3 }, "lost": { "/stages/no/x": 1 } },
      "stages": [ { "stage": "simulate", "id": "m" }, { "stage": "map" } ] })",
      "r.json", problems);
  EXPECT_THAT(message("lost"), HasSubstr("/presets/lost/~1stages~1no~1x: "));
  const std::vector<Relocation> relocations = apply_preset(document, "r.json", "quick");
  EXPECT_EQ(document.to_json()["stages"][0]["gamma"], 2);
  EXPECT_EQ(document.to_json()["stages"][1]["seed"], 3);
  EXPECT_EQ(document.to_json()["$preset"], "quick");
  ASSERT_EQ(relocations.size(), 2U);
  EXPECT_EQ(relocations[0], Relocation("/stages/0/gamma", "/presets/quick/~1stages~1m~1gamma"));
  EXPECT_EQ(relocations[1], Relocation("/stages/1/seed", "/presets/quick/~1stages~11~1seed"));
  std::vector<Problem> moved(4);
  moved[0].pointer = "/stages/0/gamma", moved[1].pointer = "/stages/0/gamma/x", moved[2].pointer = "/stages/0/gamma_2",
  moved[3].pointer = "";
  relocate(moved, relocations, " (elsewhere)");
  EXPECT_EQ(moved[0].pointer, relocations[0].second);
  EXPECT_EQ(moved[1].pointer, relocations[0].second);
  EXPECT_EQ(moved[1].what, " (the preset or sweep sets /stages/0/gamma/x)");
  EXPECT_EQ(moved[2].pointer, "/stages/0/gamma_2");
  EXPECT_EQ(moved[2].what, " (elsewhere)");
  EXPECT_EQ(moved[3].what, " (elsewhere)");
  document = *parse_json("{}", "r.json", problems);
  EXPECT_EQ(message("quick"), "--preset quick: r.json has no presets");
}

TEST(Settings, AreJsonOrWords) {
  EXPECT_EQ(parse_setting("/stages/0/seed=7").pointer, "/stages/0/seed");
  EXPECT_EQ(parse_setting("/stages/0/seed=7").value.to_json(), 7);
  EXPECT_EQ(parse_setting("/a=2.5 mm=x").value.to_json(), "2.5 mm=x");
  EXPECT_EQ(parse_setting("/a=").value.to_json(), "");
  EXPECT_EQ(parse_setting("/a=[1, 2]").value.to_json(), Json::parse("[1, 2]"));
  EXPECT_THROW(parse_setting("/a"), UsageError);
  EXPECT_THROW(parse_setting("a=1"), UsageError);
}

// --- options of every kind

struct Leaf {
  int depth = 2;
};
struct Left {};
struct Right {
  double length = 0.25;
};
struct Everything {
  double number = 1.5, quantity = 0.002;
  std::optional<double> maybe;
  std::int8_t small = 7;
  std::uint64_t large = 1;
  bool truth = true;
  std::string text = "t";
  int choice = 2;
  std::vector<double> lengths{0.001};
  std::vector<std::string> words{"w"};
  Json any;
  Leaf leaf;
  std::vector<Leaf> leaves{{3}};
  std::vector<std::pair<std::string, Leaf>> named{{"a/b", {4}}};
  std::variant<Left, Right> side = Right{};
};
void describe_leaf(Fields& f, Leaf& leaf) {
  f.integer("depth", leaf.depth, {.help = "how deep", .range = from_to(0, 9)});
}
void describe_everything(Fields& f, Everything& e) {
  f.number("number", e.number,
           {.help = "a number", .range = {.low = 0, .high = 2, .above_low = true, .below_high = true}});
  f.quantity("quantity", e.quantity, dimension::length, {.help = "a length", .required = true, .example = "\"5 mm\""});
  f.number("maybe", e.maybe, {.range = non_negative});
  f.integer("small", e.small);
  f.integer("large", e.large);
  f.boolean("truth", e.truth);
  f.text("text", e.text);
  f.choice("choice", e.choice, std::vector<Choice<int>>{{1, "one"}, {2, "two"}});
  f.quantities("lengths", e.lengths, dimension::length);
  f.texts("words", e.words);
  f.any("any", e.any);
  f.object<Leaf>("leaf", e.leaf, describe_leaf);
  f.array<Leaf>("leaves", e.leaves, describe_leaf);
  f.map<Leaf>("named", e.named, describe_leaf);
  f.tagged("side", e.side, {}, alternative<Left>("left", "the left"),
           alternative<Right>("right", "the right", [](Fields& g, Right& r) {
             g.quantity("length", r.length, dimension::length, {.help = "how long", .required = true});
           }));
}
struct Read {
  Everything options;
  std::string told;
};
Read read_everything(const std::string& text, bool reduced = false) {
  Read out;
  std::vector<Problem> problems;
  const auto node = parse_json(text, "f", problems);
  Fields::Source source{.file = "f"};
  source.problems = &problems;
  Fields fields = Fields::decode(*node, "/at", source);
  fields.set_reduced(reduced);
  describe_everything(fields, out.options);
  fields.finish();
  for (const Problem& one : problems)
    out.told += (out.told.empty() ? "" : " | ") + one.pointer + ": " + one.what +
                (one.suggestion.empty() ? "" : ". " + one.suggestion);
  return out;
}

TEST(OptionsOfEveryKind, AreReadAndWrittenOut) {
  const Read read =
      read_everything(R"({ "number": 0.5, "quantity": "5 mm", "maybe": 3, "small": -128, "large": 18446744073709551615,
      "truth": false, "text": "x", "choice": "one", "lengths": ["1 cm", 2], "words": ["a", "b"], "any": {"k": [1]}, "leaf": {"depth": 9},
      "leaves": [{}, {"depth": 5}], "named": {"$comment": "c", "c/d": {"depth": 1}}, "side": "right", "length": "1 m" })");
  EXPECT_EQ(read.told, "");
  EXPECT_EQ(read.options.small, -128);
  EXPECT_EQ(read.options.large, 18446744073709551615ULL);
  EXPECT_EQ(read.options.leaves[0].depth, 2);
  Json out;
  Fields fields = Fields::encode(out);
  Everything options = read.options;
  describe_everything(fields, options);
  EXPECT_EQ(
      out,
      Json::parse(R"({ "number": 0.5, "quantity": "0.005 m", "maybe": 3.0, "small": -128, "large": 18446744073709551615,
      "truth": false, "text": "x", "choice": "one", "lengths": ["0.01 m", "2 m"], "words": ["a", "b"], "any": {"k": [1]},
      "leaf": {"depth": 9}, "leaves": [{"depth": 2}, {"depth": 5}], "named": {"c/d": {"depth": 1}}, "side": "right", "length": "1 m" })"));
  EXPECT_EQ(read_everything(R"({ "quantity": 1, "large": 1e3, "small": 20.0, "side": "left" })").options.large, 1000U);
  EXPECT_EQ(read_everything(R"({ "quantity": 1.5, "lengths": [2], "length": 3 })", true).told, "");
}

TEST(OptionsOfEveryKind, AreRefusedWithTheirPlaces) {
  const auto told_of = [](const std::string& keys) {
    return read_everything(R"({ "quantity": 1, "length": 1, )" + keys + " }").told;
  };
  EXPECT_EQ(read_everything(R"({ "length": 1 })").told,
            "/at/quantity: \"quantity\" is missing: a length is needed. Add \"quantity\": "
            "\"5 mm\" (a length)");
  EXPECT_EQ(read_everything(R"({ "quantity": 1 })").told,
            "/at/length: \"length\" is missing: a length is needed. how long");
  EXPECT_EQ(told_of(R"("number": 0)"),
            "/at/number: must be above 0 and below 2, got 0. Meaning of \"number\": a number");
  EXPECT_EQ(told_of(R"("number": 2)"),
            "/at/number: must be above 0 and below 2, got 2. Meaning of \"number\": a number");
  EXPECT_EQ(told_of(R"("number": "1")"), "/at/number: expected a number, got the string \"1\"");
  EXPECT_EQ(told_of(R"("maybe": -1)"), "/at/maybe: must be 0 or more, got -1");
  EXPECT_EQ(told_of(R"("maybe": null, "number": null)"), "") << "null: the default";
  EXPECT_EQ(told_of(R"("small": 128)"), "/at/small: must lie from -128 to 127, got 128");
  EXPECT_EQ(told_of(R"("small": -129)"), "/at/small: must lie from -128 to 127, got -129");
  EXPECT_EQ(told_of(R"("large": -1)"), "/at/large: must lie from 0 to 18446744073709551615, got -1");
  EXPECT_EQ(told_of(R"("small": 1.5)"), "/at/small: expected a whole number, got the number 1.5");
  EXPECT_EQ(told_of(R"("large": 1e16)"), "/at/large: expected a whole number, got the number 1e16");
  EXPECT_EQ(told_of(R"("truth": 1)"), "/at/truth: expected true or false, got the number 1");
  EXPECT_EQ(told_of(R"("text": 1)"), "/at/text: expected a string, got the number 1");
  EXPECT_EQ(told_of(R"("choice": "tow")"),
            "/at/choice: expected one of \"one\", \"two\", got \"tow\". Did you mean \"two\"?");
  EXPECT_EQ(told_of(R"("choice": 2)"), "/at/choice: expected one of \"one\", \"two\", got the number 2");
  EXPECT_EQ(told_of(R"("lengths": ["1 mm", "1 s"])"),
            "/at/lengths/1: \"1 s\" is a time: expected a length, a string with a unit such as "
            "\"2.99 mm\" or a number in m");
  EXPECT_EQ(told_of(R"("lengths": 1)"), "/at/lengths: expected an array of quantities, got the number 1");
  EXPECT_EQ(told_of(R"("words": ["a", 1])"), "/at/words/1: expected a string, got the number 1");
  EXPECT_EQ(told_of(R"("leaf": [])"), "/at/leaf: expected an object, got an empty array");
  EXPECT_EQ(told_of(R"("leaf": {"depth": 10})"),
            "/at/leaf/depth: must be from 0 to 9, got 10. Meaning of \"depth\": how deep");
  EXPECT_EQ(told_of(R"("leaves": [{"depth": -1}, 3])"),
            "/at/leaves/0/depth: must be from 0 to 9, got -1. Meaning of \"depth\": how deep | "
            "/at/leaves/1: expected an object, got the number 3");
  EXPECT_EQ(told_of(R"("named": {"a/b": {"dept": 1}})"),
            "/at/named/a~1b/dept: unknown key \"dept\". Did you mean \"depth\"?");
  EXPECT_EQ(told_of(R"("named": {"a": {}, "a/b": 3})"), "/at/named/a~1b: expected an object, got the number 3");
  EXPECT_EQ(told_of(R"("zzzzzzzz": 1)").substr(0, 62),
            "/at/zzzzzzzz: unknown key \"zzzzzzzz\". Choose from: number, qua");
  EXPECT_EQ(read_everything(R"({ "quantity": 1, "side": "left", "length": 1 })").told,
            "/at/length: unknown key \"length\". It belongs to \"side\": \"right\".");
  EXPECT_EQ(read_everything(R"({ "quantity": "1.5" , "length": 1 })").told,
            "/at/quantity: \"1.5\" has no unit: expected a length, a string with a unit such as \"2.99 mm\" or a "
            "number in m. Write \"1.5 mm\"");
  EXPECT_EQ(read_everything(R"({ "quantity": true, "length": 1 })").told,
            "/at/quantity: expected a length, a string with a unit such as \"2.99 mm\" or a number in m, got true. "
            "Write for example \"5 mm\"");
  EXPECT_EQ(read_everything(R"({ "quantity": "1 mm", "length": 1 })", true).told,
            "/at/quantity: expected a plain number (this stage has \"units\": \"reduced\"), got the string \"1 mm\". "
            "In reduced "
            "units lengths are in D, "
            "masses in m, and g or the starting T is 1");
}

TEST(Ranges, AreNamedByTheirEnds) {
  const auto words = [](double low, double high, bool above_low, bool below_high) {
    return Range{.low = low, .high = high, .above_low = above_low, .below_high = below_high}.words();
  };
  EXPECT_EQ(words(1, 2, false, false), "from 1 to 2");
  EXPECT_EQ(words(1, 2, true, true), "above 1 and below 2");
  EXPECT_EQ(words(1, INFINITY, true, false), "above 1");
  EXPECT_EQ(words(1, INFINITY, false, false), "1 or more");
  EXPECT_EQ(words(-INFINITY, 2.5, false, true), "below 2.5");
  EXPECT_EQ(words(-INFINITY, 2.5, false, false), "2.5 or less");
  EXPECT_EQ(words(-INFINITY, INFINITY, false, false), "");
}

TEST(OptionsOfEveryKind, HaveASchema) {
  Json schema;
  Fields fields = Fields::schema(schema);
  Everything options;
  describe_everything(fields, options);
  fields.finish();
  const Json& of = schema["properties"];
  EXPECT_EQ(
      of["number"],
      Json::parse(
          R"({"type": "number", "exclusiveMinimum": 0.0, "exclusiveMaximum": 2.0, "description": "a number", "default": 1.5})"));
  EXPECT_EQ(of["quantity"]["examples"], Json::parse(R"(["5 mm"])"));
  EXPECT_FALSE(of["quantity"].contains("default")) << "it is required";
  EXPECT_EQ(of["quantity"]["anyOf"][1], Json::parse(R"({"type": "number"})"));
  EXPECT_EQ(schema["required"], Json::parse(R"(["quantity"])"));
  EXPECT_EQ(of["maybe"], Json::parse(R"({"type": "number", "minimum": 0.0})"));
  EXPECT_EQ(of["small"], Json::parse(R"({"type": "integer", "default": 7})"));
  EXPECT_EQ(of["truth"], Json::parse(R"({"type": "boolean", "default": true})"));
  EXPECT_EQ(of["text"], Json::parse(R"({"type": "string", "default": "t"})"));
  EXPECT_EQ(of["choice"], Json::parse(R"({"enum": ["one", "two"], "default": "two"})"));
  EXPECT_EQ(of["words"],
            Json::parse(R"({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]})"));
  EXPECT_EQ(of["lengths"]["type"], "array");
  EXPECT_EQ(of["lengths"]["items"]["examples"], Json::parse(R"(["2.99 mm"])"));
  EXPECT_EQ(
      of["leaf"]["properties"]["depth"],
      Json::parse(R"({"type": "integer", "minimum": 0.0, "maximum": 9.0, "description": "how deep", "default": 2})"));
  EXPECT_EQ(of["leaf"]["additionalProperties"], false);
  EXPECT_EQ(of["leaves"]["items"]["properties"]["depth"]["default"], 2);
  EXPECT_EQ(of["named"]["additionalProperties"]["properties"]["depth"]["type"], "integer");
  EXPECT_EQ(
      of["side"],
      Json::parse(
          R"({"enum": ["left", "right"], "default": "right", "description": "left: the left; right: the right"})"));
  EXPECT_EQ(
      schema["allOf"],
      Json::parse(
          R"([{"if": {"properties": {"side": {"const": "right"}}, "required": ["side"]}, "then": {"required": ["length"]}}])"));
  EXPECT_EQ(of["$comment"]["type"], "string");
  EXPECT_EQ(schema["additionalProperties"], false);
}

}  // namespace
