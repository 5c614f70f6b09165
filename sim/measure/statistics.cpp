#include "sim/measure/statistics.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace shakebed::sim {

void CorrelatedMeans::add(std::span<const double> sample) {
  constexpr std::size_t most_blocks = 512;
  assert(sample.size() == size_);
  if (samples_ == 0) mean_.assign(size_, 0.0);
  ++samples_;
  for (std::size_t i = 0; i < size_; ++i) mean_[i] += (sample[i] - mean_[i]) / static_cast<double>(samples_);
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

double CorrelatedMeans::mean(std::size_t i) const {
  return samples_ == 0 ? std::numeric_limits<double>::quiet_NaN() : mean_[i];
}

double CorrelatedMeans::std_error(std::size_t i) const {
  if (blocks() < 2) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> series(blocks());
  for (std::size_t b = 0; b < blocks(); ++b) series[b] = blocks_[b][i];
  return statistics::mean_of(series).std_error;
}

statistics::Windows CorrelatedMeans::windows(std::size_t first, std::size_t last) const {
  std::vector<double> sum(blocks()), moment(blocks());
  for (std::size_t b = 0; b < blocks(); ++b) {
    for (std::size_t i = first; i < last; ++i) {
      sum[b] += blocks_[b][i];
      moment[b] += static_cast<double>(i - first) * blocks_[b][i];
    }
  }
  sum = statistics::from_mean(std::move(sum));
  if (last - first == 1) return statistics::windows_for(statistics::memory_of(sum), sum);
  moment = statistics::from_mean(std::move(moment));
  return statistics::windows_for(std::max(statistics::memory_of(sum), statistics::memory_of(moment)), moment);
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
