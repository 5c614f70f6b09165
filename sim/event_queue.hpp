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

namespace shakebed::sim {

class EventQueue {
 public:
  // Forgets everything. disks: the records that the entries refer to; events_a_time: the expected rate of events.
  void reset(const Disk* disks, std::size_t count, double start, double events_a_time) {
    disks_ = disks;
    const double events_a_bucket = count > 20'000 ? 24 : 12;
    buckets_a_time_ = std::clamp(events_a_time / events_a_bucket, 1e-6, 1e12);
    const auto wanted =
        static_cast<std::size_t>(std::clamp(static_cast<double>(count) / events_a_bucket * 1.5, 256.0, 1e8));
    const std::size_t size = std::bit_ceil(wanted);
    heads_.assign(size, 0);
    mask_ = size - 1;
    chunks_.resize(1);
    free_chunk_ = 0;
    current_ = bucket_of(start) - 1;
    run_.clear();
    next_ = 0;
  }

  // The event of disk a (with b; a itself when alone) now stands at `time`, which both records say already.
  void push(double time, std::uint32_t a, std::uint32_t b) {
    const std::int64_t bucket = bucket_of(time);
    if (bucket <= current_) [[unlikely]] {
      insert_into_run({time, a, b});
      return;
    }
    put(static_cast<std::size_t>(bucket) & mask_, a, b);
  }

  // The earliest valid event at or before `until`: its disk, and its time in disks[disk].event_time. False if none.
  bool pop(double until, std::uint32_t& disk) {
    for (;;) {
      if (next_ == run_.size()) [[unlikely]] {
        if (!load_next_bucket(until)) return false;
      }
      const Entry& entry = run_[next_];
      if (entry.time > until) return false;
      ++next_;
      if (disks_[entry.a].event_time == entry.time) [[likely]] {
        disk = entry.a;
        return true;
      }
      if (disks_[entry.b].event_time == entry.time) {
        disk = entry.b;
        return true;
      }
    }
  }

  std::size_t bytes() const {
    return heads_.capacity() * sizeof(std::uint32_t) + chunks_.capacity() * sizeof(Chunk) +
           (run_.capacity() + unsorted_.capacity()) * sizeof(Entry);
  }

 private:
  struct Entry {
    double time;
    std::uint32_t a, b;
  };
  static constexpr std::uint32_t pairs_a_chunk = 15;
  struct alignas(128) Chunk {
    std::uint32_t next = 0, unused = 0;
    std::array<std::uint32_t, 2 * pairs_a_chunk> ids{};
  };

  std::int64_t bucket_of(double time) const {
    return static_cast<std::int64_t>(std::min(time * buckets_a_time_, 4e18));
  }

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

  void insert_into_run(const Entry& entry) {
    std::size_t place = run_.size();
    run_.push_back(entry);
    while (place > next_ && run_[place - 1].time > entry.time) {
      run_[place] = run_[place - 1];
      --place;
    }
    run_[place] = entry;
  }

  // Makes the next bucket that holds a valid event the current one. False when every bucket up to `until` is empty.
  bool load_next_bucket(double until) {
    const std::int64_t last = bucket_of(until);
    run_.clear();
    next_ = 0;
    while (run_.empty()) {
      if (current_ >= last) return false;
      ++current_;
      const std::size_t slot = static_cast<std::size_t>(current_) & mask_;
      const std::uint32_t head = heads_[slot];
      if (head == 0) continue;
      heads_[slot] = 0;
      collect(head);
      sort_run();
    }
    return true;
  }

  // Empties a bucket's chunks: events due now go to the run; those a whole turn of the ring or more away go back.
  void collect(std::uint32_t head) {
    std::uint32_t chunk = head >> 4, used = head & 15;
    unsorted_.clear();
    while (chunk != 0) {
      for (std::uint32_t pair = 0; pair < used; ++pair) {
        const std::uint32_t a = chunks_[chunk].ids[2 * pair], b = chunks_[chunk].ids[2 * pair + 1];
        const double time_a = disks_[a].event_time, time_b = disks_[b].event_time;
        const std::int64_t bucket_a = bucket_of(time_a), bucket_b = bucket_of(time_b);
        if (bucket_a == current_) run_.push_back({time_a, a, b});
        if (bucket_b == current_ && time_b != time_a) run_.push_back({time_b, b, a});
        const bool later_a = bucket_a > current_ && ((bucket_a ^ current_) & static_cast<std::int64_t>(mask_)) == 0;
        const bool later_b = bucket_b > current_ && ((bucket_b ^ current_) & static_cast<std::int64_t>(mask_)) == 0;
        if (later_a || later_b) [[unlikely]]
          unsorted_.push_back({0, a, b});
      }
      const std::uint32_t following = chunks_[chunk].next;
      chunks_[chunk].next = free_chunk_;
      free_chunk_ = chunk;
      chunk = following;
      used = pairs_a_chunk;
    }
    const std::size_t slot = static_cast<std::size_t>(current_) & mask_;
    for (const Entry& entry : unsorted_) put(slot, entry.a, entry.b);
  }

  // Small runs by rank: every entry's place is the number of entries before it, counted without a branch.
  void sort_run() {
    const std::size_t size = run_.size();
    if (size < 2) return;
    if (size > 48) {
      std::stable_sort(run_.begin(), run_.end(), [](const Entry& l, const Entry& r) { return l.time < r.time; });
      return;
    }
    std::array<double, 48> times;
    std::array<std::int64_t, 48> ranks{};
    for (std::size_t i = 0; i < size; ++i) times[i] = run_[i].time;
    for (std::size_t j = 0; j < size; ++j) {
      for (std::size_t i = 0; i < size; ++i) ranks[i] += times[j] < times[i];
    }
    unsorted_.assign(size, Entry{-1, 0, 0});
    for (std::size_t i = 0; i < size; ++i) {
      auto rank = static_cast<std::size_t>(ranks[i]);
      while (unsorted_[rank].time >= 0) ++rank;  // equal times keep their order
      unsorted_[rank] = run_[i];
    }
    run_.swap(unsorted_);
  }

  const Disk* disks_ = nullptr;
  double buckets_a_time_ = 1;
  std::vector<std::uint32_t> heads_;
  std::size_t mask_ = 0;
  std::vector<Chunk> chunks_;
  std::uint32_t free_chunk_ = 0;
  std::int64_t current_ = -1;
  std::vector<Entry> run_, unsorted_;  // the current bucket, sorted; scratch
  std::size_t next_ = 0;
};

}  // namespace shakebed::sim
