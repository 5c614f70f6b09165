#include "sim/engine/pressed_bed.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <numbers>

namespace shakebed::sim {

namespace {

using State = PressedBed::State;

constexpr double disk_radius = 0.5, skin = 0.08;  // of neighbours beyond contact [D]; a pressed bed hardly changes any
constexpr std::size_t sentinels = 2;              // behind the last disk, for lists of whole blocks of pairs
constexpr double far_off = -100;                  // where they are: they touch nothing
// A pair is asked until the next check if it would touch within so many times that many steps at the speed it has, or
// at that which is usual.
constexpr double foresight = 6;
// By how much more than its overlap a pair is moved apart: rows that fill the box come apart in a tenth of the sweeps.
constexpr double overdone = 1.6;

// Part of its energy that a contact loses whose contact time is 1 and whose velocity would fall by exp(-damping), mean
// over the moments within a step at which it may begin.
double share_lost(double damping, double steps) {
  constexpr int moments = 64;
  const double dt = 1 / steps;
  const double stiffness = std::numbers::pi * std::numbers::pi + damping * damping;
  double sum = 0;
  for (int moment = 0; moment < moments; ++moment) {
    double gap = dt * (moment + 0.5) / moments, v = -1, a = 0;
    bool touched = false;
    do {
      gap += dt * (v + 0.5 * dt * a);
      const double next = gap < 0 ? -stiffness * gap - 2 * damping * (v + dt * a) : 0;
      v += 0.5 * dt * (a + next);
      a = next;
      touched = touched || gap < 0;
    } while (!touched || gap < 0);
    sum += v * v;
  }
  return 1 - sum / moments;
}

// Differences of four pairs, second less first.
struct Differences {
  Lanes x, z, vx, vz;
};
Lanes state_at(const State* disks, std::uint32_t place) {
  Lanes state;
  std::memcpy(&state, reinterpret_cast<const char*>(disks) + place, sizeof state);
  return state;
}
[[gnu::always_inline]] inline Differences differences(const State* disks, const std::uint32_t* i,
                                                      const std::uint32_t* k) {
  const Lanes d0 = state_at(disks, k[0]) - state_at(disks, i[0]), d1 = state_at(disks, k[1]) - state_at(disks, i[1]),
              d2 = state_at(disks, k[2]) - state_at(disks, i[2]), d3 = state_at(disks, k[3]) - state_at(disks, i[3]);
  const Lanes a01 = __builtin_shufflevector(d0, d1, 0, 4, 2, 6), b01 = __builtin_shufflevector(d0, d1, 1, 5, 3, 7);
  const Lanes a23 = __builtin_shufflevector(d2, d3, 0, 4, 2, 6), b23 = __builtin_shufflevector(d2, d3, 1, 5, 3, 7);
  return {__builtin_shufflevector(a01, a23, 0, 1, 4, 5), __builtin_shufflevector(b01, b23, 0, 1, 4, 5),
          __builtin_shufflevector(a01, a23, 2, 3, 6, 7), __builtin_shufflevector(b01, b23, 2, 3, 6, 7)};
}
// Of {x, z} alone, of which one disk has `numbers_a_disk` on.
struct TwoDifferences {
  Lanes x, z;
};
template <std::size_t numbers_a_disk>
[[gnu::always_inline]] inline TwoDifferences differences_of_two(const double* numbers, const std::uint32_t* i,
                                                                const std::uint32_t* k) {
  const auto at = [&](std::uint32_t place) { return &numbers[numbers_a_disk * (place / sizeof(State))]; };
  const Lanes d02 = two_pairs(at(k[0]), at(k[2])) - two_pairs(at(i[0]), at(i[2]));
  const Lanes d13 = two_pairs(at(k[1]), at(k[3])) - two_pairs(at(i[1]), at(i[3]));
  return {__builtin_shufflevector(d02, d13, 0, 4, 2, 6), __builtin_shufflevector(d02, d13, 1, 5, 3, 7)};
}
Lanes nearest_image(Lanes dx, double period) {
  const Lanes large = all_lanes(0x1.8p52);
  return fused(all_lanes(-period), fused(dx, all_lanes(1 / period), large) - large, dx);
}
double sum_of(Lanes lanes) { return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]); }

std::uint32_t place_of(std::uint32_t i) { return i * static_cast<std::uint32_t>(sizeof(State)); }

}  // namespace

PressedBed::Spring PressedBed::spring_of(const Surface& surface) const {
  const double e = surface.restitution;
  double low = 0, high = 1 - 2 * std::log(e);
  for (int halving = 0; e < 1 && halving < 50; ++halving) {
    const double middle = 0.5 * (low + high);
    (share_lost(middle, steps()) < 1 - e * e ? low : high) = middle;
  }
  return {std::numbers::pi * std::numbers::pi + low * low, 2 * low, grip_of(surface)};
}

// Of a contact time of 1: what slips with speed 1 when a contact begins, and sticks, slips with minus the tangential
// restitution b0 when it ends. The mass that slips is 1/(1 + 1/q). Where it can be, the spring swings as long as the
// normal one does: its stiffness is 1/(1 + 1/q) of that, 2/7 for spheres. Then the dashpot gives b0. With less than
// exp(-least) of it the spring is softer; below -0.3 it cannot be reached.
PressedBed::Grip PressedBed::grip_of(const Surface& surface) const {
  if (!rough_ || !(surface.friction > 0)) return {};
  constexpr double least = 0.5, least_of_all = 0.02, slowest = 0.1;
  const double b = surface.tangential_restitution, mass = 1 / (1 + inverse_inertia_ratio_);
  double damping = b > std::exp(-least) ? std::max(least_of_all, -std::log(b)) : least, rate = std::numbers::pi;
  if (damping == least) {
    double low = slowest, high = std::numbers::pi;
    for (int halving = 0; halving < 50; ++halving) {
      const double middle = 0.5 * (low + high);
      const double end = std::exp(-damping) * (std::cos(middle) - damping / middle * std::sin(middle));
      (end > -b ? low : high) = middle;
    }
    rate = low;
  }
  return {mass * (rate * rate + damping * damping), mass * 2 * damping, surface.friction};
}

void PressedBed::set_up(const Box& box, const Surfaces& surfaces, double inverse_inertia_ratio) {
  box_ = box;
  rough_ = inverse_inertia_ratio > 0;
  inverse_inertia_ratio_ = inverse_inertia_ratio;
  const Spring pair = spring_of(surfaces.disks);
  const Spring half{0.5 * pair.stiffness,
                    0.5 * pair.damping,  // of their reduced mass
                    {0.5 * pair.grip.stiffness, 0.5 * pair.grip.damping, pair.grip.friction}};
  const auto spring_on = [&](const Surface& wall) {
    Spring spring = wall.restitution == surfaces.disks.restitution ? pair : spring_of(wall);
    spring.grip = grip_of(wall);
    return spring;
  };
  of_unit_time_ = {half, spring_on(surfaces.sides), spring_on(surfaces.floor), spring_on(surfaces.lid)};
}

void PressedBed::soften(double contact_time) {
  const auto soft = [contact_time](const Spring& spring) {
    const double square = contact_time * contact_time;
    return Spring{spring.stiffness / square,
                  spring.damping / contact_time,
                  {spring.grip.stiffness / square, spring.grip.damping / contact_time, spring.grip.friction}};
  };
  pair_ = soft(of_unit_time_[0]);
  side_ = soft(of_unit_time_[1]);
  floor_ = soft(of_unit_time_[2]);
  lid_ = soft(of_unit_time_[3]);
  const double damping = of_unit_time_[0].damping;
  if (!rough_ && damping > 0)
    pair_.damping *= std::max(1.0, std::min(contact_time / dashpot_time, most_damping / damping));
}

void PressedBed::begin(std::vector<State> disks, const FloorMotion::Motion& floor, double contact_time,
                       const std::vector<double>& spins, const std::vector<Stretch>& stretches) {
  disks_ = std::move(disks);
  count_ = static_cast<std::uint32_t>(disks_.size());
  halfway_.assign(2 * (std::size_t{count_} + sentinels), 0);
  for (std::uint32_t i = 0; i < count_; ++i) put_pair(&halfway_[2 * i], pair_at(&disks_[i].vx));
  last_step_ = 0;
  disks_.push_back({far_off, far_off, 0, 0});
  disks_.push_back({2 * far_off, 2 * far_off, 0, 0});
  force_.assign(4 * disks_.size(), 0);
  floor_work_ = damped_ = usual_approach_ = 0;
  fastest_ = mean_square_speed_ = side_temperature_ = never;
  soften(contact_time);
  if (rough_) {
    rim_.assign(std::size_t{count_} + sentinels, 0);
    for (std::size_t i = 0; i < spins.size(); ++i) rim_[i] = disk_radius * spins[i];
    rim_halfway_ = rim_;
    rim_force_.assign(std::size_t{count_} + sentinels, 0);
    wall_stretch_.assign(std::size_t{walls} * count_, 0);
    stretch_.clear();
    first_.clear();
    second_.clear();
  }
  list_pairs(floor.position);
  if (rough_) {
    kept_ = stretches;
    place_stretches(kept_);
  }
  add_forces(floor);
  damped_ = rubbed_;  // of springs that were stretched farther than friction allows
}

auto PressedBed::at(std::uint32_t i, double later) const -> State {
  const TwoLanes a = pair_at(&force_[4 * i]) + TwoLanes{0, -1};
  const TwoLanes v = fused(both(0.5 * last_step_), a, pair_at(&halfway_[2 * i]));
  const TwoLanes place = fused(both(later), fused(both(0.5 * later), a, v), pair_at(&disks_[i].x));
  const TwoLanes velocity = fused(both(later), a, v);
  return {place[0], place[1], velocity[0], velocity[1]};
}

// ------------------------------------------------------------------------------------------------
// neighbours

TwoLanes PressedBed::gap_of(std::uint32_t i, std::uint32_t k) const {
  TwoLanes d = pair_at(&disks_[k].x) - pair_at(&disks_[i].x);
  if (box_.period > 0) d[0] -= box_.period * std::nearbyint(d[0] / box_.period);
  return d;
}

// All pairs within the skin, by columns of disks in the order of height.
void PressedBed::list_pairs(double floor) {
  const double reach = 2 * disk_radius + skin;
  const auto columns = static_cast<std::size_t>(std::max(1.0, std::floor(box_.width / reach)));
  std::vector<std::vector<std::uint32_t>> column(columns);
  listed_.resize(2 * std::size_t{count_});
  if (rough_) keep_stretches();
  first_.clear();
  second_.clear();
  for (std::uint32_t i = 0; i < count_; ++i) {
    State& disk = disks_[i];
    if (box_.period > 0) disk.x -= box_.period * std::floor(disk.x / box_.period);
    put_pair(&listed_[2 * i], pair_at(&disk.x) - TwoLanes{0, floor});
    const double at =
        std::clamp(disk.x / box_.width * static_cast<double>(columns), 0.0, static_cast<double>(columns - 1));
    column[static_cast<std::size_t>(at)].push_back(i);
  }
  const auto lower = [this](std::uint32_t a, std::uint32_t b) { return disks_[a].z < disks_[b].z; };
  for (auto& one : column) std::stable_sort(one.begin(), one.end(), lower);
  for (std::size_t c = 0; c < columns; ++c) {
    for (std::size_t other : {c, c + 1}) {
      if (other == columns && !(box_.period > 0)) continue;
      const auto& beside = column[other % columns];
      std::size_t from = 0;
      for (const std::uint32_t i : column[c]) {
        while (from < beside.size() && disks_[beside[from]].z < disks_[i].z - reach) ++from;
        for (std::size_t o = from; o < beside.size() && disks_[beside[o]].z < disks_[i].z + reach; ++o) {
          const std::uint32_t k = beside[o];
          if (other == c && k <= i) continue;
          const TwoLanes d = gap_of(i, k);
          if (!(d[0] * d[0] + d[1] * d[1] < reach * reach)) continue;
          first_.push_back(place_of(i));
          second_.push_back(place_of(k));
        }
      }
    }
  }
  interleave();
  if (rough_) place_stretches(kept_);
  list_walls(floor);
  until_check_ = steps_a_check;
}

// Pairs of one disk stand apart: the sum of its forces need not wait for the pair before. And whole blocks of four.
void PressedBed::interleave() {
  constexpr std::size_t parts = 16;
  const std::size_t pairs = first_.size(), part = (pairs + parts - 1) / parts;
  in_contact_ = 0;
  active_first_.clear();
  active_second_.clear();
  for (std::size_t k = 0; k < part; ++k) {
    for (std::size_t q = k; q < pairs; q += part) {
      active_first_.push_back(first_[q]);
      active_second_.push_back(second_[q]);
    }
  }
  while (active_first_.size() % 4 != 0) {
    active_first_.push_back(place_of(count_));
    active_second_.push_back(place_of(count_ + 1));
  }
  first_ = active_first_;
  second_ = active_second_;
}

void PressedBed::list_walls(double floor) {
  const double near = disk_radius + skin / 2;
  for (auto* list : {&near_left_, &near_right_, &near_floor_, &near_lid_}) list->clear();
  for (std::uint32_t i = 0; i < count_; ++i) {
    const State& disk = disks_[i];
    if (!(box_.period > 0) && disk.x < near) near_left_.push_back(i);
    if (!(box_.period > 0) && disk.x > box_.width - near) near_right_.push_back(i);
    if (disk.z - floor < near) near_floor_.push_back(i);
    if (disk.z > box_.lid - near - 2 * skin) near_lid_.push_back(i);  // places are listed above the floor, which moves
  }
}

// Of all neighbours those that may touch before the next check, and those whose tangential springs are stretched, so
// that these are let go. Smooth ones in contact come first.
template <bool rough>
void PressedBed::choose_active(double dt) {
  const double ahead = foresight * steps_a_check * dt, margin = ahead * usual_approach_;
  const std::size_t pairs = first_.size();
  const Lanes contact = all_lanes(4 * disk_radius * disk_radius);
  active_first_.resize(pairs + 8);
  active_second_.resize(pairs + 8);
  if constexpr (rough) active_.resize(pairs + 8);
  apart_.resize(pairs + 1);
  std::size_t active = 0, apart = 0;
  Lanes approaches{};
  for (std::size_t p = 0; p < pairs; p += 4) {
    Differences d = differences(disks_.data(), &first_[p], &second_[p]);
    if (box_.period > 0) d.x = nearest_image(d.x, box_.period);
    const Lanes squared = fused(d.x, d.x, d.z * d.z), closing = fused(d.x, d.vx, d.z * d.vz);
    const LaneMask near = fused(all_lanes(-2 * margin), all_lanes(1), squared) < contact;
    const LaneMask comes = fused(all_lanes(2 * ahead), closing, squared) < contact;
    LaneMask asked = near | comes;
    if constexpr (rough) {
      Lanes stretch;
      std::memcpy(&stretch, &stretch_[p], sizeof stretch);
      asked |= stretch != Lanes{};
    }
    approaches += closing * closing;
    const LaneMask ahead_of_others = rough ? asked : squared < contact;
    for (std::size_t q = 0; q < 4; ++q) {
      active_first_[active] = first_[p + q];
      active_second_[active] = second_[p + q];
      if constexpr (rough) active_[active] = static_cast<std::uint32_t>(p + q);
      apart_[apart] = static_cast<std::uint32_t>(p + q);
      active += static_cast<std::size_t>(ahead_of_others[q] & 1);
      apart += static_cast<std::size_t>(asked[q] & ~ahead_of_others[q] & 1);
    }
  }
  const auto fill_block = [&] {
    for (; active % 4 != 0; ++active) {
      active_first_[active] = place_of(count_);
      active_second_[active] = place_of(count_ + 1);
      if constexpr (rough) active_[active] = static_cast<std::uint32_t>(pairs);  // of no pair
    }
  };
  fill_block();
  in_contact_ = active;
  for (std::size_t k = 0; k < apart; ++k, ++active) {
    active_first_[active] = first_[apart_[k]];
    active_second_[active] = second_[apart_[k]];
  }
  fill_block();
  active_first_.resize(active);
  active_second_.resize(active);
  usual_approach_ = std::sqrt(sum_of(approaches) / static_cast<double>(std::max<std::size_t>(pairs, 1)));
}

// ------------------------------------------------------------------------------------------------
// tangential springs

// Stretched springs of pairs, before these are listed anew.
void PressedBed::keep_stretches() {
  kept_.clear();
  for (std::size_t p = 0; p < first_.size(); ++p) {
    if (stretch_[p] != 0) kept_.push_back({disk_at(first_[p]), disk_at(second_[p]), stretch_[p]});
  }
}

// Where the pairs now stand. Those of walls stay with their disks.
void PressedBed::place_stretches(std::vector<Stretch>& stretches) {
  const auto key = [](std::uint32_t a, std::uint32_t b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  };
  const auto less = [&key](const Stretch& a, const Stretch& b) { return key(a.disk, a.other) < key(b.disk, b.other); };
  std::sort(stretches.begin(), stretches.end(), less);
  stretch_.assign(first_.size() + 1, 0);
  active_.resize(first_.size());
  for (std::size_t p = 0; p < first_.size(); ++p) {
    active_[p] = static_cast<std::uint32_t>(p);
    const Stretch wanted{disk_at(first_[p]), disk_at(second_[p]), 0};
    const auto found = std::lower_bound(stretches.begin(), stretches.end(), wanted, less);
    if (found != stretches.end() && !less(wanted, *found)) stretch_[p] = found->stretch;
  }
  for (const Stretch& one : stretches) {
    if (one.other >= count_) wall_stretch_[walls * one.disk + one.other - count_] = one.stretch;
  }
}

auto PressedBed::stretches() const -> std::vector<Stretch> {
  std::vector<Stretch> all;
  for (std::size_t p = 0; p < first_.size(); ++p) {
    if (stretch_[p] != 0) all.push_back({disk_at(first_[p]), disk_at(second_[p]), stretch_[p]});
  }
  for (std::uint32_t i = 0; i < wall_stretch_.size(); ++i) {
    if (wall_stretch_[i] != 0) all.push_back({i / walls, count_ + i % walls, wall_stretch_[i]});
  }
  return all;
}

double PressedBed::stretched() const {
  double sum = 0;
  for (const double stretch : stretch_) sum += 0.5 * pair_.grip.stiffness * stretch * stretch;
  const std::array<const Spring*, walls> springs{&side_, &side_, &floor_, &lid_};
  for (std::size_t i = 0; i < wall_stretch_.size(); ++i)
    sum += 0.5 * springs[i % walls]->grip.stiffness * wall_stretch_[i] * wall_stretch_[i];
  return sum;
}

void PressedBed::let_go() {
  damped_ += stretched();
  std::fill(stretch_.begin(), stretch_.end(), 0.0);
  std::fill(wall_stretch_.begin(), wall_stretch_.end(), 0.0);
}

// The force against the slip. slip: its speed now; slipped: half a step before. Neither the spring alone nor with its
// dashpot pulls more than friction allows.
[[gnu::always_inline]] inline auto PressedBed::pull(double& stretch, const Grip& grip, double slip, double slipped,
                                                    double normal_force) const -> Pulled {
  const double most = grip.most(normal_force), before = stretch, way = slipped * slip_time_;
  stretch = std::clamp(before + way, -most / grip.stiffness, most / grip.stiffness);
  const double force = grip.force(stretch, slip, normal_force);
  return {force, -force * way - 0.5 * grip.stiffness * (stretch * stretch - before * before)};
}

// Four numbers of disks, in the order of their places.
[[gnu::always_inline]] inline Lanes numbers_at(const double* numbers, const std::uint32_t* places) {
  const auto at = [&](int q) { return numbers[places[q] / sizeof(State)]; };
  return Lanes{at(0), at(1), at(2), at(3)};
}
[[gnu::always_inline]] inline Lanes clamped(Lanes value, Lanes most) {
  return select(value < -most, -most, select(most < value, most, value));
}

// The same of four pairs.
[[gnu::always_inline]] inline auto PressedBed::pull(Lanes stretch, Lanes slip, Lanes slipped, Lanes normal_force) const
    -> PulledLanes {
  const Lanes stiffness = all_lanes(pair_.grip.stiffness), damping = all_lanes(pair_.grip.damping);
  const Lanes most = all_lanes(pair_.grip.friction) * larger(normal_force, Lanes{});
  const Lanes way = slipped * all_lanes(slip_time_), now = clamped(stretch + way, most / stiffness);
  const Lanes force = clamped(-stiffness * now - damping * slip, most);
  return {force, now, -force * way - all_lanes(0.5) * stiffness * (now * now - stretch * stretch)};
}

template <bool periodic>
void PressedBed::add_rough_pair_forces() {
  double squares = 0, count = 0, rubbed = 0;
  const State* const disks = disks_.data();
  const double *const halfway = halfway_.data(), *const rim = rim_.data(), *const rim_halfway = rim_halfway_.data();
  double *const forces = force_.data(), *const rim_forces = rim_force_.data(), *const stretch = stretch_.data();
  const double spin_up = inverse_inertia_ratio_, half_stiffness = 0.5 * pair_.grip.stiffness;
  const Lanes one = all_lanes(1), stiffness = all_lanes(pair_.stiffness), damping = all_lanes(pair_.damping);
  const std::size_t active = active_first_.size();
  const std::uint32_t *i = active_first_.data(), *k = active_second_.data(), *pairs = active_.data();
  for (const std::uint32_t* const end = i + active; i != end; i += 4, k += 4, pairs += 4) {
    Differences d = differences(disks, i, k);
    if constexpr (periodic) d.x = nearest_image(d.x, box_.period);
    const Lanes squared = d.x * d.x + d.z * d.z;
    const LaneMask touch = squared < one;
    const Lanes before = {stretch[pairs[0]], stretch[pairs[1]], stretch[pairs[2]], stretch[pairs[3]]};
    if (!any_of(touch | (before != Lanes{}))) continue;
    const Lanes distance = sqrt_lanes(squared), nx = d.x / distance, nz = d.z / distance;
    const TwoDifferences past = differences_of_two<2>(halfway, i, k);
    const Lanes v = d.vx * nx + d.vz * nz, side = d.vz * nx - d.vx * nz, side_past = past.z * nx - past.x * nz;
    const Lanes force = stiffness * (one - distance) - damping * v;
    const PulledLanes pulled = pull(before, numbers_at(rim, i) + numbers_at(rim, k) - side,
                                    numbers_at(rim_halfway, i) + numbers_at(rim_halfway, k) - side_past, force);
    const Lanes fx = force * nx + pulled.force * nz, fz = force * nz - pulled.force * nx;
    const Lanes lost = select(touch, pulled.lost, all_lanes(half_stiffness) * before * before);
    const Lanes now = unless(~touch, pulled.stretch), spins = all_lanes(spin_up) * pulled.force, square = v * v;
#pragma GCC unroll 4
    for (int q = 0; q < 4; ++q) {
      rubbed += lost[q];
      stretch[pairs[q]] = now[q];
      if (!touch[q]) continue;
      const TwoLanes on_second = {fx[q], fz[q]};
      const std::uint32_t first = disk_at(i[q]), second = disk_at(k[q]);
      put_pair(forces + 4 * first, pair_at(forces + 4 * first) - on_second);
      put_pair(forces + 4 * second, pair_at(forces + 4 * second) + on_second);
      rim_forces[first] += spins[q];
      rim_forces[second] += spins[q];
      squares += square[q];
      count += 1;
    }
  }
  rubbed_ += rubbed;
  touching_ = count;
  pair_squares_ = squares;
}

// ------------------------------------------------------------------------------------------------

void PressedBed::check(const FloorMotion::Motion& floor, double dt) {
  until_check_ = steps_a_check;
  double farthest = 0, fastest = 0, squares = 0, side_squares = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const TwoLanes moved = pair_at(&disks_[i].x) - TwoLanes{0, floor.position} - pair_at(&listed_[2 * i]);
    const TwoLanes speed = pair_at(&disks_[i].vx) - TwoLanes{0, floor.velocity};
    farthest = std::max(farthest, moved[0] * moved[0] + moved[1] * moved[1]);
    double square = speed[0] * speed[0] + speed[1] * speed[1];
    if (rough_) square += rim_[i] * rim_[i];
    fastest = std::max(fastest, square);
    squares += square;
    side_squares += disks_[i].vx * disks_[i].vx;
  }
  fastest_ = std::sqrt(fastest);
  mean_square_speed_ = squares / count_;
  side_temperature_ = side_squares / count_;
  if (std::sqrt(farthest) + steps_a_check * dt * fastest_ > 0.5 * skin) {
    list_pairs(floor.position);
  } else {
    rough_ ? choose_active<true>(dt) : choose_active<false>(dt);
  }
}

// ------------------------------------------------------------------------------------------------
// forces and steps

template <bool periodic>
void PressedBed::add_pair_forces() {
  const std::size_t pairs = active_first_.size();
  const State* const disks = disks_.data();
  char* const force = reinterpret_cast<char*>(force_.data());
  const Lanes stiffness = all_lanes(pair_.stiffness), damping = all_lanes(pair_.damping), one = all_lanes(1);
  Lanes squares{}, count{};
  const auto add = [force](std::uint32_t first, std::uint32_t second, Lanes f) {
    Lanes a, b;
    std::memcpy(&a, force + first, sizeof a);
    std::memcpy(&b, force + second, sizeof b);
    a -= f, b += f;
    std::memcpy(force + first, &a, sizeof a);
    std::memcpy(force + second, &b, sizeof b);
  };
  for (std::size_t p = 0; p < pairs; p += 4) {
    const std::uint32_t *i = &active_first_[p], *k = &active_second_[p];
    if (p >= in_contact_) {
      TwoDifferences d = differences_of_two<4>(&disks->x, i, k);
      if constexpr (periodic) d.x = nearest_image(d.x, box_.period);
      if (!any_of(fused(d.x, d.x, d.z * d.z) < one)) continue;
    }
    Differences d = differences(disks, i, k);
    if constexpr (periodic) d.x = nearest_image(d.x, box_.period);
    const Lanes u = one - fused(d.x, d.x, d.z * d.z);  // 1 - r^2
    const LaneMask touch = u > all_lanes(0);
    // 1 - r and 1 / r of r = sqrt(1 - u), to 1e-10 for overlaps of 0.01 D
    const Lanes overlap =
        u * fused(u, fused(u, fused(u, all_lanes(5.0 / 128), all_lanes(1.0 / 16)), all_lanes(0.125)), all_lanes(0.5));
    const Lanes inverse = fused(
        u, fused(u, fused(u, fused(u, all_lanes(35.0 / 128), all_lanes(5.0 / 16)), all_lanes(0.375)), all_lanes(0.5)),
        one);
    const Lanes nx = d.x * inverse, nz = d.z * inverse, v = fused(d.vx, nx, d.vz * nz);
    const Lanes dashpot = unless(~touch, -(damping * v)), f = unless(~touch, fused(stiffness, overlap, -(damping * v)));
    squares += unless(~touch, v * v);
    count += unless(~touch, one);
    const Lanes fx = f * nx, fz = f * nz, dx = dashpot * nx, dz = dashpot * nz;
    const Lanes f02 = __builtin_shufflevector(fx, fz, 0, 4, 2, 6), f13 = __builtin_shufflevector(fx, fz, 1, 5, 3, 7);
    const Lanes d02 = __builtin_shufflevector(dx, dz, 0, 4, 2, 6), d13 = __builtin_shufflevector(dx, dz, 1, 5, 3, 7);
    add(i[0], k[0], __builtin_shufflevector(f02, d02, 0, 1, 4, 5));
    add(i[1], k[1], __builtin_shufflevector(f13, d13, 0, 1, 4, 5));
    add(i[2], k[2], __builtin_shufflevector(f02, d02, 2, 3, 6, 7));
    add(i[3], k[3], __builtin_shufflevector(f13, d13, 2, 3, 6, 7));
  }
  touching_ = sum_of(count);
  pair_squares_ = sum_of(squares);
}

auto PressedBed::wall_force(std::uint32_t i, TwoLanes inward, double place, double speed, const Spring& spring,
                            TwoLanes velocity) const -> WallContacts {
  const TwoLanes along = inward * pair_at(&disks_[i].x), flow = inward * velocity;
  const double gap = along[0] + along[1] - place - disk_radius;
  if (!(gap < 0)) return {};
  const double v = flow[0] + flow[1] - speed;
  return {-spring.stiffness * gap - spring.damping * v, spring.damping * v * v};
}

// inward: from the wall into the box; place and speed of the wall that way.
auto PressedBed::add_wall_forces(const std::vector<std::uint32_t>& near, Wall wall, TwoLanes inward, double place,
                                 double speed, const Spring& spring) -> WallContacts {
  WallContacts contacts;
  for (const std::uint32_t i : near) {
    const WallContacts one = wall_force(i, inward, place, speed, spring, velocity_of(i));
    put_pair(&force_[4 * i], fused(both(one.force), inward, pair_at(&force_[4 * i])));
    contacts.force += one.force;
    contacts.lost += one.lost;
    if (!rough_ || !(spring.grip.friction > 0)) continue;
    double& stretch = wall_stretch_[walls * i + wall];
    if (one.force == 0) {
      if (stretch != 0) rubbed_ += 0.5 * spring.grip.stiffness * stretch * stretch;
      stretch = 0;
      continue;
    }
    const TwoLanes tangent = {inward[1], -inward[0]};
    const TwoLanes now = velocity_of(i) * tangent, past = pair_at(&halfway_[2 * i]) * tangent;
    const Pulled side =
        pull(stretch, spring.grip, now[0] + now[1] + rim_[i], past[0] + past[1] + rim_halfway_[i], one.force);
    put_pair(&force_[4 * i], fused(both(side.force), tangent, pair_at(&force_[4 * i])));
    rim_force_[i] += inverse_inertia_ratio_ * side.force;
    rubbed_ += side.lost;
  }
  return contacts;
}

// To forces of 0.
void PressedBed::add_forces(const FloorMotion::Motion& floor) {
  rubbed_ = 0;
  if (rough_) {
    box_.period > 0 ? add_rough_pair_forces<true>() : add_rough_pair_forces<false>();
  } else {
    box_.period > 0 ? add_pair_forces<true>() : add_pair_forces<false>();
  }
  loss_rate_ = pair_.damping * pair_squares_;
  loss_rate_ += add_wall_forces(near_left_, at_left, TwoLanes{1, 0}, 0, 0, side_).lost;
  loss_rate_ += add_wall_forces(near_right_, at_right, TwoLanes{-1, 0}, -box_.width, 0, side_).lost;
  loss_rate_ += add_wall_forces(near_lid_, at_lid, TwoLanes{0, -1}, -box_.lid, 0, lid_).lost;
  const WallContacts on_floor =
      add_wall_forces(near_floor_, at_floor, TwoLanes{0, 1}, floor.position, floor.velocity, floor_);
  loss_rate_ += on_floor.lost;
  floor_force_ = on_floor.force;
  floor_at_ = floor;
}

// What the dashpots of pairs take from the disks at the velocities that they have. Their forces are of the velocities
// foreseen: in a packed bed, where many disks brake one another, these are larger.
double PressedBed::lost_in_dashpots() const {
  const TwoLanes weight = {0, -1}, half = both(0.5 * last_step_);
  TwoLanes lost{};
  for (std::uint32_t i = 0; i < count_; ++i) {
    const TwoLanes v = fused(half, pair_at(&force_[4 * i]) + weight, pair_at(&halfway_[2 * i]));
    lost -= pair_at(&force_[4 * i + 2]) * v;
  }
  return lost[0] + lost[1];
}

void PressedBed::step(const FloorMotion::Motion& before, const FloorMotion::Motion& after, double dt) {
  assert(dt > 0);
  const TwoLanes weight = {0, -1}, half = both(0.5 * dt), halves = both(0.5 * (last_step_ + dt)), whole = both(dt);
  for (std::uint32_t i = 0; i < count_; ++i) {
    double* const disk = &disks_[i].x;
    const TwoLanes a = pair_at(&force_[4 * i]) + weight, v = fused(halves, a, pair_at(&halfway_[2 * i]));
    put_pair(&halfway_[2 * i], v);
    put_pair(disk, fused(whole, v, pair_at(disk)));
    put_pair(disk + 2, fused(half, a, v));
    put_pair(&force_[4 * i], TwoLanes{});
    put_pair(&force_[4 * i + 2], TwoLanes{});
  }
  if (rough_) {
    for (std::uint32_t i = 0; i < count_; ++i) {
      rim_halfway_[i] += 0.5 * (last_step_ + dt) * rim_force_[i];
      rim_[i] = rim_halfway_[i] + 0.5 * dt * rim_force_[i];
      rim_force_[i] = 0;
    }
  }
  last_step_ = dt;
  if (--until_check_ == 0) check(after, dt);
  const double force_before = floor_force_, loss_before = loss_rate_;
  slip_time_ = dt;
  add_forces(after);
  slip_time_ = 0;
  if (!rough_) loss_rate_ += lost_in_dashpots() - pair_.damping * pair_squares_;
  floor_work_ += 0.5 * (force_before + floor_force_) * (after.position - before.position);
  damped_ += 0.5 * (loss_before + loss_rate_) * dt + rubbed_;
}

void PressedBed::lie(const FloorMotion::Motion& floor) {
  last_step_ = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const TwoLanes velocity = {0, floor.velocity};
    put_pair(&halfway_[2 * i], velocity);
    put_pair(&disks_[i].vx, velocity);
    put_pair(&force_[4 * i], TwoLanes{0, 1 + floor.acceleration});
  }
  for (auto* values : {&rim_, &rim_halfway_, &rim_force_}) std::fill(values->begin(), values->end(), 0.0);
  floor_force_ = count_ * (1 + floor.acceleration);
  loss_rate_ = 0;
}

void PressedBed::carry(const FloorMotion::Motion& before, const FloorMotion::Motion& after) {
  const double rise = after.position - before.position;
  for (std::uint32_t i = 0; i < count_; ++i) disks_[i].z += rise;
  floor_work_ += count_ * (rise + 0.5 * (after.velocity * after.velocity - before.velocity * before.velocity));
  floor_at_ = after;
  lie(after);
}

void PressedBed::wake(const FloorMotion::Motion& floor) {
  list_pairs(floor.position);
  std::fill(force_.begin(), force_.end(), 0.0);
  std::fill(rim_force_.begin(), rim_force_.end(), 0.0);
  add_forces(floor);
  damped_ += rubbed_;
}

double PressedBed::approach() const { return std::sqrt(pair_squares_ / std::max(touching_, 1.0)); }

double PressedBed::compressed() const {
  double sum = 0;
  const auto add = [&sum](double overlap, const Spring& spring) {
    if (overlap > 0) sum += 0.5 * spring.stiffness * overlap * overlap;
  };
  for (std::size_t p = 0; p < first_.size(); ++p) {
    const std::uint32_t i = disk_at(first_[p]), k = disk_at(second_[p]);
    if (i >= count_) continue;
    const TwoLanes d = gap_of(i, k);
    add(2 * disk_radius - std::sqrt(d[0] * d[0] + d[1] * d[1]), pair_);
  }
  for (const std::uint32_t i : near_left_) add(disk_radius - disks_[i].x, side_);
  for (const std::uint32_t i : near_right_) add(disks_[i].x + disk_radius - box_.width, side_);
  for (const std::uint32_t i : near_lid_) add(disks_[i].z + disk_radius - box_.lid, lid_);
  for (const std::uint32_t i : near_floor_) add(floor_at_.position + disk_radius - disks_[i].z, floor_);
  if (rough_) sum += stretched();
  return sum;
}

void PressedBed::separate(double floor, double most, int sweeps) {
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    double worst = 0;
    const auto excess = [&worst](double overlap) {
      worst = std::max(worst, overlap);
      return std::max(overlap, 0.0);
    };
    for (const std::uint32_t i : near_floor_) disks_[i].z += excess(floor + disk_radius - disks_[i].z);
    for (const std::uint32_t i : near_lid_) disks_[i].z -= excess(disks_[i].z + disk_radius - box_.lid);
    for (const std::uint32_t i : near_left_) disks_[i].x += excess(disk_radius - disks_[i].x);
    for (const std::uint32_t i : near_right_) disks_[i].x -= excess(disks_[i].x + disk_radius - box_.width);
    for (std::size_t p = 0; p < first_.size(); ++p) {
      const std::uint32_t i = disk_at(first_[p]), k = disk_at(second_[p]);
      if (i >= count_) continue;
      const TwoLanes d = gap_of(i, k);
      const double squared = d[0] * d[0] + d[1] * d[1];
      if (squared >= 4 * disk_radius * disk_radius) continue;
      const double distance = std::sqrt(squared);
      const TwoLanes move = both(0.5 * overdone * excess(2 * disk_radius - distance) / distance) * d;
      put_pair(&disks_[i].x, pair_at(&disks_[i].x) - move);
      put_pair(&disks_[k].x, pair_at(&disks_[k].x) + move);
    }
    if (worst <= most) return;
  }
}

}  // namespace shakebed::sim
