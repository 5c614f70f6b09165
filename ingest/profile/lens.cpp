#include "ingest/profile/lens.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <stdexcept>

#include "ingest/frames/smooth_field.hpp"

namespace shakebed::ingest {

LensMap::LensMap(const Lens& lens, int recorded_width, int recorded_height)
    : lens_(lens), recorded_width_(recorded_width), recorded_height_(recorded_height) {
  if (!(lens.pixel_aspect >= narrowest_pixel && lens.pixel_aspect <= widest_pixel))
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

PixelRectangle widened(const PixelRectangle& rectangle, double by) {
  const auto edge = [&](int column) { return static_cast<int>(std::lround(column * by)); };
  const int left = edge(rectangle.left);
  return {left, rectangle.top, std::max(1, edge(rectangle.left + rectangle.width) - left), rectangle.height};
}

PixelPlace LensMap::to_recorded(PixelPlace seen) const {
  const double x = seen.x - margin_x_ - middle_x_, y = seen.y - margin_y_ - middle_y_;
  const double s = shrink((x * x + y * y) / (half_diagonal_ * half_diagonal_));
  return {(middle_x_ + s * x + 0.5) / lens_.pixel_aspect - 0.5, middle_y_ + s * y};
}

namespace {

// Catmull-Rom's cubic through the four nearest.
std::array<float, 4> cubic(float t) {
  return {t * (-0.5F + t * (1 - 0.5F * t)), 1 + t * t * (-2.5F + 1.5F * t), t * (0.5F + t * (2 - 1.5F * t)),
          t * t * (-0.5F + 0.5F * t)};
}

}  // namespace

GrayFrame LensMap::corrected(const GrayFrame& recorded) const {
  if (recorded.width != recorded_width_ || recorded.height != recorded_height_)
    throw std::invalid_argument("lens: the frame differs in size from the map of the lens");
  GrayFrame frame;
  frame.width = width_;
  frame.height = height_;
  frame.pixels.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  lens_.radial == 0 ? correct_rows(recorded, frame) : correct_all(recorded, frame);
  return frame;
}

// Without a radial term rows stay rows.
void LensMap::correct_rows(const GrayFrame& recorded, GrayFrame& frame) const {
  struct Part {
    std::array<std::size_t, 4> from;
    std::array<float, 4> weight;
  };
  std::vector<Part> parts(static_cast<std::size_t>(width_));
  for (int column = 0; column < width_; ++column) {
    Part& part = parts[static_cast<std::size_t>(column)];
    const double x = std::clamp(to_recorded({static_cast<double>(column), middle_y_}).x, 0.0, recorded_width_ - 1.0);
    const int left = static_cast<int>(x);
    part.weight = cubic(static_cast<float>(x - left));
    for (int i = 0; i < 4; ++i)
      part.from[static_cast<std::size_t>(i)] =
          static_cast<std::size_t>(std::clamp(left + i - 1, 0, recorded_width_ - 1));
  }
  for (int row = 0; row < height_; ++row) {
    const float* line =
        recorded.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(recorded_width_);
    float* to = frame.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
    for (const Part& part : parts)
      *to++ = part.weight[0] * line[part.from[0]] + part.weight[1] * line[part.from[1]] +
              part.weight[2] * line[part.from[2]] + part.weight[3] * line[part.from[3]];
  }
}

void LensMap::correct_all(const GrayFrame& recorded, GrayFrame& frame) const {
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
      const auto along = cubic(static_cast<float>(x - left)), down = cubic(static_cast<float>(y - top));
      float sum = 0;
      for (int j = 0; j < 4; ++j) {
        const int from_row = std::clamp(top + j - 1, 0, recorded_height_ - 1);
        const float* line =
            recorded.pixels.data() + static_cast<std::size_t>(from_row) * static_cast<std::size_t>(recorded_width_);
        float across = 0;
        for (int i = 0; i < 4; ++i)
          across += along[static_cast<std::size_t>(i)] * line[std::clamp(left + i - 1, 0, recorded_width_ - 1)];
        sum += down[static_cast<std::size_t>(j)] * across;
      }
      to[column] = sum;
    }
  }
}

namespace {

// The rims of all beads, seen through a lens that is a little off. A bead at d from the middle, turned by phi: its rim
// in the frame is at R + dR(theta), dR = common - R a cos^2(theta) - R (d/h)^2 (2 k + l cos 2(theta - phi)) to first
// order, and its level changes by -p'(r) dR. Of a lens, k = l: beads away from the middle grow, and their shape
// changes, as one.
class LensFit {
 public:
  explicit LensFit(const FinderCalibration& calibration)
      : calibration_(calibration), radius_(calibration.rim_radius_px), reach_(calibration.profile.reach_px()) {}

  void add(const GrayFrame& frame, const FindResult& found) {
    const GrayFrame residual = residual_frame(frame, found, calibration_);
    RimPixels rims(residual);
    for (std::size_t k = 0; k < found.disks.size(); ++k) {
      const FoundDisk& disk = found.disks[k];
      disks_ += !disk.cut && !disk.half_hidden;
      add_rim(disk, beads_.size() + k, rims);
    }
    beads_.resize(beads_.size() + found.disks.size());
    take_pixels(residual, rims);
  }

  [[nodiscard]] LensEstimate estimate() const {
    const Model lens = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 1}},
                apart = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
    constexpr std::size_t fewest = 20;
    LensEstimate estimate;
    if (disks_ < fewest) return estimate;
    const auto best = solved(lens, all_), both = solved(apart, all_);
    if (!best || !both) return estimate;
    estimate.known = true;
    estimate.lens.pixel_aspect = 1 + (*best)[1];
    estimate.lens.radial = (*best)[2];
    estimate.aspect_std_error = std_error_of({0, 1, 0, 0}, lens, *best);
    estimate.radial_std_error = std_error_of({0, 0, 0.5, 0.5}, lens, *best);
    estimate.radial_by_size = (*both)[2];
    estimate.radial_by_shape = (*both)[3];
    estimate.difference_std_error = std_error_of({0, 0, 1, -1}, apart, *both);
    return estimate;
  }

 private:
  using Terms = std::array<double, 4>;  // common, a, k, l
  using Model = std::vector<Terms>;     // what is fitted: each in these terms
  // Over the pixels that are nearest to one bead, or over all.
  struct Sums {
    std::array<double, 16> matrix{};
    Terms right{};
  };
  // What each pixel gains by the terms, from all beads it belongs to, and which of them is nearest.
  struct RimPixels {
    explicit RimPixels(const GrayFrame& frame)
        : width(frame.width),
          height(frame.height),
          gain(frame.pixels.size(), {0, 0, 0, 0}),
          nearest(frame.pixels.size(), {0, HUGE_VALF}) {}
    struct Nearest {
      std::uint32_t bead;
      float away;
    };
    int width, height;
    std::vector<std::array<float, 4>> gain;
    std::vector<Nearest> nearest;
  };

  void add_rim(const FoundDisk& disk, std::size_t bead, RimPixels& rims) const {
    const double step = calibration_.profile.step_px;
    const std::vector<float>& level = calibration_.profile.level;
    const double middle_x = 0.5 * (rims.width - 1), middle_y = 0.5 * (rims.height - 1);
    const double half_diagonal = std::hypot(middle_x + 0.5, middle_y + 0.5);
    const double away_x = (disk.x_px - middle_x) / half_diagonal, away_y = (disk.y_px - middle_y) / half_diagonal;
    const double away = away_x * away_x + away_y * away_y;
    const int top = std::max(0, static_cast<int>(std::ceil(disk.y_px - reach_))),
              bottom = std::min(rims.height - 1, static_cast<int>(std::floor(disk.y_px + reach_)));
    const int left = std::max(0, static_cast<int>(std::ceil(disk.x_px - reach_))),
              right = std::min(rims.width - 1, static_cast<int>(std::floor(disk.x_px + reach_)));
    for (int row = top; row <= bottom; ++row)
      for (int column = left; column <= right; ++column) {
        const double dx = column - disk.x_px, dy = row - disk.y_px, r = std::sqrt(dx * dx + dy * dy);
        const auto cell = static_cast<std::size_t>(r / step);
        if (cell + 1 >= level.size() || r < 1e-9) continue;
        const double slope = (static_cast<double>(level[cell + 1]) - static_cast<double>(level[cell])) / step;
        const double along = (dx * away_x + dy * away_y) / r;  // |d|/h cos(theta - phi)
        const std::size_t at =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(rims.width) + static_cast<std::size_t>(column);
        auto& here = rims.gain[at];
        here[0] += static_cast<float>(-slope);
        here[1] += static_cast<float>(slope * radius_ * dx * dx / (r * r));
        here[2] += static_cast<float>(slope * radius_ * 2 * away);
        here[3] += static_cast<float>(slope * radius_ * (2 * along * along - away));
        if (const auto distance = static_cast<float>(r); distance < rims.nearest[at].away)
          rims.nearest[at] = {static_cast<std::uint32_t>(bead), distance};
      }
  }

  void take_pixels(const GrayFrame& residual, const RimPixels& rims) {
    constexpr double no_rim = 0.5;  // dirt, a bead of another kind
    for (std::size_t k = 0; k < rims.gain.size(); ++k) {
      const auto& gain = rims.gain[k];
      const double e = static_cast<double>(residual.pixels[k]) / calibration_.contrast_level;
      if (gain[0] == 0 || std::abs(e) > no_rim) continue;
      Sums& bead = beads_[rims.nearest[k].bead];
      for (std::size_t a = 0; a < 4; ++a) {
        const auto one = static_cast<double>(gain[a]);
        bead.right[a] += one * e, all_.right[a] += one * e;
        for (std::size_t b = 0; b < 4; ++b) {
          const double both = one * static_cast<double>(gain[b]);
          bead.matrix[4 * a + b] += both, all_.matrix[4 * a + b] += both;
        }
      }
    }
  }

  static double dot(const Terms& one, const Terms& other) {
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2] + one[3] * other[3];
  }
  static Terms times(const std::array<double, 16>& matrix, const Terms& terms) {
    Terms out{};
    for (std::size_t a = 0; a < 4; ++a)
      for (std::size_t b = 0; b < 4; ++b) out[a] += matrix[4 * a + b] * terms[b];
    return out;
  }

  // The terms of the model that best explain the sums.
  static std::optional<Terms> solved(const Model& model, const Sums& sums) {
    std::vector<double> matrix, right;
    for (const Terms& one : model) {
      right.push_back(dot(one, sums.right));
      for (const Terms& other : model) matrix.push_back(dot(one, times(sums.matrix, other)));
    }
    if (!solve_symmetric(matrix, right, model.size())) return std::nullopt;
    Terms terms{};
    for (std::size_t k = 0; k < model.size(); ++k)
      for (std::size_t a = 0; a < 4; ++a) terms[a] += right[k] * model[k][a];
    return terms;
  }

  // Of a sum of terms, by the jackknife: what each bead changes when it is left out. Of the radial term a few beads in
  // the corners tell most.
  [[nodiscard]] double std_error_of(const Terms& sum, const Model& model, const Terms& best) const {
    double variance = 0;
    for (const Sums& bead : beads_) {
      Sums others = all_;
      for (std::size_t k = 0; k < 16; ++k) others.matrix[k] -= bead.matrix[k];
      for (std::size_t k = 0; k < 4; ++k) others.right[k] -= bead.right[k];
      const std::optional<Terms> without = solved(model, others);
      if (!without) return HUGE_VAL;
      variance += std::pow(dot(sum, *without) - dot(sum, best), 2);
    }
    return std::sqrt(variance);
  }

  const FinderCalibration& calibration_;
  double radius_, reach_;  // px
  std::size_t disks_ = 0;  // whole ones
  std::vector<Sums> beads_;
  Sums all_;
};

}  // namespace

bool LensEstimate::by_size_and_shape() const {
  // Drawn lenses: the two differ by up to a sixth of the term, where the first order is not enough.
  constexpr double sigmas = 3, share = 0.25;
  return std::abs(radial_by_size - radial_by_shape) <=
         std::max(sigmas * difference_std_error, share * std::abs(lens.radial));
}

LensEstimate estimate_lens(const std::vector<const GrayFrame*>& frames, const std::vector<FindResult>& found,
                           const FinderCalibration& calibration) {
  LensFit fit(calibration);
  for (std::size_t f = 0; f < frames.size(); ++f) fit.add(*frames[f], found[f]);
  return fit.estimate();
}

}  // namespace shakebed::ingest
