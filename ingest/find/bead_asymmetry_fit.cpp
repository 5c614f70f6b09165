// implements: ingest/find/bead_profile.hpp
// Beads lit from one side: what their residuals have in common, and the circle on which such a bead ends.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "ingest/find/bead_profile.hpp"
#include "ingest/find/blurred_disk.hpp"
#include "ingest/find/profile_samples.hpp"
#include "ingest/frames/smooth_field.hpp"

namespace shakebed::ingest {

namespace {

constexpr std::size_t orders = BeadAsymmetry::orders;
constexpr double ring_px = 0.4;  // distance of the rings on which harmonics are learned
// Contrast units: a residual beyond that is dirt or something in front.
constexpr float least_foreign_residual = 1;
// Pixels that two beads share count for both, so a little less than all of a residual is taken over.
constexpr double share_taken_over = 0.7;
// Contrast units: rims that are no circles (pixels wider than high) differ along and across, but not from side to side.
constexpr double least_one_sided = 0.015;

// Sums of residuals times harmonics of the direction, on rings around the beads.
class HarmonicSums {
 public:
  explicit HarmonicSums(double reach)
      : reach_(reach),
        rings_(static_cast<std::size_t>(std::ceil(reach / ring_px)) + 1),
        sums_(rings_),
        weight_(rings_, 0.0),
        row_(static_cast<std::size_t>(2 * reach) + 2) {
    for (Ring& ring : sums_) ring.fill(0);
  }
  [[nodiscard]] std::size_t rings() const { return rings_; }

  void add(const JointFit& fit, const ModelDisk& bead, int row_step) {
    const int top = std::max(0, static_cast<int>(std::ceil(bead.y - reach_)));
    const int bottom = std::min(fit.height() - 1, static_cast<int>(std::floor(bead.y + reach_)));
    for (int row = first_row(top, row_step); row <= bottom; row += row_step) {
      const double dy = row - bead.y, half = std::sqrt(std::max(0.0, reach_ * reach_ - dy * dy));
      const int left = std::max(0, static_cast<int>(std::ceil(bead.x - half)));
      const int right = std::min(fit.width() - 1, static_cast<int>(std::floor(bead.x + half)));
      add_row(fit.residual_row(row), left, right, bead.x, dy);
    }
  }

  // The mean harmonic on a ring, if any pixel lies there, and its variance in units of the noise's.
  struct Mean {
    double cosine = 0, sine = 0, variance = 0;
  };
  [[nodiscard]] std::optional<Mean> mean(std::size_t ring, std::size_t order) const {
    const double weight = weight_[ring];
    if (!(weight > 0)) return std::nullopt;
    return Mean{share_taken_over * sums_[ring][order] / weight, share_taken_over * sums_[ring][orders + order] / weight,
                weight};
  }

 private:
  // Where a pixel lies: its distance, in px and in rings, and its direction.
  struct Row {
    explicit Row(std::size_t longest) : r(longest), place(longest), cosine(longest), sine(longest) {}
    std::vector<double> r, place, cosine, sine;
  };

  // Roots and quotients of all pixels first, many at once.
  void add_row(const float* line, int left, int right, double x, double dy) {
    double *r = row_.r.data(), *place = row_.place.data(), *cosine = row_.cosine.data(), *sine = row_.sine.data();
    const int count = right - left + 1;
    for (int k = 0; k < count; ++k) {
      const double dx = left + k - x;
      r[k] = std::sqrt(dx * dx + dy * dy);
      place[k] = r[k] / ring_px, cosine[k] = dx / r[k], sine[k] = dy / r[k];
    }
    for (int k = 0; k < count; ++k)
      if (std::abs(line[left + k]) <= least_foreign_residual && r[k] >= 1e-6)
        add_pixel(place[k], cosine[k], sine[k], static_cast<double>(line[left + k]));
  }

  void add_pixel(double place, double cosine, double sine, double e) {
    const auto k = std::min(rings_ - 2, static_cast<std::size_t>(place));
    const double outer = place - static_cast<double>(k);
    Ring harmonic;
    harmonic[0] = cosine, harmonic[orders] = sine;
    for (std::size_t m = 1; m < orders; ++m) {
      harmonic[m] = harmonic[m - 1] * cosine - harmonic[orders + m - 1] * sine;
      harmonic[orders + m] = harmonic[orders + m - 1] * cosine + harmonic[m - 1] * sine;
    }
    const double to_inner = (1 - outer) * e, to_outer = outer * e;
    Ring &inner_ring = sums_[k], &outer_ring = sums_[k + 1];
    for (std::size_t m = 0; m < harmonic.size(); ++m) {
      inner_ring[m] += to_inner * harmonic[m];
      outer_ring[m] += to_outer * harmonic[m];
    }
    weight_[k] += 0.5 * (1 - outer);
    weight_[k + 1] += 0.5 * outer;
  }

  // Of each order the sum with the cosine, then those with the sine.
  using Ring = std::array<double, 2 * orders>;

  double reach_;
  std::size_t rings_;
  std::vector<Ring> sums_;
  std::vector<double> weight_;
  Row row_;
};

}  // namespace

std::shared_ptr<const BeadAsymmetry> learn_asymmetry(const std::vector<const JointFit*>& fits,
                                                     const std::vector<const std::vector<ModelDisk>*>& disks,
                                                     const BeadProfile& current, const AsymmetryFit& how) {
  HarmonicSums sums(current.reach_px());
  for (std::size_t f = 0; f < fits.size(); ++f)
    for (const ModelDisk& bead : *disks[f]) sums.add(*fits[f], bead, how.row_step);
  BeadAsymmetry::Harmonics harmonics;
  harmonics.step_px = ring_px;
  double chance = 0, area = 0;  // what noise alone would give
  for (std::size_t m = 0; m < orders; ++m) {
    auto &cosine = harmonics.cosine[m], &sine = harmonics.sine[m];
    cosine.assign(sums.rings() + 1, 0.0);
    sine.assign(sums.rings() + 1, 0.0);
    for (std::size_t k = 0; k < sums.rings(); ++k) {
      const double r = static_cast<double>(k) * ring_px;
      // A shape of m periods a turn is nothing near the middle.
      const double allowed = std::clamp(2 * r / static_cast<double>(m + 1) - 0.5, 0.0, 1.0);
      double c = 0, s = 0;
      if (current.asymmetry) {
        c = value_at(current.asymmetry->harmonics().cosine[m], ring_px, r);
        s = value_at(current.asymmetry->harmonics().sine[m], ring_px, r);
      }
      if (const auto mean = sums.mean(k, m)) {
        c += mean->cosine;
        s += mean->sine;
        if (r <= how.radius_px)
          chance += r * share_taken_over * share_taken_over * how.noise * how.noise / mean->variance;
      }
      cosine[k] = allowed * c;
      sine[k] = allowed * s;
      if (m == 0 && r <= how.radius_px) area += r;
    }
  }
  auto learned = std::make_shared<const BeadAsymmetry>(std::move(harmonics));
  if (current.asymmetry) return learned;
  const double one_sided = learned->one_sidedness(how.radius_px);
  const double least = least_one_sided * least_one_sided + 4 * chance / std::max(1e-9, area);
  return one_sided * one_sided > least ? learned : nullptr;
}

BeadProfile recentred(const BeadProfile& profile, double by_x, double by_y) {
  constexpr std::size_t directions = 48;
  std::array<double, directions> cosine, sine;
  for (std::size_t d = 0; d < directions; ++d) {
    cosine[d] = std::cos(2 * std::numbers::pi * static_cast<double>(d) / directions);
    sine[d] = std::sin(2 * std::numbers::pi * static_cast<double>(d) / directions);
  }
  const auto level_at = [&](double r, std::size_t d) {
    const double x = r * cosine[d] + by_x, y = r * sine[d] + by_y;
    return value_at(profile.level, profile.step_px, std::sqrt(x * x + y * y)) + profile.asymmetry->at(x, y);
  };
  BeadProfile moved = profile;
  for (std::size_t k = 0; k + 1 < profile.level.size(); ++k) {
    double sum = 0;
    for (std::size_t d = 0; d < directions; ++d) sum += level_at(static_cast<double>(k) * profile.step_px, d);
    moved.level[k] = static_cast<float>(sum / directions);
  }
  BeadAsymmetry::Harmonics harmonics = profile.asymmetry->harmonics();
  for (std::size_t k = 0; k < harmonics.cosine.front().size(); ++k) {
    const double r = static_cast<double>(k) * harmonics.step_px;
    std::array<double, directions> level;
    for (std::size_t d = 0; d < directions; ++d) level[d] = r < profile.reach_px() ? level_at(r, d) : 0.0;
    for (std::size_t m = 0; m < BeadAsymmetry::orders; ++m) {
      double c = 0, s = 0;
      for (std::size_t d = 0; d < directions; ++d) {
        const std::size_t turned = (m + 1) * d % directions;
        c += level[d] * cosine[turned];
        s += level[d] * sine[turned];
      }
      harmonics.cosine[m][k] = k ? 2 * c / directions : 0;
      harmonics.sine[m][k] = k ? 2 * s / directions : 0;
    }
  }
  moved.asymmetry = std::make_shared<const BeadAsymmetry>(std::move(harmonics));
  return moved;
}

namespace {

// The edge along one radius: a sum of the shapes of a disk of `radius_px`, moved along the radius.
class EdgeAlongRadius {
 public:
  EdgeAlongRadius(const BeadProfile& profile, double radius_px, double edge_px)
      : profile_(profile),
        edge_(edge_px),
        most_(std::min(0.3 * radius_px, 3.0 + edge_px)),
        low_(0.5 * radius_px),
        table_(static_cast<std::size_t>((profile.reach_px() - low_ + 2 * most_) / fine) + 2) {
    for (std::size_t k = 0; k < table_.size(); ++k) {
      const BlurredShapes one =
          blurred_disk_shapes(radius_px, edge_px, std::max(0.0, low_ - most_ + static_cast<double>(k) * fine));
      table_[k] = {one.flat, one.sphere, one.cone};
    }
  }

  // How far out the edge lies, and how sharply that is known (the bend of the sum of squares).
  struct Shift {
    double px = 0, bend = 0;
  };
  std::optional<Shift> find(double cosine, double sine) {
    sample(cosine, sine);
    // Coarse, then by parabolas.
    double best = 0, least = 1e30, step = std::max(0.1, 0.4 * edge_);
    for (double shift = -most_; shift <= most_; shift += step)
      if (const double here = misfit(shift); here < least) least = here, best = shift;
    double bend = 0;
    for (int round = 0; round < 4; ++round) {
      const double before = misfit(best - step), here = misfit(best), after = misfit(best + step);
      bend = (before - 2 * here + after) / (step * step);
      if (bend > 0) best += std::clamp(0.5 * step * (before - after) / (before - 2 * here + after), -step, step);
      step = std::max(0.02, 0.5 * step);
    }
    if (!(bend > 0) || std::abs(best) > most_) return std::nullopt;
    return Shift{best, bend};
  }

 private:
  static constexpr std::size_t shapes = 3;
  static constexpr double fine = 0.05;  // px

  void sample(double cosine, double sine) {
    distance_.clear();
    level_.clear();
    const double spacing = std::max(0.1, edge_ / 4);
    for (double r = low_; r < profile_.reach_px(); r += spacing) {
      distance_.push_back(r);
      level_.push_back(value_at(profile_.level, profile_.step_px, r) + profile_.asymmetry->at(r * cosine, r * sine));
    }
  }

  [[nodiscard]] double misfit(double shift) const {
    std::vector<double> normal(shapes * shapes, 0.0), value(shapes, 0.0);
    double square = 0;
    for (std::size_t i = 0; i < distance_.size(); ++i) {
      const double place = (distance_[i] - shift - low_ + most_) / fine;
      const auto cell = std::min(table_.size() - 2, static_cast<std::size_t>(std::max(0.0, place)));
      const double part = std::clamp(place - static_cast<double>(cell), 0.0, 1.0);
      std::array<double, shapes> shape{};
      for (std::size_t a = 0; a < shapes; ++a) shape[a] = (1 - part) * table_[cell][a] + part * table_[cell + 1][a];
      square += level_[i] * level_[i];
      for (std::size_t a = 0; a < shapes; ++a) {
        value[a] += shape[a] * level_[i];
        for (std::size_t b = 0; b < shapes; ++b) normal[a * shapes + b] += shape[a] * shape[b];
      }
    }
    const std::vector<double> wanted = value;
    for (std::size_t a = 0; a < shapes; ++a) normal[a * shapes + a] += 1e-4 * normal[0];
    if (!solve_symmetric(normal, value, shapes)) return square;
    for (std::size_t a = 0; a < shapes; ++a) square -= value[a] * wanted[a];
    return square;
  }

  const BeadProfile& profile_;
  double edge_, most_, low_;  // px; by how much the shapes may be moved, where they begin
  std::vector<std::array<double, shapes>> table_;
  std::vector<double> distance_, level_;
};

}  // namespace

Outline outline_of(const BeadProfile& profile, double radius_px, double edge_px) {
  constexpr std::size_t directions = 32;
  EdgeAlongRadius edge(profile, radius_px, edge_px);
  std::vector<double> matrix(9, 0.0), right(3, 0.0);
  double all_weight = 0;
  for (std::size_t d = 0; d < directions; ++d) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(d) / directions;
    const double cosine = std::cos(angle), sine = std::sin(angle);
    const auto shift = edge.find(cosine, sine);
    if (!shift) continue;
    const std::array<double, 3> row = {1, cosine, sine};
    all_weight += shift->bend;
    for (std::size_t a = 0; a < 3; ++a) {
      right[a] += shift->bend * row[a] * shift->px;
      for (std::size_t b = 0; b < 3; ++b) matrix[a * 3 + b] += shift->bend * row[a] * row[b];
    }
  }
  Outline outline;
  for (std::size_t a = 0; a < 3; ++a) matrix[a * 4] += 1e-3 * all_weight;  // a rim seen on one side only
  if (!(all_weight > 0) || !solve_symmetric(matrix, right, 3)) return outline;
  outline.good = true;
  outline.radius_px = radius_px + right[0];
  outline.x_px = right[1];
  outline.y_px = right[2];
  return outline;
}

}  // namespace shakebed::ingest
