#include "pipelines/cli/results_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "pipelines/formats/embedded.hpp"

namespace shakebed::pipelines {
namespace {

// A recipe as the page shows it.
struct ShownRecipe {
  std::string name, title;
  std::vector<std::string> text;
  Json record;  // null where there is none
};

ShownRecipe shown(const ShippedRecipe& recipe) {
  const Json document = parse_own_json(recipe.file->text);
  const Json report = document.value("report", Json::object());
  ShownRecipe out{recipe.name, report.value("title", recipe.name), {}, Json()};
  if (report.contains("text")) out.text = report["text"].get<std::vector<std::string>>();
  if (const EmbeddedFile* record = find_embedded("results/" + recipe.name + ".json"))
    out.record = parse_own_json(record->text);
  return out;
}

std::vector<Json> claims_of(const ShownRecipe& recipe, bool main_only) {
  std::vector<Json> claims;
  if (recipe.record.is_null()) return claims;
  for (const Json& claim : recipe.record["claims"]) {
    if (!main_only || claim.value("main", false)) claims.push_back(claim);
  }
  return claims;
}

std::string table_cell(const std::string& text) {
  std::string out;
  for (const char letter : text) out += letter == '|' ? std::string("\\|") : std::string(1, letter);
  return out;
}

std::string claim_row(const Json& claim, const std::string& first) {
  const std::string measured_as = claim.value("measured_as", "");
  return fmt::format("| {}{}{} | {} | {} | {} |", first, table_cell(claim.value("claim", "")),
                     measured_as.empty() ? "" : " (" + table_cell(measured_as) + ")",
                     table_cell(claim.value("claimed", "")), table_cell(claim.value("measured", "")),
                     claim.value("verdict", ""));
}

// "3 of 5 claims hold, 1 does not hold, 1 open".
std::string counted(const std::vector<Json>& claims) {
  std::map<std::string, int> counts;
  for (const Json& claim : claims) ++counts[claim.value("verdict", "")];
  std::string out = fmt::format("{} of {} claims hold", counts["holds"], claims.size());
  if (const int fails = counts["does not hold"]; fails > 0)
    out += fmt::format(", {} {} not", fails, fails == 1 ? "does" : "do");
  if (counts["open"] > 0) out += fmt::format(", {} open", counts["open"]);
  if (const int none = counts["no verdict"] + counts["not measured"]; none > 0)
    out += fmt::format(", {} without verdict", none);
  return out;
}

// "Claim: ..." begins with its word in bold.
std::string paragraph(const std::string& text) {
  for (const char* word : {"Claim", "Scene", "What we find", "What differs and why", "What was chosen, and when"}) {
    const std::string start = std::string(word) + ": ";
    if (text.starts_with(start)) return "**" + std::string(word) + ":** " + text.substr(start.size());
  }
  return text;
}

}  // namespace

std::string results_list(const std::vector<ShippedRecipe>& recipes) {
  std::string out;
  for (const ShippedRecipe& recipe : recipes) {
    const ShownRecipe one = shown(recipe);
    std::vector<Json> claims = claims_of(one, true);
    if (claims.empty()) claims = claims_of(one, false);
    std::string verdict;
    for (std::size_t i = 0; i < claims.size() && claims.size() <= 2; ++i)
      verdict +=
          fmt::format("{}{}: {}", i > 0 ? "; " : "", claims[i].value("measured", ""), claims[i].value("verdict", ""));
    if (verdict.empty()) verdict = claims.empty() ? "no verdict on record" : counted(claims);
    out += fmt::format("{:<20} {} [{}]\n", one.name, one.title, verdict);
  }
  return out;
}

Json results_json(const std::vector<ShippedRecipe>& recipes, bool main_only) {
  Json out = Json::array();
  for (const ShippedRecipe& recipe : recipes) {
    const ShownRecipe one = shown(recipe);
    out.push_back(Json{{"name", one.name}, {"title", one.title}, {"claims", claims_of(one, main_only)}});
  }
  return out;
}

std::string results_page(const std::vector<ShippedRecipe>& recipes) {
  std::string out =
      "# Published results, reproduced\n\nWritten by `shakebed reproduce --results`; a test compares. The numbers are "
      "those of the full presets (`docs/results/<recipe>.json`). Each recipe has a page of its own, with its scene, "
      "its figure, all its claims and what differs.\n\nA claim holds where the whole interval of the measured number "
      "lies within what is claimed, and does not hold where all of it lies outside; else it is open. The interval is 3 "
      "standard errors wide to each side, 1.96 in the recipes of Quinn and Hong. Standard errors are those over "
      "replicas. A published number that was not read in print gives no verdict. Where a paper states no error, the "
      "tolerance is ours and is marked so.\n\n| recipe | main claim | claimed | measured | verdict | all claims "
      "|\n|---|---|---|---|---|---|\n";
  for (const ShippedRecipe& recipe : recipes) {
    const ShownRecipe one = shown(recipe);
    const std::string link = fmt::format("[{0}](results/{0}.md)", one.name), all = counted(claims_of(one, false));
    std::string first = link + " | ", last = " " + all + " |";
    if (claims_of(one, true).empty())
      out += "| " + first + "no claims: its report compares number by number | | | | |\n";
    for (const Json& claim : claims_of(one, true)) {
      out += claim_row(claim, first) + last + "\n";
      first = " | ", last = " |";
    }
  }
  return out;
}

std::string recipe_page(const ShippedRecipe& recipe) {
  const ShownRecipe one = shown(recipe);
  std::string out = fmt::format(
      "# {}\n\n`shakebed reproduce {} --preset full`; [all results](../results.md)\n\nWritten by `shakebed reproduce "
      "{} "
      "--results`.\n",
      one.title, one.name, one.name);
  const std::vector<Json> main = claims_of(one, true), all = claims_of(one, false);
  if (!main.empty()) out += "\n| claim | claimed | measured | verdict |\n|---|---|---|---|\n";
  for (const Json& claim : main) out += claim_row(claim, "") + "\n";
  if (const Json* figure = one.record.is_null() ? nullptr : find_pointer(one.record, "/figure"))
    out += fmt::format("\n![{0}]({1})\n\n{0}\n", figure->value("caption", ""), figure->value("file", ""));
  for (const std::string& text : one.text) out += "\n" + paragraph(text) + "\n";
  if (all.empty()) return out + "\nNo result is on record.\n";
  out +=
      "\n## Claim by claim\n\n| claim | claimed | measured | verdict | where it stands, and what was read |\n"
      "|---|---|---|---|---|\n";
  for (const Json& claim : all) out += claim_row(claim, "") + " " + table_cell(claim.value("place", "")) + " |\n";
  return out + fmt::format("\n{}; measured with {}.\n", counted(all), one.record.value("source", ""));
}

}  // namespace shakebed::pipelines
