// The table.csv of a study stage, or a CSV file of the same form: # comments, a header, rows of numbers. The first
// column may be "series"; "<name>_error" is the error of the column <name>.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace shakebed::pipelines {

struct StudyTable {
  std::string file;  // for messages
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;  // as many cells as the header

  bool has(const std::string& name) const;
  std::size_t column(const std::string& name) const;  // throws InputError, with the nearest name
  // Empty cells: nothing. Throws InputError for what is neither empty nor a number.
  std::optional<double> number(std::size_t row, std::size_t column) const;
  // That of "<name>_error", nothing where there is no such column.
  std::optional<double> error(std::size_t row, const std::string& name) const;
  std::string series(std::size_t row) const;  // "" without such a column
};

StudyTable read_study_table(const std::filesystem::path& path);  // throws InputError

}  // namespace shakebed::pipelines
