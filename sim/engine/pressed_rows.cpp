#include "sim/engine/pressed_rows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

namespace shakebed::sim {

namespace {
constexpr double steepest = 1 / std::numbers::sqrt3;  // of two in one row: 30 degrees
constexpr std::size_t parts = 8;                      // of the blocks, of which one is taken from each in turn
}  // namespace

void PressedRows::find(const std::vector<double>& x, const std::vector<double>& z, std::uint32_t count, double width,
                       double period, double reach) {
  count_ = count;
  columns_ = static_cast<std::size_t>(std::max(1.0, std::floor(width / reach)));
  sort_columns(x, z, width);
  find_pairs(x, z, period, reach);
  order_rows(x, z);
  make_blocks();
}

// Columns of disks, each in the order of height.
void PressedRows::sort_columns(const std::vector<double>& x, const std::vector<double>& z, double width) {
  const auto columns = static_cast<double>(columns_);
  column_.resize(count_);
  in_columns_.resize(count_);
  column_begin_.assign(columns_ + 1, 0);
  for (std::uint32_t i = 0; i < count_; ++i) {
    column_[i] = static_cast<std::uint32_t>(std::clamp(x[i] / width * columns, 0.0, columns - 1));
    ++column_begin_[column_[i] + 1];
  }
  for (std::size_t c = 0; c < columns_; ++c) column_begin_[c + 1] += column_begin_[c];
  std::vector<std::uint32_t> next(column_begin_.begin(), column_begin_.end() - 1);
  for (std::uint32_t i = 0; i < count_; ++i) in_columns_[next[column_[i]]++] = i;
  const auto lower = [&z](std::uint32_t a, std::uint32_t b) { return std::tuple(z[a], a) < std::tuple(z[b], b); };
  for (std::size_t c = 0; c < columns_; ++c)
    std::sort(in_columns_.begin() + column_begin_[c], in_columns_.begin() + column_begin_[c + 1], lower);
}

void PressedRows::find_pairs(const std::vector<double>& x, const std::vector<double>& z, double period, double reach) {
  pairs_.clear();
  right_.assign(count_, count_);
  left_.assign(count_, count_);
  right_rise_.assign(count_, std::numeric_limits<double>::infinity());
  left_rise_ = right_rise_;
  for (std::size_t c = 0; c < columns_; ++c) {
    for (std::size_t beside : {c, c + 1}) {
      if (beside == columns_) {
        if (!(period > 0)) continue;
        beside = 0;
      }
      std::uint32_t from = column_begin_[beside];
      const std::uint32_t end = column_begin_[beside + 1];
      for (std::uint32_t at = column_begin_[c]; at < column_begin_[c + 1]; ++at) {
        const std::uint32_t i = in_columns_[at];
        while (from < end && z[in_columns_[from]] < z[i] - reach) ++from;
        for (std::uint32_t o = from; o < end && z[in_columns_[o]] < z[i] + reach; ++o) {
          const std::uint32_t k = in_columns_[o];
          if (beside == c && k <= i) continue;
          double dx = x[k] - x[i];
          if (period > 0) dx -= period * std::nearbyint(dx / period);
          const double dz = z[k] - z[i];
          if (!(dx * dx + dz * dz < reach * reach)) continue;
          pairs_.push_back({i, k});
          if (std::abs(dz) < steepest * std::abs(dx)) dx > 0 ? link(i, k, std::abs(dz)) : link(k, i, std::abs(dz));
        }
      }
    }
  }
}

void PressedRows::link(std::uint32_t left, std::uint32_t right, double rise) {
  if (rise < right_rise_[left]) right_rise_[left] = rise, right_[left] = right;
  if (rise < left_rise_[right]) left_rise_[right] = rise, left_[right] = left;
}

// Rows are chains of disks each of which is the other's most level neighbour.
void PressedRows::order_rows(const std::vector<double>& x, const std::vector<double>& z) {
  heads_.clear();
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (right_[i] != count_ && left_[right_[i]] != i) right_[i] = count_;
  }
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (left_[i] == count_ || right_[left_[i]] != i) heads_.push_back(i);
  }
  std::sort(heads_.begin(), heads_.end(),
            [&](std::uint32_t a, std::uint32_t b) { return std::tie(z[a], x[a], a) < std::tie(z[b], x[b], b); });
  order_.clear();
  place_.assign(count_, count_);
  const auto follow = [&](std::uint32_t i) {
    for (; i != count_ && place_[i] == count_; i = right_[i]) {
      place_[i] = static_cast<std::uint32_t>(order_.size());
      order_.push_back(i);
    }
  };
  for (const std::uint32_t head : heads_) follow(head);
  for (std::uint32_t i = 0; i < count_; ++i) follow(i);  // rows that close on themselves
}

// Pairs whose places differ by the same number, in the order of places: each block takes what lies in its four lanes.
void PressedRows::make_blocks() {
  beyond_begin_.assign(std::size_t{count_} + 1, 0);
  for (Pair& one : pairs_) {
    const auto [low, high] = std::minmax(place_[one.disk], place_[one.other]);
    one = {low, high};
    ++beyond_begin_[low + 1];
  }
  for (std::uint32_t p = 0; p < count_; ++p) beyond_begin_[p + 1] += beyond_begin_[p];
  beyond_.resize(pairs_.size());
  std::vector<std::uint32_t> next(beyond_begin_.begin(), beyond_begin_.end() - 1);
  for (const Pair& one : pairs_) beyond_[next[one.disk]++] = one.other;
  free_from_.assign(count_, 0);  // by the difference of the places
  found_.clear();
  found_in_rows_.clear();
  for (std::uint32_t p = 0; p < count_; ++p) {
    for (std::uint32_t at = beyond_begin_[p]; at < beyond_begin_[p + 1]; ++at) {
      std::uint32_t& free_from = free_from_[beyond_[at] - p];
      if (p < free_from) continue;
      (beyond_[at] == p + 1 ? found_in_rows_ : found_).push_back({p, beyond_[at]});
      free_from = p + lanes;
    }
  }
  blocks_.clear();
  scatter(found_in_rows_);
  in_rows_ = blocks_.size();
  scatter(found_);
}

// What follows one block need not wait for its sums.
void PressedRows::scatter(const std::vector<PairBlock>& found) {
  const std::size_t part = (found.size() + parts - 1) / parts;
  for (std::size_t k = 0; k < part; ++k) {
    for (std::size_t b = k; b < found.size(); b += part) blocks_.push_back(found[b]);
  }
}

}  // namespace shakebed::sim
