// The stages that draw and read pictures on a bad day: files that may not grow, frames that are damaged, vanish or may
// not be read, too little memory, signals. Each run ends with the right exit code and a sentence; what was finished
// stays; left in peace, the next run ends with the same files as one that was never disturbed.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <random>
#include <thread>

#include "tests/pipelines/program.hpp"
#include "tests/robustness/limit.hpp"

namespace {

using namespace shakebed::tests;
namespace fs = std::filesystem;

// A bed of 40 disks, photographed and found again: half a second of CPU.
std::string image_recipe(const std::string& scale = "0.25 mm/px") {
  return R"({ "name": "camera", "stages": [
    { "stage": "simulate", "id": "bed", "seed": 3, "replicas": 1, "disks": { "count": 40, "diameter": "3 mm", "restitution": 0.9 },
      "gravity": "9.81 m/s^2", "box": { "width": "30 mm", "sides": { "kind": "hard", "restitution": 0.9 } },
      "floor": { "motion": "sinusoidal", "amplitude": "1.5 mm", "frequency": "20 Hz", "restitution": 0.9 },
      "settle": "0.2 s", "measure": "0.5 s", "frames": { "count": 6, "phases": 3 } },
    { "stage": "render", "from": "bed", "scale": ")" +
         scale + R"(" },
    { "stage": "extract", "from": "render", "diameter": "3 mm" } ] })";
}

class ImageFaults : public testing::Test {
 protected:
  void SetUp() override {
    write_text(folder_ / "r.json", image_recipe());
    const ProgramResult result = run("expected");
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  ProgramResult run(const char* out) { return run_shakebed({"run", "r.json", "--out", out}, folder_.path()); }
  // As after a run that ended after the simulation, or after the photographs.
  void start_from(std::initializer_list<const char*> finished) {
    fs::remove_all(folder_ / "o");
    fs::create_directories(folder_ / "o");
    for (const char* stage : finished)
      fs::copy(folder_ / "expected" / stage, folder_ / "o" / stage, fs::copy_options::recursive);
  }
  void expect_nothing_broken(const ProgramResult& result, bool may_end_well) {
    EXPECT_TRUE(result.exit_code == 5 || (may_end_well && result.exit_code == 0))
        << "exit code " << result.exit_code << "\n"
        << result.err;
    EXPECT_EQ(result.err.find("terminate called"), std::string::npos) << result.err;
    EXPECT_TRUE(result.exit_code == 0 || result.err.find("error: ") != std::string::npos) << result.err;
    expect_whole_stages();
  }
  void expect_whole_stages() {
    std::error_code error;
    for (const char* stage : {"bed", "render", "extract"}) {
      const fs::path place = folder_ / "o" / stage;
      if (!fs::exists(place, error)) continue;
      EXPECT_TRUE(fs::is_regular_file(place / ".record", error)) << stage << " is half there";
    }
  }
  std::map<std::string, fs::file_time_type> finished() {
    std::map<std::string, fs::file_time_type> found;
    std::error_code error;
    for (const char* stage : {"bed", "render", "extract"}) {
      const fs::path file = folder_ / "o" / stage / ".record";
      if (fs::is_regular_file(file, error)) found.emplace(stage, fs::last_write_time(file));
    }
    return found;
  }
  void expect_goes_on() {
    const auto before = finished();
    const ProgramResult result = run("o");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    for (const auto& [stage, when] : before) {
      EXPECT_NE(result.err.find(stage + ": up to date"), std::string::npos) << stage << " was lost\n" << result.err;
    }
    for (const char* file : {"bed/profile.csv", "render/truth.csv", "render/frames/000003.png", "extract/disks.csv",
                             "extract/profile.csv"})
      EXPECT_EQ(read_text(folder_ / "o" / file), read_text(folder_ / "expected" / file)) << file;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / "o")) {
      const std::string name = entry.path().filename().string();
      EXPECT_TRUE(!name.starts_with(".partial") && name.find(".part") == std::string::npos) << entry.path();
    }
    EXPECT_EQ(run_shakebed({"verify", "o"}, folder_.path()).exit_code, 0);
  }
  ScratchFolder folder_;
};

TEST_F(ImageFaults, FilesMayNotGrowBeyondALimit) {
  const auto before = ::signal(SIGXFSZ, SIG_IGN);  // as a full disk: the write fails, no signal
  int render_failed = 0, extract_failed = 0;
  for (const rlim_t bytes : {6'000U, 8'000U, 10'000U, 14'000U, 50'000U, 150'000U}) {
    start_from({"bed"});
    ProgramResult result;
    {
      const Limit limit(RLIMIT_FSIZE, bytes);
      result = run("o");
    }
    SCOPED_TRACE("files of at most " + std::to_string(bytes) + " bytes");
    expect_nothing_broken(result, false);
    render_failed += !fs::exists(folder_ / "o/render");
    extract_failed += fs::exists(folder_ / "o/render") && !fs::exists(folder_ / "o/extract");
    expect_goes_on();
  }
  ::signal(SIGXFSZ, before);
  EXPECT_GE(render_failed, 1);
  EXPECT_GE(extract_failed, 1);
}

TEST_F(ImageFaults, SmallDiskIsFull) {
  // A real file system of a few pages, where the kernel allows one to be mounted.
  const std::string enter = "cd '" + folder_.path().string() + "' && mkdir -p small && ";
  const auto inside = [](int kilobytes, const std::string& command) {
    return "unshare -rm sh -c 'mount -t tmpfs -o size=" + std::to_string(kilobytes) + "k none small && " + command +
           "' > out.txt 2> err.txt";
  };
  if (std::system((enter + inside(64, "true")).c_str()) != 0) GTEST_SKIP() << "no file system may be mounted here";
  int failed = 0;
  for (const int kilobytes : {220, 300, 400, 500}) {
    const int status = std::system(
        (enter + inside(kilobytes, std::string("cd small && exec ") + SHAKEBED_PROGRAM + " run ../r.json --out o"))
            .c_str());
    ASSERT_TRUE(WIFEXITED(status));
    const std::string err = read_text(folder_ / "err.txt");
    EXPECT_EQ(WEXITSTATUS(status), 5) << kilobytes << " kB: " << err;
    failed += err.find("render (render)") != std::string::npos || err.find("extract (extract)") != std::string::npos;
    EXPECT_NE(err.find("No space left"), std::string::npos) << err;
  }
  EXPECT_GE(failed, 3) << "the disk was full for other stages only";
}

TEST_F(ImageFaults, DamagedFramesAreNamed) {
  const fs::path frame = folder_ / "frames" / "000003.png";
  const auto expect_named = [&](const char* damage) {
    const ProgramResult result = run_shakebed(
        {"fit-images", "frames", "--diameter", "3 mm", "--until", "extract", "--out", "mine"}, folder_.path());
    // The other five are enough for a profile; the report counts what is missing.
    EXPECT_EQ(result.exit_code, 0) << damage << ": " << result.err;
    EXPECT_NE(result.err.find("warning: extract: 1 of 6 frames could not be used"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find("frame 3 (000003.png): "), std::string::npos) << damage << ": " << result.err;
  };
  const auto afresh = [&] {
    fs::remove_all(folder_ / "frames");
    fs::copy(folder_ / "expected/render/frames", folder_ / "frames");
  };
  afresh();
  const std::string whole = read_text(frame);
  for (const std::size_t size : {std::size_t{0}, std::size_t{20}, whole.size() / 2}) {
    write_text(frame, whole.substr(0, size));
    expect_named("cut short");
  }
  write_text(frame, std::string(whole.size(), 'x'));
  expect_named("not a picture");
  fs::remove(frame);
  fs::create_symlink("nowhere.png", frame);
  const ProgramResult dangling =
      run_shakebed({"fit-images", "frames/000003.png", "--diameter", "3 mm", "--out", "mine"}, folder_.path());
  EXPECT_EQ(dangling.exit_code, 4) << dangling.err;
  EXPECT_NE(dangling.err.find("000003.png"), std::string::npos) << dangling.err;
}

TEST_F(ImageFaults, WhatMayNotBeReadOrWrittenIsNamed) {
  // The administrator may read everything: without that right for him, too.
  const std::string program = (::geteuid() == 0 ? std::string("setpriv --inh-caps=-dac_override,-dac_read_search "
                                                              "--bounding-set=-dac_override,-dac_read_search ")
                                                : std::string()) +
                              SHAKEBED_PROGRAM;
  const std::string enter = "cd '" + folder_.path().string() + "' && ";
  write_text(folder_ / "secret.csv", "height,number_density\n0,1\n");
  fs::permissions(folder_ / "secret.csv", fs::perms::none);
  if (std::system((enter + program + " --version > /dev/null 2> /dev/null").c_str()) != 0)
    GTEST_SKIP() << "rights cannot be given up here";
  fs::copy(folder_ / "r.json", folder_ / "secret.json");
  fs::permissions(folder_ / "secret.json", fs::perms::none);
  fs::copy(folder_ / "expected/render/frames", folder_ / "frames");
  fs::permissions(folder_ / "frames/000003.png", fs::perms::none);
  fs::create_directory(folder_ / "fixed");
  fs::permissions(folder_ / "fixed", fs::perms::owner_read | fs::perms::owner_exec);
  const auto ends = [&](const std::string& arguments, int code, const std::string& name) {
    const int status = std::system((enter + program + " " + arguments + " > /dev/null 2> err.txt").c_str());
    const std::string err = read_text(folder_ / "err.txt");
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == code) << arguments << ": " << status << " " << err;
    EXPECT_NE(err.find(name), std::string::npos) << err;
    EXPECT_NE(err.find("Permission denied"), std::string::npos) << err;
  };
  ends("fit-profile secret.csv", 4, "secret.csv");
  ends("validate secret.json", 4, "secret.json");
  ends("fit-images frames --diameter '3 mm' --out mine", 4, "000003.png");
  ends("run r.json --out fixed/o", 5, "fixed/o");
  EXPECT_FALSE(fs::exists(folder_ / "fixed/o"));
}

TEST_F(ImageFaults, FramesVanishWhileTheyAreRead) {
  std::mt19937 random(15);
  start_from({"bed", "render"});
  std::uniform_real_distribution<double> moment(0, run("o").seconds);
  for (int i = 0; i < 6; ++i) {
    start_from({"bed", "render"});
    const int process = start_shakebed({"run", "r.json", "--out", "o"}, folder_.path());
    std::this_thread::sleep_for(std::chrono::duration<double>(moment(random)));
    std::error_code error;
    fs::remove_all(folder_ / "o/render/frames", error);
    const int code = wait_for(process);
    EXPECT_TRUE(code == 0 || code == 4 || code == 5) << code;
    EXPECT_EQ(run("o").exit_code, 0);
    expect_goes_on();
  }
}

TEST_F(ImageFaults, MemoryIsShort) {
  // From about 300 MB of addresses on the libraries of the pictures can be loaded; frames of six million pixels then
  // want more than is there.
  write_text(folder_ / "r.json", image_recipe("0.012 mm/px"));
  int started = 0;
  for (const rlim_t megabytes : {60U, 420U, 500U}) {
    start_from({"bed"});
    ProgramResult result;
    {
      const Limit limit(RLIMIT_AS, megabytes << 20);
      result = run("o");
    }
    SCOPED_TRACE(std::to_string(megabytes) + " MB");
    expect_nothing_broken(result, false);
    const bool loaded = result.err.find("cannot be loaded") == std::string::npos;
    started += loaded;
    if (loaded) {
      EXPECT_NE(result.err.find("memory"), std::string::npos) << result.err;
    }
  }
  EXPECT_GE(started, 1) << "the libraries alone want more than that";
}

TEST_F(ImageFaults, SignalsAtAnyMoment) {
  std::mt19937 random(19);
  start_from({"bed"});
  std::uniform_real_distribution<double> moment(0, run("o").seconds);
  int stopped = 0;
  for (int i = 0; i < 9; ++i) {
    start_from({"bed"});
    const int signal = i % 3 == 0 ? SIGINT : i % 3 == 1 ? SIGTERM : SIGKILL;
    const int process = start_shakebed({"run", "r.json", "--out", "o"}, folder_.path());
    std::this_thread::sleep_for(std::chrono::duration<double>(moment(random)));
    ::kill(process, signal);
    const int code = wait_for(process);
    EXPECT_TRUE(code == 0 || code == 128 + signal || (signal != SIGKILL && code == 130))
        << "signal " << signal << ": " << code;
    stopped += code != 0;
    expect_whole_stages();
    expect_goes_on();
  }
  EXPECT_GT(stopped, 3) << "the signals came too late";
}

}  // namespace
