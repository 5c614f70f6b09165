#include "pipelines/cli/frame_budget.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>

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

// What a run found out.
struct Found {
  std::optional<double> temperature, error;  // the error is that of T over T; nothing where the fit has none
  double radius_px = 0;
  std::uint64_t reduction = 1;
};

Found found_below(const fs::path& out) {
  Found found;
  if (const fs::path file = out / "extract" / "extract.json"; fs::exists(file)) {
    const Json extract = parse_own_json(read_file(file));
    found.radius_px = extract.at("radius").at("value").get<double>();
    found.reduction = extract.at("reduction").get<std::uint64_t>();
  }
  const fs::path file = out / "fit" / "fit.json";
  if (!fs::exists(file)) return found;
  const Json fit = parse_own_json(read_file(file));
  const Json *t = find_pointer(fit, "/temperature/value"), *error = find_pointer(fit, "/statistical_error/value");
  if (t == nullptr || error == nullptr || !t->is_number() || !error->is_number()) return found;
  found.temperature = t->get<double>();
  if (const double relative = error->get<double>() / *found.temperature; relative > 0) found.error = relative;
  return found;
}

class FrameBudget {
 public:
  FrameBudget(const FrameBudgetRequest& request, Console& console) : request_(request), console_(console) {}

  BudgetedFrames choose() {
    const std::uint64_t there = images_module().count_frames(request_.files);
    const std::uint64_t all = there - std::min(there, request_.skip);
    if (all <= pilot_frames) {
      console_.message(fmt::format("--budget \"{}\": all {} frames are measured", request_.budget.text, all));
      return {1, {}, record_of({1, all, 0, 0, true}, {}, all)};
    }
    FramePilot pilot;
    const Run few = needed_pilot(all, few_frames), more = needed_pilot(all, pilot_frames);
    pilot.frames = more.frames;
    pilot.error = more.found.error.value_or(0);
    cost_of_frames(few.frames, few.seconds, more.frames, more.seconds, pilot);
    FrameChoice choice = choose_frames(pilot, all, left());
    if (coarser_may_gain(choice, all, left())) try_coarser(more, all, pilot, choice);
    say(choice, pilot, all);
    std::optional<std::uint64_t> reduction;
    if (coarser_) reduction = coarser_->reduction;
    return {choice.stride, reduction, record_of(choice, pilot, all)};
  }

 private:
  struct Run {
    fs::path out;
    std::uint64_t frames = 0;
    double seconds = 0;
    Found found;
    std::string failure;
  };
  struct Coarser {
    std::uint64_t reduction;
    double shift;  // of T, over T
  };

  Budget left() const {
    Budget left = request_.budget;
    left.seconds = std::max(0.0, time_to_spare * left.seconds - spent_);
    return left;
  }

  // The same frames from fewer pixels. Where these are better, pilot and choice become theirs.
  void try_coarser(const Run& fine, std::uint64_t all, FramePilot& pilot, FrameChoice& choice) {
    const std::uint64_t reduction = coarsest_reduction(fine.found.radius_px, fine.found.reduction);
    if (reduction == fine.found.reduction || !fine.found.temperature) return;
    const Run coarse = run_pilot(all, pilot_frames, reduction);
    choice = choose_frames(pilot, all, left());
    if (!coarse.failure.empty() || !coarse.found.error) return;  // beads are not seen by so few pixels
    if (coarse.found.reduction != reduction) return;             // a change of --set decides
    FramePilot its = pilot;
    its.error = *coarse.found.error;
    its.fixed_seconds = std::min(pilot.fixed_seconds, coarse.seconds);
    its.seconds_per_frame = (coarse.seconds - its.fixed_seconds) / static_cast<double>(coarse.frames);
    const double shift = std::abs(*coarse.found.temperature / *fine.found.temperature - 1);
    const FrameChoice chosen = choose_frames(its, all, left());
    if (!coarser_is_better(choice, chosen, shift, request_.budget)) return;
    pilot = its, choice = chosen, coarser_ = Coarser{reduction, shift};
  }

  Run needed_pilot(std::uint64_t all, std::uint64_t frames) {
    Run run = run_pilot(all, frames, {});
    if (!run.failure.empty())
      throw StageError(
          fmt::format("the pilot run of --budget, with {} of {} frames, failed: {}", run.frames, all, run.failure));
    return run;
  }

  // What it took is spent, also where it fails.
  Run run_pilot(std::uint64_t all, std::uint64_t frames, std::optional<std::uint64_t> reduction) {
    const std::uint64_t stride = all / frames;
    const Plan plan = request_.plan(stride, reduction);
    const std::string name = fmt::format("every-{}", stride) + (reduction ? fmt::format("-by-{}", *reduction) : "");
    Run run{request_.out / ".pilot" / name, (all + stride - 1) / stride, 0, {}, {}};
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
    const auto began = std::chrono::steady_clock::now();
    run_stages(plan, options, nullptr, outcome);
    console_.end_progress();
    if (outcome.code == exit_interrupted) throw Interrupted();
    if (outcome.code == exit_ok) {
      for (const StageOutcome& stage : outcome.stages)  // of an earlier run, too
        if (stage.cost) run.seconds += stage.cost->wall_seconds;
      run.found = found_below(run.out);
    } else {
      run.failure = outcome.error;
      run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    }
    spent_ += run.seconds;
    return run;
  }

  void say(const FrameChoice& choice, const FramePilot& pilot, std::uint64_t all) const {
    const Budget& budget = request_.budget;
    if (budget.seconds > 0 && !choice.possible)
      throw StageError(fmt::format("--budget {}: one frame needs about {}, and the pilot run took {}. Allow more time",
                                   budget.text, duration_text(pilot.fixed_seconds + pilot.seconds_per_frame),
                                   duration_text(spent_)));
    console_.message(fmt::format("--budget \"{}\" chooses {} of {} frames (\"stride\": {})", budget.text, choice.frames,
                                 all, choice.stride));
    if (coarser_)
      console_.message(
          fmt::format("--budget \"{}\" averages them over squares of {} px (\"reduction\": {}). On the "
                      "frames of the pilot run this changes T by {}",
                      budget.text, coarser_->reduction, coarser_->reduction, per_cent(coarser_->shift)));
    console_.message(fmt::format("expected statistical error of T: {}. Expected time: {}. The pilot run took {}",
                                 choice.error > 0 ? per_cent(choice.error) : "unknown", duration_text(choice.seconds),
                                 duration_text(spent_)));
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
      if (coarser_) frames["reduction"] = coarser_->reduction, frames["effect_of_reduction"] = coarser_->shift;
    }
    return Json{{"asked", request_.budget.text}, {"frames", std::move(frames)}, {"stages", Json::array()}};
  }

  const FrameBudgetRequest& request_;
  Console& console_;
  double spent_ = 0;  // wall time of the pilots [s]
  std::optional<Coarser> coarser_;
};

}  // namespace

BudgetedFrames frames_by_budget(const FrameBudgetRequest& request, Console& console) {
  return FrameBudget(request, console).choose();
}

void say_reached_by_frames(const fs::path& out, const Json& record, Console& console) {
  const auto error = found_below(out).error;
  if (!error) return;
  const ReachedByFrames reached = reached_by_frames(*error, record);
  console.message(reached.message);
  if (!reached.warning.empty()) console.warning(reached.warning);
}

}  // namespace shakebed::pipelines
