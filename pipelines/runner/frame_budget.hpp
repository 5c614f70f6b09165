// --budget for photographs and films: how many of their frames are measured, and from how many pixels, for an error of
// T or a time.
#pragma once

#include <cstdint>
#include <string>

#include "pipelines/formats/json.hpp"
#include "pipelines/runner/budget.hpp"

namespace shakebed::pipelines {

// What pilots with some of the frames have shown.
struct FramePilot {
  std::uint64_t frames = 0;      // measured, equally spaced
  double error = 0;              // statistical error of T over T; 0: unknown
  double fixed_seconds = 0;      // wall time that does not depend on the number of frames measured
  double seconds_per_frame = 0;  // wall time
};

struct FrameChoice {
  std::uint64_t stride = 1;  // every so many frames are measured
  std::uint64_t frames = 0;  // that are measured then
  double error = 0;          // expected: statistical error of T over T; 0: unknown
  double seconds = 0;        // expected wall time
  bool possible = true;      // false: not even all frames, or only one frame, give what is asked for
};

// For an error: the largest stride that gives it, with no fewer frames than the pilot had. For a time: the smallest
// stride with which the frames fit into what is left of it. Frames are taken to be independent: the squared error falls
// as one over their number. The error of so few frames is itself uncertain. So its square is enlarged by as much as
// the reciprocal of a variance of frames - 1 degrees of freedom is too large on average.
FrameChoice choose_frames(const FramePilot& pilot, std::uint64_t all, const Budget& left);

// Frames may be averaged over squares of so many pixels that a bead has still this radius [px]. What that changes was
// measured: docs/how-to/budget.md.
constexpr double enough_radius_px = 6;
// The side of these squares [px], given the one in use.
std::uint64_t coarsest_reduction(double radius_px, std::uint64_t in_use);
// Whether a pilot with such frames could gain more than it costs: many frames are needed for an error. Or many fit into
// the time that is left, but not all.
bool coarser_may_gain(const FrameChoice& fine, std::uint64_t all, const Budget& left);
// Whether the choice from reduced frames is better. `shift`: by which share of itself T of the same frames has changed.
// For an error: it takes less than 0.8 of the time, and the shift is below a tenth of the error. For a time: error and
// shift together are below 0.9 of the error.
bool coarser_is_better(const FrameChoice& fine, const FrameChoice& coarse, double shift, const Budget& budget);

// What a finished run says of its statistical error of T, relative to T. `record`: "budget" of its manifest. The
// warning is empty unless the error is larger than asked by more than the pilot's estimate is uncertain.
struct ReachedByFrames {
  std::string message, warning;
};
ReachedByFrames reached_by_frames(double error, const Json& record);

// Line through the wall times of two pilots. A slope below 0 is noise: all time then counts for each frame.
void cost_of_frames(std::uint64_t few, double seconds_of_few, std::uint64_t more, double seconds_of_more,
                    FramePilot& pilot);

}  // namespace shakebed::pipelines
