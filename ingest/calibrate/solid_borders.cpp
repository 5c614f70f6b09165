#include "ingest/calibrate/solid_borders.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

// A frame looked at from one of its sides: depth counts inwards, place along the side.
struct View {
  const GrayFrame& frame;
  FrameSide side;
  [[nodiscard]] bool upright() const { return side == FrameSide::bottom || side == FrameSide::top; }
  [[nodiscard]] int depths() const { return upright() ? frame.height : frame.width; }
  [[nodiscard]] int places() const { return upright() ? frame.width : frame.height; }
  [[nodiscard]] std::size_t index(int depth, int place) const {
    const int row = side == FrameSide::bottom ? frame.height - 1 - depth : side == FrameSide::top ? depth : place;
    const int column = side == FrameSide::right ? frame.width - 1 - depth : side == FrameSide::left ? depth : place;
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width) + static_cast<std::size_t>(column);
  }
};

// How far levels of one even area lie apart: a tenth of the frame's range, more under noise. Nothing where noise hides
// what is even.
std::optional<float> tolerance_of(const GrayFrame& frame) {
  std::vector<float> levels, bends;
  const auto step = std::max<std::size_t>(1, frame.pixels.size() / 40000);
  for (std::size_t k = 1; k + 1 < frame.pixels.size(); k += step) {
    levels.push_back(frame.pixels[k]);
    bends.push_back(std::abs(frame.pixels[k - 1] - 2 * frame.pixels[k] + frame.pixels[k + 1]));
  }
  const float range = quantile_of(levels, 0.99) - quantile_of(levels, 0.01);
  const float noise = 1.4826F * quantile_of(bends, 0.5) / std::sqrt(6.0F);
  const float tolerance = std::max(0.1F * range, 3.2F * noise);
  if (!(range > 0) || tolerance > 0.3F * range) return std::nullopt;
  return tolerance;
}

struct Strip {
  int from = 0, to = 0;
  struct End {  // of an even area: its last line
    int depth = 0;
    float level = 0;
  };
  std::vector<End> ends;  // from the side inwards
  int deepest = -1;       // last even line
  bool through = false;   // even as far as was looked
  [[nodiscard]] double middle() const { return 0.5 * (from + to - 1); }
};

// From the side inwards, line by line, until what follows is no longer even.
void look_inwards(const View& view, float tolerance, Strip& strip) {
  constexpr double nearly_all = 0.92;
  constexpr int shortest = 2, longest_gap = 2, enough = 64;  // lines; pixels of a line
  const int step = std::max(1, (strip.to - strip.from) / enough);
  const int deepest = view.depths() * 9 / 20;
  std::vector<float> line;
  float level = 0, level_sum = 0;
  int even_lines = 0, gap = 0;
  for (int depth = 0; depth < deepest; ++depth) {
    line.clear();
    for (int place = strip.from; place < strip.to; place += step) {
      const float here = view.frame.pixels[view.index(depth, place)];
      if (!unseen(here)) line.push_back(here);
    }
    if (line.size() < 6) continue;
    const float middle = quantile_of(line, 0.5);
    const auto near =
        std::count_if(line.begin(), line.end(), [&](float here) { return std::abs(here - middle) <= tolerance; });
    const bool even = static_cast<double>(near) >= nearly_all * static_cast<double>(line.size());
    const bool changed = even && even_lines > 0 && std::abs(middle - level) > 0.5F * tolerance;
    if (!even || changed) {
      if (even_lines >= shortest) strip.ends.push_back({strip.deepest, level_sum / static_cast<float>(even_lines)});
      even_lines = 0;
    }
    if (!even) {
      if (++gap > longest_gap) return;
      continue;
    }
    level_sum = even_lines ? level_sum + middle : middle;
    ++even_lines;
    level = middle;
    if (even_lines >= shortest) {
      gap = 0;
      strip.deepest = depth;
    }
  }
  strip.through = true;
}

constexpr double steepest_border = 0.14, same_line = 1.5;  // 8 degrees; px
constexpr int thinnest = 2;
constexpr std::size_t fewest_strips = 4;

struct Member {
  std::size_t strip;
  Strip::End end;
};

// The line of one level through as many ends as there is.
std::vector<Member> longest_line(const std::vector<Strip>& strips, const std::vector<Member>& ends, double tolerance) {
  std::vector<Member> best;
  for (const Member& one : ends)
    for (const Member& other : ends) {
      if (other.strip <= one.strip || std::abs(other.end.level - one.end.level) > 2 * tolerance) continue;
      const double from = strips[one.strip].middle();
      const double slope = (other.end.depth - one.end.depth) / (strips[other.strip].middle() - from);
      if (std::abs(slope) > steepest_border) continue;
      std::vector<Member> members;
      for (const Member& member : ends) {
        const double line = one.end.depth + slope * (strips[member.strip].middle() - from);
        if (std::abs(member.end.depth - line) <= same_line &&
            std::abs(member.end.level - one.end.level) <= 2 * tolerance &&
            (members.empty() || members.back().strip != member.strip))
          members.push_back(member);
      }
      if (members.size() > best.size()) best = std::move(members);
    }
  return best;
}

// The border along a line by least squares, with the strips beside it that are even right through: they belong to it. A
// strip between that ends earlier holds something.
SolidBorder border_along(const std::vector<Strip>& strips, const std::vector<Member>& line, FrameSide side) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  std::vector<float> levels;
  for (const Member& member : line) {
    const double place = strips[member.strip].middle(), depth = member.end.depth;
    n += 1, x += place, y += depth, xx += place * place, xy += place * depth;
    levels.push_back(member.end.level);
  }
  SolidBorder border;
  border.side = side;
  border.slope = (n * xy - x * y) / (n * xx - x * x);
  border.depth_px = (y - border.slope * x) / n;
  border.level = static_cast<double>(quantile_of(levels, 0.5));
  border.from = strips[line.front().strip].from;
  border.to = strips[line.back().strip].to;
  if (std::all_of(strips.begin(), strips.begin() + static_cast<std::ptrdiff_t>(line.front().strip),
                  [](const Strip& strip) { return strip.through; }))
    border.from = strips.front().from;
  if (std::all_of(strips.begin() + static_cast<std::ptrdiff_t>(line.back().strip), strips.end(),
                  [&](const Strip& strip) { return strip.through || &strip == &strips[line.back().strip]; }))
    border.to = strips.back().to;
  return border;
}

// The straight lines on which even areas of one level end in most strips, outermost first.
std::vector<SolidBorder> borders_of(const View& view, const std::vector<Strip>& strips, double tolerance) {
  std::vector<Member> ends;
  std::size_t telling = 0;
  for (std::size_t k = 0; k < strips.size(); ++k) {
    for (const Strip::End& end : strips[k].ends)
      if (end.depth >= thinnest) ends.push_back({k, end});
    telling += !strips[k].through || !strips[k].ends.empty();
  }
  const std::size_t enough = std::max(fewest_strips, (telling + 1) / 2);
  std::vector<SolidBorder> borders;
  for (;;) {
    const std::vector<Member> line = longest_line(strips, ends, tolerance);
    if (line.size() < enough) return borders;
    const SolidBorder border = border_along(strips, line, view.side);
    const bool free = std::none_of(strips.begin(), strips.end(), [&](const Strip& strip) {
      return strip.from >= border.from && strip.to <= border.to && !strip.through &&
             strip.deepest < border.depth_px + border.slope * strip.middle() - 2 * same_line;
    });
    if (free) borders.push_back(border);
    std::erase_if(ends, [&](const Member& end) {
      return std::any_of(line.begin(), line.end(), [&](const Member& member) {
        return member.strip == end.strip && member.end.depth == end.end.depth;
      });
    });
  }
}

void hide(GrayFrame& frame, const SolidBorder& border, double margin_px) {
  const View view{frame, border.side};
  for (int place = std::max(0, border.from); place < std::min(view.places(), border.to); ++place) {
    const double last = border.depth_px + border.slope * place + margin_px;
    for (int depth = 0; depth < view.depths() && depth <= last; ++depth)
      frame.pixels[view.index(depth, place)] = unseen_level;
  }
}

}  // namespace

std::vector<SolidBorder> find_solid_borders(const GrayFrame& frame) {
  std::vector<SolidBorder> borders;
  constexpr int smallest = 64;
  if (std::min(frame.width, frame.height) < smallest) return borders;
  const std::optional<float> tolerance = tolerance_of(frame);
  if (!tolerance) return borders;
  GrayFrame left = frame;
  // Twice: a corner of a frame around the bed is understood once the sides next to it are.
  for (int round = 0; round < 2 && (round == 0 || !borders.empty()); ++round)
    for (const FrameSide side : {FrameSide::bottom, FrameSide::left, FrameSide::right, FrameSide::top}) {
      if (std::any_of(borders.begin(), borders.end(), [&](const SolidBorder& b) { return b.side == side; })) continue;
      const View view{left, side};
      constexpr int count = 16;
      std::vector<Strip> strips(count);
      for (int k = 0; k < count; ++k) {
        Strip& strip = strips[static_cast<std::size_t>(k)];
        strip.from = view.places() * k / count;
        strip.to = view.places() * (k + 1) / count;
        look_inwards(view, *tolerance, strip);
      }
      for (const SolidBorder& border : borders_of(view, strips, static_cast<double>(*tolerance))) {
        borders.push_back(border);
        hide(left, border, 0);
      }
    }
  constexpr std::size_t least_left = 8;  // of the frame: an eighth
  const auto seen = std::count_if(left.pixels.begin(), left.pixels.end(), [](float level) { return !unseen(level); });
  if (static_cast<std::size_t>(seen) * least_left < left.pixels.size()) borders.clear();
  return borders;
}

void complete_corners(std::vector<SolidBorder>& borders, const GrayFrame& frame) {
  const auto has = [&](FrameSide side) {
    return std::any_of(borders.begin(), borders.end(), [&](const SolidBorder& border) { return border.side == side; });
  };
  for (SolidBorder& border : borders) {
    const bool upright = border.side == FrameSide::bottom || border.side == FrameSide::top;
    if (has(upright ? FrameSide::left : FrameSide::top)) border.from = 0;
    if (has(upright ? FrameSide::right : FrameSide::bottom)) border.to = upright ? frame.width : frame.height;
  }
}

GrayFrame without_borders(const GrayFrame& frame, const std::vector<SolidBorder>& borders, double margin_px) {
  GrayFrame seen = frame;
  for (const SolidBorder& border : borders) hide(seen, border, margin_px);
  return seen;
}

}  // namespace shakebed::ingest
