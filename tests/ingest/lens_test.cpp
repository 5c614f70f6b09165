#include "ingest/profile/lens.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <stdexcept>

#include "ingest/find/round_aspect.hpp"
#include "ingest/profile/measure_bed.hpp"
#include "ingest/profile/photographs.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/test_files.hpp"

namespace shakebed::ingest {
namespace {

// A camera with unequal pixels and a bent lens looks at disks: each pixel is the share of 8 x 8 points, spread over two
// pixels' width as by a slightly blurred lens, that lie in a disk, by the lens's formula itself and not by LensMap.
struct LensCamera {
  double aspect = 1, radial = 0;
  double depth = 0;  // of the disks, over the distance of the camera: their far ends are seen nearer to the middle
};
struct TurnedFaces {
  double depth = 0;  // grey levels, of light and dark sectors at the rim, turned differently in each disk
  unsigned seed = 1;
};
GrayFrame seen_by(const LensCamera& camera, const std::vector<RenderedDisk>& disks, int width, int height,
                  const TurnedFaces& faces = {}) {
  const auto [aspect, radial, depth] = camera;
  GrayFrame frame;
  frame.width = width;
  frame.height = height;
  RandomStream random(7);
  const double middle_x = 0.5 * width * aspect, middle_y = 0.5 * height;
  const double h2 = middle_x * middle_x + middle_y * middle_y;
  RandomStream turning(faces.seed);
  std::vector<double> turned, deep;
  for (std::size_t k = 0; k < disks.size(); ++k) {
    turned.push_back(2 * std::numbers::pi * turning.uniform());
    deep.push_back(faces.depth * turning.uniform());
  }
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const auto true_place = [&, aspect = aspect, radial = radial](double x, double y) {
        const double dx = x * aspect - middle_x, dy = y - middle_y, s = 1 + radial * (dx * dx + dy * dy) / h2;
        return PixelPlace{middle_x + s * dx - 0.5, middle_y + s * dy - 0.5};
      };
      const PixelPlace here = true_place(column + 0.5, row + 0.5);
      double darker = 0;
      for (std::size_t k = 0; k < disks.size(); ++k) {
        const RenderedDisk& disk = disks[k];
        const double reach = disk.radius_px + 2 + depth * middle_x;
        if (std::abs(here.x - disk.x_px) > reach || std::abs(here.y - disk.y_px) > reach) continue;
        const double away = std::hypot(here.x - disk.x_px, here.y - disk.y_px);
        if (away > reach) continue;
        if (faces.depth == 0 && away < disk.radius_px - 2) {  // all its points lie inside
          darker += 64 * 140;
          continue;
        }
        const double far_x = depth * (middle_x - 0.5 - disk.x_px), far_y = depth * (middle_y - 0.5 - disk.y_px);
        for (int j = 0; j < 8; ++j)
          for (int i = 0; i < 8; ++i) {
            const PixelPlace p = true_place(column - 0.5 + (i + 0.5) / 4, row - 0.5 + (j + 0.5) / 4);
            const double dx = p.x - disk.x_px, dy = p.y - disk.y_px, square = disk.radius_px * disk.radius_px;
            const double to_far_x = dx - far_x, to_far_y = dy - far_y;
            if (dx * dx + dy * dy < square)
              darker +=
                  faces.depth == 0
                      ? 140
                      : 140 + deep[k] *
                                  ((dx * dx - dy * dy) * std::cos(turned[k]) - 2 * dx * dy * std::sin(turned[k])) /
                                  square;
            else if (to_far_x * to_far_x + to_far_y * to_far_y < square)
              darker += 140;
          }
      }
      frame.pixels.push_back(static_cast<float>(200 - darker / 64.0 + 3 * random.normal()));
    }
  return frame;
}

std::vector<RenderedDisk> bed(double wide, int height) {
  SyntheticBed bed;
  bed.left_wall_px = 14;
  bed.right_wall_px = wide - 15;
  bed.floor_px = height - 16;
  bed.radius_px = 8;
  bed.rows = 9;
  bed.gas_count = 40;
  bed.gas_height_px = 60;
  std::vector<RenderedDisk> disks = make_synthetic_bed(bed);
  std::erase_if(disks, [](const RenderedDisk& disk) { return disk.y_px < 10; });  // all in view
  return disks;
}

TEST(Lens, ThereAndBackAgain) {
  for (const double radial : {-0.1, 0.0, 0.1}) {
    const LensMap map({1.07, radial}, 640, 480);
    for (const PixelPlace place : {PixelPlace{0, 0}, {639, 479}, {320, 240}, {12.5, 400}}) {
      const PixelPlace again = map.to_recorded(map.to_true(place));
      EXPECT_NEAR(again.x, place.x, 1e-9);
      EXPECT_NEAR(again.y, place.y, 1e-9);
    }
  }
}

// Pixels from half to twice as wide as high, and radial terms of up to 0.3. Where corners move out, the true frame is
// larger by as much on each side, in whole pixels.
TEST(Lens, HasItsLimitsAndItsMargins) {
  for (const Lens& lens : {Lens{0.5, 0}, {2, 0}, {1, 0.3}, {1, -0.3}}) EXPECT_NO_THROW(LensMap(lens, 640, 480));
  for (const Lens& lens : {Lens{0.499, 0}, {2.01, 0}, {1, 0.301}, {1, -0.301}, {NAN, 0}, {1, NAN}})
    EXPECT_THROW(LensMap(lens, 640, 480), std::invalid_argument) << lens.pixel_aspect << ' ' << lens.radial;
  struct Case {
    Lens lens;
    int width, height;
  };
  // 1.25 x 100 = 125 px and, at 0.1, 7 = ceil(6.25) more on each side; of 60 rows 3 more.
  for (const auto& [lens, width, height] :
       {Case{{1.25, 0}, 125, 60}, {{1.25, -0.1}, 125, 60}, {{1.25, 0.1}, 139, 66}}) {
    const LensMap map(lens, 100, 60);
    GrayFrame recorded;
    recorded.width = 100, recorded.height = 60, recorded.pixels.assign(6000, 50.0F);
    const GrayFrame seen = map.corrected(recorded);
    EXPECT_EQ(seen.width, width);
    EXPECT_EQ(seen.height, height);
    const PixelPlace middle = map.to_true({49.5, 29.5});  // stays in the middle
    EXPECT_NEAR(middle.x, 0.5 * (width - 1), 1e-9);
    EXPECT_NEAR(middle.y, 0.5 * (height - 1), 1e-9);
    // A corner moves out by the radial term, in half diagonals of the frame without margins.
    const PixelPlace corner = map.to_true({-0.5, -0.5});
    EXPECT_NEAR(corner.x, 0.5 * (width - 1) - 62.5 * (1 + lens.radial), 1e-9);
    EXPECT_NEAR(corner.y, 0.5 * (height - 1) - 30 * (1 + lens.radial), 1e-9);
    recorded.width = 99;
    EXPECT_THROW((void)map.corrected(recorded), std::invalid_argument);
  }
}

// The two ways of interpolation, rows that stay rows and rows that bend, up to the border.
TEST(Lens, ThatHardlyBendsLeavesEveryPixel) {
  GrayFrame frame;
  frame.width = 40;
  frame.height = 30;
  for (int row = 0; row < 30; ++row)
    for (int column = 0; column < 40; ++column)
      frame.pixels.push_back(static_cast<float>(20 + 0.1 * column * column + 0.2 * row * row));
  for (const double radial : {0.0, 1e-9}) {
    const GrayFrame seen = LensMap({1, radial}, 40, 30).corrected(frame);
    const int across = (seen.width - 40) / 2, down = (seen.height - 30) / 2;  // beyond the border: its outermost pixels
    for (int row = 0; row < seen.height; ++row)
      for (int column = 0; column < seen.width; ++column)
        EXPECT_NEAR(seen.at(column, row), frame.at(std::clamp(column - across, 0, 39), std::clamp(row - down, 0, 29)),
                    1e-3)
            << column << ' ' << row;
  }
}

// A level that is quadratic in the recorded place is met by the cubic through four pixels: each pixel of a corrected
// frame has the level of the place where it was seen. The corners move by the radial term, the middle stays.
TEST(Lens, CorrectedFramesShowWhatWasSeenThere) {
  GrayFrame frame;
  frame.width = 60, frame.height = 44;
  const auto level = [](double x, double y) { return 20 + 0.05 * x * x + 0.07 * y * y - 0.03 * x * y + x; };
  for (int row = 0; row < 44; ++row)
    for (int column = 0; column < 60; ++column) frame.pixels.push_back(static_cast<float>(level(column, row)));
  for (const Lens& lens : {Lens{1.07, 0}, Lens{0.8, 0}, Lens{1.07, 0.1}, Lens{0.8, -0.12}, Lens{1, 0.2}}) {
    const LensMap map(lens, 60, 44);
    const int more_x = lens.radial > 0 ? static_cast<int>(std::ceil(30 * lens.pixel_aspect * lens.radial)) : 0;
    const int more_y = lens.radial > 0 ? static_cast<int>(std::ceil(22 * lens.radial)) : 0;
    EXPECT_EQ(map.width(), std::lround(60 * lens.pixel_aspect) + 2 * more_x);
    EXPECT_EQ(map.height(), 44 + 2 * more_y);
    const double half_width = 30 * lens.pixel_aspect;
    const PixelPlace corner = map.to_true({-0.5, 43.5}), middle = map.to_true({29.5, 21.5});
    EXPECT_NEAR(middle.x, half_width - 0.5 + more_x, 1e-9);
    EXPECT_NEAR(middle.y, 21.5 + more_y, 1e-9);
    EXPECT_NEAR(corner.x - middle.x, -half_width * (1 + lens.radial), 1e-9);
    EXPECT_NEAR(corner.y - middle.y, 22 * (1 + lens.radial), 1e-9);
    const GrayFrame seen = map.corrected(frame);
    int inside = 0;
    for (int row = 0; row < seen.height; ++row)
      for (int column = 0; column < seen.width; ++column) {
        const PixelPlace at = map.to_recorded({1.0 * column, 1.0 * row});
        if (at.x >= 1 && at.x <= 58 && at.y >= 1 && at.y <= 42) {
          ASSERT_NEAR(seen.at(column, row), level(at.x, at.y), 2e-3) << lens.radial << ' ' << column << ' ' << row;
          ++inside;
        } else if (at.x < 0 && at.y < 0) {
          ASSERT_NEAR(seen.at(column, row), level(0, 0), 1e-3) << "beyond the border its outermost pixels";
        }
      }
    EXPECT_GT(inside, 1200);
  }
  EXPECT_THROW((LensMap{{1, 0.1}, 60, 45}.corrected(frame)), std::invalid_argument);
}

struct Case {
  const char* name;
  double aspect, radial;
};
void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

class Lenses : public testing::TestWithParam<Case> {};

TEST_P(Lenses, AreToldFromTheBeadsAndDisksAreFoundWhereTheyAre) {
  const auto [name, aspect, radial] = GetParam();
  const int width = 320, height = 300;
  const auto truth = bed(width * aspect, height);
  FrameSource source = FrameSource::from_frames({seen_by({aspect, radial}, truth, width, height)});
  MeasureOptions options;
  options.bead_diameter_m = 16e-3;
  const Measurement found = measure_bed(source, options);
  EXPECT_NEAR(found.calibration.lens.pixel_aspect, aspect, 0.0015);
  EXPECT_NEAR(found.calibration.lens.radial, radial, 0.004);
  // Every disk whose centre is in view, at its true place in the bed.
  const double middle_x = 0.5 * width * aspect, middle_y = 0.5 * height;
  std::size_t hits = 0;
  double square = 0;
  for (const RenderedDisk& disk : truth) {
    for (const MeasuredDisk& one : found.disks) {
      const double dx = (one.x_px + 0.5) * aspect - middle_x, dy = one.y_px + 0.5 - middle_y;
      const double s = 1 + radial * (dx * dx + dy * dy) / (middle_x * middle_x + middle_y * middle_y);
      const double distance = std::hypot(middle_x + s * dx - 0.5 - disk.x_px, middle_y + s * dy - 0.5 - disk.y_px);
      if (distance > 4) continue;
      ++hits;
      square += distance * distance;
    }
  }
  EXPECT_EQ(hits, truth.size());
  EXPECT_EQ(hits, found.disks.size());
  EXPECT_LT(std::sqrt(square / 2 / static_cast<double>(hits)), 0.06);
}

INSTANTIATE_TEST_SUITE_P(Lens, Lenses,
                         testing::Values(Case{"plain", 1, 0}, Case{"wide_pixels", 1.0667, 0},
                                         Case{"narrow_pixels", 0.94, 0}, Case{"barrel", 1, 0.04},
                                         Case{"pincushion", 1, -0.03}, Case{"both", 1.03, 0.03}),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(Lens, GivenTermsAreTaken) {
  const auto truth = bed(320, 300);
  FrameSource source = FrameSource::from_frames({seen_by({.radial = 0.03}, truth, 320, 300)});
  MeasureOptions options;
  options.bead_diameter_m = 16e-3;
  options.pixel_aspect = 1;
  options.lens_radial = 0.03;
  const Measurement found = measure_bed(source, options);
  EXPECT_TRUE(found.calibration.lens_given);
  EXPECT_EQ(found.calibration.lens.radial, 0.03);
  EXPECT_EQ(found.disks.size(), truth.size());
}

Lens found_in(GrayFrame frame) {
  FrameSource source = FrameSource::from_frames({std::move(frame)});
  MeasureOptions options;
  options.bead_diameter_m = 16e-3;
  return measure_bed(source, options).calibration.lens;
}

// 81 disks.
std::vector<RenderedDisk> crystal() {
  SyntheticBed bed;
  bed.left_wall_px = 14, bed.right_wall_px = 305, bed.floor_px = 284;
  bed.radius_px = 12, bed.rows = 7, bed.gas_count = 0;
  return make_synthetic_bed(bed);
}
GrayFrame with_faces(unsigned seed, double radial = 0) {
  return seen_by({.radial = radial}, crystal(), 320, 300, {.depth = 100, .seed = seed});
}

// Pixels of one bead are not independent: each of these faces pulls at a lens of its own.
TEST(Lens, IsNotSeenInFacesThatDiffer) {
  for (const unsigned seed : {1U, 3U}) {
    const Lens lens = found_in(with_faces(seed));
    EXPECT_TRUE(lens.plain()) << "seed " << seed << ": " << lens.pixel_aspect << ", " << lens.radial;
  }
}

TEST(Lens, IsSeenBehindFacesThatDiffer) {
  const Lens lens = found_in(with_faces(5, 0.06));
  EXPECT_NEAR(lens.radial, 0.06, 0.01);
}

// Of twenty pictures that no choice was made on. The sum of the squares of 20 normal numbers lies in 7.4 .. 40 with 99
// % probability. The errors of the radial term are up to 1.5 times too small here (72 other pictures: 1.0 to 1.5); with
// pixels taken as independent they were eight times too small.
TEST(Lens, HasTheErrorsOfBeadsThatDiffer) {
  double aspect = 0, radial = 0, difference = 0;
  for (unsigned seed = 101; seed <= 120; ++seed) {
    const GrayFrame frame = with_faces(seed);
    const CalibrationResult learned = calibrate_finder({&frame});
    ASSERT_TRUE(learned.found);
    const LensEstimate one = estimate_lens({&frame}, {find_disks(frame, learned.calibration)}, learned.calibration);
    ASSERT_TRUE(one.known);
    aspect += std::pow((one.lens.pixel_aspect - 1) / one.aspect_std_error, 2);
    radial += std::pow(one.lens.radial / one.radial_std_error, 2);
    difference += std::pow((one.radial_by_size - one.radial_by_shape) / one.difference_std_error, 2);
  }
  for (const double sum : {aspect, radial, difference}) {
    EXPECT_GT(sum, 7.4);
    EXPECT_LT(sum, 1.5 * 1.5 * 40);
  }
}

// Their outlines become longer away from the middle, and hardly larger.
TEST(Lens, IsNotSeenInTheSidesOfThickDisks) {
  const Lens lens = found_in(seen_by({.depth = 0.02}, bed(320, 300), 320, 300));
  EXPECT_EQ(lens.radial, 0);
}

// Pixels of films for wide screens. A picture of 320 true pixels' width.
struct WideScreen {
  double aspect;
  int width = static_cast<int>(std::lround(320 / aspect));
  std::vector<RenderedDisk> truth = bed(width * aspect, 300);
  GrayFrame frame = seen_by({aspect, 0}, truth, width, 300);

  [[nodiscard]] BedFound measured(MeasureOptions options) const {
    options.bead_diameter_m = 16e-3;
    return measure_bed({{width, 300, frame.pixels.data(), PixelType::f32}}, options);
  }
  // Greatest distance from the true centres, true px; none where a disk is missing or too many are found.
  [[nodiscard]] std::optional<double> off(const BedFound& found, double from_px = 0, double to_px = 1e9) const {
    double farthest = 0;
    std::size_t expected = 0;
    for (const RenderedDisk& disk : truth) {
      const double x_px = (disk.x_px + 0.5) / aspect - 0.5;
      if (x_px < from_px || x_px > to_px) continue;
      ++expected;
      double nearest = 1e9;
      for (const MeasuredDisk& one : found.measurement.disks)
        nearest = std::min(nearest, std::hypot((one.x_px - x_px) * aspect, one.y_px - disk.y_px));
      farthest = std::max(farthest, nearest);
    }
    return found.measurement.disks.size() == expected ? std::optional(farthest) : std::nullopt;
  }
};

class WideScreens : public testing::TestWithParam<double> {};

TEST_P(WideScreens, AreMeasuredWithTheAspectOfTheirPixels) {
  const WideScreen screen{GetParam()};
  MeasureOptions options;
  EXPECT_EQ(screen.measured(options).status, FindStatus::no_beads) << "ovals";
  options.pixel_aspect = screen.aspect;
  const BedFound found = screen.measured(options);
  ASSERT_TRUE(found.ok()) << found.message;
  const std::optional<double> off = screen.off(found);
  ASSERT_TRUE(off);
  EXPECT_LT(*off, 0.3);
  EXPECT_NEAR(found.measurement.calibration.radius_px, 8, 0.05);
}

// A search that begins 4 % off ends at the true aspect, within 1 % and two of its errors.
TEST_P(WideScreens, AreCorrectedFromNearby) {
  const WideScreen screen{GetParam()};
  MeasureOptions options;
  options.first_pixel_aspect = 1.04 * screen.aspect;
  const BedFound found = screen.measured(options);
  ASSERT_TRUE(found.ok()) << found.message;
  const BedCalibration& bed = found.measurement.calibration;
  EXPECT_NEAR(bed.lens.pixel_aspect / screen.aspect, 1, 0.01);
  EXPECT_NEAR(bed.lens.pixel_aspect, screen.aspect, 2 * bed.aspect_std_error);
  // It is mostly what blur does.
  const double blur = bed.edge_width_px / bed.radius_px, square = screen.aspect * screen.aspect;
  EXPECT_NEAR(bed.aspect_std_error / (screen.aspect * 2 * blur * blur * std::abs(square - 1)), 1, 0.15);
  ASSERT_TRUE(screen.off(found));
  EXPECT_LT(*screen.off(found), 0.3);
}

// Regions are those of the picture as recorded: of what lies in the left half all is found, and nothing beside it.
TEST_P(WideScreens, HaveRegionsOfThePictureAsRecorded) {
  const WideScreen screen{GetParam()};
  MeasureOptions options;
  options.pixel_aspect = screen.aspect;
  const int half = screen.width / 2;
  options.find.roi = PixelRectangle{0, 0, half, 300};
  const BedFound found = screen.measured(options);
  ASSERT_TRUE(found.ok()) << found.message;
  const double radius = 8 / screen.aspect;
  double right = 0;
  for (const MeasuredDisk& one : found.measurement.disks) right = std::max(right, one.x_px);
  EXPECT_LT(right, half + 0.5);
  EXPECT_GT(right, half - 2 * radius);
  std::size_t inside = 0, seen = 0;
  for (const RenderedDisk& disk : screen.truth) {
    const double x_px = (disk.x_px + 0.5) / screen.aspect - 0.5;
    if (x_px > half - 1.2 * radius) continue;
    ++inside;
    for (const MeasuredDisk& one : found.measurement.disks)
      seen += std::hypot((one.x_px - x_px) * screen.aspect, one.y_px - disk.y_px) < 1;
  }
  EXPECT_EQ(seen, inside);
}

// All beads lie in the last third, and the region is that third: in pixels of the square picture it would be the middle
// one, which is empty.
TEST(Lens, LooksForBeadsInTheRegionOfThePictureAsRecorded) {
  constexpr double aspect = 64.0 / 45;  // 320 true px are 225 recorded ones
  std::vector<RenderedDisk> last = bed(320, 300);
  std::erase_if(last, [](const RenderedDisk& disk) { return disk.x_px < 225; });
  const GrayFrame frame = seen_by({aspect, 0}, last, 225, 300);
  MeasureOptions options;
  options.bead_diameter_m = 16e-3;
  options.pixel_aspect = aspect;
  options.find.roi = PixelRectangle{150, 0, 75, 300};
  const BedFound found = measure_bed({{225, 300, frame.pixels.data(), PixelType::f32}}, options);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found.measurement.disks.size(), last.size());
}

INSTANTIATE_TEST_SUITE_P(Lens, WideScreens, testing::Values(64.0 / 45, 1.333, 0.75));

TEST(Lens, BeginsWithWhatAFilmStates) {
  const test::ScratchFolder folder;
  const WideScreen screen{1.25};
  const std::string path = folder / "film.mp4";
  {
    cv::Mat grey, colour;
    cv::Mat(300, screen.width, CV_32F, const_cast<float*>(screen.frame.pixels.data())).convertTo(grey, CV_8U);
    cv::cvtColor(grey, colour, cv::COLOR_GRAY2BGR);
    cv::VideoWriter film(path, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 25, colour.size());
    if (!film.isOpened()) GTEST_SKIP() << "this OpenCV cannot write mp4";
    film.write(colour);
  }
  MeasureOptions options;
  options.bead_diameter_m = 16e-3;
  EXPECT_EQ(measure_bed({path}, options).status, FindStatus::no_beads) << "ovals";
  test::state_pixel_aspect(path, 6, 5);  // nearly right
  const BedFound found = measure_bed({path}, options);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_NEAR(found.measurement.calibration.lens.pixel_aspect, 1.25, 0.006);
  EXPECT_TRUE(screen.off(found));
}

// The directions of edges tell an aspect of pixels within 7 % where disks of 24 px lie apart. Where beads 16 px wide
// touch, blur fills the gaps between them, and it is too near to 1: by up to half of its logarithm.
TEST(RoundAspect, IsThatOfPixelsThatShowDisks) {
  for (const double aspect : {0.55, 0.75, 1.0, 1.3, 1.8}) {
    const int width = static_cast<int>(std::lround(320 / aspect));
    std::vector<RenderedDisk> apart;
    for (int row = 0; row < 6; ++row)
      for (int column = 0; column < 7; ++column) {
        RenderedDisk& disk = apart.emplace_back();
        disk.x_px = 25 + 42 * column + 9 * ((3 * row + column) % 4),
        disk.y_px = 25 + 46 * row + 7 * ((row + 2 * column) % 3);
        disk.radius_px = 12;
      }
    const std::optional<double> seen = aspect_for_round_outlines(seen_by({aspect, 0}, apart, width, 300));
    ASSERT_TRUE(seen) << aspect;
    EXPECT_NEAR(*seen / aspect, 1, 0.07) << aspect;
    if (aspect == 1) continue;
    const std::optional<double> of_bed = aspect_for_round_outlines(WideScreen{aspect}.frame);
    ASSERT_TRUE(of_bed) << aspect;
    EXPECT_GT(std::log(*of_bed) / std::log(aspect), 0.4) << aspect;
    EXPECT_LT(std::log(*of_bed) / std::log(aspect), 1.1) << aspect;
  }
}

// Squares whose sides run along rows and columns have edges of two directions, as text and plots do; turned by an
// eighth of a turn, too.
TEST(RoundAspect, IsNoneOfStraightLines) {
  EXPECT_FALSE(aspect_for_round_outlines({}));
  GrayFrame frame{200, 160, std::vector<float>(32'000, 90.0F)};
  EXPECT_FALSE(aspect_for_round_outlines(frame)) << "no edges";
  const auto tiled = [&](const auto& is_dark) {
    for (int row = 0; row < 160; ++row)
      for (int column = 0; column < 200; ++column)
        frame.pixels[static_cast<std::size_t>(row * 200 + column)] = is_dark(column, row) ? 60.0F : 180.0F;
    return frame;
  };
  EXPECT_FALSE(aspect_for_round_outlines(tiled([](int x, int y) { return x % 20 < 10 && y % 20 < 10; })));
  EXPECT_FALSE(
      aspect_for_round_outlines(tiled([](int x, int y) { return (x + y) % 28 < 14 && (x - y + 200) % 28 < 14; })));
  EXPECT_FALSE(aspect_for_round_outlines(tiled([](int x, int y) { return (x + y) % 28 < 14; }))) << "slanted stripes";
  EXPECT_FALSE(aspect_for_round_outlines(tiled([](int x, int) { return x % 20 < 10; }))) << "columns";
}

}  // namespace
}  // namespace shakebed::ingest
