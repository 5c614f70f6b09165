// Frames at named phases of the shaking, and the profile of each phase, up to its fit.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/read_table.hpp"

namespace shakebed::tests::named_phases {
namespace {

using pipelines::Json;

// 30 periods, one frame in each at a phase of its own.
const std::string recipe = R"({ "name": "strobe", "stages": [
  { "stage": "simulate", "id": "bed", "seed": 4, "replicas": 1,
    "disks": { "count": 60, "diameter": "3 mm", "restitution": 0.9 },
    "box": { "width": "24.9 mm", "sides": { "kind": "hard", "restitution": 0.9 } },
    "floor": { "motion": "sinusoidal", "gamma": 4, "frequency": "20 Hz", "restitution": 0.9 },
    "settle": "1 s", "measure": "1.5 s", "compress": false,
    "frames": { "count": 30, "phases": 8, "at": [0.25] } },
  { "stage": "fit", "from": "bed", "table": "profile_phase_00.csv" } ] })";

double mean_height(const NumberTable& profile) {
  double sum = 0, weight = 0;
  for (std::size_t r = 0; r < profile.rows(); ++r)
    sum += profile("height", r) * profile("number_density", r), weight += profile("number_density", r);
  return sum / weight;
}

TEST(NamedPhases, HaveTheirOwnFramesProfileAndFit) {
  const ScratchFolder folder;
  write_text(folder / "r.json", recipe);
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o", "--quiet"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const std::string trajectory = read_text(folder / "o/bed/trajectory.extxyz");
  std::size_t frames = 0;
  for (std::size_t at = trajectory.find("Phase="); at != std::string::npos; at = trajectory.find("Phase=", at + 1)) {
    EXPECT_EQ(trajectory.compare(at, 11, "Phase=0.25 "), 0) << trajectory.substr(at, 20);
    ++frames;
  }
  EXPECT_EQ(frames, 30U);
  // The kernel does not move the mean height, which the simulation knows of each phase without a profile.
  const Json by_phase = Json::parse(read_text(folder / "o/bed/observables.json"))["center_of_mass_by_phase"];
  const NumberTable profile(folder / "o/bed/profile_phase_00.csv"), whole(folder / "o/bed/profile.csv");
  EXPECT_NEAR(mean_height(profile), by_phase[2].get<double>(), 1e-3);
  EXPECT_GT(std::abs(mean_height(whole) - mean_height(profile)), 0.02) << "the bed moves";
  EXPECT_NE(read_text(folder / "o/bed/profile_phase_00.csv-metadata.json").find("0.25"), std::string::npos);
  // Each period had its frame there: the profile of the frames is the same.
  const NumberTable of_frames(folder / "o/bed/profile_frames.csv");
  ASSERT_EQ(of_frames.rows(), profile.rows());
  for (std::size_t r = 0; r < profile.rows(); ++r) {
    EXPECT_NEAR(of_frames("number_density", r), profile("number_density", r), 1e-12);
    EXPECT_NEAR(of_frames("std_error", r), profile("std_error", r), 1e-12);
  }
  // The stage fits that table: a file of its own with the same content gives the same.
  std::string own = recipe;
  own.replace(own.find("\"table\": \"profile_phase_00.csv\""), 31, "\"profile\": \"o/bed/profile_phase_00.csv\"");
  write_text(folder / "own.json", own);
  ASSERT_EQ(run_shakebed({"run", "own.json", "--out", "p", "--quiet"}, folder.path()).exit_code, 0);
  const Json one = Json::parse(read_text(folder / "o/fit/fit.json")),
             two = Json::parse(read_text(folder / "p/fit/fit.json"));
  EXPECT_EQ(one["temperature"], two["temperature"]);
  EXPECT_GT(one["temperature"]["value"], 0);
}

TEST(NamedPhases, AreThoseAtWhichTheBedIsSampled) {
  const ScratchFolder folder;
  write_text(folder / "r.json", recipe);
  const ProgramResult ran = run_shakebed({"validate", "r.json", "--set", "/stages/bed/frames/at=[0.3]"}, folder.path());
  EXPECT_EQ(ran.exit_code, 3);
  EXPECT_NE(ran.err.find("/frames/at: the bed is not sampled at these phases"), std::string::npos) << ran.err;
  EXPECT_NE(ran.err.find("multiples of 1/8"), std::string::npos) << ran.err;
}

}  // namespace
}  // namespace shakebed::tests::named_phases
