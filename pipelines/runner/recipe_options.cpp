#include "pipelines/runner/recipe_options.hpp"

#include <stdexcept>

namespace shakebed::pipelines {

void describe_common(Fields& fields, CommonOptions& common, const StageRow& row) {
  fields.text("stage", common.stage, {.help = "kind of the stage", .required = true});
  fields.text("id", common.id, {.help = "name of the stage and of its folder in OUT; its kind if left out"});
  fields.texts("from", common.from, {.help = "ids of the stages whose results it reads"});
  if (row.uses_seed) fields.integer("seed", common.seed, {.help = "seed of the random number generator"});
  const std::vector<Choice<bool>> units{{false, "SI"}, {true, "reduced"}};
  fields.choice("units", common.reduced, units,
                {.help = "SI: quantities are strings with a unit or numbers in SI. reduced: plain numbers, lengths in "
                         "D, masses in m, g or the starting T equal to 1"});
}

namespace {

void describe_published(Fields& f, PublishedNumber& number) {
  f.text("number", number.pointer, {.help = "our number: /<stage id>/<name in its result>", .required = true});
  f.text("label", number.label, {.help = "what it is called", .required = true});
  f.text("value", number.value, {.help = "as published, with its unit", .required = true});
  f.text("place", number.place, {.help = "where it is printed"});
  f.number("relative", number.relative,
           {.help = "relative difference up to which the numbers agree", .range = non_negative});
  if (!f.decoding()) return;
  try {
    if (!number.value.empty()) parse_quantity(number.value);
  } catch (const std::invalid_argument& problem) {
    f.problem("/value", problem.what());
  }
}

void describe_report(Fields& fields, ReportOptions& report) {
  fields.text("title", report.title, {.help = "headline of report.html"});
  fields.texts("text", report.text, {.help = "paragraphs under the headline"});
  fields.array<PublishedNumber>("published", report.published, describe_published,
                                {.help = "published numbers to be compared with our numbers"});
  fields.array<AssumedInput>("assumed", report.assumed,
                             [](Fields& f, AssumedInput& input) {
                               f.text("input", input.pointer, {.help = "pointer into this recipe", .required = true});
                               f.text("why", input.why, {.help = "why it had to be assumed", .required = true});
                             },
                             {.help = "inputs that the source does not give: marked so in the report"});
  fields.boolean(
      "audit", report.audit,
      {.help = "the numbers that Quinn and Hong print beside recomputed ones, as shakebed audit gives them"});
}

}  // namespace

void describe_top(Fields& fields, RecipeTop& top) {
  fields.text("$schema", top.schema, {.help = "where editors find the schema"});
  fields.integer("format", top.format, {.help = "of the recipe"});
  fields.text(
      "name", top.name,
      {.help = "name of the pipeline; results go to results/<name>", .required = true, .example = "\"my-bed\""});
  fields.text("description", top.description, {.help = "what it is for"});
  fields.object<ReportOptions>("report", top.report, describe_report,
                               {.help = "text of report.html beside the results"});
  fields.object<SweepOptions>("sweep", top.sweep, describe_sweep, {.help = "run the pipeline at many points"});
  fields.any("presets", top.presets,
             {.help = "named sets of changes for --preset NAME: {\"quick\": {\"/stages/bed/measure\": \"2 s\"}}"});
  fields.text("$preset", top.preset, {.help = "in resolved.json: the preset whose values these are"});
}

}  // namespace shakebed::pipelines
