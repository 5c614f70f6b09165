// Runs a fuzz target on files without libFuzzer, so that any compiler can replay what was found:
//   fuzz_json FOLDER_OR_FILE...                          every file once
//   fuzz_json --mutate SECONDS [--seed N] FOLDER...      and then inputs made of them by random changes
// The last input tried is kept in `fuzz-last-input` of the working folder while it runs, and left there by a crash. An
// input that takes more than 10 s of processor time ends the process (SIGPROF).
#include <fcntl.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <random>
#include <vector>

#include "tests/robustness/fuzz/fuzz.hpp"

extern "C" __attribute__((weak)) int LLVMFuzzerInitialize(int* argc, char*** argv);

namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

Bytes read(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void try_one(const Bytes& input, int keep) {
  if (::pwrite(keep, input.data(), input.size(), 0) < 0 || ::ftruncate(keep, static_cast<off_t>(input.size())) != 0)
    shakebed::fuzz::fail("fuzz-last-input cannot be written");
  const itimerval limit{{0, 0}, {10, 0}}, none{};
  ::setitimer(ITIMER_PROF, &limit, nullptr);
  LLVMFuzzerTestOneInput(input.data(), input.size());
  ::setitimer(ITIMER_PROF, &none, nullptr);
}

// A few changes of the kinds that parsers trip over.
Bytes changed(const std::vector<Bytes>& corpus, std::mt19937_64& random) {
  const auto below = [&](std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(random() % n); };
  static const std::string_view words[] = {
      "nan", "inf",  "-1",        "1e999", "\"",      "{",    "[",
      "}",   "]",    ",",         ":",     "\\u0000", "\xff", "999999999999999999999",
      "\n",  "null", "1e-999",    "..",    "/",       "$",    "\r\n",
      "\t",  "-0",   "4294967296"};
  Bytes bytes = corpus[below(corpus.size())];
  for (std::size_t changes = 1 + below(6); changes > 0; --changes) {
    const std::size_t at = below(bytes.size() + 1);
    const auto here = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    switch (below(8)) {
      case 0:
        if (at < bytes.size()) bytes[at] ^= static_cast<std::uint8_t>(1u << below(8));
        break;
      case 1:
        if (at < bytes.size()) bytes[at] = static_cast<std::uint8_t>(random());
        break;
      case 2:
        bytes.insert(here, static_cast<std::uint8_t>(random()));
        break;
      case 3: {
        const std::size_t size = std::min(bytes.size() - at, below(20));
        bytes.erase(here, here + static_cast<std::ptrdiff_t>(size));
        break;
      }
      case 4: {
        const std::string_view word = words[below(std::size(words))];
        bytes.insert(here, word.begin(), word.end());
        break;
      }
      case 5: {  // a piece of another one
        const Bytes& other = corpus[below(corpus.size())];
        const std::size_t from = below(other.size()), size = std::min(other.size() - from, below(64));
        bytes.insert(here, other.begin() + static_cast<std::ptrdiff_t>(from),
                     other.begin() + static_cast<std::ptrdiff_t>(from + size));
        break;
      }
      case 6:
        bytes.resize(at);  // cut short
        break;
      default: {  // four bytes as a number at the edge of its range
        static const std::uint32_t edges[] = {0, 1, 0x7fffffff, 0x80000000, 0xffffffff, 0xffff, 0x7fc00000, 0x7ff00000};
        if (at + 4 <= bytes.size()) std::memcpy(&bytes[at], &edges[below(std::size(edges))], 4);
      }
    }
    if (bytes.size() > 100'000) bytes.resize(100'000);
  }
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  if (LLVMFuzzerInitialize != nullptr) LLVMFuzzerInitialize(&argc, &argv);
  double seconds = 0;
  std::uint64_t seed = 1;
  std::vector<fs::path> files;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--mutate" && i + 1 < argc) {
      seconds = std::atof(argv[++i]);
    } else if (argument == "--seed" && i + 1 < argc) {
      seed = std::strtoull(argv[++i], nullptr, 10);
    } else if (fs::is_directory(argument)) {
      for (const fs::directory_entry& entry : fs::recursive_directory_iterator(argument)) {
        if (entry.is_regular_file()) files.push_back(entry.path());
      }
    } else if (fs::is_regular_file(argument)) {
      files.push_back(argument);
    } else {
      std::fprintf(stderr, "%s: no such file or folder\n", argument.c_str());
      return 2;
    }
  }
  std::sort(files.begin(), files.end());
  if (files.empty()) {
    std::fprintf(stderr, "no inputs\n");
    return 2;
  }
  const int keep = ::open("fuzz-last-input", O_RDWR | O_CREAT | O_TRUNC, 0600);
  if (keep < 0) {
    std::perror("fuzz-last-input");
    return 2;
  }
  std::vector<Bytes> corpus;
  for (const fs::path& file : files) {
    corpus.push_back(read(file));
    try_one(corpus.back(), keep);
  }
  std::uint64_t runs = 0;
  std::mt19937_64 random(seed);
  const auto start = std::chrono::steady_clock::now();
  while (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < seconds) {
    for (int i = 0; i < 16; ++i) try_one(changed(corpus, random), keep);
    runs += 16;
  }
  std::printf("%zu files, %llu changed inputs: no crash, no hang, no property broken\n", files.size(),
              static_cast<unsigned long long>(runs));
  ::close(keep);
  ::unlink("fuzz-last-input");
  return 0;
}
