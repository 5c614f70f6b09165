#include "ingest/find/lit_rim.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "ingest/find/level_rays.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

constexpr int ray_count = 64, ray_steps = 128;               // of the polar picture
constexpr double ray_reach = 1.6;                            // radii of the circles, to which it goes
constexpr double nearest_steep = 0.7, farthest_steep = 1.5;  // radii of the circles, between which edges are looked for
constexpr double ray_smoothing = 0.04;                       // radii
constexpr std::size_t enough_circles = 400;                  // enough for the mean
constexpr double steep_from = 0.5;                           // of the steepest edge
constexpr int fewest_steep = ray_count / 3;
constexpr double most_uneven = 0.05;  // radii, rms of the steep edges about their circle
// Of two sides, each shows so many steep edges at least, and their middles lie in directions that are so far apart at
// least: the cosine of the angle.
constexpr int fewest_of_a_side = ray_count / 8;
constexpr double opposite_sides = -0.5;
// A circle through the bright side alone may lie so far from the dark side: radii, as above.
constexpr double far_ray_reach = 1.9, far_steep = 1.8;
constexpr int most_recentred = 4;        // times that circles are moved to what they led to
constexpr double recentred_well = 0.01;  // radii

double typical_radius(const std::vector<Circle>& circles) {
  std::vector<double> radii;
  for (const Circle& circle : circles) radii.push_back(circle.radius);
  return median_of(std::move(radii));
}

// Level along rays from the centre, the mean of the circles whose surroundings are in view.
cv::Mat mean_rays(const GrayFrame& frame, const std::vector<Circle>& circles, double reach) {
  cv::Mat sum = cv::Mat::zeros(ray_count, ray_steps, CV_32F);
  const std::size_t stride = 1 + circles.size() / enough_circles;
  int count = 0;
  for (std::size_t k = 0; k < circles.size(); k += stride) {
    const cv::Mat rays = levels_along_rays(frame, circles[k].x, circles[k].y, {ray_count, ray_steps, reach});
    if (rays.empty()) continue;
    sum += rays;
    ++count;
  }
  return count > 0 ? cv::Mat(sum / count) : cv::Mat();
}

struct SteepEdge {
  double x = 0, y = 0;  // px from the centre of the circles
  double slope = 0;     // grey levels per step along the ray, in the sign asked for
};

struct EdgeRange {
  double radius = 0;                 // px, of the circles
  double farthest = farthest_steep;  // radii
};

// The steepest edge along each ray, of dark beads, of bright ones, or of either.
std::vector<SteepEdge> steepest_edges(const cv::Mat& rays, double step_px, const EdgeRange& range, Polarity polarity) {
  cv::Mat smooth, rise, slope;
  cv::GaussianBlur(rays, smooth, {0, 0}, ray_smoothing * range.radius / step_px, 0.5);
  cv::Sobel(smooth, rise, CV_32F, 1, 0, 1, polarity == Polarity::bright_beads ? -1 : 1);
  slope = polarity == Polarity::automatic ? cv::Mat(cv::abs(rise)) : rise;
  const int from = static_cast<int>(nearest_steep * range.radius / step_px);
  const int to = std::min(ray_steps - 2, static_cast<int>(range.farthest * range.radius / step_px));
  std::vector<SteepEdge> edges;
  for (int k = 0; k < ray_count; ++k) {
    const auto at = [&](int column) { return static_cast<double>(slope.at<float>(k, column)); };
    int best = from;
    for (int column = from; column <= to; ++column)
      if (at(column) > at(best)) best = column;
    if (best == from || best == to) continue;
    const double bend = at(best - 1) - 2 * at(best) + at(best + 1);
    const double place = best + (bend < 0 ? 0.5 * (at(best - 1) - at(best + 1)) / bend : 0);
    const double angle = 2 * std::numbers::pi * k / ray_count;
    edges.push_back({place * step_px * std::cos(angle), place * step_px * std::sin(angle),
                     static_cast<double>(rise.at<float>(k, best))});
  }
  return edges;
}

// The circle x^2 + y^2 = 2 a x + 2 b y + c by least squares, each edge weighted by its slope. Middle: (a, b); radius:
// sqrt(c + a^2 + b^2).
std::optional<LitRim> circle_through(const std::vector<SteepEdge>& edges) {
  cv::Matx33d normal = cv::Matx33d::zeros();
  cv::Vec3d right(0, 0, 0), solved;
  for (const SteepEdge& edge : edges) {
    const cv::Vec3d row(2 * edge.x, 2 * edge.y, 1);
    normal += edge.slope * row * row.t();
    right += edge.slope * (edge.x * edge.x + edge.y * edge.y) * row;
  }
  if (!cv::solve(normal, right, solved, cv::DECOMP_CHOLESKY)) return std::nullopt;
  const double squared = solved[2] + solved[0] * solved[0] + solved[1] * solved[1];
  if (!(squared > 0)) return std::nullopt;
  return LitRim{std::sqrt(squared), solved[0], solved[1], 0};
}

void drop_gentle(std::vector<SteepEdge>& edges) {
  double steepest = 0;
  for (const SteepEdge& edge : edges) steepest = std::max(steepest, edge.slope);
  std::erase_if(edges, [&](const SteepEdge& edge) { return !(edge.slope >= steep_from * steepest && edge.slope > 0); });
}

double rms_about(const LitRim& circle, const std::vector<SteepEdge>& edges) {
  double squares = 0;
  for (const SteepEdge& edge : edges) {
    const double off = std::hypot(edge.x - circle.right_px, edge.y - circle.down_px) - circle.radius_px;
    squares += off * off;
  }
  return std::sqrt(squares / static_cast<double>(edges.size()));
}

}  // namespace

std::optional<LitRim> lit_rim_of(const GrayFrame& frame, const std::vector<Circle>& circles, Polarity polarity) {
  if (circles.empty()) return std::nullopt;
  const double radius = typical_radius(circles), reach = ray_reach * radius;
  const cv::Mat rays = mean_rays(frame, circles, reach);
  if (rays.empty()) return std::nullopt;
  std::vector<SteepEdge> edges =
      steepest_edges(rays, reach / ray_steps, {radius},
                     polarity == Polarity::dark_beads ? Polarity::dark_beads : Polarity::bright_beads);
  drop_gentle(edges);
  if (std::ssize(edges) < fewest_steep) return std::nullopt;
  std::optional<LitRim> rim = circle_through(edges);
  if (!rim || rms_about(*rim, edges) > most_uneven * rim->radius_px) return std::nullopt;
  rim->rms_radii = rms_about(*rim, edges) / rim->radius_px;
  rim->steep = static_cast<double>(edges.size()) / ray_count;
  return rim;
}

namespace {

// The sum of the directions of edges, at most 1 long.
cv::Vec2d direction_of(const std::vector<SteepEdge>& edges) {
  cv::Vec2d sum(0, 0);
  for (const SteepEdge& edge : edges) sum += cv::Vec2d(edge.x, edge.y) / std::hypot(edge.x, edge.y);
  return sum / std::max(1.0, cv::norm(sum));
}

// The steep edges of a bright side and of a dark side, each as steep as their side is, with equal weights. Empty unless
// both are seen, opposite one another.
std::vector<SteepEdge> edges_of_both_sides(const cv::Mat& rays, double step_px, double radius) {
  std::vector<SteepEdge> bright, dark;
  for (SteepEdge edge : steepest_edges(rays, step_px, {radius, far_steep}, Polarity::automatic)) {
    std::vector<SteepEdge>& side = edge.slope < 0 ? bright : dark;
    edge.slope = std::abs(edge.slope);
    side.push_back(edge);
  }
  drop_gentle(bright), drop_gentle(dark);
  if (std::ssize(bright) < fewest_of_a_side || std::ssize(dark) < fewest_of_a_side) return {};
  if (direction_of(bright).dot(direction_of(dark)) > opposite_sides) return {};
  bright.insert(bright.end(), dark.begin(), dark.end());
  for (SteepEdge& edge : bright) edge.slope = 1;
  return bright;
}

}  // namespace

std::optional<LitRim> rim_of_both_sides(const GrayFrame& frame, std::vector<Circle> circles) {
  if (circles.empty()) return std::nullopt;
  double radius = typical_radius(circles);
  cv::Vec2d moved(0, 0);
  for (int round = 0; round < most_recentred; ++round) {
    const cv::Mat rays = mean_rays(frame, circles, far_ray_reach * radius);
    if (rays.empty()) return std::nullopt;
    const std::vector<SteepEdge> edges = edges_of_both_sides(rays, far_ray_reach * radius / ray_steps, radius);
    if (edges.empty()) return std::nullopt;
    std::optional<LitRim> rim = circle_through(edges);
    if (!rim || rms_about(*rim, edges) > most_uneven * rim->radius_px) return std::nullopt;
    const cv::Vec2d by(rim->right_px, rim->down_px);
    moved += by;
    rim->rms_radii = rms_about(*rim, edges) / rim->radius_px;
    rim->steep = static_cast<double>(edges.size()) / ray_count;
    rim->right_px = moved[0], rim->down_px = moved[1];
    if (std::abs(rim->radius_px - radius) + cv::norm(by) < recentred_well * radius) return rim;
    radius = rim->radius_px;
    for (Circle& circle : circles) circle.x += by[0], circle.y += by[1];
  }
  return std::nullopt;
}

}  // namespace shakebed::ingest
