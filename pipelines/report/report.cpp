#include "pipelines/report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/stages/animation.hpp"
#include "pipelines/stages/check.hpp"
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

// Text that people write: T_c, ζ_F, a_2 with a subscript, T^2, D^-2 with a superscript; names like above_launch as they
// stand.
std::string prose(std::string_view text) {
  const std::string plain = html(text);
  const auto letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  const auto alphanumeric = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; };
  const auto greek = [](char c) { return (static_cast<unsigned char>(c) & 0x80) != 0; };
  std::string out;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    std::size_t end = i + 1;
    const char c = plain[i];
    if (c == '_' && i > 0 &&
        (greek(plain[i - 1]) || (letter(plain[i - 1]) && (i == 1 || !alphanumeric(plain[i - 2]))))) {
      while (end < plain.size() && alphanumeric(plain[end])) ++end;
      if (end > i + 1 && (end == plain.size() || plain[end] != '_')) {
        out += "<sub>" + plain.substr(i + 1, end - i - 1) + "</sub>";
        i = end - 1;
        continue;
      }
    } else if (c == '^' && i > 0 && (greek(plain[i - 1]) || alphanumeric(plain[i - 1]))) {
      if (end < plain.size() && plain[end] == '-') ++end;
      while (end < plain.size() && alphanumeric(plain[end])) ++end;
      out += "<sup>" + plain.substr(i + 1, end - i - 1) + "</sup>";
      i = end - 1;
      continue;
    }
    out += c;
  }
  return out;
}

void replace_all(std::string& text, std::string_view what, std::string_view with) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += with.size())
    text.replace(at, what.size(), with);
}

}  // namespace

std::string inline_svg(const fs::path& path, int number) {
  std::string svg = read_file(path);
  const std::size_t begin = svg.find("<svg");
  if (begin == std::string::npos) return "";
  svg.erase(0, begin);
  const std::string prefix = fmt::format("f{}-", number);
  for (const std::string_view quote : {"'", "\""}) {
    replace_all(svg, fmt::format("id={}", quote), fmt::format("id={}{}", quote, prefix));
    replace_all(svg, fmt::format("href={}#", quote), fmt::format("href={}#{}", quote, prefix));
  }
  replace_all(svg, "url(#", "url(#" + prefix);
  svg.replace(0, 4, "<svg class=\"plot\"");
  return svg;
}

namespace {

// A quantity as people read it: lengths in mm, the error beside the value.
std::string shown(const Json& quantity) {
  if (quantity.is_null()) return "–";
  if (quantity.is_boolean()) return quantity.get<bool>() ? "yes" : "no";
  if (quantity.is_string()) return html(quantity.get<std::string>());
  if (quantity.is_number()) return fmt::format("{:.5g}", quantity.get<double>());
  if (!quantity.is_object() || !quantity.contains("value") || !quantity["value"].is_number())
    return html(dump_canonical(quantity));
  double value = quantity["value"].get<double>(), error = quantity.value("std_error", 0.0);
  std::string unit = quantity.value("unit", "");
  if (unit == "m") value *= 1e3, error *= 1e3, unit = "mm";
  if (unit == "m/px") value *= 1e3, error *= 1e3, unit = "mm/px";
  std::string text;
  if (error > 0 && std::abs(value) > 0) {
    const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, 12);
    text = fmt::format("{:.{}f} ± {:.{}f}", value, decimals, error, decimals);
  } else {
    text = fmt::format("{:.5g}", value);
  }
  if (!unit.empty() && unit != "1") text += " " + html(unit);
  return text + (quantity.value("fixed", false) ? " (fixed)" : "");
}

std::string size_text(std::uint64_t bytes) {
  const auto size = static_cast<double>(bytes);
  return bytes < 1000        ? fmt::format("{} bytes", bytes)
         : bytes < 1'000'000 ? fmt::format("{:.0f} kB", size / 1e3)
                             : fmt::format("{:.1f} MB", size / 1e6);
}

// "temperature_over_mg" → "temperature over mg".
std::string words(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

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
      const PlannedStage& stage = plan.stages[i];
      if (!outcome.stages[i].record || stage.row->result.empty()) continue;
      const fs::path path = directory(stage) / stage.row->result;
      std::error_code error;
      if (!fs::is_regular_file(path, error)) continue;
      try {
        results_[stage.id] = read_json(path);
      } catch (const InputError&) {
        // A damaged result: the stage is shown without numbers.
      }
    }
  }

  std::string page() {
    const std::string title = plan_.report.title.empty() ? plan_.name : plan_.report.title;
    std::string out = page_head(title);
    out += verdict_line();
    for (const std::string& paragraph : plan_.report.text) out += fmt::format("<p>{}</p>\n", prose(paragraph));
    if (plan_.report.text.empty() && !plan_.description.empty())
      out += fmt::format("<p>{}</p>\n", html(plan_.description));
    out += banners() + warnings() + claims() + figures() + published() + checks() + bed_in_motion() + overlays() +
           fits() + maps() + audit() + assumed() + graph() + downloads() + provenance();
    return out + "</main>\n</body>\n</html>\n";
  }

  // Ours beside the published: label, ours, published, verdict.
  struct Row {
    std::string label{}, ours{}, published{}, place{}, verdict{};
    bool agrees = false;
  };
  std::vector<Row> published_rows() const {
    std::vector<Row> rows;
    for (const PublishedNumber& number : plan_.report.published) {
      Row row{.label = number.label, .published = number.value, .place = number.place};
      const std::vector<std::string> tokens = split_pointer(number.pointer);
      const Json* found = nullptr;
      if (!tokens.empty() && results_.contains(tokens.front())) {
        found = find_pointer(results_.at(tokens.front()),
                             number.pointer.substr(1 + escape_pointer_token(tokens.front()).size()));
      }
      if (found != nullptr && found->is_object() && found->contains("value") && (*found)["value"].is_number()) {
        const double value = (*found)["value"].get<double>(), error = found->value("std_error", 0.0);
        const Quantity wanted = parse_quantity(number.value);
        double factor = 1;
        std::string unit = found->value("unit", "");
        if (wanted.has_unit) {
          // Shown in the unit of the print.
          const std::size_t blank = number.value.find_last_of("0123456789. ");
          unit = number.value.substr(blank == std::string::npos ? 0 : blank + 1);
          try {
            const std::size_t start = number.value.find_first_not_of("+-0123456789.eE ");
            unit = start == std::string::npos ? "" : number.value.substr(start);
            factor = parse_quantity("1 " + found->value("unit", "")).value / parse_quantity("1 " + unit).value;
          } catch (const std::invalid_argument&) {
            factor = 1;
          }
        }
        const double printed = wanted.has_unit ? wanted.value / parse_quantity("1 " + unit).value : wanted.value;
        const double ours = value * factor;
        row.ours = error > 0 ? fmt::format("{:.4g} ± {:.2g}", ours, error * factor) : fmt::format("{:.4g}", ours);
        if (!unit.empty() && unit != "1") row.ours += " " + unit;
        const double off = printed != 0 ? (ours - printed) / std::abs(printed) : ours;
        row.agrees = std::abs(off) <= number.relative;
        row.verdict =
            row.agrees ? fmt::format("agrees ({:+.1f} %)", 100 * off) : fmt::format("differs ({:+.1f} %)", 100 * off);
      } else {
        row.ours = "–";
        row.verdict = "not measured";
      }
      rows.push_back(std::move(row));
    }
    return rows;
  }

 private:
  fs::path directory(const PlannedStage& stage) const { return outcome_.out / stage.id; }

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

  // What must be said before any number is read.
  std::string banners() const {
    std::string out;
    for (const PlannedStage& stage : plan_.stages) {
      if (stage.row->name != "fit" || !results_.contains(stage.id)) continue;
      const Json& fit = results_.at(stage.id);
      if (fit.value("describes_data", true)) continue;
      out += fmt::format(
          "<div class=\"banner\"><strong>The profile is not one this model describes</strong>{} ({}): {}. Read no "
          "temperature from it without that.</div>\n",
          html(stage.id), html(fit.value("model", "")), html(fit.value("why_not", "")));
    }
    return out;
  }

  std::string warnings() const {
    if (outcome_.warnings.empty()) return "";
    std::string out = "<div class=\"warnings\"><strong>Warnings</strong><ul>\n";
    for (const std::string& warning : outcome_.warnings) out += fmt::format("<li>{}</li>\n", html(warning));
    return out + "</ul></div>\n";
  }

  std::string figures() {
    std::string out;
    for (const PlannedStage& stage : plan_.stages) {
      if (stage.row->name != "figure" && stage.row->name != "chart") continue;
      std::vector<fs::path> files;
      std::error_code error;
      for (const fs::directory_entry& entry : fs::directory_iterator(directory(stage), error)) {
        if (entry.path().extension() == ".svg") files.push_back(entry.path());
      }
      // In the order of the recipe where there is one, else by name.
      const Json result = results_.contains(stage.id) ? results_.at(stage.id) : Json::object();
      const auto place = [&](const fs::path& path) {
        const auto found = result.is_object() ? result.find(path.stem().string()) : result.end();
        return std::pair(std::distance(result.begin(), found), path);
      };
      std::sort(files.begin(), files.end(), [&](const auto& a, const auto& b) { return place(a) < place(b); });
      for (const fs::path& path : files) {
        const std::string name = path.stem().string();
        const Json* own = find_pointer(result, "/" + escape_pointer_token(name) + "/caption");
        const std::string caption =
            own != nullptr && own->is_string() ? own->get<std::string>()
            : name == "profile"
                ? "Density against height. Error bars: one standard error, correlated frames allowed for."
            : name == "windows" ? "The fitted temperature against the lower edge of the window it is fitted in."
                                : words(name);
        out += fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", inline_svg(path, ++svg_count_),
                           prose(caption));
      }
    }
    return out.empty() ? "" : "<h2>Figures</h2>\n" + out;
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

  std::string claims() const {
    std::string out;
    for (const PlannedStage& stage : plan_.stages) {
      if (stage.row->name != "claims" || !results_.contains(stage.id)) continue;
      out +=
          "<h2>Claim by claim</h2>\n<div class=\"scroll\"><table>\n<tr><th>claim</th><th>claimed</th><th>measured</th>"
          "<th>verdict</th><th>where</th></tr>\n";
      for (const Json& row : results_.at(stage.id).value("claims", Json::array())) {
        const std::string verdict = row.value("verdict", "");
        const auto aside = [&](const char* key) {
          const std::string text = row.value(key, "");
          return text.empty() ? "" : fmt::format("<br><span class=\"soft\">{}</span>", prose(text));
        };
        out += fmt::format(
            "<tr><td>{}{}</td><td>{}</td><td class=\"number\">{}</td><td><span class=\"{}\">{}</span>{}</td><td>{}</td>"
            "</tr>\n",
            prose(row.value("claim", "")), aside("measured_as"), html(row.value("claimed", "")),
            html(row.value("measured", "")),
            verdict == "holds"           ? "good"
            : verdict == "does not hold" ? "bad"
                                         : "soft",
            html(verdict), aside("note"), prose(row.value("place", "")));
      }
      out += "</table></div>\n<p class=\"soft\">" + html(results_.at(stage.id).value("verdict_is", "")) + ".</p>\n";
    }
    return out;
  }

  std::string checks() const {
    std::string out;
    for (const PlannedStage& stage : plan_.stages) {
      if (stage.row->name != "check" || !results_.contains(stage.id)) continue;
      const Json& result = results_.at(stage.id);
      out += fmt::format(
          "<h2>Checks ({})</h2>\n<div "
          "class=\"scroll\"><table>\n<tr><th>verdict</th><th>result</th><th>expected</th><th>found</th><th></th></"
          "tr>\n",
          html(stage.id));
      for (const Json& row : result.value("checks", Json::array())) {
        const bool passed = row.value("passed", false);
        out += fmt::format(
            "<tr><td class=\"{}\">{}</td><td><code>{}</code></td><td>{}</td><td "
            "class=\"number\">{}</td><td>{}</td></tr>\n",
            passed ? "good" : "bad", passed ? "passed" : "failed", html(row.value("pointer", "")),
            html(row.value("expected", "")), html(row.value("found", "")),
            html(row.value("why", row.value("note", ""))));
      }
      out += "</table></div>\n";
    }
    return out;
  }

  std::string bed_in_motion() const {
    for (const PlannedStage& stage : plan_.stages) {
      if (stage.row->name != "simulate" || !results_.contains(stage.id)) continue;
      fs::path path = directory(stage) / "trajectory.extxyz.zst";
      std::error_code error;
      if (!fs::is_regular_file(path, error)) path = directory(stage) / "trajectory.extxyz";
      if (!fs::is_regular_file(path, error)) continue;
      try {
        const BedDescription bed = BedDescription::read(directory(stage) / "bed.json");
        const double unit = bed.reduced || !(bed.gravity.value_or(0) > 0) ? 1 : std::sqrt(bed.diameter / bed.gravity.value_or(1));
        const double frequency = bed.frequency.value_or(0);
        const std::string animation = animation_html(path, frequency > 0 ? 1 / (frequency * unit) : 0);
        if (!animation.empty()) return "<h2>The bed</h2>\n" + animation;
      } catch (const InputError&) {
        continue;
      }
    }
    return "";
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

  std::string overlays() const {
    std::string out;
    for (const PlannedStage& stage : plan_.stages) {
      if (stage.row->name != "extract" || !results_.contains(stage.id)) continue;
      std::vector<fs::path> files;
      std::error_code error;
      for (const fs::directory_entry& entry : fs::directory_iterator(directory(stage), error)) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with("overlay_") && name.ends_with(".png")) files.push_back(entry.path());
      }
      std::sort(files.begin(), files.end());
      if (files.size() > 3) files.resize(3);
      for (const fs::path& path : files) {
        out += fmt::format(
            "<figure><img alt=\"disks found\" src=\"data:image/png;base64,{}\"><figcaption>Disks found in frame {}: "
            "green circles; orange, those cut or half hidden; blue, floor and walls.</figcaption></figure>\n",
            base64(read_file(path)), html(path.stem().string().substr(8)));
      }
      const auto picture = [&](const fs::path& path, const char* caption) {
        if (fs::exists(path))
          out += fmt::format(
              "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>\n",
              caption, base64(read_file(path)));
      };
      for (const fs::path& path : files) {
        const std::string name = "residual_" + path.stem().string().substr(8) + ".png";
        picture(directory(stage) / name,
                "What beads and light do not explain of that frame: grey where nothing is left.");
      }
      picture(directory(stage) / "bead.png", "The bead as learned from the frames.");
      for (const auto& [name, caption] :
           {std::pair{"count.svg", "Disks against time: beads do not vanish, so a dip is a miss."},
            std::pair{"quality.svg", "Quality of the disks found."}})
        if (const fs::path path = directory(stage) / name; fs::exists(path))
          out += fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n",
                             inline_svg(path, 900 + (name[0] == 'q')), caption);
      const Json& result = results_.at(stage.id);
      out += "<div class=\"scroll\"><table>\n<tr><th>from the frames</th><th></th></tr>\n";
      for (const char* key : {"frames_used", "disks_per_frame", "scale", "radius", "width", "column_number", "noise",
                              "contrast", "frequency", "floor_amplitude", "coverage_disagreement"}) {
        if (result.contains(key))
          out += fmt::format("<tr><td>{}</td><td class=\"number\">{}</td></tr>\n", words(key), shown(result[key]));
      }
      if (result.contains("truth")) {
        for (const auto& [key, value] : result["truth"].items())
          out += fmt::format("<tr><td>{} (against the rendered truth)</td><td class=\"number\">{}</td></tr>\n",
                             words(key), shown(value));
      }
      out += "</table></div>\n";
    }
    return out.empty() ? "" : "<h2>Disks in the frames</h2>\n" + out;
  }

  std::string fits() const {
    std::string out;
    for (const PlannedStage& stage : plan_.stages) {
      if (stage.row->name != "fit" || !results_.contains(stage.id)) continue;
      const Json& fit = results_.at(stage.id);
      out += fmt::format(
          "<h2>Fit ({})</h2>\n<p class=\"soft\">{}; window {} to {}, {} bins: {}.</p>\n<div class=\"scroll\"><table>\n",
          html(stage.id), html(fit.value("model", "")), shown(fit["window"]["low"]), shown(fit["window"]["high"]),
          fit["window"].value("bins", 0), html(fit["window"].value("rule", "")));
      out += "<tr><th>number</th><th></th></tr>\n";
      for (const char* key : {"temperature_over_mg", "temperature", "solid_height", "solid_height_by_sum_rule", "shift",
                              "plateau_density", "column_number", "critical_temperature_over_mg",
                              "critical_temperature", "reduced_temperature", "chi2_per_dof", "relative_misfit"}) {
        if (fit.contains(key))
          out += fmt::format("<tr><td>{}</td><td class=\"number\">{}</td></tr>\n", words(key), shown(fit[key]));
      }
      out += "</table></div>\n";
      if (fit.contains("models") && fit["models"].size() > 1) {
        out +=
            "<details><summary>Other models, and φ₀ free, beside it</summary><div "
            "class=\"scroll\"><table>\n<tr><th>model</th><th>φ₀</th><th>T / mgD</th><th>shift / "
            "D</th><th>χ²/dof</th><th>status</th></tr>\n";
        for (const Json& model : fit["models"]) {
          const auto cell = [&](const char* key) { return model.contains(key) ? shown(model[key]) : std::string("–"); };
          out += fmt::format(
              "<tr><td>{}{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td "
              "class=\"number\">{}</td><td class=\"number\">{}</td><td>{}</td></tr>\n",
              html(model.value("model", "")), model.value("plateau_density_free", false) ? ", φ₀ free" : "",
              cell("plateau_density"), cell("temperature"), cell("shift"), cell("chi2_per_dof"),
              html(model.value("status", "")));
        }
        out += "</table></div></details>\n";
      }
    }
    return out;
  }

  // What the map between simulated beds says of this one.
  static std::string simulated_beds(const Json& simulated) {
    const Json asked = simulated.value("at", Json::object());
    std::string at;
    for (const auto& [name, place] : asked.items())
      at += fmt::format("{}{} = {:.4g}{}", at.empty() ? "" : ", ", name, place.get<double>(),
                        name == "frequency"        ? " Hz"
                        : name == "initial_height" ? " D"
                                                   : "");
    const std::string beds = fmt::format("{} simulated beds", simulated.value("beds", 0));
    const Json* reduced = find_pointer(simulated, "/reduced_temperature");
    const Json* over_mg = find_pointer(simulated, "/temperature_over_mg");
    if (reduced == nullptr || !reduced->is_object())
      return fmt::format("<p>The {} give no temperature at {}.</p>\n", html(beds), html(at));
    return fmt::format("<p>Interpolated between {} at {}: T/T_c = <strong>{}</strong>{}{}.</p>\n", html(beds), html(at),
                       shown(*reduced),
                       over_mg != nullptr && over_mg->is_object() ? ", T/(m g) = " + shown(*over_mg) : "",
                       simulated.value("inside", true) ? "" : "; this bed lies outside the table");
  }

  std::string maps() const {
    std::string out;
    for (const PlannedStage& stage : plan_.stages) {
      if (stage.row->name != "map" || !results_.contains(stage.id)) continue;
      const Json& map = results_.at(stage.id);
      if (!map.contains("readings")) continue;
      out += fmt::format(
          "<h2>Γ → T/T_c ({})</h2>\n<p class=\"soft\">Γ = {}. The paper's relation can be read in several ways; none "
          "is claimed. A reading out of its formula's range is marked so.</p>\n",
          html(stage.id), map.contains("gamma") ? shown(map["gamma"]) : "?");
      if (map.contains("measured_reduced_temperature"))
        out += fmt::format("<p>Measured T/T_c = <strong>{}</strong></p>\n", shown(map["measured_reduced_temperature"]));
      if (map.contains("simulated")) out += simulated_beds(map["simulated"]);
      out += "<div class=\"scroll\"><table>\n<tr><th>reading</th><th>H₀ / D</th><th>T/T_c</th><th>in range</th></tr>\n";
      for (const Json& row : map["readings"]) {
        const bool in_range = row.value("in_range", false);
        const auto cell = [&](const char* key) {
          return row.contains(key) && row[key].is_object() ? shown(row[key]) : std::string("–");
        };
        out += fmt::format(
            "<tr><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"{}\">{}</td></tr>\n",
            html(row.value("name", "")), cell("jump"), cell("reduced_temperature"), in_range ? "good" : "bad",
            in_range ? "yes" : "no");
      }
      out += "</table></div>\n";
    }
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
      const std::string time = stage.record ? duration_text(stage.record->wall_seconds) : "";
      const std::string state = stage.state == StageState::kept ? "kept" : std::string(to_string(stage.state));
      svg += fmt::format(
          "<g><title>{}</title><rect class=\"{}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"6\"/><text "
          "x=\"{}\" y=\"{}\">{}</text><text class=\"small\" x=\"{}\" y=\"{}\">{}{}{}</text></g>\n",
          html(plan_.stages[i].row->summary), stage.state == StageState::failed ? "failed" : "", x_of(i), y_of(i),
          box_width, box_height, x_of(i) + 10, y_of(i) + 23,
          html(stage.id.size() <= 14 ? stage.id : stage.id.substr(0, 13) + "…"), x_of(i) + 10, y_of(i) + 42,
          html(state), time.empty() ? "" : ", ", time);
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
  std::map<std::string, Json> results_;
  int svg_count_ = 0;
};

}  // namespace

std::string report_html(const Plan& plan, const RunOutcome& outcome) { return Report(plan, outcome).page(); }

std::string sweep_report_html(const Plan& plan, const std::vector<std::vector<std::string>>& table,
                              const std::vector<fs::path>& figures, const std::vector<std::string>& problems) {
  constexpr std::size_t most_rows = 500;
  const std::string title = plan.report.title.empty() ? plan.name : plan.report.title;
  std::string out = page_head(title);
  for (const std::string& paragraph : plan.report.text) out += fmt::format("<p>{}</p>\n", prose(paragraph));
  if (!problems.empty()) {
    out += "<div class=\"warnings\"><strong>Points that failed</strong><ul>\n";
    for (const std::string& problem : problems) out += fmt::format("<li>{}</li>\n", html(problem));
    out += "</ul></div>\n";
  }
  if (!plan.warnings.empty()) {
    out += "<div class=\"warnings\"><strong>Warnings</strong><ul>\n";
    for (const Warning& warning : plan.warnings)
      out += fmt::format("<li>{}: {}. {}</li>\n", html(warning.problem.pointer), html(warning.problem.what),
                         html(warning.problem.suggestion));
    out += "</ul></div>\n";
  }
  int number = 0;
  for (const fs::path& figure : figures) {
    out += fmt::format("<figure>{}</figure>\n", inline_svg(figure, ++number));
  }
  out += fmt::format("<h2>{} points</h2>\n<div class=\"scroll\"><table>\n", table.empty() ? 0 : table.size() - 1);
  for (std::size_t i = 0; i < table.size() && i <= most_rows; ++i) {
    out += "<tr>";
    for (const std::string& cell : table[i]) {
      out += (i == 0 ? "<th>" : "<td class=\"number\">") + html(cell) + (i == 0 ? "</th>" : "</td>");
    }
    out += "</tr>\n";
  }
  out += "</table></div>\n";
  if (table.size() > most_rows + 1)
    out += fmt::format("<p>The first {} of them; all are in sweep.csv.</p>\n", most_rows);
  return out + "</main>\n</body>\n</html>\n";
}

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

namespace {
// A cell of a Markdown table, or a line of text, with nothing in it that Markdown or HTML would take as its own.
std::string markdown(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\n' || c == '\r')
      out += ' ';
    else if (c == '<')
      out += "&lt;";
    else if (c == '&')
      out += "&amp;";
    else if (std::string_view("|`*_[]\\#").find(c) != std::string_view::npos)
      out += '\\', out += c;
    else
      out += c;
  }
  return out;
}
}  // namespace

std::string summary_markdown(const Plan& plan, const RunOutcome& outcome) {
  const std::string title = plan.report.title.empty() ? plan.name : plan.report.title;
  std::string out = fmt::format("# {}\n\n**{}** in {}\n", markdown(title),
                                outcome.code == exit_ok             ? "Passed"
                                : outcome.code == exit_check_failed ? "A check failed"
                                : outcome.code == exit_interrupted  ? "Interrupted"
                                                                    : "Stopped",
                                duration_text(outcome.wall_seconds));
  if (!outcome.error.empty()) out += fmt::format("\n> {}\n", markdown(outcome.error));
  for (std::size_t i = 0; i < plan.stages.size() && i < outcome.stages.size(); ++i) {
    const PlannedStage& stage = plan.stages[i];
    const fs::path path = outcome.out / stage.id / "check.json";
    std::error_code error;
    if (stage.row->name != "check" || !outcome.stages[i].record || !fs::is_regular_file(path, error)) continue;
    out += fmt::format("\n## Checks ({})\n\n| | result | expected | found | |\n|---|---|---|---|---|\n",
                       markdown(stage.id));
    const Json result = read_json(path);
    for (const Json& row : result.value("checks", Json::array())) {
      out += fmt::format("| {} | {} | {} | {} | {} |\n", row.value("passed", false) ? "passed" : "**failed**",
                         markdown(row.value("pointer", "")), markdown(row.value("expected", "")),
                         markdown(row.value("found", "")), markdown(row.value("why", row.value("note", ""))));
    }
  }
  if (const auto rows = Report(plan, outcome).published_rows(); !rows.empty()) {
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
  out += "\n## Stages\n\n| stage | kind | | time |\n|---|---|---|---|\n";
  for (const StageOutcome& stage : outcome.stages) {
    out += fmt::format("| {} | {} | {} | {} |\n", markdown(stage.id), stage.kind, to_string(stage.state),
                       stage.record ? duration_text(stage.record->wall_seconds) : "");
  }
  return out + fmt::format("\nshakebed {} ({})\n", program_version(), source_revision());
}

std::string sweep_summary_markdown(const Plan& plan, const std::vector<std::vector<std::string>>& table,
                                   const std::vector<std::string>& problems) {
  constexpr std::size_t most_rows = 50;
  std::size_t good = 0;
  for (std::size_t i = 1; i < table.size(); ++i) good += table[i][2] == "ok";
  const std::size_t points = table.size() - 1;
  std::string out = fmt::format("# {}\n\n**{} of {} points are well**\n",
                                markdown(plan.report.title.empty() ? plan.name : plan.report.title), good, points);
  if (!problems.empty()) {
    out += "\n## Points that failed\n\n";
    for (const std::string& problem : problems) out += fmt::format("- {}\n", markdown(problem));
  }
  out += "\n## Points\n\n";
  for (std::size_t i = 0; i < table.size() && i <= most_rows; ++i) {
    for (const std::string& cell : table[i]) out += fmt::format("| {} ", markdown(cell));
    out += "|\n";
    if (i == 0) {
      for (std::size_t k = 0; k < table[i].size(); ++k) out += "|---";
      out += "|\n";
    }
  }
  if (points > most_rows) out += fmt::format("\nThe first {}; all are in sweep.csv.\n", most_rows);
  return out;
}

}  // namespace shakebed::pipelines
