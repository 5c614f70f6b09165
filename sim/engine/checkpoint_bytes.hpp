// The form of an engine's checkpoint: a magic number, the number of disks, the engine's state, the state of the random
// number generator, a checksum. The engine's state follows the order of visit_state(). It begins with the number of
// intervals between synchronisations and the number done. The bytes hold for machines of this kind only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <vector>

namespace shakebed::sim::checkpoint_bytes {

inline constexpr std::uint64_t magic = 0x34306465626b6873;  // "shkbed04", little-endian

template <class T>
void put(std::vector<std::uint8_t>& out, const T& value) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&value);
  out.insert(out.end(), bytes, bytes + sizeof value);
}
template <class T>
void take(const std::uint8_t*& at, const std::uint8_t* end, T& value) {
  if (static_cast<std::size_t>(end - at) < sizeof value) throw std::invalid_argument("the checkpoint is truncated");
  std::memcpy(&value, at, sizeof value);
  at += sizeof value;
}

// The last eight bytes: FNV-1a of all others. A run must not continue from a damaged state: it may never
// end.
inline std::uint64_t checksum(const std::uint8_t* at, const std::uint8_t* end) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (; at != end; ++at) hash = (hash ^ *at) * 0x100000001b3;
  return hash;
}

// The same state with the count of intervals (periods of the floor) increased by that many: for tests of long runs.
inline std::vector<std::uint8_t> put_later(std::vector<std::uint8_t> checkpoint, std::uint64_t intervals) {
  std::uint64_t done = 0, sum = 0;
  constexpr std::size_t place = sizeof magic + sizeof(std::uint32_t) + sizeof done;  // of the intervals done
  if (checkpoint.size() < place + sizeof done + sizeof sum) throw std::invalid_argument("the checkpoint is truncated");
  std::memcpy(&done, &checkpoint[place], sizeof done);
  done += intervals;
  std::memcpy(&checkpoint[place], &done, sizeof done);
  const std::size_t end = checkpoint.size() - sizeof sum;
  sum = checksum(checkpoint.data(), checkpoint.data() + end);
  std::memcpy(&checkpoint[end], &sum, sizeof sum);
  return checkpoint;
}

}  // namespace shakebed::sim::checkpoint_bytes
