// In which order the stages of a recipe run.
#include "pipelines/runner/plan.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;

std::vector<std::string> order_of(const std::string& stages) {
  const ScratchFolder folder;
  std::vector<Problem> problems;
  const Plan plan = make_plan(*parse_json(R"({ "name": "order", "stages": [)" + stages + "] }", "r.json", problems),
                              "r.json", folder.path());
  std::vector<std::string> ids;
  for (const PlannedStage& stage : plan.stages) ids.push_back(stage.id);
  return ids;
}

const std::string map = R"({ "stage": "map", "id": "map", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm",
                             "initial_height": 10 })",
                  fit = R"({ "stage": "fit", "id": "fit", "from": "bed" })",
                  bed = R"({ "stage": "simulate", "id": "bed", "disks": { "count": 50, "diameter": "3 mm" },
                             "box": { "width": "19 mm" }, "settle": "0.5 s", "measure": "0.5 s",
                             "floor": { "motion": "sinusoidal", "amplitude": "2 mm", "frequency": "20 Hz" } })";

// As written, but each after those it reads from.
TEST(Plan, RunsAStageAfterThoseItReadsFrom) {
  using Ids = std::vector<std::string>;
  EXPECT_EQ(order_of(map + "," + bed + "," + fit), (Ids{"map", "bed", "fit"}));
  EXPECT_EQ(order_of(bed + "," + fit + "," + map), (Ids{"bed", "fit", "map"}));
  EXPECT_EQ(order_of(map + "," + fit + "," + bed), (Ids{"map", "bed", "fit"}));
  EXPECT_EQ(order_of(fit + "," + bed + "," + map), (Ids{"bed", "map", "fit"}));
}

}  // namespace
