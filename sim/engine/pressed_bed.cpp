#include "sim/engine/pressed_bed.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <numbers>

namespace shakebed::sim {

namespace {

constexpr double disk_radius = 0.5;
// How far beyond contact two disks are neighbours, and a disk and a wall [D]. The next neighbours but one of a packing
// are much farther away.
constexpr double skin = 0.15, wall_skin = 0.04;
constexpr double far_off = -100;  // of the disks that touch nothing, one from the next
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

// Four numbers side by side, anywhere.
[[gnu::always_inline]] inline Lanes four_at(const double* numbers) {
  Lanes lanes;
  std::memcpy(&lanes, numbers, sizeof lanes);
  return lanes;
}
[[gnu::always_inline]] inline void put_four(double* numbers, Lanes lanes) {
  std::memcpy(numbers, &lanes, sizeof lanes);
}
// Of four pairs at once: from the first disks, to the second. Five disks in a row: what has just been written is not
// read again, which would have to wait.
template <bool in_row>
[[gnu::always_inline]] inline void exchange(double* numbers, const PairBlock& pair, Lanes amount) {
  double *const first = numbers + pair.first, *const second = numbers + pair.second;
  if constexpr (in_row) {
    put_four(first, four_at(first) + (__builtin_shufflevector(amount, Lanes{}, 4, 0, 1, 2) - amount));
    first[PressedRows::lanes] += amount[3];
  } else {
    put_four(first, four_at(first) - amount);
    put_four(second, four_at(second) + amount);
  }
}
// The same amount to both.
template <bool in_row>
[[gnu::always_inline]] inline void add_to_both(double* numbers, const PairBlock& pair, Lanes amount) {
  double *const first = numbers + pair.first, *const second = numbers + pair.second;
  if constexpr (in_row) {
    put_four(first, four_at(first) + (__builtin_shufflevector(amount, Lanes{}, 4, 0, 1, 2) + amount));
    first[PressedRows::lanes] += amount[3];
  } else {
    put_four(first, four_at(first) + amount);
    put_four(second, four_at(second) + amount);
  }
}
[[gnu::always_inline]] inline Lanes difference(const double* numbers, const PairBlock& pair) {
  return four_at(numbers + pair.second) - four_at(numbers + pair.first);
}
Lanes nearest_image(Lanes dx, double period) {
  const Lanes large = all_lanes(0x1.8p52);
  return fused(all_lanes(-period), fused(dx, all_lanes(1 / period), large) - large, dx);
}
double largest_of(Lanes lanes) { return std::max(std::max(lanes[0], lanes[1]), std::max(lanes[2], lanes[3])); }
double sum_of(Lanes lanes) { return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]); }

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

auto PressedBed::numbers() -> Numbers {
  return {x_.data(),         z_.data(),           vx_.data(),       vz_.data(),        halfway_x_.data(),
          halfway_z_.data(), force_x_.data(),     force_z_.data(),  dashpot_x_.data(), dashpot_z_.data(),
          rim_.data(),       rim_halfway_.data(), rim_force_.data()};
}

void PressedBed::begin(std::vector<State> disks, const FloorMotion::Motion& floor, double contact_time,
                       const std::vector<double>& spins, const std::vector<Stretch>& stretches) {
  count_ = static_cast<std::uint32_t>(disks.size());
  const std::size_t lanes = PressedRows::lanes, places = (count_ + 2 * lanes - 1) / lanes * lanes;
  for (auto* numbers : {&x_, &z_, &vx_, &vz_, &halfway_x_, &halfway_z_, &force_x_, &force_z_, &dashpot_x_, &dashpot_z_,
                        &rim_, &rim_halfway_, &rim_force_})
    numbers->assign(places, 0);
  disk_of_.resize(count_);
  place_of_.resize(count_);
  for (std::uint32_t i = 0; i < count_; ++i) {
    disk_of_[i] = place_of_[i] = i;
    x_[i] = disks[i].x;
    z_[i] = disks[i].z;
    halfway_x_[i] = vx_[i] = disks[i].vx;
    halfway_z_[i] = vz_[i] = disks[i].vz;
  }
  for (std::size_t i = count_; i < places; ++i) x_[i] = z_[i] = far_off * static_cast<double>(i - count_ + 1);
  for (std::size_t i = 0; i < spins.size(); ++i) rim_[i] = rim_halfway_[i] = disk_radius * spins[i];
  if (rough_) wall_stretch_.assign(std::size_t{walls} * count_, 0);
  stretch_.clear();
  last_step_ = floor_work_ = damped_ = 0;
  fastest_ = mean_square_speed_ = side_temperature_ = never;
  soften(contact_time);
  list_neighbours();
  list_walls(floor.position, 0);
  if (rough_) place_stretches(stretches);
  until_check_ = steps_a_check;
  add_forces(floor);
  damped_ = rubbed_;  // of springs that were stretched farther than friction allows
}

auto PressedBed::at(std::uint32_t disk, double later) const -> State {
  const std::uint32_t i = place_of_[disk];
  const TwoLanes a = {force_x_[i], force_z_[i] - 1};
  const TwoLanes v = fused(both(0.5 * last_step_), a, TwoLanes{halfway_x_[i], halfway_z_[i]});
  const TwoLanes place = fused(both(later), fused(both(0.5 * later), a, v), TwoLanes{x_[i], z_[i]});
  const TwoLanes velocity = fused(both(later), a, v);
  return {place[0], place[1], velocity[0], velocity[1]};
}

// ------------------------------------------------------------------------------------------------
// neighbours

TwoLanes PressedBed::gap_of(std::uint32_t i, std::uint32_t k) const {
  TwoLanes d = {x_[k] - x_[i], z_[k] - z_[i]};
  if (box_.period > 0) d[0] -= box_.period * std::nearbyint(d[0] / box_.period);
  return d;
}

// New places for the disks, along their rows, and all pairs within the skin.
void PressedBed::list_neighbours() {
  const std::vector<Stretch> kept = rough_ && !stretch_.empty() ? pair_stretches() : std::vector<Stretch>{};
  if (box_.period > 0) {
    for (std::uint32_t i = 0; i < count_; ++i) x_[i] -= box_.period * std::floor(x_[i] / box_.period);
  }
  rows_.find(x_, z_, count_, box_.width, box_.period, 2 * disk_radius + skin);
  const std::vector<std::uint32_t>& order = rows_.order();
  const auto permute = [&order](auto& numbers, auto& before) {
    before.assign(numbers.begin(), numbers.end());
    for (std::size_t place = 0; place < order.size(); ++place) numbers[place] = before[order[place]];
  };
  for (auto* numbers : {&x_, &z_, &vx_, &vz_, &halfway_x_, &halfway_z_, &force_x_, &force_z_, &dashpot_x_, &dashpot_z_})
    permute(*numbers, permuted_);
  if (rough_) {
    for (auto* numbers : {&rim_, &rim_halfway_, &rim_force_}) permute(*numbers, permuted_);
  }
  permute(disk_of_, place_of_);
  listed_x_ = x_;
  listed_z_ = z_;
  for (std::uint32_t i = 0; i < count_; ++i) place_of_[disk_of_[i]] = i;
  if (rough_) place_stretches(kept);
}

// margin: how far a disk moves until the next check.
void PressedBed::list_walls(double floor, double margin) {
  const double near = disk_radius + std::max(wall_skin, 2 * margin);
  for (auto* list : {&near_left_, &near_right_, &near_floor_, &near_lid_}) list->clear();
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (z_[i] - floor < near) near_floor_.push_back(i);
    if (z_[i] > box_.lid - near) near_lid_.push_back(i);
    if (box_.period > 0) continue;
    if (x_[i] < near) near_left_.push_back(i);
    if (x_[i] > box_.width - near) near_right_.push_back(i);
  }
}

// ------------------------------------------------------------------------------------------------
// tangential springs

auto PressedBed::pair_stretches() const -> std::vector<Stretch> {
  std::vector<Stretch> all;
  each_neighbour([&](std::uint32_t i, std::uint32_t k, std::size_t lane) {
    if (stretch_[lane] != 0) all.push_back({disk_of_[i], disk_of_[k], stretch_[lane]});
  });
  return all;
}

// Those of walls stay with their disks.
void PressedBed::place_stretches(std::vector<Stretch> stretches) {
  const auto key = [](const Stretch& one) {
    return std::uint64_t{std::min(one.disk, one.other)} << 32 | std::max(one.disk, one.other);
  };
  const auto less = [&key](const Stretch& a, const Stretch& b) { return key(a) < key(b); };
  std::sort(stretches.begin(), stretches.end(), less);
  stretch_.assign(PressedRows::lanes * rows_.blocks().size(), 0);
  each_neighbour([&](std::uint32_t i, std::uint32_t k, std::size_t lane) {
    const Stretch wanted{disk_of_[i], disk_of_[k], 0};
    const auto found = std::lower_bound(stretches.begin(), stretches.end(), wanted, less);
    if (found != stretches.end() && !less(wanted, *found)) stretch_[lane] = found->stretch;
  });
  for (const Stretch& one : stretches) {
    if (one.other >= count_) wall_stretch_[walls * one.disk + one.other - count_] = one.stretch;
  }
}

auto PressedBed::stretches() const -> std::vector<Stretch> {
  std::vector<Stretch> all = pair_stretches();
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

[[gnu::always_inline]] inline Lanes clamped(Lanes value, Lanes most) {
  return select(value < -most, -most, select(most < value, most, value));
}

// The same of four pairs.
struct PressedBed::LaneGrip {
  Lanes stiffness, damping, friction, reach, time;  // reach: how far a normal force of 1 lets the spring be stretched
  LaneGrip(const Grip& grip, double step)
      : stiffness(all_lanes(grip.stiffness)),
        damping(all_lanes(grip.damping)),
        friction(all_lanes(grip.friction)),
        reach(all_lanes(grip.friction > 0 ? grip.friction / grip.stiffness : 0)),
        time(all_lanes(step)) {}
  struct Pulled {
    Lanes force, stretch, lost;
  };
  [[gnu::always_inline]] Pulled pull(Lanes stretch, Lanes slip, Lanes slipped, Lanes normal_force) const {
    const Lanes pressed = larger(normal_force, Lanes{}), way = slipped * time;
    const Lanes now = clamped(stretch + way, reach * pressed);
    const Lanes force = clamped(-stiffness * now - damping * slip, friction * pressed);
    return {force, now, -force * way - all_lanes(0.5) * stiffness * (now * now - stretch * stretch)};
  }
};

template <bool periodic, bool in_row>
void PressedBed::add_rough_pair_forces(const PairBlock* pair, const PairBlock* end) {
  const bool counts = check_due();
  const double period = box_.period;
  Lanes squares{}, count{}, rubbed{};
  const Lanes one = all_lanes(1), spring = all_lanes(0.5 * pair_.stiffness), damping = all_lanes(pair_.damping),
              spin_up = all_lanes(inverse_inertia_ratio_), half_grip = all_lanes(0.5 * pair_.grip.stiffness);
  const LaneGrip grip(pair_.grip, slip_time_);
  const Numbers by = numbers();
  double* stretch = stretch_.data() + PressedRows::lanes * (pair - rows_.blocks().data());
  for (; pair != end; ++pair) {
    Lanes dx = difference(by.x, *pair);
    const Lanes dz = difference(by.z, *pair);
    if constexpr (periodic) dx = nearest_image(dx, period);
    const Lanes u = fused(-dx, dx, fused(-dz, dz, one)), before = four_at(stretch);
    const LaneMask touch = u > Lanes{};
    stretch += PressedRows::lanes;
    if (!any_of(touch | (before != Lanes{}))) continue;
    const Lanes vx = difference(by.vx, *pair), vz = difference(by.vz, *pair);
    const Lanes past_x = difference(by.halfway_x, *pair), past_z = difference(by.halfway_z, *pair);
    const Lanes v = fused(vx, dx, vz * dz), dashpot = unless(~touch, -(damping * v));
    const Lanes force = unless(~touch, fused(spring, u, dashpot));
    const auto rims = [pair](const double* rim) { return four_at(rim + pair->first) + four_at(rim + pair->second); };
    const LaneGrip::Pulled pulled = grip.pull(before, rims(by.rim) - fused(vz, dx, -(vx * dz)),
                                              rims(by.rim_halfway) - fused(past_z, dx, -(past_x * dz)), force);
    const Lanes along = unless(~touch, pulled.force);
    put_four(stretch - PressedRows::lanes, unless(~touch, pulled.stretch));
    rubbed += select(touch, pulled.lost, half_grip * before * before);
    exchange<in_row>(by.force_x, *pair, fused(force, dx, along * dz));
    exchange<in_row>(by.force_z, *pair, fused(force, dz, -(along * dx)));
    exchange<in_row>(by.dashpot_x, *pair, dashpot * dx);
    exchange<in_row>(by.dashpot_z, *pair, dashpot * dz);
    add_to_both<in_row>(by.rim_force, *pair, spin_up * along);
    if (!counts) continue;
    squares += unless(~touch, v * v);
    count += unless(~touch, one);
  }
  rubbed_ += sum_of(rubbed);
  touching_ += sum_of(count);
  pair_squares_ += sum_of(squares);
}

// ------------------------------------------------------------------------------------------------

void PressedBed::check(const FloorMotion::Motion& floor, double dt) {
  until_check_ = steps_a_check;
  constexpr LaneMask lane = {0, 1, 2, 3};
  Lanes sum_x{}, sum_z{}, sum_vx{}, sum_vz{}, fastest{}, squares{}, side_squares{};
  // Calls visit(first place, mask of the lanes without a disk).
  const auto each_four = [&](auto visit) {
    for (std::size_t i = 0; i < count_; i += PressedRows::lanes)
      visit(i, lane >= static_cast<std::int64_t>(count_ - i));
  };
  const Lanes floor_speed = all_lanes(floor.velocity);
  each_four([&](std::size_t i, LaneMask none) {
    const Lanes vx = four_at(&vx_[i]), vz = four_at(&vz_[i]), rim = four_at(&rim_[i]), up = vz - floor_speed;
    const Lanes side = unless(none, vx * vx), square = unless(none, side + up * up + rim * rim);
    fastest = larger(fastest, square);
    squares += square;
    side_squares += side;
    sum_vx += unless(none, vx);
    sum_vz += unless(none, vz);
    sum_x += unless(none, four_at(&x_[i]) - four_at(&listed_x_[i]));
    sum_z += unless(none, four_at(&z_[i]) - four_at(&listed_z_[i]));
  });
  fastest_ = std::sqrt(largest_of(fastest));
  mean_square_speed_ = sum_of(squares) / count_;
  side_temperature_ = sum_of(side_squares) / count_;
  // Against the mean of all: two disks approach by no more than twice of it.
  const auto mean = [this](Lanes sum) { return all_lanes(sum_of(sum) / count_); };
  const Lanes x = mean(sum_x), z = mean(sum_z), mean_vx = mean(sum_vx), mean_vz = mean(sum_vz);
  Lanes farthest{}, fastest_of_all{};
  each_four([&](std::size_t i, LaneMask none) {
    const Lanes dx = four_at(&x_[i]) - four_at(&listed_x_[i]) - x, dz = four_at(&z_[i]) - four_at(&listed_z_[i]) - z;
    const Lanes vx = four_at(&vx_[i]) - mean_vx, vz = four_at(&vz_[i]) - mean_vz;
    farthest = larger(farthest, unless(none, dx * dx + dz * dz));
    fastest_of_all = larger(fastest_of_all, unless(none, vx * vx + vz * vz));
  });
  const double ahead = steps_a_check * dt;
  if (std::sqrt(largest_of(farthest)) + ahead * std::sqrt(largest_of(fastest_of_all)) > 0.5 * skin) list_neighbours();
  list_walls(floor.position, ahead * fastest_);
}

// ------------------------------------------------------------------------------------------------
// forces and steps

template <bool periodic, bool in_row>
void PressedBed::add_pair_forces(const PairBlock* pair, const PairBlock* end) {
  const bool counts = check_due();
  const double period = box_.period;
  const Numbers by = numbers();
  Lanes squares{}, count{};
  const Lanes one = all_lanes(1), spring = all_lanes(0.5 * pair_.stiffness), damping = all_lanes(pair_.damping);
  for (; pair != end; ++pair) {
    Lanes dx = difference(by.x, *pair);
    const Lanes dz = difference(by.z, *pair);
    if constexpr (periodic) dx = nearest_image(dx, period);
    const Lanes u = fused(-dx, dx, fused(-dz, dz, one));  // 1 - r^2
    if (all_negative(u)) continue;
    const LaneMask apart = u <= Lanes{};
    const Lanes v = fused(difference(by.vx, *pair), dx, difference(by.vz, *pair) * dz);
    const Lanes dashpot = unless(apart, damping * v), force = unless(apart, fused(spring, u, -dashpot));
    exchange<in_row>(by.force_x, *pair, force * dx);
    exchange<in_row>(by.force_z, *pair, force * dz);
    exchange<in_row>(by.dashpot_x, *pair, -(dashpot * dx));
    exchange<in_row>(by.dashpot_z, *pair, -(dashpot * dz));
    if (!counts) continue;
    squares += unless(apart, v * v);
    count += unless(apart, one);
  }
  touching_ += sum_of(count);
  pair_squares_ += sum_of(squares);
}

auto PressedBed::wall_force(std::uint32_t i, TwoLanes inward, double place, double speed, const Spring& spring) const
    -> WallContacts {
  const TwoLanes along = inward * TwoLanes{x_[i], z_[i]}, flow = inward * velocity_of(i);
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
    const WallContacts one = wall_force(i, inward, place, speed, spring);
    force_x_[i] += one.force * inward[0];
    force_z_[i] += one.force * inward[1];
    contacts.force += one.force;
    contacts.lost += one.lost;
    if (!(spring.grip.friction > 0)) continue;  // of smooth disks none has any
    double& stretch = wall_stretch_[walls * disk_of_[i] + wall];
    if (one.force == 0 && stretch == 0) continue;  // apart, and nothing to let go
    const TwoLanes tangent = {inward[1], -inward[0]};
    const TwoLanes now = velocity_of(i) * tangent, past = TwoLanes{halfway_x_[i], halfway_z_[i]} * tangent;
    const Pulled side =
        pull(stretch, spring.grip, now[0] + now[1] + rim_[i], past[0] + past[1] + rim_halfway_[i], one.force);
    force_x_[i] += side.force * tangent[0];
    force_z_[i] += side.force * tangent[1];
    rim_force_[i] += inverse_inertia_ratio_ * side.force;
    rubbed_ += side.lost;
  }
  return contacts;
}

// To forces of 0.
template <bool periodic>
void PressedBed::add_all_pair_forces() {
  const PairBlock* const blocks = rows_.blocks().data();
  const PairBlock *const others = blocks + rows_.in_rows(), *const end = blocks + rows_.blocks().size();
  if (check_due()) touching_ = pair_squares_ = 0;
  if (rough_) {
    add_rough_pair_forces<periodic, true>(blocks, others);
    add_rough_pair_forces<periodic, false>(others, end);
  } else {
    add_pair_forces<periodic, true>(blocks, others);
    add_pair_forces<periodic, false>(others, end);
  }
}

void PressedBed::add_forces(const FloorMotion::Motion& floor) {
  rubbed_ = 0;
  box_.period > 0 ? add_all_pair_forces<true>() : add_all_pair_forces<false>();
  wall_loss_rate_ = add_wall_forces(near_left_, at_left, TwoLanes{1, 0}, 0, 0, side_).lost;
  wall_loss_rate_ += add_wall_forces(near_right_, at_right, TwoLanes{-1, 0}, -box_.width, 0, side_).lost;
  wall_loss_rate_ += add_wall_forces(near_lid_, at_lid, TwoLanes{0, -1}, -box_.lid, 0, lid_).lost;
  const WallContacts on_floor =
      add_wall_forces(near_floor_, at_floor, TwoLanes{0, 1}, floor.position, floor.velocity, floor_);
  wall_loss_rate_ += on_floor.lost;
  floor_force_ = on_floor.force;
  floor_at_ = floor;
}

// What the dashpots take. Those of pairs take it from the disks at the velocities that these have; their forces are of
// the velocities foreseen. In a packed bed, where many disks brake one another, the latter are larger.
double PressedBed::loss_rate() const {
  double lost = wall_loss_rate_;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const double vx = halfway_x_[i] + 0.5 * last_step_ * force_x_[i];
    const double vz = halfway_z_[i] + 0.5 * last_step_ * (force_z_[i] - 1);
    lost -= dashpot_x_[i] * vx + dashpot_z_[i] * vz;
  }
  return lost;
}

// On by a step, to forces of 0. Books what the dashpots took from the middle of the step before to that of this one.
void PressedBed::move(double dt) {
  const Lanes half = all_lanes(0.5 * dt), last_half = all_lanes(0.5 * last_step_),
              halves = all_lanes(0.5 * (last_step_ + dt)), whole = all_lanes(dt), weight = all_lanes(-1);
  Lanes lost{};
  const auto turn = [&](double* halfway, double* speed, double* force, Lanes a) {
    const Lanes v = fused(halves, a, four_at(halfway));
    put_four(halfway, v);
    put_four(speed, fused(half, a, v));
    put_four(force, Lanes{});
    return v;
  };
  const auto along = [&](double* place, double* halfway, double* speed, double* force, double* dashpot, Lanes a) {
    lost = fused(four_at(dashpot), fused(last_half, a, four_at(halfway)), lost);
    const Lanes v = turn(halfway, speed, force, a);
    put_four(place, fused(whole, v, four_at(place)));
    put_four(dashpot, Lanes{});
  };
  const Numbers by = numbers();
  const std::size_t count = count_;
  for (std::size_t i = 0; i < count; i += PressedRows::lanes) {
    along(by.x + i, by.halfway_x + i, by.vx + i, by.force_x + i, by.dashpot_x + i, four_at(by.force_x + i));
    along(by.z + i, by.halfway_z + i, by.vz + i, by.force_z + i, by.dashpot_z + i, four_at(by.force_z + i) + weight);
  }
  for (std::size_t i = 0; rough_ && i < count; i += PressedRows::lanes)
    turn(by.rim_halfway + i, by.rim + i, by.rim_force + i, four_at(by.rim_force + i));
  damped_ += 0.5 * (last_step_ + dt) * (wall_loss_rate_ - sum_of(lost));
  last_step_ = dt;
}

void PressedBed::step(const FloorMotion::Motion& before, const FloorMotion::Motion& after, double dt) {
  assert(dt > 0);
  move(dt);
  if (--until_check_ == 0) check(after, dt);
  const double force_before = floor_force_;
  slip_time_ = dt;
  add_forces(after);
  slip_time_ = 0;
  floor_work_ += 0.5 * (force_before + floor_force_) * (after.position - before.position);
  damped_ += rubbed_;
}

void PressedBed::lie(const FloorMotion::Motion& floor) {
  damped_ = damped();
  last_step_ = wall_loss_rate_ = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    halfway_x_[i] = vx_[i] = force_x_[i] = 0;
    halfway_z_[i] = vz_[i] = floor.velocity;
    force_z_[i] = 1 + floor.acceleration;
  }
  for (auto* values : {&dashpot_x_, &dashpot_z_, &rim_, &rim_halfway_, &rim_force_})
    std::fill(values->begin(), values->end(), 0.0);
  floor_force_ = count_ * (1 + floor.acceleration);
}

void PressedBed::carry(const FloorMotion::Motion& before, const FloorMotion::Motion& after) {
  const double rise = after.position - before.position;
  for (std::uint32_t i = 0; i < count_; ++i) z_[i] += rise;
  floor_work_ += count_ * (rise + 0.5 * (after.velocity * after.velocity - before.velocity * before.velocity));
  floor_at_ = after;
  lie(after);
}

void PressedBed::wake(const FloorMotion::Motion& floor) {
  list_neighbours();
  list_walls(floor.position, 0);
  until_check_ = steps_a_check;
  for (auto* forces : {&force_x_, &force_z_, &rim_force_}) std::fill(forces->begin(), forces->end(), 0.0);
  add_forces(floor);
  damped_ += rubbed_;
}

double PressedBed::approach() const { return std::sqrt(pair_squares_ / std::max(touching_, 1.0)); }

double PressedBed::compressed() const {
  double sum = 0;
  const auto add = [&sum](double overlap, const Spring& spring) {
    if (overlap > 0) sum += 0.5 * spring.stiffness * overlap * overlap;
  };
  each_neighbour([&](std::uint32_t i, std::uint32_t k, std::size_t) {
    const TwoLanes d = gap_of(i, k);
    const double u = 1 - (d[0] * d[0] + d[1] * d[1]);
    if (u > 0) sum += pair_.stiffness / 8 * u * u;
  });
  for (const std::uint32_t i : near_left_) add(disk_radius - x_[i], side_);
  for (const std::uint32_t i : near_right_) add(x_[i] + disk_radius - box_.width, side_);
  for (const std::uint32_t i : near_lid_) add(z_[i] + disk_radius - box_.lid, lid_);
  for (const std::uint32_t i : near_floor_) add(floor_at_.position + disk_radius - z_[i], floor_);
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
    for (const std::uint32_t i : near_floor_) z_[i] += excess(floor + disk_radius - z_[i]);
    for (const std::uint32_t i : near_lid_) z_[i] -= excess(z_[i] + disk_radius - box_.lid);
    for (const std::uint32_t i : near_left_) x_[i] += excess(disk_radius - x_[i]);
    for (const std::uint32_t i : near_right_) x_[i] -= excess(x_[i] + disk_radius - box_.width);
    each_neighbour([&](std::uint32_t i, std::uint32_t k, std::size_t) {
      const TwoLanes d = gap_of(i, k);
      const double squared = d[0] * d[0] + d[1] * d[1];
      if (squared >= 4 * disk_radius * disk_radius) return;
      const double distance = std::sqrt(squared);
      const TwoLanes move = both(0.5 * overdone * excess(2 * disk_radius - distance) / distance) * d;
      x_[i] -= move[0];
      z_[i] -= move[1];
      x_[k] += move[0];
      z_[k] += move[1];
    });
    if (worst <= most) return;
  }
}

}  // namespace shakebed::sim
