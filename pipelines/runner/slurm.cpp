#include "pipelines/runner/slurm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/process.hpp"
#include "pipelines/runner/moved_points.hpp"
#include "pipelines/runner/sweep_points.hpp"
#include "pipelines/runner/sweep_record.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

// For a POSIX shell.
std::string shell_quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

// What an earlier submission still has in the queue would be run twice.
void require_empty_queue(const fs::path& submitted) {
  std::error_code error;
  if (!fs::is_regular_file(submitted, error)) return;
  const Json before = read_json(submitted);
  const std::string job = before.value("job", std::string()), gather = before.value("gather_job", std::string());
  const ProcessResult queue =
      run_process({"squeue", "--noheader", "--format=%i %T", "--jobs=" + job + "," + gather}, fs::current_path());
  if (queue.exit_code == 0 && queue.output.find_first_not_of(" \n") != std::string::npos)
    throw StageError(fmt::format(
        "jobs {},{} of this sweep are still in the queue. Wait until they end, or cancel them: scancel {} {}", job,
        gather, job, gather));
}

// Shards with something left to do, as Slurm writes them: "1-3,7". Points that were computed under another number are
// moved first, but by a dry run: the shards themselves move none.
struct Tasks {
  std::string text;
  std::size_t tasks = 0, missing_points = 0;
};
Tasks tasks_of(const Plan& plan, const std::vector<SweepPoint>& points, std::size_t shards,
               const SlurmOptions& options) {
  const fs::path folder = options.out / "points";
  NamedKeys keys;
  for (const SweepPoint& point : points) keys.emplace_back(point.name, keys_of(plan_at(plan, point)).point);
  std::map<std::string, std::string> elsewhere = earlier_places(keys, folder);
  if (!options.dry_run && move_to_own_places(elsewhere, folder)) elsewhere.clear();
  std::vector<std::uint8_t> waiting(shards, 0);
  Tasks tasks;
  for (const SweepPoint& point : points) {
    const auto found = elsewhere.find(point.name);
    const fs::path place = folder / (found == elsewhere.end() ? point.name : found->second);
    if (is_done(code_of_point(place, keys[point.index].second))) continue;
    waiting[point.index % shards] = 1;
    ++tasks.missing_points;
  }
  for (std::size_t i = 0; i < shards; ++i) {
    if (!waiting[i]) continue;
    std::size_t last = i;
    while (last + 1 < shards && waiting[last + 1]) ++last;
    tasks.text += (tasks.text.empty() ? "" : ",") +
                  (last == i ? fmt::format("{}", i + 1) : fmt::format("{}-{}", i + 1, last + 1));
    tasks.tasks += last - i + 1;
    i = last;
  }
  return tasks;
}

// array.sh and gather.sh.
void write_scripts(const Plan& plan, const SlurmOptions& options, std::size_t shards, const fs::path& folder) {
  std::error_code error;
  const std::string program = fs::read_symlink("/proc/self/exe", error).string();
  std::string command =
      fmt::format("{} run {} --out {}", shell_quoted(program), shell_quoted(fs::absolute(plan.file).string()),
                  shell_quoted(fs::absolute(options.out).string()));
  if (options.preset) command += " --preset " + shell_quoted(*options.preset);
  for (const std::string& setting : options.settings) command += " --set " + shell_quoted(setting);
  const std::string head = "#!/bin/sh\n#SBATCH --job-name=shakebed-" + plan.name + "\n";
  write_file_atomically(
      folder / "array.sh",
      head + fmt::format("# One task is one shard. What is up to date is skipped, so submitting again runs only what "
                         "is missing.\nexec {} --quiet --jobs \"${{SLURM_CPUS_PER_TASK:-1}}\" "
                         "--shard \"$SLURM_ARRAY_TASK_ID/{}\"\n",
                         command, shards));
  write_file_atomically(folder / "gather.sh",
                        head + fmt::format("# Runs when all shards have ended, however they ended: gathers the points "
                                           "that are there, and fails when some are missing.\nexec {} --gather\n",
                                           command));
}

// The id of the job.
std::string submit(const std::vector<std::string>& arguments) {
  const ProcessResult result = run_process(arguments, fs::current_path());
  std::string id = result.output.substr(0, result.output.find_first_of(";\n"));
  if (result.exit_code != 0 || id.empty() ||
      !std::all_of(id.begin(), id.end(), [](unsigned char c) { return std::isdigit(c); }))
    throw StageError(
        fmt::format("sbatch did not accept the job (exit code {}): {}{}", result.exit_code, result.output,
                    std::getenv("SLURM_CONF") == nullptr
                        ? " If your Slurm uses its own configuration file, set SLURM_CONF to its path in this shell"
                        : ""));
  return id;
}

}  // namespace

int submit_slurm(const Plan& plan, const SlurmOptions& options, Console& console) {
  if (!plan.sweep)
    throw UsageError("this recipe has no \"sweep\", so there is only one point. Add a sweep, or use shakebed run");
  const std::vector<SweepPoint> points = sweep_points(plan);
  if (points.empty()) throw UsageError("the sweep has no points; give its options at least one value");
  const std::size_t shards = std::min<std::size_t>(static_cast<std::size_t>(options.shards), points.size());
  const fs::path folder = options.out / "slurm", submitted = folder / "submitted.json";
  if (!options.dry_run) require_empty_queue(submitted);
  const Tasks tasks = tasks_of(plan, points, shards, options);
  const bool runs = tasks.missing_points > 0;
  try {
    fs::create_directories(folder);
  } catch (const fs::filesystem_error& problem) {
    throw StageError(fmt::format("{}: this folder cannot be created: {}", folder.string(), problem.code().message()));
  }
  write_scripts(plan, options, shards, folder);

  const auto sbatch = [&](std::vector<std::string> words, const char* log) {
    words.insert(words.begin(), {"sbatch", "--parsable"});
    words.push_back("--output=" + (fs::absolute(folder) / log).string());
    words.insert(words.end(), options.sbatch.begin(), options.sbatch.end());
    return words;
  };
  std::vector<std::string> array = sbatch({"--array=" + tasks.text}, "%x-%A-%a.log");
  std::vector<std::string> gather = sbatch({}, "%x-%j-gather.log");
  array.push_back((fs::absolute(folder) / "array.sh").string());
  const std::string gather_script = (fs::absolute(folder) / "gather.sh").string();
  if (options.dry_run) {
    if (runs) fmt::print("{}\n", fmt::join(array, " "));
    fmt::print("{}{} {}\n", fmt::join(gather, " "), runs ? " --dependency=afterany:JOB" : "", gather_script);
    return exit_ok;
  }
  Json record{{"job", ""},
              {"gather_job", ""},
              {"tasks", tasks.tasks},
              {"points", points.size()},
              {"to_run", tasks.missing_points}};
  if (runs) {
    record["job"] = submit(array);
    write_file_atomically(submitted, dump(record));
    gather.push_back("--dependency=afterany:" + record["job"].get<std::string>());
  }
  gather.push_back(gather_script);
  record["gather_job"] = submit(gather);
  write_file_atomically(submitted, dump(record));
  console.message(
      runs ? fmt::format("{} points, {} to run in {} tasks", points.size(), tasks.missing_points, tasks.tasks)
           : fmt::format("{} points, all up to date: only the table and the report are written again", points.size()));
  if (options.json) {
    fmt::print("{}", dump(record));
  } else {
    if (runs) fmt::print("job {} (array {}), then ", record["job"].get<std::string>(), tasks.text);
    fmt::print("job {} gathers the results\nlogs: {}\nprogress: shakebed status {}\n",
               record["gather_job"].get<std::string>(), folder.string(), options.out.string());
  }
  return exit_ok;
}

}  // namespace shakebed::pipelines
