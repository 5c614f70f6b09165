#pragma once
// Reproducible random numbers for rendering: the same bits on every machine and thread.

#include <cstdint>

namespace shakebed::ingest {

// SplitMix64 [Steele2014]: one 64-bit word after the other; any seed will do.
class RandomStream {
 public:
  explicit RandomStream(std::uint64_t seed) : state_(seed) {}
  // Streams of (seed, a, b) that do not resemble one another.
  RandomStream(std::uint64_t seed, std::uint64_t a, std::uint64_t b)
      : state_(mix(mix(mix(seed) + a * 0x9e3779b97f4a7c15ULL) + b * 0xd1b54a32d192ed03ULL)) {}

  std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15ULL;
    return mix(state_);
  }
  // Uniform in [0, 1).
  double uniform() { return static_cast<double>(next() >> 11U) * 0x1.0p-53; }
  // Standard normal (a quantile out of 65,536, so never beyond 4.4).
  double normal();

 private:
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31U);
  }
  std::uint64_t state_;
};

// The normal quantile at (i + 1/2)/65536, i = 0 .. 65535, scaled to unit variance.
const float* normal_quantiles();

}  // namespace shakebed::ingest
