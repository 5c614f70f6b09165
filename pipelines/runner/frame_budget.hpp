// --budget for photographs and films: how many of their frames are measured, for an error of T or a time.
#pragma once

#include <cstdint>

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

// Line through the wall times of two pilots. A slope below 0 is noise: all time then counts for each frame.
void cost_of_frames(std::uint64_t few, double seconds_of_few, std::uint64_t more, double seconds_of_more,
                    FramePilot& pilot);

}  // namespace shakebed::pipelines
