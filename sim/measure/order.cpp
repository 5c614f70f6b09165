#include "sim/measure/order.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

namespace shakebed::sim {

namespace {

double wrapped(double difference, double period) {
  return period > 0 ? difference - period * std::nearbyint(difference / period) : difference;
}

// Disks filed in square cells at least `reach` wide.
class Cells {
 public:
  Cells(const Snapshot& at, double reach, double period_x, double period_z)
      : at_(at), period_x_(period_x), period_z_(period_z) {
    if (at.x.empty()) return;
    const auto [left, right] = std::minmax_element(at.x.begin(), at.x.end());
    const auto [low, high] = std::minmax_element(at.z.begin(), at.z.end());
    // A bed with a few disks far above it must not make more cells than disks can fill.
    const double most = 4 * std::sqrt(static_cast<double>(at.x.size())) + 64;
    const auto lay = [&](double from, double to, double period, double& start, double& size, std::int64_t& count) {
      start = period > 0 ? 0 : from;
      const double length = period > 0 ? period : to - from + 1e-9;
      count = static_cast<std::int64_t>(std::max(1.0, std::min(std::floor(length / reach), most)));
      size = length / static_cast<double>(count);
    };
    lay(*left, *right, period_x, start_x_, size_x_, columns_);
    lay(*low, *high, period_z, start_z_, size_z_, rows_);
    cells_.resize(static_cast<std::size_t>(columns_ * rows_));
    for (std::uint32_t i = 0; i < at.x.size(); ++i) cells_[cell(column(at.x[i]), row(at.z[i]))].push_back(i);
  }

  // visit(k, dx, dz) for every disk in the cells round (x, z); the nearest image's offset.
  template <class Visit>
  void around(double x, double z, Visit visit) const {
    const auto span = [](std::int64_t middle, std::int64_t count, bool periodic) {
      // A few cells only: each once, whatever wraps.
      if (periodic && count >= 3) return std::array{middle - 1, middle + 1};
      return periodic ? std::array{std::int64_t{0}, count - 1}
                      : std::array{std::max<std::int64_t>(middle - 1, 0), std::min(middle + 1, count - 1)};
    };
    const auto [first_column, last_column] = span(column(x), columns_, period_x_ > 0);
    const auto [first_row, last_row] = span(row(z), rows_, period_z_ > 0);
    for (std::int64_t r = first_row; r <= last_row; ++r) {
      for (std::int64_t c = first_column; c <= last_column; ++c) {
        for (const std::uint32_t k : cells_[cell((c + columns_) % columns_, (r + rows_) % rows_)])
          visit(k, wrapped(at_.x[k] - x, period_x_), wrapped(at_.z[k] - z, period_z_));
      }
    }
  }

 private:
  // Places beyond a periodic side are those of their images.
  static std::int64_t index(double place, double period, double size, std::int64_t count) {
    const double inside = period > 0 ? place - period * std::floor(place / period) : place;
    return std::clamp(static_cast<std::int64_t>(std::floor(inside / size)), std::int64_t{0}, count - 1);
  }
  std::int64_t column(double x) const { return index(x - start_x_, period_x_, size_x_, columns_); }
  std::int64_t row(double z) const { return index(z - start_z_, period_z_, size_z_, rows_); }
  std::size_t cell(std::int64_t column, std::int64_t row) const {
    return static_cast<std::size_t>(row * columns_ + column);
  }
  const Snapshot& at_;
  double period_x_, period_z_;
  double start_x_ = 0, start_z_ = 0, size_x_ = 1, size_z_ = 1;
  std::int64_t columns_ = 1, rows_ = 1;
  std::vector<std::vector<std::uint32_t>> cells_;
};

// Of the histogram of heights.
constexpr double row_bin = 0.02, row_window = 0.06;  // D; standard deviation of the window it is smoothed with
std::size_t row_bins(double top) {
  return static_cast<std::size_t>(std::ceil(std::clamp(top, 0.0, OrderObserver::row_reach) / row_bin)) + 1;
}

std::vector<double> smoothed(const std::vector<double>& histogram) {
  constexpr int reach = 10;  // bins: more than three standard deviations
  std::array<double, 2 * reach + 1> weight{};
  double sum = 0;
  for (int k = -reach; k <= reach; ++k) {
    const double u = k * row_bin / row_window;
    sum += weight[static_cast<std::size_t>(k + reach)] = std::exp(-u * u / 2);
  }
  const auto n = static_cast<std::ptrdiff_t>(histogram.size());
  std::vector<double> out(histogram.size());
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(-reach, -i); k <= std::min<std::ptrdiff_t>(reach, n - 1 - i); ++k)
      out[static_cast<std::size_t>(i + k)] +=
          weight[static_cast<std::size_t>(k + reach)] / sum * histogram[static_cast<std::size_t>(i)];
  }
  return out;
}

}  // namespace

namespace {

// Where a disk beside an empty site sees it: in the widest gap between its neighbours, given by their angles. Nothing
// where no gap is wide enough.
std::optional<double> widest_gap(std::vector<double>& angles) {
  std::sort(angles.begin(), angles.end());
  double widest = 0, middle = 0;
  for (std::size_t k = 0; k < angles.size(); ++k) {
    const double next = k + 1 < angles.size() ? angles[k + 1] : angles[0] + 2 * std::numbers::pi;
    if (next - angles[k] > widest) {
      widest = next - angles[k];
      middle = (next + angles[k]) / 2;
    }
  }
  if (widest < std::numbers::pi / 2) return std::nullopt;
  return middle;
}

// An empty site near (x, z): the middle of those around it, so that all of them find the same site. Nothing where fewer
// than five are around it, or one is in it.
std::optional<std::pair<double, double>> empty_site(const Cells& cells, double x, double z, double diameter) {
  const double reach = neighbour_reach * diameter;
  int seen = 0;
  double nearest = reach, mean_x = 0, mean_z = 0;
  cells.around(x, z, [&](std::uint32_t, double dx, double dz) {
    const double distance = std::sqrt(dx * dx + dz * dz);
    nearest = std::min(nearest, distance);
    if (distance < reach) {
      ++seen;
      mean_x += dx;
      mean_z += dz;
    }
  });
  if (seen < 5 || nearest < 0.8 * diameter) return std::nullopt;
  return std::pair(x + mean_x / seen, z + mean_z / seen);
}

}  // namespace

BondOrder bond_order(const Snapshot& at, const DiskProperties& disks, double period_x, double period_z) {
  const std::size_t n = at.x.size();
  BondOrder order;
  order.neighbours.resize(n);
  order.psi6_re.resize(n);
  order.psi6_im.resize(n);
  if (n == 0) return order;
  const double diameter = 2 * *std::max_element(disks.radius.begin(), disks.radius.end());
  const Cells cells(at, neighbour_reach * diameter, period_x, period_z);
  const auto is_known = [&](double x, double z) {
    for (std::size_t k = 0; k < order.vacancy_x.size(); ++k) {
      const double dx = wrapped(order.vacancy_x[k] - x, period_x), dz = wrapped(order.vacancy_z[k] - z, period_z);
      if (dx * dx + dz * dz < 0.36 * diameter * diameter) return true;
    }
    return false;
  };
  std::vector<double> angles;
  for (std::uint32_t i = 0; i < n; ++i) {
    angles.clear();
    double re = 0, im = 0;
    cells.around(at.x[i], at.z[i], [&](std::uint32_t k, double dx, double dz) {
      if (k == i) return;
      const double limit = neighbour_reach * (disks.radius[i] + disks.radius[k]);
      const double distance_squared = dx * dx + dz * dz;
      if (distance_squared >= limit * limit) return;
      // exp(6 i angle) = ((dx + i dz)^2)^3 / r^6
      const double a = dx * dx - dz * dz, b = 2 * dx * dz,
                   cube = distance_squared * distance_squared * distance_squared;
      re += (a * a * a - 3 * a * b * b) / cube;
      im += (3 * a * a * b - b * b * b) / cube;
      angles.push_back(std::atan2(dz, dx));
    });
    const auto count = angles.size();
    order.neighbours[i] = static_cast<std::uint8_t>(count);
    if (count == 0) continue;
    order.psi6_re[i] = re / static_cast<double>(count);
    order.psi6_im[i] = im / static_cast<double>(count);
    if (count >= 6 || count < 2) continue;  // beside an empty site it has five neighbours or fewer
    const auto gap = widest_gap(angles);
    if (!gap) continue;
    const auto site =
        empty_site(cells, at.x[i] + diameter * std::cos(*gap), at.z[i] + diameter * std::sin(*gap), diameter);
    if (!site || is_known(site->first, site->second)) continue;
    order.vacancy_x.push_back(site->first);
    order.vacancy_z.push_back(site->second);
  }
  return order;
}

OrderObserver::OrderObserver(const Scene& scene, const DiskProperties& disks, std::uint32_t phases,
                             const LayerGrid& layers)
    : disks_(disks),
      grid_(layers),
      means_(4, phases),
      layers_(layers.count),
      width_(scene.box.width),
      bins_(row_bins(layers.lowest + layers.thickness * static_cast<double>(layers.count))) {
  if (std::holds_alternative<PeriodicSides>(scene.box.sides)) period_x_ = scene.box.width;
  if (const auto* top = std::get_if<PeriodicTop>(&scene.box.top)) period_z_ = top->height;
}

void OrderObserver::observe(const Snapshot& at) {
  const BondOrder order = bond_order(at, disks_, period_x_, period_z_);
  const std::size_t n = at.x.size();
  double local = 0, re = 0, im = 0, neighbours = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double psi6 = std::hypot(order.psi6_re[i], order.psi6_im[i]);
    local += psi6;
    re += order.psi6_re[i];
    im += order.psi6_im[i];
    neighbours += order.neighbours[i];
    const double place = std::floor((at.z[i] - grid_.lowest) / grid_.thickness);
    LayerSums& layer = layers_[static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(grid_.count - 1)))];
    layer.count += 1;
    layer.psi6 += psi6;
    layer.neighbours += order.neighbours[i];
    const double height = at.z[i] - at.floor_position, bin = std::floor(height / row_bin);
    if (bin >= 0 && bin < static_cast<double>(bins_.size())) {
      bins_[static_cast<std::size_t>(bin)].disks += 1;
      bins_[static_cast<std::size_t>(bin)].heights += height;
    }
  }
  ++looks_;
  const double share = n > 0 ? 1 / static_cast<double>(n) : 0;
  const double sample[] = {local * share, std::hypot(re, im) * share, neighbours * share,
                           static_cast<double>(order.vacancy_x.size())};
  means_.add(sample);
}

std::vector<OrderObserver::Layer> OrderObserver::layers() const {
  std::vector<Layer> result;
  double total = 0;
  for (const LayerSums& layer : layers_) total += layer.count;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    const LayerSums& layer = layers_[i];
    if (layer.count == 0) continue;
    result.push_back({grid_.lowest + (static_cast<double>(i) + 0.5) * grid_.thickness, layer.psi6 / layer.count,
                      layer.neighbours / layer.count, layer.count / total});
  }
  return result;
}

std::vector<OrderObserver::Row> OrderObserver::rows() const {
  constexpr double depth = 0.8;  // of a valley, as a part of the peaks on either side
  std::vector<double> histogram;
  for (const Bin& bin : bins_) histogram.push_back(bin.disks);
  const std::vector<double> density = smoothed(histogram);
  std::vector<Row> rows;
  std::size_t begin = 0;            // of the row
  double peak = 0, valley = -1;     // valley: -1 on the way up
  std::size_t first = 0, last = 0;  // bins as low as the valley
  for (std::size_t i = 0; i < density.size(); ++i) {
    const double here = density[i];
    if (valley < 0) {
      peak = std::max(peak, here);
      if (here < depth * peak) valley = here, first = last = i;
    } else if (here < valley) {
      valley = here, first = last = i;
    } else if (here == valley) {
      last = i;
    } else if (valley < depth * here && here > peak / 4) {
      // Up again: the valley lies between two rows. What stays below a fourth of the row before is the surface.
      const std::size_t end = (first + last) / 2;
      double disks = 0, height = 0;
      for (std::size_t k = begin; k < end; ++k) {
        disks += bins_[k].disks;
        height += bins_[k].heights;
      }
      if (disks > 0) rows.push_back({height / disks, disks / static_cast<double>(looks_)});
      begin = end, peak = here, valley = -1;
    }
  }
  return rows;
}

double OrderObserver::bottom_density() const {
  const std::vector<Row> found = rows();
  if (found.size() < 3) return std::numeric_limits<double>::quiet_NaN();
  const double disks = found[0].disks / 2 + found[1].disks + found[2].disks / 2;
  return disks / (width_ * (found[2].height - found[0].height));
}

}  // namespace shakebed::sim
