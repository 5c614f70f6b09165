#include "pipelines/runner/recipe_schema.hpp"

#include "pipelines/runner/recipe_options.hpp"

namespace shakebed::pipelines {

Json recipe_schema() {
  Json schema;
  schema["$schema"] = "http://json-schema.org/draft-07/schema#";
  schema["title"] = "shakebed pipeline";
  RecipeTop top;
  Fields fields = Fields::schema(schema);
  describe_top(fields, top);
  Json stages;
  stages["type"] = "array";
  stages["minItems"] = 1;
  Json kinds = Json::array();
  Json choices = Json::array();
  for (const StageRow& row : stage_table()) {
    kinds.push_back(row.name);
    // In SI, and in reduced units: there quantities are plain numbers, and some options need not be given.
    for (const bool reduced : {false, true}) {
      Json body;
      Fields stage_fields = Fields::schema(body);
      CommonOptions common;
      describe_common(stage_fields, common, row);
      stage_fields.set_reduced(reduced);
      row.make()->describe(stage_fields);
      stage_fields.finish();
      body["description"] = row.summary;
      body["properties"]["stage"] = Json{{"const", row.name}};
      Json is_reduced{{"properties", {{"units", {{"const", "reduced"}}}}}, {"required", Json::array({"units"})}};
      Json choice;
      choice["if"]["properties"]["stage"]["const"] = row.name;
      choice["if"]["required"] = Json::array({"stage"});
      choice["if"]["allOf"] = Json::array({reduced ? is_reduced : Json{{"not", is_reduced}}});
      choice["then"] = std::move(body);
      choices.push_back(std::move(choice));
    }
  }
  stages["items"]["type"] = "object";
  stages["items"]["properties"]["stage"]["enum"] = std::move(kinds);
  stages["items"]["required"] = Json::array({"stage"});
  stages["items"]["allOf"] = std::move(choices);
  schema["properties"]["stages"] = std::move(stages);
  schema["properties"]["presets"]["type"] = "object";
  schema["properties"]["presets"]["additionalProperties"] = Json{{"type", Json::array({"object", "string"})}};
  schema["required"].push_back("stages");
  fields.finish();
  return schema;
}

}  // namespace shakebed::pipelines
