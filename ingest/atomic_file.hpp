#pragma once
// Files that appear whole or not at all.

#include <filesystem>
#include <string>

namespace shakebed::ingest {

// Writes `contents` to a temporary file beside `path` and renames it. Throws InputError when that cannot be done.
void write_file_atomically(const std::filesystem::path& path, const std::string& contents);

}  // namespace shakebed::ingest
