// Running pipelines: what is kept, what runs again and why, locks, interrupts, exit codes, files.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <map>
#include <thread>

#include "fit/theory/hydrostatic_profile.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/written_out.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::find_pointer;
using shakebed::pipelines::Json;
using shakebed::pipelines::read_json;
using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

class Pipeline : public testing::Test {
 protected:
  Pipeline() { write_text(folder_ / "r.json", small_recipe()); }
  ProgramResult run(std::vector<std::string> arguments) { return run_shakebed(arguments, folder_.path()); }
  ProgramResult run_recipe(std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{"run", "r.json", "--out", "o"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }
  std::string dry_run(std::vector<std::string> more = {}) {
    more.push_back("--dry-run");
    return run_recipe(more).out;
  }
  ScratchFolder folder_;
};

TEST_F(Pipeline, WritesTheFixedResultFiles) {
  ASSERT_EQ(run_recipe().exit_code, 0);
  for (const char* name :
       {"manifest.json", "resolved.json", "summary.json", "summary.md", "report.html", "ro-crate-metadata.json",
        "bed/profile.csv", "bed/observables.json", "bed/trajectory.extxyz.zst", "simulate/profile.csv", "fit/fit.json",
        "check/check.json", "check/junit.xml"}) {
    EXPECT_TRUE(fs::is_regular_file(folder_ / "o" / name)) << name;
  }
  const Json manifest = read_json(folder_ / "o" / "manifest.json");
  for (const char* key :
       {"shakebed", "git", "compiler", "host", "command_line", "started", "finished", "exit_code", "stages", "outputs"})
    EXPECT_TRUE(manifest.contains(key)) << key;
  EXPECT_EQ(manifest["stages"][0]["seed"], 7);
  EXPECT_GT(manifest["stages"][0]["cost"]["wall_seconds"].get<double>(), 0);
  EXPECT_EQ(manifest["stages"][0]["outputs"][0]["sha256"].get<std::string>().size(), 64u);
  const Json summary = read_json(folder_ / "o" / "summary.json");
  EXPECT_TRUE(summary["bed"]["temperature_x_over_mg"].contains("value"));
  EXPECT_EQ(summary["bed"]["temperature_x_over_mg"]["unit"], "m");
}

TEST_F(Pipeline, KeepsWhatIsUpToDate) {
  ASSERT_EQ(run_recipe().exit_code, 0);
  const auto written = fs::last_write_time(folder_ / "o/bed/profile.csv");
  const ProgramResult again = run_recipe();
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_THAT(again.err, HasSubstr("bed: up to date"));
  EXPECT_THAT(again.err, HasSubstr("fit: up to date"));
  EXPECT_EQ(fs::last_write_time(folder_ / "o/bed/profile.csv"), written);
}

TEST_F(Pipeline, SaysWhyAStageRunsAgain) {
  EXPECT_THAT(dry_run(), HasSubstr("bed: runs: it has not run yet"));
  ASSERT_EQ(run_recipe().exit_code, 0);
  EXPECT_THAT(dry_run(), HasSubstr("bed: up to date"));
  EXPECT_THAT(dry_run({"--set", "/stages/bed/seed=8"}), HasSubstr("bed: runs: seed changed 7 → 8"));
  const std::string amplitude = dry_run({"--set", "/stages/bed/floor/amplitude=1.6 mm"});
  EXPECT_THAT(amplitude, HasSubstr("floor/amplitude changed \"0.0015 m\" → \"0.0016 m\""));
  EXPECT_THAT(amplitude, HasSubstr("fit: runs: bed runs before it"));
  const std::string density = dry_run({"--set", "/stages/fit/plateau_density=1.0"});
  EXPECT_THAT(density, HasSubstr("bed: up to date"));
  EXPECT_THAT(density, HasSubstr("fit: runs: plateau_density changed 1.1 → 1"));
  EXPECT_THAT(dry_run({"--force"}), HasSubstr("bed: runs: --force was given"));
  // The same value in other words is the same option.
  EXPECT_THAT(dry_run({"--set", "/stages/bed/floor/amplitude=0.15 cm"}), HasSubstr("bed: up to date"));
  // explain is the same thing.
  EXPECT_EQ(run({"explain", "r.json", "--out", "o"}).out, dry_run());
}

// The fingerprints themselves: tests/house/stage_code_test.cpp.
TEST_F(Pipeline, RunsAgainWhatOtherCodeHasMade) {
  ASSERT_EQ(run_recipe().exit_code, 0);
  Json record = read_json(folder_ / "o/fit/.record");
  EXPECT_EQ(record["code"].get<std::string>().size(), 32u);
  EXPECT_NE(record["code"], read_json(folder_ / "o/bed/.record")["code"]);
  record["code"] = std::string(32, '0');
  write_text(folder_ / "o/fit/.record", record.dump());
  const std::string next = dry_run();
  const std::string day = read_json(folder_ / "o/fit/cost.json")["finished"].get<std::string>().substr(0, 10);
  EXPECT_THAT(next, HasSubstr("bed: up to date"));
  EXPECT_THAT(next, HasSubstr("fit: runs: the code of fit changed since " + day));
  EXPECT_THAT(next, HasSubstr("check: runs: fit runs before it"));
  // The new code gives the same numbers: what follows rests.
  EXPECT_THAT(run_recipe().err, HasSubstr("check: up to date"));
  EXPECT_THAT(dry_run(), HasSubstr("fit: up to date"));
}

TEST_F(Pipeline, NoticesOutputsThatWereTouched) {
  ASSERT_EQ(run_recipe().exit_code, 0);
  write_text(folder_ / "o/bed/profile.csv", read_text(folder_ / "o/bed/profile.csv") + "# mine\n");
  EXPECT_THAT(dry_run(), HasSubstr("bed: runs: its output profile.csv was changed after the run"));
  ASSERT_EQ(run_recipe().exit_code, 0);
  EXPECT_THAT(dry_run(), HasSubstr("bed: up to date"));
  fs::remove(folder_ / "o/fit/fit.json");
  EXPECT_THAT(dry_run(), HasSubstr("fit: runs: its output fit.json is missing"));
  EXPECT_THAT(dry_run(), HasSubstr("bed: up to date"));
}

TEST_F(Pipeline, RunsOnlyWhatIsSelected) {
  const ProgramResult early = run_recipe({"--only", "fit"});
  EXPECT_EQ(early.exit_code, 4);
  EXPECT_THAT(early.err, HasSubstr("needs the results of \"bed\", which are not in"));
  ASSERT_EQ(run_recipe({"--until", "bed"}).exit_code, 0);
  EXPECT_FALSE(fs::exists(folder_ / "o/fit"));
  ASSERT_EQ(run_recipe({"--only", "fit"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "o/fit/fit.json"));
  EXPECT_FALSE(fs::exists(folder_ / "o/check"));
  ASSERT_EQ(run_recipe({"--from", "fit", "--force"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "o/check/check.json"));
  const ProgramResult unknown = run_recipe({"--only", "fitt"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("did you mean \"fit\""));
}

// Without the blocks that show times.
std::string without_times(std::string text) {
  constexpr std::string_view open = "<!-- times -->", close = "<!-- /times -->";
  for (std::size_t begin = text.find(open); begin != std::string::npos; begin = text.find(open, begin)) {
    const std::size_t end = text.find(close, begin);
    if (end == std::string::npos) break;
    text.erase(begin, end + close.size() - begin);
  }
  return text;
}

// Every file of a run, hidden ones too, but what says where, when and how fast it ran.
std::map<std::string, std::string> results_of(const fs::path& out) {
  std::map<std::string, std::string> texts;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(out)) {
    const std::string name = entry.path().filename().string();
    if (entry.is_symlink() || !entry.is_regular_file() || name == "manifest.json" || name == "cost.json") continue;
    std::string text = read_text(entry.path());
    if (name == "report.html" || name == "summary.md") text = without_times(std::move(text));
    texts[entry.path().lexically_relative(out).string()] = std::move(text);
  }
  return texts;
}

// The names of files that differ, for a message a person can read.
std::vector<std::string> different(const std::map<std::string, std::string>& a,
                                   const std::map<std::string, std::string>& b) {
  std::vector<std::string> names;
  for (const auto& [name, text] : a) {
    if (!b.contains(name) || b.at(name) != text) names.push_back(name);
  }
  for (const auto& [name, text] : b) {
    if (!a.contains(name)) names.push_back(name);
  }
  return names;
}

TEST_F(Pipeline, SameSeedGivesTheSameBytes) {
  ASSERT_EQ(run({"run", "r.json", "--out", "a", "--jobs", "1"}).exit_code, 0);
  ASSERT_EQ(run({"run", "r.json", "--out", "b", "--jobs", "2"}).exit_code, 0);
  const auto a = results_of(folder_ / "a"), b = results_of(folder_ / "b");
  EXPECT_GE(a.size(), 15u);
  EXPECT_THAT(different(a, b), testing::IsEmpty());
  ASSERT_EQ(run({"run", "r.json", "--out", "c", "--set", "/stages/bed/seed=8"}).exit_code, 0);
  EXPECT_NE(results_of(folder_ / "c").at("bed/profile.csv"), a.at("bed/profile.csv"));
}

// Frames, disks found in them, figures (SVG and PDF), page and all.
TEST_F(Pipeline, TwoRunsOfTheStarterRecipeDifferInNothingButTheirCost) {
  ASSERT_EQ(run({"init", "starter.json"}).exit_code, 0);
  for (const char* out : {"a", "b"}) {
    const ProgramResult result =
        run({"run", "starter.json", "--preset", "quick", "--out", out, "--set", "/stages/bed/frames/count=8"});
    // Whether numbers from eight frames are good (exit code 6) is not the question here.
    ASSERT_TRUE(result.exit_code == 0 || result.exit_code == 6) << result.err;
    if (*out == 'a') std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // no date of the same second
  }
  const auto a = results_of(folder_ / "a"), b = results_of(folder_ / "b");
  EXPECT_TRUE(a.contains("figure/profile.pdf"));
  EXPECT_TRUE(a.contains("render/.record"));
  EXPECT_THAT(different(a, b), testing::IsEmpty());
  const Json cost = read_json(folder_ / "a/bed/cost.json");
  for (const char* key : {"wall_seconds", "cpu_seconds", "threads", "host", "finished", "collisions_per_second"})
    EXPECT_TRUE(cost.contains(key)) << key;
  EXPECT_FALSE(read_json(folder_ / "a/bed/observables.json").contains("cpu_seconds"));
}

TEST_F(Pipeline, TwoSweepsDifferInNothingButTheirCost) {
  write_text(folder_ / "s.json", small_recipe(R"({ "over": { "/stages/bed/disks/restitution": [0.7, 0.8] } })"));
  ASSERT_EQ(run({"run", "s.json", "--out", "a", "--jobs", "1"}).exit_code, 0);
  ASSERT_EQ(run({"run", "s.json", "--out", "b", "--jobs", "2"}).exit_code, 0);
  const auto a = results_of(folder_ / "a"), b = results_of(folder_ / "b");
  EXPECT_TRUE(a.contains("points/000001/.point"));
  EXPECT_TRUE(a.contains("sweep.csv"));
  EXPECT_THAT(different(a, b), testing::IsEmpty());
}

TEST_F(Pipeline, AStageStatesWhatItsMeasurementCost) {
  ASSERT_EQ(run({"run", "r.json", "--out", "a", "--until", "bed"}).exit_code, 0);
  const Json cost = read_json(folder_ / "a/bed/cost.json");
  EXPECT_GT(cost["measuring_cpu_seconds"].get<double>(), 0);
  EXPECT_LT(cost["measuring_cpu_seconds"].get<double>(), cost["simulation_cpu_seconds"].get<double>()) << "it settled";
}

TEST_F(Pipeline, AStageMadeAgainWithTheSameResultLetsWhatFollowsRest) {
  ASSERT_EQ(run_recipe().exit_code, 0);
  ASSERT_EQ(run_recipe({"--only", "bed", "--force"}).exit_code, 0);
  const std::string next = dry_run();
  for (const char* stage : {"bed", "fit", "check"}) EXPECT_THAT(next, HasSubstr(fmt::format("{}: up to date", stage)));
}

TEST_F(Pipeline, ResolvedRecipeGivesTheSameResults) {
  ASSERT_EQ(run_recipe().exit_code, 0);
  ASSERT_EQ(run({"run", "o/resolved.json", "--out", "again"}).exit_code, 0);
  EXPECT_EQ(read_text(folder_ / "o/bed/profile.csv"), read_text(folder_ / "again/bed/profile.csv"));
  EXPECT_EQ(read_text(folder_ / "o/fit/fit.json"), read_text(folder_ / "again/fit/fit.json"));
  EXPECT_EQ(read_text(folder_ / "o/resolved.json"), read_text(folder_ / "again/resolved.json"));
}

// --- presets

class Presets : public Pipeline {
 protected:
  void presets(const std::string& text) {
    std::string recipe = small_recipe();
    recipe.insert(recipe.rfind('}'), ", \"presets\": " + text);
    write_text(folder_ / "r.json", recipe);
  }
};

TEST_F(Presets, ChangeTheRecipeBeforeSetAndAreRecorded) {
  presets(R"({ "long": { "$comment": "-", "/stages/bed/seed": 11, "/stages/0/measure": "1 s" }, "other": {} })");
  ASSERT_EQ(run({"run", "r.json", "--out", "o", "--preset", "long", "--set", "/stages/bed/seed=12"}).exit_code, 0);
  const Json resolved = read_json(folder_ / "o/resolved.json");
  EXPECT_EQ(resolved["$preset"], "long");
  EXPECT_EQ(resolved["stages"][0]["seed"], 12) << "--set has the last word";
  EXPECT_EQ(resolved["stages"][0]["measure"], "1 s");
  EXPECT_EQ(read_json(folder_ / "o/manifest.json")["recipe"]["preset"], "long");
  // What was written can be run again, and is the same work.
  EXPECT_THAT(run({"explain", "o/resolved.json", "--out", "o"}).out, HasSubstr("bed: up to date"));
  EXPECT_EQ(run({"rerun", "o", "--out", "again", "--quiet"}).exit_code, 0);
  // Without it the recipe is as it was.
  EXPECT_THAT(run({"explain", "r.json", "--out", "o"}).out, HasSubstr("seed changed 12 → 7"));
}

TEST_F(Presets, AMistypedNameIsToldWhichThereAre) {
  presets(R"({ "quick": {}, "full": {} })");
  const ProgramResult mistyped = run({"run", "r.json", "--out", "o", "--preset", "qiuck"});
  EXPECT_EQ(mistyped.exit_code, 2);
  EXPECT_THAT(mistyped.err, HasSubstr("r.json:"));
  EXPECT_THAT(mistyped.err,
              HasSubstr("there is no preset of this name; choose from: quick, full; did you mean \"quick\"?"));
  EXPECT_FALSE(fs::exists(folder_ / "o"));
  write_text(folder_ / "none.json", small_recipe());
  EXPECT_THAT(run({"run", "none.json", "--preset", "quick"}).err, HasSubstr("none.json has no presets"));
  EXPECT_EQ(run({"reproduce", "all", "--preset", "no-such", "--out", "o"}).exit_code, 2);
}

TEST_F(Presets, EveryFigureThatShipsHasAQuickOneAndAFullOne) {
  for (const char* preset : {"quick", "full"}) {
    const ProgramResult plan = run({"reproduce", "all", "--preset", preset, "--out", "o", "--dry-run"});
    EXPECT_EQ(plan.exit_code, 0) << preset << ": " << plan.err;
  }
}

TEST_F(Presets, AMistakeInOneIsShownAtItsPlaceWithoutRunningIt) {
  presets("{ \"quick\": {\n\"/stages/bed/disks/diameter\": \"3 Hz\" } }");
  const ProgramResult wrong = run({"validate", "r.json"});
  EXPECT_EQ(wrong.exit_code, 3);
  const std::string recipe = read_text(folder_ / "r.json");
  const auto line = 1 + std::count(recipe.begin(), recipe.begin() + static_cast<long>(recipe.find("3 Hz")), '\n');
  EXPECT_THAT(wrong.err, HasSubstr("r.json:" + std::to_string(line) + ":"));
  EXPECT_THAT(wrong.err, HasSubstr("/stages/0/disks/diameter"));
  presets(R"({ "quick": { "/stages/bde/measure": "1 s" } })");
  EXPECT_EQ(run({"validate", "r.json"}).exit_code, 3);
  EXPECT_THAT(run({"validate", "r.json"}).err, HasSubstr("/presets/quick/~1stages~1bde~1measure"));
  for (const char* bad :
       {R"([])", R"({ "quick": 3 })", R"({ "quick": { "measure": 3 } })", R"({ "quick": { "/presets/full/a": 3 } })"}) {
    presets(bad);
    EXPECT_EQ(run({"validate", "r.json"}).exit_code, 3) << bad;
  }
}

TEST_F(Pipeline, AFailedCheckEndsWith6AndAReport) {
  const ProgramResult result = run_recipe({"--set", "/stages/check/expect/~1bed~1column_number/value=5"});
  EXPECT_EQ(result.exit_code, 6);
  EXPECT_THAT(result.err, HasSubstr("check failed: /bed/column_number"));
  EXPECT_THAT(read_text(folder_ / "o/check/junit.xml"), HasSubstr("failures=\"1\""));
  EXPECT_THAT(read_text(folder_ / "o/report.html"), HasSubstr("failed"));
  const std::string summary = read_text(folder_ / "o/summary.md");
  EXPECT_THAT(summary, HasSubstr("**A check failed**"));
  EXPECT_THAT(summary, HasSubstr("| **failed** | /bed/column\\_number |"));
  EXPECT_EQ(run_recipe({"--set", "/stages/check/expect/~1bed~1column_number/value=5"}).exit_code, 6)
      << "also when nothing has to run";
}

TEST_F(Pipeline, VerifyNoticesEveryChangedFile) {
  ASSERT_EQ(run_recipe().exit_code, 0);
  EXPECT_EQ(run({"verify", "o"}).exit_code, 0);
  write_text(folder_ / "o/fit/curve.csv", "height\n");
  fs::remove(folder_ / "o/bed/layers.csv");
  const ProgramResult result = run({"verify", "o"});
  EXPECT_EQ(result.exit_code, 6);
  EXPECT_THAT(result.err, HasSubstr("fit/curve.csv: changed"));
  EXPECT_THAT(result.err, HasSubstr("bed/layers.csv: missing"));
  EXPECT_EQ(run({"verify", "nowhere"}).exit_code, 4);
  EXPECT_EQ(run({"status", "o"}).exit_code, 0);
  std::filesystem::create_directory(folder_ / "photographs");
  const ProgramResult none = run({"status", "photographs"});
  EXPECT_EQ(none.exit_code, 4);
  EXPECT_THAT(none.err, HasSubstr("photographs: this folder contains no results"));
}

TEST_F(Pipeline, ARunningPipelineHoldsTheFolderAndADeadOneDoesNot) {
  const int process =
      start_shakebed({"run", "r.json", "--out", "o", "--set", "/stages/bed/measure=1000 s"}, folder_.path());
  for (int i = 0; i < 500 && !fs::exists(folder_ / "o/.lock"); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const ProgramResult second = run_recipe();
  EXPECT_EQ(second.exit_code, 5);
  EXPECT_THAT(second.err, HasSubstr("another shakebed process uses this folder"));
  EXPECT_THAT(second.err, HasSubstr(std::to_string(process)));
  ::kill(process, SIGKILL);
  EXPECT_EQ(wait_for(process), 128 + SIGKILL);
  EXPECT_EQ(run_recipe().exit_code, 0) << "a killed run leaves no lock";
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_ / "o")) {
    EXPECT_THAT(entry.path().filename().string(), Not(testing::StartsWith(".partial"))) << "nor half a stage";
  }
}

TEST_F(Pipeline, CtrlCEndsWith130AndKeepsWhatWasFinished) {
  ASSERT_EQ(run_recipe().exit_code, 0);
  const std::string profile = read_text(folder_ / "o/bed/profile.csv");
  const int process =
      start_shakebed({"run", "r.json", "--out", "o", "--set", "/stages/bed/measure=1000 s"}, folder_.path());
  for (int i = 0; i < 500; ++i) {
    bool working = false;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder_ / "o"))
      working = working || entry.path().filename().string().starts_with(".partial");
    if (working) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ::kill(process, SIGINT);
  EXPECT_EQ(wait_for(process), 130);
  EXPECT_EQ(read_text(folder_ / "o/bed/profile.csv"), profile);
  EXPECT_EQ(read_json(folder_ / "o/manifest.json")["exit_code"], 130);
  EXPECT_EQ(run_recipe().exit_code, 0);
}

TEST_F(Pipeline, AStageThatFailsKeepsWhatWasFinishedBefore) {
  // A profile of the user's with a word for a number: found when its stage runs.
  write_text(folder_ / "bad.csv", "height,number_density\n1,many\n");
  std::string recipe = small_recipe();
  recipe.replace(recipe.find("{ \"stage\": \"check\""), 0,
                 R"({ "stage": "fit", "id": "other", "profile": "bad.csv", "plateau_density": 1.1 },)");
  write_text(folder_ / "r.json", recipe);
  const ProgramResult failed = run_recipe();
  EXPECT_EQ(failed.exit_code, 4) << failed.err;
  EXPECT_THAT(failed.err, HasSubstr("bad.csv"));
  EXPECT_TRUE(fs::is_regular_file(folder_ / "o/bed/profile.csv"));
  EXPECT_TRUE(fs::is_regular_file(folder_ / "o/fit/fit.json"));
  EXPECT_FALSE(fs::exists(folder_ / "o/other"));
  EXPECT_EQ(read_json(folder_ / "o/manifest.json")["exit_code"], 4);
  EXPECT_THAT(read_text(folder_ / "o/report.html"), HasSubstr("Why the run stopped"));
  EXPECT_THAT(read_text(folder_ / "o/summary.md"), HasSubstr("**Stopped**"));
  // Put right, only what is left runs.
  write_text(folder_ / "bad.csv", read_text(folder_ / "o/bed/profile.csv"));
  const ProgramResult mended = run_recipe();
  EXPECT_EQ(mended.exit_code, 0) << mended.err;
  EXPECT_THAT(mended.err, HasSubstr("bed: up to date"));
  EXPECT_THAT(mended.err, HasSubstr("other: done"));
}

TEST(FirstMinutes, FoldersAndPatternsWithoutFilesAreSaidInWords) {
  ScratchFolder folder;
  fs::create_directory(folder / "photos");
  const auto fit = [&](const char* files) {
    return run_shakebed({"fit-images", files, "--diameter", "3 mm", "--out", "o"}, folder.path());
  };
  const ProgramResult empty = fit("photos"), none = fit("photos/*.png"), missing = fit("photo");
  for (const ProgramResult* result : {&empty, &none, &missing}) EXPECT_EQ(result->exit_code, 4) << result->err;
  EXPECT_THAT(empty.err, HasSubstr("contains no file"));
  EXPECT_THAT(none.err, HasSubstr("no file matches"));
  EXPECT_THAT(missing.err, HasSubstr("there is no file"));
  EXPECT_FALSE(fs::exists(folder / "o"));
}

TEST_F(Pipeline, AFolderThatCannotBeWrittenIsSaid) {
  write_text(folder_ / "file", "not a folder");
  const ProgramResult result = run({"run", "r.json", "--out", "file/o"});
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_THAT(result.err, HasSubstr("file/o"));
}

TEST_F(Pipeline, RerunGivesTheSameFiles) {
  // Without the one file that holds a measured speed.
  ASSERT_EQ(run_recipe().exit_code, 0);
  const ProgramResult result = run({"rerun", "o", "--out", "again", "--json"});
  const Json json = Json::parse(result.out);
  for (const Json& name : json["different"]) EXPECT_EQ(name, "bed/observables.json");
  EXPECT_GE(json["files"].get<int>(), 10);
}

TEST_F(Pipeline, SweepsAreVerifiedToTheirPointsAndRunAgain) {
  write_text(folder_ / "s.json", R"({ "name": "s", "stages": [
    { "stage": "simulate", "id": "bed", "replicas": 1, "units": "reduced", "disks": { "count": 20, "restitution": 0.9 },
      "box": { "width": 5.3 }, "floor": { "motion": "sinusoidal", "amplitude": 0.5, "frequency": 0.5 },
      "settle": 5, "measure": 10 } ],
    "sweep": { "over": { "/stages/bed/seed": [1, 2] }, "collect": ["/bed/temperature_x"] } })");
  ASSERT_EQ(run({"run", "s.json", "--out", "o", "--quiet"}).exit_code, 0);
  EXPECT_EQ(run({"verify", "o"}).exit_code, 0);
  const ProgramResult again = run({"rerun", "o", "--out", "again", "--quiet"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.out, HasSubstr("identical"));
  std::string profile = read_text(folder_ / "o/points/000001/bed/profile.csv");
  profile.back() = ' ';
  write_text(folder_ / "o/points/000001/bed/profile.csv", profile);
  const ProgramResult damaged = run({"verify", "o"});
  EXPECT_EQ(damaged.exit_code, 6);
  EXPECT_THAT(damaged.err, HasSubstr("points/000001/bed/profile.csv: changed since the run"));
}

TEST_F(Pipeline, RerunSaysWhatWasChangedInTheFolderItself) {
  ASSERT_EQ(run_recipe().exit_code, 0);
  std::string profile = read_text(folder_ / "o/bed/profile.csv");
  profile.back() = ' ';
  write_text(folder_ / "o/bed/profile.csv", profile);
  const ProgramResult result = run({"rerun", "o", "--out", "again"});
  EXPECT_THAT(result.err, HasSubstr("o: bed/profile.csv: changed since the run"));
}

TEST_F(Pipeline, JsonAndQuietSpeakAsAsked) {
  const ProgramResult result = run_recipe({"--json", "--quiet"});
  EXPECT_EQ(result.exit_code, 0);
  const Json json = Json::parse(result.out);
  EXPECT_EQ(json["exit_code"], 0);
  EXPECT_EQ(json["stages"].size(), 3u);
  EXPECT_THAT(result.err, Not(HasSubstr("runs")));
}

TEST(Commands, UsageMistakesEndWith2) {
  ScratchFolder folder;
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{},
                                                    {"rnu", "x"},
                                                    {"run"},
                                                    {"run", "x", "--nonsense"},
                                                    {"theory", "--plateau-density", "2"},
                                                    {"theory", "--diameter", "3 Hz"},
                                                    {"theory", "--eos", "enskgo"},
                                                    {"map"}}) {
    const ProgramResult result = run_shakebed(arguments, folder.path());
    EXPECT_EQ(result.exit_code, 2) << (arguments.empty() ? "" : arguments.back()) << result.err;
    EXPECT_FALSE(result.err.empty());
  }
  EXPECT_THAT(run_shakebed({"rnu"}, folder.path()).err, HasSubstr("did you mean \"run\""));
  write_text(folder / "p.png", "");
  EXPECT_THAT(
      run_shakebed({"infer-bed", "p.png", "--diameter", "3 mm", "--frequency", "20 Hz", "--restitution", "0.9,0.8"},
                   folder.path())
          .err,
      HasSubstr("--restitution: expected LOW,HIGH with LOW below HIGH, both from 0 to 1; got 0.9,0.8"));
  EXPECT_EQ(run_shakebed({"--help"}, folder.path()).exit_code, 0);
  EXPECT_EQ(run_shakebed({"--version"}, folder.path()).exit_code, 0);
}

TEST(Commands, TheoryGivesTheConstantsAt110) {  // physics.md, computed by two independent routes
  ScratchFolder folder;
  const ProgramResult result = run_shakebed({"theory", "--plateau-density", "1.10", "--diameter", "2.99 mm",
                                             "--initial-height", "10.2", "--temperature", "0.36 mm", "--json"},
                                            folder.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  const auto close = [&](const char* name, double expected, double relative) {
    ASSERT_TRUE(json[name].is_number()) << name;
    EXPECT_NEAR(json[name].get<double>(), expected, relative * std::abs(expected)) << name;
  };
  close("f_plateau", 59.6676730322, 1e-11);
  close("mu_0", 55.2382744295, 1e-11);
  close("lambda_1", 1467.07052093, 1e-11);
  close("k", 0.0577754048718, 1e-11);
  close("critical_temperature_over_mg", 0.6073e-3, 1e-4);
  close("reduced_temperature", 0.5928, 1e-4);
  close("solid_height", 4.154, 1e-4);
  EXPECT_EQ(json["units"]["critical_temperature_over_mg"], "m");
  EXPECT_THAT(result.out, HasSubstr("1.1000000000000001")) << "17 digits";
}

TEST(Commands, APoleIsAStatusNotANumber) {
  ScratchFolder folder;
  const ProgramResult result =
      run_shakebed({"theory", "--eos", "santos-lopez-yuste", "--initial-height", "20", "--json"}, folder.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_TRUE(json["mu_0"].is_null());
  EXPECT_TRUE(json["critical_temperature"].is_null());
  EXPECT_THAT(json["status"]["mu_0"].get<std::string>(), HasSubstr("pole"));
}

TEST(Commands, TheoryOfEveryEquationOfState) {
  ScratchFolder folder;
  const ProgramResult result =
      run_shakebed({"theory", "--eos", "all", "--initial-height", "20", "--json"}, folder.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json rows = Json::parse(result.out);
  ASSERT_EQ(rows.size(), 7U);
  EXPECT_EQ(rows[0]["equation_of_state"], "enskog");
  EXPECT_NEAR(rows[0]["mu_0"].get<double>(), 111.311296763, 1e-8);
  for (const Json& row : rows) EXPECT_EQ(row["mu_0"].is_null(), row["status"].contains("mu_0"));
}

TEST(Commands, FitProfileSaysWhichOfSeveralDensitiesItRead) {
  ScratchFolder folder;
  std::string text = "zeta,phi_bin,nu_bin,phi_window\n";
  for (double z = 0.5; z < 30; z += 0.5) {
    const double phi = 0.5 * std::exp(-z / 5);
    const std::string density = std::to_string(phi);
    text += std::to_string(z) + "," + density + "," + std::to_string(0.785 * phi) + "," + density + "\n";
  }
  shakebed::pipelines::write_file_atomically(folder.path() / "bed.csv", text);
  const ProgramResult result = run_shakebed({"fit-profile", "bed.csv", "--json"}, folder.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json fit = Json::parse(result.out);
  EXPECT_THAT(fit["warnings"].dump(), HasSubstr("phi_bin"));
  EXPECT_THAT(fit["warnings"].dump(), HasSubstr("these columns are ignored: phi_window."));
}

TEST(Commands, InitWritesARecipeThatIsGood) {
  ScratchFolder folder;
  ASSERT_EQ(run_shakebed({"init", "mine.json"}, folder.path()).exit_code, 0);
  EXPECT_EQ(run_shakebed({"validate", "mine.json"}, folder.path()).exit_code, 0);
  EXPECT_EQ(run_shakebed({"init", "mine.json"}, folder.path()).exit_code, 2) << "never overwrites";
}

TEST(Commands, FitProfileRecoversATemperatureItDrew) {
  ScratchFolder folder;
  // A profile drawn from the model itself: T = 0.12 m g D, plateau 1.1, shift 4 D.
  const auto profile = shakebed::fit::HydrostaticProfile::tail_over_rectangle(shakebed::fit::enskog(), 0.12, 4.0, 1.1);
  std::string text = "# kernel: none\nheight,number_density,std_error\n";
  for (int i = 2; i < 80; ++i)
    text += std::to_string(0.1 * i) + "," + std::to_string(profile.density(0.1 * i)) + ",0.001\n";
  write_text(folder / "p.csv", text);
  const ProgramResult result = run_shakebed(
      {"fit-profile", "p.csv", "--plateau-density", "1.1", "--diameter", "2.99 mm", "--json"}, folder.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = Json::parse(result.out);
  EXPECT_NEAR(json["temperature"]["value"].get<double>(), 0.12, 1e-3);
  EXPECT_NEAR(json["shift"]["value"].get<double>(), 4.0, 1e-2);
  EXPECT_NEAR(json["temperature_over_mg"]["value"].get<double>(), 0.12 * 2.99e-3, 1e-5);
  EXPECT_TRUE(json["describes_data"].get<bool>());
}

TEST(ReferenceData, IsThatOfThePublishedFit) {
  const Json data =
      read_json(fs::path(SHAKEBED_SOURCE_DIR) / "reference-data/quinn-hong-2000/clement-rajchenbach-1991.json");
  const auto number = [&](const std::string& name) {
    for (const char* list : {"printed", "derived"}) {
      for (const Json& row : data[list]) {
        if (row["name"] == name) return row["value"].get<double>();
      }
    }
    ADD_FAILURE() << name;
    return 0.0;
  };
  const shakebed::fit::PublishedFit fit;
  EXPECT_EQ(number("diameter"), fit.diameter_in_mm);
  EXPECT_EQ(number("initial_height"), fit.initial_height);
  EXPECT_EQ(number("plateau_density"), fit.plateau_density);
  EXPECT_EQ(number("temperature_over_mg"), fit.temperature_over_mg_in_mm);
  EXPECT_EQ(number("shift_times_plateau"), fit.shift_times_plateau);
  for (const Json& row : data["printed"]) EXPECT_FALSE(row["place"].get<std::string>().empty());
}

// Each input that the paper does not print is said to be from the literature or assumed, with the value of the recipe,
// and the report says which.
TEST(ReferenceData, KeepsApartWhatIsNotPrinted) {
  const fs::path project = SHAKEBED_SOURCE_DIR;
  const Json data = read_json(project / "reference-data/quinn-hong-2000/clement-rajchenbach-1991.json"),
             recipe = read_json(project / "pipelines/recipes/clement-rajchenbach/figure.json");
  std::map<std::string, std::string> why;
  for (const Json& row : recipe["report"]["assumed"]) why[row["input"]] = row["why"];
  const auto& stages = recipe["stages"];
  const Json bed =
      *std::find_if(stages.begin(), stages.end(), [](const Json& one) { return one.value("id", "") == "bed"; });
  std::size_t rows = 0;
  for (const auto& [list, words] : {std::pair{"from_the_literature", "from the literature"}, {"assumed", "assumed"}}) {
    for (const Json& row : data[list]) {
      const std::string input = row["input"];
      EXPECT_EQ(bed.at(Json::json_pointer(input.substr(std::string("/stages/bed").size()))), row["value"]) << input;
      EXPECT_EQ(why[input].rfind(words, 0), 0U) << input << ": " << why[input];
      ++rows;
    }
  }
  EXPECT_EQ(rows, why.size());
}

TEST(Recipes, AllShippedOnesAreGood) {
  ScratchFolder folder;
  int recipes = 0;
  for (const fs::directory_entry& entry :
       fs::recursive_directory_iterator(fs::path(SHAKEBED_SOURCE_DIR) / "pipelines/recipes")) {
    if (entry.path().extension() != ".json") continue;
    const ProgramResult result = run_shakebed({"validate", entry.path().string()}, folder.path());
    EXPECT_EQ(result.exit_code, 0) << entry.path() << result.err;
    ++recipes;
  }
  EXPECT_GE(recipes, 3);
}

// A recipe with every option written out means the same, and can be read.
TEST(Recipes, AreTheSameWithEveryOptionWrittenOut) {
  for (const fs::directory_entry& entry :
       fs::recursive_directory_iterator(fs::path(SHAKEBED_SOURCE_DIR) / "pipelines/recipes")) {
    if (entry.path().extension() != ".json") continue;
    const fs::path folder = entry.path().parent_path();
    const std::string once = written_out(read_text(entry.path()), folder);
    EXPECT_EQ(written_out(once, folder), once) << entry.path();
  }
}

TEST(Schema, TheOneInTheTreeIsTheProgramsOwn) {
  ScratchFolder folder;
  EXPECT_EQ(run_shakebed({"schema"}, folder.path()).out,
            read_text(fs::path(SHAKEBED_SOURCE_DIR) / "pipelines/schema/pipeline.schema.json"))
      << "run: shakebed schema pipelines/schema/pipeline.schema.json";
}

}  // namespace
