// Beads in one part of a picture whose other part shows something else.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/find/outline.hpp"
#include "ingest/find/survey.hpp"
#include "ingest/profile/photographs.hpp"

namespace shakebed::ingest {
namespace {

struct Middle {
  double x, y;
};

struct Box {
  double from_x, from_y, to_x, to_y;
};

// Loose rows of beads, with places left out at random.
std::vector<Middle> rows_of_beads(const Box& box, double radius) {
  std::mt19937 random(7);
  std::vector<Middle> beads;
  int row = 0;
  for (double y = box.to_y - 1.5 * radius; y > box.from_y + 1.5 * radius; y -= 1.78 * radius, ++row)
    for (double x = box.from_x + (1.5 + row % 2) * radius; x < box.to_x - 1.5 * radius; x += 2.04 * radius)
      if (random() % 12 != 0) beads.push_back({x, y});
  return beads;
}

double distance_to_square(double x, double y, const Middle& middle, double half_side) {
  return std::max(std::abs(x - middle.x), std::abs(y - middle.y)) - half_side;
}

// Bright things on a dark ground, blurred over a pixel. Noise of 3 grey levels.
GrayFrame bright_things(int width, int height, const std::vector<Middle>& beads, const std::vector<Middle>& squares,
                        double radius, double half_side) {
  GrayFrame frame{width, height,
                  std::vector<float>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 60.0F)};
  std::mt19937 random(3);
  const auto draw = [&](const Middle& middle, const std::function<double(double, double)>& outside) {
    const int reach = static_cast<int>(std::max(radius, half_side)) + 4;
    for (int y = std::max(0, static_cast<int>(middle.y) - reach);
         y <= std::min(height - 1, static_cast<int>(middle.y) + reach); ++y)
      for (int x = std::max(0, static_cast<int>(middle.x) - reach);
           x <= std::min(width - 1, static_cast<int>(middle.x) + reach); ++x)
        frame.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] +=
            static_cast<float>(65 * std::erfc(outside(x, y) / 1.2));
  };
  for (const Middle& bead : beads)
    draw(bead, [&](double x, double y) { return std::hypot(x - bead.x, y - bead.y) - radius; });
  for (const Middle& one : squares)
    draw(one, [&](double x, double y) { return distance_to_square(x, y, one, half_side); });
  std::normal_distribution<float> noise(0, 3);
  for (float& level : frame.pixels) level += noise(random);
  return frame;
}

std::vector<Middle> rows_of_squares(const Box& box, double half_side) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> off(0, 0.2 * half_side);
  std::vector<Middle> squares;
  for (double y = box.from_y + 1.5 * half_side; y < box.to_y - 1.5 * half_side; y += 2.6 * half_side)
    for (double x = box.from_x + 1.5 * half_side; x < box.to_x - 1.5 * half_side; x += 2.6 * half_side)
      squares.push_back({x + off(random), y + off(random)});
  return squares;
}

ImageView view_on(const GrayFrame& frame) {
  return {.width = frame.width, .height = frame.height, .pixels = frame.pixels.data(), .type = PixelType::f32};
}

// All beads are found, and no square; that a part was left out is the first that is said.
void expect_beads_alone(const GrayFrame& frame, const std::vector<Middle>& beads, double radius) {
  MeasureOptions options;
  options.bead_diameter_m = 2e-3;
  const BedFound found = measure_bed({view_on(frame)}, options);
  ASSERT_EQ(found.status, FindStatus::ok) << found.message;
  std::size_t hits = 0;
  for (const Middle& bead : beads)
    hits += std::any_of(found.measurement.disks.begin(), found.measurement.disks.end(), [&](const MeasuredDisk& disk) {
      return std::hypot(disk.x_px - bead.x, disk.y_px - bead.y) < 0.25 * radius;
    });
  EXPECT_EQ(hits, beads.size());
  EXPECT_EQ(found.measurement.disks.size(), beads.size());
  const std::vector<std::string>& said = found.measurement.warnings;
  EXPECT_TRUE(std::any_of(said.begin(), said.end(), [](const std::string& one) {
    return one.find("Only a part of the picture shows beads") == 0;
  }));
}

TEST(PartsOfPictures, BeadsBesideSquaresOfTheirSizeAreFoundAlone) {
  constexpr double radius = 12;
  const std::vector<Middle> beads = rows_of_beads({0, 40, 300, 400}, radius);
  expect_beads_alone(bright_things(600, 400, beads, rows_of_squares({306, 0, 600, 400}, radius), radius, radius), beads,
                     radius);
}

TEST(PartsOfPictures, BeadsBelowSquaresOfTheirSizeAreFoundAlone) {
  constexpr double radius = 14;
  const std::vector<Middle> beads = rows_of_beads({0, 310, 520, 600}, radius);
  expect_beads_alone(bright_things(520, 600, beads, rows_of_squares({0, 0, 520, 300}, radius), radius, radius), beads,
                     radius);
}

// Things in one half of the picture that do not touch.
std::vector<Middle> scattered_things(std::size_t count, const Box& box, double apart, unsigned seed) {
  std::mt19937 random(seed);
  const auto between = [&](double from, double to) {
    return from + (to - from) * static_cast<double>(random()) / 4294967296.0;
  };
  std::vector<Middle> things;
  for (int tried = 0; tried < 20000 && things.size() < count; ++tried) {
    const Middle one{between(box.from_x, box.to_x), between(box.from_y, box.to_y)};
    if (std::none_of(things.begin(), things.end(),
                     [&](const Middle& other) { return std::hypot(other.x - one.x, other.y - one.y) < apart; }))
      things.push_back(one);
  }
  return things;
}

// Few of each, apart: squares then are half of a circle less often than what the stretched copies make of them.
TEST(PartsOfPictures, BeadsBesideAsManyUprightSquaresAreFoundAlone) {
  constexpr double radius = 20;
  const std::vector<Middle> beads = scattered_things(58, {24, 24, 476, 676}, 2.9 * radius, 2);
  const std::vector<Middle> squares = scattered_things(52, {524, 24, 976, 676}, 2.9 * radius, 12);
  expect_beads_alone(bright_things(1000, 700, beads, squares, radius, radius), beads, radius);
}

// Stones of all sizes and shades, one over the other.
void lay_gravel(GrayFrame& frame, const Box& box) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> part(0, 1);
  for (int stone = 0; stone < 16000; ++stone) {
    const double x = box.from_x + part(random) * (box.to_x - box.from_x), y = part(random) * frame.height;
    const double wide = 3 + 10 * part(random), high = 3 + 10 * part(random), turn = 3.14 * part(random);
    const double along = std::cos(turn), across = std::sin(turn);
    const auto shade = static_cast<float>(60 + 130 * part(random));
    for (int row = std::max(0, static_cast<int>(y - 13)); row < std::min(frame.height, static_cast<int>(y + 14)); ++row)
      for (int column = std::max(static_cast<int>(box.from_x), static_cast<int>(x - 13));
           column < std::min(frame.width, static_cast<int>(x + 14)); ++column) {
        const double u = ((column - x) * along + (row - y) * across) / wide;
        const double v = ((row - y) * along - (column - x) * across) / high;
        if (u * u + v * v < 1)
          frame.pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width) +
                       static_cast<std::size_t>(column)] = shade;
      }
  }
}

// The part of the picture with most edges holds none of the beads.
TEST(PartsOfPictures, BeadsBesideMuchGravelAreFound) {
  constexpr double radius = 8;
  const std::vector<Middle> beads = rows_of_beads({0, 560, 360, 700}, radius);
  GrayFrame frame = bright_things(1500, 700, beads, {}, radius, radius);
  lay_gravel(frame, {370, 0, 1500, 700});
  ChannelFrames frames;
  frames.width = frame.width, frames.height = frame.height;
  frames.channels = {{Channel::automatic, frame}};
  const Survey survey = take_survey(frames);
  ASSERT_TRUE(survey.found) << survey.why_not;
  const SurveyCandidate& best = survey.candidates.front();
  ASSERT_TRUE(best.region);
  EXPECT_EQ(best.region->left, 0);
  EXPECT_NEAR(best.region->width, 370, 22);  // a block
  EXPECT_GE(best.disks.size(), beads.size() - beads.size() / 20);
  for (const RimDisk& disk : best.disks) EXPECT_LT(disk.circle.x, 370);
}

std::vector<Circle> circles_at(const std::vector<Middle>& middles, double radius) {
  std::vector<Circle> circles;
  for (const Middle& one : middles) circles.push_back({one.x, one.y, radius});
  return circles;
}

TEST(PartsOfPictures, OutlinesTellOnWhichSideOfACutThingsAreRound) {
  constexpr double radius = 12;
  const std::vector<Middle> beads = rows_of_beads({306, 0, 600, 400}, radius),
                            squares = rows_of_squares({0, 0, 300, 400}, radius);
  std::vector<Middle> both = squares;
  both.insert(both.end(), beads.begin(), beads.end());
  const auto side_of = [&](const std::vector<Middle>& round, const std::vector<Middle>& square,
                           const std::vector<Middle>& circles) {
    return roundness_of(find_edges(bright_things(600, 400, round, square, radius, radius)), circles_at(circles, radius),
                        Polarity::bright_beads)
        .round_side;
  };
  const auto side = side_of(beads, squares, both);
  ASSERT_TRUE(side);
  EXPECT_TRUE(side->left_or_right);
  EXPECT_TRUE(side->beyond);
  EXPECT_NEAR(side->at, 303, radius);
  EXPECT_FALSE(side_of(beads, {}, beads));
  EXPECT_FALSE(side_of({}, squares, squares));
  // Every other thing is a square: no cut separates them.
  std::vector<Middle> mixed_beads, mixed_squares;
  for (std::size_t k = 0; k < squares.size(); ++k) (k % 2 == 0 ? mixed_beads : mixed_squares).push_back(squares[k]);
  EXPECT_FALSE(side_of(mixed_beads, mixed_squares, squares));
  // One thing in five beyond the cut is round: beads lie there, too, some of which look otherwise.
  std::vector<Middle> round = beads, square;
  for (std::size_t k = 0; k < squares.size(); ++k) (k % 5 == 0 ? round : square).push_back(squares[k]);
  EXPECT_FALSE(side_of(round, square, both));
}

TEST(PartsOfPictures, DifferWhereTheTextureChanges) {
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0, 1);
  const auto frame_with = [&](float before, float after) {
    GrayFrame frame{640, 400, std::vector<float>(640U * 400U)};
    for (std::size_t k = 0; k < frame.pixels.size(); ++k)
      frame.pixels[k] = 100 + noise(random) * (k % 640 < 220 ? before : after);
    return frame;
  };
  const std::vector<PicturePart> parts = parts_that_differ(frame_with(20, 4));
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_NEAR(parts[0].width, 220, 20);
  EXPECT_EQ(parts[0].width + parts[1].width, 640);
  EXPECT_EQ(parts[1].left, parts[0].width);
  EXPECT_EQ(parts[0].height, 400);
  EXPECT_TRUE(parts_that_differ(frame_with(10, 10)).empty());
}

}  // namespace
}  // namespace shakebed::ingest
