// How many beads are missed: the places that edges fill, tried one by one as missed_beads.hpp says.

#include "ingest/find/missed_beads.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "ingest/find/edge_map.hpp"
#include "ingest/find/picture_maps.hpp"
#include "ingest/find/picture_scale.hpp"
#include "ingest/find/rim_finder.hpp"
#include "ingest/profile/photographs.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

class PlacesByHand {
 public:
  PlacesByHand(const EdgeMap& edges, const std::vector<Circle>& found, double radius, double contrast)
      : edges_(edges),
        radius_(radius),
        contrast_(contrast),
        found_(found),
        to_found_(edges.x.size(), 4 * radius),
        edge_(edges.x.size(), 0) {
    for (const Circle& disk : found) cover(to_found_, disk.x, disk.y, disk.radius);
    to_taken_ = to_found_;
    left_ = wall_of([](const Circle& one) { return one.radius - one.x; });
    right_ = wall_of([](const Circle& one) { return one.radius + one.x; });
    bottom_ = wall_of([](const Circle& one) { return one.radius + one.y; });
    for (const RidgePixel& pixel : edges.ridge) {
      const int column = static_cast<int>(pixel.x), row = static_cast<int>(pixel.y);
      // Of no disk, clear, at no wall that four of the disks touch, and on no straight line.
      if (to_found_[edges.at(column, row)] < 0.2 * radius) continue;
      if (2.5 * static_cast<double>(edges.slope(edges.at(column, row))) < 0.25 * contrast) continue;
      if (beside_a_wall(column, row) || is_straight(pixel)) continue;
      for (int y = std::max(0, row - 1); y <= std::min(edges.height - 1, row + 1); ++y)
        for (int x = std::max(0, column - 1); x <= std::min(edges.width - 1, column + 1); ++x)
          edge_[edges.at(x, y)] = 1;
    }
    std::vector<double> shown;
    for (const Circle& disk : found) shown.push_back(rim_shown(disk.x, disk.y, disk.radius, true));
    std::sort(shown.begin(), shown.end());
    if (!shown.empty()) usual_ = shown[shown.size() / 2];
  }

  double take(double size, const PixelRectangle& region) {
    struct Filled {
      double met, x, y;
    };
    std::vector<Filled> filled;
    for (double y = region.top + size; y <= region.top + region.height - size; y += std::max(1.0, size / 6))
      for (double x = region.left + size; x <= region.left + region.width - size; x += std::max(1.0, size / 6)) {
        const int column = static_cast<int>(x), row = static_cast<int>(y);
        if (!is_free(x, y, size) || to_found_[edges_.at(column, row)] >= size + 1.5 * radius_) continue;
        if (const double met = share_met(x, y, size); met >= 0.65) filled.push_back({met, x, y});
      }
    std::stable_sort(filled.begin(), filled.end(), [](const auto& a, const auto& b) { return a.met > b.met; });
    double count = 0;
    for (const Filled& one : filled)
      if (is_free(one.x, one.y, size)) {
        count += std::clamp((rim_shown(one.x, one.y, size, false) / usual_ - 0.25) / 0.5, 0.0, 1.0);
        cover(to_taken_, one.x, one.y, size);
      }
    return count;
  }

 private:
  // From each pixel to the nearest of the disks, px; no farther than four radii.
  void cover(std::vector<double>& away, double x, double y, double size) const {
    for (int row = 0; row < edges_.height; ++row)
      for (int column = 0; column < edges_.width; ++column) {
        double& its = away[edges_.at(column, row)];
        its = std::min(its, std::sqrt((column - x) * (column - x) + (row - y) * (row - y)) - size);
      }
  }
  [[nodiscard]] bool is_free(double x, double y, double size) const {
    return to_taken_[edges_.at(static_cast<int>(x), static_cast<int>(y))] >= 0.88 * size - 1e-6;
  }

  // How far the four farthest disks reach to one side, if they reach alike.
  template <class ReachOf>
  [[nodiscard]] double wall_of(const ReachOf& reach_of) const {
    std::vector<double> reach;
    for (const Circle& disk : found_) reach.push_back(reach_of(disk));
    std::sort(reach.begin(), reach.end(), std::greater<>());
    return reach.size() >= 4 && reach[0] - reach[3] < 0.3 * radius_ ? reach[0] : HUGE_VAL;
  }
  [[nodiscard]] bool beside_a_wall(double x, double y) const {
    return std::min({std::abs(-x - left_), std::abs(x - right_), std::abs(y - bottom_)}) < 0.3 * radius_;
  }

  // Along the tangent, from half a radius to three on each side, as far as the picture goes and no disk hides it.
  [[nodiscard]] bool is_straight(const RidgePixel& pixel) const {
    double shares[2] = {0, 0};
    for (const int side : {0, 1}) {
      int seen = 0, met = 0;
      for (double away = 0.5 * radius_; away <= 3 * radius_; away += 1) {
        const double along = side == 0 ? away : -away,
                     x = static_cast<double>(pixel.x) - along * static_cast<double>(pixel.unit_y),
                     y = static_cast<double>(pixel.y) + along * static_cast<double>(pixel.unit_x);
        if (x < 0 || y < 0 || x >= edges_.width || y >= edges_.height) break;
        const int column = static_cast<int>(x), row = static_cast<int>(y);
        const std::size_t at = edges_.at(column, row);
        if (to_found_[at] < 0.2 * radius_) continue;
        const double slope = static_cast<double>(edges_.slope(at));
        const auto alike = static_cast<double>(edges_.x[at] * pixel.unit_x + edges_.y[at] * pixel.unit_y);
        ++seen, met += slope >= static_cast<double>(edges_.threshold) && alike >= 0.95 * slope;
      }
      if (seen > 0.5 * radius_) shares[side] = static_cast<double>(met) / seen;
    }
    return std::max(shares[0], shares[1]) >= 0.6 || 0.5 * (shares[0] + shares[1]) >= 0.45;
  }

  // Of 24 directions those that are open beyond 0.8 of the size, six at least: in which share an edge is met.
  [[nodiscard]] double share_met(double x, double y, double size) const {
    int open = 0, met = 0;
    for (int k = 0; k < 24; ++k) {
      const double angle = 2 * std::numbers::pi * k / 24;
      bool edge = false, uncovered = false;
      for (double away = 0.35 * size; away <= 1.15 * size; away += 1) {
        const int column = static_cast<int>(x + away * std::cos(angle) + 0.5),
                  row = static_cast<int>(y + away * std::sin(angle) + 0.5);
        if (column < 0 || row < 0 || column >= edges_.width || row >= edges_.height) continue;
        uncovered = uncovered || (away > 0.8 * size && to_taken_[edges_.at(column, row)] > 0.2 * radius_);
        edge = edge || edge_[edges_.at(column, row)] != 0;
      }
      open += uncovered, met += uncovered && edge;
    }
    return open < 6 ? 0 : static_cast<double>(met) / open;
  }

  // Mean over the directions in which the rim is clear of disks: the steepest slope within 45 degrees of the direction.
  [[nodiscard]] double rim_shown(double x, double y, double size, bool of_found) const {
    double sum = 0, open = 0;
    for (int k = 0; k < 24; ++k) {
      const double angle = 2 * std::numbers::pi * k / 24;
      const auto pixel = [&](double away) {
        const int column = static_cast<int>(x + away * std::cos(angle) + 0.5),
                  row = static_cast<int>(y + away * std::sin(angle) + 0.5);
        const bool in_view = column >= 0 && row >= 0 && column < edges_.width && row < edges_.height;
        return in_view ? static_cast<std::ptrdiff_t>(edges_.at(column, row)) : -1;
      };
      const std::ptrdiff_t rim = pixel(size);
      if (rim < 0 || (!of_found && to_taken_[static_cast<std::size_t>(rim)] <= 0.2 * radius_)) continue;
      double steepest = 0;
      for (double away = (of_found ? 0.8 : 0.35) * size; away <= 1.15 * size; away += 1) {
        if (pixel(away) < 0) continue;
        const auto at = static_cast<std::size_t>(pixel(away));
        const auto slope = static_cast<double>(edges_.slope(at));
        const double across = std::abs(static_cast<double>(edges_.x[at]) * std::cos(angle) +
                                       static_cast<double>(edges_.y[at]) * std::sin(angle));
        if ((of_found || edge_[at] != 0) && across > 0.7 * slope) steepest = std::max(steepest, 2.5 * slope);
      }
      ++open, sum += std::min(1.0, steepest / contrast_);
    }
    return open > 0 ? sum / open : 0;
  }

  const EdgeMap& edges_;
  double radius_, contrast_, usual_ = 1;
  const std::vector<Circle> found_;
  std::vector<double> to_found_, to_taken_;
  double left_ = 0, right_ = 0, bottom_ = 0;
  std::vector<char> edge_;
};

double missed_by_hand(const GrayFrame& frame, const RimModel& model, std::vector<Circle> found,
                      const PixelRectangle* region = nullptr) {
  const ScaledPicture at = scaled_for(frame, model.radius_px);
  const EdgeMap edges = find_edges(at.picture, model.search.wanted_px == 8 ? model.threshold : 0);
  for (Circle& disk : found)
    disk = {(disk.x + 0.5) / at.scale - 0.5, (disk.y + 0.5) / at.scale - 0.5, disk.radius / at.scale};
  PixelRectangle where{1, 1, edges.width - 2, edges.height - 2};
  if (region) {
    const int left = static_cast<int>(region->left / at.scale), top = static_cast<int>(region->top / at.scale),
              right = static_cast<int>((region->left + region->width) / at.scale),
              bottom = static_cast<int>((region->top + region->height) / at.scale);
    where.left = std::max(1, left), where.top = std::max(1, top);
    where.width = std::min(edges.width - 1, right) - where.left;
    where.height = std::min(edges.height - 1, bottom) - where.top;
  }
  const double radius = model.radius_px / at.scale;
  PlacesByHand places(edges, found, radius, model.contrast);
  double missed = 0;
  for (const double size : {1.0, 0.8, 0.6}) missed += size * size * places.take(size * radius, where);
  return missed;
}

// Four rows of beads of several sizes, on a floor and beside a wall, with other things between them. Those of which
// `is_found` is false are not found.
struct PartlyFound {
  GrayFrame frame;
  RimModel model;
  std::vector<Circle> found;
};
PartlyFound partly_found(int pattern, double radius = 7) {
  const double unit = radius / 7;
  Camera camera;
  camera.width = static_cast<int>(124 * unit), camera.height = static_cast<int>(96 * unit);
  camera.background_level = 150, camera.bead_level = pattern % 2 == 0 ? 60 : 230;
  camera.blur_px = 0.8, camera.read_noise = 2, camera.seed = static_cast<std::uint64_t>(pattern) + 1;
  std::vector<RenderedDisk> disks;
  PartlyFound out;
  for (int k = 0; k < 24; ++k) {
    const double its = radius * (k % 4 == 3 ? 0.62 : k % 4 == 1 ? 0.81 : 1);
    const double x = unit * (14 + 18.6 * (k % 6) + 3 * test::scattered(k, pattern)),
                 y = unit * (77 - 18.6 * (k / 6) - 3 * test::scattered(pattern, k));
    disks.push_back({x, y, its, 0, 0});
    if (test::scattered(k, 3 * pattern + 7) > 0.35) out.found.push_back({x, y, its});
  }
  out.frame = render_frame(disks, camera);
  for (int row = 0; row < out.frame.height; ++row)
    for (int column = 0; column < out.frame.width; ++column)
      if (row > 88 * unit || column < 4 * unit || (pattern == 2 && std::abs(row - column + 30 * unit) < 3))
        test::set(out.frame, column, row, camera.bead_level);
  out.model.polarity = pattern % 2 == 0 ? Polarity::dark_beads : Polarity::bright_beads;
  out.model.radius_px = radius, out.model.contrast = 70;
  return out;
}

TEST(MissedByHand, ArePlacesThatEdgesFill) {
  double all = 0;
  for (int pattern = 0; pattern < 4; ++pattern) {
    const PartlyFound bed = partly_found(pattern);
    const double missed = expected_missed_beads(bed.frame, bed.model, bed.found, std::nullopt);
    EXPECT_NEAR(missed, missed_by_hand(bed.frame, bed.model, bed.found), 1e-9) << pattern;
    const PixelRectangle region{20, 25, 70, 50};
    EXPECT_NEAR(expected_missed_beads(bed.frame, bed.model, bed.found, region),
                missed_by_hand(bed.frame, bed.model, bed.found, &region), 1e-9)
        << pattern;
    all += missed;
  }
  EXPECT_GT(all, 8);
}

// The threshold is that of the model, where it was learned at this scale. Faint edges are those of no bead.
TEST(MissedByHand, AreSeenFromAThresholdOn) {
  PartlyFound bed = partly_found(0);
  for (const double threshold : {4.0, 20.0})
    for (const double wanted : {8.0, 16.0}) {
      bed.model.threshold = static_cast<float>(threshold), bed.model.search.wanted_px = wanted;
      EXPECT_NEAR(expected_missed_beads(bed.frame, bed.model, bed.found, std::nullopt),
                  missed_by_hand(bed.frame, bed.model, bed.found), 1e-9)
          << threshold << ' ' << wanted;
    }
  bed.model.threshold = 0;
  for (const double contrast : {150.0, 350.0}) {
    bed.model.contrast = contrast;
    EXPECT_NEAR(expected_missed_beads(bed.frame, bed.model, bed.found, std::nullopt),
                missed_by_hand(bed.frame, bed.model, bed.found), 1e-9)
        << contrast;
  }
  EXPECT_EQ(expected_missed_beads(bed.frame, bed.model, bed.found, std::nullopt), 0);
}

// Beads of 17 px are looked for in a picture half as large, small ones of 4 px in one twice as large.
TEST(MissedByHand, AreThoseOfAnyScale) {
  for (const double radius : {17.0, 4.2}) {
    const PartlyFound bed = partly_found(radius > 10 ? 1 : 0, radius);
    const double missed = expected_missed_beads(bed.frame, bed.model, bed.found, std::nullopt);
    EXPECT_NEAR(missed, missed_by_hand(bed.frame, bed.model, bed.found), 1e-9) << radius;
    EXPECT_GT(missed, 1.5) << radius;
    const PixelRectangle region{static_cast<int>(3 * radius), static_cast<int>(3 * radius),
                                static_cast<int>(9 * radius), static_cast<int>(7 * radius)};
    EXPECT_NEAR(expected_missed_beads(bed.frame, bed.model, bed.found, region),
                missed_by_hand(bed.frame, bed.model, bed.found, &region), 1e-9)
        << radius;
  }
}

// Bright rings on dark, as the mouths of bottles in a crate, with the fainter arcs of their shoulders around each.
GrayFrame mouths_of_bottles(std::vector<Circle>& mouths, int apart = 60) {
  struct Ring {
    double x, y, radius, level, width;
  };
  std::vector<Ring> rings;
  for (int k = 0; k < 20; ++k) {
    const int column = k % 5, row = k / 5;
    const double x = 40 + apart * column + 2 * ((7 * column + 3 * row) % 3),
                 y = 36 + apart * row + 2 * ((5 * column + 11 * row) % 3);
    rings.push_back({x, y, 11, 170, 1.3});
    mouths.push_back({x, y, 11});
    for (int n = 0; n < 3; ++n) {
      const double angle = 0.9 * k + 2.1 * n;
      rings.push_back({x + 13 * std::cos(angle), y + 13 * std::sin(angle), 16.0 + 4 * n, 60, 1});
    }
  }
  return test::frame_by(320, 256, [&](int column, int row) {
    double level = 0;
    for (const Ring& ring : rings) {
      const double away = (std::hypot(column - ring.x, row - ring.y) - ring.radius) / ring.width;
      level = std::max(level, ring.level * std::exp(-0.5 * away * away));
    }
    return 30 + level + 5 * test::scattered(column, row);
  });
}

// All are found. The arcs fill places as beads do, but with a third of their contrast: as 80 % of beads missed, such
// pictures were refused.
TEST(MissedBeads, AreNoFainterArcsBetweenThem) {
  std::vector<Circle> mouths;
  const GrayFrame frame = mouths_of_bottles(mouths);
  const DisksFound found = find_disks(
      ImageView{.width = frame.width, .height = frame.height, .pixels = frame.pixels.data(), .type = PixelType::f32});
  ASSERT_TRUE(found.ok()) << found.message;
  for (const Circle& mouth : mouths)
    EXPECT_EQ(std::count_if(found.disks.begin(), found.disks.end(),
                            [&](const FoundDisk& disk) {
                              return std::hypot(disk.x_px - mouth.x, disk.y_px - mouth.y) < 0.25 * mouth.radius;
                            }),
              1);
  EXPECT_EQ(found.disks.size(), mouths.size());
  EXPECT_LT(found.calibration.expected_missed, 0.2);
}

// Rings that are not among those found are missed beads, arcs or no arcs.
TEST(MissedBeads, AreCountedBetweenFainterArcs) {
  std::vector<Circle> mouths, some;
  const GrayFrame frame = mouths_of_bottles(mouths, 36);
  const RimModel model = learn_rims(frame, Polarity::bright_beads, 12.5).model;
  for (std::size_t k = 0; k < mouths.size(); ++k)
    if (k % 4 != 1) some.push_back(mouths[k]);
  PictureMaps maps(frame, quick_search.wanted_px);
  const double besides = expected_missed_beads(maps, model, mouths, std::nullopt);
  const double filled = expected_missed_beads(maps, model, mouths, std::nullopt, PlacesCount::fully);
  EXPECT_LT(besides, 0.5 * filled) << filled;
  EXPECT_NEAR(expected_missed_beads(frame, model, some, std::nullopt) - besides, 5, 1.5) << "5 were left out";
}

}  // namespace
}  // namespace shakebed::ingest
