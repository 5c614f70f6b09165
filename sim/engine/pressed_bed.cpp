#include "sim/engine/pressed_bed.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace shakebed::sim {

namespace {
PressedBed::Spring spring_of(const Surface& s, double contact_time) {
  const double beta = -std::log(std::max(s.restitution, 0.05)) / contact_time, omega = std::numbers::pi / contact_time;
  return {omega * omega + beta * beta, 2 * beta};
}
inline Lanes load4(const PressedDisk& d) { return *reinterpret_cast<const Lanes*>(&d); }
[[gnu::always_inline]] inline void differences(const PressedDisk* disks, const std::uint32_t* i, const std::uint32_t* k,
                                               Lanes& dx, Lanes& dz, Lanes& dvx, Lanes& dvz) {
  const Lanes d0 = load4(disks[k[0]]) - load4(disks[i[0]]), d1 = load4(disks[k[1]]) - load4(disks[i[1]]),
              d2 = load4(disks[k[2]]) - load4(disks[i[2]]), d3 = load4(disks[k[3]]) - load4(disks[i[3]]);
  const Lanes a01 = __builtin_shufflevector(d0, d1, 0, 4, 2, 6), b01 = __builtin_shufflevector(d0, d1, 1, 5, 3, 7);
  const Lanes a23 = __builtin_shufflevector(d2, d3, 0, 4, 2, 6), b23 = __builtin_shufflevector(d2, d3, 1, 5, 3, 7);
  dx = __builtin_shufflevector(a01, a23, 0, 1, 4, 5);
  dz = __builtin_shufflevector(b01, b23, 0, 1, 4, 5);
  dvx = __builtin_shufflevector(a01, a23, 2, 3, 6, 7);
  dvz = __builtin_shufflevector(b01, b23, 2, 3, 6, 7);
}
}  // namespace

void PressedBed::set_up(const Box& box, const Surface& disks, const Surface& sides, const Surface& floor,
                        const Surface& lid, double contact_time, double step) {
  box_ = box;
  surfaces_[0] = disks, surfaces_[1] = sides, surfaces_[2] = floor, surfaces_[3] = lid;
  soften(contact_time);
  step_ = step;
}

void PressedBed::soften(double contact_time) {
  contact_time_ = contact_time;
  pair_ = spring_of(surfaces_[0], contact_time);
  side_ = spring_of(surfaces_[1], contact_time);
  floor_ = spring_of(surfaces_[2], contact_time);
  lid_ = spring_of(surfaces_[3], contact_time);
}
double PressedBed::approach() const {
  const double touching = touching_[0] + touching_[1] + touching_[2] + touching_[3];
  return std::sqrt((damped_lanes_[0] + damped_lanes_[1] + damped_lanes_[2] + damped_lanes_[3]) /
                   (0.5 * pair_.damping * std::max(touching, 1.0)));
}

void PressedBed::begin(std::vector<PressedDisk> disks, const FloorMotion& floor, double now) {
  disks_ = std::move(disks);
  count_ = static_cast<std::uint32_t>(disks_.size());
  disks_.push_back({-100, -100, 0, 0});
  disks_.push_back({-200, -200, 0, 0});
  force_.assign(2 * (count_ + 2), 0);
  next_.assign(2 * (count_ + 2), 0);
  const FloorMotion::Motion f = floor.motion(now);
  list_pairs(f.position);
  forces(f.position, f.velocity);
  damped_lanes_ = Lanes{};
}

void PressedBed::list_pairs(double floor) {
  ++rebuilds;
  first_.clear();
  second_.clear();
  for (auto* l : {&near_left_, &near_right_, &near_floor_, &near_lid_}) l->clear();
  listed_x_.resize(count_);
  listed_z_.resize(count_);
  const double reach = 1 + skin_;
  double low = 1e300, high = -1e300;
  for (std::uint32_t i = 0; i < count_; ++i) low = std::min(low, disks_[i].z), high = std::max(high, disks_[i].z);
  const auto columns = std::max<std::int64_t>(1, static_cast<std::int64_t>(box_.width / reach));
  const double cell_x = box_.width / static_cast<double>(columns);
  const auto rows = static_cast<std::int64_t>(std::min((high - low) / reach + 1, 4.0 * count_));
  const double cell_z = std::max(reach, (high - low) / static_cast<double>(rows) * (1 + 1e-12));
  std::vector<std::uint32_t> start(static_cast<std::size_t>(columns * rows) + 1, 0), order(count_), cell(count_);
  const auto column_of = [&](double x) {
    return std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(x / cell_x)), 0, columns - 1);
  };
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (box_.period > 0) disks_[i].x -= box_.period * std::floor(disks_[i].x / box_.period);
    const std::int64_t row =
        std::clamp<std::int64_t>(static_cast<std::int64_t>((disks_[i].z - low) / cell_z), 0, rows - 1);
    cell[i] = static_cast<std::uint32_t>(row * columns + column_of(disks_[i].x));
    ++start[cell[i] + 1];
    listed_x_[i] = disks_[i].x;
    listed_z_[i] = disks_[i].z - floor;
  }
  for (std::size_t c = 1; c < start.size(); ++c) start[c] += start[c - 1];
  std::vector<std::uint32_t> fill(start.begin(), start.end() - 1);
  for (std::uint32_t i = 0; i < count_; ++i) order[fill[cell[i]]++] = i;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const auto row = static_cast<std::int64_t>(cell[i]) / columns, column = static_cast<std::int64_t>(cell[i]) % columns;
    for (std::int64_t r = std::max<std::int64_t>(row - 1, 0); r <= std::min(row + 1, rows - 1); ++r) {
      for (std::int64_t dc = -1; dc <= 1; ++dc) {
        std::int64_t c = column + dc;
        if (box_.period > 0) {
          c = (c + columns) % columns;
        } else if (c < 0 || c >= columns) {
          continue;
        }
        const auto at = static_cast<std::size_t>(r * columns + c);
        for (std::uint32_t o = start[at]; o < start[at + 1]; ++o) {
          const std::uint32_t k = order[o];
          if (k <= i) continue;
          double dx = disks_[k].x - disks_[i].x, dz = disks_[k].z - disks_[i].z;
          if (box_.period > 0) dx -= box_.period * std::nearbyint(dx / box_.period);
          if (dx * dx + dz * dz < reach * reach) first_.push_back(i), second_.push_back(k);
        }
      }
    }
    const double near = 0.5 + 0.5 * skin_;
    if (box_.period <= 0 && disks_[i].x < near) near_left_.push_back(i);
    if (box_.period <= 0 && disks_[i].x > box_.width - near) near_right_.push_back(i);
    if (disks_[i].z - floor < near) near_floor_.push_back(i);
    // lid left out in the prototype
  }
  while (first_.size() % 4 != 0) first_.push_back(count_), second_.push_back(count_ + 1);
  until_check_ = 8;
  active_first_ = first_;
  active_second_ = second_;
}

void PressedBed::wall(std::vector<std::uint32_t>& near, double nx, double nz, double at, double wall_v, const Spring& s,
                      bool is_floor) {
  // (nx, nz) points from the wall into the box; at: its place along that
  double total = 0, lost = 0;
  for (std::uint32_t i : near) {
    const PressedDisk& d = disks_[i];
    const double gap = d.x * nx + d.z * nz - at - 0.5;
    if (!(gap < 0)) continue;
    const double v = d.vx * nx + d.vz * nz - wall_v;
    const double f = -s.stiffness * gap - s.damping * v;
    force_[2 * i] += f * nx;
    force_[2 * i + 1] += f * nz;
    total += f;
    lost += s.damping * v * v;
  }
  if (is_floor) floor_force = total;
  damped_lanes_[0] += lost;
}

void PressedBed::forces(double floor, double floor_velocity) {
  box_.period > 0 ? pair_forces<true>() : pair_forces<false>();
  if (box_.period <= 0) {
    wall(near_left_, 1, 0, 0, 0, side_, false);
    wall(near_right_, -1, 0, -box_.width, 0, side_, false);
  }
  wall(near_floor_, 0, 1, floor, floor_velocity, floor_, true);
}
template <bool periodic>
void PressedBed::pair_forces() {
  std::fill(force_.begin(), force_.end(), 0.0);
  const std::size_t pairs = active_first_.size();
  const PressedDisk* const disks = disks_.data();
  double* const force = force_.data();
  const Lanes stiffness = all_lanes(0.5 * pair_.stiffness), damping = all_lanes(0.5 * pair_.damping);
  const Lanes one = all_lanes(1);
  Lanes lost = damped_lanes_, count{};
  [[maybe_unused]] const double period = box_.period, inverse = period > 0 ? 1 / period : 0;
  for (std::size_t p = 0; p < pairs; p += 4) {
    const std::uint32_t *i = &active_first_[p], *k = &active_second_[p];
    Lanes dx, dz, dvx, dvz;
    differences(disks, i, k, dx, dz, dvx, dvz);
    if constexpr (periodic) {
      const Lanes large = all_lanes(0x1.8p52);
      dx = fused(all_lanes(-period), fused(dx, all_lanes(inverse), large) - large, dx);
    }
    const Lanes squared = fused(dx, dx, dz * dz);
    const LaneMask touch = squared < one;
    if (_mm256_testz_si256(reinterpret_cast<__m256i>(touch), reinterpret_cast<__m256i>(touch))) continue;
    // of r = sqrt(1 - u), u small: 1 - r and 1 / r
    const Lanes u = one - squared;
    const Lanes overlap = u * fused(u, fused(u, fused(u, all_lanes(5.0 / 128), all_lanes(1.0 / 16)), all_lanes(0.125)), all_lanes(0.5));
    const Lanes away = fused(u, fused(u, fused(u, fused(u, all_lanes(35.0 / 128), all_lanes(0.3125)), all_lanes(0.375)), all_lanes(0.5)), one);
    const Lanes nx = dx * away, nz = dz * away;
    const Lanes v = fused(dvx, nx, dvz * nz);
    const Lanes fd = damping * v;
    const Lanes f = unless(~touch, stiffness * overlap - fd);
    lost += unless(~touch, fd * v);
    count += unless(~touch, one);
    const Lanes fx = f * nx, fz = f * nz;
    const Lanes low = __builtin_shufflevector(fx, fz, 0, 4, 2, 6), high = __builtin_shufflevector(fx, fz, 1, 5, 3, 7);
    const TwoLanes f0 = __builtin_shufflevector(low, low, 0, 1), f2 = __builtin_shufflevector(low, low, 2, 3),
                   f1 = __builtin_shufflevector(high, high, 0, 1), f3 = __builtin_shufflevector(high, high, 2, 3);
    const auto add = [force](std::uint32_t a, std::uint32_t b, TwoLanes f_) {
      put_pair(force + 2 * a, pair_at(force + 2 * a) - f_);
      put_pair(force + 2 * b, pair_at(force + 2 * b) + f_);
    };
    add(i[0], k[0], f0);
    add(i[1], k[1], f1);
    add(i[2], k[2], f2);
    add(i[3], k[3], f3);
  }
  damped_lanes_ = lost;
  touching_ = count;
}

void PressedBed::step(const FloorMotion& floor, double now, double dt) {
  ++steps;
  const FloorMotion::Motion after = floor.motion(now, dt), before = floor.motion(now);
  const TwoLanes weight = {0, -1}, dt2 = both(dt), half = both(0.5 * dt);
  for (std::uint32_t i = 0; i < count_; ++i) {
    double* const d = &disks_[i].x;
    const TwoLanes a = pair_at(&force_[2 * i]) + weight, v = pair_at(d + 2);
    put_pair(d, fused(dt2, fused(half, a, v), pair_at(d)));
    put_pair(d + 2, fused(dt2, a, v));
  }
  std::swap(force_, next_);
  if (--until_check_ == 0) {
    until_check_ = 8;
    double farthest = 0, fastest = 0, sum = 0;
    for (std::uint32_t i = 0; i < count_; ++i) {
      const PressedDisk& d = disks_[i];
      const double dx = d.x - listed_x_[i], dz = d.z - after.position - listed_z_[i], vz = d.vz - after.velocity;
      farthest = std::max(farthest, dx * dx + dz * dz);
      fastest = std::max(fastest, d.vx * d.vx + vz * vz);
      sum += d.vx * d.vx + vz * vz;
    }
    if (std::sqrt(farthest) + 8 * dt * std::sqrt(fastest) > 0.5 * skin_) list_pairs(after.position);
    choose_active(dt, std::sqrt(sum / count_));
  }
  const double force_before = floor_force;
  damped_lanes_ = Lanes{};
  forces(after.position, after.velocity);
  damped += dt * (damped_lanes_[0] + damped_lanes_[1] + damped_lanes_[2] + damped_lanes_[3]);
  floor_work += 0.5 * (force_before + floor_force) * (after.position - before.position);
  for (std::uint32_t i = 0; i < count_; ++i) {
    double* const d = &disks_[i].x;
    put_pair(d + 2, fused(half, pair_at(&force_[2 * i]) - pair_at(&next_[2 * i]), pair_at(d + 2)));
  }
}

void PressedBed::choose_active(double dt, double fastest) {
  const double ahead = 2 * 8 * dt;
  const double closer = ahead * fastest;
  active_first_.resize(first_.size() + 4);
  active_second_.resize(first_.size() + 4);
  std::size_t n = 0;
  const double period = box_.period, inverse = period > 0 ? 1 / period : 0;
  for (std::size_t p = 0; p < first_.size(); p += 4) {
    Lanes dx, dz, dvx, dvz;
    differences(disks_.data(), &first_[p], &second_[p], dx, dz, dvx, dvz);
    const Lanes large = all_lanes(0x1.8p52);
    dx = fused(all_lanes(-period), fused(dx, all_lanes(inverse), large) - large, dx);
    const Lanes squared = fused(dx, dx, dz * dz), closing = fused(dx, dvx, dz * dvz);
    // r^2 later, if both fly on, and a margin
    const LaneMask near = fused(all_lanes(2 * ahead), closing, squared) < all_lanes(1 + 2 * closer);
    const LaneMask near_now = squared < all_lanes(1 + 2 * closer);
    const int bits = _mm256_movemask_pd(reinterpret_cast<Lanes>(near | near_now));
    for (unsigned q = 0; q < 4; ++q) {
      active_first_[n] = first_[p + q];
      active_second_[n] = second_[p + q];
      n += bits >> q & 1;
    }
  }
  while (n % 4 != 0) active_first_[n] = count_, active_second_[n] = count_ + 1, ++n;
  active_first_.resize(n);
  active_second_.resize(n);
  active_total += n;
}

std::uint32_t PressedBed::touching() const {
  std::uint32_t n = 0;
  for (std::size_t p = 0; p < first_.size(); ++p) {
    double dx = disks_[second_[p]].x - disks_[first_[p]].x, dz = disks_[second_[p]].z - disks_[first_[p]].z;
    if (box_.period > 0) dx -= box_.period * std::nearbyint(dx / box_.period);
    n += dx * dx + dz * dz < 1;
  }
  return n;
}
double PressedBed::largest_overlap() const {
  double worst = 0;
  for (std::size_t p = 0; p < first_.size(); ++p) {
    double dx = disks_[second_[p]].x - disks_[first_[p]].x, dz = disks_[second_[p]].z - disks_[first_[p]].z;
    if (box_.period > 0) dx -= box_.period * std::nearbyint(dx / box_.period);
    worst = std::max(worst, 1 - std::sqrt(dx * dx + dz * dz));
  }
  return worst;
}

// moves apart what overlaps
void PressedBed::separate(double floor) {
  for (int sweep = 0; sweep < 1000; ++sweep) {
    double worst = 0;
    for (std::uint32_t i : near_floor_) {
      const double o = floor + 0.5 - disks_[i].z;
      if (o > 0) disks_[i].z += o, worst = std::max(worst, o);
    }
    for (std::uint32_t i : near_left_) {
      const double o = 0.5 - disks_[i].x;
      if (o > 0) disks_[i].x += o, worst = std::max(worst, o);
    }
    for (std::uint32_t i : near_right_) {
      const double o = disks_[i].x + 0.5 - box_.width;
      if (o > 0) disks_[i].x -= o, worst = std::max(worst, o);
    }
    for (std::size_t p = 0; p < first_.size(); ++p) {
      PressedDisk &a = disks_[first_[p]], &b = disks_[second_[p]];
      double dx = b.x - a.x;
      const double dz = b.z - a.z;
      if (box_.period > 0) dx -= box_.period * std::nearbyint(dx / box_.period);
      const double s = dx * dx + dz * dz;
      if (s >= 1) continue;
      const double r = std::sqrt(s), o = 1 - r;
      worst = std::max(worst, o);
      const double m = 0.5 * (o + 1e-15) / r;
      a.x -= m * dx, a.z -= m * dz, b.x += m * dx, b.z += m * dz;
    }
    if (worst < 1e-13) break;
  }
}

}  // namespace shakebed::sim
namespace shakebed::sim {
double PressedBed::stored() const {
  double sum = 0;
  for (std::size_t p = 0; p < first_.size(); ++p) {
    double dx = disks_[second_[p]].x - disks_[first_[p]].x, dz = disks_[second_[p]].z - disks_[first_[p]].z;
    if (box_.period > 0) dx -= box_.period * std::nearbyint(dx / box_.period);
    const double o = std::max(0.0, 1 - std::sqrt(dx * dx + dz * dz));
    sum += 0.5 * 0.5 * pair_.stiffness * o * o;
  }
  for (std::uint32_t i : near_left_) { const double o = std::max(0.0, 0.5 - disks_[i].x); sum += 0.5 * side_.stiffness * o * o; }
  for (std::uint32_t i : near_right_) { const double o = std::max(0.0, disks_[i].x + 0.5 - box_.width); sum += 0.5 * side_.stiffness * o * o; }
  return sum;
}
}
