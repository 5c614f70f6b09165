// Text and numbers as the pages for people show them: HTML, SVG and Markdown.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

// Text inside XML and HTML.
std::string escape_markup(std::string_view text);

// The same of text that people write: T_c, ζ_F, a_2 get a subscript, T^2, D^-2 a superscript; names like above_launch
// stay as they are.
std::string prose(std::string_view text);

// A quantity {"value", "std_error", "unit"}, a number or a word as HTML: lengths in mm, the error beside the value.
std::string shown(const Json& quantity);

// "temperature_over_mg" → "temperature over mg".
std::string words(std::string name);

// The first letter (ASCII) as a capital.
std::string capitalized(std::string text);

// 1234567 → "1.2 MB".
std::string size_text(std::uint64_t bytes);

// An SVG file as part of a page: without its prolog, its ids made its own by the number. "" when it is none.
std::string inline_svg(const std::filesystem::path& path, int number);

// A drawn figure with three files. The SVG serves paper, print and browsers without scripts. NAME.plot.json, where it
// exists, holds the numbers for the script that draws it again. NAME.pdf, where it exists, is offered for download. The
// caption is HTML. "" where there is no SVG.
std::string figure_html(const std::filesystem::path& svg, int number, std::string_view caption);

// A row of a table that stacks on a narrow screen: cells (HTML) with the names of their columns.
struct TableCell {
  std::string html, css{};
};
std::string table_row(const std::vector<std::string>& header, const std::vector<TableCell>& cells);
std::string table_head(const std::vector<std::string>& header);

// JSON that may stand inside <script>: no end tag and no comment can begin in it.
std::string script_text(std::string json);

std::string base64(std::string_view bytes);

// A cell of a Markdown table, or a line of text, with nothing in it that Markdown or HTML would take as its own.
std::string markdown(std::string_view text);

}  // namespace shakebed::pipelines
