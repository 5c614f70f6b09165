// Streams of frames from patterns, folders and generators, colour pictures in each of their channels, and texts in PNG
// files, byte by byte.

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "ingest/frames/frames.hpp"
#include "ingest/frames/picture_files.hpp"
#include "ingest/frames/png_text.hpp"
#include "ingest/frames/stop_question.hpp"
#include "tests/ingest/by_hand.hpp"
#include "tests/ingest/test_files.hpp"

namespace shakebed::ingest {
namespace {

// The first level of each frame of a stream.
std::vector<double> first_levels(FrameSource source) {
  std::vector<double> levels;
  while (const auto frame = source.next()) levels.push_back(static_cast<double>(frame->pixels.front()));
  return levels;
}

// Wildcards in any part of a path; what is no picture, hidden or a folder is passed over.
TEST(FrameStream, PatternsMatchInEachPartOfAPath) {
  const test::ScratchFolder folder;
  namespace fs = std::filesystem;
  for (const char* name : {"run2", "run10", "walk1"}) fs::create_directories(folder / name);
  const auto put = [&](const std::string& name, double level) {
    write_png(folder / name, test::even_frame(4, 3, level));
  };
  put("run2/a1.png", 21), put("run2/a2.png", 22), put("run2/b1.png", 23), put("run2/.a3.png", 24);
  put("run10/a1.png", 101), put("walk1/a1.png", 111), put("run10/a12.png", 102);
  std::ofstream(folder / "run2/a9.txt") << "no picture";
  fs::create_directories(folder / "run10/a5.png");
  const auto found = [&](const std::string& pattern) { return first_levels(FrameSource::open({folder / pattern})); };
  EXPECT_EQ(found("run*/a*.png"), (std::vector<double>{21, 22, 101, 102}));
  EXPECT_EQ(found("run*/a*"), (std::vector<double>{21, 22, 101, 102}));
  EXPECT_EQ(found("run?/a?.png"), (std::vector<double>{21, 22}));
  EXPECT_EQ(found("[rw]*/a1.png"), (std::vector<double>{21, 101, 111}));
  EXPECT_EQ(found("run2/[!b]*.png"), (std::vector<double>{21, 22}));
  EXPECT_EQ(found("run2/.a*.png"), (std::vector<double>{24}));
  EXPECT_EQ(found("run2"), (std::vector<double>{24, 21, 22, 23}));
  EXPECT_THROW(found("nowhere*/a1.png"), InputError);
  EXPECT_THROW(found("run*/c*.png"), InputError);
  // Several paths, in the order given.
  EXPECT_EQ(first_levels(FrameSource::open({folder / "walk1/a1.png", folder / "run10", folder / "run2/b?.png"})),
            (std::vector<double>{111, 101, 102, 23}));
  try {
    FrameSource::open({folder / "run2/a9.txt"});
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()),
              error.path() + ": " + error.problem() + " (" + error.why() + "); " + error.suggestion());
    EXPECT_EQ(error.problem(), "neither a picture nor a film");
  }
}

// Every k-th frame, wherever the stream begins; a stride of 0 is none. Pages of several files are one stream.
TEST(FrameStream, CountsItsFrames) {
  const test::ScratchFolder folder;
  std::vector<cv::Mat> pages;
  for (int k = 0; k < 5; ++k) pages.emplace_back(3, 4, CV_8U, cv::Scalar(10 * k));
  cv::imwritemulti(folder / "pages.tif", pages);
  write_png(folder / "one.png", test::even_frame(4, 3, 99));
  const auto open = [&](std::size_t stride, std::size_t skip = 0) {
    FrameSourceOptions options;
    options.stride = stride, options.skip = skip;
    return FrameSource::open({folder / "pages.tif", folder / "one.png", folder / "pages.tif"}, options);
  };
  EXPECT_EQ(first_levels(open(1)), (std::vector<double>{0, 10, 20, 30, 40, 99, 0, 10, 20, 30, 40}));
  EXPECT_EQ(first_levels(open(0)), first_levels(open(1)));
  EXPECT_EQ(first_levels(open(3)), (std::vector<double>{0, 30, 0, 30}));
  EXPECT_EQ(first_levels(open(5)), (std::vector<double>{0, 99, 40}));
  EXPECT_EQ(open(1).count_if_known(), 11U);
  EXPECT_EQ(open(3).count_if_known(), 4U);
  EXPECT_EQ(open(5).count_if_known(), 3U);
  EXPECT_EQ(first_levels(open(1, 4)), (std::vector<double>{40, 99, 0, 10, 20, 30, 40}));
  EXPECT_EQ(first_levels(open(3, 2)), (std::vector<double>{20, 99, 20}));
  EXPECT_EQ(first_levels(open(2, 11)), (std::vector<double>{}));
  EXPECT_EQ(open(1, 4).count_if_known(), 7U);
  EXPECT_EQ(open(3, 2).count_if_known(), 3U);
  EXPECT_EQ(open(2, 11).count_if_known(), 0U);
  FrameSource late = open(3, 2);
  EXPECT_EQ(late.first_origins(1).front().page, 2U);
  EXPECT_EQ(late.next_item()->index, 0U);
  EXPECT_EQ(late.next_item()->index, 1U) << "of the frames that are kept";
  FrameSource source = open(3);
  const auto origins = source.first_origins(3);
  ASSERT_EQ(origins.size(), 3U);
  EXPECT_EQ(origins[1].page, 3U);
  EXPECT_EQ(origins[2].path, folder / "pages.tif");
  EXPECT_EQ(origins[2].page, 0U);
  FrameOrigin origin;
  for (const std::size_t page : {0U, 3U, 0U, 3U}) {
    ASSERT_TRUE(source.next(&origin));
    EXPECT_EQ(origin.page, page);
  }
  EXPECT_FALSE(source.next(&origin));
  EXPECT_FALSE(source.next_item());
  source.rewind();
  EXPECT_EQ(source.next_item()->index, 0U);
  EXPECT_EQ(source.next_item()->index, 1U);
  EXPECT_THROW(read_frame(folder / "pages.tif", 5), InputError);
  EXPECT_EQ(read_frame(folder / "pages.tif", 4).pixels.front(), 40);
}

TEST(FrameStream, OfAGeneratorIsWhatItMakes) {
  std::vector<std::size_t> made;
  FrameSource source = FrameSource::from_generator(3, [&](std::size_t k) {
    made.push_back(k);
    return test::even_frame(2, 2, 5.0 * static_cast<double>(k));
  });
  EXPECT_EQ(source.count_if_known(), 3U);
  FrameOrigin origin;
  EXPECT_EQ(source.next(&origin)->pixels.front(), 0);
  EXPECT_EQ(source.next(&origin)->pixels.front(), 5);
  EXPECT_EQ(origin.path, "frame 1");
  source.rewind();
  EXPECT_EQ(source.next(&origin)->pixels.front(), 0);
  EXPECT_EQ(made, (std::vector<std::size_t>{0, 1, 0}));
  EXPECT_EQ(source.first_origins(9).size(), 3U);
  EXPECT_EQ(made.size(), 3U) << "nothing is made for it";
  EXPECT_FALSE(source.film_rate_hz());
  EXPECT_EQ(first_levels(FrameSource::from_frames({test::even_frame(2, 2, 7), test::even_frame(3, 3, 8)})),
            (std::vector<double>{7, 8}));
}

// A picture that cannot be read is an error in its place; the frames after it follow, in the channel of the first that
// could be read.
TEST(FrameStream, GoesOnAfterABadPicture) {
  const test::ScratchFolder folder;
  const auto colour = [&](const std::string& name, double blue, double green, double red) {
    cv::Mat picture(40, 40, CV_8UC3, cv::Scalar(100, 100, 100));
    picture(cv::Rect(10, 10, 20, 20)).setTo(cv::Scalar(blue, green, red));
    cv::imwrite(folder / name, picture);
  };
  std::ofstream(folder / "1.png") << "no picture";
  colour("2.png", 200, 110, 110);  // blue shows it
  std::ofstream(folder / "3.png") << "no picture";
  colour("4.png", 150, 110, 250);
  FrameSource source = FrameSource::open({folder.path()});
  for (int pass = 0; pass < 2; ++pass) {
    EXPECT_THROW(source.next(), InputError);
    EXPECT_EQ(source.next()->at(20, 20), 200);
    auto item = source.next_item();
    EXPECT_EQ(item->index, 2U);
    EXPECT_THROW(item->decode(), InputError);
    EXPECT_EQ(source.next()->at(20, 20), 150) << "in blue as before, though red shows more";
    EXPECT_FALSE(source.next());
    source.rewind();
  }
}

// All channels of a colour picture with their names; one alone of a grey one, or where one is asked for.
TEST(FrameStream, HasTheChannelsOfAPicture) {
  const test::ScratchFolder folder;
  cv::Mat picture(9, 12, CV_8UC3, cv::Scalar(20, 60, 180));
  picture.at<cv::Vec3b>(4, 5) = {40, 240, 200};
  cv::imwrite(folder / "colour.png", picture);
  const ChannelFrames all = read_channels(folder / "colour.png");
  ASSERT_EQ(all.channels.size(), 6U);
  const std::array<std::pair<const char*, double>, 6> expected = {
      {{"grey", 0.299 * 200 + 0.587 * 240 + 0.114 * 40},
       {"red", 200},
       {"background_distance", std::sqrt((20.0 * 20 + 180.0 * 180 + 20.0 * 20) / 3)},
       {"saturation", 200},
       {"blue", 40},
       {"green", 240}}};
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_STREQ(name_of(all.channels[k].channel), expected[k].first);
    EXPECT_NEAR(all.channels[k].frame.at(5, 4), expected[k].second, 0.01) << expected[k].first;
  }
  EXPECT_STREQ(name_of(Channel::automatic), "automatic");
  EXPECT_EQ(all.width, 12);
  EXPECT_EQ(all.height, 9);
  EXPECT_EQ(all.reduction, 1);
  FrameSourceOptions options;
  options.channel = Channel::blue;
  const ChannelFrames blue = read_channels(folder / "colour.png", 0, 27, options);
  ASSERT_EQ(blue.channels.size(), 1U);
  EXPECT_EQ(blue.channels[0].channel, Channel::blue);
  EXPECT_EQ(blue.reduction, 2) << "108 pixels become 27";
  EXPECT_EQ(blue.channels[0].frame.width, 6);
  EXPECT_EQ(blue.channels[0].frame.height, 4);
  EXPECT_EQ(blue.channels[0].frame.at(2, 2), 25) << "the mean of 20, 20, 20 and 40";
  EXPECT_EQ(read_channels(folder / "colour.png", 0, 26, options).reduction, 3);
  // Enlarged pictures say by how much, also once they are reduced.
  cv::Mat large(200, 240, CV_8U);
  for (int row = 0; row < 200; ++row)
    for (int column = 0; column < 240; ++column)
      large.at<std::uint8_t>(row, column) = static_cast<std::uint8_t>(255 * test::scattered(column / 4, row / 4));
  cv::imwrite(folder / "large.png", large);
  EXPECT_NEAR(read_channels(folder / "large.png").channels[0].frame.enlargement, 4, 0.01);
  EXPECT_NEAR(read_frame(folder / "large.png").enlargement, 4, 0.01);
  options = {};
  options.reduction = 2;
  EXPECT_NEAR(read_frame(folder / "large.png", 0, options).enlargement, 2, 0.01);
  options.reduction = 5;
  EXPECT_EQ(read_frame(folder / "large.png", 0, options).enlargement, 1);
  EXPECT_EQ(read_frame(folder / "colour.png").enlargement, 1);
}

// A text chunk stands behind the header: its length, its kind, keyword and text, and the check sum (CRC-32) that zlib
// gives for it.
TEST(PngTexts, AreChunksOfTheirFile) {
  const test::ScratchFolder folder;
  const auto bytes_of = [](const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(in), {}};
  };
  write_png(folder / "a.png", test::even_frame(6, 4, 9));
  const std::string before = bytes_of(folder / "a.png");
  add_png_text(folder / "a.png", "key", "word");
  const std::string chunk("\0\0\0\x08tEXtkey\0word\x66\x9d\xb4\x87", 20);
  EXPECT_EQ(bytes_of(folder / "a.png"), before.substr(0, 33) + chunk + before.substr(33));
  write_png(folder / "a.png", test::even_frame(6, 4, 9));
  add_png_text(folder / "a.png", "a", "\xe9\xff");
  EXPECT_EQ(bytes_of(folder / "a.png").substr(33, 16), std::string("\0\0\0\x04tEXt"
                                                                   "a\0\xe9\xff\x96\xa0\xe1\x06",
                                                                   16));
  EXPECT_EQ(png_text(folder / "a.png", "a")->text, "\xe9\xff");
  // Other files stay as they are.
  std::ofstream(folder / "b.txt") << "not a picture, but as long as a header of PNG would be";
  const std::string text = bytes_of(folder / "b.txt");
  add_png_text(folder / "b.txt", "key", "word");
  EXPECT_EQ(bytes_of(folder / "b.txt"), text);
  // What follows the pixels is not looked at; long chunks before them are passed over.
  const auto with = [&](std::size_t at, const std::string& piece) {
    std::ofstream(folder / "c.png", std::ios::binary) << before.substr(0, at) + piece + before.substr(at);
    return png_text(folder / "c.png", "key");
  };
  EXPECT_TRUE(with(33, chunk));
  EXPECT_FALSE(with(before.size() - 12, chunk));
  for (const std::size_t length : {65536U, 65537U}) {
    std::string piece("\0\x01\0\0tEXtkey\0", 12);
    piece[3] = static_cast<char>(length - 65536);
    piece += std::string(length - 4, 'x') + std::string(4, '\0');
    EXPECT_EQ(with(33, piece).has_value(), length == 65536) << "longer texts are none";
    const auto later = with(33, piece + chunk);
    ASSERT_TRUE(later);
    EXPECT_EQ(later->text.size(), length == 65536 ? 65532U : 4U);
    EXPECT_EQ(later->width, 6);
    EXPECT_EQ(later->height, 4);
  }
}

// The innermost question is asked, and the outer one again once that is gone.
TEST(StopQuestions, AreAskedFromTheInside) {
  EXPECT_NO_THROW(StopQuestion::ask());
  EXPECT_FALSE(StopQuestion::of_thread());
  int outer = 0, inner = 0;
  {
    const StopQuestion one([&] { ++outer; });
    StopQuestion::ask();
    {
      const StopQuestion other([&] { ++inner; });
      StopQuestion::ask(), StopQuestion::of_thread()();
    }
    {
      const StopQuestion silent{{}};
      EXPECT_NO_THROW(StopQuestion::ask());
    }
    StopQuestion::ask();
  }
  EXPECT_EQ(outer, 2);
  EXPECT_EQ(inner, 2);
  EXPECT_FALSE(StopQuestion::of_thread());
}

}  // namespace
}  // namespace shakebed::ingest
