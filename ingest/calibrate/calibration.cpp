#include "ingest/calibrate/calibration.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/calibrate/radius_vote.hpp"

namespace shakebed::ingest {

namespace {

constexpr int window_side = 340;  // px, of the busiest part looked at on each level: enough for a radius of a few px
// A few large circles whose rims are seen in part are something else: the outline of the whole bed, say.
constexpr double large_share = 0.2;  // of the frame's shorter side, for a radius
constexpr std::size_t few_circles = 5;
constexpr double well_supported = 0.85, doubted = 0.01;
// The rims of a crystal are explained as well by the small voids between its beads, of the other polarity: if circles
// a few times larger do nearly as well, they are the beads.
constexpr double least_bead_ratio = 2.2, most_bead_ratio = 7, nearly_as_good = 0.4;
constexpr double faintest_merit = 0.004, another_radius = 1.15;  // for what is tried as well
constexpr std::size_t most_others = 4;
// Three touching beads leave a void of 0.15 radii or, blurred, up to 0.4, and the voids of a crystal are 1.155 radii
// apart; touching beads of that size would be 2 of their radii apart.
constexpr double fair_void_merit = 0.3, least_void_spacing = 2.6, most_void_spacing = 9, same_radius = 0.1;
constexpr double regular_spacing = 0.1;  // scatter over median of evenly spaced voids
constexpr double least_merit = 0.02;     // of all edges in the frame; white noise reaches 0.002

Polarity polarity_of(const RadiusCandidate& candidate) {
  return candidate.sign > 0 ? Polarity::dark_beads : Polarity::bright_beads;
}

// Circles at all scales: on each level of a pyramid the radii that are large enough there.
std::vector<RadiusCandidate> candidates_of(const GrayFrame& frame, double smallest_px, double largest_px) {
  std::vector<RadiusCandidate> candidates;
  GrayFrame level = frame;
  double scale = 1, low = std::max(1.0, smallest_px);
  while (low < largest_px && level.width >= 5 && level.height >= 5) {
    const double high = std::min(largest_px, 8.5 * scale);
    if (high > low) {
      const PicturePart part = busiest_part(level, window_side, {.block = 20, .reach = 1, .stride = 1});
      const auto found = vote_for_radii(cut_out(level, part), scale, {low / scale, high / scale});
      candidates.insert(candidates.end(), found.begin(), found.end());
    }
    low = 7.5 * scale;
    level = halved(level);
    scale *= 2;
  }
  return candidates;
}

class RadiusChoice {
 public:
  RadiusChoice(std::vector<RadiusCandidate> candidates, Polarity polarity, double large_px)
      : candidates_(std::move(candidates)), polarity_(polarity), large_px_(large_px) {}

  RadiusEstimate choose() {
    const RadiusCandidate* best = best_candidate();
    add_others();
    if (best == nullptr) return refused();
    estimate_.radius_px = best->radius;
    estimate_.polarity = polarity_of(*best);
    estimate_.score = best->explained * best->support;
    look_for_voids(*best);
    if (merit(*best) < least_merit) {
      if (estimate_.packed_radius_px > 0)
        estimate_.others.insert(estimate_.others.begin(), {estimate_.packed_radius_px, estimate_.packed_polarity});
      return refused();
    }
    estimate_.found = true;
    return std::move(estimate_);
  }

 private:
  [[nodiscard]] double merit(const RadiusCandidate& candidate) const {
    const bool outline =
        candidate.count < few_circles && candidate.radius > large_px_ && candidate.support < well_supported;
    return (outline ? doubted : 1.0) * candidate.explained * candidate.support * candidate.support;
  }
  [[nodiscard]] bool allowed(const RadiusCandidate& candidate) const {
    return polarity_ == Polarity::automatic || polarity_of(candidate) == polarity_;
  }

  [[nodiscard]] const RadiusCandidate* best_candidate() const {
    const RadiusCandidate* best = nullptr;
    for (const RadiusCandidate& candidate : candidates_)
      if (allowed(candidate) && (best == nullptr || merit(candidate) > merit(*best))) best = &candidate;
    if (best == nullptr) return best;
    const RadiusCandidate* beads = nullptr;
    for (const RadiusCandidate& candidate : candidates_) {
      const double ratio = candidate.radius / best->radius;
      if (candidate.sign == best->sign || !allowed(candidate) || ratio < least_bead_ratio || ratio > most_bead_ratio)
        continue;
      if (merit(candidate) > nearly_as_good * merit(*best) && (beads == nullptr || merit(candidate) > merit(*beads)))
        beads = &candidate;
    }
    return beads != nullptr ? beads : best;
  }

  // What else circles were seen of, best first.
  void add_others() {
    std::vector<RadiusCandidate> ranked = candidates_;
    std::sort(ranked.begin(), ranked.end(),
              [&](const RadiusCandidate& a, const RadiusCandidate& b) { return merit(a) > merit(b); });
    for (const RadiusCandidate& candidate : ranked) {
      const auto near = [&](double radius) {
        return std::max(radius / candidate.radius, candidate.radius / radius) < another_radius;
      };
      const bool known = std::any_of(estimate_.others.begin(), estimate_.others.end(), [&](const auto& other) {
        return other.polarity == polarity_of(candidate) && near(other.radius_px);
      });
      if (merit(candidate) < faintest_merit || known || !allowed(candidate) || estimate_.others.size() >= most_others)
        continue;
      estimate_.others.push_back({candidate.radius, polarity_of(candidate)});
    }
  }

  // Voids whose spacing gives the radius of the beads around them.
  void look_for_voids(const RadiusCandidate& best) {
    const RadiusCandidate* voids = nullptr;
    for (const RadiusCandidate& candidate : candidates_) {
      const double spacing = candidate.spacing.median / candidate.radius;
      if (spacing < least_void_spacing || spacing > most_void_spacing) continue;
      if (merit(candidate) < fair_void_merit * merit(best)) continue;
      if (polarity_ != Polarity::automatic && allowed(candidate)) continue;
      if (voids == nullptr || merit(candidate) > merit(*voids)) voids = &candidate;
    }
    if (voids == nullptr) return;
    const double radius = 0.5 * std::numbers::sqrt3 * voids->spacing.median;
    const Polarity other = voids->sign > 0 ? Polarity::bright_beads : Polarity::dark_beads;
    if (other == estimate_.polarity && std::abs(radius / estimate_.radius_px - 1) <= same_radius) return;
    estimate_.packed_radius_px = radius;
    estimate_.packed_polarity = other;
    estimate_.packed_likely = voids->spacing.scatter < regular_spacing * voids->spacing.median;
  }

  RadiusEstimate refused() {
    estimate_.why_not = "no circle of any radius was found: no edges in the frame have a common centre";
    return std::move(estimate_);
  }

  std::vector<RadiusCandidate> candidates_;
  Polarity polarity_;
  double large_px_;
  RadiusEstimate estimate_;
};

}  // namespace

RadiusEstimate estimate_radius(const GrayFrame& frame, Polarity polarity, double smallest_radius_px,
                               double largest_radius_px) {
  if (frame.width < 5 || frame.height < 5) {
    RadiusEstimate estimate;
    estimate.why_not = "the frame is smaller than 5 x 5 px, too small for a disk";
    return estimate;
  }
  const double shorter = std::min(frame.width, frame.height);
  const double largest = largest_radius_px > 0 ? largest_radius_px : shorter / 2.2;
  return RadiusChoice(candidates_of(frame, smallest_radius_px, largest), polarity, large_share * shorter).choose();
}

}  // namespace shakebed::ingest
