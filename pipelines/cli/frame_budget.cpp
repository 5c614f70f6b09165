#include "pipelines/cli/frame_budget.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipelines/formats/duration.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/runner/folder_lock.hpp"
#include "pipelines/runner/run.hpp"
#include "pipelines/stages/images_module.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

// Frames of the pilots. With 16 the error of T is known to about a fifth; below 4 there is no covariance to speak of.
constexpr std::uint64_t few_frames = 4, pilot_frames = 16;
constexpr double time_to_spare = 0.95;

// The error of few frames is uncertain itself: of 16 by a fifth.
constexpr double miss_factor = 1.2;

// The statistical error of T over T; nothing where the fit gives no temperature.
std::optional<double> fitted_error(const fs::path& out) {
  const fs::path file = out / "fit" / "fit.json";
  if (!fs::exists(file)) return std::nullopt;
  const Json fit = parse_own_json(read_file(file));
  const Json *t = find_pointer(fit, "/temperature/value"), *error = find_pointer(fit, "/statistical_error/value");
  if (t == nullptr || error == nullptr || !t->is_number() || !error->is_number()) return std::nullopt;
  const double relative = error->get<double>() / t->get<double>();
  if (!(relative > 0)) return std::nullopt;
  return relative;
}

std::string per_cent(double relative) { return fmt::format("{:.2g} %", 100 * relative); }

class FrameBudget {
 public:
  FrameBudget(const FrameBudgetRequest& request, Console& console) : request_(request), console_(console) {}

  BudgetedFrames choose() {
    const std::uint64_t all = images_module().count_frames(request_.files);
    if (all <= pilot_frames) {
      console_.message(fmt::format("--budget \"{}\": all {} frames are measured", request_.budget.text, all));
      return {1, record_of({1, all, 0, 0, true}, {}, all)};
    }
    FramePilot pilot;
    const Run few = run_pilot(all, few_frames), more = run_pilot(all, pilot_frames);
    pilot.frames = more.frames;
    if (const auto error = fitted_error(more.out)) pilot.error = *error;
    cost_of_frames(few.frames, few.seconds, more.frames, more.seconds, pilot);
    Budget left = request_.budget;
    left.seconds = std::max(0.0, time_to_spare * left.seconds - few.seconds - more.seconds);
    const FrameChoice choice = choose_frames(pilot, all, left);
    say(choice, pilot, all, few.seconds + more.seconds);
    return {choice.stride, record_of(choice, pilot, all)};
  }

 private:
  struct Run {
    fs::path out;
    std::uint64_t frames = 0;
    double seconds = 0;
  };

  Run run_pilot(std::uint64_t all, std::uint64_t frames) {
    const std::uint64_t stride = all / frames;
    const Plan plan = request_.plan(stride);
    Run run{request_.out / ".pilot" / fmt::format("every-{}", stride), (all + stride - 1) / stride, 0};
    RunOptions options;
    options.out = run.out;
    options.until = "fit";
    options.jobs = request_.jobs;
    options.force = request_.force;
    options.on_progress = [&](const std::string&, double fraction) { console_.progress("pilot", fraction); };
    fs::create_directories(run.out);
    const FolderLock lock(run.out);
    remove_leftovers(run.out);
    RunOutcome outcome;
    outcome.out = run.out;
    run_stages(plan, options, nullptr, outcome);
    console_.end_progress();
    if (outcome.code == exit_interrupted) throw Interrupted();
    if (outcome.code != exit_ok)
      throw StageError(
          fmt::format("the pilot run of --budget, with {} of {} frames, failed: {}", run.frames, all, outcome.error));
    for (const StageOutcome& stage : outcome.stages)
      if (stage.cost) run.seconds += stage.cost->wall_seconds;
    return run;
  }

  void say(const FrameChoice& choice, const FramePilot& pilot, std::uint64_t all, double pilot_seconds) const {
    const Budget& budget = request_.budget;
    if (budget.seconds > 0 && !choice.possible)
      throw StageError(fmt::format("--budget {}: one frame needs about {}, and the pilot run took {}. Allow more time",
                                   budget.text, duration_text(pilot.fixed_seconds + pilot.seconds_per_frame),
                                   duration_text(pilot_seconds)));
    console_.message(fmt::format("--budget \"{}\" chooses {} of {} frames (\"stride\": {})", budget.text, choice.frames,
                                 all, choice.stride));
    console_.message(fmt::format("expected statistical error of T: {}. Expected time: {}. The pilot run took {}",
                                 choice.error > 0 ? per_cent(choice.error) : "unknown", duration_text(choice.seconds),
                                 duration_text(pilot_seconds)));
    if (choice.possible || budget.seconds > 0) return;
    if (pilot.error > 0)
      console_.warning(
          fmt::format("all {} frames together leave a statistical error of T of about {}, more than the "
                      "wanted {}. More frames reduce it",
                      all, per_cent(choice.error), budget.text));
    else
      console_.warning(
          fmt::format("the fit to the {} frames of the pilot run has no error of T. All {} frames are measured",
                      pilot.frames, all));
  }

  Json record_of(const FrameChoice& choice, const FramePilot& pilot, std::uint64_t all) const {
    Json frames{{"stride", choice.stride}, {"measured", choice.frames}, {"of", all}};
    if (pilot.frames > 0) {
      if (choice.error > 0) frames["expected_error"] = choice.error;
      frames["wall_seconds"] = choice.seconds;
      frames["possible"] = choice.possible;
      frames["pilot"] = Json{{"frames", pilot.frames}, {"error", pilot.error}};
    }
    return Json{{"asked", request_.budget.text}, {"frames", std::move(frames)}, {"stages", Json::array()}};
  }

  const FrameBudgetRequest& request_;
  Console& console_;
};

}  // namespace

BudgetedFrames frames_by_budget(const FrameBudgetRequest& request, Console& console) {
  return FrameBudget(request, console).choose();
}

void say_reached_by_frames(const fs::path& out, const Json& record, Console& console) {
  const auto reached = fitted_error(out);
  if (!reached) return;
  const Budget asked = parse_budget(record.at("asked").get<std::string>());
  const Json& frames = record.at("frames");
  console.message(fmt::format("statistical error of T: {}, from {} of {} frames", per_cent(*reached),
                              frames.at("measured").get<std::uint64_t>(), frames.at("of").get<std::uint64_t>()));
  const auto stride = frames.at("stride").get<std::uint64_t>();
  if (!(asked.error > 0) || stride == 1 || *reached <= miss_factor * asked.error) return;
  const double smaller = static_cast<double>(stride) * std::pow(asked.error / *reached, 2);
  console.warning(fmt::format(
      "the statistical error of T is {}, more than the wanted {}: its first estimate, from a few frames, was "
      "too small. More frames reduce it: --set /stages/extract/stride={} in place of --budget",
      per_cent(*reached), asked.text, static_cast<std::uint64_t>(std::max(1.0, smaller))));
}

}  // namespace shakebed::pipelines
