#pragma once
// Copies of a picture at another scale or shape, for searches.

#include <vector>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// Twice the resolution (bilinear).
GrayFrame doubled(const GrayFrame& frame);

// The picture stretched by sqrt(ratio) along the axis at `angle` and shrunk by as much across it, about its middle;
// what lies beyond the border is mirrored.
GrayFrame stretched(const GrayFrame& frame, double ratio, double angle);

// Its lines, one at a time.
class StretchedLines {
 public:
  // The frame must outlive it.
  StretchedLines(const GrayFrame& frame, double ratio, double angle);
  // Valid until the next line is asked for.
  const float* line(int row);

 private:
  const GrayFrame& frame_;
  float middle_x_, middle_y_, xx_, xy_, yy_;
  std::vector<float> line_;
};

// Where in the frame the copy's place (x, y) was taken from.
struct FramePlace {
  double x = 0, y = 0;
};
FramePlace place_before_stretching(const GrayFrame& frame, double ratio, double angle, double x, double y);

// A picture in which a length of the frame is `scale` times as long, and where its places are in the frame.
struct ScaledPicture {
  GrayFrame picture;
  double scale = 1;          // full px per px
  double left = 0, top = 0;  // of the picture within the frame, full px
  [[nodiscard]] double to_frame_x(double x) const { return left + (x + 0.5) * scale - 0.5; }
  [[nodiscard]] double to_frame_y(double y) const { return top + (y + 0.5) * scale - 0.5; }
  [[nodiscard]] double from_frame_x(double x) const { return (x + 0.5 - left) / scale - 0.5; }
  [[nodiscard]] double from_frame_y(double y) const { return (y + 0.5 - top) / scale - 0.5; }
};

// Reduced so that a radius becomes `wanted_px` (8 or more) to twice that, doubled if it is below 5 px; by which factor.
inline constexpr double quick_radius_px = 8;
double scale_for(double radius_px, double wanted_px = quick_radius_px);
ScaledPicture scaled_for(const GrayFrame& frame, double radius_px, double wanted_px = quick_radius_px);

}  // namespace shakebed::ingest
