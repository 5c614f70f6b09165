#include <algorithm>

#include "pipelines/stages/stage.hpp"

// The table: a stage a line, in the order of a pipeline. pipelines/stages/<name>.cpp defines StageRow <name>_stage().
// clang-format off
#define SHAKEBED_STAGES(row) \
  row(simulate) \
  row(infer) \
  row(study) \
  row(render) \
  row(extract) \
  row(fit) \
  row(map) \
  row(critical) \
  row(scaling) \
  row(figure) \
  row(chart) \
  row(claims) \
  row(check)
// clang-format on

namespace shakebed::pipelines {

#define SHAKEBED_DECLARE(name) StageRow name##_stage();
SHAKEBED_STAGES(SHAKEBED_DECLARE)

const std::vector<StageRow>& stage_table() {
#define SHAKEBED_CALL(name) name##_stage(),
  static const std::vector<StageRow> table = {SHAKEBED_STAGES(SHAKEBED_CALL)};
  return table;
}

const StageRow* find_stage(std::string_view name) {
  const auto& table = stage_table();
  const auto found = std::find_if(table.begin(), table.end(), [&](const StageRow& row) { return row.name == name; });
  return found == table.end() ? nullptr : &*found;
}

}  // namespace shakebed::pipelines
