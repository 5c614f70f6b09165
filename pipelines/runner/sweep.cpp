#include "pipelines/runner/sweep.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/process.hpp"
#include "pipelines/report/report.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/stages/figure.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

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

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  return out + "\"";
}
std::string value_text(const Json& value) {
  return value.is_null() ? "" : value.is_string() ? value.get<std::string>() : dump_canonical(value);
}

// A point's state, in its folder: what it is made from and how it ended.
struct PointResult {
  bool done = false;
  ExitCode code = exit_ok;
  std::string error;
  std::vector<std::string> cells;  // of the collected numbers: value and std_error each
  double seconds = 0;
};

// The numbers to gather; all top-level quantities of fit and check results where the recipe names none.
std::vector<std::string> collected(const Plan& plan) {
  if (!plan.sweep->collect.empty()) return plan.sweep->collect;
  std::vector<std::string> pointers;
  for (const PlannedStage& stage : plan.stages) {
    if (stage.row->name == "fit") {
      for (const char* key :
           {"temperature", "temperature_over_mg", "solid_height", "reduced_temperature", "chi2_per_dof"})
        pointers.push_back("/" + stage.id + "/" + key);
    } else if (stage.row->name == "simulate") {
      for (const char* key : {"center_of_mass_rise", "temperature_x", "temperature_z"})
        pointers.push_back("/" + stage.id + "/" + key);
    }
  }
  return pointers;
}

std::vector<std::string> gather_cells(const Plan& plan, const fs::path& directory,
                                      const std::vector<std::string>& pointers) {
  std::vector<std::string> cells;
  std::map<std::string, Json> results;
  for (const std::string& pointer : pointers) {
    const std::vector<std::string> tokens = split_pointer(pointer);
    std::string value, error;
    if (const PlannedStage* stage = tokens.empty() ? nullptr : plan.find(tokens.front());
        stage != nullptr && !stage->row->result.empty()) {
      if (!results.contains(stage->id)) {
        std::error_code ignored;
        const fs::path path = directory / stage->id / stage->row->result;
        results[stage->id] = fs::is_regular_file(path, ignored) ? read_json(path) : Json();
      }
      const Json* found = find_pointer(
          results[stage->id], std::string_view(pointer).substr(1 + escape_pointer_token(tokens.front()).size()));
      if (found != nullptr && found->is_object() && found->contains("value")) {
        value = value_text((*found)["value"]);
        if (found->contains("std_error")) error = value_text((*found)["std_error"]);
      } else if (found != nullptr && !found->is_structured()) {
        value = value_text(*found);
      }
    }
    cells.push_back(value), cells.push_back(error);
  }
  return cells;
}

// A point is done when this file says so for the same recipe at the same values.
constexpr std::string_view point_record = ".point";

// What decides the results of a point, and of each of its stages: kind, version, options, seed, external files and what
// it reads from.
struct PointKeys {
  std::string point;
  std::vector<std::string> stages;
};

PointKeys keys_of(const Plan& at) {
  PointKeys keys;
  std::string whole;
  for (const PlannedStage& stage : at.stages) {
    std::string text = fmt::format("{} {} {} {} ", stage.row->name, stage.row->version,
                                   stage.row->uses_seed ? stage.seed : 0, stage.reduced);
    text += dump_canonical(stage.options);
    for (const auto& [pointer, path] : stage.input_files) text += pointer + fast_hash_of_file(path);
    for (const std::size_t k : stage.from) text += at.stages[k].id + keys.stages[k];
    keys.stages.push_back(fast_hash(text));
    whole += stage.id + keys.stages.back();
  }
  keys.point = fast_hash(whole);
  return keys;
}

// Stages that several points have in common (one simulation under a sweep of fits, say) are run once, in
// OUT/shared/<key>/<id>; the points hold links to them.
class SharedStages {
 public:
  SharedStages(fs::path out, const RunOptions& options) : root_(std::move(out) / "shared"), options_(options) {}

  void count(const PointKeys& keys) {
    for (const std::string& key : keys.stages) ++uses_[key];
  }
  bool is_shared(const std::string& key) const {
    const auto found = uses_.find(key);
    return found != uses_.end() && found->second > 1;
  }

  // Makes the shared stages of a point and links them into its folder. What fails here is left to the point itself,
  // which then fails in the same way and says so.
  void prepare(const Plan& at, const PointKeys& keys, const fs::path& directory) {
    for (std::size_t i = 0; i < at.stages.size(); ++i) {
      if (!is_shared(keys.stages[i]) || !make(at, keys, i)) continue;
      link("../../shared/" + keys.stages[i] + "/" + at.stages[i].id, directory / at.stages[i].id);
    }
  }

 private:
  struct Entry {
    std::mutex mutex;
    bool tried = false, good = false;
  };

  static void link(const fs::path& target, const fs::path& place) {
    std::error_code error;
    if (fs::is_symlink(place, error) && fs::read_symlink(place, error) == target) return;
    fs::remove_all(place, error);
    fs::create_directory_symlink(target, place);
  }

  bool make(const Plan& at, const PointKeys& keys, std::size_t i) {
    const std::string& key = keys.stages[i];
    std::shared_ptr<Entry> entry;
    {
      const std::lock_guard lock(mutex_);
      std::shared_ptr<Entry>& found = entries_[key];
      if (!found) found = std::make_shared<Entry>();
      entry = found;
    }
    const std::lock_guard lock(entry->mutex);  // one thread makes it, the others wait
    if (entry->tried) return entry->good;
    const fs::path directory = root_ / key;
    fs::create_directories(directory);
    std::optional<FolderLock> folder_lock;
    while (!folder_lock) {  // so do other shards
      try {
        folder_lock.emplace(directory);
      } catch (const StageError&) {
        if (interrupt_requested()) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    }
    if (options_.force) {
      std::error_code error;
      fs::remove_all(directory / at.stages[i].id, error);
      fs::remove_all(directory / scratch_name, error);
    }
    remove_leftovers(directory);
    for (const std::size_t k : at.stages[i].from) {
      link("../" + keys.stages[k] + "/" + at.stages[k].id, directory / at.stages[k].id);
    }
    RunOptions one;
    one.out = directory;
    one.only = at.stages[i].id;
    one.jobs = 1;
    RunOutcome outcome;
    outcome.out = directory;
    run_stages(at, one, nullptr, outcome);
    entry->tried = outcome.code != exit_interrupted;
    entry->good = outcome.stages[i].state == StageState::ran || outcome.stages[i].state == StageState::kept;
    return entry->good;
  }

  fs::path root_;
  RunOptions options_;
  std::map<std::string, std::size_t> uses_;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Entry>> entries_;
};

std::optional<Json> read_point(const fs::path& directory) {
  const fs::path path = directory / point_record;
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return std::nullopt;
  try {
    Json json = read_json(path);
    if (json.is_object() && json.contains("key") && json.contains("code")) return json;
  } catch (const InputError&) {}
  return std::nullopt;
}

// How a point ended when it was last run with this key; nothing when it was not.
std::optional<int> code_of_point(const fs::path& directory, const std::string& key) {
  const auto record = read_point(directory);
  if (!record || (*record)["key"] != key || !(*record)["code"].is_number_integer()) return std::nullopt;
  return (*record)["code"].get<int>();
}

// Figures of a sweep: every gathered number against the first axis that has numbers, one series for each combination of
// the other axes (six at most).
std::vector<fs::path> draw_sweep(const Plan& plan, const std::vector<SweepPoint>& points,
                                 const std::vector<std::vector<std::string>>& table,
                                 const std::vector<std::string>& pointers, const fs::path& folder) {
  const auto number = [](const std::string& text, double& value) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size();
  };
  // "/stages/bed/floor/amplitude" → "bed floor amplitude"; short = only its last word.
  const auto words = [](const std::string& pointer, bool only_last) {
    std::string text;
    for (const std::string& token : split_pointer(pointer)) {
      if (token == "stages" && text.empty()) continue;
      text = only_last || text.empty() ? token : text + " " + token;
    }
    std::replace(text.begin(), text.end(), '_', ' ');
    return text;
  };
  const auto rounded = [](const Json& value) {
    return value.is_number() ? fmt::format("{:.4g}", value.get<double>()) : value_text(value);
  };
  const std::vector<SweepAxis>& axes = plan.sweep->axes;
  std::size_t along = axes.size();
  std::string unit;
  for (std::size_t a = 0; a < axes.size() && along == axes.size(); ++a) {
    const Json& value = points.front().values[a];
    try {
      if (value.is_number()) along = a;
      if (value.is_string() && parse_quantity(value.get<std::string>()).has_unit) {
        along = a;
        unit = si_unit(parse_quantity(value.get<std::string>()).dimension);
      }
    } catch (const std::invalid_argument&) {}
  }
  std::vector<fs::path> figures;
  if (along == axes.size()) return figures;
  const std::size_t first = 3 + axes.size();  // column of the first number
  for (std::size_t k = 0; k < pointers.size(); ++k) {
    Picture picture{.x_label = words(axes[along].pointer, false) + (unit.empty() ? "" : "  [" + unit + "]"),
                    .y_label = words(pointers[k], false)};
    std::map<std::string, std::size_t> groups;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::vector<std::string>& row = table[i + 1];
      double x = 0, y = 0, error = 0;
      const Json& at = points[i].values[along];
      try {
        if (at.is_number())
          x = at.get<double>();
        else if (at.is_string())
          x = parse_quantity(at.get<std::string>()).value;
        else
          continue;
      } catch (const std::invalid_argument&) {
        continue;
      }
      if (!number(row[first + 2 * k], y)) continue;
      const bool has_error = number(row[first + 2 * k + 1], error);
      std::string label;
      for (std::size_t a = 0; a < axes.size(); ++a) {
        if (a == along || plan.sweep->kind == SweepKind::random) continue;
        label += (label.empty() ? "" : ", ") + words(axes[a].pointer, true) + " = " + rounded(points[i].values[a]);
      }
      const auto [group, fresh] = groups.emplace(label, groups.size());
      if (group->second >= 6) continue;
      if (fresh)
        picture.series.push_back(
            {label.empty() ? "points" : label, Series::Style::points, static_cast<int>(group->second), {}, {}, {}});
      Series& series = picture.series[group->second];
      series.x.push_back(x), series.y.push_back(y);
      if (has_error) series.error.push_back(error);
    }
    for (Series& series : picture.series) {
      if (series.error.size() != series.x.size()) series.error.clear();
    }
    if (picture.series.empty()) continue;
    const std::string name = fmt::format("sweep-{}", k + 1);
    fs::create_directories(folder);
    draw_picture(picture, folder, name);
    figures.push_back(folder / (name + ".svg"));
  }
  return figures;
}

}  // namespace

int run_sweep_command(const Plan& plan, const RunOptions& options, SweepArguments& arguments, Console& console) {
  const Shard shard = parse_shard(arguments.shard);
  if (arguments.gather && arguments.shard)
    throw UsageError("--gather: looks at the whole sweep, so there is no --shard");
  const std::vector<SweepPoint> all = sweep_points(plan);
  if (all.empty()) throw UsageError("the sweep has no points");
  const std::vector<std::string> pointers = collected(plan);
  std::vector<const SweepPoint*> points;
  for (const SweepPoint& point : all) {
    if (point.index % shard.of == shard.number - 1) points.push_back(&point);
  }
  // Every point's recipe is read before any runs: a mistake in the last one is found now, not tomorrow.
  const fs::path root = options.out / "points";
  std::vector<PointKeys> keys(points.size());
  std::vector<std::uint8_t> done(points.size(), 0);
  std::vector<std::optional<int>> earlier(points.size());
  std::size_t kept = 0;
  SharedStages shared(options.out, options);
  for (std::size_t i = 0, mine = 0; i < all.size(); ++i) {
    PointKeys point_keys = keys_of(plan_at(plan, all[i]));
    shared.count(point_keys);
    if (mine < points.size() && points[mine] == &all[i]) keys[mine++] = std::move(point_keys);
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    earlier[i] = code_of_point(root / points[i]->name, keys[i].point);
    done[i] = !options.force && earlier[i] && (*earlier[i] == exit_ok || *earlier[i] == exit_check_failed);
    kept += done[i];
  }
  if (arguments.dry_run) {
    if (arguments.json) {
      Json rows = Json::array();
      for (std::size_t i = 0; i < points.size(); ++i)
        rows.push_back(Json{{"point", points[i]->name}, {"runs", done[i] == 0}, {"values", points[i]->values}});
      arguments.result = std::move(rows);
    } else {
      for (std::size_t i = 0; i < points.size(); ++i) {
        std::string values;
        for (std::size_t a = 0; a < plan.sweep->axes.size(); ++a)
          values += fmt::format(" {}={}", plan.sweep->axes[a].pointer, value_text(points[i]->values[a]));
        fmt::print("{}:{}: {}\n", points[i]->name, values,
                   done[i]      ? "up to date"
                   : earlier[i] ? "runs again: it failed or was asked for"
                                : "runs");
      }
      fmt::print("{} of {} points to run\n", points.size() - kept, points.size());
    }
    return exit_ok;
  }
  try {
    fs::create_directories(root);
  } catch (const fs::filesystem_error& error) {
    throw StageError(fmt::format("{}: cannot be made: {}", options.out.string(), error.code().message()));
  }
  install_interrupt_handler();
  for (const Warning& warning : plan.warnings) console.warning(to_string(warning.problem));
  const auto start = std::chrono::steady_clock::now();
  const int workers =
      std::max(1, options.jobs > 0 ? options.jobs : static_cast<int>(std::thread::hardware_concurrency()));
  if (arguments.gather) {
    console.message(fmt::format("{} points, {} up to date: gathered, none is run", points.size(), kept));
  } else {
    console.message(fmt::format("{} points, {} up to date, {} to run on {} threads", points.size(), kept,
                                points.size() - kept, workers));
  }

  std::atomic<std::size_t> next{0}, finished{0}, failed{0}, checks{0}, busy{0};
  std::mutex failures_mutex;
  std::vector<std::string> failures;
  std::string stop;  // what ends the whole sweep: a full disk, say
  const std::size_t to_run = arguments.gather ? 0 : points.size() - kept;
  const auto work = [&] {
    while (to_run > 0 && !interrupt_requested()) {
      const std::size_t i = next++;
      if (i >= points.size()) return;
      if (done[i]) continue;
      const SweepPoint& point = *points[i];
      RunOutcome outcome;
      try {
        const Plan at = plan_at(plan, point);
        RunOptions one = options;
        one.out = outcome.out = root / point.name;
        one.jobs = 1;
        fs::create_directories(one.out);
        std::optional<FolderLock> lock;
        try {
          lock.emplace(one.out);
        } catch (const StageError&) {
          ++busy;  // another shard or run is at it
          continue;
        }
        // It may have been finished by whoever held the lock a moment ago.
        if (const auto record = read_point(one.out);
            !options.force && record && (*record)["key"] == keys[i].point &&
            ((*record)["code"] == 0 || (*record)["code"] == exit_check_failed)) {
          ++finished;
          continue;
        }
        remove_leftovers(one.out);
        if (options.force) {  // everything anew, but what is shared only once
          one.force = false;
          for (const PlannedStage& stage : at.stages) fs::remove_all(one.out / stage.id);
          fs::remove_all(one.out / scratch_name);
        }
        shared.prepare(at, keys[i], one.out);
        const auto point_start = std::chrono::steady_clock::now();
        run_stages(at, one, nullptr, outcome);
        if (outcome.code == exit_interrupted) return;
        Json record;
        record["key"] = keys[i].point;
        record["code"] = static_cast<int>(outcome.code);
        if (!outcome.error.empty()) record["error"] = outcome.error;
        record["warnings"] = outcome.warnings;
        record["failed_checks"] = outcome.failed_checks;
        record["cells"] = gather_cells(at, one.out, pointers);
        record["pointers"] = pointers;
        record["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - point_start).count();
        write_file_atomically(one.out / point_record, dump(record));
      } catch (const std::exception& error) {
        outcome.code = exit_stage_failed;
        outcome.error = error.what();
      }
      ++finished;
      if (outcome.code == exit_check_failed) ++checks;
      if (outcome.code != exit_ok && outcome.code != exit_check_failed) {
        ++failed;
        const std::lock_guard lock(failures_mutex);
        if (failures.size() < 20) failures.push_back(fmt::format("point {}: {}", point.name, outcome.error));
      }
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      console.progress("points", static_cast<double>(finished) / static_cast<double>(to_run),
                       fmt::format("({}/{}, {:.3g}/s{})", finished.load(), to_run,
                                   static_cast<double>(finished) / std::max(seconds, 1e-3),
                                   failed > 0 ? fmt::format(", {} failed", failed.load()) : ""));
    }
  };
  std::vector<std::thread> threads;
  for (int i = 1; i < workers && static_cast<std::size_t>(i) < to_run; ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  console.end_progress();

  // Gather: every point of the whole sweep that is there, whoever ran it.
  std::vector<std::vector<std::string>> table{{"point", "replica", "status"}};
  for (const SweepAxis& axis : plan.sweep->axes) table[0].push_back(axis.pointer);
  for (const std::string& pointer : pointers) table[0].push_back(pointer), table[0].push_back(pointer + "/std_error");
  std::size_t there = 0;
  for (const SweepPoint& point : all) {
    const auto record = read_point(root / point.name);
    const bool counts = record && (*record)["code"].is_number() && (*record)["pointers"] == Json(pointers) &&
                        (*record)["key"] == (shard.of == 1 ? Json(keys[point.index].point) : (*record)["key"]);
    std::string status = "missing";
    if (counts)
      status = (*record)["code"] == 0 ? "ok" : (*record)["code"] == exit_check_failed ? "check failed" : "failed";
    there += counts && status != "failed";
    std::vector<std::string> row{point.name, std::to_string(point.replica), status};
    for (const Json& value : point.values) row.push_back(value_text(value));
    for (std::size_t k = 0; k < 2 * pointers.size(); ++k) {
      row.push_back(counts && status != "failed" ? (*record)["cells"][k].get<std::string>() : std::string());
    }
    table.push_back(std::move(row));
  }
  std::string csv;
  for (const std::vector<std::string>& row : table) {
    for (std::size_t i = 0; i < row.size(); ++i) csv += (i == 0 ? "" : ",") + csv_cell(row[i]);
    csv += '\n';
  }
  const bool interrupted = interrupt_requested();
  // Shards that end at the same time write the same bytes; the last one sees all points.
  write_file_atomically(options.out / "sweep.csv", csv);
  write_file_atomically(options.out / "resolved.json", dump(plan.resolved));
  write_file_atomically(options.out / "summary.md", sweep_summary_markdown(plan, table, failures));
  for (const std::string& failure : failures) console.error(failure);
  // Pictures and page when the whole sweep is there: a shard alone has nothing to show yet.
  if (!interrupted && there == all.size()) {
    try {
      const auto figures = draw_sweep(plan, all, table, pointers, options.out / "figures");
      write_file_atomically(options.out / "report.html", sweep_report_html(plan, table, figures, failures));
    } catch (const StageError& error) {
      console.warning(fmt::format("the sweep is done, but its report is not: {}", error.what()));
    }
  }
  if (failed > failures.size()) console.error(fmt::format("and {} more points", failed - failures.size()));
  if (busy > 0) console.warning(fmt::format("{} points are being run by somebody else", busy.load()));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const ExitCode code = interrupted                              ? exit_interrupted
                        : failed > 0                             ? exit_stage_failed
                        : arguments.gather && there < all.size() ? exit_stage_failed
                        : checks > 0                             ? exit_check_failed
                                                                 : exit_ok;
  Json summary;
  summary["pipeline"] = plan.name;
  summary["warnings"] = Json::array();
  for (const Warning& warning : plan.warnings)
    summary["warnings"].push_back(
        to_string(Problem{{}, {}, warning.problem.pointer, warning.problem.what, warning.problem.suggestion}));
  summary["points"] = all.size();
  summary["done"] = there;
  summary["missing"] = all.size() - there;
  summary["failed"] = failed.load();
  summary["failed_checks"] = checks.load();
  write_file_atomically(options.out / "summary.json", dump(summary));
  Json manifest;
  manifest["pipeline"] = plan.name;
  manifest["shakebed"] = program_version();
  manifest["git"] = source_revision();
  manifest["compiler"] = compiler_text();
  manifest["command_line"] = options.command_line;
  manifest["finished"] = utc_now();
  manifest["wall_seconds"] = seconds;
  manifest["exit_code"] = static_cast<int>(code);
  if (!plan.preset.empty()) manifest["preset"] = plan.preset;
  manifest["document"] = plan.document.to_json();
  manifest["stages"] = Json::array();
  manifest["outputs"] = Json::array({Json{{"file", "sweep.csv"}, {"bytes", csv.size()}, {"sha256", sha256(csv)}}});
  write_file_atomically(options.out / "manifest.json", dump(manifest));
  if (arguments.json) {
    summary["exit_code"] = static_cast<int>(code);
    summary["table"] = (options.out / "sweep.csv").string();
    arguments.result = std::move(summary);
  } else {
    fmt::print("{} of {} points done{} in {}\ntable: {}\n", there, all.size(),
               failed > 0 ? fmt::format(", {} failed: run again to retry them alone", failed.load()) : "",
               duration_text(seconds), (options.out / "sweep.csv").string());
  }
  return code;
}

Json sweep_status(const fs::path& out) {
  std::error_code error;
  if (!fs::is_directory(out / "points", error)) return nullptr;
  std::uint64_t points = 0, done = 0, failed = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(out / "points", error)) {
    ++points;
    if (const auto record = read_point(entry.path())) {
      const int code = (*record)["code"].get<int>();
      if (code == exit_ok || code == exit_check_failed)
        ++done;
      else
        ++failed;
    }
  }
  // The recipe knows how many there should be.
  if (fs::is_regular_file(out / "summary.json", error))
    points = std::max(points, read_json(out / "summary.json").value("points", std::uint64_t{0}));
  return Json{{"points", points}, {"done", done}, {"failed", failed}};
}

namespace {
// For a POSIX shell.
std::string shell_quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}
}  // namespace

int submit_slurm(const Plan& plan, const SlurmOptions& options, Console& console) {
  if (!plan.sweep)
    throw UsageError("this recipe has no \"sweep\": there is only one point, and nothing to spread over a cluster");
  const std::vector<SweepPoint> points = sweep_points(plan);
  if (points.empty()) throw UsageError("the sweep has no points");
  const std::size_t shards = std::min<std::size_t>(static_cast<std::size_t>(options.shards), points.size());
  const fs::path folder = options.out / "slurm";
  const fs::path submitted = folder / "submitted.json";
  std::error_code error;

  // What an earlier submission still has in the queue would be run twice.
  if (fs::is_regular_file(submitted, error) && !options.dry_run) {
    const Json before = read_json(submitted);
    const std::string ids = before.value("job", std::string()) + "," + before.value("gather_job", std::string());
    const ProcessResult queue =
        run_process({"squeue", "--noheader", "--format=%i %T", "--jobs=" + ids}, fs::current_path());
    if (queue.exit_code == 0 && queue.output.find_first_not_of(" \n") != std::string::npos) {
      throw StageError(
          fmt::format("jobs {} of this sweep are still in the queue; wait for them, or end them first: "
                      "scancel {}",
                      ids, before.value("job", std::string()) + " " + before.value("gather_job", std::string())));
    }
  }

  // Only shards with something left to do become tasks.
  std::vector<std::uint8_t> waiting(shards, 0);
  std::size_t missing = 0;
  for (const SweepPoint& point : points) {
    const auto code = code_of_point(options.out / "points" / point.name, keys_of(plan_at(plan, point)).point);
    if (code && (*code == exit_ok || *code == exit_check_failed)) continue;
    waiting[point.index % shards] = 1;
    ++missing;
  }
  std::string tasks;  // "1-3,7"
  std::size_t task_count = 0;
  for (std::size_t i = 0; i < shards; ++i) {
    if (!waiting[i]) continue;
    std::size_t last = i;
    while (last + 1 < shards && waiting[last + 1]) ++last;
    tasks +=
        (tasks.empty() ? "" : ",") + (last == i ? fmt::format("{}", i + 1) : fmt::format("{}-{}", i + 1, last + 1));
    task_count += last - i + 1;
    i = last;
  }

  try {
    fs::create_directories(folder);
  } catch (const fs::filesystem_error& problem) {
    throw StageError(fmt::format("{}: cannot be made: {}", folder.string(), problem.code().message()));
  }
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
  std::vector<std::string> array{"sbatch", "--parsable", "--array=" + tasks,
                                 "--output=" + (fs::absolute(folder) / "%x-%A-%a.log").string()};
  std::vector<std::string> gather{"sbatch", "--parsable",
                                  "--output=" + (fs::absolute(folder) / "%x-%j-gather.log").string()};
  array.insert(array.end(), options.sbatch.begin(), options.sbatch.end());
  gather.insert(gather.end(), options.sbatch.begin(), options.sbatch.end());
  array.push_back((fs::absolute(folder) / "array.sh").string());
  const std::string gather_script = (fs::absolute(folder) / "gather.sh").string();
  if (options.dry_run) {
    if (missing > 0) fmt::print("{}\n", fmt::join(array, " "));
    fmt::print("{}{} {}\n", fmt::join(gather, " "), missing > 0 ? " --dependency=afterany:JOB" : "", gather_script);
    return exit_ok;
  }
  const auto submit = [&](const std::vector<std::string>& arguments) {
    const ProcessResult result = run_process(arguments, fs::current_path());
    std::string id = result.output.substr(0, result.output.find_first_of(";\n"));
    if (result.exit_code != 0 || id.empty() ||
        !std::all_of(id.begin(), id.end(), [](unsigned char c) { return std::isdigit(c); })) {
      throw StageError(fmt::format("sbatch refused (exit code {}): {}", result.exit_code, result.output));
    }
    return id;
  };
  Json record{{"job", ""}, {"gather_job", ""}, {"tasks", task_count}, {"points", points.size()}, {"to_run", missing}};
  if (missing > 0) {
    record["job"] = submit(array);
    write_file_atomically(submitted, dump(record));
    gather.push_back("--dependency=afterany:" + record["job"].get<std::string>());
  }
  gather.push_back(gather_script);
  record["gather_job"] = submit(gather);
  write_file_atomically(submitted, dump(record));
  console.message(fmt::format("{} points, {} to run in {} tasks", points.size(), missing, task_count));
  if (options.json) {
    fmt::print("{}", dump(record));
  } else {
    if (missing > 0) fmt::print("job {} (array {}), then ", record["job"].get<std::string>(), tasks);
    fmt::print("job {} gathers\nlogs: {}\nlook: shakebed status {}\n", record["gather_job"].get<std::string>(),
               folder.string(), options.out.string());
  }
  return exit_ok;
}

}  // namespace shakebed::pipelines
