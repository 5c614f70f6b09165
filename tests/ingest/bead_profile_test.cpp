// What a bead looks like: its profile, its asymmetry and its rim, learned from frames of known beads.
#include "ingest/find/bead_profile.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/blurred_disk.hpp"
#include "ingest/find/profile_samples.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

using test::even_frame;
using test::frame_by;

// --- blurred_disk.hpp ------------------------------------------------------------------------------------------------

TEST(BlurredDisk, RuleOfGaussIsExactForPolynomials) {
  for (const std::size_t count : {1U, 2U, 5U, 24U}) {
    const GaussLegendre rule = gauss_legendre(count);
    ASSERT_EQ(rule.node.size(), count);
    for (std::size_t power = 0; power < 2 * count; ++power) {
      double sum = 0;
      for (std::size_t k = 0; k < count; ++k)
        sum += rule.weight[k] * std::pow(rule.node[k], static_cast<double>(power));
      EXPECT_NEAR(sum, 1 / (static_cast<double>(power) + 1), 1e-13) << count << ' ' << power;
    }
    for (std::size_t k = 0; k + 1 < count; ++k) EXPECT_LT(rule.node[k], rule.node[k + 1]);
  }
}

// The convolution with a Gaussian of the plane, summed over a fine grid of the disk.
TEST(BlurredDisk, IsTheConvolutionWithAGaussian) {
  const std::array<RadialContrast, 5> contrasts = {
      [](double) { return 1.0; }, [](double rho) { return std::sqrt(std::max(0.0, 1 - rho * rho)); },
      [](double rho) { return 1 - rho * rho; }, [](double rho) { return 1 - rho; },
      [](double rho) { return (1 - rho * rho) * (1 - rho * rho); }};
  for (const auto& [radius, blur] : {std::array{3.0, 0.8}, {2.0, 2.5}})
    for (const double distance : {0.0, 1.3, 2.9, 4.4}) {
      constexpr int cells = 200;
      std::array<double, 5> sums{};
      for (int j = 0; j < cells; ++j)
        for (int i = 0; i < cells; ++i) {
          const double h = 2 * radius / cells, x = -radius + (i + 0.5) * h, y = -radius + (j + 0.5) * h,
                       rho = std::hypot(x, y) / radius;
          if (rho >= 1) continue;
          const double weight = h * h * std::exp(-0.5 * ((x - distance) * (x - distance) + y * y) / (blur * blur)) /
                                (2 * std::numbers::pi * blur * blur);
          for (std::size_t k = 0; k < 5; ++k) sums[k] += weight * contrasts[k](rho);
        }
      const BlurredShapes shapes = blurred_disk_shapes(radius, blur, distance);
      const std::array<double, 5> found = {shapes.flat, shapes.sphere, shapes.parabola, shapes.cone, shapes.quartic};
      for (std::size_t k = 0; k < 5; ++k) {
        EXPECT_NEAR(found[k], sums[k], 5e-4) << k << ' ' << radius << ' ' << distance;
        EXPECT_NEAR(blurred_disk_contrast(radius, blur, contrasts[k], distance), found[k], 1e-12);
      }
    }
  // In the middle: 1 - exp(-R^2/2b^2).
  EXPECT_NEAR(blurred_disk_shapes(3, 1.5, 0).flat, 1 - std::exp(-2.0), 1e-6);
  EXPECT_EQ(blurred_disk_shapes(3, 0.5, 7).flat, 0);
}

TEST(BlurredDisk, SamplesAreLinearBetweenTheirSteps) {
  const std::vector<double> samples = {1, 3, 2};
  EXPECT_EQ(value_at(samples, 0.5, 0.0), 1);
  EXPECT_NEAR(value_at(samples, 0.5, 0.125), 1.5, 1e-12);
  EXPECT_NEAR(value_at(samples, 0.5, 0.75), 2.5, 1e-12);
  EXPECT_EQ(value_at(samples, 0.5, 1.0), 0);
  EXPECT_EQ(first_row(0, 3), 0);
  EXPECT_EQ(first_row(1, 3), 3);
  EXPECT_EQ(first_row(3, 3), 3);
  EXPECT_EQ(first_row(5, 1), 5);
}

TEST(BeadProfile, OfAnIdealDiskIsItsBlur) {
  for (const double reach : {9.2, 14.0}) {
    const BeadProfile profile = ideal_profile(6, 0.9, reach);
    EXPECT_NEAR(profile.step_px, 0.09, 1e-12);
    EXPECT_GE(profile.reach_px(), reach - 1e-9);
    EXPECT_LT(profile.reach_px(), reach + 0.09);
    EXPECT_EQ(profile.level.back(), 0);
    EXPECT_EQ(profile.fourth_harmonic.size(), profile.level.size());
    for (std::size_t k = 0; k + 1 < profile.level.size(); ++k)
      EXPECT_NEAR(profile.level[k],
                  blurred_disk_contrast(
                      6, 0.9, [](double) { return 1.0; }, static_cast<double>(k) * profile.step_px),
                  1e-6);
  }
  EXPECT_NEAR(ideal_profile(2, 3, 4).step_px, 0.2, 1e-12);
  EXPECT_EQ(BeadProfile{}.reach_px(), 0);
}

// --- learn_profile ---------------------------------------------------------------------------------------------------

ModelDisk disk_at(double x, double y) {
  ModelDisk disk;
  disk.x = x, disk.y = y;
  return disk;
}

constexpr double learned_radius = 6, learned_edge = 1.1, learned_reach = 10;

double shaded_level(double r) {
  const BlurredShapes shapes = blurred_disk_shapes(learned_radius, learned_edge, r);
  return 1.2 * shapes.flat - 0.4 * shapes.sphere;
}
std::vector<double> levels_by_distance(double (*level)(double), double reach) {
  std::vector<double> table;
  for (int k = 0; k * 0.01 < reach + 1; ++k) table.push_back(level(0.01 * k));
  return table;
}

// Beads alone, touching, and cut by all four sides, all of one profile; learned from the profile of a flat disk. Of
// every third row as well as of all.
TEST(BeadProfile, IsLearnedFromBeadsThatShareTheirPixels) {
  std::vector<ModelDisk> disks;
  for (const auto& [x, y] : {std::array{14.2, 15.4},
                             {26.5, 14.7},
                             {20.3, 25.9},
                             {52.1, 30.3},
                             {-2.2, 42.1},
                             {71.3, 47.7},
                             {44.8, -1.6},
                             {33.4, 62.2},
                             {12.6, 52.8},
                             {24.9, 50.1}})
    disks.push_back(disk_at(x, y));
  const std::vector<double> table = levels_by_distance(shaded_level, learned_reach);
  GrayFrame flat = frame_by(70, 61, [&](int column, int row) {
    double sum = 0;
    for (const ModelDisk& disk : disks)
      if (const double r = std::hypot(column - disk.x, row - disk.y); r < learned_reach)
        sum += value_at(table, 0.01, r);
    return sum;
  });
  test::set(flat, 50, 28, unseen_level);
  const BeadProfile start = ideal_profile(learned_radius, 0.9, learned_reach);
  const ProfileTable first(start, learned_radius, learned_edge, 0);
  for (const int row_step : {1, 3}) {
    JointFit fit(flat);
    fit.set_table(&first);
    fit.reset(flat, disks);
    const BeadProfile learned =
        learn_profile({&fit}, {&disks}, start,
                      {.reach_px = learned_reach, .knot_px = 0.4, .radius_px = learned_radius, .row_step = row_step});
    EXPECT_EQ(learned.level.back(), 0);
    EXPECT_GE(learned.reach_px(), learned_reach - 1e-9);
    EXPECT_NEAR(learned.step_px, 0.05, 1e-9);
    for (double r = 0.3; r < learned_reach - 0.5; r += 0.21)
      EXPECT_NEAR(value_at(learned.level, learned.step_px, r), shaded_level(r), row_step == 1 ? 4e-3 : 0.012)
          << r << ' ' << row_step;
    for (const float harmonic : learned.fourth_harmonic) EXPECT_EQ(harmonic, 0);
  }
}

// Where there is no bead at all, and nothing is left over, the profile stays as it was.
TEST(BeadProfile, StaysWhereNothingIsLeftOver) {
  const BeadProfile start = test::blurred_profile(learned_radius, learned_edge, learned_reach);
  const ProfileTable table(start, learned_radius, learned_edge, 0);
  const std::vector<ModelDisk> disks = {disk_at(20, 20), disk_at(33.4, 22), disk_at(44, 40)};
  GrayFrame flat = even_frame(60, 55, 0);
  JointFit fit(flat);
  fit.set_table(&table);
  fit.reset(flat, disks);
  const GrayFrame negative = fit.residual_image();
  for (std::size_t k = 0; k < flat.pixels.size(); ++k) flat.pixels[k] = -negative.pixels[k];
  fit.reset(flat, disks);
  const std::vector<ModelDisk> nobody;
  for (const auto* beads : {&disks, &nobody}) {
    const BeadProfile learned =
        learn_profile({&fit}, {beads}, start, {.reach_px = learned_reach, .knot_px = 0.4, .radius_px = learned_radius});
    for (double r = 0; r < learned_reach - 0.1; r += 0.21)
      EXPECT_NEAR(value_at(learned.level, learned.step_px, r), value_at(start.level, start.step_px, r), 1.5e-3) << r;
  }
}

// p4(r) cos(4 theta) around the rim of lone beads.
TEST(BeadProfile, HasTheFourthHarmonicOfItsBeads) {
  const auto fourth = [](double r) { return 0.06 * std::exp(-std::pow((r - learned_radius) / 0.9, 2)); };
  const std::vector<ModelDisk> disks = {disk_at(20.3, 19.6), disk_at(44.1, 21.2), disk_at(20.7, 45.5),
                                        disk_at(45.4, 44.8)};
  const BeadProfile start = test::blurred_profile(learned_radius, learned_edge, learned_reach);
  const ProfileTable table(start, learned_radius, learned_edge, 0);
  const GrayFrame flat = frame_by(65, 64, [&](int column, int row) {
    double sum = 0;
    for (const ModelDisk& disk : disks) {
      const double dx = column - disk.x, dy = row - disk.y, r = std::hypot(dx, dy);
      sum += table.at(r * r) + fourth(r) * std::cos(4 * std::atan2(dy, dx));
    }
    return sum;
  });
  JointFit fit(flat);
  fit.set_table(&table);
  fit.reset(flat, disks);
  for (const bool asked : {true, false}) {
    const BeadProfile learned = learn_profile({&fit}, {&disks}, start,
                                              {.reach_px = learned_reach,
                                               .knot_px = 0.4,
                                               .radius_px = learned_radius,
                                               .fourth_harmonic = asked,
                                               .row_step = 1});
    for (double r = 3.8; r < 8.3; r += 0.17)
      EXPECT_NEAR(value_at(learned.fourth_harmonic, learned.step_px, r), asked ? fourth(r) : 0, 5e-3) << r;
    for (const double r : {1.0, 3.2, 8.8}) EXPECT_NEAR(value_at(learned.fourth_harmonic, learned.step_px, r), 0, 1e-6);
  }
}

// --- asymmetry -------------------------------------------------------------------------------------------------------

constexpr double harmonic_step = 0.4;

// c_m(r) and s_m(r), m = 1 .. 6, smooth and 0 in the middle.
double cosine_of(std::size_t m, double r) {
  return 0.08 / static_cast<double>(m) * std::exp(-std::pow((r - 4.5) / 1.5, 2)) * (m % 2 ? 1 : -0.7);
}
double sine_of(std::size_t m, double r) {
  return 0.05 / static_cast<double>(m) * std::exp(-std::pow((r - 5) / 1.2, 2)) * (m % 3 ? 1 : -1);
}
double asymmetry_by_hand(double dx, double dy, std::size_t highest = 6) {
  const double r = std::hypot(dx, dy), angle = std::atan2(dy, dx);
  double sum = 0;
  if (r > 10.5) return 0;
  for (std::size_t m = 1; m <= highest; ++m)
    sum += cosine_of(m, r) * std::cos(static_cast<double>(m) * angle) +
           sine_of(m, r) * std::sin(static_cast<double>(m) * angle);
  return sum;
}
std::shared_ptr<const BeadAsymmetry> known_asymmetry(double reach = 10, std::size_t highest = 6) {
  BeadAsymmetry::Harmonics harmonics;
  harmonics.step_px = harmonic_step;
  for (std::size_t m = 1; m <= 6; ++m)
    for (int k = 0; k * harmonic_step <= reach + 1e-9; ++k) {
      harmonics.cosine[m - 1].push_back(m <= highest ? cosine_of(m, k * harmonic_step) : 0);
      harmonics.sine[m - 1].push_back(m <= highest ? sine_of(m, k * harmonic_step) : 0);
    }
  return std::make_shared<const BeadAsymmetry>(std::move(harmonics));
}

TEST(BeadAsymmetry, IsTheSumOfItsHarmonics) {
  const auto asymmetry = known_asymmetry();
  for (double dx = -8; dx < 8; dx += 0.73)
    for (double dy = -8; dy < 8; dy += 0.67)
      EXPECT_NEAR(asymmetry->at(dx, dy), asymmetry_by_hand(dx, dy), 4e-3) << dx << ' ' << dy;
  EXPECT_EQ(asymmetry->at(0, 0), 0);
  EXPECT_EQ(asymmetry->at(7.1, 7.1), 0);
  // On the samples themselves it is exact.
  EXPECT_NEAR(asymmetry->at(4.8, 0), asymmetry_by_hand(4.8, 0), 1e-12);
  EXPECT_NEAR(asymmetry->at(0, -5.2), asymmetry_by_hand(0, -5.2), 1e-12);
  // Rms over the disk of the odd ones.
  double square = 0, area = 0;
  for (int k = 0; k * harmonic_step <= 6; ++k) {
    const double r = k * harmonic_step;
    area += r;
    for (const std::size_t m : {1U, 3U, 5U})
      square += 0.5 * r * (std::pow(cosine_of(m, r), 2) + std::pow(sine_of(m, r), 2));
  }
  EXPECT_NEAR(asymmetry->one_sidedness(6), std::sqrt(square / area), 1e-12);
  EXPECT_EQ(asymmetry->one_sidedness(-1), 0);
}

// Rows of a picture, for beads small and large, whose columns begin before, in and after the bead.
TEST(BeadAsymmetry, IsAddedToRows) {
  for (const double reach : {10.0, 20.0}) {
    const auto asymmetry = known_asymmetry(reach);
    for (const double x : {14.3, 3.95, -2.2, 27.0})
      for (double dy = -12; dy < 12.5; dy += 1.37)
        for (const int left : {0, 6}) {
          std::vector<float> row(24, 0.5F);
          asymmetry->add_to_row(row.data(), left, 24, x, dy, -2);
          for (int k = 0; k < 24; ++k)
            EXPECT_NEAR(row[static_cast<std::size_t>(k)], 0.5 - 2 * asymmetry->at(left + k - x, dy),
                        reach > 16 ? 0.02 : 8e-3)
                << x << ' ' << dy << ' ' << left + k;
        }
  }
}

// Beads of which each shows the asymmetry: 0.7 of it is taken over at once, with the sign and the order of each
// harmonic.
TEST(BeadAsymmetry, IsLearnedFromWhatAllBeadsHaveInCommon) {
  std::vector<ModelDisk> disks;
  for (int k = 0; k < 16; ++k) disks.push_back(disk_at(15.13 + 23.21 * (k % 4), 14.71 + 23.37 * (k / 4)));
  const GrayFrame flat = frame_by(100, 99, [&](int column, int row) {
    double sum = 0;
    for (const ModelDisk& disk : disks) sum += asymmetry_by_hand(column - disk.x, row - disk.y);
    return sum;
  });
  GrayFrame with_dirt = flat;
  test::set(with_dirt, 17, 12, 3), test::set(with_dirt, 40, 12, unseen_level);
  BeadProfile profile = test::blurred_profile(learned_radius, learned_edge, learned_reach, 0.1);
  for (const GrayFrame* frame : {&flat, static_cast<const GrayFrame*>(&with_dirt)}) {
    const JointFit fit(*frame);
    profile.asymmetry = nullptr;
    const auto learned = learn_asymmetry({&fit}, {&disks}, profile, {.radius_px = 6, .noise = 0.001});
    ASSERT_TRUE(learned);
    for (std::size_t m = 1; m <= 6; ++m)
      for (int k = 8; k < 18; ++k) {
        const double r = k * harmonic_step, allowed = std::clamp(2 * r / static_cast<double>(m) - 0.5, 0.0, 1.0);
        EXPECT_NEAR(learned->harmonics().cosine[m - 1][static_cast<std::size_t>(k)], 0.7 * allowed * cosine_of(m, r),
                    8e-3)
            << m << ' ' << r;
        EXPECT_NEAR(learned->harmonics().sine[m - 1][static_cast<std::size_t>(k)], 0.7 * allowed * sine_of(m, r), 8e-3)
            << m << ' ' << r;
      }
    EXPECT_EQ(learned->harmonics().step_px, harmonic_step);
    // Near the middle a shape of six periods a turn is nothing.
    EXPECT_EQ(learned->harmonics().cosine[5][1], 0);
    EXPECT_EQ(learned->harmonics().cosine[5][3], 0);
    // With what is known already it is added to that.
    profile.asymmetry = learned;
    const auto again = learn_asymmetry({&fit}, {&disks}, profile, {.radius_px = 6, .noise = 0.001, .row_step = 2});
    ASSERT_TRUE(again);
    EXPECT_NEAR(again->harmonics().cosine[0][11], 1.4 * cosine_of(1, 4.4), 0.012);
    EXPECT_NEAR(again->harmonics().sine[1][12], 1.4 * sine_of(2, 4.8), 0.012);
  }
}

// Half a level in three from side to side is none beside the noise; nor is what differs along and across alone.
TEST(BeadAsymmetry, IsNoneThatNoiseOrThePixelsShapeMakes) {
  const std::vector<ModelDisk> disks = {disk_at(15, 15), disk_at(40, 15), disk_at(15, 40), disk_at(40, 40)};
  const BeadProfile profile = test::blurred_profile(learned_radius, learned_edge, learned_reach, 0.1);
  const auto learned = [&](double amplitude, int periods, double noise) {
    const GrayFrame flat = frame_by(56, 56, [&](int column, int row) {
      double sum = 0;
      for (const ModelDisk& disk : disks) {
        const double dx = column - disk.x, dy = row - disk.y;
        if (std::hypot(dx, dy) < 8) sum += amplitude * std::cos(periods * std::atan2(dy, dx));
      }
      return sum;
    });
    const JointFit fit(flat);
    return learn_asymmetry({&fit}, {&disks}, profile, {.radius_px = 6, .noise = noise}) != nullptr;
  };
  // 0.7 a/sqrt 2 = 0.015 for a = 0.0303.
  EXPECT_TRUE(learned(0.034, 1, 0));
  EXPECT_FALSE(learned(0.027, 1, 0));
  EXPECT_FALSE(learned(0.1, 2, 0));
  EXPECT_TRUE(learned(0.1, 3, 0));
  // Noise of 0.3 a pixel gives each of 16 rings and six orders, by the 5 r pixels that count there, 0.49 0.09/(5 r) r;
  // four times that over the sum of r, 48 px: 0.066, so 0.7 a/sqrt 2 = 0.257.
  EXPECT_FALSE(learned(0.4, 1, 0.3));
  EXPECT_TRUE(learned(0.6, 1, 0.3));
}

// Seen from beside its centre a radial bead is asymmetric; seen from there again it is what it was.
TEST(BeadAsymmetry, FollowsTheCentre) {
  BeadProfile profile = test::blurred_profile(learned_radius, 1.4, 12, 0.1);
  profile.asymmetry = known_asymmetry(12);
  const BeadProfile moved = recentred(profile, 0.3, -0.2);
  ASSERT_TRUE(moved.asymmetry);
  const auto level = [](const BeadProfile& of, double x, double y) {
    return value_at(of.level, of.step_px, std::hypot(x, y)) + of.asymmetry->at(x, y);
  };
  for (double x = -7.5; x < 8; x += 1.3)
    for (double y = -7.1; y < 8; y += 1.1) {
      if (std::hypot(x, y) < 1.2) continue;
      EXPECT_NEAR(level(moved, x, y), level(profile, x + 0.3, y - 0.2), 0.012) << x << ' ' << y;
    }
  EXPECT_EQ(moved.level.back(), profile.level.back());
  EXPECT_EQ(moved.asymmetry->harmonics().cosine[0][0], 0);
  const BeadProfile back = recentred(moved, -0.3, 0.2);
  for (std::size_t m = 0; m < 2; ++m)
    for (std::size_t k = 6; k < 18; ++k)
      EXPECT_NEAR(back.asymmetry->harmonics().cosine[m][k], profile.asymmetry->harmonics().cosine[m][k], 0.01)
          << m << ' ' << k;
}

// A disk of level 1 whose middle lies beside the profile's centre: the outline is there, with its radius.
TEST(BeadAsymmetry, OutlineIsTheCircleOnWhichTheBeadEnds) {
  BeadAsymmetry::Harmonics none;
  none.step_px = harmonic_step;
  for (std::size_t m = 0; m < 6; ++m) none.cosine[m].assign(36, 0.0), none.sine[m].assign(36, 0.0);
  BeadProfile centred = test::blurred_profile(9, 1.1, 14, 0.05);
  centred.asymmetry = std::make_shared<const BeadAsymmetry>(none);
  for (const auto& [x, y] : {std::array{0.0, 0.0}, {0.4, -0.25}, {-0.3, 0.5}}) {
    const Outline outline = outline_of(recentred(centred, -x, -y), 9.2, 1.1);
    ASSERT_TRUE(outline.good);
    EXPECT_NEAR(outline.x_px, x, 0.02);
    EXPECT_NEAR(outline.y_px, y, 0.02);
    EXPECT_NEAR(outline.radius_px, 9, 0.03);
  }
}

// A bead that is turned by quarters has its outline, and what is seen from beside its centre, turned with it: no
// direction counts for more than the others.
TEST(BeadAsymmetry, TurnsWithItsBead) {
  const auto turned = [](int quarters) {
    BeadAsymmetry::Harmonics harmonics;
    harmonics.step_px = harmonic_step;
    for (std::size_t m = 0; m < 6; ++m)
      for (int k = 0; k < 36; ++k) {
        // Of a shape of m + 1 periods a turn, strongest at the rim; the amplitudes of its cosine and its sine.
        const double rim = std::exp(-std::pow((k * harmonic_step - 9) / 1.5, 2)) * (k < 34);
        const double c = 0.12 * rim * test::scattered(static_cast<int>(m), 1),
                     s = 0.12 * rim * (test::scattered(2, static_cast<int>(m)) - 0.5);
        const double angle = quarters * static_cast<double>(m + 1) * std::numbers::pi / 2;
        harmonics.cosine[m].push_back(c * std::cos(angle) - s * std::sin(angle));
        harmonics.sine[m].push_back(c * std::sin(angle) + s * std::cos(angle));
      }
    BeadProfile profile = test::blurred_profile(9, 1.1, 14, 0.05);
    profile.asymmetry = std::make_shared<const BeadAsymmetry>(harmonics);
    return profile;
  };
  const auto turn = [](double x, double y, int quarters) {
    for (int k = 0; k < quarters; ++k) std::tie(x, y) = std::pair(-y, x);
    return std::pair(x, y);
  };
  const Outline plain = outline_of(turned(0), 9.1, 1.1);
  ASSERT_TRUE(plain.good);
  EXPECT_GT(std::hypot(plain.x_px, plain.y_px), 0.02);
  const BeadProfile beside = recentred(turned(0), 0.3, -0.7);
  for (const int quarters : {1, 2, 3}) {
    const Outline outline = outline_of(turned(quarters), 9.1, 1.1);
    const auto [x, y] = turn(plain.x_px, plain.y_px, quarters);
    EXPECT_NEAR(outline.x_px, x, 1e-6) << quarters;
    EXPECT_NEAR(outline.y_px, y, 1e-6) << quarters;
    EXPECT_NEAR(outline.radius_px, plain.radius_px, 1e-6) << quarters;
    const auto [by_x, by_y] = turn(0.3, -0.7, quarters);
    const BeadProfile moved = recentred(turned(quarters), by_x, by_y);
    for (std::size_t k = 0; k < moved.level.size(); ++k) ASSERT_NEAR(moved.level[k], beside.level[k], 1e-5F) << k;
    for (double r = 0.5; r < 13; r += 1.1) {
      const auto [u, v] = turn(r * 0.8, r * 0.6, quarters);
      ASSERT_NEAR(moved.asymmetry->at(u, v), beside.asymmetry->at(r * 0.8, r * 0.6), 1e-6) << quarters << ' ' << r;
    }
  }
}

// --- rims ------------------------------------------------------------------------------------------------------------

// Profiles without noise: flat, a ball's light, and with a parabola; sharp ones as square pixels see them on average.
TEST(RimFit, OfAnExactProfileIsExact) {
  const auto fitted = [](double radius, double edge, const RadialContrast& contrast) {
    BeadProfile profile;
    profile.step_px = 0.05;
    for (int k = 0; k * 0.05 < radius + 5 * edge + 1; ++k)
      profile.level.push_back(static_cast<float>(blurred_disk_contrast(radius, edge, contrast, 0.05 * k)));
    return fit_rim(profile, 1.02 * radius, 1.2 * edge);
  };
  for (const auto& [radius, edge] : {std::array{10.0, 1.0}, {5.3, 0.8}, {14.0, 2.1}}) {
    const RimFit flat = fitted(radius, edge, [](double) { return 1.0; });
    EXPECT_TRUE(flat.good);
    EXPECT_NEAR(flat.radius_px, radius, 2e-3);
    EXPECT_NEAR(flat.edge_px, edge, 3e-3);
    EXPECT_LT(flat.misfit, 5e-4);
    const RimFit ball =
        fitted(radius, edge, [](double rho) { return 1 - 0.35 * std::sqrt(std::max(0.0, 1 - rho * rho)); });
    EXPECT_TRUE(ball.good);
    EXPECT_NEAR(ball.radius_px, radius, 4e-3);
    EXPECT_NEAR(ball.edge_px, edge, 6e-3);
  }
}

// A level outside that is not 0 is taken for an offset up to 0.006.
// A rim that is more than a quarter of the radius and 1 px away is none of the bead that was seen.
TEST(RimFit, OfARimFarFromTheGuessIsNone) {
  BeadProfile profile;
  profile.step_px = 0.05;
  for (int k = 0; k <= 340; ++k)
    profile.level.push_back(static_cast<float>(blurred_disk_contrast(
        10, 1, [](double) { return 1.0; }, 0.05 * k)));
  for (const double guess : {9.0, 11.0}) {
    const RimFit near = fit_rim(profile, guess, 1);
    EXPECT_TRUE(near.good) << guess;
    EXPECT_NEAR(near.radius_px, 10, 2e-3) << guess;
  }
  for (const double guess : {6.0, 17.0}) EXPECT_FALSE(fit_rim(profile, guess, 1).good) << guess;
}

TEST(RimFit, TakesASmallLevelOutsideForAnOffset) {
  const auto radius_with = [](double offset) {
    BeadProfile profile;
    profile.step_px = 0.05;
    for (int k = 0; k <= 300; ++k)
      profile.level.push_back(static_cast<float>(offset + blurred_disk_contrast(
                                                              10, 1.2, [](double) { return 1.0; }, 0.05 * k)));
    return fit_rim(profile, 10, 1.2).radius_px;
  };
  EXPECT_NEAR(radius_with(0.004), 10, 2e-3);
  EXPECT_NEAR(radius_with(-0.004), 10, 2e-3);
  EXPECT_GT(std::abs(radius_with(-0.012) - 10), 4e-3);
}

RimConditions conditions_of(double radius, double edge, double noise, double beads) {
  return {.radius_px = radius,
          .edge_px = edge,
          .knot_px = 0.4,
          .noise = noise,
          .beads = beads,
          .background_level = 200,
          .bead_level = 60};
}

// The error stated of a flat bead's rim is at least that of its radius alone, and grows with the noise and falls with
// the number of beads.
TEST(RimChoice, HasAnErrorThatFollowsTheNoise) {
  const BeadProfile profile = test::blurred_profile(10, 1.04, 15, 0.05);
  const auto error_of = [&](double noise, double beads) {
    const RimChoice choice = choose_rim(profile, conditions_of(10, 1.04, noise, beads));
    EXPECT_TRUE(choice.rim.good);
    EXPECT_EQ(choice.exponent, 1);
    EXPECT_NEAR(choice.rim.radius_px, 10, 3e-3);
    return choice.rim.std_error_px;
  };
  const double one = error_of(0.1, 100);
  // Of white noise a pixel, 100 rims of radius 10 give 0.1 sqrt(2 sqrt(pi) 1.04/(100 2 pi 10)) = 0.0024 px.
  const double bound = 0.1 * std::sqrt(2 * std::sqrt(std::numbers::pi) * 1.04 / (100 * 2 * std::numbers::pi * 10));
  EXPECT_GT(one, bound);
  EXPECT_NEAR(error_of(0.2, 400) / one, 1, 0.02);
  EXPECT_LT(error_of(0.1, 400), 0.55 * one);  // four times as many rims: about half
  EXPECT_GT(error_of(0.2, 100), 1.9 * one);
  EXPECT_LT(error_of(0.01, 1e4), 2e-3);
}

// Known from 7 px outwards only, or misshapen: a profile that no disk explains is not good; too few points are no rim.
TEST(RimChoice, UsesWhatIsKnownAndRefusesWhatNoDiskExplains) {
  BeadProfile profile = test::blurred_profile(10, 1.04, 15, 0.05);
  RimConditions conditions = conditions_of(10, 1.04, 0.03, 1000);
  for (std::size_t k = 0; k < 120; ++k) profile.level[k] = 3;  // within 6 px
  EXPECT_FALSE(choose_rim(profile, conditions).rim.good);
  conditions.from_px = 7;
  const RimChoice outer = choose_rim(profile, conditions);
  EXPECT_TRUE(outer.rim.good);
  EXPECT_NEAR(outer.rim.radius_px, 10, 4e-3);
  conditions.from_px = 14.5;
  EXPECT_FALSE(choose_rim(profile, conditions).rim.good);
  EXPECT_EQ(choose_rim(profile, conditions).rim.radius_px, 0);
}

// Beads that are lit as each of the shapes says, half of their contrast by it: known almost without noise, so that one
// shape alone explains the profile.
TEST(RimsOfShadings, AreAtTheRadiusForEachShape) {
  const std::vector<std::pair<std::string, RadialContrast>> shapes{
      {"flat", [](double) { return 1.0; }},
      {"sphere", [](double rho) { return std::sqrt(1 - rho * rho); }},
      {"parabola", [](double rho) { return 1 - rho * rho; }},
      {"cone", [](double rho) { return 1 - rho; }},
      {"quartic", [](double rho) { return (1 - rho * rho) * (1 - rho * rho); }}};
  const auto level_of = [](double light) { return 255 * std::pow(light, 0.45); };
  const double outside = level_of(0.9), inside = level_of(0.05);
  for (const auto& [name, shape] : shapes)
    for (const bool encoded : {false, true}) {
      SCOPED_TRACE(name + (encoded ? " encoded for display" : ""));
      BeadProfile profile;
      profile.step_px = 0.05;
      const double share = encoded ? 0.2 : 0.5;  // of the shape; more of it may pass for a tone curve
      const RadialContrast lit = [&](double rho) { return 1 - share + share * shape(std::min(rho, 1.0)); };
      for (int k = 0; k <= 300; ++k) {
        const double contrast = blurred_disk_contrast(10, 1.1, lit, 0.05 * k);
        const double level = (level_of(0.9 - 0.85 * contrast) - outside) / (inside - outside);
        profile.level.push_back(static_cast<float>(encoded ? level : contrast));
      }
      const RimChoice choice = choose_rim(profile, {.radius_px = 10.1,
                                                    .edge_px = 1.2,
                                                    .knot_px = 0.4,
                                                    .noise = 1e-3,
                                                    .beads = 1e6,
                                                    .background_level = encoded ? outside : 200,
                                                    .bead_level = encoded ? inside : 60,
                                                    .linear_only = !encoded});
      EXPECT_TRUE(choice.rim.good);
      EXPECT_EQ(choice.exponent, encoded ? 0.45 : 1);
      EXPECT_NEAR(choice.rim.radius_px, 10, 2e-3);
      EXPECT_NEAR(choice.rim.edge_px, 1.1, 5e-3);
      EXPECT_LT(choice.rim.misfit, 1e-4);
    }
}

// Levels encoded for display are distinguished from linear ones, but only where this is asked for.
TEST(RimChoice, TriesTheToneCurveUnlessTold) {
  BeadProfile profile = test::blurred_profile(10, 1.3, 15, 0.05);
  const auto encoded = [](double light) { return 255 * std::pow(light, 0.45); };
  const double outside = encoded(0.95), inside = encoded(0.001);
  for (float& level : profile.level)
    level = static_cast<float>((encoded(0.95 - 0.949 * static_cast<double>(level)) - outside) / (inside - outside));
  RimConditions conditions = conditions_of(10, 1.3, 0.03, 1000);
  conditions.background_level = outside, conditions.bead_level = inside;
  const RimChoice choice = choose_rim(profile, conditions);
  EXPECT_EQ(choice.exponent, 0.45);
  EXPECT_NEAR(choice.rim.radius_px, 10, 5e-3);
  EXPECT_NEAR(choice.rim.edge_px, 1.3, 0.02);
  conditions.linear_only = true;
  const RimChoice linear = choose_rim(profile, conditions);
  EXPECT_EQ(linear.exponent, 1);
  EXPECT_GT(std::abs(linear.rim.radius_px - 10), 0.03);
  // Clipped blacks fit neither curve: both are open, each by how well it does.
  BeadProfile clipped = test::blurred_profile(10, 1.3, 15, 0.05);
  for (float& level : clipped.level) level = std::min(1.0F, 1.2F * level);
  const ToneFit tone = fit_tone_exponent(clipped, 217, 20, 10, 1.3);
  EXPECT_TRUE(tone.open);
  EXPECT_GT(tone.linear.radius_px, 10.05);
  EXPECT_GT(tone.linear.misfit, 0.005);
  EXPECT_GT(std::abs(tone.encoded.radius_px - tone.linear.radius_px), 0.01);
  EXPECT_GT(tone.encoded_weight, 0.01);
  EXPECT_NEAR(tone.encoded_weight, 1 / (1 + std::pow(tone.encoded.misfit / tone.linear.misfit, 3)), 1e-12);
  EXPECT_NEAR(tone.radius_px,
              tone.linear.radius_px + tone.encoded_weight * (tone.encoded.radius_px - tone.linear.radius_px), 1e-12);
  EXPECT_NEAR(tone.std_error_px,
              std::sqrt(tone.encoded_weight * (1 - tone.encoded_weight)) *
                  std::abs(tone.encoded.radius_px - tone.linear.radius_px),
              1e-12);
  // A linear rim is not open, nor is one whose bead is not flat.
  const ToneFit plain = fit_tone_exponent(test::blurred_profile(10, 1.3, 15, 0.05), 200, 60, 10, 1.3);
  EXPECT_FALSE(plain.open);
  EXPECT_TRUE(plain.linear.good);
  EXPECT_NEAR(plain.radius_px, 10, 3e-3);
  EXPECT_NEAR(plain.linear.edge_px, 1.3, 5e-3);
  EXPECT_EQ(plain.encoded_weight, 0);
}

// --- free rims -------------------------------------------------------------------------------------------------------

// A lone bead on a background that is off by 0.05 faces it with all 16 sectors; a neighbour that touches takes some; a
// bead too near to a side of the frame has none. The profile is that of the bead, from its own background.
TEST(FreeRim, IsOfSectorsThatFaceOpenBackground) {
  constexpr double radius = 14, edge = 0.9;
  const double zone = radius + 5.5 * edge + 2;
  const BeadProfile bead = test::blurred_profile(radius, edge, radius + 6);
  const auto level = [&](double r) { return value_at(bead.level, bead.step_px, r); };
  const auto found = [&](const std::vector<ModelDisk>& disks, double background, int width = 81, int height = 61) {
    const GrayFrame flat = frame_by(width, height, [&](int column, int row) {
      double sum = background;
      for (const ModelDisk& disk : disks) sum += level(std::hypot(column - disk.x, row - disk.y));
      return sum;
    });
    return learn_free_rim({flat}, {&disks}, radius, edge);
  };
  const FreeRim lone = found({disk_at(40.3, 30.1)}, 0.05);
  EXPECT_EQ(lone.sectors, 16U);
  EXPECT_NEAR(lone.inner_px, radius - 0.35 * radius, 1e-12);
  EXPECT_NEAR(lone.profile.step_px, 0.2, 1e-12);
  for (double r = lone.inner_px + 0.2; r < zone - 0.3; r += 0.23)
    EXPECT_NEAR(value_at(lone.profile.level, lone.profile.step_px, r), level(r), 0.012) << r;
  EXPECT_NEAR(lone.profile.level[0], 1, 0.01) << "inside what is known the level goes on";
  EXPECT_EQ(found({disk_at(40.3, 30.1)}, 0.25).sectors, 0U) << "no background";
  // The neighbour takes asin((R + 3 e + 1)/29) = 38 degrees and half a sector either side of its direction: 4 of 16.
  EXPECT_EQ(found({disk_at(35, 30), disk_at(64, 30)}, 0, 101, 61).sectors, 24U);
  for (const auto& [x, y] :
       {std::array{zone - 0.1, 30.0}, {80 - zone + 0.1, 30.0}, {40.0, zone - 0.1}, {40.0, 60 - zone + 0.1}})
    EXPECT_EQ(found({disk_at(x, y)}, 0).sectors, 0U) << x << ' ' << y;
  for (const auto& [x, y] :
       {std::array{zone + 0.1, 30.0}, {80 - zone - 0.1, 30.0}, {40.0, zone + 0.1}, {40.0, 60 - zone - 0.1}})
    EXPECT_EQ(found({disk_at(x, y)}, 0).sectors, 16U) << x << ' ' << y;
  // Amid six, all but the first too near to the sides.
  std::vector<ModelDisk> seven = {disk_at(21.5, 21.5)};
  EXPECT_EQ(found(seven, 0, 44, 44).sectors, 16U);
  for (int k = 0; k < 6; ++k)
    seven.push_back(
        disk_at(21.5 + 29 * std::cos(k * std::numbers::pi / 3), 21.5 + 29 * std::sin(k * std::numbers::pi / 3)));
  EXPECT_EQ(found(seven, 0, 44, 44).sectors, 0U);
}

}  // namespace
}  // namespace shakebed::ingest
