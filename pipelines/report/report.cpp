#include "pipelines/report/report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/formats/plot_data_name.hpp"
#include "pipelines/report/crate.hpp"
#include "pipelines/report/page.hpp"
#include "pipelines/report/sweep_report.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/stages/theory.hpp"

namespace shakebed::pipelines {
namespace {

namespace fs = std::filesystem;

std::string html(std::string_view text) { return escape_markup(text); }

class Report {
 public:
  Report(const Plan& plan, const RunOutcome& outcome) : plan_(plan), outcome_(outcome) {
    for (std::size_t i = 0; i < plan.stages.size() && i < outcome.stages.size(); ++i) {
      const Input files = input_of(plan.stages[i], outcome.out);
      if (!outcome.stages[i].record || files.result_name.empty() || !files.has(files.result_name)) continue;
      try {
        finished_.push_back({files, files.result()});
        pages_.push_back(&plan.stages[i].row->pages);
        answered_ = answered_ || !plan.stages[i].row->answer.empty();
      } catch (const InputError&) {
        // A damaged result: the page is shown without it.
      }
    }
  }

  // The answer, the figure that shows it, the bed; then what speaks against the answer, then the rest; prose last.
  std::string page() {
    std::string out = page_head(plan_.report.title.empty() ? plan_.name : plan_.report.title);
    // One figure shows the answer; those that other stages would lead with stand before the rest.
    std::vector<std::string> leading = parts(ReportPlace::lead_picture);
    out += state_line() + sections(ReportPlace::lead) + facts();
    if (!leading.empty()) {
      out += leading.front();
      leading.erase(leading.begin());
    }
    out += sections(ReportPlace::banner) + warnings();
    out += sections(ReportPlace::motion) + sections(ReportPlace::film);
    out += sections(ReportPlace::claims);
    out += fmt::format("{}", fmt::join(leading, "")) + sections(ReportPlace::figures) + published();
    for (const ReportPlace place : {ReportPlace::checks, ReportPlace::fits, ReportPlace::maps, ReportPlace::frames})
      out += sections(place);
    out += audit() + assumed() + about() + graph() + downloads() + provenance();
    return out + page_tail();
  }

  // What the stages say in summary.md, and on stdout.
  std::string markdown_of_stages() const { return of_stages(&StagePages::markdown); }
  std::string terminal_lines() const { return of_stages(&StagePages::terminal); }

  // Ours beside the published: label, ours, published, verdict.
  struct Row {
    std::string label{}, ours{}, published{}, place{}, verdict{};
    bool agrees = false, beside_answer = false;
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
      if (answered_ && pages_[i]->yields_to_answer) continue;
      if (pages_[i]->*text != nullptr) out += (pages_[i]->*text)(finished_[i]);
    }
    return out;
  }

  // What the stages show at a place of the page, each stage's own.
  std::vector<std::string> parts(ReportPlace place) {
    std::vector<std::string> out;
    for (std::size_t i = 0; i < finished_.size(); ++i) {
      for (const ReportSection& section : pages_[i]->sections) {
        if (section.place != place || (section.once && !out.empty())) continue;
        if (place == ReportPlace::banner && answered_ && pages_[i]->yields_to_answer) continue;
        std::string own = section.html(finished_[i], pictures_);
        if (own.empty()) continue;
        if (out.empty() && !section.heading.empty()) own.insert(0, fmt::format("<h2>{}</h2>\n", section.heading));
        out.push_back(std::move(own));
      }
    }
    return out;
  }
  std::string sections(ReportPlace place) { return fmt::format("{}", fmt::join(parts(place), "")); }

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
            .verdict = "not measured",
            .beside_answer = number.beside_answer};
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
      factor = parse_quantity("1 " + own).value / parse_quantity("1 " + unit).value;
    }
    const double ours = (*found)["value"].get<double>() * factor, error = stated_error(*found) * factor;
    row.ours = error > 0 ? fmt::format("{:.4g} ± {:.2g}", ours, error) : fmt::format("{:.4g}", ours);
    if (!unit.empty() && unit != "1") row.ours += " " + unit;
    const double off = printed != 0 ? (ours - printed) / std::abs(printed) : ours;
    row.agrees = std::abs(off) <= number.relative;
    row.verdict = fmt::format("{} ({:+.1f} %)", row.agrees ? "agrees" : "differs", 100 * off);
    return row;
  }

  // Whether the run came to its end: a line only where there is something to say.
  std::string state_line() const {
    const bool fine = outcome_.code == exit_ok;
    const std::string text = fine                                 ? "finished"
                             : outcome_.code == exit_check_failed ? "finished, but a check failed"
                             : outcome_.code == exit_interrupted  ? "interrupted"
                                                                  : "stopped";
    std::string out = fmt::format("<p class=\"{}\">{}</p>\n", fine ? "soft" : "bad", text);
    if (!outcome_.error.empty())
      out += fmt::format("<div class=\"banner\"><strong>Why the run stopped</strong>{}</div>\n", html(outcome_.error));
    return out;
  }

  // A warning as the page groups it.
  struct Shown {
    std::string stage, text, todo;
    WarningEffect effect = WarningEffect::rest;
  };
  Shown shown_warning(const std::string& warning) const {
    Shown out{"", warning, "", WarningEffect::recipe};
    for (const PlannedStage& stage : plan_.stages) {
      if (!warning.starts_with(stage.id + ": ")) continue;
      out = {stage.id, warning.substr(stage.id.size() + 2), "", WarningEffect::rest};
      for (const WarningAdvice& advice : stage.row->pages.warnings) {
        if (out.text.find(advice.about) == std::string::npos) continue;
        out.effect = advice.effect, out.todo = advice.todo;
        break;
      }
      break;
    }
    return out;
  }

  // Grouped by what they do to the answer; each folded, with what to do.
  std::string warnings() const {
    if (outcome_.warnings.empty()) return "";
    constexpr std::array groups = {
        std::pair(WarningEffect::answer, "Warnings that concern the answer or its error"),
        std::pair(WarningEffect::measurement, "Warnings that concern the measurement"),
        std::pair(WarningEffect::recipe, "Warnings about the recipe: the bed may not be the one that you want"),
        std::pair(WarningEffect::rest, "Warnings that do not concern the answer")};
    std::vector<Shown> all;
    for (const std::string& warning : outcome_.warnings) all.push_back(shown_warning(warning));
    std::string out = fmt::format("<section class=\"warnings\" aria-label=\"warnings\">\n<h2>{} warning{}</h2>\n",
                                  all.size(), all.size() == 1 ? "" : "s");
    for (const auto& [effect, heading] : groups) {
      std::string own;
      for (const Shown& one : all) {
        if (one.effect == effect) own += warning_html(one);
      }
      if (!own.empty()) out += fmt::format("<h3>{}</h3>\n{}", heading, own);
    }
    return out + "</section>\n";
  }

  static std::string warning_html(const Shown& one) {
    const std::string stage = one.stage.empty() ? "" : fmt::format("<span class=\"soft\">{}:</span> ", html(one.stage));
    std::string rest;
    const std::string first = first_sentence(one.text, rest);
    if (rest.empty() && one.todo.empty()) return fmt::format("<p>{}{}</p>\n", stage, prose(first));
    return fmt::format(
        "<details><summary>{}{}</summary>{}{}</details>\n", stage, prose(first),
        rest.empty() ? "" : fmt::format("<p>{}</p>", prose(rest)),
        one.todo.empty() ? "" : fmt::format("<p class=\"todo\"><strong>What to do:</strong> {}</p>", prose(one.todo)));
  }

  // What ends with ". " or ": " and is long enough to stand alone; the rest of the text goes to `rest`.
  static std::string first_sentence(const std::string& text, std::string& rest) {
    constexpr std::size_t shortest = 24;
    for (std::size_t i = shortest; i + 2 < text.size(); ++i) {
      if ((text[i] != '.' && text[i] != ':' && text[i] != ';') || text[i + 1] != ' ') continue;
      rest = text.substr(i + 2);
      return text.substr(0, text[i] == '.' ? i + 1 : i);
    }
    return text;
  }

  // Beside the answer: published numbers with ours, and what stages measured besides; the rest is in tables below.
  std::string facts() {
    std::string own;
    const std::vector<Row> rows = published_rows();
    for (const Row& row : rows) {
      if (&row != &rows.front() && !row.beside_answer) continue;
      own += fmt::format(
          "<div><dt>{0}</dt><dd>{1} <span class=\"tag computed\">computed</span></dd></div>\n<div><dt>published "
          "value</dt><dd>{2} <span class=\"tag published\">published</span> <span class=\"verdict "
          "{3}\">{4}</span></dd></div>\n",
          prose(row.label), html(row.ours), html(row.published), row.agrees ? "good" : "bad", html(row.verdict));
    }
    own += sections(ReportPlace::facts);
    if (own.empty()) return "";
    return "<section class=\"answer beside\" aria-label=\"numbers beside the answer\"><dl class=\"facts\">\n" + own +
           "</dl></section>\n";
  }

  std::string about() const {
    std::string out;
    for (const std::string& paragraph : plan_.report.text) out += fmt::format("<p>{}</p>\n", prose(paragraph));
    if (plan_.report.text.empty() && !plan_.description.empty())
      out += fmt::format("<p>{}</p>\n", html(plan_.description));
    return out.empty() ? out : "<h2>What was done</h2>\n" + out;
  }

  std::string published() const {
    const std::vector<Row> rows = published_rows();
    if (rows.empty()) return "";
    const std::vector<std::string> head{"number", "ours", "published", "verdict", "where"};
    std::string out =
        "<h2>Comparison with published numbers</h2>\n<div class=\"scroll\"><table class=\"stack\">\n<tr><th>number"
        "</th><th class=\"computed\">ours <span class=\"tag computed\">computed</span></th><th "
        "class=\"published\">theirs "
        "<span class=\"tag published\">published</span></th><th>verdict</th><th>where</th></tr>\n";
    for (const Row& row : rows)
      out += table_row(head, {{prose(row.label)},
                              {html(row.ours), "number"},
                              {html(row.published), "number"},
                              {html(row.verdict), row.agrees ? "good" : "bad"},
                              {html(row.place)}});
    return out + "</table></div>\n";
  }

  // Tables and figures inside the page, so that they go where it goes; what is large is linked beside it.
  std::string downloads() const {
    // Inside a page of at most 4 MB beside film (1.8 MB), bed and figures.
    constexpr std::uint64_t largest = 120'000, most = 600'000;
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
        if (file.file.ends_with(plot_data_suffix)) continue;  // inside the figure itself
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
      out += "<details><summary>Large files, in the folder of this page</summary><ul class=\"files\">\n" + beside +
             "</ul></details>\n";
    return out;
  }

  std::string audit() const {
    if (!plan_.report.audit) return "";
    const Json audit = audit_json();
    const std::vector<std::string> head{"number", "printed", "recomputed", "difference", "status", "explanation"};
    std::string out = fmt::format(
        "<h2>The paper's numbers, recomputed</h2>\n<p class=\"soft\">{}: the printed numbers, and the same numbers "
        "recomputed from the formulas of the paper.</p>\n<div class=\"scroll\"><table "
        "class=\"stack\">\n<tr><th>number</th><th "
        "class=\"published\">printed "
        "<span class=\"tag published\">published</span></th><th class=\"computed\">recomputed <span class=\"tag "
        "computed\">computed</span></th><th>difference</th><th>status</th><th>explanation</th></tr>\n",
        html(audit["paper"].get<std::string>()));
    for (const Json& row : audit["rows"]) {
      const std::string status = row["status"].get<std::string>();
      const std::string difference = row.contains("relative_difference")
                                         ? fmt::format("{:+.3g} %", 100 * row["relative_difference"].get<double>())
                                         : std::string("–");
      out += table_row(head,
                       {{fmt::format("{}<br><span class=\"soft\">{}</span>", prose(row["quantity"].get<std::string>()),
                                     html(row["place"].get<std::string>()))},
                        {prose(row["printed_text"].get<std::string>())},
                        {prose(row["recomputed_text"].get<std::string>())},
                        {difference, "number"},
                        {html(status), status == "open" ? "bad" : "good"},
                        {prose(row["explanation"].get<std::string>())}});
    }
    return out + "</table></div>\n";
  }

  std::string assumed() const {
    if (plan_.report.assumed.empty()) return "";
    std::string out =
        "<h2>Assumed inputs</h2>\n<p class=\"soft\">The source does not give these values, and the results depend on "
        "them.</p>\n<div class=\"scroll\"><table class=\"stack\">\n<tr><th>input</th><th class=\"assumed\">value "
        "<span "
        "class=\"tag assumed\">assumed</span></th><th>why</th></tr>\n";
    for (const AssumedInput& input : plan_.report.assumed) {
      std::string value = "–";
      const JsonNode* node = find_pointer(plan_.document, input.pointer);
      if (node != nullptr) value = node->is_string() ? node->text : dump_canonical(node->to_json());
      out +=
          table_row({"input", "value", "why"}, {{"<code>" + html(input.pointer) + "</code>"},
                                                {html(value) + " <span class=\"tag assumed\">assumed</span>", "number"},
                                                {html(input.why)}});
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
  bool answered_ = false;                 // one of them gives an answer
  int pictures_ = 0;
};

std::string published_text(const Report& report) {
  const auto rows = report.published_rows();
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

std::string summary_markdown(const Plan& plan, const RunOutcome& outcome, const Report& report) {
  const std::string title = plan.report.title.empty() ? plan.name : plan.report.title;
  std::string out = fmt::format("# {}\n\n**{}**\n\n", markdown(title),
                                outcome.code == exit_ok             ? "Finished"
                                : outcome.code == exit_check_failed ? "A check failed"
                                : outcome.code == exit_interrupted  ? "Interrupted"
                                                                    : "Stopped");
  if (!outcome.error.empty()) out += fmt::format("> {}\n\n", markdown(outcome.error));
  out += report.markdown_of_stages();
  if (const auto rows = report.published_rows(); !rows.empty()) {
    out += "\n## Comparison with published numbers\n\n| number | ours | published | verdict |\n|---|---|---|---|\n";
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
    Report report(plan, outcome);
    write_file_atomically(outcome.out / "report.html", report.page());
    write_file_atomically(outcome.out / "summary.md", summary_markdown(plan, outcome, report));
    write_file_atomically(outcome.out / crate_name, dump(crate_json(plan, outcome)));
  }
  void write(const Plan& plan, const SweepOutcome& outcome) const override { write_sweep_pages(plan, outcome); }
};

}  // namespace

std::string terminal_text(const Plan& plan, const RunOutcome& outcome) {
  const Report report(plan, outcome);
  const std::string published = published_text(report);
  return published.empty() ? report.terminal_lines() : "\n" + published + "\n";
}

const Pages& report_pages() {
  static const ReportPages pages;
  return pages;
}

}  // namespace shakebed::pipelines
