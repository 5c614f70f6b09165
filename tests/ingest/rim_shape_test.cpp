// Rims of ovals and of capsules' ends beside those of beads.

#include "ingest/find/rim_shape.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <vector>

#include "ingest/find/learn_beads.hpp"
#include "ingest/profile/photographs.hpp"

namespace shakebed::ingest {
namespace {

// Dark things on a bright ground, each a disk moved along a line: a bead (no line) or a capsule; and ovals.
class ShapeScene {
 public:
  ShapeScene(int width, int height) : image_(fine * height, fine * width, CV_32F, cv::Scalar(190)) {}
  void bead(double x, double y, double radius) { oval(x, y, radius, radius, 0); }
  void oval(double x, double y, double along, double across, double angle) {
    each(x, y, along + across, [&](double u, double v) {
      const double a = u * std::cos(angle) + v * std::sin(angle), b = v * std::cos(angle) - u * std::sin(angle);
      return a * a / (along * along) + b * b / (across * across) < 1 ? dark : outside;
    });
  }
  void capsule(double x, double y, double radius, double half_length, double angle) {
    each(x, y, radius + half_length, [&](double u, double v) {
      const double a = u * std::cos(angle) + v * std::sin(angle), b = v * std::cos(angle) - u * std::sin(angle);
      return std::hypot(std::max(0.0, std::abs(a) - half_length), b) < radius ? dark : outside;
    });
  }
  // A sphere of this level or more, lit from the upper left.
  void lit_bead(double x, double y, double radius, double level) {
    each(x, y, radius, [&](double u, double v) {
      const double away = std::hypot(u, v) / radius;
      if (away >= 1) return outside;
      return level + 50 * std::sqrt(1 - away * away) * (0.7 - 0.3 * u / radius - 0.4 * v / radius);
    });
  }
  [[nodiscard]] GrayFrame seen(double blur_px, double noise) const {
    cv::Mat blurred, small;
    cv::GaussianBlur(image_, blurred, cv::Size(), fine * blur_px);
    cv::resize(blurred, small, cv::Size(image_.cols / fine, image_.rows / fine), 0, 0, cv::INTER_AREA);
    std::mt19937 random(5);
    GrayFrame frame;
    frame.width = small.cols, frame.height = small.rows;
    for (int row = 0; row < small.rows; ++row)
      for (int column = 0; column < small.cols; ++column) {
        double sum = -6;
        for (int k = 0; k < 12; ++k) sum += static_cast<double>(random()) / 4294967296.0;
        frame.pixels.push_back(static_cast<float>(std::round(small.at<float>(row, column) + noise * sum)));
      }
    return frame;
  }

 private:
  static constexpr int fine = 4;
  static constexpr double dark = 80, outside = -1;
  template <class Level>
  void each(double x, double y, double reach, const Level& level) {
    for (int row = std::max(0, static_cast<int>(fine * (y - reach - 1)));
         row < std::min(image_.rows, static_cast<int>(fine * (y + reach + 2))); ++row)
      for (int column = std::max(0, static_cast<int>(fine * (x - reach - 1)));
           column < std::min(image_.cols, static_cast<int>(fine * (x + reach + 2))); ++column)
        if (const double its = level((column + 0.5) / fine - 0.5 - x, (row + 0.5) / fine - 0.5 - y); its >= 0)
          image_.at<float>(row, column) = static_cast<float>(its);
  }
  cv::Mat image_;
};

Circle shape_circle(double x, double y, double radius) {
  Circle circle;
  circle.x = x, circle.y = y, circle.radius = radius;
  return circle;
}

std::vector<RimShape> rim_shapes_in(const GrayFrame& frame, const std::vector<Circle>& circles,
                                    const std::vector<Circle>& disks, Polarity polarity = Polarity::dark_beads) {
  RimModel model;
  model.polarity = polarity;
  PictureMaps maps(frame, model.search.wanted_px);
  return shapes_of_rims(maps, model, circles, disks);
}

TEST(RimShape, HasTheElongationOfAnOvalAndNoneOfABead) {
  ShapeScene scene(120, 60);
  scene.bead(30, 30, 14);
  scene.oval(85, 30, 15.5, 12.5, 0.6);
  const std::vector<Circle> circles = {shape_circle(30, 30, 14), shape_circle(85, 30, 14)};
  const std::vector<RimShape> shapes = rim_shapes_in(scene.seen(0.8, 2), circles, circles);
  // To first order a rim of half axes a, b has (a - b) / 2 cos 2(theta - angle).
  const std::complex<double> expected = std::polar(1.5 / 14, 2 * 0.6);
  for (const RimShape& shape : shapes) ASSERT_GT(shape.std_error, 0);
  EXPECT_LT(std::abs(shapes[1].second - expected), 3 * shapes[1].std_error);
  EXPECT_LT(std::abs(shapes[0].second), 3 * shapes[0].std_error);
  EXPECT_LT(shapes[0].std_error, 0.015);
  EXPECT_TRUE(departs_from_round(shapes[1], 0));
  EXPECT_FALSE(departs_from_round(shapes[0], 0));
  // What all have in common is no departure.
  EXPECT_FALSE(departs_from_round(shapes[1], expected));
}

// The negative of a picture has the same shapes, whether their brightness is known or not. A rim of the other sign is
// none.
TEST(RimShape, OfBrightOnesIsThatOfDarkOnes) {
  ShapeScene scene(120, 60);
  scene.bead(30, 30, 14);
  scene.oval(85, 30, 15.5, 12.5, 0.6);
  const std::vector<Circle> circles = {shape_circle(30, 30, 14), shape_circle(85, 30, 14)};
  const GrayFrame dark = scene.seen(0.8, 2);
  GrayFrame bright = dark;
  for (float& level : bright.pixels) level = 255 - level;
  const std::vector<RimShape> expected = rim_shapes_in(dark, circles, circles);
  for (const Polarity polarity : {Polarity::bright_beads, Polarity::automatic}) {
    const std::vector<RimShape> shapes = rim_shapes_in(bright, circles, circles, polarity);
    for (std::size_t k = 0; k < shapes.size(); ++k) {
      EXPECT_NEAR(std::abs(shapes[k].second - expected[k].second), 0, 1e-4);
      EXPECT_NEAR(shapes[k].std_error, expected[k].std_error, 1e-4);
    }
  }
  for (const RimShape& shape : rim_shapes_in(bright, circles, circles, Polarity::dark_beads))
    EXPECT_FALSE(departs_from_round(shape, 0));
}

TEST(RimShape, EndsOfCapsulesDepartWhateverTheirLength) {
  for (const double half_length : {8.0, 14.0, 26.0}) {
    ShapeScene scene(140, 140);
    scene.capsule(70, 70, 13, half_length, 0.4);
    const std::vector<Circle> end = {
        shape_circle(70 + half_length * std::cos(0.4), 70 + half_length * std::sin(0.4), 13)};
    EXPECT_TRUE(departs_from_round(rim_shapes_in(scene.seen(0.8, 3), end, end)[0], 0)) << half_length;
  }
}

TEST(RimShape, RimsOfTouchingNeighboursAreNotABlurredBeadsOwn) {
  ShapeScene scene(140, 100);
  const std::vector<Circle> disks = {shape_circle(70, 50, 6), shape_circle(52, 50, 12), shape_circle(88, 50, 12)};
  for (const Circle& disk : disks) scene.bead(disk.x, disk.y, disk.radius);
  const GrayFrame frame = scene.seen(1.8, 4);
  EXPECT_FALSE(departs_from_round(rim_shapes_in(frame, {disks[0]}, disks)[0], 0));
}

TEST(RimShape, AFewThatDepartAreTakenForErrorsOfRoundOnes) {
  const RimShape round{0.01, 0.01}, oval{0.1, 0.01}, unsure{0.1, 0.03}, unseen{};
  double support = 0.81;
  const auto of = [&](std::size_t rounds, std::size_t ovals) {
    std::vector<RimShape> shapes(rounds, round);
    shapes.insert(shapes.end(), ovals, oval);
    shapes.push_back(unsure), shapes.push_back(unseen);
    std::vector<Circle> circles(shapes.size(), shape_circle(0, 0, 10));
    // Of those that depart nothing follows: ends of capsules are half seen.
    for (std::size_t k = 0; k < circles.size(); ++k)
      circles[k].support = k >= rounds && k < rounds + ovals ? 0 : support;
    return departing_of(shapes, circles, 0);
  };
  EXPECT_EQ(of(95, 4).measured, 100U);
  EXPECT_EQ(of(95, 4).departing, 4U);
  EXPECT_DOUBLE_EQ(of(95, 4).round_nevertheless(), 0.75);
  EXPECT_DOUBLE_EQ(of(99, 0).round_nevertheless(), 1);
  EXPECT_DOUBLE_EQ(of(97, 2).round_nevertheless(), 1);
  EXPECT_FALSE(of(93, 6).more_than_seem());
  EXPECT_TRUE(of(92, 7).more_than_seem());
  EXPECT_FALSE(of(7, 2).more_than_seem());
  EXPECT_TRUE(of(7, 3).more_than_seem());
  EXPECT_FALSE(of(92, 7).most());
  EXPECT_FALSE(of(49, 50).most());
  EXPECT_TRUE(of(49, 51).most());
  // Neighbours cover the rims of round ones: up to 8.5 % seem to depart.
  support = 0.79;
  EXPECT_DOUBLE_EQ(of(89, 10).round_nevertheless(), 0.85);
  EXPECT_FALSE(of(82, 17).more_than_seem());
  EXPECT_TRUE(of(81, 18).more_than_seem());
}

// A pile of beads that cover one another: not two thirds of a rim are seen. Four of 51 rims seem not to be round. None
// is left out, and their probabilities say how many of them may be something else.
TEST(RimShape, BeadsOfAPileAreNotLeftOut) {
  constexpr double radius = 12, apart = 1.7 * radius;
  ShapeScene scene(320, 320);
  std::mt19937 random(9);
  const auto part = [&] { return static_cast<double>(random()) / 4294967296.0; };
  std::vector<Circle> places;
  for (int row = 0; row < 16; ++row)
    for (int column = 0; column < 14; ++column)
      places.push_back(shape_circle(apart * (1 + column + 0.5 * (row % 2)) + 0.17 * apart * (part() - 0.5),
                                    apart * (1 + 0.866 * row) + 0.17 * apart * (part() - 0.5), radius));
  std::shuffle(places.begin(), places.end(), random);
  for (const Circle& one : places) scene.lit_bead(one.x, one.y, radius, 40 + 60 * part());
  const GrayFrame frame = scene.seen(1.6, 3);
  LearnedRims learned = learn_rims(frame, Polarity::dark_beads, radius, Known::beads);
  learn_gaps(frame, learned, true);
  const RimsFound found = find_rims(frame, learned.model);
  EXPECT_GT(found.disks.size(), 40U);
  EXPECT_EQ(found.not_round.size(), 0U);
  std::vector<Circle> circles;
  double support = 0;
  for (const RimDisk& disk : found.disks) circles.push_back(disk.circle), support += disk.circle.support;
  EXPECT_LT(support, 2.0 / 3 * static_cast<double>(circles.size()));
  const std::vector<RimShape> shapes = rim_shapes_in(frame, circles, circles);
  const std::complex<double> shared = shared_second(shapes);
  const Departing departing = departing_of(shapes, circles, shared);
  EXPECT_GT(static_cast<double>(departing.departing), 0.06 * static_cast<double>(departing.measured))
      << "more than of rims seen whole";
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    if (!departs_from_round(shapes[k], shared)) continue;
    EXPECT_LE(found.disks[k].probability, departing.round_nevertheless() + 1e-12);
  }
}

TEST(RimShape, WhatIsSharedIsTheMedianOfThree) {
  const RimShape one{{0.03, 0}, 0.01}, other{{0.05, 0.02}, 0.01}, third{{0.2, -0.1}, 0.01}, unseen{{9, 9}, 0};
  EXPECT_EQ(shared_second({one, other, unseen}), std::complex<double>(0));
  EXPECT_EQ(shared_second({third, one, unseen, other}), std::complex<double>(0.05, 0));
}

TEST(RimShape, CapsulesBesideBeadsAreNotCountedAndItIsSaid) {
  ShapeScene scene(300, 230);
  std::vector<Circle> beads;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 6; ++column) {
      beads.push_back(shape_circle(30 + 47 * column + 3 * row, 30 + 42 * row, 17));
      scene.bead(beads.back().x, beads.back().y, 17);
    }
  for (int k = 0; k < 6; ++k) scene.capsule(34 + 46 * k, 180, 11, 15, 0.9 + 0.5 * k);
  const GrayFrame frame = scene.seen(0.8, 3);
  const DisksFound found = find_disks(
      ImageView{.width = frame.width, .height = frame.height, .pixels = frame.pixels.data(), .type = PixelType::f32});
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found.disks.size(), beads.size());
  for (const FoundDisk& disk : found.disks) EXPECT_LT(disk.y_px, 140);
  bool said = false;
  for (const std::string& one : found.calibration.warnings) said = said || one.find("not round") != std::string::npos;
  EXPECT_TRUE(said);
}

}  // namespace
}  // namespace shakebed::ingest
