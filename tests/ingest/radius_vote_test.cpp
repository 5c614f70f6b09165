// Radii by votes of edges, and which of them are the beads': the rules written once more, on small pictures.

#include "ingest/calibrate/radius_vote.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "ingest/calibrate/calibration.hpp"
#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

// The value of this rank, the smallest being 0 and the largest 1; ranks are rounded down.
double ranked(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

// Votes as they are described in radius_vote.cpp, in tables of doubles.
class VotesByHand {
 public:
  explicit VotesByHand(const GrayFrame& frame) : width_(frame.width), height_(frame.height) {
    gradient_.assign(frame.pixels.size(), {0, 0});
    for (int y = 1; y + 1 < height_; ++y)
      for (int x = 1; x + 1 < width_; ++x) {
        double across = 0, down = 0;  // Sobel: 1 2 1 along the other axis
        for (int k = -1; k <= 1; ++k) {
          const double weight = (k == 0 ? 2 : 1) / 8.0;
          across += weight * static_cast<double>(frame.at(x + 1, y + k) - frame.at(x - 1, y + k));
          down += weight * static_cast<double>(frame.at(x + k, y + 1) - frame.at(x + k, y - 1));
        }
        if (std::abs(across) < 1000 && std::abs(down) < 1000) gradient_[at(x, y)] = {across, down};
      }
    choose_edges();
  }

  struct Edge {
    int x, y;
    double unit_x, unit_y, weight;
  };
  [[nodiscard]] const std::vector<Edge>& edges() const { return edges_; }

  std::vector<RadiusCandidate> candidates(double sign, double from, double to) {
    const int count = static_cast<int>(std::ceil(std::log(to / from) / std::log(1.04))) + 1;
    std::vector<double> sharpness;
    for (int k = 0; k < count; ++k) {
      sharpness.push_back(0);
      for (const double sum : sums_for(sign, from * std::pow(1.04, k))) sharpness.back() += sum * sum;
    }
    std::vector<int> maxima;
    for (int k = 0; k < count; ++k) {
      const auto value = [&](int i) { return sharpness[static_cast<std::size_t>(i)]; };
      if ((k == 0 || value(k - 1) <= value(k)) && (k + 1 == count || value(k + 1) < value(k))) maxima.push_back(k);
    }
    std::sort(maxima.begin(), maxima.end(), [&](int a, int b) {
      return sharpness[static_cast<std::size_t>(a)] > sharpness[static_cast<std::size_t>(b)];
    });
    maxima.resize(std::min<std::size_t>(3, maxima.size()));
    std::vector<RadiusCandidate> all;
    for (const int k : maxima) {
      double place = k;
      if (k > 0 && k + 1 < count) {  // the top of the parabola through three
        const auto i = static_cast<std::size_t>(k);
        const double left = sharpness[i] - sharpness[i - 1], right = sharpness[i] - sharpness[i + 1];
        if (left + right > 0) place += std::clamp(0.5 * (left - right) / (left + right), -0.5, 0.5);
      }
      judge(sign, from * std::pow(1.04, place), all);
    }
    return all;
  }

 private:
  [[nodiscard]] std::size_t at(int x, int y) const { return static_cast<std::size_t>(y * width_ + x); }
  [[nodiscard]] double size(std::size_t i) const { return std::hypot(gradient_[i][0], gradient_[i][1]); }

  void choose_edges() {
    std::vector<double> sizes;
    for (std::size_t i = 0; i < gradient_.size(); ++i) sizes.push_back(size(i));
    const double strong = ranked(sizes, 0.98), quiet = ranked(sizes, 0.25) / 0.7585, strongest = ranked(sizes, 1);
    const double reference = strong > 0.1 * strongest ? strong : 0.5 * strongest;
    threshold_ = std::max({3 * quiet, 0.2 * reference, 1e-3});
    for (int y = 1; y + 1 < height_; ++y)
      for (int x = 1; x + 1 < width_; ++x)
        if (const double here = size(at(x, y)); here >= threshold_)
          edges_.push_back(
              {x, y, gradient_[at(x, y)][0] / here, gradient_[at(x, y)][1] / here, std::min(here, reference)});
  }

  // Votes for centres, summed over 3 x 3 pixels.
  [[nodiscard]] std::vector<double> sums_for(double sign, double radius) const {
    std::vector<double> votes(gradient_.size(), 0.0), sums = votes;
    for (const Edge& edge : edges_) {
      const double x = std::floor(edge.x - sign * radius * edge.unit_x + 0.5),
                   y = std::floor(edge.y - sign * radius * edge.unit_y + 0.5);
      if (x >= 1 && y >= 1 && x < width_ - 1 && y < height_ - 1)
        votes[at(static_cast<int>(x), static_cast<int>(y))] += edge.weight;
    }
    for (int y = 1; y + 1 < height_; ++y)
      for (int x = 1; x + 1 < width_; ++x)
        for (int k = 0; k < 9; ++k) sums[at(x, y)] += votes[at(x + k % 3 - 1, y + k / 3 - 1)];
    return sums;
  }

  // Of the directions around a place that are in view: the share in which the gradient points along the radius.
  [[nodiscard]] double support(double sign, double radius, int x, int y) const {
    const int samples = std::clamp(static_cast<int>(4 * radius), 12, 48);
    int inside = 0, met = 0;
    for (int k = 0; k < samples; ++k) {
      const double angle = 2 * std::numbers::pi * k / samples, c = std::cos(angle), s = std::sin(angle);
      const double u = x + 0.5 + radius * c, v = y + 0.5 + radius * s;
      if (u < 1 || v < 1 || u >= width_ - 1 || v >= height_ - 1) continue;
      ++inside;
      const std::size_t i = at(static_cast<int>(u), static_cast<int>(v));
      met += size(i) > threshold_ && sign * (gradient_[i][0] * c + gradient_[i][1] * s) > 0.8 * size(i);
    }
    return inside < samples / 2 ? 0 : static_cast<double>(met) / inside;
  }

  void judge(double sign, double radius, std::vector<RadiusCandidate>& all) const {
    const std::vector<double> sums = sums_for(sign, radius);
    struct Top {
      double score;
      int x, y;
    };
    std::vector<Top> tops, kept;
    for (int y = 1; y + 1 < height_; ++y)
      for (int x = 1; x + 1 < width_; ++x) {
        const double here = sums[at(x, y)];
        if (here > 0 && here >= sums[at(x - 1, y)] && here > sums[at(x + 1, y)] && here >= sums[at(x, y - 1)] &&
            here > sums[at(x, y + 1)])
          tops.push_back({here, x, y});
      }
    std::stable_sort(tops.begin(), tops.end(), [](const Top& a, const Top& b) { return a.score > b.score; });
    const int off = std::max(1, static_cast<int>(1.2 * radius));
    RadiusCandidate found;
    for (const Top& top : tops) {
      const double its = support(sign, radius, top.x, top.y);
      if (its < 0.45 || std::any_of(kept.begin(), kept.end(), [&](const Top& other) {
            return std::abs(other.x - top.x) <= off && std::abs(other.y - top.y) <= off;
          }))
        continue;
      kept.push_back(top);
      found.explained += top.score, found.support += its * top.score;
    }
    if (kept.empty()) return;
    double weights = 0;
    for (const Edge& edge : edges_) weights += edge.weight;
    found.radius = radius, found.sign = sign, found.count = kept.size();
    found.support /= found.explained, found.explained /= weights;
    if (kept.size() >= 10) {  // to the second nearest of the others
      std::vector<double> second;
      for (const Top& one : kept) {
        std::vector<double> away;
        for (const Top& other : kept) away.push_back(std::hypot(other.x - one.x, other.y - one.y));
        std::sort(away.begin(), away.end());  // the first is the place itself
        second.push_back(away[2]);
      }
      found.spacing = {ranked(second, 0.5), 0.5 * (ranked(second, 0.75) - ranked(second, 0.25))};
    }
    all.push_back(found);
  }

  int width_, height_;
  std::vector<std::array<double, 2>> gradient_;
  double threshold_ = 0;
  std::vector<Edge> edges_;
};

std::vector<RadiusCandidate> votes_by_hand(const GrayFrame& frame, double scale, double from, double to) {
  VotesByHand votes(frame);
  std::vector<RadiusCandidate> all;
  if (votes.edges().size() < 12) return all;
  for (const double sign : {1.0, -1.0})
    for (RadiusCandidate one : votes.candidates(sign, from, to)) {
      one.radius *= scale, one.spacing.median *= scale, one.spacing.scatter *= scale;
      all.push_back(one);
    }
  return all;
}

void expect_same_votes(const GrayFrame& frame, double scale, double from, double to, const std::string& name) {
  const auto found = vote_for_radii(frame, scale, {from, to}), expected = votes_by_hand(frame, scale, from, to);
  ASSERT_EQ(found.size(), expected.size()) << name;
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_NEAR(found[k].radius / expected[k].radius, 1, 1e-5) << name << ' ' << k;
    EXPECT_EQ(found[k].sign, expected[k].sign);
    EXPECT_EQ(found[k].count, expected[k].count) << name << ' ' << k;
    EXPECT_NEAR(found[k].explained, expected[k].explained, 1e-5) << name << ' ' << k;
    EXPECT_NEAR(found[k].support, expected[k].support, 1e-5) << name << ' ' << k;
    EXPECT_NEAR(found[k].spacing.median, expected[k].spacing.median, 1e-4) << name << ' ' << k;
    EXPECT_NEAR(found[k].spacing.scatter, expected[k].spacing.scatter, 1e-4) << name << ' ' << k;
  }
}

// Disks of 4 px, of which some are cut, on a ground with something else, and a part of the picture unseen.
GrayFrame voted_picture(int pattern, double bead, double noise) {
  Camera camera;
  camera.width = 66, camera.height = 57;
  camera.background_level = 140, camera.bead_level = bead;
  camera.blur_px = 0.7, camera.read_noise = noise, camera.seed = static_cast<std::uint64_t>(pattern) + 1;
  camera.round_to_8_bits = false;
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < 24; ++k) {
    const double x = 4.3 + 11.3 * (k % 6) + 2.5 * test::scattered(k, pattern),
                 y = 3.7 + 13.1 * (k / 6) + 2.5 * test::scattered(pattern, 2 * k);
    disks.push_back({x, y, k % 5 == 4 ? 2.6 : 4.0, 0, 0});
  }
  return render_frame(disks, camera);
}

TEST(RadiusVote, CountsAsItsRulesSay) {
  for (int pattern = 0; pattern < 4; ++pattern) {
    GrayFrame frame = voted_picture(pattern, pattern % 2 == 0 ? 60 : 210, 1.5 + pattern);
    if (pattern == 1)
      for (int k = 0; k < 40; ++k) test::set(frame, 20 + k % 8, 30 + k / 8, unseen_level);
    expect_same_votes(frame, 1, 2, 7, "picture " + std::to_string(pattern));
    expect_same_votes(frame, 4, 3.1, 5.2, "reduced " + std::to_string(pattern));
  }
}

// Centres in the first and the last rows and columns that can have a peak, and one farther out.
TEST(RadiusVote, CountsAlongTheBorders) {
  Camera camera;
  camera.width = 66, camera.height = 57;
  camera.background_level = 140, camera.blur_px = 0.7, camera.read_noise = 1, camera.round_to_8_bits = false;
  const std::vector<RenderedDisk> disks = {{20, 1, 5, 0, 0},  {48, 0, 5, 0, 0},  {1, 24, 5, 0, 0}, {64, 30, 5, 0, 0},
                                           {17, 55, 5, 0, 0}, {44, 56, 5, 0, 0}, {33, 28, 5, 0, 0}};
  const GrayFrame frame = render_frame(disks, camera);
  expect_same_votes(frame, 1, 4, 6.5, "borders");
  const auto all = vote_for_radii(frame, 1, {4, 6.5});
  EXPECT_TRUE(std::any_of(all.begin(), all.end(), [](const RadiusCandidate& one) { return one.count >= 5; }));
}

// The spacing of nine circles is not known, that of ten is: rows of five, 14 px apart, or of four and five.
TEST(RadiusVote, KnowsTheSpacingOfTenCircles) {
  for (const int count : {9, 10}) {
    Camera camera;
    camera.width = 80, camera.height = 45;
    camera.blur_px = 0.6, camera.round_to_8_bits = false;
    std::vector<RenderedDisk> disks;
    for (int k = 0; k < count; ++k) disks.push_back({12.0 + 14 * (k % 5), 14.0 + 14 * (k / 5), 4, 0, 0});
    const GrayFrame frame = render_frame(disks, camera);
    const auto all = vote_for_radii(frame, 1, {3, 5});
    const auto best = std::max_element(all.begin(), all.end(), [](const RadiusCandidate& a, const RadiusCandidate& b) {
      return a.explained * a.support < b.explained * b.support;
    });
    ASSERT_NE(best, all.end());
    EXPECT_EQ(best->count, static_cast<std::size_t>(count));
    EXPECT_NEAR(best->spacing.median, count == 10 ? 14 : 0, 0.8);
  }
}

// One small disk in an even picture: 98 % of the pixels have no gradient, so that the reference is half of the
// steepest. Fewer than twelve edges do not vote.
TEST(RadiusVote, OfALoneDiskIsThatOfItsEdges) {
  Camera camera;
  camera.width = 90, camera.height = 80;
  camera.blur_px = 0.6, camera.round_to_8_bits = false;
  const GrayFrame lone = render_frame({{41.3, 36.6, 3, 0, 0}}, camera);
  expect_same_votes(lone, 1, 1.5, 6, "lone");
  const auto best = vote_for_radii(lone, 1, {1.5, 6}).front();
  EXPECT_EQ(best.count, 1U);
  EXPECT_EQ(best.spacing.median, 0);
  EXPECT_NEAR(best.radius, 3, 0.3);
  for (const int wide : {2, 3}) {  // a square of so many pixels has (wide + 2)^2 - 4 edges around it at least
    GrayFrame square = test::even_frame(30, 30, 100);
    for (int k = 0; k < wide; ++k) test::set(square, 14 + k, 14, 160);
    EXPECT_EQ(vote_for_radii(square, 1, {1, 3}).empty(), votes_by_hand(square, 1, 1, 3).empty()) << wide;
    expect_same_votes(square, 1, 1, 3, "square");
  }
  GrayFrame point = test::even_frame(30, 30, 100);
  test::set(point, 14, 14, 160);  // eight edges
  EXPECT_TRUE(vote_for_radii(point, 1, {1, 3}).empty());
}

// --- which of the candidates are the beads ---------------------------------------------------------------------------

// The rules of calibration.cpp: on each level of a pyramid the radii that are large enough there.
std::vector<RadiusCandidate> radii_by_hand(const GrayFrame& frame, double smallest, double largest) {
  std::vector<RadiusCandidate> all;
  GrayFrame level = frame;
  double low = std::max(1.0, smallest);
  for (double scale = 1; low < largest && std::min(level.width, level.height) >= 5; scale *= 2) {
    if (const double high = std::min(largest, 8.5 * scale); high > low) {
      const PicturePart part = busiest_part(level, 340, {.block = 20, .reach = 1, .stride = 1});
      for (const RadiusCandidate& one : vote_for_radii(cut_out(level, part), scale, {low / scale, high / scale}))
        all.push_back(one);
    }
    low = 7.5 * scale;
    level = halved(level);
  }
  return all;
}
Polarity seen_as(const RadiusCandidate& one) { return one.sign > 0 ? Polarity::dark_beads : Polarity::bright_beads; }

struct ExpectedRadius {
  bool found = false;
  double radius = 0, score = 0, packed = 0;
  bool packed_likely = false;
  Polarity polarity = Polarity::automatic, packed_polarity = Polarity::automatic;
  std::vector<std::pair<double, Polarity>> others;
};
ExpectedRadius choice_by_hand(const std::vector<RadiusCandidate>& all, double shorter, Polarity asked) {
  const auto merit = [&](const RadiusCandidate& one) {
    const bool outline = one.count < 5 && one.radius > 0.2 * shorter && one.support < 0.85;
    return (outline ? 0.01 : 1) * one.explained * one.support * one.support;
  };
  const auto asked_for = [&](const RadiusCandidate& one) {
    return asked == Polarity::automatic || seen_as(one) == asked;
  };
  ExpectedRadius expected;
  const RadiusCandidate *best = nullptr, *beads = nullptr, *voids = nullptr;
  for (const auto& one : all)
    if (asked_for(one) && (!best || merit(one) > merit(*best))) best = &one;
  if (!best) return expected;
  for (const auto& one : all)  // around voids of the other polarity
    if (asked_for(one) && one.sign != best->sign && one.radius >= 2.2 * best->radius &&
        one.radius <= 7 * best->radius && merit(one) > 0.4 * merit(*best) && (!beads || merit(one) > merit(*beads)))
      beads = &one;
  if (beads) best = beads;
  std::vector<RadiusCandidate> ranking = all;
  std::sort(ranking.begin(), ranking.end(), [&](const auto& a, const auto& b) { return merit(a) > merit(b); });
  for (const auto& one : ranking) {
    const bool known = std::any_of(expected.others.begin(), expected.others.end(), [&](const auto& other) {
      return other.second == seen_as(one) && std::abs(std::log(other.first / one.radius)) < std::log(1.15);
    });
    if (asked_for(one) && !known && merit(one) >= 0.004 && expected.others.size() < 4)
      expected.others.emplace_back(one.radius, seen_as(one));
  }
  expected.radius = best->radius, expected.polarity = seen_as(*best);
  expected.score = best->explained * best->support;
  for (const auto& one : all) {
    const double apart = one.spacing.median / one.radius;
    if (apart >= 2.6 && apart <= 9 && merit(one) >= 0.3 * merit(*best) &&
        (asked == Polarity::automatic || !asked_for(one)) && (!voids || merit(one) > merit(*voids)))
      voids = &one;
  }
  if (voids) {
    const double radius = 0.5 * std::sqrt(3.0) * voids->spacing.median;
    const Polarity around = voids->sign > 0 ? Polarity::bright_beads : Polarity::dark_beads;
    if (around != expected.polarity || std::abs(radius / expected.radius - 1) > 0.1) {
      expected.packed = radius, expected.packed_polarity = around;
      expected.packed_likely = voids->spacing.scatter < 0.1 * voids->spacing.median;
    }
  }
  expected.found = merit(*best) >= 0.02;
  if (!expected.found && expected.packed > 0)
    expected.others.insert(expected.others.begin(), {expected.packed, expected.packed_polarity});
  return expected;
}

void expect_same_choice(const GrayFrame& frame, const std::string& name) {
  const double shorter = std::min(frame.width, frame.height);
  for (const double largest : {0.0, 14.0}) {
    const auto all = radii_by_hand(frame, 1.2, largest > 0 ? largest : shorter / 2.2);
    for (const Polarity asked : {Polarity::automatic, Polarity::dark_beads, Polarity::bright_beads}) {
      const RadiusEstimate found = estimate_radius(frame, asked, smallest_voted_px, largest);
      const ExpectedRadius expected = choice_by_hand(all, shorter, asked);
      ASSERT_EQ(found.found, expected.found) << name;
      EXPECT_EQ(found.why_not.empty(), found.found);
      EXPECT_NEAR(found.radius_px, expected.radius, 1e-9) << name;
      EXPECT_EQ(found.polarity, expected.polarity) << name;
      EXPECT_NEAR(found.score, expected.score, 1e-12) << name;
      EXPECT_NEAR(found.packed_radius_px, expected.packed, 1e-9) << name;
      EXPECT_EQ(found.packed_polarity, expected.packed_polarity) << name;
      EXPECT_EQ(found.packed_likely, expected.packed_likely) << name;
      ASSERT_EQ(found.others.size(), expected.others.size()) << name;
      for (std::size_t k = 0; k < found.others.size(); ++k) {
        EXPECT_NEAR(found.others[k].radius_px, expected.others[k].first, 1e-9) << name;
        EXPECT_EQ(found.others[k].polarity, expected.others[k].second) << name;
      }
    }
  }
}

// Crystals of several sizes and blurs, in which voids are seen as well as beads; noise; and disks far apart.
TEST(RadiusChoice, ChoosesAsItsRulesSay) {
  for (int pattern = 0; pattern < 5; ++pattern) {
    SyntheticBed bed;
    bed.radius_px = std::array{4.5, 6.0, 8.0, 9.5, 5.0}[static_cast<std::size_t>(pattern)];
    bed.left_wall_px = 3, bed.right_wall_px = 79, bed.floor_px = 68;
    bed.rows = static_cast<int>(60 / (std::sqrt(3.0) * bed.radius_px)), bed.jitter_px = pattern == 4 ? 1.5 : 0;
    Camera camera;
    camera.width = 82, camera.height = 72;
    camera.blur_px = std::array{1.2, 0.5, 1.6, 0.8, 2.0}[static_cast<std::size_t>(pattern)], camera.read_noise = 3;
    if (pattern % 2) std::swap(camera.background_level, camera.bead_level);
    expect_same_choice(render_frame(make_synthetic_bed(bed), camera), "crystal " + std::to_string(pattern));
  }
  RandomStream random(3);
  expect_same_choice(test::frame_by(90, 70, [&](int, int) { return 100 + 10 * random.normal(); }), "noise");
  expect_same_choice(voted_picture(9, 60, 2), "strewn");
  // The outline of a bed as large as the frame, half seen, with a few small beads in it.
  const GrayFrame outline = test::frame_by(96, 90, [](int column, int row) {
    const double away = std::hypot(column - 47, row - 44);
    const double level = std::clamp(30.5 - away, 0.0, 1.0) * (column < 70 ? 1 : 0.2);
    return 200 - 80 * level - (std::hypot(column - 40, row - 40) < 4 ? 60 : 0);
  });
  expect_same_choice(outline, "outline");
}

// A picture wider than 340 px is looked at where it changes most: disks on one side of it alone are found.
TEST(RadiusChoice, LooksAtTheBusiestPart) {
  Camera camera;
  camera.width = 520, camera.height = 40;
  camera.blur_px = 0.8, camera.read_noise = 1;
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < 14; ++k) disks.push_back({330 + 13.0 * k, 12 + 15.0 * (k % 2), 5.5, 0, 0});
  const GrayFrame frame = render_frame(disks, camera);
  expect_same_choice(frame, "wide");
  EXPECT_NEAR(estimate_radius(frame).radius_px, 5.5, 0.4);
}

}  // namespace
}  // namespace shakebed::ingest
