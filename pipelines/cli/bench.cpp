// implements: pipelines/cli/commands.hpp
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/program.hpp"
#include "pipelines/formats/errors.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

// Becomes the program shakebed-bench, with what stands behind "bench" on the command line.
int bench(const Call& call) {
  std::error_code error;
  const fs::path here = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (const fs::path& place : {here / SHAKEBED_BENCH_FROM_PROGRAM, fs::path(SHAKEBED_BENCH_IN_BUILD)}) {
    if (!fs::is_regular_file(place, error)) continue;
    std::vector<char*> words;
    std::string name = "shakebed bench";
    words.push_back(name.data());
    for (std::size_t i = 2; i < call.command_line.size(); ++i)
      words.push_back(const_cast<char*>(call.command_line[i].c_str()));
    words.push_back(nullptr);
    ::execv(place.c_str(), words.data());
    throw StageError(fmt::format("{}: cannot be started: {}", place.string(), std::strerror(errno)));
  }
  throw StageError(
      "the program shakebed-bench is not installed; build it with: cmake --build --preset release --target "
      "shakebed_bench");
}

}  // namespace

void add_bench(Program& program) {
  program.add_prefix({"bench", "measure the speed and the error of each stage on this machine", ""}, bench);
}

}  // namespace shakebed::pipelines
