// Maps of places that look like a bead, against the same sums pixel by pixel; the estimated noise of a frame.
#include "ingest/find/disk_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <opencv2/core.hpp>
#include <vector>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/candidates.hpp"
#include "ingest/find/joint_fit.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

using test::even_frame;
using test::frame_by;

// Levels as a map sees them: 0 outside and where nothing is seen, never far beyond background and bead.
double seen_by_map(const GrayFrame& small, int column, int row) {
  if (column < 0 || row < 0 || column >= small.width || row >= small.height || unseen(small.at(column, row))) return 0;
  return std::clamp(static_cast<double>(small.at(column, row)), -0.6, 1.6);
}

// The rule stated in disk_map.cpp: how much better an ideal disk does than nothing, 1 - chi^2/area, and the mean of the
// ring inside the rim less that of the ring outside.
double score_of_ideal_disk(const GrayFrame& small, double radius, int x, int y) {
  const double ring = std::clamp(0.25 * radius, 1.0, 2.0), outer = radius + ring, inner = std::max(0.4, radius - ring);
  double in_ring = 0, in_count = 0, out_ring = 0, out_count = 0, squares = 0, area = 0;
  const int reach = static_cast<int>(std::ceil(outer));
  for (int dy = -reach; dy <= reach; ++dy)
    for (int dx = -reach; dx <= reach; ++dx) {
      const double squared = dx * dx + dy * dy, level = seen_by_map(small, x + dx, y + dy);
      if (squared > outer * outer) continue;
      const bool in_disk = squared <= radius * radius;
      squares += (level - in_disk) * (level - in_disk);
      area += in_disk;
      if (!in_disk) out_ring += level, ++out_count;
      if (in_disk && squared > inner * inner) in_ring += level, ++in_count;
    }
  return 1 - squares / area + in_ring / std::max(1.0, in_count) - out_ring / std::max(1.0, out_count);
}

// The local maxima of a map of `small` and the margin around it, best first; of two that are too near the better.
template <class MapAt>
std::vector<DiskCandidate> maxima_by_hand(const GrayFrame& small, int factor, double radius, double least_score,
                                          double least_distance, const MapAt& map_at) {
  const int margin = static_cast<int>(std::ceil(0.8 * radius));
  std::vector<DiskCandidate> all, kept;
  for (int y = -margin + 1; y < small.height + margin - 1; ++y)
    for (int x = -margin + 1; x < small.width + margin - 1; ++x) {
      const double here = map_at(x, y);
      bool highest = here >= least_score;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) highest = highest && ((dx == 0 && dy == 0) || map_at(x + dx, y + dy) < here);
      if (!highest) continue;
      const auto between = [&](double low, double high) { return 0.5 * (low - high) / (low - 2 * here + high); };
      all.push_back({(x + between(map_at(x - 1, y), map_at(x + 1, y)) + 0.5) * factor - 0.5,
                     (y + between(map_at(x, y - 1), map_at(x, y + 1)) + 0.5) * factor - 0.5, here});
    }
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.score > b.score; });
  for (const DiskCandidate& one : all)
    if (std::none_of(kept.begin(), kept.end(),
                     [&](const auto& other) { return std::hypot(one.x - other.x, one.y - other.y) < least_distance; }))
      kept.push_back(one);
  return kept;
}

void expect_same(const std::vector<DiskCandidate>& found, const std::vector<DiskCandidate>& expected, double within) {
  ASSERT_EQ(found.size(), expected.size());
  EXPECT_GE(found.size(), 4U);
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_NEAR(found[k].x, expected[k].x, within) << k;
    EXPECT_NEAR(found[k].y, expected[k].y, within) << k;
    EXPECT_NEAR(found[k].score, expected[k].score, within) << k;
  }
}

// A few disks, some cut, over something that is no bead, with levels beyond what a bead has and a part unseen.
GrayFrame busy_frame(int width, int height, double radius) {
  GrayFrame frame = frame_by(width, height, [&](int column, int row) {
    double level = 0.5 * (test::scattered(column, row) - 0.5);
    for (const auto& [x, y] : {std::array{0.5 * width, 0.4 * height},
                               {1.0, 0.8 * height},
                               {width - 0.5, 0.3 * height},
                               {0.3 * width, -1.0},
                               {0.8 * width, height - 0.2}})
      level += std::clamp(radius + 0.5 - std::hypot(column - x, row - y), 0.0, 1.0);
    return level;
  });
  test::set(frame, width / 2, height / 2, 7), test::set(frame, width / 3, height / 2, -7);
  test::set(frame, width / 2 + 2, height / 2, unseen_level);
  return frame;
}

TEST(DiskMap, OfAnIdealDiskHasTheScoreOfItsRule) {
  for (const auto& [radius, factor] : {std::pair{4.3, 1}, {4.7, 3}, {9.4, 2}, {1.4, 1}}) {
    const GrayFrame small = busy_frame(31, 26, radius);
    for (const auto& [least, apart] : {std::pair{0.1, 1.44}, {0.35, 0.1}}) {
      const auto score = [&, r = radius](int x, int y) { return score_of_ideal_disk(small, r, x, y); };
      expect_same(find_candidates({small, factor}, radius * factor, {least, apart * radius * factor}),
                  maxima_by_hand(small, factor, radius, least, apart * radius * factor, score), 2e-3 * factor);
    }
  }
}

TEST(DiskMap, OfAPerfectDiskIsTwo) {
  const GrayFrame frame =
      frame_by(40, 40, [](int column, int row) { return std::hypot(column - 19, row - 21) <= 6 ? 1.0 : 0.0; });
  const auto found = find_candidates({frame, 1}, 6, {0.5, 8});
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].score, 2, 1e-5);
  EXPECT_NEAR(found[0].x, 19, 1e-4);
  EXPECT_NEAR(found[0].y, 21, 1e-4);
  EXPECT_EQ(map_reduction(4), 1);
  EXPECT_EQ(map_reduction(8.9), 1);
  EXPECT_EQ(map_reduction(9), 2);
  EXPECT_EQ(map_reduction(45.1), 10);
}

using Field = std::vector<std::vector<std::complex<double>>>;
// Fourier's sums along rows and columns, as they are written down.
Field transformed(const Field& from, double sign) {
  const auto along = [&](const Field& field) {
    Field to(field.front().size(), std::vector<std::complex<double>>(field.size()));
    const std::size_t size = field.front().size();
    for (std::size_t r = 0; r < field.size(); ++r)
      for (std::size_t k = 0; k < size; ++k)
        for (std::size_t n = 0; n < size; ++n)
          to[k][r] += field[r][n] * std::polar(1.0, sign * 2 * std::numbers::pi * static_cast<double>(k * n % size) /
                                                        static_cast<double>(size));
    return to;
  };
  return along(along(from));
}

// Wiener's filter for beads at random: conj(P)/(|P|^2 + sigma^2/n), as narrow as a Gaussian of 0.9 px.
TEST(DiskMap, OfALearnedBeadIsWienersFilter) {
  for (const auto& [factor, noise] : {std::pair{1, 0.1}, {2, 0.02}}) {
    const double radius = 4.4;
    BeadProfile profile;
    profile.step_px = 0.1;
    for (int k = 0; k < 66 * factor; ++k)
      profile.level.push_back(static_cast<float>(std::clamp(radius + 0.9 - 0.1 * k / factor, 0.0, 1.0)));
    const GrayFrame small = busy_frame(23, 20, radius);
    const int reach = static_cast<int>(std::ceil(profile.reach_px() / factor)), margin = 4;
    const int wide = cv::getOptimalDFTSize(23 + 2 * (margin + reach)),
              high = cv::getOptimalDFTSize(20 + 2 * (margin + reach));
    Field frame(static_cast<std::size_t>(high), std::vector<std::complex<double>>(static_cast<std::size_t>(wide)));
    Field bead = frame;
    for (int row = 0; row < high; ++row)
      for (int column = 0; column < wide; ++column) {
        const auto r = static_cast<std::size_t>(row), c = static_cast<std::size_t>(column);
        frame[r][c] = seen_by_map(small, column, row);
        const int dx = column < wide / 2 ? column : column - wide, dy = row < high / 2 ? row : row - high;
        for (int j = 0; j < factor; ++j)
          for (int i = 0; i < factor; ++i) {
            const double away = std::hypot(dx * factor + i - 0.5 * (factor - 1), dy * factor + j - 0.5 * (factor - 1));
            const auto cell = static_cast<std::size_t>(away / 0.1);
            if (std::abs(dx) <= reach && std::abs(dy) <= reach && cell < profile.level.size())
              bead[r][c] += static_cast<double>(profile.level[cell]) / (factor * factor);
          }
      }
    const Field image = transformed(frame, -1), kernel = transformed(bead, -1);
    const double sigma = std::max(noise / factor, 0.03), density = 0.25 / (radius * radius);
    Field filtered = image;
    double lone = 0;
    for (std::size_t r = 0; r < filtered.size(); ++r)
      for (std::size_t c = 0; c < filtered[r].size(); ++c) {
        const auto wave = [](std::size_t k, int size) {
          return 2 * std::numbers::pi * std::min(static_cast<double>(k), size - static_cast<double>(k)) / size;
        };
        const double spot = std::exp(-0.5 * 0.81 * (std::pow(wave(r, high), 2) + std::pow(wave(c, wide), 2)));
        const double weight = spot / (std::norm(kernel[r][c]) + sigma * sigma / density);
        filtered[r][c] = weight * image[r][c] * std::conj(kernel[r][c]);
        lone += weight * std::norm(kernel[r][c]);
      }
    const Field map = transformed(filtered, 1);
    const auto at = [&](int x, int y) {
      return map[static_cast<std::size_t>((y + high) % high)][static_cast<std::size_t>((x + wide) % wide)].real() /
             lone;
    };
    expect_same(find_matched_candidates({small, factor}, profile, radius * factor, noise, {0.15, 3.0 * factor}),
                maxima_by_hand(small, factor, radius, 0.15, 3.0 * factor, at), 2e-3 * factor);
  }
}

// --- candidates.hpp --------------------------------------------------------------------------------------------------

TEST(Candidates, LieInThePartThatIsSeen) {
  GrayFrame flat = even_frame(20, 10, 0);
  test::set(flat, 3, 4, unseen_level), test::set(flat, 0, 0, unseen_level), test::set(flat, 19, 9, unseen_level);
  const auto left = seen_ones(flat, {{3.4, 4.4, 1},
                                     {3.6, 4, 1},
                                     {3, 3.4, 1},
                                     {0, 0, 1},
                                     {-0.6, 0, 1},
                                     {0, -0.6, 1},
                                     {19.2, 9.3, 1},
                                     {19.6, 9, 1},
                                     {19, 9.6, 1}});
  std::vector<double> x;
  for (const DiskCandidate& one : left) x.push_back(one.x);
  EXPECT_EQ(x, (std::vector<double>{3.6, 3, -0.6, 0, 19.6, 19}));
}

// Second differences of a row that goes up and down by one: 2, of one in which a third of the pixels are higher by 1:
// 1, 1 and 2.
TEST(Candidates, NoiseIsThatOfSecondDifferences) {
  const double unit = 1.4826 / std::sqrt(6.0);
  const auto up_and_down = [](int column, int row) { return 0.7 * column + row + column % 2; };
  EXPECT_NEAR(noise_of(frame_by(30, 20, up_and_down)), 2 * unit, 1e-4);
  const auto thirds = [](int column, int row) { return column % 3 == 0 ? row + 1.0 : row; };
  EXPECT_NEAR(noise_of(frame_by(32, 20, thirds)), unit, 1e-6);
  GrayFrame hidden = frame_by(30, 20, up_and_down);
  for (int row = 0; row < 20; ++row)
    for (int column = 3; column < 24; ++column) test::set(hidden, column, row, unseen_level);
  EXPECT_NEAR(noise_of(hidden), 2 * unit, 1e-4);
  // Of large frames every second row and column is looked at.
  EXPECT_NEAR(noise_of(frame_by(400, 250, [](int column, int) { return column % 2 ? 0.5 * (column % 4) : 0; })), unit,
              1e-6);
}

// Normal noise of 0.05 by its quantiles: the mean of the smaller half tells it, and so does the median; three levels
// alone tell it by their mean only.
TEST(Candidates, NoiseOfAResidualIsThatOfItsSmallerHalf) {
  const auto fit_of = [](const GrayFrame& flat) {
    JointFit fit(flat);
    return fit;
  };
  std::vector<double> sizes;
  for (int k = 0; k < 2400; ++k) {  // |normal| <= s with probability erf(s/sqrt 2)
    double low = 0, high = 6;
    for (int round = 0; round < 50; ++round) {
      const double middle = 0.5 * (low + high);
      (std::erf(middle / std::sqrt(2.0)) < (k + 0.5) / 2400 ? low : high) = middle;
    }
    sizes.push_back(low);
  }
  GrayFrame flat = frame_by(60, 40, [&](int column, int row) {
    const int k = (row * 60 + column) * 7 % 2400;
    return (k % 2 ? 0.05 : -0.05) * sizes[static_cast<std::size_t>(k)];
  });
  EXPECT_NEAR(residual_noise(fit_of(flat)), 0.05, 1e-4);
  EXPECT_NEAR(residual_spread(fit_of(flat)), 0.05, 1e-4);
  for (int row = 0; row < 40; ++row) test::set(flat, 5, row, unseen_level);
  EXPECT_NEAR(residual_noise(fit_of(flat)), 0.05, 1e-3);
  EXPECT_NEAR(residual_spread(fit_of(flat)), 0.05, 1e-3);
  // Sizes 0, 1 and 2 for a third each, but for the first column, of which every second pixel is looked at: of the 1,190
  // of the smaller half 780 are 0.
  const GrayFrame steps = frame_by(60, 40, [](int column, int) { return column % 3; });
  EXPECT_NEAR(residual_noise(fit_of(steps)), 410.0 / 1190 / 0.32465, 1e-6);
  EXPECT_NEAR(residual_spread(fit_of(steps)), 1.4826, 1e-6);
  EXPECT_EQ(residual_noise(fit_of(even_frame(1, 1, 3))), 0);
  // Of a large frame every second row and column is looked at, but not the same columns in all rows: of sizes 1 and 0.4
  // in turn half are 0.4.
  const GrayFrame stripes = frame_by(400, 220, [](int column, int) { return column % 2 ? 0.4 : 1; });
  EXPECT_NEAR(residual_noise(fit_of(stripes)), 0.4 / 0.32465, 1e-6);
}

// A disk of learned profile is looked for by the ideal disk unless it is strongly blurred, or hollow.
TEST(Candidates, AreLookedForByTheIdealDiskUnlessBlurredOrHollow) {
  const double radius = 6;
  BeadProfile filled, hollow;
  filled.step_px = hollow.step_px = 0.1;
  for (int k = 0; k < 80; ++k) {
    const double r = 0.1 * k, edge = std::clamp(radius + 0.5 - r, 0.0, 1.0);
    filled.level.push_back(static_cast<float>(edge));
    hollow.level.push_back(static_cast<float>(r < 4.5 ? 0.1 : edge));
  }
  const GrayFrame flat = busy_frame(50, 44, radius);
  const auto same = [](const std::vector<DiskCandidate>& a, const std::vector<DiskCandidate>& b) {
    bool all = a.size() == b.size();
    for (std::size_t k = 0; all && k < a.size(); ++k) all = a[k].score == b[k].score && a[k].x == b[k].x;
    return all;
  };
  const auto ideal = candidates_in(flat, radius, 0.02, 0.3);
  EXPECT_TRUE(same(candidates_by({filled, radius, 0.13 * radius}, flat, 0.02, 0.3), ideal));
  const double apart = 2 * radius * 0.72;
  EXPECT_TRUE(same(candidates_by({filled, radius, 0.15 * radius}, flat, 0.02, 0.3),
                   find_matched_candidates({flat, 1}, filled, radius, 0.02, {0.3, apart})));
  EXPECT_TRUE(same(candidates_by({hollow, radius, 0.13 * radius}, flat, 0.02, 0.3),
                   find_matched_candidates({flat, 1}, hollow, radius, 0.02, {0.3, apart})));
  // The ideal disk's map is that of the frame, or of the smoothed frame where noise is 0.04 or more.
  EXPECT_TRUE(same(ideal, find_candidates({flat, 1}, radius, {0.3, apart})));
  const auto noisy = candidates_in(flat, radius, 0.041, 0.3);
  EXPECT_FALSE(same(noisy, ideal));
  EXPECT_TRUE(same(candidates_in(flat, 3.4, 0.041, 0.3), find_candidates({flat, 1}, 3.4, {0.3, 2 * 3.4 * 0.72})));
  EXPECT_FALSE(same(candidates_in(flat, 3.6, 0.041, 0.3), find_candidates({flat, 1}, 3.6, {0.3, 2 * 3.6 * 0.72})));
}

}  // namespace
}  // namespace shakebed::ingest
