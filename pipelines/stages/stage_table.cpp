#include "pipelines/stages/stage.hpp"

#include <algorithm>

#include "pipelines/stages/chart.hpp"
#include "pipelines/stages/check.hpp"
#include "pipelines/stages/claims.hpp"
#include "pipelines/stages/critical.hpp"
#include "pipelines/stages/extract.hpp"
#include "pipelines/stages/figure.hpp"
#include "pipelines/stages/fit.hpp"
#include "pipelines/stages/infer.hpp"
#include "pipelines/stages/map.hpp"
#include "pipelines/stages/render.hpp"
#include "pipelines/stages/simulate.hpp"
#include "pipelines/stages/study.hpp"

namespace shakebed::pipelines {

const std::vector<StageRow>& stage_table() {
  static const std::vector<StageRow> table = {simulate_stage(), infer_stage(), study_stage(),  render_stage(),
                                              extract_stage(),  fit_stage(),   map_stage(),    critical_stage(),
                                              figure_stage(),   chart_stage(), claims_stage(), check_stage()};
  return table;
}

const StageRow* find_stage(std::string_view name) {
  const auto& table = stage_table();
  const auto found = std::find_if(table.begin(), table.end(), [&](const StageRow& row) { return row.name == name; });
  return found == table.end() ? nullptr : &*found;
}

}  // namespace shakebed::pipelines
