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

// Scores of centres. Pixel (margin, margin) is the first of the reduced frame: centres this far outside are looked at.
struct ScoreMap {
  int margin, width, height;
  std::vector<float> score;

  ScoreMap(const GrayFrame& small, double radius)
      : margin(static_cast<int>(std::ceil(0.8 * radius))),
        width(small.width + 2 * margin),
        height(small.height + 2 * margin),
        score(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

  float* row(int at) { return score.data() + static_cast<std::size_t>(at) * static_cast<std::size_t>(width); }
  [[nodiscard]] const float* row(int at) const {
    return score.data() + static_cast<std::size_t>(at) * static_cast<std::size_t>(width);
  }
};

// A pixel as the maps take it: without extremes, 0 where nothing is seen.
float bounded(float level) { return unseen(level) ? 0.0F : std::min(1.6F, std::max(-0.6F, level)); }

// Of a parabola through three values, from the middle one.
double top_of(float low, float middle, float high) {
  const double bend = static_cast<double>(low) - 2 * static_cast<double>(middle) + static_cast<double>(high);
  return bend < 0 ? std::clamp(0.5 * (static_cast<double>(low) - static_cast<double>(high)) / bend, -0.5, 0.5) : 0.0;
}

// Local maxima, the best first.
std::vector<DiskCandidate> maxima_of(const ScoreMap& map, int factor, double least_score) {
  std::vector<DiskCandidate> maxima;
  const float least = static_cast<float>(least_score);
  for (int row = 1; row + 1 < map.height; ++row) {
    const float *a = map.row(row - 1), *b = map.row(row), *c = map.row(row + 1);
    for (int column = 1; column + 1 < map.width; ++column) {
      const float here = b[column];
      if (here < least) continue;
      if (here <= b[column - 1] || here < b[column + 1] || here <= a[column] || here < c[column] ||
          here <= a[column - 1] || here <= a[column + 1] || here < c[column - 1] || here < c[column + 1])
        continue;
      const double x = column - map.margin + top_of(b[column - 1], here, b[column + 1]);
      const double y = row - map.margin + top_of(a[column], here, c[column]);
      maxima.push_back({(x + 0.5) * factor - 0.5, (y + 0.5) * factor - 0.5, static_cast<double>(here)});
    }
  }
  std::sort(maxima.begin(), maxima.end(), [](const DiskCandidate& a, const DiskCandidate& b) {
    if (a.score != b.score) return a.score > b.score;
    if (a.y != b.y) return a.y < b.y;
    return a.x < b.x;
  });
  return maxima;
}

// The better of two that are too near, by a grid of cells as wide as that distance.
std::vector<DiskCandidate> without_near_ones(const std::vector<DiskCandidate>& best_first, double least_distance_px) {
  std::unordered_map<std::int64_t, std::vector<std::size_t>> cells;
  const auto cell_of = [&](double value) { return static_cast<std::int64_t>(std::floor(value / least_distance_px)); };
  const auto key = [](std::int64_t column, std::int64_t row) { return row * 0x100000000LL + column; };
  std::vector<DiskCandidate> kept;
  const auto is_free = [&](const DiskCandidate& candidate) {
    const std::int64_t column = cell_of(candidate.x), row = cell_of(candidate.y);
    for (std::int64_t y = row - 1; y <= row + 1; ++y)
      for (std::int64_t x = column - 1; x <= column + 1; ++x) {
        const auto found = cells.find(key(x, y));
        if (found == cells.end()) continue;
        for (const std::size_t other : found->second)
          if (std::hypot(kept[other].x - candidate.x, kept[other].y - candidate.y) < least_distance_px) return false;
      }
    return true;
  };
  for (const DiskCandidate& candidate : best_first) {
    if (!is_free(candidate)) continue;
    cells[key(cell_of(candidate.x), cell_of(candidate.y))].push_back(kept.size());
    kept.push_back(candidate);
  }
  return kept;
}

std::vector<DiskCandidate> candidates_of(const ScoreMap& map, int factor, const CandidateLimits& limits) {
  return without_near_ones(maxima_of(map, factor, limits.least_score), limits.least_distance_px);
}

// Running sums of levels and of their squares along rows, so that a chord costs two look-ups. `pad` pixels of nothing
// lie round the frame.
struct RunningSums {
  std::size_t stride;
  std::vector<float> levels, squares;

  RunningSums(const GrayFrame& small, int pad)
      : stride(static_cast<std::size_t>(small.width + 2 * pad) + 1),
        levels(stride * static_cast<std::size_t>(small.height + 2 * pad), 0.0F),
        squares(levels.size(), 0.0F) {
    for (int row = 0; row < small.height; ++row) {
      const float* from = small.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(small.width);
      const std::size_t first = static_cast<std::size_t>(row + pad) * stride + static_cast<std::size_t>(pad);
      float *level = levels.data() + first, *square = squares.data() + first;
      float sum = 0, sum_of_squares = 0;
      for (int column = 0; column < small.width; ++column) {
        const float value = bounded(from[column]);
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
  }
};

// A circle in whole pixels: half its chord in each row from -reach to reach, -1 where there is none.
struct PixelCircle {
  std::vector<int> half;
  double area = 0;

  PixelCircle(double radius, int reach) {
    for (int dy = -reach; dy <= reach; ++dy) {
      const double squared = radius * radius - dy * dy;
      half.push_back(squared >= 0 ? static_cast<int>(std::floor(std::sqrt(squared))) : -1);
      if (half.back() >= 0) area += 2 * half.back() + 1;
    }
  }
};

// The bead as a frame reduced by `factor` shows it, centred on pixel (reach, reach).
void draw_bead(const BeadProfile& profile, int factor, int reach, cv::Mat& to) {
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
      to.at<float>(dy + reach, dx + reach) = static_cast<float>(sum / (factor * factor));
    }
}

// Multiplies the spectrum of the frame by Wiener's filter W = conj(P)/(|P|^2 + ridge) for centres drawn as Gaussians of
// `spot` px, P being the spectrum of the bead. Returns the peak that a lone bead then has.
double filter(cv::Mat& frame, const cv::Mat& bead, float ridge) {
  constexpr double spot = 0.9;
  const int wide = frame.cols, high = frame.rows;
  const auto spot_at = [](int k, int size) {
    const double wave = 2 * std::numbers::pi * std::min(k, size - k) / size;
    return static_cast<float>(std::exp(-0.5 * spot * spot * wave * wave));
  };
  std::vector<float> along_x(static_cast<std::size_t>(wide));
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
  return lone_peak;
}

}  // namespace

// Score: 1 - chi^2/area of the ideal disk over its surroundings, plus the contrast between the ring just inside the rim
// and the ring just outside. The first alone cannot tell a shaded bead of a crystal from the void between three of
// them, the second alone is lost in a strongly blurred crystal.
std::vector<DiskCandidate> find_candidates(const ReducedFrame& small, double radius_px, const CandidateLimits& limits) {
  const double radius = radius_px / small.factor;
  const double ring = std::clamp(0.25 * radius, 1.0, 2.0);
  const int reach = static_cast<int>(std::floor(radius + ring));
  ScoreMap map(small.frame, radius);
  const int pad = map.margin + reach + 2, shift = pad - map.margin;
  const RunningSums sums(small.frame, pad);
  const PixelCircle inner(std::max(0.4, radius - ring), reach), disk(radius, reach), outer(radius + ring, reach);
  const float inner_weight = static_cast<float>(1 / std::max(1.0, disk.area - inner.area));
  const float outer_weight = static_cast<float>(1 / std::max(1.0, outer.area - disk.area));
  const float square_weight = static_cast<float>(1 / disk.area);
  const float disk_weight = inner_weight + outer_weight + 2 * square_weight;
  const int map_width = map.width;
  for (int row = 0; row < map.height; ++row) {
    float* to = map.row(row);
    for (int dy = -reach; dy <= reach; ++dy) {
      const std::size_t source =
          static_cast<std::size_t>(row + shift + dy) * sums.stride + static_cast<std::size_t>(shift);
      const auto at = static_cast<std::size_t>(dy + reach);
      // Only what changes with the column is left in the inner loops: chords as differences of running sums.
      const float* outer_low = sums.levels.data() + source - outer.half[at];
      const float* outer_high = sums.levels.data() + source + outer.half[at] + 1;
      const float* square_low = sums.squares.data() + source - outer.half[at];
      const float* square_high = sums.squares.data() + source + outer.half[at] + 1;
      for (int column = 0; column < map_width; ++column)
        to[column] -= outer_weight * (outer_high[column] - outer_low[column]) +
                      square_weight * (square_high[column] - square_low[column]);
      if (disk.half[at] < 0) continue;
      const float* low = sums.levels.data() + source - disk.half[at];
      const float* high_end = sums.levels.data() + source + disk.half[at] + 1;
      if (inner.half[at] < 0) {
        for (int column = 0; column < map_width; ++column) to[column] += disk_weight * (high_end[column] - low[column]);
        continue;
      }
      const float* inner_low = sums.levels.data() + source - inner.half[at];
      const float* inner_high = sums.levels.data() + source + inner.half[at] + 1;
      for (int column = 0; column < map_width; ++column)
        to[column] +=
            disk_weight * (high_end[column] - low[column]) - inner_weight * (inner_high[column] - inner_low[column]);
    }
  }
  return candidates_of(map, small.factor, limits);
}

std::vector<DiskCandidate> find_matched_candidates(const ReducedFrame& small, const BeadProfile& profile,
                                                   double radius_px, double noise, const CandidateLimits& limits) {
  const int factor = small.factor;
  const double radius = radius_px / factor;
  const int reach = static_cast<int>(std::ceil(profile.reach_px() / factor));
  ScoreMap map(small.frame, radius);
  const int wide = cv::getOptimalDFTSize(map.width + 2 * reach), high = cv::getOptimalDFTSize(map.height + 2 * reach);
  cv::Mat frame = cv::Mat::zeros(high, wide, CV_32F), bead = cv::Mat::zeros(high, wide, CV_32F);
  for (int row = 0; row < small.frame.height; ++row) {
    const float* from =
        small.frame.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(small.frame.width);
    float* to = frame.ptr<float>(row + map.margin) + map.margin;
    for (int column = 0; column < small.frame.width; ++column) to[column] = bounded(from[column]);
  }
  draw_bead(profile, factor, reach, bead);
  cv::dft(frame, frame, cv::DFT_COMPLEX_OUTPUT, map.margin + small.frame.height);
  cv::dft(bead, bead, cv::DFT_COMPLEX_OUTPUT, 2 * reach + 1);  // few rows hold anything
  // The ridge is sigma^2/n for centres strewn at density n.
  constexpr double model_error = 0.03;
  const double sigma = std::max(noise / factor, model_error), density = 0.25 / (radius * radius);
  const double lone_peak = filter(frame, bead, static_cast<float>(sigma * sigma / density));
  cv::Mat centres;
  cv::dft(frame, centres, cv::DFT_INVERSE | cv::DFT_REAL_OUTPUT);  // not divided by the size, as lone_peak is not
  const float scale = static_cast<float>(1 / lone_peak);
  for (int row = 0; row < map.height; ++row) {
    const float* from = centres.ptr<float>((row - reach + high) % high);
    float* to = map.row(row);
    for (int column = 0; column < map.width; ++column) to[column] = scale * from[(column - reach + wide) % wide];
  }
  return candidates_of(map, factor, limits);
}

}  // namespace shakebed::ingest
