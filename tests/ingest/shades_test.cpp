// Beads of two shades, of which a part is out of focus or clear, and beds in uneven light: all are found, or it is said
// that some are missed. Limits were chosen on series 1 of a study of these pictures; series 2 and the tests have
// others.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "ingest/find/learn_beads.hpp"
#include "ingest/find/other_shade.hpp"
#include "ingest/find/survey.hpp"
#include "ingest/frames/stop_question.hpp"
#include "ingest/profile/measure_bed.hpp"
#include "ingest/profile/photographs.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/drawn_beds.hpp"

namespace shakebed::ingest {
namespace {

using test::Shaded;
using Layout = Shaded::Layout;

DisksFound found_in(const GrayFrame& frame) {
  return find_disks(
      ImageView{.width = frame.width, .height = frame.height, .pixels = frame.pixels.data(), .type = PixelType::f32});
}

bool said_aloud(const DisksFound& found) {
  return !found.ok() || doubt_of(found.expected_wrong) != Doubt::little ||
         doubt_of_missed(found.calibration.expected_missed) != Doubt::little;
}

bool warned_of(const DisksFound& found, const char* words) {
  const auto& warnings = found.calibration.warnings;
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](const std::string& one) { return one.find(words) != std::string::npos; });
}

// One fainter by a factor, or darker than the background.
Shaded two_shades(Layout layout, double background, double common, double other) {
  Shaded shaded;
  shaded.layout = layout, shaded.count = 30, shaded.radius_px = 9;
  shaded.background = background, shaded.common = common, shaded.other = other;
  return shaded;
}

TEST(Shades, FaintBeadsBetweenTouchingBrightOnesAreFound) {
  std::mt19937 random(301);
  const test::DrawnBed bed = test::bed_of_shades(random, two_shades(Layout::pile, 30, 210, 66));
  const DisksFound found = found_in(bed.frame);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_GE(test::score_of(found.disks, bed.beads).f1(), 0.95);
  EXPECT_TRUE(warned_of(found, "Beads of two shades were found"));
  // Each states its own contrast.
  for (const FoundDisk& disk : found.disks)
    EXPECT_TRUE(std::abs(disk.contrast - 1) < 0.3 || std::abs(disk.contrast - 0.2) < 0.08) << disk.contrast;
}

TEST(Shades, BeadsDarkerThanTheBackgroundAreFoundBetweenBrighterOnes) {
  std::mt19937 random(302);
  const test::DrawnBed bed = test::bed_of_shades(random, two_shades(Layout::pile, 110, 210, 60));
  const DisksFound found = found_in(bed.frame);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_GE(test::score_of(found.disks, bed.beads).f1(), 0.95);
  EXPECT_TRUE(warned_of(found, "in the opposite direction"));
  for (const FoundDisk& disk : found.disks)
    EXPECT_TRUE(std::abs(disk.contrast - 1) < 0.3 || std::abs(disk.contrast + 0.5) < 0.2) << disk.contrast;
}

// A page of text beside a bed: letters are dark on a white ground, and the beads are bright on a dark one.
GrayFrame bed_beside_text(int width, int height, double radius, std::vector<cv::Point2d>& beads) {
  cv::Mat picture(height, width, CV_32F, cv::Scalar(60));
  picture.colRange(width / 2, width).setTo(235);
  constexpr std::array<const char*, 7> words = {
      "the quick brown", "fox jumps over",    "a lazy dog and", "measures density",
      "of grains in",    "vibrated beds and", "so on"};
  std::size_t word = 0;
  for (int y = 24; y < height - 6; y += 22)
    cv::putText(picture, words.at(word++ % words.size()), {width / 2 + 10, y}, cv::FONT_HERSHEY_SIMPLEX, 0.55, 20, 1,
                cv::LINE_AA);
  std::mt19937 random(9);
  int row = 0;
  for (double y = height - 10 - radius; y > 0.2 * height; y -= 1.77 * radius, ++row)
    for (double x = 12 + radius + (row % 2) * radius; x < 0.5 * width - 12 - radius; x += 2.04 * radius)
      if (random() % 12 != 0) beads.emplace_back(x, y);
  for (const cv::Point2d& bead : beads)
    for (int y = std::max(0, static_cast<int>(bead.y - radius) - 1);
         y < std::min(height, static_cast<int>(bead.y + radius) + 3); ++y)
      for (int x = std::max(0, static_cast<int>(bead.x - radius) - 1);
           x < std::min(width / 2, static_cast<int>(bead.x + radius) + 3); ++x) {
        const double away = std::hypot(x - bead.x, y - bead.y), cover = std::clamp(radius + 0.5 - away, 0.0, 1.0);
        if (cover == 0) continue;
        const double high = std::sqrt(std::max(0.0, 1 - away * away / (radius * radius)));
        float& level = picture.at<float>(y, x);
        level = static_cast<float>((1 - cover) * static_cast<double>(level) + cover * (60 + 130 * (0.6 + 0.4 * high)));
      }
  cv::GaussianBlur(picture, picture, {0, 0}, 0.8);
  std::normal_distribution<float> noise(0, 3);
  GrayFrame frame{width, height, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) frame.pixels.push_back(picture.at<float>(y, x) + noise(random));
  return frame;
}

TEST(Shades, LettersOnOtherGroundAreNoBeads) {
  std::vector<cv::Point2d> beads;
  const GrayFrame frame = bed_beside_text(440, 240, 11, beads);
  const DisksFound found = found_in(frame);
  ASSERT_TRUE(found.ok()) << found.message;
  const auto hits = std::count_if(beads.begin(), beads.end(), [&](const cv::Point2d& bead) {
    return std::any_of(found.disks.begin(), found.disks.end(),
                       [&](const FoundDisk& disk) { return std::hypot(disk.x_px - bead.x, disk.y_px - bead.y) < 3; });
  });
  EXPECT_GE(2.0 * static_cast<double>(hits) / static_cast<double>(beads.size() + found.disks.size()), 0.95);
  EXPECT_FALSE(warned_of(found, "two shades"));
}

// Dark beads on ground whose level varies by 6 over 7 px, as of paper or agar: rounded patches of it pass as beads of
// another shade, 4 beside 16 in the smaller picture and 7 to 20 beside 25 in the others.
GrayFrame on_mottled_ground(int side, unsigned seed, std::size_t* count) {
  std::mt19937 random(seed);
  const auto level = [&] { return std::normal_distribution<float>(0, 1)(random); };
  cv::Mat ground(side, side, CV_32F);
  for (int row = 0; row < side; ++row)
    for (int column = 0; column < side; ++column) ground.at<float>(row, column) = level();
  cv::GaussianBlur(ground, ground, cv::Size(0, 0), 7);
  cv::Scalar mean, spread;
  cv::meanStdDev(ground, mean, spread);
  ground = ground * (6 / spread[0]) + 225;
  std::vector<std::pair<double, double>> beads;
  for (int y = 50; y < side - 60; y += 90)
    for (int x = 50; x < side - 60; x += 90) {
      const auto right = static_cast<double>(random() % 20), down = static_cast<double>(random() % 20);
      beads.emplace_back(x + right, y + down);
    }
  *count = beads.size();
  GrayFrame frame{side, side, {}};
  for (int row = 0; row < side; ++row)
    for (int column = 0; column < side; ++column) {
      double cover = 0;
      for (const auto& [x, y] : beads)
        cover = std::max(cover, std::clamp(8.5 - std::hypot(column - x, row - y), 0.0, 1.0));
      const auto dark = static_cast<float>(cover);
      frame.pixels.push_back(std::round((1 - dark) * ground.at<float>(row, column) + dark * 140 + 0.7F * level()));
    }
  return frame;
}

void expect_dark_beads_alone(int side, unsigned seed) {
  std::size_t beads = 0;
  const DisksFound found = found_in(on_mottled_ground(side, seed, &beads));
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found.calibration.other_shade, nullptr) << seed;
  EXPECT_EQ(found.disks.size(), beads) << seed;
}
TEST(Shades, MottledGroundHoldsNoBeads) { expect_dark_beads_alone(390, 318); }
TEST(Shades, MottledGroundOfLargerPicturesHoldsNoBeads) {
  for (const unsigned seed : {308U, 312U, 316U}) expect_dark_beads_alone(480, seed);
}

// Places in a crystal are round by the rims of their neighbours alone.
TEST(Shades, HolesOfACrystalAreNoBeads) {
  constexpr double radius = 9, step = 2.02 * radius;
  constexpr int across = 260, down = 220;
  std::mt19937 random(303);
  std::normal_distribution<float> noise(0, 2);
  GrayFrame frame{across, down, std::vector<float>(static_cast<std::size_t>(across) * down, 40.0F)};
  std::size_t beads = 0;
  for (int line = 0; line < 12; ++line)
    for (int k = 0; k < 12; ++k) {
      const double x = 20 + step * (k + 0.5 * (line % 2)), y = 20 + step * std::sqrt(0.75) * line;
      if (random() % 6 == 0 || x > across - 20 || y > down - 20) continue;
      ++beads;
      for (int row = 0; row < down; ++row)
        for (int column = 0; column < across; ++column) {
          const auto cover = static_cast<float>(std::clamp(radius + 0.5 - std::hypot(column - x, row - y), 0.0, 1.0));
          float& level = frame.pixels[static_cast<std::size_t>(row) * across + static_cast<std::size_t>(column)];
          level += cover * (200 - level);
        }
    }
  for (float& level : frame.pixels) level += noise(random);
  const DisksFound found = found_in(frame);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found.disks.size(), beads);
  EXPECT_EQ(found.calibration.other_shade, nullptr);
}

TEST(Shades, AreFoundInEachFrameOfAFilm) {
  std::mt19937 random(304);
  const Shaded shaded = two_shades(Layout::loose, 30, 210, 66);
  std::vector<test::DrawnBed> beds;
  for (int k = 0; k < 2; ++k) beds.push_back(test::bed_of_shades(random, shaded));
  MeasureOptions options;
  options.bead_diameter_m = 1e-3;
  options.find.seen = BeadsSeen{Polarity::bright_beads, shaded.radius_px};
  FrameSource source = FrameSource::from_frames({beds[0].frame, beds[1].frame});
  const Measurement measured = measure_bed(source, options);
  ASSERT_NE(measured.finder.other_shade, nullptr);
  ASSERT_EQ(measured.frames.size(), 2U);
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_NEAR(static_cast<double>(measured.frames[k].disks), static_cast<double>(beds[k].beads.size()), 1);
  EXPECT_FALSE(measured.coverage_profile.has_value());  // each shade covers area by another contrast
}

// By how often it asks whether to stop. In five drawn beds the thorough search takes two to five times as long.
TEST(Shades, ByQuickRimsTakeLessThanHalfOfAThoroughSearch) {
  const auto& kinds = test::drawn_beds();
  const auto kind = std::find_if(kinds.begin(), kinds.end(), [](const test::BedKind& one) {
    return one.name == "two sizes, packed beyond the frame, fringes";
  });
  ASSERT_NE(kind, kinds.end());
  std::mt19937 random(static_cast<unsigned>(kind - kinds.begin()) + 1);
  const GrayFrame frame = kind->draw(random).frame;
  const Survey survey = take_survey({1, frame.width, frame.height, {{Channel::automatic, frame}}}, {});
  ASSERT_TRUE(survey.found);
  const RimModel& rims = survey.candidates.front().rims;
  FindOptions find;
  find.seen = BeadsSeen{rims.polarity, rims.radius_px};
  std::size_t asked = 0;
  const StopQuestion counted([&] { ++asked; });
  const CalibrationResult thorough = learn_beads({&frame}, find);
  const std::size_t by_thorough = asked;
  find.quick_rims_only = true;
  const CalibrationResult quick = learn_beads({&frame}, find);
  ASSERT_TRUE(thorough.found && thorough.calibration.by_rims && quick.found);
  EXPECT_EQ(quick.calibration.rims->search.wanted_px, quick_radius_px);
  EXPECT_LT(2 * (asked - by_thorough), by_thorough);
}

// What is left of a bed of one shade are the straight edges of its walls: no circles are searched for at length.
TEST(Shades, AreNotSearchedForWhereOnlyWallsAreLeft) {
  const auto disks = make_synthetic_bed(
      {.left_wall_px = 20, .right_wall_px = 280, .floor_px = 220, .radius_px = 10, .rows = 6, .seed = 305});
  GrayFrame frame = render_frame(disks, {.width = 300, .height = 240, .blur_px = 0.8, .read_noise = 4});
  const float behind = frame.pixels.front();
  for (std::size_t at = 0; at < frame.pixels.size(); ++at) {
    const std::size_t row = at / 300, column = at % 300;
    if (column < 18 || column > 281 || row > 221) frame.pixels[at] -= 0.4F * behind;
  }
  FindOptions find;
  find.seen = BeadsSeen{Polarity::dark_beads, 10};
  std::size_t asked = 0;
  const StopQuestion counted([&] { ++asked; });
  CalibrationResult learned = learn_beads({&frame}, find);
  ASSERT_TRUE(learned.found && learned.calibration.rims);
  const std::size_t for_the_beads = asked;
  FindResult found = find_beads(frame, learned.calibration, find);
  ASSERT_GE(found.disks.size(), disks.size() - 3);
  asked = 0;
  learn_other_shade(frame, find, learned.calibration, found);
  EXPECT_EQ(learned.calibration.other_shade, nullptr);
  EXPECT_LT(asked, for_the_beads) << "questions whether to go on: 81; without a look at what is left 23,736";
}

// Every kind: an F1 of 0.9, or said aloud.
struct Kind {
  const char* name;
  Shaded shaded;
};
std::vector<Kind> kinds() {
  std::vector<Kind> all;
  const auto add = [&](const char* name, const auto& change) {
    for (const Layout layout : {Layout::pile, Layout::loose, Layout::strewn}) {
      Shaded shaded;
      shaded.layout = layout, shaded.count = 60, shaded.radius_px = 12, shaded.noise = 3, shaded.blur_px = 1;
      change(shaded);
      all.push_back({name, shaded});
    }
  };
  const auto shades = [](double background, double common, double other) {
    return [=](Shaded& s) { s.background = background, s.common = common, s.other = other; };
  };
  add("both brighter, 2", shades(30, 210, 120));
  add("both brighter, 3", shades(30, 210, 90));
  add("both brighter, 5", shades(30, 210, 66));
  add("both darker, 2", shades(225, 35, 130));
  add("both darker, 5", shades(225, 35, 187));
  add("brighter and darker, alike", shades(110, 210, 20));
  add("brighter and darker, 3", shades(110, 210, 77));
  add("darker and brighter, 5", shades(140, 40, 160));
  add("the others smaller, 3", [&](Shaded& s) { shades(30, 210, 90)(s), s.size_of_others = 0.7; });
  add("the others smaller, 5", [&](Shaded& s) { shades(225, 35, 187)(s), s.size_of_others = 0.7; });
  add("two sizes, 3", [&](Shaded& s) { shades(30, 210, 90)(s), s.second_size = 0.7; });
  add("light of a factor of 4", [](Shaded& s) { s.background = 40, s.common = s.other = 150, s.light_ratio = 4; });
  add("a part out of focus", [](Shaded& s) { s.defocus_of_others = 0.3; });
  add("a part far out of focus", [](Shaded& s) { s.defocus_of_others = 0.45; });
  add("a part clear", shades(225, 35, 195));
  return all;
}

TEST(Shades, OfEveryKindAreFoundOrTheMissedOnesAreTold) {
  unsigned seed = 310;
  double f1 = 0;
  const std::vector<Kind> all = kinds();
  for (const Kind& kind : all) {
    std::mt19937 random(seed++);
    const test::DrawnBed bed = test::bed_of_shades(random, kind.shaded);
    const DisksFound found = found_in(bed.frame);
    const double its = found.ok() ? test::score_of(found.disks, bed.beads).f1() : 0;
    EXPECT_TRUE(its >= 0.9 || said_aloud(found))
        << kind.name << ", layout " << static_cast<int>(kind.shaded.layout) << ": F1 " << its;
    f1 += its / static_cast<double>(all.size());
  }
  EXPECT_GE(f1, 0.95);
}

}  // namespace
}  // namespace shakebed::ingest
