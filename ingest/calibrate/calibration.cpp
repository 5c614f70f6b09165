#include "ingest/calibrate/calibration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

namespace {

// One edge pixel: place, unit gradient (towards brighter), weight.
struct EdgePixel {
  float x, y, unit_x, unit_y, weight;
};

GrayFrame halved(const GrayFrame& frame) {
  GrayFrame half;
  half.width = frame.width / 2;
  half.height = frame.height / 2;
  half.pixels.resize(static_cast<std::size_t>(half.width) * static_cast<std::size_t>(half.height));
  for (int row = 0; row < half.height; ++row) {
    const float* upper =
        frame.pixels.data() + static_cast<std::size_t>(2 * row) * static_cast<std::size_t>(frame.width);
    const float* lower = upper + frame.width;
    float* to = half.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(half.width);
    for (int column = 0; column < half.width; ++column)
      to[column] = 0.25F * (upper[2 * column] + upper[2 * column + 1] + lower[2 * column] + lower[2 * column + 1]);
  }
  return half;
}

// Gradient by Sobel's differences over 8, so that a ramp of slope 1 gives 1.
struct Gradient {
  int width = 0, height = 0;
  std::vector<float> x, y;
  [[nodiscard]] std::size_t at(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
  }
};
Gradient sobel(const GrayFrame& frame) {
  Gradient gradient;
  gradient.width = frame.width;
  gradient.height = frame.height;
  gradient.x.assign(frame.pixels.size(), 0.0F);
  gradient.y.assign(frame.pixels.size(), 0.0F);
  const std::size_t width = static_cast<std::size_t>(frame.width);
  for (int row = 1; row + 1 < frame.height; ++row) {
    const float* a = frame.pixels.data() + static_cast<std::size_t>(row - 1) * width;
    const float* b = a + width;
    const float* c = b + width;
    float* to_x = gradient.x.data() + static_cast<std::size_t>(row) * width;
    float* to_y = gradient.y.data() + static_cast<std::size_t>(row) * width;
    for (std::size_t k = 1; k + 1 < width; ++k) {
      to_x[k] = 0.125F * (a[k + 1] - a[k - 1] + 2 * (b[k + 1] - b[k - 1]) + c[k + 1] - c[k - 1]);
      to_y[k] = 0.125F * (c[k - 1] - a[k - 1] + 2 * (c[k] - a[k]) + c[k + 1] - a[k + 1]);
    }
    for (std::size_t k = 1; k + 1 < width; ++k) {  // next to what is unseen there is no telling
      constexpr float steepest = 0.01F * brightest_seen;
      const bool seen = std::abs(to_x[k]) < steepest && std::abs(to_y[k]) < steepest;
      to_x[k] = seen ? to_x[k] : 0.0F;
      to_y[k] = seen ? to_y[k] : 0.0F;
    }
  }
  return gradient;
}

float quantile(std::vector<float>& values, double fraction) {
  if (values.empty()) return 0;
  const auto place = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

// Points of a circle.
struct Point {
  float x, y;
};
std::vector<Point> circle_points(double radius) {
  const int samples = std::clamp(static_cast<int>(4 * radius), 12, 48);
  std::vector<Point> points;
  for (int k = 0; k < samples; ++k) {
    const double angle = 2 * std::numbers::pi * k / samples;
    points.push_back({static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))});
  }
  return points;
}

// Share of the rim of a circle where the gradient points along the radius with at least `threshold`.
double rim_support(const Gradient& gradient, int x, int y, double radius, const std::vector<Point>& points, float sign,
                   float threshold) {
  std::size_t supported = 0, inside = 0;
  const float centre_x = static_cast<float>(x) + 0.5F, centre_y = static_cast<float>(y) + 0.5F;
  for (const Point& point : points) {
    const float to_x = centre_x + static_cast<float>(radius) * point.x,
                to_y = centre_y + static_cast<float>(radius) * point.y;
    if (to_x < 1 || to_y < 1) continue;
    const int column = static_cast<int>(to_x), row = static_cast<int>(to_y);
    if (column >= gradient.width - 1 || row >= gradient.height - 1) continue;
    ++inside;
    const std::size_t at = gradient.at(column, row);
    const float along = sign * (gradient.x[at] * point.x + gradient.y[at] * point.y);
    const float size = std::sqrt(gradient.x[at] * gradient.x[at] + gradient.y[at] * gradient.y[at]);
    if (size > threshold && along > 0.8F * size) ++supported;
  }
  return inside < points.size() / 2 ? 0.0 : static_cast<double>(supported) / static_cast<double>(inside);
}

// The square window of at most `side` px with the most gradient: enough to tell a radius of a few px from.
GrayFrame busiest_window(const GrayFrame& frame, int side) {
  if (frame.width <= side && frame.height <= side) return frame;
  constexpr int block = 20;
  const int columns = frame.width / block, rows = frame.height / block;
  std::vector<double> sums(static_cast<std::size_t>(columns + 1) * static_cast<std::size_t>(rows + 1), 0.0);
  const auto at = [&](int column, int row) -> double& {
    return sums[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns + 1) +
                static_cast<std::size_t>(column)];
  };
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      double sum = 0;
      for (int y = row * block; y + 1 < (row + 1) * block; y += 2)
        for (int x = column * block; x + 1 < (column + 1) * block; ++x) {
          const float change =
              std::abs(frame.at(x + 1, y) - frame.at(x, y)) + std::abs(frame.at(x, y + 1) - frame.at(x, y));
          sum += unseen(change) ? 0.0 : static_cast<double>(change);
        }
      at(column + 1, row + 1) = sum + at(column, row + 1) + at(column + 1, row) - at(column, row);
    }
  const int wide = std::min(columns, side / block), high = std::min(rows, side / block);
  int best_column = 0, best_row = 0;
  double best = -1;
  for (int row = 0; row + high <= rows; ++row)
    for (int column = 0; column + wide <= columns; ++column) {
      const double sum =
          at(column + wide, row + high) - at(column, row + high) - at(column + wide, row) + at(column, row);
      if (sum > best) {
        best = sum;
        best_column = column;
        best_row = row;
      }
    }
  GrayFrame window;
  window.width = std::min(frame.width, side);
  window.height = std::min(frame.height, side);
  const int left = std::min(best_column * block, frame.width - window.width);
  const int top = std::min(best_row * block, frame.height - window.height);
  window.pixels.reserve(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height));
  for (int row = top; row < top + window.height; ++row) {
    const auto from = frame.pixels.begin() + static_cast<std::ptrdiff_t>(row) * frame.width + left;
    window.pixels.insert(window.pixels.end(), from, from + window.width);
  }
  return window;
}

struct Spacing {
  double median = 0, scatter = 0;
};
struct Candidate {
  double radius = 0, sign = 1, explained = 0, support = 0;
  std::size_t count = 0;  // of its circles
  Spacing spacing;        // of their centres, px of the frame
};

// Median distance from a place to its second nearest neighbour (of the three in a honeycomb the one in the middle), and
// half the width of its middle half; 0 for fewer than ten places.
Spacing typical_spacing(const std::vector<Point>& places) {
  if (places.size() < 10) return {};
  std::vector<float> distances;
  const std::size_t step = places.size() / 300 + 1;
  for (std::size_t i = 0; i < places.size(); i += step) {
    float nearest = 1e30F, second = 1e30F;
    for (std::size_t j = 0; j < places.size(); ++j) {
      const float dx = places[j].x - places[i].x, dy = places[j].y - places[i].y;
      const float squared = dx * dx + dy * dy;
      if (j == i || squared >= second) continue;
      second = std::max(nearest, squared);
      nearest = std::min(nearest, squared);
    }
    distances.push_back(std::sqrt(second));
  }
  const double low = static_cast<double>(quantile(distances, 0.25)),
               high = static_cast<double>(quantile(distances, 0.75));
  return {static_cast<double>(quantile(distances, 0.5)), 0.5 * (high - low)};
}

// All radii of one level of the pyramid, both polarities.
void vote(const GrayFrame& frame, double scale, double from_radius, double to_radius,
          std::vector<Candidate>& candidates) {
  if (frame.width < 5 || frame.height < 5) return;
  const Gradient gradient = sobel(frame);
  std::vector<float> sizes;
  sizes.reserve(gradient.x.size() / 2);
  const std::size_t step = std::max<std::size_t>(1, gradient.x.size() / 200000);
  for (std::size_t i = 0; i < gradient.x.size(); i += step)
    sizes.push_back(std::sqrt(gradient.x[i] * gradient.x[i] + gradient.y[i] * gradient.y[i]));
  const float strong = quantile(sizes, 0.98);
  const float quiet = quantile(sizes, 0.25) / 0.7585F;  // quantile of a Rayleigh law
  // A noise-free frame can have 98 % of its pixels without gradient: then its edges are the rest.
  const float strongest = *std::max_element(sizes.begin(), sizes.end());
  const float reference = strong > 0.1F * strongest ? strong : 0.5F * strongest;
  const float threshold = std::max({3.0F * quiet, 0.2F * reference, 1e-3F});
  std::vector<EdgePixel> edges;
  for (int row = 1; row + 1 < frame.height; ++row)
    for (int column = 1; column + 1 < frame.width; ++column) {
      const std::size_t at = gradient.at(column, row);
      const float size = std::sqrt(gradient.x[at] * gradient.x[at] + gradient.y[at] * gradient.y[at]);
      if (size < threshold) continue;
      edges.push_back({static_cast<float>(column), static_cast<float>(row), gradient.x[at] / size,
                       gradient.y[at] / size, std::min(size, reference)});
    }
  if (edges.size() < 12) return;
  constexpr std::size_t most_edges = 14000;
  std::vector<EdgePixel> chosen;
  if (edges.size() > most_edges) {  // every k-th in a shuffled-looking order keeps a share of every rim
    const std::size_t stride = edges.size() / most_edges + 1;
    for (std::size_t i = 0; i < edges.size(); i += stride) chosen.push_back(edges[i]);
  } else {
    chosen = edges;
  }

  const std::size_t width = static_cast<std::size_t>(frame.width), height = static_cast<std::size_t>(frame.height);
  std::vector<float> votes(width * height), sums(width * height);
  struct Peak {
    float score;
    int column, row;
  };
  const double ratio = 1.04;
  const int count = static_cast<int>(std::ceil(std::log(to_radius / from_radius) / std::log(ratio))) + 1;
  for (const double sign : {1.0, -1.0}) {  // +1: brighter outwards (dark beads)
    std::vector<double> sharpness(static_cast<std::size_t>(count), 0.0);
    const auto fill = [&](double radius) {
      std::fill(votes.begin(), votes.end(), 0.0F);
      const float shift = static_cast<float>(-sign * radius);
      for (const EdgePixel& edge : chosen) {
        const int column = static_cast<int>(edge.x + shift * edge.unit_x + 0.5F);
        const int row = static_cast<int>(edge.y + shift * edge.unit_y + 0.5F);
        if (column < 1 || row < 1 || column >= frame.width - 1 || row >= frame.height - 1) continue;
        votes[static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column)] += edge.weight;
      }
      std::fill(sums.begin(), sums.end(), 0.0F);
      for (std::size_t row = 1; row + 1 < height; ++row) {
        const float* a = votes.data() + (row - 1) * width;
        const float* b = a + width;
        const float* c = b + width;
        float* to = sums.data() + row * width;
        for (std::size_t k = 1; k + 1 < width; ++k)
          to[k] = a[k - 1] + a[k] + a[k + 1] + b[k - 1] + b[k] + b[k + 1] + c[k - 1] + c[k] + c[k + 1];
      }
    };
    for (int k = 0; k < count; ++k) {
      fill(from_radius * std::pow(ratio, k));
      double sum = 0;
      for (std::size_t row = 0; row < height; ++row) {
        float line = 0;
        for (std::size_t column = 0; column < width; ++column)
          line += sums[row * width + column] * sums[row * width + column];
        sum += static_cast<double>(line);
      }
      sharpness[static_cast<std::size_t>(k)] = sum;
    }
    // The sharpest radii of this level, then how much of all edges their circles explain.
    std::vector<int> maxima;
    for (int k = 0; k < count; ++k) {
      const double here = sharpness[static_cast<std::size_t>(k)];
      if (k > 0 && sharpness[static_cast<std::size_t>(k - 1)] > here) continue;
      if (k + 1 < count && sharpness[static_cast<std::size_t>(k + 1)] >= here) continue;
      maxima.push_back(k);
    }
    std::sort(maxima.begin(), maxima.end(), [&](int a, int b) {
      return sharpness[static_cast<std::size_t>(a)] > sharpness[static_cast<std::size_t>(b)];
    });
    if (maxima.size() > 3) maxima.resize(3);
    for (const int k : maxima) {
      double position = k;
      if (k > 0 && k + 1 < count) {
        const double a = sharpness[static_cast<std::size_t>(k - 1)], b = sharpness[static_cast<std::size_t>(k)],
                     c = sharpness[static_cast<std::size_t>(k + 1)];
        const double bend = a - 2 * b + c;
        if (bend < 0) position += std::clamp(0.5 * (a - c) / bend, -0.5, 0.5);
      }
      const double radius = from_radius * std::pow(ratio, position);
      fill(radius);
      const std::vector<Point> circle = circle_points(radius);
      std::vector<Peak> peaks;
      for (int row = 1; row + 1 < frame.height; ++row)
        for (int column = 1; column + 1 < frame.width; ++column) {
          const std::size_t at = gradient.at(column, row);
          const float here = sums[at];
          if (here <= 0 || here < sums[at - 1] || here <= sums[at + 1] || here < sums[at - width] ||
              here <= sums[at + width])
            continue;
          peaks.push_back({here, column, row});
        }
      std::sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) {
        if (a.score != b.score) return a.score > b.score;
        if (a.row != b.row) return a.row < b.row;
        return a.column < b.column;
      });
      if (peaks.size() > 4000) peaks.resize(4000);
      std::vector<std::uint8_t> taken(width * height, 0);
      double explained = 0, support_sum = 0, support_weight = 0;
      std::vector<Point> centres;
      const int keep_off = std::max(1, static_cast<int>(1.2 * radius));
      for (const Peak& peak : peaks) {
        const std::size_t at = gradient.at(peak.column, peak.row);
        if (taken[at]) continue;
        const double support =
            rim_support(gradient, peak.column, peak.row, radius, circle, static_cast<float>(sign), threshold);
        if (support < 0.45) continue;
        for (int row = std::max(0, peak.row - keep_off); row <= std::min(frame.height - 1, peak.row + keep_off); ++row)
          for (int column = std::max(0, peak.column - keep_off);
               column <= std::min(frame.width - 1, peak.column + keep_off); ++column)
            taken[gradient.at(column, row)] = 1;
        const double votes_here = static_cast<double>(peak.score);
        explained += votes_here;
        support_sum += support * votes_here;
        support_weight += votes_here;
        centres.push_back({static_cast<float>(peak.column), static_cast<float>(peak.row)});
      }
      double chosen_weight = 0;
      for (const EdgePixel& edge : chosen) chosen_weight += static_cast<double>(edge.weight);
      if (support_weight <= 0) continue;
      const Spacing spacing = typical_spacing(centres);
      candidates.push_back({radius * scale,
                            sign,
                            explained / chosen_weight,
                            support_sum / support_weight,
                            centres.size(),
                            {spacing.median * scale, spacing.scatter * scale}});
    }
  }
}

}  // namespace

RadiusEstimate estimate_radius(const GrayFrame& frame, Polarity polarity, double smallest_radius_px,
                               double largest_radius_px) {
  RadiusEstimate estimate;
  if (frame.width < 5 || frame.height < 5) {
    estimate.why_not = "the frame is smaller than 5 x 5 px: too small to hold a disk";
    return estimate;
  }
  if (largest_radius_px <= 0) largest_radius_px = std::min(frame.width, frame.height) / 2.2;
  std::vector<Candidate> candidates;
  GrayFrame level = frame;
  double scale = 1, low = std::max(1.0, smallest_radius_px);
  while (low < largest_radius_px && level.width >= 5 && level.height >= 5) {
    const double high = std::min(largest_radius_px, 8.5 * scale);
    if (high > low) {
      const GrayFrame window = busiest_window(level, 340);
      vote(window, scale, low / scale, high / scale, candidates);
    }
    low = 7.5 * scale;
    level = halved(level);
    scale *= 2;
  }
  const Candidate* best = nullptr;
  // A few large circles whose rims are seen in part are something else: the outline of the whole bed, say.
  const double large = 0.2 * std::min(frame.width, frame.height);
  const auto merit = [&](const Candidate& c) {
    constexpr std::size_t few = 5;
    constexpr double well_supported = 0.85, doubted = 0.01;
    const double trust = c.count < few && c.radius > large && c.support < well_supported ? doubted : 1.0;
    return trust * c.explained * c.support * c.support;
  };
  const auto allowed = [&](const Candidate& c) {
    return polarity == Polarity::automatic || (c.sign > 0) == (polarity == Polarity::dark_beads);
  };
  for (const Candidate& candidate : candidates)
    if (allowed(candidate) && (!best || merit(candidate) > merit(*best))) best = &candidate;
  // The rims of a crystal are explained as well by the small voids between its beads, of the other polarity: if circles
  // a few times larger do nearly as well, they are the beads.
  if (best) {
    constexpr double least_ratio = 2.2, most_ratio = 7, nearly = 0.4;
    const Candidate* beads = nullptr;
    for (const Candidate& candidate : candidates) {
      const double ratio = candidate.radius / best->radius;
      if (candidate.sign == best->sign || !allowed(candidate) || ratio < least_ratio || ratio > most_ratio) continue;
      if (merit(candidate) > nearly * merit(*best) && (!beads || merit(candidate) > merit(*beads))) beads = &candidate;
    }
    if (beads) best = beads;
  }
  {
    constexpr double faintest = 0.004, another = 1.15;
    constexpr std::size_t most = 4;
    std::vector<Candidate> ranked = candidates;
    std::sort(ranked.begin(), ranked.end(),
              [&](const Candidate& a, const Candidate& b) { return merit(a) > merit(b); });
    for (const Candidate& candidate : ranked) {
      const Polarity its = candidate.sign > 0 ? Polarity::dark_beads : Polarity::bright_beads;
      const auto near = [&](double radius) {
        return std::max(radius / candidate.radius, candidate.radius / radius) < another;
      };
      const bool known = std::any_of(estimate.others.begin(), estimate.others.end(),
                                     [&](const auto& other) { return other.polarity == its && near(other.radius_px); });
      if (merit(candidate) < faintest || known || !allowed(candidate) || estimate.others.size() >= most) continue;
      estimate.others.push_back({candidate.radius, its});
    }
  }
  if (!best) {
    estimate.why_not = "no circle of any radius: no rim in the frame points to a common centre";
    return estimate;
  }
  estimate.radius_px = best->radius;
  estimate.polarity = best->sign > 0 ? Polarity::dark_beads : Polarity::bright_beads;
  estimate.score = best->explained * best->support;
  // Three touching beads leave a void of 0.15 radii or, blurred, up to 0.4, and the voids of a crystal are 1.155 radii
  // apart; touching beads of that size would be 2 of their radii apart.
  constexpr double fair = 0.3, least_spread = 2.6, most_spread = 9, same = 0.1;
  const Candidate* voids = nullptr;
  for (const Candidate& candidate : candidates) {
    const double spread = candidate.spacing.median / candidate.radius;
    if (spread < least_spread || spread > most_spread || merit(candidate) < fair * merit(*best)) continue;
    if (polarity != Polarity::automatic && allowed(candidate)) continue;
    if (!voids || merit(candidate) > merit(*voids)) voids = &candidate;
  }
  if (voids) {
    const double radius = 0.5 * std::numbers::sqrt3 * voids->spacing.median;
    const Polarity other = voids->sign > 0 ? Polarity::bright_beads : Polarity::dark_beads;
    if (other != estimate.polarity || std::abs(radius / estimate.radius_px - 1) > same) {
      estimate.packed_radius_px = radius;
      estimate.packed_polarity = other;
      constexpr double regular = 0.1;
      estimate.packed_likely = voids->spacing.scatter < regular * voids->spacing.median;
    }
  }
  constexpr double least_merit = 0.02;  // of all edges in the frame; white noise reaches 0.002
  if (merit(*best) < least_merit) {
    if (estimate.packed_radius_px > 0)
      estimate.others.insert(estimate.others.begin(), {estimate.packed_radius_px, estimate.packed_polarity});
    estimate.why_not = "no circle of any radius: no rim in the frame points to a common centre";
    return estimate;
  }
  estimate.found = true;
  return estimate;
}

}  // namespace shakebed::ingest
