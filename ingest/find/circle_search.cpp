#include "ingest/find/circle_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>
#include <utility>

#include "ingest/find/vector_lanes.hpp"
#include "ingest/frames/stop_question.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

constexpr double least_alignment = 0.8;  // cosine between an edge's gradient and the ray
constexpr double least_tolerance = 0.6;  // px: what pixels do to an edge's place
constexpr double ray_step = 0.5;         // px
constexpr int most_ray_steps = 64;

struct Direction {
  double cosine, sine;
};
constexpr std::size_t directions_in_table = 96;  // 32 and 48 divide it
Direction direction_of(int k, int count) {
  static const std::array<Direction, directions_in_table> table = [] {
    std::array<Direction, directions_in_table> all{};
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(all.size());
      all[i] = {std::cos(angle), std::sin(angle)};
    }
    return all;
  }();
  return table[static_cast<std::size_t>(k) * directions_in_table / static_cast<std::size_t>(count)];
}

constexpr int most_directions = 64;  // Circle::met has a bit each

// `count` directions about a circle. Quotients are slow: once for all rounds of a fit.
struct Directions {
  int count;
  std::array<Direction, most_directions> of;
  explicit Directions(int how_many) : count(how_many) {
    for (int k = 0; k < count; ++k) of[static_cast<std::size_t>(k)] = direction_of(k, count);
  }
};

// Of the step outwards across a rim; 0: of either sign.
float sign_of(Polarity polarity) {
  return polarity == Polarity::bright_beads ? -1.0F : polarity == Polarity::dark_beads ? 1.0F : 0.0F;
}

// Where along a ray the edge is: its distance from the rim, if there is one.
struct Met {
  bool in_view = false, edge = false;
  double offset = 0;  // px outwards
  float slope = 0;    // grey levels per px
};
using MetAround = std::array<Met, most_directions>;

// Interpolated between pixels, `at` the upper left one.
inline __attribute__((always_inline)) Floats between(const std::vector<float>& map, int width, const Ints& at,
                                                     const Floats& right, const Floats& down) {
  const float *upper = map.data(), *lower = upper + width;
  Floats a, b, c, d;
  gather_with_next(upper, at, a, b), gather_with_next(lower, at, c, d);
  return (1 - down) * ((1 - right) * a + right * b) + down * ((1 - right) * c + right * d);
}

// The strongest edge along each of eight rays through the rim at (x, y) [px], up to `reach` steps from it.
struct EightRays {
  Floats x, y, cosine, sine;
  Floats slope{}, before{}, after{};  // of the edge, and of the gradients along the ray beside it; grey levels per px
  Ints step{}, in_view{};             // of the edge from the rim; whether the rim is in the picture

  // `whole`: all of every ray is in the picture.
  template <bool whole>
  void look(const EdgeMap& edges, float sign, int reach) {
    constexpr float least = static_cast<float>(least_alignment * least_alignment);
    // Of either sign, the larger of both.
    const float one = sign == 0 ? 1.0F : sign, other = sign == 0 ? -1.0F : sign;
    const float right_end = static_cast<float>(edges.width - 2), lower_end = static_cast<float>(edges.height - 2);
    slope = slope + edges.threshold;
    step = step + 2 * most_ray_steps;  // none
    Floats last = {};
    for (int k = -reach; k <= reach; ++k) {
      const float distance = static_cast<float>(k) * static_cast<float>(ray_step);
      const Floats px = x + distance * cosine, py = y + distance * sine, nothing = {};
      const Ints inside = (px >= 1) & (py >= 1) & (px < right_end) & (py < lower_end);
      const Floats safe_x = whole ? px : inside ? px : nothing, safe_y = whole ? py : inside ? py : nothing;
      const Ints column = __builtin_convertvector(safe_x, Ints), row = __builtin_convertvector(safe_y, Ints);
      const Floats right = safe_x - __builtin_convertvector(column, Floats),
                   down = safe_y - __builtin_convertvector(row, Floats);
      const Ints at = row * edges.width + column;
      const Floats dx = between(edges.x, edges.width, at, right, down),
                   dy = between(edges.y, edges.width, at, right, down);
      const Floats outwards = dx * cosine + dy * sine;
      const Floats either = one * outwards > other * outwards ? one * outwards : other * outwards;
      const Floats radial = whole ? either : inside ? either : nothing;
      const Floats aligned = radial * radial < least * (dx * dx + dy * dy) ? nothing : radial;
      after = step == k - 1 ? radial : after;
      const Ints better = aligned > slope;
      slope = better ? aligned : slope;
      before = better ? last : before;
      after = better ? nothing : after;
      step = better ? k + 0 * step : step;
      last = radial;
      if (k == 0) in_view = inside;
    }
  }

  [[nodiscard]] Met met(int ray, int reach) const {
    Met met;
    met.in_view = in_view[ray] != 0;
    met.edge = step[ray] <= reach;
    if (!met.edge) return met;
    met.offset = step[ray] * ray_step;
    met.slope = slope[ray];
    if (step[ray] == -reach || step[ray] == reach) return met;
    const float bend = before[ray] - 2 * slope[ray] + after[ray];
    if (bend < 0)
      met.offset += ray_step * std::clamp(0.5 * static_cast<double>((before[ray] - after[ray]) / bend), -0.5, 0.5);
    return met;
  }
};

// In directions from the centre of a circle, a multiple of eight.
void look_around(const EdgeMap& edges, const Circle& circle, const Directions& directions, float sign, double reach,
                 MetAround& met) {
  const int steps = std::min(static_cast<int>(std::ceil(reach / ray_step)), most_ray_steps);
  const double farthest = circle.radius + ray_step * steps + 1;  // more than a float's rounding
  const bool whole = circle.x - farthest >= 1 && circle.y - farthest >= 1 && circle.x + farthest < edges.width - 2 &&
                     circle.y + farthest < edges.height - 2;
  for (int first = 0; first < directions.count; first += lanes) {
    EightRays rays;
    for (int l = 0; l < lanes; ++l) {
      const auto [cosine, sine] = directions.of[static_cast<std::size_t>(first + l)];
      rays.x[l] = static_cast<float>(circle.x + circle.radius * cosine);
      rays.y[l] = static_cast<float>(circle.y + circle.radius * sine);
      rays.cosine[l] = static_cast<float>(cosine), rays.sine[l] = static_cast<float>(sine);
    }
    if (whole)
      rays.look<true>(edges, sign, steps);
    else
      rays.look<false>(edges, sign, steps);
    for (int l = 0; l < lanes; ++l) met[static_cast<std::size_t>(first + l)] = rays.met(l, steps);
  }
}

struct MetEdge {
  double cosine = 0, sine = 0, offset = 0, weight = 1;
};

// Faint edges count little.
void weigh(std::vector<MetEdge>& met, const std::vector<float>& slopes, double faint) {
  constexpr double from_none_to_full = 0.25;
  std::vector<float> ranked = slopes;
  const auto typical = static_cast<double>(median_of(ranked));
  for (std::size_t k = 0; k < met.size(); ++k)
    met[k].weight = std::clamp((static_cast<double>(slopes[k]) / typical - faint) / from_none_to_full, 0.0, 1.0);
}

double weighted_scatter(const std::vector<MetEdge>& met) {
  double squares = 0, weights = 0;
  for (const MetEdge& edge : met) {
    squares += edge.weight * edge.offset * edge.offset;
    weights += edge.weight;
  }
  return std::sqrt(squares / std::max(1e-9, weights));
}

// Least squares of offset = dx cos + dy sin + dr over the edges met; a poorly seen arc moves little.
struct CircleStep {
  double x = 0, y = 0, radius = 0;
};
CircleStep step_towards(const std::vector<MetEdge>& met, int rays) {
  double cc = 0, cs = 0, ss = 0, c = 0, s = 0, oc = 0, os = 0, o = 0, weights = 0;
  for (const auto& [cosine, sine, offset, weight] : met) {
    const double wc = weight * cosine, ws = weight * sine;
    cc += wc * cosine, cs += wc * sine, ss += ws * sine, c += wc, s += ws, weights += weight;
    oc += offset * wc, os += offset * ws, o += weight * offset;
  }
  const double hold = 0.02 * rays, n = weights + hold;
  cc += hold, ss += hold;
  // The radius eliminated, then the two of the centre.
  const double a = cc - c * c / n, b = cs - c * s / n, d = ss - s * s / n;
  const double u = oc - c * o / n, v = os - s * o / n;
  const double determinant = a * d - b * b;
  if (!(determinant > 1e-6)) return {};
  CircleStep step;
  step.x = (d * u - b * v) / determinant;
  step.y = (a * v - b * u) / determinant;
  step.radius = (o - c * step.x - s * step.y) / n;
  return step;
}

// Directions of a quick look.
constexpr std::size_t looks = 16;
struct LookDirections {
  std::array<double, looks> cosine{}, sine{};
  LookDirections() {
    const Directions directions(looks);
    for (std::size_t k = 0; k < looks; ++k) cosine[k] = directions.of[k].cosine, sine[k] = directions.of[k].sine;
  }
};

// Pixels nearest to the places `along` px from `middle` in eight of the directions, whose cosines or sines are given.
inline __attribute__((always_inline)) Ints pixels_at(double middle, double along, const double* directions) {
  typedef double FourDoubles __attribute__((vector_size(32)));
  typedef int FourInts __attribute__((vector_size(16)));
  FourDoubles first, second;
  std::memcpy(&first, directions, sizeof first), std::memcpy(&second, directions + 4, sizeof second);
  const FourInts one = __builtin_convertvector(middle + along * first + 0.5, FourInts),
                 other = __builtin_convertvector(middle + along * second + 0.5, FourInts);
  return __builtin_shufflevector(one, other, 0, 1, 2, 3, 4, 5, 6, 7);
}

// A quick look: enough of the pixels near the rim have a gradient along the radius.
bool worth_fitting(const EdgeMap& edges, const Circle& circle, float sign, double reach) {
  static const LookDirections directions;
  constexpr int fewest_met = 6;
  const float one = sign == 0 ? 1.0F : sign, other = sign == 0 ? -1.0F : sign;  // as in EightRays
  Ints all_seen = {}, all_met = {};                                             // -1 for each
  for (std::size_t first = 0; first < looks; first += lanes) {
    const double *cosines = directions.cosine.data() + first, *sines = directions.sine.data() + first;
    Floats cosine, sine;
    for (int l = 0; l < lanes; ++l) cosine[l] = static_cast<float>(cosines[l]), sine[l] = static_cast<float>(sines[l]);
    Ints seen = {}, edge = {};
    for (double off = -reach; off <= reach + 1e-9; off += reach / std::ceil(reach)) {
      const Ints column = pixels_at(circle.x, circle.radius + off, cosines),
                 row = pixels_at(circle.y, circle.radius + off, sines);
      const Ints inside = (column >= 1) & (row >= 1) & (column < edges.width - 1) & (row < edges.height - 1);
      const Ints at = inside & (row * edges.width + column);
      Floats dx, dy;
      ingest::gather(edges.x.data(), at, dx), ingest::gather(edges.y.data(), at, dy);
      const Floats outwards = dx * cosine + dy * sine;
      const Floats radial = one * outwards > other * outwards ? one * outwards : other * outwards;
      seen |= inside;
      edge |= inside & (radial > edges.threshold) & (radial * radial > 0.6F * (dx * dx + dy * dy));
    }
    all_seen += seen, all_met += edge;
  }
  int in_view = 0, met = 0;
  for (int l = 0; l < lanes; ++l) in_view -= all_seen[l], met -= all_met[l];
  return met >= fewest_met && 10 * met >= 4 * in_view;
}

// Columns of a block of votes.
constexpr std::size_t block = 64;

// The edges of a map, by blocks of columns and from top to bottom: votes of one after the other are near each other.
struct EdgesInBlocks {
  std::vector<float> x, y, unit_x, unit_y;  // filled up to whole lanes with edges that are far outside

  explicit EdgesInBlocks(const EdgeMap& edges) {
    constexpr float far_outside = -1e6F;
    const auto block_of = [](const RidgePixel& edge) { return static_cast<std::size_t>(edge.x) / block; };
    std::vector<std::size_t> next(static_cast<std::size_t>(edges.width) / block + 2);
    for (const RidgePixel& edge : edges.ridge) ++next[block_of(edge) + 1];
    for (std::size_t k = 1; k < next.size(); ++k) next[k] += next[k - 1];
    const std::size_t padded = (edges.ridge.size() + lanes - 1) / lanes * lanes;
    x.assign(padded, far_outside);
    for (std::vector<float>* values : {&y, &unit_x, &unit_y}) values->assign(padded, 0);
    for (const RidgePixel& edge : edges.ridge) {
      const std::size_t at = next[block_of(edge)]++;
      x[at] = edge.x, y[at] = edge.y, unit_x[at] = edge.unit_x, unit_y[at] = edge.unit_y;
    }
  }
};

// Votes for centres one radius away from each edge, and where most are gathered in 3 x 3 pixels. All rows of a block of
// columns lie together in memory: by rows of the picture a large photograph took 5 % more time in all. The tables are
// kept from one radius to the next: pages fresh from the system cost more than the votes.
class VoteMap {
 public:
  explicit VoteMap(const EdgeMap& edges)
      : edges_(edges),
        width_(static_cast<std::size_t>(edges.width)),
        height_(static_cast<std::size_t>(edges.height)),
        blocks_((width_ + block - 1) / block),
        votes_(blocks_ * height_ * block + 1),
        sums_(window * blocks_ * block),
        voted_(blocks_ * height_ + 1),
        filled_(window * blocks_) {}

  std::vector<Circle> peaks(double radius, float sign, double least_votes) {
    clear();
    if (sign <= 0) vote(static_cast<float>(radius));
    if (sign >= 0) vote(static_cast<float>(-radius));
    const double least = std::ceil(least_votes * 2 * std::numbers::pi * radius);
    std::vector<Circle> peaks;
    if (height_ < window) return peaks;
    // Sums of the two rows above and below a row are at hand when its peaks are looked for.
    std::fill(sums_.begin(), sums_.end(), Count{0});
    std::fill(filled_.begin(), filled_.end(), std::uint8_t{0});
    for (std::size_t row = 1; row < height_; ++row) {
      gather(row);
      if (row >= 4) find_peaks_in(row - 2, static_cast<Count>(least), radius, peaks);
    }
    return peaks;
  }

 private:
  using Count = std::uint16_t;
  static constexpr std::size_t window = 5;  // rows

  // Those beyond the outermost pixels go to an element after the last one, which nobody reads.
  void vote(float shift) {
    constexpr int wide = static_cast<int>(block);
    const int width = static_cast<int>(width_), height = static_cast<int>(height_);
    const Ints nowhere = Ints{} + static_cast<int>(votes_.size() - 1);
    for (std::size_t k = 0; k < edges_.x.size(); k += lanes) {
      Floats x, y, unit_x, unit_y;
      load(edges_.x.data() + k, x), load(edges_.y.data() + k, y);
      load(edges_.unit_x.data() + k, unit_x), load(edges_.unit_y.data() + k, unit_y);
      const Ints column = __builtin_convertvector(x + shift * unit_x + 0.5F, Ints),
                 row = __builtin_convertvector(y + shift * unit_y + 0.5F, Ints);
      const Ints inside = (column >= 1) & (row >= 1) & (column < width - 1) & (row < height - 1);
      const Ints place = inside ? (column / wide * height + row) * wide + column % wide : nowhere;
      for (int l = 0; l < lanes; ++l) {
        const auto its = static_cast<std::size_t>(place[l]);
        ++votes_[its];
        voted_[its / block] = 1;
      }
    }
  }

  // Most blocks of most pictures hold no vote.
  void clear() {
    for (std::size_t k = 0; k < blocks_ * height_; ++k)
      if (std::exchange(voted_[k], 0) != 0)
        std::fill_n(votes_.begin() + static_cast<std::ptrdiff_t>(k * block), block, Count{0});
  }

  Count* sums_of(std::size_t row) { return sums_.data() + row % window * blocks_ * block; }

  // Whether there are votes within a block of block `k` in the rows beside `row`.
  [[nodiscard]] bool voted_near(std::size_t row, std::size_t k) const {
    const std::size_t first = k > 0 ? k - 1 : 0, last = std::min(k + 1, blocks_ - 1);
    for (std::size_t x = first; x <= last; ++x)
      for (std::size_t y = row - 1; y <= row + 1; ++y)
        if (voted_[x * height_ + y] != 0) return true;
    return false;
  }

  // Sums over 3 x 3 pixels; 0 in the outermost rows and columns.
  void gather(std::size_t row) {
    for (std::size_t k = 0; k < blocks_; ++k) {
      std::uint8_t& filled = filled_[row % window * blocks_ + k];
      if (row + 1 < height_ && voted_near(row, k)) {
        gather(row, k);
        filled = 1;
      } else if (std::exchange(filled, 0) != 0) {
        std::fill_n(sums_of(row) + k * block, block, Count{0});
      }
    }
    sums_of(row)[0] = sums_of(row)[width_ - 1] = 0;
  }

  void gather(std::size_t row, std::size_t k) {
    const Count* middle = votes_.data() + (k * height_ + row) * block;
    // Sums over three rows, of the columns of the block and one to each side.
    const auto of_rows = [](const Count* here) { return static_cast<Count>(here[0] + *(here - block) + here[block]); };
    std::array<Count, block + 2> sums;
    for (std::size_t column = 0; column < block; ++column) sums[column + 1] = of_rows(middle + column);
    const std::size_t to_next = height_ * block;
    sums.front() = k > 0 ? of_rows(middle - to_next + block - 1) : Count{0};
    sums.back() = k + 1 < blocks_ ? of_rows(middle + to_next) : Count{0};
    Count* to = sums_of(row) + k * block;
    for (std::size_t column = 0; column < block; ++column)
      to[column] = static_cast<Count>(sums[column] + sums[column + 1] + sums[column + 2]);
  }

  void find_peaks_in(std::size_t row, Count least, double radius, std::vector<Circle>& peaks) {
    const Count* here = sums_of(row);
    for (std::size_t k = 0; k < blocks_; ++k) {
      if (filled_[row % window * blocks_ + k] == 0) continue;
      const std::size_t first = std::max<std::size_t>(k * block, 2), last = std::min((k + 1) * block, width_ - 2);
      Count most = 0;  // by value, so that g++ takes many columns at once
      for (std::size_t column = first; column < last; ++column) most = here[column] > most ? here[column] : most;
      // Neither is the highest one of three that is lower than one beside it.
      for (std::size_t column = most < least ? last : first; column < last; ++column)
        if (here[column] >= least && here[column] > here[column - 1] && here[column] >= here[column + 1] &&
            highest(row, column, here[column]))
          peaks.push_back({static_cast<double>(column), static_cast<double>(row), radius});
    }
  }

  // Of equal ones the first counts.
  bool highest(std::size_t row, std::size_t column, Count value) {
    for (std::size_t y = row - 2; y <= row + 2; ++y)
      for (std::size_t x = column - 2; x <= column + 2; ++x) {
        const Count other = sums_of(y)[x];
        const bool earlier = y < row || (y == row && x < column);
        if (other > value || (earlier && other == value)) return false;
      }
    return true;
  }

  EdgesInBlocks edges_;
  std::size_t width_, height_, blocks_;
  std::vector<Count> votes_, sums_;
  std::vector<std::uint8_t> voted_, filled_;  // blocks of the table in which there are votes, of `sums_` that are not 0
};

// Circles that are kept, in cells as wide as the distance that two of them need. Far fewer than all circles.
struct KeptCircles {
  std::vector<Circle> all;

  KeptCircles(const std::vector<Circle>& circles, double share) : share_(share) {
    double largest = 1, right = 0, bottom = 0;
    if (!circles.empty()) left_ = circles.front().x, top_ = circles.front().y, right = left_, bottom = top_;
    for (const Circle& circle : circles) {
      largest = std::max(largest, circle.radius);
      left_ = std::min(left_, circle.x), right = std::max(right, circle.x);
      top_ = std::min(top_, circle.y), bottom = std::max(bottom, circle.y);
    }
    cell_ = 2 * share * largest;
    columns_ = static_cast<std::size_t>((right - left_) / cell_) + 3;
    cells_.resize(columns_ * (static_cast<std::size_t>((bottom - top_) / cell_) + 3));
  }

  void keep_unless_near(const Circle& circle) {
    const std::size_t at = cell_of(circle);
    for (const std::size_t row : {at - columns_, at, at + columns_})
      for (const std::size_t cell : {row - 1, row, row + 1})
        for (const std::size_t other : cells_[cell])
          if (std::hypot(circle.x - all[other].x, circle.y - all[other].y) <
              share_ * (circle.radius + all[other].radius))
            return;
    cells_[at].push_back(all.size());
    all.push_back(circle);
  }

 private:
  // The outermost cells stay empty.
  [[nodiscard]] std::size_t cell_of(const Circle& circle) const {
    return (static_cast<std::size_t>((circle.y - top_) / cell_) + 1) * columns_ +
           static_cast<std::size_t>((circle.x - left_) / cell_) + 1;
  }

  double share_, cell_ = 1, left_ = 0, top_ = 0;
  std::size_t columns_ = 0;
  std::vector<std::vector<std::size_t>> cells_;
};

}  // namespace

Circle fit_circle(const EdgeMap& edges, const Circle& start, Polarity polarity, const RimRays& rays) {
  const float sign = sign_of(polarity);
  Circle circle = start;
  if (!worth_fitting(edges, start, sign, std::max(1.2, rays.reach * start.radius))) return circle;
  constexpr int rounds = 3;
  const Directions directions(rays.count);
  MetAround around;
  std::vector<MetEdge> met;
  std::vector<float> slopes;
  met.reserve(most_directions), slopes.reserve(most_directions);
  for (int round = 0; round <= rounds; ++round) {
    const double narrow = std::max(least_tolerance, rays.tolerance * circle.radius);
    const double wide = std::max(1.2, rays.reach * circle.radius);
    const double reach = round == 0 ? wide : round == 1 ? 0.5 * (wide + narrow) : narrow;
    met.clear();
    slopes.clear();
    circle.met = 0;
    circle.directions = rays.count;
    int in_view = 0;
    double square = 0;
    look_around(edges, circle, directions, sign, reach, around);
    for (int k = 0; k < rays.count; ++k) {
      const auto [cosine, sine] = directions.of[static_cast<std::size_t>(k)];
      const Met& one = around[static_cast<std::size_t>(k)];
      in_view += one.in_view;
      if (!one.edge || !one.in_view || std::abs(one.offset) > reach) continue;
      met.push_back({cosine, sine, one.offset});
      slopes.push_back(one.slope);
      circle.met |= std::uint64_t{1} << static_cast<unsigned>(k);
      square += one.offset * one.offset;
    }
    circle.rays = in_view;
    circle.support = 2 * in_view < rays.count ? 0 : static_cast<double>(met.size()) / in_view;
    circle.scatter = met.empty() ? 0 : std::sqrt(square / static_cast<double>(met.size())) / circle.radius;
    if (rays.faint > 0 && !met.empty()) {
      weigh(met, slopes, rays.faint);
      circle.scatter = weighted_scatter(met) / circle.radius;
    }
    if (round == rounds || circle.support < 0.15) break;
    const CircleStep step = step_towards(met, rays.count);
    circle.x += std::clamp(step.x, -reach, reach);
    circle.y += std::clamp(step.y, -reach, reach);
    circle.radius += std::clamp(step.radius, -0.5 * reach, 0.5 * reach);
    const double away = std::hypot(circle.x - start.x, circle.y - start.y);
    if (away > 0.5 * start.radius || circle.radius < 0.7 * start.radius || circle.radius > 1.4 * start.radius) {
      circle.support = 0;
      break;
    }
  }
  if (!slopes.empty()) {
    circle.contrast = step_per_slope * static_cast<double>(median_of(slopes));
  }
  return circle;
}

double radius_towards(const EdgeMap& edges, const Circle& circle, Polarity polarity, std::uint64_t open, int fewest) {
  const float sign = sign_of(polarity);
  constexpr double reach = 0.15;  // radii
  MetAround around;
  look_around(edges, circle, Directions(circle.directions), sign, std::max(1.2, reach * circle.radius), around);
  std::vector<float> distances;
  for (int k = 0; k < circle.directions; ++k) {
    if ((open >> static_cast<unsigned>(k) & 1U) == 0) continue;
    const Met& met = around[static_cast<std::size_t>(k)];
    if (met.edge && met.in_view) distances.push_back(static_cast<float>(circle.radius + met.offset));
  }
  if (static_cast<int>(distances.size()) < fewest) return 0;
  return static_cast<double>(median_of(distances));
}

std::vector<Circle> find_circles(const EdgeMap& edges, const CirclesAsked& asked) {
  std::vector<Circle> found;
  if (edges.ridge.size() < 8) return found;
  const float sign = sign_of(asked.polarity);
  const double ratio = asked.votes.radius_ratio;
  const int count = static_cast<int>(std::ceil(std::log(asked.to_px / asked.from_px) / std::log(ratio) - 1e-9)) + 1;
  VoteMap votes(edges);
  for (int k = 0; k < count; ++k) {
    const double radius = asked.from_px * std::pow(ratio, k);
    for (const Circle& peak : votes.peaks(radius, sign, asked.votes.least)) {
      if (asked.leave_out && asked.leave_out(peak)) continue;
      StopQuestion::ask();
      const Circle circle = fit_circle(edges, peak, asked.polarity);
      if (circle.support >= asked.least_support) found.push_back(circle);
    }
  }
  return found;
}

std::vector<Circle> without_doubles(std::vector<Circle> circles, double share) {
  std::sort(circles.begin(), circles.end(), [](const Circle& a, const Circle& b) {
    const double one = a.support - a.scatter, other = b.support - b.scatter;
    if (one != other) return one > other;
    if (a.y != b.y) return a.y < b.y;
    return a.x < b.x;
  });
  KeptCircles kept(circles, share);
  for (const Circle& circle : circles) kept.keep_unless_near(circle);
  return std::move(kept.all);
}

Circle on_the_map(Circle circle, const ScaledPicture& at) {
  circle.x = at.from_frame_x(circle.x);
  circle.y = at.from_frame_y(circle.y);
  circle.radius /= at.scale;
  return circle;
}

Circle in_the_frame(Circle circle, const ScaledPicture& at) {
  circle.x = at.to_frame_x(circle.x);
  circle.y = at.to_frame_y(circle.y);
  circle.radius *= at.scale;
  return circle;
}

Circle in_reduced_frame(Circle circle, int reduction) {
  circle.x = (circle.x + 0.5) / reduction - 0.5;
  circle.y = (circle.y + 0.5) / reduction - 0.5;
  circle.radius /= reduction;
  return circle;
}

Places places_of(const std::vector<Circle>& circles, int reduction) {
  Places places;
  places.reserve(circles.size());
  for (const Circle& circle : circles) {
    const Circle there = in_reduced_frame(circle, reduction);
    places.emplace_back(there.x, there.y);
  }
  return places;
}

}  // namespace shakebed::ingest
