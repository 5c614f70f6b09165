#include "pipelines/formats/table.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/files.hpp"

namespace shakebed::pipelines {
namespace {

std::string quoted_where_needed(std::string_view text) {
  if (text.find_first_of(",\"\n#") == std::string_view::npos) return std::string(text);
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

}  // namespace

Cell::Cell(double number) : text_(std::isfinite(number) ? number_text(number) : std::string()) {}
Cell::Cell(std::int64_t count) : text_(std::to_string(count)) {}
Cell::Cell(std::string_view text) : text_(quoted_where_needed(text)) {}

void Table::add(std::vector<Cell> cells) {
  assert(cells.size() == columns_.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) body_ += ',';
    body_ += cells[i].text();
  }
  body_ += '\n';
  ++rows_;
}

std::string Table::csv() const {
  std::string header;
  for (const StatedColumn& column : columns_) header += (header.empty() ? "" : ",") + quoted_where_needed(column.name);
  return header + '\n' + body_;
}

Json Table::metadata(std::string_view file_name) const {
  Json columns = Json::array();
  for (const StatedColumn& column : columns_) {
    Json entry{{"name", column.name}, {"titles", column.name}};
    if (!column.meaning.empty()) entry["dc:description"] = column.meaning;
    entry["datatype"] = column.unit.empty() ? "string" : "number";
    if (!column.unit.empty()) entry["schema:unitText"] = column.unit;
    columns.push_back(std::move(entry));
  }
  Json out{{"@context", "http://www.w3.org/ns/csvw"},
           {"url", file_name},
           {"dc:description", meaning_},
           {"tableSchema", Json{{"columns", std::move(columns)}}}};
  if (!notes_.empty()) out["notes"] = Json::array({notes_});
  return out;
}

void Table::write(const std::filesystem::path& path) const {
  write_file(path, csv());
  write_file(metadata_path(path), dump(metadata(path.filename().string())));
}

void Table::write_atomically(const std::filesystem::path& path) const {
  write_file_atomically(path, csv());
  write_file_atomically(metadata_path(path), dump(metadata(path.filename().string())));
}

std::filesystem::path metadata_path(const std::filesystem::path& csv) { return csv.string() + "-metadata.json"; }

Json table_notes(const std::filesystem::path& csv) {
  const std::filesystem::path path = metadata_path(csv);
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return Json::object();
  const Json metadata = read_json(path);
  const Json* notes = find_pointer(metadata, "/notes/0");
  return notes != nullptr && notes->is_object() ? *notes : Json::object();
}

}  // namespace shakebed::pipelines
