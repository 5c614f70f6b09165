#include "ingest/profile/floor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ingest/frames/smooth_field.hpp"

namespace shakebed::ingest {

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0;
  const auto place = static_cast<std::ptrdiff_t>(std::lround(fraction * static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

namespace {

// By Huber's weights.
Line robust_line(const std::vector<std::pair<double, double>>& points) {
  Line line;
  if (points.empty()) return line;
  std::vector<double> heights;
  for (const auto& point : points) heights.push_back(point.second);
  line.offset = quantile(heights, 0.5);
  if (points.size() < 4) return line;
  for (int round = 0; round < 30; ++round) {
    std::vector<double> sizes;
    for (const auto& [x, y] : points) sizes.push_back(std::abs(y - line.offset - line.slope * x));
    const double spread = std::max(0.02, 1.4826 * quantile(sizes, 0.5));
    double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
    for (const auto& [x, y] : points) {
      const double size = std::abs(y - line.offset - line.slope * x) / spread;
      const double weight = size < 1.5 ? 1 : size > 6 ? 0 : 1.5 / size;
      w += weight;
      wx += weight * x;
      wy += weight * y;
      wxx += weight * x * x;
      wxy += weight * x * y;
    }
    const double determinant = w * wxx - wx * wx;
    if (!(determinant > 1e-9 * w * wxx)) break;
    line.slope = (w * wxy - wx * wy) / determinant;
    line.offset = (wy - line.slope * wx) / w;
    double square = 0;
    for (const auto& [x, y] : points)
      square += std::min(std::pow(y - line.offset - line.slope * x, 2), 36 * spread * spread);
    const double variance = std::max(spread * spread, square / (static_cast<double>(points.size()) - 2));
    line.slope_std_error = std::sqrt(variance * w / determinant);
    line.middle = {wx / w, wy / w};
    line.middle_std_error = std::sqrt(variance / w);
  }
  return line;
}

}  // namespace

FloorPoints lowest_points(const std::vector<FrameFindings>& frames, double diameter_px, int width) {
  const std::size_t columns = std::max<std::size_t>(1, static_cast<std::size_t>(width / (1.5 * diameter_px)));
  std::vector<std::vector<std::pair<double, double>>> lowest(columns);  // (bottom, x) per frame
  for (const FrameFindings& frame : frames) {
    std::vector<std::pair<double, double>> best(columns, {-1, 0});
    frame.for_each_disk([&](const FoundDisk& disk) {
      const double bottom = disk.y_px + disk.radius_px;
      const auto column = std::min(
          columns - 1, static_cast<std::size_t>(std::max(0.0, disk.x_px) / width * static_cast<double>(columns)));
      if (bottom > best[column].first) best[column] = {bottom, disk.x_px};
    });
    for (std::size_t c = 0; c < columns; ++c)
      if (best[c].first > 0) lowest[c].push_back(best[c]);
  }
  FloorPoints points;
  for (auto& column : lowest) {
    if (column.empty()) continue;
    std::sort(column.begin(), column.end());
    const auto& chosen = column[static_cast<std::size_t>(0.95 * static_cast<double>(column.size() - 1))];
    points.emplace_back(chosen.second, chosen.first);
  }
  return points;
}

Line find_floor(const std::vector<FrameFindings>& frames, double diameter_px, int width) {
  const FloorPoints points = lowest_points(frames, diameter_px, width);
  // Columns without beads at the floor would pull the line up: start from the lower half.
  std::vector<double> heights;
  for (const auto& point : points) heights.push_back(point.second);
  const double typical = quantile(heights, 0.6);
  std::vector<std::pair<double, double>> low;
  for (const auto& point : points)
    if (point.second > typical - 0.6 * diameter_px) low.push_back(point);
  Line line = robust_line(low);
  // Some ten columns of a bed that flies do not lie on a line: a tilt is believed beyond its error only (1 in 200 for
  // Student's t of 8 degrees of freedom).
  constexpr double believed = 4;
  if (std::abs(line.slope) < believed * line.slope_std_error) {
    line.slope = 0;
    line.offset = line.middle.second;
  }
  return line;
}

LowestBottoms lowest_bottoms(const FrameFindings& frame, double slope, double diameter_px, int width) {
  const std::size_t columns = std::max<std::size_t>(1, static_cast<std::size_t>(width / (1.5 * diameter_px)));
  LowestBottoms bottoms{frame.report.index, std::vector<double>(columns, -1e9)};
  frame.for_each_disk([&](const FoundDisk& disk) {
    const auto column = std::min(
        columns - 1, static_cast<std::size_t>(std::max(0.0, disk.x_px) / width * static_cast<double>(columns)));
    bottoms.y[column] = std::max(bottoms.y[column], disk.y_px + disk.radius_px - slope * disk.x_px);
  });
  std::erase_if(bottoms.y, [](double y) { return y < -1e8; });
  return bottoms;
}

double bottom_range(const std::vector<FrameFindings>& frames, double slope, double diameter_px, int width) {
  std::vector<double> lowest;
  for (const FrameFindings& frame : frames) {
    std::vector<double> y = lowest_bottoms(frame, slope, diameter_px, width).y;
    if (y.size() < 2) continue;
    std::nth_element(y.begin(), y.end() - 2, y.end());
    lowest.push_back(y[y.size() - 2]);
  }
  return quantile(lowest, 0.95) - quantile(lowest, 0.05);
}

std::optional<PlaceInFrame> bottom_of(const LowestBottoms& bottoms) {
  constexpr double low = 0.75;
  if (bottoms.y.empty()) return std::nullopt;
  return PlaceInFrame{bottoms.frame, quantile(bottoms.y, low)};
}

namespace {

// A bottom and its phase in the shaker's period.
struct Bottom {
  double y, sine, cosine;
  std::size_t part;  // of the period
};
constexpr std::size_t parts_of_period = 12;  // of the period
constexpr std::size_t fewest_bottoms = 30;
constexpr double least_contact_tolerance = 0.02;  // D: what touching beads scatter
// Of the step from this tolerance to none. In 40 simulated beds the floor was then off by 0.3 of the step (root mean
// square; beads located to 0.003 and 0.01 D), and by 0.6 with beads located to 0.02 D.
constexpr double step_to_no_tolerance_wrong = 0.4;
// The amplitude is stated as the middle is: in 23 films of 12 other beds it was off by half of that (root mean square).
// Bottoms at one phase of the period and half a period later tell the floor there alone. 1 when there are no others;
// each phase may be spread over a twelfth of the period.
constexpr double at_opposite_phases = 0.95;

std::vector<Bottom> bottoms_by_phase(const std::vector<LowestBottoms>& frames, double turns_per_frame) {
  std::vector<Bottom> bottoms;
  for (const LowestBottoms& frame : frames) {
    const double turns = static_cast<double>(frame.frame) * turns_per_frame;
    const double phase = turns - std::floor(turns);
    for (const double y : frame.y)
      bottoms.push_back({y, std::sin(2 * std::numbers::pi * phase), std::cos(2 * std::numbers::pi * phase),
                         std::min(parts_of_period - 1, static_cast<std::size_t>((phase + 1e-9) * parts_of_period))});
  }
  return bottoms;
}

// middle, sine and cosine of the floor's motion.
using FloorTerms = std::vector<double>;

double gap_above(const FloorTerms& fit, const Bottom& bottom) {
  return fit[0] - fit[1] * bottom.sine - fit[2] * bottom.cosine - bottom.y;
}

// One round of least squares, with the weights that the last one leaves. False when it cannot be solved.
bool fit_floor_once(const std::vector<Bottom>& bottoms, double tolerance, FloorTerms& fit) {
  std::vector<double> matrix(9, 0.0), right(3, 0.0);
  for (const Bottom& bottom : bottoms) {
    const double above = std::max(0.0, gap_above(fit, bottom)) / tolerance;
    const double weight = std::exp(-above * above);
    const double row[3] = {1, -bottom.sine, -bottom.cosine};
    for (std::size_t a = 0; a < 3; ++a) {
      right[a] += weight * row[a] * bottom.y;
      for (std::size_t b = 0; b < 3; ++b) matrix[a * 3 + b] += weight * row[a] * row[b];
    }
  }
  for (std::size_t a = 0; a < 3; ++a) matrix[a * 4] += 1e-6 * matrix[0];
  if (!solve_symmetric(matrix, right, 3)) return false;
  fit = right;
  return true;
}

// Rounds of least squares while the tolerance shrinks to the least, and stays there.
bool narrow_tolerance(const std::vector<Bottom>& bottoms, double tolerance, double least, FloorTerms& fit) {
  constexpr int rounds = 40;
  for (int round = 0; round < rounds; ++round) {
    tolerance = std::max(least, 0.85 * tolerance);
    if (!fit_floor_once(bottoms, tolerance, fit)) return false;
  }
  return true;
}

// The longest stretch of the period without a touching bead.
std::size_t longest_stretch_without(const std::vector<std::size_t>& touching) {
  std::size_t longest = 0, empty = 0;
  for (std::size_t k = 0; k < 2 * parts_of_period; ++k) {
    empty = touching[k % parts_of_period] ? 0 : empty + 1;
    longest = std::max(longest, empty);
  }
  return longest;
}

}  // namespace

FloorMotion find_floor_motion(const std::vector<LowestBottoms>& frames, double diameter_px, double turns_per_frame) {
  const std::vector<Bottom> bottoms = bottoms_by_phase(frames, turns_per_frame);
  FloorMotion motion;
  if (bottoms.size() < fewest_bottoms) return motion;
  std::vector<double> heights;
  for (const Bottom& bottom : bottoms) heights.push_back(bottom.y);
  FloorTerms fit = {quantile(heights, 0.9), 0, 0};
  const double least = least_contact_tolerance * diameter_px;
  if (!narrow_tolerance(bottoms, diameter_px, 2 * least, fit)) return motion;
  const FloorTerms wide = fit;
  if (!narrow_tolerance(bottoms, 2 * least, least, fit)) return motion;
  // Beads that come and go are as frequent at each small distance, so the floor is too high by the tolerance's share.
  const double narrow_middle = fit[0];
  for (std::size_t k = 0; k < fit.size(); ++k) fit[k] = 2 * fit[k] - wide[k];
  std::vector<std::size_t> touching(parts_of_period, 0);
  double squares = 0, twice_cosine = 0, twice_sine = 0;  // the latter of twice the phase
  for (const Bottom& bottom : bottoms) {
    const double gap = gap_above(fit, bottom);
    if (gap >= 2 * least) continue;
    ++touching[bottom.part], ++motion.touching;
    squares += gap * gap;
    twice_cosine += bottom.cosine * bottom.cosine - bottom.sine * bottom.sine;
    twice_sine += 2 * bottom.cosine * bottom.sine;
  }
  motion.middle = fit[0];
  motion.middle_std_error =
      std::hypot(std::sqrt(squares) / static_cast<double>(std::max<std::size_t>(1, motion.touching)),
                 step_to_no_tolerance_wrong * (fit[0] - narrow_middle));
  motion.amplitude = std::hypot(fit[1], fit[2]);
  motion.amplitude_std_error = motion.middle_std_error;
  const double turns = std::atan2(fit[2], fit[1]) / (2 * std::numbers::pi);
  motion.phase = turns - std::floor(turns);
  // Beyond half a period without a touching bead nothing bounds the fit there.
  motion.known = longest_stretch_without(touching) <= parts_of_period / 2 &&
                 std::hypot(twice_cosine, twice_sine) <= at_opposite_phases * static_cast<double>(motion.touching);
  return motion;
}

}  // namespace shakebed::ingest
