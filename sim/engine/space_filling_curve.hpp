// The order in which disks are numbered inside the engine: along a Hilbert curve, so that neighbours in space are
// neighbours in memory.
#pragma once

#include <algorithm>
#include <cstdint>

namespace shakebed::sim {

// Place of a cell (0 to 65535 each way) along the Hilbert curve that fills the square [Hilbert1891].
inline std::uint32_t hilbert_place(std::uint32_t column, std::uint32_t row) {
  std::uint32_t place = 0;
  for (std::uint32_t side = 1u << 15; side > 0; side >>= 1) {
    const std::uint32_t right = (column & side) != 0, up = (row & side) != 0;
    place += side * side * ((3 * right) ^ up);
    if (up == 0) {
      if (right == 1) {
        column = ~column;
        row = ~row;
      }
      const std::uint32_t swapped = column;
      column = row;
      row = swapped;
    }
  }
  return place;
}

// The curve's square, cells of 1 D, begins somewhat beside the box's corner: disks may stand beyond the walls' places.
inline constexpr double hilbert_offset = 16;
inline std::uint32_t hilbert_cell(double place) {
  return static_cast<std::uint32_t>(std::clamp(place + hilbert_offset, 0.0, 65535.0));
}
inline double place_of_hilbert_cell(std::uint32_t cell) { return cell - hilbert_offset; }

}  // namespace shakebed::sim
