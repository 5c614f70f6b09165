// Maps of edges and votes as large pictures need them, and circles that are too many for chance.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "ingest/find/circle_search.hpp"
#include "ingest/find/edge_map.hpp"
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
  const auto of = [&](int whole, double support, int by_chance, Known known = Known::fairly_wide) {
    return probabilities_by_support(seen_by_share({{1.0, whole}}), {seen_by_share({{support, by_chance}})}, known)
        .back();
  };
  EXPECT_NEAR(of(58, 0.5, 40), 1 - 0.05 / 58, 1e-12);
  EXPECT_NEAR(of(58, 0.5, 40, Known::nothing), 1 - 40.05 / 58, 1e-12) << "small hexagons look whole, too";
  EXPECT_NEAR(of(19, 0.5, 15), 1 - 15.05 / 19, 1e-12);
  EXPECT_NEAR(of(58, 1.0, 40), 1 - 40.05 / 58, 1e-12);
  EXPECT_NEAR(of(58, 0.9, 40), 1 - 40.05 / 58, 1e-12) << "as good as whole";
}

}  // namespace
}  // namespace shakebed::ingest
