// A sweep killed at random moments: every rerun goes on, and the end is the same as without the kills.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <random>
#include <set>
#include <thread>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
namespace fs = std::filesystem;

constexpr int points = 20;

std::string sweep_recipe() {
  std::string text = small_recipe(
      R"({ "kind": "grid", "over": { "/stages/bed/disks/restitution": { "from": 0.5, "to": 0.95, "count": 20 } },
    "collect": ["/bed/temperature_x", "/fit/temperature"] })");
  text.replace(text.find("\"0.5 s\""), 7, "\"0.1 s\"");
  text.replace(text.find("\"frames\": { \"count\": 8, \"phases\": 8 }"), 37,
               "\"frames\": { \"count\": 2, \"phases\": 4 }");
  return text;
}

void kill_at_random_moments(int kills, std::uint32_t seed) {
  ScratchFolder folder;
  write_text(folder / "r.json", sweep_recipe());
  const ProgramResult undisturbed = run_shakebed({"run", "r.json", "--out", "expected"}, folder.path());
  ASSERT_EQ(undisturbed.exit_code, 0) << undisturbed.err;
  const std::string expected = read_text(folder / "expected" / "sweep.csv");
  ASSERT_EQ(std::count(expected.begin(), expected.end(), '\n'), points + 1);

  std::mt19937 random(seed);
  // Moments spread over the whole of an undisturbed run; a run that was finished starts afresh. When such a run has
  // ended before its moment, a whole run takes no longer than that: the machine has less other work than before.
  double whole_run = undisturbed.seconds;
  bool afresh = true;
  int killed = 0, finished = 0, stale_locks = 0;
  while (killed < kills && finished < 2 * kills) {
    const int process = start_shakebed({"run", "r.json", "--out", "o"}, folder.path());
    const double moment = std::uniform_real_distribution<double>(0, 1.2 * whole_run)(random);
    std::this_thread::sleep_for(std::chrono::duration<double>(moment));
    ::kill(process, SIGKILL);
    const int code = wait_for(process);
    if (code == 128 + SIGKILL) {
      ++killed;
      afresh = false;
      // Nothing half-written under a final name: every stage folder has its record, every JSON can be read.
      std::error_code error;
      if (fs::is_directory(folder / "o/points", error)) {
        for (const fs::directory_entry& point : fs::directory_iterator(folder / "o/points")) {
          for (const char* stage : {"bed", "fit", "check"}) {
            if (fs::exists(point.path() / stage, error)) {
              EXPECT_TRUE(fs::is_regular_file(point.path() / stage / ".record", error)) << point.path() / stage;
            }
          }
          if (fs::exists(point.path() / ".point", error)) {
            EXPECT_NO_THROW(shakebed::pipelines::read_json(point.path() / ".point"));
          }
        }
      }
    } else {
      EXPECT_EQ(code, 0);
      ++finished;
      if (afresh) whole_run = std::min(whole_run, moment);
      afresh = true;
      EXPECT_EQ(read_text(folder / "o/sweep.csv"), expected);
      fs::remove_all(folder / "o");
    }
  }
  const ProgramResult last = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  EXPECT_EQ(last.exit_code, 0) << last.err;
  stale_locks += last.err.find("because another process is running them") != std::string::npos;
  EXPECT_EQ(read_text(folder / "o/sweep.csv"), expected);
  EXPECT_EQ(stale_locks, 0);
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder / "o/points")) {
    const std::string name = entry.path().filename().string();
    EXPECT_FALSE(name.starts_with(".partial") || name.ends_with(".part")) << entry.path();
  }
  std::printf("%d kills in the middle; %d runs besides had ended before theirs; every point once and right\n", killed,
              finished);
  EXPECT_EQ(killed, kills) << "the kills came too late to test anything";
}

TEST(Killed, TwentyTimesAndEveryRerunEndsRight) { kill_at_random_moments(20, 2); }
TEST(KilledStudy, TwoHundredTimesAndEveryRerunEndsRight) { kill_at_random_moments(200, 2); }

// --- sweeps besides kills

class Sweep : public testing::Test {
 protected:
  ProgramResult run(std::vector<std::string> arguments) { return run_shakebed(arguments, folder_.path()); }
  void recipe(const std::string& sweep) {
    std::string text = small_recipe(sweep);
    text.replace(text.find("\"0.5 s\""), 7, "\"0.1 s\"");
    text.replace(text.find("\"frames\": { \"count\": 8, \"phases\": 8 }"), 37,
                 "\"frames\": { \"count\": 2, \"phases\": 4 }");
    write_text(folder_ / "r.json", text);
  }
  std::size_t rows() { return split(read_text(folder_ / "o/sweep.csv")).size() - 1; }
  static std::vector<std::string> split(const std::string& text) {
    std::vector<std::string> lines;
    std::size_t begin = 0;
    while (begin < text.size()) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      lines.push_back(text.substr(begin, end - begin));
      begin = end + 1;
    }
    return lines;
  }
  ScratchFolder folder_;
};

TEST_F(Sweep, GridHasEveryCombination) {
  recipe(
      R"({ "over": { "/stages/bed/disks/restitution": [0.7, 0.8, 0.9], "/stages/bed/floor/amplitude": ["1 mm", "1.5 mm"] } })");
  ASSERT_EQ(run({"run", "r.json", "--out", "o"}).exit_code, 0);
  EXPECT_EQ(rows(), 6u);
  std::set<std::string> pairs;
  for (const std::string& line : split(read_text(folder_ / "o/sweep.csv"))) {
    if (line.starts_with("point")) continue;
    pairs.insert(line.substr(line.find("ok,") + 3, 10));
  }
  EXPECT_EQ(pairs.size(), 6u);
}

TEST_F(Sweep, ZipAndListGoSideBySide) {
  recipe(
      R"({ "kind": "zip", "over": { "/stages/bed/disks/restitution": [0.7, 0.8], "/stages/bed/floor/amplitude": ["1 mm", "1.5 mm"] } })");
  ASSERT_EQ(run({"run", "r.json", "--out", "o"}).exit_code, 0);
  EXPECT_EQ(rows(), 2u);
  const std::string zipped = read_text(folder_ / "o/sweep.csv");
  recipe(
      R"({ "kind": "list", "points": [{ "/stages/bed/disks/restitution": 0.7, "/stages/bed/floor/amplitude": "1 mm" },
    { "/stages/bed/disks/restitution": 0.8, "/stages/bed/floor/amplitude": "1.5 mm" }] })");
  ASSERT_EQ(run({"run", "r.json", "--out", "o"}).exit_code, 0);
  EXPECT_EQ(read_text(folder_ / "o/sweep.csv"), zipped);
  recipe(
      R"({ "kind": "zip", "over": { "/stages/bed/disks/restitution": [0.7, 0.8], "/stages/bed/floor/amplitude": ["1 mm"] } })");
  EXPECT_EQ(run({"validate", "r.json"}).exit_code, 3);
}

TEST_F(Sweep, ReplicasHaveSeedsOfTheirOwnAndTheFirstTheRecipes) {
  recipe(R"({ "over": { "/stages/bed/disks/restitution": [0.8] }, "replicas": 3, "collect": ["/bed/temperature_x"] })");
  ASSERT_EQ(run({"run", "r.json", "--out", "o"}).exit_code, 0);
  const auto lines = split(read_text(folder_ / "o/sweep.csv"));
  ASSERT_EQ(lines.size(), 4u);
  std::set<std::string> values;
  for (std::size_t i = 1; i < lines.size(); ++i) values.insert(lines[i].substr(lines[i].find("0.8,")));
  EXPECT_EQ(values.size(), 3u);
  ASSERT_EQ(run({"run", "r.json", "--out", "again"}).exit_code, 0);
  EXPECT_EQ(read_text(folder_ / "o/sweep.csv"), read_text(folder_ / "again/sweep.csv"));
}

TEST_F(Sweep, ShardsTogetherAreTheWhole) {
  recipe(
      R"({ "kind": "random", "count": 7, "over": { "/stages/bed/disks/restitution": { "from": 0.5, "to": 0.9 } } })");
  ASSERT_EQ(run({"run", "r.json", "--out", "whole"}).exit_code, 0);
  for (const char* shard : {"3/3", "1/3", "2/3"})
    ASSERT_EQ(run({"run", "r.json", "--out", "o", "--shard", shard}).exit_code, 0);
  EXPECT_EQ(read_text(folder_ / "o/sweep.csv"), read_text(folder_ / "whole/sweep.csv"));
  for (const char* shard : {"0/3", "4/3", "1", "a/b", "1/0"})
    EXPECT_EQ(run({"run", "r.json", "--out", "o", "--shard", shard}).exit_code, 2) << shard;
}

TEST_F(Sweep, OnlyWhatChangedRunsAgain) {
  recipe(R"({ "over": { "/stages/bed/disks/restitution": [0.7, 0.8] } })");
  ASSERT_EQ(run({"run", "r.json", "--out", "o"}).exit_code, 0);
  recipe(R"({ "over": { "/stages/bed/disks/restitution": [0.7, 0.8, 0.9] } })");
  const ProgramResult more = run({"run", "r.json", "--out", "o"});
  EXPECT_EQ(more.exit_code, 0);
  EXPECT_NE(more.err.find("3 points, 2 up to date, 1 to run"), std::string::npos) << more.err;
}

TEST_F(Sweep, WhatPointsHaveInCommonRunsOnce) {
  recipe(
      R"({ "over": { "/stages/fit/plateau_density": [0.9, 1.0, 1.1] }, "collect": ["/bed/collisions", "/fit/plateau_density"] })");
  ASSERT_EQ(run({"run", "r.json", "--out", "o"}).exit_code, 0);
  std::set<std::string> beds;
  for (const char* point : {"000000", "000001", "000002"}) {
    const fs::path bed = folder_ / "o/points" / point / "bed";
    EXPECT_TRUE(fs::is_symlink(bed)) << point;
    beds.insert(fs::canonical(bed).string());
    EXPECT_FALSE(fs::is_symlink(bed.parent_path() / "fit")) << point;
  }
  EXPECT_EQ(beds.size(), 1u) << "one simulation for three fits";
  // The same numbers as when each point is a run of its own.
  ASSERT_EQ(run({"run", "o/points/../../r.json", "--out", "o"}).exit_code, 0);
  recipe("");
  ASSERT_EQ(run({"run", "r.json", "--out", "alone", "--set", "/stages/fit/plateau_density=1.0"}).exit_code, 0);
  EXPECT_EQ(read_text(folder_ / "alone/fit/fit.json"), read_text(folder_ / "o/points/000001/fit/fit.json"));
  EXPECT_EQ(read_text(folder_ / "alone/bed/profile.csv"), read_text(folder_ / "o/points/000001/bed/profile.csv"));
}

TEST_F(Sweep, FailedPointsAreReportedAndRetriedAlone) {
  recipe(R"({ "over": { "/stages/bed/disks/restitution": [0.7, 7] } })");
  const ProgramResult refused = run({"run", "r.json", "--out", "o"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_NE(refused.err.find("/stages/0/disks/restitution"), std::string::npos) << refused.err;
  EXPECT_FALSE(fs::exists(folder_ / "o/points")) << "a mistake in any point is found before the first runs";
  // A point that fails while it runs: its folder cannot be written.
  recipe(R"({ "over": { "/stages/bed/disks/restitution": [0.7, 0.8] } })");
  fs::create_directories(folder_ / "o/points");
  write_text(folder_ / "o/points/000001", "a file where a folder must be");
  const ProgramResult failed = run({"run", "r.json", "--out", "o"});
  EXPECT_EQ(failed.exit_code, 5);
  EXPECT_NE(failed.err.find("point 000001"), std::string::npos) << failed.err;
  EXPECT_NE(read_text(folder_ / "o/sweep.csv").find("000001,0,missing"), std::string::npos);
  fs::remove(folder_ / "o/points/000001");
  const ProgramResult retried = run({"run", "r.json", "--out", "o"});
  EXPECT_EQ(retried.exit_code, 0);
  EXPECT_NE(retried.err.find("1 up to date, 1 to run"), std::string::npos) << retried.err;
}

}  // namespace
