// The time left of sweeps: what stands out, and what is foreseen before anything runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "pipelines/formats/duration.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/runner/expected_time.hpp"
#include "pipelines/runner/read_recipe.hpp"
#include "pipelines/runner/sweep_points.hpp"
#include "pipelines/runner/sweep_progress.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::tests {
namespace {

using namespace pipelines;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(LongParts, AreTenTimesTheMedian) {
  const auto found = long_parts({4, 5, 6, 0, 70, 49, 5});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].part, 4U);
  EXPECT_EQ(found[0].median, 6);
  EXPECT_TRUE(long_parts({4, 5, 6, 7, 59.9}).empty());
  EXPECT_EQ(long_parts({4, 5, 6, 7, 60.1}).size(), 1U);
}

TEST(LongParts, AreNoneOfTwo) { EXPECT_TRUE(long_parts({1, 1000}).empty()); }

TEST(LongParts, AreNoneThatTakeAMoment) { EXPECT_TRUE(long_parts({0.01, 0.01, 0.01, 1.5}).empty()); }

TEST(LongParts, SayHowLongAndBesideWhat) {
  EXPECT_EQ(long_part_text({3, 600, 12}), "will take about 10 min 0 s, 50 times the median of 12 s");
}

// The bed of which one run takes thousands of times as long as another.
std::string recipe(const std::string& measure_values) {
  return R"({"name": "uneven", "stages": [
    {"stage": "simulate", "id": "bed", "disks": {"count": 40, "diameter": "3 mm", "density": "2500 kg/m^3",
     "restitution": 0.8, "friction": 0}, "gravity": "9.81 m/s^2",
     "box": {"width": "30 mm", "sides": {"kind": "hard", "restitution": 0.8}, "lid": "open"},
     "floor": {"motion": "sinusoidal", "gamma": 4, "frequency": "20 Hz", "restitution": 0.8},
     "settle": "0.5 s", "measure": "1 s", "replicas": 1},
    {"stage": "fit", "from": "bed"}],
    "sweep": {"over": {"/stages/bed/measure": )" +
         measure_values + "}}}";
}

class Sweep {
 public:
  explicit Sweep(const std::string& text)
      : plan(read_recipe_text(text, "uneven.json", ".")), points(sweep_points(plan)) {
    keys.reserve(points.size());
    for (const SweepPoint& point : points) keys.push_back(keys_of(plan_at(plan, point)));
  }
  std::vector<PointToRun> all() const {
    std::vector<PointToRun> out;
    for (std::size_t i = 0; i < points.size(); ++i) out.push_back({&points[i], &keys[i]});
    return out;
  }
  Plan plan;
  std::vector<SweepPoint> points;
  std::vector<PointKeys> keys;
};

TEST(SweepProgress, NamesAPointThatWillTakeFarLongerThanTheOthers) {
  const Sweep sweep(recipe(R"(["1 s", "2 s", "20000 s", "3 s"])"));
  SweepProgress progress(sweep.plan, sweep.all(), 2);
  progress.trials([] { return false; });
  const std::vector<std::string> found = progress.long_points();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0], HasSubstr("point 000002 (/stages/bed/measure = 20000 s) will take about"));
  EXPECT_THAT(found[0], HasSubstr("remove the value from the sweep, or measure for a shorter time"));
}

// What the fit of a finished point took is learned for the fits. The bed is still known by its trials: the long point
// stays the long one.
TEST(SweepProgress, LearnsWhatNoTrialKnowsForItsOwnStageAlone) {
  const Sweep sweep(recipe(R"(["1 s", "2 s", "20000 s", "3 s"])"));
  SweepProgress progress(sweep.plan, sweep.all(), 1);
  progress.trials([] { return false; });
  const ScratchFolder folder;
  std::filesystem::create_directories(folder / "fit");
  write_text(folder / "fit/cost.json",
             R"({"wall_seconds": 0.01, "cpu_seconds": 0.01, "threads": 1, "host": "here", "finished": "2026-01-01"})");
  progress.learn(folder.path());
  ASSERT_EQ(progress.long_points().size(), 1U);
  EXPECT_THAT(progress.long_points()[0], HasSubstr("point 000002"));
  // Were each fit to take a hundred times as long as that bed, all points would be alike.
  write_text(folder / "fit/cost.json",
             R"({"wall_seconds": 1e9, "cpu_seconds": 1, "threads": 1, "host": "here", "finished": "2026-01-01"})");
  progress.learn(folder.path());
  EXPECT_TRUE(progress.long_points().empty());
}

TEST(SweepProgress, NamesNothingWhereAllAreAlike) {
  const Sweep sweep(recipe(R"(["1 s", "1.1 s", "1.2 s"])"));
  SweepProgress progress(sweep.plan, sweep.all(), 1);
  progress.trials([] { return false; });
  EXPECT_TRUE(progress.long_points().empty());
  EXPECT_TRUE(progress.seconds_left());  // before anything ran
}

// Of two points that were expected to take very long, most of the first is done at once.
TEST(SweepProgress, LearnsFromAPointWhileItRuns) {
  const Sweep sweep(recipe(R"(["20000 s", "19999 s"])"));
  SweepProgress progress(sweep.plan, sweep.all(), 1);
  progress.trials([] { return false; });
  ASSERT_TRUE(progress.seconds_left());
  const double expected = *progress.seconds_left();
  EXPECT_GT(expected, 1) << "the sleeps below last 0.04 s";
  progress.begin(0);
  for (const double fraction : {0.0, 0.25, 0.5, 0.75}) {
    progress.reached(0, "bed", fraction);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_LT(*progress.seconds_left(), 0.7 * expected);
}

// The trial is not made for what the user has interrupted.
TEST(SweepProgress, StopsItsTrials) {
  const Sweep sweep(recipe(R"(["1 s", "2 s", "20000 s"])"));
  SweepProgress progress(sweep.plan, sweep.all(), 1);
  progress.trials([] { return true; });
  EXPECT_TRUE(progress.long_points().empty());
  EXPECT_FALSE(progress.seconds_left());
}

TEST(FractionOfPlan, CountsStagesByTheirTimes) {
  const Sweep sweep(recipe(R"(["1 s"])"));
  EXPECT_DOUBLE_EQ(fraction_of_plan(sweep.plan, {3, 1}, 0, 0.5), 0.375);
  EXPECT_DOUBLE_EQ(fraction_of_plan(sweep.plan, {3, 1}, 1, 0.5), 0.875);
  // Without times: the simulation alone.
  EXPECT_DOUBLE_EQ(fraction_of_plan(sweep.plan, {}, 0, 0.5), 0.5);
  EXPECT_DOUBLE_EQ(fraction_of_plan(sweep.plan, {0, 0}, 1, 0.5), 1);
}

// Trials belong to no result: a run with them and one of a point by itself give the same bytes.
TEST(SweepProgress, LeavesNoTraceInTheResults) {
  const ScratchFolder folder;
  write_file(folder / "sweep.json", recipe(R"(["1 s", "1.5 s"])"));
  ASSERT_EQ(run_shakebed({"run", "sweep.json", "--out", "a"}, folder.path()).exit_code, 0);
  std::string alone = recipe(R"(["1 s"])");
  alone = alone.substr(0, alone.find(",\n    \"sweep\"")) + "}";
  write_file(folder / "alone.json", alone);
  ASSERT_EQ(run_shakebed({"run", "alone.json", "--out", "b"}, folder.path()).exit_code, 0);
  for (const char* file : {"observables.json", "profile.csv", "final.extxyz"})
    EXPECT_EQ(read_file(folder / "a/points/000000/bed" / file), read_file(folder / "b/bed" / file)) << file;
}

}  // namespace
}  // namespace shakebed::tests
