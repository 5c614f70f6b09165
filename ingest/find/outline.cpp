#include "ingest/find/outline.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <optional>

#include "ingest/find/nearby.hpp"
#include "statistics/ranks.hpp"
#include "statistics/text.hpp"

namespace shakebed::ingest {

namespace {

constexpr int outline_directions = 48;
constexpr std::size_t most_outlines = 120;                                 // followed: enough for a median
constexpr double nearest_outline_edge = 0.5, farthest_outline_edge = 1.6;  // radii: where an outline may run
constexpr double ring_step = 0.5;                                          // px
// An outline of axis ratio 2 leaves the direction of the radius by up to 37 degrees.
constexpr double least_radial_alignment = 0.7;  // cosine between an edge's gradient and the radius
constexpr double steepest_path = 0.11;          // radii from one direction to the next: 40 degrees
constexpr double cost_of_turning = 0.15;        // of a full edge, for the steepest path
// Edges of this share of a typical rim's slope begin to count for the shape, and of the second count in full: where
// beads touch, their rims run into one another, are faint and lie farther in.
constexpr double faint_share = 0.65, full_share = 0.9;
constexpr double on_the_circle = 0.1, near_the_circle = 0.15;  // radii
constexpr double hidden_within = 0.45;                         // rad, either side of the direction to a neighbour ...
constexpr double neighbour_reach = 2.6;                        // ... whose centre is so many radii away
// px: full width at half maximum of a sharp step's slope in the map of edges (a Gaussian of 1.1 px).
constexpr double width_of_a_step = 2.6;
constexpr double nearest_slope = 0.1, farthest_slope = 2, slope_step = 0.25;  // radii, radii, px: for the rim's width
constexpr double least_followed = 0.3;                                        // share of the directions, for harmonics
constexpr double hold_harmonics = 0.02;  // of all directions: keeps what no edge shows at 0

// Limits. Drawn beads of eight looks (24 pictures), four laboratories' beads and coins: on the circle 0.99 or more, gap
// up to 0.15, deviation up to 0.027, single harmonics up to 0.024 (second) and 0.017. Drawings of other shapes: on the
// circle up to 0.96, or gap from 0.25, or deviation from 0.033, or a harmonic of 0.022 (a honeycomb) to 0.13.
constexpr double least_on_circle = 0.97, largest_gap = 0.2, largest_deviation = 0.03, largest_harmonic = 0.02;
// The picture's aspect ratio, which the calibration corrects: an elongation by 8 %.
constexpr double largest_common_elongation = 0.04;
constexpr double largest_own_elongation = 0.035;
// A single outline is noisier than the median.
constexpr double largest_single_deviation = 0.045, least_single_on_circle = 0.85, largest_single_gap = 0.3;
constexpr double most_not_round = 0.4;  // beads seen 2.6 px in radius, enlarged by repeating pixels: 0.21 to 0.32

// Outlines on each side of a cut, at least; and the chance that shapes without a place give such a cut.
constexpr std::size_t fewest_on_a_side = 8;
constexpr double cut_by_chance = 1e-4;
// Share of the outlines beyond a cut that are not round, where other things than beads lie there: of drawn squares 1.
// Of beads whose faces show stress, of which some look round, 0.7.
constexpr double least_not_round_beyond = 0.9;

constexpr std::size_t outline_terms = 1 + 2 * highest_harmonic;

struct OneOutline {
  double x = 0, y = 0;  // px, of the circle
  double followed = 0, on_circle = 1, gap = 0, deviation = 0, rim_width = 0;
  std::array<std::complex<double>, highest_harmonic + 1> harmonic{};
  bool developed = false;
};

struct Ray {
  double cosine = 0, sine = 0;
  std::array<double, outline_terms> basis{};
};
const std::array<Ray, outline_directions>& rays() {
  static const std::array<Ray, outline_directions> table = [] {
    std::array<Ray, outline_directions> all{};
    for (std::size_t k = 0; k < all.size(); ++k) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(k) / outline_directions;
      all[k] = {std::cos(angle), std::sin(angle), {1}};
      for (std::size_t q = 1; q <= highest_harmonic; ++q) {
        all[k].basis[2 * q - 1] = std::cos(static_cast<double>(q) * angle);
        all[k].basis[2 * q] = std::sin(static_cast<double>(q) * angle);
      }
    }
    return all;
  }();
  return table;
}

// Slopes along one direction that can be an outline's; nothing where the circle is out of view.
class Slopes {
 public:
  Slopes(const EdgeMap& edges, Polarity polarity)
      : edges_(edges), sign_(polarity == Polarity::bright_beads ? -1.0F : 1.0F) {}

  [[nodiscard]] bool in_view(double x, double y) const {
    return x >= 1 && y >= 1 && x < edges_.width - 2 && y < edges_.height - 2;
  }
  [[nodiscard]] float at(double x, double y, const Ray& ray) const {
    if (!in_view(x, y)) return 0;
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const float right = static_cast<float>(x - column), lower = static_cast<float>(y - row);
    const std::size_t upper_left = edges_.at(column, row), below = upper_left + static_cast<std::size_t>(edges_.width);
    const auto mix = [&](const std::vector<float>& field) {
      return (1 - lower) * ((1 - right) * field[upper_left] + right * field[upper_left + 1]) +
             lower * ((1 - right) * field[below] + right * field[below + 1]);
    };
    const float along_x = mix(edges_.x), along_y = mix(edges_.y);
    const float radial = sign_ * (along_x * static_cast<float>(ray.cosine) + along_y * static_cast<float>(ray.sine));
    const float slope = std::hypot(along_x, along_y);
    return slope < edges_.threshold || radial < static_cast<float>(least_radial_alignment) * slope ? 0.0F : slope;
  }
  // Towards the outside, whatever its size and direction.
  [[nodiscard]] double outwards(double x, double y, const Ray& ray) const {
    if (!in_view(x, y)) return 0;
    const std::size_t at = edges_.at(static_cast<int>(x + 0.5), static_cast<int>(y + 0.5));
    return static_cast<double>(sign_) *
           (static_cast<double>(edges_.x[at]) * ray.cosine + static_cast<double>(edges_.y[at]) * ray.sine);
  }
  // The steepest within three steps of the circle.
  [[nodiscard]] float at_rim(const Circle& circle, const Ray& ray) const {
    float most = 0;
    for (double off = -3 * ring_step; off <= 3 * ring_step; off += ring_step)
      most = std::max(
          most, at(circle.x + (circle.radius + off) * ray.cosine, circle.y + (circle.radius + off) * ray.sine, ray));
    return most;
  }

 private:
  const EdgeMap& edges_;
  float sign_;
};

// The closed path of largest slope around one circle.
class OutlinePath {
 public:
  OutlinePath(const Slopes& slopes, const Circle& circle, double typical_slope)
      : circle_(circle),
        rings_(static_cast<std::size_t>((farthest_outline_edge - nearest_outline_edge) * circle.radius / ring_step) +
               1),
        score_(outline_directions * rings_) {
    for (std::size_t k = 0; k < outline_directions; ++k)
      for (std::size_t ring = 0; ring < rings_; ++ring) {
        const Ray& ray = rays()[k];
        const double r = radius_of(static_cast<double>(ring));
        const float slope = slopes.at(circle.x + r * ray.cosine, circle.y + r * ray.sine, ray);
        score_[k * rings_ + ring] = std::min(1.0F, slope / static_cast<float>(typical_slope));
      }
    follow();
  }

  std::array<double, outline_directions> offset{};  // from the circle, radii
  std::array<double, outline_directions> weight{};  // 0 .. 1: a faint edge or a clear one
  std::array<bool, outline_directions> met{};       // an edge at all

 private:
  [[nodiscard]] double radius_of(double ring) const { return nearest_outline_edge * circle_.radius + ring * ring_step; }

  // Three turns, of which the middle one closes well enough.
  void follow() {
    constexpr std::size_t turns = 3, steps = turns * outline_directions;
    const int jump = std::max(1, static_cast<int>(std::lround(steepest_path * circle_.radius / ring_step)));
    const auto cost = static_cast<float>(cost_of_turning / jump);
    std::vector<float> value(score_.begin(), score_.begin() + static_cast<std::ptrdiff_t>(rings_)), next(rings_);
    std::vector<std::int8_t> came_from(steps * rings_, 0);
    for (std::size_t step = 1; step < steps; ++step) {
      for (int ring = 0; ring < static_cast<int>(rings_); ++ring) {
        float best = -1e9F;
        int by = 0;
        const int last = std::min(jump, static_cast<int>(rings_) - 1 - ring);
        for (int j = std::max(-jump, -ring); j <= last; ++j) {
          const float here = value[static_cast<std::size_t>(ring + j)] - cost * static_cast<float>(std::abs(j));
          if (here > best) best = here, by = j;
        }
        const auto at = static_cast<std::size_t>(ring);
        next[at] = best + score_[(step % outline_directions) * rings_ + at];
        came_from[step * rings_ + at] = static_cast<std::int8_t>(by);
      }
      value.swap(next);
    }
    auto ring = static_cast<std::size_t>(std::max_element(value.begin(), value.end()) - value.begin());
    for (std::size_t step = steps - 1; step >= outline_directions; --step) {
      if (step < 2 * outline_directions) take(step - outline_directions, ring);
      ring = static_cast<std::size_t>(static_cast<int>(ring) + came_from[step * rings_ + ring]);
    }
  }

  void take(std::size_t k, std::size_t ring) {
    const float* along = score_.data() + k * rings_;
    double part = 0;
    if (ring > 0 && ring + 1 < rings_) {
      const float bend = along[ring - 1] - 2 * along[ring] + along[ring + 1];
      if (bend < 0) part = std::clamp(0.5 * static_cast<double>((along[ring - 1] - along[ring + 1]) / bend), -0.5, 0.5);
    }
    offset[k] = radius_of(static_cast<double>(ring) + part) / circle_.radius - 1;
    met[k] = along[ring] > 0;
    weight[k] = std::clamp((static_cast<double>(along[ring]) - faint_share) / (full_share - faint_share), 0.0, 1.0);
  }

  const Circle& circle_;
  std::size_t rings_;
  std::vector<float> score_;  // 0 .. 1, by direction and ring
};

// Weighted least squares of the outline's harmonics; those that no edge shows are held at 0.
std::array<double, outline_terms> harmonics_of(const OutlinePath& path) {
  std::array<std::array<double, outline_terms + 1>, outline_terms> rows{};
  for (std::size_t k = 0; k < outline_directions; ++k) {
    const auto& basis = rays()[k].basis;
    for (std::size_t p = 0; p < outline_terms; ++p) {
      for (std::size_t q = 0; q < outline_terms; ++q) rows[p][q] += path.weight[k] * basis[p] * basis[q];
      rows[p][outline_terms] += path.weight[k] * basis[p] * path.offset[k];
    }
  }
  for (std::size_t p = 0; p < outline_terms; ++p) rows[p][p] += p < 3 ? 1e-6 : hold_harmonics * outline_directions;
  for (std::size_t p = 0; p < outline_terms; ++p)
    for (std::size_t q = 0; q < outline_terms; ++q) {
      if (q == p) continue;
      const double part = rows[q][p] / rows[p][p];
      for (std::size_t c = p; c <= outline_terms; ++c) rows[q][c] -= part * rows[p][c];
    }
  std::array<double, outline_terms> amplitude{};
  for (std::size_t p = 0; p < outline_terms; ++p) amplitude[p] = rows[p][outline_terms] / rows[p][p];
  return amplitude;
}

class OutlineFollower {
 public:
  OutlineFollower(const EdgeMap& edges, const std::vector<Circle>& circles, Polarity polarity)
      : circles_(circles),
        slopes_(edges, polarity),
        reach_(neighbour_reach * largest_radius(circles)),
        near_(circles.size(), reach_, [&](std::size_t i) { return std::pair(circles[i].x, circles[i].y); }),
        least_slope_(static_cast<double>(edges.threshold)) {}

  // Nothing for what is cut by the border.
  [[nodiscard]] std::optional<OneOutline> follow(const Circle& circle) const {
    for (const Ray& ray : rays())
      if (!slopes_.in_view(circle.x + circle.radius * ray.cosine, circle.y + circle.radius * ray.sine))
        return std::nullopt;
    std::vector<double> rim;
    for (const Ray& ray : rays()) rim.push_back(static_cast<double>(slopes_.at_rim(circle, ray)));
    const OutlinePath path(slopes_, circle, std::max(least_slope_, median_of(rim)));
    OneOutline outline;
    outline.x = circle.x, outline.y = circle.y;
    double clear = 0;
    for (const double weight : path.weight) clear += weight;
    outline.followed = clear / outline_directions;
    outline.on_circle = clear > 0 ? share_on_circle(path, {}) / clear : 0;
    outline.gap = gap_of(path, circle);
    outline.rim_width = rim_width_of(circle);
    if (outline.followed >= least_followed) develop(path, clear, outline);
    return outline;
  }

 private:
  static double largest_radius(const std::vector<Circle>& circles) {
    double largest = 1;
    for (const Circle& circle : circles) largest = std::max(largest, circle.radius);
    return largest;
  }

  // Sum of the weights of what lies on a circle of the first three terms: size and place.
  static double share_on_circle(const OutlinePath& path, const std::array<double, outline_terms>& terms) {
    double on_circle = 0;
    for (std::size_t k = 0; k < outline_directions; ++k) {
      double circle = 0;
      for (std::size_t p = 0; p < 3; ++p) circle += terms[p] * rays()[k].basis[p];
      if (std::abs(path.offset[k] - circle) < on_the_circle) on_circle += path.weight[k];
    }
    return on_circle;
  }

  // About the outline's own circle: of beads that others cover in part, the circles seen are smaller than those of
  // beads that lie alone.
  static void develop(const OutlinePath& path, double clear, OneOutline& outline) {
    const std::array<double, outline_terms> amplitude = harmonics_of(path);
    outline.on_circle = share_on_circle(path, amplitude) / clear;
    double squares = 0;
    for (std::size_t k = 0; k < outline_directions; ++k) {
      double shape = 0;
      for (std::size_t p = 3; p < outline_terms; ++p) shape += amplitude[p] * rays()[k].basis[p];
      squares += path.weight[k] * shape * shape;
    }
    outline.deviation = std::sqrt(squares / clear);
    for (std::size_t q = 2; q <= highest_harmonic; ++q) outline.harmonic[q] = {amplitude[2 * q - 1], amplitude[2 * q]};
    outline.developed = true;
  }

  // From the slope averaged over all directions.
  [[nodiscard]] double rim_width_of(const Circle& circle) const {
    std::vector<double> slope;
    std::size_t steepest = 0;
    for (double r = nearest_slope * circle.radius; r < farthest_slope * circle.radius; r += slope_step) {
      double sum = 0;
      for (const Ray& ray : rays()) sum += slopes_.outwards(circle.x + r * ray.cosine, circle.y + r * ray.sine, ray);
      slope.push_back(sum);
      if (std::abs(r - circle.radius) < on_the_circle * circle.radius + 1 && sum > slope[steepest])
        steepest = slope.size() - 1;
    }
    std::size_t first = steepest, last = steepest;
    while (first > 0 && slope[first] > 0.5 * slope[steepest]) --first;
    while (last + 1 < slope.size() && slope[last] > 0.5 * slope[steepest]) ++last;
    const double width = static_cast<double>(last - first) * slope_step;
    return std::sqrt(std::max(0.0, width * width - width_of_a_step * width_of_a_step)) / circle.radius;
  }

  [[nodiscard]] double gap_of(const OutlinePath& path, const Circle& circle) const {
    std::array<bool, outline_directions> hidden{};
    near_.any_near(circle.x, circle.y, [&](std::size_t i) {
      const double dx = circles_[i].x - circle.x, dy = circles_[i].y - circle.y, away = std::hypot(dx, dy);
      if (away < 0.1 * circle.radius || away > neighbour_reach * circle.radius) return false;
      for (std::size_t k = 0; k < outline_directions; ++k)
        hidden[k] = hidden[k] || dx * rays()[k].cosine + dy * rays()[k].sine > away * std::cos(hidden_within);
      return false;
    });
    int run = 0, longest = 0;
    for (std::size_t step = 0; step < 2 * outline_directions; ++step) {
      const std::size_t k = step % outline_directions;
      if (path.met[k] && std::abs(path.offset[k]) < near_the_circle)
        run = 0;
      else if (!hidden[k])
        ++run;
      longest = std::max(longest, std::min(run, outline_directions));
    }
    return static_cast<double>(longest) / outline_directions;
  }

  const std::vector<Circle>& circles_;
  Slopes slopes_;
  double reach_;
  Nearby near_;
  double least_slope_;
};

// The second harmonic that all share, which is the picture's aspect.
std::complex<double> shared_second_of(const std::vector<OneOutline>& outlines) {
  std::complex<double> second;
  double developed = 0;
  for (const OneOutline& one : outlines)
    if (one.developed) second += one.harmonic[2], ++developed;
  return developed > 0 ? second / developed : second;
}

// Without what all share.
double own_deviation(const OneOutline& one, std::complex<double> second) {
  const double own = 0.5 * (std::norm(one.harmonic[2]) - std::norm(one.harmonic[2] - second));
  return std::sqrt(std::max(0.0, one.deviation * one.deviation - own));
}

bool plainly_not_round(const OneOutline& one, std::complex<double> second) {
  return own_deviation(one, second) > largest_single_deviation || one.on_circle < least_single_on_circle ||
         one.gap > largest_single_gap;
}

Roundness summary_of(const std::vector<OneOutline>& outlines) {
  Roundness out;
  std::vector<double> on_circle, gap, deviation, rim_width;
  std::array<std::vector<double>, highest_harmonic + 1> harmonic;
  const std::complex<double> second = shared_second_of(outlines);
  double not_round = 0;
  for (const OneOutline& one : outlines) {
    on_circle.push_back(one.on_circle);
    gap.push_back(one.gap);
    rim_width.push_back(one.rim_width);
    not_round += plainly_not_round(one, second);
    if (!one.developed) continue;
    deviation.push_back(own_deviation(one, second));
    for (std::size_t q = 2; q <= highest_harmonic; ++q) harmonic[q].push_back(std::abs(one.harmonic[q]));
  }
  out.outlines = outlines.size();
  if (outlines.empty()) return out;
  out.not_round = not_round / static_cast<double>(outlines.size());
  out.on_circle = median_of(on_circle);
  out.gap = median_of(gap);
  out.rim_width = median_of(rim_width);
  if (deviation.empty()) return out;
  out.deviation = median_of(deviation);
  out.common_elongation = std::abs(second);
  for (std::size_t q = 2; q <= highest_harmonic; ++q) out.harmonic[q] = median_of(harmonic[q]);
  return out;
}

// k ln(k / n) and the same of the rest: the largest log likelihood of k successes in n.
double log_likelihood(double k, double n) {
  const auto part = [n](double count) { return count > 0 ? count * std::log(count / n) : 0; };
  return part(k) + part(n - k);
}

// Which of all cuts along rows and columns best separates outlines that are not round from the others, if chance does
// not give such a one.
std::optional<SideOfCut> best_cut(std::vector<OneOutline> outlines) {
  const std::complex<double> second = shared_second_of(outlines);
  const auto count = static_cast<double>(outlines.size());
  double all = 0;
  for (const OneOutline& one : outlines) all += plainly_not_round(one, second);
  double most = log_likelihood(all, count) + std::log(2 * count / cut_by_chance);
  std::optional<SideOfCut> best;
  for (const bool left_or_right : {true, false}) {
    const auto place = [&](const OneOutline& one) { return left_or_right ? one.x : one.y; };
    std::sort(outlines.begin(), outlines.end(),
              [&](const OneOutline& a, const OneOutline& b) { return place(a) < place(b); });
    double before = 0;
    for (std::size_t k = 1; k < outlines.size(); ++k) {
      before += plainly_not_round(outlines[k - 1], second);
      const auto here = static_cast<double>(k);
      const double likely = log_likelihood(before, here) + log_likelihood(all - before, count - here);
      if (likely <= most || k < fewest_on_a_side || outlines.size() - k < fewest_on_a_side) continue;
      most = likely;
      best = SideOfCut{left_or_right, before / here > (all - before) / (count - here),
                       0.5 * (place(outlines[k - 1]) + place(outlines[k]))};
    }
  }
  return best;
}

bool on_side(const OneOutline& one, const SideOfCut& side) {
  return ((side.left_or_right ? one.x : one.y) > side.at) == side.beyond;
}

// A cut with round outlines on one side, and on the other hardly any.
std::optional<SideOfCut> round_side_of(const std::vector<OneOutline>& outlines) {
  const std::optional<SideOfCut> side = best_cut(outlines);
  if (!side) return std::nullopt;
  std::vector<OneOutline> here, there;
  for (const OneOutline& one : outlines) (on_side(one, *side) ? here : there).push_back(one);
  const Roundness beyond = summary_of(there);
  if (!summary_of(here).round() || beyond.round() || beyond.not_round < least_not_round_beyond) return std::nullopt;
  return side;
}

std::vector<OneOutline> outlines_of(const OutlineFollower& follower, const std::vector<Circle>& circles,
                                    std::size_t step) {
  std::vector<OneOutline> outlines;
  for (std::size_t k = 0; k < circles.size(); k += step)
    if (const auto outline = follower.follow(circles[k])) outlines.push_back(*outline);
  return outlines;
}

}  // namespace

PixelRectangle part_on(const SideOfCut& side, int width, int height) {
  const int limit = side.left_or_right ? width : height;
  const int at = std::clamp(static_cast<int>(std::lround(side.at)), 1, limit - 1);
  const int from = side.beyond ? at : 0, size = side.beyond ? limit - at : at;
  return side.left_or_right ? PixelRectangle{from, 0, size, height} : PixelRectangle{0, from, width, size};
}

std::string Roundness::why_not() const {
  if (outlines == 0) return {};
  if (on_circle < least_on_circle)
    return formatted(
        "the outlines are not round: only %.1f %% of a typical outline lies on its circle (at least %.0f %% is needed)",
        100 * on_circle, 100 * least_on_circle);
  if (gap > largest_gap)
    return formatted("the outlines are open: %.0f %% of the circumference is missing (allowed: %.0f %%)", 100 * gap,
                     100 * largest_gap);
  const double own_limit = common_elongation + largest_own_elongation;
  if (common_elongation > largest_common_elongation || harmonic[2] > own_limit) {
    const double limit = common_elongation > largest_common_elongation ? largest_common_elongation : own_limit;
    return formatted("the outlines are oval: the ratio of their axes is %.2f (allowed: %.2f)",
                     (1 + harmonic[2]) / (1 - harmonic[2]), (1 + limit) / (1 - limit));
  }
  for (std::size_t q = 3; q <= highest_harmonic; ++q)
    if (harmonic[q] > largest_harmonic)
      return formatted(
          "the outlines are not round: they have %.0f corners or bulges, %.1f %% of the radius high (allowed: %.0f %%)",
          static_cast<double>(q), 100 * harmonic[q], 100 * largest_harmonic);
  if (deviation > largest_deviation)
    return formatted(
        "the outlines are not round: they deviate from a circle by %.1f %% of the radius (allowed: %.0f %%)",
        100 * deviation, 100 * largest_deviation);
  if (not_round > most_not_round)
    return formatted("%.0f %% of the outlines are not round (allowed: %.0f %%)", 100 * not_round, 100 * most_not_round);
  return {};
}

Roundness roundness_of(const EdgeMap& edges, const std::vector<Circle>& circles, Polarity polarity) {
  const OutlineFollower follower(edges, circles, polarity);
  const std::size_t step = std::max<std::size_t>(1, circles.size() / most_outlines);
  const std::vector<OneOutline> outlines = outlines_of(follower, circles, step);
  Roundness out = summary_of(outlines);
  out.round_side = round_side_of(outlines);
  // Where the cut runs is known by all outlines.
  if (out.round_side && step > 1)
    if (const auto side = round_side_of(outlines_of(follower, circles, 1))) out.round_side = side;
  return out;
}

}  // namespace shakebed::ingest
