// Which disk has the next event: a ring of coarse time buckets.
//
// An entry holds an event's time and its pair of disks. The valid event of a disk is the one in its own struct
// (Disk::event_time). An entry whose time is no longer the event time of either disk is ignored, so nothing is ever
// deleted. A bucket is sorted when it becomes the current one. The order is exact: by time, then by the order of
// insertion. Events of a later turn of the ring are not written down. The disks' structs hold them, and are searched
// when that turn begins.
//
// Where the ring would be far larger than the caches, it holds at most two stretches of the turn. Later events are kept
// in one list per stretch. They go into the ring's buckets shortly before their stretch begins.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "sim/engine/disk.hpp"
#include "sim/engine/event_stretches.hpp"
#include "sim/engine/fetch.hpp"
#include "sim/engine/lanes.hpp"
#include "sim/engine/large_vector.hpp"

namespace shakebed::sim {

inline constexpr std::size_t fits_cache = 8'000;       // that many disks and their lists stay in a second-level cache
inline constexpr std::size_t fits_one_ring = 200'000;  // up to that many disks one ring for the whole turn is quicker

class EventQueue {
 public:
  static constexpr std::size_t looks_ahead = 8;  // that many events are known in their order

  EventQueue() = default;
  EventQueue(const EventQueue&) = delete;  // it points into itself
  EventQueue& operator=(const EventQueue&) = delete;

  // Forgets everything. disks: the records that the entries refer to;
  // events_a_time: the expected rate of events.
  void reset(const Disk* disks, std::size_t count, double start, double events_a_time) {
    disks_ = disks;
    count_ = static_cast<std::uint32_t>(count);
    beyond_cache_ = count > fits_cache;
    in_stretches_ = count > fits_one_ring;
    in_window_ = false;
    events_a_bucket_ = in_stretches_ ? 6 : 8;
    const double turn = in_stretches_ ? 2 : 1.2;  // the mean time between two events of a disk, times this
    size_ = static_cast<std::int64_t>(std::max(turn * static_cast<double>(count) / events_a_bucket_, 64.0));
    // Behind the ring's last bucket stand two more, which stay empty: of the next turn nothing is written down.
    auto places = static_cast<std::size_t>(size_ + 2);
    places_mask_ = ~std::size_t{0};
    if (in_stretches_) {
      stretch_shift_ = static_cast<int>(std::bit_width(static_cast<std::uint64_t>(std::sqrt(size_)))) + 1;
      size_ = ((size_ >> stretch_shift_) + 1) << stretch_shift_;
      places = 2 * static_cast<std::size_t>(stretch_length());
      places_mask_ = places - 1;
    }
    ring_.resize(places);
    held_.resize(places);
    further_.resize(places);
    grow(128);
    clear(start, events_a_time / events_a_bucket_);
  }

  // Forgets everything; from now on only what comes before `end` is written down, about so many events. The rest is
  // left in the records; so is all if the window has no length.
  void begin_window(const Disk* disks, std::size_t count, double start, double end, double events) {
    disks_ = disks;
    count_ = static_cast<std::uint32_t>(count);
    beyond_cache_ = in_window_ = true;
    in_stretches_ = false;
    const double length = end - start;
    buckets_a_time_ = length > 0 ? std::clamp(std::max(events / 8, 16.0) / length, coarsest, finest) : 1;
    // Some buckets more, since pop() looks ahead.
    size_ = length > 0 ? static_cast<std::int64_t>(length * buckets_a_time_) + std::int64_t{2 * looks_ahead + 2} : 0;
    places_mask_ = ~std::size_t{0};
    const auto places = static_cast<std::size_t>(size_ + 2);
    if (ring_.size() < places) {
      ring_.resize(places + places / 8);
      held_.resize(ring_.size());
      further_.resize(ring_.size());
    }
    grow(128);
    empty(places, start);
  }

  // The event of disk a (with b; a itself when alone) now stands at `time`,
  // which both records say already.
  void push(double time, std::uint32_t a, std::uint32_t b) {
    assert(a < count_ && b < count_ && time < never);
    const double place = time * buckets_a_time_;
    if (place < run_ends_) [[unlikely]] {
      insert_into_run({time, pair_of(a, b)});
      return;
    }
    if (place >= ring_ends_) [[unlikely]] {
      put_into_stretch({time, pair_of(a, b)}, place);
      return;
    }
    // A later turn's is left to that turn. Without a branch, which would often be mistaken: it is written where nothing
    // is yet, and not counted.
    const auto bucket = static_cast<std::int64_t>(std::min(place, turn_ends_));
    const bool counted = place < turn_ends_;
    const std::size_t index = index_of(bucket);
    const std::uint32_t held = held_[index];
    if (held == entries_a_bucket) [[unlikely]] {
      if (counted) put_further(further_[index], {time, pair_of(a, b)});
      return;
    }
    held_[index] = static_cast<std::uint8_t>(held + counted);
    Entry* place_of = &ring_[index].entries[held];
    if (!pushes_wait()) {
      place_of->time = time;
      place_of->pair = pair_of(a, b);
      return;
    }
    // The place is far from the cache: it is sent for, and written to some pushes later.
    if (!counted) place_of = &nowhere_;
    fetch(place_of);
    Waiting& waiting = waiting_[pushed_++ % most_waiting];
    *waiting.place = waiting.entry;
    waiting.place = place_of;
    waiting.entry.time = time;
    waiting.entry.pair = pair_of(a, b);
  }
  void push(const EventEntry& entry) { push(entry.time, entry.first(), entry.second()); }

  // The earliest valid event at or before `until`. Results: its disk, the disk with which it was pushed (itself when
  // alone), and its time in disks[disk].event_time. False if there is none. The owner may keep known events unwritten
  // as long as owner.waits_for(time, disk, with) is false for the next event. Else it must settle() them first.
  template <class Owner>
  bool pop(double until, std::uint32_t& disk, std::uint32_t& with, Owner& owner) {
    for (;;) {
      if (next_ + looks_ahead >= end_) [[unlikely]] {
        owner.settle();
        if (!lengthen_run(until)) return false;
        if (beyond_cache_) {
          const std::size_t later = index_of(current_ + 2);
          for (std::size_t k = 0; k < held_[later]; k += 4) fetch(&ring_[later].entries[k]);
          coming_ = index_of(current_ + 1);
          sent_for_ = 0;
        }
      }
      // Two of the next bucket at a time: sent for all at once they would wait for each other.
      if (beyond_cache_) {
        for (int k = 0; k < 2 && sent_for_ < held_[coming_]; ++k, ++sent_for_) {
          const Entry& entry = ring_[coming_].entries[sent_for_];
          fetch(&disks_[entry.first()]);
          fetch(&disks_[entry.second()]);
        }
      }
      const double time = times_[next_];
      const std::uint64_t pair = pairs_[next_];
      const auto first = static_cast<std::uint32_t>(pair), second = static_cast<std::uint32_t>(pair >> 32);
      if (owner.waits_for(time, first, second)) [[unlikely]] {
        owner.settle();
        continue;
      }
      if (time > until) [[unlikely]]
        return false;
      assert(next_ + 1 == end_ || time <= times_[next_ + 1]);  // the run is in order
      ++next_;
      now_ = time;
      // The partner counts too: a disk may have found another one at the very
      // same time, and its former partner must still have its turn.
      disk = first;
      with = second;
      if (stands(first, second, time)) [[likely]]
        return true;
      disk = second;
      with = first;
      if (stands(second, first, time)) return true;
    }
  }

  // The pair of disks that comes up `ahead` events from now, looks_ahead at most; false if there is none.
  bool upcoming(std::size_t ahead, std::uint32_t& a, std::uint32_t& b) const {
    if (next_ + ahead > end_) return false;
    a = static_cast<std::uint32_t>(pairs_[next_ + ahead - 1]);
    b = static_cast<std::uint32_t>(pairs_[next_ + ahead - 1] >> 32);
    return true;
  }

  std::size_t bytes() const {
    return ring_.capacity() * (sizeof(Bucket) + 5) + blocks_.capacity() * sizeof(Further) + stretches_.bytes() +
           2 * (times_.capacity() * sizeof(double) + pairs_.capacity() * sizeof(std::uint64_t));
  }

 private:
  // Entries of a bucket when it is taken up, by the events it is to hold; some will be dead by their turn.
  static constexpr double usual_fullness = 1.375;
  static constexpr std::uint32_t entries_a_bucket = 16;

  using Entry = EventEntry;
  struct alignas(64) Bucket {
    std::array<Entry, entries_a_bucket> entries;
  };
  // Entries of a bucket beyond those it has room for, the latest ones first.
  struct Further {
    std::uint32_t held, next;  // entries here; where in blocks_ the earlier ones are, 0 for nowhere
    std::array<Entry, 7> entries;
  };

  // Where in the ring one of this turn's buckets is.
  std::size_t index_of(std::int64_t bucket) const {
    return static_cast<std::size_t>(bucket - this_turn_) & places_mask_;
  }
  std::int64_t stretch_length() const { return std::int64_t{1} << stretch_shift_; }
  // Which of this turn's stretches it belongs to.
  std::size_t stretch_of(std::int64_t bucket) const {
    return static_cast<std::size_t>(bucket - this_turn_) >> stretch_shift_;
  }

  // Is a's next event still that with b (alone: a == b) at this time?
  bool stands(std::uint32_t a, std::uint32_t b, double time) const {
    const Disk& disk = disks_[a];
    return disk.event_time == time && (disk.partner == static_cast<std::int32_t>(b) || a == b);
  }
  // Does any of the two disks have an event at the entry's time? (With whom is
  // asked when it comes up.)
  unsigned counts(const Entry& entry) const {
    const Disk &first = disks_[entry.first()], &second = disks_[entry.second()];
    return static_cast<unsigned>(first.event_time == entry.time) |
           static_cast<unsigned>(second.event_time == entry.time);
  }

  [[gnu::noinline]] void put_further(std::uint32_t& first, Entry entry) {
    if (first == 0 || blocks_[first].held == blocks_[first].entries.size()) {
      std::uint32_t place = free_;
      if (place != 0) {
        free_ = blocks_[place].next;
      } else {
        place = static_cast<std::uint32_t>(blocks_.size());
        blocks_.emplace_back();
      }
      blocks_[place].held = 0;
      blocks_[place].next = first;
      first = place;
    }
    Further& block = blocks_[first];
    block.entries[block.held++] = entry;
  }
  bool pushes_wait() const { return beyond_cache_ && !in_stretches_ && !in_window_; }
  void put_waiting() {
    for (std::size_t k = 0; k < most_waiting; ++k) {  // the oldest first
      Waiting& waiting = waiting_[pushed_++ % most_waiting];
      *waiting.place = waiting.entry;
      waiting.place = &nowhere_;
    }
  }

  void grow(std::size_t size) {
    if (times_.size() >= size) return;
    size = std::bit_ceil(size);
    times_.resize(size);
    pairs_.resize(size);
    unsorted_times_.resize(size);
    unsorted_pairs_.resize(size);
  }

  // Empties the queue and chooses the width of its buckets.
  void clear(double start, double buckets_a_time) {
    buckets_a_time_ = std::clamp(buckets_a_time, coarsest, finest);
    if (in_stretches_) stretches_.reset(static_cast<std::size_t>(size_ >> stretch_shift_));
    empty(ring_.size(), start);
  }
  // Empties the ring's first places and begins its turn at `start`.
  void empty(std::size_t places, double start) {
    now_ = start;
    std::fill_n(held_.begin(), places, std::uint8_t{0});
    std::fill_n(further_.begin(), places, 0u);
    blocks_.resize(1);
    free_ = 0;
    for (Waiting& waiting : waiting_) waiting.place = &nowhere_;
    set_current(static_cast<std::int64_t>(start * buckets_a_time_) - 1);
    set_turn();
    coming_ = sent_for_ = 0;
    next_ = end_ = 0;
    taken_up_ = moved_ = 0;
  }

  // Where buckets have become too wide or too narrow, everything is queued anew from the disks' records.
  [[gnu::noinline]] void rebuild(double buckets_a_time) {
    clear(now_, buckets_a_time);
    push_this_turn(-never);
  }

  // Queues every event of the turn from place `first` on, from the disks' records: a pair's common event once.
  void push_this_turn(double first) {
    std::array<Entry, 64> batch;
    std::size_t found = 0;
    // Records one behind the other are sent for, too: the processor does not foresee them well enough. Where there are
    // many more of them it costs more than it brings.
    const bool fetches = pushes_wait();
    for (std::uint32_t i = 0; i < count_; ++i) {
      if (fetches) fetch(&disks_[std::min(i + 32, count_)]);
      const double time = disks_[i].event_time, place = time * buckets_a_time_;
      const auto me = static_cast<std::int32_t>(i), other = choose(disks_[i].partner < 0, me, disks_[i].partner);
      const Disk& partner = disks_[static_cast<std::uint32_t>(other)];
      const bool pushed_by_other = (other < me) & (partner.event_time == time) & (partner.partner == me);
      batch[found] = {time, pair_of(i, static_cast<std::uint32_t>(other))};
      found += (place >= first) & (place < turn_ends_) & !pushed_by_other;
      if (found == batch.size() || i + 1 == count_) {
        for (std::size_t k = 0; k < found; ++k) push(batch[k]);
        found = 0;
      }
    }
    put_waiting();
  }

  void set_current(std::int64_t bucket) {
    current_ = bucket;
    run_ends_ = static_cast<double>(bucket + 1);
  }
  // The turn that begins with the current bucket: as long as the ring.
  void set_turn() {
    this_turn_ = current_;
    turn_ends_ = static_cast<double>(this_turn_ + size_);
    ring_ends_ = in_stretches_ ? static_cast<double>(this_turn_ + stretch_length()) : never;
  }
  // An event beyond what the ring holds. Apart from push(), which would become slower by it.
  [[gnu::noinline]] void put_into_stretch(Entry entry, double place) {
    if (place < turn_ends_) stretches_.append(stretch_of(static_cast<std::int64_t>(place)), entry);
  }
  // Puts the next stretch's events into the ring.
  [[gnu::noinline]] void take_up_stretch() {
    const std::size_t stretch = stretch_of(static_cast<std::int64_t>(ring_ends_));
    ring_ends_ += static_cast<double>(stretch_length());
    stretches_.take(stretch, [this](const Entry& entry) { push(entry); });
  }

  [[gnu::noinline]] void insert_into_run(Entry entry) {
    grow(end_ + 1);
    ++taken_up_;
    std::size_t place = end_++;
    while (place > next_ && times_[place - 1] > entry.time) {
      times_[place] = times_[place - 1];
      pairs_[place] = pairs_[place - 1];
      --place;
    }
    times_[place] = entry.time;
    pairs_[place] = entry.pair;
    moved_ += end_ - place;
    if (moved_ > 8192 + 32 * std::size_t{count_} && buckets_a_time_ < finest && !in_window_)
        [[unlikely]] {  // what rebuilding costs
      rebuild(8 * buckets_a_time_);
    }
  }

  // Takes the next bucket into the run; where the run was empty, the next one
  // that holds a valid event. False when every bucket up to `until` is empty.
  [[gnu::noinline]] bool lengthen_run(double until) {
    if (pushes_wait()) put_waiting();
    std::size_t left = end_ - next_;
    for (std::size_t k = 0; k < left; ++k) {
      times_[k] = times_[next_ + k];
      pairs_[k] = pairs_[next_ + k];
    }
    next_ = 0;
    end_ = left;
    do {
      if (left == 0 && static_cast<double>(current_ + 1) > until * buckets_a_time_) return false;
      set_current(current_ + 1);
      if (current_ == this_turn_ + size_) [[unlikely]] {
        const double fullness =
            static_cast<double>(taken_up_) / (usual_fullness * events_a_bucket_ * static_cast<double>(size_));
        const bool fits = fullness > 0.6 && fullness < 1.6;
        const double other = buckets_a_time_ * std::clamp(fullness, 0.125, 8.0);
        if (!fits && other > coarsest && other < finest) {
          rebuild(other);
          left = 0;
          continue;
        }
        begin_turn();
      }
      // Two buckets ahead are looked at already.
      if (run_ends_ + 1 >= ring_ends_ && ring_ends_ < turn_ends_) take_up_stretch();
      const std::size_t here = index_of(current_);
      if (held_[here] != 0) sort_into_run(collect(here));
    } while (end_ == 0);
    return true;
  }

  [[gnu::noinline]] void begin_turn() {
    taken_up_ = moved_ = 0;
    set_turn();
    // What comes before the current bucket is in the run already.
    run_ends_ = static_cast<double>(current_);
    push_this_turn(run_ends_);
    set_current(current_);
  }

  // Empties a bucket: what still counts is collected unsorted, in the order in which it came, and counted.
  std::size_t collect(std::size_t index) {
    std::size_t count = take_up(ring_[index].entries.data(), held_[index], 0);
    held_[index] = 0;
    if (further_[index] != 0) [[unlikely]] {
      count = collect_further(further_[index], count);
      further_[index] = 0;
    }
    taken_up_ += count;
    return count;
  }
  [[gnu::noinline]] std::size_t collect_further(std::uint32_t place, std::size_t count) {
    Further& block = blocks_[place];
    if (block.next != 0) count = collect_further(block.next, count);
    grow(count + std::size_t{4} * entries_a_bucket);
    count = take_up(block.entries.data(), block.held, count);
    block.next = free_;
    free_ = place;
    return count;
  }
  std::size_t take_up(const Entry* entries, std::uint32_t held, std::size_t count) {
    for (std::uint32_t k = 0; k < held; ++k) {
      const Entry entry = entries[k];
      unsorted_times_[count] = entry.time;
      unsorted_pairs_[count] = entry.pair;
      count += counts(entry);
    }
    return count;
  }

  // Sorts what collect() found and puts it behind the run. A bucket of the usual size by rank: an entry's place is the
  // number of entries before it, counted without a branch. Equal times keep their order.
  void sort_into_run(std::size_t count) {
    grow(end_ + std::max(count, entries_ranked));
    double* const times = times_.data() + end_;
    std::uint64_t* const pairs = pairs_.data() + end_;
    end_ += count;
    if (count <= entries_ranked) [[likely]] {
      alignas(32) std::array<std::int64_t, entries_ranked> ranks;
      const std::size_t ranked = count <= 8 ? 8 : count <= 16 ? 16 : count <= 24 ? 24 : entries_ranked;
      std::fill_n(&unsorted_times_[count], ranked - count, never);
      if (ranked == 8) {
        rank_times<8>(unsorted_times_.data(), ranks.data());
      } else if (ranked == 16) {
        rank_times<16>(unsorted_times_.data(), ranks.data());
      } else if (ranked == 24) {
        rank_times<24>(unsorted_times_.data(), ranks.data());
      } else {
        rank_times<entries_ranked>(unsorted_times_.data(), ranks.data());
      }
      for (std::size_t k = 0; k < ranked; ++k) {
        const auto rank = static_cast<std::size_t>(ranks[k]);
        times[rank] = unsorted_times_[k];
        pairs[rank] = unsorted_pairs_[k];
      }
      return;
    }
    order_.resize(count);
    for (std::uint32_t i = 0; i < count; ++i) order_[i] = i;
    std::stable_sort(order_.begin(), order_.end(),
                     [&](std::uint32_t l, std::uint32_t r) { return unsorted_times_[l] < unsorted_times_[r]; });
    for (std::size_t i = 0; i < count; ++i) {
      times[i] = unsorted_times_[order_[i]];
      pairs[i] = unsorted_pairs_[order_[i]];
    }
  }

  static constexpr std::size_t entries_ranked = 40, most_waiting = 8;
  static constexpr double coarsest = 1e-6, finest = 1e12;  // buckets a time unit
  struct Waiting {
    Entry* place;
    Entry entry;
  };
  const Disk* disks_ = nullptr;
  std::uint32_t count_ = 0;
  double buckets_a_time_ = 1;
  double now_ = 0;  // of the latest event that was popped
  LargeVector<Bucket> ring_;
  std::vector<std::uint8_t> held_;      // entries in each bucket of the ring
  std::vector<std::uint32_t> further_;  // where in blocks_ the rest of it is, 0 for nowhere
  std::vector<Further> blocks_;         // the first is not used
  std::uint32_t free_ = 0;
  std::int64_t size_ = 0;
  std::int64_t current_ = -1;             // the current bucket
  std::int64_t this_turn_ = 0;            // the bucket with which the ring's turn began
  double run_ends_ = 0, turn_ends_ = 0;   // the buckets behind the current one and the turn's last one
  std::size_t taken_up_ = 0, moved_ = 0;  // since the ring's turn began: events, and entries shifted in the run
  bool beyond_cache_ = false, in_stretches_ = false, in_window_ = false;
  double events_a_bucket_ = 8;
  std::size_t places_mask_ = 0;
  int stretch_shift_ = 0;     // a stretch is 2 to that power buckets
  double ring_ends_ = never;  // the bucket from which on this turn's events are in stretches_
  EventStretches stretches_;
  std::size_t coming_ = 0, sent_for_ = 0;      // the next bucket's place, and how many of its disks have been sent for
  std::array<Waiting, most_waiting> waiting_;  // the latest ones, one after another, from pushed_ on
  std::size_t pushed_ = 0;
  Entry nowhere_{};
  // The current bucket's events from next_ to end_, in order.
  std::vector<double> times_, unsorted_times_;
  std::vector<std::uint64_t> pairs_, unsorted_pairs_;
  std::vector<std::uint32_t> order_;
  std::size_t next_ = 0, end_ = 0;
};

}  // namespace shakebed::sim
