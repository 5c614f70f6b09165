// Means of correlated samples, as the samples stream past, with errors that allow for the correlation: by overlapping
// windows, corrected for what windows of their length still miss (statistics/correlated_series.hpp). Blocking alone
// [FlyvbjergPetersen1989] needs series of hundreds of correlation times. Of the variance of the mean of 106 samples
// with a correlation time of 3 it found 0.45, windows 0.99. Of 1,000 samples with one of 10 it found 0.75, windows
// 0.95.
//
// An accumulator owns its sums. One thread at a time may use one; different ones share nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "statistics/correlated_series.hpp"

namespace shakebed::sim {

struct Measured {
  double value = 0, std_error = 0;
};

// The means of `size` quantities sampled together, with their errors and covariances. Keeps block means, at most 512,
// and doubles the block length when there are more, so memory does not grow with the samples.
class CorrelatedMeans {
 public:
  // `first_block`: samples in a block at first; a period of what repeats, so that no block holds a part of one.
  explicit CorrelatedMeans(std::size_t size = 1, std::size_t first_block = 1)
      : size_(size), block_length_(first_block) {}

  void add(std::span<const double> sample);  // of `size` values
  void add(double value) { add(std::span(&value, 1)); }

  std::uint64_t samples() const { return samples_; }
  std::size_t blocks() const { return blocks_.size(); }
  double mean(std::size_t i = 0) const;  // of all samples; NaN without any
  // By windows of blocks, as long as this quantity is correlated over. With fewer than 16 blocks, the estimate for
  // uncorrelated ones; NaN with fewer than 2.
  double std_error(std::size_t i = 0) const;
  // Of the means of the quantities first to last-1, row by row.
  std::vector<double> covariance(std::size_t first, std::size_t last, const statistics::Windows& windows) const {
    return statistics::covariance_by_windows(blocks_, first, last, windows);
  }
  // From the more slowly decaying of two series, and corrected for it: the sum of the quantities first to last-1 and
  // their first moment (sum of (i - first) x_i). Of one quantity: from its series.
  statistics::Windows windows(std::size_t first, std::size_t last) const;

  template <class Archive>
  void visit(Archive& archive) {
    archive(size_, block_length_, in_block_, samples_, mean_, sum_, blocks_);
  }

 private:
  std::size_t size_, block_length_;
  std::size_t in_block_ = 0;
  std::uint64_t samples_ = 0;
  std::vector<double> mean_, sum_;  // of all samples, running; of the block
  std::vector<std::vector<double>> blocks_;
};

// A function of means: its value, and by its derivatives (gradient) and the covariance of the means, row by row, its
// error.
Measured propagated(double value, std::span<const double> gradient, std::span<const double> covariance);

}  // namespace shakebed::sim
