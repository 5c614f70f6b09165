#include "ingest/find/bead_profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/blurred_disk.hpp"
#include "ingest/find/nearby.hpp"
#include "ingest/find/profile_samples.hpp"
#include "ingest/frames/smooth_field.hpp"

namespace shakebed::ingest {

BeadProfile ideal_profile(double radius_px, double edge_px, double reach_px) {
  BeadProfile profile;
  profile.step_px = std::min(edge_px / 10, reach_px / 20);
  const std::size_t count = static_cast<std::size_t>(std::ceil(reach_px / profile.step_px)) + 1;
  profile.level.resize(count);
  const RadialContrast flat = [](double) { return 1.0; };
  for (std::size_t i = 0; i < count; ++i)
    profile.level[i] =
        static_cast<float>(blurred_disk_contrast(radius_px, edge_px, flat, static_cast<double>(i) * profile.step_px));
  profile.level.back() = 0;
  profile.fourth_harmonic.assign(count, 0.0F);
  return profile;
}

namespace {

// Relative to the mean weight of a coefficient: a touch of smoothness (second differences of the whole profile), for in
// a crystal pixels far out of one bead lie inside another, and what is added to the one can be taken from the other;
// and what keeps coefficients without pixels where they are.
constexpr double smoothness_share = 2e-4, ridge_share = 1e-7;
// px: p4 is learned within this distance of the rim, on cells of this width.
constexpr double ring_reach = 2.5, ring_cell = 0.25;
// A cell of p4 with a smaller weight is left as it is.
constexpr double least_ring_weight = 10;

// The four uniform cubic B-splines that live on a cell, at part t of it.
std::array<double, 4> cubic_b_splines(double t) {
  const double s = 1 - t;
  return {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6};
}

// Distances of a row's pixels from a bead, in steps.
void distances(int left, int count, double dx, double dy, double inverse_step, std::vector<float>& places) {
  const float dx0 = static_cast<float>(left - dx), squared = static_cast<float>(dy * dy);
  const float scale = static_cast<float>(inverse_step);
  float* to = places.data();
  for (int k = 0; k < count; ++k) {
    const float along = dx0 + static_cast<float>(k);
    to[k] = std::sqrt(along * along + squared) * scale;
  }
}

// Cubic splines over 0 .. reach. Coefficient k belongs to the spline centred at knot k - 1, k = 0 .. cells + 2. The
// three that reach past the last knot are held at 0; coefficient 0 is folded onto 2, so that p'(0) = 0.
class SplineBasis {
 public:
  SplineBasis(double reach_px, double knot_px)
      : cells_(std::max<std::size_t>(4, static_cast<std::size_t>(std::ceil(reach_px / knot_px)))),
        knot_(reach_px / static_cast<double>(cells_)),
        inverse_knot_(1 / knot_) {}
  [[nodiscard]] std::size_t cells() const { return cells_; }
  [[nodiscard]] double knot() const { return knot_; }
  [[nodiscard]] std::size_t free_count() const { return cells_ - 1; }  // coefficients 1 .. cells - 1
  // Three slots more, which swallow the coefficients held at 0.
  [[nodiscard]] std::size_t size() const { return free_count() + 4; }

  struct Cell {
    std::array<std::size_t, 4> slots;
    std::array<double, 4> splines;
  };
  [[nodiscard]] Cell at(double r) const {
    const double place = r * inverse_knot_;
    const std::size_t number = std::min(cells_ - 1, static_cast<std::size_t>(place));
    Cell cell;
    cell.splines = cubic_b_splines(place - static_cast<double>(number));
    for (std::size_t a = 0; a < 4; ++a) cell.slots[a] = slot(number + a);
    return cell;
  }
  [[nodiscard]] double value(const std::vector<double>& coefficients, double r) const {
    const Cell cell = at(r);
    double value = 0;
    for (std::size_t a = 0; a < 4; ++a)
      if (cell.slots[a] < free_count()) value += cell.splines[a] * coefficients[cell.slots[a]];
    return value;
  }

 private:
  [[nodiscard]] std::size_t slot(std::size_t coefficient) const {
    if (coefficient == 0) return 1;  // folded onto coefficient 2
    return std::min(coefficient - 1, size() - 1);
  }
  std::size_t cells_;
  double knot_, inverse_knot_;
};

// Learns a profile. Pixels are collected by their distance from the bead (shared between the two nearest of fine
// steps), and where the reaches of two beads overlap by both their distances; splines are laid over the collected sums.
class ProfileLearner {
 public:
  ProfileLearner(const BeadProfile& current, const ProfileFit& how)
      : current_(current),
        how_(how),
        basis_(how.reach_px, how.knot_px),
        fine_(basis_.knot() / 16),
        pair_bins_of_knot_(std::clamp<std::size_t>(600 / basis_.cells(), 2, 6)),
        pair_bins_(basis_.cells() * pair_bins_of_knot_),
        pair_bins_per_px_(static_cast<double>(pair_bins_of_knot_) / basis_.knot()),
        pair_count_(pair_bins_ * pair_bins_, 0.0F),
        ring_low_(std::max(0.0, how.radius_px - ring_reach)),
        ring_high_(how.radius_px + ring_reach),
        ring_cells_(static_cast<std::size_t>(std::ceil((ring_high_ - ring_low_) / ring_cell))),
        ring_sum_(ring_cells_ + 1, 0.0),
        ring_weight_(ring_cells_ + 1, 0.0) {
    const auto longest = static_cast<std::size_t>(2 * how.reach_px) + 2;
    place1_.resize(longest);
    place2_.resize(longest);
    represent_current();
    pixel_count_.assign(left_over_.size() + 1, 0.0);
    residual_sum_.assign(left_over_.size() + 1, 0.0);
  }

  void collect(const JointFit& fit, const std::vector<ModelDisk>& beads) {
    for (const ModelDisk& bead : beads) collect_bead(fit, bead);
    const Nearby near(beads.size(), 2 * how_.reach_px,
                      [&](std::size_t i) { return std::pair(beads[i].x, beads[i].y); });
    near.pairs([&](std::size_t i, std::size_t j) {
      collect_pair(fit, beads[i], beads[j]);
      return false;
    });
  }

  BeadProfile learn() {
    matrix_.assign(basis_.size() * basis_.size(), 0.0);
    right_.assign(basis_.size(), 0.0);
    lay_over_pixels();
    lay_over_pairs();
    std::vector<double> change;
    const bool solved = solve(change);
    return tabulated(change, solved);
  }

 private:
  // Coefficients of the current profile: for a smooth curve, its value less a sixth of its second difference. What the
  // splines cannot follow of it stays in the data.
  void represent_current() {
    const double knot = basis_.knot();
    present_.resize(basis_.free_count());
    for (std::size_t i = 0; i < present_.size(); ++i) {
      const double r = static_cast<double>(i) * knot;  // coefficient i + 1 is centred at knot i
      const auto at = [&](double distance) { return value_at(current_.level, current_.step_px, std::abs(distance)); };
      present_[i] = at(r) - (at(r + knot) - 2 * at(r) + at(r - knot)) / 6;
    }
    left_over_.resize(static_cast<std::size_t>(std::ceil(how_.reach_px / fine_)) + 3);
    for (std::size_t i = 0; i < left_over_.size(); ++i) {
      const double r = static_cast<double>(i) * fine_;
      left_over_[i] = static_cast<float>(value_at(current_.level, current_.step_px, r) -
                                         (r < how_.reach_px ? basis_.value(present_, r) : 0));
    }
  }

  void collect_bead(const JointFit& fit, const ModelDisk& bead) {
    const double reach = how_.reach_px, inverse_fine = 1 / fine_;
    const int top = std::max(0, static_cast<int>(std::ceil(bead.y - reach)));
    const int bottom = std::min(fit.height() - 1, static_cast<int>(std::floor(bead.y + reach)));
    for (int row = first_row(top, how_.row_step); row <= bottom; row += how_.row_step) {
      const double dy = row - bead.y;
      const double half = std::sqrt(std::max(0.0, reach * reach - dy * dy));
      const int left = std::max(0, static_cast<int>(std::ceil(bead.x - half)));
      const int right_column = std::min(fit.width() - 1, static_cast<int>(std::floor(bead.x + half)));
      const int count = right_column - left + 1;
      if (count <= 0) continue;
      const float* line = fit.residual_row(row) + left;
      distances(left, count, bead.x, dy, inverse_fine, place1_);
      for (int k = 0; k < count; ++k) {
        const float place = place1_[static_cast<std::size_t>(k)];
        const auto cell = static_cast<std::size_t>(static_cast<int>(place));
        const double part = static_cast<double>(place - static_cast<float>(static_cast<int>(place)));
        if (unseen(line[k])) continue;
        const double e = static_cast<double>(line[k]);
        pixel_count_[cell] += 1 - part;
        pixel_count_[cell + 1] += part;
        residual_sum_[cell] += (1 - part) * e;
        residual_sum_[cell + 1] += part * e;
      }
      if (how_.fourth_harmonic)
        for (int k = 0; k < count; ++k)
          if (!unseen(line[k]))
            collect_fourth(left + k - bead.x, dy, static_cast<double>(place1_[static_cast<std::size_t>(k)]) * fine_,
                           static_cast<double>(line[k]));
    }
  }

  void collect_fourth(double dx, double dy, double r, double residual) {
    if (r <= ring_low_ || r >= ring_high_) return;
    const double squared = r * r;
    const double a2 = dx * dx, b2 = dy * dy;
    const double cosine = (a2 * a2 - 6 * a2 * b2 + b2 * b2) / (squared * squared);
    const double ring_place = (r - ring_low_) / ring_cell;
    const auto ring = static_cast<std::size_t>(ring_place);
    const double part = ring_place - static_cast<double>(ring);
    const double e = residual + value_at(left_over_, fine_, r);
    ring_sum_[ring] += (1 - part) * e * cosine;
    ring_weight_[ring] += (1 - part) * cosine * cosine;
    if (ring + 1 <= ring_cells_) {
      ring_sum_[ring + 1] += part * e * cosine;
      ring_weight_[ring + 1] += part * cosine * cosine;
    }
  }

  // Pairs whose reaches overlap: their splines meet in the same pixels.
  void collect_pair(const JointFit& fit, const ModelDisk& one, const ModelDisk& other) {
    const double reach_squared = how_.reach_px * how_.reach_px;
    const int top = std::max(0, static_cast<int>(std::ceil(other.y - how_.reach_px)));
    const int bottom = std::min(fit.height() - 1, static_cast<int>(std::floor(one.y + how_.reach_px)));
    for (int row = first_row(top, how_.row_step); row <= bottom; row += how_.row_step) {
      const double dy1 = row - one.y, dy2 = row - other.y;
      const double half1 = std::sqrt(std::max(0.0, reach_squared - dy1 * dy1));
      const double half2 = std::sqrt(std::max(0.0, reach_squared - dy2 * dy2));
      const int left = std::max(0, static_cast<int>(std::ceil(std::max(one.x - half1, other.x - half2))));
      const int right_column =
          std::min(fit.width() - 1, static_cast<int>(std::floor(std::min(one.x + half1, other.x + half2))));
      const int count = right_column - left + 1;
      if (count <= 0) continue;
      const float* line = fit.residual_row(row) + left;
      distances(left, count, one.x, dy1, pair_bins_per_px_, place1_);
      distances(left, count, other.x, dy2, pair_bins_per_px_, place2_);
      for (int k = 0; k < count; ++k) {
        const auto bin1 =
            std::min(pair_bins_ - 1, static_cast<std::size_t>(static_cast<int>(place1_[static_cast<std::size_t>(k)])));
        const auto bin2 =
            std::min(pair_bins_ - 1, static_cast<std::size_t>(static_cast<int>(place2_[static_cast<std::size_t>(k)])));
        pair_count_[bin1 * pair_bins_ + bin2] += unseen(line[k]) ? 0.0F : 1.0F;
      }
    }
  }

  void lay_over_pixels() {
    for (std::size_t i = 0; i < pixel_count_.size(); ++i) {
      const double r = static_cast<double>(i) * fine_;
      if (pixel_count_[i] == 0 || r >= how_.reach_px) continue;
      const SplineBasis::Cell cell = basis_.at(r);
      const double e = residual_sum_[i] + pixel_count_[i] * value_at(left_over_, fine_, r);
      for (std::size_t a = 0; a < 4; ++a) {
        right_[cell.slots[a]] += cell.splines[a] * e;
        for (std::size_t b = 0; b < 4; ++b)
          matrix_[cell.slots[a] * basis_.size() + cell.slots[b]] += pixel_count_[i] * cell.splines[a] * cell.splines[b];
      }
    }
  }

  void lay_over_pairs() {
    std::vector<SplineBasis::Cell> cells(pair_bins_);
    for (std::size_t i = 0; i < pair_bins_; ++i)
      cells[i] = basis_.at((static_cast<double>(i) + 0.5) / pair_bins_per_px_);
    for (std::size_t i = 0; i < pair_bins_; ++i)
      for (std::size_t j = 0; j < pair_bins_; ++j) {
        const double count = static_cast<double>(pair_count_[i * pair_bins_ + j]);
        if (count == 0) continue;
        const SplineBasis::Cell &one = cells[i], &other = cells[j];
        for (std::size_t a = 0; a < 4; ++a)
          for (std::size_t b = 0; b < 4; ++b) {
            const std::size_t p = one.slots[a], q = other.slots[b];
            const double product = count * one.splines[a] * other.splines[b];
            matrix_[p * basis_.size() + q] += product;
            matrix_[q * basis_.size() + p] += product;
          }
      }
  }

  // The coefficients. False when the system cannot be solved.
  bool solve(std::vector<double>& coefficients) const {
    const std::size_t count = basis_.free_count();
    double trace = 0;
    for (std::size_t i = 0; i < count; ++i) trace += matrix_[i * basis_.size() + i];
    const double mean_weight = trace / static_cast<double>(count), smoothness = smoothness_share * mean_weight;
    std::vector<double> system(count * count);
    coefficients.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      coefficients[i] = right_[i];
      for (std::size_t j = 0; j < count; ++j) system[i * count + j] = matrix_[i * basis_.size() + j];
      system[i * count + i] += ridge_share * mean_weight;
    }
    for (std::size_t i = 0; i + 1 < count; ++i) {
      const std::array<double, 3> difference = {1, -2, 1};
      double bend = 0;
      for (std::size_t a = 0; a < 3; ++a) bend += i + a < count ? difference[a] * present_[i + a] : 0;
      for (std::size_t a = 0; a < 3; ++a) {
        if (i + a >= count) continue;
        coefficients[i + a] -= smoothness * difference[a] * bend;
        for (std::size_t b = 0; b < 3; ++b)
          if (i + b < count) system[(i + a) * count + i + b] += smoothness * difference[a] * difference[b];
      }
    }
    const bool solved = solve_symmetric(system, coefficients, count);
    for (std::size_t i = 0; i < count; ++i) coefficients[i] += present_[i];
    return solved;
  }

  [[nodiscard]] double fourth_at(double r) const {
    const double harmonic = value_at(current_.fourth_harmonic, current_.step_px, r);
    if (!how_.fourth_harmonic || r <= ring_low_ || r >= ring_high_) return harmonic;
    const double ring_place = (r - ring_low_) / ring_cell;
    const auto ring = std::min(ring_cells_ - 1, static_cast<std::size_t>(ring_place));
    const double part = ring_place - static_cast<double>(ring);
    const auto at = [&](std::size_t k) {
      return ring_weight_[k] > least_ring_weight ? ring_sum_[k] / ring_weight_[k] : 0.0;
    };
    return harmonic + ((1 - part) * at(ring) + part * at(ring + 1));
  }

  [[nodiscard]] BeadProfile tabulated(const std::vector<double>& coefficients, bool solved) const {
    BeadProfile learned;
    learned.asymmetry = current_.asymmetry;
    learned.step_px = std::min(current_.step_px, basis_.knot() / 8);
    const std::size_t count = static_cast<std::size_t>(std::ceil(how_.reach_px / learned.step_px)) + 1;
    learned.level.resize(count);
    learned.fourth_harmonic.assign(count, 0.0F);
    for (std::size_t i = 0; i < count; ++i) {
      const double r = static_cast<double>(i) * learned.step_px;
      double value = 0;
      if (!solved)
        value = value_at(current_.level, current_.step_px, r);
      else if (r < how_.reach_px)
        value = basis_.value(coefficients, r);
      learned.level[i] = static_cast<float>(value);
      learned.fourth_harmonic[i] = static_cast<float>(fourth_at(r));
    }
    learned.level.back() = 0;
    return learned;
  }

  const BeadProfile& current_;
  const ProfileFit how_;
  const SplineBasis basis_;
  const double fine_;  // px
  std::vector<double> present_;
  std::vector<float> left_over_;
  std::vector<double> pixel_count_, residual_sum_;  // by distance, in steps of fine_
  const std::size_t pair_bins_of_knot_, pair_bins_;
  const double pair_bins_per_px_;
  std::vector<float> pair_count_;  // by both distances
  const double ring_low_, ring_high_;
  const std::size_t ring_cells_;
  std::vector<double> ring_sum_, ring_weight_;
  std::vector<float> place1_, place2_;
  std::vector<double> matrix_, right_;
};

}  // namespace

BeadProfile learn_profile(const std::vector<const JointFit*>& fits,
                          const std::vector<const std::vector<ModelDisk>*>& disks, const BeadProfile& current,
                          const ProfileFit& how) {
  ProfileLearner learner(current, how);
  for (std::size_t f = 0; f < fits.size(); ++f) learner.collect(*fits[f], *disks[f]);
  return learner.learn();
}

}  // namespace shakebed::ingest
