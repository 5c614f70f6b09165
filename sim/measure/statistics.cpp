#include "sim/measure/statistics.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace shakebed::sim {

void BlockedMean::add(std::span<const double> sample) {
  assert(sample.size() == size_);
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

void BlockedCovariance::add(std::span<const double> sample) {
  constexpr std::size_t most_blocks = 512;
  assert(sample.size() == size_);
  if (in_block_ == 0) sum_.assign(size_, 0.0);
  for (std::size_t i = 0; i < size_; ++i) sum_[i] += sample[i];
  if (++in_block_ < block_length_) return;
  for (double& value : sum_) value /= static_cast<double>(block_length_);
  blocks_.push_back(sum_);
  in_block_ = 0;
  if (blocks_.size() < most_blocks) return;
  for (std::size_t b = 0; b < most_blocks / 2; ++b) {
    for (std::size_t i = 0; i < size_; ++i) blocks_[b][i] = 0.5 * (blocks_[2 * b][i] + blocks_[2 * b + 1][i]);
  }
  blocks_.resize(most_blocks / 2);
  block_length_ *= 2;
}

std::vector<double> BlockedCovariance::first_moment() const {
  std::vector<double> moment(blocks_.size());
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    for (std::size_t i = 0; i < size_; ++i) moment[b] += static_cast<double>(i) * blocks_[b][i];
  }
  return statistics::from_mean(std::move(moment));
}

statistics::Windows BlockedCovariance::windows() const {
  std::vector<double> sum(blocks_.size());
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    for (const double x : blocks_[b]) sum[b] += x;
  }
  const std::vector<double> moment = first_moment();
  return statistics::windows_for(
      std::max(statistics::memory_of(statistics::from_mean(std::move(sum))), statistics::memory_of(moment)), moment);
}

std::vector<double> BlockedCovariance::of_means(std::size_t first, std::size_t last) const {
  return statistics::covariance_by_windows(blocks_, first, last, windows());
}

Measured propagated(double value, std::span<const double> gradient, std::span<const double> covariance) {
  double variance = 0;
  for (std::size_t i = 0; i < gradient.size(); ++i) {
    for (std::size_t k = 0; k < gradient.size(); ++k)
      variance += gradient[i] * gradient[k] * covariance[i * gradient.size() + k];
  }
  return {value, std::sqrt(std::max(variance, 0.0))};
}

}  // namespace shakebed::sim
