// a b + c rounded once, for WebAssembly, which has no instruction for it. It computes two values at a time with
// ordinary doubles. The bytes equal those of the instruction on other machines. It is four times as fast as the
// library's function, which computes with integers. Included by lanes.hpp only.
#pragma once

#include <wasm_simd128.h>

#include <cmath>

namespace shakebed::sim {

using TwoLanes = double __attribute__((vector_size(16)));

// Below this the error of a product is not a double.
inline constexpr double smallest_exact_product = 0x1p-900;
inline constexpr double splitter = 0x1p27 + 1;     // halves of 26 binary digits [Dekker1971]
inline constexpr double twice_rounding = 0x1p-51;  // four times the largest relative error of one operation

// Where the quick way does not hold: products that are far too small, sums as good as halfway between two doubles,
// zeros, what overflows, what is not finite.
[[gnu::noinline]] inline double fused_rarely(double a, double b, double c) {
  if (std::isinf(c) && std::isfinite(a) && std::isfinite(b)) return c;  // also where the product overflows
  if (a == 0 || b == 0 || !std::isfinite(b) || !std::isfinite(c)) return a * b + c;
  return std::fma(a, b, c);
}
[[gnu::noinline]] inline TwoLanes fused_rarely(TwoLanes a, TwoLanes b, TwoLanes c) {
  return TwoLanes{fused_rarely(a[0], b[0], c[0]), fused_rarely(a[1], b[1], c[1])};
}

// What the quick way asks of one number or of two.
inline double magnitude(double value) { return std::abs(value); }
inline TwoLanes magnitude(TwoLanes value) {
  return reinterpret_cast<TwoLanes>(wasm_f64x2_abs(reinterpret_cast<v128_t>(value)));
}
inline bool all_hold(bool condition) { return condition; }
inline bool all_hold(decltype(TwoLanes{} == TwoLanes{}) conditions) {
  return wasm_i64x2_all_true(reinterpret_cast<v128_t>(conditions));
}

// Product and sum with what their rounding leaves: a b + c = sum + (sum_rest + low_rest) without error. What is left is
// known to half a unit in its last place; where all that it can be gives the same result, that is the result. An `a`
// that is not finite (contacts that never are) goes the quick way too.
template <class Number>
[[gnu::always_inline]] inline Number fused_by_parts(Number a, Number b, Number c) {
  const Number product = a * b;
  const Number a_split = a * splitter, a_high = a_split - (a_split - a), a_low = a - a_high;
  const Number b_split = b * splitter, b_high = b_split - (b_split - b), b_low = b - b_high;
  const Number product_rest = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
  const auto add = [](Number x, Number y, Number& rest) {  // [Knuth1997]
    const Number sum = x + y, from_y = sum - x;
    rest = (x - (sum - from_y)) + (y - from_y);
    return sum;
  };
  Number low_rest, sum_rest;
  const Number low = add(c, product_rest, low_rest), sum = add(product, low, sum_rest);
  const Number rest = sum_rest + low_rest, doubt = rest * twice_rounding;
  const Number result = sum + (rest + doubt), other = sum + (rest - doubt);
  const auto finite = a - a == 0.0;
  const auto of_zero = (product == 0.0) & (magnitude(c) >= smallest_exact_product);
  const auto exact = static_cast<decltype(of_zero)>(magnitude(product) >= smallest_exact_product) | of_zero;
  if (!all_hold((exact & (result == other) & (result != 0.0)) | !finite)) [[unlikely]]
    return fused_rarely(a, b, c);
  return finite ? result : product + c;
}

inline double fused(double a, double b, double c) { return fused_by_parts(a, b, c); }
inline TwoLanes fused(TwoLanes a, TwoLanes b, TwoLanes c) { return fused_by_parts(a, b, c); }

}  // namespace shakebed::sim
