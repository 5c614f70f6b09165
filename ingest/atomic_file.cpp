#include "ingest/atomic_file.hpp"

#include <unistd.h>

#include <atomic>
#include <fstream>

#include "ingest/frames.hpp"

namespace shakebed::ingest {

void write_file_atomically(const std::filesystem::path& path, const std::string& contents) {
  namespace fs = std::filesystem;
  static std::atomic<unsigned> serial{0};
  fs::path temporary = path;
  temporary += ".part" + std::to_string(static_cast<long>(getpid())) + "_" + std::to_string(serial.fetch_add(1));
  std::error_code error;
  {
    std::ofstream file(temporary, std::ios::binary);
    file.write(contents.data(), static_cast<std::streamsize>(contents.size()));
    file.flush();
    if (!file) {
      file.close();
      fs::remove(temporary, error);
      throw InputError(path.string(), "the file cannot be written", "the folder is missing, read-only or full",
                       "choose another output folder");
    }
  }
  fs::rename(temporary, path, error);
  if (error) {
    const std::string why = error.message();
    fs::remove(temporary, error);
    throw InputError(path.string(), "the file cannot be written", why, "choose another output folder");
  }
}

}  // namespace shakebed::ingest
