#pragma once
// Eight floats at once, with the compilers' own vectors (GCC and Clang): the inner loops over pixels. Every lane does
// the same IEEE operations in the same order on any machine; only the speed differs.

#include <cstring>
#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace shakebed::ingest {

constexpr int lanes = 8;
typedef float Floats __attribute__((vector_size(32)));
typedef int Ints __attribute__((vector_size(32)));

inline constexpr Floats lane_numbers = {0, 1, 2, 3, 4, 5, 6, 7};
inline constexpr Ints lane_indices = {0, 1, 2, 3, 4, 5, 6, 7};

inline __attribute__((always_inline)) void load(const float* from, Floats& to) { std::memcpy(&to, from, sizeof to); }
inline __attribute__((always_inline)) void store(const Floats& from, float* to) { std::memcpy(to, &from, sizeof from); }

// to[l] = table[cell[l]]
inline __attribute__((always_inline)) void gather(const float* table, const Ints& cell, Floats& to) {
#if defined(__AVX2__)
  to = reinterpret_cast<Floats>(_mm256_i32gather_ps(table, reinterpret_cast<__m256i>(cell), 4));
#else
  for (int l = 0; l < lanes; ++l) to[l] = table[cell[l]];
#endif
}

// here[l] = table[cell[l]], next[l] = table[cell[l] + 1]. Both are loaded at once, which takes half the time of two
// gathers.
inline __attribute__((always_inline)) void gather_with_next(const float* table, const Ints& cell, Floats& here,
                                                            Floats& next) {
#if defined(__AVX2__)
  const auto both = [&](int l) {
    double pair;
    std::memcpy(&pair, table + cell[l], sizeof pair);
    return pair;
  };
  const auto four = [&](int a, int b, int c, int d) {
    return _mm256_castpd_ps(_mm256_set_m128d(_mm_set_pd(both(d), both(c)), _mm_set_pd(both(b), both(a))));
  };
  const __m256 one = four(0, 1, 4, 5), other = four(2, 3, 6, 7);
  constexpr int even = 0x88, odd = 0xDD;
  here = reinterpret_cast<Floats>(_mm256_shuffle_ps(one, other, even));
  next = reinterpret_cast<Floats>(_mm256_shuffle_ps(one, other, odd));
#else
  for (int l = 0; l < lanes; ++l) here[l] = table[cell[l]], next[l] = table[cell[l] + 1];
#endif
}

inline float sum_of(const Floats& values) {
  return ((values[0] + values[4]) + (values[1] + values[5])) + ((values[2] + values[6]) + (values[3] + values[7]));
}

}  // namespace shakebed::ingest
