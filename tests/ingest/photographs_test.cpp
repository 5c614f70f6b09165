#include "ingest/profile/photographs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "ingest/frames/stop_question.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/test_files.hpp"

namespace shakebed::ingest {
namespace {

// A bed in a picture of whole levels, so that 8 bits hold it exactly.
GrayFrame drawn(std::uint64_t seed) {
  const auto disks = make_synthetic_bed(
      {.left_wall_px = 20, .right_wall_px = 280, .floor_px = 220, .radius_px = 10, .rows = 6, .seed = seed});
  GrayFrame frame = render_frame(disks, {.width = 300, .height = 240, .blur_px = 0.8, .read_noise = 4});
  for (float& level : frame.pixels) level = std::round(std::min(255.0F, std::max(0.0F, level)));
  return frame;
}

ImageView view_of(const GrayFrame& frame) {
  return {.width = frame.width, .height = frame.height, .pixels = frame.pixels.data(), .type = PixelType::f32};
}

template <class Level>
std::vector<Level> levels_of(const GrayFrame& frame, int row_length, float scale) {
  std::vector<Level> out(static_cast<std::size_t>(row_length) * static_cast<std::size_t>(frame.height), Level(7));
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column)
      out[static_cast<std::size_t>(row * row_length + column)] = static_cast<Level>(scale * frame.at(column, row));
  return out;
}

struct GivenUp {};

// The question is asked while one picture is searched, by measure_bed() on its threads too, and by nobody else. What it
// throws comes out.
TEST(StopQuestion, EndsWorkWithinAPicture) {
  const GrayFrame frame = drawn(1);
  const std::vector<ImageView> film(6, view_of(frame));
  std::atomic<int> asked = 0;
  {
    const StopQuestion outer([] { ADD_FAILURE() << "the inner one hides it"; });
    const StopQuestion question([&] { ++asked; });
    ASSERT_TRUE(find_disks(view_of(frame)).ok());
  }
  const int in_one_picture = asked;
  EXPECT_GT(in_one_picture, 100);
  ASSERT_TRUE(find_disks(view_of(frame)).ok());
  EXPECT_EQ(asked, in_one_picture) << "its question is gone";
  for (const int at : {1, in_one_picture / 2, in_one_picture - 1}) {
    asked = 0;
    const StopQuestion question([&] {
      if (++asked == at) throw GivenUp();
    });
    EXPECT_THROW(find_disks(view_of(frame)), GivenUp) << at;
  }
  asked = 0;
  std::set<std::thread::id> threads;
  std::mutex mutex;
  {
    const StopQuestion question([&] {
      ++asked;
      const std::lock_guard<std::mutex> lock(mutex);
      threads.insert(std::this_thread::get_id());
    });
    ASSERT_TRUE(measure_bed(film, {.bead_diameter_m = 3e-3, .threads = 2}).ok());
  }
  EXPECT_EQ(threads.size(), 2U);
  const int in_film = asked;
  asked = 0;
  const StopQuestion question([&] {
    if (++asked == in_film - in_film / 20) throw GivenUp();  // while the frames are gone through
  });
  EXPECT_THROW(measure_bed(film, {.bead_diameter_m = 3e-3, .threads = 2}), GivenUp);
}

TEST(Photographs, LevelsAreTheSameInAllTypesAndRowLengths) {
  const GrayFrame frame = drawn(1);
  const auto bytes = levels_of<std::uint8_t>(frame, 317, 1);
  const auto words = levels_of<std::uint16_t>(frame, 300, 257);
  const auto doubles = levels_of<double>(frame, 300, 1);
  EXPECT_EQ(frame_of({300, 240, bytes.data(), PixelType::u8, 317}).pixels, frame.pixels);
  EXPECT_EQ(frame_of({300, 240, words.data(), PixelType::u16}).pixels, frame.pixels);
  EXPECT_EQ(frame_of({300, 240, doubles.data(), PixelType::f64}).pixels, frame.pixels);
  EXPECT_EQ(frame_of(view_of(frame)).pixels, frame.pixels);
}

TEST(Photographs, AnImageThatCannotBeUsedIsNamed) {
  GrayFrame frame = drawn(1);
  EXPECT_EQ(find_disks(ImageView{}).status, FindStatus::bad_input);
  const auto told = [&](int width, int height, const void* pixels) {
    ImageView view = view_of(frame);
    view.width = width, view.height = height, view.pixels = pixels;
    return find_disks(view).message;
  };
  EXPECT_EQ(told(0, 240, frame.pixels.data()), "the image is empty");
  EXPECT_EQ(told(300, 0, frame.pixels.data()), "the image is empty");
  EXPECT_EQ(told(300, 240, nullptr), "the image is empty");
  EXPECT_NE(told(1, 240, frame.pixels.data()), "the image is empty") << "it shows no bead";
  EXPECT_NE(told(300, 1, frame.pixels.data()), "the image is empty");
  frame.pixels[1234] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(find_disks(view_of(frame)).message, "the image contains levels that are not finite numbers; replace them");
  const GrayFrame good = drawn(2);
  const BedFound bed = measure_bed(std::vector{view_of(good), view_of(frame)}, {.bead_diameter_m = 3e-3});
  EXPECT_EQ(bed.status, FindStatus::bad_input);
  EXPECT_EQ(bed.message, "frame 1: the image contains levels that are not finite numbers; replace them");
}

// Beads of 3 mm and 20 px: a pixel is 0.15 mm. Up to three times as much or as little is believed at first.
TEST(Photographs, AScaleThatTheBeadsContradictIsRefused) {
  const test::ScratchFolder folder;
  write_png(folder / "bed.png", drawn(1));
  const auto found = [&](double scale) {
    return measure_bed({folder / "bed.png"}, {.bead_diameter_m = 3e-3, .scale_m_per_px = scale});
  };
  const BedFound wrong = found(0.5e-3);
  EXPECT_EQ(wrong.status, FindStatus::bad_input);
  const double seen_px = look_at_first({{folder / "bed.png", 0}}, {})->survey.candidates.front().rims.radius_px;
  EXPECT_NEAR(seen_px, 9.7, 0.5);
  EXPECT_EQ(wrong.message, folder / "bed.png" + (": " + why_not_scale(3e-3, 0.5e-3, seen_px)));
  EXPECT_THAT(why_not_scale(3e-3, 0.5e-3, 10),
              testing::HasSubstr("a bead of 3 mm is 6 px wide, but the circles found are 20 px wide. If they are the "
                                 "beads, a pixel is about 0.15 mm."));
  EXPECT_EQ(why_not_scale(3e-3, 0.449e-3, 10), "");
  EXPECT_NE(why_not_scale(3e-3, 0.451e-3, 10), "");
  EXPECT_EQ(why_not_scale(3e-3, 0.051e-3, 10), "");
  EXPECT_NE(why_not_scale(3e-3, 0.0499e-3, 10), "");
  EXPECT_TRUE(found(0.15e-3).ok());
}

// Marks on beads: rows of disks 1.5 of their diameters apart.
TEST(Photographs, DisksThatNowhereTouchAreDoubted) {
  std::vector<RenderedDisk> marks;
  for (int row = 0; row < 8; ++row)
    for (int k = 0; k < 12 - row % 2; ++k) marks.push_back({30.0 + 24 * k + 12 * (row % 2), 210 - 20.8 * row, 8});
  const GrayFrame frame = render_frame(marks, {.width = 320, .height = 240, .blur_px = 0.8, .read_noise = 3});
  const BedFound bed = measure_bed(std::vector{view_of(frame)}, {.bead_diameter_m = 3e-3});
  EXPECT_EQ(bed.status, FindStatus::doubtful) << bed.message;
  EXPECT_THAT(bed.message,
              testing::StartsWith("Hardly any of the disks found touch: nearest centres are typically 1.50 "
                                  "diameters apart."));
  EXPECT_THAT(bed.message, testing::HasSubstr("If neighbouring beads touch, give --scale \"0.125 mm/px\""));
  EXPECT_EQ(bed.measurement.warnings.front(), bed.message);
  EXPECT_EQ(bed.measurement.disks.size(), 92U) << "they are there to be looked at";
}

TEST(Photographs, ImagesInMemoryAreMeasuredAsTheirFiles) {
  const test::ScratchFolder folder;
  std::vector<GrayFrame> frames;
  std::vector<ImageView> views;
  std::vector<std::string> files;
  for (std::uint64_t k = 0; k < 4; ++k) frames.push_back(drawn(k + 1));
  for (std::size_t k = 0; k < frames.size(); ++k) {
    views.push_back(view_of(frames[k]));
    files.push_back(folder / ("frame" + std::to_string(k) + ".png"));
    write_png(files.back(), frames[k]);
  }
  const BedFound memory = measure_bed(views, {.bead_diameter_m = 3e-3}),
                 disk = measure_bed(files, {.bead_diameter_m = 3e-3});
  ASSERT_TRUE(memory.ok() && disk.ok());
  EXPECT_GT(memory.measurement.disk_total, 200U);
  EXPECT_EQ(memory.measurement.profile.number_density, disk.measurement.profile.number_density);
  EXPECT_EQ(memory.measurement.calibration.radius_px, disk.measurement.calibration.radius_px);
}

TEST(Photographs, TheShareOfWrongDisksIsThatOfTheirProbabilities) {
  std::vector<GrayFrame> frames{drawn(1), drawn(2)};
  FrameSource source = FrameSource::from_frames(frames);
  double wrong = 0;
  std::size_t disks = 0;
  MeasureOptions options{.bead_diameter_m = 3e-3};
  options.disk_sink = [&](const FrameReport&, const std::vector<MeasuredDisk>& found) {
    for (const MeasuredDisk& disk : found) wrong += 1 - disk.probability, ++disks;
  };
  const Measurement measured = measure_bed(source, options);
  ASSERT_EQ(measured.disk_total, disks);
  EXPECT_DOUBLE_EQ(measured.expected_wrong, wrong / static_cast<double>(disks));
}

TEST(Photographs, DoubtBeginsAtTwoPercentAndForbidsAtTwenty) {
  EXPECT_EQ(doubt_of(0.019), Doubt::little);
  EXPECT_EQ(doubt_of(0.021), Doubt::some);
  EXPECT_EQ(doubt_of(0.199), Doubt::some);
  EXPECT_EQ(doubt_of(0.201), Doubt::too_many);
  EXPECT_EQ(doubt_of_missed(0.019), Doubt::little);
  EXPECT_EQ(doubt_of_missed(0.021), Doubt::some);
  EXPECT_EQ(doubt_of_missed(0.399), Doubt::some);
  EXPECT_EQ(doubt_of_missed(0.401), Doubt::too_many);
  // As many right of both kinds together: 2 / (1 / 0.6 + 1) = 0.75.
  EXPECT_EQ(doubt_of_missed(0.33, 0.12), Doubt::some);
  EXPECT_EQ(doubt_of_missed(0.36, 0.12), Doubt::too_many);
}

TEST(Photographs, AreSearchedForWhatTheSurveySaw) {
  SurveyCandidate best;
  best.rims.polarity = Polarity::dark_beads, best.rims.radius_px = 31, best.one_sided = true;
  FindOptions find;
  look_for(best, find);
  EXPECT_EQ(*find.seen, (BeadsSeen{Polarity::dark_beads, 31, true, false}));
  EXPECT_FALSE(find.roi);
  best.by_rims = true;
  look_for(best, find);
  EXPECT_FALSE(find.seen->no_faces || find.seen->thorough) << "a trial of a part";
  best.thorough = true;
  look_for(best, find);
  EXPECT_EQ(*find.seen, (BeadsSeen{Polarity::dark_beads, 31, true, false, true}));
  best.no_faces = true, best.region = PixelRectangle{5, 6, 7, 8};
  look_for(best, find);
  EXPECT_TRUE(find.seen->no_faces);
  EXPECT_EQ(*find.roi, *best.region);
  find.roi = PixelRectangle{1, 2, 3, 4};
  look_for(best, find);
  EXPECT_EQ(*find.roi, (PixelRectangle{1, 2, 3, 4})) << "as given";
}

TEST(Photographs, LargeFramesAreReducedToARadiusOfTwelveToTwentyFour) {
  EXPECT_EQ(reduction_for(1000, 1000, 90), 1) << "the frame is small";
  EXPECT_EQ(reduction_for(1500, 800, 340), 3) << "the beads are so wide that a third of the pixels is enough";
  for (const double radius : {11.0, 13.0, 23.9, 24.0, 37.0, 100.0}) {
    const int by = reduction_for(3000, 2000, radius);
    EXPECT_EQ(by, std::max(1, static_cast<int>(radius / 12)));
    EXPECT_LT(radius / by, 24);
    const int by_rims = reduction_for(3000, 2000, radius, true);
    EXPECT_EQ(by_rims, std::max(1, static_cast<int>(radius / 24)));
    EXPECT_LT(radius / by_rims, 48);
  }
}

// Of 20 million pixels: 2 x 2 of them become one as soon as that leaves a radius of 9 px, by rims not before 24.
TEST(Photographs, VeryLargeFramesAreReducedToNinePixels) {
  EXPECT_EQ(reduction_for(5472, 3648, 17.9), 1);
  EXPECT_EQ(reduction_for(5472, 3648, 18), 2);
  EXPECT_EQ(reduction_for(5472, 3648, 23.9), 2);
  EXPECT_EQ(reduction_for(5472, 3648, 27), 2) << "five million pixels are few enough";
  EXPECT_EQ(reduction_for(5472, 3648, 50), 4);
  EXPECT_EQ(reduction_for(5472, 3648, 47.9, true), 1);
}

TEST(Photographs, FramesBeyondWhatMemoryHoldsAreReducedAndSaySo) {
  const double most = static_cast<double>(FrameSourceOptions().largest_frame_pixels);
  for (const auto& [width, height] : {std::pair(12'300, 12'300), std::pair(20'000, 15'000), std::pair(30'000, 30'000)})
    for (const double radius : {5.0, 13.0, 60.0}) {
      const int by = reduction_for(width, height, radius);
      EXPECT_LE(static_cast<double>(width / by) * (height / by), most);
      EXPECT_GE(by, static_cast<int>(radius / 12)) << "large beads are reduced as before";
      EXPECT_NE(why_reduced(width, height, by).find(std::to_string(width)), std::string::npos);
    }
  EXPECT_EQ(reduction_for(12'200, 12'200, 10), 1);
  EXPECT_EQ(why_reduced(12'200, 12'200, 1), "");
}

// A bed of beads that are 60 px wide in a frame of three million pixels: it is measured in a frame reduced by two.
TEST(Photographs, LengthsOfAReducedBedAreThoseOfThePicture) {
  const test::ScratchFolder folder;
  constexpr double radius = 30;
  const auto disks = make_synthetic_bed(
      {.left_wall_px = 40, .right_wall_px = 1960, .floor_px = 1440, .radius_px = radius, .rows = 8, .jitter_px = 1});
  write_png(
      folder / "bed.png",
      render_frame(
          disks,
          {.width = 2000, .height = 1500, .background_level = 60, .bead_level = 190, .blur_px = 1, .read_noise = 4}));
  const BedFound bed = measure_bed({folder / "bed.png"}, {.bead_diameter_m = 3e-3});
  ASSERT_TRUE(bed.ok()) << bed.message;
  const Measurement& measured = bed.measurement;
  ASSERT_EQ(measured.finder.recorded_px, 2);
  EXPECT_NEAR(measured.calibration.radius_px, radius, 0.1);
  EXPECT_NEAR(measured.finder.rim_radius_px * measured.finder.recorded_px, radius, 0.1);
  ASSERT_EQ(measured.disks.size(), disks.size());
  double squares = 0;
  for (const MeasuredDisk& disk : measured.disks) {
    double nearest = 1e9;
    for (const RenderedDisk& one : disks)
      nearest = std::min(nearest, std::pow(disk.x_px - one.x_px, 2) + std::pow(disk.y_px - one.y_px, 2));
    squares += nearest;
  }
  EXPECT_LT(std::sqrt(0.5 * squares / static_cast<double>(disks.size())), 0.03) << "px per axis";
  const BedFound by_three = measure_bed({folder / "bed.png"}, {.bead_diameter_m = 3e-3, .threads = 3});
  ASSERT_EQ(by_three.measurement.disks.size(), disks.size());
  for (std::size_t k = 0; k < disks.size(); ++k) EXPECT_EQ(by_three.measurement.disks[k].x_px, measured.disks[k].x_px);
}

// Beads are red on grey. What the survey of its channels has learned is what the search alone learns.
TEST(Photographs, AColourPictureIsMeasuredAsInItsChannelAlone) {
  const test::ScratchFolder folder;
  const GrayFrame frame = drawn(1);
  std::ofstream file(folder / "bed.ppm", std::ios::binary);
  file << "P6 300 240 255\n";
  for (const float level : frame.pixels) file << static_cast<char>(level) << "PP";
  file.close();
  MeasureOptions options{.bead_diameter_m = 3e-3};
  const BedFound found = measure_bed({folder / "bed.ppm"}, options);
  SurveyOptions asked;
  asked.search = search_after_survey(options);
  const auto look = look_at_first({{folder / "bed.ppm", 0}}, asked);
  const SurveyCandidate& seen = look->survey.candidates.front();
  EXPECT_NE(seen.searched, nullptr);
  options.find.seen = BeadsSeen{seen.rims.polarity, seen.rims.radius_px, seen.one_sided};
  const BedFound alone = measure_bed({folder / "bed.ppm"}, options, {.channel = seen.channel});
  ASSERT_TRUE(found.ok() && alone.ok()) << found.message << alone.message;
  ASSERT_EQ(found.measurement.disks.size(), alone.measurement.disks.size());
  EXPECT_EQ(found.measurement.calibration.radius_px, alone.measurement.calibration.radius_px);
  for (std::size_t k = 0; k < found.measurement.disks.size(); ++k)
    EXPECT_EQ(found.measurement.disks[k].x_px, alone.measurement.disks[k].x_px);
  const GrayFrame in_channel = read_frame(folder / "bed.ppm", 0, {.channel = seen.channel});
  options.searched = look_at_first({{folder / "bed.ppm", 0}}, asked)->survey.candidates.front().searched;
  FrameSource source = FrameSource::from_frames({in_channel});
  measure_bed(source, options);
  EXPECT_FALSE(options.searched->take(in_channel, options.find)) << "the measurement took it";
  EXPECT_TRUE(seen.searched->take(in_channel, options.find));
  options.second_diameter_m = 2e-3;
  EXPECT_FALSE(search_after_survey(options)) << "both kinds are searched for together";
}

TEST(Photographs, PicturesThatCannotBeReadAreSkippedInTheFirstLook) {
  const test::ScratchFolder folder;
  std::ofstream(folder / "broken.png") << "no picture";
  write_png(folder / "good.png", drawn(1));
  const auto look = look_at_first({{folder / "broken.png", 0}, {folder / "good.png", 0}}, {});
  ASSERT_TRUE(look.has_value());
  EXPECT_EQ(look->path, folder / "good.png");
  EXPECT_EQ(look->width, 300);
  EXPECT_TRUE(look->survey.found);
  EXPECT_FALSE(look_at_first({{folder / "broken.png", 0}}, {}).has_value());
}

// What is said of disks and beds, word by word.
TEST(Photographs, SayWhatWasFound) {
  DisksFound disks;
  disks.message = "the image is empty";
  EXPECT_EQ(disks.brief(), "bad input: the image is empty");
  EXPECT_EQ(disks.full(), "bad input: the image is empty\n");
  disks.status = FindStatus::ok, disks.disks.resize(3), disks.expected_wrong = 0.0123;
  FinderCalibration& finder = disks.calibration;
  finder.polarity = Polarity::bright_beads, finder.radius_px = 9.87654, finder.radius_std_error_px = 0.0123;
  finder.edge_width_px = 0.87654, finder.noise_level = 2.3456, finder.contrast_level = -80.567;
  finder.expected_missed = 0.0456, finder.warnings = {"first", "second"};
  EXPECT_EQ(disks.brief(), "3 bright disks of radius 9.877 +- 0.012 px");
  EXPECT_EQ(disks.full(),
            "3 bright disks of radius 9.877 +- 0.012 px\nedge width       0.877 px\nnoise            2.35 grey levels\n"
            "contrast         -80.57 grey levels\nexpected wrong   1.2 % of the disks\n"
            "expected missed  4.6 % of the beads\nwarning          first\nwarning          second\n");
  finder.polarity = Polarity::dark_beads;
  EXPECT_EQ(disks.brief(), "3 dark disks of radius 9.877 +- 0.012 px");
  BedFound bed;
  bed.status = FindStatus::doubtful, bed.message = "why";
  EXPECT_EQ(bed.full(), "doubtful: why\n");
  bed.status = FindStatus::ok;
  Measurement& found = bed.measurement;
  found.disk_total = 47, found.frames.resize(4), found.disk_count_mean = 15.6667;
  found.calibration.radius_px = 8.0123, found.calibration.width = 6.875, found.calibration.scale_m_per_px = 1.234567e-4;
  found.calibration.floor_px = 110.256, found.calibration.floor_tilt_degrees = 1.2345;
  found.calibration.left_wall_px = 9.5, found.calibration.right_wall_px = 119.251;
  found.profile.number_density.resize(12), found.profile.independent_samples = 3;
  found.warnings = {"only"};
  EXPECT_EQ(bed.full(),
            "47 disks in 4 frames (15.67 a frame), radius 8.012 px, width 6.88 D\nscale            0.123457 mm/px\n"
            "floor            row 110.26 px, tilted by 1.23 degrees\nwalls            columns 9.50 and 119.25 px\n"
            "profile          12 heights, 3 independent frames\nwarning          only\n");
}

}  // namespace
}  // namespace shakebed::ingest
