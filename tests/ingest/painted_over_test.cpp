// What is behind beads, a frame with them painted over, and where it is free of them: each done a second time.
#include "ingest/find/painted_over.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/beside_beads.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

using test::even_frame;
using test::found_at;
using test::frame_by;

// --- levels behind

// What the levels are in the middles of the cells: ranks of the open pixels of each, then means of neighbours.
std::map<std::pair<int, int>, double> levels_of_cells(const GrayFrame& frame, const std::vector<std::uint8_t>& hidden,
                                                      int cell, int every, double rank) {
  std::map<std::pair<int, int>, double> levels;
  const int columns = (frame.width + cell - 1) / cell, rows = (frame.height + cell - 1) / cell;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      std::vector<double> open;
      for (int y = 0; y < frame.height; ++y)
        for (int x = 0; x < frame.width; ++x) {
          const bool inside = x / cell == column && y / cell == row && x % cell % every == 0 && y % cell % every == 0;
          if (inside && hidden[static_cast<std::size_t>(y * frame.width + x)] == 0 && !unseen(frame.at(x, y)))
            open.push_back(static_cast<double>(frame.at(x, y)));
        }
      std::sort(open.begin(), open.end());
      if (open.size() >= 40)
        levels[{column, row}] = open[static_cast<std::size_t>(rank * static_cast<double>(open.size() - 1))];
    }
  while (levels.size() < static_cast<std::size_t>(columns * rows)) {
    const auto before = levels;
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) {
        if (before.contains({column, row})) continue;
        double sum = 0, count = 0;
        for (const auto& [place, level] : before)
          if (std::abs(place.first - column) <= 1 && std::abs(place.second - row) <= 1) sum += level, ++count;
        if (count > 0) levels[{column, row}] = sum / count;
      }
  }
  return levels;
}

// Linear between the middles of the cells, beyond the outermost as they are.
double between_cells(const std::map<std::pair<int, int>, double>& levels, int cell, int columns, int rows, int x,
                     int y) {
  const auto hat = [&](double place, int k, int count) {
    return std::max(0.0, 1 - std::abs(std::clamp(place, 0.5, count - 0.5) - (k + 0.5)));
  };
  double sum = 0;
  for (const auto& [place, level] : levels)
    sum += hat((x + 0.5) / cell, place.first, columns) * hat((y + 0.5) / cell, place.second, rows) * level;
  return sum;
}

// A frame of 5 x 4 cells of 8 px, the last of them narrower; three quarters of it hidden, so that the levels of its
// first cells must reach the last in several steps.
TEST(LevelsBehind, AreRanksOfTheirCellsAndMeansOfNeighbours) {
  const GrayFrame frame = frame_by(37, 30, [](int column, int row) {
    return column == 3 && row == 2 ? unseen_level : 40 + 2 * column + row + 30 * test::scattered(column, row);
  });
  std::vector<std::uint8_t> hidden(frame.pixels.size(), 0);
  for (int row = 0; row < 30; ++row)
    for (int column = 0; column < 37; ++column)
      hidden[static_cast<std::size_t>(row * 37 + column)] = (column >= 16 && row >= 2) || (column + row) % 5 == 0;
  for (const double rank : {0.0, 0.15, 0.5, 0.85, 1.0}) {
    const LevelsBehind behind(frame, hidden, 8.9, rank);
    ASSERT_TRUE(behind.known());
    const auto levels = levels_of_cells(frame, hidden, 8, 1, rank);
    for (int row = 0; row < 30; ++row)
      for (int column = 0; column < 37; ++column)
        ASSERT_NEAR(behind.at(column, row), between_cells(levels, 8, 5, 4, column, row), 1e-3)
            << column << ' ' << row << " of " << rank;
  }
}

TEST(LevelsBehind, NeedFortyPixelsOfACell) {
  for (const int open : {39, 40}) {
    const GrayFrame frame = frame_by(16, 8, [](int column, int) { return column < 8 ? 50 : 90; });
    std::vector<std::uint8_t> hidden(frame.pixels.size(), 1);
    for (int k = 0; k < open; ++k) hidden[static_cast<std::size_t>(k / 8 * 16 + 8 + k % 8)] = 0;
    const LevelsBehind behind(frame, hidden, 8, 0.5);
    EXPECT_EQ(behind.known(), open == 40);
    if (behind.known()) {
      EXPECT_EQ(behind.at(0, 0), 90) << "of its neighbour";
    }
  }
  // A cell is never less than 4 px wide: 16 pixels are too few.
  EXPECT_FALSE(LevelsBehind(even_frame(12, 12, 9), std::vector<std::uint8_t>(144, 0), 0.5, 0.5).known());
}

// Of large cells some 600 pixels are looked at: of a cell of 49 px every second in both directions, of one of 48 all.
TEST(LevelsBehind, LookAtSixHundredPixelsOfLargeCells) {
  for (const int cell : {48, 49}) {
    const GrayFrame frame =
        frame_by(2 * cell, cell, [&](int column, int row) { return column % cell % 2 + row % 2 > 0 ? 200 : 60; });
    const LevelsBehind behind(frame, std::vector<std::uint8_t>(frame.pixels.size(), 0), cell, 0.85);
    EXPECT_EQ(behind.at(cell, 5), cell == 48 ? 200 : 60);
  }
}

// --- painted over

TEST(PaintedOver, HidesWhatDisksCover) {
  const GrayFrame frame = even_frame(31, 23, 100);
  const std::vector<FoundDisk> disks = {found_at(12, 9, 5),      found_at(-2, 11.5, 4), found_at(33.2, 4, 3.5),
                                        found_at(20.5, -3, 4.5), found_at(9, 25, 3),    found_at(60, 9, 5)};
  const std::vector<std::uint8_t> hidden = covered_by(frame, disks, 1.5);
  for (int row = 0; row < 23; ++row)
    for (int column = 0; column < 31; ++column) {
      const bool covered = std::any_of(disks.begin(), disks.end(), [&](const FoundDisk& disk) {
        return std::hypot(column - disk.x_px, row - disk.y_px) <= disk.radius_px + 1.5;
      });
      ASSERT_EQ(hidden[static_cast<std::size_t>(row * 31 + column)] != 0, covered) << column << ' ' << row;
    }
}

// Cells are four radii of the largest disk wide, 40 px here: levels of 50 and 90 on the left and on the right are
// linear between the middles of these. Without noise they are painted as they are.
TEST(PaintedOver, HasTheLevelsBesideTheBeads) {
  GrayFrame frame = frame_by(80, 40, [](int column, int) { return column < 40 ? 50 : 90; });
  test::set(frame, 35, 20, unseen_level);
  const std::vector<FoundDisk> disks = {found_at(40, 20, 10), found_at(12, 30, 4)};
  const auto painted = painted_over(frame, disks, 1, Polarity::bright_beads);
  ASSERT_TRUE(painted);
  for (int row = 0; row < 40; ++row)
    for (int column = 0; column < 80; ++column) {
      const bool covered = std::hypot(column - 40, row - 20) <= 11 || std::hypot(column - 12, row - 30) <= 5;
      const double behind = 50 + 40 * std::clamp((column - 19.5) / 40, 0.0, 1.0);
      if (covered && !(column == 35 && row == 20))
        ASSERT_NEAR(painted->at(column, row), behind, 1e-3) << column << ' ' << row;
      else
        ASSERT_EQ(painted->at(column, row), frame.at(column, row)) << column << ' ' << row;
    }
  EXPECT_FALSE(painted_over(frame, {found_at(40, 20, 60)}, 1, Polarity::bright_beads));
}

// Where a third of the open pixels are bright, what is behind bright beads is dark, and behind dark ones it is bright.
TEST(PaintedOver, LeavesOutWhatMayBeBeadsOfTheOtherShade) {
  const auto level_with = [](double bright_share, Polarity left) {
    const GrayFrame frame =
        frame_by(40, 40, [&](int column, int row) { return 40 * row + column < bright_share * 1600 ? 120 : 30; });
    return painted_over(frame, {found_at(20, 30, 10)}, 0, left)->at(20, 30);
  };
  EXPECT_EQ(level_with(0.35, Polarity::bright_beads), 30);
  EXPECT_EQ(level_with(0.35, Polarity::dark_beads), 120);
  // Of the 1,283 open pixels those of ranks 0.15 and 0.85 decide.
  EXPECT_EQ(level_with(0.11, Polarity::dark_beads), 30);
  EXPECT_EQ(level_with(0.13, Polarity::dark_beads), 120);
  EXPECT_EQ(level_with(0.77, Polarity::bright_beads), 30);
  EXPECT_EQ(level_with(0.81, Polarity::bright_beads), 120);
}

// As noisy as the rest, and without a pattern.
TEST(PaintedOver, IsAsNoisyAsTheRest) {
  const GrayFrame frame = frame_by(120, 120, [](int column, int row) {
    double sum = 0;
    for (int k = 0; k < 12; ++k) sum += test::scattered(31 * column + 17 * k, 13 * row + 29 * k) - 0.5;
    return 100 + 3 * sum;
  });
  const auto painted = painted_over(frame, {found_at(60, 60, 30)}, 0, Polarity::bright_beads);
  double count = 0, mean = 0, square = 0, neighbours = 0;
  const auto gap = [&](int column, int row) { return static_cast<double>(painted->at(column, row)); };
  for (int row = 34; row <= 86; ++row)
    for (int column = 45; column <= 75; ++column) ++count, mean += gap(column, row);
  mean /= count;
  for (int row = 34; row <= 86; ++row)
    for (int column = 45; column <= 75; ++column) {
      square += std::pow(gap(column, row) - mean, 2) / count;
      neighbours += (gap(column, row) - mean) * (gap(column + 1, row) - mean) / count;
    }
  double level = 0, noise = 0;
  for (int column = 0; column < 119; ++column)
    for (int row = 0; row < 28; ++row)
      level += static_cast<double>(frame.at(column, row)) / (119 * 28),
          noise += std::pow(static_cast<double>(frame.at(column, row)) - 100, 2) / (119 * 28);
  EXPECT_NEAR(std::sqrt(square), std::sqrt(noise), 0.15 * std::sqrt(noise));
  EXPECT_NEAR(neighbours / square, 0, 0.08);
  EXPECT_LT(mean, level) << "of rank 0.15";
  EXPECT_NEAR(mean, level - 1.04 * std::sqrt(noise), 0.3 * std::sqrt(noise));
}

// --- free places

TEST(BesideBeads, ACircleNearerThanFourFifthsOfTheSumOfRadiiOverlaps) {
  const std::vector<FoundDisk> disks = {found_at(50, 50, 10), found_at(90, 50, 6)};
  const BesideBeads free(disks);
  for (const double angle : {0.3, 1.9, 3.4, 5.2})
    for (const double radius : {4.0, 10.0, 24.0}) {
      const auto at = [&](double distance) {
        return free.overlapped(50 + distance * std::cos(angle), 50 + distance * std::sin(angle), radius);
      };
      // Beyond the other disk only where that is not overlapped itself.
      EXPECT_TRUE(at(0.8 * (10 + radius) - 0.01)) << angle << ' ' << radius;
      if (std::abs(angle - 3.4) < 0.1) {
        EXPECT_FALSE(at(0.8 * (10 + radius) + 0.01)) << angle << ' ' << radius;
      }
    }
  EXPECT_TRUE(free.overlapped(90, 50 - 0.8 * 16 + 0.01, 10));
  EXPECT_FALSE(free.overlapped(90, 50 - 0.8 * 16 - 0.01, 10));
  // A circle nearly four times as large as the largest disk.
  EXPECT_TRUE(free.overlapped(50 - 0.8 * 49 + 0.01, 50, 39));
  EXPECT_FALSE(free.overlapped(50 - 0.8 * 49 - 0.01, 50, 39));
  EXPECT_FALSE(BesideBeads(std::vector<FoundDisk>{}).overlapped(0, 0, 5));
}

TEST(BesideBeads, APlaceIsAnEighthOfARadiusBeyondTheRim) {
  const std::vector<FoundDisk> disks = {found_at(50, 50, 10), found_at(90, 50, 5)};
  const BesideBeads free(disks);
  EXPECT_FALSE(free.beside_rims(50, 50));
  EXPECT_FALSE(free.beside_rims(50, 38.81));
  EXPECT_TRUE(free.beside_rims(50, 38.79));
  EXPECT_FALSE(free.beside_rims(95.59, 50));
  EXPECT_TRUE(free.beside_rims(95.61, 50));
}

// Of the 32 directions those beside the disks count: at least 15 % of them must be open, and 60 % of these met.
TEST(BesideBeads, ACircleHasEdgesOfItsOwn) {
  Circle circle;
  circle.x = 50, circle.y = 50, circle.radius = 10, circle.directions = 32;
  const auto rim = [&](int k) {
    const double angle = 2 * std::numbers::pi * k / 32;
    return std::pair(50 + 10 * std::cos(angle), 50 + 10 * std::sin(angle));
  };
  for (const int open : {0, 4, 5, 10, 32})
    for (int met = 0; met <= open; ++met) {
      std::vector<FoundDisk> disks;  // a small one at each direction that is not open
      for (int k = open; k < 32; ++k) disks.push_back(found_at(rim(k).first, rim(k).second, 0.5));
      circle.met = 0;
      for (int k = 0; k < met; ++k) circle.met |= std::uint64_t{1} << k;
      for (int k = open; k < 32; ++k) circle.met |= std::uint64_t{1} << k;  // those of the disks are no evidence
      EXPECT_EQ(BesideBeads(disks).has_own_rim(circle), open >= 5 && met >= 0.6 * open) << open << ' ' << met;
    }
}

}  // namespace
}  // namespace shakebed::ingest
