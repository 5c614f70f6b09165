#include "ingest/find/missed_beads.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "ingest/find/edge_map.hpp"
#include "ingest/find/picture_scale.hpp"

namespace shakebed::ingest {

namespace {

// Radii of the beads: the sizes of beads that are looked for, the largest first.
constexpr std::array<double, 3> sizes = {1.0, 0.8, 0.6};
constexpr double covered = 0.2;      // radii of the beads: so near to a disk found, an edge is its own
constexpr double overlap = 0.12;     // of a place's radius, with a disk found
constexpr double reach = 1.15;       // of a place's radius: so far out its edges are counted
constexpr double least_edges = 0.35; // of the length of a whole rim; a straight line across has 0.37 at most
// Of the beads' contrast, from which on an edge counts in full.
constexpr double full_contrast = 0.5;
constexpr double places_per_radius = 6;

// Places of a map of edges that no disk covers.
class FreePlaces {
 public:
  FreePlaces(const EdgeMap& edges, const std::vector<Circle>& found, double radius, double contrast)
      : edges_(edges),
        width_(static_cast<std::size_t>(edges.width)),
        radius_(radius),
        clearance_(edges.x.size(), static_cast<float>(2 * radius)) {
    for (const Circle& disk : found) cover(disk.x, disk.y, disk.radius);
    std::vector<float> weight(edges.x.size(), 0.0F);
    for (const RidgePixel& pixel : edges.ridge) {
      const std::size_t at = edges.at(static_cast<int>(pixel.x), static_cast<int>(pixel.y));
      if (static_cast<double>(clearance_[at]) < covered * radius) continue;
      const double step = step_per_slope * static_cast<double>(std::hypot(edges.x[at], edges.y[at]));
      weight[at] = static_cast<float>(std::min(1.0, step / std::max(1e-6, full_contrast * contrast)));
    }
    sum_up(weight);
  }

  // Places of this radius, the fullest first; each covers what it lies on.
  double take(double radius, const PixelRectangle& region) {
    struct Place {
      double edges, x, y;
    };
    std::vector<Place> places;
    const double step = std::max(1.0, radius / places_per_radius);
    const double least = least_edges * 2 * std::numbers::pi * radius;
    for (double y = region.top + radius; y <= region.top + region.height - radius; y += step)
      for (double x = region.left + radius; x <= region.left + region.width - radius; x += step)
        if (is_free(x, y, radius))
          if (const double edges = edges_near(x, y, reach * radius); edges >= least) places.push_back({edges, x, y});
    std::stable_sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.edges > b.edges; });
    double taken = 0;
    for (const Place& place : places) {
      if (!is_free(place.x, place.y, radius)) continue;
      ++taken;
      cover(place.x, place.y, radius);
    }
    return taken;
  }

 private:
  [[nodiscard]] bool is_free(double x, double y, double radius) const {
    return static_cast<double>(clearance_[edges_.at(static_cast<int>(x), static_cast<int>(y))]) >=
           (1 - overlap) * radius;
  }

  void cover(double x, double y, double radius) {
    const double far = radius + 1.5 * radius_;
    const int left = std::max(0, static_cast<int>(x - far)), top = std::max(0, static_cast<int>(y - far));
    const int right = std::min(edges_.width - 1, static_cast<int>(x + far));
    const int bottom = std::min(edges_.height - 1, static_cast<int>(y + far));
    for (int row = top; row <= bottom; ++row)
      for (int column = left; column <= right; ++column) {
        float& clearance = clearance_[edges_.at(column, row)];
        clearance = std::min(clearance, static_cast<float>(std::hypot(column - x, row - y) - radius));
      }
  }

  void sum_up(const std::vector<float>& weight) {
    const std::size_t height = static_cast<std::size_t>(edges_.height);
    row_sums_.assign((width_ + 1) * height, 0.0F);
    for (std::size_t row = 0; row < height; ++row) {
      float sum = 0;
      for (std::size_t column = 0; column < width_; ++column)
        row_sums_[row * (width_ + 1) + column + 1] = sum += weight[row * width_ + column];
    }
  }

  // Length of edges within a disk, px.
  [[nodiscard]] double edges_near(double x, double y, double radius) const {
    double sum = 0;
    const int top = std::max(0, static_cast<int>(std::ceil(y - radius)));
    const int bottom = std::min(edges_.height - 1, static_cast<int>(std::floor(y + radius)));
    for (int row = top; row <= bottom; ++row) {
      const double half = std::sqrt(std::max(0.0, radius * radius - (row - y) * (row - y)));
      const int from = std::max(0, static_cast<int>(x - half));
      const int to = std::min(edges_.width, static_cast<int>(x + half) + 1);
      const float* sums = row_sums_.data() + static_cast<std::size_t>(row) * (width_ + 1);
      sum += static_cast<double>(sums[to] - sums[from]);
    }
    return sum;
  }

  const EdgeMap& edges_;
  std::size_t width_;
  double radius_;
  std::vector<float> clearance_;  // px to the nearest disk, below 0 inside
  std::vector<float> row_sums_;
};

}  // namespace

double expected_missed_beads(const GrayFrame& frame, const RimModel& model, const std::vector<Circle>& found,
                             const std::optional<PixelRectangle>& region) {
  const ScaledPicture at = scaled_for(frame, model.radius_px);
  const EdgeMap edges = find_edges(at.picture, model.threshold);
  std::vector<Circle> disks = found;
  for (Circle& disk : disks) {
    disk.x = at.from_frame_x(disk.x);
    disk.y = at.from_frame_y(disk.y);
    disk.radius /= at.scale;
  }
  PixelRectangle searched{1, 1, edges.width - 2, edges.height - 2};
  if (region) {
    searched.left = std::max(1, static_cast<int>(region->left / at.scale));
    searched.top = std::max(1, static_cast<int>(region->top / at.scale));
    searched.width = std::min(edges.width - 1, static_cast<int>((region->left + region->width) / at.scale)) - searched.left;
    searched.height = std::min(edges.height - 1, static_cast<int>((region->top + region->height) / at.scale)) - searched.top;
  }
  const double radius = model.radius_px / at.scale;
  FreePlaces places(edges, disks, radius, model.contrast);
  double missed = 0;
  for (const double size : sizes) missed += size * size * places.take(size * radius, searched);
  return missed;
}

}  // namespace shakebed::ingest
