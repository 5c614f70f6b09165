// The radius measured from a bead's profile, whatever its shading.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "ingest/find/bead_profile.hpp"
#include "ingest/find/blurred_disk.hpp"
#include "ingest/find/find_disks.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"

namespace shakebed::ingest {
namespace {

constexpr double rim_radius = 10, edge = 1.04, knot = 0.4, rim_noise = 0.035, rim_beads = 1000;

BeadProfile profile_of(const RadialContrast& contrast) {
  BeadProfile profile;
  profile.step_px = 0.05;
  for (int k = 0; k <= 280; ++k)
    profile.level.push_back(static_cast<float>(blurred_disk_contrast(rim_radius, edge, contrast, 0.05 * k)));
  return profile;
}

// Rows or columns smeared by a Gaussian, borders repeated.
std::vector<float> smeared(const std::vector<float>& pixels, int width, int height, double sigma, bool along_rows) {
  const int reach = static_cast<int>(std::ceil(3.5 * sigma));
  std::vector<double> weights;
  double sum = 0;
  for (int k = -reach; k <= reach; ++k) sum += weights.emplace_back(std::exp(-0.5 * k * k / (sigma * sigma)));
  std::vector<float> to(pixels.size());
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      double level = 0;
      for (int k = -reach; k <= reach; ++k) {
        const int x = along_rows ? std::clamp(column + k, 0, width - 1) : column;
        const int y = along_rows ? row : std::clamp(row + k, 0, height - 1);
        level += weights[static_cast<std::size_t>(k + reach)] *
                 static_cast<double>(pixels[static_cast<std::size_t>(y * width + x)]);
      }
      to[static_cast<std::size_t>(row * width + column)] = static_cast<float>(level / sum);
    }
  return to;
}

struct Shading {
  const char* name;
  double (*contrast)(double rho);
};
class Shadings : public testing::TestWithParam<Shading> {};

// Noise of the learned profile at 1,000 beads: 0.035/sqrt(1000 2 pi r knot) at distance r, drawn anew at every knot.
TEST_P(Shadings, RadiusIsToldWithinItsErrorAndHundredthsOfAPixel) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  for (int repeat = 0; repeat < 5; ++repeat) {
    BeadProfile profile = profile_of(GetParam().contrast);
    std::vector<double> errors;
    for (int k = 0; k < 40; ++k) errors.push_back(normal(random));
    for (std::size_t k = 1; k < profile.level.size(); ++k) {
      const double r = 0.05 * static_cast<double>(k), place = r / knot;
      const auto cell = static_cast<std::size_t>(place);
      const double error = errors[cell] + (place - static_cast<double>(cell)) * (errors[cell + 1] - errors[cell]);
      profile.level[k] += static_cast<float>(error * rim_noise / std::sqrt(rim_beads * 2 * 3.14159265 * r * knot));
    }
    const RimChoice choice = choose_rim(profile, {rim_radius + 0.08, edge + 0.1, knot, rim_noise, rim_beads, 200, 60});
    ASSERT_TRUE(choice.rim.good) << GetParam().name;
    EXPECT_EQ(choice.exponent, 1);
    EXPECT_NEAR(choice.rim.radius_px, rim_radius, 0.02);
    // Five trials of five shadings: beyond 4 standard errors (and what learning is good to) by chance once in 600 runs.
    EXPECT_NEAR(choice.rim.radius_px, rim_radius, 4 * choice.rim.std_error_px + 0.002);
  }
}
INSTANTIATE_TEST_SUITE_P(Rim, Shadings,
                         testing::Values(Shading{"flat", [](double) { return 1.0; }},
                                         Shading{"sphere",
                                                 [](double rho) { return 1 - 0.35 * std::sqrt(1 - rho * rho); }},
                                         Shading{"parabola", [](double rho) { return 1 - 0.35 * (1 - rho * rho); }},
                                         Shading{"cone", [](double rho) { return 1 - 0.35 * (1 - rho); }},
                                         Shading{"dark_middle", [](double rho) { return 1 - 0.35 * rho; }}),
                         [](const auto& test_info) { return std::string(test_info.param.name); });

// A camera that encodes for display: level = 255 (light/255)^0.45.
TEST(Rim, AToneCurveIsSeenAndUndone) {
  BeadProfile profile = profile_of([](double) { return 1.0; });
  const auto encoded = [](double light) { return 255 * std::pow(light / 255, 0.45); };
  const double background = encoded(200), bead = encoded(60);
  for (float& level : profile.level)
    level = static_cast<float>((encoded(200 - 140 * static_cast<double>(level)) - background) / (bead - background));
  const RimChoice choice = choose_rim(profile, {rim_radius, edge, knot, rim_noise, rim_beads, background, bead});
  EXPECT_TRUE(choice.rim.good);
  EXPECT_EQ(choice.exponent, 0.45);
  EXPECT_NEAR(choice.rim.radius_px, rim_radius, 0.01);
}

// A packed bed and a gas, as a linear camera and as one that encodes for display records them, and with blacks clipped:
// the radius must be within 3 of its stated errors in all of them (by chance once in 30 runs of these 12), and to a few
// hundredths where nothing but the tone curve is in doubt. Of the 12 the first, and of those that follow every
// `step`-th.
void expect_tone_curve(int step) {
  int number = 0;
  struct Camera2 {
    double bead_level, stretch, exponent, tolerance;
  };
  for (const bool packed : {true, false})
    for (const BeadShading shading : {BeadShading::flat, BeadShading::shaded})
      for (const auto& [bead_level, stretch, exponent, tolerance] :
           {Camera2{25, 1, 1, 0.02}, Camera2{25, 1, 0.45, 0.02}, Camera2{0, 1.12, 1, 0.2}}) {
        if (number++ % step != 0) continue;
        Camera camera;
        camera.width = 600, camera.height = 400;
        camera.background_level = 217, camera.bead_level = bead_level;
        camera.shading = shading;
        camera.blur_px = 1, camera.read_noise = 3;
        camera.round_to_8_bits = false;
        SyntheticBed bed;
        bed.left_wall_px = 7.3, bed.right_wall_px = 591.8, bed.floor_px = 390.6;
        bed.radius_px = 14.3;
        bed.rows = packed ? 6 : 0, bed.gas_count = packed ? 20 : 70;
        bed.gas_height_px = packed ? 60 : 200, bed.jitter_px = 0.1;
        GrayFrame frame = render_frame(make_synthetic_bed(bed), camera);
        for (float& level : frame.pixels) {
          const double light = std::clamp(217 - stretch * (217 - static_cast<double>(level)), 0.0, 255.0);
          level = static_cast<float>(std::round(255 * std::pow(light / 255, exponent)));
        }
        const CalibrationResult result = calibrate_finder({&frame});
        ASSERT_TRUE(result.found) << result.why_not;
        const FinderCalibration& found = result.calibration;
        EXPECT_NEAR(found.radius_px, 14.3, tolerance) << packed << ' ' << stretch << ' ' << exponent;
        EXPECT_NEAR(found.radius_px, 14.3, 3 * found.radius_std_error_px)
            << packed << ' ' << stretch << ' ' << exponent;
      }
}
TEST(Rim, TheToneCurveIsToldFromFramesOfEitherKind) { expect_tone_curve(5); }
TEST(Rim, TheToneCurveIsToldFromFramesOfEveryKind) { expect_tone_curve(1); }

// A halo (15 % of the light spread over 3, 8 or 20 px) explains no rim: whatever is told, linear or encoded, packed or
// not, the radius must lie within 2.5 of the stated errors (by chance beyond once in 80; these 24 are no chance but the
// model's own failing, so none may), and the error must still mean something.
// Of the 24 the first, and of those that follow every `step`-th.
void expect_radius_with_halo(int step) {
  constexpr int width = 600, height = 400;
  int number = 0;
  for (const double sigma : {3.0, 8.0, 20.0})
    for (const double exponent : {1.0, 0.45})
      for (const bool packed : {true, false})
        for (const BeadShading shading : {BeadShading::flat, BeadShading::shaded}) {
          if (number++ % step != 0) continue;
          Camera camera;
          camera.width = width, camera.height = height;
          camera.background_level = 217, camera.bead_level = 25;
          camera.shading = shading;
          camera.blur_px = 1, camera.read_noise = 3;
          camera.round_to_8_bits = false;
          SyntheticBed bed;
          bed.left_wall_px = 7.3, bed.right_wall_px = 591.8, bed.floor_px = 390.6;
          bed.radius_px = 14.3;
          bed.rows = packed ? 6 : 0, bed.gas_count = packed ? 20 : 70;
          bed.gas_height_px = packed ? 60 : 200, bed.jitter_px = 0.1;
          GrayFrame frame = render_frame(make_synthetic_bed(bed), camera);
          const std::vector<float> spread =
              smeared(smeared(frame.pixels, width, height, sigma, true), width, height, sigma, false);
          for (std::size_t k = 0; k < frame.pixels.size(); ++k) {
            const double light = std::clamp(
                0.85 * static_cast<double>(frame.pixels[k]) + 0.15 * static_cast<double>(spread[k]), 0.0, 255.0);
            frame.pixels[k] = static_cast<float>(std::round(255 * std::pow(light / 255, exponent)));
          }
          const CalibrationResult result = calibrate_finder({&frame});
          ASSERT_TRUE(result.found) << result.why_not;
          const FinderCalibration& found = result.calibration;
          EXPECT_NEAR(found.radius_px, 14.3, 2.5 * found.radius_std_error_px)
              << sigma << ' ' << exponent << ' ' << packed << ' ' << (shading == BeadShading::flat);
          EXPECT_LT(found.radius_std_error_px, 0.02 * 14.3);
        }
}
TEST(Rim, WithAHaloTheErrorHoldsTheRadius) { expect_radius_with_halo(7); }
TEST(Rim, WithEveryHaloTheErrorHoldsTheRadius) { expect_radius_with_halo(1); }

// Of one frame of this look the radius is told to some 0.01 px; ten frames must do better than 0.012 (4 standard
// errors).
TEST(Rim, SeveralFramesTellTheRadiusBetterThanOne) {
  Camera camera;
  camera.width = camera.height = 500;
  camera.shading = BeadShading::shaded;
  camera.blur_px = 1;
  camera.read_noise = 15;
  SyntheticBed bed;
  bed.left_wall_px = 7.3, bed.right_wall_px = 491.8, bed.floor_px = 490.6;
  bed.rows = 8, bed.gas_count = 60, bed.jitter_px = 0.1;
  const FrameRenderer renderer(camera);
  FinderCalibration calibration;
  RadiusFromFrames several;
  FindOptions options;
  options.learn_rim = true;
  for (std::uint64_t k = 0; k < rim_frames; ++k) {
    bed.seed = k + 1;
    const GrayFrame frame = renderer.render(make_synthetic_bed(bed), k);
    if (k == 0) calibration = calibrate_finder({&frame}).calibration;
    several.add(find_disks(frame, calibration, options));
  }
  FinderCalibration refined = calibration;
  several.refine(refined);
  EXPECT_NE(refined.radius_px, calibration.radius_px);
  EXPECT_LT(refined.radius_std_error_px, calibration.radius_std_error_px);
  EXPECT_NEAR(refined.radius_px, 10, 0.012);
}

}  // namespace
}  // namespace shakebed::ingest
