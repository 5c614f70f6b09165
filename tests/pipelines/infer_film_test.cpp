// Temperatures of films in an inference, beds that answer differently in different parts of the prior, and beds that
// several runs share.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/infer_recipe.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/read_table.hpp"

namespace shakebed::tests::infer_film {
namespace {

using pipelines::Json;

// The bed of infer_recipe, inferred from its rise alone, without rounds.
Json recipe() {
  Json stage = Json::parse(infer_recipe)["stages"][0];
  stage["targets"] = Json{{"center_of_mass_rise", {{"value", 1.5}, {"std_error", 0.05}}}};
  for (const char* key : {"moments", "average", "calibration", "best_replicas"}) stage.erase(key);
  stage["rounds"] = 0, stage["best"] = 0, stage["first"] = 20, stage["settle"] = 5, stage["measure"] = 15;
  return Json{{"name", "t"}, {"stages", {stage}}};
}

ProgramResult run(const std::filesystem::path& folder, const Json& json, const std::string& out) {
  write_text(folder / (out + ".json"), json.dump());
  return run_shakebed({"run", out + ".json", "--out", out, "--quiet"}, folder);
}

// The same beds, looked at with so many frames a period. With many, displacements are velocities; with few, disks
// collide between them.
TEST(InferFilm, ComparesDisplacementsBetweenFrames) {
  const ScratchFolder folder;
  const auto temperatures = [&](const std::string& out, double frames) {
    Json json = recipe();
    json["stages"][0]["phases"] = 100, json["stages"][0]["measure"] = 15;
    if (frames > 0) json["stages"][0]["frame_rate"] = 0.35 * frames;
    const ProgramResult ran = run(folder.path(), json, out);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return NumberTable(folder / (out + "/search/beds.csv"));
  };
  const NumberTable now = temperatures("now", 0), many = temperatures("many", 400), few = temperatures("few", 10);
  for (const char* name : {"temperature_x_without_flow_over_mg", "temperature_z_without_flow_over_mg"}) {
    double of_many = 0, of_few = 0;
    for (std::size_t bed = 0; bed < now.rows(); ++bed) {
      EXPECT_LT(few(name, bed), many(name, bed));
      EXPECT_LT(many(name, bed), 1.01 * now(name, bed));
      of_many += many(name, bed) / now(name, bed) / static_cast<double>(now.rows());
      of_few += few(name, bed) / now(name, bed) / static_cast<double>(now.rows());
    }
    EXPECT_NEAR(of_many, 0.97, 0.015) << name;
    EXPECT_LT(of_few, 0.85) << name;
  }
  EXPECT_NEAR(few("center_of_mass_rise", 3), now("center_of_mass_rise", 3), 0.1);
}

TEST(InferFilm, RefusesWhatNoFilmShows) {
  const ScratchFolder folder;
  const auto refused = [&](const Json& more, const std::string& words) {
    Json json = recipe();
    json["stages"][0].update(more);
    const ProgramResult ran = run(folder.path(), json, "wrong");
    EXPECT_EQ(ran.exit_code, 3) << ran.err;
    EXPECT_NE(ran.err.find(words), std::string::npos) << ran.err;
  };
  refused({{"frame_rate", 7}, {"phase", 0.25}}, "\"frame_rate\" excludes \"phase\" and \"moments\"");
  refused({{"frame_rate", 0.1}}, "a period of the shaking must have 1 to 4096 frames, but has 0.286");
}

// A film of a bed, and an inference from one of its temperatures.
Json filmed(const std::string& at) {
  Json material{{"restitution", 0.7}}, disks = material, floor = material, sides = material;
  disks.update({{"count", 40}, {"diameter", "2 mm"}});
  floor.update({{"motion", "sinusoidal"}, {"gamma", 4}, {"frequency", "25 Hz"}});
  sides.update({{"kind", "hard"}});
  const Json scene{{"disks", disks}, {"floor", floor}, {"box", {{"width", "16.6 mm"}, {"sides", sides}}}};
  Json bed{{"stage", "simulate"}, {"id", "bed"}, {"measure", "0.2 s"}, {"frames", {{"count", 50}, {"phases", 20}}}};
  Json infer = Json::parse(infer_recipe)["stages"][0];
  for (const char* key : {"units", "moments", "average", "calibration"}) infer.erase(key);
  bed.update(scene), infer.update(scene);
  infer.update({{"from", "extract"}, {"settle", "0.2 s"}, {"measure", "0.4 s"}});
  infer["targets"] = Json{{"temperature_x_without_flow_over_mg", {{"at", at}}}};
  const Json render{{"stage", "render"}, {"id", "film"}, {"from", "bed"}};
  const Json extract{
      {"stage", "extract"}, {"id", "extract"}, {"from", "film"}, {"diameter", "2 mm"}, {"frame_rate", "500 Hz"}};
  return Json{{"name", "t"}, {"stages", {bed, render, extract, infer}}};
}

TEST(InferFilm, RefusesTemperaturesThatAreNotComparable) {
  const ScratchFolder folder;
  const auto refused = [&](Json json, const std::string& words) {
    const ProgramResult ran = run(folder.path(), json, "wrong");
    EXPECT_EQ(ran.exit_code, 3) << ran.err;
    EXPECT_NE(ran.err.find(words), std::string::npos) << ran.err;
  };
  refused(filmed("/extract/velocities/temperature_x_of_displacements_over_mg"),
          "Give \"frame_rate\", that of the film");
  Json corrected = filmed("/extract/velocities/temperature_x_over_mg");
  corrected["stages"][3]["frame_rate"] = "500 Hz";
  refused(corrected, "with \"frame_rate\" this target must be a temperature of displacements");
}

// Beds by hand: the density tells the restitution e. The rise is 3 gamma, with a scatter of 0.1 below e = 0.7 and of 2
// beyond. Where the density says e = 0.57, the posterior of gamma is a normal distribution of width 0.1/3.
TEST(InferNear, IsNotWidenedByBedsElsewhere) {
  const ScratchFolder folder;
  ASSERT_EQ(run(folder.path(), recipe(), "first").exit_code, 0);
  Json stored = Json::parse(read_text(folder / "first/search/beds.json"));
  const auto place = [&](const char* name) {
    const Json& names = stored["made_from"]["observables"];
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  const std::size_t rise = place("center_of_mass_rise"), density = place("density");
  std::mt19937_64 generator(9);
  std::normal_distribution<double> normal;
  Json bed = stored["beds"][0];
  stored["beds"] = Json::array();
  constexpr int count = 160;
  for (int i = 0; i < count; ++i) {
    const double gamma = 3 + 3 * (i + 0.5) / count, restitution = 0.5 + 0.4 * std::fmod(0.618034 * i, 1.0);
    bed["values"] = {gamma, restitution};
    for (Json& number : bed["numbers"]) number = 1 + 0.01 * normal(generator);
    bed["numbers"][rise] = 3 * gamma + (restitution < 0.7 ? 0.1 : 2) * normal(generator);
    bed["numbers"][density] = restitution * (1 + 0.02 * normal(generator));
    stored["beds"].push_back(bed);
  }
  write_text(folder / "own.json", stored.dump());
  Json json = recipe();
  json["stages"][0]["beds"] = "own.json";
  json["stages"][0]["targets"] = Json{{"center_of_mass_rise", {{"value", 13.5}, {"std_error", 0.001}}},
                                      {"density", {{"value", 0.57}, {"std_error", 0.001}}}};
  const ProgramResult ran = run(folder.path(), json, "near");
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json gamma = Json::parse(read_text(folder / "near/search/infer.json"))["parameters"]["gamma"];
  // The scatter is known from 40 beds or more, to 11 %.
  EXPECT_NEAR(value(gamma), 4.5, 0.03);
  EXPECT_NEAR(error(gamma) / (0.1 / 3), 1, 0.25);
}

// Two runs that share the beds of the first round, as a sweep over the parts would, and one that has their beds: the
// same posterior as that of one run, to the last digit.
TEST(InferParts, TogetherAreTheWhole) {
  const ScratchFolder folder;
  Json json = recipe();
  Json& stage = json["stages"][0];
  stage["first"] = 33;
  ASSERT_EQ(run(folder.path(), json, "whole").exit_code, 0);
  stage["parts"] = 2;
  Json sweep = json;
  sweep["sweep"] = Json{{"kind", "grid"}, {"over", {{"/stages/search/part", {1, 2}}}}, {"collect", {"/search/beds"}}};
  const ProgramResult swept = run(folder.path(), sweep, "parts");
  ASSERT_EQ(swept.exit_code, 0) << swept.err;
  const NumberTable beds(folder / "parts/sweep.csv");
  EXPECT_EQ(beds("search_beds", 0), 16);
  EXPECT_EQ(beds("search_beds", 1), 17);
  stage.erase("parts");
  stage["beds"] = "parts/points/*/search/beds.json";
  const ProgramResult ran = run(folder.path(), json, "together");
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  for (const char* file : {"posterior.csv", "beds.csv", "marginals.csv"})
    EXPECT_EQ(read_text(folder / "together/search" / file), read_text(folder / "whole/search" / file)) << file;
  const auto refused = [&](const Json& more, const std::string& words) {
    Json wrong = recipe();
    wrong["stages"][0].update(more);
    const ProgramResult failed = run(folder.path(), wrong, "wrong");
    EXPECT_EQ(failed.exit_code, 3) << failed.err;
    EXPECT_NE(failed.err.find(words), std::string::npos) << failed.err;
  };
  refused({{"parts", 2}, {"part", 3}, {"first", 40}}, "part 3 of 2 does not exist");
  refused({{"parts", 3}, {"first", 40}}, "at least 16 beds in each part");
  refused({{"parts", 2}, {"first", 40}, {"rounds", 1}}, "Give \"rounds\": 0");
}

}  // namespace
}  // namespace shakebed::tests::infer_film
