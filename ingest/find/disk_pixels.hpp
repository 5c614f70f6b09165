#pragma once
// The pixels of a frame that lie within a disk.

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// visit(pixel, dx, dy) for the pixels of a frame at most `reach` px from (x, y): its index, and its place from there
// [px].
template <class Visit>
void for_pixels_within(const GrayFrame& frame, double x, double y, double reach, const Visit& visit) {
  const int top = std::max(0, static_cast<int>(std::ceil(y - reach)));
  const int bottom = std::min(frame.height - 1, static_cast<int>(std::floor(y + reach)));
  for (int row = top; row <= bottom; ++row) {
    const double half = std::sqrt(std::max(0.0, reach * reach - (row - y) * (row - y)));
    const int left = std::max(0, static_cast<int>(std::ceil(x - half)));
    const int right = std::min(frame.width - 1, static_cast<int>(std::floor(x + half)));
    for (int column = left; column <= right; ++column)
      visit(static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width) + static_cast<std::size_t>(column),
            column - x, row - y);
  }
}

}  // namespace shakebed::ingest
