#include "ingest/calibrate/flatten.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/frames/smooth_field.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

std::size_t polynomial_terms(int order) { return static_cast<std::size_t>((order + 1) * (order + 2) / 2); }

void polynomial_values(double u, double v, int order, double* values) {
  // Chebyshev T_i(u) T_j(v), i + j <= order.
  double along_u[9], along_v[9];
  along_u[0] = along_v[0] = 1;
  along_u[1] = u;
  along_v[1] = v;
  for (int k = 2; k <= order; ++k) {
    along_u[k] = 2 * u * along_u[k - 1] - along_u[k - 2];
    along_v[k] = 2 * v * along_v[k - 1] - along_v[k - 2];
  }
  std::size_t term = 0;
  for (int total = 0; total <= order; ++total)
    for (int i = total; i >= 0; --i) values[term++] = along_u[i] * along_v[total - i];
}

bool solve_symmetric(std::vector<double>& matrix, std::vector<double>& right, std::size_t size) {
  // Cholesky in place.
  for (std::size_t j = 0; j < size; ++j) {
    double diagonal = matrix[j * size + j];
    for (std::size_t k = 0; k < j; ++k) diagonal -= matrix[j * size + k] * matrix[j * size + k];
    if (!(diagonal > 0)) return false;
    diagonal = std::sqrt(diagonal);
    matrix[j * size + j] = diagonal;
    for (std::size_t i = j + 1; i < size; ++i) {
      double sum = matrix[i * size + j];
      for (std::size_t k = 0; k < j; ++k) sum -= matrix[i * size + k] * matrix[j * size + k];
      matrix[i * size + j] = sum / diagonal;
    }
  }
  for (std::size_t i = 0; i < size; ++i) {
    double sum = right[i];
    for (std::size_t k = 0; k < i; ++k) sum -= matrix[i * size + k] * right[k];
    right[i] = sum / matrix[i * size + i];
  }
  for (std::size_t i = size; i-- > 0;) {
    double sum = right[i];
    for (std::size_t k = i + 1; k < size; ++k) sum -= matrix[k * size + i] * right[k];
    right[i] = sum / matrix[i * size + i];
  }
  return true;
}

GrayFrame reduced(const GrayFrame& frame, int factor) {
  if (factor <= 1) return frame;
  GrayFrame small;
  small.width = frame.width / factor;
  small.height = frame.height / factor;
  small.pixels.resize(static_cast<std::size_t>(small.width) * static_cast<std::size_t>(small.height));
  const float scale = 1.0F / static_cast<float>(factor * factor);
  std::vector<float> line(static_cast<std::size_t>(frame.width));
  for (int row = 0; row < small.height; ++row) {
    const float* from =
        frame.pixels.data() + static_cast<std::size_t>(row * factor) * static_cast<std::size_t>(frame.width);
    std::copy(from, from + frame.width, line.begin());
    for (int k = 1; k < factor; ++k) {
      from += frame.width;
      for (int column = 0; column < frame.width; ++column) line[static_cast<std::size_t>(column)] += from[column];
    }
    float* to = small.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(small.width);
    if (factor == 2) {
      for (int column = 0; column < small.width; ++column)
        to[column] =
            scale * (line[static_cast<std::size_t>(2 * column)] + line[static_cast<std::size_t>(2 * column + 1)]);
    } else {
      for (int column = 0; column < small.width; ++column) {
        float sum = 0;
        for (int k = 0; k < factor; ++k) sum += line[static_cast<std::size_t>(column * factor + k)];
        to[column] = scale * sum;
      }
    }
  }
  return small;
}

GrayFrame smoothed(const GrayFrame& frame) {
  GrayFrame smooth = frame;
  const std::size_t width = static_cast<std::size_t>(frame.width);
  std::vector<float> column_sum(width);
  for (int row = 1; row + 1 < frame.height; ++row) {
    const float* a = frame.pixels.data() + static_cast<std::size_t>(row - 1) * width;
    const float* b = a + width;
    const float* c = b + width;
    for (std::size_t k = 0; k < width; ++k) column_sum[k] = a[k] + 2 * b[k] + c[k];
    float* to = smooth.pixels.data() + static_cast<std::size_t>(row) * width;
    for (std::size_t k = 1; k + 1 < width; ++k)
      to[k] = 0.0625F * (column_sum[k - 1] + 2 * column_sum[k] + column_sum[k + 1]);
  }
  return smooth;
}

namespace {

GrayFrame box3(const GrayFrame& frame) {
  GrayFrame smooth = frame;
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      float sum = 0;
      int count = 0;
      for (int y = std::max(0, row - 1); y <= std::min(frame.height - 1, row + 1); ++y)
        for (int x = std::max(0, column - 1); x <= std::min(frame.width - 1, column + 1); ++x) {
          sum += frame.at(x, y);
          ++count;
        }
      smooth.pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width) +
                    static_cast<std::size_t>(column)] = sum / static_cast<float>(count);
    }
  return smooth;
}

struct BlockValue {
  double u, v, value;
  double median = 0;   // of the block
  bool exact = false;  // not an envelope: to be met from both sides
};

// A polynomial that hugs the values from above (side = +1) or below (side = -1): points on the inner side hardly count.
std::vector<double> hugging_polynomial(const std::vector<BlockValue>& blocks, int order, double side) {
  const std::size_t terms = polynomial_terms(order);
  std::vector<double> coefficients(terms, 0.0);
  std::vector<double> basis(terms);
  std::vector<double> sorted;
  for (const BlockValue& block : blocks) sorted.push_back(block.value);
  std::sort(sorted.begin(), sorted.end());
  const double start = side > 0 ? sorted[sorted.size() * 9 / 10] : sorted[sorted.size() / 10];
  const double spread = std::max(1.0, sorted.back() - sorted.front());
  coefficients[0] = start;
  for (int round = 0; round < 25; ++round) {
    std::vector<double> matrix(terms * terms, 0.0), right(terms, 0.0);
    for (const BlockValue& block : blocks) {
      polynomial_values(block.u, block.v, order, basis.data());
      double predicted = 0;
      for (std::size_t i = 0; i < terms; ++i) predicted += coefficients[i] * basis[i];
      const double gap = side * (block.value - predicted);  // > 0: outside, must be followed
      const double tolerance = 0.03 * spread;
      const double weight = block.exact || gap > -tolerance
                                ? 1.0
                                : 0.0005 + 0.9995 * std::exp(-std::pow((gap + tolerance) / tolerance, 2));
      for (std::size_t i = 0; i < terms; ++i) {
        right[i] += weight * basis[i] * block.value;
        for (std::size_t j = 0; j <= i; ++j) matrix[i * terms + j] += weight * basis[i] * basis[j];
      }
    }
    for (std::size_t i = 0; i < terms; ++i) matrix[i * terms + i] += 1e-6 + (i ? 1e-3 * matrix[0] : 0);
    if (!solve_symmetric(matrix, right, terms)) break;
    double change = 0;
    for (std::size_t i = 0; i < terms; ++i) change += std::abs(right[i] - coefficients[i]);
    coefficients = right;
    if (change < 1e-3) break;
  }
  return coefficients;
}

double value_of(const std::vector<double>& fit, double u, double v) {
  std::array<double, 6> values{};
  polynomial_values(u, v, 2, values.data());
  double sum = 0;
  for (std::size_t i = 0; i < fit.size(); ++i) sum += fit[i] * values[i];
  return sum;
}

int order_for(std::size_t blocks) { return blocks >= 40 ? 2 : blocks >= 12 ? 1 : 0; }

// The brightest and the darkest levels of square blocks, those of the same block side by side.
struct Blocks {
  std::vector<BlockValue> upper, lower;

  // Of what is seen between the rows and columns; left out where fewer than `fewest` pixels are.
  void add(const GrayFrame& small, int top, int left, int bottom, int right, std::size_t fewest) {
    std::vector<float> levels;
    for (int row = top; row < bottom; ++row)
      for (int column = left; column < right; ++column)
        if (!unseen(small.at(column, row))) levels.push_back(small.at(column, row));
    if (levels.size() < std::max<std::size_t>(1, fewest)) return;
    const auto pick = [&](double part) { return static_cast<double>(quantile_of(levels, part)); };
    const double u = 2 * (0.5 * (left + right)) / small.width - 1, v = 2 * (0.5 * (top + bottom)) / small.height - 1;
    const double median = pick(0.5);
    upper.push_back({u, v, pick(0.97), median, false});
    lower.push_back({u, v, pick(0.03), median, false});
  }
};

Blocks blocks_of(const GrayFrame& small, int block) {
  Blocks blocks;
  for (int top = 0; top < small.height; top += block)
    for (int left = 0; left < small.width; left += block) {
      const int bottom = std::min(small.height, top + block), right = std::min(small.width, left + block);
      const int area = (bottom - top) * (right - left);
      if (area * 3 < block * block && !blocks.upper.empty()) continue;
      blocks.add(small, top, left, bottom, right, static_cast<std::size_t>(area / 3));
    }
  if (blocks.upper.empty()) blocks.add(small, 0, 0, small.height, small.width, 1);  // hardly anything in view
  if (blocks.upper.empty()) throw std::invalid_argument("estimate_light: no pixel of the frame may be used");
  return blocks;
}

// Polynomials through the levels of the background and of the beads.
struct Envelopes {
  std::vector<double> background, bead;
};

// The beads' envelope follows from the blocks that hold beads: those with a fair share of the largest contrast. A block
// of little contrast is either empty, and gives the background by its median, noise or not, or so full of beads that
// hardly any background shows; the nearer envelope decides.
Envelopes envelopes_of(const Blocks& blocks, bool dark) {
  constexpr double fair_share = 0.3;
  std::vector<double> spans;
  for (std::size_t k = 0; k < blocks.upper.size(); ++k) spans.push_back(blocks.upper[k].value - blocks.lower[k].value);
  std::vector<double> sorted_spans = spans;
  std::sort(sorted_spans.begin(), sorted_spans.end());
  const double largest_span =
      sorted_spans[static_cast<std::size_t>(0.98 * static_cast<double>(sorted_spans.size() - 1))];
  std::vector<BlockValue> background_side = dark ? blocks.upper : blocks.lower;
  const std::vector<BlockValue>& bead_side = dark ? blocks.lower : blocks.upper;
  std::vector<BlockValue> with_beads;
  std::vector<std::size_t> plain;
  for (std::size_t k = 0; k < spans.size(); ++k) {
    if (spans[k] >= fair_share * largest_span)
      with_beads.push_back(bead_side[k]);
    else
      plain.push_back(k);
  }
  const double background_direction = dark ? 1 : -1;
  const auto fitted = [&] {
    return Envelopes{hugging_polynomial(background_side, order_for(background_side.size()), background_direction),
                     hugging_polynomial(with_beads, order_for(with_beads.size()), -background_direction)};
  };
  const Envelopes first = fitted();
  for (const std::size_t k : plain) {
    BlockValue& block = background_side[k];
    const double to_background = std::abs(block.median - value_of(first.background, block.u, block.v));
    const double to_bead = std::abs(block.median - value_of(first.bead, block.u, block.v));
    if (to_background < to_bead) {
      block.value = block.median;
      block.exact = true;
    } else {
      with_beads.push_back(bead_side[k]);
    }
  }
  return fitted();
}

}  // namespace

LightField estimate_light(const GrayFrame& frame, double radius_px, Polarity polarity) {
  if (frame.width <= 0 || frame.height <= 0 ||
      frame.pixels.size() != static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height))
    throw std::invalid_argument("estimate_light: the frame's pixel count is not width x height");
  const int factor = std::max(1, static_cast<int>(radius_px / 4));
  const GrayFrame small = radius_px < 2.5 ? frame : box3(reduced(frame, factor));
  const int block = std::max(8, static_cast<int>(std::lround(7 * radius_px / factor)));
  const bool dark = polarity != Polarity::bright_beads;
  const Envelopes envelopes = envelopes_of(blocks_of(small, block), dark);

  LightField light;
  light.spacing_px = 32;
  light.columns = static_cast<int>(std::ceil(frame.width / light.spacing_px)) + 1;
  light.rows = static_cast<int>(std::ceil(frame.height / light.spacing_px)) + 1;
  std::vector<double> contrasts;
  for (int row = 0; row < light.rows; ++row)
    for (int column = 0; column < light.columns; ++column) {
      const double u = std::min(1.0, 2 * column * light.spacing_px / frame.width - 1);
      const double v = std::min(1.0, 2 * row * light.spacing_px / frame.height - 1);
      const double background = value_of(envelopes.background, u, v), bead = value_of(envelopes.bead, u, v);
      light.background.push_back(static_cast<float>(background));
      light.contrast.push_back(static_cast<float>(bead - background));
      contrasts.push_back(std::abs(bead - background));
    }
  std::sort(contrasts.begin(), contrasts.end());
  const float least = static_cast<float>(std::max(0.5, 0.1 * contrasts[contrasts.size() / 2]));
  for (float& contrast : light.contrast) contrast = dark ? std::min(contrast, -least) : std::max(contrast, least);
  return light;
}

GrayFrame flatten(const GrayFrame& frame, const LightField& light, const FrameLight& own) {
  GrayFrame flat;
  flat.width = frame.width;
  flat.height = frame.height;
  flat.pixels.resize(frame.pixels.size());
  const std::size_t columns = static_cast<std::size_t>(light.columns);
  const std::size_t width = static_cast<std::size_t>(frame.width);
  std::vector<float> background(columns), inverse(columns);
  for (int row = 0; row < frame.height; ++row) {
    const double place = row / light.spacing_px;
    const std::size_t cell = std::min(static_cast<std::size_t>(place), static_cast<std::size_t>(light.rows - 2));
    const float part = static_cast<float>(place - static_cast<double>(cell));
    for (std::size_t k = 0; k < columns; ++k) {
      const std::size_t at = cell * columns + k;
      const float contrast = light.contrast[at] * (1 - part) + light.contrast[at + columns] * part;
      background[k] = light.background[at] * (1 - part) + light.background[at + columns] * part +
                      static_cast<float>(own.shift) * contrast;
      inverse[k] = static_cast<float>(own.gain) * contrast;
    }
    const float* from = frame.pixels.data() + static_cast<std::size_t>(row) * width;
    float* to = flat.pixels.data() + static_cast<std::size_t>(row) * width;
    const auto step = static_cast<float>(1 / light.spacing_px);
    for (std::size_t k = 0; k + 1 < columns; ++k) {
      const double start = static_cast<double>(k) * light.spacing_px;
      const int first = static_cast<int>(std::ceil(start)),
                end = std::min(frame.width, static_cast<int>(std::ceil(start + light.spacing_px)));
      const auto shift = static_cast<float>(start);
      const float b0 = background[k], b1 = (background[k + 1] - b0) * step;
      const float c0 = inverse[k], c1 = (inverse[k + 1] - c0) * step;
      for (int x = first; x < end; ++x) {
        const float t = static_cast<float>(x) - shift;
        to[x] = (from[x] - (b0 + b1 * t)) / (c0 + c1 * t);
      }
    }
    for (int x = 0; x < frame.width; ++x)
      if (unseen(from[x])) to[x] = unseen_level;
  }
  return flat;
}

}  // namespace shakebed::ingest
