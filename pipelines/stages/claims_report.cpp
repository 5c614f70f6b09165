// What the page shows of a claims stage: claim by claim.
#include <fmt/format.h>

#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/claims.hpp"

namespace shakebed::pipelines {
namespace {

std::string_view colour_of(const std::string& verdict) {
  return verdict == "holds" ? "good" : verdict == "does not hold" ? "bad" : "soft";
}

// The main claims: what is said, what was measured, whether it holds.
std::string lead_html(const FinishedStage& stage, int&) {
  std::string out;
  for (const Json& row : stage.result.value("claims", Json::array())) {
    if (!row.value("main", false)) continue;
    const std::string verdict = row.value("verdict", ""), measured_as = row.value("measured_as", "");
    out += fmt::format(
        "<p><strong>Claim:</strong> {} ({}).<br><strong>Measured:</strong> {}{}. <strong>Verdict:</strong> <span "
        "class=\"{}\">{}</span></p>\n",
        prose(row.value("claim", "")), escape_markup(row.value("claimed", "")),
        escape_markup(row.value("measured", "")), measured_as.empty() ? "" : " (" + prose(measured_as) + ")",
        colour_of(verdict), escape_markup(verdict));
  }
  return out.empty() ? out : "<div class=\"lead\">\n" + out + "</div>\n";
}

std::string claims_html(const FinishedStage& stage, int&) {
  std::string out =
      "<h2>Claim by claim</h2>\n<div class=\"scroll\"><table>\n<tr><th>claim</th><th>claimed</th><th>measured</th>"
      "<th>verdict</th><th>where</th></tr>\n";
  for (const Json& row : stage.result.value("claims", Json::array())) {
    const std::string verdict = row.value("verdict", "");
    const auto aside = [&](const char* key) {
      const std::string text = row.value(key, "");
      return text.empty() ? "" : fmt::format("<br><span class=\"soft\">{}</span>", prose(text));
    };
    out += fmt::format(
        "<tr><td>{}{}</td><td>{}</td><td class=\"number\">{}</td><td><span class=\"{}\">{}</span>{}</td><td>{}</td>"
        "</tr>\n",
        prose(row.value("claim", "")), aside("measured_as"), escape_markup(row.value("claimed", "")),
        escape_markup(row.value("measured", "")), colour_of(verdict), escape_markup(verdict), aside("note"),
        prose(row.value("place", "")));
  }
  return out + "</table></div>\n<p class=\"soft\">" + escape_markup(stage.result.value("verdict_is", "")) + ".</p>\n";
}

}  // namespace

StagePages claims_pages() {
  return {.sections = {{ReportPlace::lead, "", lead_html}, {ReportPlace::claims, "", claims_html}}};
}

}  // namespace shakebed::pipelines
