#include "ingest/frames/png_text.hpp"

#include <cstdint>
#include <fstream>
#include <iterator>

#include "ingest/frames/atomic_file.hpp"

namespace shakebed::ingest {
namespace {

// A PNG file is a signature and chunks: length, kind, content, check sum (ISO/IEC 15948).
constexpr std::string_view signature("\x89PNG\r\n\x1a\n", 8);
constexpr std::size_t head_bytes = 8, sum_bytes = 4, header_chunk = head_bytes + 13 + sum_bytes;
constexpr std::uint32_t longest_text = 65536;
constexpr int most_chunks = 64;

std::uint32_t check_sum(std::string_view bytes) {
  std::uint32_t sum = 0xFFFFFFFFU;
  for (const char byte : bytes) {
    sum ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1U) ^ ((sum & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~sum;
}

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>(value >> shift & 0xFFU);
  return bytes;
}

std::uint32_t number_at(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k) value = value << 8U | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

}  // namespace

void add_png_text(const std::filesystem::path& png, std::string_view keyword, std::string_view text) {
  std::ifstream file(png, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (!bytes.starts_with(signature) || bytes.size() < signature.size() + header_chunk) return;
  std::string chunk = "tEXt";
  chunk.append(keyword).append(1, '\0').append(text);
  const std::string whole =
      big_endian(static_cast<std::uint32_t>(chunk.size() - 4)) + chunk + big_endian(check_sum(chunk));
  write_file_atomically(png, bytes.insert(signature.size() + header_chunk, whole));
}

std::optional<PngText> png_text(const std::filesystem::path& path, std::string_view keyword) {
  std::ifstream file(path, std::ios::binary);
  std::string start(signature.size(), '\0');
  if (!file.read(start.data(), static_cast<std::streamsize>(start.size())) || start != signature) return std::nullopt;
  PngText found;
  for (int chunk = 0; chunk < most_chunks; ++chunk) {
    std::string head(head_bytes, '\0');
    if (!file.read(head.data(), head_bytes)) return std::nullopt;
    const std::uint32_t length = number_at(head, 0);
    const std::string_view kind = std::string_view(head).substr(4);
    if (kind == "IDAT" || kind == "IEND") return std::nullopt;
    if ((kind != "IHDR" && kind != "tEXt") || length > longest_text) {
      if (!file.seekg(static_cast<std::streamoff>(length) + static_cast<std::streamoff>(sum_bytes), std::ios::cur))
        return std::nullopt;
      continue;
    }
    std::string content(length + sum_bytes, '\0');
    if (!file.read(content.data(), static_cast<std::streamsize>(content.size()))) return std::nullopt;
    content.resize(length);
    if (kind == "IHDR" && length >= 8) {
      found.width = static_cast<int>(number_at(content, 0));
      found.height = static_cast<int>(number_at(content, 4));
    } else if (kind == "tEXt" && content.size() > keyword.size() && content.starts_with(keyword) &&
               content[keyword.size()] == '\0') {
      found.text = content.substr(keyword.size() + 1);
      return found;
    }
  }
  return std::nullopt;
}

}  // namespace shakebed::ingest
