#include "ingest/calibrate/picture_parts.hpp"

#include <algorithm>
#include <array>
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

// Texture: in blocks of a picture, `blocks_a_side` along its shorter side.
constexpr int blocks_a_side = 32, smallest_block = 8;
constexpr std::size_t features = 3;
constexpr double least_side_share = 0.15;  // of the picture, on each side of a cut
// Share of the variance of a feature that a cut must explain: of textures that differ, most of it.
constexpr double least_explained_by_cut = 0.3;

using Texture = std::array<double, features>;

Texture texture_of(const GrayFrame& frame, const PicturePart& block) {
  constexpr int far = 4;  // px
  Texture sums{};
  double count = 0;
  for (int y = block.top; y + far < block.top + block.height; y += 2)
    for (int x = block.left; x + far < block.left + block.width; x += 2) {
      const float level = frame.at(x, y);
      const float near_change = std::abs(frame.at(x + 1, y) - level) + std::abs(frame.at(x, y + 1) - level);
      const float far_change = std::abs(frame.at(x + far, y) - level) + std::abs(frame.at(x, y + far) - level);
      if (unseen(near_change + far_change)) continue;
      sums[0] += static_cast<double>(level);
      sums[1] += static_cast<double>(near_change);
      sums[2] += static_cast<double>(far_change);
      ++count;
    }
  for (double& sum : sums) sum /= std::max(1.0, count);
  // Changes of level by ratios.
  for (std::size_t k = 1; k < features; ++k) sums[k] = std::log1p(sums[k]);
  return sums;
}

struct Moments {
  double count = 0, sum = 0, squares = 0;
  void add(double value) { ++count, sum += value, squares += value * value; }
  void add(const Moments& other) { count += other.count, sum += other.sum, squares += other.squares; }
  [[nodiscard]] double scatter() const { return count > 0 ? squares - sum * sum / count : 0; }
};
using TextureMoments = std::array<Moments, features>;

// Largest share of a feature's variance that a cut after line `cut` explains.
double explained_by_cut(const std::vector<TextureMoments>& lines, std::size_t cut) {
  TextureMoments before{}, after{};
  for (std::size_t line = 0; line < lines.size(); ++line)
    for (std::size_t k = 0; k < features; ++k) (line < cut ? before : after)[k].add(lines[line][k]);
  double most = 0;
  for (std::size_t k = 0; k < features; ++k) {
    Moments all = before[k];
    all.add(after[k]);
    if (all.scatter() > 0) most = std::max(most, 1 - (before[k].scatter() + after[k].scatter()) / all.scatter());
  }
  return most;
}

// Parts that overlap by seven eighths, and the number of places in each.
struct CountedPart {
  PicturePart part;
  std::ptrdiff_t places = 0;
};
std::vector<CountedPart> counted_parts(const Places& places, int side, int width, int height) {
  constexpr int steps_a_side = 8;
  const int step = std::max(1, side / steps_a_side);
  CountedPart one;
  one.part.width = std::min(side, width), one.part.height = std::min(side, height);
  std::vector<CountedPart> parts;
  for (int top = 0; top < height - one.part.height + step; top += step)
    for (int left = 0; left < width - one.part.width + step; left += step) {
      one.part.left = std::min(left, width - one.part.width), one.part.top = std::min(top, height - one.part.height);
      one.places = std::count_if(places.begin(), places.end(),
                                 [&](const auto& place) { return one.part.holds(place.first, place.second); });
      parts.push_back(one);
    }
  return parts;
}

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

GrayFrame seen_inside(GrayFrame frame, const PixelRectangle& rectangle, double margin_px) {
  const int margin = static_cast<int>(std::ceil(margin_px));
  const int left = std::clamp(rectangle.left - margin, 0, frame.width);
  const int right = std::clamp(rectangle.left + rectangle.width + margin, left, frame.width);
  for (int row = 0; row < frame.height; ++row) {
    const auto line = frame.pixels.begin() + static_cast<std::ptrdiff_t>(row) * frame.width;
    const bool inside = row >= rectangle.top - margin && row < rectangle.top + rectangle.height + margin;
    std::fill(line, line + (inside ? left : frame.width), unseen_level);
    if (inside) std::fill(line + right, line + frame.width, unseen_level);
  }
  return frame;
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

double likeness(const GrayFrame& a, const GrayFrame& b) {
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
  const std::size_t step = std::max<std::size_t>(1, a.pixels.size() / 50000);
  for (std::size_t k = 0; k < a.pixels.size(); k += step) {
    const auto one = static_cast<double>(a.pixels[k]), other = static_cast<double>(b.pixels[k]);
    if (unseen(a.pixels[k]) || unseen(b.pixels[k])) continue;
    ++n, x += one, y += other, xx += one * one, yy += other * other, xy += one * other;
  }
  const double spread = (xx - x * x / n) * (yy - y * y / n);
  return spread > 0 ? std::abs(xy - x * y / n) / std::sqrt(spread) : 1;
}

PicturePart part_with_most(const Places& places, int side, int width, int height) {
  PicturePart best;
  std::ptrdiff_t most = -1;
  for (const auto& [part, count] : counted_parts(places, side, width, height))
    if (count > most) most = count, best = part;
  return best;
}

std::optional<PicturePart> part_half_filled(const Places& places, int side, int width, int height) {
  constexpr double hardly_filled = 0.75;  // of the most: what is nearer to it shows no more background
  const std::vector<CountedPart> parts = counted_parts(places, side, width, height);
  std::ptrdiff_t most = 0;
  for (const CountedPart& one : parts) most = std::max(most, one.places);
  const auto nearest = std::min_element(parts.begin(), parts.end(), [&](const auto& one, const auto& other) {
    return std::abs(2 * one.places - most) < std::abs(2 * other.places - most);
  });
  if (static_cast<double>(nearest->places) > hardly_filled * static_cast<double>(most)) return std::nullopt;
  return nearest->part;
}

std::vector<PicturePart> parts_that_differ(const GrayFrame& frame) {
  const int block = std::min(frame.width, frame.height) / blocks_a_side;
  if (block < smallest_block) return {};
  const int columns = frame.width / block, rows = frame.height / block;
  std::vector<TextureMoments> by_column(static_cast<std::size_t>(columns)), by_row(static_cast<std::size_t>(rows));
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Texture here = texture_of(frame, {column * block, row * block, block, block});
      for (std::size_t k = 0; k < features; ++k) {
        by_column[static_cast<std::size_t>(column)][k].add(here[k]);
        by_row[static_cast<std::size_t>(row)][k].add(here[k]);
      }
    }
  double most = least_explained_by_cut;
  std::vector<PicturePart> parts;
  const auto look_along = [&](const std::vector<TextureMoments>& lines, bool across) {
    const auto least = static_cast<std::size_t>(std::ceil(least_side_share * static_cast<double>(lines.size())));
    for (std::size_t cut = least; cut + least <= lines.size(); ++cut) {
      const double explained = explained_by_cut(lines, cut);
      if (explained <= most) continue;
      most = explained;
      const int at = static_cast<int>(cut) * block;
      if (across)
        parts = {{0, 0, at, frame.height}, {at, 0, frame.width - at, frame.height}};
      else
        parts = {{0, 0, frame.width, at}, {0, at, frame.width, frame.height - at}};
    }
  };
  look_along(by_column, true);
  look_along(by_row, false);
  return parts;
}

}  // namespace shakebed::ingest
