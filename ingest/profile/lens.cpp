#include "ingest/profile/lens.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "ingest/frames/smooth_field.hpp"

namespace shakebed::ingest {

LensMap::LensMap(const Lens& lens, int recorded_width, int recorded_height)
    : lens_(lens), recorded_width_(recorded_width), recorded_height_(recorded_height) {
  if (!(lens.pixel_aspect >= 0.5 && lens.pixel_aspect <= 2))
    throw std::invalid_argument("lens: pixel_aspect must lie in 0.5 .. 2");
  if (!(std::abs(lens.radial) <= 0.3)) throw std::invalid_argument("lens: radial must lie in -0.3 .. 0.3");
  const double wide = recorded_width * lens.pixel_aspect;
  middle_x_ = 0.5 * wide - 0.5;
  middle_y_ = 0.5 * recorded_height - 0.5;
  half_diagonal_ = std::max(1.0, 0.5 * std::hypot(wide, static_cast<double>(recorded_height)));
  if (lens.radial > 0) {  // the corners move out farthest, along the diagonal
    margin_x_ = std::ceil(0.5 * wide * lens.radial);
    margin_y_ = std::ceil(0.5 * recorded_height * lens.radial);
  }
  width_ = static_cast<int>(std::lround(wide + 2 * margin_x_));
  height_ = recorded_height + static_cast<int>(2 * margin_y_);
}

PixelPlace LensMap::to_true(PixelPlace recorded) const {
  const double x = (recorded.x + 0.5) * lens_.pixel_aspect - 0.5 - middle_x_, y = recorded.y - middle_y_;
  const double stretch = 1 + lens_.radial * (x * x + y * y) / (half_diagonal_ * half_diagonal_);
  return {middle_x_ + x * stretch + margin_x_, middle_y_ + y * stretch + margin_y_};
}

// s = recorded/true distance from the middle, where s (1 + k s^2 q) = 1 with q = (true distance/h)^2; Newton from 1.
double LensMap::shrink(double q) const {
  const double k = lens_.radial * q;
  double s = 1;
  for (int round = 0; round < 6; ++round) s -= (s + k * s * s * s - 1) / std::max(0.1, 1 + 3 * k * s * s);
  return s;
}

PixelPlace LensMap::to_recorded(PixelPlace seen) const {
  const double x = seen.x - margin_x_ - middle_x_, y = seen.y - margin_y_ - middle_y_;
  const double s = shrink((x * x + y * y) / (half_diagonal_ * half_diagonal_));
  return {(middle_x_ + s * x + 0.5) / lens_.pixel_aspect - 0.5, middle_y_ + s * y};
}

GrayFrame LensMap::corrected(const GrayFrame& recorded) const {
  if (recorded.width != recorded_width_ || recorded.height != recorded_height_)
    throw std::invalid_argument("lens: the frame differs in size from the map of the lens");
  GrayFrame frame;
  frame.width = width_;
  frame.height = height_;
  frame.pixels.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  // Catmull-Rom's cubic through the four nearest.
  const auto weights = [](float t) {
    return std::array<float, 4>{t * (-0.5F + t * (1 - 0.5F * t)), 1 + t * t * (-2.5F + 1.5F * t),
                                t * (0.5F + t * (2 - 1.5F * t)), t * t * (-0.5F + 0.5F * t)};
  };
  const std::size_t stride = static_cast<std::size_t>(recorded_width_);
  if (lens_.radial == 0) {  // rows stay rows
    struct Part {
      std::array<std::size_t, 4> from;
      std::array<float, 4> weight;
    };
    std::vector<Part> parts(static_cast<std::size_t>(width_));
    for (int column = 0; column < width_; ++column) {
      Part& part = parts[static_cast<std::size_t>(column)];
      const double x = std::clamp(to_recorded({static_cast<double>(column), middle_y_}).x, 0.0, recorded_width_ - 1.0);
      const int left = static_cast<int>(x);
      part.weight = weights(static_cast<float>(x - left));
      for (int i = 0; i < 4; ++i)
        part.from[static_cast<std::size_t>(i)] =
            static_cast<std::size_t>(std::clamp(left + i - 1, 0, recorded_width_ - 1));
    }
    for (int row = 0; row < height_; ++row) {
      const float* line = recorded.pixels.data() + static_cast<std::size_t>(row) * stride;
      float* to = frame.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
      for (const Part& part : parts)
        *to++ = part.weight[0] * line[part.from[0]] + part.weight[1] * line[part.from[1]] +
                part.weight[2] * line[part.from[2]] + part.weight[3] * line[part.from[3]];
    }
    return frame;
  }
  // The map bends so little that straight lines between a thousand values of q are good to 1e-4 px.
  constexpr std::size_t pieces = 1024;
  const double farthest = std::hypot(0.5 * width_ + 1, 0.5 * height_ + 1) / half_diagonal_;
  const double pieces_per_q = static_cast<double>(pieces) / (farthest * farthest);
  std::vector<double> shrinks(pieces + 2);
  for (std::size_t i = 0; i < shrinks.size(); ++i) shrinks[i] = shrink(static_cast<double>(i) / pieces_per_q);
  const double pieces_per_square = pieces_per_q / (half_diagonal_ * half_diagonal_);
  for (int row = 0; row < height_; ++row) {
    float* to = frame.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
    const double away_y = row - margin_y_ - middle_y_;
    for (int column = 0; column < width_; ++column) {
      const double away_x = column - margin_x_ - middle_x_;
      const double at = pieces_per_square * (away_x * away_x + away_y * away_y);
      const auto piece = std::min(pieces, static_cast<std::size_t>(at));
      const double s = shrinks[piece] + (at - static_cast<double>(piece)) * (shrinks[piece + 1] - shrinks[piece]);
      const double x = std::clamp((middle_x_ + s * away_x + 0.5) / lens_.pixel_aspect - 0.5, 0.0,
                                  recorded_width_ - 1.0),
                   y = std::clamp(middle_y_ + s * away_y, 0.0, recorded_height_ - 1.0);
      const int left = static_cast<int>(x), top = static_cast<int>(y);
      const auto along = weights(static_cast<float>(x - left)), down = weights(static_cast<float>(y - top));
      float sum = 0;
      for (int j = 0; j < 4; ++j) {
        const int from_row = std::clamp(top + j - 1, 0, recorded_height_ - 1);
        const float* line = recorded.pixels.data() + static_cast<std::size_t>(from_row) * stride;
        float across = 0;
        for (int i = 0; i < 4; ++i)
          across += along[static_cast<std::size_t>(i)] * line[std::clamp(left + i - 1, 0, recorded_width_ - 1)];
        sum += down[static_cast<std::size_t>(j)] * across;
      }
      to[column] = sum;
    }
  }
  return frame;
}

LensEstimate estimate_lens(const std::vector<const GrayFrame*>& frames, const std::vector<FindResult>& found,
                           const FinderCalibration& calibration) {
  // A bead at d from the middle, turned by phi: its rim in the frame is at R + dR(theta),
  // dR = common - R a cos^2(theta) - R k (d/h)^2 (2 + cos 2(theta - phi)) to first order, and its level changes by
  // -p'(r) dR.
  LensEstimate estimate;
  const double radius = calibration.rim_radius_px, reach = calibration.profile.reach_px();
  const double step = calibration.profile.step_px;
  const std::vector<float>& level = calibration.profile.level;
  const double contrast = calibration.contrast_level;
  std::vector<double> matrix(9, 0.0), right(3, 0.0);
  double square = 0;
  std::size_t disks = 0, pixels = 0;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const GrayFrame residual = residual_frame(*frames[f], found[f], calibration);
    const double middle_x = 0.5 * (residual.width - 1), middle_y = 0.5 * (residual.height - 1);
    const double half_diagonal = std::hypot(middle_x + 0.5, middle_y + 0.5);
    // What each pixel would gain by the three together, from all beads it belongs to.
    std::vector<std::array<float, 3>> gain(residual.pixels.size(), {0, 0, 0});
    for (const FoundDisk& disk : found[f].disks) {
      disks += !disk.cut && !disk.half_hidden;
      const double away_x = (disk.x_px - middle_x) / half_diagonal, away_y = (disk.y_px - middle_y) / half_diagonal;
      const double away = away_x * away_x + away_y * away_y;
      const int top = std::max(0, static_cast<int>(std::ceil(disk.y_px - reach))),
                bottom = std::min(residual.height - 1, static_cast<int>(std::floor(disk.y_px + reach)));
      const int left = std::max(0, static_cast<int>(std::ceil(disk.x_px - reach))),
                right_column = std::min(residual.width - 1, static_cast<int>(std::floor(disk.x_px + reach)));
      for (int row = top; row <= bottom; ++row)
        for (int column = left; column <= right_column; ++column) {
          const double dx = column - disk.x_px, dy = row - disk.y_px, r = std::sqrt(dx * dx + dy * dy);
          const auto cell = static_cast<std::size_t>(r / step);
          if (cell + 1 >= level.size() || r < 1e-9) continue;
          const double slope = (static_cast<double>(level[cell + 1]) - static_cast<double>(level[cell])) / step;
          const double along = (dx * away_x + dy * away_y) / r;  // |d|/h cos(theta - phi)
          auto& here = gain[static_cast<std::size_t>(row) * static_cast<std::size_t>(residual.width) +
                            static_cast<std::size_t>(column)];
          here[0] += static_cast<float>(-slope);
          here[1] += static_cast<float>(slope * radius * dx * dx / (r * r));
          here[2] += static_cast<float>(slope * radius * (away + 2 * along * along));
        }
    }
    for (std::size_t k = 0; k < gain.size(); ++k) {
      if (gain[k][0] == 0) continue;
      const double e = static_cast<double>(residual.pixels[k]) / contrast;
      constexpr double no_rim = 0.5;  // dirt, a bead of another kind
      if (std::abs(e) > no_rim) continue;
      square += e * e;
      ++pixels;
      for (std::size_t a = 0; a < 3; ++a) {
        right[a] += static_cast<double>(gain[k][a]) * e;
        for (std::size_t b = 0; b < 3; ++b)
          matrix[a * 3 + b] += static_cast<double>(gain[k][a]) * static_cast<double>(gain[k][b]);
      }
    }
  }
  constexpr std::size_t fewest = 20;
  if (disks < fewest || pixels == 0) return estimate;
  std::vector<double> factor = matrix;
  if (!solve_symmetric(factor, right, 3)) return estimate;
  const double variance = square / static_cast<double>(pixels);
  const auto std_error = [&](std::size_t k) {
    std::vector<double> again = matrix, unit(3, 0.0);
    unit[k] = 1;
    return solve_symmetric(again, unit, 3) ? std::sqrt(std::max(0.0, variance * unit[k])) : 1e9;
  };
  estimate.known = true;
  estimate.lens.pixel_aspect = 1 + right[1];
  estimate.lens.radial = right[2];
  estimate.aspect_std_error = std_error(1);
  estimate.radial_std_error = std_error(2);
  return estimate;
}

}  // namespace shakebed::ingest
