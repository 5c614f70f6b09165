#include "ingest/frames/atomic_file.hpp"

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>

namespace shakebed::ingest {

OutputError::OutputError(const std::filesystem::path& path, const std::string& why)
    : std::runtime_error(path.string() + ": cannot be written: " + why +
                         "; choose another output folder or free disk space") {}

void write_file_atomically(const std::filesystem::path& path, const std::string& contents) {
  namespace fs = std::filesystem;
  static std::atomic<unsigned> serial{0};
  fs::path temporary = path;
  temporary += ".part" + std::to_string(static_cast<long>(getpid())) + "_" + std::to_string(serial.fetch_add(1));
  std::error_code error;
  {
    errno = 0;
    std::ofstream file(temporary, std::ios::binary);
    file.write(contents.data(), static_cast<std::streamsize>(contents.size()));
    file.flush();
    if (!file) {
      const std::string why = errno != 0 ? std::strerror(errno) : "the write failed";
      file.close();
      fs::remove(temporary, error);
      throw OutputError(path, why);
    }
  }
  fs::rename(temporary, path, error);
  if (error) {
    const std::string why = error.message();
    fs::remove(temporary, error);
    throw OutputError(path, why);
  }
}

}  // namespace shakebed::ingest
