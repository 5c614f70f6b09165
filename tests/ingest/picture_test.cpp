// Pictures as grey levels, what is even along their sides, and signs of a drawing.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>
#include <vector>

#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/drawing_signs.hpp"
#include "ingest/frames/frames.hpp"
#include "ingest/frames/grey_levels.hpp"
#include "ingest/frames/picture_files.hpp"
#include "ingest/frames/png_text.hpp"
#include "ingest/frames/repeated_pixels.hpp"
#include "ingest/frames/small_picture.hpp"
#include "tests/ingest/by_hand.hpp"
#include "tests/ingest/test_files.hpp"

namespace shakebed::ingest {
namespace {

using test::even_frame;

GrayFrame grey_of(const cv::Mat& picture, Channel channel, GreyRule* rule = nullptr, int reduction = 1) {
  FrameSourceOptions options;
  options.channel = channel;
  options.reduction = reduction;
  GreyRule own;
  return to_gray(picture, "a.png", options, rule ? *rule : own);
}
// Blue, green, red.
cv::Mat colours_by(int width, int height, int type, const auto& colour_at) {
  cv::Mat picture(height, width, type);
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const std::array<double, 3> c = colour_at(column, row);
      if (type == CV_8UC3)
        picture.at<cv::Vec3b>(row, column) = {static_cast<std::uint8_t>(c[0]), static_cast<std::uint8_t>(c[1]),
                                              static_cast<std::uint8_t>(c[2])};
      else if (type == CV_16UC3)
        picture.at<cv::Vec3w>(row, column) = {static_cast<std::uint16_t>(c[0]), static_cast<std::uint16_t>(c[1]),
                                              static_cast<std::uint16_t>(c[2])};
      else
        picture.at<cv::Vec3f>(row, column) = {static_cast<float>(c[0]), static_cast<float>(c[1]),
                                              static_cast<float>(c[2])};
    }
  return picture;
}

// Of every kind of pixel: red, green, blue, their weights in grey, the largest less the smallest, and the distance from
// the most frequent colour.
TEST(GreyLevels, OfEachChannelAreItsFormula) {
  const auto colour = [](int column, int row) {
    if (column < 12) return std::array<double, 3>{40, 90, 200};
    return std::array<double, 3>{20.0 + 3 * column, 10.0 + 5 * row, 250.0 - 4 * column};
  };
  for (const auto& [type, scale] : {std::pair{CV_8UC3, 1.0}, {CV_16UC3, 1.0}, {CV_32FC3, 1.0}}) {
    const cv::Mat picture = colours_by(20, 10, type, colour);
    for (const Channel channel : {Channel::red, Channel::green, Channel::blue, Channel::grey, Channel::saturation,
                                  Channel::background_distance}) {
      const GrayFrame frame = grey_of(picture, channel);
      for (const auto& [column, row] : {std::array{3, 4}, {13, 2}, {19, 9}, {12, 0}}) {
        const auto [b, g, r] = colour(column, row);
        const double expected = channel == Channel::red     ? r
                                : channel == Channel::green ? g
                                : channel == Channel::blue  ? b
                                : channel == Channel::grey  ? 0.299 * r + 0.587 * g + 0.114 * b
                                : channel == Channel::saturation
                                    ? std::max({b, g, r}) - std::min({b, g, r})
                                    : std::sqrt((std::pow(b - 40, 2) + std::pow(g - 90, 2) + std::pow(r - 200, 2)) / 3);
        EXPECT_NEAR(frame.at(column, row), expected * scale, 0.02)
            << type << ' ' << name_of(channel) << ' ' << column << ' ' << row;
      }
    }
  }
}

// The channel of the greatest spread over its roughness; of equal ones red.
TEST(GreyLevels, AutomaticIsTheChannelThatShowsMost) {
  const auto chosen = [](const auto& colour_at) {
    GreyRule rule;
    grey_of(colours_by(40, 30, CV_8UC3, colour_at), Channel::automatic, &rule);
    return rule.channel;
  };
  const auto disk = [](int column, int row) { return std::hypot(column - 20, row - 15) < 8 ? 1.0 : 0.0; };
  for (std::size_t most = 0; most < 3; ++most) {
    const Channel expected = std::array{Channel::blue, Channel::green, Channel::red}[most];
    EXPECT_EQ(chosen([&](int column, int row) {
                std::array<double, 3> c = {100, 100, 100};
                for (std::size_t k = 0; k < 3; ++k) c[k] += (k == most ? 120 : 60) * disk(column, row);
                return c;
              }),
              expected);
    // As much spread, but rough: worse.
    EXPECT_NE(chosen([&](int column, int row) {
                std::array<double, 3> c = {100, 100, 100};
                for (std::size_t k = 0; k < 3; ++k)
                  c[k] += k == most ? 100 * test::scattered(column, row) : 100 * disk(column, row);
                return c;
              }),
              expected);
  }
  EXPECT_EQ(chosen([&](int column, int row) {
              const double level = 50 + 100 * disk(column, row);
              return std::array<double, 3>{level, level, level};
            }),
            Channel::red);
}

// The rule of the first picture holds for those after it.
TEST(GreyLevels, WordsAndFloatsAreScaledByTheFirstPicture) {
  const auto words = [](std::uint16_t most) {
    cv::Mat picture(2, 3, CV_16U, cv::Scalar(10));
    picture.at<std::uint16_t>(1, 1) = most;
    return picture;
  };
  for (const auto& [most, full] :
       {std::pair{255, 255.0}, {256, 1023.0}, {1023, 1023.0}, {1024, 4095.0}, {4096, 16383.0}, {16384, 65535.0}}) {
    GreyRule rule;
    EXPECT_NEAR(grey_of(words(static_cast<std::uint16_t>(most)), Channel::automatic, &rule).at(1, 1), most * 255 / full,
                1e-3);
    EXPECT_NEAR(grey_of(words(5), Channel::automatic, &rule).at(1, 1), 5 * 255 / full, 1e-4);
  }
  const auto floats = [](float most, float least) {
    cv::Mat picture(2, 3, CV_32F, cv::Scalar(0.25));
    picture.at<float>(0, 1) = most, picture.at<float>(1, 2) = least;
    picture.at<float>(1, 1) = std::numeric_limits<float>::infinity();
    return picture;
  };
  for (const auto& [most, least, scale] : {std::array{1.0, 0.0, 255.0},
                                           {1.01, 0.0, 1.0},
                                           {255.0, 0.0, 1.0},
                                           {510.0, 0.0, 0.5},
                                           {10.0, -510.0, 0.5},
                                           {0.5, -1.0, 255.0}}) {
    GreyRule rule;
    const GrayFrame frame =
        grey_of(floats(static_cast<float>(most), static_cast<float>(least)), Channel::automatic, &rule);
    EXPECT_NEAR(frame.at(1, 0), most * scale, 1e-3);
    EXPECT_NEAR(frame.at(2, 1), least * scale, 1e-3);
    EXPECT_NEAR(frame.at(1, 1), (3 * 0.25 + most + least) / 5 * scale, 1e-3) << "the mean of what is finite";
    EXPECT_NEAR(grey_of(floats(0.75F, 0.5F), Channel::automatic, &rule).at(1, 0), 0.75 * scale, 1e-3);
  }
  EXPECT_THROW(grey_of(cv::Mat(1, 1, CV_32F, cv::Scalar(NAN)), Channel::automatic), InputError);
  EXPECT_THROW(grey_of(cv::Mat(), Channel::automatic), InputError);
  // Two components: the first; four: the last is none.
  EXPECT_EQ(grey_of(cv::Mat(2, 2, CV_8UC2, cv::Scalar(7, 99)), Channel::automatic).at(1, 1), 7);
  EXPECT_EQ(grey_of(cv::Mat(2, 2, CV_8UC4, cv::Scalar(7, 8, 9, 99)), Channel::red).at(1, 1), 9);
  EXPECT_EQ(grey_of(cv::Mat(2, 2, CV_32S, cv::Scalar(300)), Channel::automatic).at(0, 0), 255) << "as floats";
}

TEST(GreyLevels, AreAveragedAndLimited) {
  cv::Mat picture(5, 7, CV_32F);
  for (int row = 0; row < 5; ++row)
    for (int column = 0; column < 7; ++column)
      picture.at<float>(row, column) = static_cast<float>(2 * column + 20 * row);
  const GrayFrame half = grey_of(picture, Channel::automatic, nullptr, 2);
  ASSERT_EQ(half.width, 3);
  ASSERT_EQ(half.height, 2);
  EXPECT_NEAR(half.at(1, 1), 2 * 2.5 + 20 * 2.5, 1e-3);
  EXPECT_EQ(averaged(picture, 3).cols, 2);
  EXPECT_NEAR(averaged(picture, 3).at<float>(0, 1), 2 * 4 + 20, 1e-3);
  FrameSourceOptions options;
  options.largest_frame_pixels = 34;
  GreyRule rule;
  EXPECT_THROW(to_gray(picture, "a.png", options, rule), InputError);
  options.largest_frame_pixels = 35;
  EXPECT_NO_THROW(to_gray(picture, "a.png", options, rule));
  options.largest_frame_pixels = 8, options.reduction = 2;
  EXPECT_NO_THROW(to_gray(picture, "a.png", options, rule));
  options.largest_frame_pixels = 7;
  EXPECT_THROW(to_gray(picture, "a.png", options, rule), InputError);
  // Colour beyond a hundredth of the brightest level.
  EXPECT_FALSE(has_colour(cv::Mat(4, 4, CV_8UC3, cv::Scalar(200, 202, 202))));
  EXPECT_TRUE(has_colour(cv::Mat(4, 4, CV_8UC3, cv::Scalar(200, 202, 203))));
  EXPECT_FALSE(has_colour(cv::Mat(4, 4, CV_8U, cv::Scalar(200))));
}

// Columns are red and green by turns. Of up to six million pixels the saturation of each counts, of more that of two by
// two: as in a survey, which looks at six million at most. By three they are averaged at once.
TEST(GreyLevels, AverageColoursAsFarAsASurveyDoes) {
  const auto striped = [](int width, int height) {
    return colours_by(width, height, CV_8UC3, [](int column, int) {
      return column % 2 == 0 ? std::array<double, 3>{0, 0, 240} : std::array<double, 3>{0, 240, 0};
    });
  };
  EXPECT_EQ(grey_of(striped(40, 20), Channel::saturation, nullptr, 4).at(3, 2), 240);
  const cv::Mat large = striped(3000, 2001);
  const GrayFrame by_four = grey_of(large, Channel::saturation, nullptr, 4);
  ASSERT_EQ(by_four.width, 750);
  ASSERT_EQ(by_four.height, 500);
  EXPECT_EQ(by_four.at(3, 2), 120);
  EXPECT_EQ(grey_of(large, Channel::saturation, nullptr, 3).at(3, 2), 160);
  EXPECT_EQ(reduction_to(6'000'000, 6'000'000), 1);
  EXPECT_EQ(reduction_to(6'000'000, 6'000'001), 2);
  EXPECT_EQ(reduction_to(6'000'000, 24'000'003), 2);
  EXPECT_EQ(reduction_to(6'000'000, 24'000'004), 3);
}

// Pixels that stand there three times along both sides, and not along one alone.
TEST(GreyLevels, RepeatedPixelsAreFoundAndSmoothed) {
  for (const double factor : {2.0, 3.0, 5.0}) {
    const auto at = [&](int k) { return static_cast<int>(std::floor((k + 0.25) / factor)); };
    cv::Mat picture(180, 200, CV_8U), along(180, 200, CV_8U);
    for (int row = 0; row < 180; ++row)
      for (int column = 0; column < 200; ++column) {
        const auto level = [](int x, int y) { return static_cast<std::uint8_t>(255 * test::scattered(x, y)); };
        picture.at<std::uint8_t>(row, column) = level(at(column), at(row));
        along.at<std::uint8_t>(row, column) = level(at(column), row);
      }
    const cv::Mat before = picture.clone();
    EXPECT_NEAR(smooth_repeated_pixels(picture), factor, 0.02) << factor;
    EXPECT_EQ(picture.cols, 200);
    EXPECT_EQ(picture.rows, 180);
    EXPECT_GT(cv::norm(picture, before, cv::NORM_INF), 10);
    const cv::Mat along_before = along.clone();
    EXPECT_EQ(smooth_repeated_pixels(along), 1);
    EXPECT_EQ(cv::norm(along, along_before, cv::NORM_INF), 0);
  }
}

// --- files -----------------------------------------------------------------------------------------------------------

TEST(PictureFiles, AreOfTheKindOfTheirContents) {
  const test::ScratchFolder folder;
  const auto kind = [&](const std::string& name, const std::string& head) {
    std::ofstream(folder / name, std::ios::binary) << head << std::string(32, ' ');
    return kind_of(folder / name);
  };
  EXPECT_EQ(kind("a.txt", std::string("II*\0", 4)), Kind::tiff);
  EXPECT_EQ(kind("b.txt", std::string("MM\0*", 4)), Kind::tiff);
  EXPECT_EQ(kind("c.txt", "\x89PNG"), Kind::image);
  EXPECT_EQ(kind("d.txt", "\xff\xd8\xff"), Kind::image);
  EXPECT_EQ(kind("e.txt", "RIFF1234WEBP"), Kind::image);
  EXPECT_EQ(kind("f.txt", "RIFF1234AVI "), Kind::film);
  EXPECT_EQ(kind("g.txt", "1234ftyp"), Kind::film);
  EXPECT_EQ(kind("h.txt", "\x1a\x45\xdf\xa3"), Kind::film);
  EXPECT_EQ(kind("i.txt", "RIFF1234WAVE"), Kind::unknown);
  EXPECT_EQ(kind("j.mp4", "\x89PNG"), Kind::image) << "what it holds counts";
  for (const char* name : {"a.png", "a.JPG", "a.jpeg", "a.bmp", "a.pgm", "a.ppm", "a.webp", "a.jp2", "a.exr"})
    EXPECT_EQ(kind_of(name), Kind::image) << name;
  for (const char* name : {"a.mp4", "a.avi", "a.mov", "a.mkv", "a.m4v", "a.mpg", "a.mpeg", "a.wmv", "a.webm"})
    EXPECT_EQ(kind_of(name), Kind::film) << name;
  EXPECT_EQ(kind_of("a.TIFF"), Kind::tiff);
  EXPECT_EQ(kind_of("a.tif"), Kind::tiff);
  EXPECT_EQ(kind_of("a.doc"), Kind::unknown);
  EXPECT_TRUE(FrameSource::is_frame_file("a.mp4"));
  EXPECT_FALSE(FrameSource::is_frame_file("a.txt"));
}

// A BMP whose height is negative stands on its head; sizes that cannot be in a file are refused before decoding.
TEST(PictureFiles, StateTheirSize) {
  const test::ScratchFolder folder;
  const auto bmp = [&](std::int32_t width, std::int32_t height) {
    std::string head(64, '\0');
    head[0] = 'B', head[1] = 'M';
    for (std::size_t k = 0; k < 4; ++k) {
      head[18 + k] = static_cast<char>(static_cast<std::uint32_t>(width) >> (8 * k) & 0xffU);
      head[22 + k] = static_cast<char>(static_cast<std::uint32_t>(height) >> (8 * k) & 0xffU);
    }
    std::ofstream(folder / "a.bmp", std::ios::binary) << head;
    try {
      read_frame(folder / "a.bmp");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_TRUE(test::holds(bmp(40000, 30000), "frame of 40000 x 30000 px is too large"));
  EXPECT_TRUE(test::holds(bmp(40000, -30000), "frame of 40000 x 30000 px is too large"));
  EXPECT_TRUE(test::holds(bmp(20000, 10000), "too many for a file of 64 bytes"));
  EXPECT_TRUE(test::holds(bmp(100, 100), "cannot be read"));
  FrameSourceOptions options;
  options.largest_decoded_pixels = 39;
  write_png(folder / "small.png", even_frame(8, 5, 3));
  EXPECT_THROW(read_frame(folder / "small.png", 0, options), InputError);
  options.largest_decoded_pixels = 40;
  EXPECT_EQ(read_frame(folder / "small.png", 0, options).width, 8);
}

// Levels are rounded and clamped; digits in names count as numbers, with or without zeros before them.
TEST(PictureFiles, AreWrittenRoundedAndReadInNaturalOrder) {
  const test::ScratchFolder folder;
  GrayFrame frame = even_frame(4, 1, 0);
  frame.pixels = {-3, 99.4F, 99.6F, 280};
  for (const int compression : {0, 9}) {
    write_png(folder / "a.png", frame, compression);
    EXPECT_EQ(read_frame(folder / "a.png").pixels, (std::vector<float>{0, 99, 100, 255}));
  }
  std::filesystem::remove(folder / "a.png");
  const std::vector<std::string> names = {"b1x.png", "b01y.png", "b2.png", "b10.png", "b10a.png", "b010b.png", "c.png"};
  for (std::size_t k = names.size(); k-- > 0;)
    write_png(folder / names[k], even_frame(3, 3, 10.0 * static_cast<double>(k)));
  FrameSource source = FrameSource::open({folder / "*.png"});
  std::vector<float> order;
  while (const auto one = source.next()) order.push_back(one->pixels.front());
  EXPECT_EQ(order, (std::vector<float>{0, 10, 20, 30, 40, 50, 60}));
  FrameSourceOptions options;
  options.stride = 3;
  FrameSource strided = FrameSource::open({folder / "*.png"}, options);
  EXPECT_EQ(strided.count_if_known(), 3U);
  std::vector<std::size_t> indices;
  while (const auto item = strided.next_item()) indices.push_back(item->index);
  EXPECT_EQ(indices, (std::vector<std::size_t>{0, 1, 2}));
  const ChannelFrames channels = read_channels(folder / "b2.png", 0, 8);
  EXPECT_EQ(channels.reduction, 2);
  EXPECT_EQ(channels.width, 3);
  EXPECT_EQ(channels.channels.size(), 1U);
  EXPECT_EQ(channels.channels[0].frame.width, 1);
  EXPECT_EQ(read_channels(folder / "b2.png", 0, 9).reduction, 1);
}

TEST(PictureFiles, SmallOnesAreAtMostAsWide) {
  const GrayFrame frame = test::frame_by(40, 20, [](int column, int) { return 6 * column; });
  const auto decoded = [&](int width) {
    const std::string bytes = small_webp(frame, width, 100);
    return cv::imdecode(std::vector<std::uint8_t>(bytes.begin(), bytes.end()), cv::IMREAD_GRAYSCALE);
  };
  EXPECT_EQ(decoded(50).cols, 40);
  const cv::Mat small = decoded(10);
  EXPECT_EQ(small.cols, 10);
  EXPECT_EQ(small.rows, 5);
  EXPECT_NEAR(small.at<std::uint8_t>(2, 5), 6 * 21.5, 6);
  for (const auto& [width, height] : {std::pair{0, 0}, {0, 5}, {5, 0}})
    EXPECT_THROW(small_webp({width, height, {}}, 10, 80), InputError) << width << " x " << height;
}

// Texts beyond the first chunk, other keywords, and longer ones that begin alike.
TEST(PictureFiles, HoldTextsByTheirKeyword) {
  const test::ScratchFolder folder;
  write_png(folder / "a.png", even_frame(6, 4, 9));
  add_png_text(folder / "a.png", "one", "first");
  add_png_text(folder / "a.png", "onetwo", "second");
  EXPECT_EQ(png_text(folder / "a.png", "one")->text, "first");
  EXPECT_EQ(png_text(folder / "a.png", "onetwo")->text, "second");
  EXPECT_FALSE(png_text(folder / "a.png", "on"));
  EXPECT_EQ(read_frame(folder / "a.png").width, 6) << "and the file is whole";
  EXPECT_FALSE(cv::imread(folder / "a.png").empty());
}

// --- solid_borders.hpp -----------------------------------------------------------------------------------------------

// A dark band of 12 px along each side of a wavy picture, tilted by a tenth: where it ends, its slope, and its level.
TEST(SolidBorders, EndWhereTheirEvenAreaEnds) {
  for (const FrameSide side : {FrameSide::bottom, FrameSide::top, FrameSide::left, FrameSide::right})
    for (const double slope : {0.0, 0.05}) {
      const bool upright = side == FrameSide::bottom || side == FrameSide::top;
      const GrayFrame frame = test::frame_by(120, 100, [&](int column, int row) {
        const int depth = side == FrameSide::bottom  ? 99 - row
                          : side == FrameSide::top   ? row
                          : side == FrameSide::right ? 119 - column
                                                     : column;
        const int place = upright ? column : row;
        return depth <= 11.5 + slope * place ? 30.0 : 150 + 80 * std::sin(0.4 * column + 0.37 * row);
      });
      const auto borders = find_solid_borders(frame);
      ASSERT_EQ(borders.size(), 1U) << static_cast<int>(side);
      EXPECT_EQ(borders[0].side, side);
      EXPECT_NEAR(borders[0].depth_px, 11, 0.8);
      EXPECT_NEAR(borders[0].slope, slope, 0.01);
      EXPECT_EQ(borders[0].level, 30);
      EXPECT_EQ(borders[0].from, 0);
      EXPECT_EQ(borders[0].to, upright ? 120 : 100);
      // What is hidden is just that, and a margin more or less.
      for (const double margin : {0.0, 3.0, -4.0}) {
        const GrayFrame open = without_borders(frame, borders, margin);
        for (int row = 0; row < 100; ++row)
          for (int column = 0; column < 120; ++column) {
            const int depth = side == FrameSide::bottom  ? 99 - row
                              : side == FrameSide::top   ? row
                              : side == FrameSide::right ? 119 - column
                                                         : column;
            const int place = upright ? column : row;
            const bool hidden = depth <= borders[0].depth_px + borders[0].slope * place + margin;
            ASSERT_EQ(unseen(open.at(column, row)), hidden) << column << ' ' << row;
          }
      }
    }
  EXPECT_TRUE(find_solid_borders(even_frame(100, 90, 50)).empty()) << "nothing but even";
  EXPECT_TRUE(
      find_solid_borders(test::frame_by(63, 100, [](int column, int) { return column < 8 ? 0 : 90 + column; })).empty())
      << "too small a frame";
}

// The mirror image of a picture has the mirror image of its border, place by place.
TEST(SolidBorders, OfAMirrorImageAreTheirMirrorImages) {
  for (const double slope : {-0.08, 0.03, 0.1}) {
    const GrayFrame frame = test::frame_by(160, 120, [&](int column, int row) {
      return 119 - row <= 14.3 + slope * (column - 80) ? 30.0 : 150 + 80 * std::sin(0.4 * column + 0.37 * row);
    });
    const GrayFrame image = test::frame_by(160, 120, [&](int column, int row) { return frame.at(159 - column, row); });
    const auto borders = find_solid_borders(frame), mirrored = find_solid_borders(image);
    ASSERT_EQ(borders.size(), 1U);
    ASSERT_EQ(mirrored.size(), 1U);
    EXPECT_NEAR(mirrored[0].slope, -borders[0].slope, 1e-9);
    for (const int place : {0, 80, 159})
      EXPECT_NEAR(mirrored[0].depth_px + mirrored[0].slope * place,
                  borders[0].depth_px + borders[0].slope * (159 - place), 1e-9);
  }
}

TEST(SolidBorders, ReachToTheirCommonCorner) {
  const GrayFrame frame = even_frame(120, 100, 1);
  std::vector<SolidBorder> borders(3);
  borders[0].side = FrameSide::bottom, borders[0].from = 10, borders[0].to = 110;
  borders[1].side = FrameSide::left, borders[1].from = 5, borders[1].to = 90;
  borders[2].side = FrameSide::top, borders[2].from = 10, borders[2].to = 110;
  complete_corners(borders, frame);
  EXPECT_EQ(borders[0].from, 0);
  EXPECT_EQ(borders[0].to, 110);
  EXPECT_EQ(borders[1].from, 0);
  EXPECT_EQ(borders[1].to, 100);
  EXPECT_EQ(borders[2].from, 0);
  borders[1].side = FrameSide::right, borders[0].from = 10;
  complete_corners(borders, frame);
  EXPECT_EQ(borders[0].from, 10);
  EXPECT_EQ(borders[0].to, 120);
}

// --- drawing_signs.hpp -----------------------------------------------------------------------------------------------

// Flat shares of 3 x 3 pixels, faint ones, and ruled lines of a quarter of a side, counted by hand.
TEST(DrawingSigns, AreCountedInThePicture) {
  GrayFrame frame = even_frame(60, 40, 100);
  DrawingSigns signs = signs_of_drawing(frame);
  EXPECT_EQ(signs.flat_share, 1);
  EXPECT_EQ(signs.faint_share, 0);
  EXPECT_EQ(signs.ruled_lines, 0U);
  // One pixel off by 3 spoils nine squares, faintly; one off by 5 is an edge.
  test::set(frame, 20, 20, 103);
  signs = signs_of_drawing(frame);
  EXPECT_NEAR(signs.flat_share, 1 - 9.0 / (58 * 38), 1e-12);
  EXPECT_NEAR(signs.faint_share, 9.0 / (58 * 38), 1e-12);
  test::set(frame, 20, 20, 105);
  signs = signs_of_drawing(frame);
  EXPECT_NEAR(signs.flat_share, 1 - 9.0 / (58 * 38), 1e-12);
  EXPECT_EQ(signs.faint_share, 0);
  // A line of 15 px is a quarter of the width; of 14 it is none. Both of its sides are one line.
  for (const int length : {15, 14}) {
    GrayFrame ruled = even_frame(60, 40, 100);
    for (int column = 20; column <= 20 + length; ++column) test::set(ruled, column, 20, 20);
    EXPECT_EQ(signs_of_drawing(ruled).ruled_lines, length == 15 ? 1U : 0U) << length;
  }
  // Two rules 12 px apart, and one across them, of 12 px: shorter runs do not count.
  GrayFrame cross = even_frame(60, 40, 100);
  for (int column = 5; column < 55; ++column) test::set(cross, column, 8, 20), test::set(cross, column, 22, 20);
  for (int row = 24; row < 38; ++row) test::set(cross, 30, row, 20);
  EXPECT_EQ(signs_of_drawing(cross).ruled_lines, 3U);
  EXPECT_EQ(signs_of_drawing(even_frame(2, 40, 1)).flat_share, DrawingSigns{}.flat_share);
  // Levels at the limits of a camera are not looked at.
  signs = signs_of_drawing(even_frame(60, 40, 254));
  EXPECT_EQ(signs.flat_share, 1);
  EXPECT_EQ(signs.faint_share, DrawingSigns{}.faint_share);
}

TEST(DrawingSigns, SpeakForADrawingFromTheirLimitsOn) {
  const auto signs_by = [](double flat, double faint, std::size_t lines) {
    DrawingSigns signs;
    signs.flat_share = flat, signs.faint_share = faint, signs.ruled_lines = lines;
    return signs;
  };
  EXPECT_TRUE(signs_by(0.4, 1, 3).looks_ruled());
  EXPECT_FALSE(signs_by(0.39, 1, 3).looks_ruled());
  EXPECT_FALSE(signs_by(0.59, 1, 2).looks_ruled());
  EXPECT_TRUE(signs_by(0.6, 1, 2).looks_ruled());
  EXPECT_FALSE(signs_by(0.9, 1, 1).looks_ruled());
  EXPECT_TRUE(signs_by(0.6, 0.14, 0).looks_drawn());
  EXPECT_FALSE(signs_by(0.6, 0.15, 0).looks_drawn());
  EXPECT_FALSE(signs_by(0.59, 0, 0).looks_drawn());
  EXPECT_NE(why_drawn(signs_by(0.5, 1, 4), 0.49), nullptr);
  EXPECT_EQ(why_drawn(signs_by(0.5, 1, 4), 0.5), nullptr) << "a box, and beads make up the rest";
  EXPECT_NE(why_drawn(signs_by(0.5, 1, 5), 0.9), nullptr);
  EXPECT_NE(why_drawn(signs_by(0.7, 0.1, 0), 0.49), nullptr);
  EXPECT_EQ(why_drawn(signs_by(0.7, 0.1, 0), 0.5), nullptr);
}

// --- picture_parts.hpp, by trying every place ------------------------------------------------------------------------

TEST(PictureParts, TheBusiestIsTheFirstOfMostChange) {
  for (int pattern = 0; pattern < 6; ++pattern)
    for (const ChangeSampling sampling : {ChangeSampling{5, 1, 1}, ChangeSampling{6, 2, 2}, ChangeSampling{7, 2, 3}}) {
      const GrayFrame frame = test::frame_by(53, 47, [&](int column, int row) {
        return 100 * test::scattered(column + 31 * pattern, row) * test::scattered(column / 9 + pattern, row / 8);
      });
      constexpr int side = 22;
      const int block = sampling.block, across = side / block;
      double most = -1;
      int first_column = 0, first_row = 0;
      for (int down = 0; down + across <= 47 / block; ++down)
        for (int over = 0; over + across <= 53 / block; ++over) {
          double change = 0;
          for (int y = down * block; y < (down + across) * block; ++y)
            for (int x = over * block; x < (over + across) * block; ++x) {
              const int in_x = x % block, in_y = y % block;  // of its block
              if (in_x % sampling.stride != 0 || in_y % 2 != 0 || std::max(in_x, in_y) + sampling.reach >= block)
                continue;
              change += std::abs(frame.at(x + sampling.reach, y) - frame.at(x, y)) +
                        std::abs(frame.at(x, y + sampling.reach) - frame.at(x, y));
            }
          if (change > most * (1 + 1e-9)) most = change, first_column = over * block, first_row = down * block;
        }
      const PicturePart part = busiest_part(frame, side, sampling);
      EXPECT_EQ(part.left, std::min(first_column, 53 - side)) << pattern << ' ' << block;
      EXPECT_EQ(part.top, std::min(first_row, 47 - side)) << pattern << ' ' << block;
    }
}

TEST(PictureParts, OfAnEvenPictureAreItsFirst) {
  const PicturePart part = busiest_part(even_frame(53, 47, 9), 22, {5, 1, 1});
  EXPECT_EQ(part.left, 0);
  EXPECT_EQ(part.top, 0);
}

// Eighths of a side apart, and at the far ends: the first that holds most.
TEST(PictureParts, WithMostPlacesIsTheFirstOfAll) {
  for (int pattern = 0; pattern < 12; ++pattern) {
    std::vector<std::pair<double, double>> places;
    for (int k = 0; k < 14; ++k)
      places.emplace_back(100 * test::scattered(k, pattern), 70 * test::scattered(pattern + 5, 3 * k));
    std::vector<int> lefts, tops;
    for (int at = 0; at < 100 - 33; at += 4) lefts.push_back(at);
    for (int at = 0; at < 70 - 33; at += 4) tops.push_back(at);
    lefts.push_back(100 - 33), tops.push_back(70 - 33);
    int most = -1, best_left = 0, best_top = 0;
    for (const int row : tops)
      for (const int column : lefts) {
        int held = 0;
        for (const auto& [x, y] : places) held += x >= column && x < column + 33 && y >= row && y < row + 33;
        if (held > most) most = held, best_left = column, best_top = row;
      }
    const PicturePart part = part_with_most(places, 33, 100, 70);
    EXPECT_EQ(part.left, best_left) << pattern;
    EXPECT_EQ(part.top, best_top) << pattern;
  }
}

}  // namespace
}  // namespace shakebed::ingest
