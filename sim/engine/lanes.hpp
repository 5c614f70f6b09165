// Two or four doubles at a time, in the compilers' own vector types. Each operation is one instruction where the
// machine has it. Other machines give the same bytes: add, subtract, multiply, divide, square root and fused
// multiply-add are all correctly rounded.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#if defined(__SSE2__)
#include <immintrin.h>
#endif
#if defined(__wasm_simd128__)
#include "sim/engine/fused_wasm.hpp"
#endif

namespace shakebed::sim {

// One of two without a branch, where a branch would be a coin toss. The compiler may not see where the mask is from: it
// makes branches of conditional expressions, and of masks that it knows to be two-valued.
inline std::int32_t choose(bool which, std::int32_t if_true, std::int32_t if_false) {
  std::int32_t mask = -static_cast<std::int32_t>(which);
  asm("" : "+r"(mask));
  return (if_true & mask) | (if_false & ~mask);
}

// Two doubles: x and z of one thing, or one number of each of two disks.
using TwoLanes = double __attribute__((vector_size(16)));

inline TwoLanes both(double value) { return TwoLanes{value, value}; }
// Two doubles that stand side by side, 16-byte aligned.
inline TwoLanes pair_at(const double* doubles) {
#if defined(__SSE2__)
  return _mm_load_pd(doubles);
#else
  return TwoLanes{doubles[0], doubles[1]};
#endif
}
inline void put_pair(double* doubles, TwoLanes lanes) {
#if defined(__SSE2__)
  _mm_store_pd(doubles, lanes);
#else
  doubles[0] = lanes[0];
  doubles[1] = lanes[1];
#endif
}
// a b + c, rounded once; the same bytes by instruction or by library.
#if !defined(__wasm_simd128__)
inline double fused(double a, double b, double c) { return std::fma(a, b, c); }
inline TwoLanes fused(TwoLanes a, TwoLanes b, TwoLanes c) {
#if defined(__FMA__)
  return _mm_fmadd_pd(a, b, c);
#else
  return TwoLanes{std::fma(a[0], b[0], c[0]), std::fma(a[1], b[1], c[1])};
#endif
}
#endif
inline double sqrt_lanes(double value) { return std::sqrt(value); }
inline TwoLanes sqrt_lanes(TwoLanes value) {
#if defined(__SSE2__)
  return _mm_sqrt_pd(value);
#else
  return TwoLanes{std::sqrt(value[0]), std::sqrt(value[1])};
#endif
}
inline double not_above_zero(double value) { return value < 0 ? value : 0; }
inline TwoLanes not_above_zero(TwoLanes value) {
#if defined(__SSE2__)
  return _mm_min_pd(value, TwoLanes{});
#else
  return TwoLanes{not_above_zero(value[0]), not_above_zero(value[1])};
#endif
}

using Lanes = double __attribute__((vector_size(32)));
using LaneMask = std::int64_t __attribute__((vector_size(32)));

inline Lanes all_lanes(double value) { return Lanes{value, value, value, value}; }

// {a[0], a[1], b[0], b[1]}. Both 16-byte aligned.
inline Lanes two_pairs(const double* a, const double* b) {
#if defined(__AVX__)
  return _mm256_insertf128_pd(_mm256_castpd128_pd256(_mm_load_pd(a)), _mm_load_pd(b), 1);
#else
  return Lanes{a[0], a[1], b[0], b[1]};
#endif
}

inline Lanes select(LaneMask mask, Lanes if_true, Lanes if_false) {
#if defined(__AVX__)
  return _mm256_blendv_pd(if_false, if_true, reinterpret_cast<Lanes>(mask));
#else
  return reinterpret_cast<Lanes>((reinterpret_cast<LaneMask>(if_true) & mask) |
                                 (reinterpret_cast<LaneMask>(if_false) & ~mask));
#endif
}
// value where the mask is not set, 0 where it is.
inline Lanes unless(LaneMask mask, Lanes value) {
#if defined(__AVX__)
  return _mm256_andnot_pd(reinterpret_cast<Lanes>(mask), value);
#else
  return reinterpret_cast<Lanes>(~mask & reinterpret_cast<LaneMask>(value));
#endif
}
inline bool any_of(LaneMask mask) {
#if defined(__AVX__)
  return _mm256_testz_si256(reinterpret_cast<__m256i>(mask), reinterpret_cast<__m256i>(mask)) == 0;
#else
  return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
#endif
}
// Also where some are -0.
inline bool all_negative(Lanes value) {
#if defined(__AVX__)
  return _mm256_movemask_pd(value) == 15;
#else
  return std::signbit(value[0]) && std::signbit(value[1]) && std::signbit(value[2]) && std::signbit(value[3]);
#endif
}
inline Lanes sqrt_lanes(Lanes value) {
#if defined(__AVX__)
  return _mm256_sqrt_pd(value);
#else
  return Lanes{std::sqrt(value[0]), std::sqrt(value[1]), std::sqrt(value[2]), std::sqrt(value[3])};
#endif
}
inline Lanes fused(Lanes a, Lanes b, Lanes c) {
#if defined(__FMA__)
  return _mm256_fmadd_pd(a, b, c);
#elif defined(__wasm_simd128__)
  const TwoLanes low = fused(TwoLanes{a[0], a[1]}, TwoLanes{b[0], b[1]}, TwoLanes{c[0], c[1]});
  const TwoLanes high = fused(TwoLanes{a[2], a[3]}, TwoLanes{b[2], b[3]}, TwoLanes{c[2], c[3]});
  return __builtin_shufflevector(low, high, 0, 1, 2, 3);
#else
  return Lanes{std::fma(a[0], b[0], c[0]), std::fma(a[1], b[1], c[1]), std::fma(a[2], b[2], c[2]),
               std::fma(a[3], b[3], c[3])};
#endif
}
inline Lanes larger(Lanes a, Lanes b) {
#if defined(__AVX__)
  return _mm256_max_pd(a, b);
#else
  return select(a > b, a, b);
#endif
}

// Whether a fused product costs many times an ordinary one. Then most are avoided, and two lanes are computed where
// four are not needed.
#if defined(__wasm_simd128__)
inline constexpr bool fused_takes_long = true;
#else
inline constexpr bool fused_takes_long = false;
#endif
using TwoMasks = std::int64_t __attribute__((vector_size(16)));
inline TwoLanes unless(TwoMasks mask, TwoLanes value) {
  return reinterpret_cast<TwoLanes>(~mask & reinterpret_cast<TwoMasks>(value));
}
inline TwoLanes larger(TwoLanes a, TwoLanes b) {
  const auto mask = reinterpret_cast<TwoMasks>(a > b);
  return reinterpret_cast<TwoLanes>((reinterpret_cast<TwoMasks>(a) & mask) | (reinterpret_cast<TwoMasks>(b) & ~mask));
}
inline TwoLanes first_half(Lanes lanes) { return __builtin_shufflevector(lanes, lanes, 0, 1); }
inline TwoLanes second_half(Lanes lanes) { return __builtin_shufflevector(lanes, lanes, 2, 3); }
inline Lanes joined(TwoLanes first, TwoLanes second) { return __builtin_shufflevector(first, second, 0, 1, 2, 3); }
template <class Number>
Number in_lanes(double value) {
  if constexpr (sizeof(Number) == sizeof(Lanes)) {
    return all_lanes(value);
  } else {
    return both(value);
  }
}

// Four doubles that have been written one by one just now are read so, too: at once they could not be read before they
// have reached the cache. The compiler may not see that they stand side by side.
inline Lanes four_just_written(const double* doubles) {
  double a = doubles[0], b = doubles[1], c = doubles[2], d = doubles[3];
#if defined(__SSE2__)
  asm("" : "+x"(a), "+x"(b), "+x"(c), "+x"(d));
#endif
  return Lanes{a, b, c, d};
}

// ranks[k]: how many of the times, a multiple of four, come before times[k]; of equal ones the one that stands first.
template <std::size_t count>
void rank_times(const double* times, std::int64_t* ranks) {
  std::array<Lanes, count / 4> mine;
  std::array<LaneMask, count / 4> before{};
  for (std::size_t block = 0; block < count / 4; ++block) mine[block] = four_just_written(times + 4 * block);
  constexpr LaneMask lane = {0, 1, 2, 3};
#pragma GCC unroll 24
  for (std::size_t k = 0; k < count; ++k) {
    const Lanes other = all_lanes(times[k]);
#pragma GCC unroll 4
    for (std::size_t block = 0; block < count / 4; ++block) {
      if (block < k / 4) {
        before[block] -= other < mine[block];
      } else if (block > k / 4) {
        before[block] -= other <= mine[block];
      } else {
        before[block] -= (other < mine[block]) | ((other == mine[block]) & (lane > static_cast<std::int64_t>(k % 4)));
      }
    }
  }
  std::memcpy(ranks, before.data(), sizeof before);
}

// Eight floats or 32-bit words at a time.
using FloatLanes = float __attribute__((vector_size(32)));
using WordLanes = std::int32_t __attribute__((vector_size(32)));

// Four of one place and four of another.
inline FloatLanes four_and_four(const float* first, const float* second) {
#if defined(__AVX__)
  return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(first)), _mm_loadu_ps(second), 1);
#else
  return FloatLanes{first[0], first[1], first[2], first[3], second[0], second[1], second[2], second[3]};
#endif
}
inline WordLanes four_and_four(const std::uint32_t* first, const std::uint32_t* second) {
#if defined(__AVX__)
  const __m128i a = _mm_loadu_si128(reinterpret_cast<const __m128i*>(first)),
                b = _mm_loadu_si128(reinterpret_cast<const __m128i*>(second));
  return reinterpret_cast<WordLanes>(_mm256_insertf128_si256(_mm256_castsi128_si256(a), b, 1));
#else
  const auto word = [](std::uint32_t value) { return static_cast<std::int32_t>(value); };
  return WordLanes{word(first[0]),  word(first[1]),  word(first[2]),  word(first[3]),
                   word(second[0]), word(second[1]), word(second[2]), word(second[3])};
#endif
}
// The upper half of a float's bits is a float of eight binary digits; of a positive one the next that is no smaller.
inline std::uint16_t upper_half(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  return static_cast<std::uint16_t>((bits + (value > 0 ? 0xffff : 0)) >> 16);
}
// The floats of four such halves and four others.
inline FloatLanes four_and_four(const std::uint16_t* first, const std::uint16_t* second) {
#if defined(__AVX2__)
  const __m128i halves = _mm_unpacklo_epi64(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(first)),
                                            _mm_loadl_epi64(reinterpret_cast<const __m128i*>(second)));
  return _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_cvtepu16_epi32(halves), 16));
#else
  FloatLanes lanes;
  for (int k = 0; k < 4; ++k) {
    lanes[k] = std::bit_cast<float>(std::uint32_t{first[k]} << 16);
    lanes[k + 4] = std::bit_cast<float>(std::uint32_t{second[k]} << 16);
  }
  return lanes;
#endif
}

// Bit k is the mask's lane k.
inline unsigned bits_of(WordLanes mask) {
#if defined(__AVX__)
  return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(mask)));
#else
  unsigned bits = 0;
  for (unsigned k = 0; k < 8; ++k) bits |= static_cast<unsigned>(mask[k] != 0) << k;
  return bits;
#endif
}
inline WordLanes all_words(std::uint32_t value) { return WordLanes{} + static_cast<std::int32_t>(value); }
inline WordLanes eight_words(const std::uint32_t* words) {
  WordLanes lanes;
  std::memcpy(&lanes, words, sizeof lanes);
  return lanes;
}
inline FloatLanes eight_floats(const float* floats) {
  FloatLanes lanes;
  std::memcpy(&lanes, floats, sizeof lanes);
  return lanes;
}
// Bit k set where words[k] == value, k = 0 to 7.
inline unsigned equal_words(const std::uint32_t* words, std::uint32_t value) {
  return bits_of(eight_words(words) == static_cast<std::int32_t>(value));
}
// The same of four words.
inline unsigned equal_among_four(const std::uint32_t* words, std::uint32_t value) {
#if defined(__SSE2__)
  const __m128i equal = _mm_cmpeq_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(words)),
                                        _mm_set1_epi32(static_cast<std::int32_t>(value)));
  return static_cast<unsigned>(_mm_movemask_ps(_mm_castsi128_ps(equal)));
#else
  unsigned bits = 0;
  for (unsigned k = 0; k < 4; ++k) bits |= static_cast<unsigned>(words[k] == value) << k;
  return bits;
#endif
}
// Bit k set where words[k] is one of the eight `among`.
inline unsigned words_among(const std::uint32_t* words, const std::uint32_t* among) {
  const WordLanes mine = eight_words(words);
  WordLanes found{};
#pragma GCC unroll 8
  for (int k = 0; k < 8; ++k) found |= mine == static_cast<std::int32_t>(among[k]);
  return bits_of(found);
}

inline FloatLanes all_floats(float value) { return FloatLanes{value, value, value, value, value, value, value, value}; }
inline FloatLanes select(WordLanes mask, FloatLanes if_true, FloatLanes if_false) {
  return reinterpret_cast<FloatLanes>((reinterpret_cast<WordLanes>(if_true) & mask) |
                                      (reinterpret_cast<WordLanes>(if_false) & ~mask));
}
inline WordLanes select(WordLanes mask, WordLanes if_true, WordLanes if_false) {
  return (if_true & mask) | (if_false & ~mask);
}
inline FloatLanes smaller(FloatLanes a, FloatLanes b) {
#if defined(__AVX__)
  return _mm256_min_ps(a, b);
#else
  return select(a < b, a, b);
#endif
}
inline float smallest_of(FloatLanes a) {
  a = smaller(a, __builtin_shufflevector(a, a, 4, 5, 6, 7, 0, 1, 2, 3));
  a = smaller(a, __builtin_shufflevector(a, a, 2, 3, 0, 1, 6, 7, 4, 5));
  a = smaller(a, __builtin_shufflevector(a, a, 1, 0, 3, 2, 5, 4, 7, 6));
  return a[0];
}
inline FloatLanes sqrt_floats(FloatLanes value) {
#if defined(__AVX__)
  return _mm256_sqrt_ps(value);
#else
  for (int k = 0; k < 8; ++k) value[k] = std::sqrt(value[k]);
  return value;
#endif
}
inline FloatLanes fused(FloatLanes a, FloatLanes b, FloatLanes c) {
#if defined(__FMA__)
  return _mm256_fmadd_ps(a, b, c);
#else
  for (int k = 0; k < 8; ++k) c[k] = std::fma(a[k], b[k], c[k]);
  return c;
#endif
}
#if defined(__AVX2__) && defined(__BMI2__)
// The lanes whose mask's bit is set, in order, as the indices of a permutation.
inline __m256i lanes_in(unsigned bits) {
  const std::uint64_t bytes = _pdep_u64(bits, 0x0101010101010101) * 0xff;
  const auto order = static_cast<long long>(_pext_u64(0x0706050403020100, bytes));
  return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(order));
}
#endif
// Writes the lanes whose mask is set, in order, to the start of out; all eight
// places may be written. How many they are.
inline unsigned compress(WordLanes mask, WordLanes words, std::uint32_t* words_out) {
#if defined(__AVX2__) && defined(__BMI2__)
  const unsigned bits = bits_of(mask);
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(words_out),
                      _mm256_permutevar8x32_epi32(reinterpret_cast<__m256i>(words), lanes_in(bits)));
  return static_cast<unsigned>(__builtin_popcount(bits));
#else
  unsigned count = 0;
  for (int k = 0; k < 8; ++k) {
    words_out[count] = static_cast<std::uint32_t>(words[k]);
    count += mask[k] != 0;
  }
  return count;
#endif
}
// The same, and of floats that go with them.
inline unsigned compress(WordLanes mask, WordLanes words, FloatLanes floats, std::uint32_t* words_out,
                         float* floats_out) {
#if defined(__AVX2__) && defined(__BMI2__)
  _mm256_storeu_ps(floats_out, _mm256_permutevar8x32_ps(floats, lanes_in(bits_of(mask))));
#else
  unsigned count = 0;
  for (int k = 0; k < 8; ++k) {
    floats_out[count] = floats[k];
    count += mask[k] != 0;
  }
#endif
  return compress(mask, words, words_out);
}

// The earliest of some times, none of them NaN, and the id that goes with it; of equal times the first one's.
struct Earliest {
  double time;
  std::int32_t id;
};
#if defined(__AVX2__)
// In every lane at once, before it is known where it stands: it is wanted sooner.
inline __m256d smallest_of(Lanes times) {
  const __m256d of_two = _mm256_min_pd(_mm256_permute2f128_pd(times, times, 1), times);
  return _mm256_min_pd(_mm256_permute_pd(of_two, 5), of_two);
}
#else
inline Earliest earliest_of(const double* times, const std::uint32_t* ids, int count) {
  Earliest earliest = {times[0], static_cast<std::int32_t>(ids[0])};
  for (int k = 1; k < count; ++k) {
    if (times[k] < earliest.time) earliest = {times[k], static_cast<std::int32_t>(ids[k])};
  }
  return earliest;
}
#endif
inline Earliest earliest_of_four(Lanes times, const std::uint32_t* ids) {
#if defined(__AVX2__)
  const __m256d earliest = smallest_of(times);
  const auto bits = static_cast<unsigned>(_mm256_movemask_pd(_mm256_cmp_pd(times, earliest, _CMP_EQ_OQ)));
  return {_mm256_cvtsd_f64(earliest), static_cast<std::int32_t>(ids[__builtin_ctz(bits)])};
#else
  const double in_order[4] = {times[0], times[1], times[2], times[3]};
  return earliest_of(in_order, ids, 4);
#endif
}
// The times of ids 0, 1, 4, 5 and those of 2, 3, 6, 7: so two masks become one in their order.
inline Earliest earliest_of_eight(Lanes times0145, Lanes times2367, const std::uint32_t* ids) {
#if defined(__AVX2__)
  const __m256d earliest = smallest_of(_mm256_min_pd(times2367, times0145));
  const __m256i equal = _mm256_packs_epi32(_mm256_castpd_si256(_mm256_cmp_pd(times0145, earliest, _CMP_EQ_OQ)),
                                           _mm256_castpd_si256(_mm256_cmp_pd(times2367, earliest, _CMP_EQ_OQ)));
  const auto bits = static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(equal)));
  return {_mm256_cvtsd_f64(earliest), static_cast<std::int32_t>(ids[__builtin_ctz(bits)])};
#else
  const double times[8] = {times0145[0], times0145[1], times2367[0], times2367[1],
                           times0145[2], times0145[3], times2367[2], times2367[3]};
  return earliest_of(times, ids, 8);
#endif
}

}  // namespace shakebed::sim
