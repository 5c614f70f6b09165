// A simulation that is interrupted and goes on in the test's own process: from its checkpoint, and to the same bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/files.hpp"
#include "tests/pipelines/lone_stage.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;
namespace fs = std::filesystem;

// All that a checkpoint holds: a bath and its steps, spins, contact clocks, frames, every observer. A run
// that is interrupted writes the latest of the states that it keeps, some sixteen a run.
constexpr const char* interrupted_bed = R"({
  "disks": {"count": 40, "restitution": 0.9, "friction": 0.1, "contact_duration": 1e-3},
  "box": {"width": 6.3, "sides": {"kind": "hard", "restitution": 0.9}},
  "floor": {"motion": "sinusoidal", "amplitude": 0.8, "frequency": 0.35, "restitution": 0.9},
  "bath": {"kind": "langevin", "temperature": 2, "rate": 0.2, "interval": 0.5},
  "schedule": [{"temperature": 3, "ramp": 2, "hold": 4}],
  "observe": ["order", "velocities", "displacement", "pressure", "phases"],
  "settle": 5, "measure": 20, "frames": {"count": 20, "phases": 8}, "checkpoint_seconds": 10})";

// A simulate stage that is interrupted when it is asked for the n-th time; 0: never.
class InterruptedBed : public LoneStage {
 public:
  InterruptedBed() : LoneStage(*find_stage("simulate")) {
    reduced = true;
    fs::create_directory(checkpoints_);
  }

  const fs::path& scratch() override { return checkpoints_; }
  bool interrupted() const override { return ++questions_ == stop_at_; }
  void log(std::string_view line) override { lines_.emplace_back(line); }

  // Whether it came to its end.
  bool runs(int stop_at) {
    questions_ = 0, stop_at_ = stop_at;
    lines_.clear();
    try {
      run(interrupted_bed);
      return true;
    } catch (const Interrupted&) {
      return false;
    }
  }
  int questions() const { return questions_; }
  bool said(std::string_view words) const {
    return std::any_of(lines_.begin(), lines_.end(),
                       [&](const std::string& line) { return line.find(words) != std::string::npos; });
  }
  std::map<std::string, std::string> files() {
    std::map<std::string, std::string> texts;
    for (const fs::directory_entry& entry : fs::directory_iterator(output_directory()))
      if (entry.is_regular_file()) texts[entry.path().filename().string()] = read_file(entry.path());
    return texts;
  }
  fs::path checkpoint() const {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(checkpoints_))
      if (entry.path().filename() == "checkpoint") return entry.path();
    return {};
  }

 private:
  fs::path checkpoints_ = file("checkpoints");
  mutable int questions_ = 0;
  int stop_at_ = 0;
  std::vector<std::string> lines_;
};

void expect_same_files(InterruptedBed& found, InterruptedBed& expected) {
  const auto a = found.files(), b = expected.files();
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [name, text] : b) EXPECT_TRUE(a.contains(name) && a.at(name) == text) << name << " is another";
}

TEST(ResumedBed, GoesOnFromItsCheckpointAndEndsWithTheSameBytes) {
  InterruptedBed whole, parts;
  ASSERT_TRUE(whole.runs(0));
  ASSERT_GE(whole.questions(), 3);
  EXPECT_FALSE(whole.said("continues after"));
  ASSERT_FALSE(parts.runs(whole.questions() / 2));
  ASSERT_FALSE(parts.checkpoint().empty());
  ASSERT_TRUE(parts.runs(0));
  EXPECT_TRUE(parts.said("continues after"));
  EXPECT_EQ(parts.warnings, whole.warnings);
  EXPECT_LT(parts.questions(), whole.questions());  // what was done is not done again
  expect_same_files(parts, whole);
}

TEST(ResumedBed, StartsAgainWhereTheCheckpointIsDamaged) {
  InterruptedBed whole;
  ASSERT_TRUE(whole.runs(0));
  for (const bool cut : {false, true}) {
    InterruptedBed parts;
    ASSERT_FALSE(parts.runs(whole.questions() / 2));
    const fs::path checkpoint = parts.checkpoint();
    std::string text = read_file(checkpoint);
    if (cut)
      text.resize(10);
    else
      text[text.size() / 2] ^= 1;
    write_text(checkpoint, text);
    ASSERT_TRUE(parts.runs(0));
    EXPECT_FALSE(parts.said("continues after"));
    ASSERT_EQ(parts.warnings.size(), whole.warnings.size() + 1);
    EXPECT_NE(parts.warnings.front().find("it is damaged"), std::string::npos) << parts.warnings.front();
    expect_same_files(parts, whole);
  }
}

}  // namespace
