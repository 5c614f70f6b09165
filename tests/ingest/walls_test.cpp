// Even areas at the borders of a frame: which of them are walls and which are background, on either side of each limit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/find_disks.hpp"
#include "ingest/find/learned_beads.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

constexpr int walled_width = 124, walled_height = 96;

// How far a pixel lies within the frame from this side, and along it.
std::pair<double, double> from_side(FrameSide side, int column, int row) {
  if (side == FrameSide::left) return {column, row};
  if (side == FrameSide::right) return {walled_width - 1 - column, row};
  if (side == FrameSide::top) return {row, column};
  return {walled_height - 1 - row, column};
}

// A checkered frame with an even area of this level at one side, whose depth grows from 9 px by `slope` a px.
GrayFrame with_wall(FrameSide side, double level, double slope = 0) {
  return test::frame_by(walled_width, walled_height, [&](int column, int row) {
    const auto [depth, place] = from_side(side, column, row);
    return depth < 9 + slope * place
               ? level
               : ((column / 5 + row / 5) % 2 == 0 ? 60 : 190) + 9 * test::scattered(column / 5, row / 5);
  });
}

// A light of contrast -40 on 220, but at one node of -60 on 130.
FinderCalibration lit_at(double spacing, int columns, int rows, int column, int row) {
  FinderCalibration calibration;
  calibration.solid_borders = true;
  calibration.edge_width_px = 1.1;
  calibration.light.spacing_px = spacing, calibration.light.columns = columns, calibration.light.rows = rows;
  calibration.light.background.assign(static_cast<std::size_t>(columns * rows), 220);
  calibration.light.contrast.assign(static_cast<std::size_t>(columns * rows), -40);
  calibration.light.background[static_cast<std::size_t>(row * columns + column)] = 130;
  calibration.light.contrast[static_cast<std::size_t>(row * columns + column)] = -60;
  return calibration;
}

// It is background if it has the level of the light there, in its middle, within 0.15 of the contrast.
TEST(WallsByHand, AreNoneWhereTheyHaveTheLevelOfTheLight) {
  struct Case {
    FrameSide side;
    int column, row;  // of the node nearest to the middle of the area
  };
  for (const Case& one : {Case{FrameSide::left, 0, 2}, Case{FrameSide::right, 6, 2}, Case{FrameSide::top, 3, 0},
                          Case{FrameSide::bottom, 3, 5}})
    for (const double off : {-0.17, -0.13, 0.13, 0.17}) {
      const GrayFrame frame = with_wall(one.side, 130 - 60 * off);
      const std::vector<SolidBorder> borders = find_solid_borders(frame);
      ASSERT_EQ(borders.size(), 1U);
      ASSERT_EQ(borders[0].side, one.side);
      const FinderCalibration calibration = lit_at(20, 7, 6, one.column, one.row);
      const GrayFrame seen = seen_part(frame, calibration);
      const bool wall = std::abs(off) > 0.15;
      EXPECT_EQ(seen.pixels, wall ? without_borders(frame, borders, 0.5 + 2 * 1.1).pixels : frame.pixels)
          << static_cast<int>(one.side) << ' ' << off;
      for (int row = 0; row < walled_height; row += 5)
        for (int column = 0; column < walled_width; column += 5) {
          const double depth = from_side(one.side, column, row).first;
          if (depth < 8 || depth > 13) {
            EXPECT_EQ(unseen(seen.at(column, row)), wall && depth < 8) << column << ' ' << row;
          }
        }
    }
}

// The middle of an area that grows deeper along its side lies half of its depth there within the frame.
TEST(WallsByHand, HaveTheirMiddleHalfWayIn) {
  for (const FrameSide side : {FrameSide::left, FrameSide::right, FrameSide::top, FrameSide::bottom}) {
    const GrayFrame frame = with_wall(side, 130, 0.12);
    const std::vector<SolidBorder> borders = find_solid_borders(frame);
    ASSERT_EQ(borders.size(), 1U);
    const double along = 0.5 * (borders[0].from + borders[0].to), deep = 0.5 * (borders[0].depth_px + 0.12 * along);
    EXPECT_NEAR(borders[0].slope, 0.12, 0.02);
    EXPECT_GT(deep, 6.5) << "twice that without the slope: 9";
    const bool upright = side == FrameSide::top || side == FrameSide::bottom;
    const double x = upright                   ? along
                     : side == FrameSide::left ? deep
                                               : walled_width - 1 - deep,
                 y = !upright                 ? along
                     : side == FrameSide::top ? deep
                                              : walled_height - 1 - deep;
    int nodes = 0;
    for (int column = 0; column < 42; ++column)
      for (int row = 0; row < 33; ++row) {
        if (std::abs(3 * column - x) > 8 || std::abs(3 * row - y) > 8) continue;
        const bool background = seen_part(frame, lit_at(3, 42, 33, column, row)).pixels == frame.pixels;
        nodes += background ? 1 : 0;
        if (background) {
          EXPECT_LT(std::max(std::abs(3 * column - x), std::abs(3 * row - y)), 2) << column << ' ' << row;
        }
      }
    EXPECT_EQ(nodes, 1);
  }
}

// Two walls reach to their common corner.
TEST(WallsByHand, ReachToTheirCorner) {
  GrayFrame frame = with_wall(FrameSide::left, 20);
  for (int row = walled_height - 12; row < walled_height; ++row)
    for (int column = 0; column < walled_width; ++column)
      if (column >= 9) test::set(frame, column, row, 240);
  FinderCalibration calibration = lit_at(20, 7, 6, 3, 3);
  calibration.light.background.assign(42, 130), calibration.light.contrast.assign(42, -60);
  const GrayFrame seen = seen_part(frame, calibration);
  for (int column = 0; column < walled_width; ++column)
    for (int row = 0; row < walled_height; ++row) {
      if (column < 8 || row > walled_height - 11) {
        ASSERT_TRUE(unseen(seen.at(column, row))) << column << ' ' << row;
      } else if (column > 14 && row < walled_height - 17) {
        ASSERT_FALSE(unseen(seen.at(column, row))) << column << ' ' << row;
      }
    }
}

// Pixels that are left out of every frame are so whether there are walls or not.
TEST(WallsByHand, AreBesideWhatIsLeftOut) {
  const GrayFrame frame = with_wall(FrameSide::top, 20);
  for (const bool walls : {true, false}) {
    FinderCalibration calibration = lit_at(20, 7, 6, 3, 3);
    calibration.solid_borders = walls;
    std::vector<std::uint8_t> left_out(frame.pixels.size(), 0);
    left_out[5000] = 1, left_out[5001] = 2;
    calibration.left_out = std::make_shared<const std::vector<std::uint8_t>>(left_out);
    const GrayFrame seen = seen_part(frame, calibration);
    for (const std::size_t at : {4999U, 5000U, 5001U, 5002U})
      EXPECT_EQ(unseen(seen.pixels[at]), at == 5000 || at == 5001) << at;
    EXPECT_EQ(unseen(seen.at(60, 3)), walls);
  }
}

// Before beads are known: what differs from the level of the background, that of the rank 0.95 (of dark beads; 0.05 of
// bright ones), by less than a quarter of what the level of the opposite rank does is no wall. Beads make up 6.4 % of
// the pixels beside the wall.
TEST(WallsByHand, DifferFromTheBackgroundByAQuarterOfTheBeads) {
  for (const bool dark : {true, false}) {
    const auto is_wall = [&](double off) {
      const GrayFrame frame = test::frame_by(walled_width, walled_height, [&](int column, int row) {
        double level = 150;
        for (int k = 0; k < 6; ++k)
          if (std::hypot(column - (22 + 19.5 * (k % 5)), row - (34 + 35.0 * (k % 2))) < 6) level = dark ? 70 : 230;
        // Wear along the other sides, so that the background is no wall of its own.
        const bool worn = row == walled_height - 1 || (row > 11 && (column == 0 || column == walled_width - 1));
        if (worn && (row + column) % 3 == 0) level = 240;
        return row < 9 ? 150 + (dark ? -80 : 80) * off : level;
      });
      const Polarity polarity = dark ? Polarity::dark_beads : Polarity::bright_beads;
      return unseen(without_walls(frame, polarity, 6).at(60, 4));
    };
    EXPECT_TRUE(is_wall(0.27)) << dark;
    EXPECT_FALSE(is_wall(0.23)) << dark;
  }
}

}  // namespace
}  // namespace shakebed::ingest
