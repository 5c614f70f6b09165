// Disks of two radii laid on a flattened frame, and what they leave: sums done a second time.
#include "ingest/find/laid_disks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "ingest/calibrate/solid_borders.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

using test::frame_by;

// Disks of level 1 on 0 whose edge pixels have the part of their area that is covered, nearly.
GrayFrame flat_disks(int width, int height, const KnownPlaces& places) {
  return frame_by(width, height, [&](int column, int row) {
    double level = 0;
    for (const KnownPlace& place : places)
      level = std::max(level, std::clamp(place.radius - std::hypot(column - place.x, row - place.y) + 0.5, 0.0, 1.0));
    return level;
  });
}
bool has_one_near(const KnownPlaces& places, const KnownPlace& asked, double away) {
  return std::count_if(places.begin(), places.end(), [&](const KnownPlace& place) {
           return std::hypot(place.x - asked.x, place.y - asked.y) < away && place.radius == asked.radius;
         }) == 1;
}

TEST(LaidDisks, HideBeadsAndTheirMargins) {
  const GrayFrame frame = frame_by(31, 23, test::scattered);
  const KnownPlaces places = {{12, 9, 5}, {-2, 11.5, 4}, {33.2, 4, 3.5}, {20.5, -3, 4.5}, {9, 25, 3}, {60, 9, 5}};
  const GrayFrame rest = without_beads(frame, places, 1.25);
  for (int row = 0; row < 23; ++row)
    for (int column = 0; column < 31; ++column) {
      const bool hidden = std::any_of(places.begin(), places.end(), [&](const KnownPlace& place) {
        return std::hypot(column - place.x, row - place.y) <= place.radius + 1.25;
      });
      ASSERT_EQ(rest.at(column, row), hidden ? unseen_level : frame.at(column, row)) << column << ' ' << row;
    }
}

TEST(LaidDisks, LeaveTheMeanSquareOfTheRest) {
  GrayFrame flat = frame_by(40, 30, [](int column, int row) { return 4 * test::scattered(column, row) - 1.5; });
  for (int row = 3; row < 9; ++row) test::set(flat, 7, row, unseen_level);
  const LaidDisks laid{{{14.2, 12.7, 7}}, {{30.5, 20.1, 4}, {38, 2, 4}}};
  double squares = 0, count = 0;
  for (int row = 0; row < 30; ++row)
    for (int column = 0; column < 40; ++column) {
      if (unseen(flat.at(column, row))) continue;
      const bool inside = std::hypot(column - 14.2, row - 12.7) <= 7 || std::hypot(column - 30.5, row - 20.1) <= 4 ||
                          std::hypot(column - 38, row - 2) <= 4;
      const double level = std::max(-0.6, std::min(1.6, static_cast<double>(flat.at(column, row))));
      squares += std::pow(level - (inside ? 1 : 0), 2);
      ++count;
    }
  EXPECT_NEAR(squares_left(flat, laid), squares / count, 1e-6);
  const GrayFrame nothing = test::even_frame(4, 4, unseen_level);
  EXPECT_EQ(squares_left(nothing, {}), 0);
}

// Each in its place and with its radius, touching or not, and none anywhere else.
TEST(LaidDisks, AreWhereTheFrameHasThem) {
  const KnownPlaces large = {{20, 20, 12}, {44, 21, 12}, {90, 60, 12}},
                    small = {{70, 24, 8}, {86, 24, 8}, {30, 58, 8}, {70.5, 60.5, 8}};
  KnownPlaces all = large;
  all.insert(all.end(), small.begin(), small.end());
  const LaidDisks laid = lay_disks(flat_disks(115, 85, all), 12, 8);
  EXPECT_EQ(laid.large.size(), 3U);
  EXPECT_EQ(laid.small.size(), 4U);
  for (const KnownPlace& one : large) EXPECT_TRUE(has_one_near(laid.large, one, 1.2)) << one.x;
  for (const KnownPlace& one : small) EXPECT_TRUE(has_one_near(laid.small, one, 0.8)) << one.x;
}

// The kind with the smaller error decides what the camera adds to the rims of both.
TEST(LaidDisks, AreOfOneCamera) {
  for (const bool by_large : {true, false}) {
    FinderCalibration large, small;
    large.rim_radius_px = 12, large.radius_px = 12.3, large.radius_std_error_px = by_large ? 0.02 : 0.05;
    large.tone_exponent = 0.5, large.radius_of_all_rims = true;
    small.rim_radius_px = 8, small.radius_px = 8.1, small.radius_std_error_px = 0.03;
    small.tone_exponent = 0.9, small.radius_of_all_rims = true;
    share_camera(large, small);
    EXPECT_NEAR(large.radius_px, by_large ? 12.3 : 12.1, 1e-12);
    EXPECT_NEAR(small.radius_px, by_large ? 8.3 : 8.1, 1e-12);
    for (const FinderCalibration* one : {&large, &small}) {
      EXPECT_EQ(one->radius_std_error_px, by_large ? 0.02 : 0.03);
      EXPECT_EQ(one->tone_exponent, by_large ? 0.5 : 0.9);
    }
    EXPECT_EQ(large.radius_of_all_rims, by_large);
    EXPECT_EQ(small.radius_of_all_rims, !by_large);
  }
}

}  // namespace
}  // namespace shakebed::ingest
