#include "pipelines/formats/markup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/plot_data_name.hpp"

namespace shakebed::pipelines {

std::string escape_markup(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        // Control characters are not allowed in XML.
        if (static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t')
          out += ' ';
        else
          out += c;
    }
  }
  return out;
}

std::string prose(std::string_view text) {
  const std::string plain = escape_markup(text);
  const auto letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  const auto alphanumeric = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; };
  const auto greek = [](char c) { return (static_cast<unsigned char>(c) & 0x80) != 0; };
  std::string out;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    std::size_t end = i + 1;
    const char c = plain[i];
    if (c == '_' && i > 0 &&
        (greek(plain[i - 1]) || (letter(plain[i - 1]) && (i == 1 || !alphanumeric(plain[i - 2]))))) {
      while (end < plain.size() && alphanumeric(plain[end])) ++end;
      if (end > i + 1 && (end == plain.size() || plain[end] != '_')) {
        out += "<sub>" + plain.substr(i + 1, end - i - 1) + "</sub>";
        i = end - 1;
        continue;
      }
    } else if (c == '^' && i > 0 && (greek(plain[i - 1]) || alphanumeric(plain[i - 1]))) {
      if (end < plain.size() && plain[end] == '-') ++end;
      while (end < plain.size() && alphanumeric(plain[end])) ++end;
      out += "<sup>" + plain.substr(i + 1, end - i - 1) + "</sup>";
      i = end - 1;
      continue;
    }
    out += c;
  }
  return out;
}

namespace {
void replace_all(std::string& text, std::string_view what, std::string_view with) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += with.size())
    text.replace(at, what.size(), with);
}
}  // namespace

std::string inline_svg(const std::filesystem::path& path, int number) {
  std::string svg = read_file(path);
  const std::size_t begin = svg.find("<svg");
  if (begin == std::string::npos) return "";
  svg.erase(0, begin);
  const std::string prefix = fmt::format("f{}-", number);
  for (const std::string_view quote : {"'", "\""}) {
    replace_all(svg, fmt::format("id={}", quote), fmt::format("id={}{}", quote, prefix));
    replace_all(svg, fmt::format("href={}#", quote), fmt::format("href={}#{}", quote, prefix));
  }
  replace_all(svg, "url(#", "url(#" + prefix);
  svg.replace(0, 4, "<svg class=\"plot\"");
  return svg;
}

std::string script_text(std::string json) {
  replace_all(json, "<", "\\u003c");
  return json;
}

std::string figure_html(const std::filesystem::path& svg, int number, std::string_view caption) {
  const std::string drawing = inline_svg(svg, number);
  if (drawing.empty()) return "";
  std::filesystem::path data = svg, pdf = svg;
  data.replace_extension().concat(plot_data_suffix), pdf.replace_extension(".pdf");
  const bool asked = std::filesystem::exists(data);
  const std::string name = escape_markup(svg.stem().string());
  std::string out = fmt::format("<figure class=\"plot\" data-name=\"{}\">\n<div class=\"drawn{}\">{}</div>\n", name,
                                asked ? "" : " small", drawing);
  if (asked)
    out +=
        fmt::format("<div class=\"asked\"></div>\n<script type=\"application/json\" class=\"plot-data\">{}</script>\n",
                    script_text(read_file(data)));
  out += asked ? "<div class=\"tools\">" : "<div class=\"tools always\">";
  if (std::filesystem::exists(pdf))
    out += fmt::format("<a download=\"{}.pdf\" href=\"data:application/pdf;base64,{}\">PDF</a>", name,
                       base64(read_file(pdf)));
  out += "</div>\n";
  if (!caption.empty()) out += fmt::format("<figcaption>{}</figcaption>\n", caption);
  return out + "</figure>\n";
}

std::string table_head(const std::vector<std::string>& header) {
  std::string out = "<tr>";
  for (const std::string& name : header) out += "<th scope=\"col\">" + name + "</th>";
  return out + "</tr>\n";
}

std::string table_row(const std::vector<std::string>& header, const std::vector<TableCell>& cells) {
  std::string out = "<tr>";
  for (std::size_t i = 0; i < cells.size(); ++i)
    out += fmt::format("<td data-label=\"{}\"{}>{}</td>", i < header.size() ? header[i] : "",
                       cells[i].css.empty() ? "" : fmt::format(" class=\"{}\"", cells[i].css), cells[i].html);
  return out + "</tr>\n";
}

std::string shown(const Json& quantity) {
  if (quantity.is_null()) return "–";
  if (quantity.is_boolean()) return quantity.get<bool>() ? "yes" : "no";
  if (quantity.is_string()) return escape_markup(quantity.get<std::string>());
  if (quantity.is_number()) return fmt::format("{:.5g}", quantity.get<double>());
  if (quantity.is_object() && quantity.contains("value") && quantity["value"].is_null()) return "–";
  if (!quantity.is_object() || !quantity.contains("value") || !quantity["value"].is_number())
    return escape_markup(dump_canonical(quantity));
  double value = quantity["value"].get<double>(), error = stated_error(quantity);
  std::string unit = quantity.value("unit", "");
  if (unit == "m") value *= 1e3, error *= 1e3, unit = "mm";
  if (unit == "m/px") value *= 1e3, error *= 1e3, unit = "mm/px";
  std::string text;
  if (error > 0 && std::abs(value) > 0) {
    const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, 12);
    text = fmt::format("{:.{}f} ± {:.{}f}", value, decimals, error, decimals);
  } else {
    text = fmt::format("{:.5g}", value);
  }
  if (!unit.empty() && unit != "1") text += " " + escape_markup(unit);
  return text + (quantity.value("fixed", false) ? " (fixed)" : "");
}

std::string size_text(std::uint64_t bytes) {
  const auto size = static_cast<double>(bytes);
  return bytes < 1000        ? fmt::format("{} bytes", bytes)
         : bytes < 1'000'000 ? fmt::format("{:.0f} kB", size / 1e3)
                             : fmt::format("{:.1f} MB", size / 1e6);
}

std::string words(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) -> unsigned {
      return i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u;
    };
    const unsigned word = byte(0) << 16 | byte(1) << 8 | byte(2);
    out += digits[word >> 18];
    out += digits[word >> 12 & 63];
    out += i + 1 < bytes.size() ? digits[word >> 6 & 63] : '=';
    out += i + 2 < bytes.size() ? digits[word & 63] : '=';
  }
  return out;
}

std::string capitalized(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

std::string markdown(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\n' || c == '\r')
      out += ' ';
    else if (c == '<')
      out += "&lt;";
    else if (c == '&')
      out += "&amp;";
    else if (std::string_view("|`*_[]\\#").find(c) != std::string_view::npos)
      out += '\\', out += c;
    else
      out += c;
  }
  return out;
}

}  // namespace shakebed::pipelines
