// Pictures that were enlarged by repeating pixels: by any factor, in pixels of any kind, and those that were not.

#include "ingest/frames/repeated_pixels.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <opencv2/core.hpp>

#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

// The pixel of the original that stands at this one of the enlarged picture.
int original_of(int place, double factor, double shift) {
  return static_cast<int>(std::floor((place + shift) / factor));
}

// Neighbours differ by 10 to 80 levels.
double original_level(int column, int row, int component = 0) {
  return 40 + 45 * (column & 1) + 35 * test::scattered(column, component) + 40 * (row & 1) +
         30 * test::scattered(component + 7, row);
}

// A picture of 230 x 200 px in which each pixel stands `across` and `down` times beside and below itself.
cv::Mat enlarged(double across, double down, int type, double shift = 0.3) {
  cv::Mat picture(200, 230, type);
  const int parts = picture.channels();
  for (int row = 0; row < 200; ++row)
    for (int column = 0; column < 230; ++column)
      for (int k = 0; k < parts; ++k) {
        const double level = original_level(original_of(column, across, shift), original_of(row, down, shift), k);
        const int at = column * parts + k;
        if (picture.depth() == CV_8U)
          picture.ptr<std::uint8_t>(row)[at] = static_cast<std::uint8_t>(level);
        else if (picture.depth() == CV_16U)
          picture.ptr<std::uint16_t>(row)[at] = static_cast<std::uint16_t>(200 * level);
        else
          picture.ptr<float>(row)[at] = static_cast<float>(level);
      }
  return picture;
}
double level_in(const cv::Mat& picture, int column, int row, int part) {
  const int at = column * picture.channels() + part;
  if (picture.depth() == CV_8U) return picture.ptr<std::uint8_t>(row)[at];
  if (picture.depth() == CV_16U) return picture.ptr<std::uint16_t>(row)[at] / 200.0;
  return static_cast<double>(picture.ptr<float>(row)[at]);
}

// Between the middles of the pixels that stood there, levels are bilinear.
void expect_smoothed(double factor, int type, double shift) {
  cv::Mat picture = enlarged(factor, factor, type, shift);
  EXPECT_NEAR(smooth_repeated_pixels(picture), factor, 0.01 * factor) << factor;
  ASSERT_EQ(picture.cols, 230);
  ASSERT_EQ(picture.rows, 200);
  // A step stands half a pixel before the first pixel beyond it: of a whole factor always as far from the lattice, of
  // another one by half a pixel more or less.
  const bool whole = factor == std::floor(factor);
  const double first = whole ? std::ceil(shift) - 0.5 : shift;
  const auto place_of = [&](int px) { return (px + first) / factor - 0.5; };  // in pixels of the original
  double worst = 0, mean = 0, count = 0;
  for (int row = 10; row < 190; ++row)
    for (int column = 10; column < 220; ++column)
      for (int k = 0; k < picture.channels(); ++k) {
        const double x = place_of(column), y = place_of(row);
        const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
        const double u = x - left, v = y - top;
        const double expected =
            (1 - v) * ((1 - u) * original_level(left, top, k) + u * original_level(left + 1, top, k)) +
            v * ((1 - u) * original_level(left, top + 1, k) + u * original_level(left + 1, top + 1, k));
        const double off = std::abs(level_in(picture, column, row, k) - expected);
        worst = std::max(worst, off), mean += off, ++count;
      }
  EXPECT_LT(worst, whole ? 3 : 160 * 0.5 / factor) << factor << ": places are known to 1/32 px";
  EXPECT_LT(mean / count, whole ? 0.8 : 80 * 0.3 / factor) << factor;
}

TEST(RepeatedPixels, AreDrawnAnewByAnyFactor) {
  for (const double factor : {2.0, 2.6, 3.0, 3.7, 5.3}) expect_smoothed(factor, CV_8U, 0.3);
  expect_smoothed(3, CV_8U, 1.5);
  expect_smoothed(4, CV_16U, 0.4);
  expect_smoothed(3, CV_32F, 2.2);
  expect_smoothed(3, CV_8UC3, 0.6);
}

// Of a whole factor the smoothed picture goes through the originals in their middles.
TEST(RepeatedPixels, KeepTheOriginalsInTheirMiddles) {
  for (const int factor : {3, 5}) {
    cv::Mat picture = enlarged(factor, factor, CV_32F, 0.001);
    EXPECT_NEAR(smooth_repeated_pixels(picture), factor, 1e-3);
    for (int row = factor / 2; row < 200; row += factor)
      for (int column = factor / 2; column < 230; column += factor)
        ASSERT_NEAR(level_in(picture, column, row, 0), original_level(column / factor, row / factor), 0.6)
            << factor << ' ' << column << ' ' << row;
  }
}

// The two sides must be enlarged alike, within a twentieth; and by two at least.
TEST(RepeatedPixels, StandAsOftenAlongBothSides) {
  const auto found = [](double across, double down) {
    cv::Mat picture = enlarged(across, down, CV_8U);
    const cv::Mat before = picture.clone();
    const double factor = smooth_repeated_pixels(picture);
    EXPECT_EQ(factor == 1, cv::norm(picture, before, cv::NORM_INF) == 0) << across << ' ' << down;
    return factor;
  };
  EXPECT_NEAR(found(4, 4.15), std::sqrt(4 * 4.15), 0.03);
  EXPECT_NEAR(found(4.15, 4), std::sqrt(4 * 4.15), 0.03);
  EXPECT_EQ(found(4, 4.3), 1);
  EXPECT_EQ(found(4.3, 4), 1);
  EXPECT_EQ(found(1.8, 1.8), 1);
  EXPECT_EQ(found(1, 1), 1);
}

// Thirty steps at least: a picture of 60 px has 29 where each pixel stands there twice.
TEST(RepeatedPixels, ShowThirtySteps) {
  for (const int side : {59, 60, 64}) {
    const cv::Mat whole = enlarged(2, 2, CV_8U, 0.001);
    cv::Mat across = whole(cv::Rect(0, 0, side, 200)).clone(), down = whole(cv::Rect(0, 0, 230, side)).clone();
    EXPECT_NEAR(smooth_repeated_pixels(across), side == 64 ? 2 : 1, 0.01) << side;
    EXPECT_NEAR(smooth_repeated_pixels(down), side == 64 ? 2 : 1, 0.01) << side;
  }
}

// What compression leaves between repeats does no harm while it is far below the steps. Steps that are off the lattice
// do, unless they are few, and so does a picture in which most steps are missing.
TEST(RepeatedPixels, MayBeCompressedButNotDrawnOver) {
  const auto with_grain = [](double grain) {
    cv::Mat picture = enlarged(4, 4, CV_8U);
    for (int row = 0; row < 200; ++row)
      for (int column = 0; column < 230; ++column)
        picture.at<std::uint8_t>(row, column) =
            static_cast<std::uint8_t>(picture.at<std::uint8_t>(row, column) + grain * test::scattered(column, row));
    return smooth_repeated_pixels(picture);
  };
  EXPECT_NEAR(with_grain(2), 4, 0.02);
  EXPECT_EQ(with_grain(40), 1);
  const auto with_displaced = [](int lines) {  // steps that stand a pixel farther
    const cv::Mat lattice = enlarged(4, 4, CV_8U, 0.001);
    cv::Mat picture = lattice.clone();
    for (int k = 1; k <= lines; ++k) lattice.col(40 * k - 1).copyTo(picture.col(40 * k));
    return smooth_repeated_pixels(picture);
  };
  EXPECT_NEAR(with_displaced(1), 4, 0.02) << "one of 57 is off the lattice";
  EXPECT_EQ(with_displaced(2), 1);
  const auto with_steps_in = [](int of_five) {  // so many of five neighbouring originals differ
    cv::Mat picture(200, 230, CV_8U);
    const auto kind = [&](int k) { return 5 * (k / 5) + std::max(0, k % 5 - 5 + of_five); };
    for (int row = 0; row < 200; ++row)
      for (int column = 0; column < 230; ++column)
        picture.at<std::uint8_t>(row, column) =
            static_cast<std::uint8_t>(original_level(kind(column / 2), kind(row / 2)));
    return smooth_repeated_pixels(picture);
  };
  EXPECT_NEAR(with_steps_in(3), 2, 0.01);
  EXPECT_NE(with_steps_in(2), 2);
}

}  // namespace
}  // namespace shakebed::ingest
