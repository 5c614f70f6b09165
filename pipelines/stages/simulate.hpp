// simulate: a scene → trajectory, profile, observables, by event-driven simulation.
//
// Files: trajectory.extxyz[.zst], profile.csv, observables.json, bed.json (a BedDescription, see bed.hpp: what render,
// fit and map need to know of the bed).
#pragma once

#include "pipelines/stages.hpp"

namespace shakebed::pipelines {

StageRow simulate_stage();

}  // namespace shakebed::pipelines
