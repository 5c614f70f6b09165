// What the pages and the terminal show of a fit stage: its numbers, the other models beside it, and what speaks against
// reading a temperature from it.
#include <fmt/format.h>

#include <cctype>
#include <optional>
#include <utility>

#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/answer.hpp"
#include "pipelines/stages/fit.hpp"

namespace shakebed::pipelines {
namespace {

std::string capitalised(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

// A number of the answer in its scale, nothing where there is none.
std::optional<double> in_scale(const Json& answer, const std::string& pointer, double factor) {
  const Json* found = find_pointer(answer, pointer);
  return found != nullptr && found->is_number() ? std::optional(factor * found->get<double>()) : std::nullopt;
}

std::string fact(const std::string& name, const std::string& value) {
  return "<div><dt>" + prose(name) + "</dt><dd>" + value + "</dd></div>\n";
}

// "0.281 ± 0.004 mm" at a pointer to a temperature; "" where there is none.
std::string temperature_text(const Json& answer, const std::string& pointer, const AnswerScale& scale) {
  const auto value = in_scale(answer, pointer + "/value", scale.factor),
             error = in_scale(answer, pointer + "/std_error", scale.factor);
  if (!value) return "";
  return fmt::format("{:.4g}{} {}", *value, error && *error > 0 ? fmt::format(" ± {:.2g}", *error) : "", scale.unit);
}

// "T/(m g) = <data>0.6076</data> ± 0.028 mm", or the range where the bed has no single temperature.
std::string number_html(const Json& answer, const AnswerScale& scale) {
  const auto low = in_scale(answer, "/interval/low/value", scale.factor),
             high = in_scale(answer, "/interval/high/value", scale.factor);
  if (is_range(answer) && high && *high == 0) return prose(scale.name) + " = 0";
  if (is_range(answer) && low && high && *low == 0)
    return fmt::format("{} below <data value=\"{}\">{:.3g}</data> {}", prose(scale.name), number_text(*high), *high,
                       scale.unit);
  if (is_range(answer) && low && high)
    return fmt::format("{} between <data value=\"{}\">{:.3g}</data> and <data value=\"{}\">{:.3g}</data> {}",
                       prose(scale.name), number_text(*low), *low, number_text(*high), *high, scale.unit);
  const auto value = in_scale(answer, "/temperature/value", scale.factor),
             error = in_scale(answer, "/temperature/std_error", scale.factor);
  if (!value) return "";
  return fmt::format("{} = <data value=\"{}\">{:.4g}</data> ± {:.2g} {}", prose(scale.name), number_text(*value),
                     *value, error.value_or(0), scale.unit);
}

// A headline with number, verdict and reason; then T_x, T_z, the solid's height as facts, and the advice.
std::string answer_html(const Json& answer) {
  const AnswerScale scale = answer_scale(answer);
  const bool one = is_one_temperature(answer.value("verdict", ""));
  std::string out = fmt::format(
      "<section class=\"answer {}\" aria-label=\"the answer\">\n<p class=\"headline\"><span class=\"number\">{}</span> "
      "<span "
      "class=\"verdict {}\">{}</span></p>\n<p>{}</p>\n",
      one ? "good-answer" : "bad-answer", number_html(answer, scale), one ? "good" : "bad",
      escape_markup(capitalised(verdict_text(answer))), prose(capitalised(answer.value("why", ""))));
  std::string facts;
  const auto low = in_scale(answer, "/interval/low/value", scale.factor),
             high = in_scale(answer, "/interval/high/value", scale.factor);
  if (low && high && !is_range(answer))
    facts += fact("95 % interval", fmt::format("{:.3g} to {:.3g} {}", *low, *high, scale.unit));
  for (const auto& [pointer, label] :
       {std::pair("/temperature_x", "kinetic T_x"), std::pair("/temperature_z", "kinetic T_z")}) {
    if (const std::string text = temperature_text(answer, pointer, scale); !text.empty())
      facts += fact(std::string(label) + (scale.factor == 1 ? "" : " /(m g)"), text);
  }
  if (const Json* solid = find_pointer(answer, "/solid_height"); solid != nullptr && solid->is_object())
    facts += fact("height of the solid", shown(*solid));
  if (const std::string model = answer.value("model", ""); !model.empty()) facts += fact("model", escape_markup(model));
  if (!facts.empty()) out += "<dl class=\"facts\">\n" + facts + "</dl>\n";
  if (const std::string advice = answer.value("advice", ""); !advice.empty())
    out += "<p class=\"soft\">" + prose(advice) + "</p>\n";
  return out + "</section>\n";
}

// The first fit of the recipe gives the answer of the page; those after it show theirs with their numbers.
std::string fit_lead_html(const FinishedStage& stage, int&) {
  const Json* answer = find_pointer(stage.result, "/answer");
  return answer == nullptr ? "" : answer_html(*answer);
}

// The solid's height by the model of the fit, where the answer as a whole gives none.
std::string solid_fact_html(const FinishedStage& stage, int&) {
  const Json *all = find_pointer(stage.result, "/answer/solid_height"),
             *own = find_pointer(stage.result, "/solid_height");
  if ((all != nullptr && all->is_object()) || own == nullptr || !own->is_object()) return "";
  if (!stage.result.value("describes_data", true)) return "";
  return fact("height of the solid, by " + stage.result.value("model", "the model") + " alone", shown(*own));
}

std::string answer_markdown(const FinishedStage& stage) {
  const Json* answer = find_pointer(stage.result, "/answer");
  if (answer == nullptr) return "";
  return fmt::format("**{}**: {} {}\n\n", stage.files.id, answer_text(*answer), answer->value("advice", ""));
}

// Only where there is no answer: else the answer says what speaks against a temperature, and nothing else does.
std::string banner_html(const FinishedStage& stage, int&) {
  if (stage.result.value("describes_data", true) || stage.result.contains("answer")) return "";
  return fmt::format(
      "<div class=\"banner\"><strong>The model does not describe the profile</strong>{} ({}): {}. Do not quote a "
      "temperature from this fit.</div>\n",
      escape_markup(stage.files.id), escape_markup(stage.result.value("model", "")),
      escape_markup(stage.result.value("why_not", "")));
}

std::string models_html(const Json& models) {
  std::string out =
      "<details><summary>Fits of other models, and with φ₀ free</summary><div "
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
  std::string out = fmt::format("<h2>Fit ({})</h2>\n", escape_markup(stage.files.id));
  if (const Json* answer = find_pointer(fit, "/answer"); answer != nullptr)
    out += fmt::format("<p><strong>{}</strong></p>\n", prose(answer_text(*answer)));
  if (!fit.value("describes_data", true))
    out += fmt::format(
        "<p>The model alone does not describe this profile: {}. Its numbers below are not those of the bed.</p>\n",
        prose(fit.value("why_not", "")));
  out += fmt::format("<p class=\"soft\">{}; window {} to {}, {} bins: {}.</p>\n", escape_markup(fit.value("model", "")),
                     shown(fit["window"]["low"]), shown(fit["window"]["high"]), fit["window"].value("bins", 0),
                     escape_markup(fit["window"].value("rule", "")));
  if (!fit.contains("temperature")) return out;
  out += "<div class=\"scroll\"><table>\n<tr><th>number</th><th></th></tr>\n";
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
  if (const Json* solid = find_pointer(fit, "/solid_height/value"); solid != nullptr && *solid == 0)
    numbers += numbers.empty() ? "" : ", no solid";
  else
    add("solid_height", "solid", 1, " D high");
  const Json* answer = find_pointer(fit, "/answer");
  std::string text;
  if (answer != nullptr)
    text = fmt::format("{}: {} {}\n", stage.files.id, answer_text(*answer), answer->value("advice", ""));
  // Where the answer gives no number, a model alone gives none either.
  if (!numbers.empty() && (answer == nullptr || answer->contains("temperature")))
    text += fmt::format("{} ({} alone): {}\n", stage.files.id, fit.value("model", "model"), numbers);
  return text;
}

std::vector<WarningAdvice> fit_warnings() {
  using enum WarningEffect;
  return {{"alone does not describe", rest,
           "Quote the answer, which does not depend on this model. Do not quote the T of this model."},
          {"does not describe", answer,
           "Do not quote T from this fit. Look at the residuals, and try another model or window."},
          {"model does not fit", answer,
           "Look at the residuals in the figure. Where they are large, the model is wrong or the measured density is "
           "biased. Quote T with the whole uncertainty of the answer, not with the error of the fit."},
          {"changes with the window", answer,
           "Quote the answer: it compares windows and models, and states whether the bed has one temperature. To get "
           "one, shake faster with a smaller amplitude, or use less dissipative beads."},
          {"most of chi2", answer, "Look at this height in the figure. If it is an outlier, set \"robust\"."},
          {"positive definite", answer, "Measure longer: the correlations between heights are poorly known."},
          {"ignores correlations", answer,
           "To use the correlations between heights, measure longer or in more independent runs."},
          {"window rule", answer, "Give \"window\", or measure the profile at more closely spaced heights."},
          {"sum rule", answer,
           "The plateau density may be wrong: fit it too (\"plateau_density_free\"), and compare the models below."},
          {"no solid", answer, "T is above T_c in this model: quote T, but no height of the solid."},
          {"plateau density", answer,
           "Give \"plateau_density\", or lower the window so that it contains part of the plateau."},
          {"heights span", answer, "Give the heights in disk diameters, not in metres."},
          {"close packing", answer, "Check the diameter D, and that the density is n D^2 (n: disks per area)."},
          {"standard error", answer, "Give a column std_error: the error of T follows from it."},
          {"the height of another bin", answer, "Remove the repeated rows if they are not independent measurements."},
          {"through which kernel", answer,
           "Give the kernel, for example \"kernel\": \"gaussian:0.5\". Without it the width of the kernel makes T too "
           "high."},
          {"library", answer, "Simulate beds for the library that are more similar to this one."},
          {"ascending order", rest, "Nothing: the bins were sorted."},
          {"", answer, "See the figure of the profile and the table of models."}};
}

}  // namespace

StagePages fit_pages() {
  return {.sections = {{.place = ReportPlace::lead, .html = fit_lead_html, .once = true},
                       {.place = ReportPlace::facts, .html = solid_fact_html, .once = true},
                       {ReportPlace::banner, "", banner_html},
                       {ReportPlace::fits, "", fit_html}},
          .warnings = fit_warnings(),
          .markdown = answer_markdown,
          .terminal = numbers_text};
}

}  // namespace shakebed::pipelines
