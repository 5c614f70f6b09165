#include "ingest/find/edge_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "ingest/calibrate/solid_borders.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

// Gradients up to this many times their noise are noise: 1 in 3,000 pixels of white noise lies beyond.
constexpr float noise_multiple = 4.0F;
// Standard deviation of a gradient component under white noise of one grey level, binomial filter and central
// difference: sqrt(0.0820 * 0.2734), the sums of squares of the filters across and along.
constexpr float gradient_noise = 0.150F;
// Edges below this share of the strong ones (their 95th percentile) belong to something else.
constexpr float weakest_share = 0.1F;
// Grey levels per px: below the rounding of 8-bit pictures.
constexpr float least_threshold = 0.3F;

// Standard deviation of white noise, from second differences along rows.
float white_noise_of(const GrayFrame& frame) {
  std::vector<float> sizes;
  const std::size_t step = std::max<std::size_t>(1, frame.pixels.size() / 60000);
  const std::size_t width = static_cast<std::size_t>(frame.width);
  for (std::size_t at = 1; at + 1 < frame.pixels.size(); at += step) {
    if (at % width == 0 || at % width == width - 1) continue;
    const float left = frame.pixels[at - 1], middle = frame.pixels[at], right = frame.pixels[at + 1];
    if (!unseen(left + middle + right)) sizes.push_back(std::abs(left - 2 * middle + right));
  }
  return 1.4826F * quantile_of(sizes, 0.5) / std::sqrt(6.0F);
}

// By 1/4, 1/2, 1/4 along both axes, in place; the outermost pixels stay.
void smooth_by_three(GrayFrame& frame) {
  const std::size_t width = static_cast<std::size_t>(frame.width), height = static_cast<std::size_t>(frame.height);
  std::array<std::vector<float>, 3> across;  // of the row above, this row, the row below
  const auto smooth_along = [&](std::size_t row) {
    const float* from = frame.pixels.data() + row * width;
    std::vector<float>& to = across[row % 3];
    to.assign(from, from + width);
    for (std::size_t k = 1; k + 1 < width; ++k) to[k] = 0.25F * (from[k - 1] + from[k + 1]) + 0.5F * from[k];
  };
  smooth_along(0);
  smooth_along(1);
  for (std::size_t row = 1; row + 1 < height; ++row) {
    smooth_along(row + 1);
    const float *above = across[(row - 1) % 3].data(), *here = across[row % 3].data(),
                *below = across[(row + 1) % 3].data();
    float* to = frame.pixels.data() + row * width;
    for (std::size_t k = 0; k < width; ++k) to[k] = 0.25F * (above[k] + below[k]) + 0.5F * here[k];
  }
}

void fill_gradients(const GrayFrame& smooth, EdgeMap& edges) {
  constexpr float steepest = 0.01F * brightest_seen;  // beyond it something unseen is near
  const std::size_t width = static_cast<std::size_t>(smooth.width);
  edges.x.assign(smooth.pixels.size(), 0.0F);
  edges.y.assign(smooth.pixels.size(), 0.0F);
  for (int row = 1; row + 1 < smooth.height; ++row) {
    const float* middle = smooth.pixels.data() + static_cast<std::size_t>(row) * width;
    float* to_x = edges.x.data() + static_cast<std::size_t>(row) * width;
    float* to_y = edges.y.data() + static_cast<std::size_t>(row) * width;
    for (std::size_t k = 1; k + 1 < width; ++k) {
      const float x = 0.5F * (middle[k + 1] - middle[k - 1]);
      const float y = 0.5F * (middle[k + width] - *(middle + k - width));
      const bool seen = std::abs(x) < steepest && std::abs(y) < steepest;
      to_x[k] = seen ? x : 0.0F;
      to_y[k] = seen ? y : 0.0F;
    }
  }
}

float threshold_of(const GrayFrame& frame, const EdgeMap& edges) {
  std::vector<float> sizes;
  const std::size_t step = std::max<std::size_t>(1, edges.x.size() / 60000);
  for (std::size_t at = 0; at < edges.x.size(); at += step) sizes.push_back(edges.slope(at));
  const float strong = quantile_of(sizes, 0.95);
  return std::max({noise_multiple * gradient_noise * white_noise_of(frame), weakest_share * strong, least_threshold});
}

// Pixels whose gradient is larger than that of both neighbours along it.
void thin(EdgeMap& edges) {
  const int width = edges.width;
  const float least = edges.threshold * edges.threshold;
  const auto square = [&](std::size_t at) { return edges.x[at] * edges.x[at] + edges.y[at] * edges.y[at]; };
  for (int row = 1; row + 1 < edges.height; ++row)
    for (int column = 1; column + 1 < width; ++column) {
      const std::size_t at = edges.at(column, row);
      const float here = square(at);
      if (here < least) continue;
      const float x = edges.x[at], y = edges.y[at];
      constexpr float diagonal = 0.4142F;  // tan 22.5 degrees
      const int step_x = std::abs(x) < diagonal * std::abs(y) ? 0 : x > 0 ? 1 : -1;
      const int step_y = std::abs(y) < diagonal * std::abs(x) ? 0 : y > 0 ? 1 : -1;
      if (square(edges.at(column + step_x, row + step_y)) > here) continue;
      if (square(edges.at(column - step_x, row - step_y)) >= here) continue;
      const float size = std::sqrt(here);
      edges.ridge.push_back({static_cast<float>(column), static_cast<float>(row), x / size, y / size});
    }
}

}  // namespace

EdgeMap find_edges(const GrayFrame& frame, float threshold) {
  EdgeMap edges;
  edges.width = frame.width;
  edges.height = frame.height;
  if (frame.width < 5 || frame.height < 5) {
    edges.x.assign(frame.pixels.size(), 0.0F);
    edges.y = edges.x;
    return edges;
  }
  GrayFrame smooth = frame;
  smooth_by_three(smooth);
  smooth_by_three(smooth);
  fill_gradients(smooth, edges);
  edges.threshold = threshold > 0 ? threshold : threshold_of(frame, edges);
  thin(edges);
  return edges;
}

}  // namespace shakebed::ingest
