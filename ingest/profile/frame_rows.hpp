#pragma once
// One row of numbers per frame, all of one length, in one block of memory. A long film has many rows.

#include <algorithm>
#include <cstddef>
#include <vector>

namespace shakebed::ingest {

class FrameRows {
 public:
  // `expected` rows, if known.
  void add(const std::vector<double>& row, std::size_t expected) {
    if (count_ == 0) {
      length_ = row.size();
      values_.reserve(length_ * expected);
    }
    ++count_;
    for (const double value : row) values_.push_back(static_cast<float>(value));
  }
  [[nodiscard]] std::size_t size() const { return count_; }
  // The first `length` numbers of the k-th row, or of all.
  [[nodiscard]] std::vector<double> row(std::size_t k, std::size_t length) const {
    const auto from = values_.begin() + static_cast<std::ptrdiff_t>(k * length_);
    return {from, from + static_cast<std::ptrdiff_t>(std::min(length, length_))};
  }
  [[nodiscard]] std::vector<std::vector<double>> rows(std::size_t length) const {
    std::vector<std::vector<double>> all;
    all.reserve(count_);
    for (std::size_t k = 0; k < count_; ++k) all.push_back(row(k, length));
    return all;
  }

 private:
  std::size_t length_ = 0, count_ = 0;
  std::vector<float> values_;
};

}  // namespace shakebed::ingest
