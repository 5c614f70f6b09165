// Which disk has the next event: a ring of coarse time buckets that hold bare pairs of disk numbers.
//
// An entry carries no time. The truth about a disk's next event stands in its own record (Disk::event_time); an entry
// whose disks' events have moved elsewhere is simply worthless when its bucket comes up, so nothing is ever deleted.
// A bucket is sorted when it becomes the current one. The order is exact: by time, then by the order of insertion.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "sim/disk.hpp"
#include "sim/lanes.hpp"
#include "sim/large_vector.hpp"

namespace shakebed::sim {

class EventQueue {
 public:
  // Forgets everything. disks: the records that the entries refer to; events_a_time: the expected rate of events.
  void reset(const Disk* disks, std::size_t count, double start, double events_a_time) {
    disks_ = disks;
    const double events_a_bucket = 7;
    buckets_a_time_ = std::clamp(events_a_time / events_a_bucket, 1e-6, 1e12);
    const auto wanted = static_cast<std::size_t>(std::clamp(static_cast<double>(count) / events_a_bucket, 256.0, 1e8));
    const std::size_t size = std::bit_ceil(wanted);
    heads_.assign(size, 0);
    held_.assign(size, 0);
    slots_.resize(size * pairs_a_bucket);
    mask_ = size - 1;
    chunks_.resize(1);
    free_chunk_ = 0;
    current_ = bucket_of(start) - 1;
    next_ = end_ = 0;
    grow(256);
  }

  // The event of disk a (with b; a itself when alone) now stands at `time`, which both records say already.
  void push(double time, std::uint32_t a, std::uint32_t b) {
    const std::int64_t bucket = bucket_of(time);
    if (bucket <= current_) [[unlikely]] {
      insert_into_run(time, a, b);
      return;
    }
    put(static_cast<std::size_t>(bucket) & mask_, a, b);
  }

  // The earliest valid event at or before `until`: its disk, and its time in disks[disk].event_time. False if none.
  // will_need(disk) is called some time before a disk comes up, to fetch its record into the cache.
  template <class WillNeed>
  bool pop(double until, std::uint32_t& disk, WillNeed will_need) {
    for (;;) {
      if (next_ == end_) [[unlikely]] {
        if (!load_next_bucket(until)) return false;
        const std::size_t after = static_cast<std::size_t>(current_ + 1) & mask_;
        const std::uint64_t* later = &slots_[(static_cast<std::size_t>(current_ + 2) & mask_) * pairs_a_bucket];
        for (std::uint32_t k = 0; k < pairs_a_bucket; k += 8) __builtin_prefetch(later + k);
        for (std::uint32_t k = 0; k < held_[after]; ++k) {
          const std::uint64_t pair = slots_[after * pairs_a_bucket + k];
          will_need(static_cast<std::uint32_t>(pair));
          will_need(static_cast<std::uint32_t>(pair >> 32));
        }
      }
      const double time = times_[next_];
      const std::uint64_t pair = pairs_[next_];
      if (time > until) [[unlikely]]
        return false;
      ++next_;
      // The partner counts too: a disk may have found another one at the very same time, and its former partner must
      // still have its turn.
      const auto first = static_cast<std::uint32_t>(pair), second = static_cast<std::uint32_t>(pair >> 32);
      disk = first;
      if (stands(first, second, time)) [[likely]]
        return true;
      disk = second;
      if (stands(second, first, time)) return true;
    }
  }

  bool at_bucket_start() const { return next_ <= 1; }  // its first event was just popped
  // The pair of disks that comes up `ahead` events from now, if it is already in order.
  bool upcoming(std::size_t ahead, std::uint32_t& a, std::uint32_t& b) const {
    if (next_ + ahead >= end_) return false;
    a = static_cast<std::uint32_t>(pairs_[next_ + ahead]);
    b = static_cast<std::uint32_t>(pairs_[next_ + ahead] >> 32);
    return true;
  }

  std::size_t bytes() const {
    return (heads_.capacity() + held_.capacity()) * sizeof(std::uint32_t) + slots_.capacity() * sizeof(std::uint64_t) +
           chunks_.capacity() * sizeof(Chunk) +
           2 * (times_.capacity() * sizeof(double) + pairs_.capacity() * sizeof(std::uint64_t));
  }

 private:
  static constexpr std::uint32_t pairs_a_bucket = 32, pairs_a_chunk = 15;
  struct alignas(128) Chunk {
    std::uint32_t next = 0;
    std::array<std::uint64_t, pairs_a_chunk> pairs{};
  };

  // Is a's next event still that with b (alone: a == b) at this time?
  bool stands(std::uint32_t a, std::uint32_t b, double time) const {
    const Disk& disk = disks_[a];
    return disk.event_time == time && (disk.partner == static_cast<std::int32_t>(b) || a == b);
  }

  std::int64_t bucket_of(double time) const {
    const double bucket = time * buckets_a_time_;
    return bucket < 4e18 ? static_cast<std::int64_t>(bucket) : std::int64_t{4'000'000'000'000'000'000};
  }
  static std::uint64_t pair_of(std::uint32_t a, std::uint32_t b) { return static_cast<std::uint64_t>(b) << 32 | a; }

  // A bucket's first pairs stand in its own slots, the rest in a list of chunks.
  void put(std::size_t bucket, std::uint32_t a, std::uint32_t b) {
    const std::uint32_t held = held_[bucket];
    if (held == pairs_a_bucket) [[unlikely]] {
      put_in_chunk(bucket, pair_of(a, b));
      return;
    }
    slots_[bucket * pairs_a_bucket + held] = pair_of(a, b);
    held_[bucket] = held + 1;
  }

  // A head holds the number of its first chunk times 16 plus how many pairs that one holds; 0: empty. The chunks that
  // follow are full.
  [[gnu::noinline]] void put_in_chunk(std::size_t bucket, std::uint64_t pair) {
    std::uint32_t& head = heads_[bucket];
    std::uint32_t chunk = head >> 4, used = head & 15;
    if (chunk == 0 || used == pairs_a_chunk) {
      std::uint32_t fresh = free_chunk_;
      if (fresh != 0) {
        free_chunk_ = chunks_[fresh].next;
      } else {
        fresh = static_cast<std::uint32_t>(chunks_.size());
        chunks_.emplace_back();
      }
      chunks_[fresh].next = chunk;
      chunk = fresh;
      used = 0;
    }
    chunks_[chunk].pairs[used] = pair;
    head = chunk << 4 | (used + 1);
  }

  void grow(std::size_t size) {
    if (times_.size() >= size) return;
    size = std::bit_ceil(size);
    times_.resize(size);
    pairs_.resize(size);
    unsorted_times_.resize(size);
    unsorted_pairs_.resize(size);
  }

  void insert_into_run(double time, std::uint32_t a, std::uint32_t b) {
    grow(end_ + 1);
    std::size_t place = end_++;
    while (place > next_ && times_[place - 1] > time) {
      times_[place] = times_[place - 1];
      pairs_[place] = pairs_[place - 1];
      --place;
    }
    times_[place] = time;
    pairs_[place] = pair_of(a, b);
  }

  // Makes the next bucket that holds a valid event the current one. False when every bucket up to `until` is empty.
  [[gnu::noinline]] bool load_next_bucket(double until) {
    const std::int64_t last = bucket_of(until);
    next_ = end_ = 0;
    while (end_ == 0) {
      if (current_ >= last) return false;
      ++current_;
      const std::size_t bucket = static_cast<std::size_t>(current_) & mask_;
      if (held_[bucket] != 0) sort_run(collect(bucket));
    }
    return true;
  }

  // Empties a bucket: events due now are collected unsorted, and counted; those a whole turn of the ring or more away
  // go back.
  std::size_t collect(std::size_t bucket) {
    std::size_t count = 0;
    again_.clear();
    grow(2 * pairs_a_bucket);
    const std::uint32_t held = held_[bucket];
    for (std::uint32_t k = 0; k < held; ++k) count = consider(slots_[bucket * pairs_a_bucket + k], count);
    held_[bucket] = 0;
    std::uint32_t chunk = heads_[bucket] >> 4, used = heads_[bucket] & 15;
    heads_[bucket] = 0;
    while (chunk != 0) {
      grow(count + 2 * pairs_a_chunk);
      for (std::uint32_t k = 0; k < used; ++k) count = consider(chunks_[chunk].pairs[k], count);
      const std::uint32_t following = chunks_[chunk].next;
      chunks_[chunk].next = free_chunk_;
      free_chunk_ = chunk;
      chunk = following;
      used = pairs_a_chunk;
    }
    for (std::uint64_t pair : again_)
      put(bucket, static_cast<std::uint32_t>(pair), static_cast<std::uint32_t>(pair >> 32));
    return count;
  }

  // Takes up the events that a pair stands for: that of each disk whose next event is still with the other one. (With
  // itself: an event alone.)
  std::size_t consider(std::uint64_t pair, std::size_t count) {
    const auto a = static_cast<std::uint32_t>(pair), b = static_cast<std::uint32_t>(pair >> 32);
    const Disk &first = disks_[a], &second = disks_[b];
    const bool first_stands = first.partner == static_cast<std::int32_t>(b) || (a == b && first.partner < 0);
    const bool second_stands =
        second.partner == static_cast<std::int32_t>(a) && !(first_stands && second.event_time == first.event_time);
    if (first_stands) count = take_up(first.event_time, pair, count);
    if (second_stands) count = take_up(second.event_time, pair_of(b, a), count);
    return count;
  }
  std::size_t take_up(double time, std::uint64_t pair, std::size_t count) {
    const std::int64_t bucket = bucket_of(time);
    unsorted_times_[count] = time;
    unsorted_pairs_[count] = pair;
    if (bucket > current_ && ((bucket ^ current_) & static_cast<std::int64_t>(mask_)) == 0) [[unlikely]]
      again_.push_back(pair);
    return count + (bucket == current_);
  }

  // Sorts what collect() found into the run. Small ones by rank: an entry's place is the number of entries before it,
  // counted without a branch. Equal times keep their order.
  void sort_run(std::size_t count) {
    end_ = count;
    if (count <= largest_ranked) {
      std::array<std::int64_t, largest_ranked> ranks;
      for (std::size_t i = count; i % 4 != 0; ++i) unsorted_times_[i] = never;
      for (std::size_t i = 0; i < count; i += 4) {
        Lanes mine;
        std::memcpy(&mine, &unsorted_times_[i], sizeof mine);
        LaneMask before{};
        for (std::size_t j = 0; j < count; ++j) before -= all_lanes(unsorted_times_[j]) < mine;
        std::memcpy(&ranks[i], &before, sizeof before);
      }
      for (std::size_t i = 0; i < count; ++i) times_[i] = -1;
      for (std::size_t i = 0; i < count; ++i) {
        const auto rank = static_cast<std::size_t>(ranks[i]);
        times_[rank] = unsorted_times_[i];
        pairs_[rank] = unsorted_pairs_[i];
      }
      bool tied = false;  // two of one rank leave a place empty
      for (std::size_t i = 0; i < count; ++i) tied |= times_[i] < 0;
      if (!tied) return;
    }
    order_.resize(count);
    for (std::uint32_t i = 0; i < count; ++i) order_[i] = i;
    std::stable_sort(order_.begin(), order_.end(),
                     [&](std::uint32_t l, std::uint32_t r) { return unsorted_times_[l] < unsorted_times_[r]; });
    for (std::size_t i = 0; i < count; ++i) {
      times_[i] = unsorted_times_[order_[i]];
      pairs_[i] = unsorted_pairs_[order_[i]];
    }
  }

  static constexpr std::size_t largest_ranked = 64;
  const Disk* disks_ = nullptr;
  double buckets_a_time_ = 1;
  LargeVector<std::uint32_t> held_;   // pairs in a bucket's slots
  LargeVector<std::uint64_t> slots_;  // pairs_a_bucket a bucket
  std::vector<std::uint32_t> heads_;  // of its chunks
  std::size_t mask_ = 0;
  std::vector<Chunk> chunks_;
  std::uint32_t free_chunk_ = 0;
  std::int64_t current_ = -1;
  // The current bucket's events from next_ to end_, in order; the second id in a pair's upper half.
  std::vector<double> times_, unsorted_times_;
  std::vector<std::uint64_t> pairs_, unsorted_pairs_, again_;
  std::vector<std::uint32_t> order_;
  std::size_t next_ = 0, end_ = 0;
};

}  // namespace shakebed::sim
