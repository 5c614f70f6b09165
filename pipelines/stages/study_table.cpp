#include "pipelines/stages/study_table.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/files.hpp"

namespace shakebed::pipelines {

bool StudyTable::has(const std::string& name) const {
  return std::find(header.begin(), header.end(), name) != header.end();
}

std::size_t StudyTable::column(const std::string& name) const { return csv_column(header, name, file); }

std::optional<double> StudyTable::number(std::size_t row, std::size_t column) const {
  const std::string& text = rows[row][column];
  if (text.empty()) return std::nullopt;
  const std::optional<double> value = number_in(text);
  if (!value) throw InputError(fmt::format("{}: \"{}\" in column \"{}\" is not a number", file, text, header[column]));
  return value;
}

std::optional<double> StudyTable::error(std::size_t row, const std::string& name) const {
  if (!has(name + "_error")) return std::nullopt;
  const auto found = number(row, column(name + "_error"));
  if (found && *found < 0) throw InputError(fmt::format("{}: a standard error of \"{}\" is negative", file, name));
  return found;
}

std::string StudyTable::series(std::size_t row) const {
  return has("series") ? rows[row][column("series")] : std::string();
}

StudyTable read_study_table(const std::filesystem::path& path) {
  StudyTable table;
  table.file = path.string();
  each_csv_line(read_file(path), [&](std::vector<std::string> cells, std::size_t line) {
    if (table.header.empty()) {
      table.header = std::move(cells);
      return;
    }
    if (cells.size() != table.header.size())
      throw InputError(fmt::format("{}:{}: expected {} columns, as in the header, found {}", table.file, line,
                                   table.header.size(), cells.size()));
    table.rows.push_back(std::move(cells));
  });
  if (table.rows.empty()) throw InputError(table.file + ": the table has no rows below its header");
  return table;
}

}  // namespace shakebed::pipelines
