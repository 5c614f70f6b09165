#include "ingest/calibrate/picture_parts.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "ingest/calibrate/solid_borders.hpp"

namespace shakebed::ingest {

namespace {

// Sums over rectangles of blocks, each by four look-ups.
class BlockSums {
 public:
  BlockSums(const GrayFrame& frame, const ChangeSampling& sampling)
      : columns_(frame.width / sampling.block),
        rows_(frame.height / sampling.block),
        sums_(static_cast<std::size_t>(columns_ + 1) * static_cast<std::size_t>(rows_ + 1), 0.0) {
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column)
        at(column + 1, row + 1) =
            change_in(frame, sampling, column, row) + at(column, row + 1) + at(column + 1, row) - at(column, row);
  }
  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] double sum(int column, int row, int wide, int high) {
    return at(column + wide, row + high) - at(column, row + high) - at(column + wide, row) + at(column, row);
  }

 private:
  static double change_in(const GrayFrame& frame, const ChangeSampling& sampling, int column, int row) {
    const int block = sampling.block, reach = sampling.reach;
    double sum = 0;
    for (int y = row * block; y + reach < (row + 1) * block; y += 2)
      for (int x = column * block; x + reach < (column + 1) * block; x += sampling.stride) {
        const float change =
            std::abs(frame.at(x + reach, y) - frame.at(x, y)) + std::abs(frame.at(x, y + reach) - frame.at(x, y));
        sum += unseen(change) ? 0.0 : static_cast<double>(change);
      }
    return sum;
  }
  double& at(int column, int row) {
    return sums_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_ + 1) +
                 static_cast<std::size_t>(column)];
  }
  int columns_, rows_;
  std::vector<double> sums_;
};

}  // namespace

GrayFrame halved(const GrayFrame& frame) {
  GrayFrame half;
  half.width = frame.width / 2;
  half.height = frame.height / 2;
  half.pixels.resize(static_cast<std::size_t>(half.width) * static_cast<std::size_t>(half.height));
  for (int row = 0; row < half.height; ++row) {
    const float* upper =
        frame.pixels.data() + static_cast<std::size_t>(2 * row) * static_cast<std::size_t>(frame.width);
    const float* lower = upper + frame.width;
    float* to = half.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(half.width);
    for (int column = 0; column < half.width; ++column)
      to[column] = 0.25F * (upper[2 * column] + upper[2 * column + 1] + lower[2 * column] + lower[2 * column + 1]);
  }
  return half;
}

GrayFrame cut_out(const GrayFrame& frame, const PicturePart& part) {
  GrayFrame cut;
  cut.width = part.width;
  cut.height = part.height;
  cut.pixels.reserve(static_cast<std::size_t>(part.width) * static_cast<std::size_t>(part.height));
  for (int row = part.top; row < part.top + part.height; ++row) {
    const auto from = frame.pixels.begin() + static_cast<std::ptrdiff_t>(row) * frame.width + part.left;
    cut.pixels.insert(cut.pixels.end(), from, from + part.width);
  }
  return cut;
}

PicturePart busiest_part(const GrayFrame& frame, int side, const ChangeSampling& sampling) {
  PicturePart part;
  part.width = std::min(side, frame.width);
  part.height = std::min(side, frame.height);
  BlockSums sums(frame, sampling);
  const int wide = std::min(sums.columns(), part.width / sampling.block);
  const int high = std::min(sums.rows(), part.height / sampling.block);
  double most = -1;
  for (int row = 0; row + high <= sums.rows(); ++row)
    for (int column = 0; column + wide <= sums.columns(); ++column) {
      const double sum = sums.sum(column, row, wide, high);
      if (sum <= most) continue;
      most = sum;
      part.left = column * sampling.block;
      part.top = row * sampling.block;
    }
  part.left = std::min(part.left, frame.width - part.width);
  part.top = std::min(part.top, frame.height - part.height);
  return part;
}

PicturePart part_with_most(const std::vector<std::pair<double, double>>& places, int side, int width, int height) {
  constexpr int steps_a_side = 8;
  const int step = std::max(1, side / steps_a_side);
  PicturePart best;
  best.width = std::min(side, width), best.height = std::min(side, height);
  std::ptrdiff_t most = -1;
  for (int top = 0; top < height - best.height + step; top += step)
    for (int left = 0; left < width - best.width + step; left += step) {
      const int x = std::min(left, width - best.width), y = std::min(top, height - best.height);
      const auto count = std::count_if(places.begin(), places.end(), [&](const auto& place) {
        const double column = place.first - x, row = place.second - y;
        return column >= 0 && row >= 0 && column < best.width && row < best.height;
      });
      if (count > most) most = count, best.left = x, best.top = y;
    }
  return best;
}

}  // namespace shakebed::ingest
