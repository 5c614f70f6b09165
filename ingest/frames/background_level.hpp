#pragma once
// The level of the background, which follows the light: a polynomial of second order over the picture.

#include <array>
#include <vector>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// The surface on which most levels of a frame lie. The search begins at the most frequent level.
class BackgroundLevel {
 public:
  explicit BackgroundLevel(const GrayFrame& frame);
  // |level - background|. The frame may be another of the same film.
  [[nodiscard]] GrayFrame distance_of(const GrayFrame& frame) const;
  // u and v run from -1 to 1 over the picture.
  [[nodiscard]] double at(double u, double v) const;

 private:
  struct Sample {
    double u = 0, v = 0, level = 0;
  };
  static std::vector<Sample> samples_of(const GrayFrame& frame);
  void fit(const std::vector<Sample>& samples, int order, double reach);
  std::array<double, 6> terms_{};  // of 1, u, v, 2 u^2 - 1, u v, 2 v^2 - 1
};

// The channel `grey_distance` of a picture whose other channels were read.
GrayFrame grey_distance_of(const ChannelFrames& frames);

}  // namespace shakebed::ingest
