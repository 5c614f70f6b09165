#include "ingest/find/bed_light.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/frames/smooth_field.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

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

void add_tile_sums(const GrayFrame& flat, const JointFit& fit, double spread, std::vector<TileSums>& tiles) {
  constexpr int side = 32;
  const float bound = static_cast<float>(std::max(0.1, 4 * spread));
  for (int top = 0; top < flat.height; top += side)
    for (int left = 0; left < flat.width; left += side) {
      const int bottom = std::min(flat.height, top + side), right = std::min(flat.width, left + side);
      TileSums tile;
      tile.u = static_cast<double>(left + right) / flat.width - 1;
      tile.v = static_cast<double>(top + bottom) / flat.height - 1;
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
      TileSums tile;
      tile.u = 2 * (u / static_cast<double>(levels.size()) + 0.5) / flat.width - 1;
      tile.v = 2 * (v / static_cast<double>(levels.size()) + 0.5) / flat.height - 1;
      tile.flat = static_cast<double>(median_of(levels));
      tiles.push_back(tile);
    }
  return tiles;
}

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

}  // namespace shakebed::ingest
