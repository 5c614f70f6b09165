#pragma once
// Folders for tests: a scratch folder that vanishes, and the real images, which may be absent.

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace shakebed::ingest::test {

// A fresh folder, removed with all it holds at the end of the test.
class ScratchFolder {
 public:
  ScratchFolder() {
    static int serial = 0;
    path_ = std::filesystem::temp_directory_path() /
            ("shakebed_ingest_" + std::to_string(static_cast<long>(getpid())) + "_" + std::to_string(serial++));
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  [[nodiscard]] std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

// The folder of real images: SHAKEBED_IMAGES, else `shared/images` beside the checkout. Empty when absent.
inline std::filesystem::path real_images() {
  if (const char* given = std::getenv("SHAKEBED_IMAGES")) return given;
  const std::filesystem::path beside = std::filesystem::path(SHAKEBED_SOURCE_DIR) / ".." / "shared" / "images";
  return std::filesystem::exists(beside) ? beside : std::filesystem::path();
}

}  // namespace shakebed::ingest::test
