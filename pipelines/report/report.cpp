#include "pipelines/report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/report/sweep_report.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/stages/theory.hpp"

namespace shakebed::pipelines {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view style = R"css(
:root { color-scheme: light dark; --text: #1b1f24; --soft: #57606a; --page: #ffffff; --card: #f6f8fa; --line: #d0d7de;
  --accent: #0b62a8; --good: #116b3c; --bad: #a8290b; --warn: #fff3d6; --warn-text: #5c4000; }
@media (prefers-color-scheme: dark) { :root { --text: #e6e9ed; --soft: #a5adb7; --page: #14171b; --card: #1f242a; --line: #3b434d;
  --accent: #6cb6f2; --good: #5fce95; --bad: #ff9a7a; --warn: #3d3010; --warn-text: #ffdf94; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--text); font: 16px/1.55 system-ui, "Segoe UI", Helvetica, Arial, sans-serif; }
main { max-width: 1060px; margin: 0 auto; padding: 20px 18px 60px; }
h1 { font-size: 1.7rem; line-height: 1.25; margin: 0.4em 0 0.2em; } h2 { font-size: 1.2rem; margin: 2em 0 0.5em; }
p { margin: 0.5em 0; max-width: 75ch; } .soft { color: var(--soft); } code { font-size: 0.88em; overflow-wrap: anywhere; }
.scroll { overflow-x: auto; border: 1px solid var(--line); border-radius: 6px; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; font-size: 0.93rem; }
th, td { text-align: left; padding: 6px 10px; border-top: 1px solid var(--line); vertical-align: top; }
tr:first-child th { border-top: 0; background: var(--card); } td.number { white-space: nowrap; }
.warnings, .banner { background: var(--warn); color: var(--warn-text); border-radius: 6px; padding: 10px 14px; margin: 14px 0; }
.warnings ul { margin: 0; padding-left: 1.2em; } .banner strong { display: block; }
.answer, .lead { border: 1px solid currentColor; border-radius: 6px; padding: 10px 14px; margin: 14px 0; }
.lead p { font-size: 1.08rem; margin: 0.35em 0; max-width: none; }
.good { color: var(--good); font-weight: 600; } .bad { color: var(--bad); font-weight: 600; }
.tag { display: inline-block; border: 1px solid currentColor; border-radius: 4px; padding: 0 6px; font-size: 0.8rem; color: var(--bad); }
figure { margin: 14px 0; } figure > svg, figure img { max-width: 100%; height: auto; display: block; border-radius: 6px; }
figure > svg.plot { background: #ffffff; width: 100%; } figcaption { color: var(--soft); font-size: 0.9rem; margin-top: 4px; }
figure.wide { overflow-x: auto; } figure.wide > svg.plot { min-width: 620px; }
details { margin: 10px 0; } summary { cursor: pointer; color: var(--accent); } pre { overflow-x: auto; background: var(--card); padding: 12px; border-radius: 6px; font-size: 0.82rem; }
#bed-in-motion { --disk-a: #2f7fb8; --disk-b: #c98a2b; } #bed-in-motion canvas { display: none; width: 100%; max-width: 720px; }
#bed-in-motion .still { max-width: 720px; } #bed-in-motion .controls { display: none; gap: 10px; align-items: center; flex-wrap: wrap; max-width: 720px; margin-top: 6px; }
#bed-in-motion.plays canvas { display: block; } #bed-in-motion.plays .controls { display: flex; } #bed-in-motion.plays .still { display: none; }
.controls input { flex: 1 1 120px; min-width: 0; accent-color: var(--accent); } .controls output { color: var(--soft); font-size: 0.9rem; font-variant-numeric: tabular-nums; }
button { font: inherit; color: var(--text); background: var(--card); border: 1px solid var(--line); border-radius: 6px; padding: 3px 14px; cursor: pointer; }
a { color: var(--accent); } ul.files { margin: 8px 0; padding-left: 1.2em; columns: 18rem; font-size: 0.93rem; overflow-wrap: anywhere; }
.graph text { fill: var(--text); font-size: 13px; } .graph .small { fill: var(--soft); font-size: 11px; }
.graph rect { fill: var(--card); stroke: var(--line); } .graph rect.failed { stroke: var(--bad); stroke-width: 2; } .graph path { fill: none; stroke: var(--soft); }
)css";

std::string html(std::string_view text) { return escape_markup(text); }

}  // namespace

std::string page_head(const std::string& title) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n"
      // The page asks nobody for anything: a browser would refuse.
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; "
      "script-src "
      "'unsafe-inline'; img-src data:\">\n"
      "<meta name=\"generator\" content=\"shakebed {}\">\n<link rel=\"icon\" "
      "href=\"data:,\">\n<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n<h1>{}</h1>\n",
      program_version(), html(title), style, prose(title));
}

namespace {

class Report {
 public:
  Report(const Plan& plan, const RunOutcome& outcome) : plan_(plan), outcome_(outcome) {
    for (std::size_t i = 0; i < plan.stages.size() && i < outcome.stages.size(); ++i) {
      const Input files = input_of(plan.stages[i], outcome.out);
      if (!outcome.stages[i].record || files.result_name.empty() || !files.has(files.result_name)) continue;
      try {
        finished_.push_back({files, files.result()});
        pages_.push_back(&plan.stages[i].row->pages);
      } catch (const InputError&) {
        // A damaged result: the page is shown without it.
      }
    }
  }

  std::string page() {
    const std::string title = plan_.report.title.empty() ? plan_.name : plan_.report.title;
    std::string out = page_head(title);
    out += sections(ReportPlace::lead) + sections(ReportPlace::lead_picture) + verdict_line();
    for (const std::string& paragraph : plan_.report.text) out += fmt::format("<p>{}</p>\n", prose(paragraph));
    if (plan_.report.text.empty() && !plan_.description.empty())
      out += fmt::format("<p>{}</p>\n", html(plan_.description));
    out += sections(ReportPlace::banner) + warnings();
    out += sections(ReportPlace::claims);
    out += sections(ReportPlace::figures) + published();
    for (const ReportPlace place :
         {ReportPlace::checks, ReportPlace::motion, ReportPlace::frames, ReportPlace::fits, ReportPlace::maps})
      out += sections(place);
    out += audit() + assumed() + graph() + downloads() + provenance();
    return out + "</main>\n</body>\n</html>\n";
  }

  // What the stages say in summary.md, and on stdout.
  std::string markdown_of_stages() const { return of_stages(&StagePages::markdown); }
  std::string terminal_lines() const { return of_stages(&StagePages::terminal); }

  // Ours beside the published: label, ours, published, verdict.
  struct Row {
    std::string label{}, ours{}, published{}, place{}, verdict{};
    bool agrees = false;
  };
  std::vector<Row> published_rows() const {
    std::vector<Row> rows;
    for (const PublishedNumber& number : plan_.report.published) rows.push_back(published_row(number));
    return rows;
  }

 private:
  using TextOfStage = std::string (*)(const FinishedStage&);
  std::string of_stages(TextOfStage StagePages::*text) const {
    std::string out;
    for (std::size_t i = 0; i < finished_.size(); ++i) {
      if (pages_[i]->*text != nullptr) out += (pages_[i]->*text)(finished_[i]);
    }
    return out;
  }

  // What the stages show at a place of the page.
  std::string sections(ReportPlace place) {
    std::string out;
    for (std::size_t i = 0; i < finished_.size(); ++i) {
      for (const ReportSection& section : pages_[i]->sections) {
        if (section.place != place || (section.once && !out.empty())) continue;
        const std::string own = section.html(finished_[i], pictures_);
        if (own.empty()) continue;
        if (out.empty() && !section.heading.empty()) out += fmt::format("<h2>{}</h2>\n", section.heading);
        out += own;
      }
    }
    return out;
  }

  // The number of a stage at "/<id>/<pointer into its result>".
  const Json* number_at(const std::string& pointer) const {
    const std::vector<std::string> tokens = split_pointer(pointer);
    if (tokens.empty()) return nullptr;
    for (const FinishedStage& stage : finished_) {
      if (stage.files.id == tokens.front())
        return find_pointer(stage.result, pointer.substr(1 + escape_pointer_token(tokens.front()).size()));
    }
    return nullptr;
  }

  Row published_row(const PublishedNumber& number) const {
    Row row{.label = number.label,
            .ours = "–",
            .published = number.value,
            .place = number.place,
            .verdict = "not measured"};
    const Json* found = number_at(number.pointer);
    if (found == nullptr || !found->is_object() || !found->contains("value") || !(*found)["value"].is_number())
      return row;
    const Quantity wanted = parse_quantity(number.value);
    std::string unit = found->value("unit", "");
    double factor = 1, printed = wanted.value;
    if (wanted.has_unit) {  // shown in the unit of the print
      const std::size_t start = number.value.find_first_not_of("+-0123456789.eE ");
      const std::string own = unit;
      unit = start == std::string::npos ? "" : number.value.substr(start);
      printed = wanted.value / parse_quantity("1 " + unit).value;
      try {
        factor = parse_quantity("1 " + own).value / parse_quantity("1 " + unit).value;
      } catch (const std::invalid_argument&) {
        factor = 1;
      }
    }
    const double ours = (*found)["value"].get<double>() * factor, error = found->value("std_error", 0.0) * factor;
    row.ours = error > 0 ? fmt::format("{:.4g} ± {:.2g}", ours, error) : fmt::format("{:.4g}", ours);
    if (!unit.empty() && unit != "1") row.ours += " " + unit;
    const double off = printed != 0 ? (ours - printed) / std::abs(printed) : ours;
    row.agrees = std::abs(off) <= number.relative;
    row.verdict = fmt::format("{} ({:+.1f} %)", row.agrees ? "agrees" : "differs", 100 * off);
    return row;
  }

  std::string verdict_line() const {
    const bool fine = outcome_.code == exit_ok;
    std::string text = fine                                 ? "finished"
                       : outcome_.code == exit_check_failed ? "finished, but a check failed"
                       : outcome_.code == exit_interrupted  ? "interrupted"
                                                            : "stopped";
    std::string out = fmt::format("<p class=\"{}\">{}</p>\n", fine ? "good" : "bad", text);
    if (!outcome_.error.empty())
      out += fmt::format("<div class=\"banner\"><strong>What stopped it</strong>{}</div>\n", html(outcome_.error));
    return out;
  }

  std::string warnings() const {
    if (outcome_.warnings.empty()) return "";
    std::string out = "<div class=\"warnings\"><strong>Warnings</strong><ul>\n";
    for (const std::string& warning : outcome_.warnings) out += fmt::format("<li>{}</li>\n", html(warning));
    return out + "</ul></div>\n";
  }

  std::string published() const {
    const std::vector<Row> rows = published_rows();
    if (rows.empty()) return "";
    std::string out =
        "<h2>Our numbers beside the published ones</h2>\n<div "
        "class=\"scroll\"><table>\n<tr><th>number</th><th>ours</th><th>published</th><th>verdict</th><th>where</th></"
        "tr>\n";
    for (const Row& row : rows) {
      out += fmt::format(
          "<tr><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td "
          "class=\"{}\">{}</td><td>{}</td></tr>\n",
          html(row.label), html(row.ours), html(row.published), row.agrees ? "good" : "bad", html(row.verdict),
          html(row.place));
    }
    return out + "</table></div>\n";
  }

  // Tables and figures inside the page, so that they go where it goes; what is large is linked beside it.
  std::string downloads() const {
    constexpr std::uint64_t largest = 300'000, most = 3'000'000;
    std::uint64_t total = 0;
    std::string inside, beside;
    const auto type_of = [](const std::string& extension) {
      return extension == ".csv"    ? "text/csv"
             : extension == ".json" ? "application/json"
             : extension == ".svg"  ? "image/svg+xml"
                                    : "text/plain";
    };
    const auto embed = [&](const std::string& name, const std::string& bytes) {
      total += bytes.size();
      inside += fmt::format(
          "<li><a download=\"{}\" href=\"data:{};base64,{}\">{}</a> <span class=\"soft\">{}</span></li>\n", html(name),
          type_of(fs::path(name).extension().string()), base64(bytes), html(name), size_text(bytes.size()));
    };
    embed(plan_.name + "-recipe.json", dump(plan_.resolved));
    for (const StageOutcome& stage : outcome_.stages) {
      if (!stage.record) continue;
      std::size_t listed = 0;
      for (const Fingerprint& file : stage.record->outputs) {
        const std::string extension = fs::path(file.file).extension().string();
        const bool text = extension == ".csv" || extension == ".json" || extension == ".svg" || extension == ".dat" ||
                          extension == ".gp" || extension == ".xml";
        const fs::path path = outcome_.out / stage.id / file.file;
        std::error_code error;
        if (!fs::is_regular_file(path, error) || ++listed > 24) continue;
        if (text && file.bytes <= largest && total + file.bytes <= most) {
          std::string name = stage.id + "-" + file.file;
          std::replace(name.begin(), name.end(), '/', '-');
          embed(name, read_file(path));
        } else {
          beside +=
              fmt::format("<li><a href=\"{}\">{}</a> <span class=\"soft\">{}</span></li>\n",
                          html(stage.id + "/" + file.file), html(stage.id + "/" + file.file), size_text(file.bytes));
        }
      }
    }
    std::string out =
        "<h2>Downloads</h2>\n<details><summary>Tables, figures and the recipe, inside this page</summary><ul "
        "class=\"files\">\n" +
        inside + "</ul></details>\n";
    if (!beside.empty())
      out += "<details><summary>Large files, beside this page</summary><ul class=\"files\">\n" + beside +
             "</ul></details>\n";
    return out;
  }

  std::string audit() const {
    if (!plan_.report.audit) return "";
    const Json audit = audit_json();
    std::string out = fmt::format(
        "<h2>The paper's numbers, recomputed</h2>\n<p class=\"soft\">{}: what it prints, and the same from its own "
        "formulas.</p>\n<div class=\"scroll\"><table>\n<tr><th>number</th><th>printed</th><th>recomputed</th><th>"
        "difference</th><th>status</th><th>explanation</th></tr>\n",
        html(audit["paper"].get<std::string>()));
    for (const Json& row : audit["rows"]) {
      const std::string status = row["status"].get<std::string>();
      const std::string difference = row.contains("relative_difference")
                                         ? fmt::format("{:+.3g} %", 100 * row["relative_difference"].get<double>())
                                         : std::string("–");
      out += fmt::format(
          "<tr><td>{}<br><span class=\"soft\">{}</span></td><td>{}</td><td>{}</td><td class=\"number\">{}</td><td "
          "class=\"{}\">{}</td><td>{}</td></tr>\n",
          prose(row["quantity"].get<std::string>()), html(row["place"].get<std::string>()),
          prose(row["printed_text"].get<std::string>()), prose(row["recomputed_text"].get<std::string>()), difference,
          status == "open" ? "bad" : "good", html(status), prose(row["explanation"].get<std::string>()));
    }
    return out + "</table></div>\n";
  }

  std::string assumed() const {
    if (plan_.report.assumed.empty()) return "";
    std::string out =
        "<h2>Assumed inputs</h2>\n<p class=\"soft\">The source does not give these; other values give other "
        "results.</p>\n<div class=\"scroll\"><table>\n<tr><th>input</th><th>value</th><th></th><th>why</th></tr>\n";
    for (const AssumedInput& input : plan_.report.assumed) {
      std::string value = "–";
      const JsonNode* node = find_pointer(plan_.document, input.pointer);
      if (node != nullptr) value = node->is_string() ? node->text : dump_canonical(node->to_json());
      out += fmt::format(
          "<tr><td><code>{}</code></td><td class=\"number\">{}</td><td><span "
          "class=\"tag\">assumed</span></td><td>{}</td></tr>\n",
          html(input.pointer), html(value), html(input.why));
    }
    return out + "</table></div>\n";
  }

  // The stages as boxes, each a column right of what it reads from.
  std::string graph() const {
    const std::size_t n = plan_.stages.size();
    std::vector<int> column(n, 0), row(n, 0);
    std::vector<int> in_column;
    for (std::size_t i = 0; i < n; ++i) {
      for (const std::size_t k : plan_.stages[i].from) column[i] = std::max(column[i], column[k] + 1);
      if (static_cast<std::size_t>(column[i]) >= in_column.size())
        in_column.resize(static_cast<std::size_t>(column[i]) + 1, 0);
      row[i] = in_column[static_cast<std::size_t>(column[i])]++;
    }
    const int columns = static_cast<int>(in_column.size());
    const int rows = *std::max_element(in_column.begin(), in_column.end());
    constexpr int box_width = 124, box_height = 54, step_x = 166, step_y = 74;
    const auto x_of = [&](std::size_t i) { return 8 + column[i] * step_x; };
    const auto y_of = [&](std::size_t i) { return 8 + row[i] * step_y; };
    const int width = (columns - 1) * step_x + box_width + 16, height = (rows - 1) * step_y + box_height + 16;
    std::string svg = fmt::format(
        "<svg class=\"graph\" viewBox=\"0 0 {} {}\" width=\"{}\" height=\"{}\" role=\"img\" aria-label=\"the "
        "stages\">\n",
        width, height, width, height);
    for (std::size_t i = 0; i < n; ++i) {
      for (const std::size_t k : plan_.stages[i].from) {
        const int x0 = x_of(k) + box_width, y0 = y_of(k) + box_height / 2, x1 = x_of(i), y1 = y_of(i) + box_height / 2;
        svg += fmt::format("<path d=\"M{} {}C{} {} {} {} {} {}\"/>", x0, y0, x0 + 24, y0, x1 - 24, y1, x1, y1);
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      const StageOutcome& stage = outcome_.stages[i];
      const std::string time =
          stage.cost ? fmt::format("<!-- times -->, {}<!-- /times -->", duration_text(stage.cost->wall_seconds)) : "";
      const std::string state = stage.state == StageState::kept ? "kept" : std::string(to_string(stage.state));
      svg += fmt::format(
          "<g><title>{}</title><rect class=\"{}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"6\"/><text "
          "x=\"{}\" y=\"{}\">{}</text><text class=\"small\" x=\"{}\" y=\"{}\">{}{}</text></g>\n",
          html(plan_.stages[i].row->summary), stage.state == StageState::failed ? "failed" : "", x_of(i), y_of(i),
          box_width, box_height, x_of(i) + 10, y_of(i) + 23,
          html(stage.id.size() <= 14 ? stage.id : stage.id.substr(0, 13) + "…"), x_of(i) + 10, y_of(i) + 42,
          html(state), time);
    }
    return "<h2>Stages</h2>\n<div class=\"scroll\" style=\"padding:8px\">" + svg + "</svg></div>\n";
  }

  std::string provenance() const {
    std::string out = "<h2>Provenance</h2>\n<div class=\"scroll\"><table>\n<tr><th>what</th><th></th></tr>\n";
    const auto row = [&](const char* name, const std::string& value) {
      if (!value.empty()) out += fmt::format("<tr><td>{}</td><td><code>{}</code></td></tr>\n", name, html(value));
    };
    row("program", "shakebed " + program_version());
    row("source", source_revision());
    row("compiler", compiler_text());
    row("recipe", fs::path(plan_.file).filename().string());
    for (const PlannedStage& stage : plan_.stages) {
      if (stage.row->uses_seed) row(("seed of " + stage.id).c_str(), std::to_string(stage.seed));
    }
    out +=
        "</table></div>\n<details><summary>Files with their SHA-256</summary><div "
        "class=\"scroll\"><table>\n<tr><th>file</th><th>bytes</th><th>SHA-256</th></tr>\n";
    for (const StageOutcome& stage : outcome_.stages) {
      if (!stage.record) continue;
      std::size_t listed = 0;
      for (const Fingerprint& file : stage.record->outputs) {
        if (++listed > 24) continue;
        out += fmt::format("<tr><td>{}/{}</td><td class=\"number\">{}</td><td><code>{}</code></td></tr>\n",
                           html(stage.id), html(file.file), file.bytes, file.sha256);
      }
      if (listed > 24)
        out += fmt::format("<tr><td>{}: {} more files, listed in manifest.json</td><td></td><td></td></tr>\n",
                           html(stage.id), listed - 24);
    }
    out += "</table></div></details>\n<details><summary>The recipe with every option</summary><pre>" +
           html(dump(plan_.resolved)) + "</pre></details>\n";
    return out;
  }

  const Plan& plan_;
  const RunOutcome& outcome_;
  std::vector<FinishedStage> finished_;
  std::vector<const StagePages*> pages_;  // of each finished stage
  int pictures_ = 0;
};

std::string report_html(const Plan& plan, const RunOutcome& outcome) { return Report(plan, outcome).page(); }

std::string published_text(const Plan& plan, const RunOutcome& outcome) {
  const auto rows = Report(plan, outcome).published_rows();
  if (rows.empty()) return "";
  std::size_t widest = 6;
  for (const auto& row : rows) widest = std::max(widest, row.label.size());
  std::string out = fmt::format("{:<{}} {:<24} {:<14} {}\n", "number", widest, "ours", "published", "verdict");
  for (const auto& row : rows) {
    // "±" and "–" take two and three bytes for one column.
    const auto pad = [](const std::string& text, std::size_t width) {
      std::size_t columns = 0;
      for (const char c : text) columns += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
      return text + std::string(columns < width ? width - columns : 0, ' ');
    };
    out += pad(row.label, widest) + " " + pad(row.ours, 24) + " " + pad(row.published, 14) + " " + row.verdict + "\n";
  }
  return out;
}

std::string summary_markdown(const Plan& plan, const RunOutcome& outcome) {
  const std::string title = plan.report.title.empty() ? plan.name : plan.report.title;
  std::string out = fmt::format("# {}\n\n**{}**\n", markdown(title),
                                outcome.code == exit_ok             ? "Passed"
                                : outcome.code == exit_check_failed ? "A check failed"
                                : outcome.code == exit_interrupted  ? "Interrupted"
                                                                    : "Stopped");
  if (!outcome.error.empty()) out += fmt::format("\n> {}\n", markdown(outcome.error));
  const Report report(plan, outcome);
  out += report.markdown_of_stages();
  if (const auto rows = report.published_rows(); !rows.empty()) {
    out += "\n## Beside the published numbers\n\n| number | ours | published | verdict |\n|---|---|---|---|\n";
    for (const auto& row : rows) {
      out += fmt::format("| {} | {} | {} | {} |\n", markdown(row.label), markdown(row.ours), markdown(row.published),
                         markdown(row.verdict));
    }
  }
  if (!outcome.warnings.empty()) {
    out += "\n## Warnings\n\n";
    for (const std::string& warning : outcome.warnings) out += fmt::format("- {}\n", markdown(warning));
  }
  out += "\n## Stages\n\n| stage | kind | |\n|---|---|---|\n";
  std::string times = duration_text(outcome.wall_seconds);
  for (const StageOutcome& stage : outcome.stages) {
    out += fmt::format("| {} | {} | {} |\n", markdown(stage.id), stage.kind, to_string(stage.state));
    if (stage.cost) times += fmt::format("; {} {}", markdown(stage.id), duration_text(stage.cost->wall_seconds));
  }
  out += fmt::format("\n<!-- times -->\nTime: {}\n<!-- /times -->\n", times);
  return out + fmt::format("\nshakebed {} ({})\n", program_version(), source_revision());
}

class ReportPages : public Pages {
 public:
  void write(const Plan& plan, const RunOutcome& outcome) const override {
    write_file_atomically(outcome.out / "report.html", report_html(plan, outcome));
    write_file_atomically(outcome.out / "summary.md", summary_markdown(plan, outcome));
  }
  void write(const Plan& plan, const SweepOutcome& outcome) const override { write_sweep_pages(plan, outcome); }
};

}  // namespace

std::string terminal_text(const Plan& plan, const RunOutcome& outcome) {
  const std::string published = published_text(plan, outcome);
  return published.empty() ? Report(plan, outcome).terminal_lines() : "\n" + published + "\n";
}

const Pages& report_pages() {
  static const ReportPages pages;
  return pages;
}

}  // namespace shakebed::pipelines
