// Even areas along the sides of a picture, strip by strip and line by line as solid_borders.hpp describes them.

#include "ingest/calibrate/solid_borders.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

float of_rank(std::vector<float> values, double part) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

class BordersByHand {
 public:
  explicit BordersByHand(GrayFrame frame) : frame_(std::move(frame)) {}

  // All sides twice: a corner is understood once the sides next to it are.
  std::vector<SolidBorder> find() {
    if (std::min(frame_.width, frame_.height) < 64 || !find_tolerance()) return {};
    std::vector<SolidBorder> all;
    for (int round = 0; round < 2; ++round)
      for (const FrameSide side : {FrameSide::bottom, FrameSide::left, FrameSide::right, FrameSide::top}) {
        if (std::any_of(all.begin(), all.end(), [&](const auto& one) { return one.side == side; })) continue;
        side_ = side;
        look_from_side();
        for (const SolidBorder& one : lines()) {
          all.push_back(one);
          for (int place = one.from; place < one.to; ++place)
            for (int depth = 0; depth < depths() && depth <= one.depth_px + one.slope * place; ++depth)
              pixel(depth, place) = unseen_level;
        }
      }
    const auto seen = std::count_if(frame_.pixels.begin(), frame_.pixels.end(), [](float one) { return one <= 1e5F; });
    if (8 * static_cast<std::size_t>(seen) < frame_.pixels.size()) all.clear();
    return all;
  }

 private:
  struct Area {  // ended by its last even line
    int depth;
    float level;
  };
  struct Strip {
    int from = 0, to = 0, deepest = -1;
    bool through = true;
    std::vector<Area> areas;
    [[nodiscard]] double middle() const { return 0.5 * (from + to - 1); }
  };
  struct Point {
    std::size_t strip;
    Area area;
  };

  [[nodiscard]] bool upright() const { return side_ == FrameSide::bottom || side_ == FrameSide::top; }
  [[nodiscard]] int depths() const { return upright() ? frame_.height : frame_.width; }
  [[nodiscard]] int places() const { return upright() ? frame_.width : frame_.height; }
  float& pixel(int depth, int place) {
    const bool far = side_ == FrameSide::bottom || side_ == FrameSide::right;
    const int in = far ? depths() - 1 - depth : depth;
    return frame_.pixels[static_cast<std::size_t>(upright() ? in * frame_.width + place : place * frame_.width + in)];
  }

  // A tenth of the range of levels, or 3.2 times the noise; none beyond 0.3 of the range.
  bool find_tolerance() {
    std::vector<float> levels, bends;
    for (std::size_t k = 1; k + 1 < frame_.pixels.size(); ++k) {
      levels.push_back(frame_.pixels[k]);
      bends.push_back(std::abs(frame_.pixels[k - 1] - 2 * frame_.pixels[k] + frame_.pixels[k + 1]));
    }
    const float range = of_rank(levels, 0.99) - of_rank(levels, 0.01);
    tolerance_ = std::max(0.1F * range, 3.2F * 1.4826F * of_rank(bends, 0.5) / std::sqrt(6.0F));
    return range > 0 && tolerance_ <= 0.3F * range;
  }

  void look_from_side() {
    strips_.clear();
    for (int k = 0; k < 16; ++k) {
      Strip strip;
      strip.from = places() * k / 16, strip.to = places() * (k + 1) / 16;
      look_into(strip);
      strips_.push_back(strip);
    }
  }

  // Even is a line of which 0.92 keep to its middle level. An area has two even lines or more, that change by less than
  // half of what is tolerated from one to the next; what is uneven over more than two lines ends the look.
  void look_into(Strip& strip) {
    float before = 0, sum = 0;
    int lines = 0, uneven = 0;
    for (int depth = 0; depth < depths() * 9 / 20; ++depth) {
      std::vector<float> line;
      for (int place = strip.from; place < strip.to; ++place)
        if (pixel(depth, place) <= 1e5F) line.push_back(pixel(depth, place));
      if (line.size() < 6) continue;
      const float middle = of_rank(line, 0.5);
      double alike = 0;
      for (const float one : line) alike += std::abs(one - middle) <= tolerance_;
      const bool even = alike >= 0.92 * static_cast<double>(line.size());
      if (!even || (lines > 0 && std::abs(middle - before) > 0.5F * tolerance_)) {
        if (lines >= 2) strip.areas.push_back({strip.deepest, sum / static_cast<float>(lines)});
        lines = 0, sum = 0;
      }
      if (!even && ++uneven > 2) {
        strip.through = false;
        return;
      }
      if (!even) continue;
      sum += middle, before = middle;
      if (++lines >= 2) uneven = 0, strip.deepest = depth;
    }
  }

  // Straight lines through the ends of areas of one level in half of the strips that tell, four at least.
  std::vector<SolidBorder> lines() {
    std::vector<Point> points;
    std::size_t telling = 0;
    for (std::size_t k = 0; k < strips_.size(); ++k) {
      for (const Area& area : strips_[k].areas)
        if (area.depth >= 2) points.push_back({k, area});
      telling += !(strips_[k].through && strips_[k].areas.empty());
    }
    std::vector<SolidBorder> found;
    for (;;) {
      const std::vector<Point> line = longest(points);
      if (line.size() < std::max<std::size_t>(4, (telling + 1) / 2)) return found;
      const SolidBorder border = along(line);
      bool holds_something = false;  // a strip of it that ends earlier
      for (const Strip& strip : strips_)
        holds_something = holds_something || (strip.from >= border.from && strip.to <= border.to && !strip.through &&
                                              strip.deepest < border.depth_px + border.slope * strip.middle() - 3);
      if (!holds_something) found.push_back(border);
      std::erase_if(points, [&](const Point& one) {
        return std::any_of(line.begin(), line.end(), [&](const Point& other) {
          return one.strip == other.strip && one.area.depth == other.area.depth;
        });
      });
    }
  }

  [[nodiscard]] std::vector<Point> longest(const std::vector<Point>& points) const {
    std::vector<Point> best;
    for (const Point& one : points)
      for (const Point& other : points) {
        if (other.strip <= one.strip || std::abs(other.area.level - one.area.level) > 2 * tolerance_) continue;
        const double x = strips_[one.strip].middle(),
                     slope = (other.area.depth - one.area.depth) / (strips_[other.strip].middle() - x);
        if (std::abs(slope) > 0.14) continue;  // 8 degrees
        std::vector<Point> on;
        for (const Point& point : points) {
          const double off = point.area.depth - one.area.depth - slope * (strips_[point.strip].middle() - x);
          if (std::abs(off) <= 1.5 && std::abs(point.area.level - one.area.level) <= 2 * tolerance_ &&
              (on.empty() || on.back().strip != point.strip))
            on.push_back(point);
        }
        if (on.size() > best.size()) best = on;
      }
    return best;
  }

  // Least squares. Strips beside it that are even right through belong to it, if all up to the end are.
  [[nodiscard]] SolidBorder along(const std::vector<Point>& line) const {
    double x = 0, y = 0, xx = 0, xy = 0;
    const auto n = static_cast<double>(line.size());
    std::vector<float> levels;
    for (const Point& point : line) x += strips_[point.strip].middle(), y += point.area.depth;
    x /= n, y /= n;
    for (const Point& point : line) {
      const double dx = strips_[point.strip].middle() - x;
      xx += dx * dx, xy += dx * (point.area.depth - y);
      levels.push_back(point.area.level);
    }
    SolidBorder border;
    border.side = side_, border.slope = xy / xx, border.depth_px = y - border.slope * x;
    border.level = static_cast<double>(of_rank(levels, 0.5));
    bool before = true, after = true;
    for (std::size_t k = 0; k < line.front().strip; ++k) before = before && strips_[k].through;
    for (std::size_t k = line.back().strip + 1; k < 16; ++k) after = after && strips_[k].through;
    border.from = before ? 0 : strips_[line.front().strip].from;
    border.to = after ? places() : strips_[line.back().strip].to;
    return border;
  }

  GrayFrame frame_;
  FrameSide side_ = FrameSide::bottom;
  float tolerance_ = 0;
  std::vector<Strip> strips_;
};

std::size_t expect_same_borders(const GrayFrame& frame, const std::string& name) {
  const auto found = find_solid_borders(frame), expected = BordersByHand(frame).find();
  EXPECT_EQ(found.size(), expected.size()) << name;
  for (std::size_t k = 0; k < std::min(found.size(), expected.size()); ++k) {
    EXPECT_EQ(found[k].side, expected[k].side) << name << ' ' << k;
    EXPECT_NEAR(found[k].depth_px, expected[k].depth_px, 1e-6) << name << ' ' << k;
    EXPECT_NEAR(found[k].slope, expected[k].slope, 1e-9) << name << ' ' << k;
    EXPECT_EQ(found[k].from, expected[k].from) << name << ' ' << k;
    EXPECT_EQ(found[k].to, expected[k].to) << name << ' ' << k;
    EXPECT_NEAR(found[k].level, expected[k].level, 1e-4) << name << ' ' << k;
  }
  return found.size();
}

// Bands along sides, some in two steps, some tilted, some interrupted; beads that touch them; grain.
struct Banded {
  double floor = 14, floor_slope = 0, step = 0;  // px; of a second level on top of the floor
  double left = 0, right = 0, lid = 0;
  double grain = 4;
  double bead_level = 60;
  int interrupted_from = 0, interrupted_to = 0;  // columns where the floor ends 6 px earlier
};
GrayFrame banded_frame(const Banded& bands) {
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < 24; ++k)
    disks.push_back(
        {20 + 18.3 * (k % 6) + 4 * test::scattered(k, 2), 22 + 19.0 * (k / 6) + 3 * test::scattered(2, k), 7, 0, 0});
  Camera camera;
  camera.width = 132, camera.height = 112, camera.background_level = 150, camera.bead_level = bands.bead_level;
  camera.blur_px = 0.7;
  const GrayFrame beads = render_frame(disks, camera);
  return test::frame_by(132, 112, [&](int column, int row) {
    double floor = bands.floor + bands.floor_slope * column;
    if (column >= bands.interrupted_from && column < bands.interrupted_to) floor -= 6;
    double level = static_cast<double>(beads.at(column, row));
    if (111 - row < floor + bands.step) level = 110;
    if (111 - row < floor || column < bands.left || 131 - column < bands.right || row < bands.lid) level = 50;
    return level + bands.grain * (test::scattered(column, row) - 0.5);
  });
}

TEST(BordersByHand, AreThoseOfTheirStrips) {
  std::size_t all = 0;
  all += expect_same_borders(banded_frame({}), "floor");
  all += expect_same_borders(banded_frame({.floor = 10, .floor_slope = 0.08}), "tilted");
  all += expect_same_borders(banded_frame({.floor = 4, .floor_slope = 0.13}), "steep");
  all += expect_same_borders(banded_frame({.floor = 4, .floor_slope = 0.16}), "too steep");
  all += expect_same_borders(banded_frame({.floor = 9, .step = 8}), "two levels");
  all += expect_same_borders(banded_frame({.floor = 12, .left = 9, .right = 13, .lid = 8}), "all sides");
  all += expect_same_borders(banded_frame({.floor = 0, .left = 16, .lid = 5}), "a corner");
  all += expect_same_borders(banded_frame({.bead_level = 230}), "bright beads");
  for (const double depth : {1.0, 2.0, 3.0, 4.0, 56.0})
    all += expect_same_borders(banded_frame({.floor = depth}), "depth " + std::to_string(depth));
  for (const int to : {48, 64, 80, 100})
    all += expect_same_borders(banded_frame({.interrupted_from = 32, .interrupted_to = to}),
                               "interrupted " + std::to_string(to));
  EXPECT_GT(all, 20U);
}

TEST(BordersByHand, AreSeenUpToSomeGrain) {
  for (const double grain : {0.0, 10.0, 20.0, 28.0, 36.0, 60.0})
    expect_same_borders(banded_frame({.left = 12, .grain = grain}), "grain " + std::to_string(grain));
  // A frame of which less than an eighth is left holds none.
  for (const int left : {21, 27}) {
    const GrayFrame frame = test::frame_by(90, 80, [&](int column, int row) {
      const bool inside = std::abs(column - 45) < left && std::abs(row - 40) < left - 5;
      return inside ? 150 + 60 * std::sin(0.9 * column) * std::cos(0.8 * row) : 40;
    });
    expect_same_borders(frame, "left " + std::to_string(left));
  }
}

// An even area along half of a side is one, along less it is none: of sixteen strips eight must end on one line.
TEST(BordersByHand, ReachAlongHalfOfTheirSide) {
  for (const int strips : {7, 8, 9}) {
    const GrayFrame frame = test::frame_by(128, 96, [&](int column, int row) {
      const bool floor = row >= 84 && column < 8 * strips;
      return floor ? 50 : ((column / 4 + row / 4) % 2 == 0 ? 90 : 190) + 8 * test::scattered(column / 4, row / 4);
    });
    EXPECT_EQ(expect_same_borders(frame, std::to_string(strips)), strips < 8 ? 0U : 1U);
  }
}

// The same picture turned by quarters has the same borders on the other sides.
TEST(BordersByHand, TurnWithTheirPicture) {
  const GrayFrame frame = banded_frame({.floor = 10, .floor_slope = 0.05, .step = 7});
  const GrayFrame turned = test::frame_by(112, 132, [&](int column, int row) { return frame.at(row, column); });
  const auto one = find_solid_borders(frame), other = find_solid_borders(turned);
  const auto on_side = [](std::vector<SolidBorder> all, FrameSide side) {
    std::erase_if(all, [&](const SolidBorder& border) { return border.side != side; });
    return all;
  };
  const auto below = on_side(one, FrameSide::bottom), beside = on_side(other, FrameSide::right);
  ASSERT_GE(below.size(), 2U);
  ASSERT_EQ(beside.size(), below.size());
  for (std::size_t k = 0; k < below.size(); ++k) {
    EXPECT_NEAR(below[k].depth_px, beside[k].depth_px, 1e-9);
    EXPECT_NEAR(below[k].slope, beside[k].slope, 1e-9);
    EXPECT_EQ(below[k].from, beside[k].from);
    EXPECT_EQ(below[k].to, beside[k].to);
  }
  expect_same_borders(turned, "turned");
}

}  // namespace
}  // namespace shakebed::ingest
