// The fused multiply-add of the page against the library's, which computes with integers: the number of differences.
// Compiled by em++, called by fused.mjs.
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "sim/engine/lanes.hpp"
#include "sim/engine/random.hpp"

namespace {

using shakebed::sim::fused;
using shakebed::sim::Random;
using shakebed::sim::TwoLanes;

bool same(double one, double other) {
  if (std::isnan(one) || std::isnan(other)) return std::isnan(one) && std::isnan(other);
  return std::bit_cast<std::uint64_t>(one) == std::bit_cast<std::uint64_t>(other);
}

// How many of the three ways give another number than the library.
int differences(double a, double b, double c) {
  const double right = std::fma(a, b, c);
  const TwoLanes left = fused(TwoLanes{a, 1.5}, TwoLanes{b, 2.25}, TwoLanes{c, 0.125});
  const TwoLanes beside = fused(TwoLanes{1.5, a}, TwoLanes{2.25, b}, TwoLanes{0.125, c});
  return !same(fused(a, b, c), right) + !same(left[0], right) + !same(beside[1], right) + !same(left[1], 3.5) +
         !same(beside[0], 3.5);
}

constexpr double huge = std::numeric_limits<double>::max(), least = std::numeric_limits<double>::denorm_min();
constexpr double normal = std::numeric_limits<double>::min(), infinite = std::numeric_limits<double>::infinity();
const std::array<double, 34> special = {0.0,         -0.0,
                                        1.0,         -1.0,
                                        0.5,         3.0,
                                        1 + 0x1p-52, 1 - 0x1p-53,
                                        0x1p26 + 1,  0x1p27,
                                        0x1p52,      0x1.8p52,
                                        0x1p53,      1e-17,
                                        -1e-17,      0x1p-450,
                                        0x1p-451,    -0x1p-500,
                                        0x1p-53,     0x1p-1000,
                                        0x1p1000,    -0x1p1000,
                                        least,       -least,
                                        3 * least,   normal,
                                        -normal,     huge,
                                        -huge,       0x1p996,
                                        0x1p500,     infinite,
                                        -infinite,   std::numeric_limits<double>::quiet_NaN()};

}  // namespace

extern "C" {

int special_differences() {
  int count = 0;
  for (const double a : special)
    for (const double b : special)
      for (const double c : special) count += differences(a, b, c);
  return count;
}

// Numbers of all sizes up to 2^(+-span); and of each kind sums that nearly cancel and sums near halfway between two
// doubles.
int random_differences(int triples, int span, double seed) {
  Random random(static_cast<std::uint64_t>(seed));
  const auto draw = [&] {
    const int exponent = static_cast<int>(random.below(static_cast<std::uint32_t>(2 * span + 1))) - span;
    return std::ldexp(2 * random.uniform() - 1, exponent);
  };
  int count = 0;
  for (int k = 0; k < triples; ++k) {
    const double a = draw(), b = draw(), product = a * b;
    count += differences(a, b, draw());
    count += differences(a, b, -product);
    count += differences(a, b, -product * (1 + 0x1p-52));
    count += differences(a, b, product * std::ldexp(1.0, static_cast<int>(random.below(120)) - 60));
    // A few digits each: exact products and sums, and those that end in half a unit.
    const double few = std::round(a * 1024), digits = std::round(b * 1024);
    count += differences(few, digits, std::ldexp(std::round(1024 * draw()), 44));
    count += differences(few + 0x1p-20, digits, std::ldexp(1.0, 52 + static_cast<int>(random.below(20))));
  }
  return count;
}

}  // extern "C"
