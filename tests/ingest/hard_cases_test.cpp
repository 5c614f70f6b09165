// Inputs that break disk finders. None may crash, hang, return NaN or a silent nothing.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "ingest/find/find_disks.hpp"
#include "ingest/profile/measure_bed.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/test_files.hpp"
#include "tests/ingest/truth.hpp"

namespace shakebed::ingest {
namespace {

Camera camera_of(int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.blur_px = 0.8;
  camera.read_noise = 4;
  return camera;
}

std::vector<RenderedDisk> rows_and_gas(double radius, int width, int height, int rows, int gas) {
  SyntheticBed bed;
  bed.left_wall_px = 6;
  bed.right_wall_px = width - 6.5;
  bed.floor_px = height - 7.3;
  bed.radius_px = radius;
  bed.rows = rows;
  bed.gas_count = gas;
  bed.gas_height_px = 0.25 * height;
  bed.jitter_px = 0.01 * radius;
  return make_synthetic_bed(bed);
}

void expect_sane(const FindResult& result) {
  for (const FoundDisk& disk : result.disks) {
    ASSERT_TRUE(std::isfinite(disk.x_px) && std::isfinite(disk.y_px) && std::isfinite(disk.radius_px));
    ASSERT_TRUE(std::isfinite(disk.variance_x) && std::isfinite(disk.variance_y) && std::isfinite(disk.quality));
  }
  EXPECT_NE(result.disks.empty(), result.why_nothing.empty());
}

test::Score found_in(const std::vector<RenderedDisk>& truth, const Camera& camera) {
  const FindResult result = find_disks(render_frame(truth, camera));
  expect_sane(result);
  return test::score(result.disks, truth, camera.width, camera.height);
}

TEST(HardCases, TouchingPairAtAnyAngle) {
  for (int k = 0; k < 12; ++k) {
    const double angle = std::numbers::pi * k / 12 + 0.05;
    const double dx = 12 * std::cos(angle), dy = 12 * std::sin(angle);
    const std::vector<RenderedDisk> pair = {{64.2 - dx, 63.6 - dy, 12, 0, 0}, {64.2 + dx, 63.6 + dy, 12, 0, 0}};
    const test::Score score = found_in(pair, camera_of(128, 128));
    EXPECT_EQ(score.hits, 2U) << k;
    EXPECT_EQ(score.found, 2U) << k;
    EXPECT_LT(score.rms_px, 0.05) << k;
  }
}

TEST(HardCases, DisksCutByTheBorderAreFlagged) {
  std::vector<RenderedDisk> disks = {
      {2.5, 60, 12, 0, 0}, {64, 124.5, 12, 0, 0}, {60, 60, 12, 0, 0}, {100, 40, 12, 0, 0}};
  const GrayFrame frame = render_frame(disks, camera_of(128, 128));
  const FindResult result = find_disks(frame);
  const test::Score score = test::score(result.disks, disks, 128, 128);
  EXPECT_EQ(score.hits, 4U);
  EXPECT_EQ(score.found, 4U);
  for (const FoundDisk& disk : result.disks)
    EXPECT_EQ(disk.cut, disk.x_px < 11.5 || disk.y_px > 115.5) << disk.x_px << " " << disk.y_px;
}

TEST(HardCases, DisksOfThreePixels) {
  std::vector<RenderedDisk> disks;
  RandomStream random(1);
  for (int k = 0; k < 400; ++k)
    disks.push_back({12 + 10 * (k % 20) + random.uniform(), 12 + 10 * (k / 20) + random.uniform(), 1.5, 0, 0});
  Camera camera = camera_of(224, 224);
  camera.blur_px = 0.5;
  const test::Score score = found_in(disks, camera);
  EXPECT_GE(score.recall(), 0.99);
  EXPECT_GE(score.precision(), 0.99);
  EXPECT_LT(score.rms_px, 0.1);
}

TEST(HardCases, DisksOfTwoHundredPixels) {
  const std::vector<RenderedDisk> disks = {{120, 120, 100, 0, 0}, {333, 147, 100, 0, 0}, {220, 333, 100, 0, 0}};
  const test::Score score = found_in(disks, camera_of(454, 454));
  EXPECT_EQ(score.hits, 3U);
  EXPECT_EQ(score.found, 3U);
  EXPECT_LT(score.rms_px, 0.05);
}

TEST(HardCases, SaturatedUnderExposedAndFaint) {
  const auto truth = rows_and_gas(10, 360, 360, 6, 50);
  for (const auto& [background, bead] : {std::pair{330.0, 90.0}, {26.0, 4.0}, {140.0, 126.0}}) {
    Camera camera = camera_of(360, 360);
    camera.background_level = background;
    camera.bead_level = bead;
    camera.read_noise = 1.5;
    const test::Score score = found_in(truth, camera);
    EXPECT_GE(score.recall(), 0.99) << background;
    EXPECT_GE(score.precision(), 0.99) << background;
  }
}

TEST(HardCases, LightFallingByFourFifths) {
  const auto truth = rows_and_gas(10, 500, 400, 7, 80);
  Camera camera = camera_of(500, 400);
  camera.gradient_x = 0.8;
  camera.vignette = 0.3;
  const test::Score score = found_in(truth, camera);
  EXPECT_GE(score.recall(), 0.99);
  EXPECT_GE(score.precision(), 0.99);
}

TEST(HardCases, StreaksOfHalfADiameter) {
  auto truth = rows_and_gas(10, 400, 400, 0, 90);
  RandomStream random(5);
  for (RenderedDisk& disk : truth) {
    const double angle = 2 * std::numbers::pi * random.uniform();
    disk.velocity_x_px_per_s = 1e4 * std::cos(angle);
    disk.velocity_y_px_per_s = 1e4 * std::sin(angle);
  }
  Camera camera = camera_of(400, 400);
  camera.exposure_s = 1e-3;  // 10 px
  const test::Score score = found_in(truth, camera);
  EXPECT_GE(score.recall(), 0.97);
  EXPECT_GE(score.precision(), 0.97);
}

TEST(HardCases, DustOnTheGlass) {
  const auto truth = rows_and_gas(10, 400, 400, 6, 60);
  Camera camera = camera_of(400, 400);
  camera.dust_fraction = 0.05;
  const test::Score score = found_in(truth, camera);
  EXPECT_GE(score.recall(), 0.99);
  EXPECT_GE(score.precision(), 0.99);
}

TEST(HardCases, JpegArtefacts) {
  const auto truth = rows_and_gas(10, 400, 400, 6, 60);
  Camera camera = camera_of(400, 400);
  camera.jpeg_quality = 60;
  const test::Score score = found_in(truth, camera);
  EXPECT_EQ(score.recall(), 1.0);
  EXPECT_EQ(score.precision(), 1.0);
  EXPECT_LT(score.rms_px, 0.1);
}

// A dark band at the lower border, 0.7 and 1 D deep, could be laid out with cut beads: no row of them may be seen there
// (one in a corner is let pass), and the floor is the band's top.
TEST(HardCases, ADarkFloorIsNoRowOfBeads) {
  for (const double depth : {14.3, 20.3})
    for (const float level : {30.0F, 100.0F}) {
      SyntheticBed bed;
      bed.left_wall_px = 6, bed.right_wall_px = 393.5, bed.floor_px = 400 - depth;
      bed.rows = 6, bed.gas_count = 60, bed.jitter_px = 0.1;
      GrayFrame frame = render_frame(make_synthetic_bed(bed), camera_of(400, 400));
      std::fill(frame.pixels.begin() + static_cast<std::ptrdiff_t>(std::ceil(bed.floor_px)) * 400, frame.pixels.end(),
                level);
      FrameSource source = FrameSource::from_frames({frame});
      MeasureOptions options;
      options.bead_diameter_m = 1e-3;
      const Measurement measured = measure_bed(source, options);
      EXPECT_NEAR(measured.calibration.floor_px, bed.floor_px, 1) << depth << " " << level;
      const auto below = std::count_if(measured.disks.begin(), measured.disks.end(),
                                       [&](const MeasuredDisk& disk) { return disk.y_px > bed.floor_px; });
      EXPECT_LE(below, 1) << depth << " " << level;
    }
}

// A frame around the bed: floor and walls of any level from darker than the beads to brighter than the background,
// thin or thick, with background outside or none.
TEST(HardCases, AFrameAroundTheBedHidesNoBeadAndIsNone) {
  for (const auto& [level, thick, outside] :
       {std::tuple{10.0F, 7, true}, {60.0F, 20, true}, {60.0F, 60, false}, {130.0F, 20, true}, {245.0F, 30, false}}) {
    SyntheticBed bed;
    bed.left_wall_px = 80.5, bed.right_wall_px = 419.5, bed.floor_px = 419.5;
    bed.rows = 6, bed.gas_count = 60, bed.gas_height_px = 100, bed.jitter_px = 0.1;
    std::vector<RenderedDisk> truth = make_synthetic_bed(bed);
    GrayFrame frame = render_frame(truth, camera_of(500, 500));
    for (int row = 0; row < 500; ++row)
      for (int column = 0; column < 500; ++column) {
        const bool in = column > 80 && column < 420 && row < 420;
        const bool near = column > 80 - thick && column < 420 + thick && row < 420 + thick;
        if (!in && (near || !outside))
          frame.pixels[static_cast<std::size_t>(row * 500 + column)] =
              level + 1.5F * static_cast<float>(row * 7 % 3 - 1);
      }
    const test::Score score = test::score(find_disks(frame).disks, truth, 500, 500);
    EXPECT_EQ(score.recall(), 1.0) << level << " " << thick;
    EXPECT_EQ(score.precision(), 1.0) << level << " " << thick;
    EXPECT_LT(score.rms_px, 0.1) << level << " " << thick;
  }
}

// Spheres lit from the upper left, the far side at a third of the light; what the eye takes for the middle of a bead is
// a sixth of a radius off.
TEST(HardCases, BeadsLitFromOneSideAreWhereTheirOutlineIs) {
  const std::vector<RenderedDisk> truth = rows_and_gas(10, 400, 400, 6, 60);
  GrayFrame frame;
  frame.width = frame.height = 400;
  RandomStream random(5);
  constexpr int finer = 3;
  for (int row = 0; row < 400; ++row) {
    std::vector<RenderedDisk> beside;
    for (const RenderedDisk& disk : truth)
      if (std::abs(disk.y_px - row) < 12) beside.push_back(disk);
    for (int column = 0; column < 400; ++column) {
      double sum = 0;
      std::vector<RenderedDisk> near;
      for (const RenderedDisk& disk : beside)
        if (std::abs(disk.x_px - column) < 12) near.push_back(disk);
      for (int k = 0; k < finer * finer; ++k) {
        const double x = column - 0.5 + (k % finer + 0.5) / finer, y = row - 0.5 + (k / finer + 0.5) / finer;
        double level = 25;
        for (const RenderedDisk& disk : near) {
          const double dx = (x - disk.x_px) / 10, dy = (y - disk.y_px) / 10, squared = dx * dx + dy * dy;
          if (squared < 1) level = 60 + 140 * std::max(0.0, 0.8 * std::sqrt(1 - squared) - 0.36 * dx - 0.48 * dy);
        }
        sum += level;
      }
      frame.pixels.push_back(static_cast<float>(sum / (finer * finer) + 6 * (random.uniform() - 0.5)));
    }
  }
  const FindResult result = find_disks(frame);
  const test::Score score = test::score(result.disks, truth, 400, 400);
  EXPECT_EQ(score.recall(), 1.0);
  EXPECT_EQ(score.precision(), 1.0);
  EXPECT_LT(score.rms_px, 0.1);
  EXPECT_NEAR(result.disks.front().radius_px, 10, 0.15);
}

TEST(HardCases, BedTurnedByThreeDegreesGivesItsTilt) {
  auto truth = rows_and_gas(10, 500, 400, 7, 60);
  const double angle = 3 * std::numbers::pi / 180;
  for (RenderedDisk& disk : truth) {
    const double x = disk.x_px - 250, y = disk.y_px - 230;
    disk.x_px = 260 + x * std::cos(angle) - y * std::sin(angle);
    disk.y_px = 215 + x * std::sin(angle) + y * std::cos(angle);
  }
  Camera camera = camera_of(520, 430);
  FrameSource source = FrameSource::from_frames({render_frame(truth, camera)});
  MeasureOptions options;
  options.bead_diameter_m = 3e-3;
  const Measurement measured = measure_bed(source, options);
  EXPECT_NEAR(measured.calibration.floor_tilt_degrees, 3, 0.1);
  double lowest = 100;
  for (const MeasuredDisk& disk : measured.disks) lowest = std::min(lowest, disk.z);
  EXPECT_NEAR(lowest, 0.5, 0.05);
}

TEST(HardCases, BlankNoiseAndOtherThingsGiveAReason) {
  GrayFrame blank;
  blank.width = 300;
  blank.height = 200;
  blank.pixels.assign(60000, 128.0F);
  const FindResult in_blank = find_disks(blank);
  EXPECT_TRUE(in_blank.disks.empty());
  EXPECT_FALSE(in_blank.why_nothing.empty());

  Camera camera = camera_of(300, 200);
  camera.read_noise = 20;
  const FindResult in_noise = find_disks(render_frame({}, camera));
  EXPECT_TRUE(in_noise.disks.empty());
  EXPECT_FALSE(in_noise.why_nothing.empty());

  GrayFrame stripes = blank;  // something else: stripes that curve
  for (int row = 0; row < 200; ++row)
    for (int column = 0; column < 300; ++column)
      stripes.pixels[static_cast<std::size_t>(row * 300 + column)] =
          static_cast<float>(128 + 60 * std::sin(0.15 * column + 0.002 * row * row));
  expect_sane(find_disks(stripes));
}

TEST(HardCases, TinyFramesAndSingleDisks) {
  for (const int size : {1, 2, 4, 7, 12}) {
    GrayFrame frame;
    frame.width = frame.height = size;
    frame.pixels.assign(static_cast<std::size_t>(size * size), 77.0F);
    frame.pixels[0] = 10.0F;
    expect_sane(find_disks(frame));
  }
  const test::Score score = found_in({{33.3, 30.8, 11, 0, 0}}, camera_of(70, 64));
  EXPECT_EQ(score.hits, 1U);
  EXPECT_EQ(score.found, 1U);
}

TEST(HardCases, MalformedFrameIsAnError) {
  GrayFrame frame;
  frame.width = 10;
  frame.height = 10;
  frame.pixels.assign(99, 0.0F);
  EXPECT_THROW(find_disks(frame), std::invalid_argument);
}

TEST(HardCases, AFilmWhoseSizeChangesIsReported) {
  const auto truth = rows_and_gas(10, 300, 300, 5, 20);
  const GrayFrame large = render_frame(truth, camera_of(300, 300)), other = render_frame(truth, camera_of(310, 300));
  FrameSource source = FrameSource::from_frames({large, other, large});
  MeasureOptions options;
  options.bead_diameter_m = 1e-3;
  const Measurement measured = measure_bed(source, options);
  EXPECT_EQ(measured.frames[1].status, FrameStatus::size_changed);
  EXPECT_EQ(measured.frames[2].status, FrameStatus::good);
}

// Specks, no beads.
void expect_an_end(int width, int height) {
  Camera camera = camera_of(width, height);
  camera.read_noise = 0;
  camera.dust_fraction = 0.3;
  expect_sane(find_disks(render_frame({}, camera)));
}
TEST(HardCases, AHundredThousandPixelsFullOfNothingEndsSoon) { expect_an_end(400, 300); }
TEST(HardCases, HalfAMillionPixelsFullOfNothingEndsSoon) { expect_an_end(1000, 800); }

}  // namespace
}  // namespace shakebed::ingest
