// What the page shows of a study: its table, to be sorted and filtered.
#include <fmt/format.h>

#include <vector>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/study.hpp"

namespace shakebed::pipelines {
namespace {

constexpr std::size_t most_study_rows = 300;  // all are in table.csv

// A cell with five digits; what the table holds exactly is sorted by.
TableCell study_cell(const std::string& text) {
  const auto value = number_in(text);
  if (value) return {fmt::format("{:.5g}", *value), "number"};
  return {escape_markup(text.empty() ? "–" : text)};
}

std::string study_html(const FinishedStage& stage, int&) {
  if (!stage.files.has("table.csv")) return "";
  std::vector<std::string> head;
  std::string rows;
  std::size_t number = 0;
  each_csv_line(read_file(stage.files.file("table.csv")), [&](const std::vector<std::string>& cells, std::size_t) {
    if (head.empty()) {
      for (const std::string& name : cells) head.push_back(escape_markup(words(name)));
      return;
    }
    if (++number > most_study_rows) return;
    std::vector<TableCell> row;
    for (const std::string& cell : cells) row.push_back(study_cell(cell));
    rows += table_row(head, row);
  });
  if (rows.empty()) return "";
  const std::string more =
      number > most_study_rows
          ? fmt::format("<p>The first {} of {} rows; all are in table.csv.</p>\n", most_study_rows, number)
          : "";
  return fmt::format(
      "<details><summary>{}: {} rows, which can be sorted and filtered</summary>\n<div class=\"scroll\"><table "
      "class=\"sortable\">\n{}{}</table></div>\n{}</details>\n",
      escape_markup(stage.files.id), number, table_head(head), rows, more);
}

}  // namespace

StagePages study_pages() { return {.sections = {{ReportPlace::maps, "Tables of the studies", study_html}}}; }

}  // namespace shakebed::pipelines
