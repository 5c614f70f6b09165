// Events that are far off, by stretches of time: written down one behind the other, and taken up, a stretch at a time,
// in the order in which they came. A queue that is far larger than the caches then writes to as many places as there
// are stretches, which stay near, and reads each entry once more.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/engine/fetch.hpp"
#include "sim/engine/large_vector.hpp"

namespace shakebed::sim {

struct EventEntry {
  double time;
  std::uint64_t pair;  // the second disk in the upper half

  std::uint32_t first() const { return static_cast<std::uint32_t>(pair); }
  std::uint32_t second() const { return static_cast<std::uint32_t>(pair >> 32); }
};
inline std::uint64_t pair_of(std::uint32_t a, std::uint32_t b) { return static_cast<std::uint64_t>(b) << 32 | a; }

class EventStretches {
 public:
  void reset(std::size_t stretches) {
    stretches_.assign(stretches, {});
    chunks_.resize(1);
    next_.assign(1, 0);
    free_ = 0;
  }

  void append(std::size_t stretch, const EventEntry& entry) {
    Stretch& last = stretches_[stretch];
    if (last.end % entries_a_chunk == 0) [[unlikely]]
      begin_chunk(last);
    EventEntry& place = chunks_[last.end / entries_a_chunk].entries[last.end % entries_a_chunk];
    place.time = entry.time;
    place.pair = entry.pair;
    ++last.end;
  }

  // Calls visit(entry) for every entry of a stretch, and forgets them.
  template <class Visit>
  void take(std::size_t stretch, Visit visit) {
    const Stretch taken = stretches_[stretch];
    stretches_[stretch] = {};
    for (std::uint32_t chunk = taken.first; chunk != 0;) {
      const std::uint32_t next = next_[chunk];
      const std::uint32_t held = next != 0 ? entries_a_chunk : (taken.end - 1) % entries_a_chunk + 1;
      for (std::uint32_t k = 0; k < held; ++k) visit(chunks_[chunk].entries[k]);
      next_[chunk] = free_;
      free_ = chunk;
      chunk = next;
    }
  }

  std::size_t bytes() const {
    return stretches_.capacity() * sizeof(Stretch) + chunks_.capacity() * sizeof(Chunk) +
           next_.capacity() * sizeof(std::uint32_t);
  }

 private:
  static constexpr std::uint32_t entries_a_chunk = 256;  // a page

  struct Stretch {
    std::uint32_t first = 0, end = 0;  // its first chunk, 0 for none; where its next entry goes, counted through all
  };
  struct Chunk {
    std::array<EventEntry, entries_a_chunk> entries;
  };

  [[gnu::noinline]] void begin_chunk(Stretch& stretch) {
    std::uint32_t fresh = free_;
    if (fresh != 0) {
      free_ = next_[fresh];
    } else {
      fresh = static_cast<std::uint32_t>(chunks_.size());
      if (chunks_.size() == chunks_.capacity()) chunks_.reserve(chunks_.size() + chunks_.size() / 8 + 64);
      chunks_.emplace_back();
      next_.push_back(0);
    }
    next_[fresh] = 0;
    (stretch.first == 0 ? stretch.first : next_[(stretch.end - 1) / entries_a_chunk]) = fresh;
    stretch.end = fresh * entries_a_chunk;
  }

  std::vector<Stretch> stretches_;
  LargeVector<Chunk> chunks_;        // the first is not used
  std::vector<std::uint32_t> next_;  // of the same stretch, or of those that are free; 0 for none
  std::uint32_t free_ = 0;
};

}  // namespace shakebed::sim
