// Files: written whole or not at all, read with errors that name the place, and fingerprints of their bytes.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

struct evp_md_ctx_st;  // of libcrypto

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
  struct Free {
    void operator()(evp_md_ctx_st* context) const;
  };
  std::unique_ptr<evp_md_ctx_st, Free> context_;
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
