#include "ingest/find/picture_scale.hpp"

#include <algorithm>
#include <cmath>

#include "ingest/frames/smooth_field.hpp"

namespace shakebed::ingest {

namespace {
constexpr double least_radius = 5;  // px: below it a rim is too coarse to tell a circle

class Stretching {
 public:
  Stretching(const GrayFrame& frame, double ratio, double angle)
      : last_column_(frame.width - 1.0), last_row_(frame.height - 1.0) {
    const double along = std::sqrt(ratio), c = std::cos(angle), s = std::sin(angle);
    xx_ = c * c * along + s * s / along, xy_ = c * s * (along - 1 / along), yy_ = s * s * along + c * c / along;
  }
  [[nodiscard]] FramePlace source_of(double column, double row) const {
    const double middle_x = 0.5 * last_column_, middle_y = 0.5 * last_row_;
    const double u = column - middle_x, v = row - middle_y;
    return {mirrored(middle_x + xx_ * u + xy_ * v, last_column_), mirrored(middle_y + xy_ * u + yy_ * v, last_row_)};
  }

 private:
  static double mirrored(double x, double last) {
    x = std::abs(x);
    return std::clamp(x > last ? 2 * last - x : x, 0.0, last - 1e-3);
  }
  double last_column_, last_row_, xx_ = 1, xy_ = 0, yy_ = 1;
};
}  // namespace

GrayFrame doubled(const GrayFrame& frame) {
  GrayFrame twice;
  twice.width = 2 * frame.width;
  twice.height = 2 * frame.height;
  twice.pixels.resize(static_cast<std::size_t>(twice.width) * static_cast<std::size_t>(twice.height));
  for (int row = 0; row < twice.height; ++row) {
    const double y = std::clamp(0.5 * row - 0.25, 0.0, frame.height - 1.001);
    const int upper = static_cast<int>(y);
    const float down = static_cast<float>(y - upper);
    for (int column = 0; column < twice.width; ++column) {
      const double x = std::clamp(0.5 * column - 0.25, 0.0, frame.width - 1.001);
      const int left = static_cast<int>(x);
      const float along = static_cast<float>(x - left);
      twice.pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(twice.width) +
                   static_cast<std::size_t>(column)] =
          (1 - down) * ((1 - along) * frame.at(left, upper) + along * frame.at(left + 1, upper)) +
          down * ((1 - along) * frame.at(left, upper + 1) + along * frame.at(left + 1, upper + 1));
    }
  }
  return twice;
}

FramePlace place_before_stretching(const GrayFrame& frame, double ratio, double angle, double x, double y) {
  return Stretching(frame, ratio, angle).source_of(x, y);
}

GrayFrame stretched(const GrayFrame& frame, double ratio, double angle) {
  const Stretching stretching(frame, ratio, angle);
  GrayFrame out;
  out.width = frame.width;
  out.height = frame.height;
  out.pixels.resize(frame.pixels.size());
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      const auto [x, y] = stretching.source_of(column, row);
      const int left = static_cast<int>(x), upper = static_cast<int>(y);
      const float right = static_cast<float>(x - left), down = static_cast<float>(y - upper);
      out.pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width) +
                 static_cast<std::size_t>(column)] =
          (1 - down) * ((1 - right) * frame.at(left, upper) + right * frame.at(left + 1, upper)) +
          down * ((1 - right) * frame.at(left, upper + 1) + right * frame.at(left + 1, upper + 1));
    }
  return out;
}

double scale_for(double radius_px, double wanted_px) {
  return radius_px < least_radius ? 0.5 : std::max(1, static_cast<int>(radius_px / wanted_px));
}

ScaledPicture scaled_for(const GrayFrame& frame, double radius_px, double wanted_px) {
  ScaledPicture scaled;
  scaled.scale = scale_for(radius_px, wanted_px);
  scaled.picture = scaled.scale < 1 ? doubled(frame) : reduced(frame, static_cast<int>(scaled.scale));
  return scaled;
}

}  // namespace shakebed::ingest
