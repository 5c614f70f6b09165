// Commands that read results folders: status, clean, verify and rerun, of folders made by hand or of two maps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/runner/cache.hpp"
#include "pipelines/runner/folder_lock.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::tests::folder_commands {
namespace {

namespace fs = std::filesystem;
using pipelines::dump;
using pipelines::Json;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class FolderCommands : public testing::Test {
 protected:
  ProgramResult run(const std::vector<std::string>& arguments) { return run_shakebed(arguments, folder_.path()); }
  // A finished stage with one file of four bytes, and one that has another size now.
  void add_stage(const std::string& id, bool damaged, double seconds = -1) {
    fs::create_directories(folder_ / ("o/" + id));
    pipelines::StageRecord record;
    record.stage = "map", record.id = id, record.code = "c-" + id;
    record.outputs = {{.file = "a.csv", .bytes = 4, .fast = "f", .sha256 = "s"},
                      {.file = "b.csv", .bytes = damaged ? 6U : 5U, .fast = "f", .sha256 = "s"}};
    write_text(folder_ / ("o/" + id + "/a.csv"), "four"), write_text(folder_ / ("o/" + id + "/b.csv"), "fives");
    write_text(folder_ / ("o/" + id + "/.record"), dump(record.to_json()));
    if (seconds < 0) return;
    pipelines::StageCost cost;
    cost.wall_seconds = seconds;
    write_text(folder_ / ("o/" + id + "/cost.json"), dump(cost.to_json()));
  }
  void write_manifest(const std::string& exit_code) {
    write_text(folder_ / "o/manifest.json", R"({ "pipeline": "p", "finished": "2026-01-02T03:04:05Z", "exit_code": )" +
                                                exit_code + R"(, "wall_seconds": 2, "other": 1 })");
  }
  std::string first_line() {
    const std::string text = run({"status", "o"}).out;
    return text.substr(0, text.find('\n'));
  }
  ScratchFolder folder_;
};

// Stages by name, with files, bytes and time; those that have begun are the ones with a file in .scratch.
TEST_F(FolderCommands, StatusListsStages) {
  add_stage("two", true), add_stage("one", false, 75);
  for (const char* made : {"o/.scratch/three/key", "o/.scratch/four/key", "o/.scratch/one/key"})
    fs::create_directories(folder_ / made);
  write_text(folder_ / "o/.scratch/three/key/checkpoint", "x"),
      write_text(folder_ / "o/.scratch/one/key/checkpoint", "x");
  write_manifest("0");
  const ProgramResult found = run({"status", "o"});
  EXPECT_EQ(found.exit_code, 0);
  EXPECT_EQ(found.out,
            "o: finished 2026-01-02T03:04:05Z\n"
            "  one              map            2 files            9 bytes        75 s\n"
            "  two              map            2 files           10 bytes              damaged: b.csv\n"
            "  three            started, not finished: its state is kept\n");
  const Json json = Json::parse(run({"status", "o", "--json"}).out);
  EXPECT_EQ(json["folder"], "o");
  EXPECT_EQ(json["running"], false);
  EXPECT_EQ(json["pipeline"], "p");
  EXPECT_EQ(json["wall_seconds"], 2);
  EXPECT_FALSE(json.contains("other"));
  EXPECT_FALSE(json.contains("sweep"));
  EXPECT_EQ(json["stages"][0], Json::parse(R"({ "id": "one", "stage": "map", "code": "c-one", "wall_seconds": 75.0,
                                                "files": 2, "bytes": 9, "damaged": [] })"));
  EXPECT_TRUE(json["stages"][1]["wall_seconds"].is_null());
  EXPECT_EQ(json["stages"][1]["damaged"], Json::parse(R"(["b.csv"])"));
  EXPECT_EQ(json["begun"], Json::parse(R"(["three"])"));
}

TEST_F(FolderCommands, StatusSaysHowTheLastRunEnded) {
  add_stage("one", false);
  EXPECT_EQ(first_line(), "o: no finished run");
  for (const auto& [code, words] :
       {std::pair("0", "finished 2026-01-02T03:04:05Z"),
        {"6", "finished 2026-01-02T03:04:05Z; a check failed"},
        {"130", "interrupted 2026-01-02T03:04:05Z. Start the same command again to continue"},
        {"4", "failed 2026-01-02T03:04:05Z with exit code 4"}}) {
    write_manifest(code);
    EXPECT_EQ(first_line(), std::string("o: ") + words);
  }
  const pipelines::FolderLock lock(folder_ / "o");
  EXPECT_EQ(first_line(), "o: running now");
}

TEST_F(FolderCommands, StatusCountsPointsAndJobs) {
  fs::create_directories(folder_ / "o/points/000000"), fs::create_directories(folder_ / "o/points/000001");
  fs::create_directories(folder_ / "o/points/000007"), fs::create_directories(folder_ / "o/slurm");
  write_text(folder_ / "o/points/.sweep", R"({ "points": 3 })");
  write_text(folder_ / "o/slurm/submitted.json", R"({ "job": "12", "gather_job": "13" })");
  const std::string text = run({"status", "o"}).out;
  EXPECT_THAT(text, HasSubstr("  sweep: 0 of 3 points done, 0 failed\n"));
  EXPECT_THAT(text, HasSubstr("  1 folders of points that are no longer in the sweep: they are kept and used again if "
                              "the sweep gets these points back\n"));
  EXPECT_THAT(text,
              HasSubstr("  last submitted to Slurm: array job 12, job 13, which gathers the results (squeue --jobs "
                        "12,13 shows whether they have ended)\n"));
  write_text(folder_ / "o/slurm/submitted.json", R"({ "job": "", "gather_job": "13" })");
  fs::remove(folder_ / "o/points/000007");
  const std::string alone = run({"status", "o"}).out;
  EXPECT_THAT(alone, HasSubstr("Slurm: job 13, which gathers the results (squeue --jobs 13 shows"));
  EXPECT_THAT(alone, Not(HasSubstr("no longer in the sweep")));
}

// Versions before 1.0 left the number of points in the summary alone.
TEST_F(FolderCommands, StatusCountsThePointsOfAnOldSweep) {
  fs::create_directories(folder_ / "o/points/000004"), fs::create_directories(folder_ / "o/points/000005");
  write_text(folder_ / "o/summary.json", R"({ "points": 5 })");
  EXPECT_EQ(Json::parse(run({"status", "o", "--json"}).out)["sweep"],
            Json::parse(R"({ "points": 5, "done": 0, "failed": 0, "left_over": 1 })"));
  write_text(folder_ / "o/points/.sweep", R"({ "points": 6 })");
  EXPECT_EQ(Json::parse(run({"status", "o", "--json"}).out)["sweep"]["points"], 6);
}

TEST_F(FolderCommands, StatusOfNoResultsIsAnError) {
  const ProgramResult missing = run({"status", "none"});
  EXPECT_EQ(missing.exit_code, 4);
  EXPECT_THAT(missing.err, HasSubstr("none: there is no such folder"));
  fs::create_directories(folder_ / "o/pictures");
  const ProgramResult empty = run({"status", "o"});
  EXPECT_EQ(empty.exit_code, 4);
  EXPECT_THAT(empty.err, HasSubstr("o: this folder contains no results, and no stage was started in it"));
  write_manifest("4");
  EXPECT_EQ(run({"status", "o"}).out, "o: failed 2026-01-02T03:04:05Z with exit code 4\n  no finished stage\n");
  fs::remove(folder_ / "o/manifest.json");
  fs::create_directories(folder_ / "o/slurm");
  EXPECT_EQ(run({"status", "o"}).exit_code, 0) << "jobs were submitted";
}

// --- clean

class CleanedFolders : public FolderCommands {
 protected:
  // A results folder whose manifest was written so many seconds ago.
  void results(const std::string& name, double age) {
    fs::create_directories(folder_ / ("results/" + name));
    const fs::path manifest = folder_ / ("results/" + name + "/manifest.json");
    write_text(manifest, "{}");
    fs::last_write_time(manifest, fs::file_time_type::clock::now() - std::chrono::seconds(static_cast<long>(age)));
  }
};

TEST_F(CleanedFolders, AreThoseOfTheirAge) {
  results("b", 100'000), results("a", 7000);
  fs::create_directories(folder_ / "results/photos");
  const auto would = [&](const std::string& age) {
    const ProgramResult ran = run({"clean", "--older-than", age, "--dry-run"});
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return ran.out;
  };
  EXPECT_EQ(would("1d"), "would remove results/b\n");
  EXPECT_EQ(would("1.2d"), "nothing to remove\n");
  EXPECT_EQ(would("27h"), "would remove results/b\n");
  EXPECT_EQ(would("28h"), "nothing to remove\n");
  EXPECT_EQ(would("116min"), "would remove results/a\nwould remove results/b\n");
  EXPECT_EQ(would("118min"), "would remove results/b\n");
  for (const char* age : {"30", "3w", "d"}) {
    const ProgramResult refused = run({"clean", "--older-than", age});
    EXPECT_EQ(refused.exit_code, 2) << age;
    EXPECT_THAT(refused.err, HasSubstr("--older-than")) << age;
  }
  EXPECT_THAT(run({"clean", "--older-than", "3w"}).err,
              HasSubstr("\"3w\" is not an age; write a number of days, hours or minutes: 30d, 12h, 90min"));
  EXPECT_TRUE(fs::exists(folder_ / "results/b"));
}

TEST_F(CleanedFolders, AreRemovedWithWhatIsInThem) {
  results("a", 10), results("b", 10);
  fs::create_directories(folder_ / "results/photos");
  {
    const pipelines::FolderLock lock(folder_ / "results/a");
    EXPECT_EQ(run({"clean", "results/a"}).exit_code, 5) << "a run is in it";
  }
  EXPECT_EQ(run({"clean", "results/a"}).out, "removed results/a\n");
  EXPECT_FALSE(fs::exists(folder_ / "results/a"));
  EXPECT_EQ(Json::parse(run({"clean", "--dry-run", "--json"}).out),
            Json::parse(R"({ "removed": ["results/b"], "dry_run": true })"));
  EXPECT_EQ(Json::parse(run({"clean", "results", "--json"}).out),
            Json::parse(R"({ "removed": ["results/b"], "dry_run": false })"));
  EXPECT_EQ(run({"clean"}).out, "nothing to remove\n");
  EXPECT_TRUE(fs::exists(folder_ / "results/photos")) << "it is not of a run";
  EXPECT_THAT(run({"clean", "none"}).err, HasSubstr("none: there is no such folder"));
}

// --- verify and rerun

class TwoMaps : public FolderCommands {
 protected:
  TwoMaps() {
    write_text(folder_ / "r.json", R"({ "name": "maps", "stages": [
      { "stage": "map", "id": "one", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 },
      { "stage": "map", "id": "two", "gamma": 3, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 } ] })");
    EXPECT_EQ(run({"run", "r.json", "--out", "o", "--quiet"}).exit_code, 0);
  }
};

TEST_F(TwoMaps, AreVerified) {
  const ProgramResult good = run({"verify", "o"});
  EXPECT_EQ(good.exit_code, 0);
  EXPECT_EQ(good.out, "o: all 10 files agree with the manifest\n");
  EXPECT_THAT(good.err, IsEmpty());
  write_text(folder_ / "o/two/map.csv", "changed");
  const ProgramResult bad = run({"verify", "o"});
  EXPECT_EQ(bad.exit_code, 6);
  EXPECT_EQ(bad.out, "o: 1 of 10 files differ from the manifest\n");
  EXPECT_THAT(bad.err, HasSubstr("two/map.csv"));
  const Json json = Json::parse(run({"verify", "o", "--json"}).out);
  EXPECT_EQ(json["files"], 10);
  EXPECT_EQ(json["problems"].size(), 1U);
  for (const auto& [what, words] : {std::pair("r.json", "r.json: this is a file. Give the results folder"),
                                    {"none", "none: there is no such folder"},
                                    {".", "this folder contains no manifest.json, so no run has ended in it"}}) {
    const ProgramResult refused = run({"verify", what});
    EXPECT_EQ(refused.exit_code, 4) << what;
    EXPECT_THAT(refused.err, HasSubstr(words));
  }
}

TEST_F(TwoMaps, AreRunAgain) {
  const ProgramResult same = run({"rerun", "o", "--quiet"});
  EXPECT_EQ(same.exit_code, 0) << same.err;
  EXPECT_EQ(same.out, "identical: all 6 files of the stages have the fingerprints stated in o/manifest.json\n");
  EXPECT_TRUE(fs::exists(folder_ / "o-rerun/two/map.json"));
  EXPECT_EQ(Json::parse(run({"rerun", "o", "--out", "p", "--quiet", "--json"}).out),
            Json::parse(R"({ "files": 6, "different": [], "out": "p" })"));
  const ProgramResult itself = run({"rerun", "o", "--out", "o"});
  EXPECT_EQ(itself.exit_code, 2);
  EXPECT_THAT(itself.err, HasSubstr("--out: a rerun cannot write into the results folder that it repeats"));
  Json manifest = Json::parse(read_text(folder_ / "o/manifest.json"));
  manifest["stages"][1]["outputs"][0]["sha256"] = "other";
  write_text(folder_ / "o/manifest.json", manifest.dump());
  const ProgramResult other = run({"rerun", "o", "--quiet"});
  EXPECT_EQ(other.exit_code, 6);
  EXPECT_EQ(other.out, "1 of 6 files differ\n");
  EXPECT_THAT(other.err,
              HasSubstr("differs: " + manifest["stages"][1]["outputs"][0]["file"].get<std::string>() + "\n"));
  manifest.erase("document");
  write_text(folder_ / "o/manifest.json", manifest.dump());
  EXPECT_THAT(run({"rerun", "o"}).err, HasSubstr("o/manifest.json: is not a manifest written by shakebed"));
}

// --- commands on recipes

TEST_F(TwoMaps, AreDrawnAndChecked) {
  write_text(folder_ / "g.json", R"({ "name": "g", "stages": [
      { "stage": "map", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 },
      { "stage": "check", "from": "map", "expect": { "/map/gamma": { "value": 4, "absolute": 0.1 } } } ] })");
  EXPECT_EQ(Json::parse(run({"graph", "g.json", "--json"}).out),
            Json::parse(R"({ "nodes": [ { "id": "map", "stage": "map" }, { "id": "check", "stage": "check" } ],
                             "edges": [ [ "map", "check" ] ] })"));
  EXPECT_THAT(run({"graph", "g.json"}).out, testing::StartsWith("digraph"));
  EXPECT_THAT(run({"graph", "g.json", "--format", "mermaid"}).out, testing::StartsWith("flowchart LR\n"));
  EXPECT_EQ(run({"graph", "g.json", "--format", "png"}).exit_code, 2);
  EXPECT_EQ(run({"validate", "r.json"}).out, "r.json: valid: 2 stages\n");
  EXPECT_EQ(run({"validate", "r.json", "--quiet"}).out, "");
  EXPECT_EQ(Json::parse(run({"validate", "r.json", "--json"}).out),
            Json::parse(R"({ "valid": true, "name": "maps", "stages": 2, "warnings": [] })"));
  write_text(folder_ / "weak.json", R"({ "name": "weak", "stages": [ { "stage": "simulate", "units": "reduced",
      "disks": { "count": 40, "restitution": 0.9 }, "box": { "width": 10.3 }, "settle": 40, "measure": 40,
      "floor": { "motion": "sinusoidal", "amplitude": 0.05, "frequency": 0.5 } } ] })");
  const ProgramResult odd = run({"validate", "weak.json", "--json"});
  EXPECT_EQ(odd.exit_code, 0);
  const Json warnings = Json::parse(odd.out)["warnings"];
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_EQ(warnings[0]["line"], 3);
  EXPECT_EQ(warnings[0]["pointer"], "/stages/0/floor/amplitude");
  EXPECT_THAT(run({"validate", "weak.json"}).err,
              HasSubstr("warning: weak.json:3:55: /stages/0/floor/amplitude: Gamma = 0.493"));
  const ProgramResult wrong = run({"validate", "r.json", "--set", "/stages/one/gamma=-1", "--json"});
  EXPECT_EQ(wrong.exit_code, 3);
  const Json problem = Json::parse(wrong.out)["problems"][0];
  EXPECT_EQ(problem["file"], "--set");
  EXPECT_EQ(problem["line"], 0);
  EXPECT_EQ(problem["pointer"], "/stages/0/gamma");
  EXPECT_EQ(problem["problem"], "must be above 0, got -1");
}

TEST_F(TwoMaps, SayWhatWouldRun) {
  const Json kept = Json::parse(run({"run", "r.json", "--out", "o", "--dry-run", "--json", "--only", "two"}).out);
  EXPECT_EQ(kept, Json::parse(R"([ { "id": "one", "stage": "map", "runs": false, "state": "not selected", "why": [] },
                                   { "id": "two", "stage": "map", "runs": false, "state": "up to date", "why": [] } ])"));
  const Json forced = Json::parse(run({"run", "r.json", "--out", "o", "--dry-run", "--json", "--force"}).out);
  EXPECT_EQ(forced[1]["runs"], true);
  EXPECT_EQ(forced[1]["why"], Json::parse(R"(["--force was given"])"));
  const Json ran = Json::parse(run({"run", "r.json", "--out", "o", "--json", "--quiet", "--from", "two"}).out);
  EXPECT_EQ(ran["pipeline"], "maps");
  EXPECT_EQ(ran["out"], "o");
  EXPECT_EQ(ran["exit_code"], 0);
  EXPECT_EQ(ran["stages"][0], Json::parse(R"({ "id": "one", "stage": "map", "state": "not selected" })"));
  EXPECT_EQ(ran["stages"][1], Json::parse(R"({ "id": "two", "stage": "map", "state": "up to date" })"));
  EXPECT_EQ(ran["failed_checks"], Json::array());
  EXPECT_EQ(ran["summary"]["status"], "ok");
  EXPECT_THAT(run({"run", "r.json", "--out", "o", "--gather"}).err,
              HasSubstr("--gather: this recipe has no \"sweep\", so there is nothing to gather"));
  EXPECT_THAT(run({"run", "r.json", "--out", "o", "--shard", "1/2"}).err,
              HasSubstr("--shard: this recipe has no \"sweep\", so it has one point only"));
}

}  // namespace
}  // namespace shakebed::tests::folder_commands
