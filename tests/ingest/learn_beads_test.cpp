// Beads by their faces or by their rims: which of the two is taken, and what is said of those that are missed.

#include "ingest/find/learn_beads.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/missed_beads.hpp"
#include "ingest/find/rim_finder.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

constexpr double faced_radius = 8;
std::vector<RenderedDisk> faced_disks(int count) {
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < count; ++k)
    disks.push_back({15 + 21.5 * (k % 6) + 2 * test::scattered(k, 1), 15 + 21.5 * (k / 6) + 2 * test::scattered(1, k),
                     faced_radius, 0, 0});
  return disks;
}
GrayFrame faced_frame(const std::vector<RenderedDisk>& disks, double noise = 2) {
  Camera camera;
  camera.width = 142, camera.height = 98, camera.background_level = 150, camera.bead_level = 60;
  camera.blur_px = 0.7, camera.read_noise = noise;
  return render_frame(disks, camera);
}
// Within a radius of the middle: the level of the background again, but for a ring of 2.5 px.
void empty_face(GrayFrame& frame, const RenderedDisk& disk) {
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column)
      if (std::hypot(column - disk.x_px, row - disk.y_px) < disk.radius_px - 2.5)
        test::set(frame, column, row, 150 + 2 * (test::scattered(column, row) - 0.5));
}
FindOptions seen_dark(double radius = faced_radius) {
  FindOptions options;
  options.seen = BeadsSeen{Polarity::dark_beads, radius, false};
  return options;
}

// Of 24 beads one is hollow: its rim is seen, not its face. Faces are taken while they miss no more than 6 % of the
// sure rims, and the share missed is what rims show beyond them.
TEST(LearnBeads, TakesFacesWhileTheyMissFewRims) {
  const std::vector<RenderedDisk> disks = faced_disks(24);
  for (const std::size_t hollow : {0U, 1U, 2U}) {
    GrayFrame frame = faced_frame(disks);
    for (std::size_t k = 0; k < hollow; ++k) empty_face(frame, disks[7 + 6 * k]);
    const CalibrationResult learned = learn_beads({&frame}, seen_dark());
    ASSERT_TRUE(learned.found) << learned.why_not;
    const FinderCalibration& finder = learned.calibration;
    EXPECT_EQ(finder.by_rims, hollow == 2) << hollow << ": 1 of 24 is 4 %, 2 are 8 %";
    if (finder.by_rims) continue;
    ASSERT_TRUE(finder.rims && learned.in_last_frame);
    // One by its rim, or as many as seem to lie between the faces, whichever are more.
    std::vector<Circle> faces;
    for (const FoundDisk& disk : learned.in_last_frame->disks) faces.push_back({disk.x_px, disk.y_px, disk.radius_px});
    const double by_rims = hollow == 0 ? 0 : finder.rims->probability.back(),
                 missed = std::max(by_rims, expected_missed_beads(frame, *finder.rims, faces, std::nullopt));
    EXPECT_NEAR(finder.expected_missed, missed / (static_cast<double>(faces.size()) + missed), 1e-9);
    EXPECT_EQ(missed > 0.9, hollow == 1);
    EXPECT_FALSE(finder.rims_to_be_checked);
    EXPECT_EQ(learned.in_last_frame->disks.size(), 24 - hollow);
    EXPECT_NEAR(finder.radius_px, faced_radius, 0.05);
  }
}

TEST(LearnBeads, TriesNoFacesWhereThereAreNone) {
  const std::vector<RenderedDisk> disks = faced_disks(24);
  const GrayFrame frame = faced_frame(disks);
  FindOptions options = seen_dark();
  EXPECT_FALSE(learn_beads({&frame}, options).calibration.by_rims);
  options.seen->no_faces = true;
  const CalibrationResult learned = learn_beads({&frame}, options);
  ASSERT_TRUE(learned.found && learned.in_last_frame);
  EXPECT_TRUE(learned.calibration.by_rims);
  EXPECT_EQ(learned.in_last_frame->disks.size(), 24U);
}

// Of beads that a quick search shows, too.
TEST(LearnBeads, SearchesThoroughlyWhereATrialWasWorthIt) {
  const std::vector<RenderedDisk> disks = faced_disks(24);
  const GrayFrame frame = faced_frame(disks);
  FindOptions options = seen_dark();
  options.seen->thorough = true;
  EXPECT_FALSE(learn_beads({&frame}, options).calibration.by_rims) << "faces come first";
  for (const bool thorough : {false, true}) {
    options.seen->no_faces = true, options.seen->thorough = thorough;
    const CalibrationResult learned = learn_beads({&frame}, options);
    ASSERT_TRUE(learned.found && learned.in_last_frame && learned.calibration.rims);
    EXPECT_EQ(learned.calibration.rims->thorough(), thorough);
    EXPECT_EQ(learned.in_last_frame->disks.size(), 24U);
  }
}

// Of the circles by rims alone: what each is, from its rim.
TEST(LearnBeads, ByRimsHasTheNumbersOfItsRims) {
  const std::vector<RenderedDisk> disks = faced_disks(24);
  const GrayFrame frame = faced_frame(disks);
  FindOptions options = seen_dark();
  options.quick_rims_only = true, options.one_size = true;
  const CalibrationResult learned = learn_beads({&frame}, options);
  ASSERT_TRUE(learned.found && learned.calibration.by_rims);
  const FinderCalibration& finder = learned.calibration;
  const RimsFound rims = find_rims(frame, *finder.rims);
  const FindResult found = find_beads(frame, finder, options);
  ASSERT_EQ(found.disks.size(), rims.disks.size());
  for (std::size_t k = 0; k < found.disks.size(); ++k) {
    const FoundDisk& disk = found.disks[k];
    const RimDisk& rim = rims.disks[k];
    EXPECT_EQ(disk.x_px, rim.circle.x);
    EXPECT_EQ(disk.y_px, rim.circle.y);
    EXPECT_EQ(disk.radius_px, finder.radius_px);
    EXPECT_EQ(disk.variance_x, rim.variance_px2);
    EXPECT_EQ(disk.probability, rim.probability);
    EXPECT_NEAR(disk.contrast, rim.circle.contrast / finder.rims->contrast, 1e-12);
    EXPECT_FALSE(disk.half_hidden);
  }
  std::vector<Circle> circles;
  for (const RimDisk& rim : rims.disks) circles.push_back(rim.circle);
  const double missed =
      std::max(rims.expected_missed, expected_missed_beads(frame, *finder.rims, circles, std::nullopt));
  EXPECT_NEAR(finder.expected_missed, missed / (static_cast<double>(circles.size()) + missed), 1e-12);
  EXPECT_EQ(finder.contrast_level, -finder.rims->contrast);
  EXPECT_EQ(finder.edge_width_px, 1);
  // Centres at the border of a region: the first row and column belong to it, those behind its end do not.
  FoundDisk first = found.disks[8];
  FindOptions region = options;
  const auto count_from = [&](double left, double top) {
    region.roi = PixelRectangle{static_cast<int>(left), static_cast<int>(top), 500, 500};
    const FindResult inside = find_beads(frame, finder, region);
    return std::count_if(inside.disks.begin(), inside.disks.end(),
                         [&](const FoundDisk& disk) { return disk.x_px == first.x_px && disk.y_px == first.y_px; });
  };
  EXPECT_EQ(count_from(std::floor(first.x_px + 0.5), 0), 1);
  EXPECT_EQ(count_from(std::floor(first.x_px + 0.5) + 1, 0), 0);
  EXPECT_EQ(count_from(0, std::floor(first.y_px + 0.5)), 1);
  EXPECT_EQ(count_from(0, std::floor(first.y_px + 0.5) + 1), 0);
}

// A side of the region cuts a bead from one radius on, whichever side it is.
TEST(LearnBeads, ByRimsAreCutBySidesNearerThanARadius) {
  const GrayFrame frame = faced_frame(faced_disks(24));
  FindOptions options = seen_dark();
  options.quick_rims_only = true, options.one_size = true;
  const CalibrationResult learned = learn_beads({&frame}, options);
  ASSERT_TRUE(learned.found && learned.calibration.by_rims);
  const FoundDisk bead = find_beads(frame, learned.calibration, options).disks[14];
  const int x = static_cast<int>(std::lround(bead.x_px)), y = static_cast<int>(std::lround(bead.y_px));
  const auto is_cut = [&](const PixelRectangle& region) {
    options.roi = region;
    for (const FoundDisk& disk : find_beads(frame, learned.calibration, options).disks)
      if (disk.x_px == bead.x_px && disk.y_px == bead.y_px) return disk.cut;
    ADD_FAILURE() << "it is in the region";
    return false;
  };
  EXPECT_FALSE(is_cut({x - 10, y - 10, 21, 21}));
  EXPECT_TRUE(is_cut({x - 6, y - 10, 17, 21}));
  EXPECT_TRUE(is_cut({x - 10, y - 6, 21, 17}));
  EXPECT_TRUE(is_cut({x - 10, y - 10, 17, 21}));
  EXPECT_TRUE(is_cut({x - 10, y - 10, 21, 17}));
}

// Poor rims, other edges, and no rims at all: what is said.
TEST(LearnBeads, SaysHowMuchIsSeen) {
  std::vector<RenderedDisk> disks = faced_disks(24);
  GrayFrame frame = faced_frame(disks, 1);
  FindOptions options = seen_dark();
  options.quick_rims_only = true, options.one_size = true, options.recorded_px = 3;
  EXPECT_TRUE(learn_beads({&frame}, options).calibration.warnings.empty());
  GrayFrame striped = test::even_frame(142, 240, 150);  // a part below with many edges
  for (int row = 0; row < 240; ++row)
    for (int column = 0; column < 142; ++column)
      test::set(striped, column, row, row < 98 ? static_cast<double>(frame.at(column, row)) : 150 - 60 * (row / 4 % 2));
  const CalibrationResult among = learn_beads({&striped}, options);
  ASSERT_TRUE(among.found);
  double explained = 0;
  const LearnedRims rims = learn_rims(striped, Polarity::dark_beads, faced_radius, Known::beads);
  for (const RimDisk& disk : find_rims(striped, *among.calibration.rims).disks)
    explained += disk.probability * 2 * std::numbers::pi * disk.circle.radius * disk.circle.support;
  const double share = explained / rims.edge_length_px;
  ASSERT_LT(share, 0.33);
  char text[100];
  std::snprintf(text, sizeof text, "explain only %.0f %% of the edges in the picture", 100 * share);
  EXPECT_TRUE(test::any_holds(among.calibration.warnings, text)) << text;
  const CalibrationResult nothing = learn_beads({&(frame = test::even_frame(142, 98, 150))}, options);
  EXPECT_FALSE(nothing.found);
  EXPECT_TRUE(test::holds(nothing.why_not, "no rim of radius 24.0")) << nothing.why_not;
  EXPECT_TRUE(test::holds(nothing.in_last_frame->why_nothing, "px is seen"));
}

// Faces that tile surroundings as bright as the beads have no rim: pixels around them are left out, and those around
// beads are not.
TEST(LearnBeads, LeavesOutFacesWithoutARim) {
  const std::vector<RenderedDisk> disks = faced_disks(24);
  GrayFrame small = faced_frame(disks);
  const GrayFrame frame = test::frame_by(220, 98, [&](int column, int row) {
    const double grain = 2 * (test::scattered(column, row) - 0.5);
    return column < 142 ? static_cast<double>(small.at(column, row)) : 60 + grain;
  });
  const CalibrationResult learned = learn_beads({&frame}, seen_dark());
  ASSERT_TRUE(learned.found) << learned.why_not;
  const FindResult found = find_beads(frame, learned.calibration, seen_dark());
  std::size_t hits = 0;
  for (const FoundDisk& disk : found.disks)
    for (const RenderedDisk& one : disks) hits += std::hypot(disk.x_px - one.x_px, disk.y_px - one.y_px) < 1;
  EXPECT_EQ(hits, 24U);
  EXPECT_EQ(found.disks.size(), 24U);
  EXPECT_LT(learned.calibration.expected_missed, 0.02);
}

// A face whose rim is doubtful is a bead where beads are, within 3.5 radii.
TEST(LearnBeads, DoubtfulFacesAreBeadsBesideBeads) {
  for (const double away : {3.3, 3.8}) {
    std::vector<RenderedDisk> disks = faced_disks(12);
    disks.push_back({disks[8].x_px + 1, disks[8].y_px + away * faced_radius, faced_radius, 0, 0});
    GrayFrame frame = faced_frame(disks);
    FinderCalibration finder;
    const FindResult faces = find_disks(frame, {}, &finder);
    ASSERT_EQ(faces.disks.size(), 13U);
    // The last one has a blotch: it does not look like the others, and rims like these are made up by chance, too.
    for (int row = 0; row < frame.height; ++row)
      for (int column = 0; column < frame.width; ++column)
        if (std::hypot(column - disks[12].x_px, row - disks[12].y_px) < 4.5) test::set(frame, column, row, 130);
    finder.rims = learn_rims(frame, Polarity::dark_beads, faced_radius).model;
    finder.rims->probability.assign(21, 0.3);
    finder.rims_to_be_checked = true;
    const FindResult found = find_beads(frame, finder, {});
    const auto last = std::find_if(found.disks.begin(), found.disks.end(), [&](const FoundDisk& disk) {
      return std::hypot(disk.x_px - disks[12].x_px, disk.y_px - disks[12].y_px) < 2;
    });
    for (const FoundDisk& disk : found.disks) {
      if (last != found.disks.end() && &disk == &*last) continue;
      EXPECT_GE(disk.probability, 0.95);
    }
    EXPECT_EQ(last != found.disks.end(), away < 3.5) << away;
    if (last != found.disks.end()) {
      EXPECT_EQ(last->probability, 0.5);
    }
    EXPECT_EQ(found.disks.size() + found.rejected, 13U);
  }
}

}  // namespace
}  // namespace shakebed::ingest
