#pragma once

#include <filesystem>

namespace shakebed::pipelines {

// An exclusive lock on a folder, held by the kernel for as long as this process lives: a killed run leaves none behind.
class FolderLock {
 public:
  // Throws StageError naming the process that uses the folder.
  explicit FolderLock(const std::filesystem::path& folder);
  FolderLock(FolderLock&& other) noexcept : descriptor_(other.descriptor_), path_(other.path_) {
    other.descriptor_ = -1;
  }
  ~FolderLock();

 private:
  int descriptor_ = -1;
  std::filesystem::path path_;
};

}  // namespace shakebed::pipelines
