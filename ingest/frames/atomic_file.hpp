#pragma once
// Files that appear whole or not at all.

#include <filesystem>
#include <stdexcept>
#include <string>

namespace shakebed::ingest {

// A file that cannot be written: path, reason, what to do.
class OutputError : public std::runtime_error {
 public:
  OutputError(const std::filesystem::path& path, const std::string& why);
};

// Writes `contents` to a temporary file beside `path` and renames it. Throws OutputError when that cannot be done.
void write_file_atomically(const std::filesystem::path& path, const std::string& contents);

}  // namespace shakebed::ingest
