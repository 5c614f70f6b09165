// implements: pipelines/cli/commands.hpp
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/run_plan.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/report/report.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/runner/run.hpp"
#include "pipelines/runner/sweep.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

struct RerunArguments {
  std::string folder;
  int jobs = 0;
};

// Files of the stages of a first run, and those of them that came out otherwise.
struct Comparison {
  std::size_t files = 0;
  std::vector<std::string> different;
};

Comparison compare(const Json& manifest, const fs::path& again) {
  Comparison out;
  std::error_code error;
  for (const Json& stage : manifest["stages"]) {
    if (!stage.contains("outputs")) continue;
    for (const Json& entry : stage["outputs"]) {
      const std::string name = entry.value("file", std::string());
      ++out.files;
      if (!fs::is_regular_file(again / name, error) ||
          sha256_of_file(again / name) != entry.value("sha256", std::string()))
        out.different.push_back(name);
    }
  }
  return out;
}

int rerun_sweep(const Plan& plan, const RunOptions& options, const fs::path& before, Console& console) {
  SweepArguments whole;
  const int code = run_sweep_command(plan, options, whole, report_pages(), console);
  if (code != exit_ok && code != exit_check_failed) return code;
  const bool same = read_file(before / "sweep.csv") == read_file(options.out / "sweep.csv");
  print(same ? "identical: sweep.csv has the same bytes\n" : "sweep.csv differs\n");
  return same ? exit_ok : exit_check_failed;
}

int rerun(const Call& call, const RerunArguments& given) {
  const fs::path before = given.folder;
  const Json manifest = read_json(before / "manifest.json");
  if (!manifest.contains("document") || !manifest.contains("stages"))
    throw InputError((before / "manifest.json").string() + ": is not a manifest written by shakebed");
  const Json* recipe_directory = find_pointer(manifest, "/recipe/directory");
  const fs::path directory =
      recipe_directory != nullptr && recipe_directory->is_string() ? recipe_directory->get<std::string>() : ".";
  const Plan plan =
      make_plan(to_node(manifest["document"]), (before / "manifest.json").string() + " (document)", directory);
  RunOptions options;
  options.out = call.out ? fs::path(*call.out) : fs::path(before.string() + "-rerun");
  options.jobs = given.jobs;
  options.force = true;
  options.command_line = call.command_line;
  std::error_code error;
  if (fs::equivalent(options.out, before, error))
    throw UsageError("--out: a rerun cannot write into the results folder that it repeats; name another folder");
  Console console(level_of(call));
  install_interrupt_handler();
  if (plan.sweep) return rerun_sweep(plan, options, before, console);
  const RunOutcome outcome = run_pipeline(plan, options, report_pages(), console);
  if (!outcome.error.empty()) console.error(outcome.error);
  if (outcome.code != exit_ok && outcome.code != exit_check_failed) return outcome.code;
  const auto [files, different] = compare(manifest, options.out);
  for (const std::string& problem : verify_output(before).problems)
    console.warning(fmt::format("{}: {}", before.string(), problem));
  for (const std::string& name : different)
    if (!call.json) std::fputs(fmt::format("differs: {}\n", name).c_str(), stderr);
  print(call.json           ? dump(Json{{"files", files}, {"different", different}, {"out", options.out.string()}})
        : different.empty() ? fmt::format("identical: all {} files of the stages have the fingerprints stated in {}\n",
                                          files, (before / "manifest.json").string())
                            : fmt::format("{} of {} files differ\n", different.size(), files));
  return different.empty() ? exit_ok : exit_check_failed;
}

}  // namespace

void add_rerun(Program& program) {
  const auto given = std::make_shared<RerunArguments>();
  CLI::App& command = program.add({"rerun", "repeat the run that wrote a results folder, and compare the files",
                                   "  shakebed rerun results/bed --out again"},
                                  [given](const Call& call) { return rerun(call, *given); });
  command.add_option("folder", given->folder, "results folder of the earlier run")->required()->type_name("DIR");
  command.add_option("--jobs,-j", given->jobs, "number of threads (default: all processors)")
      ->check(CLI::PositiveNumber);
}

}  // namespace shakebed::pipelines
