#include "ingest/find/find_disks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/bead_profile.hpp"
#include "ingest/find/disk_map.hpp"
#include "ingest/find/joint_fit.hpp"
#include "ingest/find/nearby.hpp"
#include "ingest/frames/smooth_field.hpp"

namespace shakebed::ingest {

namespace {

// Two beads of one film are never seen nearer than this share of a diameter (beads a little in front of one another).
constexpr double least_separation = 0.72;
// What a place in the map must score to be tried: a strongly blurred bead in a crystal scores 0.7.
constexpr double least_score = 0.35;
// A bead explains at least this share of the contrast around its place, relative to the median bead.
constexpr double least_explained = 0.72;
// Residuals pull at a bead with at most this, in units of its contrast, or four times the noise.
constexpr double residual_bound = 0.4;
// Below this share it is nothing at all.
constexpr double faintly_explained = 0.35;

void require_consistent(const GrayFrame& frame) {
  if (frame.width < 0 || frame.height < 0 ||
      frame.pixels.size() != static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height))
    throw std::invalid_argument("find_disks: the frame's pixel count is not width x height");
}

double median_of(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// How far the edge's blur reaches beyond the radius.
double reach_of(double radius, double edge) { return radius + 3.2 * edge + 0.4; }

// Steps use a gradient widened to about this edge while beads may still be off by half a pixel.
double softening_for(double edge) { return edge < 0.8 ? std::sqrt(0.8 * 0.8 - edge * edge) : 0.0; }

// Distance of the knots of a profile.
double knot_for(double radius, double edge) { return std::clamp(0.4 * edge, 0.2, std::max(0.25, radius / 8)); }

std::vector<ModelDisk> disks_at(const std::vector<DiskCandidate>& candidates) {
  std::vector<ModelDisk> disks;
  disks.reserve(candidates.size());
  for (const DiskCandidate& candidate : candidates) {
    ModelDisk disk;
    disk.x = candidate.x;
    disk.y = candidate.y;
    disks.push_back(disk);
  }
  std::sort(disks.begin(), disks.end(), [](const ModelDisk& a, const ModelDisk& b) {
    if (a.y != b.y) return a.y < b.y;
    return a.x < b.x;
  });
  return disks;
}

Nearby nearby(const std::vector<ModelDisk>& disks, double distance) {
  return {disks.size(), distance, [&](std::size_t i) { return std::pair(disks[i].x, disks[i].y); }};
}

// What lies near a bead that came or went has to be fitted again.
void wake(const Nearby& near, std::vector<ModelDisk>& disks, const ModelDisk& changed) {
  near.any_near(changed.x, changed.y, [&](std::size_t i) {
    disks[i].last_step = ModelDisk().last_step;
    return false;
  });
}

// Takes out beads that explain nothing and the worse of two in one place, as judged; puts their share back into the
// residual.
std::size_t prune(JointFit& fit, std::vector<ModelDisk>& disks, double radius, double least) {
  std::vector<std::uint8_t> drop(disks.size(), 0);
  for (std::size_t i = 0; i < disks.size(); ++i) drop[i] = disks[i].explained < least;
  nearby(disks, 2 * radius * least_separation).pairs([&](std::size_t one, std::size_t other) {
    if (drop[one]) return true;
    if (drop[other]) return false;
    const bool first_worse = disks[one].explained < disks[other].explained;
    drop[first_worse ? one : other] = 1;
    return first_worse;
  });
  std::vector<ModelDisk> kept;
  kept.reserve(disks.size());
  for (std::size_t i = 0; i < disks.size(); ++i) {
    if (drop[i])
      fit.subtract(disks[i].x, disks[i].y, -1.0F);
    else
      kept.push_back(disks[i]);
  }
  const std::size_t dropped = disks.size() - kept.size();
  if (dropped > 0) {
    const Nearby near = nearby(kept, 2 * fit.reach());
    for (std::size_t i = 0; i < disks.size(); ++i)
      if (drop[i]) wake(near, kept, disks[i]);
  }
  disks = std::move(kept);
  return dropped;
}

// Smooth corrections to background and contrast, from the regression of the flattened frame on the model over tiles:
// flat = beta + gamma model, beta and gamma polynomials over the frame.
struct TileSums {
  double u = 0, v = 0;
  double count = 0, model = 0, model_model = 0, flat = 0, flat_model = 0;
};

void add_tile_sums(const GrayFrame& flat, const JointFit& fit, double spread, std::vector<TileSums>& tiles) {
  constexpr int side = 32;
  const float bound = static_cast<float>(std::max(0.1, 4 * spread));
  for (int top = 0; top < flat.height; top += side)
    for (int left = 0; left < flat.width; left += side) {
      const int bottom = std::min(flat.height, top + side), right = std::min(flat.width, left + side);
      TileSums tile;
      tile.u = (static_cast<double>(left + right - 1)) / flat.width - 1;
      tile.v = (static_cast<double>(top + bottom - 1)) / flat.height - 1;
      for (int row = top; row < bottom; ++row) {
        const float* residual = fit.residual_row(row);
        const float* level = flat.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(flat.width);
        float count = 0, model_sum = 0, model_model = 0, flat_sum = 0, flat_model = 0;
        for (int column = left; column < right; ++column) {
          const float use = std::abs(residual[column]) < bound ? 1.0F : 0.0F;
          const float model = level[column] - residual[column];
          count += use;
          model_sum += use * model;
          model_model += use * model * model;
          flat_sum += use * level[column];
          flat_model += use * level[column] * model;
        }
        tile.count += static_cast<double>(count);
        tile.model += static_cast<double>(model_sum);
        tile.model_model += static_cast<double>(model_model);
        tile.flat += static_cast<double>(flat_sum);
        tile.flat_model += static_cast<double>(flat_model);
      }
      tiles.push_back(tile);
    }
}

// Returns the largest change of a flattened level it makes.
double refine_light(LightField& light, const std::vector<TileSums>& tiles, int width, int height) {
  const int order = std::min(width, height) >= 200 && tiles.size() >= 60 ? 4 : tiles.size() >= 20 ? 2 : 0;
  const std::size_t terms = polynomial_terms(order), size = 2 * terms;
  std::vector<double> matrix(size * size, 0.0), right(size, 0.0), basis(terms);
  for (const TileSums& tile : tiles) {
    polynomial_values(tile.u, tile.v, order, basis.data());
    for (std::size_t a = 0; a < terms; ++a) {
      right[a] += basis[a] * (tile.flat - tile.model);  // target of beta + (gamma - 1) model
      right[terms + a] += basis[a] * (tile.flat_model - tile.model_model);
      for (std::size_t b = 0; b < terms; ++b) {
        const double both = basis[a] * basis[b];
        matrix[a * size + b] += both * tile.count;
        matrix[a * size + terms + b] += both * tile.model;
        matrix[(terms + a) * size + b] += both * tile.model;
        matrix[(terms + a) * size + terms + b] += both * tile.model_model;
      }
    }
  }
  for (std::size_t a = 0; a < terms; ++a) {
    matrix[a * size + a] += 1e-4 * matrix[0] + 1e-9;
    matrix[(terms + a) * size + terms + a] += 1e-3 * matrix[terms * size + terms] + 1e-9;
  }
  if (!solve_symmetric(matrix, right, size)) return 0;
  double largest = 0;
  for (int row = 0; row < light.rows; ++row)
    for (int column = 0; column < light.columns; ++column) {
      const double u = std::clamp((2 * column * light.spacing_px + 1) / width - 1, -1.0, 1.05);
      const double v = std::clamp((2 * row * light.spacing_px + 1) / height - 1, -1.0, 1.05);
      polynomial_values(u, v, order, basis.data());
      double beta = 0, gamma = 1;
      for (std::size_t a = 0; a < terms; ++a) {
        beta += right[a] * basis[a];
        gamma += right[terms + a] * basis[a];
      }
      beta = std::clamp(beta, -0.5, 0.5);
      gamma = std::clamp(gamma, 0.5, 2.0);
      const std::size_t at =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(light.columns) + static_cast<std::size_t>(column);
      light.background[at] += light.contrast[at] * static_cast<float>(beta);
      light.contrast[at] *= static_cast<float>(gamma);
      largest = std::max({largest, std::abs(beta), std::abs(gamma - 1)});
    }
  return largest;
}

// Where no bead is near there is open background: its levels, a tile each.
constexpr std::size_t fewest_open_tiles = 6;
std::vector<TileSums> open_background(const GrayFrame& flat, const std::vector<ModelDisk>& disks, double clear_px) {
  const std::size_t width = static_cast<std::size_t>(flat.width);
  std::vector<std::uint8_t> near(flat.pixels.size(), 0);
  for (const ModelDisk& disk : disks) {
    const int top = std::max(0, static_cast<int>(std::ceil(disk.y - clear_px)));
    const int bottom = std::min(flat.height - 1, static_cast<int>(std::floor(disk.y + clear_px)));
    for (int row = top; row <= bottom; ++row) {
      const double half = std::sqrt(std::max(0.0, clear_px * clear_px - (row - disk.y) * (row - disk.y)));
      const int left = std::max(0, static_cast<int>(std::ceil(disk.x - half)));
      const int right = std::min(flat.width - 1, static_cast<int>(std::floor(disk.x + half)));
      for (int column = left; column <= right; ++column)
        near[static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column)] = 1;
    }
  }
  constexpr int side = 32;
  constexpr std::size_t fewest_pixels = 40;
  std::vector<TileSums> tiles;
  std::vector<float> levels;
  for (int top = 0; top < flat.height; top += side)
    for (int left = 0; left < flat.width; left += side) {
      const int bottom = std::min(flat.height, top + side), right = std::min(flat.width, left + side);
      levels.clear();
      double u = 0, v = 0;
      for (int row = top; row < bottom; ++row)
        for (int column = left; column < right; ++column) {
          const std::size_t at = static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column);
          if (near[at] || unseen(flat.pixels[at])) continue;
          levels.push_back(flat.pixels[at]);
          u += column, v += row;
        }
      if (levels.size() < fewest_pixels) continue;
      const auto middle = levels.begin() + static_cast<std::ptrdiff_t>(levels.size() / 2);
      std::nth_element(levels.begin(), middle, levels.end());
      TileSums tile;
      tile.u = 2 * (u / static_cast<double>(levels.size()) + 0.5) / flat.width - 1;
      tile.v = 2 * (v / static_cast<double>(levels.size()) + 0.5) / flat.height - 1;
      tile.flat = static_cast<double>(*middle);
      tiles.push_back(tile);
    }
  return tiles;
}

double field_at(const LightField& light, const std::vector<float>& field, double x, double y) {
  const double across = std::clamp(x / light.spacing_px, 0.0, light.columns - 1.001),
               down = std::clamp(y / light.spacing_px, 0.0, light.rows - 1.001);
  const auto column = static_cast<std::size_t>(across), row = static_cast<std::size_t>(down);
  const double right = across - static_cast<double>(column), lower = down - static_cast<double>(row);
  const std::size_t at = row * static_cast<std::size_t>(light.columns) + column,
                    below = at + static_cast<std::size_t>(light.columns);
  return (1 - lower) * ((1 - right) * static_cast<double>(field[at]) + right * static_cast<double>(field[at + 1])) +
         lower * ((1 - right) * static_cast<double>(field[below]) + right * static_cast<double>(field[below + 1]));
}

constexpr double well_beyond_background = -0.05;  // contrast units

// A packed bed shows little background, and the voids between its beads, blurred, pass for it. If what open background
// there is tells of one well beyond that behind the beads, the light is set right; beads keep their level. Whether it
// was so.
bool correct_background(LightField& light, const GrayFrame& flat, const std::vector<TileSums>& open,
                        const std::vector<ModelDisk>& disks) {
  if (open.size() < fewest_open_tiles || disks.empty()) return false;
  constexpr int order = 2;
  const std::size_t terms = polynomial_terms(order);
  std::vector<double> matrix(terms * terms, 0.0), fit(terms, 0.0), basis(terms), levels;
  const auto x_of = [&](const TileSums& tile) { return 0.5 * (tile.u + 1) * flat.width - 0.5; };
  const auto y_of = [&](const TileSums& tile) { return 0.5 * (tile.v + 1) * flat.height - 0.5; };
  for (const TileSums& tile : open)
    levels.push_back(field_at(light, light.background, x_of(tile), y_of(tile)) +
                     tile.flat * field_at(light, light.contrast, x_of(tile), y_of(tile)));
  const double middle = median_of(levels);
  const auto edges = std::minmax_element(levels.begin(), levels.end());
  for (std::size_t k = 0; k < open.size(); ++k) {
    polynomial_values(open[k].u, open[k].v, order, basis.data());
    for (std::size_t a = 0; a < terms; ++a) {
      fit[a] += basis[a] * (levels[k] - middle);
      for (std::size_t b = 0; b < terms; ++b) matrix[a * terms + b] += basis[a] * basis[b];
    }
  }
  for (std::size_t a = 0; a < terms; ++a)  // what open parts do not tell is even
    matrix[a * terms + a] += (a ? 1e-2 : 1e-9) * static_cast<double>(open.size());
  if (!solve_symmetric(matrix, fit, terms)) return false;
  const auto background_at = [&](double x, double y) {
    polynomial_values(std::clamp((2 * x + 1) / flat.width - 1, -1.0, 1.05),
                      std::clamp((2 * y + 1) / flat.height - 1, -1.0, 1.05), order, basis.data());
    double level = middle;
    for (std::size_t a = 0; a < terms; ++a) level += fit[a] * basis[a];
    return std::clamp(level, *edges.first, *edges.second);
  };
  double beyond = 0;
  for (const ModelDisk& disk : disks)
    beyond += (background_at(disk.x, disk.y) - field_at(light, light.background, disk.x, disk.y)) /
              field_at(light, light.contrast, disk.x, disk.y) / static_cast<double>(disks.size());
  if (beyond > well_beyond_background) return false;
  for (int row = 0; row < light.rows; ++row)
    for (int column = 0; column < light.columns; ++column) {
      const std::size_t at =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(light.columns) + static_cast<std::size_t>(column);
      const auto level = static_cast<float>(background_at(column * light.spacing_px, row * light.spacing_px));
      light.contrast[at] += light.background[at] - level;
      light.background[at] = level;
    }
  return true;
}

// Typical size of the residual, robust against what is no bead at all.
double residual_spread(const JointFit& fit) {
  std::vector<float> sizes;
  const std::size_t total = static_cast<std::size_t>(fit.width()) * static_cast<std::size_t>(fit.height());
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(total) / 20000)));
  for (int row = 0; row < fit.height(); row += step)
    for (int column = (row / step) % 2; column < fit.width(); column += step)
      if (!unseen(fit.residual(column, row))) sizes.push_back(std::abs(fit.residual(column, row)));
  if (sizes.empty()) return 0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return 1.4826 * static_cast<double>(*middle);
}

double mean_contrast(const LightField& light) {
  const std::size_t middle = static_cast<std::size_t>(light.rows / 2) * static_cast<std::size_t>(light.columns) +
                             static_cast<std::size_t>(light.columns / 2);
  return static_cast<double>(light.contrast[middle]);
}

double mean_background(const LightField& light) {
  const std::size_t middle = static_cast<std::size_t>(light.rows / 2) * static_cast<std::size_t>(light.columns) +
                             static_cast<std::size_t>(light.columns / 2);
  return static_cast<double>(light.background[middle]);
}

std::vector<float> level_deciles(const GrayFrame& frame) {
  std::vector<float> levels, deciles;
  const std::size_t step = std::max<std::size_t>(1, frame.pixels.size() / 5000);
  for (std::size_t k = 0; k < frame.pixels.size(); k += step)
    if (!unseen(frame.pixels[k])) levels.push_back(frame.pixels[k]);
  if (levels.empty()) return deciles;
  std::sort(levels.begin(), levels.end());
  for (std::size_t k = 1; k < 10; ++k) deciles.push_back(levels[k * (levels.size() - 1) / 10]);
  return deciles;
}

// At first sight: all levels are so many times those of the film. None unless clearly so.
FrameLight light_at_first_sight(const GrayFrame& frame, const FinderCalibration& calibration) {
  constexpr double small = 0.05, well_lit = 0.2, agreeing = 0.5;
  const std::vector<float> deciles = level_deciles(frame);
  if (deciles.empty() || calibration.level_deciles.empty()) return {};
  std::vector<double> ratios;
  for (std::size_t k = 0; k < deciles.size(); ++k)
    if (static_cast<double>(calibration.level_deciles[k]) > well_lit * calibration.level_deciles.back())
      ratios.push_back(static_cast<double>(deciles[k] / calibration.level_deciles[k]));
  if (ratios.empty()) return {};
  const double gain = median_of(ratios);
  const auto [least, most] = std::minmax_element(ratios.begin(), ratios.end());
  if (!(gain > 0.2 && gain < 5) || std::abs(gain - 1) < small || *most - *least > agreeing * std::abs(gain - 1))
    return {};
  return {(gain - 1) * mean_background(calibration.light) / mean_contrast(calibration.light), gain};
}

// The light of one frame against the film's: flat = shift + gain model over what beads and background explain roughly.
// Differences below a few thousandths are none.
FrameLight light_of_frame(const GrayFrame& flat, const JointFit& fit, double noise) {
  constexpr double negligible = 0.002, most_shift = 0.5, least_gain = 0.4, most_gain = 2.5;
  const int rows_apart = std::max(1, flat.height / 250);
  FrameLight own;
  for (const double bound : {0.5, std::max(0.1, 4 * noise)}) {
    const auto shift = static_cast<float>(own.shift), gain = static_cast<float>(own.gain),
               most = static_cast<float>(bound);
    double n = 0, m = 0, mm = 0, f = 0, fm = 0;
    for (int row = 0; row < flat.height; row += rows_apart) {
      const float* residual = fit.residual_row(row);
      const float* level = flat.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(flat.width);
      float row_n = 0, row_m = 0, row_mm = 0, row_f = 0, row_fm = 0;
      for (int column = 0; column < flat.width; ++column) {
        const float model = level[column] - residual[column];
        const float use = std::abs(level[column] - shift - gain * model) < most ? 1.0F : 0.0F;
        const float used = use * model, seen = use > 0 ? level[column] : 0.0F;
        row_n += use;
        row_m += used;
        row_mm += used * model;
        row_f += seen;
        row_fm += used * level[column];
      }
      n += static_cast<double>(row_n), m += static_cast<double>(row_m), mm += static_cast<double>(row_mm);
      f += static_cast<double>(row_f), fm += static_cast<double>(row_fm);
    }
    const double determinant = n * mm - m * m;
    if (!(determinant > 1e-3 * n * n)) return {};  // all background, or all beads
    own.gain = (n * fm - m * f) / determinant;
    own.shift = (mm * f - m * fm) / determinant;
    if (!(std::abs(own.shift) < most_shift && own.gain > least_gain && own.gain < most_gain)) return {};
  }
  if (std::abs(own.shift) < negligible && std::abs(own.gain - 1) < negligible) return {};
  return own;
}

// Noise of a flattened frame from its second differences along rows, of which edges and beads are a minority.
double noise_of(const GrayFrame& flat) {
  std::vector<float> sizes;
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(flat.pixels.size()) / 20000)));
  for (int row = 0; row < flat.height; row += step)
    for (int column = 1; column + 1 < flat.width; column += step)
      if (!unseen(flat.at(column - 1, row) + flat.at(column, row) + flat.at(column + 1, row)))
        sizes.push_back(std::abs(flat.at(column - 1, row) - 2 * flat.at(column, row) + flat.at(column + 1, row)));
  if (sizes.empty()) return 0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return 1.4826 * static_cast<double>(*middle) / std::sqrt(6.0);
}

// The frame the map is made of: reduced, and smoothed where noise asks for it and disks are wide enough to bear it.
// (Smoothing blurs the rims by which a bead is told from the darkness around it.)
GrayFrame map_frame(const GrayFrame& flat, double radius, double noise) {
  const int factor = map_reduction(radius);
  constexpr double noisy = 0.04;  // contrast units, after reduction
  if (noise / factor < noisy || radius / factor < 3.5) return reduced(flat, factor);
  return smoothed(reduced(flat, factor));
}

// Those in an unseen part are none.
std::vector<DiskCandidate> seen_ones(const GrayFrame& flat, std::vector<DiskCandidate> candidates) {
  std::erase_if(candidates, [&](const DiskCandidate& candidate) {
    const int column = static_cast<int>(std::lround(candidate.x)), row = static_cast<int>(std::lround(candidate.y));
    return column >= 0 && row >= 0 && column < flat.width && row < flat.height && unseen(flat.at(column, row));
  });
  return candidates;
}

std::vector<DiskCandidate> candidates_in(const GrayFrame& flat, double radius, double noise, double score) {
  return seen_ones(flat, find_candidates(map_frame(flat, radius, noise), map_reduction(radius), radius, score,
                                         2 * radius * least_separation));
}

// Beyond this edge width, in radii, touching beads run into one another so much that the ideal disk's map no longer
// tells them from the voids between them; the learned profile's does.
constexpr double strong_blur = 0.14;

// A bead that hardly differs from the background over much of its area, of glass say, is nothing like an ideal disk.
bool hollow(const BeadProfile& profile, double radius) {
  constexpr double well_filled = 0.5;
  double sum = 0, area = 0, most = 0;
  for (std::size_t k = 0; k < profile.level.size(); ++k) {
    const double r = static_cast<double>(k) * profile.step_px;
    if (r > radius) break;
    sum += r * static_cast<double>(profile.level[k]);
    area += r;
    most = std::max(most, static_cast<double>(profile.level[k]));
  }
  return sum < well_filled * most * area;
}

// Candidates once the bead's profile is known.
std::vector<DiskCandidate> candidates_by(const BeadProfile& profile, const GrayFrame& flat, double radius, double edge,
                                         double noise, double score) {
  if (edge < strong_blur * radius && !hollow(profile, radius)) return candidates_in(flat, radius, noise, score);
  const int factor = map_reduction(radius);
  return seen_ones(flat, find_matched_candidates(reduced(flat, factor), factor, profile, radius, noise, score,
                                                 2 * radius * least_separation));
}

// Beads that leave much more unexplained than the others are taken out; then all beads that show in the residual are
// put in. A bead taken out in whose place nothing better shows goes back. `disks` have been judged. Returns how many
// places were looked at again.
std::size_t repair(JointFit& fit, std::vector<ModelDisk>& disks, double radius, double noise) {
  std::vector<double> unexplained;
  for (const ModelDisk& disk : disks) unexplained.push_back(1 - disk.explained);
  constexpr double suspicious_share = 1.5, always_tolerated = 0.03;
  const double limit = std::max(always_tolerated, suspicious_share * median_of(unexplained));
  std::vector<ModelDisk> kept, suspects;
  for (const ModelDisk& disk : disks) {
    const bool cut =
        disk.x < radius || disk.y < radius || disk.x > fit.width() - 1 - radius || disk.y > fit.height() - 1 - radius;
    if (1 - disk.explained > limit && !cut) {
      suspects.push_back(disk);
      fit.subtract(disk.x, disk.y, -1.0F);
    } else {
      kept.push_back(disk);
    }
  }
  // A bead that was missed darkens the residual over its whole area: without such pixels there is nothing to search.
  constexpr double clear_score = 0.5;
  const double bead_area = 3.14159265358979 * radius * radius;
  const bool something = !suspects.empty() || fit.strong_pixels(0.5F) > 0.4 * bead_area;
  if (!something) {
    disks = std::move(kept);
    return 0;
  }
  std::vector<ModelDisk> fresh = disks_at(candidates_in(fit.residual_image(), radius, noise, clear_score));
  const double near = 2 * radius * least_separation;
  const Nearby near_kept = nearby(kept, near), near_suspects = nearby(suspects, near);
  std::vector<ModelDisk> added;
  for (ModelDisk& disk : fresh) {
    if (near_kept.any_near(disk.x, disk.y)) continue;
    double nearest = near;
    near_suspects.any_near(disk.x, disk.y, [&](std::size_t i) {
      const ModelDisk& suspect = suspects[i];
      const double distance = std::hypot(suspect.x - disk.x, suspect.y - disk.y);
      if (distance >= nearest) return false;
      nearest = distance;
      disk.former_x = suspect.x;
      disk.former_y = suspect.y;
      disk.former_unexplained = 1 - suspect.explained;
      return false;
    });
    added.push_back(disk);
  }
  const Nearby near_fresh = nearby(added, near);
  std::vector<std::uint8_t> back(suspects.size(), 0);
  for (std::size_t i = 0; i < suspects.size(); ++i) {
    const ModelDisk& disk = suspects[i];
    back[i] = !near_fresh.any_near(disk.x, disk.y) &&
              !near_suspects.any_near(disk.x, disk.y, [&](std::size_t other) { return other < i && back[other]; });
    if (back[i]) added.push_back(disk);
  }
  for (ModelDisk& disk : added) {
    disk.quiet_sweeps = 0;
    fit.subtract(disk.x, disk.y, 1.0F);
  }
  const Nearby all_kept = nearby(kept, 2 * fit.reach());
  for (const auto* changed_ones : {&added, &suspects})
    for (const ModelDisk& disk : *changed_ones) wake(all_kept, kept, disk);
  const std::size_t changed = std::max(suspects.size(), added.size());
  if (changed)
    for (ModelDisk& disk : kept) disk.quiet_sweeps = 0;
  kept.insert(kept.end(), added.begin(), added.end());
  std::sort(kept.begin(), kept.end(), [](const ModelDisk& one, const ModelDisk& other) {
    if (one.y != other.y) return one.y < other.y;
    return one.x < other.x;
  });
  disks = std::move(kept);
  return changed;
}

// After a few sweeps: beads moved by repair() that explain no more than before go back where they were.
// True if there was one.
bool settle(JointFit& fit, std::vector<ModelDisk>& disks, double radius) {
  constexpr double must_fall_to = 0.7;
  const auto moved = [](const ModelDisk& disk) { return disk.former_unexplained >= 0; };
  if (std::none_of(disks.begin(), disks.end(), moved)) return false;
  fit.judge(disks, radius + 1);
  bool went_back = false;
  for (ModelDisk& disk : disks) {
    if (disk.former_unexplained >= 0 && 1 - disk.explained > must_fall_to * disk.former_unexplained) {
      fit.subtract(disk.x, disk.y, -1.0F);
      disk.x = disk.former_x;
      disk.y = disk.former_y;
      disk.quiet_sweeps = 0;
      disk.last_step = ModelDisk().last_step;
      fit.subtract(disk.x, disk.y, 1.0F);
      went_back = true;
    }
    disk.former_unexplained = -1;
  }
  if (went_back) fit.judge(disks, radius + 1);
  return went_back;
}

// Share of the ring around a disk, as far as it lies in the frame, in which something is left that no bead explains.
double unexplained_around(const JointFit& fit, const ModelDisk& disk, double radius, double edge, double noise) {
  const double from = radius + edge + 0.5, to = std::max(from + 1.5, 1.35 * radius);
  const float strong = static_cast<float>(std::max(0.3, 3 * noise));
  std::size_t count = 0, left = 0;
  for (int row = std::max(0, static_cast<int>(std::ceil(disk.y - to)));
       row <= std::min(fit.height() - 1, static_cast<int>(std::floor(disk.y + to))); ++row)
    for (int column = std::max(0, static_cast<int>(std::ceil(disk.x - to)));
         column <= std::min(fit.width() - 1, static_cast<int>(std::floor(disk.x + to))); ++column) {
      const double distance = std::hypot(column - disk.x, row - disk.y);
      if (distance < from || distance > to || unseen(fit.residual(column, row))) continue;
      ++count;
      left += fit.residual(column, row) > strong;
    }
  return count ? static_cast<double>(left) / static_cast<double>(count) : 0;
}
constexpr double most_unexplained_around = 0.12;

// A Newton step of all beads together that are not still yet, then sweeps, at most `sweeps`, for the few that have a
// longer way to go (cut ones outside the frame) and those they touch. True when nothing moves by more than the
// tolerance any more.
bool step_all(JointFit& fit, const GrayFrame& flat, std::vector<ModelDisk>& disks, double tolerance, double bound,
              int sweeps) {
  constexpr double quadratic = 10;  // what a step together leaves is less than a tenth of it
  constexpr double longest_step = 0.5;
  const double still = quadratic * tolerance;
  if (fit.step_together(flat, disks, longest_step, bound, still) < still) return true;
  std::vector<std::size_t> far;
  for (std::size_t i = 0; i < disks.size(); ++i) {
    disks[i].quiet_sweeps = 2;
    if (disks[i].last_step >= longest_step) far.push_back(i);
  }
  const bool few = 50 * far.size() <= disks.size() && !far.empty();
  if (few) {
    const Nearby near = nearby(disks, 2 * fit.reach());
    for (const std::size_t i : far)
      near.any_near(disks[i].x, disks[i].y, [&](std::size_t other) {
        disks[other].quiet_sweeps = 0;
        return false;
      });
  }
  for (int sweep = 0; few && sweep < sweeps; ++sweep)
    if (fit.sweep(disks, longest_step, tolerance, bound) < tolerance) break;
  return false;
}

}  // namespace

namespace {

// Of a radius told from the rims of `beads` beads under noise `spread` (contrast units), with `doubt` about the
// shading.
double radius_error(const FinderCalibration& calibration, double spread, double beads, double doubt) {
  // The rim of each disk, 2 pi R px long, sees its level change by 1/(2 sqrt(pi) edge) per px^2; 0.002 px is what the
  // model is good to.
  const double information = beads * 2 * 3.14159265 * calibration.rim_radius_px /
                             (2 * std::sqrt(3.14159265) * std::max(0.3, calibration.edge_width_px));
  return std::hypot(spread / std::sqrt(information), 0.002, doubt);
}

// The same frame read as one encoded for display: put back into light, where rims of touching beads add up, the bead
// learned there, and the frame it makes encoded again.
struct ReadingInLight {
  BeadProfile profile;  // of light
  double noise = 0;     // contrast units of light
  // What remains where rims are, in squares of grey levels: of this reading, and of the levels as recorded.
  double unexplained = 0, unexplained_as_recorded = 0;
  std::size_t pixels = 0;
};
ReadingInLight read_in_light(const GrayFrame& frame, const JointFit& as_recorded, const LightField& light,
                             const std::vector<ModelDisk>& disks, const BeadProfile& profile, double radius,
                             double edge, double knot) {
  double brightest = 1;
  for (std::size_t k = 0; k < light.background.size(); ++k)
    brightest = std::max({brightest, static_cast<double>(light.background[k]),
                          static_cast<double>(light.background[k] + light.contrast[k])});
  const auto to_light = [&](double level) { return std::pow(std::max(0.0, level) / brightest, 1 / display_exponent); };
  // Levels come in a few hundred values: a table is as good.
  constexpr int parts = 8, highest = 512 * parts;
  std::vector<float> table_of_light(highest + 2), table_of_levels(4097);
  for (std::size_t k = 0; k < table_of_light.size(); ++k)
    table_of_light[k] = static_cast<float>(to_light(brightest * static_cast<double>(k) / (highest / 2)));
  for (std::size_t k = 0; k < table_of_levels.size(); ++k)
    table_of_levels[k] = static_cast<float>(brightest * std::pow(static_cast<double>(k) / 2048, display_exponent));
  const auto look_up = [](const std::vector<float>& table, float place) {
    const float inside = std::clamp(place, 0.0F, static_cast<float>(static_cast<int>(table.size()) - 2));
    const auto cell = static_cast<std::size_t>(inside);
    return table[cell] + (inside - static_cast<float>(static_cast<int>(cell))) * (table[cell + 1] - table[cell]);
  };
  GrayFrame in_light = frame;
  const float per_level = static_cast<float>(highest / 2 / brightest);
  for (float& level : in_light.pixels)
    if (!unseen(level)) level = look_up(table_of_light, level * per_level);
  LightField field = light;
  for (std::size_t k = 0; k < light.background.size(); ++k) {
    const double background = to_light(static_cast<double>(light.background[k]));
    field.background[k] = static_cast<float>(background);
    field.contrast[k] =
        static_cast<float>(to_light(static_cast<double>(light.background[k] + light.contrast[k])) - background);
  }
  ReadingInLight reading;
  reading.profile = profile;
  reading.profile.fourth_harmonic.assign(profile.fourth_harmonic.size(), 0.0F);
  reading.profile.asymmetry = nullptr;
  const double background = mean_background(light), contrast = mean_contrast(light);
  const double from = to_light(background), span = to_light(background + contrast) - from;
  if (!(std::abs(span) > 0.02)) return reading;
  for (float& level : reading.profile.level)
    level = static_cast<float>((to_light(background + contrast * static_cast<double>(level)) - from) / span);
  const GrayFrame flat = flatten(in_light, field);
  JointFit fit(flat);
  constexpr int rounds = 3;
  for (int round = 0;; ++round) {
    const ProfileTable table(reading.profile, radius, edge, 0);
    fit.set_table(&table);
    fit.reset(flat, disks);
    if (round == rounds) break;
    reading.profile = learn_profile({&fit}, {&disks}, reading.profile, reading.profile.reach_px(), knot, radius, false,
                                    round + 1 == rounds ? 1 : 2);
  }
  reading.noise = residual_spread(fit);
  constexpr float no_rim = 0.02F, no_bead = 0.4F;
  for (int row = 0; row < frame.height; ++row) {
    const float* left_in_light = fit.residual_row(row);
    const float* left = as_recorded.residual_row(row);
    for (int column = 0; column < frame.width; ++column) {
      const std::size_t at =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width) + static_cast<std::size_t>(column);
      if (unseen(left[column]) || std::abs(left[column]) > no_bead) continue;
      const float model = flat.pixels[at] - left_in_light[column];
      if (model < no_rim || model > 1 - no_rim || std::abs(left_in_light[column]) > no_bead) continue;
      const double here = field_at(field, field.contrast, column, row);
      const float expected =
          look_up(table_of_levels, (in_light.pixels[at] - left_in_light[column] * static_cast<float>(here)) * 2048);
      const double gap = static_cast<double>(frame.pixels[at] - expected);
      const double as_seen = static_cast<double>(left[column]) * field_at(light, light.contrast, column, row);
      ++reading.pixels;
      reading.unexplained += gap * gap;
      reading.unexplained_as_recorded += as_seen * as_seen;
    }
  }
  return reading;
}

// What remains of the frame, in squares of grey levels, once background and beads are taken out.
double unexplained_of(const JointFit& fit, const LightField& light) {
  double sum = 0;
  for (int row = 0; row < fit.height(); ++row) {
    const float* line = fit.residual_row(row);
    const auto node_row = static_cast<std::size_t>(std::min(light.rows - 1.0, row / light.spacing_px + 0.5));
    float part = 0;
    for (int column = 0; column < fit.width(); ++column) {
      const auto node = static_cast<std::size_t>(std::min(light.columns - 1.0, column / light.spacing_px + 0.5));
      if (unseen(line[column])) continue;
      const float level = line[column] * light.contrast[node_row * static_cast<std::size_t>(light.columns) + node];
      part += level * level;
    }
    sum += static_cast<double>(part);
  }
  return sum;
}

// How far inside a border its blurred edge reaches.
double border_margin(double edge) { return 0.5 + 2 * edge; }

// The level of an even area in contrast units: 0 is the background there, 1 the beads.
double level_in(const LightField& light, const SolidBorder& border, const GrayFrame& frame) {
  const double place = 0.5 * (border.from + border.to), depth = 0.5 * (border.depth_px + border.slope * place);
  const double x = border.side == FrameSide::left    ? depth
                   : border.side == FrameSide::right ? frame.width - 1 - depth
                                                     : place;
  const double y = border.side == FrameSide::top      ? depth
                   : border.side == FrameSide::bottom ? frame.height - 1 - depth
                                                      : place;
  const auto node = [&](double at, int nodes) {
    return static_cast<std::size_t>(std::clamp(at / light.spacing_px + 0.5, 0.0, nodes - 1.0));
  };
  const std::size_t at = node(y, light.rows) * static_cast<std::size_t>(light.columns) + node(x, light.columns);
  return (border.level - static_cast<double>(light.background[at])) / static_cast<double>(light.contrast[at]);
}

bool is_background(const SolidBorder& border, const LightField& light, const GrayFrame& frame) {
  constexpr double same = 0.15;
  return std::abs(level_in(light, border, frame)) < same;
}

// Takes out what has the level of the background already at first sight.
void drop_plain_background(std::vector<SolidBorder>& borders, const GrayFrame& frame, Polarity polarity) {
  if (borders.empty()) return;
  const GrayFrame open = without_borders(frame, borders, 0);
  std::vector<float> levels;
  const std::size_t step = std::max<std::size_t>(1, open.pixels.size() / 40000);
  for (std::size_t k = 0; k < open.pixels.size(); k += step)
    if (!unseen(open.pixels[k])) levels.push_back(open.pixels[k]);
  if (levels.empty()) return;
  std::sort(levels.begin(), levels.end());
  const auto level_of = [&](double part) {
    return static_cast<double>(levels[static_cast<std::size_t>(part * static_cast<double>(levels.size() - 1))]);
  };
  constexpr double outermost = 0.05, same = 0.25;
  const bool dark = polarity != Polarity::bright_beads;
  const double background = level_of(dark ? 1 - outermost : outermost),
               bead = level_of(dark ? outermost : 1 - outermost);
  std::erase_if(borders, [&](const SolidBorder& border) {
    return std::abs(border.level - background) < same * std::abs(background - bead);
  });
}

}  // namespace

// Frames as learned from, flattened, and the beads in them: what the radius is told from in the end.
struct LearnedBeads {
  std::vector<GrayFrame> seen, flats;
  std::vector<std::unique_ptr<JointFit>> fits;  // their residuals
  std::vector<std::vector<ModelDisk>> disks;
  double knot = 0.25;                              // px, of the profile
  double spread = 0.1;                             // of the residuals, contrast units
  bool hold_radius = false, learn_profile = true;  // as asked for
  bool told = false;
  [[nodiscard]] std::size_t total() const {
    std::size_t sum = 0;
    for (const auto& one : disks) sum += one.size();
    return sum;
  }
};

namespace {

struct Learned {
  CalibrationResult result;
  double typical = 0;      // share of the contrast that a good bead explains
  bool one_sided = false;  // light from one side was allowed for
  bool background_corrected = false;
  double unexplained = 0;  // of the first frame, grey levels squared
  bool complete = false;   // hardly more than its noise
  bool astray = false;     // the radius went as far from the estimate as it may
};

// What learning may take into account.
struct Allowed {
  bool one_sided = true;             // light from one side
  bool corrected_background = true;  // see correct_background()
};

// Learns all there is to learn but the radius behind the tone curve (see tell_radius), starting from a radius and a
// polarity, or from what was learned of nearly the same frames.
Learned learn_from(const std::vector<const GrayFrame*>& frames, const FindOptions& options,
                   const RadiusEstimate& estimate, Allowed allowed, const FinderCalibration* before = nullptr) {
  Learned all;
  CalibrationResult& result = all.result;
  FinderCalibration& calibration = result.calibration;
  calibration.width = frames.front()->width;
  calibration.height = frames.front()->height;
  calibration.polarity = estimate.polarity;
  double radius = estimate.radius_px;
  double edge = before ? before->edge_width_px : std::clamp(0.08 * radius, 0.6, 1.5);
  const auto beads = std::make_shared<LearnedBeads>();
  beads->hold_radius = options.hold_radius;
  beads->learn_profile = options.learn_profile;

  std::vector<const GrayFrame*> used;
  for (const GrayFrame* frame : frames)
    if (frame->width == calibration.width && frame->height == calibration.height) used.push_back(frame);
  // What is even and ends in a straight line at the border is floor, wall or lid, unless it is background.
  constexpr double usual_edge = 0.75;
  const std::vector<const GrayFrame*> recorded = used;
  std::vector<std::vector<SolidBorder>> borders;
  std::vector<GrayFrame>& seen = beads->seen;
  for (const GrayFrame* frame : used) {
    borders.push_back(find_solid_borders(*frame));
    drop_plain_background(borders.back(), *frame, calibration.polarity);
    seen.push_back(without_borders(*frame, borders.back(), -border_margin(usual_edge)));
  }
  LightField light = estimate_light(seen.front(), radius, calibration.polarity);
  for (std::size_t f = 0; f < used.size(); ++f) {
    std::erase_if(borders[f], [&](const SolidBorder& border) { return is_background(border, light, *used[f]); });
    complete_corners(borders[f], *used[f]);
    seen[f] = without_borders(*used[f], borders[f], border_margin(usual_edge));
    used[f] = &seen[f];
    calibration.solid_borders = calibration.solid_borders || !borders[f].empty();
  }
  BeadProfile profile = before ? before->profile : ideal_profile(radius, edge, reach_of(radius, edge));

  std::vector<GrayFrame>& flats = beads->flats;
  std::vector<std::unique_ptr<JointFit>>& fits = beads->fits;
  std::vector<std::vector<ModelDisk>>& disks = beads->disks;
  flats.resize(used.size());
  fits.resize(used.size());
  disks.resize(used.size());
  // Votes fall a little outside the rim of a shaded bead: of two radii, the one whose disks fit better.
  if (!options.hold_radius && !options.radius_px && !before) {
    const GrayFrame flat = flatten(*used.front(), light);
    const double noise = noise_of(flat);
    double best_sum = -1, best_radius = radius;
    for (const double share : {1.0, 0.95}) {
      const double trial = share * radius;
      double sum = 0;
      for (const DiskCandidate& candidate : candidates_in(flat, trial, noise, 0.5)) sum += candidate.score;
      if (sum > best_sum) {
        best_sum = sum;
        best_radius = trial;
      }
    }
    radius = best_radius;
  }
  double& spread = beads->spread;
  double typical_explained = 1;
  // Light and profile are learned in turns, and in a crystal the one can stand in for the other: what is too much light
  // between the beads passes for a wider rim. So it goes on until the light settles within what noise
  // allows, or does not settle: then there is more in the frame than beads and light.
  const int first_round = before ? 1 : 0;
  const int least_rounds = first_round + 5;
  constexpr int most_rounds = 12;
  bool settled = false;
  double last_change = 0;
  double& knot = beads->knot;
  double moved_by = 0;  // px, by the outline
  bool background_looked_at = !allowed.corrected_background;
  for (int round = first_round;; ++round) {
    const bool search = round <= 1 || (round == 2 && edge > strong_blur * radius);
    const ProfileTable table(profile, radius, edge, round <= 2 ? softening_for(edge) : softening_for(edge) * 0.6);
    std::size_t total = 0;
    for (std::size_t f = 0; f < used.size(); ++f) {
      flats[f] = flatten(*used[f], light);
      if (!fits[f]) fits[f] = std::make_unique<JointFit>(flats[f]);
      fits[f]->set_table(&table);
      if (search) {
        const double noise = noise_of(flats[f]);
        disks[f] = disks_at(round == 0 ? candidates_in(flats[f], radius, noise, least_score)
                                       : candidates_by(profile, flats[f], radius, edge, noise, least_score));
      }
      for (ModelDisk& disk : disks[f]) disk.quiet_sweeps = 0;
      fits[f]->reset(flats[f], disks[f]);
      if (round > 0) {
        if (search) fits[f]->sweep(disks[f], 0.3 * radius, 1e-5, residual_bound);
        for (int step = 0; step < 2; ++step) fits[f]->step_together(flats[f], disks[f], 0.5, residual_bound);
      }
      fits[f]->judge(disks[f], radius + 1);
      if ((round == 1 || round == 2) && repair(*fits[f], disks[f], radius, noise_of(flats[f])) > 0) {
        for (int sweep = 0; sweep < 2; ++sweep) fits[f]->sweep(disks[f], 0.2 * radius, 1e-5, residual_bound);
        settle(*fits[f], disks[f], radius);
        fits[f]->step_together(flats[f], disks[f], 0.5, residual_bound);
        fits[f]->judge(disks[f], radius + 1);
      }
      total += disks[f].size();
    }
    if (total == 0) {
      result.why_not =
          "no disks seen: circles of " + std::to_string(radius) + " px were suspected, but no filled disk fits";
      return all;
    }
    if (round == 0 && !background_looked_at) {
      background_looked_at = true;
      const double clear = 1.15 * radius + 2;
      std::vector<TileSums> open = open_background(flats.front(), disks.front(), clear);
      if (open.size() < fewest_open_tiles && !borders.front().empty()) {
        // No background is seen between the beads: what was taken for a wall, but lies beyond the background, is it.
        for (std::size_t f = 0; f < used.size(); ++f) {
          const auto removed = std::erase_if(borders[f], [&](const SolidBorder& border) {
            return level_in(light, border, seen[f]) < well_beyond_background;
          });
          if (removed == 0) continue;
          seen[f] = without_borders(*recorded[f], borders[f], border_margin(usual_edge));
          flats[f] = flatten(seen[f], light);
        }
        open = open_background(flats.front(), disks.front(), clear);
      }
      if (correct_background(light, flats.front(), open, disks.front())) {
        all.background_corrected = true;
        --round;
        continue;
      }
    }
    std::vector<double> explained;
    for (const auto& one : disks)
      for (const ModelDisk& disk : one) explained.push_back(disk.explained);
    // The better half stands for the bead: in a mixed bed the rest may be something else.
    std::sort(explained.begin(), explained.end());
    typical_explained = explained[explained.size() * 3 / 4];
    for (std::size_t f = 0; f < used.size(); ++f)
      prune(*fits[f], disks[f], radius, (round == 0 ? 0.3 : least_explained) * typical_explained);
    spread = std::max(1e-3, residual_spread(*fits.front()));
    constexpr double hopeless = 3;  // what is left is larger than the beads: light and bead run away from the frame
    if (!(spread < hopeless)) {
      result.why_not = "no disks seen: circles of " + std::to_string(radius) +
                       " px were suspected, but no bead and no light make up the frame";
      return all;
    }
    if (round + 1 == (profile.asymmetry ? 2 : 1) * most_rounds || (round + 1 >= least_rounds && settled)) break;

    std::vector<const JointFit*> fit_pointers;
    std::vector<const std::vector<ModelDisk>*> disk_pointers;
    for (std::size_t f = 0; f < used.size(); ++f) {
      fit_pointers.push_back(fits[f].get());
      disk_pointers.push_back(&disks[f]);
    }
    if (options.learn_profile || round < 2) {
      const double reach = std::max(reach_of(radius, edge), round == 0 ? 1.12 * radius + 2 : 0.0);
      knot = round == 0 ? std::clamp(0.05 * radius, 0.2, std::max(0.25, radius / 8)) : knot_for(radius, edge);
      const bool sharp = edge < 0.6 && round >= 2;
      const BeadProfile learned =
          learn_profile(fit_pointers, disk_pointers, profile, reach, knot, radius, sharp, round < 2 ? 3 : 1);
      const RimFit rim = fit_rim(learned, radius, edge);
      if (rim.good) {  // the first estimate is good to some 5 %: a fit far from it has gone astray
        const double bound = round == 0 ? 0.05 : 0.12;
        if (!options.hold_radius)
          radius = std::clamp(rim.radius_px, (1 - bound) * estimate.radius_px, (1 + bound) * estimate.radius_px);
        all.astray = !options.hold_radius && radius != rim.radius_px;
        edge = std::clamp(rim.edge_px, 0.29, std::max(0.5, 0.3 * radius));
      }
      profile = options.learn_profile ? learned : ideal_profile(radius, edge, reach_of(radius, edge));
    }
    moved_by = 0;
    if (allowed.one_sided && options.learn_profile && round >= 1 && (round <= 2 || profile.asymmetry)) {
      // Light from one side: the lit side pulls at the centres of radial beads. The outline tells where they are.
      const ProfileTable latest(profile, radius, edge, 0);
      for (std::size_t f = 0; f < used.size(); ++f) {
        fits[f]->set_table(&latest);
        fits[f]->reset(flats[f], disks[f]);
      }
      profile.asymmetry =
          learn_asymmetry(fit_pointers, disk_pointers, profile, radius, spread, profile.asymmetry ? 1 : 2);
      if (profile.asymmetry)
        if (const Outline outline = outline_of(profile, radius, edge); outline.good) {
          moved_by = std::hypot(outline.x_px, outline.y_px);
          profile = recentred(profile, outline.x_px, outline.y_px);
          for (auto& one : disks)
            for (ModelDisk& disk : one) {
              disk.x += outline.x_px;
              disk.y += outline.y_px;
            }
        }
    }
    if (round >= 1) {
      std::vector<TileSums> tiles;
      const ProfileTable latest(profile, radius, edge, 0);
      for (std::size_t f = 0; f < used.size(); ++f) {
        fits[f]->set_table(&latest);
        fits[f]->reset(flats[f], disks[f]);
        add_tile_sums(flats[f], *fits[f], spread, tiles);
      }
      const double change = refine_light(light, tiles, calibration.width, calibration.height);
      settled = (change < std::max(3e-4, 0.02 * spread) || change > 0.7 * last_change) && moved_by < 0.01;
      last_change = change;
    }
  }
  const std::size_t total = beads->total();
  if (total == 0) {
    result.why_not =
        "no disks seen: circles of " + std::to_string(radius) + " px were suspected, but none is filled like a bead";
    return all;
  }
  // What is left should be the frame's noise. Where much more is left than that, the frame shows something else.
  constexpr double most_left = 0.2;  // contrast units
  if (const double noise = noise_of(flats.front()); spread * spread > noise * noise + most_left * most_left) {
    result.why_not = "no disks seen: " + std::to_string(total) + " circles of " + std::to_string(radius) +
                     " px were suspected, but they do not make up the frame";
    return all;
  }
  calibration.radius_px = calibration.rim_radius_px = radius;
  calibration.edge_width_px = edge;
  calibration.profile = profile;
  calibration.light = light;
  calibration.contrast_level = mean_contrast(light);
  calibration.noise_level = spread * std::abs(calibration.contrast_level);
  calibration.radius_std_error_px = radius_error(calibration, spread, static_cast<double>(total), 0);
  calibration.level_deciles = level_deciles(*used.front());
  calibration.frames_used = used.size();
  calibration.disks_used = total;
  result.beads = beads;
  if (total < 5)
    calibration.warnings.push_back("Only " + std::to_string(total) +
                                   " disks to learn the bead from: its radius is uncertain.");
  all.unexplained = unexplained_of(*fits.front(), light);
  all.typical = typical_explained;
  all.one_sided = profile.asymmetry != nullptr;
  all.complete = spread < 1.5 * noise_of(flats.front()) + 0.03;
  result.found = true;
  return all;
}

}  // namespace

void tell_radius(CalibrationResult& result) {
  if (!result.found || !result.beads || result.beads->told) return;
  FinderCalibration& calibration = result.calibration;
  LearnedBeads& beads = *result.beads;
  beads.told = true;
  const double radius = calibration.rim_radius_px, edge = calibration.edge_width_px, knot = beads.knot,
               spread = beads.spread, total = static_cast<double>(beads.total());
  const BeadProfile& profile = calibration.profile;
  const LightField& light = calibration.light;
  // What the whole bed's rims tell; and where nothing explains them (the camera's tone curve bends, or what lies
  // between packed beads is neither bead nor background) those that face open background.
  double radius_doubt = 0;
  const RimChoice packed = choose_rim(profile, radius, edge, knot, spread, total, mean_background(light),
                                      std::max(0.0, mean_background(light) + mean_contrast(light)));
  const auto take = [&](const RimChoice& choice) {
    calibration.radius_px = choice.rim.radius_px;
    calibration.tone_exponent = choice.exponent;
    radius_doubt = choice.rim.std_error_px;
  };
  // Rims add up where beads touch: in light, or in levels as recorded. The one that makes up the frame is the camera's.
  bool encoded = false, linear = false;
  std::optional<RimFit> in_light;  // the radius if the camera encodes, while that is not settled
  if (!beads.hold_radius && beads.learn_profile && (!packed.rim.good || packed.exponent != 1)) {
    const ReadingInLight reading =
        read_in_light(beads.seen.front(), *beads.fits.front(), light, beads.disks.front(), profile, radius, edge, knot);
    constexpr double clearly_less = 0.9, clearly_more = 1.03, fair = 2;
    const double noise = fair * spread * mean_contrast(light), pixels = static_cast<double>(reading.pixels);
    linear = pixels > 0 && reading.unexplained > clearly_more * reading.unexplained_as_recorded &&
             reading.unexplained_as_recorded < noise * noise * pixels;
    if (pixels > 0 && reading.unexplained < clearly_more * reading.unexplained_as_recorded) {
      const RimChoice choice = choose_rim(reading.profile, radius, edge, knot, reading.noise, total, 0, 1, 0, true);
      if (choice.rim.std_error_px > 0) in_light = choice.rim;
      encoded = in_light && reading.unexplained < clearly_less * reading.unexplained_as_recorded;
      if (encoded) take({choice.rim, display_exponent});
    }
  }
  bool between_readings = false;
  const bool as_packed = packed.rim.good && !encoded && !(linear && packed.exponent != 1);
  if (!beads.hold_radius && as_packed) {
    take(packed);
    calibration.radius_of_all_rims = true;
  }
  if (!as_packed && !encoded) {  // nothing explains the rim
    constexpr double poorly_known = 0.002;
    radius_doubt = std::hypot(0.5 * (packed.rim.radius_px - radius), poorly_known * radius);
  }
  if (!beads.hold_radius && !as_packed && !encoded) {
    std::vector<const std::vector<ModelDisk>*> disk_pointers;
    for (const auto& one : beads.disks) disk_pointers.push_back(&one);
    const FreeRim free_rim = learn_free_rim(beads.flats, disk_pointers, radius, edge);
    if (free_rim.sectors >= 20) {
      const double background = mean_background(light), contrast = mean_contrast(light);
      constexpr double poor_misfit = 0.012;
      const auto choose_open = [&](bool linear_only) {
        return choose_rim(free_rim.profile, radius, edge, free_rim.profile.step_px, spread,
                          static_cast<double>(free_rim.sectors) / 16, background, std::max(0.0, background + contrast),
                          free_rim.inner_px, linear_only);
      };
      RimChoice open = choose_open(linear);
      if (open.rim.good && open.exponent != 1 && packed.exponent == 1) {  // a tone curve is every rim's
        const double curved = open.rim.radius_px;
        open = choose_open(true);
        open.rim.std_error_px = std::hypot(open.rim.std_error_px, 0.25 * (curved - open.rim.radius_px));
      }
      const ToneFit tone =
          fit_tone_exponent(free_rim.profile, background, std::max(0.0, background + contrast), radius, edge);
      const double doubt = radius_doubt;
      if (open.rim.good) {
        take(open);
        // Rims that face background and all rims should tell the same.
        const double apart = open.exponent == packed.exponent ? 0.5 * (open.rim.radius_px - packed.rim.radius_px) : 0;
        radius_doubt = std::hypot(doubt, radius_doubt, apart);
      } else if (tone.linear.good && ((tone.open && !linear) || fit_rim(profile, radius, edge).misfit > poor_misfit)) {
        constexpr double believed = 0.9;
        const double weight = linear ? 0 : tone.encoded_weight;
        calibration.tone_exponent = weight > believed ? display_exponent : 1;
        calibration.radius_px = linear ? tone.linear.radius_px : tone.radius_px;
        radius_doubt = linear ? std::hypot(doubt, 0.5 * (tone.linear.radius_px - packed.rim.radius_px))
                              : std::hypot(doubt, tone.std_error_px);
        between_readings = tone.open && !linear;
        if (weight > 1 - believed && weight < believed) {
          char text[400];
          std::snprintf(text, sizeof text,
                        "The rims do not tell whether levels grow as light does (radius %.2f px) or are encoded for "
                        "display (%.2f px): the radius is taken between the two, with an error that holds both; a "
                        "scale of your own would settle it.",
                        tone.linear.radius_px, tone.encoded.radius_px);
          calibration.warnings.emplace_back(text);
        }
      }
    }
  }
  // Rims as recorded and in light may do as well, or as badly, where hardly any touch: the radius lies between the two.
  if (!beads.hold_radius && !encoded && in_light && !between_readings &&
      (as_packed ? packed.exponent != 1 : calibration.tone_exponent == 1)) {
    const double half = 0.5 * (in_light->radius_px - calibration.radius_px);
    calibration.radius_px += half;
    radius_doubt = std::hypot(radius_doubt, half, 0.5 * in_light->std_error_px);
  }
  if (calibration.tone_exponent != 1)
    calibration.warnings.push_back(
        "Rims fall steeper on their dark side, as in pictures encoded for display: the radius is told in light, " +
        std::to_string(calibration.radius_px) + " px; taken from the recorded levels it would be " +
        std::to_string(radius) + " px.");
  calibration.radius_std_error_px = radius_error(calibration, spread, total, radius_doubt);
}

GrayFrame seen_part(const GrayFrame& frame, const FinderCalibration& calibration) {
  if (!calibration.solid_borders) return frame;
  std::vector<SolidBorder> borders = find_solid_borders(frame);
  std::erase_if(borders, [&](const SolidBorder& border) { return is_background(border, calibration.light, frame); });
  complete_corners(borders, frame);
  return without_borders(frame, borders, border_margin(calibration.edge_width_px));
}

CalibrationResult calibrate_finder(const std::vector<const GrayFrame*>& frames, const FindOptions& options) {
  CalibrationResult result = learn_finder(frames, options);
  tell_radius(result);
  return result;
}

CalibrationResult learn_again(const std::vector<const GrayFrame*>& frames, const FindOptions& options,
                              const FinderCalibration& before) {
  if (frames.empty()) throw std::invalid_argument("learn_again: there is no frame to learn from");
  for (const GrayFrame* frame : frames) require_consistent(*frame);
  RadiusEstimate estimate;
  estimate.found = true;
  estimate.radius_px = before.rim_radius_px;
  estimate.polarity = before.polarity;
  return learn_from(frames, options, estimate, {.one_sided = before.profile.asymmetry != nullptr}, &before).result;
}

CalibrationResult learn_finder(const std::vector<const GrayFrame*>& frames, const FindOptions& options) {
  CalibrationResult result;
  if (frames.empty()) {
    result.why_not = "there is no frame to learn from";
    return result;
  }
  for (const GrayFrame* frame : frames) require_consistent(*frame);
  // A first radius and the polarity.
  RadiusEstimate estimate;
  const auto open_part = [](const GrayFrame& frame) { return without_borders(frame, find_solid_borders(frame), 0); };
  if (options.radius_px && *options.radius_px > 0) {
    estimate = estimate_radius(open_part(*frames.front()), options.polarity, std::max(1.0, 0.8 * *options.radius_px),
                               1.25 * *options.radius_px);
    if (!estimate.found && options.polarity != Polarity::automatic) {
      estimate.found = true;
      estimate.polarity = options.polarity;
    }
    if (estimate.found) estimate.radius_px = *options.radius_px;
    estimate.packed_radius_px = 0;
  } else {
    for (const GrayFrame* frame : frames) {
      estimate = estimate_radius(open_part(*frame), options.polarity);
      if (estimate.found) break;
    }
  }
  if (!estimate.found && estimate.others.empty()) {
    result.why_not = "no disks seen: " + estimate.why_not;
    return result;
  }
  const auto learn_from_here = [&](RadiusEstimate from, Allowed allowed) {
    constexpr int most_starts = 3;
    Learned best = learn_from(frames, options, from, allowed);
    if (best.background_corrected && !best.complete) {
      allowed.corrected_background = false;
      Learned as_seen = learn_from(frames, options, from, allowed);
      if (as_seen.result.found && (!best.result.found || as_seen.unexplained < best.unexplained))
        best = std::move(as_seen);
      else
        allowed.corrected_background = true;
    }
    for (int start = 1; start < most_starts && best.result.found && best.astray; ++start) {
      from.radius_px = best.result.calibration.rim_radius_px;
      Learned again = learn_from(frames, options, from, allowed);
      if (!again.result.found || !again.complete || again.unexplained > 1.02 * best.unexplained) break;
      best = std::move(again);
    }
    return best;
  };
  const auto learn = [&](const RadiusEstimate& from) {
    Learned best = learn_from_here(from, {});
    if (!best.one_sided || (best.complete && !best.astray)) return best;
    // Shadows beside the beads, say, are not the beads' own light.
    Learned plain = learn_from_here(from, {.one_sided = false});
    return plain.result.found ? plain : best;
  };
  // What explains the frame little gives way to what explains it better: the bright middle of a glass bead to the
  // whole of it, say.
  const auto or_another = [&](Learned best) {
    // Of what was not seen at first, many beads must be seen clearly.
    constexpr double clearly_less = 0.5, well_explained = 0.75;
    constexpr std::size_t fewest = 20;
    const bool seen = best.result.found;
    if (options.radius_px || (best.result.found && best.complete)) return best.result;
    for (const auto& other : estimate.others) {
      RadiusEstimate from;
      from.found = true;
      from.radius_px = other.radius_px;
      from.polarity = other.polarity;
      Learned another = learn(from);
      if (!another.result.found || another.typical < well_explained || another.result.calibration.disks_used < fewest)
        continue;
      if (seen ? another.unexplained < clearly_less * best.unexplained : another.complete) best = std::move(another);
      if (best.result.found && best.complete) break;
    }
    return best.result;
  };
  if (!estimate.found) {
    Learned nothing;
    nothing.result.why_not = "no disks seen: " + estimate.why_not;
    return or_another(std::move(nothing));
  }
  if (!(estimate.packed_radius_px > 0)) return or_another(learn(estimate));
  // It may as well be a packed bed seen from its voids. The likelier is tried first; unless it explains the frame
  // nearly down to its noise, so is the other. What was not seen at first is believed only when it does.
  // A packed bed fills a good part of what is in view.
  const auto fills = [&](const Learned& learned) {
    constexpr double fair_part = 0.25;
    const FinderCalibration& found = learned.result.calibration;
    const double disks =
        static_cast<double>(found.disks_used) / static_cast<double>(std::max<std::size_t>(1, found.frames_used));
    return disks * std::numbers::pi * found.radius_px * found.radius_px > fair_part * found.width * found.height;
  };
  RadiusEstimate packed = estimate;
  packed.radius_px = estimate.packed_radius_px;
  packed.polarity = estimate.packed_polarity;
  if (estimate.packed_likely) {
    Learned as_packed = learn(packed);
    if (as_packed.result.found && as_packed.complete && fills(as_packed)) return as_packed.result;
    return or_another(learn(estimate));
  }
  Learned as_seen = learn(estimate);
  if (as_seen.result.found && as_seen.complete) return as_seen.result;
  Learned as_packed = learn(packed);
  const bool better = !as_seen.result.found || as_packed.unexplained < as_seen.unexplained;
  return as_packed.result.found && as_packed.complete && fills(as_packed) && better ? as_packed.result
                                                                                    : or_another(std::move(as_seen));
}

FindResult find_disks(const GrayFrame& frame, const FinderCalibration& calibration, const FindOptions& options) {
  require_consistent(frame);
  FindResult result;
  if (frame.width != calibration.width || frame.height != calibration.height) {
    result.why_nothing = "the frame is " + std::to_string(frame.width) + " x " + std::to_string(frame.height) +
                         " px, the film was learned at " + std::to_string(calibration.width) + " x " +
                         std::to_string(calibration.height) + " px";
    return result;
  }
  const double radius = calibration.rim_radius_px, edge = calibration.edge_width_px;
  const GrayFrame seen = seen_part(frame, calibration);
  result.light = light_at_first_sight(seen, calibration);
  GrayFrame flat = flatten(seen, calibration.light, result.light);
  const double noise = std::max(1e-3, calibration.noise_level / std::max(1e-6, std::abs(calibration.contrast_level)));
  std::vector<ModelDisk> disks = disks_at(candidates_by(calibration.profile, flat, radius, edge, noise, least_score));
  const double contrast = std::abs(calibration.contrast_level);
  if (disks.empty()) {
    result.why_nothing = "no place in the frame looks like a bead of radius " + std::to_string(radius) + " px";
    return result;
  }
  const ProfileTable soft(calibration.profile, radius, edge, softening_for(edge));
  const ProfileTable exact(calibration.profile, radius, edge, 0.6 * softening_for(edge));
  JointFit fit(flat);
  fit.set_table(&exact);
  fit.reset(flat, disks);
  const double tolerance = std::clamp(0.006 * noise / 0.1, 6e-4, 4e-3);
  std::size_t dropped = 0;
  bool repaired = false;
  const double bound = std::max(residual_bound, 4 * noise);
  for (int sweep = 0; sweep < options.joint_fit_sweeps; ++sweep) {
    fit.set_table(sweep < 2 ? &soft : &exact);
    if (sweep == 2)
      for (ModelDisk& disk : disks) disk.last_step = ModelDisk().last_step;  // still by the soft table only
    bool converged = false;
    if (sweep < 2) {
      fit.sweep(disks, sweep == 0 ? 0.3 * radius : 0.5, tolerance, bound);
    } else {
      converged = step_all(fit, flat, disks, tolerance, bound, options.joint_fit_sweeps - sweep - 1);
    }
    if (sweep == 1) {
      const FrameLight own = light_of_frame(flat, fit, noise);
      if (!own.plain()) {
        result.light = {result.light.shift + result.light.gain * own.shift, result.light.gain * own.gain};
        flat = flatten(seen, calibration.light, result.light);
        fit.reset(flat, disks);
      }
    }
    if (sweep == 1 || (sweep == 4 && repaired)) {
      fit.judge(disks, radius + 1);
      const std::size_t pruned = prune(fit, disks, radius, faintly_explained);
      dropped += pruned;
      if (pruned > 0) fit.judge(disks, radius + 1);
      repaired = repair(fit, disks, radius, noise) > 0;
      converged = converged && !repaired;
    } else if (sweep == 3 && repaired) {
      converged = !settle(fit, disks, radius) && converged;
    }
    if (converged) break;
  }
  fit.judge(disks, radius + 1);
  const std::size_t dropped_last = prune(fit, disks, radius, faintly_explained);
  if (!settle(fit, disks, radius) && dropped_last > 0) fit.judge(disks, radius + 1);
  dropped += dropped_last;

  // A dark band at the border, a floor say, can be laid out with cut beads; but a bead has something else around it.
  const std::size_t before_bands = disks.size();
  std::vector<ModelDisk> in_bands, outside_bands;
  for (const ModelDisk& disk : disks) {
    const bool cut =
        disk.x < radius || disk.y < radius || disk.x > frame.width - 1 - radius || disk.y > frame.height - 1 - radius;
    const bool in_band = cut && unexplained_around(fit, disk, radius, edge, noise) > most_unexplained_around;
    (in_band ? in_bands : outside_bands).push_back(disk);
  }
  for (const ModelDisk& band : in_bands) fit.subtract(band.x, band.y, -1.0F);
  disks = std::move(outside_bands);
  const auto wake_near = [&](const std::vector<ModelDisk>& changed) {
    const Nearby near = nearby(disks, 2 * fit.reach());
    for (const ModelDisk& disk : changed) wake(near, disks, disk);
  };
  wake_near(in_bands);
  dropped += before_bands - disks.size();

  std::vector<double> explained;
  for (const ModelDisk& disk : disks) explained.push_back(disk.explained);
  const double typical = std::max(0.3, median_of(explained));
  // A bead of another size, modelled as one of these, pushes its neighbours about; one half hidden holds them in place.
  // What is doubtful is taken out, and stays out where its neighbours then fit better.
  constexpr int most_steps = 4;
  const auto fit_again = [&] {
    for (int step = 0; step < std::min(most_steps, options.joint_fit_sweeps); ++step)
      if (step_all(fit, flat, disks, tolerance, bound, options.joint_fit_sweeps)) break;
    fit.judge(disks, radius + 1);
  };
  std::vector<ModelDisk> taken_out;
  std::erase_if(disks, [&](const ModelDisk& disk) {
    if (disk.explained >= least_explained * typical) return false;
    fit.subtract(disk.x, disk.y, -1.0F);
    taken_out.push_back(disk);
    return true;
  });
  if (!taken_out.empty() || dropped_last > 0 || !in_bands.empty()) {
    const std::vector<ModelDisk> before = disks;
    wake_near(taken_out);
    fit_again();
    std::vector<ModelDisk> put_back;
    const Nearby near_before = nearby(before, 2.6 * radius);
    for (const ModelDisk& disk : taken_out) {
      double gain = 0;
      near_before.any_near(disk.x, disk.y, [&](std::size_t i) {
        gain += disks[i].explained - before[i].explained;
        return false;
      });
      const bool reported = disk.explained >= 0.5 * typical && options.keep_half_hidden;
      if (gain > 0 && !reported) {
        ++dropped;
        continue;
      }
      fit.subtract(disk.x, disk.y, 1.0F);
      disks.push_back(disk);
      put_back.push_back(disk);
    }
    wake_near(put_back);
    if (!put_back.empty()) fit_again();
  }
  if (options.learn_rim) {
    std::vector<ModelDisk> clear;
    for (const ModelDisk& disk : disks)
      if (disk.explained >= least_explained * typical) clear.push_back(disk);
    result.profile_beads = clear.size();
    if (!clear.empty())
      result.profile = learn_profile({&fit}, {&clear}, calibration.profile, calibration.profile.reach_px(),
                                     knot_for(radius, edge), radius, false, 1);
  }
  double residual_sum = 0;
  std::size_t residual_count = 0;
  const double left = options.roi ? options.roi->left : 0, top = options.roi ? options.roi->top : 0;
  const double right = options.roi ? options.roi->left + options.roi->width : frame.width;
  const double bottom = options.roi ? options.roi->top + options.roi->height : frame.height;
  for (const ModelDisk& disk : disks) {
    const double share = disk.explained / typical;
    const bool inside = disk.x >= left - 0.5 && disk.y >= top - 0.5 && disk.x < right - 0.5 && disk.y < bottom - 0.5;
    const bool doubtful = share < least_explained;
    if (share < 0.5 || (doubtful && !options.keep_half_hidden)) {
      ++dropped;
      continue;
    }
    if (!inside) continue;
    FoundDisk found;
    found.x_px = disk.x;
    found.y_px = disk.y;
    found.radius_px = calibration.radius_px;
    const double determinant = disk.hessian_xx * disk.hessian_yy - disk.hessian_xy * disk.hessian_xy;
    if (determinant > 0) {
      found.variance_x = noise * noise * disk.hessian_yy / determinant;
      found.variance_y = noise * noise * disk.hessian_xx / determinant;
      found.covariance_xy = -noise * noise * disk.hessian_xy / determinant;
    }
    found.quality = std::clamp(share, 0.0, 1.0);
    found.contrast = disk.amplitude;
    found.cut = disk.x - radius < left - 0.5 || disk.y - radius < top - 0.5 || disk.x + radius > right - 0.5 ||
                disk.y + radius > bottom - 0.5;
    found.half_hidden = doubtful || disk.rim_explained < 0.4 * typical;
    residual_sum += 1 - disk.explained;
    ++residual_count;
    result.disks.push_back(found);
  }
  std::sort(result.disks.begin(), result.disks.end(), [](const FoundDisk& a, const FoundDisk& b) {
    if (a.y_px != b.y_px) return a.y_px < b.y_px;
    return a.x_px < b.x_px;
  });
  result.rejected = dropped;
  result.steps = fit.steps();
  if (residual_count)
    result.residual_level =
        contrast * result.light.gain * std::sqrt(std::max(0.0, residual_sum / static_cast<double>(residual_count)));
  if (result.disks.empty())
    result.why_nothing = std::to_string(dropped) + " places were tried, but none is filled like a bead of radius " +
                         std::to_string(radius) + " px";
  return result;
}

FindResult find_disks(const GrayFrame& frame, const FindOptions& options, FinderCalibration* calibration_found) {
  const CalibrationResult calibrated = calibrate_finder({&frame}, options);
  if (!calibrated.found) {
    FindResult nothing;
    nothing.why_nothing = calibrated.why_not;
    return nothing;
  }
  if (calibration_found) *calibration_found = calibrated.calibration;
  return find_disks(frame, calibrated.calibration, options);
}

void RadiusFromFrames::add(const FindResult& found) {
  if (found.profile_beads == 0) return;
  if (sums_.empty()) {
    step_px_ = found.profile.step_px;
    sums_.assign(found.profile.level.size(), 0.0);
  }
  if (found.profile.level.size() != sums_.size()) return;
  for (std::size_t k = 0; k < sums_.size(); ++k)
    sums_[k] += static_cast<double>(found.profile_beads) * static_cast<double>(found.profile.level[k]);
  beads_ += found.profile_beads;
  ++frames_;
}

void RadiusFromFrames::refine(FinderCalibration& calibration) const {
  if (frames_ < 2 || !calibration.radius_of_all_rims) return;
  BeadProfile mean;
  mean.step_px = step_px_;
  for (const double sum : sums_) mean.level.push_back(static_cast<float>(sum / static_cast<double>(beads_)));
  const double contrast = calibration.contrast_level, background = mean_background(calibration.light);
  const double spread = calibration.noise_level / std::max(1e-6, std::abs(contrast));
  const double beads = static_cast<double>(beads_);
  const RimChoice choice = choose_rim(mean, calibration.rim_radius_px, calibration.edge_width_px,
                                      knot_for(calibration.rim_radius_px, calibration.edge_width_px), spread, beads,
                                      background, std::max(0.0, background + contrast));
  if (!choice.rim.good || choice.exponent != calibration.tone_exponent) return;
  calibration.radius_px = choice.rim.radius_px;
  calibration.radius_std_error_px = radius_error(calibration, spread, beads, choice.rim.std_error_px);
}

GrayFrame residual_frame(const GrayFrame& frame, const FindResult& found, const FinderCalibration& calibration) {
  require_consistent(frame);
  if (frame.width != calibration.width || frame.height != calibration.height)
    throw std::invalid_argument("residual_frame: the frame has not the size of the film's frames");
  const GrayFrame flat = flatten(seen_part(frame, calibration), calibration.light, found.light);
  const ProfileTable table(calibration.profile, calibration.rim_radius_px, calibration.edge_width_px, 0);
  JointFit fit(flat);
  fit.set_table(&table);
  for (const FoundDisk& disk : found.disks) fit.subtract(disk.x_px, disk.y_px, 1.0F);
  GrayFrame residual = fit.residual_image();
  for (float& level : residual.pixels)
    level = unseen(level) ? 0.0F : level * static_cast<float>(found.light.gain * calibration.contrast_level);
  return residual;
}

}  // namespace shakebed::ingest
