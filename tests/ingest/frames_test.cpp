#include "ingest/frames/frames.hpp"
#include "ingest/frames/atomic_file.hpp"
#include "ingest/frames/png_text.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/ingest/test_files.hpp"

namespace shakebed::ingest {
namespace {

using test::ScratchFolder;

GrayFrame ramp(int width, int height, float first) {
  GrayFrame frame;
  frame.width = width;
  frame.height = height;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column)
      frame.pixels.push_back(std::min(255.0F, first + static_cast<float>(column + 2 * row)));
  return frame;
}

void append(std::string& bytes, std::uint32_t value, int size) {
  for (int k = 0; k < size; ++k) bytes.push_back(static_cast<char>(value >> (8 * k) & 0xffU));
}

// A little-endian TIFF, uncompressed, one strip a page: written here byte by byte so that nothing but the format is
// trusted. `bits` 16 (unsigned) or 32 (float).
void write_tiff(const std::string& path, int width, int height, const std::vector<std::vector<double>>& pages,
                int bits) {
  std::string bytes = "II";
  append(bytes, 42, 2);
  std::size_t link = bytes.size();
  append(bytes, 0, 4);
  for (const auto& page : pages) {
    const auto data_at = static_cast<std::uint32_t>(bytes.size());
    for (const double level : page) {
      if (bits == 16) {
        append(bytes, static_cast<std::uint32_t>(level), 2);
      } else {
        const float single = static_cast<float>(level);
        std::uint32_t word = 0;
        std::memcpy(&word, &single, 4);
        append(bytes, word, 4);
      }
    }
    const auto directory_at = static_cast<std::uint32_t>(bytes.size());
    std::string patch;
    append(patch, directory_at, 4);
    bytes.replace(link, 4, patch);
    const std::vector<std::array<std::uint32_t, 3>> entries = {
        {256, 4, static_cast<std::uint32_t>(width)},
        {257, 4, static_cast<std::uint32_t>(height)},
        {258, 3, static_cast<std::uint32_t>(bits)},
        {259, 3, 1},
        {262, 3, 1},
        {273, 4, data_at},
        {277, 3, 1},
        {278, 4, static_cast<std::uint32_t>(height)},
        {279, 4, static_cast<std::uint32_t>(page.size() * static_cast<std::size_t>(bits) / 8)},
        {339, 3, bits == 32 ? 3U : 1U}};
    append(bytes, static_cast<std::uint32_t>(entries.size()), 2);
    for (const auto& entry : entries) {
      append(bytes, entry[0], 2);
      append(bytes, entry[1], 2);
      append(bytes, 1, 4);
      append(bytes, entry[2], 4);
    }
    link = bytes.size();
    append(bytes, 0, 4);
  }
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST(Frames, PngComesBackAsItWasWritten) {
  const ScratchFolder folder;
  const GrayFrame frame = ramp(31, 17, 3);
  write_png(folder / "a.png", frame);
  const GrayFrame back = read_frame(folder / "a.png");
  EXPECT_EQ(back.width, 31);
  EXPECT_EQ(back.height, 17);
  EXPECT_EQ(back.pixels, frame.pixels);
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) files += entry.exists();
  EXPECT_EQ(files, 1) << "a temporary file was left behind";
}

// A large picture is kept for the next who wants it, but never in place of another of the same name, size and length.
TEST(Frames, ALargePictureThatIsWrittenAnewIsReadAnew) {
  const ScratchFolder folder;
  const std::string path = folder / "large.bmp";
  for (const int level : {50, 60, 60, 70}) {
    cv::imwrite(path, cv::Mat(2000, 2100, CV_8U, cv::Scalar(level)));
    for (int time = 0; time < 2; ++time) {
      GrayFrame frame = read_frame(path);
      ASSERT_EQ(frame.pixels.front(), level);
      ASSERT_EQ(frame.pixels.back(), level);
      frame.pixels.front() = 0;
    }
  }
}

TEST(Frames, ATextStaysInItsPng) {
  const test::ScratchFolder folder;
  GrayFrame frame{7, 5, std::vector<float>(35, 90.0F)};
  frame.pixels[8] = 200;
  write_png(folder / "a.png", frame);
  EXPECT_FALSE(png_text(folder / "a.png", "shakebed"));
  add_png_text(folder / "a.png", "shakebed", "periodic sides");
  const auto text = png_text(folder / "a.png", "shakebed");
  ASSERT_TRUE(text);
  EXPECT_EQ(text->text, "periodic sides");
  EXPECT_EQ(text->width, 7);
  EXPECT_EQ(text->height, 5);
  EXPECT_FALSE(png_text(folder / "a.png", "shake")) << "another keyword";
  EXPECT_EQ(read_frame(folder / "a.png").pixels, frame.pixels);
  std::ofstream(folder / "b.png") << "\x89PNG\r\n\x1a\n and no more";
  EXPECT_FALSE(png_text(folder / "b.png", "shakebed"));
  EXPECT_FALSE(png_text(folder / "nowhere.png", "shakebed"));
}

TEST(Frames, FolderAndGlobAreReadInNaturalOrder) {
  const ScratchFolder folder;
  for (const int k : {10, 2, 1})
    write_png(folder / ("frame" + std::to_string(k) + ".png"), ramp(8, 8, static_cast<float>(k)));
  for (const std::string& path : {folder.path(), folder / "frame*.png"}) {
    FrameSource source = FrameSource::open({path});
    EXPECT_EQ(source.count_if_known(), 3U);
    std::vector<float> seen;
    while (auto frame = source.next()) seen.push_back(frame->pixels[0]);
    EXPECT_EQ(seen, (std::vector<float>{1, 2, 10}));
    source.rewind();
    EXPECT_EQ(source.next()->pixels[0], 1.0F);
  }
}

// By numbers where names have some, whatever their zeros; the shorter name first, in any alphabet.
TEST(Frames, NamesAreInNaturalOrder) {
  const ScratchFolder folder;
  const std::vector<std::string> ordered = {"a",   "a01", "a1", "a1b", "a2", "a10",     "a10b2",   "a10b11",
                                            "a11", "aab", "ab", "abb", "b",  "b\u00e4", "b\u00e4c"};
  for (std::size_t k = ordered.size(); k-- > 0;)
    write_png(folder / (ordered[k] + ".png"), ramp(8, 8, static_cast<float>(k)));
  FrameSource source = FrameSource::open({folder / "*.png"});
  std::vector<std::string> seen;
  for (const FrameOrigin& origin : source.first_origins(ordered.size())) {
    const std::string name = origin.path.substr(origin.path.rfind('/') + 1);
    seen.push_back(name.substr(0, name.size() - 4));
  }
  EXPECT_EQ(seen, ordered);
}

TEST(Frames, StrideKeepsEveryKth) {
  FrameSource source = FrameSource::from_generator(7, [](std::size_t k) { return ramp(4, 4, static_cast<float>(k)); });
  std::size_t count = 0;
  while (source.next()) ++count;
  EXPECT_EQ(count, 7U);
}

TEST(Frames, FirstOriginsAreThoseOfTheFramesAndLeaveTheStreamAtItsBegin) {
  const ScratchFolder folder;
  std::vector<std::string> files;
  for (int k = 0; k < 7; ++k) {
    files.push_back(folder / ("frame" + std::to_string(k) + ".png"));
    write_png(files.back(), ramp(20, 10, static_cast<float>(10 * k)));
  }
  FrameSource source = FrameSource::open(files, {.stride = 2});
  const std::vector<FrameOrigin> origins = source.first_origins(3);
  ASSERT_EQ(origins.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(origins[k].path, files[2 * k]);
  EXPECT_EQ(source.first_origins(100).size(), 4U);
  for (int pass = 0; pass < 2; ++pass) {  // the second pass gives the same frames
    for (int k = 0; k < 7; k += 2) {
      const auto frame = source.next();
      ASSERT_TRUE(frame.has_value());
      EXPECT_EQ(frame->pixels, ramp(20, 10, static_cast<float>(10 * k)).pixels);
    }
    EXPECT_FALSE(source.next().has_value());
    source.rewind();
  }
}

TEST(Frames, SixteenBitsOfWhichTwelveAreUsedFillTheRange) {
  const ScratchFolder folder;
  write_tiff(folder / "deep.tif", 4, 2, {{0, 1000, 2000, 3000, 4095, 10, 20, 30}}, 16);
  const GrayFrame frame = read_frame(folder / "deep.tif");
  EXPECT_FLOAT_EQ(frame.pixels[4], 255.0F);
  EXPECT_NEAR(frame.pixels[2], 2000 * 255.0 / 4095, 1e-3);
}

TEST(Frames, FloatTiffWithHolesStaysFinite) {
  const ScratchFolder folder;
  write_tiff(folder / "f.tif", 2, 2, {{0.0, 0.5, 1.0, std::nan("")}}, 32);
  const GrayFrame frame = read_frame(folder / "f.tif");
  EXPECT_FLOAT_EQ(frame.pixels[1], 127.5F);
  for (const float level : frame.pixels) EXPECT_TRUE(std::isfinite(level));
  write_tiff(folder / "none.tif", 1, 1, {{std::nan("")}}, 32);
  EXPECT_THROW(read_frame(folder / "none.tif"), InputError);
}

TEST(Frames, PagesOfATiffAreFrames) {
  const ScratchFolder folder;
  write_tiff(folder / "pages.tif", 2, 1, {{100, 65535}, {200, 65535}, {300, 65535}}, 16);
  FrameSource source = FrameSource::open({folder / "pages.tif"});
  EXPECT_EQ(source.count_if_known(), 3U);
  FrameOrigin origin;
  for (std::size_t page = 0; page < 3; ++page) {
    const auto frame = source.next(&origin);
    ASSERT_TRUE(frame);
    EXPECT_EQ(origin.page, page);
    EXPECT_NEAR(frame->pixels[0], static_cast<double>(page + 1) * 100 * 255 / 65535, 1e-4);
  }
  EXPECT_FALSE(source.next());
}

// What a file holds counts, not what its name says.
TEST(Frames, ATiffThatIsNamedAsAJpegIsReadAsATiff) {
  const ScratchFolder folder;
  write_tiff(folder / "pages.jpg", 2, 1, {{100, 65535}, {200, 65535}}, 16);
  EXPECT_EQ(FrameSource::open({folder / "pages.jpg"}).count_if_known(), 2U);
  EXPECT_NEAR(read_frame(folder / "pages.jpg", 1).pixels[0], 200.0 * 255 / 65535, 1e-4);
}

TEST(Frames, TransparencyChangesNoLevel) {
  const ScratchFolder folder;
  cv::Mat picture(2, 3, CV_8UC4);
  for (int k = 0; k < 6; ++k) {
    const auto level = static_cast<std::uint8_t>(40 * k);
    picture.at<cv::Vec4b>(k / 3, k % 3) = {level, level, level, static_cast<std::uint8_t>(k % 2 ? 255 : 0)};
  }
  cv::imwrite(folder / "clear.png", picture);
  const GrayFrame frame = read_frame(folder / "clear.png");
  for (std::size_t k = 0; k < 6; ++k) EXPECT_EQ(frame.pixels[k], 40.0F * static_cast<float>(k));
}

// A camera held on its side: the picture is stored lying, and its orientation (EXIF tag 0x112 = 6) says so.
TEST(Frames, APhotographIsTurnedAsItsCameraWasHeld) {
  const ScratchFolder folder;
  cv::Mat lying(16, 32, CV_8U, cv::Scalar(40));
  lying(cv::Rect(0, 0, 16, 16)).setTo(220);
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", lying, jpeg);
  std::string note("Exif\0\0II\x2a\0\x08\0\0\0", 14);
  append(note, 1, 2), append(note, 0x112, 2), append(note, 3, 2), append(note, 1, 4), append(note, 6, 4);
  append(note, 0, 4);
  std::string bytes(jpeg.begin(), jpeg.end()), head = "\xff\xe1";
  head += static_cast<char>(0);
  head += static_cast<char>(note.size() + 2);
  bytes.insert(2, head + note);
  std::ofstream(folder / "held.jpg", std::ios::binary) << bytes;
  const GrayFrame frame = read_frame(folder / "held.jpg");
  ASSERT_EQ(frame.width, 16);
  ASSERT_EQ(frame.height, 32);
  EXPECT_GT(frame.at(8, 4), 200);
  EXPECT_LT(frame.at(8, 28), 60);
}

// Telephones append notes, a second picture or a film, which are no part of the picture. A preview in its header ends
// earlier than the picture does.
TEST(Frames, APhotographEndsAtItsEndOfImageMarker) {
  const ScratchFolder folder;
  cv::Mat noisy(200, 200, CV_8U);
  cv::randu(noisy, 0, 255);
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", noisy, jpeg, {cv::IMWRITE_JPEG_RST_INTERVAL, 7});
  const std::string bytes(jpeg.begin(), jpeg.end()), preview = "\xff\xd8\xff\xd9";
  const auto read = [&](const std::string& contents) {
    std::ofstream(folder / "a.jpg", std::ios::binary) << contents;
    return read_frame(folder / "a.jpg");
  };
  const GrayFrame alone = read(bytes);
  EXPECT_EQ(read(bytes + std::string(10'000, '\x20')).pixels, alone.pixels);
  std::string head = "\xff\xe1";
  head += static_cast<char>(0);
  head += static_cast<char>(preview.size() + 2);
  const std::string previewed = bytes.substr(0, 2) + head + preview + bytes.substr(2);
  EXPECT_EQ(read(previewed).pixels, alone.pixels);
  for (const std::size_t cut : {bytes.size() - 2, bytes.size() / 2, std::size_t{30}}) {
    EXPECT_THROW(read(bytes.substr(0, cut)), InputError) << cut;
    EXPECT_THROW(read(previewed.substr(0, cut)), InputError) << cut;
  }
}

// A film of `count` grey pictures, each with its number written in black and white blocks that survive compression.
constexpr int film_side = 96, film_block = 32;
cv::Mat numbered_picture(std::size_t number) {
  cv::Mat picture(film_side, film_side, CV_8UC3);
  for (int row = 0; row < film_side; ++row)
    for (int column = 0; column < film_side; ++column) {
      const int bit = row / film_block * 3 + column / film_block;
      const std::uint8_t level = number >> bit & 1U ? 220 : 30;
      picture.at<cv::Vec3b>(row, column) = cv::Vec3b(level, level, level);
    }
  return picture;
}
std::size_t number_in(const GrayFrame& frame) {
  std::size_t number = 0;
  for (int bit = 0; bit < 9; ++bit)
    if (frame.at(bit % 3 * film_block + film_block / 2, bit / 3 * film_block + film_block / 2) > 125)
      number |= std::size_t{1} << bit;
  return number;
}
bool write_film(const std::string& path, int code, std::size_t count) {
  cv::VideoWriter writer(path, code, 25, cv::Size(film_side, film_side));
  if (!writer.isOpened()) return false;
  for (std::size_t k = 0; k < count; ++k) writer.write(numbered_picture(k));
  return true;
}

class Films : public testing::TestWithParam<std::pair<const char*, std::array<char, 4>>> {};

TEST_P(Films, FrameKIsTheKthPicture) {
  const ScratchFolder folder;
  const auto& [ending, code] = GetParam();
  const std::string path = folder / (std::string("film.") + ending);
  constexpr std::size_t count = 61;
  if (!write_film(path, cv::VideoWriter::fourcc(code[0], code[1], code[2], code[3]), count))
    GTEST_SKIP() << "this OpenCV cannot write " << ending;
  FrameSource source = FrameSource::open({path});
  FrameOrigin origin;
  for (int pass = 0; pass < 2; ++pass) {
    for (std::size_t k = 0; k < count; ++k) {
      const auto frame = source.next(&origin);
      ASSERT_TRUE(frame) << k;
      EXPECT_EQ(number_in(*frame), k);
      EXPECT_EQ(origin.page, k);
    }
    EXPECT_FALSE(source.next());
    source.rewind();
  }
  // Any order: forwards over several key frames, backwards, the last one.
  for (const std::size_t k : {40UL, 7UL, 60UL, 0UL, 13UL}) EXPECT_EQ(number_in(read_frame(path, k)), k);
  EXPECT_THROW(read_frame(path, count), InputError);
}

TEST(StatedPixelAspect, IsThatOfAFilm) {
  const ScratchFolder folder;
  const std::string path = folder / "film.mp4";
  if (!write_film(path, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 3)) GTEST_SKIP() << "this OpenCV cannot write mp4";
  EXPECT_EQ(stated_pixel_aspect(path), 1);
  test::state_pixel_aspect(path, 64, 45);
  EXPECT_EQ(stated_pixel_aspect(path), 64.0 / 45);
  const std::string odd = folder / "odd.mp4";
  ASSERT_TRUE(write_film(odd, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 1));
  test::state_pixel_aspect(odd, 5, 2);
  EXPECT_EQ(stated_pixel_aspect(odd), 1) << "wider than can be corrected";
  FrameSource source = FrameSource::open({path});
  EXPECT_EQ(number_in(*source.next()), 0U) << "the pictures are as before";
  std::ofstream(folder / "broken.mp4") << "no film";
  EXPECT_EQ(stated_pixel_aspect(folder / "broken.mp4"), 1);
  write_png(folder / "picture.png", ramp(8, 8, 5));
  EXPECT_EQ(stated_pixel_aspect(folder / "picture.png"), 1);
}

TEST_P(Films, StrideStepsOverPicturesExactly) {
  const ScratchFolder folder;
  const auto& [ending, code] = GetParam();
  const std::string path = folder / (std::string("film.") + ending);
  if (!write_film(path, cv::VideoWriter::fourcc(code[0], code[1], code[2], code[3]), 30))
    GTEST_SKIP() << "this OpenCV cannot write " << ending;
  FrameSourceOptions options;
  options.stride = 7;
  // Two films one after the other: 60 pictures, every seventh of the whole stream.
  FrameSource source = FrameSource::open({path, path}, options);
  std::vector<std::size_t> seen, expected;
  while (const auto frame = source.next()) seen.push_back(number_in(*frame));
  for (std::size_t k = 0; k < 60; k += 7) expected.push_back(k % 30);
  EXPECT_EQ(seen, expected);
}

INSTANTIATE_TEST_SUITE_P(Frames, Films,
                         testing::Values(std::pair{"avi", std::array<char, 4>{'M', 'J', 'P', 'G'}},
                                         std::pair{"mp4", std::array<char, 4>{'m', 'p', '4', 'v'}}),
                         [](const auto& test_info) { return std::string(test_info.param.first); });

// The program's own channels are one higher, with the automatic one at 0: it counts on these numbers.
TEST(Frames, ChannelsAreNumberedFromTheAutomaticOneOn) {
  int number = -1;
  for (const Channel channel : {Channel::automatic, Channel::red, Channel::green, Channel::blue, Channel::grey,
                                Channel::saturation, Channel::background_distance, Channel::grey_distance})
    EXPECT_EQ(static_cast<int>(channel), number++) << name_of(channel);
}

// Red beads on green: only one channel shows them well; the choice of the first frame holds for the others.
TEST(Frames, ColourFramesAreReadInTheChannelThatShowsTheBeads) {
  const ScratchFolder folder;
  const auto write = [&](const std::string& name, int blue, int green, int red) {
    cv::Mat picture(60, 60, CV_8UC3, cv::Scalar(90, 200, 100));  // blue, green, red
    cv::circle(picture, {30, 30}, 15, cv::Scalar(blue, green, red), cv::FILLED);
    ASSERT_TRUE(cv::imwrite(folder / name, picture));
  };
  write("1.png", 95, 20, 110);
  write("2.png", 250, 60, 250);
  FrameSource source = FrameSource::open({folder.path()});
  const auto first = source.next(), second = source.next();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->at(30, 30), 20.0F);
  EXPECT_EQ(first->at(2, 2), 200.0F);
  EXPECT_EQ(second->at(30, 30), 60.0F) << "another channel than in the frame before";
  for (const auto& [channel, level] : {std::pair{0, 110.0F}, {1, 20.0F}, {2, 95.0F}}) {
    FrameSourceOptions options;
    options.channel = static_cast<Channel>(channel);
    EXPECT_EQ(read_frame(folder / "1.png", 0, options).at(30, 30), level);
  }
}

TEST(Frames, ErrorsNameTheFileTheProblemAndTheCure) {
  const ScratchFolder folder;
  const auto expect_error = [](const std::string& path, const std::string& part) {
    try {
      FrameSource source = FrameSource::open({path});
      source.next();
      FAIL() << path << " was accepted";
    } catch (const InputError& error) {
      EXPECT_EQ(error.path(), path);
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
      EXPECT_FALSE(error.suggestion().empty());
    }
  };
  expect_error(folder / "absent.png", "no such file");
  expect_error(folder / "absent*.png", "nothing matches");
  std::ofstream(folder / "nothing.png").flush();
  expect_error(folder / "nothing.png", "the file is empty");
  std::ofstream(folder / "text.png") << "this is not a picture";
  expect_error(folder / "text.png", "cannot be read");
  std::ofstream(folder / "notes.txt") << "hello";
  expect_error(folder / "notes.txt", "neither a picture nor a film");
  std::ofstream(folder / "film.mp4") << "no film";
  expect_error(folder / "film.mp4", "cannot be opened");
  std::filesystem::create_directory(folder / "void");
  expect_error(folder / "void", "no picture or film");
  EXPECT_THROW(FrameSource::open({}), InputError);
}

TEST(Frames, TruncatedFilesAreRefused) {
  const ScratchFolder folder;
  write_png(folder / "whole.png", ramp(200, 200, 0));
  std::string bytes;
  {
    std::ifstream in(folder / "whole.png", std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
  for (const std::size_t part : {std::size_t{1}, std::size_t{20}, bytes.size() / 2}) {
    std::ofstream(folder / "cut.png", std::ios::binary) << bytes.substr(0, part);
    EXPECT_THROW(read_frame(folder / "cut.png"), InputError) << part << " bytes";
  }
}

TEST(Frames, EnormousPictureIsRefusedBeforeItIsDecoded) {
  const ScratchFolder folder;
  write_png(folder / "small.png", ramp(8, 8, 0));
  std::string bytes;
  {
    std::ifstream in(folder / "small.png", std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
  // The header says 20,000 x 20,000 (0x4e20).
  bytes.replace(16, 8, std::string("\0\0\x4e\x20\0\0\x4e\x20", 8));
  std::ofstream(folder / "large.png", std::ios::binary) << bytes;
  try {
    read_frame(folder / "large.png");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("20000 x 20000"), std::string::npos) << error.what();
  }
}

TEST(Frames, WritingWhereNothingCanBeWrittenSaysSo) {
  EXPECT_THROW(write_png("/nonexistent_folder/a.png", ramp(4, 4, 0)), OutputError);
  EXPECT_THROW(write_png("a.png", GrayFrame{}), InputError);
}

TEST_P(Films, StateTheirRate) {
  const ScratchFolder folder;
  const auto& [ending, code] = GetParam();
  const std::string path = folder / (std::string("film.") + ending);
  if (!write_film(path, cv::VideoWriter::fourcc(code[0], code[1], code[2], code[3]), 12))
    GTEST_SKIP() << "this OpenCV cannot write " << ending;
  EXPECT_EQ(FrameSource::open({path}).film_rate_hz(), 25);
  EXPECT_EQ(FrameSource::open({path}, {.stride = 5}).film_rate_hz(), 5);
  EXPECT_FALSE(FrameSource::open({path, path}).film_rate_hz()) << "two films have no time in common";
  EXPECT_FALSE(FrameSource::open({path}).count_if_known());
  write_png(folder / "a.png", ramp(8, 8, 1));
  EXPECT_FALSE(FrameSource::open({folder / "a.png"}).film_rate_hz());
}

}  // namespace
}  // namespace shakebed::ingest
