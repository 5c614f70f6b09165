// Independent pieces of work on several threads.
#pragma once

#include <cstddef>
#include <functional>

namespace shakebed {

// Calls work(i) once for every i below `count`, on up to `threads` threads, this one among them; each takes the lowest
// i that is left. When a call throws, no further one begins; when all have ended, the exception of the lowest such i is
// thrown here.
void for_each_index(std::size_t count, int threads, const std::function<void(std::size_t)>& work);

// Of this machine; at least 1, also where their number is not known.
int processors();

}  // namespace shakebed
