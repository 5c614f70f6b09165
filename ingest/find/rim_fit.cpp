// implements: ingest/find/bead_profile.hpp
// The radius that a learned profile has its edge at, whatever the bead's shading and the camera's tone curve.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "ingest/find/bead_profile.hpp"
#include "ingest/find/blurred_disk.hpp"
#include "ingest/find/profile_samples.hpp"
#include "ingest/find/rim_trials.hpp"
#include "ingest/frames/smooth_field.hpp"

namespace shakebed::ingest {

namespace {

// flat, sphere, parabola, cone, quartic: see BlurredShapes.
using Shapes = std::array<double, 5>;
// Which of them take part in a fit, and last the level outside.
constexpr std::size_t rim_terms = 6;
using RimTerms = std::array<bool, rim_terms>;

Shapes shapes_of(double radius, double blur, double distance) {
  const BlurredShapes one = blurred_disk_shapes(radius, blur, distance);
  return {one.flat, one.sphere, one.parabola, one.cone, one.quartic};
}

// The shapes at low, low + step ... of a grid of a tenth of the blur. They are computed at every fourth place, cubics
// in between: off by at most 1e-4.
struct ShapeGrid {
  double low = 0, step = 0;
  std::vector<Shapes> at;
};
ShapeGrid shapes_between(double low, double high, double radius, double blur) {
  constexpr int finer = 4;
  // Weights of the four places around, two on either side.
  constexpr std::array<std::array<double, 4>, finer> cubic = {{{0, 1, 0, 0},
                                                               {-0.0546875, 0.8203125, 0.2734375, -0.0390625},
                                                               {-0.0625, 0.5625, 0.5625, -0.0625},
                                                               {-0.0390625, 0.2734375, 0.8203125, -0.0546875}}};
  const auto intervals = static_cast<std::size_t>(std::ceil((high - low) / (0.1 * finer * blur))) + 1;
  const double apart = (high - low) / static_cast<double>(intervals);
  std::vector<Shapes> computed(intervals + 3);
  for (std::size_t k = 0; k < computed.size(); ++k)
    computed[k] = shapes_of(radius, blur, std::abs(low + (static_cast<double>(k) - 1) * apart));
  ShapeGrid grid{low, apart / finer, std::vector<Shapes>(intervals * finer + 1)};
  for (std::size_t k = 0; k < grid.at.size(); ++k) {
    const Shapes* around = &computed[std::min(k / finer, intervals - 1)];
    const auto& weights = cubic[k % finer];
    for (std::size_t shape = 0; shape < grid.at[k].size(); ++shape)
      for (std::size_t n = 0; n < weights.size(); ++n) grid.at[k][shape] += weights[n] * around[n][shape];
  }
  grid.at.back() = computed[intervals + 1];
  return grid;
}

// The shapes of a bead, blurred, at each of the distances given. Where the optical blur is smaller than the
// pixel, the pixel's own square window is laid over it (averaged over directions) instead of being counted as a
// Gaussian, for those in use alone: it takes most of the time.
std::vector<Shapes> shapes_at(double radius, double edge, const std::vector<double>& distance, const RimTerms& use) {
  std::vector<Shapes> shapes(distance.size());
  constexpr double pixel_variance = 1.0 / 12, gaussian_enough = 0.7;
  if (edge > gaussian_enough) {
    for (std::size_t i = 0; i < distance.size(); ++i) shapes[i] = shapes_of(radius, edge, distance[i]);
    return shapes;
  }
  const double optical = std::sqrt(std::max(0.08 * 0.08, edge * edge - pixel_variance));
  const double low = std::max(0.0, distance.front() - 0.8), high = distance.back() + 0.8;
  const auto [from, step, table] = shapes_between(low, high, radius, optical);
  const double last = static_cast<double>(table.size()) - 1.001;
  // Off by at most 3e-5 from an optical blur of 0.3 px on; two directions do as well as more.
  static const GaussLegendre few = gauss_legendre(4), many = gauss_legendre(6);
  const GaussLegendre& rule = optical < 0.3 ? many : few;
  constexpr int directions = 2;
  std::array<std::size_t, std::tuple_size_v<Shapes>> which{};
  std::size_t used = 0;
  for (std::size_t k = 0; k < which.size(); ++k)
    if (use[k]) which[used++] = k;
  for (std::size_t i = 0; i < distance.size(); ++i) {
    Shapes sum{};
    for (int d = 0; d < directions; ++d) {
      const double angle = (d + 0.5) / directions * 0.25 * 3.14159265358979;
      const double x = distance[i] * std::cos(angle), y = distance[i] * std::sin(angle);
      for (std::size_t a = 0; a < rule.node.size(); ++a)
        for (std::size_t b = 0; b < rule.node.size(); ++b) {
          const double dx = x + rule.node[a] - 0.5, dy = y + rule.node[b] - 0.5, r = std::sqrt(dx * dx + dy * dy);
          const double place = std::clamp((r - from) / step, 0.0, last);
          const auto cell = static_cast<std::size_t>(place);
          const double part = place - static_cast<double>(cell);
          const double weight = rule.weight[a] * rule.weight[b] / directions;
          for (std::size_t n = 0; n < used; ++n) {
            const std::size_t k = which[n];
            sum[k] += weight * ((1 - part) * table[cell][k] + part * table[cell + 1][k]);
          }
        }
    }
    shapes[i] = sum;
  }
  return shapes;
}

// Radius and edge by damped least squares (Levenberg and Marquardt); `use` says which of the shapes, and the level
// outside, take part.
class RimLeastSquares {
 public:
  RimLeastSquares(const RimData& data, RimTerms use) : data_(data), use_(use) {}

  RimFit fit(double radius_guess, double edge_guess) {
    RimFit best;
    double radius = radius_guess, edge = std::max(0.3, edge_guess);
    std::vector<double> residual, shifted;
    double misfit = misfit_of(radius, edge, residual);
    double misfit_by_area = area_misfit_;
    double damping = 1e-3;
    constexpr int most_rounds = 30, most_attempts = 8;
    constexpr double negligible_gain = 1e-6;  // of the sum of squares: hundredths of the standard errors
    for (int round = 0; round < most_rounds; ++round) {
      const auto normal = normal_of(radius, edge, residual);
      if (!normal) return best;
      bool improved = false, settled = false;
      const double information = normal->ee > 0 ? normal->rr - normal->re * normal->re / normal->ee : 0;
      best.std_error_px = information > 0 ? 1 / std::sqrt(information) : 0;
      double moved = 0;
      for (int attempt = 0; attempt < most_attempts && !improved; ++attempt) {
        const double a = normal->rr * (1 + damping), c = normal->ee * (1 + damping);
        const double determinant = a * c - normal->re * normal->re;
        if (!(determinant > 0)) break;
        const double step_radius = std::clamp((c * normal->br - normal->re * normal->be) / determinant, -0.5, 0.5);
        const double step_edge = std::clamp((a * normal->be - normal->re * normal->br) / determinant, -0.3, 0.3);
        const double new_radius = std::max(0.5, radius + step_radius), new_edge = std::max(0.295, edge + step_edge);
        const double new_misfit = misfit_of(new_radius, new_edge, shifted);
        if (new_misfit > misfit || std::isnan(new_misfit)) {
          damping = std::max(1e-6, damping * 10);
          continue;
        }
        moved = std::abs(new_radius - radius) + std::abs(new_edge - edge);
        settled = misfit - new_misfit < negligible_gain * misfit;
        radius = new_radius;
        edge = new_edge;
        misfit = new_misfit;
        misfit_by_area = area_misfit_;
        residual = shifted;
        damping = std::max(1e-9, damping * 0.2);
        improved = true;
      }
      if (!improved || settled || moved < 3e-5) break;
      // What is fitted is no rim near the guess.
      if (std::abs(radius - radius_guess) > 0.25 * radius_guess + 1 || edge > 0.4 * radius_guess + 1) return best;
    }
    best.misfit = misfit_by_area;
    best.squares = misfit;
    best.good = std::isfinite(radius) && best.misfit < 0.1;
    best.radius_px = radius;
    best.edge_px = edge;
    return best;
  }

  // Of the last trial: the level outside.
  [[nodiscard]] double offset() const { return offset_; }

 private:
  // Normal equations of radius (r) and edge (e), by differences.
  struct Normal {
    double rr = 0, re = 0, ee = 0, br = 0, be = 0;
  };
  std::optional<Normal> normal_of(double radius, double edge, const std::vector<double>& residual) {
    constexpr double delta = 1e-3;
    std::vector<double> slope_radius, slope_edge;
    misfit_of(radius + delta, edge, slope_radius);
    misfit_of(radius, edge + delta, slope_edge);
    if (slope_radius.size() != residual.size() || slope_edge.size() != residual.size()) return std::nullopt;
    Normal normal;
    for (std::size_t i = 0; i < residual.size(); ++i) {
      const double by_radius = (slope_radius[i] - residual[i]) / delta, by_edge = (slope_edge[i] - residual[i]) / delta;
      normal.rr += by_radius * by_radius;
      normal.re += by_radius * by_edge;
      normal.ee += by_edge * by_edge;
      normal.br -= by_radius * residual[i];
      normal.be -= by_edge * residual[i];
    }
    return normal;
  }

  // Weighted sum of squares with the best sum of shapes.
  double misfit_of(double radius, double edge, std::vector<double>& residual) {
    const std::vector<double>&distance = data_.distance, &level = data_.level;
    const auto rows = shapes_at(radius, edge, distance, use_);
    // A shape that takes no part is 0 everywhere.
    const auto shape = [&](std::size_t i, std::size_t a) { return use_[a] ? (a < 5 ? rows[i][a] : 1.0) : 0.0; };
    std::vector<double> matrix(rim_terms * rim_terms, 0.0), right(rim_terms, 0.0);
    for (std::size_t i = 0; i < distance.size(); ++i) {
      std::array<double, rim_terms> at;
      for (std::size_t a = 0; a < rim_terms; ++a) at[a] = shape(i, a);
      for (std::size_t a = 0; a < rim_terms; ++a) {
        const double weighted = data_.weight[i] * at[a];
        right[a] += weighted * level[i];
        for (std::size_t b = 0; b <= a; ++b) matrix[a * rim_terms + b] += weighted * at[b];
      }
    }
    for (std::size_t a = 0; a < rim_terms; ++a)
      for (std::size_t b = a + 1; b < rim_terms; ++b) matrix[a * rim_terms + b] = matrix[b * rim_terms + a];
    const double ridge = 1e-9 * matrix[0];
    for (std::size_t a = 0; a < rim_terms; ++a) matrix[a * (rim_terms + 1)] += use_[a] ? ridge : 1.0;
    if (use_[5]) matrix.back() += data_.offset_weight;
    if (!solve_symmetric(matrix, right, rim_terms)) return 1e30;
    offset_ = right[5];
    residual.resize(distance.size());
    double sum = data_.offset_weight * right[5] * right[5], areas = 0;
    area_misfit_ = 0;
    for (std::size_t i = 0; i < distance.size(); ++i) {
      double model = 0;
      for (std::size_t a = 0; a < rim_terms; ++a) model += right[a] * shape(i, a);
      const double gap = level[i] - model;
      residual[i] = std::sqrt(data_.weight[i]) * gap;
      sum += residual[i] * residual[i];
      areas += distance[i];
      area_misfit_ += distance[i] * gap * gap;
    }
    area_misfit_ = std::sqrt(area_misfit_ / areas);
    return sum;
  }

  const RimData& data_;
  const RimTerms use_;
  double offset_ = 0, area_misfit_ = 0;
};

RimFit fit_rim_with(const RimData& data, double radius_guess, double edge_guess, RimTerms use,
                    double* offset = nullptr) {
  RimLeastSquares squares(data, use);
  const RimFit fit = squares.fit(radius_guess, edge_guess);
  if (offset) *offset = squares.offset();
  return fit;
}

void try_shadings(const RimData& levels, double exponent, const RimConditions& conditions,
                  std::vector<RimTrial>& trials) {
  constexpr std::array<RimTerms, 8> families = {
      RimTerms{true, false, false, false, false, true}, RimTerms{true, true, false, false, false, true},
      RimTerms{true, false, true, false, false, true},  RimTerms{true, false, false, true, false, true},
      RimTerms{true, false, false, false, true, true},  RimTerms{true, true, true, false, false, true},
      RimTerms{true, false, true, true, false, true},   RimTerms{true, false, true, false, true, true}};
  for (const RimTerms& family : families) {
    // With too free a shading, a small change of the rim's shape looks like a tone curve.
    const bool pair = family[1] + family[2] + family[3] + family[4] > 1;
    if (pair && exponent != 1) continue;
    const RimFit rim = fit_rim_with(levels, conditions.radius_px, conditions.edge_px, family);
    if (!rim.good) continue;
    const auto terms = static_cast<double>(std::count(family.begin(), family.end(), true));
    trials.push_back({rim, terms, exponent, family[2] || family[3] || family[4]});
  }
}

// A flat disk on an even background, contrast and background free, by a search over radius and edge.
RimFit fit_flat_rim(const BeadProfile& profile, double radius_guess_px, double edge_guess_px) {
  const double low = std::max(0.0, radius_guess_px - 4.5 * edge_guess_px);
  const double high = std::min(profile.reach_px(), radius_guess_px + 2.5 * edge_guess_px);
  std::vector<double> distance, level;
  const double spacing = std::max(profile.step_px, (high - low) / 40);
  for (double r = low; r < high; r += spacing) {
    distance.push_back(r);
    level.push_back(value_at(profile.level, profile.step_px, r));
  }
  const auto misfit_of = [&](double radius, double edge) {
    double ff = 0, f = 0, fp = 0, p = 0, pp = 0;
    const double n = static_cast<double>(distance.size());
    for (std::size_t i = 0; i < distance.size(); ++i) {
      const double shape = blurred_disk_shapes(radius, edge, distance[i]).flat;
      ff += shape * shape;
      f += shape;
      fp += shape * level[i];
      p += level[i];
      pp += level[i] * level[i];
    }
    const double determinant = ff * n - f * f;
    if (!(determinant > 0)) return 1.0;
    const double contrast = (n * fp - f * p) / determinant, offset = (ff * p - f * fp) / determinant;
    return std::sqrt(std::max(0.0, (pp - contrast * fp - offset * p) / n));
  };
  RimFit best;
  best.misfit = 1;
  if (distance.size() < 8) return best;
  double radius = radius_guess_px, edge = edge_guess_px, step = 0.5 * edge_guess_px;
  best.misfit = misfit_of(radius, edge);
  while (step > 1e-3) {  // pattern search: two unknowns, a smooth bowl
    bool moved = false;
    for (const auto& [by_radius, by_edge] : {std::pair{1.0, 0.0}, {-1.0, 0.0}, {0.0, 0.5}, {0.0, -0.5}}) {
      const double new_radius = radius + by_radius * step, new_edge = edge + by_edge * step;
      if (new_radius < 0.5 || new_edge < 0.2) continue;
      const double misfit = misfit_of(new_radius, new_edge);
      if (misfit < best.misfit) {
        best.misfit = misfit;
        radius = new_radius;
        edge = new_edge;
        moved = true;
      }
    }
    if (!moved) step *= 0.5;
  }
  best.good = best.misfit < 0.1;
  best.radius_px = radius;
  best.edge_px = edge;
  return best;
}

}  // namespace

RimFit fit_rim(const BeadProfile& profile, double radius_guess_px, double edge_guess_px) {
  RimData data = rim_data(profile, radius_guess_px, edge_guess_px);
  if (data.distance.size() < 6) return {};
  // The simplest shading that will do: flat, then a sphere's, then both with a parabola.
  RimTerms chosen = {true, false, false, false, false, false};
  RimFit best = fit_rim_with(data, radius_guess_px, edge_guess_px, chosen);
  for (const RimTerms& use :
       {RimTerms{true, true, false, false, false, false}, RimTerms{true, true, true, false, false, false}}) {
    // Both shapes together can imitate another radius: they are asked only when nothing simpler comes near.
    const double negligible_misfit = use[2] ? 0.008 : 0.0015, clearly_better = use[2] ? 0.5 : 0.7;
    if (best.good && best.misfit < negligible_misfit) break;
    const RimFit richer = fit_rim_with(data, radius_guess_px, edge_guess_px, use);
    if (richer.good && (!best.good || richer.misfit < clearly_better * best.misfit)) {
      best = richer;
      chosen = use;
    }
  }
  // In a crystal hardly any background is left to determine the level outside. A profile that ends a few thousandths
  // too low looks like a larger bead. An offset beyond that has another cause: light between the beads, a halo.
  constexpr double largest_offset = 0.006;
  if (best.good) {
    chosen[5] = true;
    double offset = 0;
    const RimFit levelled = fit_rim_with(data, best.radius_px, best.edge_px, chosen, &offset);
    if (levelled.good && std::abs(offset) < largest_offset && levelled.misfit < best.misfit) best = levelled;
  }
  return best;
}

RimChoice choose_rim(const BeadProfile& profile, const RimConditions& conditions) {
  RimData data = rim_data(profile, conditions.radius_px, conditions.edge_px);
  const auto inner =
      std::lower_bound(data.distance.begin(), data.distance.end(), conditions.from_px) - data.distance.begin();
  for (std::vector<double>* values : {&data.distance, &data.level, &data.weight})
    values->erase(values->begin(), values->begin() + inner);
  constexpr std::size_t fewest_points = 10;
  if (data.distance.size() < fewest_points) return {};
  weigh(data, conditions);
  std::vector<RimTrial> trials;
  try_shadings(data, 1, conditions, trials);
  if (!conditions.linear_only)
    if (const auto lit = data_in_light(data, conditions)) try_shadings(*lit, display_exponent, conditions, trials);
  if (trials.empty()) return {};
  // If even the freest shape leaves more than the errors allow, they are larger than thought.
  const double spacing = data.distance[1] - data.distance[0];
  const double points = static_cast<double>(data.distance.size()) * std::min(1.0, spacing / conditions.knot_px);
  double least_squares = trials.front().rim.squares;
  for (const RimTrial& trial : trials) least_squares = std::min(least_squares, trial.rim.squares);
  return choice_among(trials, std::max(1.0, least_squares / std::max(1.0, points - 5)), points);
}

ToneFit fit_tone_exponent(const BeadProfile& profile, double background_level, double bead_level,
                          double radius_guess_px, double edge_guess_px) {
  ToneFit fit;
  fit.linear = fit_flat_rim(profile, radius_guess_px, edge_guess_px);
  fit.radius_px = fit.linear.radius_px;
  constexpr double already_good = 0.005;  // rms misfit in units of the bead's contrast
  const double middle = value_at(profile.level, profile.step_px, 0.6 * radius_guess_px);
  const double nearer_rim = value_at(profile.level, profile.step_px, radius_guess_px - 3 * edge_guess_px);
  const bool flat = std::abs(middle - nearer_rim) < 0.03 * std::abs(middle);
  if (!fit.linear.good || fit.linear.misfit < already_good || !flat) return fit;
  const double brightest = std::max({background_level, bead_level, 1.0});
  const auto light = [&](double level) { return std::pow(std::max(0.0, level) / brightest, 1 / display_exponent); };
  const double background = light(background_level), bead = light(bead_level);
  if (std::abs(bead - background) < 0.05) return fit;
  BeadProfile straightened = profile;
  for (float& level : straightened.level) {
    const double recorded = background_level + (bead_level - background_level) * static_cast<double>(level) / middle;
    level = static_cast<float>((light(recorded) - background) / (bead - background));
  }
  fit.encoded = fit_flat_rim(straightened, radius_guess_px, edge_guess_px);
  if (!fit.encoded.good) return fit;
  fit.open = true;
  // Likelihoods when the size of the misfits is not known beforehand: a power of their ratio. The rim fitted is seven
  // edge widths wide, of which blur leaves as many independent points, less the four numbers fitted.
  constexpr double degrees_of_freedom = 3;
  const double ratio = std::pow(fit.encoded.misfit / fit.linear.misfit, degrees_of_freedom);
  fit.encoded_weight = 1 / (1 + ratio);
  const double difference = fit.encoded.radius_px - fit.linear.radius_px;
  fit.radius_px += fit.encoded_weight * difference;
  fit.std_error_px = std::sqrt(fit.encoded_weight * (1 - fit.encoded_weight)) * std::abs(difference);
  return fit;
}

}  // namespace shakebed::ingest
