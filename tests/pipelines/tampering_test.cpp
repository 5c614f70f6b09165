// What is kept and what runs again: files changed without changing their length, and each part of what a stage's result
// is made from.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <set>
#include <vector>

#include "pipelines/formats/files.hpp"
#include "pipelines/runner/cache.hpp"
#include "pipelines/runner/run_stage.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::ElementsAre;
using testing::HasSubstr;
namespace fs = std::filesystem;

// One digit becomes another; the length stays. The last one, which is no part of a header.
void change_a_digit(const fs::path& path) {
  std::string text = read_text(path);
  const std::size_t at = text.find_last_of("0123456789");
  ASSERT_NE(at, std::string::npos) << path;
  text[at] = text[at] == '9' ? '8' : static_cast<char>(text[at] + 1);
  write_text(path, text);
}

class Tampering : public testing::Test {
 protected:
  Tampering() {
    write_text(folder_ / "r.json", small_recipe());
    run({"run", "r.json", "--out", "o"});
  }
  ProgramResult run(const std::vector<std::string>& arguments) { return run_shakebed(arguments, folder_.path()); }
  std::string dry_run() { return run({"run", "r.json", "--out", "o", "--dry-run"}).out; }
  ScratchFolder folder_;
};

TEST_F(Tampering, OfTheSameLengthIsNoticedInEveryTableAndResult) {
  ASSERT_THAT(dry_run(), HasSubstr("check: up to date"));
  std::size_t tried = 0;
  for (const auto& [stage, name] : {std::pair{"bed", "profile.csv"},
                                    {"bed", "covariance.csv"},
                                    {"bed", "layers.csv"},
                                    {"bed", "observables.json"},
                                    {"bed", "bed.json"},
                                    {"bed", "profile.csv-metadata.json"},
                                    {"bed", "final.extxyz"},
                                    {"fit", "fit.json"},
                                    {"fit", "curve.csv"},
                                    {"fit", "residuals.csv"},
                                    {"fit", "windows.csv"},
                                    {"check", "check.json"},
                                    {"check", "junit.xml"}}) {
    const fs::path path = folder_ / "o" / stage / name;
    const std::string before = read_text(path);
    const auto written = fs::last_write_time(path);
    change_a_digit(path);
    fs::last_write_time(path, written);
    ASSERT_EQ(fs::file_size(path), before.size());
    EXPECT_THAT(dry_run(), HasSubstr(std::string(stage) + ": runs: its output " + name + " was changed after the run"));
    const ProgramResult verified = run({"verify", "o"});
    EXPECT_EQ(verified.exit_code, 6);
    EXPECT_THAT(verified.err, HasSubstr(std::string(stage) + "/" + name + ": changed"));
    write_text(path, before);
    ++tried;
  }
  EXPECT_EQ(tried, 13U);
  EXPECT_EQ(run({"verify", "o"}).exit_code, 0);
  EXPECT_THAT(dry_run(), HasSubstr("bed: up to date"));
}

TEST_F(Tampering, IsMadeGoodByTheNextRun) {
  const std::string before = read_text(folder_ / "o/bed/observables.json");
  change_a_digit(folder_ / "o/bed/observables.json");
  ASSERT_EQ(run({"run", "r.json", "--out", "o"}).exit_code, 0);
  EXPECT_EQ(read_text(folder_ / "o/bed/observables.json"), before);
  EXPECT_EQ(run({"verify", "o"}).exit_code, 0);
}

TEST_F(Tampering, OfTheSameLengthIsNoticedInAFileOfTheUser) {
  std::string profile = "height,number_density,std_error\n";
  for (int i = 0; i < 30; ++i)
    profile += std::to_string(0.5 * i) + "," + std::to_string(1.1 / (1 + std::exp((0.5 * i - 7) / 0.8))) + ",0.01\n";
  write_text(folder_ / "p.csv", profile);
  write_text(folder_ / "f.json", R"({ "name": "f", "stages": [ { "stage": "fit", "profile": "p.csv" } ] })");
  ASSERT_EQ(run({"run", "f.json", "--out", "f"}).exit_code, 0);
  EXPECT_THAT(run({"run", "f.json", "--out", "f", "--dry-run"}).out, HasSubstr("fit: up to date"));
  const auto written = fs::last_write_time(folder_ / "p.csv");
  change_a_digit(folder_ / "p.csv");
  fs::last_write_time(folder_ / "p.csv", written);
  EXPECT_THAT(run({"run", "f.json", "--out", "f", "--dry-run"}).out, HasSubstr("p.csv changed"));
}

StageRecord a_record() {
  StageRecord record;
  record.stage = "fit", record.id = "fit", record.code = "c0de", record.seed = 5;
  record.options = Json{{"model", "fermi"}, {"window", Json{{"low", 2}}}};
  record.inputs = {{"bed/profile.csv", 100, "aaaa", ""}, {"bed/bed.json", 50, "bbbb", ""}};
  return record;
}
// Each way in which the same stage of a recipe can be other work.
const std::vector<std::pair<std::string, std::function<void(StageRecord&)>>> changes{
    {"in the last run it was a fit stage", [](StageRecord& r) { r.stage = "map"; }},
    {"the code of fit changed", [](StageRecord& r) { r.code = "c0df"; }},
    {"seed changed 5 → 6", [](StageRecord& r) { r.seed = 6; }},
    {"units changed", [](StageRecord& r) { r.reduced = true; }},
    {"model changed \"fermi\" → \"feron\"", [](StageRecord& r) { r.options["model"] = "feron"; }},
    {"window/low changed 2 → 3", [](StageRecord& r) { r.options["window"]["low"] = 3; }},
    {"window/high was added: 9", [](StageRecord& r) { r.options["window"]["high"] = 9; }},
    {"model was removed (it was \"fermi\")", [](StageRecord& r) { r.options.erase("model"); }},
    {"input bed/profile.csv changed", [](StageRecord& r) { r.inputs[0].fast = "aaab"; }},
    {"input bed/bed.json changed", [](StageRecord& r) { r.inputs[1].fast = "bbba"; }},
    {"input bed/other.csv was added", [](StageRecord& r) { r.inputs[0].file = "bed/other.csv"; }},
    {"some of its inputs were removed", [](StageRecord& r) { r.inputs.pop_back(); }},
};

TEST(ReasonsToRun, NameEachThingThatChanged) {
  const ScratchFolder folder;
  EXPECT_TRUE(reasons_to_run(a_record(), a_record(), folder.path()).empty());
  EXPECT_EQ(reasons_to_run(a_record(), std::nullopt, folder.path()).at(0), "it has not run yet");
  for (const auto& [reason, change] : changes) {
    StageRecord fresh = a_record();
    change(fresh);
    EXPECT_THAT(reasons_to_run(fresh, a_record(), folder.path()), testing::Contains(HasSubstr(reason))) << reason;
  }
}

// Of many files two are named; of what it made, three; the code's change has the day of the last run.
TEST(ReasonsToRun, AreFewOfManyFiles) {
  const ScratchFolder folder;
  const auto reasons = [&](const StageRecord& fresh, const StageRecord& found) {
    return reasons_to_run(fresh, found, folder.path());
  };
  StageRecord found = a_record(), fresh = a_record();
  for (const char* name : {"c", "d"}) fresh.inputs.push_back({name, 1, "x", ""});
  fresh.inputs[1].fast = "bbba";
  EXPECT_THAT(reasons(fresh, found),
              ElementsAre("input bed/bed.json changed", "input c was added", "input d was added"));
  fresh.inputs[0].fast = "aaab";
  EXPECT_THAT(reasons(fresh, found),
              ElementsAre("input bed/profile.csv changed", "input bed/bed.json changed", "and 2 more inputs"));
  found.outputs = {{"a", 3, fast_hash("abc"), ""},
                   {"b", 3, fast_hash("abc"), ""},
                   {"c", 3, fast_hash("abc"), ""},
                   {"d", 3, fast_hash("abc"), ""},
                   {"e", 3, fast_hash("abc"), ""}};
  for (const char* name : {"a", "c"}) write_text(folder / name, "abc");
  write_text(folder / "b", "abd");
  EXPECT_THAT(reasons(a_record(), found), ElementsAre("its output b was changed after the run",
                                                      "its output d is missing", "its output e is missing"));
  write_text(folder / "a", "abcd"), fs::remove(folder / "c");
  EXPECT_THAT(reasons(a_record(), found),
              ElementsAre("its output a was changed after the run", "its output b was changed after the run",
                          "its output c is missing"));
  for (const char* name : {"a", "b", "c", "d", "e"}) write_text(folder / name, "abc");
  EXPECT_THAT(reasons(a_record(), found), testing::IsEmpty());
  found.code = "c0dd";
  EXPECT_THAT(reasons(a_record(), found), ElementsAre("the code of fit changed"));
  StageCost cost;
  cost.finished = "2026-01-02T03:04:05Z";
  write_text(folder.path() / cost_name, cost.to_json().dump());
  EXPECT_THAT(reasons(a_record(), found), ElementsAre("the code of fit changed since 2026-01-02"));
}

TEST(Differences, AreOfLeavesInShort) {
  const std::string long_one(59, 'x'), longer(58, 'x');
  EXPECT_THAT(differences(Json::parse(R"({"a": {"b": 1, "c": [1, 2]}, "d": {}, "e": 5})"),
                          Json::parse(R"({"a": {"b": 1, "c": [1, 3]}, "d": {"f": true}, "g/$comment": "x"})")),
              ElementsAre("a/c changed [1,2] → [1,3]", "d/f was added: true", "d was removed (it was {})",
                          "e was removed (it was 5)"));
  EXPECT_THAT(differences(Json{{"a", longer}}, Json{{"a", long_one}}),
              ElementsAre("a changed \"" + longer + "\" → \"" + std::string(56, 'x') + "..."))
      << "60 letters are shown, of 61 the first 57";
}

// What a stage cost comes back; a file that is no cost is none. Its fingerprints are those of its other files.
TEST(StageFolder, HasItsCostAndTheFingerprintsOfItsFiles) {
  const ScratchFolder folder;
  EXPECT_FALSE(read_cost(folder.path()));
  const StageCost cost{.wall_seconds = 1.5,
                       .cpu_seconds = 5.5,
                       .threads = 4,
                       .host = "h",
                       .finished = "2026-01-02T03:04:05Z",
                       .timings = Json{{"events", 7}, {"parts", {{"settle", 0.5}}}}};
  write_text(folder.path() / cost_name, cost.to_json().dump());
  const auto back = read_cost(folder.path());
  ASSERT_TRUE(back);
  EXPECT_EQ(back->to_json(), cost.to_json());
  EXPECT_EQ(back->timings, cost.timings);
  EXPECT_EQ(back->cpu_seconds, 5.5);
  EXPECT_EQ(back->threads, 4);
  write_text(folder.path() / record_name, "x"), write_text(folder / "log.txt", "x");
  fs::create_directories(folder / "b/c");
  write_text(folder / "b/c/d.csv", "abc"), write_text(folder / "a", ""), write_text(folder / "b/log.txt", "x");
  const std::vector<Fingerprint> files = fingerprint_directory(folder.path(), true);
  ASSERT_EQ(files.size(), 3U);
  EXPECT_EQ(files[0].file, "a");
  EXPECT_EQ(files[0].bytes, 0U);
  EXPECT_EQ(files[1].file, "b/c/d.csv");
  EXPECT_EQ(files[1].bytes, 3U);
  EXPECT_EQ(files[1].fast, fast_hash("abc"));
  EXPECT_EQ(files[1].sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(files[2].file, "b/log.txt") << "the log is that beside the record";
  EXPECT_EQ(fingerprint_directory(folder.path(), false)[1].sha256, "");
  for (const char* text : {"{}", "x", R"({"wall_seconds": "1", "cpu_seconds": 1})"}) {
    write_text(folder.path() / cost_name, text);
    EXPECT_FALSE(read_cost(folder.path())) << text;
  }
}

// A scratch folder belongs to one work: another seed, other code, options or inputs find none of it.
TEST(WorkKey, IsAnotherForEachThingThatChanged) {
  std::set<std::string> keys{work_key(a_record())};
  EXPECT_EQ(work_key(a_record()), *keys.begin());
  for (const auto& [reason, change] : changes) {
    StageRecord other = a_record();
    change(other);
    EXPECT_TRUE(keys.insert(work_key(other)).second) << reason;
  }
}

TEST(StageRecords, ComeBackFromTheirFile) {
  StageRecord record = a_record();
  record.outputs = {{"fit.json", 321, "cccc", "dddd"}};
  record.warnings = {"odd"}, record.failed_checks = {"off"}, record.reduced = true;
  const Json json = record.to_json();
  const StageRecord back = StageRecord::from_json(json, "record");
  EXPECT_EQ(back.to_json(), json);
  EXPECT_EQ(back.outputs.at(0).bytes, 321U);
  EXPECT_EQ(back.outputs.at(0).sha256, "dddd");
  EXPECT_EQ(back.inputs.at(1).fast, "bbbb");
  EXPECT_EQ(back.code, "c0de");
  EXPECT_EQ(back.seed, 5U);
  EXPECT_TRUE(back.reduced);
  EXPECT_EQ(back.failed_checks.at(0), "off");
  EXPECT_THROW(StageRecord::from_json(Json::object(), "record"), InputError);
}

// A bed that was killed under one seed leaves a state; under another seed nothing of it is used, nor under the first
// seed anything of the second.
TEST(ChangedSeeds, FindNothingInAnOldScratchFolder) {
  StageRecord one = a_record(), two = a_record();
  two.seed = 6;
  const fs::path out = "/out";
  EXPECT_NE(scratch_folder(out, one), scratch_folder(out, two));
  EXPECT_EQ(scratch_folder(out, one), scratch_folder(out, a_record()));
}

}  // namespace
