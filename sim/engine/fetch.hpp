// Prefetches a cache line that will be read (or written) soon.
#pragma once

namespace shakebed::sim {

// As an instruction that the compiler may not leave out: loops and functions that do nothing but __builtin_prefetch
// have no effect in its eyes, and are gone without a word.
inline void fetch(const void* place) {
#if defined(__x86_64__)
  asm volatile("prefetcht0 %0" : : "m"(*static_cast<const char*>(place)));
#else
  __builtin_prefetch(place);
#endif
}

}  // namespace shakebed::sim
