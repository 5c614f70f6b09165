// implements: pipelines/cli/commands.hpp
#include <fmt/format.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/program.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/files.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

// In the first lines of every such page.
constexpr std::string_view mark = "<!-- shakebed live: ";

fs::path built_page() {
  std::error_code error;
  const fs::path here = fs::read_symlink("/proc/self/exe", error).parent_path();
  for (const fs::path& place : {here / SHAKEBED_LIVE_FROM_PROGRAM, fs::path(SHAKEBED_LIVE_IN_BUILD)}) {
    if (fs::is_regular_file(place, error)) return place;
  }
  throw StageError(
      "the page is not built: it contains the simulation as WebAssembly, which needs emscripten. Install it (Debian: "
      "emscripten), then build with: cmake --preset release && cmake --build --preset release --target shakebed_live");
}

// A page of this command is replaced, any other file is not.
void require_free(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return;
  if (!fs::is_regular_file(file, error) || read_file(file).substr(0, 200).find(mark) == std::string::npos)
    throw UsageError(
        fmt::format("{} exists and was not written by shakebed live; name another file with --out", file.string()));
}

int live(const Call& call) {
  fs::path file = call.out.value_or("bed.html");
  std::error_code error;
  if (fs::is_directory(file, error)) file /= "bed.html";
  require_free(file);
  write_file_atomically(file, read_file(built_page()));
  print(call.json ? dump(Json{{"file", file.string()}})
                  : fmt::format("wrote {}: open it in a browser\n", file.string()));
  return exit_ok;
}

}  // namespace

void add_live(Program& program) {
  CLI::App& command = program.add({"live", "write a page that simulates a bed live in the browser",
                                   "  shakebed live\n  shakebed live --out bed.html"},
                                  live);
  command.get_option("--out")->description("file of the page (default: bed.html)")->type_name("FILE.html");
}

}  // namespace shakebed::pipelines
