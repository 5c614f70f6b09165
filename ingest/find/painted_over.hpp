// A frame with its beads painted over by what is behind them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "ingest/calibrate/calibration.hpp"
#include "ingest/find/find_disks.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// Levels behind beads: in each square cell of the frame, the quantile `rank` of the pixels that are seen and not
// hidden. Between the middles of the cells they are linear. A cell with few such pixels has the mean of its neighbours'
// levels.
class LevelsBehind {
 public:
  // `hidden`: 1 for each pixel that a bead covers, else 0.
  LevelsBehind(const GrayFrame& frame, const std::vector<std::uint8_t>& hidden, double cell_px, double rank);
  // Whether any cell has pixels enough; else there are no levels.
  [[nodiscard]] bool known() const { return !levels_.empty(); }
  [[nodiscard]] float at(int x, int y) const;

 private:
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
  }
  [[nodiscard]] float level(int column, int row) const { return levels_[index(column, row)]; }
  [[nodiscard]] std::optional<float> level_in(const GrayFrame& frame, const std::vector<std::uint8_t>& hidden,
                                              int column, int row, double rank) const;
  void fill(std::vector<std::optional<float>> known);

  int cell_, columns_, rows_;
  std::vector<float> levels_;
};

// 1 for each pixel of the frame within a disk that is `margin` px larger than found, else 0.
std::vector<std::uint8_t> covered_by(const GrayFrame& frame, const std::vector<FoundDisk>& disks, double margin);

// The frame with these disks, `margin` px larger each, painted over by what is behind them, as noisy as the rest.
// `left` is the polarity of the beads that may be left: what is behind is then rather dark, or rather bright. Nothing
// when the disks cover all of the frame.
std::optional<GrayFrame> painted_over(const GrayFrame& frame, const std::vector<FoundDisk>& disks, double margin,
                                      Polarity left);

}  // namespace shakebed::ingest
