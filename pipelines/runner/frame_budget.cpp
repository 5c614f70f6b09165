#include "pipelines/runner/frame_budget.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace shakebed::pipelines {

namespace {
// The error of few frames is uncertain itself: of 16 by a fifth.
constexpr double miss_factor = 1.2;

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

std::uint64_t coarsest_reduction(double radius_px, std::uint64_t in_use) {
  return std::max(in_use, static_cast<std::uint64_t>(std::max(1.0, radius_px / enough_radius_px)));
}

bool coarser_may_gain(const FrameChoice& fine, std::uint64_t all, const Budget& left) {
  constexpr std::uint64_t many_for_error = 64, many_for_time = 32;
  return left.error > 0 ? fine.frames >= many_for_error : fine.frames < all && fine.frames >= many_for_time;
}

bool coarser_is_better(const FrameChoice& fine, const FrameChoice& coarse, double shift, const Budget& budget) {
  constexpr double cheaper = 0.8, better = 0.9, small_shift = 0.1;
  if (!(coarse.error > 0) || (fine.possible && !coarse.possible)) return false;
  if (budget.error > 0) return coarse.seconds < cheaper * fine.seconds && shift < small_shift * budget.error;
  return std::hypot(coarse.error, shift) < better * fine.error;
}

ReachedByFrames reached_by_frames(double error, const Json& record) {
  const Budget asked = parse_budget(record.at("asked").get<std::string>());
  const Json& frames = record.at("frames");
  const auto stride = frames.at("stride").get<std::uint64_t>();
  ReachedByFrames reached{fmt::format("statistical error of T: {}, from {} of {} frames", per_cent(error),
                                      frames.at("measured").get<std::uint64_t>(), frames.at("of").get<std::uint64_t>()),
                          ""};
  if (!(asked.error > 0) || error <= miss_factor * asked.error) return reached;
  const std::string missed =
      fmt::format("the statistical error of T is {}, more than the wanted {}: ", per_cent(error), asked.text);
  const double smaller = static_cast<double>(stride) * std::pow(asked.error / error, 2);
  if (stride > 1) {
    reached.warning = missed + fmt::format(
                                   "its first estimate, from a few frames, was too small. More frames reduce it: --set "
                                   "/stages/extract/stride={} in place of --budget",
                                   static_cast<std::uint64_t>(std::max(1.0, smaller)));
  } else if (frames.value("possible", false)) {  // else it was said before the run
    reached.warning = missed +
                      "successive frames are not independent, which the pilot run of frames far apart does not show. "
                      "All frames are measured; a longer film reduces the error";
  }
  return reached;
}

void cost_of_frames(std::uint64_t few, double seconds_of_few, std::uint64_t more, double seconds_of_more,
                    FramePilot& pilot) {
  const double slope = (seconds_of_more - seconds_of_few) / static_cast<double>(more - few);
  const bool sensible = slope > 0 && slope * static_cast<double>(more) <= seconds_of_more;
  pilot.seconds_per_frame = sensible ? slope : seconds_of_more / static_cast<double>(more);
  pilot.fixed_seconds = seconds_of_more - pilot.seconds_per_frame * static_cast<double>(more);
}

}  // namespace shakebed::pipelines
