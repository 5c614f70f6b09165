// The posterior of a small bed: the same for any number of threads and after a kill; mistakes are found before it runs.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/infer_recipe.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::Json;
using shakebed::pipelines::read_json;
namespace fs = std::filesystem;

class Infer : public testing::Test {
 protected:
  Infer() { write_text(folder_ / "r.json", infer_recipe); }  // long enough to be killed before it is over
  ProgramResult run(const std::string& out, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"run", "r.json", "--out", out, "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_shakebed(arguments, folder_.path());
  }
  std::vector<fs::path> finished_beds() const {
    std::vector<fs::path> files;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / "o/.scratch", error))
      if (entry.path().extension() == ".json") files.push_back(entry.path());
    return files;
  }
  void kill_after_beds(std::size_t beds) {
    const int process = start_shakebed({"run", "r.json", "--out", "o", "--jobs", "1"}, folder_.path());
    for (int i = 0; i < 60'000 && finished_beds().size() < beds; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ::kill(process, SIGKILL);
    ASSERT_EQ(wait_for(process), 128 + SIGKILL) << "it was over before it was killed";
    ASSERT_GE(finished_beds().size(), beds);
  }
  ScratchFolder folder_;
};

TEST_F(Infer, DoesNotDependOnThreads) {
  write_text(folder_ / "r.json", brief_infer_recipe());  // what is compared are runs with one another
  ASSERT_EQ(run("a", {"--jobs", "1"}).exit_code, 0);
  ASSERT_EQ(run("b", {"--jobs", "3"}).exit_code, 0);
  for (const char* file : {"infer.json", "beds.csv", "posterior.csv", "marginals.csv", "best.csv", "beds.json"})
    EXPECT_EQ(read_text(folder_ / "a/search" / file), read_text(folder_ / "b/search" / file)) << file;
}

TEST_F(Infer, GoesOnWithTheBedsThatWereFinishedWhenItWasKilled) {
  ASSERT_EQ(run("expected").exit_code, 0);
  kill_after_beds(5);
  ASSERT_EQ(run("o").exit_code, 0);
  EXPECT_EQ(read_text(folder_ / "o/search/infer.json"), read_text(folder_ / "expected/search/infer.json"));
  EXPECT_FALSE(fs::exists(folder_ / "o/.scratch"));
}

// Beds without numbers, as a bed that is given up leaves them, in place of two that were finished.
TEST_F(Infer, SaysHowManyBedsGaveNoNumbers) {
  kill_after_beds(5);
  const std::vector<fs::path> beds = finished_beds();
  for (std::size_t i = 0; i < 2; ++i) {
    Json of_bed = Json::parse(read_text(beds[i]));
    for (auto& number : of_bed) number = nullptr;
    write_text(beds[i], of_bed.dump());
  }
  const ProgramResult result = run("o");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("2 of 30 beds were stopped because they made too many contacts"), std::string::npos)
      << result.err;
}

// Round steps of 1, 2 or 5, of which at least three make up the range: 3 to 9 and 0.5 to 0.9.
TEST_F(Infer, DividesTheAxesOfItsPairsByRoundSteps) {
  std::vector<std::string> smaller;
  for (const char* change : {"first=20", "rounds=0", "draws=100", "settle=5", "measure=20", "best=0", "calibration=0",
                             "parameters/gamma/high=9"}) {
    smaller.push_back("--set");
    smaller.push_back(std::string("/stages/search/") + change);
  }
  ASSERT_EQ(run("o", smaller).exit_code, 0);
  const std::string script = read_text(folder_ / "o/search/pairs.gp");
  EXPECT_NE(script.find("set xrange [3:9]\nset xtics 2\n"), std::string::npos) << script;
  EXPECT_NE(script.find("set yrange [0.5:0.9]\nset ytics 0.1\n"), std::string::npos) << script;
}

TEST_F(Infer, RefusesWhatMakesNoSense) {
  const auto refused = [&](const std::string& change, const std::string& words) {
    const ProgramResult result = run("wrong", {"--set", change});
    EXPECT_EQ(result.exit_code, 3) << change;
    EXPECT_NE(result.err.find(words), std::string::npos) << result.err;
  };
  refused("/stages/search/parameters/gamma/set=[\"/flor/gamma\"]", "is not an option of the scene");
  refused("/stages/search/parameters/gamma/high=1", "\"low\" below \"high\"");
  refused("/stages/search/parameters/restitution/high=1.5", "restitution");
  refused("/stages/search/first=10", "need at least 16 beds");
  refused("/stages/search/moments=3", "must be a multiple of");
  refused("/stages/search/targets={}", "no target has a value");
  refused("/stages/search/stored=\"nowhere\"", "no file of stored beds");
}

}  // namespace
