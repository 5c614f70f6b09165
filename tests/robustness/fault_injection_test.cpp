// Full disks, short and interrupted calls, files that cannot be read or vanish, too little memory, signals, clocks that
// jump: each run ends with the right exit code and a sentence, what was finished before is still there, and the next
// run, left in peace, ends with the same files as one that was never disturbed.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <set>
#include <thread>

#include "tests/pipelines/program.hpp"
#include "tests/robustness/limit.hpp"

namespace {

using namespace shakebed::tests;
namespace fs = std::filesystem;

// An environment variable for the programs started while this lives.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) { ::setenv(name, value.c_str(), 1); }
  ~Variable() { ::unsetenv(name_); }
  Variable(const Variable&) = delete;

 private:
  const char* name_;
};
struct Shim : Variable {
  Shim() : Variable("LD_PRELOAD", SHAKEBED_FAULTS) {}
};

// simulate, fit, figure, check: text files, a compressed trajectory, gnuplot.
std::string recipe() {
  std::string text = small_recipe();
  text.replace(text.find("{ \"stage\": \"check\""), 0,
               "{ \"stage\": \"figure\", \"from\": [\"bed\", \"fit\"] },\n    ");
  return text;
}

class Faults : public testing::Test {
 protected:
  void SetUp() override {
    write_text(folder_ / "r.json", recipe());
    const ProgramResult result = run_shakebed({"run", "r.json", "--out", "expected"}, folder_.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  ProgramResult run() { return run_shakebed({"run", "r.json", "--out", "o"}, folder_.path()); }

  // What must hold after any end.
  void expect_nothing_broken(const ProgramResult& result, const std::set<int>& codes) {
    EXPECT_TRUE(codes.contains(result.exit_code)) << "exit code " << result.exit_code << "\n" << result.err;
    EXPECT_EQ(result.err.find("terminate called"), std::string::npos) << result.err;
    EXPECT_TRUE(result.exit_code == 0 || result.err.find("error") != std::string::npos)
        << "no sentence: " << result.err;
    std::error_code error;
    if (!fs::is_directory(folder_ / "o", error)) return;
    for (const char* stage : {"bed", "fit", "figure", "check"}) {
      const fs::path place = folder_ / "o" / stage;
      if (!fs::exists(place, error)) continue;
      EXPECT_TRUE(fs::is_regular_file(place / ".record", error)) << stage << " is half there";
    }
  }
  // The stages that are finished in o, and when their records were written.
  std::set<std::pair<std::string, fs::file_time_type>> finished() {
    std::set<std::pair<std::string, fs::file_time_type>> found;
    std::error_code error;
    for (const char* stage : {"bed", "fit", "figure", "check"}) {
      const fs::path record = folder_ / "o" / stage / ".record";
      if (fs::is_regular_file(record, error)) found.emplace(stage, fs::last_write_time(record));
    }
    return found;
  }
  // Left in peace, the run ends as the undisturbed one did, and what was finished is not made again.
  void expect_goes_on() {
    const auto before = finished();
    const ProgramResult result = run();
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const auto after = finished();
    for (const auto& stage : before) EXPECT_TRUE(after.contains(stage)) << stage.first << " was finished, and lost";
    for (const char* file : {"bed/profile.csv", "bed/trajectory.extxyz.zst", "fit/fit.json", "figure/profile.dat"})
      EXPECT_EQ(read_text(folder_ / "o" / file), read_text(folder_ / "expected" / file)) << file;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / "o")) {
      const std::string name = entry.path().filename().string();
      EXPECT_FALSE(name.starts_with(".partial") || name.ends_with(".part")) << entry.path();
    }
    EXPECT_EQ(run_shakebed({"verify", "o"}, folder_.path()).exit_code, 0);
  }
  ScratchFolder folder_;
};

TEST_F(Faults, DiskIsFullFromAnyWriteOn) {
  int failed = 0;
  for (int write = 1; write <= 40; write += write < 16 ? 1 : 4) {
    fs::remove_all(folder_ / "o");
    ProgramResult result;
    {
      const Shim shim;
      const Variable fault("SHAKEBED_FAULT_WRITE", std::to_string(write));
      result = run();
    }
    SCOPED_TRACE("disk full from write " + std::to_string(write));
    expect_nothing_broken(result, {0, 5});
    failed += result.exit_code == 5;
    expect_goes_on();
  }
  EXPECT_GT(failed, 10) << "the shim does nothing";
}

TEST_F(Faults, FilesMayNotGrowBeyondALimit) {
  // The C library's own streams included. The signal that comes with the limit is ignored, as most shells have it not.
  const auto before = ::signal(SIGXFSZ, SIG_IGN);
  int failed = 0;
  for (const rlim_t bytes : {0u, 100u, 700u, 3000u, 10'000u, 30'000u}) {
    fs::remove_all(folder_ / "o");
    ProgramResult result;
    {
      const Limit limit(RLIMIT_FSIZE, bytes);
      result = run();
    }
    SCOPED_TRACE("files of at most " + std::to_string(bytes) + " bytes");
    if (result.err.size() >= bytes && result.exit_code != 0)
      result.err += "error (its own stderr is a file of that limit)";
    expect_nothing_broken(result, {0, 5});
    failed += result.exit_code == 5;
    expect_goes_on();
  }
  ::signal(SIGXFSZ, before);
  EXPECT_GE(failed, 4);
}

TEST_F(Faults, SmallDiskIsFull) {
  // A real file system of a few pages, where the kernel allows one to be mounted.
  const auto in_small_disk = [&](int kilobytes) {
    return "unshare -rm sh -c 'mount -t tmpfs -o size=" + std::to_string(kilobytes) +
           "k none small && cd small && exec " + SHAKEBED_PROGRAM + " run ../r.json --out o' > out.txt 2> err.txt";
  };
  const std::string enter = "cd '" + folder_.path().string() + "' && mkdir -p small && ";
  if (std::system((enter + "unshare -rm sh -c 'mount -t tmpfs -o size=64k none small' 2> /dev/null").c_str()) != 0)
    GTEST_SKIP() << "no file system may be mounted here";
  int failed = 0;
  for (const int kilobytes : {4, 8, 16, 24, 32, 48, 64, 96}) {
    const int status = std::system((enter + in_small_disk(kilobytes)).c_str());
    ASSERT_TRUE(WIFEXITED(status));
    const int code = WEXITSTATUS(status);
    const std::string err = read_text(folder_ / "err.txt");
    EXPECT_TRUE(code == 0 || code == 5) << kilobytes << " kB: " << code << " " << err;
    if (code == 5) {
      ++failed;
      EXPECT_NE(err.find("No space left"), std::string::npos) << err;
    }
  }
  EXPECT_GE(failed, 4);
}

TEST_F(Faults, FolderThatMayOnlyBeRead) {
  const auto run_read_only = [&](const fs::path& folder, const char* name) {
    const Shim shim;
    const Variable fault("SHAKEBED_FAULT_READONLY", folder.string());
    return run_shakebed({"run", name, "--out", "o"}, folder_.path());
  };
  const auto files = [&] {
    std::set<std::pair<std::string, std::string>> found;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / "o"))
      if (entry.is_regular_file()) found.emplace(entry.path().string(), read_text(entry.path()));
    return found;
  };
  const auto expect_said = [](const ProgramResult& result) {
    EXPECT_EQ(result.exit_code, 5);
    EXPECT_NE(result.err.find("Read-only file system"), std::string::npos) << result.err;
    EXPECT_EQ(result.err.find("terminate called"), std::string::npos) << result.err;
  };
  // Where OUT is to be made.
  expect_said(run_read_only(folder_.path(), "r.json"));
  EXPECT_FALSE(fs::exists(folder_ / "o"));
  // OUT with finished stages: another seed would make all of them again.
  ASSERT_EQ(run().exit_code, 0);
  const auto before = files();
  std::string other = recipe();
  const std::string seed = "\"seed\": 7";
  other.replace(other.find(seed), seed.size(), "\"seed\": 8");
  write_text(folder_ / "other.json", other);
  expect_said(run_read_only(folder_ / "o", "other.json"));
  EXPECT_EQ(files(), before);
  // One stage's folder alone.
  expect_said(run_read_only(folder_ / "o" / "bed", "other.json"));
  EXPECT_EQ(read_text(folder_ / "o/bed/profile.csv"), read_text(folder_ / "expected/bed/profile.csv"));
  EXPECT_EQ(run_shakebed({"verify", "o"}, folder_.path()).exit_code, 0);
  expect_goes_on();
}

TEST_F(Faults, StdoutIsFull) {
  for (const char* arguments :
       {"theory --json", "audit", "map --gamma 4 --frequency 20 --diameter 3e-3 --initial-height 10", "schema"}) {
    const int status =
        std::system((std::string(SHAKEBED_PROGRAM) + " " + arguments + " > /dev/full 2> /dev/null").c_str());
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 5) << arguments << " ended with " << status;
  }
}

TEST_F(Faults, WritesAreShortAndCallsInterrupted) {
  for (const char* fault : {"SHAKEBED_FAULT_SHORT", "SHAKEBED_FAULT_EINTR"}) {
    fs::remove_all(folder_ / "o");
    ProgramResult result;
    {
      const Shim shim;
      const Variable set(fault, fault == std::string("SHAKEBED_FAULT_SHORT") ? "1" : "2");
      result = run();
    }
    SCOPED_TRACE(fault);
    // Neither is an error: what is not done is done again.
    expect_nothing_broken(result, {0});
    expect_goes_on();
  }
}

TEST_F(Faults, TheClockJumps) {
  ProgramResult result;
  {
    const Shim shim;
    const Variable set("SHAKEBED_FAULT_CLOCK", "1");
    result = run();
    expect_nothing_broken(result, {0});
    // Nothing is made again because of what a clock says.
    const auto before = finished();
    EXPECT_EQ(run().exit_code, 0);
    EXPECT_EQ(finished(), before);
  }
  expect_goes_on();
}

TEST_F(Faults, MemoryIsShort) {
  // Below some 22 MB not even the program's libraries can be loaded and set up; from there on every amount gives an end
  // of ours.
  int failed = 0, started = 0;
  std::string text = recipe();
  text.replace(text.find("\"count\": 40"), 11, "\"count\": 8000");
  text.replace(text.find("\"30 mm\""), 7, "\"6 m\"");
  text.replace(text.find("\"0.2 s\""), 7, "0");
  text.replace(text.find("\"0.5 s\""), 7, "\"0.05 s\"");
  write_text(folder_ / "large.json", text);
  for (const rlim_t megabytes : {24u, 28u, 32u, 40u, 64u}) {
    fs::remove_all(folder_ / "m");
    ProgramResult result;
    {
      const Limit limit(RLIMIT_AS, megabytes << 20);
      result = run_shakebed({"run", "large.json", "--out", "m"}, folder_.path());
    }
    if (result.err.find("error while loading shared libraries") != std::string::npos || result.exit_code == 127)
      continue;
    ++started;
    EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 5)
        << megabytes << " MB: " << result.exit_code << " " << result.err;
    EXPECT_EQ(result.err.find("terminate called"), std::string::npos) << result.err;
    if (result.exit_code == 5) {
      ++failed;
      EXPECT_NE(result.err.find("memory"), std::string::npos) << result.err;
    }
  }
  EXPECT_GE(started, 3);
  EXPECT_GE(failed, 1) << "memory was never short";
}

TEST_F(Faults, FilesThatCannotBeRead) {
  const auto profile = [&](const char* path) { return run_shakebed({"fit-profile", path}, folder_.path()); };
  fs::create_directory(folder_ / "folder.csv");
  EXPECT_EQ(profile("folder.csv").exit_code, 4);
  EXPECT_EQ(profile("nowhere.csv").exit_code, 4);
  fs::create_symlink("loop.csv", folder_ / "loop.csv");
  EXPECT_EQ(profile("loop.csv").exit_code, 4);
  EXPECT_EQ(profile((std::string(300, 'x') + ".csv").c_str()).exit_code, 4);
  if (::geteuid() != 0) {
    write_text(folder_ / "secret.csv", "height,number_density\n0,1\n");
    fs::permissions(folder_ / "secret.csv", fs::perms::none);
    EXPECT_EQ(profile("secret.csv").exit_code, 4);
  }
  // A folder where a trajectory is expected.
  fs::create_directory(folder_ / "folder.extxyz");
  std::string text = recipe();
  text.replace(text.find("\"settle\""), 8, "\"start\": {\"kind\": \"file\", \"file\": \"folder.extxyz\"}, \"settle\"");
  write_text(folder_ / "start.json", text);
  EXPECT_EQ(run_shakebed({"validate", "start.json"}, folder_.path()).exit_code, 4);
  // OUT cannot be made: a file is in the way.
  write_text(folder_ / "file", "");
  const ProgramResult result = run_shakebed({"run", "r.json", "--out", "file/o"}, folder_.path());
  EXPECT_EQ(result.exit_code, 5) << result.err;
}

TEST_F(Faults, ResultsVanishOrAreDamagedBetweenRuns) {
  for (const char* file : {"bed/profile.csv", "bed/.record", "bed/bed.json", "fit/fit.json", "figure/profile.svg"}) {
    for (const bool vanish : {true, false}) {
      ASSERT_EQ(run().exit_code, 0);
      if (vanish)
        fs::remove(folder_ / "o" / file);
      else
        write_text(folder_ / "o" / file, "{ \"damaged\": ");
      const ProgramResult result = run();
      EXPECT_EQ(result.exit_code, 0) << file << " " << result.err;
      for (const char* made : {"bed/profile.csv", "fit/fit.json", "figure/profile.dat"})
        EXPECT_EQ(read_text(folder_ / "o" / made), read_text(folder_ / "expected" / made)) << made << " after " << file;
    }
  }
}

TEST_F(Faults, ResultsVanishWhileARunReadsThem) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> moment(0, 0.15);
  for (int i = 0; i < 12; ++i) {
    fs::remove_all(folder_ / "o");
    const int process = start_shakebed({"run", "r.json", "--out", "o"}, folder_.path());
    std::this_thread::sleep_for(std::chrono::duration<double>(moment(random)));
    std::error_code error;
    fs::remove_all(folder_ / "o" / "bed", error);
    const int code = wait_for(process);
    EXPECT_TRUE(code == 0 || code == 4 || code == 5) << code;
    const ProgramResult result = run();
    EXPECT_EQ(result.exit_code, 0) << result.err;
    expect_goes_on();
  }
}

TEST_F(Faults, SignalsAtAnyMoment) {
  std::string text = recipe();
  text.replace(text.find("\"0.5 s\""), 7, "\"5 s\"");
  write_text(folder_ / "r.json", text);
  fs::remove_all(folder_ / "expected");
  const ProgramResult expected = run_shakebed({"run", "r.json", "--out", "expected"}, folder_.path());
  ASSERT_EQ(expected.exit_code, 0) << expected.err;
  std::mt19937 random(9);
  std::uniform_real_distribution<double> moment(0, expected.seconds);
  int stopped = 0;
  for (int i = 0; i < 18; ++i) {
    const int signal = i % 3 == 0 ? SIGINT : i % 3 == 1 ? SIGTERM : SIGKILL;
    const int process = start_shakebed({"run", "r.json", "--out", "o"}, folder_.path(), folder_ / "err");
    std::this_thread::sleep_for(std::chrono::duration<double>(moment(random)));
    ::kill(process, signal);
    const auto sent = std::chrono::steady_clock::now();
    const int code = wait_for(process);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - sent).count();
    // Before the handler is there, a signal ends the program as it ends any other.
    EXPECT_TRUE(code == 0 || code == 128 + signal || (signal != SIGKILL && code == 130))
        << "signal " << signal << ": " << code << "\n"
        << read_text(folder_ / "err");
    EXPECT_LT(seconds, 60) << "did not stop";
    stopped += code != 0;
    if (i % 6 == 5) expect_goes_on();
    if (i % 6 == 5 || code == 0) fs::remove_all(folder_ / "o");  // else the next one would find all of it done
  }
  EXPECT_GT(stopped, 6) << "the signals came too late";
}

// A picture is overwritten while it is read, and its time of writing put back: as many bytes, as old as before. The
// clock is ahead, for files touched within the last two seconds are read twice in any case.
TEST(ExternalFiles, AFrameThatChangesWhileItIsReadIsNoticed) {
  const ScratchFolder folder;
  write_text(folder / "r.json", R"({ "name": "camera", "stages": [
    { "stage": "simulate", "id": "bed", "seed": 3, "replicas": 1, "disks": { "count": 40, "diameter": "3 mm", "restitution": 0.9 },
      "gravity": "9.81 m/s^2", "box": { "width": "30 mm", "sides": { "kind": "hard", "restitution": 0.9 } },
      "floor": { "motion": "sinusoidal", "amplitude": "1.5 mm", "frequency": "20 Hz", "restitution": 0.9 },
      "settle": "0.2 s", "measure": "0.5 s", "frames": { "count": 6, "phases": 3 } },
    { "stage": "render", "from": "bed", "scale": "0.25 mm/px" } ] })");
  const ProgramResult photographed = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(photographed.exit_code, 0) << photographed.err;
  fs::copy(folder / "o/render/frames", folder / "frames");
  const fs::path frame = folder / "frames/000003.png";
  const std::string whole = read_text(frame);
  const auto written = fs::last_write_time(frame);
  std::atomic<bool> over{false};
  const auto is_read = [&] {
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder / "mine", error)) {
      if (entry.path().filename().string().starts_with(".partial-extract")) return true;
    }
    return false;
  };
  std::thread other([&] {
    while (!over && !is_read()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    std::string changed = whole;
    changed.back() = static_cast<char>(changed.back() ^ 1);
    write_text(frame, changed);
    fs::last_write_time(frame, written);
  });
  const std::vector<std::string> measure{"fit-images", "frames",  "--diameter", "3 mm",
                                         "--until",    "extract", "--out",      "mine"};
  ProgramResult disturbed;
  {
    const Shim shim;
    const Variable ahead("SHAKEBED_FAULT_CLOCK_AHEAD", "10");
    disturbed = run_shakebed(measure, folder.path());
  }
  over = true;
  other.join();
  EXPECT_EQ(disturbed.exit_code, 5) << disturbed.err;
  EXPECT_NE(disturbed.err.find("000003.png: this file changed while the stage read it"), std::string::npos)
      << disturbed.err;
  EXPECT_FALSE(fs::exists(folder / "mine/extract"));
  write_text(frame, whole);
  const ProgramResult again = run_shakebed(measure, folder.path());
  EXPECT_EQ(again.exit_code, 0) << again.err;
}

}  // namespace
