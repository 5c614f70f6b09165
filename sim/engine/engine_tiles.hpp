// Event processing of a large periodic bed tile by tile. Included by engine.hpp only.
//
// The bed is far larger than the caches. In the order of time, one event is far from the next in space, so each waits
// for memory. But the order matters only where one event can influence the other. So time advances by short windows of
// about one event per disk. In a window the events of each tile are processed together, while its disks are in the
// cache. Only the inside of a tile is processed, and it shrinks during the window: influences from beyond the border
// reach ever farther inside. The remaining events are then processed in the order of time.
//
// The shrinking inside is no strict bound: a row of fast disks may carry a push farther. So early processing is
// optimistic, and may have to be rolled back. Contacts in tiles are logged. A disk's struct describes its flight since
// its last contact, and nothing but a contact changes it. A disk that is behind also looks for contacts along the
// earlier flights of neighbours that are ahead. When it finds one, or when anything else reaches a disk that is ahead,
// that disk is rolled back to this moment. Its later contacts are undone, then those of its partners, and so on. All of
// them predict their contacts anew. The resulting history is that of the order of time, up to rounding.
//
// Two disks that are ahead in different tiles never interact, because tiles keep margins. An event's own disk must keep
// a distance from the border. A disk that is ahead is at most one reach (of two shells) beyond that distance. Two such
// disks of different tiles are a reach apart. A shell is drawn anew in a tile only if everything that the disk did in
// the window fits into the new shell as well. So neighbour lists hold for whatever is rolled back.
#pragma once

namespace shakebed::sim {

inline constexpr std::uint32_t fewest_tiled = 400'000;  // disks; fewer are quicker in the order of time
inline constexpr double events_a_window = 0.9;          // of each disk
inline constexpr double fewest_in_window = 0.45;        // fewer do not repay the tiles
inline constexpr double shortest_window = 1e-9;         // so many events that even this is too long: time stands still
inline constexpr double longest_way = 0.12;             // of a disk in a window, root mean square [D]
inline constexpr double inward = 6;                     // by how much a tile's inside shrinks in a window [D]

// Tiles where they pay, for this interval: in large beds of hard, elastic disks alone.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::choose_tiles() {
  tiles_.clear();
  if constexpr (tiles_apply) {
    if (count_ < fewest_tiled || watcher_ != nullptr || !std::holds_alternative<NoBath>(bath_)) return;
    if (std::min(period_x_.length, period_z_.length) < 2 * tile_side) return;
    double mass = 0;
    for (std::uint32_t i = 0; i < count_; ++i) mass += sizes_.mass(i);
    longest_window_ = longest_way / std::sqrt(2 * kinetic_energy() / mass);
    if (!(event_rate_ * longest_window_ > fewest_in_window * count_)) return;
    rate_in_tiles_ = 4 * event_rate_;  // the first window is a short one, lest the rate should be out of date
    margin_ = 1.5 * (largest_contact_ + 2 * largest_skin_ + shell_slack_);
    tiles_ = tiles_of(disks_.data(), count_, period_x_, period_z_);
  }
}

// From now on everything in the order of time, until shells are drawn anew. No disk is ahead of now_ but by contacts
// in the log.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::leave_tiles() {
  for (std::uint32_t i = 0; i < count_; ++i) take_back(i);
  taken_back_.clear();
  for (std::uint32_t i = 0; i < count_; ++i) bring_forward(i);
  tiles_.clear();
  predict_all();
}

template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::process_tiles_until(double until) {
  while (now_ < until) {
    if (events_to_return_ == 0) return false;
    const double longest = std::min(events_a_window * count_ / rate_in_tiles_, longest_window_);
    const double windows = std::ceil((until - now_) / longest);
    const double start = now_, end = windows > 1 ? start + (until - start) / windows : until;
    const std::uint64_t before = counters_.events();
    if (longest < shortest_window || !process_window(end)) {  // something has locked
      leave_tiles();
      return process_until<false>(until);
    }
    const std::uint64_t events = counters_.events() - before;
    events_to_return_ -= std::min(events, events_to_return_);
    const double rate = static_cast<double>(events) / (end - start);
    const bool tells = events > count_ / 8;  // some windows are very short
    rate_in_tiles_ = tells ? rate : std::clamp(rate, rate_in_tiles_ / 8, 8 * rate_in_tiles_);
  }
  return true;
}

// False if there is no end of events: then now_ is that of the latest one up to which all is known.
template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::process_window(double until) {
  const double start = now_;
  log_.begin(start, count_);
  margin_growth_ = inward / (until - start);
  events_left_ = 4096 + 30 * static_cast<std::uint64_t>(count_);
  deferred_.clear();
  for (const Tile& tile : tiles_) {
    queue_tile(tile, until);
    if (!process_queued<Order::of_tiles>(&tile, until)) {
      now_ = start;
      return false;
    }
  }
  rest_.swap(deferred_);
  now_ = start;
  queue_.begin_window(disks_.data(), count_, start, until, 1.3 * static_cast<double>(rest_.size()));
  for (const EventEntry& one : rest_) queue_.push(one);
  if (!process_queued<Order::of_the_rest>(nullptr, until)) return false;
  now_ = until;
  return true;
}

// Queues what the tile's disks have to do until then, as their records tell.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::queue_tile(const Tile& tile, double until) {
  const double share = static_cast<double>(tile.end - tile.begin) / count_;
  queue_.begin_window(disks_.data(), count_, log_.start(), until, rate_in_tiles_ * (until - log_.start()) * share);
  for (std::uint32_t i = tile.begin; i < tile.end; ++i) {
    fetch(&disks_[std::min(i + 32, count_)]);
    if (i % 16 == 0) log_.fetch_last_of(std::min(i + 64, count_ - 1));
    const Disk& disk = disks_[i];
    if (!(disk.event_time <= until)) continue;
    const std::uint32_t k = disk.partner < 0 ? i : static_cast<std::uint32_t>(disk.partner);
    // A pair's event once.
    if (k < i && disks_[k].event_time == disk.event_time && disks_[k].partner == static_cast<std::int32_t>(i)) continue;
    if (is_for_tile(tile, i, disk.event_time)) {
      queue_.push(disk.event_time, i, k);
    } else {
      defer(disk.event_time, i, k);
    }
  }
}

// Takes what is queued, and what comes of it, in the order of time; what is not for the tile is deferred.
template <class Space, class Rule, class Sizes>
template <Order order>
bool Engine<Space, Rule, Sizes>::process_queued(const Tile* tile, double until) {
  std::uint32_t i = 0, with = 0;
  while (queue_.pop(until, i, with, *this)) {
    fetch_for_upcoming();
    now_ = disks_[i].event_time;
    if constexpr (order == Order::of_tiles) {
      if (!is_for_tile(*tile, i, now_) || (disks_[i].partner == shell_exit && !kept_near(i))) {
        defer(now_, i, with);
        continue;
      }
    }
    if (--events_left_ == 0) [[unlikely]] {
      settle();
      return false;
    }
    process<order>(i, with);
  }
  settle();
  return true;
}

// What disk i does next, where its record must stay that of its last contact. It is pending then.
template <class Space, class Rule, class Sizes>
template <Order order>
void Engine<Space, Rule, Sizes>::predict_in_window(std::uint32_t i) {
  const Motion motion = motion_at(disks_[i], now_);
  const double exit = shell_exit_of(i, motion);
  settle();
  if constexpr (order == Order::of_the_rest) {
    pending_[0].is(i, next_event<true>(i, exit), exit);
  } else {
    Disk me = disks_[i];
    put_pair(&me.x, motion.place);
    me.own_time = now_;
    pending_[0].is(i, next_contact_of<false>(i, me), exit);
  }
}

// The next contact of disk i, whose struct is `me`, with another disk. If others may be ahead, their earlier flights
// from now on are examined before their present ones.
template <class Space, class Rule, class Sizes>
template <bool others_ahead>
[[gnu::noinline]] auto Engine<Space, Rule, Sizes>::next_contact_of(std::uint32_t i, const Disk& me) const -> Candidate {
  Candidate best{never, nobody};
  const auto consider = [&](const Candidate& other) {
    if (other.time < best.time) best = other;
  };
  const auto look = [&](const NeighbourBlock& block) {
    consider(is_near_edge(i, i) ? earliest_in<true, others_ahead>(block, me, sizes_.radius(i))
                                : earliest_in<false, others_ahead>(block, me, sizes_.radius(i)));
    if constexpr (others_ahead) {
      for (const std::uint32_t k : block.disk) {
        if (disks_[k].own_time > now_) [[unlikely]]
          consider(contact_with_past(i, k));
      }
    }
  };
  look(lists_.first_block(i));
  if (me.neighbours > inline_neighbours) [[unlikely]]
    lists_.further_blocks(i, look);
  best.time = std::max(best.time, now_);
  return best;
}

// The first contact of i, as it flies now, with what k did from now on before its present flight.
template <class Space, class Rule, class Sizes>
[[gnu::noinline]] auto Engine<Space, Rule, Sizes>::contact_with_past(std::uint32_t i, std::uint32_t k) const
    -> Candidate {
  const Motion me = motion_at(disks_[i], now_);
  const double distance = sizes_.contact_distance(i, k);
  Candidate best{never, nobody};
  ContactLog::Flight other = log_.flight_of(k, disks_[k]);
  while (other.began > now_ && log_.is_in_window(other.with)) {
    const double ended = other.began;
    log_.step_back(other, k, sizes_.mass(k));
    const double from = std::max(now_, other.began);
    TwoLanes d =
        fused(other.velocity, both(from - other.began), other.place) - fused(me.velocity, both(from - now_), me.place);
    d += Period::to_nearest(period_x_, period_z_, d);
    const TwoLanes dv = other.velocity - me.velocity;
    const double time = from + time_to_disk(d[0], d[1], dv[0], dv[1], distance * distance);
    if (time < ended && time < disks_[k].event_time) best = {time, static_cast<std::int32_t>(k)};
  }
  return best;
}

// Has the disk been so near in this window that the smallest shell round it now holds where it was?
template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::kept_near(std::uint32_t i) const {
  const TwoLanes here = motion_at(disks_[i], now_).place;
  const double most = smallest_skin_ - 2 * skin_unit;
  ContactLog::Flight flight = log_.flight_of(i, disks_[i]);
  const auto near = [&](TwoLanes place) {
    TwoLanes d = place - here;
    d += Period::to_nearest(period_x_, period_z_, d);
    return d[0] * d[0] + d[1] * d[1] < most * most;
  };
  while (log_.is_in_window(flight.with)) {
    if (!near(flight.place)) return false;
    log_.step_back(flight, i, sizes_.mass(i));
  }
  return near(fused(flight.velocity, both(log_.start() - flight.began), flight.place));
}

// Brings disks i and j, and whoever has met what they did later, back to now: their later contacts have not been. All
// but i and j look anew.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::go_back(std::uint32_t i, std::uint32_t j) {
  if (!(disks_[i].own_time > now_) && !(disks_[j].own_time > now_)) [[likely]]
    return;
  settle();
  taken_back_.clear();
  take_back(i);
  take_back(j);
  disks_[i].event_time = disks_[j].event_time = now_;  // nobody can claim them
  std::sort(taken_back_.begin(), taken_back_.end());
  taken_back_.erase(std::unique(taken_back_.begin(), taken_back_.end()), taken_back_.end());
  for (const std::uint32_t k : taken_back_) {
    if (k == i || k == j) continue;
    const Disk& disk = disks_[k];
    const double exit = shell_exit_of(k, motion_at(disk, now_));
    Candidate next = next_event<true>(k, exit);
    if (disk.partner >= 0 && next.time >= disk.event_time) next = {disk.event_time, disk.partner};
    commit(k, next, exit);
  }
}
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::take_back(std::uint32_t i) {
  std::size_t seen = taken_back_.size();
  for (std::uint32_t k = i;; k = taken_back_[seen++]) {
    while (disks_[k].own_time > now_) take_back_last(k);
    if (seen == taken_back_.size()) return;
  }
}
// Takes back the last contact of disk i, after those that its partner has had since.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::take_back_last(std::uint32_t i) {
  const std::uint32_t number = log_.last_of(i);
  if (!log_.is_in_window(number)) throw std::logic_error("a disk is ahead without a contact");
  const ContactLog::Contact contact = log_[number];
  for (const std::uint32_t k : contact.disk) {
    while (log_.last_of(k) != number) take_back_last(k);
  }
  --counters_.disk_collisions;
  TwoLanes d = pair_at(&disks_[contact.disk[1]].x) - pair_at(&disks_[contact.disk[0]].x);
  d += Period::to_nearest(period_x_, period_z_, d);
  counters_.virial += contact.momentum[0] * d[0] + contact.momentum[1] * d[1];
  for (const std::uint32_t k : contact.disk) {
    Disk& disk = disks_[k];
    ContactLog::Flight flight = log_.flight_of(k, disk);
    log_.step_back(flight, k, sizes_.mass(k));
    put_pair(&disk.x, flight.place);
    put_pair(&disk.vx, flight.velocity);
    disk.own_time = flight.began;
    log_.set_last(k, flight.with);
    disk.event_time = never;
    disk.partner = nobody;
    taken_back_.push_back(k);
  }
}

}  // namespace shakebed::sim
