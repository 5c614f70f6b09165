#include "pipelines/stages/images_module.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <filesystem>

#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/version.hpp"

namespace shakebed::pipelines {

namespace {

// Frames of many megapixels are taken and given back all the time; fresh pages for each cost a fifth of the whole run
// (photograph of 20 megapixels: 1.6 s of the system's time, 0.5 s with this, peak memory 10 % larger).
void keep_memory_of_pictures() {
#ifdef __GLIBC__
  constexpr int largest_threshold = 32 << 20;  // bytes, the most that the C library accepts
  constexpr int never = 2'000'000'000;         // bytes
  ::mallopt(M_MMAP_THRESHOLD, largest_threshold);
  ::mallopt(M_TRIM_THRESHOLD, never);
#endif
}

}  // namespace

const ImagesModule& images_module() {
  static const ImagesModule* const module = [] {
    namespace fs = std::filesystem;
    constexpr const char* name = "libshakebed_images.so";
    std::error_code error;
    const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
    std::vector<fs::path> places = {program / name, program / SHAKEBED_MODULE_FROM_PROGRAM / name,
                                    SHAKEBED_BUILD_MODULE_DIR "/" + std::string(name)};
    for (const fs::path& place : places) {
      if (!fs::is_regular_file(place, error)) continue;
      // What the pictures' libraries never call need not be looked up: a tenth of a second.
      void* handle = ::dlopen(place.c_str(), RTLD_LAZY | RTLD_LOCAL);
      if (handle == nullptr) throw StageError(fmt::format("the images module cannot be loaded: {}", ::dlerror()));
      using Entry = const ImagesModule* (*)(const char* revision);
      const auto entry = reinterpret_cast<Entry>(::dlsym(handle, "shakebed_images"));
      const ImagesModule* found = entry != nullptr ? entry(SHAKEBED_VERSION) : nullptr;
      if (found == nullptr)
        throw StageError(fmt::format("{} belongs to another version of shakebed; install both together", name));
      keep_memory_of_pictures();
      return found;
    }
    throw StageError(fmt::format("{} is missing. It must lie beside the program: install both together", name));
  }();
  return *module;
}

}  // namespace shakebed::pipelines
