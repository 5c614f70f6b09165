#include "pipelines/report/sweep_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <stdexcept>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/formats/quantity.hpp"
#include "pipelines/report/report.hpp"
#include "pipelines/runner/sweep_record.hpp"
#include "pipelines/runner/sweep_table.hpp"
#include "pipelines/stages/answer.hpp"
#include "pipelines/stages/figure.hpp"

namespace shakebed::pipelines {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_html_rows = 500, most_markdown_rows = 50;  // all are in sweep.csv
constexpr std::size_t most_series = 6;                                // of one figure: as many colours are told apart

std::optional<double> number_of(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// "/stages/bed/floor/amplitude" → "bed floor amplitude"; or only its last word.
std::string words_of(const std::string& pointer, bool only_last) {
  std::string text;
  for (const std::string& token : split_pointer(pointer)) {
    if (token == "stages" && text.empty()) continue;
    text = only_last || text.empty() ? token : text + " " + token;
  }
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

// The figures of a sweep: every gathered number against the first axis that has numbers, one series for each
// combination of the other axes.
class SweepFigures {
 public:
  SweepFigures(const Plan& plan, const SweepOutcome& sweep)
      : plan_(plan), sweep_(sweep), axes_(plan.sweep->axes), random_(plan.sweep->kind == SweepKind::random) {
    for (along_ = 0; along_ < axes_.size(); ++along_) {
      if (position(sweep.points.front(), true)) break;
    }
  }

  std::vector<fs::path> operator()(const fs::path& folder) {
    std::vector<fs::path> figures;
    if (along_ == axes_.size()) return figures;
    for (std::size_t k = 0; k < sweep_.collected.size(); ++k) {
      const Picture picture = picture_of(k);
      if (picture.series.empty()) continue;
      const std::string name = fmt::format("sweep-{}", k + 1);
      fs::create_directories(folder);
      draw_picture(picture, folder, name);
      figures.push_back(folder / (name + ".svg"));
    }
    return figures;
  }

 private:
  // Where a point lies along the axis; the axis itself must have numbers or quantities with a unit.
  std::optional<double> position(const SweepPoint& point, bool first = false) {
    const Json& at = point.values[along_];
    try {
      if (at.is_number()) return at.get<double>();
      if (!at.is_string()) return std::nullopt;
      const Quantity quantity = parse_quantity(at.get<std::string>());
      if (first && !quantity.has_unit) return std::nullopt;
      if (first) unit_ = si_unit(quantity.dimension);
      return quantity.value;
    } catch (const std::invalid_argument&) {
      return std::nullopt;
    }
  }

  // The values of the other axes.
  std::string label_of(const SweepPoint& point) const {
    std::string label;
    for (std::size_t a = 0; a < axes_.size(); ++a) {
      if (a == along_ || random_) continue;
      const Json& value = point.values[a];
      label += fmt::format("{}{} = {}", label.empty() ? "" : ", ", words_of(axes_[a].pointer, true),
                           value.is_number() ? fmt::format("{:.4g}", value.get<double>()) : value_text(value));
    }
    return label.empty() ? "points" : label;
  }

  // "  [m g D]" of the number that is drawn.
  std::string unit_text(std::size_t k) const {
    const std::string unit = unit_of_result(plan_, sweep_.collected[k]);
    return unit == "1" ? "" : "  [" + unit + "]";
  }

  // Points without one temperature are hollow.
  bool hollow(std::size_t point) const {
    const std::string& verdict = sweep_.table[point + 1].back();
    return sweep_.table.front().back() == verdict_column && !verdict.empty() && !is_one_temperature(verdict);
  }

  // Of the point: two series a label, filled and hollow. None beyond most_series labels.
  Series* series_of(Picture& picture, std::map<std::string, std::size_t>& groups, std::size_t point) const {
    const std::string label = label_of(sweep_.points[point]);
    const auto [group, fresh] = groups.emplace(label, groups.size());
    if (group->second >= most_series) return nullptr;
    if (fresh) {
      const int color = static_cast<int>(group->second);
      picture.series.push_back({label, Series::Style::points, color, {}, {}, {}});
      picture.series.push_back({label + ", not one temperature", Series::Style::points, color, {}, {}, {}, true});
    }
    return &picture.series[2 * group->second + (hollow(point) ? 1 : 0)];
  }

  Picture picture_of(std::size_t k) {
    Picture picture{.x_label = words_of(axes_[along_].pointer, false) + (unit_.empty() ? "" : "  [" + unit_ + "]"),
                    .y_label = words_of(sweep_.collected[k], false) + unit_text(k)};
    const std::size_t column = 3 + axes_.size() + 2 * k;
    std::map<std::string, std::size_t> groups;
    for (std::size_t i = 0; i < sweep_.points.size(); ++i) {
      const std::vector<std::string>& row = sweep_.table[i + 1];
      const std::optional<double> x = position(sweep_.points[i]), y = number_of(row[column]);
      if (!x || !y) continue;
      Series* series = series_of(picture, groups, i);
      if (series == nullptr) continue;
      series->x.push_back(*x), series->y.push_back(*y);
      if (const std::optional<double> error = number_of(row[column + 1])) series->error.push_back(*error);
    }
    for (Series& series : picture.series) {
      if (series.error.size() != series.x.size()) series.error.clear();
    }
    return picture;
  }

  const Plan& plan_;
  const SweepOutcome& sweep_;
  const std::vector<SweepAxis>& axes_;
  bool random_;
  std::size_t along_ = 0;
  std::string unit_;
};

std::string title_of(const Plan& plan) { return plan.report.title.empty() ? plan.name : plan.report.title; }

std::string html_of(const Plan& plan, const SweepOutcome& sweep, const std::vector<fs::path>& figures) {
  std::string out = page_head(title_of(plan));
  for (const std::string& paragraph : plan.report.text) out += fmt::format("<p>{}</p>\n", prose(paragraph));
  if (!sweep.problems.empty()) {
    out += "<div class=\"warnings\"><strong>Points that failed</strong><ul>\n";
    for (const std::string& problem : sweep.problems) out += fmt::format("<li>{}</li>\n", escape_markup(problem));
    out += "</ul></div>\n";
  }
  if (!sweep.verdicts.empty()) {
    out += fmt::format("<p><strong>{}.</strong>", escape_markup(verdicts_text(sweep.verdicts)));
    if (sweep.verdicts.size() > 1 || !is_one_temperature(sweep.verdicts.begin()->first))
      out += " Points without one temperature are drawn hollow.";
    out += "</p>\n";
  }
  if (!sweep.warnings.empty()) {
    out += "<div class=\"warnings\"><strong>Warnings of points</strong><ul>\n";
    for (const std::string& warning : sweep.warnings) out += fmt::format("<li>{}</li>\n", escape_markup(warning));
    out += "</ul></div>\n";
  }
  if (!plan.warnings.empty()) {
    out += "<div class=\"warnings\"><strong>Warnings</strong><ul>\n";
    for (const Warning& warning : plan.warnings)
      out += fmt::format("<li>{}: {}. {}</li>\n", escape_markup(warning.problem.pointer),
                         escape_markup(warning.problem.what), escape_markup(warning.problem.suggestion));
    out += "</ul></div>\n";
  }
  int number = 0;
  for (const fs::path& figure : figures) out += fmt::format("<figure>{}</figure>\n", inline_svg(figure, ++number));
  const std::vector<std::vector<std::string>>& table = sweep.table;
  out += fmt::format("<h2>{} points</h2>\n<div class=\"scroll\"><table>\n", table.size() - 1);
  for (std::size_t i = 0; i < table.size() && i <= most_html_rows; ++i) {
    out += "<tr>";
    for (const std::string& cell : table[i])
      out += (i == 0 ? "<th>" : "<td class=\"number\">") + escape_markup(cell) + (i == 0 ? "</th>" : "</td>");
    out += "</tr>\n";
  }
  out += "</table></div>\n";
  if (table.size() > most_html_rows + 1)
    out += fmt::format("<p>The first {} of them; all are in sweep.csv.</p>\n", most_html_rows);
  return out + "</main>\n</body>\n</html>\n";
}

std::string markdown_of(const Plan& plan, const SweepOutcome& sweep) {
  const std::vector<std::vector<std::string>>& table = sweep.table;
  const std::size_t points = table.size() - 1;
  const auto good = std::count_if(table.begin() + 1, table.end(), [](const auto& row) { return row[2] == "ok"; });
  std::string out = fmt::format("# {}\n\n**{} of {} points are done**\n", markdown(title_of(plan)), good, points);
  if (!sweep.verdicts.empty()) out += fmt::format("\n{}.\n", markdown(verdicts_text(sweep.verdicts)));
  if (!sweep.warnings.empty()) {
    out += "\n## Warnings of points\n\n";
    for (const std::string& warning : sweep.warnings) out += fmt::format("- {}\n", markdown(warning));
  }
  if (!sweep.problems.empty()) {
    out += "\n## Points that failed\n\n";
    for (const std::string& problem : sweep.problems) out += fmt::format("- {}\n", markdown(problem));
  }
  out += "\n## Points\n\n";
  for (std::size_t i = 0; i < table.size() && i <= most_markdown_rows; ++i) {
    for (const std::string& cell : table[i]) out += fmt::format("| {} ", markdown(cell));
    out += "|\n";
    if (i == 0) {
      for (std::size_t k = 0; k < table[i].size(); ++k) out += "|---";
      out += "|\n";
    }
  }
  if (points > most_markdown_rows) out += fmt::format("\nThe first {}; all are in sweep.csv.\n", most_markdown_rows);
  return out;
}

}  // namespace

void write_sweep_pages(const Plan& plan, const SweepOutcome& sweep) {
  write_file_atomically(sweep.out / "summary.md", markdown_of(plan, sweep));
  if (!sweep.complete) return;  // a shard alone has nothing to show yet
  const std::vector<fs::path> figures = SweepFigures(plan, sweep)(sweep.out / "figures");
  write_file_atomically(sweep.out / "report.html", html_of(plan, sweep, figures));
}

}  // namespace shakebed::pipelines
