// What a disk meets next: contacts with neighbours and walls, the edge of its shell. Included by engine.hpp only.
#pragma once

namespace shakebed::sim {

// When the disk meets others; `never` where it does not.
template <class Space, class Rule, class Sizes>
template <bool images, bool others_ahead, class Number>
[[gnu::always_inline]] inline Number Engine<Space, Rule, Sizes>::meetings(const SeenDisks<Number>& others,
                                                                          const Disk& me) const {
  Number time = in_lanes<Number>(now_);
  if constexpr (others_ahead) time = larger(time, others.own_time);
  const Number dt = time - others.own_time;
  Number dx = fused(others.vx, dt, others.x) - in_lanes<Number>(me.x);
  Number dz, vz = others.vz;
  if constexpr (Space::falls) {
    const Number fall = in_lanes<Number>(gravity_) * dt;
    dz = fused(fused(in_lanes<Number>(-0.5), fall, vz), dt, others.z) - in_lanes<Number>(me.z);
    vz = vz - fall;
  } else {
    dz = fused(vz, dt, others.z) - in_lanes<Number>(me.z);
  }
  if constexpr (others_ahead) {
    const Number since = time - in_lanes<Number>(me.own_time);
    dx = fused(in_lanes<Number>(-me.vx), since, dx);
    dz = fused(in_lanes<Number>(-me.vz), since, dz);
  }
  if constexpr (images && Space::wraps_x) dx = period_x_.nearest(dx);
  if constexpr (images && Space::wraps_z) dz = period_z_.nearest(dz);
  const Number dvx = others.vx - in_lanes<Number>(me.vx), dvz = vz - in_lanes<Number>(me.vz);

  // As time_to_disk() in contact_time.hpp, but in the form (-b - root) / a: its division does not wait for the root.
  // What it loses to cancellation is 2e-16 of the distance in place, no more than the places themselves. Of a negative
  // discriminant the root is NaN, which is not before anything.
  const Number b = fused(dx, dvx, dz * dvz);
  const Number c = larger(fused(dx, dx, fused(dz, dz, -others.contact_squared)), in_lanes<Number>(0));
  const Number a = fused(dvx, dvx, dvz * dvz);
  const Number root = sqrt_lanes(fused(b, b, -(a * c)));
  // Earlier than the other's next event: -(b + root) < a (event_time - time), which does not wait for the contact.
  const auto meets = (b < in_lanes<Number>(-slowest_approach)) & (root > fused(time - others.event_time, a, -b));
  const Number contact = fused(-(b + root), in_lanes<Number>(1) / a, time);
  // The larger of the contact and 0 or, where there is none, `never`: quicker than a selection.
  return larger(contact, unless(meets, in_lanes<Number>(never)));
}

// Those that the disk may meet, by ordinary products: all that it does meet and a few more. What rounding changes here
// is far below `doubt`, for places up to 1e5 D. Asked where fused products take long.
template <class Space, class Rule, class Sizes>
template <bool others_ahead>
[[gnu::always_inline]] inline LaneMask Engine<Space, Rule, Sizes>::may_meet(const SeenDisks<Lanes>& others,
                                                                            const Disk& me) const {
  const Lanes doubt = all_lanes(1e-9);
  Lanes time = all_lanes(now_);
  if constexpr (others_ahead) time = larger(time, others.own_time);
  const Lanes dt = time - others.own_time, fall = all_lanes(Space::falls ? gravity_ : 0) * dt;
  Lanes dx = others.x + others.vx * dt - all_lanes(me.x);
  Lanes dz = others.z + (others.vz - all_lanes(0.5) * fall) * dt - all_lanes(me.z);
  if constexpr (others_ahead) {
    const Lanes since = time - all_lanes(me.own_time);
    dx -= all_lanes(me.vx) * since;
    dz -= all_lanes(me.vz) * since;
  }
  const Lanes dvx = others.vx - all_lanes(me.vx), dvz = others.vz - fall - all_lanes(me.vz);
  const Lanes a = dvx * dvx + dvz * dvz, b = dx * dvx + dz * dvz;
  const Lanes c = larger(dx * dx + dz * dz - others.contact_squared, all_lanes(0));
  const Lanes of_square = b * b + a * c + a, of_all = of_square + all_lanes(1);
  const Lanes discriminant = b * b - a * c, root = sqrt_lanes(larger(discriminant, all_lanes(0)) + doubt * of_square);
  const Lanes late = (time - others.event_time) * a - b;  // minus infinity where the other's event is never
  return (b <= doubt * of_all) & (discriminant >= -doubt * of_square) & (root >= late - doubt * (of_all - late));
}

// Contact times of one disk with four others: ids 0 and 1 and the two from `beyond` on. The disk's struct is that of
// now_. The time is `never` where there is no other disk or where the other's next event is earlier. If others may be
// ahead of now_, the disk's struct may be an earlier one. Contacts before the others' flights began are then left out.
template <class Space, class Rule, class Sizes>
template <bool images, bool others_ahead>
[[gnu::always_inline]] inline Lanes Engine<Space, Rule, Sizes>::contact_times(const std::uint32_t* ids,
                                                                              std::size_t beyond, const Disk& me,
                                                                              [[maybe_unused]] double radius) const {
  const Disk &k0 = disks_[ids[0]], &k1 = disks_[ids[1]], &k2 = disks_[ids[beyond]], &k3 = disks_[ids[beyond + 1]];
  const Lanes position02 = two_pairs(&k0.x, &k2.x), position13 = two_pairs(&k1.x, &k3.x);
  const Lanes velocity02 = two_pairs(&k0.vx, &k2.vx), velocity13 = two_pairs(&k1.vx, &k3.vx);
  const Lanes x = __builtin_shufflevector(position02, position13, 0, 4, 2, 6),
              z = __builtin_shufflevector(position02, position13, 1, 5, 3, 7);
  const Lanes vx = __builtin_shufflevector(velocity02, velocity13, 0, 4, 2, 6);
  const Lanes vz = __builtin_shufflevector(velocity02, velocity13, 1, 5, 3, 7);
  const Lanes times02 = two_pairs(&k0.own_time, &k2.own_time), times13 = two_pairs(&k1.own_time, &k3.own_time);
  const Lanes own_time = __builtin_shufflevector(times02, times13, 0, 4, 2, 6),
              event_time = __builtin_shufflevector(times02, times13, 1, 5, 3, 7);

  SeenDisks<Lanes> others{x, z, vx, vz, own_time, event_time, all_lanes(1)};
  if constexpr (!Sizes::equal) {
    const Lanes distance = all_lanes(radius) + Lanes{sizes_.radius(ids[0]), sizes_.radius(ids[1]),
                                                     sizes_.radius(ids[beyond]), sizes_.radius(ids[beyond + 1])};
    others.contact_squared = distance * distance;
  }
  if constexpr (fused_takes_long && !images) {
    const LaneMask may = may_meet<others_ahead>(others, me);
    const TwoLanes none = both(never);
    return joined((may[0] | may[1]) == 0 ? none : meetings<false, others_ahead>(half_of(others, first_half), me),
                  (may[2] | may[3]) == 0 ? none : meetings<false, others_ahead>(half_of(others, second_half), me));
  } else {
    return meetings<images, others_ahead>(others, me);
  }
}

// The earliest contact with the eight of a block.
template <class Space, class Rule, class Sizes>
template <bool images, bool others_ahead>
[[gnu::always_inline]] inline auto Engine<Space, Rule, Sizes>::earliest_in(const NeighbourBlock& block, const Disk& me,
                                                                           double radius) const -> Candidate {
  const std::uint32_t* const ids = block.disk.data();
  const Lanes times0145 = contact_times<images, others_ahead>(ids, 4, me, radius);
  const Lanes times2367 = contact_times<images, others_ahead>(ids + 2, 4, me, radius);
  const Earliest earliest = earliest_of_eight(times0145, times2367, ids);
  return {earliest.time, earliest.id};
}

template <class Space, class Rule, class Sizes>
[[gnu::noinline]] auto Engine<Space, Rule, Sizes>::next_of_many(std::uint32_t i, Candidate best) const -> Candidate {
  const Disk& me = disks_[i];
  const double radius = sizes_.radius(i);
  const auto consider = [&](const Candidate& other) {
    if (other.time < best.time) best = other;
  };
  if (me.neighbours <= inline_neighbours + 4) [[likely]] {
    const std::uint32_t* const four = lists_.second_block(i).disk.data();
    const Earliest earliest = earliest_of_four(contact_times<true>(four, 2, me, radius), four);
    consider({earliest.time, earliest.id});
  } else {
    lists_.further_blocks(i, [&](const NeighbourBlock& block) { consider(earliest_in<true>(block, me, radius)); });
  }
  return best;
}

// The next contact with another disk; its time is `never` where there is none.
template <class Space, class Rule, class Sizes>
template <bool images>
[[gnu::always_inline]] inline auto Engine<Space, Rule, Sizes>::next_contact(std::uint32_t i) const -> Candidate {
  const Disk& me = disks_[i];
  const Candidate best = earliest_in<images>(lists_.first_block(i), me, sizes_.radius(i));
  if (me.neighbours > inline_neighbours) [[unlikely]]
    return next_of_many(i, best);
  return best;
}

// The next wall that the disk meets, if it comes before `best`; else `best`. The floor is not looked for beyond `exit`.
template <class Space, class Rule, class Sizes>
[[gnu::noinline]] auto Engine<Space, Rule, Sizes>::next_wall(std::uint32_t i, Candidate best, double exit) const
    -> Candidate {
  const Disk& me = disks_[i];
  const double radius = sizes_.radius(i);
  const unsigned near = me.near;
  const auto consider = [&](double wait, std::int32_t wall) {
    if (now_ + wait < best.time) best = {now_ + wait, wall};
  };
  bool slopes = false, lid_is_free = false;
  if constexpr (Space::is_cell) {
    slopes = slope_sine_ > 0;
    lid_is_free = lid_.is_free();
    const double horizon = std::min(best.time, exit) - now_;
    if (slopes && (near & near_left_wall) != 0) consider(time_to_slope(me, radius, true, horizon), left_wall);
    if (slopes && (near & near_right_wall) != 0) consider(time_to_slope(me, radius, false, horizon), right_wall);
    // Both fall with g: they approach at a constant speed.
    if (lid_is_free && (near & near_lid) != 0)
      consider(time_to_wall(lid_height() - radius - me.z, me.vz - lid_velocity()), lid_above);
  }
  if (!slopes && (near & near_left_wall) != 0) consider(time_to_wall(me.x - radius, -me.vx), left_wall);
  if (!slopes && (near & near_right_wall) != 0) consider(time_to_wall(width_ - radius - me.x, me.vx), right_wall);
  if (!lid_is_free && (near & near_lid) != 0)
    consider(time_to_lid(lid_height_ - radius - me.z, me.vz, gravity_), lid_above);
  if (near & near_floor) {
    const double horizon = std::min(best.time, exit) - now_;
    consider(floor_.time_to_contact(me.z - radius, me.vz, gravity_, now_, horizon), floor_below);
  }
  return best;
}

// What the disk meets next, if that is before `exit`, when it leaves its shell; later contacts with the floor are left
// out.
template <class Space, class Rule, class Sizes>
template <bool images, bool others_ahead>
[[gnu::noinline]] auto Engine<Space, Rule, Sizes>::next_event_by(std::uint32_t i, [[maybe_unused]] double exit) const
    -> Candidate {
  if constexpr (others_ahead) return next_contact_of<true>(i, disks_[i]);
  const Candidate next = next_contact<images>(i);
  if constexpr (Space::has_walls) {
    if ((disks_[i].near & ~unsigned{near_edge}) != 0) return next_wall(i, next, exit);
  }
  return next;
}
template <class Space, class Rule, class Sizes>
template <bool others_ahead>
auto Engine<Space, Rule, Sizes>::next_event(std::uint32_t i, double exit) const -> Candidate {
  return is_near_edge(i, i) ? next_event_by<true, others_ahead>(i, exit) : next_event_by<false, others_ahead>(i, exit);
}

// When the disk, whose state now is `motion`, leaves its shell.
template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::shell_exit_of(std::uint32_t i, const Motion& motion) const {
  const Disk& disk = disks_[i];
  const double ox = motion.x() - static_cast<double>(disk.shell_x), oz = motion.z() - static_cast<double>(disk.shell_z);
  return now_ +
         time_to_leave_shell(ox, oz, motion.vx(), motion.vz(), disk.skin * skin_unit, Space::falls ? gravity_ : 0);
}
// The same of two disks side by side.
template <class Space, class Rule, class Sizes>
[[gnu::always_inline]] inline TwoLanes Engine<Space, Rule, Sizes>::shell_exits_of(std::uint32_t i, std::uint32_t j,
                                                                                  const Motion& first,
                                                                                  const Motion& second) const {
  const Disk &a = disks_[i], &b = disks_[j];
  const TwoLanes x = __builtin_shufflevector(first.place, second.place, 0, 2),
                 z = __builtin_shufflevector(first.place, second.place, 1, 3);
  const TwoLanes vx = __builtin_shufflevector(first.velocity, second.velocity, 0, 2),
                 vz = __builtin_shufflevector(first.velocity, second.velocity, 1, 3);
  const TwoLanes shell_x = {a.shell_x, b.shell_x}, shell_z = {a.shell_z, b.shell_z};
  const TwoLanes skin = TwoLanes{static_cast<double>(a.skin), static_cast<double>(b.skin)} * skin_unit;
  return now_ + time_to_leave_shell(x - shell_x, z - shell_z, vx, vz, skin, Space::falls ? gravity_ : 0);
}

// Writes down what comes next for disk i, unless it leaves its shell before. Which of the two is a coin toss that no
// processor foresees: there is no branch on it.
template <class Space, class Rule, class Sizes>
[[gnu::noinline]] void Engine<Space, Rule, Sizes>::commit(std::uint32_t i, Candidate next, double exit) {
  assert(i < count_ && (!(next.time < never) || next.partner < static_cast<std::int32_t>(count_)));
  Disk& disk = disks_[i];
  const bool leaves = exit < next.time;
  const double time = leaves ? exit : next.time;
  if (!(time < never)) [[unlikely]] {
    disk.event_time = never;
    disk.partner = nobody;
    return;
  }
  const std::int32_t partner = choose(leaves, static_cast<std::int32_t>(shell_exit), next.partner);
  const auto other = static_cast<std::uint32_t>(choose(partner < 0, static_cast<std::int32_t>(i), partner));
  disks_[other].event_time = time;
  disks_[other].partner = static_cast<std::int32_t>(i);
  disk.event_time = time;
  disk.partner = partner;
  queue_.push(time, i, other);
}

// Writes down what is pending. Outside process_until() nothing is.
template <class Space, class Rule, class Sizes>
[[gnu::always_inline]] inline void Engine<Space, Rule, Sizes>::settle() {
  for (Pending& one : pending_) {
    if (one.disk == nothing_pending) return;
    commit(one.disk, {one.time, one.partner}, one.exit);
    one.disk = nothing_pending;
    one.time = one.exit = never;
  }
}

// The disk's state is `motion` from now on: written down, with what comes next.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::fly_on(std::uint32_t i, const Motion& motion) {
  write_down(i, motion);
  predict(i, motion);
}

// Everything anew, from records that are those of now_. Every disk must be predicted, even one that another has
// already claimed: its own best event may be an earlier one with a third, or
// the edge of its shell.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::predict_all() {
  if (tiles_.empty()) {
    queue_.reset(disks_.data(), count_, now_, event_rate_);
  } else {
    queue_.begin_window(disks_.data(), count_, now_, now_, 0);  // tiles look for their events in the records
  }
  for (std::uint32_t i = 0; i < count_; ++i) {
    disks_[i].event_time = never;
    disks_[i].partner = nobody;
  }
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Motion motion = motion_at(disks_[i], now_);
    const double exit = shell_exit_of(i, motion);
    Candidate next = next_event(i, exit);
    const Disk& disk = disks_[i];
    if (disk.partner >= 0 && next.time >= disk.event_time) next = {disk.event_time, disk.partner};
    commit(i, next, exit);  // also where it stands already: the disk may leave its shell before
  }
}

}  // namespace shakebed::sim
