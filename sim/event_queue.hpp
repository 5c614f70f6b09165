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

namespace shakebed::sim {

class EventQueue {
 public:
  // Forgets everything. disks: the records that the entries refer to; events_a_time: the expected rate of events.
  void reset(const Disk* disks, std::size_t count, double start, double events_a_time) {
    disks_ = disks;
    const double events_a_bucket = count > 20'000 ? 24 : 16;
    buckets_a_time_ = std::clamp(events_a_time / events_a_bucket, 1e-6, 1e12);
    const auto wanted =
        static_cast<std::size_t>(std::clamp(static_cast<double>(count) / events_a_bucket * 1.5, 256.0, 1e8));
    const std::size_t size = std::bit_ceil(wanted);
    heads_.assign(size, 0);
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
  bool pop(double until, std::uint32_t& disk) {
    for (;;) {
      if (next_ == end_) [[unlikely]] {
        if (!load_next_bucket(until)) return false;
      }
      const double time = times_[next_];
      const std::uint64_t pair = pairs_[next_];
      if (time > until) [[unlikely]]
        return false;
      ++next_;
      disk = static_cast<std::uint32_t>(pair);
      if (disks_[disk].event_time == time) [[likely]]
        return true;
      disk = static_cast<std::uint32_t>(pair >> 32);
      if (disks_[disk].event_time == time) return true;
    }
  }

  std::size_t bytes() const {
    return heads_.capacity() * sizeof(std::uint32_t) + chunks_.capacity() * sizeof(Chunk) +
           2 * (times_.capacity() * sizeof(double) + pairs_.capacity() * sizeof(std::uint64_t));
  }

 private:
  static constexpr std::uint32_t pairs_a_chunk = 15;
  struct alignas(128) Chunk {
    std::uint32_t next = 0, unused = 0;
    std::array<std::uint32_t, 2 * pairs_a_chunk> ids{};
  };

  std::int64_t bucket_of(double time) const {
    const double bucket = time * buckets_a_time_;
    return bucket < 4e18 ? static_cast<std::int64_t>(bucket) : std::int64_t{4'000'000'000'000'000'000};
  }
  static std::uint64_t pair_of(std::uint32_t a, std::uint32_t b) { return static_cast<std::uint64_t>(b) << 32 | a; }

  // A head holds the number of its first chunk times 16 plus how many pairs that one holds; 0: empty. The chunks that
  // follow are full.
  void put(std::size_t bucket, std::uint32_t a, std::uint32_t b) {
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
    chunks_[chunk].ids[2 * used] = a;
    chunks_[chunk].ids[2 * used + 1] = b;
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
      std::uint32_t& slot = heads_[static_cast<std::size_t>(current_) & mask_];
      const std::uint32_t head = slot;
      if (head == 0) continue;
      slot = 0;
      sort_run(collect(head));
    }
    return true;
  }

  // Empties a bucket's chunks: events due now are collected unsorted, and counted; those a whole turn of the ring or
  // more away go back.
  std::size_t collect(std::uint32_t head) {
    std::uint32_t chunk = head >> 4, used = head & 15;
    std::size_t count = 0;
    again_.clear();
    while (chunk != 0) {
      grow(count + 2 * pairs_a_chunk);
      const Chunk& full = chunks_[chunk];
      for (std::uint32_t pair = 0; pair < used; ++pair) {
        const std::uint32_t a = full.ids[2 * pair], b = full.ids[2 * pair + 1];
        const double time_a = disks_[a].event_time, time_b = disks_[b].event_time;
        const std::int64_t bucket_a = bucket_of(time_a), bucket_b = bucket_of(time_b);
        unsorted_times_[count] = time_a;
        unsorted_pairs_[count] = pair_of(a, b);
        count += bucket_a == current_;
        unsorted_times_[count] = time_b;
        unsorted_pairs_[count] = pair_of(b, a);
        count += static_cast<std::size_t>(bucket_b == current_) & static_cast<std::size_t>(time_b != time_a);
        if (bucket_a > current_ || bucket_b > current_) {
          const auto mask = static_cast<std::int64_t>(mask_);
          const bool later_a = bucket_a > current_ && ((bucket_a ^ current_) & mask) == 0;
          const bool later_b = bucket_b > current_ && ((bucket_b ^ current_) & mask) == 0;
          if (later_a || later_b) again_.push_back(pair_of(a, b));
        }
      }
      const std::uint32_t following = full.next;
      chunks_[chunk].next = free_chunk_;
      free_chunk_ = chunk;
      chunk = following;
      used = pairs_a_chunk;
    }
    for (std::uint64_t pair : again_) {
      put(static_cast<std::size_t>(current_) & mask_, static_cast<std::uint32_t>(pair),
          static_cast<std::uint32_t>(pair >> 32));
    }
    return count;
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
  std::vector<std::uint32_t> heads_;
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
