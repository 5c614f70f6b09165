// What contacts do, and rows of disks that lock. Included by engine.hpp only.
#pragma once

namespace shakebed::sim {

// The TC model: a contact is elastic if either partner was hit less than t_c
// ago. Sets the clocks.
template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::too_soon(std::uint32_t i, std::uint32_t j) {
  if (contact_duration_ <= 0) return false;
  const double of_first = last_contact_[i], of_second = last_contact_[j];
  last_contact_[i] = last_contact_[j] = now_;
  const bool elastic = now_ - of_first < contact_duration_ || now_ - of_second < contact_duration_;
  if (elastic) [[unlikely]] {
    ++counters_.elastic_contacts;
    chain_counted_ = withheld_at_[i] == of_first || withheld_at_[j] == of_second;
  }
  return elastic;
}

// Adds up the energy that contacts made elastic by the clock would have dissipated. Of a chain of such contacts only
// the first that would have dissipated anything counts, since the others withhold the same energy again. A disk is in a
// counted chain as long as its latest contact is the one noted here. So dissipative contacts have nothing to undo.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::withhold(std::uint32_t i, std::uint32_t j, double reduced_mass, double approach,
                                          const Contact& surface) {
  const double e = surface.varies() ? surface.restitution_at(approach) : surface.restitution;
  if (!chain_counted_) counters_.withheld += 0.5 * reduced_mass * (1 - e * e) * approach * approach;
  if (chain_counted_ || e < 1) withheld_at_[i] = withheld_at_[j] = now_;
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
[[gnu::always_inline]] inline void Engine<Space, Rule, Sizes>::exchange(std::uint32_t i, std::uint32_t j, Motion& first,
                                                                        Motion& second) {
  TwoLanes d = second.place - first.place;
  // Which images meet follows from the records, which are at hand before the flights are: both disks are in their
  // shells there as now.
  if constexpr (Space::wraps_x || Space::wraps_z)
    d += Period::to_nearest(period_x_, period_z_, pair_at(&disks_[j].x) - pair_at(&disks_[i].x));
  const TwoLanes dv = second.velocity - first.velocity;
  assert(std::abs(std::sqrt(d[0] * d[0] + d[1] * d[1]) - sizes_.contact_distance(i, j)) <
         std::max(allowed_overlap(), asserted_rounding));

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
  if constexpr (Rule::dissipates) {
    dissipated_ += reduced_mass * impulse.dissipated;
    if (elastic) withhold(i, j, reduced_mass, -impulse.approach / std::sqrt(contact_squared), disk_surface_);
  }
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::hit_wall(std::uint32_t i) {
  assert(disks_[i].partner <= left_wall);
  Motion motion = motion_at(disks_[i], now_);
  switch (disks_[i].partner) {
    case left_wall:
      if constexpr (Space::is_cell) {
        if (slope_sine_ > 0) {
          hit_slope(i, motion, true);
          break;
        }
      }
      bounce(i, motion, -1, 0, 0, side_surface_);
      break;
    case right_wall:
      if constexpr (Space::is_cell) {
        if (slope_sine_ > 0) {
          hit_slope(i, motion, false);
          break;
        }
      }
      bounce(i, motion, 1, 0, 0, side_surface_);
      break;
    case lid_above:
      if constexpr (Space::is_cell) {
        if (lid_.is_free()) {
          hit_free_lid(i, motion);
          break;
        }
      }
      bounce(i, motion, 0, 1, 0, lid_surface_);
      break;
    default:
      hit_floor(i, motion);
      break;
  }
  (disks_[i].partner == floor_below ? counters_.floor_collisions : counters_.wall_collisions) += 1;
  bool lid_moved = false;
  if constexpr (Space::is_cell) lid_moved = disks_[i].partner == lid_above && lid_.is_free();
  fly_on(i, motion);
  if constexpr (Space::is_cell) {
    if (lid_moved) predict_below_lid(i);
  }
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
  const double slowest = hop_velocity(floor.acceleration);
  if (motion.vz() - floor.velocity < 1e-3 * slowest) {
    const double slow = motion.vz();
    motion.velocity[1] = floor.velocity + slowest;
    floor_work_ += 0.5 * mass * (motion.vz() - slow) * (motion.vz() + slow);
  }
}

// With which velocity [sqrt(g D)] along the normal a disk that lies still on the floor, or on a sloped side, leaves it.
// It is carried in small hops: a contact has to end before the next can begin. From a floor that falls away it parts:
// after a plastic contact rounding alone would decide whether they touch.
template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::hop_velocity(double floor_acceleration, double slope_sine) const {
  const double pressing = gravity_ + floor_acceleration;
  const double hop = contact_duration_ > 0 ? std::min(contact_duration_, longest_hop) : rest_hop;
  return 0.5 * std::max(pressing, -parting * pressing) * slope_sine * hop;
}

// One disk against a wall that moves vertically; (nx, nz) points from the disk
// to the wall.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::bounce(std::uint32_t i, Motion& motion, double nx, double nz, double wall_vz,
                                        const Contact& surface) {
  assert(std::abs(nx * nx + nz * nz - 1) < asserted_rounding);
  const double mass = sizes_.mass(i);
  const double gx = motion.vx(), gz = motion.vz() - wall_vz;
  const double gn = gx * nx + gz * nz;
  if (!(gn > 0)) return;  // grazed, by rounding
  Surface contact = surface;
  if constexpr (Rule::dissipates) {
    if (too_soon(i, i)) {
      withhold(i, i, mass, gn, surface);
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
                               " time units, without an end. Disks that dissipate energy and rest on one another need "
                               "a contact duration: 1e-4 of the time unit is enough");
  }
  return passed < 1e-12;
}

// Removes the approach of every contact without a gap, by a perfectly plastic impulse: momentum is kept, and the energy
// is counted as dissipated. This is repeated until nothing approaches. Physically it happens to a locked row within the
// time of a real contact.
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
        bool slopes = false;
        if constexpr (Space::is_cell) {
          slopes = slope_sine_ > 0;
          relieve_in_cell(i, touching, stop);
        }
        if (!slopes && hard_sides_ && disk.x - radius < touching) disk.vx += stop(-disk.vx);
        if (!slopes && hard_sides_ && width_ - radius - disk.x < touching) disk.vx -= stop(disk.vx);
        if (!lid_.is_free() && lid_height_ - radius - disk.z < touching) disk.vz -= stop(disk.vz);
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

}  // namespace shakebed::sim
