#include "pipelines/runner/sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <map>
#include <mutex>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/runner/gathered_warnings.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/runner/moved_points.hpp"
#include "pipelines/runner/pages.hpp"
#include "pipelines/runner/shared_stages.hpp"
#include "pipelines/runner/sweep_progress.hpp"
#include "pipelines/runner/sweep_record.hpp"
#include "pipelines/runner/sweep_table.hpp"
#include "statistics/parallel.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view count_record = ".sweep";  // in points/: how many points the recipe has
constexpr std::size_t most_failures = 20;            // that are listed one by one
constexpr std::size_t most_learned = 50;             // points done before that say what stages take
constexpr std::int64_t show_interval = 90'000'000;   // [ns]
constexpr std::size_t most_point_pages = 200;        // a page is 0.1 to 3 MB; points of larger sweeps have none

struct Shard {
  std::uint64_t number = 1, of = 1;  // 1 to of
};
Shard parse_shard(const std::optional<std::string>& text) {
  if (!text) return {};
  Shard shard;
  const std::size_t slash = text->find('/');
  const auto read = [](std::string_view part, std::uint64_t& value) {
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    return error == std::errc() && end == part.data() + part.size();
  };
  const bool good = slash != std::string::npos && read(std::string_view(*text).substr(0, slash), shard.number) &&
                    read(std::string_view(*text).substr(slash + 1), shard.of);
  if (!good || shard.number < 1 || shard.number > shard.of)
    throw UsageError(fmt::format("--shard {}: expected K/N with K from 1 to N", *text));
  return shard;
}

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// One command on a sweep: finds the points of its shard, runs those that are missing, gathers all that are there.
class SweepRun {
 public:
  SweepRun(const Plan& plan, const RunOptions& options, SweepArguments& arguments, const Pages& pages, Console& console)
      : plan_(plan),
        options_(options),
        arguments_(arguments),
        pages_(pages),
        console_(console),
        shard_(parse_shard(arguments.shard)),
        points_dir_(options.out / "points"),
        all_(sweep_points(plan)),
        pointers_(collected(plan)),
        shared_(options.out, options.force) {
    if (arguments.gather && arguments.shard)
      throw UsageError("--gather works on the whole sweep and excludes --shard: give one of the two");
    if (all_.empty()) throw UsageError("the sweep has no points; give its options at least one value");
  }

  int operator()() {
    find_points();
    if (arguments_.dry_run) return say_what_would_run();
    try {
      fs::create_directories(points_dir_);
      write_file_atomically(points_dir_ / count_record, dump(Json{{"points", all_.size()}}));
    } catch (const fs::filesystem_error& error) {
      throw StageError(
          fmt::format("{}: this folder cannot be created: {}", options_.out.string(), error.code().message()));
    }
    install_interrupt_handler();
    for (const Warning& warning : plan_.warnings) console_.warning(to_string(warning.problem));
    start_ = Clock::now();
    run_points();
    interrupted_ = interrupt_requested();
    gather();
    write_results();
    say_failures();
    return finish();
  }

 private:
  struct Mine {  // a point of this shard
    const SweepPoint* point = nullptr;
    PointKeys keys;
    std::optional<int> earlier;  // how it ended before
    bool done = false;
    std::size_t to_run = 0;  // its place among those that are run
  };

  // Every point's recipe is read before any runs: a mistake in the last one is found now, not tomorrow.
  void find_points() {
    for (const SweepPoint& point : all_) {
      PointKeys keys = keys_of(plan_at(plan_, point));
      shared_.count(keys);
      if (point.index % shard_.of == shard_.number - 1) mine_.push_back({&point, std::move(keys), {}, false, 0});
    }
    const std::map<std::string, std::string> elsewhere = computed_elsewhere();
    for (Mine& one : mine_) {
      const auto found = elsewhere.find(one.point->name);
      one.earlier =
          code_of_point(points_dir_ / (found == elsewhere.end() ? one.point->name : found->second), one.keys.point);
      one.done = !options_.force && is_done(one.earlier);
      kept_ += one.done;
      if (one.done && !arguments_.dry_run) collect_again(*one.point);
    }
  }

  // A recipe may ask a finished point for other numbers than before.
  void collect_again(const SweepPoint& point) const {
    const fs::path folder = points_dir_ / point.name;
    std::optional<Json> record = read_point(folder);
    if (!record || (*record)["pointers"] == Json(pointers_)) return;
    (*record)["cells"] = gather_cells(plan_at(plan_, point), folder, pointers_);
    (*record)["pointers"] = pointers_;
    write_file_atomically(folder / point_record, dump(*record));
  }

  // Points that were computed under another number. They are moved to their own place, but by a dry run. Shards work at
  // the same time and move nothing.
  std::map<std::string, std::string> computed_elsewhere() {
    if (shard_.of > 1 || options_.force) return {};
    NamedKeys names;
    for (const Mine& one : mine_) names.emplace_back(one.point->name, one.keys.point);
    std::map<std::string, std::string> places = earlier_places(names, points_dir_);
    if (arguments_.dry_run || places.empty()) return places;
    if (move_to_own_places(places, points_dir_))
      console_.message(fmt::format(
          "the numbers of {} points changed since the last run of this sweep; the folders of these points were renamed",
          places.size()));
    return {};
  }

  int say_what_would_run() {
    if (arguments_.json) {
      arguments_.result = Json::array();
      for (const Mine& one : mine_)
        arguments_.result.push_back(
            Json{{"point", one.point->name}, {"runs", !one.done}, {"values", one.point->values}});
      return exit_ok;
    }
    for (const Mine& one : mine_) {
      std::string values;
      for (std::size_t a = 0; a < plan_.sweep->axes.size(); ++a)
        values += fmt::format(" {}={}", plan_.sweep->axes[a].pointer, value_text(one.point->values[a]));
      fmt::print("{}:{}: {}\n", one.point->name, values,
                 one.done      ? "up to date"
                 : one.earlier ? "runs again: it failed before, or --force was given"
                               : "runs");
    }
    fmt::print("{} of {} points to run\n", mine_.size() - kept_, mine_.size());
    return exit_ok;
  }

  void run_points() {
    if (arguments_.gather) {
      const std::size_t missing = mine_.size() - kept_;
      console_.message(fmt::format(
          "{} points, {} of them up to date. --gather collects the existing results and runs no points{}", mine_.size(),
          kept_,
          missing == 0 ? "" : fmt::format(". Run the same command without --gather to compute the other {}", missing)));
      return;
    }
    const int workers = options_.jobs > 0 ? options_.jobs : processors();
    to_run_ = mine_.size() - kept_;
    console_.message(
        fmt::format("{} points, {} up to date, {} to run on {} threads", mine_.size(), kept_, to_run_, workers));
    const std::size_t threads =
        std::min<std::size_t>(static_cast<std::size_t>(workers), std::max<std::size_t>(1, to_run_));
    if (to_run_ > 0) foresee(static_cast<int>(threads));
    for_each_index(threads, workers, [this](std::size_t) { work(); });
    console_.end_progress();
  }

  // What the points will take, and which of them far more than the others.
  void foresee(int threads) {
    std::vector<PointToRun> points;
    std::size_t learned = 0;
    for (Mine& one : mine_) {
      if (one.done) continue;
      one.to_run = points.size();
      points.push_back({one.point, &one.keys});
    }
    progress_.emplace(plan_, std::move(points), threads);
    for (const Mine& one : mine_) {
      if (one.done && learned++ < most_learned) progress_->learn(points_dir_ / one.point->name);
    }
    console_.progress("points", 0);
    progress_->trials([] { return interrupt_requested(); });
    for (const std::string& sentence : progress_->long_points()) console_.warning(sentence);
    show_progress();
  }

  void work() {
    while (to_run_ > 0 && !interrupt_requested()) {
      const std::size_t i = next_++;
      if (i >= mine_.size()) return;
      if (mine_[i].done) continue;
      RunOutcome outcome;
      progress_->begin(mine_[i].to_run);
      try {
        const PointEnd end = run_point(mine_[i], outcome);
        if (end == PointEnd::interrupted) return;
        if (end == PointEnd::busy) {
          ++busy_;
          progress_->drop(mine_[i].to_run);
          continue;
        }
      } catch (const std::exception& error) {
        outcome.code = exit_stage_failed;
        outcome.error = error.what();
      }
      count(mine_[i], outcome);
    }
  }

  enum class PointEnd { finished, interrupted, busy };  // busy: another shard or run is at it

  PointEnd run_point(const Mine& one, RunOutcome& outcome) {
    const Plan at = plan_at(plan_, *one.point);
    RunOptions alone = options_;
    alone.out = outcome.out = points_dir_ / one.point->name;
    alone.jobs = 1;
    alone.on_progress = [this, &one](const std::string& stage, double fraction) {
      progress_->reached(one.to_run, stage, fraction);
      show_progress();
    };
    fs::create_directories(alone.out);
    std::optional<FolderLock> lock;
    try {
      lock.emplace(alone.out);
    } catch (const StageError&) {
      return PointEnd::busy;
    }
    // It may have been finished by whoever held the lock a moment ago.
    if (!options_.force && is_done(code_of_point(alone.out, one.keys.point))) return PointEnd::finished;
    remove_leftovers(alone.out);
    if (options_.force) {  // everything anew, but what is shared only once
      alone.force = false;
      for (const PlannedStage& stage : at.stages) fs::remove_all(alone.out / stage.id);
      fs::remove_all(alone.out / scratch_name);
    }
    shared_.prepare(at, one.keys, alone.out);
    run_stages(at, alone, nullptr, outcome);
    if (outcome.code == exit_interrupted) return PointEnd::interrupted;
    Json record;
    record["key"] = one.keys.point;
    record["code"] = static_cast<int>(outcome.code);
    if (!outcome.error.empty()) record["error"] = outcome.error;
    record["warnings"] = outcome.warnings;
    record["failed_checks"] = outcome.failed_checks;
    record["cells"] = gather_cells(at, alone.out, pointers_);
    record["pointers"] = pointers_;
    record["verdict"] = verdict_of(at, alone.out);
    write_page(at, outcome);
    write_file_atomically(alone.out / point_record, dump(record));
    return PointEnd::finished;
  }

  // A point's own page, which the table of the sweep links. Its numbers are there without it.
  void write_page(const Plan& at, const RunOutcome& outcome) {
    if (all_.size() > most_point_pages) return;
    try {
      pages_.write(at, outcome);
    } catch (const Error& error) {
      console_.warning(fmt::format("{}: the report page of this point could not be written: {}", outcome.out.string(),
                                   error.what()));
    }
  }

  void count(const Mine& one, const RunOutcome& outcome) {
    ++finished_;
    if (is_done(outcome.code))
      progress_->end(one.to_run, points_dir_ / one.point->name);
    else
      progress_->drop(one.to_run);
    if (outcome.code == exit_check_failed) ++checks_;
    if (!is_done(outcome.code)) {
      ++failed_;
      const std::lock_guard lock(failures_mutex_);
      if (failures_.size() < most_failures)
        failures_.push_back(fmt::format("point {}: {}", one.point->name, outcome.error));
    }
    show_progress();
  }

  // As often as eyes see: the time left of many points takes a while to compute.
  void show_progress() {
    const auto now = Clock::now().time_since_epoch().count();
    auto last = last_shown_.load(std::memory_order_relaxed);
    if (now - last < show_interval || !last_shown_.compare_exchange_strong(last, now)) return;
    console_.progress("points", progress_->fraction(),
                      fmt::format("({}/{}, {:.3g}/s{})", finished_.load(), to_run_,
                                  static_cast<double>(finished_) / std::max(seconds_since(start_), 1e-3),
                                  failed_ > 0 ? fmt::format(", {} failed", failed_.load()) : ""),
                      progress_->seconds_left());
  }

  // Every point of the whole sweep that is there, whoever ran it.
  void gather() {
    std::vector<std::string> header{"point", "replica", "status"};
    for (const SweepAxis& axis : plan_.sweep->axes) header.push_back(axis.pointer);
    for (const std::string& pointer : pointers_) header.push_back(pointer), header.push_back(pointer + "/std_error");
    if (answering_stage(plan_) != nullptr) header.emplace_back(verdict_column);
    table_.push_back(std::move(header));
    for (const SweepPoint& point : all_) table_.push_back(row_of(point));
  }

  std::vector<std::string> row_of(const SweepPoint& point) {
    const auto record = read_point(points_dir_ / point.name);
    // A shard does not know the keys of the others' points.
    const bool counts = record && (*record)["code"].is_number() && (*record)["pointers"] == Json(pointers_) &&
                        (shard_.of > 1 || (*record)["key"] == Json(mine_[point.index].keys.point));
    std::string status = "missing";
    if (counts)
      status = (*record)["code"] == 0 ? "ok" : (*record)["code"] == exit_check_failed ? "check failed" : "failed";
    const bool good = counts && status != "failed";
    there_ += good;
    std::vector<std::string> row{point.name, std::to_string(point.replica), status};
    for (const Json& value : point.values) row.push_back(value_text(value));
    for (std::size_t k = 0; k < 2 * pointers_.size(); ++k)
      row.push_back(good ? (*record)["cells"][k].get<std::string>() : std::string());
    if (answering_stage(plan_) != nullptr) {
      row.push_back(good ? record->value("verdict", "") : "");
      if (!row.back().empty()) ++verdicts_[row.back()];
    }
    if (good) warnings_.add(point.name, (*record)["warnings"]);
    return row;
  }

  // Shards that end at the same time write the same bytes; the last one sees all points.
  void write_results() {
    const Table csv = sweep_table(plan_, pointers_, table_);
    csv.write_atomically(options_.out / "sweep.csv");
    csv_ = csv.csv();
    write_file_atomically(options_.out / "resolved.json", dump(plan_.resolved));
    try {
      pages_.write(plan_, SweepOutcome{.out = options_.out,
                                       .points = all_,
                                       .collected = pointers_,
                                       .table = table_,
                                       .problems = failures_,
                                       .verdicts = verdicts_,
                                       .warnings = warnings_.lines(),
                                       .complete = !interrupted_ && there_ == all_.size()});
    } catch (const StageError& error) {
      console_.warning(fmt::format("the sweep is complete, but its report could not be written: {}", error.what()));
    }
  }

  void say_failures() {
    for (const std::string& warning : warnings_.lines()) console_.warning(warning);
    for (const std::string& failure : failures_) console_.error(failure);
    if (failed_ > failures_.size()) console_.error(fmt::format("{} more points failed", failed_ - failures_.size()));
    if (busy_ > 0)
      console_.warning(fmt::format(
          "{} points were skipped because another process is running them. Run again when it has ended", busy_.load()));
  }

  ExitCode exit_code() const {
    const bool missing = arguments_.gather && there_ < all_.size();
    return interrupted_             ? exit_interrupted
           : failed_ > 0 || missing ? exit_stage_failed
           : checks_ > 0            ? exit_check_failed
                                    : exit_ok;
  }

  int finish() {
    const double seconds = seconds_since(start_);
    const ExitCode code = exit_code();
    Json summary;
    summary["pipeline"] = plan_.name;
    summary["warnings"] = Json::array();
    for (const Warning& warning : plan_.warnings)
      summary["warnings"].push_back(
          to_string(Problem{{}, {}, warning.problem.pointer, warning.problem.what, warning.problem.suggestion}));
    summary["points"] = all_.size();
    summary["done"] = there_;
    summary["missing"] = all_.size() - there_;
    summary["failed"] = failed_.load();
    summary["failed_checks"] = checks_.load();
    if (answering_stage(plan_) != nullptr) summary["verdicts"] = verdicts_;
    summary["warnings_of_points"] = warnings_.lines();
    write_file_atomically(options_.out / "summary.json", dump(summary));
    write_file_atomically(options_.out / "manifest.json", dump(manifest(seconds, code)));
    if (arguments_.json) {
      summary["exit_code"] = static_cast<int>(code);
      summary["table"] = (options_.out / "sweep.csv").string();
      arguments_.result = std::move(summary);
    } else {
      fmt::print("{} of {} points done{} in {}\n", there_, all_.size(),
                 failed_ > 0 ? fmt::format(", {} failed (run again to repeat only these)", failed_.load()) : "",
                 duration_text(seconds));
      if (interrupted_) fmt::print("interrupted. Start the same command again to run the remaining points\n");
      if (!verdicts_.empty()) fmt::print("{}\n", verdicts_text(verdicts_));
      fmt::print("table: {}\n", (options_.out / "sweep.csv").string());
    }
    return code;
  }

  Json manifest(double seconds, ExitCode code) const {
    Json out;
    out["pipeline"] = plan_.name;
    out["shakebed"] = program_version();
    out["git"] = source_revision();
    out["compiler"] = compiler_text();
    out["command_line"] = options_.command_line;
    out["finished"] = utc_now();
    out["wall_seconds"] = seconds;
    out["exit_code"] = static_cast<int>(code);
    if (!plan_.preset.empty()) out["preset"] = plan_.preset;
    out["recipe"] = recipe_json(plan_, options_);
    out["document"] = plan_.document.to_json();
    out["stages"] = Json::array();
    out["outputs"] = Json::array({Json{{"file", "sweep.csv"}, {"bytes", csv_.size()}, {"sha256", sha256(csv_)}}});
    return out;
  }

  const Plan& plan_;
  const RunOptions& options_;
  SweepArguments& arguments_;
  const Pages& pages_;
  Console& console_;
  const Shard shard_;
  const fs::path points_dir_;
  const std::vector<SweepPoint> all_;
  const std::vector<std::string> pointers_;
  SharedStages shared_;
  std::vector<Mine> mine_;
  std::size_t kept_ = 0, to_run_ = 0;
  std::optional<SweepProgress> progress_;
  std::atomic<std::int64_t> last_shown_{0};
  Clock::time_point start_;
  std::atomic<std::size_t> next_{0}, finished_{0}, failed_{0}, checks_{0}, busy_{0};
  std::mutex failures_mutex_;
  std::vector<std::string> failures_;
  bool interrupted_ = false;

  std::vector<std::vector<std::string>> table_;
  std::string csv_;
  std::size_t there_ = 0;
  std::map<std::string, std::size_t> verdicts_;  // points by verdict
  GatheredWarnings warnings_;
};

}  // namespace

int run_sweep_command(const Plan& plan, const RunOptions& options, SweepArguments& arguments, const Pages& pages,
                      Console& console) {
  return SweepRun(plan, options, arguments, pages, console)();
}

namespace {

// Whether a folder is that of a point with a number below this.
bool is_point_below(const std::string& name, std::uint64_t points) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  return error == std::errc() && end == name.data() + name.size() && number < points;
}

}  // namespace

Json sweep_status(const fs::path& out) {
  std::error_code error;
  if (!fs::is_directory(out / "points", error)) return nullptr;
  std::uint64_t points = 0, done = 0, failed = 0, left = 0;
  if (fs::is_regular_file(out / "points" / count_record, error))
    points = read_json(out / "points" / count_record).value("points", std::uint64_t{0});
  else if (fs::is_regular_file(out / "summary.json", error))  // as versions before 1.0 left it
    points = read_json(out / "summary.json").value("points", std::uint64_t{0});
  for (const fs::directory_entry& entry : fs::directory_iterator(out / "points", error)) {
    if (!entry.is_directory(error)) continue;
    if (!is_point_below(entry.path().filename().string(), points)) {
      ++left;
      continue;
    }
    if (const auto record = read_point(entry.path())) {
      const int code = (*record)["code"].get<int>();
      if (code == exit_ok || code == exit_check_failed)
        ++done;
      else
        ++failed;
    }
  }
  return Json{{"points", points}, {"done", done}, {"failed", failed}, {"left_over", left}};
}

}  // namespace shakebed::pipelines
