// summary.json of a run whose result files are made by hand, and what is left of a run that was killed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pipelines/runner/plan.hpp"
#include "pipelines/runner/run.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::tests::run_summary {
namespace {

using namespace shakebed::pipelines;

// Two fits of one profile and a map.
class RunSummary : public testing::Test {
 protected:
  RunSummary() {
    write_text(folder_ / "p.csv", "height,number_density\n1,1\n2,0.5\n3,0.1\n");
    std::vector<Problem> problems;
    plan_ = make_plan(*parse_json(R"({ "name": "three", "stages": [
        { "stage": "fit", "id": "f", "profile": "p.csv" }, { "stage": "fit", "id": "g", "profile": "p.csv" },
        { "stage": "map", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 } ] })",
                                  "r.json", problems),
                      "r.json", folder_.path());
    outcome_.out = folder_ / "o";
    for (const PlannedStage& stage : plan_.stages)
      outcome_.stages.push_back({.id = stage.id, .kind = std::string(stage.row->name), .record = StageRecord{}});
  }
  void result(const std::string& file, const Json& json) {
    std::filesystem::create_directories((outcome_.out / file).parent_path());
    write_text(outcome_.out / file, dump(json));
  }
  ScratchFolder folder_;
  Plan plan_;
  RunOutcome outcome_;
};

TEST_F(RunSummary, HoldsTheResultsOfEveryStage) {
  result("f/fit.json", Json{{"status", "ok"}, {"temperature", 1}});
  result("g/fit.json", Json{{"status", "ok"}, {"answer", {{"verdict", "one temperature"}}}});
  result("map/map.json", Json{{"kept", std::vector<int>(64, 7)}, {"long", std::vector<int>(65, 7)}, {"last", nullptr}});
  outcome_.warnings = {"a", "b"};
  const Json summary = summary_json(plan_, outcome_);
  EXPECT_EQ(summary["pipeline"], "three");
  EXPECT_EQ(summary["warnings"], Json::parse(R"(["a", "b"])"));
  EXPECT_EQ(summary["f"], Json::parse(R"({ "status": "ok", "temperature": 1 })"));
  EXPECT_EQ(summary["map"]["kept"].size(), 64U);
  EXPECT_FALSE(summary["map"].contains("long")) << "a long list stays in the stage's own file";
  EXPECT_TRUE(summary["map"].contains("last"));
  EXPECT_EQ(summary["answer"], Json::parse(R"({ "verdict": "one temperature", "stage": "g" })"))
      << "of the first stage that has one";
  // What has not run in this state of the recipe says nothing, whatever lies there.
  outcome_.stages[1].record.reset();
  std::filesystem::remove(outcome_.out / "map/map.json");
  const Json less = summary_json(plan_, outcome_);
  EXPECT_FALSE(less.contains("answer"));
  EXPECT_FALSE(less.contains("g"));
  EXPECT_FALSE(less.contains("map"));
  EXPECT_TRUE(less.contains("f"));
}

TEST_F(RunSummary, SaysHowTheRunEnded) {
  for (const auto& [code, status] : {std::pair(exit_ok, "ok"),
                                     {exit_check_failed, "check failed"},
                                     {exit_interrupted, "interrupted"},
                                     {exit_input, "failed"},
                                     {exit_stage_failed, "failed"}}) {
    outcome_.code = code;
    EXPECT_EQ(summary_json(plan_, outcome_)["status"], status);
  }
  const char* states[] = {"ran", "up to date", "not selected", "failed", "interrupted", "not run"};
  const StageState all[] = {StageState::ran,    StageState::kept,        StageState::not_selected,
                            StageState::failed, StageState::interrupted, StageState::waiting};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(to_string(all[i]), states[i]);
}

// Hidden files that end in .part and hidden folders of stages; not what only looks like them.
TEST_F(RunSummary, LeftoversAreRemoved) {
  const std::filesystem::path out = folder_ / "l";
  for (const char* one : {".a.json.part", "b.part", ".c", "d.json", ".partial-f/x", "partial-g/x"}) {
    std::filesystem::create_directories((out / one).parent_path());
    write_text(out / one, "x");
  }
  remove_leftovers(out);
  std::vector<std::string> left;
  for (const auto& entry : std::filesystem::directory_iterator(out)) left.push_back(entry.path().filename().string());
  EXPECT_THAT(left, testing::UnorderedElementsAre("b.part", ".c", "d.json", "partial-g"));
}

}  // namespace
}  // namespace shakebed::tests::run_summary
