// Files: written whole or not at all, read with errors that name the place, and fingerprints of their bytes.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace shakebed::pipelines {

// The bytes of a file. Throws InputError.
std::string read_file(const std::filesystem::path& path);
// Writes beside and renames: whoever reads sees the old file or the new one. Throws StageError (disk full, no
// permission).
void write_file_atomically(const std::filesystem::path& path, std::string_view text);
// Writes, checks and closes. For files in a stage's own output folder, which is renamed as a whole. Throws StageError.
void write_file(const std::filesystem::path& path, std::string_view text);

// --- fingerprints
// SHA-256 (FIPS 180-4) as 64 hexadecimal digits.
class Sha256 {
 public:
  Sha256();
  void update(std::string_view bytes);
  std::string hex();  // ends it

 private:
  void block(const unsigned char* bytes);
  std::array<std::uint32_t, 8> state_;
  std::array<unsigned char, 64> buffer_{};
  std::size_t buffered_ = 0;
  std::uint64_t length_ = 0;
};
std::string sha256(std::string_view bytes);
std::string sha256_of_file(const std::filesystem::path& path);
// XXH3, 128 bits, 32 hexadecimal digits: fast, for the cache.
std::string fast_hash(std::string_view bytes);
std::string fast_hash_of_file(const std::filesystem::path& path);

// --- zstd
std::string compress(std::string_view bytes, int level = 3);
// Throws InputError with `name` when the bytes are no zstd frame.
std::string decompress(std::string_view bytes, const std::string& name);

}  // namespace shakebed::pipelines
