#pragma once
// A picture turned, mirrored or made a negative, and where its places and directions are then.

#include <utility>
#include <vector>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest::test {

struct Turn {
  const char* what;
  bool transpose = false, flip_x = false, flip_y = false, negative = false;

  // Flipped first, then transposed.
  [[nodiscard]] std::pair<double, double> place(const GrayFrame& frame, double x, double y) const {
    if (flip_x) x = frame.width - 1 - x;
    if (flip_y) y = frame.height - 1 - y;
    return transpose ? std::pair{y, x} : std::pair{x, y};
  }
  [[nodiscard]] std::pair<int, int> pixel(const GrayFrame& frame, int column, int row) const {
    const auto [x, y] = place(frame, column, row);
    return {static_cast<int>(x), static_cast<int>(y)};
  }
  // Of a slope: that of a negative is the opposite.
  [[nodiscard]] std::pair<double, double> vector(double x, double y) const {
    if (flip_x != negative) x = -x;
    if (flip_y != negative) y = -y;
    return transpose ? std::pair{y, x} : std::pair{x, y};
  }
  [[nodiscard]] GrayFrame of(const GrayFrame& frame) const {
    GrayFrame out = frame;
    if (transpose) std::swap(out.width, out.height);
    for (int row = 0; row < frame.height; ++row)
      for (int column = 0; column < frame.width; ++column) {
        const auto [x, y] = pixel(frame, column, row);
        const float level = frame.at(column, row);
        out.pixels[static_cast<std::size_t>(y * out.width + x)] = negative && level < 1e5F ? 255 - level : level;
      }
    return out;
  }
};

inline std::vector<Turn> turns() {
  return {{.what = "left and right exchanged", .flip_x = true},
          {.what = "upside down", .flip_y = true},
          {.what = "rows and columns exchanged", .transpose = true},
          {.what = "negative", .negative = true}};
}

}  // namespace shakebed::ingest::test
