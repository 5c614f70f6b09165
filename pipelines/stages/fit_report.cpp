// What the pages and the terminal show of a fit stage: its numbers, the other models beside it, and what speaks against
// reading a temperature from it.
#include <fmt/format.h>

#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/answer.hpp"
#include "pipelines/stages/fit.hpp"

namespace shakebed::pipelines {
namespace {

// The answer first, then what to do about it.
std::string answer_html(const FinishedStage& stage, int&) {
  const Json* answer = find_pointer(stage.result, "/answer");
  if (answer == nullptr) return "";
  return fmt::format("<div class=\"answer\"><strong>{}: {}</strong><br>{}</div>\n", escape_markup(stage.files.id),
                     escape_markup(answer_text(*answer)), escape_markup(answer->value("advice", "")));
}

std::string answer_markdown(const FinishedStage& stage) {
  const Json* answer = find_pointer(stage.result, "/answer");
  if (answer == nullptr) return "";
  return fmt::format("**{}**: {} {}\n\n", stage.files.id, answer_text(*answer), answer->value("advice", ""));
}

std::string banner_html(const FinishedStage& stage, int&) {
  if (stage.result.value("describes_data", true)) return "";
  return fmt::format(
      "<div class=\"banner\"><strong>The profile is not one this model describes</strong>{} ({}): {}. Read no "
      "temperature from it without that.</div>\n",
      escape_markup(stage.files.id), escape_markup(stage.result.value("model", "")),
      escape_markup(stage.result.value("why_not", "")));
}

std::string models_html(const Json& models) {
  std::string out =
      "<details><summary>Other models, and φ₀ free, beside it</summary><div "
      "class=\"scroll\"><table>\n<tr><th>model</th><th>φ₀</th><th>T / mgD</th><th>shift / "
      "D</th><th>χ²/dof</th><th>status</th></tr>\n";
  for (const Json& model : models) {
    const auto cell = [&](const char* key) { return model.contains(key) ? shown(model[key]) : std::string("–"); };
    out += fmt::format(
        "<tr><td>{}{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td "
        "class=\"number\">{}</td><td class=\"number\">{}</td><td>{}</td></tr>\n",
        escape_markup(model.value("model", "")), model.value("plateau_density_free", false) ? ", φ₀ free" : "",
        cell("plateau_density"), cell("temperature"), cell("shift"), cell("chi2_per_dof"),
        escape_markup(model.value("status", "")));
  }
  return out + "</table></div></details>\n";
}

std::string fit_html(const FinishedStage& stage, int&) {
  const Json& fit = stage.result;
  std::string out = fmt::format(
      "<h2>Fit ({})</h2>\n<p class=\"soft\">{}; window {} to {}, {} bins: {}.</p>\n<div class=\"scroll\"><table>\n",
      escape_markup(stage.files.id), escape_markup(fit.value("model", "")), shown(fit["window"]["low"]),
      shown(fit["window"]["high"]), fit["window"].value("bins", 0), escape_markup(fit["window"].value("rule", "")));
  out += "<tr><th>number</th><th></th></tr>\n";
  for (const char* key : {"temperature_over_mg", "temperature", "solid_height", "solid_height_by_sum_rule", "shift",
                          "plateau_density", "column_number", "critical_temperature_over_mg", "critical_temperature",
                          "reduced_temperature", "chi2_per_dof", "relative_misfit"}) {
    if (fit.contains(key))
      out += fmt::format("<tr><td>{}</td><td class=\"number\">{}</td></tr>\n", words(key), shown(fit[key]));
  }
  out += "</table></div>\n";
  return fit.contains("models") && fit["models"].size() > 1 ? out + models_html(fit["models"]) : out;
}

// "T/(m g) = 0.62 ± 0.03 mm, T/T_c = 0.76 ± 0.04, solid = 4.3 ± 0.6 D high".
std::string numbers_text(const FinishedStage& stage) {
  const Json& fit = stage.result;
  std::string numbers;
  const auto add = [&](const char* key, const char* label, double factor, const char* unit) {
    const Json* value = find_pointer(fit, fmt::format("/{}/value", key));
    const Json* spread = find_pointer(fit, fmt::format("/{}/std_error", key));
    if (value == nullptr || !value->is_number()) return false;
    numbers += fmt::format("{}{} = {:.4g}", numbers.empty() ? "" : ", ", label, factor * value->get<double>());
    if (spread != nullptr && spread->is_number() && spread->get<double>() > 0)
      numbers += fmt::format(" ± {:.2g}", factor * spread->get<double>());
    numbers += unit;
    return true;
  };
  const Json* unit = find_pointer(fit, "/temperature_over_mg/unit");
  if (unit == nullptr || *unit != "m" || !add("temperature_over_mg", "T/(m g)", 1e3, " mm"))
    add("temperature", "T", 1, " m g D");
  add("reduced_temperature", "T/T_c", 1, "");
  add("solid_height", "solid", 1, " D high");
  const Json* answer = find_pointer(fit, "/answer");
  std::string text;
  if (answer != nullptr)
    text = fmt::format("{}: {} {}\n", stage.files.id, answer_text(*answer), answer->value("advice", ""));
  if (!numbers.empty())
    text += fmt::format("{} ({} alone): {}\n", stage.files.id, fit.value("model", "model"), numbers);
  return text;
}

}  // namespace

StagePages fit_pages() {
  return {.sections = {{ReportPlace::banner, "", answer_html},
                       {ReportPlace::banner, "", banner_html},
                       {ReportPlace::fits, "", fit_html}},
          .markdown = answer_markdown,
          .terminal = numbers_text};
}

}  // namespace shakebed::pipelines
