// Small pictures of beads and of other things, painted pixel by pixel, for tests of the program.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace shakebed::tests {

struct Place {
  double x = 0, y = 0;
};

// Rows of a triangular lattice on a floor, between walls; neighbours are `gap` radii farther apart than they touch.
inline std::vector<Place> lattice(double radius, int rows, double left, double right, double floor, double gap,
                                  unsigned seed = 1) {
  const double half = radius * (1 + gap);
  std::mt19937 random(seed);
  const auto shift = [&] { return 0.8 * gap * radius * (static_cast<double>(random()) / 4294967296.0 - 0.5); };
  std::vector<Place> places;
  for (int row = 0; row < rows; ++row)
    for (double x = left + radius + (row % 2) * half; x <= right - radius + 1e-9; x += 2 * half) {
      const double dx = shift(), dy = shift();
      places.push_back({x + dx, floor - radius - row * std::sqrt(3.0) * half + dy});
    }
  return places;
}

// Grey levels of 0 to 255.
class PaintedPicture {
 public:
  PaintedPicture(int width, int height, double level = 200)
      : width_(width),
        height_(height),
        levels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), level) {}

  // What covers a pixel by the share cover(x, y) gets this level there.
  PaintedPicture& paint(const std::function<double(double, double)>& cover, double level) {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        double& here = at(x, y);
        here += std::clamp(cover(x, y), 0.0, 1.0) * (level - here);
      }
    return *this;
  }
  PaintedPicture& disks(const std::vector<Place>& places, double radius, double level) {
    for (const Place& place : places)
      for (int y = first(place.y - radius - 1); y <= last(place.y + radius + 1, height_); ++y)
        for (int x = first(place.x - radius - 1); x <= last(place.x + radius + 1, width_); ++x) {
          double& here = at(x, y);
          here += std::clamp(radius + 0.5 - std::hypot(x - place.x, y - place.y), 0.0, 1.0) * (level - here);
        }
    return *this;
  }
  PaintedPicture& box(int left, int top, int width, int height, double level) {
    for (int y = std::max(0, top); y < std::min(height_, top + height); ++y)
      for (int x = std::max(0, left); x < std::min(width_, left + width); ++x) at(x, y) = level;
    return *this;
  }
  PaintedPicture& put(const PaintedPicture& other, int left, int top) {
    for (int y = 0; y < other.height_; ++y)
      for (int x = 0; x < other.width_; ++x) at(left + x, top + y) = std::round(other.at(x, y));
    return *this;
  }
  // Gaussian, along x and then along y.
  PaintedPicture& blur(double sigma) {
    for (const bool along_x : {true, false}) {
      const std::vector<double> before = levels_;
      const int reach = static_cast<int>(3 * sigma) + 1;
      for (int y = 0; y < height_; ++y)
        for (int x = 0; x < width_; ++x) {
          double sum = 0, weights = 0;
          for (int k = -reach; k <= reach; ++k) {
            const double weight = std::exp(-k * k / (2 * sigma * sigma));
            const int from_x = along_x ? std::clamp(x + k, 0, width_ - 1) : x,
                      from_y = along_x ? y : std::clamp(y + k, 0, height_ - 1);
            sum += weight * before[index(from_x, from_y)], weights += weight;
          }
          at(x, y) = sum / weights;
        }
    }
    return *this;
  }
  PaintedPicture& noise(double levels, unsigned seed = 3) {
    std::mt19937 random(seed);
    for (double& level : levels_) {
      double sum = -6;
      for (int k = 0; k < 12; ++k) sum += static_cast<double>(random()) / 4294967296.0;
      level += levels * sum;
    }
    return *this;
  }

  double& at(int x, int y) { return levels_[index(x, y)]; }
  [[nodiscard]] double at(int x, int y) const { return levels_[index(x, y)]; }

  [[nodiscard]] std::string pgm() const { return file("P5", {this}); }
  // Of red, green and blue.
  static std::string ppm(const PaintedPicture& red, const PaintedPicture& green, const PaintedPicture& blue) {
    return red.file("P6", {&red, &green, &blue});
  }

 private:
  static int first(double place) { return std::max(0, static_cast<int>(place)); }
  static int last(double place, int size) { return std::min(size - 1, static_cast<int>(place) + 1); }
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  [[nodiscard]] std::string file(const char* kind, const std::vector<const PaintedPicture*>& planes) const {
    std::string text = std::string(kind) + "\n" + std::to_string(width_) + " " + std::to_string(height_) + "\n255\n";
    for (std::size_t k = 0; k < levels_.size(); ++k)
      for (const PaintedPicture* plane : planes)
        text += static_cast<char>(static_cast<unsigned char>(std::clamp(std::lround(plane->levels_[k]), 0L, 255L)));
    return text;
  }

  int width_, height_;
  std::vector<double> levels_;
};

}  // namespace shakebed::tests
