// A simulation killed in the middle goes on from its last checkpoint and ends with the same bytes as one that was not.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <random>
#include <thread>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
namespace fs = std::filesystem;

// Everything that a checkpoint has to hold: annealing, every observer, frames, spins, contact clocks, a bath's numbers.
std::string bed_recipe(int replicas) {
  return R"({ "name": "resume", "stages": [
    { "stage": "simulate", "id": "bed", "seed": 3, "units": "reduced",
      "disks": { "count": 100, "restitution": 0.9, "friction": 0.1, "contact_duration": 1e-3 },
      "box": { "width": 14.3, "sides": { "kind": "hard", "restitution": 0.9 } },
      "floor": { "motion": "sinusoidal", "amplitude": 0.8, "frequency": 0.35, "restitution": 0.9 },
      "bath": { "kind": "langevin", "temperature": 1, "rate": 0.2, "interval": 0.5 },
      "schedule": [ { "temperature": 3, "ramp": 40, "hold": 100 }, { "temperature": 1, "ramp": 40, "hold": 100 } ],
      "observe": ["order", "velocities", "displacement", "pressure", "phases"],
      "settle": 50, "measure": 400, "frames": { "count": 1000, "phases": 8 }, "checkpoint_seconds": 0.03,
      "replicas": )" +
         std::to_string(replicas) + " } ] }";
}

// Every file of the bed, the trajectory too.
std::map<std::string, std::string> results_of(const fs::path& out) {
  std::map<std::string, std::string> texts;
  for (const fs::directory_entry& entry : fs::directory_iterator(out / "bed")) {
    const std::string name = entry.path().filename().string();
    if (name == "log.txt" || name == "cost.json" || name.starts_with(".")) continue;
    texts[name] = read_text(entry.path());
  }
  return texts;
}

void kill_and_resume(int replicas, std::uint32_t seed) {
  ScratchFolder folder;
  write_text(folder / "r.json", bed_recipe(replicas));
  const ProgramResult undisturbed = run_shakebed({"run", "r.json", "--out", "whole"}, folder.path());
  ASSERT_EQ(undisturbed.exit_code, 0) << undisturbed.err;
  const auto expected = results_of(folder / "whole");
  ASSERT_GE(expected.size(), 14u);

  std::mt19937 random(seed);
  // Of the whole run; the four together are less than all of it, so that the last kill, too, finds it running.
  std::uniform_real_distribution<double> moment(0.1, 0.2);
  int killed = 0;
  for (int i = 0; i < 4; ++i) {
    const int process = start_shakebed({"run", "r.json", "--out", "o"}, folder.path());
    std::this_thread::sleep_for(std::chrono::duration<double>(moment(random) * undisturbed.seconds));
    ::kill(process, SIGKILL);
    if (wait_for(process) != 128 + SIGKILL) break;
    ++killed;
    EXPECT_FALSE(fs::exists(folder / "o/bed"));
  }
  EXPECT_GE(killed, 1) << "the run ended before it could be killed";
  bool checkpoint = false;
  if (fs::exists(folder / "o/.scratch")) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder / "o/.scratch"))
      checkpoint = checkpoint || entry.path().filename() == "checkpoint";
  }
  EXPECT_TRUE(checkpoint || killed < 4) << "there was nothing to go on from";
  const ProgramResult last = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(last.exit_code, 0) << last.err;
  EXPECT_NE(read_text(folder / "o/bed/log.txt").find("continues after"), std::string::npos);
  const auto found = results_of(folder / "o");
  for (const auto& [name, text] : expected)
    EXPECT_TRUE(found.contains(name) && found.at(name) == text) << name << " is another";
  EXPECT_EQ(found.size(), expected.size());
  EXPECT_FALSE(fs::exists(folder / "o/.scratch/bed")) << "what was kept for going on is still there";
  std::printf("killed %d times; %zu files the same\n", killed, expected.size());
}

TEST(Resume, AKilledSimulationEndsWithTheSameBytes) { kill_and_resume(1, 1); }
TEST(Resume, SoDoReplicas) { kill_and_resume(2, 2); }

// What cannot be read is said, and the run starts again from the beginning.
TEST(Resume, ADamagedCheckpointIsNotUsed) {
  ScratchFolder folder;
  write_text(folder / "r.json", bed_recipe(1));
  const ProgramResult undisturbed = run_shakebed({"run", "r.json", "--out", "whole"}, folder.path());
  ASSERT_EQ(undisturbed.exit_code, 0) << undisturbed.err;
  fs::path checkpoint;
  for (int attempt = 0; attempt < 5 && checkpoint.empty(); ++attempt) {
    const int process = start_shakebed({"run", "r.json", "--out", "o"}, folder.path());
    std::this_thread::sleep_for(std::chrono::duration<double>(0.5 * undisturbed.seconds));
    ::kill(process, SIGKILL);
    wait_for(process);
    if (!fs::exists(folder / "o/.scratch")) continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder / "o/.scratch"))
      if (entry.path().filename() == "checkpoint") checkpoint = entry.path();
  }
  ASSERT_FALSE(checkpoint.empty());
  std::string damaged = read_text(checkpoint);
  damaged[damaged.size() / 2] ^= 1;  // one bit
  write_text(checkpoint, damaged);
  const ProgramResult result = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("starts again from the beginning"), std::string::npos) << result.err;
  EXPECT_EQ(results_of(folder / "o"), results_of(folder / "whole"));
}

}  // namespace
