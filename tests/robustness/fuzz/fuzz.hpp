// What every fuzz target is given. A target throws nothing and returns nothing: what it must not do is crash, hang,
// make a NaN, or break a property that it states (fail()).
#pragma once

#include <unistd.h>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace shakebed::fuzz {

// A property is broken: says which and ends the process, as a crash would.
[[noreturn]] inline void fail(const std::string& what) {
  std::fprintf(stderr, "property broken: %s\n", what.c_str());
  std::abort();
}

// The bytes as a file, for readers that take a path; one name a process, in memory where there is /dev/shm.
inline std::filesystem::path as_file(std::string_view bytes, const std::string& extension) {
  static const std::filesystem::path folder =
      std::filesystem::is_directory("/dev/shm") ? "/dev/shm" : std::filesystem::temp_directory_path();
  const auto path = folder / ("shakebed-fuzz-" + std::to_string(::getpid()) + extension);
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) fail("the input cannot be written to " + path.string());
  const std::size_t written = std::fwrite(bytes.data(), 1, bytes.size(), file);
  if (std::fclose(file) != 0 || written != bytes.size()) fail("the input cannot be written to " + path.string());
  return path;
}

}  // namespace shakebed::fuzz
