#include "pipelines/runner/frame_budget.hpp"

#include <algorithm>
#include <cmath>

namespace shakebed::pipelines {

namespace {
// How much larger the expected squared error is than that of the pilot.
double allowance_of_frames(std::uint64_t frames) {
  const double freedom = static_cast<double>(frames) - 1;
  return freedom > 3 ? freedom / (freedom - 2) : 3;
}
}  // namespace

FrameChoice choose_frames(const FramePilot& pilot, std::uint64_t all, const Budget& left) {
  const auto whole = static_cast<double>(all), seen = static_cast<double>(pilot.frames);
  const double wanted =
      left.error > 0 ? std::ceil(seen * allowance_of_frames(pilot.frames) * std::pow(pilot.error / left.error, 2))
                     : std::floor((left.seconds - pilot.fixed_seconds) / pilot.seconds_per_frame);
  FrameChoice choice;
  choice.possible = left.error > 0 ? pilot.error > 0 && wanted <= whole : wanted >= 1;
  const double frames = std::clamp(wanted, left.error > 0 ? std::min(seen, whole) : 1.0, whole);
  // At least so many frames for an error, at most so many for a time.
  const double stride = left.error > 0 ? std::floor(whole / frames) : std::ceil(whole / frames);
  choice.stride = static_cast<std::uint64_t>(std::max(1.0, stride));
  choice.frames = (all + choice.stride - 1) / choice.stride;
  choice.error = pilot.error * std::sqrt(seen / static_cast<double>(choice.frames));
  choice.seconds = pilot.fixed_seconds + static_cast<double>(choice.frames) * pilot.seconds_per_frame;
  return choice;
}

void cost_of_frames(std::uint64_t few, double seconds_of_few, std::uint64_t more, double seconds_of_more,
                    FramePilot& pilot) {
  const double slope = (seconds_of_more - seconds_of_few) / static_cast<double>(more - few);
  const bool sensible = slope > 0 && slope * static_cast<double>(more) <= seconds_of_more;
  pilot.seconds_per_frame = sensible ? slope : seconds_of_more / static_cast<double>(more);
  pilot.fixed_seconds = seconds_of_more - pilot.seconds_per_frame * static_cast<double>(more);
}

}  // namespace shakebed::pipelines
