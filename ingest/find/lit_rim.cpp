#include "ingest/find/lit_rim.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "ingest/calibrate/solid_borders.hpp"
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

double typical_radius(const std::vector<Circle>& circles) {
  std::vector<double> radii;
  for (const Circle& circle : circles) radii.push_back(circle.radius);
  return median_of(std::move(radii));
}

// Level along rays from the centre, the mean of the circles whose surroundings are in view.
cv::Mat mean_rays(const GrayFrame& frame, const std::vector<Circle>& circles, double reach) {
  const cv::Mat all(frame.height, frame.width, CV_32F, const_cast<float*>(frame.pixels.data()));
  cv::Mat sum = cv::Mat::zeros(ray_count, ray_steps, CV_32F), rays;
  const std::size_t stride = 1 + circles.size() / enough_circles;
  int count = 0;
  for (std::size_t k = 0; k < circles.size(); k += stride) {
    const int left = static_cast<int>(std::floor(circles[k].x - reach)) - 1;
    const int top = static_cast<int>(std::floor(circles[k].y - reach)) - 1;
    const int side = static_cast<int>(2 * reach) + 4;
    if (left < 0 || top < 0 || left + side > frame.width || top + side > frame.height) continue;
    const cv::Mat around = all(cv::Rect(left, top, side, side));
    double most = 0;
    cv::minMaxLoc(around, nullptr, &most);
    if (unseen(static_cast<float>(most))) continue;
    const cv::Point2f centre(static_cast<float>(circles[k].x - left), static_cast<float>(circles[k].y - top));
    cv::warpPolar(around, rays, {ray_steps, ray_count}, centre, reach, cv::INTER_LINEAR);
    sum += rays;
    ++count;
  }
  return count > 0 ? cv::Mat(sum / count) : cv::Mat();
}

struct SteepEdge {
  double x = 0, y = 0;  // px from the centre of the circles
  double slope = 0;     // grey levels per step along the ray
};

// The steepest edge along each ray.
std::vector<SteepEdge> steepest_edges(const cv::Mat& rays, double step_px, double radius, double sign) {
  cv::Mat smooth, slope;
  cv::GaussianBlur(rays, smooth, {0, 0}, ray_smoothing * radius / step_px, 0.5);
  cv::Sobel(smooth, slope, CV_32F, 1, 0, 1, sign);
  const int from = static_cast<int>(nearest_steep * radius / step_px);
  const int to = std::min(ray_steps - 2, static_cast<int>(farthest_steep * radius / step_px));
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
    edges.push_back({place * step_px * std::cos(angle), place * step_px * std::sin(angle), at(best)});
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
      steepest_edges(rays, reach / ray_steps, radius, polarity == Polarity::dark_beads ? 1 : -1);
  double steepest = 0;
  for (const SteepEdge& edge : edges) steepest = std::max(steepest, edge.slope);
  std::erase_if(edges, [&](const SteepEdge& edge) { return !(edge.slope >= steep_from * steepest && edge.slope > 0); });
  if (std::ssize(edges) < fewest_steep) return std::nullopt;
  std::optional<LitRim> rim = circle_through(edges);
  if (!rim || rms_about(*rim, edges) > most_uneven * rim->radius_px) return std::nullopt;
  rim->rms_radii = rms_about(*rim, edges) / rim->radius_px;
  rim->steep = static_cast<double>(edges.size()) / ray_count;
  return rim;
}

}  // namespace shakebed::ingest
