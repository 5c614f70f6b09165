// Runs and sweeps inside the test's own process: what is kept and why not, what ends how, the files around the results;
// jobs for a cluster, whose programs are scripts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "pipelines/runner/folder_lock.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/runner/moved_points.hpp"
#include "pipelines/runner/pages.hpp"
#include "pipelines/runner/plan_graph.hpp"
#include "pipelines/runner/slurm.hpp"
#include "pipelines/runner/sweep.hpp"
#include "pipelines/runner/sweep_record.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class NoPages : public Pages {
 public:
  void write(const Plan&, const RunOutcome&) const override {
    const std::lock_guard lock(mutex_);
    ++runs;
  }
  void write(const Plan&, const SweepOutcome& sweep) const override {
    problems = sweep.problems, complete = sweep.complete, table = sweep.table;
    verdicts = sweep.verdicts;
  }
  mutable int runs = 0;
  mutable bool complete = false;
  mutable std::vector<std::string> problems;
  mutable std::vector<std::vector<std::string>> table;
  mutable std::map<std::string, std::size_t> verdicts;

 private:
  mutable std::mutex mutex_;
};

const std::string fit_of =
    R"({ "stage": "fit", "id": "f", "profile": "p.csv", "diameter": "3 mm", "answer": false, "sweep": false, "compare": false })";
std::string map_of(const std::string& gamma, const std::string& more = "") {
  return R"({ "stage": "map", "gamma": )" + gamma +
         R"(, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10)" + more + " }";
}

class RunsByHand : public testing::Test {
 protected:
  RunsByHand() {
    write_profile("0.01");
    testing::internal::CaptureStderr();  // warnings, which are said whatever the level
  }
  ~RunsByHand() override { testing::internal::GetCapturedStderr(); }
  void write_profile(const std::string& error) {
    std::string rows = "height,number_density,std_error\n";
    for (int i = 0; i < 30; ++i)
      rows += std::to_string(0.5 * i) + "," + std::to_string(1.1 / (1 + std::exp(i - 16.0))) + "," + error + "\n";
    write_text(folder_ / "p.csv", rows);
  }
  Plan plan(const std::string& stages, const std::string& top = "") {
    std::vector<Problem> problems;
    return make_plan(*parse_json(R"({ "name": "r", )" + top + R"("stages": [)" + stages + "] }", "r.json", problems),
                     "r.json", folder_.path());
  }
  RunOptions options(const std::string& out = "o") {
    RunOptions given;
    given.out = folder_ / out;
    given.jobs = 1;
    return given;
  }
  RunOutcome run(const Plan& plan, const RunOptions& given) { return run_pipeline(plan, given, pages_, console_); }
  static std::string states(const std::vector<StageOutcome>& stages) {
    std::string all;
    for (const StageOutcome& stage : stages)
      all += (all.empty() ? "" : ", ") + stage.id + " " + std::string(to_string(stage.state));
    return all;
  }
  static std::string reasons(const RunOutcome& outcome, std::size_t i) {
    return fmt::format("{}", fmt::join(outcome.stages[i].reasons, "; "));
  }
  ScratchFolder folder_;
  NoPages pages_;
  Console console_{Console::Level::quiet};
};

// What a stage has warned of is in the outcome, and is said of a result that is kept, too.
TEST_F(RunsByHand, KeepTheWarningsOfTheirStages) {
  const Plan fit = plan(fit_of);
  for (const char* state : {"f ran", "f up to date"}) {
    const RunOutcome outcome = run(fit, options());
    EXPECT_EQ(states(outcome.stages), state);
    EXPECT_THAT(outcome.warnings,
                testing::Contains(HasSubstr("p.csv: the profile does not state through which kernel")))
        << state;
  }
}

TEST_F(RunsByHand, KeepWhatIsUpToDateAndSayWhyNot) {
  const std::string map_after =
      R"({ "stage": "map", "from": "f", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 })";
  const Plan first = plan(fit_of + "," + map_after);
  EXPECT_EQ(explanation_text(explain(first, options())),
            "f: runs: it has not run yet\nmap: runs: it has not run yet\n");
  const RunOutcome ran = run(first, options());
  EXPECT_EQ(ran.code, exit_ok) << ran.error;
  EXPECT_EQ(states(ran.stages), "f ran, map ran");
  EXPECT_EQ(states(run(first, options()).stages), "f up to date, map up to date");
  EXPECT_EQ(explanation_text(explain(first, options())), "f: up to date\nmap: up to date\n");
  RunOptions forced = options();
  forced.force = true;
  EXPECT_EQ(explanation_text(explain(first, forced)), "f: runs: --force was given\nmap: runs: f runs before it\n");
  const RunOutcome again = run(first, forced);
  EXPECT_EQ(states(again.stages), "f ran, map ran");
  EXPECT_EQ(reasons(again, 0), "--force was given");
  // Another option of the first: the second runs where its input changed.
  const Plan other = plan(std::string(fit_of).replace(fit_of.find("3 mm"), 4, "4 mm") + "," + map_after);
  EXPECT_THAT(explanation_text(explain(other, options())),
              HasSubstr("f: runs: diameter changed \"0.003 m\" → \"0.004 m\"\nmap: runs: f runs before it\n"));
  const RunOutcome changed = run(other, options());
  EXPECT_EQ(reasons(changed, 0), "diameter changed \"0.003 m\" → \"0.004 m\"");
  EXPECT_THAT(reasons(changed, 1), HasSubstr("input f/"));
  // A file of the user's.
  write_profile("0.02");
  EXPECT_EQ(reasons(run(other, options()), 0), "input /profile=p.csv changed");
  // Outputs that are gone or touched.
  std::filesystem::remove(folder_ / "o/f/fit.json");
  write_text(folder_ / "o/map/map.csv", "x");
  const RunOutcome mended = run(other, options());
  EXPECT_EQ(reasons(mended, 0), "its output fit.json is missing");
  EXPECT_EQ(reasons(mended, 1), "its output map.csv was changed after the run");
  // Without its results nothing that needs them can run alone.
  RunOptions alone = options("fresh");
  alone.only = "map";
  const RunOutcome lost = run(other, alone);
  EXPECT_EQ(lost.code, exit_input);
  EXPECT_EQ(states(lost.stages), "f not selected, map failed");
  EXPECT_THAT(lost.error, HasSubstr("map (map): this stage needs the results of \"f\", which are not in "));
}

TEST_F(RunsByHand, RunWhatIsSelected) {
  const std::string m = R"(, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 })";
  const Plan three = plan(fit_of + R"(, { "stage": "map", "id": "b", "from": "f", "gamma": 4)" + m +
                          R"(, { "stage": "map", "id": "c", "gamma": 4)" + m);
  run(three, options());
  const auto selected = [&](std::optional<std::string> only, std::optional<std::string> from,
                            std::optional<std::string> until) {
    RunOptions given = options();
    given.only = std::move(only), given.from = std::move(from), given.until = std::move(until);
    given.force = true;
    return states(run(three, given).stages);
  };
  EXPECT_EQ(selected("b", {}, {}), "f not selected, b ran, c not selected");
  EXPECT_EQ(selected({}, "f", {}), "f ran, b ran, c not selected");
  EXPECT_EQ(selected({}, "b", {}), "f not selected, b ran, c not selected");
  EXPECT_EQ(selected({}, {}, "b"), "f ran, b ran, c not selected");
  EXPECT_EQ(selected({}, {}, "f"), "f ran, b not selected, c not selected");
  EXPECT_EQ(selected({}, "b", "f"), "f not selected, b not selected, c not selected");
  EXPECT_THROW(selected("bb", {}, {}), UsageError);
  RunOptions one = options();
  one.only = "b";
  EXPECT_EQ(explanation_text(explain(three, one)),
            "f: not selected, its existing results are used\nb: up to date\nc: not selected, its existing "
            "results are used\n");
  // Two kinds have other names: only one of its kind is linked under it.
  EXPECT_TRUE(std::filesystem::is_symlink(folder_ / "o/fit"));
  EXPECT_EQ(std::filesystem::read_symlink(folder_ / "o/fit"), "f");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "o/map"));
}

TEST_F(RunsByHand, EndWithTheirCode) {
  write_text(folder_ / "p.csv", "height,number_density\n0,-1\n");
  const RunOutcome bad = run(plan(fit_of + "," + map_of("4")), options());
  EXPECT_EQ(bad.code, exit_input);
  EXPECT_EQ(states(bad.stages), "f failed, map not run");
  EXPECT_THAT(bad.error, HasSubstr("f (fit): "));
  EXPECT_THAT(bad.error, HasSubstr("p.csv:2: the density -1 is negative"));
  const Json summary = read_json(folder_ / "o/summary.json");
  EXPECT_EQ(summary["status"], "failed");
  EXPECT_FALSE(summary.contains("f"));
  const Json manifest = read_json(folder_ / "o/manifest.json");
  EXPECT_EQ(manifest["exit_code"], 4);
  EXPECT_EQ(manifest["error"], bad.error);
  EXPECT_EQ(manifest["stages"][0]["state"], "failed");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "o/f"));
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "o"))
    EXPECT_FALSE(entry.path().filename().string().starts_with(".f")) << "half-written";
}

TEST_F(RunsByHand, WriteAManifestThatIsVerified) {
  RunOptions given = options();
  given.command_line = {"shakebed", "run"};
  given.settings = {parse_setting("/stages/0/gamma=5")};
  std::filesystem::create_directories(folder_ / "o");
  write_text(folder_ / "o/.left.part", "");
  run(plan(fit_of + "," + map_of("4")), given);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "o/.left.part")) << "left by a run that was killed";
  const Json manifest = read_json(folder_ / "o/manifest.json");
  EXPECT_EQ(manifest["pipeline"], "r");
  EXPECT_EQ(manifest["exit_code"], 0);
  EXPECT_EQ(manifest["command_line"], Json::parse(R"(["shakebed", "run"])"));
  EXPECT_EQ(manifest["recipe"]["settings"], Json::parse(R"({"/stages/0/gamma": 5})"));
  EXPECT_EQ(manifest["recipe"]["file"], "r.json");
  EXPECT_FALSE(manifest["recipe"].contains("sha256")) << "there is no such file";
  EXPECT_EQ(manifest["stages"][0]["inputs"][0]["external"], true);
  EXPECT_EQ(manifest["stages"][0]["inputs"][0]["file"], (folder_ / "p.csv").string());
  EXPECT_EQ(manifest["stages"][0]["inputs"][0]["bytes"], std::filesystem::file_size(folder_ / "p.csv"));
  EXPECT_FALSE(manifest["stages"][0].contains("seed"));
  std::vector<std::string> outputs;
  for (const Json& one : manifest["outputs"]) outputs.push_back(one["file"]);
  EXPECT_THAT(outputs, ElementsAre("resolved.json", "summary.json"));
  const VerifyResult good = verify_output(folder_ / "o");
  EXPECT_THAT(good.problems, IsEmpty());
  const std::size_t files = manifest["stages"][0]["outputs"].size() + manifest["stages"][1]["outputs"].size();
  EXPECT_EQ(good.files, files + 3U) << "and the profile, and two files of the run";
  write_text(folder_ / "o/map/map.csv", "x"), std::filesystem::remove(folder_ / "o/f/fit.json");
  write_text(folder_ / "p.csv", "x"), write_text(folder_ / "o/summary.json", "{}");
  EXPECT_THAT(
      verify_output(folder_ / "o").problems,
      testing::UnorderedElementsAre("f/fit.json: missing", (folder_ / "p.csv").string() + ": changed since the run",
                                    "map/map.csv: changed since the run", "summary.json: changed since the run"));
  write_text(folder_ / "o/manifest.json", R"({"stages": 3})");
  EXPECT_THROW(verify_output(folder_ / "o"), InputError);
}

TEST_F(RunsByHand, DrawTheirGraph) {
  const Plan two = plan(
      fit_of +
      R"(, { "stage": "map", "from": "f", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 })");
  EXPECT_EQ(graph_dot(two),
            "digraph \"r\" {\n  rankdir=LR;\n  node [shape=box, style=rounded];\n  \"f\" [label=\"f\\n(fit)\"];\n"
            "  \"map\" [label=\"map\"];\n  \"f\" -> \"map\";\n}\n");
  EXPECT_EQ(graph_mermaid(two), "flowchart LR\n  s0[\"f (fit)\"]\n  s1[\"map\"]\n  s0 --> s1\n");
  EXPECT_EQ(two.index_of("map"), 1U);
  try {
    two.index_of("mp");
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(), "there is no stage \"mp\"; did you mean \"map\"?");
  }
  try {
    two.index_of("zzzz");
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(), "there is no stage \"zzzz\"; the recipe has f, map");
  }
}

// --- sweeps

class SweepsByHand : public RunsByHand {
 protected:
  int sweep(const Plan& plan, const std::string& shard = "", bool gather = false, bool force = false,
            const std::string& out = "o") {
    RunOptions given = options(out);
    given.force = force;
    arguments_ = {};
    arguments_.json = true, arguments_.gather = gather;
    if (!shard.empty()) arguments_.shard = shard;
    return run_sweep_command(plan, given, arguments_, pages_, console_);
  }
  Plan gammas(const std::string& values, const std::string& more = "") {
    return plan(map_of("4"), R"("sweep": { "over": { "/stages/map/gamma": )" + values +
                                 R"( }, "collect": ["/map/gamma"])" + more + " }, ");
  }
  SweepArguments arguments_;
};

TEST_F(SweepsByHand, RunEveryPointOnce) {
  const Plan plan = gammas("[2, 3]", R"(, "replicas": 2)");
  EXPECT_EQ(sweep(plan), exit_ok);
  EXPECT_EQ(pages_.runs, 4) << "a page a point";
  EXPECT_TRUE(pages_.complete);
  EXPECT_EQ(read_text(folder_ / "o/sweep.csv"),
            "point,replica,status,map_gamma,map_gamma_result,map_gamma_result_std_error\n"
            "000000,0,ok,2,2,\n000001,1,ok,2,2,\n000002,0,ok,3,3,\n000003,1,ok,3,3,\n");
  const Json columns = read_json(folder_ / "o/sweep.csv-metadata.json");
  EXPECT_EQ(columns["url"], "sweep.csv");
  EXPECT_EQ(columns["tableSchema"]["columns"].size(), 6U);
  EXPECT_EQ(arguments_.result["points"], 4);
  EXPECT_EQ(arguments_.result["done"], 4);
  EXPECT_EQ(arguments_.result["missing"], 0);
  EXPECT_EQ(arguments_.result["failed"], 0);
  EXPECT_EQ(arguments_.result["exit_code"], 0);
  EXPECT_EQ(sweep_status(folder_ / "o"), Json::parse(R"({"points": 4, "done": 4, "failed": 0, "left_over": 0})"));
  EXPECT_EQ(sweep(plan), exit_ok);
  EXPECT_EQ(pages_.runs, 4) << "all are kept";
  EXPECT_EQ(sweep(plan, "", false, true), exit_ok);
  EXPECT_EQ(pages_.runs, 8) << "--force";
  EXPECT_THAT(verify_output(folder_ / "o").problems, IsEmpty());
  // Replicas of a stage without a seed have one result: where it was changed, this is said once.
  write_text(folder_ / "o/points/000002/map/map.json", "{}");
  const VerifyResult changed = verify_output(folder_ / "o");
  EXPECT_THAT(changed.problems, ElementsAre(testing::MatchesRegex("shared/.*/map/map.json: changed since the run")));
  EXPECT_EQ(changed.files, 1 + 2 * read_record(folder_ / "o/points/000000/map")->outputs.size());
  std::filesystem::remove(std::filesystem::canonical(folder_ / "o/points/000002/map") / "map.json");
  EXPECT_THAT(verify_output(folder_ / "o").problems,
              ElementsAre(testing::MatchesRegex("shared/.*/map/map.json: missing")));
  EXPECT_TRUE(sweep_status(folder_ / "nothing").is_null());
}

// Point i belongs to shard 1 + i mod N.
TEST_F(SweepsByHand, RunInShards) {
  const Plan plan = gammas("[2, 3, 4, 5, 6]");
  EXPECT_EQ(sweep(plan, "2/3"), exit_ok);
  EXPECT_EQ(pages_.runs, 2);
  EXPECT_FALSE(pages_.complete);
  EXPECT_EQ(pages_.table[2][2], "ok");
  EXPECT_EQ(pages_.table[1][2], "missing");
  EXPECT_EQ(pages_.table[5][2], "ok");
  EXPECT_EQ(sweep(plan, "", true), exit_stage_failed) << "gathered, but some are missing";
  EXPECT_EQ(arguments_.result["missing"], 3);
  EXPECT_EQ(pages_.runs, 2);
  EXPECT_EQ(sweep(plan, "1/3"), exit_ok);
  EXPECT_EQ(sweep(plan, "3/3"), exit_ok);
  EXPECT_EQ(pages_.runs, 5);
  EXPECT_EQ(sweep(plan, "", true), exit_ok);
  EXPECT_TRUE(pages_.complete);
  for (const char* bad : {"0/3", "4/3", "1", "a/3", "1/b", "1/3x"}) EXPECT_THROW(sweep(plan, bad), UsageError) << bad;
  EXPECT_THROW(sweep(plan, "1/3", true), UsageError);
}

// What is there of an earlier recipe, and not run again, is no point of this one.
TEST_F(SweepsByHand, GatherNothingOfAnotherRecipe) {
  EXPECT_EQ(sweep(gammas("[2, 3]")), exit_ok);
  std::string changed = map_of("4");
  changed.replace(changed.find("20 Hz"), 5, "25 Hz");
  const Plan plan =
      this->plan(changed, R"("sweep": { "over": { "/stages/map/gamma": [2, 3] }, "collect": ["/map/gamma"] }, )");
  EXPECT_EQ(sweep(plan, "", true), exit_stage_failed);
  EXPECT_EQ(arguments_.result["missing"], 2);
  EXPECT_FALSE(pages_.complete);
  for (const std::size_t row : {1U, 2U}) {
    EXPECT_EQ(pages_.table[row][2], "missing");
    EXPECT_EQ(pages_.table[row][4], "");
  }
}

TEST_F(SweepsByHand, SayWhatWouldRun) {
  const Plan plan = gammas("[2, 3]");
  sweep(plan, "2/2");
  arguments_ = {};
  arguments_.json = arguments_.dry_run = true;
  EXPECT_EQ(run_sweep_command(plan, options(), arguments_, pages_, console_), exit_ok);
  EXPECT_EQ(
      arguments_.result,
      Json::parse(
          R"([{"point": "000000", "runs": true, "values": [2]}, {"point": "000001", "runs": false, "values": [3]}])"));
  arguments_.json = false;
  testing::internal::CaptureStdout();
  run_sweep_command(plan, options(), arguments_, pages_, console_);
  std::fflush(stdout);
  EXPECT_EQ(testing::internal::GetCapturedStdout(),
            "000000: /stages/map/gamma=2: runs\n000001: /stages/map/gamma=3: up to date\n1 of 2 points to run\n");
}

// A point that fails is run again alone; the others are kept.
TEST_F(SweepsByHand, RepeatWhatFailed) {
  write_text(folder_ / "bad.csv", "height,number_density\n0,-1\n");
  const Plan plan = this->plan(
      fit_of, R"("sweep": { "over": { "/stages/f/profile": ["p.csv", "bad.csv"] }, "collect": ["/f/temperature"] }, )");
  EXPECT_EQ(sweep(plan), exit_stage_failed);
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("error: point 000001: f (fit): "));
  testing::internal::CaptureStderr();
  EXPECT_THAT(pages_.problems, ElementsAre(HasSubstr("point 000001: f (fit): ")));
  EXPECT_EQ(pages_.table[1][2], "ok");
  EXPECT_EQ(pages_.table[2][2], "failed");
  EXPECT_EQ(pages_.table[2][4], "");
  EXPECT_EQ(arguments_.result["failed"], 1);
  EXPECT_EQ(sweep_status(folder_ / "o")["failed"], 1);
  const int before = pages_.runs;
  std::filesystem::copy_file(folder_ / "p.csv", folder_ / "bad.csv", std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(sweep(plan), exit_ok);
  EXPECT_EQ(pages_.runs, before + 1);
  EXPECT_EQ(pages_.table[2][2], "ok");
  EXPECT_EQ(pages_.table[2][4], pages_.table[1][4]);
}

// What a sweep says while it runs, and in the end.
TEST_F(SweepsByHand, SayWhatTheyDid) {
  testing::internal::GetCapturedStderr();
  std::string said, out;
  const auto run = [&](const Plan& plan, const std::string& shard = "", bool gather = false) {
    arguments_ = {};
    arguments_.gather = gather;
    if (!shard.empty()) arguments_.shard = shard;
    testing::internal::CaptureStderr(), testing::internal::CaptureStdout();
    int code = 0;
    {
      Console console(Console::Level::normal);
      code = run_sweep_command(plan, options(), arguments_, pages_, console);
    }
    std::fflush(stdout);
    out = testing::internal::GetCapturedStdout(), said = testing::internal::GetCapturedStderr();
    return code;
  };
  const std::string table = "table: " + (folder_ / "o/sweep.csv").string() + "\n";
  const Plan plan = gammas("[2, 3, 4]");
  run(plan, "2/3");
  EXPECT_THAT(said, HasSubstr("1 points, 0 up to date, 1 to run on 1 threads\n"));
  EXPECT_THAT(out, testing::MatchesRegex("1 of 3 points done in [^\n]*\n.*"));
  EXPECT_EQ(run(plan, "", true), exit_stage_failed);
  EXPECT_THAT(said,
              HasSubstr("3 points, 1 of them up to date. --gather collects the existing results and runs no points. "
                        "Run the same command without --gather to compute the other 2\n"));
  EXPECT_EQ(run(plan), exit_ok);
  EXPECT_THAT(said, HasSubstr("3 points, 1 up to date, 2 to run on 1 threads\n"));
  EXPECT_THAT(out, testing::EndsWith(table));
  EXPECT_EQ(run(plan, "", true), exit_ok);
  EXPECT_THAT(said,
              HasSubstr("3 points, 3 of them up to date. --gather collects the existing results and runs no points\n"));
  // Of 22 points that fail the first 20 are named.
  write_text(folder_ / "bad.csv", "height,number_density\n0,-1\n");
  std::string values = "1";
  for (int k = 2; k <= 22; ++k) values += ", " + std::to_string(k);
  std::string fit = fit_of;
  fit.replace(fit.find("p.csv"), 5, "bad.csv");
  EXPECT_EQ(run(this->plan(fit, R"("sweep": { "over": { "/stages/f/column_number": [)" + values + "] } }, ")),
            exit_stage_failed);
  EXPECT_THAT(said, HasSubstr("error: point 000019: f (fit): "));
  EXPECT_THAT(said, testing::Not(HasSubstr("error: point 000020")));
  EXPECT_THAT(said, HasSubstr("error: 2 more points failed\n"));
  EXPECT_THAT(out, testing::StartsWith("0 of 22 points done, 22 failed (run again to repeat only these) in "));
  EXPECT_EQ(run(this->plan(fit, R"("sweep": { "over": { "/stages/f/column_number": [31, 32] } }, )")),
            exit_stage_failed);
  EXPECT_THAT(said, HasSubstr("error: point 000001: f (fit): "));
  EXPECT_THAT(said, testing::Not(HasSubstr("more points failed")));
  testing::internal::CaptureStderr();
}

// What two points have in common runs once.
TEST_F(SweepsByHand, ShareStages) {
  const Plan plan = this->plan(
      fit_of +
          R"(, { "stage": "map", "from": "f", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 })",
      R"("sweep": { "over": { "/stages/map/gamma": [2, 3, 5] }, "collect": ["/map/gamma", "/f/temperature"] }, )");
  EXPECT_EQ(sweep(plan), exit_ok);
  EXPECT_TRUE(std::filesystem::is_symlink(folder_ / "o/points/000000/f"));
  EXPECT_FALSE(std::filesystem::is_symlink(folder_ / "o/points/000000/map"));
  EXPECT_EQ(std::filesystem::canonical(folder_ / "o/points/000000/f"),
            std::filesystem::canonical(folder_ / "o/points/000002/f"));
  EXPECT_EQ(pages_.table[3][6], pages_.table[1][6]);
}

TEST_F(SweepsByHand, KeysSayWhatDecides) {
  const Plan one = plan(fit_of + "," + map_of("4")), same = plan(fit_of + "," + map_of("4")),
             other = plan(fit_of + "," + map_of("5"));
  EXPECT_EQ(keys_of(one).point, keys_of(same).point);
  EXPECT_NE(keys_of(one).point, keys_of(other).point);
  EXPECT_EQ(keys_of(one).stages[0], keys_of(other).stages[0]);
  EXPECT_NE(keys_of(one).stages[1], keys_of(other).stages[1]);
  write_profile("0.03");
  EXPECT_NE(keys_of(same).stages[0], keys_of(plan(map_of("4"))).stages[0]);
  std::filesystem::create_directories(folder_ / "p");
  EXPECT_FALSE(read_point(folder_ / "p"));
  write_text(folder_ / "p/.point", R"({"key": "k", "code": 6})");
  EXPECT_EQ(code_of_point(folder_ / "p", "k"), 6);
  EXPECT_FALSE(code_of_point(folder_ / "p", "other"));
  write_text(folder_ / "p/.point", R"({"key": "k"})");
  EXPECT_FALSE(read_point(folder_ / "p"));
  EXPECT_TRUE(is_done(0) && is_done(6));
  EXPECT_FALSE(is_done(5) || is_done({}));
  EXPECT_EQ(value_text(Json()), "");
  EXPECT_EQ(value_text(Json("3 mm")), "3 mm");
  EXPECT_EQ(value_text(Json(2.5)), "2.5");
}

// --- points under another number

// Folders of points, each with the key of what it holds, and a file of that name.
class MovedPoints : public testing::Test {
 protected:
  void hold(const std::string& folder, const std::string& key, int code = 0) {
    std::filesystem::create_directories(points_ / folder);
    write_text(points_ / folder / ".point", R"({"key": ")" + key + R"(", "code": )" + std::to_string(code) + "}");
    write_text(points_ / folder / key, "");
  }
  std::string places(const NamedKeys& points) {
    std::string all;
    for (const auto& [name, folder] : earlier_places(points, points_)) all += name + " from " + folder + "; ";
    return all;
  }
  // "000000 a, 000001 b": what each folder holds.
  std::string held() {
    std::map<std::string, std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(points_)) {
      if (!entry.is_directory()) continue;
      std::string& own = found[entry.path().filename().string()];
      for (const auto& file : std::filesystem::directory_iterator(entry.path()))
        if (!file.path().filename().string().starts_with(".")) own += file.path().filename().string();
    }
    std::string all;
    for (const auto& [name, key] : found) all += (all.empty() ? "" : ", ") + name + " " + key;
    return all;
  }
  std::string moved(const NamedKeys& points) {
    EXPECT_TRUE(move_to_own_places(earlier_places(points, points_), points_));
    return held();
  }
  ScratchFolder folder_;
  std::filesystem::path points_ = folder_ / "points";
};

TEST_F(MovedPoints, AreFoundByTheirKeys) {
  hold("000000", "a"), hold("000001", "b", 6), hold("000002", "c", 5), hold("000003", "d");
  EXPECT_EQ(places({{"000000", "a"}, {"000001", "b"}, {"000002", "c"}, {"000003", "d"}}), "") << "each at home";
  EXPECT_EQ(places({{"000004", "a"}}), "") << "no folder holds another point than its name says";
  EXPECT_EQ(places({{"000000", "x"}, {"000001", "a"}, {"000002", "b"}, {"000003", "c"}, {"000004", "d"}}),
            "000001 from 000000; 000002 from 000001; 000004 from 000003; ")
      << "a failed check is a result, a failed stage is none";
  EXPECT_EQ(places({{"000000", "d"}, {"000003", "d"}}), "") << "000003 is at home, and nobody else has d";
  hold("000005", "d");
  EXPECT_EQ(places({{"000000", "d"}, {"000003", "d"}}), "000000 from 000005; ");
  EXPECT_THAT(places({{"000001", "d"}, {"000002", "d"}}),
              AnyOf("000001 from 000003; 000002 from 000005; ", "000001 from 000005; 000002 from 000003; "))
      << "each is taken once";
}

TEST_F(MovedPoints, AreExchangedUntilEachIsAtHome) {
  hold("000000", "a"), hold("000001", "b"), hold("000002", "c"), hold("000003", "d");
  EXPECT_FALSE(move_to_own_places({}, points_));
  EXPECT_EQ(moved({{"000000", "b"}, {"000001", "a"}, {"000002", "c"}}), "000000 b, 000001 a, 000002 c, 000003 d");
  // In a circle of three, and of four the other way round.
  EXPECT_EQ(moved({{"000000", "a"}, {"000001", "c"}, {"000002", "b"}}), "000000 a, 000001 c, 000002 b, 000003 d");
  EXPECT_EQ(moved({{"000000", "d"}, {"000001", "a"}, {"000002", "c"}, {"000003", "b"}}),
            "000000 d, 000001 a, 000002 c, 000003 b");
  // A value put in front of the others: the last moves to where nothing was.
  EXPECT_EQ(moved({{"000000", "x"}, {"000001", "d"}, {"000002", "a"}, {"000003", "c"}, {"000004", "b"}}),
            "000001 d, 000002 a, 000003 c, 000004 b");
  // While another process runs a point there, nothing moves.
  const NamedKeys back = {{"000001", "a"}, {"000002", "d"}};
  {
    const FolderLock lock(points_ / "000003");
    EXPECT_FALSE(move_to_own_places(earlier_places(back, points_), points_));
  }
  EXPECT_EQ(held(), "000001 d, 000002 a, 000003 c, 000004 b");
  EXPECT_EQ(moved(back), "000001 a, 000002 d, 000003 c, 000004 b");
}

TEST_F(MovedPoints, AreAtHomeAfterEveryPermutation) {
  std::string before = "abcd", after = before;
  do {
    std::filesystem::remove_all(points_);
    NamedKeys points;
    std::string all;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::string name = "00000" + std::to_string(k);
      hold(name, before.substr(k, 1));
      points.emplace_back(name, after.substr(k, 1));
      all += (k > 0 ? ", " : "") + name + " " + after.substr(k, 1);
    }
    move_to_own_places(earlier_places(points, points_), points_);
    ASSERT_EQ(held(), all);
  } while (std::next_permutation(after.begin(), after.end()));
}

// --- what is gathered of a point

TEST_F(SweepsByHand, GatherNumbersOfEveryKind) {
  const Plan plan = this->plan(fit_of + "," + map_of("4"));
  std::filesystem::create_directories(folder_ / "p/map");
  std::filesystem::create_directories(folder_ / "p/f");
  write_text(
      folder_ / "p/map/map.json",
      R"({ "gamma": {"value": 4, "std_error": 0.5}, "no error": {"value": 2.5}, "none": {"value": null, "std_error": null},
                  "word": "x, y", "truth": true, "list": [1, 2], "a/b": {"c": 7} })");
  EXPECT_THAT(gather_cells(plan, folder_ / "p",
                           {"/map/gamma", "/map/no error", "/map/none", "/map/word", "/map/truth", "/map/list",
                            "/map/list/1", "/map/a~1b/c", "/map/nothing", "/nobody/gamma", "/f/temperature"}),
              ElementsAre("4", "0.5", "2.5", "", "", "", "x, y", "", "true", "", "", "", "2", "", "7", "", "", "", "",
                          "", "", ""));
  EXPECT_EQ(verdict_of(plan, folder_ / "p"), "") << "the fit has not run";
  for (const auto& [text, verdict] : {std::pair(R"({ "answer": { "verdict": "one temperature" } })", "one temperature"),
                                      {R"({ "answer": { "verdict": 3 } })", ""},
                                      {R"({ "verdict": "x" })", ""}}) {
    write_text(folder_ / "p/f/fit.json", text);
    EXPECT_EQ(verdict_of(plan, folder_ / "p"), verdict) << text;
  }
  EXPECT_EQ(answering_stage(plan)->id, "f");
  EXPECT_EQ(answering_stage(this->plan(map_of("4"))), nullptr);
  EXPECT_EQ(verdict_of(this->plan(map_of("4")), folder_ / "p"), "");
}

// A recipe of a file has its hash and folder; a preset and changes are named.
TEST_F(RunsByHand, NameTheirRecipe) {
  Plan plan = this->plan(map_of("4"));
  write_text(folder_ / "own.json", "abc");
  plan.file = folder_ / "own.json", plan.preset = "quick";
  RunOptions given = options();
  given.settings = {parse_setting("/a/b=[1, 2]"), parse_setting("/c=3 mm")};
  EXPECT_EQ(recipe_json(plan, given),
            (Json{{"file", plan.file},
                  {"sha256", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
                  {"directory", folder_.path().string()},
                  {"preset", "quick"},
                  {"settings", Json{{"/a/b", Json::array({1, 2})}, {"/c", "3 mm"}}}}));
}

// What a sweep says on standard error, with the scratch folder as HERE.
std::string said_so_far(const ScratchFolder& folder) {
  std::string said = testing::internal::GetCapturedStderr();
  testing::internal::CaptureStderr();  // the fixture ends it
  const std::string here = folder.path().string();
  for (std::size_t at = 0; (at = said.find(here)) != std::string::npos;) said.replace(at, here.size(), "HERE");
  return said;
}

TEST_F(SweepsByHand, LeaveOutWhatOthersRun) {
  const Plan plan = gammas("[2, 3, 4]");
  std::filesystem::create_directories(folder_ / "o/points/000001");
  {
    const FolderLock lock(folder_ / "o/points/000001");
    EXPECT_EQ(sweep(plan), exit_ok);
  }
  EXPECT_EQ(arguments_.result["done"], 2);
  EXPECT_EQ(arguments_.result["missing"], 1);
  EXPECT_EQ(arguments_.result["failed"], 0);
  EXPECT_EQ(pages_.table[2][2], "missing");
  EXPECT_THAT(said_so_far(folder_), HasSubstr("warning: 1 points were skipped because another process is running them. "
                                              "Run again when it has ended\n"));
  EXPECT_EQ(sweep(plan), exit_ok);
  EXPECT_EQ(arguments_.result["done"], 3);
  EXPECT_THAT(said_so_far(folder_), testing::Not(HasSubstr("skipped")));
}

// A record that was cut off is none: its point runs again, and the others do not.
TEST_F(SweepsByHand, RepeatAPointWhoseRecordIsDamaged) {
  const Plan plan = gammas("[2, 3]");
  EXPECT_EQ(sweep(plan), exit_ok);
  const std::string record = read_text(folder_ / "o/points/000001/.point");
  for (const std::string& damaged : {record.substr(0, record.size() / 2), std::string("[1]")}) {
    write_text(folder_ / "o/points/000001/.point", damaged);
    EXPECT_EQ(sweep_status(folder_ / "o"), Json::parse(R"({"points": 2, "done": 1, "failed": 0, "left_over": 0})"));
    pages_.runs = 0;
    EXPECT_EQ(sweep(plan), exit_ok);
    EXPECT_EQ(pages_.runs, 1);
    EXPECT_EQ(read_text(folder_ / "o/points/000001/.point"), record);
  }
}

// Pages that cannot be written take no numbers with them.
TEST_F(SweepsByHand, AreThereWithoutTheirPages) {
  class FullDisk : public Pages {
   public:
    void write(const Plan&, const RunOutcome&) const override { throw StageError("a point's page: disk full"); }
    void write(const Plan&, const SweepOutcome&) const override { throw StageError("the sweep's page: disk full"); }
  };
  const Plan plan = gammas("[2, 3]");
  EXPECT_EQ(run_sweep_command(plan, options(), arguments_, FullDisk(), console_), exit_ok);
  const std::string said = said_so_far(folder_);
  for (const char* point : {"000000", "000001"})
    EXPECT_THAT(said, HasSubstr("warning: HERE/o/points/" + std::string(point) +
                                ": the report page of this point could not be written: a point's page: disk full\n"));
  EXPECT_THAT(said, HasSubstr("warning: the sweep is complete, but its report could not be written: the sweep's page: "
                              "disk full\n"));
  EXPECT_THAT(read_text(folder_ / "o/sweep.csv"), HasSubstr("\n000001,0,ok,3,3,\n"));
}

// A file is in the way of the folder.
TEST_F(SweepsByHand, NameTheFolderThatCannotBeMade) {
  write_text(folder_ / "o", "");
  try {
    sweep(gammas("[2]"));
    FAIL();
  } catch (const StageError& error) {
    EXPECT_EQ(error.what(), (folder_ / "o").string() + ": this folder cannot be created: Not a directory");
  }
}

// --- jobs for a cluster

// Slurm whose programs note how they are called; sbatch gives the ids 11, 12, ...
class SlurmByHand : public SweepsByHand {
 protected:
  SlurmByHand() : path_(std::getenv("PATH")) {
    std::filesystem::create_directories(folder_ / "bin");
    script("sbatch", "echo \"$@\" >> " + (folder_ / "called").string() + "\nexpr 10 + $(wc -l < " +
                         (folder_ / "called").string() + ")");
    script("squeue", "cat " + (folder_ / "queue").string() + " 2>/dev/null");
    ::setenv("PATH", ((folder_ / "bin").string() + ":" + path_).c_str(), 1);
  }
  ~SlurmByHand() override { ::setenv("PATH", path_.c_str(), 1); }
  void script(const std::string& name, const std::string& text) {
    write_text(folder_ / ("bin/" + name), "#!/bin/sh\n" + text + "\n");
    std::filesystem::permissions(folder_ / ("bin/" + name), std::filesystem::perms::owner_all);
  }
  std::string submit(const Plan& plan, int shards, bool dry_run = false) {
    SlurmOptions given;
    given.shards = shards, given.out = folder_ / "o", given.dry_run = dry_run;
    given.sbatch = {"--time=1"}, given.preset = "quick", given.settings = {"/a=it's"};
    testing::internal::CaptureStdout();
    EXPECT_EQ(submit_slurm(plan, given, console_), exit_ok);
    std::fflush(stdout);
    std::string said = testing::internal::GetCapturedStdout();
    const std::string here = folder_.path().string();
    for (std::size_t at = 0; (at = said.find(here)) != std::string::npos;) said.replace(at, here.size(), "HERE");
    return said;
  }
  std::string path_;
};

TEST_F(SlurmByHand, IsAskedForWhatIsMissing) {
  const Plan plan = gammas("[2, 3, 4, 5, 6, 7, 8]");
  const std::string
      array = "sbatch --parsable --array=1-7 --output=HERE/o/slurm/%x-%A-%a.log --time=1 HERE/o/slurm/array.sh\n",
      gather = "sbatch --parsable --output=HERE/o/slurm/%x-%j-gather.log --time=1";
  EXPECT_EQ(submit(plan, 100, true), array + gather + " --dependency=afterany:JOB HERE/o/slurm/gather.sh\n");
  // Of four shards the points are 0 4, 1 5, 2 6 and 3: after 2/7 and 6/7 shard 2 is done.
  sweep(plan, "2/7"), sweep(plan, "6/7"), sweep(plan, "4/7");
  EXPECT_EQ(
      submit(plan, 4),
      "job 11 (array 1,3), then job 12 gathers the results\nlogs: HERE/o/slurm\nprogress: shakebed status HERE/o\n");
  const std::string called = read_text(folder_ / "called");
  EXPECT_THAT(called, HasSubstr("--parsable --array=1,3 "));
  EXPECT_THAT(called, HasSubstr("--dependency=afterany:11 "));
  const Json submitted = read_json(folder_ / "o/slurm/submitted.json");
  EXPECT_EQ(submitted, Json::parse(R"({"job": "11", "gather_job": "12", "tasks": 2, "points": 7, "to_run": 4})"));
  const std::string of_tasks = read_text(folder_ / "o/slurm/array.sh");
  EXPECT_THAT(of_tasks, HasSubstr("#SBATCH --job-name=shakebed-r\n"));
  EXPECT_THAT(of_tasks, HasSubstr(" --preset 'quick' --set '/a=it'\\''s' --quiet --jobs \"${SLURM_CPUS_PER_TASK:-1}\" "
                                  "--shard \"$SLURM_ARRAY_TASK_ID/4\"\n"));
  EXPECT_THAT(read_text(folder_ / "o/slurm/gather.sh"), HasSubstr(" --set '/a=it'\\''s' --gather\n"));
  // What is still in the queue is not run twice.
  write_text(folder_ / "queue", "11 PENDING\n");
  SlurmOptions given;
  given.out = folder_ / "o";
  try {
    submit_slurm(plan, given, console_);
    FAIL();
  } catch (const StageError& error) {
    EXPECT_STREQ(error.what(),
                 "jobs 11,12 of this sweep are still in the queue. Wait until they end, or cancel them: scancel 11 12");
  }
  write_text(folder_ / "queue", "");
  sweep(plan);
  EXPECT_EQ(submit(plan, 4), "job 13 gathers the results\nlogs: HERE/o/slurm\nprogress: shakebed status HERE/o\n");
  script("sbatch", "echo refused; exit 1");
  try {
    submit_slurm(plan, given, console_);
    FAIL();
  } catch (const StageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("sbatch did not accept the job (exit code 1): refused"));
  }
  EXPECT_THROW(submit_slurm(this->plan(map_of("4")), given, console_), UsageError);
}

TEST_F(SlurmByHand, IsNotedForPrograms) {
  SlurmOptions given;
  given.shards = 2, given.out = folder_ / "o", given.json = true;
  testing::internal::CaptureStdout();
  EXPECT_EQ(submit_slurm(gammas("[2, 3, 4]"), given, console_), exit_ok);
  std::fflush(stdout);
  const std::string said = testing::internal::GetCapturedStdout();
  EXPECT_EQ(Json::parse(said),
            Json::parse(R"({"job": "11", "gather_job": "12", "tasks": 2, "points": 3, "to_run": 3})"));
  EXPECT_EQ(said, read_text(folder_ / "o/slurm/submitted.json"));
  write_text(folder_ / "p", "");
  given.out = folder_ / "p";
  try {
    submit_slurm(gammas("[2]"), given, console_);
    FAIL();
  } catch (const StageError& error) {
    EXPECT_EQ(error.what(), (folder_ / "p/slurm").string() + ": this folder cannot be created: Not a directory");
  }
}

}  // namespace
