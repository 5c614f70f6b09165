// Tables that a run writes: a CSV file and its metadata. The first line of the CSV is its header; its cells are plain
// numbers or words. The metadata file NAME.csv-metadata.json (W3C CSV on the Web [W3C2015]) holds the meaning of the
// columns, their units and notes on the table. numpy.genfromtxt(names=True) and pandas.read_csv read the CSV without
// options.
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/formats/results.hpp"

namespace shakebed::pipelines {

// A number, a count or words, as text. A number that is not finite is an empty cell.
class Cell {
 public:
  Cell(double number);          // NOLINT(google-explicit-constructor): a row is a list of numbers and words
  Cell(std::int64_t count);     // NOLINT(google-explicit-constructor)
  Cell(std::string_view text);  // NOLINT(google-explicit-constructor)
  Cell(const std::string& text) : Cell(std::string_view(text)) {}  // NOLINT(google-explicit-constructor)
  Cell(const char* text) : Cell(std::string_view(text)) {}         // NOLINT(google-explicit-constructor)
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

class Table {
 public:
  Table(std::string meaning, std::vector<StatedColumn> columns)
      : meaning_(std::move(meaning)), columns_(std::move(columns)) {}
  explicit Table(const StatedTable& stated) : Table(stated.meaning, stated.columns) {}

  // What holds for the whole table: note("kernel", {{"kind", "gaussian"}, {"width", 0.5}}).
  void note(std::string_view key, Json value) { notes_[std::string(key)] = std::move(value); }
  // As many cells as there are columns.
  void add(std::vector<Cell> cells);
  std::size_t size() const { return rows_; }

  std::string csv() const;
  Json metadata(std::string_view file_name) const;
  // Both files; for a stage's own output folder. Throws StageError.
  void write(const std::filesystem::path& path) const;
  // Both files, each whole or not at all, for files that lie in OUT itself.
  void write_atomically(const std::filesystem::path& path) const;

 private:
  std::string meaning_;
  std::vector<StatedColumn> columns_;
  Json notes_ = Json::object();
  std::string body_;
  std::size_t rows_ = 0;
};

// An empty cell.
inline constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

// Shorthand for counts of any integer type.
template <class Integer>
Cell count_cell(Integer value) {
  return static_cast<std::int64_t>(value);
}

// Where the metadata of a table lie.
std::filesystem::path metadata_path(const std::filesystem::path& csv);
// The notes of a table that a run wrote; an empty object where the file has no metadata. Throws InputError where they
// cannot be read.
Json table_notes(const std::filesystem::path& csv);

}  // namespace shakebed::pipelines
