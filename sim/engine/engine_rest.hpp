// A bed at rest on the floor. Included by engine.hpp only.
//
// Hard disks have no lasting contacts. Between landing and take-off, or on a floor that stands still, a bed carries its
// weight by ever more and ever smaller contacts, without end. A bed that has come to rest is spared these. Its disks
// then rest: they move with the floor until the floor falls faster than a disk does.
//
// The disks at rest move in hops. All of them are thrown up together and fly freely like every other disk. Their
// velocity brings them back to their heights above the floor at the hop's end. Meanwhile they touch neither the floor
// nor one another. A disk that still moves collides with them as with any other disk. It does not push them off the
// floor, which does not give way: only a fast disk wakes a disk at rest, and with it those that lose their support.
// Snapshots give the disks at rest the floor's velocity, which is their mean over a hop. Where some disks move,
// snapshots give them their place in flight (2e-5 D above that of rest): there they touch no disk.
//
// Rest follows from the motion of the disks, not from a balance of forces. A bed that slides or spreads under its
// weight is too fast to be at rest until it has done so. Beds that are never calm are not changed at all, not even by
// rounding.
#pragma once

namespace shakebed::sim {

// What a bed at rest may still move with, and so what resting takes from T at most [m g D]. Soft spheres (500 disks, e
// = 0.9, Gamma = 1.2, 30 Hz) have 5e-3 when they land and 4e-4 from half a period later to take-off: rows that slide.
inline constexpr double rest_temperature = 4e-4;
inline constexpr double rest_speed = 0.08;  // of a disk against the floor [sqrt(g D)]: 2.8 times that of this T
inline constexpr double rest_share = 0.9;   // of the disks that must be as slow; the others lie on top
inline constexpr double rest_contacts =
    8;                                    // of all disks together, for each disk, between two looks: a bed that lies
                                          // on the floor makes 15 to 130 (Gamma 1.2 to 1.5), one at Gamma = 4 at most 2
inline constexpr double rest_gap = 1e-4;  // between disks that carry one another [D]; chattering ones have 1e-6
inline constexpr double rest_clearance = 1e-3;  // to a lid, never met by hops: they are 1.2e-4 high at most [D]
inline constexpr double waking_speed =
    0.15;  // approach that wakes a disk [sqrt(g D)]; the pushes of hops are below 0.03
inline constexpr double looks_a_period = 64;  // of the floor, for rest
inline constexpr double hops_a_period = 256;  // while a disk moves; they push by 1/256 of a period's fall
inline constexpr double hops_of_all = 128;    // when none does
// The floor's period counts as no longer than this [sqrt(D/g)], so that pushes stay far below waking_speed.
inline constexpr double longest_rest_period = 4;

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::plan_rest(bool wanted) {
  if constexpr (rests_apply) {
    rest_height_.assign(count_, never);
    rest_period_ = std::min(floor_.period(), longest_rest_period);
    rests_ = wanted && contact_duration_ > 0 && std::holds_alternative<NoBath>(bath_);
    look_again();
  }
}

// The next look at the bed is one interval from now.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::look_again() {
  contacts_at_look_ = counters_.collisions();
  if (rests_) rest_at_ = look_at_ = now_ + rest_period_ / looks_a_period;
}

// For how long from now on, `horizon` at most, the floor presses on what lies on it; 0 if it does not.
template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::time_pressed(double horizon) const {
  constexpr int steps = 8, halvings = 40;
  const auto presses = [this](double later) { return gravity_ + floor_.motion(now_, later).acceleration > 0; };
  if (!presses(0)) return 0;
  double before = 0;
  for (int k = 1; k <= steps; ++k) {
    double after = horizon * k / steps;
    if (presses(after)) {
      before = after;
      continue;
    }
    for (int halving = 0; halving < halvings; ++halving) {
      const double middle = 0.5 * (before + after);
      (presses(middle) ? before : after) = middle;
    }
    return before;
  }
  return horizon;
}

// Has the disk the floor below it, or something at rest below on either side? Records are those of now_.
template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::is_supported(std::uint32_t i, double floor) {
  const Disk& disk = disks_[i];
  const double radius = sizes_.radius(i);
  if (disk.z - radius - floor < rest_gap) return true;
  bool left = hard_sides_ && disk.x - radius < rest_gap, right = hard_sides_ && width_ - radius - disk.x < rest_gap;
  if (left && right) return false;
  lists_.each_neighbour(i, [&](std::uint32_t k) {
    double dx = disks_[k].x - disk.x;
    const double dz = disks_[k].z - disk.z, reach = sizes_.contact_distance(i, k) + rest_gap;
    if constexpr (Space::wraps_x) dx = period_x_.nearest(dx);
    if (!is_at_rest(k) || dz >= 0 || dx * dx + dz * dz > reach * reach) return;
    left = left || dx <= 0;
    right = right || dx >= 0;
  });
  return left && right;
}

// What that velocity and its spin hold.
template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::energy_of(std::uint32_t i, TwoLanes velocity) const {
  double squares = velocity[0] * velocity[0] + velocity[1] * velocity[1];
  if constexpr (Rule::spins) {
    const double surface_speed = sizes_.radius(i) * spins_[i];
    squares += surface_speed * surface_speed / inverse_inertia_ratio_;
  }
  return 0.5 * sizes_.mass(i) * squares;
}

// What the disk moves with against the floor is lost; it moves with the floor from now on.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::stop(std::uint32_t i, const FloorMotion::Motion& floor) {
  Disk& disk = disks_[i];
  const double before = energy_of(i, pair_at(&disk.vx)), vz = disk.vz;
  disk.vx = 0;
  disk.vz = floor.velocity;
  if constexpr (Rule::spins) spins_[i] = 0;
  const double work = sizes_.mass(i) * (floor.velocity - vz) * floor.velocity;
  floor_work_ += work;
  dissipated_ += before + work - energy_of(i, pair_at(&disk.vx));
  mark_near_bounds(i);
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::wake(std::uint32_t i) {
  assert(is_at_rest(i) && resting_ > 0);
  rest_height_[i] = never;
  --resting_;
  woken_ = true;
  mark_near_bounds(i);
}

// Has the bed come to rest? Its contacts since the last look say at once that most have not.
template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::is_calm(const FloorMotion::Motion& floor) {
  const std::uint64_t contacts = counters_.collisions() - contacts_at_look_;
  contacts_at_look_ = counters_.collisions();
  if (resting_ == 0 && static_cast<double>(contacts) < rest_contacts * count_) return false;
  if (time_pressed(rest_period_ / looks_a_period) < rest_period_ / looks_a_period) return false;
  double squares = 0;
  std::uint32_t slow = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Motion motion = motion_at(disks_[i], now_);
    const double vx = motion.vx(), vz = motion.vz() - floor.velocity, square = vx * vx + vz * vz;
    if (!(square < rest_speed * rest_speed)) continue;
    squares += square;
    ++slow;
  }
  return slow >= rest_share * count_ && squares <= 2 * rest_temperature * slow;
}

// Lays down every slow disk that has support, from the floor up; none if they are few.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::lay_down(const FloorMotion::Motion& floor) {
  std::vector<std::pair<double, std::uint32_t>> slow;
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (is_at_rest(i)) continue;
    bring_forward(i);
    const Disk& disk = disks_[i];
    const double vx = disk.vx, vz = disk.vz - floor.velocity;
    if (vx * vx + vz * vz < rest_speed * rest_speed) slow.emplace_back(disk.z, i);
  }
  std::sort(slow.begin(), slow.end());
  const std::uint32_t resting = resting_;
  for (const auto& [z, i] : slow) {
    if (!is_supported(i, floor.position)) continue;
    const double height = z - floor.position;
    if (floor_.highest() + height + sizes_.radius(i) + rest_clearance > lid_height_) continue;
    rest_height_[i] = height;
    ++resting_;
  }
  const bool enough = resting_ >= rest_share * count_;
  for (const auto& [z, i] : slow) {
    if (!is_at_rest(i)) continue;
    enough ? stop(i, floor) : void(rest_height_[i] = never);
  }
  if (enough) return;
  resting_ = resting;
  if (resting > 0) return;  // the hop that follows predicts anew
  for (std::uint32_t i = 0; i < count_; ++i) bring_forward(i);
  predict_all();  // of those brought forward what was predicted no longer holds
  assert(foresees_contacts());
}

// Wakes those that have lost their support, and those above them.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::wake_unsupported(const FloorMotion::Motion& floor) {
  while (std::exchange(woken_, false)) {
    for (std::uint32_t i = 0; i < count_; ++i)
      if (is_at_rest(i) && !is_supported(i, floor.position)) wake(i);
  }
}

// All disks at rest leave the floor with its velocity: it falls away, or something else needs them as they were.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::wake_all() {
  for (std::uint32_t i = 0; i < count_; ++i)
    if (is_at_rest(i)) wake(i);
  woken_ = false;
}

// Gives disk i, which is at rest, the velocity vz; the floor does it.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::push_from_floor(std::uint32_t i, double vz, double floor) {
  const double given = sizes_.mass(i) * (vz - disks_[i].vz);
  floor_work_ += given * 0.5 * (vz + disks_[i].vz);
  disks_[i].vz = vz;
  if (watcher_ != nullptr) tell_push(i, floor, given);
}

// The floor gives momentum to a disk at rest, or through it: from disk to disk.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::tell_push(std::uint32_t i, double floor, double given) const {
  const double radius = sizes_.radius(i), bottom = rest_height_[i] - radius;
  watcher_->touched_wall(time(), labels_[i], true, floor + radius, 0, given);
  if (bottom > rest_gap) watcher_->touched(time(), disks_[i].x, floor + radius, 0, bottom, 0, given);
}

// The next hop of all disks at rest, of that length: their flights anew, and what comes of them.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::hop(double length, const FloorMotion::Motion& floor) {
  assert(length > 0 && resting_ <= count_);
  const double vz = (floor_.motion(now_, length).position - floor.position) / length + 0.5 * gravity_ * length;
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (!is_at_rest(i)) continue;
    push_from_floor(i, vz, floor.position);
    Disk& disk = disks_[i];
    disk.event_time = never;
    disk.partner = nobody;
    if (shell_exit_of(i, motion_at(disk, now_)) > now_ + length) continue;
    leave_shell(i);
    lists_.mend();
  }
  // Those that have only others at rest round them meet nothing.
  for (std::uint32_t i = 0; i < count_; ++i) {
    bool meets = !is_at_rest(i);
    if (!meets && resting_ < count_)
      lists_.each_neighbour(i, [&](std::uint32_t k) { meets = meets || !is_at_rest(k); });
    if (meets && (is_at_rest(i) || disks_[i].own_time == now_)) predict(i, motion_at(disks_[i], now_));
  }
  settle();
}

// A look at the bed, or the end of a hop. Both come at moments that depend on the run alone.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::act_rest() {
  const FloorMotion::Motion floor = floor_.motion(now_);
  const bool look = now_ >= look_at_;
  if (look) look_at_ = now_ + rest_period_ / looks_a_period;
  const bool rested = resting_ > 0;
  for (std::uint32_t i = 0; rested && i < count_; ++i) {
    if (!is_at_rest(i)) continue;
    bring_forward(i);
    disks_[i].z = floor.position + rest_height_[i];
  }
  if (look && is_calm(floor)) lay_down(floor);
  unusual_ = disk_surface_.varies() || resting_ > 0;
  rest_at_ = look_at_;
  if (resting_ == 0) return;
  const double usual = rest_period_ / (resting_ < count_ ? hops_a_period : hops_of_all);
  const double length = time_pressed(usual);
  if (length < 1e-3 * usual) {  // it falls away
    for (std::uint32_t i = 0; i < count_; ++i)
      if (is_at_rest(i)) push_from_floor(i, floor.velocity, floor.position);
    wake_all();
    for (std::uint32_t i = 0; i < count_; ++i) bring_forward(i);
    predict_all();
    rest_at_ = look_at_;
  } else {
    if (woken_) {
      for (std::uint32_t i = 0; i < count_; ++i) bring_forward(i);
      wake_unsupported(floor);
    }
    hop(length, floor);
    rest_at_ = now_ + length;
  }
  assert(foresees_contacts());
  tell_all();
}

// A contact of which one disk is at rest: the other is pushed off it as off the floor. False if that wakes it.
template <class Space, class Rule, class Sizes>
[[gnu::noinline]] bool Engine<Space, Rule, Sizes>::push_off_rest(std::uint32_t i, std::uint32_t j, Motion& first,
                                                                 Motion& second, TwoLanes d) {
  const bool first_moves = is_at_rest(j);
  const std::uint32_t moving = first_moves ? i : j, lying = first_moves ? j : i;
  Motion &motion = first_moves ? first : second, &other = first_moves ? second : first;
  const double distance = std::sqrt(d[0] * d[0] + d[1] * d[1]), sign = first_moves ? 1 : -1;
  const double nx = sign * d[0] / distance, nz = sign * d[1] / distance;
  const TwoLanes speed = motion.velocity - other.velocity;
  if (speed[0] * nx + speed[1] * nz > waking_speed) {
    wake(lying);
    return false;
  }
  const double before = energy_of(moving, motion.velocity), lost = dissipated_, vz = motion.vz();
  bounce(moving, motion, nx, nz, other.vz(), disk_surface_);
  floor_work_ += energy_of(moving, motion.velocity) - before + (dissipated_ - lost);
  if (watcher_ != nullptr) tell_push(lying, floor_.position(now_), sizes_.mass(moving) * (motion.vz() - vz));
  return true;
}

}  // namespace shakebed::sim
