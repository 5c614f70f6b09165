#include "pipelines/runner/folder_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "pipelines/formats/errors.hpp"
#include "pipelines/runner/manifest.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

FolderLock::FolderLock(const fs::path& folder) : path_(folder / ".lock") {
  while (true) {
    descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor_ < 0)
      throw StageError(fmt::format("{}: cannot be written: {}", folder.string(), std::strerror(errno)));
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
      char owner[256] = {};
      const ssize_t size = ::read(descriptor_, owner, sizeof owner - 1);
      ::close(descriptor_);
      throw StageError(
          fmt::format("{}: another shakebed process uses this folder{}{}; wait until it ends, or choose another --out",
                      folder.string(), size > 0 ? ": " : "", size > 0 ? owner : ""));
    }
    // The file may have been removed between opening and locking: then this lock is on nothing.
    struct stat held {
    }, named{};
    if (::fstat(descriptor_, &held) == 0 && ::stat(path_.c_str(), &named) == 0 && held.st_ino == named.st_ino) break;
    ::close(descriptor_);
  }
  const std::string owner = fmt::format("process {} on {}", ::getpid(), host_name());
  if (::ftruncate(descriptor_, 0) != 0 || ::pwrite(descriptor_, owner.data(), owner.size(), 0) < 0) {
    // Only a courtesy to whoever finds the folder locked; the lock itself holds.
  }
}

FolderLock::~FolderLock() {
  if (descriptor_ < 0) return;
  ::unlink(path_.c_str());
  ::close(descriptor_);
}

}  // namespace shakebed::pipelines
