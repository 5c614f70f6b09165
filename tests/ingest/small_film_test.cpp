// Films of a few small frames: what is measured of them by pencil and paper.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/find_disks.hpp"
#include "ingest/find/learn_beads.hpp"
#include "ingest/find/learned_beads.hpp"
#include "ingest/find/missed_beads.hpp"
#include "ingest/profile/film_calibration.hpp"
#include "ingest/profile/frame_findings.hpp"
#include "ingest/profile/measure_bed.hpp"
#include "ingest/profile/photographs.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

// 6 x 4 disks of 8 px: their lowest row rests at y = 110, the others 22 px above one another. `moved` px up.
std::vector<RenderedDisk> four_rows(double moved = 0) {
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < 24; ++k) disks.push_back({20.4 + 20.3 * (k % 6), 102 - 22.0 * (k / 6) - moved, 8, 0, 0});
  return disks;
}
GrayFrame small_frame(const std::vector<RenderedDisk>& disks, double light = 1) {
  Camera camera;
  camera.width = 144, camera.height = 130;
  camera.background_level = 160 * light, camera.bead_level = 60 * light;
  camera.blur_px = 0.8, camera.read_noise = 1.5;
  return render_frame(disks, camera);
}
MeasureOptions small_options() {
  MeasureOptions options;
  options.bead_diameter_m = 1.6e-3;
  options.find.seen = BeadsSeen{Polarity::dark_beads, 8, false};
  options.pixel_aspect = 1, options.lens_radial = 0;
  return options;
}
Measurement measured(std::vector<GrayFrame> frames, const MeasureOptions& options) {
  FrameSource source = FrameSource::from_frames(std::move(frames));
  return measure_bed(source, options);
}

// Floor, walls and scale given: x and z of each disk, numbers, densities and what is said.
TEST(SmallFilm, HasThePlacesOfItsDisks) {
  MeasureOptions options = small_options();
  options.floor_px = 112, options.floor_slope = 0.02;
  options.left_wall_px = 9, options.right_wall_px = 119;
  options.scale_m_per_px = 1e-4;
  options.kernel = {KernelKind::top_hat, 0.5}, options.bin_width = 0.5;
  std::vector<RenderedDisk> fewer = four_rows();
  fewer.pop_back();
  GrayFrame empty = test::even_frame(144, 130, 160);
  const Measurement found =
      measured({small_frame(four_rows()), small_frame(fewer), empty, test::even_frame(100, 90, 160)}, options);
  ASSERT_EQ(found.disks.size(), 47U);
  EXPECT_EQ(found.disk_total, 47U);
  const double cosine = 1 / std::sqrt(1 + 0.02 * 0.02);
  for (const MeasuredDisk& disk : found.disks) {
    EXPECT_NEAR(disk.z, (112 + 0.02 * disk.x_px - disk.y_px) * cosine / 16, 1e-9);
    // Along the floor, from where it meets the left wall's perpendicular.
    EXPECT_NEAR(disk.x, ((disk.x_px - 9) + 0.02 * (disk.y_px - 112 - 0.02 * disk.x_px)) * cosine / 16, 1e-9);
    EXPECT_NEAR(disk.std_error_px, std::sqrt(0.5 * (disk.variance_x + disk.variance_y)), 1e-12);
    EXPECT_EQ(disk.species, 1);
    EXPECT_EQ(disk.probability, 1);
  }
  EXPECT_EQ(found.disks.front().frame, 0U);
  EXPECT_EQ(found.disks.back().frame, 1U);
  ASSERT_EQ(found.frames.size(), 4U);
  EXPECT_EQ(found.frames[0].status, FrameStatus::good);
  EXPECT_EQ(found.frames[0].disks, 24U);
  EXPECT_EQ(found.frames[2].status, FrameStatus::nothing_found);
  EXPECT_EQ(found.frames[3].status, FrameStatus::size_changed);
  EXPECT_TRUE(test::holds(found.frames[3].why, "100 x 90 px, but the first one is 144 x 130"));
  // 24, 23 and 0 disks in the three frames that could be used; of the first six columns five lie between the walls.
  EXPECT_NEAR(found.disk_count_mean, 47.0 / 3, 1e-9);
  EXPECT_NEAR(found.disk_count_std,
              std::sqrt((std::pow(24 - 47.0 / 3, 2) + std::pow(23 - 47.0 / 3, 2) + std::pow(47.0 / 3, 2)) / 2), 1e-9);
  EXPECT_NEAR(found.count_in_width_mean, 40.0 / 3, 1e-9);
  EXPECT_NEAR(found.calibration.width, 110.0 / 16, 1e-9);
  EXPECT_NEAR(*found.column_number(), 40.0 / 3 / (110.0 / 16), 1e-9);
  EXPECT_NEAR(found.calibration.floor_tilt_degrees, std::atan(0.02) * 180 / std::numbers::pi, 1e-9);
  EXPECT_EQ(found.profile.samples, 3U);
  double sum = 0;
  for (const double density : found.profile.number_density) sum += density * 0.5 * 110.0 / 16;
  EXPECT_NEAR(sum, 40.0 / 3, 1e-6);
  EXPECT_EQ(found.profile.bins.lowest, 0);
  EXPECT_EQ(found.profile.bins.count, 12U);  // a diameter above the highest disk, at z = 4.9: up to 6
  EXPECT_TRUE(test::any_holds(found.warnings, "1 of 4 frames differ from the first one in size"));
  EXPECT_TRUE(test::any_holds(found.warnings, "2 of 4 frames could not be used"));
  EXPECT_TRUE(test::any_holds(found.warnings, "The number of disks found varies by 13.6"));
  EXPECT_TRUE(test::any_holds(found.warnings, "The floor is tilted by 1.15 +- 0.00 degrees"));
  EXPECT_FALSE(found.floor_out_of_view || found.surface_out_of_view);
}

// Rims are learned from the second frame, since the first shows nothing. Disks belong to their own frame.
TEST(SmallFilm, ByRimsHasTheDisksOfEachFrame) {
  MeasureOptions options = small_options();
  options.find.seen->no_faces = true;
  options.calibration_frames = 1;
  std::vector<std::vector<RenderedDisk>> drawn = {{}, four_rows(), four_rows(12)};
  drawn[2].pop_back();
  const Measurement found = measured({small_frame(drawn[0]), small_frame(drawn[1]), small_frame(drawn[2])}, options);
  EXPECT_TRUE(found.finder.by_rims);
  ASSERT_EQ(found.disks.size(), 47U);
  std::array<std::size_t, 3> in_frame{};
  for (const MeasuredDisk& disk : found.disks) {
    ++in_frame.at(disk.frame);
    const bool drawn_there = std::any_of(drawn[disk.frame].begin(), drawn[disk.frame].end(), [&](const auto& one) {
      return std::hypot(one.x_px - disk.x_px, one.y_px - disk.y_px) < 1;
    });
    EXPECT_TRUE(drawn_there) << disk.frame << " " << disk.x_px << " " << disk.y_px;
  }
  EXPECT_EQ(in_frame, (std::array<std::size_t, 3>{0, 24, 23}));
}

// The border of a region is another one behind a lens that is given: the frame that was learned from is searched again.
TEST(SmallFilm, ByRimsThroughALensHasAsManyDisksInTheFirstFrame) {
  MeasureOptions options = small_options();
  options.find.seen->no_faces = true;
  options.lens_radial = 0.1;
  options.find.roi = PixelRectangle{0, 0, 144, 84};
  const Measurement found = measured({small_frame(four_rows()), small_frame(four_rows())}, options);
  ASSERT_EQ(found.frames.size(), 2U);
  EXPECT_TRUE(found.finder.by_rims);
  EXPECT_EQ(found.frames[0].disks, found.frames[1].disks);
}

// Beads cut by the upper border: the profile ends below them. By the lower one: the floor is not in view.
TEST(SmallFilm, EndsWhereItsBordersCutBeads) {
  MeasureOptions options = small_options();
  options.kernel = {KernelKind::top_hat, 0.5}, options.bin_width = 0.5;
  std::vector<RenderedDisk> disks = four_rows();
  for (int k = 0; k < 4; ++k) disks.push_back({30.0 + 26 * k, 2, 8, 0, 0});
  const std::vector<GrayFrame> frames = {small_frame(disks), small_frame(disks)};
  const Measurement above = measured(frames, options);
  EXPECT_TRUE(above.surface_out_of_view);
  EXPECT_FALSE(above.column_known);
  EXPECT_FALSE(above.column_number());
  const double diameter = options.bead_diameter_m / above.calibration.scale_m_per_px;
  // A radius below the border, and half of the kernel: (110 - 8)/16 - 0.25 = 6.1, so 12 bins.
  EXPECT_EQ(
      above.profile.bins.count,
      static_cast<std::size_t>(std::floor(((above.calibration.floor_px - 0.5 * diameter) / diameter - 0.25) / 0.5)));
  EXPECT_EQ(above.profile.bins.count, 12U);
  EXPECT_TRUE(test::any_holds(above.warnings, "the profile ends at 6.0 D"));
  EXPECT_TRUE(test::any_holds(above.warnings, "Their number is unknown"));
  options.highest = 8;
  const Measurement higher = measured(frames, options);
  EXPECT_EQ(higher.profile.bins.count, 16U);
  EXPECT_TRUE(test::any_holds(higher.warnings, "above 6.1 D beads are missing")) << higher.warnings.front();
  options = small_options();
  const std::vector<RenderedDisk> low = four_rows(-24);
  const Measurement below = measured({small_frame(low), small_frame(low)}, options);
  EXPECT_TRUE(below.floor_out_of_view);
  EXPECT_TRUE(test::any_holds(below.warnings, "the floor is not in view"));
  options.floor_px = 134;
  EXPECT_FALSE(measured({small_frame(low), small_frame(low)}, options).floor_out_of_view);
  options.floor_px = 261;
  EXPECT_THROW(measured({small_frame(low)}, options), std::invalid_argument);
}

// A surface is out of view where more beads are cut than there are frames, here one of one. The number of beads is
// unknown all the same: among 25 one bead is more than one in two thousand.
TEST(SmallFilm, HasItsSurfaceInViewWhereEveryFrameCutsOneBead) {
  std::vector<RenderedDisk> disks = four_rows();
  disks.push_back({72, 2, 8, 0, 0});
  MeasureOptions options = small_options();
  options.floor_px = 110, options.left_wall_px = 9, options.right_wall_px = 132, options.scale_m_per_px = 1e-4;
  const Measurement found = measured({small_frame(disks)}, options);
  ASSERT_EQ(found.disks.size(), 25U);
  EXPECT_FALSE(found.surface_out_of_view);
  EXPECT_FALSE(found.column_known);
  // The same at the lower border.
  std::vector<RenderedDisk> low = four_rows();
  low.push_back({72, 128, 8, 0, 0});
  options.floor_px.reset();
  const Measurement below = measured({small_frame(low)}, options);
  EXPECT_FALSE(below.floor_out_of_view);
}

// A bed that goes up and down by 4 px, without a frame rate: half of the range is the floor's error, or half of the
// amplitude given raises it.
TEST(SmallFilm, ThatMovesDoubtsItsFloor) {
  std::vector<GrayFrame> frames;
  for (int k = 0; k < 5; ++k) frames.push_back(small_frame(four_rows(k % 2 == 0 ? 0 : 4)));
  MeasureOptions options = small_options();
  const Measurement seen = measured(frames, options);
  EXPECT_EQ(seen.calibration.floor_reference, FloorReference::lowest_seen);
  EXPECT_NEAR(seen.calibration.floor_px, 110, 0.2);
  EXPECT_NEAR(seen.calibration.floor_std_error_px, 2, 0.1);
  EXPECT_TRUE(test::any_holds(seen.warnings, "The lowest beads move by 0.25 D"));
  EXPECT_TRUE(is_shaken(seen) == (seen.calibration.floor_std_error_px > 0.25 * 16));
  options.floor_amplitude_m = 3e-4;  // 3 px
  const Measurement raised = measured(frames, options);
  EXPECT_EQ(raised.calibration.floor_reference, FloorReference::mean_by_amplitude);
  EXPECT_NEAR(raised.calibration.floor_px, seen.calibration.floor_px - 1.5, 0.02);
  EXPECT_NEAR(raised.calibration.floor_std_error_px, 1.5, 0.05);
  EXPECT_LT(raised.profile.bins.lowest, 0);
  EXPECT_TRUE(is_shaken(raised));
  options.floor_amplitude_m = 6e-4;  // farther than the beads move
  const Measurement ignored = measured(frames, options);
  EXPECT_EQ(ignored.calibration.floor_reference, FloorReference::lowest_seen);
  EXPECT_TRUE(test::any_holds(ignored.warnings, "but the lowest beads move by only 0.25 D: the amplitude is not used"));
  // By the phase of a shaking of half the frame rate the two positions are apart.
  options.floor_amplitude_m.reset();
  options.frame_rate_hz = 100, options.shaking_frequency_hz = 50, options.phase_bins = 4;
  const Measurement phases = measured(frames, options);
  ASSERT_EQ(phases.phases.size(), 2U);
  EXPECT_NEAR(phases.phases[0].phase, 0.125, 1e-12);
  EXPECT_NEAR(phases.phases[1].phase, 0.625, 1e-12);
  EXPECT_EQ(phases.phases[0].profile.samples, 3U);
  EXPECT_EQ(phases.phases[1].profile.samples, 2U);
  EXPECT_TRUE(phases.calibration.frequency_given);
}

// Light that changes by a tenth from frame to frame.
TEST(SmallFilm, KnowsHowItsLightFlickers) {
  const Measurement found = measured({small_frame(four_rows()), small_frame(four_rows(), 1.2)}, small_options());
  EXPECT_NEAR(found.frames[1].light.gain / found.frames[0].light.gain, 1.2, 0.01);
  const double a = found.frames[0].light.gain, b = found.frames[1].light.gain;
  EXPECT_NEAR(found.calibration.flicker, 0.5 * std::abs(b - a), 1e-6);
  EXPECT_TRUE(test::any_holds(found.warnings, "The light flickers"));
  EXPECT_TRUE(found.coverage_profile);
  EXPECT_LT(found.coverage_disagreement, 0.06);
  MeasureOptions options = small_options();
  options.profile_from_coverage = false;
  EXPECT_FALSE(measured({small_frame(four_rows())}, options).coverage_profile);
}

// Frames averaged over 2 x 2 px: all lengths are px of the frames as they were.
TEST(SmallFilm, ReducedHasTheLengthsOfItsFrames) {
  Camera camera;
  camera.width = 288, camera.height = 260;
  camera.background_level = 160, camera.bead_level = 60, camera.blur_px = 1.5, camera.read_noise = 2;
  std::vector<RenderedDisk> disks = four_rows();
  for (RenderedDisk& disk : disks)
    disk.x_px = 2 * disk.x_px + 0.5, disk.y_px = 2 * disk.y_px + 0.5, disk.radius_px = 16;
  const GrayFrame large = render_frame(disks, camera);
  GrayFrame half = test::even_frame(144, 130, 0);
  for (int row = 0; row < 130; ++row)
    for (int column = 0; column < 144; ++column)
      test::set(half, column, row,
                0.25 * static_cast<double>(large.at(2 * column, 2 * row) + large.at(2 * column + 1, 2 * row) +
                                           large.at(2 * column, 2 * row + 1) + large.at(2 * column + 1, 2 * row + 1)));
  MeasureOptions options = small_options();
  options.find.seen = BeadsSeen{Polarity::dark_beads, 16, false};
  options.floor_px = 222, options.floor_slope = 0.01, options.left_wall_px = 20, options.right_wall_px = 270;
  options.find.roi = PixelRectangle{0, 0, 288, 260};
  options.reduction = 2;
  std::vector<MeasuredDisk> sunk;
  const Measurement reduced = measured({half}, options);
  options.disk_sink = [&](const FrameReport&, const std::vector<MeasuredDisk>& some) { sunk = some; };
  measured({half}, options);
  ASSERT_EQ(reduced.disks.size(), 24U);
  ASSERT_EQ(sunk.size(), 24U);
  for (std::size_t k = 0; k < 24; ++k) {
    const auto nearest = std::min_element(disks.begin(), disks.end(), [&](const auto& a, const auto& b) {
      return std::hypot(a.x_px - reduced.disks[k].x_px, a.y_px - reduced.disks[k].y_px) <
             std::hypot(b.x_px - reduced.disks[k].x_px, b.y_px - reduced.disks[k].y_px);
    });
    EXPECT_NEAR(reduced.disks[k].x_px, nearest->x_px, 0.2);
    EXPECT_NEAR(reduced.disks[k].y_px, nearest->y_px, 0.2);
    EXPECT_NEAR(reduced.disks[k].radius_px, 16, 0.2);
    EXPECT_EQ(sunk[k].x_px, reduced.disks[k].x_px);
    EXPECT_EQ(sunk[k].std_error_px, reduced.disks[k].std_error_px);
    EXPECT_NEAR(reduced.disks[k].std_error_px,
                std::sqrt(0.5 * (reduced.disks[k].variance_x + reduced.disks[k].variance_y)), 1e-9);
  }
  const BedCalibration& bed = reduced.calibration;
  EXPECT_NEAR(bed.radius_px, 16, 0.2);
  EXPECT_NEAR(bed.floor_px, 222, 1e-9);
  EXPECT_EQ(bed.floor_slope, 0.01);
  EXPECT_NEAR(bed.left_wall_px, 20, 1e-9);
  EXPECT_NEAR(bed.right_wall_px, 270, 1e-9);
  EXPECT_NEAR(bed.scale_m_per_px, 1.6e-3 / (2 * bed.radius_px), 1e-9);
  EXPECT_NEAR(bed.width, 250 / (2 * bed.radius_px), 1e-6);
  EXPECT_NEAR(bed.edge_width_px, std::hypot(1.5, 0.6), 0.35);
  EXPECT_NEAR(reduced.contacts.nearest_px, 40.6, 0.3);
  EXPECT_EQ(reduced.bed_region.width, 288);
  EXPECT_EQ(reduced.bed_region.height, 260);
}

// Bands of the beads' level along each side are not seen, those of the background's are.
TEST(SmallFilm, WallsOnEachSideAreNotSeen) {
  for (const double level : {60.0, 160.0})
    for (const FrameSide side : {FrameSide::bottom, FrameSide::top, FrameSide::left, FrameSide::right}) {
      GrayFrame frame = small_frame(four_rows());
      const auto depth = [&](int column, int row) {
        return side == FrameSide::bottom  ? 129 - row
               : side == FrameSide::top   ? row
               : side == FrameSide::right ? 143 - column
                                          : column;
      };
      for (int row = 0; row < 130; ++row)
        for (int column = 0; column < 144; ++column)
          if (depth(column, row) < 8) test::set(frame, column, row, level);
      const GrayFrame open = without_walls(frame, Polarity::dark_beads, 8);
      for (const auto& [column, row] : {std::array{72, 2}, {72, 127}, {2, 65}, {141, 65}})
        EXPECT_EQ(unseen(open.at(column, row)), level < 100 && depth(column, row) < 8)
            << level << ' ' << static_cast<int>(side) << ' ' << column << ' ' << row;
      EXPECT_FALSE(unseen(open.at(71, 58)));
    }
}

// By their rims alone: what is known of beads then, and what is not.
TEST(SmallFilm, BeadsByTheirRims) {
  const GrayFrame frame = small_frame(four_rows());
  const CalibrationResult rims = learn_by_rims(frame, {Polarity::dark_beads, 8, false});
  ASSERT_TRUE(rims.found);
  const FinderCalibration& finder = rims.calibration;
  EXPECT_TRUE(finder.by_rims);
  EXPECT_NEAR(finder.radius_px, 8, 0.15);
  EXPECT_EQ(finder.radius_px, finder.rim_radius_px);
  EXPECT_NEAR(finder.radius_std_error_px, std::hypot(finder.rims->radius_std_error_px, 0.2), 1e-12);
  EXPECT_EQ(finder.contrast_level, -finder.rims->contrast);
  EXPECT_EQ(finder.width, 144);
  EXPECT_EQ(finder.height, 130);
  EXPECT_EQ(finder.disks_used, 24U);
  EXPECT_EQ(finder.frames_used, 1U);
  EXPECT_LT(finder.expected_missed, 0.02);
  EXPECT_TRUE(finder.warnings.empty());
  const FindResult found = find_beads(frame, finder, {});
  EXPECT_EQ(found.disks.size(), 24U);
  for (const FoundDisk& disk : found.disks) {
    EXPECT_GT(disk.probability, 0.95);
    EXPECT_FALSE(disk.other_size || disk.cut);
  }
  EXPECT_FALSE(learn_by_rims(test::even_frame(144, 130, 160), {Polarity::dark_beads, 8, false}).found);
  // By faces and rims together nothing is missed and nothing is left out.
  FindOptions options;
  options.seen = BeadsSeen{Polarity::dark_beads, 8, false};
  const CalibrationResult both = learn_beads({&frame}, options);
  ASSERT_TRUE(both.found);
  EXPECT_FALSE(both.calibration.by_rims);
  EXPECT_FALSE(both.calibration.rims_to_be_checked);
  EXPECT_FALSE(both.calibration.left_out);
  EXPECT_LT(both.calibration.expected_missed, 0.02);
  EXPECT_EQ(find_beads(frame, both.calibration, options).disks.size(), 24U);
}

// One call for a photograph in memory: what it says, and what it says of one without beads.
TEST(SmallFilm, APhotographInMemoryIsFound) {
  const GrayFrame frame = small_frame(four_rows());
  std::vector<std::uint8_t> bytes;
  for (const float level : frame.pixels) bytes.push_back(static_cast<std::uint8_t>(level));
  const ImageView view{144, 130, bytes.data(), PixelType::u8, 0};
  FindOptions seen;
  seen.seen = BeadsSeen{Polarity::dark_beads, 8, false};
  const DisksFound found = find_disks(view, seen);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found.disks.size(), 24U);
  EXPECT_LT(found.expected_wrong, 0.02);
  EXPECT_TRUE(test::holds(found.brief(), "24 dark disks of radius 8.0")) << found.brief();
  EXPECT_TRUE(test::holds(found.full(), "edge width"));
  EXPECT_TRUE(test::holds(found.full(), "expected missed"));
  const std::vector<std::uint8_t> even(bytes.size(), 100);
  EXPECT_EQ(find_disks({144, 130, even.data(), PixelType::u8, 0}).status, FindStatus::no_beads);
  EXPECT_EQ(find_disks({0, 130, even.data(), PixelType::u8, 0}).status, FindStatus::bad_input);
  seen.radius_px = -1;
  EXPECT_EQ(find_disks(view, seen).status, FindStatus::bad_input);
}

// A frame that is said to be reduced by 2 gives what it gives by itself, in pixels half as large. Column 0 of the one
// is at 1/2 of the other.
TEST(SmallFilm, ReducedIsItselfInSmallerPixels) {
  for (const bool floor_given : {true, false}) {
    const std::vector<GrayFrame> frames = {small_frame(four_rows()), small_frame(four_rows(2))};
    MeasureOptions options = small_options();
    options.left_wall_px = 9.75, options.right_wall_px = 134.75;
    if (floor_given) options.floor_px = 111, options.floor_slope = 0.01;
    const Measurement own = measured(frames, options);
    options.left_wall_px = 20, options.right_wall_px = 270;
    if (floor_given) options.floor_px = 222.5 - 0.01 * 0.5;
    options.find.seen->radius_px = 16, options.reduction = 2;
    const Measurement twice = measured(frames, options);
    ASSERT_EQ(own.disks.size(), 48U);
    ASSERT_EQ(twice.disks.size(), 48U);
    for (std::size_t k = 0; k < 48; ++k) {
      EXPECT_NEAR(twice.disks[k].x_px, 2 * own.disks[k].x_px + 0.5, 1e-9);
      EXPECT_NEAR(twice.disks[k].y_px, 2 * own.disks[k].y_px + 0.5, 1e-9);
      EXPECT_NEAR(twice.disks[k].radius_px, 2 * own.disks[k].radius_px, 1e-9);
      EXPECT_NEAR(twice.disks[k].std_error_px, 2 * own.disks[k].std_error_px, 1e-12);
      EXPECT_NEAR(twice.disks[k].variance_x, 4 * own.disks[k].variance_x, 1e-12);
      EXPECT_NEAR(twice.disks[k].variance_y, 4 * own.disks[k].variance_y, 1e-12);
      EXPECT_NEAR(twice.disks[k].covariance_xy, 4 * own.disks[k].covariance_xy, 1e-12);
      EXPECT_NEAR(twice.disks[k].x, own.disks[k].x, 1e-9);
      EXPECT_NEAR(twice.disks[k].z, own.disks[k].z, 1e-9);
    }
    const BedCalibration &a = own.calibration, &b = twice.calibration;
    EXPECT_NEAR(b.scale_m_per_px, 0.5 * a.scale_m_per_px, 1e-15);
    EXPECT_NEAR(b.radius_px, 2 * a.radius_px, 1e-9);
    EXPECT_NEAR(b.radius_std_error_px, 2 * a.radius_std_error_px, 1e-9);
    EXPECT_NEAR(b.edge_width_px, 2 * a.edge_width_px, 1e-9);
    EXPECT_NEAR(b.floor_px, 2 * a.floor_px + 0.5 - 0.5 * a.floor_slope, 1e-9);
    EXPECT_EQ(b.floor_slope, a.floor_slope);
    EXPECT_EQ(a.floor_std_error_px > 0, !floor_given);
    EXPECT_NEAR(b.floor_std_error_px, 2 * a.floor_std_error_px, 1e-9);
    EXPECT_NEAR(b.left_wall_px, 20, 1e-9);
    EXPECT_NEAR(b.right_wall_px, 270, 1e-9);
    EXPECT_NEAR(b.width, a.width, 1e-9);
    EXPECT_NEAR(twice.contacts.nearest_px, 2 * own.contacts.nearest_px, 1e-9);
    EXPECT_NEAR(twice.contacts.touching_px, 2 * own.contacts.touching_px, 1e-9);
    EXPECT_EQ(twice.bed_region.width, 2 * own.bed_region.width);
    EXPECT_EQ(twice.bed_region.height, 2 * own.bed_region.height);
    ASSERT_EQ(twice.profile.bins.count, own.profile.bins.count);
    for (std::size_t k = 0; k < own.profile.bins.count; ++k)
      EXPECT_NEAR(twice.profile.number_density[k], own.profile.number_density[k], 1e-9);
  }
}

// The rows' covered area is that of the beads between the walls given, and of all where the sides are periodic. A wall
// through the middle of a column of four, at 20.4 px, leaves what lies right of the edge of pixel 20: half of each,
// less a strip of 0.1 px.
TEST(SmallFilm, CoversTheAreaBetweenItsWalls) {
  const GrayFrame frame = small_frame(four_rows());
  MeasureOptions options = small_options();
  const auto beads_covered = [&] {
    FrameSource source = FrameSource::from_frames({frame});
    const FilmCalibration film = calibrate_film(source, options);
    source.rewind();
    auto item = source.next_item();
    const FrameFindings findings = FrameExaminer(film).examine(*item);
    double sum = 0;
    for (const float row : findings.coverage_of_row) sum += static_cast<double>(row);
    EXPECT_EQ(findings.coverage_of_row.size(), 130U);
    return sum / (std::numbers::pi * film.finder.radius_px * film.finder.radius_px);
  };
  const double strip = 1.6 / (std::numbers::pi * 64), all = beads_covered();
  EXPECT_NEAR(all, 24, 0.5);
  options.left_wall_px = 30.5;
  EXPECT_NEAR(beads_covered() / all, 20.0 / 24, 3e-3);
  options.left_wall_px = 20.4;
  EXPECT_NEAR(beads_covered() / all, (22 - 4 * strip) / 24, 3e-3);
  options.right_wall_px = 111;
  EXPECT_NEAR(beads_covered() / all, (18 - 4 * strip) / 24, 3e-3);
  options.periodic_sides = true;
  EXPECT_NEAR(beads_covered() / all, 1, 1e-12);
}

// What is learned of the bead is what was drawn: 100 levels darker than the background, noise of 1.5 levels, an edge of
// blur and pixel. Half of the beads look at least as the one in the middle does.
TEST(SmallFilm, LearnsTheBeadThatWasDrawn) {
  const GrayFrame frame = small_frame(four_rows());
  FinderCalibration finder;
  const FindResult found = find_disks(frame, {}, &finder);
  ASSERT_EQ(found.disks.size(), 24U);
  EXPECT_EQ(finder.polarity, Polarity::dark_beads);
  EXPECT_NEAR(finder.radius_px, 8, 0.03);
  EXPECT_NEAR(finder.contrast_level, -100, 1);
  EXPECT_NEAR(finder.noise_level, 1.5, 0.15);
  EXPECT_NEAR(finder.residual_level, 1.6, 0.4);
  EXPECT_NEAR(finder.edge_width_px, std::hypot(0.8, 0.289), 0.06);
  EXPECT_EQ(finder.width, 144);
  EXPECT_EQ(finder.height, 130);
  EXPECT_EQ(finder.frames_used, 1U);
  EXPECT_EQ(finder.disks_used, 24U);
  EXPECT_FALSE(finder.solid_borders);
  std::size_t best = 0;
  for (const FoundDisk& disk : found.disks) {
    best += disk.quality == 1;
    EXPECT_GT(disk.quality, 0.97);
    EXPECT_NEAR(disk.contrast, 1, 0.02);
    EXPECT_EQ(disk.radius_px, finder.radius_px);
    EXPECT_FALSE(disk.half_hidden || disk.cut || disk.other_size);
    // Of one disk of contrast c and noise s the least variance is s^2/(pi R c^2) times 2 sqrt(pi) edge, and 0.0012 px.
    const double least =
        1.5 * 1.5 / 1e4 * 2 * std::sqrt(std::numbers::pi) * finder.edge_width_px / (std::numbers::pi * 8);
    EXPECT_NEAR(disk.variance_x, least + 0.0012 * 0.0012, 0.2 * least);
    EXPECT_NEAR(disk.variance_y, least + 0.0012 * 0.0012, 0.2 * least);
    EXPECT_NEAR(disk.covariance_xy, 0, 0.1 * least);
  }
  EXPECT_GE(best, 12U);
  EXPECT_LT(best, 24U);
  EXPECT_EQ(found.rejected, 0U);
  // Of four beads hardly anything is learned, and this is said.
  std::vector<RenderedDisk> few = four_rows();
  few.resize(4);
  find_disks(small_frame(few), {}, &finder);
  EXPECT_TRUE(test::any_holds(finder.warnings, "learned from only 4 disks"));
  few = four_rows();
  few.resize(5);
  find_disks(small_frame(few), {}, &finder);
  EXPECT_FALSE(test::any_holds(finder.warnings, "learned from only"));
}

// A radius that is held is taken as it is; without a learned profile the bead is a flat disk with a Gaussian edge;
// without sweeps centres are those of the map, less sharp.
TEST(SmallFilm, ObeysTheOptionsOfItsFinder) {
  const std::vector<RenderedDisk> truth = four_rows();
  const GrayFrame frame = small_frame(truth);
  const auto rms_of = [&](const std::vector<FoundDisk>& disks) {
    EXPECT_EQ(disks.size(), 24U);
    double squares = 0;
    for (const FoundDisk& disk : disks) {
      double nearest = 100;
      for (const RenderedDisk& one : truth)
        nearest = std::min(nearest, std::pow(one.x_px - disk.x_px, 2) + std::pow(one.y_px - disk.y_px, 2));
      squares += nearest / 48;
    }
    return std::sqrt(squares);  // of a coordinate
  };
  FindOptions options;
  FinderCalibration finder;
  const double fitted = rms_of(find_disks(frame, options, &finder).disks);
  EXPECT_LT(fitted, 0.01);
  options.radius_px = 8.3, options.hold_radius = true;
  const FindResult held = find_disks(frame, options, &finder);
  EXPECT_EQ(finder.radius_px, 8.3);
  EXPECT_EQ(held.disks.front().radius_px, 8.3);
  options.hold_radius = false;
  find_disks(frame, options, &finder);
  EXPECT_NEAR(finder.radius_px, 8, 0.03) << "a first value";
  options = {};
  options.learn_profile = false;
  EXPECT_LT(rms_of(find_disks(frame, options, &finder).disks), 0.02);
  ASSERT_GT(finder.profile.level.size(), 20U);
  for (std::size_t k = 0; k + 1 < finder.profile.level.size(); ++k) {
    const double flat = blurred_disk_contrast(
        finder.rim_radius_px, finder.edge_width_px, [](double) { return 1.0; },
        static_cast<double>(k) * finder.profile.step_px);
    ASSERT_NEAR(finder.profile.level[k], flat, 2e-3) << k;
    ASSERT_EQ(finder.profile.fourth_harmonic[k], 0) << k;
  }
  EXPECT_EQ(finder.profile.asymmetry, nullptr);
  options = {};
  options.joint_fit_sweeps = 0;
  const double without = rms_of(find_disks(frame, options).disks);
  EXPECT_GT(without, 1.5 * fitted) << fitted;
  EXPECT_LT(without, 0.1);
}

// A bead of which half is covered by background: not reported, or with its flag.
TEST(SmallFilm, KeepsWhatIsHalfHiddenIfAsked) {
  const std::vector<RenderedDisk> truth = four_rows();
  GrayFrame frame = small_frame(truth);
  const RenderedDisk& covered = truth[9];
  for (int row = 0; row < 130; ++row)
    for (int column = 0; column < 144; ++column)
      if (std::hypot(column - covered.x_px, row - covered.y_px) < 10.5 && column > covered.x_px + 0.5)
        test::set(frame, column, row, 160 + 1.5 * (test::scattered(column, row) - 0.5));
  FindOptions options;
  const FindResult whole = find_disks(frame, options);
  EXPECT_EQ(whole.disks.size(), 23U);
  EXPECT_EQ(whole.rejected, 1U);
  options.keep_half_hidden = true;
  const FindResult all = find_disks(frame, options);
  ASSERT_EQ(all.disks.size(), 24U);
  EXPECT_EQ(all.rejected, 0U);
  for (const FoundDisk& disk : all.disks) {
    const bool own = std::hypot(disk.x_px - covered.x_px, disk.y_px - covered.y_px) < 3;
    EXPECT_EQ(disk.half_hidden, own);
    EXPECT_EQ(disk.quality < 0.9, own) << disk.quality;
    EXPECT_NEAR(disk.contrast, own ? 0.53 : 1, own ? 0.05 : 0.01);
  }
}

// Frames of another size, and nothing that is a bead: what is said, with the radius in pixels as recorded.
TEST(SmallFilm, SaysWhyItFindsNothing) {
  const GrayFrame frame = small_frame(four_rows());
  FinderCalibration finder;
  find_disks(frame, {}, &finder);
  finder.recorded_px = 2, finder.rim_radius_px = 8;
  const FindResult other = find_disks(test::even_frame(100, 90, 160), finder);
  EXPECT_EQ(other.why_nothing, "the frame is 100 x 90 px, but the beads were learned in frames of 144 x 130 px");
  const FindResult nothing = find_disks(test::even_frame(144, 130, 160), finder);
  EXPECT_TRUE(nothing.empty());
  EXPECT_EQ(nothing.why_nothing, "no place in the frame looks like a bead of radius 16.000000 px");
  EXPECT_THROW(residual_frame(test::even_frame(100, 90, 160), other, finder), std::invalid_argument);
  EXPECT_THROW(learn_again({}, {}, finder), std::invalid_argument);
  EXPECT_EQ(learn_finder({}, {}).why_not, "there is no frame from which beads could be learned");
}

// Beads missed are counted one by one, smaller ones by their area; not one that lies alone, nor a straight line, nor
// what is outside the region.
TEST(MissedBeads, AreCountedByTheirAreas) {
  RimModel model;
  model.polarity = Polarity::dark_beads, model.radius_px = 8, model.contrast = 100;
  const auto missed = [&](std::vector<RenderedDisk> drawn, const std::vector<std::size_t>& left_out,
                          const std::optional<PixelRectangle>& region = {}) {
    std::vector<Circle> circles;
    for (std::size_t k = 0; k < 24; ++k)
      if (std::find(left_out.begin(), left_out.end(), k) == left_out.end())
        circles.push_back({.x = drawn[k].x_px, .y = drawn[k].y_px, .radius = 8});
    return expected_missed_beads(small_frame(drawn), model, circles, region);
  };
  std::vector<RenderedDisk> disks = four_rows();
  EXPECT_EQ(missed(disks, {}), 0);
  EXPECT_EQ(missed(disks, {9}), 1);
  EXPECT_EQ(missed(disks, {7, 9, 15}), 3);
  EXPECT_EQ(missed(disks, {7, 9}, PixelRectangle{70, 60, 40, 40}), 1) << "disk 9 alone";
  // Between four at these distances a place of 0.8 or 0.6 radii is free, and none of one radius.
  for (const auto& [away, radius, counted] : {std::array{14.8, 6.4, 0.64}, {13.2, 4.8, 0.36}}) {
    disks = four_rows();
    const double x = disks[9].x_px, y = disks[9].y_px;
    disks[8].x_px = x - away, disks[10].x_px = x + away, disks[3].y_px = y + away, disks[15].y_px = y - away;
    disks[9].radius_px = radius;
    EXPECT_NEAR(missed(disks, {9}), counted, 1e-9);
  }
  disks = four_rows();
  disks.push_back({60, 11, 8, 0, 0});  // its centre 25 px above the next: 9 px between rims
  EXPECT_EQ(missed(disks, {}), 1);
  std::vector<Circle> below;
  for (std::size_t k = 0; k < 12; ++k) below.push_back({.x = disks[k].x_px, .y = disks[k].y_px, .radius = 8});
  disks.erase(disks.begin() + 12, disks.begin() + 24);
  EXPECT_EQ(expected_missed_beads(small_frame(disks), model, below, {}), 0) << "far from all others";
}

}  // namespace
}  // namespace shakebed::ingest
