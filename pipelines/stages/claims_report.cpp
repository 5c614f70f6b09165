// What the page shows of a claims stage: claim by claim.
#include <fmt/format.h>

#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/claims.hpp"

namespace shakebed::pipelines {
namespace {

std::string_view colour_of(const std::string& verdict) {
  return verdict == "holds" ? "good" : verdict == "does not hold" ? "bad" : "soft";
}

std::string_view tone_of(const std::string& verdict) {
  return verdict == "holds" ? "good-answer" : verdict == "does not hold" ? "bad-answer" : "";
}

// The main claims: what is said, whether it holds, what was measured.
std::string claim_lead_html(const FinishedStage& stage, int&) {
  std::string out;
  for (const Json& row : stage.result.value("claims", Json::array())) {
    if (!row.value("main", false)) continue;
    const std::string verdict = row.value("verdict", ""), measured_as = row.value("measured_as", "");
    out += fmt::format(
        "<section class=\"answer {}\" aria-label=\"the claim\">\n<p class=\"headline\"><strong>Claim:</strong> {} "
        "<span "
        "class=\"verdict {}\">{}</span></p>\n<dl class=\"facts\"><div><dt>claimed <span class=\"tag "
        "published\">published</span></dt><dd>{}</dd></div>\n<div><dt>measured <span class=\"tag "
        "computed\">computed</span></dt><dd>{}{}</dd></div></dl>\n</section>\n",
        tone_of(verdict), prose(row.value("claim", "")), colour_of(verdict), escape_markup(verdict),
        escape_markup(row.value("claimed", "")), escape_markup(row.value("measured", "")),
        measured_as.empty() ? "" : "<br><span class=\"soft\">" + prose(measured_as) + "</span>");
  }
  return out;
}

std::string claims_html(const FinishedStage& stage, int&) {
  const std::vector<std::string> head{"claim", "claimed", "measured", "verdict", "where"};
  std::string out =
      "<h2>Claim by claim</h2>\n<div class=\"scroll\"><table class=\"stack\">\n<tr><th>claim</th><th "
      "class=\"published\">claimed <span class=\"tag published\">published</span></th><th class=\"computed\">measured "
      "<span "
      "class=\"tag computed\">computed</span></th><th>verdict</th><th>where</th></tr>\n";
  for (const Json& row : stage.result.value("claims", Json::array())) {
    const std::string verdict = row.value("verdict", "");
    const auto aside = [&](const char* key) {
      const std::string text = row.value(key, "");
      return text.empty() ? "" : fmt::format("<br><span class=\"soft\">{}</span>", prose(text));
    };
    out += table_row(
        head,
        {{prose(row.value("claim", "")) + aside("measured_as")},
         {escape_markup(row.value("claimed", ""))},
         {escape_markup(row.value("measured", "")), "number"},
         {fmt::format("<span class=\"{}\">{}</span>{}", colour_of(verdict), escape_markup(verdict), aside("note"))},
         {prose(row.value("place", ""))}});
  }
  return out + "</table></div>\n<p class=\"soft\">" + escape_markup(stage.result.value("verdict_is", "")) + ".</p>\n";
}

}  // namespace

StagePages claims_pages() {
  return {.sections = {{ReportPlace::lead, "", claim_lead_html}, {ReportPlace::claims, "", claims_html}}};
}

}  // namespace shakebed::pipelines
