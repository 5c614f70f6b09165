#include "pipelines/report/page.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <string_view>

#include "pipelines/formats/embedded.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/runner/manifest.hpp"

namespace shakebed::pipelines {
namespace {

std::string_view page_file(std::string_view name) {
  const EmbeddedFile* file = find_embedded(name);
  if (file == nullptr) throw std::logic_error(fmt::format("{} is not part of the program", name));
  return file->text;
}

}  // namespace

std::string page_head(const std::string& title) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n"
      // The page loads nothing: a browser would refuse.
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; "
      "script-src "
      "'unsafe-inline'; img-src data:\">\n"
      "<meta name=\"generator\" content=\"shakebed {}\">\n<link rel=\"icon\" "
      "href=\"data:,\">\n<title>{}</title>\n<style>\n{}</style>\n</head>\n<body>\n<main>\n<h1>{}</h1>\n",
      program_version(), escape_markup(title), page_file("page/style.css"), prose(title));
}

std::string page_tail() {
  std::string out = "</main>\n<script>\n";
  for (const char* name : {"page/shared.js", "page/plots.js", "page/tables.js", "page/film.js", "page/bed.js"})
    out += page_file(name);
  return out + "</script>\n</body>\n</html>\n";
}

}  // namespace shakebed::pipelines
