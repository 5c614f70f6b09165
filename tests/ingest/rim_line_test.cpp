// Beads that a line along their rims shows.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "ingest/find/rim_line.hpp"
#include "ingest/profile/photographs.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

constexpr double behind_level = 200, line_level = 70;  // grey levels of what is behind the beads and of their lines

struct Outlined {
  GrayFrame frame;
  std::vector<Circle> circles;  // that were found, of another radius than the beads
  double radius = 14;
};

std::vector<RenderedDisk> of_radius(std::vector<RenderedDisk> disks, double radius) {
  for (RenderedDisk& disk : disks) disk.radius_px = radius;
  return disks;
}

// How much of each pixel the disks cover, seen with this blur.
std::vector<double> covered(const std::vector<RenderedDisk>& disks, double blur_px) {
  const GrayFrame frame =
      render_frame(disks, {.width = 480, .height = 400, .background_level = 20, .bead_level = 220, .blur_px = blur_px});
  std::vector<double> cover;
  for (const float level : frame.pixels) cover.push_back((static_cast<double>(level) - 20) / 200);
  return cover;
}

// Disks of 14 px with a dark line of this width inside their rims, and this level inside it.
Outlined outlined(const std::vector<RenderedDisk>& places, double line_px, double inside, double blur_px,
                  double found_px) {
  Outlined beads;
  const std::vector<double> all = covered(of_radius(places, beads.radius), blur_px),
                            faces = covered(of_radius(places, beads.radius - line_px), blur_px);
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 2);
  beads.frame = {480, 400, {}};
  for (std::size_t k = 0; k < all.size(); ++k)
    beads.frame.pixels.push_back(static_cast<float>(std::clamp(
        behind_level + (line_level - behind_level) * all[k] + (inside - line_level) * faces[k] + noise(random), 0.0,
        255.0)));
  for (const RenderedDisk& place : places) beads.circles.push_back({place.x_px, place.y_px, found_px});
  return beads;
}

// Seven rows of eight that do not touch, at places of no lattice.
std::vector<RenderedDisk> strewn() {
  std::vector<RenderedDisk> places;
  for (int row = 0; row < 7; ++row)
    for (int column = 0; column < 8; ++column)
      places.push_back({45 + 55.0 * column + 9 * test::scattered(column, row),
                        40 + 53.0 * row + 9 * test::scattered(row + 20, column), 14, 0, 0});
  return places;
}

// A hexagonal packing of six rows: rays are free above it and at its sides alone.
std::vector<RenderedDisk> packed() {
  std::vector<RenderedDisk> places;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 12; ++column)
      places.push_back({65.3 + 28 * column + 14.0 * (row % 2), 330.7 - 28 * std::sqrt(0.75) * row, 14, 0, 0});
  return places;
}

// Whichever edge of the line the circles followed, and however bright the inside is.
TEST(RimLine, ItsOuterEdgeIsTheOutline) {
  for (const double line : {3.0, 4.0})
    for (const double inside : {behind_level, behind_level + 30, behind_level - 70})
      for (const double found : {14 * 1.08, 13.0, 14.0 - line}) {
        const Outlined beads = outlined(strewn(), line, inside, 0.8, found);
        const Polarity edge = found < 12 ? Polarity::bright_beads : Polarity::dark_beads;
        const auto seen = line_at_rim(beads.frame, beads.circles, beads.circles, found, edge);
        ASSERT_TRUE(seen) << line << " " << inside << " " << found;
        EXPECT_NEAR(seen->outer_px, beads.radius, 0.07) << line << " " << inside << " " << found;
        EXPECT_NEAR(seen->std_error_px, 0.2, 1e-9);
      }
}

// A bright line on black, and circles of the other signs.
TEST(RimLine, OfAPictureTurnedIntoItsNegativeIsTheSame) {
  for (const double found : {15.1, 11.0}) {
    const Outlined beads = outlined(strewn(), 3, behind_level - 40, 0.8, found);
    GrayFrame negative = beads.frame;
    for (float& level : negative.pixels) level = 255 - level;
    const bool outer = found > 14;
    const auto dark = line_at_rim(beads.frame, beads.circles, beads.circles, found,
                                  outer ? Polarity::dark_beads : Polarity::bright_beads);
    const auto bright = line_at_rim(negative, beads.circles, beads.circles, found,
                                    outer ? Polarity::bright_beads : Polarity::dark_beads);
    ASSERT_TRUE(dark && bright);
    EXPECT_NEAR(bright->outer_px, dark->outer_px, 1e-3);
    EXPECT_FALSE(line_at_rim(negative, beads.circles, beads.circles, found,
                             outer ? Polarity::dark_beads : Polarity::bright_beads));
  }
}

TEST(RimLine, OfAPackingIsSeenAtItsBorder) {
  const Outlined beads = outlined(packed(), 3, behind_level, 0.8, 11.5);
  const auto seen = line_at_rim(beads.frame, beads.circles, beads.circles, 11.5, Polarity::bright_beads);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->outer_px, beads.radius, 0.1);
}

// Of lines no wider than their blur the outline is known to a part of what they seem wide.
TEST(RimLine, ErrorsOfThinOnesHold) {
  double squares = 0;
  int count = 0;
  for (const double blur : {0.5, 1.2, 1.8})
    for (const double line : {1.0, 2.0}) {
      const Outlined beads = outlined(strewn(), line, behind_level, blur, 14.5);
      const auto seen = line_at_rim(beads.frame, beads.circles, beads.circles, 14.5, Polarity::dark_beads);
      ASSERT_TRUE(seen) << blur << " " << line;
      EXPECT_NEAR(seen->outer_px, beads.radius, 2.1 * seen->std_error_px) << blur << " " << line;
      squares += std::pow((seen->outer_px - beads.radius) / seen->std_error_px, 2), ++count;
    }
  EXPECT_GT(squares / count, 0.25);
  EXPECT_LT(squares / count, 2);
}

// Faces that differ from what is behind them, bright ones with a dark edge around them, and circles far from the line.
TEST(RimLine, IsNoneWhereFacesShow) {
  const auto none = [](const Outlined& beads, double found) {
    return !line_at_rim(beads.frame, beads.circles, beads.circles, found, Polarity::automatic);
  };
  EXPECT_TRUE(none(outlined(strewn(), 3, line_level, 0.8, 14), 14)) << "dark disks";
  EXPECT_TRUE(none(outlined(strewn(), 3, behind_level - 105, 0.8, 14), 14)) << "disks nearly as dark as their rims";
  EXPECT_TRUE(none(outlined(strewn(), 3, 255, 0.8, 14), 14)) << "bright disks with a dark edge";
  EXPECT_TRUE(none(outlined(strewn(), 3, behind_level, 0.8, 20), 20)) << "circles that are far too large";
}

// Dark circles are those of the outer edge of a dark line, bright ones those of its inner edge.
TEST(RimLine, IsNoneWhereCirclesFollowNeitherEdge) {
  const Outlined beads = outlined(strewn(), 4, behind_level, 0.8, 14);
  const auto seen = [&](double found, Polarity edge) {
    return line_at_rim(beads.frame, beads.circles, beads.circles, found, edge).has_value();
  };
  EXPECT_TRUE(seen(12.8, Polarity::dark_beads));
  EXPECT_FALSE(seen(12.4, Polarity::dark_beads)) << "0.89 of the outer edge";
  EXPECT_TRUE(seen(15.9, Polarity::dark_beads));
  EXPECT_FALSE(seen(17, Polarity::dark_beads)) << "1.21 of it";
  EXPECT_TRUE(seen(9.6, Polarity::bright_beads));
  EXPECT_FALSE(seen(7.8, Polarity::bright_beads)) << "0.78 of the inner edge";
  EXPECT_TRUE(seen(10.8, Polarity::bright_beads));
  EXPECT_FALSE(seen(11.3, Polarity::bright_beads)) << "1.13 of it";
  EXPECT_TRUE(seen(14, Polarity::automatic));
  EXPECT_FALSE(seen(10, Polarity::automatic)) << "edges of either sign: fringes may be these";
}

TEST(RimLine, IsNoneWhereFewRaysAreFree) {
  Outlined beads = outlined({{200, 200, 14, 0, 0}}, 3, behind_level, 0.8, 14);
  EXPECT_TRUE(line_at_rim(beads.frame, beads.circles, beads.circles, 14, Polarity::dark_beads)) << "one bead has 64";
  for (int k = 0; k < 6; ++k)
    beads.circles.push_back({200 + 29 * std::cos(1.047 * k), 200 + 29 * std::sin(1.047 * k), 14});
  beads.circles.resize(4);
  EXPECT_FALSE(line_at_rim(beads.frame, beads.circles, beads.circles, 14, Polarity::dark_beads))
      << "neighbours take some of them";
  Outlined crowded = outlined(strewn(), 3, behind_level, 0.8, 14);
  const std::vector<Circle> some(crowded.circles.begin(), crowded.circles.begin() + 20);
  EXPECT_TRUE(line_at_rim(crowded.frame, some, crowded.circles, 14, Polarity::dark_beads));
  for (const Circle& bead : some)
    for (int k = 0; k < 8; ++k)
      crowded.circles.push_back({bead.x + 30 * std::cos(0.785 * k), bead.y + 30 * std::sin(0.785 * k), 8});
  EXPECT_FALSE(line_at_rim(crowded.frame, some, crowded.circles, 14, Polarity::dark_beads)) << "beads of another size";
  const Outlined small = outlined(strewn(), 3, behind_level, 0.8, 4.9);
  EXPECT_FALSE(line_at_rim(small.frame, small.circles, small.circles, 4.9, Polarity::dark_beads)) << "radii below 5 px";
}

// A shadow at one side is no line.
TEST(RimLine, IsNoneWhereOneSideShowsIt) {
  const Outlined beads = outlined(strewn(), 3, behind_level, 0.8, 14);
  GrayFrame half = beads.frame;
  for (const Circle& circle : beads.circles)
    for (int row = 0; row < half.height; ++row)
      for (int column = 0; column < half.width; ++column)
        if (std::hypot(column - circle.x, row - circle.y) < 18 && column < circle.x)
          half.pixels[static_cast<std::size_t>(row * half.width + column)] = behind_level;
  EXPECT_FALSE(line_at_rim(half, beads.circles, beads.circles, 14, Polarity::dark_beads));
}

// From the picture alone: the radius was 8 % too large where such beads do not touch, and 15 % too small in packings,
// with errors of 1 %.
TEST(RimLine, GivesTheRadiusOfOutlinedBeads) {
  for (const auto& places : {strewn(), packed()}) {
    const Outlined beads = outlined(places, 3, behind_level - 40, 0.8, 14);
    const DisksFound found = find_disks(ImageView{.width = beads.frame.width,
                                                  .height = beads.frame.height,
                                                  .pixels = beads.frame.pixels.data(),
                                                  .type = PixelType::f32});
    ASSERT_TRUE(found.ok()) << found.message;
    EXPECT_NEAR(static_cast<double>(found.disks.size()), static_cast<double>(places.size()), 1);
    EXPECT_NEAR(found.calibration.radius_px, beads.radius, 0.01 * beads.radius);
  }
}

}  // namespace
}  // namespace shakebed::ingest
