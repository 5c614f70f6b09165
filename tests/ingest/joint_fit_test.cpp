// The fit of all beads of a frame, against sums over pixels done one by one.
#include "ingest/find/joint_fit.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/bead_set.hpp"
#include "ingest/find/vector_lanes.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

using test::even_frame;
using test::frame_by;

constexpr double fit_radius = 6, fit_edge = 0.9, fit_reach = 9.4;

ModelDisk model_at(double x, double y) {
  ModelDisk disk;
  disk.x = x, disk.y = y;
  return disk;
}

// In the middle, at each side and at a corner of a frame of 34 x 29 px.
constexpr int fit_width = 34, fit_height = 29;
const std::vector<std::array<double, 2>> places_in_frame = {{16.3, 14.2}, {-2.4, 13.7}, {35.1, 14.6}, {15.8, -3.3},
                                                            {17.2, 31.7}, {2.25, 1.5},  {31.4, 27.9}};

double level_of(const ProfileTable& table, double x, double y, double column, double row) {
  return table.at((column - x) * (column - x) + (row - y) * (row - y));
}

TEST(JointFit, HasATableOfTheProfile) {
  const ProfileTable table(test::blurred_profile(fit_radius, fit_edge, fit_reach), fit_radius, fit_edge, 0);
  EXPECT_NEAR(table.reach(), fit_reach, 0.021);
  for (double r = 0; r < 12; r += 0.137) {
    const double exact = r < fit_reach ? blurred_disk_contrast(
                                             fit_radius, fit_edge, [](double) { return 1.0; }, r)
                                       : 0;
    EXPECT_NEAR(table.at(r * r), exact, 3e-4) << r;
  }
}

// What two beads share: the gradient of one times that of the other, summed over a grid ten times as fine.
TEST(JointFit, KnowsHowTheGradientsOfTwoBeadsOverlap) {
  constexpr double radius = 5, edge = 1.6, reach = 10.5, grid = 0.05;
  const ProfileTable table(test::blurred_profile(radius, edge, reach), radius, edge, 0);
  const auto slope = [&](double r) {
    return r < reach ? (table.at((r + 0.01) * (r + 0.01)) - table.at((r - 0.01) * (r - 0.01))) / 0.02 : 0.0;
  };
  const auto sums = [&](double distance) {
    std::array<double, 2> sum{};
    for (double y = -reach; y < reach; y += grid)
      for (double x = distance - reach; x < reach; x += grid) {
        const double r1 = std::hypot(x, y) + 1e-9, r2 = std::hypot(x - distance, y) + 1e-9;
        if (r1 > reach || r2 > reach) continue;
        const double both = slope(r1) * slope(r2) / (r1 * r2);
        sum[0] += both * x * (x - distance), sum[1] += both * y * y;
      }
    return sum;
  };
  const double own = sums(0)[0];
  for (const double distance : {8.3, 10.0, 11.1, 14.0}) {
    const auto [along, across] = sums(distance);
    EXPECT_NEAR(table.overlap(distance).along, along / own, 0.015) << distance;
    EXPECT_NEAR(table.overlap(distance).across, across / own, 0.015) << distance;
  }
  EXPECT_LT(table.overlap(10).along, -0.2);
  EXPECT_EQ(table.overlap(2 * reach + 1).along, 0);
}

TEST(JointFit, LeavesTheFrameLessItsBeads) {
  BeadProfile profile = test::blurred_profile(fit_radius, fit_edge, fit_reach);
  for (std::size_t k = 0; k < profile.level.size(); ++k)
    profile.fourth_harmonic[k] =
        static_cast<float>(0.05 * std::exp(-std::pow((0.02 * static_cast<double>(k) - 6) / 1.2, 2)));
  BeadAsymmetry::Harmonics harmonics;
  harmonics.step_px = 0.4;
  for (std::size_t m = 0; m < BeadAsymmetry::orders; ++m)
    for (int k = 0; k < 24; ++k) {
      harmonics.cosine[m].push_back(0.02 * k * (23 - k) / 132 * std::sin(0.3 * k + static_cast<double>(m)));
      harmonics.sine[m].push_back(0.03 * k * (23 - k) / 132 * std::cos(0.2 * k + static_cast<double>(m)));
    }
  const auto asymmetry = std::make_shared<const BeadAsymmetry>(harmonics);
  for (const bool uneven : {false, true}) {
    BeadProfile one = profile;
    if (!uneven) one.fourth_harmonic.assign(one.level.size(), 0.0F);
    if (uneven) one.asymmetry = asymmetry;
    const ProfileTable table(one, fit_radius, fit_edge, 0);
    const GrayFrame flat = frame_by(fit_width, fit_height, test::scattered);
    JointFit fit(flat);
    fit.set_table(&table);
    EXPECT_EQ(fit.width(), fit_width);
    EXPECT_EQ(fit.height(), fit_height);
    EXPECT_EQ(fit.reach(), table.reach());
    for (const auto& [x, y] : places_in_frame) {
      fit.reset(flat, {model_at(x, y), model_at(x + 9, y)});
      fit.subtract(x + 9, y, -1);  // is there no more
      const GrayFrame left = fit.residual_image();
      for (int row = 0; row < fit_height; ++row)
        for (int column = 0; column < fit_width; ++column) {
          const double dx = column - x, dy = row - y, r = std::hypot(dx, dy);
          double bead = level_of(table, x, y, column, row);
          if (uneven && r < fit_reach)
            bead +=
                0.05 * std::exp(-std::pow((r - 6) / 1.2, 2)) * std::cos(4 * std::atan2(dy, dx)) + asymmetry->at(dx, dy);
          ASSERT_NEAR(left.at(column, row), static_cast<double>(flat.at(column, row)) - bead, uneven ? 4e-3 : 4e-5)
              << column << ' ' << row << " of " << x << ' ' << y;
          ASSERT_EQ(fit.residual(column, row), left.at(column, row));
        }
    }
  }
}

// Sums of squares of the model's derivatives by differences, over all pixels.
std::array<double, 3> hessian_by_differences(const ProfileTable& table, double x, double y) {
  std::array<double, 3> sums{};
  constexpr double h = 0.05;
  for (int row = 0; row < fit_height; ++row)
    for (int column = 0; column < fit_width; ++column) {
      const double by_x = (level_of(table, x + h, y, column, row) - level_of(table, x - h, y, column, row)) / (2 * h),
                   by_y = (level_of(table, x, y + h, column, row) - level_of(table, x, y - h, column, row)) / (2 * h);
      sums[0] += by_x * by_x, sums[1] += by_x * by_y, sums[2] += by_y * by_y;
    }
  return sums;
}

// A frame that is exactly a bead, started from beside it: the curvature is that of the sum of squares, and a few steps
// lead to the place.
TEST(JointFit, StepsToTheBead) {
  const ProfileTable table(test::blurred_profile(fit_radius, fit_edge, fit_reach), fit_radius, fit_edge, 0);
  for (const auto& [x, y] : places_in_frame) {
    const GrayFrame flat = frame_by(
        fit_width, fit_height, [&, x = x, y = y](int column, int row) { return level_of(table, x, y, column, row); });
    JointFit fit(flat);
    fit.set_table(&table);
    std::vector<ModelDisk> disks = {model_at(x, y)};
    fit.reset(flat, disks);
    fit.sweep(disks, 0.3, 1e-5, 0.5);
    const auto [xx, xy, yy] = hessian_by_differences(table, x, y);
    EXPECT_NEAR(disks[0].hessian_xx, xx, 0.03 * (xx + yy));
    EXPECT_NEAR(disks[0].hessian_xy, xy, 0.03 * (xx + yy));
    EXPECT_NEAR(disks[0].hessian_yy, yy, 0.03 * (xx + yy));
    for (const bool together : {false, true}) {
      disks = {model_at(x + 0.21, y - 0.17)};
      fit.reset(flat, disks);
      for (int step = 0; step < 8; ++step)
        together ? fit.step_together(flat, disks, 0.3, 0.5) : fit.sweep(disks, 0.3, 1e-5, 0.5);
      EXPECT_NEAR(disks[0].x, x, 1e-3);
      EXPECT_NEAR(disks[0].y, y, 1e-3);
      for (int row = 0; row < fit_height; ++row)
        for (int column = 0; column < fit_width; ++column) ASSERT_NEAR(fit.residual(column, row), 0, 1e-3);
    }
  }
}

// A first step is Newton's: of a bead 0.1 px away all but a hundredth of it. It is as long as is said, and no longer
// than is allowed; a bead that has rested for two sweeps is not looked at again.
TEST(JointFit, BoundsItsStepsAndLeavesWhatRestsAlone) {
  const ProfileTable table(test::blurred_profile(fit_radius, fit_edge, fit_reach), fit_radius, fit_edge, 0);
  const GrayFrame flat =
      frame_by(fit_width, fit_height, [&](int column, int row) { return level_of(table, 16, 14, column, row); });
  JointFit fit(flat);
  fit.set_table(&table);
  std::vector<ModelDisk> disks = {model_at(16.06, 14.08)};
  fit.reset(flat, disks);
  const double moved = fit.sweep(disks, 0.5, 1e-4, 0.5);
  EXPECT_NEAR(moved, 0.1, 2e-3);
  EXPECT_EQ(disks[0].last_step, moved);
  EXPECT_NEAR(std::hypot(disks[0].x - 16.06, disks[0].y - 14.08), moved, 1e-9);
  EXPECT_EQ(disks[0].quiet_sweeps, 0);
  for (int sweep = 0; sweep < 8; ++sweep) fit.sweep(disks, 0.5, 1e-4, 0.5);
  EXPECT_GE(disks[0].quiet_sweeps, 2);
  const std::size_t steps = fit.steps();
  EXPECT_EQ(fit.sweep(disks, 0.5, 1e-4, 0.5), 0);
  EXPECT_EQ(fit.steps(), steps);

  for (const bool together : {false, true}) {
    disks = {model_at(17.2, 12.4)};
    fit.reset(flat, disks);
    const double length = together ? fit.step_together(flat, disks, 0.25, 2) : fit.sweep(disks, 0.25, 1e-4, 2);
    EXPECT_NEAR(length, 0.25, 1e-12);
    EXPECT_NEAR(disks[0].last_step, 0.25, 1e-12);
    EXPECT_NEAR(std::hypot(disks[0].x - 17.2, disks[0].y - 12.4), 0.25, 1e-9);
    EXPECT_EQ(fit.steps(), steps + (together ? 2 : 1));
  }
  // Where nothing of the bead is in the frame there is nothing to follow.
  disks = {model_at(-30, 14)};
  EXPECT_EQ(fit.sweep(disks, 0.5, 1e-4, 0.5), 0);
  EXPECT_EQ(disks[0].last_step, 0);
  EXPECT_EQ(disks[0].quiet_sweeps, 1);
  EXPECT_EQ(disks[0].x, -30);
}

// What lies beside a bead pulls at it with at most the bound; what is unseen does not pull at all.
TEST(JointFit, IsPulledByWhatIsNoBeadWithTheBoundAtMost) {
  const ProfileTable table(test::blurred_profile(fit_radius, fit_edge, fit_reach), fit_radius, fit_edge, 0);
  const auto step_with = [&](double dirt, double bound) {
    GrayFrame flat =
        frame_by(fit_width, fit_height, [&](int column, int row) { return level_of(table, 16, 14, column, row); });
    for (int row = 12; row < 17; ++row) test::set(flat, 22, row, dirt + level_of(table, 16, 14, 22, row));
    JointFit fit(flat);
    fit.set_table(&table);
    std::vector<ModelDisk> disks = {model_at(16, 14)};
    fit.reset(flat, disks);
    fit.sweep(disks, 5, 1e-5, bound);
    return disks[0].x - 16;
  };
  const double by_a_tenth = step_with(0.1, 0.4);
  EXPECT_GT(by_a_tenth, 0.005);
  EXPECT_NEAR(step_with(0.2, 0.4), 2 * by_a_tenth, 1e-6);
  EXPECT_NEAR(step_with(5, 0.4), 4 * by_a_tenth, 1e-6);
  EXPECT_NEAR(step_with(-5, 0.4), -4 * by_a_tenth, 1e-6);
  EXPECT_NEAR(step_with(unseen_level, 0.4), 0, 1e-6);
}

GrayFrame shown_by(const ProfileTable& table, const std::vector<ModelDisk>& disks, int width, int height) {
  return frame_by(width, height, [&](int column, int row) {
    double sum = 0;
    for (const ModelDisk& disk : disks) sum += level_of(table, disk.x, disk.y, column, row);
    return sum;
  });
}

// Three beads in a row that blur makes share pixels, all moved by something else: two steps together leave a hundredth
// of it, for their coupling is known.
TEST(JointFit, TakesCoupledBeadsTogether) {
  constexpr double radius = 5, edge = 1.6;
  const ProfileTable table(test::blurred_profile(radius, edge, 10.5), radius, edge, 0);
  const std::vector<ModelDisk> truth = {model_at(18, 19), model_at(25.2, 25.9), model_at(35.1, 24.6)};
  const GrayFrame flat = shown_by(table, truth, 55, 45);
  JointFit fit(flat);
  fit.set_table(&table);
  std::vector<ModelDisk> disks = truth;
  disks[0].x += 0.1, disks[0].y += 0.08, disks[1].x -= 0.12, disks[1].y += 0.05, disks[2].y -= 0.1;
  fit.reset(flat, disks);
  const double first = fit.step_together(flat, disks, 1, 1);
  EXPECT_GT(first, 0.09);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(disks[k].x, truth[k].x, 0.006);
    EXPECT_NEAR(disks[k].y, truth[k].y, 0.006);
  }
  fit.step_together(flat, disks, 1, 1);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(disks[k].x, truth[k].x, 4e-4);
    EXPECT_NEAR(disks[k].y, truth[k].y, 4e-4);
  }
}

// Beads whose last move was below `still` stay, but for those that share pixels with one that moves.
TEST(JointFit, MovesThoseThatMovedAndTheirNeighbours) {
  const ProfileTable table(test::blurred_profile(fit_radius, fit_edge, fit_reach), fit_radius, fit_edge, 0);
  // Two that touch, a third farther away, and one that moves beside the first; then five more that rest.
  std::vector<ModelDisk> truth = {model_at(20, 20), model_at(32.1, 20), model_at(20, 60), model_at(60, 60),
                                  model_at(60, 20)};
  const GrayFrame flat = frame_by(80, 80, [&](int column, int row) {
    double sum = 0;
    for (const ModelDisk& disk : truth) sum += level_of(table, disk.x, disk.y, column, row);
    return sum;
  });
  JointFit fit(flat);
  fit.set_table(&table);
  for (const std::size_t moving : {0U, 1U, 2U}) {
    std::vector<ModelDisk> disks = truth;
    for (ModelDisk& disk : disks) disk.x += 0.1, disk.last_step = 1e-4;
    disks[moving].last_step = 0.1;
    fit.reset(flat, disks);
    fit.step_together(flat, disks, 1, 1, 0.01);
    for (std::size_t k = 0; k < truth.size(); ++k) {
      const bool moves = k == moving || (moving < 2 && k < 2);
      EXPECT_NEAR(disks[k].x - truth[k].x, moves ? 0 : 0.1, moves ? 0.02 : 1e-12) << moving << ' ' << k;
      EXPECT_NEAR(disks[k].last_step, moves ? 0.1 : 1e-4, moves ? 0.02 : 1e-12) << moving << ' ' << k;
    }
    // The residual is that of the places as they are now, whether a few were moved or all.
    JointFit again(flat);
    again.set_table(&table);
    again.reset(flat, disks);
    for (int row = 0; row < 80; ++row)
      for (int column = 0; column < 80; ++column)
        ASSERT_NEAR(fit.residual(column, row), again.residual(column, row), 2e-5);
  }
}

// A bead that is woken by one that moved takes part with it, although another of its neighbours rests and stays.
TEST(JointFit, CouplesABeadBesideOneThatRests) {
  constexpr double radius = 5, edge = 1.6;
  const ProfileTable table(test::blurred_profile(radius, edge, 10.5), radius, edge, 0);
  const std::vector<ModelDisk> truth = {model_at(32, 14), model_at(16, 22), model_at(38.6, 22.2)};
  const GrayFrame flat = shown_by(table, truth, 56, 40);
  JointFit fit(flat);
  fit.set_table(&table);
  std::vector<ModelDisk> disks = truth;
  for (ModelDisk& disk : disks) disk.last_step = 1e-4;
  disks[0].x += 0.1, disks[0].y += 0.12;
  disks[2].x -= 0.1, disks[2].y -= 0.12, disks[2].last_step = 0.1;
  fit.reset(flat, disks);
  fit.step_together(flat, disks, 1, 1, 0.01);
  EXPECT_EQ(disks[1].x, truth[1].x) << "it rests";
  EXPECT_EQ(disks[1].last_step, 1e-4);
  for (const std::size_t k : {0U, 2U}) {
    EXPECT_NEAR(disks[k].x, truth[k].x, 0.006) << k;
    EXPECT_NEAR(disks[k].y, truth[k].y, 0.006) << k;
  }
}

// The inverse of the whole matrix of second derivatives, of a lone bead, of two and of three in a row.
TEST(JointFit, KnowsTheCovarianceOfCentresThatShareTheirPixels) {
  constexpr double radius = 5, edge = 1.6;
  const ProfileTable table(test::blurred_profile(radius, edge, 10.5), radius, edge, 0);
  const std::vector<ModelDisk> all = {model_at(18, 19), model_at(24.9, 26.2), model_at(32.3, 33.1)};
  constexpr int width = 55, height = 52;
  for (const std::size_t beads : {1U, 2U, 3U}) {
    std::vector<ModelDisk> disks(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(beads));
    const auto model = [&](int column, int row) {
      double sum = 0;
      for (const ModelDisk& disk : disks) sum += level_of(table, disk.x, disk.y, column, row);
      return sum;
    };
    const GrayFrame flat = frame_by(width, height, model);
    JointFit fit(flat);
    fit.set_table(&table);
    fit.reset(flat, disks);
    fit.sweep(disks, 1, 1e-5, 1);
    std::vector<std::vector<double>> matrix(2 * beads, std::vector<double>(2 * beads, 0.0));
    for (int row = 0; row < height; ++row)
      for (int column = 0; column < width; ++column) {
        std::vector<double> slope;
        constexpr double h = 0.05;
        for (const ModelDisk& disk : disks) {
          slope.push_back(
              (level_of(table, disk.x + h, disk.y, column, row) - level_of(table, disk.x - h, disk.y, column, row)) /
              (2 * h));
          slope.push_back(
              (level_of(table, disk.x, disk.y + h, column, row) - level_of(table, disk.x, disk.y - h, column, row)) /
              (2 * h));
        }
        for (std::size_t a = 0; a < slope.size(); ++a)
          for (std::size_t b = 0; b < slope.size(); ++b) matrix[a][b] += slope[a] * slope[b];
      }
    const auto inverse = test::inverse_of(matrix);
    const auto covariances = fit.covariances(disks);
    ASSERT_EQ(covariances.size(), beads);
    for (std::size_t k = 0; k < beads; ++k) {
      const double scale = inverse[0][0];
      EXPECT_NEAR(covariances[k].xx, inverse[2 * k][2 * k], 0.03 * scale) << beads << ' ' << k;
      EXPECT_NEAR(covariances[k].xy, inverse[2 * k][2 * k + 1], 0.03 * scale) << beads << ' ' << k;
      EXPECT_NEAR(covariances[k].yy, inverse[2 * k + 1][2 * k + 1], 0.03 * scale) << beads << ' ' << k;
    }
  }
}

// Of a chain of three beads the ends share no pixels. What an end does not know of the other one is in its error all
// the same, whatever the curvature of each, as that of a bead in a corner: the inverse of the whole matrix.
TEST(JointFit, KnowsTheCovarianceOfTheEndsOfAChain) {
  constexpr double radius = 5, edge = 1.6, reach = 9.4;
  const ProfileTable table(test::blurred_profile(radius, edge, reach), radius, edge, 0);
  std::vector<ModelDisk> disks = {model_at(20, 20), model_at(28.3, 24.9), model_at(37.2, 28.6)};
  EXPECT_GT(std::hypot(disks[2].x - disks[0].x, disks[2].y - disks[0].y), 2 * reach);
  disks[0].hessian_xx = 3, disks[0].hessian_xy = 1.1, disks[0].hessian_yy = 2;
  disks[1].hessian_xx = 2.2, disks[1].hessian_xy = -0.6, disks[1].hessian_yy = 2.7;
  disks[2].hessian_xx = 1.4, disks[2].hessian_xy = 0.7, disks[2].hessian_yy = 2.4;
  std::vector<std::vector<double>> matrix(6, std::vector<double>(6, 0.0));
  for (std::size_t k = 0; k < 3; ++k) {
    matrix[2 * k][2 * k] = disks[k].hessian_xx, matrix[2 * k + 1][2 * k + 1] = disks[k].hessian_yy;
    matrix[2 * k][2 * k + 1] = matrix[2 * k + 1][2 * k] = disks[k].hessian_xy;
  }
  for (std::size_t k = 0; k < 2; ++k) {  // along the line of centres and across it, of the mean curvature of both
    const ModelDisk &one = disks[k], &other = disks[k + 1];
    const double away = std::hypot(other.x - one.x, other.y - one.y);
    const std::array<double, 2> unit = {(other.x - one.x) / away, (other.y - one.y) / away};
    const auto [along, across] = table.overlap(away);
    EXPECT_GT(std::abs(along), 0.1);
    const double mean = std::sqrt((one.hessian_xx + one.hessian_yy) / 2 * (other.hessian_xx + other.hessian_yy) / 2);
    for (std::size_t a = 0; a < 2; ++a)
      for (std::size_t b = 0; b < 2; ++b)
        matrix[2 * k + a][2 * k + 2 + b] = matrix[2 * k + 2 + a][2 * k + b] =
            mean * (along * unit[a] * unit[b] + across * ((a == b ? 1 : 0) - unit[a] * unit[b]));
  }
  JointFit fit(even_frame(55, 52, 0));
  fit.set_table(&table);
  const auto covariances = fit.covariances(disks);
  const auto inverse = test::inverse_of(matrix);
  for (std::size_t k = 0; k < 3; ++k) {
    const double scale = 1e-3 * inverse[2 * k][2 * k];
    EXPECT_NEAR(covariances[k].xx, inverse[2 * k][2 * k], scale) << k;
    EXPECT_NEAR(covariances[k].xy, inverse[2 * k][2 * k + 1], scale) << k;
    EXPECT_NEAR(covariances[k].yy, inverse[2 * k + 1][2 * k + 1], scale) << k;
  }
}

// Two cut beads whose shared part outweighs what each has along one axis: each has the error of its own Hessian.
TEST(JointFit, HasTheErrorOfOneBeadWhereTwoShareTooMuch) {
  const ProfileTable table(test::blurred_profile(fit_radius, fit_edge, fit_reach), fit_radius, fit_edge, 0);
  JointFit fit(even_frame(fit_width, fit_height, 0));
  fit.set_table(&table);
  std::vector<ModelDisk> disks = {model_at(16, 14), model_at(16.02, 14)};
  disks[0].hessian_xx = 0.02, disks[0].hessian_yy = 9;
  disks[1].hessian_xx = 8, disks[1].hessian_yy = 0.025;
  const auto both = fit.covariances(disks);
  ASSERT_EQ(both.size(), 2U);
  const double factor = both[0].xx * 0.02;  // of all, from the table
  EXPECT_GT(factor, 0);
  EXPECT_NEAR(both[0].yy, factor / 9, 1e-9);
  EXPECT_NEAR(both[1].xx, factor / 8, 1e-9);
  EXPECT_NEAR(both[1].yy, factor / 0.025, 1e-9);
  EXPECT_NEAR(both[0].xy, 0, 1e-12);
}

// A bead that explains all but a quarter of itself: the shares of the worst and of the best quarter, and the whole.
TEST(JointFit, JudgesTheQuartersOfABead) {
  const ProfileTable table(test::blurred_profile(fit_radius, fit_edge, fit_reach), fit_radius, fit_edge, 0);
  for (const int dim_right : {0, 1})
    for (const int dim_lower : {0, 1}) {
      const GrayFrame flat = frame_by(fit_width, fit_height, [&](int column, int row) {
        const double level = level_of(table, 16.4, 14.4, column, row);
        const bool dim = (column > 16.4) == (dim_right == 1) && (row > 14.4) == (dim_lower == 1);
        return dim ? 0.5 * level : level;
      });
      JointFit fit(flat);
      fit.set_table(&table);
      std::vector<ModelDisk> disks = {model_at(16.4, 14.4)};
      fit.reset(flat, disks);
      fit.judge(disks, 7);
      EXPECT_NEAR(disks[0].rim_explained, 0.75, 4e-3);  // its own level is that of the table's cell
      EXPECT_NEAR(disks[0].best_explained, 1, 1e-4);
      EXPECT_NEAR(disks[0].explained, 1 - 0.25 / 4, 0.012);  // its quarter of the pixels
      EXPECT_NEAR(disks[0].amplitude, 1 - 0.5 / 4, 0.012);
    }
  JointFit nothing(even_frame(20, 20, 0));
  nothing.set_table(&table);
  std::vector<ModelDisk> away = {model_at(-40, 10)};
  nothing.judge(away, 7);
  EXPECT_EQ(away[0].explained, 0);
  EXPECT_EQ(away[0].amplitude, 0);
}

// 2 x 2 pixels at a time: only where their mean exceeds the level; an odd row and column at the end are left out.
TEST(JointFit, CountsStrongPixels) {
  GrayFrame flat = even_frame(7, 5, 0);
  test::set(flat, 2, 2, 1.6), test::set(flat, 3, 2, 0.5);  // mean 0.525
  test::set(flat, 0, 0, 1.9);                              // mean 0.475
  test::set(flat, 4, 0, 2.1), test::set(flat, 5, 1, 0.1);  // mean 0.55
  test::set(flat, 6, 0, 9), test::set(flat, 0, 4, 9);
  const JointFit fit(flat);
  EXPECT_EQ(fit.strong_pixels(0.5F), 8);
  EXPECT_EQ(fit.strong_pixels(0.47F), 12);
  EXPECT_EQ(fit.strong_pixels(0.54F), 4);
  test::set(flat, 3, 2, unseen_level);
  EXPECT_EQ(JointFit(flat).strong_pixels(0.5F), 4);
}

// --- bead_set.hpp ----------------------------------------------------------------------------------------------------

const ProfileTable& set_table() {
  static const ProfileTable table(test::blurred_profile(fit_radius, fit_edge, fit_reach), fit_radius, fit_edge, 0);
  return table;
}
GrayFrame frame_of_beads(int width, int height, const std::vector<ModelDisk>& disks) {
  return frame_by(width, height, [&](int column, int row) {
    double sum = 0;
    for (const ModelDisk& disk : disks) sum += level_of(set_table(), disk.x, disk.y, column, row);
    return sum;
  });
}

TEST(BeadSet, IsSortedFromTheTopThenFromTheLeft) {
  const auto disks = disks_at({{5, 9, 1}, {8, 2, 1}, {3, 9, 1}});
  ASSERT_EQ(disks.size(), 3U);
  EXPECT_EQ(disks[0].x, 8);
  EXPECT_EQ(disks[0].y, 2);
  EXPECT_EQ(disks[1].x, 3);
  EXPECT_EQ(disks[2].x, 5);
}

// One that explains too little, and the worse of two in one place, whichever of them is the higher; those that touch
// stay. What is taken out is in the residual again, and what lies near it is to be fitted again.
TEST(BeadSet, IsPrunedOfPoorBeadsAndOfTheWorseOfTwo) {
  const double near = 2 * fit_radius * 0.72;
  for (const bool upper_worse : {true, false}) {
    std::vector<ModelDisk> disks = {model_at(20, 20), model_at(20, 20 + near - 0.1),
                                    model_at(50, 20), model_at(50, 20 + near + 0.1),
                                    model_at(80, 20), model_at(110, 60)};
    for (ModelDisk& disk : disks) disk.explained = 0.9, disk.last_step = 0.001;
    disks[upper_worse ? 0 : 1].explained = 0.8;
    disks[4].explained = 0.34;
    JointFit fit(even_frame(130, 80, 0));
    fit.set_table(&set_table());
    fit.reset(even_frame(130, 80, 0), disks);
    EXPECT_EQ(prune(fit, disks, fit_radius, 0.35), 2U);
    ASSERT_EQ(disks.size(), 4U);
    EXPECT_EQ(disks[0].y, upper_worse ? 20 + near - 0.1 : 20);
    EXPECT_EQ(disks[1].x, 50);
    EXPECT_EQ(disks[2].x, 50);
    EXPECT_EQ(disks[3].x, 110);
    EXPECT_NEAR(fit.residual(80, 20), 0, 1e-5);
    EXPECT_NEAR(fit.residual(110, 60), -level_of(set_table(), 110, 60, 110, 60), 1e-5);
    EXPECT_EQ(disks[0].last_step, ModelDisk().last_step);
    EXPECT_EQ(disks[1].last_step, 0.001);
    EXPECT_EQ(disks[3].last_step, 0.001);
  }
  // Exactly the least is enough, and nothing else is changed then.
  std::vector<ModelDisk> fine = {model_at(20, 20), model_at(32, 20)};
  fine[0].explained = fine[1].explained = 0.35;
  JointFit fit(even_frame(60, 40, 0));
  fit.set_table(&set_table());
  fit.reset(even_frame(60, 40, 0), fine);
  EXPECT_EQ(prune(fit, fine, fit_radius, 0.35), 0U);
}

// Of three beads one is missing and another 2 px off: both are seen in what is left, and put right.
TEST(BeadSet, IsRepairedByWhatShowsInTheResidual) {
  const std::vector<ModelDisk> truth = {model_at(24, 24), model_at(60, 24), model_at(24, 60), model_at(60, 60)};
  const GrayFrame flat = frame_of_beads(85, 85, truth);
  JointFit fit(flat);
  fit.set_table(&set_table());
  std::vector<ModelDisk> disks = {truth[0], truth[1], truth[3]};
  for (ModelDisk& disk : disks) disk.last_step = 0.001, disk.quiet_sweeps = 3;
  fit.reset(flat, disks);
  fit.judge(disks, fit_radius + 1);
  EXPECT_EQ(repair(fit, disks, fit_radius, 0.02), 1U);
  ASSERT_EQ(disks.size(), 4U);
  EXPECT_NEAR(disks[2].x, 24, 0.3);
  EXPECT_NEAR(disks[2].y, 60, 0.3);
  EXPECT_LT(disks[2].former_unexplained, 0);
  EXPECT_EQ(disks[0].quiet_sweeps, 0);
  EXPECT_EQ(disks[3].quiet_sweeps, 0);

  disks = {truth[0], model_at(63, 24), truth[2], truth[3]};
  fit.reset(flat, disks);
  fit.judge(disks, fit_radius + 1);
  const double unexplained = 1 - disks[1].explained;
  EXPECT_GT(unexplained, 0.1);
  EXPECT_EQ(repair(fit, disks, fit_radius, 0.02), 1U);
  ASSERT_EQ(disks.size(), 4U);
  EXPECT_NEAR(disks[1].x, 60, 0.3);
  EXPECT_EQ(disks[1].former_x, 63);
  EXPECT_EQ(disks[1].former_y, 24);
  EXPECT_NEAR(disks[1].former_unexplained, unexplained, 1e-12);

  disks = truth;
  fit.reset(flat, disks);
  fit.judge(disks, fit_radius + 1);
  EXPECT_EQ(repair(fit, disks, fit_radius, 0.02), 0U);
  EXPECT_EQ(disks.size(), 4U);
}

// Two disks three eighths of the typical distance apart are taken out for one between them, where the brighter is;
// those as near as others are, and all where most overlap, stay.
TEST(BeadSet, OffersOneDiskInPlaceOfTwoThatAreMuchNearerThanOthers) {
  const double apart = 2.4 * fit_radius;
  std::vector<ModelDisk> disks;
  for (int k = 0; k < 12; ++k) disks.push_back(model_at(20 + apart * (k % 4), 20 + apart * (k / 4)));
  disks.push_back(model_at(disks[5].x + 0.72 * apart, disks[5].y + 0.17 * apart));
  disks.back().amplitude = 0.5;
  disks.erase(disks.begin() + 6);
  std::vector<ModelDisk> left = disks;
  const std::vector<DoubledDisks> doubled = doubled_disks(left, fit_radius);
  ASSERT_EQ(doubled.size(), 1U);
  EXPECT_EQ(left.size(), 10U);
  EXPECT_NEAR(doubled[0].merged.x, disks[5].x + 0.72 * apart / 3, 1e-9);
  EXPECT_NEAR(doubled[0].merged.y, disks[5].y + 0.17 * apart / 3, 1e-9);
  disks.back().x = disks[5].x + 0.74 * apart;
  EXPECT_TRUE(doubled_disks(disks, fit_radius).empty());
  for (ModelDisk& disk : disks) disk.x *= 0.8, disk.y *= 0.8;
  disks.back().x = disks[5].x + 0.5 * apart;
  EXPECT_TRUE(doubled_disks(disks, fit_radius).empty()) << "most are nearer than a diameter";
}

// A suspect in whose place nothing is seen goes back; one cut by a side of the frame is none.
TEST(BeadSet, KeepsASuspectInWhosePlaceNothingShows) {
  for (const std::array<double, 2>& cut : {std::array{5.5, 40.0}, {74.5, 40.0}, {40.0, 5.5}, {40.0, 74.5}}) {
    const std::vector<ModelDisk> truth = {model_at(cut[0], cut[1]), model_at(40, 40), model_at(20, 20),
                                          model_at(60, 20), model_at(20, 60)};
    GrayFrame flat = frame_of_beads(81, 81, truth);
    for (int row = 0; row < 81; ++row)
      for (int column = row % 2; column < 81; column += 2)
        if (std::hypot(column - 40, row - 40) < 8 || std::hypot(column - cut[0], row - cut[1]) < 10)
          test::set(flat, column, row, 0.45 * static_cast<double>(flat.at(column, row)));
    JointFit fit(flat);
    fit.set_table(&set_table());
    std::vector<ModelDisk> disks = truth;
    fit.reset(flat, disks);
    fit.judge(disks, fit_radius + 1);
    EXPECT_GT(1 - disks[0].explained, 0.1);
    EXPECT_GT(1 - disks[1].explained, 0.1);
    EXPECT_EQ(repair(fit, disks, fit_radius, 0.02), 1U) << cut[0] << ' ' << cut[1];
    ASSERT_EQ(disks.size(), 5U);
    JointFit again(flat);
    again.set_table(&set_table());
    again.reset(flat, disks);
    for (int row = 0; row < 81; ++row)
      for (int column = 0; column < 81; ++column)
        ASSERT_NEAR(fit.residual(column, row), again.residual(column, row), 1e-4);
  }
}

// Moved on suspicion: it goes back unless what it left unexplained has fallen to 0.7 of before.
TEST(BeadSet, SettlesWhatWasMoved) {
  const GrayFrame flat = frame_of_beads(60, 50, {model_at(24, 24)});
  JointFit fit(flat);
  fit.set_table(&set_table());
  std::vector<ModelDisk> disks = {model_at(25, 24)};
  fit.reset(flat, disks);
  fit.judge(disks, fit_radius + 1);
  const double unexplained = 1 - disks[0].explained;
  EXPECT_FALSE(settle(fit, disks, fit_radius)) << "was not moved";
  for (const bool better : {true, false}) {
    disks = {model_at(25, 24)};
    disks[0].former_x = 22, disks[0].former_y = 23;
    disks[0].former_unexplained = unexplained / (better ? 0.69 : 0.71);
    disks[0].quiet_sweeps = 2, disks[0].last_step = 0.001;
    fit.reset(flat, disks);
    EXPECT_EQ(settle(fit, disks, fit_radius), !better);
    EXPECT_EQ(disks[0].x, better ? 25 : 22);
    EXPECT_EQ(disks[0].y, better ? 24 : 23);
    EXPECT_EQ(disks[0].quiet_sweeps, better ? 2 : 0);
    EXPECT_EQ(disks[0].last_step, better ? 0.001 : ModelDisk().last_step);
    EXPECT_EQ(disks[0].former_unexplained, -1);
    EXPECT_NEAR(fit.residual(24, 24),
                level_of(set_table(), 24, 24, 24, 24) - level_of(set_table(), disks[0].x, disks[0].y, 24, 24), 1e-4);
    EXPECT_GT(1 - disks[0].explained, (better ? 0.99 : 1.2) * unexplained) << "was not judged in its place";
  }
}

// The ring from 0.5 px outside the edge to 1.35 radii (1.5 px at least), in the frame alone, counted pixel by pixel.
TEST(BeadSet, CountsWhatIsUnexplainedAroundADisk) {
  const GrayFrame flat = frame_by(40, 36, [](int column, int row) { return 0.9 * test::scattered(column, row); });
  for (const double radius : {4.0, 9.0})
    for (const double noise : {0.02, 0.2})
      for (const auto& [x, y] : places_in_frame) {
        const double from = radius + 0.8 + 0.5, to = std::max(from + 1.5, 1.35 * radius);
        double count = 0, left = 0;
        for (int row = 0; row < 36; ++row)
          for (int column = 0; column < 40; ++column) {
            const double away = std::hypot(column - x, row - y);
            if (away < from || away > to) continue;
            ++count;
            left += static_cast<double>(flat.at(column, row)) > (noise > 0.1 ? 0.6 : 0.3);
          }
        EXPECT_NEAR(unexplained_around(JointFit(flat), model_at(x, y), radius, 0.8, noise),
                    count > 0 ? left / count : 0, 1e-9);
      }
  GrayFrame hidden = even_frame(40, 36, 1);
  EXPECT_EQ(unexplained_around(JointFit(hidden), model_at(18, 18), 6, 0.8, 0.02), 1);
  for (int column = 0; column < 40; ++column)
    for (int row = 18; row < 36; ++row) test::set(hidden, column, row, unseen_level);
  EXPECT_EQ(unexplained_around(JointFit(hidden), model_at(18, 18), 6, 0.8, 0.02), 1);
  EXPECT_EQ(unexplained_around(JointFit(even_frame(40, 36, 0.29)), model_at(18, 18), 6, 0.8, 0.02), 0);
}

// True once nothing moves by more than ten tolerances; one that has far to go is swept alone, with its neighbours.
TEST(BeadSet, StepsUntilNothingMoves) {
  std::vector<ModelDisk> truth;
  for (int k = 0; k < 64; ++k) truth.push_back(model_at(12 + 15.0 * (k % 8), 12 + 15.0 * (k / 8)));
  const GrayFrame flat = frame_of_beads(130, 130, truth);
  JointFit fit(flat);
  fit.set_table(&set_table());
  std::vector<ModelDisk> disks = truth;
  disks[27].x += 1.4;
  fit.reset(flat, disks);
  EXPECT_FALSE(step_all(fit, flat, disks, {1e-3, 2, 20}));
  EXPECT_NEAR(disks[27].x, truth[27].x, 0.01) << "was swept to its place";
  EXPECT_TRUE(step_all(fit, flat, disks, {1e-3, 2, 20}));
  disks = truth;
  disks[27].x += 1.4;
  fit.reset(flat, disks);
  EXPECT_FALSE(step_all(fit, flat, disks, {1e-3, 2, 0}));
  EXPECT_NEAR(disks[27].x, truth[27].x + 0.9, 0.01) << "half a pixel a step";
}

TEST(VectorLanes, ValuesAreLoadedWithTheNextOne) {
  std::vector<float> table;
  for (int k = 0; k < 40; ++k) table.push_back(0.5F * static_cast<float>(k * k));
  const Ints cell = {0, 38, 7, 7, 1, 20, 13, 2};
  Floats here, next;
  gather_with_next(table.data(), cell, here, next);
  for (int l = 0; l < lanes; ++l) {
    EXPECT_EQ(here[l], table[static_cast<std::size_t>(cell[l])]) << l;
    EXPECT_EQ(next[l], table[static_cast<std::size_t>(cell[l]) + 1]) << l;
  }
}

}  // namespace
}  // namespace shakebed::ingest
