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

constexpr double gap_reach = 2;       // radii: so far from a bead's rim a circle's rim may be
constexpr double nearest_rims = 0.8;  // sums of radii: two circles nearer than that overlap
constexpr double same_radius = 0.12;  // of the beads' radius, either way
constexpr double smallest_other = 0.6,
                 largest_other = 1.67;     // of the beads' radius: down to it fringes look like beads
constexpr double faintest_support = 0.3;   // share of the rim
constexpr double least_probability = 0.5;  // of a circle that is reported
// Other sizes are believed when so many are expected, and so large a share of the beads.
constexpr double fewest_others = 3, least_share_of_others = 0.05;

// Where a place of the map is in the picture that the beads were found in.
using ToPicture = std::function<FramePlace(double x, double y)>;

class GapSearch {
 public:
  GapSearch(const EdgeMap& edges, std::vector<Circle> beads, double radius, Polarity polarity, ToPicture to_picture)
      : edges_(edges),
        beads_(std::move(beads)),
        radius_(radius),
        polarity_(polarity),
        to_picture_(std::move(to_picture)),
        near_(beads_.size(), largest_reach(), [&](std::size_t i) { return std::pair(beads_[i].x, beads_[i].y); }) {}

  [[nodiscard]] std::vector<Circle> of_same_size() const {
    return circles(0.93 * radius_, 1.08 * radius_, [&](double r) { return std::abs(r / radius_ - 1) <= same_radius; });
  }
  [[nodiscard]] std::vector<Circle> of_other_sizes() const {
    return circles(smallest_other * radius_, largest_other * radius_, [&](double r) {
      return std::abs(r / radius_ - 1) > same_radius && r >= smallest_other * radius_ && r <= largest_other * radius_;
    });
  }

 private:
  [[nodiscard]] double largest_reach() const {
    double largest = radius_;
    for (const Circle& bead : beads_) largest = std::max(largest, bead.radius);
    return largest + largest_other * radius_ + gap_reach * radius_;
  }

  template <class Wanted>
  [[nodiscard]] std::vector<Circle> circles(double from, double to, const Wanted& wanted) const {
    std::vector<Circle> found = find_circles(edges_, from, to, polarity_, faintest_support);
    std::erase_if(found, [&](const Circle& one) { return !wanted(one.radius) || !is_free(one); });
    return without_doubles(std::move(found), nearest_rims);
  }

  [[nodiscard]] bool is_free(const Circle& circle) const {
    const auto [x, y] = to_picture_(circle.x, circle.y);
    bool beside = false;
    const bool overlaps = near_.any_near(x, y, [&](std::size_t i) {
      const double away = std::hypot(beads_[i].x - x, beads_[i].y - y), touching = beads_[i].radius + circle.radius;
      beside = beside || away < touching + gap_reach * radius_;
      return away < nearest_rims * touching;
    });
    return beside && !overlaps;
  }

  const EdgeMap& edges_;
  std::vector<Circle> beads_;
  double radius_;
  Polarity polarity_;
  ToPicture to_picture_;
  Nearby near_;
};

FramePlace same_place(double x, double y) { return {x, y}; }

// Adds the likely ones to the beads, the others to what is missed.
void take_likely(const std::vector<Circle>& seen, const std::vector<double>& probability, bool other_size,
                 std::vector<Circle>& beads, GapCircles& out) {
  for (const Circle& circle : seen) {
    const double its = probability_at(probability, circle.support);
    if (its < least_probability) {
      out.expected_missed += its;
      continue;
    }
    out.circles.push_back({circle, its, other_size});
    beads.push_back(circle);
  }
}

}  // namespace

GapCircles circles_in_gaps(const EdgeMap& edges, const std::vector<Circle>& beads, const RimModel& model,
                           double scale) {
  GapCircles out;
  const double radius = model.radius_px / scale;
  std::vector<Circle> known = beads;
  const GapSearch first(edges, known, radius, model.polarity, same_place);
  take_likely(first.of_same_size(), model.gaps->same_size, false, known, out);
  if (model.gaps->other_size.empty()) return out;
  const GapSearch second(edges, known, radius, model.polarity, same_place);
  take_likely(second.of_other_sizes(), model.gaps->other_size, true, known, out);
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
  const auto chances = [&](const std::vector<Circle>& known, auto search) {
    const std::vector<Circle> seen = search(GapSearch(edges, known, radius, model.polarity, same_place));
    std::vector<std::vector<Circle>> by_chance;
    for (std::size_t k = 0; k < copies.size(); ++k)
      by_chance.push_back(search(GapSearch(copies[k], known, radius, model.polarity, origins[k])));
    return std::pair(probabilities_by_support(seen, by_chance, true), seen);
  };
  GapModel gaps;
  GapCircles taken;
  std::vector<Circle> known = beads;
  const auto [same, seen] = chances(known, [](const GapSearch& search) { return search.of_same_size(); });
  gaps.same_size = same;
  take_likely(seen, same, false, known, taken);
  if (one_size) return gaps;
  const auto [other, seen_others] = chances(known, [](const GapSearch& search) { return search.of_other_sizes(); });
  double expected = 0;
  for (const Circle& circle : seen_others)
    if (const double its = probability_at(other, circle.support); its >= least_probability) expected += its;
  if (expected >= std::max(fewest_others, least_share_of_others * static_cast<double>(known.size())))
    gaps.other_size = other;
  return gaps;
}

}  // namespace shakebed::ingest
