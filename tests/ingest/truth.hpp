#pragma once
// Found disks against known ones.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "ingest/find/find_disks.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"

namespace shakebed::ingest::test {

struct Score {
  std::size_t truths = 0, found = 0, hits = 0;
  double rms_px = 0;  // per axis
  [[nodiscard]] double recall() const { return truths ? static_cast<double>(hits) / static_cast<double>(truths) : 1; }
  [[nodiscard]] double precision() const { return found ? static_cast<double>(hits) / static_cast<double>(found) : 1; }
};

// One-to-one within half a radius, among true disks whose centre lies in the frame.
inline Score score(const std::vector<FoundDisk>& found, const std::vector<RenderedDisk>& truth, int width, int height) {
  Score result;
  result.found = found.size();
  std::vector<bool> used(found.size(), false);
  double square = 0;
  for (const RenderedDisk& disk : truth) {
    if (disk.x_px < -0.5 || disk.y_px < -0.5 || disk.x_px >= width - 0.5 || disk.y_px >= height - 0.5) continue;
    ++result.truths;
    double best = std::max(1.0, 0.5 * disk.radius_px);
    std::size_t winner = found.size();
    for (std::size_t k = 0; k < found.size(); ++k) {
      const double distance = std::hypot(found[k].x_px - disk.x_px, found[k].y_px - disk.y_px);
      if (!used[k] && distance < best) {
        best = distance;
        winner = k;
      }
    }
    if (winner == found.size()) continue;
    used[winner] = true;
    ++result.hits;
    square += best * best;
  }
  result.rms_px = result.hits ? std::sqrt(square / 2 / static_cast<double>(result.hits)) : 0;
  return result;
}

}  // namespace shakebed::ingest::test
