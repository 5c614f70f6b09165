// Candidates drawn into their picture: its size, its colours, and circles where their disks are.
#include "ingest/profile/candidate_picture.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/ingest/by_hand.hpp"
#include "tests/ingest/test_files.hpp"

namespace shakebed::ingest {
namespace {

ChannelFrames three_channels(int width, int height, double red, double green, double blue) {
  ChannelFrames frames;
  frames.width = width, frames.height = height;
  frames.channels = {{Channel::red, test::even_frame(width, height, red)},
                     {Channel::green, test::even_frame(width, height, green)},
                     {Channel::blue, test::even_frame(width, height, blue)}};
  return frames;
}

cv::Mat candidate_drawn(const CandidatePictures& pictures, const SurveyCandidate* candidate) {
  const test::ScratchFolder folder;
  pictures.write(folder / "drawn.png", candidate);
  return cv::imread(folder / "drawn.png", cv::IMREAD_UNCHANGED);
}

TEST(CandidatePicture, HasTheColoursOfItsChannels) {
  ChannelFrames frames = three_channels(40, 20, 200, 100.6, 10.4);
  cv::Mat picture = candidate_drawn(CandidatePictures(frames), nullptr);
  ASSERT_EQ(picture.size(), cv::Size(40, 20));
  ASSERT_EQ(picture.type(), CV_8UC3);
  for (const cv::Point at : {cv::Point(0, 0), cv::Point(39, 19)})
    EXPECT_EQ(picture.at<cv::Vec3b>(at), cv::Vec3b(10, 101, 200)) << "blue, green, red";
  // A channel that is not there is drawn as the first one; one alone is grey, and limited to 0 .. 255.
  frames.channels.pop_back();
  EXPECT_EQ(candidate_drawn(CandidatePictures(frames), nullptr).at<cv::Vec3b>(7, 7), cv::Vec3b(200, 101, 200));
  frames.channels = {{Channel::saturation, test::even_frame(40, 20, 300)}};
  EXPECT_EQ(candidate_drawn(CandidatePictures(frames), nullptr).at<cv::Vec3b>(7, 7), cv::Vec3b(255, 255, 255));
}

// Averages over whole pixels: columns of 0 and 200 by turns are 100.
TEST(CandidatePicture, IsNoLargerThanAsked) {
  ChannelFrames frames;
  frames.width = 120, frames.height = 80;
  frames.channels = {
      {Channel::red, test::frame_by(120, 80, [](int column, int) { return column % 2 == 0 ? 0 : 200; })}};
  cv::Mat picture = candidate_drawn(CandidatePictures(frames, 60), nullptr);
  ASSERT_EQ(picture.size(), cv::Size(60, 40));
  for (const cv::Point at : {cv::Point(0, 0), cv::Point(30, 11), cv::Point(59, 39)})
    EXPECT_EQ(picture.at<cv::Vec3b>(at), cv::Vec3b(100, 100, 100));
  EXPECT_EQ(candidate_drawn(CandidatePictures(frames, 120), nullptr).size(), cv::Size(120, 80));
  EXPECT_EQ(candidate_drawn(CandidatePictures(frames, 500), nullptr).size(), cv::Size(120, 80)) << "never enlarged";
  ChannelFrames upright = three_channels(80, 120, 9, 9, 9);
  EXPECT_EQ(candidate_drawn(CandidatePictures(upright, 60), nullptr).size(), cv::Size(40, 60));
  EXPECT_EQ(candidate_drawn(CandidatePictures(three_channels(1500, 30, 9, 9, 9)), nullptr).cols, 1400);
}

// Mean place, mean distance from it and number of the pixels of a colour, each as far as it has that colour.
struct RingSeen {
  double x = 0, y = 0, radius = 0, pixels = 0;
};
template <class ShareOf>
RingSeen ring_seen(const cv::Mat& picture, const cv::Rect& part, const ShareOf& share_of) {
  RingSeen ring;
  const auto visit = [&](const auto& add) {
    for (int y = part.y; y < part.y + part.height; ++y)
      for (int x = part.x; x < part.x + part.width; ++x) add(x, y, share_of(picture.at<cv::Vec3b>(y, x)) / 255.0);
  };
  visit([&](int x, int y, double share) { ring.x += share * x, ring.y += share * y, ring.pixels += share; });
  ring.x /= ring.pixels, ring.y /= ring.pixels;
  visit([&](int x, int y, double share) { ring.radius += share * std::hypot(x - ring.x, y - ring.y) / ring.pixels; });
  return ring;
}

// A frame that was reduced by two, in a picture half as wide: a quarter of each length, and of each place from the
// upper left corner of the first pixel.
TEST(CandidatePicture, ShowsCirclesWhereTheirDisksAre) {
  ChannelFrames frames = three_channels(200, 100, 0, 0, 0);
  frames.reduction = 2, frames.width = 400, frames.height = 200;
  SurveyCandidate candidate;
  const auto add = [&](double x, double y, double radius, double probability) {
    RimDisk disk;
    disk.circle.x = x, disk.circle.y = y, disk.circle.radius = radius;
    disk.probability = probability;
    candidate.disks.push_back(disk);
  };
  add(80, 90, 40, 0.9);
  add(240, 110, 44, 0.89);
  const cv::Mat picture = candidate_drawn(CandidatePictures(frames, 100), &candidate);
  ASSERT_EQ(picture.size(), cv::Size(100, 50));
  const RingSeen sure = ring_seen(picture, {0, 0, 40, 50}, [](const cv::Vec3b& at) { return at[1] == 0 ? at[0] : 0; });
  EXPECT_NEAR(sure.x, 80.5 / 4 - 0.5, 0.15);
  EXPECT_NEAR(sure.y, 90.5 / 4 - 0.5, 0.15);
  EXPECT_NEAR(sure.radius, 10, 0.2);
  const RingSeen unsure =
      ring_seen(picture, {40, 0, 60, 50}, [](const cv::Vec3b& at) { return at[0] == 0 ? at[2] : 0; });
  EXPECT_NEAR(unsure.x, 240.5 / 4 - 0.5, 0.15);
  EXPECT_NEAR(unsure.y, 110.5 / 4 - 0.5, 0.15);
  EXPECT_NEAR(unsure.radius, 11, 0.2);
  // Rings of more than 12 px are twice as thick.
  candidate.disks.clear();
  add(100, 100, 48, 1), add(300, 100, 50, 1);
  const cv::Mat rings = candidate_drawn(CandidatePictures(frames, 100), &candidate);
  const auto any = [](const cv::Vec3b& at) { return at[0]; };
  const double thin = ring_seen(rings, {0, 0, 50, 50}, any).pixels,
               thick = ring_seen(rings, {50, 0, 50, 50}, any).pixels;
  EXPECT_GT(thick, 1.5 * thin);
  EXPECT_LT(thick, 3.5 * thin);
}

TEST(CandidatePicture, OfAFileIsThatOfItsPage) {
  const test::ScratchFolder folder;
  const std::vector<cv::Mat> pages = {cv::Mat(12, 16, CV_8UC3, cv::Scalar(1, 2, 3)),
                                      cv::Mat(12, 16, CV_8UC3, cv::Scalar(10, 120, 230))};
  ASSERT_TRUE(cv::imwritemulti(folder / "two.tif", pages));
  EXPECT_EQ(candidate_drawn(CandidatePictures(folder / "two.tif", 1), nullptr).at<cv::Vec3b>(5, 5),
            cv::Vec3b(10, 120, 230));
  EXPECT_EQ(candidate_drawn(CandidatePictures(folder / "two.tif", 1, 1, 8), nullptr).size(), cv::Size(8, 6));
  EXPECT_THROW(CandidatePictures(folder / "none.png"), InputError);
}

}  // namespace
}  // namespace shakebed::ingest
