#pragma once

#include <bit>
#include <cstdint>
#include <numbers>

namespace shakebed {

// exp(x) for -700 < x <= 0 to 2 units in the last place, in steps a compiler turns into vector instructions.
inline double fast_exp(double x) {
  constexpr double to_integer = 0x1.8p52;
  const double shifted = x * std::numbers::log2e + to_integer;
  const double n = shifted - to_integer;
  const double r = (x - n * 0x1.62e42fefap-1) - n * 0x1.cf79abc9e3b3ap-40;  // ln 2 in two parts
  // 1 + r + r^2/2! + ... + r^12/12!. Written out: as a loop, -O2 leaves a loop here, and no lanes.
  const double high =
      ((((r * (1.0 / 479001600) + 1.0 / 39916800) * r + 1.0 / 3628800) * r + 1.0 / 362880) * r + 1.0 / 40320) * r;
  const double low = ((((high + 1.0 / 5040) * r + 1.0 / 720) * r + 1.0 / 120) * r + 1.0 / 24) * r;
  const double sum = (((low + 1.0 / 6) * r + 0.5) * r + 1) * r + 1;
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(sum) + (std::bit_cast<std::uint64_t>(shifted) << 52U));
}

}  // namespace shakebed
