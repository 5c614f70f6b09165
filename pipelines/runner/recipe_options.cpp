#include "pipelines/runner/recipe_options.hpp"

#include <stdexcept>

namespace shakebed::pipelines {

void describe_common(Fields& fields, CommonOptions& common, const StageRow& row) {
  fields.text("stage", common.stage, {.help = "kind of the stage", .required = true});
  fields.text("id", common.id, {.help = "name of the stage and of its folder in OUT; its kind if left out"});
  fields.texts("from", common.from, {.help = "ids of the stages whose results are read"});
  if (row.uses_seed) fields.integer("seed", common.seed, {.help = "seed of the random number generator"});
  const std::vector<Choice<bool>> units{{false, "SI"}, {true, "reduced"}};
  fields.choice("units", common.reduced, units,
                {.help = "system of units. \"SI\": strings with a unit, or plain numbers in SI. \"reduced\": plain "
                         "numbers, with lengths in D and masses in m; g is 1 or, without gravity, the initial T is 1"});
}

namespace {

void describe_published(Fields& f, PublishedNumber& number) {
  f.text("number", number.pointer,
         {.help = "pointer to a number of this recipe: /<stage id>/<name in its result>", .required = true});
  f.text("label", number.label, {.help = "name of the number in the report", .required = true});
  f.text("value", number.value, {.help = "published value, with its unit", .required = true});
  f.text("place", number.place, {.help = "place in the paper, for instance a figure or an equation"});
  f.number("relative", number.relative,
           {.help = "relative difference up to which the numbers agree", .range = non_negative});
  f.boolean("beside_answer", number.beside_answer,
            {.help = "whether this number is shown beside the answer, at the top of the report. The first of the list "
                     "always is"});
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
                                {.help = "published numbers with which the report compares the results"});
  fields.array<AssumedInput>("assumed", report.assumed,
                             [](Fields& f, AssumedInput& input) {
                               f.text("input", input.pointer,
                                      {.help = "JSON pointer to the assumed value in this recipe", .required = true});
                               f.text("why", input.why, {.help = "reason for the assumed value", .required = true});
                             },
                             {.help = "inputs that the source does not give; the report marks them as assumed"});
  fields.boolean("audit", report.audit,
                 {.help = "whether the report compares the numbers printed by Quinn and Hong with recomputed ones (as "
                          "shakebed audit)"});
}

}  // namespace

void describe_top(Fields& fields, RecipeTop& top) {
  fields.text("$schema", top.schema, {.help = "address of the JSON Schema, for editors"});
  fields.integer("format", top.format, {.help = "version of the recipe format"});
  fields.text(
      "name", top.name,
      {.help = "name of the recipe; the results folder is results/<name>", .required = true, .example = "\"my-bed\""});
  fields.text("description", top.description, {.help = "purpose of the recipe"});
  fields.object<ReportOptions>("report", top.report, describe_report,
                               {.help = "title, text and published numbers of report.html"});
  fields.object<SweepOptions>("sweep", top.sweep, describe_sweep,
                              {.help = "sweep: values of options at which the recipe is run"});
  fields.any("presets", top.presets,
             {.help = "named sets of changes for --preset NAME: {\"quick\": {\"/stages/bed/measure\": \"2 s\"}}"});
  fields.text("$preset", top.preset, {.help = "name of the applied preset (written by the program in resolved.json)"});
}

}  // namespace shakebed::pipelines
