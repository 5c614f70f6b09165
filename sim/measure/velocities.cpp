#include "sim/measure/velocities.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace shakebed::sim {

void VelocityMoments::add(double m, double velocity_x, double velocity_z, double spin_energy) {
  const double root = std::sqrt(m), x = root * velocity_x, z = root * velocity_z;
  count += 1;
  mass += m;
  vx += m * velocity_x;
  vz += m * velocity_z;
  vx2 += x * x;
  vz2 += z * z;
  spin += spin_energy;
  xx += x * x;
  xxxx += x * x * x * x;
  z1 += z;
  z2 += z * z;
  z3 += z * z * z;
  z4 += z * z * z * z;
  xxz += x * x * z;
  xxzz += x * x * z * z;
}

void VelocityMoments::add(const VelocityMoments& o) {
  count += o.count, mass += o.mass, vx += o.vx, vz += o.vz, vx2 += o.vx2, vz2 += o.vz2, spin += o.spin;
  xx += o.xx, xxxx += o.xxxx, z1 += o.z1, z2 += o.z2, z3 += o.z3, z4 += o.z4, xxz += o.xxz, xxzz += o.xxzz;
}

double VelocityMoments::square() const {
  if (count == 0) return 0;
  const double mean = z1 / count;
  return xx / count + z2 / count - mean * mean;
}

double VelocityMoments::fourth() const {
  if (count == 0) return 0;
  const double m = z1 / count;
  const double across = xxzz - 2 * m * xxz + m * m * xx;
  const double along = z4 - 4 * m * z3 + 6 * m * m * z2 - 4 * m * m * m * z1 + m * m * m * m * count;
  return (xxxx + 2 * across + along) / count;
}

VelocityObserver::VelocityObserver(const Scene& scene, const DiskProperties& disks, std::uint32_t phases,
                                   const LayerGrid& layers, bool floor_frame)
    : width_(scene.box.width),
      masses_(disks.mass),
      phases_(phases),
      grid_(layers),
      floor_frame_(floor_frame),
      cells_(phases * layers.count),
      powers_(2, phases),
      histogram_x_(histogram_bins),
      histogram_z_(histogram_bins) {
  for (std::size_t i = 0; i < masses_.size(); ++i)
    inertias_.push_back(scene.disks.inertia_ratio * masses_[i] * disks.radius[i] * disks.radius[i]);
}

void VelocityObserver::observe(const Snapshot& at, std::uint32_t phase) {
  assert(phase < phases_ && at.vx.size() == masses_.size());
  const double floor = floor_frame_ ? at.floor_position : 0, floor_velocity = floor_frame_ ? at.floor_velocity : 0;
  const std::size_t n = at.z.size();
  double mass = 0, momentum = 0;
  VelocityMoments all;
  for (std::size_t i = 0; i < n; ++i) {
    const double place = std::floor((at.z[i] - floor - grid_.lowest) / grid_.thickness);
    const auto layer = static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(grid_.count - 1)));
    const double spin = at.spin.empty() ? 0 : inertias_[i] * at.spin[i] * at.spin[i];
    cells_[phase * grid_.count + layer].add(masses_[i], at.vx[i], at.vz[i] - floor_velocity, spin);
    mass += masses_[i];
    momentum += masses_[i] * at.vz[i];
  }
  const double mean = mass > 0 ? momentum / mass : 0;
  for (std::size_t i = 0; i < n; ++i) all.add(masses_[i], at.vx[i], at.vz[i] - mean, 0);
  const double t = n > 0 ? (all.xx + all.z2) / (2 * all.count) : 0;
  if (histogram_unit_ == 0 && t > 0) histogram_unit_ = std::sqrt(t);
  const auto bin = [&](double u) {
    const double place = std::floor(u / (0.1 * histogram_unit_) + 0.5) + histogram_bins / 2;
    return static_cast<std::size_t>(std::clamp(place, 0.0, histogram_bins - 1.0));
  };
  for (std::size_t i = 0; i < n && histogram_unit_ > 0; ++i) {
    const double root = std::sqrt(masses_[i]);
    histogram_x_[bin(root * at.vx[i])] += 1;
    histogram_z_[bin(root * (at.vz[i] - mean))] += 1;
  }
  // As in all.square(), but about the velocity's mean.
  double fourth = all.xxxx + 2 * all.xxzz + all.z4;
  const double powers[] = {n > 0 ? (all.xx + all.z2) / all.count : 0, n > 0 ? fourth / all.count : 0};
  powers_.add(powers);
  ++snapshots_;
}

Measured VelocityObserver::fourth_cumulant_of_all() const {
  const double square = powers_.mean(0), fourth = powers_.mean(1);
  if (!(square > 0)) return {};
  const double gradient[] = {-fourth / (square * square * square), 1 / (2 * square * square)};
  return propagated(fourth_cumulant(square, fourth), gradient, powers_.covariance(0, 2, powers_.windows(0, 2)));
}

double VelocityObserver::fourth_cumulant_local() const {
  double fourth = 0, gaussian = 0;
  for (const VelocityMoments& cell : cells_) {
    if (cell.count < 2) continue;
    fourth += cell.count * cell.fourth();
    gaussian += cell.count * 2 * cell.square() * cell.square();
  }
  return gaussian > 0 ? fourth / gaussian - 1 : 0;
}

VelocityMoments VelocityObserver::layer(std::size_t layer) const {
  VelocityMoments sum;
  for (std::uint32_t phase = 0; phase < phases_; ++phase) sum.add(cell(phase, layer));
  return sum;
}

double VelocityObserver::number_density(const VelocityMoments& moments, bool one_phase) const {
  if (snapshots_ == 0) return 0;
  const double looks = static_cast<double>(snapshots_) / (one_phase ? phases_ : 1);
  return moments.count / (looks * width_ * grid_.thickness);
}

double VelocityObserver::histogram_x(int bin) const {
  double total = 0;
  for (const double count : histogram_x_) total += count;
  return total > 0 ? histogram_x_[static_cast<std::size_t>(bin)] / (0.1 * total) : 0;
}
double VelocityObserver::histogram_z(int bin) const {
  double total = 0;
  for (const double count : histogram_z_) total += count;
  return total > 0 ? histogram_z_[static_cast<std::size_t>(bin)] / (0.1 * total) : 0;
}

DisplacementObserver::DisplacementObserver(const Scene& scene, std::size_t disks) : x_(disks), z_(disks) {
  if (std::holds_alternative<PeriodicSides>(scene.box.sides)) period_x_ = scene.box.width;
  if (const auto* top = std::get_if<PeriodicTop>(&scene.box.top)) period_z_ = top->height;
}

void DisplacementObserver::observe(const Snapshot& at) {
  const auto step = [](double from, double to, double period) {
    const double difference = to - from;
    return period > 0 ? difference - period * std::nearbyint(difference / period) : difference;
  };
  if (looks_ > 0) {
    for (std::size_t i = 0; i < x_.size(); ++i) {
      x_[i] += step(last_x_[i], at.x[i], period_x_);
      z_[i] += step(last_z_[i], at.z[i], period_z_);
    }
  }
  last_x_ = at.x;
  last_z_ = at.z;
  const auto n = static_cast<double>(std::max<std::size_t>(x_.size(), 1));
  for (std::size_t level = 0; (looks_ & ((std::uint64_t{1} << level) - 1)) == 0; ++level) {
    if (level == levels_.size()) {
      // A lag longer than all that has passed has no origin yet, but the first look.
      if (looks_ > 0) break;
      Level first;
      first.x = x_;
      first.z = z_;
      levels_.assign(24, first);
      break;
    }
    Level& lag = levels_[level];
    if (looks_ > 0) {
      double squares[2] = {0, 0};
      for (std::size_t i = 0; i < x_.size(); ++i) {
        const double dx = x_[i] - lag.x[i], dz = z_[i] - lag.z[i];
        squares[0] += dx * dx / n;
        squares[1] += dz * dz / n;
      }
      lag.squares.add(squares);
    }
    lag.x = x_;
    lag.z = z_;
  }
  ++looks_;
}

std::vector<DisplacementObserver::Lag> DisplacementObserver::lags() const {
  std::vector<Lag> result;
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    const CorrelatedMeans& squares = levels_[level].squares;
    if (squares.samples() == 0) break;
    result.push_back({std::uint64_t{1} << level,
                      {squares.mean(0), squares.std_error(0)},
                      {squares.mean(1), squares.std_error(1)},
                      squares.samples()});
  }
  return result;
}

}  // namespace shakebed::sim
