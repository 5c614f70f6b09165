// Means of correlated samples with honest errors: blocking [FlyvbjergPetersen1989], as the samples stream past.
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

// Means of `size` quantities sampled together. Memory: 3 numbers a quantity and level, log2(samples) levels.
class BlockedMean {
 public:
  explicit BlockedMean(std::size_t size = 1) : size_(size) {}

  void add(std::span<const double> sample);  // of `size` values
  void add(double value) { add(std::span(&value, 1)); }

  std::uint64_t samples() const { return levels_.empty() ? 0 : levels_[0].blocks; }
  double mean(std::size_t i = 0) const;
  // The largest of the estimates over all block lengths that leave at least 16 blocks: grows to the plateau where
  // neighbouring blocks are independent. With fewer than 16 samples, the uncorrelated estimate; NaN with fewer than 2.
  double std_error(std::size_t i = 0) const;

  template <class Archive>
  void visit(Archive& archive) {
    archive(size_, levels_);
  }

 private:
  struct Level {
    std::uint64_t blocks = 0;
    bool waiting = false;
    std::vector<double> half;                  // a block that waits for its partner
    std::vector<double> mean, sum_of_squares;  // running (Welford)
    template <class Archive>
    void visit(Archive& archive) {
      archive(blocks, waiting, half, mean, sum_of_squares);
    }
  };
  std::size_t size_;
  std::vector<Level> levels_;
};

// The covariance of means of correlated quantities: keeps block means, at most 512, and doubles the block length when
// there are more, so memory does not grow with the samples.
class BlockedCovariance {
 public:
  explicit BlockedCovariance(std::size_t size = 1) : size_(size) {}
  void add(std::span<const double> sample);  // of `size` values
  std::size_t blocks() const { return blocks_.size(); }
  // Of the means of the quantities first to last-1, row by row, by windows of blocks.
  std::vector<double> of_means(std::size_t first, std::size_t last) const;
  // From the more slowly decaying of two series, and corrected for it: the sum of the quantities and their first moment
  // (sum of i x_i).
  statistics::Windows windows() const;

  template <class Archive>
  void visit(Archive& archive) {
    archive(size_, block_length_, in_block_, sum_, blocks_);
  }

 private:
  std::vector<double> first_moment() const;  // of every block, from its mean

  std::size_t size_;
  std::size_t block_length_ = 1, in_block_ = 0;
  std::vector<double> sum_;
  std::vector<std::vector<double>> blocks_;
};

// A function of means: its value, and by its derivatives (gradient) and the covariance of the means, row by row, its
// error.
Measured propagated(double value, std::span<const double> gradient, std::span<const double> covariance);

}  // namespace shakebed::sim
