// What learning takes from its frames and options, and how it says that it has learned nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "ingest/find/bed_light.hpp"
#include "ingest/find/find_disks.hpp"
#include "ingest/find/learn_from_part.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

std::vector<RenderedDisk> beads_to_learn() {
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < 20; ++k)
    disks.push_back(
        {16 + 29.0 * (k % 5) + 3 * test::scattered(k, 1), 15 + 29.0 * (k / 5) + 3 * test::scattered(1, k), 9, 0, 0});
  return disks;
}

// Frames of another size than the first are left out, and what is stated is of the others.
TEST(LearnFinder, UsesTheFramesOfTheFirstSize) {
  const GrayFrame one = test::beads_of_level(beads_to_learn(), 70), other = test::even_frame(100, 90, 150);
  GrayFrame two = one;
  for (std::size_t k = 0; k < two.pixels.size(); ++k) two.pixels[k] += k % 2 == 0 ? 0.5F : -0.5F;
  FindOptions options;
  options.recorded_px = 2;
  const CalibrationResult learned = learn_finder({&one, &other, &two}, options);
  ASSERT_TRUE(learned.found) << learned.why_not;
  const FinderCalibration& finder = learned.calibration;
  EXPECT_EQ(finder.frames_used, 2U);
  EXPECT_EQ(finder.disks_used, 40U);
  EXPECT_EQ(finder.width, 150);
  EXPECT_EQ(finder.height, 122);
  EXPECT_EQ(finder.recorded_px, 2);
  EXPECT_EQ(finder.level_deciles, level_deciles(one));
  EXPECT_NEAR(finder.rim_radius_px, 9, 0.03);
  EXPECT_NEAR(finder.contrast_level, -80, 1);
  EXPECT_NEAR(finder.edge_width_px, std::hypot(0.8, 1 / std::sqrt(12)), 0.03);
  EXPECT_TRUE(finder.warnings.empty());
  // Again from there, of the first frame alone: the same bead.
  const CalibrationResult again = learn_again({&one}, options, finder);
  ASSERT_TRUE(again.found);
  EXPECT_EQ(again.calibration.frames_used, 1U);
  EXPECT_EQ(again.calibration.disks_used, 20U);
  EXPECT_NEAR(again.calibration.rim_radius_px, finder.rim_radius_px, 0.01);
  EXPECT_NEAR(again.calibration.edge_width_px, finder.edge_width_px, 0.02);
}

// A radius that is held stays the radius of the rim, and one that is not held is a first value.
TEST(LearnFinder, HoldsARadiusIfAsked) {
  const GrayFrame frame = test::beads_of_level(beads_to_learn(), 70);
  FindOptions options;
  options.radius_px = 9.4;
  EXPECT_NEAR(learn_finder({&frame}, options).calibration.rim_radius_px, 9, 0.03);
  options.hold_radius = true;
  EXPECT_EQ(learn_finder({&frame}, options).calibration.rim_radius_px, 9.4);
}

// A frame of 1.01 million pixels, most of it background. From a radius that is 7 % too small, its beads are learned as
// from the radius that a part of it shows; from one that is 3 % too small, from this one.
TEST(LearnFinder, LooksAtAPartOfALargeFrameFirst) {
  std::vector<RenderedDisk> disks;
  Places beads;
  for (int k = 0; k < 280; ++k) {
    disks.push_back(
        {40 + 24.0 * (k % 20) + 3 * test::scattered(k, 1), 40 + 24.0 * (k / 20) + 3 * test::scattered(1, k), 9, 0, 0});
    beads.emplace_back(disks.back().x_px, disks.back().y_px);
  }
  const Camera look{
      .width = 1250, .height = 810, .background_level = 150, .bead_level = 70, .blur_px = 0.8, .read_noise = 2};
  const GrayFrame frame = render_frame(disks, look);
  FindOptions options;
  options.polarity = Polarity::dark_beads;
  const auto radius_of = [](const CalibrationResult& learned) { return learned.calibration.rim_radius_px; };
  const auto alone = [&](double start) {
    options.radius_px = start;
    return radius_of(learn_finder({&frame}, options));
  };
  const auto from_part = [&](double start, const Places& seen) {
    options.radius_px = start;
    return radius_of(learn_finder_from_part({&frame}, options, seen));
  };
  options.radius_px = 8.4;
  const auto part = part_half_filled(beads, 336, 1250, 810);
  ASSERT_TRUE(part);
  const GrayFrame cut = cut_out(frame, *part);
  const CalibrationResult there = learn_finder({&cut}, options);
  ASSERT_TRUE(there.found && there.complete);
  EXPECT_NEAR(radius_of(there), 9, 0.03);
  const double plain = alone(8.4);
  EXPECT_NEAR(plain, 9, 0.01);
  const double by_part = from_part(8.4, beads);
  EXPECT_EQ(by_part, alone(radius_of(there)));
  EXPECT_NE(by_part, plain);
  EXPECT_EQ(from_part(8.7, beads), alone(8.7));
  EXPECT_EQ(from_part(8.4, Places(beads.begin(), beads.begin() + 29)), plain) << "too few";
  const GrayFrame smaller = cut_out(frame, {0, 0, 1250, 799});
  EXPECT_EQ(radius_of(learn_finder_from_part({&smaller}, options, beads)),
            radius_of(learn_finder({&smaller}, options)));
}

// An even frame: nothing votes for beads. Where their radius and polarity are given, they are looked for all the same;
// the radius is stated in pixels as recorded.
TEST(LearnFinder, SaysWhatItExamined) {
  const GrayFrame even =
      test::frame_by(150, 122, [](int column, int row) { return 150 + test::scattered(column, row); });
  FindOptions options;
  options.recorded_px = 3, options.radius_px = 9;
  EXPECT_TRUE(test::holds(learn_finder({&even}, options).why_not, "no disks seen: no circle of any radius was found"));
  options.polarity = Polarity::dark_beads;
  EXPECT_EQ(learn_finder({&even}, options).why_not,
            "no disks seen: circles of 27.000000 px radius were examined, but no model of a filled disk fits them");
}

// On ground that is mottled by a quarter of their contrast beads are found; by more than a third, the beads explain too
// little of the frame.
TEST(LearnFinder, IsOfBeadsThatExplainTheirFrame) {
  for (const double mottle : {0.25, 0.35}) {
    GrayFrame frame = test::beads_of_level(beads_to_learn(), 70);
    for (int row = 0; row < 122; ++row)
      for (int column = 0; column < 150; ++column)
        test::set(
            frame, column, row,
            static_cast<double>(frame.at(column, row)) + 160 * mottle * (test::scattered(column / 3, row / 3) - 0.5));
    FindOptions options;
    options.radius_px = 9;
    const CalibrationResult learned = learn_finder({&frame}, options);
    EXPECT_EQ(learned.found, mottle < 0.3) << learned.why_not;
    EXPECT_FALSE(learned.complete) << "more than noise is left";
    if (!learned.found) {
      EXPECT_TRUE(test::holds(learned.why_not, "px radius were examined, but they do not explain the frame"));
    }
  }
}

}  // namespace
}  // namespace shakebed::ingest
