#include "sim/measure/observables.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <sstream>

namespace shakebed::sim {

double ideal_centre_of_mass(std::uint32_t count, double width, bool hard_sides) {
  const auto full = static_cast<std::uint32_t>(std::floor(width * (1 + 1e-12)));
  const bool room_for_shift = !hard_sides || width - full >= 0.5;
  double sum = 0;
  std::uint32_t left = count;
  for (std::uint32_t row = 0; left > 0; ++row) {
    const std::uint32_t here = std::min(left, std::max(1u, row % 2 == 1 && !room_for_shift ? full - 1 : full));
    sum += here * (0.5 + row * std::numbers::sqrt3 / 2);
    left -= here;
  }
  return count > 0 ? sum / count : 0;
}

double ideal_centre_of_mass(const Scene& scene) {
  return ideal_centre_of_mass(scene.count(), scene.box.width, std::holds_alternative<HardSides>(scene.box.sides));
}

std::string precision_lost(const Simulation& simulation) {
  std::ostringstream out;
  out.precision(3);
  const EnergyLedger ledger = simulation.energy();
  const double turned_over = std::abs(ledger.initial) + std::abs(ledger.kinetic) + std::abs(ledger.potential) +
                             ledger.dissipated + std::abs(ledger.floor_work) + std::abs(ledger.bath_work);
  if (!std::isfinite(turned_over)) {
    out << "a position, a velocity or an energy is no longer a finite number";
    return out.str();
  }
  if (std::abs(ledger.imbalance()) > 1e-6 * turned_over) {
    out << "the energy balance has an error of " << std::abs(ledger.imbalance()) << " in a total of " << turned_over
        << " (allowed: 1e-6 of the total)";
    return out.str();
  }
  const double overlap = simulation.largest_overlap();
  const double allowed = simulation.allowed_overlap();
  if (!(overlap <= allowed)) out << "two disks overlap by " << overlap << " D (" << allowed << " D is allowed)";
  return out.str();
}

namespace {

enum Scalar : std::size_t { centre, t_x, spin_t, bottom_row, scalar_count };

// An odd value in the middle belongs to neither half. Error by windows over both halves, each from its own mean, so
// that a step between the two is no noise: the difference of two means of half the values each.
Measured drift_of(const std::vector<double>& series) {
  const std::size_t half = series.size() / 2, second = series.size() - half;
  if (half < 2) return {0, std::nan("")};
  std::vector<double> noise(2 * half);
  double early = 0, late = 0;
  for (std::size_t k = 0; k < half; ++k) {
    early += series[k] / static_cast<double>(half);
    late += series[second + k] / static_cast<double>(half);
  }
  for (std::size_t k = 0; k < half; ++k) {
    noise[k] = series[k] - early;
    noise[half + k] = series[second + k] - late;
  }
  return {late - early, 2 * statistics::mean_of(noise).std_error};
}

}  // namespace

BedObserver::BedObserver(const Scene& scene, const DiskProperties& disks, std::uint32_t phases, const HeightGrid& grid,
                         const Kernel& kernel)
    : width_(scene.box.width),
      masses_(disks.mass),
      phases_(phases),
      grid_(grid),
      kernel_(kernel),
      layer_count_(static_cast<std::size_t>(std::ceil(static_cast<double>(grid.points) * grid.spacing)) + 1),
      layer_bottom_(std::floor(grid.lowest)),
      period_sum_(2 * grid.points + scalar_count),
      means_(2 * grid.points + scalar_count),
      centre_by_phase_(phases),
      layers_(phases * layer_count_) {
  for (std::size_t i = 0; i < masses_.size(); ++i) {
    inertias_.push_back(scene.disks.inertia_ratio * masses_[i] * disks.radius[i] * disks.radius[i]);
    const double area = std::numbers::pi * disks.radius[i] * disks.radius[i];
    auto size = std::find_if(sizes_.begin(), sizes_.end(), [area](const Size& s) { return s.area == area; });
    if (size == sizes_.end()) size = sizes_.insert(size, {area, {}});
    size->disks.push_back(i);
  }
  if (sizes_.size() > 1) area_sums_.resize(2 * grid.points);
}

void BedObserver::add_area(const Snapshot& at) {
  std::vector<double> density(grid_.points), heights;
  for (const Size& size : sizes_) {
    heights.clear();
    for (const std::size_t i : size.disks) heights.push_back(at.z[i]);
    for (std::size_t frame = 0; frame < 2; ++frame) {
      std::fill(density.begin(), density.end(), 0.0);
      add_density(grid_, kernel_, width_, heights, frame == 0 ? 0 : at.floor_position, density);
      for (std::size_t i = 0; i < grid_.points; ++i) area_sums_[frame * grid_.points + i] += size.area * density[i];
    }
  }
}

void BedObserver::observe(const Snapshot& at, std::uint32_t phase) {
  assert(phase < phases_ && at.x.size() == masses_.size() && at.z.size() == masses_.size());
  const auto n = static_cast<double>(at.z.size());
  if (phase == 0) std::fill(period_sum_.begin(), period_sum_.end(), 0.0);
  std::vector<double> density(grid_.points);
  const double share = 1.0 / phases_;
  for (int frame = 0; frame < 2; ++frame) {
    std::fill(density.begin(), density.end(), 0.0);
    add_density(grid_, kernel_, width_, at.z, frame == 0 ? 0 : at.floor_position, density);
    for (std::size_t i = 0; i < grid_.points; ++i)
      period_sum_[static_cast<std::size_t>(frame) * grid_.points + i] += share * density[i];
  }
  if (!area_sums_.empty()) add_area(at);
  double z = 0, vx2 = 0, vz = 0, vz2 = 0, spin2 = 0;
  double mass = 0, in_bottom_row = 0;
  constexpr double row = std::numbers::sqrt3 / 2;
  for (std::size_t i = 0; i < at.z.size(); ++i) {
    const double m = masses_[i];
    mass += m;
    z += m * at.z[i];
    vx2 += m * at.vx[i] * at.vx[i];
    vz += m * at.vz[i];
    vz2 += m * at.vz[i] * at.vz[i];
    const double place = std::clamp(std::floor(at.z[i] - layer_bottom_), 0.0, static_cast<double>(layer_count_ - 1));
    LayerSums& layer = layers_[phase * layer_count_ + static_cast<std::size_t>(place)];
    layer.count += 1;
    layer.mass += m;
    layer.vx2 += m * at.vx[i] * at.vx[i];
    layer.vz += m * at.vz[i];
    layer.vz2 += m * at.vz[i] * at.vz[i];
    if (!at.spin.empty()) {
      const double spin = inertias_[i] * at.spin[i] * at.spin[i];
      layer.spin += spin;
      spin2 += spin;
    }
    in_bottom_row += std::abs(at.z[i] - at.floor_position - 0.5) < row / 2;
  }
  double* scalars = &period_sum_[2 * grid_.points];
  scalars[centre] += share * z / mass;
  scalars[t_x] += share * vx2 / n;
  scalars[spin_t] += share * spin2 / n;
  scalars[bottom_row] += share * in_bottom_row / (width_ * row);
  centre_by_phase_[phase] += z / mass;
  mean_vz_.push_back(vz / mass);
  mean_vz2_.push_back(vz2 / n);
  mean_mass_ = mass / n;
  if (phase + 1 == phases_) {
    means_.add(period_sum_);
    centre_series_.push_back(scalars[centre]);
    temperature_series_.push_back(scalars[t_x]);
    ++periods_;
  }
}

Profile BedObserver::density(bool floor_frame) const {
  Profile profile;
  const std::size_t first = floor_frame ? grid_.points : 0;
  for (std::size_t i = 0; i < grid_.points; ++i) {
    profile.height.push_back(grid_.height(i));
    profile.number_density.push_back(means_.mean(first + i));
    profile.std_error.push_back(means_.std_error(first + i));
    profile.area_fraction.push_back(area_sums_.empty()
                                        ? sizes_.front().area * profile.number_density[i]
                                        : area_sums_[first + i] / static_cast<double>(periods_ * phases_));
  }
  profile.samples = periods_ * phases_;
  return profile;
}

Measured BedObserver::centre_of_mass() const {
  const std::size_t i = 2 * grid_.points + centre;
  return {means_.mean(i), means_.std_error(i)};
}
Measured BedObserver::temperature_x() const {
  const std::size_t i = 2 * grid_.points + t_x;
  return {means_.mean(i), means_.std_error(i)};
}
Measured BedObserver::spin_temperature() const {
  const std::size_t i = 2 * grid_.points + spin_t;
  return {means_.mean(i), means_.std_error(i)};
}

Measured BedObserver::compressibility_factor(const Measured& virial_rate) const {
  const auto n = static_cast<double>(masses_.size());
  const double kinetic = (temperature_x().value + temperature_z().value) * n / (2 * (n - 1));
  return {1 + virial_rate.value / (2 * n * kinetic), virial_rate.std_error / (2 * n * kinetic)};
}

Measured BedObserver::drift_of_centre() const { return drift_of(centre_series_); }
Measured BedObserver::drift_of_temperature_x() const { return drift_of(temperature_series_); }

Measured BedObserver::bottom_row_density() const {
  const std::size_t i = 2 * grid_.points + bottom_row;
  return {means_.mean(i), means_.std_error(i)};
}

Measured BedObserver::temperature_z() const {
  std::vector<double> mean(phases_);
  for (std::size_t k = 0; k < periods_ * phases_; ++k) mean[k % phases_] += mean_vz_[k] / static_cast<double>(periods_);
  CorrelatedMeans blocks;
  double sum = 0;
  for (std::size_t k = 0; k < periods_ * phases_; ++k) {
    const double m = mean[k % phases_];
    sum += mean_vz2_[k] + mean_mass_ * (m * m - 2 * m * mean_vz_[k]);
    if (k % phases_ + 1 == phases_) {
      blocks.add(sum / phases_);
      sum = 0;
    }
  }
  return {blocks.mean(), blocks.std_error()};
}

Measured BedObserver::temperature_z_local() const {
  double sum = 0, count = 0;
  for (const LayerSums& layer : layers_) {
    if (layer.count < 2) continue;
    sum += (layer.vz2 - layer.vz * layer.vz / layer.mass) * layer.count / (layer.count - 1);
    count += layer.count;
  }
  // Its relative error is that of T_z: the same velocities, another mean taken away.
  const Measured whole = temperature_z();
  const double value = count > 0 ? sum / count : 0;
  return {value, whole.value > 0 ? value * whole.std_error / whole.value : 0};
}

std::vector<BedObserver::Layer> BedObserver::layers() const {
  std::vector<Layer> result;
  double total = 0;
  for (const LayerSums& sums : layers_) total += sums.count;
  for (std::size_t index = 0; index < layer_count_; ++index) {
    double count = 0, mass = 0, vx2 = 0, vz = 0, thermal = 0, spin = 0;
    for (std::uint32_t phase = 0; phase < phases_; ++phase) {
      const LayerSums& sums = layer(phase, index);
      if (sums.count == 0) continue;
      count += sums.count;
      vx2 += sums.vx2;
      vz += sums.vz;
      mass += sums.mass;
      thermal += sums.vz2 - sums.vz * sums.vz / sums.mass;
      spin += sums.spin;
    }
    if (count == 0) continue;
    result.push_back({layer_bottom_ + static_cast<double>(index) + 0.5, vx2 / count, thermal / count, vz / mass,
                      count / total, spin / count});
  }
  return result;
}

std::vector<double> BedObserver::centre_of_mass_by_phase() const {
  std::vector<double> result = centre_by_phase_;
  for (double& value : result) value /= static_cast<double>(periods_);
  return result;
}

}  // namespace shakebed::sim
