// What the pages show of a check stage: verdict by verdict.
#include <fmt/format.h>

#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/check.hpp"

namespace shakebed::pipelines {
namespace {

std::string checks_html(const FinishedStage& stage, int&) {
  const std::vector<std::string> head{"verdict", "result", "expected", "found", ""};
  std::string out = fmt::format("<h2>Checks ({})</h2>\n<div class=\"scroll\"><table class=\"stack\">\n",
                                escape_markup(stage.files.id)) +
                    table_head({"verdict", "result", "expected", "found", "note"});
  for (const Json& row : stage.result.value("checks", Json::array())) {
    const bool passed = row.value("passed", false);
    out += table_row(head, {{passed ? "passed" : "failed", passed ? "good" : "bad"},
                            {"<code>" + escape_markup(row.value("pointer", "")) + "</code>"},
                            {escape_markup(row.value("expected", ""))},
                            {escape_markup(row.value("found", "")), "number"},
                            {escape_markup(row.value("why", row.value("note", "")))}});
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
