// chart: columns of other stages' tables against one another, with straight lines fitted, curves compared by chi2,
// levels crossed, and residuals below; and snapshots of disks coloured by their order.
//
// Files: NAME.svg, NAME.pdf, NAME.dat, NAME.gp for each chart and snapshot; chart.json with what was computed:
// /NAME/POINTS/{slope, intercept, chi2, dof, p_value}, .../against/{chi2, dof, p_value, mean_difference},
// .../crossings.
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StageRow chart_stage();

}  // namespace shakebed::pipelines
