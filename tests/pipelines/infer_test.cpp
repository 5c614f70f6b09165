// The search for restitution and friction: several beds at every point, their mean and its error.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <thread>

#include "pipelines/formats/json.hpp"
#include "pipelines/stages/replica_seed.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::Json;
using shakebed::pipelines::read_json;
namespace fs = std::filesystem;

class Infer : public testing::Test {
 protected:
  Infer() {
    write_text(folder_ / "r.json", R"({ "name": "t", "stages": [ { "stage": "infer", "id": "search", "units": "reduced",
  "disks": { "count": 40, "inertia": "sphere" }, "box": { "width": 8, "sides": "hard", "lid": "open" },
  "floor": { "motion": "sinusoidal", "amplitude": 0.8, "frequency": 0.35 },
  "settle": 10, "measure": 30, "phases": 8, "plateau_density": 1.10,
  "target": { "temperature_over_mg": 0.2, "density": 1.0 },
  "grid": { "restitution": [0.5, 0.9], "friction": [0.3], "side_friction": ["none"] } } ] })");
  }
  Json run(const std::string& out, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{"run", "r.json", "--out", out, "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult result = run_shakebed(arguments, folder_.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return read_json(folder_ / (out + "/search/infer.json"));
  }
  ScratchFolder folder_;
};

TEST_F(Infer, TakesTheMeanOfBedsWithSeedsOfTheirOwnAndTheirSpreadAsItsError) {
  const Json together = run("o", {"--set", "/stages/search/replicas=4"});
  ASSERT_EQ(together["points"].size(), 2u);
  for (const char* name : {"temperature_over_mg", "density", "center_of_mass_rise"}) {
    double sum = 0, squares = 0;
    for (std::uint64_t r = 0; r < 4; ++r) {
      const Json alone = run("alone" + std::to_string(r),
                             {"--set", "/stages/search/replicas=1", "--set",
                              "/stages/search/seed=" + std::to_string(shakebed::pipelines::replica_seed(1, r))});
      const double value = alone["points"][0][name]["value"].get<double>();
      sum += value, squares += value * value;
    }
    const double mean = sum / 4, variance = (squares - 4 * mean * mean) / 3;
    const Json& found = together["points"][0][name];
    EXPECT_NEAR(found["value"].get<double>(), mean, 1e-12 * std::abs(mean)) << name;
    EXPECT_NEAR(found["std_error"].get<double>(), std::sqrt(variance / 4), 1e-6 * std::abs(mean)) << name;
    EXPECT_GT(variance, 0) << name << ": the beds are not different ones";
  }
  EXPECT_EQ(together["nearest"], together["points"][0]) << "T is 0.2 for restitution 0.5, 0.6 for 0.9";
  ASSERT_EQ(together["as_near"].size(), 1u) << "the other is farther by tens of errors";
  EXPECT_EQ(together["as_near"][0]["restitution"], 0.5);
}

TEST_F(Infer, DoesNotDependOnThreads) {
  run("a", {"--jobs", "1"});
  run("b", {"--jobs", "3"});
  EXPECT_EQ(read_text(folder_ / "a/search/infer.json"), read_text(folder_ / "b/search/infer.json"));
  EXPECT_EQ(read_text(folder_ / "a/search/infer.csv"), read_text(folder_ / "b/search/infer.csv"));
}

TEST_F(Infer, GoesOnWithTheBedsThatWereFinishedWhenItWasKilled) {
  // A hundred beds; killed when the first few are there.
  const std::vector<std::string> many{"--set", "/stages/search/replicas=50", "--jobs", "1"};
  run("expected", many);
  std::vector<std::string> arguments{"run", "r.json", "--out", "o"};
  arguments.insert(arguments.end(), many.begin(), many.end());
  const auto finished_beds = [&] {
    int count = 0;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / "o/.scratch", error))
      count += entry.path().extension() == ".json";
    return count;
  };
  const int process = start_shakebed(arguments, folder_.path());
  for (int i = 0; i < 60'000 && finished_beds() < 5; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  ::kill(process, SIGKILL);
  ASSERT_EQ(wait_for(process), 128 + SIGKILL) << "it was over before it was killed";
  const int kept = finished_beds();
  ASSERT_GE(kept, 5);
  ASSERT_LT(kept, 100);
  run("o", many);
  EXPECT_EQ(read_text(folder_ / "o/search/infer.json"), read_text(folder_ / "expected/search/infer.json"));
  EXPECT_FALSE(fs::exists(folder_ / "o/.scratch"));
}

}  // namespace
