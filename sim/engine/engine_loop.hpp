// The loop over events, in the order of time. Included by engine.hpp only.
#pragma once

namespace shakebed::sim {

// Prefetches the neighbour lists of the two disks of the event that many events ahead.
template <class Space, class Rule, class Sizes>
[[gnu::always_inline]] inline void Engine<Space, Rule, Sizes>::fetch_lists(std::size_t ahead) const {
  std::uint32_t a = 0, b = 0;
  if (!queue_.upcoming(ahead, a, b)) return;
  fetch(&lists_.first_block(a));
  fetch(&lists_.first_block(b));
}

// Prefetches what will be read soon. First the neighbour lists of disks that will collide. Some events later the
// neighbours' structs, the contact clocks, and the cells round a disk that will leave its shell. (The queue prefetches
// the structs of the disks themselves, a bucket ahead. Half of those events will be void before their turn, so no more
// is prefetched.)
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
    float x = disks_[a].shell_x, z = disks_[a].shell_z;
    if (ahead_ > 0) {
      const TwoLanes centre = shell_centre(motion_at(disks_[a], disks_[a].event_time), ahead_);
      x = static_cast<float>(centre[0]), z = static_cast<float>(centre[1]);
    }
    std::visit([x, z](const auto& grid) { grid.fetch_round(x, z); }, grid_);
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
  if constexpr (press_applies) {
    if (events_to_ask_ == 0) ask_press();
  }
  const std::uint64_t events = std::min({events_to_check_, events_to_return_, events_to_ask_});
  events_to_check_ -= events;
  events_to_ask_ -= events;
  events_to_return_ -= events;
  events_to_pause_ = events + 1;
  return !press_wanted_;
}

// False where it returns for its number of events, or because the bed is to go on as a pressed one.
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
    assert(disks_[i].event_time >= now_ - asserted_rounding);  // events come in the order of time
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
  events_to_ask_ += events_to_pause_;
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

// The same, and the watcher is given what it did: apart from the loop that
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
  assert(most_events > 0 && !std::isnan(time));
  events_to_return_ = most_events;
  for (;;) {
    double goal = time - base_;
    if (std::abs(goal - synchronise_at_) <= 8 * std::numeric_limits<double>::epsilon() * std::abs(time))
      goal = synchronise_at_;
    if (!(goal > now_)) return true;
    const double until = std::min({goal, synchronise_at_, bath_at_, rest_at_, rub_at_, lid_.leaves_at});
    bool arrived = true;
    if (is_pressed_) {
      if constexpr (press_applies) arrived = press_until(until);
      if (arrived && now_ < until) continue;
    } else if (tiles_.empty()) {
      arrived = watcher_ == nullptr ? process_until<false>(until) : process_until<true>(until);
    } else if constexpr (tiles_apply) {
      arrived = process_tiles_until(until);
    }
    if constexpr (press_applies) {
      if (press_wanted_) {
        begin_press();
        continue;
      }
    }
    if (!arrived) return false;
    if constexpr (rests_apply) {
      if (now_ == rest_at_) act_rest();
    }
    if (now_ == bath_at_) act_bath();
    if (now_ == rub_at_) act_plates();
    if constexpr (Space::is_cell) {
      if (now_ == lid_.leaves_at) act_lid();
    }
    if (now_ == synchronise_at_) {
      const bool is_goal = goal == synchronise_at_;  // before the next one is set
      synchronise();
      if (is_goal || !(time - base_ > 0)) return true;
    }
  }
}

}  // namespace shakebed::sim
