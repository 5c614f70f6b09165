#include "pipelines/stages/study_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "pipelines/config.hpp"
#include "pipelines/errors.hpp"
#include "pipelines/files.hpp"

namespace shakebed::pipelines {

bool StudyTable::has(const std::string& name) const {
  return std::find(header.begin(), header.end(), name) != header.end();
}

std::size_t StudyTable::column(const std::string& name) const {
  const auto found = std::find(header.begin(), header.end(), name);
  if (found == header.end()) {
    const std::string nearest = nearest_name(name, header);
    throw InputError(fmt::format("{}: has no column \"{}\"; {}", file, name,
                                 nearest.empty() ? fmt::format("there are {}", fmt::join(header, ", "))
                                                 : fmt::format("did you mean \"{}\"?", nearest)));
  }
  return static_cast<std::size_t>(found - header.begin());
}

std::optional<double> StudyTable::number(std::size_t row, std::size_t column) const {
  const std::string& text = rows[row][column];
  if (text.empty()) return std::nullopt;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    throw InputError(fmt::format("{}: \"{}\" in column \"{}\" is no number", file, text, header[column]));
  return value;
}

std::optional<double> StudyTable::error(std::size_t row, const std::string& name) const {
  if (!has(name + "_error")) return std::nullopt;
  const auto found = number(row, column(name + "_error"));
  if (found && *found < 0) throw InputError(fmt::format("{}: an error of \"{}\" is negative", file, name));
  return found;
}

std::string StudyTable::series(std::size_t row) const {
  return has("series") ? rows[row][column("series")] : std::string();
}

StudyTable read_study_table(const std::filesystem::path& path) {
  StudyTable table;
  table.file = path.string();
  const std::string text = read_file(path);
  std::size_t begin = 0, number = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = std::string_view(text).substr(begin, end - begin);
    begin = end + 1;
    ++number;
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty() || line.front() == '#') continue;
    auto cells = split_csv_line(line);
    if (table.header.empty()) {
      table.header = std::move(cells);
      continue;
    }
    if (cells.size() != table.header.size())
      throw InputError(fmt::format("{}:{}: expected {} columns, as in the header, found {}", table.file, number,
                                   table.header.size(), cells.size()));
    table.rows.push_back(std::move(cells));
  }
  if (table.rows.empty()) throw InputError(table.file + ": holds no rows");
  return table;
}

}  // namespace shakebed::pipelines
