// Beads by their rims: what is learned of them and found, worked out once more from the circles of a picture.

#include "ingest/find/rim_finder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "ingest/find/circle_search.hpp"
#include "ingest/find/edge_map.hpp"
#include "ingest/find/picture_scale.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

double middle_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

constexpr double of_one_kind = 0.12, support_asked = 0.3;

// Circles within 12 % of a radius, of which two that overlap by more than a fifth are one.
std::vector<Circle> circles_near(const EdgeMap& edges, double radius, Polarity polarity, const CircleVotes& votes) {
  std::vector<Circle> circles = find_circles(edges, {0.93 * radius, 1.08 * radius, polarity, support_asked, votes});
  std::erase_if(circles, [&](const Circle& one) { return std::abs(one.radius / radius - 1) > of_one_kind; });
  return without_doubles(circles, 0.8);
}

// The circle fitted along 48 rays, where it is seen as well, in px of the frame. The scatter of independent stretches
// of its rim, 3.5 px long each, gives its variance.
RimDisk disk_by_hand(const EdgeMap& edges, const ScaledPicture& at, const Circle& circle, Polarity polarity) {
  const Circle fine = fit_circle(edges, circle, polarity, {48, 0.15, 0.07, 0.65});
  const Circle& best = fine.support > 0.7 * circle.support ? fine : circle;
  RimDisk disk;
  disk.circle = best;
  disk.circle.x = at.to_frame_x(best.x), disk.circle.y = at.to_frame_y(best.y);
  disk.circle.radius = best.radius * at.scale;
  const double stretches = best.support * std::min(2 * std::numbers::pi * best.radius / 3.5, 1.0 * best.rays);
  disk.variance_px2 = 2 * std::pow(best.scatter * best.radius * at.scale, 2) / std::max(3.0, stretches);
  return disk;
}

struct RimsByHand {
  ScaledPicture at;
  EdgeMap edges;
  std::vector<double> probability;
  double radius = 0, spread = 0, radius_error = 0, contrast = 0, open_radius = 0, edge_length = 0;
  std::vector<RimDisk> disks;

  RimsByHand(const GrayFrame& frame, Polarity polarity, double start, Known known, const RimSearch& search)
      : at(scaled_for(frame, start, search.wanted_px)), edges(find_edges(at.picture)), radius(start) {
    std::vector<EdgeMap> copies;
    for (int k = 0; k < 4; ++k)
      copies.push_back(find_edges(stretched(at.picture, 1.8, k * std::numbers::pi / 4), edges.threshold));
    std::vector<Circle> circles;
    for (int round = 0; round < 6; ++round) {  // until the radius settles within 2 %, at least twice
      const double before = radius / at.scale;
      circles = circles_near(edges, before, polarity, search.votes);
      std::vector<std::vector<Circle>> by_chance;
      for (const EdgeMap& copy : copies) by_chance.push_back(circles_near(copy, before, polarity, search.votes));
      probability = probabilities_by_support(circles, by_chance, known);
      measure(circles);
      if (round >= 1 && std::abs(radius / at.scale / before - 1) <= 0.02) break;
    }
    for (const Circle& circle : circles) {
      const double its = probability_at(probability, circle.support);
      if (its < 0.8) continue;
      disks.push_back(disk_by_hand(edges, at, circle, polarity));
      disks.back().probability = its;
    }
    std::sort(disks.begin(), disks.end(), [](const auto& a, const auto& b) { return a.circle.y < b.circle.y; });
    for (const RidgePixel& pixel : edges.ridge) {  // faint edges count in part
      const auto slope =
          static_cast<double>(edges.slope(edges.at(static_cast<int>(pixel.x), static_cast<int>(pixel.y))));
      edge_length += at.scale * std::min(1.0, 2.5 * slope / std::max(1e-6, contrast));
    }
    measure_open_sides(polarity);
  }

 private:
  void measure(const std::vector<Circle>& circles) {
    std::vector<double> radii, contrasts, off;
    for (const Circle& one : circles)
      if (probability_at(probability, one.support) >= std::min(0.9, probability.back()))
        radii.push_back(one.radius), contrasts.push_back(one.contrast);
    if (radii.empty()) return;
    const double middle = middle_of(radii);
    for (const double one : radii) off.push_back(std::abs(one - middle));
    spread = 1.4826 * middle_of(off) / middle;
    radius = middle * at.scale, contrast = middle_of(contrasts);
    radius_error = std::sqrt(std::numbers::pi / 2) * spread * radius / std::sqrt(static_cast<double>(radii.size()));
  }

  // The median distance of the edges in directions without another centre within 3.2 radii and 0.9 rad, at least five
  // directions of five circles. Smoothing, differences and pixels move a rim in by half their variance over the radius.
  void measure_open_sides(Polarity polarity) {
    std::vector<double> radii;
    std::vector<Circle> circles;
    for (const RimDisk& disk : disks) {
      circles.push_back(disk.circle);
      circles.back().x = at.from_frame_x(disk.circle.x), circles.back().y = at.from_frame_y(disk.circle.y);
      circles.back().radius /= at.scale;
    }
    for (const Circle& one : circles) {
      std::uint64_t open = 0;
      for (int k = 0; k < one.directions; ++k) {
        const double angle = 2 * std::numbers::pi * k / one.directions;
        if (std::none_of(circles.begin(), circles.end(), [&](const Circle& other) {
              const double dx = other.x - one.x, dy = other.y - one.y, away = std::hypot(dx, dy);
              return away >= 0.1 * one.radius && away <= 3.2 * one.radius &&
                     std::abs(std::remainder(std::atan2(dy, dx) - angle, 2 * std::numbers::pi)) < 0.9;
            }))
          open |= std::uint64_t{1} << static_cast<unsigned>(k);
      }
      if (const double its = radius_towards(edges, one, polarity, open, 5); its > 0) radii.push_back(its);
    }
    open_radius = radius;
    if (radii.size() < 5) return;
    const double steepest = middle_of(radii);
    open_radius = (steepest + (1 + 1.0 / 3 + 1.0 / 12) / (2 * steepest)) * at.scale;
  }
};

void expect_same_disks(const std::vector<RimDisk>& found, const std::vector<RimDisk>& expected,
                       const std::string& name) {
  ASSERT_EQ(found.size(), expected.size()) << name;
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_NEAR(found[k].circle.x, expected[k].circle.x, 1e-9) << name << ' ' << k;
    EXPECT_NEAR(found[k].circle.y, expected[k].circle.y, 1e-9) << name << ' ' << k;
    EXPECT_NEAR(found[k].circle.radius, expected[k].circle.radius, 1e-9) << name << ' ' << k;
    EXPECT_NEAR(found[k].probability, expected[k].probability, 1e-12) << name << ' ' << k;
    EXPECT_NEAR(found[k].variance_px2, expected[k].variance_px2, 1e-12) << name << ' ' << k;
    EXPECT_FALSE(found[k].other_size);
  }
}

// 5 x 4 disks `apart` px from one another, of which the radii scatter a little and two are faint.
std::vector<RenderedDisk> rimmed_disks(double radius, double apart) {
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < 20; ++k)
    disks.push_back({0.8 * apart + apart * (k % 5) + test::scattered(k, 1), 0.8 * apart + apart * (k / 5),
                     radius * (1 + 0.03 * (test::scattered(k, 2) - 0.5)), 0, 0});
  return disks;
}
GrayFrame rimmed_frame(const std::vector<RenderedDisk>& disks, double apart, double bead, double noise = 3) {
  Camera camera;
  camera.width = static_cast<int>(5.6 * apart), camera.height = static_cast<int>(4.6 * apart);
  camera.background_level = 150, camera.bead_level = bead;
  camera.blur_px = 0.8, camera.read_noise = noise;
  return render_frame(disks, camera);
}

struct RimsCase {
  double radius, apart, bead, start;
  Polarity polarity;
  Known known;
};

TEST(RimFinder, LearnsAsItsRulesSay) {
  for (const RimsCase& one : {RimsCase{8.4, 19.0, 60, 8.1, Polarity::dark_beads, Known::nothing},
                              RimsCase{6.5, 13.4, 220, 7.0, Polarity::bright_beads, Known::beads},
                              RimsCase{9.0, 22.0, 110, 8.2, Polarity::automatic, Known::radius}}) {
    const GrayFrame frame = rimmed_frame(rimmed_disks(one.radius, one.apart), one.apart, one.bead);
    const LearnedRims found = learn_rims(frame, one.polarity, one.start, one.known);
    const RimsByHand expected(frame, one.polarity, one.start, one.known, quick_search);
    const std::string name = std::to_string(one.radius);
    ASSERT_EQ(found.model.probability.size(), expected.probability.size());
    for (std::size_t k = 0; k < expected.probability.size(); ++k)
      EXPECT_NEAR(found.model.probability[k], expected.probability[k], 1e-12) << name << ' ' << k;
    EXPECT_NEAR(found.model.radius_px, expected.radius, 1e-9) << name;
    EXPECT_NEAR(found.model.radius_spread, expected.spread, 1e-9) << name;
    EXPECT_NEAR(found.model.radius_std_error_px, expected.radius_error, 1e-5) << name;
    EXPECT_NEAR(found.model.contrast, expected.contrast, 1e-9) << name;
    EXPECT_NEAR(found.model.open_radius_px, expected.open_radius, 1e-3) << name;
    EXPECT_EQ(found.model.threshold, expected.edges.threshold) << name;
    EXPECT_NEAR(found.edge_length_px, expected.edge_length, 1e-6) << name;
    expect_same_disks(found.disks, expected.disks, name);
    EXPECT_GE(found.disks.size(), 15U) << name;
    // What was learned is found again, without the gaps between them.
    const RimsFound again = find_rims(frame, found.model);
    for (const RimDisk& disk : again.disks) EXPECT_GE(disk.probability, 0.8);
    EXPECT_GE(again.disks.size(), found.disks.size());
    EXPECT_EQ(again.expected_missed, 0);
  }
}

// Beads of 17.5 px are searched in a picture half as large. Whoever starts from 15 px learns at that scale, too.
TEST(RimFinder, LearnsAtTheScaleOfItsRadius) {
  const GrayFrame frame = rimmed_frame(rimmed_disks(17.5, 46), 46, 60);
  const LearnedRims found = learn_rims(frame, Polarity::dark_beads, 15.9);
  EXPECT_NEAR(found.model.radius_px, 17.5, 0.4);
  const LearnedRims directly = learn_rims(frame, Polarity::dark_beads, 17.5);
  EXPECT_EQ(found.model.threshold, find_edges(scaled_for(frame, 17.5).picture).threshold);
  EXPECT_NEAR(found.model.radius_px, directly.model.radius_px, 0.1);
  EXPECT_EQ(found.disks.size(), directly.disks.size());
}

// A bead whose rim has less than a quarter of the contrast of the others is none of them.
TEST(RimFinder, LeavesFaintCirclesOut) {
  const std::vector<RenderedDisk> disks = rimmed_disks(9, 22);
  const GrayFrame frame = rimmed_frame(disks, 22, 60, 0.5);
  const RimModel model = learn_rims(frame, Polarity::dark_beads, 9).model;
  for (const double share : {0.3, 0.2}) {
    GrayFrame faint = frame;
    const RenderedDisk& one = disks[7];
    for (int row = 0; row < frame.height; ++row)
      for (int column = 0; column < frame.width; ++column)
        if (std::hypot(column - one.x_px, row - one.y_px) < 11)
          test::set(faint, column, row, 150 + share * static_cast<double>(frame.at(column, row) - 150.0F));
    RimModel sensitive = model;
    sensitive.threshold = 1;
    EXPECT_EQ(find_rims(faint, sensitive).disks.size(), share > 0.25 ? 20U : 19U) << share;
  }
}

// Places that are 2 px off lead to their circles. Where no circle of the beads' radius is, one of three quarters of it
// that is seen for the most part is taken.
TEST(RimFinder, FitsCirclesAtGivenPlaces) {
  std::vector<RenderedDisk> disks = rimmed_disks(9, 24);
  disks[8].radius_px = 6;
  const GrayFrame frame = rimmed_frame(disks, 24, 60);
  const RimModel model = learn_rims(frame, Polarity::dark_beads, 9).model;
  std::vector<Circle> places;
  for (const RenderedDisk& disk : disks) places.push_back({disk.x_px + 1, disk.y_px - 1, 9});
  places[8].x -= 1, places[8].y += 1;
  places.push_back({disks[6].x_px + 12, disks[6].y_px + 12, 9});
  const auto fitted = rims_at(frame, model, places);
  ASSERT_EQ(fitted.size(), 21U);
  for (std::size_t k = 0; k < 20; ++k) {
    EXPECT_NEAR(fitted[k].x, disks[k].x_px, 0.2) << k;
    EXPECT_NEAR(fitted[k].y, disks[k].y_px, 0.2) << k;
    EXPECT_NEAR(fitted[k].radius, disks[k].radius_px, 0.4) << k;
    EXPECT_GT(fitted[k].support, 0.9) << k;
  }
  EXPECT_LT(fitted[20].support, 0.3);
  // In a picture twice as large, whose map is the smaller one: twice the places.
  const GrayFrame large = doubled(frame);
  RimModel twice = model;
  twice.radius_px *= 2, twice.threshold = 0;
  for (Circle& place : places) place = {2 * place.x + 0.5, 2 * place.y + 0.5, 18};
  const auto in_large = rims_at(large, twice, places);
  for (std::size_t k = 0; k < 20; ++k) {
    EXPECT_NEAR(in_large[k].x, 2 * disks[k].x_px + 0.5, 0.4) << k;
    EXPECT_NEAR(in_large[k].y, 2 * disks[k].y_px + 0.5, 0.4) << k;
    EXPECT_NEAR(in_large[k].radius, 2 * disks[k].radius_px, 0.8) << k;
  }
}

TEST(RimFinder, DoubtsAsMuchAsItsDisksTogether) {
  std::vector<RimDisk> disks(3);
  disks[0].probability = 0.9, disks[1].probability = 0.75, disks[2].probability = 1;
  EXPECT_NEAR(expected_wrong_share(disks), 0.35 / 3, 1e-12);
  EXPECT_EQ(expected_wrong_share({}), 1);
}

}  // namespace
}  // namespace shakebed::ingest
