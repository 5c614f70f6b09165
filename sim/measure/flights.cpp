#include "sim/measure/flights.hpp"

#include <algorithm>
#include <cmath>

namespace shakebed::sim {

FlightObserver::FlightObserver(const Scene& scene, const DiskProperties& disks, const LayerGrid& layers)
    : width_(scene.box.width),
      gravity_(std::holds_alternative<UniformGravity>(scene.gravity) ? 1 : 0),
      masses_(disks.mass),
      radii_(disks.radius),
      grid_(layers),
      flights_(disks.mass.size()),
      sums_(layers.count),
      means_(quantities * layers.count + 1) {}

std::size_t FlightObserver::layer_of(double z) const {
  const double place = std::floor((z - grid_.lowest) / grid_.thickness);
  return static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(grid_.count - 1)));
}

// A piece of a flight within one layer: v is the vertical velocity, which changes linearly.
void FlightObserver::count_layer(std::size_t layer, double mass, double z, double vx, double v_from, double v_to,
                                 double duration) {
  Sums& sums = sums_[layer];
  sums.count += duration;
  sums.time += mass * duration;
  sums.height += mass * duration * (z - bottom(layer) + duration * (v_from / 2 - gravity_ * duration / 6));
  sums.kinetic_x += mass * vx * vx * duration;
  sums.kinetic_z += mass * (v_from * v_from + v_from * v_to + v_to * v_to) / 3 * duration;
  sums.momentum_z += mass * (v_from + v_to) / 2 * duration;
}

// A piece of a flight on which the vertical velocity keeps its sign.
void FlightObserver::fly_one_way(double mass, double z, double vx, double v_from, double v_to, double duration) {
  const double end = z + (v_from + v_to) / 2 * duration;
  std::size_t layer = layer_of(z);
  const std::size_t last = layer_of(end);
  const bool up = last > layer;
  while (layer != last) {
    const double edge = up ? bottom(layer + 1) : bottom(layer);
    const double way = edge - z;
    double v_edge = std::sqrt(std::max(v_from * v_from - 2 * gravity_ * way, 0.0));
    if (!up) v_edge = -v_edge;
    const double mean = (v_from + v_edge) / 2;
    const double part = mean != 0 ? std::clamp(way / mean, 0.0, duration) : 0;
    count_layer(layer, mass, z, vx, v_from, v_edge, part);
    duration -= part;
    z = edge;
    v_from = v_edge;
    layer = up ? layer + 1 : layer - 1;
  }
  count_layer(layer, mass, z, vx, v_from, v_to, duration);
}

void FlightObserver::fly(std::uint32_t disk, double until) {
  Flight& flight = flights_[disk];
  const double duration = until - flight.time;
  if (duration > 0) {
    const double mass = masses_[disk], v_end = flight.vz - gravity_ * duration;
    if (flight.vz > 0 && v_end < 0) {
      const double rise = flight.vz / gravity_;
      fly_one_way(mass, flight.z, flight.vx, flight.vz, 0, rise);
      fly_one_way(mass, flight.z + flight.vz * rise / 2, flight.vx, 0, v_end, duration - rise);
    } else {
      fly_one_way(mass, flight.z, flight.vx, flight.vz, v_end, duration);
    }
    flight.z += (flight.vz + v_end) / 2 * duration;
    flight.vz = v_end;
  }
  flight.time = until;
}

void FlightObserver::flies(double time, std::uint32_t disk, double, double z, double vx, double vz) {
  fly(disk, time);
  flights_[disk] = {time, z, vx, vz};
}

// A momentum handed over the height dz from z on.
void FlightObserver::hand_on(double z, double dz, double xx, double zz) {
  const double low = std::min(z, z + dz), high = std::max(z, z + dz);
  const std::size_t first = layer_of(low), last = layer_of(high);
  if (first == last) {
    sums_[first].contacts_xx += xx;
    sums_[first].contacts_zz += zz;
    return;
  }
  for (std::size_t layer = first; layer <= last; ++layer) {
    const double from = layer == first ? low : bottom(layer), to = layer == last ? high : bottom(layer + 1);
    const double share = (to - from) / (high - low);
    sums_[layer].contacts_xx += share * xx;
    sums_[layer].contacts_zz += share * zz;
  }
}

void FlightObserver::touched(double, double, double z, double dx, double dz, double px, double pz) {
  hand_on(z, dz, dx * px, dz * pz);
  sums_[layer_of(z + dz / 2)].contacts += 1;
}

// A contact that lasts is not counted: it would be once a step.
void FlightObserver::pressed(double, double, double z, double dx, double dz, double px, double pz) {
  hand_on(z, dz, dx * px, dz * pz);
}

void FlightObserver::touched_wall(double, std::uint32_t disk, bool floor, double z, double, double pz) {
  if (!floor) return;
  floor_momentum_ += pz;
  hand_on(z, -radii_[disk], 0, radii_[disk] * pz);
}

void FlightObserver::begin(double time) {
  block_start_ = time;
  std::fill(sums_.begin(), sums_.end(), Sums{});
  floor_momentum_ = 0;
}

void FlightObserver::end_block(double time) {
  for (std::uint32_t disk = 0; disk < flights_.size(); ++disk) fly(disk, time);
  const double duration = time - block_start_, area_time = width_ * grid_.thickness * duration;
  std::vector<double> block(quantities * grid_.count + 1);
  double above = 0;  // weight of the layers above, times the duration
  for (std::size_t layer = grid_.count; layer-- > 0;) {
    const Sums& sums = sums_[layer];
    double* mean = &block[quantities * layer];
    mean[density] = sums.count / area_time;
    mean[mass_density] = sums.time / area_time;
    mean[energy_x] = sums.kinetic_x / area_time;
    mean[energy_z] = sums.kinetic_z / area_time;
    mean[momentum] = sums.momentum_z / area_time;
    mean[p_xx] = (sums.kinetic_x + sums.contacts_xx) / area_time;
    mean[p_zz] = (sums.kinetic_z + sums.contacts_zz) / area_time;
    mean[weight] = gravity_ * (above + sums.height / grid_.thickness) / (width_ * duration);
    mean[rate] = sums.contacts / area_time;
    above += sums.time;
  }
  block.back() = floor_momentum_ / (width_ * duration);
  means_.add(block);
  begin(time);
}

std::vector<FlightObserver::Layer> FlightObserver::layers() const {
  std::vector<Layer> result;
  if (means_.samples() == 0) return result;
  std::size_t first = 0, last = grid_.count;
  // A disk that turns back on an edge leaves a rounding error's time beyond it.
  constexpr double nothing = 1e-12;
  while (first < last && means_.mean(quantities * first + density) < nothing) ++first;
  while (last > first && means_.mean(quantities * (last - 1) + density) < nothing) --last;
  for (std::size_t layer = first; layer < last; ++layer) {
    const std::size_t at = quantities * layer;
    const auto plain = [&](Quantity q) { return Measured{means_.mean(at + q), means_.std_error(at + q)}; };
    const double n = means_.mean(at + density), m = means_.mean(at + mass_density), p = means_.mean(at + momentum),
                 kx = means_.mean(at + energy_x), kz = means_.mean(at + energy_z);
    Layer out{};
    out.height = bottom(layer) + grid_.thickness / 2;
    out.number_density = plain(density);
    out.pressure_zz = plain(p_zz);
    out.pressure_xx = plain(p_xx);
    out.weight_above = plain(weight);
    out.collision_rate = plain(rate);
    if (n > nothing) {
      const std::vector<double> covariance =
          means_.covariance(at, at + momentum + 1, means_.windows(at, at + momentum + 1));
      const double gx[] = {-kx / (n * n), 0, 1 / n, 0, 0};
      out.temperature_x = propagated(kx / n, gx, covariance);
      const double thermal = kz - p * p / m;
      const double gz[] = {-thermal / (n * n), p * p / (m * m) / n, 0, 1 / n, -2 * p / m / n};
      out.temperature_z = propagated(thermal / n, gz, covariance);
      const double gv[] = {0, -p / (m * m), 0, 0, 1 / m};
      out.mean_velocity_z = propagated(p / m, gv, covariance);
    }
    result.push_back(out);
  }
  return result;
}

Measured FlightObserver::floor_pressure() const {
  return {means_.mean(quantities * grid_.count), means_.std_error(quantities * grid_.count)};
}

}  // namespace shakebed::sim
