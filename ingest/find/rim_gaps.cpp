#include "ingest/find/rim_gaps.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <functional>
#include <numbers>

#include "ingest/find/nearby.hpp"
#include "ingest/find/rim_probability.hpp"

namespace shakebed::ingest {

namespace {

constexpr double gap_reach = 2;            // radii: so far from a bead's rim a circle's rim may be
constexpr double nearest_rims = 0.8;       // sums of radii: two circles nearer than that overlap
constexpr double same_bead_radius = 0.12;  // of the beads' radius, either way
// In radii of the beads; at half of it, fringes in photoelastic disks are mistaken for beads.
constexpr double smallest_other = 0.6, largest_other = 1.67;
constexpr double least_gap_probability = 0.5;  // of a circle that is reported
constexpr int most_gap_rounds = 8;             // of circles beside circles
// Other sizes are accepted when at least this number is expected, and this share of the beads.
constexpr double fewest_others = 3, least_share_of_others = 0.05;

// Where a place of the map is in the picture that the beads were found in.
using ToPicture = std::function<FramePlace(double x, double y)>;

enum class Sizes { same, other };

// Circles of a map, and which of them lie beside beads and overlap none.
class GapSearch {
 public:
  GapSearch(const EdgeMap& edges, double radius, Polarity polarity, Sizes sizes, ToPicture to_picture)
      : radius_(radius), to_picture_(std::move(to_picture)) {
    const bool same = sizes == Sizes::same;
    const double from = (same ? 1 - 0.6 * same_bead_radius : smallest_other) * radius;
    const double to = (same ? 1 + 0.6 * same_bead_radius : largest_other) * radius;
    circles_ = find_circles(edges, from, to, polarity, faintest_rim_support);
    std::erase_if(circles_, [&](const Circle& one) {
      const double ratio = one.radius / radius;
      const bool like_the_others = std::abs(ratio - 1) <= same_bead_radius;
      return same ? !like_the_others : like_the_others || ratio < smallest_other || ratio > largest_other;
    });
  }

  [[nodiscard]] std::vector<Circle> beside(const std::vector<Circle>& beads) const {
    double largest = radius_;
    for (const Circle& bead : beads) largest = std::max(largest, bead.radius);
    const Nearby near(beads.size(), largest + (largest_other + gap_reach) * radius_,
                      [&](std::size_t i) { return std::pair(beads[i].x, beads[i].y); });
    std::vector<Circle> free;
    for (const Circle& circle : circles_) {
      const auto [x, y] = to_picture_(circle.x, circle.y);
      bool beside = false;
      const bool overlaps = near.any_near(x, y, [&, x = x, y = y](std::size_t i) {
        const double away = std::hypot(beads[i].x - x, beads[i].y - y), touching = beads[i].radius + circle.radius;
        beside = beside || away < touching + gap_reach * radius_;
        return away < nearest_rims * touching;
      });
      if (beside && !overlaps) free.push_back(circle);
    }
    return without_doubles(std::move(free), nearest_rims);
  }

 private:
  double radius_;
  ToPicture to_picture_;
  std::vector<Circle> circles_;
};

FramePlace same_place(double x, double y) { return {x, y}; }

// Adds the likely ones to the beads, then those beside these, until there are no more. Returns the sum of the
// probabilities of what is left.
double take_likely(const GapSearch& search, const std::vector<double>& probability, Sizes sizes,
                   std::vector<Circle>& beads, std::vector<GapCircle>& taken) {
  for (int round = 0;; ++round) {
    double left = 0;
    const std::size_t before = taken.size();
    for (const Circle& circle : search.beside(beads)) {
      const double its = probability_at(probability, circle.support);
      if (its < least_gap_probability)
        left += its;
      else
        taken.push_back({circle, its, sizes == Sizes::other});
    }
    for (std::size_t k = before; k < taken.size(); ++k) beads.push_back(taken[k].circle);
    if (taken.size() == before || round == most_gap_rounds) return left;
  }
}

}  // namespace

GapCircles circles_in_gaps(const EdgeMap& edges, const std::vector<Circle>& beads, const RimModel& model,
                           double scale) {
  GapCircles out;
  std::vector<Circle> known = beads;
  const auto take = [&](const std::vector<double>& probability, Sizes sizes) {
    const GapSearch search(edges, model.radius_px / scale, model.polarity, sizes, same_place);
    out.expected_missed += take_likely(search, probability, sizes, known, out.circles);
  };
  take(model.gaps->same_size, Sizes::same);
  if (!model.gaps->other_size.empty()) take(model.gaps->other_size, Sizes::other);
  return out;
}

GapModel chances_in_gaps(const ScaledPicture& at, const std::vector<Circle>& beads, const RimModel& model,
                         bool one_size) {
  const double radius = model.radius_px / at.scale;
  const EdgeMap edges = find_edges(at.picture, model.threshold);
  std::vector<EdgeMap> copies;
  std::vector<ToPicture> origins;
  for (const double turn : {0.0, 0.25, 0.5, 0.75}) {
    const double angle = turn * std::numbers::pi;
    copies.push_back(find_edges(stretched(at.picture, decoy_stretch, angle), edges.threshold));
    origins.emplace_back(
        [&at, angle](double x, double y) { return place_before_stretching(at.picture, decoy_stretch, angle, x, y); });
  }
  GapModel gaps;
  std::vector<Circle> known = beads;
  std::vector<GapCircle> taken;
  const auto learn = [&](Sizes sizes, std::vector<double>& probability) {
    const GapSearch search(edges, radius, model.polarity, sizes, same_place);
    std::vector<std::vector<Circle>> by_chance;
    for (std::size_t k = 0; k < copies.size(); ++k)
      by_chance.push_back(GapSearch(copies[k], radius, model.polarity, sizes, origins[k]).beside(known));
    probability = probabilities_by_support(search.beside(known), by_chance, true);
    taken.clear();
    take_likely(search, probability, sizes, known, taken);
  };
  learn(Sizes::same, gaps.same_size);
  if (one_size) return gaps;
  const double of_one_size = static_cast<double>(known.size());
  std::vector<double> other_size;
  learn(Sizes::other, other_size);
  double expected = 0;
  for (const GapCircle& one : taken) expected += one.probability;
  if (expected >= std::max(fewest_others, least_share_of_others * of_one_size)) gaps.other_size = other_size;
  return gaps;
}

}  // namespace shakebed::ingest
