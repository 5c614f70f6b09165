// Light over a frame: its fields, what is learned of them from open background and from the beads.
#include "ingest/find/bed_light.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "ingest/calibrate/flatten.hpp"
#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/learned_beads.hpp"
#include "ingest/frames/smooth_field.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

using test::even_frame;
using test::frame_by;

// Background and contrast at the nodes of a frame of `width` x `height` px.
template <class Background, class Contrast>
LightField light_by(int width, int height, const Background& background, const Contrast& contrast) {
  LightField light;
  light.spacing_px = 32;
  light.columns = (width + 31) / 32 + 1, light.rows = (height + 31) / 32 + 1;
  for (int row = 0; row < light.rows; ++row)
    for (int column = 0; column < light.columns; ++column) {
      light.background.push_back(static_cast<float>(background(32.0 * column, 32.0 * row)));
      light.contrast.push_back(static_cast<float>(contrast(32.0 * column, 32.0 * row)));
    }
  return light;
}
double rising(double x, double y) { return 150 + 0.2 * x - 0.3 * y; }
double falling(double x, double y) { return -90 - 0.1 * x + 0.2 * y; }

TEST(BedLight, OfAFieldIsBilinearBetweenItsNodes) {
  const LightField light = light_by(100, 70, rising, falling);
  for (const auto& [x, y] : {std::array{0.0, 0.0}, {13.7, 50.2}, {95.9, 3.1}, {64.0, 64.0}}) {
    EXPECT_NEAR(field_at(light, light.background, x, y), rising(x, y), 1e-3);
    EXPECT_NEAR(field_at(light, light.contrast, x, y), falling(x, y), 1e-3);
  }
  EXPECT_NEAR(field_at(light, light.background, -20, 500), rising(0, 96), 0.02) << "beyond the nodes the outermost";
  EXPECT_NEAR(field_at(light, light.background, 500, -20), rising(128, 0), 0.02);
  // Not linear, so that each node counts.
  LightField bent;
  bent.spacing_px = 10, bent.columns = 2, bent.rows = 2;
  bent.background = {1, 2, 4, 8};
  EXPECT_NEAR(field_at(bent, bent.background, 2.5, 5), 0.5 * (0.75 * 1 + 0.25 * 2) + 0.5 * (0.75 * 4 + 0.25 * 8), 1e-9);
  EXPECT_EQ(mean_background(light), static_cast<double>(light.background[2 * 5 + 2]));
  EXPECT_EQ(mean_contrast(light), static_cast<double>(light.contrast[2 * 5 + 2]));
}

TEST(BedLight, TenthsOfTheLevels) {
  const GrayFrame frame = frame_by(10, 10, [](int column, int row) { return (10 * row + column) * 7 % 101; });
  std::vector<float> sorted = frame.pixels;
  std::sort(sorted.begin(), sorted.end());
  const auto deciles = level_deciles(frame);
  ASSERT_EQ(deciles.size(), 9U);
  for (std::size_t k = 1; k < 10; ++k) EXPECT_EQ(deciles[k - 1], sorted[k * 99 / 10]);
  GrayFrame hidden = even_frame(4, 4, unseen_level);
  EXPECT_TRUE(level_deciles(hidden).empty());
  test::set(hidden, 2, 2, 5);
  EXPECT_EQ(level_deciles(hidden), std::vector<float>(9, 5.0F));
}

// (frame - background - contrast shift)/(contrast gain) at each pixel, between nodes and beyond the last.
TEST(Flatten, TakesTheLightOutOfAFrame) {
  const LightField light = light_by(75, 50, rising, falling);
  GrayFrame frame = frame_by(75, 50, [](int column, int row) { return 60 + 100 * test::scattered(column, row); });
  test::set(frame, 40, 20, unseen_level);
  for (const FrameLight& own : {FrameLight{}, FrameLight{0.2, 1.25}}) {
    const GrayFrame flat = flatten(frame, light, own);
    ASSERT_EQ(flat.width, 75);
    ASSERT_EQ(flat.height, 50);
    for (int row = 0; row < 50; ++row)
      for (int column = 0; column < 75; ++column) {
        if (column == 40 && row == 20) continue;
        const double contrast = falling(column, row), background = rising(column, row) + own.shift * contrast;
        ASSERT_NEAR(flat.at(column, row),
                    (static_cast<double>(frame.at(column, row)) - background) / (own.gain * contrast), 1e-4);
      }
    EXPECT_EQ(flat.at(40, 20), unseen_level);
  }
  EXPECT_TRUE((FrameLight{0, 1}).plain());
  EXPECT_FALSE((FrameLight{0.1, 1}).plain());
  EXPECT_FALSE((FrameLight{0, 1.1}).plain());
}

// Disks on uneven light, dark and bright. An envelope is what 3 % of a block of 63 px exceed: of this slope 5.9 levels
// beyond its middle, and less where blocks are cut by the frame.
TEST(Flatten, EstimatesTheLightOfBeads) {
  for (const bool dark : {true, false}) {
    const auto background = [](double x, double y) { return 140 + 0.1 * x - 0.15 * y; };
    const double contrast = dark ? -80 : 80;
    const GrayFrame frame = frame_by(260, 220, [&](int column, int row) {
      const double away = std::hypot(std::remainder(column - 22, 43), std::remainder(row - 24, 42));
      return background(column, row) + contrast * std::clamp(9.5 - away, 0.0, 1.0);
    });
    const LightField light = estimate_light(frame, 9, dark ? Polarity::dark_beads : Polarity::bright_beads);
    EXPECT_EQ(light.spacing_px, 32);
    EXPECT_EQ(light.columns, 10);
    EXPECT_EQ(light.rows, 8);
    for (const auto& [x, y] : {std::array{130.0, 110.0}, {10.0, 10.0}, {250.0, 10.0}, {10.0, 210.0}, {250.0, 210.0}}) {
      EXPECT_NEAR(field_at(light, light.background, x, y), background(x, y) + (dark ? 5.9 : -5.9), 2) << x << ' ' << y;
      EXPECT_NEAR(field_at(light, light.contrast, x, y), contrast, 9) << x << ' ' << y;
    }
    const LightField whole =
        estimate_light(even_frame(64, 40, 90), 6, dark ? Polarity::dark_beads : Polarity::bright_beads);
    EXPECT_EQ(whole.columns, 3);
    EXPECT_EQ(whole.rows, 3);
    for (const float c : whole.contrast) EXPECT_EQ(c, dark ? -0.5F : 0.5F) << "no contrast is stated as the least";
    for (const float b : whole.background) EXPECT_NEAR(b, 90, 0.1);
  }
  GrayFrame wrong = even_frame(20, 20, 1);
  wrong.pixels.pop_back();
  EXPECT_THROW(estimate_light(wrong, 5, Polarity::dark_beads), std::invalid_argument);
  EXPECT_THROW(estimate_light(even_frame(20, 20, unseen_level), 5, Polarity::dark_beads), std::invalid_argument);
}

// A flat frame whose model is off by beta + (gamma - 1) model, both polynomials: the light is changed by just that.
struct OffModel {
  GrayFrame flat, model;
};
template <class Beta, class Gamma>
OffModel off_by(int width, int height, const Beta& beta, const Gamma& gamma) {
  OffModel frames{{}, frame_by(width, height, [](int column, int row) { return test::scattered(column, row); })};
  frames.flat = frame_by(width, height, [&](int column, int row) {
    const double u = (2.0 * column + 1) / width - 1, v = (2.0 * row + 1) / height - 1;
    return beta(u, v) + gamma(u, v) * static_cast<double>(frames.model.at(column, row));
  });
  return frames;
}
JointFit fit_with_residual(const GrayFrame& flat, const GrayFrame& model) {
  JointFit fit(flat);
  for (int row = 0; row < flat.height; ++row)
    for (int column = 0; column < flat.width; ++column)
      fit.residual_row(row)[column] = flat.at(column, row) - model.at(column, row);
  return fit;
}

TEST(BedLight, SumsOverTilesAreThoseOfTheirPixels) {
  const OffModel frames = off_by(
      70, 45, [](double u, double) { return 0.03 * u; }, [](double, double) { return 1.0; });
  JointFit fit = fit_with_residual(frames.flat, frames.model);
  fit.residual_row(3)[5] = 0.21F, fit.residual_row(4)[5] = -0.21F, fit.residual_row(5)[5] = 0.19F;
  for (const double spread : {0.05, 0.01}) {  // residuals up to 0.2, then up to 0.1
    std::vector<TileSums> tiles;
    add_tile_sums(frames.flat, fit, spread, tiles);
    ASSERT_EQ(tiles.size(), 6U);
    for (std::size_t k = 0; k < 6; ++k) {
      const int left = 32 * static_cast<int>(k % 3), top = 32 * static_cast<int>(k / 3),
                right = std::min(70, left + 32), bottom = std::min(45, top + 32);
      TileSums sum;
      for (int row = top; row < bottom; ++row)
        for (int column = left; column < right; ++column) {
          const double e = static_cast<double>(fit.residual(column, row)),
                       level = static_cast<double>(frames.flat.at(column, row)), model = level - e;
          sum.u += ((2.0 * column + 1) / 70 - 1) / ((right - left) * (bottom - top));
          sum.v += ((2.0 * row + 1) / 45 - 1) / ((right - left) * (bottom - top));
          if (std::abs(e) >= (spread > 0.02 ? 0.2 : 0.1)) continue;
          sum.count += 1, sum.model += model, sum.model_model += model * model;
          sum.flat += level, sum.flat_model += level * model;
        }
      EXPECT_NEAR(tiles[k].u, sum.u, 1e-9);
      EXPECT_NEAR(tiles[k].v, sum.v, 1e-9);
      EXPECT_EQ(tiles[k].count, sum.count);
      EXPECT_NEAR(tiles[k].model, sum.model, 1e-2);
      EXPECT_NEAR(tiles[k].model_model, sum.model_model, 1e-2);
      EXPECT_NEAR(tiles[k].flat, sum.flat, 1e-2);
      EXPECT_NEAR(tiles[k].flat_model, sum.flat_model, 1e-2);
    }
  }
}

TEST(BedLight, IsRefinedByWhatTheModelMisses) {
  const auto beta = [](double u, double v) { return 0.02 + 0.03 * u - 0.02 * v + 0.01 * (2 * u * u - 1); };
  const auto gamma = [](double u, double v) { return 1.04 - 0.02 * u + 0.03 * u * v; };
  constexpr int width = 320, height = 224;
  const OffModel frames = off_by(width, height, beta, gamma);
  std::vector<TileSums> tiles;
  add_tile_sums(frames.flat, fit_with_residual(frames.flat, frames.model), 0.1, tiles);
  LightField light = light_by(width, height, rising, falling);
  const LightField before = light;
  const double change = refine_light(light, tiles, width, height);
  double largest = 0;
  for (int row = 0; row < light.rows; ++row)
    for (int column = 0; column < light.columns; ++column) {
      const auto at = static_cast<std::size_t>(row * light.columns + column);
      const double u = std::clamp((2 * column * 32.0 + 1) / width - 1, -1.0, 1.05),
                   v = std::clamp((2 * row * 32.0 + 1) / height - 1, -1.0, 1.05);
      const double by = (static_cast<double>(light.background[at]) - static_cast<double>(before.background[at])) /
                        static_cast<double>(before.contrast[at]);
      const double times = static_cast<double>(light.contrast[at]) / static_cast<double>(before.contrast[at]);
      EXPECT_NEAR(by, beta(u, v), 4e-3) << column << ' ' << row;
      EXPECT_NEAR(times, gamma(u, v), 7e-3) << column << ' ' << row;
      largest = std::max({largest, std::abs(by), std::abs(times - 1)});
    }
  EXPECT_NEAR(change, largest, 1e-5);
  // A small frame has too few tiles for a slope: its light changes evenly, by no more than half and twice.
  for (const auto& [by, times] : {std::array{0.04, 1.05}, {0.9, 3.0}}) {
    const OffModel small = off_by(
        60, 60, [b = by](double, double) { return b; }, [t = times](double, double) { return t; });
    tiles.clear();
    add_tile_sums(small.flat, fit_with_residual(small.flat, small.model), 10, tiles);
    LightField even = light_by(
        60, 60, [](double, double) { return 100.0; }, [](double, double) { return 50.0; });
    refine_light(even, tiles, 60, 60);
    for (std::size_t k = 0; k < even.background.size(); ++k) {
      EXPECT_NEAR(even.background[k], 100 + 50 * std::min(0.5, by), 0.15);
      EXPECT_NEAR(even.contrast[k], 50 * std::min(2.0, times), 0.2);
    }
  }
}

// Tiles all over a frame whose flattened levels are off by the fourth power of the place: twenty of them follow its
// second order, sixty its fourth in a frame of 200 px or more.
TEST(BedLight, IsRefinedToTheOrderThatItsTilesTell) {
  const auto most_after = [](std::size_t count, int side) {
    std::vector<TileSums> tiles;
    for (std::size_t k = 0; k < count; ++k) {
      TileSums tile;
      tile.u = 2 * test::scattered(static_cast<int>(k), 3) - 1,
      tile.v = 2 * test::scattered(7, static_cast<int>(k)) - 1;
      tile.count = 1000, tile.model = 400, tile.model_model = 380;
      const double off = 0.1 * std::pow(tile.u, 4);
      tile.flat = tile.model + off * tile.count, tile.flat_model = tile.model_model + off * tile.model;
      tiles.push_back(tile);
    }
    const auto hundred = [](double, double) { return 100.0; };
    LightField light = light_by(side, side, hundred, hundred);
    refine_light(light, tiles, side, side);
    return static_cast<double>(*std::max_element(light.background.begin(), light.background.end())) - 100;
  };
  // At the outermost node the fourth power is 1, or 1.05^4 where that lies beyond the frame; the best parabola has
  // less.
  EXPECT_NEAR(most_after(60, 320), 10, 0.3);
  EXPECT_LT(most_after(59, 320), 8.5);
  EXPECT_GT(most_after(20, 320), 6);
  EXPECT_LT(most_after(19, 320), 5) << "one level for all";
  EXPECT_NEAR(most_after(60, 200), 10 * std::pow(1.05, 4), 0.3);
  EXPECT_LT(most_after(60, 199), 9.5);
}

ModelDisk bead_at(double x, double y) {
  ModelDisk disk;
  disk.x = x, disk.y = y;
  return disk;
}

// The median of each tile over what is farther than `clear` from all beads, at the middle of just these pixels.
TEST(BedLight, OfOpenBackgroundIsAMedianATile) {
  GrayFrame flat = frame_by(75, 70, [](int column, int row) { return 0.3 * test::scattered(column, row); });
  test::set(flat, 70, 60, unseen_level);
  const std::vector<ModelDisk> disks = {bead_at(14.4, 15.3), bead_at(40, 40), bead_at(-3, 50), bead_at(50, -5),
                                        bead_at(70, 14)};
  const double clear = 17.5;
  const auto tiles = open_background(flat, disks, clear);
  std::size_t next = 0;
  for (int top = 0; top < 70; top += 32)
    for (int left = 0; left < 75; left += 32) {
      std::vector<float> levels;
      double u = 0, v = 0;
      for (int row = top; row < std::min(70, top + 32); ++row)
        for (int column = left; column < std::min(75, left + 32); ++column) {
          if (unseen(flat.at(column, row)) || std::any_of(disks.begin(), disks.end(), [&](const ModelDisk& disk) {
                return std::hypot(column - disk.x, row - disk.y) <= clear;
              }))
            continue;
          levels.push_back(flat.at(column, row));
          u += (2.0 * column + 1) / 75 - 1, v += (2.0 * row + 1) / 70 - 1;
        }
      if (levels.size() < 40) continue;
      ASSERT_LT(next, tiles.size());
      std::sort(levels.begin(), levels.end());
      EXPECT_NEAR(tiles[next].u, u / static_cast<double>(levels.size()), 1e-9);
      EXPECT_NEAR(tiles[next].v, v / static_cast<double>(levels.size()), 1e-9);
      EXPECT_EQ(tiles[next].flat, static_cast<double>(levels[levels.size() / 2]));
      ++next;
    }
  EXPECT_EQ(next, tiles.size());
  EXPECT_GE(next, 5U);
  EXPECT_LT(next, 9U);
}

// Open background 0.1 beyond what was taken for it: the background is put there and the beads keep their level. At 0.04
// beyond, with too few tiles or without beads nothing is done.
TEST(BedLight, BackgroundIsCorrectedWhereItIsOpen) {
  constexpr int width = 160, height = 128;
  const GrayFrame flat = even_frame(width, height, 0);
  const std::vector<ModelDisk> disks = {bead_at(40, 40), bead_at(100, 90)};
  const auto tiles_at = [](double level, std::size_t count) {
    std::vector<TileSums> tiles;
    for (std::size_t k = 0; k < count; ++k) {
      TileSums tile;
      tile.u = -0.8 + 0.4 * static_cast<double>(k % 5), tile.v = -0.75 + 0.5 * static_cast<double>(k / 5);
      tile.flat = level;
      tiles.push_back(tile);
    }
    return tiles;
  };
  const auto even = [](double, double) { return 120.0; };
  const auto contrast = [](double, double) { return -80.0; };
  LightField light = light_by(width, height, even, contrast);
  const LightField before = light;
  EXPECT_FALSE(correct_background(light, flat, tiles_at(-0.04, 20), disks));
  EXPECT_FALSE(correct_background(light, flat, tiles_at(0.2, 20), disks));
  EXPECT_FALSE(correct_background(light, flat, tiles_at(-0.1, 5), disks));
  EXPECT_FALSE(correct_background(light, flat, tiles_at(-0.1, 20), {}));
  EXPECT_EQ(light.background, before.background);
  EXPECT_TRUE(correct_background(light, flat, tiles_at(-0.1, 20), disks));
  for (std::size_t k = 0; k < light.background.size(); ++k) {
    EXPECT_NEAR(light.background[k], 128, 1e-3);
    EXPECT_NEAR(light.background[k] + light.contrast[k], 40, 1e-3);
  }
  // A slope over the frame is followed, but not beyond the levels that were seen.
  light = before;
  auto tiles = tiles_at(0, 20);
  for (TileSums& tile : tiles) tile.flat = -0.15 - 0.05 * tile.u;
  EXPECT_TRUE(correct_background(light, flat, tiles, disks));
  for (int column = 0; column < light.columns; ++column) {
    const double u = std::clamp((2 * column * 32.0 + 1) / width - 1, -0.8, 0.8);
    EXPECT_NEAR(light.background[static_cast<std::size_t>(light.columns + column)], 120 + 80 * (0.15 + 0.05 * u), 0.35);
  }
}

// flat = shift + gain model, with a few pixels that are something else.
TEST(BedLight, OfOneFrameIsItsShiftAndGain) {
  const auto found = [](double shift, double gain) {
    OffModel frames = off_by(
        80, 600, [=](double, double) { return shift; }, [=](double, double) { return gain; });
    for (int k = 0; k < 80; ++k) test::set(frames.flat, k, 8, 3);
    return light_of_frame(frames.flat, fit_with_residual(frames.flat, frames.model), 0.02);
  };
  for (const auto& [shift, gain] : {std::array{0.03, 1.1}, {-0.06, 0.8}, {0, 1.004}, {0.004, 1}}) {
    EXPECT_NEAR(found(shift, gain).shift, shift, 1e-4) << shift << ' ' << gain;
    EXPECT_NEAR(found(shift, gain).gain, gain, 1e-4) << shift << ' ' << gain;
  }
  EXPECT_TRUE(found(0.0015, 0.9985).plain()) << "too little to count";
  EXPECT_TRUE(found(0, 2.6).plain()) << "too much to be light";
  // All background: nothing tells a gain.
  const GrayFrame even = even_frame(40, 40, 0.1);
  EXPECT_TRUE(light_of_frame(even, fit_with_residual(even, even_frame(40, 40, 0)), 0.02).plain());
}

TEST(BedLight, WhatIsUnexplainedIsInGreyLevels) {
  const LightField light = light_by(70, 40, rising, falling);
  GrayFrame residual = frame_by(70, 40, [](int column, int row) { return 0.1 * (test::scattered(column, row) - 0.5); });
  test::set(residual, 50, 30, unseen_level);
  double sum = 0;
  for (int row = 0; row < 40; ++row)
    for (int column = 0; column < 70; ++column) {
      if (column == 50 && row == 30) continue;
      const double nearest = falling(32 * std::floor(column / 32.0 + 0.5), 32 * std::floor(row / 32.0 + 0.5));
      sum += std::pow(static_cast<double>(residual.at(column, row)) * nearest, 2);
    }
  EXPECT_NEAR(unexplained_of(fit_with_residual(residual, even_frame(70, 40, 0)), light) / sum, 1, 1e-4);
}

// --- learned_beads.hpp -----------------------------------------------------------------------------------------------

TEST(LearnedBeads, LengthsFollowFromRadiusAndEdge) {
  EXPECT_NEAR(reach_of(10, 1), 13.6, 1e-12);
  EXPECT_NEAR(softening_for(0.48), 0.64, 1e-12);  // 0.48^2 + 0.64^2 = 0.8^2
  EXPECT_EQ(softening_for(0.8), 0);
  EXPECT_NEAR(knot_for(10, 1), 0.4, 1e-12);
  EXPECT_NEAR(knot_for(10, 0.3), 0.2, 1e-12);
  EXPECT_NEAR(knot_for(10, 5), 1.25, 1e-12);
  EXPECT_NEAR(knot_for(1, 5), 0.25, 1e-12);
  // Cramer and Rao for a step blurred by sigma: noise sqrt(2 sqrt(pi) sigma/(beads 2 pi R)), and 0.002 px.
  FinderCalibration calibration;
  calibration.rim_radius_px = 8, calibration.edge_width_px = 0.9;
  const double rims = 0.05 * std::sqrt(2 * std::sqrt(M_PI) * 0.9 / (50 * 2 * M_PI * 8));
  EXPECT_NEAR(radius_error(calibration, 0.05, 50, 0), std::hypot(rims, 0.002), 1e-6);
  EXPECT_NEAR(radius_error(calibration, 0.05, 50, 0.01), std::hypot(rims, 0.002, 0.01), 1e-6);
  calibration.edge_width_px = 0.1;
  EXPECT_NEAR(radius_error(calibration, 0.05, 50, 0),
              std::hypot(0.05 * std::sqrt(2 * std::sqrt(M_PI) * 0.3 / (50 * 2 * M_PI * 8)), 0.002), 1e-6);
  GrayFrame frame = even_frame(5, 4, 1);
  EXPECT_NO_THROW(require_consistent(frame));
  frame.pixels.pop_back();
  EXPECT_THROW(require_consistent(frame), std::invalid_argument);
}

}  // namespace
}  // namespace shakebed::ingest
