// A bed that is pressed on the floor, as soft disks: when it is taken for one, and for how long. Included by engine.hpp
// only.
//
// Events are cheap and exact in flight and when a bed lands. Soon after, every disk meets all its neighbours again and
// again: hundreds of contacts a disk and period, by any rule that hard disks can follow. From then until the floor
// falls away the bed is one of soft disks (pressed_bed.hpp). Their contact time follows the speed of the contacts, so
// that overlaps stay small, and ends at a value that is short against the motion of rows (pressed_contact_time). A bed
// that has come to rest sleeps: it moves with the floor, at no cost, until its weight begins to go.
//
// Beds in which contacts are never that frequent are not touched, not even by rounding.
#pragma once

namespace shakebed::sim {

// What was measured: T_x of beds of 500 disks, 30.6 and 30.0 D wide, beside soft spheres with contacts of 7e-4.
// tests/bench/README.md has the tables.

// The longest contact time of a pressed bed [sqrt(D/g)]; 100 us for 2 mm disks that are rough.
template <class Rule>
inline constexpr double longest_contact_time = Rule::spins ? 0.007 : 0.006;
// Smooth disks are not pressed with shorter ones: 10 us for 2 mm disks.
inline constexpr double shortest_contact_time = 7e-4;
// How far disks approach in a contact time [D], while it is between the two; cold smooth disks once they are pressed.
template <class Rule>
inline constexpr double pressed_travel = Rule::spins ? 1e-4 : 0.7e-4;
inline constexpr double travel_of_cold = 3e-4;
// How far rough disks move against the floor in a contact time [D].
inline constexpr double pressed_drift = 3e-4;
// Quicker contacts are left to events, unless rows have locked; so they are in a bed's first period, a packing that the
// floor hits.
inline constexpr double least_contact_time = 3e-4, least_contact_time_at_start = 1e-3,
                        least_contact_time_of_locked = 1e-4;
// Contacts a disk and contact time from which on a bed on the floor is taken for pressed, and one anywhere: rows that
// lock have thousands of them. With 0.2 on the floor the bed is 5 % hotter, as hard disks are while they land.
inline constexpr double pressed_crowd = 0.1, locked_crowd = 1;
// Rough disks are left to events until they have made so many contacts each in a period, over the contact duration of
// the scene [sqrt(D/g)]. A period counts as no longer than 4 sqrt(D/g). Beds at Gamma of 2 or more make up to 0.26, and
// 0.33 in one period in which a row locked: see tests/bench/README.md. A bed that has reached the limit is pressed
// earlier in later periods, until one goes by without.
inline constexpr double chattering = 0.6, chattering_on = 0.04;
// Cold ones, by T_x [m g D], from a lower limit on, which beds of 16 rows reach and beds of 5 do not. They stay soft in
// flight, and land as soft disks. As hard disks they keep too much energy by the contact duration, or slide without
// friction on walls that should stir them. Events alone had 0.2 to 1.9 times the T_x of soft spheres. Beds that land as
// hard disks and go on pressed are too cold by two.
inline constexpr double cold = 0.02, chattering_of_cold = 0.02;
inline constexpr double landing_contact_time = 1e-3;  // of soft disks in flight; 17 us for 3 mm disks
// How far beds move against the floor in a contact time [D], at most: they harden as soon as their springs hold
// little. Rough beds of 24 to 45 rows that had softened while they lay there, and were shaken up again, were
// compressed by up to 0.02 D. Smooth ones of 40 to 60 rows were compressed by 0.012 D. Those with e = 0.5 were too hot.
inline constexpr double landing_travel = 2e-3;
// Smooth beds of which the floor carries less than this share count as beds in flight. High ones touched it gently with
// a few rows, softened, and could not harden any more when the others came: 0.011 D.
inline constexpr double least_carried = 0.2;
// What springs that are still compressed may gain thereby, a check: of disks in flight [m g D], each; of the kinetic
// energy against the floor.
inline constexpr double gained_by_hardening = 1e-6, gained_of_motion = 1e-3;
// Of the contact time at most, between two checks. A part of what the springs hold is lost thereby. With 1.05 for all,
// smooth beds at Gamma = 1.5 are a tenth too cold, and rough ones at Gamma = 1.2 have a fifth of the T_z of soft
// spheres. Smooth ones that are very cold, by T_x [m g D], hold nothing that counts.
inline constexpr double softening = 1.01, softening_of_rough = 1.005, softening_of_very_cold = 1.05, very_cold = 0.003;
inline constexpr double least_neighbours = 1;   // pairs a disk; rows on rows have three
inline constexpr double neighbour_gap = 0.01;   // between two that are counted as such [D]
inline constexpr double least_on_floor = 0.25;  // contacts with the floor meanwhile, a diameter of width
// A bed leaves the floor that falls away while fewer pairs a disk than this are in contact, or after such a time.
inline constexpr double released_touching = 0.1, longest_release = 0.3;
inline constexpr double separated = 1e-13;  // overlap that hard disks may begin with [D]
inline constexpr int separating_sweeps = 200;
// A bed sleeps that moves with less than this against the floor [m g D], [sqrt(g D)]; it wakes before its weight is
// gone, so that its springs can follow.
inline constexpr double sleeping_temperature = 2e-6, sleeping_speed = 0.01, waking_weight = 0.3;
inline constexpr double sleep_steps = 256;  // a period of the floor
inline constexpr std::uint64_t events_between_presses =
    4;                                                  // a disk, after which it is asked whether the bed is pressed
inline constexpr double least_press_width = 4;          // [D]; the nearest image of a disk must be unique
inline constexpr double least_press_restitution = 0.3;  // stronger dashpots would need shorter steps
inline constexpr double least_press_tangential = -0.3;  // b0; no spring slips on as a hard contact with less does

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::plan_press(bool wanted) {
  if constexpr (press_applies) {
    const auto fits = [](const Contact& surface) {
      return !surface.varies() && surface.restitution >= least_press_restitution &&
             (!(surface.friction > 0) || surface.tangential_restitution >= least_press_tangential);
    };
    presses_ = wanted && contact_duration_ > 0 && std::holds_alternative<NoBath>(bath_) &&
               width_ >= least_press_width && fits(disk_surface_) && fits(side_surface_) && fits(floor_surface_) &&
               fits(lid_surface_);
    if (!presses_) return;
    pressed_.set_up({width_, Space::wraps_x ? width_ : 0, lid_height_},
                    {disk_surface_, side_surface_, floor_surface_, lid_surface_},
                    Rule::spins ? inverse_inertia_ratio_ : 0);
    constexpr int moments = 256;
    for (int k = 0; k < moments; ++k) {
      const FloorMotion::Motion floor = floor_.motion(floor_.period() * k / moments);
      floor_falls_ = floor_falls_ || gravity_ + floor.acceleration < 0;
      floor_speed_ = std::max(floor_speed_, std::abs(floor.velocity));
    }
  }
}

// The approach of neighbours, root of the mean square; nothing if they are few.
template <class Space, class Rule, class Sizes>
std::optional<double> Engine<Space, Rule, Sizes>::approach_of_neighbours() const {
  double squares = 0;
  std::uint64_t pairs = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Motion mine = motion_at(disks_[i], now_);
    lists_.each_neighbour(i, [&](std::uint32_t k) {
      if (k < i) return;
      const Motion other = motion_at(disks_[k], now_);
      double dx = other.x() - mine.x();
      const double dz = other.z() - mine.z();
      if constexpr (Space::wraps_x) dx = period_x_.nearest(dx);
      const double squared = dx * dx + dz * dz;
      if (squared > (1 + neighbour_gap) * (1 + neighbour_gap)) return;
      const double closing = dx * (other.vx() - mine.vx()) + dz * (other.vz() - mine.vz());
      squares += closing * closing / squared;
      ++pairs;
    });
  }
  if (static_cast<double>(pairs) < least_neighbours * count_) return {};
  return std::sqrt(squares / static_cast<double>(pairs));
}

// Asked after every so many events: are contacts so frequent that the bed is to go on as a pressed one?
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::ask_press() {
  events_to_ask_ = events_between_presses * count_;
  const double passed = now_ - asked_at_;
  const auto contacts = static_cast<double>(counters_.collisions() - contacts_when_asked_);
  asked_at_ = now_;
  const auto on_floor = static_cast<double>(counters_.floor_collisions - floor_contacts_when_asked_);
  contacts_when_asked_ = counters_.collisions();
  floor_contacts_when_asked_ = counters_.floor_collisions;
  const auto crowded = [&](double contact_time, double crowd) {
    return contacts * contact_time >= crowd * count_ * passed;
  };
  if constexpr (Rule::spins) {
    if (!chatters()) return;
  }
  const bool pushed = on_floor >= least_on_floor * width_;
  if (!crowded(longest_contact_time<Rule>, pushed ? pressed_crowd : locked_crowd)) return;
  const bool lies = pushed && gravity_ + floor_.motion(now_).acceleration > 0;
  if (!crowded(longest_contact_time<Rule>, lies ? pressed_crowd : locked_crowd)) return;
  const std::optional<double> approach = approach_of_neighbours();
  if (!approach) return;
  double contact_time = std::min(longest_contact_time<Rule>, pressed_travel<Rule> / *approach);
  if (!lies && !Rule::spins) contact_time = std::max(contact_time, shortest_contact_time);
  if (contact_time < (time() < interval_ ? least_contact_time_at_start : least_contact_time_of_locked)) return;
  if (!crowded(contact_time, lies && contact_time >= least_contact_time ? pressed_crowd : locked_crowd)) return;
  press_contact_time_ = Rule::spins ? contact_time : std::max(contact_time, shortest_contact_time);
  press_wanted_ = true;
}

// Have rough disks had more contacts since the latest synchronisation, or in the period at hand, than shaken ones have?
// A synchronisation comes once a period when contacts are frequent.
template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::chatters() {
  const auto contacts = static_cast<double>(counters_.collisions() - contacts_when_counted_);
  if (now_ - counted_since_ <= rest_period_) {
    const double product = contacts * contact_duration_ / count_;
    if (product >= (chatters_ ? chattering_on : chattering)) return true;
    return floor_falls_ && product >= chattering_of_cold && is_cold();
  }
  counted_since_ = now_;
  contacts_when_counted_ = counters_.collisions();
  return false;
}

template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::is_cold() const {
  double squares = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const double vx = motion_at(disks_[i], now_).vx();
    squares += vx * vx;
  }
  return squares < cold * count_;
}

// The tangential springs by the disks' labels: numbers change at a synchronisation.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::keep_stretches() {
  stretches_ = pressed_.stretches();
  for (PressedBed::Stretch& one : stretches_) {
    one.disk = labels_[one.disk];
    if (one.other < count_) one.other = labels_[one.other];
  }
}

template <class Space, class Rule, class Sizes>
auto Engine<Space, Rule, Sizes>::stretches_by_place() const -> std::vector<PressedBed::Stretch> {
  std::vector<std::uint32_t> place(count_);
  for (std::uint32_t i = 0; i < count_; ++i) place[labels_[i]] = i;
  std::vector<PressedBed::Stretch> stretches = stretches_;
  for (PressedBed::Stretch& one : stretches) {
    one.disk = place[one.disk];
    if (one.other < count_) one.other = place[one.other];
  }
  return stretches;
}

// From the records, which are those of now_.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::go_on_pressed() {
  std::vector<PressedBed::State> disks(count_);
  for (std::uint32_t i = 0; i < count_; ++i) disks[i] = {disks_[i].x, disks_[i].z, disks_[i].vx, disks_[i].vz};
  is_pressed_ = true;
  pressed_to_ = now_;
  const FloorMotion::Motion floor = floor_.motion(now_);
  if constexpr (Rule::spins) {
    pressed_.begin(std::move(disks), floor, press_contact_time_, spins_, stretches_by_place());
  } else {
    pressed_.begin(std::move(disks), floor, press_contact_time_);
  }
  if (is_asleep_) pressed_.lie(floor);
  energy_when_pressed_ = kinetic_energy() + potential_energy() + pressed_.compressed() + pressed_.damped();
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::begin_press() {
  press_wanted_ = false;
  chatters_ = pressed_in_interval_ = true;
  if (resting_ > 0) wake_all();
  unusual_ = false;
  for (std::uint32_t i = 0; i < count_; ++i) bring_forward(i);
  rest_at_ = look_at_ = never;
  released_at_ = never;
  is_asleep_ = false;
  go_on_pressed();
  step_error_ -= pressed_.compressed();  // of disks that were no longer apart
}

// Books what has happened since go_on_pressed(), and writes the disks' states into their records.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::write_down_pressed() {
  const EnergyLedger ledger = energy();
  floor_work_ = ledger.floor_work;
  dissipated_ = ledger.dissipated;
  step_error_ = ledger.step_error;
  for (std::uint32_t i = 0; i < count_; ++i) write_down(i, motion_now(i));
  if constexpr (Rule::spins) {
    for (std::uint32_t i = 0; i < count_; ++i) spins_[i] = spin_now(i);
    keep_stretches();
  }
  is_pressed_ = false;
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::end_press() {
  if constexpr (Rule::spins) pressed_.let_go();
  pressed_.separate(floor_.position(now_), separated, separating_sweeps);
  write_down_pressed();
  step_error_ += pressed_.compressed();  // where the disks could not be moved apart
  look_again();
  unusual_ = disk_surface_.varies();
  begin_interval();
}

// The contact time that follows from the contacts' speed, unless it is shorter.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::soften_pressed() {
  const double approach = pressed_.approach();
  const double temperature = pressed_.side_temperature();
  const double travel = !Rule::spins && temperature < cold ? travel_of_cold : pressed_travel<Rule>;
  double contact_time = longest_contact_time<Rule>;
  if (approach * contact_time > travel) contact_time = travel / approach;
  if constexpr (Rule::spins) {
    const double speed = std::sqrt(pressed_.mean_square_speed());
    if (speed * contact_time > pressed_drift) contact_time = pressed_drift / speed;
  }
  if (contact_time <= press_contact_time_) return;
  const double most = lands_soft() ? softening_of_rough : temperature < very_cold ? softening_of_very_cold : softening;
  press_contact_time_ = std::min(contact_time, most * press_contact_time_);
  pressed_.soften(press_contact_time_);
}

// Shortens the contact time to `contact_time`. Shortens it less if the springs would then hold more energy than `most`.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::harden_pressed(double contact_time, double most) {
  if (press_contact_time_ <= contact_time) return;
  const double ratio = std::sqrt(pressed_.compressed() / most);
  if (ratio >= 1) return;
  press_contact_time_ = std::max(contact_time, ratio * press_contact_time_);
  pressed_.soften(press_contact_time_);
}

// Contacts follow the bed: short in flight, since it is to land, and where it moves fast; as long as may be where it
// lies.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::adapt_contact_time(bool stays) {
  const double carried = Rule::spins ? 0 : least_carried * count_;
  const bool flies = pressed_.floor_force() <= carried;
  // A bed in flight will land faster than it moves now, about as fast as the floor.
  const double least = flies ? floor_speed_ * floor_speed_ : 0;
  const double square = std::max(pressed_.mean_square_speed(), least), longest = landing_travel / std::sqrt(square);
  if (stays && flies && pressed_.touching() < released_touching * count_) {
    harden_pressed(landing_contact_time, gained_by_hardening * count_);
  } else if (floor_falls_ && press_contact_time_ > longest) {
    harden_pressed(std::max(landing_contact_time, longest), gained_of_motion * 0.5 * square * count_);
  } else if (Rule::spins || !flies) {
    soften_pressed();
  }
}

// Sleeps, wakes, softens or ends, by what the bed does. After a step.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::check_press(const FloorMotion::Motion& floor) {
  const bool stays = lands_soft() && pressed_.side_temperature() < cold;
  adapt_contact_time(stays);
  const double weight = floor.acceleration + gravity_;
  if (weight >= 0 || pressed_.floor_force() != 0) {
    released_at_ = never;
    // A bed that stays soft in flight has the floor's speed there, too, for a moment.
    const bool lies = !floor_falls_ || pressed_.floor_force() > 0.5 * weight * count_;
    if (lies && weight > waking_weight && pressed_.fastest() < sleeping_speed &&
        pressed_.mean_square_speed() < 2 * sleeping_temperature) {
      is_asleep_ = true;
      pressed_.lie(floor);
    }
    return;
  }
  if (stays) return;
  released_at_ = std::min(released_at_, base_ + now_);
  if (pressed_.touching() < released_touching * count_ || base_ + now_ - released_at_ > longest_release) end_press();
}

// One step, or one of sleep, from `before`, the floor's motion at pressed_to_; how it moves at its end.
template <class Space, class Rule, class Sizes>
FloorMotion::Motion Engine<Space, Rule, Sizes>::press_on(const FloorMotion::Motion& before, double next) {
  const FloorMotion::Motion after = floor_.motion(next);
  const double step = next - pressed_to_;
  pressed_to_ = now_ = next;
  if (is_asleep_) {
    pressed_.carry(before, after);
    is_asleep_ = after.acceleration + gravity_ > waking_weight;
    if (!is_asleep_) pressed_.wake(after);
  } else {
    pressed_.step(before, after, step);
    if (pressed_.check_due()) check_press(after);
  }
  if (watcher_ != nullptr) tell_pressed(step);
  return after;
}

// False where it returns for its number of events.
template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::press_until(double until) {
  const std::uint64_t worth = 1 + count_ / 8;  // of a step in events
  FloorMotion::Motion floor = floor_.motion(pressed_to_);
  while (is_pressed_ && pressed_to_ < until) {
    const double step = is_asleep_ ? rest_period_ / sleep_steps : press_contact_time_ / pressed_.steps();
    // A step that would end just before the synchronisation, or behind it, ends there.
    const double next = pressed_to_ + 1.001 * step > synchronise_at_ ? synchronise_at_ : pressed_to_ + step;
    if (next > until) break;
    floor = press_on(floor, next);
    if (events_to_return_ <= worth) return false;
    events_to_return_ -= worth;
  }
  if (is_pressed_) now_ = until;
  return true;
}

// What a watcher receives of a step: the momenta of its contacts, and flights from where it ends. In a sleeping bed all
// forces are as large as the floor's.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::tell_pressed(double step) const {
  if (is_pressed_) {
    double on_floor = 0;
    pressed_.each_wall_contact(
        [&](std::uint32_t, bool is_floor, TwoLanes force) { on_floor += is_floor ? force[1] : 0; });
    if (is_asleep_ && on_floor > 0) step *= pressed_.floor_force() / on_floor;
    pressed_.each_contact([&](TwoLanes place, TwoLanes to, TwoLanes force) {
      watcher_->pressed(time(), place[0], place[1], to[0], to[1], step * force[0], step * force[1]);
    });
    pressed_.each_wall_contact([&](std::uint32_t i, bool is_floor, TwoLanes force) {
      watcher_->touched_wall(time(), labels_[i], is_floor, pressed_.at(i, 0).z, step * force[0], step * force[1]);
    });
  }
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Motion motion = motion_now(i);
    watcher_->flies(time(), labels_[i], motion.x(), motion.z(), motion.vx(), motion.vz());
  }
}

}  // namespace shakebed::sim
