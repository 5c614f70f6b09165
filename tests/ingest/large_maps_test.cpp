// Maps of edges and votes as large pictures need them, and circles that are too many for chance.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "ingest/find/circle_search.hpp"
#include "ingest/find/edge_map.hpp"
#include "ingest/find/picture_maps.hpp"
#include "ingest/find/picture_scale.hpp"
#include "ingest/find/rim_probability.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

using test::frame_by;

TEST(Edges, OfLinesMadeOneAtATimeAreThoseOfThePicture) {
  const GrayFrame frame = frame_by(70, 31, [](int column, int row) { return 200 * test::scattered(column, row); });
  const EdgeMap whole = find_edges(frame, 4);
  std::vector<float> line(70);
  int next = 0;
  const auto row_of = [&](int row) {
    EXPECT_EQ(row, next++);
    for (int column = 0; column < 70; ++column) line[static_cast<std::size_t>(column)] = frame.at(column, row);
    return line.data();
  };
  const EdgeMap by_lines = find_edges(70, 31, row_of, 4);
  EXPECT_EQ(next, 31);
  EXPECT_EQ(by_lines.x, whole.x);
  EXPECT_EQ(by_lines.y, whole.y);
  EXPECT_GT(whole.ridge.size(), 100U);
  ASSERT_EQ(by_lines.ridge.size(), whole.ridge.size());
  for (std::size_t k = 0; k < whole.ridge.size(); ++k) {
    EXPECT_EQ(by_lines.ridge[k].x, whole.ridge[k].x);
    EXPECT_EQ(by_lines.ridge[k].unit_y, whole.ridge[k].unit_y);
  }
  EXPECT_TRUE(find_edges(
                  4, 4, [&](int) { return line.data(); }, 4)
                  .ridge.empty());
}

// Votes are kept in blocks of columns, of which most pictures leave most empty: centres on both sides of their seams,
// and radii one after the other.
TEST(CircleSearch, FindsCirclesAtTheSeamsOfItsBlocks) {
  std::vector<RenderedDisk> truth;
  for (int k = 0; k < 10; ++k)
    truth.push_back({61.4 + 65 * (k % 5), 20.0 + 40 * (k / 5), k % 2 == 0 ? 8.0 : 11.0, 0, 0});
  Camera camera;
  camera.width = 400, camera.height = 83;
  camera.background_level = 140, camera.bead_level = 60;
  const EdgeMap edges = find_edges(render_frame(truth, camera));
  const std::vector<Circle> found = without_doubles(find_circles(edges, {7, 13, Polarity::dark_beads, 0.8}), 0.5);
  EXPECT_EQ(found.size(), truth.size());
  for (const RenderedDisk& disk : truth)
    EXPECT_TRUE(
        std::any_of(found.begin(), found.end(),
                    [&](const Circle& circle) { return std::hypot(disk.x_px - circle.x, disk.y_px - circle.y) < 0.1; }))
        << disk.x_px << ' ' << disk.y_px;
}

std::vector<Circle> seen_by_share(const std::vector<std::pair<double, int>>& counts) {
  std::vector<Circle> circles;
  for (const auto& [support, count] : counts) {
    Circle circle;
    circle.support = support;
    circles.insert(circles.end(), static_cast<std::size_t>(count), circle);
  }
  return circles;
}

// Squares of the beads' size look like half of a circle, and what is stretched looks like it more often than what is
// there. Many whole circles, of which no copy has one, are no chance all the same. Whole ones that copies have, too,
// may be.
TEST(RimProbability, OfManyWholeCirclesIsTheirOwn) {
  std::size_t copies = 4;
  const auto of = [&](int whole, double support, int by_chance, Known known = Known::fairly_wide) {
    const std::vector<std::vector<Circle>> chance(copies, seen_by_share({{support, by_chance}}));
    return probabilities_by_support(seen_by_share({{1.0, whole}}), chance, known).back();
  };
  EXPECT_NEAR(of(58, 0.5, 40), 1 - 0.05 / 58, 1e-12);
  EXPECT_NEAR(of(58, 0.5, 40, Known::nothing), 1 - 40.05 / 58, 1e-12) << "small hexagons look whole, too";
  EXPECT_NEAR(of(19, 0.5, 15), 1 - 15.05 / 19, 1e-12);
  EXPECT_NEAR(of(58, 1.0, 40), 1 - 40.05 / 58, 1e-12);
  EXPECT_NEAR(of(58, 0.9, 40), 1 - 40.05 / 58, 1e-12) << "as good as whole";
  EXPECT_NEAR(of(20, 0.5, 15), 1 - 0.05 / 20, 1e-12);
  copies = 1;
  EXPECT_NEAR(of(79, 0.5, 15), 1 - 15.05 / 79, 1e-12) << "one copy says a quarter as much";
  EXPECT_NEAR(of(80, 0.5, 15), 1 - 0.05 / 80, 1e-12);
}

// The rows of the bands are those of whole copies, in the four directions by turns; each row is in one band, with
// margins wide enough for the largest circles.
TEST(PictureScale, MapsOfManyPixelsHaveOneCopyInBands) {
  const GrayFrame frame = frame_by(2003, 1001, [](int column, int row) { return 200 * test::scattered(column, row); });
  PictureMaps maps(frame, 8);
  const PictureMap& map = maps.with_copies(9);
  ASSERT_EQ(map.copies.size(), 1U);
  const StretchedCopy& bands = map.copies.front();
  ASSERT_EQ(bands.size(), 8U);
  int row = 0;
  for (std::size_t k = 0; k < bands.size(); ++k) {
    const StretchedBand& band = bands[k];
    EXPECT_EQ(band.angle, copy_angle(k % 4));
    EXPECT_EQ(band.first_row + band.from, row);
    row = band.first_row + band.to;
    EXPECT_GE(std::min(band.from, band.edges.height - band.to), k > 0 && k < 7 ? 32 : 0);
    EXPECT_TRUE(band.holds(band.from) && band.holds(band.to - 1));
    EXPECT_FALSE(band.holds(band.from - 1) || band.holds(band.to));
    if (k != 2 && k != 7) continue;
    const EdgeMap whole = find_edges(stretched(frame, decoy_stretch, band.angle), map.edges.threshold);
    for (int inner = 5; inner + 5 < band.edges.height; inner += 7)
      for (int column = 5; column + 5 < 2003; column += 50) {
        ASSERT_EQ(band.edges.x[band.edges.at(column, inner)], whole.x[whole.at(column, band.first_row + inner)]);
        ASSERT_EQ(band.edges.y[band.edges.at(column, inner)], whole.y[whole.at(column, band.first_row + inner)]);
      }
  }
  EXPECT_EQ(row, 1001);
  EXPECT_EQ(maps.with_copies(18).copies.size(), 4U) << "half a million pixels";
}

}  // namespace
}  // namespace shakebed::ingest
