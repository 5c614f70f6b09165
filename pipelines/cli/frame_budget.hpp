// --budget of fit-images: pilots with a few of the frames, and the choice.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/runner/console.hpp"
#include "pipelines/runner/frame_budget.hpp"
#include "pipelines/runner/plan.hpp"

namespace shakebed::pipelines {

struct FrameBudgetRequest {
  Budget budget;
  std::vector<std::string> files;
  std::uint64_t skip = 0;     // frames left out at the beginning
  std::filesystem::path out;  // of the run; pilots are below OUT/.pilot
  int jobs = 0;
  bool force = false;
  // Whose stages `extract` and `fit` measure every so many frames, averaged over squares of so many pixels, if
  // that is given.
  std::function<Plan(std::uint64_t stride, std::optional<std::uint64_t> reduction)> plan;
};

struct BudgetedFrames {
  std::uint64_t stride = 1;
  std::optional<std::uint64_t> reduction;  // where frames are averaged more than they are without a budget
  Json record;                             // for the manifest
};

// Runs the pilots and says what is chosen and expected. What is there from an earlier call is not run again. Few frames
// are all measured, without a pilot. Throws InputError for files that cannot be read, StageError where a pilot fails
// or the time is too short, Interrupted.
BudgetedFrames frames_by_budget(const FrameBudgetRequest& request, Console& console);

// Says what the finished run below `out` has reached; warns where its statistical error is larger than asked.
void say_reached_by_frames(const std::filesystem::path& out, const Json& record, Console& console);

}  // namespace shakebed::pipelines
