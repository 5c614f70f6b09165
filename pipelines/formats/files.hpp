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

// --- the profile format: '#' lines, then height,number_density,std_error,area_fraction,samples
// Heights in D, densities n D^2; std_error < 0 is never written, an unknown one is left empty.
struct ProfileTable {
  std::vector<std::string> comments;  // without the '#'
  std::string note;                   // which of several densities was read; empty where there was one
  std::vector<double> height;         // bin centres, rising [D]
  std::vector<double> number_density, std_error, area_fraction;
  std::vector<double> samples;  // disk positions that fell into the bin
  std::size_t size() const { return height.size(); }
  // The value of a comment line "key: value", "" if none.
  std::string comment(std::string_view key) const;
};
std::string profile_text(const ProfileTable& profile);
void write_profile_csv(const std::filesystem::path& path, const ProfileTable& profile);
// Reads what write_profile_csv writes, and what people have: any CSV with a header that names at least height (or z)
// and number_density (or phi, density), comma, semicolon, tab or blank separated; std_error, area_fraction and samples
// are optional, a missing area_fraction is pi/4 phi. Rows are sorted by height. Throws InputError naming the line.
ProfileTable read_profile_csv(const std::filesystem::path& path);

}  // namespace shakebed::pipelines
