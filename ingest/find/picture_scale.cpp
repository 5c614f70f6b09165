#include "ingest/find/picture_scale.hpp"

#include <algorithm>
#include <cmath>

#include "ingest/find/vector_lanes.hpp"
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

// At the borders 0 and `last`; so that one px to the right, or below, is in the picture, too.
inline __attribute__((always_inline)) Floats mirrored(const Floats& place, float last) {
  const float inside = 1e-3F + last * 0x1p-21F;  // more than a float's rounding
  const Floats positive = place < 0 ? -place : place;
  const Floats within = positive > last ? 2 * last - positive : positive;
  const Floats least = within < 0 ? 0 * within : within;
  const Floats most = last - inside + 0 * within;
  return least < most ? least : most;
}
}  // namespace

GrayFrame doubled(const GrayFrame& frame) {
  GrayFrame twice;
  twice.width = 2 * frame.width;
  twice.height = 2 * frame.height;
  twice.pixels.resize(static_cast<std::size_t>(twice.width) * static_cast<std::size_t>(twice.height));
  // Between two pixels; one that is alone is its own neighbour.
  const auto between = [](double place, int size) { return std::clamp(place, 0.0, std::max(0.0, size - 1.001)); };
  const int next_column = frame.width > 1 ? 1 : 0, next_row = frame.height > 1 ? 1 : 0;
  for (int row = 0; row < twice.height; ++row) {
    const double y = between(0.5 * row - 0.25, frame.height);
    const int upper = static_cast<int>(y), lower = upper + next_row;
    const float down = static_cast<float>(y - upper);
    for (int column = 0; column < twice.width; ++column) {
      const double x = between(0.5 * column - 0.25, frame.width);
      const int left = static_cast<int>(x), right = left + next_column;
      const float along = static_cast<float>(x - left);
      twice.pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(twice.width) +
                   static_cast<std::size_t>(column)] =
          (1 - down) * ((1 - along) * frame.at(left, upper) + along * frame.at(right, upper)) +
          down * ((1 - along) * frame.at(left, lower) + along * frame.at(right, lower));
    }
  }
  return twice;
}

FramePlace place_before_stretching(const GrayFrame& frame, double ratio, double angle, double x, double y) {
  return Stretching(frame, ratio, angle).source_of(x, y);
}

StretchedLines::StretchedLines(const GrayFrame& frame, double ratio, double angle)
    : frame_(frame),
      middle_x_(0.5F * static_cast<float>(frame.width - 1)),
      middle_y_(0.5F * static_cast<float>(frame.height - 1)),
      line_(static_cast<std::size_t>((frame.width + lanes - 1) / lanes * lanes)) {
  const double along = std::sqrt(ratio), c = std::cos(angle), s = std::sin(angle);
  xx_ = static_cast<float>(c * c * along + s * s / along);
  xy_ = static_cast<float>(c * s * (along - 1 / along));
  yy_ = static_cast<float>(s * s * along + c * c / along);
}

const float* StretchedLines::line(int row) {
  const float *upper = frame_.pixels.data(), *lower = upper + frame_.width;
  const float last_x = 2 * middle_x_, last_y = 2 * middle_y_, v = static_cast<float>(row) - middle_y_;
  for (int first = 0; first < frame_.width; first += lanes) {
    const Floats u = lane_numbers + (static_cast<float>(first) - middle_x_);
    const Floats x = mirrored(middle_x_ + xx_ * u + xy_ * v, last_x),
                 y = mirrored(middle_y_ + xy_ * u + yy_ * v, last_y);
    const Ints left = __builtin_convertvector(x, Ints), above = __builtin_convertvector(y, Ints);
    const Floats right = x - __builtin_convertvector(left, Floats), down = y - __builtin_convertvector(above, Floats);
    const Ints at = above * frame_.width + left;
    Floats a, b, c, d;
    gather_with_next(upper, at, a, b), gather_with_next(lower, at, c, d);
    const Floats on_upper = (1 - right) * a + right * b, on_lower = (1 - right) * c + right * d;
    store((1 - down) * on_upper + down * on_lower, line_.data() + first);
  }
  return line_.data();
}

GrayFrame stretched(const GrayFrame& frame, double ratio, double angle) {
  StretchedLines lines(frame, ratio, angle);
  GrayFrame out;
  out.width = frame.width;
  out.height = frame.height;
  out.pixels.reserve(frame.pixels.size());
  for (int row = 0; row < frame.height; ++row) {
    const float* line = lines.line(row);
    out.pixels.insert(out.pixels.end(), line, line + frame.width);
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
