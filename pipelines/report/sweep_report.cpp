#include "pipelines/report/sweep_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/formats/quantity.hpp"
#include "pipelines/report/crate.hpp"
#include "pipelines/report/page.hpp"
#include "pipelines/runner/sweep_record.hpp"
#include "pipelines/runner/sweep_table.hpp"
#include "pipelines/stages/answer.hpp"
#include "pipelines/stages/figure.hpp"

namespace shakebed::pipelines {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_html_rows = 500, most_markdown_rows = 50;  // all are in sweep.csv
constexpr std::size_t most_series = 6;                                // of one figure: as many colours are told apart
constexpr std::size_t longest_label = 60;                             // of an axis of a figure, in characters
constexpr std::size_t most_columns_of_map = 40;

std::optional<double> number_of(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// "/stages/bed/floor/amplitude" → "floor amplitude"; or only its last word. The strength of the shaking by its symbol.
std::string words_of(const std::string& pointer, bool only_last) {
  std::vector<std::string> tokens = split_pointer(pointer);
  if (tokens.size() > 2 && tokens[0] == "stages") tokens.erase(tokens.begin(), tokens.begin() + 2);
  if (tokens.empty()) return "seed";
  if (tokens.back() == "gamma") return "Γ";
  if (only_last) return words(tokens.back());
  std::string text;
  for (const std::string& token : tokens) text += (text.empty() ? "" : " ") + words(token);
  return text;
}

// An axis as people wrote it: in the unit of the recipe.
struct AxisScale {
  std::string unit{};
  double factor = 1;  // SI in one of it
};

// What a collected number is, in the words of its stage, with the stage's id where several have it; its unit for
// people.
struct NumberWords {
  std::string name, unit;
  double factor = 1;  // from the unit in the table
};
NumberWords words_of_number(const Plan& plan, const std::string& pointer) {
  const std::vector<std::string> tokens = split_pointer(pointer);
  const PlannedStage* stage = tokens.empty() ? nullptr : plan.find(tokens.front());
  NumberWords out{words_of(pointer, false), unit_of_result(plan, pointer)};
  // Temperatures by their symbols: their meanings are longer than an axis.
  constexpr std::array<std::pair<std::string_view, std::string_view>, 7> symbols{
      {{"temperature_over_mg", "T/(m g)"},
       {"temperature_x_over_mg", "T_x/(m g)"},
       {"temperature_z_over_mg", "T_z/(m g)"},
       {"temperature", "T"},
       {"temperature_x", "T_x"},
       {"temperature_z", "T_z"},
       {"reduced_temperature", "T/T_c"}}};
  for (const auto& [name, symbol] : symbols)
    if (tokens.size() == 2 && tokens.back() == name) out.name = fmt::format("{} of {}", symbol, tokens.front());
  if (stage != nullptr && stage->results) {
    const std::string own = pointer.substr(1 + escape_pointer_token(tokens.front()).size());
    if (const StatedResult* stated = stage->results->find(own);
        stated != nullptr && !stated->meaning.empty() && stated->meaning.size() <= longest_label)
      out.name = stated->meaning;
  }
  if (out.unit == "m") out.unit = "mm", out.factor = 1e3;
  if (out.unit == "1") out.unit.clear();
  return out;
}

std::string with_unit(const std::string& name, const std::string& unit) {
  return unit.empty() ? name : name + "  [" + unit + "]";
}

// Dark blue to yellow, lightness rising [cividis; Nunez, Anderton and Renslow 2018], with text that stands out from it.
std::string map_colour(double share) {
  constexpr std::array<std::array<double, 3>, 5> stops = {
      {{0, 34, 78}, {59, 73, 108}, {123, 123, 120}, {188, 174, 108}, {254, 232, 56}}};
  const double at = std::clamp(share, 0.0, 1.0) * (stops.size() - 1);
  const std::size_t k = std::min<std::size_t>(stops.size() - 2, static_cast<std::size_t>(at));
  std::array<double, 3> colour{};
  for (std::size_t c = 0; c < 3; ++c)
    colour[c] = stops[k][c] + (at - static_cast<double>(k)) * (stops[k + 1][c] - stops[k][c]);
  // Relative luminance of 0.18: black and white text have the same contrast, 4.6, there.
  const auto linear = [](double v) { return std::pow(v / 255, 2.2); };
  const double light = 0.2126 * linear(colour[0]) + 0.7152 * linear(colour[1]) + 0.0722 * linear(colour[2]);
  return fmt::format("background:rgb({:.0f} {:.0f} {:.0f});color:{}", colour[0], colour[1], colour[2],
                     light > 0.18 ? "#000" : "#fff");
}

// Ends of the range of an answer, which its temperature is drawn with.
constexpr std::string_view low_end = "/interval/low", high_end = "/interval/high";

// The figures of a sweep: every gathered number against the first axis that has numbers, one series for each
// combination of the other axes.
class SweepFigures {
 public:
  SweepFigures(const Plan& plan, const SweepOutcome& sweep)
      : plan_(plan), sweep_(sweep), axes_(plan.sweep->axes), random_(plan.sweep->kind == SweepKind::random) {
    for (std::size_t a = 0; a < axes_.size(); ++a) scales_.push_back(scale_of(a));
    while (along_ < axes_.size() && !place(sweep.points.front(), along_)) ++along_;
  }

  // "floor amplitude  [mm]".
  std::string axis_label(std::size_t axis) const {
    return with_unit(words_of(axes_[axis].pointer, false), scales_[axis].unit);
  }

  // A number over two parameters, replicas averaged; "" where it is not a grid of two.
  std::string map_html(std::size_t k) const {
    if (is_end_of_range(k) || random_ || axes_.size() != 2 || !place(sweep_.points.front(), 0) ||
        !place(sweep_.points.front(), 1))
      return "";
    struct Cell {
      double sum = 0;
      int count = 0;
      bool hollow = false;
    };
    std::map<double, std::map<double, Cell>> rows;  // by the second axis, then by the first
    std::set<double> columns;
    const std::size_t column = 3 + axes_.size() + 2 * k;
    for (std::size_t i = 0; i < sweep_.points.size(); ++i) {
      const auto x = place(sweep_.points[i], 0), y = place(sweep_.points[i], 1),
                 value = number_of(sweep_.table[i + 1][column]);
      if (!x || !y) continue;
      columns.insert(*x);
      Cell& cell = rows[*y][*x];
      if (value) cell.sum += *value, ++cell.count;
      cell.hollow = cell.hollow || hollow(i, k);
    }
    if (columns.size() < 2 || rows.size() < 2 || columns.size() > most_columns_of_map) return "";
    double low = INFINITY, high = -INFINITY;
    for (const auto& [ignored, row] : rows) {
      for (const auto& [ignored_too, cell] : row) {
        if (cell.count > 0) low = std::min(low, cell.sum / cell.count), high = std::max(high, cell.sum / cell.count);
      }
    }
    const NumberWords number = words_of_number(plan_, sweep_.collected[k]);
    std::string out =
        fmt::format("<h3>{}</h3>\n<div class=\"scroll\"><table class=\"map\">\n<tr><th>{} ↓ {} →</th>",
                    prose(with_unit(number.name, number.unit)), prose(axis_label(1)), prose(axis_label(0)));
    for (const double x : columns) out += fmt::format("<th scope=\"col\">{:.4g}</th>", x);
    out += "</tr>\n";
    for (const auto& [y, row] : rows) {
      out += fmt::format("<tr><th scope=\"row\">{:.4g}</th>", y);
      for (const double x : columns) {
        const auto cell = row.find(x);
        if (cell == row.end() || cell->second.count == 0) {
          out += "<td>–</td>";
          continue;
        }
        const double value = cell->second.sum / cell->second.count,
                     share = high > low ? (value - low) / (high - low) : 0.5;
        out += fmt::format("<td style=\"{}\">{:.3g}{}</td>", map_colour(share), number.factor * value,
                           cell->second.hollow ? " ○" : "");
      }
      out += "</tr>\n";
    }
    return out + "</table></div>\n";
  }

  std::vector<fs::path> operator()(const fs::path& folder) {
    std::vector<fs::path> figures;
    if (along_ == axes_.size()) return figures;
    Drawings drawings(folder);
    for (std::size_t k = 0; k < sweep_.collected.size(); ++k) {
      if (is_end_of_range(k)) continue;
      const Picture picture = picture_of(k);
      if (picture.series.empty()) continue;
      const std::string name = fmt::format("sweep-{}", k + 1);
      fs::create_directories(folder);
      drawings.add(picture, name);
      figures.push_back(folder / (name + ".svg"));
    }
    drawings.draw();
    return figures;
  }

 private:
  // Where a point lies along an axis, in the unit of the recipe; nothing where the value is no number.
  std::optional<double> place(const SweepPoint& point, std::size_t axis) const {
    const Json& at = point.values[axis];
    try {
      if (at.is_number()) return at.get<double>() / scales_[axis].factor;
      if (at.is_string()) return parse_quantity(at.get<std::string>()).value / scales_[axis].factor;
    } catch (const std::invalid_argument&) {}
    return std::nullopt;
  }

  // The unit of the first value that has one.
  AxisScale scale_of(std::size_t axis) const {
    for (const SweepPoint& point : sweep_.points) {
      if (!point.values[axis].is_string()) continue;
      const std::string text = point.values[axis].get<std::string>();
      const std::size_t unit = text.find_first_not_of("+-0123456789.eE ");
      try {
        if (unit != std::string::npos && parse_quantity(text).has_unit)
          return {text.substr(unit), parse_quantity("1 " + text.substr(unit)).value};
      } catch (const std::invalid_argument&) {}
    }
    return {};
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

  // The collected number that belongs to the same answer as number k, by how its pointer ends; nothing when there is
  // none.
  std::optional<std::size_t> of_same_answer(std::size_t k, std::string_view end) const {
    const std::string& pointer = sweep_.collected[k];
    for (const PlannedStage& stage : plan_.stages) {
      const std::string answer = fmt::format("/{}{}", stage.id, stage.row->answer);
      if (stage.row->answer.empty() || !pointer.starts_with(answer + "/")) continue;
      const auto found = std::find(sweep_.collected.begin(), sweep_.collected.end(), answer + std::string(end));
      if (found != sweep_.collected.end()) return static_cast<std::size_t>(found - sweep_.collected.begin());
    }
    return std::nullopt;
  }

  // Drawn with the temperature, not by themselves.
  bool is_end_of_range(std::size_t k) const {
    return of_same_answer(k, low_end) == k || of_same_answer(k, high_end) == k;
  }

  bool is_temperature_of_answer(std::size_t k) const {
    return std::any_of(plan_.stages.begin(), plan_.stages.end(), [&](const PlannedStage& stage) {
      const std::string temperature = fmt::format("/{}{}/temperature", stage.id, stage.row->answer);
      return !stage.row->answer.empty() &&
             (sweep_.collected[k] == temperature || sweep_.collected[k] == temperature + "_over_mg");
    });
  }

  // The temperature of a point that has no single one.
  bool hollow(std::size_t point, std::size_t k) const {
    const std::string& verdict = sweep_.table[point + 1].back();
    return sweep_.table.front().back() == verdict_column && !verdict.empty() && !is_one_temperature(verdict) &&
           is_temperature_of_answer(k);
  }

  std::optional<double> cell_of(std::size_t point, std::size_t k, bool error) const {
    return number_of(sweep_.table[point + 1][3 + axes_.size() + 2 * k + (error ? 1 : 0)]);
  }

  // The standard error; of the middle of a range, half the range.
  std::optional<double> error_of(std::size_t point, std::size_t k) const {
    if (const auto stated = cell_of(point, k, true)) return stated;
    const auto low = of_same_answer(k, low_end), high = of_same_answer(k, high_end);
    if (!hollow(point, k) || !low || !high || sweep_.collected[k].ends_with("_over_mg")) return std::nullopt;
    const auto from = cell_of(point, *low, false), to = cell_of(point, *high, false);
    return from && to ? std::optional((*to - *from) / 2) : std::nullopt;
  }

  // Of the point: two series a label, filled and hollow. None beyond most_series labels.
  Series* series_of(Picture& picture, std::map<std::string, std::size_t>& groups, std::size_t point,
                    std::size_t k) const {
    const std::string label = label_of(sweep_.points[point]);
    const auto [group, fresh] = groups.emplace(label, groups.size());
    if (group->second >= most_series) return nullptr;
    if (fresh) {
      const int color = static_cast<int>(group->second);
      picture.series.push_back({label, Series::Style::points, color, {}, {}, {}});
      picture.series.push_back({label + ", no single temperature", Series::Style::points, color, {}, {}, {}, true});
    }
    return &picture.series[2 * group->second + (hollow(point, k) ? 1 : 0)];
  }

  Picture picture_of(std::size_t k) {
    const NumberWords number = words_of_number(plan_, sweep_.collected[k]);
    Picture picture{.x_label = axis_label(along_), .y_label = with_unit(number.name, number.unit)};
    std::map<std::string, std::size_t> groups;
    for (std::size_t i = 0; i < sweep_.points.size(); ++i) {
      const std::optional<double> x = place(sweep_.points[i], along_), y = cell_of(i, k, false);
      if (!x || !y) continue;
      Series* series = series_of(picture, groups, i, k);
      if (series == nullptr) continue;
      series->x.push_back(*x), series->y.push_back(number.factor * *y);
      if (const std::optional<double> error = error_of(i, k)) series->error.push_back(number.factor * *error);
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
  std::vector<AxisScale> scales_;
  std::size_t along_ = 0;
};

std::string title_of(const Plan& plan) { return plan.report.title.empty() ? plan.name : plan.report.title; }

// The page of a sweep: what the points say, figures, maps, the table of points.
class SweepPage {
 public:
  SweepPage(const Plan& plan, const SweepOutcome& sweep) : plan_(plan), sweep_(sweep), figures_(plan, sweep) {}

  std::string operator()() {
    std::string out = page_head(title_of(plan_)) + answer();
    int number = 0;
    std::size_t k = 0;
    for (const fs::path& figure : figures_(sweep_.out / "figures"))
      out += figure_html(figure, ++number,
                         ++k == 1 ? "Each number against the first parameter; error bars: one standard error, or the "
                                    "whole range where there is no single temperature."
                                  : "");
    out += warnings() + maps() + points();
    for (const std::string& paragraph : plan_.report.text) out += fmt::format("<p>{}</p>\n", prose(paragraph));
    if (plan_.report.text.empty() && !plan_.description.empty())
      out += fmt::format("<p>{}</p>\n", escape_markup(plan_.description));
    return out + page_tail();
  }

 private:
  std::string answer() const {
    const std::size_t points = sweep_.table.size() - 1;
    const auto good = static_cast<std::size_t>(
        std::count_if(sweep_.table.begin() + 1, sweep_.table.end(), [](const auto& row) { return row[2] == "ok"; }));
    std::string out = fmt::format(
        "<section class=\"answer {}\" aria-label=\"the answer\">\n<p class=\"headline\">{} of {} points are done</p>\n",
        good == points ? "good-answer" : "bad-answer", good, points);
    if (!sweep_.verdicts.empty()) {
      out += fmt::format("<p><strong>{}.</strong>", escape_markup(verdicts_text(sweep_.verdicts)));
      if (sweep_.verdicts.size() > 1 || !is_one_temperature(sweep_.verdicts.begin()->first))
        out += " Hollow symbols (○ in maps) are points without a single temperature.";
      out += "</p>\n";
    }
    return out + "</section>\n";
  }

  std::string warnings() const {
    std::string out;
    const auto group = [&](const char* heading, const std::vector<std::string>& sentences) {
      if (sentences.empty()) return;
      out += fmt::format("<details><summary>{}: {}</summary>", heading, sentences.size());
      for (const std::string& sentence : sentences) out += fmt::format("<p>{}</p>\n", prose(sentence));
      out += "</details>\n";
    };
    std::vector<std::string> of_recipe;
    for (const Warning& warning : plan_.warnings)
      of_recipe.push_back(
          fmt::format("{}: {}. {}", warning.problem.pointer, warning.problem.what, warning.problem.suggestion));
    group("Points that failed", sweep_.problems);
    group("Warnings of points", sweep_.warnings);
    group("Warnings of the recipe", of_recipe);
    return out.empty() ? out : "<section class=\"warnings\" aria-label=\"warnings\">\n" + out + "</section>\n";
  }

  std::string maps() const {
    std::string out;
    for (std::size_t k = 0; k < sweep_.collected.size(); ++k) out += figures_.map_html(k);
    return out.empty() ? out : "<h2>Maps over both parameters</h2>\n" + out;
  }

  bool has_verdicts() const { return sweep_.table.front().back() == verdict_column; }
  bool has_replicas() const {
    return std::any_of(sweep_.points.begin(), sweep_.points.end(), [](const SweepPoint& p) { return p.replica > 0; });
  }

  std::vector<std::string> header() const {
    std::vector<std::string> out{"point"};
    if (has_replicas()) out.emplace_back("replica");
    out.emplace_back("status");
    for (std::size_t a = 0; a < plan_.sweep->axes.size(); ++a)
      out.push_back(prose(words_of(plan_.sweep->axes[a].pointer, false)));
    for (const std::string& pointer : sweep_.collected) {
      const NumberWords number = words_of_number(plan_, pointer);
      out.push_back(prose(with_unit(number.name, number.unit)));
    }
    if (has_verdicts()) out.emplace_back("verdict");
    return out;
  }

  // A point, with the page of its own where it has one.
  std::string row(std::size_t i, const std::vector<std::string>& head) const {
    const std::vector<std::string>& cells = sweep_.table[i + 1];
    const std::string own = "points/" + cells[0] + "/report.html";
    std::vector<TableCell> out;
    out.push_back(
        {fs::exists(sweep_.out / own) ? fmt::format("<a href=\"{}\">{}</a>", own, cells[0]) : escape_markup(cells[0])});
    if (has_replicas()) out.push_back({cells[1], "number"});
    out.push_back({escape_markup(cells[2]), cells[2] == "ok" ? "good" : "bad"});
    std::size_t c = 3;
    for (; c < 3 + plan_.sweep->axes.size(); ++c) {
      const auto plain = number_of(cells[c]);
      out.push_back({plain ? fmt::format("{:.6g}", *plain) : escape_markup(cells[c]), "number"});
    }
    for (const std::string& pointer : sweep_.collected) {
      const double factor = words_of_number(plan_, pointer).factor;
      const auto value = number_of(cells[c]), error = number_of(cells[c + 1]);
      out.push_back({!value ? "–" : quantity_cell(factor * *value, factor * error.value_or(0)), "number"});
      c += 2;
    }
    if (has_verdicts()) out.push_back({escape_markup(cells[c]), is_one_temperature(cells[c]) ? "good" : "caution"});
    return table_row(head, out);
  }

  static std::string quantity_cell(double value, double error) { return shown(quantity_json(value, "1", error)); }

  std::string points() const {
    const std::vector<std::string> head = header();
    const std::size_t points = sweep_.table.size() - 1;
    std::string out = fmt::format("<h2>{} points</h2>\n<div class=\"scroll\"><table class=\"sortable\">\n", points) +
                      table_head(head);
    for (std::size_t i = 0; i < points && i < most_html_rows; ++i) out += row(i, head);
    out += "</table></div>\n";
    if (points > most_html_rows)
      out += fmt::format("<p>Only the first {} points are shown; sweep.csv has all.</p>\n", most_html_rows);
    return out;
  }

  const Plan& plan_;
  const SweepOutcome& sweep_;
  SweepFigures figures_;
};

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
  if (points > most_markdown_rows)
    out += fmt::format("\nOnly the first {} points are shown; sweep.csv has all.\n", most_markdown_rows);
  return out;
}

}  // namespace

void write_sweep_pages(const Plan& plan, const SweepOutcome& sweep) {
  write_file_atomically(sweep.out / "summary.md", markdown_of(plan, sweep));
  if (!sweep.complete) return;  // a shard alone has nothing to show yet
  write_file_atomically(sweep.out / "report.html", SweepPage(plan, sweep)());
  write_file_atomically(sweep.out / crate_name, dump(crate_json(plan, sweep)));
}

}  // namespace shakebed::pipelines
