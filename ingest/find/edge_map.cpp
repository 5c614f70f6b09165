#include "ingest/find/edge_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "ingest/calibrate/solid_borders.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

// Gradients up to this many times their noise are noise: 1 in 3,000 pixels of white noise lies beyond.
constexpr float noise_multiple = 4.0F;
// Standard deviation of a gradient component under white noise of one grey level, binomial filter and central
// difference: sqrt(0.0820 * 0.2734), the sums of squares of the filters across and along.
constexpr float gradient_noise = 0.150F;
// The same in a picture of twice the resolution, under noise of one grey level in the picture it was interpolated from.
constexpr float gradient_noise_of_doubled = 0.191F;
// Edges below this share of the strong ones (their 95th percentile) belong to something else.
constexpr float weakest_share = 0.1F;
// Grey levels per px: below the rounding of 8-bit pictures.
constexpr float least_threshold = 0.3F;
constexpr int smallest_map = 5;  // px, side

// Standard deviation of white noise, from second differences along rows: of the picture, or of the one that it was
// interpolated from.
float white_noise_of(const GrayFrame& frame, Pixels pixels) {
  // From one pixel to the next that is interpolated alike. Variance of such a difference: 1 + 4 + 1, or, of weights 3/4
  // and 1/4 along both axes, (9 + 25 + 1 + 1) / 16 * 10 / 16.
  const std::size_t apart = pixels == Pixels::own ? 1 : 2;
  const float variance = pixels == Pixels::own ? 6.0F : 1.40625F;
  std::vector<float> sizes;
  const std::size_t step = std::max<std::size_t>(1, frame.pixels.size() / 60000);
  const std::size_t width = static_cast<std::size_t>(frame.width);
  for (std::size_t at = apart; at + apart < frame.pixels.size(); at += step) {
    if (at % width < apart || at % width >= width - apart) continue;
    const float left = frame.pixels[at - apart], middle = frame.pixels[at], right = frame.pixels[at + apart];
    if (!unseen(left + middle + right)) sizes.push_back(std::abs(left - 2 * middle + right));
  }
  return 1.4826F * quantile_of(sizes, 0.5) / std::sqrt(variance);
}

// Smooths by 1/4, 1/2, 1/4 along both axes, line by line; the outermost pixels stay. Hands each line on with its row.
template <class Next>
class SmoothedByThree {
 public:
  SmoothedByThree(int width, int height, Next& next)
      : width_(static_cast<std::size_t>(width)), height_(height), next_(next), out_(width_) {
    for (std::vector<float>& one : along_) one.resize(width_);
  }

  // Rows from 0 on.
  void take(int row, const float* line) {
    float* to = along_[static_cast<std::size_t>(row % 3)].data();
    to[0] = line[0], to[width_ - 1] = line[width_ - 1];
    for (std::size_t k = 1; k + 1 < width_; ++k) to[k] = 0.25F * (line[k - 1] + line[k + 1]) + 0.5F * line[k];
    if (row == 0) next_.take(0, line);
    if (row >= 2) hand_on(row - 1);
    if (row == height_ - 1) next_.take(row, line);
  }

 private:
  void hand_on(int row) {
    const float *above = along_[static_cast<std::size_t>((row + 2) % 3)].data(),
                *here = along_[static_cast<std::size_t>(row % 3)].data(),
                *below = along_[static_cast<std::size_t>((row + 1) % 3)].data();
    float* to = out_.data();
    for (std::size_t k = 0; k < width_; ++k) to[k] = 0.25F * (above[k] + below[k]) + 0.5F * here[k];
    next_.take(row, to);
  }

  std::size_t width_;
  int height_;
  Next& next_;
  std::array<std::vector<float>, 3> along_;
  std::vector<float> out_;
};

// Fills the map line by line.
class Gradients {
 public:
  explicit Gradients(EdgeMap& edges) : edges_(edges), width_(static_cast<std::size_t>(edges.width)) {
    for (std::vector<float>& one : lines_) one.resize(width_);
  }

  void take(int row, const float* line) {
    std::copy(line, line + width_, lines_[static_cast<std::size_t>(row % 3)].begin());
    if (row >= 2) fill(row - 1);
  }

 private:
  void fill(int row) {
    constexpr float steepest = 0.01F * brightest_seen;  // beyond it something unseen is near
    const float *above = lines_[static_cast<std::size_t>((row + 2) % 3)].data(),
                *middle = lines_[static_cast<std::size_t>(row % 3)].data(),
                *below = lines_[static_cast<std::size_t>((row + 1) % 3)].data();
    float *to_x = edges_.x.data() + edges_.at(0, row), *to_y = edges_.y.data() + edges_.at(0, row);
    for (std::size_t k = 1; k + 1 < width_; ++k) {
      const float x = 0.5F * (middle[k + 1] - middle[k - 1]);
      const float y = 0.5F * (below[k] - above[k]);
      const bool seen = std::abs(x) < steepest && std::abs(y) < steepest;
      to_x[k] = seen ? x : 0.0F;
      to_y[k] = seen ? y : 0.0F;
    }
  }

  EdgeMap& edges_;
  std::size_t width_;
  std::array<std::vector<float>, 3> lines_;
};

EdgeMap gradients_of(int width, int height, const std::function<const float*(int)>& row) {
  EdgeMap edges;
  edges.width = width;
  edges.height = height;
  edges.x.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0.0F);
  edges.y = edges.x;
  if (std::min(width, height) < smallest_map) return edges;
  Gradients gradients(edges);
  SmoothedByThree<Gradients> again(width, height, gradients);
  SmoothedByThree<SmoothedByThree<Gradients>> once(width, height, again);
  for (int k = 0; k < height; ++k) once.take(k, row(k));
  return edges;
}

float threshold_of(const GrayFrame& frame, const EdgeMap& edges, Pixels pixels) {
  std::vector<float> sizes;
  const std::size_t step = std::max<std::size_t>(1, edges.x.size() / 60000);
  for (std::size_t at = 0; at < edges.x.size(); at += step) sizes.push_back(edges.slope(at));
  const float strong = quantile_of(sizes, 0.95);
  const float noise = pixels == Pixels::own ? gradient_noise : gradient_noise_of_doubled;
  return std::max({noise_multiple * noise * white_noise_of(frame, pixels), weakest_share * strong, least_threshold});
}

// First pixel of a line, from `column` on, that is marked; its end where there is none.
int next_steep(const std::vector<std::uint8_t>& steep, int column) {
  constexpr int at_once = 8;
  const auto size = static_cast<int>(steep.size());
  while (column < size) {
    std::uint64_t marks = 1;
    if (column + at_once <= size) std::memcpy(&marks, steep.data() + column, sizeof marks);
    const int end = std::min(size, column + at_once);
    for (; marks != 0 && column < end; ++column)
      if (steep[static_cast<std::size_t>(column)] != 0) return column;
    column = end;
  }
  return size;
}

// Squares of the gradients' sizes, of the three rows about one.
class SquaresOfThreeRows {
 public:
  explicit SquaresOfThreeRows(const EdgeMap& edges) : edges_(edges) {
    for (std::vector<float>& row : rows_) row.resize(static_cast<std::size_t>(edges.width));
    fill(0), fill(1);
  }
  // Rows from 1 on, one after the other.
  void go_to(int row) { fill(row + 1); }
  [[nodiscard]] const float* row(int row) const { return rows_[static_cast<std::size_t>(row % 3)].data(); }

 private:
  void fill(int row) {
    const float *x = edges_.x.data() + edges_.at(0, row), *y = edges_.y.data() + edges_.at(0, row);
    std::vector<float>& to = rows_[static_cast<std::size_t>(row % 3)];
    for (std::size_t k = 0; k < to.size(); ++k) to[k] = x[k] * x[k] + y[k] * y[k];
  }

  const EdgeMap& edges_;
  std::array<std::vector<float>, 3> rows_;
};

// Pixels whose gradient is larger than that of both neighbours along it.
void thin(EdgeMap& edges) {
  const int width = edges.width;
  const float least = edges.threshold * edges.threshold;
  SquaresOfThreeRows squares(edges);
  std::vector<std::uint8_t> steep(static_cast<std::size_t>(width));
  for (int row = 1; row + 1 < edges.height; ++row) {
    squares.go_to(row);
    const std::array<const float*, 3> beside = {squares.row(row - 1), squares.row(row), squares.row(row + 1)};
    const float *square = beside[1], *to_x = edges.x.data() + edges.at(0, row),
                *to_y = edges.y.data() + edges.at(0, row);
    for (std::size_t k = 0; k < steep.size(); ++k) steep[k] = square[k] >= least ? 1 : 0;
    for (int column = next_steep(steep, 1); column + 1 < width; column = next_steep(steep, column + 1)) {
      const float here = square[column], x = to_x[column], y = to_y[column];
      constexpr float diagonal = 0.4142F;  // tan 22.5 degrees
      const int across = std::abs(x) >= diagonal * std::abs(y), down = std::abs(y) >= diagonal * std::abs(x);
      const int step_x = x > 0 ? across : -across, step_y = y > 0 ? down : -down;
      const float after = beside[static_cast<std::size_t>(1 + step_y)][column + step_x],
                  before = beside[static_cast<std::size_t>(1 - step_y)][column - step_x];
      if (after > here || before >= here) continue;
      const float size = std::sqrt(here);
      edges.ridge.push_back({static_cast<float>(column), static_cast<float>(row), x / size, y / size});
    }
  }
}

}  // namespace

EdgeMap find_edges(const GrayFrame& frame, float threshold, Pixels pixels) {
  EdgeMap edges = gradients_of(frame.width, frame.height, [&](int row) {
    return frame.pixels.data() + static_cast<std::ptrdiff_t>(row) * frame.width;
  });
  if (std::min(frame.width, frame.height) < smallest_map) return edges;
  edges.threshold = threshold > 0 ? threshold : threshold_of(frame, edges, pixels);
  thin(edges);
  return edges;
}

EdgeMap find_edges(int width, int height, const std::function<const float*(int)>& row, float threshold) {
  EdgeMap edges = gradients_of(width, height, row);
  if (std::min(width, height) < smallest_map) return edges;
  edges.threshold = threshold;
  thin(edges);
  return edges;
}

}  // namespace shakebed::ingest
