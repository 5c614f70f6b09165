// infer-bed, from pictures of a bed whose parameters are known.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/read_table.hpp"

namespace shakebed::tests::infer_bed {
namespace {

using pipelines::Json;
using pipelines::read_json;

// 60 disks, Gamma = 4, e = 0.8, friction 0.3; 48 pictures at 480 Hz, two periods.
const std::string hidden = R"({ "name": "hidden", "stages": [
  { "stage": "simulate", "id": "bed", "seed": 11, "replicas": 1,
    "disks": { "count": 60, "diameter": "3 mm", "restitution": 0.8, "friction": 0.3, "inertia": "sphere" },
    "box": { "width": "36.9 mm", "sides": { "kind": "hard", "restitution": 0.8, "friction": 0.3 }, "lid": "open" },
    "floor": { "motion": "sinusoidal", "gamma": 4, "frequency": "20 Hz", "restitution": 0.8, "friction": 0.3 },
    "settle": "2 s", "measure": "0.1 s", "frames": { "count": 48, "phases": 24 } },
  { "stage": "render", "id": "film", "from": "bed", "scale": "0.3 mm/px", "exposure": "0.2 ms" } ] })";

class InferBed : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ScratchFolder;
    write_text(*folder_ / "hidden.json", hidden);
    const ProgramResult ran = run_shakebed({"run", "hidden.json", "--out", "hidden", "--quiet"}, folder_->path());
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
  }
  static void TearDownTestSuite() { delete folder_; }
  static ProgramResult infer(const std::string& out, const std::vector<std::string>& more,
                             const std::string& frames = "hidden/film/frames") {
    std::vector<std::string> arguments{"infer-bed", frames, "--diameter", "3 mm", "--out", out, "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_shakebed(arguments, folder_->path());
  }
  static ScratchFolder* folder_;
};
ScratchFolder* InferBed::folder_ = nullptr;

// What is asked of the stage infer follows from the frames: count, width, heights, temperatures, and Gamma from the
// amplitude of the floor.
TEST_F(InferBed, WritesTheRecipeOfTheBedThatWasFilmed) {
  const ProgramResult ran =
      infer("o", {"--frequency", "20 Hz", "--frame-rate", "480 Hz", "--beds", "20", "--set", "/stages/infer/rounds=0",
                  "--set", "/stages/infer/best=1", "--set", "/stages/infer/best_replicas=2", "--set",
                  "/stages/infer/measure=0.25 s", "--set", "/stages/infer/settle=0.5 s"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_NE(ran.out.find("agree with all"), std::string::npos) << ran.out;
  // The frames are measured in a run of their own before: its warnings are said once.
  std::map<std::string, int> warnings;
  std::istringstream said(ran.err);
  for (std::string line; std::getline(said, line);)
    if (line.rfind("warning: extract", 0) == 0) ++warnings[line];
  for (const auto& [line, times] : warnings) EXPECT_EQ(times, 1) << line;
  EXPECT_FALSE(warnings.empty());
  for (const char* name : {"infer: gamma = ", "infer: restitution = ", "infer: friction = "})
    EXPECT_NE(ran.out.find(name), std::string::npos) << ran.out;
  const Json recipe = read_json(*folder_ / "o/resolved.json"), extract = read_json(*folder_ / "o/extract/extract.json");
  const Json stage = recipe["stages"].back();
  ASSERT_EQ(stage["stage"], "infer");
  EXPECT_EQ(stage["disks"]["count"], 60);
  EXPECT_EQ(stage["first"], 20);
  EXPECT_NEAR(std::stod(stage["box"]["width"].get<std::string>()), 0.0369, 2e-4);
  const Json& gamma = stage["parameters"]["gamma"];
  const double omega = 2 * M_PI * 20, measured = value(extract["floor_amplitude"]) * omega * omega / 9.81;
  EXPECT_NEAR(gamma["mean"].get<double>(), measured, 1e-9);
  EXPECT_NEAR(gamma["mean"].get<double>(), 4, 3 * gamma["std_error"].get<double>());
  EXPECT_NEAR(gamma["std_error"].get<double>() / measured,
              error(extract["floor_amplitude"]) / value(extract["floor_amplitude"]), 1e-9);
  const Json& targets = stage["targets"];
  EXPECT_EQ(targets["profile"]["from"], "extract");
  EXPECT_EQ(targets.contains("temperature_x_without_flow_over_mg"), extract["velocities"]["usable"].get<bool>());
  const Json found = read_json(*folder_ / "o/infer/infer.json");
  for (const auto& [name, truth] : {std::pair{"gamma", 4.0}, {"restitution", 0.8}, {"friction", 0.3}}) {
    EXPECT_LT(found["parameters"][name]["low_95"], truth) << name;
    EXPECT_GT(found["parameters"][name]["high_95"], truth) << name;
  }
}

// The recipe alone, in the folder whose frames are measured: ranges as they are asked for, whose middles are in the
// scene. A bed settles for 50 periods and is measured as long as the film, two of them.
TEST_F(InferBed, WritesTheRangesThatAreAskedFor) {
  const ProgramResult ran =
      infer("o", {"--frequency", "20 Hz", "--frame-rate", "480 Hz", "--gamma", "2,7", "--restitution", "0.5,0.9",
                  "--friction", "0.1,0.3", "--beds", "31", "--plateau-density", "1.1", "--only", "figure"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json recipe = read_json(*folder_ / "o/resolved.json"), stage = recipe["stages"].back();
  ASSERT_EQ(stage["stage"], "infer");
  EXPECT_EQ(stage["parameters"]["gamma"]["low"], 2);
  EXPECT_EQ(stage["parameters"]["gamma"]["high"], 7);
  EXPECT_FALSE(stage["parameters"]["gamma"].contains("mean"));
  EXPECT_EQ(stage["parameters"]["restitution"]["set"].size(), 3U);
  EXPECT_EQ(stage["parameters"]["friction"]["high"], 0.3);
  EXPECT_EQ(stage["floor"]["gamma"], 4.5);
  EXPECT_EQ(stage["floor"]["frequency"], "20 Hz");
  for (const Json* material : {&stage["disks"], &stage["floor"], &stage["box"]["sides"]}) {
    EXPECT_NEAR((*material)["restitution"].get<double>(), 0.7, 1e-12);
    EXPECT_NEAR((*material)["friction"].get<double>(), 0.2, 1e-12);
  }
  EXPECT_EQ(stage["disks"]["inertia"], "sphere");
  EXPECT_EQ(stage["settle"], "2.5 s");
  EXPECT_EQ(stage["measure"], "0.1 s") << "48 frames at 480 Hz are two periods of 20 Hz";
  EXPECT_EQ(stage["first"], 31);
  EXPECT_EQ(stage["each"], 10);
  EXPECT_EQ(stage["rounds"], 2);
  EXPECT_EQ(stage["plateau_density"], 1.1);
  const Json& profile = stage["targets"]["profile"];
  EXPECT_EQ(profile["low"], 0.5);
  EXPECT_NEAR(std::fmod(profile["high"].get<double>(), 1), 0.5, 1e-12) << "whole diameters above";
  EXPECT_EQ(stage["kernel_width"], 0.5);
}

// Gamma as the amplitude of the floor in the film says, five errors to each side; the number of beads as it is given.
TEST_F(InferBed, TakesGammaFromTheFilm) {
  const ProgramResult ran = infer("g", {"--frequency", "20 Hz", "--frame-rate", "480 Hz", "--bead-number", "59",
                                        "--only", "figure", "--set", "/stages/extract/overlays=0"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json stage = read_json(*folder_ / "g/resolved.json")["stages"].back(),
             extract = read_json(*folder_ / "g/extract/extract.json");
  EXPECT_EQ(stage["disks"]["count"], 59);
  const double amplitude = value(extract["floor_amplitude"]), gamma = amplitude * std::pow(40 * M_PI, 2) / 9.81,
               spread = gamma * error(extract["floor_amplitude"]) / amplitude;
  EXPECT_NEAR(gamma, 4, 1);
  const Json& parameter = stage["parameters"]["gamma"];
  EXPECT_NEAR(parameter["mean"].get<double>(), gamma, 1e-9);
  EXPECT_NEAR(parameter["std_error"].get<double>(), spread, 1e-9);
  EXPECT_NEAR(parameter["low"].get<double>(), std::max(gamma / 2, gamma - 5 * spread), 1e-9);
  EXPECT_NEAR(parameter["high"].get<double>(), gamma + 5 * spread, 1e-9);
  EXPECT_EQ(parameter["why"], "the amplitude of the floor in the film");
  EXPECT_NEAR(stage["floor"]["gamma"].get<double>(), gamma, 1e-9);
}

TEST_F(InferBed, SaysWhatIsMissing) {
  const auto refused = [](const std::vector<std::string>& more, int code, const std::string& words) {
    const ProgramResult ran = infer("wrong", more, "hidden/film/frames/000000.png");
    EXPECT_EQ(ran.exit_code, code) << ran.err;
    EXPECT_NE(ran.err.find(words), std::string::npos) << ran.err;
  };
  refused({"--gamma", "5,2"}, 2, "--gamma: expected LOW,HIGH with LOW below HIGH");
  refused({"--restitution", "0.5,1.2"}, 2, "--restitution: expected LOW,HIGH");
  refused({"--kernel", "top_hat:1"}, 2, "--kernel: the beds of an inference are measured through a Gaussian");
  refused({"--frequency", "20"}, 2, "has no unit");
  refused({}, 5, "the frequency of the shaking is not known. Give --frequency");
  refused(
      {"--frequency", "20 Hz"}, 5,
      "the density exceeds twice its error only up to 0.5 D, and an inference needs 3.5 D. Give more photographs of "
      "the bed (here 1) or a longer film");
}

}  // namespace
}  // namespace shakebed::tests::infer_bed
