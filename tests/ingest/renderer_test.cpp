// Drawn frames, pixel by pixel against what they are defined to be.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "ingest/find/blurred_disk.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"

namespace shakebed::ingest {
namespace {

Camera unrounded(int width, int height) {
  Camera camera;
  camera.width = width, camera.height = height;
  camera.round_to_8_bits = false;
  return camera;
}
double contrast_at(const GrayFrame& frame, const Camera& camera, int column, int row) {
  return (static_cast<double>(frame.at(column, row)) - camera.background_level) /
         (camera.bead_level - camera.background_level);
}
// In the middle, across each side, and outside of a frame of 30 x 26 px.
const std::vector<std::array<double, 2>> drawn_places = {{14.3, 12.7}, {-2.2, 13.1}, {31.6, 12.2}, {13.7, -3.4},
                                                         {15.2, 28.9}, {1.5, 24.3},  {-14, 13}};

// The share of a pixel that a circle covers, by rows a thousandth of a pixel apart.
double covered_share(double radius, double dx, double dy) {
  double area = 0;
  constexpr int lines = 400;
  for (int k = 0; k < lines; ++k) {
    const double y = dy - 0.5 + (k + 0.5) / lines, half = std::sqrt(std::max(0.0, radius * radius - y * y));
    area += std::max(0.0, std::min(half, dx + 0.5) - std::max(-half, dx - 0.5)) / lines;
  }
  return area;
}

// A row that touches the left wall and leaves 15 px at its right end. Its last disk moves where its jitter leads to the
// right and upwards, in a quarter of 80 rows (20 +- 3.9; here within four of these). Those between two others have to
// move up by more than twice the root of the radius times the way to the side: 3.4 of them do on average.
TEST(DrawnBeds, AreJitteredWhereThereIsRoom) {
  std::size_t last = 0, others = 0;
  for (std::uint64_t seed = 1; seed <= 80; ++seed) {
    SyntheticBed bed{.left_wall_px = 10, .right_wall_px = 225, .floor_px = 100, .radius_px = 10, .rows = 1};
    bed.seed = seed;
    const std::vector<RenderedDisk> row = make_synthetic_bed(bed);
    bed.jitter_px = 0.5;
    const std::vector<RenderedDisk> jittered = make_synthetic_bed(bed);
    ASSERT_EQ(row.size(), 10U);
    ASSERT_EQ(jittered.size(), 10U);
    for (std::size_t k = 0; k < row.size(); ++k) {
      const double aside = jittered[k].x_px - row[k].x_px, down = jittered[k].y_px - row[k].y_px;
      (k == 9 ? last : others) += aside != 0 || down != 0;
      EXPECT_LT(std::hypot(aside, down), 5 * bed.jitter_px);
      EXPECT_LE(down, 0);
      if (k > 0) {
        EXPECT_GE(std::hypot(jittered[k].x_px - jittered[k - 1].x_px, jittered[k].y_px - jittered[k - 1].y_px),
                  20 - 1e-9);
      }
    }
  }
  EXPECT_NEAR(static_cast<double>(last), 20, 16);
  EXPECT_LT(others, 15U);
}

TEST(DrawnPixels, OfASharpDiskAreTheirCoveredShares) {
  const Camera camera = unrounded(30, 26);
  for (const double radius : {6.4, 0.4, 1.0})
    for (const auto& [x, y] : drawn_places) {
      const GrayFrame frame = render_frame({{x, y, radius, 0, 0}}, camera);
      for (int row = 0; row < 26; ++row)
        for (int column = 0; column < 30; ++column)
          ASSERT_NEAR(contrast_at(frame, camera, column, row), covered_share(radius, column - x, row - y), 2e-3)
              << radius << ' ' << column << ' ' << row << " of " << x << ' ' << y;
    }
}

// A shaded disk in the middle of a frame is the same from all four sides, its cut pixels too.
TEST(DrawnPixels, OfAShadedDiskAreTheSameFromEverySide) {
  Camera camera = unrounded(31, 31);
  camera.shading = BeadShading::shaded, camera.shading_depth = 0.4;
  const GrayFrame frame = render_frame({{15, 15, 6.4, 0, 0}}, camera);
  for (int row = 0; row < 31; ++row)
    for (int column = 0; column < 31; ++column) {
      const double here = contrast_at(frame, camera, column, row);
      ASSERT_NEAR(here, contrast_at(frame, camera, 30 - column, row), 1e-5) << column << ' ' << row;
      ASSERT_NEAR(here, contrast_at(frame, camera, column, 30 - row), 1e-5) << column << ' ' << row;
      ASSERT_NEAR(here, contrast_at(frame, camera, row, column), 1e-5) << column << ' ' << row;
    }
}

// The mean over the pixel of the blurred disk, by 12 x 12 points of the definition.
TEST(DrawnPixels, OfABlurredDiskAreMeansOverThePixel) {
  for (const double blur : {0.25, 0.5, 1.2}) {
    Camera camera = unrounded(30, 26);
    camera.blur_px = blur;
    std::vector<double> table;
    for (int k = 0; k < 2200; ++k)
      table.push_back(blurred_disk_contrast(
          5.6, blur, [](double) { return 1.0; }, 0.01 * k));
    for (const auto& [x, y] : drawn_places) {
      const GrayFrame frame = render_frame({{x, y, 5.6, 0, 0}}, camera);
      for (int row = 0; row < 26; ++row)
        for (int column = 0; column < 30; ++column) {
          double sum = 0;
          if (std::hypot(column - x, row - y) > 14) continue;
          for (int j = 0; j < 12; ++j)
            for (int i = 0; i < 12; ++i) {
              const double place = 100 * std::hypot(column - x - 0.5 + (i + 0.5) / 12, row - y - 0.5 + (j + 0.5) / 12);
              const auto cell = static_cast<std::size_t>(place);
              sum += (table[cell] + (place - static_cast<double>(cell)) * (table[cell + 1] - table[cell])) / 144;
            }
          ASSERT_NEAR(contrast_at(frame, camera, column, row), sum, 3e-3) << blur << ' ' << column << ' ' << row;
        }
    }
  }
}

// A ball's light of depth 0.4: dark beads lose contrast in the middle, bright ones at the rim; sharp and blurred.
TEST(DrawnPixels, OfAShadedBeadFollowItsDepth) {
  for (const double blur : {0.0, 0.6})
    for (const double bead : {60.0, 240.0}) {
      Camera camera = unrounded(40, 40);
      camera.blur_px = blur, camera.bead_level = bead;
      camera.background_level = 150;
      camera.shading = BeadShading::shaded, camera.shading_depth = 0.4;
      const GrayFrame frame = render_frame({{20, 20, 12, 0, 0}}, camera);
      for (const int away : {0, 3, 6, 9}) {
        const double light = std::sqrt(1 - away * away / 144.0);
        EXPECT_NEAR(contrast_at(frame, camera, 20 + away, 20), bead < 150 ? 1 - 0.4 * light : 0.6 + 0.4 * light, 6e-3)
            << blur << ' ' << bead << ' ' << away;
        EXPECT_NEAR(contrast_at(frame, camera, 20, 20 - away), contrast_at(frame, camera, 20 + away, 20), 1e-5);
      }
      // On the rim of a sharp disk a pixel shows the mean light of what it holds of it.
      if (blur > 0) continue;
      double sum = 0;
      for (int j = 0; j < 60; ++j)
        for (int i = 0; i < 60; ++i) {
          const double rho = std::hypot(11.5 + (i + 0.5) / 60, -0.5 + (j + 0.5) / 60) / 12;
          if (rho > 1) continue;
          const double light = std::sqrt(1 - rho * rho);
          sum += (bead < 150 ? 1 - 0.4 * light : 0.6 + 0.4 * light) / 3600;
        }
      EXPECT_NEAR(contrast_at(frame, camera, 32, 20), sum, 0.01);
    }
}

// Up and to the left of the middle by 0.3 radii a spot, 0.12 radii wide, brighter by its share of the ball's contrast.
TEST(DrawnPixels, OfAHighlightAreAGaussianSpot) {
  Camera camera = unrounded(60, 60);
  camera.blur_px = 0.8;
  camera.shading = BeadShading::shaded;
  const std::vector<RenderedDisk> disk = {{30, 29, 20, 0, 0}};
  const GrayFrame plain = render_frame(disk, camera);
  camera.shading = BeadShading::highlight;
  camera.highlight_level = 0.5;
  const GrayFrame lit = render_frame(disk, camera);
  const double sigma = 0.12 * 20, variance = sigma * sigma + 0.64 + 1.0 / 12;
  for (int row = 12; row < 40; ++row)
    for (int column = 12; column < 40; ++column) {
      const double squared = std::pow(column - 24, 2) + std::pow(row - 23, 2);
      EXPECT_NEAR(contrast_at(lit, camera, column, row) - contrast_at(plain, camera, column, row),
                  -0.5 * (1 - 0.35) * sigma * sigma / variance * std::exp(-0.5 * squared / variance), 1e-4)
          << column << ' ' << row;
    }
}

// A glass bead: 0.12 in the middle, 0.12 + 0.7 rho^8 towards the rim.
TEST(DrawnPixels, OfATransparentBeadAreADarkRim) {
  Camera camera = unrounded(50, 50);
  camera.transparent_fraction = 1;
  const GrayFrame frame = render_frame({{25, 25, 18, 0, 0}}, camera);
  for (const int away : {0, 6, 12, 15, 16})
    EXPECT_NEAR(contrast_at(frame, camera, 25, 25 + away), 0.12 + 0.7 * std::pow(away / 18.0, 8), 0.01) << away;
}

// Each moment of the exposure counts alike: a streak along z is the mean of disks along the way.
TEST(DrawnPixels, OfAMovingDiskAreTheMeanOverItsWay) {
  Camera camera = unrounded(50, 50);
  camera.blur_px = 0.8, camera.exposure_s = 0.01;
  const GrayFrame moving = render_frame({{24.2, 25.1, 7, 300, -500}}, camera);
  camera.exposure_s = 0;
  std::vector<double> mean(2500, 0.0);
  constexpr int moments = 60;
  for (int k = 0; k < moments; ++k) {
    const double part = (k + 0.5) / moments - 0.5;
    const GrayFrame still = render_frame({{24.2 + 3 * part, 25.1 - 5 * part, 7, 0, 0}}, camera);
    for (std::size_t at = 0; at < 2500; ++at) mean[at] += static_cast<double>(still.pixels[at]) / moments;
  }
  for (std::size_t at = 0; at < 2500; ++at) EXPECT_NEAR(moving.pixels[at], mean[at], 0.4) << at;
}

// Where beads overlap one hides the other; levels are rounded to whole ones of 0 to 255 when asked for.
TEST(DrawnPixels, AreHiddenAndRounded) {
  Camera camera = unrounded(40, 30);
  const GrayFrame two = render_frame({{17, 15, 8, 0, 0}, {23, 15, 8, 0, 0}}, camera);
  EXPECT_EQ(two.at(20, 15), 60);
  camera.background_level = 250.4, camera.bead_level = -20;
  camera.round_to_8_bits = true;
  const GrayFrame rounded = render_frame({{20, 15, 8, 0, 0}}, camera);
  EXPECT_EQ(rounded.at(0, 0), 250);
  EXPECT_EQ(rounded.at(20, 15), 0);
  camera.background_level = 300.6;
  EXPECT_EQ(render_frame({}, camera).at(0, 0), 255);
  camera.background_level = 100.5;
  EXPECT_EQ(render_frame({}, camera).at(0, 0), 101);
}

// JPEG of quality 100 is off by a level or two, of quality 10 by more.
TEST(DrawnPixels, PassThroughJpeg) {
  Camera camera = unrounded(48, 40);
  camera.blur_px = 1;
  const std::vector<RenderedDisk> disks = {{15, 14, 8, 0, 0}, {34, 25, 8, 0, 0}};
  const GrayFrame plain = render_frame(disks, camera);
  const auto off = [&](int quality) {
    camera.jpeg_quality = quality;
    const GrayFrame frame = render_frame(disks, camera);
    double most = 0;
    for (std::size_t k = 0; k < plain.pixels.size(); ++k)
      most = std::max(most, std::abs(static_cast<double>(frame.pixels[k] - plain.pixels[k])));
    return most;
  };
  EXPECT_LT(off(100), 3);
  EXPECT_GT(off(100), 0.1);
  EXPECT_GT(off(10), 5);
}

// Specks cover the share asked for, more or less; they are the same in each frame, and hold 0.35 to 0.85 of the light.
TEST(DrawnPixels, AreDimmedByDust) {
  Camera camera = unrounded(200, 160);
  camera.dust_fraction = 0.1, camera.dust_size_px = 8;
  const GrayFrame frame = render_frame({}, camera);
  double dusty = 0, least = 1e9;
  for (const float level : frame.pixels) {
    dusty += static_cast<double>(level) < 0.9 * 200;
    least = std::min(least, static_cast<double>(level));
  }
  EXPECT_NEAR(dusty / 32000, 0.1, 0.025);
  EXPECT_GE(least, 200 * 0.35 * 0.35) << "two at most lie on one another here";
  EXPECT_LT(least, 200 * 0.5);
  // Mean speck radius 4 px: a small speck is a few px wide. Count what is dim and has nothing dim around it at 8 px.
  camera.dust_size_px = 3;
  const GrayFrame fine = render_frame({}, camera);
  const auto changes = [](const GrayFrame& of) {
    double count = 0;
    for (int row = 0; row < of.height; ++row)
      for (int column = 1; column < of.width; ++column)
        count += (of.at(column, row) < 180) != (of.at(column - 1, row) < 180);
    return count;
  };
  EXPECT_NEAR(changes(fine) / changes(frame), 8.0 / 3, 0.8) << "edges go as one over the size";
}

TEST(DrawnPixels, AreRefusedOutsideTheirRanges) {
  const auto refused = [](const auto& change) {
    Camera camera = unrounded(10, 10);
    change(camera);
    try {
      FrameRenderer renderer(camera);
      return false;
    } catch (const std::invalid_argument&) {
      return true;
    }
  };
  EXPECT_FALSE(refused([](Camera&) {}));
  EXPECT_FALSE(refused([](Camera& c) { c.width = c.height = 1; }));
  EXPECT_TRUE(refused([](Camera& c) { c.width = 0; }));
  EXPECT_TRUE(refused([](Camera& c) { c.height = 0; }));
  EXPECT_TRUE(refused([](Camera& c) { c.blur_px = -0.1; }));
  EXPECT_TRUE(refused([](Camera& c) { c.exposure_s = -0.1; }));
  EXPECT_TRUE(refused([](Camera& c) { c.read_noise = -0.1; }));
  EXPECT_TRUE(refused([](Camera& c) { c.shot_noise = -0.1; }));
  EXPECT_TRUE(refused([](Camera& c) { c.gradient_x = 1; }));
  EXPECT_TRUE(refused([](Camera& c) { c.gradient_y = -1; }));
  EXPECT_TRUE(refused([](Camera& c) { c.vignette = 1; }));
  EXPECT_TRUE(refused([](Camera& c) { c.jpeg_quality = -1; }));
  EXPECT_TRUE(refused([](Camera& c) { c.jpeg_quality = 101; }));
  EXPECT_FALSE(refused([](Camera& c) { c.jpeg_quality = 100; }));
  EXPECT_TRUE(refused([](Camera& c) { c.dust_fraction = 0.9; }));
  EXPECT_TRUE(refused([](Camera& c) { c.dust_fraction = -0.1; }));
  EXPECT_TRUE(refused([](Camera& c) { c.bead_level = c.background_level; }));
  EXPECT_THROW(render_frame({{NAN, 1, 1, 0, 0}}, unrounded(9, 9)), std::invalid_argument);
  EXPECT_THROW(render_frame({{1, HUGE_VAL, 1, 0, 0}}, unrounded(9, 9)), std::invalid_argument);
  EXPECT_THROW(render_frame({{1, 1, 0, 0, 0}}, unrounded(9, 9)), std::invalid_argument);
}

// The normal quantile at (i + 1/2)/65536: erfc gives the share beyond it; symmetric, of variance 1.
TEST(RandomNumbers, AreNormalQuantiles) {
  const float* table = normal_quantiles();
  double square = 0;
  for (int k = 0; k < 65536; ++k) square += static_cast<double>(table[k]) * static_cast<double>(table[k]) / 65536;
  EXPECT_NEAR(square, 1, 1e-5);
  for (const int k : {0, 1, 100, 20000, 32768, 50000, 65000, 65535}) {
    EXPECT_EQ(table[k], -table[65535 - k]);
    const double below = 0.5 * std::erfc(-static_cast<double>(table[k]) / std::sqrt(2.0)), wanted = (k + 0.5) / 65536;
    EXPECT_NEAR(below / wanted, 1, 3e-3) << k;  // scaled to unit variance
  }
  RandomStream one(7), same(7), other(8);
  const double first = one.uniform();
  EXPECT_EQ(first, same.uniform());
  EXPECT_NE(first, other.uniform());
  EXPECT_NE(RandomStream(1, 2, 3).next(), RandomStream(1, 3, 2).next());
  EXPECT_NE(RandomStream(1, 2, 3).next(), RandomStream(2, 2, 3).next());
  double mean = 0, least = 1, most = 0;
  for (int k = 0; k < 4000; ++k) {
    const double u = one.uniform();
    mean += u / 4000, least = std::min(least, u), most = std::max(most, u);
  }
  EXPECT_NEAR(mean, 0.5, 5 / std::sqrt(12.0 * 4000));  // 5 standard errors
  EXPECT_LT(least, 0.01);
  EXPECT_GT(most, 0.99);
  EXPECT_LT(most, 1);
}

// Rows of a honeycomb on the floor: each at its place, as many as fit between the walls; a gas above, none below the
// top.
TEST(SyntheticRows, AreAHoneycombOnTheFloor) {
  SyntheticBed bed;
  bed.left_wall_px = 10, bed.right_wall_px = 10 + 20 * 6 + 9, bed.floor_px = 200;
  bed.rows = 3, bed.seed = 4;
  const auto disks = make_synthetic_bed(bed);
  ASSERT_EQ(disks.size(), 6U + 5 + 6);
  for (std::size_t k = 0; k < disks.size(); ++k) {
    const std::size_t row = k < 6 ? 0 : k < 11 ? 1 : 2, place = k - (row == 0 ? 0 : row == 1 ? 6 : 11);
    EXPECT_NEAR(disks[k].x_px, 20 + (row == 1 ? 10 : 0) + 20 * static_cast<double>(place), 1e-9);
    EXPECT_NEAR(disks[k].y_px, 190 - 10 * std::sqrt(3.0) * static_cast<double>(row), 1e-9);
    EXPECT_EQ(disks[k].radius_px, 10);
    EXPECT_EQ(disks[k].velocity_x_px_per_s, 0);
  }
  bed.right_wall_px = 10 + 20 * 6 + 10;
  EXPECT_EQ(make_synthetic_bed(bed).size(), 18U) << "the middle row has room for a sixth";
  // The gas: an exponential law of its mean height above the rows, within the walls.
  bed.rows = 1, bed.gas_count = 300, bed.gas_height_px = 2000, bed.radius_px = 2;
  bed.right_wall_px = 400;
  const auto gas = make_synthetic_bed(bed);
  const std::size_t row = gas.size() - 300;
  double mean = 0, x = 0;
  for (std::size_t k = row; k < gas.size(); ++k) {
    mean += (196 - 2 - gas[k].y_px) / 300, x += gas[k].x_px / 300;
    EXPECT_LE(gas[k].y_px, 194);
    EXPECT_GE(gas[k].x_px, 12);
    EXPECT_LE(gas[k].x_px, 398);
  }
  EXPECT_NEAR(mean, 2000, 5 * 2000 / std::sqrt(300.0));  // 5 standard errors
  EXPECT_NEAR(x, 205, 5 * 386 / std::sqrt(12.0 * 300));
  // A jitter of 0.5 px is a normal one, of those that do not run into a wall or the floor: of a bead in a corner a
  // quarter, by 0.5 sqrt 2 px (rms).
  for (const RenderedDisk& disk : gas) EXPECT_EQ(std::hypot(disk.velocity_x_px_per_s, disk.velocity_y_px_per_s), 0);
  SyntheticBed loose;
  loose.right_wall_px = 39, loose.floor_px = 100, loose.rows = 1, loose.radius_px = 10, loose.jitter_px = 0.5;
  double displaced = 0, square = 0;
  for (loose.seed = 1; loose.seed <= 400; ++loose.seed) {
    const auto moved = make_synthetic_bed(loose);
    ASSERT_EQ(moved.size(), 1U);
    EXPECT_LE(moved[0].y_px, 90);
    EXPECT_GE(moved[0].x_px, 10);
    const double by = std::hypot(moved[0].x_px - 10, moved[0].y_px - 90);
    displaced += by > 0, square += by * by;
  }
  EXPECT_NEAR(displaced, 100, 5 * std::sqrt(75.0));  // 5 standard errors
  EXPECT_NEAR(std::sqrt(square / displaced), 0.5 * std::sqrt(2.0), 0.18);
  loose.right_wall_px = 19;
  EXPECT_THROW(make_synthetic_bed(loose), std::invalid_argument);
  loose.right_wall_px = 20;
  EXPECT_EQ(make_synthetic_bed(loose).size(), 1U);
  loose.radius_px = 0;
  EXPECT_THROW(make_synthetic_bed(loose), std::invalid_argument);
}

// One speck a frame: a disk of one shade with an edge of a pixel, 0.4 to 1.6 times the size asked for, that leaves 0.35
// to 0.85 of the light, anywhere. Means over the seeds within five standard errors of those of even chances.
TEST(DrawnPixels, OfASpeckAreItsDiskInItsShade) {
  double specks = 0, radii = 0, shades = 0, middle_x = 0, middle_y = 0, smallest = 1e9, largest = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Camera camera = unrounded(200, 160);
    camera.dust_fraction = 1e-9, camera.dust_size_px = 12, camera.seed = seed;
    const GrayFrame frame = render_frame({}, camera);
    double loss = 0, most = 0, x = 0, y = 0;
    bool cut = false;
    for (int row = 0; row < 160; ++row)
      for (int column = 0; column < 200; ++column) {
        const double lost = 1 - static_cast<double>(frame.at(column, row)) / 200;
        cut = cut || (lost > 1e-6 && (row == 0 || column == 0 || row == 159 || column == 199));
        loss += lost, most = std::max(most, lost), x += lost * column, y += lost * row;
      }
    if (cut) continue;
    x /= loss, y /= loss;
    const double radius = std::sqrt(loss / most / std::numbers::pi - 1.0 / 12);
    for (int row = 0; row < 160; ++row)
      for (int column = 0; column < 200; ++column)
        ASSERT_NEAR(1 - frame.at(column, row) / 200,
                    most * std::clamp(radius + 0.5 - std::hypot(column - x, row - y), 0.0, 1.0), 0.1 * most)
            << seed << ' ' << column << ' ' << row;
    ++specks, radii += radius, shades += 1 - most, middle_x += x, middle_y += y;
    smallest = std::min(smallest, radius), largest = std::max(largest, radius);
    EXPECT_TRUE(1 - most > 0.35 - 1e-6 && 1 - most < 0.85 + 1e-6) << seed;
  }
  ASSERT_GT(specks, 45);
  EXPECT_GT(smallest, 0.4 * 6 - 0.1);
  EXPECT_LT(smallest, 0.4 * 6 + 1);
  EXPECT_GT(largest, 1.6 * 6 - 1);
  EXPECT_LT(largest, 1.6 * 6 + 0.1);
  const double root = std::sqrt(12 * specks);
  EXPECT_NEAR(radii / specks, 6, 5 * 1.2 * 6 / root);
  EXPECT_NEAR(shades / specks, 0.6, 5 * 0.5 / root);
  EXPECT_NEAR(middle_x / specks, 100, 5 * 200 / root);
  EXPECT_NEAR(middle_y / specks, 80, 5 * 160 / root);
}

// 20,000 beads beside a frame of a pixel: their shares within five standard errors, the same in every frame.
TEST(DrawnPixels, MissOrShineThroughInTheSharesAsked) {
  Camera camera = unrounded(1, 1);
  camera.missing_fraction = 0.2, camera.transparent_fraction = 0.3;
  const std::vector<RenderedDisk> disks(20000, RenderedDisk{-50, -50, 1, 0, 0});
  const FrameRenderer renderer(camera);
  std::vector<DrawnAs> first, later;
  (void)renderer.render(disks, 0, &first);
  (void)renderer.render(disks, 7, &later);
  EXPECT_EQ(first, later);
  const auto count = [&](DrawnAs fate) { return static_cast<double>(std::count(first.begin(), first.end(), fate)); };
  EXPECT_NEAR(count(DrawnAs::missing), 4000, 5 * std::sqrt(20000 * 0.2 * 0.8));
  EXPECT_NEAR(count(DrawnAs::transparent), 6000, 5 * std::sqrt(20000 * 0.3 * 0.7));
  camera.seed = 2;
  (void)FrameRenderer(camera).render(disks, 0, &later);
  EXPECT_NE(first, later);
}

}  // namespace
}  // namespace shakebed::ingest
