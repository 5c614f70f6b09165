// A study whose chain is done by hand: what is written into the chain, what is taken of it, means, tables, mistakes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "pipelines/runner/plan.hpp"
#include "tests/pipelines/lone_stage.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::HasSubstr;

// Runs a study. Its chain is a map, of which the test writes the results: with Gamma = g and the diameter d in mm, the
// critical temperature is 10 g + d + the number of the run at this point, and the table has two rows.
class StudyByHand : public LoneStage {
 public:
  StudyByHand() : LoneStage(*find_stage("study")) {}
  const ResultList& stated() const override { return study_stated_; }
  std::string told;  // what was wrong with the options

  bool study(const std::string& options) {
    std::vector<Problem> problems;
    const auto node = parse_json(options, "options", problems);
    read_warnings.clear();
    Fields::Source source{.file = "options", .problems = &problems, .warnings = &read_warnings};
    std::unique_ptr<Stage> stage = find_stage("study")->make();
    Fields fields = Fields::decode(*node, "", source);
    stage->describe(fields);
    if (problems.empty()) {
      stage->check_chains(fields, [&](const JsonNode& recipe) {
        Plan plan = make_plan(recipe, "(chain)", output_directory());
        Chain chain;
        for (PlannedStage& one : plan.stages)
          chain.stages.push_back(
              {one.id, std::string(one.row->name), !one.input_files.empty(), std::move(one.results)});
        chain.stages.front().results->truth("/flag", "a flag");
        const double g = recipe.to_json()["stages"][0]["gamma"].get<double>();
        if (g > 3) chain.warnings.push_back({"strong", {"f", 1, 1, "/stages/0/gamma", "g is large", "Lower it"}});
        return chain;
      });
    }
    fields.finish();
    told.clear();
    for (const Problem& one : problems)
      told += (told.empty() ? "" : " | ") + one.pointer + ": " + one.what +
              (one.suggestion.empty() ? "" : ". " + one.suggestion);
    if (!told.empty()) return false;
    study_stated_ = ResultList();
    stage->results(study_stated_);
    stage->run(*this);
    return true;
  }
  std::vector<Input> run_chain(const JsonNode& recipe, const std::filesystem::path& folder, const Progress&) override {
    const Json stage = recipe.to_json()["stages"][0];
    chains.push_back(stage);
    std::filesystem::create_directories(folder / "map");
    const double g = stage["gamma"].get<double>(), d = std::stod(stage["diameter"].get<std::string>());
    const int run = ++runs_[{g, d}] - 1;
    if (stopping == static_cast<int>(chains.size())) throw StageError("no disk is left");
    const Json found = failing == static_cast<int>(chains.size())
                           ? Json{{"status", "failed"}, {"critical_temperature", {{"value", 1e6}}}}
                           : Json{{"critical_temperature", {{"value", 10 * g + d + run}, {"std_error", 0.5}}},
                                  {"equation_of_state", "enskog"},
                                  {"flag", g > 2}};
    write_text(folder / "map/map.json", dump(found));
    // Rows in no order; the second is missing in the second run.
    write_text(folder / "map/map.csv", "name,jump,rise\nb,2," + number_text(g + 1) + "\na,1," + number_text(g - run) +
                                           "\n" + (run == 0 ? "c,3,7\n" : "") + "d,,5\n");
    return {{"map", "map", folder / "map", "map.json"}};
  }
  double trial_of_chain(const JsonNode& recipe) const override {
    ++trials;
    return seconds_by_g * std::pow(recipe.to_json()["stages"][0]["gamma"].get<double>(), 2);
  }
  void notice(std::string_view sentence) override { notices.emplace_back(sentence); }
  bool interrupted() const override { return stopped; }
  void progress(double fraction, std::string_view what) override { reached = fraction, of = what; }
  std::string written(const std::string& name) { return read_text(output(name)); }

  std::vector<Json> chains;
  int failing = 0, stopping = 0;  // number of the chain whose result says so, and of the one that ends the stage
  bool stopped = false;           // by the user
  double seconds_by_g = 0;        // of a run, over the square of g; 0: no trial
  mutable int trials = 0;
  std::vector<std::string> notices;
  std::vector<Warning> read_warnings;
  double reached = 0;
  std::string of;

 private:
  ResultList study_stated_;
  std::map<std::pair<double, double>, int> runs_;
};

std::string options(const std::string& parameter, const std::string& collect, const std::string& more = "",
                    const std::string& keys = "") {
  return R"({ "stages": [ { "stage": "map", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 )" +
         keys + R"( } ], "parameter": )" + parameter + R"(, "collect": )" + collect + more + " }";
}
const std::string gammas = R"({ "name": "g", "values": [1, 2.5], "set": ["/stages/map/gamma"] })",
                  critical = R"({ "t": { "at": "/map/critical_temperature" } })";

TEST(StudyDoneByHand, HasItsPointsInOrderAndItsMeans) {
  StudyByHand study;
  ASSERT_TRUE(
      study.study(options(R"({ "name": "g", "values": [1, 2.5], "times": 2, "set": ["/stages/map/gamma"] })",
                          R"({ "t": { "at": "/map/critical_temperature", "times": -2, "plus": 1 } })",
                          R"(, "replicas": 2, "second": { "name": "d", "values": [3, 4], "times": 0.5, "unit": "mm",
                                      "set": ["/stages/map/diameter"] },
                                      "series": { "a,b": { "set": { "/stages/map/restitution": 0.5 } }, "c": { "times": 10 } })")))
      << study.told;
  // Series, then the second parameter, then the first, then replicas.
  ASSERT_EQ(study.chains.size(), 16U);
  EXPECT_EQ(study.chains[0]["gamma"], 2);
  EXPECT_EQ(study.chains[0]["gamma"].type(), Json::value_t::number_integer) << "a whole number is written as one";
  EXPECT_EQ(study.chains[0]["diameter"], "1.5 mm");
  EXPECT_EQ(study.chains[0]["restitution"], 0.5);
  EXPECT_EQ(study.chains[2]["gamma"], 5);
  EXPECT_EQ(study.chains[4]["diameter"], "2 mm");
  EXPECT_EQ(study.chains[8]["gamma"], 10);
  EXPECT_FALSE(study.chains[8].contains("restitution"));
  EXPECT_EQ(study.chains[10]["gamma"], 25);
  // Of (g, d): 10 g + d and one more; the mean of -2 t + 1, and half the distance of the two as its error.
  EXPECT_EQ(study.written("table.csv"),
            "series,g,d,t,t_error\n"
            "\"a,b, d = 3\",1,3,-43,1\n\"a,b, d = 3\",2.5,3,-103,1\n"
            "\"a,b, d = 4\",1,4,-44,1\n\"a,b, d = 4\",2.5,4,-104,1\n"
            "\"c, d = 3\",1,3,-203,1\n\"c, d = 3\",2.5,3,-503,1\n"
            "\"c, d = 4\",1,4,-204,1\n\"c, d = 4\",2.5,4,-504,1\n");
  EXPECT_THAT(study.written("replicas.csv"),
              HasSubstr("series,g,d,replica,t\n\"a,b, d = 3\",1,3,0,-42\n\"a,b, d = 3\",1,3,1,-44\n"));
  const Json json = read_json(study.output("study.json"));
  EXPECT_EQ(json["runs"], 16);
  EXPECT_EQ(json["replicas"], 2);
  EXPECT_EQ(json["series"]["c, d = 4"][1],
            Json::parse(R"({ "g": 2.5, "d": 4.0, "t": { "value": -504.0, "std_error": 1.0, "runs": 2 } })"));
  const ResultList& stated = study.stated();
  EXPECT_EQ(stated.find_table("table.csv")->columns[1].unit, "1") << "scaled: in a unit of its own";
  EXPECT_EQ(stated.find_table("table.csv")->columns[2].unit, "1");
  EXPECT_EQ(stated.find_table("table.csv")->columns[3].unit, "1");
  EXPECT_TRUE(study.warnings.empty());
}

// One run keeps its own error; a value that is no whole number, one with a unit; units of what is not scaled.
TEST(StudyDoneByHand, OfOneRunKeepsItsError) {
  StudyByHand study;
  ASSERT_TRUE(study.study(options(
      R"({ "name": "d", "values": [3, 4], "unit": "mm", "set": ["/stages/map/diameter"] })",
      R"({ "t": { "at": "/map/critical_temperature" }, "s": { "at": "/map/critical_temperature", "times": -3 } })")))
      << study.told;
  EXPECT_EQ(study.written("table.csv"), "series,d,t,t_error,s,s_error\nall,3,43,0.5,-129,1.5\nall,4,44,0.5,-132,1.5\n");
  EXPECT_EQ(read_json(study.output("study.json"))["series"]["all"][0]["t"],
            Json::parse(R"({ "value": 43.0, "std_error": 0.5, "runs": 1 })"));
  const StatedTable& table = *study.stated().find_table("table.csv");
  EXPECT_EQ(table.columns[1].unit, "mm");
  EXPECT_EQ(table.columns[2].unit, "m g D");
  EXPECT_EQ(table.columns[3].unit, "m g D");
  EXPECT_EQ(table.columns[4].unit, "1");
  EXPECT_EQ(table_notes(study.output("table.csv"))["runs_per_point"], 1);
}

// Columns of tables: rise by jump is (1, g - run), (2, g + 1), and (3, 7) in the first run.
TEST(StudyDoneByHand, TakesNumbersOfTables) {
  const auto taken = [](const std::string& keys) {
    StudyByHand study;
    EXPECT_TRUE(
        study.study(options(R"({ "name": "g", "values": [2.5], "set": ["/stages/map/gamma"] })",
                            R"({ "t": { "at": "/map/map.csv", "column": "rise", "by": "jump", )" + keys + " } }")))
        << study.told;
    const std::string csv = study.written("replicas.csv");
    return csv.substr(csv.find('\n') + 1);
  };
  EXPECT_EQ(taken(R"("take": "largest")"), "all,2.5,0,7\n");
  EXPECT_EQ(taken(R"("take": "smallest")"), "all,2.5,0,2.5\n");
  EXPECT_EQ(taken(R"("take": "place_of_largest")"), "all,2.5,0,3\n");
  EXPECT_EQ(taken(R"("take": "place_of_smallest")"), "all,2.5,0,1\n");
  EXPECT_EQ(taken(R"("take": "mean")"), "all,2.5,0," + number_text((2.5 + 3.5 + 7) / 3) + "\n");
  EXPECT_EQ(taken(R"("take": "largest", "most": 2)"), "all,2.5,0,3.5\n");
  EXPECT_EQ(taken(R"("take": "smallest", "least": 2)"), "all,2.5,0,3.5\n");
  EXPECT_EQ(taken(R"("take": "mean", "least": 1, "most": 2, "times": 2, "plus": 1)"), "all,2.5,0,7\n");
  EXPECT_EQ(taken(R"("take": "mean", "least": 4)"), "all,2.5,0,\n") << "no row";
}

// Rows of the same key over two runs: means, half their distance, and how many runs had the row.
TEST(StudyDoneByHand, AveragesTables) {
  StudyByHand study;
  ASSERT_TRUE(study.study(
      options(gammas, critical, R"(, "replicas": 2, "tables": { "mine": { "at": "/map/map.csv", "key": "jump" } })")))
      << study.told;
  EXPECT_EQ(study.written("mine.csv"),
            "series,g,jump,name,name_error,rise,rise_error,runs\n"
            "all,1,1,,,0.5,0.5,2\nall,1,2,,,2,0,2\nall,1,3,,,7,,1\n"
            "all,2.5,1,,,2,0.5,2\nall,2.5,2,,,3.5,0,2\nall,2.5,3,,,7,,1\n");
  EXPECT_EQ(study.stated().find_table("mine.csv")->columns[2].name, "jump");
}

TEST(StudyDoneByHand, LeavesOutWhatDidNotSucceed) {
  StudyByHand study;
  study.failing = 3;  // the first run of the second value
  ASSERT_TRUE(study.study(options(gammas, critical, R"(, "replicas": 2)"))) << study.told;
  EXPECT_EQ(study.written("table.csv"), "series,g,t,t_error\nall,1,13.5,0.5\nall,2.5,29,0.5\n");
  EXPECT_EQ(read_json(study.output("study.json"))["series"]["all"][1]["t"]["runs"], 1);
  ASSERT_EQ(study.warnings.size(), 1U);
  EXPECT_THAT(study.warnings[0], HasSubstr("1 of 4 numbers are missing, because"));
}

// Runs that an earlier attempt left are not made again, and what is there counts.
TEST(StudyDoneByHand, GoesOnWithTheRunsThatAreThere) {
  StudyByHand study;
  study.stopping = 3;
  EXPECT_THROW(study.study(options(gammas, critical, R"(, "replicas": 2)")), StageError);
  EXPECT_EQ(study.chains.size(), 3U);
  write_text(study.scratch() / "run-1.json", R"({ "numbers": [[100, null]], "tables": [] })");
  study.stopping = 0;
  ASSERT_TRUE(study.study(options(gammas, critical, R"(, "replicas": 2)"))) << study.told;
  EXPECT_EQ(study.chains.size(), 5U) << "the third and the fourth";
  EXPECT_EQ(study.written("replicas.csv"), "series,g,replica,t\nall,1,0,13\nall,1,1,100\nall,2.5,0,29\nall,2.5,1,30\n");
  EXPECT_EQ(study.of, "4 runs");
  EXPECT_EQ(study.reached, 1);
  EXPECT_FALSE(std::filesystem::exists(study.scratch() / "run-0")) << "of a finished run its numbers remain alone";
}

TEST(StudyDoneByHand, SaysWhichRunFailed) {
  StudyByHand study;
  study.stopping = 4;
  try {
    study.study(options(gammas, critical, R"(, "replicas": 2, "series": { "soft": {} })"));
    FAIL();
  } catch (const StageError& error) {
    EXPECT_STREQ(error.what(), "soft, g = 2.5, replica 1: no disk is left");
  }
}

TEST(StudyDoneByHand, StopsWhenItIsInterrupted) {
  StudyByHand study;
  study.stopped = true;
  EXPECT_THROW(study.study(options(gammas, critical)), Interrupted);
  EXPECT_TRUE(study.chains.empty());
  EXPECT_EQ(study.trials, 0);
}

// One trial a point. Of 0.25, 0.5, 1, 2 and 10 the last takes 100 times the median's g of 1, squared. It is said once,
// however many replicas it has.
TEST(StudyDoneByHand, NamesThePointThatTakesLong) {
  const auto notices = [](double seconds, const std::string& last) {
    StudyByHand study;
    study.seconds_by_g = seconds;
    EXPECT_TRUE(study.study(
        options(R"({ "name": "g", "values": [0.25, 0.5, 1, 2, )" + last + R"(], "set": ["/stages/map/gamma"] })",
                critical, R"(, "replicas": 3)")))
        << study.told;
    EXPECT_EQ(study.trials, seconds > 0 ? 5 : 1) << "of a chain that has no trial one is tried";
    return study.notices;
  };
  EXPECT_THAT(
      notices(0.5, "10"),
      testing::ElementsAre("the run of all, g = 10 will take about 50 s, 100 times the median of 0.5 s. To save "
                           "this time, stop with Ctrl-C. Then remove this value, or measure for a shorter time"));
  EXPECT_THAT(notices(0.5, "3"), testing::IsEmpty()) << "nine times the median";
  EXPECT_THAT(notices(0.01, "10"), testing::IsEmpty()) << "a second";
  EXPECT_THAT(notices(0, "10"), testing::IsEmpty());
}

// Warnings of its chains are gathered: how many of its points have them.
TEST(StudyDoneByHand, GathersTheWarningsOfItsPoints) {
  StudyByHand study;
  ASSERT_TRUE(study.study(options(R"({ "name": "g", "values": [1, 4, 5], "set": ["/stages/map/gamma"] })", critical,
                                  R"(, "series": { "a": {}, "b": {} })")))
      << study.told;
  ASSERT_EQ(study.read_warnings.size(), 1U);
  EXPECT_EQ(study.read_warnings[0].kind, "strong");
  EXPECT_EQ(study.read_warnings[0].problem.what, "g is large (4 of 6 points)");
  EXPECT_EQ(study.read_warnings[0].problem.suggestion, "Lower it");
}

// Yes is 1 and no is 0, whatever the factor.
TEST(StudyDoneByHand, CountsWhatIsTrue) {
  StudyByHand study;
  ASSERT_TRUE(study.study(options(gammas, R"({ "f": { "at": "/map/flag", "times": 5 } })"))) << study.told;
  EXPECT_EQ(study.written("replicas.csv"), "series,g,replica,f\nall,1,0,0\nall,2.5,0,1\n");
}

TEST(StudyDoneByHand, NamesItsMistakes) {
  const auto told = [](const std::string& text) {
    StudyByHand study;
    study.study(text);
    return study.told;
  };
  EXPECT_EQ(told(options(R"({ "values": [] })", critical)), "/parameter/values: the list of values is empty");
  for (const char* replicas : {"0", "1001"})
    EXPECT_THAT(told(options(gammas, critical, ", \"replicas\": " + std::string(replicas))), HasSubstr("/replicas: "));
  EXPECT_EQ(told(options(gammas, "{}")), "/collect: \"collect\" is empty: give at least one number");
  EXPECT_EQ(told(options(gammas, critical, R"(, "second": { "name": "g", "values": [] })")),
            "/second/name: both parameters have the same name | /second/values: the list of values is empty");
  EXPECT_THAT(told(options(gammas, R"({ "t": { "at": "/map/nothing" } })")), HasSubstr("/collect/t/at: "));
  EXPECT_EQ(told(options(gammas, R"({ "t": { "at": "/map/no.csv", "column": "rise" } })")),
            "/collect/t/at: \"/map/no.csv\" is not a table of the study's stages. Write /<stage id>/<file>.csv");
  EXPECT_THAT(told(options(gammas, R"({ "t": { "at": "/map/map.csv", "column": "ris", "by": "jump" } })")),
              HasSubstr("/collect/t/column: "));
  EXPECT_THAT(told(options(gammas, R"({ "t": { "at": "/map/map.csv", "column": "rise" } })")),
              HasSubstr("/collect/t/by: "));
  const auto table = [&](const std::string& name, const std::string& at, const std::string& key) {
    return told(options(gammas, critical,
                        ", \"tables\": { \"" + name + R"(": { "at": ")" + at + R"(", "key": ")" + key + "\" } }"));
  };
  for (const char* name : {"table", "replicas", "a.b", "a b"})
    EXPECT_THAT(table(name, "/map/map.csv", "jump"),
                HasSubstr("\"" + std::string(name) + "\" cannot be the name of a table"));
  EXPECT_THAT(table("t", "/nobody/map.csv", "jump"),
              HasSubstr("/tables/t/at: \"/nobody/map.csv\" is not a file of the study's stages"));
  EXPECT_THAT(table("t", "/map", "jump"), HasSubstr("/tables/t/at: \"/map\" is not a file of the study's stages"));
  EXPECT_THAT(table("t", "/map/no.csv", "jump"), HasSubstr("/tables/t/at: "));
  EXPECT_THAT(table("t", "/map/map.csv", "jum"), HasSubstr("/tables/t/key: "));
  EXPECT_THAT(told(options(R"({ "name": "g", "values": [1, -2], "set": ["/stages/map/gamma"] })", critical,
                           R"(, "series": { "one": {}, "two": {} })")),
              HasSubstr("/series/one: /stages/0/gamma (at g = -2): must be above 0, got "));
  EXPECT_THAT(told(options(gammas, critical, R"(, "series": { "one": { "set": 3 } })")),
              HasSubstr("/series/one/set: expected an object: pointer → value"));
}

// The code of the kinds in the chain is part of what a study is made from.
TEST(StudyDoneByHand, KnowsTheKindsOfItsChain) {
  const StageRow& row = *find_stage("study");
  std::unique_ptr<Stage> stage = row.make();
  std::vector<Problem> problems;
  const auto node = parse_json(
      R"({ "stages": [ { "stage": "simulate", "id": "b" }, { "stage": "map" }, 4 ], "parameter": { "values": [1] },
                                    "collect": { "t": { "at": "/b/x" } } })",
      "o", problems);
  Fields fields = Fields::decode(*node, "", Fields::Source{.file = "o", .problems = &problems});
  stage->describe(fields);
  EXPECT_EQ(stage->chain_kinds(), (std::vector<std::string>{"simulate", "map"}));
}

}  // namespace
