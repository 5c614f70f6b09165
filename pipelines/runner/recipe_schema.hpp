// JSON Schema (draft-07) of a recipe, for editors and validators.
#pragma once

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

Json recipe_schema();

}  // namespace shakebed::pipelines
