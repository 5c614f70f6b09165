#include "pipelines/stages/frame_profiles.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "pipelines/formats/markup.hpp"
#include "statistics/kernel.hpp"

namespace shakebed::pipelines {
namespace {

constexpr Kernel frame_window{KernelKind::gaussian, 0.5};
constexpr double frame_spacing = 0.25;     // [D]: half the window's width
constexpr std::size_t most_heights = 400;  // of a page: 100 D

}  // namespace

Json frame_profiles(const std::vector<std::vector<double>>& heights, double width, double low, double high) {
  if (heights.empty() || !(width > 0) || !(high > low)) return {};
  HeightGrid grid{low, frame_spacing, 0};
  grid.points = std::min(most_heights, static_cast<std::size_t>(std::ceil((high - low) / frame_spacing)) + 1);
  std::vector<std::vector<double>> all;
  std::vector<double> mean(grid.points, 0);
  double largest = 1e-9;
  for (const std::vector<double>& centres : heights) {
    std::vector<double> density(grid.points, 0);
    add_density(grid, frame_window, width, centres, 0, density);
    for (std::size_t i = 0; i < grid.points; ++i) {
      mean[i] += density[i] / static_cast<double>(heights.size());
      largest = std::max(largest, density[i]);
    }
    all.push_back(std::move(density));
  }
  std::string bytes;
  for (const std::vector<double>& density : all) {
    for (const double value : density) bytes += static_cast<char>(std::lround(255 * std::max(0.0, value) / largest));
  }
  Json out{
      {"low", grid.lowest}, {"step", grid.spacing}, {"n", grid.points}, {"largest", largest}, {"mean", Json::array()}};
  for (const double value : mean) out["mean"].push_back(std::round(1e5 * value) / 1e5);
  out["now"] = base64(bytes);
  return out;
}

}  // namespace shakebed::pipelines
