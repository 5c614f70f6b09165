#pragma once
// A line of text inside a PNG file, beside its pixels: what is known of the picture stays with it when it is copied.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace shakebed::ingest {

// Puts a text under this keyword (1 to 79 Latin letters) into a PNG file, which is written whole again. Does nothing to
// other files. Throws OutputError (atomic_file.hpp) when it cannot be written.
void add_png_text(const std::filesystem::path& png, std::string_view keyword, std::string_view text);

struct PngText {
  int width = 0, height = 0;  // of the picture that holds it, px
  std::string text;
};
// Nothing where the file is no PNG, cannot be read, or holds no such text before its pixels.
std::optional<PngText> png_text(const std::filesystem::path& path, std::string_view keyword);

}  // namespace shakebed::ingest
