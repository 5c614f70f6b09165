// What learning takes from its frames and options, and how it says that it has learned nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "ingest/find/bed_light.hpp"
#include "ingest/find/find_disks.hpp"
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
    if (!learned.found) {
      EXPECT_TRUE(test::holds(learned.why_not, "px radius were examined, but they do not explain the frame"));
    }
  }
}

}  // namespace
}  // namespace shakebed::ingest
