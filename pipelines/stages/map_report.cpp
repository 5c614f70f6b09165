// The page of a map stage: the formulas Gamma → T/T_c, and the temperature from simulated beds.
#include <fmt/format.h>

#include <algorithm>

#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/map.hpp"

namespace shakebed::pipelines {
namespace {

// What the map between simulated beds says of this one.
std::string simulated_beds(const Json& simulated) {
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
    return fmt::format("<p>The {} give no temperature at {}.</p>\n", escape_markup(beds), escape_markup(at));
  return fmt::format("<p>Interpolated between {} at {}: T/T_c = <strong>{}</strong>{}{}.</p>\n", escape_markup(beds),
                     escape_markup(at), shown(*reduced),
                     over_mg != nullptr && over_mg->is_object() ? ", T/(m g) = " + shown(*over_mg) : "",
                     simulated.value("inside", true) ? "" : "; this bed lies outside the table");
}

std::string readings_html(const FinishedStage& stage, int&) {
  const Json& map = stage.result;
  if (!map.contains("readings")) return "";
  std::string out = fmt::format(
      "<h2>Γ → T/T_c ({})</h2>\n<p class=\"soft\">Γ = {}. The relation of Quinn and Hong (2000) allows several "
      "formulas, and none of them is preferred. A formula that does not apply at this Γ is marked.</p>\n",
      escape_markup(stage.files.id), map.contains("gamma") ? shown(map["gamma"]) : "?");
  if (map.contains("measured_reduced_temperature"))
    out += fmt::format("<p>Measured T/T_c = <strong>{}</strong></p>\n", shown(map["measured_reduced_temperature"]));
  if (map.contains("simulated")) out += simulated_beds(map["simulated"]);
  out += "<div class=\"scroll\"><table>\n<tr><th>formula</th><th>H₀ / D</th><th>T/T_c</th><th>in range</th></tr>\n";
  for (const Json& row : map["readings"]) {
    const bool in_range = row.value("in_range", false);
    const auto cell = [&](const char* key) {
      return row.contains(key) && row[key].is_object() ? shown(row[key]) : std::string("–");
    };
    out += fmt::format(
        "<tr><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"{}\">{}</td></tr>\n",
        escape_markup(row.value("name", "")), cell("jump"), cell("reduced_temperature"), in_range ? "good" : "bad",
        in_range ? "yes" : "no");
  }
  return out + "</table></div>\n";
}

// Of a Gamma that was given with its error: what it is, since all temperatures of the map follow from it.
std::string gamma_terminal(const FinishedStage& stage) {
  const Json& map = stage.result;
  if (find_pointer(map, "/gamma/std_error") == nullptr || !map.contains("readings")) return "";
  double least = 0, most = 0;
  std::size_t formulas = 0;
  for (const Json& row : map["readings"]) {
    const Json* reduced = find_pointer(row, "/reduced_temperature/value");
    if (!row.value("in_range", false) || reduced == nullptr) continue;
    const double value = reduced->get<double>();
    least = formulas == 0 ? value : std::min(least, value), most = std::max(most, value);
    ++formulas;
  }
  std::string text = fmt::format("{}: Gamma = {}", stage.files.id, shown(map["gamma"]));
  text += formulas == 0
              ? ", at which no formula for T applies"
              : fmt::format(". From it {} {} T/T_c", formulas, formulas == 1 ? "formula gives" : "formulas give");
  if (formulas == 1) text += fmt::format(" = {:.3g}", least);
  if (formulas > 1) text += fmt::format(" from {:.3g} to {:.3g}", least, most);
  return text + "\n";
}

}  // namespace

StagePages map_pages() {
  return {
      .sections = {{ReportPlace::maps, "", readings_html}},
      .warnings =
          {{"Gamma = ", WarningEffect::answer, "Check amplitude and frequency: every T of the map follows from them."},
           {"formulas", WarningEffect::rest, "Use the formulas that are marked as in range in the table of the map."},
           {"", WarningEffect::rest, "Simulate beds with parameters nearer to this one, and give them as \"table\"."}},
      .terminal = gamma_terminal};
}

}  // namespace shakebed::pipelines
