// Outlines of drawn things of many shapes: the path along the steepest edges, its harmonics and its gaps once more.

#include "ingest/find/outline.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "ingest/find/circle_search.hpp"
#include "ingest/find/edge_map.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

constexpr int ways = 48;  // directions around a circle
double cosine_of(int k) { return std::cos(2 * std::numbers::pi * k / ways); }
double sine_of(int k) { return std::sin(2 * std::numbers::pi * k / ways); }
template <class Number>
Number middle_value(std::vector<Number> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// What one outline tells.
struct Traced {
  double x = 0, y = 0, on_circle = 0, gap = 0, deviation = 0, width = 0;
  std::array<std::complex<double>, 7> harmonic{};
  bool developed = false;
};

class TracedByHand {
 public:
  TracedByHand(const EdgeMap& edges, const std::vector<Circle>& circles, Polarity polarity)
      : edges_(edges), circles_(circles), sign_(polarity == Polarity::bright_beads ? -1.0F : 1.0F) {}

  // False for what is cut by the border.
  bool trace(const Circle& circle, Traced& out) {
    std::vector<float> rim;
    for (int k = 0; k < ways; ++k) {
      if (!in_view(circle, circle.radius, k)) return false;
      float most = 0;  // the steepest within 1.5 px of the circle
      for (double off = -1.5; off <= 1.5; off += 0.5) most = std::max(most, slope_at(circle, circle.radius + off, k));
      rim.push_back(most);
    }
    typical_ = std::max(static_cast<double>(edges_.threshold), static_cast<double>(middle_value(rim)));
    follow(circle);
    out = {};
    out.x = circle.x, out.y = circle.y;
    double clear = 0;
    for (int k = 0; k < ways; ++k) {
      clear += weight(k);
      if (std::abs(offset(k)) < 0.1) out.on_circle += weight(k);
    }
    out.on_circle = clear > 0 ? out.on_circle / clear : 0;
    out.gap = gap(circle);
    out.width = width(circle);
    if (clear >= 0.3 * ways) develop(clear, out);
    return true;
  }

 private:
  [[nodiscard]] bool in_view(const Circle& circle, double r, int k) const {
    const double x = circle.x + r * cosine_of(k), y = circle.y + r * sine_of(k);
    return x >= 1 && y >= 1 && x < edges_.width - 2 && y < edges_.height - 2;
  }
  // Of an edge whose gradient points along the radius, by 0.7 or more; between pixels.
  [[nodiscard]] float slope_at(const Circle& circle, double r, int k) const {
    if (!in_view(circle, r, k)) return 0;
    const double x = circle.x + r * cosine_of(k), y = circle.y + r * sine_of(k);
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const float u = static_cast<float>(x - column), v = static_cast<float>(y - row);
    const auto between = [&](const std::vector<float>& field) {
      const std::size_t at = edges_.at(column, row), below = edges_.at(column, row + 1);
      return (1 - v) * ((1 - u) * field[at] + u * field[at + 1]) + v * ((1 - u) * field[below] + u * field[below + 1]);
    };
    const float gx = between(edges_.x), gy = between(edges_.y), size = std::hypot(gx, gy);
    const float along = sign_ * (gx * static_cast<float>(cosine_of(k)) + gy * static_cast<float>(sine_of(k)));
    return size >= edges_.threshold && along >= 0.7F * size ? size : 0;
  }

  // The best way three times around, from 0.5 to 1.6 radii in steps of half a pixel; the middle turn counts. A step to
  // another ring costs up to 0.15 of a full edge, for the farthest of 0.11 radii.
  void follow(const Circle& circle) {
    rings_ = static_cast<int>(1.1 * circle.radius / 0.5) + 1;
    radius_ = circle.radius;
    score_.assign(static_cast<std::size_t>(ways), {});
    for (int k = 0; k < ways; ++k)
      for (int ring = 0; ring < rings_; ++ring)
        score_[static_cast<std::size_t>(k)].push_back(
            std::min(1.0F, slope_at(circle, 0.5 * circle.radius + 0.5 * ring, k) / static_cast<float>(typical_)));
    const int farthest = std::max(1, static_cast<int>(std::lround(0.11 * circle.radius / 0.5)));
    const auto cost = static_cast<float>(0.15 / farthest);
    std::vector<std::vector<int>> came(static_cast<std::size_t>(3 * ways), std::vector<int>(score_[0].size(), 0));
    std::vector<float> value = score_[0];
    for (int step = 1; step < 3 * ways; ++step) {
      std::vector<float> next;
      for (int ring = 0; ring < rings_; ++ring) {
        float best = -1e9F;
        for (int from = std::max(0, ring - farthest); from <= std::min(rings_ - 1, ring + farthest); ++from) {
          const float here = value[static_cast<std::size_t>(from)] - cost * static_cast<float>(std::abs(from - ring));
          if (here <= best) continue;
          best = here;
          came[static_cast<std::size_t>(step)][static_cast<std::size_t>(ring)] = from;
        }
        next.push_back(best + score_[static_cast<std::size_t>(step % ways)][static_cast<std::size_t>(ring)]);
      }
      value = next;
    }
    int ring = static_cast<int>(std::max_element(value.begin(), value.end()) - value.begin());
    path_.assign(static_cast<std::size_t>(ways), 0);
    for (int step = 3 * ways - 1; step >= ways; --step) {
      if (step < 2 * ways) path_[static_cast<std::size_t>(step - ways)] = ring;
      ring = came[static_cast<std::size_t>(step)][static_cast<std::size_t>(ring)];
    }
  }
  [[nodiscard]] double score(int k, int by = 0) const {
    return static_cast<double>(
        score_[static_cast<std::size_t>(k)][static_cast<std::size_t>(path_[static_cast<std::size_t>(k)] + by)]);
  }
  // From the circle, radii: the top of the parabola through three rings.
  [[nodiscard]] double offset(int k) const {
    const int ring = path_[static_cast<std::size_t>(k)];
    double part = 0;
    if (ring > 0 && ring + 1 < rings_) {
      const double bend = score(k, -1) - 2 * score(k) + score(k, 1);
      if (bend < 0) part = std::clamp(0.5 * (score(k, -1) - score(k, 1)) / bend, -0.5, 0.5);
    }
    return (0.5 * radius_ + 0.5 * (ring + part)) / radius_ - 1;
  }
  // Faint edges, up to 0.65 of a typical one, do not count, those from 0.9 on in full.
  [[nodiscard]] double weight(int k) const { return std::clamp((score(k) - 0.65) / 0.25, 0.0, 1.0); }

  [[nodiscard]] double gap(const Circle& circle) const {
    std::array<bool, ways> open{};
    for (int k = 0; k < ways; ++k) {
      const bool hidden = std::any_of(circles_.begin(), circles_.end(), [&](const Circle& other) {
        const double dx = other.x - circle.x, dy = other.y - circle.y, away = std::hypot(dx, dy);
        return away >= 0.1 * circle.radius && away <= 2.6 * circle.radius &&
               dx * cosine_of(k) + dy * sine_of(k) > away * std::cos(0.45);
      });
      const bool met = score(k) > 0 && std::abs(offset(k)) < 0.15;
      open[static_cast<std::size_t>(k)] = !met && !hidden;
      if (!met && hidden) between_.push_back(k);
    }
    // The longest part of the turn with open directions, in which hidden ones do not count.
    int longest = 0;
    for (int first = 0; first < ways; ++first) {
      int run = 0;
      for (int step = 0; step < ways; ++step) {
        const int k = (first + step) % ways;
        const bool neutral = std::find(between_.begin(), between_.end(), k) != between_.end();
        if (!open[static_cast<std::size_t>(k)] && !neutral) break;
        run += open[static_cast<std::size_t>(k)];
      }
      longest = std::max(longest, run);
    }
    between_.clear();
    return static_cast<double>(longest) / ways;
  }

  // Of the slope averaged over all directions, between half of its steepest on either side, less that of a step.
  [[nodiscard]] double width(const Circle& circle) const {
    std::vector<double> slope;
    int top = 0;
    for (double r = 0.1 * circle.radius; r < 2 * circle.radius; r += 0.25) {
      double sum = 0;
      for (int k = 0; k < ways; ++k) {
        if (!in_view(circle, r, k)) continue;
        const std::size_t at = edges_.at(static_cast<int>(circle.x + r * cosine_of(k) + 0.5),
                                         static_cast<int>(circle.y + r * sine_of(k) + 0.5));
        sum += static_cast<double>(sign_) *
               (static_cast<double>(edges_.x[at]) * cosine_of(k) + static_cast<double>(edges_.y[at]) * sine_of(k));
      }
      slope.push_back(sum);
      if (std::abs(r - circle.radius) < 0.1 * circle.radius + 1 && sum > slope[static_cast<std::size_t>(top)])
        top = static_cast<int>(slope.size()) - 1;
    }
    int first = top, last = top;
    const auto steep = [&](int k) {
      return slope[static_cast<std::size_t>(k)] > 0.5 * slope[static_cast<std::size_t>(top)];
    };
    while (first > 0 && steep(first)) --first;
    while (last + 1 < static_cast<int>(slope.size()) && steep(last)) ++last;
    const double whole = 0.25 * (last - first);
    return std::sqrt(std::max(0.0, whole * whole - 2.6 * 2.6)) / circle.radius;
  }

  // Weighted least squares of 13 terms; those from the second harmonic on are held at 0 by 0.02 of all directions.
  void develop(double clear, Traced& out) const {
    std::vector<std::vector<double>> normal(13, std::vector<double>(13, 0.0));
    std::vector<double> right(13, 0.0);
    const auto term = [](int p, int k) {
      const double angle = 2 * std::numbers::pi * ((p + 1) / 2) * k / ways;
      return p == 0 ? 1 : p % 2 == 1 ? std::cos(angle) : std::sin(angle);
    };
    for (int k = 0; k < ways; ++k)
      for (int p = 0; p < 13; ++p) {
        right[static_cast<std::size_t>(p)] += weight(k) * term(p, k) * offset(k);
        for (int q = 0; q < 13; ++q)
          normal[static_cast<std::size_t>(p)][static_cast<std::size_t>(q)] += weight(k) * term(p, k) * term(q, k);
      }
    for (std::size_t p = 0; p < 13; ++p) normal[p][p] += p < 3 ? 1e-6 : 0.02 * ways;
    const auto inverse = test::inverse_of(normal);
    std::array<double, 13> amplitude{};
    for (std::size_t p = 0; p < 13; ++p)
      for (std::size_t q = 0; q < 13; ++q) amplitude[p] += inverse[p][q] * right[q];
    double squares = 0, on_its_own = 0;
    for (int k = 0; k < ways; ++k) {
      double shape = 0;
      const double circle = amplitude[0] + amplitude[1] * term(1, k) + amplitude[2] * term(2, k);
      if (std::abs(offset(k) - circle) < 0.1) on_its_own += weight(k);
      for (int p = 3; p < 13; ++p) shape += amplitude[static_cast<std::size_t>(p)] * term(p, k);
      squares += weight(k) * shape * shape;
    }
    out.on_circle = on_its_own / clear;
    out.deviation = std::sqrt(squares / clear);
    for (std::size_t q = 2; q <= 6; ++q) out.harmonic[q] = {amplitude[2 * q - 1], amplitude[2 * q]};
    out.developed = true;
  }

  const EdgeMap& edges_;
  const std::vector<Circle>& circles_;
  float sign_;
  double typical_ = 1, radius_ = 1;
  int rings_ = 1;
  std::vector<std::vector<float>> score_;
  std::vector<int> path_;
  mutable std::vector<int> between_;
};

// Medians over the outlines; without the second harmonic that all share.
void expect_same_outlines(const EdgeMap& edges, const std::vector<Circle>& circles, Polarity polarity,
                          const std::string& name) {
  TracedByHand tracer(edges, circles, polarity);
  std::vector<Traced> all;
  Traced one;
  for (const Circle& circle : circles)
    if (tracer.trace(circle, one)) all.push_back(one);
  std::complex<double> shared = 0;
  double developed = 0;
  for (const Traced& each : all)
    if (each.developed) shared += each.harmonic[2], ++developed;
  if (developed > 0) shared /= developed;
  std::vector<double> on_circle, gap, width, deviation;
  std::array<std::vector<double>, 7> harmonic;
  double not_round = 0;
  for (const Traced& each : all) {
    // A harmonic of amplitude a has a mean square of a^2/2.
    const double own = std::sqrt(std::max(0.0, each.deviation * each.deviation - 0.5 * std::norm(each.harmonic[2]) +
                                                   0.5 * std::norm(each.harmonic[2] - shared)));
    on_circle.push_back(each.on_circle), gap.push_back(each.gap), width.push_back(each.width);
    not_round += own > 0.045 || each.on_circle < 0.85 || each.gap > 0.3;
    if (!each.developed) continue;
    deviation.push_back(own);
    for (std::size_t q = 2; q <= 6; ++q) harmonic[q].push_back(std::abs(each.harmonic[q]));
  }
  const Roundness found = roundness_of(edges, circles, polarity);
  ASSERT_EQ(found.outlines, all.size()) << name;
  ASSERT_FALSE(all.empty()) << name;
  EXPECT_NEAR(found.on_circle, middle_value(on_circle), 1e-6) << name;
  EXPECT_NEAR(found.gap, middle_value(gap), 1e-9) << name;
  EXPECT_NEAR(found.rim_width, middle_value(width), 1e-9) << name;
  EXPECT_NEAR(found.not_round, not_round / static_cast<double>(all.size()), 1e-9) << name;
  if (deviation.empty()) return;
  EXPECT_NEAR(found.deviation, middle_value(deviation), 1e-6) << name;
  EXPECT_NEAR(found.common_elongation, std::abs(shared), 1e-6) << name;
  for (std::size_t q = 2; q <= 6; ++q)
    EXPECT_NEAR(found.harmonic[q], middle_value(harmonic[q]), 1e-6) << name << ' ' << q;
}

// Things r = R (1 + sum of harmonics) at places, some of them open on one side or beside one another, of two levels.
GrayFrame outlined_frame(const std::vector<Circle>& circles, double shape, int pattern, bool bright) {
  return test::frame_by(150, 110, [&](int column, int row) {
    double level = 0;
    for (std::size_t k = 0; k < circles.size(); ++k) {
      const Circle& one = circles[k];
      const double dx = column - one.x, dy = row - one.y, angle = std::atan2(dy, dx);
      double radius = one.radius;
      for (int q = 2; q <= 5; ++q)
        radius += one.radius * shape * test::scattered(static_cast<int>(k) + 3 * q, pattern) *
                  std::cos(q * (angle - 6 * test::scattered(q, static_cast<int>(k))));
      double here = 0.5 * std::erfc((std::hypot(dx, dy) - radius) / 1.3);
      if (k % 4 == 1 && angle > 0.5 && angle < 2.2) here *= 0.25;  // hardly seen there
      level = std::max(level, here);
    }
    return 150 + (bright ? 80 : -80) * level + 4 * (test::scattered(column, row) - 0.5);
  });
}

TEST(OutlinesByHand, AreFollowedAsTheirRulesSay) {
  for (int pattern = 0; pattern < 4; ++pattern) {
    std::vector<Circle> circles;
    for (int k = 0; k < 12; ++k)
      circles.push_back({20.0 + 31 * (k % 4) + 6 * test::scattered(k, pattern), 20.0 + 31 * (k / 4), 11.0 + k % 3});
    circles.push_back({4, 60, 12});  // cut by the border
    const bool bright = pattern % 2 == 1;
    const EdgeMap edges = find_edges(outlined_frame(circles, 0.02 + 0.05 * pattern, pattern, bright));
    expect_same_outlines(edges, circles, bright ? Polarity::bright_beads : Polarity::dark_beads,
                         "pattern " + std::to_string(pattern));
  }
}

// Circles that are off by a part of their radius, and one alone.
TEST(OutlinesByHand, AreThoseOfCirclesThatAreOff) {
  const std::vector<Circle> truth = {{30, 30, 14}, {58, 31, 14}, {100, 40, 17}, {44, 76, 13}, {110, 84, 12}};
  const EdgeMap edges = find_edges(outlined_frame(truth, 0.03, 7, false));
  std::vector<Circle> off = truth;
  for (std::size_t k = 0; k < off.size(); ++k) off[k].x += 2.0 * static_cast<double>(k) - 3, off[k].radius *= 1.08;
  expect_same_outlines(edges, off, Polarity::dark_beads, "off");
  for (const Circle& one : truth) expect_same_outlines(edges, {one}, Polarity::dark_beads, "alone");
}

// Squares on one side, disks on the other: the cut runs half way between them, by rows as well as by columns. Chance is
// excluded where there are enough.
TEST(OutlinesByHand, TellOnWhichSideTheyAreRound) {
  for (const bool left_or_right : {true, false})
    for (const bool round_beyond : {true, false})
      for (const int lines : {4, 2}) {
        std::vector<Circle> circles;
        for (int along = 0; along < 2 * lines; ++along)
          for (int across = 0; across < 4; ++across)
            circles.push_back(
                {18.0 + 30 * (left_or_right ? along : across), 18.0 + 30 * (left_or_right ? across : along), 11});
        const double cut = 18 + 30 * (lines - 0.5);
        const GrayFrame frame = test::frame_by(
            left_or_right ? 60 * lines + 6 : 126, left_or_right ? 126 : 60 * lines + 6, [&](int column, int row) {
              const double u = std::remainder(column - 18.0, 30), v = std::remainder(row - 18.0, 30);
              const bool is_round = ((left_or_right ? column : row) > cut) == round_beyond;
              const double away = is_round ? std::hypot(u, v) - 11 : std::max(std::abs(u), std::abs(v)) - 10;
              return 150 - 80 * 0.5 * std::erfc(away / 1.3);
            });
        const Roundness found = roundness_of(find_edges(frame), circles, Polarity::dark_beads);
        // 16 of 16 against none of 16 are no chance, 8 against 8 are, by one in 10,000 for each of the cuts tried.
        ASSERT_EQ(found.round_side.has_value(), lines == 4) << left_or_right << round_beyond;
        if (!found.round_side) continue;
        EXPECT_EQ(found.round_side->left_or_right, left_or_right);
        EXPECT_EQ(found.round_side->beyond, round_beyond);
        EXPECT_NEAR(found.round_side->at, cut, 1e-9);
        EXPECT_FALSE(found.round());
        EXPECT_NEAR(found.not_round, 0.5, 1e-9);
      }
}

// Circles of beads that others cover in part are smaller than those of beads that lie alone.
TEST(OutlinesByHand, AreRoundAboutCirclesOfAnotherSize) {
  std::vector<Circle> circles;
  for (int along = 0; along < 8; ++along)
    for (int across = 0; across < 4; ++across)
      circles.push_back({18.0 + 30 * along, 18.0 + 30 * across, along < 4 ? 11 : 9.5});
  const GrayFrame frame = test::frame_by(246, 126, [&](int column, int row) {
    const double away = std::hypot(std::remainder(column - 18.0, 30), std::remainder(row - 18.0, 30)) - 11;
    return 150 - 80 * 0.5 * std::erfc(away / 1.3);
  });
  const Roundness found = roundness_of(find_edges(frame), circles, Polarity::dark_beads);
  EXPECT_TRUE(found.round()) << found.why_not();
  EXPECT_EQ(found.not_round, 0);
  EXPECT_FALSE(found.round_side);
}

TEST(OutlinesByHand, APartIsThePixelsOfItsSide) {
  const auto part = [](const SideOfCut& side) {
    const PixelRectangle one = part_on(side, 100, 70);
    return std::array{one.left, one.top, one.width, one.height};
  };
  EXPECT_EQ(part({true, false, 30.4}), (std::array{0, 0, 30, 70}));
  EXPECT_EQ(part({true, true, 30.6}), (std::array{31, 0, 69, 70}));
  EXPECT_EQ(part({false, false, 30.4}), (std::array{0, 0, 100, 30}));
  EXPECT_EQ(part({false, true, 30.6}), (std::array{0, 31, 100, 39}));
  EXPECT_EQ(part({true, false, -5}), (std::array{0, 0, 1, 70}));
  EXPECT_EQ(part({false, true, 500}), (std::array{0, 69, 100, 1}));
}

}  // namespace
}  // namespace shakebed::ingest
