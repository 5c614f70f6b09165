#include "sim/engine/overlap.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace shakebed::sim {

double largest_overlap(const Snapshot& at, std::span<const double> radii, double period_x, double period_z) {
  const double cell = radii.empty() ? 1 : 2 * *std::max_element(radii.begin(), radii.end());
  const auto contact_distance = [&](std::uint32_t i, std::uint32_t k) { return radii[i] + radii[k]; };
  // Cells at least `cell` wide that divide a period exactly.
  const auto columns = static_cast<std::int64_t>(period_x > 0 ? std::max(1.0, std::floor(period_x / cell)) : 0);
  const auto rows = static_cast<std::int64_t>(period_z > 0 ? std::max(1.0, std::floor(period_z / cell)) : 0);
  const double cell_x = columns > 0 ? period_x / static_cast<double>(columns) : cell;
  const double cell_z = rows > 0 ? period_z / static_cast<double>(rows) : cell;
  const auto wrap = [](std::int64_t index, std::int64_t size) {
    return size > 0 ? ((index % size) + size) % size : index;
  };
  const auto key = [](std::int64_t column, std::int64_t row) { return row * 1'000'003 + column; };
  std::unordered_map<std::int64_t, std::vector<std::uint32_t>> cells;
  cells.reserve(at.x.size());
  const auto column_of = [&](std::uint32_t i) {
    return wrap(static_cast<std::int64_t>(std::floor(at.x[i] / cell_x)), columns);
  };
  const auto row_of = [&](std::uint32_t i) {
    return wrap(static_cast<std::int64_t>(std::floor(at.z[i] / cell_z)), rows);
  };
  for (std::uint32_t i = 0; i < at.x.size(); ++i) cells[key(column_of(i), row_of(i))].push_back(i);
  double worst = 0;
  for (std::uint32_t i = 0; i < at.x.size(); ++i) {
    for (std::int64_t dr = -1; dr <= 1; ++dr) {
      for (std::int64_t dc = -1; dc <= 1; ++dc) {
        const auto found = cells.find(key(wrap(column_of(i) + dc, columns), wrap(row_of(i) + dr, rows)));
        if (found == cells.end()) continue;
        for (std::uint32_t k : found->second) {
          if (k == i) continue;
          double dx = at.x[k] - at.x[i], dz = at.z[k] - at.z[i];
          if (period_x > 0) dx -= period_x * std::nearbyint(dx / period_x);
          if (period_z > 0) dz -= period_z * std::nearbyint(dz / period_z);
          worst = std::max(worst, contact_distance(i, k) - std::sqrt(dx * dx + dz * dz));
        }
      }
    }
  }
  return worst;
}

}  // namespace shakebed::sim
