// study: a chain of stages at several values of a parameter, for several kinds of beds, each repeated with seeds of its
// own; the numbers asked for, gathered in one table.
//
// Files: table.csv (one row a series and value: means over the replicas with their standard errors), replicas.csv (one
// row a run), study.json; NAME.csv for every CSV of the chain that "tables" names (its rows, averaged over the
// replicas). Finished runs outlive a kill.
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StageRow study_stage();

}  // namespace shakebed::pipelines
