// Small beads that lie close: rims show only in the voids between them, faces everywhere.

#include "ingest/find/packed_bed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "ingest/find/survey.hpp"
#include "ingest/profile/photographs.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/drawing.hpp"
#include "tests/ingest/drawn_beds.hpp"

namespace shakebed::ingest {
namespace {

constexpr int columns = 300, rows = 240;  // px
constexpr double left = 15, right = 285, ground = 224.5;

std::vector<RenderedDisk> crystal(double radius) {
  SyntheticBed bed;
  bed.left_wall_px = left, bed.right_wall_px = right, bed.floor_px = ground;
  bed.radius_px = radius;
  bed.rows = static_cast<int>(180 / (std::sqrt(3.0) * radius));
  return make_synthetic_bed(bed);
}

// Each bead comes to rest on two others, on the floor or at a wall, in one of the six lowest such places.
std::vector<RenderedDisk> pile(double radius, std::mt19937& random) {
  std::vector<RenderedDisk> beads;
  const double touching = 2 * radius;
  const auto most = static_cast<std::size_t>(180 * (right - left) / (touching * touching));
  while (beads.size() < most) {
    std::vector<test::drawing::Point> places;
    const auto offer = [&](double x, double y) {
      const bool inside = x >= left + radius && x <= right - radius && y <= ground - radius + 1e-9;
      if (inside && std::none_of(beads.begin(), beads.end(), [&](const RenderedDisk& other) {
            const double dx = other.x_px - x, dy = other.y_px - y, least = touching - 1e-7;
            return dx * dx + dy * dy < least * least;
          }))
        places.push_back({x, y});
    };
    for (int k = 0; k < 20; ++k) offer(test::drawing::between(random, left, right), ground - radius);
    for (const RenderedDisk& one : beads)
      for (const RenderedDisk& other : beads) {
        const double dx = other.x_px - one.x_px, dy = other.y_px - one.y_px;
        if (!(dx > 0) || dx >= 2 * touching || std::abs(dy) >= 2 * touching) continue;
        const double away = std::hypot(dx, dy);
        if (away >= 2 * touching) continue;
        const double up = std::sqrt(touching * touching - away * away / 4);
        offer(one.x_px + dx / 2 + up * dy / away, one.y_px + dy / 2 - up * dx / away);
      }
    if (places.empty()) break;
    std::sort(places.begin(), places.end(), [](const auto& a, const auto& b) { return a.y > b.y; });
    const auto& place = places[random() % std::min<std::size_t>(6, places.size())];
    beads.push_back({place.x, place.y, radius, 0, 0});
  }
  return beads;
}

struct Photograph {
  double blur_px, noise;
  bool bright;
};
void expect_all_found(const std::vector<RenderedDisk>& beads, const Photograph& photograph, const std::string& name) {
  Camera camera;
  camera.width = columns, camera.height = rows;
  camera.blur_px = photograph.blur_px, camera.read_noise = photograph.noise;
  if (photograph.bright) std::swap(camera.background_level, camera.bead_level);
  const GrayFrame frame = render_frame(beads, camera);
  const double radius = beads.front().radius_px;
  const DisksFound found = find_disks(ImageView{columns, rows, frame.pixels.data(), PixelType::f32});
  ASSERT_TRUE(found.ok()) << name << ": " << found.message;
  std::vector<test::DrawnBead> truth;
  for (const RenderedDisk& bead : beads) truth.push_back({bead.x_px, bead.y_px, radius, bead.y_px > radius});
  EXPECT_EQ(test::score_of(found.disks, truth).f1(), 1) << name;
  EXPECT_NEAR(found.calibration.radius_px / radius, 1, 0.01) << name;
  EXPECT_LT(found.calibration.expected_missed, 0.02) << name;
  EXPECT_EQ(found.calibration.polarity, photograph.bright ? Polarity::bright_beads : Polarity::dark_beads) << name;
}

struct Crystal {
  double radius;  // px
  Photograph photograph;
};
void expect_crystals_found(const std::vector<Crystal>& crystals) {
  for (const auto& [radius, photograph] : crystals)
    expect_all_found(crystal(radius), photograph, "crystal of " + std::to_string(radius));
}
TEST(PackedBed, SmallBeadsOfACrystalAreFoundByTheirFaces) {
  expect_crystals_found({{3.6, {0.5, 10, false}}, {6.5, {1.2, 5, true}}});
}
TEST(PackedBed, BeadsOfACrystalOfOtherSizesAreFoundByTheirFaces) {
  expect_crystals_found({{4.3, {0.8, 2, true}}, {5.3, {0.8, 5, false}}, {8.0, {0.5, 10, false}}});
}

TEST(PackedBed, SmallBeadsOfADisorderedBedAreFoundByTheirFaces) {
  std::mt19937 random(31);
  expect_all_found(pile(4.4, random), {0.8, 5, false}, "pile of 4.4 px");
  expect_all_found(pile(6.4, random), {1.2, 2, true}, "pile of 6.4 px");
}

// A drawn crystal shows no edges but those of its beads: they are gone once the beads are taken out.
TEST(PackedBed, ExplainsTheEdgesOfItsBeads) {
  Camera camera;
  camera.width = columns, camera.height = rows;
  camera.blur_px = 0.8, camera.read_noise = 2;
  ChannelFrames frames;
  frames.width = columns, frames.height = rows;
  frames.channels.push_back({Channel::grey, render_frame(crystal(4.3), camera)});
  const Survey survey = take_survey(frames);
  ASSERT_TRUE(survey.found) << survey.why_not;
  EXPECT_NEAR(survey.candidates.front().rims.radius_px, 4.3, 0.1);
  EXPECT_GT(survey.candidates.front().explained_share, 0.8);
  EXPECT_LE(survey.candidates.front().explained_share, 1);
}

// Squares, hexagons and disks on a lattice; what part of a cell is covered at (u, v) pitches from its middle.
GrayFrame tiled(double pitch, bool hexagonal, const std::function<bool(double u, double v)>& covered) {
  using test::drawing::Canvas;
  const double rise = hexagonal ? pitch * std::sqrt(0.75) : pitch;
  Canvas canvas(200);
  canvas.paint([&](double x, double y) {
    double nearest = HUGE_VAL, u = 0, v = 0;
    for (int k = -1; k <= 1; ++k) {
      const double row = std::round(y / rise) + k;
      const double off = hexagonal && static_cast<int>(std::abs(row)) % 2 == 1 ? 0.5 * pitch : 0;
      const double across = x - off - std::round((x - off) / pitch) * pitch, down = y - row * rise;
      const double away = std::hypot(across, down);
      if (away >= nearest) continue;
      nearest = away, u = across / pitch, v = down / pitch;
    }
    const double middle_x = x - u * pitch, middle_y = y - v * pitch;
    const bool outside = middle_x < 20 || middle_x > 400 || middle_y < 60 || middle_y > 340;
    return !outside && covered(u, v) ? 70.0 : 200.0;
  });
  std::mt19937 random(5);
  return canvas.seen(random);
}
bool in_hexagon(double u, double v, double half_width) {
  double farthest = 0;
  for (int side = 0; side < 3; ++side) {
    const double angle = side * std::numbers::pi / 3;
    farthest = std::max(farthest, std::abs(u * std::cos(angle) + v * std::sin(angle)));
  }
  return farthest < half_width;
}

TEST(PackedBed, OtherTilingsDoNotConvince) {
  const std::vector<std::pair<std::string, GrayFrame>> pictures = {
      {"squares", tiled(18, false, [](double u, double v) { return std::max(std::abs(u), std::abs(v)) < 0.44; })},
      {"hexagons", tiled(18, true, [](double u, double v) { return in_hexagon(u, v, 0.44); })},
      {"dots apart", tiled(15, true, [](double u, double v) { return std::hypot(u, v) < 0.38; })}};
  for (const auto& [name, picture] : pictures) {
    const PackedBed bed = learn_packed_bed({&picture}, {});
    EXPECT_FALSE(bed.faces.found) << name << ": " << bed.disks.size() << " disks of " << bed.faces.calibration.radius_px
                                  << " px";
  }
  const GrayFrame disks = tiled(15, true, [](double u, double v) { return std::hypot(u, v) < 0.5; });
  EXPECT_TRUE(learn_packed_bed({&disks}, {}).faces.found);
}

// From 3 to 14 px: where a search is to begin, and what it ends with.
TEST(PackedBed, IsLookedForWithBeadsFromThreeToFourteenPixels) {
  const auto frame_of = [](double radius, int columns_seen, int rows_seen) {
    SyntheticBed bed;
    bed.left_wall_px = 4, bed.right_wall_px = columns_seen - 5, bed.floor_px = rows_seen - 4, bed.radius_px = radius;
    bed.rows = static_cast<int>((rows_seen - 16) / (std::sqrt(3.0) * radius));
    Camera camera;
    camera.width = columns_seen, camera.height = rows_seen, camera.blur_px = 0.8, camera.read_noise = 3;
    return render_frame(make_synthetic_bed(bed), camera);
  };
  const auto radius_found = [](const GrayFrame& frame, std::optional<double> start) {
    const auto found = look_for_packed_bed(frame, {{Polarity::dark_beads, start}});
    return found ? found->faces.calibration.radius_px : 0;
  };
  const GrayFrame small = frame_of(3.2, 70, 60), smaller = frame_of(2.8, 62, 54), large = frame_of(13.7, 190, 170),
                  larger = frame_of(14.3, 200, 180);
  EXPECT_NEAR(radius_found(small, 3.05), 3.2, 0.1);
  EXPECT_EQ(radius_found(small, 2.95), 0);
  EXPECT_EQ(radius_found(smaller, 3.0), 0);
  EXPECT_NEAR(radius_found(large, 13.9), 13.7, 0.1);
  EXPECT_EQ(radius_found(large, 14.1), 0);
  EXPECT_EQ(radius_found(larger, 13.9), 0);
}

TEST(PackedBed, CirclesOfALatticeTouchAtHalfItsSpacing) {
  std::vector<Circle> lattice, strewn;
  std::mt19937 random(7);
  for (int row = 0; row < 8; ++row)
    for (int column = 0; column < 8; ++column) {
      if (random() % 5 == 0) continue;
      lattice.push_back({10.0 * column + (row % 2 ? 5 : 0), 8.66 * row, 3.5});
      strewn.push_back({test::drawing::between(random, 0, 300), test::drawing::between(random, 0, 300), 3.5});
    }
  ASSERT_TRUE(touching_radius(lattice));
  EXPECT_NEAR(*touching_radius(lattice), 5, 0.01);
  EXPECT_FALSE(touching_radius(strewn));
}

TEST(PackedBed, ARefusedShapeNamesItsLimit) {
  Roundness roundness;
  roundness.outlines = 20;
  roundness.on_circle = 0.962;
  EXPECT_EQ(
      roundness.why_not(),
      "the outlines are not round: only 96.2 % of a typical outline lies on its circle (at least 97 % is needed)");
}

}  // namespace
}  // namespace shakebed::ingest
