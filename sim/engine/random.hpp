// Random numbers whose sequence is fixed by the seed alone, on every machine: xoshiro256++ [BlackmanVigna2021], seeded
// by splitmix64.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace shakebed::sim {

class Random {
 public:
  explicit Random(std::uint64_t seed = 1) {
    for (std::uint64_t& word : state_) {
      seed += 0x9e3779b97f4a7c15;
      std::uint64_t z = seed;
      z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
      z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
      word = z ^ (z >> 31);
    }
  }
  std::uint64_t bits() {
    const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
    const std::uint64_t shifted = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= shifted;
    state_[3] = std::rotl(state_[3], 45);
    return result;
  }
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }                 // [0, 1)
  double uniform_positive() { return (static_cast<double>(bits() >> 11) + 1) * 0x1p-53; }  // (0, 1]
  std::uint32_t below(std::uint32_t n) {
    // The upper half of the product of 64 and 32 bits.
    const std::uint64_t b = bits(), upper = (b >> 32) * n, lower = (b & 0xffffffff) * n;
    return static_cast<std::uint32_t>((upper + (lower >> 32)) >> 32);
  }
  struct Pair {
    double first, second;
  };
  Pair normal_pair() {  // two independent standard normals (Box and Muller)
    const double radius = std::sqrt(-2 * std::log(uniform_positive()));
    const double angle = 2 * std::numbers::pi * uniform();
    return {radius * std::cos(angle), radius * std::sin(angle)};
  }
  const std::array<std::uint64_t, 4>& state() const { return state_; }
  void set_state(const std::array<std::uint64_t, 4>& state) { state_ = state; }

 private:
  std::array<std::uint64_t, 4> state_{};
};

}  // namespace shakebed::sim
