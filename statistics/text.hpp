// Sentences with numbers in them.
#pragma once

#include <string>

namespace shakebed {

// As std::printf would print it. Numbers are written by the C locale unless the program has chosen another one.
#if defined(__GNUC__)
__attribute__((format(printf, 1, 2)))
#endif
std::string
formatted(const char* format, ...);

}  // namespace shakebed
