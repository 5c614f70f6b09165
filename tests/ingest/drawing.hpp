#pragma once
// Shapes, and a canvas that is seen as a camera sees it: what drawn_pictures.cpp draws with.

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <vector>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest::test::drawing {

inline constexpr int width = 420, height = 360;
inline constexpr int fine = 4;  // points of the canvas a pixel, along each side
inline constexpr double pi = std::numbers::pi;

inline double between(std::mt19937& random, double from, double to) {
  return from + (to - from) * static_cast<double>(random()) / 4294967296.0;
}
inline bool coin(std::mt19937& random) { return random() % 2 == 0; }
inline double normal(std::mt19937& random) {
  double sum = -6;
  for (int k = 0; k < 12; ++k) sum += between(random, 0, 1);
  return sum;
}

struct Point {
  double x = 0, y = 0;
};
using Outline = std::vector<Point>;  // closed

inline Outline moved(Outline outline, Point by, double angle = 0, double scale = 1) {
  const double c = scale * std::cos(angle), s = scale * std::sin(angle);
  for (Point& point : outline) point = {by.x + c * point.x - s * point.y, by.y + s * point.x + c * point.y};
  return outline;
}

template <class RadiusAt>
inline Outline star_shaped(const RadiusAt& radius_at, int corners = 120) {
  Outline outline;
  for (int k = 0; k < corners; ++k) {
    const double angle = 2 * pi * k / corners, r = radius_at(angle);
    outline.push_back({r * std::cos(angle), r * std::sin(angle)});
  }
  return outline;
}

inline Outline oval(double a, double b) {
  Outline outline = star_shaped([](double) { return 1.0; });
  for (Point& point : outline) point = {a * point.x, b * point.y};
  return outline;
}
inline Outline polygon(int sides, double radius) {
  return star_shaped([&](double) { return radius; }, sides);
}
inline Outline box(double a, double b) { return {{-a, -b}, {a, -b}, {a, b}, {-a, b}}; }
inline Outline cross(double long_arm, double thick) {
  const double a = long_arm, b = thick;
  return {{-b, -a}, {b, -a}, {b, -b}, {a, -b}, {a, b}, {b, b}, {b, a}, {-b, a}, {-b, b}, {-a, b}, {-a, -b}, {-b, -b}};
}
inline Outline star(int points, double outer, double inner) {
  Outline outline;
  for (int k = 0; k < 2 * points; ++k) {
    const double r = k % 2 == 0 ? outer : inner, angle = pi * k / points;
    outline.push_back({r * std::cos(angle), r * std::sin(angle)});
  }
  return outline;
}
inline Outline half_disk(double radius) {
  Outline outline;
  for (int k = 0; k <= 40; ++k)
    outline.push_back({radius * std::cos(pi * k / 40), radius * std::sin(pi * k / 40) - 0.4 * radius});
  return outline;
}
inline Outline crescent(double radius) {
  Outline outline;
  for (int k = 0; k <= 40; ++k)
    outline.push_back({radius * std::cos(pi * k / 40 - pi / 2), radius * std::sin(pi * k / 40 - pi / 2)});
  for (int k = 40; k >= 0; --k)
    outline.push_back({0.45 * radius * std::cos(pi * k / 40 - pi / 2), radius * std::sin(pi * k / 40 - pi / 2)});
  return outline;
}
inline Outline capsule(double half_length, double radius) {
  Outline outline;
  for (int k = 0; k <= 30; ++k)
    outline.push_back({half_length + radius * std::cos(pi * k / 30 - pi / 2), radius * std::sin(pi * k / 30 - pi / 2)});
  for (int k = 0; k <= 30; ++k)
    outline.push_back(
        {-half_length + radius * std::cos(pi * k / 30 + pi / 2), radius * std::sin(pi * k / 30 + pi / 2)});
  return outline;
}
// Two arcs that meet in points.
inline Outline leaf(double half_length, double half_width) {
  Outline outline;
  for (int k = 0; k < 40; ++k) {
    const double u = 2.0 * k / 40 - 1;
    outline.push_back({half_length * u, half_width * (1 - u * u)});
  }
  for (int k = 0; k < 40; ++k) {
    const double u = 1 - 2.0 * k / 40;
    outline.push_back({half_length * u, -half_width * (1 - u * u)});
  }
  return outline;
}
// The void between three touching disks.
inline Outline void_of_three(double radius) {
  Outline outline;
  const double apart = 2 / std::sqrt(3.0);
  for (int disk = 0; disk < 3; ++disk) {
    const double away = 2 * pi * disk / 3;
    for (int k = 0; k <= 12; ++k) {
      const double angle = away + pi + pi / 6 - pi / 3 * k / 12;
      outline.push_back(
          {radius * (apart * std::cos(away) + std::cos(angle)), radius * (apart * std::sin(away) + std::sin(angle))});
    }
  }
  return outline;
}
// Gravel, cells: a rim that goes in and out by `roughness` radii (rms).
inline Outline irregular(std::mt19937& random, double radius, double roughness) {
  std::vector<std::complex<double>> waves;
  double power = 0;
  for (int k = 2; k <= 6; ++k) {
    const double phase = between(random, 0, 2 * pi), size = between(random, 0.3, 1) / std::sqrt(k - 1.0);
    waves.push_back(std::polar(size, phase));
    power += 0.5 * std::norm(waves.back());
  }
  return star_shaped([&](double angle) {
    double sum = 0;
    for (int k = 2; k <= 6; ++k) sum += (waves[static_cast<std::size_t>(k - 2)] * std::polar(1.0, k * angle)).real();
    return radius * (1 + roughness * sum / std::sqrt(power));
  });
}

class Canvas {
 public:
  explicit Canvas(double level) : image_(fine * height, fine * width, CV_32F, cv::Scalar(level)) {}

  void fill(const Outline& outline, double level) {
    const std::vector<cv::Point> points = to_points(outline);
    cv::fillPoly(image_, std::vector<std::vector<cv::Point>>{points}, cv::Scalar(level), cv::LINE_8, shift);
  }
  void stroke(const Outline& outline, double thickness_px, double level, bool closed) {
    const std::vector<cv::Point> points = to_points(outline);
    cv::polylines(image_, std::vector<std::vector<cv::Point>>{points}, closed, cv::Scalar(level),
                  std::max(1, static_cast<int>(std::lround(fine * thickness_px))), cv::LINE_8, shift);
  }
  void text(const std::string& words, Point at, double size_px, double level, int thickness, int font) {
    cv::putText(image_, words, cv::Point(static_cast<int>(fine * at.x), static_cast<int>(fine * at.y)), font,
                fine * size_px / 22, cv::Scalar(level), thickness * fine);
  }
  template <class LevelAt>
  void paint(const LevelAt& level_at) {
    for (int row = 0; row < image_.rows; ++row)
      for (int column = 0; column < image_.cols; ++column)
        image_.at<float>(row, column) =
            static_cast<float>(level_at((column + 0.5) / fine - 0.5, (row + 0.5) / fine - 0.5));
  }
  void show(const cv::Mat& levels) { levels.copyTo(image_); }
  // As a camera sees it: blurred, noisy, in grey levels of 0 .. 255.
  GrayFrame seen(std::mt19937& random) const {
    cv::Mat small, blurred;
    cv::resize(image_, small, cv::Size(width, height), 0, 0, cv::INTER_AREA);
    const double blur = between(random, 0.3, 1.2), noise = between(random, 0.3, 4);
    cv::GaussianBlur(small, blurred, cv::Size(0, 0), blur);
    GrayFrame frame;
    frame.width = width;
    frame.height = height;
    for (int row = 0; row < height; ++row)
      for (int column = 0; column < width; ++column)
        frame.pixels.push_back(static_cast<float>(std::clamp(
            std::round(static_cast<double>(blurred.at<float>(row, column)) + noise * normal(random)), 0.0, 255.0)));
    return frame;
  }

 private:
  static constexpr int shift = 4;
  static std::vector<cv::Point> to_points(const Outline& outline) {
    std::vector<cv::Point> points;
    for (const Point& point : outline)
      points.emplace_back(static_cast<int>(std::lround((fine * (point.x + 0.5) - 0.5) * (1 << shift))),
                          static_cast<int>(std::lround((fine * (point.y + 0.5) - 0.5) * (1 << shift))));
    return points;
  }
  cv::Mat image_;
};

}  // namespace shakebed::ingest::test::drawing
