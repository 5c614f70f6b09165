#pragma once
// Edges of a picture: gradients, the weakest one that is no noise, and thin ridges of steepest change.

#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// A pixel on a ridge of the gradient's size, with the unit vector towards the brighter side.
struct RidgePixel {
  float x = 0, y = 0, unit_x = 0, unit_y = 0;
};

struct EdgeMap {
  int width = 0, height = 0;
  std::vector<float> x, y;  // gradient of the smoothed picture towards brighter, grey levels per px
  float threshold = 0;      // the weakest gradient that counts as an edge, grey levels per px
  std::vector<RidgePixel> ridge;
  [[nodiscard]] std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
  }
  // Size of the gradient, grey levels per px. std::hypot takes twice as long.
  [[nodiscard]] float slope(std::size_t at) const { return std::sqrt(x[at] * x[at] + y[at] * y[at]); }
};

// px: the height of a sharp step over the slope it has in the map, sqrt(2 pi) times the smoothing.
inline constexpr double step_per_slope = 2.5;

// The picture is smoothed by a binomial filter of five pixels (a standard deviation of one pixel). Next to unseen
// pixels there is no edge. `threshold` 0: found from the picture's noise and its strongest edges.
// A picture made by doubled() has the noise of the one it was made of, spread over two pixels.
enum class Pixels { own, doubled };
EdgeMap find_edges(const GrayFrame& frame, float threshold = 0, Pixels pixels = Pixels::own);

// The same of a picture that is made line by line and never held: row(0), row(1), .. are asked for in this order. Each
// is read before the next is asked for. `threshold` is above 0.
EdgeMap find_edges(int width, int height, const std::function<const float*(int)>& row, float threshold);

}  // namespace shakebed::ingest
