#include "tests/bench/program/document.hpp"

#include <fmt/format.h>
#include <sys/utsname.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <thread>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/formats/process.hpp"
#include "pipelines/report/page.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/stages/plot_data.hpp"

namespace shakebed::pipelines::bench {

namespace fs = std::filesystem;

namespace {

// The text after "key   : " in a file of the kernel's.
std::string kernel_says(const char* path, const std::string& key) {
  std::ifstream stream(path);
  std::string line;
  while (std::getline(stream, line)) {
    if (!line.starts_with(key)) continue;
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) continue;
    const std::size_t begin = line.find_first_not_of(" \t", colon + 1);
    return begin == std::string::npos ? "" : line.substr(begin);
  }
  return "unknown";
}

std::string cell_text(const Json& cell) {
  if (cell.is_null()) return "-";
  if (cell.is_string()) return cell.get<std::string>();
  if (cell.is_boolean()) return cell.get<bool>() ? "yes" : "no";
  if (cell.is_number_integer()) return fmt::format("{}", cell.get<std::int64_t>());
  return fmt::format("{:.4g}", cell.get<double>());
}

// Characters, not bytes.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

std::string table_text(const Table& table) {
  std::vector<std::vector<std::string>> lines{table.header};
  for (const auto& row : table.rows) {
    std::vector<std::string> line;
    for (const Json& cell : row) line.push_back(cell_text(cell));
    lines.push_back(std::move(line));
  }
  std::vector<std::size_t> widths;
  for (const auto& line : lines) {
    widths.resize(std::max(widths.size(), line.size()));
    for (std::size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], width_of(line[i]));
  }
  std::string out = table.title + "\n";
  for (const auto& line : lines) {
    std::string text = " ";
    for (std::size_t i = 0; i < line.size(); ++i) {
      text += " " + line[i];
      if (i + 1 < line.size()) text += std::string(widths[i] - width_of(line[i]) + 1, ' ');
    }
    out += text + "\n";
  }
  if (!table.note.empty()) out += "  (" + table.note + ")\n";
  return out;
}

Table hard_case_table(const std::vector<HardCase>& cases) {
  Table table{
      "Hard cases", "", {"case", "status", "error", "limit", "unit", "CPU s", "limit s", "verdict", "note"}, {}};
  for (const HardCase& one : cases) {
    table.rows.push_back({one.name, one.status, one.error ? Json(*one.error) : Json(),
                          one.error ? Json(one.limit) : Json(), one.unit, one.seconds, one.time_limit,
                          one.pass ? "pass" : "FAIL", one.note});
  }
  return table;
}

Table digits_table(const Json& digits) {
  Table table{"Digits kept, against high precision",
              digits.value("note", ""),
              {"kernel", "inputs", "error relative to", "digits kept, worst", "median", "worst case"},
              {}};
  for (const Json& row : digits["rows"]) {
    table.rows.push_back({row["kernel"], row["inputs"], row["relative_to"], row["worst_digits"], row["median_digits"],
                          row["worst_case"]});
  }
  return table;
}

std::string html_table(const Table& table) {
  std::string out =
      fmt::format("<h3>{}</h3>\n<div class=\"scroll\"><table class=\"sortable\">\n<tr>", escape_markup(table.title));
  for (const std::string& cell : table.header) out += fmt::format("<th>{}</th>", escape_markup(cell));
  out += "</tr>\n";
  for (const auto& row : table.rows) {
    out += "<tr>";
    for (const Json& cell : row) {
      const std::string text = cell_text(cell);
      const char* css = cell.is_number() ? "number" : text == "pass" ? "good" : text == "FAIL" ? "bad" : "";
      out += fmt::format("<td class=\"{}\">{}</td>", css, escape_markup(text));
    }
    out += "</tr>\n";
  }
  out += "</table></div>\n";
  if (!table.note.empty()) out += fmt::format("<p class=\"soft\">{}</p>\n", escape_markup(table.note));
  return out;
}

// --- figures

// gnuplot strings in single quotes: in double ones gnuplot runs what stands between backquotes. An apostrophe becomes a
// typographic one, since gnuplot versions differ about quotes within quotes.
std::string gnuplot_text(std::string_view text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'')
      out += "\u2019";
    else
      out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "'";
}

bool drawable(double cost, double error) {
  return std::isfinite(cost) && std::isfinite(error) && cost > 0 && error > 0;
}

// A logarithmic axis with three to nine numbers on it: powers of ten, every so many of them, or round numbers between
// them, as many as the range needs.
std::string logarithmic_axis(std::string_view axis, double low, double high) {
  const int first = static_cast<int>(std::floor(std::log10(low))),
            last = static_cast<int>(std::floor(std::log10(high)));
  const auto numbers = [&](const std::vector<double>& digits, int every) {
    std::vector<double> all;
    for (int power = first; power <= last; ++power) {
      if (power % every != 0) continue;
      for (const double digit : digits) {
        const double value = digit * std::pow(10, power);
        if (value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9)) all.push_back(value);
      }
    }
    return all;
  };
  std::vector<double> ticks;
  for (const auto& digits : {std::vector<double>{1}, {1, 2, 5}, {1, 1.5, 2, 3, 4, 5, 6, 8}}) {
    ticks = numbers(digits, 1);
    if (ticks.size() >= 3) break;
  }
  if (ticks.size() < 3) {  // less than a third of a decade: even steps
    const double step = std::pow(10, std::floor(std::log10((high - low) / 3)));
    ticks.clear();
    const double wide = (high - low) / step > 8 ? 2 * step : step;
    for (double value = std::ceil(low / wide) * wide; value <= high; value += wide) ticks.push_back(value);
  }
  for (int every = 2; ticks.size() > 9 && every < 50; ++every) ticks = numbers({1}, every);
  std::string text;
  for (const double value : ticks) text += fmt::format("{}'{:.4g}' {}", text.empty() ? "" : ", ", value, value);
  return fmt::format("set {0}range [{1}:{2}]\nset {0}tics ({3})\n", axis, low, high, text);
}

// The data and the plot command of a figure, block by block, and the range of what is drawn.
class Drawing {
 public:
  explicit Drawing(const Figure& figure) : figure_(figure) {
    if (figure.pareto) add_front();
    for (const Curve& curve : figure.curves) add_curve(curve);
    for (const Curve& curve : figure.curves) mark_default(curve);
    if (blocks_ == 0) throw StageError(fmt::format("there is nothing to draw in {}.svg", figure.name));
  }
  const std::string& data() const { return data_; }
  std::string script() const {
    const double margin = std::max(1.6, std::pow(worst_ / best_, 0.05));  // markers whole, over many decades too
    // The label's empty second line keeps it off the key.
    return "set encoding utf8\nset terminal svg size 860,620 noenhanced font 'Helvetica,16' background '#ffffff' "
           "linewidth 1.4\n" +
           fmt::format("set output {}\nset xlabel {}.\"\\n\" offset 0,0.6\nset ylabel {}\nset title {} font ',15'\n",
                       gnuplot_text(figure_.name + ".svg"), gnuplot_text(figure_.cost_label),
                       gnuplot_text(figure_.error_label), gnuplot_text(figure_.title)) +
           "set logscale xy\nset border lc rgb '#404040'\nset tics nomirror\nset grid lc rgb "
           "'#dddddd' "
           "lt 1 lw 0.6\nset key below horizontal Left reverse maxcols 3 spacing 1.2 samplen 2 font ',12'\n" +
           logarithmic_axis("x", cheapest_ / 1.3, dearest_ * 1.3) +
           logarithmic_axis("y", best_ / margin, worst_ * margin) + plot_ + "\n";
  }

 private:
  void begin_block(const std::string& label) {
    data_ += "# " + label + "\n";
    plot_ += plot_.empty() ? "plot " : ", \\\n     ";
    plot_ += fmt::format("{} index {} using 1:2 ", gnuplot_text(figure_.name + ".dat"), blocks_++);
  }

  // As a staircase: what is to be had for at most this cost.
  void add_front() {
    const auto front = pareto_front(figure_);
    if (front.size() < 2) return;
    begin_block("Pareto front");
    for (std::size_t i = 0; i < front.size(); ++i) {
      if (i > 0) data_ += fmt::format("{} {}\n", front[i].cost, front[i - 1].error);
      data_ += fmt::format("{} {}\n", front[i].cost, front[i].error);
    }
    data_ += "\n\n";
    plot_ += "with lines lw 7 lc rgb '#e3e3e3' title 'Pareto front'";
  }

  void add_curve(const Curve& curve) {
    // Colours that stay apart for every kind of colour vision [Okabe and Ito 2008].
    constexpr std::array colors = {"#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00",
                                   "#56B4E9", "#7A5C00", "#6A3D9A", "#000000"};
    constexpr std::array points = {7, 5, 9, 13, 11, 6, 4, 8, 3};
    std::size_t shown = 0;
    for (std::size_t i = 0; i < curve.cost.size(); ++i) shown += drawable(curve.cost[i], curve.error[i]);
    if (shown == 0) return;
    begin_block(curve.label);
    for (std::size_t i = 0; i < curve.cost.size(); ++i) {
      if (!drawable(curve.cost[i], curve.error[i])) continue;
      data_ += fmt::format("{} {}\n", curve.cost[i], curve.error[i]);
      cheapest_ = std::min(cheapest_, curve.cost[i]), dearest_ = std::max(dearest_, curve.cost[i]);
      best_ = std::min(best_, curve.error[i]), worst_ = std::max(worst_, curve.error[i]);
    }
    data_ += "\n\n";
    if (curve.limit) {
      plot_ += fmt::format("with lines lw 2 dashtype 2 lc rgb '#404040' title {}", gnuplot_text(curve.label));
      return;
    }
    plot_ += fmt::format("with {} lw 2 pt {} ps 0.8 lc rgb '{}' title {}", curve.line ? "linespoints" : "points",
                         points[methods_ % points.size()], colors[methods_ % colors.size()], gnuplot_text(curve.label));
    ++methods_;
  }

  void mark_default(const Curve& curve) {
    if (!curve.standard || !drawable(curve.cost[*curve.standard], curve.error[*curve.standard])) return;
    begin_block("default");
    data_ += fmt::format("{} {}\n\n\n", curve.cost[*curve.standard], curve.error[*curve.standard]);
    plot_ +=
        fmt::format("with points pt 6 ps 2.2 lw 2.5 lc rgb '#000000' {}", has_default_ ? "notitle" : "title 'default'");
    has_default_ = true;
  }

  const Figure& figure_;
  std::string data_, plot_;
  int blocks_ = 0;
  std::size_t methods_ = 0;
  bool has_default_ = false;
  double cheapest_ = std::numeric_limits<double>::max(), dearest_ = 0;
  double best_ = std::numeric_limits<double>::max(), worst_ = 0;
};

// The same for the page, to be asked: points and the lines through them share a name in the key.
Picture picture_of(const Figure& figure) {
  Picture picture{
      .x_label = figure.cost_label, .y_label = figure.error_label, .logarithmic_x = true, .logarithmic_y = true};
  Series front{"Pareto front", Series::Style::line, 6, {}, {}, {}};
  if (figure.pareto) {
    for (const FrontPoint& point : pareto_front(figure)) {
      if (!front.x.empty()) front.x.push_back(point.cost), front.y.push_back(front.y.back());
      front.x.push_back(point.cost), front.y.push_back(point.error);
    }
  }
  if (front.x.size() > 2) picture.series.push_back(std::move(front));
  Series standard{"default", Series::Style::points, 0, {}, {}, {}};
  int color = 1;
  for (const Curve& curve : figure.curves) {
    Series points{
        curve.label, curve.limit ? Series::Style::dashed : Series::Style::points, curve.limit ? 0 : color++, {}, {},
        {}};
    for (std::size_t i = 0; i < curve.cost.size(); ++i) {
      if (drawable(curve.cost[i], curve.error[i]))
        points.x.push_back(curve.cost[i]), points.y.push_back(curve.error[i]);
    }
    Series through = points;
    through.style = Series::Style::line;
    picture.series.push_back(std::move(points));
    if (curve.line && !curve.limit) picture.series.push_back(std::move(through));
    if (curve.standard && drawable(curve.cost[*curve.standard], curve.error[*curve.standard]))
      standard.x.push_back(curve.cost[*curve.standard]), standard.y.push_back(curve.error[*curve.standard]);
  }
  standard.hollow = true;
  if (!standard.x.empty()) picture.series.push_back(std::move(standard));
  return picture;
}

void draw(const Figure& figure, const fs::path& directory) {
  const Drawing drawing(figure);
  write_file(directory / (figure.name + ".dat"), drawing.data());
  write_file(directory / (figure.name + ".gp"), drawing.script());
  write_file(directory / (figure.name + std::string(plot_data_suffix)),
             dump_canonical(plot_data(picture_of(figure))) + "\n");
  ProcessResult result;
  try {
    result = run_process({"gnuplot", figure.name + ".gp"}, directory);
  } catch (const StageError& error) {
    throw StageError(fmt::format("{}; figures need gnuplot (Debian: gnuplot-nox)", error.what()));
  }
  std::error_code error;
  const auto size = fs::file_size(directory / (figure.name + ".svg"), error);
  if (result.exit_code != 0 || error || size == 0) {
    throw StageError(
        fmt::format("gnuplot could not draw {}.gp (exit code {}): {}", figure.name, result.exit_code, result.output));
  }
}

std::string machine_text(const Json& machine) {
  return fmt::format("{}, {} cores, {:.0f} GB; {}; shakebed {} ({}), {}", machine.value("processor", ""),
                     machine.value("cores", 0), machine.value("memory_bytes", 0.0) / 1e9, machine.value("system", ""),
                     machine.value("version", ""), machine.value("revision", ""), machine.value("compiler", ""));
}

}  // namespace

Json machine_json() {
  utsname name{};
  ::uname(&name);
  return Json{{"processor", kernel_says("/proc/cpuinfo", "model name")},
              {"cores", std::thread::hardware_concurrency()},
              {"memory_bytes", 1024 * std::strtod(kernel_says("/proc/meminfo", "MemTotal").c_str(), nullptr)},
              {"system", fmt::format("{} {} {}", name.sysname, name.release, name.machine)},
              {"version", program_version()},
              {"revision", source_revision()},
              {"compiler", compiler_text()}};
}

std::vector<std::string> failed_cases(const Document& document) {
  std::vector<std::string> failed;
  for (const StageResult& stage : document.stages) {
    for (const HardCase& one : stage.hard_cases) {
      if (!one.pass) failed.push_back(fmt::format("hard case failed: {}: {}: {}", stage.name, one.name, one.note));
    }
  }
  return failed;
}

std::vector<FrontPoint> pareto_front(const Figure& figure) {
  std::vector<FrontPoint> all, front;
  for (const Curve& curve : figure.curves) {
    if (curve.limit) continue;
    for (std::size_t i = 0; i < curve.cost.size(); ++i) {
      if (drawable(curve.cost[i], curve.error[i])) all.push_back({curve.cost[i], curve.error[i]});
    }
  }
  std::sort(all.begin(), all.end(), [](const FrontPoint& a, const FrontPoint& b) {
    return a.cost != b.cost ? a.cost < b.cost : a.error < b.error;
  });
  for (const FrontPoint& point : all) {
    if (front.empty() || point.error < front.back().error) front.push_back(point);
  }
  return front;
}

Json document_json(const Document& document) {
  Json out;
  out["kind"] = "shakebed-bench";
  out["quick"] = document.quick;
  out["when"] = document.when;
  out["machine"] = document.machine;
  out["stages"] = Json::array();
  for (const StageResult& stage : document.stages) {
    Json row{{"stage", stage.name}, {"title", stage.title}, {"cpu_seconds", stage.cpu_seconds}};
    row["sentences"] = stage.sentences;
    row["metrics"] = Json::object();
    for (const Metric& metric : stage.metrics) {
      row["metrics"][metric.name] = {
          {"value", metric.value}, {"unit", metric.unit}, {"better", metric.more_is_better ? "more" : "less"}};
    }
    row["tables"] = Json::array();
    for (const Table& table : stage.tables) {
      row["tables"].push_back(
          Json{{"title", table.title}, {"note", table.note}, {"header", table.header}, {"rows", table.rows}});
    }
    row["figures"] = Json::array();
    for (const Figure& figure : stage.figures) {
      Json drawn{{"name", figure.name}, {"title", figure.title}, {"x", figure.cost_label}, {"y", figure.error_label}};
      drawn["curves"] = Json::array();
      for (const Curve& curve : figure.curves) {
        drawn["curves"].push_back(
            Json{{"label", curve.label}, {"limit", curve.limit}, {"x", curve.cost}, {"y", curve.error}});
        if (curve.standard) drawn["curves"].back()["default"] = *curve.standard;
      }
      row["figures"].push_back(std::move(drawn));
    }
    row["hard_cases"] = Json::array();
    for (const HardCase& one : stage.hard_cases) {
      row["hard_cases"].push_back(Json{{"case", one.name},
                                       {"status", one.status},
                                       {"error", one.error ? Json(*one.error) : Json()},
                                       {"limit", one.limit},
                                       {"unit", one.unit},
                                       {"cpu_seconds", one.seconds},
                                       {"time_limit", one.time_limit},
                                       {"pass", one.pass},
                                       {"note", one.note}});
    }
    out["stages"].push_back(std::move(row));
  }
  out["digits"] = document.digits;
  if (!document.against.is_null()) {
    const Table table = comparison(document.stages, document.against, document.against_name);
    out["against"] = Json{{"file", document.against_name}, {"header", table.header}, {"rows", table.rows}};
  }
  return out;
}

Table comparison(const std::vector<StageResult>& stages, const Json& earlier, const std::string& name) {
  if (!earlier.is_object() || earlier.value("kind", "") != "shakebed-bench" || !earlier.contains("stages") ||
      !earlier["stages"].is_array())
    throw InputError(fmt::format("--against {}: is not what `shakebed bench --json` writes", name));
  std::map<std::string, double> before;
  for (const Json& stage : earlier["stages"]) {
    if (!stage.is_object() || !stage.contains("metrics") || !stage["metrics"].is_object()) continue;
    for (const auto& [key, metric] : stage["metrics"].items()) {
      if (metric.is_object() && metric.contains("value") && metric["value"].is_number())
        before[stage.value("stage", "") + ": " + key] = metric["value"].get<double>();
    }
  }
  const Json machine = earlier.value("machine", Json::object());
  Table table{"Against " + name,
              fmt::format("then: {}, {}", machine.is_object() ? machine_text(machine) : "", earlier.value("when", "")),
              {"quantity", "then", "now", "unit", "now/then", "verdict"},
              {}};
  for (const StageResult& stage : stages) {
    for (const Metric& metric : stage.metrics) {
      const auto found = before.find(stage.name + ": " + metric.name);
      if (found == before.end() || found->second == 0) continue;
      const double ratio = metric.value / found->second, better = metric.more_is_better ? ratio : 1 / ratio;
      table.rows.push_back({found->first, found->second, metric.value, metric.unit, ratio,
                            better > 1.1   ? "better"
                            : better < 0.9 ? "worse"
                                           : "the same within 10 %"});
    }
  }
  if (table.rows.empty()) table.note += "; the two runs have no quantity in common";
  return table;
}

std::string document_text(const Document& document) {
  std::string out = fmt::format("shakebed bench{}, {}\n{}\n", document.quick ? " --quick" : "", document.when,
                                machine_text(document.machine));
  for (const StageResult& stage : document.stages) {
    out += fmt::format("\n=== {} ({:.0f} CPU s)\n", stage.title, stage.cpu_seconds);
    for (const std::string& sentence : stage.sentences) out += sentence + "\n";
    for (const Table& table : stage.tables) out += "\n" + table_text(table);
    if (!stage.hard_cases.empty()) out += "\n" + table_text(hard_case_table(stage.hard_cases));
  }
  if (!document.digits.is_null()) out += "\n" + table_text(digits_table(document.digits));
  if (!document.against.is_null())
    out += "\n" + table_text(comparison(document.stages, document.against, document.against_name));
  return out;
}

std::string document_html(const Document& document, const fs::path& directory) {
  std::string out = page_head("Speed against error");
  out += fmt::format("<p class=\"soft\">{}<br>{}{}</p>\n", escape_markup(machine_text(document.machine)),
                     escape_markup(document.when), document.quick ? ", a quick run" : "");
  std::size_t cases = 0, failed = 0;
  for (const StageResult& stage : document.stages) {
    cases += stage.hard_cases.size();
    for (const HardCase& one : stage.hard_cases) failed += !one.pass;
  }
  if (cases > 0) {
    out += failed == 0 ? fmt::format("<p class=\"good\">All {} hard cases pass.</p>\n", cases)
                       : fmt::format("<p class=\"bad\">{} of {} hard cases fail.</p>\n", failed, cases);
  }
  out +=
      "<p>Times are CPU seconds of all threads. In the figures lower is more accurate and left is cheaper; the grey "
      "staircase is the best to be had at each cost, the ring is what the program does when nothing is asked. Dashed "
      "lines are for comparison: the limit that no method can pass, or what their name says.</p>\n";
  if (document.stages.size() > 1) {
    out += "<p>";
    for (const StageResult& stage : document.stages)
      out += fmt::format("{}<a href=\"#{}\">{}</a>", &stage == document.stages.data() ? "" : " · ", stage.name,
                         escape_markup(stage.title));
    if (!document.digits.is_null()) out += " · <a href=\"#digits\">numerical stability</a>";
    out += "</p>\n";
  }
  if (!document.against.is_null())
    out += html_table(comparison(document.stages, document.against, document.against_name));
  int number = 0;
  for (const StageResult& stage : document.stages) {
    out += fmt::format("<h2 id=\"{}\">{}</h2>\n", stage.name, escape_markup(stage.title));
    for (const std::string& sentence : stage.sentences) out += fmt::format("<p>{}</p>\n", escape_markup(sentence));
    for (const Figure& figure : stage.figures) {
      draw(figure, directory);
      out += figure_html(directory / (figure.name + ".svg"), number++, escape_markup(figure.title));
    }
    for (const Table& table : stage.tables) out += html_table(table);
    if (!stage.hard_cases.empty()) out += html_table(hard_case_table(stage.hard_cases));
  }
  if (!document.digits.is_null())
    out += "<h2 id=\"digits\">Numerical stability</h2>\n" + html_table(digits_table(document.digits));
  return out + page_tail();
}

}  // namespace shakebed::pipelines::bench
