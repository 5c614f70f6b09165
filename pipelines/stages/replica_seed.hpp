// Seeds of replicas: the same everywhere, whoever runs them.
#pragma once

#include <cstdint>

namespace shakebed::pipelines {

// SplitMix64.
inline std::uint64_t mixed(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

// The first replica has the seed itself; the others have seeds below 2^53, so that any JSON reader sees the same
// number.
inline std::uint64_t replica_seed(std::uint64_t seed, std::uint64_t replica) {
  return replica == 0 ? seed : mixed(mixed(seed) ^ replica) >> 11;
}

}  // namespace shakebed::pipelines
