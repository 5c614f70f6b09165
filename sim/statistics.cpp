#include "sim/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace shakebed::sim {

void BlockedMean::add(std::span<const double> sample) {
  std::vector<double> block(sample.begin(), sample.end());
  for (std::size_t depth = 0;; ++depth) {
    if (depth == levels_.size())
      levels_.push_back({0, false, std::vector<double>(size_), std::vector<double>(size_), std::vector<double>(size_)});
    Level& level = levels_[depth];
    ++level.blocks;
    for (std::size_t i = 0; i < size_; ++i) {
      const double difference = block[i] - level.mean[i];
      level.mean[i] += difference / static_cast<double>(level.blocks);
      level.sum_of_squares[i] += difference * (block[i] - level.mean[i]);
    }
    if (!level.waiting) {
      level.half = block;
      level.waiting = true;
      return;
    }
    level.waiting = false;
    for (std::size_t i = 0; i < size_; ++i) block[i] = 0.5 * (block[i] + level.half[i]);
  }
}

double BlockedMean::mean(std::size_t i) const {
  return levels_.empty() ? std::numeric_limits<double>::quiet_NaN() : levels_[0].mean[i];
}

double BlockedMean::std_error(std::size_t i) const {
  if (samples() < 2) return std::numeric_limits<double>::quiet_NaN();
  double largest = 0;
  for (const Level& level : levels_) {
    if (&level != &levels_[0] && level.blocks < 16) break;
    const auto blocks = static_cast<double>(level.blocks);
    largest = std::max(largest, std::sqrt(level.sum_of_squares[i] / (blocks * (blocks - 1))));
  }
  return largest;
}

}  // namespace shakebed::sim
