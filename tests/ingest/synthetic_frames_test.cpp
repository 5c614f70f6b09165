#include "ingest/synthetic/synthetic_frames.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace shakebed::ingest {
namespace {

Camera plain(int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.round_to_8_bits = false;
  return camera;
}

// Centre of the missing (or added) light, and its amount in covered pixels.
struct Moments {
  double x = 0, y = 0, area = 0, second = 0;
};
Moments moments_of(const GrayFrame& frame, const Camera& camera) {
  Moments moments;
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      const double covered = (static_cast<double>(frame.at(column, row)) - camera.background_level) /
                             (camera.bead_level - camera.background_level);
      moments.area += covered;
      moments.x += covered * column;
      moments.y += covered * row;
    }
  moments.x /= moments.area;
  moments.y /= moments.area;
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      const double covered = (static_cast<double>(frame.at(column, row)) - camera.background_level) /
                             (camera.bead_level - camera.background_level);
      moments.second += covered * ((column - moments.x) * (column - moments.x)) / moments.area;
    }
  return moments;
}

TEST(Renderer, FlatDiskKeepsItsAreaAndCentreAtAnySubPixelPlaceAndBlur) {
  for (const double blur : {0.0, 0.2, 0.5, 0.8, 2.0})
    for (const double shift : {0.0, 0.13, 0.5, 0.77}) {
      Camera camera = plain(64, 64);
      camera.blur_px = blur;
      const GrayFrame frame = render_frame({{31.0 + shift, 30.0 - 0.6 * shift, 8.3, 0, 0}}, camera);
      const Moments moments = moments_of(frame, camera);
      EXPECT_NEAR(moments.area, std::numbers::pi * 8.3 * 8.3, 2e-4 * moments.area) << blur << " " << shift;
      // A sharp edge is not band-limited: the centroid of its exact pixel integrals strays by up to 1.3e-3 px.
      const double tolerance = blur < 0.3 ? 2e-3 : 2e-4;
      EXPECT_NEAR(moments.x, 31.0 + shift, tolerance) << blur;
      EXPECT_NEAR(moments.y, 30.0 - 0.6 * shift, tolerance) << blur;
      // Variances add: disk R^2/4, blur b^2, pixel 1/12.
      EXPECT_NEAR(moments.second, 8.3 * 8.3 / 4 + blur * blur + 1.0 / 12, 0.02) << blur;
    }
}

TEST(Renderer, SphereShadingHasTheSpheresArea) {
  Camera camera = plain(64, 64);
  camera.blur_px = 0.8;
  camera.shading = BeadShading::shaded;
  camera.shading_depth = 0.3;
  const GrayFrame frame = render_frame({{30.4, 31.7, 9, 0, 0}}, camera);
  const Moments moments = moments_of(frame, camera);
  // integral of 1 - 0.3 sqrt(1 - rho^2) over the disk = pi R^2 (1 - 0.3 * 2/3)
  EXPECT_NEAR(moments.area, std::numbers::pi * 81 * 0.8, 0.05);
  EXPECT_NEAR(moments.x, 30.4, 1e-3);
}

TEST(Renderer, ExposureSmearsAlongTheVelocity) {
  Camera camera = plain(96, 64);
  camera.blur_px = 0.8;
  camera.exposure_s = 1e-3;
  const GrayFrame still = render_frame({{48, 32, 8, 0, 0}}, camera);
  const GrayFrame moving = render_frame({{48, 32, 8, 9000, 0}}, camera);
  const Moments a = moments_of(still, camera), b = moments_of(moving, camera);
  EXPECT_NEAR(b.x, 48, 1e-3);
  EXPECT_NEAR(b.area, a.area, 1e-3 * a.area);
  EXPECT_NEAR(b.second - a.second, 9.0 * 9.0 / 12, 0.02);  // a streak of 9 px
}

// The brighter side is as bright as without a gradient; light and its loss in the corners multiply.
TEST(Renderer, LightChangesAcrossTheFrameAsAsked) {
  Camera camera = plain(41, 21);
  camera.background_level = 120;
  camera.gradient_y = 0.4;
  GrayFrame frame = render_frame({}, camera);
  for (const int column : {0, 20, 40}) {
    EXPECT_NEAR(frame.at(column, 0), 120 * 0.8 / 1.2, 1e-4);  // 1 - 0.4/2 of the middle's
    EXPECT_NEAR(frame.at(column, 5), 120 * 0.9 / 1.2, 1e-4);
    EXPECT_NEAR(frame.at(column, 10), 120 / 1.2, 1e-4);
    EXPECT_NEAR(frame.at(column, 20), 120, 1e-4);
  }
  camera.gradient_y = 0;
  camera.gradient_x = -0.4;
  frame = render_frame({}, camera);
  EXPECT_NEAR(frame.at(0, 7), 120, 1e-4);
  EXPECT_NEAR(frame.at(30, 7), 120 * 0.9 / 1.2, 1e-4);
  EXPECT_NEAR(frame.at(40, 7), 120 * 0.8 / 1.2, 1e-4);
  camera.gradient_y = 0.4;
  camera.vignette = 0.5;
  frame = render_frame({}, camera);
  EXPECT_NEAR(frame.at(20, 10), 120 / 1.4, 1e-4);
  EXPECT_NEAR(frame.at(0, 20), 120 * 0.5, 1e-4);  // a corner, and the brightest
  EXPECT_NEAR(frame.at(20, 0), 120 * 0.8 / 1.4 * (1 - 0.5 * 100 / (100 + 400)), 1e-4);
}

TEST(Renderer, NoiseHasTheVarianceAsked) {
  Camera camera = plain(400, 400);
  camera.background_level = 128;
  camera.read_noise = 4;
  camera.shot_noise = 5;
  const GrayFrame frame = render_frame({}, camera);
  double mean = 0, square = 0;
  for (const float level : frame.pixels) mean += static_cast<double>(level) / 160000;
  for (const float level : frame.pixels) square += std::pow(static_cast<double>(level) - mean, 2) / 160000;
  const double expected = 16 + 25 * 128.0 / 255;
  EXPECT_NEAR(mean, 128, 5 * std::sqrt(expected / 160000));
  EXPECT_NEAR(square, expected, 5 * expected * std::sqrt(2.0 / 160000));  // 5 standard errors
}

TEST(Renderer, SameSeedSameFrameOtherFrameOtherNoise) {
  Camera camera = plain(50, 40);
  camera.read_noise = 3;
  camera.dust_fraction = 0.05;
  const FrameRenderer renderer(camera);
  const std::vector<RenderedDisk> disks = {{20, 20, 6, 0, 0}};
  EXPECT_EQ(renderer.render(disks, 3).pixels, renderer.render(disks, 3).pixels);
  EXPECT_NE(renderer.render(disks, 3).pixels, renderer.render(disks, 4).pixels);
}

TEST(Renderer, MissingAndTransparentBeadsAreReported) {
  Camera camera = plain(300, 300);
  camera.missing_fraction = 0.2;
  camera.transparent_fraction = 0.3;
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < 400; ++k) disks.push_back({10.0 + 14 * (k % 20), 10.0 + 14 * (k / 20), 6, 0, 0});
  std::vector<DrawnAs> drawn;
  const GrayFrame frame = FrameRenderer(camera).render(disks, 0, &drawn);
  int missing = 0, transparent = 0;
  for (std::size_t k = 0; k < disks.size(); ++k) {
    missing += drawn[k] == DrawnAs::missing;
    transparent += drawn[k] == DrawnAs::transparent;
    if (drawn[k] == DrawnAs::missing) {
      EXPECT_NEAR(frame.at(static_cast<int>(disks[k].x_px), static_cast<int>(disks[k].y_px)), camera.background_level,
                  1e-3);
    }
  }
  EXPECT_NEAR(missing, 80, 40);
  EXPECT_NEAR(transparent, 120, 48);
}

TEST(Renderer, RefusesCamerasThatCannotBe) {
  EXPECT_THROW(FrameRenderer(Camera{}), std::invalid_argument);
  Camera camera = plain(10, 10);
  camera.blur_px = -1;
  EXPECT_THROW(FrameRenderer{camera}, std::invalid_argument);
  EXPECT_THROW(render_frame({{1, 1, -3, 0, 0}}, plain(10, 10)), std::invalid_argument);
}

TEST(SyntheticBed, DisksTouchButNeverOverlap) {
  SyntheticBed bed;
  bed.left_wall_px = 5;
  bed.right_wall_px = 405;
  bed.floor_px = 395;
  bed.rows = 6;
  bed.gas_count = 60;
  bed.jitter_px = 0.2;
  const auto disks = make_synthetic_bed(bed);
  EXPECT_EQ(disks.size(), 6U * 20 - 3 + 60);
  for (std::size_t i = 0; i < disks.size(); ++i) {
    EXPECT_GE(disks[i].x_px - 10, 5 - 1e-9);
    EXPECT_LE(disks[i].y_px + 10, 395 + 1e-9);
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GE(std::hypot(disks[i].x_px - disks[j].x_px, disks[i].y_px - disks[j].y_px), 20 - 1e-6);
  }
}

}  // namespace
}  // namespace shakebed::ingest
