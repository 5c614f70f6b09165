// Floor, walls, scale and density of beds whose disks are put down by hand.
#include "ingest/profile/bed_geometry.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "ingest/profile/bed_doubts.hpp"
#include "ingest/profile/film_calibration.hpp"
#include "ingest/profile/floor.hpp"
#include "ingest/profile/measure_bed.hpp"
#include "ingest/profile/touching_distance.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

using test::any_holds;
using test::found_at;
using test::holds;

// --- floor.hpp -------------------------------------------------------------------------------------------------------

TEST(BedGeometry, AQuantileIsTheNearestRank) {
  EXPECT_EQ(quantile({}, 0.5), 0);
  EXPECT_EQ(quantile({3, 1, 2}, 0.5), 2);
  EXPECT_EQ(quantile({4, 3, 1, 2}, 0.5), 3);  // 1.5 is rounded up
  EXPECT_EQ(quantile({5, 4, 3, 1, 2}, 0.1), 1);
  EXPECT_EQ(quantile({5, 4, 3, 1, 2}, 0.95), 5);
}

// Columns of 1.5 diameters, 30 px: the lowest bottom of each frame, and of these the one that 5 % exceed.
TEST(BedGeometry, LowestPointsAreThoseOfNearlyAllFrames) {
  std::vector<FrameFindings> frames(21);
  for (std::size_t k = 0; k < 21; ++k) {
    frames[k].report.index = k;
    frames[k].disks = {found_at(10, 100), found_at(12, 200 + static_cast<double>(k)), found_at(-4, 150),
                       found_at(95, 60), found_at(70, 90)};
    frames[k].second = {found_at(50, 120 - static_cast<double>(k), 6)};
  }
  const FloorPoints points = lowest_points(frames, 20, 100);  // three columns of 33.3 px
  ASSERT_EQ(points.size(), 3U);
  EXPECT_EQ(points[0], (std::pair<double, double>{12, 210 + 19}));
  EXPECT_EQ(points[1], (std::pair<double, double>{50, 126 - 1}));
  EXPECT_EQ(points[2], (std::pair<double, double>{70, 100}));
  EXPECT_TRUE(lowest_points({}, 20, 100).empty());
  // A frame narrower than two columns is one.
  EXPECT_EQ(lowest_points(frames, 20, 59).size(), 1U);
  EXPECT_EQ(lowest_bottoms(frames[0], 0, 20, 25).y.size(), 1U);
  EXPECT_EQ(lowest_bottoms(frames[0], 0, 20, 60).y.size(), 2U);
  const LowestBottoms bottoms = lowest_bottoms(frames[4], 0.5, 20, 100);
  EXPECT_EQ(bottoms.frame, 4U);
  EXPECT_EQ(bottoms.y, (std::vector<double>{214 - 6, 122 - 25, 70 + 30 - 35}));
  EXPECT_EQ(bottom_of(bottoms)->frame, 4U);
  EXPECT_EQ(bottom_of(bottoms)->place, 208);  // three quarters of the way from the highest to the lowest
  EXPECT_FALSE(bottom_of({4, {}}));
  // The second lowest column, here the middle one, from 5 % to 95 % of the frames: 101 - 1 to 101 - 19.
  EXPECT_EQ(bottom_range(frames, 0.5, 20, 100), 18);
  EXPECT_EQ(bottom_range({frames[0]}, 0.5, 20, 100), 0);
}

// Beads on a line, a tenth of them far above it, one column without any at the floor.
TEST(BedGeometry, TheFloorIsTheLineBelowTheLowest) {
  FrameFindings frame;
  for (int k = 0; k < 20; ++k) frame.disks.push_back(found_at(15 + 30 * k, (k == 7 ? 80 : 190) + 0.02 * (15 + 30 * k)));
  const Line line = find_floor({frame}, 20, 600);
  EXPECT_NEAR(line.slope, 0.02, 1e-9);
  EXPECT_NEAR(line.offset, 200, 1e-6);
  EXPECT_NEAR(line.middle.second, 200 + 0.02 * line.middle.first, 1e-6);
  // 19 points 30 px apart, of which the spread is taken to be 0.02 px at least.
  double n = 0, x = 0, xx = 0;
  for (int k = 0; k < 20; ++k)
    if (k != 7) n += 1, x += 15 + 30 * k, xx += std::pow(15 + 30 * k, 2);
  EXPECT_NEAR(line.middle.first, x / n, 1e-9);
  EXPECT_NEAR(line.slope_std_error, 0.02 / std::sqrt(xx - x * x / n), 1e-9);
  EXPECT_NEAR(line.middle_std_error, 0.02 / std::sqrt(n), 1e-9);
  // Three points tell no slope.
  FrameFindings few;
  for (int k = 0; k < 3; ++k) few.disks.push_back(found_at(50 + 200 * k, 100 + k));
  const Line level = find_floor({few}, 20, 600);
  EXPECT_EQ(level.slope, 0);
}

// A floor that goes up and down by 6 px about 300, and beads that touch it or fly: its middle, amplitude and phase.
TEST(BedGeometry, TheFloorsMotionIsThatOfWhatTouchesIt) {
  RandomStream random(3);
  std::vector<LowestBottoms> frames;
  for (std::size_t k = 0; k < 120; ++k) {
    const double turns = 0.13 * static_cast<double>(k);
    const double floor = 300 - 6 * std::sin(2 * std::numbers::pi * (turns + 0.2));
    LowestBottoms one{k, {}};
    for (int column = 0; column < 8; ++column) one.y.push_back(floor - (column % 2 == 0 ? 0 : 30 * random.uniform()));
    frames.push_back(one);
  }
  const FloorMotion motion = find_floor_motion(frames, 20, 0.13);
  EXPECT_TRUE(motion.known);
  EXPECT_NEAR(motion.middle, 300, 0.1);
  EXPECT_NEAR(motion.amplitude, 6, 0.1);
  EXPECT_NEAR(motion.phase, 0.2, 5e-3);
  EXPECT_GE(motion.touching, 480U);
  EXPECT_LE(motion.touching, 510U);
  EXPECT_GT(motion.middle_std_error, 0);
  EXPECT_LT(motion.middle_std_error, 0.1);
  EXPECT_EQ(motion.amplitude_std_error, motion.middle_std_error);
  // Touched in less than half of the period it is not known, nor by too few.
  std::vector<LowestBottoms> rare;
  for (const LowestBottoms& one : frames) {
    const double phase = 0.13 * static_cast<double>(one.frame) - std::floor(0.13 * static_cast<double>(one.frame));
    rare.push_back(one);
    if (phase > 0.3)
      for (double& y : rare.back().y) y -= 8 + 40 * random.uniform();
  }
  EXPECT_FALSE(find_floor_motion(rare, 20, 0.13).known);
  EXPECT_FALSE(find_floor_motion({frames.begin(), frames.begin() + 3}, 20, 0.13).known);
}

// The floor that bottoms press on, by least squares with weights that fall off as a Gaussian of the gap to it; what
// lies below counts in full. Repeated until nothing changes.
std::array<double, 3> floor_through(const std::vector<LowestBottoms>& frames, double turns_per_frame,
                                    double tolerance) {
  std::array<double, 3> floor = {300, 6, 0};  // middle, sine, cosine
  for (int round = 0; round < 80; ++round) {
    std::vector<std::vector<double>> normal(3, std::vector<double>(3, 0.0));
    std::array<double, 3> right{};
    for (const LowestBottoms& frame : frames)
      for (const double y : frame.y) {
        const double angle = 2 * std::numbers::pi * turns_per_frame * static_cast<double>(frame.frame);
        const std::array<double, 3> row = {1, -std::sin(angle), -std::cos(angle)};
        const double gap = floor[0] * row[0] + floor[1] * row[1] + floor[2] * row[2] - y;
        const double weight = gap > 0 ? std::exp(-std::pow(gap / tolerance, 2)) : 1;
        for (std::size_t a = 0; a < 3; ++a) {
          right[a] += weight * row[a] * y;
          for (std::size_t b = 0; b < 3; ++b) normal[a][b] += weight * row[a] * row[b];
        }
      }
    const auto inverse = test::inverse_of(normal);
    for (std::size_t a = 0; a < 3; ++a)
      floor[a] = inverse[a][0] * right[0] + inverse[a][1] * right[1] + inverse[a][2] * right[2];
  }
  return floor;
}

// Beads come as near as 0 to 3 px to a floor that moves. With tolerances of 4 % and 2 % of a diameter the fit lies
// above it by a share of each: from both follows where it is, and the error states 0.4 of that last step and the
// scatter of what touches, which is nearer than 4 %.
TEST(BedGeometry, TheFloorsErrorIsThatOfItsToleranceAndScatter) {
  std::vector<LowestBottoms> frames;
  for (std::size_t k = 0; k < 60; ++k) {
    const double floor = 300 - 6 * std::sin(2 * std::numbers::pi * 0.17 * static_cast<double>(k));
    LowestBottoms& one = frames.emplace_back();
    one.frame = k;
    for (int column = 0; column < 6; ++column)
      one.y.push_back(floor - 3 * std::pow(test::scattered(column, static_cast<int>(k)), 2));
  }
  const auto wide = floor_through(frames, 0.17, 0.8), narrow = floor_through(frames, 0.17, 0.4);
  const double middle = 2 * narrow[0] - wide[0], sine = 2 * narrow[1] - wide[1], cosine = 2 * narrow[2] - wide[2];
  double squares = 0;
  std::size_t touching = 0;
  for (const LowestBottoms& frame : frames)
    for (const double y : frame.y) {
      const double angle = 2 * std::numbers::pi * 0.17 * static_cast<double>(frame.frame);
      const double gap = middle - sine * std::sin(angle) - cosine * std::cos(angle) - y;
      if (gap < 0.8) ++touching, squares += gap * gap;
    }
  const FloorMotion motion = find_floor_motion(frames, 20, 0.17);
  EXPECT_TRUE(motion.known);
  EXPECT_EQ(motion.touching, touching);
  EXPECT_GT(middle - narrow[0], 0.03) << "there is something to extrapolate";
  EXPECT_NEAR(motion.middle, middle, 2e-3);
  EXPECT_NEAR(motion.amplitude, std::hypot(sine, cosine), 2e-3);
  const double scatter = std::sqrt(squares) / static_cast<double>(touching), step = 0.4 * (middle - narrow[0]);
  EXPECT_GT(scatter, 0.3 * step);
  EXPECT_NEAR(motion.middle_std_error, std::hypot(scatter, step), 1e-3);
  EXPECT_EQ(motion.amplitude_std_error, motion.middle_std_error);
}

// --- bed_geometry.hpp ------------------------------------------------------------------------------------------------

FilmCalibration film_of(int width, int height) {
  FilmCalibration film;
  film.finder.width = film.recorded_width = width;
  film.finder.height = film.recorded_height = height;
  film.finder.radius_px = film.finder.rim_radius_px = 10;
  film.finder.radius_std_error_px = 0.05;
  film.finder.edge_width_px = 1.1, film.finder.noise_level = 3, film.finder.contrast_level = -140;
  film.finder.polarity = Polarity::dark_beads;
  film.options.bead_diameter_m = 2e-3;
  return film;
}
// Three rows of beads between x = 20 and 260, on a floor at y = 150.
std::vector<FrameFindings> three_rows() {
  FrameFindings frame;
  for (int row = 0; row < 3; ++row)
    for (int k = 0; k < 8; ++k) frame.disks.push_back(found_at(30 + 31.0 * k, 140 - 40.0 * row, 9));
  return {frame, frame, frame};
}

TEST(BedGeometry, IsThatOfTheDisks) {
  const FilmCalibration film = film_of(300, 200);
  auto frames = three_rows();
  frames[1].disks[4].other_size = true;
  FinderCalibration refined = film.finder;
  BedCalibration bed;
  const auto warnings = find_geometry(film, frames, refined, bed);
  EXPECT_TRUE(warnings.empty()) << warnings.front();
  EXPECT_EQ(bed.radius_px, 10);
  EXPECT_EQ(bed.radius_std_error_px, 0.05);
  EXPECT_EQ(bed.edge_width_px, 1.1);
  EXPECT_EQ(bed.noise_level, 3);
  EXPECT_EQ(bed.contrast_level, -140);
  EXPECT_EQ(bed.polarity, Polarity::dark_beads);
  EXPECT_NEAR(bed.scale_m_per_px, 1e-4, 1e-15);
  EXPECT_NEAR(bed.scale_relative_std_error, 0.005, 1e-12);
  EXPECT_FALSE(bed.scale_given);
  EXPECT_NEAR(bed.floor_px, 150, 1e-9);
  EXPECT_EQ(bed.floor_slope, 0);
  EXPECT_EQ(bed.floor_reference, FloorReference::lowest_seen);
  EXPECT_NEAR(bed.left_wall_px, 20, 1e-9);
  EXPECT_NEAR(bed.right_wall_px, 257, 1e-9);
  EXPECT_NEAR(bed.width, 237.0 / 20, 1e-9);
  EXPECT_FALSE(bed.walls_given);
  EXPECT_FALSE(bed.walls_are_frame_sides);
  EXPECT_FALSE(bed.outline_in_doubt);
  EXPECT_EQ(frames[0].disks[4].radius_px, 10);
  EXPECT_EQ(frames[1].disks[4].radius_px, 9) << "has its own";
  EXPECT_GT(bed.floor_tilt_std_error_degrees, 0);
}

TEST(BedGeometry, IsAsGiven) {
  FilmCalibration film = film_of(300, 200);
  film.options.floor_px = 152, film.options.floor_slope = 0.01;
  film.options.left_wall_px = 15, film.options.right_wall_px = 265;
  film.options.scale_m_per_px = 1.01e-4;
  auto frames = three_rows();
  FinderCalibration refined = film.finder;
  BedCalibration bed;
  EXPECT_TRUE(find_geometry(film, frames, refined, bed).empty());
  EXPECT_EQ(bed.floor_px, 152);
  EXPECT_EQ(bed.floor_slope, 0.01);
  EXPECT_EQ(bed.floor_reference, FloorReference::given);
  EXPECT_TRUE(bed.floor_given && bed.walls_given && bed.scale_given);
  EXPECT_EQ(bed.left_wall_px, 15);
  EXPECT_EQ(bed.right_wall_px, 265);
  EXPECT_NEAR(bed.width, 250 / (2e-3 / 1.01e-4), 1e-9);
  EXPECT_EQ(bed.scale_m_per_px, 1.01e-4);
  EXPECT_EQ(bed.scale_relative_std_error, 0);
  // A slope alone turns the line that was found about the middle of the frame.
  FilmCalibration tilted = film_of(300, 200);
  tilted.options.floor_slope = 0.02;
  frames = three_rows(), bed = {}, refined = tilted.finder;
  find_geometry(tilted, frames, refined, bed);
  EXPECT_EQ(bed.floor_slope, 0.02);
  EXPECT_NEAR(bed.floor_px, 150 - 0.02 * 150, 1e-9);
  EXPECT_EQ(bed.floor_tilt_std_error_degrees, 0);
}

// A scale by which beads are 24 px wide is neither that of the circles nor of contacts; one by which they are as far
// apart as nearest beads is that of contacts.
TEST(BedGeometry, AScaleThatNothingShowsIsDoubted) {
  const auto found = [](double scale) {
    FilmCalibration film = film_of(300, 200);
    film.options.scale_m_per_px = scale;
    auto frames = three_rows();
    FinderCalibration refined = film.finder;
    BedCalibration bed;
    const auto warnings = find_geometry(film, frames, refined, bed);
    return std::pair(bed, warnings);
  };
  for (const double within : {19.62, 20.39}) EXPECT_TRUE(found(2e-3 / within).second.empty()) << within;
  for (const double beyond : {19.59, 20.43}) EXPECT_EQ(found(2e-3 / beyond).second.size(), 1U) << beyond;
  const auto wrong = found(2e-3 / 24);
  ASSERT_EQ(wrong.second.size(), 1U);
  EXPECT_TRUE(holds(wrong.second[0], "a bead is 24 px wide, but the beads found are 20 px wide")) << wrong.second[0];
  EXPECT_FALSE(wrong.first.scale_of_contacts);
  const auto contacts = found(2e-3 / 31);
  ASSERT_EQ(contacts.second.size(), 1U);
  EXPECT_TRUE(holds(contacts.second[0], "The circles seen are 20 px wide. By the scale given a bead is 31 px wide"));
  EXPECT_TRUE(contacts.first.scale_of_contacts);
}

// Beads that reach beyond a side of the frame, or of the region: centres are counted from a radius inside.
TEST(BedGeometry, ABedBeyondTheSidesIsThatOfItsVisiblePart) {
  for (const bool region : {false, true})
    for (const bool on_left : {true, false}) {
      FilmCalibration film = film_of(300, 200);
      if (region) film.options.find.roi = PixelRectangle{10, 0, 270, 200};
      const double left = region ? 9.5 : -0.5, right = region ? 279.5 : 299.5;
      EXPECT_EQ(sides_of(film).left, left);
      EXPECT_EQ(sides_of(film).right, right);
      auto frames = three_rows();
      for (FrameFindings& frame : frames) frame.disks.push_back(found_at(on_left ? left + 9 : right - 9, 60));
      FinderCalibration refined = film.finder;
      BedCalibration bed;
      const auto warnings = find_geometry(film, frames, refined, bed);
      EXPECT_TRUE(bed.walls_are_frame_sides);
      EXPECT_TRUE(any_holds(warnings, "beyond the sides of the frame"));
      EXPECT_NEAR(bed.left_wall_px, on_left ? left + 10 : 20, 1e-9);
      EXPECT_NEAR(bed.right_wall_px, on_left ? 257 : right - 10, 1e-9);
      for (FrameFindings& frame : frames) frame.disks.back().x_px = on_left ? left + 9.7 : right - 9.7;
      bed = {}, refined = film.finder;
      find_geometry(film, frames, refined, bed);
      EXPECT_FALSE(bed.walls_are_frame_sides) << "within a fiftieth of a diameter";
    }
  // No disks at all: the width of the whole frame.
  FilmCalibration film = film_of(300, 200);
  std::vector<FrameFindings> nothing(2);
  FinderCalibration refined = film.finder;
  BedCalibration bed;
  EXPECT_TRUE(any_holds(find_geometry(film, nothing, refined, bed), "The side walls could not be determined"));
  EXPECT_NEAR(bed.width, 15, 1e-9);
  EXPECT_EQ(bed.left_wall_px, -0.5);
  EXPECT_EQ(bed.right_wall_px, 299.5);
}

// --- touching_distance.hpp, bed_doubts.hpp ---------------------------------------------------------------------------

// Pairs far from one another, whose distances are those at which -ln(1 - share) grows as r^2 - D^2, D = 20 px.
std::vector<FrameFindings> pairs_of_distances(std::size_t pairs, double slope, double variance,
                                              std::size_t first_frame = 0) {
  FrameFindings frame;
  frame.report.index = first_frame;
  for (std::size_t k = 0; k < pairs; ++k) {
    const double share = (static_cast<double>(k) + 0.5) / static_cast<double>(pairs);
    const double distance = std::sqrt(400 - slope * std::log1p(-share));
    frame.disks.push_back(found_at(500 + 1000.0 * static_cast<double>(k), 50));
    frame.disks.push_back(found_at(500 + 1000.0 * static_cast<double>(k) + distance, 50));
  }
  for (FoundDisk& disk : frame.disks) disk.variance_x = disk.variance_y = variance;
  return {frame};
}

TEST(TouchingDistance, OfPairsIsWhereTheirDistancesBegin) {
  const auto exact = touching_distance(pairs_of_distances(400, 90, 0), 10);
  ASSERT_TRUE(exact);
  EXPECT_NEAR(exact->px, 20, 0.02);
  EXPECT_TRUE(exact->sharp);
  // 0.4 % of it, and what chance makes of 800 distances: 0.5 slope/D sqrt(0.05/800).
  EXPECT_NEAR(exact->std_error_px, std::hypot(0.004 * 20, 0.5 * 90 / 20 * std::sqrt(0.05 / 800)), 2e-3);
  // Centres off by 0.2 px: two of them by 0.283 px, 0.01414 D; lost are 1.5 b^2/(b + 0.0035).
  const auto noisy = touching_distance(pairs_of_distances(400, 90, 0.04), 10);
  ASSERT_TRUE(noisy);
  const double blur = std::sqrt(0.08) / exact->px, lost = 1.5 * blur * blur / (blur + 0.0035);
  EXPECT_NEAR(noisy->px, exact->px * (1 + lost), 1e-9);
  EXPECT_NEAR(noisy->std_error_px, std::hypot(exact->std_error_px, 0.4 * lost * exact->px), 1e-6);
  EXPECT_FALSE(touching_distance(pairs_of_distances(49, 90, 0), 10)) << "fewer than 100 distances";
  EXPECT_TRUE(touching_distance(pairs_of_distances(50, 90, 0), 10));
  EXPECT_FALSE(touching_distance(pairs_of_distances(400, 90, 0, 10), 10)) << "the eleventh frame";
  EXPECT_TRUE(touching_distance(pairs_of_distances(400, 90, 0, 9), 10));
  EXPECT_FALSE(touching_distance(pairs_of_distances(400, 1500, 0), 10)) << "no edge";
  EXPECT_FALSE(touching_distance(pairs_of_distances(400, 90, 0), 3.9)) << "farther than five radii";
  // A few that are nearer blur the edge; others of another size are left out.
  auto blurred = pairs_of_distances(300, 90, 0);
  for (std::size_t k = 0; k < 8; k += 2) blurred[0].disks[k].x_px += 1;
  const auto soft = touching_distance(blurred, 10);
  ASSERT_TRUE(soft);
  EXPECT_FALSE(soft->sharp);
  // The least half per cent of 600 distances ends with the fourth of them, that of the second pair.
  const double below = 1 - (std::sqrt(400 - 90 * std::log1p(-1.5 / 300)) - 1) / soft->px;
  EXPECT_NEAR(soft->std_error_px,
              std::hypot(0.004 * soft->px, 0.5 * below * soft->px, 0.5 * 90 / 20 * std::sqrt(0.05 / 600)), 2e-3);
  EXPECT_GT(soft->std_error_px, 0.4);
  for (std::size_t k = 0; k < 8; ++k) blurred[0].disks[k].other_size = true;
  EXPECT_TRUE(touching_distance(blurred, 10)->sharp);
}

// The circles seen and the distance of touching beads, by their errors.
TEST(BedGeometry, WeighsTheOutlineAgainstTheDistanceOfTouchingBeads) {
  const auto found = [](double radius, double error, bool one_sided, bool with_scale = false) {
    FilmCalibration film = film_of(100000, 200);
    film.finder.radius_px = radius, film.finder.radius_std_error_px = error;
    if (one_sided) film.options.find.seen = BeadsSeen{Polarity::dark_beads, radius, true};
    if (with_scale) film.options.scale_m_per_px = 1e-4;
    auto frames = pairs_of_distances(60, 90, 0);
    FinderCalibration refined = film.finder;
    BedCalibration bed;
    const auto warnings = find_geometry(film, frames, refined, bed);
    return std::tuple(refined.radius_px, refined.radius_std_error_px, warnings);
  };
  const auto touching = touching_distance(pairs_of_distances(60, 90, 0), 10);
  ASSERT_TRUE(touching && touching->sharp);
  const double distance = touching->px, its_error = touching->std_error_px;
  {  // They agree: by inverse variances.
    const auto [radius, error, warnings] = found(0.5 * distance - 0.05, 0.1, false);
    const double share = 0.04 / (0.04 + its_error * its_error);
    EXPECT_NEAR(radius, 0.5 * distance - 0.05 + share * 0.05, 1e-9);
    EXPECT_NEAR(error, 0.1 * std::sqrt(1 - share), 1e-9);
    EXPECT_TRUE(warnings.empty());
  }
  // They agree within two errors of both together.
  for (const double errors : {1.95, 2.05}) {
    const double radius = 0.5 * (distance - errors * std::hypot(0.2, its_error));
    EXPECT_EQ(std::get<0>(found(radius, 0.1, false)) < 0.5 * distance - 1e-9, errors < 2) << errors;
  }
  // Where the outline is larger than the distance allows, by less than a hundredth of it, nothing is said.
  for (const double larger : {0.0097, 0.0103}) {
    const auto [radius, error, warnings] = found(0.5 * (1 + larger) * distance, 1e-4, false);
    EXPECT_NEAR(error, std::hypot(1e-4, 0.25 * larger * distance), 1e-9) << "they disagree";
    EXPECT_EQ(warnings.empty(), larger < 0.01);
  }
  // Of beads that are brighter on one side the outline is known to two thousandths at best, and to 15 where the other
  // side is less than a tenth as bright at the rim.
  for (const auto& [dark_side, share] : {std::pair(0.12, 0.002), std::pair(0.08, 0.015)}) {
    FilmCalibration film = film_of(300, 200);
    BeadAsymmetry::Harmonics sides;
    sides.step_px = 1;
    for (std::size_t m = 0; m < 6; ++m) sides.cosine[m].assign(14, 0.0), sides.sine[m].assign(14, 0.0);
    const double mean = 0.8;  // between the sides, whose levels have this ratio
    film.finder.profile.step_px = 1;
    film.finder.profile.level.assign(14, static_cast<float>(mean));
    sides.cosine[0].assign(14, mean * (1 - dark_side) / (1 + dark_side));
    film.finder.profile.asymmetry = std::make_shared<const BeadAsymmetry>(sides);
    auto frames = three_rows();
    FinderCalibration refined = film.finder;
    BedCalibration bed;
    find_geometry(film, frames, refined, bed);
    EXPECT_NEAR(bed.radius_std_error_px, std::hypot(0.05, 10 * share), 1e-12) << dark_side;
    EXPECT_NEAR(bed.scale_relative_std_error, std::hypot(0.005, share), 1e-12) << dark_side;
  }
  {  // The outline is clearly smaller: the distance is taken, up to 8 %.
    const auto [radius, error, warnings] = found(9.6, 0.01, false);
    EXPECT_NEAR(radius, 0.5 * distance, 1e-9);
    EXPECT_NEAR(error, 0.5 * its_error, 1e-9);
    EXPECT_TRUE(any_holds(warnings, "The outline seen is smaller than the beads"));
    EXPECT_TRUE(any_holds(warnings, "The circles seen are 19.2 px wide. Nearest beads are "));
    EXPECT_TRUE(any_holds(warnings, "mm/px"));
    EXPECT_EQ(std::get<0>(found(9.2, 0.01, false)), 9.2) << "these do not touch";
    EXPECT_TRUE(any_holds(std::get<2>(found(9.6, 0.01, false, true)), "The scale given is used"));
  }
  {  // It is clearly larger: it stands, with a quarter of the difference as error.
    const auto [radius, error, warnings] = found(10.6, 0.01, false);
    EXPECT_EQ(radius, 10.6);
    EXPECT_NEAR(error, std::hypot(0.01, 0.25 * (21.2 - distance)), 1e-9);
    EXPECT_TRUE(any_holds(warnings, "but the circles seen are 21.2 px wide. The outline is larger than the bead"));
  }
  {  // Of beads lit from one side the distance counts alone.
    const auto [radius, error, warnings] = found(8.7, 0.5, true);
    EXPECT_NEAR(radius, 0.5 * distance, 1e-9);
    EXPECT_TRUE(any_holds(warnings, "The beads are lit from one side"));
    EXPECT_TRUE(any_holds(warnings, "and this is taken for their diameter"));
  }
  // With too few of them the outline is in doubt, unless a scale is given.
  for (const bool with_scale : {false, true}) {
    FilmCalibration film = film_of(300, 200);
    film.options.find.seen = BeadsSeen{Polarity::dark_beads, 10, true};
    if (with_scale) film.options.scale_m_per_px = 1e-4;
    auto frames = three_rows();
    FinderCalibration refined = film.finder;
    BedCalibration bed;
    find_geometry(film, frames, refined, bed);
    EXPECT_EQ(bed.outline_in_doubt, !with_scale);
  }
}

// One pair at 21 px, one at 30, one at 41: with radius 10 one is a contact, one is farther, one is none.
TEST(BedDoubts, ContactsAreThePairsNearerThanElevenTenths) {
  FrameFindings frame;
  frame.disks = {found_at(0, 0),   found_at(21, 0),  found_at(0, 200), found_at(0, 230),
                 found_at(300, 0), found_at(341, 0), found_at(500, 0), found_at(500, 21)};
  frame.disks.back().other_size = true;
  const Contacts contacts = contacts_of({frame, frame}, 10);
  EXPECT_EQ(contacts.seen, 2);
  EXPECT_NEAR(contacts.expected, 2 * (22.0 * 22 - 400) / (1600 - 22.0 * 22), 1e-12);
  EXPECT_EQ(contacts.nearest_px, 30);  // 21 21 30 30 of each frame: the fifth of eight
  EXPECT_EQ(contacts.touching_px, 30);
  Contacts one{0.9, 10, 30, 30};
  EXPECT_TRUE(one.missing());
  one.seen = 1;
  EXPECT_FALSE(one.missing());
  one = {0, 9.9, 30, 30};
  EXPECT_FALSE(one.missing());
  one = {10, 10, 19.1, 19};
  EXPECT_TRUE(one.overlapping(20));
  one.nearest_px = 19.3;
  EXPECT_FALSE(one.overlapping(20));
  one = {9, 10, 19.1, 19};
  EXPECT_FALSE(one.overlapping(20));
  one = {0, 10, 28.1, 28};
  EXPECT_TRUE(one.far_apart(20));
  one.nearest_px = 27.9;
  EXPECT_FALSE(one.far_apart(20));
}

TEST(BedDoubts, TheRegionOfABedLiesBetweenItsEnds) {
  FrameFindings frame;
  for (int k = 0; k < 40; ++k) frame.disks.push_back(found_at(200 + 10 * k, 50));
  frame.disks.push_back(found_at(20, 50)), frame.disks.push_back(found_at(660, 50));
  const BedEnds ends = ends_of_bed({frame}, 8);
  EXPECT_NEAR(ends.left_px, 110, 1e-9);
  // 12 spacings of 10 px are wider than two diameters of 16: 660 - 590 is no gap.
  EXPECT_EQ(ends.right_px, HUGE_VAL);
  frame.disks.back().x_px = 725;
  EXPECT_NEAR(ends_of_bed({frame}, 8).right_px, 0.5 * (590 + 725), 1e-9);
  EXPECT_EQ(ends_of_bed({frame}, 80).right_px, HUGE_VAL) << "two diameters of 160 are wider";
  const PixelRectangle region = region_between({110.7, 400.2}, 800, 90);
  EXPECT_EQ(region.left, 110);
  EXPECT_EQ(region.top, 0);
  EXPECT_EQ(region.width, 290);
  EXPECT_EQ(region.height, 90);
  EXPECT_EQ(region_between({}, 800, 90).width, 800);
  frame.disks.resize(28);
  EXPECT_EQ(ends_of_bed({frame}, 8).left_px, -HUGE_VAL) << "too few";
}

TEST(BedDoubts, AnArcSagsByItsHeightAtTheEnds) {
  FloorPoints arc, line;
  for (int k = 0; k < 11; ++k) {
    const double u = (k - 5) / 5.0;
    arc.emplace_back(100 + 40 * k, 500 - 60 * u * u + 3 * k);
    line.emplace_back(100 + 40 * k, 500 + 3 * k + (k % 2));
  }
  EXPECT_NEAR(sag_of_floor(arc, 20), 60, 1e-6);
  EXPECT_EQ(sag_of_floor(arc, 31), 0) << "less than two diameters";
  EXPECT_EQ(sag_of_floor(line, 20), 0);
  arc.resize(9);
  EXPECT_EQ(sag_of_floor(arc, 20), 0) << "too few columns";
}

TEST(BedDoubts, ObjectionsHaveTheirLimits) {
  Measurement found;
  found.disk_total = 30;
  const auto why = [&] {
    std::string all;
    for (const Objection& one : objections_to(found)) all += one.why + " " + one.advice + "\n";
    return all;
  };
  EXPECT_EQ(why(), "");
  found.disk_total = 29;
  EXPECT_TRUE(holds(why(), "Only 29 beads"));
  found.disk_total = 30;
  found.expected_wrong = 0.06, found.finder.expected_missed = 0.05;
  EXPECT_EQ(why(), "") << "not by rims";
  found.finder.rims.emplace();
  EXPECT_TRUE(holds(why(), "About 6 % of the disks found may be wrong, and 5 % of the beads may be missed"));
  found.finder.expected_missed = 0.03;
  EXPECT_EQ(why(), "");
  found.coverage_disagreement = 0.21;
  EXPECT_EQ(why(), "") << "no coverage";
  found.coverage_profile.emplace();
  EXPECT_TRUE(holds(why(), "by 0.21 per D^2"));
  found.coverage_disagreement = 0.2;
  for (const double tilt : {-10.4, 10.4}) {
    found.calibration.floor_tilt_degrees = tilt;
    EXPECT_TRUE(holds(why(), "tilted by 10 degrees"));
  }
  found.calibration.floor_tilt_degrees = 10;
  EXPECT_EQ(why(), "");
  found.above_mirror_image = PixelRectangle{5, 20, 300, 170};
  EXPECT_TRUE(holds(why(), "those above row 190"));
  EXPECT_TRUE(holds(why(), "--roi 5,20,300,170"));
  found.above_mirror_image.reset();
  found.calibration.outline_in_doubt = true;
  EXPECT_TRUE(holds(why(), "lit from one side"));
  found.calibration.outline_in_doubt = false;
  found.surface_out_of_view = true;
  EXPECT_EQ(why(), "");
  found.floor_out_of_view = true;
  EXPECT_TRUE(holds(why(), "neither the floor nor the surface"));
  found.surface_out_of_view = false;
  EXPECT_TRUE(holds(why(), "The lower border of the frame cuts beads"));

  Measurement shaken;
  shaken.calibration.radius_px = 10;
  EXPECT_FALSE(is_shaken(shaken));
  shaken.calibration.floor_std_error_px = 5.1;
  EXPECT_TRUE(is_shaken(shaken));
  shaken.calibration.floor_std_error_px = 5;
  EXPECT_FALSE(is_shaken(shaken));
  shaken.calibration.floor_amplitude_px = 1;
  EXPECT_TRUE(is_shaken(shaken));
  shaken.calibration.floor_amplitude_px = 0;
  shaken.calibration.floor_reference = FloorReference::mean_by_amplitude;
  EXPECT_TRUE(is_shaken(shaken));
}

TEST(BedDoubts, DoubtsStateTheirNumbers) {
  Measurement found;
  found.calibration.scale_m_per_px = 1e-4;
  found.contacts = {0, 20, 32, 30};
  const auto apart = doubts_of_bed(found, 2e-3);
  ASSERT_EQ(apart.size(), 1U);
  EXPECT_TRUE(holds(apart[0], "1.60 diameters apart"));
  EXPECT_TRUE(holds(apart[0], "\"0.06667 mm/px\"")) << apart[0];
  found.contacts = {20, 20, 18, 17.6};
  const auto overlapping = doubts_of_bed(found, 2e-3);
  ASSERT_EQ(overlapping.size(), 1U);
  EXPECT_TRUE(holds(overlapping[0], "0.90 diameters apart"));
  EXPECT_TRUE(holds(overlapping[0], "\"0.1136 mm/px\"")) << overlapping[0];
  found.contacts = {};
  found.beside_bed = 3, found.bed_region = {4, 0, 90, 70}, found.floor_sag = 2.54;
  const auto more = doubts_of_bed(found, 2e-3);
  ASSERT_EQ(more.size(), 2U);
  EXPECT_TRUE(holds(more[0], "3 disks beside the bed"));
  EXPECT_TRUE(holds(more[0], "4,0,90,70"));
  EXPECT_TRUE(holds(more[1], "2.5 diameters"));
}

// In frame k of 14 the bed lies k/4 px farther to the right. The walls are where one of the frames reaches beyond: the
// second rank of 14 is the nearest to a tenth.
TEST(WallsOfFrames, AreReachedByATenthOfThem) {
  FilmCalibration film;
  film.finder.width = film.recorded_width = 300, film.finder.height = film.recorded_height = 200;
  film.finder.radius_px = film.finder.rim_radius_px = 10;
  film.finder.radius_std_error_px = 0.05;
  film.options.bead_diameter_m = 2e-3;
  std::vector<FrameFindings> frames(14);
  for (std::size_t k = 0; k < frames.size(); ++k)
    for (int row = 0; row < 3; ++row)
      for (int i = 0; i < 8; ++i)
        frames[k].disks.push_back(found_at(30 + 31.0 * i + 0.25 * static_cast<double>(k), 140 - 40.0 * row, 9));
  FinderCalibration refined = film.finder;
  BedCalibration bed;
  find_geometry(film, frames, refined, bed);
  EXPECT_NEAR(bed.left_wall_px, 20 + 0.25 * 1, 1e-9);
  EXPECT_NEAR(bed.right_wall_px, 257 + 0.25 * 12, 1e-9);
  EXPECT_FALSE(bed.walls_are_frame_sides);
}

}  // namespace
}  // namespace shakebed::ingest
