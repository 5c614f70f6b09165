#include "ingest/find/disk_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <opencv2/core.hpp>
#include <unordered_map>

#include "ingest/calibrate/solid_borders.hpp"

namespace shakebed::ingest {

int map_reduction(double radius_px) { return std::max(1, static_cast<int>(radius_px / 4.5)); }

namespace {

// Local maxima of a map whose pixel (margin, margin) is the first of the reduced frame, best first, the better kept of
// two that are too near.
std::vector<DiskCandidate> maxima_of(const std::vector<float>& map, int map_width, int map_height, int margin,
                                     int factor, double least_score, double least_distance_px) {
  const std::size_t map_stride = static_cast<std::size_t>(map_width);
  std::vector<DiskCandidate> maxima;
  const float least = static_cast<float>(least_score);
  for (int row = 1; row + 1 < map_height; ++row) {
    const float* b = map.data() + static_cast<std::size_t>(row) * map_stride;
    const float* a = b - map_stride;
    const float* c = b + map_stride;
    for (int column = 1; column + 1 < map_width; ++column) {
      const float here = b[column];
      if (here < least) continue;
      if (here <= b[column - 1] || here < b[column + 1] || here <= a[column] || here < c[column] ||
          here <= a[column - 1] || here <= a[column + 1] || here < c[column - 1] || here < c[column + 1])
        continue;
      const auto offset = [](float low, float middle, float top) {
        const double bend = static_cast<double>(low) - 2 * static_cast<double>(middle) + static_cast<double>(top);
        return bend < 0 ? std::clamp(0.5 * (static_cast<double>(low) - static_cast<double>(top)) / bend, -0.5, 0.5)
                        : 0.0;
      };
      const double x = column - margin + offset(b[column - 1], here, b[column + 1]);
      const double y = row - margin + offset(a[column], here, c[column]);
      maxima.push_back({(x + 0.5) * factor - 0.5, (y + 0.5) * factor - 0.5, static_cast<double>(here)});
    }
  }
  std::sort(maxima.begin(), maxima.end(), [](const DiskCandidate& a, const DiskCandidate& b) {
    if (a.score != b.score) return a.score > b.score;
    if (a.y != b.y) return a.y < b.y;
    return a.x < b.x;
  });
  // Keep the better of two that are too near, by a grid of cells as wide as that distance.
  std::unordered_map<std::int64_t, std::vector<std::size_t>> cells;
  const auto cell_of = [&](double value) { return static_cast<std::int64_t>(std::floor(value / least_distance_px)); };
  const auto key = [](std::int64_t column, std::int64_t row) { return row * 0x100000000LL + column; };
  std::vector<DiskCandidate> kept;
  for (const DiskCandidate& candidate : maxima) {
    const std::int64_t column = cell_of(candidate.x), row = cell_of(candidate.y);
    bool free = true;
    for (std::int64_t y = row - 1; y <= row + 1 && free; ++y)
      for (std::int64_t x = column - 1; x <= column + 1 && free; ++x) {
        const auto found = cells.find(key(x, y));
        if (found == cells.end()) continue;
        for (const std::size_t other : found->second)
          if (std::hypot(kept[other].x - candidate.x, kept[other].y - candidate.y) < least_distance_px) {
            free = false;
            break;
          }
      }
    if (!free) continue;
    cells[key(column, row)].push_back(kept.size());
    kept.push_back(candidate);
  }
  return kept;
}

}  // namespace

std::vector<DiskCandidate> find_candidates(const GrayFrame& small, int factor, double radius_px, double least_score,
                                           double least_distance_px) {
  // Score: 1 - chi^2/area of the ideal disk over its surroundings, plus the contrast between the ring just inside the
  // rim and the ring just outside. The first alone cannot tell a shaded bead of a crystal from the void between three
  // of them, the second alone is lost in a strongly blurred crystal.
  const double radius = radius_px / factor;
  const double ring = std::clamp(0.25 * radius, 1.0, 2.0);
  const double outer_radius = radius + ring, inner_radius = std::max(0.4, radius - ring);
  const int margin = static_cast<int>(std::ceil(0.8 * radius));  // centres this far outside are still looked at
  const int reach = static_cast<int>(std::floor(outer_radius));
  const int pad = margin + reach + 2;
  const int wide = small.width + 2 * pad, high = small.height + 2 * pad;
  const std::size_t stride = static_cast<std::size_t>(wide) + 1;
  // Running sums along rows, so that a chord costs two look-ups.
  std::vector<float> levels(stride * static_cast<std::size_t>(high), 0.0F), squares(levels.size(), 0.0F);
  for (int row = 0; row < small.height; ++row) {
    const float* from = small.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(small.width);
    float* level = levels.data() + static_cast<std::size_t>(row + pad) * stride + static_cast<std::size_t>(pad);
    float* square = squares.data() + (level - levels.data());
    float sum = 0, sum_of_squares = 0;
    for (int column = 0; column < small.width; ++column) {
      const float value = unseen(from[column]) ? 0.0F : std::min(1.6F, std::max(-0.6F, from[column]));
      sum += value;
      sum_of_squares += value * value;
      level[column + 1] = sum;
      square[column + 1] = sum_of_squares;
    }
    for (int column = small.width + 1; column <= small.width + pad; ++column) {
      level[column] = sum;
      square[column] = sum_of_squares;
    }
  }
  // Half chords in whole pixels of the three circles, -1 where there is none, and their areas.
  const auto half_chords = [&](double circle, double& area) {
    std::vector<int> half;
    area = 0;
    for (int dy = -reach; dy <= reach; ++dy) {
      const double squared = circle * circle - dy * dy;
      half.push_back(squared >= 0 ? static_cast<int>(std::floor(std::sqrt(squared))) : -1);
      if (half.back() >= 0) area += 2 * half.back() + 1;
    }
    return half;
  };
  double inner_area = 0, area = 0, outer_area = 0;
  const auto half_inner = half_chords(inner_radius, inner_area), half = half_chords(radius, area),
             half_outer = half_chords(outer_radius, outer_area);
  const int map_width = small.width + 2 * margin, map_height = small.height + 2 * margin;
  const std::size_t map_stride = static_cast<std::size_t>(map_width);
  std::vector<float> map(map_stride * static_cast<std::size_t>(map_height));
  const float inner_weight = static_cast<float>(1 / std::max(1.0, area - inner_area));
  const float outer_weight = static_cast<float>(1 / std::max(1.0, outer_area - area));
  const float square_weight = static_cast<float>(1 / area);
  const float disk_weight = inner_weight + outer_weight + 2 * square_weight;
  const int shift = pad - margin;
  for (int row = 0; row < map_height; ++row) {
    float* to = map.data() + static_cast<std::size_t>(row) * map_stride;
    std::fill(to, to + map_width, 0.0F);
    for (int dy = -reach; dy <= reach; ++dy) {
      const std::size_t source = static_cast<std::size_t>(row + shift + dy) * stride + static_cast<std::size_t>(shift);
      const auto at = static_cast<std::size_t>(dy + reach);
      // Only what changes with the column is left in the inner loops: chords as differences of running sums.
      const float* outer_low = levels.data() + source - half_outer[at];
      const float* outer_high = levels.data() + source + half_outer[at] + 1;
      const float* square_low = squares.data() + source - half_outer[at];
      const float* square_high = squares.data() + source + half_outer[at] + 1;
      for (int column = 0; column < map_width; ++column)
        to[column] -= outer_weight * (outer_high[column] - outer_low[column]) +
                      square_weight * (square_high[column] - square_low[column]);
      if (half[at] < 0) continue;
      const float* low = levels.data() + source - half[at];
      const float* high_end = levels.data() + source + half[at] + 1;
      if (half_inner[at] < 0) {
        for (int column = 0; column < map_width; ++column) to[column] += disk_weight * (high_end[column] - low[column]);
        continue;
      }
      const float* inner_low = levels.data() + source - half_inner[at];
      const float* inner_high = levels.data() + source + half_inner[at] + 1;
      for (int column = 0; column < map_width; ++column)
        to[column] +=
            disk_weight * (high_end[column] - low[column]) - inner_weight * (inner_high[column] - inner_low[column]);
    }
  }

  return maxima_of(map, map_width, map_height, margin, factor, least_score, least_distance_px);
}

std::vector<DiskCandidate> find_matched_candidates(const GrayFrame& small, int factor, const BeadProfile& profile,
                                                   double radius_px, double noise, double least_score,
                                                   double least_distance_px) {
  const double radius = radius_px / factor;
  const int reach = static_cast<int>(std::ceil(profile.reach_px() / factor));
  const int margin = static_cast<int>(std::ceil(0.8 * radius));
  const int wide = cv::getOptimalDFTSize(small.width + 2 * (margin + reach));
  const int high = cv::getOptimalDFTSize(small.height + 2 * (margin + reach));
  cv::Mat frame = cv::Mat::zeros(high, wide, CV_32F), bead = cv::Mat::zeros(high, wide, CV_32F);
  for (int row = 0; row < small.height; ++row) {
    const float* from = small.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(small.width);
    float* to = frame.ptr<float>(row + margin) + margin;
    for (int column = 0; column < small.width; ++column)
      to[column] = unseen(from[column]) ? 0.0F : std::min(1.6F, std::max(-0.6F, from[column]));
  }
  // The bead as the reduced frame shows it, centred on pixel (reach, reach): few rows hold anything.
  const auto level_at = [&](double r) {
    const auto cell = static_cast<std::size_t>(r / profile.step_px);
    return cell < profile.level.size() ? static_cast<double>(profile.level[cell]) : 0.0;
  };
  for (int dy = -reach; dy <= reach; ++dy)
    for (int dx = -reach; dx <= reach; ++dx) {
      double sum = 0;
      for (int j = 0; j < factor; ++j)
        for (int i = 0; i < factor; ++i)
          sum += level_at(std::hypot(dx * factor + i - 0.5 * (factor - 1), dy * factor + j - 0.5 * (factor - 1)));
      bead.at<float>(dy + reach, dx + reach) = static_cast<float>(sum / (factor * factor));
    }
  cv::dft(frame, frame, cv::DFT_COMPLEX_OUTPUT, margin + small.height);
  cv::dft(bead, bead, cv::DFT_COMPLEX_OUTPUT, 2 * reach + 1);
  // W = conj(P)/(|P|^2 + sigma^2/n) for centres strewn at density n, drawn as Gaussians of `spot` px.
  constexpr double spot = 0.9, model_error = 0.03;
  const double sigma = std::max(noise / factor, model_error), density = 0.25 / (radius * radius);
  const float ridge = static_cast<float>(sigma * sigma / density);
  std::vector<float> along_x(static_cast<std::size_t>(wide));
  const auto spot_at = [](int k, int size) {
    const double wave = 2 * std::numbers::pi * std::min(k, size - k) / size;
    return static_cast<float>(std::exp(-0.5 * spot * spot * wave * wave));
  };
  for (int k = 0; k < wide; ++k) along_x[static_cast<std::size_t>(k)] = spot_at(k, wide);
  double lone_peak = 0;
  for (int row = 0; row < high; ++row) {
    cv::Vec2f* field = frame.ptr<cv::Vec2f>(row);
    const cv::Vec2f* kernel = bead.ptr<cv::Vec2f>(row);
    const float along_y = spot_at(row, high);
    float line_peak = 0;
    for (int k = 0; k < wide; ++k) {
      const float p = kernel[k][0], q = kernel[k][1], power = p * p + q * q;
      const float weight = along_y * along_x[static_cast<std::size_t>(k)] / (power + ridge);
      line_peak += weight * power;
      const float real = field[k][0], imaginary = field[k][1];
      field[k] = cv::Vec2f(weight * (real * p + imaginary * q), weight * (imaginary * p - real * q));
    }
    lone_peak += static_cast<double>(line_peak);
  }
  cv::Mat centres;
  cv::dft(frame, centres, cv::DFT_INVERSE | cv::DFT_REAL_OUTPUT);  // not divided by the size, as lone_peak is not
  const int map_width = small.width + 2 * margin, map_height = small.height + 2 * margin;
  std::vector<float> map(static_cast<std::size_t>(map_width) * static_cast<std::size_t>(map_height));
  const float scale = static_cast<float>(1 / lone_peak);
  for (int row = 0; row < map_height; ++row) {
    const float* from = centres.ptr<float>((row - reach + high) % high);
    float* to = map.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(map_width);
    for (int column = 0; column < map_width; ++column) to[column] = scale * from[(column - reach + wide) % wide];
  }
  return maxima_of(map, map_width, map_height, margin, factor, least_score, least_distance_px);
}

}  // namespace shakebed::ingest
