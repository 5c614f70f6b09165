#include "ingest/find/bead_profile.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/blurred_disk.hpp"
#include "ingest/find/nearby.hpp"
#include "ingest/frames/smooth_field.hpp"

namespace shakebed::ingest {

namespace {

// The four uniform cubic B-splines that live on a cell, at part t of it.
std::array<double, 4> cubic_b_splines(double t) {
  const double s = 1 - t;
  return {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6};
}

template <class Number>
double value_at(const std::vector<Number>& samples, double step, double r) {
  const double place = r / step;
  const auto cell = static_cast<std::size_t>(place);
  if (cell + 1 >= samples.size()) return 0;
  const double part = place - static_cast<double>(cell);
  return static_cast<double>(samples[cell]) * (1 - part) + static_cast<double>(samples[cell + 1]) * part;
}

// The first row from `top` on that a pass over every `step`-th row visits.
int first_row(int top, int step) { return (top + step - 1) / step * step; }

}  // namespace

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

BeadProfile learn_profile(const std::vector<const JointFit*>& fits,
                          const std::vector<const std::vector<ModelDisk>*>& disks, const BeadProfile& current,
                          double reach_px, double knot_px, double radius_px, bool fourth_harmonic, int row_step) {
  // Coefficient k belongs to the spline centred at knot k - 1, k = 0 .. cells + 2. The three that reach past the last
  // knot are held at 0; coefficient 0 is folded onto 2, so that p'(0) = 0.
  const std::size_t cells = std::max<std::size_t>(4, static_cast<std::size_t>(std::ceil(reach_px / knot_px)));
  const double knot = reach_px / static_cast<double>(cells);
  const std::size_t free_count = cells - 1;  // coefficients 1 .. cells - 1
  // +3 slots that swallow the coefficients held at 0
  const std::size_t size = free_count + 4;
  std::vector<double> matrix(size * size, 0.0), right(size, 0.0);
  const auto slot = [&](std::size_t coefficient) -> std::size_t {
    if (coefficient == 0) return 1;  // folded onto coefficient 2
    return std::min(coefficient - 1, size - 1);
  };
  const double inverse_knot = 1 / knot;
  const double reach_squared = reach_px * reach_px;
  // Coefficients of the current profile: for a smooth curve, its value less a sixth of its second difference.
  std::vector<double> present(free_count);
  for (std::size_t i = 0; i < free_count; ++i) {
    const double r = static_cast<double>(i) * knot;  // coefficient i + 1 is centred at knot i
    const auto at = [&](double distance) { return value_at(current.level, current.step_px, std::abs(distance)); };
    present[i] = at(r) - (at(r + knot) - 2 * at(r) + at(r - knot)) / 6;
  }
  // What the splines cannot follow of the current profile stays in the data.
  const auto spline_value = [&](const std::vector<double>& coefficients, double r) {
    const double place = r * inverse_knot;
    const std::size_t cell = std::min(cells - 1, static_cast<std::size_t>(place));
    const auto splines = cubic_b_splines(place - static_cast<double>(cell));
    double value = 0;
    for (std::size_t a = 0; a < 4; ++a) {
      const std::size_t k = slot(cell + a);
      if (k < free_count) value += splines[a] * coefficients[k];
    }
    return value;
  };
  const double fine = knot / 16;
  std::vector<float> left_over(static_cast<std::size_t>(std::ceil(reach_px / fine)) + 3);
  for (std::size_t i = 0; i < left_over.size(); ++i) {
    const double r = static_cast<double>(i) * fine;
    left_over[i] =
        static_cast<float>(value_at(current.level, current.step_px, r) - (r < reach_px ? spline_value(present, r) : 0));
  }
  // p4 lives on cells around the rim.
  const double ring_low = std::max(0.0, radius_px - 2.5), ring_high = radius_px + 2.5;
  const std::size_t ring_cells = static_cast<std::size_t>(std::ceil((ring_high - ring_low) / 0.25));
  std::vector<double> ring_sum(ring_cells + 1, 0.0), ring_weight(ring_cells + 1, 0.0);

  // Pixels are collected by their distance from the bead (shared between the two nearest of fine steps), and where the
  // reaches of two beads overlap by both their distances; splines are laid over the collected sums.
  std::vector<double> pixel_count(left_over.size() + 1, 0.0), residual_sum(left_over.size() + 1, 0.0);
  const std::size_t pair_bins_of_knot = std::clamp<std::size_t>(600 / cells, 2, 6);
  const std::size_t pair_bins = cells * pair_bins_of_knot;
  const double inverse_fine = 1 / fine, inverse_pair_bin = static_cast<double>(pair_bins_of_knot) / knot;
  std::vector<float> pair_count(pair_bins * pair_bins, 0.0F);
  const auto longest = static_cast<std::size_t>(2 * reach_px) + 2;
  std::vector<float> place1(longest), place2(longest);
  // Distances of a row's pixels from a bead, in steps.
  const auto distances = [](int left, int count, double x, double dy, double inverse_step, std::vector<float>& places) {
    const float dx0 = static_cast<float>(left - x), squared = static_cast<float>(dy * dy);
    const float scale = static_cast<float>(inverse_step);
    float* to = places.data();
    for (int k = 0; k < count; ++k) {
      const float dx = dx0 + static_cast<float>(k);
      to[k] = std::sqrt(dx * dx + squared) * scale;
    }
  };
  for (std::size_t f = 0; f < fits.size(); ++f) {
    const JointFit& fit = *fits[f];
    const std::vector<ModelDisk>& beads = *disks[f];
    for (const ModelDisk& bead : beads) {
      const int top = std::max(0, static_cast<int>(std::ceil(bead.y - reach_px)));
      const int bottom = std::min(fit.height() - 1, static_cast<int>(std::floor(bead.y + reach_px)));
      for (int row = first_row(top, row_step); row <= bottom; row += row_step) {
        const double dy = row - bead.y;
        const double half = std::sqrt(std::max(0.0, reach_squared - dy * dy));
        const int left = std::max(0, static_cast<int>(std::ceil(bead.x - half)));
        const int right_column = std::min(fit.width() - 1, static_cast<int>(std::floor(bead.x + half)));
        const int count = right_column - left + 1;
        if (count <= 0) continue;
        const float* line = fit.residual_row(row) + left;
        distances(left, count, bead.x, dy, inverse_fine, place1);
        for (int k = 0; k < count; ++k) {
          const float place = place1[static_cast<std::size_t>(k)];
          const auto cell = static_cast<std::size_t>(static_cast<int>(place));
          const double part = static_cast<double>(place - static_cast<float>(static_cast<int>(place)));
          if (unseen(line[k])) continue;
          const double e = static_cast<double>(line[k]);
          pixel_count[cell] += 1 - part;
          pixel_count[cell + 1] += part;
          residual_sum[cell] += (1 - part) * e;
          residual_sum[cell + 1] += part * e;
        }
        if (!fourth_harmonic) continue;
        for (int k = 0; k < count; ++k) {
          const double r = static_cast<double>(place1[static_cast<std::size_t>(k)]) * fine;
          if (r <= ring_low || r >= ring_high || unseen(line[k])) continue;
          const double dx = left + k - bead.x, squared = r * r;
          const double a2 = dx * dx, b2 = dy * dy;
          const double cosine = (a2 * a2 - 6 * a2 * b2 + b2 * b2) / (squared * squared);
          const double ring_place = (r - ring_low) / 0.25;
          const auto ring = static_cast<std::size_t>(ring_place);
          const double part = ring_place - static_cast<double>(ring);
          const double e = static_cast<double>(line[k]) + value_at(left_over, fine, r);
          ring_sum[ring] += (1 - part) * e * cosine;
          ring_weight[ring] += (1 - part) * cosine * cosine;
          if (ring + 1 <= ring_cells) {
            ring_sum[ring + 1] += part * e * cosine;
            ring_weight[ring + 1] += part * cosine * cosine;
          }
        }
      }
    }
    // Pairs whose reaches overlap: their splines meet in the same pixels.
    const Nearby near(beads.size(), 2 * reach_px, [&](std::size_t i) { return std::pair(beads[i].x, beads[i].y); });
    near.pairs([&](std::size_t i, std::size_t j) {
      const ModelDisk &one = beads[i], &other = beads[j];
      const int top = std::max(0, static_cast<int>(std::ceil(other.y - reach_px)));
      const int bottom = std::min(fit.height() - 1, static_cast<int>(std::floor(one.y + reach_px)));
      for (int row = first_row(top, row_step); row <= bottom; row += row_step) {
        const double dy1 = row - one.y, dy2 = row - other.y;
        const double half1 = std::sqrt(std::max(0.0, reach_squared - dy1 * dy1));
        const double half2 = std::sqrt(std::max(0.0, reach_squared - dy2 * dy2));
        const int left = std::max(0, static_cast<int>(std::ceil(std::max(one.x - half1, other.x - half2))));
        const int right_column =
            std::min(fit.width() - 1, static_cast<int>(std::floor(std::min(one.x + half1, other.x + half2))));
        const int count = right_column - left + 1;
        if (count <= 0) continue;
        const float* line = fit.residual_row(row) + left;
        distances(left, count, one.x, dy1, inverse_pair_bin, place1);
        distances(left, count, other.x, dy2, inverse_pair_bin, place2);
        for (int k = 0; k < count; ++k) {
          const auto bin1 =
              std::min(pair_bins - 1, static_cast<std::size_t>(static_cast<int>(place1[static_cast<std::size_t>(k)])));
          const auto bin2 =
              std::min(pair_bins - 1, static_cast<std::size_t>(static_cast<int>(place2[static_cast<std::size_t>(k)])));
          pair_count[bin1 * pair_bins + bin2] += unseen(line[k]) ? 0.0F : 1.0F;
        }
      }
      return false;
    });
  }
  struct Cell {
    std::array<std::size_t, 4> slots;
    std::array<double, 4> splines;
  };
  const auto cell_at = [&](double r) {
    const double place = r * inverse_knot;
    const std::size_t number = std::min(cells - 1, static_cast<std::size_t>(place));
    Cell cell;
    cell.splines = cubic_b_splines(place - static_cast<double>(number));
    for (std::size_t a = 0; a < 4; ++a) cell.slots[a] = slot(number + a);
    return cell;
  };
  for (std::size_t i = 0; i < pixel_count.size(); ++i) {
    const double r = static_cast<double>(i) * fine;
    if (pixel_count[i] == 0 || r >= reach_px) continue;
    const Cell cell = cell_at(r);
    const double e = residual_sum[i] + pixel_count[i] * value_at(left_over, fine, r);
    for (std::size_t a = 0; a < 4; ++a) {
      right[cell.slots[a]] += cell.splines[a] * e;
      for (std::size_t b = 0; b < 4; ++b)
        matrix[cell.slots[a] * size + cell.slots[b]] += pixel_count[i] * cell.splines[a] * cell.splines[b];
    }
  }
  std::vector<Cell> pair_cells(pair_bins);
  for (std::size_t i = 0; i < pair_bins; ++i)
    pair_cells[i] = cell_at((static_cast<double>(i) + 0.5) / inverse_pair_bin);
  for (std::size_t i = 0; i < pair_bins; ++i)
    for (std::size_t j = 0; j < pair_bins; ++j) {
      const double count = static_cast<double>(pair_count[i * pair_bins + j]);
      if (count == 0) continue;
      const Cell &one = pair_cells[i], &other = pair_cells[j];
      for (std::size_t a = 0; a < 4; ++a)
        for (std::size_t b = 0; b < 4; ++b) {
          const std::size_t p = one.slots[a], q = other.slots[b];
          const double product = count * one.splines[a] * other.splines[b];
          matrix[p * size + q] += product;
          matrix[q * size + p] += product;
        }
    }

  // A touch of smoothness (second differences of the whole profile): in a crystal, pixels far out of one bead lie
  // inside another, and what is added to the one can be taken from the other.
  double trace = 0;
  for (std::size_t i = 0; i < free_count; ++i) trace += matrix[i * size + i];
  const double mean_weight = trace / static_cast<double>(free_count);
  const double smoothness = 2e-4 * mean_weight;
  std::vector<double> system(free_count * free_count), change(free_count);
  for (std::size_t i = 0; i < free_count; ++i) {
    change[i] = right[i];
    for (std::size_t j = 0; j < free_count; ++j) system[i * free_count + j] = matrix[i * size + j];
    system[i * free_count + i] += 1e-7 * mean_weight;
  }
  for (std::size_t i = 0; i + 1 < free_count; ++i) {
    const std::array<double, 3> difference = {1, -2, 1};
    double bend = 0;
    for (std::size_t a = 0; a < 3; ++a) bend += i + a < free_count ? difference[a] * present[i + a] : 0;
    for (std::size_t a = 0; a < 3; ++a) {
      if (i + a >= free_count) continue;
      change[i + a] -= smoothness * difference[a] * bend;
      for (std::size_t b = 0; b < 3; ++b)
        if (i + b < free_count) system[(i + a) * free_count + i + b] += smoothness * difference[a] * difference[b];
    }
  }
  const bool solved = solve_symmetric(system, change, free_count);
  for (std::size_t i = 0; i < free_count; ++i) change[i] += present[i];

  BeadProfile learned;
  learned.asymmetry = current.asymmetry;
  learned.step_px = std::min(current.step_px, knot / 8);
  const std::size_t count = static_cast<std::size_t>(std::ceil(reach_px / learned.step_px)) + 1;
  learned.level.resize(count);
  learned.fourth_harmonic.assign(count, 0.0F);
  for (std::size_t i = 0; i < count; ++i) {
    const double r = static_cast<double>(i) * learned.step_px;
    double value = 0;
    if (!solved)
      value = value_at(current.level, current.step_px, r);
    else if (r < reach_px)
      value = spline_value(change, r);
    learned.level[i] = static_cast<float>(value);
    double harmonic = value_at(current.fourth_harmonic, current.step_px, r);
    if (fourth_harmonic && r > ring_low && r < ring_high) {
      const double ring_place = (r - ring_low) / 0.25;
      const auto ring = std::min(ring_cells - 1, static_cast<std::size_t>(ring_place));
      const double part = ring_place - static_cast<double>(ring);
      const auto at = [&](std::size_t k) { return ring_weight[k] > 10 ? ring_sum[k] / ring_weight[k] : 0.0; };
      harmonic += (1 - part) * at(ring) + part * at(ring + 1);
    }
    learned.fourth_harmonic[i] = static_cast<float>(harmonic);
  }
  learned.level.back() = 0;
  return learned;
}

namespace {

// flat, sphere, parabola, cone, quartic: see BlurredShapes.
using Shapes = std::array<double, 5>;
// Which of them take part in a fit, and last the level outside.
constexpr std::size_t rim_terms = 6;
using RimTerms = std::array<bool, rim_terms>;

// The shapes of a bead, blurred, at each of the distances given. Where the optical blur is smaller than the
// pixel, the pixel's own square window is laid over it (averaged over directions) instead of being counted as a
// Gaussian.
std::vector<Shapes> shapes_at(double radius, double edge, const std::vector<double>& distance) {
  std::vector<Shapes> shapes(distance.size());
  constexpr double pixel_variance = 1.0 / 12, gaussian_enough = 0.7;
  if (edge > gaussian_enough) {
    for (std::size_t i = 0; i < distance.size(); ++i) {
      const BlurredShapes one = blurred_disk_shapes(radius, edge, distance[i]);
      shapes[i] = {one.flat, one.sphere, one.parabola, one.cone, one.quartic};
    }
    return shapes;
  }
  const double optical = std::sqrt(std::max(0.08 * 0.08, edge * edge - pixel_variance));
  const double low = std::max(0.0, distance.front() - 0.8), high = distance.back() + 0.8;
  const auto count = static_cast<std::size_t>(std::ceil((high - low) / (optical / 5))) + 2;
  const double step = (high - low) / static_cast<double>(count - 1);
  std::vector<Shapes> table(count);
  for (std::size_t k = 0; k < count; ++k) {
    const BlurredShapes one = blurred_disk_shapes(radius, optical, low + static_cast<double>(k) * step);
    table[k] = {one.flat, one.sphere, one.parabola, one.cone, one.quartic};
  }
  static const GaussLegendre rule = gauss_legendre(6);
  constexpr int directions = 4;
  for (std::size_t i = 0; i < distance.size(); ++i) {
    Shapes sum{};
    for (int d = 0; d < directions; ++d) {
      const double angle = (d + 0.5) / directions * 0.25 * 3.14159265358979;
      const double x = distance[i] * std::cos(angle), y = distance[i] * std::sin(angle);
      for (std::size_t a = 0; a < rule.node.size(); ++a)
        for (std::size_t b = 0; b < rule.node.size(); ++b) {
          const double r = std::hypot(x + rule.node[a] - 0.5, y + rule.node[b] - 0.5);
          const double place = std::clamp((r - low) / step, 0.0, static_cast<double>(count) - 1.001);
          const auto cell = static_cast<std::size_t>(place);
          const double part = place - static_cast<double>(cell);
          const double weight = rule.weight[a] * rule.weight[b] / directions;
          for (std::size_t k = 0; k < sum.size(); ++k)
            sum[k] += weight * ((1 - part) * table[cell][k] + part * table[cell + 1][k]);
        }
    }
    shapes[i] = sum;
  }
  return shapes;
}

// What is fitted: levels at distances from the centre, and the weight of each.
struct RimData {
  std::vector<double> distance, level, weight;
  double offset_weight = 0;  // of the level outside being 0
};

// Radius and edge by damped least squares; `use` tells which of the shapes, and the level outside, take part.
RimFit fit_rim_with(const RimData& data, double radius_guess, double edge_guess, RimTerms use,
                    double* offset = nullptr) {
  RimFit best;
  const std::vector<double>&distance = data.distance, &level = data.level;
  double area_misfit = 0;
  // Weighted sum of squares with the best sum of shapes.
  const auto misfit_of = [&](double radius, double edge, std::vector<double>& residual) {
    const auto rows = shapes_at(radius, edge, distance);
    const auto shape = [&](std::size_t i, std::size_t a) { return a < 5 ? rows[i][a] : 1.0; };
    std::vector<double> matrix(rim_terms * rim_terms, 0.0), right(rim_terms, 0.0);
    for (std::size_t i = 0; i < distance.size(); ++i)
      for (std::size_t a = 0; a < rim_terms; ++a) {
        if (!use[a]) continue;
        right[a] += data.weight[i] * shape(i, a) * level[i];
        for (std::size_t b = 0; b < rim_terms; ++b)
          if (use[b]) matrix[a * rim_terms + b] += data.weight[i] * shape(i, a) * shape(i, b);
      }
    const double ridge = 1e-9 * matrix[0];
    for (std::size_t a = 0; a < rim_terms; ++a) matrix[a * (rim_terms + 1)] += use[a] ? ridge : 1.0;
    if (use[5]) matrix.back() += data.offset_weight;
    if (!solve_symmetric(matrix, right, rim_terms)) return 1e30;
    if (offset) *offset = right[5];
    residual.resize(distance.size());
    double sum = data.offset_weight * right[5] * right[5], areas = 0;
    area_misfit = 0;
    for (std::size_t i = 0; i < distance.size(); ++i) {
      double model = 0;
      for (std::size_t a = 0; a < rim_terms; ++a)
        if (use[a]) model += right[a] * shape(i, a);
      const double gap = level[i] - model;
      residual[i] = std::sqrt(data.weight[i]) * gap;
      sum += residual[i] * residual[i];
      areas += distance[i];
      area_misfit += distance[i] * gap * gap;
    }
    area_misfit = std::sqrt(area_misfit / areas);
    return sum;
  };
  double radius = radius_guess, edge = std::max(0.3, edge_guess);
  std::vector<double> residual, shifted;
  double misfit = misfit_of(radius, edge, residual);
  double misfit_by_area = area_misfit;
  double damping = 1e-3;
  for (int round = 0; round < 30; ++round) {
    const double delta = 1e-3;
    std::vector<double> slope_radius, slope_edge;
    misfit_of(radius + delta, edge, slope_radius);
    misfit_of(radius, edge + delta, slope_edge);
    if (slope_radius.size() != residual.size() || slope_edge.size() != residual.size()) return best;
    double rr = 0, re = 0, ee = 0, br = 0, be = 0;
    for (std::size_t i = 0; i < residual.size(); ++i) {
      const double by_radius = (slope_radius[i] - residual[i]) / delta, by_edge = (slope_edge[i] - residual[i]) / delta;
      rr += by_radius * by_radius;
      re += by_radius * by_edge;
      ee += by_edge * by_edge;
      br -= by_radius * residual[i];
      be -= by_edge * residual[i];
    }
    bool improved = false;
    const double information = ee > 0 ? rr - re * re / ee : 0;
    best.std_error_px = information > 0 ? 1 / std::sqrt(information) : 0;
    double moved = 0;
    for (int attempt = 0; attempt < 8 && !improved; ++attempt) {
      const double a = rr * (1 + damping), c = ee * (1 + damping);
      const double determinant = a * c - re * re;
      if (!(determinant > 0)) break;
      const double step_radius = std::clamp((c * br - re * be) / determinant, -0.5, 0.5);
      const double step_edge = std::clamp((a * be - re * br) / determinant, -0.3, 0.3);
      const double new_radius = std::max(0.5, radius + step_radius), new_edge = std::max(0.295, edge + step_edge);
      const double new_misfit = misfit_of(new_radius, new_edge, shifted);
      if (new_misfit <= misfit) {
        moved = std::abs(new_radius - radius) + std::abs(new_edge - edge);
        radius = new_radius;
        edge = new_edge;
        misfit = new_misfit;
        misfit_by_area = area_misfit;
        residual = shifted;
        damping = std::max(1e-9, damping * 0.2);
        improved = true;
      } else {
        damping = std::max(1e-6, damping * 10);
      }
    }
    if (!improved || moved < 3e-5) break;
  }
  best.misfit = misfit_by_area;
  best.squares = misfit;
  best.good = std::isfinite(radius) && best.misfit < 0.1;
  best.radius_px = radius;
  best.edge_px = edge;
  return best;
}

}  // namespace

namespace {

RimData rim_data(const BeadProfile& profile, double radius, double edge) {
  RimData data;
  const double reach = profile.reach_px();
  const double low = std::max(0.0, std::min(0.55 * radius, radius - 2.5 * edge));
  const double spacing = std::clamp(edge / 4, 0.08, (reach - low) / 30);
  for (double r = low + 0.5 * spacing; r < reach; r += spacing) {
    data.distance.push_back(r);
    data.level.push_back(value_at(profile.level, profile.step_px, r));
  }
  data.weight = data.distance;  // pixels at this distance
  return data;
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
  // In a crystal hardly any background is left to tell the level outside by, and a profile that ends a few thousandths
  // too low passes for a larger bead. An offset beyond that is something else: light between the beads, a halo.
  constexpr double largest_offset = 0.006;
  if (best.good) {
    chosen[5] = true;
    double offset = 0;
    const RimFit levelled = fit_rim_with(data, best.radius_px, best.edge_px, chosen, &offset);
    if (levelled.good && std::abs(offset) < largest_offset && levelled.misfit < best.misfit) best = levelled;
  }
  return best;
}

RimChoice choose_rim(const BeadProfile& profile, double radius_px, double edge_px, double knot_px, double noise,
                     double beads, double background_level, double bead_level, double from_px, bool linear_only) {
  RimChoice choice;
  RimData data = rim_data(profile, radius_px, edge_px);
  const auto inner = std::lower_bound(data.distance.begin(), data.distance.end(), from_px) - data.distance.begin();
  for (std::vector<double>* values : {&data.distance, &data.level, &data.weight})
    values->erase(values->begin(), values->begin() + inner);
  if (data.distance.size() < 10) return choice;
  // The profile's own error: pixels at one distance, and what its learning is good to. At a sharp edge square pixels
  // see every direction differently.
  constexpr double sharp = 0.6;
  const double learning = edge_px < sharp ? 3e-3 : 3e-4;
  const double spacing = data.distance[1] - data.distance[0];
  for (std::size_t i = 0; i < data.distance.size(); ++i) {
    const double pixels = std::max(1.0, beads * 2 * 3.14159265358979 * data.distance[i] * knot_px);
    data.weight[i] = std::min(1.0, spacing / knot_px) / (noise * noise / pixels + learning * learning);
  }
  constexpr double likely_offset = 0.002;
  data.offset_weight = 1 / (likely_offset * likely_offset);
  struct Trial {
    RimFit rim;
    double terms = 0, exponent = 1;
    bool odd = false;  // neither flat nor an evenly lit ball
  };
  std::vector<Trial> trials;
  const auto try_all = [&](const RimData& levels, double exponent) {
    constexpr std::array<RimTerms, 8> families = {
        RimTerms{true, false, false, false, false, true}, RimTerms{true, true, false, false, false, true},
        RimTerms{true, false, true, false, false, true},  RimTerms{true, false, false, true, false, true},
        RimTerms{true, false, false, false, true, true},  RimTerms{true, true, true, false, false, true},
        RimTerms{true, false, true, true, false, true},   RimTerms{true, false, true, false, true, true}};
    for (const RimTerms& family : families) {
      // What bends a rim a little passes for a tone curve if the shading is free enough.
      const bool pair = family[1] + family[2] + family[3] + family[4] > 1;
      if (pair && exponent != 1) continue;
      const RimFit rim = fit_rim_with(levels, radius_px, edge_px, family);
      if (!rim.good) continue;
      const auto terms = static_cast<double>(std::count(family.begin(), family.end(), true));
      trials.push_back({rim, terms, exponent, family[2] || family[3] || family[4]});
    }
  };
  try_all(data, 1);
  // In light, for a camera that encodes for display.
  const double brightest = std::max({background_level, bead_level, 1.0});
  const auto light = [&](double level) { return std::pow(std::max(0.0, level) / brightest, 1 / display_exponent); };
  const double background = light(background_level), bead = light(bead_level);
  if (!linear_only && std::abs(bead - background) > 0.05) {
    RimData in_light = data;
    for (double& level : in_light.level)
      level = (light(background_level + (bead_level - background_level) * level) - background) / (bead - background);
    try_all(in_light, display_exponent);
  }
  if (trials.empty()) return choice;
  // If even the freest shape leaves more than the errors allow, they are larger than thought.
  const double points = static_cast<double>(data.distance.size()) * std::min(1.0, spacing / knot_px);
  double least_squares = trials.front().rim.squares;
  for (const Trial& trial : trials) least_squares = std::min(least_squares, trial.rim.squares);
  const double scale = std::max(1.0, least_squares / std::max(1.0, points - 5));
  // Of chi^2: what a term must bring to be believed, and what an odd shape must.
  constexpr double price_of_term = 6, price_of_oddity = 12, price_of_curve = 12;
  const auto cost = [&](const Trial& trial) {
    return trial.rim.squares / scale + price_of_term * trial.terms + (trial.odd ? price_of_oddity : 0) +
           (trial.exponent != 1 ? price_of_curve : 0);
  };
  const Trial least = *std::min_element(trials.begin(), trials.end(),
                                        [&](const Trial& a, const Trial& b) { return cost(a) < cost(b); });
  choice.rim = least.rim;
  choice.exponent = least.exponent;
  constexpr double fair = 5;  // chi^2 a point
  choice.rim.good = least.rim.squares < fair * points;
  // Shapes and tone curves that do as well each have their say; in the error, odd ones as much as any other.
  double weights = 0, mean = 0;
  for (const Trial& trial : trials) {
    const double weight = std::exp(0.5 * std::max(-60.0, cost(least) - cost(trial)));
    weights += weight;
    mean += weight * trial.rim.radius_px;
  }
  mean /= weights;
  double fair_weights = 0, square = 0;
  for (const Trial& trial : trials) {
    const double surplus = cost(trial) - cost(least) - (trial.odd && !least.odd ? price_of_oddity : 0) -
                           (trial.exponent != 1 && least.exponent == 1 ? price_of_curve : 0);
    const double weight = std::exp(-0.5 * std::clamp(surplus, 0.0, 60.0));
    fair_weights += weight;
    square += weight * (std::pow(trial.rim.radius_px - mean, 2) + scale * std::pow(trial.rim.std_error_px, 2));
  }
  choice.rim.radius_px = mean;
  choice.rim.std_error_px = std::sqrt(square / fair_weights);
  return choice;
}

namespace {

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

std::shared_ptr<const BeadAsymmetry> learn_asymmetry(const std::vector<const JointFit*>& fits,
                                                     const std::vector<const std::vector<ModelDisk>*>& disks,
                                                     const BeadProfile& current, double radius_px, double noise,
                                                     int row_step) {
  constexpr double ring = 0.4;  // px
  constexpr std::size_t orders = BeadAsymmetry::orders;
  const double reach = current.reach_px();
  const auto rings = static_cast<std::size_t>(std::ceil(reach / ring)) + 1;
  std::vector<std::array<double, orders>> cosine_sum(rings), sine_sum(rings), weight(rings);
  for (std::size_t k = 0; k < rings; ++k) {
    cosine_sum[k].fill(0);
    sine_sum[k].fill(0);
    weight[k].fill(0);
  }
  constexpr float no_bead = 1;  // dirt, something in front
  for (std::size_t f = 0; f < fits.size(); ++f)
    for (const ModelDisk& bead : *disks[f]) {
      const int top = std::max(0, static_cast<int>(std::ceil(bead.y - reach)));
      const int bottom = std::min(fits[f]->height() - 1, static_cast<int>(std::floor(bead.y + reach)));
      for (int row = first_row(top, row_step); row <= bottom; row += row_step) {
        const double dy = row - bead.y, half = std::sqrt(std::max(0.0, reach * reach - dy * dy));
        const int left = std::max(0, static_cast<int>(std::ceil(bead.x - half)));
        const int right = std::min(fits[f]->width() - 1, static_cast<int>(std::floor(bead.x + half)));
        const float* line = fits[f]->residual_row(row);
        for (int column = left; column <= right; ++column) {
          if (std::abs(line[column]) > no_bead) continue;
          const double dx = column - bead.x, r = std::sqrt(dx * dx + dy * dy);
          if (r < 1e-6) continue;
          const double place = r / ring, e = static_cast<double>(line[column]), cosine = dx / r, sine = dy / r;
          const auto k = std::min(rings - 2, static_cast<std::size_t>(place));
          const double outer = place - static_cast<double>(k);
          double c = cosine, s = sine;
          for (std::size_t m = 0; m < orders; ++m) {
            cosine_sum[k][m] += (1 - outer) * e * c;
            cosine_sum[k + 1][m] += outer * e * c;
            sine_sum[k][m] += (1 - outer) * e * s;
            sine_sum[k + 1][m] += outer * e * s;
            weight[k][m] += 0.5 * (1 - outer);
            weight[k + 1][m] += 0.5 * outer;
            const double next = c * cosine - s * sine;
            s = s * cosine + c * sine;
            c = next;
          }
        }
      }
    }
  // Pixels that two beads share are told to both: a little less than all of it.
  constexpr double share = 0.7;
  BeadAsymmetry::Harmonics harmonics;
  harmonics.step_px = ring;
  double chance = 0, area = 0;  // what noise alone would give
  for (std::size_t m = 0; m < orders; ++m) {
    auto &cosine = harmonics.cosine[m], &sine = harmonics.sine[m];
    cosine.assign(rings + 1, 0.0);
    sine.assign(rings + 1, 0.0);
    for (std::size_t k = 0; k < rings; ++k) {
      const double r = static_cast<double>(k) * ring;
      // A shape of m periods a turn is nothing near the middle.
      const double allowed = std::clamp(2 * r / static_cast<double>(m + 1) - 0.5, 0.0, 1.0);
      double c = 0, s = 0;
      if (current.asymmetry) {
        c = value_at(current.asymmetry->harmonics().cosine[m], ring, r);
        s = value_at(current.asymmetry->harmonics().sine[m], ring, r);
      }
      if (weight[k][m] > 0) {
        c += share * cosine_sum[k][m] / weight[k][m];
        s += share * sine_sum[k][m] / weight[k][m];
        if (r <= radius_px) chance += r * share * share * noise * noise / weight[k][m];
      }
      cosine[k] = allowed * c;
      sine[k] = allowed * s;
      if (m == 0 && r <= radius_px) area += r;
    }
  }
  auto learned = std::make_shared<const BeadAsymmetry>(std::move(harmonics));
  if (current.asymmetry) return learned;
  // Rims that are no circles (pixels wider than high) differ along and across, but not from side to side.
  constexpr double least = 0.015;  // contrast units
  const double one_sided = learned->one_sidedness(radius_px);
  return one_sided * one_sided > least * least + 4 * chance / std::max(1e-9, area) ? learned : nullptr;
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
    return value_at(profile.level, profile.step_px, std::hypot(x, y)) + profile.asymmetry->at(x, y);
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

Outline outline_of(const BeadProfile& profile, double radius_px, double edge_px) {
  constexpr std::size_t directions = 32, shapes = 3;
  // Shapes of a disk, and by how much they may be moved along a radius.
  const double most = std::min(0.3 * radius_px, 3.0 + edge_px), fine = 0.05;
  const double low = 0.5 * radius_px, high = profile.reach_px();
  const auto count = static_cast<std::size_t>((high - low + 2 * most) / fine) + 2;
  std::vector<std::array<double, shapes>> table(count);
  for (std::size_t k = 0; k < count; ++k) {
    const BlurredShapes one =
        blurred_disk_shapes(radius_px, edge_px, std::max(0.0, low - most + static_cast<double>(k) * fine));
    table[k] = {one.flat, one.sphere, one.cone};
  }
  const double spacing = std::max(0.1, edge_px / 4);
  std::vector<double> matrix(9, 0.0), right(3, 0.0);
  double all_weight = 0;
  for (std::size_t d = 0; d < directions; ++d) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(d) / directions;
    const double cosine = std::cos(angle), sine = std::sin(angle);
    std::vector<double> distance, level;
    for (double r = low; r < high; r += spacing) {
      distance.push_back(r);
      level.push_back(value_at(profile.level, profile.step_px, r) + profile.asymmetry->at(r * cosine, r * sine));
    }
    const auto misfit = [&](double shift) {
      std::vector<double> normal(shapes * shapes, 0.0), value(shapes, 0.0);
      double square = 0;
      for (std::size_t i = 0; i < distance.size(); ++i) {
        const double place = (distance[i] - shift - low + most) / fine;
        const auto cell = std::min(count - 2, static_cast<std::size_t>(std::max(0.0, place)));
        const double part = std::clamp(place - static_cast<double>(cell), 0.0, 1.0);
        std::array<double, shapes> shape{};
        for (std::size_t a = 0; a < shapes; ++a) shape[a] = (1 - part) * table[cell][a] + part * table[cell + 1][a];
        square += level[i] * level[i];
        for (std::size_t a = 0; a < shapes; ++a) {
          value[a] += shape[a] * level[i];
          for (std::size_t b = 0; b < shapes; ++b) normal[a * shapes + b] += shape[a] * shape[b];
        }
      }
      const std::vector<double> wanted = value;
      for (std::size_t a = 0; a < shapes; ++a) normal[a * shapes + a] += 1e-4 * normal[0];
      if (!solve_symmetric(normal, value, shapes)) return square;
      for (std::size_t a = 0; a < shapes; ++a) square -= value[a] * wanted[a];
      return square;
    };
    // Coarse, then by parabolas.
    double best = 0, least = 1e30, step = std::max(0.1, 0.4 * edge_px);
    for (double shift = -most; shift <= most; shift += step)
      if (const double here = misfit(shift); here < least) least = here, best = shift;
    double bend = 0;
    for (int round = 0; round < 4; ++round) {
      const double before = misfit(best - step), here = misfit(best), after = misfit(best + step);
      bend = (before - 2 * here + after) / (step * step);
      if (bend > 0) best += std::clamp(0.5 * step * (before - after) / (before - 2 * here + after), -step, step);
      step = std::max(0.02, 0.5 * step);
    }
    if (!(bend > 0) || std::abs(best) > most) continue;
    const std::array<double, 3> row = {1, cosine, sine};
    all_weight += bend;
    for (std::size_t a = 0; a < 3; ++a) {
      right[a] += bend * row[a] * best;
      for (std::size_t b = 0; b < 3; ++b) matrix[a * 3 + b] += bend * row[a] * row[b];
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

FreeRim learn_free_rim(const std::vector<GrayFrame>& flats, const std::vector<const std::vector<ModelDisk>*>& disks,
                       double radius_px, double edge_px) {
  constexpr int sectors = 16;
  constexpr double spacing = 0.2;
  FreeRim rim;
  const double inner = std::max(0.0, radius_px - std::max(5 * edge_px, 0.35 * radius_px));
  const double open_from = radius_px + 2.5 * edge_px + 0.7, open_to = radius_px + 5.5 * edge_px + 2;
  const double core_to = inner + std::max(1.0, 0.12 * radius_px);
  const auto bins = static_cast<std::size_t>(std::ceil(open_to / spacing)) + 1;
  std::vector<double> sums(bins, 0.0), weights(bins, 0.0);
  struct Sample {
    double r;
    float level;
  };
  for (std::size_t f = 0; f < flats.size(); ++f) {
    const GrayFrame& flat = flats[f];
    std::vector<ModelDisk> beads = *disks[f];
    std::sort(beads.begin(), beads.end(), [](const ModelDisk& a, const ModelDisk& b) { return a.y < b.y; });
    const double far = open_to + radius_px + 3 * edge_px;
    const Nearby near(beads.size(), far, [&](std::size_t i) { return std::pair(beads[i].x, beads[i].y); });
    for (std::size_t i = 0; i < beads.size(); ++i) {
      const ModelDisk& bead = beads[i];
      if (bead.x < open_to || bead.y < open_to || bead.x > flat.width - 1 - open_to ||
          bead.y > flat.height - 1 - open_to)
        continue;
      std::array<bool, sectors> open;
      open.fill(true);
      near.any_near(bead.x, bead.y, [&](std::size_t j) {
        if (j == i) return false;
        const double dx = beads[j].x - bead.x, dy = beads[j].y - bead.y;
        const double distance = std::sqrt(dx * dx + dy * dy);
        const double half =
            std::asin(std::min(1.0, (radius_px + 3 * edge_px + 1) / distance)) + 2 * 3.14159265358979 / sectors / 2;
        const double direction = std::atan2(dy, dx);
        for (int s = 0; s < sectors; ++s) {
          const double middle = (s + 0.5) * 2 * 3.14159265358979 / sectors - 3.14159265358979;
          if (std::abs(std::remainder(direction - middle, 2 * 3.14159265358979)) < half)
            open[static_cast<std::size_t>(s)] = false;
        }
        return false;
      });
      if (std::none_of(open.begin(), open.end(), [](bool free) { return free; })) continue;
      std::array<std::vector<Sample>, sectors> samples;
      const int top = static_cast<int>(std::ceil(bead.y - open_to)),
                bottom = static_cast<int>(std::floor(bead.y + open_to));
      const int left = static_cast<int>(std::ceil(bead.x - open_to)),
                right = static_cast<int>(std::floor(bead.x + open_to));
      for (int row = top; row <= bottom; ++row)
        for (int column = left; column <= right; ++column) {
          const double dx = column - bead.x, dy = row - bead.y;
          const double r = std::sqrt(dx * dx + dy * dy);
          if (r < inner || r > open_to) continue;
          const int s = std::clamp(static_cast<int>((std::atan2(dy, dx) / (2 * 3.14159265358979) + 0.5) * sectors), 0,
                                   sectors - 1);
          if (open[static_cast<std::size_t>(s)])
            samples[static_cast<std::size_t>(s)].push_back({r, flat.at(column, row)});
        }
      for (const auto& sector : samples) {
        double outside = 0, inside = 0, outside_count = 0, inside_count = 0, square = 0;
        for (const Sample& sample : sector) {
          const double level = static_cast<double>(sample.level);
          if (sample.r > open_from) {
            outside += level;
            square += level * level;
            ++outside_count;
          } else if (sample.r < core_to) {
            inside += level;
            ++inside_count;
          }
        }
        if (outside_count < 4 || inside_count < 2) continue;
        outside /= outside_count;
        inside /= inside_count;
        const double scatter = std::sqrt(std::max(0.0, square / outside_count - outside * outside));
        if (std::abs(outside) > 0.2 || scatter > 0.2 || inside - outside < 0.4 || inside > 10) continue;
        ++rim.sectors;
        for (const Sample& sample : sector) {
          const double level = static_cast<double>(sample.level) - outside;
          const double place = sample.r / spacing;
          const auto bin = static_cast<std::size_t>(place);
          const double part = place - static_cast<double>(bin);
          if (bin + 1 >= bins) continue;
          sums[bin] += (1 - part) * level;
          weights[bin] += 1 - part;
          sums[bin + 1] += part * level;
          weights[bin + 1] += part;
        }
      }
    }
  }
  rim.inner_px = inner;
  rim.profile.step_px = spacing;
  rim.profile.level.assign(bins, 0.0F);
  rim.profile.fourth_harmonic.assign(bins, 0.0F);
  float first = 1;
  bool seen = false;
  for (std::size_t k = 0; k < bins; ++k)
    if (weights[k] > 0) {
      rim.profile.level[k] = static_cast<float>(sums[k] / weights[k]);
      if (!seen) first = rim.profile.level[k];
      seen = true;
    }
  for (std::size_t k = 0; k < bins && weights[k] <= 0; ++k) rim.profile.level[k] = first;
  return rim;
}

}  // namespace shakebed::ingest
