// What the pages show of a check stage: verdict by verdict.
#include <fmt/format.h>

#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/check.hpp"

namespace shakebed::pipelines {
namespace {

std::string checks_html(const FinishedStage& stage, int&) {
  std::string out = fmt::format(
      "<h2>Checks ({})</h2>\n<div "
      "class=\"scroll\"><table>\n<tr><th>verdict</th><th>result</th><th>expected</th><th>found</th><th></th></"
      "tr>\n",
      escape_markup(stage.files.id));
  for (const Json& row : stage.result.value("checks", Json::array())) {
    const bool passed = row.value("passed", false);
    out += fmt::format(
        "<tr><td class=\"{}\">{}</td><td><code>{}</code></td><td>{}</td><td "
        "class=\"number\">{}</td><td>{}</td></tr>\n",
        passed ? "good" : "bad", passed ? "passed" : "failed", escape_markup(row.value("pointer", "")),
        escape_markup(row.value("expected", "")), escape_markup(row.value("found", "")),
        escape_markup(row.value("why", row.value("note", ""))));
  }
  return out + "</table></div>\n";
}

std::string checks_markdown(const FinishedStage& stage) {
  std::string out = fmt::format("\n## Checks ({})\n\n| | result | expected | found | |\n|---|---|---|---|---|\n",
                                markdown(stage.files.id));
  for (const Json& row : stage.result.value("checks", Json::array())) {
    out += fmt::format("| {} | {} | {} | {} | {} |\n", row.value("passed", false) ? "passed" : "**failed**",
                       markdown(row.value("pointer", "")), markdown(row.value("expected", "")),
                       markdown(row.value("found", "")), markdown(row.value("why", row.value("note", ""))));
  }
  return out;
}

}  // namespace

StagePages check_pages() { return {.sections = {{ReportPlace::checks, "", checks_html}}, .markdown = checks_markdown}; }

}  // namespace shakebed::pipelines
