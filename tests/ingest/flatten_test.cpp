// The first estimate of a frame's light: the envelopes of its blocks worked out once more.

#include "ingest/calibrate/flatten.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "ingest/calibrate/solid_borders.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

// The darkest and the brightest of a block, but for 3 % of its pixels, and the level in the middle.
struct LightBlock {
  double u, v, low, high, middle;
};
std::vector<LightBlock> blocks_by_hand(const GrayFrame& frame, int side) {
  std::vector<LightBlock> blocks;
  for (int top = 0; top < frame.height; top += side)
    for (int left = 0; left < frame.width; left += side) {
      const int bottom = std::min(frame.height, top + side), right = std::min(frame.width, left + side);
      const int area = (bottom - top) * (right - left);
      if (3 * area < side * side && !blocks.empty()) continue;  // a strip at the end
      std::vector<float> levels;
      for (int row = top; row < bottom; ++row)
        for (int column = left; column < right; ++column)
          if (frame.at(column, row) < 1e5F) levels.push_back(frame.at(column, row));
      if (levels.size() < static_cast<std::size_t>(std::max(1, area / 3))) continue;
      std::sort(levels.begin(), levels.end());
      const auto rank = [&](double part) {
        return static_cast<double>(levels[static_cast<std::size_t>(part * static_cast<double>(levels.size() - 1))]);
      };
      blocks.push_back({static_cast<double>(left + right) / frame.width - 1,
                        static_cast<double>(top + bottom) / frame.height - 1, rank(0.03), rank(0.97), rank(0.5)});
    }
  return blocks;
}

// 1, u, v, 2u^2 - 1, uv, 2v^2 - 1: three terms for 12 blocks or more, six for 40.
std::array<double, 6> light_terms(double u, double v) { return {1, u, v, 2 * u * u - 1, u * v, 2 * v * v - 1}; }

struct Knot {
  double u, v, level;
  bool exact = false;
};
// Levels on the inner side, by more than 0.03 of the spread, hardly count.
std::vector<double> envelope_by_hand(const std::vector<Knot>& knots, bool from_above) {
  const std::size_t terms = knots.size() >= 40 ? 6 : knots.size() >= 12 ? 3 : 1;
  std::vector<double> levels, fit(terms, 0.0);
  for (const Knot& knot : knots) levels.push_back(knot.level);
  std::sort(levels.begin(), levels.end());
  fit[0] = levels[from_above ? levels.size() * 9 / 10 : levels.size() / 10];
  const double tolerance = 0.03 * std::max(1.0, levels.back() - levels.front());
  for (int round = 0; round < 25; ++round) {
    std::vector<std::vector<double>> normal(terms, std::vector<double>(terms, 0.0));
    std::vector<double> right(terms, 0.0), next(terms, 0.0);
    for (const Knot& knot : knots) {
      const auto term = light_terms(knot.u, knot.v);
      double here = 0;
      for (std::size_t i = 0; i < terms; ++i) here += fit[i] * term[i];
      const double beyond = (from_above ? 1 : -1) * (knot.level - here) / tolerance + 1;
      const double weight = knot.exact || beyond > 0 ? 1 : 0.0005 + 0.9995 * std::exp(-beyond * beyond);
      for (std::size_t i = 0; i < terms; ++i) {
        right[i] += weight * term[i] * knot.level;
        for (std::size_t j = 0; j < terms; ++j) normal[i][j] += weight * term[i] * term[j];
      }
    }
    for (std::size_t i = 0; i < terms; ++i) normal[i][i] += 1e-6 + (i > 0 ? 1e-3 * (normal[0][0]) : 0);
    const auto inverse = test::inverse_of(normal);
    double change = 0;
    for (std::size_t i = 0; i < terms; ++i) {
      for (std::size_t j = 0; j < terms; ++j) next[i] += inverse[i][j] * right[j];
      change += std::abs(next[i] - fit[i]);
    }
    fit = next;
    if (change < 1e-3) break;
  }
  return fit;
}
double value_by_hand(const std::vector<double>& fit, double u, double v) {
  double sum = 0;
  for (std::size_t i = 0; i < fit.size(); ++i) sum += fit[i] * light_terms(u, v)[i];
  return sum;
}

// The frame reduced so that the radius is 4 to 8 px, each pixel the mean of 3 x 3.
GrayFrame softened(const GrayFrame& frame, double radius) {
  if (radius < 2.5) return frame;
  const int factor = std::max(1, static_cast<int>(radius / 4));
  const GrayFrame small = test::frame_by(frame.width / factor, frame.height / factor, [&](int column, int row) {
    double sum = 0;
    for (int k = 0; k < factor * factor; ++k)
      sum += static_cast<double>(frame.at(column * factor + k % factor, row * factor + k / factor));
    return sum / (factor * factor);
  });
  return test::frame_by(small.width, small.height, [&](int column, int row) {
    double sum = 0, count = 0;
    for (int y = std::max(0, row - 1); y <= std::min(small.height - 1, row + 1); ++y)
      for (int x = std::max(0, column - 1); x <= std::min(small.width - 1, column + 1); ++x)
        sum += static_cast<double>(small.at(x, y)), ++count;
    return sum / count;
  });
}

void expect_same_light(const GrayFrame& frame, double radius, Polarity polarity, const std::string& name) {
  const bool dark = polarity != Polarity::bright_beads;
  const GrayFrame small = softened(frame, radius);
  const int factor = std::max(1, static_cast<int>(radius / 4));
  const auto blocks = blocks_by_hand(small, std::max(8, static_cast<int>(std::lround(7 * radius / factor))));
  std::vector<double> spans;
  for (const LightBlock& block : blocks) spans.push_back(block.high - block.low);
  std::sort(spans.begin(), spans.end());
  const double largest = spans[static_cast<std::size_t>(0.98 * static_cast<double>(spans.size() - 1))];
  std::vector<Knot> behind, beads;
  for (const LightBlock& block : blocks) {
    behind.push_back({block.u, block.v, dark ? block.high : block.low});
    if (block.high - block.low >= 0.3 * largest) beads.push_back({block.u, block.v, dark ? block.low : block.high});
  }
  // A block of little contrast is background, by its middle level, or full of beads, whichever envelope is nearer.
  const auto first_behind = envelope_by_hand(behind, dark), first_beads = envelope_by_hand(beads, !dark);
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const LightBlock& block = blocks[k];
    if (block.high - block.low >= 0.3 * largest) continue;
    if (std::abs(block.middle - value_by_hand(first_behind, block.u, block.v)) <
        std::abs(block.middle - value_by_hand(first_beads, block.u, block.v)))
      behind[k].level = block.middle, behind[k].exact = true;
    else
      beads.push_back({block.u, block.v, dark ? block.low : block.high});
  }
  const auto background = envelope_by_hand(behind, dark), bead = envelope_by_hand(beads, !dark);
  const LightField light = estimate_light(frame, radius, polarity);
  std::vector<double> contrasts;
  const auto place = [](int node, int size) { return std::min(1.0, 64.0 * node / size - 1); };
  for (int row = 0; row < light.rows; ++row)
    for (int column = 0; column < light.columns; ++column) {
      const double u = place(column, frame.width), v = place(row, frame.height);
      contrasts.push_back(std::abs(value_by_hand(bead, u, v) - value_by_hand(background, u, v)));
    }
  std::sort(contrasts.begin(), contrasts.end());
  const double least = std::max(0.5, 0.1 * contrasts[contrasts.size() / 2]);
  for (int row = 0; row < light.rows; ++row)
    for (int column = 0; column < light.columns; ++column) {
      const double u = place(column, frame.width), v = place(row, frame.height);
      const auto at = static_cast<std::size_t>(row * light.columns + column);
      const double contrast = value_by_hand(bead, u, v) - value_by_hand(background, u, v);
      EXPECT_NEAR(light.background[at], value_by_hand(background, u, v), 2e-3) << name << ' ' << column << ' ' << row;
      EXPECT_NEAR(light.contrast[at], dark ? std::min(contrast, -least) : std::max(contrast, least), 2e-3)
          << name << ' ' << column << ' ' << row;
    }
}

// Disks in a part of the frame, an empty part and one so full that no background shows, under light that bends.
GrayFrame lit_frame(int width, int height, double radius, double contrast, int pattern) {
  GrayFrame frame = test::frame_by(width, height, [&](int column, int row) {
    const double u = 2.0 * column / width - 1, v = 2.0 * row / height - 1;
    const double apart = 2.6 * radius;
    const double away = std::hypot(std::remainder(column - 0.4 * apart, apart), std::remainder(row, apart));
    double bead = u < -0.3 ? 0 : u > 0.55 && v > 0.2 ? 1 : std::clamp(radius + 0.5 - away, 0.0, 1.0);
    if (pattern == 1) bead = std::clamp(radius + 0.5 - away, 0.0, 1.0);
    return 140 + 15 * u - 12 * v + 9 * u * v - 6 * u * u + contrast * (1 - 0.2 * u) * bead +
           6 * (test::scattered(column, row) - 0.5);
  });
  return frame;
}

TEST(LightEstimate, IsThatOfItsEnvelopes) {
  for (const Polarity polarity : {Polarity::dark_beads, Polarity::bright_beads}) {
    const double contrast = polarity == Polarity::dark_beads ? -70 : 70;
    expect_same_light(lit_frame(170, 150, 3.4, contrast, 0), 3.4, polarity, "many blocks");
    expect_same_light(lit_frame(133, 99, 4.4, contrast, 1), 4.4, polarity, "some blocks");
    expect_same_light(lit_frame(150, 140, 9, contrast, 1), 9, polarity, "reduced");
    expect_same_light(lit_frame(60, 41, 2.2, contrast, 0), 2.2, polarity, "small beads");
  }
  expect_same_light(lit_frame(90, 90, 4, -70, 0), 4, Polarity::automatic, "of unknown sign");
}

// Parts that are unseen are left out; of a frame of which hardly anything is seen, what there is counts.
TEST(LightEstimate, LeavesOutWhatIsUnseen) {
  GrayFrame frame = lit_frame(120, 100, 3, -70, 1);
  for (int row = 0; row < 100; ++row)
    for (int column = 0; column < 120; ++column)
      if (column > 50 + row / 3) test::set(frame, column, row, unseen_level);
  expect_same_light(frame, 2.3, Polarity::dark_beads, "half of it");
  GrayFrame hidden = test::even_frame(60, 50, unseen_level);
  for (int k = 0; k < 9; ++k) test::set(hidden, 20 + 3 * k, 25, 100 - 5 * k);
  const LightField light = estimate_light(hidden, 2, Polarity::dark_beads);
  for (const float level : light.background) EXPECT_NEAR(level, 95, 0.1) << "the second of nine";
  for (const float level : light.contrast) EXPECT_NEAR(level, 60 - 95, 0.1);
}

}  // namespace
}  // namespace shakebed::ingest
