// The level of the background, which follows the light, and how far a picture is from it.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "ingest/frames/background_level.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "tests/ingest/test_files.hpp"

namespace shakebed::ingest::background_level_test {
namespace {

constexpr int width = 300, height = 200;

// Light that falls off towards the upper left and the edges.
double light_at(double u, double v) { return 100 + 15 * u + 8 * v - 6 * u * u + 3 * u * v; }

// Of which disks with a slope from 20 to 220 cover a half.
GrayFrame slopes_on_uneven_light() {
  RandomStream random(3);
  GrayFrame frame{width, height, {}};
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const double x = column % 25 - 12, y = row % 25 - 12;
      const bool covered = std::hypot(x, y) < 10;
      const double level =
          covered ? 120 + 10 * x : light_at((2 * column + 1.0) / width - 1, (2 * row + 1.0) / height - 1);
      frame.pixels.push_back(static_cast<float>(level + 2 * random.normal()));
    }
  return frame;
}

TEST(BackgroundLevel, FollowsTheLightBetweenDisks) {
  const BackgroundLevel background(slopes_on_uneven_light());
  for (const double u : {-0.95, -0.4, 0.0, 0.5, 0.95})
    for (const double v : {-0.95, 0.0, 0.95}) EXPECT_NEAR(background.at(u, v), light_at(u, v), 1.5) << u << ' ' << v;
}

// Where one level fills the picture but for one side, the other side does not bend it.
TEST(BackgroundLevel, IsFlatWhereTheRestShowsNoBackground) {
  GrayFrame frame{width, height, {}};
  for (int k = 0; k < width * height; ++k) frame.pixels.push_back(k % width < 200 ? 90.F : 250.F);
  const BackgroundLevel background(frame);
  for (const double u : {-0.9, 0.0, 0.9}) EXPECT_NEAR(background.at(u, 0), 90, 0.5);
}

TEST(BackgroundLevel, GivesTheDistanceOfEachPixel) {
  GrayFrame frame{width, height, std::vector<float>(width * height, 90)};
  frame.pixels[0] = 30, frame.pixels[1] = 130;
  frame.enlargement = 2;
  const GrayFrame distance = BackgroundLevel(frame).distance_of(frame);
  EXPECT_NEAR(distance.at(0, 0), 60, 0.1);
  EXPECT_NEAR(distance.at(1, 0), 40, 0.1);
  EXPECT_NEAR(distance.at(2, 0), 0, 0.1);
  EXPECT_EQ(distance.enlargement, 2);
}

// A file of one component, and of three. The background of a stream is that of its first frame.
TEST(BackgroundLevel, IsTakenFromFilesOfGreyAndOfColours) {
  const test::ScratchFolder folder;
  cv::Mat grey(60, 80, CV_8U, cv::Scalar(90));
  grey.at<std::uint8_t>(7, 9) = 30;
  cv::imwrite(folder / "a1.png", grey);
  cv::imwrite(folder / "a2.png", grey + 5);
  cv::Mat colours(60, 80, CV_8UC3, cv::Scalar(20, 60, 180));
  colours.at<cv::Vec3b>(7, 9) = {120, 160, 80};
  cv::imwrite(folder / "b.png", colours);
  FrameSourceOptions options;
  options.channel = Channel::grey_distance;
  FrameSource stream = FrameSource::open({folder / "a1.png", folder / "a2.png"}, options);
  const auto first = stream.next(), second = stream.next();
  ASSERT_TRUE(first && second);
  EXPECT_NEAR(first->at(9, 7), 60, 0.1);
  EXPECT_NEAR(first->at(1, 1), 0, 0.1);
  EXPECT_NEAR(second->at(1, 1), 5, 0.1);
  const GrayFrame of_colours = read_frame(folder / "b.png", 0, options);
  EXPECT_NEAR(of_colours.at(9, 7), 0.114 * 100 + 0.587 * 100 - 0.299 * 100, 0.2);
  EXPECT_NEAR(grey_distance_of(read_channels(folder / "b.png")).at(9, 7), of_colours.at(9, 7), 1e-3);
  EXPECT_NEAR(grey_distance_of(read_channels(folder / "a1.png")).at(9, 7), 60, 0.1);
  ASSERT_EQ(read_channels(folder / "a1.png", 0, surveyed_pixels, options).channels.size(), 1U);
}

}  // namespace
}  // namespace shakebed::ingest::background_level_test
