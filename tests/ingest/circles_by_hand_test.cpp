// Circles in a map of edges: votes, rays and fits worked out a second time, with plain loops.
#include "ingest/find/circle_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

constexpr int circles_width = 150, circles_height = 84;

// Disks of several sizes, dark and bright, some cut by the borders, on a mottled ground.
EdgeMap edges_with_circles() {
  std::vector<RenderedDisk> dark, bright;
  for (const auto& [x, y, r] : {std::tuple{18.3, 20.6, 9.0},
                                {37.0, 21.2, 9.0},
                                {63.4, 40.2, 11.0},
                                {128.6, 30.9, 9.5},
                                {146.0, 60.0, 9.0},
                                {100.2, 81.5, 10.0},
                                {2.7, 60.3, 9.0}})
    dark.push_back({x, y, r, 0, 0});
  for (const auto& [x, y, r] : {std::tuple{96.3, 20.8, 9.0}, {40.2, 62.1, 10.0}, {75.0, 2.0, 8.5}})
    bright.push_back({x, y, r, 0, 0});
  Camera camera;
  camera.width = circles_width, camera.height = circles_height;
  camera.background_level = 130, camera.bead_level = 60;
  camera.blur_px = 0.9, camera.read_noise = 3;
  GrayFrame frame = render_frame(dark, camera);
  camera.bead_level = 190, camera.read_noise = 0;
  const GrayFrame others = render_frame(bright, camera);
  for (std::size_t k = 0; k < frame.pixels.size(); ++k) frame.pixels[k] += others.pixels[k] - 130;
  return find_edges(frame);
}

// --- votes

// Places where most edges vote for, in the order of rows and columns.
std::vector<Circle> peaks_by_hand(const EdgeMap& edges, double radius, Polarity polarity, double least) {
  std::vector<std::vector<int>> votes(static_cast<std::size_t>(edges.height),
                                      std::vector<int>(static_cast<std::size_t>(edges.width), 0));
  auto sums = votes;
  const auto at = [](auto& map, int column, int row) -> auto& {
    return map[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
  };
  for (const RidgePixel& edge : edges.ridge)
    for (const float shift : {static_cast<float>(radius), -static_cast<float>(radius)}) {
      if (shift > 0 && polarity == Polarity::dark_beads) continue;  // brighter outwards: the centre is behind
      if (shift < 0 && polarity == Polarity::bright_beads) continue;
      const float x = edge.x + shift * edge.unit_x, y = edge.y + shift * edge.unit_y;
      if (x < 0.5F || y < 0.5F || x >= static_cast<float>(edges.width) - 1.5F ||
          y >= static_cast<float>(edges.height) - 1.5F)
        continue;  // nearest to an outermost pixel
      ++at(votes, static_cast<int>(std::floor(x + 0.5F)), static_cast<int>(std::floor(y + 0.5F)));
    }
  for (int row = 1; row + 1 < edges.height; ++row)
    for (int column = 1; column + 1 < edges.width; ++column)
      for (int y = row - 1; y <= row + 1; ++y)
        for (int x = column - 1; x <= column + 1; ++x) at(sums, column, row) += at(votes, x, y);
  std::vector<Circle> peaks;
  for (int row = 2; row + 2 < edges.height; ++row)
    for (int column = 2; column + 2 < edges.width; ++column) {
      const int here = at(sums, column, row);
      bool highest = here >= least * 2 * std::numbers::pi * radius;
      for (int y = row - 2; y <= row + 2; ++y)
        for (int x = column - 2; x <= column + 2; ++x) {
          const int other = at(sums, x, y);
          const bool earlier = y < row || (y == row && x < column);
          if (other > here || (other == here && earlier)) highest = false;
        }
      if (highest) peaks.push_back({static_cast<double>(column), static_cast<double>(row), radius});
    }
  return peaks;
}

TEST(CirclesByHand, HaveTheVotesOfTheirEdges) {
  const EdgeMap edges = edges_with_circles();
  for (const Polarity polarity : {Polarity::dark_beads, Polarity::bright_beads, Polarity::automatic})
    for (const double least : {0.1, 0.3}) {
      std::vector<Circle> expected, peaks;
      for (const double radius : {7.0, 7.0 * 1.2, 7.0 * 1.44, 7.0 * 1.728})
        for (const Circle& peak : peaks_by_hand(edges, radius, polarity, least)) expected.push_back(peak);
      CirclesAsked asked{7, 12, polarity, 0};
      asked.votes = {1.2, least};
      asked.leave_out = [&](const Circle& peak) {
        peaks.push_back(peak);
        return true;
      };
      EXPECT_TRUE(find_circles(edges, asked).empty());
      ASSERT_EQ(peaks.size(), expected.size()) << least;
      EXPECT_GT(peaks.size(), 5U);
      for (std::size_t k = 0; k < peaks.size(); ++k) {
        EXPECT_EQ(peaks[k].x, expected[k].x) << k;
        EXPECT_EQ(peaks[k].y, expected[k].y) << k;
        EXPECT_NEAR(peaks[k].radius, expected[k].radius, 1e-9) << k;
      }
    }
}

// --- rays

class CircleByHand {
 public:
  CircleByHand(const EdgeMap& edges, Polarity polarity, const RimRays& rays)
      : edges_(edges), polarity_(polarity), rays_(rays) {}

  Circle fit(const Circle& start) {
    Circle circle = start;
    if (!is_worth_it(start)) return circle;
    for (int round = 0; round < 4; ++round) {
      const double narrow = std::max(0.6, rays_.tolerance * circle.radius),
                   wide = std::max(1.2, rays_.reach * circle.radius),
                   reach = round == 0   ? wide
                           : round == 1 ? (wide + narrow) / 2
                                        : narrow;
      look(circle, reach);
      if (round == 3 || circle.support < 0.15) break;
      step(circle, reach);
      if (std::hypot(circle.x - start.x, circle.y - start.y) > start.radius / 2 || circle.radius < 0.7 * start.radius ||
          circle.radius > 1.4 * start.radius) {
        circle.support = 0;
        break;
      }
    }
    if (!met_.empty()) circle.contrast = 2.5 * median_slope();
    return circle;
  }

  struct Met {
    double cosine, sine, offset, slope, weight;
  };
  // The steepest edge along a ray within `reach` of the rim; whether the rim itself is in view.
  std::optional<Met> along(const Circle& circle, double angle, double reach, bool& in_view) const {
    const double c = std::cos(angle), s = std::sin(angle);
    const int steps = std::min(64, static_cast<int>(std::ceil(2 * reach)));
    const auto place = [&](int k) {
      return std::pair(circle.x + (circle.radius + 0.5 * k) * c, circle.y + (circle.radius + 0.5 * k) * s);
    };
    const auto inside = [&](int k) {
      const auto [x, y] = place(k);
      return x >= 1 && y >= 1 && x < edges_.width - 2 && y < edges_.height - 2;
    };
    in_view = inside(0);
    std::optional<Met> best;
    double steepest = static_cast<double>(edges_.threshold);
    int at = 0;
    for (int k = -steps; k <= steps; ++k) {
      if (!inside(k)) continue;
      const auto [x, y] = place(k);
      const double dx = between(edges_.x, x, y), dy = between(edges_.y, x, y), radial = signed_slope(dx * c + dy * s);
      const bool points_along = radial * radial >= 0.64 * (dx * dx + dy * dy);
      if (points_along && radial > steepest) steepest = radial, at = k, best = Met{c, s, 0.5 * k, radial, 1};
    }
    if (best && std::abs(at) < steps) {
      const auto slope_at = [&](int k) {
        if (!inside(k)) return 0.0;
        const auto [x, y] = place(k);
        return signed_slope(between(edges_.x, x, y) * c + between(edges_.y, x, y) * s);
      };
      const double before = slope_at(at - 1), after = slope_at(at + 1), bend = before - 2 * steepest + after;
      if (bend < 0) best->offset += 0.5 * std::clamp((before - after) / (2 * bend), -0.5, 0.5);
    }
    return best;
  }

 private:
  double signed_slope(double outwards) const {
    if (polarity_ == Polarity::automatic) return std::abs(outwards);
    return polarity_ == Polarity::dark_beads ? outwards : -outwards;
  }
  double between(const std::vector<float>& map, double x, double y) const {
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const double a = x - column, b = y - row;
    const auto level = [&](int right, int below) {
      return static_cast<double>(map[edges_.at(column + right, row + below)]);
    };
    return (1 - b) * ((1 - a) * level(0, 0) + a * level(1, 0)) + b * ((1 - a) * level(0, 1) + a * level(1, 1));
  }

  // Of 16 directions six must meet an edge near the rim, and four tenths of those in view.
  bool is_worth_it(const Circle& circle) const {
    const double reach = std::max(1.2, rays_.reach * circle.radius);
    const int each_way = static_cast<int>(std::ceil(reach));
    int in_view = 0, met = 0;
    for (int k = 0; k < 16; ++k) {
      const double c = std::cos(k * std::numbers::pi / 8), s = std::sin(k * std::numbers::pi / 8);
      bool seen = false, edge = false;
      for (int i = -each_way; i <= each_way; ++i) {
        const double r = circle.radius + reach * i / each_way;
        const int column = static_cast<int>(circle.x + r * c + 0.5), row = static_cast<int>(circle.y + r * s + 0.5);
        if (column < 1 || row < 1 || column > edges_.width - 2 || row > edges_.height - 2) continue;
        seen = true;
        const double dx = static_cast<double>(edges_.x[edges_.at(column, row)]),
                     dy = static_cast<double>(edges_.y[edges_.at(column, row)]), radial = signed_slope(dx * c + dy * s);
        edge = edge || (radial > static_cast<double>(edges_.threshold) && radial * radial > 0.6 * (dx * dx + dy * dy));
      }
      in_view += seen ? 1 : 0, met += edge ? 1 : 0;
    }
    return met >= 6 && met >= 0.4 * in_view;
  }

  void look(Circle& circle, double reach) {
    met_.clear();
    circle.met = 0, circle.directions = rays_.count, circle.rays = 0;
    for (int k = 0; k < rays_.count; ++k) {
      bool in_view = false;
      const auto one = along(circle, 2 * std::numbers::pi * k / rays_.count, reach, in_view);
      circle.rays += in_view ? 1 : 0;
      if (!one || !in_view || std::abs(one->offset) > reach) continue;
      met_.push_back(*one);
      circle.met |= std::uint64_t{1} << k;
    }
    circle.support = circle.rays < rays_.count / 2.0 ? 0 : static_cast<double>(met_.size()) / circle.rays;
    if (rays_.faint > 0)
      for (Met& one : met_) one.weight = std::clamp((one.slope / median_slope() - rays_.faint) / 0.25, 0.0, 1.0);
    double squares = 0, weights = 0;
    for (const Met& one : met_) squares += one.weight * one.offset * one.offset, weights += one.weight;
    circle.scatter = met_.empty() ? 0 : std::sqrt(squares / std::max(1e-9, weights)) / circle.radius;
  }

  double median_slope() const {
    std::vector<double> slopes;
    for (const Met& one : met_) slopes.push_back(one.slope);
    std::sort(slopes.begin(), slopes.end());
    return slopes[slopes.size() / 2];
  }

  // Normal equations of offset = dx cos + dy sin + dr, each unknown held at 0 by a fiftieth of the rays.
  void step(Circle& circle, double reach) const {
    std::vector<std::vector<double>> normal(3, std::vector<double>(3, 0.0));
    double right[3] = {};
    for (const Met& one : met_) {
      const double basis[3] = {one.cosine, one.sine, 1};
      for (std::size_t a = 0; a < 3; ++a) {
        right[a] += one.weight * basis[a] * one.offset;
        for (std::size_t b = 0; b < 3; ++b) normal[a][b] += one.weight * basis[a] * basis[b];
      }
    }
    for (std::size_t a = 0; a < 3; ++a) normal[a][a] += 0.02 * rays_.count;
    const auto inverse = test::inverse_of(normal);
    double by[3] = {};
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b) by[a] += inverse[a][b] * right[b];
    circle.x += std::clamp(by[0], -reach, reach);
    circle.y += std::clamp(by[1], -reach, reach);
    circle.radius += std::clamp(by[2], -reach / 2, reach / 2);
  }

  const EdgeMap& edges_;
  const Polarity polarity_;
  const RimRays rays_;
  std::vector<Met> met_;
};

// From starts all over the picture, good ones and others.
TEST(CirclesByHand, AreFittedToWhatTheirRaysMeet) {
  const EdgeMap edges = edges_with_circles();
  int supported = 0, refused = 0;
  for (const Polarity polarity : {Polarity::dark_beads, Polarity::bright_beads, Polarity::automatic})
    for (const RimRays& rays : {RimRays{}, RimRays{48, 0.15, 0.1, 0.5}})
      for (int row = -1; row < circles_height + 1; row += 7)
        for (int column = -1; column < circles_width + 1; column += 6) {
          const Circle start{column + 0.3, row + 0.6, 7 + 5 * test::scattered(column + 9, row + 9)};
          const Circle circle = fit_circle(edges, start, polarity, rays),
                       expected = CircleByHand(edges, polarity, rays).fit(start);
          ASSERT_NEAR(circle.x, expected.x, 1e-3) << column << ' ' << row;
          ASSERT_NEAR(circle.y, expected.y, 1e-3) << column << ' ' << row;
          ASSERT_NEAR(circle.radius, expected.radius, 1e-3) << column << ' ' << row;
          ASSERT_EQ(circle.met, expected.met) << column << ' ' << row;
          ASSERT_EQ(circle.rays, expected.rays) << column << ' ' << row;
          ASSERT_EQ(circle.directions, expected.directions);
          ASSERT_NEAR(circle.support, expected.support, 1e-9) << column << ' ' << row;
          ASSERT_NEAR(circle.scatter, expected.scatter, 1e-3) << column << ' ' << row;
          ASSERT_NEAR(circle.contrast, expected.contrast, 1e-2) << column << ' ' << row;
          supported += circle.support > 0.6 ? 1 : 0, refused += circle.support == 0 ? 1 : 0;
        }
  EXPECT_GT(supported, 20);
  EXPECT_GT(refused, 100);
}

// The distance of the edges in open directions, of a reach of 0.15 radii: the median, or nothing of too few.
TEST(CirclesByHand, HaveARadiusTowardsOpenSides) {
  const EdgeMap edges = edges_with_circles();
  for (const Circle& place : {Circle{18.3, 20.6, 9}, Circle{63.4, 40.2, 10.6}, Circle{3, 60, 9}, Circle{96, 21, 9}})
    for (const std::uint64_t open : {std::uint64_t{0xff00ff}, std::uint64_t{0xffffffff}, std::uint64_t{0x7}}) {
      Circle circle = place;
      circle.directions = 32;
      std::vector<double> distances;
      for (int k = 0; k < 32; ++k) {
        bool in_view = false;
        const auto met =
            CircleByHand(edges, Polarity::dark_beads, {})
                .along(circle, 2 * std::numbers::pi * k / 32, std::max(1.2, 0.15 * circle.radius), in_view);
        if ((open >> k & 1U) != 0 && met && in_view) distances.push_back(circle.radius + met->offset);
      }
      std::sort(distances.begin(), distances.end());
      for (const std::size_t fewest : {std::size_t{1}, distances.size(), distances.size() + 1}) {
        if (fewest == 0) continue;
        EXPECT_NEAR(radius_towards(edges, circle, Polarity::dark_beads, open, static_cast<int>(fewest)),
                    distances.size() < fewest ? 0 : distances[distances.size() / 2], 1e-3)
            << place.x << ' ' << open;
      }
    }
}

}  // namespace
}  // namespace shakebed::ingest
