// The engine's member functions, in the order in which a run uses them.
// Included by engine.hpp only.
#pragma once

namespace shakebed::sim {

inline constexpr double rest_hop = 1e-4;        // length of the hop of a disk at rest
                                                // on the floor without a contact clock
inline constexpr double shell_slack = 1e-9;     // covers the rounding of shells' centres and exit times
inline constexpr double most_crowding = 0.01;   // further cells a cell of four shells; above, seven are quicker
inline constexpr double longest_interval = 64;  // between synchronisations, unless the floor's period is longer

// ------------------------------------------------------------------------------------------------
// start

template <class Space, class Rule, class Sizes>
Engine<Space, Rule, Sizes>::Engine(const Scene& scene, FloorMotion floor, const std::vector<Placed>& placed)
    : count_(static_cast<std::uint32_t>(placed.size())),
      width_(scene.box.width),
      floor_(std::move(floor)),
      disk_surface_(scene.disks.contact),
      floor_surface_(scene.box.floor_surface),
      contact_duration_(scene.disks.contact_duration),
      inverse_inertia_ratio_(1 / scene.disks.inertia_ratio),
      bath_(scene.bath),
      random_(scene.seed ^ 0x6261746800000000) {
  if constexpr (Space::falls) gravity_ = 1;
  if (const auto* sides = std::get_if<HardSides>(&scene.box.sides)) {
    hard_sides_ = Space::has_walls;
    side_surface_ = Contact(sides->surface);
  } else {
    period_x_ = Period(width_);
  }
  if (const auto* lid = std::get_if<Lid>(&scene.box.top)) {
    lid_height_ = lid->height;
    lid_surface_ = Contact(lid->surface);
  }
  if (const auto* top = std::get_if<PeriodicTop>(&scene.box.top)) period_z_ = Period(top->height);

  beyond_cache_ = count_ > fits_cache;
  disks_.resize(count_ + 1);
  labels_.resize(count_);
  std::iota(labels_.begin(), labels_.end(), 0);
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Placed& p = placed[i];
    disks_[i] = {p.x, p.z, p.vx, p.vz, 0, never, nobody, 0, 0, 0, 0, 0};
  }
  disks_[count_] = {0,      0, 0, 0, 0, -never,
                    nobody, 0, 0, 0, 0, 0};  // the sentinel: nothing can be earlier than its event
  if constexpr (Rule::spins) {
    for (const Placed& p : placed) spins_.push_back(p.spin);
  }
  if constexpr (Rule::dissipates) last_contact_.assign(count_, -never);
  if constexpr (!Sizes::equal) {
    for (const Placed& p : placed) {
      sizes_.radii.push_back(scene.disks.species[p.species].diameter / 2);
      sizes_.masses.push_back(scene.disks.species[p.species].mass);
    }
    sizes_.radii.push_back(0.5);
    sizes_.masses.push_back(1);
  }
  if (const auto* bath = std::get_if<LangevinBath>(&bath_)) bath_at_ = bath->interval;
  if (const auto* bath = std::get_if<WhiteNoiseBath>(&bath_)) bath_at_ = bath->interval;
  if (const auto* bath = std::get_if<AndersenBath>(&bath_))
    bath_at_ = -std::log(random_.uniform_positive()) / (bath->rate * count_);
  interval_ = floor_.period();
  if (!floor_.moves()) intervals_ = 16;
  event_rate_ = 8.0 * count_;
  initial_energy_ = kinetic_energy() + potential_energy();
  unusual_ = disk_surface_.varies();
  plan_rest(scene.rests);
  begin_interval();
}

// ------------------------------------------------------------------------------------------------
// flight

template <class Space, class Rule, class Sizes>
auto Engine<Space, Rule, Sizes>::motion_at(const Disk& disk, double time) const -> Motion {
  const TwoLanes place = pair_at(&disk.x), velocity = pair_at(&disk.vx);
  const TwoLanes dt = both(time - disk.own_time);
  if constexpr (Space::falls) {
    const TwoLanes fall = TwoLanes{0, gravity_} * dt;
    return {fused(fused(both(-0.5), fall, velocity), dt, place), velocity - fall};
  } else {
    return {fused(velocity, dt, place), velocity};
  }
}

// The disk's state from now on; what comes next is not known yet. In pairs, as it is read: what has been written in
// parts cannot be read at once before it has reached the cache.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::write_down(std::uint32_t i, const Motion& motion) {
  Disk& disk = disks_[i];
  put_pair(&disk.x, motion.place);
  put_pair(&disk.vx, motion.velocity);
  put_pair(&disk.own_time, both(now_));
}

// ------------------------------------------------------------------------------------------------
// prediction

// Contact times of one disk, whose record is that of now_, with four others, ids 0 and 1 and the two from `beyond` on;
// `never` where there is none or where the other has something earlier to do. If others may be ahead of now_, the
// record may be an earlier one, and contacts before the others' flights began are not told.
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
  Lanes vz = __builtin_shufflevector(velocity02, velocity13, 1, 5, 3, 7);
  const Lanes times02 = two_pairs(&k0.own_time, &k2.own_time), times13 = two_pairs(&k1.own_time, &k3.own_time);
  const Lanes own_time = __builtin_shufflevector(times02, times13, 0, 4, 2, 6),
              event_time = __builtin_shufflevector(times02, times13, 1, 5, 3, 7);

  Lanes time = all_lanes(now_);
  if constexpr (others_ahead) time = larger(time, own_time);
  const Lanes dt = time - own_time;
  Lanes dx = fused(vx, dt, x) - all_lanes(me.x);
  Lanes dz;
  if constexpr (Space::falls) {
    const Lanes fall = all_lanes(gravity_) * dt;
    dz = fused(fused(all_lanes(-0.5), fall, vz), dt, z) - all_lanes(me.z);
    vz = vz - fall;
  } else {
    dz = fused(vz, dt, z) - all_lanes(me.z);
  }
  if constexpr (others_ahead) {
    const Lanes since = time - all_lanes(me.own_time);
    dx = fused(all_lanes(-me.vx), since, dx);
    dz = fused(all_lanes(-me.vz), since, dz);
  }
  if constexpr (images && Space::wraps_x) dx = period_x_.nearest(dx);
  if constexpr (images && Space::wraps_z) dz = period_z_.nearest(dz);
  const Lanes dvx = vx - all_lanes(me.vx), dvz = vz - all_lanes(me.vz);

  Lanes contact_squared = all_lanes(1);
  if constexpr (!Sizes::equal) {
    const Lanes distance = all_lanes(radius) + Lanes{sizes_.radius(ids[0]), sizes_.radius(ids[1]),
                                                     sizes_.radius(ids[beyond]), sizes_.radius(ids[beyond + 1])};
    contact_squared = distance * distance;
  }
  // As time_to_disk() in contact_time.hpp, but in the form (-b - root) / a: its division does not wait for the root.
  // What it loses to cancellation is 2e-16 of the distance in place, no more than the places themselves. Of a negative
  // discriminant the root is NaN, which is not before anything.
  const Lanes b = fused(dx, dvx, dz * dvz);
  const Lanes c = larger(fused(dx, dx, fused(dz, dz, -contact_squared)), all_lanes(0));
  const Lanes a = fused(dvx, dvx, dvz * dvz);
  const Lanes root = sqrt_lanes(fused(b, b, -(a * c)));
  // Earlier than the other's next event: -(b + root) < a (event_time - time), which does not wait for the contact.
  const LaneMask meets = (b < all_lanes(-slowest_approach)) & (root > fused(time - event_time, a, -b));
  const Lanes contact = fused(-(b + root), all_lanes(1) / a, time);
  // The larger of the contact and 0 or, where there is none, `never`: quicker than a selection.
  return larger(contact, unless(meets, all_lanes(never)));
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
  if (near & near_left_wall) consider(time_to_wall(me.x - radius, -me.vx), left_wall);
  if (near & near_right_wall) consider(time_to_wall(width_ - radius - me.x, me.vx), right_wall);
  if (near & near_lid) consider(time_to_lid(lid_height_ - radius - me.z, me.vz, gravity_), lid_above);
  if (near & near_floor) {
    const double horizon = std::min(best.time, exit) - now_;
    consider(floor_.time_to_contact(me.z - radius, me.vz, gravity_, now_, horizon), floor_below);
  }
  return best;
}

// What the disk meets next, if that is before `exit`, when it leaves its shell; later floors are not told.
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

// ------------------------------------------------------------------------------------------------
// shells

// Centres the disk's shell on where it is now, and takes the image of it that is in the box.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::centre_shell(std::uint32_t i) {
  Disk& disk = disks_[i];
  TwoLanes here = motion_at(disk, now_).place;
  if constexpr (Space::wraps_x) {
    const double off = period_x_.beyond(here[0]);
    disk.x -= off;
    here[0] -= off;
  }
  if constexpr (Space::wraps_z) {
    const double off = period_z_.beyond(here[1]);
    disk.z -= off;
    here[1] -= off;
  }
  disk.shell_x = static_cast<float>(here[0]);
  disk.shell_z = static_cast<float>(here[1]);
}

// Fills nearby_ with the disks whose shells the largest shell of i's would reach and, if it is asked how near they are,
// reached_by_ with how large a shell of i's would just reach theirs.
template <class Space, class Rule, class Sizes>
template <bool how_near, class Grid>
void Engine<Space, Rule, Sizes>::look_round(const Grid& grid, std::uint32_t i) {
  const std::size_t most = inline_neighbours * (grid.most_eights_round() + 1);
  if (nearby_.size() < most) [[unlikely]] {
    nearby_.resize(2 * most);
    reached_by_.resize(2 * most);
  }
  const FloatLanes x = all_floats(disks_[i].shell_x), z = all_floats(disks_[i].shell_z);
  const FloatLanes mine = all_floats(static_cast<float>(sizes_.radius(i)) + shell_slack_);
  const FloatLanes largest = all_floats(static_cast<float>(largest_skin_));
  const WordLanes me = all_words(i);
  const Period across = period_x_, up = period_z_;
  std::uint32_t* const nearby = nearby_.data();
  [[maybe_unused]] float* const reached = reached_by_.data();
  std::size_t count = 0;
  grid.each_eight_round(i, [&](FloatLanes cx, FloatLanes cz, FloatLanes reach, WordLanes ids) {
    FloatLanes dx = cx - x, dz = cz - z;
    if constexpr (Space::wraps_x) dx = across.nearest(dx);
    if constexpr (Space::wraps_z) dz = up.nearest(dz);
    const FloatLanes contact = reach + mine, far = contact + largest, squared = fused(dx, dx, dz * dz);
    const WordLanes near = (squared < far * far) & (ids != me);
    if constexpr (how_near) {
      count += compress(near, ids, sqrt_floats(squared) - contact, nearby + count, reached + count);
    } else {
      count += compress(near, ids, nearby + count);
    }
  });
  nearby_count_ = count;
}

// The largest shell with which i would have no more than eight neighbours,
// within bounds: it stops short of the ninth nearest. After look_round<true>().
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::choose_skin(std::uint32_t i) {
  constexpr std::size_t usual = std::size_t{2} * inline_neighbours;
  const auto most = static_cast<float>(largest_skin_);
  float skin = most;
  if (nearby_count_ > inline_neighbours) {
    float* const reached = reached_by_.data();
    const std::size_t blocks = (nearby_count_ + inline_neighbours - 1) / inline_neighbours;
    for (std::size_t k = nearby_count_; k < usual || k < blocks * inline_neighbours; ++k) reached[k] = most;
    // Of those before which fewer than eight stand none is the ninth; the nearest of the others is.
    FloatLanes ninth = all_floats(most);
    const auto nearest_but_eight = [&](std::size_t q, std::size_t count) {
      const FloatLanes mine = eight_floats(reached + q);
      WordLanes nearer{};
#pragma GCC unroll 16
      for (std::size_t k = 0; k < count; ++k) nearer -= all_floats(reached[k]) < mine;
      ninth = smaller(ninth, select(nearer < static_cast<std::int32_t>(inline_neighbours), ninth, mine));
    };
    if (blocks == 2) [[likely]] {
      nearest_but_eight(0, usual);
      nearest_but_eight(inline_neighbours, usual);
    } else {
      for (std::size_t q = 0; q < blocks; ++q) nearest_but_eight(q * inline_neighbours, blocks * inline_neighbours);
    }
    skin = std::max(smallest_of(ninth), static_cast<float>(smallest_skin_));
  }
  disks_[i].skin = static_cast<std::uint8_t>(skin * static_cast<float>(1 / skin_unit));
}

// Those of nearby_ that i's shell reaches. After look_round<true>().
template <class Space, class Rule, class Sizes>
std::span<const std::uint32_t> Engine<Space, Rule, Sizes>::find_neighbours(std::uint32_t i) {
  const FloatLanes skin = all_floats(static_cast<float>(disks_[i].skin * skin_unit));
  if (found_.size() < nearby_.size()) found_.resize(nearby_.size());
  const auto end = static_cast<std::int32_t>(nearby_count_);
  WordLanes place = {0, 1, 2, 3, 4, 5, 6, 7};
  std::size_t found = 0;
  for (std::size_t q = 0; q < nearby_count_; q += inline_neighbours, place += inline_neighbours) {
    const FloatLanes mine = eight_floats(&reached_by_[q]);
    const WordLanes near = (mine < skin) & (place < end);
    found += compress(near, eight_words(&nearby_[q]), mine, &found_[found], &reached_by_[found]);
  }
  return {found_.data(), found};
}

// Notes which walls the disk could touch from its shell, and whether a neighbour could stand beyond the box's edge.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::mark_near_bounds(std::uint32_t i) {
  Disk& disk = disks_[i];
  unsigned near = 0;
  const auto note = [&near](bool it_is, unsigned bit) { near |= bit & -static_cast<unsigned>(it_is); };
  if constexpr (Space::has_walls) {
    const double reach = sizes_.radius(i) + disk.skin * skin_unit + shell_slack;
    note(hard_sides_ & (disk.shell_x < reach), near_left_wall);
    note(hard_sides_ & (disk.shell_x > width_ - reach), near_right_wall);
    bool meets_floor = disk.shell_z < floor_.highest() + reach;
    if constexpr (rests_apply) meets_floor = meets_floor && !is_at_rest(i);
    note(meets_floor, near_floor);
    note(disk.shell_z > lid_height_ - reach, near_lid);
  }
  const double reach = largest_contact_ + disk.skin * skin_unit + largest_skin_ + shell_slack_;
  const auto at_edge = [reach](double centre, const Period& period) {
    return (centre < reach) | (centre > period.length - reach);
  };
  if constexpr (Space::wraps_x) note(at_edge(disk.shell_x, period_x_), near_edge);
  if constexpr (Space::wraps_z) note(at_edge(disk.shell_z, period_z_), near_edge);
  disk.near = static_cast<std::uint8_t>(near);
}

// Draws a new shell round disk i, in all but the lists of the neighbours that it loses or wins: lists_.mend() is to
// follow.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::leave_shell(std::uint32_t i) {
  std::visit([this, i](auto& grid) { this->draw_shell(grid, i); }, grid_);
}
template <class Space, class Rule, class Sizes>
template <class Grid>
void Engine<Space, Rule, Sizes>::draw_shell(Grid& grid, std::uint32_t i) {
  grid.unfile(i);
  centre_shell(i);
  // Where no more than eight are near the largest shell will do, and nobody need be ranked. So it most often is where
  // it was so before.
  const auto largest = static_cast<std::uint8_t>(largest_skin_ / skin_unit);
  bool largest_will_do = disks_[i].skin == largest;
  if (largest_will_do) [[likely]] {
    look_round<false>(grid, i);
    largest_will_do = nearby_count_ <= inline_neighbours;
  }
  std::span<const std::uint32_t> found(nearby_.data(), nearby_count_);
  if (!largest_will_do) [[unlikely]] {
    look_round<true>(grid, i);
    choose_skin(i);
    found = find_neighbours(i);
  }
  grid.file(i, reach(i));
  mark_near_bounds(i);
  lists_.relist(i, found);
}

// ------------------------------------------------------------------------------------------------
// the loop

// Sends for the neighbour lists of the two disks that come up so many events from now.
template <class Space, class Rule, class Sizes>
[[gnu::always_inline]] inline void Engine<Space, Rule, Sizes>::fetch_lists(std::size_t ahead) const {
  std::uint32_t a = 0, b = 0;
  if (!queue_.upcoming(ahead, a, b)) return;
  fetch(&lists_.first_block(a));
  fetch(&lists_.first_block(b));
}

// Sends for what will be asked for soon: first the neighbour lists of disks that will collide, some events later the
// neighbours' records, the contact clocks, and the cells round a disk that will leave its shell. (The records of disks
// that come up at all are sent for by the queue, a bucket ahead; half of those events will be dead before their turn,
// so no more than that.)
template <class Space, class Rule, class Sizes>
[[gnu::noinline]] void Engine<Space, Rule, Sizes>::fetch_for_upcoming() const {
  constexpr std::size_t neighbours_ahead = 4;
  std::uint32_t a = 0, b = 0;
  fetch_lists(EventQueue::looks_ahead);
  if (!queue_.upcoming(neighbours_ahead, a, b)) return;
  if constexpr (Rule::dissipates) {
    fetch(&last_contact_[a]);
    fetch(&last_contact_[b]);
  }
  for (std::uint32_t neighbour : lists_.first_block(a).disk) fetch(&disks_[neighbour]);
  if (a == b) [[unlikely]] {
    std::visit([a](const auto& grid) { grid.fetch_round(a); }, grid_);
    return;
  }
  for (std::uint32_t neighbour : lists_.first_block(b).disk) fetch(&disks_[neighbour]);
}

// A pause in process_until(): is there anything that forbids to go on? What is due is done, and the next pause set.
template <class Space, class Rule, class Sizes>
[[gnu::noinline]] bool Engine<Space, Rule, Sizes>::go_on(double until) {
  settle();
  if (events_to_check_ == 0 && locked()) {
    relieve();
    tell_all();
  }
  if (events_to_return_ == 0) {
    if (now_ < until) return false;
    events_to_return_ = 1;  // of the events at `until` none is left to the next call
  }
  const std::uint64_t events = std::min(events_to_check_, events_to_return_);
  events_to_check_ -= events;
  events_to_return_ -= events;
  events_to_pause_ = events + 1;
  return true;
}

// False where it returns for its number of events.
template <class Space, class Rule, class Sizes>
template <bool watched>
bool Engine<Space, Rule, Sizes>::process_until(double until) {
  std::uint32_t i = 0, with = 0;
  events_to_pause_ = 1;
  for (;;) {
    if (--events_to_pause_ == 0) [[unlikely]] {
      if (!go_on(until)) return false;
      --events_to_pause_;
    }
    if (!queue_.pop(until, i, with, *this)) break;
    // Of so few disks that all is in the second-level cache, the lists alone are worth it.
    beyond_cache_ ? fetch_for_upcoming() : fetch_lists(3);
    now_ = disks_[i].event_time;
    if constexpr (watched) {
      process_and_tell(i, with);
    } else {
      process<Order::of_time>(i, with);
    }
  }
  settle();
  now_ = until;
  events_to_check_ += events_to_pause_;  // what was not used
  events_to_return_ += events_to_pause_;
  return true;
}

// The event of disk i that is due now, with disk k if k is not i: the same that its record says, but known earlier.
template <class Space, class Rule, class Sizes>
template <Order order>
[[gnu::always_inline]] inline void Engine<Space, Rule, Sizes>::process(std::uint32_t i, std::uint32_t k) {
  const Disk& disk = disks_[i];
  if (disk.partner >= 0) [[likely]] {
    const std::uint32_t j = k != i ? k : static_cast<std::uint32_t>(disk.partner);
    if (is_mutual(i, j)) [[likely]] {
      if constexpr (order == Order::of_the_rest) go_back(i, j);
      // The lower first, so that its rounding does not depend on who predicted it.
      const std::uint32_t swap = (i ^ j) & -static_cast<std::uint32_t>(j < i);
      collide<order>(i ^ swap, j ^ swap);
    } else {  // the partner was hit by another disk first
      ++counters_.predictions_renewed;
      if constexpr (order == Order::of_time) {
        fly_on(i, motion_at(disk, now_));
      } else {
        if constexpr (order == Order::of_the_rest) go_back(i, i);
        predict_in_window<order>(i);
      }
    }
  } else if (disk.partner == shell_exit) {
    ++counters_.shell_exits;
    if constexpr (order == Order::of_time) bring_forward(i);
    leave_shell(i);
    if constexpr (order == Order::of_time) {
      predict(i, motion_at(disk, now_));
    } else {
      predict_in_window<order>(i);
    }
    lists_.mend();  // what it needs is on its way, and the prediction does not wait for it
  } else {
    hit_wall(i);
  }
}

// The same, and the watcher is told what it did: apart from the loop that
// nobody watches, which must not pay for it.
template <class Space, class Rule, class Sizes>
[[gnu::noinline]] void Engine<Space, Rule, Sizes>::process_and_tell(std::uint32_t i, std::uint32_t k) {
  const Disk before = disks_[i];
  const bool touches = before.partner >= 0 && is_mutual(i, static_cast<std::uint32_t>(before.partner));
  // The lower first, whoever predicted it: so that what the watcher sums up is the same to the last bit after a
  // restart.
  const std::uint32_t a = touches ? std::min(i, static_cast<std::uint32_t>(before.partner)) : i;
  const std::uint32_t b = touches ? std::max(i, static_cast<std::uint32_t>(before.partner)) : i;
  const Motion first = motion_at(disks_[a], now_);
  const Motion second = touches ? motion_at(disks_[b], now_) : first;
  process<Order::of_time>(i, k);
  const double time = base_ + now_;
  if (touches) {
    double dx = second.x() - first.x(), dz = second.z() - first.z();
    if constexpr (Space::wraps_x) dx = period_x_.nearest(dx);
    if constexpr (Space::wraps_z) dz = period_z_.nearest(dz);
    bool from_first = false;  // where the second is at rest, and is not moved
    if constexpr (rests_apply) from_first = is_at_rest(b);
    const double mass = from_first ? -sizes_.mass(a) : sizes_.mass(b);
    const Disk& pushed = disks_[from_first ? a : b];
    const Motion& before_it = from_first ? first : second;
    watcher_->touched(time, first.x(), first.z(), dx, dz, mass * (pushed.vx - before_it.vx()),
                      mass * (pushed.vz - before_it.vz()));
    tell(a);
    tell(b);
  } else if (before.partner < 0 && before.partner != shell_exit) {
    const double mass = sizes_.mass(i);
    watcher_->touched_wall(time, labels_[i], before.partner == floor_below, first.z(),
                           mass * (disks_[i].vx - first.vx()), mass * (disks_[i].vz - first.vz()));
    tell(i);
  }
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::tell(std::uint32_t i) const {
  if (watcher_ == nullptr) return;
  const Motion motion = motion_at(disks_[i], now_);
  watcher_->flies(time(), labels_[i], motion.x(), motion.z(), motion.vx(), motion.vz());
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::tell_all() const {
  if (watcher_ == nullptr) return;
  for (std::uint32_t i = 0; i < count_; ++i) tell(i);
}

template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::advance_towards(double time, std::uint64_t most_events) {
  events_to_return_ = most_events;
  for (;;) {
    double goal = time - base_;
    if (std::abs(goal - synchronise_at_) <= 8 * std::numeric_limits<double>::epsilon() * std::abs(time))
      goal = synchronise_at_;
    if (!(goal > now_)) return true;
    const double until = std::min({goal, synchronise_at_, bath_at_, rest_at_});
    bool arrived = true;
    if (tiles_.empty()) {
      arrived = watcher_ == nullptr ? process_until<false>(until) : process_until<true>(until);
    } else if constexpr (tiles_apply) {
      arrived = process_tiles_until(until);
    }
    if (!arrived) return false;
    if constexpr (rests_apply) {
      if (now_ == rest_at_) act_rest();
    }
    if (now_ == bath_at_) act_bath();
    if (now_ == synchronise_at_) {
      const bool is_goal = goal == synchronise_at_;  // before the next one is set
      synchronise();
      if (is_goal || !(time - base_ > 0)) return true;
    }
  }
}

// ------------------------------------------------------------------------------------------------
// contacts

// The TC model: a contact is elastic if either partner was hit less than t_c
// ago. Sets the clocks.
template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::too_soon(std::uint32_t i, std::uint32_t j) {
  if (contact_duration_ <= 0) return false;
  const bool elastic = now_ - last_contact_[i] < contact_duration_ || now_ - last_contact_[j] < contact_duration_;
  last_contact_[i] = last_contact_[j] = now_;
  counters_.elastic_contacts += elastic;
  return elastic;
}

// The restitution of two disks where it may depend on their approach; none if they touch as smooth elastic disks do.
template <class Space, class Rule, class Sizes>
[[gnu::noinline]] std::optional<double> Engine<Space, Rule, Sizes>::unusual_restitution(std::uint32_t i,
                                                                                        std::uint32_t j, TwoLanes d,
                                                                                        TwoLanes dv) {
  if (too_soon(i, j)) return {};
  const double approach = -(d[0] * dv[0] + d[1] * dv[1]) / std::sqrt(d[0] * d[0] + d[1] * d[1]);
  return disk_surface_.restitution_at(approach);
}

template <class Space, class Rule, class Sizes>
template <Order order>
void Engine<Space, Rule, Sizes>::collide(std::uint32_t i, std::uint32_t j) {
  Motion first = motion_at(disks_[i], now_), second = motion_at(disks_[j], now_);
  [[maybe_unused]] const TwoLanes before = first.velocity;
  exchange(i, j, first, second);
  if constexpr (order == Order::of_tiles) log_.add(now_, i, j, sizes_.mass(i) * (first.velocity - before));
  ++counters_.disk_collisions;
  const TwoLanes exits = shell_exits_of(i, j, first, second);
  write_down(i, first);
  write_down(j, second);
  settle();
  constexpr bool others_ahead = order == Order::of_the_rest;
  // Both are predicted before what comes next is written down of either, so that the two predictions overlap in the
  // processor. Neither finds the other: they separate.
  Candidate next_first, next_second;
  if (is_near_edge(i, j)) [[unlikely]] {  // asked once: for each of both it would be two coin tosses
    next_first = next_event_by<true, others_ahead>(i, exits[0]);
    next_second = next_event_by<true, others_ahead>(j, exits[1]);
  } else {
    next_first = next_event_by<false, others_ahead>(i, exits[0]);
    next_second = next_event_by<false, others_ahead>(j, exits[1]);
  }
  if (next_second.partner == next_first.partner) [[unlikely]] {
    // What the first meets is no longer free for the second.
    commit(i, next_first, exits[0]);
    const bool taken = next_second.partner >= 0 && next_second.time < never &&
                       !(next_second.time < disks_[static_cast<std::uint32_t>(next_second.partner)].event_time);
    if (taken) next_second = next_event<others_ahead>(j, exits[1]);
    commit(j, next_second, exits[1]);
    return;
  }
  pending_[0].is(i, next_first, exits[0]);
  pending_[1].is(j, next_second, exits[1]);
}

// The contact itself: changes the velocities, the spins and the ledger.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::exchange(std::uint32_t i, std::uint32_t j, Motion& first, Motion& second) {
  TwoLanes d = second.place - first.place;
  // Which images meet is told from the records, which are at hand before the flights are: both disks are in their
  // shells there as now.
  if constexpr (Space::wraps_x || Space::wraps_z)
    d += Period::to_nearest(period_x_, period_z_, pair_at(&disks_[j].x) - pair_at(&disks_[i].x));
  const TwoLanes dv = second.velocity - first.velocity;

  double restitution = 1;
  bool elastic = true;
  if constexpr (Rule::dissipates) {
    if (unusual_) [[unlikely]] {
      if constexpr (rests_apply) {
        if (is_at_rest(i) != is_at_rest(j) && push_off_rest(i, j, first, second, d)) return;
      }
      const std::optional<double> found = unusual_restitution(i, j, d, dv);
      elastic = !found;
      restitution = found.value_or(1);
    } else {
      elastic = too_soon(i, j);
      if (!elastic) restitution = disk_surface_.restitution;
    }
  }
  const double inverse_first = 1 / sizes_.mass(i), inverse_second = 1 / sizes_.mass(j);
  const double reduced_mass = 1 / (inverse_first + inverse_second);
  if constexpr (Rule::spins) {
    if (!elastic) {
      const double dx = d[0], dz = d[1], dvx = dv[0], dvz = dv[1];
      const double distance = std::sqrt(dx * dx + dz * dz), nx = dx / distance, nz = dz / distance;
      const double ri = sizes_.radius(i), rj = sizes_.radius(j);
      const double gn = -(dvx * nx + dvz * nz);
      const double gt = -(-dvx * nz + dvz * nx) + ri * spins_[i] + rj * spins_[j];
      Surface varied;
      const Surface* surface = &disk_surface_;
      if (unusual_) [[unlikely]] {
        varied = disk_surface_.with(restitution);
        surface = &varied;
      }
      const RoughImpulse p = walton_impulse(nx, nz, gn, gt, reduced_mass, *surface, inverse_inertia_ratio_);
      first.velocity += TwoLanes{p.px, p.pz} * inverse_first;
      second.velocity -= TwoLanes{p.px, p.pz} * inverse_second;
      spins_[i] += inverse_inertia_ratio_ * p.tangential * inverse_first / ri;
      spins_[j] += inverse_inertia_ratio_ * p.tangential * inverse_second / rj;
      counters_.virial -= p.px * dx + p.pz * dz;
      dissipated_ += p.dissipated;
      return;
    }
  }
  double contact_squared = 1;
  if constexpr (!Sizes::equal) contact_squared = sizes_.contact_distance(i, j) * sizes_.contact_distance(i, j);
  const NormalImpulse impulse = smooth_impulse(d, dv, contact_squared, restitution);
  const double momentum = reduced_mass * (1 + restitution);
  const double to_first = momentum * inverse_first, to_second = momentum * inverse_second;
  first.velocity = fused(to_first * impulse.normal, both(impulse.approach), first.velocity);
  second.velocity = fused(-to_second * impulse.normal, both(impulse.approach), second.velocity);
  counters_.virial -= momentum * impulse.approach;
  if constexpr (Rule::dissipates) dissipated_ += reduced_mass * impulse.dissipated;
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::hit_wall(std::uint32_t i) {
  Motion motion = motion_at(disks_[i], now_);
  switch (disks_[i].partner) {
    case left_wall:
      bounce(i, motion, -1, 0, 0, side_surface_);
      break;
    case right_wall:
      bounce(i, motion, 1, 0, 0, side_surface_);
      break;
    case lid_above:
      bounce(i, motion, 0, 1, 0, lid_surface_);
      break;
    default:
      hit_floor(i, motion);
      break;
  }
  (disks_[i].partner == floor_below ? counters_.floor_collisions : counters_.wall_collisions) += 1;
  fly_on(i, motion);
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::hit_floor(std::uint32_t i, Motion& motion) {
  const double mass = sizes_.mass(i);
  const FloorMotion::Motion floor = floor_.motion(now_);
  if (const auto* thermal = std::get_if<ThermalFloor>(&bath_)) {
    const double before = motion.vx() * motion.vx() + motion.vz() * motion.vz();
    const double speed = std::sqrt(thermal->temperature / mass);
    motion.velocity[0] = speed * random_.normal_pair().first;
    motion.velocity[1] = floor.velocity + speed * std::sqrt(-2 * std::log(random_.uniform_positive()));
    floor_work_ += 0.5 * mass * (motion.vx() * motion.vx() + motion.vz() * motion.vz() - before);
    return;
  }
  const double vz_before = motion.vz();
  bounce(i, motion, 0, -1, floor.velocity, floor_surface_);
  floor_work_ += mass * (motion.vz() - vz_before) * floor.velocity;
  // A disk that lies still on the floor is carried in small hops: a contact has
  // to end before the next can begin.
  const double pressing = gravity_ + floor.acceleration;
  const double hop = contact_duration_ > 0 ? contact_duration_ : rest_hop;
  const double slowest = 0.5 * pressing * hop;
  if (motion.vz() - floor.velocity < 1e-3 * slowest) {
    const double slow = motion.vz();
    motion.velocity[1] = floor.velocity + slowest;
    floor_work_ += 0.5 * mass * (motion.vz() - slow) * (motion.vz() + slow);
  }
}

// One disk against a wall that moves vertically; (nx, nz) points from the disk
// to the wall.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::bounce(std::uint32_t i, Motion& motion, double nx, double nz, double wall_vz,
                                        const Contact& surface) {
  const double mass = sizes_.mass(i);
  const double gx = motion.vx(), gz = motion.vz() - wall_vz;
  const double gn = gx * nx + gz * nz;
  if (!(gn > 0)) return;  // grazed, by rounding
  Surface contact = surface;
  if constexpr (Rule::dissipates) {
    if (too_soon(i, i)) {
      contact = Surface{};
    } else if (surface.varies()) [[unlikely]] {
      contact.restitution = surface.restitution_at(gn);
    }
  }
  if constexpr (Rule::spins) {
    const double radius = sizes_.radius(i);
    const double gt = -gx * nz + gz * nx + radius * spins_[i];
    const RoughImpulse impulse = walton_impulse(nx, nz, gn, gt, mass, contact, inverse_inertia_ratio_);
    motion.velocity += TwoLanes{impulse.px, impulse.pz} / mass;
    spins_[i] += inverse_inertia_ratio_ * impulse.tangential / (mass * radius);
    dissipated_ += impulse.dissipated;
  } else {
    motion.velocity -= (1 + contact.restitution) * gn * TwoLanes{nx, nz};
    dissipated_ += 0.5 * mass * (1 - contact.restitution * contact.restitution) * gn * gn;
  }
}

// ------------------------------------------------------------------------------------------------
// locked rows

// Disks that fill a gap exactly, a row from wall to wall say, hand their momenta on without end at one instant. Called
// after every so many events: has time stood still meanwhile? Where it crawls instead, dissipative disks without a
// contact clock have collapsed: infinitely many contacts in a finite time, which no event-driven run can follow.
template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::locked() {
  const double passed = now_ - checked_at_;
  const std::uint64_t events = events_between_checks();
  checked_at_ = now_;
  events_to_check_ = events;
  if constexpr (Rule::dissipates) {
    constexpr double crawl = 1e-6;
    constexpr std::uint32_t most_crawls = 3;
    if (passed >= 1e-12) crawls_ = contact_duration_ <= 0 && passed < crawl ? crawls_ + 1 : 0;
    if (crawls_ == most_crawls)
      throw std::runtime_error("inelastic collapse at time " + std::to_string(base_ + now_) + ": " +
                               std::to_string(most_crawls * events) + " contacts within " +
                               std::to_string(most_crawls * crawl) +
                               ", and no end of them. Disks that dissipate and rest on one another need a contact "
                               "duration (1e-4 of the time unit does)");
  }
  return passed < 1e-12;
}

// Lets every contact without a gap lose its approach (a perfectly plastic
// impulse, momentum kept, the energy written down as dissipated), again and
// again until nothing approaches: what physics does to a locked row in a real
// contact's time.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::relieve() {
  constexpr double touching = 1e-11;
  constexpr int most_sweeps = 100'000;
  ++counters_.locks_relieved;
  if constexpr (rests_apply) wake_all();
  for (std::uint32_t i = 0; i < count_; ++i) bring_forward(i);
  const double before = kinetic_energy(), work_before = floor_work_;
  double fastest = never;
  for (int sweep = 0; sweep < most_sweeps && fastest > slowest_approach / 2; ++sweep) {
    fastest = 0;
    const auto stop = [&](double approach) {  // how much of it to take away
      fastest = std::max(fastest, approach);
      return std::max(approach, 0.0);
    };
    for (std::uint32_t i = 0; i < count_; ++i) {
      Disk& disk = disks_[i];
      lists_.each_neighbour(i, [&](std::uint32_t k) {
        if (k < i) return;
        Disk& other = disks_[k];
        double dx = other.x - disk.x, dz = other.z - disk.z;
        if constexpr (Space::wraps_x) dx = period_x_.nearest(dx);
        if constexpr (Space::wraps_z) dz = period_z_.nearest(dz);
        const double distance = std::sqrt(dx * dx + dz * dz);
        if (distance > sizes_.contact_distance(i, k) + touching) return;
        const double nx = dx / distance, nz = dz / distance;
        const double approach = stop(-((other.vx - disk.vx) * nx + (other.vz - disk.vz) * nz));
        const double mi = sizes_.mass(i), mk = sizes_.mass(k);
        disk.vx -= approach * mk / (mi + mk) * nx;
        disk.vz -= approach * mk / (mi + mk) * nz;
        other.vx += approach * mi / (mi + mk) * nx;
        other.vz += approach * mi / (mi + mk) * nz;
      });
      if constexpr (Space::has_walls) {
        const double radius = sizes_.radius(i);
        if (hard_sides_ && disk.x - radius < touching) disk.vx += stop(-disk.vx);
        if (hard_sides_ && width_ - radius - disk.x < touching) disk.vx -= stop(disk.vx);
        if (lid_height_ - radius - disk.z < touching) disk.vz -= stop(disk.vz);
        if (disk.z - radius - floor_.position(now_) < touching) {
          const double approach = stop(floor_.velocity(now_) - disk.vz);
          disk.vz += approach;
          floor_work_ += sizes_.mass(i) * approach * floor_.velocity(now_);
        }
      }
    }
  }
  // The floor's work is in the ledger by its impulses; the rest of what is
  // missing was dissipated.
  dissipated_ += before + (floor_work_ - work_before) - kinetic_energy();
  predict_all();
}

// ------------------------------------------------------------------------------------------------
// reservoirs

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::act_bath() {
  const auto kinetic = [&](const Disk& disk, std::uint32_t i) {
    return 0.5 * sizes_.mass(i) * (disk.vx * disk.vx + disk.vz * disk.vz);
  };
  if (const auto* bath = std::get_if<AndersenBath>(&bath_)) {
    const std::uint32_t i = random_.below(count_);
    Disk& disk = disks_[i];
    bring_forward(i);
    const double before = kinetic(disk, i), speed = std::sqrt(bath->temperature / sizes_.mass(i));
    const Random::Pair draw = random_.normal_pair();
    disk.vx = speed * draw.first;
    disk.vz = speed * draw.second;
    bath_work_ += kinetic(disk, i) - before;
    predict(i, motion_at(disk, now_));
    settle();
    tell(i);
    bath_at_ = now_ - std::log(random_.uniform_positive()) / (bath->rate * count_);
    return;
  }
  for (std::uint32_t i = 0; i < count_; ++i) bring_forward(i);
  if (const auto* bath = std::get_if<LangevinBath>(&bath_)) {
    const double keep = std::exp(-bath->rate * bath->interval);
    const double given = std::sqrt(bath->temperature * -std::expm1(-2 * bath->rate * bath->interval));
    for (std::uint32_t i = 0; i < count_; ++i) {
      Disk& disk = disks_[i];
      const double before = kinetic(disk, i), kick = given / std::sqrt(sizes_.mass(i));
      const Random::Pair draw = random_.normal_pair();
      disk.vx = keep * disk.vx + kick * draw.first;
      disk.vz = keep * disk.vz + kick * draw.second;
      bath_work_ += kinetic(disk, i) - before;
    }
    bath_at_ = now_ + bath->interval;
  } else if (const auto* noise = std::get_if<WhiteNoiseBath>(&bath_)) {
    std::vector<Random::Pair> kicks(count_);
    Random::Pair mean{0, 0};
    double total_mass = 0;
    for (std::uint32_t i = 0; i < count_; ++i) {
      const double mass = sizes_.mass(i), kick = std::sqrt(noise->heating * noise->interval / mass);
      const Random::Pair draw = random_.normal_pair();
      kicks[i] = {kick * draw.first, kick * draw.second};
      mean.first += mass * kicks[i].first;
      mean.second += mass * kicks[i].second;
      total_mass += mass;
    }
    if (!noise->conserve_momentum) mean = {0, 0};
    for (std::uint32_t i = 0; i < count_; ++i) {
      Disk& disk = disks_[i];
      const double before = kinetic(disk, i);
      disk.vx += kicks[i].first - mean.first / total_mass;
      disk.vz += kicks[i].second - mean.second / total_mass;
      bath_work_ += kinetic(disk, i) - before;
    }
    bath_at_ = now_ + noise->interval;
  }
  predict_all();
  tell_all();
}

// ------------------------------------------------------------------------------------------------
// synchronisation

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::synchronise() {
  ++counters_.synchronisations;
  for (std::uint32_t i = 0; i < count_; ++i) {
    bring_forward(i);
    disks_[i].own_time = 0;
  }
  for (double& time : last_contact_) time -= now_;
  bath_at_ -= now_;
  rest_at_ -= now_;
  look_at_ -= now_;
  const double elapsed = now_;
  intervals_done_ += intervals_;
  base_ = static_cast<double>(intervals_done_) * interval_;
  now_ = 0;
  tell_all();  // as a run that goes on from here will be: what the watcher sums up is then cut at the same moments
  // Often enough for the clock's resolution, seldom enough to cost nothing: 150
  // to 1000 events a disk apart.
  const std::uint64_t events = counters_.events() - events_at_synchronisation_;
  events_at_synchronisation_ = counters_.events();
  event_rate_ = std::max(static_cast<double>(events), 1.0) / elapsed;
  const double events_a_disk = static_cast<double>(events) / count_;
  if (events_a_disk < 150 && elapsed * 2 <= longest_interval) intervals_ *= 2;
  if (events_a_disk > 1000 && intervals_ > 1) intervals_ /= 2;
  begin_interval();
}

// Numbers the disks along a space-filling curve. Sorting what is sorted changes
// nothing, so a resumed run has the numbers of the one it continues.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::renumber() {
  std::vector<std::uint64_t> keys(count_);
  for (std::uint32_t i = 0; i < count_; ++i) {
    double x = disks_[i].x, z = disks_[i].z;
    if constexpr (Space::wraps_x) x = period_x_.wrapped(x);
    if constexpr (Space::wraps_z) z = period_z_.wrapped(z);
    keys[i] = static_cast<std::uint64_t>(hilbert_place(hilbert_cell(x), hilbert_cell(z))) << 32 | i;
  }
  std::sort(keys.begin(), keys.end());
  const auto permute = [&](auto& values) {
    auto old = values;
    for (std::uint32_t i = 0; i < count_; ++i) values[i] = old[static_cast<std::uint32_t>(keys[i])];
  };
  permute(disks_);
  permute(labels_);
  if constexpr (Rule::spins) permute(spins_);
  if constexpr (Rule::dissipates) permute(last_contact_);
  if constexpr (rests_apply) permute(rest_height_);
  if constexpr (!Sizes::equal) {
    permute(sizes_.radii);
    permute(sizes_.masses);
  }
}

// The density in layers across the box, mean over the disks: a bed under gravity is denser where its disks are than the
// space that it takes up.
template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::density_round_disks() const {
  constexpr double usual_thickness = 3;  // some rows of a crystal
  constexpr std::size_t most_layers = 4096;
  double low = never, high = -never;
  for (std::uint32_t i = 0; i < count_; ++i) {
    low = std::min(low, disks_[i].z);
    high = std::max(high, disks_[i].z);
  }
  const double thickness = std::max(usual_thickness, (high - low) / (most_layers - 1));
  std::vector<double> layers(most_layers);
  for (std::uint32_t i = 0; i < count_; ++i) layers[static_cast<std::size_t>((disks_[i].z - low) / thickness)] += 1;
  double squares = 0;
  for (const double disks : layers) squares += disks * disks;
  return squares / (count_ * width_ * thickness);
}

// Files every disk's shell, round where it is now, in a grid of that height.
template <class Space, class Rule, class Sizes>
template <class Grid>
void Engine<Space, Rule, Sizes>::file_shells(Grid& grid, double height) {
  grid.reset(disks_.data(), largest_contact_ + 2 * largest_skin_ + shell_slack_, width_, height);
  for (std::uint32_t i = 0; i < count_; ++i) {
    centre_shell(i);
    disks_[i].skin = static_cast<std::uint8_t>(std::min(largest_skin_, 0.36) / skin_unit);
    grid.file(i, reach(i));
  }
}
// The same in the kind of cells that suits it: a bed is denser at times than it may be now.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::file_shells(double height) {
  if constexpr (!Space::falls) {
    auto& narrow = grid_.template emplace<ShellGrid<NarrowCell>>();
    file_shells(narrow, height);
    if (narrow.crowding() < most_crowding) return;
  }
  file_shells(grid_.template emplace<ShellGrid<WideCell>>(), height);
}

// From positions, velocities, spins and clocks at now_ = 0 alone.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::begin_interval() {
  renumber();
  synchronise_at_ = static_cast<double>(intervals_) * interval_;
  checked_at_ = -1;
  crawls_ = 0;
  events_to_check_ = events_between_checks();
  if constexpr (!Sizes::equal) largest_contact_ = 2 * *std::max_element(sizes_.radii.begin(), sizes_.radii.end() - 1);
  double top = 0;
  for (std::uint32_t i = 0; i < count_; ++i) top = std::max(top, disks_[i].z);
  const double height = Space::wraps_z ? period_z_.length : std::min(top, 4.0 * count_ / width_) + 2;
  // Bounds of the shells: the radius that gives eight neighbours on the average where it is as dense as round the
  // disks. Many a bed is denser than that for a part of its period.
  const double neighbours = Space::falls ? 7.5 : 8.3;
  const double density = Space::wraps_z ? count_ / (width_ * height) : density_round_disks();
  largest_skin_ = std::clamp(0.5 * (std::sqrt(neighbours / (std::numbers::pi * density)) - 1), 0.25, 1.5);
  // Two disks that stay in their shells must not come near a second image of each other.
  if constexpr (Space::wraps_x) {
    if (period_x_.length > 0) largest_skin_ = std::min(largest_skin_, (period_x_.length / 2 - largest_contact_) / 4);
  }
  if constexpr (Space::wraps_z) largest_skin_ = std::min(largest_skin_, (period_z_.length / 2 - largest_contact_) / 4);
  largest_skin_ = std::floor(largest_skin_ / skin_unit) * skin_unit;  // as records hold it
  // Distances of shells' centres are taken in single precision.
  const double extent = std::max(width_, std::max(height, top));
  shell_slack_ = static_cast<float>(shell_slack + 1e-6 * (extent + 8));
  lists_.reset(disks_.data(), count_);
  choose_tiles();
  file_shells(height);
  std::visit(
      [this](auto& grid) {
        for (std::uint32_t i = 0; i < count_; ++i) {
          look_round<true>(grid, i);
          choose_skin(i);
          grid.set_reach(i, reach(i));
        }
        for (std::uint32_t i = 0; i < count_; ++i) {
          mark_near_bounds(i);
          look_round<true>(grid, i);
          lists_.list(i, find_neighbours(i));
        }
      },
      grid_);
  predict_all();
}

// Calls visit(value) for everything that the future depends on besides the
// disks, in a fixed order.
template <class Space, class Rule, class Sizes>
template <class Self, class Visit>
void Engine<Space, Rule, Sizes>::visit_state(Self& self, Visit visit) {
  visit(self.intervals_);
  visit(self.intervals_done_);
  visit(self.event_rate_);
  visit(self.events_at_synchronisation_);
  visit(self.bath_at_);
  visit(self.counters_);
  visit(self.initial_energy_);
  visit(self.dissipated_);
  visit(self.floor_work_);
  visit(self.bath_work_);
  if constexpr (!Sizes::equal) {
    for (std::uint32_t i = 0; i < self.count_; ++i) {
      visit(self.sizes_.radii[i]);
      visit(self.sizes_.masses[i]);
    }
  }
  for (std::uint32_t i = 0; i < self.count_; ++i) {
    visit(self.labels_[i]);
    visit(self.disks_[i].x);
    visit(self.disks_[i].z);
    visit(self.disks_[i].vx);
    visit(self.disks_[i].vz);
  }
  for (auto& spin : self.spins_) visit(spin);
  for (auto& clock : self.last_contact_) visit(clock);
  if constexpr (rests_apply) {
    for (auto& height : self.rest_height_) visit(height);
    visit(self.resting_);
    visit(self.woken_);
    visit(self.rest_at_);
    visit(self.look_at_);
    visit(self.contacts_at_look_);
  }
}

template <class Space, class Rule, class Sizes>
std::vector<std::uint8_t> Engine<Space, Rule, Sizes>::checkpoint() const {
  if (now_ != 0) throw std::logic_error("a checkpoint can be taken only at a synchronisation");
  std::vector<std::uint8_t> out;
  checkpoint_bytes::put(out, checkpoint_bytes::magic);
  checkpoint_bytes::put(out, count_);
  visit_state(*this, [&](const auto& value) { checkpoint_bytes::put(out, value); });
  checkpoint_bytes::put(out, random_.state());
  checkpoint_bytes::put(out, checkpoint_bytes::checksum(out.data(), out.data() + out.size()));
  return out;
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::restore(const std::vector<std::uint8_t>& bytes) {
  const std::uint8_t *at = bytes.data(), *end = at + bytes.size();
  std::uint64_t magic = 0;
  std::uint32_t count = 0;
  checkpoint_bytes::take(at, end, magic);
  checkpoint_bytes::take(at, end, count);
  if (magic != checkpoint_bytes::magic) throw std::invalid_argument("these bytes are not a checkpoint");
  std::uint64_t written = 0;
  end -= std::min<std::ptrdiff_t>(end - at, sizeof written);
  std::memcpy(&written, end, static_cast<std::size_t>(bytes.data() + bytes.size() - end));
  if (written != checkpoint_bytes::checksum(bytes.data(), end))
    throw std::invalid_argument("the checkpoint is damaged: its checksum is another");
  if (count != count_)
    throw std::invalid_argument("the checkpoint is of another scene: it holds another number of disks");
  visit_state(*this, [&](auto& value) { checkpoint_bytes::take(at, end, value); });
  std::array<std::uint64_t, 4> random_state{};
  checkpoint_bytes::take(at, end, random_state);
  if (at != end)
    throw std::invalid_argument(
        "the checkpoint is of another scene: it holds "
        "more than this one needs");
  if (std::any_of(labels_.begin(), labels_.end(), [this](std::uint32_t label) { return label >= count_; }))
    throw std::invalid_argument("the checkpoint is damaged: it names disks that do not exist");
  random_.set_state(random_state);
  unusual_ = disk_surface_.varies() || resting_ > 0;
  for (std::uint32_t i = 0; i < count_; ++i) disks_[i].own_time = 0;
  base_ = static_cast<double>(intervals_done_) * interval_;
  now_ = 0;
  begin_interval();
}

// ------------------------------------------------------------------------------------------------
// looking

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::watch(Watcher* watcher) {
  watcher_ = watcher;
  if constexpr (tiles_apply) {  // a watcher is told everything in the order of time
    if (watcher != nullptr && !tiles_.empty()) leave_tiles();
  }
  tell_all();
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::set_bath_temperature(double temperature) {
  if (!(temperature > 0) || !std::isfinite(temperature))
    throw std::invalid_argument("a bath's temperature must be positive");
  if (auto* langevin = std::get_if<LangevinBath>(&bath_)) {
    langevin->temperature = temperature;
  } else if (auto* andersen = std::get_if<AndersenBath>(&bath_)) {
    andersen->temperature = temperature;
  } else if (auto* thermal = std::get_if<ThermalFloor>(&bath_)) {
    thermal->temperature = temperature;
  } else {
    throw std::invalid_argument("the scene has no bath that holds a temperature");
  }
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::snapshot(Snapshot& out) const {
  out.time = time();
  out.floor_position = floor_.position(now_);
  out.floor_velocity = floor_.velocity(now_);
  out.x.resize(count_);
  out.z.resize(count_);
  out.vx.resize(count_);
  out.vz.resize(count_);
  out.spin.resize(spins_.size());
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Motion motion = motion_at(disks_[i], now_);
    const std::uint32_t label = labels_[i];
    out.x[label] = Space::wraps_x ? period_x_.wrapped(motion.x()) : motion.x();
    out.z[label] = Space::wraps_z ? period_z_.wrapped(motion.z()) : motion.z();
    out.vx[label] = motion.vx();
    out.vz[label] = motion.vz();
    if constexpr (Rule::spins) out.spin[label] = spins_[i];
    if constexpr (rests_apply) {
      if (!is_at_rest(i)) continue;
      out.vz[label] = out.floor_velocity;  // the mean over its hop
      if (resting_ == count_) out.z[label] = out.floor_position + rest_height_[i];
    }
  }
}

template <class Space, class Rule, class Sizes>
DiskProperties Engine<Space, Rule, Sizes>::properties() const {
  DiskProperties properties;
  properties.radius.resize(count_);
  properties.mass.resize(count_);
  for (std::uint32_t i = 0; i < count_; ++i) {
    properties.radius[labels_[i]] = sizes_.radius(i);
    properties.mass[labels_[i]] = sizes_.mass(i);
  }
  return properties;
}

template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::kinetic_energy() const {
  long double sum = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Motion motion = motion_at(disks_[i], now_);
    const long double vx = motion.vx(), vz = motion.vz();
    sum += 0.5L * sizes_.mass(i) * (vx * vx + vz * vz);
    if constexpr (Rule::spins) {
      const long double surface_speed = sizes_.radius(i) * spins_[i];
      sum += 0.5L * sizes_.mass(i) / inverse_inertia_ratio_ * surface_speed * surface_speed;
    }
  }
  return static_cast<double>(sum);
}

template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::potential_energy() const {
  long double sum = 0;
  for (std::uint32_t i = 0; i < count_; ++i) sum += gravity_ * sizes_.mass(i) * motion_at(disks_[i], now_).z();
  return static_cast<double>(sum);
}

template <class Space, class Rule, class Sizes>
EnergyLedger Engine<Space, Rule, Sizes>::energy() const {
  return {initial_energy_, kinetic_energy(), potential_energy(), dissipated_, floor_work_, bath_work_};
}

template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::largest_overlap() const {
  Snapshot here;
  snapshot(here);
  double cell = 1;
  if constexpr (!Sizes::equal) cell = 2 * *std::max_element(sizes_.radii.begin(), sizes_.radii.end() - 1);
  const DiskProperties disks = properties();
  return sim::largest_overlap(here, cell, period_x_.length, period_z_.length,
                              [&](std::uint32_t i, std::uint32_t k) { return disks.radius[i] + disks.radius[k]; });
}

template <class Space, class Rule, class Sizes>
std::size_t Engine<Space, Rule, Sizes>::bytes() const {
  return disks_.capacity() * sizeof(Disk) + labels_.capacity() * sizeof(std::uint32_t) +
         (spins_.capacity() + last_contact_.capacity()) * sizeof(double) +
         std::visit([](const auto& grid) { return grid.bytes(); }, grid_) + lists_.bytes() + queue_.bytes() +
         log_.bytes() + (deferred_.capacity() + rest_.capacity()) * sizeof(EventEntry);
}

}  // namespace shakebed::sim
