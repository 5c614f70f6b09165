#include "ingest/calibrate/radius_vote.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "ingest/calibrate/solid_borders.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

constexpr double vote_ratio = 1.04;          // of one radius voted for to the next
constexpr std::size_t most_edges = 14000;    // that vote
constexpr std::size_t most_maxima = 3;       // radii of a level looked at in full
constexpr std::size_t most_peaks = 4000;     // centres looked at
constexpr double least_vote_support = 0.45;  // share of the rim
constexpr double keep_off_radii = 1.2;       // from one centre to the next, along rows and columns
constexpr std::size_t most_sizes = 200'000;  // gradients, for their quantiles

// One edge pixel: place, unit gradient (towards brighter), weight.
struct EdgePixel {
  float x, y, unit_x, unit_y, weight;
};

// GradientField by Sobel's differences over 8, so that a ramp of slope 1 gives 1.
struct GradientField {
  int width = 0, height = 0;
  std::vector<float> x, y;
  [[nodiscard]] std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
  }
};
GradientField sobel(const GrayFrame& frame) {
  GradientField gradient;
  gradient.width = frame.width;
  gradient.height = frame.height;
  gradient.x.assign(frame.pixels.size(), 0.0F);
  gradient.y.assign(frame.pixels.size(), 0.0F);
  const std::size_t width = static_cast<std::size_t>(frame.width);
  for (int row = 1; row + 1 < frame.height; ++row) {
    const float* a = frame.pixels.data() + static_cast<std::size_t>(row - 1) * width;
    const float* b = a + width;
    const float* c = b + width;
    float* to_x = gradient.x.data() + static_cast<std::size_t>(row) * width;
    float* to_y = gradient.y.data() + static_cast<std::size_t>(row) * width;
    for (std::size_t k = 1; k + 1 < width; ++k) {
      to_x[k] = 0.125F * (a[k + 1] - a[k - 1] + 2 * (b[k + 1] - b[k - 1]) + c[k + 1] - c[k - 1]);
      to_y[k] = 0.125F * (c[k - 1] - a[k - 1] + 2 * (c[k] - a[k]) + c[k + 1] - a[k + 1]);
    }
    for (std::size_t k = 1; k + 1 < width; ++k) {  // next to what is unseen there is no telling
      constexpr float steepest = 0.01F * brightest_seen;
      const bool seen = std::abs(to_x[k]) < steepest && std::abs(to_y[k]) < steepest;
      to_x[k] = seen ? to_x[k] : 0.0F;
      to_y[k] = seen ? to_y[k] : 0.0F;
    }
  }
  return gradient;
}

// Points of a circle.
struct Point {
  float x, y;
};
std::vector<Point> circle_points(double radius) {
  const int samples = std::clamp(static_cast<int>(4 * radius), 12, 48);
  std::vector<Point> points;
  for (int k = 0; k < samples; ++k) {
    const double angle = 2 * std::numbers::pi * k / samples;
    points.push_back({static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))});
  }
  return points;
}

// Share of the rim of a circle where the gradient points along the radius with at least `threshold`.
struct Rim {
  int x, y;
  double radius;
};
double rim_support(const GradientField& gradient, const Rim& rim, const std::vector<Point>& points, float sign,
                   float threshold) {
  std::size_t supported = 0, inside = 0;
  const float centre_x = static_cast<float>(rim.x) + 0.5F, centre_y = static_cast<float>(rim.y) + 0.5F;
  for (const Point& point : points) {
    const float to_x = centre_x + static_cast<float>(rim.radius) * point.x,
                to_y = centre_y + static_cast<float>(rim.radius) * point.y;
    if (to_x < 1 || to_y < 1) continue;
    const int column = static_cast<int>(to_x), row = static_cast<int>(to_y);
    if (column >= gradient.width - 1 || row >= gradient.height - 1) continue;
    ++inside;
    const std::size_t at = gradient.at(column, row);
    const float along = sign * (gradient.x[at] * point.x + gradient.y[at] * point.y);
    const float size = std::sqrt(gradient.x[at] * gradient.x[at] + gradient.y[at] * gradient.y[at]);
    if (size > threshold && along > 0.8F * size) ++supported;
  }
  return inside < points.size() / 2 ? 0.0 : static_cast<double>(supported) / static_cast<double>(inside);
}

// Median distance from a place to its second nearest neighbour (of the three in a honeycomb the one in the middle), and
// half the width of its middle half; 0 for fewer than ten places.
CircleSpacing typical_spacing(const std::vector<Point>& places) {
  if (places.size() < 10) return {};
  std::vector<float> distances;
  const std::size_t step = places.size() / 300 + 1;
  for (std::size_t i = 0; i < places.size(); i += step) {
    float nearest = 1e30F, second = 1e30F;
    for (std::size_t j = 0; j < places.size(); ++j) {
      const float dx = places[j].x - places[i].x, dy = places[j].y - places[i].y;
      const float squared = dx * dx + dy * dy;
      if (j == i || squared >= second) continue;
      second = std::max(nearest, squared);
      nearest = std::min(nearest, squared);
    }
    distances.push_back(std::sqrt(second));
  }
  const double low = static_cast<double>(quantile_of(distances, 0.25)),
               high = static_cast<double>(quantile_of(distances, 0.75));
  return {static_cast<double>(quantile_of(distances, 0.5)), 0.5 * (high - low)};
}

// The edges of a frame that vote, in the order of rows; every k-th of too many keeps a share of every rim.
struct VotingEdges {
  std::vector<EdgePixel> pixels;
  float threshold = 0;  // the weakest gradient of an edge
};
VotingEdges edges_of(const GradientField& gradient) {
  VotingEdges edges;
  std::vector<float> sizes;
  sizes.reserve(gradient.x.size() / 2);
  const std::size_t step = std::max<std::size_t>(1, gradient.x.size() / most_sizes);
  for (std::size_t i = 0; i < gradient.x.size(); i += step)
    sizes.push_back(std::sqrt(gradient.x[i] * gradient.x[i] + gradient.y[i] * gradient.y[i]));
  const float strong = quantile_of(sizes, 0.98);
  const float quiet = quantile_of(sizes, 0.25) / 0.7585F;  // quantile of a Rayleigh law
  // A noise-free frame can have 98 % of its pixels without gradient: then its edges are the rest.
  const float strongest = *std::max_element(sizes.begin(), sizes.end());
  const float reference = strong > 0.1F * strongest ? strong : 0.5F * strongest;
  edges.threshold = std::max({3.0F * quiet, 0.2F * reference, 1e-3F});
  for (int row = 1; row + 1 < gradient.height; ++row)
    for (int column = 1; column + 1 < gradient.width; ++column) {
      const std::size_t at = gradient.at(column, row);
      const float size = std::sqrt(gradient.x[at] * gradient.x[at] + gradient.y[at] * gradient.y[at]);
      if (size < edges.threshold) continue;
      edges.pixels.push_back({static_cast<float>(column), static_cast<float>(row), gradient.x[at] / size,
                              gradient.y[at] / size, std::min(size, reference)});
    }
  if (edges.pixels.size() > most_edges) {
    const std::size_t stride = edges.pixels.size() / most_edges + 1;
    std::vector<EdgePixel> chosen;
    for (std::size_t i = 0; i < edges.pixels.size(); i += stride) chosen.push_back(edges.pixels[i]);
    edges.pixels = std::move(chosen);
  }
  return edges;
}

struct Peak {
  float score;
  int column, row;
};

// Votes of one polarity.
class RadiusVote {
 public:
  RadiusVote(const GradientField& gradient, const VotingEdges& edges, double sign, const RadiusRange& radii)
      : gradient_(gradient),
        edges_(edges),
        sign_(sign),
        from_(radii.from),
        count_(static_cast<int>(std::ceil(std::log(radii.to / radii.from) / std::log(vote_ratio))) + 1),
        width_(static_cast<std::size_t>(gradient.width)),
        height_(static_cast<std::size_t>(gradient.height)),
        votes_(width_ * height_),
        sums_(width_ * height_) {}

  // The sharpest radii, then how much of all edges their circles explain.
  void search(double scale, std::vector<RadiusCandidate>& candidates) {
    for (int k = 0; k < count_; ++k) {
      fill(from_ * std::pow(vote_ratio, k));
      sharpness_.push_back(sharpness_now());
    }
    for (const int k : sharpest()) {
      const double radius = from_ * std::pow(vote_ratio, position_of_maximum(k));
      fill(radius);
      judge(radius, scale, candidates);
    }
  }

 private:
  void fill(double radius) {
    std::fill(votes_.begin(), votes_.end(), 0.0F);
    const float shift = static_cast<float>(-sign_ * radius);
    for (const EdgePixel& edge : edges_.pixels) {
      const int column = static_cast<int>(edge.x + shift * edge.unit_x + 0.5F);
      const int row = static_cast<int>(edge.y + shift * edge.unit_y + 0.5F);
      if (column < 1 || row < 1 || column >= gradient_.width - 1 || row >= gradient_.height - 1) continue;
      votes_[static_cast<std::size_t>(row) * width_ + static_cast<std::size_t>(column)] += edge.weight;
    }
    // The outermost rows and columns stay 0.
    for (std::size_t row = 1; row + 1 < height_; ++row) {
      const float* a = votes_.data() + (row - 1) * width_;
      const float* b = a + width_;
      const float* c = b + width_;
      float* to = sums_.data() + row * width_;
      for (std::size_t k = 1; k + 1 < width_; ++k)
        to[k] = a[k - 1] + a[k] + a[k + 1] + b[k - 1] + b[k] + b[k + 1] + c[k - 1] + c[k] + c[k + 1];
    }
  }

  [[nodiscard]] double sharpness_now() const {
    double sum = 0;
    for (std::size_t row = 0; row < height_; ++row) {
      float line = 0;
      for (std::size_t column = 0; column < width_; ++column)
        line += sums_[row * width_ + column] * sums_[row * width_ + column];
      sum += static_cast<double>(line);
    }
    return sum;
  }

  [[nodiscard]] double sharpness(int k) const { return sharpness_[static_cast<std::size_t>(k)]; }

  [[nodiscard]] std::vector<int> sharpest() const {
    std::vector<int> maxima;
    for (int k = 0; k < count_; ++k) {
      if (k > 0 && sharpness(k - 1) > sharpness(k)) continue;
      if (k + 1 < count_ && sharpness(k + 1) >= sharpness(k)) continue;
      maxima.push_back(k);
    }
    std::sort(maxima.begin(), maxima.end(), [&](int a, int b) { return sharpness(a) > sharpness(b); });
    if (maxima.size() > most_maxima) maxima.resize(most_maxima);
    return maxima;
  }

  // Between radii, by a parabola.
  [[nodiscard]] double position_of_maximum(int k) const {
    double position = k;
    if (k > 0 && k + 1 < count_) {
      const double a = sharpness(k - 1), b = sharpness(k), c = sharpness(k + 1);
      const double bend = a - 2 * b + c;
      if (bend < 0) position += std::clamp(0.5 * (a - c) / bend, -0.5, 0.5);
    }
    return position;
  }

  [[nodiscard]] std::vector<Peak> peaks() const {
    std::vector<Peak> peaks;
    for (int row = 1; row + 1 < gradient_.height; ++row)
      for (int column = 1; column + 1 < gradient_.width; ++column) {
        const std::size_t at = gradient_.at(column, row);
        const float here = sums_[at];
        if (here <= 0 || here < sums_[at - 1] || here <= sums_[at + 1] || here < sums_[at - width_] ||
            here <= sums_[at + width_])
          continue;
        peaks.push_back({here, column, row});
      }
    std::sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) {
      if (a.score != b.score) return a.score > b.score;
      if (a.row != b.row) return a.row < b.row;
      return a.column < b.column;
    });
    if (peaks.size() > most_peaks) peaks.resize(most_peaks);
    return peaks;
  }

  // Centres from the best down, none near another, whose rim is seen.
  void judge(double radius, double scale, std::vector<RadiusCandidate>& candidates) const {
    const std::vector<Point> circle = circle_points(radius);
    std::vector<std::uint8_t> taken(width_ * height_, 0);
    double explained = 0, support_sum = 0;
    std::vector<Point> centres;
    for (const Peak& peak : peaks()) {
      if (taken[gradient_.at(peak.column, peak.row)]) continue;
      const double support =
          rim_support(gradient_, {peak.column, peak.row, radius}, circle, static_cast<float>(sign_), edges_.threshold);
      if (support < least_vote_support) continue;
      take(taken, peak, std::max(1, static_cast<int>(keep_off_radii * radius)));
      explained += static_cast<double>(peak.score);
      support_sum += support * static_cast<double>(peak.score);
      centres.push_back({static_cast<float>(peak.column), static_cast<float>(peak.row)});
    }
    if (explained <= 0) return;
    double all = 0;
    for (const EdgePixel& edge : edges_.pixels) all += static_cast<double>(edge.weight);
    const CircleSpacing spacing = typical_spacing(centres);
    candidates.push_back({radius * scale,
                          sign_,
                          explained / all,
                          support_sum / explained,
                          centres.size(),
                          {spacing.median * scale, spacing.scatter * scale}});
  }

  void take(std::vector<std::uint8_t>& taken, const Peak& peak, int keep_off) const {
    for (int row = std::max(0, peak.row - keep_off); row <= std::min(gradient_.height - 1, peak.row + keep_off); ++row)
      for (int column = std::max(0, peak.column - keep_off);
           column <= std::min(gradient_.width - 1, peak.column + keep_off); ++column)
        taken[gradient_.at(column, row)] = 1;
  }

  const GradientField& gradient_;
  const VotingEdges& edges_;
  double sign_, from_;
  int count_;  // of radii
  std::size_t width_, height_;
  std::vector<float> votes_, sums_;
  std::vector<double> sharpness_;
};

}  // namespace

std::vector<RadiusCandidate> vote_for_radii(const GrayFrame& frame, double scale, const RadiusRange& radii) {
  std::vector<RadiusCandidate> candidates;
  if (frame.width < 5 || frame.height < 5) return candidates;
  const GradientField gradient = sobel(frame);
  const VotingEdges edges = edges_of(gradient);
  constexpr std::size_t fewest_edges = 12;
  if (edges.pixels.size() < fewest_edges) return candidates;
  for (const double sign : {1.0, -1.0}) RadiusVote(gradient, edges, sign, radii).search(scale, candidates);
  return candidates;
}

}  // namespace shakebed::ingest
