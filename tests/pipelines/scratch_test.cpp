// The folder of a stage that outlives its being killed.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>

#include "pipelines/formats/files.hpp"
#include "pipelines/runner/run.hpp"
#include "pipelines/runner/stage_code.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;
using shakebed::tests::ScratchFolder;
namespace fs = std::filesystem;

enum class End { well, error, killed, interrupted };

// Counts its starts in its scratch folder; what it found there is its result.
class Counting : public Stage {
 public:
  explicit Counting(End end) : end_(end) {}
  void describe(Fields&) override {}
  void results(ResultList&) const override {}
  void run(RunContext& context) const override {
    const fs::path file = context.scratch() / "starts";
    std::string starts = fs::exists(file) ? read_file(file) : "";
    starts += "x";
    write_file_atomically(file, starts);
    if (end_ == End::killed) ::raise(SIGKILL);
    if (end_ == End::error) throw StageError("on purpose");
    write_file(context.output("starts.txt"), starts);
    if (end_ == End::interrupted) ::raise(SIGINT);
  }

 private:
  End end_;
};

const StageRow& row() {
  static const StageRow counting{.name = "counting", .summary = "counts its starts"};
  return counting;
}

Plan plan_of(End end, int option, const std::string& id = "count") {
  Plan plan;
  plan.name = "scratch";
  PlannedStage stage;
  stage.id = id;
  stage.row = &row();
  stage.stage = std::make_unique<Counting>(end);
  stage.options = Json{{"option", option}};
  plan.stages.push_back(std::move(stage));
  return plan;
}

// Runs stages of these kinds inside of itself.
class Chained : public Counting {
 public:
  explicit Chained(std::vector<std::string> kinds) : Counting(End::well), kinds_(std::move(kinds)) {}
  std::vector<std::string> chain_kinds() const override { return kinds_; }

 private:
  std::vector<std::string> kinds_;
};

std::string code_with_chain(std::vector<std::string> kinds) {
  Plan plan = plan_of(End::well, 1);
  plan.stages[0].stage = std::make_unique<Chained>(std::move(kinds));
  return code_of(plan.stages[0]);
}

TEST(StageCode, IsKnownOfEveryStage) {
  for (const StageRow& row : stage_table()) EXPECT_EQ(stage_code(row.name).size(), 32u) << row.name;
  EXPECT_EQ(stage_code("counting"), "");
}

TEST(StageCode, HoldsThatOfTheStagesInside) {
  EXPECT_NE(code_with_chain({"fit"}), code_with_chain({"simulate"}));
  EXPECT_NE(code_with_chain({"fit"}), code_with_chain({"fit", "simulate"}));
  EXPECT_EQ(code_with_chain({"simulate", "fit"}), code_with_chain({"fit", "simulate", "fit"}));
}

class Scratch : public testing::Test {
 protected:
  ExitCode run(End end, int option, bool force = false, const std::string& id = "count") {
    RunOptions options;
    options.out = folder_.path();
    options.force = force;
    RunOutcome outcome;
    outcome.out = options.out;
    run_stages(plan_of(end, option, id), options, nullptr, outcome);
    return outcome.code;
  }
  // What waitpid() says of it: an interrupt stays on record in its process.
  int status_of_run_in_a_child(End end, int option) {
    const pid_t child = ::fork();
    if (child == 0) {
      install_interrupt_handler();
      ::_exit(run(end, option));
    }
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    return status;
  }
  void run_and_be_killed(int option) {
    const int status = status_of_run_in_a_child(End::killed, option);
    ASSERT_TRUE(WIFSIGNALED(status)) << status;
  }
  std::string starts(const std::string& id = "count") { return read_file(folder_ / (id + "/starts.txt")); }
  ScratchFolder folder_;
};

TEST_F(Scratch, OutlivesAKillAndAnErrorAndGoesWhenTheStageHasFinished) {
  run_and_be_killed(1);
  remove_leftovers(folder_.path());  // as the next run does
  EXPECT_EQ(run(End::error, 1), exit_stage_failed);
  run_and_be_killed(1);
  remove_leftovers(folder_.path());
  EXPECT_EQ(run(End::well, 1), exit_ok);
  EXPECT_EQ(starts(), "xxxx") << "three starts that did not end, and this one";
  EXPECT_FALSE(fs::exists(folder_ / std::string(scratch_name)));
}

TEST_F(Scratch, BelongsToOneWorkOnly) {
  run_and_be_killed(1);
  EXPECT_EQ(run(End::error, 1, false, "other"), exit_stage_failed);
  EXPECT_EQ(run(End::well, 2), exit_ok);
  EXPECT_EQ(starts(), "x") << "other options: nothing of the first";
  EXPECT_EQ(run(End::well, 1, false, "other"), exit_ok);
  EXPECT_EQ(starts("other"), "xx") << "another stage keeps its own";
  EXPECT_FALSE(fs::exists(folder_ / std::string(scratch_name)));
}

TEST_F(Scratch, OptionsTriedInBetweenDoNotCostIt) {
  run_and_be_killed(1);
  run_and_be_killed(2);
  EXPECT_EQ(run(End::well, 1), exit_ok);
  EXPECT_EQ(starts(), "xx");
}

// Ctrl-C after a stage has last looked for it: what it wrote is not taken for its result.
TEST_F(Scratch, OutlivesAnInterruptInTheLastMoment) {
  const int status = status_of_run_in_a_child(End::interrupted, 1);
  ASSERT_TRUE(WIFEXITED(status)) << status;
  EXPECT_EQ(WEXITSTATUS(status), exit_interrupted);
  EXPECT_FALSE(fs::exists(folder_ / "count"));
  EXPECT_EQ(run(End::well, 1), exit_ok);
  EXPECT_EQ(starts(), "xx");
}

TEST_F(Scratch, ForceBeginsAfresh) {
  run_and_be_killed(1);
  EXPECT_EQ(run(End::well, 1, true), exit_ok);
  EXPECT_EQ(starts(), "x");
}

TEST_F(Scratch, LeftBehindByAFinishedStageIsTidiedUp) {
  EXPECT_EQ(run(End::well, 1), exit_ok);
  Plan plan = plan_of(End::well, 1);
  const fs::path place = scratch_folder(folder_.path(), fresh_record(plan.stages[0], {}));
  fs::create_directories(place);
  EXPECT_EQ(run(End::well, 1), exit_ok);
  EXPECT_FALSE(fs::exists(place));
}

}  // namespace
